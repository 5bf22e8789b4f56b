"""Logs that are text: CSV with units in the names of its columns, and NMEA 0183."""

from __future__ import annotations

import csv
import datetime as dt
import io
import math
from collections.abc import Iterator

from companion.boat_logs.rows import AT_REST, Rows, UnusableLogError
from companion.disk import unpacked
from companion.geo import MPS_PER_KNOT

_NAN = math.nan
STILL_MPS = 0.3  # slower a receiver tells no course
# A column's name without its unit, and the unit's factor.
_UNITS = {"mps": 1.0, "kn": MPS_PER_KNOT, "kt": MPS_PER_KNOT, "kts": MPS_PER_KNOT, "kmh": 1.0 / 3.6}
_SPEEDS = ("sog", "aws", "tws", "stw")
_ANGLES = ("heading", "cog", "awa", "twd")


def read_csv(data: bytes, rows: Rows) -> None:
    """Read columns ``t_s`` (or ``time``, ISO 8601), ``heading_deg, cog_deg, sog_mps`` or ``sog_kn`` and their like."""
    text = unpacked(data).decode("utf-8", "replace") if data[:2] == b"\x1f\x8b" else data.decode("utf-8", "replace")
    reader = csv.DictReader(io.StringIO(text.lstrip("\ufeff")))
    names = {(n or "").strip().lower(): n for n in reader.fieldnames or []}
    if not {"t_s", "time"} & set(names):
        raise UnusableLogError("its first line names no column t_s or time")
    for row in reader:
        t_s = _time(row.get(names["t_s"]) if "t_s" in names else row.get(names["time"]))
        if t_s is None:
            continue
        found: dict[str, float] = {}
        for name, column in names.items():
            what, _, unit = name.rpartition("_")
            value = _number(row.get(column))
            if value is None:
                continue
            if what in _SPEEDS and unit in _UNITS:
                found[what] = value * _UNITS[unit]
            elif what in _ANGLES and unit == "deg":
                found[what] = math.radians(value)
            elif what in {"lat", "lon"} and unit == "deg":
                found[what] = value
        mode = (row.get(names.get("mode", "")) or "").strip().upper()
        if mode:
            found["rest"] = float(mode in {m.name for m in AT_REST})
        if "sog" in found and "cog" in found:
            sog, cog = found.pop("sog"), found.pop("cog")
            found |= {"ve": sog * math.sin(cog), "vn": sog * math.cos(cog)}
        rows.take(t_s, **found)
        rows.sample(t_s)


def _number(text: str | None) -> float | None:
    try:
        value = float(text or "")
    except ValueError:
        return None
    return value if math.isfinite(value) else None


def _time(text: str | None) -> float | None:
    value = _number(text)
    if value is not None or not text:
        return value
    try:
        at = dt.datetime.fromisoformat(text.strip())
    except ValueError:
        return None
    return (at if at.tzinfo else at.replace(tzinfo=dt.UTC)).timestamp()


def _sentences(text: str) -> Iterator[list[str]]:
    for line in text.splitlines():
        start = line.find("$")
        body, star, told = line[start + 1 :].partition("*") if start >= 0 else ("", "", "")
        if not body or len(body) < 6:
            continue
        if star:
            wanted = 0
            for character in body:
                wanted ^= ord(character) & 0xFF
            try:
                if int(told.strip()[:2], 16) != wanted:
                    continue
            except ValueError:
                continue
        yield body.split(",")


def read_nmea(data: bytes, rows: Rows) -> None:
    """Read sentences from the first RMC on, by whose time they are."""
    t_s: float | None = None
    untold = 0  # headings that nothing brings to true north
    for cells in _sentences(data.decode("latin-1")):
        kind = cells[0][-3:]
        value = [_number(c) for c in cells]
        n = len(cells)
        if kind == "RMC" and n > 9:
            t_s = _rmc_time(cells) if cells[2] == "A" else None
            if t_s is None or value[7] is None:
                continue
            rows.sample(t_s)
            course, sog = value[8], value[7] * MPS_PER_KNOT
            if course is not None or sog < STILL_MPS:
                course = math.radians(course or 0.0)
                rows.take(t_s, ve=sog * math.sin(course), vn=sog * math.cos(course))
            lat, lon = _degrees(cells[3], cells[4]), _degrees(cells[5], cells[6])
            if lat is not None and lon is not None:
                rows.take(t_s, lat=lat, lon=lon)
            if n > 11 and value[10] is not None and "variation" not in rows.now:
                rows.take(t_s, variation=_to_east(value[10], cells[11]))
        elif t_s is None:
            continue
        elif kind == "HDT" and n > 1 and value[1] is not None:
            rows.take(t_s, heading=math.radians(value[1]))
        elif kind in {"HDG", "HDM"} and n > 1 and value[1] is not None:
            variation = rows.now["variation"][1] if "variation" in rows.now else None
            if kind == "HDG" and n > 5 and value[4] is not None:
                variation = _to_east(value[4], cells[5])
            deviation = _to_east(value[2] or 0.0, cells[3]) if kind == "HDG" and n > 3 else 0.0
            untold += variation is None
            rows.take(t_s, heading=math.radians(value[1]) + deviation + (variation or 0.0))
        elif kind == "VHW" and n > 6 and value[5] is not None:
            rows.take(t_s, stw=value[5] * MPS_PER_KNOT)
        elif kind == "MWV" and n > 5 and cells[2] == "R" and value[1] is not None and value[3] is not None:
            if cells[5] == "V":
                continue  # the instrument does not believe it itself
            unit = {"N": MPS_PER_KNOT, "M": 1.0, "K": 1.0 / 3.6}.get(cells[4], _NAN)
            rows.take(t_s, awa=math.radians(math.remainder(value[1], 360.0)), aws=value[3] * unit)
        elif kind == "RPM" and n > 3 and cells[1] == "E" and value[3] is not None:
            rows.take(t_s, motor=100.0 if value[3] > 300.0 else 0.0)
    if t_s is not None:
        rows.sample(t_s)
    if untold:
        rows.notes.append(
            f"its headings are magnetic, and of {untold} neither HDG nor RMC tells the variation: they are taken to be "
            "true, and what the compass is found to be off by is the variation, too"
        )


def _rmc_time(cells: list[str]) -> float | None:
    try:
        at = dt.datetime.strptime(cells[9] + cells[1].partition(".")[0], "%d%m%y%H%M%S").replace(tzinfo=dt.UTC)
    except ValueError:
        return None
    fraction = _number("0." + cells[1].partition(".")[2]) if "." in cells[1] else 0.0
    return at.timestamp() + (fraction or 0.0)


def _to_east(degrees: float, side: str) -> float:
    """Return an angle to east or west as one to the east [rad]."""
    return math.radians(degrees * (-1.0 if side == "W" else 1.0))


def _degrees(text: str, side: str) -> float | None:
    value = _number(text)
    if value is None:
        return None
    whole = math.floor(value / 100.0)
    return (whole + (value - 100.0 * whole) / 60.0) * (-1.0 if side in {"S", "W"} else 1.0)
