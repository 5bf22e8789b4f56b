"""A current that the boat cannot stem: what it makes of it, and the nearest water in which it can bear that.

Where the current is stronger than what the boat makes against it, it cannot lie at anchor, nor loiter: it is carried,
slowest when it sails against it as well as it can, which is what a loiter up-current makes it do. That is waiting,
and good where the water that it is carried over is clear. Where it is not, it goes first to where it is.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from companion.boat import Boat, made_good_mps, slowest_en_mps
from companion.current import over_water
from companion.skipper.way.drift import drift_ahead
from companion.skipper.way.geometry import bearing_rad, moved
from companion.skipper.way.voyage import AreaLike, PointEn

LEAST_MPS = 0.05  # a way made good that is slower than this is none: it would be lost in a gust
PLACES_M = (40.0, 80.0, 160.0, 320.0, 640.0)
DIRECTIONS = 24


@dataclass(frozen=True, slots=True, kw_only=True)
class Water:
    """Boat, wind over the ground (from, speed) and current [m/s east, north] of a moment; its no-go half angle."""

    boat: Boat
    wind: tuple[float, float]
    current_en_mps: tuple[float, float]
    no_go_half_rad: float

    def made_good_mps(self, course_rad: float) -> float | None:
        """Return what the boat makes good along a course over the ground, None where that is no way to speak of."""
        from_rad, tws_mps = over_water(*self.wind, self.current_en_mps)
        made = made_good_mps(
            self.boat,
            course_rad,
            twd_from_rad=from_rad,
            tws_mps=tws_mps,
            current_en_mps=self.current_en_mps,
            no_go_half_rad=self.no_go_half_rad,
        )
        return made if made is not None and made >= LEAST_MPS else None

    @property
    def carried_en_mps(self) -> tuple[float, float]:
        """How the boat is carried when it sails against it as well as it can; 0, 0: it can hold."""
        from_rad, tws_mps = over_water(*self.wind, self.current_en_mps)
        return slowest_en_mps(
            self.boat,
            twd_from_rad=from_rad,
            tws_mps=tws_mps,
            current_en_mps=self.current_en_mps,
            no_go_half_rad=self.no_go_half_rad,
        )

    def trouble(self, here: PointEn, there: PointEn) -> str:
        """Return why the boat cannot sail from here to there, in words; empty: the current does not keep it from it."""
        drift_mps = math.hypot(*self.current_en_mps)
        if drift_mps == 0.0 or self.made_good_mps(bearing_rad(here, there)) is not None:
            return ""
        carried = math.hypot(*self.carried_en_mps)
        lost = f", carried {carried:.1f} m/s at the least" if carried > 0.0 else ""
        return f"cannot make way against {drift_mps:.1f} m/s{lost}"


def is_clear(water: Water, area: AreaLike, place: PointEn, floor_m: float) -> bool:
    """Return whether the boat is carried clear from a place for as long as a drift is looked ahead."""
    return drift_ahead(area, place, water.carried_en_mps, floor_m=floor_m).is_clear


def waiting_place(water: Water, area: AreaLike, here: PointEn, floor_m: float) -> PointEn | None:
    """Return the nearest place in time that the boat can reach and from which it is carried clear; None: there is none.

    ``here`` itself where that is so.
    """
    if is_clear(water, area, here, floor_m):
        return here
    found: list[tuple[float, PointEn]] = []
    for n in range(DIRECTIONS):
        course = 2.0 * math.pi * n / DIRECTIONS
        made = water.made_good_mps(course)
        for far_m in PLACES_M if made is not None else ():
            place = moved(here, course, far_m)
            if area.path_clearance_m([here, place]) >= floor_m and is_clear(water, area, place, floor_m):
                found.append((far_m / (made or LEAST_MPS), place))
                break
    return min(found)[1] if found else None
