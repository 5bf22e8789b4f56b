"""What is expected of a path: the least clearance of the hull on the track that the autopilot will sail along it.

Of a leg that is sailed it is the distance of the predicted track from what is solid, less the prediction's own stated
error and the hull's reach. Of one that is left to the autopilot to beat it is what is kept, at each board, with the
problem's probability: the leg is sailed in winds drawn from the forecast's spread.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
import shapely
from numpy.typing import NDArray

from companion.boat.tracking import (
    CURVE_NODES,
    PredictedTrack,
    are_near_short,
    drawn_winds,
    loop_m,
    predict,
    stated_error_m,
)
from companion.planner.plan import Leg
from companion.planner.problem.evaluate import evaluate
from companion.planner.problem.tracking import Tracking
from companion.planner.problem.value import Problem

RUN_UP_M = 40.0  # of the leg before the start: the boat is on it, and rounds the corner between
BESIDE_M = 15.0  # of that leg's end the corner is the plan's; within this of the boat's own place the error grows
SPARE_M = 0.3  # a start that is nearer than the floor need come no nearer than this more
SIGMA_AT_S = 60.0  # horizon at which the spread is taken for boards
STRIDE = 10  # places of a track, a fifth of a second apart


@dataclass(frozen=True, slots=True, kw_only=True)
class ExpectedTrack:
    """What is expected of a path.

    Attributes:
        clearance_m: Least clearance of the hull, inf where nothing is solid [m].
        at_en: Where, and ``leg`` on which leg of the path.
        is_kept: Whether the floor is, everywhere; at a start that is nearer it only comes no nearer.
        lack_m: How far the worst place is below what it needs [m], 0 where none is.
        error_m: The prediction's own stated error there, loops left aside [m].
        worst_en: Where that is, and ``near_en`` the place of something solid that it is near to.
        worst_leg: On which leg.
        is_beat: The worst place is on a leg that is left to the autopilot.

    """

    clearance_m: float = math.inf
    at_en: tuple[float, float] | None = None
    leg: int = 0
    is_kept: bool = True
    lack_m: float = 0.0
    error_m: float = 0.0
    worst_en: tuple[float, float] | None = None
    near_en: tuple[float, float] | None = None
    worst_leg: int = 0
    is_beat: bool = False

    @property
    def is_within_error(self) -> bool:
        """Whether the floor is kept, or lacks no more than the prediction's own error."""
        return self.lack_m <= self.error_m


@lru_cache(maxsize=8)  # by identity
def curve_mps(problem: Problem) -> NDArray[np.float64]:
    """Return the problem's polar by the bow's angle, as the prediction takes it; the problem's is the course's."""
    boat, bows = problem.boat, np.linspace(0.0, math.pi, CURVE_NODES)
    return np.interp(bows + leeway_rad(problem), boat.polar_twa_rad, boat.polar_mps)


@lru_cache(maxsize=8)  # by identity
def leeway_rad(problem: Problem) -> NDArray[np.float64]:
    """Return how far to leeward of its bow the problem's boat goes, as the prediction takes it."""
    slips = problem.tracking.leeway_rad if problem.tracking is not None else ()
    bows = np.linspace(0.0, math.pi, CURVE_NODES)
    return np.interp(bows, np.linspace(0.0, math.pi, len(slips)), slips) if slips else np.zeros(CURVE_NODES)


def expected(
    problem: Problem,
    waypoints_en: Sequence[Sequence[float]] | NDArray[np.float64],
    legs: Sequence[Leg] | None = None,
    *,
    has_boards: bool = True,
    has_loops: bool = True,
    part: slice | None = None,
    sailed_m: float = 0.0,
) -> ExpectedTrack:
    """Return what is expected of a path of a problem that has ``tracking``.

    Args:
        problem: With its tracking.
        waypoints_en: (n, 2), the start first.
        legs: What the scorer says of the path; None: it is asked.
        has_boards: Look at the boards of legs that are left to the autopilot, which takes its time.
        has_loops: Allow for a loop about the ends of legs that are too short to be followed.
        part: Of which waypoints, the whole path otherwise: it comes to them along the leg before.
        sailed_m: Of the first leg, which is as much longer than what is left of it.

    """
    tracking = problem.tracking
    assert tracking is not None
    path = np.asarray(waypoints_en, dtype=np.float64).reshape(-1, 2)
    path = path[np.concatenate([[True], np.hypot(*np.diff(path, axis=0).T) > 1e-6])]
    if len(path) < 2 or len(tracking.tree.geometries) == 0:
        return ExpectedTrack()
    if legs is None:
        legs = evaluate(problem, path).legs
    beats = tuple(leg.is_beat for leg in legs) if len(legs) == len(path) - 1 else (False,) * (len(path) - 1)
    begin, end, _ = (part or slice(None)).indices(len(path))
    before = tracking.before_en if begin == 0 else _point(path[begin - 1])
    seen = _expected(
        problem,
        path[begin:end].tobytes(),
        beats[begin : end - 1],
        before,
        has_boards,
        has_loops,
        0.0 if begin else sailed_m,
    )
    return replace(seen, leg=seen.leg + begin, worst_leg=seen.worst_leg + begin) if begin else seen


