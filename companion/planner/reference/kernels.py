"""Kernels of the reference algorithms: speed, no-go zone, collision, turns and steering (Algorithm 1).

The wind, boat and world come as ``world.ReferenceWorld`` (unpacked by its fields' order in ``number``).
"""

from __future__ import annotations

import math

import numpy as np

from companion.geo.kernels import meets_discs, wrap
from companion.kernels.heap import pop, push
from companion.kernels.jit import kernel
from companion.planner.problem.parts import CLEAR_TURN_RAD
from companion.planner.problem.sigma import TABLE, sigma_of

TWO_PI = 2.0 * math.pi
EDGE_PAD = 1e-6  # of a heading laid on the edge of the no-go zone [rad]: below the judge's slack
ZONE_PAD = math.radians(0.3)  # of a course laid on the edge of the autopilot's zone: the table's step is 0.25 degrees
STEER_ROUNDS = 6  # of the fixed point between a leg's heading and its end's no-go zone
# ``number``'s places
TWD, HALF, DEEP, RATE, TACK, GYBE, W0, W1, RHO, CX, CY, ZONE, ZONE_HALF = range(13)


@kernel
def polar_speed(twa, polar):  # type: ignore[no-untyped-def]
    """Return the speed [m/s] at |TWA|, linear between nodes, flat beyond them."""
    a = abs(twa)
    n = polar.shape[1]
    if a <= polar[0, 0]:
        return polar[1, 0]
    if a >= polar[0, n - 1]:
        return polar[1, n - 1]
    lo, hi = 0, n - 1
    while hi - lo > 1:
        mid = (lo + hi) // 2
        if polar[0, mid] <= a:
            lo = mid
        else:
            hi = mid
    f = (a - polar[0, lo]) / (polar[0, hi] - polar[0, lo])
    return polar[1, lo] + f * (polar[1, hi] - polar[1, lo])


@kernel
def no_go(t, number, model, table):  # type: ignore[no-untyped-def]
    """Return the tightened no-go half angle at t (eq. 15, widening)."""
    if model == TABLE:
        return number[HALF] + np.interp(t, table[0], table[1])
    return number[HALF] + sigma_of(t, model, number[W0], number[W1], number[RHO])


@kernel
def worst_no_go(t0, t1, number, model, table):  # type: ignore[no-untyped-def]
    """Return the largest half angle over [t0, t1]."""
    worst = max(no_go(t0, number, model, table), no_go(t1, number, model, table))
    if model == TABLE:
        for i in range(table.shape[1]):
            if t0 < table[0, i] < t1:
                worst = max(worst, number[HALF] + table[1, i])
    return worst


@kernel
def _first_on(edge, i, ax, ay, dx, dy):  # type: ignore[no-untyped-def]
    """Return where along a + s d, s in [0, 1], edge i is first met; 2 when it is not."""
    px, py = edge[i, 0], edge[i, 1]
    ex, ey = edge[i, 2] - px, edge[i, 3] - py
    den = dx * ey - dy * ex
    wx, wy = px - ax, py - ay
    if abs(den) > 1e-14 * (abs(dx) + abs(dy)) * (abs(ex) + abs(ey)):
        s = (wx * ey - wy * ex) / den
        u = (wx * dy - wy * dx) / den
        if 0.0 <= s <= 1.0 and -1e-12 <= u <= 1.0 + 1e-12:
            return s
        return 2.0
    if abs(wx * dy - wy * dx) > 1e-9 * math.hypot(dx, dy):
        return 2.0
    length2 = dx * dx + dy * dy
    if length2 <= 0.0:
        return 2.0
    s0 = (wx * dx + wy * dy) / length2
    s1 = ((wx + ex) * dx + (wy + ey) * dy) / length2
    low, high = min(s0, s1), max(s0, s1)
    return max(0.0, low) if high >= 0.0 and low <= 1.0 else 2.0


