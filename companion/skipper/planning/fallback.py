"""Falling back on a plan in AUTO where the mission's own guidance comes to nothing on the way to the next goal.

A field has no memory of where it has been: in a bay, or before a neck to windward, it beats to and fro for ever. By
headings every tack has to be planned, and in a wind that shifts far no way to windward is left that a plan may promise;
the autopilot's own beat follows each shift at once and asks for room beside its line only.
"""

from __future__ import annotations

from companion.frozen import changed
from companion.messages import Severity
from companion.skipper.planning.asking import request
from companion.skipper.planning.autopilot_beats import tacks_fail
from companion.skipper.planning.diversions import diversion, is_composed
from companion.skipper.planning.track import steps
from companion.skipper.planning.uploads import is_on_board_sound, is_way_clear
from companion.skipper.step import Guidance, StepContext
from companion.skipper.step.state import Fallback, PendingPlan, Retry
from companion.skipper.way import PointEn, distance_m

STAYS_M = 25.0  # of a place where she is to stay: boards and loops of a station keep within


def may_fall_back(ctx: StepContext) -> bool:
    """Return whether a plan may be put on board and sailed in AUTO in place of the mission's own guidance."""
    may = ctx.snapshot.permissions
    return ctx.config.guidance is not Guidance.PLAN and may.may_upload and may.may_set_mode


def may_leave_headings(ctx: StepContext) -> bool:
    """Return whether the autopilot's own beats may be asked for in place of headings, and are not yet."""
    is_by_headings = ctx.config.guidance is Guidance.HEADING and ctx.steers_plans
    return is_by_headings and ctx.config.autopilot_beats and may_fall_back(ctx) and not tacks_fail(ctx)


def leaves_headings(ctx: StepContext, pending: PendingPlan, reason: str) -> bool:
    """Ask again as for AUTO where by headings no step of the ladder but a nearer place is left; False: go on as ever.

    What is on board is sailed in AUTO from now on: it is the way that the headings led along.
    """
    ladder = steps(ctx)
    following = ladder[min(pending.rung + 1, len(ladder) - 1)]
    if not following.nearer_goal or not may_leave_headings(ctx):
        return False
    why = "by headings no plan is found"
    ctx.set(fallback=begun(ctx, why, sails=True), plans=changed(ctx.state.plans, retry=Retry(), rung=0))
    ctx.say(
        Severity.WARNING,
        "fallback",
        f"{why} ({reason}): by plan in AUTO, where the autopilot beats by itself, to {bound_to(ctx)}",
        every_s=0.0,
    )
    return request(ctx, pending.reason, text=why)


def begun(ctx: StepContext, why: str, *, sails: bool) -> Fallback:
    """Return the fallback to the goal that is next."""
    goal = -1 if ctx.gate is None else ctx.gate.goal
    return Fallback(gate=ctx.state.progress.gate, goal=goal, since_s=ctx.t_s, sails=sails, why=why)


def bound_to(ctx: StepContext) -> str:
    """Return where she is bound for, in words."""
    bound = diversion(ctx)
    return bound.name if bound is not None else ctx.gate.name if ctx.gate is not None else "the end"


def is_planned_since(ctx: StepContext, since_s: float) -> bool:
    """Return whether a way to be sailed in AUTO is on board: planned since then, or found sound when no other was.

    A way to a nearer place is one: the next plan is made from there, not again from where none is found.
    """
    route, pending = ctx.state.mission.route, ctx.state.pending
    if route is None or not ctx.ahead() or pending.plan is not None or pending.upload is not None:
        return False
    is_new = route.plan_t_s >= since_s and is_way_clear(ctx)
    return is_new or (ctx.state.plans.last_s >= since_s and is_on_board_sound(ctx))


def to_go(ctx: StepContext) -> tuple[PointEn, ...]:
    """Return the places between the boat and the end of her way: the mission's on board, or where a field leads her.

    A field makes for the goals themselves, past whatever waypoints are on board. About a place where she is to stay
    there is no more way to go.
    """
    if not ctx.is_field_steered or is_composed(ctx):
        return ctx.ahead()
    bound, boat = diversion(ctx), ctx.boat_en
    if bound is not None:
        if not bound.has_place or (boat is not None and distance_m(boat, bound.en_m) < max(STAYS_M, bound.radius_m)):
            return ()
        return (bound.en_m,)
    return () if ctx.state.voyage.over else tuple(gate.en_m for gate in ctx.gates[ctx.state.progress.gate :])
