"""The kernels of passages: speed made good, an edge crossed, arrivals label by label, a line sailed."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from companion.kernels.heap import pop, push
from companion.kernels.jit import kernel

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]

KNOWN, UNKNOWN, OVER_LIMIT, STILL, OVER_WAVES, LEE_SHORE = 0, 1, 2, 3, 4, 5
TWILIGHT = math.sin(math.radians(-6.0))  # below it is night
WAIT_STEP_S = 1800.0  # how often a boat that waits looks again
WAIT_S = 48 * 3600.0  # so long she waits in a calm for one edge
WAIT_TIDE_S = 13 * 3600.0  # and for a stream to turn: a tide
STRIDE = 8
SLACK = 0.98  # what the stencil's directions may cost, and a little for the wind between nodes
MOST_STEPS = 100_000  # of one edge or line
# All directions (i, j) without a common divisor up to 3 cells away: the worst excess over a straight way is 1.3 %.
STENCIL = np.array([(i, j) for i in range(-3, 4) for j in range(-3, 4) if math.gcd(i, j) == 1], dtype=np.int64)


class Craft(NamedTuple):
    """A boat: her speeds as mean velocities over hours, by wind.

    ``radial`` (winds, angles off the wind from 0 to π) [m/s] holds without a stream; ``normals`` (n·v <= 1) and
    ``losses`` are those of the ``counts`` sides of her hulls. ``share`` is of all speeds, ``night_share`` of those by
    night. ``max_tws_mps``, ``max_wave_m`` and ``lee_tws_mps``, the wind towards a near shore, she is not to be out in
    more of.
    """

    radial: Floats
    normals: Floats
    losses: Floats
    counts: NDArray[np.int64]
    tws_step_mps: float
    max_tws_mps: float
    share: float
    night_share: float
    max_wave_m: float
    lee_tws_mps: float


class Waters(NamedTuple):
    """Wind and stream on a grid of the passage's frame: (t, y, x, 2) along x and y; ``up`` (y, x, 3) are its places.

    ``waves`` (t, y, x) are heights [m], NaN where unknown; ``shore`` (y, x, 2) points to a shore that is near, zero
    where none is.

    ``first_x_m``, ``first_y_m`` is its corner, ``step_m`` the distance of its nodes, ``radius_m`` the sphere's.
    """

    t_s: Floats
    wind: Singles
    stream: Singles
    has_stream: bool
    waves: Singles
    has_waves: bool
    shore: Singles
    has_shore: bool
    up: Floats
    first_x_m: float
    first_y_m: float
    step_m: float
    radius_m: float


@kernel
def made_good(craft: Craft, wx: float, wy: float, cx: float, cy: float, ux: float, uy: float) -> float:
    """Return the speed over the ground [m/s] in the direction (ux, uy); 0 where wind and stream do not let her hold it.

    The polar wants the wind over the water.
    """
    wx, wy = wx - cx, wy - cy
    tws = math.hypot(wx, wy)
    if tws > 1e-9:
        ex, ey = -wx / tws, -wy / tws
    else:
        ex, ey = 1.0, 0.0
    place = min(tws / craft.tws_step_mps, craft.radial.shape[0] - 1.0)
    k = min(int(place), craft.radial.shape[0] - 2) if craft.radial.shape[0] > 1 else 0
    f = place - k
    along, across = ux * ex + uy * ey, uy * ex - ux * ey
    if cx == 0.0 and cy == 0.0:
        spot = math.acos(min(1.0, max(-1.0, along))) / math.pi * (craft.radial.shape[1] - 1)
        i = min(int(spot), craft.radial.shape[1] - 2)
        g = spot - i
        low = (1.0 - g) * craft.radial[k, i] + g * craft.radial[k, i + 1]
        if craft.radial.shape[0] == 1:
            return float(craft.share * low)
        high = (1.0 - g) * craft.radial[k + 1, i] + g * craft.radial[k + 1, i + 1]
        return float(craft.share * ((1.0 - f) * low + f * high))
    sx, sy = cx * ex + cy * ey, cy * ex - cx * ey
    low = _held(craft, k, along, across, sx, sy)
    if craft.radial.shape[0] == 1:
        return low
    return float((1.0 - f) * low + f * _held(craft, k + 1, along, across, sx, sy))


@kernel
def _held(craft: Craft, k: int, ux: float, uy: float, cx: float, cy: float) -> float:
    """Return the most of s with s·u - c in the hull ``k``, 0 where there is none above it.

    Each side bounds s from above or from below. Along the hull the bounds fall to the side that binds and rise behind
    it, so it is looked for by strides and then between two of them.
    """
    count = craft.counts[k]
    most, least = math.inf, -math.inf
    above = below = 0
    for i in range(0, count, STRIDE):
        along, room = _side(craft, k, i, ux, uy, cx, cy)
        if along > 1e-12 and room / along < most:
            most, above = room / along, i
        elif along < -1e-12 and room / along > least:
            least, below = room / along, i
    for m in range(1 - STRIDE, STRIDE):
        i = (above + m) % count
        along, room = _side(craft, k, i, ux, uy, cx, cy)
        if along > 1e-12 and room / along < most:
            most, above = room / along, i
        i = (below + m) % count
        along, room = _side(craft, k, i, ux, uy, cx, cy)
        if along < -1e-12:
            least = max(least, room / along)
    if least > most or most <= 0.0:
        return 0.0
    return float(most / (1.0 + craft.losses[k, above]))


@kernel
def _side(craft: Craft, k: int, i: int, ux: float, uy: float, cx: float, cy: float) -> tuple[float, float]:
    """Return n·u and 1 + n·c of a side of the hull ``k``."""
    nx, ny = craft.normals[k, i, 0] / craft.share, craft.normals[k, i, 1] / craft.share
    return nx * ux + ny * uy, 1.0 + nx * cx + ny * cy


@kernel
def sun(t_s: float) -> tuple[float, float, float]:
    """Return the direction of the sun in the earth's axes at a Unix time, to 0.01 degrees (Astronomical Almanac)."""
    day = t_s / 86_400.0 - 10_957.5
    g = math.radians(357.529 + 0.98560028 * day)
    ecliptic = math.radians(280.459 + 0.98564736 * day + 1.915 * math.sin(g) + 0.020 * math.sin(2.0 * g))
    tilt = math.radians(23.439)
    right = math.atan2(math.cos(tilt) * math.sin(ecliptic), math.cos(ecliptic))
    lon = right - math.radians(280.46061837 + 360.98564736629 * day)
    z = math.sin(tilt) * math.sin(ecliptic)
    level = math.sqrt(1.0 - z * z)
    return level * math.cos(lon), level * math.sin(lon), z


