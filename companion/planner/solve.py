"""``plan``: check the problem, call the algorithm named, hand back a plan that the exact scorer has passed.

An algorithm is a function ``search(problem, effort, seed) -> Outcome``. It stops when ``effort`` says so and
returns its best waypoints; cost and legs are then computed here by the exact scorer, never by the algorithm.

A budget in seconds is that of the whole answer. ``auto``'s first path is judged soon after it is there: then there is
an answer, and what its judgement took is kept back from the search for the last one.
"""

from __future__ import annotations

import importlib
import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from companion.errors import InputError
from companion.planner.effort import Effort, Outcome, Search
from companion.planner.plan import Plan, PlanStatus, Why
from companion.planner.problem.evaluate import Evaluation, beaten, clearances, evaluate
from companion.planner.problem.parts import Beat
from companion.planner.problem.value import Problem, defect_of, resolved
from companion.planner.risk.tacks import TackAtRisk, of_risky, tacks_at_risk
from companion.planner.warm import warm_problems
from companion.planners import ALGORITHMS, Settings

DEARER = 1.10  # of the first path's time: what another may take
CONTACT_S = 1800.0  # what a contact counts as
AGAIN_SHARE = 0.15  # of the search's expansions, for each of the others
AGAIN_TIME_SHARE = 0.04  # of its seconds: together they stay within a fifth of the budget
NARROWER = (1.0, 2.0, 3.0, 0.5)  # of the room that is missing: more of it lets more failures in a row pass
SPARE_M = 0.5


def with_contingency(search: Search) -> Search:
    """Return the search whose tacks have room to fail, where there is such a path.

    Where a tack's failure would touch (``companion.planner.risk.tacks``) it looks again in water that is narrower by
    the room that is missing, and by other shares of that: the boat then tacks earlier; and as a boat that does not
    tack. Of what is within ``DEARER`` of the first path's time the least risky is handed out; a slower one where the
    risk that it spares, a contact taken for ``CONTACT_S``, is worth the time. What no such path avoids is counted in
    the path's risk.
    """

    def careful(problem: Problem, effort: Effort, seed: int) -> Outcome:
        outcome = search(problem, effort, seed)
        if outcome.waypoints_en is None:
            return outcome
        judged = evaluate(problem, outcome.waypoints_en)
        tacks = tacks_at_risk(problem, judged.legs)
        if not any(tack.is_risky for tack in tacks):
            return outcome
        best, best_key, limit_s = outcome, (of_risky(tacks), judged.time_s), DEARER * judged.time_s
        for other in _others(problem, tacks):
            again = effort.again(AGAIN_SHARE, AGAIN_TIME_SHARE)
            if not effort.has_time(0.0 if math.isinf(again.budget_s) else again.budget_s):
                break
            found = search(other, again, seed)
            effort.spend(again.used)
            if found.waypoints_en is None:
                continue
            # in the problem itself: what is narrower for the search is not narrower for the path
            seen = evaluate(problem, found.waypoints_en)
            if not seen.is_feasible:
                continue
            key = (of_risky(tacks_at_risk(problem, seen.legs)), seen.time_s)
            is_worth_it = key < best_key if seen.time_s <= limit_s else _keyed_s(key) < _keyed_s(best_key)
            if is_worth_it:
                best, best_key = found, key
            if best_key[0] == 0.0:
                break
        return replace(best, lower_bound_s=outcome.lower_bound_s)

    return careful


def _keyed_s(key: tuple[float, float]) -> float:
    """Return a path's time, with what its risk counts as [s]."""
    risk, time_s = key
    return time_s + CONTACT_S * risk


def _others(problem: Problem, tacks: tuple[TackAtRisk, ...]) -> Iterator[Problem]:
    """Yield the problem with more room about its tacks, and without tacks."""
    lack = max(tack.lack_m for tack in tacks if tack.is_risky) + SPARE_M
    for share in NARROWER:
        narrower = replace(problem, clearance_floor_m=problem.clearance_floor_m + share * lack)
        if defect_of(narrower) is None:
            yield narrower
    yield replace(problem, beat=None, boat=replace(problem.boat, can_tack=False))


