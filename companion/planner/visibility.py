"""Shortest paths of the sailing-time metric in the visibility graph: a lower bound, and where to look.

The gauge obeys the triangle inequality, so among polygons its shortest path turns only at their convex corners.
A* over them (visibility is tested when a corner is expanded) gives that path; when it is stopped early the least
value in its queue is still a bound from below. Run backwards from the goal it gives every corner's least time to
go, and forwards plus backwards the routes round the other sides.
"""

from __future__ import annotations

import math

import numpy as np

from companion.planner.gauge import Gauge, disc_time
from companion.planner.kernels import Floats, Grid, Ints, is_free, jit


@jit
def _time(normals: Floats, dx: float, dy: float) -> float:
    best = 0.0
    for i in range(normals.shape[0]):
        best = max(best, normals[i, 0] * dx + normals[i, 1] * dy)
    return best


@jit
def geodesics(
    g: Grid, nodes: Floats, normals: Floats, blocked: Floats, table: Floats, goal: Floats, mode: int,
    bound: float, budget: int,
) -> tuple[Floats, Ints, float, int, int]:
    """Search the visibility graph over ``nodes`` (node 0 is the start) with the gauge as the cost.

    Mode 0: from the start until the goal's disc is reached, with the distance to it as heuristic. Mode 1: from the
    start to every node. Mode 2: from every node to the goal's disc. Corners whose least time through them exceeds
    ``bound`` are left out; ``budget`` counts visibility tests. Returns (cost to each node, parent of each node,
    -1 for the root, lower bound on the shortest path, the node before the goal or -1, tests made).
    """
    backward = mode == 2
    n = nodes.shape[0]
    cost = np.full(n, np.inf)
    parent = np.full(n, -1, np.int32)
    state = np.zeros(n, np.uint8)
    to_go, from_start = np.zeros(n), np.zeros(n)
    for i in range(n):
        to_go[i] = disc_time(normals, blocked, goal[0] - nodes[i, 0], goal[1] - nodes[i, 1], goal[2])
        from_start[i] = _time(normals, nodes[i, 0] - nodes[0, 0], nodes[i, 1] - nodes[0, 1])
        if to_go[i] + from_start[i] > bound:
            state[i] = 2
    tests = 0
    end, end_cost = -1, math.inf
    n_table = table.shape[0]
    if backward:
        for i in range(n):
            if state[i] == 2:
                continue
            gx, gy = goal[0] - nodes[i, 0], goal[1] - nodes[i, 1]
            d = math.hypot(gx, gy)
            f = max(0.0, (d - goal[2]) / d) if d > 0.0 else 0.0
            tests += 1
            if is_free(g, nodes[i, 0], nodes[i, 1], nodes[i, 0] + f * gx, nodes[i, 1] + f * gy):
                cost[i] = to_go[i]
    else:
        cost[0] = 0.0
        state[0] = 0
    while True:
        limit = min(bound, end_cost) if mode == 0 else bound
        best, k = math.inf, -1
        for i in range(n):
            if state[i] == 0 and cost[i] < math.inf:
                f = cost[i] + (from_start[i] if backward else to_go[i])
                if f < best:
                    best, k = f, i
        if k < 0 or (mode == 0 and best >= end_cost) or best > bound:
            return cost, parent, (min(end_cost, best) if not backward else 0.0), end, tests
        if tests > budget:
            return cost, parent, (min(end_cost, best) if not backward else 0.0), end, tests
        state[k] = 1
        if not backward:
            gx, gy = goal[0] - nodes[k, 0], goal[1] - nodes[k, 1]
            d = math.hypot(gx, gy)
            f = max(0.0, (d - goal[2]) / d) if d > 0.0 else 0.0
            tests += 1
            # The least-time end may lie elsewhere on the disc than the nearest: blocked ends keep the bound only.
            if best < end_cost and (
                is_free(g, nodes[k, 0], nodes[k, 1], nodes[k, 0] + f * gx, nodes[k, 1] + f * gy)
                or disc_open(g, nodes[k, 0], nodes[k, 1], goal)
            ):
                end, end_cost = k, best
                limit = min(bound, end_cost)
        for i in range(n):
            if state[i] != 0:
                continue
            dx, dy = nodes[i, 0] - nodes[k, 0], nodes[i, 1] - nodes[k, 1]
            if backward:
                dx, dy = -dx, -dy
            c = int((math.atan2(dx, dy) + math.pi) / (2.0 * math.pi) * n_table) % n_table
            low = cost[k] + table[c] * math.hypot(dx, dy)
            if low >= cost[i] or low + (from_start[i] if backward else to_go[i]) > limit:
                continue
            new = cost[k] + _time(normals, dx, dy)
            if new >= cost[i]:
                continue
            tests += 1
            if is_free(g, nodes[k, 0], nodes[k, 1], nodes[i, 0], nodes[i, 1]):
                cost[i] = new
                parent[i] = k


@jit
def disc_open(g: Grid, x: float, y: float, goal: Floats) -> bool:
    """Can any of 64 points on the goal's disc be seen from (x, y)?"""
    for i in range(64):
        a = 2.0 * math.pi * i / 64.0
        if is_free(g, x, y, goal[0] + goal[2] * math.sin(a), goal[1] + goal[2] * math.cos(a)):
            return True
    return False


def graph_nodes(corners: Floats, gauge: Gauge, goal: tuple[float, float, float], bound_s: float) -> Floats:
    """Return the start (0, 0) and the corners through which a path within ``bound_s`` can lead, (n, 2)."""
    if len(corners) == 0 or len(gauge.normals) == 0:
        return np.zeros((1, 2))
    keep = np.ones(len(corners), bool)
    if math.isfinite(bound_s):
        least = _table_time(gauge, corners) + np.maximum(
            0.0, _table_time(gauge, np.array([[goal[0], goal[1]]]) - corners) - goal[2] * gauge.table_max
        )
        keep = least <= bound_s
    return np.vstack([np.zeros((1, 2)), corners[keep]])


def _table_time(gauge: Gauge, d: Floats) -> Floats:
    cell = ((np.arctan2(d[:, 0], d[:, 1]) + math.pi) / (2.0 * math.pi) * len(gauge.table)).astype(int)
    return np.asarray(gauge.table[cell % len(gauge.table)] * np.hypot(d[:, 0], d[:, 1]), np.float64)


@jit
def crossings(points: Floats, marks: Floats) -> Ints:
    """Return how often the path passes below each mark, eastward minus westward: which side it takes of each."""
    out = np.zeros(marks.shape[0], np.int32)
    for k in range(marks.shape[0]):
        x, y = marks[k, 0], marks[k, 1]
        for i in range(points.shape[0] - 1):
            ax, bx = points[i, 0], points[i + 1, 0]
            if (ax <= x) != (bx <= x):
                f = (x - ax) / (bx - ax)
                if points[i, 1] + f * (points[i + 1, 1] - points[i, 1]) < y:
                    out[k] += 1 if bx > ax else -1
    return out
