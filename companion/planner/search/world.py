"""A problem made ready for the compiled search: the wind frame, the boundary in a grid, the boat in numbers."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray

from companion.geo.angles import wrap_pi
from companion.planner.problem.parts import TOUCH_M
from companion.planner.problem.value import Problem
from companion.planner.search.kernels import BoatModel, Floats, SegmentGrid, rasterise

SKIN_M = 3e-4
"""Boundaries are moved this far into the solid [m], so that a path may touch them; the scorer allows 1e-3."""
DEEP_SKIN_M = 9.8e-4
"""The same where start or goal lies in the solid, less deep than the scorer allows."""
TANGLE = 60_000
"""Pairs of obstacles whose boxes overlap, above which obstacles are not united (thousands of crossing slivers)."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SearchWorld:
    """The problem in the wind frame (see kernels.py).

    ``corners`` are the solid's convex vertices (m, 2), ``outward`` their
    bisectors into the water, ``marks`` one inner point of each obstacle (k, 2).
    """

    problem: Problem
    grid: SegmentGrid
    boat: BoatModel
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
        """Return whether the problem's point is in free water. A quick look; False may also mean: on a boundary."""
        return _is_open(self.solids, self.free, en)

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


def _is_open(solids: Sequence[shapely.Geometry], free: shapely.Geometry | None, en: tuple[float, float]) -> bool:
    if free is not None and not shapely.contains_xy(free, *en):
        return False
    return not (solids and bool(np.any(shapely.intersects_xy(np.asarray(solids, dtype=object), *en))))


def to_wind(p: Problem, en: NDArray[np.float64]) -> Floats:
    """Return points (n, 2) in the wind frame: origin at the start, +y up wind, +x to starboard of that."""
    s, c = math.sin(p.wind.twd_from_rad), math.cos(p.wind.twd_from_rad)
    x, y = en[:, 0] - p.start_en[0], en[:, 1] - p.start_en[1]
    return np.column_stack([c * x - s * y, s * x + c * y])


def polygons(geometry: shapely.Geometry | NDArray[np.object_]) -> list[shapely.Geometry]:
    """Return the polygons in geometries, dropping lines and points that repairing may leave."""
    parts = np.atleast_1d(geometry)
    if np.any(shapely.get_type_id(parts) != shapely.GeometryType.POLYGON):
        parts = shapely.get_parts(shapely.get_parts(parts))
    keep = (shapely.get_type_id(parts) == shapely.GeometryType.POLYGON) & (shapely.area(parts) > 0.0)
    return list(parts[keep])


def _vanishes(g: shapely.Geometry) -> bool:
    """Return whether the polygon is a sliver that the scorer's slack removes altogether."""
    return bool(g.buffer(-TOUCH_M, join_style="mitre", mitre_limit=5.0).is_empty)


def merged_solids(p: Problem) -> tuple[list[shapely.Geometry], shapely.Geometry | None, bool]:
    """Return (obstacles as disjoint valid polygons, fence with what crosses its line cut out or None, tangled).

    Only what touches is united: a union of a hundred thousand vertices that do not touch would cost a second. With
    more than TANGLE overlapping boxes nothing is, and the fence is left alone: then the polygons are not disjoint.
    """
    given = np.asarray(p.obstacles, dtype=object)
    broken = ~shapely.is_valid(given)
    given[broken] = shapely.make_valid(given[broken])
    if p.clearance_floor_m > 0.0 and len(given):
        given = shapely.buffer(given, p.clearance_floor_m, quad_segs=16)  # as the scorer does
    solids = polygons(given)
    if len(solids) > 300 and len(shapely.STRtree(solids).query(solids)[0]) > TANGLE + len(solids):
        return solids, p.fence_polygon, True
    if len(solids) > 1:
        every = np.asarray(solids, dtype=object)
        left, right = shapely.STRtree(every).query(every)
        left, right = left[left < right], right[left < right]
        meet = shapely.intersects(every[left], every[right])
        touching = np.zeros(len(every), dtype=np.bool_)
        touching[left[meet]] = touching[right[meet]] = True
        if np.any(touching):  # each group of those that meet by itself: a third of the time of all at once
            solids = [*every[~touching], *polygons(shapely.disjoint_subset_union_all(every[touching]))]
    every = np.asarray(solids, dtype=object)
    thin = shapely.area(every) < TOUCH_M * shapely.length(every)  # the in-radius is at least area / length
    solids = [g for g, is_thin in zip(solids, thin, strict=True) if not (is_thin and _vanishes(g))]
    fence = p.fence_polygon
    if fence is None:
        return solids, None, False
    shapely.prepare(fence)
    every = np.asarray(solids, dtype=object)
    within = shapely.contains_properly(fence, every) if len(every) else np.empty(0, np.bool_)
    inside = list(every[within])
    crossing = [g for g in every[~within] if fence.intersects(g)]
    if crossing:
        fence = fence.difference(shapely.union_all(crossing))
    return inside, fence, False


