"""GeoJSON (RFC 7946): longitude first, WGS 84, rings closed. Carries everything that a document holds.

Zones are Polygon features with ``kind`` inclusion or exclusion; circles are Point features with ``kind`` and
``radius_m``; everything else says its ``role`` (waypoint, rally, home, return, track). Keep-in is never inferred
from the winding.
"""

from __future__ import annotations

import json
import math
from dataclasses import replace
from typing import Any

import numpy as np
from shapely.geometry import LineString, Point, Polygon

from companion.errors import InputError
from companion.geofence.charted import MEMBER, Charted
from companion.geofence.document import Code, Document, FindingLevel, Mark, Track
from companion.geofence.formats.losses import Losses, Written, leave_out
from companion.geofence.formats.rings import on_globe, polygons_from_rings
from companion.geofence.formats.routes import Reading, pins_as_dangers
from companion.geofence.formats.untrusted import MAX_DEPTH, MAX_POSITIONS, JsonNode, parse_json
from companion.geofence.shapes import MOST_RADIUS_M, Circle, Zone, ZoneKind, wrap_lon_deg
from companion.messages import Command, GeoPoint, MissionItem

MOST_WATER_M = 1000.0  # that a chart's obstacles are made for
_KINDS = {
    "inclusion": ZoneKind.INCLUSION,
    "keep-in": ZoneKind.INCLUSION,
    "fence": ZoneKind.INCLUSION,
    "exclusion": ZoneKind.EXCLUSION,
    "keep-out": ZoneKind.EXCLUSION,
    "obstacle": ZoneKind.EXCLUSION,
}


def zone_kind(word: str) -> ZoneKind | None:
    """Return the kind that a property ``kind`` says, None where it is no word for one."""
    return _KINDS.get(word.strip().lower())


