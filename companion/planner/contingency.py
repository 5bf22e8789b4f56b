"""A search whose tacks have room to fail: a path with one that has not gives way to another within a tenth of its time.

The search plans as ever. Where a tack's failure would touch (``companion.planner.risk.tacks``) it looks again in water
that is narrower by the room that is missing, and by other shares of that: she then tacks earlier; and as a boat that
does not tack. Of what is within ``DEARER`` of the first path's time the least risky is handed out; a slower one where
the risk that it spares, a contact taken for ``CONTACT_S``, is worth the time. What no such path avoids stays, and is
counted in the path's risk. Only a path with such a tack costs more than the search itself.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

from companion.planner.effort import Effort, Outcome, Search
from companion.planner.problem.evaluate import evaluate
from companion.planner.problem.value import Problem, defect_of
from companion.planner.risk.tacks import TackAtRisk, of_risky, tacks_at_risk

DEARER = 1.10          # of the first path's time: what another may take
CONTACT_S = 1800.0     # what a contact counts as
AGAIN_SHARE = 0.15     # of the search's expansions, for each of the others
AGAIN_TIME_SHARE = 0.04   # of its seconds: together they stay within a fifth of the budget
NARROWER = (1.0, 2.0, 3.0, 0.5)   # of the room that is missing: more of it lets more failures in a row pass
SPARE_M = 0.5


def with_contingency(search: Search) -> Search:
    """Return the search whose tacks have room to fail, where there is such a path."""
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
            is_worth_it = key < best_key if seen.time_s <= limit_s else _counted_s(key) < _counted_s(best_key)
            if is_worth_it:
                best, best_key = found, key
            if best_key[0] == 0.0:
                break
        return replace(best, lower_bound_s=outcome.lower_bound_s)

    return careful


def _counted_s(key: tuple[float, float]) -> float:
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
