"""Each reason to plan again, on both sides of each of its thresholds."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely.geometry import Polygon, box

from companion.boat import AutopilotLimits
from companion.current import WaterCurrent
from companion.geo.angles import wrap_pi
from companion.geofence import Zone, ZoneKind
from companion.skipper.planning import triggers
from companion.skipper.planning.triggers import board_end, find_trigger, forecast_matters
from companion.skipper.step import Guidance, ReplanPolicy, ReplanReason, SafeEnd
from companion.skipper.step.actions import Announce
from companion.skipper.step.missions import NO_PLAN
from companion.skipper.step.snapshot import WindEstimate
from companion.skipper.step.state import Phase, Retry
from companion.skipper.way.position_plausibility import PositionDoubt
from companion.skipper.way.voyage import Box, Goal, Line, Side
from companion.traffic import TrafficPicture
from tests.skipper.moments import NOW_S, moment, route
from tests.skipper.world import FRAME
from tests.traffic.conftest import vessel

EAST = ((300.0, 0.0), (600.0, 0.0), (600.0, 600.0), (600.0, 600.0))  # reaches in a northerly, then a beat
DEEP = route(*((400.0 * n, 0.0) for n in range(1, 6)))  # far from its end, and from every waypoint
NEVER = -math.inf
LONG_AGO = {"plans": {"last_s": NOW_S - 500.0}}


def reason(ctx, fresh=()):
    found = find_trigger(ctx, fresh)
    return None if found is None else found.reason


def facts(ctx, fresh=()):
    found = find_trigger(ctx, fresh)
    return found and (found.reason, found.from_index, found.interval_s, found.urgent)


# ---------------------------------------------------------------------------------------------- none at all
def test_nothing_presses_in_the_middle_of_a_long_leg():
    assert find_trigger(moment(DEEP), ()) is None


@pytest.mark.parametrize(
    "lacking",
    [
        {"seen": {"vehicle_age_s": 3.1}},
        {"seen": {"wind": WindEstimate()}},
        {"seen": {"unsure": "the current cannot be"}},
        {"up": ("becalmed",)},
        {"voyage": {"sailing": True, "over": "all goals are reached"}},
    ],
)
def test_no_reason_counts_without_a_place_a_wind_or_a_voyage(lacking):
    asked = {"plans": {"asked": "ordered"}}
    assert reason(moment(DEEP, **asked)) is ReplanReason.ORDER
    assert find_trigger(moment(DEEP, **(asked | lacking)), ()) is None


@pytest.mark.parametrize("kind", [ReplanReason.TACK_FAILED, ReplanReason.IN_IRONS, ReplanReason.NEXT_GOAL])
def test_a_plan_that_nobody_ordered_is_told_by_its_own_reason(kind):
    """ "planning: order" stood there of a tack that had failed."""
    assert reason(moment(DEEP, plans={"asked": "a tack failed", "asked_as": kind})) is kind


def test_a_boat_that_was_given_back_plans_before_all_else_and_says_by_whom():
    failed = {"asked": "a tack failed", "asked_as": ReplanReason.TACK_FAILED}
    by_person = find_trigger(moment(DEEP, operator={"is_back": True}, plans=failed), ())
    by_failsafe = find_trigger(moment(DEEP, operator={"is_back": True, "answering": "radio"}), ())
    assert (by_person.reason, by_person.text) == (ReplanReason.OPERATOR_BACK, "taken up again from where she is")
    assert (by_person.interval_s, by_person.urgent, by_person.from_index) == (0.0, False, None)
    assert by_failsafe.text == "stopped by the radio failsafe"
    ordered = find_trigger(moment(DEEP, operator={"is_back": True}, plans={"asked": "A is given up"}), ())
    assert (ordered.reason, ordered.text) == (ReplanReason.ORDER, "A is given up")  # "planning: operator back" was said


@pytest.mark.parametrize(("record_s", "is_planned"), [(29.9, False), (30.0, True)])
def test_a_mission_of_no_known_plan_is_replaced_as_soon_as_the_wind_is_known(record_s, is_planned):
    ctx = moment(replace(DEEP, plan_id=NO_PLAN), plans={"asked": "ordered"})
    ctx.snapshot = replace(ctx.snapshot, wind=replace(ctx.snapshot.wind, record_s=record_s))
    assert facts(ctx) == ((ReplanReason.MISMATCH, None, 20.0, False) if is_planned else None)


def test_a_missed_buoy_is_sailed_again_unless_she_is_bound_elsewhere():
    assert facts(moment(DEEP, progress={"missed_s": 1.0})) == (ReplanReason.MISSED_BUOY, None, 5.0, False)
    aside = moment(DEEP, progress={"missed_s": 1.0}, voyage={"sailing": True, "over": "x"})
    assert find_trigger(aside, ()) is None


def test_a_breach_of_the_fence_is_a_reason_when_it_is_fresh():
    assert find_trigger(moment(DEEP, up=("fence breach",)), ()) is None
    assert facts(moment(DEEP), ("fence breach",)) == (ReplanReason.OBSTACLE, None, 0.0, True)


def with_fence(north_m, **parts):
    """The same with a fence drawn on the autopilot that forbids a square about her way, or beside it."""
    corners = [(150.0, north_m), (190.0, north_m), (190.0, north_m + 40.0), (150.0, north_m + 40.0)]
    places = [FRAME.geo_from_en(*corner) for corner in corners]
    zone = Zone(kind=ZoneKind.EXCLUSION, shape=Polygon([(place.lon_deg, place.lat_deg) for place in places]))
    limits = AutopilotLimits.from_params({"FENCE_ENABLE": 1.0, "FENCE_TYPE": 4.0, "FENCE_ACTION": 1.0})
    return moment(DEEP, seen={"fence": (zone,), "limits": limits}, **parts)


@pytest.mark.parametrize(("north_m", "cuts"), [(-20.0, True), (60.0, False)])
def test_a_fence_that_somebody_draws_across_her_way_is_urgent(north_m, cuts):
    ctx = with_fence(north_m)
    assert ctx.drawn is not None
    assert facts(ctx) == ((ReplanReason.OBSTACLE, None, 8.0, True) if cuts else None)


# -------------------------------------------------------------------------------------------------- vessels
def met(*, last_s=NEVER, closes=True, **parts):
    """A ship that crosses her way 200 m ahead when she is there, or that goes the other way."""
    ship = vessel(
        (200.0, 500.0), 180.0 if closes else 0.0, 5.0, t_s=NOW_S, heard_s=NOW_S, mmsi=7, ship_type=70, nav_status=0
    )
    picture = TrafficPicture(t_s=NOW_S, vessels=(ship,))
    return moment(DEEP, seen={"traffic": picture}, plans={"last_s": last_s}, **parts)


@pytest.mark.parametrize(
    ("closes", "ago_s", "min_s", "found"),
    [
        (True, 100.0, 20.0, (ReplanReason.OBSTACLE, None, 20.0, True)),
        (False, 100.0, 20.0, None),
        (True, 20.0, 20.0, (ReplanReason.OBSTACLE, None, 20.0, True)),
        (True, 19.9, 20.0, None),
        (True, 19.9, 5.0, None),  # never more often than each 20 s ...
        (True, 29.9, 30.0, None),  # ... or than the mission says
        (True, 30.0, 30.0, (ReplanReason.OBSTACLE, None, 30.0, True)),
    ],
)
def test_a_vessel_that_her_way_meets_is_planned_about_not_too_often(closes, ago_s, min_s, found):
    ctx = met(closes=closes, last_s=NOW_S - ago_s, config={"min_replan_interval_s": min_s})
    assert facts(ctx) == found
    assert [a.code for a in ctx.actions if isinstance(a, Announce)] == ["traffic"] * closes


# ----------------------------------------------------------------------------------------------- diversions
@pytest.mark.parametrize(("failures", "interval_s", "urgent"), [(0, 0.0, True), (1, 20.0, False), (2, 20.0, False)])
def test_what_was_a_diversion_is_sailed_on_from_at_once_the_first_time(failures, interval_s, urgent):
    ctx = moment(replace(DEEP, bound_for="the refuge x"), plans={"retry": Retry(failures=failures)})
    assert facts(ctx) == (ReplanReason.NEXT_GOAL, None, interval_s, urgent)
    assert find_trigger(ctx, ()).text == "no longer bound for the refuge x: sailing on"


@pytest.mark.parametrize(("leads_to", "is_planned"), [("home", False), ("the refuge x", True)])
def test_the_way_home_that_follows_the_last_goal_is_no_diversion_that_is_over(leads_to, is_planned):
    ctx = moment(replace(DEEP, bound_for=leads_to), config={"safe_end": SafeEnd.RETURN})
    status = replace(ctx.snapshot.autopilot, home=ctx.voyage.frame.geo_from_en(0.0, 0.0))
    ctx.snapshot = replace(ctx.snapshot, autopilot=status)
    assert (reason(ctx) is ReplanReason.NEXT_GOAL) is is_planned


def boxed(way, **parts):
    goal = Goal(en_m=(0.0, 600.0), name="one", box=Box(area_en=box(-100, 500, 100, 700)))
    return moment(way, goals=(goal,), **parts)


def test_a_diversion_that_begins_is_planned_for_at_once_and_no_more_when_she_is_bound_there():
    assert facts(boxed(DEEP)) == (ReplanReason.NEXT_GOAL, None, 0.0, True)
    assert facts(boxed(DEEP, plans={"retry": Retry(failures=3)})) == (ReplanReason.NEXT_GOAL, None, 20.0, False)
    assert find_trigger(boxed(replace(DEEP, bound_for="the box one")), ()) is None


def test_each_kind_of_diversion_has_its_reason():
    assert {kind.value: why for kind, why in triggers.REASONS.items()} == {
        "refuge": ReplanReason.REFUGE,
        "home": ReplanReason.HOME,
        "rest": ReplanReason.REST,
        "goal": ReplanReason.ORDER,
        "inside": ReplanReason.OBSTACLE,
        "room": ReplanReason.REST,
        "start": ReplanReason.NEXT_GOAL,
        "box": ReplanReason.NEXT_GOAL,
        "station": ReplanReason.NEXT_GOAL,
        "field": ReplanReason.RETRY,
    }


# ------------------------------------------------------------------------------------------------ positions
def test_off_the_leg_waits_for_the_usual_interval_or_less_before_something():
    up = {"up": ("off the corridor",)}
    assert facts(moment(DEEP, **up)) == (ReplanReason.OFF_LEG, None, 20.0, False)
    near, far = box(200, 7.9, 220, 30), box(200, 8.1, 220, 30)  # the floor is 8 m, beside the way to the waypoint
    assert facts(moment(DEEP, obstacles=(near,), **up))[2] == 8.0
    assert facts(moment(DEEP, obstacles=(far,), **up))[2] == 20.0


def test_no_progress_waits_for_two_minutes():
    assert facts(moment(DEEP, up=("no progress",))) == (ReplanReason.NO_PROGRESS, None, 120.0, False)
    assert reason(moment(DEEP, up=("no progress", "off the corridor"))) is ReplanReason.OFF_LEG


def test_a_position_that_jumped_onto_a_shut_way_is_planned_from():
    doubt = PositionDoubt(
        since_s=NOW_S, t_s=NOW_S, reckoned_en_m=(0.0, 0.0), velocity_en_mps=(2.0, 0.0), settled_s=NOW_S, why="jumped"
    )
    shut = moment(DEEP, obstacles=(box(150, -20, 170, 20),), position={"doubt": doubt})
    assert facts(shut) == (ReplanReason.OFF_LEG, None, 8.0, True)


@pytest.mark.parametrize(
    ("phase", "why"), [(Phase.HOLDING, ReplanReason.RETRY), (Phase.STANDARD, ReplanReason.NEXT_GOAL)]
)
def test_at_the_end_with_goals_left_is_planned_on(phase, why):
    end = moment(DEEP, mission={"route": DEEP, "index": 4}, phase=phase)
    assert facts(end) == (why, None, 5.0, False)
    told = moment(DEEP, up=("mission ended",), phase=phase)
    assert facts(told) == (why, None, 5.0, False)


def test_without_a_route_the_goals_that_are_left_are_the_reason():
    assert facts(moment(None)) == (ReplanReason.NEXT_GOAL, None, 5.0, False)
    assert facts(moment(DEEP, seen={"vehicle": None, "vehicle_age_s": None})) is None


def test_steered_by_a_field_only_the_end_and_what_is_beyond_count():
    field = {"config": {"guidance": Guidance.FIELD, "plan_age_s": 1.0}}
    plan = {"config": {"plan_age_s": 1.0}}
    assert reason(moment(DEEP, **plan)) is ReplanReason.PLAN_AGE
    assert reason(moment(DEEP, **field)) is None
    assert reason(moment(DEEP, mission={"route": DEEP, "index": 4}, **field)) is ReplanReason.NEXT_GOAL
    assert (
        reason(moment(DEEP, at=(1550.0, 0.0), mission={"route": DEEP, "index": 3}, **field)) is ReplanReason.NEXT_GOAL
    )


# ------------------------------------------------------------------------------------------- the wind shuts
def closed(**parts):
    """A leg to the north in a northerly, in water where no beat is left to the autopilot."""
    way = route((0.0, 600.0), (600.0, 600.0), (900.0, 600.0))
    parts.setdefault("config", {})
    parts["config"] = {"autopilot_beats": False, "tack_corridor_m": 10.0} | parts["config"]
    return moment(way, heading_deg=parts.pop("heading_deg", 45.0), **parts)


def since(s):
    return {"plans": {"no_go_since_s": NOW_S - s}}


@pytest.mark.parametrize(("patience_s", "is_planned"), [(3.9, False), (4.0, True)])
def test_a_leg_that_the_wind_has_closed_is_planned_anew_after_some_patience(patience_s, is_planned):
    expected = (ReplanReason.NO_GO, None, 20.0, False) if is_planned else None
    assert facts(closed(**since(patience_s))) == expected


def test_the_patience_begins_with_the_first_step_that_finds_it_closed_and_ends_when_it_opens():
    ctx = closed()
    assert find_trigger(ctx, ()) is None
    assert ctx.state.plans.no_go_since_s == NOW_S
    ctx = closed(**since(2.5))
    find_trigger(ctx, ())
    assert ctx.state.plans.no_go_since_s == NOW_S - 2.5
    ctx = closed(twd_deg=50.0, mean_deg=0.0, **since(2.5))
    find_trigger(ctx, ())
    assert ctx.state.plans.no_go_since_s is None


@pytest.mark.parametrize(("twd_deg", "is_closed"), [(44.9, True), (45.1, False), (-44.9, True), (-45.1, False)])
def test_closed_is_inside_the_no_go_zone(twd_deg, is_closed):
    ctx = closed(twd_deg=twd_deg, mean_deg=0.0)
    find_trigger(ctx, ())
    assert (ctx.state.plans.no_go_since_s is not None) is is_closed


@pytest.mark.parametrize(("left_m", "is_closed"), [(6.9, False), (7.1, True)])  # 5 m, and a second's way at 2 m/s
def test_a_waypoint_that_is_as_good_as_reached_is_not_closed(left_m, is_closed):
    ctx = closed(at=(0.0, 600.0 - left_m))
    find_trigger(ctx, ())
    assert (ctx.state.plans.no_go_since_s is not None) is is_closed


def test_a_beat_that_is_left_to_the_autopilot_is_not_closed():
    ctx = closed(config={"autopilot_beats": True}, **since(10.0))
    assert find_trigger(ctx, ()) is None
    assert ctx.state.plans.no_go_since_s is None


@pytest.mark.parametrize("off_leg_m", [4.0, 30.0])
def test_a_boat_that_cannot_tack_is_planned_for_before_the_autopilot_beats(off_leg_m):
    """On a leg that a shift had closed she was left to tack at the corridor's edge, which she cannot."""
    ctx = closed(config={"autopilot_beats": True, "no_go_off_leg_m": off_leg_m}, **since(10.0))
    ctx.voyage = replace(ctx.voyage, boat=replace(ctx.voyage.boat, can_tack=False))
    assert reason(ctx) is ReplanReason.NO_GO


