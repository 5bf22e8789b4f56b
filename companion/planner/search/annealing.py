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
    BoatModel,
    Floats,
    SegmentGrid,
    is_free,
    track,
    turn_guess,
    turn_time,
    walk,
    walk_on,
    wound_at,
)
from companion.planner.search.moves import WAYS, corner, cross, fit_corners, kind_of, overshoot, relay, round_vector

# One random change of a path: what annealing proposes.
#
# Most moves keep courses: slide a corner along its leg, shift a whole leg or a block of legs parallel, re-solve a
# corner from two close-hauled courses at the times they are sailed, lay a chain of legs again in time, turn a corner
# the long way round. What a move gives need not be feasible: ``anneal`` decides.

MOST_POINTS = 1200


@kernel
def arrive(b: BoatModel, ax: float, ay: float, ex: float, ey: float, t: float, h: float) -> tuple[float, float]:
    """Return (time, TWA) on arrival at e from a, where the boat is at time t with TWA h."""
    dx, dy = ex - ax, ey - ay
    length = math.hypot(dx, dy)
    if length < 1e-9:
        return t, h
    a, v = track(b, dx, dy, t)
    return t + turn_guess(b, h, a) + length / max(v, 1e-9), a


@kernel
def _course(xs: Floats, ys: Floats, i: int) -> tuple[float, float]:
    dx, dy = xs[i + 1] - xs[i], ys[i + 1] - ys[i]
    d = math.hypot(dx, dy)
    return (dx / d, dy / d) if d > 1e-12 else (0.0, 0.0)


@kernel
def _delete(xs: Floats, ys: Floats, n: int, i: int, count: int) -> int:
    for k in range(i, n - count):
        xs[k], ys[k] = xs[k + count], ys[k + count]
    return n - count


@kernel
def _insert(xs: Floats, ys: Floats, n: int, i: int, x: float, y: float) -> int:
    for k in range(n, i, -1):
        xs[k], ys[k] = xs[k - 1], ys[k - 1]
    xs[i], ys[i] = x, y
    return n + 1


@kernel
def _pair(r: float, low: bool) -> tuple[int, int]:
    """Return two edge courses: mostly a tack or a gybe, sometimes a mixture."""
    if r < 0.4:
        return (0, 1) if not low else (2, 3)
    if r < 0.8:
        return (1, 0) if not low else (3, 2)
    if r < 0.85:
        return 0, 2
    if r < 0.9:
        return 2, 0
    if r < 0.95:
        return 1, 3
    return 3, 1


@kernel
def go_round(b: BoatModel, xs: Floats, ys: Floats, n: int, i: int, at: Floats, course: Floats, way: int) -> int:
    """Turn corner ``i`` the long way round, the lines of its two legs kept; return the number of points, 0: cannot."""
    h, a = course[i], course[i + 1]
    if not h * a < 0.0 or n + 2 >= MOST_POINTS:
        return 0
    ux, uy = _course(xs, ys, i - 1)
    wx, wy = _course(xs, ys, i)
    x1, y1, x2, y2, ok = round_vector(b, h, a, at[i], way)
    if not ok:
        return 0
    e, _, ok = overshoot(ux, uy, wx, wy, x1 + x2, y1 + y2)
    if not ok:
        return 0
    xs[i] += e * ux
    ys[i] += e * uy
    n = _insert(xs, ys, n, i + 1, xs[i] + x1, ys[i] + y1)
    if x2 != 0.0 or y2 != 0.0:
        n = _insert(xs, ys, n, i + 2, xs[i + 1] + x2, ys[i + 1] + y2)
    return n


@kernel
def straighten(xs: Floats, ys: Floats, n: int, i: int, count: int) -> int:
    """Put one corner in place of point ``i`` and ``count`` after it, where the legs around them meet; 0: nowhere."""
    j = i + count
    if j + 1 >= n:
        return 0
    x, y, ok = cross(
        xs[i - 1], ys[i - 1], xs[i] - xs[i - 1], ys[i] - ys[i - 1], xs[j], ys[j], xs[j + 1] - xs[j], ys[j + 1] - ys[j]
    )
    if not ok:
        return 0
    xs[i], ys[i] = x, y
    return _delete(xs, ys, n, i + 1, count)


# The moves: each changes the path in place and returns its new number of points, 0: there is no such move.


@kernel
def _push_corner(xs: Floats, ys: Floats, n: int, step: float, rng: NDArray[np.uint64]) -> int:
    """Push a corner anywhere, at most ``step`` metres either way."""
    i = 1 + int(uniform(rng) * (n - 2))
    xs[i] += step * (2.0 * uniform(rng) - 1.0)
    ys[i] += step * (2.0 * uniform(rng) - 1.0)
    return n


