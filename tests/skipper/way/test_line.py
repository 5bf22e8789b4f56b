"""Lines: which way a track cuts them, where they are crossed, what stands beside them. Signs by property."""

import math
from dataclasses import replace

import pytest
import shapely
from hypothesis import assume, given
from hypothesis import strategies as st

from companion.skipper.way.gates import Approach, astray, gates_of, marks_of, no_room
from companion.skipper.way.geometry import distance_m, moved
from companion.skipper.way.line import (
    BEFORE_M,
    BEYOND_LEAST_M,
    BEYOND_M,
    ahead_m,
    course_rad,
    crossing,
    crossing_en,
    is_between,
    wings,
)
from companion.skipper.way.voyage import Goal, Line, Side
from tests.skipper.world import area, voyage

NORTHWARD = Line(port_en_m=(-20.0, 100.0), starboard_en_m=(20.0, 100.0), keep_m=5.0)
place = st.tuples(st.floats(-200.0, 200.0), st.floats(-200.0, 200.0))


def goal(line):
    middle = tuple((a + b) / 2.0 for a, b in zip(line.port_en_m, line.starboard_en_m, strict=True))
    return Goal(en_m=middle, line=line, name="gate")


def test_with_the_port_mark_to_the_west_it_is_crossed_northward():
    assert course_rad(NORTHWARD) == pytest.approx(0.0)
    assert ahead_m(NORTHWARD, (0.0, 110.0)) == pytest.approx(10.0)
    assert crossing(NORTHWARD, (5.0, 95.0), (5.0, 105.0)).is_forward
    assert not crossing(NORTHWARD, (5.0, 105.0), (5.0, 95.0)).is_forward
    assert crossing(NORTHWARD, (5.0, 95.0), (5.0, 105.0)).from_port_m == pytest.approx(25.0)


@pytest.mark.parametrize(
    ("a", "b"),
    [
        ((25.0, 95.0), (25.0, 105.0)),  # outside of the starboard mark
        ((-25.0, 95.0), (-21.0, 105.0)),  # outside of the port mark
        ((0.0, 90.0), (0.0, 99.0)),  # not over it
    ],
)
def test_what_does_not_cross(a, b):
    assert crossing(NORTHWARD, a, b) is None


@given(a=place, b=place, port=place, starboard=place)
def test_a_track_sailed_back_crosses_the_other_way(a, b, port, starboard):
    assume(distance_m(port, starboard) > 1.0)
    assume(all(shapely.LineString([a, b]).distance(shapely.Point(m)) > 1e-6 for m in (port, starboard)))
    line = Line(port_en_m=port, starboard_en_m=starboard, keep_m=1.0)
    assume(min(abs(ahead_m(line, a)), abs(ahead_m(line, b))) > 1e-6)
    there, back = crossing(line, a, b), crossing(line, b, a)
    assert (there is None) == (back is None)
    assert there is None or (
        there.is_forward != back.is_forward and there.from_port_m == pytest.approx(back.from_port_m, abs=1e-6)
    )


@given(a=place, b=place, port=place, starboard=place)
def test_it_is_crossed_exactly_where_shapely_says(a, b, port, starboard):
    assume(distance_m(port, starboard) > 1.0)
    line = Line(port_en_m=port, starboard_en_m=starboard, keep_m=1.0)
    assume(min(abs(ahead_m(line, a)), abs(ahead_m(line, b))) > 1e-6)
    way = shapely.LineString([a, b])
    assume(min(way.distance(shapely.Point(m)) for m in (port, starboard)) > 1e-6)
    assert (crossing(line, a, b) is not None) == way.crosses(shapely.LineString([port, starboard]))


def test_it_is_crossed_where_the_straight_way_leads_and_clear_of_the_marks():
    assert crossing_en(NORTHWARD, (0.0, 0.0), (0.0, 200.0)) == pytest.approx((0.0, 100.0))
    assert crossing_en(NORTHWARD, (0.0, 0.0), (10.0, 200.0)) == pytest.approx((5.0, 100.0))
    assert crossing_en(NORTHWARD, (-150.0, 50.0), None) == pytest.approx((-10.0, 100.0))
    assert crossing_en(NORTHWARD, None, None) == pytest.approx((0.0, 100.0))


@given(before=place, after=place)
def test_where_it_is_crossed_lies_in_the_opening(before, after):
    cut = crossing_en(NORTHWARD, before, after)
    assert is_between(NORTHWARD, cut)
    assert min(distance_m(cut, NORTHWARD.port_en_m), distance_m(cut, NORTHWARD.starboard_en_m)) >= 8.0


