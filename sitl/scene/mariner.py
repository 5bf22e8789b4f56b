"""A vessel with somebody on watch: she meets our boat, and keeps the rules of the road, or keeps her course whatever.

She is placed so that, both going on, the vessels are ``miss_m`` apart after ``meet_s``. One who keeps the rules gives
way where it is for her to do so: when as little as ``react_s`` is left she turns by 50 degrees to the side on which she
passes our stern, by more while that is not enough, and comes back to her course when we are past. Under sail she does
not turn nearer to the wind than she can sail.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from sitl.scene.road import Craft, Mover, closest, duty

Manner = Literal["rules", "keeps"]
TURN_DEG, MORE_DEG, MOST_DEG = 50.0, 20.0, 110.0
MORE_AFTER_S = 15.0
CLOSE_HAULED_DEG = 50.0
NIMBLE_M = 40.0              # shorter than this she turns fast
RATES_DEG_S = (6.0, 2.5)
ROOM_M = 90.0                # between the middles, beyond half her length: what she wants between us


@dataclass(slots=True)
class Mariner:
    """Her state; ``watch`` moves her on by a second."""

    mmsi: int
    length_m: float
    craft: Craft
    manner: Manner
    react_s: float
    base_rad: float          # the course that she is on her way by
    speed_mps: float
    en_m: tuple[float, float]
    t_s: float
    name: str = ""
    course_rad: float = 0.0
    turn_deg: float = 0.0    # how far off her course she has decided to go
    turned_s: float = -math.inf
    gives_way: bool | None = None   # by what the rules gave when it began

    def __post_init__(self) -> None:
        self.course_rad = self.base_rad

    def at(self, t_s: float) -> tuple[float, float]:
        """Return her middle at ``t_s``, a second or so from the last look."""
        run = self.speed_mps * (t_s - self.t_s)
        return self.en_m[0] + run * math.sin(self.course_rad), self.en_m[1] + run * math.cos(self.course_rad)

    def way(self, t_s: float) -> tuple[float, float, float]:  # noqa: ARG002 - she turns from look to look
        """Return course, heading and speed."""
        return self.course_rad, self.course_rad, self.speed_mps

    def mover(self, course_rad: float | None = None) -> Mover:
        """Return her as the rules see her, on her course or on another."""
        course = self.course_rad if course_rad is None else course_rad
        return Mover(en_m=self.en_m, course_rad=course, heading_rad=course, speed_mps=self.speed_mps, craft=self.craft)

    def watch(self, ours: Mover, twd_from_rad: float, t_s: float) -> None:
        """Go on to ``t_s`` and look round."""
        self.en_m, step_s, self.t_s = self.at(t_s), t_s - self.t_s, t_s
        if self.gives_way is None:
            self.gives_way = duty(ours, self.mover(), twd_from_rad)[1] != "first"
        if self.manner == "rules" and self.gives_way:
            self._give_way(ours, math.degrees(twd_from_rad))
        rate = math.radians(RATES_DEG_S[self.length_m > NIMBLE_M]) * step_s
        off = math.remainder(self.base_rad + math.radians(self.turn_deg) - self.course_rad, 2.0 * math.pi)
        self.course_rad += max(-rate, min(rate, off))

    def _give_way(self, ours: Mover, twd_deg: float) -> None:
        room_m = ROOM_M + 0.5 * self.length_m
        if self.turn_deg:
            away_m, ahead_s = closest(ours, self.mover(self.base_rad))
            if ahead_s == 0.0 or away_m > 1.5 * room_m:
                self.turn_deg = 0.0
                return
        away_m, ahead_s = closest(ours, self.mover(self.base_rad + math.radians(self.turn_deg)))
        if ahead_s == 0.0 or ahead_s > self.react_s or away_m >= room_m or self.t_s - self.turned_s < MORE_AFTER_S:
            return
        size = min(abs(self.turn_deg) + (MORE_DEG if self.turn_deg else TURN_DEG), MOST_DEG)
        sides = (1.0, -1.0) if not self.turn_deg else (math.copysign(1.0, self.turn_deg),)
        able = [s * size for s in sides if self._can(s * size, twd_deg)] or [
            s * size for s in (1.0, -1.0) if self._can(s * size, twd_deg)]
        if able:
            # The better side by what is gained; to starboard where both do.
            self.turn_deg = max(able, key=lambda d: (round(min(room_m, closest(
                ours, self.mover(self.base_rad + math.radians(d)))[0]), -1), d))
            self.turned_s = self.t_s

    def _can(self, turn_deg: float, twd_deg: float) -> bool:
        if self.craft != "sail":
            return True
        return abs(math.remainder(math.degrees(self.base_rad) + turn_deg - twd_deg, 360.0)) >= CLOSE_HAULED_DEG


@dataclass(slots=True)
class Receiver:
    """What AIS makes of her: errors of her receiver and log, drawn from a seed."""

    rng: np.random.Generator
    fix_sd_m: float = 3.0
    drift: complex = 0j      # of the fix: it wanders, it does not jump

    def fix_error_m(self) -> complex:
        """Return the error of the next fix, east and north [m]."""
        keep = 0.9
        noise = self.rng.normal(size=2) * self.fix_sd_m * math.sqrt(1.0 - keep * keep)
        self.drift = keep * self.drift + complex(*noise)
        return self.drift

    def speed_error_mps(self) -> float:
        """Return the error of the next speed."""
        return float(self.rng.normal(0.0, 0.1))

    def course_error_rad(self, speed_mps: float) -> float:
        """Return the error of the next course: a slow vessel's is worse."""
        return math.radians(float(self.rng.normal(0.0, 1.0 + 2.0 / max(speed_mps, 0.5))))


def met_by(ours: tuple[tuple[float, float], tuple[float, float]], course_deg: float, sog_mps: float, meet_s: float,
           miss_m: float) -> tuple[tuple[float, float], float]:
    """Return where a vessel is, and her course [rad], who will meet ours after ``meet_s``.

    Args:
        ours: position and velocity, east and north [m, m/s].
        course_deg: hers, clockwise from ours.
        sog_mps: hers.
        meet_s: until the closest approach, both going on.
        miss_m: between the middles then; positive: she is ahead of our bow, or to starboard where courses are alike.

    """
    (east, north), (ve, vn) = ours
    course = math.atan2(ve, vn) + math.radians(course_deg)
    hers = complex(sog_mps * math.sin(course), sog_mps * math.cos(course))
    relative = hers - complex(ve, vn)
    bow = complex(ve, vn) / max(1e-9, math.hypot(ve, vn))
    beside = relative / max(1e-9, abs(relative)) * 1j
    towards = (beside * bow.conjugate()).real if abs(math.sin(math.radians(course_deg))) > 0.2 else (
        beside * (bow * -1j).conjugate()).real
    there = complex(east, north) + complex(ve, vn) * meet_s + beside * math.copysign(miss_m, towards * miss_m)
    start = there - hers * meet_s
    return (start.real, start.imag), course
