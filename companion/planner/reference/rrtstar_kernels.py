"""Kernels of the reference RRT*: its tree and one iteration after the other."""

from __future__ import annotations

import math

import numpy as np

from companion.geo.kernels import meets_discs, wrap
from companion.kernels.jit import kernel
from companion.kernels.xorshift import uniform
from companion.planner.reference.kernels import HALF, TWD, TWO_PI, first_hit, steer, straight
from companion.planner.risk.kernels import below, inside, leg_risk, piece, sigma_at, spread_at

# Kernels of the reference RRT*: what uncertain vessels make of one edge of its tree.

# Columns of ``vessel``, a row for each window of a prediction, those of one vessel together and in order of time:
# whose, window, mean at t = 0 and its velocity, distance to keep, the axis along (sine, cosine), standard deviations
# along and across and their growth, growth of our own, and what the vessel is given of the promise at an instant.
WHOSE, FROM, UNTIL, VX0, VY0, VVX, VVY, KEEP, SINE, COSINE, ALONG, ALONG_G, ACROSS, ACROSS_G, OWN, PART = range(16)
VESSEL_COLUMNS = 16


@kernel
def _errors(row, course, out):  # type: ignore[no-untyped-def]
    """Fill out (3, 4) with the three errors: the vessel's along and across, ours along our course."""
    out[0, 0], out[0, 1], out[0, 2], out[0, 3] = row[SINE], row[COSINE], row[ALONG], row[ALONG_G]
    out[1, 0], out[1, 1], out[1, 2], out[1, 3] = row[COSINE], -row[SINE], row[ACROSS], row[ACROSS_G]
    out[2, 0], out[2, 1], out[2, 2], out[2, 3] = math.sin(course), math.cos(course), 0.0, row[OWN]


@kernel
def passing(  # type: ignore[no-untyped-def]
    ax, ay, bx, by, t, t0, t1, before_course, has_before, is_summed, vessel, disc
):
    """Return (ok, expected entries) of the edge from a to b: a turn on the spot from t to t0, then the leg to t1.

    Not ok: at some instant a vessel is nearer than its distance with a greater chance than its part. ``before_course``
    is that of the leg that led to a, if there was one. ``disc`` (n, 8, as targets) are regions outside which no
    vessel's part is reached: without a sum of entries (``is_summed``) an edge clear of them all is not looked at.
    The pieces are those that the judge of whole paths takes (``companion.planner.risk.chance_constraint``).
    """
    if not is_summed and not meets_discs(disc, ax, ay, ax, ay, t, t0) and not meets_discs(disc, ax, ay, bx, by, t0, t1):
        return True, 0.0
    course, span = math.atan2(bx - ax, by - ay), t1 - t0
    out, spread, errors = np.empty(3), np.empty(9), np.empty((3, 4))
    total, whose, before = 0.0, -1.0, -1.0
    first = 0
    n = vessel.shape[0]
    while first < n:
        whose, last = vessel[first, WHOSE], first
        while last < n and vessel[last, WHOSE] == whose:
            last += 1
        before = -1.0
        if has_before:
            for k in range(first, last):
                if vessel[k, FROM] < t <= vessel[k, UNTIL]:
                    _errors(vessel[k], before_course, errors)
                    spread_at(t, errors, spread)
                    before = inside(
                        ax - vessel[k, VX0] - vessel[k, VVX] * t,
                        ay - vessel[k, VY0] - vessel[k, VVY] * t,
                        spread,
                        vessel[k, KEEP],
                    )
        for phase in range(2):
            begin, end, ux, uy = t, t0, 0.0, 0.0
            if phase == 1:
                begin, end = t0, t1
                if span > 1e-9:
                    ux, uy = (bx - ax) / span, (by - ay) / span
            for k in range(first, last):
                lo, hi = max(begin, vessel[k, FROM]), min(end, vessel[k, UNTIL])
                if hi <= lo:
                    continue
                _errors(vessel[k], course, errors)
                piece(
                    lo,
                    hi,
                    ax + ux * (lo - begin) - vessel[k, VX0] - vessel[k, VVX] * lo,
                    ay + uy * (lo - begin) - vessel[k, VY0] - vessel[k, VVY] * lo,
                    ux - vessel[k, VVX],
                    uy - vessel[k, VVY],
                    errors,
                    vessel[k, KEEP],
                    before,
                    out,
                )
                if out[2] > vessel[k, PART]:
                    return False, total
                total += out[0]
                before = out[1]
        first = last
    return True, total


