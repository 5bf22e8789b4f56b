"""Compiled basics of the search: is a segment free, how wide is the no-go zone, how long does a leg take.

Everything here is in the *wind frame*: origin at the start, +y where the wind comes from, so the compass angle
atan2(x, y) of a direction is its true wind angle. ``SegmentGrid`` holds the obstacles' boundary as segments in a
uniform grid, ``BoatModel`` the boat, the wind's uncertainty and the moving targets; ``world.py`` makes both.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from companion.geo.kernels import meets_discs
from companion.kernels.jit import kernel
from companion.planner.problem.parts import CLEAR_TURN_RAD
from companion.planner.problem.sigma import NONE, TABLE, sigma_of

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]

SLACK_RAD = 1e-6
"""How much deeper than the no-go zone's edge a leg may be [rad]: rounding only (the scorer allows 1.7e-4)."""
LEAST_LEG_M = 1e-3
"""A shorter leg has no course [m]: what rounding leaves of it points anywhere."""


class SegmentGrid(NamedTuple):
    """Boundary segments (m, 4) in cells: those of cell c are ``item[start[c]:start[c + 1]]``."""

    x0: float
    y0: float
    inv: float
    nx: int
    ny: int
    start: Ints
    item: Ints
    edges: Floats


class BoatModel(NamedTuple):
    """Speed by |TWA|, turning, no-go zone in time, losses, current, targets (m, 8), what gybing round takes.

    ``zone_half`` above 0: in a current, courses over the ground that the autopilot does not follow
    (``AutopilotBeatZone``).
    """

    twa: Floats
    mps: Floats
    omega: float
    base: float
    max_twa: float
    kind: int
    s0: float
    s1: float
    rho: float
    k: float
    horizon: Floats
    width: Floats
    tack_s: float
    gybe_s: float
    cx: float
    cy: float
    up: float
    down: float
    targets: Floats
    can_tack: bool
    room: float
    most_turn: float
    round_s: float
    zone_from: float
    zone_half: float
    zone_open: float


@kernel
def wrap(a: float) -> float:
    """Return the angle on [-π, π)."""
    if a >= math.pi:
        a -= 2.0 * math.pi
    elif a < -math.pi:
        a += 2.0 * math.pi
    return a


@kernel
def half_at(b: BoatModel, t: float) -> float:
    """Return the no-go half angle at time t [rad]."""
    if b.kind == NONE:
        return b.base
    if b.kind != TABLE:
        return b.base + b.k * sigma_of(t, b.kind, b.s0, b.s1, b.rho)
    h = b.horizon
    n = h.shape[0]
    if t <= h[0]:
        return float(b.base + b.width[0])
    for i in range(1, n):
        if t < h[i]:
            f = (t - h[i - 1]) / (h[i] - h[i - 1])
            return float(b.base + b.width[i - 1] + f * (b.width[i] - b.width[i - 1]))
    return float(b.base + b.width[n - 1])


@kernel
def worst_half(b: BoatModel, t0: float, t1: float) -> float:
    """Return the largest no-go half angle over [t0, t1] [rad]."""
    if b.kind == NONE:
        return b.base
    worst = max(half_at(b, t0), half_at(b, t1))
    if b.kind == TABLE:
        for i in range(b.horizon.shape[0]):
            if t0 < b.horizon[i] < t1:
                worst = max(worst, b.base + b.width[i])
    return worst


@kernel
def speed_at(b: BoatModel, a: float) -> float:
    """Return the speed [m/s] at |TWA| a [rad]."""
    a = abs(a)
    n = b.twa.shape[0]
    if a <= b.twa[0]:
        return float(b.mps[0])
    if a >= b.twa[n - 1]:
        return float(b.mps[n - 1])
    lo, hi = 0, n - 1
    while hi - lo > 1:
        mid = (lo + hi) >> 1
        if b.twa[mid] <= a:
            lo = mid
        else:
            hi = mid
    return float(b.mps[lo] + (b.mps[hi] - b.mps[lo]) * (a - b.twa[lo]) / (b.twa[hi] - b.twa[lo]))


