"""Getting under way: the first plan on board, then AUTO and arming as far as the operator allows."""

from __future__ import annotations

import math
from dataclasses import replace

from companion.boat import required_margin
from companion.frozen import changed
from companion.geo.angles import difference_rad
from companion.messages import MissionState, Mode
from companion.skipper.deeds.helm import arm, make_current, repair, set_mode
from companion.skipper.planning.asking import lacks, request
from companion.skipper.planning.ends import announcement
from companion.skipper.planning.errands import fenced_off, home_trouble
from companion.skipper.planning.uploads import upload
from companion.skipper.step.actions import ReplanReason, Severity
from companion.skipper.step.config import SafeEnd
from companion.skipper.step.snapshot import WindHealth
from companion.skipper.step.state import Phase
from companion.skipper.step.turn import Turn
from companion.skipper.step.wind_limits import winds_wanted
from companion.skipper.way.gates import Approach
from companion.skipper.way.geometry import distance_m, leg_distance_m

ARRIVED_BEFORE = "all goals were reached before this start; --again sails the mission again"
MAY_UPLOAD = "[operator] set_auto = true in the mission, and no --dry-run"
STALE_S = 60.0           # a plan that waits for permission is renewed no more often than this


def start(turn: Turn) -> None:
    """Get a first plan on board."""
    state, snapshot = turn.state, turn.snapshot
    if state.pending.upload is not None:
        turn.phase(Phase.WAITING, "waiting for the first plan's upload")
        return
    if state.pending.plan is not None:
        turn.phase(Phase.NEW_CALCULATION, "making the first plan")
        return
    if state.plans.ready_route is not None and turn.t_s - state.plans.ready_route.plan_t_s < 60.0:
        turn.phase(Phase.WAITING, f"a plan is ready; waiting for permission to upload it: {MAY_UPLOAD}")
        if snapshot.permissions.may_upload:
            upload(turn, state.plans.ready_route, 1, "the first plan")
        return
    shut = next(filter(None, (fenced_off(turn, gate) for gate in turn.gates[turn.state.progress.gate:])), "")
    if shut:
        turn.phase(Phase.WAITING, f"waiting: {shut}")
        turn.say(Severity.ERROR, "fenced off", f"not setting sail: {shut}")
        return
    wants = []
    if turn.boat_en is None:
        wants.append("a position" + (
            f" that can be believed: {state.position.doubt.why}" if state.position.doubt is not None else ""))
    if turn.autopilot is not None and not turn.autopilot.ekf_ok:
        wants.append("the autopilot's position filter (EKF)")
    wind = snapshot.wind
    if wind.forecast is None or wind.health in {WindHealth.NONE, WindHealth.SETTLING}:
        wants.append("wind")
    elif wind.health is WindHealth.UNTRUSTED:
        wants.append(f"a wind that can be believed ({wind.verdict or 'sensor untrusted'})")
    elif wind.record_s < turn.config.wind_settle_s:
        wants.append(f"{turn.config.wind_settle_s - wind.record_s:.0f} s more of wind")
    wants += winds_wanted(turn)
    wait_s = max(state.plans.retry.not_before_s, state.pending.upload_retry.not_before_s) - turn.t_s
    if wait_s > 0.0:
        wrong = _misplaced(turn)
        wants.append(f"the next try in {wait_s:.0f} s" + (f": {wrong}" if wrong else ""))
    turn.set(wants=tuple(wants))
    if wants:
        turn.phase(Phase.WAITING, "waiting for " + ", ".join(wants))
        return
    if _request_start(turn):
        turn.phase(Phase.NEW_CALCULATION, "making the first plan")
    else:
        turn.phase(Phase.WAITING, f"waiting for {lacks(turn) or 'the next try: no problem can be stated'}")


def _misplaced(turn: Turn) -> str:
    """Return what is wrong with where she lies, empty: nothing that would keep a plan from starting there."""
    here = turn.boat_en
    if here is None:
        return ""
    far_m = distance_m(here, turn.voyage.goals[0].en_m)
    if far_m > turn.voyage.far_m:
        return f"she is {far_m / 1000.0:.0f} km from the first goal; is it the right mission, and the right home?"
    clearance_m = float(turn.voyage.area.clearance_m([here])[0])
    if clearance_m > 0.0:
        return ""
    if clearance_m < float(turn.voyage.area.unfenced.clearance_m([here])[0]):
        return f"she is {-clearance_m:.0f} m outside the fence"
    return f"her position is inside {turn.voyage.area.nearest_name(here) or 'an obstacle'}"


def finished(turn: Turn) -> None:
    """Nothing is left to sail: all goals were reached before this start. Watch her if she is under way."""
    status = turn.autopilot
    if status is not None and status.is_armed and status.mode is Mode.AUTO and turn.state.mission.route is not None:
        turn.set(
            voyage=changed(turn.state.voyage, sailing=True),
            mission=changed(turn.state.mission, own_index=turn.state.mission.index))
        return
    turn.phase(Phase.DONE, ARRIVED_BEFORE)


def _request_start(turn: Turn, text: str = "") -> bool:
    """Ask for a plan from where the boat lies: until a gate is passed, the way to the first goal begins here."""
    if turn.state.progress.gate == 0 and turn.boat_en is not None:
        turn.approach(Approach(goal=0, en_m=turn.boat_en))
    return request(turn, ReplanReason.START, text=text)


