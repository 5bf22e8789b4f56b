"""Missions: the splice keeps what is being sailed, the end is safe, ours is told from foreign."""

import json
import math
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely.geometry import LineString, Point, box

from companion.geo.angles import difference_rad
from companion.messages import Command, MissionItem, sailed_part
from companion.skipper.step.config import SafeEnd, SkipperConfig
from companion.skipper.step.missions import (
    Tail,
    common_prefix,
    ends_safely,
    is_mixture,
    is_same_mission,
    loiter_place,
    splice,
)
from companion.skipper.step.route import Route
from companion.skipper.step.saved import Persisted
from companion.skipper.way.gates import marks_of
from companion.skipper.way.voyage import Goal, Side
from tests.skipper.world import voyage

CONFIG = SkipperConfig()
FACTS = Route(
    plan_id=1,
    plan_t_s=0.0,
    plan_twd_from_rad=0.0,
    plan_tws_mps=5.0,
    plan_half_width_rad=0.1,
    margin_m=15.0,
    delta_s=0.95,
)
POINTS = st.lists(st.tuples(st.floats(-500, 500), st.floats(-500, 500)), min_size=1, max_size=8)
CHECK = settings(max_examples=60)


def test_of_a_way_that_no_plan_is_behind_nothing_is_promised():
    planned = replace(
        FACTS, risk=0.2, vessel_risk=0.1, expected_clearance_m=9.5, cost_s=300.0, median_s=310.0, late_s=350.0
    )
    items = tuple(MissionItem(command=Command.NAV_WAYPOINT, lat_e7=n, lon_e7=n) for n in range(4))
    points = tuple((10.0 * n, 0.0) for n in range(4))
    planned = replace(planned, items=items, points_en_m=points, leg_from_en_m=points, gate_of=(-1, 0, -1, 1))
    aside = planned.led_aside(
        2, (15.0, 5.0), [(items[3], (0.0, 9.0)), (items[2], (0.0, 20.0))], rung="hold", why="no way"
    )
    assert aside.items == (*items[:2], items[3], items[2])
    assert aside.points_en_m == (*points[:2], (0.0, 9.0), (0.0, 20.0))
    assert aside.leg_from_en_m == (*points[:2], (15.0, 5.0), (0.0, 9.0))
    assert aside.gate_of == (-1, 0, -1, -1)
    assert (aside.risk, aside.cost_s, aside.median_s, aside.late_s, aside.expected_clearance_m) == (None,) * 5
    assert (aside.vessel_risk, aside.rung, aside.why, aside.plan_id) == (0.0, "hold", "no way", planned.plan_id)


def route(points, old=None, keep=0, gate=0, made=None, config=CONFIG):
    return splice(
        made or voyage(),
        config,
        old,
        keep=keep,
        tail=Tail(start_en=(0.0, 0.0), points_en=tuple(points), gate=gate),
        twd_from_rad=0.3,
        facts=FACTS,
    )


@CHECK
@given(POINTS, POINTS, st.integers(0, 7))
def test_splice_keeps_the_prefix_and_ends_safely(first, second, keep):
    old = route(first)
    keep = min(keep, len(old.items) - 1)
    new = route(second, old=old, keep=keep, gate=1)
    assert new.items[:keep] == old.items[:keep]
    assert common_prefix(old.items, new.items) >= keep
    assert ends_safely(new.items)
    assert sum(item.command == Command.NAV_LOITER_UNLIM for item in new.items) == 1
    assert len(new.items) == keep + len(second) + 1
    assert len(new.items) == len(new.points_en_m) == len(new.leg_from_en_m) == len(new.gate_of)
    assert new.gate_of[-2] == 1
    # Each new leg begins where the one before ends.
    assert all(new.leg_from_en_m[n] == new.points_en_m[n - 1] for n in range(keep + 1, len(new.items)))


@CHECK
@given(POINTS, POINTS, st.integers(0, 9))
def test_a_mixture_is_ours_and_no_other_mission_is(first, second, cut):
    old, new = route(first).items, route(second).items
    cut = min(cut, len(new))
    mixed = (*new[:cut], *old[cut : len(new)])
    assert is_mixture(mixed, old, new)
    stranger = MissionItem(command=16, lat_e7=123, lon_e7=456)
    assert not is_mixture((*mixed[:-1], stranger), old, new)
    assert not is_same_mission((*new[:-1], stranger), new)


