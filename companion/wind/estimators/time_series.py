"""ARMA(2, 1) on 10 s means, its coefficients fitted online: the estimator that Wolsieffer's section 5 asks for.

    y_k = a1 y_{k-1} + a2 y_{k-2} + b e_{k-1} + e_k                                                    (a)

for the departure y from a slow mean. Recursive pseudo-linear regression with forgetting (Ljung and Söderström 1983,
RML1): the last innovation stands in for e_{k-1} in the regressor (y_{k-1}, y_{k-2}, e_{k-1}). The h-step variance
is s² Σ ψ_i² with ψ_0 = 1, ψ_1 = a1 + b, ψ_i = a1 ψ_{i-1} + a2 ψ_{i-2} (Hamilton 1994, chapter 4)           (b)
and tends to the variance of the process: the spread levels off.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from companion.geo.angles import wrap_pi
from companion.wind.estimators.estimator import Base, gain

_EMPTY_CELLS_MAX = 400  # a gap longer than this many cells is a new beginning


class Cells:
    """Means of ``width_s`` of the departure from a slow mean, unwrapped, whatever the sampling rate.

    ``add`` yields one mean for each cell that is complete; cells without a reading repeat the last (ZOH).
    """

    def __init__(self, width_s: float, mean_s: float) -> None:
        self.width_s, self._mean_s = width_s, mean_s
        self._clock_s = 0.0
        self._end_s = width_s
        self._sum = self._weight = 0.0
        self._last = 0.0
        self._slow = 0.0
        self._seen_s = 0.0
        self.mean = 0.0  # [rad] the slow mean, on the line
        self.scatter = 0.01  # [rad²] of single readings about their cell
        self.speed = 0.0
        self.speed_variance = 1.0
        self._has_begun = False

    def add(self, dt_s: float, x_rad: float, speed_mps: float, weight: float, speed_weight: float) -> Iterator[float]:
        """Take a reading; yield the departures [rad] of the cells that it completes."""
        if not self._has_begun:
            self._has_begun = True
            self._slow = self.mean = x_rad
            self.speed = speed_mps
        self._clock_s += dt_s
        x = self._slow + wrap_pi(x_rad - self._slow)  # against a slow mean: one wild reading slips no turn
        if self._clock_s - self._end_s > _EMPTY_CELLS_MAX * self.width_s:
            self._end_s = self._clock_s
            self._sum = self._weight = 0.0
        while self._clock_s >= self._end_s:
            if self._weight > 0.0:
                self._last = self._sum / self._weight
            yield self._last - self.mean
            self._sum = self._weight = 0.0
            self._end_s += self.width_s
        deviation = speed_mps - self.speed
        self.speed += speed_weight * gain(dt_s, 20.0) * deviation
        self.speed_variance += speed_weight * gain(dt_s, 600.0) * (deviation**2 - self.speed_variance)
        if weight <= 0.0:
            return
        self._seen_s += dt_s
        self._sum += weight * x
        self._weight += weight
        self._slow += weight * gain(dt_s, 60.0) * (x - self._slow)
        self.mean += weight * gain(dt_s, min(self._mean_s, max(30.0, self._seen_s))) * (x - self.mean)
        within = x - self._sum / self._weight
        self.scatter += weight * gain(dt_s, 600.0) * (min(1.0, within * within) - self.scatter)

    @property
    def sigma_speed(self) -> float:
        """Spread of single speed readings about the 20 s mean [m/s]."""
        return math.sqrt(max(0.01, self.speed_variance))


_STABLE = 0.995  # the AR part is kept inside this much of its stability triangle
_NOTHING = 1e-12  # of a departure [rad] and of a weight: what comes after it changes no forecast


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
        e = y - float(phi @ self._theta)  # (a)
        limit = 4.0 * math.sqrt(self._variance)
        robust = max(-limit, min(limit, e))
        gain = self._p @ phi / (self._forget + phi @ self._p @ phi)
        theta = self._theta + gain * robust
        self._p = (self._p - np.outer(gain, phi @ self._p)) / self._forget
        self._p *= min(1.0, 1e3 / float(np.trace(self._p)))  # no wind-up while nothing happens
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
            m1, m2 = a1 * m1 + a2 * m2 + (b * self._e1 if i == 0 else 0.0), m1  # (a)
            psi = 1.0 if i == 0 else a1 * psi1 + a2 * psi2 + (b if i == 1 else 0.0)  # (b)
            psi1, psi2 = psi, psi1
            total += psi * psi
            if max(abs(m1), abs(m2), abs(psi1), abs(psi2)) < _NOTHING:
                break  # at the mean: a silence of days is no longer sum than one of hours
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


# AR(1) with GARCH(1, 1) innovations on 10 s means: wind whose restlessness comes and goes.
#
#     y_k = φ y_{k-1} + e_k,    s²_{k+1} = v (1 − α − β) + α e_k² + β s²_k                                (a)
#
# Bollerslev 1986, equation 1, with variance targeting: v is the running variance of e. (α, α + β) is the pair of a
# small grid with the best discounted Gaussian likelihood. For i steps ahead (his section 3)
#
#     E s²_{k+i} = v + (α + β)^{i-1} (s²_{k+1} − v),    var y_{k+n} = Σ φ^{2(n−i)} E s²_{k+i}.                (b)

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
        self._next = [self._variance] * len(_GRID)  # s²_{k+1} of each pair
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
                1e-8, self._variance * (1.0 - alpha_beta) + alpha * square + (alpha_beta - alpha) * s2
            )  # (a)
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