def test_a_beat_that_stays_near_its_leg_is_no_reason():
    assert reason(closed(config={"no_go_off_leg_m": 9.0}, **since(10.0))) is ReplanReason.NO_GO  # the corridor is 10 m
    assert find_trigger(closed(config={"no_go_off_leg_m": 30.0}, **since(10.0)), ()) is None


@pytest.mark.parametrize(
    ("rock", "waited_s", "is_urgent"),
    [
        (box(14, 5, 40, 30), 1.0, True),  # starboard of the way: the board on port tack comes within 8 m
        (box(14, 5, 40, 30), 0.9, False),
        (box(-40, 5, -14, 30), 1.0, False),  # the other side, which this board does not sail to
        (box(40, 5, 60, 30), 1.0, False),
    ],
)
def test_a_board_that_comes_too_near_to_something_is_urgent(rock, waited_s, is_urgent):
    found = facts(closed(obstacles=(rock,), heading_deg=45.0, **since(waited_s)))
    assert found == ((ReplanReason.NO_GO, None, 8.0, True) if is_urgent else None)


def test_what_the_straight_way_passes_as_near_is_not_urgent():
    beside = box(5.0, 5.0, 40.0, 30.0)  # 5 m from the line itself: the board's fault is less than a metre more
    assert facts(closed(obstacles=(box(0.5, 300, 30, 310),), at=(0.0, 0.0), **since(1.0))) is None
    assert facts(closed(obstacles=(beside,), **since(1.0))) == (ReplanReason.NO_GO, None, 8.0, True)


