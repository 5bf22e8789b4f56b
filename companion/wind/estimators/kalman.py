"""Wolsieffer's innovation-adaptive Kalman filter (2020, section 3.1, after Mohamed and Schwarz 1999).

State (s, φ): wind speed and direction (1); both are measured directly and expected to stay, so A = H = I:

    P⁻ = P + Q    (2)      K = P⁻ (P⁻ + R)⁻¹   (3)      v = z − w         (4)
    w = w + K v   (5)      P = (I − K) P⁻      (6)
    Q = K C Kᵀ    (7)      C = 1/N Σ v vᵀ over the last N innovations     (8)

Forecasts are the filter's open-loop propagation: the mean stays and P grows by Q per sample, linearly and without
bound. Everything is per sample, as in the paper, so the spread depends on the sampling rate; ``h / dt`` steps are
taken with dt the running mean of the step. The filter is the peer to beat, not the default.
"""

from __future__ import annotations

import math
from collections import deque

import numpy as np
from numpy.typing import NDArray

from companion.geo.angles import wrap_pi
from companion.wind.estimators.estimator import Base

WINDOW, R_DEG, R_MPS = 100, 3.0, 0.5  # of a mission that says nothing; the paper gives none of them


class AdaptiveKalman(Base):
    """The filter with window ``n`` [samples], direction noise ``r_deg`` [deg] and speed noise ``r_mps`` [m/s]."""

    name = "kalman"

    def __init__(self, *, n: int = WINDOW, r_deg: float = R_DEG, r_mps: float = R_MPS) -> None:
        super().__init__()
        # filterpy brings scipy.stats: 60 MB that only this estimator needs
        from filterpy.kalman import KalmanFilter

        self._filter = KalmanFilter(dim_x=2, dim_z=2)
        self._filter.F, self._filter.H = np.eye(2), np.eye(2)
        self._filter.R = np.diag([r_mps**2, math.radians(r_deg) ** 2])
        self._filter.P = self._filter.R.copy()
        self._filter.Q = np.zeros((2, 2))
        self._window: deque[NDArray[np.float64]] = deque(maxlen=n)
        self._sum = np.zeros((2, 2))
        self._dt_s = 1.0

    def _step(self, dt_s: float, x_rad: float, speed_mps: float, weight: float, speed_weight: float) -> None:
        kf = self._filter
        if dt_s == 0.0:
            kf.x = np.array([[speed_mps], [x_rad]])  # (1)
            return
        if weight <= 0.0 and speed_weight <= 0.0:
            return
        self._dt_s += 0.01 * (dt_s - self._dt_s)
        kf.predict()  # (2)
        # The innovation goes the short way round the circle; a speed without a direction is no news of that.
        turned = wrap_pi(x_rad - kf.x[1, 0]) if weight > 0.0 else 0.0
        z = np.array([[speed_mps], [kf.x[1, 0] + turned]])
        kf.update(z)  # (3) to (6)
        outer = kf.y @ kf.y.T
        if len(self._window) == self._window.maxlen:
            self._sum -= self._window[0]
        self._window.append(outer)
        self._sum += outer
        kf.Q = kf.K @ (self._sum / len(self._window)) @ kf.K.T  # (7), (8)

    def _predict(self, horizon_s: float) -> tuple[float, float, float, float]:
        kf = self._filter
        p = kf.P + (horizon_s / self._dt_s) * kf.Q  # (2), open loop
        return (
            float(kf.x[1, 0]),
            math.sqrt(max(1e-10, float(p[1, 1]))),
            float(kf.x[0, 0]),
            math.sqrt(max(1e-6, float(p[0, 0]))),
        )
