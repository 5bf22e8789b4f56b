"""Compiled pieces of path surgery: the exact corner between two points, and a path whose corners fit its times."""

from __future__ import annotations

import math

import numpy as np

from companion.kernels.jit import kernel
from companion.planner.search.kernels import (
    SLACK_RAD,
    BoatModel,
    Floats,
    SegmentGrid,
    half_at,
    is_free,
    is_refused,
    speed_at,
    track,
    turn_guess,
    turn_time,
    walk,
    worst_half,
    wrap,
)

UP_STARBOARD, UP_PORT, DOWN_STARBOARD, DOWN_PORT = 0, 1, 2, 3
"""Kinds of an edge course: close hauled or at the best gybing angle, TWA positive or negative."""


@kernel
def edge_angle(b: BoatModel, kind: int, t0: float, t1: float) -> float:
    """Return the TWA [rad] of an edge course sailed from t0 to t1; NaN where there is none."""
    half = worst_half(b, t0, t1)
    a = max(half, b.up) if kind < 2 else b.down
    if a > b.max_twa or a < half:
        return math.nan
    return a if kind % 2 == 0 else -a


@kernel
def corner(
    b: BoatModel, px: float, py: float, h: float, t: float, qx: float, qy: float, k1: int, k2: int
) -> tuple[float, float, float, bool]:
    """Return (x, y, arrival time, ok): the corner of the two edge courses k1, k2 that lead from p to q.

    The boat is at p at time t heading h. The angles fit the times at which the two legs are sailed.
    """
    a1, a2 = edge_angle(b, k1, t, t), edge_angle(b, k2, t, t)
    l1 = l2 = t2 = vx = vy = wx = wy = 0.0
    rounds = 1 if b.kind == 0 else 12
    for r in range(rounds):
        if not (abs(a1) >= 0.0 and abs(a2) >= 0.0):
            return 0.0, 0.0, math.inf, False
        v1, v2 = speed_at(b, a1), speed_at(b, a2)
        vx, vy = v1 * math.sin(a1) + b.cx, v1 * math.cos(a1) + b.cy
        wx, wy = v2 * math.sin(a2) + b.cx, v2 * math.cos(a2) + b.cy
        det = vx * wy - vy * wx
        if abs(det) < 1e-12:
            return 0.0, 0.0, math.inf, False
        l1 = ((qx - px) * wy - (qy - py) * wx) / det
        l2 = (vx * (qy - py) - vy * (qx - px)) / det
        if l1 <= 1e-9 or l2 <= 1e-9:
            return 0.0, 0.0, math.inf, False
        ta = t + turn_guess(b, h, a1)
        tb = ta + l1
        tc = tb + turn_guess(b, a1, a2)
        t2 = tc + l2
        if r + 1 < rounds:
            n1, n2 = edge_angle(b, k1, ta, tb), edge_angle(b, k2, tc, t2)
            if b.room > 0.0 and turn_time(b, a1, a2) > tc - tb:  # the way round belongs to both legs
                n1, n2 = edge_angle(b, k1, ta, tc), edge_angle(b, k2, tb, t2)
            settled = abs(n1 - a1) + abs(n2 - a2) < 1e-10
            a1, a2 = n1, n2
            if settled:
                break
    if is_refused(b, a1, vx, vy) or is_refused(b, a2, wx, wy):
        return 0.0, 0.0, math.inf, False
    return px + l1 * vx, py + l1 * vy, t2, True


@kernel
def kind_of(a: float) -> int:
    """Return the edge course nearest to a leg's TWA."""
    if abs(a) <= 0.5 * math.pi:
        return 0 if a >= 0.0 else 1
    return 2 if a >= 0.0 else 3