def test_the_current_carries_the_board_on_to_what_it_would_clear():
    rock, config = box(12.0, 2.0, 40.0, 5.0), {"margin_floor_m": 3.0, "no_go_off_leg_m": 99.0}
    assert facts(closed(obstacles=(rock,), config=config, **since(2.0))) is None
    water = WaterCurrent(east_mps=2.0, is_significant=True)
    set_on = closed(obstacles=(rock,), config=config, seen={"current": water}, **since(2.0))
    assert facts(set_on) == (ReplanReason.NO_GO, None, 8.0, True)


def test_a_wind_that_is_not_believed_closes_no_leg():
    assert find_trigger(closed(up=("wind untrusted",), **since(60.0)), ()) is None


def test_a_board_of_short_legs_is_one_to_where_she_turns():
    bends = ((100.0, 0.0), (200.0, 20.0), (300.0, 60.0), (300.0, 300.0), (0.0, 300.0))
    ctx = moment(route(*bends))
    assert board_end(ctx, ((0.0, 0.0), bends[0])) == bends[2]
    straight = moment(route((100.0, 0.0), (200.0, 0.0), (300.0, 0.0), (300.0, 0.0)))
    assert board_end(straight, ((0.0, 0.0), (100.0, 0.0))) == (300.0, 0.0)
    twice = moment(route((100.0, 0.0), (100.0, 0.0), (100.0, 90.0), (100.0, 90.0)))
    assert board_end(twice, ((0.0, 0.0), (100.0, 0.0))) == (100.0, 0.0)


