"""Energy over a passage: the sun's gain by its height, use by day and night, and what is left in the battery."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from companion.passage.frame import Floats, up_of
from companion.passage.kernels import sun
from companion.passage.replay import Sailed


@dataclass(frozen=True, slots=True, kw_only=True)
class Energy:
    """A battery of ``battery_wh``, ``start_wh`` of it when she departs, not to be below ``reserve_wh``.

    ``solar_w`` is what her panels give with the sun overhead (of a mean sky); with its height it is less as its sine.
    She uses ``day_w``, and ``night_w`` with the sun more than 6 degrees down.
    """

    battery_wh: float
    start_wh: float
    reserve_wh: float
    solar_w: float
    day_w: float
    night_w: float


def left_wh(energy: Energy, run: Sailed) -> Floats:
    """Return what is left in the battery at each row of a run [Wh]."""
    t = run.rows[:, 0]
    up = up_of(*run.places.T)
    height = np.array([max(0.0, float(np.dot(up[i], sun(float(s))))) for i, s in enumerate(t)])
    gain_w = energy.solar_w * height - np.where(run.rows[:, 5] > 0.5, energy.night_w, energy.day_w)
    hours = np.diff(t) / 3600.0
    left = np.empty(t.size)
    now = energy.start_wh
    for i in range(t.size):
        if i:
            # By the mean of both ends; a full battery takes no more.
            now = min(energy.battery_wh, now + 0.5 * float(gain_w[i - 1] + gain_w[i]) * float(hours[i - 1]))
        left[i] = now
    return left


def within(energy: Energy, run: Sailed) -> Sailed:
    """Return a run that ends where the battery is down to its reserve, or the run itself where it never is."""
    if not len(run.rows):
        return run
    left = left_wh(energy, run)
    low = np.flatnonzero(left < energy.reserve_wh)
    if not low.size:
        return run
    end = int(low[0])
    why = f"the battery is down to {energy.reserve_wh:g} Wh after {(run.rows[end, 0] - run.rows[0, 0]) / 3600.0:.0f} h"
    return replace(run, arrived=False, why=why, is_too_much=True, rows=run.rows[: end + 1])