def test_the_wings_stand_outwards_and_end_ashore():
    port, starboard = (shapely.from_wkt(w.wkt) for w in wings(NORTHWARD, area(), 100.0, "L"))
    assert port.bounds[2] == pytest.approx(-20.0, abs=0.6)
    assert starboard.bounds[0] == pytest.approx(20.0, abs=0.6)
    assert port.bounds[0] < -200.0
    land = shapely.box(60.0, 0.0, 400.0, 400.0)
    _, short = (shapely.from_wkt(w.wkt) for w in wings(NORTHWARD, area(land), 100.0, "L"))
    assert 60.0 <= short.bounds[2] <= 66.0
    rock = shapely.Point(45.0, 100.0).buffer(6.0)
    _, beyond = (shapely.from_wkt(w.wkt) for w in wings(NORTHWARD, area(rock), 100.0, "L"))
    assert beyond.bounds[2] > 200.0, "round the outside of a rock beside the mark is no way through"


def test_from_before_the_line_one_gate_leads_across_from_beyond_it_two():
    plain = voyage(goal(NORTHWARD))
    (across,) = gates_of(plain, (Approach(goal=0, en_m=(0.0, 0.0)),))
    assert across.is_crossed
    assert ahead_m(NORTHWARD, across.en_m) == pytest.approx(BEYOND_M)
    before, across = gates_of(plain, (Approach(goal=0, en_m=(0.0, 150.0)),))
    assert not before.is_crossed
    assert ahead_m(NORTHWARD, before.en_m) == pytest.approx(-BEFORE_M)
    assert across.ends_goal
    assert not before.ends_goal


def test_the_same_line_once_more_is_approached_from_before_it_again():
    gates = gates_of(voyage(goal(NORTHWARD), laps=2), (Approach(goal=0, en_m=(0.0, 0.0)),))
    assert [g.is_crossed for g in gates] == [True, False, True]


def test_marks_are_kept_clear_of_on_every_leg():
    v = voyage(Goal(en_m=(0.0, 50.0)), goal(NORTHWARD))
    assert [mark.keep_m for mark in marks_of(v)] == [8.0, 8.0]
    assert shapely.from_wkt(marks_of(v)[0].disc_wkt).contains(
        shapely.Point(moved(NORTHWARD.port_en_m, math.pi / 4.0, 7.9))
    )


def test_what_a_track_strays_is_the_lines_and_not_the_buoys():
    v = voyage(goal(NORTHWARD), Goal(en_m=(0.0, 200.0), side=Side.PORT, rounding_m=12.0))
    assert [mark.keep_m for mark in marks_of(v, 1.0)] == [6.0, 6.0, 6.0]
    assert [mark.keep_m for mark in marks_of(v, 0.0)] == [5.0, 5.0, 6.0]


@pytest.mark.parametrize(
    ("way", "is_through"),
    [
        ([(0.0, 0.0), (0.0, 114.0)], True),
        ([(0.0, 0.0), (40.0, 60.0), (10.0, 90.0), (-5.0, 114.0)], True),
        ([(0.0, 0.0), (300.0, 90.0), (300.0, 120.0), (0.0, 114.0)], False),  # round the end of its wing
        ([(0.0, 0.0), (60.0, 120.0), (0.0, 114.0), (0.0, 90.0)], False),  # through it, back
    ],
)
def test_a_way_to_a_gate_leads_between_its_marks(way, is_through):
    (gate,) = (g for g in gates_of(voyage(Goal(en_m=(0.0, 0.0)), goal(NORTHWARD))) if g.is_crossed)
    assert (astray(gate, way, 0.0) == "") == is_through


@pytest.mark.parametrize("side", [Side.PORT, Side.STARBOARD])
@pytest.mark.parametrize("turns", [0, 1])
def test_a_way_to_a_buoy_leaves_it_on_its_side(side, turns):
    """Behind the end of the barrier, too: there is nothing there that a plan would have to keep out of."""
    hand = 1.0 if side is Side.PORT else -1.0
    made = voyage(Goal(en_m=(0.0, 200.0), side=side), Goal(en_m=(0.0, 400.0)))
    gate = gates_of(made, (Approach(goal=0, en_m=(0.0, 0.0)),))[0]
    begun = -hand * turns * 2.0 * math.pi  # a whole turn round it already, the right way
    assert astray(gate, [(0.0, 0.0), gate.en_m], begun) == ""
    assert astray(gate, [(0.0, 0.0), (hand * 400.0, 150.0), gate.en_m], begun) == ""
    round_it = [(0.0, 0.0), (-hand * 400.0, 200.0), (0.0, 500.0), gate.en_m]
    assert (astray(gate, round_it, begun) == "") == (turns == 1)