@kernel
def fit_corners(b: BoatModel, xs: Floats, ys: Floats, n: int, h0: float, first: int, force: bool) -> None:
    """Re-solve corners from point ``first`` on so that their courses fit the times they are sailed at.

    With ``force`` every corner of two close-hauled legs, otherwise only where a leg is inside the no-go zone.
    """
    t, h = 0.0, h0
    for i in range(n - 1):
        for attempt in range(2):
            dx, dy = xs[i + 1] - xs[i], ys[i + 1] - ys[i]
            length = math.hypot(dx, dy)
            if length < 1e-9:
                break
            a, v = track(b, dx, dy, t)
            if v <= 1e-9:
                return
            t1 = t + turn_guess(b, h, a)
            t2 = t1 + length / v
            if attempt == 0 and i + 2 < n and i + 1 >= first and abs(a) < 0.5 * math.pi:
                ex, ey = xs[i + 2] - xs[i + 1], ys[i + 2] - ys[i + 1]
                if math.hypot(ex, ey) > 1e-9:
                    a2 = math.atan2(ex, ey)
                    half = worst_half(b, t1, t2)
                    near = 0.5 * math.pi
                    wants = abs(a) < half - SLACK_RAD or (
                        force and abs(a) < half + 0.1 and abs(a2) < half + 0.1 and a * a2 < 0.0
                    )
                    if wants and abs(a2) < near and abs(wrap(a - a2)) > 0.02:
                        x, y, _, ok = corner(b, xs[i], ys[i], h, t, xs[i + 2], ys[i + 2], kind_of(a), kind_of(a2))
                        if ok:
                            xs[i + 1], ys[i + 1] = x, y
                            continue
            t, h = t2, a
            break


@kernel
def _laid(b: BoatModel, kind: int, t: float, h: float, length: float) -> tuple[float, float]:
    """Return (TWA, end time) of an edge course of this length begun from TWA h at time t."""
    a = edge_angle(b, kind, t, t)
    t2 = t
    for _ in range(3):
        if not abs(a) >= 0.0:
            break
        t1 = t + turn_guess(b, h, a)
        t2 = t1 + length / max(speed_at(b, a), 1e-9)
        a = edge_angle(b, kind, t1, t2)
    return a, t2


@kernel
def relay(b: BoatModel, xs: Floats, ys: Floats, n: int, h0: float, i: int, j: int, longer: int, by: float) -> bool:
    """Lay the close-hauled legs between points i and j again, each at the edge of the no-go zone of its own time.

    Lengths are kept (that of leg ``longer`` grows by ``by`` [m]) except the two at the last tack, which close the
    gap. Returns False, with the path in disorder, where there is no tack between i and j or it does not close.
    """
    if b.cx != 0.0 or b.cy != 0.0 or j - i < 2 or j >= n:
        return False
    for _ in range(2):
        c = -1
        for k in range(i + 1, j):
            if (xs[k] - xs[k - 1]) * (xs[k + 1] - xs[k]) < 0.0:
                c = k
        if c < 0:
            return False
        t, h = 0.0, h0
        for k in range(j):
            dx, dy = xs[k + 1] - xs[k], ys[k + 1] - ys[k]
            length = math.hypot(dx, dy)
            if length < 1e-9:
                return False
            if k >= i and dy <= 0.0:
                return False
            a, v = track(b, dx, dy, t)
            if v <= 1e-9:
                return False
            if i <= k < c - 1:
                if k == longer:
                    length += by
                    longer = -1
                    if length <= 0.0:
                        return False
                kind = 0 if a >= 0.0 else 1
                a, t2 = _laid(b, kind, t, h, length)
                if not abs(a) >= 0.0:
                    return False
                # The rest of the block moves along, so that the lengths of its legs are kept.
                mx, my = xs[k] + length * math.sin(a) - xs[k + 1], ys[k] + length * math.cos(a) - ys[k + 1]
                for q in range(k + 1, c):
                    xs[q] += mx
                    ys[q] += my
                t, h = t2, a
            else:
                t += turn_guess(b, h, a) + length / v
                h = a
        end = t
        for k in range(j - 1, c, -1):
            dx, dy = xs[k + 1] - xs[k], ys[k + 1] - ys[k]
            length = math.hypot(dx, dy)
            kind = 0 if dx >= 0.0 else 1
            a = math.atan2(dx, dy)
            begin = end - length / max(speed_at(b, a), 1e-9)
            a = edge_angle(b, kind, max(0.0, begin), max(0.0, end))
            if not abs(a) >= 0.0:
                return False
            if k == longer:
                length += by
                longer = -1
                if length <= 0.0:
                    return False
            mx, my = xs[k + 1] - length * math.sin(a) - xs[k], ys[k + 1] - length * math.cos(a) - ys[k]
            for q in range(k, c, -1):
                xs[q] += mx
                ys[q] += my
            end = begin
        t, h = 0.0, h0
        for k in range(c - 1):
            dx, dy = xs[k + 1] - xs[k], ys[k + 1] - ys[k]
            a, v = track(b, dx, dy, t)
            t += turn_guess(b, h, a) + math.hypot(dx, dy) / max(v, 1e-9)
            h = a
        k1 = 0 if xs[c] > xs[c - 1] else 1
        x, y, _, ok = corner(b, xs[c - 1], ys[c - 1], h, t, xs[c + 1], ys[c + 1], k1, 1 - k1)
        if not ok:
            return False
        xs[c], ys[c] = x, y
    return True