@kernel
def _keep_course(
    b: BoatModel, xs: Floats, ys: Floats, n: int, m: int, back: bool, ax: float, ay: float, at: Floats, course: Floats
) -> int:
    """Solve corner ``m`` again by the two courses that it had before its neighbour moved away from (ax, ay); 0: cannot.

    ``back``: the neighbour is the next point, not the one before.
    """
    if not 0 < m < n - 1:
        return n
    t, h = at[m - 1], course[m - 1]
    if back:
        k1 = kind_of(math.atan2(xs[m] - xs[m - 1], ys[m] - ys[m - 1]))
        k2 = kind_of(math.atan2(ax - xs[m], ay - ys[m]))
    else:
        k1 = kind_of(math.atan2(xs[m] - ax, ys[m] - ay))
        k2 = kind_of(math.atan2(xs[m + 1] - xs[m], ys[m + 1] - ys[m]))
    if k1 == k2:
        return 0
    if not back:
        t, h = arrive(b, xs[m - 2], ys[m - 2], xs[m - 1], ys[m - 1], at[m - 2], course[m - 2])
    x, y, _, ok = corner(b, xs[m - 1], ys[m - 1], h, t, xs[m + 1], ys[m + 1], k1, k2)
    if not ok:
        return 0
    xs[m], ys[m] = x, y
    return n


@kernel
def _slide_corner(
    b: BoatModel, xs: Floats, ys: Floats, n: int, step: float, at: Floats, course: Floats, rng: NDArray[np.uint64]
) -> int:
    """Slide a corner along one of its legs, at times keeping the courses next to it."""
    i = 1 + int(uniform(rng) * (n - 2))
    if uniform(rng) < 0.5:
        ux, uy = _course(xs, ys, i - 1)
    else:
        ux, uy = _course(xs, ys, i)
    s = step if uniform(rng) < 0.5 else -step
    ax, ay = xs[i], ys[i]
    xs[i] += s * ux
    ys[i] += s * uy
    if uniform(rng) < 0.6:  # ... and keep the courses next to it
        back = uniform(rng) < 0.5
        return _keep_course(b, xs, ys, n, i - 1 if back else i + 1, back, ax, ay, at, course)
    return n


@kernel
def _shift_block(xs: Floats, ys: Floats, n: int, step: float, rng: NDArray[np.uint64]) -> int:
    """Shift a block of legs, courses kept."""
    i = 1 + int(uniform(rng) * (n - 2))
    j = min(n - 2, i + int(4.0 * uniform(rng) * uniform(rng) + uniform(rng)))
    ux, uy = _course(xs, ys, i - 1)
    s = step if uniform(rng) < 0.5 else -step
    if uniform(rng) < 0.3:
        ux, uy = 2.0 * uniform(rng) - 1.0, 2.0 * uniform(rng) - 1.0
    for k in range(i, j + 1):
        xs[k] += s * ux
        ys[k] += s * uy
    return n


@kernel
def _one_corner(
    b: BoatModel, xs: Floats, ys: Floats, n: int, at: Floats, course: Floats, rng: NDArray[np.uint64]
) -> int:
    """Replace a stretch by one corner of two edge courses."""
    i = int(uniform(rng) * (n - 1))
    j = min(n - 1, i + 1 + int(4.0 * uniform(rng) * uniform(rng) + 0.7))
    t, h = at[i], course[i]
    k1, k2 = _pair(uniform(rng), ys[j] < ys[i])
    x, y, _, ok = corner(b, xs[i], ys[i], h, t, xs[j], ys[j], k1, k2)
    if not ok or n + 1 >= MOST_POINTS:
        return 0
    if j > i + 1:
        n = _delete(xs, ys, n, i + 1, j - i - 1)
    return _insert(xs, ys, n, i + 1, x, y)


@kernel
def _leave_out(xs: Floats, ys: Floats, n: int, rng: NDArray[np.uint64]) -> int:
    """Leave corners out."""
    i = 1 + int(uniform(rng) * (n - 2))
    count = min(n - 1 - i, 1 + int(3.0 * uniform(rng) * uniform(rng)))
    return _delete(xs, ys, n, i, count)


@kernel
def _corner_beside(xs: Floats, ys: Floats, n: int, step: float, rng: NDArray[np.uint64]) -> int:
    """Put a new corner beside a leg."""
    i = int(uniform(rng) * (n - 1))
    f = uniform(rng)
    x = xs[i] + f * (xs[i + 1] - xs[i]) + step * (2.0 * uniform(rng) - 1.0)
    y = ys[i] + f * (ys[i + 1] - ys[i]) + step * (2.0 * uniform(rng) - 1.0)
    return _insert(xs, ys, n, i + 1, x, y)


