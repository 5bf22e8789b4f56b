"""Mission Planner's text files: .waypoints, and the old .fen (return point, a fence ring), .poly (a ring), rally lines.

``lat lon`` per line, the first vertex repeated at the end, ``#`` comments. Old versions wrote decimal commas. The
*Regions* variant of .poly names its rings with ``Name:`` lines.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence

import numpy as np

from companion.errors import InputError
from companion.geofence.document import Code, Document, FindingLevel
from companion.geofence.formats.fence_items import FENCE_COMMANDS, items_to_zones, ring_of, zones_to_items
from companion.geofence.formats.losses import Losses, Written, as_polygon, filled, leave_out, without_holes
from companion.geofence.formats.rings import Findings, polygons_from_rings
from companion.geofence.formats.untrusted import MAX_POSITIONS, number, point_commas
from companion.geofence.shapes import Zone, ZoneKind, wrap_lon_deg
from companion.messages import Command, GeoPoint, MissionItem

# QGC WPL 110, the .waypoints file of Mission Planner, MAVProxy and QGroundControl: missions, fences, rally points.
#
# One item per line: seq current frame command p1 p2 p3 p4 lat lon alt autocontinue. Row 0 of a mission is home, which
# ArduPilot overwrites. Fences (commands 5000 to 5004) and rally points (5100) use the same format: the commands
# decide, not the name of the file. Our own reader and writer, because MAVSDK's importer duplicates home and pymavlink's
# writer keeps 6 decimals (5 cm) and its reader stumbles over a BOM.

HEADER = "QGC WPL 110"


def read_waypoints(text: str, source: str) -> Document:
    """Return what a .waypoints text holds. Raises InputError where a line is no item."""
    findings = Findings()
    rows: list[tuple[int, MissionItem]] = []
    lines = text.split("\n")
    if lines[0].strip().split() != HEADER.split():
        start = lines[0].strip()[:30]
        raise InputError(source, "line 1", f"starts with {start!r}, not {HEADER!r}", "only version 110 is read")
    for line_number, raw in enumerate(lines[1:], start=2):
        line = raw.split("#", 1)[0].strip()
        if not line:
            continue
        if len(rows) > MAX_POSITIONS:
            raise InputError(source, f"line {line_number}", f"holds more than {MAX_POSITIONS} items")
        rows.append(_row(point_commas(line).split(), source, f"line {line_number}", findings))
    return _sorted_out(rows, source, findings)


def _row(fields: list[str], source: str, place: str, findings: Findings) -> tuple[int, MissionItem]:
    if len(fields) != 12:
        raise InputError(source, place, f"has {len(fields)} fields, not 12", "is the file cut off?")
    whole = {}
    for index, (name, high) in enumerate((("seq", 65535), ("current", 255), ("frame", 255), ("command", 65535))):
        value = number(fields[index], source, f"{place} {name}")
        if value != int(value) or not 0 <= value <= high:
            raise InputError(source, f"{place} {name}", f"{fields[index][:20]!r} is not a whole number of 0..{high}")
        whole[name] = int(value)
    params: list[float] = []
    for index, field in enumerate(fields[4:8], start=1):
        if field.lower() in {"nan", "-nan"}:
            findings.add(FindingLevel.NOTE, Code.DROPPED, f"{place} p{index}", "nan (unset) is read as 0")
            params.append(0.0)
        else:
            params.append(number(field, source, f"{place} p{index}"))
    lat_deg, lon_deg, alt_m = (
        number(field, source, f"{place} {name}")
        for field, name in zip(fields[8:11], ("lat", "lon", "alt"), strict=True)
    )
    if abs(lat_deg) > 90.0 or abs(lon_deg) > 180.0:
        findings.add(
            FindingLevel.ERROR,
            Code.SWAPPED_AXES if abs(lon_deg) <= 90.0 else Code.OUT_OF_RANGE,
            place,
            f"{lat_deg:g}, {lon_deg:g} is not on the globe",
            "the file writes latitude before longitude",
        )
        lat_deg = lon_deg = 0.0
    item = MissionItem(
        command=whole["command"],
        lat_e7=round(lat_deg * 1e7),
        lon_e7=round(lon_deg * 1e7),
        alt_m=alt_m,
        frame=whole["frame"],
        params=(params[0], params[1], params[2], params[3]),
        autocontinue=number(fields[11], source, f"{place} autocontinue") != 0.0,
    )
    return whole["seq"], item


def _sorted_out(rows: list[tuple[int, MissionItem]], source: str, findings: Findings) -> Document:
    """Tell missions, fences and rally points apart by their commands."""
    for position, (seq, _) in enumerate(rows):
        if seq != position + (rows[0][0] if rows[0][0] in {0, 1} else 0):
            findings.add(
                FindingLevel.ERROR,
                Code.FORMAT,
                f"item {seq}",
                f"stands where item {position} should be",
                "is a line missing?",
            )
            break
    first = rows[0][0] if rows else 0
    items = [item for _, item in rows]
    fence = [i for i in items if i.command in FENCE_COMMANDS]
    rally = [i for i in items if i.command == Command.NAV_RALLY_POINT]
    mission = [i for i in items if i.command not in FENCE_COMMANDS and i.command != Command.NAV_RALLY_POINT]
    home: GeoPoint | None = None
    if mission and items[0] is mission[0] and first == 0:
        # Row 0 is home. Files of fences and rally points may have it too, followed by their own commands.
        home = mission.pop(0).point
        if home.lat_deg == 0.0 and home.lon_deg == 0.0:
            home = None
    if mission and (fence or rally):
        findings.add(
            FindingLevel.WARNING,
            Code.FORMAT,
            "",
            "mixes mission items with fence or rally items",
            "autopilots hold them in separate lists",
        )
    zones, return_point = items_to_zones(fence, findings)
    if not rows:
        findings.add(FindingLevel.ERROR, Code.EMPTY, "", "holds no item")
    return Document(
        source=source,
        format="waypoints",
        zones=zones,
        items=tuple(mission),
        home=home,
        rally=tuple(rally),
        return_point=return_point,
        findings=tuple(findings),
    )


def write_waypoints(document: Document, *, part: str = "") -> Written:
    """Return a mission, fence or rally file: ``part`` says which, or the first of them that the document has.

    A mission starts with home; a document without one gets its first waypoint there, which ArduPilot overwrites.
    """
    losses = Losses()
    has = {"mission": bool(document.items), "fence": bool(document.zones), "rally": bool(document.rally)}
    part = part or next((p for p, there in has.items() if there), "mission")
    if part == "mission":
        leave_out(losses, document, {"items", "home"})
        home = document.home
        if home is None:
            home = next((i.point for i in document.items if i.lat_e7 or i.lon_e7), GeoPoint(lat_deg=0.0, lon_deg=0.0))
            losses.add(FindingLevel.NOTE, "row 0 (home, which ArduPilot overwrites) is the first waypoint")
        first = MissionItem(
            command=Command.NAV_WAYPOINT, lat_e7=round(home.lat_deg * 1e7), lon_e7=round(home.lon_deg * 1e7), frame=0
        )
        items: Sequence[MissionItem] = (first, *document.items)
    elif part == "fence":
        leave_out(losses, document, {"zones", "return"})
        fence, fence_losses = zones_to_items(document.zones, return_point=document.return_point)
        losses.extend(fence_losses)
        items = fence
    elif part == "rally":
        leave_out(losses, document, {"rally"})
        items = document.rally
    else:
        raise ValueError(f"{part!r} is not mission, fence or rally")
    rows = [HEADER, *(_line(i, item, current=part == "mission" and i == 0) for i, item in enumerate(items))]
    return Written(("\n".join(rows) + "\n").encode(), tuple(losses))


def _line(seq: int, item: MissionItem, *, current: bool) -> str:
    params = "\t".join(decimal(p) for p in item.params)
    return (
        f"{seq}\t{int(current)}\t{item.frame}\t{int(item.command)}\t{params}\t"
        f"{_degrees(item.lat_e7)}\t{_degrees(item.lon_e7)}\t{decimal(item.alt_m)}\t{int(item.autocontinue)}"
    )


def _degrees(e7: int) -> str:
    """Return the wire's integer as degrees, exactly."""
    sign = "-" if e7 < 0 else ""
    return f"{sign}{abs(e7) // 10_000_000}.{abs(e7) % 10_000_000:07d}"


