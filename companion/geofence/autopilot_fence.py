"""The autopilot's own fence: the area in the 84 items that ArduRover holds, as its last line of defence.

Every keep-out zone holds its obstacles and stays inside what the planner keeps clear of; the keep-in zone lies
inside the limits and holds all water that the planner may use. So the fence never lets through what the files
forbid, and never stops a boat that is where its plan may put it. Both halves are proved on the items' own integers
(``prove``), in the plane of longitude and latitude in which ArduPilot draws its polygons.

Of a chart's obstacles there may be more than that holds: then it is what lies within some distance of the straight way
through the places (``reach_m``), as far as the items suffice, and land is cut there. What lies farther off is not held.

Rings are reduced by two moves that each only add area on the outer side: drop a vertex that points inward, or drop
an edge and let its neighbours meet. A move is taken if the triangle that it adds is allowed, cheapest first, so
the result contains the ring by construction.
"""

from __future__ import annotations

import enum
import heapq
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry import MultiPolygon, Polygon
from shapely.geometry.base import BaseGeometry

from companion.geofence.area import Area, buffer_out, parts
from companion.geofence.document import FindingLevel
from companion.geofence.formats.fence_items import (
    MAX_FENCE_ITEMS,
    STORAGE_BYTES,
    items_to_zones,
    storage_bytes,
    zones_to_items,
)
from companion.geofence.formats.rings import Findings
from companion.geofence.shapes import Circle, Obstacle, Shape, Zone, ZoneKind, center_of, wrap_lon_deg
from companion.messages import GeoPoint, MissionItem

Ring = NDArray[np.float64]  # (n, 2), open
MAX_START_VERTICES = 150  # longer rings are thinned first
MAX_REDUCED_VERTICES = 600  # what is still longer then is no shape for 84 items


def reduce_ring(ring: Ring, may_add: Callable[[Polygon], bool]) -> Ring:
    """Return a ring with fewer vertices whose left side holds all of the left side of ``ring``.

    A counter-clockwise ring grows, a clockwise one shrinks (its left side is the outside). ``may_add`` judges each
    triangle that a move would add. The result is simple if ``ring`` is.
    """
    corners = np.empty((2 * len(ring), 2))  # each that there ever was, by its number: an edge's move makes one of two
    corners[: len(ring)] = ring
    count, order = len(ring), list(range(len(ring)))
    refused: set[tuple[_Point, ...]] = set()
    offered: list[tuple[float, tuple[_Point, ...], list[int], _Point | None]] = []

    def offer(at: int) -> None:
        around = [order[(at + k) % len(order)] for k in (-1, 0, 1, 2)]
        a, b, c, d = ((float(x), float(y)) for x, y in corners[around])
        move = _move(a, b, c, d)
        if move is not None:
            area, key, meet = move
            heapq.heappush(offered, (area, key, around[: len(key)], meet))

    for at in range(len(order)):
        offer(at)
    # Corners come only in the place of others, so those that are all still there are still neighbours.
    there = set(order)
    while len(order) > 3 and offered:
        _, key, around, meet = heapq.heappop(offered)
        if key in refused or not there.issuperset(around):
            continue
        at, changed = order.index(around[1]), list(order)
        if meet is None:
            del changed[at]
            triangle = list(key)
        else:
            changed[at], corners[count] = count, meet
            del changed[(at + 1) % len(order)]
            triangle = [key[1], meet, key[2]]
        if not _acceptable(triangle, corners[changed], may_add):
            refused.add(key)
            continue
        if meet is not None:
            at = changed.index(count)
            count += 1
        order, there = changed, set(changed)
        for near in range(at - 2, at + 2):
            offer(near)
    return corners[order]


_Point = tuple[float, float]


def _acceptable(triangle: list[_Point], changed: Ring, may_add: Callable[[Polygon], bool]) -> bool:
    polygon = shapely.polygons(triangle)
    if polygon.area > 0.0 and not may_add(polygon):
        return False
    outline = shapely.linearrings(changed)
    return bool(shapely.is_simple(outline)) and bool(shapely.is_valid(shapely.polygons(outline)))


def _move(a: _Point, b: _Point, c: _Point, d: _Point) -> tuple[float, tuple[_Point, ...], _Point | None] | None:
    """Return (area added, the corners that it rests on, what takes the place of b and c) of dropping b or b→c."""
    turn = _cross(a, b, c)
    if turn <= 0.0:
        return -turn / 2.0, (a, b, c), None
    meet = _meeting(a, b, c, d) if _cross(b, c, d) > 0.0 else None
    return None if meet is None else (abs(_cross(b, meet, c)) / 2.0, (a, b, c, d), meet)


