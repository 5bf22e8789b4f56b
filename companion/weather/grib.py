"""GRIB 1 and 2: the headers of a file's fields, walked section by section; what is not understood is refused by name.

[1] WMO Manual on Codes, volume I.2 (2019), FM 92 GRIB; [2] WMO Guide to GRIB edition 1 (1994). Octets count from 1
there, indices from 0 here.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum

import numpy as np

from companion.errors import InputError

MOST_CELLS = 25_000_000
_UNITS_S = {0: 60, 1: 3600, 2: 86_400, 10: 10_800, 11: 21_600, 12: 43_200}  # code table 4.4 [1], 4 [2]
_UNITS_1_S = {**_UNITS_S, 13: 900, 14: 1800, 254: 1}
_UNITS_2_S = {**_UNITS_S, 13: 1}
_ECMWF, _NCEP = 98, 7
_NOT_GIVEN_2 = 0xFFFFFFFF


class Quantity(Enum):
    """What of a forecast a passage is made with; the wind of 10 m, the current of the surface."""

    WIND_EAST = "wind to the east"
    WIND_NORTH = "wind to the north"
    GUST = "gust"
    WAVES = "wave height"
    CURRENT_EAST = "current to the east"
    CURRENT_NORTH = "current to the north"


Q = Quantity
# (discipline, category, number) [1], code table 4.2
_OF_2 = {(0, 2, 2): Q.WIND_EAST, (0, 2, 3): Q.WIND_NORTH, (0, 2, 22): Q.GUST,
         (10, 0, 3): Q.WAVES, (10, 1, 2): Q.CURRENT_EAST, (10, 1, 3): Q.CURRENT_NORTH}  # fmt: skip
_ALSO_2 = {(0, 2, 0): "wind by direction", (0, 2, 1): "wind by speed", (0, 3, 0): "pressure", (0, 0, 0): "temperature",
           (0, 3, 1): "sea level pressure", (0, 3, 5): "height", (10, 0, 5): "height of the wind's waves",
           (10, 0, 8): "swell height", (10, 1, 0): "current by direction", (10, 1, 1): "current by speed"}  # fmt: skip
# WMO's table 2 and ECMWF's 128 [2]: one number means different things in them
_OF_1 = {33: Q.WIND_EAST, 34: Q.WIND_NORTH, 49: Q.CURRENT_EAST, 50: Q.CURRENT_NORTH, 180: Q.GUST,
         100: Q.WAVES}  # fmt: skip
# by table, too: 49 is since the last output, 123 of 6 hours, 228.28 of 3, 228.29 of the moment
_OF_1_ECMWF = {(128, 165): Q.WIND_EAST, (128, 166): Q.WIND_NORTH, (128, 49): Q.GUST, (128, 123): Q.GUST,
               (228, 28): Q.GUST, (228, 29): Q.GUST, (140, 229): Q.WAVES}  # fmt: skip
_ALSO_1 = {1: "pressure", 2: "sea level pressure", 7: "height", 11: "temperature", 31: "wind by direction",
           32: "wind by speed"}  # fmt: skip
_ALSO_1_ECMWF = {151: "sea level pressure", 167: "temperature"}
_INTERVAL_MAXIMUM = 2  # code table 4.10 [1]
_SURFACES_2 = {1, 160, 168, 241}  # ground or water, depth below the sea, the same in models, an ordered sequence


@dataclass(frozen=True, slots=True, kw_only=True)
class Grid:
    """A grid of latitudes and longitudes, as it is scanned: ``columns`` from ``west_deg``, rows from ``first_lat_deg``.

    ``east_deg`` is beyond ``west_deg``, above 180 where the grid lies over the date line. ``leads_west``: a row is
    scanned from its east end; ``by_columns``: points of a column follow each other; ``turns``: every second row (or
    column) is scanned backwards.
    """

    rows: int
    columns: int
    first_lat_deg: float
    last_lat_deg: float
    west_deg: float
    east_deg: float
    leads_west: bool = False
    by_columns: bool = False
    turns: bool = False

    def latitudes_deg(self) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
        """Return (rows,) ascending."""
        low, high = sorted((self.first_lat_deg, self.last_lat_deg))
        return np.linspace(low, high, self.rows)

    def longitudes_deg(self) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
        """Return (columns,) ascending."""
        return np.linspace(self.west_deg, self.east_deg, self.columns)


@dataclass(frozen=True, slots=True, kw_only=True)
class GribField:
    """One field of a file: its headers read, its values still packed in ``message``, a GRIB file of this field alone.

    ``quantity`` is None for what no passage is made with; ``title`` is its name. ``valid_utc_s`` is the end of the
    interval for what is said of one (``interval_s``). ``member`` 0 is the control, or the only forecast.
    """

    source: str
    number: int
    edition: int
    quantity: Quantity | None
    title: str
    base_utc_s: float = 0.0
    valid_utc_s: float = 0.0
    interval_s: float = 0.0
    member: int = 0
    grid: Grid | None = None
    message: bytes = b""

    @property
    def place(self) -> str:
        """Where in its file it is, in words."""
        return f"message {self.number}"

    def refused(self, problem: str, remedy: str) -> InputError:
        """Return what to raise of it."""
        return InputError(self.source, self.place, problem, remedy)


def walk(data: bytes, source: str) -> Iterator[GribField]:
    """Yield the fields of a file. Raises InputError naming the message: cut off, damaged, or not understood.

    Between messages other bytes are skipped: mail and bulletin headers stand there.
    """
    at = data.find(b"GRIB")
    if at < 0:
        if not data:
            raise InputError(source, "", "is empty", "fetch it again, or name another file")
        packed = {b"BZ": "bunzip2", b"\x1f\x8b": "gunzip", b"PK": "unzip"}.get(data[:2])
        if packed:
            raise InputError(source, "", "is compressed", f"unpack it first ({packed})")
        raise InputError(source, "", "holds no GRIB message", "name a GRIB file (.grb, .grib2)")
    number = 0
    while at >= 0:
        number += 1
        place = f"message {number}"
        if len(data) < at + 16:
            raise _cut(source, place)
        edition = data[at + 7]
        if edition == 1:
            length = _uint(data, at + 4, 3)
        elif edition == 2:
            length = _uint(data, at + 8, 8)
        else:
            raise InputError(source, place, f"is of GRIB edition {edition}", "only 1 and 2 are known")
        if edition == 1 and length >= 0x800000:
            raise InputError(source, place, "is longer than GRIB 1 can say", "convert it to GRIB 2")
        if at + length > len(data):
            raise _cut(source, place, f"{len(data) - at} of its {length} bytes are there")
        if length < 24 or data[at + length - 4 : at + length] != b"7777":
            raise InputError(source, place, "does not end where it says (no 7777)", "it is damaged: fetch it again")
        message = data[at : at + length]
        try:
            if edition == 1:
                yield _field_1(message, source, number)
            else:
                yield from _fields_2(message, source, number)
        except IndexError:
            raise InputError(
                source, place, "has a section that is too short", "it is damaged: fetch it again"
            ) from None
        at = data.find(b"GRIB", at + length)


def _cut(source: str, place: str, have: str = "") -> InputError:
    return InputError(source, place, "is cut off" + (f": {have}" if have else ""), "fetch the file again")


# ---------------------------------------------------------------------------------- numbers
def _uint(data: bytes, at: int, size: int) -> int:
    if at + size > len(data):
        raise IndexError(at)
    return int.from_bytes(data[at : at + size], "big")


def _sint(data: bytes, at: int, size: int) -> int:
    """Return a number whose first bit is its sign, as GRIB writes those below zero."""
    value, sign = _uint(data, at, size), 1 << (8 * size - 1)
    return -(value - sign) if value & sign else value


def _utc_s(year: int, rest: bytes, source: str, place: str) -> float:
    """Return the Unix time of a year and its month, day, hour, minute and, where it is said, second."""
    month, day, hour, minute, second = (*rest, 0)[:5]
    try:
        day_s = float(np.datetime64(f"{year:04}-{month:02}-{day:02}", "s").astype(np.int64))
    except ValueError:
        day_s = math.nan
    if not (math.isfinite(day_s) and hour < 25 and minute < 60 and second < 61):
        said = f"{year}-{month:02}-{day:02} {hour:02}:{minute:02} is no time"
        raise InputError(source, place, said, "it is damaged: fetch it again")
    return float(day_s + 3600.0 * hour + 60.0 * minute + second)


# ---------------------------------------------------------------------------------- grids
def _grid(
    source: str,
    place: str,
    shape: tuple[int, int],
    corners_deg: tuple[float, float, float, float],
    steps_deg: tuple[float | None, float | None],
    scan: int,
    rounding_deg: float,
) -> Grid:
    """Return the grid of (rows, columns), (lat, lon, lat, lon) of its first and last point, steps and scanning."""
    rows, columns = shape
    lat1, lon1, lat2, lon2 = corners_deg
    damaged = "it is damaged: fetch it again"
    if not (min(rows, columns) >= 2 and rows * columns <= MOST_CELLS):
        raise InputError(source, place, f"has a grid of {rows} x {columns} points", "cut it to the area of the passage")
    if max(abs(lat1), abs(lat2)) > 90.0 + rounding_deg or max(abs(lon1), abs(lon2)) > 360.0 + rounding_deg:
        raise InputError(source, place, f"begins at {lat1:g}, {lon1:g} and ends at {lat2:g}, {lon2:g}", damaged)
    if scan & 0x0F:
        raise InputError(source, place, f"is scanned in a way that is not known ({scan:#04x})", "ask for a plain grid")
    leads_west = bool(scan & 0x80)
    west, east = (lon2, lon1) if leads_west else (lon1, lon2)
    while east <= west:
        east += 360.0
    while east - west > 360.0 + rounding_deg:
        east -= 360.0
    d_lat, d_lon = steps_deg
    for step, span, count in ((d_lat, abs(lat2 - lat1), rows), (d_lon, east - west, columns)):
        if step is not None and abs(step * (count - 1) - span) > rounding_deg * (count + 1):
            raise InputError(source, place, f"{count} points every {step:g} degrees are not {span:g} degrees", damaged)
    if (lat2 > lat1) != bool(scan & 0x40) or lat1 == lat2:
        raise InputError(source, place, f"its rows lead from {lat1:g} to {lat2:g}, and it says otherwise", damaged)
    return Grid(
        rows=rows,
        columns=columns,
        first_lat_deg=lat1,
        last_lat_deg=lat2,
        west_deg=west,
        east_deg=east,
        leads_west=leads_west,
        by_columns=bool(scan & 0x20),
        turns=bool(scan & 0x10),
    )


# ---------------------------------------------------------------------------------- edition 1
_GRIDS_1 = {1: "Mercator", 3: "Lambert", 4: "Gaussian", 5: "polar stereographic", 10: "rotated", 50: "spectral"}


def _field_1(message: bytes, source: str, number: int) -> GribField:
    place = f"message {number}"
    pds = message[8:]
    length, table, center = _uint(pds, 0, 3), pds[3], pds[4]
    flags, parameter, level, height = pds[7], pds[8], pds[9], _uint(pds, 10, 2)
    is_ecmwf = center == _ECMWF and table >= 128
    quantity = _OF_1_ECMWF.get((table, parameter)) if is_ecmwf else _OF_1.get(parameter) if table < 128 else None
    title = quantity.value if quantity else (_ALSO_1_ECMWF if is_ecmwf else _ALSO_1).get(parameter, "")
    title = title or f"parameter {parameter} of table {table}"
    if quantity in {Q.WIND_EAST, Q.WIND_NORTH} and not is_ecmwf and (level, height) not in {(105, 10), (1, 0)}:
        quantity, title = None, f"{title} at level {level}:{height}"
    if quantity is None:
        return GribField(source=source, number=number, edition=1, quantity=None, title=title)
    unit = _UNITS_1_S.get(pds[17])
    if unit is None:
        raise InputError(source, place, f"counts time by unit {pds[17]}, which is not known", "convert it to GRIB 2")
    base_s = _utc_s((pds[24] - 1) * 100 + pds[12], pds[13:17], source, place)
    ahead, interval = _ahead_1(pds, quantity, source, place)
    if not flags & 0x80:
        raise InputError(source, place, f"names a grid of its centre ({pds[6]}) and does not say it", "convert it")
    gds = message[8 + length :]
    if gds[5] != 0:
        kind = _GRIDS_1.get(gds[5], f"grid type {gds[5]}")
        raise InputError(source, place, f"has a grid that is not read ({kind})", "ask for latitudes and longitudes")
    columns, rows = _uint(gds, 6, 2), _uint(gds, 8, 2)
    if 0xFFFF in {columns, rows}:
        raise InputError(source, place, "has rows of different lengths (reduced)", "ask for a regular grid")
    steps = tuple(None if raw in {0, 0xFFFF} else raw / 1000.0 for raw in (_uint(gds, 25, 2), _uint(gds, 23, 2)))
    return GribField(
        source=source,
        number=number,
        edition=1,
        quantity=quantity,
        title=title,
        base_utc_s=base_s,
        valid_utc_s=base_s + unit * ahead,
        interval_s=float(unit * interval),
        member=_member_1(pds, length, source, place),
        grid=_grid(
            source,
            place,
            (rows, columns),
            (_sint(gds, 10, 3) / 1e3, _sint(gds, 13, 3) / 1e3, _sint(gds, 17, 3) / 1e3, _sint(gds, 20, 3) / 1e3),
            (steps[0], steps[1]),
            gds[27],
            0.0011,
        ),
        message=message,
    )


def _ahead_1(pds: bytes, quantity: Quantity, source: str, place: str) -> tuple[int, int]:
    """Return how far ahead of its base time a field is, and the length of its interval, in its own units of time."""
    first, second, kind = pds[18], pds[19], pds[20]
    if kind == 0:
        return first, 0
    if kind == 1:
        return 0, 0
    if kind == 10:
        return 256 * first + second, 0
    if kind == 2 or (kind in {3, 4} and quantity is Q.GUST):
        return second, second - first
    raise InputError(
        source, place, f"is over an interval (indicator {kind}), where it should be of a time", "leave it out"
    )


def _member_1(pds: bytes, length: int, source: str, place: str) -> int:
    if length <= 40:
        return 0
    if pds[4] == _ECMWF and pds[40] in {1, 30} and length > 50:
        return pds[49]
    if pds[4] == _NCEP and pds[40] == 1:
        raise InputError(source, place, "is of an ensemble by NCEP in GRIB 1", "ask for it in GRIB 2")
    return 0


# ---------------------------------------------------------------------------------- edition 2
_GRIDS_2 = {1: "rotated", 10: "Mercator", 20: "polar stereographic", 30: "Lambert", 40: "Gaussian", 50: "spectral",
            90: "space view", 101: "unstructured", 140: "Lambert equal area"}  # fmt: skip
_PRODUCTS_2 = {0: (None, None), 1: (34, None), 8: (None, 34), 11: (34, 37)}  # where a member, an interval stands
_NEEDED_2 = (3, 4, 5, 6, 7)


def _fields_2(message: bytes, source: str, number: int) -> Iterator[GribField]:
    """Yield the fields of a message: sections 2 to 7 may come again, what does not come again holds on."""
    sections: dict[int, bytes] = {}
    at = 16
    while at < len(message) - 4:
        length, kind = _uint(message, at, 4), message[at + 4]
        if length < 5 or at + length > len(message) - 4 or not 1 <= kind <= 7:
            raise InputError(source, f"message {number}", "has a section that leads out of it", "fetch the file again")
        section = message[at : at + length]
        if not (kind == 6 and section[5] == 254):  # 254: the bitmap of before
            sections[kind] = section
        at += length
        if kind == 7:
            missing = [k for k in (1, *_NEEDED_2) if k not in sections]
            if missing:
                raise InputError(source, f"message {number}", f"has no section {missing[0]}", "fetch the file again")
            yield _field_2(sections, message[6], source, number)


def _field_2(sections: dict[int, bytes], discipline: int, source: str, number: int) -> GribField:
    place = f"message {number}"
    one, three, four = sections[1], sections[3], sections[4]
    template, key = _uint(four, 7, 2), (discipline, four[9], four[10])
    quantity = _OF_2.get(key)
    title = quantity.value if quantity else _ALSO_2.get(key, f"parameter {'.'.join(map(str, key))}")
    if quantity is not None:
        level, scale, value = four[22], _sint(four, 23, 1), _sint(four, 24, 4)
        height = 0.0 if four[24:28] == b"\xff" * 4 else value * 10.0**-scale
        is_wind = quantity in {Q.WIND_EAST, Q.WIND_NORTH}
        if not (
            (level == 103 and height == 10.0 and discipline == 0) or (level in _SURFACES_2 and height in {0.0, 1.0})
        ):
            quantity, title = None, f"{title} at level {level}:{height:g}"
        elif is_wind and _uint(four, 7, 2) in {8, 11}:
            quantity, title = None, f"{title} over an interval"
    if quantity is None:
        return GribField(source=source, number=number, edition=2, quantity=None, title=title)
    if template not in _PRODUCTS_2:
        known = ", ".join(f"4.{k}" for k in _PRODUCTS_2)
        raise InputError(source, place, f"is a product that is not read (4.{template})", f"ask for one of {known}")
    member_at, interval_at = _PRODUCTS_2[template]
    unit = _UNITS_2_S.get(four[17])
    if unit is None:
        raise InputError(source, place, f"counts time by unit {four[17]}, which is not known", "ask for hours")
    base_s = _utc_s(_uint(one, 12, 2), one[14:19], source, place)
    valid_s = base_s + unit * _sint(four, 18, 4)
    interval_s = 0.0
    if interval_at is not None:
        end_s = _utc_s(_uint(four, interval_at, 2), four[interval_at + 2 : interval_at + 7], source, place)
        if four[interval_at + 12] != _INTERVAL_MAXIMUM:
            raise InputError(source, place, "is a gust that is no maximum of its interval", "leave it out")
        interval_s, valid_s = end_s - valid_s, end_s
    return GribField(
        source=source,
        number=number,
        edition=2,
        quantity=quantity,
        title=title,
        base_utc_s=base_s,
        valid_utc_s=valid_s,
        interval_s=interval_s,
        member=0 if member_at is None else four[member_at + 1],
        grid=_grid_2(three, source, place),
        message=_alone(sections, discipline),
    )


def _grid_2(three: bytes, source: str, place: str) -> Grid:
    template = _uint(three, 12, 2)
    if template != 0:
        kind = _GRIDS_2.get(template, f"template 3.{template}")
        raise InputError(source, place, f"has a grid that is not read ({kind})", "ask for latitudes and longitudes")
    if three[10] or _NOT_GIVEN_2 in {_uint(three, 30, 4), _uint(three, 34, 4)}:
        raise InputError(source, place, "has rows of different lengths (reduced)", "ask for a regular grid")
    if _uint(three, 38, 4) not in {0, _NOT_GIVEN_2}:
        raise InputError(source, place, "counts angles by a unit of its own", "ask for millionths of a degree")
    steps = tuple(None if raw in {0, _NOT_GIVEN_2} else raw / 1e6 for raw in (_uint(three, 67, 4), _uint(three, 63, 4)))
    return _grid(
        source,
        place,
        (_uint(three, 34, 4), _uint(three, 30, 4)),
        (_sint(three, 46, 4) / 1e6, _sint(three, 50, 4) / 1e6, _sint(three, 55, 4) / 1e6, _sint(three, 59, 4) / 1e6),
        (steps[0], steps[1]),
        three[71],
        1.1e-6,
    )


def _alone(sections: dict[int, bytes], discipline: int) -> bytes:
    """Return a file of this field only: libraries hand out the first of a message."""
    body = b"".join(sections[k] for k in (1, *_NEEDED_2)) + b"7777"
    return b"GRIB\0\0" + bytes([discipline, 2]) + (16 + len(body)).to_bytes(8, "big") + body
