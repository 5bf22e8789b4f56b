"""Addresses: a host with its port, a serial port's rate, where NMEA 0183 goes to, and where a Signal K server is."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path
from urllib.parse import urlsplit

from companion.errors import InputError

LOOPBACK = "127.0.0.1"
STREAM = "/signalk/v1/stream"  # of a Signal K server
_NMEA = "write udp:HOST:PORT, or tcp:[HOST:]PORT to be a server (default HOST: 127.0.0.1)"
_SIGNALK = "write ws://HOST:3000 or tcp:HOST:8375"


@dataclass(frozen=True, slots=True, kw_only=True)
class OutputName:
    """Where to: ``kind`` is udp, tcp, ws or wss; ``text`` is as it was given; ``url`` a WebSocket's."""

    text: str
    kind: str
    host: str
    port: int
    url: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Displays:
    """Whom a voyage is told to; ``token`` is what was read of ``token_file``, for the Signal K servers."""

    nmea: tuple[OutputName, ...] = ()
    signalk: tuple[OutputName, ...] = ()
    token_file: Path | None = None
    token: str = field(default="", repr=False)


def host_port(text: str) -> tuple[str, int] | None:
    """Return host and port of ``HOST:PORT``, an address of IPv6 in brackets; None: it is none.

    >>> host_port("boat.local:80"), host_port("[::1]:80"), host_port("::1:80"), host_port("boat:99999")
    (('boat.local', 80), ('::1', 80), None, None)
    """
    match = re.fullmatch(r"(?:\[([\w:.%]+)\]|([^:\s/\[\]]+)):([0-9]{1,5})", text)
    if match is None or not 0 < int(match[3]) < 65536:
        return None
    return match[1] or match[2], int(match[3])


def is_baud(text: str) -> bool:
    """Return whether a text is the rate of a serial port [baud].

    >>> is_baud("57600"), is_baud("576x"), is_baud("57")
    (True, False, False)
    """
    return text.isascii() and text.isdigit() and 1200 <= int(text) <= 12_000_000


def parse_nmea(text: str) -> OutputName:
    """Return the name of an output of sentences.

    >>> parse_nmea("tcp:10110").host, parse_nmea("udp:255.255.255.255:10110").port, parse_nmea("tcp:[::]:10110").host
    ('127.0.0.1', 10110, '::')

    Raises:
        InputError: it is none.
    """
    kind, _, rest = text.partition(":")
    found = host_port(rest) or (host_port(f"{LOOPBACK}:{rest}") if kind == "tcp" else None)
    if found is None or kind not in {"udp", "tcp"}:
        raise InputError("--nmea", text, "is no place to send NMEA 0183 to", _NMEA)
    return OutputName(text=text, kind=kind, host=found[0], port=found[1])


def parse_signalk(text: str) -> OutputName:
    """Return the name of a Signal K server.

    >>> parse_signalk("ws://boat:3000").url
    'ws://boat:3000/signalk/v1/stream?subscribe=none'

    Raises:
        InputError: it is none.
    """
    found = host_port(text.removeprefix("tcp:")) if text.startswith("tcp:") else None
    if found is not None:
        return OutputName(text=text, kind="tcp", host=found[0], port=found[1])
    try:
        parts = urlsplit(text)
        host, port = parts.hostname, parts.port
    except ValueError:
        host, port = None, None
    if not host or parts.scheme not in {"ws", "wss"} or parts.username or parts.query or parts.fragment or " " in text:
        raise InputError("--signalk", text, "is no Signal K server", _SIGNALK)
    port = port or (443 if parts.scheme == "wss" else 80)
    path = parts.path if parts.path not in {"", "/"} else STREAM
    return OutputName(
        text=text, kind=parts.scheme, host=host, port=port, url=f"{parts.scheme}://{parts.netloc}{path}?subscribe=none"
    )
