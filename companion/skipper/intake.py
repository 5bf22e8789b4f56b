"""Taking in a snapshot: outcomes, events, what stays unanswered, and where the boat is on its route."""

from __future__ import annotations

import math
from dataclasses import replace

from companion.frozen import changed
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
    patience_s = state.plans.latency.patience_s(config.plan_timeout_s)
    if state.pending.plan is not None and turn.t_s - state.pending.plan.t_s > patience_s:
        number = state.pending.plan.request_id
        turn.act(CancelPlan(request_id=number))
        take_plan(turn, PlanOutcome(request_id=number, text=f"no answer within {patience_s:.0f} s"))
    if state.pending.upload is not None and turn.t_s - state.pending.upload.t_s > config.upload_timeout_s:
        take_upload(turn, UploadOutcome(
            upload_id=state.pending.upload.upload_id, result=UploadResult.TIMEOUT,
            text=f"no outcome within {config.upload_timeout_s:.0f} s"))
    if state.pending.read is not None and turn.t_s - state.pending.read[1] > config.read_timeout_s:
        turn.set(pending=changed(turn.state.pending, read=None, read_retry=turn.failed(state.pending.read_retry)))
    if state.pending.command is not None and turn.t_s - state.pending.command[1] > config.command_timeout_s:
        _command_failed(turn, state.pending.command[2])


def _take_read(turn: Turn, outcome: ReadOutcome) -> None:
    if turn.state.pending.read is None or turn.state.pending.read[0] != outcome.read_id:
        return
    if outcome.items is None:
        turn.set(pending=changed(turn.state.pending, read=None, read_retry=turn.failed(turn.state.pending.read_retry)))
        turn.say(Severity.WARNING, "read failed", f"the mission could not be read: {outcome.text}")
        return
    turn.set(
        pending=changed(turn.state.pending, read=None, read_retry=PATIENT),
        mission=changed(turn.state.mission, read_items=outcome.items, read_t_s=turn.t_s))


def _take_command(turn: Turn, outcome: CommandOutcome) -> None:
    pending = turn.state.pending.command
    if pending is None or pending[0] != outcome.command_id:
        return
    if outcome.result is CommandResult.ACCEPTED:
        turn.set(
            pending=changed(turn.state.pending, command=None, command_retry=PATIENT, accepted=(pending[2], turn.t_s)))
        if pending[2] in {MOTOR_ON, MOTOR_OFF}:
            turn.set(adrift=replace(turn.state.adrift, motor=pending[2] == MOTOR_ON))
        return
    _command_failed(turn, pending[2])
    turn.say(Severity.WARNING, f"refused {pending[2]}",
             f"{pending[2]} {outcome.result.value}: {outcome.text or 'no reason given'}", every_s=0.0)


def _command_failed(turn: Turn, what: str) -> None:
    """Note an order that was refused or not answered; a mode that was not taken leaves her steered as she was."""
    state, status = turn.state, turn.autopilot
    turn.set(pending=changed(turn.state.pending, command=None, command_retry=turn.failed(state.pending.command_retry)))
    is_steered = turn.steers and status is not None and status.mode is Mode.GUIDED
    if is_steered and state.steering.own_mode is not None and state.steering.own_mode.name == what:
        turn.set(steering=changed(turn.state.steering, own_mode=Mode.GUIDED))


def take_events(turn: Turn) -> None:
    """Take events: reboots, somebody else's uploads, what is not believed."""
    status = turn.snapshot.autopilot
    rebooted = any(isinstance(e, AutopilotRebooted) for e in turn.snapshot.events)
    if status is not None and status.boot_s is not None:
        if turn.state.vehicle.boot_s is not None and status.boot_s < turn.state.vehicle.boot_s - BOOT_SLACK_S:
            rebooted = True
        turn.set(vehicle=changed(turn.state.vehicle, boot_s=status.boot_s))
    turn.set(vehicle=changed(turn.state.vehicle, rebooted=rebooted))
    for event in turn.snapshot.events:
        if isinstance(event, StatusText):
            ours = turn.state.pending.upload is not None or turn.t_s - turn.state.mission.asked_s < turn.config.settle_s
            if event.text.startswith(FOREIGN_TEXTS) and not ours and event.source_component == 1:
                # A read that is under way, or came in this very step, may tell of the mission before.
                turn.set(
                    mission=changed(turn.state.mission, checked=False, read_since_s=turn.t_s),
                    pending=changed(turn.state.pending, read=None))
            note(turn, event)
        elif isinstance(event, Disbelieved):
            turn.say(Severity.WARNING, event.what, event.text, every_s=0.0)
        elif isinstance(event, ParameterChanged):
            turn.say(Severity.WARNING, "parameter", event.text, every_s=0.0)


def count_time(turn: Turn) -> None:
    """Count how long the voyage has been under way."""
    state, status = turn.state, turn.autopilot
    sails = state.voyage.sailing and not state.voyage.over and status is not None and status.is_armed
    passed_s = turn.t_s - state.voyage.last_step_s if sails and math.isfinite(state.voyage.last_step_s) else 0.0
    turn.set(voyage=changed(
        turn.state.voyage, under_way_s=state.voyage.under_way_s + max(0.0, passed_s), last_step_s=turn.t_s))
    now_s = utc_s(turn)
    if sails and state.voyage.set_sail_utc_s is None and now_s is not None:
        turn.set(voyage=changed(turn.state.voyage, set_sail_utc_s=round(now_s - turn.state.voyage.under_way_s, 1)))


