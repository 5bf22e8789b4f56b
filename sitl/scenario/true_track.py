"""The true track: where a hull was, not where anybody believed it was, and what that shows.

It is looked at between its samples too: the hull's outlines of two of them and all that lies between them. Only what
is near enough to matter is drawn.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry.base import BaseGeometry

from companion.boat import Hull, outline_en_m
from companion.current import TideTable
from companion.skipper.way import DryingWater
from sitl.scenario.colregs import Met
from sitl.world import Seabed


@dataclass(frozen=True, slots=True, kw_only=True)
class HullTrack:
    """Where a hull was.

    Attributes:
        en_m: (n, 2) places amidships, east north [m].
        heading_rad: (n,) true headings.
        hull: Its size.

    """

    en_m: NDArray[np.float64]
    heading_rad: NDArray[np.float64]
    hull: Hull

    def entries(self, solid: BaseGeometry) -> list[int]:
        """Return the samples at which the hull came to touch ``solid``, having been clear at the one before."""
        if solid.is_empty or len(self.en_m) == 0:
            return []
        shapely.prepare(solid)
        points_m = shapely.distance(solid, shapely.points(self.en_m))
        step_m = np.concatenate([[0.0], np.hypot(*np.diff(self.en_m, axis=0).T)])
        touches = np.zeros(len(self.en_m), dtype=bool)
        near = np.flatnonzero(points_m <= self.hull.reach_m + step_m)
        if near.size:
            touches[near] = shapely.intersects(solid, self._swept(near))
        return [int(i) for i in np.flatnonzero(touches & ~np.concatenate([[False], touches[:-1]]))]

    def least_m(self, solid: BaseGeometry) -> tuple[float, int]:
        """Return the outline's smallest distance to ``solid`` [m], 0 on contact, and at which sample; inf without."""
        if solid.is_empty or len(self.en_m) == 0:
            return math.inf, 0
        shapely.prepare(solid)
        points_m = np.asarray(shapely.distance(solid, shapely.points(self.en_m)))
        # No outline is nearer than its middle less its reach: the others cannot be the nearest.
        near = np.flatnonzero(points_m <= points_m.min() + 2.0 * self.hull.reach_m)
        outlines_m = np.asarray(shapely.distance(solid, self._outlines(near)))
        best = int(np.argmin(outlines_m))
        touched = self.entries(solid)
        return (0.0, touched[0]) if touched else (float(outlines_m[best]), int(near[best]))

    def _outlines(self, which: NDArray[np.intp]) -> NDArray[np.object_]:
        return np.asarray(shapely.polygons(outline_en_m(self.hull, self.en_m[which], self.heading_rad[which])))

    def _swept(self, which: NDArray[np.intp]) -> NDArray[np.object_]:
        """Return what the hull covered from the sample before each of ``which`` to it."""
        before = np.maximum(which - 1, 0)
        corners = np.concatenate(
            [outline_en_m(self.hull, self.en_m[i], self.heading_rad[i])[:, :4] for i in (before, which)], axis=1
        )
        return np.asarray(shapely.convex_hull(shapely.multipoints(corners)))


# A tack is counted when the boat has been on the other side of the wind for this long.
TACK_SETTLED_S = 3.0


@dataclass(slots=True)
class TrueTrack:
    """The true track, sampled from setting sail on: at one rate, on long voyages oftener near another vessel."""

    t_s: list[float] = field(default_factory=list)
    en_m: list[tuple[float, float]] = field(default_factory=list)
    heading_rad: list[float] = field(default_factory=list)
    speed_mps: list[float] = field(default_factory=list)
    twd_from_rad: list[float] = field(default_factory=list)
    tws_mps: list[float] = field(default_factory=list)
    vessels_m: dict[str, float] = field(default_factory=dict)  # the least distance to each vessel's hull
    met: dict[str, Met] = field(default_factory=dict)  # the tracks of those who met us
    second_boat_m: float | None = None  # the second boat's least distance to its goal

    def add(
        self, t_s: float, en_m: tuple[float, float], heading_rad: float, speed_mps: float, wind: tuple[float, float]
    ) -> None:
        """Append one sample."""
        self.t_s.append(t_s)
        self.en_m.append(en_m)
        self.heading_rad.append(heading_rad)
        self.speed_mps.append(speed_mps)
        self.twd_from_rad.append(wind[0])
        self.tws_mps.append(wind[1])

    def positions_m(self) -> NDArray[np.float64]:
        """Return (n, 2) east, north [m]."""
        return np.asarray(self.en_m, dtype=np.float64).reshape(-1, 2)

    def hull(self, hull: Hull) -> HullTrack:
        """Return the track of a hull that was there."""
        return HullTrack(en_m=self.positions_m(), heading_rad=np.asarray(self.heading_rad, dtype=np.float64), hull=hull)


