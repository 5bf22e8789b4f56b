"""KML and KMZ (Google Earth, QGIS): ``lon,lat[,alt]`` tuples; a KMZ is a zip with a .kml inside.

``ExtendedData`` carries what KML has no word for: ``kind`` (inclusion, exclusion), ``margin_m`` and ``role``
(route, track, home, return, rally).
"""

from __future__ import annotations

import io
import zipfile
import zlib
from collections.abc import Iterator
from typing import Any
from xml.sax.saxutils import escape

from shapely.geometry import LineString, Point, Polygon

from companion.errors import InputError
from companion.geofence.document import Code, Document, FindingLevel, Mark, Track
from companion.geofence.formats.losses import Losses, Written, as_polygon, leave_out
from companion.geofence.formats.mission_planner import decimal
from companion.geofence.formats.rings import on_globe, polygons_from_rings
from companion.geofence.formats.routes import Reading, pins_as_dangers, route_of, track_points
from companion.geofence.formats.untrusted import (
    MAX_BYTES,
    MAX_POSITIONS,
    child_text,
    local_name,
    number,
    parse_xml,
    printable,
)
from companion.geofence.shapes import Zone, ZoneKind, unwrapped, wrap_lon_deg
from companion.messages import Command, MissionItem

_KINDS = {k.value: k for k in ZoneKind}
_SHAPES = {"Polygon", "LineString", "LinearRing", "Point"}


def unzip_kmz(data: bytes, source: str) -> bytes:
    """Return the .kml of a KMZ. Raises InputError for a broken zip, one without .kml, or one that unpacks too large."""
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            names = [n for n in archive.namelist() if n.lower().endswith(".kml")]
            if not names:
                raise InputError(source, "", "holds no .kml")
            name = "doc.kml" if "doc.kml" in names else names[0]
            with archive.open(name) as file:
                content = file.read(MAX_BYTES + 1)
    except (zipfile.BadZipFile, zlib.error, OSError, EOFError, NotImplementedError, RuntimeError, ValueError):
        raise InputError(source, "", "is not a whole zip archive", "is the file cut off?") from None
    if len(content) > MAX_BYTES:
        raise InputError(source, name, f"unpacks to more than {MAX_BYTES // 2**20} MiB", "split or simplify it")
    return content


class _KmlReading(Reading):
    def __init__(self, source: str, kind: ZoneKind, *, areas: bool) -> None:
        super().__init__(source, kind, areas=areas)
        self.positions = 0

    def coordinates(self, element: Any, place: str) -> list[tuple[float, float, float]]:
        """Return the lon, lat, alt tuples of an element's <coordinates>."""
        text = child_text(element, "coordinates")
        out = []
        for part in text.split():
            fields = part.split(",")
            if len(fields) not in {2, 3}:
                raise InputError(
                    self.source,
                    place,
                    f"{part[:40]!r} is not lon,lat[,alt]",
                    "tuples are separated by spaces, decimals by points",
                )
            values = [number(f, self.source, place) for f in fields if f]
            if len(values) < 2:
                raise InputError(self.source, place, f"{part[:40]!r} is not lon,lat[,alt]")
            out.append((values[0], values[1], values[2] if len(values) > 2 else 0.0))
        self.positions += len(out)
        if self.positions > MAX_POSITIONS:
            raise InputError(self.source, place, f"holds more than {MAX_POSITIONS} positions", "simplify it")
        return out


