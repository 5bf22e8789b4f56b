"""A search whose close-hauled courses follow the no-go zone as it moves: for wind that gets uncertain quickly.

A lattice has its axes at one angle; when the zone opens by many degrees on the way, no angle fits. Here states are
cells of a plain grid times courses, but each state keeps the exact position and time at which its cell was first
reached, and a step is sailed at the edge of the zone at that very time (hybrid A*). Not exhaustive: the first to
reach a cell on a course closes it. What it finds is exact and goes to annealing like everything else.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from companion.geo.kernels import meets_discs
from companion.kernels.heap import pop, push
from companion.kernels.jit import kernel
from companion.planner.search.gauge import Aim, Gauge, least_from
from companion.planner.search.kernels import (
    BoatModel,
    Floats,
    Ints,
    SegmentGrid,
    is_free,
    is_refused,
    speed_at,
    track,
    turn_guess,
    worst_half,
    wrap,
)
from companion.planner.search.lattice import End, LatticeResult, by_corner, nearest_of
from companion.planner.search.moves import edge_angle
from companion.planner.search.world import SearchWorld

_EDGES = 4
_FIXED = 16
_COURSES = _EDGES + _FIXED
"""Courses to go on by: close hauled and at the best gybing angle on either tack, and fixed ones all round."""


class Cells(NamedTuple):
    """The cells of a grid: ``nx`` by ``ny`` within x0, y0, x1, y1 of ``box`` [m]."""

    nx: int
    ny: int
    box: Floats


class States(NamedTuple):
    """How each state, a cell and a course, was first reached: in the row ``row`` of the others, -1 where it was not.

    The arrival ``time`` [s], the exact place ``x``, ``y`` [m], the ``course`` (TWA) [rad] and the row ``before`` it
    (-1: the start); where the boat needs room to gybe round, what it has turned since its last leg with room for that,
    ``wound`` [rad, signed], and its present leg so far, ``run`` [m]. Rows are in the order in which states are reached:
    there is memory for all, and only what is written takes any.
    """

    row: Ints
    time: Floats
    x: Floats
    y: Floats
    course: Floats
    wound: Floats
    run: Floats
    before: Ints


class Leg(NamedTuple):
    """One step: TWA [rad] (NaN: there is none), begin and end in time [s], velocity over the ground [m/s]."""

    angle: float
    t1: float
    t2: float
    vx: float
    vy: float


@kernel
def _end_from(g: SegmentGrid, b: BoatModel, aim: Aim, x: float, y: float, h: float, t: float, bound: float) -> End:
    """Return the exact end, by the straight leg or, where that is no course, by two; at inf: none before ``bound``."""
    ex, ey, length = nearest_of(aim, x, y)
    a, v = track(b, aim.x - x, aim.y - y, t)
    if v > 1e-9 and abs(a) <= b.max_twa:
        t1 = t + turn_guess(b, h, a)
        t2 = t1 + length / v
        if abs(a) >= worst_half(b, t1, t2):
            is_open = t2 < bound and is_free(g, x, y, ex, ey)
            return End(t2 if is_open else math.inf, ex, ey, 0.0, 0.0, False)
    return by_corner(g, b, aim, x, y, h, t, bound, False)


@kernel
def _edge_leg(b: BoatModel, k: int, t: float, h: float, step: float) -> Leg:
    """Return the leg of ``step`` metres through the water on edge course ``k``, begun at time t from TWA h."""
    none = Leg(math.nan, t, t, 0.0, 0.0)
    a = edge_angle(b, k, t, t)
    if not abs(a) <= b.max_twa:
        return none
    v = speed_at(b, a)
    if v <= 1e-6:
        return none
    t1 = t + turn_guess(b, h, a)
    t2 = t1 + step / v
    if k < 2:
        for _ in range(6):  # the angle at the edge of the time that the angle makes
            if abs(a) >= worst_half(b, t1, t2) - 1e-7:
                break
            a = edge_angle(b, k, t1, t2)
            v = speed_at(b, a) if abs(a) <= b.max_twa else 0.0
            if v <= 1e-6:
                break
            t1 = t + turn_guess(b, h, a)
            t2 = t1 + step / v
    if not abs(a) >= worst_half(b, t1, t2) - 2e-7 or not abs(a) <= b.max_twa:
        return none
    vx, vy = v * math.sin(a) + b.cx, v * math.cos(a) + b.cy
    return none if is_refused(b, a, vx, vy) else Leg(a, t1, t2, vx, vy)


@kernel
def _fixed_courses(b: BoatModel) -> Floats:
    """Return rows of TWA [rad] (NaN: it cannot be sailed) and speed through the water [m/s]."""
    courses = np.full((_FIXED, 2), np.nan)
    for n in range(_FIXED):
        a = -math.pi + 2.0 * math.pi * (n + 0.5) / _FIXED
        v = speed_at(b, a) if abs(a) <= b.max_twa else 0.0
        if v > 1e-6 and not is_refused(b, a, v * math.sin(a) + b.cx, v * math.cos(a) + b.cy):
            courses[n, 0], courses[n, 1] = a, v
    return courses


@kernel
def _fixed_leg(b: BoatModel, a: float, v: float, t: float, h: float, step: float) -> Leg:
    """Return the leg of ``step`` metres through the water at TWA ``a`` and speed ``v``, begun at time t from TWA h."""
    t1 = t + turn_guess(b, h, a)
    t2 = t1 + step / v
    is_open = abs(a) >= worst_half(b, t1, t2) - 2e-7
    return Leg(a if is_open else math.nan, t1, t2, v * math.sin(a) + b.cx, v * math.cos(a) + b.cy)


@kernel
def _states(n: int) -> States:
    """Return ``n`` states that were not reached."""
    return States(
        np.full(n, np.int32(-1)),
        np.empty(n),
        np.empty(n),
        np.empty(n),
        np.empty(n),
        np.empty(n),
        np.empty(n),
        np.empty(n, np.int32),
    )


@kernel
def _way_back(reached: States, s: int, end: End) -> Floats:
    """Return the points (n, 2) from the start by way of the state in row ``s`` to the end."""
    path = np.empty((4096, 2))
    path[0, 0], path[0, 1] = end.x, end.y
    count = 1
    if end.by_corner:
        path[1, 0], path[1, 1] = end.via_x, end.via_y
        count = 2
    while s >= 0 and count < 4095:
        path[count, 0], path[count, 1] = reached.x[s], reached.y[s]
        count += 1
        s = reached.before[s]
    path[count, 0], path[count, 1] = 0.0, 0.0
    return path[: count + 1][::-1].copy()


@kernel
def drift_search(
    g: SegmentGrid, b: BoatModel, cells: Cells, h0: float, aim: Aim, step: float, bound: float, max_pops: int, side: int
) -> tuple[float, Floats, int]:
    """Search from (0, 0) at time 0 and TWA ``h0`` [rad]; return (time [s], points (n, 2), states expanded).

    Only paths below ``bound`` [s] are looked for, by steps of ``step`` metres; ``side`` 1 or -1 starts on courses with
    that sign of TWA only.
    """
    wx, wy = (cells.box[2] - cells.box[0]) / cells.nx, (cells.box[3] - cells.box[1]) / cells.ny
    reached = _states(cells.nx * cells.ny * _COURSES)
    done = np.zeros(cells.nx * cells.ny * _COURSES, np.uint8)
    keys, items, size = np.empty(1 << 14), np.empty(1 << 14, np.int32), 0
    fixed = _fixed_courses(b)
    end, last = End(bound, 0.0, 0.0, 0.0, 0.0, False), -2
    pops, s, rows = 0, -1, 0
    x, y, t, h, wound, run = 0.0, 0.0, 0.0, h0, 0.0, 0.0
    while True:
        d = math.hypot(aim.x - x, aim.y - y)
        if d <= aim.radius:
            if t < end.t:
                end, last = End(t, x, y, 0.0, 0.0, False), s
        elif d < 8.0 * step or pops % 64 == 0:
            shot = _end_from(g, b, aim, x, y, h, t, end.t)
            if shot.t < end.t:
                end, last = shot, s
        for k in range(_COURSES):
            if k < _EDGES:
                leg = _edge_leg(b, k, t, h, step)
            elif math.isnan(fixed[k - _EDGES, 0]):
                continue
            else:
                leg = _fixed_leg(b, fixed[k - _EDGES, 0], fixed[k - _EDGES, 1], t, h, step)
            if math.isnan(leg.angle) or (pops == 0 and side * leg.angle < 0.0):
                continue
            x1, y1 = x + leg.vx * (leg.t2 - leg.t1), y + leg.vy * (leg.t2 - leg.t1)
            i, j = math.floor((x1 - cells.box[0]) / wx), math.floor((y1 - cells.box[1]) / wy)
            if i < 0 or j < 0 or i >= cells.nx or j >= cells.ny:
                continue
            q = (i * cells.ny + j) * _COURSES + k
            r = reached.row[q]
            if done[q] or (r >= 0 and leg.t2 >= reached.time[r]):
                continue
            f1 = leg.t2 + least_from(aim, x1, y1)
            if f1 >= end.t or not is_free(g, x, y, x1, y1):
                continue
            wound1, run1 = 0.0, 0.0
            if b.room > 0.0:
                turned = wrap(leg.angle - h)
                wound1, run1 = wound + turned, math.hypot(x1 - x, y1 - y)
                if abs(turned) < 1e-9:
                    run1 += run
                if abs(wound1) > b.most_turn and s >= 0:
                    continue
                wound1 = 0.0 if run1 >= b.room else wound1
                if r >= 0:
                    reached.wound[r], reached.run[r] = wound1, run1
            if b.targets.shape[0] > 0 and (
                meets_discs(b.targets, x, y, x, y, t, leg.t1) or meets_discs(b.targets, x, y, x1, y1, leg.t1, leg.t2)
            ):
                continue
            if r < 0:
                r, rows = rows, rows + 1
                reached.row[q] = r
                if b.room > 0.0:
                    reached.wound[r], reached.run[r] = wound1, run1
            reached.time[r], reached.x[r], reached.y[r], reached.course[r] = leg.t2, x1, y1, wrap(leg.angle)
            reached.before[r] = s
            keys, items, size = push(keys, items, size, f1, q)
        s = -1
        while size > 0 and s < 0:
            f, q = keys[0], items[0]
            size = pop(keys, items, size) if f < end.t else 0
            if f < end.t and not done[q]:
                s = q
        pops += 1
        if s < 0 or pops > max_pops:
            break
        done[s] = 1
        s = reached.row[s]
        x, y, t, h = reached.x[s], reached.y[s], reached.time[s], reached.course[s]
        if b.room > 0.0:
            wound, run = reached.wound[s], reached.run[s]
    if last == -2:
        return math.inf, np.empty((0, 2)), pops
    return end.t, _way_back(reached, last, end), pops


def run_drift(
    world: SearchWorld,
    gauge: Gauge,
    *,
    cells: int,
    box: tuple[float, float, float, float],
    bound_s: float,
    max_pops: int,
    stride: float = 1.45,
    side: int = 0,
) -> LatticeResult:
    """Search a grid of about ``cells`` cells within ``box``, with steps ``stride`` cells long."""
    width, height = max(box[2] - box[0], 1e-3), max(box[3] - box[1], 1e-3)
    size = math.sqrt(width * height / cells)
    time_s, points, pops = drift_search(
        world.grid,
        world.boat,
        Cells(int(width / size) + 1, int(height / size) + 1, np.array(box)),
        world.h0,
        gauge.aim(*world.goal, world.goal_radius),
        stride * size,
        bound_s,
        max_pops,
        side,
    )
    found = math.isfinite(time_s) and len(points) > 1
    return LatticeResult(cost_s=float(time_s) if found else math.inf, points=points if found else None, pops=int(pops))
