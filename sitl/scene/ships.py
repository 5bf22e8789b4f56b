"""Other vessels of a scenario: where they are, how far their hulls are off, and what AIS or radio says of them."""

from __future__ import annotations

import contextlib
import json
import math
import secrets
import socket
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from companion.field.guidance import go_to, step
from companion.field.values import GuidanceState, MovingObstacle
from companion.geo.frame import LocalFrame
from sitl.autopilot import Vessel
from sitl.scene.scenario import EventSpec
from sitl.world import LENGTH_M as VAIMOS_M
from sitl.world import Afloat, Wind, habits_for

# The size that the companion assumes of a class A vessel: the autopilot passes no sizes on.
SHIP_M = 100.0
BEAM_SHARE = 0.16
BOAT_BEAM_SHARE = 0.35
BOAT_M = 12.0              # up to here the beam is a boat's
FIRST_MMSI = 211_000_001
PORTS = range(20_000, 32_000)
KEEP_M = 15.0              # what the second boat's field keeps between hulls
REPULSIVE_M = 30.0         # its Gaussian beyond that: Schmitt's 100 m would send her round by 200 m

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
class Ship:
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
        self, mmsi: int, wind: Wind, seed: int, t_s: float, en_m: tuple[float, float], goal_en: tuple[float, float]
    ) -> None:
        self.mmsi, self.goal_en = mmsi, goal_en
        rng = np.random.default_rng((7, seed, mmsi))
        course = math.atan2(goal_en[0] - en_m[0], goal_en[1] - en_m[1])
        self._boat = Afloat.launch(wind, rng, en_m, course)
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
            self._state, seen, go_to(self.goal_en, seen.twd_from_rad or 0.0),
            habits_for(seen.tws_mps, repulsive_sigma_m=REPULSIVE_M))
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


def ais_report(vessel: Moving, frame: LocalFrame, t_s: float) -> Vessel:
    """Return a vessel's AIS position report."""
    course, heading, speed = vessel.way(t_s)
    return Vessel(
        mmsi=vessel.mmsi, position=frame.geo_from_en(*vessel.at(t_s)), cog_deg=math.degrees(course) % 360.0,
        sog_mps=speed, heading_deg=math.degrees(heading) % 360.0, nav_status=0)


def radio_report(vessel: Moving, frame: LocalFrame, t_s: float) -> bytes:
    """Return what an event's radio says of a vessel (WRSC 2013), in the form of ``companion.traffic.decode_json``."""
    place, (course, heading, speed) = frame.geo_from_en(*vessel.at(t_s)), vessel.way(t_s)
    said: dict[str, Any] = {
        "id": vessel.mmsi, "lat": place.lat_deg, "lon": place.lon_deg, "course_deg": math.degrees(course) % 360.0,
        "heading_deg": math.degrees(heading) % 360.0, "speed_mps": speed, "length_m": vessel.length_m,
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
        with (contextlib.suppress(OSError), socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as udp,
              socket.socket() as tcp):
            udp.bind(("127.0.0.1", port))
            tcp.bind(("127.0.0.1", port))
            return port


def ship_of(event: EventSpec, number: int) -> Ship:
    """Return the ship of a "vessel" event; ``number`` tells several apart."""
    return Ship(mmsi=FIRST_MMSI + number, from_s=event.at_s, en_m=(event.east_m, event.north_m),
                course_rad=math.radians(event.course_deg), speed_mps=event.sog_mps,
                length_m=event.length_m or SHIP_M)


def intruder_of(event: EventSpec, number: int, t_s: float, ours: Motion, heading_rad: float) -> Ship:
    """Return a boat that appears ``gap_m`` from ours (hull to middle) and will be where ours will be."""
    length = event.length_m or VAIMOS_M
    bearing = heading_rad + math.radians(event.bearing_deg)
    gap = event.gap_m + 0.5 * length
    here, velocity = ours
    place = here[0] + gap * math.sin(bearing), here[1] + gap * math.cos(bearing)
    meet_s, aim = 0.0, here
    for _ in range(50):   # the time of meeting: a contraction while it is the faster of the two
        meet_s = math.dist(place, aim) / event.sog_mps
        aim = here[0] + velocity[0] * meet_s, here[1] + velocity[1] * meet_s
    return Ship(mmsi=FIRST_MMSI + number, from_s=t_s, en_m=place, speed_mps=event.sog_mps, length_m=length,
                course_rad=math.atan2(aim[0] - place[0], aim[1] - place[1]))

