"""Routes: the part of a mission that a chart program can show, as points with names."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

from shapely.geometry import LineString, Point

from companion.geofence.document import Code, Document, FindingLevel, Mark, Track
from companion.geofence.formats.losses import Losses
from companion.geofence.formats.rings import Findings, polygons_from_rings
from companion.geofence.shapes import Zone, ZoneKind, unwrapped, wrap_lon_deg
from companion.messages import Command, GeoPoint, MissionItem
from companion.words import counted

# What every format that holds shapes, routes and points gathers while it is read.


class Reading:
    """One file being read: a zone that does not say what it is, is ``kind``; read for its ``areas``, so is a pin."""

    def __init__(self, source: str, kind: ZoneKind, *, areas: bool) -> None:
        self.source, self.kind, self.areas = source, kind, areas
        self.findings = Findings()
        self.zones: list[Zone] = []
        self.marks: list[Mark] = []
        self.tracks: list[Track] = []
        self.rally: list[MissionItem] = []
        self.pins: list[RoutePoint] = []
        self.route: list[RoutePoint] = []
        self.places: dict[str, GeoPoint] = {}  # by role: home, return

    def pins_as_route(self) -> None:
        """Make pins that say nothing of themselves the route of a file without a line; one called start is its home."""
        for pin in self.pins:
            if pin[2].strip().lower() in _START_NAMES and "home" not in self.places:
                self.places["home"] = pin[0]
            else:
                self.route.append(pin)
        if self.route:
            start = ", the one called start for the start" if len(self.route) < len(self.pins) else ""
            self.findings.add(
                FindingLevel.NOTE,
                Code.FORMAT,
                "",
                f"{counted(len(self.route), 'pin')} taken for places to sail to, in the file's order{start}",
            )

    def document(self, form: str) -> Document:
        """Return what was read of a file of the format ``form``; its route is the mission."""
        items, names = items_of(self.route)
        return Document(
            source=self.source,
            format=form,
            zones=tuple(self.zones),
            marks=tuple(self.marks),
            items=items,
            item_names=names,
            home=self.places.get("home"),
            return_point=self.places.get("return"),
            rally=tuple(self.rally),
            tracks=tuple(self.tracks),
            findings=tuple(self.findings),
        )


_START_NAMES = {"start", "home"}
RoutePoint = tuple[GeoPoint, float, str]  # place, altitude [m], name


def route_of(document: Document, losses: Losses) -> list[RoutePoint]:
    """Return the document's mission as route points; what a route cannot say is announced."""
    names = document.item_names or ("",) * len(document.items)
    out: list[RoutePoint] = []
    plain = placeless = 0
    for item, name in zip(document.items, names, strict=True):
        if item.lat_e7 == 0 and item.lon_e7 == 0:
            placeless += 1
            continue
        if item.command != Command.NAV_WAYPOINT or any(item.params) or item.frame != 3 or not item.autocontinue:
            plain += 1
        out.append((item.point, item.alt_m, name))
    losses.drop("placeless mission command", placeless)
    if plain:
        losses.add(FindingLevel.WARNING, f"{plain} mission items become plain waypoints in this format")
    return out


def items_of(points: Iterable[RoutePoint]) -> tuple[tuple[MissionItem, ...], tuple[str, ...]]:
    """Return route points as waypoints and their names."""
    items, names = [], []
    for point, alt_m, name in points:
        items.append(
            MissionItem(
                command=Command.NAV_WAYPOINT,
                lat_e7=round(point.lat_deg * 1e7),
                lon_e7=round(point.lon_deg * 1e7),
                alt_m=alt_m if math.isfinite(alt_m) else 0.0,
            )
        )
        names.append(name)
    return tuple(items), tuple(names) if any(names) else ()


def pins_as_dangers(pins: Sequence[RoutePoint], kind: ZoneKind, findings: Findings) -> list[Mark]:
    """Return pins beside a line, which tells the way itself, as what they are on a chart of dangers."""
    if pins:
        findings.add(
            FindingLevel.NOTE, Code.FORMAT, "", f"{counted(len(pins), 'pin')} beside the line taken for dangers"
        )
    return [Mark(geometry=Point(p.lon_deg, p.lat_deg), kind=kind, name=name) for p, _, name in pins]


def line_as_area(
    points: Sequence[GeoPoint], kind: ZoneKind, name: str, place: str, *, findings: Findings
) -> list[Zone | Mark]:
    """Return a drawn line as what it is on a chart of dangers: closed, an area; open, a line to stay clear of."""
    lonlat = [(p.lon_deg, p.lat_deg) for p in points]
    if len(lonlat) >= 4 and lonlat[0] == lonlat[-1]:
        return [Zone(kind=kind, shape=p, name=name) for p in polygons_from_rings([lonlat], kind, place, findings)]
    if len(set(lonlat)) < 2:
        return []
    return [Mark(geometry=LineString(unwrapped(lonlat)), kind=kind, name=name)]


def track_points(lonlat: Sequence[tuple[float, float]]) -> tuple[GeoPoint, ...]:
    """Return (lon, lat) positions as points."""
    return tuple(GeoPoint(lat_deg=y, lon_deg=wrap_lon_deg(x)) for x, y in lonlat)


def lines_as_route(document: Document) -> Document:
    """Return the document with its only drawn line, or its only track, as the route it was meant to be.

    Programs without routes (Google Earth, QGIS) draw them as plain lines. A document with mission items, or with
    several lines, is returned as it is.
    """
    from dataclasses import replace

    if document.items:
        return document
    lines = [m for m in document.marks if isinstance(m.geometry, LineString)]
    if len(lines) == 1 and not document.tracks:
        points = track_points([(c[0], c[1]) for c in lines[0].geometry.coords])
        rest = tuple(m for m in document.marks if m is not lines[0])
        items, names = items_of((p, 0.0, "") for p in points)
        return replace(document, items=items, item_names=names, marks=rest)
    if len(document.tracks) == 1 and not lines:
        items, names = items_of((p, 0.0, "") for p in document.tracks[0].points)
        return replace(document, items=items, item_names=names, tracks=())
    return document
