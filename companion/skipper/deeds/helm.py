"""Commands to the autopilot with their patience: modes, arming, the current item, an interrupted mission put right."""

from __future__ import annotations

from companion.messages import MissionState, Mode
from companion.skipper.board.uploads import upload
from companion.skipper.step.actions import Arm, RunMotor, SetCurrent, SetMode, Severity, Tack
from companion.skipper.step.turn import SHOWS_S, Turn

ARMING, CURRENT = "arming", "set current"
TACK = "tack"
MOTOR_ON, MOTOR_OFF = "motor on", "motor off"
CHECK_S = 3.0   # MISSION_CURRENT comes once a second: by then it shows what was asked for


def is_busy(turn: Turn, what: str) -> bool:
    """Return whether a command is unanswered, the last refusal too fresh, or this one just accepted."""
    state = turn.state
    if state.pending_command is not None or turn.t_s < state.command_retry.not_before_s:
        return True
    return state.accepted is not None and state.accepted[0] == what and turn.t_s < state.accepted[1] + SHOWS_S


def set_mode(turn: Turn, mode: Mode, text: str) -> bool:
    """Ask for a mode; False when not permitted or not now."""
    if is_busy(turn, mode.name) or not turn.snapshot.permissions.may_set_mode:
        return False
    number = turn.new_id()
    if not turn.act(SetMode(command_id=number, mode=mode, text=text)):
        return False
    turn.update(pending_command=(number, turn.t_s, mode.name), own_mode=None if mode is Mode.AUTO else mode)
    return True


def arm(turn: Turn) -> bool:
    """Ask for arming; False when not permitted or not now."""
    if is_busy(turn, ARMING):
        return False
    number = turn.new_id()
    if not turn.act(Arm(command_id=number)):
        return False
    turn.update(pending_command=(number, turn.t_s, ARMING))
    return True


def tack(turn: Turn, text: str) -> bool:
    """Ask for a tack; False when not permitted or not now."""
    if is_busy(turn, TACK):
        return False
    number = turn.new_id()
    if not turn.act(Tack(command_id=number, text=text)):
        return False
    turn.update(pending_command=(number, turn.t_s, TACK), tacked_s=turn.t_s)
    turn.say(Severity.NOTICE, "short tack", text)
    return True


def run_motor(turn: Turn, *, on: bool, text: str) -> bool:
    """Ask for the motor to be run or not; False when not permitted or not now."""
    what = MOTOR_ON if on else MOTOR_OFF
    if is_busy(turn, what):
        return False
    number = turn.new_id()
    if not turn.act(RunMotor(command_id=number, is_on=on, text=text)):
        return False
    turn.update(pending_command=(number, turn.t_s, what))
    return True


def make_current(turn: Turn, seq: int) -> bool:
    """Make an item current and the mission run (p2 = 1); False when not permitted or not now."""
    if is_busy(turn, CURRENT):
        return False
    number = turn.new_id()
    if not turn.act(SetCurrent(command_id=number, seq=seq, reset=True)):
        return False
    turn.update(
        pending_command=(number, turn.t_s, CURRENT), current_asked_s=turn.t_s, asked_seq=seq, index=seq - 1)
    return True


def check_current(turn: Turn) -> None:
    """See that the item made current is sailed for; ask again when it is not."""
    status, asked = turn.autopilot, turn.state.asked_seq
    if asked is None or status is None or turn.t_s - turn.state.current_asked_s < CHECK_S:
        return
    stopped = status.mission_state in {MissionState.NOT_STARTED, MissionState.COMPLETE}
    if status.mission_seq is not None and status.mission_seq >= asked and not stopped:
        turn.update(asked_seq=None)
        return
    make_current(turn, asked)


def repair(turn: Turn) -> bool:
    """Put right a mission that an interrupted upload left as a mixture; True while that is going on."""
    state = turn.state
    if not state.repair:
        return False
    route = state.unsure_route or state.route
    if route is None:
        turn.update(repair=False)
        return False
    turn.phase(state.phase, "waiting for the mission on board, a mixture of two of ours, to be uploaded whole")
    if state.pending_upload is None and turn.t_s >= state.upload_retry.not_before_s:
        index = min(state.index, len(route.items) - 1)
        turn.update(repair=False)
        upload(turn, route, index + 1, "an upload was cut short: the whole mission again", whole=True)
    return True


def hand_back(turn: Turn) -> None:
    """Give the helm back to AUTO at the item that the boat has come to."""
    status, route = turn.autopilot, turn.state.route
    if status is None or route is None or turn.state.own_mode is None or status.mode is not turn.state.own_mode:
        return
    own, seq = turn.state.own_mode, min(turn.state.index + 1, len(route.items))
    if status.mission_seq != seq:
        make_current(turn, seq)
    elif set_mode(turn, Mode.AUTO, "back to the mission"):
        turn.update(own_mode=own)
