"""Legs and waypoint advance (Büsser's double conditions), manoeuvres, gates."""

import math
from dataclasses import replace
from itertools import pairwise

import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely.geometry import LineString, box

from companion.geo.angles import difference_rad
from companion.skipper.way.gates import (
    KEEP_SHARE,
    PAST_RAD,
    Approach,
    again,
    astray,
    bearing_on,
    gates_of,
    has_come_round,
    is_on_wrong_side,
)
from companion.skipper.way.geometry import (
    along_m,
    bear_away_rad,
    bearing_rad,
    cross_track_m,
    distance_m,
    gybe_round,
    has_way_out,
    is_past,
    is_tack,
    leg_distance_m,
    moved,
    waypoint_done,
)
from companion.skipper.way.voyage import Goal, Side
from tests.skipper.world import area, voyage

COORD = st.floats(-1000.0, 1000.0)
POINT = st.tuples(COORD, COORD)
ANGLE = st.floats(-math.pi, math.pi)
CHECK = settings(max_examples=100)


@CHECK
@given(POINT, POINT, POINT, ANGLE)
def test_along_and_across_turn_with_the_leg(p, a, b, turn):
    if distance_m(a, b) < 1.0:
        return

    def rotated(q):
        return (q[0] * math.cos(turn) + q[1] * math.sin(turn), q[1] * math.cos(turn) - q[0] * math.sin(turn))

    assert math.isclose(cross_track_m(p, a, b), cross_track_m(rotated(p), rotated(a), rotated(b)), abs_tol=1e-6)
    assert math.isclose(along_m(p, a, b), along_m(rotated(p), rotated(a), rotated(b)), abs_tol=1e-6)
    assert leg_distance_m(p, a, b) >= abs(cross_track_m(p, a, b)) - 1e-6
    assert math.isclose(math.hypot(along_m(p, a, b), cross_track_m(p, a, b)), distance_m(p, a), rel_tol=1e-9)


@CHECK
@given(POINT, ANGLE, st.floats(0.1, 500.0))
def test_moved_goes_where_bearing_says(a, heading, by):
    b = moved(a, heading, by)
    assert math.isclose(distance_m(a, b), by, rel_tol=1e-9)
    assert abs(difference_rad(bearing_rad(a, b), heading)) < 1e-6


@pytest.mark.parametrize(
    ("boat", "after", "done"),
    [
        ((0.0, 101.0), None, True),  # past the perpendicular, within the grid size
        ((0.0, 99.0), None, False),  # before it, no next leg to be near to
        ((30.0, 101.0), None, False),  # past, but farther than the grid size
        ((2.0, 98.0), (100.0, 95.0), True),  # within 3 m of the next leg
        ((-8.0, 95.0), (100.0, 100.0), False),  # far from the next leg
    ],
)
def test_double_conditions(boat, after, done):
    assert waypoint_done(boat, (0.0, 0.0), (0.0, 100.0), after, grid_m=20.0, manoeuvre_m=3.0) is done
    assert is_past(boat, (0.0, 0.0), (0.0, 100.0)) is (boat[1] > 100.0)


@CHECK
@given(ANGLE, st.floats(0.75, 1.5), st.floats(4.0, 100.0), st.floats(8.0, 60.0), st.booleans())
def test_gybe_round_turns_the_other_way_and_ends_on_the_next_leg(twd, twa, next_m, radius_m, port):
    side = 1.0 if port else -1.0
    before, after = twd - side * twa, twd + side * twa
    assert is_tack(before, after, twd)
    start = (0.0, 0.0)
    corner = moved(start, before, 100.0)
    end = moved(corner, after, next_m)
    path = [start, *gybe_round(start, [corner, end], twd_from_rad=twd, area=area(), floor_m=5.0, radius_m=radius_m)]
    assert len(path) == 5
    courses = [bearing_rad(a, b) for a, b in pairwise(path)]
    for one, two in pairwise(courses):
        assert not is_tack(one, two, twd)
        assert side * difference_rad(two, one) < 0.0 or one == two
    assert difference_rad(courses[-1], after) == pytest.approx(0.0, abs=1e-9)