def read_kml(data: bytes, source: str, *, kind: ZoneKind = ZoneKind.EXCLUSION, areas: bool = False) -> Document:
    """Return what a KML file holds; polygons without a ``kind`` are of ``kind``.

    Pins that say nothing of themselves are the places to sail to, or, when it is read for its ``areas``, dangers.
    """
    root = parse_xml(data, source)
    if local_name(root) != "kml":
        raise InputError(source, "line 1", f"the root is <{local_name(root)[:30]}>, not <kml>")
    reading = _KmlReading(source, kind, areas=areas)
    placemarks = [e for e in root.iter() if local_name(e) == "Placemark"]
    for index, placemark in enumerate(placemarks):
        name = child_text(placemark, "name")
        place = f"Placemark {index + 1}" + (f" '{name[:40]}'" if name else "")
        data_of = _extended(placemark)
        shapes = list(_shapes(placemark))
        if not shapes:
            reading.findings.add(FindingLevel.WARNING, Code.EMPTY, place, "has no geometry that can be read")
        for shape in shapes:
            _shape(shape, name, data_of, place, reading=reading)
    for element in root.iter():
        if local_name(element) in {"NetworkLink", "GroundOverlay"}:
            reading.findings.add(FindingLevel.WARNING, Code.DROPPED, "", f"a {local_name(element)} is not followed")
    has_line = bool(reading.tracks) or any(isinstance(m.geometry, LineString) for m in reading.marks)
    if reading.route or has_line:
        reading.marks.extend(pins_as_dangers(reading.pins, kind, reading.findings))
    else:
        reading.pins_as_route()
    document = reading.document("kml")
    if document.is_empty and not any(f.severity is FindingLevel.ERROR for f in reading.findings):
        reading.findings.add(FindingLevel.ERROR, Code.EMPTY, "", "holds no placemark with a shape")
        return Document(source=source, format="kml", findings=tuple(reading.findings))
    return document


def _extended(placemark: Any) -> dict[str, str]:
    out: dict[str, str] = {}
    for element in placemark.iter():
        if local_name(element) == "Data":
            out[str(element.get("name", ""))] = child_text(element, "value")
        elif local_name(element) == "SimpleData":
            out[str(element.get("name", ""))] = (element.text or "").strip()
    return out


def _shapes(element: Any) -> Iterator[Any]:
    """Yield the shapes of a placemark, from within MultiGeometry too."""
    for child in element:
        if local_name(child) in _SHAPES:
            yield child
        elif local_name(child) == "MultiGeometry":
            yield from _shapes(child)


def _shape(element: Any, name: str, data_of: dict[str, str], place: str, *, reading: _KmlReading) -> None:
    word = data_of.get("kind", "").strip().lower()
    if word and word not in _KINDS:
        raise InputError(reading.source, place, f"{word[:30]!r} is not a kind", "write inclusion or exclusion")
    kind = _KINDS.get(word, reading.kind)
    role = data_of.get("role", "")
    margin = data_of.get("margin_m", "")
    margin_m = number(margin, reading.source, place) if margin else None
    shape = local_name(element)
    if shape == "Polygon":
        rings: list[list[tuple[float, float]]] = []
        for boundary in element:
            if local_name(boundary) in {"outerBoundaryIs", "innerBoundaryIs"}:
                for ring in boundary:
                    at = 0 if local_name(boundary) == "outerBoundaryIs" else len(rings)
                    rings.insert(at, [(x, y) for x, y, _ in reading.coordinates(ring, place)])
        reading.zones.extend(
            Zone(kind=kind, shape=p, name=name, margin_m=margin_m)
            for p in polygons_from_rings(rings, kind, place, reading.findings)
        )
        return
    coordinates = reading.coordinates(element, place)
    if not coordinates:
        reading.findings.add(FindingLevel.ERROR, Code.EMPTY, place, f"the {shape} is empty", "draw it or remove it")
        return
    if not on_globe(coordinates, place, reading.findings):
        return
    lonlat = [(x, y) for x, y, _ in coordinates]
    if shape == "Point":
        if not (role or word or margin or reading.areas):
            reading.pins.append((track_points(lonlat)[0], coordinates[0][2], name))
            return
        _point(
            lonlat[0],
            coordinates[0][2],
            Mark(geometry=Point(lonlat[0]), kind=kind, name=name, margin_m=margin_m),
            role,
            reading,
        )
    elif role == "route":
        names = data_of.get("names", "").split("\n") if data_of.get("names") else [""] * len(lonlat)
        names += [""] * (len(lonlat) - len(names))
        reading.route.extend(
            (p, alt, n) for p, (_, _, alt), n in zip(track_points(lonlat), coordinates, names, strict=False)
        )
    elif role == "track":
        times = [number(t, reading.source, place) for t in data_of.get("times_s", "").split()]
        reading.tracks.append(
            Track(points=track_points(lonlat), times_s=tuple(times) if len(times) == len(lonlat) else None, name=name)
        )
    elif len(set(lonlat)) < 2:
        reading.findings.add(
            FindingLevel.ERROR, Code.DEGENERATE, place, "the line has fewer than two points", "draw it or remove it"
        )
    else:
        reading.marks.append(Mark(geometry=LineString(unwrapped(lonlat)), kind=kind, name=name, margin_m=margin_m))


