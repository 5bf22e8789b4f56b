"""A* on a lattice sheared to the close-hauled courses: beating is exact on it, whatever the angle.

The axes of the lattice are the unit vectors of the two close-hauled (or, down wind, the two gybing) courses, so a
beat moves along its axes with no rounding of angles. A state is (node, course); turning in place to the next
course costs its angle over the turn rate, so every path on the lattice has its true cost. The cost so far is also
the time, at which the no-go zone and moving targets are checked. A state near the goal tries the exact last leg,
or the exact last two.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from companion.kernels.heap import pop, push
from companion.kernels.jit import kernel
from companion.planner.search.gauge import Gauge
from companion.planner.search.kernels import (
    SLACK_RAD,
    BoatModel,
    Floats,
    Ints,
    SegmentGrid,
    is_free,
    is_refused,
    meets_target,
    speed_at,
    track,
    turn_guess,
    turn_time,
    worst_half,
    wrap,
)
from companion.planner.search.moves import corner, edge_angle
from companion.planner.search.world import SearchWorld

LEAST_SINE = 0.1  # of the angle between a lattice's axes
_START, _CLOCKWISE, _COUNTER, _MOVE, _ROUND = 1, 2, 3, 4, 5


@kernel
def _misses(b: BoatModel, x: float, y: float, h: float, t: float, mx: float, my: float, ex: float, ey: float) -> bool:
    """Do the two legs by way of (mx, my) keep clear of every target?"""
    for leg in range(2):
        qx, qy = (mx, my) if leg == 0 else (ex, ey)
        a, v = track(b, qx - x, qy - y, t)
        t1 = t + turn_guess(b, h, a)
        t2 = t1 + math.hypot(qx - x, qy - y) / max(v, 1e-9)
        if meets_target(b, x, y, x, y, t, t1) or meets_target(b, x, y, qx, qy, t1, t2):
            return False
        x, y, h, t = qx, qy, a, t2
    return True


@kernel
def _wound(
    b: BoatModel,
    came: NDArray[np.uint8],
    s: int,
    nj: int,
    steps: Ints,
    angle: Floats,
    lengths: Floats,
    h0: float,
    deep: float,
) -> float:
    """Return how far the boat has turned [rad, signed] in state ``s`` since its last leg as long as ``b.room``.

    ``lengths``: of one step on each course [m]; a turn the long way round goes by a leg at TWA ``deep``.
    """
    nd = steps.shape[0]
    wound, length = 0.0, 0.0
    for _ in range(256):
        node, k = s // nd, s % nd
        label = came[s]
        if label == _START:
            return wound + wrap(angle[k] - h0)
        if label == _ROUND:
            return wound + wrap(angle[k] - deep)
        if label == _MOVE:
            length += lengths[k]
            if length >= b.room:
                return wound
            s = (node - steps[k, 0] * nj - steps[k, 1]) * nd + k
        else:
            length = 0.0
            before = (k - 1) % nd if label == _CLOCKWISE else (k + 1) % nd
            wound += wrap(angle[k] - angle[before])
            s = node * nd + before
    return wound


@kernel
def lattice_search(
    g: SegmentGrid,
    b: BoatModel,
    origin: Floats,
    axes: Floats,
    shape: Ints,
    steps: Ints,
    goal: Floats,
    box: Floats,
    gauge: Floats,
    slack: float,
    bound: float,
    max_pops: int,
    shot_m: float,
    side: int,
) -> tuple[float, Floats, int]:
    """Search; return (arrival time, points (n, 2), states expanded).

    ``origin``: x, y, TWA and time of the start;
    ``axes`` (2, 2): axis vectors in rows [m]; ``shape``: ni, nj, i0, j0 of the start, and the
    leg of a turn the long way round as a lattice step (0, 0: none); ``steps`` (nd, 2): courses as
    lattice steps, sorted by angle; ``goal``: x, y, radius; ``box``: x0, y0, x1, y1 that nodes stay in; ``gauge``:
    least seconds per metre by direction (a table over [-π, π)), ``slack`` what the goal's disc saves; only paths
    below ``bound`` are looked for; ``side`` 1 or -1 starts on courses with that sign of TWA only. Exhausted without a
    path: there is none on this lattice within the bound.
    """
    ni, nj, i0, j0 = shape[0], shape[1], shape[2], shape[3]
    ox, oy, h0, t0 = origin[0], origin[1], origin[2], origin[3]
    nd = steps.shape[0]
    dx, dy = np.empty(nd), np.empty(nd)
    angle, duration, turn = np.empty(nd), np.empty(nd), np.empty(nd)
    for k in range(nd):
        dx[k] = steps[k, 0] * axes[0, 0] + steps[k, 1] * axes[1, 0]
        dy[k] = steps[k, 0] * axes[0, 1] + steps[k, 1] * axes[1, 1]
        a, v = track(b, dx[k], dy[k], 0.0)
        angle[k], duration[k] = a, (math.hypot(dx[k], dy[k]) / v if v > 1e-9 else math.inf)
    for k in range(nd):
        turn[k] = turn_time(b, angle[k], angle[(k + 1) % nd])
    # The way round from close-hauled to close-hauled: the leg (jump, hop) to leeward, with the room for it.
    lengths = np.hypot(dx, dy)
    jump, hop = shape[4], shape[5]
    port, starboard, deep, round_t, wound = -1, -1, 0.0, math.inf, 0.0
    for k in range(nd):
        if angle[k] < 0.0:
            port = k
        elif starboard < 0:
            starboard = k
    down_x, down_y = jump * axes[0, 0] + hop * axes[1, 0], jump * axes[0, 1] + hop * axes[1, 1]
    if (jump != 0 or hop != 0) and port >= 0 and starboard >= 0:
        deep, v = track(b, down_x, down_y, 0.0)
        round_t = math.hypot(down_x, down_y) / v
    n_states = ni * nj * nd
    cost = np.full(n_states, np.inf, np.float32)
    came = np.zeros(n_states, np.uint8)
    done = np.zeros(n_states, np.uint8)
    h_node = np.full(ni * nj, -1.0, np.float32)
    keys, items, size = np.empty(1 << 15), np.empty(1 << 15, np.int32), 0
    best, best_state, end_x, end_y, via_x, via_y, with_via = bound, -1, 0.0, 0.0, 0.0, 0.0, False
    n_gauge = gauge.shape[0]

    start = i0 * nj + j0
    for k in range(nd):
        if side * angle[k] < 0.0:
            continue
        s = start * nd + k
        cost[s] = t0 + turn_time(b, h0, angle[k])
        if cost[s] == np.inf:
            continue
        came[s] = _START
        keys, items, size = push(keys, items, size, cost[s], s)
    pops = 0
    while size > 0:
        f, s = keys[0], items[0]
        size = pop(keys, items, size)
        if f >= best:
            break
        if done[s]:
            continue
        done[s] = 1
        pops += 1
        if pops > max_pops:
            break
        node, k = s // nd, s % nd
        i, j = node // nj, node % nj
        x = ox + (i - i0) * axes[0, 0] + (j - j0) * axes[1, 0]
        y = oy + (i - i0) * axes[0, 1] + (j - j0) * axes[1, 1]
        t = float(cost[s])
        if b.room > 0.0:
            wound = _wound(b, came, s, nj, steps, angle, lengths, h0, deep)
        # ---- the exact end, from near the goal and now and then from afar
        gx, gy = goal[0] - x, goal[1] - y
        d = math.hypot(gx, gy)
        if d <= shot_m or pops % 64 == 1:
            if d <= goal[2]:
                if t < best:
                    best, best_state, end_x, end_y, with_via = t, s, x, y, False
                continue
            f_d = (d - 0.999999 * goal[2]) / d
            ex, ey = x + gx * f_d, y + gy * f_d
            a, v = track(b, gx, gy, t)
            direct = False
            if v > 1e-9 and abs(a) <= b.max_twa + SLACK_RAD:
                t1 = t + turn_time(b, angle[k], a)
                t2 = t1 + d * f_d / v
                if abs(a) >= worst_half(b, t1, t2):
                    direct = True
                    turns = b.room == 0.0 or abs(wound + wrap(a - angle[k])) <= b.most_turn
                    if (
                        t2 < best
                        and turns
                        and is_free(g, x, y, ex, ey)
                        and not (meets_target(b, x, y, x, y, t, t1) or meets_target(b, x, y, ex, ey, t1, t2))
                    ):
                        best, best_state, end_x, end_y, with_via = t2, s, ex, ey, False
            if not direct and b.can_tack:
                first = 0 if gy > 0.0 else 2
                for way in range(2):
                    mx, my, t2, ok = corner(b, x, y, angle[k], t, ex, ey, first + way, first + 1 - way)
                    if (
                        ok
                        and t2 < best
                        and is_free(g, x, y, mx, my)
                        and is_free(g, mx, my, ex, ey)
                        and (b.targets.shape[0] == 0 or _misses(b, x, y, angle[k], t, mx, my, ex, ey))
                    ):
                        best, best_state, end_x, end_y = t2, s, ex, ey
                        via_x, via_y, with_via = mx, my, True
        # ---- neighbours: turn either way, or sail one step on
        for move in range(4):
            if move == 3:
                if not round_t < math.inf or k not in (port, starboard):
                    break
                k1 = starboard if k == port else port
                i1, j1 = i + jump, j + hop
                x1, y1 = x + down_x, y + down_y
                if i1 < 0 or j1 < 0 or i1 >= ni or j1 >= nj or abs(wound + wrap(deep - angle[k])) > b.most_turn:
                    break
                if x1 < box[0] or y1 < box[1] or x1 > box[2] or y1 > box[3]:
                    break
                t1 = t + turn_time(b, angle[k], deep) + round_t + turn_time(b, deep, angle[k1])
                label, node1 = _ROUND, i1 * nj + j1
                s1 = node1 * nd + k1
            elif (
                move < 2
                and b.room > 0.0
                and came[s] != _START
                and abs(wound + wrap(angle[(k + 1 - 2 * move) % nd] - angle[k])) > b.most_turn
            ):
                continue
            elif move == 0:
                k1 = (k + 1) % nd
                s1, t1, label = node * nd + k1, t + turn[k], _CLOCKWISE
                node1 = node
            elif move == 1:
                k1 = (k - 1) % nd
                s1, t1, label = node * nd + k1, t + turn[k1], _COUNTER
                node1 = node
            else:
                i1, j1 = i + steps[k, 0], j + steps[k, 1]
                if i1 < 0 or j1 < 0 or i1 >= ni or j1 >= nj:
                    continue
                x1, y1 = x + dx[k], y + dy[k]
                if x1 < box[0] or y1 < box[1] or x1 > box[2] or y1 > box[3]:
                    continue
                t1, label = t + duration[k], _MOVE
                node1 = i1 * nj + j1
                s1 = node1 * nd + k
            if done[s1] or t1 >= cost[s1]:
                continue
            if h_node[node1] < 0.0:
                qx = goal[0] - (x if move < 2 else x1)
                qy = goal[1] - (y if move < 2 else y1)
                c = int((math.atan2(qx, qy) + math.pi) / (2.0 * math.pi) * n_gauge) % n_gauge
                h_node[node1] = max(0.0, gauge[c] * math.hypot(qx, qy) - slack)
            f1 = t1 + h_node[node1]
            if f1 >= best:
                continue
            if (
                move < 2
                and b.targets.shape[0] > 0
                and (came[s] == (_COUNTER if move == 0 else _CLOCKWISE) or meets_target(b, x, y, x, y, t, t1))
            ):
                continue
            if move > 1:
                a = angle[k] if move == 2 else deep
                if abs(a) < worst_half(b, t, t1) - 0.5 * SLACK_RAD or not is_free(g, x, y, x1, y1):
                    continue
                if b.targets.shape[0] > 0 and meets_target(b, x, y, x1, y1, t, t1):
                    continue
            cost[s1] = t1
            came[s1] = label
            keys, items, size = push(keys, items, size, f1, s1)
    if best_state < 0:
        return math.inf, np.empty((0, 2)), pops
    # ---- back along the parents; only the points where the course changes are kept
    count, s, last = 1, best_state, -1
    path = np.empty((4096, 2))
    path[0, 0], path[0, 1] = end_x, end_y
    if with_via:
        path[1, 0], path[1, 1] = via_x, via_y
        count = 2
    while True:
        node, k = s // nd, s % nd
        i, j = node // nj, node % nj
        label = came[s]
        if (label != _MOVE or last != k) and (last != -2) and count < 4095:
            px = ox + (i - i0) * axes[0, 0] + (j - j0) * axes[1, 0]
            py = oy + (i - i0) * axes[0, 1] + (j - j0) * axes[1, 1]
            if abs(px - path[count - 1, 0]) + abs(py - path[count - 1, 1]) > 1e-9:
                path[count, 0], path[count, 1] = px, py
                count += 1
        if label == _START:
            break
        if label == _MOVE:
            last = k
            s = ((i - steps[k, 0]) * nj + (j - steps[k, 1])) * nd + k
        elif label == _ROUND:
            last = -1
            s = ((i - jump) * nj + (j - hop)) * nd + (starboard if k == port else port)
        elif label == _CLOCKWISE:
            s = node * nd + (k - 1) % nd
        else:
            s = node * nd + (k + 1) % nd
    return best, path[:count][::-1].copy(), pops


@dataclass(frozen=True, slots=True, kw_only=True)
class LatticeResult:
    """What one lattice gave: cost, points (n, 2) in the wind frame (None: no path), effort."""

    cost_s: float
    points: Floats | None
    pops: int


def _steps(reach: int) -> list[tuple[int, int]]:
    span = range(-reach, reach + 1)
    return [(i, j) for i in span for j in span if math.gcd(i, j) == 1]


def _leeward(b: BoatModel, axes: Floats) -> tuple[int, int]:
    """Return the shortest lattice step that turns the boat from either close-hauled course to the other by a gybe."""
    if b.room == 0.0:
        return 0, 0
    sign = -1 if axes[0, 1] + axes[1, 1] > 0.0 else 1
    most = min(60, math.ceil(2.0 * b.room / min(float(np.hypot(*axes[0])), float(np.hypot(*axes[1])))) + 2)
    along = np.arange(most, dtype=np.float64)[:, None]
    steps = sign * (along[:, None] * axes[0] + along[None] * axes[1])
    lengths = np.hypot(steps[..., 0], steps[..., 1]).ravel()
    for n in np.argsort(lengths, kind="stable")[np.count_nonzero(lengths < b.room) :].tolist():
        i, j = divmod(n, most)
        dx, dy = steps[i, j].tolist()
        a, v = track(b, dx, dy, 0.0)
        turns = turn_time(b, -b.up, a) + turn_time(b, a, b.up) + turn_time(b, b.up, a) + turn_time(b, a, -b.up)
        if v > 1e-9 and abs(a) <= b.max_twa and turns < math.inf:
            return sign * i, sign * j
    return 0, 0


def _over_ground(b: BoatModel, u: Floats, half_rad: float) -> Floats:
    """Return the directions over the ground of the headings ``u``; themselves where these are no axes of a lattice."""
    moved = speed_at(b, half_rad if u[0, 1] > 0.0 else math.pi - half_rad) * u + np.array([b.cx, b.cy])
    size = np.hypot(moved[:, 0], moved[:, 1])
    if float(np.min(size)) < 1e-6:
        return u
    unit = moved / size[:, None]
    was, now = (w[0, 0] * w[1, 1] - w[0, 1] * w[1, 0] for w in (u, unit))
    return unit if was * now > 0.0 and abs(now) > LEAST_SINE else u


def run_lattice(
    world: SearchWorld,
    gauge: Gauge,
    *,
    cells: int,
    reach: int,
    half_rad: float,
    box: tuple[float, float, float, float],
    bound_s: float = math.inf,
    max_pops: int = 1 << 60,
    downwind: bool = False,
    stretch: float = 1.0,
    origin: tuple[float, float, float, float] | None = None,
    goal: tuple[float, float, float] | None = None,
    side: int = 0,
) -> LatticeResult:
    """Search a lattice of about ``cells`` nodes whose axes lie at ``half_rad`` from the wind (or from dead down).

    ``reach`` 2 gives 16 courses, 3 gives 32. The step is fitted so that the goal is a node where it can be;
    ``stretch`` scales it, for other lattices of the same kind. ``origin`` (x, y, TWA, time) and ``goal`` (x, y,
    radius) are the problem's own unless given.
    """
    b = world.boat
    origin = origin or (0.0, 0.0, world.h0, 0.0)
    goal = goal or (*world.goal, world.goal_radius)
    start = np.array(origin[:2])
    half = min(max(half_rad, math.radians(8.0)), math.radians(82.0))
    u = np.array([[math.sin(half), math.cos(half)], [-math.sin(half), math.cos(half)]])
    if downwind:
        u[:, 1] *= -1.0
    if b.cx != 0.0 or b.cy != 0.0:
        u = _over_ground(b, u, half)
    area = max((box[2] - box[0]) * (box[3] - box[1]), 1e-6)
    step = stretch * math.sqrt(area / (cells * abs(u[0, 0] * u[1, 1] - u[0, 1] * u[1, 0])))
    inverse = np.linalg.inv(u)  # (x, y) = (a, c) @ u, so (a, c) = (x, y) @ inverse
    along = (np.array(goal[:2]) - start) @ inverse
    sizes = [abs(v) / max(1, round(abs(v) / step)) if abs(v) > 0.6 * step else step for v in along]
    axes = u * np.array(sizes)[:, None]
    corners = np.array([[box[i], box[j]] for i in (0, 2) for j in (1, 3)])
    corners = (corners - start) @ np.linalg.inv(axes)
    low, high = np.floor(corners.min(axis=0)).astype(int), np.ceil(corners.max(axis=0)).astype(int)
    low, high = np.minimum(low, 0), np.maximum(high, 0)
    ni, nj = (high - low + 1).tolist()
    steps = []
    for di, dj in _steps(reach):
        dx, dy = (di * axes[0] + dj * axes[1]).tolist()
        a, v = track(b, dx, dy, 0.0)
        if v > 1e-6 and abs(a) <= b.max_twa + SLACK_RAD and abs(a) >= gauge.least_half_rad - 1e-9:
            steps.append((a, di, dj))
    steps.sort()
    if not steps or ni * nj * len(steps) > 24_000_000:
        return LatticeResult(cost_s=math.inf, points=None, pops=0)
    cost, points, pops = lattice_search(
        world.grid,
        b,
        np.array(origin),
        axes,
        np.array([ni, nj, -low[0], -low[1], *_leeward(b, axes)], np.int32),
        np.array([(i, j) for _, i, j in steps], np.int32),
        np.array(goal),
        np.array(box),
        gauge.table,
        goal[2] * gauge.table_max,
        bound_s,
        max_pops,
        6.0 * max(sizes),
        side,
    )
    found = math.isfinite(cost) and len(points) > 0
    return LatticeResult(cost_s=float(cost) if found else math.inf, points=points if found else None, pops=int(pops))


# A search whose close-hauled courses follow the no-go zone as it moves: for wind that gets uncertain quickly.
#
# A lattice has its axes at one angle; when the zone opens by many degrees on the way, no angle fits. Here states are
# cells of a plain grid times courses, but each state keeps the exact position and time at which its cell was first
# reached, and a step is sailed at the edge of the zone at that very time (hybrid A*). Not exhaustive: the first to
# reach a cell on a course closes it. What it finds is exact and goes to annealing like everything else.

_FIXED = 16


@kernel
def drift_search(
    g: SegmentGrid,
    b: BoatModel,
    h0: float,
    goal: Floats,
    box: Floats,
    shape: Ints,
    step: float,
    gauge: Floats,
    slack: float,
    bound: float,
    max_pops: int,
    side: int,
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
                for _ in range(6):  # the angle at the edge of the time that the angle makes
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
            if b.targets.shape[0] > 0 and (meets_target(b, x, y, x, y, t, t1) or meets_target(b, x, y, x1, y1, t1, t2)):
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
    nx, ny = int(width / size) + 1, int(height / size) + 1
    time_s, points, pops = drift_search(
        world.grid,
        world.boat,
        world.h0,
        np.array([*world.goal, world.goal_radius]),
        np.array(box),
        np.array([nx, ny], np.int32),
        stride * size,
        gauge.table,
        world.goal_radius * gauge.table_max,
        bound_s,
        max_pops,
        side,
    )
    found = math.isfinite(time_s) and len(points) > 1
    return LatticeResult(cost_s=float(time_s) if found else math.inf, points=points if found else None, pops=int(pops))
