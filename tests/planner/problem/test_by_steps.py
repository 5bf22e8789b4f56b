"""The exact scorer against a boat that is sailed in small steps: another way to the same answer."""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
import shapely
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from companion.geo.angles import wrap_pi
from companion.messages import Target
from companion.planner import Problem
from companion.planner.problem.evaluate import SolidObstacles, beat_s, clearances, evaluate, ground_track, target_hit
from companion.planner.problem.parts import Beat, Current
from tests.planner.problems import POLAR, box, simple

SPEEDS = st.floats(-2.0, 2.0)
TARGETS = st.builds(
    Target,
    x_m=st.floats(-60.0, 60.0),
    y_m=st.floats(-60.0, 60.0),
    vx_mps=SPEEDS,
    vy_mps=SPEEDS,
    radius_m=st.floats(0.0, 15.0),
    growth_mps=st.floats(0.0, 0.3),
    from_s=st.floats(0.0, 60.0),
    until_s=st.one_of(st.just(math.inf), st.floats(40.0, 120.0)),
)
AT = st.floats(-80.0, 80.0)
CENTIMETRES = st.integers(-8000, 8000).map(lambda c: 0.01 * c)


@settings(max_examples=100)
@given(
    target=TARGETS,
    a=st.tuples(AT, AT),
    b=st.tuples(AT, AT),
    t0=st.floats(0.0, 50.0),
    takes=st.floats(0.1, 90.0),
    wide=st.floats(0.0, 9.0),
)
def test_a_vessel_is_met_where_a_boat_in_small_steps_meets_it(target, a, b, t0, takes, wide):
    """While it is in force, in a disc that moves and grows; what is within 5 cm of the edge is left open."""
    at = np.linspace(t0, t0 + takes, 2001)
    share = (at - t0) / takes
    x, y = a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1])
    off = np.hypot(x - target.x_m - target.vx_mps * at, y - target.y_m - target.vy_mps * at)
    depth = target.radius_m + wide + target.growth_mps * at - off
    depth = depth[(at >= target.from_s) & (at <= target.until_s)]
    deepest = depth.max(initial=-math.inf)
    assume(abs(deepest) > 0.05)
    problem = replace(Problem.from_json(simple()), targets=(target,))
    assert (target_hit(problem, a, b, t0, t0 + takes, wide) == 0) == (deepest > 0.0)


@pytest.mark.parametrize(("t0", "t1", "met"), [(0.0, 9.9, None), (0.0, 10.1, 0), (19.9, 30.0, 0), (20.1, 30.0, None)])
def test_a_boat_that_lies_still_is_met_while_the_vessel_is_in_force(t0, t1, met):
    target = Target(x_m=0.0, y_m=0.0, vx_mps=0.0, vy_mps=0.0, radius_m=5.0, from_s=10.0, until_s=20.0)
    problem = replace(Problem.from_json(simple()), targets=(target,))
    assert target_hit(problem, (4.9, 0.0), (4.9, 0.0), t0, t1) == met
    assert target_hit(problem, (5.1, 0.0), (5.1, 0.0), t0, t1) is None


@pytest.mark.parametrize(("off_m", "met"), [(10.0, None), (9.99, 0)])
def test_a_disc_that_is_only_touched_is_not_met(off_m, met):
    target = Target(x_m=off_m, y_m=50.0, vx_mps=0.0, vy_mps=0.0, radius_m=10.0)
    problem = replace(Problem.from_json(simple()), targets=(target,))
    assert target_hit(problem, (0.0, 0.0), (0.0, 100.0), 0.0, 60.0) == met


def test_of_two_vessels_the_first_that_is_met_is_named_and_a_turn_in_place_takes_time_to_be_met_in():
    far = Target(x_m=500.0, y_m=0.0, vx_mps=0.0, vy_mps=0.0, radius_m=5.0)
    by = Target(x_m=-30.0, y_m=0.0, vx_mps=10.0, vy_mps=0.0, radius_m=2.0, until_s=4.0)  # over the start after 3 s
    problem = replace(Problem.from_json(simple(goal={"x": 0, "y": -150, "radius": 1})), targets=(far, by))
    assert evaluate(problem, [[0, 0], [0, -150]]).reasons == ("leg 0: meets target 1",)  # it turns for 6 s first
    ready = replace(problem, start_heading_rad=math.pi)
    assert evaluate(ready, [[0, 0], [0, -150]]).is_feasible == (3.0 * 1.5 > 2.0)  # away with 1.5 m/s by then


