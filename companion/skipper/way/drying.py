"""Water that dries: too shallow at its hours and deep enough at others, in a plan's own time.

A plan is told of it as discs that stand still and count in their windows, as it is told of vessels: every algorithm
and the exact scorer hold both already. The discs contain the water that dries with its margin, so what keeps clear of
them keeps clear of it. Where it is closed for as long as a plan looks ahead it is an obstacle as any other.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from shapely.geometry import Polygon
from shapely.geometry.base import BaseGeometry

from companion.current import TideTable, closed_spans
from companion.geofence.area import buffer_out
from companion.messages import Target

DOUBT_S = 60.0  # it closes so much earlier and opens so much later: tables and clocks err ...
TIDE_DOUBT_M = 0.2  # wind and pressure make a tide lower than its table: so much more is waited for
DOUBT_SHARE = 0.1  # ... and by so much of the time until then: a boat is not where a plan has her
AHEAD_S = 4.0 * 3600.0  # what is closed for so long is an obstacle of a plan
SOLID_S = 1800.0  # what is closed for so long is one of all that is looked at under way
SOON_S = 180.0  # ... and what closes so soon, or is closed, of who looks no farther than about herself
SLACKS_M = (5.0, 10.0, 20.0, 40.0, 80.0)  # discs reach at most so far beyond what they contain: the finest that is few
MOST_DISCS = 40  # of one piece of water ...
MOST_TARGETS = 240  # ... and of a plan; what is more is an obstacle
HAIR_M = 0.5  # a boat within a disc is let out of it: the disc ends this much before the boat


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DryingWater:
    """A piece of it, by identity.

    Attributes:
        name: what it is called.
        polygon: where it is, east and north [m].
        margin_m: its own, 0 where the mission's will do.
        opens_at_m: the tide above the chart's datum from which on it is deep enough, with ``TIDE_DOUBT_M``.
    """

    name: str
    polygon: Polygon
    margin_m: float
    opens_at_m: float

    def closed_s(self, table: TideTable | None, utc_s: float | None) -> tuple[tuple[float, float], ...]:
        """Return when it is too shallow, in seconds from ``utc_s`` on; for ever where nothing tells of the tide."""
        if utc_s is None:
            return ((0.0, math.inf),)
        spans = [(max(0.0, a - utc_s), b - utc_s) for a, b in closed_spans(table, self.opens_at_m)]
        return tuple((a, b) for a, b in spans if b > a)

    def doubtful_s(self, table: TideTable | None, utc_s: float | None) -> tuple[tuple[float, float], ...]:
        """Return the same with the doubt of when it closes and opens, windows that meet made one."""
        out: list[tuple[float, float]] = []
        for closes, opens in self.closed_s(table, utc_s):
            begin = max(0.0, closes - DOUBT_S - DOUBT_SHARE * closes)
            end = opens + DOUBT_S + DOUBT_SHARE * opens
            if out and begin <= out[-1][1]:
                out[-1] = (out[-1][0], end)
            else:
                out.append((begin, end))
        return tuple(out)

    def room_m(self, tide_m: float) -> float:
        """Return how much deeper than she needs it is by the chart at a height of the tide [m]."""
        return tide_m - self.opens_at_m + TIDE_DOUBT_M

    def is_closed(self, table: TideTable | None, utc_s: float | None, for_s: float) -> bool:
        """Return whether it is too shallow now and will be for so long."""
        windows = self.closed_s(table, utc_s)
        return bool(windows) and windows[0][0] <= 0.0 and windows[0][1] >= for_s

    def closes_soon(self, table: TideTable | None, utc_s: float | None) -> bool:
        """Return whether it is too shallow now, or will be within ``SOON_S``."""
        windows = self.closed_s(table, utc_s)
        return bool(windows) and windows[0][0] <= SOON_S


@dataclass(frozen=True, slots=True, kw_only=True)
class TimedWater:
    """What a plan is told of water that dries: what is an obstacle, and the discs that count in their windows."""

    solid: tuple[DryingWater, ...] = ()
    targets: tuple[Target, ...] = ()


def timed(
    waters: Sequence[DryingWater],
    table: TideTable | None,
    utc_s: float | None,
    *,
    margin_m: float,
    start_en: tuple[float, float],
) -> TimedWater:
    """Return what a plan that begins at ``utc_s`` at a place is told; the nearest first where there is too much."""
    here = shapely.points(start_en)
    solid: list[DryingWater] = []
    targets: list[Target] = []
    for water in sorted(waters, key=lambda w: float(shapely.distance(w.polygon, here))):
        windows = water.doubtful_s(table, utc_s)
        if not windows:
            continue
        discs = () if windows[0] == (0.0, math.inf) or _lasts(windows) else discs_over(water, margin_m)
        found = [
            Target(x_m=x, y_m=y, radius_m=radius, from_s=begin, until_s=end, name=water.name)
            for begin, end in windows
            for x, y, radius in (_let_out(discs, start_en) if begin <= 0.0 else discs)
            if radius > 0.0
        ]
        if not discs or len(targets) + len(found) > MOST_TARGETS:
            solid.append(water)
        else:
            targets += found
    return TimedWater(solid=tuple(solid), targets=tuple(targets))


def _lasts(windows: tuple[tuple[float, float], ...]) -> bool:
    return windows[0][0] <= 0.0 and windows[0][1] >= AHEAD_S


def _let_out(
    discs: Sequence[tuple[float, float, float]], start_en: tuple[float, float]
) -> list[tuple[float, float, float]]:
    return [(x, y, min(radius, math.dist((x, y), start_en) - HAIR_M)) for x, y, radius in discs]


@functools.lru_cache(maxsize=256)
def discs_over(water: DryingWater, margin_m: float) -> tuple[tuple[float, float, float], ...]:
    """Return discs (east, north, radius) [m] that together contain the water with its margin; none: too many."""
    shape = buffer_out(water.polygon, max(margin_m, water.margin_m))
    for slack_m in SLACKS_M:
        grown = shapely.buffer(shape, slack_m)
        shapely.prepare(grown)
        out: list[tuple[float, float, float]] = []
        if _cover(shape, grown, slack_m, out):
            return tuple(out)
    return ()


def _cover(piece: BaseGeometry, grown: BaseGeometry, slack_m: float, out: list[tuple[float, float, float]]) -> bool:
    """Add discs that contain ``piece`` and lie in ``grown``; False once they are too many."""
    corners = shapely.get_coordinates(shapely.convex_hull(piece))
    if len(corners) == 0:
        return True
    if len(out) >= MOST_DISCS:
        return False
    middle = shapely.centroid(shapely.minimum_bounding_circle(piece))
    radius = float(np.max(np.hypot(*(corners - (middle.x, middle.y)).T))) + 1e-3
    if radius <= slack_m or shapely.covers(grown, shapely.buffer(middle, radius, quad_segs=16)):
        out.append((middle.x, middle.y, radius))
        return True
    x0, y0, x1, y1 = shapely.bounds(piece).tolist()
    halves = (
        ((x0, y0, 0.5 * (x0 + x1), y1), (0.5 * (x0 + x1), y0, x1, y1))
        if x1 - x0 >= y1 - y0
        else ((x0, y0, x1, 0.5 * (y0 + y1)), (x0, 0.5 * (y0 + y1), x1, y1))
    )
    return all(_cover(shapely.intersection(piece, shapely.box(*half)), grown, slack_m, out) for half in halves)
