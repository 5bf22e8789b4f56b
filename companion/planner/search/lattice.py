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
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from companion.geo.kernels import meets_discs
from companion.kernels.heap import pop, push
from companion.kernels.jit import kernel
from companion.planner.search.gauge import Aim, Gauge, least_from
from companion.planner.search.kernels import (
    SLACK_RAD,
    BoatModel,
    Floats,
    Ints,
    SegmentGrid,
    is_free,
    speed_at,
    track,
    turn_guess,
    turn_time,
    worst_half,
    wrap,
)
from companion.planner.search.moves import corner
from companion.planner.search.world import SearchWorld

LEAST_SINE = 0.1  # of the angle between a lattice's axes
_CLOCKWISE, _COUNTER, _STEP, _ROUND, _START = 0, 1, 2, 3, 4  # the moves, and what came before all of them


@kernel
def _misses(b: BoatModel, x: float, y: float, h: float, t: float, mx: float, my: float, ex: float, ey: float) -> bool:
    """Do the two legs by way of (mx, my) keep clear of every target?"""
    for leg in range(2):
        qx, qy = (mx, my) if leg == 0 else (ex, ey)
        a, v = track(b, qx - x, qy - y, t)
        t1 = t + turn_guess(b, h, a)
        t2 = t1 + math.hypot(qx - x, qy - y) / max(v, 1e-9)
        if meets_discs(b.targets, x, y, x, y, t, t1) or meets_discs(b.targets, x, y, qx, qy, t1, t2):
            return False
        x, y, h, t = qx, qy, a, t2
    return True


class Lattice(NamedTuple):
    """Where the nodes are: (i, j), of (0, 0) to (ni - 1, nj - 1), lies i - i0 axes a and j - j0 axes b from the start.

    All in metres: ``x``, ``y`` of the start, the axis vectors (``ax``, ``ay``) and (``bx``, ``by``), and the box from
    (``x0``, ``y0``) to (``x1``, ``y1``) that nodes stay in.
    """

    ni: int
    nj: int
    i0: int
    j0: int
    x: float
    y: float
    ax: float
    ay: float
    bx: float
    by: float
    x0: float
    y0: float
    x1: float
    y1: float


class Moves(NamedTuple):
    """What can be done in a node on each course, (nd, 4): turn clockwise or counter-clockwise, sail a step, go round.

    Going round leads from one close-hauled course to the other by a gybe, with a leg to leeward as long as that asks
    for. Of each move: the ``shift`` from a state to the one that it leads to, and ``before``, the course from which it
    leads to this one; lattice steps ``i`` and ``j``, in metres ``dx`` and ``dy``; the TWA ``angle`` [rad] that it turns
    to or sails; and what it ``takes`` [s], for going round the turn to leeward alone (inf: it cannot be done).
    ``twa`` (nd,): of the courses, sorted [rad]; ``length`` (nd,): of a step [m]; ``leg_s`` what the leg to leeward
    takes [s], ``up_s`` (nd,) the turn up to this course behind it [s].
    """

    shift: Ints
    before: Ints
    i: Ints
    j: Ints
    dx: Floats
    dy: Floats
    angle: Floats
    takes: Floats
    twa: Floats
    length: Floats
    leg_s: float
    up_s: Floats


class Wound(NamedTuple):
    """How far the boat has turned [rad, signed]: since its last leg as long as it needs for a gybe round, and here."""

    long: float
    here: float


class End(NamedTuple):
    """An end of the path: arrival [s], place [m], and the corner before it [m] where it is two legs off."""

    t: float
    x: float
    y: float
    via_x: float
    via_y: float
    by_corner: bool


