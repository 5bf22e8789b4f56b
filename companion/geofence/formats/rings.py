"""From the rings that files write to polygons that hold: closing, crossing, degenerate, swapped, far away.

A repair never lets the sea grow: a keep-out zone is repaired to every face that its lines enclose, a keep-in zone
only to the faces that its lines enclose an odd number of times.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry import Polygon
from shapely.geometry.base import BaseGeometry

from companion.geo import DEGREE_M
from companion.geofence.document import Code, Finding, FindingLevel
from companion.geofence.shapes import ZoneKind, unwrapped

Ring = Sequence[Sequence[float]]

# A tangle worse than this is not repaired: n edges can cross n² / 2 times, so a small file would take hours.
MAX_CROSSINGS = 5000
MAX_FACES = 2000  # of a self-crossing keep-in ring ...
MAX_FACE_EDGES = 50_000_000  # ... and that times its edges: each face is held against each edge
HOPELESS_EDGES = 20_000  # from here on GEOS takes too long to see that a tangle is none of its business ...
HOPELESS_CROSSINGS = 500_000  # ... as one with more crossings than this is
DATE_LINE_DEG = 30.0  # a ring across the antimeridian that is wider is worth a word; a bay there is not
_DRAWN = 32

_TANGLED = "it is too tangled to be repaired"
_REDRAW = "redraw it, or write the repair with 'companion fence convert --repair'"


class Findings(list[Finding]):
    """The findings of one reading, in order."""

    def add(self, severity: FindingLevel, code: Code, place: str, text: str, remedy: str = "") -> None:
        """Append one finding."""
        self.append(Finding(severity=severity, code=code, place=place, text=text, remedy=remedy))


def polygons_from_rings(
    rings: Sequence[Ring], kind: ZoneKind, place: str, findings: Findings, *, closed: bool = True
) -> list[Polygon]:
    """Return the valid polygons that an outer ring and its holes (lon, lat) describe; none when nothing is left.

    ``closed`` says that the format repeats the first vertex, so that a missing repetition is a finding. What is
    wrong is added to ``findings`` with ``place``; the polygons are what a repair would make of it.
    """
    fixed: list[NDArray[np.float64]] = []
    for index, ring in enumerate(rings):
        where = place if index == 0 else f"{place} hole {index}"
        coordinates = np.array([[float(c[0]), float(c[1])] for c in ring], dtype=np.float64).reshape(-1, 2)
        coordinates = _ring(coordinates, where, findings, closed=closed)
        if coordinates.shape[0] == 0:
            if index == 0:
                return []
            continue
        if fixed:
            coordinates = unwrapped(coordinates, near_lon_deg=float(fixed[0][0, 0]))
        fixed.append(coordinates)
    if not fixed:
        findings.add(FindingLevel.ERROR, Code.EMPTY, place, "the polygon has no vertices", "draw it or remove it")
        return []
    polygon = Polygon(fixed[0], fixed[1:])
    if is_hopeless(polygon):
        findings.add(FindingLevel.ERROR, Code.SELF_CROSSING, place, f"the ring crosses itself; {_TANGLED}", _REDRAW)
        return []
    if polygon.is_valid and polygon.area > 0.0:
        return [polygon]
    return _repaired(polygon, kind, place, findings)


def _ring(coordinates: NDArray[np.float64], place: str, findings: Findings, *, closed: bool) -> NDArray[np.float64]:
    """Return the ring closed, finite and continuous; an empty array when it is no ring."""
    if coordinates.shape[0] == 0:
        findings.add(FindingLevel.ERROR, Code.EMPTY, place, "the ring has no vertices", "draw it or remove it")
        return coordinates
    bad = ~np.isfinite(coordinates).all(axis=1)
    if bad.any():
        findings.add(
            FindingLevel.ERROR,
            Code.NOT_FINITE,
            f"{place} vertex {int(np.argmax(bad)) + 1}",
            "a coordinate is not a finite number",
            "write degrees",
        )
        return np.empty((0, 2))
    is_closed = coordinates.shape[0] > 1 and bool(np.array_equal(coordinates[0], coordinates[-1]))
    if not is_closed:
        if closed:
            findings.add(
                FindingLevel.ERROR,
                Code.UNCLOSED,
                place,
                f"the ring is not closed: it starts at {_at(coordinates[0])} and ends at {_at(coordinates[-1])}",
                "repeat the first vertex at the end (a repair would)",
            )
        coordinates = np.vstack([coordinates, coordinates[:1]])
    # numpy's unique would load its masked arrays: a megabyte for as long as she sails
    others = coordinates[np.any(coordinates != coordinates[0], axis=1)]
    if not np.any(others != others[:1]):
        findings.add(
            FindingLevel.ERROR,
            Code.DEGENERATE,
            place,
            "the ring has fewer than three different vertices",
            "draw an area, or a POINT or LINESTRING with a radius",
        )
        return np.empty((0, 2))
    if not on_globe(coordinates, place, findings):
        return np.empty((0, 2))
    if float(np.ptp(coordinates[:, 0])) > 180.0:
        coordinates = unwrapped(coordinates)
        if float(np.ptp(coordinates[:, 0])) > DATE_LINE_DEG:
            findings.add(
                FindingLevel.WARNING,
                Code.ANTIMERIDIAN,
                place,
                "the ring spans more than 180 degrees of longitude and is read as crossing the antimeridian",
            )
        if not math.isclose(coordinates[0, 0], coordinates[-1, 0], abs_tol=1e-6):
            findings.add(FindingLevel.ERROR, Code.ANTIMERIDIAN, place, "the ring goes round a pole", "cut it in two")
            return np.empty((0, 2))
    return coordinates


def on_globe(points: Sequence[Sequence[float]] | NDArray[np.float64], place: str, findings: Findings) -> bool:
    """Return whether every position (longitude, latitude, and what follows) exists, with a finding if not."""
    lonlat = np.array([[float(p[0]), float(p[1])] for p in points], dtype=np.float64).reshape(-1, 2)
    lat_bad, lon_bad = np.abs(lonlat[:, 1]) > 90.0, np.abs(lonlat[:, 0]) > 360.0
    if lat_bad.any():
        lon_deg, lat_deg = lonlat[int(np.argmax(lat_bad))].tolist()
        is_swapped = abs(lon_deg) <= 90.0
        findings.add(
            FindingLevel.ERROR,
            Code.SWAPPED_AXES if is_swapped else Code.OUT_OF_RANGE,
            place,
            f"latitude {lat_deg:g} is outside ±90 degrees",
            'latitude and longitude look swapped: swap them, or of a WKT say --axis latlon (or axis = "latlon")'
            if is_swapped
            else "write WGS 84 degrees",
        )
    elif lon_bad.any():
        findings.add(
            FindingLevel.ERROR,
            Code.OUT_OF_RANGE,
            place,
            f"longitude {lonlat[int(np.argmax(lon_bad)), 0]:g} is outside ±180 degrees",
            "write WGS 84 degrees",
        )
    return not (lat_bad.any() or lon_bad.any())


def _repaired(polygon: Polygon, kind: ZoneKind, place: str, findings: Findings) -> list[Polygon]:
    """Return a safe repair of an invalid polygon, and say what it does."""
    reason = shapely.is_valid_reason(polygon)
    tangled = is_tangled(polygon)
    try:
        fixed = Polygon() if tangled else enclosed_faces(polygon) if kind is ZoneKind.EXCLUSION else odd_faces(polygon)
    except shapely.errors.GEOSException:  # lines too close together for double precision
        fixed = Polygon()
    pieces = [p for p in shapely.get_parts(fixed) if isinstance(p, Polygon) and p.area > 0.0]
    effect = (
        f"a repair would make {len(pieces)} polygon{'s' if len(pieces) != 1 else ''} of "
        f"{_hectares(pieces)} ha in place of {_hectares([polygon])} ha"
        if pieces
        else _TANGLED
        if tangled
        else "nothing would be left of it"
    )
    code = Code.SELF_CROSSING if "intersect" in reason.lower() else Code.DEGENERATE
    name = "the ring crosses itself" if code is Code.SELF_CROSSING else "the polygon is not valid"
    findings.add(FindingLevel.ERROR, code, place, f"{name} ({_plain(reason)}); {effect}", _REDRAW)
    return pieces


def _edges(polygon: Polygon) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return where the edges of all rings begin and end, (n, 2) each."""
    rings = [np.asarray(r.coords)[:, :2] for r in (polygon.exterior, *polygon.interiors)]
    return np.vstack([r[:-1] for r in rings]), np.vstack([r[1:] for r in rings])