def launch(turn: Turn) -> None:
    """Set AUTO and arm, as far as the operator allows; otherwise wait and say for what."""
    status, state = turn.autopilot, turn.state
    if status is None or state.mission.route is None:
        return
    if repair(turn):
        return
    turn.say(Severity.INFO, "safe ends", announcement(turn.config, turn.voyage.boat), every_s=math.inf)
    wanted = winds_wanted(turn)
    if wanted and not (status.mode is Mode.AUTO and status.is_armed):
        turn.set(voyage=changed(turn.state.voyage, sailing=False))
        turn.phase(Phase.WAITING, f"not setting sail: waiting for {' and '.join(wanted)}")
        return
    stale = _stale(turn)
    if state.pending.upload is not None or state.pending.plan is not None:
        what = "a new plan" if state.pending.plan is not None else "a new plan's upload"
        turn.phase(Phase.WAITING, f"waiting for {what} before setting sail" + (f": {stale}" if stale else ""))
        return
    if status.mode is Mode.AUTO and status.is_armed:
        turn.set(
            voyage=changed(turn.state.voyage, sailing=True),
            progress=changed(turn.state.progress, history=()),
            mission=changed(turn.state.mission, own_index=state.mission.index))
        turn.phase(Phase.STANDARD, "under way")
        turn.say(Severity.NOTICE, "under way", "AUTO and armed: under way", every_s=0.0)
        _look_at_margin(turn)
        _look_at_home(turn)
        if status.mission_state in {MissionState.COMPLETE, MissionState.NOT_STARTED, MissionState.PAUSED}:
            make_current(turn, state.mission.index + 1)
        return
    turn.set(voyage=changed(turn.state.voyage, sailing=False))
    if stale:
        earliest_s = state.plans.last_s + turn.config.no_go_replan_interval_s
        wait_s = max(state.plans.retry.not_before_s, state.pending.upload_retry.not_before_s, earliest_s) - turn.t_s
        if wait_s > 0.0:
            why = f"the next try in {wait_s:.0f} s to plan anew"
        elif _request_start(turn, f"{stale}, before setting sail"):
            why = "a new plan before setting sail"
        else:
            why = lacks(turn) or "the next try: no problem can be stated"
        turn.phase(Phase.WAITING, f"waiting for {why}: {stale}")
        return
    may = turn.snapshot.permissions
    mode = status.mode.name if status.mode is not None else "unknown"
    if not status.ekf_ok:
        turn.phase(Phase.WAITING, "waiting for the autopilot's position filter (EKF)")
    elif turn.boat_en is None:
        # its first leg would start wherever the autopilot believes to be
        turn.phase(Phase.WAITING, "waiting for a position that can be believed")
    elif status.is_armed and status.mode is not Mode.AUTO:
        turn.phase(Phase.WAITING, f"armed in {mode}: waiting for the operator to give AUTO")
    elif status.mode is not Mode.AUTO:
        by_hand = "the operator to set AUTO (or [operator] set_auto = true)"
        who = "the autopilot to take AUTO" if may.may_set_mode else by_hand
        turn.phase(Phase.WAITING, f"waiting for {who}")
        set_mode(turn, Mode.AUTO, "setting sail")
    else:
        who = "the autopilot to arm" if may.may_arm else "the operator to arm (or [operator] arm = true)"
        turn.phase(Phase.WAITING, f"ready: waiting for {who}")
        arm(turn)


def _look_at_margin(turn: Turn) -> None:
    """Say so when the autopilot's own corridor is wider than the margin that plans keep."""
    limits, wind = turn.snapshot.limits, turn.wind_mean
    if limits is None or wind is None:
        return
    boat = turn.voyage.boat
    limits = replace(limits, sail_xtrack_max_m=turn.tack_corridor_m)
    asked = required_margin(limits, speed_mps=boat.polar.max_speed_mps(wind[1]), hull=boat.hull)
    if asked.total_m > turn.config.margin_m + 0.5:
        turn.say(Severity.WARNING, "margin",
                 f"the margin is {turn.config.margin_m:g} m; the autopilot's habits ask for {asked.describe()}")


def _look_at_home(turn: Turn) -> None:
    """Say so when the mission wants to end at home and that cannot be."""
    trouble = home_trouble(turn) if turn.config.safe_end is SafeEnd.RETURN else ""
    if trouble:
        turn.say(Severity.WARNING, "home", f"{trouble}: the voyage ends in a loiter at its last goal", every_s=0.0)


def _stale(turn: Turn) -> str:
    """Return why the plan no longer fits, in words; empty: it does, or what has changed may wait."""
    boat, leg, wind, route = turn.boat_en, turn.leg(), turn.wind_mean, turn.state.mission.route
    if boat is None or leg is None or wind is None or route is None or turn.snapshot.wind.forecast is None:
        return ""
    wrong = _misplaced(turn)
    if wrong:
        return wrong
    age_s, config = turn.t_s - turn.state.plans.last_s, turn.config
    clear_m = turn.voyage.area.path_clearance_m([boat, leg[1]])
    if clear_m < min(config.margin_floor_m, config.margin_m):
        where = f"{max(0.0, clear_m):.0f} m from {turn.voyage.area.nearest_name(boat)} on the way to the first waypoint"
        return f"she lies or has drifted {where}"
    if age_s < STALE_S:
        return ""
    off_m = min(leg_distance_m(boat, *leg), distance_m(boat, leg[0]))
    if off_m > config.grid_size_m:
        return f"she has drifted {off_m:.0f} m off the first leg"
    turned = abs(difference_rad(wind[0], route.plan_twd_from_rad))
    return f"the wind has turned {math.degrees(turned):.0f}°" if turned > config.wind_change_rad else ""
