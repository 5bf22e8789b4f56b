"""The kernel of Büsser's A*: a heap, 16 headings, 24 neighbours."""

from __future__ import annotations

import math

import numpy as np

from companion.kernels.heap import pop, push
from companion.kernels.jit import kernel
from companion.planner.reference.kernels import TWD, first_hit, meets_target, turn_time, worst_no_go, wrap

# Places in ``weight``: turning [s/rad], tack [s], gybe [s], tunnel [s per metre off the line], heuristic speed [m/s],
# half the width of an abrupt tunnel [m] (then TUNNEL is what a step beyond it costs [s]; 0: eq. 4.6),
# the greatest turn from step to step [rad].
TURN, TACK_COST, GYBE_COST, TUNNEL, FAST, BORDER, MAX_TURN = range(7)
# Places in ``count``: heap size, states expanded, goal reached (0, 1), states seen.
HEAP, EXPANDED, REACHED, SEEN = range(4)
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
    most, g, clock, parent, closed, heap_f, heap_state, count, frame, shape, start, goal, goal_heading, step, way,
    weight, disc, edge, cell_first, cell_edge, grid, edge_shape, number, model, table, target,
):
    """Expand up to ``most`` states; count[REACHED] tells when the goal state was taken from the heap.

    frame: x0, y0 of node (0, 0), spacing east, spacing north, start heading. shape: columns, rows. start, goal:
    node numbers. step (24, 4): columns, rows, heading number, length [m]. way (16, 3): heading [rad], speed over
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
            if at == goal and state % HEADINGS == goal_heading:
                count[REACHED] = 1
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
            if target.shape[0] > 0 and meets_target(x, y, to_x, to_y, t0, t1, target):
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