@kernel
def _is_night(t_s: float, ux: float, uy: float, uz: float) -> bool:
    x, y, z = sun(t_s)
    return x * ux + y * uy + z * uz < TWILIGHT


@kernel
def _at(t_axis: Floats, t: float) -> tuple[int, float]:
    """Return the time before and the share of the way to the next; -1 outside of the axis."""
    n = t_axis.shape[0]
    if t < t_axis[0] or t > t_axis[n - 1]:
        return -1, 0.0
    if n == 1:
        return 0, 0.0
    k = min(int(np.searchsorted(t_axis, t, side="right")) - 1, n - 2)
    return k, (t - t_axis[k]) / (t_axis[k + 1] - t_axis[k])


@kernel
def _rate(w: Waters, craft: Craft, x: float, y: float, t: float, ux: float, uy: float) -> tuple[float, int]:
    """Return the speed made good at a place and time, and whether it is known and allowed."""
    k, ft = _at(w.t_s, t)
    if k < 0:
        return 0.0, UNKNOWN
    px, py = (x - w.first_x_m) / w.step_m, (y - w.first_y_m) / w.step_m
    ny, nx = w.wind.shape[1], w.wind.shape[2]
    i, j = min(max(int(px), 0), nx - 2), min(max(int(py), 0), ny - 2)
    fx, fy = px - i, py - j
    wx = wy = cx = cy = height = known = 0.0
    for dt in range(2):
        wt = ft if dt else 1.0 - ft
        if wt == 0.0:
            continue
        for dy in range(2):
            wy_t = wt * (fy if dy else 1.0 - fy)
            if wy_t == 0.0:
                continue
            if fx != 1.0:
                weight = wy_t * (1.0 - fx)
                wx += weight * w.wind[k + dt, j + dy, i, 0]
                wy += weight * w.wind[k + dt, j + dy, i, 1]
            if fx != 0.0:
                weight = wy_t * fx
                wx += weight * w.wind[k + dt, j + dy, i + 1, 0]
                wy += weight * w.wind[k + dt, j + dy, i + 1, 1]
            if not (w.has_stream or w.has_waves):
                continue
            for dx in range(2):
                weight = wy_t * (fx if dx else 1.0 - fx)
                if weight == 0.0:
                    continue
                if w.has_stream:
                    cx += weight * w.stream[k + dt, j + dy, i + dx, 0]
                    cy += weight * w.stream[k + dt, j + dy, i + dx, 1]
                if w.has_waves and not math.isnan(w.waves[k + dt, j + dy, i + dx]):
                    height += weight * w.waves[k + dt, j + dy, i + dx]
                    known += weight
    if math.isnan(wx + wy + cx + cy):
        return 0.0, UNKNOWN
    if math.hypot(wx, wy) > craft.max_tws_mps:
        return 0.0, OVER_LIMIT
    if height > known * craft.max_wave_m:  # of a sea that is not known nothing is said
        return 0.0, OVER_WAVES
    if w.has_shore:
        towards = w.shore[j + (fy > 0.5), i + (fx > 0.5)]
        if wx * towards[0] + wy * towards[1] > craft.lee_tws_mps:
            return 0.0, LEE_SHORE
    speed = made_good(craft, wx, wy, cx, cy, ux, uy)
    if craft.night_share < 1.0:
        place = w.up[j + (fy > 0.5), i + (fx > 0.5)]
        if _is_night(t, place[0], place[1], place[2]):
            speed *= craft.night_share
    return speed, KNOWN


