"""Who keeps out of whose way, by true positions, courses and kinds: COLREGs 12 to 18 for a judge.

Written from the rules and not from the companion's code, which it is to judge: nothing of ``companion.traffic`` is
used. Angles are those that the rules name, seen from each vessel in turn.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

Craft = Literal["power", "sail", "fishing", "restricted", "not under command", "draught"]
Duty = Literal["first", "second", "both"]

# ITU-R M.1371: what a vessel of each kind says of herself.
STATUS: dict[Craft, int] = {
    "power": 0, "sail": 8, "fishing": 7, "restricted": 3, "not under command": 2, "draught": 4}
SHIP_TYPE: dict[Craft, int] = {
    "power": 70, "sail": 36, "fishing": 30, "restricted": 33, "not under command": 70, "draught": 80}
# Rule 18: who is before whom; a vessel constrained by her draught is not to be impeded by sail either.
_RANK: dict[Craft, int] = {
    "power": 0, "sail": 1, "draught": 2, "fishing": 3, "restricted": 4, "not under command": 4}
STERN_SECTOR_DEG = 112.5     # 22.5 degrees abaft the beam
END_ON_DEG = 6.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Mover:
    """A vessel at an instant: middle, course over ground, where the bow points, speed."""

    en_m: tuple[float, float]
    course_rad: float
    heading_rad: float
    speed_mps: float
    craft: Craft

    @property
    def velocity_mps(self) -> complex:
        """East and north [m/s]."""
        return complex(self.speed_mps * math.sin(self.course_rad), self.speed_mps * math.cos(self.course_rad))


def closest(a: Mover, b: Mover) -> tuple[float, float]:
    """Return (distance of middles [m], in how many seconds) at the closest, both going on; 0 s where they part."""
    off, way = complex(*b.en_m) - complex(*a.en_m), b.velocity_mps - a.velocity_mps
    if abs(way) < 1e-9:
        return abs(off), 0.0
    t_s = max(0.0, -(off * way.conjugate()).real / abs(way) ** 2)
    return abs(off + way * t_s), t_s


def bearing_off_bow_deg(a: Mover, b: Mover) -> float:
    """Return where ``b`` is seen from ``a``, from its bow, -180 to 180, positive to starboard."""
    bearing = math.degrees(math.atan2(b.en_m[0] - a.en_m[0], b.en_m[1] - a.en_m[1]))
    return _half_turn(bearing - math.degrees(a.heading_rad))


def duty(a: Mover, b: Mover, twd_from_rad: float) -> tuple[str, Duty]:
    """Return the rule, and who keeps out of the way: the first, the second, or both."""
    if abs(bearing_off_bow_deg(b, a)) > STERN_SECTOR_DEG and _gains_on(a, b):
        return "13", "first"
    if abs(bearing_off_bow_deg(a, b)) > STERN_SECTOR_DEG and _gains_on(b, a):
        return "13", "second"
    if _RANK[a.craft] != _RANK[b.craft]:
        return "18", "first" if _RANK[a.craft] < _RANK[b.craft] else "second"
    if a.craft == "sail":
        return "12", _sails(a, b, math.degrees(twd_from_rad))
    here = bearing_off_bow_deg(a, b)
    opposite = abs(_half_turn(math.degrees(b.heading_rad - a.heading_rad) + 180.0))
    if abs(here) < END_ON_DEG and opposite < 2.0 * END_ON_DEG:
        return "14", "both"
    return "15", "first" if here >= 0.0 else "second"


def _gains_on(a: Mover, b: Mover) -> bool:
    """Whether ``a`` comes up with ``b``: the range closes, and it is ``a`` who closes it along b's course."""
    along = complex(math.sin(b.heading_rad), math.cos(b.heading_rad))
    faster = (a.velocity_mps * along.conjugate()).real > (b.velocity_mps * along.conjugate()).real
    return closest(a, b)[1] > 0.0 and faster


def _sails(a: Mover, b: Mover, twd_deg: float) -> Duty:
    """Rule 12 a: the tack, and on the same tack the place."""
    first, second = (_half_turn(twd_deg - math.degrees(m.heading_rad)) > 0.0 for m in (a, b))
    if first != second:
        return "second" if first else "first"      # with the wind on the starboard side she is on starboard tack
    upwind = complex(math.sin(math.radians(twd_deg)), math.cos(math.radians(twd_deg)))
    higher = ((complex(*a.en_m) - complex(*b.en_m)) * upwind.conjugate()).real
    return "first" if higher >= 0.0 else "second"


def _half_turn(degrees: float) -> float:
    return math.remainder(degrees, 360.0)