def decimal(value: float) -> str:
    """Return the shortest decimal that reads back as the same number, never with an exponent."""
    if not math.isfinite(value):
        raise ValueError(f"{value} cannot be written")
    return str(np.format_float_positional(value, trim="0"))


Row = tuple[float, float, str]  # lon, lat, place


def read_fen(text: str, source: str) -> Document:
    """Return a .fen: the first data line is the return point, the rest the closed keep-in ring."""
    findings = Findings()
    rows = _rows(text.split("\n"), source, findings)
    if len(rows) < 2:
        findings.add(
            FindingLevel.ERROR, Code.EMPTY, "", "holds no fence ring", "line 1 is the return point, the ring follows"
        )
        return Document(source=source, format="fen", findings=tuple(findings))
    lon_deg, lat_deg, place = rows[0]
    return_point = None
    if abs(lat_deg) <= 90.0:
        return_point = GeoPoint(lat_deg=lat_deg, lon_deg=wrap_lon_deg(lon_deg))
    else:
        findings.add(
            FindingLevel.ERROR,
            Code.SWAPPED_AXES,
            place,
            f"latitude {lat_deg:g} is outside ±90 degrees",
            "a .fen writes latitude before longitude",
        )
    polygons = polygons_from_rings([[r[:2] for r in rows[1:]]], ZoneKind.INCLUSION, "ring", findings)
    return Document(
        source=source,
        format="fen",
        zones=tuple(Zone(kind=ZoneKind.INCLUSION, shape=p) for p in polygons),
        return_point=return_point,
        findings=tuple(findings),
    )


