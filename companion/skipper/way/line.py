"""Lines to cross: gates, start and finish. Two marks, the port one on the port hand; that is what fixes the direction.

A line is crossed where the track between two fixes cuts the straight line between the marks, and nowhere else:
nearness counts for nothing. The plan leads to a place beyond it, with a wing outwards from each mark that no plan
crosses; a boat that is beyond the line already is led to a place before it first. Where a shore is near, these places
lie nearer to the line, or to one side along it: as far off as there is room for.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from companion.skipper.way.geometry import (
    Barrier,
    Mark,
    along_m,
    barrier,
    bearing_rad,
    cross_track_m,
    distance_m,
    moved,
)
from companion.skipper.way.voyage import AreaLike, Line, PointEn

BEFORE_M = 25.0  # the place before the line: room to settle on the course across it
BEYOND_M = 14.0  # the place beyond: the autopilot leaves a waypoint 3 to 5 m early, and must have crossed by then
BEYOND_LEAST_M = 7.0  # ... beside a shore: what is left then is a second's way
BEYOND_RADIUS_M = 6.0
BEFORE_LEAST_M = 10.0
BEFORE_RADIUS_M = 10.0
RADIUS_SHARE = 0.5  # of a place's distance from the line: at the most its radius
ASIDE_M = 2.0  # between the places that are tried along the line, ...
ASIDES = 100  # ... and as many of them at the most
ASIDE_SHARE = 0.5  # a metre to one side is worth so many of distance from the line
ROOM_M = 0.1  # rooms that differ by less are the same
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
    low_m, high_m = _opening_m(line)
    return _on_line(line, min(max(at_m, low_m), high_m))


def _opening_m(line: Line) -> tuple[float, float]:
    """Return from where to where it is crossed, clear of both marks [m from the port one]."""
    width = width_m(line)
    clear_m = min(line.keep_m + STRAY_M + 2.0, width / 2.0)
    return clear_m, width - clear_m


def _on_line(line: Line, at_m: float) -> PointEn:
    return moved(line.port_en_m, bearing_rad(line.port_en_m, line.starboard_en_m), at_m)


def foot_en(line: Line, point: PointEn) -> PointEn:
    """Return the place on the line that a point is abreast of."""
    return _on_line(line, along_m(point, line.port_en_m, line.starboard_en_m))


def place_beyond(line: Line, cut_en: PointEn, area: AreaLike, marks: Sequence[Mark] = ()) -> tuple[PointEn, float]:
    """Return the place beyond the line that the way across it at ``cut_en`` leads to, and its radius [m]."""
    place, off_m = _place(line, cut_en, area, marks, course_rad(line), BEYOND_M, BEYOND_LEAST_M)
    return place, min(BEYOND_RADIUS_M, RADIUS_SHARE * off_m)


def place_before(line: Line, cut_en: PointEn, area: AreaLike, marks: Sequence[Mark] = ()) -> tuple[PointEn, float]:
    """Return the place before the line where the way across it at ``cut_en`` begins, and its radius [m]."""
    place, off_m = _place(line, cut_en, area, marks, course_rad(line) + math.pi, BEFORE_M, BEFORE_LEAST_M)
    return place, min(BEFORE_RADIUS_M, RADIUS_SHARE * off_m)


def _place(
    line: Line, cut_en: PointEn, area: AreaLike, marks: Sequence[Mark], course: float, most_m: float, least_m: float
) -> tuple[PointEn, float]:
    """Return a place off the line, and how far off: as far as there is room for the line's margin, up to ``most_m``.

    ``marks`` are as much in its way as what is solid. Not where something solid lies between it and the line. Where
    nothing fits, the roomiest place: the ladder's lower steps lead there.
    """
    wanted, (low_m, high_m) = moved(cut_en, course, most_m), _opening_m(line)
    if _spare_m(line, [wanted], area, marks)[0] >= 0.0 and area.path_clearance_m([cut_en, wanted]) > 0.0:
        return wanted, most_m
    cut_m = along_m(cut_en, line.port_en_m, line.starboard_en_m)
    step_m = max(ASIDE_M, width_m(line) / ASIDES)
    alongs_m = [at_m for n in range(-ASIDES, ASIDES + 1) if low_m <= (at_m := cut_m + n * step_m) <= high_m]
    tried = [
        (off_m - ASIDE_SHARE * abs(at_m - cut_m), off_m, _on_line(line, at_m))
        for off_m in np.arange(most_m, least_m - 0.5, -1.0).tolist()
        for at_m in alongs_m or [cut_m]
    ]
    tried.sort(key=lambda one: -one[0])
    places = [moved(foot, course, off_m) for _, off_m, foot in tried]
    spare_m = _spare_m(line, places, area, marks)
    # What fits, the best first; then the others, the roomiest first.
    order = sorted(range(len(tried)), key=lambda n: -min(0.0, round(float(spare_m[n]) / ROOM_M)))
    for n in order:
        if area.path_clearance_m([tried[n][2], places[n]]) > 0.0:
            return places[n], tried[n][1]
    return wanted, most_m


def _spare_m(line: Line, places: Sequence[PointEn], area: AreaLike, marks: Sequence[Mark]) -> NDArray[np.float64]:
    """Return how much farther off each place is than is kept clear of what is solid and of ``marks`` [m]."""
    off = [[distance_m(place, mark.en_m) - mark.keep_m - ROOM_M for mark in marks] for place in places]
    return np.minimum(area.spare_m(places, line.margin_m), [min(row, default=math.inf) for row in off])


def no_room_words(line: Line, name: str, place_en: PointEn, area: AreaLike, margin_m: float) -> str:
    """Return that a place off the line has less room than the margin, in words of the line; empty: it has the room."""
    if area.spare_m([place_en], margin_m)[0] >= 0.0:
        return ""
    foot = foot_en(line, place_en)
    side = "beyond" if ahead_m(line, place_en) > 0.0 else "before"
    clear_m, off_m = (max(0.0, float(area.clearance_m([en])[0])) for en in (place_en, foot))
    near = area.nearest_name(place_en) or "something"
    return (
        f"the line {name} is {off_m:.0f} m from {near}: no room to cross it with {margin_m:.1f} m kept clear, "
        f"{clear_m:.1f} m at the most {side} it"
    )


def wings(line: Line, area: AreaLike, way_m: float, name: str) -> tuple[Barrier, ...]:
    """Return a thin wedge from each mark of the line ``name`` outwards: what keeps a plan from going round the marks.

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
        out.append(barrier(mark, away, max(STEP_M, length_m), f"the outside of {name}"))
    return tuple(out)
