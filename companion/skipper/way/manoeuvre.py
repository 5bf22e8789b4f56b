"""Turning the boat when the helm alone does not do it: out of irons, and gybing round instead of tacking."""

from __future__ import annotations

import math
from collections.abc import Sequence

from companion.geo.angles import difference_rad, wrap_pi
from companion.skipper.way.geometry import bearing_rad, distance_m, moved
from companion.skipper.way.voyage import Area, PointEn

BEAR_AWAY_RAD = math.radians(100.0)  # a beam reach with a little to spare: every boat gathers way on it
LOOK_M = 40.0                        # water looked at on either side before bearing away


def bear_away_rad(boat_en: PointEn, heading_rad: float, twd_from_rad: float, area: Area) -> float:
    """Return the heading [rad] to gather way on: 100° off the wind, on the side that is clear or nearer."""
    tack = 1.0 if difference_rad(twd_from_rad, heading_rad) >= 0.0 else -1.0
    options = [wrap_pi(twd_from_rad - side * BEAR_AWAY_RAD) for side in (tack, -tack)]
    # The boat's own distance to an obstacle is the same both ways: what counts begins ahead of it.
    rooms = [
        min(area.path_clearance_m([moved(boat_en, h, LOOK_M / 4.0), moved(boat_en, h, LOOK_M)]), LOOK_M)
        for h in options
    ]
    return options[1] if rooms[1] > rooms[0] + 5.0 and rooms[0] < LOOK_M / 2.0 else options[0]


def is_tack(before_rad: float, after_rad: float, twd_from_rad: float) -> bool:
    """Return whether the turn between two courses, the shorter way, goes through the wind."""
    to_wind = difference_rad(twd_from_rad, before_rad)
    turn = difference_rad(after_rad, before_rad)
    return to_wind * turn > 0.0 and abs(turn) > abs(to_wind)


def gybe_round(
    start_en: PointEn, points: Sequence[PointEn], *, twd_from_rad: float, radius_m: float, area: Area, floor_m: float,
) -> tuple[PointEn, ...]:
    """Return the waypoints with each tack replaced by a turn the other way round, where there is room for it.

    The loop lies to leeward of the corner, ``radius_m`` in radius, in three waypoints a quarter turn apart.
    """
    out: list[PointEn] = []
    before = start_en
    for n, corner in enumerate(points):
        out.append(corner)
        if n + 1 < len(points) and distance_m(before, corner) > 1e-6 and distance_m(corner, points[n + 1]) > 1e-6:
            course, following = bearing_rad(before, corner), bearing_rad(corner, points[n + 1])
            if is_tack(course, following, twd_from_rad):
                side = -1.0 if difference_rad(following, course) > 0.0 else 1.0   # the other way round
                center = moved(corner, course + side * math.pi / 2.0, radius_m)
                total = 2.0 * math.pi - abs(difference_rad(following, course))
                loop = [
                    moved(center, course + side * (total * share - math.pi / 2.0), radius_m)
                    for share in (1.0 / 3.0, 2.0 / 3.0, 1.0)
                ]
                if area.path_clearance_m([corner, *loop, points[n + 1]]) >= floor_m:
                    out.extend(loop)
        before = corner
    return tuple(out)
