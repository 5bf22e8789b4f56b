"""Ships on straight courses: where they are, how far their hulls are off, and what AIS says of them."""

from __future__ import annotations

import math
from dataclasses import dataclass

from companion.geo.frame import LocalFrame
from sitl.autopilot import Vessel
from sitl.scenario import EventSpec

# The size that the companion assumes of a class A vessel: the autopilot passes no sizes on.
LENGTH_M, BEAM_M = 100.0, 16.0
FIRST_MMSI = 211_000_001


@dataclass(frozen=True, slots=True, kw_only=True)
class Ship:
    """A ship that is at ``en_m`` at ``from_s`` and keeps its course and speed; the antenna is in its middle."""

    mmsi: int
    from_s: float
    en_m: tuple[float, float]
    course_rad: float
    speed_mps: float

    def at(self, t_s: float) -> tuple[float, float]:
        """Return its middle at ``t_s``, east and north [m]."""
        run = self.speed_mps * (t_s - self.from_s)
        return self.en_m[0] + run * math.sin(self.course_rad), self.en_m[1] + run * math.cos(self.course_rad)

    def distance_m(self, en_m: tuple[float, float], t_s: float) -> float:
        """Return how far ``en_m`` is from its hull, a rectangle, at ``t_s`` [m]; 0 inside."""
        x, y = self.at(t_s)
        de, dn = en_m[0] - x, en_m[1] - y
        s, c = math.sin(self.course_rad), math.cos(self.course_rad)
        along, across = abs(de * s + dn * c), abs(de * c - dn * s)
        return math.hypot(max(0.0, along - 0.5 * LENGTH_M), max(0.0, across - 0.5 * BEAM_M))

    def report(self, frame: LocalFrame, t_s: float) -> Vessel:
        """Return its AIS position report."""
        degrees = math.degrees(self.course_rad) % 360.0
        return Vessel(mmsi=self.mmsi, position=frame.geo_from_en(*self.at(t_s)), cog_deg=degrees,
                      sog_mps=self.speed_mps, heading_deg=degrees, nav_status=0)


def ship_of(event: EventSpec, number: int) -> Ship:
    """Return the ship of a "vessel" event; ``number`` tells several apart."""
    return Ship(mmsi=FIRST_MMSI + number, from_s=event.at_s, en_m=(event.east_m, event.north_m),
                course_rad=math.radians(event.course_deg), speed_mps=event.sog_mps)