@kernel
def first_hit(ax, ay, bx, by, edge, cell_first, cell_edge, grid, shape):  # type: ignore[no-untyped-def]
    """Return where along a..b, on [0, 1], the segment first meets an edge; 2 when it is free."""
    if edge.shape[0] == 0:
        return 2.0
    x0, y0, size = grid[0], grid[1], grid[2]
    nx, ny = shape[0], shape[1]
    dx, dy = bx - ax, by - ay
    best = 2.0
    low_y, high_y = min(ay, by), max(ay, by)
    first_row = max(0, math.floor((low_y - y0) / size - 1e-9))
    last_row = min(ny - 1, math.floor((high_y - y0) / size + 1e-9))
    for row in range(first_row, last_row + 1):
        lo, hi = max(low_y, y0 + row * size), min(high_y, y0 + (row + 1) * size)
        if dy != 0.0 and hi > lo:
            xa, xb = ax + dx * (lo - ay) / dy, ax + dx * (hi - ay) / dy
        else:
            xa, xb = ax, bx
        first = max(0, math.floor((min(xa, xb) - x0) / size - 1e-6))
        last = min(nx - 1, math.floor((max(xa, xb) - x0) / size + 1e-6))
        for column in range(first, last + 1):
            cell = row * nx + column
            for k in range(cell_first[cell], cell_first[cell + 1]):
                best = min(best, _first_on(edge, cell_edge[k], ax, ay, dx, dy))
    return best


@kernel
def way_on(course, number, polar, table_course):  # type: ignore[no-untyped-def]
    """Return heading and speed over ground along a course; speed 0 when the boat cannot."""
    n = table_course.shape[1]
    if n == 0:
        return course, polar_speed(wrap(course - number[TWD]), polar)
    f = (wrap(course) + math.pi) / TWO_PI * (n - 1)
    i = min(n - 2, int(f))
    f -= i
    if table_course[2, i] < 0.5 or table_course[2, i + 1] < 0.5:
        return course, 0.0
    h = table_course[0, i] + f * wrap(table_course[0, i + 1] - table_course[0, i])
    return wrap(h), (1.0 - f) * table_course[1, i] + f * table_course[1, i + 1]


@kernel
def turn_time(before, after, number):  # type: ignore[no-untyped-def]
    """Return the time [s] of a change of heading, a tack's or gybe's loss included; inf for a tack it cannot do."""
    spent = abs(wrap(after - before)) / number[RATE]
    a, b = wrap(before - number[TWD]), wrap(after - number[TWD])
    if a * b < 0.0:
        through_eye = abs(a) + abs(b)
        if number[TACK] == np.inf:
            return np.inf if through_eye < math.pi + CLEAR_TURN_RAD else spent + number[GYBE]
        spent += number[TACK] if through_eye < math.pi else number[GYBE]
    return spent


@kernel
def straight(  # type: ignore[no-untyped-def]
    x, y, heading, t, tx, ty, number, model, table, polar, course
):
    """Return (ok, heading, start of the leg [s], end [s]) of the straight leg to (tx, ty); no collision test."""
    dx, dy = tx - x, ty - y
    dist = math.hypot(dx, dy)
    if dist < 1e-9:
        return False, heading, t, t
    h, v = way_on(math.atan2(dx, dy), number, polar, course)
    if v <= 1e-9:
        return False, h, t, t
    t0 = t + turn_time(heading, h, number)
    if t0 == np.inf:
        return False, h, t, t
    t1 = t0 + dist / v
    twa = abs(wrap(h - number[TWD]))
    if twa > number[DEEP] + 1e-9 or twa < worst_no_go(t0, t1, number, model, table):
        return False, h, t0, t1
    return True, h, t0, t1


