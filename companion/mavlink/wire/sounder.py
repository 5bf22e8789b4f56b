"""The sounder: the water's depth and how it changes, from pings of which some are wrong.

Weed, air and a fish give one ping or two that no other agrees with: the middle one of the last few is believed. Three
may agree by chance, or be one fish: where the newest ping is deeper again, and more of those before agree with it than
with them, the bottom is where it was. A ping that is zero, or at the end of what the sounder reaches, tells no depth.
"""

from __future__ import annotations

import math
from collections import deque
from statistics import fmean, median

PINGS = 5  # of which the middle one is believed: two in a row may be wrong
AGREE = 3  # so many must be within these of the middle one, or nothing is believed
NEAR_M, NEAR_SHARE = 0.4, 0.1
FRESH_S = 5.0  # older pings are of other water
WITNESSES, HEARD_S = 9, 10.0  # pings, no older, that speak for or against a bottom that she has left again
WINDOW_S = 6.0  # over which the change is told: longer, and a slope that begins is told too late ...
LEAST_S = 4.0  # ... once there is so much of it
DEPTHS = 256  # that are kept of it, however fast the sounder pings


class Sounder:
    """Pings as they come: the depth below the sounder, and its change, negative where it shoals."""

    def __init__(self) -> None:
        self._pings: deque[tuple[float, float]] = deque(maxlen=WITNESSES)
        self._depths: deque[tuple[float, float]] = deque(maxlen=DEPTHS)

    def take(self, t_s: float, depth_m: float, least_m: float, most_m: float) -> None:
        """Take a ping; the sounder tells depths between ``least_m`` and ``most_m``."""
        if not (math.isfinite(depth_m) and max(0.0, least_m) < depth_m < most_m):
            return
        self._pings.append((t_s, depth_m))
        told = self._told(t_s)
        if told is not None:
            depth, left = told
            if left is not None:
                self._depths = deque((at for at in self._depths if not _agree(at[1], left)), maxlen=DEPTHS)
            self._depths.append((t_s, depth))
        while self._depths and t_s - self._depths[0][0] > WINDOW_S:
            self._depths.popleft()

    def depth_m(self, t_s: float) -> float | None:
        """Return the depth [m], None where no three pings of the last seconds agree on one.

        What is between the sounder and the bottom is told now here, now there; the bottom is where it was.
        """
        told = self._told(t_s)
        return None if told is None else told[0]

    def _told(self, t_s: float) -> tuple[float, float | None] | None:
        """Return the depth [m], with what was told in its place where that was no bottom."""
        fresh = [depth for at_s, depth in self._pings if t_s - at_s <= FRESH_S][-PINGS:]
        if len(fresh) < AGREE:
            return None
        middle, newest = median(fresh), fresh[-1]
        if sum(_agree(depth, middle) for depth in fresh) < AGREE:
            return None
        if newest > middle and not _agree(newest, middle):
            heard = [depth for at_s, depth in self._pings if t_s - at_s <= HEARD_S]
            as_before = [depth for depth in heard if _agree(depth, newest)]
            if len(as_before) > sum(_agree(depth, middle) for depth in heard):
                return median(as_before), middle
        return middle, None

    def rate_mps(self, t_s: float) -> float | None:
        """Return how the depth changes at least [m/s]: straight through what was told, less the standard error of that.

        None while too little is told.
        """
        if self.depth_m(t_s) is None or not self._depths or self._depths[-1][0] - self._depths[0][0] < LEAST_S:
            return None
        mean_s, mean_m = (fmean(column) for column in zip(*self._depths, strict=True))
        spread = sum((at_s - mean_s) ** 2 for at_s, _ in self._depths)
        rate = sum((at_s - mean_s) * (depth - mean_m) for at_s, depth in self._depths) / spread
        left = sum((depth - mean_m - rate * (at_s - mean_s)) ** 2 for at_s, depth in self._depths)
        error = math.sqrt(left / (spread * max(1, len(self._depths) - 2)))
        return math.copysign(max(0.0, abs(rate) - error), rate)


def _agree(depth_m: float, with_m: float) -> bool:
    return abs(depth_m - with_m) <= NEAR_M + NEAR_SHARE * with_m