@kernel
def _cross_track(b: BoatModel, h: float, dx: float, dy: float) -> float:
    v = speed_at(b, wrap(h))
    return (v * math.sin(h) + b.cx) * dy - (v * math.cos(h) + b.cy) * dx


@kernel
def _root(b: BoatModel, lo: float, hi: float, low: float, high: float, dx: float, dy: float) -> float:
    """Return the heading between two of opposite sides that makes the direction good (Illinois' false position)."""
    side = 0
    for _ in range(60):
        if hi - lo < 1e-12 or low == high:
            break
        mid = (lo * high - hi * low) / (high - low)
        value = _cross_track(b, mid, dx, dy)
        if abs(value) < 1e-13:
            return mid
        if (value > 0.0) == (low > 0.0):
            lo, low = mid, value
            high = 0.5 * high if side == 1 else high
            side = 1
        else:
            hi, high = mid, value
            low = 0.5 * low if side == -1 else low
            side = -1
    return lo if abs(low) < abs(high) else hi


@kernel
def is_zoned(b: BoatModel, course: float) -> bool:
    """Is a course over the ground one that the autopilot does not follow?"""
    return b.zone_half > 0.0 and abs(wrap(wrap(course) - b.zone_from)) < b.zone_half


@kernel
def is_refused(b: BoatModel, a: float, vx: float, vy: float) -> bool:
    """Return whether no heading that the autopilot sails makes this ground velocity good (``AutopilotBeatZone``)."""
    if b.zone_half <= 0.0:
        return False
    zoned = is_zoned(b, math.atan2(vx, vy))
    return zoned if b.zone_open == 0.0 else not zoned and abs(a) < b.zone_open


@kernel
def track(b: BoatModel, dx: float, dy: float, t: float) -> tuple[float, float]:
    """Return (TWA of the heading, speed over ground) that makes the ground direction (dx, dy) good."""
    course = wrap(math.atan2(dx, dy))  # dead down wind is -π, as everywhere
    if b.cx == 0.0 and b.cy == 0.0:
        return course, speed_at(b, course)
    size = math.hypot(dx, dy)
    dx, dy = dx / size, dy / size
    half = half_at(b, t)
    if b.zone_half > 0.0:
        zoned = is_zoned(b, course)
        if zoned and b.zone_open == 0.0:
            return course, 0.0
        if not zoned:
            half = max(half, b.zone_open)
    best_h, best, any_h, any_v = course, 0.0, course, 0.0
    n = 60  # six degrees: two roots within one are a polar's dent, which the scorer may still find
    last = _cross_track(b, course - math.pi, dx, dy)
    for i in range(1, n + 1):
        h1 = course - math.pi + 2.0 * math.pi * i / n
        now = _cross_track(b, h1, dx, dy)
        if last * now <= 0.0:
            h = wrap(_root(b, h1 - 2.0 * math.pi / n, h1, last, now, dx, dy))
            v = speed_at(b, h)
            along = (v * math.sin(h) + b.cx) * dx + (v * math.cos(h) + b.cy) * dy
            if along > any_v:
                any_h, any_v = h, along
            if along > best and abs(h) >= half - 1e-9 and abs(h) <= b.max_twa + 1e-9:
                best_h, best = h, along
        last = now
    if best > 0.0:
        return best_h, best
    return any_h, 0.0 if b.zone_open > 0.0 else any_v


@kernel
def turn_time(b: BoatModel, h0: float, h1: float) -> float:
    """Return the time [s] to turn from TWA h0 to h1 the shorter way, losses included; inf for a tack it cannot do."""
    t = abs(wrap(h1 - h0)) / b.omega
    if h0 * h1 < 0.0:
        through_eye = abs(h0) + abs(h1)
        if not b.can_tack and through_eye < math.pi + CLEAR_TURN_RAD:
            return math.inf
        t += b.tack_s if through_eye < math.pi else b.gybe_s
    return t