# Columns of ``node``: place, heading of arrival, time, accumulated risk, cost, the greatest risk of a state so far,
# course of arrival over the ground.
X, Y, H, T, R, C, M, G = range(8)
COLUMNS = 8
# Places in ``risk_number``: a limit is set, the wind process (model, s0, s1, rho, tau), that limit, weight of the
# accumulated risk [s], of the greatest risk of a state [s], whether states are rewired.
LIMITED, MODEL, S0, S1, RHO, TAU, LIMIT, WEIGHT, STATE_WEIGHT, REWIRES = range(10)
# Columns of ``link``: parent, first child, next and previous sibling; -1 for none.
PARENT, CHILD, NEXT, BEFORE = range(4)
# Places in ``count``: nodes, goal nodes, best goal node, samples drawn, connections refused, rewirings.
N, GOALS, BEST, DRAWN, REFUSED, REWIRED = range(6)


@kernel
def _unlink(link, i):  # type: ignore[no-untyped-def]
    parent, after, before = link[i, PARENT], link[i, NEXT], link[i, BEFORE]
    if before >= 0:
        link[before, NEXT] = after
    else:
        link[parent, CHILD] = after
    if after >= 0:
        link[after, BEFORE] = before


@kernel
def _hang(link, i, parent):  # type: ignore[no-untyped-def]
    first = link[parent, CHILD]
    link[i, PARENT], link[i, NEXT], link[i, BEFORE] = parent, first, -1
    if first >= 0:
        link[first, BEFORE] = i
    link[parent, CHILD] = i


@kernel
def _state_risk(twa, t, number, risk_number, risk_table):  # type: ignore[no-untyped-def]
    """Return the chance that the wind at time t has this heading in the boat's own no-go zone."""
    margin = abs(twa) - number[HALF]
    sigma = sigma_at(
        t, int(risk_number[MODEL]), risk_number[S0], risk_number[S1], risk_number[RHO], risk_table[0], risk_table[1]
    )
    if sigma <= 1e-12:
        return 0.0 if margin >= -1e-9 else 1.0
    return below(-margin / sigma)


@kernel
def _cost(t, risk, most, risk_number):  # type: ignore[no-untyped-def]
    return t + risk_number[WEIGHT] * risk + risk_number[STATE_WEIGHT] * most


@kernel
def _reach(  # type: ignore[no-untyped-def]
    node,
    i,
    tx,
    ty,
    before_twa,
    before_t,
    most_cost,
    number,
    model,
    table,
    polar,
    course,
    target,
    risk_number,
    risk_table,
    vessel,
    disc,
):
    """Return (ok, heading, time, risk, greatest risk of a state) at (tx, ty) sailed straight from node i.

    No test against the solids. What costs more than ``most_cost`` is of no use, and not held against the vessels. The
    risk of a leg's states is that at its ends: in between the spread is in between.
    """
    ok, h, t0, t1 = straight(
        node[i, X], node[i, Y], node[i, H], node[i, T], tx, ty, number, model, table, polar, course
    )
    if not ok or (target.shape[0] > 0 and meets_discs(target, node[i, X], node[i, Y], tx, ty, t0, t1)):
        return False, h, t1, 0.0, 0.0
    risk, most = node[i, R], node[i, M]
    twa = wrap(h - number[TWD])
    if risk_number[LIMITED] > 0.5:
        risk += leg_risk(
            t0,
            t1,
            twa,
            before_twa,
            before_t,
            number[HALF],
            int(risk_number[MODEL]),
            risk_number[S0],
            risk_number[S1],
            risk_number[RHO],
            risk_number[TAU],
            risk_table[0],
            risk_table[1],
        )
        if risk > risk_number[LIMIT]:
            return False, h, t1, risk, most
    if risk_number[STATE_WEIGHT] > 0.0:
        most = max(
            most,
            _state_risk(twa, t0, number, risk_number, risk_table),
            _state_risk(twa, t1, number, risk_number, risk_table),
        )
    if vessel.shape[0] > 0:
        if _cost(t1, risk, most, risk_number) > most_cost:
            return False, h, t1, risk, most
        is_summed = risk_number[LIMITED] > 0.5
        ok, entries = passing(
            node[i, X], node[i, Y], tx, ty, node[i, T], t0, t1, node[i, G], before_t >= 0.0, is_summed, vessel, disc
        )
        if not ok:
            return False, h, t1, risk, most
        if is_summed:
            risk += entries
            if risk > risk_number[LIMIT]:
                return False, h, t1, risk, most
    return True, h, t1, risk, most


