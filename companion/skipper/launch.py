"""Getting under way: the first plan on board, then AUTO and arming as far as the operator allows."""

from __future__ import annotations

from companion.boat import required_margin
from companion.geo.angles import difference_rad
from companion.messages import MissionState, Mode
from companion.skipper.actions import ReplanReason, Severity
from companion.skipper.gates import Approach
from companion.skipper.geometry import distance_m, leg_distance_m
from companion.skipper.helm import arm, make_current, repair, set_mode
from companion.skipper.planning import request
from companion.skipper.snapshot import WindHealth
from companion.skipper.state import Phase
from companion.skipper.turn import Turn
from companion.skipper.uploads import upload

STALE_S = 60.0           # a plan that waits for permission is renewed no more often than this


def start(turn: Turn) -> None:
    """Get a first plan on board."""
    state, snapshot = turn.state, turn.snapshot
    if state.pending_upload is not None:
        turn.phase(Phase.WAITING, "uploading the first plan")
        return
    if state.pending_plan is not None:
        turn.phase(Phase.NEW_CALCULATION, "making the first plan")
        return
    if state.ready_route is not None and turn.t_s - state.ready_route.plan_t_s < 60.0:
        turn.phase(Phase.WAITING, "a plan is ready; waiting for permission to upload it")
        if snapshot.permissions.may_upload:
            upload(turn, state.ready_route, 1, "the first plan")
        return
    wants = []
    if turn.boat_en is None:
        wants.append("a position")
    if turn.autopilot is not None and not turn.autopilot.ekf_ok:
        wants.append("the autopilot's position filter (EKF)")
    wind = snapshot.wind
    if wind.forecast is None or wind.health in {WindHealth.NONE, WindHealth.SETTLING}:
        wants.append("wind")
    elif wind.health is WindHealth.UNTRUSTED:
        wants.append(f"a wind that can be believed ({wind.verdict or 'sensor untrusted'})")
    elif wind.record_s < turn.config.wind_settle_s:
        wants.append(f"{turn.config.wind_settle_s - wind.record_s:.0f} s more of wind")
    wait_s = max(state.plan_retry.not_before_s, state.upload_retry.not_before_s) - turn.t_s
    if wait_s > 0.0:
        wants.append(f"the next try in {wait_s:.0f} s")
    turn.update(wants=tuple(wants))
    if wants:
        turn.phase(Phase.WAITING, "waiting for " + ", ".join(wants))
        return
    if _request_start(turn):
        turn.phase(Phase.NEW_CALCULATION, "making the first plan")
    else:
        turn.phase(Phase.WAITING, "no problem can be stated yet")


def _request_start(turn: Turn, text: str = "") -> bool:
    """Ask for a plan from where the boat lies: until a gate is passed, the way to the first goal begins here."""
    if turn.state.gate == 0 and turn.boat_en is not None:
        turn.approach(Approach(goal=0, en_m=turn.boat_en))
    return request(turn, ReplanReason.START, text=text)


def launch(turn: Turn) -> None:
    """Set AUTO and arm, as far as the operator allows; otherwise wait and say for what."""
    status, state = turn.autopilot, turn.state
    if status is None or state.route is None:
        return
    if repair(turn):
        return
    if state.pending_upload is not None or state.pending_plan is not None:
        turn.phase(Phase.WAITING, "renewing the plan before setting sail")
        return
    if status.mode is Mode.AUTO and status.is_armed:
        turn.update(sailing=True, history=(), own_index=state.index)
        turn.phase(Phase.STANDARD, "under way")
        turn.say(Severity.NOTICE, "under way", "AUTO and armed: under way", every_s=0.0)
        _look_at_margin(turn)
        if status.mission_state in {MissionState.COMPLETE, MissionState.NOT_STARTED, MissionState.PAUSED}:
            make_current(turn, state.index + 1)
        return
    turn.update(sailing=False)
    if _is_stale(turn) and turn.t_s >= max(state.plan_retry.not_before_s, state.upload_retry.not_before_s):
        _request_start(turn, "the boat drifted or the wind turned before setting sail")
        turn.phase(Phase.WAITING, "renewing the plan before setting sail")
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
        turn.phase(Phase.WAITING, "asking for AUTO" if may.may_set_mode else "waiting for the operator to set AUTO")
        set_mode(turn, Mode.AUTO, "setting sail")
    else:
        turn.phase(Phase.WAITING, "arming" if may.may_arm else "ready: waiting for the operator to arm")
        arm(turn)


def _look_at_margin(turn: Turn) -> None:
    """Say so when the autopilot's own corridor is wider than the margin that plans keep."""
    limits, wind = turn.snapshot.limits, turn.wind_mean
    if limits is None or wind is None:
        return
    boat = turn.voyage.boat
    asked = required_margin(limits, speed_mps=boat.polar.max_speed_mps(wind[1]), hull=boat.hull)
    if asked.total_m > turn.config.margin_m + 0.5:
        turn.say(Severity.WARNING, "margin",
                 f"the margin is {turn.config.margin_m:g} m; the autopilot's habits ask for {asked.describe()}")


def _is_stale(turn: Turn) -> bool:
    """Return whether the plan no longer fits: the boat has drifted off its leg or behind something, the wind turned."""
    boat, leg, wind, route = turn.boat_en, turn.leg(), turn.wind_mean, turn.state.route
    if boat is None or leg is None or wind is None or route is None or turn.snapshot.wind.forecast is None:
        return False
    age_s, config = turn.t_s - turn.state.last_plan_s, turn.config
    if turn.voyage.area.path_clearance_m([boat, leg[1]]) < min(config.margin_floor_m, config.margin_m):
        return age_s > config.no_go_replan_interval_s
    if age_s < STALE_S:
        return False
    off = min(leg_distance_m(boat, *leg), distance_m(boat, leg[0]))
    return off > turn.config.grid_size_m or (
        abs(difference_rad(wind[0], route.plan_twd_from_rad)) > turn.config.wind_change_rad)
