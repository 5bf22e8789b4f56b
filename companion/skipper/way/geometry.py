"""Legs and points in the local plane: along, across, past, near (Büsser 2009, Figure 3.3).

Points are (east, north) [m]. A leg runs from ``a`` to ``b``; across is positive when the point is to its right.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from companion.geo.angles import difference_rad, heading_of, wrap_pi
from companion.skipper.way.voyage import AreaLike, PointEn

BEAR_AWAY_RAD = math.radians(100.0)  # a beam reach with a little to spare: every boat gathers way on it
LOOK_M = 40.0  # water looked at on either side before bearing away
AWAY_RADII = 4.0  # straight on for so far there is room to turn in, or water that goes on
GYBE_RADIUS_M = 8.0  # a loop that a boat of a few metres turns in, with WP_RADIUS to spare
LOOP_RADII = 2.0 * math.sqrt(2.0) + 2.0  # of its circle: the way of a loop, from its corner back to it
LOOP_SHARE = 0.6  # of the way round from the course before a loop to that away from the leg after it


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
    boat: PointEn, before: PointEn, current: PointEn, after: PointEn | None, *, grid_m: float, manoeuvre_m: float
) -> bool:
    """Return whether a waypoint may be left behind: Büsser's double conditions (section 3.2.1).

    γ > 90° or nearer to the next leg than the manoeuvring distance, and in both cases within the grid size.
    """
    if distance_m(boat, current) >= grid_m:
        return False
    if is_past(boat, before, current):
        return True
    return after is not None and leg_distance_m(boat, current, after) < manoeuvre_m


# -------- Barriers: what stands on no chart and is kept out of all the same, as WKT polygons for the planner.


def disc_wkt(center: PointEn, radius_m: float) -> str:
    """Return a polygon of sixteen sides around a disc."""
    r = radius_m / math.cos(math.pi / 16)
    ring = [moved(center, 2.0 * math.pi * n / 16, r) for n in range(16)]
    return polygon_wkt(ring)


class Mark(NamedTuple):
    """A buoy, or an end of a line: how far every way keeps clear of it [m], and what it is called in sentences."""

    en_m: PointEn
    keep_m: float
    name: str = "a mark"

    @property
    def disc_wkt(self) -> str:
        """What is kept out of, as WKT."""
        return disc_wkt(self.en_m, self.keep_m)


class Barrier(NamedTuple):
    """What is kept out of on one way only, as a WKT polygon, and what it is called in sentences."""

    wkt: str
    name: str


def barrier(foot: PointEn, direction_rad: float, length_m: float, name: str) -> Barrier:
    """Return a thin wedge from ``foot`` outwards."""
    tip = moved(foot, direction_rad, length_m)
    wide = 0.5
    ring = [foot, moved(tip, direction_rad + math.pi / 2.0, wide), moved(tip, direction_rad - math.pi / 2.0, wide)]
    return Barrier(polygon_wkt(ring), name)


def polygon_wkt(ring: list[PointEn]) -> str:
    """Return a ring of points as a WKT polygon."""
    closed = [*ring, ring[0]]
    return "POLYGON ((" + ", ".join(f"{e:.3f} {n:.3f}" for e, n in closed) + "))"


# -------- Turning the boat when the helm alone does not do it: out of irons, and gybing round instead of tacking.


def bear_away_rad(boat_en: PointEn, heading_rad: float, twd_from_rad: float, area: AreaLike) -> float:
    """Return the heading [rad] to gather way on: 100° off the wind, on the side that is clear or nearer."""
    tack = 1.0 if difference_rad(twd_from_rad, heading_rad) >= 0.0 else -1.0
    options = [wrap_pi(twd_from_rad - side * BEAR_AWAY_RAD) for side in (tack, -tack)]
    # The boat's own distance to an obstacle is the same both ways: what counts begins ahead of it.
    rooms = [
        min(area.path_clearance_m([moved(boat_en, h, LOOK_M / 4.0), moved(boat_en, h, LOOK_M)]), LOOK_M)
        for h in options
    ]
    return options[1] if rooms[1] > rooms[0] + 5.0 and rooms[0] < LOOK_M / 2.0 else options[0]


def has_way_out(area: AreaLike, at_en: PointEn, course_rad: float, *, radius_m: float, reach_m: float) -> bool:
    """Return whether a hull that comes to a place on a course gets away from it: straight on, or round to either side.

    ``radius_m`` is of the turn, ``reach_m`` what the hull reaches about its middle.
    """
    ways = [[at_en, moved(at_en, course_rad, AWAY_RADII * radius_m)]]
    for side in (1.0, -1.0):
        abeam = course_rad + side * math.pi / 2.0
        middle = moved(at_en, abeam, radius_m)
        ways.append([moved(middle, abeam + math.pi + side * math.pi * n / 12.0, radius_m) for n in range(13)])
    return any(area.path_clearance_m(way) >= reach_m for way in ways)


def is_tack(before_rad: float, after_rad: float, twd_from_rad: float) -> bool:
    """Return whether the turn between two courses, the shorter way, goes through the wind."""
    to_wind = difference_rad(twd_from_rad, before_rad)
    turn = difference_rad(after_rad, before_rad)
    return to_wind * turn > 0.0 and abs(turn) > abs(to_wind)


def gybe_round(
    start_en: PointEn,
    points: Sequence[PointEn],
    *,
    twd_from_rad: float,
    area: AreaLike,
    floor_m: float,
    radius_m: float,
) -> tuple[PointEn, ...]:
    """Return the waypoints with each tack replaced by a turn the other way round, where there is room for it.

    The loop lies to leeward of the corner, two waypoints about a circle of ``radius_m``. The second is on the
    leg that follows, sailed back: so that leg is sailed on its own course however short it is.
    """
    out: list[PointEn] = []
    before = start_en
    for n, corner in enumerate(points):
        out.append(corner)
        if n + 1 < len(points) and distance_m(before, corner) > 1e-6 and distance_m(corner, points[n + 1]) > 1e-6:
            course, following = bearing_rad(before, corner), bearing_rad(corner, points[n + 1])
            if is_tack(course, following, twd_from_rad):
                turn = difference_rad(following, course)
                off = math.copysign(LOOP_SHARE * (math.pi - abs(turn)), -turn)  # the other way round
                loop = [
                    moved(corner, course + off, math.sqrt(2.0) * radius_m),
                    moved(corner, following + math.pi, 2.0 * radius_m),
                ]
                if area.path_clearance_m([corner, *loop, points[n + 1]]) >= floor_m:
                    out.extend(loop)
        before = corner
    return tuple(out)
