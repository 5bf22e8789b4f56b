"""Readings gathered into cells of equal time, for models that live on a grid of time."""

from __future__ import annotations

import math
from collections.abc import Iterator

from companion.geo.angles import wrap_pi
from companion.wind.estimators.estimator import gain

_EMPTY_CELLS_MAX = 400    # a gap longer than this many cells is a new beginning


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
        self.mean = 0.0            # [rad] the slow mean, on the line
        self.scatter = 0.01        # [rad²] of single readings about their cell
        self.speed = 0.0
        self.speed_variance = 1.0
        self._has_begun = False

    def add(
        self, dt_s: float, x_rad: float, speed_mps: float, weight: float, speed_weight: float,
    ) -> Iterator[float]:
        """Take a reading; yield the departures [rad] of the cells that it completes."""
        if not self._has_begun:
            self._has_begun = True
            self._slow = self.mean = x_rad
            self.speed = speed_mps
        self._clock_s += dt_s
        x = self._slow + wrap_pi(x_rad - self._slow)   # against a slow mean: one wild reading slips no turn
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
