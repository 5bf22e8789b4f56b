"""Polygons on a grid: crossing, containment and distance of many segments and points in one call.

``PolygonIndex`` sorts the edges of a set of polygons into the cells of a uniform grid. A segment walks the cells it
passes (Amanatides and Woo 1987) and meets only their edges; a point counts crossings on the way to its cell's
middle, of which it is known whether it lies inside. Closed semantics, as ``shapely.intersects``: touching counts.
Floating point: decisions within about 1e-9 of the extent of a boundary may go either way, so a plan that is
accepted is checked again with shapely.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray
from shapely.geometry.base import BaseGeometry

from companion.kernels.jit import kernel

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

MAX_CELLS = 1 << 20
CELLS_PER_EDGE = 4.0


EdgeTables = tuple[Floats, Ints, Floats, NDArray[np.bool_]]
"""What kernels ask of polygons: the cells' edges, where each cell's begin, the grid, which middles are inside."""


class PolygonIndex:
    """The union of some polygons [m], ready for many queries. Build it once; it never changes."""

    def __init__(self, polygons: Sequence[BaseGeometry]) -> None:
        """Index polygons or multipolygons (x east, y north); none at all is a plain sea."""
        self.union = shapely.union_all(list(polygons)) if len(polygons) else shapely.MultiPolygon()
        edges = _edges(self.union)
        self._edges = edges
        if edges.shape[0] == 0:
            self._grid = np.array([0.0, 0.0, 1.0, 1.0, 1.0])
            self._start, self._packed = np.zeros(2, dtype=np.int64), np.zeros((0, 4))
            self._middle_inside = np.zeros(1, dtype=np.bool_)
            return
        low = np.minimum(edges[:, :2], edges[:, 2:]).min(axis=0)
        high = np.maximum(edges[:, :2], edges[:, 2:]).max(axis=0)
        size = np.maximum(high - low, 1e-6)
        wanted = min(float(MAX_CELLS), max(16.0, CELLS_PER_EDGE * edges.shape[0]))
        cell = math.sqrt(float(size[0] * size[1]) / wanted)
        cell = max(cell, float(size.max()) / 2048.0)
        columns, rows = (math.ceil(float(s) / cell) + 1 for s in size)
        origin = low - 0.5 * (np.array([columns, rows]) * cell - size)
        self._grid = np.array([origin[0], origin[1], cell, float(columns), float(rows)])
        self._start, members = _sort_into_cells(edges, self._grid)
        self._packed = np.ascontiguousarray(edges[members])  # each cell's edges side by side
        middles = np.stack(
            np.meshgrid(origin[0] + (np.arange(columns) + 0.5) * cell, origin[1] + (np.arange(rows) + 0.5) * cell),
            axis=-1,
        ).reshape(-1, 2)
        shapely.prepare(self.union)
        self._middle_inside = np.asarray(shapely.contains_xy(self.union, middles[:, 0], middles[:, 1]), dtype=np.bool_)

    @property
    def edge_count(self) -> int:
        """The number of edges."""
        return int(self._edges.shape[0])

    @property
    def tables(self) -> EdgeTables:
        """What a kernel asks with: ``meets_any``."""
        return self._packed, self._start, self._grid, self._middle_inside

    def intersects(self, segments: ArrayLike) -> NDArray[np.bool_]:
        """Return which segments, an (n, 4) array of x0, y0, x1, y1 [m], touch or enter a polygon."""
        wanted = np.ascontiguousarray(np.asarray(segments, dtype=np.float64).reshape(-1, 4))
        return _intersects(wanted, self.tables)

    def contains(self, points: ArrayLike) -> NDArray[np.bool_]:
        """Return which points, an (n, 2) array [m], lie inside a polygon."""
        wanted = np.ascontiguousarray(np.asarray(points, dtype=np.float64).reshape(-1, 2))
        return _contains(wanted, self._packed, self._start, self._grid, self._middle_inside)

    def distance_m(self, points: ArrayLike) -> Floats:
        """Return each point's distance to the nearest boundary [m], negative inside; inf without polygons."""
        wanted = np.ascontiguousarray(np.asarray(points, dtype=np.float64).reshape(-1, 2))
        if self.edge_count == 0:
            return np.full(wanted.shape[0], np.inf)
        return _signed_distance(wanted, self._packed, self._start, self._grid, self._middle_inside)


