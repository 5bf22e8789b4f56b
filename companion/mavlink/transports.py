"""Bytes to and from an autopilot: the interface, and LINK names.

A transport owns one endpoint and knows nothing of MAVLink. ``write`` never waits and never raises: what cannot
be sent now is dropped and counted, because old telemetry is worth less than fresh. Stream transports (serial,
TCP) connect again for ever with capped full-jitter back-off; datagram transports need not.

LINK names::

    /dev/serial0:921600   serial port (also serial:/dev/ttyUSB0:57600), opened exclusively
    udpin:HOST:PORT       wait for datagrams here, answer whoever sent them
    udpout:HOST:PORT      send there first
    tcp:HOST:PORT         connect to a server (also tcpout:)
    tcpin:HOST:PORT       be the server of one client
"""

from __future__ import annotations

import asyncio
import contextlib
import enum
import errno
import random
import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol, cast

from companion.addresses import host_port, is_baud
from companion.clock import ended, now_s
from companion.errors import InputError, LinkError

OnBytes = Callable[[bytes], None]

# A write buffer of 64 kB is 0.7 s of a 921600 baud port: beyond it a peer has stopped reading.
MAX_WRITE_BUFFER_BYTES = 65536
DEFAULT_BAUD = 921600
BACKOFF_BASE_S = 0.25
BACKOFF_CAP_S = 10.0
# A TCP connection on which nothing came for this long is half open (the other side lost its power): hung up and made
# anew. An autopilot says something every second [s].
SILENT_TCP_S = 15.0
# A peer of udpin that was silent this long gives its place to the next one that speaks (a restarted router).
PEER_SILENCE_S = 3.0


class TransportState(enum.Enum):
    """Where the endpoint is in its life."""

    CLOSED = "closed"
    CONNECTING = "connecting"
    OPEN = "open"


@dataclass(slots=True)
class TransportStats:
    """Counters since ``open``; ``last_error`` is the newest refusal in words, empty when there was none."""

    bytes_in: int = 0
    bytes_out: int = 0
    writes_dropped: int = 0
    foreign_datagrams: int = 0
    connections: int = 0
    failed_connections: int = 0
    last_error: str = ""


class Transport(Protocol):
    """One endpoint. The in-process pair of the simulated autopilot has the same shape."""

    @property
    def name(self) -> str:
        """The LINK text, for messages."""

    @property
    def stats(self) -> TransportStats:
        """Live counters."""

    @property
    def state(self) -> TransportState:
        """Closed, connecting or open."""

    async def open(self, on_bytes: OnBytes) -> None:
        """Start; every received chunk goes to ``on_bytes`` on the event loop.

        Returns when a datagram socket is bound or a stream's first attempt to connect is under way.

        Raises:
            LinkError: the local endpoint cannot be had at all (address in use, no permission).
        """

    def write(self, data: bytes) -> None:
        """Send, or drop and count. Never waits, never raises."""

    async def close(self) -> None:
        """Stop; idempotent. Nothing calls ``on_bytes`` afterwards."""


@dataclass(frozen=True, slots=True)
class LinkName:
    """A LINK text taken apart: ``kind`` is serial, udpin, udpout, tcp or tcpin."""

    text: str
    kind: str
    host: str = ""
    port: int = 0
    device: str = ""
    baud: int = DEFAULT_BAUD


_KINDS = {"udpin": "udpin", "udp": "udpin", "udpout": "udpout", "tcp": "tcp", "tcpout": "tcp", "tcpin": "tcpin"}
_REMEDY = "write /dev/serial0:921600, udpin:HOST:PORT, udpout:HOST:PORT, tcp:HOST:PORT or tcpin:HOST:PORT"


