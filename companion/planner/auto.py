"""``auto``: the search that is to be used (being built)."""

from __future__ import annotations

from companion.planner.problem import Problem
from companion.planner.solve import Effort, Outcome


def search(problem: Problem, effort: Effort, seed: int) -> Outcome:  # noqa: ARG001
    """Return the best path found within ``effort``."""
    return Outcome(waypoints_en=None)
