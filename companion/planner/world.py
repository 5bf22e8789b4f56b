"""A problem made ready for the compiled search: the wind frame, the boundary in a grid, the boat in numbers."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray

from companion.planner.kernels import Boat, Floats, Grid, rasterise
from companion.planner.problem import TOUCH_M, Problem

SKIN_M = 3e-4
"""Boundaries are moved this far into the solid [m], so that a path may touch them; the scorer allows 1e-3."""
SIGMA_KINDS = {"none": 0, "kalman": 1, "ar1": 2, "forecast": 3}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class World:
    """The problem in the wind frame (see kernels.py).

    ``corners`` are the solid's convex vertices (m, 2), ``outward`` their
    bisectors into the water, ``marks`` one inner point of each obstacle (k, 2).
    """

    problem: Problem
    grid: Grid
    boat: Boat
    corners: Floats
    outward: Floats
    marks: Floats
    goal: tuple[float, float]
    goal_radius: float
    h0: float
    box: tuple[float, float, float, float]
    fence_box: bool
    solids: tuple[shapely.Geometry, ...]
    free: shapely.Geometry | None

    def is_open(self, en: tuple[float, float]) -> bool:
        """Is the point of the problem's frame in free water? A quick look; False may also mean: on a boundary."""
        if self.free is not None and not shapely.contains_xy(self.free, *en):
            return False
        return not (self.solids and bool(np.any(shapely.intersects_xy(np.asarray(self.solids), *en))))

    def to_wind(self, en: NDArray[np.float64]) -> Floats:
        """Return points (n, 2) of the problem in the wind frame."""
        return to_wind(self.problem, en)

    def to_en(self, xy: NDArray[np.float64]) -> Floats:
        """Return points (n, 2) of the wind frame in the problem's frame."""
        s, c = math.sin(self.problem.wind.twd_from_rad), math.cos(self.problem.wind.twd_from_rad)
        out = np.empty_like(xy)
        out[:, 0] = self.problem.start_en[0] + c * xy[:, 0] + s * xy[:, 1]
        out[:, 1] = self.problem.start_en[1] - s * xy[:, 0] + c * xy[:, 1]
        return out


def to_wind(p: Problem, en: NDArray[np.float64]) -> Floats:
    """Return points (n, 2) in the wind frame: origin at the start, +y up wind, +x to starboard of that."""
    s, c = math.sin(p.wind.twd_from_rad), math.cos(p.wind.twd_from_rad)
    x, y = en[:, 0] - p.start_en[0], en[:, 1] - p.start_en[1]
    return np.column_stack([c * x - s * y, s * x + c * y])


def polygons(geometry: shapely.Geometry) -> list[shapely.Geometry]:
    """Return the polygons in a geometry, dropping lines and points that repairing may leave."""
    parts = shapely.get_parts(shapely.get_parts(np.asarray([geometry])))
    return [g for g in parts if g.geom_type == "Polygon" and not g.is_empty and g.area > 0.0]


def _vanishes(g: shapely.Geometry) -> bool:
    """Is the polygon a sliver that the scorer's slack removes altogether? Its in-radius is at least area / length."""
    return g.area < TOUCH_M * g.length and bool(g.buffer(-TOUCH_M, join_style="mitre", mitre_limit=5.0).is_empty)


def merged_solids(p: Problem) -> tuple[list[shapely.Geometry], shapely.Geometry | None]:
    """Return (obstacles as disjoint valid polygons, fence with what crosses its line cut out, or None).

    Only what touches is united: a union of a hundred thousand vertices that do not touch would cost a second.
    """
    solids: list[shapely.Geometry] = []
    for g in p.obstacles:
        if p.clearance_floor_m > 0.0:
            solids += polygons(shapely.make_valid(g).buffer(p.clearance_floor_m))
        else:
            solids += polygons(g if g.is_valid else shapely.make_valid(g))
    if len(solids) > 1:
        left, right = shapely.STRtree(solids).query(solids, predicate="intersects")
        touching = sorted({int(i) for i, j in zip(left, right, strict=True) if i != j})
        if touching:
            alone = [g for i, g in enumerate(solids) if i not in set(touching)]
            solids = alone + polygons(shapely.union_all([solids[i] for i in touching]))
    solids = [g for g in solids if not _vanishes(g)]
    fence = p.fence_polygon
    if fence is None:
        return solids, None
    shapely.prepare(fence)
    inside, crossing = [], []
    for g in solids:
        if fence.contains_properly(g):
            inside.append(g)
        elif fence.intersects(g):
            crossing.append(g)
    if crossing:
        fence = fence.difference(shapely.union_all(crossing))
    return inside, fence


