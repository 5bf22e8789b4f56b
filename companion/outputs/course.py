"""The leg that is sailed, as a plotter or an autopilot wants it: from where to where, how far off, how fast nearer."""

from __future__ import annotations

import math
from dataclasses import dataclass

from companion.geo.angles import heading_of, wrap_two_pi
from companion.messages import GeoPoint
from companion.outputs.sentences import name_of
from companion.view.air import PointEn
from companion.view.values import Goal, Leg, View

FRESH_S = 5.0         # what is older is not told as if it were so now
INSIDE_M = 5.0        # of a waypoint: ArduRover announces it 3 to 5 m early
SAME_M = 1.0          # a waypoint nearer to a goal than this is the goal's


@dataclass(frozen=True, slots=True, kw_only=True)
class Course:
    """The leg and the boat on it: ``right_m`` to the right of it, ``closing_mps`` the speed towards its end."""

    start_en_m: PointEn
    end_en_m: PointEn
    leg_rad: float
    distance_m: float
    bearing_rad: float
    right_m: float
    along_m: float         # past its end when it is longer than the leg
    length_m: float
    closing_mps: float | None

    @property
    def is_past(self) -> bool:
        """Is she past the line across the leg at its end?"""
        return self.along_m >= self.length_m


def course_of(view: View) -> Course | None:
    """Return the course; None where she sails none, or where she is is not known."""
    legs = legs_ahead(view)
    boat = view.boat
    if not legs or boat.at_en_m is None or not is_fresh(boat.age_s) or not view.state.is_sailing:
        return None
    leg = legs[0]
    way = _between(leg.from_en_m, leg.to_en_m)
    off = _between(leg.from_en_m, boat.at_en_m)
    left = _between(boat.at_en_m, leg.to_en_m)
    length_m = math.hypot(*way)
    leg_rad = heading_of(*way) if length_m > 0.0 else heading_of(*left)
    east, north = math.sin(leg_rad), math.cos(leg_rad)
    bearing_rad = heading_of(*left)
    closing_mps = None
    if boat.sog_mps is not None and boat.cog_deg is not None:
        closing_mps = boat.sog_mps * math.cos(math.radians(boat.cog_deg) - bearing_rad)
    return Course(
        start_en_m=leg.from_en_m, end_en_m=leg.to_en_m, leg_rad=wrap_two_pi(leg_rad), distance_m=math.hypot(*left),
        bearing_rad=wrap_two_pi(bearing_rad), right_m=off[0] * north - off[1] * east,
        along_m=off[0] * east + off[1] * north, length_m=length_m, closing_mps=closing_mps)


def legs_ahead(view: View) -> tuple[Leg, ...]:
    """Return the legs that are not sailed yet, but for the loiter at the end."""
    return () if view.plan is None else tuple(
        leg for leg in view.plan.legs if not leg.is_done and not leg.is_loiter)


def names_ahead(view: View) -> tuple[str, ...]:
    """Return a name for the end of each leg ahead: its goal's, or W and its number in the plan. No name twice."""
    first = 1 if view.plan is None or view.plan.leg is None else view.plan.leg
    names: list[str] = []
    for number, leg in enumerate(legs_ahead(view), first):
        goal = next((g for g in view.goals if _is_at(g, leg.to_en_m)), None)
        name = "" if goal is None else name_of(goal.name)
        names.append(name if name and name not in names else f"W{number}")
    return tuple(names)


def place_of(view: View) -> GeoPoint | None:
    """Return where she is, None where that is not known or old."""
    boat = view.boat
    if boat.lat_deg is None or boat.lon_deg is None or not is_fresh(boat.age_s):
        return None
    return GeoPoint(lat_deg=boat.lat_deg, lon_deg=boat.lon_deg)


def is_fresh(age_s: float | None) -> bool:
    """Is something of this age told as if it were so now?"""
    return age_s is not None and age_s <= FRESH_S


def _is_at(goal: Goal, en_m: PointEn) -> bool:
    return math.dist(goal.at_en_m, en_m) <= SAME_M


def _between(start: PointEn, end: PointEn) -> PointEn:
    return end[0] - start[0], end[1] - start[1]
