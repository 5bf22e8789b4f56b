"""Values of a command line: numbers in their ranges, places, winds and files to write, each refused in one line.

Each function here, or what it returns, is an argparse ``type``: it takes the text and raises ArgumentTypeError, so that
everything a command is given is believed before it begins to work.
"""

from __future__ import annotations

import argparse
import datetime as dt
import ipaddress
import math
import os
import re
from argparse import ArgumentParser, ArgumentTypeError
from collections.abc import Callable
from pathlib import Path

from companion.addresses import is_baud
from companion.messages import GeoPoint

_HOST = re.compile(r"[A-Za-z0-9]([A-Za-z0-9.-]{0,252}[A-Za-z0-9])?")
# What matplotlib writes without a further program.
PICTURES = (".png", ".svg", ".pdf", ".jpg")


def add_command(
    subparsers: argparse._SubParsersAction[argparse.ArgumentParser], name: str, summary: str, epilog: str
) -> argparse.ArgumentParser:
    """Add a command that its summary describes; the lines of ``epilog`` stay as they are."""
    return subparsers.add_parser(
        name,
        help=summary,
        description=summary[0].upper() + summary[1:] + ".",
        epilog=epilog,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )


def number(
    unit: str = "", *, above: float | None = None, at_least: float | None = None, at_most: float | None = None
) -> Callable[[str], float]:
    """Return the reader of a finite number in a range; ``unit`` is what the refusal calls it."""
    allowed = _range(above, at_least, at_most, unit)

    def read(text: str) -> float:
        try:
            value = float(text)
        except ValueError:
            raise ArgumentTypeError(f"{text[:40]!r} is not a number; {allowed}") from None
        if not (math.isfinite(value) and _is_within(value, above, at_least, at_most)):
            raise ArgumentTypeError(f"{text[:40]} is out of range; {allowed}")
        return value

    return read


def whole(*, at_least: int = 0, at_most: int | None = None) -> Callable[[str], int]:
    """Return the reader of a whole number in a range."""
    allowed = _range(None, at_least, at_most)

    def read(text: str) -> int:
        try:
            value = int(text)
        except ValueError:
            raise ArgumentTypeError(f"{text[:40]!r} is not a whole number; {allowed}") from None
        if not _is_within(value, None, at_least, at_most):
            raise ArgumentTypeError(f"{text[:40]} is out of range; {allowed}")
        return value

    return read


def duration(text: str) -> float:
    """Return the seconds of ``90m``, ``2h`` or ``1d``: at least a minute, at most a week.

    >>> duration("2h"), duration("1.5d")
    (7200.0, 129600.0)
    """
    units = {"m": 60.0, "h": 3600.0, "d": 86_400.0}
    try:
        seconds = float(text[:-1]) * units[text[-1:]]
    except (ValueError, KeyError):
        raise ArgumentTypeError(f"{text[:40]!r} is not a time; write 90m, 2h or 1d") from None
    if not 60.0 <= seconds <= 7 * units["d"]:
        raise ArgumentTypeError(f"{text[:40]} is out of range; from 1m to 7d")
    return seconds


def moment(text: str) -> dt.datetime:
    """Return a time with its zone, in UTC.

    >>> moment("2026-11-24T08:00Z")
    datetime.datetime(2026, 11, 24, 8, 0, tzinfo=datetime.timezone.utc)
    """
    try:
        when = dt.datetime.fromisoformat(text)
    except ValueError:
        raise ArgumentTypeError(f"{text[:40]!r} is no time; write 2026-11-24T08:00Z") from None
    if when.tzinfo is None:
        raise ArgumentTypeError(f"{text} has no zone; write {when.isoformat(timespec='minutes')}Z for UTC")
    return when.astimezone(dt.UTC)


def system_id(text: str) -> int:
    """Take the argument of ``--system``: a MAVLink system id."""
    if not (text.isascii() and text.isdigit() and 1 <= int(text) <= 255):
        raise ArgumentTypeError(f"{text!r} is not a system id from 1 to 255")
    return int(text)


def absent_device(link: str | None) -> str:
    """Return what is said where a LINK names a serial port that is not there; "" for one that is, and for any other.

    It may be plugged in later, and is waited for; a slip in its rate is not, and is refused by who opens it.

    >>> absent_device("COM77:57600"), absent_device("tcp:127.0.0.1:5760")
    ('COM77: no such device; is it plugged in? waiting for it', '')
    """
    named = re.fullmatch(r"(?:serial:)?((?:/|COM\d).*?)(?::(\w*))?", link or "")
    if named is None or Path(named.group(1)).exists():
        return ""
    if named.group(2) is not None and not is_baud(named.group(2)):
        return ""
    return f"{named.group(1)}: no such device; is it plugged in? waiting for it"


def http_address(text: str) -> tuple[str, int]:
    """Return host and port to serve a page at, of ``[HOST:]PORT``; without a host this machine's own.

    >>> http_address("8765"), http_address("[::1]:80"), http_address("0.0.0.0:8765")
    (('127.0.0.1', 8765), ('::1', 80), ('0.0.0.0', 8765))
    """
    host, _, port = text.rpartition(":")
    bare = host[1:-1] if host.startswith("[") and host.endswith("]") else host
    if not (port.isascii() and port.isdigit() and len(port) < 6 and 0 < int(port) < 65536):
        raise ArgumentTypeError(f"{text[:60]!r} has no port from 1 to 65535; write PORT or HOST:PORT")
    is_address = True
    try:
        ipaddress.ip_address(bare)
    except ValueError:
        is_address = False
    if bare and not is_address and ("[" in host or not _HOST.fullmatch(bare)):
        raise ArgumentTypeError(f"{host[:60]!r} is no name or address to listen on; write PORT or HOST:PORT")
    return bare or "127.0.0.1", int(port)