def test_gybe_round_needs_room():
    start, corner, end = (0.0, 0.0), (-70.0, 70.0), (0.0, 140.0)
    rock = box(-100.0, 40.0, -80.0, 72.0)
    out = gybe_round(start, [corner, end], twd_from_rad=0.0, area=area(rock), floor_m=8.0, radius_m=8.0)
    assert out == (corner, end)


def test_bear_away_takes_the_clear_side():
    # Wind from north, nose a little to starboard of it: nearer to fall off to starboard, unless a rock lies there.
    assert bear_away_rad((0, 0), 0.1, 0.0, area()) > 0.0
    assert bear_away_rad((0, 0), 0.1, 0.0, area(box(5.0, -50.0, 50.0, 50.0))) < 0.0


def turned_round(buoy, *track):
    """The boat's bearing from the buoy, counted on along the track."""
    return sum(difference_rad(bearing_rad(buoy, b), bearing_rad(buoy, a)) for a, b in pairwise(track))


@pytest.mark.parametrize("side", [Side.PORT, Side.STARBOARD])
@pytest.mark.parametrize("turned", range(0, 360, 45))
def test_gates_go_round_each_buoy_on_the_right_hand(side, turned):
    angle = math.radians(turned)
    hand = 1.0 if side is Side.PORT else -1.0
    places = [(0.0, 200.0), (-150.0 * hand, 100.0), (0.0, 0.0)]
    places = [(e * math.cos(angle) + n * math.sin(angle), n * math.cos(angle) - e * math.sin(angle)) for e, n in places]
    made = voyage(*(Goal(en_m=p, side=side) for p in places), laps=2)
    gates = gates_of(made, (Approach(goal=0, en_m=places[2]),))
    for goal, place in enumerate(places * 2):
        mine = [g for g in gates if g.goal == goal]
        assert [g.ends_goal for g in mine] == [False] * (len(mine) - 1) + [True]
        assert all(math.isclose(distance_m(g.en_m, place), 12.0) for g in mine)
        before = (places * 2)[goal - 1]
        bearing = 0.0
        for there, gate in zip([before, *(g.en_m for g in mine)], mine, strict=False):
            bearing = bearing_on(gate, gate.en_m, bearing_on(gate, there, bearing))
            assert bearing == pytest.approx(gate.bearing_rad)
            assert not is_on_wrong_side(gate, bearing)
            assert is_on_wrong_side(gate, bearing + hand * 2.0 * math.pi)
        if goal < 5:
            turn = -hand * turned_round(place, before, *(g.en_m for g in mine), (places * 2)[goal + 1])
            assert math.pi / 2.0 < turn < 2.0 * math.pi  # a string along this track touches the buoy


@pytest.mark.parametrize("side", [Side.PORT, Side.STARBOARD])
@pytest.mark.parametrize("out", range(0, 360, 30))
@pytest.mark.parametrize("at", [0, -1])
def test_a_buoy_left_on_the_wrong_side_is_rounded_from_there(side, out, at):
    """What was turned the wrong way and the second approach make the rounding that was asked for."""
    hand = 1.0 if side is Side.PORT else -1.0
    start, buoy, after = (0.0, 0.0), (0.0, 200.0), moved((0.0, 200.0), math.radians(out), 150.0)
    made = voyage(Goal(en_m=buoy, side=side), Goal(en_m=after))
    first = [g for g in gates_of(made, (Approach(goal=0, en_m=start),)) if g.goal == 0]
    wrong = first[at].bearing_rad + hand * 2.0 * math.pi
    assert is_on_wrong_side(first[at], wrong)
    second = [g for g in gates_of(made, (again(first[at], first[at].en_m, wrong),)) if g.goal == 0]
    gone = wrong + turned_round(buoy, first[at].en_m, *(g.en_m for g in second))
    want = first[-1].bearing_rad
    if len(first) == 1:  # passed in the middle of its small bend; a round from there ends at the bend's end
        want -= hand * 0.5 * first[0].turn_rad
    assert gone == pytest.approx(want)
    bearing = 0.0
    for gate in second:
        bearing = bearing_on(gate, gate.en_m, bearing)
        assert bearing == pytest.approx(gate.bearing_rad)


