"""The problem as arrays, for the reference algorithms' kernels: edges in a bucket grid, polar, no-go, targets.

A leg collides when it meets an edge of the solids shrunk by half the touching slack; a path that starts outside
them can only get inside across such an edge.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray

from companion.geo.angles import wrap_pi
from companion.planner.problem.evaluate import is_zoned
from companion.planner.problem.parts import TOUCH_M
from companion.planner.problem.value import Problem

_COURSES = 1441  # of the table of headings in a current: a quarter of a degree
_MAX_CELLS = 400_000

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


class ReferenceWorld(NamedTuple):
    """Arrays for kernels. Angles [rad], metres, seconds.

    ``edge`` (m, 4) x0 y0 x1 y1; ``cell_first`` (nx ny + 1,) and ``cell_edge`` index edges by cell, row by row;
    ``grid`` x0, y0, cell size [m]; ``shape`` nx, ny. ``number``: wind from, no-go half, deepest angle, turn rate,
    tack loss, gybe loss, k sigma0, k growth or k sigma_inf, rho, drift east, drift north, the autopilot's zone: from,
    half (0 without one). ``table`` (2, n) times and widenings of a forecast. ``polar`` (2, n) angles and speeds.
    ``course`` (3, n) heading, speed over ground and whether the boat can and the autopilot follows it (``is_zoned``),
    by course from -π (a current only). ``target`` (n, 8) x y vx vy r growth from until.
    """

    edge: Floats
    cell_first: Ints
    cell_edge: Ints
    grid: Floats
    shape: Ints
    number: Floats
    no_go_model: int
    table: Floats
    polar: Floats
    course: Floats
    target: Floats


def bounds_of(p: Problem) -> tuple[float, float, float, float]:
    """Return the box to search: the fence, or everything with half the distance around it."""
    if p.fence_polygon is not None and not p.fence_polygon.is_empty:
        x0, y0, x1, y1 = p.fence_polygon.bounds
        return float(x0), float(y0), float(x1), float(y1)
    x = [p.start_en[0], p.goal_en[0]]
    y = [p.start_en[1], p.goal_en[1]]
    if not p.obstacle_union.is_empty:
        x0, y0, x1, y1 = p.obstacle_union.bounds
        x += [x0, x1]
        y += [y0, y1]
    margin = 0.5 * math.dist(p.start_en, p.goal_en) + p.goal_radius_m
    return min(x) - margin, min(y) - margin, max(x) + margin, max(y) + margin


def world_of(p: Problem) -> ReferenceWorld:
    """Return the problem's arrays."""
    edge = _edges(p)
    cell_first, cell_edge, grid, shape = _buckets(edge)
    s, k = p.wind.sigma, p.k_delta
    table = np.zeros((2, 1))
    if s.model == "forecast":
        table = np.array([s.horizon_s, [p.widening_rad(t) for t in s.horizon_s]], dtype=np.float64)
    b, c = p.boat, p.current
    number = np.array(
        [
            p.wind.twd_from_rad,
            b.no_go_half_rad,
            b.max_twa_rad,
            b.turn_rate_radps,
            b.tack_loss_s if b.can_tack else math.inf,
            b.gybe_loss_s,
            k * s.sigma0_rad,
            k * s.later,
            s.rho_hz,
            c.drift_mps * math.sin(c.set_rad),
            c.drift_mps * math.cos(c.set_rad),
            *((p.zone.from_rad, p.zone.half_rad) if p.zone is not None and c.drift_mps > 0.0 else (0.0, 0.0)),
        ],
        dtype=np.float64,
    )
    target = np.array([t.row() for t in p.targets], dtype=np.float64).reshape(-1, 8)
    return ReferenceWorld(
        edge=edge,
        cell_first=cell_first,
        cell_edge=cell_edge,
        grid=grid,
        shape=shape,
        number=number,
        no_go_model=s.number,
        table=table,
        polar=np.array([b.polar_twa_rad, b.polar_mps], dtype=np.float64),
        course=_courses(p),
        target=target,
    )


def _edges(p: Problem) -> Floats:
    shrunk = p.solid.buffer(-0.5 * TOUCH_M, join_style="mitre", mitre_limit=5.0)
    if shrunk.is_empty:
        return np.empty((0, 4))
    parts = []
    for polygon in shapely.get_parts(shrunk):
        for ring in shapely.get_rings(polygon):
            xy = shapely.get_coordinates(ring)
            parts.append(np.column_stack([xy[:-1], xy[1:]]))
    return np.ascontiguousarray(np.concatenate(parts)) if parts else np.empty((0, 4))


def _buckets(edge: Floats) -> tuple[Ints, Ints, Floats, Ints]:
    """Return each cell's edges: every cell that an edge's box overlaps, long edges cut first into cell columns."""
    if edge.shape[0] == 0:
        return np.zeros(2, np.int64), np.zeros(0, np.int64), np.array([0.0, 0.0, 1.0]), np.array([1, 1])
    x0, y0 = float(edge[:, 0::2].min()), float(edge[:, 1::2].min())
    width, height = float(edge[:, 0::2].max()) - x0, float(edge[:, 1::2].max()) - y0
    cells = min(_MAX_CELLS, max(16, 2 * edge.shape[0]))
    size = max(math.sqrt(max(width * height, 1e-12) / cells), max(width, height) / 2000.0, 1e-6)
    nx, ny = int(width / size) + 1, int(height / size) + 1
    rows: list[int] = []
    owner: list[int] = []
    for i, (ax, ay, bx, by) in enumerate(edge.tolist()):
        if ay > by:
            ax, ay, bx, by = bx, by, ax, ay  # noqa: PLW2901
        for row in range(int((ay - y0) / size), min(ny - 1, int((by - y0) / size)) + 1):
            low, high = max(ay, y0 + row * size), min(by, y0 + (row + 1) * size)
            if by > ay:
                xa = ax + (bx - ax) * (max(low, ay) - ay) / (by - ay)
                xb = ax + (bx - ax) * (min(max(high, ay), by) - ay) / (by - ay)
            else:
                xa, xb = ax, bx
            first = max(0, int((min(xa, xb) - x0) / size - 1e-6))
            last = min(nx - 1, int((max(xa, xb) - x0) / size + 1e-6))
            for column in range(first, last + 1):
                rows.append(row * nx + column)
                owner.append(i)
    cell = np.array(rows, dtype=np.int64)
    order = np.argsort(cell, kind="stable")
    first_of = np.searchsorted(cell[order], np.arange(nx * ny + 1)).astype(np.int64)
    return first_of, np.array(owner, dtype=np.int64)[order], np.array([x0, y0, size]), np.array([nx, ny])


def _courses(p: Problem) -> Floats:
    if p.current.drift_mps == 0.0:
        return np.zeros((3, 0))
    from companion.planner.problem.evaluate import solve_heading

    out = np.zeros((3, _COURSES))
    for i, course in enumerate(np.linspace(-math.pi, math.pi, _COURSES)):
        heading, speed = solve_heading(p, float(course), 0.0)
        is_followed = not is_zoned(p, math.sin(course), math.cos(course))
        out[:, i] = wrap_pi(heading), speed, float(speed > 0.0 and is_followed)
    return out