def _point(lonlat: tuple[float, float], alt_m: float, mark: Mark, role: str, reading: _KmlReading) -> None:
    point = track_points([lonlat])[0]
    if role in {"home", "return"}:
        reading.places[role] = point
    elif role == "rally":
        reading.rally.append(
            MissionItem(
                command=Command.NAV_RALLY_POINT,
                lat_e7=round(point.lat_deg * 1e7),
                lon_e7=round(point.lon_deg * 1e7),
                alt_m=alt_m,
            )
        )
    else:
        reading.marks.append(mark)


def write_kml(document: Document) -> Written:
    """Return the document as KML."""
    losses = Losses()
    leave_out(
        losses,
        document,
        {"zones", "marks", "items", "item names", "rally", "return", "home", "tracks", "names", "margins"},
    )
    body: list[str] = []
    for zone in document.zones:
        polygon = as_polygon(zone, losses)
        body.append(_placemark(zone.name, _polygon(polygon), kind=zone.kind.value, margin_m=zone.margin_m))
    for mark in document.marks:
        body.append(_placemark(mark.name, _line(mark.geometry), kind=mark.kind.value, margin_m=mark.margin_m))
    points = route_of(document, losses)
    if points:
        text = " ".join(f"{decimal(p.lon_deg)},{decimal(p.lat_deg)},{decimal(a)}" for p, a, _ in points)
        shape = f"<LineString><tessellate>1</tessellate><coordinates>{text}</coordinates></LineString>"
        names = "\n".join(n.replace("\n", " ") for _, _, n in points) if any(n for _, _, n in points) else None
        body.append(_placemark("mission", shape, role="route", names=names))
    for role, point in (("home", document.home), ("return", document.return_point)):
        if point is not None:
            body.append(_placemark(role, _line(Point(point.lon_deg, point.lat_deg)), role=role))
    for item in document.rally:
        body.append(_placemark("rally", _line(Point(item.point.lon_deg, item.point.lat_deg, item.alt_m)), role="rally"))
    for track in document.tracks:
        line = " ".join(f"{decimal(p.lon_deg)},{decimal(p.lat_deg)}" for p in track.points)
        shape = f"<LineString><coordinates>{line}</coordinates></LineString>"
        times = " ".join(decimal(t) for t in track.times_s) if track.times_s is not None else None
        body.append(_placemark(track.name, shape, role="track", times_s=times))
    text = (
        '<?xml version="1.0" encoding="UTF-8"?>\n<kml xmlns="http://www.opengis.net/kml/2.2"><Document>\n'
        + "\n".join(body)
        + "\n</Document></kml>\n"
    )
    return Written(text.encode(), tuple(losses))


def write_kmz(document: Document) -> Written:
    """Return the document as KMZ."""
    written = write_kml(document)
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr(zipfile.ZipInfo("doc.kml", (2020, 1, 1, 0, 0, 0)), written.data, zipfile.ZIP_DEFLATED)
    return Written(buffer.getvalue(), written.losses)


def _placemark(name: str, shape: str, **data_of: object) -> str:
    entries = "".join(
        f'<Data name="{key}"><value>{escape(printable(str(value)))}</value></Data>'
        for key, value in data_of.items()
        if value is not None
    )
    return f"<Placemark><name>{escape(printable(name))}</name><ExtendedData>{entries}</ExtendedData>{shape}</Placemark>"


def _polygon(polygon: Polygon) -> str:
    outer, *inner = (
        f"<LinearRing><coordinates>{_tuples(ring.coords)}</coordinates></LinearRing>"
        for ring in (polygon.exterior, *polygon.interiors)
    )
    holes = "".join(f"<innerBoundaryIs>{ring}</innerBoundaryIs>" for ring in inner)
    return f"<Polygon><outerBoundaryIs>{outer}</outerBoundaryIs>{holes}</Polygon>"


def _line(geometry: Point | LineString) -> str:
    name = "Point" if isinstance(geometry, Point) else "LineString"
    return f"<{name}><coordinates>{_tuples(geometry.coords)}</coordinates></{name}>"


def _tuples(coordinates: Any) -> str:
    return " ".join(",".join([decimal(wrap_lon_deg(c[0])), *(decimal(v) for v in c[1:])]) for c in coordinates)
