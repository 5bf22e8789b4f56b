"""Getting under way: the first plan on board, then AUTO and arming as far as the operator allows."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from companion.boat import points_too_high
from companion.frozen import changed
from companion.geo.angles import difference_rad
from companion.messages import MissionState, Mode, Severity
from companion.skipper.behaviors.helm import arm, make_current, repair, set_mode
from companion.skipper.behaviors.rest import reached_words
from companion.skipper.planning.asking import (
    GATHERS_WAY_S,
    SETS_SAIL_S,
    UPLOAD_LATENCY_S,
    drifted_en,
    lacks,
    out_of_reach,
    request,
)
from companion.skipper.planning.diversions import announcement, fenced_off, home_trouble
from companion.skipper.planning.uploads import look_at_margin, upload
from companion.skipper.planning.vessels import lies_in_the_way
from companion.skipper.step import Phase, ReplanReason, SafeEnd, StepContext, WindHealth
from companion.skipper.step.wind_limits import winds_wanted
from companion.skipper.way.gates import Approach
from companion.skipper.way.geometry import distance_m, leg_distance_m
from companion.skipper.way.shoals import beyond_words
from companion.skipper.way.voyage import AreaLike, PointEn, water_to_keep

HAIR_M = 0.3  # what a repaired start's lead-in may come nearer by
LOOKS = 25  # places looked at on a way that begins where no clearance of a line tells
STALE_S = 60.0  # a plan that waits for permission is renewed no more often than this


def start(ctx: StepContext) -> None:
    """Get a first plan on board."""
    state, snapshot = ctx.state, ctx.snapshot
    if state.pending.upload is not None:
        ctx.phase(Phase.WAITING, f"waiting for {_which(ctx)}'s upload")
        return
    if state.pending.plan is not None:
        ctx.phase(Phase.NEW_CALCULATION, f"making {_which(ctx)}")
        return
    if state.plans.ready_route is not None and ctx.t_s - state.plans.ready_route.plan_t_s < 60.0:
        ctx.phase(
            Phase.WAITING, f"a plan is ready; waiting for permission to upload it: {snapshot.permissions.to_upload}"
        )
        if snapshot.permissions.may_upload:
            upload(ctx, state.plans.ready_route, 1, _which(ctx))
        return
    shut = next(filter(None, (fenced_off(ctx, gate) for gate in ctx.gates[ctx.state.progress.gate :])), "")
    if shut:
        ctx.phase(Phase.WAITING, f"waiting: {shut}")
        ctx.say(Severity.ERROR, "fenced off", f"not setting sail: {shut}")
        return
    wants = []
    if ctx.boat_en is None:
        wants.append(
            "a position"
            + (f" that can be believed: {state.position.doubt.why}" if state.position.doubt is not None else "")
        )
    if ctx.autopilot is not None and not ctx.autopilot.ekf_ok:
        wants.append("the autopilot's position filter (EKF)")
    wind = snapshot.wind
    if wind.forecast is None or wind.health in {WindHealth.NONE, WindHealth.SETTLING}:
        wants.append("wind")
    elif wind.health is WindHealth.UNTRUSTED:
        wants.append(f"a wind that can be believed ({wind.verdict or 'sensor untrusted'})")
    elif wind.record_s < ctx.config.wind_settle_s:
        wants.append(f"{ctx.config.wind_settle_s - wind.record_s:.0f} s more of wind")
    wants += winds_wanted(ctx)
    wait_s = max(state.plans.retry.not_before_s, state.pending.upload_retry.not_before_s) - ctx.t_s
    if wait_s > 0.0:
        wrong = _misplaced(ctx)
        if not wrong and state.plans.retry.failures:
            wrong = lies_in_the_way(ctx) or out_of_reach(ctx, ctx.gate)
        wants.append(f"the next try in {wait_s:.0f} s" + (f": {wrong}" if wrong else ""))
    ctx.set(wants=tuple(wants))
    if wants:
        ctx.phase(Phase.WAITING, "waiting for " + ", ".join(wants))
        return
    if _request_start(ctx):
        ctx.phase(Phase.NEW_CALCULATION, f"making {_which(ctx)}")
    else:
        ctx.phase(Phase.WAITING, f"waiting for {lacks(ctx) or 'the next try: no problem can be stated'}")


def _which(ctx: StepContext) -> str:
    """Return what the plan that is made is called: in place of a mission that somebody brought it is not the first."""
    return "a new plan" if ctx.state.voyage.under_way_s > 0.0 else "the first plan"


def _far_off(ctx: StepContext) -> str:
    """Return that the boat is nowhere near her mission, in words; empty: she is, or her place is not known."""
    here = ctx.boat_en
    far_m = 0.0 if here is None else distance_m(here, ctx.voyage.goals[0].en_m)
    if far_m <= ctx.voyage.far_m:
        return ""
    return f"she is {far_m / 1000.0:.0f} km from the first goal; is it the right mission, and the right home?"


def _misplaced(ctx: StepContext) -> str:
    """Return what is wrong with where the boat lies, in words; empty: nothing, or her place is not known."""
    here, far = ctx.boat_en, _far_off(ctx)
    if here is None or far:
        return far
    clearance_m = float(ctx.voyage.area.clearance_m([here])[0])
    if clearance_m > 0.0:
        return ""
    if clearance_m < float(ctx.voyage.area.unfenced.clearance_m([here])[0]):
        return f"she is {-clearance_m:.0f} m {beyond_words(ctx.voyage.area, here)}"
    return f"her position is inside {ctx.voyage.area.nearest_name(here) or 'an obstacle'}"


def finished(ctx: StepContext) -> None:
    """Nothing was left to sail before this start. Watch the boat if it is under way."""
    status = ctx.autopilot
    if status is not None and status.is_armed and status.mode is Mode.AUTO and ctx.state.mission.route is not None:
        ctx.set(
            voyage=changed(ctx.state.voyage, sailing=True),
            mission=changed(ctx.state.mission, own_index=ctx.state.mission.index),
        )
        return
    ctx.phase(Phase.DONE, f"{reached_words(ctx)} before this start; --again sails the mission again")


def _request_start(ctx: StepContext, text: str = "") -> bool:
    """Ask for a plan from where the boat lies: until a gate is passed, the way to the first goal begins here."""
    if ctx.state.progress.gate == 0 and ctx.boat_en is not None:
        ctx.approach(Approach(goal=0, en_m=ctx.boat_en))
    return request(ctx, ReplanReason.START, text=text)


def launch(ctx: StepContext) -> None:
    """Set AUTO and arm, as far as the operator allows; otherwise wait and say for what."""
    status, state = ctx.autopilot, ctx.state
    if status is None or state.mission.route is None:
        return
    if repair(ctx):
        return
    ctx.say(Severity.INFO, "safe ends", announcement(ctx.config, ctx.voyage.boat), every_s=math.inf)
    wanted = winds_wanted(ctx)
    if ctx.snapshot.unsure:
        wanted.append(f"a wind that is known ({ctx.snapshot.unsure})")
    if wanted and not (status.mode is Mode.AUTO and status.is_armed):
        ctx.set(voyage=changed(ctx.state.voyage, sailing=False))
        ctx.phase(Phase.WAITING, f"not setting sail: waiting for {' and '.join(wanted)}")
        return
    stale = _stale(ctx)
    if state.pending.upload is not None or state.pending.plan is not None:
        what = "a new plan" if state.pending.plan is not None else "a new plan's upload"
        ctx.phase(Phase.WAITING, f"waiting for {what} before setting sail" + (f": {stale}" if stale else ""))
        return
    if status.mode is Mode.AUTO and status.is_armed:
        ctx.set(
            voyage=changed(ctx.state.voyage, sailing=True),
            progress=changed(ctx.state.progress, history=()),
            mission=changed(ctx.state.mission, own_index=state.mission.index),
        )
        ctx.phase(Phase.STANDARD, "under way")
        ctx.say(Severity.NOTICE, "under way", "AUTO and armed: under way", every_s=0.0)
        _tell_clearance(ctx)
        look_at_margin(ctx)
        _look_at_no_go(ctx)
        _look_at_home(ctx)
        if status.mission_state in {MissionState.COMPLETE, MissionState.NOT_STARTED, MissionState.PAUSED}:
            make_current(ctx, state.mission.index + 1)
        return
    ctx.set(voyage=changed(ctx.state.voyage, sailing=False))
    far = _far_off(ctx)
    if far:
        ctx.phase(Phase.WAITING, f"waiting for her to be brought to her mission, or for the right one: {far}")
        ctx.say(Severity.ERROR, "far off", f"not setting sail: {far}", every_s=math.inf)
        return
    if stale:
        earliest_s = state.plans.last_s + ctx.config.no_go_replan_interval_s
        wait_s = max(state.plans.retry.not_before_s, state.pending.upload_retry.not_before_s, earliest_s) - ctx.t_s
        if wait_s > 0.0:
            why = f"the next try in {wait_s:.0f} s to plan anew"
        elif _request_start(ctx, f"{stale}, before setting sail"):
            why = "a new plan before setting sail"
        else:
            why = lacks(ctx) or "the next try: no problem can be stated"
        ctx.phase(Phase.WAITING, f"waiting for {why}: {stale}")
        return
    wrong = _misplaced(ctx)
    if wrong:
        ctx.say(Severity.WARNING, "misplaced", f"{wrong}: her first leg leads back from there", every_s=math.inf)
    may = ctx.snapshot.permissions
    mode = status.mode.name if status.mode is not None else "unknown"
    if not status.ekf_ok:
        ctx.phase(Phase.WAITING, "waiting for the autopilot's position filter (EKF)")
    elif ctx.boat_en is None:
        # its first leg would start wherever the autopilot believes to be
        ctx.phase(Phase.WAITING, "waiting for a position that can be believed")
    elif status.is_armed and status.mode is not Mode.AUTO:
        ctx.phase(Phase.WAITING, f"armed in {mode}: waiting for the operator to give AUTO")
    elif ctx.state.operator.put is not None:
        text = f"{mode} was set by somebody else"
        ctx.phase(Phase.WAITING, f"not setting sail: waiting for AUTO, or the order go_on: {text}")
        ctx.say(Severity.WARNING, "put", f"not setting sail: {text}: set AUTO, or order go_on", every_s=math.inf)
    elif status.mode is not Mode.AUTO:
        by_hand = "the operator to set AUTO (or [operator] set_auto = true)"
        who = "the autopilot to take AUTO" if may.may_set_mode else by_hand
        ctx.phase(Phase.WAITING, f"waiting for {who}")
        set_mode(ctx, Mode.AUTO, "setting sail")
    else:
        who = "the autopilot to arm" if may.may_arm else "the operator to arm (or [operator] arm = true)"
        ctx.phase(Phase.WAITING, f"ready: waiting for {who}")
        arm(ctx)


def _look_at_no_go(ctx: StepContext) -> None:
    """Say so when the autopilot points higher than the boat sails: there it stalls, and its tacks fail."""
    own_rad, boat_rad = ctx.no_go_half_rad, ctx.voyage.boat.no_go_half_rad
    if ctx.snapshot.limits is not None and ctx.config.sails and points_too_high(own_rad, boat_rad):
        ctx.say(
            Severity.WARNING,
            "no-go",
            f"SAIL_NO_GO_ANGLE is {math.degrees(own_rad):.0f} degrees, the boat's no-go angle "
            f"{math.degrees(boat_rad):.0f}: the autopilot points higher than it sails",
        )


def _look_at_home(ctx: StepContext) -> None:
    """Say so when the mission wants to end at home and that cannot be."""
    trouble = home_trouble(ctx) if ctx.config.safe_end is SafeEnd.RETURN else ""
    if trouble:
        ctx.say(Severity.WARNING, "home", f"{trouble}: the voyage ends in a loiter at its last goal", every_s=0.0)


def _stale(ctx: StepContext) -> str:
    """Return why the plan no longer fits, in words; empty: it does, or what has changed may wait."""
    boat, leg, wind, route = ctx.boat_en, ctx.leg(), ctx.wind_mean, ctx.state.mission.route
    if boat is None or leg is None or wind is None or route is None or ctx.snapshot.wind.forecast is None:
        return ""
    near = _comes_near(ctx, boat, leg[1])
    if near:
        return f"she lies or has drifted {near}"
    age_s, config = ctx.t_s - ctx.state.plans.last_s, ctx.config
    # A plan that is just there was made from where the drift leads. Held against it again, a boat that drifts ever
    # faster would plan for ever and lie there: each plan takes longer than setting sail.
    if age_s > ctx.plan_lead_s + UPLOAD_LATENCY_S + SETS_SAIL_S:
        near = _comes_near(ctx, drifted_en(ctx, SETS_SAIL_S) or boat, leg[1])
        if near:
            return f"before she gathers way she drifts {near}"
    if age_s < STALE_S:
        return ""
    off_m = min(leg_distance_m(boat, *leg), distance_m(boat, leg[0]))
    if off_m > config.grid_size_m:
        return f"she has drifted {off_m:.0f} m off the first leg"
    turned = abs(difference_rad(wind[0], route.plan_twd_from_rad))
    return f"the wind has turned {math.degrees(turned):.0f}°" if turned > config.wind_change_rad else ""


def _comes_near(ctx: StepContext, here: PointEn, to: PointEn) -> str:
    """Return in words how the way from a place to the first waypoint comes nearer than it may; empty: it does not.

    From below the floor, or outside or inside of what is drawn, a way that comes no nearer leads her out: another plan
    would be no other way.
    """
    config, area = ctx.config, water_to_keep(ctx.voyage.area, here)
    floor_m = min(config.margin_floor_m, config.margin_m)
    here_m, solid_m = (float(water.clearance_m([here])[0]) for water in (area, area.unfenced))
    clear_m = _way_m(area, here, to)
    is_near = clear_m < min(floor_m, here_m - HAIR_M)
    if here_m <= 0.0 < solid_m:  # outside the limits nothing solid may lie on the way back
        is_near = is_near or area.unfenced.path_clearance_m([here, to]) < min(floor_m, solid_m - HAIR_M)
    return (
        f"{max(0.0, clear_m):.0f} m from {area.nearest_name(here)} on the way to the first waypoint" if is_near else ""
    )


def _way_m(area: AreaLike, here: PointEn, to: PointEn) -> float:
    """Return the least clearance of a straight way [m]; that of one that begins where it is 0 or less is below 0."""
    if float(area.clearance_m([here])[0]) > 0.0:
        return area.path_clearance_m([here, to])
    return float(np.min(area.clearance_m(np.linspace(here, to, LOOKS))))


def _tell_clearance(ctx: StepContext) -> None:
    """Let the clearance that is told be of the track from where she gathers way, where the plan began elsewhere."""
    here, leg, route = drifted_en(ctx, GATHERS_WAY_S), ctx.leg(), ctx.state.mission.route
    if here is None or leg is None or route is None or route.expected_clearance_m is None:
        return
    seen_m, told_m = _hull_clear_m(ctx, here, leg[1]), route.expected_clearance_m
    if seen_m < told_m:
        route = replace(route, expected_clearance_m=seen_m, planned_clearance_m=told_m)
        ctx.set(mission=changed(ctx.state.mission, route=route))


def leave_start(ctx: StepContext) -> None:
    """Let the clearance that is told be the plan's again, once the way to her next waypoint has as much."""
    here, leg, route = ctx.boat_en, ctx.leg(), ctx.state.mission.route
    if (
        route is None
        or route.planned_clearance_m is None
        or here is None
        or leg is None
        or not ctx.state.voyage.sailing
    ):
        return
    planned_m = route.planned_clearance_m
    if _hull_clear_m(ctx, here, leg[1]) >= planned_m:
        route = replace(route, expected_clearance_m=planned_m, planned_clearance_m=None)
        ctx.set(mission=changed(ctx.state.mission, route=route))


def _hull_clear_m(ctx: StepContext, here: PointEn, to: PointEn) -> float:
    """Return the least clearance of the hull on a straight way [m]."""
    return _way_m(water_to_keep(ctx.voyage.area, here), here, to) - ctx.voyage.boat.hull.reach_m
