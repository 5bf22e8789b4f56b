"""WKT and EWKT: one geometry per statement, ``#`` comments, an optional ``name|kind|`` before it.

x is longitude and y latitude, as every program but a strict EPSG:4326 database writes them; ``axis`` says otherwise
or lets the place decide. The scanner is our own: ``shapely.from_wkt`` (2.2, GEOS 3.14) names no line, closes no ring or
all of them unsaid, and refuses SRID=, TRIANGLE, TIN and two geometries in one statement, which PostGIS and QGIS write.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry import LineString, Point
from shapely.geometry.base import BaseGeometry

from companion.errors import InputError
from companion.geofence.document import Code, Document, FindingLevel, Mark
from companion.geofence.formats.rings import Findings, polygons_from_rings
from companion.geofence.formats.untrusted import MAX_POSITIONS, require_shallow
from companion.geofence.shapes import Zone, ZoneKind, drawn, wrap_lon_deg

Coordinates = list[tuple[float, float]]

_LEXEME = re.compile(r"\s*(?:([A-Za-z]+)|([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)|([(),;]))")
_SRID = re.compile(r"\s*SRID\s*=\s*(\d+)\s*;", re.IGNORECASE)
_PREFIX = re.compile(r"([^|()]*)\|(?:([^|()]*)\|)?")
KINDS: dict[str, ZoneKind | None] = {  # what may stand between the bars
    "": None,
    "inclusion": ZoneKind.INCLUSION,
    "keep-in": ZoneKind.INCLUSION,
    "fence": ZoneKind.INCLUSION,
    "exclusion": ZoneKind.EXCLUSION,
    "keep-out": ZoneKind.EXCLUSION,
    "obstacle": ZoneKind.EXCLUSION,
}
_NAMES = {
    "POINT",
    "LINESTRING",
    "LINEARRING",
    "POLYGON",
    "TRIANGLE",
    "MULTIPOINT",
    "MULTILINESTRING",
    "MULTIPOLYGON",
    "GEOMETRYCOLLECTION",
    "POLYHEDRALSURFACE",
    "TIN",
}


@dataclass(frozen=True, slots=True)
class _Statement:
    line: int
    last: int
    name: str
    kind: ZoneKind | None
    text: str


@dataclass(frozen=True, slots=True)
class Drawing:
    """One statement of a WKT file as it was drawn, right or wrong, from ``line`` to ``last`` (from 1).

    ``geometries``: POLYGON with its rings, LINESTRING and POINT with their positions (x, y), any other None: empty.
    """

    line: int
    last: int
    name: str
    kind: ZoneKind | None
    geometries: tuple[tuple[str, object], ...]


def drawings_of(text: str, source: str) -> list[Drawing]:
    """Return the statements of a WKT text, each with what was drawn. Raises InputError where it is no WKT."""
    findings = Findings()
    return [
        Drawing(
            s.line, s.last, s.name, s.kind, tuple(_Scanner(s.text, source, s.line, findings, latlon=False).geometries())
        )
        for s in _statements(text, source)
    ]


def read_wkt(text: str, source: str, *, kind: ZoneKind = ZoneKind.EXCLUSION, latlon: bool = False) -> Document:
    """Return what a WKT text holds; geometries without a kind of their own are of ``kind``.

    ``latlon`` reads x as latitude, as strict EPSG:4326 databases write.

    Raises InputError where the text is no WKT; everything else that is wrong is in the findings.
    """
    findings = Findings()
    zones: list[Zone] = []
    marks: list[Mark] = []
    held = 0
    for statement in _statements(text, source):
        place = f"line {statement.line}"
        scanner = _Scanner(statement.text, source, statement.line, findings, latlon=latlon)
        for name, body in scanner.geometries():
            if held + scanner.positions > MAX_POSITIONS:
                raise InputError(source, place, f"holds more than {MAX_POSITIONS} positions", "simplify it")
            _collect(name, body, statement, kind, findings=findings, zones=zones, marks=marks)
        held += scanner.positions
    if not zones and not marks and not findings:
        findings.add(FindingLevel.ERROR, Code.EMPTY, "", "holds no geometry", "an empty file is not 'no obstacles'")
    return Document(source=source, format="wkt", zones=tuple(zones), marks=tuple(marks), findings=tuple(findings))


def _collect(
    name: str,
    body: object,
    statement: _Statement,
    kind: ZoneKind,
    *,
    findings: Findings,
    zones: list[Zone],
    marks: list[Mark],
) -> None:
    own, place = statement.kind or kind, f"line {statement.line}"
    if body is None:
        findings.add(
            FindingLevel.ERROR,
            Code.EMPTY,
            place,
            f"{name} EMPTY holds nothing",
            "draw it or remove it; an empty obstacle is not 'no obstacles'",
        )
        return
    if name in {"POINT", "LINESTRING"}:
        coordinates = [tuple(c) for c in body] if isinstance(body, list) else []
        if any(abs(y) > 90.0 or abs(x) > 360.0 for x, y in coordinates):
            findings.add(
                FindingLevel.ERROR,
                Code.SWAPPED_AXES,
                place,
                "a position is not on the globe (lat ±90, lon ±180)",
                "are they swapped? try --axis latlon",
            )
            return
        geometry = Point(coordinates[0]) if name == "POINT" or len(set(coordinates)) == 1 else LineString(coordinates)
        marks.append(Mark(geometry=geometry, kind=own, name=statement.name))
        return
    rings = body if isinstance(body, list) else []
    zones.extend(
        Zone(kind=own, shape=polygon, name=statement.name)
        for polygon in polygons_from_rings(rings, own, place, findings)
    )


def _statements(text: str, source: str) -> Iterator[_Statement]:
    """Yield the statements: a geometry may run over several lines; it ends where its brackets close."""
    require_shallow("\n".join(line.split("#", 1)[0] for line in text.split("\n")), source)
    pending: list[str] = []  # the lines of the statement being gathered
    start, depth, is_whole = 0, 0, False
    for number, raw in enumerate(text.split("\n"), start=1):
        line = raw.split("#", 1)[0].rstrip()
        if not line.strip():
            continue
        if not pending:
            start = number
        pending.append(line)
        depth += line.count("(") - line.count(")")
        is_whole = is_whole or "(" in line or "EMPTY" in line.upper()
        if depth <= 0 and is_whole:
            yield _statement("\n".join(pending), start, number, source)
            pending, depth, is_whole = [], 0, False
    if pending:
        text = "\n".join(pending)
        if "(" in text:
            raise InputError(source, f"line {start}", "the geometry's brackets do not close", "is the file cut off?")
        raise InputError(source, f"line {start}", f"{text.strip()[:40]!r} is not WKT", _hint(text))


def _statement(text: str, line: int, last: int, source: str) -> _Statement:
    name, kind = "", None
    prefix = _PREFIX.match(text)
    if prefix:
        name = prefix.group(1).strip()
        word = (prefix.group(2) or "").strip().lower()
        if prefix.group(2) is None and name.lower() in KINDS:
            name, word = "", name.lower()
        if word not in KINDS:
            raise InputError(source, f"line {line}", f"{word!r} is not a kind", "write inclusion or exclusion")
        kind = KINDS[word]
        text = text[prefix.end() :]
    return _Statement(line, last, name, kind, text)


def _hint(text: str) -> str:
    if "," in text and "(" not in text:
        return "is it CSV? write POLYGON ((lon lat, lon lat, ...))"
    return "write POLYGON ((lon lat, lon lat, ...))"


class _Scanner:
    """Reads the geometries of one statement; nested collections come out flat."""

    def __init__(self, text: str, source: str, line: int, findings: Findings, *, latlon: bool) -> None:
        self._latlon = latlon
        self._source, self._line, self._findings = source, line, findings
        self._text, self._at, self._counted = text, 0, 0
        self.positions = 0
        srid = _SRID.match(text)
        if srid:
            self._at = srid.end()
            if srid.group(1) not in {"0", "4326"}:
                findings.add(
                    FindingLevel.ERROR,
                    Code.WRONG_SRID,
                    f"line {line}",
                    f"SRID {srid.group(1)} is not WGS 84 degrees",
                    "transform it to EPSG:4326 first (ST_Transform, QGIS 'Save as')",
                )
        self._kind, self._word = self._next()

    def _place(self) -> str:
        self._line += self._text.count("\n", self._counted, self._at)
        self._counted = self._at
        return f"line {self._line}"

    def _fail(self, problem: str, remedy: str = "") -> InputError:
        return InputError(self._source, self._place(), problem, remedy)

    def _next(self) -> tuple[str, str]:
        match = _LEXEME.match(self._text, self._at)
        if not match:
            rest = self._text[self._at :].strip()
            if rest:
                raise self._fail(f"{rest[:20]!r} does not belong in WKT", _hint(rest))
            return "end", ""
        self._at = match.end()
        word, figure, mark = match.groups()
        return ("word", word.upper()) if word else ("number", figure) if figure else ("mark", mark)

    def _advance(self) -> None:
        self._kind, self._word = self._next()

    def _expect(self, mark: str) -> None:
        if self._word != mark:
            shown = repr(self._word) if self._word else "the end"
            raise self._fail(f"{shown} where {mark!r} should be")
        self._advance()

    def geometries(self) -> Iterator[tuple[str, object]]:
        """Yield (name, body): a list of rings for polygons, of positions for points and lines, None for EMPTY."""
        while self._kind != "end":
            yield from self._geometry()
            while self._word in {";", ","}:
                self._advance()

    def _geometry(self) -> Iterator[tuple[str, object]]:
        name = self._word
        dims = ""
        for suffix in ("ZM", "Z", "M"):
            if name not in _NAMES and name.endswith(suffix) and name[: -len(suffix)] in _NAMES:
                name, dims = name[: -len(suffix)], suffix
                break
        if self._kind != "word" or name not in _NAMES:
            known = "CURVE" in name or "SURFACE" in name or name == "CIRCULARSTRING"
            raise self._fail(
                f"{self._word[:30]!r} is not a geometry of WKT, as which this file is read",
                "draw the curve as a polygon" if known else _hint(self._text),
            )
        self._advance()
        if self._kind == "word" and self._word in {"Z", "M", "ZM"}:
            dims = self._word
            self._advance()
        if self._kind == "word" and self._word == "EMPTY":
            self._advance()
            yield name, None
            return
        if dims:
            self._findings.add(FindingLevel.NOTE, Code.DROPPED, self._place(), f"the {dims} coordinates are not used")
        yield from self._body(name)

    def _body(self, name: str) -> Iterator[tuple[str, object]]:
        if name == "POINT":
            self._expect("(")
            yield "POINT", [self._position()]
            self._expect(")")
        elif name in {"LINESTRING", "LINEARRING"}:
            yield "LINESTRING", self._positions()
        elif name in {"POLYGON", "TRIANGLE"}:
            yield "POLYGON", self._rings()
        elif name == "MULTIPOINT":
            self._expect("(")
            while True:
                bracket = self._word == "("
                if bracket:
                    self._advance()
                yield "POINT", [self._position()]
                if bracket:
                    self._expect(")")
                if not self._comma():
                    break
            self._expect(")")
        else:
            self._expect("(")
            while True:
                if self._kind == "word" and self._word == "EMPTY":
                    self._advance()
                    yield name.removeprefix("MULTI"), None
                elif name == "MULTILINESTRING":
                    yield "LINESTRING", self._positions()
                elif name == "GEOMETRYCOLLECTION":
                    yield from self._geometry()
                else:
                    yield "POLYGON", self._rings()
                if not self._comma():
                    break
            self._expect(")")

    def _comma(self) -> bool:
        if self._word == ",":
            self._advance()
            return True
        return False

    def _rings(self) -> list[Coordinates]:
        self._expect("(")
        rings: list[Coordinates] = []
        while True:
            if self._kind == "word" and self._word == "EMPTY":
                self._advance()
                rings.append([])
            else:
                rings.append(self._positions())
            if not self._comma():
                break
        self._expect(")")
        return rings

    def _positions(self) -> Coordinates:
        self._expect("(")
        positions = [self._position()]
        while self._comma():
            positions.append(self._position())
        self._expect(")")
        return positions

    def _position(self) -> tuple[float, float]:
        values: list[float] = []
        while True:
            if self._kind == "number":
                values.append(float(self._word))
            elif self._kind == "word" and self._word in {"NAN", "INF", "INFINITY"}:
                raise self._fail(f"{self._word} is not a finite number", "write degrees")
            else:
                break
            self._advance()
        if not 2 <= len(values) <= 4:
            remedy = "separate longitude and latitude by a space, positions by a comma, decimals by a point"
            raise self._fail(f"a position has {len(values)} numbers, not 2 (lon lat)", remedy)
        if not all(math.isfinite(v) for v in values):
            raise self._fail("a coordinate is not a finite number", "write degrees")
        self.positions += 1
        return (values[1], values[0]) if self._latlon else (values[0], values[1])


def write_wkt(document: Document, *, srid: bool = False) -> str:
    """Return the document's zones and marks as WKT, ``name|kind|`` before each, one per line, full precision."""
    lines = ["# name|kind|WKT, longitude before latitude (WGS 84)"]
    for name, kind, geometry in _geometries(document):
        wkt = shapely.to_wkt(geometry, rounding_precision=-1)
        lines.append(f"{_clean(name)}|{kind.value}|{'SRID=4326;' if srid else ''}{wkt}")
    return "\n".join(lines) + "\n"


def _geometries(document: Document) -> Iterator[tuple[str, ZoneKind, BaseGeometry]]:
    for zone in document.zones:
        yield zone.name, zone.kind, wrapped(drawn(zone))
    for mark in document.marks:
        yield mark.name, mark.kind, wrapped(mark.geometry)


def wrapped(geometry: BaseGeometry) -> BaseGeometry:
    """Return the geometry with every longitude on ±180, as files have it."""

    def bring(coordinates: NDArray[np.float64]) -> NDArray[np.float64]:
        out = coordinates.copy()
        out[:, 0] = [wrap_lon_deg(float(x)) for x in out[:, 0]]
        return out

    return shapely.transform(geometry, bring)


def _clean(name: str) -> str:
    return re.sub(r"[|()#\s]+", " ", name).strip()
