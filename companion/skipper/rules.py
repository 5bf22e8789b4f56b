"""The skipper: ``step(state, snapshot) -> (state, actions)``, a pure fold over a voyage's snapshots.

The order of a step: take in what happened, find the boat on its route, look at the watchdogs, then act by who has
the boat: nobody yet (start), somebody else (operator), we (sail).
"""

from __future__ import annotations

from dataclasses import dataclass, field

from companion.boat import required_margin
from companion.geo.angles import difference_rad
from companion.messages import MissionItem, MissionState, Mode
from companion.skipper.actions import Action, CancelPlan, ReadMission, ReplanReason, Severity
from companion.skipper.config import SkipperConfig
from companion.skipper.failsafe import has_stopped
from companion.skipper.gates import Gate, gates_of
from companion.skipper.geometry import distance_m, leg_distance_m
from companion.skipper.helm import arm, hand_back, make_current, repair, set_mode
from companion.skipper.intake import (
    locate,
    notice_truncation,
    remember_fix,
    take_events,
    take_outcomes,
)
from companion.skipper.ladder import rungs
from companion.skipper.lookout import look_out
from companion.skipper.planning import request, upload
from companion.skipper.route import held_back, is_mixture, is_same_mission
from companion.skipper.sailing import sail
from companion.skipper.snapshot import OperatorWish, Snapshot, WindHealth
from companion.skipper.state import PATIENT, ByField, Persisted, Phase, SkipperState
from companion.skipper.turn import Turn
from companion.skipper.voyage import Voyage
from companion.skipper.watchdogs import watch

STALE_S = 60.0           # a plan that waits for permission is renewed no more often than this
REBOOT_RACE_S = 15.0     # a mode change this long before a reboot shows was the reboot, not the operator


@dataclass(frozen=True, slots=True, kw_only=True)
class Skipper:
    """The rules for one voyage. No state of its own: everything is in ``SkipperState``."""

    voyage: Voyage
    config: SkipperConfig
    gates: tuple[Gate, ...] = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "gates", gates_of(self.voyage))

    def initial(self, persisted: Persisted | None = None) -> SkipperState:
        """Return the first state; with ``persisted`` the mission on the autopilot may be adopted by its content."""
        if persisted is not None and (persisted.voyage != self.voyage.name or persisted.gate > len(self.gates)):
            return SkipperState(why="the saved state is of another voyage")
        return SkipperState(adoptable=persisted)

    def step(self, state: SkipperState, snapshot: Snapshot) -> tuple[SkipperState, tuple[Action, ...]]:
        """Return the next state and what to do now. Call it about once a second, always, whatever is missing."""
        turn = Turn(self.voyage, self.config, self.gates, state, snapshot)
        take_events(turn)
        take_outcomes(turn)
        locate(turn)
        look_out(turn)
        fresh = watch(turn)
        _decide(turn, fresh)
        remember_fix(turn)
        return turn.state, tuple(turn.actions)

    def prepare(self) -> None:
        """Grow the obstacles by the margins once, before sailing; on a coast of thousands of points it takes long.

        It changes nothing but the time of the first plans.
        """
        for margin_m in sorted({step.margin_m for step in rungs(self.config)}):
            self.voyage.area.obstacles_wkt(margin_m)
        self.voyage.area.clearance_m([(0.0, 0.0)])

    def persisted(self, state: SkipperState) -> Persisted:
        """Return what must be on disk before the actions of this step are carried out."""
        pending = state.pending_upload.route if state.pending_upload is not None else state.unsure_route
        if not state.checked_mission and state.adoptable is not None:
            return state.adoptable
        return Persisted(
            voyage=self.voyage.name, gate=state.gate, sailing=state.sailing, route=state.route, pending=pending,
            own_mode=state.own_mode,
        )


# ------------------------------------------------------------------------------------------ who acts
def _decide(turn: Turn, fresh: tuple[str, ...]) -> None:
    state = turn.state
    if state.rebooted:
        _rebooted(turn)
    if turn.autopilot is None:
        age = turn.snapshot.heartbeat_age_s
        heard = "never heard" if age is None else f"silent for {age:.0f} s"
        phase = Phase.WAITING if not state.sailing else turn.state.phase
        turn.phase(phase, f"the autopilot is {heard}; what it has sails on")
        return
    if _operator_has_it(turn):
        return
    notice_truncation(turn)
    if not _mission_is_known(turn):
        return
    if turn.state.phase is Phase.DONE:
        if not repair(turn):
            hand_back(turn)
        return
    if turn.state.wish is OperatorWish.HOLD and not turn.state.sailing:
        turn.phase(Phase.WAITING, "the operator asked to hold")
    elif turn.state.route is None:
        _start(turn)
    elif not turn.state.sailing:
        _launch(turn)
    else:
        sail(turn, fresh)