def boundary_edges(rings: list[NDArray[np.float64]]) -> tuple[Floats, Floats, Floats]:
    """Return (segments (m, 4) moved into the solid, the solid's convex corners (k, 2), their outward bisectors).

    Each ring is closed, (n + 1, 2), and has the solid on its left. A vertex moves along its bisector so that both
    edges move by SKIN_M, at most 20 times that at a spike and never by more than a quarter of its shorter edge.
    """
    edges: list[Floats] = []
    corners: list[Floats] = []
    outward: list[Floats] = []
    for ring in rings:
        q = ring[:-1]
        step = np.roll(q, -1, axis=0) - q
        q = q[np.hypot(step[:, 0], step[:, 1]) > 1e-9]
        if len(q) < 3:
            continue
        out = np.roll(q, -1, axis=0) - q
        size = np.hypot(out[:, 0], out[:, 1])
        out = out / size[:, None]
        into, size_in = np.roll(out, 1, axis=0), np.roll(size, 1)
        n_in, n_out = np.column_stack([-into[:, 1], into[:, 0]]), np.column_stack([-out[:, 1], out[:, 0]])
        both = n_in + n_out
        denominator = 1.0 + np.sum(n_in * n_out, axis=1)
        shift = SKIN_M * both / np.maximum(denominator, 1e-9)[:, None]
        reach = np.hypot(shift[:, 0], shift[:, 1])
        cap = np.minimum(20.0 * SKIN_M, 0.25 * np.minimum(size, size_in))
        shift *= np.minimum(1.0, cap / np.maximum(reach, 1e-15))[:, None]
        moved = q + shift
        edges.append(np.hstack([moved, np.roll(moved, -1, axis=0)]))
        turn = into[:, 0] * out[:, 1] - into[:, 1] * out[:, 0]
        convex = turn > 1e-9
        corners.append(q[convex])
        outward.append(-(both / np.maximum(np.hypot(both[:, 0], both[:, 1]), 1e-12)[:, None])[convex])
    if not edges:
        return np.empty((0, 4)), np.empty((0, 2)), np.empty((0, 2))
    return tuple(np.ascontiguousarray(np.vstack(a)) for a in (edges, corners, outward))  # type: ignore[return-value]


def _rings(p: Problem, solids: list[shapely.Geometry], fence: shapely.Geometry | None) -> list[NDArray[np.float64]]:
    rings: list[NDArray[np.float64]] = []
    for g in solids:
        oriented = shapely.orient_polygons(g)  # exterior counter-clockwise: the solid on the left
        rings += [shapely.get_coordinates(r) for r in (oriented.exterior, *oriented.interiors)]
    if fence is not None:
        for g in polygons(fence):
            oriented = shapely.orient_polygons(g, exterior_cw=True)  # here the solid is outside
            rings += [shapely.get_coordinates(r) for r in (oriented.exterior, *oriented.interiors)]
    return [to_wind(p, r) for r in rings]


def make_grid(edges: Floats) -> Grid:
    """Return the segments in a uniform grid of about two cells a segment, a million at most."""
    if len(edges) == 0:
        return Grid(0.0, 0.0, 1.0, 1, 1, np.zeros(2, np.int32), np.empty(0, np.int32), edges)
    x, y = edges[:, 0::2], edges[:, 1::2]
    x0, x1, y0, y1 = float(x.min()), float(x.max()), float(y.min()), float(y.max())
    width, height = max(x1 - x0, 1e-3), max(y1 - y0, 1e-3)
    cells = min(1_000_000, max(256, 4 * len(edges)))
    size = max(math.sqrt(width * height / cells), max(width, height) / 4096.0)
    nx, ny = int(width / size) + 1, int(height / size) + 1
    start, item = rasterise(edges, x0, y0, 1.0 / size, nx, ny)
    return Grid(x0, y0, 1.0 / size, nx, ny, start, item, edges)


