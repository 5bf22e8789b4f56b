"""Compiled pieces of path surgery: the exact corner between two points, and a path whose corners fit its times."""

from __future__ import annotations

import math

from companion.kernels.jit import kernel
from companion.planner.search.kernels import (
    SLACK_RAD,
    Boat,
    Floats,
    is_refused,
    speed_at,
    track,
    turn_guess,
    turn_time,
    worst_half,
    wrap,
)

UP_STARBOARD, UP_PORT, DOWN_STARBOARD, DOWN_PORT = 0, 1, 2, 3
"""Kinds of an edge course: close hauled or at the best gybing angle, TWA positive or negative."""


@kernel
def edge_angle(b: Boat, kind: int, t0: float, t1: float) -> float:
    """Return the TWA [rad] of an edge course sailed from t0 to t1; NaN where there is none."""
    half = worst_half(b, t0, t1)
    a = max(half, b.up) if kind < 2 else b.down
    if a > b.max_twa or a < half:
        return math.nan
    return a if kind % 2 == 0 else -a


@kernel
def corner(
    b: Boat, px: float, py: float, h: float, t: float, qx: float, qy: float, k1: int, k2: int
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
            if b.room > 0.0 and turn_time(b, a1, a2) > tc - tb:   # the way round belongs to both legs
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
def fit_corners(b: Boat, xs: Floats, ys: Floats, n: int, h0: float, first: int, force: bool) -> None:
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
                        x, y, _, ok = corner(
                            b, xs[i], ys[i], h, t, xs[i + 2], ys[i + 2], kind_of(a), kind_of(a2)
                        )
                        if ok:
                            xs[i + 1], ys[i + 1] = x, y
                            continue
            t, h = t2, a
            break


@kernel
def _laid(b: Boat, kind: int, t: float, h: float, length: float) -> tuple[float, float]:
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
def relay(
    b: Boat, xs: Floats, ys: Floats, n: int, h0: float, i: int, j: int, longer: int, by: float
) -> bool:
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