BOUND_TESTS = 40_000  # of visibility, for the bound of both kinds of path, when there is effort left
BEAT_SHARE = 0.3  # of the effort, for the path with beats: an easier search, and often the end of it
HOPELESS = 2.0  # times what a path without beats takes at the least: one with beats that takes longer is given up


def with_beats(search: Search, beat: Beat) -> Search:
    """Return the search of the faster of two paths: one without beats, one whose beats are left to the autopilot.

    Its bound holds for paths of both kinds.
    """
    from companion.planner.search.bound import cut_off, lower_bound_s
    from companion.planner.search.world import make_world

    def both(problem: Problem, effort: Effort, seed: int) -> Outcome:
        closed = replace(problem, beat=None)
        straight = beaten(problem, beat)

        def bounded(outcome: Outcome) -> Outcome:
            either = replace(straight, clearance_floor_m=problem.clearance_floor_m)
            bound_s = 0.0 if effort.is_late else lower_bound_s(either, tests=0 if effort.is_over else BOUND_TESTS)
            return replace(outcome, lower_bound_s=min(bound_s, outcome.lower_bound_s))

        # Where the fence leaves no corridor there is nothing to search.
        beating, beating_s = Outcome(waypoints_en=None), math.inf
        if defect_of(straight) is None:
            beating = search(straight, effort.part(BEAT_SHARE, HOPELESS * lower_bound_s(closed)), seed)
        if beating.waypoints_en is not None:
            judged = evaluate(problem, beating.waypoints_en)
            beating_s = judged.time_s if judged.is_feasible else math.inf
        if math.isfinite(beating_s) and beating_s <= lower_bound_s(closed):
            return bounded(replace(beating, lower_bound_s=math.inf))
        if math.isfinite(beating_s) and effort.is_late:
            return bounded(replace(beating, lower_bound_s=math.inf))
        sailing = search(closed, effort, seed)
        if sailing.waypoints_en is None and math.isinf(beating_s):
            if sailing.status is PlanStatus.INFEASIBLE and cut_off(make_world(closed)) is None:
                # The wind closes what is sailed and the corridor what is beaten: no proof for a path of both.
                reason = f"no path was found; without beats {sailing.reason}"
                return replace(sailing, status=PlanStatus.NOT_FOUND, reason=reason)
            return sailing
        if sailing.waypoints_en is None:
            return bounded(replace(beating, lower_bound_s=math.inf))
        if beating_s < evaluate(problem, sailing.waypoints_en).time_s:
            return bounded(replace(beating, lower_bound_s=math.inf))
        return bounded(sailing)

    return both


DEFAULT_BUDGET_S = 1.0
OPTIMAL_GAP = 1e-3
TRIED = 0.1  # of a budget in seconds: for changes to a path so that its track keeps the floor
MENDED = 0.25  # ... more where the first path's track does not, or a tack of it may fail onto something
AGAIN = 0.6  # of what judging the first path takes: that of another, for which water and winds are at hand
LATER = 2.0  # another path is judged after as many times as long, while somebody hears of it
SEARCHED = 0.94  # of a budget in seconds: the last step of a search ends late, and its path is checked exactly

_loaded: set[str] = set()


