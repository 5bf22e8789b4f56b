"""Büsser's means: the last 90 s for the planner, the last 5 s for the helmsman.

Büsser 2009, section 3.1.1: the path planner's wind "can be assumed constant over time", an average of 90 s; the
controller follows one of 5 s. The vector mean of the window is the forecast at every horizon. The papers give it no
spread; here it is the rms of the mean's own past errors at that horizon, learned as they come due.
"""

from __future__ import annotations

import math
from collections import deque

from companion.geo.angles import wrap_pi
from companion.wind.estimators.estimator import Base

_KNOTS_S = (3.0, 10.0, 30.0, 60.0, 120.0, 300.0, 600.0, 1200.0, 3600.0)
_EVERY_S = 5.0
_MEMORY_S = 3600.0
_FIRST_RAD = 0.22  # [rad] expected rms error at 60 s before any has been seen, growing as h^0.25
_FIRST_MPS = 0.8
_ERROR_MAX_RAD = 1.5
_NOTHING = 1e-6  # what rounding leaves of sums that are empty


class RollingMean(Base):
    """Vector mean over ``window_s``, spread from its own errors."""

    name = "mean90"

    def __init__(self, *, window_s: float = 90.0) -> None:
        super().__init__()
        self.name = f"mean{window_s:g}"
        self._window_s = window_s
        # (time, sin, cos, speed, its weight); readings closer than a 400th of the window share a place.
        self._window: deque[tuple[float, float, float, float, float]] = deque(maxlen=512)
        self._sums = [0.0, 0.0, 0.0, 0.0]
        self._appended = 0
        self._clock_s = 0.0
        self._mean, self._speed = 0.0, 0.0
        self._kept: deque[tuple[float, float, float]] = deque(maxlen=int(_KNOTS_S[-1] / _EVERY_S) + 8)
        self._dropped = 0  # rows that have left ``_kept``
        self._next = [0] * len(_KNOTS_S)  # absolute number of the next row to score
        self._square = [0.0] * len(_KNOTS_S)
        self._square_speed = [0.0] * len(_KNOTS_S)
        self._weight = [0.0] * len(_KNOTS_S)

    def _step(self, dt_s: float, x_rad: float, speed_mps: float, weight: float, speed_weight: float) -> None:
        self._clock_s += dt_s
        now = self._clock_s
        self._score(x_rad, speed_mps, weight)
        if weight <= 0.0 and speed_weight <= 0.0:
            return
        new = (now, weight * math.sin(x_rad), weight * math.cos(x_rad), speed_weight * speed_mps, speed_weight)
        if len(self._window) > 1 and now - self._window[-2][0] < self._window_s / 400.0:
            _, s, c, v, w = self._window.pop()
            new = (now, new[1] + s, new[2] + c, new[3] + v, new[4] + w)
            self._sums = [a - b for a, b in zip(self._sums, (s, c, v, w), strict=True)]
        self._window.append(new)
        self._sums = [a + b for a, b in zip(self._sums, new[1:], strict=True)]
        while len(self._window) > 1 and self._window[0][0] <= now - self._window_s:
            old = self._window.popleft()
            self._sums = [a - b for a, b in zip(self._sums, old[1:], strict=True)]
        self._appended += 1
        if self._appended % 1000 == 0:  # what rounding has left behind
            self._sums = [sum(row[i] for row in self._window) for i in range(1, 5)]
        s, c, v, w = self._sums
        # A window without a direction, or without a speed, keeps the last.
        if math.hypot(s, c) > _NOTHING:
            self._mean = math.atan2(s, c)
        if w > _NOTHING:
            self._speed = v / w
        if not self._kept or now - self._kept[-1][0] >= _EVERY_S - 1e-6:
            if len(self._kept) == self._kept.maxlen:
                self._dropped += 1
            self._kept.append((now, self._mean, self._speed))

    def _score(self, x_rad: float, speed_mps: float, weight: float) -> None:
        for j, h in enumerate(_KNOTS_S):
            row = max(self._next[j], self._dropped)
            while row - self._dropped < len(self._kept):
                then_s, mean, speed = self._kept[row - self._dropped]
                late_s = self._clock_s - then_s - h
                if late_s < -1e-6:
                    break
                if late_s <= max(2.05, 0.15 * h) and weight >= 0.5:
                    keep = math.exp(-_EVERY_S / (_MEMORY_S + 2.0 * h))
                    error = min(_ERROR_MAX_RAD, abs(wrap_pi(x_rad - mean)))
                    self._square[j] = keep * self._square[j] + _EVERY_S * error**2
                    self._square_speed[j] = keep * self._square_speed[j] + _EVERY_S * (speed_mps - speed) ** 2
                    self._weight[j] = keep * self._weight[j] + _EVERY_S
                row += 1
            self._next[j] = row

    def _predict(self, horizon_s: float) -> tuple[float, float, float, float]:
        h = max(horizon_s, _KNOTS_S[0])
        j = max(i for i in range(len(_KNOTS_S) - 1) if _KNOTS_S[i] <= h)
        f = min(1.0, math.log(h / _KNOTS_S[j]) / math.log(_KNOTS_S[j + 1] / _KNOTS_S[j]))
        (a, va), (b, vb) = self._rms(j), self._rms(j + 1)
        return self._mean, a + f * (b - a), self._speed, va + f * (vb - va)

    def _rms(self, j: int) -> tuple[float, float]:
        h = _KNOTS_S[j]
        weight = 60.0 + 2.0 * h
        growth = (h / 60.0) ** 0.5
        total = self._weight[j] + weight
        return (
            math.sqrt((self._square[j] + weight * _FIRST_RAD**2 * growth) / total),
            math.sqrt((self._square_speed[j] + weight * _FIRST_MPS**2 * growth) / total),
        )