def test_a_buoy_that_is_the_whole_course_is_rounded_each_lap():
    made = voyage(Goal(en_m=(0.0, 200.0), side=Side.PORT), laps=3)
    gates = gates_of(made, (Approach(goal=0, en_m=(0.0, 0.0)),))
    turn = turned_round((0.0, 200.0), (0.0, 0.0), *(g.en_m for g in gates))
    assert turn == pytest.approx(-math.pi / 2.0 - 2.0 * 2.0 * math.pi - PAST_RAD)


@pytest.mark.parametrize("side", [Side.PORT, Side.STARBOARD])
@pytest.mark.parametrize("course", range(0, 360, 45))
@pytest.mark.parametrize("is_last", [True, False])
def test_a_buoy_counts_from_abeam_of_it_on_and_on_its_hand_only(side, course, is_last):
    """A radius that reaches to the buoy let her count it before she was abeam, and turn back short of it."""
    hand, buoy, way = 1.0 if side is Side.PORT else -1.0, (0.0, 200.0), math.radians(course)
    after = () if is_last else (Goal(en_m=moved(buoy, way, 200.0)),)
    start = moved(buoy, way, -200.0)
    made = voyage(Goal(en_m=buoy, side=side, radius_m=12.0), *after)
    gate = [g for g in gates_of(made, (Approach(goal=0, en_m=start),)) if g.goal == 0][-1]
    before = moved(moved(buoy, way + hand * math.pi / 2.0, 12.0), way, -10.0 if not is_last else -1.0)
    abeam = moved(moved(buoy, way + hand * math.pi / 2.0, 12.0), way, 1.0)
    other = moved(moved(buoy, way - hand * math.pi / 2.0, 12.0), way, 1.0)
    assert not has_come_round(gate, bearing_on(gate, before, 0.0))
    assert has_come_round(gate, bearing_on(gate, abeam, 0.0))
    assert not has_come_round(gate, bearing_on(gate, other, 0.0))
    assert astray(gate, [start, other, moved(buoy, way, 60.0), gate.en_m], 0.0)


@pytest.mark.parametrize(("side", "hand"), [(Side.PORT, 1.0), (Side.STARBOARD, -1.0)])
@pytest.mark.parametrize("following", [Side.NONE, Side.PORT])
def test_behind_a_buoy_that_was_rounded_no_way_leads_back(side, hand, following):
    """A beat from a leeward mark began behind it, on its other side: told as left to port, it was left to starboard."""
    buoy, windward = (0.0, 0.0), (0.0, 300.0)
    made = voyage(
        Goal(en_m=(-200.0 * hand, 150.0)),
        Goal(en_m=buoy, side=side),
        Goal(en_m=windward, side=following),
        Goal(en_m=buoy),
    )
    gates = gates_of(made)
    last = [g for g in gates if g.goal == 1][-1].en_m
    first = next(g for g in gates if g.goal == 2)
    closed = shapely.union_all([shapely.from_wkt(w.wkt) for w in first.keep_out])
    assert closed.intersects(LineString([last, (0.0, -20.0), (-40.0 * hand, 40.0), first.en_m])), "behind it"
    assert not closed.intersects(LineString([last, (-40.0 * hand, 40.0), first.en_m])), "a board ahead of it"
    assert not closed.intersects(LineString([last, (40.0 * hand, 40.0), first.en_m]))
    others = gates_of(made, (Approach(goal=2, en_m=(0.0, 150.0)),))
    anew = next(g for g in others if g.goal == 2)
    assert len(anew.keep_out) == len(first.keep_out) - 1, "who begins anew from elsewhere may pass there"
    *own, behind = (kept.name for kept in first.keep_out)
    assert behind == "the wrong side of goal 2", "called by the mark that it stands at"
    assert set(own) <= {"the wrong side of goal 3"}