@lru_cache(maxsize=32)  # by identity: a search's best path is asked for again when the plan is written
def _expected(
    problem: Problem,
    path_bytes: bytes,
    is_beat: tuple[bool, ...],
    before_en: tuple[float, float] | None,
    has_boards: bool,
    has_loops: bool,
    sailed_m: float,
) -> ExpectedTrack:
    tracking = problem.tracking
    assert tracking is not None
    path, beats = np.frombuffer(path_bytes).reshape(-1, 2), np.array(is_beat)
    whole, first, en, leg, distance = _tracked(problem, path_bytes, before_en)
    curve = curve_mps(problem)
    best = float(np.max(curve))
    lengths_m = np.hypot(*np.diff(whole, axis=0).T)
    lengths_m[first] += sailed_m
    near = are_near_short(lengths_m, best)[first:]
    stated_m = stated_error_m(best, tracking.helm, has_short=not tracking.is_known)
    error = np.where(near & has_loops, loop_m(best, tracking.helm), stated_m)[leg]
    if not first:
        error = error * np.minimum(1.0, np.hypot(*(en - path[0]).T) / BESIDE_M)  # where the boat begins is known
    room = distance - error - tracking.reach_m
    need = np.full(len(room), tracking.floor_m)
    clear = np.flatnonzero(room >= need)
    begin = int(clear[0]) if len(clear) else len(room)
    need[:begin] = np.minimum(need[:begin], room[0] - SPARE_M)  # nearer already, where the boat begins
    is_beaten = beats[leg]
    judged = np.where(is_beaten, math.inf, room)
    lack = np.where(is_beaten, 0.0, np.maximum(0.0, need - room))
    worst, least = int(np.argmax(lack)), int(np.argmin(judged))
    found = ExpectedTrack(
        clearance_m=float(judged[least]),
        at_en=_point(en[least]),
        leg=int(leg[least]),
        is_kept=not lack[worst] > 0.0,
        lack_m=float(lack[worst]),
        error_m=min(float(error[worst]), stated_m),
        worst_en=_point(en[worst]),
        near_en=_nearest(tracking, en[worst]),
        worst_leg=int(leg[worst]),
    )
    if not has_boards or not beats.any():
        return found
    return _with_boards(tracking, found, _worst_boards(problem, path_bytes, is_beat, before_en))


@lru_cache(maxsize=4)  # by identity: the same with loops and without, asked for one after the other
def _tracked(
    problem: Problem, path_bytes: bytes, before_en: tuple[float, float] | None
) -> tuple[NDArray[np.float64], int, NDArray[np.float64], NDArray[np.int64], NDArray[np.float64]]:
    """Return the path behind its run-up, how many legs that is, and the predicted track that is judged.

    Of the track: places (m, 2), their legs of the path, and their distances from what is solid [m].
    """
    tracking = problem.tracking
    assert tracking is not None
    path = np.frombuffer(path_bytes).reshape(-1, 2)
    whole, first = _with_run_up(before_en, path)
    track = predict(
        whole,
        tracking.helm,
        curve_mps=curve_mps(problem),
        twd_from_rad=problem.wind.twd_from_rad,
        heading_rad=None if first else problem.start_heading_rad,
        leeway_rad=leeway_rad(problem),
        current_en_mps=problem.current.en_mps,
        ground_turn_rad=problem.ground_turn_rad,
    )
    leg = track.leg - first
    mine = (leg >= 0) | (np.hypot(*(track.en_m - path[0]).T) < BESIDE_M)
    if not mine.any():  # a boat that turns too wide for the corner before never comes onto it: what she sails is judged
        mine[:] = True
    en = track.en_m[mine]
    return whole, first, en, np.maximum(leg[mine], 0), tracking.distance_m(en)


def _with_run_up(before_en: tuple[float, float] | None, path: NDArray[np.float64]) -> tuple[NDArray[np.float64], int]:
    """Return the path behind a run-up on the leg before its start, and how many legs that is."""
    if before_en is None:
        return path, 0
    back = np.asarray(before_en) - path[0]
    length = float(np.hypot(*back))
    if length < 1.0:
        return path, 0
    return np.vstack([path[0] + back * min(1.0, RUN_UP_M / length), path]), 1


def _with_boards(
    tracking: Tracking, found: ExpectedTrack, boards: tuple[tuple[int, float, tuple[float, float]], ...]
) -> ExpectedTrack:
    """Return what is expected with the legs that are beaten: at each board, with probability delta_s."""
    out = found
    for leg, room, place in boards:
        if room < out.clearance_m:
            out = _changed(out, clearance_m=room, at_en=place, leg=leg)
        lack = tracking.floor_m - room
        if lack > max(out.lack_m, 1e-9):
            out = _changed(
                out,
                is_kept=False,
                lack_m=lack,
                error_m=0.0,
                worst_en=place,
                worst_leg=leg,
                is_beat=True,
                near_en=_nearest(tracking, np.asarray(place)),
            )
    return out