def boundary_edges(q: Floats, owner: NDArray[np.int64], skin_m: float = SKIN_M) -> tuple[Floats, Floats, Floats]:
    """Return (segments (m, 4) moved into the solid, the solid's convex corners (k, 2), their outward bisectors).

    ``q`` are the vertices of all rings, ``owner`` (not falling) the ring of each; a ring has the solid on its left. A
    vertex moves along its bisector so that both edges move by ``skin_m``, at most 20 times that at a spike and never by
    more than a quarter of its shorter edge.
    """
    if not len(q):
        return np.empty((0, 4)), np.empty((0, 2)), np.empty((0, 2))
    after = _after(owner)
    keep = np.hypot(q[after, 0] - q[:, 0], q[after, 1] - q[:, 1]) > 1e-9
    keep &= (np.bincount(owner[keep], minlength=int(owner[-1]) + 1) >= 3)[owner]
    if not np.all(keep):
        q, owner = q[keep], owner[keep]
        if not len(q):
            return np.empty((0, 4)), np.empty((0, 2)), np.empty((0, 2))
        after = _after(owner)
    _part_touching(q, after)
    before = np.empty_like(after)
    before[after] = np.arange(len(after))
    x, y = np.ascontiguousarray(q.T)  # columns by themselves: numpy takes several times as long for rows of two
    out_x, out_y = x[after] - x, y[after] - y
    size = np.hypot(out_x, out_y)
    long = np.maximum(size, 1e-300)
    out_x, out_y = out_x / long, out_y / long
    in_x, in_y = out_x[before], out_y[before]
    both_x, both_y = -in_y - out_y, in_x + out_x  # the two normals' sum: the bisector
    denominator = np.maximum(1.0 + (in_y * out_y + in_x * out_x), 1e-9)
    shift_x, shift_y = skin_m * both_x / denominator, skin_m * both_y / denominator
    cap = np.minimum(20.0 * skin_m, 0.25 * np.minimum(size, size[before]))
    share = np.minimum(1.0, cap / np.maximum(np.hypot(shift_x, shift_y), 1e-15))
    moved_x, moved_y = x + shift_x * share, y + shift_y * share
    convex = in_x * out_y - in_y * out_x > 1e-9
    far = np.maximum(np.hypot(both_x[convex], both_y[convex]), 1e-12)
    return (
        np.column_stack([moved_x, moved_y, moved_x[after], moved_y[after]]),
        np.column_stack([x[convex], y[convex]]),
        np.column_stack([-(both_x[convex] / far), -(both_y[convex] / far)]),
    )


