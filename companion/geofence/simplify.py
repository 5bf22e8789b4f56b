"""Polygons of few vertices round or inside others: what an autopilot with 84 items can hold.

Rings are reduced by two moves that each only add area on the outer side: drop a vertex that points inward, or drop
an edge and let its neighbours meet. A move is taken if the triangle that it adds is allowed, cheapest first, so
the result contains the ring by construction; callers prove it again with shapely.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry import Polygon
from shapely.geometry.base import BaseGeometry

Ring = NDArray[np.float64]  # (n, 2), open
MAX_START_VERTICES = 150    # longer rings are thinned first
MAX_REDUCED_VERTICES = 600  # what is still longer then is no shape for 84 items


def reduce_ring(ring: Ring, may_add: Callable[[Polygon], bool]) -> Ring:
    """Return a ring with fewer vertices whose left side holds all of the left side of ``ring``.

    A counter-clockwise ring grows, a clockwise one shrinks (its left side is the outside). ``may_add`` judges each
    triangle that a move would add. The result is simple if ``ring`` is.
    """
    points = [(float(x), float(y)) for x, y in ring]
    refused: set[tuple[tuple[float, float], ...]] = set()
    while len(points) > 3:
        for _, key, triangle, changed in sorted(_moves(points), key=lambda m: (m[0], m[1])):
            if key in refused:
                continue
            if _acceptable(triangle, changed, may_add):
                points = changed
                break
            refused.add(key)
        else:
            break
    return np.array(points)


def _acceptable(
    triangle: list[tuple[float, float]], changed: list[tuple[float, float]], may_add: Callable[[Polygon], bool],
) -> bool:
    polygon = Polygon(triangle)
    if polygon.area > 0.0 and not may_add(polygon):
        return False
    return bool(shapely.is_simple(shapely.linearrings(changed))) and bool(shapely.is_valid(Polygon(changed)))


_Move = tuple[float, tuple[tuple[float, float], ...], list[tuple[float, float]], list[tuple[float, float]]]


def _moves(points: list[tuple[float, float]]) -> list[_Move]:
    """Return (area added, key, triangle, new ring) of every move."""
    n = len(points)
    turns = [_cross(points[i - 1], points[i], points[(i + 1) % n]) for i in range(n)]
    out: list[_Move] = []
    for i in range(n):
        a, b, c, d = points[i - 1], points[i], points[(i + 1) % n], points[(i + 2) % n]
        if turns[i] <= 0.0:
            out.append((-turns[i] / 2.0, (a, b, c), [a, b, c], points[:i] + points[i + 1:]))
        elif turns[(i + 1) % n] > 0.0 and n > 3:
            meet = _meeting(a, b, c, d)
            if meet is not None:
                changed = list(points)
                changed[i] = meet
                del changed[(i + 1) % n]
                out.append((abs(_cross(b, meet, c)) / 2.0, (a, b, c, d), [b, meet, c], changed))
    return out


def _cross(a: tuple[float, float], b: tuple[float, float], c: tuple[float, float]) -> float:
    return (b[0] - a[0]) * (c[1] - b[1]) - (b[1] - a[1]) * (c[0] - b[0])


def _meeting(
    a: tuple[float, float], b: tuple[float, float], c: tuple[float, float], d: tuple[float, float],
) -> tuple[float, float] | None:
    """Return where a→b and d→c meet beyond b and c, None if they do not."""
    ux, uy, vx, vy = b[0] - a[0], b[1] - a[1], c[0] - d[0], c[1] - d[1]
    determinant = ux * vy - uy * vx
    if abs(determinant) < 1e-12 * math.hypot(ux, uy) * math.hypot(vx, vy) or determinant == 0.0:
        return None
    s = ((c[0] - b[0]) * vy - (c[1] - b[1]) * vx) / determinant
    w = ((c[0] - b[0]) * uy - (c[1] - b[1]) * ux) / determinant  # b + s u = c + w v
    return (b[0] + s * ux, b[1] + s * uy) if s > 0.0 and w > 0.0 else None


def grown_polygon(polygon: Polygon, reserve: float, tolerance: float, allowed: BaseGeometry) -> Polygon | None:
    """Return a polygon of few vertices that holds ``polygon`` with ``reserve`` to spare, inside ``allowed``.

    Holes are filled. None when not even the polygon with its reserve fits.
    """
    start = shapely.buffer(Polygon(polygon.exterior), reserve, join_style="mitre", mitre_limit=2.0)
    if len(start.exterior.coords) > MAX_START_VERTICES:
        start = _thinned(start, tolerance, inward=False)
    shapely.prepare(allowed)
    start = Polygon(shapely.normalize(start).exterior)
    if not shapely.covers(allowed, start) or len(start.exterior.coords) > MAX_REDUCED_VERTICES:
        return None
    ring = np.asarray(shapely.geometry.polygon.orient(start).exterior.coords)[:-1]
    return Polygon(reduce_ring(ring, lambda triangle: bool(shapely.covers(allowed, triangle))))


def shrunk_polygon(polygon: Polygon, reserve: float, tolerance: float, core: BaseGeometry) -> Polygon | None:
    """Return a polygon of few vertices inside ``polygon`` (by ``reserve``) that holds all of ``core``.

    Holes are not looked at. None when there is none.
    """
    shrunk = shapely.buffer(Polygon(polygon.exterior), -reserve, join_style="mitre", mitre_limit=2.0)
    pieces = [p for p in shapely.get_parts(shrunk) if isinstance(p, Polygon) and not p.is_empty]
    start = next((p for p in pieces if shapely.covers(p, core)), None)
    if start is None:
        return None
    start = Polygon(start.exterior)
    if len(start.exterior.coords) > MAX_START_VERTICES:
        start = _thinned(start, tolerance, inward=True)
        if not shapely.covers(start, core) or len(start.exterior.coords) > MAX_REDUCED_VERTICES:
            return None
    shapely.prepare(core)
    ring = np.asarray(shapely.geometry.polygon.orient(start, -1.0).exterior.coords)[:-1]
    return Polygon(reduce_ring(ring, lambda triangle: bool(shapely.disjoint(core, triangle))))


def _thinned(polygon: Polygon, tolerance: float, *, inward: bool) -> Polygon:
    """Return a coarser polygon between this one and half of the tolerance beyond it."""
    for share in (0.25, 0.1, 0.03):
        moved = shapely.buffer(polygon, -share * tolerance if inward else share * tolerance, quad_segs=2)
        pieces = sorted((p for p in shapely.get_parts(moved) if isinstance(p, Polygon)), key=lambda p: -p.area)
        if not pieces:
            continue
        # a chord of the buffer's corner may be cos(22.5 deg) of the distance away: simplify by less
        coarse = shapely.simplify(Polygon(pieces[0].exterior), 0.9 * share * tolerance, preserve_topology=True)
        if shapely.covers(polygon, coarse) if inward else shapely.covers(coarse, polygon):
            return coarse
    return polygon


def enclosing_circle(polygon: Polygon) -> tuple[float, float, float]:
    """Return x, y, radius of the smallest circle round the polygon."""
    circle = shapely.minimum_bounding_circle(polygon)
    x, y = circle.centroid.coords[0] if circle.geom_type == "Polygon" else circle.coords[0]
    vertices = np.asarray(polygon.exterior.coords)[:, :2]
    radius = float(np.max(np.hypot(vertices[:, 0] - x, vertices[:, 1] - y)))
    return float(x), float(y), radius


def circle_round(x: float, y: float, radius: float, *, inside: bool = False) -> Polygon:
    """Return a polygon that holds the circle, or one inside it, at most 5 mm off."""
    sides = max(16, math.ceil(math.pi / math.sqrt(2.0 * 0.005 / radius)))
    turns = 2.0 * math.pi * np.arange(sides) / sides
    outer = radius if inside else radius / math.cos(math.pi / sides)
    return Polygon(np.column_stack([x + outer * np.cos(turns), y + outer * np.sin(turns)]))
