"""The other vessels of a live run: sailed by the runner, told to the companion over a UDP feed, judged by hulls.

AIS goes as a receiver gives it, NMEA sentences with a class A position report; an event's radio goes as JSON. The
companion hears them on ``companion run --feed``. The times of ships count from the scenario's start, as everywhere.
"""

from __future__ import annotations

import asyncio
import math
from typing import Any

from pyais import encode_dict

from companion.clock import now_s
from companion.errors import LinkError
from companion.geo.frame import LocalFrame
from sitl.autopilot import Vessel
from sitl.boats import Boat
from sitl.runner import OUR_LENGTH_M
from sitl.scenario import EventSpec
from sitl.ships import (
    FIRST_MMSI,
    Moving,
    SecondBoat,
    ais_report,
    distance_m,
    free_port,
    intruder_of,
    radio_report,
    send_datagram,
    ship_of,
)
from sitl.verdict import Truth
from sitl.wind import Wind

TRAFFIC = frozenset({"vessel", "intruder", "second_boat"})
_MPS_PER_KNOT = 1852.0 / 3600.0


def sentences(vessel: Vessel) -> bytes:
    """Return a class A position report as NMEA lines (ITU-R M.1371 message 1).

    Speed is rounded to 0.1 kn, course to 0.1 deg, position to 1e-4 minutes (0.2 m), as there.
    """
    said: dict[str, Any] = {
        "msg_type": 1, "mmsi": vessel.mmsi, "lat": vessel.position.lat_deg, "lon": vessel.position.lon_deg,
        "status": vessel.nav_status,
    }
    if vessel.cog_deg is not None:
        said["course"] = vessel.cog_deg
    if vessel.sog_mps is not None:
        said["speed"] = vessel.sog_mps / _MPS_PER_KNOT
    if vessel.heading_deg is not None:
        said["heading"] = round(vessel.heading_deg) % 360
    return "".join(f"{line}\r\n" for line in encode_dict(said, talker_id="AI", sentence_type="VDM")).encode()


class LiveTraffic:
    """The vessels, and the port that the companion hears them on."""

    def __init__(self, frame: LocalFrame, wind: Wind, seed: int) -> None:
        self.frame, self._wind, self._seed = frame, wind, seed
        self._port = free_port()
        self._vessels: list[Moving] = []
        self._second: SecondBoat | None = None

    @property
    def feed(self) -> str:
        """The name of the feed."""
        return f"udpin:127.0.0.1:{self._port}"

    def note(self, truth: Truth, here_en_m: tuple[float, float], t_s: float) -> None:
        """Put the least distances so far into ``truth``; ``t_s`` is the scenario's time."""
        for vessel in self._vessels:
            name = str(vessel.mmsi)
            nearest = min(truth.vessels_m.get(name, math.inf), distance_m(vessel, here_en_m, t_s))
            truth.vessels_m[name] = round(nearest, 2)
        if self._second is not None:
            truth.second_boat_m = self._second.nearest_goal_m

    async def play(self, event: EventSpec, began_s: float, boat: Boat) -> None:
        """Sail the vessel of ``event`` until cancelled, and tell of it every ``every_s``.

        Raises:
            LinkError: it starts from where our boat is, and that is not known.
        """
        number = len(self._vessels)
        if event.kind == "vessel":
            ship = ship_of(event, number)
            self._vessels.append(ship)
            while event.is_on_ais:
                self._send(sentences(ais_report(ship, self.frame, now_s() - began_s)))
                await asyncio.sleep(event.every_s)
        elif event.kind == "intruder":
            intruder = intruder_of(event, number, now_s() - began_s, *self._ours(boat))
            self._vessels.append(intruder)
            while True:
                self._send(radio_report(intruder, self.frame, now_s() - began_s))
                await asyncio.sleep(event.every_s)
        else:
            await self._sail_second(event, number, began_s, boat)

    async def _sail_second(self, event: EventSpec, number: int, began_s: float, boat: Boat) -> None:
        second = SecondBoat(
            FIRST_MMSI + number, self._wind, self._seed, now_s() - began_s, (event.east_m, event.north_m),
            (event.goal_east_m, event.goal_north_m))
        self._vessels.append(second)
        self._second = second
        told_s = -math.inf
        next_s = now_s()
        while True:
            if now_s() - told_s >= event.every_s:
                told_s = now_s()
                self._send(radio_report(second, self.frame, told_s - began_s))
            next_s += 1.0   # the model sails a second a call: a late timer is caught up with
            await asyncio.sleep(max(0.0, next_s - now_s()))
            second.sail(self._ours(boat)[0], OUR_LENGTH_M)

    def _ours(self, boat: Boat) -> tuple[tuple[tuple[float, float], tuple[float, float]], float]:
        fix = boat.fix()
        if fix is None:
            raise LinkError("where our boat is was not told yet")
        return (self.frame.en_from_geo(fix.position), fix.velocity_en_mps), fix.heading_rad

    def _send(self, data: bytes) -> None:
        send_datagram(data, self._port)
