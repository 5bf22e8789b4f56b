"""Taking in a snapshot: outcomes, events, what stays unanswered, and where the boat is on its route."""

from __future__ import annotations

import math
from dataclasses import replace

from companion.frozen import changed
from companion.messages import Mode, Severity, StatusText
from companion.skipper.behaviors.failsafe import note
from companion.skipper.behaviors.helm import MOTOR_OFF, MOTOR_ON
from companion.skipper.passing import pass_gates
from companion.skipper.planning.answers import take_plan
from companion.skipper.planning.diversions import diversion, is_composed
from companion.skipper.planning.fallback import to_go
from companion.skipper.planning.uploads import take_upload
from companion.skipper.step.actions import CancelPlan
from companion.skipper.step.config import Guidance
from companion.skipper.step.context import FRESH_S, StepContext
from companion.skipper.step.route import Route
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
from companion.skipper.way.gates import bearing_on
from companion.skipper.way.geometry import distance_m, waypoint_done
from companion.skipper.way.voyage import PointEn

HISTORY_STEP_S = 10.0
HISTORY_KEPT = 19  # 180 s and the present
BOOT_SLACK_S = 1.0
FOREIGN_TEXTS = ("Flight plan received",)  # somebody finished an upload


def take_outcomes(ctx: StepContext) -> None:
    """Take every outcome once, and count what stays unanswered too long as failed."""
    for outcome in ctx.snapshot.outcomes:
        if isinstance(outcome, PlanOutcome):
            take_plan(ctx, outcome)
        elif isinstance(outcome, UploadOutcome):
            take_upload(ctx, outcome)
        elif isinstance(outcome, ReadOutcome):
            _take_read(ctx, outcome)
        elif isinstance(outcome, CommandOutcome):
            _take_command(ctx, outcome)
    state, config = ctx.state, ctx.config
    patience_s = state.plans.latency.patience_s(config.plan_timeout_s)
    if state.pending.plan is not None and ctx.t_s - state.pending.plan.t_s > patience_s:
        number = state.pending.plan.request_id
        ctx.act(CancelPlan(request_id=number))
        take_plan(ctx, PlanOutcome(request_id=number, text=f"no answer within {patience_s:.0f} s"))
    if state.pending.upload is not None and ctx.t_s - state.pending.upload.t_s > config.upload_timeout_s:
        take_upload(
            ctx,
            UploadOutcome(
                upload_id=state.pending.upload.upload_id,
                result=UploadResult.TIMEOUT,
                text=f"no outcome within {config.upload_timeout_s:.0f} s",
            ),
        )
    if state.pending.read is not None and ctx.t_s - state.pending.read[1] > config.read_timeout_s:
        ctx.set(pending=changed(ctx.state.pending, read=None, read_retry=ctx.failed(state.pending.read_retry)))
    if state.pending.command is not None and ctx.t_s - state.pending.command[1] > config.command_timeout_s:
        _command_failed(ctx, state.pending.command[2])


def _take_read(ctx: StepContext, outcome: ReadOutcome) -> None:
    if ctx.state.pending.read is None or ctx.state.pending.read[0] != outcome.read_id:
        return
    if outcome.items is None:
        ctx.set(pending=changed(ctx.state.pending, read=None, read_retry=ctx.failed(ctx.state.pending.read_retry)))
        ctx.say(Severity.WARNING, "read failed", f"the mission could not be read: {outcome.text}")
        return
    ctx.set(
        pending=changed(ctx.state.pending, read=None, read_retry=PATIENT),
        mission=changed(ctx.state.mission, read_items=outcome.items, read_t_s=ctx.t_s),
    )


def _take_command(ctx: StepContext, outcome: CommandOutcome) -> None:
    pending = ctx.state.pending.command
    if pending is None or pending[0] != outcome.command_id:
        return
    if outcome.result is CommandResult.ACCEPTED:
        ctx.set(pending=changed(ctx.state.pending, command=None, command_retry=PATIENT, accepted=(pending[2], ctx.t_s)))
        if pending[2] in {MOTOR_ON, MOTOR_OFF}:
            ctx.set(adrift=replace(ctx.state.adrift, motor=pending[2] == MOTOR_ON))
        return
    _command_failed(ctx, pending[2])
    ctx.say(
        Severity.WARNING,
        f"refused {pending[2]}",
        f"{pending[2]} {outcome.result.value}: {outcome.text or 'no reason given'}",
        every_s=0.0,
    )


def _command_failed(ctx: StepContext, what: str) -> None:
    """Note an order that was refused or not answered; a mode that was not taken leaves the boat steered as it was."""
    state, status = ctx.state, ctx.autopilot
    ctx.set(pending=changed(ctx.state.pending, command=None, command_retry=ctx.failed(state.pending.command_retry)))
    is_steered = ctx.steers and status is not None and status.mode is Mode.GUIDED
    if is_steered and state.steering.own_mode is not None and state.steering.own_mode.name == what:
        ctx.set(steering=changed(ctx.state.steering, own_mode=Mode.GUIDED))


