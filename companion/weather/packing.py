"""The values of a GRIB field: simple packing here, every other packing by gribberish (the extra ``weather``)."""

from __future__ import annotations

import math
import struct

import numpy as np
from numpy.typing import NDArray

from companion.weather.grib import GribField, Grid

_DAMAGED = "it is damaged: fetch it again"


def values_of(field: GribField) -> NDArray[np.float32]:
    """Return (rows, columns), south to north and west to east, NaN where the field says nothing.

    Raises InputError naming the message; ModuleNotFoundError for a packing that needs the extra where it is missing.
    """
    grid = field.grid
    assert grid is not None
    with np.errstate(all="ignore"):
        try:
            flat = _simple_1(field, grid) if field.edition == 1 else _simple_2(field, grid)
        except (IndexError, KeyError, ValueError, ArithmeticError, struct.error):
            raise field.refused("has packed values that do not fit its grid", _DAMAGED) from None
        if flat is None:
            flat = _by_library(field, grid)
        if np.isinf(flat).any():
            raise field.refused("has values without bounds", _DAMAGED)
        return _upright(flat, grid)


def _upright(flat: NDArray[np.float64], grid: Grid) -> NDArray[np.float32]:
    """Return the values as rows from the south and columns from the west, however they were scanned."""
    shape = (grid.columns, grid.rows) if grid.by_columns else (grid.rows, grid.columns)
    table = flat.reshape(shape)
    if grid.turns:
        table = table.copy()
        table[1::2] = table[1::2, ::-1]
    if grid.by_columns:
        table = table.T
    if grid.first_lat_deg > grid.last_lat_deg:
        table = table[::-1]
    if grid.leads_west:
        table = table[:, ::-1]
    return np.ascontiguousarray(table, dtype=np.float32)


def _by_library(field: GribField, grid: Grid) -> NDArray[np.float64]:
    import gribberish

    try:
        flat = np.asarray(gribberish.parse_grib_array(field.message, 0), dtype=np.float64).ravel()
    except (KeyboardInterrupt, SystemExit):
        raise
    except BaseException as error:  # a panic of Rust is no Exception
        raise field.refused("has values that cannot be unpacked", f"{_DAMAGED} ({type(error).__name__})") from None
    if flat.size != grid.rows * grid.columns:
        raise field.refused(f"has {flat.size} values for {grid.rows * grid.columns} points", _DAMAGED)
    return flat


def _unpacked(raw: bytes, bits: int, count: int) -> NDArray[np.float64]:
    """Return ``count`` whole numbers of ``bits`` each, the first bit the highest."""
    if bits > 32:
        raise ValueError(bits)
    if len(raw) * 8 < bits * count:
        raise ValueError(count)
    if bits == 0:
        return np.zeros(count)
    if bits in {8, 16, 32}:
        return np.frombuffer(raw, dtype=f">u{bits // 8}", count=count).astype(np.float64)
    parts = np.unpackbits(np.frombuffer(raw, dtype=np.uint8), count=bits * count).reshape(count, bits)
    return np.asarray(parts @ np.exp2(np.arange(bits - 1, -1, -1.0)), dtype=np.float64)


def _spread(values: NDArray[np.float64], known: NDArray[np.bool_] | None) -> NDArray[np.float64]:
    if known is None:
        return values
    out = np.full(known.size, math.nan)
    out[known] = values
    return out


def _bitmap(raw: bytes, points: int) -> NDArray[np.bool_]:
    return np.unpackbits(np.frombuffer(raw, dtype=np.uint8), count=points).astype(bool)


def _simple_1(field: GribField, grid: Grid) -> NDArray[np.float64] | None:
    """Return the values of a GRIB 1 message, None where it is not simply packed."""
    message = field.message
    points = grid.rows * grid.columns
    pds = message[8:]
    at = 8 + int.from_bytes(pds[:3], "big")
    at += int.from_bytes(message[at : at + 3], "big")  # the grid, which ``walk`` asked for
    known = None
    if pds[7] & 0x40:
        size = int.from_bytes(message[at : at + 3], "big")
        if message[at + 4 : at + 6] != b"\0\0":
            raise field.refused("names a bitmap of its centre and does not say it", "convert it to GRIB 2")
        known = _bitmap(message[at + 6 : at + size], points)
        at += size
    bds = message[at : at + int.from_bytes(message[at : at + 3], "big")]
    if bds[3] & 0xF0 & ~0x20:  # 0x20: the values were whole numbers
        return None
    scale = int.from_bytes(bds[4:6], "big")
    binary = -(scale & 0x7FFF) if scale & 0x8000 else scale
    decimal = int.from_bytes(pds[26:28], "big")
    decimal = -(decimal & 0x7FFF) if decimal & 0x8000 else decimal
    sign, mantissa = bds[6] & 0x80, int.from_bytes(bds[7:10], "big")
    reference = (-1.0 if sign else 1.0) * mantissa * 2.0**-24 * 16.0 ** ((bds[6] & 0x7F) - 64)  # a float of IBM's
    count = points if known is None else int(known.sum())
    raw = _unpacked(bds[11:], bds[10], count)
    return _spread((reference + raw * 2.0**binary) / 10.0**decimal, known)


def _simple_2(field: GribField, grid: Grid) -> NDArray[np.float64] | None:
    """Return the values of a GRIB 2 message of one field, None where it is not simply packed."""
    sections: dict[int, bytes] = {}
    at, message = 16, field.message
    while at < len(message) - 4:
        size = int.from_bytes(message[at : at + 4], "big")
        sections[message[at + 4]] = message[at : at + size]
        at += size
    five, six = sections[5], sections[6]
    if int.from_bytes(five[9:11], "big") != 0:
        return None
    points = grid.rows * grid.columns
    if six[5] not in {0, 255}:
        raise field.refused(f"names a bitmap that is not in it ({six[5]})", "convert it")
    known = _bitmap(six[6:], points) if six[5] == 0 else None
    reference, binary, decimal = struct.unpack(">fHH", five[11:19])
    binary = -(binary & 0x7FFF) if binary & 0x8000 else binary
    decimal = -(decimal & 0x7FFF) if decimal & 0x8000 else decimal
    count = int.from_bytes(five[5:9], "big")
    if count != (points if known is None else int(known.sum())):
        raise ValueError(count)
    raw = _unpacked(sections[7][5:], five[19], count)
    return _spread((reference + raw * 2.0**binary) / 10.0**decimal, known)
