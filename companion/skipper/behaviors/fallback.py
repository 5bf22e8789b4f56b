"""Following a fallback on a plan in AUTO: when a field asks for it, when it begins to sail, and when it is over."""

from __future__ import annotations

from dataclasses import replace

from companion.frozen import changed
from companion.messages import Severity
from companion.skipper.planning.diversions import is_composed
from companion.skipper.planning.fallback import begun, bound_to, is_planned_since, may_fall_back, may_leave_headings
from companion.skipper.step import Guidance, StepContext
from companion.skipper.step.state import Fallback, Retry

NO_WAY = "no progress"  # the watchdog's


def follow_fallback(ctx: StepContext) -> None:
    """Ask for a plan where the field makes no progress, sail it in AUTO once it is on board, and end at the goal."""
    fallback = ctx.state.fallback
    if fallback.gate >= 0 and not ctx.asks_fallback:
        _end(ctx, fallback)
    elif fallback.gate >= 0 and not fallback.sails and ctx.state.voyage.sailing:
        _begin(ctx, fallback)
    elif ctx.is_raised(NO_WAY) and fallback.gate < 0 and ctx.is_field_steered and not is_composed(ctx):
        if may_fall_back(ctx):
            why = "by field no progress is made"
            ctx.set(fallback=begun(ctx, why, sails=False), plans=changed(ctx.state.plans, retry=Retry()))
    elif _waits_for_headings(ctx):
        ctx.set(plans=changed(ctx.state.plans, retry=Retry()))


def _begin(ctx: StepContext, fallback: Fallback) -> None:
    """Leave the helm to AUTO once a way from where the field has brought the boat is on board, and judged."""
    if not ctx.is_field_steered or not is_planned_since(ctx, fallback.since_s):
        return
    ctx.set(fallback=replace(fallback, sails=True), progress=changed(ctx.state.progress, history=()))
    ctx.say(Severity.NOTICE, "fallback", f"{fallback.why}: by plan in AUTO to {bound_to(ctx)}", every_s=0.0)


def _end(ctx: StepContext, fallback: Fallback) -> None:
    """End it with its goal; by headings, once no leg on board is left to the autopilot's own beat."""
    gate = None if ctx.state.voyage.over else ctx.gate
    is_same = gate is not None and gate.goal == fallback.goal
    beats_on = ctx.config.guidance is Guidance.HEADING and _beats_ahead(ctx)
    if gate is not None and fallback.sails and (is_same or beats_on):
        ctx.set(fallback=replace(fallback, gate=ctx.state.progress.gate, goal=gate.goal))
        return
    ctx.set(fallback=Fallback(), progress=changed(ctx.state.progress, history=()))
    if gate is not None and fallback.sails:
        by = "field" if ctx.config.guidance is Guidance.FIELD else "headings"
        ctx.say(Severity.NOTICE, "fallback", f"by {by} again, to {gate.name}", every_s=0.0)


def _beats_ahead(ctx: StepContext) -> bool:
    """Return whether a leg on board lies where the autopilot beats, in the wind of now or in its mean."""
    route, n = ctx.state.mission.route, ctx.state.mission.index
    if route is None:
        return False
    legs = list(zip(route.leg_from_en_m[n:-1], route.points_en_m[n:-1], strict=True))
    return any(ctx.is_closed(*leg, wind) for leg in legs for wind in (ctx.wind_now, ctx.wind_mean))


def _waits_for_headings(ctx: StepContext) -> bool:
    """Return whether she lies in the mission's safe end with goals left, for want of a plan by headings only.

    Then the ladder is climbed at once rather than after the pause: its last step but one is AUTO.
    """
    is_left = ctx.state.voyage.sailing and not ctx.state.voyage.over and ctx.gate is not None
    has_pause = ctx.t_s < ctx.state.plans.retry.not_before_s
    return is_left and has_pause and not ctx.ahead() and may_leave_headings(ctx)
