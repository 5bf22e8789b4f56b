"""A search whose close-hauled courses follow the no-go zone as it moves: for wind that gets uncertain quickly.

A lattice has its axes at one angle; when the zone opens by many degrees on the way, no angle fits. Here states are
cells of a plain grid times courses, but each state keeps the exact position and time at which its cell was first
reached, and a step is sailed at the edge of the zone at that very time (hybrid A*). Not exhaustive: the first to
reach a cell on a course closes it. What it finds is exact and goes to annealing like everything else.
"""

from __future__ import annotations

import math

import numpy as np

from companion.kernels.heap import pop, push
from companion.kernels.jit import kernel
from companion.planner.search.gauge import Gauge
from companion.planner.search.kernels import (
    Boat,
    Floats,
    Grid,
    Ints,
    is_free,
    is_refused,
    meets_target,
    speed_at,
    track,
    turn_guess,
    worst_half,
    wrap,
)
from companion.planner.search.lattice import LatticeResult
from companion.planner.search.moves import corner, edge_angle
from companion.planner.search.world import World

_FIXED = 16


@kernel
def drift_search(
    g: Grid, b: Boat, h0: float, goal: Floats, box: Floats, shape: Ints, step: float, gauge: Floats, slack: float,
    bound: float, max_pops: int, side: int,
) -> tuple[float, Floats, int]:
    """Search from the origin; return (time, points (n, 2), states expanded). Arguments as ``lattice_search``."""
    nx, ny = shape[0], shape[1]
    kinds = 4 + _FIXED
    n_states = nx * ny * kinds
    wx, wy = (box[2] - box[0]) / nx, (box[3] - box[1]) / ny
    time = np.full(n_states, np.inf)
    # Of what a state keeps only what is written is read; most states are never come to, and their pages never touched.
    px, py, course = np.empty(n_states), np.empty(n_states), np.empty(n_states)
    # What the boat has turned since its last leg with room for a turn the long way round, and its present leg so far.
    wound, run = np.empty(n_states), np.empty(n_states)
    w, r, w1, r1 = 0.0, 0.0, 0.0, 0.0
    parent = np.empty(n_states, np.int32)
    done = np.zeros(n_states, np.uint8)
    n_gauge = gauge.shape[0]
    keys, items, size = np.empty(1 << 14), np.empty(1 << 14, np.int32), 0
    best, last, end_x, end_y, via_x, via_y, with_via = bound, -2, 0.0, 0.0, 0.0, 0.0, False
    pops, s = 0, -1
    x, y, t, h = 0.0, 0.0, 0.0, h0
    while True:
        # ---- the exact end
        gx, gy = goal[0] - x, goal[1] - y
        d = math.hypot(gx, gy)
        if d <= goal[2]:
            if t < best:
                best, last, end_x, end_y, with_via = t, s, x, y, False
        elif d < 8.0 * step or pops % 64 == 0:
            f_d = (d - 0.999999 * goal[2]) / d
            ex, ey = x + gx * f_d, y + gy * f_d
            a, v = track(b, gx, gy, t)
            direct = False
            if v > 1e-9 and abs(a) <= b.max_twa:
                t1 = t + turn_guess(b, h, a)
                t2 = t1 + d * f_d / v
                if abs(a) >= worst_half(b, t1, t2):
                    direct = True
                    if t2 < best and is_free(g, x, y, ex, ey):
                        best, last, end_x, end_y, with_via = t2, s, ex, ey, False
            if not direct:
                first = 0 if gy > 0.0 else 2
                for way in range(2):
                    mx, my, t2, ok = corner(b, x, y, h, t, ex, ey, first + way, first + 1 - way)
                    if ok and t2 < best and is_free(g, x, y, mx, my) and is_free(g, mx, my, ex, ey):
                        best, last, end_x, end_y = t2, s, ex, ey
                        via_x, via_y, with_via = mx, my, True
        # ---- one step on every course
        for k in range(kinds):
            a = edge_angle(b, k, t, t) if k < 4 else -math.pi + 2.0 * math.pi * (k - 3.5) / _FIXED
            if not abs(a) <= b.max_twa or (pops == 0 and side * a < 0.0):
                continue
            v = speed_at(b, a)
            if v <= 1e-6:
                continue
            t1 = t + turn_guess(b, h, a)
            t2 = t1 + step / v
            if k < 2:
                for _ in range(6):                       # the angle at the edge of the time that the angle makes
                    settled = abs(a) >= worst_half(b, t1, t2) - 1e-7
                    if settled:
                        break
                    a = edge_angle(b, k, t1, t2)
                    v = speed_at(b, a) if abs(a) <= b.max_twa else 0.0
                    if v <= 1e-6:
                        break
                    t1 = t + turn_guess(b, h, a)
                    t2 = t1 + step / v
            if not abs(a) >= worst_half(b, t1, t2) - 2e-7 or not abs(a) <= b.max_twa:
                continue
            vx, vy = v * math.sin(a) + b.cx, v * math.cos(a) + b.cy
            if is_refused(b, a, vx, vy):
                continue
            x1, y1 = x + vx * (t2 - t1), y + vy * (t2 - t1)
            i, j = math.floor((x1 - box[0]) / wx), math.floor((y1 - box[1]) / wy)
            if i < 0 or j < 0 or i >= nx or j >= ny:
                continue
            q = (i * ny + j) * kinds + k
            if done[q] or t2 >= time[q]:
                continue
            qx, qy = goal[0] - x1, goal[1] - y1
            c = int((math.atan2(qx, qy) + math.pi) / (2.0 * math.pi) * n_gauge) % n_gauge
            f1 = t2 + max(0.0, gauge[c] * math.hypot(qx, qy) - slack)
            if f1 >= best or not is_free(g, x, y, x1, y1):
                continue
            if b.room > 0.0:
                w1, r1 = w + wrap(a - h), math.hypot(x1 - x, y1 - y)
                if abs(wrap(a - h)) < 1e-9:
                    r1 += r
                if abs(w1) > b.most_turn and s >= 0:
                    continue
                if r1 >= b.room:
                    w1 = 0.0
                wound[q], run[q] = w1, r1
            if b.targets.shape[0] > 0 and (
                meets_target(b, x, y, x, y, t, t1) or meets_target(b, x, y, x1, y1, t1, t2)
            ):
                continue
            time[q], px[q], py[q], course[q], parent[q] = t2, x1, y1, wrap(a), s
            keys, items, size = push(keys, items, size, f1, q)
        # ---- the next state
        s = -1
        while size > 0:
            f, q = keys[0], items[0]
            size = pop(keys, items, size)
            if f >= best:
                size = 0
                break
            if not done[q]:
                s = q
                break
        pops += 1
        if s < 0 or pops > max_pops:
            break
        done[s] = 1
        x, y, t, h = px[s], py[s], time[s], course[s]
        if b.room > 0.0:
            w, r = wound[s], run[s]
    if last == -2:
        return math.inf, np.empty((0, 2)), pops
    path = np.empty((4096, 2))
    path[0, 0], path[0, 1] = end_x, end_y
    count = 1
    if with_via:
        path[1, 0], path[1, 1] = via_x, via_y
        count = 2
    while last >= 0 and count < 4095:
        path[count, 0], path[count, 1] = px[last], py[last]
        count += 1
        last = parent[last]
    path[count, 0], path[count, 1] = 0.0, 0.0
    return best, path[: count + 1][::-1].copy(), pops


def run_drift(
    world: World, gauge: Gauge, *, cells: int, box: tuple[float, float, float, float], bound_s: float, max_pops: int,
    stride: float = 1.45, side: int = 0,
) -> LatticeResult:
    """Search a grid of about ``cells`` cells within ``box``, with steps ``stride`` cells long."""
    width, height = max(box[2] - box[0], 1e-3), max(box[3] - box[1], 1e-3)
    size = math.sqrt(width * height / cells)
    nx, ny = int(width / size) + 1, int(height / size) + 1
    time_s, points, pops = drift_search(
        world.grid, world.boat, world.h0, np.array([*world.goal, world.goal_radius]), np.array(box),
        np.array([nx, ny], np.int32), stride * size, gauge.table, world.goal_radius * gauge.table_max, bound_s,
        max_pops, side,
    )
    found = math.isfinite(time_s) and len(points) > 1
    return LatticeResult(cost_s=float(time_s) if found else math.inf, points=points if found else None,
                         pops=int(pops), exhausted=False)
