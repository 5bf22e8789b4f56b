"""Lines to cross: gates, start and finish. Two marks, the port one on the port hand; that is what fixes the direction.

A line is crossed where the track between two fixes cuts the straight line between the marks, and nowhere else:
nearness counts for nothing. The plan leads to a place beyond it, with a wing outwards from each mark that no plan
crosses; a boat that is beyond the line already is led to a place before it first.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from companion.skipper.way.geometry import along_m, barrier_wkt, bearing_rad, cross_track_m, distance_m, moved
from companion.skipper.way.voyage import AreaLike, Line, PointEn

BEFORE_M = 25.0  # the place before the line: room to settle on the course across it
BEYOND_M = 14.0  # the place beyond: the autopilot leaves a waypoint 3 to 5 m early, and must have crossed by then
BEYOND_RADIUS_M = 6.0
BEFORE_RADIUS_M = 10.0
STRAY_M = 3.0  # what the track strays from its leg: added to what is kept clear of a mark
WING_M = 60.0  # shortest wing ...
WING_SHARE = 1.5  # ... and this share of the way to the line is added
STEP_M = 5.0
LAND_STEPS = 12  # of a wing over what is solid, on end: land


@dataclass(frozen=True, slots=True, kw_only=True)
class Crossing:
    """How the track cut a line: in its direction or against it, and how far from the port mark [m]."""

    is_forward: bool
    from_port_m: float


def course_rad(line: Line) -> float:
    """Return the course that crosses the line at right angles, in its direction [rad]."""
    return bearing_rad(line.port_en_m, line.starboard_en_m) - math.pi / 2.0


def width_m(line: Line) -> float:
    """Return the distance between the marks [m]."""
    return distance_m(line.port_en_m, line.starboard_en_m)


def ahead_m(line: Line, point: PointEn) -> float:
    """Return how far beyond the line a point is [m], negative before it."""
    return -cross_track_m(point, line.port_en_m, line.starboard_en_m)


def is_between(line: Line, point: PointEn) -> bool:
    """Return whether a point is straight before or behind the line, not beside it."""
    return 0.0 < along_m(point, line.port_en_m, line.starboard_en_m) < width_m(line)


def crossing(line: Line, a: PointEn, b: PointEn) -> Crossing | None:
    """Return how the way from a to b cuts the line between its marks, None where it does not."""
    before_m, after_m = ahead_m(line, a), ahead_m(line, b)
    if (before_m < 0.0) == (after_m < 0.0):
        return None
    share = before_m / (before_m - after_m)
    cut = (a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1]))
    from_port_m = along_m(cut, line.port_en_m, line.starboard_en_m)
    if not 0.0 < from_port_m < width_m(line):
        return None
    return Crossing(is_forward=after_m >= 0.0, from_port_m=from_port_m)


def crossing_en(line: Line, before: PointEn | None, after: PointEn | None) -> PointEn:
    """Return where to cross: where the straight way from ``before`` to ``after`` does, as near as the marks allow.

    None: not known, and then abreast of the other; the middle where neither is.
    """
    width = width_m(line)
    ends = [p for p in (before, after) if p is not None]
    at_m = width / 2.0
    if len(ends) == 1:
        at_m = along_m(ends[0], line.port_en_m, line.starboard_en_m)
    elif ends:
        (a, b), cut = ends, (-ahead_m(line, ends[0]), ahead_m(line, ends[1]))
        alongs = [along_m(p, line.port_en_m, line.starboard_en_m) for p in (a, b)]
        if min(cut) > 0.0:
            at_m = alongs[0] + (alongs[1] - alongs[0]) * cut[0] / (cut[0] + cut[1])
        else:
            at_m = alongs[0]
    clear_m = min(line.keep_m + STRAY_M + 2.0, width / 2.0)
    at_m = min(max(at_m, clear_m), width - clear_m)
    return moved(line.port_en_m, bearing_rad(line.port_en_m, line.starboard_en_m), at_m)


def wings_wkt(line: Line, area: AreaLike, way_m: float) -> tuple[str, ...]:
    """Return a thin wedge from each mark outwards as WKT: what keeps a plan from going round the marks.

    It reaches so far that round its end is no short cut for a way of ``way_m``, or to the first land: what is passed
    behind in a few boat's lengths, a rock, is none.
    """
    out = []
    for mark, other in ((line.port_en_m, line.starboard_en_m), (line.starboard_en_m, line.port_en_m)):
        away = bearing_rad(other, mark)
        steps_m = np.arange(0.0, WING_M + WING_SHARE * way_m, STEP_M)
        ashore = area.clearance_m([moved(mark, away, float(m)) for m in steps_m]) <= 0.0
        begins = [n for n in np.flatnonzero(ashore) if ashore[n : n + LAND_STEPS].all()]
        length_m = float(steps_m[begins[0]] if begins else steps_m[-1])
        out.append(barrier_wkt(mark, away, max(STEP_M, length_m)))
    return tuple(out)
