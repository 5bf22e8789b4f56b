"""How sure a share is while voyages still come: intervals that hold however often, and whenever, one looks at them.

A run that ends when its interval is narrow looks at it after every voyage, and an interval for one look (Wilson's)
would then be wrong more often than it says. These hold at all looks together: the share p is inside at every number of
voyages with the stated probability. The likelihood of p is held against its mean over Beta(1/2, 1/2); for the true p
that quotient is a martingale, which exceeds 20 at any time with a chance of 1/20 at most (Ville 1939; Robbins 1970,
Statistical methods related to the law of the iterated logarithm).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

LEVEL = 0.95
_STEPS = 50     # halvings of a share


@dataclass(frozen=True, slots=True, kw_only=True)
class Share:
    """How often something came, and between which shares it is by 95 %."""

    came: int
    of: int
    low: float
    high: float

    @property
    def width(self) -> float:
        """How far the bounds are apart."""
        return self.high - self.low


@dataclass(frozen=True, slots=True, kw_only=True)
class Quantile:
    """The value that a share ``of_all`` of them are at or below; ``inf`` where it is not reached."""

    of_all: float
    value: float
    low: float
    high: float


def _evidence(came: int, of: int, p: float) -> float:
    """Return the logarithm of the quotient against ``p``."""
    missed = of - came
    if (p <= 0.0 and came) or (p >= 1.0 and missed):
        return math.inf
    mean = (math.lgamma(came + 0.5) + math.lgamma(missed + 0.5) - math.lgamma(of + 1.0) - math.log(math.pi))
    return mean - (came * math.log(p) if came else 0.0) - (missed * math.log1p(-p) if missed else 0.0)


def share_of(came: int, of: int, level: float = LEVEL) -> Share:
    """Return a share with its interval.

    >>> found = share_of(0, 100)
    >>> found.low, round(found.high, 3)
    (0.0, 0.057)
    """
    if of == 0:
        return Share(came=0, of=0, low=0.0, high=1.0)
    most, best = -math.log1p(-level), came / of

    def bound(outside: float) -> float:
        if _evidence(came, of, outside) < most:
            return outside
        inside = best
        for _ in range(_STEPS):
            middle = 0.5 * (inside + outside)
            if _evidence(came, of, middle) < most:
                inside = middle
            else:
                outside = middle
        return inside

    return Share(came=came, of=of, low=bound(0.0), high=bound(1.0))


def quantile_of(values: Sequence[float], of_all: float, level: float = LEVEL) -> Quantile:
    """Return a quantile with its interval, which holds at all looks too: of each value one asks how many are below it.

    ``values`` are in order; what never ends is ``inf``. Without any: nothing is known.
    """
    count, most = len(values), -math.log1p(-level)
    if not count:
        return Quantile(of_all=of_all, value=math.inf, low=0.0, high=math.inf)
    likely = [below for below in range(count + 1) if _evidence(below, count, of_all) < most]
    low = values[likely[0] - 1] if likely[0] else 0.0
    high = values[likely[-1]] if likely[-1] < count else math.inf
    return Quantile(of_all=of_all, value=values[max(0, math.ceil(of_all * count) - 1)], low=low, high=high)
