"""GRIB files made for tests: simple packing of 16 bits, one message a field, as small as the manuals allow."""

import struct

import numpy as np

WIND_EAST, WIND_NORTH, GUST = (0, 2, 2), (0, 2, 3), (0, 2, 22)
CURRENT_EAST, CURRENT_NORTH = (10, 1, 2), (10, 1, 3)
BASE = "2026-04-20T00:00"


def signed(value, size):
    """A number with its sign in the first bit."""
    return (abs(value) | (1 << (8 * size - 1)) * (value < 0)).to_bytes(size, "big")


def section(number, body):
    return struct.pack(">IB", len(body) + 5, number) + body


def packed(values, bits):
    """Return (reference, binary scale, raw bytes) of known values."""
    low, span = float(np.min(values)), float(np.ptp(values))
    reference = float(np.float32(low))
    if reference > low:
        reference = float(np.nextafter(np.float32(low), np.float32(-np.inf)))
    scale = int(np.ceil(np.log2(max(span, 1e-6) / (2**bits - 2))))
    raw = np.rint((np.asarray(values, dtype=float) - reference) / 2.0**scale).astype(np.uint64)
    lines = (raw[:, None] >> np.arange(bits - 1, -1, -1, dtype=np.uint64)) & np.uint64(1)
    return reference, scale, np.packbits(lines.astype(np.uint8)).tobytes()


def scanned(values, scan):
    """Values from south to north and west to east, in the order of a scanning mode."""
    table = np.asarray(values, dtype=float)
    table = table if scan & 0x40 else table[::-1]
    table = table[:, ::-1] if scan & 0x80 else table
    table = table.T if scan & 0x20 else table
    if scan & 0x10:
        table = table.copy()
        table[1::2] = table[1::2, ::-1]
    return table.ravel()


def corners(lat, lon, scan):
    lat1, lat2 = (lat[0], lat[-1]) if scan & 0x40 else (lat[-1], lat[0])
    lon1, lon2 = (lon[-1], lon[0]) if scan & 0x80 else (lon[0], lon[-1])
    return lat1, lon1, lat2, lon2


def when(text):
    stamp = np.datetime64(text, "s").astype("datetime64[s]").astype(object)
    return stamp.year, stamp.month, stamp.day, stamp.hour, stamp.minute


def grid_2(lat, lon, scan, template):
    millionths = [round(1e6 * v) for v in corners(lat, lon, scan)]
    steps = [round(1e6 * (axis[-1] - axis[0]) / (len(axis) - 1)) for axis in (lon, lat)]
    shape = bytes([6]) + b"\0" * 15 + struct.pack(">II", len(lon), len(lat)) + struct.pack(">II", 0, 0xFFFFFFFF)
    places = signed(millionths[0], 4) + signed(millionths[1], 4) + b"\x30" + signed(millionths[2], 4)
    places += signed(millionths[3], 4) + struct.pack(">II", *steps) + bytes([scan])
    return section(3, b"\0" + struct.pack(">IBBH", len(lat) * len(lon), 0, 0, template) + shape + places)


def message_2(what, values, lat, lon, hours=0, *, base=BASE, member=None, scan=0, bits=16, level=(103, 10),
              template=0, product=None, over_h=0):  # fmt: skip
    """Return a GRIB 2 message; NaN becomes a bitmap, ``over_h`` the maximum of so many hours before ``hours``."""
    discipline, category, number = what
    year, *rest = when(base)
    one = section(1, struct.pack(">HHBBBH", 98, 0, 20, 0, 1, year) + bytes([*rest, 0, 0, 1]))
    surface = struct.pack(">BBI", level[0], 0, level[1]) + b"\xff" * 6
    kind = product if product is not None else (8 if over_h else 0) + (member is not None) * (3 if over_h else 1)
    body = struct.pack(">HHBBBBBHBBI", 0, kind, category, number, 4, 0, 0, 0, 0, 1, hours - over_h) + surface
    if member is not None:
        body += bytes([3, member, 50])
    if over_h:
        end = when(str(np.datetime64(base, "h") + np.timedelta64(hours, "h")))
        body += struct.pack(">HBBBBB", *end, 0) + struct.pack(">BIBBBIBI", 1, 0, 2, 2, 1, over_h, 255, 0)
    flat = scanned(values, scan)
    known = ~np.isnan(flat)
    reference, scale, raw = packed(flat[known], bits)
    five = struct.pack(">IH", int(known.sum()), 0) + struct.pack(">f", reference) + signed(scale, 2) + b"\0\0"
    six = b"\xff" if known.all() else b"\0" + np.packbits(known).tobytes()
    parts = (one, grid_2(lat, lon, scan, template), section(4, body), section(5, five + bytes([bits, 0])),
             section(6, six), section(7, raw), b"7777")  # fmt: skip
    whole = b"".join(parts)
    return b"GRIB\0\0" + bytes([discipline, 2]) + struct.pack(">Q", 16 + len(whole)) + whole


