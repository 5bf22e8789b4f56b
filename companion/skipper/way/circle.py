"""The autopilot's own fence around home: water that it takes the boat out of again, whatever a mission wants.

ArduPilot's FENCE_TYPE has it beside the polygons, and by default; outside FENCE_RADIUS the autopilot acts as
FENCE_ACTION says. No mission file knows of it, so it is added to the area while the boat sails.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from companion.boat import AutopilotLimits
from companion.messages import AutopilotStatus
from companion.skipper.way.geometry import bearing_rad, distance_m, moved
from companion.skipper.way.voyage import Area, PointEn, Voyage

COARSE_M = 0.5     # home follows the boat while she is disarmed: not every step makes another area
OUTSIDE_M = 5.0    # so far outside, an autopilot that keeps a fence has said so
STEP_M = 5.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Circle:
    """Around home, local [m]."""

    en_m: PointEn
    radius_m: float

    @property
    def words(self) -> str:
        """What it is called in sentences."""
        return f"the autopilot's fence of {self.radius_m:.0f} m round home"

    def inside_m(self, en_m: PointEn) -> float:
        """Return how far inside a place is [m], negative outside."""
        return self.radius_m - distance_m(self.en_m, en_m)

    def trouble(self, what: str, en_m: PointEn, floor_m: float) -> str:
        """Return why a place cannot be sailed to (empty: the circle does not forbid it)."""
        inside_m = self.inside_m(en_m)
        if inside_m >= floor_m:
            return ""
        where = "outside" if inside_m < 0.0 else f"less than {floor_m:g} m inside"
        return (f"{what} is {self.radius_m - inside_m:.0f} m from home, {where} {self.words}: "
                "FENCE_TYPE 4 on the autopilot keeps to polygons only, FENCE_RADIUS widens it")

    def place_inside(self, area: Area, from_en: PointEn, room_m: float) -> PointEn:
        """Return the place nearest to ``from_en`` on the way home that has ``room_m`` about it; home without one."""
        course = bearing_rad(self.en_m, from_en)
        far_m = min(self.radius_m, distance_m(self.en_m, from_en)) - room_m
        while far_m > 0.0:
            place = moved(self.en_m, course, far_m)
            if float(area.clearance_m([place])[0]) >= room_m:
                return place
            far_m -= STEP_M
        return self.en_m


def circle_of(
    voyage: Voyage, limits: AutopilotLimits | None, status: AutopilotStatus | None, here_en: PointEn | None,
) -> Circle | None:
    """Return the circle that the autopilot keeps, None: none is known, or it keeps none.

    FENCE_STATUS is told while a fence is on, by FENCE_ENABLE or only until the next reboot. A boat outside of a circle
    that the autopilot does not complain of is not kept in by it: home or radius are not what we believe.
    """
    if limits is None or limits.fence_circle_m is None or status is None or status.home is None:
        return None
    if limits.fence_action is None and status.fence_breached is None:
        return None
    home = voyage.frame.en_from_geo(status.home)
    en_m = (round(home[0] / COARSE_M) * COARSE_M, round(home[1] / COARSE_M) * COARSE_M)
    circle = Circle(en_m=en_m, radius_m=limits.fence_circle_m - COARSE_M)
    if here_en is not None and not status.fence_breached and circle.inside_m(here_en) < -OUTSIDE_M:
        return None
    return circle if math.isfinite(math.hypot(*en_m)) and circle.radius_m > 0.0 else None