@kernel
def _moves_of(b: BoatModel, on: Lattice, steps: Ints, leeward: Ints) -> Moves:
    """Return the moves of the courses that ``steps`` (nd, 2) lead on, sorted by their TWA, as at the start's time.

    ``leeward``: the leg of going round in lattice steps (0, 0: that is not done).
    """
    nd = steps.shape[0]
    shift, before = np.empty((nd, 4), np.int32), np.empty((nd, 4), np.int32)
    i, j = np.zeros((nd, 4), np.int32), np.zeros((nd, 4), np.int32)
    dx, dy, angle, takes = np.zeros((nd, 4)), np.zeros((nd, 4)), np.empty((nd, 4)), np.empty((nd, 4))
    twa, length, up_s = np.empty(nd), np.empty(nd), np.full(nd, np.inf)
    port, starboard = -1, -1
    for k in range(nd):
        i[k, _STEP], j[k, _STEP] = steps[k, 0], steps[k, 1]
        dx[k, _STEP] = steps[k, 0] * on.ax + steps[k, 1] * on.bx
        dy[k, _STEP] = steps[k, 0] * on.ay + steps[k, 1] * on.by
        twa[k], v = track(b, dx[k, _STEP], dy[k, _STEP], 0.0)
        length[k] = math.hypot(dx[k, _STEP], dy[k, _STEP])
        takes[k, _STEP] = length[k] / v if v > 1e-9 else math.inf
        if twa[k] < 0.0:
            port = k
        elif starboard < 0:
            starboard = k
    deep, leg_s = 0.0, math.inf
    down_x, down_y = leeward[0] * on.ax + leeward[1] * on.bx, leeward[0] * on.ay + leeward[1] * on.by
    if (leeward[0] != 0 or leeward[1] != 0) and port >= 0 and starboard >= 0:
        deep, v = track(b, down_x, down_y, 0.0)
        leg_s = math.hypot(down_x, down_y) / v
    for k in range(nd):
        after, ahead = (k + 1) % nd, (k - 1) % nd
        shift[k, _CLOCKWISE], before[k, _CLOCKWISE], angle[k, _CLOCKWISE] = after - k, ahead, twa[after]
        shift[k, _COUNTER], before[k, _COUNTER], angle[k, _COUNTER] = ahead - k, after, twa[ahead]
        takes[k, _CLOCKWISE], takes[k, _COUNTER] = turn_time(b, twa[k], twa[after]), turn_time(b, twa[ahead], twa[k])
        shift[k, _STEP], before[k, _STEP], angle[k, _STEP] = (steps[k, 0] * on.nj + steps[k, 1]) * nd, k, twa[k]
        other = starboard if k == port else port
        shift[k, _ROUND], before[k, _ROUND] = (leeward[0] * on.nj + leeward[1]) * nd + other - k, other
        angle[k, _ROUND], takes[k, _ROUND] = deep, math.inf
        i[k, _ROUND], j[k, _ROUND], dx[k, _ROUND], dy[k, _ROUND] = leeward[0], leeward[1], down_x, down_y
        if leg_s < math.inf and k in (port, starboard):
            takes[k, _ROUND], up_s[k] = turn_time(b, twa[k], deep), turn_time(b, deep, twa[k])
    return Moves(shift, before, i, j, dx, dy, angle, takes, twa, length, leg_s, up_s)


@kernel
def _place(on: Lattice, i: int, j: int) -> tuple[float, float]:
    """Return where a node is, x and y [m]."""
    return on.x + (i - on.i0) * on.ax + (j - on.j0) * on.bx, on.y + (i - on.i0) * on.ay + (j - on.j0) * on.by


@kernel
def _is_outside(on: Lattice, i: int, j: int, x: float, y: float) -> bool:
    """Is this no node of the lattice, or one outside of its box?"""
    return i < 0 or j < 0 or i >= on.ni or j >= on.nj or x < on.x0 or y < on.y0 or x > on.x1 or y > on.y1


@kernel
def _before(moves: Moves, move: int, s: int) -> int:
    """Return the state from which a move came to state ``s``."""
    return int(s - moves.shift[moves.before[s % moves.twa.shape[0], move], move])


@kernel
def _wound(b: BoatModel, moves: Moves, came: NDArray[np.uint8], s: int, h0: float) -> Wound:
    """Return how far the boat has turned when it is in state ``s``."""
    nd = moves.twa.shape[0]
    wound, here, length, is_here = 0.0, 0.0, 0.0, True
    for _ in range(256):
        move, k = came[s], s % nd
        by = 0.0
        if move == _START:
            by = wrap(moves.twa[k] - h0)
        elif move == _ROUND:
            by = wrap(moves.twa[k] - moves.angle[k, _ROUND])
        elif move == _STEP:
            is_here = False
            length += moves.length[k]
        else:
            length = 0.0
            by = wrap(moves.twa[k] - moves.twa[_before(moves, move, s) % nd])
        wound += by
        here += by if is_here else 0.0
        if move in (_START, _ROUND) or length >= b.room:
            break
        s = _before(moves, move, s)
    return Wound(wound, here)


@kernel
def _is_too_far(b: BoatModel, wound: Wound, by: float) -> bool:
    """Has the boat turned too far when it turns on by ``by`` [rad]?

    What it turns in one place is one turn of the path, which goes the shorter way: beyond half a circle, by a tack.
    """
    return abs(wound.long + by) > b.most_turn or (not b.can_tack and abs(wound.here + by) > b.most_turn)