@lru_cache(maxsize=32)  # by identity: the same with loops and without
def _worst_boards(
    problem: Problem, path_bytes: bytes, is_beat: tuple[bool, ...], before_en: tuple[float, float] | None
) -> tuple[tuple[int, float, tuple[float, float]], ...]:
    """Return of each board of the legs that are beaten: the leg, and what is kept with probability delta_s, and where.

    The legs are sailed in winds drawn from the forecast's spread.
    """
    tracking = problem.tracking
    assert tracking is not None
    whole, first = _with_run_up(before_en, np.frombuffer(path_bytes).reshape(-1, 2))
    beats = np.flatnonzero(is_beat)
    sigma = problem.wind.sigma.at(SIGMA_AT_S)
    curve = curve_mps(problem)
    length_s = 4.0 * float(np.sum(np.hypot(*np.diff(whole, axis=0).T))) / max(float(np.max(curve)), 0.1) + 60.0
    twd = problem.wind.twd_from_rad
    winds = (
        drawn_winds(twd, sigma_rad=sigma, tau_s=tracking.correlation_s, length_s=length_s)
        if sigma > 0.0
        else (np.array([[twd]]))
    )
    whole = whole[: first + int(beats[-1]) + 3]  # what comes later is nothing to it
    tracks = [
        predict(
            whole,
            tracking.helm,
            curve_mps=curve,
            twd_from_rad=wind,
            heading_rad=None if first else problem.start_heading_rad,
            leeway_rad=leeway_rad(problem),
            current_en_mps=problem.current.en_mps,
            ground_turn_rad=problem.ground_turn_rad,
        )
        for wind in winds
    ]
    found: list[tuple[int, float, tuple[float, float]]] = []
    for n in map(int, beats):
        for rows in _boards(tracking, tracks, whole, n + first):
            if len(rows) < 0.25 * len(tracks):
                continue  # few winds bring the boat there at all
            rows.sort()
            room, place = rows[math.floor((1.0 - problem.delta_s) * len(rows) + 1e-9)]
            found.append((n, room, place))
    return tuple(found)


def _boards(
    tracking: Tracking, tracks: Sequence[PredictedTrack], whole: NDArray[np.float64], leg: int
) -> list[list[tuple[float, tuple[float, float]]]]:
    """Return of each board's length of a leg, for each track that comes there: the least clearance, and where."""
    on_leg = [track.en_m[track.leg == leg] for track in tracks]
    en = np.concatenate(on_leg)
    if not len(en):
        return []
    a, b = whole[leg], whole[leg + 1]
    along = (b - a) / max(float(np.hypot(*(b - a))), 1e-6)
    board = np.floor(((en - a) @ along) / (2.0 * max(tracking.helm.corridor_m, 1.0))).astype(np.int64)
    track = np.repeat(np.arange(len(tracks)), [len(each) for each in on_leg])
    _, group = np.unique(track * (int(np.ptp(board)) + 1) + board, return_inverse=True)
    rows: dict[int, list[tuple[float, tuple[float, float]]]] = {}
    for i, distance in _nearest_of_each(tracking, en, group):
        rows.setdefault(int(board[i]), []).append((distance - tracking.reach_m, _point(en[i])))
    return list(rows.values())


def _nearest_of_each(tracking: Tracking, en: NDArray[np.float64], group: NDArray[np.int64]) -> list[tuple[int, float]]:
    """Return of each group of places, numbered from 0, which comes nearest to anything solid, and how near.

    Distance changes by no more than one moves: of the places between every ``STRIDE``-th only those are measured that
    could be nearer than what their group has already.
    """
    coarse = np.arange(0, len(en), STRIDE)
    distance = np.full(len(en), math.inf)
    distance[coarse] = tracking.distance_m(en[coarse])
    least = np.full(int(group.max()) + 1, math.inf)
    np.minimum.at(least, group, distance)
    before = np.arange(len(en)) // STRIDE * STRIDE
    could = distance[before] - np.hypot(*(en - en[before]).T) < least[group]
    could[coarse] = False
    distance[could] = tracking.distance_m(en[could])
    order = np.lexsort((distance, group))
    firsts = order[np.searchsorted(group[order], np.arange(len(least)))]
    return [(int(i), float(distance[i])) for i in firsts]


def _nearest(tracking: Tracking, en: NDArray[np.float64]) -> tuple[float, float]:
    shape = tracking.tree.geometries[int(tracking.tree.nearest(shapely.Point(en)))]
    line = shapely.shortest_line(shape, shapely.Point(en))
    return _point(np.asarray(line.coords[0]))


def _point(en: NDArray[np.float64]) -> tuple[float, float]:
    return float(en[0]), float(en[1])


def _changed(value: ExpectedTrack, **changes: object) -> ExpectedTrack:
    return replace(value, **changes)  # type: ignore[arg-type]