@kernel
def steer(  # type: ignore[no-untyped-def]
    x, y, heading, t, tx, ty, reach, number, model, table, polar, course
):
    """Algorithm 1: (ok, x, y) where the boat gets from (x, y) on its way to (tx, ty), ``reach`` metres at most.

    Lines 4-5: straight there where the no-go zone allows it. Lines 6-16: else along the edge of the zone whose
    heading has the larger cosine to the target, if it is positive. Lines 17-19: propagated while the distance
    decreases, that is to the foot of the perpendicular. The zone is taken at its widest over the leg, not at its
    start as in the paper: constraint 13 holds at every instant. The deepest angle is treated like an edge, and so are
    the edges of the zone that the autopilot does not follow (``parts.Zone``), over the ground.
    """
    dx, dy = tx - x, ty - y
    dist = math.hypot(dx, dy)
    if dist < 1e-9:
        return False, x, y
    bearing = math.atan2(dx, dy)
    share = min(1.0, reach / dist)
    ok, _, _, _ = straight(x, y, heading, t, x + share * dx, y + share * dy, number, model, table, polar, course)
    if ok:
        return True, x + share * dx, y + share * dy
    twa = wrap(bearing - number[TWD])
    best, best_x, best_y = 0.0, x, y
    for side in range(6 if number[ZONE_HALF] > 0.0 else 4):
        sign = 1.0 if side % 2 == 0 else -1.0
        if side >= 4:
            edge = number[ZONE] + sign * (number[ZONE_HALF] + ZONE_PAD)
            gamma = (dx * math.sin(edge) + dy * math.cos(edge)) / dist
            length = min(reach, gamma * dist)
            if gamma > best + 1e-12:
                ex, ey = x + length * math.sin(edge), y + length * math.cos(edge)
                ok, _, _, _ = straight(x, y, heading, t, ex, ey, number, model, table, polar, course)
                if ok:
                    best, best_x, best_y = gamma, ex, ey
            continue
        if side >= 2 and (number[DEEP] >= math.pi - 1e-9 or abs(twa) < 0.5 * math.pi):
            continue
        half = no_go(t, number, model, table)
        length, cx, cy = 0.0, 0.0, 0.0
        settled = False
        for _ in range(STEER_ROUNDS):
            angle = half + EDGE_PAD if side < 2 else number[DEEP]
            if angle >= math.pi or angle > number[DEEP] + 1e-12:
                break
            u = number[TWD] + sign * angle
            v = polar_speed(angle, polar)
            gx, gy = v * math.sin(u) + number[CX], v * math.cos(u) + number[CY]
            speed = math.hypot(gx, gy)
            if speed <= 1e-9:
                break
            cx, cy = gx / speed, gy / speed
            if abs(wrap(math.atan2(cx, cy) - number[ZONE])) < number[ZONE_HALF]:
                break
            length = min(reach, dx * cx + dy * cy)
            if length <= 1e-9:
                break
            t0 = t + turn_time(heading, u, number)
            need = worst_no_go(t0, t0 + length / speed, number, model, table)
            if need <= angle:
                settled = True
                break
            half = need
        if settled:
            gamma = (dx * cx + dy * cy) / dist
            if gamma > best + 1e-12:
                best, best_x, best_y = gamma, x + length * cx, y + length * cy
    return best > 0.0, best_x, best_y


# ------------------------------------------------------------------------------------------- RRT*


# The kernel of Büsser's A*: a heap, 16 headings, 24 neighbours.

# Places in ``weight``: turning [s/rad], tack [s], gybe [s], tunnel [s per metre off the line], heuristic speed [m/s],
# half the width of a tunnel with borders [m] (then TUNNEL is what a step beyond it costs [s]; 0: eq. 4.6),
# the greatest turn from step to step [rad], the power by which the cost rises to a border (0: not at all inside).
TURN, TACK_COST, GYBE_COST, TUNNEL, FAST, BORDER, MAX_TURN, RISE = range(8)
# Places in ``count``: heap size, states expanded, goal reached (0, 1), states seen, the goal state that was reached.
HEAP, EXPANDED, REACHED, SEEN, LAST = range(5)
HEADINGS = 16


@kernel
def _in_disc(ax, ay, bx, by, disc):  # type: ignore[no-untyped-def]
    """Tell whether a segment enters one of the discs (x, y, radius)."""
    dx, dy = bx - ax, by - ay
    length2 = dx * dx + dy * dy
    for i in range(disc.shape[0]):
        s = 0.0
        if length2 > 0.0:
            s = min(1.0, max(0.0, ((disc[i, 0] - ax) * dx + (disc[i, 1] - ay) * dy) / length2))
        if (ax + s * dx - disc[i, 0]) ** 2 + (ay + s * dy - disc[i, 1]) ** 2 < disc[i, 2] ** 2:
            return True
    return False


