"""Commands to the autopilot with their patience: modes, arming, the current item, an interrupted mission put right."""

from __future__ import annotations

from collections.abc import Callable

from companion.frozen import changed
from companion.messages import MissionState, Mode
from companion.skipper.planning.uploads import upload
from companion.skipper.step.actions import Action, Arm, RunMotor, SetCurrent, SetMode, Severity, Tack
from companion.skipper.step.turn import SHOWS_S, Turn
from companion.skipper.way.geometry import is_past

ARMING, CURRENT = "arming", "set current"
TACK = "tack"
MOTOR_ON, MOTOR_OFF = "motor on", "motor off"
CHECK_S = 3.0   # MISSION_CURRENT comes once a second: by then it shows what was asked for


def is_busy(turn: Turn, what: str) -> bool:
    """Return whether a command is unanswered, the last refusal too fresh, or this one just accepted."""
    state = turn.state
    if state.pending.command is not None or turn.t_s < state.pending.command_retry.not_before_s:
        return True
    name, accepted_s = state.pending.accepted or ("", 0.0)
    return name == what and turn.t_s < accepted_s + SHOWS_S


def _ask(turn: Turn, what: str, order: Callable[[int], Action]) -> bool:
    """Give an order; False when not permitted or not now."""
    if is_busy(turn, what):
        return False
    number = turn.new_id()
    if not turn.act(order(number)):
        return False
    turn.set(pending=changed(turn.state.pending, command=(number, turn.t_s, what)))
    return True


def set_mode(turn: Turn, mode: Mode, text: str) -> bool:
    """Ask for a mode; False when not permitted or not now."""
    if not turn.snapshot.permissions.may_set_mode or not _ask(
            turn, mode.name, lambda number: SetMode(command_id=number, mode=mode, text=text)):
        return False
    turn.set(steering=changed(turn.state.steering, own_mode=None if mode is Mode.AUTO else mode))
    return True


def arm(turn: Turn) -> bool:
    """Ask for arming; False when not permitted or not now."""
    return _ask(turn, ARMING, lambda number: Arm(command_id=number))


def tack(turn: Turn, code: str, text: str) -> bool:
    """Ask for a tack, announced by ``code``; False when not permitted or not now."""
    if not _ask(turn, TACK, lambda number: Tack(command_id=number, text=text)):
        return False
    turn.set(steering=changed(turn.state.steering, tacked_s=turn.t_s))
    turn.say(Severity.NOTICE, code, text)
    return True


def run_motor(turn: Turn, *, on: bool, text: str) -> bool:
    """Ask for the motor to be run or not; False when not permitted or not now."""
    return _ask(
        turn, MOTOR_ON if on else MOTOR_OFF, lambda number: RunMotor(command_id=number, is_on=on, text=text))


def make_current(turn: Turn, seq: int) -> bool:
    """Make an item current and the mission run (p2 = 1); False when not permitted or not now."""
    if not _ask(turn, CURRENT, lambda number: SetCurrent(command_id=number, seq=seq, reset=True)):
        return False
    turn.set(mission=changed(turn.state.mission, asked_s=turn.t_s, asked_seq=seq, index=seq - 1))
    return True


def check_current(turn: Turn) -> None:
    """See that the item made current is sailed for; ask again when it is not."""
    status, asked = turn.autopilot, turn.state.mission.asked_seq
    if asked is None or status is None or turn.t_s - turn.state.mission.asked_s < CHECK_S:
        return
    stopped = status.mission_state in {MissionState.NOT_STARTED, MissionState.COMPLETE}
    if status.mission_seq is not None and status.mission_seq >= asked and not stopped:
        turn.set(mission=changed(turn.state.mission, asked_seq=None))
        return
    make_current(turn, asked)


def leave_passed(turn: Turn) -> None:
    """Make the first item ahead current where the boat passed its own while the list was on its way.

    The list was made for a boat that had not come so far; sent back it would turn round in whatever water there is.
    """
    state, route, boat = turn.state, turn.state.mission.route, turn.boat_en
    if route is None or boat is None or state.pending.upload is not None or (
            turn.t_s - state.mission.uploaded_s > CHECK_S):
        return
    area, floor_m, index = turn.voyage.area, turn.config.margin_floor_m, state.mission.index
    while index < turn.last_waypoint() and route.gate_of[index] < 0 and is_past(
            boat, route.leg_from_en_m[index], route.points_en_m[index]):
        back_m, on_m = (area.path_clearance_m([boat, route.points_en_m[n]]) for n in (index, index + 1))
        if on_m < min(floor_m, back_m):
            break
        index += 1
    if index > state.mission.index and make_current(turn, index + 1):
        turn.say(Severity.NOTICE, "passed", f"item {state.mission.index + 1} was passed while it was on its way: "
                 f"sailing for item {index + 1}", every_s=0.0)


def repair(turn: Turn) -> bool:
    """Put right a mission that an interrupted upload left as a mixture; True while that is going on."""
    state = turn.state
    if not state.mission.repair:
        return False
    route = state.mission.unsure_route or state.mission.route
    if route is None:
        turn.set(mission=changed(turn.state.mission, repair=False))
        return False
    turn.phase(state.phase, "waiting for the mission on board, a mixture of two of ours, to be uploaded whole")
    if state.pending.upload is None and turn.t_s >= state.pending.upload_retry.not_before_s:
        index = min(state.mission.index, len(route.items) - 1)
        turn.set(mission=changed(turn.state.mission, repair=False))
        upload(turn, route, index + 1, "an upload was cut short: the whole mission again", whole=True)
    return True


def hand_back(turn: Turn) -> None:
    """Give the helm back to AUTO at the item that the boat has come to."""
    status, route = turn.autopilot, turn.state.mission.route
    own = turn.state.steering.own_mode
    if status is None or route is None or own is None or status.mode is not own:
        return
    seq = min(turn.state.mission.index + 1, len(route.items))
    if status.mission_seq != seq:
        make_current(turn, seq)
    elif set_mode(turn, Mode.AUTO, "back to the mission"):
        turn.set(steering=changed(turn.state.steering, own_mode=own))
