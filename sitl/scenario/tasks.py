"""The judge of tasks: gates in order and direction, a start at its gun, boxes kept, water seen. By the true track.

Nothing of the companion's own geometry is used: what it counts is judged by other code.

Stations. WRSC 2018: within 20 m for 5 minutes from the first point inside; the score is the radius of the circle about
the mean position that holds 95 % of the points, per boat length; the mean must be within 20 m. WRSC 2019: the mean
distance, 15 m, and sqrt(1 + N) for N touches of a buoy. SailBot: a box of 40 m, 2 points a minute up to 10, -2 a
minute after 5.5 minutes.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry.base import BaseGeometry

from companion.geofence import Mission
from companion.geofence.shapes import polygon_en
from sitl.scenario.scenario import ExpectSpec

Points = NDArray[np.float64]
Finding = tuple[str, bool, Any, Any]  # what had to hold, whether it did, its figure, what was wanted
GRID = 10  # points of a grid to a swath
EARLY = "early start"  # said by the companion


@dataclass(frozen=True, slots=True, kw_only=True)
class GateLine:
    """Two marks (port, starboard) [m], and the gun: Unix time, or counted from setting sail."""

    port_en_m: tuple[float, float]
    starboard_en_m: tuple[float, float]
    not_before_s: float | None = None
    after_s: float | None = None

    @property
    def is_start(self) -> bool:
        """Whether it has a gun."""
        return self.not_before_s is not None or self.after_s is not None


@dataclass(frozen=True, slots=True, kw_only=True)
class Tasks:
    """What a mission asks for beside places and buoys.

    The gates, laps written out; the boxes; of the searches the free water with its swath [m].
    ``epoch_s`` is the Unix time of the track's time 0.
    """

    gates: tuple[GateLine, ...] = ()
    boxes: tuple[BaseGeometry, ...] = ()
    searches: tuple[tuple[BaseGeometry, float], ...] = ()
    epoch_s: float = 0.0


def tasks_of(mission: Mission, epoch_s: float) -> Tasks:
    """Return the tasks of a mission; ``epoch_s`` is the Unix time of the track's time 0."""
    frame = mission.frame()
    lap = tuple(
        GateLine(
            port_en_m=frame.en_from_geo(g.gate.port),
            starboard_en_m=frame.en_from_geo(g.gate.starboard),
            not_before_s=g.gate.not_before_s,
            after_s=g.gate.after_s,
        )
        for g in mission.goals
        if g.gate is not None
    )
    solid = list(mission.water().polygons)
    boxes = tuple(polygon_en(g.box.shape, frame, cover=False) for g in mission.goals if g.box is not None)
    searches = tuple(
        (
            shapely.difference(
                polygon_en(g.search.shape, frame, cover=False), shapely.union_all(solid) if solid else shapely.Polygon()
            ),
            g.search.swath_m,
        )
        for g in mission.goals
        if g.search is not None
    )
    return Tasks(gates=lap * mission.skipper.laps, boxes=boxes, searches=searches, epoch_s=epoch_s)


def share_seen(track: Points, water: BaseGeometry, swath_m: float) -> float:
    """Return the share of some water that lay within half a swath of a track: of the points of a grid in it."""
    west, south, east, north = water.bounds
    fine_m = max(1.0, swath_m / GRID)
    x, y = np.meshgrid(np.arange(west + 0.5 * fine_m, east, fine_m), np.arange(south + 0.5 * fine_m, north, fine_m))
    spots = shapely.points(x.ravel(), y.ravel())
    spots = spots[shapely.covers(water, spots)]
    if not len(spots) or len(track) < 2:
        return 0.0
    line = shapely.LineString(track)
    shapely.prepare(line)
    return float(np.mean(shapely.dwithin(line, spots, 0.5 * swath_m)))


