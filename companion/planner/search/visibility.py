"""Shortest paths of the sailing-time metric in the visibility graph: a lower bound, and where to look.

The gauge obeys the triangle inequality, so among polygons its shortest path turns only at their convex corners.
A* over them (visibility is tested when a corner is expanded) gives that path; when it is stopped early the least
value in its queue is still a bound from below. Run backwards from the goal it gives every corner's least time to
go, and forwards plus backwards the routes round the other sides.
"""

from __future__ import annotations

import math

import numpy as np

from companion.kernels.jit import kernel
from companion.planner.search.gauge import Gauge, disc_time, least_time
from companion.planner.search.kernels import Floats, Ints, SegmentGrid, is_free

_EXACT = 5_000
"""Corners up to which each one's least time is worked out to the last digit; of more, from the gauge's table."""


@kernel
def _time(normals: Floats, dx: float, dy: float) -> float:
    best = 0.0
    for i in range(normals.shape[0]):
        best = max(best, normals[i, 0] * dx + normals[i, 1] * dy)
    return best


@kernel
def geodesics(
    g: SegmentGrid,
    nodes: Floats,
    normals: Floats,
    blocked: Floats,
    table: Floats,
    goal: Floats,
    mode: int,
    bound: float,
    budget: int,
    ends: Floats,
) -> tuple[Floats, Ints, float, int, int]:
    """Search the visibility graph over ``nodes`` (node 0 is the start) with the gauge as the cost.

    Mode 0: from the start until the goal's disc is reached, with the distance to it as heuristic. Mode 1: from the
    start to every node. Mode 2: from every node to the goal's disc. Corners whose least time through them exceeds
    ``bound`` are left out; ``budget`` counts visibility tests; ``ends`` are the points where boundaries cut the disc's
    circle. Returns (cost to each node, parent of each node,
    -1 for the root, lower bound on the shortest path, the node before the goal or -1, tests made).
    """
    backward = mode == 2
    n = nodes.shape[0]
    cost = np.full(n, np.inf)
    parent = np.full(n, -1, np.int32)
    state = np.zeros(n, np.uint8)
    to_go, from_start = np.zeros(n), np.zeros(n)
    steepest = 0.0
    for i in range(normals.shape[0]):
        steepest = max(steepest, math.hypot(normals[i, 0], normals[i, 1]))
    for i in range(n):
        gx, gy = goal[0] - nodes[i, 0], goal[1] - nodes[i, 1]
        sx, sy = nodes[i, 0] - nodes[0, 0], nodes[i, 1] - nodes[0, 1]
        to_go[i] = max(0.0, least_time(table, gx, gy) - goal[2] * steepest)
        from_start[i] = least_time(table, sx, sy)
        if to_go[i] + from_start[i] <= bound and n <= _EXACT:
            to_go[i] = disc_time(normals, blocked, gx, gy, goal[2])
            from_start[i] = _time(normals, sx, sy)
        if to_go[i] + from_start[i] > bound:
            state[i] = 2
    tests = 0
    end, end_cost = -1, math.inf
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
                or disc_open(g, nodes[k, 0], nodes[k, 1], goal, ends)
            ):
                end, end_cost = k, best
                limit = min(bound, end_cost)
        for i in range(n):
            if state[i] != 0:
                continue
            dx, dy = nodes[i, 0] - nodes[k, 0], nodes[i, 1] - nodes[k, 1]
            if backward:
                dx, dy = -dx, -dy
            low = cost[k] + least_time(table, dx, dy)
            if low >= cost[i] or low + (from_start[i] if backward else to_go[i]) > limit:
                continue
            new = cost[k] + _time(normals, dx, dy)
            if new >= cost[i]:
                continue
            tests += 1
            if is_free(g, nodes[k, 0], nodes[k, 1], nodes[i, 0], nodes[i, 1]):
                cost[i] = new
                parent[i] = k


