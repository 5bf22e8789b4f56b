"""The other vessels of a run: sailed as its scenario says, told to the companion, judged by hulls.

AIS goes to the autopilot where it takes it, else to the UDP feed as a receiver gives it, NMEA sentences with a class A
position report; an event's radio goes to the feed as JSON. The times of ships count from the scenario's start.
"""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from pyais import encode_dict

from companion.clock import now_s
from companion.geo import MPS_PER_KNOT
from companion.geo.frame import LocalFrame
from sitl.autopilot import Vessel
from sitl.scene.encounter import Met
from sitl.scene.mariner import Mariner, Receiver, met_by
from sitl.scene.road import SHIP_TYPE, STATUS, Mover
from sitl.scene.scenario import EventSpec
from sitl.scene.ships import (
    FIRST_MMSI,
    SHIP_M,
    Motion,
    Moving,
    SecondBoat,
    ais_report,
    beam_m,
    distance_m,
    intruder_of,
    radio_report,
    send_datagram,
    ship_of,
)
from sitl.scene.verdict import Truth
from sitl.world import Wind

TRAFFIC = frozenset({"vessel", "intruder", "second_boat", "meeting"})
OUR_LENGTH_M = 2.0    # what the second boat takes ours for


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
        said["speed"] = vessel.sog_mps / MPS_PER_KNOT
    if vessel.heading_deg is not None:
        said["heading"] = round(vessel.heading_deg) % 360
    return "".join(f"{line}\r\n" for line in encode_dict(said, talker_id="AI", sentence_type="VDM")).encode()


def described(mariner: Mariner) -> bytes:
    """Return a class A static report as NMEA lines (message 5): name, kind and size."""
    half, side = round(0.5 * mariner.length_m), max(1, round(0.5 * beam_m(mariner)))
    said: dict[str, Any] = {
        "msg_type": 5, "mmsi": mariner.mmsi, "shipname": mariner.name, "ship_type": SHIP_TYPE[mariner.craft],
        "to_bow": half, "to_stern": half, "to_port": side, "to_starboard": side,
    }
    return "".join(f"{line}\r\n" for line in encode_dict(said, talker_id="AI", sentence_type="VDM")).encode()


