"""Annealed waypoints: the continuous local search that turns a good path into a nearly optimal one.

The state is the list of waypoints itself; the cost is the exact one (turns, losses, time-varying no-go zone,
moving targets) and a candidate that collides or points too high is refused, so every state is feasible. What
makes it work are moves that keep courses: slide a corner along its leg, shift a whole leg or a block of legs
parallel, re-solve a corner from two close-hauled courses at the times they are sailed, besides the plain ones.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from companion.kernels.jit import kernel
from companion.kernels.xorshift import uniform
from companion.planner.search.kernels import (
    Boat,
    Floats,
    Grid,
    is_free,
    track,
    turn_time,
    walk,
    walk_on,
    wound_at,
)
from companion.planner.search.moves import fit_corners
from companion.planner.search.proposals import MOST_POINTS, propose


@kernel
def shared(xs: Floats, ys: Floats, n: int, ox: Floats, oy: Floats, on: int) -> tuple[int, int]:
    """Return how many points two paths share at their beginning and, apart from those, at their end."""
    head = 0
    while head < n and head < on and xs[head] == ox[head] and ys[head] == oy[head]:
        head += 1
    tail = 0
    while tail < n - head and tail < on - head and xs[n - 1 - tail] == ox[on - 1 - tail] and (
        ys[n - 1 - tail] == oy[on - 1 - tail]
    ):
        tail += 1
    return head, tail


@kernel
def timetable(b: Boat, xs: Floats, ys: Floats, n: int, h0: float, at: Floats, course: Floats) -> None:
    """Fill in when the boat is at each point and the TWA that it arrives there with."""
    t, h = 0.0, h0
    at[0], course[0] = t, h
    for i in range(n - 1):
        dx, dy = xs[i + 1] - xs[i], ys[i + 1] - ys[i]
        length = math.hypot(dx, dy)
        if length >= 1e-9:
            a, v = track(b, dx, dy, t)
            t += turn_time(b, h, a) + length / max(v, 1e-9)
            h = a
        at[i + 1], course[i + 1] = t, h


@kernel
def time_after(
    b: Boat, xs: Floats, ys: Floats, n: int, head: int, tail: int, at: Floats, course: Floats, on: int
) -> float:
    """Return the time of a path that shares ``head`` and ``tail`` points with one whose timetable is known.

    Where nothing depends on the moment, only the legs that differ are walked (and the turn after them).
    """
    first = max(0, head - 1)
    last = n - 1
    timeless = b.kind == 0 and b.targets.shape[0] == 0
    wound = 0.0
    if timeless and tail > 1:
        last = n - tail + 1
    if b.room > 0.0:
        wound = wound_at(b, xs, ys, course, first)
    # a leg of no length has no course: the turn after it is out of the leg before
    while last < n - 1 and math.hypot(xs[last] - xs[last - 1], ys[last] - ys[last - 1]) < max(b.room, 1e-9):
        last += 1
        tail -= 1
    t = walk_on(b, xs, ys, first, last, float(at[first]), float(course[first]), wound)
    if last < n - 1:
        t += float(at[on - 1] - at[on - tail + 1])
    return t


@kernel
def collides(g: Grid, xs: Floats, ys: Floats, n: int, head: int, tail: int) -> bool:
    """Does one of the legs that are not shared collide?"""
    for i in range(max(0, head - 1), min(n - 1, n - tail)):
        if not is_free(g, xs[i], ys[i], xs[i + 1], ys[i + 1]):
            return True
    return False


@kernel
def anneal(
    g: Grid, b: Boat, points: Floats, h0: float, goal: Floats, size: float, spots: Floats, rounds: int,
    hot: float, cold: float, price: float, rng: NDArray[np.uint64],
) -> tuple[float, Floats, float, Floats]:
    """Anneal for ``rounds`` moves from temperature ``hot`` to ``cold`` [s]; the path must be feasible.

    Every point costs ``price`` [s] besides, so that a leg has to earn its place. Returns (best cost, best points,
    last cost, last points), costs without the price.
    """
    n = points.shape[0]
    xs, ys = np.empty(MOST_POINTS + 4), np.empty(MOST_POINTS + 4)
    cx, cy = np.empty(MOST_POINTS + 4), np.empty(MOST_POINTS + 4)
    bx, by = np.empty(MOST_POINTS + 4), np.empty(MOST_POINTS + 4)
    for i in range(n):
        xs[i], ys[i] = points[i, 0], points[i, 1]
        bx[i], by[i] = xs[i], ys[i]
    at, course = np.empty(MOST_POINTS + 4), np.empty(MOST_POINTS + 4)
    timetable(b, xs, ys, n, h0, at, course)
    cost = walk(b, xs, ys, n, h0) + price * n
    best, bn = cost, n
    ratio = (cold / hot) ** (1.0 / max(1, rounds))
    heat = hot
    for _ in range(rounds):
        heat *= ratio
        for i in range(n):
            cx[i], cy[i] = xs[i], ys[i]
        cn = propose(b, cx, cy, n, h0, goal, size, spots, at, course, rng)
        if cn < 2:
            continue
        limit = cost - heat * math.log(1.0 - uniform(rng))
        head, tail = shared(cx, cy, cn, xs, ys, n)
        new = time_after(b, cx, cy, cn, head, tail, at, course, n) + price * cn
        if new == math.inf and b.kind != 0:
            fit_corners(b, cx, cy, cn, h0, 1, False)
            head, tail = shared(cx, cy, cn, xs, ys, n)
            new = time_after(b, cx, cy, cn, head, tail, at, course, n) + price * cn
        if new > limit or collides(g, cx, cy, cn, head, tail):
            continue
        cost, n = new, cn
        for i in range(n):
            xs[i], ys[i] = cx[i], cy[i]
        timetable(b, xs, ys, n, h0, at, course)
        if cost < best:
            best, bn = cost, n
            for i in range(n):
                bx[i], by[i] = xs[i], ys[i]
    out, last = np.empty((bn, 2)), np.empty((n, 2))
    for i in range(bn):
        out[i, 0], out[i, 1] = bx[i], by[i]
    for i in range(n):
        last[i, 0], last[i, 1] = xs[i], ys[i]
    return best - price * bn, out, cost - price * n, last