class _GeoJsonReading(Reading):
    def __init__(self, source: str, kind: ZoneKind, *, areas: bool) -> None:
        super().__init__(source, kind, areas=areas)
        self.items: list[MissionItem] = []
        self.item_names: list[str] = []
        self.positions = 0

    def feature(self, node: JsonNode) -> None:
        geometry = node.get("geometry")
        properties = node.get("properties") or JsonNode({}, self.source, node.path)
        name_node = properties.get("name")
        name = str(name_node.value) if name_node is not None and isinstance(name_node.value, str | int) else ""
        if geometry is None:
            self.findings.add(
                FindingLevel.ERROR, Code.EMPTY, node.path, "the feature has no geometry", "draw it or remove it"
            )
            return
        self.geometry(geometry, properties, name)

    def geometry(self, node: JsonNode, properties: JsonNode, name: str, depth: int = 0) -> None:
        if depth > MAX_DEPTH:
            raise node.fail(f"collections nest deeper than {MAX_DEPTH}")
        kind = self._kind(properties)
        margin_node = properties.get("margin_m")
        margin_m = margin_node.number(0.0, 1000.0) if margin_node is not None else None
        shape = node.member("type").text()
        if shape == "GeometryCollection":
            members = list(node.member("geometries"))
            for member in members:
                self.geometry(member, properties, name, depth + 1)
            if not members:
                self.findings.add(
                    FindingLevel.ERROR, Code.EMPTY, node.path, "the collection is empty", "draw it or remove it"
                )
            return
        coordinates = node.member("coordinates")
        if shape.startswith("Multi"):
            single = shape.removeprefix("Multi")
            members = list(coordinates)
            if not members:
                self.findings.add(
                    FindingLevel.ERROR, Code.EMPTY, node.path, f"the {shape} is empty", "draw it or remove it"
                )
            for member in members:
                self._single(single, member, properties, kind=kind, name=name, margin_m=margin_m)
        else:
            self._single(shape, coordinates, properties, kind=kind, name=name, margin_m=margin_m)

    def _kind(self, properties: JsonNode) -> ZoneKind:
        node = properties.get("kind")
        if node is None:
            return self.kind
        word = node.text()
        kind = zone_kind(word)
        if kind is None:
            raise node.fail(f"{word.strip().lower()!r} is not a kind", "write inclusion or exclusion")
        return kind

    def _single(
        self,
        shape: str,
        coordinates: JsonNode,
        properties: JsonNode,
        *,
        kind: ZoneKind,
        name: str,
        margin_m: float | None,
    ) -> None:
        place = coordinates.path.removesuffix(".coordinates")
        if shape == "Polygon":
            rings = [[self._position(p) for p in ring] for ring in coordinates]
            depth_m = _depth_m(properties)
            self.zones.extend(
                Zone(kind=kind, shape=polygon, name=name, margin_m=margin_m, depth_m=depth_m)
                for polygon in polygons_from_rings(rings, kind, place, self.findings)
            )
        elif shape == "LineString":
            points = [self._position(p) for p in coordinates]
            role = properties.get("role")
            if role is not None and role.value == "track":
                self.tracks.append(self._track(points, properties, name, coordinates))
            elif len(set(points)) < 2:
                self.findings.add(
                    FindingLevel.ERROR,
                    Code.DEGENERATE,
                    place,
                    "the line has fewer than two points",
                    "draw it or remove it",
                )
            elif on_globe(points, place, self.findings):
                self.marks.append(Mark(geometry=LineString(points), kind=kind, name=name, margin_m=margin_m))
        elif shape == "Point":
            if isinstance(coordinates.value, list) and not coordinates.value:
                self.findings.add(FindingLevel.ERROR, Code.EMPTY, place, "the point is empty", "draw it or remove it")
                return
            self._point(self._position(coordinates), coordinates, properties, kind=kind, name=name, margin_m=margin_m)
        else:
            raise coordinates.fail(f"{shape[:30]!r} is not a geometry of GeoJSON")

    def _point(
        self,
        position: tuple[float, float],
        node: JsonNode,
        properties: JsonNode,
        *,
        kind: ZoneKind,
        name: str,
        margin_m: float | None,
    ) -> None:
        place = node.path.removesuffix(".coordinates")
        if not on_globe([position], place, self.findings):
            return
        point = GeoPoint(lat_deg=position[1], lon_deg=wrap_lon_deg(position[0]))
        role_node = properties.get("role")
        role = role_node.text() if role_node is not None else ""
        radius = properties.get("radius_m")
        if role == "home":
            self.places["home"] = point
        elif role == "return":
            self.places["return"] = point
        elif role in {"waypoint", "rally"}:
            item = _item(point, properties, rally=role == "rally")
            if role == "rally":
                self.rally.append(item)
            else:
                self.items.append(item)
                self.item_names.append(name)
        elif radius is not None:
            radius_m = radius.number(0.0, MOST_RADIUS_M)
            if radius_m <= 0.0:
                raise radius.fail("a circle needs a positive radius")
            depth_m = _depth_m(properties)
            self.zones.append(
                Zone(kind=kind, shape=Circle(point, radius_m), name=name, margin_m=margin_m, depth_m=depth_m)
            )
        elif not (self.areas or properties.get("kind") or margin_m is not None):
            self.pins.append((point, 0.0, name))
        else:
            self.marks.append(Mark(geometry=Point(position), kind=kind, name=name, margin_m=margin_m))

    def _track(self, points: list[tuple[float, float]], properties: JsonNode, name: str, node: JsonNode) -> Track:
        if not on_globe(points, node.path, self.findings):
            points = []
        times = properties.get("times_s")
        times_s = tuple(t.number() for t in times) if times is not None else None
        if times_s is not None and len(times_s) != len(points):
            raise node.fail(f"the track has {len(points)} positions and {len(times_s)} times")
        return Track(
            points=tuple(GeoPoint(lat_deg=y, lon_deg=wrap_lon_deg(x)) for x, y in points), times_s=times_s, name=name
        )

    def _position(self, node: JsonNode) -> tuple[float, float]:
        self.positions += 1
        if self.positions > MAX_POSITIONS:
            raise InputError(self.source, node.path, f"holds more than {MAX_POSITIONS} positions", "simplify it")
        values = list(node)
        if len(values) < 2:
            raise node.fail(f"a position has {len(values)} numbers, not 2 (longitude, latitude)")
        return values[0].number(-1e6, 1e6), values[1].number(-1e6, 1e6)