@kernel
def turn_guess(b: BoatModel, h0: float, h1: float) -> float:
    """Return ``turn_time``, or about what it takes to turn the other way, through a leg of its own, if that is less."""
    t = turn_time(b, h0, h1)
    if b.room > 0.0 and h0 * h1 < 0.0:
        through_eye = abs(h0) + abs(h1)
        if through_eye < math.pi + CLEAR_TURN_RAD:
            t = min(t, (2.0 * math.pi - through_eye) / b.omega + b.gybe_s + b.round_s)
        elif b.can_tack:
            t = min(t, through_eye / b.omega + b.tack_s + b.round_s)
    return t


@kernel
def wound_at(b: BoatModel, xs: Floats, ys: Floats, course: Floats, i: int) -> float:
    """Return how far the boat has turned [rad, signed] at point ``i``, before its turn there, since its last long leg.

    ``course`` is the TWA of arrival at each point.
    """
    wound = 0.0
    while i > 0 and math.hypot(xs[i] - xs[i - 1], ys[i] - ys[i - 1]) < b.room:
        wound += wrap(course[i] - course[i - 1])
        i -= 1
    return wound


@kernel
def is_free(g: SegmentGrid, ax: float, ay: float, bx: float, by: float) -> bool:
    """Is the segment clear of every boundary segment? Exact; walks the grid's rows that it crosses."""
    if g.edges.shape[0] == 0:
        return True
    x_lo, x_hi = min(ax, bx), max(ax, bx)
    y_lo, y_hi = min(ay, by), max(ay, by)
    j0 = max(0, math.floor((y_lo - g.y0) * g.inv))
    j1 = min(g.ny - 1, math.floor((y_hi - g.y0) * g.inv))
    if j1 < j0 or (x_hi - g.x0) * g.inv < 0.0 or (x_lo - g.x0) * g.inv > g.nx:
        return True
    dx, dy = bx - ax, by - ay
    for j in range(j0, j1 + 1):
        left, right = x_lo, x_hi
        if j1 > j0 and dy != 0.0:
            ya = max(y_lo, g.y0 + j / g.inv)
            yb = min(y_hi, g.y0 + (j + 1) / g.inv)
            xa = ax + dx * (ya - ay) / dy
            xb = ax + dx * (yb - ay) / dy
            pad = 1e-6 / g.inv
            left = max(x_lo, min(xa, xb) - pad)
            right = min(x_hi, max(xa, xb) + pad)
        i0 = max(0, math.floor((left - g.x0) * g.inv))
        i1 = min(g.nx - 1, math.floor((right - g.x0) * g.inv))
        row = j * g.nx
        for c in range(row + i0, row + i1 + 1):
            for m in range(g.start[c], g.start[c + 1]):
                e = g.item[m]
                cx, cy, ex, ey = g.edges[e, 0], g.edges[e, 1], g.edges[e, 2], g.edges[e, 3]
                if min(cx, ex) > x_hi or max(cx, ex) < x_lo or min(cy, ey) > y_hi or max(cy, ey) < y_lo:
                    continue
                s1 = dx * (cy - ay) - dy * (cx - ax)
                s2 = dx * (ey - ay) - dy * (ex - ax)
                if (s1 > 0.0 and s2 > 0.0) or (s1 < 0.0 and s2 < 0.0):
                    continue
                fx, fy = ex - cx, ey - cy
                s3 = fx * (ay - cy) - fy * (ax - cx)
                s4 = fx * (by - cy) - fy * (bx - cx)
                if (s3 > 0.0 and s4 > 0.0) or (s3 < 0.0 and s4 < 0.0):
                    continue
                return False
    return True


