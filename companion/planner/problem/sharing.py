"""One promise for the wind and for uncertain vessels: the share of each, and the vessels' discs.

A ``Target`` with a ``spread`` is the prediction of a vessel, not a region: how far to keep away follows from what is
promised. One promise, 1 - delta_s at each instant, covers the wind and the vessels, by the union bound (Boole):

    1 - delta_s = (1 - wind_delta_s) + vessels_part

with ``vessels_part`` split evenly over the vessels in force (Luders, Kothari and How 2010 split theirs evenly over
obstacles). The wind's part widens the no-go zone (Wolsieffer 2020, eq. 15), a vessel's part r makes its disc hulls,
clearance and Phi^-1(1 - r) sigma wide: a boat outside it is met with probability r at most (``tail_factor``). Without
uncertain targets all of it is the wind's, as the problem's format has it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from typing import TYPE_CHECKING

from companion.planner.problem.parts import Target
from companion.planner.problem.value import Problem

if TYPE_CHECKING:
    from companion.traffic.occupancy import Spread

LEAST_PART = 1e-12


def uncertain(targets: Sequence[Target]) -> tuple[tuple[Target, Spread], ...]:
    """Return the targets that are predictions, with their spreads."""
    return tuple((t, t.spread) for t in targets if t.spread is not None)


def vessel_count(targets: Sequence[Target]) -> int:
    """Return how many uncertain vessels are in force."""
    return len({spread.vessel for _, spread in uncertain(targets)})


def sigmas_for(part: float, vessels: int) -> float:
    """Return how many standard deviations a disc is wide when ``vessels`` share ``part``; 0 without vessels."""
    if vessels == 0:
        return 0.0
    from companion.traffic.predict import tail_factor

    return tail_factor(min(0.5, max(part / vessels, LEAST_PART)))


def sized(targets: Sequence[Target], sigmas: float) -> tuple[Target, ...]:
    """Return the targets as regions: the uncertain ones with ``sigmas`` standard deviations added to their radius."""
    return tuple(
        t if t.spread is None else replace(
            t, radius_m=t.radius_m + sigmas * t.spread.sigma_m, growth_mps=t.growth_mps + sigmas * t.spread.sigma_mps,
            spread=None)
        for t in targets
    )


@lru_cache(maxsize=16)   # a search asks again and again; problems are the same by identity
def resolved(problem: Problem) -> Problem:
    """Return the same with its promise shared out: the wind's delta_s, and uncertain targets as discs of their size."""
    if not problem.is_shared:
        return problem
    sigmas = sigmas_for(problem.vessels_share, vessel_count(problem.targets))
    return replace(problem, delta_s=problem.wind_delta_s, targets=sized(problem.targets, sigmas), vessels_part=None)