CURRENT = st.builds(Current, set_rad=st.floats(0.0, 6.3), drift_mps=st.floats(0.05, 1.4))


@settings(max_examples=60)
@given(current=CURRENT, course=st.floats(-math.pi, math.pi), deepest=st.sampled_from([180, 150]))
def test_in_a_current_no_heading_is_faster_along_the_course_than_the_one_that_is_held(current, course, deepest):
    boat = simple()["boat"] | {"speed": POLAR, "max_twa_deg": deepest}
    problem = replace(Problem.from_json(simple(boat=boat)), current=current)
    heading, made = ground_track(problem, math.sin(course), math.cos(course))

    def over_ground(h):
        speed = np.interp(np.abs(h), problem.boat.polar_twa_rad, problem.boat.polar_mps)
        east, north = speed * np.sin(h) + current.en_mps[0], speed * np.cos(h) + current.en_mps[1]
        return east * math.sin(course) + north * math.cos(course), east * math.cos(course) - north * math.sin(course)

    grid = np.linspace(-math.pi, math.pi, 3601)
    along, aside = over_ground(grid)
    crosses = aside[:-1] * aside[1:] <= 0.0  # between two headings she goes along the course
    off = np.abs(0.5 * (grid[:-1] + grid[1:]))
    is_open = (off >= problem.boat.no_go_half_rad + 1e-3) & (off <= problem.boat.max_twa_rad - 1e-3)
    reached = np.minimum(along[:-1], along[1:])
    best = reached[crosses & is_open].max(initial=-math.inf)
    if made > 0.0:
        assert over_ground(wrap_pi(heading)) == (pytest.approx(made, abs=1e-9), pytest.approx(0.0, abs=1e-9))
    if best > 0.01:
        assert made >= best - 1e-6
        twa = abs(wrap_pi(heading))
        assert problem.boat.no_go_half_rad - 1e-6 <= twa <= problem.boat.max_twa_rad + 1e-6
    elif np.maximum(along[:-1], along[1:])[crosses].max(initial=-math.inf) < -0.01:
        assert (heading, made) == (course, 0.0)


@settings(max_examples=60)
@given(
    ends=st.lists(st.tuples(CENTIMETRES, CENTIMETRES), min_size=2, max_size=2, unique=True),
    floor=st.sampled_from([0.0, 3.0]),
    fenced=st.booleans(),
)
def test_among_many_shapes_a_leg_collides_as_it_does_among_the_union_of_them(ends, floor, fenced):
    islands = [box(x, y, x + 9, y + 9) for x in range(-75, 75, 30) for y in range(-75, 75, 30)]
    whole = Problem.from_json(
        simple(obstacles=islands, fence=box(-78, -78, 78, 78) if fenced else None, clearance_floor_m=floor)
    )
    line = shapely.LineString(ends)
    near = SolidObstacles(whole)
    near.is_large = True
    deep = whole.solid.intersection(line).length
    outside = fenced and not whole.fence_polygon.covers(line)
    assume(deep > 0.1 or (deep == 0.0 and whole.solid.distance(line) > 0.02))
    assert near.hits(line) == SolidObstacles(whole).hits(line) == (deep > 0.0 or outside)


def turned(en, by_rad):
    """Return places (n, 2) turned clockwise about the origin, as a compass turns."""
    east, north = np.asarray(en, dtype=np.float64).T
    return np.column_stack(
        [math.cos(by_rad) * east + math.sin(by_rad) * north, math.cos(by_rad) * north - math.sin(by_rad) * east]
    )


