"""Fences as the items of the MAVLink fence protocol, and back (MISSION_TYPE_FENCE).

A polygon is a run of vertices, each carrying the number of vertices in param 1; the ring is open, there are no
holes. A circle is one item with its radius [m] in param 1. ArduRover holds ``MAX_FENCE_ITEMS`` items in all and
at most 255 vertices per polygon; it reads back frame 0 and autocontinue 0, so these are what we write.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from shapely.geometry import Polygon

from companion.geofence.document import Code, FindingLevel
from companion.geofence.formats.losses import Losses, without_holes
from companion.geofence.formats.rings import Findings, polygons_from_rings
from companion.geofence.shapes import MOST_RADIUS_M, Circle, Zone, ZoneKind, wrap_lon_deg
from companion.messages import Command, GeoPoint, MissionItem, float32

MAX_FENCE_ITEMS = 84  # ArduRover 4.7: "Only 84 items are supported" (672 bytes of storage, 8 a piece)
STORAGE_BYTES = 672  # ... and "Fence exceeds storage size": see ``storage_bytes``

_VERTEX = {
    Command.NAV_FENCE_POLYGON_VERTEX_INCLUSION: ZoneKind.INCLUSION,
    Command.NAV_FENCE_POLYGON_VERTEX_EXCLUSION: ZoneKind.EXCLUSION,
}
_CIRCLE = {
    Command.NAV_FENCE_CIRCLE_INCLUSION: ZoneKind.INCLUSION,
    Command.NAV_FENCE_CIRCLE_EXCLUSION: ZoneKind.EXCLUSION,
}
FENCE_COMMANDS = frozenset({int(c) for c in (*_VERTEX, *_CIRCLE)} | {int(Command.NAV_FENCE_RETURN_POINT)})


def zones_to_items(
    zones: Sequence[Zone], *, return_point: GeoPoint | None = None
) -> tuple[tuple[MissionItem, ...], Losses]:
    """Return the fence items of the zones and what they do not carry."""
    losses = Losses()
    items: list[MissionItem] = []
    if return_point is not None:
        items.append(_item(Command.NAV_FENCE_RETURN_POINT, return_point.lon_deg, return_point.lat_deg, 0.0))
    moved = False
    for zone in without_holes(zones, losses):
        keep_in = zone.kind is ZoneKind.INCLUSION
        if isinstance(zone.shape, Circle):
            command = Command.NAV_FENCE_CIRCLE_INCLUSION if keep_in else Command.NAV_FENCE_CIRCLE_EXCLUSION
            center = zone.shape.center
            items.append(_item(command, center.lon_deg, center.lat_deg, float32(zone.shape.radius_m)))
            moved |= not math.isclose(items[-1].params[0], zone.shape.radius_m, rel_tol=1e-12)
            moved |= not _exact(center.lon_deg) or not _exact(center.lat_deg)
            continue
        command = Command.NAV_FENCE_POLYGON_VERTEX_INCLUSION if keep_in else Command.NAV_FENCE_POLYGON_VERTEX_EXCLUSION
        vertices = np.asarray(zone.shape.exterior.coords)[:-1, :2]
        items.extend(_item(command, wrap_lon_deg(float(x)), float(y), float(len(vertices))) for x, y in vertices)
        moved |= not all(_exact(float(v)) for v in vertices.ravel())
    if moved:
        losses.add(FindingLevel.NOTE, "coordinates are rounded to 1e-7 degrees (at most 6 mm) and radii to float32")
    return tuple(items), losses


def storage_bytes(items: Sequence[MissionItem]) -> int:
    """Return what ArduRover needs to keep the items [bytes].

    A header of 4, then for each polygon 2 and 8 a vertex, for a circle 13, for the return point 9; an end mark of 1.
    Many small zones therefore fill the storage before there are 84 items.
    """
    size, index = 5, 0
    while index < len(items):
        item = items[index]
        if item.command in _CIRCLE:
            size += 13
        elif item.command in _VERTEX:
            count = max(1, int(item.params[0]))
            size += 2 + 8 * count
            index += count - 1
        else:
            size += 9
        index += 1
    return size


def _exact(degrees: float) -> bool:
    return round(degrees * 1e7) / 1e7 == degrees


def _item(command: int, lon_deg: float, lat_deg: float, param1: float) -> MissionItem:
    return MissionItem(
        command=int(command),
        lat_e7=round(lat_deg * 1e7),
        lon_e7=round(lon_deg * 1e7),
        frame=0,
        params=(param1, 0.0, 0.0, 0.0),
        autocontinue=False,
    )


def items_to_zones(
    items: Sequence[MissionItem], findings: Findings, *, first: int = 0
) -> tuple[tuple[Zone, ...], GeoPoint | None]:
    """Return the zones and the return point of a fence item list; faults go to ``findings``.

    ``first`` is the number of the first item in its file.
    """
    zones: list[Zone] = []
    return_point: GeoPoint | None = None
    index = 0
    while index < len(items):
        item = items[index]
        place = f"item {first + index}"
        if item.command == Command.NAV_FENCE_RETURN_POINT:
            return_point = item.point
            index += 1
        elif item.command in _CIRCLE:
            radius_m = item.params[0]
            if 0.0 < radius_m <= MOST_RADIUS_M:
                zones.append(Zone(kind=_CIRCLE[Command(item.command)], shape=Circle(item.point, radius_m)))
            else:
                findings.add(
                    FindingLevel.ERROR,
                    Code.DEGENERATE,
                    place,
                    f"the circle's radius is {radius_m:g} m",
                    f"give it a positive radius of at most {MOST_RADIUS_M:.0f} m",
                )
            index += 1
        elif item.command in _VERTEX:
            count = int(item.params[0]) if math.isfinite(item.params[0]) else 0
            end = index + 1
            while end < min(index + count, len(items)) and (
                (items[end].command, items[end].params[0]) == (item.command, item.params[0])
            ):
                end += 1
            run = items[index:end]
            if count < 3 or len(run) != count:
                findings.add(
                    FindingLevel.ERROR,
                    Code.FORMAT,
                    place,
                    f"the polygon announces {item.params[0]:g} vertices and {len(run)} follow",
                    "each vertex carries the number of vertices; at least 3",
                )
                while index < len(items) and items[index].command == item.command:
                    index += 1
                continue
            kind = _VERTEX[Command(item.command)]
            ring = [(i.lon_e7 / 1e7, i.lat_e7 / 1e7) for i in run]
            zones.extend(
                Zone(kind=kind, shape=p) for p in polygons_from_rings([ring], kind, place, findings, closed=False)
            )
            index += count
        else:
            findings.add(
                FindingLevel.ERROR,
                Code.FORMAT,
                place,
                f"command {item.command} does not belong in a fence",
                "commands 5000 to 5004 do",
            )
            index += 1
    return tuple(zones), return_point


def ring_of(polygon: Polygon) -> list[tuple[float, float]]:
    """Return a polygon's outer ring, open, as (lat, lon) with longitudes on ±180."""
    return [(float(y), wrap_lon_deg(float(x))) for x, y in list(polygon.exterior.coords)[:-1]]