def _after(owner: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the index of the next vertex of the same ring; ``owner`` is the ring of each, in order."""
    after = np.arange(1, len(owner) + 1)
    ends = np.nonzero(np.append(owner[1:] != owner[:-1], True))[0]
    after[ends] = np.concatenate([[0], ends[:-1] + 1])
    return after


def _part_touching(q: Floats, after: NDArray[np.int64]) -> None:
    """Link vertices that stand on one point anew, in place, so that each ring goes round one wedge of the solid there.

    Where water meets itself in one point (obstacles that touch each other and the fence), its rings turn round the
    water, and moved into the solid they would close the point. A path may pass through it: touching is allowed.
    """
    in_order = np.sort(q[:, 0])
    if not np.any(in_order[1:] == in_order[:-1]):
        return
    _, inverse, times = np.unique(q[:, 0] + 1j * q[:, 1], return_inverse=True, return_counts=True)
    shared = np.nonzero(times[inverse.ravel()] > 1)[0]
    if not len(shared):
        return
    before = np.empty_like(after)
    before[after] = np.arange(len(after))
    groups: dict[int, list[int]] = {}
    for i in shared.tolist():
        groups.setdefault(int(inverse.ravel()[i]), []).append(i)
    for group in groups.values():
        at = q[group]
        came, goes = q[before[group]] - at, q[after[group]] - at
        # Seen from the point the solid lies clockwise of the edge that comes in, up to the next that goes out.
        turn = np.arctan2(came[:, 1], came[:, 0])[:, None] - np.arctan2(goes[:, 1], goes[:, 0])[None, :]
        turn = np.mod(turn, 2.0 * math.pi)
        turn[turn < 1e-9] = 2.0 * math.pi
        nearest = np.argmin(turn, axis=1)
        if len(set(nearest.tolist())) == len(group):
            after[group] = after[np.asarray(group)[nearest]]


def _rings(
    p: Problem, solids: list[shapely.Geometry], fence: shapely.Geometry | None
) -> tuple[Floats, NDArray[np.int64]]:
    """Return the vertices of all boundaries in the wind frame, the solid on the left, and the ring of each."""
    outer = [] if fence is None else polygons(fence)
    shapes = [
        *shapely.orient_polygons(np.asarray(solids, dtype=object)),  # exterior counter-clockwise
        *shapely.orient_polygons(np.asarray(outer, dtype=object), exterior_cw=True),  # here the solid is outside
    ]
    points, owner = shapely.get_coordinates(shapely.get_rings(np.asarray(shapes, dtype=object)), return_index=True)
    inner = np.flatnonzero(owner[1:] == owner[:-1])  # all but the end, which is the begin
    return to_wind(p, points.take(inner, axis=0)), owner.take(inner)


def make_grid(edges: Floats) -> SegmentGrid:
    """Return the segments in a uniform grid of about two cells a segment, a million at most."""
    if len(edges) == 0:
        return SegmentGrid(0.0, 0.0, 1.0, 1, 1, np.zeros(2, np.int32), np.empty(0, np.int32), edges)
    x, y = edges[:, 0], edges[:, 1]  # each end of a segment begins another
    x0, x1, y0, y1 = float(x.min()), float(x.max()), float(y.min()), float(y.max())
    width, height = max(x1 - x0, 1e-3), max(y1 - y0, 1e-3)
    cells = min(1_000_000, max(256, 4 * len(edges)))
    size = max(math.sqrt(width * height / cells), max(width, height) / 4096.0)
    nx, ny = int(width / size) + 1, int(height / size) + 1
    start, item = rasterise(edges, x0, y0, 1.0 / size, nx, ny)
    return SegmentGrid(x0, y0, 1.0 / size, nx, ny, start, item, edges)


def _best_angles(p: Problem) -> tuple[float, float]:
    """Return the |TWA| of the best way made good up wind and down wind, no-go zone apart."""
    b = p.boat
    angles = np.concatenate([np.linspace(0.0, math.pi, 3601), np.clip(b.polar_twa_rad, 0.0, math.pi)])
    angles.sort(kind="stable")
    made = np.interp(angles, b.polar_twa_rad, b.polar_mps) * np.cos(angles)
    up = angles[angles >= b.no_go_half_rad - 1e-12]
    down = angles[angles <= b.max_twa_rad + 1e-12]
    best_up = float(up[int(np.argmax(made[angles >= b.no_go_half_rad - 1e-12]))]) if len(up) else math.pi
    best_down = float(down[int(np.argmin(made[: len(down)]))]) if len(down) else 0.0
    return best_up, min(best_down, b.max_twa_rad)


def make_boat(p: Problem) -> BoatModel:
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
        rows.append((*xy, *v, *t.row()[4:]))
    up, down = _best_angles(p)
    return BoatModel(
        np.asarray(b.polar_twa_rad, np.float64),
        np.asarray(b.polar_mps, np.float64),
        b.turn_rate_radps,
        b.no_go_half_rad,
        b.max_twa_rad,
        s.number if p.is_time_varying or s.model == "forecast" else 0,
        s.sigma0_rad,
        s.later,
        s.rho_hz,
        p.k_delta,
        horizon,
        width,
        b.tack_loss_s,
        b.gybe_loss_s,
        p.current.drift_mps * math.sin(angle),
        p.current.drift_mps * math.cos(angle),
        up,
        down,
        np.asarray(rows, np.float64).reshape(-1, 8),
        b.can_tack,
        b.room_m,
        b.most_turn_rad,
        _round_s(p, up),
        *_zone(p),
    )._replace(base=_constant_base(p))


def _zone(p: Problem) -> tuple[float, float, float]:
    """Return where the autopilot's zone is in the wind frame, its half angle and the open one; 0 without one."""
    if p.zone is None or p.current.drift_mps == 0.0:
        return 0.0, 0.0, 0.0
    return wrap_pi(p.zone.from_rad - p.wind.twd_from_rad), p.zone.half_rad, p.zone.open_half_rad


def _round_s(p: Problem, up_rad: float) -> float:
    """Return about how long the legs of a turn the long way round take [s]: one of the room, two that lead to it."""
    b = p.boat
    slowest = max(1e-3 * max(b.polar_mps), min(b.speed_mps(up_rad), b.speed_mps(b.max_twa_rad)))
    return 3.0 * b.room_m / slowest


def _constant_base(p: Problem) -> float:
    """Return the boat's no-go half angle, widened already where the widening does not change with time."""
    constant = not p.is_time_varying and p.wind.sigma.model != "forecast"
    return p.boat.no_go_half_rad + (p.widening_rad(0.0) if constant else 0.0)


def make_world(p: Problem) -> SearchWorld:
    """Return ``p`` ready for the search. ``p.defect`` must be None."""
    solids, fence, tangled = merged_solids(p)
    # What is not united must not be moved apart either, and its corners may lie inside its neighbours.
    skin_m = SKIN_M if _is_open(solids, fence, p.start_en) and _is_open(solids, fence, p.goal_en) else DEEP_SKIN_M
    edges, corners, outward = boundary_edges(*_rings(p, solids, fence), 0.0 if tangled else skin_m)
    if tangled:
        corners, outward = np.empty((0, 2)), np.empty((0, 2))
    marks = shapely.get_coordinates(shapely.point_on_surface(np.asarray(solids, dtype=object))).reshape(-1, 2)
    gx, gy = to_wind(p, np.asarray([p.goal_en]))[0].tolist()
    x, y = np.append(edges[:, 0], (0.0, gx)), np.append(edges[:, 1], (0.0, gy))
    return SearchWorld(
        problem=p,
        grid=make_grid(edges),
        boat=make_boat(p),
        corners=corners,
        outward=outward,
        marks=np.ascontiguousarray(to_wind(p, marks)),
        goal=(gx, gy),
        goal_radius=p.goal_radius_m,
        h0=(p.start_heading_rad - p.wind.twd_from_rad + math.pi) % (2.0 * math.pi) - math.pi,
        box=(float(x.min()), float(y.min()), float(x.max()), float(y.max())),
        fence_box=fence is not None,
        solids=tuple(solids),
        free=fence,
    )