def parse_link(text: str) -> LinkName:
    """Take a LINK text apart.

    Raises:
        InputError: it is none of the forms above.

    >>> parse_link("udpin:0.0.0.0:14551").port
    14551
    >>> parse_link("/dev/ttyAMA0").baud
    921600
    """

    def bad(problem: str) -> InputError:
        return InputError("--link", " ".join(text.split()) or "(empty)", problem, _REMEDY)

    if re.match(r"(serial:)?(/|COM\d)", text):
        # a device by path holds colons itself, but never ends in a plain word or number after one
        serial = re.fullmatch(r"(?:serial:)?(.+?)(?::(\w*))?", text)
        if serial is None:
            raise bad("more than one line")
        device, baud = serial.group(1), serial.group(2)
        if baud is not None and not is_baud(baud):
            raise bad(f"{baud!r} is not a baud rate")
        return LinkName(text, "serial", device=device, baud=int(baud) if baud else DEFAULT_BAUD)
    kind, colon, rest = text.partition(":")
    if not colon or kind not in _KINDS:
        raise bad("not a link")
    where = rest.removeprefix("//")
    found = host_port(where)
    if found is not None:
        return LinkName(text, _KINDS[kind], host=found[0], port=found[1])
    host, colon, port = where.rpartition(":")
    if not colon or not host:
        raise bad("host or port is missing")
    if host_port(f"host:{port}") is None:
        raise bad(f"{port!r} is not a port from 1 to 65535")
    raise bad(f"{host!r} is not a host (an address of IPv6 stands in brackets)")


def backoff_s(attempt: int, rng: random.Random) -> float:
    """Return the pause [s] before attempt ``attempt`` + 1, in 0..min(cap, base x 2^attempt)."""
    return rng.uniform(0.0, min(BACKOFF_CAP_S, BACKOFF_BASE_S * 2.0 ** min(attempt, 16)))


class _Stream(asyncio.Protocol):
    """One connection of a stream: hands bytes over and says when it is lost."""

    def __init__(self, owner: StreamEndpoint) -> None:
        self._owner = owner
        self.lost = asyncio.get_running_loop().create_future()

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        cast("Any", transport).set_write_buffer_limits(high=MAX_WRITE_BUFFER_BYTES)

    def data_received(self, data: bytes) -> None:
        self._owner.received(self, bytes(data))

    def connection_lost(self, exc: Exception | None) -> None:
        if not self.lost.done():
            self.lost.set_result(exc)


class _Endpoint:
    """What every transport here has: its name, its counters, its state, and who takes the bytes."""

    def __init__(self, link: LinkName) -> None:
        self._link = link
        self._stats = TransportStats()
        self._state = TransportState.CLOSED
        self._on_bytes: OnBytes | None = None

    @property
    def name(self) -> str:
        """The LINK text."""
        return self._link.text

    @property
    def stats(self) -> TransportStats:
        """Live counters."""
        return self._stats

    @property
    def state(self) -> TransportState:
        """Closed, connecting or open; a UDP socket that is bound is open whether or not anybody is there."""
        return self._state