def test_barrier_closes_the_wrong_side():
    made = voyage(Goal(en_m=(0.0, 200.0), side=Side.PORT), Goal(en_m=(-150.0, 100.0)))
    gate = gates_of(made, (Approach(goal=0, en_m=(0.0, 0.0)),))[0]
    closed = shapely.union_all([shapely.from_wkt(w.wkt) for w in gate.keep_out])
    assert closed.intersects(LineString([(0.0, 0.0), (-40.0, 200.0), (0.0, 240.0)]))  # leaves it to starboard
    assert not closed.intersects(LineString([(0.0, 0.0), (40.0, 200.0), (0.0, 240.0)]))


def test_a_buoy_that_is_the_last_is_rounded_for_the_way_home():
    """Left behind abeam of it, she turned home short of it, and left it on the wrong hand."""
    buoy = Goal(en_m=(0.0, 200.0), radius_m=12.0, side=Side.PORT, rounding_m=15.0)
    made = voyage(Goal(en_m=(0.0, 0.0), radius_m=8.0), buoy)
    staying = [gate for gate in gates_of(made) if gate.goal == 1]
    home = [gate for gate in gates_of(replace(made, onward_en_m=(0.0, -50.0))) if gate.goal == 1]
    assert len(staying) == 2
    assert staying[0].en_m == pytest.approx((15.0, 200.0), abs=1e-6)
    assert staying[1].en_m == pytest.approx(moved((0.0, 200.0), math.pi / 2.0 - PAST_RAD, 15.0), abs=1e-6)
    assert len(home) == 3
    assert home[0].en_m == pytest.approx((15.0, 200.0), abs=1e-6)
    assert home[1].en_m == pytest.approx((0.0, 215.0), abs=1e-6)
    assert home[2].en_m == pytest.approx((-15.0, 200.0), abs=1e-6)


@pytest.mark.parametrize(
    ("half_m", "head_m", "radius_m", "is_out"),
    [
        (40.0, 45.0, 15.0, True),  # round in the dock
        (40.0, 45.0, 23.0, False),
        (60.0, 45.0, 23.0, True),
        (40.0, 120.0, 23.0, True),  # straight on
        (None, 20.0, 23.0, True),  # along a quay with open water to one side
    ],
)
def test_a_turn_that_is_wider_than_a_dock_is_no_way_out_of_it(half_m, head_m, radius_m, is_out):
    walls = [box(-300.0, head_m, 300.0, head_m + 10.0)]
    course_rad = math.pi / 2.0 if half_m is None else 0.0
    if half_m is not None:
        walls += [box(-half_m - 10.0, -200.0, -half_m, head_m), box(half_m, -200.0, half_m + 10.0, head_m)]
    out = has_way_out(area(*walls), (0.0, 0.0), course_rad, radius_m=radius_m, reach_m=1.0)
    assert out is is_out


@pytest.mark.parametrize("turn_deg", [100.0, 105.0, 112.0])
def test_round_a_buoy_there_are_no_more_gates_than_it_takes_to_keep_clear_of_it(turn_deg):
    """With three for 112 degrees the legs between them were 7.5 m long: at 3.4 m/s she looped over the buoy."""
    buoy = Goal(en_m=(0.0, 200.0), radius_m=6.0, side=Side.STARBOARD, rounding_m=8.0, name="R")
    off = math.radians(180.0 - turn_deg)
    after = Goal(en_m=(-200.0 * math.sin(off), 200.0 - 200.0 * math.cos(off)), radius_m=10.0)
    mirrored = replace(after, en_m=(-after.en_m[0], after.en_m[1]))
    begin, seen = Approach(goal=0, en_m=(0.0, 0.0)), 0
    for course in ((buoy, after), (buoy, mirrored)):
        legs = list(pairwise(gate.en_m for gate in gates_of(voyage(*course), (begin,)) if gate.goal == 0))
        seen += len(legs)
        assert min((leg_distance_m(buoy.en_m, *leg) for leg in legs), default=math.inf) >= KEEP_SHARE * buoy.rounding_m
        assert min((distance_m(*leg) for leg in legs), default=math.inf) > 10.0
    assert seen > 0