@settings(max_examples=60)
@given(
    middle=st.lists(st.tuples(CENTIMETRES, CENTIMETRES), min_size=1, max_size=3, unique=True),
    wind_deg=st.floats(-180.0, 180.0),
    by_deg=st.floats(-180.0, 180.0),
    drift=st.sampled_from([0.0, 0.6]),
)
def test_the_whole_water_turned_about_is_sailed_in_the_same_time(middle, wind_deg, by_deg, drift):
    """Wind, current, headings, vessel and rocks turned by one angle: north is a convention of the chart."""
    by, sigma = math.radians(by_deg), {"model": "kalman", "sigma0_deg": 2, "growth_deg_per_sqrt_s": 0.3}
    boat = simple()["boat"] | {"speed": POLAR, "tack_loss_s": 5.0, "gybe_loss_s": 3.0, "max_twa_deg": 160}
    path = np.array([(0.0, 0.0), *middle, (0.0, 99.0)])
    assume(all(math.dist(a, b) > 0.1 for a, b in itertools.pairwise(path)))

    def water(turn):
        (vx, vy), (x, y) = turned([[1.0, -0.5]], turn)[0], turned([[-40.0, 60.0]], turn)[0]
        goal = turned([[0.0, 100.0]], turn)[0]
        problem = Problem.from_json(
            simple(
                boat=boat,
                start={"x": 0, "y": 0, "heading_deg": 30 + math.degrees(turn)},
                goal={"x": goal[0], "y": goal[1], "radius": 2},
                wind={"from_deg": wind_deg + math.degrees(turn), "speed_mps": 5, "sigma": sigma},
                current={"set_deg": 70 + math.degrees(turn), "drift_mps": drift},
            )
        )
        rock = shapely.Polygon(turned([(20, 20), (40, 20), (40, 50), (20, 50)], turn))
        vessel = Target(x_m=x, y_m=y, vx_mps=vx, vy_mps=vy, radius_m=8.0)
        return evaluate(replace(problem, obstacles=(rock,), targets=(vessel,)), turned(path, turn))

    here, there = water(0.0), water(by)
    assert there.time_s == pytest.approx(here.time_s, rel=1e-6)
    assert [leg.twa_rad for leg in there.legs] == pytest.approx([leg.twa_rad for leg in here.legs], abs=1e-6)
    headings = [wrap_pi(b.heading_rad - a.heading_rad - by) for a, b in zip(here.legs, there.legs, strict=True)]
    assert headings == pytest.approx([0.0] * len(headings), abs=1e-6)
    assert (there.tacks, there.gybes, len(there.reasons)) == (here.tacks, here.gybes, len(here.reasons))


def test_the_clearance_of_a_leg_is_to_the_nearest_rock_or_fence_less_the_floor():
    rocks, fence = [box(20, 0, 30, 10), box(-50, 0, -40, 10)], box(-60, -40, 60, 200)
    path = [[0, 0], [50, 50], [0, 100]]
    for floor in (0.0, 3.0):
        problem = Problem.from_json(simple(obstacles=rocks, fence=fence, clearance_floor_m=floor))
        legs = clearances(problem, evaluate(problem, path).legs)
        assert [leg.clearance_m for leg in legs] == [pytest.approx(10.0 / 2**0.5 - floor), pytest.approx(10.0 - floor)]
    open_water = Problem.from_json(simple())
    assert clearances(open_water, evaluate(open_water, path).legs) == evaluate(open_water, path).legs
    assert clearances(open_water, ()) == ()


def test_through_the_eye_is_a_tack_through_the_stern_a_gybe_and_the_first_turn_can_be_neither():
    tack = evaluate(Problem.from_json(simple()), [[0, 0], [50, 50], [0, 100]])
    gybe = evaluate(Problem.from_json(simple(goal={"x": 0, "y": -100, "radius": 1})), [[0, 0], [30, -50], [0, -100]])
    assert [leg.manoeuvre for leg in tack.legs] == ["", "tack"]
    assert [leg.manoeuvre for leg in gybe.legs] == ["", "gybe"]
    assert (tack.tacks, tack.gybes, gybe.tacks, gybe.gybes) == (1, 0, 0, 1)


