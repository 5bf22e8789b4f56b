r"""Reading polars from the files sailors have: OpenCPN's and qtVlm's .pol and .csv, Expedition's pairs.

The grid: a header ``TWA\\TWS;4;6;8`` of wind speeds [kn], then rows of a wind angle [deg] and boat speeds [kn].
Separators are ``;``, tab, ``,`` or spaces; a decimal comma is understood where ``;`` or tab separates. A blank cell
and a bare ``0`` mean "not known" and are interpolated; ``0.0`` means "cannot sail"; below 0.05 kn is 0.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from companion.boat.polar import Polar
from companion.disk import read_regular
from companion.errors import InputError, unreadable
from companion.geo import MPS_PER_KNOT

MAX_TWS_KN = 200.0
MAX_SPEED_KN = 100.0
MIN_SPEED_KN = 0.05        # OpenCPN stores "cannot sail" as 0.01
MAX_FILE_BYTES = 2_000_000  # a polar is a few kilobytes; anything else is another file

_HEADER = re.compile(r"^(twa\s*[/\\]?\s*tws|twa|tws)$", re.IGNORECASE)
_EXTRA_ROW = re.compile(r"^(opt|beat|run|gybe|jibe|vmg|up|down|dn)", re.IGNORECASE)
_NUMBER = re.compile(r"^[+-]?(\d+(\.\d*)?|\.\d+)([eE][+-]?\d+)?$")


@dataclass(frozen=True, slots=True, kw_only=True)
class PolarFile:
    """A polar read from a file, and what had to be guessed or left out to read it."""

    polar: Polar
    warnings: tuple[str, ...] = ()


def read_polar(path: str | Path) -> PolarFile:
    """Read a polar file.

    Raises:
        InputError: naming the file, the line, the problem and the remedy.
    """
    source = str(path)
    try:
        raw = read_regular(Path(path), MAX_FILE_BYTES + 1)
    except OSError as error:
        raise unreadable(source, error) from error
    if len(raw) > MAX_FILE_BYTES:
        raise InputError(source, "", f"more than {MAX_FILE_BYTES} bytes is no polar",
                         "give a .pol or .csv file of boat speeds")
    try:
        text = raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = raw.decode("latin-1")
    return parse_polar(text, source=source)


def parse_polar(text: str, *, source: str = "polar") -> PolarFile:
    """Return the polar that ``text`` holds; see ``read_polar``."""
    lines = [
        (number, line.strip())
        for number, line in enumerate(text.replace("\ufeff", "").splitlines(), start=1)
        if line.strip() and line.strip()[0] not in "#!"
    ]
    if not lines:
        raise InputError(source, "", "holds no polar", "give rows of wind angle and boat speeds")
    header = _find_header(lines)
    if header is not None:
        return _parse_grid(lines[header:], source)
    pairs = _parse_pairs(lines, source)
    if pairs is not None:
        return pairs
    numeric = [i for i, (_, line) in enumerate(lines) if len(_cells(line)) >= 2 and _is_numeric_row(line)]
    if not numeric:
        raise InputError(source, f"line {lines[0][0]}", "no header of wind speeds",
                         "start with a line like TWA\\TWS;4;6;8;10")
    return _parse_grid(lines[numeric[0]:], source)


# ------------------------------------------------------------------------------------------- cells
def _separator(line: str) -> str | None:
    for candidate in (";", "\t", ","):
        if candidate in line:
            return candidate
    return None


def _cells(line: str, separator: str | None = "?") -> list[str]:
    if separator == "?":
        separator = _separator(line)
    if separator is None:
        return line.split()
    cells = [cell.strip().strip('"') for cell in line.split(separator)]
    if separator != ",":
        cells = [re.sub(r"^([+-]?\d*),(\d+)", r"\1.\2", cell) for cell in cells]
    return cells


def _is_numeric_row(line: str) -> bool:
    cells = [cell.split(":")[0] for cell in _cells(line)]
    return bool(_NUMBER.match(cells[0])) and all(not cell or _NUMBER.match(cell) for cell in cells)


def _find_header(lines: list[tuple[int, str]]) -> int | None:
    for i, (_, line) in enumerate(lines[:20]):
        cells = _cells(line)
        if len(cells) >= 2 and _HEADER.match(cells[0]):
            return i
        # "TWA TWS 4 6 8" or "twa / tws 4 6": the token itself was split by spaces.
        if re.match(r"^twa\s*[/\\ ]\s*tws\b", line, re.IGNORECASE) and _separator(line) is None:
            return i
    return None


def _number(cell: str, source: str, line: int, column: int, what: str) -> float:
    if not _NUMBER.match(cell):
        raise InputError(source, f"line {line}, column {column}", f"{cell!r} is not a {what}", "write a plain number")
    return float(cell)


# -------------------------------------------------------------------------------------------- grid
def _parse_grid(lines: list[tuple[int, str]], source: str) -> PolarFile:
    warnings: list[str] = []
    header_number, header = lines[0]
    separator = _separator(header)
    if separator is None:
        header = re.sub(r"^twa\s*[/\\ ]\s*tws", "twa", header, flags=re.IGNORECASE)
    cells = _cells(header, separator)[1:]
    while cells and not cells[-1]:
        cells.pop()
    tws_kn = [_number(cell, source, header_number, i, "wind speed") for i, cell in enumerate(cells, start=2)]
    if not tws_kn:
        raise InputError(source, f"line {header_number}", "no wind speeds", "start with a line like TWA\\TWS;4;6;8")
    for i, (low, high) in enumerate(pairwise(tws_kn), start=3):
        if not high > low:
            raise InputError(source, f"line {header_number}, column {i}",
                             f"wind speed {high:g} kn after {low:g} kn", "wind speeds must increase")
    if tws_kn[0] < 0.0 or tws_kn[-1] > MAX_TWS_KN:
        raise InputError(source, f"line {header_number}", f"wind speeds {tws_kn[0]:g}..{tws_kn[-1]:g} kn",
                         f"they must be within 0..{MAX_TWS_KN:g} kn")
    twa_deg: list[float] = []
    rows: list[list[float]] = []
    for number, line in lines[1:]:
        row = _cells(line, separator)
        if _EXTRA_ROW.match(row[0]):
            warnings.append(f"line {number}: row {row[0]!r} is not used")
            continue
        angle = _number(row[0], source, number, 1, "wind angle")
        if not 0.0 <= angle <= 180.0:
            raise InputError(source, f"line {number}", f"wind angle {angle:g} degrees", "angles run from 0 to 180")
        if twa_deg and angle <= twa_deg[-1]:
            raise InputError(source, f"line {number}", f"wind angle {angle:g} after {twa_deg[-1]:g} degrees",
                             "angles must increase from row to row")
        values = row[1:]
        while len(values) > len(tws_kn) and not values[-1]:
            values.pop()
        if len(values) != len(tws_kn):
            warnings.append(f"line {number}: {len(values)} speeds for {len(tws_kn)} winds")
        values = (values + [""] * len(tws_kn))[: len(tws_kn)]
        twa_deg.append(angle)
        # Before the first speed, or under no wind, a boat that does not sail; elsewhere a gap in the file.
        is_head = all(value == 0.0 for known in rows for value in known) and all(cell == "0" for cell in values)
        rows.append([
            0.0 if cell == "0" and (is_head or wind_kn == 0.0) else _speed(cell, source, number, i, warnings)
            for i, (cell, wind_kn) in enumerate(zip(values, tws_kn, strict=True), start=2)
        ])
    if not rows:
        raise InputError(source, f"line {header_number}", "no rows of boat speeds", "add rows like 45;2.1;3.0;3.6")
    return _finish(np.array(twa_deg), np.array(tws_kn), np.array(rows, dtype=np.float64), source, warnings)


def _speed(cell: str, source: str, line: int, column: int, warnings: list[str]) -> float:
    """Return the boat speed [kn]; NaN when it is not known."""
    text = cell.split(":", maxsplit=1)[0].strip()  # "1.9:1" names a sail after the speed
    if not text or text in {"-", "--"}:
        return math.nan
    if text == "0":
        warnings.append(f"line {line}, column {column}: a bare 0 is taken as not known; write 0.0 for 'cannot sail'")
        return math.nan
    value = _number(text, source, line, column, "boat speed")
    if value < 0.0 or value > MAX_SPEED_KN:
        raise InputError(source, f"line {line}, column {column}", f"boat speed {value:g} kn",
                         f"speeds are within 0..{MAX_SPEED_KN:g} kn")
    return value if value >= MIN_SPEED_KN else 0.0


def _finish(
    twa_deg: NDArray[np.float64], tws_kn: NDArray[np.float64], speed_kn: NDArray[np.float64], source: str,
    warnings: list[str],
) -> PolarFile:
    if not bool(np.any(np.isfinite(speed_kn))):
        raise InputError(source, "", "holds no boat speed at all", "fill in the table")
    filled = speed_kn.copy()
    for i in range(twa_deg.size):  # between two known winds of the same row
        known = np.flatnonzero(np.isfinite(speed_kn[i]))
        if known.size >= 2:
            inside = slice(known[0], known[-1] + 1)
            filled[i, inside] = np.interp(tws_kn[inside], tws_kn[known], speed_kn[i, known])
    known_columns = [j for j in range(tws_kn.size) if bool(np.any(np.isfinite(filled[:, j])))]
    for j in known_columns:  # then along the angle: head to wind a boat stands, beyond the last row it keeps its speed
        known = np.flatnonzero(np.isfinite(filled[:, j]))
        x, y = twa_deg[known], filled[known, j]
        if x[0] > 0.0:
            x, y = np.concatenate([[0.0], x]), np.concatenate([[0.0], y])
        filled[:, j] = np.interp(twa_deg, x, y)
    for i in range(twa_deg.size):  # then along the wind: nothing at no wind, above the last known column no more
        x, y = tws_kn[known_columns], filled[i, known_columns]
        if x[0] > 0.0:
            x, y = np.concatenate([[0.0], x]), np.concatenate([[0.0], y])
        filled[i, :] = np.interp(tws_kn, x, y)
    if not bool(np.any(filled > 0.0)):
        warnings.append("the boat cannot sail at any angle in any wind")
    if bool(np.any(np.diff(np.max(filled, axis=0)) < 0.0)):
        warnings.append("the boat gets slower as the wind rises")
    polar = Polar(
        twa_rad=np.minimum(np.radians(twa_deg), math.pi), tws_mps=tws_kn * MPS_PER_KNOT,
        speed_mps_table=filled * MPS_PER_KNOT, name=Path(source).stem,
    )
    return PolarFile(polar=polar, warnings=tuple(warnings))


# ------------------------------------------------------------------------------------------- pairs
def _parse_pairs(lines: list[tuple[int, str]], source: str) -> PolarFile | None:
    """Read Expedition's form: one row per wind speed, then pairs of angle and speed, in either order."""
    rows: list[tuple[int, list[float]]] = []
    for number, line in lines:
        if not _is_numeric_row(line):
            return None
        cells = _cells(line)
        while cells and not cells[-1]:
            cells.pop()
        if len(cells) < 5 or len(cells) % 2 == 0 or not all(_NUMBER.match(cell) for cell in cells):
            return None
        rows.append((number, [float(cell) for cell in cells]))
    first, second = rows[0][1][1::2], rows[0][1][2::2]
    angles_first, angles_second = _looks_like_angles(first), _looks_like_angles(second)
    if rows[0][1][0] == 0.0 and rows[0][1][1] < 60.0 and not angles_first and not angles_second:
        return None
    if not angles_first and not angles_second:
        return None
    angle_at = 1 if angles_first and (not angles_second or max(first) >= max(second)) else 2
    winds: list[float] = []
    columns: list[tuple[NDArray[np.float64], NDArray[np.float64]]] = []
    for number, values in rows:
        if not 0.0 <= values[0] <= MAX_TWS_KN or (winds and values[0] <= winds[-1]):
            raise InputError(source, f"line {number}", f"wind speed {values[0]:g} kn", "wind speeds must increase")
        angles = np.array(values[angle_at::2])
        speeds = np.array(values[3 - angle_at::2])
        if bool(np.any(np.diff(angles) <= 0.0)) or angles[0] < 0.0 or angles[-1] > 180.0:
            raise InputError(source, f"line {number}", "wind angles do not increase within 0..180 degrees",
                             "write TWS, then pairs of angle and speed")
        if bool(np.any(speeds < 0.0)) or bool(np.any(speeds > MAX_SPEED_KN)):
            raise InputError(source, f"line {number}", "a boat speed is out of range",
                             f"speeds are within 0..{MAX_SPEED_KN:g} kn")
        winds.append(values[0])
        columns.append((angles, np.where(speeds >= MIN_SPEED_KN, speeds, 0.0)))
    twa_deg = np.unique(np.concatenate([angles for angles, _ in columns]))
    table = np.empty((twa_deg.size, len(winds)))
    for j, (angles, speeds) in enumerate(columns):
        x, y = (angles, speeds) if angles[0] == 0.0 else (np.r_[0.0, angles], np.r_[0.0, speeds])
        table[:, j] = np.interp(twa_deg, x, y)
    return _finish(twa_deg, np.array(winds), table, source, [])


def _looks_like_angles(values: list[float]) -> bool:
    return max(values) >= 90.0 and max(values) <= 180.0 and all(b > a for a, b in pairwise(values))