@kernel
def _entry_free(g: SegmentGrid, x: float, y: float, px: float, py: float, goal: Floats) -> bool:
    """Is the segment from (x, y) to p free up to where it enters the goal's disc?"""
    dx, dy = px - x, py - y
    a = dx * dx + dy * dy
    if a <= 0.0:
        return True
    b = dx * (x - goal[0]) + dy * (y - goal[1])
    c = (x - goal[0]) ** 2 + (y - goal[1]) ** 2 - goal[2] * goal[2]
    root = b * b - a * c
    f = 1.0 if root <= 0.0 else min(1.0, max(0.0, (-b - math.sqrt(root)) / a))
    return is_free(g, x, y, x + f * dx, y + f * dy)


@kernel
def disc_open(g: SegmentGrid, x: float, y: float, goal: Floats, ends: Floats) -> bool:
    """Can any part of the goal's disc be seen from (x, y)?

    A sight line can be turned until it touches a corner (then that corner sees the disc too and takes its place),
    the disc's side, or the end of an open arc: so the two tangents and ``ends`` decide. Samples find most sooner.
    """
    dx, dy = goal[0] - x, goal[1] - y
    d = math.hypot(dx, dy)
    if d <= goal[2]:
        return True
    spread = math.asin(goal[2] / d) * (1.0 - 1e-9)
    towards = math.atan2(dx, dy)
    far = math.sqrt(max(0.0, d * d - goal[2] * goal[2]))
    for i in range(-4, 5):
        a = towards + spread * i / 4.0
        reach = far if abs(i) == 4 else d
        if _entry_free(g, x, y, x + reach * math.sin(a), y + reach * math.cos(a), goal):
            return True
    for i in range(ends.shape[0]):  # noqa: SIM110 - compiled
        if _entry_free(g, x, y, ends[i, 0], ends[i, 1], goal):
            return True
    return False


def circle_cuts(edges: Floats, goal: Floats) -> Floats:
    """Return the points where boundary segments cut the goal's circle, (k, 2)."""
    if len(edges) == 0 or goal[2] <= 0.0:
        return np.empty((0, 2))
    near = (np.minimum(edges[:, 0], edges[:, 2]) <= goal[0] + goal[2]) & (
        np.maximum(edges[:, 0], edges[:, 2]) >= goal[0] - goal[2]
    )
    edges = edges[near]
    p, d = edges[:, :2] - goal[:2], edges[:, 2:] - edges[:, :2]
    a, b = np.sum(d * d, axis=1), np.sum(p * d, axis=1)
    root = b * b - a * (np.sum(p * p, axis=1) - goal[2] ** 2)
    hit = (root >= 0.0) & (a > 0.0)
    out = []
    for sign in (-1.0, 1.0):
        f = (-b[hit] + sign * np.sqrt(root[hit])) / a[hit]
        inside = (f >= 0.0) & (f <= 1.0)
        out.append(edges[hit][inside, :2] + f[inside, None] * d[hit][inside])
    return np.ascontiguousarray(np.vstack(out))


def graph_nodes(corners: Floats, gauge: Gauge, goal: tuple[float, float, float], bound_s: float) -> Floats:
    """Return the start (0, 0) and the corners through which a path within ``bound_s`` can lead, (n, 2)."""
    if len(corners) == 0 or len(gauge.normals) == 0:
        return np.zeros((1, 2))
    keep = np.ones(len(corners), bool)
    if math.isfinite(bound_s):
        keep = least_through(gauge, corners, goal) <= bound_s
    return np.vstack([np.zeros((1, 2)), corners[keep]])


def least_through(gauge: Gauge, points: Floats, goal: tuple[float, float, float]) -> Floats:
    """Return the least sailing time [s] from the start to the goal's disc by way of each point, obstacles apart."""
    to_go = _table_time(gauge, np.array([goal[:2]]) - points) - goal[2] * gauge.table_max
    return np.asarray(_table_time(gauge, points) + np.maximum(0.0, to_go), np.float64)


def _table_time(gauge: Gauge, d: Floats) -> Floats:
    cell = ((np.arctan2(d[:, 0], d[:, 1]) + math.pi) / (2.0 * math.pi) * len(gauge.table)).astype(int)
    return np.asarray(gauge.table[cell % len(gauge.table)] * np.hypot(d[:, 0], d[:, 1]), np.float64)


@kernel
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