def _rebooted(turn: Turn) -> None:
    """Begin again after the autopilot's reboot: the mission is compared, mode and arming are gone."""
    since = turn.state.operator_since_s
    keeps = turn.state.phase is Phase.OPERATOR and since is not None and turn.t_s - since > REBOOT_RACE_S
    turn.update(
        checked_mission=False, read_since_s=turn.t_s, own_mode=None, steering_until_s=None, pending_command=None,
        by_field=ByField(),
    )
    if not keeps:
        turn.update(sailing=False, operator_since_s=None)
        turn.phase(Phase.WAITING, "the autopilot rebooted")


def _operator_has_it(turn: Turn) -> bool:
    """Notice that somebody else has the boat, and that it is given back. Nothing is asked of it meanwhile."""
    status, state = turn.autopilot, turn.state
    if status is None or not state.sailing or state.foreign:
        return False  # a stranger's mission is not an operator's mode: ``_mission_is_known`` stands by it
    gone = turn.is_taken
    if state.phase is not Phase.OPERATOR:
        if not gone:
            held = state.steering_until_s is not None or state.by_field.resort.engaged or turn.steers
            if status.mode is Mode.AUTO and state.own_mode is not None and not held:
                turn.update(own_mode=None)
            return False
        if state.pending_plan is not None:
            turn.act(CancelPlan(request_id=state.pending_plan.request_id))
        turn.update(
            operator_since_s=turn.t_s, pending_plan=None, own_mode=None, steering_until_s=None, pending_command=None,
            by_field=ByField(),
        )
        if has_stopped(turn):
            turn.update(own_mode=Mode.HOLD, operator_since_s=None, after_operator=True, plan_retry=PATIENT)
            turn.say(Severity.WARNING, "position failsafe",
                     "stopped by the autopilot's position failsafe: sailing on when the position is back", every_s=0.0)
            return False
        what = "disarmed" if not status.is_armed else f"mode {status.mode.name if status.mode is not None else '?'}"
        turn.phase(Phase.OPERATOR, f"{what}, not by us: the companion does nothing until AUTO comes back")
        turn.say(Severity.NOTICE, "operator", turn.state.why, every_s=0.0)
        return True
    if gone or status.mode is not Mode.AUTO:
        mode = status.mode.name if status.mode is not None else "unknown"
        turn.phase(Phase.OPERATOR, f"mode {mode}{'' if status.is_armed else ', disarmed'}: waiting for AUTO")
        return True
    since = state.operator_since_s if state.operator_since_s is not None else turn.t_s
    turn.update(
        operator_since_s=None, checked_mission=False, read_since_s=turn.t_s, after_operator=True, plan_retry=PATIENT,
    )
    turn.phase(Phase.WAITING, "AUTO is back: comparing the mission on board")
    turn.say(Severity.NOTICE, "operator back", f"AUTO is back after {turn.t_s - since:.0f} s", every_s=0.0)
    return False


# ------------------------------------------------------------------------------- the mission on board
def _mission_is_known(turn: Turn) -> bool:
    """Make sure that the mission on the autopilot is ours, empty, or known not to be."""
    state = turn.state
    if state.wish is OperatorWish.REPLACE_FOREIGN:
        turn.update(wish=None, foreign="", replace_foreign=True)
        state = turn.state
    if state.foreign:
        if turn.snapshot.permissions.may_replace_foreign:
            turn.update(foreign="", route=None, replace_foreign=True)
            return True
        phase = Phase.OPERATOR if state.sailing else Phase.WAITING
        turn.phase(phase, f"{state.foreign}; it is not resumed and not replaced without permission")
        return False
    if state.pending_upload is not None:
        return True
    if state.checked_mission:
        if state.sailing and turn.t_s - state.read_t_s > turn.config.reread_s and state.pending_read is None:
            _read(turn, "a look now and then whether it is still ours")
        elif state.read_t_s > state.read_since_s and state.read_items is not None and state.route is not None and (
            state.read_t_s == turn.t_s and not is_same_mission(state.read_items, state.route.items)
        ):
            turn.update(checked_mission=False, read_since_s=state.read_t_s)
        else:
            return True
    state = turn.state
    if state.checked_mission:
        return True
    onboard = turn.snapshot.mission
    items, read_t_s = state.read_items, state.read_t_s
    if onboard.items is not None and onboard.read_t_s is not None and onboard.read_t_s > read_t_s:
        items, read_t_s = onboard.items, onboard.read_t_s
    if items is None or read_t_s < state.read_since_s:
        if state.pending_read is None and turn.t_s >= state.read_retry.not_before_s:
            _read(turn, "whose mission is on board?")
        if not state.sailing:
            turn.phase(Phase.WAITING, "reading the mission on the autopilot")
        else:
            # Under way nothing is changed on a mission that may not be ours; what is there sails on.
            turn.phase(state.phase, "reading the mission on board before anything is changed on it")
        return False
    return _compare(turn, items)