@kernel
def _nearest_leg(xs: Floats, ys: Floats, n: int, x: float, y: float) -> int:
    """Return the leg that is nearest to (x, y), -1: there is none."""
    best, m = math.inf, -1
    for i in range(n - 1):
        dx, dy = xs[i + 1] - xs[i], ys[i + 1] - ys[i]
        d2 = dx * dx + dy * dy
        f = ((x - xs[i]) * dx + (y - ys[i]) * dy) / d2 if d2 > 0.0 else 0.0
        f = min(1.0, max(0.0, f))
        d = (xs[i] + f * dx - x) ** 2 + (ys[i] + f * dy - y) ** 2
        if d < best:
            best, m = d, i
    return m


@kernel
def _touch_spot(xs: Floats, ys: Floats, n: int, spots: Floats, rng: NDArray[np.uint64]) -> int:
    """Lead the path by an obstacle's corner, through a new point or by one of the nearest leg's two."""
    q = int(uniform(rng) * spots.shape[0])
    x, y = spots[q, 0], spots[q, 1]
    m = _nearest_leg(xs, ys, n, x, y)
    if m < 0:
        return 0
    r = uniform(rng)
    if r < 0.4 and n + 1 < MOST_POINTS:
        return _insert(xs, ys, n, m + 1, x, y)
    i = m if r < 0.7 else m + 1
    if i == 0 or i == n - 1:
        return 0
    xs[i], ys[i] = x, y
    return n


@kernel
def _move_end(xs: Floats, ys: Floats, n: int, goal: Floats, step: float, rng: NDArray[np.uint64]) -> int:
    """Move the end in the goal's disc."""
    radius = goal[2]
    if radius <= 0.0:
        return 0
    m = n - 1
    if uniform(rng) < 0.5 and n > 2:  # ... carrying the last corner with it
        s = min(step, radius) * (2.0 * uniform(rng) - 1.0)
        ux, uy = _course(xs, ys, m - 2)
        xs[m - 1] += s * ux
        ys[m - 1] += s * uy
        xs[m] += s * ux
        ys[m] += s * uy
    elif uniform(rng) < 0.3:
        ux, uy = _course(xs, ys, m - 1)
        s = min(step, radius) * (2.0 * uniform(rng) - 1.0)
        xs[m] += s * ux
        ys[m] += s * uy
    else:
        xs[m] += min(step, radius) * (2.0 * uniform(rng) - 1.0)
        ys[m] += min(step, radius) * (2.0 * uniform(rng) - 1.0)
    dx, dy = xs[m] - goal[0], ys[m] - goal[1]
    d = math.hypot(dx, dy)
    if d > radius:
        f = radius / d
        xs[m], ys[m] = goal[0] + f * dx, goal[1] + f * dy
    return n


@kernel
def _swap_courses(xs: Floats, ys: Floats, n: int, rng: NDArray[np.uint64]) -> int:
    """Sail two courses in the other order."""
    i = int(uniform(rng) * (n - 1))
    if i + 2 >= n:
        return 0
    xs[i + 1] = xs[i] + xs[i + 2] - xs[i + 1]
    ys[i + 1] = ys[i] + ys[i + 2] - ys[i + 1]
    return n


@kernel
def _other_chain(xs: Floats, ys: Floats, n: int, i: int, j: int, rng: NDArray[np.uint64]) -> tuple[int, int, int]:
    """Part, leave out or pick a leg of the chain from point i to j; return (points, j, the leg to be longer or -1)."""
    r, longer = uniform(rng), -1
    if r < 0.1 and n + j - i < MOST_POINTS:  # ... each of them in two parts
        for m in range(j - 1, i - 1, -1):
            n = _insert(xs, ys, n, m + 1, 0.5 * (xs[m] + xs[m + 1]), 0.5 * (ys[m] + ys[m + 1]))
        j += j - i
    elif r < 0.2 and n + 1 < MOST_POINTS:  # ... one of them in two parts
        m = i + int(uniform(rng) * (j - i))
        f = uniform(rng)
        n = _insert(xs, ys, n, m + 1, xs[m] + f * (xs[m + 1] - xs[m]), ys[m] + f * (ys[m + 1] - ys[m]))
        j += 1
    elif r < 0.45 and j - i > 2:  # ... without some of the points between
        m = i + 1 + int(uniform(rng) * (j - i - 1))
        count = min(j - m, 1 + int(3.0 * uniform(rng) * uniform(rng)))
        if j - count - i < 2:
            return 0, j, -1
        n = _delete(xs, ys, n, m, count)
        j -= count
    elif r < 0.85:  # ... one of them longer or shorter
        longer = i + int(uniform(rng) * (j - i))
    return n, j, longer


