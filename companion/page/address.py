"""Where the page is served, who may ask for it, and the token of who may give orders."""

from __future__ import annotations

import ipaddress
import re
import secrets
import socket
from dataclasses import dataclass, field
from pathlib import Path

from companion.disk import Disk, read_regular
from companion.errors import InputError, unreadable
from companion.secret import read_secret

LEAST_TOKEN = 22      # characters: 128 bits in base64
MOST_EMPTY = 65_536   # bytes of nothing that are looked through


@dataclass(frozen=True, slots=True, kw_only=True)
class Address:
    """Host and port to listen on; ``names`` are further names under which the page may be asked for."""

    host: str
    port: int
    names: tuple[str, ...] = ()
    token: str = field(default="", repr=False)   # of who may give orders; empty: nobody

    @property
    def url(self) -> str:
        """What to type into a browser.

        >>> Address(host="::1", port=80).url
        'http://[::1]:80/'
        """
        host = socket.gethostname() if self.host in {"", "0.0.0.0", "::"} else self.host  # noqa: S104
        return f"http://{f'[{host}]' if ':' in host else host}:{self.port}/"


def is_known(host: str, address: Address) -> bool:
    """Return whether the Host of a request is one of ours: else a page of somebody has bent a name of his to us.

    An address is no name, and cannot be bent; the machine's own name, alone and under .local, is known too.
    """
    name, port = _split(host)
    if port != address.port:
        return False
    own = socket.gethostname().lower()
    names = {"localhost", own, f"{own.partition('.')[0]}.local", address.host.lower(), *address.names}
    return name in names or _is_ip(name)


def is_own(origin: str, host: str) -> bool:
    """Return whether an Origin is that of our own page, asked for as ``host``."""
    return origin.lower() == f"http://{host.lower()}"


def read_token(path: Path) -> str:
    """Return the token in a file, which is made, with mode 0600, where there is none.

    So is that of a file with nothing in it: a power cut left it, and nobody was given it.

    Raises:
        InputError: it cannot be read or made, others can read it, or what is in it is too short to be one.
    """
    remedy = "name a file in a folder that is there"
    try:
        if not path.exists() or not read_regular(path, MOST_EMPTY).strip(b"\0 \t\r\n"):
            Disk().replace(path, f"{secrets.token_urlsafe(24)}\n".encode(), mode=0o600)
    except OSError as error:
        raise unreadable(str(path), error, "the token", remedy) from error
    text = read_secret(path, "the token", remedy)
    if len(text) < LEAST_TOKEN or not text.isascii() or not text.isprintable() or " " in text:
        raise InputError(str(path), "", f"is no token: it needs {LEAST_TOKEN} characters or more, in one word",
                         "remove it, and a new one is made")
    return text


def _split(host: str) -> tuple[str, int]:
    """Return name and port of a Host header; port 0: it is none."""
    match = re.fullmatch(r"(\[[0-9A-Fa-f:.]+\]|[A-Za-z0-9.-]+)(?::([0-9]{1,5}))?", host)
    if match is None:
        return "", 0
    return match[1].strip("[]").lower(), int(match[2] or 80)


def _is_ip(text: str) -> bool:
    try:
        ipaddress.ip_address(text)
    except ValueError:
        return False
    return True
