"""``plan``: check the problem, call the algorithm named, hand back a plan that the exact scorer has passed.

An algorithm is a function ``search(problem, effort, seed) -> Outcome``. It stops when ``effort`` says so and
returns its best waypoints; cost and legs are then computed here by the exact scorer, never by the algorithm.
"""

from __future__ import annotations

import importlib
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from companion.clock import effort_s
from companion.errors import InputError
from companion.planner.plan import Plan, PlanStatus, Why
from companion.planner.problem.evaluate import clearances
from companion.planner.problem.value import Problem

DEFAULT_BUDGET_S = 1.0
OPTIMAL_GAP = 1e-3

ALGORITHMS: Mapping[str, tuple[str, str]] = {
    "auto": ("companion.planner.search.auto", "search"),
    "rrtstar": ("companion.planner.reference.rrtstar", "search"),
    "astar": ("companion.planner.reference.astar", "search"),
}
"""Name -> module and function; modules are imported when asked for."""


_loaded: set[str] = set()


class Effort:
    """What a search may spend: expansions, or seconds, or both (then the seconds are only a backstop).

    Algorithms call ``spend`` with what they did and stop when ``is_over``. ``fraction`` is the share used of the
    limit that decides (expansions when given), so a schedule made from it does not depend on the machine when
    there is an expansion budget.
    """

    def __init__(self, budget_s: float | None, expansions: int | None) -> None:
        self.limit = expansions
        self.budget_s = math.inf if budget_s is None else budget_s
        self.used = 0
        self.first_s: float | None = None
        self._began_s = effort_s()

    def spend(self, expansions: int) -> None:
        """Count work done."""
        self.used += expansions

    @property
    def elapsed_s(self) -> float:
        """Computing time since the plan began [s]."""
        return effort_s() - self._began_s

    @property
    def fraction(self) -> float:
        """Share of the deciding limit used, 0..1 and beyond."""
        if self.limit is not None:
            return self.used / max(1, self.limit)
        return self.elapsed_s / self.budget_s if self.budget_s > 0.0 else 1.0

    @property
    def is_over(self) -> bool:
        """Must the search stop now?"""
        if self.limit is not None and self.used >= self.limit:
            return True
        return math.isfinite(self.budget_s) and self.elapsed_s >= self.budget_s

    @property
    def remaining_s(self) -> float:
        """Computing time left [s]; inf without a budget in seconds."""
        return self.budget_s - self.elapsed_s

    def part(self, share: float) -> Effort:
        """Return an effort that ends when ``share`` of this one's limits is spent; what it spends counts here."""
        return _Part(self, share)

    def remaining(self, chunk: int) -> int:
        """Return how much of a chunk of expansions is left."""
        return chunk if self.limit is None else max(0, min(chunk, self.limit - self.used))

    def found(self) -> None:
        """Note the moment of the first path."""
        if self.first_s is None:
            self.first_s = self.elapsed_s


class _Part(Effort):
    def __init__(self, whole: Effort, share: float) -> None:
        super().__init__(
            None if math.isinf(whole.budget_s) else share * whole.remaining_s,
            None if whole.limit is None else max(1, int(share * (whole.limit - whole.used))))
        self._whole = whole

    def spend(self, expansions: int) -> None:
        super().spend(expansions)
        self._whole.spend(expansions)

    def found(self) -> None:
        super().found()
        self._whole.found()


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """What an algorithm hands back: waypoints or None, a bound it proved, and for a failure what it knows."""

    waypoints_en: NDArray[np.float64] | None
    lower_bound_s: float = 0.0
    status: PlanStatus | None = None
    reason: str = ""
    trace: Mapping[str, Any] = field(default_factory=dict)


Search = Callable[[Problem, Effort, int], Outcome]


