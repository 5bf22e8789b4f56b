"""What the scorer says where a mutant said otherwise: vessels beside a leg, a beat in another wind, broken shapes."""

import math
from dataclasses import replace

import numpy as np
import pytest
import shapely

from companion.planner import Problem
from companion.planner.problem.evaluate import LARGE, SolidObstacles, beat_s, evaluate
from companion.planner.problem.tracking import Tracking
from companion.planner.problem.value import defect_of
from tests.planner.problems import simple


@pytest.mark.parametrize(("beside_m", "is_met"), [(10.5, False), (9.5, True)])
def test_a_vessel_beside_a_leg_that_is_sailed_needs_no_more_room_than_it_has(beside_m, is_met):
    target = {"x": beside_m, "y": -75.0, "vx": 0.0, "vy": 0.0, "radius_m": 10.0}
    p = Problem.from_json(simple(goal={"x": 0, "y": -150, "radius": 1}, targets=[target]))
    assert evaluate(p, [(0.0, 0.0), (0.0, -150.0)]).is_feasible is not is_met


def test_a_beat_takes_the_same_wherever_the_wind_is_from():
    north = Problem.from_json(
        simple(beat={"no_go_half_deg": 45.0, "corridor_m": 10.0, "clearance_m": 8.0, "tack_s": 1.8})
    )
    wanted = beat_s(north, north.beat, 200.0 * math.sin(0.3), 200.0 * math.cos(0.3))
    for turned in (0.7, 2.5, 4.0):
        wind = replace(north, wind=replace(north.wind, twd_from_rad=turned))
        course = turned + 0.3
        found = beat_s(wind, wind.beat, 200.0 * math.sin(course), 200.0 * math.cos(course))
        assert found == pytest.approx(wanted)


def test_a_shape_that_is_drawn_across_itself_is_solid_among_thousands_of_corners():
    bow_tie = shapely.Polygon([(-10, 40), (10, 60), (10, 40), (-10, 60)])
    far = shapely.Point(900.0, 900.0).buffer(50.0, quad_segs=LARGE)
    p = replace(Problem.from_json(simple()), obstacles=(bow_tie, far))
    shore = SolidObstacles(p)
    assert shore.is_large
    assert [shore.hits(shapely.LineString([(x, 0), (x, 100)])) for x in (-8.0, 8.0, 20.0)] == [True, True, False]
    assert not shore.hits(shapely.LineString([(-3.0, 40.0), (3.0, 40.0)]))  # between its wings
    assert not np.any([not shapely.is_valid(g) for g in shore.tree.geometries])


def test_a_corner_beyond_any_frame_is_found_among_near_ones():
    p = Problem.from_json(simple())
    assert "local frame" in (defect_of(replace(p, obstacles=(shapely.box(0.0, 0.0, 1.0, 2e9),))) or "")


def test_a_hull_of_which_nothing_is_said_reaches_nowhere():
    assert Tracking(helm=None, floor_m=6.0).reach_m == 0.0