def test_an_old_tail_behind_the_end_is_dead():
    items = route([(0, 100), (50, 200)]).items
    tail = (MissionItem(command=16, lat_e7=1, lon_e7=2),)
    assert sailed_part((*items, *tail)) == items
    assert is_same_mission((*items, *tail), items)
    assert not ends_safely(tail)


@pytest.mark.parametrize("end", list(SafeEnd))
def test_every_mission_ends_in_a_loiter_and_none_in_rtl(end):
    made = route([(0, 100)], config=replace(CONFIG, safe_end=end))
    assert made.items[-1].command == Command.NAV_LOITER_UNLIM
    assert ends_safely(made.items)


def test_the_loiter_has_room_all_round_and_to_leeward():
    # A lee shore 20 m south of the goal with wind from north: loiter farther off.
    made = voyage(obstacles=(box(-500, 50, 500, 80),))
    place, room = loiter_place(made, CONFIG, (0.0, 100.0), 0.0)
    assert room >= CONFIG.loiter_radius_m
    assert place[1] > 110.0
    there, _ = loiter_place(voyage(), CONFIG, (0.0, 100.0), 0.0)
    assert there == (0.0, 100.0)


def test_outside_the_limits_the_loiter_has_room_off_what_is_solid():
    """The place least far outside was taken, beside the spit that lay between, and she touched it 18 times."""
    made = voyage(obstacles=(box(60, -20, 80, 120),))
    made = replace(made, area=made.area.within((-300.0, 60.0), 200.0, "the circle"))
    place, room = loiter_place(made, CONFIG, (120.0, 60.0), 0.0)
    assert room >= CONFIG.loiter_radius_m
    assert made.area.unfenced.clearance_m([place])[0] >= CONFIG.loiter_radius_m
    near, _ = loiter_place(made, CONFIG, (-96.0, 0.0), 0.0)  # just outside: where there is room within
    assert made.area.clearance_m([near])[0] >= CONFIG.loiter_radius_m
    shore = voyage(limits=box(-500, -500, -100, 500))  # the mission's own: beyond it may be land
    ashore, _ = loiter_place(shore, CONFIG, (200.0, 0.0), 0.0)
    assert shore.area.clearance_m([ashore])[0] > -300.0


def test_from_below_the_floor_a_loiter_is_found_away_from_what_is_near():
    """Every line begins below the floor there: none kept it, and she loitered where she was, 2 m off a wall."""
    made = voyage(obstacles=(box(-500, 102, 500, 140),))
    place, room = loiter_place(made, CONFIG, (0.0, 100.0), math.pi)
    assert room >= CONFIG.loiter_radius_m
    assert place[1] < 90.0
    inside, room = loiter_place(made, CONFIG, (0.0, 103.0), math.pi)
    assert room >= CONFIG.loiter_radius_m
    assert inside[1] < 90.0


@pytest.mark.parametrize("twd_deg", [0.0, 10.0, 25.0, 40.0, 90.0, 200.0])
def test_from_beside_a_buoy_no_loiter_is_beaten_to(twd_deg):
    """The line to it began 8 m from the buoy just rounded, 48° off the wind: headed, she turned onto it."""
    buoy = Goal(en_m=(0.0, 0.0), radius_m=6.0, side=Side.STARBOARD, rounding_m=6.0)
    made, config = voyage(buoy), replace(CONFIG, margin_m=8.0, margin_floor_m=4.0, tack_corridor_m=10.0)
    end, twd_rad = (5.0, -6.0), math.radians(twd_deg)
    place, room = loiter_place(made, config, end, twd_rad, wanted_m=19.0)
    assert room >= config.loiter_radius_m
    off_deg = abs(math.degrees(difference_rad(twd_rad, math.atan2(place[0] - end[0], place[1] - end[1]))))
    assert place == end or off_deg >= 59.0


def test_in_a_pocket_without_room_the_loiter_is_where_it_is_roomiest():
    """To leeward all lines cross the wall: a place 9.5 m from it was the best of these by a hair, and she touched."""
    buoy = Goal(en_m=(0.0, 150.0), radius_m=8.0, side=Side.STARBOARD, rounding_m=12.0)
    made = voyage(buoy, obstacles=(box(-40, 120, -32, 190), box(32, 120, 40, 190), box(-40, 180, 40, 190)))
    config = replace(CONFIG, margin_m=12.0, margin_floor_m=6.0, tack_corridor_m=10.0)
    place, room = loiter_place(made, config, (-2.1, 159.85), 2.892, wanted_m=21.0)
    assert made.area.clearance_m([place])[0] >= room > 13.0


