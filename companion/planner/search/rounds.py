"""Turning the long way round: gybing instead of tacking (or tacking instead of gybing), as legs of the plan.

The format's turns go the shorter way, and so does ArduRover's heading controller. A boat that cannot tack, or for
which a tack costs more than running off, gybing and luffing up again, is made to by its waypoints: the leg before
the corner is prolonged, one or two legs as long as the boat needs room for lead to leeward, and the leg after the
corner is begun so much earlier that its line is unchanged. Every turn is then below half a circle and goes the way
that is meant, the exact scorer judges the path like any other, and the autopilot has nothing to know of it.
"""

from __future__ import annotations

import math

import numpy as np

from companion.kernels.jit import kernel
from companion.planner.search.kernels import (
    Boat,
    Floats,
    Grid,
    half_at,
    is_free,
    speed_at,
    track,
    turn_guess,
    turn_time,
)
from companion.planner.search.moves import fit_corners

WAYS = 3
"""Ways round: one leg on the side of the old course or of the new one, or one on each."""
_DEAD_RAD = 0.1
_LONGEST = 8.0


@kernel
def round_vector(b: Boat, a0: float, a1: float, t: float, way: int) -> tuple[float, float, float, float, bool]:
    """Return (x1, y1, x2, y2, ok): the leg or legs [m] from TWA a0 round to a1 the long way; (x2, y2) 0 for one leg."""
    side = 1.0 if a0 > 0.0 else -1.0
    if abs(a0) + abs(a1) < math.pi:
        d1 = min(b.max_twa, (math.pi - _DEAD_RAD) if way < 2 else 0.75 * math.pi)
    elif way == 2 and b.can_tack:
        d1 = max(half_at(b, t) + 0.02, b.up)
        if d1 > 0.45 * math.pi:
            return 0.0, 0.0, 0.0, 0.0, False
    else:
        return 0.0, 0.0, 0.0, 0.0, False
    d1 *= -side if way == 1 else side
    d2 = -d1 if way == 2 else d1
    fine = turn_time(b, a0, d1) + turn_time(b, d1, d2) + turn_time(b, d2, a1) < math.inf
    length = b.room * (1.0 + 1e-9) + 1e-6
    x1, y1 = speed_at(b, d1) * math.sin(d1) + b.cx, speed_at(b, d1) * math.cos(d1) + b.cy
    x2, y2 = speed_at(b, d2) * math.sin(d2) + b.cx, speed_at(b, d2) * math.cos(d2) + b.cy
    size1, size2 = math.hypot(x1, y1), math.hypot(x2, y2)
    if not fine or size1 < 1e-6 or size2 < 1e-6:
        return 0.0, 0.0, 0.0, 0.0, False
    if way < 2:
        return x1 * length / size1, y1 * length / size1, 0.0, 0.0, True
    return x1 * length / size1, y1 * length / size1, x2 * length / size2, y2 * length / size2, True


@kernel
def overshoot(ux: float, uy: float, wx: float, wy: float, dx: float, dy: float) -> tuple[float, float, bool]:
    """Return (e, f, ok) [m]: from a corner e on along unit vector u, then (dx, dy), then f along w is the corner."""
    det = ux * wy - uy * wx
    if abs(det) < 1e-9:
        return 0.0, 0.0, False
    e, f = (dy * wx - dx * wy) / det, (uy * dx - ux * dy) / det
    longest = _LONGEST * math.hypot(dx, dy)
    return e, f, e >= 0.0 and f >= 0.0 and e < longest and f < longest


@kernel
def cross(
    ax: float, ay: float, ux: float, uy: float, bx: float, by: float, wx: float, wy: float
) -> tuple[float, float, bool]:
    """Return (x, y, ok): where the ray from a along u meets the line through b along w."""
    det = ux * wy - uy * wx
    if abs(det) < 1e-9 * math.hypot(ux, uy) * math.hypot(wx, wy) + 1e-300:
        return 0.0, 0.0, False
    s = ((bx - ax) * wy - (by - ay) * wx) / det
    return ax + s * ux, ay + s * uy, s > 1e-9


@kernel
def _sailed(b: Boat, xs: Floats, ys: Floats, n: int, t: float, h: float) -> tuple[float, float]:
    for i in range(n - 1):
        dx, dy = xs[i + 1] - xs[i], ys[i + 1] - ys[i]
        length = math.hypot(dx, dy)
        if length > 1e-9:
            a, v = track(b, dx, dy, t)
            t += turn_guess(b, h, a) + length / max(v, 1e-9)
            h = a
    return t, h


