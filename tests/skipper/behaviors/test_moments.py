"""What is done before she sails, at the end, for an order and on a beat, moment by moment."""

import math
from dataclasses import replace

import pytest
import shapely

from companion.boat import AutopilotLimits
from companion.messages import Mode
from companion.orders import Order, Source, Verb, Wanted
from companion.skipper.behaviors import launch, sailing
from companion.skipper.behaviors.drifting import _loiters
from companion.skipper.behaviors.launch import STALE_S, _request_start, start
from companion.skipper.behaviors.operator_orders import _forget_shoal, _why
from companion.skipper.behaviors.rest import NEAR_M, _lies_off, rest
from companion.skipper.behaviors.sailing import _consider, shift_tack, short_tack
from companion.skipper.planning.triggers import Trigger
from companion.skipper.step import actions as act
from companion.skipper.step.actions import ReplanReason
from companion.skipper.step.config import Permissions
from companion.skipper.step.saved import Standing
from companion.skipper.step.state import Phase
from companion.skipper.way.gates import Approach
from companion.skipper.way.shoals import Shoal
from tests.skipper.moments import NOW_S, asked_for, moment, route

WAY = route((0.0, 300.0), (0.0, 600.0), (0.0, 620.0))


# ------------------------------------------------------------------------------------------ before she sails
@pytest.mark.parametrize(("age_s", "waits"), [(STALE_S - 0.5, True), (STALE_S, False)])
def test_a_plan_that_waits_for_permission_is_renewed_when_it_is_a_minute_old(age_s, waits):
    ready = route((0.0, 300.0), plan_t_s=NOW_S - age_s)
    ctx = moment(plans={"ready_route": ready}, voyage={"sailing": False})
    start(ctx)
    assert ("a plan is ready" in ctx.state.why) is waits
    assert any(isinstance(a, act.RequestPlan) for a in ctx.actions) is not waits


def test_where_no_problem_can_be_stated_it_is_said_what_is_lacking(monkeypatch):
    monkeypatch.setattr(launch, "_request_start", lambda ctx: False)
    ctx = moment(voyage={"sailing": False})
    start(ctx)
    assert ctx.state.phase is Phase.WAITING
    assert ctx.state.why == "waiting for the next try: no problem can be stated"


@pytest.mark.parametrize("gate", [0, 1])
def test_until_a_gate_is_passed_the_way_to_the_first_goal_begins_where_she_lies(gate):
    ctx = moment(at=(70.0, -40.0), progress={"gate": gate}, voyage={"sailing": False})
    assert _request_start(ctx)
    begun = [a for a in ctx.state.progress.approaches if a.goal == 0]
    assert begun == ([Approach(goal=0, en_m=(70.0, -40.0))] if gate == 0 else [])


# ---------------------------------------------------------------------------------------------------- the end
@pytest.mark.parametrize(("off_m", "says"), [(NEAR_M - 1.0, ""), (NEAR_M, ""), (48.0, "; she lies 48 m off")])
def test_it_is_told_how_far_off_the_last_waypoint_she_lies_where_she_is_not_by_it(off_m, says):
    told = _lies_off(route((0.0, 600.0), (0.0, 600.0 + off_m)))
    assert told.startswith(says)
    assert bool(told) == bool(says)


@pytest.mark.parametrize(("is_home", "says"), [(False, False), (True, True)])
def test_home_is_told_at_the_end_of_a_voyage_that_came_there(is_home, says):
    ctx = moment(replace(route((0.0, 0.0)), bound_for="home"), voyage={"home_reached": is_home})
    rest(ctx)
    assert ctx.state.voyage.over
    assert ("; home" in ctx.state.voyage.over) is says


def test_the_voyage_ends_without_a_mission_of_ours_on_board_too():
    ctx = moment(None, voyage={"home_reached": True})
    rest(ctx)
    assert ctx.state.voyage.over


# --------------------------------------------------------------------------------------------------- an order
NEAR = Shoal(en_m=(20.0, 0.0), radius_m=5.0, doubt_m=2.0, depth_m=1.0)
FAR = Shoal(en_m=(300.0, 0.0), radius_m=5.0, doubt_m=2.0, depth_m=1.0)


@pytest.mark.parametrize(
    ("number", "shoals", "left"),
    [
        (0, (FAR, NEAR), FAR),
        (0, (NEAR, FAR), FAR),
        (1, (FAR, NEAR), NEAR),
        (2, (FAR, NEAR), FAR),
        (2, (NEAR, FAR), NEAR),
    ],
)
def test_the_shoal_that_is_named_is_forgotten_and_else_the_nearest(number, shoals, left):
    ctx = moment(WAY, soundings={"shoals": shoals})
    _forget_shoal(ctx, forget(number))
    assert ctx.state.soundings.shoals == (left,)


