"""Corners that the autopilot can follow: no leg so short that its target falls behind the boat.

ArduRover follows a point that runs along the legs and slows down for each corner; a sailboat cannot. On a leg shorter
than about four seconds of her speed she overtakes the point and turns round to it: a loop of 6 to 11 m beside the
line, at corners of 5 degrees as at those of 60 (measured on the simulated autopilot; the real 4.5.2 does the same).
A planner that rounds a rock makes such legs. Here two of their corners become one, where the legs before and after
them meet, or one of them goes.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from companion.skipper.way.geometry import distance_m
from companion.skipper.way.voyage import PointEn

LEAST_LEG_S = 4.5     # of the boat's best speed: 4 s were too short for some corners, and gusts make her faster
MEET_M = 60.0         # two legs that meet farther away than this from their corners do not meet
AT_MOST = 40          # corners looked at in one path


@dataclass(frozen=True, slots=True, kw_only=True)
class Quality:
    """How good a path is.

    Attributes:
        is_feasible: It passes the planner's own check.
        is_sailable: The boat can sail it in the present wind, and it goes round nothing on the wrong side.
        clearance_m: Its least distance to anything solid [m].
        time_s: What it takes [s].

    """

    is_feasible: bool
    is_sailable: bool
    clearance_m: float
    time_s: float

    def is_sound(self, floor_m: float) -> bool:
        """Return whether it may be sailed."""
        return self.is_feasible or (self.is_sailable and self.clearance_m >= floor_m)

    def rank(self) -> tuple[bool, float, float]:
        """Return what sorts paths, the best first: by time where the planner has nothing against them, else by room."""
        return (not self.is_feasible, 0.0 if self.is_feasible else -self.clearance_m, self.time_s)


def spread(
    points: Sequence[PointEn], *, least_m: float, floor_m: float, quality: Callable[[list[PointEn]], Quality],
) -> list[PointEn]:
    """Return the path without legs shorter than ``least_m``, as far as that is possible.

    Args:
        points: The path, its start first; start and end stay.
        least_m: What the autopilot can follow [m].
        floor_m: What the path must keep clear at the least [m]; one that is nearer already need only get no nearer.
        quality: How good a path is.

    """
    path = list(points)
    floor_m = min(floor_m, quality(path).clearance_m)
    for _ in range(AT_MOST):
        shorts = [n for n in range(len(path) - 1) if distance_m(path[n], path[n + 1]) < least_m]
        better = next((b for n in shorts if (b := _without(path, n, floor_m, quality)) is not None), None)
        if better is None:
            return path
        path = better
    return path


def _without(
    path: list[PointEn], n: int, floor_m: float, quality: Callable[[list[PointEn]], Quality],
) -> list[PointEn] | None:
    """Return the best path without the leg from corner ``n`` to the next, None where there is none."""
    last = len(path) - 1
    options: list[list[PointEn]] = []
    if n > 0 and n + 1 < last:
        meet = _meeting(path[n - 1], path[n], path[n + 1], path[n + 2])
        if meet is not None:
            options.append([*path[:n], meet, *path[n + 2:]])
    if n > 0:
        options.append([*path[:n], *path[n + 1:]])
    if n + 1 < last:
        options.append([*path[:n + 1], *path[n + 2:]])
    judged = [(quality(option), option) for option in options]
    sound = [(q.rank(), option) for q, option in judged if q.is_sound(floor_m)]
    return min(sound)[1] if sound else None


def _meeting(a: PointEn, b: PointEn, c: PointEn, d: PointEn) -> PointEn | None:
    """Return where the leg from a to b, sailed on, meets the leg from c to d, sailed back; None where they do not."""
    ux, uy = b[0] - a[0], b[1] - a[1]
    vx, vy = c[0] - d[0], c[1] - d[1]
    cross = ux * vy - uy * vx
    if abs(cross) < 1e-6 * max(1.0, math.hypot(ux, uy) * math.hypot(vx, vy)):
        return None
    wx, wy = c[0] - b[0], c[1] - b[1]
    along, back = (wx * vy - wy * vx) / cross, (wx * uy - wy * ux) / cross
    if along < 0.0 or back < 0.0:
        return None
    meet = (b[0] + along * ux, b[1] + along * uy)
    return meet if max(distance_m(b, meet), distance_m(c, meet)) <= MEET_M else None
