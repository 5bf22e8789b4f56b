"""Mission Planner's old text files: .fen (return point, then one fence ring), .poly (one ring), rally lines.

``lat lon`` per line, the first vertex repeated at the end, ``#`` comments. Old versions wrote decimal commas. The
*Regions* variant of .poly names its rings with ``Name:`` lines.
"""

from __future__ import annotations

import re

from companion.errors import InputError
from companion.geofence.document import Document
from companion.geofence.findings import Code, Severity
from companion.geofence.formats.fence_items import ring_of
from companion.geofence.formats.losses import Losses, Written, as_polygon, leave_out, without_holes
from companion.geofence.formats.raw.text import MAX_POSITIONS, number, point_commas
from companion.geofence.formats.rings import Findings, polygons_from_rings
from companion.geofence.formats.wpl import decimal
from companion.geofence.shapes import Zone, ZoneKind, wrap_lon_deg
from companion.messages import Command, GeoPoint, MissionItem

Row = tuple[float, float, str]  # lon, lat, place


def read_fen(text: str, source: str) -> Document:
    """Return a .fen: the first data line is the return point, the rest the closed keep-in ring."""
    findings = Findings()
    rows = _rows(text.split("\n"), source, findings)
    if len(rows) < 2:
        findings.add(Severity.ERROR, Code.EMPTY, "", "holds no fence ring",
                     "line 1 is the return point, the ring follows")
        return Document(source=source, format="fen", findings=tuple(findings))
    lon_deg, lat_deg, place = rows[0]
    return_point = None
    if abs(lat_deg) <= 90.0:
        return_point = GeoPoint(lat_deg=lat_deg, lon_deg=wrap_lon_deg(lon_deg))
    else:
        findings.add(Severity.ERROR, Code.SWAPPED_AXES, place, f"latitude {lat_deg:g} is outside ±90 degrees",
                     "a .fen writes latitude before longitude")
    polygons = polygons_from_rings([[r[:2] for r in rows[1:]]], ZoneKind.INCLUSION, "ring", findings)
    return Document(
        source=source, format="fen", zones=tuple(Zone(kind=ZoneKind.INCLUSION, shape=p) for p in polygons),
        return_point=return_point, findings=tuple(findings),
    )


def read_poly(text: str, source: str, *, kind: ZoneKind = ZoneKind.EXCLUSION) -> Document:
    """Return a .poly: one closed ring, or several named ones in the Regions variant."""
    findings = Findings()
    zones: list[Zone] = []
    blocks: list[tuple[str, int, list[str]]] = [("", 1, [])]   # name, number of the first line, lines
    for line_number, raw in enumerate(text.split("\n"), start=1):
        named = re.match(r"\s*Name\s*:(.*)", raw, re.IGNORECASE)
        if named:
            blocks.append((named.group(1).strip(), line_number + 1, []))
            continue
        if re.match(r"\s*Colou?r\s*:", raw, re.IGNORECASE):
            raw = ""  # noqa: PLW2901 - the line is kept, empty, so that numbers stay
        blocks[-1][2].append(raw)
    for name, first, lines in blocks:
        rows = _rows(lines, source, findings, first=first)
        if not rows:
            continue
        place = f"region '{name}'" if name else "ring"
        zones.extend(
            Zone(kind=kind, shape=p, name=name)
            for p in polygons_from_rings([[r[:2] for r in rows]], kind, place, findings)
        )
    if not zones and not findings:
        findings.add(Severity.ERROR, Code.EMPTY, "", "holds no ring")
    return Document(source=source, format="poly", zones=tuple(zones), findings=tuple(findings))


def read_rally(text: str, source: str) -> Document:
    """Return Mission Planner's rally lines: RALLY lat lon alt break_alt land_dir flags."""
    findings = Findings()
    rally: list[MissionItem] = []
    for line_number, raw in enumerate(text.split("\n"), start=1):
        line = raw.split("#", 1)[0].strip()
        if not line:
            continue
        place = f"line {line_number}"
        fields = point_commas(line).split()
        if fields[0].upper() != "RALLY" or len(fields) < 4:
            raise InputError(source, place, f"{line[:40]!r} is not 'RALLY lat lon alt ...'")
        lat_deg, lon_deg, alt_m = (number(f, source, place) for f in fields[1:4])
        if abs(lat_deg) > 90.0 or abs(lon_deg) > 180.0:
            findings.add(Severity.ERROR, Code.SWAPPED_AXES, place, f"{lat_deg:g}, {lon_deg:g} is not on the globe",
                         "the file writes latitude first")
            continue
        rally.append(MissionItem(
            command=Command.NAV_RALLY_POINT, lat_e7=round(lat_deg * 1e7), lon_e7=round(lon_deg * 1e7), alt_m=alt_m,
        ))
    return Document(source=source, format="rally", rally=tuple(rally), findings=tuple(findings))