def plan(
    problem: Problem,
    *,
    budget_s: float | None = None,
    expansions: int | None = None,
    seed: int = 0,
    algorithm: str = "auto",
    settings: Settings | None = None,
    on_better: Callable[[Plan], None] | None = None,
    is_wanted: Callable[[], bool] | None = None,
) -> Plan:
    """Plan ``problem``; never raises for a bad problem, that is ``PlanStatus.INVALID``.

    Args:
        problem: what to plan.
        budget_s: computing time [s] of the whole answer; 1 s when neither budget is given. The first plan of a
            process loads the compiled kernels first (on a new machine: compiles them); that time is not counted.
        expansions: effort in the algorithm's own steps; with it and a seed the plan does not depend on the
            machine, unless ``budget_s`` is given too and ends the search first.
        seed: of every random choice.
        algorithm: one of ``ALGORITHMS``.
        settings: the algorithm's numbers, None: its defaults.
        on_better: is told of plans that can be sailed while better ones are looked for, each better than the one
            before (its time, with ``CONTACT_S`` for the risk of its tacks); with a budget in seconds alone. ``astar``
            has none to tell of: its first path is its only one.
        is_wanted: whether the answer still is; asked with each part of the effort that is spent.

    Raises:
        UnwantedError: it is not.
        InputError: the algorithm is unknown, the settings are another's, or a budget is not positive.

    """
    if algorithm not in ALGORITHMS:
        raise InputError("plan", "algorithm", f"{algorithm!r} is unknown", "choose " + ", ".join(ALGORITHMS))
    if settings is not None and type(settings) is not ALGORITHMS[algorithm].settings:
        raise InputError(
            "plan",
            "settings",
            f"{type(settings).__name__} is not for {algorithm!r}",
            "give those of the algorithm, or none",
        )
    if budget_s is not None and not budget_s > 0.0:
        raise InputError("plan", "budget_s", f"{budget_s} is not positive", "give seconds")
    if expansions is not None and not expansions > 0:
        raise InputError("plan", "expansions", f"{expansions} is not positive", "give a count")
    if budget_s is None and expansions is None:
        budget_s = DEFAULT_BUDGET_S
    warm(algorithm)
    searched_s = SEARCHED * budget_s if budget_s is not None and expansions is None else budget_s
    effort = Effort(searched_s, expansions, is_wanted)
    defect = defect_of(problem)
    empty = Plan(
        status=PlanStatus.INVALID,
        reason=defect or "",
        waypoints_en=np.empty((0, 2)),
        algorithm=algorithm,
        seed=seed,
        elapsed_s=effort.elapsed_s,
    )
    if defect is not None:
        return replace(empty, why=Why(text=f"Cannot be planned: {defect}."))
    try:
        # Numbers that overflow or underflow on the way (1e-180 m in a WKT) end as inf or NaN, which no check passes.
        with np.errstate(all="ignore"):
            return _solved(problem, effort, empty, settings, on_better)
    except shapely.errors.GEOSException as error:
        reason = f"the obstacles or the fence cannot be made valid ({str(error).splitlines()[0]})"
        return replace(empty, reason=reason, elapsed_s=effort.elapsed_s, why=Why(text=reason))


def warm(algorithm: str = "auto") -> None:
    """Compile or load an algorithm's kernels once in a process, before a budget starts to count."""
    if algorithm not in _loaded:
        _loaded.add(algorithm)
        for problem in warm_problems():
            plan(problem, expansions=ALGORITHMS[algorithm].warm_expansions, algorithm=algorithm)


def _solved(
    problem: Problem, effort: Effort, empty: Plan, settings: Settings | None, on_better: Callable[[Plan], None] | None
) -> Plan:
    algorithm = ALGORITHMS[empty.algorithm]
    found = importlib.import_module(algorithm.module).search
    search: Search = found if settings is None else partial(found, settings=settings)
    from companion.planner.risk.chance_constraint import keep_limit, search_within

    if algorithm.carries_vessels and problem.is_shared:
        from companion.planner.reference.vessels import carried, judge_of, keep_share

        found_vessels = carried(problem)
        if found_vessels is not None:  # the tree has the vessels, and what is promised of them is judged of its path
            free, vessels = found_vessels
            numbers = {} if settings is None else {"settings": settings}
            tree: Search = partial(found, vessels=vessels, **numbers)
            outcome = _whole(tree, free, judge_of(problem, free))(free, effort, empty.seed)
            return keep_limit(problem, keep_share(problem, _judged(free, outcome, effort, empty)))

    if problem.beat is not None and problem.boat.can_tack and empty.algorithm == "auto":
        search = with_beats(search, problem.beat)

    whole = _whole(search, problem)
    answers = _Answers(problem, effort, empty, on_better, lambda p, effort, seed: search(resolved(p), effort, seed))
    is_within = problem.risk is None or algorithm.bounds_path_risk
    if is_within and (on_better is not None or (problem.tracking is not None and empty.algorithm == "auto")):
        effort.listen(answers.judge)
    if is_within:
        outcome = whole(problem, effort, empty.seed)
    else:
        told = answers.judge if on_better is not None and effort.limit is None else None
        outcome = search_within(whole, problem, effort, empty.seed, told)
    return answers.last(outcome, keep_limit(problem, _judged(problem, outcome, effort, empty)))