@kernel
def cross(
    w: Waters, craft: Craft, x0: float, y0: float, x1: float, y1: float, t: float, step_s: float
) -> tuple[float, int]:
    """Return when she is at (x1, y1), sailing straight from (x0, y0) at ``t``, by steps of ``step_s`` at the most.

    Midpoint rule. Where she makes no way she waits, and tries again a step later.
    """
    shrink = math.cos(0.5 * (y0 + y1) / w.radius_m)
    dx, dy = (x1 - x0) * shrink, y1 - y0
    length = math.hypot(dx, dy)
    if length == 0.0:
        return t, KNOWN
    ux, uy = dx / length, dy / length
    gone = waited = 0.0
    longest = WAIT_TIDE_S if w.has_stream else WAIT_S
    for _ in range(MOST_STEPS):
        share = gone / length
        v, status = _rate(w, craft, x0 + share * (x1 - x0), y0 + share * (y1 - y0), t, ux, uy)
        if status != KNOWN:
            return math.inf, status
        left = length - gone
        if v <= 1e-6:
            waited += WAIT_STEP_S
            t += WAIT_STEP_S
            if waited > longest:
                return math.inf, STILL
            continue
        dt = min(step_s, left / v)
        share = min(1.0, (gone + 0.5 * dt * v) / length)
        v, status = _rate(w, craft, x0 + share * (x1 - x0), y0 + share * (y1 - y0), t + 0.5 * dt, ux, uy)
        if status != KNOWN:
            return math.inf, status
        if v * dt >= left - 1e-6 * length:
            return t + (left / v), KNOWN
        gone += v * dt
        t += dt
    return math.inf, UNKNOWN