def _depth_m(properties: JsonNode) -> float | None:
    """Return the depth that a chart's obstacle tells; None: none, or it is not a number in metres."""
    node = properties.get("depth_m")
    value = None if node is None else node.value
    if not isinstance(value, int | float) or isinstance(value, bool) or not math.isfinite(value):
        return None
    return float(value)


def _item(point: GeoPoint, properties: JsonNode, *, rally: bool) -> MissionItem:
    def number(key: str, default: float) -> float:
        node = properties.get(key)
        return node.number() if node is not None else default

    def integer(key: str, default: int, high: int) -> int:
        node = properties.get(key)
        return node.integer(0, high) if node is not None else default

    params_node = properties.get("params")
    params = [p.number() for p in params_node] if params_node is not None else [0.0] * 4
    if len(params) != 4 and params_node is not None:
        raise params_node.fail(f"has {len(params)} numbers, not 4")
    continues = properties.get("autocontinue")
    return MissionItem(
        command=Command.NAV_RALLY_POINT if rally else integer("command", Command.NAV_WAYPOINT, 0xFFFF),
        lat_e7=round(point.lat_deg * 1e7),
        lon_e7=round(point.lon_deg * 1e7),
        alt_m=number("alt_m", 0.0),
        frame=integer("frame", 3, 255),
        params=(params[0], params[1], params[2], params[3]),
        autocontinue=continues.flag() if continues is not None else True,
    )


def read_geojson(text: str, source: str, *, kind: ZoneKind = ZoneKind.EXCLUSION, areas: bool = False) -> Document:
    """Return what a GeoJSON text holds; polygons without a ``kind`` property are of ``kind``.

    Points without properties that say what they are are the places to sail to, or, with ``areas``, dangers.
    """
    root = parse_json(text, source)
    reading = _GeoJsonReading(source, kind, areas=areas)
    root_kind = root.member("type").text()
    crs, made_for = root.get("crs"), root.get(MEMBER)
    if crs is not None:
        named = json.dumps(crs.value)
        if not any(word in named for word in ("CRS84", "4326", "4979")):
            reading.findings.add(
                FindingLevel.ERROR,
                Code.WRONG_SRID,
                "crs",
                f"{named[:60]} is not WGS 84",
                "export it as WGS 84 (RFC 7946)",
            )
    if root_kind == "FeatureCollection":
        for feature in root.member("features"):
            reading.feature(feature)
    elif root_kind == "Feature":
        reading.feature(root)
    else:
        reading.geometry(root, JsonNode({}, source), "")
    has_line = bool(reading.tracks) or any(isinstance(m.geometry, LineString) for m in reading.marks)
    if reading.items or has_line:
        reading.marks.extend(pins_as_dangers(reading.pins, kind, reading.findings))
    else:
        reading.pins_as_route()
    document = reading.document("geojson")
    if reading.items:
        names = tuple(reading.item_names) if any(reading.item_names) else ()
        document = replace(document, items=tuple(reading.items), item_names=names)
    if made_for is not None:
        document = replace(document, charted=_charted(made_for))
    if document.is_empty and not reading.findings:
        reading.findings.add(
            FindingLevel.ERROR, Code.EMPTY, "", "holds no feature", "an empty file is not 'no obstacles'"
        )
        return Document(source=source, format="geojson", findings=tuple(reading.findings))
    return document