_POLY_HEAD = "#saved by companion (Mission Planner polygon)"


def read_poly(text: str, source: str, *, kind: ZoneKind = ZoneKind.EXCLUSION) -> Document:
    """Return a .poly: one closed ring, or several named ones in the Regions variant; one of ours says its kind."""
    findings = Findings()
    said = re.match(rf"{re.escape(_POLY_HEAD)}: (\w+)", text)
    kind = next((k for k in ZoneKind if said is not None and k.value == said[1]), kind)
    zones: list[Zone] = []
    blocks: list[tuple[str, int, list[str]]] = [("", 1, [])]  # name, number of the first line, lines
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
        findings.add(FindingLevel.ERROR, Code.EMPTY, "", "holds no ring")
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
            findings.add(
                FindingLevel.ERROR,
                Code.SWAPPED_AXES,
                place,
                f"{lat_deg:g}, {lon_deg:g} is not on the globe",
                "the file writes latitude first",
            )
            continue
        rally.append(
            MissionItem(
                command=Command.NAV_RALLY_POINT, lat_e7=round(lat_deg * 1e7), lon_e7=round(lon_deg * 1e7), alt_m=alt_m
            )
        )
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
            raise InputError(
                source, place, f"has {len(fields)} fields, not 'latitude longitude'", "is the file cut off?"
            )
        lat_deg, lon_deg = number(fields[0], source, place), number(fields[1], source, place)
        rows.append((lon_deg, lat_deg, place))
        if len(rows) > MAX_POSITIONS:
            raise InputError(source, place, f"holds more than {MAX_POSITIONS} positions", "simplify it")
    if commas:
        findings.add(FindingLevel.NOTE, Code.FORMAT, "", "decimal commas are read as points")
    return rows


def write_fen(document: Document) -> Written:
    """Return the document's keep-in zone as a .fen; it holds exactly one."""
    losses = Losses()
    leave_out(losses, document, {"zones", "return"})
    zones = without_holes([z for z in document.zones if z.kind is ZoneKind.INCLUSION], losses)
    inside = [z for z in zones if z.kind is ZoneKind.INCLUSION]
    others = len(zones) - min(1, len(inside)) + sum(z.kind is ZoneKind.EXCLUSION for z in document.zones)
    losses.drop("zone", others, severity=FindingLevel.ERROR, why="a .fen holds one keep-in ring")
    lines = ["#saved by companion (Mission Planner fence: return point, then the ring)"]
    if inside:
        polygon = as_polygon(inside[0], losses)
        ring = ring_of(polygon)
        point = document.return_point
        if point is None:
            middle = polygon.representative_point()
            point = GeoPoint(lat_deg=float(middle.y), lon_deg=wrap_lon_deg(float(middle.x)))
            losses.add(FindingLevel.NOTE, "the return point is set to a point inside, for want of one")
        lines.append(f"{decimal(point.lat_deg)} {decimal(point.lon_deg)}")
        lines.extend(f"{decimal(lat)} {decimal(lon)}" for lat, lon in (*ring, ring[0]))
    return Written(("\n".join(lines) + "\n").encode(), tuple(losses))


def write_poly(document: Document) -> Written:
    """Return the document's first zone as a .poly; it holds one ring and not its kind, which is read as a keep-out."""
    losses = Losses()
    leave_out(losses, document, {"zones"})
    zones = document.zones
    losses.drop("zone", max(0, len(zones) - 1), severity=FindingLevel.ERROR, why="a .poly holds one ring")
    lines = [_POLY_HEAD + (f": {zones[0].kind.value}" if zones else "")]
    if zones:
        first = filled(zones[0])
        if first != zones[0]:
            losses.add(
                FindingLevel.WARNING, "its holes are filled: the water inside is given up", "write a .plan or .wkt"
            )
        ring = ring_of(as_polygon(first, losses))
        what = f"that the ring is an {first.kind.value} zone is in a comment alone, which other programs pass over"
        losses.add(FindingLevel.NOTE, what)
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
