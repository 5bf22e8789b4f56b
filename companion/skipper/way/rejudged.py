"""A plan that is there, held against what is known today: the chance that a tack fails, the current, the wind.

A plan was within what the mission allows when it was made. Since then tacks have failed, or a current was told. What
is there stays for being there only while it is within that still.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from companion.planner import Leg, Problem
from companion.planner.problem import evaluate
from companion.planner.risk import of_risky, path_risk, tacks_at_risk
from companion.skipper.way.voyage import PointEn


def is_riskier(problem: Problem, old: Sequence[Leg], new: Sequence[Leg]) -> bool:
    """Return whether the old legs are too risky to stay beside the new ones.

    That is above the limit on a path's risk, where the mission has one; or with tacks that may bring her onto
    something when they fail, where the new legs have fewer or less likely ones.
    """
    before = of_risky(tacks_at_risk(problem, old))
    return _over_limit(problem, old) > 0.0 or (before > 0.0 and of_risky(tacks_at_risk(problem, new)) < before)


def is_begun_risky(problem: Problem, legs: Sequence[Leg]) -> bool:
    """Return whether the turn that begins the legs is a tack that may bring her onto something when it fails."""
    return any(tack.is_risky and tack.leg == 0 and not legs[0].is_beat for tack in tacks_at_risk(problem, legs))


def too_risky(problem: Problem, way: Sequence[PointEn], *, heading_rad: float) -> str:
    """Return what of a way that begins elsewhere than the problem is too great a risk, in words; empty: nothing."""
    here = replace(problem, start_en=way[0], start_heading_rad=heading_rad)
    legs = evaluate(here, np.asarray(way)).legs
    over = _over_limit(here, legs)
    if over > 0.0:
        return f"its risk of {100.0 * over:.2g} % is above the limit"
    touches = of_risky(tacks_at_risk(here, legs))
    return f"tacks of it that fail would bring her onto something: {100.0 * touches:.2g} %" if touches > 0.0 else ""


def _over_limit(problem: Problem, legs: Sequence[Leg]) -> float:
    """Return the risk of legs that is above the limit on a path's; 0: within it, or there is none."""
    total = 0.0 if problem.risk is None else path_risk(problem, legs).total
    return total if problem.risk is not None and total > problem.risk.max_path_risk else 0.0