def count_tacks(truth: TrueTrack, until: int | None = None) -> tuple[int, int]:
    """Return (tacks, gybes): settled changes of the side that the wind comes from, in the first ``until`` samples."""
    tacks = gybes = 0
    side = 0
    pending = 0
    since_s = -math.inf
    deepest = last_twa = 0.0
    samples = zip(truth.t_s, truth.heading_rad, truth.twd_from_rad, strict=True)
    for t_s, heading, wind in itertools.islice(samples, until):
        twa = (heading - wind + math.pi) % (2.0 * math.pi) - math.pi
        now = 1 if twa > 0.0 else -1
        if side == 0:
            side = now
        if now == side:
            pending, deepest = 0, 0.0
            last_twa = abs(twa)
            continue
        if pending == 0:
            pending, since_s = now, t_s
            deepest = min(abs(twa), last_twa)
        if t_s - since_s >= TACK_SETTLED_S:
            if deepest < math.pi / 2.0:
                tacks += 1
            else:
                gybes += 1
            side, pending = now, 0
    return tacks, gybes


# A mark is being rounded while the boat is this near [m]; its bearing from the mark must turn by this much [rad].
ROUNDING_M = 60.0
ROUNDING_RAD = math.radians(45.0)


def count_roundings(positions_m: NDArray[np.float64], marks: Sequence[tuple[tuple[float, float], str]]) -> int:
    """Return how many of ``marks`` the track rounds in their order, each left to its side.

    A mark left to port is passed counter-clockwise: seen from it, the boat's bearing turns left.

    Args:
        positions_m: (n, 2) east, north [m].
        marks: position [m] and "port" or "starboard", in the order of the course, laps written out.
    """
    rounded, at = 0, 0
    for mark, side in marks:
        offset = positions_m[at:] - np.asarray(mark)
        # A board that only comes near, and a miss that is sailed again, are followed by the rounding itself.
        near = _stretches(np.hypot(offset[:, 0], offset[:, 1]) < ROUNDING_M)
        if not near:
            break
        ends = [end for first, end in near if _turned_rad(offset[first:end], side) >= ROUNDING_RAD]
        rounded += bool(ends)
        at += ends[0] if ends else near[0][1]
    return rounded


def _turned_rad(offset_m: NDArray[np.float64], side: str) -> float:
    """Return how far the bearing from a mark turns the way it should for its side [rad]."""
    bearing = np.unwrap(np.arctan2(offset_m[:, 0], offset_m[:, 1]))
    return float(bearing[-1] - bearing[0]) * (-1.0 if side == "port" else 1.0)


def _stretches(holds: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Return where ``holds`` is true without a break, as (first, behind the last)."""
    edges = np.flatnonzero(np.diff(np.concatenate(([False], holds, [False])).astype(np.int8)))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))


def longest_silence_s(status_times_s: Sequence[float], start_s: float, end_s: float) -> float:
    """Return the longest stretch without a status [s]."""
    times = [start_s, *[t for t in status_times_s if start_s <= t <= end_s], end_s]
    return max((b - a for a, b in itertools.pairwise(times)), default=0.0)


FINE_M = 1.0  # between two looks at the bottom


def under_keel_m(truth: TrueTrack, seabed: Seabed, draft_m: float, began_s: float = 0.0) -> NDArray[np.float64]:
    """Return the room under a keel amidships all along a track, between its samples too [m]; negative: aground.

    The scenario, whose tide it is, began at ``began_s`` of the track's time.
    """
    places, t_s = truth.positions_m(), np.asarray(truth.t_s, dtype=np.float64)
    if len(places) == 0:
        return np.zeros(0)
    pieces = np.maximum(1, np.ceil(np.hypot(*np.diff(places, axis=0).T) / FINE_M)).astype(np.intp)
    first = np.repeat(np.arange(len(pieces)), pieces)
    share = np.arange(len(first)) - np.repeat(np.cumsum(pieces) - pieces, pieces)
    at = np.append(first + share / pieces[first], len(places) - 1.0)
    samples = np.arange(len(places))
    fine = np.column_stack([np.interp(at, samples, places[:, axis]) for axis in (0, 1)])
    return seabed.depth_m(fine, np.interp(at, samples, t_s) - began_s) - draft_m


def over_drying_m(
    truth: TrueTrack, waters: Sequence[DryingWater], table: TideTable, under_keel_m: float, epoch_s: float
) -> NDArray[np.float64] | None:
    """Return the room under a keel by the chart where a track is in water that dries [m]; None: it is nowhere in it.

    It is negative at its hours. ``epoch_s`` is the Unix time at 0 of the track's time.
    """
    places, room = truth.positions_m(), []
    for water in waters:
        for n in np.flatnonzero(shapely.contains_xy(water.polygon, places[:, 0], places[:, 1])).tolist():
            height_m = table.height_m(epoch_s + truth.t_s[n])
            room.append(-math.inf if height_m is None else water.room_m(height_m) + under_keel_m)
    return np.asarray(room) if room else None