class _Answers:
    """The best answer so far of a search in seconds, and what judging it takes."""

    def __init__(
        self, problem: Problem, effort: Effort, empty: Plan, on_better: Callable[[Plan], None] | None, search: Search
    ) -> None:
        self._problem, self._effort, self._empty, self._on_better = problem, effort, empty, on_better
        self._search, self._has_looked = search, False
        self.best: Plan | None = None

    def judge(self, waypoints_en: NDArray[np.float64]) -> float:
        """Judge a path that the search has come to; return when the next is to be judged [s]."""
        from companion.planner.risk.chance_constraint import keep_limit

        problem, effort = self._problem, self._effort
        began_s, spare_s, is_kept = effort.elapsed_s, 0.0, True
        path = [(float(x), float(y)) for x, y in waypoints_en]
        judged = evaluate(problem, path)
        needed_s = effort.elapsed_s - began_s
        if problem.tracking is not None and judged.is_feasible:
            from companion.planner.track.expected import expected
            from companion.planner.track.kept import laid, roomier

            is_kept, spare_s = expected(problem, path, judged.legs).is_kept, TRIED * effort.budget_s
            needed_s = effort.elapsed_s - began_s
            if not is_kept:
                path, seen = laid(problem, path, None, Effort(spare_s, None))
                is_kept = seen.is_kept
                if not is_kept and not self._has_looked:
                    self._has_looked = True
                    within_s = math.inf if self.best is None else self.best.cost_s
                    other = roomier(
                        self._search, problem, path, effort, self._empty.seed, laying_s=spare_s, within_s=within_s
                    )
                    path, is_kept = (path, False) if other is None else (other, True)
        found = None
        if judged.is_feasible and is_kept:
            then_s = effort.elapsed_s
            found = keep_limit(problem, _judged(problem, Outcome(waypoints_en=np.asarray(path)), effort, self._empty))
            needed_s += effort.elapsed_s - then_s
        effort.needed_s = max(effort.needed_s, AGAIN * needed_s)
        if not is_kept or (found is not None and found.tack_risk > 0.0):
            spare_s += MENDED * effort.budget_s
        effort.judging_s = max(effort.judging_s, effort.needed_s + spare_s)
        if found is not None and found.has_path and (self.best is None or _counted_s(found) < _counted_s(self.best)):
            self.best = replace(found, unproven=("search", "bound"))
            effort.has_answer, effort.is_at_risk = True, found.tack_risk > 0.0
            if self._on_better is not None:
                self._on_better(self.best)
        if self.best is not None and self._on_better is None:
            return math.inf  # it was judged to know what that takes
        return effort.elapsed_s + LATER * (effort.elapsed_s if found is not None else effort.elapsed_s - began_s)

    def last(self, outcome: Outcome, plan: Plan) -> Plan:
        """Return the last answer, or a better one from before: a path that does not keep what it must is none.

        The last may take longer than one from before where fewer of its tacks are at risk.
        """
        best = self.best
        if best is None or (
            plan.has_path and (_counted_s(plan) <= _counted_s(best) or plan.tack_risk < best.tack_risk)
        ):
            return plan
        bound = min(outcome.lower_bound_s, best.cost_s)
        is_bound = bound > 0.0 and math.isfinite(outcome.lower_bound_s)
        return replace(
            best,
            lower_bound_s=bound if is_bound else best.lower_bound_s,
            trace=outcome.trace,
            expansions=self._effort.used,
            elapsed_s=self._effort.elapsed_s,
            reason=f"{100.0 * (best.cost_s / bound - 1.0):.1f} % above the bound" if is_bound else best.reason,
            unproven=() if is_bound else ("bound",),
        )


