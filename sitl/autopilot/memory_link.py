"""Links without a network: transports in one process, with a radio's faults between them, or shared by several.

Both ends have the shape of ``companion.mavlink.transports.Transport``. Nothing is lost by default. Faults are
drawn from a seed, frame by frame, so that under the virtual clock a bad link repeats exactly.
"""

from __future__ import annotations

import asyncio
import random
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from companion.clock import now_s
from companion.errors import LinkError
from companion.mavlink.transports import OnBytes, Transport, TransportState, TransportStats

_STX = 0xFD


@dataclass(frozen=True, slots=True, kw_only=True)
class Impairment:
    """What the link does to each frame, in either direction; probabilities are per frame.

    Attributes:
        loss: share of frames that vanish.
        duplicate: share that arrive twice.
        reorder: share held back so that later frames overtake them, by up to ``reorder_s``.
        corrupt: share with one byte changed.
        noise: share of the stream's bytes that are lost, changed, or preceded by one that nobody sent.
        delay_s: for every frame, one way.
        jitter_s: a further delay, uniform on 0..jitter_s; order is kept.
    """

    loss: float = 0.0
    duplicate: float = 0.0
    reorder: float = 0.0
    reorder_s: float = 0.2
    corrupt: float = 0.0
    noise: float = 0.0
    delay_s: float = 0.0
    jitter_s: float = 0.0

    def __post_init__(self) -> None:
        for name in ("loss", "duplicate", "reorder", "corrupt", "noise"):
            if not 0.0 <= getattr(self, name) <= 1.0:
                raise ValueError(f"{name} is a probability, not {getattr(self, name)}")


PERFECT = Impairment()


class MemoryLink:
    """A pair of ends, ``near`` (for a companion) and ``far`` (for the autopilot).

    ``impairment`` may be replaced at any time; ``cut()`` silences both directions until ``mend()``, ``near.is_mute``
    and ``far.is_mute`` one of them, as a half-open TCP connection does.
    """

    def __init__(self, name: str = "memory", *, impairment: Impairment = PERFECT, seed: int = 0) -> None:
        self.impairment = impairment
        self.is_cut = False
        self.near = MemoryEnd(f"{name}:near", self, random.Random(f"{seed} near"))
        self.far = MemoryEnd(f"{name}:far", self, random.Random(f"{seed} far"))
        self.near.other, self.far.other = self.far, self.near

    @property
    def is_up(self) -> bool:
        """Whether both sides hear each other."""
        return not (self.is_cut or self.near.is_mute or self.far.is_mute)

    def cut(self) -> None:
        """Let nothing through from now on; what is under way still arrives."""
        self.is_cut = True

    def mend(self) -> None:
        """End a cut."""
        self.is_cut = False


class MemoryEnd:
    """One end; a ``Transport``. Both ends may be closed and opened again."""

    def __init__(self, name: str, link: MemoryLink, rng: random.Random) -> None:
        self.other: MemoryEnd = self
        self.is_mute = False  # what it says is heard by nobody
        self._name = name
        self._link = link
        self._rng = rng
        self._stats = TransportStats()
        self._on_bytes: OnBytes | None = None
        self._last_arrival_s = 0.0
        self._under_way: deque[bytes] = deque()

    @property
    def name(self) -> str:
        """A name for messages."""
        return self._name

    @property
    def stats(self) -> TransportStats:
        """Live counters."""
        return self._stats

    @property
    def state(self) -> TransportState:
        """Open or closed."""
        return TransportState.CLOSED if self._on_bytes is None else TransportState.OPEN

    async def open(self, on_bytes: OnBytes) -> None:
        """Start to receive."""
        if self._on_bytes is not None:
            raise LinkError(f"{self._name} is already open")
        self._on_bytes = on_bytes
        self._stats.connections += 1

    async def close(self) -> None:
        """Stop to receive; what is under way is lost."""
        self._on_bytes = None

    def write(self, data: bytes) -> None:
        """Send every frame in ``data`` on its own way through the link."""
        if self._on_bytes is None or self._link.is_cut or self.is_mute:
            self._stats.writes_dropped += 1
            return
        self._stats.bytes_out += len(data)
        faults = self._link.impairment
        if faults == PERFECT:
            asyncio.get_running_loop().call_soon(self.other.deliver, data)
            return
        if faults.noise:
            data = _noisy(data, faults.noise, self._rng)
        for frame in frames(data):
            self._send(frame, faults)

    def _send(self, frame: bytes, faults: Impairment) -> None:
        rng = self._rng
        if rng.random() < faults.loss:
            self._stats.writes_dropped += 1
            return
        copies = 2 if rng.random() < faults.duplicate else 1
        for _ in range(copies):
            sent = frame
            if rng.random() < faults.corrupt:
                place = rng.randrange(len(frame))
                sent = frame[:place] + bytes([frame[place] ^ rng.randrange(1, 256)]) + frame[place + 1 :]
            arrival_s = now_s() + faults.delay_s + faults.jitter_s * rng.random()
            loop = asyncio.get_running_loop()
            if rng.random() < faults.reorder:
                loop.call_at(arrival_s + faults.reorder_s * rng.random(), self.other.deliver, sent)
            else:
                # timers of one moment fire in any order; the queue keeps that of sending
                arrival_s = self._last_arrival_s = max(arrival_s, self._last_arrival_s)
                self._under_way.append(sent)
                loop.call_at(arrival_s, self._deliver_first)

    def _deliver_first(self) -> None:
        self.other.deliver(self._under_way.popleft())

    def deliver(self, data: bytes) -> None:
        """Hand over what arrived, if anybody is there."""
        if self._on_bytes is not None:
            self._stats.bytes_in += len(data)
            self._on_bytes(data)