@kernel
def _free(g: Grid, xs: Floats, ys: Floats, n: int) -> bool:
    for i in range(n - 1):  # noqa: SIM110 - compiled
        if not is_free(g, xs[i], ys[i], xs[i + 1], ys[i + 1]):
            return False
    return True


@kernel
def rounded(g: Grid, b: Boat, points: Floats, h0: float) -> Floats:
    """Return the path with each turn that cannot be done, or is dearer, made the long way round; (0, 2): no room.

    Each corner takes the
    fastest way round that is free; where none is, the corner is drawn back to leeward and the leg after it moved
    parallel, or the leg after it goes straight to its end. The path is not checked otherwise.
    """
    n = points.shape[0]
    xs, ys = points[:, 0].copy(), points[:, 1].copy()
    ox, oy = np.empty(4 * n + 8), np.empty(4 * n + 8)
    ox[0], oy[0] = xs[0], ys[0]
    qx, qy, bx, by = np.empty(6), np.empty(6), np.empty(6), np.empty(6)
    m, t, h = 1, 0.0, h0
    for i in range(n - 1):
        px, py = ox[m - 1], oy[m - 1]
        dx, dy = xs[i + 1] - px, ys[i + 1] - py
        length = math.hypot(dx, dy)
        if length < 1e-9:
            continue
        a, v = track(b, dx, dy, t)
        now = turn_time(b, h, a)
        if now < math.inf and turn_guess(b, h, a) >= now:
            t += now + length / max(v, 1e-9)
            h = a
            ox[m], oy[m] = xs[i + 1], ys[i + 1]
            m += 1
            continue
        best, count, slid = math.inf, 0, False
        wx, wy = dx / length, dy / length
        ux, uy = 0.0, 0.0
        if m > 1:
            size = math.hypot(px - ox[m - 2], py - oy[m - 2])
            ux, uy = (px - ox[m - 2]) / size, (py - oy[m - 2]) / size
        for way in range(WAYS):
            x1, y1, x2, y2, ok = round_vector(b, h, a, t, way)
            if not ok:
                continue
            k = 2 if x2 == 0.0 and y2 == 0.0 else 3
            e, _, closes = overshoot(ux, uy, wx, wy, x1 + x2, y1 + y2)
            closes = closes and m > 1
            for mode in range(3):           # the same two lines; drawn back; straight to the end of the leg
                if mode < 2 and not closes:
                    continue
                if mode > 0 and best < math.inf:
                    continue
                back = e if mode == 0 else 0.0
                qx[0], qy[0] = px, py       # the incoming leg is sailed already: from its end on
                qx[1], qy[1] = px + back * ux, py + back * uy
                qx[2], qy[2] = qx[1] + x1, qy[1] + y1
                qx[3], qy[3] = qx[2] + x2, qy[2] + y2
                ex, ey = xs[i + 1], ys[i + 1]
                slides = mode == 1 and i + 2 < n
                if slides:
                    ex, ey, slides = cross(
                        qx[k], qy[k], wx, wy, xs[i + 1], ys[i + 1], xs[i + 2] - xs[i + 1], ys[i + 2] - ys[i + 1])
                if mode == 1 and not slides:
                    continue
                qx[k + 1], qy[k + 1] = ex, ey
                if not _free(g, qx, qy, k + 2):
                    continue
                end, _ = _sailed(b, qx, qy, k + 2, t, h)
                if end < best:
                    best, count, slid = end, k + 2, slides
                    for q in range(k + 2):
                        bx[q], by[q] = qx[q], qy[q]
        if count == 0:
            return np.empty((0, 2))
        t, h = _sailed(b, bx, by, count, t, h)
        if slid:
            xs[i + 1], ys[i + 1] = bx[count - 1], by[count - 1]
        if m > 1:
            ox[m - 1], oy[m - 1] = bx[1], by[1]
        for q in range(2, count):
            ox[m], oy[m] = bx[q], by[q]
            m += 1
    out = np.empty((m, 2))
    for q in range(m):
        out[q, 0], out[q, 1] = ox[q], oy[q]
    return out


@kernel
def fitted(b: Boat, points: Floats, h0: float) -> Floats:
    """Return the path with its close-hauled corners moved to the courses of the times at which they are now sailed."""
    n = points.shape[0]
    xs, ys = points[:, 0].copy(), points[:, 1].copy()
    fit_corners(b, xs, ys, n, h0, 1, False)
    out = np.empty((n, 2))
    for i in range(n):
        out[i, 0], out[i, 1] = xs[i], ys[i]
    return out
