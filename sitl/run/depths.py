"""A simulated sounder that speaks NMEA 0183 to the companion's ``[sounder]`` by UDP, in virtual and in live runs."""

from __future__ import annotations

import asyncio
import contextlib
import socket
from collections.abc import AsyncIterator, Callable

from companion.errors import InputError
from companion.geofence import Mission
from companion.outputs.nmea import sentence
from companion.traffic.soundings import FATHOM_M, FOOT_M
from sitl.scenario import Scenario, free_port
from sitl.world import LEAST_M, MOST_M

SOUNDS_S = 0.5  # between two pings of a sounder


def sounder_port(mission: Mission, scenario: Scenario) -> int:
    """Return a free UDP port for the scenario's sounder to speak to; 0 where it speaks no NMEA.

    Raises InputError: it does, and the mission hears no sounder.
    """
    if scenario.bottom is None or not scenario.bottom.nmea:
        return 0
    if not (mission.options.sounder.feed or "").startswith("udpin:"):
        raise InputError(
            str(mission.path), "[sounder] feed", "hears no sounder by UDP", 'write feed = "udpin:127.0.0.1:PORT"'
        )
    return free_port()


def feed_of(port: int) -> str | None:
    """Return the feed by which a companion hears that port, None of port 0."""
    return f"udpin:127.0.0.1:{port}" if port else None


@contextlib.asynccontextmanager
async def spoken_depths(ping_m: Callable[[], float | None], port: int, below_m: float) -> AsyncIterator[None]:
    """Tell each ping as an NMEA 0183 instrument does, as DPT and as DBT, while the block runs; to port 0 nothing.

    Args:
        ping_m: what the sounder tells now from its transducer down [m], None without an echo.
        port: where the companion listens on this computer.
        below_m: how deep the transducer lies.
    """
    if not port:
        yield
        return
    task = asyncio.create_task(_speak(ping_m, port, below_m), name="sounder")
    try:
        yield
    finally:
        task.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await task


async def _speak(ping_m: Callable[[], float | None], port: int, below_m: float) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
        while True:
            depth_m, dbt = ping_m(), ["", "f", "", "M", "", "F"]
            if depth_m is None or not LEAST_M < depth_m < MOST_M:
                dpt = ["", f"{below_m:.1f}", ""]
            else:
                dpt = [f"{depth_m:.1f}", f"{below_m:.1f}", f"{MOST_M:.1f}"]
                dbt[0::2] = (f"{depth_m / unit_m:.1f}" for unit_m in (FOOT_M, 1.0, FATHOM_M))
            said = sentence("DPT", *dpt) + sentence("DBT", *dbt)
            with contextlib.suppress(OSError):
                out.sendto(said.encode(), ("127.0.0.1", port))
            await asyncio.sleep(SOUNDS_S)