def chart_option(parser: ArgumentParser) -> None:
    """Add the option of what a page shows under its own water."""
    parser.add_argument(
        "--chart",
        type=Path,
        action="append",
        default=[],
        metavar="FILE",
        help="a chart under the page's own water: raster tiles in MBTiles or PMTiles; may be given "
        "more than once, the lowest first",
    )


def host_names_option(parser: ArgumentParser) -> None:
    """Add the option of further names under which a page may be asked for."""
    parser.add_argument(
        "--http-name",
        type=host_name,
        action="append",
        default=[],
        metavar="NAME",
        help="a further name under which this machine's page may be asked for",
    )


def radio_options(parser: ArgumentParser, *, required: bool = True) -> None:
    """Add the link to a boat from ashore, and which autopilot on it is meant."""
    _link_options(parser, "/dev/ttyUSB0:57600", "the only one heard", required=required)


def autopilot_options(parser: ArgumentParser, *, required: bool) -> None:
    """Add the link to the autopilot from on board, and which autopilot on it is meant."""
    _link_options(parser, "/dev/serial0:921600", "the mission's, else the only one heard", required=required)


def _link_options(parser: ArgumentParser, serial: str, usual: str, *, required: bool) -> None:
    parser.add_argument(
        "--link", required=required, metavar="LINK", help=f"{serial}, udpin:HOST:PORT, udpout:HOST:PORT, tcp:HOST:PORT"
    )
    parser.add_argument(
        "--system", type=system_id, metavar="N", help=f"the autopilot's MAVLink system id (default: {usual})"
    )


def host_name(text: str) -> str:
    """Return the name of a machine."""
    if not _HOST.fullmatch(text):
        raise ArgumentTypeError(f"{text[:60]!r} is no host name")
    return text.lower()


def _is_within(value: float, above: float | None, at_least: float | None, at_most: float | None) -> bool:
    return (
        (above is None or value > above)
        and (at_least is None or value >= at_least)
        and (at_most is None or value <= at_most)
    )


def _range(above: float | None, at_least: float | None, at_most: float | None, unit: str = "") -> str:
    low = f"above {above:g}" if above is not None else f"of at least {at_least:g}" if at_least is not None else ""
    high = f"at most {at_most:g}" if at_most is not None else ""
    bounds = " and ".join(part for part in (low, high) if part)
    return f"write a number {bounds}".rstrip() + (f" [{unit}]" if unit else "")


def place(text: str) -> GeoPoint:
    """Return the point of ``LAT,LON``."""
    try:
        lat, lon = (float(part) for part in text.split(","))
        return GeoPoint(lat_deg=lat, lon_deg=lon)
    except ValueError as error:
        problem = str(error) if "outside" in str(error) else f"{text[:40]!r} is not a position"
        if "latitude" in problem:
            problem += ": are lat and lon swapped?"
        raise ArgumentTypeError(f"{problem}; write LAT,LON in degrees, as 50.82,-1.31") from None


def wind(text: str) -> tuple[float, float]:
    """Return (speed [m/s], from [deg]) of ``SPEED@FROM``."""
    try:
        speed, direction = (float(part) for part in text.split("@"))
    except ValueError:
        raise ArgumentTypeError(f"{text[:30]!r} is not a wind, SPEED@FROM, as 5@350") from None
    if not (0.0 < speed <= 50.0 and -360.0 <= direction <= 360.0):
        if 50.0 < speed <= 360.0 and 0.0 < direction <= 50.0:
            raise ArgumentTypeError(
                f"{text[:30]!r} looks swapped: SPEED@FROM is {direction:g}@{speed:g}, m/s and degrees"
            )
        raise ArgumentTypeError(f"{text[:30]!r} is out of range; speed 0..50 m/s, direction in degrees")
    return speed, direction % 360.0


def shifts(text: str) -> tuple[float, float]:
    """Return (standard deviation [deg], how long one lasts [s]) of ``DEG,S``."""
    spread, comma, lasts = text.partition(",")
    if not comma:
        raise ArgumentTypeError(f"{text[:40]!r} is no wind; as 9,28 (degrees, seconds)")
    return number("degrees", at_least=0.0, at_most=90.0)(spread), number("s", above=0.0, at_most=1e5)(lasts)


def out_file(text: str) -> Path:
    """Return a file that can be written as far as can be told beforehand: work is not lost for a slip of the name."""
    path = Path(text)
    folder = path.absolute().parent
    if not text or path.is_dir():
        raise ArgumentTypeError(f"{text or 'an empty name'} is a folder; name a file")
    if not folder.is_dir():
        what = "is not a folder" if folder.exists() else "does not exist"
        raise ArgumentTypeError(f"{text}: {folder} {what}; make the folder first")
    if not os.access(path if path.exists() else folder, os.W_OK):
        raise ArgumentTypeError(f"{text}: cannot be written; name another place or change the permissions")
    return path


def picture(text: str) -> Path:
    """Return a file for a picture, its format told by its name."""
    path = out_file(text)
    if path.suffix.lower() not in PICTURES:
        raise ArgumentTypeError(f"{text}: the name does not tell a picture; end it in one of {', '.join(PICTURES)}")
    return path


def out_folder(text: str) -> Path:
    """Return a folder that is there, or can be made."""
    path = Path(text)
    above = path.absolute()
    while not above.exists():
        above = above.parent
    if not above.is_dir():
        raise ArgumentTypeError(f"{text}: {above.name} is a file; name another folder")
    if not os.access(above, os.W_OK):
        raise ArgumentTypeError(f"{text}: cannot be written; name another place or change the permissions")
    return path
