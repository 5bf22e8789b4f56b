"""Taking in a snapshot: outcomes, events, what stays unanswered, and where the boat is on its route."""

from __future__ import annotations

import math
from dataclasses import replace

from companion.messages import Mode, StatusText
from companion.skipper.deeds.failsafe import note
from companion.skipper.deeds.helm import MOTOR_OFF, MOTOR_ON
from companion.skipper.passing import pass_gates
from companion.skipper.planning.answers import take_plan
from companion.skipper.planning.errands import errand, is_composed
from companion.skipper.planning.uploads import take_upload
from companion.skipper.planning.waits import utc_s
from companion.skipper.step.actions import CancelPlan, Severity
from companion.skipper.step.config import Guidance
from companion.skipper.step.snapshot import (
    AutopilotRebooted,
    CommandOutcome,
    CommandResult,
    Disbelieved,
    ParameterChanged,
    PlanOutcome,
    ReadOutcome,
    UploadOutcome,
    UploadResult,
)
from companion.skipper.step.state import PATIENT, Fix, Phase
from companion.skipper.step.turn import FRESH_S, Turn
from companion.skipper.way.gates import bearing_on
from companion.skipper.way.geometry import distance_m, waypoint_done

HISTORY_STEP_S = 10.0
HISTORY_KEPT = 19            # 180 s and the present
BOOT_SLACK_S = 1.0
FOREIGN_TEXTS = ("Flight plan received",)   # somebody finished an upload


def take_outcomes(turn: Turn) -> None:
    """Take every outcome once, and count what stays unanswered too long as failed."""
    for outcome in turn.snapshot.outcomes:
        if isinstance(outcome, PlanOutcome):
            take_plan(turn, outcome)
        elif isinstance(outcome, UploadOutcome):
            take_upload(turn, outcome)
        elif isinstance(outcome, ReadOutcome):
            _take_read(turn, outcome)
        elif isinstance(outcome, CommandOutcome):
            _take_command(turn, outcome)
    state, config = turn.state, turn.config
    if state.pending_plan is not None and turn.t_s - state.pending_plan.t_s > config.plan_timeout_s:
        number = state.pending_plan.request_id
        turn.act(CancelPlan(request_id=number))
        take_plan(turn, PlanOutcome(request_id=number, text=f"no answer within {config.plan_timeout_s:.0f} s"))
    if state.pending_upload is not None and turn.t_s - state.pending_upload.t_s > config.upload_timeout_s:
        take_upload(turn, UploadOutcome(
            upload_id=state.pending_upload.upload_id, result=UploadResult.TIMEOUT,
            text=f"no outcome within {config.upload_timeout_s:.0f} s"))
    if state.pending_read is not None and turn.t_s - state.pending_read[1] > config.read_timeout_s:
        turn.update(pending_read=None, read_retry=turn.failed(state.read_retry))
    if state.pending_command is not None and turn.t_s - state.pending_command[1] > config.command_timeout_s:
        _command_failed(turn, state.pending_command[2])


def _take_read(turn: Turn, outcome: ReadOutcome) -> None:
    if turn.state.pending_read is None or turn.state.pending_read[0] != outcome.read_id:
        return
    if outcome.items is None:
        turn.update(pending_read=None, read_retry=turn.failed(turn.state.read_retry))
        turn.say(Severity.WARNING, "read failed", f"the mission could not be read: {outcome.text}")
        return
    turn.update(pending_read=None, read_retry=PATIENT, read_items=outcome.items, read_t_s=turn.t_s)


def _take_command(turn: Turn, outcome: CommandOutcome) -> None:
    pending = turn.state.pending_command
    if pending is None or pending[0] != outcome.command_id:
        return
    if outcome.result is CommandResult.ACCEPTED:
        turn.update(pending_command=None, command_retry=PATIENT, accepted=(pending[2], turn.t_s))
        if pending[2] in {MOTOR_ON, MOTOR_OFF}:
            turn.update(adrift=replace(turn.state.adrift, motor=pending[2] == MOTOR_ON))
        return
    _command_failed(turn, pending[2])
    turn.say(Severity.WARNING, f"refused {pending[2]}",
             f"{pending[2]} {outcome.result.value}: {outcome.text or 'no reason given'}", every_s=0.0)


def _command_failed(turn: Turn, what: str) -> None:
    """Note an order that was refused or not answered; a mode that was not taken leaves her steered as she was."""
    state, status = turn.state, turn.autopilot
    turn.update(pending_command=None, command_retry=turn.failed(state.command_retry))
    is_steered = turn.steers and status is not None and status.mode is Mode.GUIDED
    if is_steered and state.own_mode is not None and state.own_mode.name == what:
        turn.update(own_mode=Mode.GUIDED)


def take_events(turn: Turn) -> None:
    """Take events: reboots, somebody else's uploads, what is not believed."""
    status = turn.snapshot.autopilot
    rebooted = any(isinstance(e, AutopilotRebooted) for e in turn.snapshot.events)
    if status is not None and status.boot_s is not None:
        if turn.state.boot_s is not None and status.boot_s < turn.state.boot_s - BOOT_SLACK_S:
            rebooted = True
        turn.update(boot_s=status.boot_s)
    turn.update(rebooted=rebooted)
    for event in turn.snapshot.events:
        if isinstance(event, StatusText):
            ours = turn.state.pending_upload is not None or turn.t_s - turn.state.current_asked_s < turn.config.settle_s
            if event.text.startswith(FOREIGN_TEXTS) and not ours and event.source_component == 1:
                # A read that is under way, or came in this very step, may tell of the mission before.
                turn.update(checked_mission=False, read_since_s=turn.t_s, pending_read=None)
            note(turn, event)
        elif isinstance(event, Disbelieved):
            turn.say(Severity.WARNING, event.what, event.text, every_s=0.0)
        elif isinstance(event, ParameterChanged):
            turn.say(Severity.WARNING, "parameter", event.text, every_s=0.0)