@kernel
def nearest_of(aim: Aim, x: float, y: float) -> tuple[float, float, float]:
    """Return x, y of the goal disc's nearest point to a place outside of it, and the way there [m]."""
    gx, gy = aim.x - x, aim.y - y
    d = math.hypot(gx, gy)
    f = (d - 0.999999 * aim.radius) / d
    return x + gx * f, y + gy * f, d * f


@kernel
def by_corner(
    g: SegmentGrid, b: BoatModel, aim: Aim, x: float, y: float, h: float, t: float, bound: float, heeds: bool
) -> End:
    """Return the end by two edge courses from a place where the boat is at time t with TWA h; at inf: none.

    It arrives before ``bound`` [s], and clear of moving targets where it ``heeds`` them.
    """
    ex, ey, _ = nearest_of(aim, x, y)
    end = End(math.inf, ex, ey, 0.0, 0.0, True)
    first = 0 if aim.y - y > 0.0 else 2
    for way in range(2):
        mx, my, t2, ok = corner(b, x, y, h, t, ex, ey, first + way, first + 1 - way)
        if (
            ok
            and t2 < min(bound, end.t)
            and is_free(g, x, y, mx, my)
            and is_free(g, mx, my, ex, ey)
            and (not heeds or b.targets.shape[0] == 0 or _misses(b, x, y, h, t, mx, my, ex, ey))
        ):
            end = End(t2, ex, ey, mx, my, True)
    return end


@kernel
def _end_from(
    g: SegmentGrid, b: BoatModel, aim: Aim, x: float, y: float, h: float, t: float, wound: Wound, bound: float
) -> End:
    """Return the exact end, by the straight leg or, where that is no course, by two; at inf: none before ``bound``."""
    ex, ey, length = nearest_of(aim, x, y)
    a, v = track(b, aim.x - x, aim.y - y, t)
    if v > 1e-9 and abs(a) <= b.max_twa + SLACK_RAD:
        t1 = t + turn_time(b, h, a)
        t2 = t1 + length / v
        if abs(a) >= worst_half(b, t1, t2):
            is_open = (
                t2 < bound
                and (b.room == 0.0 or not _is_too_far(b, wound, wrap(a - h)))
                and is_free(g, x, y, ex, ey)
                and not (meets_discs(b.targets, x, y, x, y, t, t1) or meets_discs(b.targets, x, y, ex, ey, t1, t2))
            )
            return End(t2 if is_open else math.inf, ex, ey, 0.0, 0.0, False)
    if b.can_tack:
        return by_corner(g, b, aim, x, y, h, t, bound, True)
    return End(math.inf, ex, ey, 0.0, 0.0, False)


