"""AR(1) with GARCH(1, 1) innovations on 10 s means: wind whose restlessness comes and goes.

    y_k = φ y_{k-1} + e_k,    s²_{k+1} = v (1 − α − β) + α e_k² + β s²_k                                (a)

Bollerslev 1986, equation 1, with variance targeting: v is the running variance of e. (α, α + β) is the pair of a
small grid with the best discounted Gaussian likelihood. For i steps ahead (his section 3)

    E s²_{k+i} = v + (α + β)^{i-1} (s²_{k+1} − v),    var y_{k+n} = Σ φ^{2(n−i)} E s²_{k+i}.                (b)
"""

from __future__ import annotations

import math

from companion.wind.estimators.cells import Cells
from companion.wind.estimators.estimator import Base

_GRID = tuple((alpha, alpha_beta) for alpha in (0.02, 0.05, 0.1, 0.2, 0.3) for alpha_beta in (0.7, 0.9, 0.97))


class Garch(Base):
    """AR(1)-GARCH(1, 1) with forgetting over ``memory_s``."""

    name = "garch"

    def __init__(self, *, width_s: float = 10.0, memory_s: float = 1800.0, mean_s: float = 900.0) -> None:
        super().__init__()
        self._cells = Cells(width_s, mean_s)
        self._forget = math.exp(-width_s / memory_s)
        self._y1 = 0.0
        first = 0.2**2
        self._xx, self._xy = first, 0.9 * first
        self._variance = 0.06**2
        self._next = [self._variance] * len(_GRID)     # s²_{k+1} of each pair
        self._likelihood = [0.0] * len(_GRID)
        self._count = 0

    def _step(self, dt_s: float, x_rad: float, speed_mps: float, weight: float, speed_weight: float) -> None:
        for y in self._cells.add(dt_s, x_rad, speed_mps, weight, speed_weight):
            self._cell(y)

    def _cell(self, y: float) -> None:
        e = y - self._phi * self._y1
        limit = 4.0 * math.sqrt(self._variance)
        square = min(limit, abs(e)) ** 2
        self._count += 1
        share = max(1.0 - self._forget, 1.0 / (self._count + 20.0))
        for i, (alpha, alpha_beta) in enumerate(_GRID):
            s2 = self._next[i]
            self._likelihood[i] = self._forget * self._likelihood[i] - 0.5 * (math.log(s2) + square / s2)
            self._next[i] = max(
                1e-8, self._variance * (1.0 - alpha_beta) + alpha * square + (alpha_beta - alpha) * s2,
            )                                                                            # (a)
        self._variance += share * (square - self._variance)
        self._xx += share * (self._y1 * self._y1 - self._xx)
        self._xy += share * (self._y1 * y - self._xy)
        self._y1 = y

    @property
    def _phi(self) -> float:
        return min(0.9995, max(0.0, self._xy / max(1e-9, self._xx)))

    def _predict(self, horizon_s: float) -> tuple[float, float, float, float]:
        best = max(range(len(_GRID)), key=lambda i: self._likelihood[i])
        fade, excess = _GRID[best][1], self._next[best] - self._variance
        phi = self._phi
        n = max(1.0, horizon_s / self._cells.width_s)
        # (b) summed: the steady part, and the excess as a geometric series in the ratio of fade to phi squared.
        p2 = phi * phi
        steady = self._variance * (1.0 - p2**n) / (1.0 - p2)
        extra = excess * (n * p2 ** (n - 1.0) if abs(fade - p2) < 1e-6 else (fade**n - p2**n) / (fade - p2))
        variance = max(1e-8, steady + extra) + self._cells.scatter
        mean = self._cells.mean + phi**n * self._y1
        return mean, math.sqrt(variance), self._cells.speed, self._cells.sigma_speed

    @property
    def correlation_time_s(self) -> float:
        """-width / ln φ [s]."""
        return min(3600.0, self._cells.width_s / -math.log(max(1e-3, self._phi)))
