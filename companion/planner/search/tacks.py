"""Guides made sailable: a straight segment as the direct leg, as equal tacks, or as tacks that fit the room."""

from __future__ import annotations

import math

import numpy as np

from companion.kernels.jit import kernel
from companion.planner.search.kernels import Boat, Floats, Grid, is_free, track, walk, worst_half
from companion.planner.search.moves import corner


@kernel
def check_path(g: Grid, b: Boat, points: Floats, h0: float) -> float:
    """Return the time of a path, inf where it collides or breaks an angle limit."""
    n = points.shape[0]
    for i in range(n - 1):
        if not is_free(g, points[i, 0], points[i, 1], points[i + 1, 0], points[i + 1, 1]):
            return math.inf
    return walk(b, points[:, 0].copy(), points[:, 1].copy(), n, h0)


@kernel
def zigzag(
    g: Grid, b: Boat, ax: float, ay: float, h: float, t: float, ex: float, ey: float, most: int
) -> tuple[Floats, float, float, bool]:
    """Return (points after a, arrival time, TWA on arrival, ok): the fewest equal tacks or gybes from a to e.

    Tries the direct leg, then 1, 2, 3, 4, 6, ... up to ``most`` equal parts in either order.
    """
    dx, dy = ex - ax, ey - ay
    d = math.hypot(dx, dy)
    empty = np.empty((0, 2))
    if d < 1e-9:
        return empty, t, h, True
    a, v = track(b, dx, dy, t)
    if v > 1e-9 and abs(a) <= b.max_twa:
        dh = abs(a - h)
        t1 = t + min(dh, 2.0 * math.pi - dh) / b.omega
        if abs(a) >= worst_half(b, t1, t1 + d / v) and is_free(g, ax, ay, ex, ey):
            return np.array([[ex, ey]]), t1 + d / v, a, True
    first = 0 if dy > 0.0 else 2
    parts = 1
    while parts <= most:
        for way in range(2):
            out = np.empty((2 * parts, 2))
            px, py, now, course = ax, ay, t, h
            fine = True
            for m in range(parts):
                qx, qy = ax + dx * (m + 1) / parts, ay + dy * (m + 1) / parts
                w = (way + m) % 2
                k1, k2 = first + w, first + 1 - w
                x, y, t2, ok = corner(b, px, py, course, now, qx, qy, k1, k2)
                if not ok or not is_free(g, px, py, x, y) or not is_free(g, x, y, qx, qy):
                    fine = False
                    break
                out[2 * m, 0], out[2 * m, 1] = x, y
                out[2 * m + 1, 0], out[2 * m + 1, 1] = qx, qy
                course, now = math.atan2(qx - x, qy - y), t2
                px, py = qx, qy
            if fine:
                return out, now, course, True
        parts = parts + 1 if parts < 4 else parts + parts // 2
    return empty, t, h, False


@kernel
def follow(
    g: Grid, b: Boat, ax: float, ay: float, h: float, t: float, ex: float, ey: float, deepest: int
) -> tuple[Floats, float, float, bool]:
    """Return (points after a, arrival time, TWA on arrival, ok): a sailable path close along the segment a to e.

    Direct, or one corner either way, or else each half of the segment in the same manner: tacks get as short as
    the room needs, and only where it needs it.
    """
    out = np.empty((2 << deepest, 2))
    count = 0
    stack = np.empty((64, 3))
    top = 1
    stack[0, 0], stack[0, 1], stack[0, 2] = ex, ey, 0.0
    x, y = ax, ay
    while top > 0:
        qx, qy, depth = stack[top - 1, 0], stack[top - 1, 1], stack[top - 1, 2]
        dx, dy = qx - x, qy - y
        d = math.hypot(dx, dy)
        if d < 1e-9:
            top -= 1
            continue
        a, v = track(b, dx, dy, t)
        done = False
        if v > 1e-9 and abs(a) <= b.max_twa:
            dh = abs(a - h)
            t1 = t + min(dh, 2.0 * math.pi - dh) / b.omega
            if abs(a) >= worst_half(b, t1, t1 + d / v) and is_free(g, x, y, qx, qy):
                t, h, done = t1 + d / v, a, True
        if not done:
            first = 0 if dy > 0.0 else 2
            keep = 1 if h < 0.0 else 0
            for way in range(2):
                w = (keep + way) % 2
                mx, my, t2, ok = corner(b, x, y, h, t, qx, qy, first + w, first + 1 - w)
                if ok and is_free(g, x, y, mx, my) and is_free(g, mx, my, qx, qy):
                    if count >= out.shape[0] - 2:
                        return np.empty((0, 2)), t, h, False
                    out[count, 0], out[count, 1] = mx, my
                    count += 1
                    t, h, done = t2, math.atan2(qx - mx, qy - my), True
                    break
        if done:
            if count >= out.shape[0] - 1:
                return np.empty((0, 2)), t, h, False
            out[count, 0], out[count, 1] = qx, qy
            count += 1
            x, y = qx, qy
            top -= 1
            continue
        if depth >= deepest or top >= 63:
            return np.empty((0, 2)), t, h, False
        stack[top - 1, 2] = depth + 1.0
        stack[top, 0], stack[top, 1], stack[top, 2] = 0.5 * (x + qx), 0.5 * (y + qy), depth + 1.0
        top += 1
    return out[:count].copy(), t, h, True