@pytest.mark.parametrize(("turn_deg", "is_end"), [(24.9, False), (25.1, True), (-24.9, False), (-25.1, True)])
def test_more_than_25_degrees_end_a_board(turn_deg, is_end):
    there = (100.0 + 100.0 * math.cos(math.radians(turn_deg)), 100.0 * math.sin(math.radians(turn_deg)))
    ctx = moment(route((100.0, 0.0), there, (900.0, 900.0)))
    assert (board_end(ctx, ((0.0, 0.0), (100.0, 0.0))) == (100.0, 0.0)) is is_end


# -------------------------------------------------------------------------------------- the wind is another
@pytest.mark.parametrize("about_deg", [0.0, 170.0])
@pytest.mark.parametrize(
    ("turned_deg", "width_deg", "is_planned"),
    [(19.9, 8.0, False), (20.1, 8.0, True), (-20.1, 8.0, True), (25.0, 25.1, False), (25.0, 24.9, True)],
)
def test_a_mean_wind_that_turned_by_20_degrees_and_out_of_the_interval(about_deg, turned_deg, width_deg, is_planned):
    way = replace(DEEP, plan_twd_from_rad=math.radians(about_deg), plan_half_width_rad=math.radians(width_deg))
    ctx = moment(way, mean_deg=about_deg + turned_deg, twd_deg=0.0)
    assert facts(ctx) == ((ReplanReason.WIND_SHIFT, None, 20.0, False) if is_planned else None)


