"""The autopilot's own fence: the area in the 84 items that ArduRover holds, as its last line of defence.

Every keep-out zone holds its obstacles and stays inside what the planner keeps clear of; the keep-in zone lies
inside the limits and holds all water that the planner may use. So the fence never lets through what the files
forbid, and never stops a boat that is where its plan may put it. Both halves are proved on the items' own integers
(``fence_proof``), in the plane of longitude and latitude in which ArduPilot draws its polygons.
"""

from __future__ import annotations

import enum
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from shapely.geometry import MultiPolygon, Polygon
from shapely.geometry.base import BaseGeometry

from companion.geofence.area import Area
from companion.geofence.fence.plane import EQUATOR_M, Plane, cut_by_rings, limits_in, plane_of, shape_in
from companion.geofence.fence.proof import prove
from companion.geofence.fence.simplify import circle_round, enclosing_circle, grown_polygon, shrunk_polygon
from companion.geofence.formats.fence_items import (
    MAX_FENCE_ITEMS,
    MAX_RING,
    STORAGE_BYTES,
    storage_bytes,
    zones_to_items,
)
from companion.geofence.shapes import Circle, Obstacle, Zone, ZoneKind
from companion.messages import GeoPoint, MissionItem

# How much of the margin a simplification may use: the least that fits leaves the most room between plan and fence.
STEPS = (0.25, 0.4, 0.55, 0.7, 0.85, 1.0)
RESERVE_M = 0.03      # rounding to 1e-7 degrees moves a vertex by at most 8 mm; the rest is for edges


class FenceStatus(enum.Enum):
    """How the simplification ended."""

    OK = "ok"
    EMPTY = "empty"                      # there is nothing to keep out of or inside of
    TOO_MANY_ITEMS = "too many items"    # not even at the whole margin
    NO_MARGIN = "no margin"              # the margin is too small for any zone to hold what it must
    START_ENCLOSED = "start enclosed"    # a zone would hold the start or a goal
    NO_WATER = "no water"                # the limits leave no water at the margin
    TOO_LARGE = "too large"              # the area is too wide to be flat


@dataclass(frozen=True, slots=True, kw_only=True)
class AutopilotFence:
    """The outcome: ``items`` for upload when ``status`` is OK, otherwise the ``reason``.

    ``used_m`` is how much of ``margin_m`` the zones stick out at most: a boat on its plan is at least
    ``margin_m - used_m`` from the fence.
    """

    status: FenceStatus
    reason: str
    margin_m: float
    used_m: float = 0.0
    zones: tuple[Zone, ...] = ()
    items: tuple[MissionItem, ...] = ()
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class _Solid:
    name: str
    polygon: Polygon           # the obstacle itself; a circle's is drawn around it
    circle: tuple[float, float, float] | None
    margin_m: float            # what the planner keeps from it