def shares_inside(t_s: Sequence[float], track: Points, boxes: Sequence[BaseGeometry], for_s: float) -> list[float]:
    """Return for each box the share of the ``for_s`` after the boat first came in that it stayed; 0: not so long there.

    A share is of samples; the track must go on for as long.
    """
    out, at = [], 0
    for box in boxes:
        times = np.asarray(t_s)[at:]
        inside = shapely.covers(box, shapely.points(track[at:])) if len(times) else np.zeros(0, dtype=bool)
        if not inside.any():
            out.append(0.0)
            continue
        first = int(np.argmax(inside))
        stay = (times >= times[first]) & (times <= times[first] + for_s)
        out.append(float(inside[stay].mean()) if times[-1] >= times[first] + for_s - 1.0 else 0.0)
        at += int(np.flatnonzero(stay)[-1])
    return out


def crossings(track: Points, pair: GateLine) -> list[tuple[int, bool]]:
    """Return where a track (n, 2) cuts the straight line between two marks: (sample before, in the direction).

    In the direction is with the port mark on the port hand: then the way from mark to mark turns right from the track.
    """
    if len(track) < 2:
        return []
    a, b = np.asarray(pair.port_en_m), np.asarray(pair.starboard_en_m)
    p, q = track[:-1], track[1:]
    side_p, side_q = _cross(b - a, p - a), _cross(b - a, q - a)
    side_a, side_b = _cross(q - p, a - p), _cross(q - p, b - p)
    cuts = ((side_p <= 0.0) != (side_q <= 0.0)) & (side_a * side_b < 0.0)
    return [(int(n), bool(side_a[n] > 0.0)) for n in np.flatnonzero(cuts)]


def _cross(u: Points, v: Points) -> Points:
    return np.asarray(u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0])


def count_gates(track: Points, gates: Sequence[GateLine], since: int = 0) -> int:
    """Return how many gates the track crosses in their order, each in its direction; from sample ``since`` on."""
    at, done = since, 0
    for pair in gates:
        found = [n for n, is_forward in crossings(track, pair) if is_forward and n >= at]
        if not found:
            break
        at, done = found[0] + 1, done + 1
    return done


def findings(
    expect: ExpectSpec, tasks: Tasks, t_s: Sequence[float], track: Points, said: frozenset[str] | set[str]
) -> Iterator[Finding]:
    """Yield what a scenario expects of tasks, and what became of it."""
    since = 0
    if expect.start_within_s is not None:
        start = next((pair for pair in tasks.gates if pair.is_start), None)
        gun_s = math.nan if start is None or not t_s else _gun_s(start, tasks, t_s[0])
        ways = [] if start is None else crossings(track, start)
        after_s = [t_s[n + 1] - gun_s for n, is_forward in ways if is_forward]
        late_s = min((s for s in after_s if s >= 0.0), default=None)
        yield (
            "start, s after the gun",
            late_s is not None and late_s <= expect.start_within_s,
            late_s,
            f"at most {expect.start_within_s}",
        )
        early = sum(s < 0.0 for s in after_s)
        yield (
            "starts before the gun",
            early == 0 or (EARLY in said and EARLY in expect.alerts),
            early,
            ("any, told and sailed again" if EARLY in expect.alerts else 0),
        )
        since = int(np.searchsorted(np.asarray(t_s), gun_s)) - 1 if math.isfinite(gun_s) else 0
    if expect.gates_crossed is not None:
        done = count_gates(track, tasks.gates, max(0, since))
        yield "gates crossed", done == expect.gates_crossed, done, expect.gates_crossed
        marks = [np.asarray(m) for pair in tasks.gates for m in (pair.port_en_m, pair.starboard_en_m)]
        near_m = min((float(np.min(np.hypot(*(track - m).T))) for m in marks), default=math.inf) if len(track) else None
        yield (
            "nearest to a gate's mark, m",
            near_m is not None and near_m > expect.marks_clear_m,
            near_m,
            (f"more than {expect.marks_clear_m}"),
        )

    if expect.inside_s is not None:
        shares = shares_inside(t_s, track, tasks.boxes, expect.inside_s)
        yield (
            f"in the box for {expect.inside_s:g} s after entry",
            bool(shares) and min(shares) >= expect.inside_share,
            shares,
            f"a share of at least {expect.inside_share}",
        )

    if expect.seen is not None:
        seen = [share_seen(track, water, swath_m) for water, swath_m in tasks.searches]
        yield "share of the water seen", bool(seen) and min(seen) >= expect.seen, seen, f"at least {expect.seen}"


