"""How the wind shifts about its mean, as a chain of shifts: what each becomes after so many seconds, and how likely."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

STATES = 11


@dataclass(frozen=True, slots=True, kw_only=True)
class Shifts:
    """A chain of shifts.

    Attributes:
        shift_rad: (m,) increasing, counted from the mean wind, positive where it veers.
        after: (seconds) -> (m, m) the chance of each shift so much later, a row for each that is now.
        spread_rad, tau_s: of the process that the chain stands for, where it wanders about its mean.
    """

    shift_rad: Floats
    after: Callable[[float], Floats]
    spread_rad: float = 0.0
    tau_s: float = math.inf


def steady() -> Shifts:
    """Return a wind that never shifts."""
    return Shifts(shift_rad=np.zeros(1), after=lambda _s: np.ones((1, 1)))


def wandering(spread_rad: float, tau_s: float, *, states: int = STATES) -> Shifts:
    """Return the Ornstein-Uhlenbeck process of a spread (its standard deviation) and a correlation time [s].

    By Rouwenhorst's method: mean, variance and correlation of the chain are those of the process for every time between
    looks, however short (Kopecky and Suen, Review of Economic Dynamics 13, 2010); bins that the probability is sorted
    into keep a shift for too long where they are wider than what it changes by.
    """
    if spread_rad <= 0.0:
        return steady()
    if states < 3 or tau_s <= 0.0:
        raise ValueError(f"{states} states and {tau_s} s: at least 3, and longer than 0")
    shift = np.linspace(-1.0, 1.0, states) * spread_rad * math.sqrt(states - 1.0)
    return Shifts(
        shift_rad=shift,
        after=lambda after_s: _rouwenhorst(states, math.exp(-after_s / tau_s)),
        spread_rad=spread_rad,
        tau_s=tau_s,
    )


def _rouwenhorst(states: int, kept: float) -> Floats:
    """Return the chain of ``states`` steps whose correlation from one look to the next is ``kept``."""
    stay = 0.5 * (1.0 + kept)
    chain = np.array([[stay, 1.0 - stay], [1.0 - stay, stay]])
    for n in range(3, states + 1):
        wider = np.zeros((n, n))
        wider[:-1, :-1] += stay * chain
        wider[:-1, 1:] += (1.0 - stay) * chain
        wider[1:, :-1] += (1.0 - stay) * chain
        wider[1:, 1:] += stay * chain
        wider[1:-1] *= 0.5
        chain = wider
    return chain