def forget(number):
    return Order(wanted=Wanted(verb=Verb.FORGET_SHOAL, number=number), source=Source(kind="far"), t_s=NOW_S)


def test_why_an_order_stands_is_what_is_told_of_it():
    standing = Standing(verb=Verb.STOP, by="the ground station")
    assert _why(moment(WAY, orders={"standing": standing})) == standing.why != ""
    assert _why(moment(WAY)) == ""


# -------------------------------------------------------------------------------------------------- under way
@pytest.mark.parametrize(
    ("pending", "urgent", "is_asked"),
    [
        (None, False, True),
        (ReplanReason.WIND_SHIFT, False, False),
        (ReplanReason.WIND_SHIFT, True, True),
        (ReplanReason.OBSTACLE, True, False),  # it is planned for that already
        (ReplanReason.OBSTACLE, False, False),
    ],
)
def test_a_plan_that_is_made_gives_way_to_an_urgent_one_for_another_reason(monkeypatch, pending, urgent, is_asked):
    trigger = Trigger(reason=ReplanReason.OBSTACLE, text="a rock", urgent=urgent)
    monkeypatch.setattr(sailing, "find_trigger", lambda ctx, fresh: trigger)
    being_made = None if pending is None else replace(asked_for(WAY), reason=pending)
    ctx = moment(WAY, pending={"plan": being_made}, plans={"last_s": NOW_S - 600.0})
    _consider(ctx)
    assert any(isinstance(a, act.RequestPlan) for a in ctx.actions) is is_asked


def test_in_a_mode_that_is_not_hers_she_is_put_into_no_loiter():
    """Nor where nothing is foreseen to be drifted onto: what is not done is not said to be."""
    ctx = moment(WAY, speed_mps=0.0)
    by_hand = replace(ctx.snapshot.autopilot, mode=Mode.MANUAL)
    for seen in ({}, {"autopilot": by_hand}):
        ctx = moment(WAY, speed_mps=0.0, seen=seen)
        assert _loiters(ctx, None) is False
        assert ctx.state.phase is Phase.STANDARD


@pytest.mark.parametrize("may", [True, False])
def test_the_loiter_that_she_was_put_into_is_kept_where_that_is_permitted(may):
    lies = replace(moment(WAY).snapshot.autopilot, mode=Mode.LOITER)
    given = None if may else Permissions(may_upload=True)
    ctx = moment(WAY, speed_mps=0.0, seen={"autopilot": lies}, steering={"own_mode": Mode.LOITER}, permissions=given)
    assert _loiters(ctx, None) is may
    assert (ctx.state.phase is Phase.HOLDING) is may


@pytest.mark.parametrize(("off_m", "tacks"), [(12.0, True), (14.0, False)])
def test_before_a_wall_she_is_tacked_three_and_a_half_seconds_ahead(off_m, tacks):
    """Close-hauled at 2 m/s she comes 5 m nearer in that, and the floor is 8 m."""
    wall = shapely.box(off_m, -80.0, off_m + 30.0, 80.0)
    limits = AutopilotLimits(sail_xtrack_max_m=50.0)
    ctx = moment(WAY, heading_deg=45.0, speed_mps=2.0, obstacles=(wall,), seen={"limits": limits})
    short_tack(ctx)
    assert any(isinstance(a, act.Tack) for a in ctx.actions) is tacks


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize(
    ("off_deg", "tacks"), [(0.0, False), (20.0, False), (25.0, True), (45.0, True), (65.0, True), (70.0, False)]
)
def test_on_a_header_she_is_tacked_close_hauled_and_not_as_she_turns_or_has_borne_away(side, off_deg, tacks):
    ctx = moment(
        WAY,
        at=(30.0 * side, 0.0),
        heading_deg=side * off_deg,
        mean_deg=-14.0 * side,
        sigma_deg=12.0,
        config={"autopilot_beats": True, "shifts": True},
        seen={"limits": AutopilotLimits(sail_xtrack_max_m=50.0)},
    )
    assert math.degrees(ctx.no_go_half_rad) == pytest.approx(45.0)
    shift_tack(ctx)
    told = [a.text for a in ctx.actions if isinstance(a, act.Tack)]
    assert bool(told) is tacks
    assert not told or told[0].startswith("headed 14°")