def _charted(node: JsonNode) -> Charted:
    """Return what a chart's import says of its obstacles. Raises InputError naming the place."""
    begins, ends, tide, drying = (node.get(key) for key in ("from", "to", "tide_m", "drying"))
    return Charted(
        needs_m=node.member("needs_m").number(0.0, MOST_WATER_M),
        tide_m=0.0 if tide is None else tide.number(-MOST_WATER_M, MOST_WATER_M),
        hours_s=None if begins is None or ends is None else (_unix_s(begins), _unix_s(ends)),
        drying="" if drying is None else drying.text(),
        source=node.source,
    )


def _unix_s(node: JsonNode) -> float:
    try:
        return float(np.datetime64(node.text().removesuffix("Z"), "s").astype(np.int64))
    except ValueError:
        raise node.fail("is no time", "write 2026-11-24T08:00:00Z") from None


def write_geojson(document: Document) -> Written:
    """Return the document as a FeatureCollection; nothing is lost."""
    losses = Losses()
    leave_out(
        losses,
        document,
        {"zones", "marks", "items", "item names", "rally", "return", "home", "tracks", "names", "margins"},
    )
    features: list[dict[str, Any]] = []

    def add(geometry: dict[str, Any], **properties: object) -> None:
        kept = {k: v for k, v in properties.items() if v is not None and v != ""}
        features.append({"type": "Feature", "properties": kept, "geometry": geometry})

    for zone in document.zones:
        extra = {"kind": zone.kind.value, "name": zone.name, "margin_m": zone.margin_m, "depth_m": zone.depth_m}
        if isinstance(zone.shape, Circle):
            add(_point(zone.shape.center), radius_m=zone.shape.radius_m, **extra)
        else:
            add({"type": "Polygon", "coordinates": _rings(zone.shape)}, **extra)
    for mark in document.marks:
        coordinates = [[wrap_lon_deg(c[0]), c[1]] for c in mark.geometry.coords]
        is_point = isinstance(mark.geometry, Point)
        add(
            {"type": "Point" if is_point else "LineString", "coordinates": coordinates[0] if is_point else coordinates},
            kind=mark.kind.value,
            name=mark.name,
            margin_m=mark.margin_m,
        )
    names = document.item_names or ("",) * len(document.items)
    for item, name in zip(document.items, names, strict=True):
        add(_point(item.point), role="waypoint", name=name, **_item_properties(item))
    for item in document.rally:
        add(_point(item.point), role="rally", **_item_properties(item))
    if document.home is not None:
        add(_point(document.home), role="home")
    if document.return_point is not None:
        add(_point(document.return_point), role="return")
    for track in document.tracks:
        add(
            {"type": "LineString", "coordinates": [[p.lon_deg, p.lat_deg] for p in track.points]},
            role="track",
            name=track.name,
            times_s=list(track.times_s) if track.times_s is not None else None,
        )
    made_for = {} if document.charted is None else {MEMBER: document.charted.to_dict()}
    text = json.dumps({"type": "FeatureCollection", **made_for, "features": features}, ensure_ascii=False, indent=1)
    return Written((text + "\n").encode(), tuple(losses))


def _point(point: GeoPoint) -> dict[str, Any]:
    return {"type": "Point", "coordinates": [point.lon_deg, point.lat_deg]}


def _rings(polygon: Polygon) -> list[list[list[float]]]:
    from shapely.geometry.polygon import orient

    turned = orient(polygon)  # outer rings counter-clockwise (RFC 7946, 3.1.6)
    return [[[wrap_lon_deg(x), y] for x, y in ring.coords] for ring in (turned.exterior, *turned.interiors)]


def _item_properties(item: MissionItem) -> dict[str, Any]:
    return {
        "command": int(item.command),
        "params": list(item.params),
        "alt_m": item.alt_m,
        "frame": item.frame,
        "autocontinue": item.autocontinue,
    }