def with_current(now, planned=(0.0, 0.0), **parts):
    way = replace(DEEP, plan_current_east_mps=planned[0], plan_current_north_mps=planned[1])
    water = WaterCurrent(east_mps=now[0], north_mps=now[1], is_significant=now != (0.0, 0.0))
    return moment(way, seen={"current": water}, **parts)


@pytest.mark.parametrize(
    ("now", "planned", "is_planned"),
    [
        ((0.0, 0.149), (0.0, 0.0), False),
        ((0.0, 0.151), (0.0, 0.0), True),
        ((0.151, 0.0), (0.0, 0.0), True),
        ((0.0, 0.0), (-0.2, 0.0), True),
        ((1.24, 0.0), (1.0, 0.0), False),  # a quarter of the plan's
        ((1.26, 0.0), (1.0, 0.0), True),
        ((0.6, 1.04), (0.6, 0.8), False),
        ((0.6, 1.06), (0.6, 0.8), True),
        ((0.0, 1.0), (1.0, 0.0), True),
    ],
)
def test_a_current_is_another_by_15_cm_a_second_and_a_quarter(now, planned, is_planned):
    expected = (ReplanReason.CURRENT, None, 60.0, False) if is_planned else None
    assert facts(with_current(now, planned)) == expected


def test_the_interval_for_a_current_is_a_minute_or_the_configured_if_that_is_longer():
    assert facts(with_current((0.5, 0.0), config={"min_replan_interval_s": 90.0}))[2] == 90.0


@pytest.mark.parametrize(("age_s", "is_planned"), [(3600.0, False), (3601.0, True)])
def test_a_plan_of_an_hour_is_old(age_s, is_planned):
    ctx = moment(replace(DEEP, plan_t_s=NOW_S - age_s))
    assert facts(ctx) == ((ReplanReason.PLAN_AGE, None, 20.0, False) if is_planned else None)


def test_a_wind_that_is_not_believed_is_no_reason_whatever_it_says():
    aged = replace(DEEP, plan_t_s=NOW_S - 9999.0)
    assert find_trigger(moment(aged, up=("wind untrusted",), mean_deg=90.0), ()) is None


FORECAST = {"config": {"replan_policy": ReplanPolicy.FORECAST}}
Z80 = 1.282


