"""The sailing-time metric of uniform wind: the gauge of the convexified polar, a Finsler metric.

With velocities V = {v(a) (sin a, cos a) : a allowed} the least time over a displacement d, turning apart, is the
gauge γ(d) = min {t : d ∈ t conv(V ∪ 0)}: any mixture of courses is a mean velocity in the hull. The no-go zone is
taken at its narrowest, so γ bounds from below at every time. The hull is made of samples pushed out by two parts
in a million, more than a chord can cut off, so the bound stays a bound.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from companion.geo.distinct import distinct
from companion.kernels.jit import kernel
from companion.planner.problem.parts import NO_GO_SLACK_RAD
from companion.planner.problem.value import Problem
from companion.planner.search.kernels import Floats

_SAMPLES = 1800
_OUT = 1.0 + 2e-6
_TABLE = 2048
_STRIDE = 16


class Aim(NamedTuple):
    """The goal as a search aims at it: its disc [m], and the least time to it.

    ``table``: least seconds per metre by direction, over [-π, π); ``slack``: what the disc saves of it [s].
    """

    x: float
    y: float
    radius: float
    table: Floats
    slack: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Gauge:
    """``normals`` (m, 2) are scaled so that γ(d) >= max(normals @ d), with equality up to the pushing out.

    ``table`` is a lower bound of γ of the unit vector by direction [s/m], for look-up; ``blocked`` (k, 2) are unit
    directions in which no progress is possible at all (empty for a boat that can beat). ``can_move`` is False when
    no course is allowed. ``slack`` is by how much a path that uses the scorer's angular slack may beat the metric.
    """

    normals: Floats
    table: Floats
    table_max: float
    blocked: Floats
    least_half_rad: float
    can_move: bool
    slack: float = 1.0

    def aim(self, x: float, y: float, radius_m: float) -> Aim:
        """Return the goal's disc about (x, y) [m] with the least time to it from anywhere."""
        return Aim(x, y, radius_m, self.table, radius_m * self.table_max)

    def disc(self, dx: float, dy: float, radius_m: float) -> float:
        """Return the least time [s] to come within ``radius_m`` of the displacement (dx, dy); inf if it cannot."""
        return float(disc_time(self.normals, self.blocked, dx, dy, radius_m))


@kernel
def least_time(table: Floats, dx: float, dy: float) -> float:
    """Return the least time [s] that the displacement (dx, dy) [m] can take, by a table over directions [-π, π)."""
    n = table.shape[0]
    return float(table[int((math.atan2(dx, dy) + math.pi) / (2.0 * math.pi) * n) % n] * math.hypot(dx, dy))


@kernel
def least_from(aim: Aim, x: float, y: float) -> float:
    """Return the least time [s] from (x, y) [m] to the goal's disc, obstacles apart."""
    return max(0.0, least_time(aim.table, aim.x - x, aim.y - y) - aim.slack)


@kernel
def disc_time(normals: Floats, blocked: Floats, dx: float, dy: float, radius: float) -> float:
    """Return max over normals n of (n·d - radius |n|), at least 0: by duality the gauge distance to the disc."""
    best = 0.0
    for i in range(normals.shape[0]):
        nx, ny = normals[i, 0], normals[i, 1]
        value = nx * dx + ny * dy
        if value > best:
            value -= radius * math.hypot(nx, ny)
            best = max(best, value)
    for i in range(blocked.shape[0]):
        if blocked[i, 0] * dx + blocked[i, 1] * dy - radius > 1e-6:
            return math.inf
    return best


@kernel
def _chain(order: Floats) -> Floats:
    """Return one half of the convex hull of points sorted by x (Andrew's monotone chain), last point left out."""
    out = np.empty_like(order)
    n = 0
    for i in range(order.shape[0]):
        x, y = order[i, 0], order[i, 1]
        while n > 1:
            ax, ay, bx, by = out[n - 2, 0], out[n - 2, 1], out[n - 1, 0], out[n - 1, 1]
            if (bx - ax) * (y - ay) - (by - ay) * (x - ax) > 0.0:
                break
            n -= 1
        out[n, 0], out[n, 1] = x, y
        n += 1
    return out[: n - 1].copy()


def _hull(points: Floats) -> Floats:
    """Return the convex hull counter-clockwise."""
    order = np.ascontiguousarray(points[np.lexsort((points[:, 1], points[:, 0]))])
    return np.vstack([_chain(order), _chain(np.ascontiguousarray(order[::-1]))])


@kernel
def _tabulate(normals: Floats, size: int) -> Floats:
    """Return max(normals @ u) for unit vectors u at the ``size`` + 1 directions of a table over [-π, π].

    The normals stand counter-clockwise: between two directions ``_STRIDE`` apart the largest is one from the first's
    to the other's; two more on each side are for rounding. ``size`` is a multiple of the stride.
    """
    out = np.zeros(size + 1)
    n = normals.shape[0]
    before = 0
    for i in range(0, size + 1, _STRIDE):
        a = -math.pi + 2.0 * math.pi * i / size
        x, y = math.sin(a), math.cos(a)
        best, at = 0.0, before
        for k in range(n):
            value = normals[k, 0] * x + normals[k, 1] * y
            if value > best:
                best, at = value, k
        out[i] = best
        first, count = before + 2, min(n, (before - at) % max(1, n) + 5)
        for j in range(max(0, i - _STRIDE + 1), i):
            a = -math.pi + 2.0 * math.pi * j / size
            x, y = math.sin(a), math.cos(a)
            best = 0.0
            for m in range(first, first - count, -1):
                k = m % n
                best = max(best, normals[k, 0] * x + normals[k, 1] * y)
            out[j] = best
        before = at
    return out