class Others:
    """The vessels of one run."""

    def __init__(
        self, frame: LocalFrame, wind: Wind, seed: int, *, port: int, hear: Callable[[Vessel], None] | None = None
    ) -> None:
        """Tell of them at the UDP ``port`` of this machine (0: by nothing), AIS to ``hear`` if that is given."""
        self._frame, self._wind, self._seed = frame, wind, seed
        self._port, self._hear = port, hear or self._receive
        self._vessels: list[Moving] = []
        self._second: SecondBoat | None = None

    def note(self, truth: Truth, here_en_m: tuple[float, float], t_s: float) -> None:
        """Put the least distances so far into ``truth``; ``t_s`` is the scenario's time."""
        for vessel in self._vessels:
            name = str(vessel.mmsi)
            nearest = min(truth.vessels_m.get(name, math.inf), distance_m(vessel, here_en_m, t_s))
            truth.vessels_m[name] = round(nearest, 2)
            if isinstance(vessel, Mariner):
                met = truth.met.setdefault(name, Met(
                    craft=vessel.craft, manner=vessel.manner, length_m=vessel.length_m, beam_m=beam_m(vessel),
                    heard_s=truth.t_s[-1]))
                course, _, speed = vessel.way(t_s)
                met.t_s.append(truth.t_s[-1])
                met.en_m.append(vessel.at(t_s))
                met.course_rad.append(course)
                met.speed_mps.append(speed)
        if self._second is not None:
            truth.second_boat_m = self._second.nearest_goal_m

    async def play(self, event: EventSpec, began_s: float, ours: Callable[[], tuple[Motion, float]]) -> None:
        """Sail the vessel of ``event`` until cancelled, and tell of it every ``every_s``.

        Args:
            event: one of ``TRAFFIC``, whose time has come.
            began_s: when the scenario began, of the loop's clock [s].
            ours: where our boat is, how it moves, and its heading [rad].
        """
        number = len(self._vessels)
        if event.kind == "vessel":
            ship = ship_of(event, number)
            self._vessels.append(ship)
            while event.is_on_ais:
                self._hear(ais_report(ship, self._frame, now_s() - began_s))
                await asyncio.sleep(event.every_s)
        elif event.kind == "intruder":
            intruder = intruder_of(event, number, now_s() - began_s, *ours())
            self._vessels.append(intruder)
            while self._port:
                self._tell(intruder, now_s() - began_s)
                await asyncio.sleep(event.every_s)
        elif event.kind == "meeting":
            await self._meet(event, number, began_s, ours)
        else:
            second = SecondBoat(
                FIRST_MMSI + number, self._wind, self._seed, now_s() - began_s, (event.east_m, event.north_m),
                (event.goal_east_m, event.goal_north_m))
            self._vessels.append(second)
            self._second = second
            await self._sail(second, event.every_s, began_s, ours)

    async def _sail(
        self, second: SecondBoat, every_s: float, began_s: float, ours: Callable[[], tuple[Motion, float]]
    ) -> None:
        told_s = -math.inf
        next_s = now_s()
        while True:
            if self._port and now_s() - told_s >= every_s:
                told_s = now_s()
                self._tell(second, told_s - began_s)
            next_s += 1.0   # the model sails a second a call: a late timer is caught up with
            await asyncio.sleep(max(0.0, next_s - now_s()))
            second.sail(ours()[0], OUR_LENGTH_M)

    async def _meet(
        self, event: EventSpec, number: int, began_s: float, ours: Callable[[], tuple[Motion, float]],
    ) -> None:
        """Let a vessel come whose watch sees us, and tell of her by AIS with the errors of her instruments."""
        motion, _ = ours()
        place, course = met_by(motion, event.course_deg, event.sog_mps, event.meet_s, event.miss_m)
        mariner = Mariner(
            mmsi=FIRST_MMSI + number, length_m=event.length_m or SHIP_M, craft=event.craft, manner=event.manner,
            react_s=event.react_s or event.meet_s, base_rad=course, speed_mps=event.sog_mps, en_m=place,
            t_s=now_s() - began_s, name=f"M{number}")
        self._vessels.append(mariner)
        errors = Receiver(rng=np.random.default_rng((11, self._seed, mariner.mmsi)))
        told_s, next_s = -math.inf, now_s()
        while True:
            t_s = now_s() - began_s
            if event.is_on_ais and t_s - told_s >= event.every_s:
                self._report(mariner, errors, event, t_s, is_first=told_s < 0.0)
                told_s = t_s
            next_s += 1.0
            await asyncio.sleep(max(0.0, next_s - now_s()))
            motion, heading = ours()
            us = Mover(en_m=motion[0], course_rad=math.atan2(*motion[1]), heading_rad=heading,
                       speed_mps=math.hypot(*motion[1]), craft="sail")
            t_s = now_s() - began_s
            mariner.watch(us, self._wind.at(max(0.0, t_s))[0], t_s)

    def _report(self, mariner: Mariner, errors: Receiver, event: EventSpec, t_s: float, *, is_first: bool) -> None:
        true = ais_report(mariner, self._frame, t_s)
        fix = errors.fix_error_m()
        east, north = mariner.at(t_s)
        course = mariner.course_rad + errors.course_error_rad(mariner.speed_mps)
        heard = replace(
            true, position=self._frame.geo_from_en(east + fix.real, north + fix.imag),
            cog_deg=math.degrees(course) % 360.0, sog_mps=max(0.0, mariner.speed_mps + errors.speed_error_mps()),
            nav_status=STATUS[mariner.craft])
        if event.receiver == "autopilot":
            self._hear(heard)
        elif self._port:
            self._receive(heard)
            if is_first:
                send_datagram(described(mariner), self._port)

    def _tell(self, vessel: Moving, t_s: float) -> None:
        send_datagram(radio_report(vessel, self._frame, t_s), self._port)

    def _receive(self, vessel: Vessel) -> None:
        send_datagram(sentences(vessel), self._port)