@kernel
def _twa_before(node, link, i, number):  # type: ignore[no-untyped-def]
    """Return the angle that node i was reached at and when; time -1 at the root, where no leg came before."""
    if link[i, PARENT] < 0:
        return 0.0, -1.0
    return wrap(node[i, H] - number[TWD]), node[i, T]


@kernel
def _adopt(  # type: ignore[no-untyped-def]
    node,
    link,
    new,
    j,
    h,
    t,
    risk,
    most,
    stack,
    fresh,
    number,
    model,
    table,
    polar,
    course,
    target,
    risk_number,
    risk_table,
    vessel,
    disc,
):
    """Give node j the parent ``new`` if it and everything below it stays feasible and no cost rises."""
    top, n = 0, 0
    stack[0] = j
    fresh[0, H], fresh[0, T], fresh[0, R], fresh[0, M] = h, t, risk, most
    fresh[0, G] = math.atan2(node[j, X] - node[new, X], node[j, Y] - node[new, Y])
    fresh[0, C] = _cost(t, risk, most, risk_number)
    # A breadth-first copy of the subtree; fresh[k] belongs to stack[k].
    n = 1
    while top < n:
        i = stack[top]
        if fresh[top, C] > node[i, C] + 1e-9:
            return False
        child = link[i, CHILD]
        while child >= 0:
            if n >= stack.shape[0]:
                return False
            fresh[n, X], fresh[n, Y] = node[i, X], node[i, Y]
            fresh[n, H], fresh[n, T], fresh[n, R] = fresh[top, H], fresh[top, T], fresh[top, R]
            fresh[n, M], fresh[n, G] = fresh[top, M], fresh[top, G]
            ok, ch, ct, cr, cm = _reach(
                fresh,
                n,
                node[child, X],
                node[child, Y],
                wrap(fresh[top, H] - number[TWD]),
                fresh[top, T],
                node[child, C] + 1e-9,
                number,
                model,
                table,
                polar,
                course,
                target,
                risk_number,
                risk_table,
                vessel,
                disc,
            )
            if not ok:
                return False
            fresh[n, H], fresh[n, T], fresh[n, R], fresh[n, M] = ch, ct, cr, cm
            fresh[n, G] = math.atan2(node[child, X] - node[i, X], node[child, Y] - node[i, Y])
            fresh[n, C] = _cost(ct, cr, cm, risk_number)
            stack[n] = child
            n += 1
            child = link[child, NEXT]
        top += 1
    _unlink(link, j)
    _hang(link, j, new)
    for k in range(n):
        i = stack[k]
        node[i, H], node[i, T], node[i, R], node[i, C] = fresh[k, H], fresh[k, T], fresh[k, R], fresh[k, C]
        node[i, M], node[i, G] = fresh[k, M], fresh[k, G]
    return True