@pytest.mark.parametrize(
    ("planned_deg", "now_deg", "is_planned"),
    [
        (10.0, 14.9, False),  # half as wide again
        (10.0, 15.1, True),
        (4.0, 6.9, False),  # and by three degrees
        (4.0, 7.1, True),
        (10.0, 5.0, False),  # narrower waits for a waypoint
        (0.0, 30.0, False),  # a stay remembers none
    ],
)
def test_a_wind_that_became_less_certain_is_a_reason_where_the_forecast_is_asked(planned_deg, now_deg, is_planned):
    way = replace(DEEP, plan_half_width_rad=math.radians(planned_deg))
    ctx = moment(way, sigma_deg=now_deg / Z80, **FORECAST)
    assert facts(ctx) == ((ReplanReason.FORECAST, None, 20.0, False) if is_planned else None)
    assert find_trigger(moment(way, sigma_deg=now_deg / Z80), ()) is None
    assert find_trigger(moment(way, sigma_deg=now_deg / Z80, up=("wind untrusted",), **FORECAST), ()) is None


def is_worth_it(planned_deg, planned_mps, width_deg, now_deg, now_mps, now_width_deg):
    """The rule in words: turned by 5° and half the interval, half as wide or narrow and 3°, 30 % of the speed."""
    wide = max(1.5 * width_deg, width_deg + 3.0) if width_deg > 0.0 else math.inf
    narrow = max(1.5 * now_width_deg, now_width_deg + 3.0) if now_width_deg > 0.0 else math.inf
    return (
        abs(math.degrees(wrap_pi(math.radians(now_deg - planned_deg)))) > max(5.0, 0.5 * width_deg)
        or now_width_deg > wide
        or width_deg > narrow
        or abs(now_mps - planned_mps) > 0.3 * max(planned_mps, 1.0)
    )


@settings(max_examples=60)
@given(
    planned_deg=st.floats(-180, 180),
    turned_deg=st.one_of(st.floats(-8, 8), st.floats(-180, 180)),
    planned_mps=st.floats(0.2, 12),
    share=st.floats(0.5, 1.5),
    width_deg=st.one_of(st.just(0.0), st.floats(1, 30)),
    times=st.floats(0.4, 2.0),
)
def test_a_forecast_matters_as_its_rule_says(planned_deg, turned_deg, planned_mps, share, width_deg, times):
    now_width = times * (width_deg or 5.0)
    way = replace(
        DEEP,
        plan_twd_from_rad=math.radians(planned_deg),
        plan_tws_mps=planned_mps,
        plan_half_width_rad=math.radians(width_deg),
    )
    ctx = moment(way, mean_deg=planned_deg + turned_deg, mean_mps=share * planned_mps, sigma_deg=now_width / Z80)
    args = planned_deg, planned_mps, width_deg, planned_deg + turned_deg, share * planned_mps
    answers = {is_worth_it(*args, now_width * s) for s in (0.999, 1.001)}
    answers |= {
        is_worth_it(planned_deg, planned_mps, width_deg, planned_deg + s * turned_deg, share * planned_mps, now_width)
        for s in (0.9999, 1.0001)
    }
    assert forecast_matters(ctx) in answers
    assert not forecast_matters(moment(None))


@pytest.mark.parametrize(
    ("mean_mps", "planned_mps", "matters"),
    [(6.49, 5.0, False), (6.51, 5.0, True), (3.49, 5.0, True), (0.71, 0.5, False), (0.81, 0.5, True)],
)
def test_a_third_of_the_wind_matters_or_30_cm_a_second(mean_mps, planned_mps, matters):
    way = replace(DEEP, plan_tws_mps=planned_mps, plan_half_width_rad=math.radians(3.0 * Z80))
    assert forecast_matters(moment(way, mean_mps=mean_mps)) is matters


@pytest.mark.parametrize(
    ("turned_deg", "width_deg", "matters"),
    [(4.9, 6.0, False), (5.1, 6.0, True), (9.9, 20.0, False), (10.1, 20.0, True)],
)
def test_five_degrees_matter_or_half_the_interval(turned_deg, width_deg, matters):
    way = replace(DEEP, plan_half_width_rad=math.radians(width_deg))
    assert forecast_matters(moment(way, mean_deg=turned_deg, sigma_deg=width_deg / Z80)) is matters


# -------------------------------------------------------------------------------------- planning on
def at_the_last(left_m, *, gates=(-1, 0, -1), goals=None, points=None, **parts):
    """On the last leg of a way that completes the first of two goals, ``left_m`` before its end."""
    points = points or ((0.0, 0.0), (600.0, 0.0), (600.0, 0.0))
    more = {} if goals is None else {"goals": goals}
    way = route(*points, begin=(-100.0, 0.0), gate_of=gates, bound_for=parts.pop("bound_for", ""))
    parts.setdefault("mission", {"route": way, "index": 1})
    return moment(way, at=(600.0 - left_m, parts.pop("off_m", 0.0)), **more, **parts)


