"""GPX 1.1 routes, tracks and waypoints (OpenCPN and every chart plotter), by gpxpy.

A route is a mission of waypoints; in a file without a line the waypoints are one themselves. A closed route or track
whose ``<type>`` is inclusion or exclusion is a zone (that is how we write them). When a file is read for its ``areas``
every closed line is a zone, every open line and every waypoint something to stay clear of, but for the mission and
the tracks that we wrote ourselves.
"""

from __future__ import annotations

import datetime as dt
import math
from typing import Any

import gpxpy
import gpxpy.gpx
from shapely.geometry import Point

from companion.errors import InputError
from companion.geofence.document import Code, Document, FindingLevel, Mark, Track
from companion.geofence.formats.fence_items import ring_of
from companion.geofence.formats.losses import Losses, Written, as_polygon, leave_out, without_holes
from companion.geofence.formats.routes import Reading, line_as_area, route_of
from companion.geofence.formats.untrusted import MAX_POSITIONS, parse_xml, printable
from companion.geofence.shapes import Zone, ZoneKind, wrap_lon_deg
from companion.messages import Command, GeoPoint, MissionItem

_KINDS = {k.value: k for k in ZoneKind}
# The <type> that we give to routes and tracks: what says so is no danger and no limit, whoever reads it.
_MISSION, _TRACK = "mission", "track"


class _GpxReading(Reading):
    def point(self, node: Any, place: str) -> GeoPoint:
        lat_deg, lon_deg = node.latitude, node.longitude
        if lat_deg is None or lon_deg is None or not (math.isfinite(lat_deg) and math.isfinite(lon_deg)):
            raise InputError(self.source, place, "has no finite lat and lon")
        if abs(lat_deg) > 90.0 or abs(lon_deg) > 180.0:
            raise InputError(
                self.source, place, f"lat {lat_deg:g} lon {lon_deg:g} is not on the globe", "are they swapped?"
            )
        return GeoPoint(lat_deg=lat_deg, lon_deg=lon_deg)

    def line(self, points: list[GeoPoint], kind: ZoneKind, name: str, place: str) -> None:
        for found in line_as_area(points, kind, name, place, findings=self.findings):
            if isinstance(found, Zone):
                self.zones.append(found)
            else:
                self.marks.append(found)


def read_gpx(data: bytes, source: str, *, kind: ZoneKind = ZoneKind.EXCLUSION, areas: bool = False) -> Document:
    """Return what a GPX file holds; with ``areas`` its lines are dangers or limits, not routes."""
    parse_xml(data, source)
    try:
        gpx = gpxpy.parse(
            data.decode("utf-8-sig") if not data.startswith((b"\xff\xfe", b"\xfe\xff")) else data.decode("utf-16")
        )
    except (gpxpy.gpx.GPXException, ValueError, TypeError, AttributeError, OverflowError) as error:
        raise InputError(
            source, "", f"is not GPX ({str(error).splitlines()[0][:80] if str(error) else 'damaged'})"
        ) from None
    reading = _GpxReading(source, kind, areas=areas)
    count = len(gpx.waypoints) + sum(len(r.points) for r in gpx.routes) + gpx.get_track_points_no()
    if count > MAX_POSITIONS:
        raise InputError(source, "", f"holds more than {MAX_POSITIONS} positions", "simplify it")
    for number, waypoint in enumerate(gpx.waypoints, start=1):
        _waypoint(waypoint, f"wpt {number}", reading)
    for number, route in enumerate(gpx.routes, start=1):
        _route(route, f"rte {number}", reading)
    for number, track in enumerate(gpx.tracks, start=1):
        _track(track, f"trk {number}", reading)
    if reading.route or reading.tracks:
        for _, _, name in reading.pins:
            reading.findings.add(
                FindingLevel.NOTE, Code.DROPPED, "", f"the waypoint {name} is no part of a route and is not used"
            )
    else:
        reading.pins_as_route()
    document = reading.document("gpx")
    if document.is_empty and not reading.findings:
        reading.findings.add(FindingLevel.ERROR, Code.EMPTY, "", "holds no route, track or waypoint")
        return Document(source=source, format="gpx", findings=tuple(reading.findings))
    return document


def _waypoint(node: Any, place: str, reading: _GpxReading) -> None:
    point = reading.point(node, place)
    role = (node.type or "").strip().lower()
    if role in {"home", "return"}:
        reading.places[role] = point
    elif role == "rally":
        reading.rally.append(
            MissionItem(
                command=Command.NAV_RALLY_POINT,
                lat_e7=round(point.lat_deg * 1e7),
                lon_e7=round(point.lon_deg * 1e7),
                alt_m=_altitude_m(node),
            )
        )
    elif role in _KINDS or reading.areas:
        geometry = Point(point.lon_deg, point.lat_deg)
        reading.marks.append(Mark(geometry=geometry, kind=_KINDS.get(role, reading.kind), name=node.name or ""))
    else:
        reading.pins.append((point, _altitude_m(node), node.name or ""))