@kernel
def grow(  # type: ignore[no-untyped-def]
    samples,
    node,
    link,
    goal_node,
    count,
    random,
    box,
    goal,
    reach,
    goal_bias,
    near,
    near_d,
    stack,
    fresh,
    edge,
    cell_first,
    cell_edge,
    grid,
    shape,
    number,
    model,
    table,
    polar,
    course,
    target,
    risk_number,
    risk_table,
    vessel,
    disc,
):
    """Draw ``samples`` states and let the tree grow by RRT* (Karaman and Frazzoli 2011, algorithm 6, k-nearest).

    box: x0, y0, x1, y1. goal: x, y, radius. ``near`` and ``near_d`` are room for the neighbours, ``stack`` and
    ``fresh`` for a subtree. Returns when the samples are drawn or the arrays full.
    """
    capacity = node.shape[0]
    for _ in range(samples):
        if count[N] >= capacity:
            return
        count[DRAWN] += 1
        sx = box[0] + (box[2] - box[0]) * uniform(random)
        sy = box[1] + (box[3] - box[1]) * uniform(random)
        sh = TWO_PI * uniform(random) - math.pi
        if uniform(random) < goal_bias:
            sx, sy = goal[0], goal[1]
        n = count[N]
        # The nearest state in OMPL's SE(2) distance: place plus half the heading difference.
        nearest, nearest_d = -1, np.inf
        within2 = np.inf
        for i in range(n):
            ex, ey = node[i, X] - sx, node[i, Y] - sy
            d2 = ex * ex + ey * ey
            if d2 < within2:
                d = math.sqrt(d2) + 0.5 * abs(wrap(node[i, H] - sh))
                if d < nearest_d:
                    nearest, nearest_d, within2 = i, d, d * d
        ok, x, y = steer(
            node[nearest, X],
            node[nearest, Y],
            node[nearest, H],
            node[nearest, T],
            sx,
            sy,
            reach,
            number,
            model,
            table,
            polar,
            course,
        )
        if not ok:
            count[REFUSED] += 1
            continue
        hit = first_hit(node[nearest, X], node[nearest, Y], x, y, edge, cell_first, cell_edge, grid, shape)
        if hit <= 1.0:  # the last valid state is taken instead: in fiftieths of the reach, as it was propagated
            length = math.hypot(x - node[nearest, X], y - node[nearest, Y])
            step = 0.02 * reach
            keep = math.floor(hit * length / step - 1e-6) * step
            if keep <= 0.0:
                count[REFUSED] += 1
                continue
            x = node[nearest, X] + (x - node[nearest, X]) * keep / length
            y = node[nearest, Y] + (y - node[nearest, Y]) * keep / length
        # k nearest, k = e (1 + 1/3) log n, sorted by distance
        k = min(near.shape[0], 1 + int(3.6243 * math.log(n + 1.0)))
        found = 0
        for i in range(n):
            ex, ey = node[i, X] - x, node[i, Y] - y
            d = ex * ex + ey * ey
            if found < k or d < near_d[k - 1]:
                at = found if found < k else k - 1
                if found < k:
                    found += 1
                while at > 0 and near_d[at - 1] > d:
                    near[at], near_d[at] = near[at - 1], near_d[at - 1]
                    at -= 1
                near[at], near_d[at] = i, d
        if found > 0 and near_d[0] < 1e-12:
            count[REFUSED] += 1
            continue
        best, best_c, best_h, best_t, best_r, best_m = -1, np.inf, 0.0, 0.0, 0.0, 0.0
        for m in range(-1, found):
            i = nearest if m < 0 else near[m]
            if m >= 0 and i == nearest:
                continue
            before_twa, before_t = _twa_before(node, link, i, number)
            ok, h, t, risk, most = _reach(
                node,
                i,
                x,
                y,
                before_twa,
                before_t,
                best_c,
                number,
                model,
                table,
                polar,
                course,
                target,
                risk_number,
                risk_table,
                vessel,
                disc,
            )
            cost = _cost(t, risk, most, risk_number)
            if not ok or cost >= best_c:
                continue
            if m >= 0 and first_hit(node[i, X], node[i, Y], x, y, edge, cell_first, cell_edge, grid, shape) <= 1.0:
                continue
            best, best_c, best_h, best_t, best_r, best_m = i, cost, h, t, risk, most
        if best < 0:
            count[REFUSED] += 1
            continue
        new = n
        node[new, X], node[new, Y], node[new, H] = x, y, best_h
        node[new, T], node[new, R], node[new, C], node[new, M] = best_t, best_r, best_c, best_m
        node[new, G] = math.atan2(x - node[best, X], y - node[best, Y])
        link[new, CHILD] = -1
        _hang(link, new, best)
        count[N] += 1
        if math.hypot(x - goal[0], y - goal[1]) <= goal[2] and count[GOALS] < goal_node.shape[0]:
            goal_node[count[GOALS]] = new
            count[GOALS] += 1
        before_twa, before_t = _twa_before(node, link, new, number)
        for m in range(found if risk_number[REWIRES] > 0.5 else 0):
            j = near[m]
            if j == best or link[j, PARENT] < 0:
                continue
            ok, h, t, risk, most = _reach(
                node,
                new,
                node[j, X],
                node[j, Y],
                before_twa,
                before_t,
                node[j, C],
                number,
                model,
                table,
                polar,
                course,
                target,
                risk_number,
                risk_table,
                vessel,
                disc,
            )
            if not ok or _cost(t, risk, most, risk_number) >= node[j, C] - 1e-9:
                continue
            if first_hit(x, y, node[j, X], node[j, Y], edge, cell_first, cell_edge, grid, shape) <= 1.0:
                continue
            if _adopt(
                node,
                link,
                new,
                j,
                h,
                t,
                risk,
                most,
                stack,
                fresh,
                number,
                model,
                table,
                polar,
                course,
                target,
                risk_number,
                risk_table,
                vessel,
                disc,
            ):
                count[REWIRED] += 1
        best_goal, best_cost = -1, np.inf
        for g in range(count[GOALS]):
            if node[goal_node[g], C] < best_cost:
                best_goal, best_cost = goal_node[g], node[goal_node[g], C]
        count[BEST] = best_goal
