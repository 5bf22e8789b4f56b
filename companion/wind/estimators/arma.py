"""ARMA(2, 1) on 10 s means, its coefficients fitted online: the estimator that Wolsieffer's section 5 asks for.

    y_k = a1 y_{k-1} + a2 y_{k-2} + b e_{k-1} + e_k                                                    (a)

for the departure y from a slow mean. Recursive pseudo-linear regression with forgetting (Ljung and Söderström 1983,
RML1): the last innovation stands in for e_{k-1} in the regressor (y_{k-1}, y_{k-2}, e_{k-1}). The h-step variance
is s² Σ ψ_i² with ψ_0 = 1, ψ_1 = a1 + b, ψ_i = a1 ψ_{i-1} + a2 ψ_{i-2} (Hamilton 1994, chapter 4)           (b)
and tends to the variance of the process: the spread levels off.
"""

from __future__ import annotations

import math

import numpy as np

from companion.wind.estimators.cells import Cells
from companion.wind.estimators.estimator import Base

_STABLE = 0.995          # the AR part is kept inside this much of its stability triangle


class Arma(Base):
    """ARMA(2, 1) with forgetting over ``memory_s``."""

    name = "arma"

    def __init__(self, *, width_s: float = 10.0, memory_s: float = 1800.0, mean_s: float = 900.0) -> None:
        super().__init__()
        self._cells = Cells(width_s, mean_s)
        self._forget = math.exp(-width_s / memory_s)
        self._theta = np.array([0.9, 0.0, 0.0])
        self._p = np.eye(3) * 10.0
        self._y1 = self._y2 = self._e1 = 0.0
        self._variance = 0.05**2
        self._count = 0

    def _step(self, dt_s: float, x_rad: float, speed_mps: float, weight: float, speed_weight: float) -> None:
        for y in self._cells.add(dt_s, x_rad, speed_mps, weight, speed_weight):
            self._cell(y)

    def _cell(self, y: float) -> None:
        phi = np.array([self._y1, self._y2, self._e1])
        e = y - float(phi @ self._theta)                                              # (a)
        limit = 4.0 * math.sqrt(self._variance)
        robust = max(-limit, min(limit, e))
        gain = self._p @ phi / (self._forget + phi @ self._p @ phi)
        theta = self._theta + gain * robust
        self._p = (self._p - np.outer(gain, phi @ self._p)) / self._forget
        self._p *= min(1.0, 1e3 / float(np.trace(self._p)))    # no wind-up while nothing happens
        a2 = max(-_STABLE, min(_STABLE, float(theta[1])))
        a1 = max(-_STABLE * (1.0 - a2), min(_STABLE * (1.0 - a2), float(theta[0])))
        self._theta = np.array([a1, a2, max(-_STABLE, min(_STABLE, float(theta[2])))])
        self._count += 1
        share = max(1.0 - self._forget, 1.0 / (self._count + 5.0))
        self._variance += share * (robust * robust - self._variance)
        self._y2, self._y1, self._e1 = self._y1, y, robust

    def _predict(self, horizon_s: float) -> tuple[float, float, float, float]:
        a1, a2, b = self._theta.tolist()
        steps = max(1.0, horizon_s / self._cells.width_s)
        whole = int(steps)
        m1, m2 = self._y1, self._y2
        mean_before = m1
        psi1, psi2, total, before = 0.0, 0.0, 0.0, 0.0
        for i in range(whole + 1):
            mean_before, before = m1, total
            m1, m2 = a1 * m1 + a2 * m2 + (b * self._e1 if i == 0 else 0.0), m1             # (a)
            psi = 1.0 if i == 0 else a1 * psi1 + a2 * psi2 + (b if i == 1 else 0.0)       # (b)
            psi1, psi2 = psi, psi1
            total += psi * psi
        part = steps - whole
        y = mean_before + part * (m1 - mean_before)
        variance = self._variance * (before + part * (total - before)) + self._cells.scatter
        return self._cells.mean + y, math.sqrt(variance), self._cells.speed, self._cells.sigma_speed

    @property
    def correlation_time_s(self) -> float:
        """From the largest root of the AR part [s]."""
        a1, a2, _ = self._theta.tolist()
        root = max(abs(complex(r)) for r in np.roots([1.0, -a1, -a2]))
        return self._cells.width_s / -math.log(min(0.9999, max(1e-3, root)))