@kernel
def _way_back(on: Lattice, moves: Moves, came: NDArray[np.uint8], s: int, end: End) -> Floats:
    """Return the points (n, 2) from the start by way of state ``s`` to the end, only those where the course changes."""
    nd = moves.twa.shape[0]
    count, last = 1, -1
    path = np.empty((4096, 2))
    path[0, 0], path[0, 1] = end.x, end.y
    if end.by_corner:
        path[1, 0], path[1, 1] = end.via_x, end.via_y
        count = 2
    while True:
        node, k, move = s // nd, s % nd, came[s]
        if (move != _STEP or last != k) and count < 4095:
            x, y = _place(on, node // on.nj, node % on.nj)
            if abs(x - path[count - 1, 0]) + abs(y - path[count - 1, 1]) > 1e-9:
                path[count, 0], path[count, 1] = x, y
                count += 1
        if move == _START:
            return path[:count][::-1].copy()
        if move == _STEP:
            last = k
        elif move == _ROUND:
            last = -1
        s = _before(moves, move, s)


@kernel
def lattice_search(
    g: SegmentGrid,
    b: BoatModel,
    on: Lattice,
    steps: Ints,
    leeward: Ints,
    h0: float,
    t0: float,
    aim: Aim,
    bound: float,
    max_pops: int,
    shot_m: float,
    side: int,
) -> tuple[float, Floats, int]:
    """Search from TWA ``h0`` [rad] at ``t0`` [s]; return (arrival time, points (n, 2), states expanded).

    ``steps`` and ``leeward`` as ``_moves_of``. Only paths below ``bound`` [s] are looked for; the exact end is tried
    from within ``shot_m`` [m] of the goal and now and then from afar; ``side`` 1 or -1 starts on courses with that sign
    of TWA only. Exhausted without a path: there is none on this lattice within the bound.
    """
    moves = _moves_of(b, on, steps, leeward)
    nj, nd, twa = on.nj, moves.twa.shape[0], moves.twa
    shift, di, dj, dx, dy, angle, takes = moves.shift, moves.i, moves.j, moves.dx, moves.dy, moves.angle, moves.takes
    n_states = on.ni * nj * nd
    cost = np.full(n_states, np.inf, np.float32)
    came = np.zeros(n_states, np.uint8)
    done = np.zeros(n_states, np.uint8)
    to_go = np.full(on.ni * nj, -1.0, np.float32)  # the least time from each node [s], -1 while not known
    keys, items, size = np.empty(1 << 15), np.empty(1 << 15, np.int32), 0
    for k in range(nd):
        s = (on.i0 * nj + on.j0) * nd + k
        if side * twa[k] >= 0.0:
            cost[s] = t0 + turn_time(b, h0, twa[k])
            came[s] = _START
            if cost[s] < np.inf:
                keys, items, size = push(keys, items, size, cost[s], s)
    is_watched, n_moves = b.targets.shape[0] > 0, 4 if moves.leg_s < math.inf else 3
    end, last, pops, wound = End(bound, 0.0, 0.0, 0.0, 0.0, False), -1, 0, Wound(0.0, 0.0)
    while size > 0 and keys[0] < end.t:
        s = items[0]
        size = pop(keys, items, size)
        if done[s]:
            continue
        done[s] = 1
        pops += 1
        if pops > max_pops:
            break
        node, k = s // nd, s % nd
        i, j = node // nj, node % nj
        x, y = _place(on, i, j)
        t = float(cost[s])
        if b.room > 0.0:
            wound = _wound(b, moves, came, s, h0)
        d = math.hypot(aim.x - x, aim.y - y)
        if d <= shot_m or pops % 64 == 1:
            if d <= aim.radius:
                if t < end.t:
                    end, last = End(t + 0.0, x, y, 0.0, 0.0, False), s
                continue
            shot = _end_from(g, b, aim, x, y, twa[k], t, wound, end.t)
            if shot.t < end.t:
                end, last = shot, s
        for move in range(n_moves):
            s1 = s + shift[k, move]
            t1 = t + takes[k, move]
            x1, y1 = x, y
            if move >= _STEP:
                x1, y1 = x + dx[k, move], y + dy[k, move]
                if not t1 < math.inf or _is_outside(on, i + di[k, move], j + dj[k, move], x1, y1):
                    continue
            if move == _ROUND:
                t1 = t1 + moves.leg_s + moves.up_s[s1 % nd]
            if done[s1] or t1 >= cost[s1]:
                continue
            turns = move == _ROUND or (move < _STEP and came[s] != _START)
            if b.room > 0.0 and turns and _is_too_far(b, wound, wrap(angle[k, move] - twa[k])):
                continue
            node1 = s1 // nd
            if to_go[node1] < 0.0:
                to_go[node1] = least_from(aim, x1, y1)
            f1 = t1 + to_go[node1]
            if f1 >= end.t:
                continue
            if move < _STEP:
                is_closed = is_watched and (came[s] == 1 - move or meets_discs(b.targets, x, y, x, y, t, t1))
            else:
                is_closed = (
                    abs(angle[k, move]) < worst_half(b, t, t1) - 0.5 * SLACK_RAD
                    or not is_free(g, x, y, x1, y1)
                    or (is_watched and meets_discs(b.targets, x, y, x1, y1, t, t1))
                )
            if is_closed:
                continue
            cost[s1] = t1
            came[s1] = move
            keys, items, size = push(keys, items, size, f1, s1)
    if last < 0:
        return math.inf, np.empty((0, 2)), pops
    return end.t, _way_back(on, moves, came, last, end), pops


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
    (ax, ay), (bx, by) = axes.tolist()
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
        Lattice(ni, nj, -int(low[0]), -int(low[1]), origin[0], origin[1], ax, ay, bx, by, *box),
        np.array([(i, j) for _, i, j in steps], np.int32),
        np.array(_leeward(b, axes), np.int32),
        *origin[2:],
        gauge.aim(*goal),
        bound_s,
        max_pops,
        6.0 * max(sizes),
        side,
    )
    found = math.isfinite(cost) and len(points) > 0
    return LatticeResult(cost_s=float(cost) if found else math.inf, points=points if found else None, pops=int(pops))
