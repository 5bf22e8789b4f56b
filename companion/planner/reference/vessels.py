"""Uncertain vessels under the bound of RRT*'s own tree, in place of the closed discs that other algorithms are given.

The promise is shared as the problem says (``companion.planner.problem.value``): the wind has its own delta_s, and
each of n vessels a part ``vessels_share / n`` at each instant. A disc that keeps the part is sized by the larger of the
vessel's two standard deviations and by a half plane. Here the part itself is the constraint: at every instant of every
edge, the chance to be nearer than hulls and clearance, of the Gaussian with both its axes, is the part at most. With a
limit on the path's risk the expected entries of each edge are added to what a state has accumulated, as the wind's.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from companion.messages import Spread, Target
from companion.planner.plan import Leg, Plan, PlanStatus, Why
from companion.planner.problem.evaluate import Evaluation, evaluate
from companion.planner.problem.value import Problem, sigmas_for, uncertain, vessel_count
from companion.planner.reference import rrtstar_kernels as kernels
from companion.planner.risk.chance_constraint import vessel_risk
from companion.planner.risk.kernels import LEAST_SIGMA_M, inside, spread_at

KEPT = 1.0 - 1e-6  # of its part that the tree uses: the judge's times differ by the last digits
SLACK = 1e-9
ABOVE = "the path found is at some instant likelier to be too near to a vessel than was promised"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TreeVessels:
    """The vessels as the tree's arrays: windows (n, ``VESSEL_COLUMNS``), and regions as targets (n, 8)."""

    window: NDArray[np.float64]
    disc: NDArray[np.float64]


NO_VESSELS = TreeVessels(window=np.zeros((0, kernels.VESSEL_COLUMNS)), disc=np.zeros((0, 8)))


def carried(problem: Problem) -> tuple[Problem, TreeVessels] | None:
    """Return the problem without its uncertain vessels, and these for the tree; None where they stay discs.

    They stay discs where there are none, where the start is already likelier to be too near to one than its part, and
    where a disc is smaller than the distance to keep (``companion.skipper.planning.vessels`` lets a boat out so).
    """
    found = uncertain(problem.targets)
    if not found or any(t.radius_m < s.keep_m - SLACK for t, s in found):
        return None
    count = vessel_count(problem.targets)
    part = problem.vessels_share / count
    found = tuple(sorted(found, key=lambda w: (w[1].vessel, w[0].from_s)))
    number = {vessel: float(n) for n, vessel in enumerate(dict.fromkeys(s.vessel for _, s in found))}
    rows = np.array([_row(number[s.vessel], t, s, KEPT * part) for t, s in found])
    if any(t.from_s <= 0.0 and _at_start(problem, s) > KEPT * part for t, s in found):
        return None
    sigmas = sigmas_for(part, 1)
    vessels = TreeVessels(window=rows, disc=np.array([_disc(t, s, sigmas) for t, s in found]))
    certain = tuple(t for t in problem.targets if t.spread is None)
    return replace(problem, delta_s=problem.wind_delta_s, targets=certain, vessels_part=None), vessels


def _row(whose: float, t: Target, s: Spread, part: float) -> tuple[float, ...]:
    return (
        whose,
        t.from_s,
        min(t.until_s, 1e15),
        s.x_m,
        s.y_m,
        t.vx_mps,
        t.vy_mps,
        s.keep_m,
        math.sin(s.course_rad),
        math.cos(s.course_rad),
        s.along_m,
        s.along_mps,
        s.across_m,
        s.across_mps,
        s.own_mps,
        part,
    )


def _at_start(problem: Problem, s: Spread) -> float:
    """Return the chance to be too near at t = 0; our own place is sure then."""
    sine, cosine, out = math.sin(s.course_rad), math.cos(s.course_rad), np.empty(9)
    spread_at(0.0, np.array([[sine, cosine, s.along_m, s.along_mps], [cosine, -sine, s.across_m, s.across_mps]]), out)
    return float(inside(problem.start_en[0] - s.x_m, problem.start_en[1] - s.y_m, out, s.keep_m))


def _disc(t: Target, s: Spread, sigmas: float) -> tuple[float, ...]:
    """Return a region outside which the part is not reached: the larger deviation is convex, its chord is above it."""

    def sigma_m(at_s: float) -> float:
        return math.hypot(
            max(abs(s.along_m + s.along_mps * at_s), abs(s.across_m + s.across_mps * at_s)),
            s.own_mps * at_s,
            LEAST_SIGMA_M,
        )

    first = sigma_m(t.from_s)
    slope = math.hypot(max(abs(s.along_mps), abs(s.across_mps)), s.own_mps)
    if math.isfinite(t.until_s) and t.until_s > t.from_s:
        slope = (sigma_m(t.until_s) - first) / (t.until_s - t.from_s)
    return (
        s.x_m,
        s.y_m,
        t.vx_mps,
        t.vy_mps,
        s.keep_m + sigmas * (first - slope * t.from_s),
        sigmas * slope,
        t.from_s,
        min(t.until_s, 1e15),
    )


def is_kept(problem: Problem, legs: tuple[Leg, ...]) -> bool:
    """Return whether a path keeps the vessels' share of the problem at every instant, as the judge counts it."""
    return vessel_risk(problem, legs).worst_instant <= problem.vessels_share + SLACK


def judge_of(problem: Problem, free: Problem) -> Callable[[list[tuple[float, float]]], Evaluation]:
    """Return the exact scorer of a path in ``free``, the problem without its vessels, that holds it to their share."""

    def judge(path: list[tuple[float, float]]) -> Evaluation:
        judged = evaluate(free, np.asarray(path))
        if not judged.is_feasible or is_kept(problem, judged.legs):
            return judged
        return replace(judged, is_feasible=False, reasons=(ABOVE,))

    return judge


def keep_share(problem: Problem, plan: Plan) -> Plan:
    """Return the plan, or it without its path where that risks more for vessels at some instant than they are given."""
    if not plan.has_path or is_kept(problem, plan.legs):
        return plan
    return replace(
        plan,
        status=PlanStatus.NOT_FOUND,
        reason=ABOVE,
        waypoints_en=np.empty((0, 2)),
        legs=(),
        cost_s=math.inf,
        first_s=None,
        why=Why(text=ABOVE),
    )
