"""Telemetry logs: 8 bytes of big-endian microseconds since 1970, then one raw frame, and so on.

Every ground station reads them. The caller brings the wall clock; the two lowest bits of a stamp are 0, as in
MAVProxy's files (they once held flags). Written so that a power cut costs the last frame; the reader stops at a torn
tail, and finds its way again after damage in the middle.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from companion.disk import unpacked
from companion.errors import InputError
from companion.mavlink.wire.frames import STX

_STAMP = struct.Struct(">Q")
# Stamps outside 2000..2100 are damage, not time [µs].
_EARLIEST_US, _LATEST_US = 946_684_800_000_000, 4_102_444_800_000_000


def stamp(unix_us: int, frame: bytes) -> bytes:
    """Return one record: ``frame`` with its time [µs since 1970]."""
    return _STAMP.pack(unix_us & ~3) + frame


@dataclass(frozen=True, slots=True)
class TlogRecord:
    """One record: time [µs since 1970] and frame."""

    unix_us: int
    frame: bytes


def _frame_size(data: bytes, at: int) -> int:
    """Return the size of the frame at ``at``; 0 when there is none."""
    if len(data) - at < 12 or data[at] not in {STX, 0xFE}:
        return 0
    if data[at] == 0xFE:
        size = 8 + data[at + 1]
    else:
        size = 12 + data[at + 1] + (13 if data[at + 2] & 1 else 0)
    return size if at + size <= len(data) else 0


def parse_tlog(data: bytes) -> Iterator[TlogRecord]:
    """Yield the records in ``data``; what is torn or damaged is stepped over."""
    at = 0
    while at + 20 <= len(data):
        (unix_us,) = _STAMP.unpack_from(data, at)
        size = _frame_size(data, at + 8) if _EARLIEST_US < unix_us < _LATEST_US else 0
        if size == 0:
            at += 1
            continue
        yield TlogRecord(unix_us, data[at + 8 : at + 8 + size])
        at += 8 + size


def read_tlog(path: Path) -> list[TlogRecord]:
    """Return the records of a file (of one that gzip compressed, too), a torn tail left out.

    Raises:
        InputError: it cannot be read, or holds bytes and not one record.
    """
    try:
        data = path.read_bytes()
        data = unpacked(data) if path.suffix == ".gz" else data
    except OSError as error:
        reason = getattr(error, "strerror", None) or error
        raise InputError(str(path), "", f"cannot be read ({reason})") from error
    records = list(parse_tlog(data))
    if data and not records:
        raise InputError(str(path), "", "no MAVLink frame in it", "give a .tlog file")
    return records
