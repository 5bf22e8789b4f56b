"""Getting under way: the first plan on board, then AUTO and arming as far as the operator allows."""

from __future__ import annotations

import math
from dataclasses import replace

from companion.boat import points_too_high, required_margin
from companion.frozen import changed
from companion.geo.angles import difference_rad
from companion.messages import MissionState, Mode, Severity
from companion.skipper.behaviors.helm import arm, make_current, repair, set_mode
from companion.skipper.behaviors.rest import reached_words
from companion.skipper.planning.asking import lacks, request
from companion.skipper.planning.diversions import announcement, fenced_off, home_trouble
from companion.skipper.planning.uploads import upload
from companion.skipper.planning.vessels import lies_in_the_way
from companion.skipper.step import Phase, ReplanReason, SafeEnd, StepContext, WindHealth
from companion.skipper.step.wind_limits import winds_wanted
from companion.skipper.way.gates import Approach
from companion.skipper.way.geometry import distance_m, leg_distance_m
from companion.skipper.way.shoals import beyond_words

HAIR_M = 0.3  # what a repaired start's lead-in may come nearer by
STALE_S = 60.0  # a plan that waits for permission is renewed no more often than this


def start(ctx: StepContext) -> None:
    """Get a first plan on board."""
    state, snapshot = ctx.state, ctx.snapshot
    if state.pending.upload is not None:
        ctx.phase(Phase.WAITING, "waiting for the first plan's upload")
        return
    if state.pending.plan is not None:
        ctx.phase(Phase.NEW_CALCULATION, "making the first plan")
        return
    if state.plans.ready_route is not None and ctx.t_s - state.plans.ready_route.plan_t_s < 60.0:
        ctx.phase(
            Phase.WAITING, f"a plan is ready; waiting for permission to upload it: {snapshot.permissions.to_upload}"
        )
        if snapshot.permissions.may_upload:
            upload(ctx, state.plans.ready_route, 1, "the first plan")
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
        wrong = _misplaced(ctx) or (lies_in_the_way(ctx) if state.plans.retry.failures else "")
        wants.append(f"the next try in {wait_s:.0f} s" + (f": {wrong}" if wrong else ""))
    ctx.set(wants=tuple(wants))
    if wants:
        ctx.phase(Phase.WAITING, "waiting for " + ", ".join(wants))
        return
    if _request_start(ctx):
        ctx.phase(Phase.NEW_CALCULATION, "making the first plan")
    else:
        ctx.phase(Phase.WAITING, f"waiting for {lacks(ctx) or 'the next try: no problem can be stated'}")


def _misplaced(ctx: StepContext) -> str:
    """Return what is wrong with where the boat lies, empty: nothing that would keep a plan from starting there."""
    here = ctx.boat_en
    if here is None:
        return ""
    far_m = distance_m(here, ctx.voyage.goals[0].en_m)
    if far_m > ctx.voyage.far_m:
        return f"she is {far_m / 1000.0:.0f} km from the first goal; is it the right mission, and the right home?"
    clearance_m = float(ctx.voyage.area.clearance_m([here])[0])
    if clearance_m > 0.0:
        return ""
    if clearance_m < float(ctx.voyage.area.unfenced.clearance_m([here])[0]):
        return f"she is {-clearance_m:.0f} m {beyond_words(ctx.voyage.area, here)}"
    return f"her position is inside {ctx.voyage.area.nearest_name(here) or 'an obstacle'}"


def finished(ctx: StepContext) -> None:
    """Nothing is left to sail: all goals were reached before this start. Watch the boat if it is under way."""
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
        _look_at_margin(ctx)
        _look_at_no_go(ctx)
        _look_at_home(ctx)
        if status.mission_state in {MissionState.COMPLETE, MissionState.NOT_STARTED, MissionState.PAUSED}:
            make_current(ctx, state.mission.index + 1)
        return
    ctx.set(voyage=changed(ctx.state.voyage, sailing=False))
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
    may = ctx.snapshot.permissions
    mode = status.mode.name if status.mode is not None else "unknown"
    if not status.ekf_ok:
        ctx.phase(Phase.WAITING, "waiting for the autopilot's position filter (EKF)")
    elif ctx.boat_en is None:
        # its first leg would start wherever the autopilot believes to be
        ctx.phase(Phase.WAITING, "waiting for a position that can be believed")
    elif status.is_armed and status.mode is not Mode.AUTO:
        ctx.phase(Phase.WAITING, f"armed in {mode}: waiting for the operator to give AUTO")
    elif status.mode is not Mode.AUTO:
        by_hand = "the operator to set AUTO (or [operator] set_auto = true)"
        who = "the autopilot to take AUTO" if may.may_set_mode else by_hand
        ctx.phase(Phase.WAITING, f"waiting for {who}")
        set_mode(ctx, Mode.AUTO, "setting sail")
    else:
        who = "the autopilot to arm" if may.may_arm else "the operator to arm (or [operator] arm = true)"
        ctx.phase(Phase.WAITING, f"ready: waiting for {who}")
        arm(ctx)


def _look_at_margin(ctx: StepContext) -> None:
    """Say so when the autopilot's own corridor is wider than the margin that plans keep."""
    limits, wind = ctx.snapshot.limits, ctx.wind_mean
    if limits is None or wind is None:
        return
    boat = ctx.voyage.boat
    limits = replace(limits, sail_xtrack_max_m=ctx.tack_corridor_m)
    asked = required_margin(limits, speed_mps=boat.polar.max_speed_mps(wind[1]), hull=boat.hull)
    if asked.total_m > ctx.config.margin_m + 0.5:
        ctx.say(
            Severity.WARNING,
            "margin",
            f"the margin is {ctx.config.margin_m:g} m; the autopilot's habits ask for {asked.describe()}",
        )


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
    wrong = _misplaced(ctx)
    if wrong:
        return wrong
    age_s, config = ctx.t_s - ctx.state.plans.last_s, ctx.config
    clear_m = ctx.voyage.area.path_clearance_m([boat, leg[1]])
    # From below the floor a way that comes no nearer than the boat lies leads it out; another plan would be no other
    # way.
    here_m = float(ctx.voyage.area.clearance_m([boat])[0])
    if clear_m < min(config.margin_floor_m, config.margin_m, here_m - HAIR_M):
        where = f"{max(0.0, clear_m):.0f} m from {ctx.voyage.area.nearest_name(boat)} on the way to the first waypoint"
        return f"she lies or has drifted {where}"
    if age_s < STALE_S:
        return ""
    off_m = min(leg_distance_m(boat, *leg), distance_m(boat, leg[0]))
    if off_m > config.grid_size_m:
        return f"she has drifted {off_m:.0f} m off the first leg"
    turned = abs(difference_rad(wind[0], route.plan_twd_from_rad))
    return f"the wind has turned {math.degrees(turned):.0f}°" if turned > config.wind_change_rad else ""