@kernel
def _lay_again(b: BoatModel, xs: Floats, ys: Floats, n: int, h0: float, step: float, rng: NDArray[np.uint64]) -> int:
    """Lay close-hauled legs again in time."""
    i = int(uniform(rng) * (n - 2))
    j = min(n - 1, i + 2 + int(8.0 * uniform(rng) * uniform(rng)))
    if uniform(rng) < 0.25:  # (sometimes to the end, or from the start)
        j = n - 1
    if uniform(rng) < 0.25:
        i = 0
    n, j, longer = _other_chain(xs, ys, n, i, j, rng)
    if n == 0 or not relay(b, xs, ys, n, h0, i, j, longer, step if uniform(rng) < 0.5 else -step):
        return 0
    return n


@kernel
def propose(
    b: BoatModel,
    xs: Floats,
    ys: Floats,
    n: int,
    h0: float,
    goal: Floats,
    size: float,
    spots: Floats,
    at: Floats,
    course: Floats,
    rng: NDArray[np.uint64],
) -> int:
    """Change the path in place by one random move and return its new number of points (0: no such move).

    ``at`` and ``course`` are the path's timetable before the move.
    """
    u = uniform(rng)
    step = size * math.exp(-14.0 * uniform(rng))
    inner = n - 2
    if b.room > 0.0 and inner > 0 and uniform(rng) < 0.12:  # turn a corner the long way round, or not
        i = 1 + int(uniform(rng) * inner)
        if uniform(rng) < 0.5:
            return straighten(xs, ys, n, i, 1 + int(2.0 * uniform(rng)))
        return go_round(b, xs, ys, n, i, at, course, int(WAYS * uniform(rng)))
    if b.kind != 0 and inner > 0 and uniform(rng) < 0.15:
        return _lay_again(b, xs, ys, n, h0, step, rng)
    if u < 0.18 and inner > 0:
        return _push_corner(xs, ys, n, step, rng)
    if u < 0.36 and inner > 0:
        return _slide_corner(b, xs, ys, n, step, at, course, rng)
    if u < 0.46 and inner > 1:
        return _shift_block(xs, ys, n, step, rng)
    if u < 0.56:
        return _one_corner(b, xs, ys, n, at, course, rng)
    if u < 0.64 and inner > 0:
        return _leave_out(xs, ys, n, rng)
    if u < 0.70 and n + 1 < MOST_POINTS:
        return _corner_beside(xs, ys, n, step, rng)
    if u < 0.80 and spots.shape[0] > 0:
        return _touch_spot(xs, ys, n, spots, rng)
    if u < 0.88 and n > 1:
        return _move_end(xs, ys, n, goal, step, rng)
    if u < 0.94:
        return _swap_courses(xs, ys, n, rng)
    if n > 2:  # all corners to their times
        fit_corners(b, xs, ys, n, h0, 1 + int(uniform(rng) * inner), True)
        return n
    return 0


@kernel
def shared(xs: Floats, ys: Floats, n: int, ox: Floats, oy: Floats, on: int) -> tuple[int, int]:
    """Return how many points two paths share at their beginning and, apart from those, at their end."""
    head = 0
    while head < n and head < on and xs[head] == ox[head] and ys[head] == oy[head]:
        head += 1
    tail = 0
    while (
        tail < n - head
        and tail < on - head
        and xs[n - 1 - tail] == ox[on - 1 - tail]
        and (ys[n - 1 - tail] == oy[on - 1 - tail])
    ):
        tail += 1
    return head, tail


@kernel
def timetable(b: BoatModel, xs: Floats, ys: Floats, n: int, h0: float, at: Floats, course: Floats) -> None:
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
    b: BoatModel, xs: Floats, ys: Floats, n: int, head: int, tail: int, at: Floats, course: Floats, on: int
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
def collides(g: SegmentGrid, xs: Floats, ys: Floats, n: int, head: int, tail: int) -> bool:
    """Does one of the legs that are not shared collide?"""
    for i in range(max(0, head - 1), min(n - 1, n - tail)):
        if not is_free(g, xs[i], ys[i], xs[i + 1], ys[i + 1]):
            return True
    return False


@kernel
def anneal(
    g: SegmentGrid,
    b: BoatModel,
    points: Floats,
    h0: float,
    goal: Floats,
    size: float,
    spots: Floats,
    rounds: int,
    hot: float,
    cold: float,
    price: float,
    rng: NDArray[np.uint64],
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
