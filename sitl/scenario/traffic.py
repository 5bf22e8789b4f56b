"""Other vessels of a run: sailed as the scenario says, perhaps with somebody on watch, and told to the companion.

AIS goes to the autopilot where it takes it, else to the UDP feed as a receiver gives it, NMEA sentences with a class A
position report; an event's radio goes to the feed as JSON. The times of ships count from the scenario's start.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import math
import secrets
import socket
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np
from pyais import encode_dict

from companion.clock import now_s
from companion.field.guidance import go_to, step
from companion.field.values import GuidanceState, MovingObstacle
from companion.geo import MPS_PER_KNOT
from companion.geo.frame import LocalFrame
from sitl.autopilot import AisVessel
from sitl.scenario.colregs import SHIP_TYPE, STATUS, Mariner, Met, Mover, Receiver, met_by
from sitl.scenario.scenario import EventSpec
from sitl.scenario.true_track import TrueTrack
from sitl.world import LENGTH_M as VAIMOS_M
from sitl.world import SimulatedVaimos, WindModel, habits_for

# The size that the companion assumes of a class A vessel: the autopilot passes no sizes on.
SHIP_M = 100.0
BEAM_SHARE = 0.16
BOAT_BEAM_SHARE = 0.35
BOAT_M = 12.0  # up to here the beam is a boat's
FIRST_MMSI = 211_000_001
PORTS = range(20_000, 32_000)
KEEP_M = 15.0  # what the second boat's field keeps between hulls
REPULSIVE_M = 30.0  # its Gaussian beyond that: Schmitt's 100 m would send the boat round by 200 m

Motion = tuple[tuple[float, float], tuple[float, float]]
"""Position and velocity, east and north [m, m/s]."""


class Moving(Protocol):
    """A vessel of a scenario; a rectangle about its middle, where its antenna is."""

    @property
    def mmsi(self) -> int:
        """Its number."""
        ...

    @property
    def length_m(self) -> float:
        """Its length [m]."""
        ...

    def at(self, t_s: float) -> tuple[float, float]:
        """Return its middle at ``t_s``, east and north [m]."""
        ...

    def way(self, t_s: float) -> tuple[float, float, float]:
        """Return its course, heading [rad] and speed [m/s] at ``t_s``."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class ScriptedShip:
    """A ship that is at ``en_m`` at ``from_s`` and keeps its course and speed."""

    mmsi: int
    from_s: float
    en_m: tuple[float, float]
    course_rad: float
    speed_mps: float
    length_m: float = SHIP_M

    def at(self, t_s: float) -> tuple[float, float]:
        """Return its middle at ``t_s``, east and north [m]."""
        run = self.speed_mps * (t_s - self.from_s)
        return self.en_m[0] + run * math.sin(self.course_rad), self.en_m[1] + run * math.cos(self.course_rad)

    def way(self, t_s: float) -> tuple[float, float, float]:  # noqa: ARG002 - the same at all times
        """Return course, heading and speed."""
        return self.course_rad, self.course_rad, self.speed_mps