def is_hopeless(polygon: Polygon) -> bool:
    """Return whether a large polygon crosses itself at every turn, judged by a few of its edges."""
    start, end = _edges(polygon)
    n = len(start)
    if n < HOPELESS_EDGES:
        return False

    def side(a: NDArray[np.float64], b: NDArray[np.float64], c: NDArray[np.float64]) -> NDArray[np.float64]:
        east, north = (b - a).T
        return np.asarray(east * (c[:, 1] - a[:, 1]) - north * (c[:, 0] - a[:, 0]))

    crossings = 0
    for k in np.random.default_rng(0).choice(n, _DRAWN, replace=False):
        a, b = start[k : k + 1], end[k : k + 1]
        cut = (side(a, b, start) * side(a, b, end) < 0.0) & (side(start, end, a) * side(start, end, b) < 0.0)
        crossings += int(np.count_nonzero(cut))
    return crossings * n > 2 * _DRAWN * HOPELESS_CROSSINGS


def is_tangled(polygon: Polygon) -> bool:
    """Return whether the rings' edges cross more than ``MAX_CROSSINGS`` times.

    The edges are looked at in a drawn order, twice as many at a time while few cross: the pairs that are found, and
    with them time and memory, stay near the limit whatever the file.
    """
    edges = shapely.linestrings(np.stack(_edges(polygon), axis=1))
    tree = shapely.STRtree(edges)
    order = np.random.default_rng(0).permutation(len(edges))
    seen = pairs = 0
    while seen < len(edges):
        some = order[seen : 2 * seen + 1]
        pairs += tree.query(edges[some], predicate="intersects").shape[1] - 3 * len(some)  # itself and its neighbours
        seen += len(some)
        if pairs > 2 * MAX_CROSSINGS:  # each is found from both edges
            return True
    return False


