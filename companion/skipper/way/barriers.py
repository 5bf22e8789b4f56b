"""Barriers: what stands on no chart and is kept out of all the same, as WKT polygons for the planner."""

from __future__ import annotations

import math

from companion.skipper.way.geometry import moved
from companion.skipper.way.voyage import PointEn


def disc_wkt(center: PointEn, radius_m: float, sides: int = 16) -> str:
    """Return a polygon around a disc."""
    r = radius_m / math.cos(math.pi / sides)
    ring = [moved(center, 2.0 * math.pi * n / sides, r) for n in range(sides)]
    return polygon_wkt(ring)


def barrier_wkt(foot: PointEn, direction_rad: float, length_m: float) -> str:
    """Return a thin wedge from ``foot`` outwards."""
    tip = moved(foot, direction_rad, length_m)
    wide = 0.5
    return polygon_wkt([foot, moved(tip, direction_rad + math.pi / 2.0, wide),
                        moved(tip, direction_rad - math.pi / 2.0, wide)])


def polygon_wkt(ring: list[PointEn]) -> str:
    """Return a ring of points as a WKT polygon."""
    closed = [*ring, ring[0]]
    return "POLYGON ((" + ", ".join(f"{e:.3f} {n:.3f}" for e, n in closed) + "))"