def _read(turn: Turn, text: str) -> None:
    number = turn.new_id()
    turn.update(pending_read=(number, turn.t_s))
    turn.act(ReadMission(read_id=number, text=text))


def _compare(turn: Turn, items: tuple[MissionItem, ...]) -> bool:
    """Judge the mission that was read: ours, empty, a mixture of ours, or foreign."""
    state = turn.state
    saved = state.adoptable
    turn.update(checked_mission=True, read_t_s=turn.t_s, adoptable=None)
    routes = [r for r in (
        state.route, state.unsure_route, saved.route if saved else None, saved.pending if saved else None,
    ) if r is not None]
    for route in routes:
        if is_same_mission(items, route.items):
            turn.update(route=route, unsure_route=None)
            if saved is not None and state.route is None:
                _adopt(turn, saved)
            return True
    cut = next((c for c in (held_back(items, r) for r in routes) if c is not None), None)
    if cut is not None:
        turn.update(route=cut, unsure_route=None)
        turn.say(Severity.WARNING, "held back", f"{cut.why}: planning on", every_s=0.0)
        if saved is not None and state.route is None:
            _adopt(turn, saved)
        return True
    if not items:
        turn.update(route=None, unsure_route=None)
        if saved is not None:
            turn.update(gate=saved.gate)
        return True
    if any(is_mixture(items, a.items, b.items) for a in routes for b in routes):
        newest = state.unsure_route or (saved.pending if saved else None) or routes[0]
        turn.say(Severity.WARNING, "mixture", "an upload was cut short: the mission is put right", every_s=0.0)
        if saved is not None:
            turn.update(gate=saved.gate, sailing=state.sailing or _under_way(turn))
        turn.update(route=state.route or newest, unsure_route=newest, repair=True)
        return True
    if state.replace_foreign or turn.snapshot.permissions.may_replace_foreign:
        turn.update(route=None, unsure_route=None, replace_foreign=True)
        return True
    text = f"the mission on the autopilot ({len(items)} items) is not ours"
    turn.update(foreign=text, route=None, unsure_route=None)
    turn.say(Severity.ERROR, "foreign mission", turn.state.foreign, every_s=0.0)
    turn.phase(Phase.OPERATOR if state.sailing else Phase.WAITING, f"{turn.state.foreign}; it is not resumed")
    return False


def _under_way(turn: Turn) -> bool:
    status = turn.autopilot
    return status is not None and status.is_armed and status.mode is Mode.AUTO


def _adopt(turn: Turn, saved: Persisted) -> None:
    """Take over the mission that sails, without an upload."""
    status = turn.autopilot
    index = (status.mission_seq or 1) - 1 if status is not None else 0
    turn.update(
        gate=saved.gate, index=index, own_index=index, after_restart=True, own_mode=saved.own_mode,
        # Armed but not in AUTO: somebody else has taken the boat while we were away.
        sailing=_under_way(turn) or (saved.sailing and status is not None and status.is_armed),
    )
    turn.say(Severity.NOTICE, "adopted", f"the mission on board is ours: taken over at item {index + 1}", every_s=0.0)


# --------------------------------------------------------------------------------------- start, launch
def _start(turn: Turn) -> None:
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
    if request(turn, ReplanReason.START):
        turn.phase(Phase.NEW_CALCULATION, "making the first plan")
    else:
        turn.phase(Phase.WAITING, "no problem can be stated yet")


def _launch(turn: Turn) -> None:
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
        request(turn, ReplanReason.START, text="the boat drifted or the wind turned before setting sail")
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