class Courses(NamedTuple):
    """What of a problem its metric is made of: the polar, the deepest course, the current in the wind frame."""

    polar_twa_rad: tuple[float, ...]
    polar_mps: tuple[float, ...]
    max_twa_rad: float
    drift_mps: float
    set_rad: float

    @classmethod
    def of(cls, p: Problem) -> Courses:
        """Return those of a problem."""
        return cls(
            p.boat.polar_twa_rad,
            p.boat.polar_mps,
            p.boat.max_twa_rad,
            p.current.drift_mps,
            p.current.set_rad - p.wind.twd_from_rad,
        )


def velocities(p: Courses, half_rad: float) -> Floats:
    """Return velocities over the ground (n, 2) in the wind frame of all courses allowed at a no-go half angle."""
    top = min(p.max_twa_rad, math.pi)
    if half_rad > top:
        return np.empty((0, 2))
    nodes = np.asarray([a for a in p.polar_twa_rad if half_rad <= a <= top], np.float64)
    a = distinct(np.concatenate([np.linspace(half_rad, top, _SAMPLES), nodes]))
    v = np.interp(a, p.polar_twa_rad, p.polar_mps) * _OUT
    half = np.column_stack([v * np.sin(a), v * np.cos(a)])
    both = np.vstack([half, half[::-1] * np.array([-1.0, 1.0])])
    return both + p.drift_mps * np.array([math.sin(p.set_rad), math.cos(p.set_rad)])


def make_gauge(p: Problem) -> Gauge:
    """Return the gauge of ``p`` with the no-go zone at its narrowest."""
    return _gauge(Courses.of(p), max(0.0, p.no_go_min_rad))


@lru_cache(maxsize=16)  # by value: a plan asks for that of the same boat and wind in several waters
def _gauge(p: Courses, least: float) -> Gauge:
    points = velocities(p, least)
    moving = len(points) > 0 and float(np.max(np.hypot(points[:, 0], points[:, 1]))) > 1e-9
    if not moving:
        none = np.empty((0, 2))
        return Gauge(
            normals=none, table=np.full(_TABLE, 1e9), table_max=0.0, blocked=none, least_half_rad=least, can_move=False
        )
    with_rest = np.vstack([points, np.zeros((1, 2))])
    hull = _hull(with_rest)
    # Normals: of every hull edge that has the origin strictly inside; an edge through the origin blocks.
    x, y = np.ascontiguousarray(hull.T)
    out_x, out_y = np.roll(y, -1) - y, -(np.roll(x, -1) - x)
    size = np.hypot(out_x, out_y)
    keep = size > 1e-12
    out_x, out_y = out_x[keep] / size[keep], out_y[keep] / size[keep]
    support = out_x * x[keep] + out_y * y[keep]
    fast = float(np.max(np.hypot(x, y)))
    open_ = support > 1e-7 * fast
    normals = np.column_stack([out_x[open_] / support[open_], out_y[open_] / support[open_]])
    blocked = np.column_stack([out_x[~open_], out_y[~open_]])
    thin = _thin(normals)
    values = _tabulate(thin, _TABLE)
    # Between two table directions the convex γ may dip below both by about |γ| Δ²: taken off.
    table = np.minimum(values[:-1], values[1:]) * (1.0 - 2e-5)
    steepest = float(np.max(np.hypot(normals[:, 0], normals[:, 1]))) if len(normals) else 0.0
    dip = steepest * (2.0 * math.pi / _TABLE) ** 2
    return Gauge(
        normals=thin,
        table=np.maximum(0.0, table - dip),
        table_max=steepest,
        blocked=blocked,
        least_half_rad=least,
        can_move=True,
        slack=_slack(p, thin, least),
    )


def _slack(p: Courses, normals: Floats, least_rad: float) -> float:
    """Return the largest gauge of the velocities within the angular slack of the limits, at least 1."""
    top = min(p.max_twa_rad, math.pi)
    angles = np.array(
        [max(0.0, least_rad - NO_GO_SLACK_RAD * f) for f in (1.0, 0.5)]
        + [min(math.pi, top + NO_GO_SLACK_RAD * f) for f in (1.0, 0.5)]
    )
    v = np.interp(angles, p.polar_twa_rad, p.polar_mps)
    worst = 1.0
    for sign in (1.0, -1.0):
        q = np.column_stack([sign * v * np.sin(angles), v * np.cos(angles)])
        q = q + p.drift_mps * np.array([math.sin(p.set_rad), math.cos(p.set_rad)])
        worst = max(worst, float(np.max(q @ normals.T)) if len(normals) else 1.0)
    return worst * (1.0 + 1e-7)


def _thin(normals: Floats) -> Floats:
    """Return at most about 720 of the normals: fewer normals still bound from below."""
    if len(normals) <= 720:
        return normals
    angle = np.arctan2(normals[:, 0], normals[:, 1])
    bins = np.floor((angle + math.pi) / (2.0 * math.pi) * 720.0).astype(int)
    _, first = np.unique(bins, return_index=True)
    # The longest chords (the tangents that bridge the no-go zone) carry the value: always keep the extremes.
    extreme = {
        int(np.argmax(normals[:, 0])),
        int(np.argmin(normals[:, 0])),
        int(np.argmax(normals[:, 1])),
        int(np.argmin(normals[:, 1])),
        int(np.argmax(np.hypot(normals[:, 0], normals[:, 1]))),
    }
    return np.ascontiguousarray(normals[sorted(set(first.tolist()) | extreme)])
