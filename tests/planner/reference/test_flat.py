"""Büsser's flat earth (eq. 4.2) as the plane that A* plans in: what it costs, and that it costs no soundness."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.geo.frame import LocalFrame
from companion.messages import GeoPoint, Target
from companion.planner import PlanStatus, Problem, plan
from companion.planner.problem.evaluate import evaluate
from companion.planner.reference.astar import FlatPlane, flat_en_from_lonlat
from companion.planners import AUTO, AstarSettings, PlannerChoice, RrtstarSettings
from tests.planner.problems import box, simple

# How far places [m] and courses [deg] of his plane are off the frame, up to 70 deg of latitude (docs/lab/frames.md).
WITHIN = {1_000.0: (6.0, 0.2), 10_000.0: (57.0, 0.3), 50_000.0: (720.0, 1.4)}
lats, courses = st.floats(-70.0, 70.0), st.floats(0.0, 2.0 * math.pi)


@pytest.mark.parametrize("reach_m", sorted(WITHIN))
@settings(max_examples=60)
@given(lat=lats, lon=st.floats(-180.0, 180.0), bearing=courses, share=st.floats(0.0, 1.0), course=courses)
def test_the_plane_is_within_what_the_docs_say(reach_m, lat, lon, bearing, share, course):
    plane = FlatPlane(GeoPoint(lat_deg=lat, lon_deg=lon))
    at = share * reach_m * np.array([math.sin(bearing), math.cos(bearing)])
    there = plane.to([at])
    assert math.dist(there[0], at) <= WITHIN[reach_m][0]
    assert plane.back(there)[0] == pytest.approx(at, abs=1e-3)  # a corner is back where it was, to the mm
    ahead = plane.back(there + 10.0 * np.array([math.sin(course), math.cos(course)]))[0] - at
    off = (math.atan2(*ahead) - course + math.pi) % (2.0 * math.pi) - math.pi
    assert abs(math.degrees(off)) <= WITHIN[reach_m][1]


@pytest.mark.parametrize("lat", [0.0, 50.8, 70.0])
def test_the_worst_of_it_is_near_what_the_docs_say(lat):
    """The bounds are not idle: on a circle of 50 km the plane is off by hundreds of metres."""
    origin = GeoPoint(lat_deg=lat, lon_deg=10.0)
    turn = np.linspace(0.0, 2.0 * math.pi, 73)
    at = 50_000.0 * np.column_stack([np.sin(turn), np.cos(turn)])
    flat = flat_en_from_lonlat(origin, LocalFrame(origin).array_lonlat_from_en(at))
    assert np.hypot(*(flat - at).T).max() == pytest.approx({0.0: 281.0, 50.8: 382.0, 70.0: 716.0}[lat], rel=0.01)


@settings(max_examples=40)
@given(
    lat=lats,
    course=courses,
    at=st.tuples(st.floats(-20_000.0, 20_000.0), st.floats(-20_000.0, 20_000.0)),
    length_m=st.floats(100.0, 10_000.0),
)
def test_a_leg_bends_by_what_solids_are_grown_by_at_the_most(lat, course, at, length_m):
    plane = FlatPlane(GeoPoint(lat_deg=lat, lon_deg=10.0))
    way = plane.to([at]) + np.linspace(0.0, length_m, 21)[:, None] * np.array([[math.sin(course), math.cos(course)]])
    sailed = plane.back(way)
    along = (sailed[-1] - sailed[0]) / np.hypot(*(sailed[-1] - sailed[0]))
    off = np.abs((sailed - sailed[0]) @ np.array([along[1], -along[0]]))
    assert off.max() <= plane.bend_m(length_m, math.hypot(*at) + length_m) + 1e-3


def upwind(**change):
    return Problem.from_json(
        simple(goal={"x": 30, "y": 2000, "radius": 5}, obstacles=[box(-200, 900, 250, 1000)], delta_s=0.5, **change)
    )


@pytest.mark.parametrize("lat", [0.0, 50.8, -70.0])
def test_its_path_stands_in_the_true_frame_and_takes_about_as_long(lat):
    p = upwind()
    numbers = {"grid_m": 50.0, "max_turn_rad": math.radians(150.0)}
    flat = plan(
        p,
        algorithm="astar",
        expansions=10**7,
        settings=AstarSettings(**numbers, projection="flat", origin=GeoPoint(lat_deg=lat, lon_deg=-1.31)),
    )
    true = plan(p, algorithm="astar", expansions=10**7, settings=AstarSettings(**numbers))
    assert flat.has_path
    assert evaluate(p, flat.waypoints_en).is_feasible
    assert flat.cost_s == pytest.approx(true.cost_s, rel=0.1)
    # Planned in other metres: his corners lie on a grid of his plane.
    there = flat.trace["flat_en"]
    assert not np.allclose(there, flat.waypoints_en[: len(there)], atol=0.01)
    plane = FlatPlane(GeoPoint(lat_deg=lat, lon_deg=-1.31))
    assert plane.to(flat.waypoints_en) == pytest.approx(there, abs=1e-3)


def test_a_vessel_goes_into_his_plane_with_its_way():
    plane = FlatPlane(GeoPoint(lat_deg=50.8, lon_deg=-1.31))
    ship = Target(x_m=900.0, y_m=-400.0, vx_mps=3.0, vy_mps=4.0, radius_m=50.0, from_s=60.0, until_s=600.0)
    p = Problem.from_json(simple())
    flat = plane.problem(
        Problem(
            **{f: getattr(p, f) for f in ("start_en", "start_heading_rad", "goal_en", "goal_radius_m", "wind", "boat")},
            targets=(ship,),
        )
    ).targets[0]
    for t in (60.0, 200.0):
        there = plane.to([(ship.x_m + ship.vx_mps * t, ship.y_m + ship.vy_mps * t)])[0]
        assert (flat.x_m + flat.vx_mps * t, flat.y_m + flat.vy_mps * t) == pytest.approx(there, abs=0.05)
    assert flat.radius_m >= ship.radius_m


def test_without_an_origin_there_is_no_plan_and_it_says_so():
    found = plan(upwind(), algorithm="astar", expansions=1000, settings=AstarSettings(projection="flat"))
    assert found.status is PlanStatus.INVALID
    assert "where the problem's metres count from" in found.reason


def test_only_a_choice_of_his_plane_is_told_of_the_origin():
    origin = GeoPoint(lat_deg=50.0, lon_deg=1.0)
    flat = PlannerChoice(algorithm="astar", settings=AstarSettings(projection="flat"))
    assert flat.about(origin).settings.origin == origin
    for other in (
        AUTO,
        PlannerChoice(algorithm="astar", settings=AstarSettings()),
        PlannerChoice(algorithm="rrtstar", settings=RrtstarSettings()),
    ):
        assert other.about(origin) is other