def _gun_s(start: GateLine, tasks: Tasks, set_sail_s: float) -> float:
    """Return a gun in the track's time [s]."""
    if start.not_before_s is not None:
        return start.not_before_s - tasks.epoch_s
    return set_sail_s + (start.after_s or 0.0)


TASK_S = 300.0
SAILBOT_HALF_M = 20.0
SAILBOT_MINUTES_FREE = 5.5


@dataclass(frozen=True, slots=True, kw_only=True)
class StationScore:
    """The scores of one track; distances in metres."""

    kept: bool  # WRSC 2018: five minutes were sailed and their mean position is within the radius
    radius95_m: float  # WRSC 2018: about the mean position
    lengths: float  # WRSC 2018: that per boat length
    mean_m: float  # WRSC 2019: mean distance to the point
    sailbot: float  # SailBot: points, 10 at best, left out of the box in time


def station_score(
    track: NDArray[np.float64], point_en: tuple[float, float], *, radius_m: float = 20.0, length_m: float = 1.0
) -> StationScore:
    """Score the five minutes from the first point inside.

    Args:
        track: (n, 3) or wider: t [s], east, north [m].
        point_en: the station.
        radius_m: of the task's circle.
        length_m: of the boat.

    """
    d = np.hypot(track[:, 1] - point_en[0], track[:, 2] - point_en[1])
    inside = np.flatnonzero(d <= radius_m)
    if not inside.size:
        return StationScore(kept=False, radius95_m=math.inf, lengths=math.inf, mean_m=math.inf, sailbot=0.0)
    begin = float(track[inside[0], 0])
    during = (track[:, 0] >= begin) & (track[:, 0] <= begin + TASK_S)
    p = track[during, 1:3]
    mean = p.mean(axis=0)
    # The organisers' rule: the farthest of the nearest 95 % of the points, their number rounded.
    apart = np.sort(np.hypot(p[:, 0] - mean[0], p[:, 1] - mean[1]))
    radius95 = float(apart[max(0, round(0.95 * len(apart)) - 1)])
    long_enough = float(track[during, 0][-1]) - begin >= TASK_S - 1.5
    return StationScore(
        kept=long_enough and math.dist((float(mean[0]), float(mean[1])), point_en) < radius_m,
        radius95_m=radius95,
        lengths=radius95 / length_m,
        mean_m=float(d[during].mean()),
        sailbot=sailbot_points(track, point_en),
    )


def sailbot_points(track: NDArray[np.float64], point_en: tuple[float, float]) -> float:
    """Return SailBot's points: 2 per minute inside the box up to 10, -2 per minute inside after 5.5 minutes.

    The track counts from its first point inside; minutes outside are not counted.
    """
    inside = np.max(np.abs(track[:, 1:3] - np.asarray(point_en)), axis=1) <= SAILBOT_HALF_M
    if not inside.any():
        return 0.0
    t = track[:, 0] - track[int(np.argmax(inside)), 0]
    dt = np.diff(t, append=t[-1])
    free = SAILBOT_MINUTES_FREE * 60.0
    early = float(np.sum(dt[inside & (t >= 0.0) & (t < TASK_S)])) / 60.0
    late = float(np.sum(dt[inside & (t >= free)])) / 60.0
    return max(0.0, min(10.0, 2.0 * early) - 2.0 * late)
