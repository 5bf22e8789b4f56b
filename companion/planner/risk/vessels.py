"""A path's risk from uncertain vessels: how often it is expected to enter the disc of hulls and clearance of any.

Over a whole path a vessel's error is one draw, not one at each instant: a ship that is late is late all the way. The
risk is the expected number of entries into its disc of hulls and clearance, first inside or later (Rice's formula,
``vessel_kernels``), which bounds the probability of any. Vessels and wind add up, by the union bound again.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from companion.planner.plan import Leg
from companion.planner.problem.parts import Target
from companion.planner.problem.sharing import uncertain
from companion.planner.problem.value import Problem
from companion.planner.risk import vessel_kernels as kernels

if TYPE_CHECKING:
    from companion.traffic.occupancy import Spread

PROMISE_FACTOR = 1.15
"""What is promised over what is computed: simulated futures scatter, and bends of a predicted track are chords."""


@dataclass(frozen=True, slots=True, kw_only=True)
class VesselRisk:
    """What vessels add to a path's risk: ``computed`` is the expected entries, ``total`` what is promised.

    ``worst_instant`` bounds the probability to be too near to any vessel at the worst instant; ``by_name`` has the
    promise of each vessel, ``legs`` of each leg.
    """

    computed: float = 0.0
    total: float = 0.0
    worst_instant: float = 0.0
    by_name: tuple[tuple[str, float], ...] = ()
    legs: tuple[float, ...] = ()


def vessel_risk(problem: Problem, legs: Sequence[Leg]) -> VesselRisk:
    """Return what the problem's uncertain vessels add to the risk of a path."""
    found = uncertain(problem.targets)
    if not found or not legs:
        return VesselRisk(legs=(0.0,) * len(legs))
    by_leg = np.zeros(len(legs))
    by_name: dict[str, float] = {}
    worst: dict[int, float] = {}
    for vessel in sorted({spread.vessel for _, spread in found}):
        windows = sorted(((t, s) for t, s in found if s.vessel == vessel), key=lambda w: w[0].from_s)
        entries, worst[vessel] = _walk(legs, windows, problem.beat.corridor_m if problem.beat is not None else 0.0)
        by_leg += entries
        name = windows[0][0].name or f"vessel {vessel}"
        by_name[name] = min(1.0, by_name.get(name, 0.0) + PROMISE_FACTOR * float(entries.sum()))
    computed = float(min(1.0, by_leg.sum()))
    return VesselRisk(
        computed=computed, total=min(1.0, PROMISE_FACTOR * computed), worst_instant=min(1.0, sum(worst.values())),
        by_name=tuple(sorted(by_name.items(), key=lambda n: -n[1])), legs=tuple(float(x) for x in by_leg),
    )


def _walk(
    legs: Sequence[Leg], windows: Sequence[tuple[Target, Spread]], wide_m: float,
) -> tuple[NDArray[np.float64], float]:
    """Return the expected entries on each leg, and the largest P(inside) of any instant, for one vessel.

    On a leg that the autopilot beats the boat may be ``wide_m`` off the line.
    """
    entries, worst, before, t = np.zeros(len(legs)), 0.0, -1.0, 0.0
    out = np.empty(3)
    for i, leg in enumerate(legs):
        span = leg.end_s - leg.start_s
        if not math.isfinite(span):
            break
        east, north = leg.to_en[0] - leg.from_en[0], leg.to_en[1] - leg.from_en[1]
        length = math.hypot(east, north)
        along = (east / length, north / length) if length > 1e-9 else (0.0, 1.0)
        way = (east / span, north / span) if span > 1e-9 else (0.0, 0.0)
        # The turn before the leg is made on the spot.
        for begin, end, velocity in ((t, leg.start_s, (0.0, 0.0)), (leg.start_s, leg.end_s, way)):
            for target, spread in windows:
                lo, hi = max(begin, target.from_s), min(end, target.until_s)
                if hi <= lo:
                    continue
                bx = leg.from_en[0] + velocity[0] * (lo - begin) - spread.x_m - target.vx_mps * lo
                by = leg.from_en[1] + velocity[1] * (lo - begin) - spread.y_m - target.vy_mps * lo
                kernels.piece(
                    lo, hi, bx, by, velocity[0] - target.vx_mps, velocity[1] - target.vy_mps, _errors(spread, along),
                    spread.keep_m + (wide_m if leg.is_beat else 0.0), before, out)
                entries[i] += out[0]
                before, worst = float(out[1]), max(worst, float(out[2]))
        t = leg.end_s
    return entries, worst


def _errors(spread: Spread, along: tuple[float, float]) -> NDArray[np.float64]:
    s, c = math.sin(spread.course_rad), math.cos(spread.course_rad)
    return np.array([
        [s, c, spread.along_m, spread.along_mps], [c, -s, spread.across_m, spread.across_mps],
        [along[0], along[1], 0.0, spread.own_mps],
    ])