def locate(turn: Turn) -> None:
    """Say where the boat is on its route: the autopilot's count, our own count, gates passed, way made good."""
    state, status = turn.state, turn.autopilot
    route = state.mission.route
    if turn.gate is not None and turn.boat_en is not None:
        turn.set(progress=changed(
            turn.state.progress, bearing_rad=bearing_on(turn.gate, turn.boat_en, state.progress.bearing_rad)))
    guided = turn.steers and state.voyage.sailing and status is not None and status.mode is Mode.GUIDED
    if route is not None and status is not None and status.mission_seq is not None and _counts(turn) and not guided:
        index = min(max(status.mission_seq - 1, 0), len(route.items) - 1)
        # Right after we made an item current the stream may still carry the old number.
        settled = turn.t_s - state.mission.asked_s > turn.config.settle_s
        if settled or state.mission.index <= index <= state.mission.index + 1:
            turn.set(mission=changed(turn.state.mission, index=index))
    boat = turn.boat_en
    if route is not None and boat is not None and state.voyage.sailing:
        _own_count(turn)
        if guided:
            turn.set(mission=changed(
                turn.state.mission, index=min(turn.state.mission.own_index, len(route.items) - 1),
                passed_since_s=None))
        pass_gates(turn)
        if guided and turn.guidance is Guidance.FIELD and turn.state.mission.route is not None:
            # Steered to the gates themselves: the waypoints before a gate that is passed need not be.
            done = [n + 1 for n, g in enumerate(route.gate_of) if 0 <= g < turn.state.progress.gate]
            bound = errand(turn)
            if bound is not None and bound.name == route.bound_for and distance_m(boat, bound.en_m) <= bound.radius_m:
                done = [len(route.items) - 1]
            if done and done[-1] > turn.state.mission.index:
                turn.set(mission=changed(turn.state.mission, index=done[-1], own_index=done[-1]))
        _remember(turn)


def remember_fix(turn: Turn) -> None:
    """Keep the position for the next step's look at jumps."""
    here, age = turn.snapshot.position_en_m, turn.snapshot.vehicle_age_s
    if here is not None and age is not None and age <= FRESH_S:
        turn.set(position=changed(turn.state.position, last_seen=Fix(t_s=turn.t_s - age, en_m=here)))


def notice_truncation(turn: Turn) -> None:
    """Look at the mission again when the autopilot counts fewer items than we put there."""
    status, state = turn.autopilot, turn.state
    if (
        status is not None and status.mission_total is not None and state.mission.route is not None
        and state.mission.checked and state.pending.upload is None
        and status.mission_total < len(state.mission.route.items)
        and turn.t_s - state.mission.read_since_s > turn.config.settle_s
        and turn.t_s - state.mission.uploaded_s > turn.config.settle_s
    ):
        turn.set(mission=changed(turn.state.mission, checked=False, read_since_s=turn.t_s))


def _counts(turn: Turn) -> bool:
    """Return whether the autopilot's number is about our route."""
    return turn.state.mission.checked and not turn.state.mission.foreign and turn.state.phase is not Phase.OPERATOR


def _own_count(turn: Turn) -> None:
    """Advance our own target by Büsser's double conditions; note when the autopilot lags behind it."""
    boat, route = turn.boat_en, turn.state.mission.route
    if boat is None or route is None:
        return
    own = max(turn.state.mission.own_index, turn.state.mission.index)
    while own < len(route.items) - 1 and waypoint_done(
        boat, route.leg_from_en_m[own], route.points_en_m[own], route.points_en_m[own + 1],
        grid_m=turn.config.grid_size_m, manoeuvre_m=turn.config.manoeuvre_m,
    ):
        own += 1
        if own > turn.state.mission.index + 1:
            break
    lags = own > turn.state.mission.index
    since = turn.state.mission.passed_since_s if turn.state.mission.passed_since_s is not None else turn.t_s
    turn.set(mission=changed(turn.state.mission, own_index=own, passed_since_s=since if lags else None))


def _remember(turn: Turn) -> None:
    """Keep the way made good, for the progress watchdog."""
    boat, ahead = turn.boat_en, turn.ahead()
    if boat is None:
        return
    # at rest no way is made, nor on a circle
    history = turn.state.progress.history if ahead and not is_composed(turn) else ()
    if history and turn.t_s - history[-1][0] < HISTORY_STEP_S:
        return
    left = 0.0
    point = boat
    for following in ahead:
        left += distance_m(point, following)
        point = following
    plan_id = turn.state.mission.route.plan_id if turn.state.mission.route is not None else -1
    if history and turn.state.progress.history_plan != plan_id:
        # A new plan may be longer or shorter: what it changed is no way made good, nor lost.
        longer = left - history[-1][3]
        history = tuple((t_s, east, north, togo + longer) for t_s, east, north, togo in history)
    turn.set(progress=changed(
        turn.state.progress, history=(*history, (turn.t_s, boat[0], boat[1], left))[-HISTORY_KEPT:],
        history_plan=plan_id))
