"""Signs what a simulated autopilot says and strips the signature from what it is told: it has no key of its own."""

from __future__ import annotations

import hashlib

from pymavlink.dialects.v20 import ardupilotmega as wire

from companion.mavlink.transports import OnBytes, Transport, TransportState, TransportStats
from sitl.autopilot import FrameStream

_V2, _SIGNED = 0xFD, 0x01
_SIGNATURE_BYTES = 13


class Signer:
    """A key, and a timestamp [10 µs since 2015] that grows with every frame."""

    def __init__(self, key: bytes, timestamp: int, *, link_id: int = 1) -> None:
        self._key, self._timestamp, self._link_id = key, timestamp, link_id

    def sign(self, frame: bytes) -> bytes:
        """Return an unsigned frame with a signature; anything else as it is."""
        if not _is_v2(frame) or frame[2] & _SIGNED:
            return frame
        plain = _with_flag(frame[:10 + frame[1]], _SIGNED)
        self._timestamp += 1
        stamped = plain + bytes([self._link_id]) + self._timestamp.to_bytes(6, "little")
        return stamped + hashlib.sha256(self._key + stamped).digest()[:6]

    @staticmethod
    def strip(frame: bytes) -> bytes:
        """Return a signed frame without its signature; anything else as it is."""
        if not _is_v2(frame) or not frame[2] & _SIGNED:
            return frame
        return _with_flag(frame[:-_SIGNATURE_BYTES - 2], 0)


def _is_v2(frame: bytes) -> bool:
    return len(frame) >= 12 and frame[0] == _V2 and int.from_bytes(frame[7:10], "little") in wire.mavlink_map


def _with_flag(body: bytes, flag: int) -> bytes:
    """Return header and payload with the incompatibility flag and a checksum that fits."""
    body = body[:2] + bytes([flag]) + body[3:]
    extra = wire.mavlink_map[int.from_bytes(body[7:10], "little")].crc_extra
    return body + int(wire.x25crc(body[1:] + bytes([extra])).crc).to_bytes(2, "little")


class SignedEnd:
    """A boat's end behind a ``Signer``; a ``Transport``."""

    def __init__(self, end: Transport, signer: Signer) -> None:
        self._end, self._signer = end, signer
        self._from_boat, self._to_boat = FrameStream(), FrameStream()

    @property
    def name(self) -> str:
        """A name for messages."""
        return f"signed:{self._end.name}"

    @property
    def stats(self) -> TransportStats:
        """The end's counters."""
        return self._end.stats

    @property
    def state(self) -> TransportState:
        """The end's."""
        return self._end.state

    async def open(self, on_bytes: OnBytes) -> None:
        """Start to hear."""
        await self._end.open(lambda data: on_bytes(b"".join(map(self._signer.sign, self._from_boat.take(data)))))

    def write(self, data: bytes) -> None:
        """Speak."""
        self._end.write(b"".join(map(self._signer.strip, self._to_boat.take(data))))

    async def close(self) -> None:
        """Stop to hear."""
        await self._end.close()
