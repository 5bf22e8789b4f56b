"""Corners that the autopilot can follow: short legs go, start and end stay, nothing comes nearer than it may."""

import math
from itertools import pairwise

import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.skipper.way.corners import Quality, spread
from companion.skipper.way.geometry import distance_m
from tests.skipper.world import area

OPEN = area()
ROCK = area(shapely.Point(0.0, 50.0).buffer(20.0))


def among(water, margin_m=0.0):
    """Judge a path as a planner does whose obstacles are grown by ``margin_m``."""
    def quality(path):
        clearance_m = water.path_clearance_m(path)
        time_s = sum(distance_m(a, b) for a, b in pairwise(path))
        return Quality(is_feasible=clearance_m >= margin_m, is_sailable=True, clearance_m=clearance_m, time_s=time_s)
    return quality


def shortest_m(path):
    return min(distance_m(a, b) for a, b in pairwise(path))


def round_the_rock(radius_m, step_deg):
    """The way that a planner takes round the rock: along its grown outline, in steps of so many degrees."""
    angles = [math.radians(a) for a in range(-60, 61, step_deg)]
    arc = [(-radius_m * math.cos(a), 50.0 + radius_m * math.sin(a)) for a in angles]
    return [(-20.0, -80.0), *arc, (0.0, 200.0)]


def test_two_corners_become_one_where_their_legs_meet():
    path = [(0.0, 0.0), (0.0, 80.0), (3.0, 84.0), (83.0, 84.0)]
    assert shortest_m(spread(path, least_m=12.0, floor_m=6.0, quality=among(OPEN))) >= 12.0
    round_it = among(area(shapely.box(10.0, 0.0, 60.0, 74.0)), 9.0)
    assert spread(path, least_m=12.0, floor_m=6.0, quality=round_it) == [(0.0, 0.0), (0.0, 84.0), (83.0, 84.0)]


@pytest.mark.parametrize("step_deg", [10, 15, 20, 30])
@pytest.mark.parametrize("least_m", [9.0, 15.0])
def test_a_rock_is_rounded_in_legs_that_are_long_enough(step_deg, least_m):
    path = round_the_rock(32.0, step_deg)
    after = spread(path, least_m=least_m, floor_m=6.0, quality=among(ROCK, 11.0))
    assert after[0] == path[0]
    assert after[-1] == path[-1]
    assert shortest_m(after) >= least_m
    assert ROCK.path_clearance_m(after) >= 6.0


def test_where_the_margin_is_full_on_both_sides_the_roomiest_way_above_the_floor_is_taken():
    """Between two rocks 24 m apart, a margin of 12 m: no other way passes the planner's check."""
    water = area(shapely.box(-100.0, 40.0, -12.2, 60.0), shapely.box(12.2, 40.0, 100.0, 60.0))
    path = [(-30.0, -40.0), (0.0, 38.0), (0.0, 43.0), (30.0, 140.0)]
    after = spread(path, least_m=15.0, floor_m=6.0, quality=among(water, 12.0))
    assert shortest_m(after) >= 15.0
    assert water.path_clearance_m(after) >= 6.0


def test_a_short_leg_stays_where_there_is_no_other_way():
    water = area(shapely.box(-100.0, 40.0, -2.0, 60.0), shapely.box(2.0, 40.0, 100.0, 60.0))
    path = [(-40.0, 36.0), (0.0, 36.0), (0.0, 44.0), (0.0, 140.0)]
    assert spread(path, least_m=15.0, floor_m=6.0, quality=among(water, 2.0))[0] == path[0]
    assert water.path_clearance_m(spread(path, least_m=15.0, floor_m=2.0, quality=among(water, 2.0))) >= 2.0 - 1e-9


def test_a_way_that_goes_round_a_buoy_on_the_wrong_side_is_none():
    path = [(0.0, 0.0), (0.0, 80.0), (5.0, 84.0), (83.0, 84.0)]

    def quality(way):
        good = len(way) == len(path)
        return Quality(is_feasible=good, is_sailable=good, clearance_m=math.inf, time_s=1.0)

    assert spread(path, least_m=12.0, floor_m=6.0, quality=quality) == path


@settings(deadline=None, max_examples=60, derandomize=True)
@given(st.lists(st.tuples(st.floats(-80.0, 80.0), st.floats(-80.0, 80.0)), min_size=2, max_size=9))
def test_whatever_the_path_it_ends_where_it_did_and_is_no_longer(points):
    after = spread(points, least_m=15.0, floor_m=6.0, quality=among(OPEN))
    assert (after[0], after[-1]) == (points[0], points[-1])
    assert len(after) == 2 or shortest_m(after) >= 15.0