def test_the_loiter_swings_clear_of_the_buoy_that_was_rounded_last():
    buoy = Goal(en_m=(0.0, 100.0), radius_m=10.0, side=Side.STARBOARD, rounding_m=10.0)
    made = voyage(buoy)
    ((mark, keep_m, _),) = marks_of(made)
    for end in ((-10.0, 100.0), (0.0, 110.0), (7.0, 93.0)):
        place, room = loiter_place(made, CONFIG, end, 0.0)
        assert math.dist(place, mark) >= CONFIG.loiter_radius_m + keep_m - 1e-9
        assert room >= CONFIG.loiter_radius_m
        passed_m = Point(mark).distance(LineString([end, place])) if place != end else math.dist(end, mark)
        assert passed_m >= keep_m - 1e-9


def test_the_way_to_the_loiter_leads_not_over_the_buoy():
    """In a channel with its one room behind the buoy."""
    walls = (box(-500, 116, -2, 300), box(-500, -100, -2, 84), box(-60, 84, -30, 116))
    made = voyage(Goal(en_m=(0.0, 100.0), radius_m=10.0, side=Side.PORT, rounding_m=10.0), obstacles=walls)
    ((mark, keep_m, _),) = marks_of(made)
    end = (-10.0, 100.0)
    place, _ = loiter_place(made, CONFIG, end, -math.pi / 2.0)
    assert place == end or Point(mark).distance(LineString([end, place])) >= keep_m - 1e-9


def test_from_outside_of_the_fence_no_loiter_lies_beyond_an_obstacle():
    """A circle that was drawn round home left her 110 m outside, and any rock was shallower than that."""
    rock = box(-200, 60, 200, 80)
    made = voyage(obstacles=(rock,), limits=box(-200, -100, 200, 60))
    place, _ = loiter_place(made, CONFIG, (0.0, 120.0), 0.0)
    assert LineString([(0.0, 120.0), place]).distance(rock) >= CONFIG.margin_floor_m


def test_a_roomier_place_is_taken_where_there_is_one_near_by():
    near_a_rock = voyage(obstacles=(box(-10, 116, 10, 130),))
    spot, _ = loiter_place(near_a_rock, CONFIG, (0.0, 100.0), 0.0)
    assert spot == (0.0, 100.0)  # 16 m will do for the end of a mission: that is where its sailor wants her
    wanted_m = 2.0 * CONFIG.loiter_radius_m
    roomy, room = loiter_place(near_a_rock, CONFIG, (0.0, 100.0), 0.0, wanted_m=wanted_m)
    assert room >= wanted_m
    assert 0.0 < math.dist(roomy, spot) <= 50.0
    # in a pond with no such place the nearest that will do is no worse than before
    banks = (box(-60, 116, 60, 130), box(-60, 30, 60, 40), box(-60, 30, -45, 130), box(45, 30, 60, 130))
    pond = voyage(obstacles=banks)
    place, room = loiter_place(pond, CONFIG, (0.0, 95.0), 0.0, wanted_m=wanted_m)
    assert CONFIG.loiter_radius_m <= room < wanted_m
    assert math.dist(place, (0.0, 95.0)) <= 30.0


@CHECK
@given(POINTS, POINTS, st.integers(0, 5), st.booleans())
def test_persisted_survives_json(first, second, gate, sailing):
    saved = Persisted(voyage="test", gate=gate, sailing=sailing, route=route(first), pending=route(second))
    assert Persisted.from_dict(json.loads(json.dumps(saved.to_dict()))) == saved


@pytest.mark.parametrize(
    "damage",
    [
        {},
        {"format": 1},
        {"format": 99},
        {"format": 1, "voyage": "x", "gate": "many", "sailing": 1, "route": None},
        {"format": 1, "voyage": "x", "gate": 0, "sailing": True, "route": {"items": [[1]]}, "pending": None},
        {"format": 1, "voyage": "x", "gate": 0, "sailing": True, "route": 7, "pending": None},
    ],
)
def test_damaged_state_is_refused_in_one_way(damage):
    with pytest.raises(ValueError, match=r"."):
        Persisted.from_dict(damage)


def test_lists_of_different_length_are_damage():
    data = Persisted(voyage="v", gate=0, sailing=True, route=route([(1, 1)]), pending=None).to_dict()
    data["route"]["points"].pop()
    with pytest.raises(ValueError, match="differ"):
        Persisted.from_dict(data)