def test_a_boat_that_cannot_tack_gybes_round_by_a_leg_with_room():
    boat = simple()["boat"] | {"can_tack": False, "gybe_room_m": 10}
    start = {"x": 0, "y": 0, "heading_deg": 50}
    problem = Problem.from_json(simple(boat=boat, start=start))
    tack = evaluate(problem, [[0, 0], [50, 50], [0, 100]])
    assert any("cannot tack" in reason for reason in tack.reasons)
    round_by = evaluate(problem, [[0, 0], [50, 50], [60, 40], [48, 30], [0, 100]])
    assert not any("cannot tack" in reason for reason in round_by.reasons)
    short = evaluate(problem, [[0, 0], [50, 50], [55, 45], [52, 42], [0, 100]])
    assert any("has turned" in reason for reason in short.reasons)


@pytest.mark.parametrize(("course_deg", "is_refused"), [(-80.0, True), (-94.0, True), (-96.0, False)])
def test_a_boat_that_cannot_tack_turns_through_the_stern_with_ten_degrees_to_spare(course_deg, is_refused):
    """From 95 degrees on one side to 94 on the other are 171 through the stern."""
    course, boat = math.radians(course_deg), simple()["boat"] | {"can_tack": False, "gybe_room_m": 10}
    end = (90.0 * math.sin(course), 90.0 * math.cos(course))
    problem = Problem.from_json(simple(boat=boat, start={"x": 0, "y": 0, "heading_deg": 95}))
    assert any("cannot tack" in reason for reason in evaluate(problem, [(0, 0), end]).reasons) is is_refused


def test_a_leg_right_into_the_wind_is_no_tack_for_a_boat_that_cannot_tack():
    problem = Problem.from_json(simple(boat=simple()["boat"] | {"can_tack": False, "gybe_room_m": 10}))
    reasons = evaluate(problem, [[0, 0], [0, 99]]).reasons
    assert len(reasons) == 1
    assert "no-go" in reasons[0]


@pytest.mark.parametrize("off_deg", [-40.0, -10.0, 0.0, 25.0, 44.0])
def test_a_beat_off_the_wind_is_as_long_on_each_tack_as_makes_the_leg_good(off_deg):
    """One board to the corner and one to the end, by the law of sines; each crosses the corridor from edge to edge."""
    half, off, length = math.radians(45.0), math.radians(off_deg), 400.0
    problem = Problem.from_json(simple(boat=simple()["boat"] | {"speed": POLAR}))
    beat = Beat(no_go_half_rad=half, corridor_m=20.0, clearance_m=5.0, tack_s=6.0)
    takes_s, tacks = beat_s(problem, beat, length * math.sin(off), length * math.cos(off))
    right, left = (length * math.sin(half + side * off) / math.sin(2.0 * half) for side in (1.0, -1.0))
    assert tacks == pytest.approx(right * math.sin(half - off) / 20.0)
    assert takes_s == pytest.approx((right + left) / problem.boat.speed_mps(half) + 6.0 * tacks)


@pytest.mark.parametrize(("set_deg", "along"), [(0.0, 1.0), (180.0, -1.0)])
def test_a_beat_in_a_current_is_sailed_through_the_water_and_carried_over_the_ground(set_deg, along):
    """Dead to windward: the way made good is the boat's and the water's, the tacks are those of the way through it."""
    beat = Beat(no_go_half_rad=math.radians(45.0), corridor_m=20.0, clearance_m=5.0, tack_s=6.0)
    still = Problem.from_json(simple(boat=simple()["boat"] | {"speed": POLAR}))
    in_still_s, tacks = beat_s(still, beat, 0.0, 400.0)
    windward_mps = 400.0 / (in_still_s - 6.0 * tacks)
    current = Current(set_rad=math.radians(set_deg), drift_mps=0.3)
    took_s, crossings = beat_s(replace(still, current=current), beat, 0.0, 400.0)
    made_mps = windward_mps + along * 0.3
    assert took_s - 6.0 * crossings == pytest.approx(400.0 / made_mps, rel=1e-3)
    assert crossings == pytest.approx(tacks * windward_mps / made_mps, rel=1e-3)
    against = Current(set_rad=math.pi, drift_mps=3.0)
    assert beat_s(replace(still, current=against), beat, 0.0, 400.0) == (math.inf, 0.0)