CAREFUL = replace(NORTHWARD, margin_m=8.0)
FROM_SOUTH, FROM_NORTH = Approach(goal=0, en_m=(0.0, 0.0)), Approach(goal=0, en_m=(0.0, 150.0))


def beside(*solid, line=CAREFUL, approach=FROM_SOUTH):
    made = voyage(goal(line), obstacles=solid)
    return gates_of(made, (approach,)), made.area


def test_before_a_quay_the_place_beyond_is_as_far_off_as_there_is_room_for():
    (across,), water = beside(shapely.box(-200.0, 118.0, 200.0, 140.0))
    assert ahead_m(CAREFUL, across.en_m) == pytest.approx(9.0)
    assert across.radius_m == pytest.approx(4.5)  # a plan that ends so much before it has crossed
    assert float(water.spare_m([across.en_m], 8.0)[0]) >= 0.0
    assert no_room(across, water, 8.0) == ""
    assert astray(across, [(0.0, 0.0), across.en_m], 0.0) == ""


def test_where_no_place_has_the_margin_it_is_the_roomiest_for_the_ladders_lower_steps_and_said_of_the_line():
    (across,), water = beside(shapely.box(-200.0, 113.0, 200.0, 140.0))
    assert ahead_m(CAREFUL, across.en_m) == pytest.approx(BEYOND_LEAST_M)
    assert no_room(across, water, 5.0) == ""
    assert no_room(across, water, 8.0) == (
        "the line gate is 13 m from o0: no room to cross it with 8.0 m kept clear, 6.0 m at the most beyond it"
    )


def test_where_it_is_roomier_to_one_side_along_the_line_it_is_crossed_there():
    (across,), water = beside(shapely.box(-200.0, 113.0, -6.0, 140.0))
    assert ahead_m(CAREFUL, across.en_m) == pytest.approx(BEYOND_M)
    assert 2.0 <= across.en_m[0] <= 10.0
    assert float(water.spare_m([across.en_m], 8.0)[0]) >= 0.0


def test_the_place_beyond_keeps_clear_of_the_marks_of_another_line():
    """Two gates 20 m apart: the place lay 7.8 m from a mark of the other, and 8 m are kept clear of it."""
    first = goal(NORTHWARD)
    second = goal(Line(port_en_m=(6.0, 112.0), starboard_en_m=(36.0, 112.0), keep_m=5.0))
    made = voyage(first, second)
    off = [distance_m(gate.en_m, mark.en_m) - mark.keep_m for gate in gates_of(made) for mark in marks_of(made)]
    assert min(off) >= 0.0


def test_with_a_mark_on_the_bank_it_is_crossed_off_the_bank():
    bank = shapely.box(-200.0, 0.0, -20.0, 200.0)
    (across,), water = beside(bank, approach=Approach(goal=0, en_m=(-15.0, 0.0)))
    assert -20.0 + 8.0 <= across.en_m[0] <= 10.0
    assert no_room(across, water, 8.0) == ""


def test_no_place_beyond_is_behind_a_wall():
    (across,), _ = beside(shapely.box(-200.0, 110.0, 200.0, 110.5), line=replace(NORTHWARD, margin_m=2.0))
    assert 0.0 < ahead_m(CAREFUL, across.en_m) < 10.0


def test_the_place_before_it_fits_the_water_too():
    (before, across), water = beside(shapely.box(-200.0, 60.0, 200.0, 81.0), approach=FROM_NORTH)
    assert not before.is_crossed
    assert -18.0 < ahead_m(CAREFUL, before.en_m) <= -9.0
    assert before.radius_m < 10.0
    assert no_room(before, water, 8.0) == ""
    assert across.from_en_m == before.en_m


def test_what_an_obstacle_keeps_for_itself_is_kept_there_too():
    made = voyage(goal(CAREFUL))
    quay = shapely.box(-200.0, 124.0, 200.0, 140.0)
    wide = replace(made, area=made.area.also(("quay",), (quay,), (12.0,)))
    assert ahead_m(CAREFUL, gates_of(made, (FROM_SOUTH,))[0].en_m) == pytest.approx(BEYOND_M)
    assert ahead_m(CAREFUL, gates_of(wide, (FROM_SOUTH,))[0].en_m) == pytest.approx(11.0)  # another water, asked anew