def enclosed_faces(polygon: Polygon) -> BaseGeometry:
    """Return every face that the outer ring encloses, less the faces that lie wholly within proper holes."""
    outer = shapely.union_all(shapely.get_parts(shapely.polygonize([shapely.node(polygon.exterior)])))
    holes = [Polygon(ring) for ring in polygon.interiors]
    good = [h for h in holes if h.is_valid and shapely.covers(outer, h)]
    return shapely.difference(outer, shapely.union_all(good)) if good else outer


def odd_faces(polygon: Polygon) -> BaseGeometry:
    """Return the faces that the rings enclose an odd number of times (the even-odd rule); none of a tangle."""
    rings = [np.asarray(r.coords)[:, :2] for r in (polygon.exterior, *polygon.interiors)]
    lines = shapely.union_all([shapely.linestrings(r) for r in rings])
    faces = [f for f in shapely.get_parts(shapely.polygonize(shapely.get_parts(lines))) if f.area > 0.0]
    start, end = _edges(polygon)
    if len(faces) > MAX_FACES or len(faces) * len(start) > MAX_FACE_EDGES:
        return Polygon()
    odd = []
    for face in faces:
        inside = face.representative_point()
        spans = (start[:, 1] > inside.y) != (end[:, 1] > inside.y)
        (x0, y0), (x1, y1) = start[spans].T, end[spans].T
        if np.count_nonzero(inside.x < x0 + (inside.y - y0) * (x1 - x0) / (y1 - y0)) % 2 == 1:
            odd.append(face)
    return shapely.union_all(odd) if odd else Polygon()


def _plain(reason: str) -> str:
    head, _, where = reason.partition("[")
    return f"{head.strip().lower()} at {where.rstrip(']')}" if where else head.strip().lower()


def _hectares(polygons: Sequence[Polygon]) -> str:
    """Return an area in hectares, good to a percent: degrees scaled at the polygon's latitude."""
    total = sum(
        abs(p.area) * DEGREE_M**2 * math.cos(math.radians(min(89.9, abs(p.exterior.coords[0][1])))) / 1e4
        for p in polygons
    )
    return f"{total:.3g}"


def _at(coordinate: NDArray[np.float64]) -> str:
    return f"lon {coordinate[0]:.7g} lat {coordinate[1]:.7g}"
