"""Simulated winds that force a plan into the no-go zone: the independent check of what a plan promises."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from companion.geo.angles import wrap_pi
from companion.kernels.jit import kernel
from companion.planner.plan import Leg, Plan
from companion.planner.problem.sigma import NONE
from companion.planner.problem.value import Problem
from companion.planner.risk.chance_constraint import process_of
from companion.planner.risk.kernels import correlation, sigma_at


def simulate_entries(
    problem: Problem, plan: Plan | Sequence[Leg], *, winds: int = 2000, step_s: float = 0.5, seed: int = 0
) -> NDArray[np.int64]:
    """Return for each simulated wind the leg on which it first forces the boat into the no-go zone, or -1.

    The winds are exact draws of the assumed process every ``step_s`` seconds and at each leg's ends.
    """
    legs = plan.legs if isinstance(plan, Plan) else tuple(plan)
    hits = np.full(winds, -1, dtype=np.int64)
    p = process_of(problem)
    twa = [math.pi if leg.is_beat else wrap_pi(-leg.twa_rad) for leg in legs]  # a beat follows the wind
    if legs and p.model != NONE:
        simulate(
            np.array([leg.start_s for leg in legs], dtype=np.float64),
            np.array([leg.end_s for leg in legs], dtype=np.float64),
            np.array(twa, dtype=np.float64),
            float(problem.boat.no_go_half_rad),
            p.model,
            float(p.s0),
            float(p.s1),
            float(p.rho),
            float(p.tau),
            p.table_t,
            p.table_s,
            float(step_s),
            np.random.default_rng(seed),
            winds,
            hits,
        )
    return hits


@kernel
def simulate(  # type: ignore[no-untyped-def]
    start_s, end_s, twa_rad, half_rad, model, s0, s1, rho, tau, table_t, table_s, step_s, generator, count, hits
):
    """Fill hits[i] with the leg on which simulated wind i first forces the boat into the no-go zone, else -1.

    An independent check of ``first_passage``: exact draws of X every ``step_s`` seconds and at each leg's ends.
    """
    two_pi = 2.0 * math.pi
    for i in range(count):
        hits[i] = -1
        t = 0.0
        z = generator.standard_normal()
        for k in range(start_s.shape[0]):
            for phase in range(2):
                stop = start_s[k] if phase == 0 else end_s[k]
                at_start = phase == 1
                while t < stop or at_start:
                    if not at_start:
                        move = min(step_s, stop - t)
                        r = correlation(t, move, model, s0, s1, rho, tau, table_t, table_s)
                        z = r * z + math.sqrt(max(0.0, 1.0 - r * r)) * generator.standard_normal()
                        t = stop if move >= stop - t else t + move
                    at_start = False
                    if phase == 1:
                        x = z * sigma_at(t, model, s0, s1, rho, table_t, table_s)
                        off = (twa_rad[k] - x + math.pi) % two_pi - math.pi
                        if abs(off) < half_rad - 1e-9:
                            hits[i] = k
                            break
                if hits[i] >= 0:
                    break
            if hits[i] >= 0:
                break
