"""The sounder: the water's depth and how it changes, from pings of which some are wrong.

Weed, air and a fish give one ping or two that no other agrees with: the middle one of the last few is believed. Three
may agree by chance, or be one fish: where the newest ping is deeper again, and more of those before agree with it than
with them, the bottom is where it was. A ping that is zero, or at the end of what the sounder reaches, tells no depth.

Over a slope no two pings are alike: each is carried on at the rate to when the newest came before they are held against
one another. Compared as they are those of a steep slope agree on nothing, and she would be told no depth just there.
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
ERRORS = 2.0  # of the change, standard ones, are left off: noise alone is no slope
DEPTHS = 256  # that are kept, however fast the sounder pings
PAIRED = 24  # of them, at the most, say what the change is about: each pair is asked


class Sounder:
    """Pings as they come: the depth below the sounder, and its change, negative where it shoals."""

    def __init__(self) -> None:
        self._pings: deque[tuple[float, float]] = deque(maxlen=DEPTHS)
        self._rate_mps: float | None = None

    def take(self, t_s: float, depth_m: float, least_m: float, most_m: float) -> None:
        """Take a ping; the sounder tells depths between ``least_m`` and ``most_m``."""
        if not (math.isfinite(depth_m) and max(0.0, least_m) < depth_m < most_m):
            return
        self._pings.append((t_s, depth_m))
        self._rate_mps = _rate_mps([(at_s - t_s, depth) for at_s, depth in self._pings if t_s - at_s <= WINDOW_S])

    def depth_m(self, t_s: float) -> float | None:
        """Return the depth where the newest ping came [m], None where no three of the last seconds agree on one.

        What is between the sounder and the bottom is told now here, now there; the bottom is where it was.
        """
        if not self._pings:
            return None
        newest_s, rate_mps = self._pings[-1][0], self._rate_mps or 0.0
        carried = [(t_s - at_s, depth + rate_mps * (newest_s - at_s)) for at_s, depth in list(self._pings)[-WITNESSES:]]
        fresh = [depth for age_s, depth in carried if age_s <= FRESH_S][-PINGS:]
        if len(fresh) < AGREE:
            return None
        middle, newest = median(fresh), fresh[-1]
        if sum(_agree(depth, middle) for depth in fresh) < AGREE:
            return None
        if newest > middle and not _agree(newest, middle):
            heard = [depth for age_s, depth in carried if age_s <= HEARD_S]
            as_before = [depth for depth in heard if _agree(depth, newest)]
            if len(as_before) > sum(_agree(depth, middle) for depth in heard):
                return median(as_before)
        return middle

    def rate_mps(self, t_s: float) -> float | None:
        """Return how the depth changes at least [m/s], None while too little is told."""
        return None if self.depth_m(t_s) is None else self._rate_mps


def _rate_mps(pings: list[tuple[float, float]]) -> float | None:
    """Return the slope of a straight line through the pings that agree with it, less ``ERRORS`` of it [m/s].

    Which those are the middle of the slopes of all pairs says: what is no bottom does not tilt it while it is few.
    None where too little is told, or not enough of it agrees.
    """
    if pings[-1][0] - pings[0][0] < LEAST_S:
        return None
    some = pings[:: -math.ceil(len(pings) / PAIRED)]  # the newest first
    slopes = [(d - c) / (b - a) for n, (a, c) in enumerate(some) for b, d in some[:n] if b > a]
    if not slopes:
        return None
    slope = median(slopes)
    level_m = median(depth - slope * at_s for at_s, depth in pings)
    believed = [(at_s, depth) for at_s, depth in pings if _agree(depth, level_m + slope * at_s)]
    if len({at_s for at_s, _ in believed}) < PINGS or 2 * len(believed) <= len(pings):
        return None
    mean_s, mean_m = (fmean(column) for column in zip(*believed, strict=True))
    spread = sum((at_s - mean_s) ** 2 for at_s, _ in believed)
    rate = sum((at_s - mean_s) * (depth - mean_m) for at_s, depth in believed) / spread
    left = sum((depth - mean_m - rate * (at_s - mean_s)) ** 2 for at_s, depth in believed)
    error = math.sqrt(left / (spread * (len(believed) - 2)))
    return math.copysign(max(0.0, abs(rate) - ERRORS * error), rate)


def _agree(depth_m: float, with_m: float) -> bool:
    return abs(depth_m - with_m) <= NEAR_M + NEAR_SHARE * with_m
