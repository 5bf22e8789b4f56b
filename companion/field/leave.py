"""Out of some water: the heading by which a boat is soonest outside, clear of who is in the way (WRSC 2013)."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry import Polygon

from companion.field.algebra import NOMINAL, Field, Vectors
from companion.field.look_ahead import crosses_ahead, foresee, margins
from companion.field.values import Habits, Situation
from companion.geo.angles import wrap_pi

AHEAD_S = 25.0        # what crossing ahead of a vessel is held to cost, at its bow
AGAIN_S = 8.0         # what changing one's mind costs: half a turn twice as much
CLEAR_M = 10.0        # outside every vessel's disc nothing is added
LOOK_S, MOST_LOOK_S = 150.0, 1800.0
BEYOND_M = 5.0        # outside is so far outside
FAN_RAD = np.radians(np.arange(0.0, 360.0, 10.0))
PINCH_RAD = math.radians(4.0)


def way_out_rad(seen: Situation, water: Polygon, habits: Habits, last_rad: float | None = None) -> float:
    """Return the heading by which the boat is soonest outside of ``water``, on a course that keeps clear of vessels.

    ``last_rad`` is the one that was chosen before: another must be better by more than a trifle.
    """
    fan: NDArray[np.float64] = FAN_RAD
    if habits.is_sailing and seen.twd_from_rad is not None:
        twa = np.abs((seen.twd_from_rad - fan + math.pi) % (2.0 * math.pi) - math.pi)
        fan = fan[twa > habits.no_go_half_rad + PINCH_RAD]
    size_m = math.hypot(water.bounds[2] - water.bounds[0], water.bounds[3] - water.bounds[1])
    look_s = min(MOST_LOOK_S, max(LOOK_S, 1.5 * size_m / max(*habits.polar_mps, 0.3)))
    track, _ = foresee(fan, seen.twd_from_rad if habits.is_sailing else None, seen, replace(habits, horizon_s=look_s))
    outside = ~shapely.contains_xy(shapely.buffer(water, BEYOND_M, join_style="mitre"), track[:, :, 0], track[:, :, 1])
    step_s = look_s / max(1, track.shape[1] - 1)
    cost = np.where(outside.any(axis=1), outside.argmax(axis=1), outside.shape[1]) * step_s
    if seen.obstacles:
        margin = margins(track, seen.obstacles)
        cost = cost + np.where(margin < CLEAR_M, 20.0 * (CLEAR_M - np.maximum(margin, -20.0)) / CLEAR_M, 0.0)
        cost = cost + AHEAD_S * crosses_ahead(track, seen.obstacles)
    if last_rad is not None:
        cost = cost + AGAIN_S * (1.0 - np.cos(fan - last_rad))
    return wrap_pi(float(fan[int(np.argmin(cost))]))


@dataclass(frozen=True, slots=True)
class WayOut(Field):
    """The way out of some water from each place in it, a nominal field: as ``way_out_rad`` finds it for a boat there.

    With ``at_rad`` the same heading everywhere: the one that was found for the boat. Outside it has no value.
    """

    water: Polygon
    seen: Situation
    habits: Habits
    at_rad: float | None = None

    def evaluate(self, p: Vectors) -> Vectors:
        """Return the vectors (n, 2)."""
        inside = shapely.contains_xy(shapely.buffer(self.water, BEYOND_M), p[:, 0], p[:, 1])
        headings = np.zeros(len(p)) if self.at_rad is None else np.full(len(p), self.at_rad)
        for i in np.flatnonzero(inside) if self.at_rad is None else ():
            here = replace(self.seen, en_m=(float(p[i, 0]), float(p[i, 1])), velocity_en_mps=(0.0, 0.0))
            headings[i] = way_out_rad(here, self.water, self.habits)
        return np.where(inside[:, None], NOMINAL * np.column_stack([np.sin(headings), np.cos(headings)]), 0.0)