def _cross(a: _Point, b: _Point, c: _Point) -> float:
    return (b[0] - a[0]) * (c[1] - b[1]) - (b[1] - a[1]) * (c[0] - b[0])


def _meeting(a: _Point, b: _Point, c: _Point, d: _Point) -> _Point | None:
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
    start = next((p for p in parts(shrunk) if shapely.covers(p, core)), None)
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
    """Return a coarser polygon between this one and two thirds of the tolerance beyond it."""
    for share in (0.25, 0.1, 0.03):
        moved = shapely.buffer(polygon, -share * tolerance if inward else share * tolerance, quad_segs=2)
        largest = max(parts(moved), key=lambda p: p.area, default=polygon)
        # a chord of the buffer's corner is cos(22.5 deg) of the distance away, seldom cos(33.7 deg), and where a ring
        # begins it may be simplified by half as much again: what does not hold is tried nearer
        coarse = shapely.simplify(Polygon(largest.exterior), 0.9 * share * tolerance)
        if shapely.covers(polygon, coarse) if inward else shapely.covers(coarse, polygon):
            return coarse
    return polygon


def enclosing_circle(polygon: Polygon) -> tuple[float, float, float]:
    """Return x, y, radius of the smallest circle round the polygon."""
    x, y = shapely.minimum_bounding_circle(polygon).centroid.coords[0]
    vertices = np.asarray(polygon.exterior.coords)[:, :2]
    radius = float(np.max(np.hypot(vertices[:, 0] - x, vertices[:, 1] - y)))
    return float(x), float(y), radius


def circle_round(x: float, y: float, radius: float, *, inside: bool = False) -> Polygon:
    """Return a polygon that holds the circle, or one inside it, at most 5 mm off."""
    sides = max(16, math.ceil(math.pi / math.sqrt(2.0 * 0.005 / radius)))
    turns = 2.0 * math.pi * np.arange(sides) / sides
    outer = radius if inside else radius / math.cos(math.pi / sides)
    return Polygon(np.column_stack([x + outer * np.cos(turns), y + outer * np.sin(turns)]))


# An area in the plane of longitude and latitude, scaled to metres, in which ArduPilot draws its fence.

AUTOPILOT_METRES_PER_DEGREE = 111_318.845  # ArduPilot's sphere (LATLON_TO_M), which draws its circles
EQUATOR_M, FLATTENING = 6_378_137.0, 1.0 / 298.257223563  # WGS 84


def metres_per_degree(lat_deg: float) -> NDArray[np.float64]:
    """Return the metres in a degree of longitude and of latitude, on the ellipsoid."""
    sin2 = math.sin(math.radians(lat_deg)) ** 2
    e2 = FLATTENING * (2.0 - FLATTENING)
    east = EQUATOR_M / math.sqrt(1.0 - e2 * sin2) * math.cos(math.radians(lat_deg))
    north = EQUATOR_M * (1.0 - e2) / (1.0 - e2 * sin2) ** 1.5
    return np.asarray(np.radians(np.array([east, north])))


