"""Looking for an autopilot on the serial ports, and why one of them cannot be used."""

from __future__ import annotations

import grp
import os
import stat
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

from companion.errors import CompanionError, LinkError

# The best name first: those of udev stay when ports are plugged in another order.
NAMES = ("autopilot", "serial/by-id/*", "serial0", "ttyAMA*", "ttyACM*", "ttyUSB*")
BAUDS = (921_600, 115_200, 57_600)
LISTEN_S = 3.0   # a heartbeat a second
WIRE = "wire the autopilot to a serial port (docs/on-the-boat.md), or name another link: --link udpin:0.0.0.0:14550"


@dataclass(frozen=True, slots=True, kw_only=True)
class Port:
    """A serial port by its best name; ``trouble`` says why it cannot be used, empty: it can be tried."""

    path: Path
    trouble: str = ""


def ports(devices: Path = Path("/dev")) -> list[Port]:
    """Return the serial ports, each once."""
    found: dict[Path, Port] = {}
    for name in NAMES:
        for path in sorted(devices.glob(name)):
            found.setdefault(path.resolve(), Port(path=path, trouble=permission(path)))
    return list(found.values())


def permission(path: Path) -> str:
    """Return what keeps this user from a port, with the remedy; empty: nothing does."""
    try:
        status = path.stat()
    except OSError as error:
        return f"{path}: {error.strerror}"
    if not stat.S_ISCHR(status.st_mode):
        return f"{path} is no serial port"
    if os.access(path, os.R_OK | os.W_OK):
        return ""
    try:
        group = grp.getgrgid(status.st_gid).gr_name
    except KeyError:
        group = str(status.st_gid)
    return (f"{path}: no permission: it belongs to the group {group}, and you are not in it; "
            f"sudo adduser $USER {group}, then log in anew")


def find(tried: Iterable[Port], say: Callable[[str], None]) -> tuple[str, int]:
    """Return the LINK where an autopilot is heard, and its system id.

    Raises:
        LinkError: none is, with the reason and the remedy in a line.
    """
    troubles = []
    candidates = list(tried)
    for port in candidates:
        if port.trouble:
            troubles.append(port.trouble)
            continue
        for baud in BAUDS:
            link = f"{port.path}:{baud}"
            say(f"listening on {link}")
            system, trouble = heard(link)
            if system is not None:
                return link, system
            if trouble:
                troubles.append(f"{port.path}: {trouble}; end that, or share the port by mavlink-router")
                break
    if not candidates:
        raise LinkError(f"there is no serial port here; {WIRE}")
    if troubles:
        raise LinkError("; ".join(troubles))
    names = ", ".join(str(port.path) for port in candidates)
    raise LinkError(f"no autopilot is heard on {names}: is it on, are RX and TX crossed, is SERIALn_PROTOCOL 2? "
                    "Or name the link: --link")


def heard(link: str) -> tuple[int | None, str]:
    """Return the system id of the autopilot on a link, None when none is heard, and why the port cannot be opened."""
    from companion.clock import run
    from companion.mavlink.link import Link
    from companion.mavlink.transports import TransportState, open_link
    from companion.mavlink.trust import TOOL_COMPONENT, LinkIdentity

    async def listen() -> tuple[int | None, str]:
        transport = open_link(link)
        async with Link(transport, identity=LinkIdentity(component=TOOL_COMPONENT)) as connected:
            try:
                return (await connected.wait_autopilot(LISTEN_S)).target_system, ""
            except CompanionError as error:
                if transport.state is not TransportState.OPEN:
                    return None, transport.stats.last_error
                return None, "" if "no autopilot in" in str(error) else str(error)

    return run(listen())
