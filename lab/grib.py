"""Weather written as GRIB 2: winds of 10 m, simply packed in 16 bits, as any router reads them."""

from __future__ import annotations

import datetime as dt
import struct

import numpy as np
from numpy.typing import NDArray

from companion.weather import Cube

_BITS = 16
_EAST, _NORTH = 2, 3  # numbers of the components in discipline 0, category 2


def grib_of(cube: Cube) -> bytes:
    """Return a cube of winds; its times are forecast hours of its first one. Members make an ensemble of it."""
    base = dt.datetime.fromtimestamp(float(cube.base_utc_s[0]), dt.UTC)
    grid = _grid(cube)
    out = []
    for k, utc_s in enumerate(cube.utc_s):
        hours = round((float(utc_s) - float(cube.base_utc_s[0])) / 3600.0)
        for row, member in enumerate(cube.members):
            of = (member, len(cube.members)) if len(cube.members) > 1 else None
            for c, number in enumerate((_EAST, _NORTH)):
                out.append(_message(number, cube.values[row, k, :, :, c], grid, base, hours, of))
    return b"".join(out)


def _section(number: int, body: bytes) -> bytes:
    return struct.pack(">IB", len(body) + 5, number) + body


def _signed(value: int, size: int) -> bytes:
    """Return a number with its sign in the first bit."""
    return (abs(value) | (1 << (8 * size - 1)) * (value < 0)).to_bytes(size, "big")


def _grid(cube: Cube) -> bytes:
    """Return section 3: latitudes and longitudes, scanned from the north-west as files of weather services are."""
    lat, lon = cube.lat_deg, cube.lon_deg
    millionths = [round(1e6 * float(v)) for v in (lat[-1], lon[0] % 360.0, lat[0], lon[-1] % 360.0)]
    steps = [round(1e6 * float(axis[-1] - axis[0]) / (axis.size - 1)) for axis in (lon, lat)]
    body = struct.pack(">BIBBH", 0, lat.size * lon.size, 0, 0, 0) + bytes([6]) + b"\0" * 15
    body += struct.pack(">IIII", lon.size, lat.size, 0, 0xFFFFFFFF)
    body += _signed(millionths[0], 4) + _signed(millionths[1], 4) + b"\x30" + _signed(millionths[2], 4)
    return _section(3, body + _signed(millionths[3], 4) + struct.pack(">II", *steps) + b"\0")


def _message(
    number: int, values: NDArray[np.float32], grid: bytes, base: dt.datetime, hours: int, member: tuple[int, int] | None
) -> bytes:
    when = struct.pack(">HBBBBB", base.year, base.month, base.day, base.hour, base.minute, base.second)
    one = _section(1, struct.pack(">HHBBB", 255, 0, 20, 0, 1) + when + bytes([0, 1]))
    surface = struct.pack(">BBI", 103, 0, 10) + b"\xff" * 6
    kind = 0 if member is None else 1
    product = struct.pack(">HHBBBBBHBBI", 0, kind, 2, number, 4, 0, 0, 0, 0, 1, hours) + surface
    if member is not None:
        product += bytes([3, member[0], member[1]])
    flat = values[::-1].astype(np.float64).ravel()
    reference = float(np.nextafter(np.float32(flat.min()), np.float32(-np.inf)))
    scale = int(np.ceil(np.log2(max(float(flat.max()) - reference, 1e-6) / (2**_BITS - 1))))
    raw = np.rint((flat - reference) / 2.0**scale).astype(">u2").tobytes()
    five = struct.pack(">IHf", flat.size, 0, reference) + _signed(scale, 2) + b"\0\0" + bytes([_BITS, 0])
    whole = one + grid + _section(4, product) + _section(5, five) + _section(6, b"\xff") + _section(7, raw) + b"7777"
    return b"GRIB\0\0" + bytes([0, 2]) + struct.pack(">Q", 16 + len(whole)) + whole