def _counted_s(plan: Plan) -> float:
    """Return a plan's time, with what the risk of its tacks counts as [s]."""
    return plan.cost_s + CONTACT_S * plan.tack_risk


def _whole(
    search: Search, problem: Problem, judge: Callable[[list[tuple[float, float]]], Evaluation] | None = None
) -> Search:
    """Return the search in terms of discs, laid as the autopilot can follow it and with room for tacks that fail,
    where the problem says how."""  # noqa: D205, D209

    def search_resolved(problem: Problem, effort: Effort, seed: int) -> Outcome:
        return search(resolved(problem), effort, seed)

    whole: Search = search_resolved
    if problem.tracking is not None:
        from companion.planner.track import with_track

        whole = with_track(search_resolved, judge)
    if problem.boat.tack_fails > 0.0 and problem.boat.can_tack:
        whole = with_contingency(whole)
    return whole


def _judged(problem: Problem, outcome: Outcome, effort: Effort, empty: Plan) -> Plan:
    """Return the outcome as a plan whose numbers come from the exact scorer."""
    spent = replace(
        empty,
        expansions=effort.used,
        elapsed_s=effort.elapsed_s,
        trace=outcome.trace,
        lower_bound_s=outcome.lower_bound_s,
    )
    if outcome.waypoints_en is None:
        status = outcome.status or PlanStatus.TIMEOUT
        reason = outcome.reason or "the effort ended before a path was found; none was proved impossible"
        bound = math.inf if status is PlanStatus.INFEASIBLE else outcome.lower_bound_s
        return replace(spent, status=status, reason=reason, lower_bound_s=bound, why=Why(text=reason))
    judged = evaluate(problem, outcome.waypoints_en)
    if not judged.is_feasible:
        reason = "the search's path did not pass the exact check: " + judged.reasons[0]
        return replace(spent, status=PlanStatus.NOT_FOUND, reason=reason, why=Why(text=reason))
    bound = min(outcome.lower_bound_s, judged.time_s)
    gap = judged.time_s / bound - 1.0 if bound > 0.0 else (0.0 if judged.time_s <= 0.0 else math.inf)
    status = PlanStatus.OPTIMAL if gap <= OPTIMAL_GAP else PlanStatus.FOUND
    reason = f"{100.0 * gap:.1f} % above the bound" if math.isfinite(gap) else "no useful bound"
    return replace(
        spent,
        status=status,
        reason=reason,
        waypoints_en=np.array(outcome.waypoints_en, dtype=np.float64),
        legs=clearances(problem, judged.legs),
        cost_s=judged.time_s,
        lower_bound_s=bound,
        first_s=effort.first_s,
        elapsed_s=effort.elapsed_s,
        **_expected(problem, outcome.waypoints_en, judged),
    )


def _expected(problem: Problem, waypoints_en: NDArray[np.float64], judged: Evaluation) -> dict[str, Any]:
    """Return what a plan says of its time and its track, by its fields."""
    found: dict[str, Any] = {}
    if problem.wind.strength is not None:
        from companion.planner.risk.arrival import arrival

        found["arrival"] = arrival(problem, judged.legs)
    if problem.tracking is None:
        return found
    from companion.planner.track import expected

    seen = expected(problem, waypoints_en, judged.legs)
    is_near = math.isfinite(seen.clearance_m)
    return found | {"expected_clearance_m": seen.clearance_m if is_near else None, "expected_at_en": seen.at_en}
