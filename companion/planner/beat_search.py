"""The faster of two paths: one sailed clear of the widened no-go zone, one whose beats are left to the autopilot."""

from __future__ import annotations

import math
from dataclasses import replace

from companion.planner.beat import beaten
from companion.planner.bound import lower_bound_s
from companion.planner.problem import Beat, Problem
from companion.planner.solve import Effort, Outcome, Search

BOUND_TESTS = 40_000   # of visibility, for the bound of both kinds of path
BEAT_SHARE = 0.3       # of the effort, for the path with beats: an easier search, and often the end of it


def with_beats(search: Search, beat: Beat) -> Search:
    """Return the search that hands back the faster of the two; its bound holds for paths of both kinds."""

    def both(problem: Problem, effort: Effort, seed: int) -> Outcome:
        closed = replace(problem, beat=None)
        straight = beaten(problem, beat)
        bound_s = lower_bound_s(
            replace(straight, clearance_floor_m=problem.clearance_floor_m), tests=BOUND_TESTS)
        beating = search(straight, effort.part(BEAT_SHARE), seed)
        beating_s = math.inf
        if beating.waypoints_en is not None:
            judged = problem.evaluate(beating.waypoints_en)
            beating_s = judged.time_s if judged.is_feasible else math.inf
        if beating_s <= lower_bound_s(closed):
            return replace(beating, lower_bound_s=bound_s)
        sailing = search(closed, effort, seed)
        if sailing.waypoints_en is None:
            return sailing if math.isinf(beating_s) else replace(beating, lower_bound_s=bound_s)
        is_beating_faster = beating_s < problem.evaluate(sailing.waypoints_en).time_s
        best = beating if is_beating_faster else sailing
        return replace(best, lower_bound_s=min(bound_s, best.lower_bound_s))

    return both
