"""All formats in one table, behind two functions: ``read`` looks at the content, ``write`` at the name it is given."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np
import shapely

from companion.errors import InputError
from companion.geo.frame import RANGE_M, LocalFrame
from companion.geofence.document import Code, Document, Finding, FindingLevel
from companion.geofence.formats.geojson import read_geojson, write_geojson
from companion.geofence.formats.losses import Losses, Written, leave_out
from companion.geofence.formats.mission_planner import (
    read_fen,
    read_poly,
    read_rally,
    read_waypoints,
    write_fen,
    write_poly,
    write_rally,
    write_waypoints,
)
from companion.geofence.formats.qgc_plan import read_plan, write_plan
from companion.geofence.formats.untrusted import decode, parse_json, read_bytes
from companion.geofence.formats.wkt import read_wkt, write_wkt
from companion.geofence.shapes import Circle, ZoneKind, center_of
from companion.messages import GeoPoint

_WKT_WORD = re.compile(
    r"\b(POINT|LINESTRING|LINEARRING|POLYGON|TRIANGLE|TIN|MULTI\w+|GEOMETRYCOLLECTION|POLYHEDRALSURFACE|"
    r"CURVEPOLYGON|CIRCULARSTRING|COMPOUNDCURVE)\s*+((ZM|Z|M)\s*+)?(\(|EMPTY)",
    re.IGNORECASE,
)
_PAIR = re.compile(r"\s*+-?\d++([.,]\d*+)?[\s;,]++-?\d")


@dataclass(frozen=True, kw_only=True)
class Content:
    """The bytes of a file, and what a reader is told beside them (see ``read``)."""

    data: bytes
    source: str
    extension: str = ""
    kind: ZoneKind = ZoneKind.EXCLUSION
    axis: str = "auto"
    areas: bool = False

    @property
    def is_zip(self) -> bool:
        """Return whether it is a compressed folder, as a KMZ is."""
        return self.data.startswith(b"PK")

    @cached_property
    def text(self) -> str:
        """The bytes as text; raises InputError where they are none."""
        return decode(self.data, self.source)

    @cached_property
    def head(self) -> str:
        """The first 4 kB that are not blank."""
        return self.text.lstrip()[:4096]

    @cached_property
    def lines(self) -> str:
        """The text without its comments (#)."""
        return "\n".join(line.split("#", 1)[0] for line in self.text.split("\n")).strip()

    @cached_property
    def is_json(self) -> bool:
        """Return whether it begins as JSON does."""
        return self.head[:1] in {"{", "["}

    @cached_property
    def xml_tag(self) -> str:
        """Its root, gpx or kml; empty for any other."""
        tag = re.search(r"<(?:\w+:)?(gpx|kml)\b", self.head, re.IGNORECASE) if self.head[:1] == "<" else None
        return tag.group(1).lower() if tag else ""

    @cached_property
    def has_names(self) -> bool:
        """Return whether it begins with the line that names a region."""
        return re.match(r"Name\s*:", self.lines, re.IGNORECASE) is not None

    @cached_property
    def pairs(self) -> list[str]:
        """Its lines, where each of them begins with two numbers; empty where one does not."""
        rows = [" ".join(row.split()) for row in self.lines.split("\n") if row.strip()]
        return rows if all(_PAIR.match(row) for row in rows) else []


@dataclass(frozen=True, slots=True, kw_only=True)
class Format:
    """A format: what people call it, how its files end, how it is known by its content, read and written.

    ``knows`` is asked in the order of the table, ``write`` is given the document and the part that is wanted.
    """

    name: str
    said: str
    endings: tuple[str, ...]
    knows: Callable[[Content], bool]
    read: Callable[[Content], Document]
    write: Callable[[Document, str], Written]


def _is_plan(content: Content) -> bool:
    if not content.is_json:
        return False
    root = parse_json(content.text, content.source).value
    return isinstance(root, dict) and "fileType" in root


def _is_fen(content: Content) -> bool:
    if content.extension == ".fen":
        return True
    rows = content.pairs
    return content.extension != ".poly" and not content.has_names and len(rows) > 3 and rows[1] == rows[-1]


# Formats of XML wait for the first such file: a boat that sails has none, and their libraries take 2 MB.
def _read_gpx(content: Content) -> Document:
    from companion.geofence.formats.gpx import read_gpx

    return read_gpx(content.data, content.source, kind=content.kind, areas=content.areas)


def _write_gpx(document: Document) -> Written:
    from companion.geofence.formats.gpx import write_gpx

    return write_gpx(document)


def _read_kml(content: Content) -> Document:
    from companion.geofence.formats.kml import read_kml

    return read_kml(content.data, content.source, kind=content.kind, areas=content.areas)


def _write_kml(document: Document) -> Written:
    from companion.geofence.formats.kml import write_kml

    return write_kml(document)


def _read_kmz(content: Content) -> Document:
    from companion.geofence.formats.kml import unzip_kmz

    inside = replace(content, data=unzip_kmz(content.data, content.source))
    return replace(_read_kml(inside), format="kmz")


def _write_kmz(document: Document) -> Written:
    from companion.geofence.formats.kml import write_kmz

    return write_kmz(document)


def _read_wkt(content: Content) -> Document:
    return read_wkt(content.text, content.source, kind=content.kind, latlon=content.axis == "latlon")


def _write_wkt(document: Document, *, srid: bool = False) -> Written:
    losses = Losses()
    leave_out(losses, document, {"zones", "marks", "names"})
    for zone in document.zones:
        if isinstance(zone.shape, Circle):
            losses.add(FindingLevel.NOTE, f"the circle {zone.name or '(unnamed)'} is drawn as a polygon")
    return Written(write_wkt(document, srid=srid).encode(), tuple(losses))


F = Format
# In the order in which a file's content is asked about them: what is certain first, what looks alike last.
# fmt: off
FORMATS: tuple[Format, ...] = (
    F(name="kmz", said="KMZ", endings=(".kmz",), knows=lambda c: c.is_zip,
      read=_read_kmz, write=lambda d, _: _write_kmz(d)),
    F(name="plan", said=".plan", endings=(".plan",), knows=_is_plan,
      read=lambda c: read_plan(c.text, c.source), write=lambda d, _: write_plan(d)),
    F(name="geojson", said="GeoJSON", endings=(".geojson", ".json"), knows=lambda c: c.is_json,
      read=lambda c: read_geojson(c.text, c.source, kind=c.kind, areas=c.areas), write=lambda d, _: write_geojson(d)),
    F(name="gpx", said="GPX", endings=(".gpx",), knows=lambda c: c.xml_tag == "gpx",
      read=_read_gpx, write=lambda d, _: _write_gpx(d)),
    F(name="kml", said="KML", endings=(".kml",), knows=lambda c: c.xml_tag == "kml",
      read=_read_kml, write=lambda d, _: _write_kml(d)),
    F(name="waypoints", said=".waypoints", endings=(".waypoints", ".txt"), knows=lambda c: c.head.startswith("QGC WPL"),
      read=lambda c: read_waypoints(c.text, c.source), write=lambda d, part: write_waypoints(d, part=part)),
    F(name="rally", said=".rally", endings=(".rally", ".ral"), knows=lambda c: c.lines.upper().startswith("RALLY"),
      read=lambda c: read_rally(c.text, c.source), write=lambda d, _: write_rally(d)),
    F(name="wkt", said="WKT", endings=(".wkt",),
      knows=lambda c: c.extension in {".wkt", ".ewkt"} or _WKT_WORD.search(c.lines) is not None,
      read=_read_wkt, write=lambda d, _: _write_wkt(d)),
    F(name="ewkt", said="EWKT", endings=(".ewkt",), knows=lambda _: False,  # read as WKT
      read=_read_wkt, write=lambda d, _: _write_wkt(d, srid=True)),
    F(name="fen", said=".fen", endings=(".fen",), knows=_is_fen,
      read=lambda c: read_fen(c.text, c.source), write=lambda d, _: write_fen(d)),
    F(name="poly", said=".poly", endings=(".poly",),
      knows=lambda c: c.extension == ".poly" or c.has_names or bool(c.pairs),
      read=lambda c: read_poly(c.text, c.source, kind=c.kind), write=lambda d, _: write_poly(d)),
)
# fmt: on
_BY_NAME = {row.name: row for row in FORMATS}
_BY_ENDING = {ending: row for row in FORMATS for ending in row.endings}


def read(
    path: str | Path,
    *,
    kind: ZoneKind = ZoneKind.EXCLUSION,
    axis: str = "auto",
    near: GeoPoint | None = None,
    areas: bool = False,
    far_m: float = RANGE_M,
) -> Document:
    """Read a file of any known format, told by its content.

    ``kind`` is what zones are when the format does not say. ``axis`` (``auto``, ``lonlat``, ``latlon``) is the
    order of coordinates in WKT; with ``auto`` it is longitude first, and with ``near`` (the place of the mission) a
    file that lies elsewhere is an error that suggests the swap. ``areas`` reads the lines of a GPX and the pins of a
    KML or GeoJSON as dangers or limits in place of routes. Raises InputError where the file cannot be understood at
    all; everything else that is wrong is in the document's findings.
    """
    path = Path(path)
    document = parse(read_bytes(path), str(path), kind=kind, axis=axis, areas=areas, extension=path.suffix.lower())
    return check_place(document, near, far_m) if near is not None else document


def parse(
    data: bytes,
    source: str,
    *,
    kind: ZoneKind = ZoneKind.EXCLUSION,
    axis: str = "auto",
    areas: bool = False,
    extension: str = "",
) -> Document:
    """Return what the bytes of a file hold; see ``read``. The extension only decides between what looks alike."""
    content = Content(data=data, source=source, extension=extension, kind=kind, axis=axis, areas=areas)
    if not content.is_zip and not content.head:
        raise InputError(source, "", "is empty", "export it again, or name another file")
    if not content.is_zip and content.head[0] == "<" and not content.xml_tag:
        raise InputError(source, "line 1", "is XML, but neither GPX nor KML")
    for row in FORMATS:
        if row.knows(content):
            return row.read(content)
    raise InputError(source, "line 1", f"starts with {content.head.splitlines()[0][:40]!r}: not {_any_of(FORMATS)}")


def _any_of(rows: Sequence[Format]) -> str:
    return ", ".join(row.said for row in rows[:-1]) + " or " + rows[-1].said


def format_of(path: str | Path, among: Sequence[str] = (), *, also: Sequence[str] = ()) -> str:
    """Return the format that a file name asks for. Raises InputError for one not ``among`` those (none: any).

    ``also``: what else may be written there, by others.
    """
    suffix = Path(path).suffix.lower()
    known = among or tuple(_BY_ENDING)
    if suffix not in known:
        raise InputError(
            str(path),
            "",
            f"{suffix or 'no extension'!r} is not a format that this can be written in",
            "use " + ", ".join((*also, *known)),
        )
    return _BY_ENDING[suffix].name


def write(document: Document, path: str | Path, *, format_name: str = "", part: str = "") -> Written:
    """Return the document in the format of ``path`` (or ``format_name``); nothing is written to the disc.

    ``part`` (mission, fence, rally) chooses what goes into a .waypoints file.
    """
    return _BY_NAME[format_name or format_of(path)].write(document, part)


def check_place(document: Document, near: GeoPoint, far_m: float = RANGE_M) -> Document:
    """Return the document with a finding if something of it lies more than ``far_m`` from ``near``.

    A fence by its middle, so that a corner that is wrong is told; all else by what is nearest, for a coast is long.
    """
    frame = LocalFrame(near)
    places = [
        (z.name or f"{noun} {i + 1}", z.shape, kind)
        for noun, kind in (("fence", ZoneKind.INCLUSION), ("obstacle", ZoneKind.EXCLUSION))
        for i, z in enumerate(z for z in document.zones if z.kind is kind)
    ]
    places += [(m.name or f"mark {i + 1}", m.geometry, ZoneKind.EXCLUSION) for i, m in enumerate(document.marks)]
    for name, shape, kind in places:
        center = center_of(shape)
        at, distance_m = center, float(np.hypot(*frame.en_from_geo(center)))
        if distance_m <= far_m or (not isinstance(shape, Circle) and _covers(shape, near)):
            continue
        if kind is ZoneKind.EXCLUSION and not isinstance(shape, Circle):
            at, distance_m = _nearest(shape, frame)
            if distance_m <= far_m:
                continue
        code, remedy = Code.FAR_AWAY, "check the coordinates"
        if abs(center.lon_deg) <= 90.0:
            swapped = GeoPoint(lat_deg=center.lon_deg, lon_deg=center.lat_deg)
            if float(np.hypot(*frame.en_from_geo(swapped))) <= far_m:
                code = Code.SWAPPED_AXES
                remedy = 'latitude and longitude look swapped: try --axis latlon (in a mission: axis = "latlon")'
        finding = Finding(
            severity=FindingLevel.ERROR,
            code=code,
            place=name,
            text=f"lies {distance_m / 1000.0:.0f} km from the mission, at {at.lat_deg:.4f}, {at.lon_deg:.4f}",
            remedy=remedy,
        )
        return replace(document, findings=(*document.findings, finding))
    return document


def _nearest(shape: shapely.Geometry, frame: LocalFrame) -> tuple[GeoPoint, float]:
    """Return the place of a shape in longitude and latitude that is nearest to a frame's origin, and how far [m]."""
    line = shapely.shortest_line(shapely.points(0.0, 0.0), shapely.transform(shape, frame.array_en_from_lonlat))
    return frame.geo_from_en(*line.coords[1]), float(line.length)


def _covers(shape: shapely.Geometry, point: GeoPoint) -> bool:
    return bool(shapely.covers(shape, shapely.points(point.lon_deg, point.lat_deg)))