class StreamEndpoint(_Endpoint):
    """Serial port, TCP client or TCP server of one client.

    It lives in one named task that connects, waits for the loss, and connects again after a capped full-jitter pause:
    uniform between 0 and min(cap, base x 2^n), so that many boats or programs do not knock in step. [AWS Architecture
    Blog, "Exponential Backoff And Jitter", 2015]
    """

    def __init__(self, link: LinkName, seed: int) -> None:
        super().__init__(link)
        self._rng = random.Random(seed)
        self._wire: Any = None
        self._stream: _Stream | None = None
        self._server: asyncio.Server | None = None
        self._accepted: asyncio.Queue[tuple[Any, _Stream]] = asyncio.Queue(maxsize=1)
        self._task: asyncio.Task[None] | None = None

    async def open(self, on_bytes: OnBytes) -> None:
        """Start connecting; a TCP server is bound on return."""
        if self._state is not TransportState.CLOSED:
            raise LinkError(f"{self.name} is already open")
        self._on_bytes = on_bytes
        if self._link.kind == "tcpin":
            try:
                self._server = await asyncio.get_running_loop().create_server(
                    self._accept, self._link.host, self._link.port
                )
            except OSError as error:
                raise LinkError(f"{self.name}: {_reason(error)}") from error
        self._state = TransportState.CONNECTING
        self._task = asyncio.get_running_loop().create_task(self._live(), name=f"transport {self.name}")

    def write(self, data: bytes) -> None:
        """Send, or drop and count."""
        wire = self._wire
        if wire is None or wire.is_closing() or wire.get_write_buffer_size() + len(data) > MAX_WRITE_BUFFER_BYTES:
            self._stats.writes_dropped += 1
            return
        wire.write(data)
        self._stats.bytes_out += len(data)

    async def close(self) -> None:
        """Stop."""
        self._on_bytes = None
        await ended(self._task)
        self._task = None
        if self._server is not None:
            self._server.close()
            self._server = None
        while not self._accepted.empty():  # a client that waited to be served
            _hang_up(self._accepted.get_nowait()[0])
        self._state = TransportState.CLOSED

    def received(self, stream: _Stream, data: bytes) -> None:
        """Count and hand over a chunk of the present connection."""
        if self._on_bytes is not None and stream is self._stream:
            self._stats.bytes_in += len(data)
            self._on_bytes(data)

    def _accept(self) -> _Stream:
        return _Accepting(self)

    def accepted(self, wire: Any, stream: _Stream) -> None:
        """Take a client of the server, or turn it away when there is one already."""
        if self._wire is not None or self._accepted.full():
            wire.close()
        else:
            self._accepted.put_nowait((wire, stream))

    async def _connect(self) -> tuple[Any, _Stream]:
        loop = asyncio.get_running_loop()
        if self._link.kind == "tcpin":
            return await self._accepted.get()
        if self._link.kind == "tcp":
            async with asyncio.timeout(10.0):
                return await loop.create_connection(lambda: _Stream(self), self._link.host, self._link.port)
        import serial_asyncio_fast

        # exclusive: two readers of one port each lose half of the bytes
        wire, stream = await serial_asyncio_fast.create_serial_connection(
            loop, lambda: _Stream(self), self._link.device, baudrate=self._link.baud, exclusive=True
        )
        return wire, cast("_Stream", stream)

    async def _live(self) -> None:
        attempt = 0
        while True:
            self._state = TransportState.CONNECTING
            try:
                wire, stream = await self._connect()
            except (OSError, TimeoutError, ValueError) as error:
                self._stats.failed_connections += 1
                self._stats.last_error = _reason(error)
                await asyncio.sleep(backoff_s(attempt, self._rng))
                attempt += 1
                continue
            opened_s = now_s()
            self._wire, self._stream = wire, stream
            self._state = TransportState.OPEN
            self._stats.connections += 1
            try:
                self._stats.last_error = await self._ended(stream)
            finally:
                self._wire = self._stream = None
                _hang_up(wire)
            # a connection that held starts the back-off from its beginning; one that fell at once does not
            attempt = 0 if now_s() - opened_s > BACKOFF_CAP_S else attempt + 1
            await asyncio.sleep(backoff_s(attempt, self._rng))

    async def _ended(self, stream: _Stream) -> str:
        """Wait for the end of a connection, or for a silence that means the same; return the reason."""
        while True:
            heard = self._stats.bytes_in
            try:
                async with asyncio.timeout(None if self._link.kind == "serial" else SILENT_TCP_S):
                    lost = await asyncio.shield(stream.lost)
            except TimeoutError:
                if self._stats.bytes_in == heard:
                    return f"silent for {SILENT_TCP_S:g} s"
                continue
            return _reason(lost) if lost else "closed by the other side"


class _Accepting(_Stream):
    """A connection that a client of our server made."""

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        super().connection_made(transport)
        self._owner.accepted(transport, self)


