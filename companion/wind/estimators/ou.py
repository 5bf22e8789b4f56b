"""The Ornstein-Uhlenbeck process (AR(1) in continuous time), its parameters fitted online.

Wolsieffer 2020, equation 17, is its Euler step; its own section 5 names an estimator of this kind as the remedy
for a Kalman filter whose spread grows without bound. With departure y from a slow mean,

    dy = -rho y dt + s dW,    E[y(t+h)] = y(t) e^(-rho h),    var = v (1 - e^(-2 rho h)),  v = s^2 / (2 rho).    (a)

rho comes from the regression of y(t) on y(t - lag), phi = e^(-rho lag), with exponential forgetting; a lag of 10 s
passes over the instrument's own noise.
"""

from __future__ import annotations

import math
from collections import deque

from companion.geo.angles import wrap_pi
from companion.wind.estimators.estimator import Base, gain

_PHI_MIN, _PHI_MAX = 1e-3, 0.9999
_FIRST_VARIANCE = math.radians(12.0) ** 2  # [rad²] spread of direction in ten minutes, before any is seen
_CELL_S = 1.0  # [s] resolution of the remembered past


class OrnsteinUhlenbeck(Base):
    """OU about a slow mean; ``lag_s`` of the regression, ``mean_s`` of the slow mean, ``memory_s`` of the fit."""

    name = "ou"

    def __init__(self, *, lag_s: float = 10.0, mean_s: float = 900.0, memory_s: float = 1800.0) -> None:
        super().__init__()
        self._lag_s, self._mean_s, self._memory_s = lag_s, mean_s, memory_s
        self._past: deque[tuple[float, float]] = deque(maxlen=int(4 * lag_s / _CELL_S) + 8)
        self._clock_s = 0.0
        self._slow = self._mean = self._last = 0.0
        self._seen_s = 0.0
        self._xx, self._xy, self._yy = _FIRST_VARIANCE, _FIRST_VARIANCE * math.exp(-lag_s / 120.0), _FIRST_VARIANCE
        self._speed = self._speed_variance = 0.0

    def _step(self, dt_s: float, x_rad: float, speed_mps: float, weight: float, speed_weight: float) -> None:
        if dt_s == 0.0:
            self._slow = self._mean = self._last = x_rad
            self._speed, self._speed_variance = speed_mps, max(0.25, 0.1 * speed_mps) ** 2
            self._past.append((0.0, x_rad))
            return
        self._clock_s += dt_s
        deviation = speed_mps - self._speed
        self._speed += speed_weight * gain(dt_s, 20.0) * deviation
        self._speed_variance += speed_weight * gain(dt_s, 600.0) * (deviation**2 - self._speed_variance)
        if weight <= 0.0:
            return
        # Unwrap against a slow mean, never against the last reading: one wild reading must not slip a turn.
        x = self._slow + wrap_pi(x_rad - self._slow)
        self._seen_s += dt_s
        self._slow += weight * gain(dt_s, 60.0) * (x - self._slow)
        # A young mean is a plain average, later exponential.
        self._mean += weight * gain(dt_s, min(self._mean_s, max(30.0, self._seen_s))) * (x - self._mean)
        self._last += weight * gain(dt_s, 1.5) * (x - self._last)
        while len(self._past) > 1 and self._past[1][0] <= self._clock_s - self._lag_s + 0.5 * _CELL_S:
            self._past.popleft()
        then_s, then = self._past[0]
        if abs(self._clock_s - then_s - self._lag_s) <= 0.2 * self._lag_s + 0.5 * _CELL_S:
            y0, y1 = then - self._mean, x - self._mean
            g = weight * gain(dt_s, self._memory_s)
            self._xx += g * (y0 * y0 - self._xx)
            self._xy += g * (y0 * y1 - self._xy)
            self._yy += g * (y1 * y1 - self._yy)
        if self._clock_s - self._past[-1][0] >= _CELL_S:
            self._past.append((self._clock_s, x))

    @property
    def rate_hz(self) -> float:
        """The fitted rho [1/s]."""
        phi = min(_PHI_MAX, max(_PHI_MIN, self._xy / max(1e-12, self._xx)))
        return -math.log(phi) / self._lag_s

    @property
    def correlation_time_s(self) -> float:
        """1 / rho [s]."""
        return 1.0 / self.rate_hz

    def _predict(self, horizon_s: float) -> tuple[float, float, float, float]:
        rho = self.rate_hz
        keep = math.exp(-rho * horizon_s)
        mean = self._mean + (self._last - self._mean) * keep  # (a)
        variance = max(1e-8, self._yy * (1.0 - keep * keep))  # (a)
        return mean, math.sqrt(variance), self._speed, math.sqrt(max(0.01, self._speed_variance))