def _best_angles(p: Problem) -> tuple[float, float]:
    """Return the |TWA| of the best way made good up wind and down wind, no-go zone apart."""
    b = p.boat
    angles = np.unique(np.concatenate([np.linspace(0.0, math.pi, 3601), np.clip(b.polar_twa_rad, 0.0, math.pi)]))
    made = np.interp(angles, b.polar_twa_rad, b.polar_mps) * np.cos(angles)
    up = angles[angles >= b.no_go_half_rad - 1e-12]
    down = angles[angles <= b.max_twa_rad + 1e-12]
    best_up = float(up[int(np.argmax(made[angles >= b.no_go_half_rad - 1e-12]))]) if len(up) else math.pi
    best_down = float(down[int(np.argmin(made[: len(down)]))]) if len(down) else 0.0
    return best_up, min(best_down, b.max_twa_rad)


def make_boat(p: Problem) -> Boat:
    """Return the boat, the no-go zone in time and the targets in the wind frame."""
    b, s = p.boat, p.wind.sigma
    horizon = np.asarray(s.horizon_s or (0.0,), np.float64)
    width = np.asarray([p.widening_rad(t) for t in horizon], np.float64)
    angle = p.current.set_rad - p.wind.twd_from_rad
    origin = np.asarray(p.start_en)
    rows = []
    for t in p.targets:
        xy = to_wind(p, np.array([[t.x_m, t.y_m]]))[0]
        v = to_wind(p, origin + np.array([[t.vx_mps, t.vy_mps]]))[0]
        rows.append([xy[0], xy[1], v[0], v[1], t.radius_m, t.growth_mps, t.from_s, t.until_s, 0.0])
    up, down = _best_angles(p)
    return Boat(
        np.asarray(b.polar_twa_rad, np.float64), np.asarray(b.polar_mps, np.float64), b.turn_rate_radps,
        b.no_go_half_rad, b.max_twa_rad, SIGMA_KINDS[s.model] if p.is_time_varying or s.model == "forecast" else 0,
        s.sigma0_rad, s.growth_rad_per_sqrt_s, s.sigma_inf_rad, s.rho_hz, p.k_delta, horizon, width,
        b.tack_loss_s, b.gybe_loss_s, p.current.drift_mps * math.sin(angle), p.current.drift_mps * math.cos(angle),
        up, down, np.asarray(rows, np.float64).reshape(-1, 9),
    )._replace(base=_constant_base(p))


def _constant_base(p: Problem) -> float:
    """Return the boat's no-go half angle, widened already where the widening does not change with time."""
    constant = not p.is_time_varying and p.wind.sigma.model != "forecast"
    return p.boat.no_go_half_rad + (p.widening_rad(0.0) if constant else 0.0)


def make_world(p: Problem) -> World:
    """Return ``p`` ready for the search. ``p.defect`` must be None."""
    solids, fence = merged_solids(p)
    edges, corners, outward = boundary_edges(_rings(p, solids, fence))
    marks = np.asarray([(q.x, q.y) for q in (g.representative_point() for g in solids)]).reshape(-1, 2)
    goal = to_wind(p, np.asarray([p.goal_en]))[0]
    points = np.vstack([np.zeros((1, 2)), goal[None, :]])
    if len(edges):
        points = np.vstack([points, edges[:, :2]])
    x0, y0 = points.min(axis=0)
    x1, y1 = points.max(axis=0)
    return World(
        problem=p, grid=make_grid(edges), boat=make_boat(p), corners=corners, outward=outward,
        marks=np.ascontiguousarray(to_wind(p, marks)), goal=(float(goal[0]), float(goal[1])),
        goal_radius=p.goal_radius_m,
        h0=(p.start_heading_rad - p.wind.twd_from_rad + math.pi) % (2.0 * math.pi) - math.pi,
        box=(float(x0), float(y0), float(x1), float(y1)), fence_box=fence is not None, solids=tuple(solids), free=fence,
    )