def _noisy(data: bytes, share: float, rng: random.Random) -> bytes:
    """Return bytes of which a ``share`` was lost, changed or preceded by a strange one, a third each."""
    out = bytearray()
    for byte in data:
        fate = rng.random() / share
        if fate >= 1.0:
            out.append(byte)
        elif fate >= 2.0 / 3.0:
            out.append(byte ^ rng.randrange(1, 256))
        elif fate >= 1.0 / 3.0:
            out += bytes([rng.randrange(256), byte])
    return bytes(out)


def frames(data: bytes) -> Iterator[bytes]:
    """Split bytes into MAVLink 2 frames; what is none comes out as it is, up to the next frame."""
    start = 0
    while start < len(data):
        end = start + _frame_length(data, start)
        yield data[start:end]
        start = end


class FrameStream:
    """A byte stream, which may be cut anywhere, as whole frames."""

    def __init__(self) -> None:
        self._rest = b""

    def take(self, data: bytes) -> list[bytes]:
        """Return the frames that ``data`` completes; what is no frame comes out as in ``frames``."""
        whole = list(frames(self._rest + data))
        self._rest = b""
        if whole and len(whole[-1]) < _frame_length(whole[-1], 0):
            self._rest = whole.pop()
        return whole


def _frame_length(data: bytes, start: int) -> int:
    """Return the length of the frame at ``start``, at least 12 where it is not told yet, or of what is no frame."""
    if data[start] != _STX:
        end = data.find(bytes([_STX]), start + 1)
        return (len(data) if end < 0 else end) - start
    if start + 3 > len(data):
        return 12
    return 12 + data[start + 1] + (13 if data[start + 2] & 1 else 0)


class RadioChannel:
    """One channel that several transmit on: what one says, all others hear. The companion's end; a ``Transport``.

    Args:
        ends: the boats' ends, one for each autopilot in range.
        on_heard: gets every piece that a boat says, before the companion does: for one who listens.
    """

    def __init__(self, *ends: Transport, on_heard: Callable[[bytes], None] | None = None) -> None:
        self._ends, self._on_heard = ends, on_heard
        self._on_bytes: OnBytes | None = None

    @property
    def name(self) -> str:
        """A name for messages."""
        return "air:" + "+".join(end.name for end in self._ends)

    @property
    def stats(self) -> TransportStats:
        """The counters of the first end."""
        return self._ends[0].stats

    @property
    def state(self) -> TransportState:
        """Open or closed."""
        return self._ends[0].state

    async def open(self, on_bytes: OnBytes) -> None:
        """Start to hear."""
        self._on_bytes = on_bytes
        for end in self._ends:
            await end.open(self._hear)

    def write(self, data: bytes) -> None:
        """Speak to everybody."""
        for end in self._ends:
            end.write(data)

    async def close(self) -> None:
        """Stop to hear."""
        for end in self._ends:
            await end.close()
        self._on_bytes = None

    def say(self, data: bytes) -> None:
        """Let the companion hear what no boat said."""
        if self._on_bytes is not None:
            self._on_bytes(data)

    def _hear(self, data: bytes) -> None:
        if self._on_heard is not None:
            self._on_heard(data)
        self.say(data)
