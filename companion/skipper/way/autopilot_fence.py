"""The autopilot's own fence: water that it takes the boat out of again, whatever a mission wants.

The circle around home, which ArduPilot's FENCE_TYPE has beside the polygons, and by default: outside FENCE_RADIUS the
autopilot acts as FENCE_ACTION says. And what is drawn on it, by a person, before or under way: polygons and circles to
keep inside of, or out of. No mission file knows of either, so they are added to the area while the boat sails.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import shapely
from shapely.geometry.base import BaseGeometry

from companion.boat import AutopilotLimits
from companion.geofence import Zone
from companion.messages import AutopilotStatus
from companion.skipper.way.geometry import bearing_rad, distance_m, moved
from companion.skipper.way.voyage import AreaLike, PointEn, Voyage

COARSE_M = 0.5  # home follows the boat while it is disarmed: not every step makes another area
OUTSIDE_M = 5.0  # so far outside, an autopilot that keeps a fence has said so
STEP_M = 5.0


@dataclass(frozen=True, slots=True, kw_only=True)
class HomeCircle:
    """Around home, local [m]."""

    en_m: PointEn
    radius_m: float

    @property
    def most_room_m(self) -> float:
        """Return the most room that may be asked for about a place inside [m]."""
        return 0.5 * self.radius_m

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
        return (
            f"{what} is {self.radius_m - inside_m:.0f} m from home, {where} {self.words}: "
            "FENCE_TYPE 4 on the autopilot keeps to polygons only, FENCE_RADIUS widens it"
        )

    def place_inside(self, area: AreaLike, from_en: PointEn, room_m: float) -> PointEn:
        """Return the place nearest to ``from_en`` on the way home that has ``room_m`` about it; home without one."""
        course = bearing_rad(self.en_m, from_en)
        far_m = min(self.radius_m, distance_m(self.en_m, from_en)) - room_m
        while far_m > 0.0:
            place = moved(self.en_m, course, far_m)
            if float(area.clearance_m([place])[0]) >= room_m:
                return place
            far_m -= STEP_M
        return self.en_m


@dataclass(frozen=True, slots=True, kw_only=True)
class Drawn:
    """What is drawn on the autopilot: the water that it takes of the voyage's, and the area that it leaves."""

    taken: BaseGeometry
    left: AreaLike

    words: ClassVar[str] = "the fence that is drawn on the autopilot"
    most_room_m: ClassVar[float] = math.inf

    def inside_m(self, en_m: PointEn) -> float:
        """Return how far a place is from what is taken [m], negative in it."""
        point = shapely.points(en_m)
        off_m = float(shapely.distance(self.taken, point))
        return off_m if off_m > 0.0 else -float(shapely.distance(self.taken.boundary, point))

    def cuts(self, way_en: Sequence[PointEn]) -> bool:
        """Return whether a way leads into what is taken; one that begins in it is on its way out."""
        return (
            len(way_en) > 1
            and self.inside_m(way_en[0]) > 0.0
            and bool(shapely.intersects(self.taken, shapely.linestrings(way_en)))
        )

    def trouble(self, what: str, en_m: PointEn, floor_m: float) -> str:
        """Return why a place cannot be sailed to (empty: what is drawn does not forbid it)."""
        inside_m = self.inside_m(en_m)
        if inside_m >= floor_m:
            return ""
        where = "outside" if inside_m < 0.0 else f"less than {floor_m:g} m inside"
        return f"{what} is {where} {self.words}: draw it anew, or switch it off"

    def place_inside(self, area: AreaLike, from_en: PointEn, room_m: float) -> PointEn:  # noqa: ARG002 - as a circle's
        """Return the nearest place with ``room_m`` about it; where it is without one."""
        return self.left.roomy_en(from_en, room_m) or from_en


def drawn_of(
    area: AreaLike, zones: tuple[Zone, ...], limits: AutopilotLimits | None, margin_m: float, *, is_off: bool
) -> Drawn | None:
    """Return what is drawn on the autopilot, None: it is off, or takes no water that the margin leaves."""
    if is_off or not zones or (limits is not None and not limits.fence_polygons):
        return None
    taken = area.taken_by(zones, margin_m)
    return None if taken.is_empty else Drawn(taken=taken, left=area.without(taken, Drawn.words))


def circle_of(
    voyage: Voyage, limits: AutopilotLimits | None, status: AutopilotStatus | None, here_en: PointEn | None
) -> HomeCircle | None:
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
    circle = HomeCircle(en_m=en_m, radius_m=limits.fence_circle_m - COARSE_M)
    if here_en is not None and not status.fence_breached and circle.inside_m(here_en) < -OUTSIDE_M:
        return None
    return circle if circle.radius_m > 0.0 else None