@kernel
def expand(  # type: ignore[no-untyped-def]
    most,
    g,
    clock,
    parent,
    closed,
    heap_f,
    heap_state,
    count,
    frame,
    shape,
    start,
    goal,
    goal_heading,
    step,
    way,
    weight,
    disc,
    edge,
    cell_first,
    cell_edge,
    grid,
    edge_shape,
    number,
    model,
    table,
    target,
):
    """Expand up to ``most`` states; count[REACHED] tells when the goal state was taken from the heap.

    frame: x0, y0 of node (0, 0), spacing east, spacing north, start heading. shape: columns, rows. start, goal:
    node numbers; goal_heading -1: any.
    step (24, 4): columns, rows, heading number, length [m]. way (16, 3): heading [rad], speed over
    ground [m/s] (0: not sailable), |TWA| [rad]. A state is node x 16 + heading; the start's own heading has the
    extra state columns x rows x 16. Returns the states expanded.
    """
    columns, rows = shape[0], shape[1]
    first_state = columns * rows * HEADINGS
    goal_x = frame[0] + (goal % columns) * frame[2]
    goal_y = frame[1] + (goal // columns) * frame[3]
    start_x = frame[0] + (start % columns) * frame[2]
    start_y = frame[1] + (start // columns) * frame[3]
    line_x, line_y = goal_x - start_x, goal_y - start_y
    line = max(1e-9, math.hypot(line_x, line_y))
    done = 0
    while count[HEAP] > 0 and done < most:
        state = heap_state[0]
        count[HEAP] = pop(heap_f, heap_state, count[HEAP])
        if closed[state]:
            continue
        closed[state] = True
        done += 1
        count[EXPANDED] += 1
        if state == first_state:
            at, before = start, frame[4]
        else:
            at, before = state // HEADINGS, way[state % HEADINGS, 0]
            if at == goal and (goal_heading < 0 or state % HEADINGS == goal_heading):
                count[REACHED], count[LAST] = 1, state
                return done
        column, row = at % columns, at // columns
        x, y = frame[0] + column * frame[2], frame[1] + row * frame[3]
        for m in range(step.shape[0]):
            k = int(step[m, 2])
            speed = way[k, 1]
            if speed <= 0.0:
                continue
            to_column, to_row = column + int(step[m, 0]), row + int(step[m, 1])
            if to_column < 0 or to_row < 0 or to_column >= columns or to_row >= rows:
                continue
            heading = way[k, 0]
            turn = abs(wrap(heading - before))
            # The first turn is free of the limit: a boat that lies the wrong way must get away somehow.
            if turn > weight[MAX_TURN] + 1e-9 and state != first_state:
                continue
            to = to_row * columns + to_column
            next_state = to * HEADINGS + k
            if closed[next_state]:
                continue
            seconds = step[m, 3] / speed
            cost = g[state] + seconds + weight[TURN] * turn
            a, b = wrap(before - number[TWD]), wrap(heading - number[TWD])
            if a * b < 0.0:  # eq. 4.5
                cost += weight[TACK_COST] if abs(a + wrap(heading - before) - b) < 1e-6 else weight[GYBE_COST]
            to_x, to_y = frame[0] + to_column * frame[2], frame[1] + to_row * frame[3]
            if weight[TUNNEL] > 0.0:
                off = abs((to_x - start_x) * line_y - (to_y - start_y) * line_x) / line
                if weight[BORDER] <= 0.0:
                    cost += weight[TUNNEL] * off  # eq. 4.6
                elif off > weight[BORDER]:
                    cost += weight[TUNNEL]
                elif weight[RISE] > 0.0:
                    cost += weight[TUNNEL] * (off / weight[BORDER]) ** weight[RISE]  # 2.V.F.5
            if cost >= g[next_state]:
                continue
            t0 = clock[state] + (turn_time(before, heading, number) if turn > 1e-9 else 0.0)
            t1 = t0 + seconds
            if t1 == np.inf:
                continue
            if way[k, 2] < worst_no_go(t0, t1, number, model, table):
                continue
            if first_hit(x, y, to_x, to_y, edge, cell_first, cell_edge, grid, edge_shape) <= 1.0:
                continue
            if disc.shape[0] > 0 and _in_disc(x, y, to_x, to_y, disc):
                continue
            if target.shape[0] > 0 and meets_discs(target, x, y, to_x, to_y, t0, t1):
                continue
            if g[next_state] == np.inf:
                count[SEEN] += 1
            g[next_state], clock[next_state], parent[next_state] = cost, t1, state
            if count[HEAP] >= heap_f.shape[0]:
                count[REACHED] = -1
                return done
            ahead = math.hypot(goal_x - to_x, goal_y - to_y) / weight[FAST] if weight[FAST] > 0.0 else 0.0
            _, _, count[HEAP] = push(heap_f, heap_state, count[HEAP], cost + ahead, next_state)
    return done