def plan(
    problem: Problem,
    *,
    budget_s: float | None = None,
    expansions: int | None = None,
    seed: int = 0,
    algorithm: str = "auto",
) -> Plan:
    """Plan ``problem``; never raises for a bad problem, that is ``PlanStatus.INVALID``.

    Args:
        problem: what to plan.
        budget_s: computing time [s]; 1 s when neither budget is given. The first plan of a process loads the
            compiled kernels first (on a new machine: compiles them); that time is not counted.
        expansions: effort in the algorithm's own steps; with it and a seed the plan does not depend on the
            machine, unless ``budget_s`` is given too and ends the search first.
        seed: of every random choice.
        algorithm: one of ``ALGORITHMS``.

    Raises:
        InputError: the algorithm is unknown or a budget is not positive.

    """
    if algorithm not in ALGORITHMS:
        raise InputError("plan", "algorithm", f"{algorithm!r} is unknown", "choose " + ", ".join(ALGORITHMS))
    if budget_s is not None and not budget_s > 0.0:
        raise InputError("plan", "budget_s", f"{budget_s} is not positive", "give seconds")
    if expansions is not None and not expansions > 0:
        raise InputError("plan", "expansions", f"{expansions} is not positive", "give a count")
    if budget_s is None and expansions is None:
        budget_s = DEFAULT_BUDGET_S
    _load(algorithm)
    effort = Effort(budget_s, expansions)
    empty = Plan(status=PlanStatus.INVALID, reason=problem.defect or "", waypoints_en=np.empty((0, 2)),
                 algorithm=algorithm, seed=seed, elapsed_s=effort.elapsed_s)
    if problem.defect is not None:
        return replace(empty, why=Why(text=f"Cannot be planned: {problem.defect}."))
    try:
        # Numbers that overflow or underflow on the way (1e-180 m in a WKT) end as inf or NaN, which no check passes.
        with np.errstate(all="ignore"):
            return _solved(problem, effort, empty)
    except shapely.errors.GEOSException as error:
        reason = f"the obstacles or the fence cannot be made valid ({str(error).splitlines()[0]})"
        return replace(empty, reason=reason, elapsed_s=effort.elapsed_s, why=Why(text=reason))


def _load(algorithm: str) -> None:
    """Compile or load an algorithm's kernels once in a process, before the budget starts to count."""
    if algorithm not in _loaded:
        _loaded.add(algorithm)
        from companion.planner.warm import warm

        warm(algorithm)


def _solved(problem: Problem, effort: Effort, empty: Plan) -> Plan:
    module, name = ALGORITHMS[empty.algorithm]
    search: Search = getattr(importlib.import_module(module), name)
    from companion.planner.risk.wind import keep_limit, search_within, with_risk

    def search_resolved(problem: Problem, effort: Effort, seed: int) -> Outcome:
        return search(problem.resolved, effort, seed)

    if problem.beat is not None and problem.boat.can_tack and empty.algorithm == "auto":
        from companion.planner.beat_search import with_beats

        search = with_beats(search, problem.beat)
    if problem.risk is None:
        return with_risk(problem, _judged(problem, search_resolved(problem, effort, empty.seed), effort, empty))
    if empty.algorithm == "rrtstar":  # carries the limit in its own tree (CC-RRT*)
        outcome = search_resolved(problem, effort, empty.seed)
    else:
        outcome = search_within(search_resolved, problem, effort, empty.seed)
    return keep_limit(problem, _judged(problem, outcome, effort, empty))


def _judged(problem: Problem, outcome: Outcome, effort: Effort, empty: Plan) -> Plan:
    """Return the outcome as a plan whose numbers come from the exact scorer."""
    spent = replace(empty, expansions=effort.used, elapsed_s=effort.elapsed_s, trace=outcome.trace,
                    lower_bound_s=outcome.lower_bound_s)
    if outcome.waypoints_en is None:
        status = outcome.status or PlanStatus.TIMEOUT
        reason = outcome.reason or "the effort ended before a path was found; none was proved impossible"
        bound = math.inf if status is PlanStatus.INFEASIBLE else outcome.lower_bound_s
        return replace(spent, status=status, reason=reason, lower_bound_s=bound, why=Why(text=reason))
    judged = problem.evaluate(outcome.waypoints_en)
    if not judged.is_feasible:
        reason = "the search's path did not pass the exact check: " + judged.reasons[0]
        return replace(spent, status=PlanStatus.TIMEOUT, reason=reason, why=Why(text=reason))
    bound = min(outcome.lower_bound_s, judged.time_s)
    gap = judged.time_s / bound - 1.0 if bound > 0.0 else (0.0 if judged.time_s <= 0.0 else math.inf)
    status = PlanStatus.OPTIMAL if gap <= OPTIMAL_GAP else PlanStatus.FOUND
    reason = f"{100.0 * gap:.1f} % above the bound" if math.isfinite(gap) else "no useful bound"
    return replace(
        spent, status=status, reason=reason, waypoints_en=np.array(outcome.waypoints_en, dtype=np.float64),
        legs=clearances(problem, judged.legs), cost_s=judged.time_s, lower_bound_s=bound, first_s=effort.first_s,
        elapsed_s=effort.elapsed_s,
    )
