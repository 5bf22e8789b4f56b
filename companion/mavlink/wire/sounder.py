"""The sounder: the water's depth and how it changes, from pings of which some are wrong.

Weed, air and a fish give one ping or two that no other agrees with: the middle one of the last few is believed. A ping
that is zero, or at the end of what the sounder reaches, tells no depth.
"""

from __future__ import annotations

import math
from collections import deque
from statistics import fmean, median

PINGS = 5  # of which the middle one is believed: two in a row may be wrong
AGREE = 3  # so many must be within these of the middle one, or nothing is believed
NEAR_M, NEAR_SHARE = 0.4, 0.1
FRESH_S = 5.0  # older pings are of other water
WINDOW_S = 6.0  # over which the change is told: longer, and a slope that begins is told too late ...
LEAST_S = 4.0  # ... once there is so much of it


class Sounder:
    """Pings as they come: the depth below the sounder, and its change, negative where it shoals."""

    def __init__(self) -> None:
        self._pings: deque[tuple[float, float]] = deque(maxlen=PINGS)
        self._depths: deque[tuple[float, float]] = deque(maxlen=256)

    def take(self, t_s: float, depth_m: float, least_m: float, most_m: float) -> None:
        """Take a ping; the sounder tells depths between ``least_m`` and ``most_m``."""
        if not (math.isfinite(depth_m) and max(0.0, least_m) < depth_m < most_m):
            return
        self._pings.append((t_s, depth_m))
        depth = self.depth_m(t_s)
        if depth is not None:
            self._depths.append((t_s, depth))
        while self._depths and t_s - self._depths[0][0] > WINDOW_S:
            self._depths.popleft()

    def depth_m(self, t_s: float) -> float | None:
        """Return the depth [m], None where no three pings of the last seconds agree on one.

        What is between the sounder and the bottom is told now here, now there; the bottom is where it was.
        """
        fresh = [depth for at_s, depth in self._pings if t_s - at_s <= FRESH_S]
        if len(fresh) < AGREE:
            return None
        middle = median(fresh)
        near = sum(abs(depth - middle) <= NEAR_M + NEAR_SHARE * middle for depth in fresh)
        return middle if near >= AGREE else None

    def rate_mps(self, t_s: float) -> float | None:
        """Return how the depth changes at least [m/s]: straight through what was told, less the standard error of that.

        None while too little is told.
        """
        if self.depth_m(t_s) is None or self._depths[-1][0] - self._depths[0][0] < LEAST_S:
            return None
        mean_s, mean_m = (fmean(column) for column in zip(*self._depths, strict=True))
        spread = sum((at_s - mean_s) ** 2 for at_s, _ in self._depths)
        rate = sum((at_s - mean_s) * (depth - mean_m) for at_s, depth in self._depths) / spread
        left = sum((depth - mean_m - rate * (at_s - mean_s)) ** 2 for at_s, depth in self._depths)
        error = math.sqrt(left / (spread * max(1, len(self._depths) - 2)))
        return math.copysign(max(0.0, abs(rate) - error), rate)