@dataclass(frozen=True)
class Plane:
    """Longitude and latitude scaled to metres: straight lines stay straight, as on the autopilot.

    Lengths are wrong by at most ``error`` (a fraction) within the area, ArduPilot's own sphere included.
    """

    lat_deg: float
    lon_deg: float
    error: float

    @property
    def scale(self) -> NDArray[np.float64]:
        """Metres per degree of longitude and of latitude, on the ellipsoid."""
        return metres_per_degree(self.lat_deg)

    def metres(self, polygon: Polygon) -> Polygon:
        """Return a polygon of degrees in metres; longitudes are brought near the plane's."""

        def scaled(coordinates: NDArray[np.float64]) -> NDArray[np.float64]:
            lonlat = coordinates[:, :2] - np.array([self.lon_deg, self.lat_deg])
            lonlat[:, 0] -= 360.0 * np.round(np.median(lonlat[:, 0]) / 360.0)
            return np.asarray(lonlat * self.scale)

        return shapely.transform(shapely.force_2d(polygon), scaled)

    def point(self, point: GeoPoint) -> tuple[float, float]:
        """Return a place in the plane [m]."""
        lon = math.remainder(point.lon_deg - self.lon_deg, 360.0)
        x, y = np.array([lon, point.lat_deg - self.lat_deg]) * self.scale
        return float(x), float(y)

    def degrees(self, xy: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return (n, 2) places of the plane as longitude and latitude [deg]."""
        return np.asarray(xy / self.scale + np.array([self.lon_deg, self.lat_deg]))

    def geo(self, x: float, y: float) -> GeoPoint:
        """Return a place of the plane, rounded as on the wire."""
        lon, lat = self.degrees(np.array([[x, y]]))[0]
        return GeoPoint(lat_deg=round(float(lat), 7), lon_deg=wrap_lon_deg(round(float(lon), 7)))


def plane_of(area: Area, near: GeoPoint) -> Plane:
    """Return the plane of the area. The scale's error grows with tan(latitude) times the extent."""
    reach_deg = 0.0
    shapes = [o.shape for o in area.solids] + [z.shape for z in area.fence.inclusions]
    for shape in shapes:
        if isinstance(shape, Circle):
            lats = [shape.center.lat_deg - shape.radius_m / 1.1e5, shape.center.lat_deg + shape.radius_m / 1.1e5]
        else:
            lats = [float(shape.bounds[1]), float(shape.bounds[3])]
        reach_deg = max(reach_deg, *(abs(lat - near.lat_deg) for lat in lats))
    flat = math.tan(math.radians(min(85.0, abs(near.lat_deg) + reach_deg))) * math.radians(reach_deg)
    scale = metres_per_degree(near.lat_deg)
    cosine = np.array([math.cos(math.radians(near.lat_deg)), 1.0])
    sphere = float(np.max(np.abs(scale / (AUTOPILOT_METRES_PER_DEGREE * cosine) - 1.0)))
    return Plane(near.lat_deg, near.lon_deg, flat + sphere + 1e-4)


def shape_in(shape: Shape, plane: Plane, *, cover: bool) -> tuple[Polygon, tuple[float, float, float] | None]:
    """Return a shape in the plane; a circle as (x, y, radius) too, its polygon drawn around or inside."""
    if isinstance(shape, Circle):
        x, y = plane.point(shape.center)
        radius = shape.radius_m * (1.0 + plane.error if cover else 1.0 - plane.error)
        return circle_round(x, y, radius, inside=not cover), (x, y, radius)
    return plane.metres(shape), None


def limits_in(area: Area, plane: Plane, places: list[tuple[float, float]]) -> tuple[BaseGeometry | None, Circle | None]:
    """Return the piece of the keep-in zones' intersection that holds the start, and the circle if it is one."""
    limits: BaseGeometry | None = None
    for zone in area.fence.inclusions:
        polygon, _ = shape_in(zone.shape, plane, cover=False)
        if zone.margin_m:
            polygon = shapely.buffer(polygon, -zone.margin_m * (1.0 + plane.error))
        limits = polygon if limits is None else shapely.intersection(limits, polygon)
    if limits is None:
        return None, None
    here = shapely.points(places[0])
    piece = next((p for p in parts(limits) if shapely.covers(p, here)), Polygon())
    only = area.fence.inclusions[0] if len(area.fence.inclusions) == 1 else None
    rim = only.shape if only is not None and isinstance(only.shape, Circle) and not only.margin_m else None
    return piece, rim


def cut_by_rings(
    area: Area, plane: Plane, places: list[tuple[float, float]], limits: BaseGeometry | None, notes: list[str]
) -> BaseGeometry | None:
    """Return the limits cut to the hole of any obstacle that surrounds the start: a lake in its shore."""
    here = shapely.points(places[0])
    for obstacle in area.solids:
        polygon, _ = shape_in(obstacle.shape, plane, cover=True)
        for ring in polygon.interiors:
            if shapely.covers(Polygon(ring), here):
                hole = Polygon(ring)
                if obstacle.margin_m:
                    hole = shapely.buffer(hole, -obstacle.margin_m)
                limits = hole if limits is None else shapely.intersection(limits, hole)
                notes.append(f"the boat sails inside {obstacle.name or 'an obstacle'}: its shore is a keep-in zone")
    return limits


# The proof that fence items are a proper fence for an area, from the items' own integers.


def prove(
    area: Area, items: Sequence[MissionItem], margin_m: float, *, inside: Sequence[GeoPoint], reach_m: float = math.inf
) -> str:
    """Return why the items are not a proper fence for the area, "" when they are. Independent of how they were made.

    Checked with shapely on the items as they go to the autopilot: every obstacle that the keep-in zones leave in
    reach, and what of it lies within ``reach_m`` of the straight way through ``inside``, is covered by the keep-out
    zones; the keep-in zones lie inside the limits (with their holes as far as that); no keep-out zone reaches water
    farther than ``margin_m`` from every obstacle; all water of the start's piece that is ``margin_m`` inside the
    limits stays inside the keep-in zones; no place is shut out.
    """
    findings = Findings()
    zones, _ = items_to_zones(items, findings)
    for finding in findings:
        if finding.severity is FindingLevel.ERROR:
            return finding.text
    plane = plane_of(area, inside[0])
    slack_m = 1e-6
    keep_in: BaseGeometry | None = None
    for zone in zones:
        if zone.kind is ZoneKind.INCLUSION:
            outer, _ = shape_in(zone.shape, plane, cover=True)
            keep_in = outer if keep_in is None else shapely.intersection(keep_in, outer)
    out_small = shapely.union_all(
        [_inner(z.shape, plane) for z in zones if z.kind is ZoneKind.EXCLUSION] or [Polygon()]
    )
    obstacles = [(o, shape_in(o.shape, plane, cover=True)[0]) for o in area.solids]
    near: BaseGeometry | None = None
    if math.isfinite(reach_m):
        near = shapely.buffer(_way(plane, inside), reach_m * (1.0 + plane.error) * BAND_SPARE, quad_segs=32)
    for obstacle, polygon in obstacles:
        reach = polygon if keep_in is None else shapely.intersection(polygon, keep_in)
        reach = reach if near is None else shapely.intersection(reach, near)
        left = shapely.difference(reach, shapely.buffer(out_small, slack_m))
        if shapely.area(left) > slack_m * max(1.0, float(polygon.length)):
            return f"the keep-out zones do not hold {obstacle.name or 'an obstacle'}"
    for zone in area.fence.inclusions:
        polygon, _ = shape_in(zone.shape, plane, cover=False)
        if any(_within_rim(z, zone, margin_m, plane) for z in zones):
            continue
        if near is not None:
            polygon = shapely.union(polygon, shapely.difference(Polygon(polygon.exterior), near))
        reach = shapely.difference(keep_in, out_small) if keep_in is not None else None
        if reach is None or not shapely.covers(shapely.buffer(polygon, slack_m), reach):
            return f"the keep-in zone is not inside {zone.name or 'the limits'}"
    margin = shapely.union_all(
        [shapely.buffer(p, max(margin_m, o.margin_m or margin_m), quad_segs=16) for o, p in obstacles] or [Polygon()]
    )
    limits, _ = limits_in(area, plane, [plane.point(inside[0])])
    limits = cut_by_rings(area, plane, [plane.point(inside[0])], limits, [])
    useful: BaseGeometry | None = None
    if limits is not None:
        useful = shapely.buffer(limits, -margin_m, quad_segs=16)
        margin = shapely.union(margin, shapely.difference(shapely.box(*limits.buffer(1e4).bounds), useful))
    for zone in zones:
        outer, _ = shape_in(zone.shape, plane, cover=True)
        if zone.kind is ZoneKind.EXCLUSION and not shapely.covers(shapely.buffer(margin, slack_m), outer):
            return f"the keep-out zone {zone.name or center_of(zone.shape)} reaches beyond the planner's margin"
        inner = _inner(zone.shape, plane)
        if zone.kind is ZoneKind.EXCLUSION or useful is None:
            continue
        if not shapely.covers(shapely.buffer(inner, slack_m), _piece(useful, plane.point(inside[0]))):
            return "the keep-in zone shuts out water that the planner may use"
    for index, place in enumerate(inside):
        point = shapely.points(plane.point(place))
        shut = any(
            z.kind is ZoneKind.EXCLUSION and shapely.covers(shape_in(z.shape, plane, cover=True)[0], point)
            for z in zones
        )
        if shut or not all(_keeps_in(z, place, plane) for z in zones if z.kind is ZoneKind.INCLUSION):
            return f"the {'start' if index == 0 else f'goal {index}'} would be outside the autopilot's fence"
    return ""


def _keeps_in(zone: Zone, place: GeoPoint, plane: Plane) -> bool:
    """Whether a place lies in a keep-in zone as the autopilot measures it: from a circle's centre on its own sphere."""
    if not isinstance(zone.shape, Circle):
        return bool(shapely.covers(plane.metres(zone.shape), shapely.points(plane.point(place))))
    center = zone.shape.center
    middle_rad = math.radians(0.5 * (place.lat_deg + center.lat_deg))
    east_deg = math.remainder(place.lon_deg - center.lon_deg, 360.0) * math.cos(middle_rad)
    apart_m = AUTOPILOT_METRES_PER_DEGREE * math.hypot(east_deg, place.lat_deg - center.lat_deg)
    return apart_m <= zone.shape.radius_m


def _way(plane: Plane, places: Sequence[GeoPoint]) -> BaseGeometry:
    """Return the straight way through the places, a point where there is one only."""
    points = [plane.point(p) for p in places]
    return shapely.Point(points[0]) if len(points) == 1 else shapely.LineString(points)


def _within_rim(zone: Zone, rim: Zone, margin_m: float, plane: Plane) -> bool:
    """Whether a circle lies inside another by no more than the margin: their radii share one scale."""
    if not (isinstance(zone.shape, Circle) and isinstance(rim.shape, Circle)) or rim.margin_m:
        return False
    (x0, y0), (x1, y1) = plane.point(zone.shape.center), plane.point(rim.shape.center)
    apart_m = math.hypot(x1 - x0, y1 - y0) * (1.0 + plane.error)
    spare_m = rim.shape.radius_m - zone.shape.radius_m
    return zone.kind is ZoneKind.INCLUSION and apart_m <= spare_m <= margin_m - apart_m


def _piece(useful: BaseGeometry, place: tuple[float, float]) -> BaseGeometry:
    here = shapely.points(place)
    return next((p for p in parts(useful) if shapely.covers(p, here)), useful)


def _inner(shape: Shape, plane: Plane) -> Polygon:
    """Return a polygon inside the shape (a circle's is drawn inside it)."""
    return shape_in(shape, plane, cover=False)[0]


# How much of the margin a simplification may use: the least that fits leaves the most room between plan and fence.
STEPS = (0.25, 0.4, 0.55, 0.7, 0.85, 1.0)
REFINED = 4  # halvings of the span in which the largest reach lies
BAND_SPARE = 1.001  # a band that is drawn with 128 corners holds all that is so near
RESERVE_M = 0.03  # rounding to 1e-7 degrees moves a vertex by at most 8 mm; the rest is for edges


class FenceStatus(enum.Enum):
    """How the simplification ended."""

    OK = "ok"
    EMPTY = "empty"  # there is nothing to keep out of or inside of
    TOO_MANY_ITEMS = "too many items"  # not even at the whole margin
    NO_MARGIN = "no margin"  # the margin is too small for any zone to hold what it must
    START_ENCLOSED = "start enclosed"  # a zone would hold the start or a goal
    NO_WATER = "no water"  # the limits leave no water at the margin
    TOO_LARGE = "too large"  # the area is too wide to be flat


@dataclass(frozen=True, slots=True, kw_only=True)
class AutopilotFence:
    """The outcome: ``items`` for upload when ``status`` is OK, otherwise the ``reason``.

    ``used_m`` is how much of ``margin_m`` the zones stick out at most: a boat on its plan is at least
    ``margin_m - used_m`` from the fence. Obstacles are held as far as ``reach_m`` from the straight way through the
    places: all of them, or what the autopilot has room for.
    """

    status: FenceStatus
    reason: str
    margin_m: float
    used_m: float = 0.0
    reach_m: float = math.inf
    zones: tuple[Zone, ...] = ()
    items: tuple[MissionItem, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def left_out(self) -> str:
        """What the fence does not hold, in words; "" where it holds all."""
        if math.isinf(self.reach_m):
            return ""
        return f"only what lies within {self.reach_m:.0f} m of the straight way is in it: there is no room for more"


@dataclass(frozen=True)
class _Solid:
    name: str
    polygon: Polygon  # the obstacle itself; a circle's is drawn around it
    circle: tuple[float, float, float] | None
    margin_m: float  # what the planner keeps from it


def fence_for_autopilot(area: Area, margin_m: float, *, inside: Sequence[GeoPoint]) -> AutopilotFence:
    """Return the area as at most MAX_FENCE_ITEMS fence items, all of it or what lies nearest to the way.

    ``margin_m`` is what the planner keeps clear of obstacles and limits; ``inside`` are the places (start, goals)
    that the boat must be able to sail to, in their order, the first of them in the water that counts. Same input, same
    output.
    """

    def refuse(status: FenceStatus, reason: str) -> AutopilotFence:
        return AutopilotFence(status=status, reason=reason, margin_m=margin_m)

    if not area.solids and not area.fence.inclusions:
        return refuse(FenceStatus.EMPTY, "the area has neither obstacles nor a fence")
    plane = plane_of(area, inside[0])
    if plane.error > 0.1:
        return refuse(FenceStatus.TOO_LARGE, "the area reaches too far for a fence in one plane; cut it up")
    usable_m = margin_m / (1.0 + plane.error)
    if usable_m < 4.0 * RESERVE_M:
        return refuse(FenceStatus.NO_MARGIN, f"a margin of {margin_m:g} m leaves no room to simplify in")
    places = [plane.point(p) for p in inside]
    limits, rim = limits_in(area, plane, places)
    solids, notes = _solids(area, plane, places, limits, margin_m)
    limits = cut_by_rings(area, plane, places, limits, notes)
    if limits is not None and limits.is_empty:
        return refuse(FenceStatus.NO_WATER, "the start is not inside the fence")
    way = _way(plane, inside)

    def made(reach_m: float, steps: Sequence[float], most_items: float = MAX_FENCE_ITEMS) -> AutopilotFence:
        """Return the fence of what lies so near to the way, with the least of the margin that is enough for it."""
        around, held = _near(solids, way, reach_m * (1.0 + plane.error))
        status, last = FenceStatus.NO_MARGIN, ""
        for step in steps:
            zones, last = _attempt(plane, around, held, limits, rim, usable_m * step, usable_m, most_items)
            if zones is None:
                status = FenceStatus.NO_MARGIN
                continue
            items, _ = zones_to_items(zones)
            last = _too_many(zones, items, step * margin_m, margin_m)
            if last:
                status = FenceStatus.TOO_MANY_ITEMS
                continue
            fault = prove(area, items, margin_m, inside=inside, reach_m=reach_m)
            if fault:
                status, last = (
                    FenceStatus.START_ENCLOSED if "would be outside" in fault else FenceStatus.NO_MARGIN,
                    fault,
                )
                continue
            return AutopilotFence(
                status=FenceStatus.OK,
                reason="",
                margin_m=margin_m,
                used_m=step * margin_m,
                reach_m=reach_m,
                zones=tuple(zones),
                items=items,
                notes=tuple(notes),
            )
        return refuse(status, last)

    whole = made(math.inf, STEPS)
    if whole.status not in (FenceStatus.TOO_MANY_ITEMS, FenceStatus.NO_MARGIN):
        return whole
    reach_m = _largest_reach_m(
        margin_m,
        max((float(shapely.hausdorff_distance(s.polygon, way)) for s in solids), default=0.0),
        lambda reach_m: made(reach_m, STEPS[-1:]).status is FenceStatus.OK,
    )
    # what was left off half way does not say how many items it would have been, and for whom
    return made(math.inf, STEPS[-1:], math.inf) if reach_m is None else made(reach_m, STEPS)


def _largest_reach_m(least_m: float, most_m: float, fits: Callable[[float], bool]) -> float | None:
    """Return how far from the way the obstacles fit, within a twentieth; None where not even the nearest do."""
    low_m: float | None = None
    high_m = least_m
    while high_m < most_m and fits(high_m):
        low_m, high_m = high_m, 2.0 * high_m
    if low_m is None:
        return None
    for _ in range(REFINED):
        middle_m = math.sqrt(low_m * high_m)
        low_m, high_m = (middle_m, high_m) if fits(middle_m) else (low_m, middle_m)
    return low_m


def _near(solids: list[_Solid], way: BaseGeometry, reach_m: float) -> tuple[list[_Solid], list[_Solid]]:
    """Return the obstacles that come within ``reach_m`` of the way, and what of them lies there; circles stay whole."""
    if math.isinf(reach_m):
        return solids, solids
    band = buffer_out(way, reach_m * BAND_SPARE**2)
    shapely.prepare(band)
    around = [s for s in solids if shapely.intersects(band, s.polygon)]
    held: list[_Solid] = []
    for solid in around:
        if solid.circle is not None or shapely.covers(band, solid.polygon):
            held.append(solid)
        else:
            pieces = parts(shapely.intersection(band, solid.polygon))
            held += [replace(solid, polygon=Polygon(piece.exterior)) for piece in pieces]
    return around, held


def _too_many(zones: Sequence[Zone], items: Sequence[MissionItem], used_m: float, margin_m: float) -> str:
    """Return why the autopilot has no room for the items; "" where it has."""
    stored = storage_bytes(items)
    if len(items) <= MAX_FENCE_ITEMS and stored <= STORAGE_BYTES:
        return ""
    worst = sorted(((_sides(z), z.name or z.kind.value) for z in zones), reverse=True)[:3]
    return (
        f"{len(items)} items of {stored} bytes are needed where the autopilot holds {MAX_FENCE_ITEMS} items in "
        f"{STORAGE_BYTES} bytes, even with {used_m:.1f} m of the {margin_m:g} m margin used; most go to "
        + ", ".join(f"{name} ({n})" for n, name in worst)
        + "; raise margin_m, merge or drop obstacles"
    )


def _sides(zone: Zone) -> int:
    return 1 if isinstance(zone.shape, Circle) else len(zone.shape.exterior.coords) - 1


def _solids(
    area: Area, plane: Plane, places: list[tuple[float, float]], limits: BaseGeometry | None, margin_m: float
) -> tuple[list[_Solid], list[str]]:
    """Return the obstacles in the plane, holes filled, and those outside the limits left to the limits."""
    solids: list[_Solid] = []
    notes: list[str] = []
    obstacles: list[Obstacle] = list(area.solids)
    if isinstance(limits, Polygon):
        obstacles += [_island(ring, plane, i) for i, ring in enumerate(limits.interiors)]
    outside = 0
    for index, obstacle in enumerate(obstacles):
        polygon, circle = shape_in(obstacle.shape, plane, cover=True)
        name = obstacle.name or f"obstacle {index + 1}"
        if polygon.interiors:
            if any(shapely.covers(Polygon(r), shapely.points(p)) for r in polygon.interiors for p in places):
                continue  # the boat sails inside it: its hole is a limit (cut_by_rings)
            notes.append(f"the water inside {name} is given up")
            polygon = Polygon(polygon.exterior)
        if limits is not None and not shapely.intersects(limits, polygon):
            outside += 1
            continue
        solids.append(_Solid(name, polygon, circle, max(margin_m, obstacle.margin_m or margin_m)))
    if outside:
        notes.append(f"{outside} obstacle(s) lie outside the keep-in zone, which covers them")
    return solids, notes


def _island(ring: BaseGeometry, plane: Plane, index: int) -> Obstacle:
    lonlat = plane.degrees(np.asarray(ring.coords))
    return Obstacle(shape=Polygon(lonlat), name=f"hole {index + 1} of the fence")


def _attempt(
    plane: Plane,
    around: list[_Solid],
    held: list[_Solid],
    limits: BaseGeometry | None,
    rim: Circle | None,
    tolerance_m: float,
    usable_m: float,
    most_items: float,
) -> tuple[list[Zone] | None, str]:
    """Return zones round all that is ``held``, within ``tolerance_m`` of what is ``around``, or why there are none.

    It is left off as soon as it is sure that they are more than ``most_items``.
    """
    zones: list[Zone] = []
    reserve_m = RESERVE_M + _bulge_m(held, limits, plane)
    if limits is not None:
        zone = _keep_in(plane, limits, rim, tolerance_m, reserve_m)
        if zone is None:
            return None, f"no keep-in zone fits between the limits and the water {usable_m:.1f} m inside them"
        zones.append(zone)
    share = tolerance_m / usable_m
    allowed = (
        shapely.union_all(
            [
                shapely.buffer(s.polygon, max(tolerance_m, share * s.margin_m / (1.0 + plane.error)), quad_segs=16)
                for s in around
            ]
        )
        if around
        else MultiPolygon()
    )
    if limits is not None:
        beyond = shapely.difference(shapely.box(*limits.buffer(1e4).bounds), shapely.buffer(limits, -tolerance_m))
        allowed = shapely.union(allowed, beyond)
    shapely.prepare(allowed)
    groups = _groups(held, allowed)
    wholes = [_whole(group) for group in groups]
    found = [_circle_round(plane, *pair, allowed, reserve_m) for pair in zip(groups, wholes, strict=True)]
    # small ones first: they take no time to reduce and their items count as much
    left = sorted((i for i, z in enumerate(found) if z is None), key=lambda i: shapely.get_num_coordinates(wholes[i]))
    count = sum(_sides(z) for z in zones) + len(found) - len(left)
    for done, i in enumerate(left):
        if count + 3 * (len(left) - done) > most_items:
            return None, f"more than {most_items:g} items are needed"
        polygon = grown_polygon(wholes[i], reserve_m, tolerance_m, allowed)
        if polygon is None:
            return None, f"{groups[i][0].name} does not fit into {tolerance_m:.2f} m of margin"
        zone = Zone(kind=ZoneKind.EXCLUSION, shape=_rounded(polygon, plane), name=_names(groups[i]))
        found[i], count = zone, count + _sides(zone)
    return zones + [z for z in found if z is not None], ""


def _bulge_m(solids: list[_Solid], limits: BaseGeometry | None, plane: Plane) -> float:
    """Return how far a straight line in longitude and latitude strays from one on the ground, for our longest edge."""
    rings = [s.polygon.exterior for s in solids] + ([limits.exterior] if isinstance(limits, Polygon) else [])
    edges = [np.diff(np.asarray(r.coords)[:, :2], axis=0) for r in rings]
    longest = max((float(np.max(np.hypot(e[:, 0], e[:, 1]))) for e in edges), default=0.0)
    return min(5.0, longest**2 * math.tan(math.radians(min(85.0, abs(plane.lat_deg)))) / (8.0 * EQUATOR_M))


def _groups(solids: list[_Solid], allowed: BaseGeometry) -> list[list[_Solid]]:
    """Join obstacles whose common hull is all margin: one zone is cheaper than two."""
    groups = [[s] for s in solids]
    hulls = [shapely.convex_hull(shapely.union_all([s.polygon])) for s in solids]
    numbers, made = list(range(len(solids))), len(solids)  # of the hulls: what is known of a pair outlasts a merger
    apart: set[tuple[int, int]] = set()
    merged = True
    while merged and len(groups) > 1:
        merged = False
        pairs = shapely.STRtree(hulls).query(hulls, predicate="dwithin", distance=50.0)
        fresh = [(i, j) for i, j in pairs.T.tolist() if i < j and (numbers[i], numbers[j]) not in apart]
        for _, i, j in sorted((float(shapely.distance(hulls[i], hulls[j])), i, j) for i, j in fresh):
            if shapely.covers(allowed, shapely.convex_hull(shapely.union_all([hulls[i], hulls[j]]))):
                groups[i] += groups.pop(j)
                hulls[i] = shapely.convex_hull(shapely.union_all([s.polygon for s in groups[i]]))
                hulls.pop(j)
                numbers.pop(j)
                numbers[i] = made = made + 1
                merged = True
                break
            apart.add((numbers[i], numbers[j]))
    return groups


def _whole(group: list[_Solid]) -> Polygon:
    """Return what a zone round the group has to hold."""
    return group[0].polygon if len(group) == 1 else shapely.convex_hull(shapely.union_all([s.polygon for s in group]))


def _names(group: list[_Solid]) -> str:
    return " + ".join(s.name for s in group)


def _circle_round(
    plane: Plane, group: list[_Solid], whole: Polygon, allowed: BaseGeometry, reserve_m: float
) -> Zone | None:
    """Return a circle round a group of obstacles: the cheapest zone, where it is allowed."""
    x, y, radius = group[0].circle if len(group) == 1 and group[0].circle else enclosing_circle(whole)
    radius_m = math.ceil((radius + reserve_m) / (1.0 - plane.error) * 20.0) / 20.0
    if not shapely.covers(allowed, circle_round(x, y, radius_m * (1.0 + plane.error))):
        return None
    return Zone(kind=ZoneKind.EXCLUSION, shape=Circle(plane.geo(x, y), radius_m), name=_names(group))


def _keep_in(
    plane: Plane, limits: BaseGeometry, rim: Circle | None, tolerance_m: float, reserve_m: float
) -> Zone | None:
    """Return a zone inside the limits that holds all water ``tolerance_m`` inside them."""
    if rim is not None:
        radius_m = math.floor((rim.radius_m - reserve_m) * 20.0) / 20.0
        center = GeoPoint(lat_deg=round(rim.center.lat_deg, 7), lon_deg=round(rim.center.lon_deg, 7))
        return Zone(kind=ZoneKind.INCLUSION, shape=Circle(center, radius_m), name="limits") if radius_m > 0.0 else None
    outline = Polygon(limits.exterior)
    core = shapely.buffer(outline, -tolerance_m, quad_segs=16)
    if core.is_empty:
        return None
    middle = shapely.minimum_bounding_circle(core).centroid
    radius = float(shapely.distance(outline.exterior, middle)) - reserve_m
    vertices = shapely.get_coordinates(core)
    if radius > 0.0 and shapely.covers(outline, middle):
        far = float(np.max(np.hypot(vertices[:, 0] - middle.x, vertices[:, 1] - middle.y)))
        radius_m = math.floor(radius * (1.0 - plane.error) * 20.0) / 20.0
        if far * (1.0 + plane.error) <= radius_m:
            return Zone(kind=ZoneKind.INCLUSION, shape=Circle(plane.geo(middle.x, middle.y), radius_m), name="limits")
    polygon = shrunk_polygon(outline, reserve_m, tolerance_m, core)
    if polygon is None:
        return None
    return Zone(kind=ZoneKind.INCLUSION, shape=_rounded(polygon, plane), name="limits")


def _rounded(polygon: Polygon, plane: Plane) -> Polygon:
    """Return the polygon in degrees on the wire's lattice."""
    return Polygon(np.round(plane.degrees(np.asarray(polygon.exterior.coords)[:, :2]), 7))