def count_time(turn: Turn) -> None:
    """Count how long the voyage has been under way."""
    state, status = turn.state, turn.autopilot
    sails = state.sailing and not state.over and status is not None and status.is_armed
    passed_s = turn.t_s - state.last_step_s if sails and math.isfinite(state.last_step_s) else 0.0
    turn.update(under_way_s=state.under_way_s + max(0.0, passed_s), last_step_s=turn.t_s)
    now_s = utc_s(turn)
    if sails and state.set_sail_utc_s is None and now_s is not None:
        turn.update(set_sail_utc_s=round(now_s - turn.state.under_way_s, 1))


def locate(turn: Turn) -> None:
    """Say where the boat is on its route: the autopilot's count, our own count, gates passed, way made good."""
    state, status = turn.state, turn.autopilot
    route = state.route
    if turn.gate is not None and turn.boat_en is not None:
        turn.update(bearing_rad=bearing_on(turn.gate, turn.boat_en, state.bearing_rad))
    guided = turn.steers and state.sailing and status is not None and status.mode is Mode.GUIDED
    if route is not None and status is not None and status.mission_seq is not None and _counts(turn) and not guided:
        index = min(max(status.mission_seq - 1, 0), len(route.items) - 1)
        # Right after we made an item current the stream may still carry the old number.
        settled = turn.t_s - state.current_asked_s > turn.config.settle_s
        if settled or state.index <= index <= state.index + 1:
            turn.update(index=index)
    boat = turn.boat_en
    if route is not None and boat is not None and state.sailing:
        _own_count(turn)
        if guided:
            turn.update(index=min(turn.state.own_index, len(route.items) - 1), passed_since_s=None)
        pass_gates(turn)
        if guided and turn.guidance is Guidance.FIELD and turn.state.route is not None:
            # Steered to the gates themselves: the waypoints before a gate that is passed need not be.
            done = [n + 1 for n, g in enumerate(route.gate_of) if 0 <= g < turn.state.gate]
            bound = errand(turn)
            if bound is not None and bound.name == route.bound_for and distance_m(boat, bound.en_m) <= bound.radius_m:
                done = [len(route.items) - 1]
            if done and done[-1] > turn.state.index:
                turn.update(index=done[-1], own_index=done[-1])
        _remember(turn)


def remember_fix(turn: Turn) -> None:
    """Keep the position for the next step's look at jumps."""
    here, age = turn.snapshot.position_en_m, turn.snapshot.vehicle_age_s
    if here is not None and age is not None and age <= FRESH_S:
        turn.update(last_seen=Fix(t_s=turn.t_s - age, en_m=here))


def notice_truncation(turn: Turn) -> None:
    """Look at the mission again when the autopilot counts fewer items than we put there."""
    status, state = turn.autopilot, turn.state
    if (
        status is not None and status.mission_total is not None and state.route is not None and state.checked_mission
        and state.pending_upload is None and status.mission_total < len(state.route.items)
        and turn.t_s - state.read_since_s > turn.config.settle_s
        and turn.t_s - state.uploaded_s > turn.config.settle_s
    ):
        turn.update(checked_mission=False, read_since_s=turn.t_s)


def _counts(turn: Turn) -> bool:
    """Return whether the autopilot's number is about our route."""
    return turn.state.checked_mission and not turn.state.foreign and turn.state.phase is not Phase.OPERATOR


def _own_count(turn: Turn) -> None:
    """Advance our own target by Büsser's double conditions; note when the autopilot lags behind it."""
    boat, route = turn.boat_en, turn.state.route
    if boat is None or route is None:
        return
    own = max(turn.state.own_index, turn.state.index)
    while own < len(route.items) - 1 and waypoint_done(
        boat, route.leg_from_en_m[own], route.points_en_m[own], route.points_en_m[own + 1],
        grid_m=turn.config.grid_size_m, manoeuvre_m=turn.config.manoeuvre_m,
    ):
        own += 1
        if own > turn.state.index + 1:
            break
    lags = own > turn.state.index
    since = turn.state.passed_since_s if turn.state.passed_since_s is not None else turn.t_s
    turn.update(own_index=own, passed_since_s=since if lags else None)


def _remember(turn: Turn) -> None:
    """Keep the way made good, for the progress watchdog."""
    boat, ahead = turn.boat_en, turn.ahead()
    if boat is None:
        return
    history = turn.state.history if ahead and not is_composed(turn) else ()   # at rest no way is made, nor on a circle
    if history and turn.t_s - history[-1][0] < HISTORY_STEP_S:
        return
    left = 0.0
    point = boat
    for following in ahead:
        left += distance_m(point, following)
        point = following
    plan_id = turn.state.route.plan_id if turn.state.route is not None else -1
    if history and turn.state.history_plan != plan_id:
        # A new plan may be longer or shorter: what it changed is no way made good, nor lost.
        longer = left - history[-1][3]
        history = tuple((t_s, east, north, togo + longer) for t_s, east, north, togo in history)
    turn.update(history=(*history, (turn.t_s, boat[0], boat[1], left))[-HISTORY_KEPT:], history_plan=plan_id)
