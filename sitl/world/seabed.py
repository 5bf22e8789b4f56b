"""The bottom: how deep the water is by place and time, and a sounder that tells of it with its faults.

Depths are below the chart's datum, and the tide's height is added; what dries has a negative depth. A bottom is a
level, or a grid of depths, that shelves in one direction, with banks on it. A question has one answer, in whatever
order it is asked.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from companion.chart import Grid
from companion.geo.frame import LocalFrame
from companion.messages import GeoPoint

_KM = 1000.0
_SOUNDER = 0x50AD  # what tells a sounder's lots from those of the seed's other sensors
TICKS_HZ = 50.0  # of the autopilot's loop: each has lots of its own
LEAST_M, MOST_M = 0.3, 50.0  # what the sounder tells from its transducer down


@dataclass(frozen=True, slots=True, kw_only=True)
class Tide:
    """The water's height above the chart's datum: ``mean_m`` and half of ``range_m`` either way, as a cosine."""

    mean_m: float = 0.0
    range_m: float = 0.0
    period_s: float = 44_712.0
    high_s: float = 0.0

    def height_m(self, t_s: ArrayLike) -> NDArray[np.float64]:
        """Return the height at a time after the start [m]."""
        phase = 2.0 * math.pi * (np.asarray(t_s, dtype=np.float64) - self.high_s) / self.period_s
        return self.mean_m + 0.5 * self.range_m * np.cos(phase)


@dataclass(frozen=True, slots=True, kw_only=True)
class Bank:
    """A shoal or a bar: an ellipse that rises from what lies round it to ``top_m`` in its middle.

    Attributes:
        en_m: its middle.
        along_m, across_m: its half axes, to where nothing of it is left.
        bearing_rad: of the longer one, from north.
        top_m: the depth in its middle, below the datum; negative: it dries.
    """

    en_m: tuple[float, float]
    along_m: float
    across_m: float
    bearing_rad: float
    top_m: float

    def over(self, depth_m: NDArray[np.float64], en_m: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the depths at (n, 2) places, of a bottom that had ``depth_m`` there."""
        east, north = (en_m - np.asarray(self.en_m)).T
        sin, cos = math.sin(self.bearing_rad), math.cos(self.bearing_rad)
        off = np.hypot((east * sin + north * cos) / self.along_m, (east * cos - north * sin) / self.across_m)
        off = np.minimum(off, 1.0)
        share = (1.0 - off) ** 2 * (1.0 + 2.0 * off)
        risen: NDArray[np.float64] = np.minimum(depth_m, depth_m + share * (self.top_m - depth_m))
        return risen


@dataclass(frozen=True, slots=True, kw_only=True)
class Seabed:
    """The bottom of a scenario, in the metres of its mission's frame.

    Attributes:
        frame: those metres.
        level_m: the depth at the frame's origin where no grid says another.
        grid: heights by longitude and latitude, both ascending; beyond it, and where it knows none, ``level_m`` holds.
        rises_per_km: the bottom is so many metres higher for each km ...
        rises_to_rad: ... in this direction.
        banks: what stands on it, one after the other.
        tide: of the water.
    """

    frame: LocalFrame
    level_m: float
    grid: Grid | None = None
    rises_per_km: float = 0.0
    rises_to_rad: float = 0.0
    banks: tuple[Bank, ...] = ()
    tide: Tide = Tide()

    def depth_m(self, en_m: ArrayLike, t_s: ArrayLike) -> NDArray[np.float64]:
        """Return the depth of the water at (n, 2) places, each at its time after the start [m]; negative: dry."""
        places = np.asarray(en_m, dtype=np.float64).reshape(-1, 2)
        depths = np.full(len(places), self.level_m)
        if self.grid is not None:
            lonlat = self.frame.array_lonlat_from_en(places)
            told = -_between(self.grid, lonlat)
            depths = np.where(np.isfinite(told), told, depths)
        there_m = places @ np.array([math.sin(self.rises_to_rad), math.cos(self.rises_to_rad)])
        depths = depths - self.rises_per_km * there_m / _KM
        for bank in self.banks:
            depths = bank.over(depths, places)
        return depths + self.tide.height_m(t_s)


def _between(grid: Grid, lonlat: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the heights of a grid at (n, 2) places, straight between its middles; NaN beyond them."""
    x = (lonlat[:, 0] - grid.x[0]) / (grid.x[1] - grid.x[0])
    y = (lonlat[:, 1] - grid.y[0]) / (grid.y[1] - grid.y[0])
    inside = (x >= 0.0) & (x <= len(grid.x) - 1) & (y >= 0.0) & (y <= len(grid.y) - 1)
    i = np.clip(np.floor(x).astype(np.intp), 0, len(grid.x) - 2)
    j = np.clip(np.floor(y).astype(np.intp), 0, len(grid.y) - 2)
    u, v, h = x - i, y - j, grid.heights_m
    lower = h[j, i] + u * (h[j, i + 1] - h[j, i])
    upper = h[j + 1, i] + u * (h[j + 1, i + 1] - h[j + 1, i])
    return np.where(inside, lower + v * (upper - lower), np.nan)


@dataclass(frozen=True, slots=True, kw_only=True)
class SimulatedSounder:
    """A sounder over a bottom, that errs by seed.

    Attributes:
        seabed: what it looks at.
        seed: of its lots.
        below_m: its transducer is so far below the water's surface: it tells the depth from there.
        noise_m: standard deviation of a ping.
        dropouts: the share of pings that bring no echo.
        false_bottoms: the share of time in which weed, air or fish between it and the bottom is told in its place ...
        false_s: ... for so long each.
    """

    seabed: Seabed
    seed: int
    below_m: float = 0.0
    noise_m: float = 0.0
    dropouts: float = 0.0
    false_bottoms: float = 0.0
    false_s: float = 0.5

    def ping_m(self, position: GeoPoint, t_s: float) -> float | None:
        """Return what a ping at ``t_s`` after the start tells [m], its reach where nothing is; None: no echo."""
        depth_m = float(self.seabed.depth_m([self.seabed.frame.en_from_geo(position)], t_s)[0]) - self.below_m
        lots = np.random.default_rng((self.seed & 0xFFFFFFFF, _SOUNDER, round(t_s * TICKS_HZ)))
        lost, noise = float(lots.random()), float(lots.standard_normal())
        if lost < self.dropouts:
            return None
        told_m = min(max(depth_m + self.noise_m * noise, 0.0), MOST_M)
        if self.false_bottoms > 0.0:
            runs = np.random.default_rng((self.seed & 0xFFFFFFFF, _SOUNDER, 1, math.floor(t_s / self.false_s)))
            chance, share = runs.random(2).tolist()
            if chance < self.false_bottoms:
                told_m *= share
        return told_m