def take_events(ctx: StepContext) -> None:
    """Take events: reboots, somebody else's uploads, what is not believed."""
    status = ctx.snapshot.autopilot
    rebooted = any(isinstance(e, AutopilotRebooted) for e in ctx.snapshot.events)
    if status is not None and status.boot_s is not None:
        if ctx.state.vehicle.boot_s is not None and status.boot_s < ctx.state.vehicle.boot_s - BOOT_SLACK_S:
            rebooted = True
        ctx.set(vehicle=changed(ctx.state.vehicle, boot_s=status.boot_s))
    ctx.set(vehicle=changed(ctx.state.vehicle, rebooted=rebooted))
    for event in ctx.snapshot.events:
        if isinstance(event, StatusText):
            ours = ctx.state.pending.upload is not None or ctx.t_s - ctx.state.mission.asked_s < ctx.config.settle_s
            if event.text.startswith(FOREIGN_TEXTS) and not ours and event.source_component == 1:
                # A read that is under way, or came in this very step, may tell of the mission before.
                ctx.set(
                    mission=changed(ctx.state.mission, checked=False, read_since_s=ctx.t_s),
                    pending=changed(ctx.state.pending, read=None),
                )
            note(ctx, event)
        elif isinstance(event, Disbelieved):
            ctx.say(Severity.WARNING, event.what, event.text, every_s=0.0)
        elif isinstance(event, ParameterChanged):
            ctx.say(Severity.WARNING, "parameter", event.text, every_s=0.0)


def count_time(ctx: StepContext) -> None:
    """Count how long the voyage has been under way."""
    state, status = ctx.state, ctx.autopilot
    sails = state.voyage.sailing and not state.voyage.over and status is not None and status.is_armed
    passed_s = ctx.t_s - state.voyage.last_step_s if sails and math.isfinite(state.voyage.last_step_s) else 0.0
    ctx.set(
        voyage=changed(ctx.state.voyage, under_way_s=state.voyage.under_way_s + max(0.0, passed_s), last_step_s=ctx.t_s)
    )
    now_s = ctx.utc_s
    if sails and state.voyage.set_sail_utc_s is None and now_s is not None:
        ctx.set(voyage=changed(ctx.state.voyage, set_sail_utc_s=round(now_s - ctx.state.voyage.under_way_s, 1)))


def locate(ctx: StepContext) -> None:
    """Say where the boat is on its route: the autopilot's count, our own count, gates passed, way made good."""
    state, status = ctx.state, ctx.autopilot
    route, had_way = state.mission.route, bool(ctx.ahead())
    if ctx.gate is not None and ctx.boat_en is not None:
        ctx.set(
            progress=changed(
                ctx.state.progress, bearing_rad=bearing_on(ctx.gate, ctx.boat_en, state.progress.bearing_rad)
            )
        )
    guided = ctx.steers and state.voyage.sailing and status is not None and status.mode is Mode.GUIDED
    if route is not None and status is not None and status.mission_seq is not None and _counts(ctx) and not guided:
        index = min(max(status.mission_seq - 1, 0), len(route.items) - 1)
        # Right after we made an item current the stream may still carry the old number.
        settled = ctx.t_s - state.mission.asked_s > ctx.config.settle_s
        if settled or state.mission.index <= index <= state.mission.index + 1:
            ctx.set(mission=changed(ctx.state.mission, index=index))
    boat = ctx.boat_en
    if route is not None and boat is not None and state.voyage.sailing:
        _own_count(ctx)
        if guided:
            ctx.set(
                mission=changed(
                    ctx.state.mission, index=min(ctx.state.mission.own_index, len(route.items) - 1), passed_since_s=None
                )
            )
        pass_gates(ctx)
        if guided and ctx.guidance is Guidance.FIELD and ctx.state.mission.route is not None:
            # Steered to the gates themselves: the waypoints before a gate that is passed need not be.
            done = [n + 1 for n, g in enumerate(route.gate_of) if 0 <= g < ctx.state.progress.gate]
            bound = diversion(ctx)
            if bound is not None and bound.name == route.bound_for and distance_m(boat, bound.en_m) <= bound.radius_m:
                done = [len(route.items) - 1]
            if done and done[-1] > ctx.state.mission.index:
                ctx.set(mission=changed(ctx.state.mission, index=done[-1], own_index=done[-1]))
        _remember(ctx)
    if had_way and not ctx.ahead():
        # What was tried from its last waypoint says nothing of a plan from the boat, nor is there time for patience.
        ctx.set(plans=changed(ctx.state.plans, retry=PATIENT))


