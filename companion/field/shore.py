"""Away from what stands still: a repulsive field about the mission's obstacles and its fence, whatever their shape."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from companion.field.algebra import REPULSIVE, Field, Vectors
from companion.field.values import Clearance

STEP_M = 0.5   # of the difference quotient
FAR_M = 1e5


@dataclass(frozen=True, slots=True)
class RepulsiveShore(Field):
    """Away from the nearest shore: length 20 exp(-(c / sigma)²) at the clearance c, Schmitt's repulsive line bent.

    The direction is the clearance's slope, of length 1 everywhere but on the lines that are equally far from two
    shores, where the two cancel.
    """

    clearance: Clearance
    sigma_m: float

    def evaluate(self, p: Vectors) -> Vectors:
        """Return the vectors (n, 2)."""
        n = len(p)
        east, north = np.array([STEP_M, 0.0]), np.array([0.0, STEP_M])
        # Open water has no shore and an endless clearance.
        places = np.vstack([p, p + east, p - east, p + north, p - north])
        c = np.minimum(self.clearance(places), FAR_M).reshape(5, n)
        slope = np.column_stack([c[1] - c[2], c[3] - c[4]]) / (2.0 * STEP_M)
        force = REPULSIVE * np.exp(-((np.maximum(c[0], 0.0) / self.sigma_m) ** 2))
        return np.asarray(force[:, None] * slope, dtype=np.float64)
