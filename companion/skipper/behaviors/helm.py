"""Commands to the autopilot with their patience: modes, arming, the current item, an interrupted mission put right."""

from __future__ import annotations

from collections.abc import Callable

from companion.frozen import changed
from companion.messages import MissionState, Mode, Severity
from companion.skipper.planning.uploads import upload
from companion.skipper.step.actions import Action, Arm, RunMotor, SetCurrent, SetMode, SetParameter, Tack
from companion.skipper.step.context import SHOWS_S, StepContext
from companion.skipper.way.geometry import is_past

ARMING, CURRENT = "arming", "set current"
TACK = "tack"
MOTOR_ON, MOTOR_OFF = "motor on", "motor off"
CHECK_S = 3.0  # MISSION_CURRENT comes once a second: by then it shows what was asked for


def is_busy(ctx: StepContext, what: str) -> bool:
    """Return whether a command is unanswered, the last refusal too fresh, or this one just accepted."""
    state = ctx.state
    if state.pending.command is not None or ctx.t_s < state.pending.command_retry.not_before_s:
        return True
    name, accepted_s = state.pending.accepted or ("", 0.0)
    return name == what and ctx.t_s < accepted_s + SHOWS_S


def _ask(ctx: StepContext, what: str, order: Callable[[int], Action]) -> bool:
    """Give an order; False when not permitted or not now."""
    if is_busy(ctx, what):
        return False
    number = ctx.new_id()
    if not ctx.act(order(number)):
        return False
    ctx.set(pending=changed(ctx.state.pending, command=(number, ctx.t_s, what)))
    return True


def set_mode(ctx: StepContext, mode: Mode, text: str) -> bool:
    """Ask for a mode; False when not permitted or not now."""
    if not ctx.snapshot.permissions.may_set_mode or not _ask(
        ctx, mode.name, lambda number: SetMode(command_id=number, mode=mode, text=text)
    ):
        return False
    ctx.set(steering=changed(ctx.state.steering, own_mode=None if mode is Mode.AUTO else mode))
    return True


def arm(ctx: StepContext) -> bool:
    """Ask for arming; False when not permitted or not now."""
    return _ask(ctx, ARMING, lambda number: Arm(command_id=number))


def tack(ctx: StepContext, code: str, text: str) -> bool:
    """Ask for a tack, announced by ``code``; False when not permitted or not now."""
    if not _ask(ctx, TACK, lambda number: Tack(command_id=number, text=text)):
        return False
    ctx.set(steering=changed(ctx.state.steering, tacked_s=ctx.t_s))
    ctx.say(Severity.NOTICE, code, text)
    return True


def run_motor(ctx: StepContext, *, on: bool, text: str) -> bool:
    """Ask for the motor to be run or not; False when not permitted or not now."""
    return _ask(ctx, MOTOR_ON if on else MOTOR_OFF, lambda number: RunMotor(command_id=number, is_on=on, text=text))


def write_parameter(ctx: StepContext, name: str, value: float, text: str) -> bool:
    """Ask for a parameter to be written; False when not permitted or not now."""
    return _ask(ctx, name, lambda number: SetParameter(command_id=number, name=name, value=value, text=text))


def make_current(ctx: StepContext, seq: int) -> bool:
    """Make an item current and the mission run (p2 = 1); False when not permitted or not now."""
    if not _ask(ctx, CURRENT, lambda number: SetCurrent(command_id=number, seq=seq, reset=True)):
        return False
    ctx.set(mission=changed(ctx.state.mission, asked_s=ctx.t_s, asked_seq=seq, index=seq - 1))
    return True


def check_current(ctx: StepContext) -> None:
    """See that the item made current is sailed for; ask again when it is not."""
    status, asked = ctx.autopilot, ctx.state.mission.asked_seq
    if asked is None or status is None or ctx.t_s - ctx.state.mission.asked_s < CHECK_S:
        return
    stopped = status.mission_state in {MissionState.NOT_STARTED, MissionState.COMPLETE}
    if status.mission_seq is not None and status.mission_seq >= asked and not stopped:
        ctx.set(mission=changed(ctx.state.mission, asked_seq=None))
        return
    make_current(ctx, asked)


def push_on(ctx: StepContext) -> None:
    """Make the item that the boat has come to current where the autopilot still sails for one before it."""
    status, own = ctx.autopilot, ctx.state.mission.own_index
    sails_for = None if status is None else status.mission_seq
    if own > ctx.state.mission.index and sails_for is not None and sails_for <= own:
        make_current(ctx, own + 1)


def leave_passed(ctx: StepContext) -> None:
    """Make the first item ahead current where the boat passed its own while the list was on its way.

    The list was made for a boat that had not come so far; sent back it would turn round in whatever water there is.
    """
    state, route, boat = ctx.state, ctx.state.mission.route, ctx.boat_en
    if (
        route is None
        or boat is None
        or state.pending.upload is not None
        or (ctx.t_s - state.mission.uploaded_s > CHECK_S)
    ):
        return
    area, floor_m, index = ctx.voyage.area, ctx.config.margin_floor_m, state.mission.index
    while (
        index < ctx.last_waypoint()
        and route.gate_of[index] < 0
        and is_past(boat, route.leg_from_en_m[index], route.points_en_m[index])
    ):
        back_m, on_m = (area.path_clearance_m([boat, route.points_en_m[n]]) for n in (index, index + 1))
        if on_m < min(floor_m, back_m):
            break
        index += 1
    if index > state.mission.index and make_current(ctx, index + 1):
        ctx.say(
            Severity.NOTICE,
            "passed",
            f"item {state.mission.index + 1} was passed while it was on its way: sailing for item {index + 1}",
            every_s=0.0,
        )


def repair(ctx: StepContext) -> bool:
    """Put right a mission that an interrupted upload left as a mixture; True while that is going on."""
    state = ctx.state
    if not state.mission.repair:
        return False
    route = state.mission.unsure_route or state.mission.route
    if route is None:
        ctx.set(mission=changed(ctx.state.mission, repair=False))
        return False
    ctx.phase(state.phase, "waiting for the mission on board, a mixture of two of ours, to be uploaded whole")
    if state.pending.upload is None and ctx.t_s >= state.pending.upload_retry.not_before_s:
        index = min(state.mission.index, len(route.items) - 1)
        ctx.set(mission=changed(ctx.state.mission, repair=False))
        upload(ctx, route, index + 1, "an upload was cut short: the whole mission again", whole=True)
    return True


def hand_back(ctx: StepContext) -> None:
    """Give the helm back to AUTO at the item that the boat has come to."""
    status, route = ctx.autopilot, ctx.state.mission.route
    own = ctx.state.steering.own_mode
    if status is None or route is None or own is None or status.mode is not own:
        return
    seq = min(ctx.state.mission.index + 1, len(route.items))
    if status.mission_seq != seq:
        make_current(ctx, seq)
    elif set_mode(ctx, Mode.AUTO, "back to the mission"):
        ctx.set(steering=changed(ctx.state.steering, own_mode=own))
