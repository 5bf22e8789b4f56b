"""What the companion sees of other vessels, on the air: a TUNNEL of its own beside the status. Pure.

It goes out every other time with the status and only where vessels or feeds are: at most 35 bytes/s more.
"""

from __future__ import annotations

import math
import struct

from companion.geo.angles import wrap_two_pi
from companion.messages import TrafficStatus

PAYLOAD_TYPE = 0xC05B
VERSION = 1
MAX_PAYLOAD_BYTES = 128
# Version, feeds, silent feeds, shared MMSIs, clock jumps; vessels, refused, silence [s], TCPA [s], bearing [0.01 deg];
# range and CPA [m], the two risks. The words follow: alarm, role, rule, name.
_PACK = struct.Struct("<BBBBBHHHHHffff")
_NONE16 = 0xFFFF
_MARK = "\x1f"
_WORDS = 4


def _u16(value: float | None) -> int:
    return _NONE16 if value is None else max(0, min(_NONE16 - 1, round(value)))


def _u8(value: int) -> int:
    return max(0, min(255, value))


def _f32(value: float | None) -> float:
    return math.nan if value is None else max(-3e38, min(3e38, value))


def _seconds(value: int) -> float | None:
    return None if value == _NONE16 else float(value)


def _float(value: float) -> float | None:
    return value if math.isfinite(value) else None


def pack_traffic(status: TrafficStatus) -> bytes:
    """Return the payload of a TUNNEL, at most 128 bytes; the name is cut to what fits."""
    bearing = status.bearing_rad
    head = _PACK.pack(
        VERSION, _u8(status.feeds), _u8(status.silent_feeds), _u8(status.shared_mmsi), _u8(status.clock_jumps),
        _u16(status.vessels), _u16(status.refused), _u16(status.silence_s), _u16(status.tcpa_s),
        _NONE16 if bearing is None else round(math.degrees(wrap_two_pi(bearing)) * 100.0) % 36000,
        _f32(status.range_m), _f32(status.cpa_m), _f32(status.promised_risk), _f32(status.path_risk),
    )
    words = _MARK.join(w.replace(_MARK, " ") for w in (status.alarm, status.role, status.rule, status.name))
    return head + words.encode("ascii", "replace")[:MAX_PAYLOAD_BYTES - _PACK.size]


def unpack_traffic(payload: bytes) -> TrafficStatus:
    """Return what is in a TUNNEL payload.

    Raises:
        ValueError: it is not one of ours, is of another version, or is torn.
    """
    if len(payload) < _PACK.size or payload[0] != VERSION:
        raise ValueError(f"traffic payload of {len(payload)} bytes, version {payload[0] if payload else None}")
    (_, feeds, silent, shared, jumps, vessels, refused, silence, tcpa, bearing, range_m, cpa_m, promised,
     path) = _PACK.unpack_from(payload)
    words = payload[_PACK.size:].decode("ascii", "replace").split(_MARK)
    if len(words) != _WORDS:
        raise ValueError("traffic payload is torn")
    return TrafficStatus(
        vessels=vessels, refused=refused, feeds=feeds, silent_feeds=silent, shared_mmsi=shared, clock_jumps=jumps,
        silence_s=_seconds(silence), tcpa_s=_seconds(tcpa), range_m=_float(range_m), cpa_m=_float(cpa_m),
        promised_risk=_float(promised), path_risk=_float(path),
        bearing_rad=None if bearing == _NONE16 else math.radians(bearing / 100.0),
        alarm=words[0], role=words[1], rule=words[2], name=words[3],
    )