@pytest.mark.parametrize(
    ("left_m", "speed_mps", "late_s", "is_planned"),
    [
        (79.0, 2.0, 0.0, True),  # 40 s at 2 m/s
        (81.0, 2.0, 0.0, False),
        (39.0, 0.2, 0.0, True),  # at 1 m/s at least
        (41.0, 0.2, 0.0, False),
        (99.0, 2.0, 10.0, True),  # the later plans come the sooner they are asked for
        (101.0, 2.0, 10.0, False),
    ],
)
def test_the_way_is_planned_on_forty_seconds_before_its_end(left_m, speed_mps, late_s, is_planned):
    ctx = at_the_last(left_m, speed_mps=speed_mps)
    ctx = late(ctx, late_s)
    assert facts(ctx) == ((ReplanReason.NEXT_GOAL, 1, 5.0, False) if is_planned else None)


def late(ctx, late_s):
    """The same with plans that come so much later than on a fast computer."""
    return type("Late", (type(ctx),), {"late_s": property(lambda _: late_s)})(
        ctx.voyage, ctx.config, ctx.state, ctx.snapshot
    )


def test_all_of_the_way_left_counts_not_the_leg_alone():
    points = ((0.0, 0.0), (580.0, 0.0), (600.0, 0.0), (600.0, 0.0))
    ctx = at_the_last(65.0, points=points, gates=(-1, -1, 0, -1), speed_mps=1.0)
    assert find_trigger(ctx, ()) is None
    assert facts(at_the_last(35.0, points=points, gates=(-1, -1, 0, -1), speed_mps=1.0))[:2] == (
        ReplanReason.NEXT_GOAL,
        2,
    )


def test_behind_the_last_goal_nothing_is_planned_but_the_way_home():
    assert find_trigger(at_the_last(30.0, gates=(-1, 1, -1)), ()) is None
    home = at_the_last(30.0, gates=(-1, 1, -1), config={"safe_end": SafeEnd.RETURN})
    status = replace(home.snapshot.autopilot, home=home.voyage.frame.geo_from_en(0.0, 0.0))
    home.snapshot = replace(home.snapshot, autopilot=status)
    assert facts(home) == (ReplanReason.NEXT_GOAL, 1, 5.0, False)


def start_line(gun_s):
    marks = Line(port_en_m=(560.0, 100.0), starboard_en_m=(640.0, 100.0), keep_m=5.0, after_s=gun_s)
    return Goal(en_m=(600.0, 100.0), name="the start", line=marks)


@pytest.mark.parametrize(("gun_s", "is_planned"), [(4000.0, False), (1.0, True)])
def test_a_start_line_is_planned_for_when_it_is_next_unless_its_gun_is_gone(gun_s, is_planned):
    goals = (Goal(en_m=(600.0, 0.0), name="one"), start_line(gun_s), Goal(en_m=(600.0, 900.0), name="three"))
    ctx = at_the_last(30.0, goals=goals, voyage={"sailing": True, "under_way_s": 100.0})
    assert (reason(ctx) is ReplanReason.NEXT_GOAL) is is_planned


@pytest.mark.parametrize(("off_m", "is_planned"), [(19.0, False), (21.0, True)])  # its 8 m, the 10 m and a bit
def test_the_way_to_a_diversion_is_planned_on_until_it_leads_there(off_m, is_planned):
    goal = Goal(en_m=(600.0, 0.0), name="one", box=Box(area_en=box(500, -100, 700, 100)))
    ctx = at_the_last(
        30.0,
        goals=(goal,),
        points=((0.0, 0.0), (600.0 - off_m, 0.0), (600.0 - off_m, 0.0)),
        gates=(-1, -1, -1),
        bound_for="the box one",
        config={"announce_m": 12.0},
    )
    assert (facts(ctx) == (ReplanReason.NEXT_GOAL, 1, 5.0, False)) is is_planned


# --------------------------------------------------------------------------------------- at each waypoint
def before_waypoint(left_s, *, turn_deg=60.0, speed_mps=2.0, last_s=NEVER, **parts):
    """On the first of three legs, so long before the waypoint where she turns by ``turn_deg``."""
    corner = (300.0, 0.0)
    after = (300.0 + 400.0 * math.cos(math.radians(turn_deg)), -400.0 * math.sin(math.radians(turn_deg)))
    way = route(corner, after, (1500.0, -800.0), (1500.0, -800.0))
    plans = {"last_s": last_s} | parts.pop("plans", {})
    return moment(
        parts.pop("way", way), at=(300.0 - left_s * max(speed_mps, 0.3), 0.0), speed_mps=speed_mps, plans=plans, **parts
    )