class SecondBoat:
    """VAIMOS's model in the scenario's wind, on its way to ``goal_en`` by field; our boat is its obstacle."""

    length_m = VAIMOS_M

    def __init__(
        self, mmsi: int, wind: WindModel, seed: int, t_s: float, en_m: tuple[float, float], goal_en: tuple[float, float]
    ) -> None:
        self.mmsi, self.goal_en = mmsi, goal_en
        rng = np.random.default_rng((7, seed, mmsi))
        course = math.atan2(goal_en[0] - en_m[0], goal_en[1] - en_m[1])
        self._boat = SimulatedVaimos.launch(wind, rng, en_m, course)
        self._boat.t_s = t_s
        self._state = GuidanceState()
        self.nearest_goal_m = math.dist(en_m, goal_en)

    def at(self, t_s: float) -> tuple[float, float]:  # noqa: ARG002 - it is where it has sailed to
        """Return its middle."""
        return self._boat.en_m

    def way(self, t_s: float) -> tuple[float, float, float]:  # noqa: ARG002
        """Return course, heading and speed."""
        east, north = self._boat.velocity_en_mps
        return math.atan2(east, north), float(self._boat.state[2]), math.hypot(east, north)

    def sail(self, ours: Motion, our_length_m: float) -> None:
        """Steer and sail for a second, with our boat where it says to be."""
        keep_m = KEEP_M + 0.5 * (our_length_m + self.length_m)
        seen = self._boat.sense((MovingObstacle(en_m=ours[0], velocity_en_mps=ours[1], keep_m=keep_m, growth_mps=0.3),))
        self._state, setpoint = step(
            self._state,
            seen,
            go_to(self.goal_en, seen.twd_from_rad or 0.0),
            habits_for(seen.tws_mps, repulsive_sigma_m=REPULSIVE_M),
        )
        self._boat.sail(setpoint.heading_rad, setpoint.thrust)
        self.nearest_goal_m = min(self.nearest_goal_m, math.dist(self._boat.en_m, self.goal_en))


def beam_m(vessel: Moving) -> float:
    """Return a vessel's beam [m]."""
    return vessel.length_m * (BOAT_BEAM_SHARE if vessel.length_m <= BOAT_M else BEAM_SHARE)


def distance_m(vessel: Moving, en_m: tuple[float, float], t_s: float) -> float:
    """Return how far ``en_m`` is from a vessel's hull, a rectangle, at ``t_s`` [m]; 0 inside."""
    x, y = vessel.at(t_s)
    heading = vessel.way(t_s)[1]
    de, dn = en_m[0] - x, en_m[1] - y
    s, c = math.sin(heading), math.cos(heading)
    along, across = abs(de * s + dn * c), abs(de * c - dn * s)
    return math.hypot(max(0.0, along - 0.5 * vessel.length_m), max(0.0, across - 0.5 * beam_m(vessel)))


def ais_report(vessel: Moving, frame: LocalFrame, t_s: float) -> AisVessel:
    """Return a vessel's AIS position report."""
    course, heading, speed = vessel.way(t_s)
    return AisVessel(
        mmsi=vessel.mmsi,
        position=frame.geo_from_en(*vessel.at(t_s)),
        cog_deg=math.degrees(course) % 360.0,
        sog_mps=speed,
        heading_deg=math.degrees(heading) % 360.0,
        nav_status=0,
    )


def radio_report(vessel: Moving, frame: LocalFrame, t_s: float) -> bytes:
    """Return what an event's radio says of a vessel (WRSC 2013), in the form of ``companion.traffic.decode_json``."""
    place, (course, heading, speed) = frame.geo_from_en(*vessel.at(t_s)), vessel.way(t_s)
    said: dict[str, Any] = {
        "id": vessel.mmsi,
        "lat": place.lat_deg,
        "lon": place.lon_deg,
        "course_deg": math.degrees(course) % 360.0,
        "heading_deg": math.degrees(heading) % 360.0,
        "speed_mps": speed,
        "length_m": vessel.length_m,
        "beam_m": beam_m(vessel),
    }
    return json.dumps(said).encode()