@kernel
def _fastest(w: Waters, craft: Craft, i: int, j: int, ii: int, jj: int, begins: float, ends: float) -> float:
    """Return the least time [s] from node (ii, jj) to (i, j) in the best wind on either between two times, or inf."""
    shrink = math.cos((w.first_y_m + 0.5 * (j + jj) * w.step_m) / w.radius_m)
    dx, dy = (i - ii) * w.step_m * shrink, (j - jj) * w.step_m
    length = math.hypot(dx, dy)
    last = min(int(np.searchsorted(w.t_s, ends)), w.t_s.shape[0] - 1)
    fastest = 0.0
    for k in range(max(0, int(np.searchsorted(w.t_s, begins, side="right")) - 1), last + 1):
        for at_end in range(2):
            b, a = (j, i) if at_end else (jj, ii)
            wx, wy = w.wind[k, b, a, 0], w.wind[k, b, a, 1]
            cx = w.stream[k, b, a, 0] if w.has_stream else 0.0
            cy = w.stream[k, b, a, 1] if w.has_stream else 0.0
            if not math.isnan(wx + wy + cx + cy):
                fastest = max(fastest, made_good(craft, wx, wy, cx, cy, dx / length, dy / length))
    return length / fastest if fastest > 1e-6 else math.inf


@kernel
def labels(
    w: Waters,
    craft: Craft,
    allowed: NDArray[np.bool_],
    blocked: NDArray[np.uint64],
    first: int,
    last: int,
    t: float,
    step_s: float,
    earliest: Floats,
    found_s: float,
) -> tuple[Floats, NDArray[np.int32], int, int]:
    """Return a label for each node [s, inf], the nodes before, and how often wind was unknown, and a limit broken.

    Label setting (Dijkstra's): nodes are left in the order of their labels, ``last`` the last. Bit d of ``blocked``
    closes the direction d of the stencil. Without ``earliest`` (no element) a label is the earliest arrival of who
    departs at ``t`` [Unix s]. With it, it is the least time left to ``first``, backwards, each way in the best wind
    that she can meet on it: no sooner than she can be there (``earliest``, less what the stencil may have cost)
    and no later than leaves time for the rest, if she is to be there in less than ``found_s``.
    """
    ny, nx = w.wind.shape[1], w.wind.shape[2]
    is_back = earliest.shape[0] > 0
    sign = -1 if is_back else 1
    label = np.full(ny * nx, math.inf)
    before = np.full(ny * nx, -1, dtype=np.int32)
    done = np.zeros(ny * nx, dtype=np.bool_)
    keys, items, n = np.empty(1024), np.empty(1024, dtype=np.int32), 0
    label[first] = 0.0 if is_back else t
    keys, items, n = push(keys, items, n, label[first], first)
    unknown = strong = 0
    while n > 0:
        node = int(items[0])
        n = pop(keys, items, n)
        if done[node]:
            continue
        done[node] = True
        if node == last:
            break
        j, i = node // nx, node % nx
        x, y = w.first_x_m + i * w.step_m, w.first_y_m + j * w.step_m
        for d in range(STENCIL.shape[0]):
            if (blocked[node] >> np.uint64(d)) & np.uint64(1):
                continue
            ii, jj = i + sign * STENCIL[d, 0], j + sign * STENCIL[d, 1]
            if ii < 0 or jj < 0 or ii >= nx or jj >= ny:
                continue
            other = jj * nx + ii
            if done[other] or not allowed[other]:
                continue
            if is_back:
                begins, ends = t + SLACK * (earliest[other] - t), t + found_s - label[node]
                if not begins <= ends:
                    continue
                there, status = label[node] + _fastest(w, craft, i, j, ii, jj, begins, ends), KNOWN
            else:
                there, status = cross(
                    w, craft, x, y, w.first_x_m + ii * w.step_m, w.first_y_m + jj * w.step_m, label[node], step_s
                )
            if status == UNKNOWN:
                unknown += 1
            elif status in (OVER_LIMIT, OVER_WAVES, LEE_SHORE):
                strong += 1
            elif status == KNOWN and there < label[other]:
                label[other] = there
                before[other] = node
                keys, items, n = push(keys, items, n, there, other)
    return label, before, unknown, strong