@pytest.mark.parametrize(
    ("left_s", "late_s", "is_planned"),
    [
        (6.4, 0.0, False),  # too late: what is left of the leg must be long enough to be followed
        (6.6, 0.0, True),
        (11.9, 0.0, True),
        (12.1, 0.0, False),
        (9.4, 3.0, False),
        (9.6, 3.0, True),
        (14.9, 3.0, True),
        (15.1, 3.0, False),
    ],
)
def test_near_a_waypoint_is_planned_from_it(left_s, late_s, is_planned):
    ctx = late(before_waypoint(left_s), late_s)
    assert facts(ctx) == ((ReplanReason.WAYPOINT, 0, 20.0, False) if is_planned else None)


def test_a_boat_that_hardly_moves_is_reckoned_with_30_cm_a_second():
    assert reason(before_waypoint(10.0, speed_mps=0.1)) is ReplanReason.WAYPOINT
    assert reason(before_waypoint(14.0, speed_mps=0.1)) is None


@pytest.mark.parametrize(("replanned", "is_planned"), [(-1, True), (0, False), (1, False)])
def test_each_waypoint_is_planned_from_once(replanned, is_planned):
    assert (reason(before_waypoint(10.0, plans={"replanned_index": replanned})) is not None) is is_planned


def test_nothing_is_planned_where_the_way_to_the_next_goal_is_there_already():
    corner = (300.0, 0.0)
    points = (corner, (500.0, 300.0), (1500.0, 300.0), (1500.0, 300.0))
    assert reason(before_waypoint(10.0, way=route(*points, gate_of=(-1, 0, -1, -1)))) is None
    assert reason(before_waypoint(10.0, way=route(*points))) is ReplanReason.WAYPOINT


def test_at_a_buoy_and_in_a_wind_that_is_not_believed_no_waypoint_is_a_reason():
    buoy = Goal(en_m=(900.0, 600.0), name="buoy", side=Side.PORT)
    assert reason(before_waypoint(10.0, goals=(buoy, Goal(en_m=(0.0, 600.0))))) is None
    assert reason(before_waypoint(10.0, up=("wind untrusted",))) is None


@pytest.mark.parametrize(
    ("turn_deg", "age_s", "is_planned"),
    [(5.9, 59.0, False), (5.9, 61.0, True), (6.1, 59.0, True), (-5.9, 59.0, False), (-6.1, 59.0, True)],
)
def test_a_bend_is_worth_a_plan_only_after_a_minute(turn_deg, age_s, is_planned):
    assert (reason(before_waypoint(10.0, turn_deg=turn_deg, last_s=NOW_S - age_s)) is not None) is is_planned


@pytest.mark.parametrize(("short_m", "is_bend"), [(0.9, False), (1.1, True)])
def test_a_leg_without_length_is_no_bend(short_m, is_bend):
    way = route((300.0, 0.0), (300.0 + short_m, 0.0), (1500.0, 0.0), (1500.0, 0.0))
    assert (reason(before_waypoint(10.0, way=way, last_s=NOW_S - 30.0)) is None) is is_bend


def test_where_the_forecast_is_asked_a_waypoint_is_a_reason_only_when_it_matters():
    same = before_waypoint(10.0, sigma_deg=8.0 / Z80, **FORECAST)
    assert find_trigger(same, ()) is None
    assert same.state.plans.replanned_index == 0  # asked, and not again
    other = before_waypoint(10.0, sigma_deg=8.0 / Z80, mean_deg=6.0, **FORECAST)
    assert facts(other) == (ReplanReason.FORECAST, 0, 20.0, False)
    assert other.state.plans.replanned_index == -1


# ---------------------------------------------------------------------------- an upload makes the leg begin anew
def test_off_her_line_on_a_beat_no_plan_makes_the_leg_begin_anew_where_its_corridor_meets_something():
    rock = (box(20.0, 330.0, 60.0, 380.0),)
    for obstacles, off_m, is_planned in ((rock, 5.0, False), (rock, 1.9, True), ((), 5.0, True)):
        ctx = at_the_last(
            60.0,
            points=((0.0, -300.0), (0.0, 400.0), (0.0, 400.0)),
            obstacles=obstacles,
            mission={
                "route": route((0.0, -300.0), (0.0, 400.0), (0.0, 400.0), gate_of=(-1, 0, -1), begin=(0.0, -400.0)),
                "index": 1,
            },
        )
        ctx.snapshot = replace(ctx.snapshot, position_en_m=(off_m, 340.0))
        assert (reason(ctx) is ReplanReason.NEXT_GOAL) is is_planned, (obstacles, off_m)