def ibm(value):
    """Return an IBM float of no more than the value."""
    sign, value, power = 0x80 * (value < 0), abs(value), 64
    while value >= 1.0:
        value, power = value / 16.0, power + 1
    while 0.0 < value < 1.0 / 16.0:
        value, power = value * 16.0, power - 1
    return bytes([sign | power]) + int(value * 2**24).to_bytes(3, "big")


def message_1(parameter, values, lat, lon, hours=0, *, base=BASE, level=(105, 10), center=7, table=2, kind=0,
              scan=0, bits=16, grid_type=0, member=None):  # fmt: skip
    """Return a GRIB 1 message, simply packed; values are whole 16ths of a power of two for an exact reference."""
    year, month, day, hour, minute = when(base)
    ahead = struct.pack(">H", hours) if kind == 10 else bytes([hours, 0])
    flat = scanned(values, scan)
    known = ~np.isnan(flat)
    pds = bytes([table, center, 1, 255, 0x80 | 0x40 * (not known.all()), parameter, level[0]])
    pds += struct.pack(">H", level[1]) + bytes([(year - 1) % 100 + 1, month, day, hour, minute, 1]) + ahead
    pds += bytes([kind, 0, 0, 0, (year - 1) // 100 + 1, 0, 0, 0])
    if member is not None:  # MARS labelling of ECMWF
        pds += b"\0" * 12 + bytes([1, 1, 11]) + struct.pack(">H", 1035) + b"0001" + bytes([member, 51, 0])
    lat1, lon1, lat2, lon2 = (round(1000 * v) for v in corners(lat, lon, scan))
    steps = [round(1000 * (axis[-1] - axis[0]) / (len(axis) - 1)) for axis in (lon, lat)]
    gds = bytes([0, 255, grid_type]) + struct.pack(">HH", len(lon), len(lat))
    gds += signed(lat1, 3) + signed(lon1, 3) + b"\x80" + signed(lat2, 3) + signed(lon2, 3)
    gds += struct.pack(">HH", *steps) + bytes([scan]) + b"\0" * 4
    reference, scale, raw = packed(flat[known], bits)
    bds = b"\0" + signed(scale, 2) + ibm(reference) + bytes([bits]) + raw
    bms = b""
    if not known.all():
        bits_of = np.packbits(known).tobytes()
        bms = (6 + len(bits_of)).to_bytes(3, "big") + bytes([-len(flat) % 8, 0, 0]) + bits_of
    sections = b"".join((3 + len(part)).to_bytes(3, "big") + part for part in (pds, gds))
    whole = sections + bms + (3 + len(bds)).to_bytes(3, "big") + bds + b"7777"
    return b"GRIB" + (8 + len(whole)).to_bytes(3, "big") + b"\1" + whole


def wind_2(lat, lon, hours, east, north, **more):
    """Return the two messages of a wind that is the same everywhere, or of arrays."""
    shape = (len(lat), len(lon))
    pair = (np.broadcast_to(np.asarray(v, dtype=float), shape) for v in (east, north))
    return b"".join(
        message_2(q, v, lat, lon, hours, **more) for q, v in zip((WIND_EAST, WIND_NORTH), pair, strict=True)
    )