# Turning the long way round: gybing instead of tacking (or tacking instead of gybing), as legs of the plan.
#
# The format's turns go the shorter way, and so does ArduRover's heading controller. A boat that cannot tack, or for
# which a tack costs more than running off, gybing and luffing up again, is made to by its waypoints: the leg before
# the corner is prolonged, one or two legs as long as the boat needs room for lead to leeward, and the leg after the
# corner is begun so much earlier that its line is unchanged. Every turn is then below half a circle and goes the way
# that is meant, the exact scorer judges the path like any other, and the autopilot has nothing to know of it.

WAYS = 3
"""Ways round: one leg on the side of the old course or of the new one, or one on each."""
_DEAD_RAD = 0.1
_LONGEST = 8.0


@kernel
def round_vector(b: BoatModel, a0: float, a1: float, t: float, way: int) -> tuple[float, float, float, float, bool]:
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
def _sailed(b: BoatModel, xs: Floats, ys: Floats, n: int, t: float, h: float) -> tuple[float, float]:
    for i in range(n - 1):
        dx, dy = xs[i + 1] - xs[i], ys[i + 1] - ys[i]
        length = math.hypot(dx, dy)
        if length > 1e-9:
            a, v = track(b, dx, dy, t)
            t += turn_guess(b, h, a) + length / max(v, 1e-9)
            h = a
    return t, h


@kernel
def _free(g: SegmentGrid, xs: Floats, ys: Floats, n: int) -> bool:
    for i in range(n - 1):  # noqa: SIM110 - compiled
        if not is_free(g, xs[i], ys[i], xs[i + 1], ys[i + 1]):
            return False
    return True


@kernel
def rounded(g: SegmentGrid, b: BoatModel, points: Floats, h0: float) -> Floats:
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
            for mode in range(3):  # the same two lines; drawn back; straight to the end of the leg
                if mode < 2 and not closes:
                    continue
                if mode > 0 and best < math.inf:
                    continue
                back = e if mode == 0 else 0.0
                qx[0], qy[0] = px, py  # the incoming leg is sailed already: from its end on
                qx[1], qy[1] = px + back * ux, py + back * uy
                qx[2], qy[2] = qx[1] + x1, qy[1] + y1
                qx[3], qy[3] = qx[2] + x2, qy[2] + y2
                ex, ey = xs[i + 1], ys[i + 1]
                slides = mode == 1 and i + 2 < n
                if slides:
                    ex, ey, slides = cross(
                        qx[k], qy[k], wx, wy, xs[i + 1], ys[i + 1], xs[i + 2] - xs[i + 1], ys[i + 2] - ys[i + 1]
                    )
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
def fitted(b: BoatModel, points: Floats, h0: float) -> Floats:
    """Return the path with its close-hauled corners moved to the courses of the times at which they are now sailed."""
    n = points.shape[0]
    xs, ys = points[:, 0].copy(), points[:, 1].copy()
    fit_corners(b, xs, ys, n, h0, 1, False)
    out = np.empty((n, 2))
    for i in range(n):
        out[i, 0], out[i, 1] = xs[i], ys[i]
    return out


# Guides made sailable: a straight segment as the direct leg, as equal tacks, or as tacks that fit the room.


@kernel
def check_path(g: SegmentGrid, b: BoatModel, points: Floats, h0: float) -> float:
    """Return the time of a path, inf where it collides or breaks an angle limit."""
    n = points.shape[0]
    for i in range(n - 1):
        if not is_free(g, points[i, 0], points[i, 1], points[i + 1, 0], points[i + 1, 1]):
            return math.inf
    return walk(b, points[:, 0].copy(), points[:, 1].copy(), n, h0)


@kernel
def zigzag(
    g: SegmentGrid, b: BoatModel, ax: float, ay: float, h: float, t: float, ex: float, ey: float, most: int
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
    g: SegmentGrid, b: BoatModel, ax: float, ay: float, h: float, t: float, ex: float, ey: float, deepest: int
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
