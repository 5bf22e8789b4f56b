"""Legs and points in the local plane: along, across, past, near (Büsser 2009, Figure 3.3).

Points are (east, north) [m]. A leg runs from ``a`` to ``b``; across is positive when the point is to its right.
"""

from __future__ import annotations

import math

from companion.geo.angles import heading_of
from companion.skipper.way.voyage import PointEn


def distance_m(a: PointEn, b: PointEn) -> float:
    """Return the distance between two points [m]."""
    return math.hypot(b[0] - a[0], b[1] - a[1])


def bearing_rad(a: PointEn, b: PointEn) -> float:
    """Return the compass bearing from ``a`` to ``b`` [rad, -π..π]."""
    return heading_of(b[0] - a[0], b[1] - a[1])


def moved(a: PointEn, heading_rad: float, by_m: float) -> PointEn:
    """Return the point ``by_m`` from ``a`` in a compass direction."""
    return a[0] + by_m * math.sin(heading_rad), a[1] + by_m * math.cos(heading_rad)


def along_m(point: PointEn, a: PointEn, b: PointEn) -> float:
    """Return how far along the leg the point is [m], 0 at ``a``; negative behind it."""
    length = distance_m(a, b)
    if length < 1e-9:
        return 0.0
    return ((point[0] - a[0]) * (b[0] - a[0]) + (point[1] - a[1]) * (b[1] - a[1])) / length


def cross_track_m(point: PointEn, a: PointEn, b: PointEn) -> float:
    """Return how far to the right of the leg's line the point is [m]; 0 for a leg without length.

    >>> round(cross_track_m((3.0, 5.0), (0.0, 0.0), (0.0, 10.0)), 9)
    3.0
    """
    length = distance_m(a, b)
    if length < 1e-9:
        return 0.0
    return ((point[0] - a[0]) * (b[1] - a[1]) - (point[1] - a[1]) * (b[0] - a[0])) / length


def leg_distance_m(point: PointEn, a: PointEn, b: PointEn) -> float:
    """Return the distance from the point to the leg, its ends included [m]."""
    along = along_m(point, a, b)
    if along <= 0.0:
        return distance_m(point, a)
    if along >= distance_m(a, b):
        return distance_m(point, b)
    return abs(cross_track_m(point, a, b))


def is_past(point: PointEn, a: PointEn, b: PointEn) -> bool:
    """Return whether the point is beyond the perpendicular of the leg at ``b`` (Büsser's γ > 90°)."""
    return distance_m(a, b) > 1e-9 and along_m(point, a, b) > distance_m(a, b)


def waypoint_done(
    boat: PointEn, before: PointEn, current: PointEn, after: PointEn | None, *, grid_m: float, manoeuvre_m: float,
) -> bool:
    """Return whether a waypoint may be left behind: Büsser's double conditions (section 3.2.1).

    γ > 90° or nearer to the next leg than the manoeuvring distance, and in both cases within the grid size.
    """
    if distance_m(boat, current) >= grid_m:
        return False
    if is_past(boat, before, current):
        return True
    return after is not None and leg_distance_m(boat, current, after) < manoeuvre_m