@kernel
def rasterise(edges: Floats, x0: float, y0: float, inv: float, nx: int, ny: int) -> tuple[Ints, Ints]:
    """Return (start, item): the segments of every grid cell, a cell more than needed at worst."""
    start = np.zeros(nx * ny + 1, np.int32)
    item = np.empty(0, np.int32)
    for phase in range(2):
        if phase == 1:
            for c in range(nx * ny):
                start[c + 1] += start[c]
            item = np.empty(start[nx * ny], np.int32)
            for c in range(nx * ny, 0, -1):
                start[c] = start[c - 1]
            start[0] = 0
        for e in range(edges.shape[0]):
            ax, ay, bx, by = edges[e, 0], edges[e, 1], edges[e, 2], edges[e, 3]
            y_lo, y_hi, x_lo, x_hi = min(ay, by), max(ay, by), min(ax, bx), max(ax, bx)
            j0 = min(ny - 1, max(0, math.floor((y_lo - y0) * inv - 1e-6)))
            j1 = min(ny - 1, max(0, math.floor((y_hi - y0) * inv + 1e-6)))
            for j in range(j0, j1 + 1):
                left, right = x_lo, x_hi
                if j1 > j0 and by != ay:
                    ya, yb = max(y_lo, y0 + j / inv), min(y_hi, y0 + (j + 1) / inv)
                    xa, xb = ax + (bx - ax) * (ya - ay) / (by - ay), ax + (bx - ax) * (yb - ay) / (by - ay)
                    left, right = max(x_lo, min(xa, xb)), min(x_hi, max(xa, xb))
                i0 = min(nx - 1, max(0, math.floor((left - x0) * inv - 1e-4)))
                i1 = min(nx - 1, max(0, math.floor((right - x0) * inv + 1e-4)))
                for i in range(i0, i1 + 1):
                    c = j * nx + i
                    if phase == 0:
                        start[c + 1] += 1
                    else:
                        item[start[c + 1]] = e
                        start[c + 1] += 1
    return start, item


@kernel
def walk_on(b: BoatModel, xs: Floats, ys: Floats, first: int, last: int, t: float, h: float, wound: float) -> float:
    """Return when the boat is at point ``last``, having come to ``first`` at ``t`` on TWA ``h``; inf as ``walk``.

    ``wound`` is what it has turned since it last had room to settle [rad].
    """
    for i in range(first, last):
        dx, dy = xs[i + 1] - xs[i], ys[i + 1] - ys[i]
        length = math.hypot(dx, dy)
        if length < 1e-9:
            continue
        a, v = track(b, dx, dy, t)
        if v <= 1e-9 or abs(a) > b.max_twa + SLACK_RAD:
            return math.inf
        if b.room > 0.0:
            turn = wrap(a - h)
            if length < LEAST_LEG_M and abs(turn) > SLACK_RAD:
                return math.inf
            if abs(turn) > math.pi - SLACK_RAD and turn * wound < 0.0:
                turn = -turn  # straight back is a turn to either side: it unwinds nothing
            wound += turn
            if abs(wound) > b.most_turn + SLACK_RAD and i > 0:
                return math.inf
            if length >= b.room:
                wound = 0.0
        t1 = t + turn_time(b, h, a)
        t2 = t1 + length / v
        if abs(a) < worst_half(b, t1, t2) - SLACK_RAD:
            return math.inf
        if b.targets.shape[0] > 0 and (
            meets_discs(b.targets, xs[i], ys[i], xs[i], ys[i], t, t1)
            or meets_discs(b.targets, xs[i], ys[i], xs[i + 1], ys[i + 1], t1, t2)
        ):
            return math.inf
        t, h = t2, a
    return t


@kernel
def walk(b: BoatModel, xs: Floats, ys: Floats, n: int, h0: float) -> float:
    """Return the time [s] of the path of n points; inf where it breaks a limit of angles or turns or meets a target."""
    return walk_on(b, xs, ys, 0, n - 1, 0.0, h0, 0.0)