def _edges(union: BaseGeometry) -> Floats:
    """Return the edges of all rings as (m, 4)."""
    rings = shapely.get_rings(shapely.get_parts(union))
    out = []
    for ring in rings:
        xy = shapely.get_coordinates(ring)
        out.append(np.hstack([xy[:-1], xy[1:]]))
    return np.ascontiguousarray(np.vstack(out)) if out else np.zeros((0, 4))


@kernel
def _sort_into_cells(edges: Floats, grid: Floats) -> tuple[Ints, Ints]:
    """Return the edges of each cell in compressed rows: start (cells + 1) and members."""
    columns, rows = int(grid[3]), int(grid[4])
    counts = np.zeros(columns * rows + 1, dtype=np.int64)
    total = 0
    for turn in range(2):
        if turn == 1:
            for c in range(columns * rows):
                counts[c + 1] += counts[c]
            total = counts[columns * rows]
            members = np.zeros(total, dtype=np.int64)
            fill = counts.copy()
        for e in range(edges.shape[0]):
            x0, y0, x1, y1 = edges[e]
            slack = 1e-6 * grid[2]
            c0 = max(0, math.floor((min(x0, x1) - slack - grid[0]) / grid[2]))
            c1 = min(columns - 1, math.floor((max(x0, x1) + slack - grid[0]) / grid[2]))
            r0 = max(0, math.floor((min(y0, y1) - slack - grid[1]) / grid[2]))
            r1 = min(rows - 1, math.floor((max(y0, y1) + slack - grid[1]) / grid[2]))
            dx, dy = x1 - x0, y1 - y0
            reach = (abs(dx) + abs(dy)) * (0.5 * grid[2] + slack)
            for r in range(r0, r1 + 1):
                cy = grid[1] + (r + 0.5) * grid[2]
                for c in range(c0, c1 + 1):
                    cx = grid[0] + (c + 0.5) * grid[2]
                    if abs(dx * (cy - y0) - dy * (cx - x0)) <= reach:
                        if turn == 0:
                            counts[r * columns + c + 1] += 1
                        else:
                            members[fill[r * columns + c]] = e
                            fill[r * columns + c] += 1
    return counts, members


@kernel
def _side(ax: float, ay: float, bx: float, by: float, px: float, py: float) -> float:
    return (bx - ax) * (py - ay) - (by - ay) * (px - ax)


@kernel
def _meet(ax: float, ay: float, bx: float, by: float, edge: Floats, k: int) -> bool:
    """Whether a closed segment shares a point with edge ``k``."""
    cx, cy, dx, dy = edge[k, 0], edge[k, 1], edge[k, 2], edge[k, 3]
    if max(ax, bx) < min(cx, dx) or max(cx, dx) < min(ax, bx):
        return False
    if max(ay, by) < min(cy, dy) or max(cy, dy) < min(ay, by):
        return False
    s0, s1 = _side(ax, ay, bx, by, cx, cy), _side(ax, ay, bx, by, dx, dy)
    if (s0 > 0.0 and s1 > 0.0) or (s0 < 0.0 and s1 < 0.0):
        return False
    t0, t1 = _side(cx, cy, dx, dy, ax, ay), _side(cx, cy, dx, dy, bx, by)
    return not ((t0 > 0.0 and t1 > 0.0) or (t0 < 0.0 and t1 < 0.0))