def fence_for_autopilot(
    area: Area, margin_m: float, *, inside: Sequence[GeoPoint], max_items: int = MAX_FENCE_ITEMS,
) -> AutopilotFence:
    """Return the area as at most ``max_items`` fence items.

    ``margin_m`` is what the planner keeps clear of obstacles and limits; ``inside`` are the places (start, goals)
    that the boat must be able to sail to, the first of them in the water that counts. Same input, same output.
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
    status, last = FenceStatus.NO_MARGIN, ""
    for step in STEPS:
        zones, last = _attempt(plane, solids, limits, rim, usable_m * step, usable_m)
        if zones is None:
            status = FenceStatus.NO_MARGIN
            continue
        items, _ = zones_to_items(zones)
        stored = storage_bytes(items)
        if len(items) > max_items or stored > STORAGE_BYTES or any(_sides(z) > MAX_RING for z in zones):
            status = FenceStatus.TOO_MANY_ITEMS
            worst = sorted(((_sides(z), z.name or z.kind.value) for z in zones), reverse=True)[:3]
            last = (
                f"{len(items)} items of {stored} bytes are needed where the autopilot holds {max_items} items in "
                f"{STORAGE_BYTES} bytes, even with "
                f"{step * margin_m:.1f} m of the {margin_m:g} m margin used; most go to "
                + ", ".join(f"{name} ({n})" for n, name in worst) + "; raise margin_m, merge or drop obstacles"
            )
            continue
        fault = prove(area, items, margin_m, inside=inside)
        if fault:
            status, last = FenceStatus.START_ENCLOSED if "would be outside" in fault else FenceStatus.NO_MARGIN, fault
            continue
        return AutopilotFence(
            status=FenceStatus.OK, reason="", margin_m=margin_m, used_m=step * margin_m,
            zones=tuple(zones), items=items, notes=tuple(notes),
        )
    return refuse(status, last)


def _sides(zone: Zone) -> int:
    return 1 if isinstance(zone.shape, Circle) else len(zone.shape.exterior.coords) - 1


def _solids(
    area: Area, plane: Plane, places: list[tuple[float, float]], limits: BaseGeometry | None, margin_m: float,
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
        solids.append(_Solid(name, polygon, circle, max(margin_m, obstacle.margin_m or 0.0)))
    if outside:
        notes.append(f"{outside} obstacle(s) lie outside the keep-in zone, which covers them")
    return solids, notes


def _island(ring: BaseGeometry, plane: Plane, index: int) -> Obstacle:
    lonlat = plane.degrees(np.asarray(ring.coords)[:, :2])
    return Obstacle(shape=Polygon(lonlat), name=f"hole {index + 1} of the fence")


def _attempt(
    plane: Plane, solids: list[_Solid], limits: BaseGeometry | None, rim: Circle | None, tolerance_m: float,
    usable_m: float,
) -> tuple[list[Zone] | None, str]:
    """Return zones that stick out by at most ``tolerance_m``, or why there are none."""
    zones: list[Zone] = []
    reserve_m = RESERVE_M + _bulge_m(solids, limits, plane)
    if limits is not None:
        zone = _keep_in(plane, limits, rim, tolerance_m, reserve_m)
        if zone is None:
            return None, f"no keep-in zone fits between the limits and the water {usable_m:.1f} m inside them"
        zones.append(zone)
    share = tolerance_m / usable_m
    allowed = shapely.union_all([
        shapely.buffer(s.polygon, max(tolerance_m, share * s.margin_m / (1.0 + plane.error)), quad_segs=16)
        for s in solids
    ]) if solids else MultiPolygon()
    if limits is not None:
        beyond = shapely.difference(shapely.box(*limits.buffer(1e4).bounds), shapely.buffer(limits, -tolerance_m))
        allowed = shapely.union(allowed, beyond)
    shapely.prepare(allowed)
    for group in _groups(solids, allowed):
        zone = _keep_out(plane, group, allowed, tolerance_m, reserve_m)
        if zone is None:
            return None, f"{group[0].name} does not fit into {tolerance_m:.2f} m of margin"
        zones.append(zone)
    return zones, ""


def _bulge_m(solids: list[_Solid], limits: BaseGeometry | None, plane: Plane) -> float:
    """Return how far a straight line in longitude and latitude strays from one on the ground, for our longest edge."""
    rings = [s.polygon.exterior for s in solids] + ([limits.exterior] if isinstance(limits, Polygon) else [])
    edges = [np.diff(np.asarray(r.coords)[:, :2], axis=0) for r in rings]
    longest = max((float(np.max(np.hypot(e[:, 0], e[:, 1]))) for e in edges), default=0.0)
    return min(5.0, longest**2 * math.tan(math.radians(min(85.0, abs(plane.lat_deg)))) / (8.0 * EQUATOR_M))


def _groups(solids: list[_Solid], allowed: BaseGeometry) -> list[list[_Solid]]:
    """Join obstacles whose common hull is all margin: one zone is cheaper than two."""
    groups = [[s] for s in solids]
    merged = True
    while merged and len(groups) > 1:
        merged = False
        hulls = [shapely.convex_hull(shapely.union_all([s.polygon for s in g])) for g in groups]
        pairs = shapely.STRtree(hulls).query(hulls, predicate="dwithin", distance=50.0)
        order = sorted(
            ((float(shapely.distance(hulls[i], hulls[j])), int(i), int(j)) for i, j in pairs.T if i < j),
        )
        for _, i, j in order:
            if shapely.covers(allowed, shapely.convex_hull(shapely.union_all([hulls[i], hulls[j]]))):
                groups[i] += groups.pop(j)
                merged = True
                break
    return groups


def _keep_out(
    plane: Plane, group: list[_Solid], allowed: BaseGeometry, tolerance_m: float, reserve_m: float,
) -> Zone | None:
    """Return the cheapest zone round a group of obstacles: a circle, else a polygon."""
    name = " + ".join(s.name for s in group)
    whole = group[0].polygon if len(group) == 1 else shapely.convex_hull(shapely.union_all([s.polygon for s in group]))
    x, y, radius = group[0].circle if len(group) == 1 and group[0].circle else enclosing_circle(whole)
    radius_m = math.ceil((radius + reserve_m) / (1.0 - plane.error) * 20.0) / 20.0
    if shapely.covers(allowed, circle_round(x, y, radius_m * (1.0 + plane.error))):
        return Zone(kind=ZoneKind.EXCLUSION, shape=Circle(plane.geo(x, y), radius_m), name=name)
    polygon = grown_polygon(whole, reserve_m, tolerance_m, allowed)
    if polygon is None:
        return None
    return Zone(kind=ZoneKind.EXCLUSION, shape=_rounded(polygon, plane), name=name)


def _keep_in(
    plane: Plane, limits: BaseGeometry, rim: Circle | None, tolerance_m: float, reserve_m: float,
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
