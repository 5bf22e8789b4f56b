"""The faster of two paths: one sailed clear of the widened no-go zone, one whose beats are left to the autopilot."""

from __future__ import annotations

import math
from dataclasses import replace

from companion.planner.effort import Effort, Outcome, Search
from companion.planner.plan import PlanStatus
from companion.planner.problem.evaluate import beaten, evaluate
from companion.planner.problem.parts import Beat
from companion.planner.problem.value import Problem, defect_of
from companion.planner.search.bound import cut_off, lower_bound_s
from companion.planner.search.world import make_world

BOUND_TESTS = 40_000   # of visibility, for the bound of both kinds of path, when there is effort left
BEAT_SHARE = 0.3       # of the effort, for the path with beats: an easier search, and often the end of it


def with_beats(search: Search, beat: Beat) -> Search:
    """Return the search that hands back the faster of the two; its bound holds for paths of both kinds."""

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
            beating = search(straight, effort.part(BEAT_SHARE), seed)
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
                return replace(sailing, status=PlanStatus.TIMEOUT, reason=reason)
            return sailing
        if sailing.waypoints_en is None:
            return bounded(replace(beating, lower_bound_s=math.inf))
        if beating_s < evaluate(problem, sailing.waypoints_en).time_s:
            return bounded(replace(beating, lower_bound_s=math.inf))
        return bounded(sailing)

    return both
