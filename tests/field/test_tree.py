"""Composed fields: bounded and finite everywhere, what each atom and operation does, the way out of some water."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely.geometry import Polygon, box

from companion.field.guidance import step
from companion.field.look_ahead import way_out_rad
from companion.field.projection import HysteresisRing, HysteresisZone, Projection
from companion.field.tree import (
    Along,
    AwayFrom,
    AwayFromLine,
    FieldConditions,
    FieldTree,
    Heading,
    Named,
    OutOf,
    PointTo,
    Round,
    StayAt,
    field_of,
    lengths,
    parse,
    zone_of,
)
from companion.field.values import GuidanceSettings, GuidanceState, Intent, MovingObstacle, Situation
from companion.geo.angles import difference_rad
from tests.field.test_expression import expressions

SQUARE = box(-100.0, -100.0, 100.0, 100.0)
SEEN = Situation(t_s=0.0, en_m=(0.0, 0.0), velocity_en_mps=(0.0, 0.0), heading_rad=0.0, twd_from_rad=0.0)
NORTH = FieldConditions(seen=SEEN)
metres = st.floats(-3e4, 3e4)
places = st.tuples(metres, metres)
sizes = st.floats(5.0, 5000.0)
atoms = st.one_of(
    st.builds(PointTo, at_en=places),
    st.builds(StayAt, at_en=places),
    st.builds(Along, from_en=places, to_en=places),
    st.builds(Round, at_en=places, radius_m=sizes, is_clockwise=st.booleans()),
    st.builds(AwayFrom, at_en=places, range_m=st.floats(1.0, 5000.0)),
    st.builds(AwayFromLine, from_en=places, to_en=places, range_m=st.floats(1.0, 5000.0)),
    st.builds(Heading, heading_rad=st.floats(0.0, 6.3)),
    st.just(OutOf(water_en=SQUARE)),
)


def tree(text, **named):
    return FieldTree(expression=parse(text, tuple(named), "", ""), atoms=tuple(named.items()))


def at(made, *points, conditions=NORTH):
    return field_of(made, conditions)(points)


@settings(max_examples=60)
@given(
    expressions,
    st.tuples(atoms, atoms, atoms, atoms),
    st.lists(places, min_size=1, max_size=4),
    st.floats(-7.0, 7.0),
    st.booleans(),
)
def test_any_field_is_finite_and_bounded_anywhere(expression, four, points, twd, sails):
    names = ("ring", "islet", "lane_2", "Ship")
    made = FieldTree(expression=expression, atoms=tuple(zip(names, four, strict=True)))
    here = FieldConditions(seen=replace(SEEN, twd_from_rad=twd), habits=GuidanceSettings(is_sailing=sails))
    ends = [e for atom in four for e in (getattr(atom, "at_en", None), getattr(atom, "from_en", None)) if e is not None]
    every = np.array([*points, *ends])
    v = field_of(made, here)(every)
    assert v.shape == every.shape
    assert np.isfinite(v).all()
    assert (lengths(made, here, every) <= 20.0 * 8 * 100.0**8).all()
    zone = zone_of(made, here)
    sailable = Projection(field=field_of(made, here), twd_from_rad=twd, zone=zone)
    heading, length, q = sailable.steer(points[0], 1)
    assert math.isfinite(heading)
    assert math.isfinite(length)
    assert q in {-1, 1}
    if length > 1e-6:
        assert abs(difference_rad(heading, twd)) >= math.pi / 4.0 - 1e-6


def test_atoms_lie_where_they_are_told():
    assert at(tree("a", a=PointTo(at_en=(100.0, 50.0))), (100.0, 0.0))[0] == pytest.approx((0.0, 10.0), abs=0.3)
    ring = Round(at_en=(100.0, 0.0), radius_m=40.0)
    assert at(tree("a", a=ring), (100.0, 40.0))[0] == pytest.approx((10.0, 0.0))
    back = at(tree("a", a=replace(ring, is_clockwise=False)), (100.0, 40.0))[0]
    assert back == pytest.approx((-10.0, 0.0))
    away = tree("a", a=AwayFrom(at_en=(100.0, 0.0), range_m=30.0))
    assert at(away, (130.0, 0.0))[0] == pytest.approx((20.0 / math.e, 0.0))
    lane = tree("a", a=Along(from_en=(0.0, 0.0), to_en=(0.0, 100.0)))
    assert at(lane, (0.0, 20.0))[0] == pytest.approx((0.0, 10.0))
    line = tree("a", a=AwayFromLine(from_en=(0.0, 0.0), to_en=(0.0, 100.0), range_m=30.0))
    assert at(line, (30.0, 500.0))[0] == pytest.approx((20.0 / math.e, 0.0), abs=1e-9)


def test_sum_weights_and_the_longest():
    named = {"east": Heading(heading_rad=math.pi / 2.0), "north": Heading(heading_rad=0.0)}
    assert at(tree("east + 0.5 * north", **named), (0.0, 0.0))[0] == pytest.approx((10.0, 5.0))
    assert at(tree("max(east, 2 * north)", **named), (0.0, 0.0))[0] == pytest.approx((0.0, 20.0))
    assert at(tree("max(east, north)", **named), (0.0, 0.0))[0] == pytest.approx((10.0, 0.0))


def test_a_part_is_projected_before_it_is_added():
    """North against the wind: by itself it becomes north-east, and only then something is added."""
    named = {"north": Heading(heading_rad=0.0), "west": Heading(heading_rad=-math.pi / 2.0)}
    v = at(tree("project(north) + west", **named), (0.0, 0.0))[0]
    assert v == pytest.approx((10.0 * math.sqrt(0.5) - 10.0, 10.0 * math.sqrt(0.5)))
    motor = FieldConditions(seen=SEEN, habits=GuidanceSettings(is_sailing=False))
    assert at(tree("project(north) + west", **named), (0.0, 0.0), conditions=motor)[0] == pytest.approx((-10.0, 10.0))


def test_the_zone_is_that_of_the_first_trajectory():
    named = {
        "rock": AwayFrom(at_en=(0.0, 0.0), range_m=9.0),
        "ring": Round(at_en=(1.0, 2.0), radius_m=60.0),
        "lane": Along(from_en=(0.0, 0.0), to_en=(0.0, 100.0), zone_m=30.0),
    }
    assert isinstance(zone_of(tree("rock + 2 * ring + lane", **named), NORTH), HysteresisRing)
    found = zone_of(tree("rock + max(lane, ring)", **named), NORTH)
    assert found == HysteresisZone(at_en=(0.0, 0.0), course_rad=0.0, half_m=30.0)
    assert zone_of(tree("rock", **named), NORTH) is None
    assert zone_of(tree("ring", **named), NORTH).half_m == 15.0  # a quarter of a small circle
    assert zone_of(tree("ring", **named), FieldConditions(seen=SEEN, habits=GuidanceSettings(is_sailing=False))) is None


@pytest.mark.parametrize("is_clockwise", [True, False])
def test_a_boat_beats_round_the_windward_side_of_a_circle_and_stays_near_it(is_clockwise):
    """A boat without inertia, the wind from the north: once round, and never farther off than the beat is wide."""
    made = tree("ring", ring=Round(at_en=(0.0, 0.0), radius_m=80.0, is_clockwise=is_clockwise))
    habits = GuidanceSettings(turn_rate_radps=1.0, tack_s=1.0)
    state, here, heading, turned, far, bearing = GuidanceState(), (80.0, 0.0), math.pi, 0.0, 0.0, math.pi / 2.0
    for t in range(900):
        seen = Situation(
            t_s=float(t),
            en_m=here,
            heading_rad=heading,
            twd_from_rad=0.0,
            velocity_en_mps=(2.0 * math.sin(heading), 2.0 * math.cos(heading)),
        )
        now = FieldConditions(seen=seen, habits=habits)
        state, setpoint = step(state, seen, Intent(field=field_of(made, now), zone=zone_of(made, now)), habits)
        heading = setpoint.heading_rad
        assert abs(difference_rad(heading, 0.0)) >= habits.no_go_half_rad - 1e-9
        here = here[0] + 2.0 * math.sin(heading), here[1] + 2.0 * math.cos(heading)
        after = math.atan2(here[0], here[1])
        turned, bearing = turned + difference_rad(after, bearing), after
        far = max(far, abs(math.hypot(*here) - 80.0))
    assert turned * (1.0 if is_clockwise else -1.0) > 4.0 * math.pi
    assert far < 30.0


@pytest.mark.parametrize("here", [(0.0, 0.0), (80.0, 0.0), (-80.0, 70.0), (0.0, -90.0)])
def test_the_way_out_is_sailable_and_leads_out_soon(here):
    habits = GuidanceSettings(polar_mps=(2.0, 2.0))
    heading = way_out_rad(replace(SEEN, en_m=here), SQUARE, habits)
    assert abs(difference_rad(heading, 0.0)) > habits.no_go_half_rad
    away = 100.0 - max(abs(here[0]), abs(here[1]))
    there = here[0] + 1.6 * (away + 15.0) * math.sin(heading), here[1] + 1.6 * (away + 15.0) * math.cos(heading)
    assert max(abs(there[0]), abs(there[1])) > 100.0


def test_the_way_out_is_not_through_a_vessel_and_is_kept_for_a_trifle():
    seen = replace(SEEN, en_m=(60.0, 0.0), velocity_en_mps=(2.0, 0.0), heading_rad=math.pi / 2.0)
    free = way_out_rad(seen, SQUARE, GuidanceSettings())
    assert abs(difference_rad(free, math.pi / 2.0)) < math.radians(30.0)
    ship = MovingObstacle(en_m=(110.0, 0.0), keep_m=30.0)
    shut = way_out_rad(replace(seen, obstacles=(ship,)), SQUARE, GuidanceSettings())
    assert abs(difference_rad(shut, free)) > math.radians(25.0)
    middle = replace(SEEN, heading_rad=math.pi / 2.0)
    kept = [way_out_rad(middle, SQUARE, GuidanceSettings(), last) for last in (math.pi / 2.0, -math.pi / 2.0)]
    assert abs(difference_rad(kept[0], kept[1])) > math.radians(25.0)


def test_a_tree_knows_its_station_and_what_it_leaves():
    made = tree("out + stay", out=OutOf(water_en=SQUARE), stay=StayAt(at_en=(3.0, 4.0)))
    assert made.station_en == (3.0, 4.0)
    assert made.leaves == SQUARE
    assert made.text == "out + stay"
    assert FieldTree(expression=Named("a"), atoms=(("a", PointTo(at_en=(0.0, 0.0))),)).leaves is None
    assert isinstance(made.leaves, Polygon)
