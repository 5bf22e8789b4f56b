"""The log of a voyage: what was decided, by which numbers, and what was rejected for it."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import shapely

from companion.fold import Step
from companion.geo.angles import direction
from companion.messages import Severity
from companion.orders import Order
from companion.planner import Plan, Problem
from companion.skipper.step import (
    Acknowledge,
    Announce,
    CommandOutcome,
    CommandResult,
    ModeChanged,
    PlanOutcome,
    RequestPlan,
    UploadMission,
    UploadOutcome,
    UploadResult,
)
from companion.view.parts import level_of
from companion.view.values import Level
from companion.words import counted

LOUD = Severity.INFO
LEAST_RISK = 0.001  # a smaller chance is not worth a line
Facts = tuple[tuple[str, str], ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Event:
    """Something that happened at ``t_s``; ``number`` counts them from 1, ``facts`` are the numbers behind it.

    ``kind`` is phase, ask, plan, kept, upload, order, answer, mode, command or said.
    """

    number: int
    t_s: float
    unix_s: float | None = None
    kind: str
    level: Level = "info"
    title: str
    text: str = ""
    facts: Facts = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Happening:
    """An event that has no number and time yet."""

    kind: str
    title: str
    text: str = ""
    level: Level = "info"
    facts: Facts = ()


def happenings(
    step: Step, phase: str, why: dict[int, str], nearest: Mapping[int, str] = MappingProxyType({})
) -> Iterable[Happening]:
    """Yield what happened in a step; ``phase`` is the one before it.

    ``why`` are the reasons of plans by number, ``nearest`` what each is nearest to, as ``nearest_of`` names it.
    """
    snapshot = step.snapshot
    for event in snapshot.events:
        if isinstance(event, Order):
            yield Happening(
                kind="order",
                title=f"order: {event.wanted.words}",
                level="notice",
                text=f"of {event.source.words}",
                facts=(("authority", event.authority),),
            )
        elif isinstance(event, ModeChanged):
            before, after = (("unknown" if m is None else m.name) for m in (event.before, event.after))
            yield Happening(kind="mode", title=f"mode {after}", text=f"before it {before}")
    for outcome in snapshot.outcomes:
        if isinstance(outcome, PlanOutcome):
            made = step.state.plans.made
            yield _plan(outcome, made, why.get(made, ""), nearest.get(made, ""))
        elif isinstance(outcome, UploadOutcome):
            is_ok = outcome.result is UploadResult.OK
            yield Happening(
                kind="upload",
                level="info" if is_ok else "warning",
                title=f"upload {outcome.result.value}",
                text=outcome.text,
            )
        elif isinstance(outcome, CommandOutcome) and outcome.result is not CommandResult.ACCEPTED:
            yield Happening(kind="command", title=f"command {outcome.result.value}", text=outcome.text, level="warning")
    if step.state.phase.value != phase:
        yield Happening(kind="phase", title=step.state.phase.value, text=step.state.why, level="notice")
    for action in step.actions:
        if isinstance(action, RequestPlan):
            yield Happening(
                kind="ask", title=f"plan asked for: {action.reason.words}", text=action.text, facts=_facts(action)
            )
        elif isinstance(action, UploadMission):
            facts = [("items", str(len(action.items)))]
            if action.change.apart_m is not None:
                facts += [
                    ("apart from the old way", f"{action.change.apart_m:.0f} m"),
                    ("the old way", action.change.unsafe or "was safe"),
                ]
            yield Happening(kind="upload", title="new way uploaded", text=action.text, facts=tuple(facts))
        elif isinstance(action, Acknowledge):
            yield Happening(kind="answer", title=f"answer: {action.result.value}", text=action.text, level="notice")
        elif isinstance(action, Announce) and action.severity <= LOUD:
            kind = "kept" if action.code == "plan kept" else "said"
            yield Happening(kind=kind, title=action.code, text=action.text, level=level_of(action.severity))


def _facts(action: RequestPlan) -> Facts:
    problem = action.problem
    facts = [
        ("wind", f"{direction(problem.wind.twd_from_rad)}° {problem.wind.tws_mps:.1f} m/s"),
        ("no-go half angle now", f"{math.degrees(problem.no_go_half_rad(0.0)):.0f}°"),
        ("in 1 min", f"{math.degrees(problem.no_go_half_rad(60.0)):.0f}°"),
        ("in 5 min", f"{math.degrees(problem.no_go_half_rad(300.0)):.0f}°"),
        ("probability", f"{problem.delta_s:.2f}"),
        ("budget", f"{action.budget_s:.1f} s"),
    ]
    if action.rung:
        facts.append(("given up for it", action.rung))
    return tuple(facts)


def nearest_of(problem: Problem, plan: Plan) -> str:
    """Return the name of what a plan is nearest to: an obstacle's, a mark's, the fence; empty: nothing is there."""
    if not plan.has_path:
        return ""
    # Where she is there already the way is one place.
    way = shapely.LineString(plan.waypoints_en) if len(plan.waypoints_en) > 1 else shapely.points(*plan.waypoints_en)
    found = [(float(shapely.distance(o, way)), problem.obstacle_name(n)) for n, o in enumerate(problem.obstacles)]
    if problem.fence_polygon is not None:
        found.append((float(shapely.distance(problem.fence_polygon.boundary, way)), "the fence"))
    return min(found, default=(0.0, ""))[1]


def _plan(outcome: PlanOutcome, number: int, why: str, nearest: str) -> Happening:
    plan: Plan | None = outcome.plan
    if plan is None or not plan.has_path:
        title = "no plan" if plan is None else f"no plan: {plan.status.value}"
        return Happening(kind="plan", title=title, text=outcome.text, level="warning")
    facts = [("time", f"{plan.cost_s:.0f} s")]
    if plan.arrival is not None and math.isfinite(plan.arrival.late_s):
        facts.append(
            ("as wind and boat may be", f"{plan.arrival.median_s:.0f} s, nine of ten {plan.arrival.late_s:.0f} s")
        )
    if math.isfinite(plan.lower_bound_s) and plan.lower_bound_s > 0.0:
        facts.append(("no faster than", f"{plan.lower_bound_s:.0f} s"))
    facts += [
        ("legs", str(len(plan.legs))),
        ("looked at", counted(plan.expansions, "expansion")),
        ("computed in", f"{plan.elapsed_s:.2f} s"),
    ]
    tacks = sum(leg.manoeuvre == "tack" for leg in plan.legs)
    if tacks:
        facts.append(("tacks", str(tacks)))
    if plan.risk is not None:
        facts.append(("off the plan", f"{100.0 * plan.risk:.0f} %"))
    if plan.tack_risk >= LEAST_RISK:
        facts.append(("of it by tacks that fail", f"{100.0 * plan.tack_risk:.1f} %"))
    clear = [leg.clearance_m for leg in plan.legs if leg.clearance_m is not None]
    if clear:
        # a mark is no obstacle: what is kept clear of it is less than the margin
        facts.append(("nearest, beyond what is kept clear", f"{min(clear):.1f} m{f', {nearest}' if nearest else ''}"))
    return Happening(
        kind="plan", title=f"plan {number}: {plan.status.value}", text=why or outcome.text, facts=tuple(facts)
    )
