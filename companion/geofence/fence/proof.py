"""The proof that fence items are a proper fence for an area, from the items' own integers."""

from __future__ import annotations

import math
from collections.abc import Sequence

import shapely
from shapely.geometry import Polygon
from shapely.geometry.base import BaseGeometry

from companion.geofence.area import Area, parts
from companion.geofence.fence.plane import Plane, cut_by_rings, limits_in, plane_of, shape_in
from companion.geofence.findings import Severity
from companion.geofence.formats.fence_items import items_to_zones
from companion.geofence.formats.rings import Findings
from companion.geofence.shapes import Circle, Shape, Zone, ZoneKind, center_of
from companion.messages import GeoPoint, MissionItem


def prove(area: Area, items: Sequence[MissionItem], margin_m: float, *, inside: Sequence[GeoPoint]) -> str:
    """Return why the items are not a proper fence for the area, "" when they are. Independent of how they were made.

    Checked with shapely on the items as they go to the autopilot: every obstacle that the keep-in zones leave in
    reach is covered by the keep-out zones; the keep-in zones lie inside the limits; no keep-out zone reaches water
    farther than ``margin_m`` from every obstacle; all water of the start's piece that is ``margin_m`` inside the
    limits stays inside the keep-in zones; no place is shut out.
    """
    findings = Findings()
    zones, _ = items_to_zones(items, findings)
    if any(f.severity is Severity.ERROR for f in findings):
        return findings[0].text
    plane = plane_of(area, inside[0])
    slack_m = 1e-6
    keep_in: BaseGeometry | None = None
    for zone in zones:
        if zone.kind is ZoneKind.INCLUSION:
            outer, _ = shape_in(zone.shape, plane, cover=True)
            keep_in = outer if keep_in is None else shapely.intersection(keep_in, outer)
    out_small = shapely.union_all([
        _inner(z.shape, plane) for z in zones if z.kind is ZoneKind.EXCLUSION
    ] or [Polygon()])
    obstacles = [(o, shape_in(o.shape, plane, cover=True)[0]) for o in area.solids]
    for obstacle, polygon in obstacles:
        reach = polygon if keep_in is None else shapely.intersection(polygon, keep_in)
        left = shapely.difference(reach, shapely.buffer(out_small, slack_m))
        if shapely.area(left) > slack_m * max(1.0, float(polygon.length)):
            return f"the keep-out zones do not hold {obstacle.name or 'an obstacle'}"
    for zone in area.fence.inclusions:
        polygon, _ = shape_in(zone.shape, plane, cover=False)
        if any(_within_rim(z, zone, margin_m, plane) for z in zones):
            continue
        reach = shapely.difference(keep_in, out_small) if keep_in is not None else None
        if reach is None or not shapely.covers(shapely.buffer(polygon, slack_m), reach):
            return f"the keep-in zone is not inside {zone.name or 'the limits'}"
    margin = shapely.union_all([
        shapely.buffer(p, max(margin_m, o.margin_m or 0.0), quad_segs=16) for o, p in obstacles
    ] or [Polygon()])
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
        if any(_within_rim(zone, rim, margin_m, plane) for rim in area.fence.inclusions):
            continue
        if not shapely.covers(shapely.buffer(inner, slack_m), _piece(useful, plane.point(inside[0]))):
            return "the keep-in zone shuts out water that the planner may use"
    for index, place in enumerate(inside):
        point = shapely.points(plane.point(place))
        shut = any(z.kind is ZoneKind.EXCLUSION and shapely.covers(shape_in(z.shape, plane, cover=True)[0], point)
                   for z in zones)
        if shut or (keep_in is not None and not shapely.covers(keep_in, point)):
            return f"the {'start' if index == 0 else f'goal {index}'} would be outside the autopilot's fence"
    return ""


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