class DatagramEndpoint(_Endpoint):
    """UDP: ``udpin`` answers whoever speaks first, ``udpout`` speaks first."""

    def __init__(self, link: LinkName) -> None:
        super().__init__(link)
        self._wire: Any = None  # DatagramTransport; typeshed leaves out its get_write_buffer_size
        self._peer: tuple[Any, ...] | None = None
        self._heard_s = 0.0

    async def open(self, on_bytes: OnBytes) -> None:
        """Bind (udpin) or aim (udpout)."""
        if self._wire is not None:
            raise LinkError(f"{self.name} is already open")
        loop = asyncio.get_running_loop()
        address = (self._link.host, self._link.port)
        try:
            if self._link.kind == "udpin":
                self._wire, _ = await loop.create_datagram_endpoint(lambda: _Datagrams(self), local_addr=address)
            else:
                self._wire, _ = await loop.create_datagram_endpoint(lambda: _Datagrams(self), remote_addr=address)
        except OSError as error:
            raise LinkError(f"{self.name}: {_reason(error)}") from error
        self._on_bytes = on_bytes
        self._state = TransportState.OPEN
        self._stats.connections += 1

    def write(self, data: bytes) -> None:
        """Send one datagram, or drop and count."""
        wire = self._wire
        nobody = self._link.kind == "udpin" and self._peer is None
        if (
            wire is None
            or nobody
            or wire.is_closing()
            or wire.get_write_buffer_size() + len(data) > MAX_WRITE_BUFFER_BYTES
        ):
            self._stats.writes_dropped += 1
            return
        wire.sendto(data, self._peer if self._link.kind == "udpin" else None)
        self._stats.bytes_out += len(data)

    async def close(self) -> None:
        """Stop."""
        self._on_bytes = None
        if self._wire is not None:
            self._wire.abort()
            self._wire = None
            await asyncio.sleep(0)  # lets the loop close the socket
        self._state = TransportState.CLOSED

    def received(self, data: bytes, address: tuple[Any, ...]) -> None:
        """Count and hand over a datagram of our peer; another's is counted as foreign."""
        if self._on_bytes is None:
            return
        if self._link.kind == "udpin":
            now = now_s()
            if self._peer is not None and address != self._peer and now - self._heard_s < PEER_SILENCE_S:
                self._stats.foreign_datagrams += 1
                return
            self._peer, self._heard_s = address, now
        self._stats.bytes_in += len(data)
        self._on_bytes(data)

    def refused(self, error: Exception) -> None:
        """Remember what the network said; the next datagram may well get through."""
        self._stats.last_error = _reason(error)


class _Datagrams(asyncio.DatagramProtocol):
    def __init__(self, owner: DatagramEndpoint) -> None:
        self._owner = owner

    def datagram_received(self, data: bytes, addr: tuple[Any, ...]) -> None:
        self._owner.received(data, addr)

    def error_received(self, exc: Exception) -> None:
        self._owner.refused(exc)


def open_link(text: str, *, seed: int = 0) -> Transport:
    """Return the (still closed) transport of a LINK text; ``seed`` drives the jitter of reconnection.

    Raises:
        InputError: the text is not a LINK.
    """
    link = parse_link(text)
    return DatagramEndpoint(link) if link.kind in {"udpin", "udpout"} else StreamEndpoint(link, seed)


def _hang_up(wire: Any) -> None:
    """Close a connection without waiting for bytes that nobody will take."""
    with contextlib.suppress(Exception):
        wire.abort()


def _reason(error: BaseException) -> str:
    """Return an error in a few words."""
    if isinstance(error, TimeoutError):
        return "no answer"
    number = getattr(error, "errno", None)
    words = {
        errno.ENOENT: "no such device",
        errno.EACCES: "no permission (is the user in the group dialout?)",
        errno.EBUSY: "another program has it",
        errno.EADDRINUSE: "address already in use: another program listens there; stop it, or take another port",
        errno.ECONNREFUSED: "nobody listens there",
    }
    if isinstance(number, int) and number in words:
        return words[number]
    text = str(error) or type(error).__name__
    return "another program has it" if "exclusively lock" in text else text