def _altitude_m(node: Any) -> float:
    return float(node.elevation) if node.elevation is not None and math.isfinite(node.elevation) else 0.0


def _route(node: Any, place: str, reading: _GpxReading) -> None:
    points = [reading.point(p, f"{place} point {i + 1}") for i, p in enumerate(node.points)]
    role = (node.type or "").strip().lower()
    if role in _KINDS or (reading.areas and role != _MISSION):
        reading.line(points, _KINDS.get(role, reading.kind), node.name or "", place)
    elif reading.route:
        reading.findings.add(
            FindingLevel.WARNING,
            Code.FORMAT,
            place,
            "the file has several routes; the first is the mission, this one is kept as a track",
        )
        reading.tracks.append(Track(points=tuple(points), name=node.name or ""))
    else:
        reading.route.extend(
            (point, _altitude_m(p), p.name or "") for point, p in zip(points, node.points, strict=True)
        )


def _track(node: Any, place: str, reading: _GpxReading) -> None:
    role = (node.type or "").strip().lower()
    for segment_number, segment in enumerate(node.segments, start=1):
        where = f"{place} segment {segment_number}"
        points = [reading.point(p, f"{where} point {i + 1}") for i, p in enumerate(segment.points)]
        if not points:
            continue
        if role in _KINDS or (reading.areas and role != _TRACK):
            reading.line(points, _KINDS.get(role, reading.kind), node.name or "", where)
            continue
        times = [p.time for p in segment.points]
        times_s = tuple(t.timestamp() for t in times if t is not None)
        reading.tracks.append(
            Track(points=tuple(points), times_s=times_s if len(times_s) == len(points) else None, name=node.name or "")
        )


def write_gpx(document: Document) -> Written:
    """Return the document as GPX: the mission as a route, zones as closed routes, tracks as tracks."""
    losses = Losses()
    leave_out(losses, document, {"zones", "marks", "items", "item names", "rally", "return", "home", "tracks", "names"})
    gpx = gpxpy.gpx.GPX()
    gpx.creator = "companion"

    def mark(point: GeoPoint, role: str, name: str = "", alt_m: float | None = None) -> None:
        gpx.waypoints.append(
            gpxpy.gpx.GPXWaypoint(
                point.lat_deg, point.lon_deg, elevation=alt_m, name=printable(name) or None, type=role
            )
        )

    points = route_of(document, losses)
    if points:
        route = gpxpy.gpx.GPXRoute(name="mission")
        route.type = _MISSION
        route.points.extend(
            gpxpy.gpx.GPXRoutePoint(
                p.lat_deg, p.lon_deg, elevation=a or None, name=printable(n) or None, symbol="diamond", type="WPT"
            )
            for p, a, n in points
        )
        gpx.routes.append(route)
    for zone in without_holes(document.zones, losses):
        route = gpxpy.gpx.GPXRoute(name=printable(zone.name) or None)
        route.type = zone.kind.value
        ring = ring_of(as_polygon(zone, losses))
        route.points.extend(gpxpy.gpx.GPXRoutePoint(lat, lon) for lat, lon in (*ring, ring[0]))
        gpx.routes.append(route)
    for danger in document.marks:
        if isinstance(danger.geometry, Point):
            x, y = danger.geometry.coords[0][:2]
            mark(GeoPoint(lat_deg=y, lon_deg=wrap_lon_deg(x)), danger.kind.value, danger.name)
        else:
            route = gpxpy.gpx.GPXRoute(name=printable(danger.name) or None)
            route.type = danger.kind.value
            route.points.extend(gpxpy.gpx.GPXRoutePoint(c[1], wrap_lon_deg(c[0])) for c in danger.geometry.coords)
            gpx.routes.append(route)
    if document.home is not None:
        mark(document.home, "home")
    if document.return_point is not None:
        mark(document.return_point, "return")
    for item in document.rally:
        mark(item.point, "rally", alt_m=item.alt_m)
    for track in document.tracks:
        _add_track(gpx, track)
    return Written(gpx.to_xml(version="1.1").encode(), tuple(losses))


def _add_track(gpx: Any, track: Track) -> None:
    line = gpxpy.gpx.GPXTrack(name=printable(track.name) or None)
    line.type = _TRACK  # type: ignore[assignment]
    segment = gpxpy.gpx.GPXTrackSegment()
    times = track.times_s or (None,) * len(track.points)
    segment.points.extend(
        gpxpy.gpx.GPXTrackPoint(
            p.lat_deg, p.lon_deg, time=dt.datetime.fromtimestamp(t, tz=dt.UTC) if t is not None else None
        )
        for p, t in zip(track.points, times, strict=True)
    )
    line.segments.append(segment)
    gpx.tracks.append(line)
