"""A link with signatures, and somebody in the middle of it who forges."""

from __future__ import annotations

import asyncio
import hashlib
import time
from dataclasses import dataclass
from pathlib import Path

from pymavlink.dialects.v20 import ardupilotmega as wire

from companion.clock import now_s
from companion.mavlink.signing import EPOCH_S, TICKS_PER_S, read_key
from companion.mavlink.transports import OnBytes, Transport, TransportState, TransportStats, open_link
from sitl.autopilot import FrameStream
from sitl.faults import Forger, Forgery

_V2, _SIGNED = 0xFD, 0x01
_SIGNATURE_BYTES = 13
LINK_ID = 1


class Signer:
    """A key, and a timestamp [10 µs since 2015] that grows with every frame."""

    def __init__(self, key: bytes, timestamp: int) -> None:
        self._key, self._timestamp = key, timestamp

    def sign(self, frame: bytes) -> bytes:
        """Return an unsigned frame with a signature; anything else as it is."""
        if not _is_v2(frame) or frame[2] & _SIGNED:
            return frame
        plain = _with_flag(frame[: 10 + frame[1]], _SIGNED)
        self._timestamp += 1
        stamped = plain + bytes([LINK_ID]) + self._timestamp.to_bytes(6, "little")
        return stamped + hashlib.sha256(self._key + stamped).digest()[:6]

    @staticmethod
    def strip(frame: bytes) -> bytes:
        """Return a signed frame without its signature; anything else as it is."""
        if not _is_v2(frame) or not frame[2] & _SIGNED:
            return frame
        return _with_flag(frame[: -_SIGNATURE_BYTES - 2], 0)


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


@dataclass(frozen=True, slots=True, kw_only=True)
class SpoofingPlan:
    """What to forge, one after another in turn, ``count`` frames in all; ``key`` and ``boat_key`` are key files."""

    forgeries: tuple[Forgery, ...]
    rate_hz: float
    count: int
    for_s: float
    system: int = 1
    listens: bool = False
    key: Path | None = None
    boat_key: Path | None = None


class ManInTheMiddle:
    """Between the boat at one LINK and the companion at another."""

    def __init__(self, boat: str, companion: str, plan: SpoofingPlan) -> None:
        self._plan = plan
        self.sent = self.passed = 0
        timestamp = int((time.time() - EPOCH_S) * TICKS_PER_S)
        end: Transport = open_link(boat)
        if plan.boat_key is not None:
            end = SignedEnd(end, Signer(read_key(plan.boat_key), timestamp))
        self._boat, self._companion = end, open_link(companion)
        self._forger = Forger(
            system=plan.system,
            listens=plan.listens,
            timestamp=timestamp,
            key=None if plan.key is None else read_key(plan.key),
        )

    async def run(self) -> None:
        """Forge, and pass on until the time is over."""
        plan = self._plan
        await self._companion.open(self._boat.write)
        try:
            await self._boat.open(self._from_boat)
            try:
                until_s = now_s() + plan.for_s
                while self.sent < plan.count and now_s() < until_s:
                    forgery = plan.forgeries[self.sent % len(plan.forgeries)]
                    self._companion.write(self._forger.frame(now_s(), forgery))
                    self.sent += 1
                    await asyncio.sleep(1.0 / plan.rate_hz)
                await asyncio.sleep(max(0.0, until_s - now_s()))
            finally:
                await self._boat.close()
        finally:
            await self._companion.close()

    def _from_boat(self, data: bytes) -> None:
        self.passed += len(data)
        self._forger.hear(now_s(), data)
        self._companion.write(data)