@kernel
def _inside(px: float, py: float, edges: Floats, start: Ints, grid: Floats, middle: NDArray[np.bool_]) -> bool:
    """Whether a point lies inside: the state of its cell's middle, turned by each edge on the way there."""
    columns, rows = int(grid[3]), int(grid[4])
    c = math.floor((px - grid[0]) / grid[2])
    r = math.floor((py - grid[1]) / grid[2])
    if c < 0 or r < 0 or c >= columns or r >= rows:
        return False
    cell = r * columns + c
    inside = bool(middle[cell])
    mx, my = grid[0] + (c + 0.5) * grid[2], grid[1] + (r + 0.5) * grid[2]
    for k in range(start[cell], start[cell + 1]):
        ax, ay, bx, by = edges[k, 0], edges[k, 1], edges[k, 2], edges[k, 3]
        # Half-open on both lines, so that a vertex on the way counts once.
        sa = _side(px, py, mx, my, ax, ay) > 0.0
        sb = _side(px, py, mx, my, bx, by) > 0.0
        if sa != sb:
            sp = _side(ax, ay, bx, by, px, py) > 0.0
            sm = _side(ax, ay, bx, by, mx, my) > 0.0
            if sp != sm:
                inside = not inside
    return inside


@kernel
def _contains(points: Floats, edges: Floats, start: Ints, grid: Floats, middle: NDArray[np.bool_]) -> NDArray[np.bool_]:
    out = np.zeros(points.shape[0], dtype=np.bool_)
    for i in range(points.shape[0]):
        out[i] = _inside(points[i, 0], points[i, 1], edges, start, grid, middle)
    return out


@kernel
def meets_any(ax: float, ay: float, bx: float, by: float, tables: EdgeTables) -> bool:
    """Return whether a segment touches or enters a polygon."""
    edges, start, grid, middle = tables
    columns, rows, cell_m = int(grid[3]), int(grid[4]), grid[2]
    width, height = columns * cell_m, rows * cell_m
    # Clip to the grid: outside it there is only water (Liang and Barsky 1984).
    t0, t1 = 0.0, 1.0
    dx, dy = bx - ax, by - ay
    clipped = False
    for side in range(4):
        if side == 0:
            p, q = -dx, ax - grid[0]
        elif side == 1:
            p, q = dx, grid[0] + width - ax
        elif side == 2:
            p, q = -dy, ay - grid[1]
        else:
            p, q = dy, grid[1] + height - ay
        if p == 0.0:
            clipped = clipped or q < 0.0
        elif p < 0.0:
            t0 = max(t0, q / p)
        else:
            t1 = min(t1, q / p)
    if clipped or t0 > t1:
        return False
    sx, sy, ex, ey = ax + t0 * dx, ay + t0 * dy, ax + t1 * dx, ay + t1 * dy
    c = min(columns - 1, max(0, math.floor((sx - grid[0]) / cell_m)))
    r = min(rows - 1, max(0, math.floor((sy - grid[1]) / cell_m)))
    ce = min(columns - 1, max(0, math.floor((ex - grid[0]) / cell_m)))
    re = min(rows - 1, max(0, math.floor((ey - grid[1]) / cell_m)))
    step_c, step_r = (1 if dx > 0.0 else -1), (1 if dy > 0.0 else -1)
    next_x = grid[0] + (c + (1 if dx > 0.0 else 0)) * cell_m
    next_y = grid[1] + (r + (1 if dy > 0.0 else 0)) * cell_m
    tx = (next_x - ax) / dx if dx != 0.0 else math.inf
    ty = (next_y - ay) / dy if dy != 0.0 else math.inf
    jump_x = abs(cell_m / dx) if dx != 0.0 else math.inf
    jump_y = abs(cell_m / dy) if dy != 0.0 else math.inf
    for _ in range(abs(ce - c) + abs(re - r) + 1):
        cell = r * columns + c
        for k in range(start[cell], start[cell + 1]):
            if _meet(ax, ay, bx, by, edges, k):
                return True
        if tx < ty:
            c += step_c
            tx += jump_x
        else:
            r += step_r
            ty += jump_y
        if c < 0 or r < 0 or c >= columns or r >= rows:
            break
    # No edge met: the whole segment is inside or outside.
    return bool(_inside(ax, ay, edges, start, grid, middle))


