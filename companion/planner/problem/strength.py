"""How strong the wind may be, t seconds from the start, and how fast the boat is in other winds than the problem's.

The strength at an instant is Gaussian about the forecast's mean, cut off at no wind; from instant to instant it is a
Gauss-Markov process with the correlation time that the forecast has. Without a ``Strength`` a problem says nothing of
it, and nothing is promised of the time of arrival.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

ASSUMED_SHARE = 0.25
"""Of the mean, where nothing is known of the spread: an hour of wind over water spreads by a tenth to a fifth of it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Strength:
    """The wind's strength: a table over ``horizon_s``, linear between and flat beyond.

    Attributes:
        horizon_s: (n,) strictly increasing, 0 or later.
        mean_mps: (n,) what is expected.
        sigma_mps: (n,) its spread.
        correlation_s: how long a departure lasts.
        is_known: it was forecast; else it is an assumption.

    """

    horizon_s: tuple[float, ...]
    mean_mps: tuple[float, ...]
    sigma_mps: tuple[float, ...]
    correlation_s: float = 60.0
    is_known: bool = True

    @property
    def is_sound(self) -> bool:
        """Whether every number is one, and none is negative."""
        numbers = (*self.horizon_s, *self.mean_mps, *self.sigma_mps, self.correlation_s)
        return all(math.isfinite(x) and x >= 0.0 for x in numbers) and self.correlation_s > 0.0

    def mean_at(self, t_s: ArrayLike) -> NDArray[np.float64]:
        """Return what is expected at times [m/s]."""
        return np.interp(np.asarray(t_s, dtype=np.float64), self.horizon_s, self.mean_mps)

    def sigma_at(self, t_s: ArrayLike) -> NDArray[np.float64]:
        """Return the spread at times [m/s]."""
        return np.interp(np.asarray(t_s, dtype=np.float64), self.horizon_s, self.sigma_mps)

    def over(self, tws_mps: float, until_s: float) -> float:
        """Return the probability of more wind than ``tws_mps`` at the worst instant until then."""
        return self._worst(tws_mps, until_s, sign=1.0)

    def under(self, tws_mps: float, until_s: float) -> float:
        """Return the same of less wind."""
        return self._worst(tws_mps, until_s, sign=-1.0)

    def _worst(self, tws_mps: float, until_s: float, *, sign: float) -> float:
        times = [t for t in self.horizon_s if t < until_s] + [max(until_s, 0.0)]
        worst = 0.0
        for mean, sigma in zip(self.mean_at(times).tolist(), self.sigma_at(times).tolist(), strict=True):
            past = sign * (mean - tws_mps)
            worst = max(worst, 0.5 * math.erfc(-past / (sigma * math.sqrt(2.0))) if sigma > 0.0 else float(past > 0.0))
        return worst


def assumed(tws_mps: float) -> Strength:
    """Return the strength of a wind of which nothing but the mean is known."""
    return Strength(horizon_s=(0.0,), mean_mps=(tws_mps,), sigma_mps=(ASSUMED_SHARE * tws_mps,), is_known=False)


@dataclass(frozen=True, slots=True, kw_only=True)
class Speeds:
    """A boat's speed in every wind: a table, linear between its nodes, and above its last wind as there.

    Attributes:
        tws_mps: (m,) strictly increasing.
        twa_rad: (n,) increasing.
        v_mps: m rows of n speeds.

    Below the first wind nothing was measured. She is taken to be slower there than in proportion to the wind: by its
    square.
    """

    tws_mps: tuple[float, ...]
    twa_rad: tuple[float, ...]
    v_mps: tuple[tuple[float, ...], ...]

    @property
    def is_sound(self) -> bool:
        """Whether every number is one, and none is negative."""
        return all(math.isfinite(x) and x >= 0.0 for row in (self.tws_mps, self.twa_rad, *self.v_mps) for x in row)

    @property
    def lowest_mps(self) -> float:
        """The least wind that it has."""
        return self.tws_mps[0]

    def at(self, twa_rad: ArrayLike, tws_mps: ArrayLike) -> NDArray[np.float64]:
        """Return the speeds [m/s] at angles to the wind (either sign) in winds; shapes are broadcast."""
        off, wind = np.broadcast_arrays(np.abs(np.asarray(twa_rad, dtype=np.float64)), np.asarray(tws_mps, np.float64))
        winds, angles, table = np.asarray(self.tws_mps), np.asarray(self.twa_rad), np.asarray(self.v_mps)
        i, f = _place(winds, wind)
        j, g = _place(angles, off)
        i1, j1 = np.minimum(i + 1, len(winds) - 1), np.minimum(j + 1, len(angles) - 1)
        low = table[i, j] + g * (table[i, j1] - table[i, j])
        high = table[i1, j] + g * (table[i1, j1] - table[i1, j])
        speed = low + f * (high - low)
        if self.lowest_mps > 0.0:
            speed = speed * np.minimum(1.0, wind / self.lowest_mps) ** 2
        return np.asarray(speed, dtype=np.float64)


def _place(nodes: NDArray[np.float64], at: NDArray[np.float64]) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Return the node before each place, and the share of the way to the next; flat outside."""
    if len(nodes) == 1:
        return np.zeros(at.shape, dtype=np.int64), np.zeros(at.shape)
    before = np.clip(np.searchsorted(nodes, at, side="right") - 1, 0, len(nodes) - 2)
    share = (at - nodes[before]) / (nodes[before + 1] - nodes[before])
    return before, np.clip(share, 0.0, 1.0)