def remember_fix(ctx: StepContext) -> None:
    """Keep the position for the next step's look at jumps."""
    here, vehicle, age = ctx.snapshot.position_en_m, ctx.snapshot.vehicle, ctx.snapshot.vehicle_age_s
    if here is not None and vehicle is not None and age is not None and age <= FRESH_S:
        ctx.set(
            position=changed(
                ctx.state.position, last_seen=Fix(t_s=ctx.t_s - age, en_m=here, velocity_en_mps=vehicle.velocity_en_mps)
            )
        )


def notice_truncation(ctx: StepContext) -> None:
    """Look at the mission again when the autopilot counts fewer items than we put there."""
    status, state = ctx.autopilot, ctx.state
    if (
        status is not None
        and status.mission_total is not None
        and state.mission.route is not None
        and state.mission.checked
        and state.pending.upload is None
        and status.mission_total < len(state.mission.route.items)
        and ctx.t_s - state.mission.read_since_s > ctx.config.settle_s
        and ctx.t_s - state.mission.uploaded_s > ctx.config.settle_s
    ):
        ctx.set(mission=changed(ctx.state.mission, checked=False, read_since_s=ctx.t_s))


def _counts(ctx: StepContext) -> bool:
    """Return whether the autopilot's number is about our route: that it sails when she is given up, too."""
    is_taken = ctx.state.phase is Phase.OPERATOR and not ctx.is_given_up
    return ctx.state.mission.checked and not ctx.state.mission.foreign and not is_taken


def _is_done(ctx: StepContext, route: Route, n: int, boat: PointEn) -> bool:
    """Return whether a waypoint may be left behind by Büsser's double conditions.

    While we steer, a goal's is not left for the leg that follows before she is past it: until then she may come within
    its radius, which the grid size is not. The last one is, for to the loiter behind it she is taken in her time.
    """
    gate = route.gate_of[n]
    is_place = gate >= ctx.state.progress.gate and ctx.gates[gate].buoy_en_m is None
    is_goals = ctx.is_steered and is_place and n < ctx.last_waypoint()
    return waypoint_done(
        boat,
        route.leg_from_en_m[n],
        route.points_en_m[n],
        None if is_goals else route.points_en_m[n + 1],
        grid_m=ctx.config.grid_size_m,
        manoeuvre_m=ctx.config.manoeuvre_m,
    )


def _own_count(ctx: StepContext) -> None:
    """Advance our own target by Büsser's double conditions; note when the autopilot lags behind it.

    Where its number is not known to be of our route it is not known to lag, nor while she still comes nearer to the
    goal that its waypoint is of: beating to one she crosses a leg that leads back long before she is there.
    """
    boat, route = ctx.boat_en, ctx.state.mission.route
    if boat is None or route is None:
        return
    own = max(ctx.state.mission.own_index, ctx.state.mission.index)
    while own < len(route.items) - 1 and _is_done(ctx, route, own, boat):
        own += 1
        if own > ctx.state.mission.index + 1:
            break
    lags = _counts(ctx) and own > ctx.state.mission.index
    since = ctx.state.mission.passed_since_s
    if since is None or _comes_nearer(ctx, route, boat):
        since = ctx.t_s
    ctx.set(mission=changed(ctx.state.mission, own_index=own, passed_since_s=since if lags else None))


def _comes_nearer(ctx: StepContext, route: Route, boat: PointEn) -> bool:
    """Return whether she is nearer than ever to the goal whose waypoint the autopilot steers for."""
    gate, progress = ctx.gate, ctx.state.progress
    if gate is None or gate.buoy_en_m is not None or route.gate_of[ctx.state.mission.index] != progress.gate:
        return False
    return distance_m(boat, gate.en_m) < progress.closest_m


def _remember(ctx: StepContext) -> None:
    """Keep the way made good, for the progress watchdog."""
    boat, ahead = ctx.boat_en, to_go(ctx)
    if boat is None:
        return
    # at rest no way is made, nor on a circle
    history = ctx.state.progress.history if ahead and not is_composed(ctx) else ()
    plan_id = ctx.state.mission.route.plan_id if ctx.state.mission.route is not None else -1
    is_new = ctx.state.progress.history_plan != plan_id
    is_due = not history or ctx.t_s - history[-1][0] >= HISTORY_STEP_S
    if not is_due and not is_new:
        return
    left = 0.0
    point = boat
    for following in ahead:
        left += distance_m(point, following)
        point = following
    if history and is_new and not ctx.is_field_steered:
        # A new plan may be longer or shorter: what it changed is no way made good, nor lost.
        longer = left - history[-1][3]
        history = tuple((t_s, east, north, togo + longer) for t_s, east, north, togo in history)
    if is_due:
        history = (*history, (ctx.t_s, boat[0], boat[1], left))[-HISTORY_KEPT:]
    ctx.set(progress=changed(ctx.state.progress, history=history, history_plan=plan_id))