@kernel
def enters_disc(x: float, y: float, dx: float, dy: float, disc: Floats) -> float:
    """Return the share of a move from (x, y) at which it enters a disc (x, y, radius); 2: it does not."""
    px, py = x - disc[0], y - disc[1]
    out = px * px + py * py - disc[2] * disc[2]
    if out <= 0.0:
        return 0.0
    a, b = dx * dx + dy * dy, px * dx + py * dy
    under = b * b - a * out
    if a <= 0.0 or b >= 0.0 or under < 0.0:
        return 2.0
    share = (-b - math.sqrt(under)) / a
    return share if share <= 1.0 else 2.0


@kernel
def _intersects(segments: Floats, tables: EdgeTables) -> NDArray[np.bool_]:
    out = np.zeros(segments.shape[0], dtype=np.bool_)
    for i in range(segments.shape[0]):
        out[i] = meets_any(segments[i, 0], segments[i, 1], segments[i, 2], segments[i, 3], tables)
    return out


@kernel
def _distance2(px: float, py: float, edge: Floats, k: int) -> float:
    ax, ay, bx, by = edge[k, 0], edge[k, 1], edge[k, 2], edge[k, 3]
    dx, dy = bx - ax, by - ay
    length2 = dx * dx + dy * dy
    t = 0.0 if length2 == 0.0 else min(1.0, max(0.0, ((px - ax) * dx + (py - ay) * dy) / length2))
    ox, oy = px - ax - t * dx, py - ay - t * dy
    return float(ox * ox + oy * oy)


@kernel
def _signed_distance(points: Floats, edges: Floats, start: Ints, grid: Floats, middle: NDArray[np.bool_]) -> Floats:
    """Search rings of cells round each point until no nearer edge is possible."""
    columns, rows, cell_m = int(grid[3]), int(grid[4]), grid[2]
    out = np.empty(points.shape[0])
    for i in range(points.shape[0]):
        px, py = points[i, 0], points[i, 1]
        c0 = math.floor((px - grid[0]) / cell_m)
        r0 = math.floor((py - grid[1]) / cell_m)
        best = math.inf
        # From outside the grid the first rings are empty: begin where the grid does.
        ring = max(0, -c0, c0 - columns + 1, -r0, r0 - rows + 1)
        while True:
            low_c, high_c, low_r, high_r = c0 - ring, c0 + ring, r0 - ring, r0 + ring
            for r in range(max(0, low_r), min(rows - 1, high_r) + 1):
                whole = r in (low_r, high_r)
                c = max(0, low_c)
                while c <= min(columns - 1, high_c):
                    if whole or c in (low_c, high_c):
                        cell = r * columns + c
                        for k in range(start[cell], start[cell + 1]):
                            best = min(best, _distance2(px, py, edges, k))
                        c += 1
                    else:  # inside the ring: on to its far side
                        c = max(c + 1, high_c)
            # Everything in the rings searched is known; the next ring is at least this far away.
            reach = min(
                px - (grid[0] + low_c * cell_m),
                grid[0] + (high_c + 1) * cell_m - px,
                py - (grid[1] + low_r * cell_m),
                grid[1] + (high_r + 1) * cell_m - py,
            )
            if best <= reach * reach:
                break
            if low_c <= 0 and low_r <= 0 and high_c >= columns - 1 and high_r >= rows - 1:
                break
            ring += 1
        distance = math.sqrt(best)
        out[i] = -distance if _inside(px, py, edges, start, grid, middle) else distance
    return out