def send_datagram(data: bytes, port: int) -> None:
    """Send a datagram to a port of this machine."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        sender.sendto(data, ("127.0.0.1", port))


def free_port() -> int:
    """Return a port of this machine that nobody has, of UDP and of TCP.

    Not one of those that the system gives to whoever connects (32768 and above, as Linux has it): it would be given
    away before its user listens there.
    """
    while True:
        port = PORTS[secrets.randbelow(len(PORTS))]
        with (
            contextlib.suppress(OSError),
            socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as udp,
            socket.socket() as tcp,
        ):
            udp.bind(("127.0.0.1", port))
            tcp.bind(("127.0.0.1", port))
            return port


def ship_of(event: EventSpec, number: int) -> ScriptedShip:
    """Return the ship of a "vessel" event; ``number`` tells several apart."""
    return ScriptedShip(
        mmsi=FIRST_MMSI + number,
        from_s=event.at_s,
        en_m=(event.east_m, event.north_m),
        course_rad=math.radians(event.course_deg),
        speed_mps=event.sog_mps,
        length_m=event.length_m or SHIP_M,
    )


def intruder_of(event: EventSpec, number: int, t_s: float, ours: Motion, heading_rad: float) -> ScriptedShip:
    """Return a boat that appears ``gap_m`` from ours (hull to middle) and will be where ours will be."""
    length = event.length_m or VAIMOS_M
    bearing = heading_rad + math.radians(event.bearing_deg)
    gap = event.gap_m + 0.5 * length
    here, velocity = ours
    place = here[0] + gap * math.sin(bearing), here[1] + gap * math.cos(bearing)
    meet_s, aim = 0.0, here
    for _ in range(50):  # the time of meeting: a contraction while it is the faster of the two
        meet_s = math.dist(place, aim) / event.sog_mps
        aim = here[0] + velocity[0] * meet_s, here[1] + velocity[1] * meet_s
    return ScriptedShip(
        mmsi=FIRST_MMSI + number,
        from_s=t_s,
        en_m=place,
        speed_mps=event.sog_mps,
        length_m=length,
        course_rad=math.atan2(aim[0] - place[0], aim[1] - place[1]),
    )


TRAFFIC = frozenset({"vessel", "intruder", "second_boat", "meeting"})
OUR_LENGTH_M = 2.0  # what the second boat takes ours for


def sentences(vessel: AisVessel) -> bytes:
    """Return a class A position report as NMEA lines (ITU-R M.1371 message 1).

    Speed is rounded to 0.1 kn, course to 0.1 deg, position to 1e-4 minutes (0.2 m), as there.
    """
    said: dict[str, Any] = {
        "msg_type": 1,
        "mmsi": vessel.mmsi,
        "lat": vessel.position.lat_deg,
        "lon": vessel.position.lon_deg,
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
        "msg_type": 5,
        "mmsi": mariner.mmsi,
        "shipname": mariner.name,
        "ship_type": SHIP_TYPE[mariner.craft],
        "to_bow": half,
        "to_stern": half,
        "to_port": side,
        "to_starboard": side,
    }
    return "".join(f"{line}\r\n" for line in encode_dict(said, talker_id="AI", sentence_type="VDM")).encode()


class Others:
    """The vessels of one run."""

    def __init__(
        self,
        frame: LocalFrame,
        wind: WindModel,
        seed: int,
        *,
        port: int,
        hear: Callable[[AisVessel], None] | None = None,
    ) -> None:
        """Tell of them at the UDP ``port`` of this machine (0: by nothing), AIS to ``hear`` if that is given."""
        self._frame, self._wind, self._seed = frame, wind, seed
        self._port, self._hear = port, hear or self._receive
        self._vessels: list[Moving] = []  # that are there
        self._count = 0  # of all that were
        self._second: SecondBoat | None = None

    def note(self, truth: TrueTrack, here_en_m: tuple[float, float], t_s: float) -> None:
        """Put the least distances so far into ``truth``; ``t_s`` is the scenario's time."""
        for vessel in self._vessels:
            name = str(vessel.mmsi)
            nearest = min(truth.vessels_m.get(name, math.inf), distance_m(vessel, here_en_m, t_s))
            truth.vessels_m[name] = round(nearest, 2)
            if isinstance(vessel, Mariner):
                met = truth.met.setdefault(
                    name,
                    Met(
                        craft=vessel.craft,
                        manner=vessel.manner,
                        length_m=vessel.length_m,
                        beam_m=beam_m(vessel),
                        heard_s=truth.t_s[-1],
                    ),
                )
                course, _, speed = vessel.way(t_s)
                met.t_s.append(truth.t_s[-1])
                met.en_m.append(vessel.at(t_s))
                met.course_rad.append(course)
                met.speed_mps.append(speed)
        if self._second is not None:
            truth.second_boat_m = self._second.nearest_goal_m

    def nearest_m(self, here_en_m: tuple[float, float], t_s: float) -> float:
        """Return how far the nearest of them is [m]; inf where there is none."""
        return min((distance_m(vessel, here_en_m, t_s) for vessel in self._vessels), default=math.inf)

    async def play(self, event: EventSpec, began_s: float, ours: Callable[[], tuple[Motion, float]]) -> None:
        """Sail the vessel of ``event`` until cancelled or for ``for_s``, and tell of it every ``every_s``.

        Args:
            event: one of ``TRAFFIC``, whose time has come.
            began_s: when the scenario began, of the loop's clock [s].
            ours: where our boat is, how it moves, and its heading [rad].
        """
        number, self._count = self._count, self._count + 1
        try:
            async with asyncio.timeout(event.for_s):
                await self._play(event, number, began_s, ours)
        except TimeoutError:  # out of sight
            self._vessels = [vessel for vessel in self._vessels if vessel.mmsi != FIRST_MMSI + number]

    async def _play(
        self, event: EventSpec, number: int, began_s: float, ours: Callable[[], tuple[Motion, float]]
    ) -> None:
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
                FIRST_MMSI + number,
                self._wind,
                self._seed,
                now_s() - began_s,
                (event.east_m, event.north_m),
                (event.goal_east_m, event.goal_north_m),
            )
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
            next_s += 1.0  # the model sails a second a call: a late timer is caught up with
            await asyncio.sleep(max(0.0, next_s - now_s()))
            second.sail(ours()[0], OUR_LENGTH_M)

    async def _meet(
        self, event: EventSpec, number: int, began_s: float, ours: Callable[[], tuple[Motion, float]]
    ) -> None:
        """Let a vessel come whose watch sees us, and tell of it by AIS with the errors of its instruments."""
        motion, _ = ours()
        place, course = met_by(motion, event.course_deg, event.sog_mps, event.meet_s, event.miss_m)
        mariner = Mariner(
            mmsi=FIRST_MMSI + number,
            length_m=event.length_m or SHIP_M,
            craft=event.craft,
            manner=event.manner,
            react_s=event.react_s or event.meet_s,
            base_rad=course,
            speed_mps=event.sog_mps,
            en_m=place,
            t_s=now_s() - began_s,
            name=f"M{number}",
        )
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
            us = Mover(
                en_m=motion[0],
                course_rad=math.atan2(*motion[1]),
                heading_rad=heading,
                speed_mps=math.hypot(*motion[1]),
                craft="sail",
            )
            t_s = now_s() - began_s
            mariner.watch(us, self._wind.at(max(0.0, t_s))[0], t_s)

    def _report(self, mariner: Mariner, errors: Receiver, event: EventSpec, t_s: float, *, is_first: bool) -> None:
        true = ais_report(mariner, self._frame, t_s)
        fix = errors.fix_error_m()
        east, north = mariner.at(t_s)
        course = mariner.course_rad + errors.course_error_rad(mariner.speed_mps)
        heard = replace(
            true,
            position=self._frame.geo_from_en(east + fix.real, north + fix.imag),
            cog_deg=math.degrees(course) % 360.0,
            sog_mps=max(0.0, mariner.speed_mps + errors.speed_error_mps()),
            nav_status=STATUS[mariner.craft],
        )
        if event.receiver == "autopilot":
            self._hear(heard)
        elif self._port:
            self._receive(heard)
            if is_first:
                send_datagram(described(mariner), self._port)

    def _tell(self, vessel: Moving, t_s: float) -> None:
        send_datagram(radio_report(vessel, self._frame, t_s), self._port)

    def _receive(self, vessel: AisVessel) -> None:
        send_datagram(sentences(vessel), self._port)
