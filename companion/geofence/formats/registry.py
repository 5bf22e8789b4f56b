"""All formats behind two functions: ``read`` looks at the content, ``write`` at the name it is given."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import shapely

from companion.errors import InputError
from companion.geo.frame import LocalFrame
from companion.geofence.document import Document
from companion.geofence.findings import Code, Finding, Severity
from companion.geofence.formats.geojson import read_geojson, write_geojson
from companion.geofence.formats.gpx import read_gpx, write_gpx
from companion.geofence.formats.json_node import parse_json
from companion.geofence.formats.kml import read_kml, unzip_kmz, write_kml, write_kmz
from companion.geofence.formats.losses import Losses, Written, leave_out
from companion.geofence.formats.mission_planner import (
    read_fen,
    read_poly,
    read_rally,
    write_fen,
    write_poly,
    write_rally,
)
from companion.geofence.formats.qgc_plan import read_plan, write_plan
from companion.geofence.formats.text import decode, read_bytes
from companion.geofence.formats.wkt import read_wkt, write_wkt
from companion.geofence.formats.wpl import read_waypoints, write_waypoints
from companion.geofence.shapes import Circle, ZoneKind, center_of
from companion.messages import GeoPoint

FAR_M = 50_000.0  # what lies farther from the mission is a mistake

EXTENSIONS = {
    ".wkt": "wkt", ".ewkt": "ewkt", ".geojson": "geojson", ".json": "geojson", ".plan": "plan",
    ".waypoints": "waypoints", ".txt": "waypoints", ".fen": "fen", ".poly": "poly", ".rally": "rally", ".ral": "rally",
    ".gpx": "gpx", ".kml": "kml", ".kmz": "kmz",
}
_WKT_WORD = re.compile(
    r"\b(POINT|LINESTRING|LINEARRING|POLYGON|TRIANGLE|TIN|MULTI\w+|GEOMETRYCOLLECTION|POLYHEDRALSURFACE|"
    r"CURVEPOLYGON|CIRCULARSTRING|COMPOUNDCURVE)\s*+((ZM|Z|M)\s*+)?(\(|EMPTY)", re.IGNORECASE,
)
_PAIR = re.compile(r"\s*+-?\d++([.,]\d*+)?[\s;,]++-?\d")


def read(
    path: str | Path, *, kind: ZoneKind = ZoneKind.EXCLUSION, axis: str = "auto", near: GeoPoint | None = None,
    areas: bool = False,
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
    return check_place(document, near) if near is not None else document


def parse(
    data: bytes, source: str, *, kind: ZoneKind = ZoneKind.EXCLUSION, axis: str = "auto", areas: bool = False,
    extension: str = "",
) -> Document:
    """Return what the bytes of a file hold; see ``read``."""
    if data.startswith(b"PK"):
        return replace(read_kml(unzip_kmz(data, source), source, kind=kind, areas=areas), format="kmz")
    name = sniff(data, source, extension)
    if name == "kml":
        return read_kml(data, source, kind=kind, areas=areas)
    if name == "gpx":
        return read_gpx(data, source, kind=kind, areas=areas)
    text = decode(data, source)
    if name == "wkt":
        return read_wkt(text, source, kind=kind, latlon=axis == "latlon")
    if name == "geojson":
        return read_geojson(text, source, kind=kind, areas=areas)
    if name == "poly":
        return read_poly(text, source, kind=kind)
    plain: dict[str, Callable[[str, str], Document]] = {
        "plan": read_plan, "waypoints": read_waypoints, "fen": read_fen, "rally": read_rally,
    }
    return plain[name](text, source)


def sniff(data: bytes, source: str, extension: str = "") -> str:
    """Return the format of a file's content; the extension only decides between .fen and .poly.

    Raises InputError when it is none of ours.
    """
    text = decode(data, source)
    head = text.lstrip()[:4096]
    if not head:
        raise InputError(source, "", "is empty", "an empty file is not 'no obstacles'")
    if head[0] in "{[":
        root = parse_json(text, source)
        return "plan" if isinstance(root.value, dict) and "fileType" in root.value else "geojson"
    if head[0] == "<":
        tag = re.search(r"<(?:\w+:)?(gpx|kml)\b", head, re.IGNORECASE)
        if tag:
            return tag.group(1).lower()
        raise InputError(source, "line 1", "is XML, but neither GPX nor KML")
    if head.startswith("QGC WPL"):
        return "waypoints"
    content = "\n".join(line.split("#", 1)[0] for line in text.split("\n")).strip()
    if content.upper().startswith("RALLY"):
        return "rally"
    if _WKT_WORD.search(content) or extension in {".wkt", ".ewkt"}:
        return "wkt"
    if extension == ".fen":
        return "fen"
    if extension == ".poly" or re.match(r"Name\s*:", content, re.IGNORECASE):
        return "poly"
    rows = [" ".join(r.split()) for r in content.split("\n") if r.strip()]
    if rows and all(_PAIR.match(r) for r in rows):
        return "fen" if len(rows) > 3 and rows[1] == rows[-1] else "poly"
    known = "WKT, GeoJSON, .plan, .waypoints, .fen, .poly, GPX, KML or KMZ"
    raise InputError(source, "line 1", f"starts with {head.splitlines()[0][:40]!r}: not {known}")


def format_of(path: str | Path, among: Sequence[str] = tuple(EXTENSIONS)) -> str:
    """Return the format that a file name asks for. Raises InputError for an extension that is not ``among`` those."""
    suffix = Path(path).suffix.lower()
    if suffix not in among:
        raise InputError(str(path), "", f"{suffix or 'no extension'!r} is not a format that this can be written in",
                         "use " + ", ".join(among))
    return EXTENSIONS[suffix]


def write(document: Document, path: str | Path, *, format_name: str = "", part: str = "") -> Written:
    """Return the document in the format of ``path`` (or ``format_name``); nothing is written to the disc.

    ``part`` (mission, fence, rally) chooses what goes into a .waypoints file.
    """
    name = format_name or format_of(path)
    if name in {"wkt", "ewkt"}:
        losses = Losses()
        leave_out(losses, document, {"zones", "marks", "names"})
        for zone in document.zones:
            if isinstance(zone.shape, Circle):
                losses.add(Severity.NOTE, f"the circle {zone.name or '(unnamed)'} is drawn as a polygon")
        return Written(write_wkt(document, srid=name == "ewkt").encode(), tuple(losses))
    if name == "waypoints":
        return write_waypoints(document, part=part)
    writers: dict[str, Callable[[Document], Written]] = {
        "geojson": write_geojson, "plan": write_plan, "fen": write_fen, "poly": write_poly, "rally": write_rally,
        "gpx": write_gpx, "kml": write_kml, "kmz": write_kmz,
    }
    return writers[name](document)


def check_place(document: Document, near: GeoPoint) -> Document:
    """Return the document with a finding if part of it lies more than 50 km from ``near``."""
    frame = LocalFrame(near)
    places = [(z.name or f"zone {i + 1}", z.shape) for i, z in enumerate(document.zones)]
    places += [(m.name or f"mark {i + 1}", m.geometry) for i, m in enumerate(document.marks)]
    for name, shape in places:
        center = center_of(shape)
        distance_m = float(np.hypot(*frame.en_from_geo(center)))
        if distance_m <= FAR_M or (not isinstance(shape, Circle) and _covers(shape, near)):
            continue
        code, remedy = Code.FAR_AWAY, "check the coordinates"
        if abs(center.lon_deg) <= 90.0:
            swapped = GeoPoint(lat_deg=center.lon_deg, lon_deg=center.lat_deg)
            if float(np.hypot(*frame.en_from_geo(swapped))) <= FAR_M:
                code = Code.SWAPPED_AXES
                remedy = 'latitude and longitude look swapped: try --axis latlon (in a mission: axis = "latlon")'
        finding = Finding(
            severity=Severity.ERROR, code=code, place=name,
            text=f"lies {distance_m / 1000.0:.0f} km from the mission, at {center.lat_deg:.4f}, {center.lon_deg:.4f}",
            remedy=remedy,
        )
        return replace(document, findings=(*document.findings, finding))
    return document


def _covers(shape: shapely.Geometry, point: GeoPoint) -> bool:
    return bool(shapely.covers(shape, shapely.points(point.lon_deg, point.lat_deg)))