@kernel
def arrivals(w: Waters, craft: Craft, xy_m: Floats, t: float, step_s: float) -> Floats:
    """Return when she is at each point of a polyline [s], who is at the first at ``t``; inf from where she cannot."""
    out = np.full(xy_m.shape[0], math.inf)
    out[0] = t
    for i in range(xy_m.shape[0] - 1):
        t, status = cross(w, craft, xy_m[i, 0], xy_m[i, 1], xy_m[i + 1, 0], xy_m[i + 1, 1], t, step_s)
        if status != KNOWN:
            break
        out[i + 1] = t
    return out


@kernel
def sail_line(
    craft: Craft,
    t_axis: Floats,
    s_m: Floats,
    wind: Floats,
    stream: Floats,
    waves: Floats,
    onshore: Floats,
    up: Floats,
    t: float,
    step_s: float,
) -> tuple[Floats, int, int]:
    """Sail a line: wind and stream (t, s, 2) along the course and to its left, at the ways ``s_m`` from its begin.

    ``waves`` (t, s) are heights [m], NaN where unknown, ``onshore`` (t, s) the wind towards a near shore [m/s].

    Return rows of (time, way, speed made good, wind speed, angle of the course to the wind, night), how many there are,
    and whether the last of them is the end (KNOWN) or why it is not.
    """
    rows = np.empty((256, 6))
    count, gone, length = 0, 0.0, s_m[s_m.shape[0] - 1]
    for _ in range(MOST_STEPS):
        v = dt = 0.0
        for half in range(2):  # the midpoint rule
            at_t, at_s = (t + 0.5 * dt, min(gone + 0.5 * dt * v, length)) if half else (t, gone)
            k, ft = _at(t_axis, at_t)
            if k < 0:
                return rows, count, UNKNOWN
            i, fs = _at(s_m, at_s)
            wx = wy = cx = cy = height = known = lee = 0.0
            for a in range(2):
                for b in range(2):
                    weight = (ft if a else 1.0 - ft) * (fs if b else 1.0 - fs)
                    if weight > 0.0:
                        wx += weight * wind[k + a, i + b, 0]
                        wy += weight * wind[k + a, i + b, 1]
                        cx += weight * stream[k + a, i + b, 0]
                        cy += weight * stream[k + a, i + b, 1]
                        lee += weight * onshore[k + a, i + b]
                        if not math.isnan(waves[k + a, i + b]):
                            height += weight * waves[k + a, i + b]
                            known += weight
            if math.isnan(wx + wy + cx + cy):
                return rows, count, UNKNOWN
            v = made_good(craft, wx, wy, cx, cy, 1.0, 0.0)
            near = i + (1 if fs > 0.5 else 0)
            night = _is_night(at_t, up[near, 0], up[near, 1], up[near, 2])
            if night:
                v *= craft.night_share
            if half == 0:
                if count >= rows.shape[0]:
                    rows = np.concatenate((rows, np.empty_like(rows)))
                wx, wy = wx - cx, wy - cy
                rows[count, 0], rows[count, 1], rows[count, 2] = t, gone, v
                rows[count, 3] = math.hypot(wx + cx, wy + cy)
                rows[count, 4] = math.atan2(wy, -wx)
                rows[count, 5] = 1.0 if night else 0.0
                count += 1
                if rows[count - 1, 3] > craft.max_tws_mps:
                    return rows, count, OVER_LIMIT
                if height > known * craft.max_wave_m:
                    return rows, count, OVER_WAVES
                if lee > craft.lee_tws_mps:
                    return rows, count, LEE_SHORE
                if gone >= length:
                    return rows, count, KNOWN
                dt = min(step_s, (length - gone) / v) if v > 1e-6 else step_s
        if v * dt >= (length - gone) - 1e-7 * length:
            t += (length - gone) / v
            gone = length
        else:
            gone += v * dt
            t += dt
    return rows, count, UNKNOWN