def _rows(lines: list[str], source: str, findings: Findings, *, first: int = 1) -> list[Row]:
    rows: list[Row] = []
    commas = False
    for line_number, raw in enumerate(lines, start=first):
        line = raw.split("#", 1)[0].strip()
        if not line:
            continue
        place = f"line {line_number}"
        pointed = point_commas(line)
        commas |= pointed != line
        fields = pointed.replace(";", " ").split()
        if len(fields) == 1 and "," in fields[0]:
            fields = fields[0].split(",")
        if len(fields) not in {2, 3}:
            raise InputError(source, place, f"has {len(fields)} fields, not 'latitude longitude'",
                             "is the file cut off?")
        lat_deg, lon_deg = number(fields[0], source, place), number(fields[1], source, place)
        rows.append((lon_deg, lat_deg, place))
        if len(rows) > MAX_POSITIONS:
            raise InputError(source, place, f"holds more than {MAX_POSITIONS} positions", "simplify it")
    if commas:
        findings.add(Severity.NOTE, Code.FORMAT, "", "decimal commas are read as points")
    return rows


def write_fen(document: Document) -> Written:
    """Return the document's keep-in zone as a .fen; it holds exactly one."""
    losses = Losses()
    leave_out(losses, document, {"zones", "return"})
    inside = [z for z in without_holes(document.zones, losses) if z.kind is ZoneKind.INCLUSION]
    others = len(without_holes(document.zones, Losses())) - min(1, len(inside))
    losses.drop("zone", others, severity=Severity.ERROR, why="a .fen holds one keep-in ring")
    lines = ["#saved by companion (Mission Planner fence: return point, then the ring)"]
    if inside:
        polygon = as_polygon(inside[0], losses)
        ring = ring_of(polygon)
        point = document.return_point
        if point is None:
            middle = polygon.representative_point()
            point = GeoPoint(lat_deg=float(middle.y), lon_deg=wrap_lon_deg(float(middle.x)))
            losses.add(Severity.NOTE, "the return point is set to a point inside, for want of one")
        lines.append(f"{decimal(point.lat_deg)} {decimal(point.lon_deg)}")
        lines.extend(f"{decimal(lat)} {decimal(lon)}" for lat, lon in (*ring, ring[0]))
    return Written(("\n".join(lines) + "\n").encode(), tuple(losses))


def write_poly(document: Document) -> Written:
    """Return the document's first zone as a .poly; it holds one ring and not its kind."""
    losses = Losses()
    leave_out(losses, document, {"zones"})
    zones = without_holes(document.zones, losses)
    losses.drop("zone", max(0, len(zones) - 1), severity=Severity.ERROR, why="a .poly holds one ring")
    lines = ["#saved by companion (Mission Planner polygon)"]
    if zones:
        ring = ring_of(as_polygon(zones[0], losses))
        losses.add(Severity.NOTE, f"that the ring is an {zones[0].kind.value} zone is not carried by this format")
        lines.extend(f"{decimal(lat)} {decimal(lon)}" for lat, lon in (*ring, ring[0]))
    return Written(("\n".join(lines) + "\n").encode(), tuple(losses))


def write_rally(document: Document) -> Written:
    """Return the document's rally points as Mission Planner's rally lines."""
    losses = Losses()
    leave_out(losses, document, {"rally"})
    rows = [
        f"RALLY\t{decimal(i.lat_e7 / 1e7)}\t{decimal(i.lon_e7 / 1e7)}\t{decimal(i.alt_m)}\t0\t0\t0"
        for i in document.rally
    ]
    return Written(("\n".join(rows) + "\n").encode(), tuple(losses))
