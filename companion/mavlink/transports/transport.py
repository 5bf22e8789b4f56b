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

import enum
import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from companion.errors import InputError

OnBytes = Callable[[bytes], None]

# A write buffer of 64 kB is 0.7 s of a 921600 baud port: beyond it a peer has stopped reading.
MAX_WRITE_BUFFER_BYTES = 65536
DEFAULT_BAUD = 921600


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
    bytes_dropped: int = 0
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
        return InputError("--link", text or "(empty)", problem, _REMEDY)

    if re.match(r"(serial:)?(/|COM\d)", text):
        # a device by path holds colons itself, but never ends in a plain word or number after one
        serial = re.fullmatch(r"(?:serial:)?(.+?)(?::(\w*))?", text)
        assert serial is not None
        device, baud = serial.group(1), serial.group(2)
        if baud is not None and not (baud.isascii() and baud.isdigit() and 1200 <= int(baud) <= 12_000_000):
            raise bad(f"{baud!r} is not a baud rate")
        return LinkName(text, "serial", device=device, baud=int(baud) if baud else DEFAULT_BAUD)
    kind, colon, rest = text.partition(":")
    if not colon or kind not in _KINDS:
        raise bad("not a link")
    host, colon, port = rest.removeprefix("//").rpartition(":")
    if not colon or not host:
        raise bad("host or port is missing")
    if not (port.isascii() and port.isdigit() and 0 < int(port) < 65536):
        raise bad(f"{port!r} is not a port from 1 to 65535")
    return LinkName(text, _KINDS[kind], host=host.strip("[]"), port=int(port))
