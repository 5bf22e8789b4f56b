"""The view as NMEA 0183: what an instrument shows, where she is bound for, the route that she sails."""

from __future__ import annotations

import math
from dataclasses import dataclass

from companion.geo.frame import LocalFrame
from companion.messages import GeoPoint
from companion.outputs import sentences
from companion.outputs.course import INSIDE_M, Course, course_of, is_fresh, legs_ahead, names_ahead, place_of
from companion.view.values import View

ROUTE = "companion"
ORIGIN = "FROM"        # the name of where the leg begins
UNTRUSTED = frozenset({"none", "untrusted"})   # of a wind's health: shown as not valid


@dataclass(frozen=True, slots=True, kw_only=True)
class Lines:
    """Sentences: those that are told each second, and those of the route, which are told when they change."""

    now: tuple[str, ...]
    route: tuple[str, ...] = ()


def lines_of(view: View, frame: LocalFrame, utc_s: float | None) -> Lines:
    """Return the sentences; places in the view are metres in ``frame``, ``utc_s`` is the time by GPS.

    What is not known or old is left out, or its sentence says that it is not valid.
    """
    points = [_point(frame, leg.to_en_m) for leg in legs_ahead(view)]
    names = names_ahead(view)
    course = course_of(view)
    has_arrived = view.state.has_arrived is True
    underway = () if course is None else _course(course, names[0], points[0], has_arrived=has_arrived)
    route = tuple(sentences.wpl(point, name) for point, name in zip(points, names, strict=True))
    return Lines(now=(*_motion(view, utc_s), *_wind(view), *_water(view), *underway),
                 route=(*route, *sentences.rte(ROUTE, names)) if names else ())


def _motion(view: View, utc_s: float | None) -> list[str]:
    boat = view.boat
    point = place_of(view)
    out = [sentences.rmc(utc_s, point, boat.sog_mps, _rad(boat.cog_deg))]
    if is_fresh(boat.age_s) and boat.heading_deg is not None:
        out.append(sentences.hdt(math.radians(boat.heading_deg)))
    return out


def _wind(view: View) -> list[str]:
    wind = view.wind
    if wind is None:
        return []
    is_valid = wind.health not in UNTRUSTED and is_fresh(wind.age_s)
    moves = is_fresh(view.boat.age_s)   # an angle at the bow is as old as the heading
    out = []
    if wind.awa_deg is not None and wind.aws_mps is not None:
        out.append(sentences.mwv(math.radians(wind.awa_deg), wind.aws_mps, is_apparent=True,
                                 is_valid=is_valid and moves))
    if wind.twa_deg is not None and wind.tws_mps is not None:
        out.append(sentences.mwv(math.radians(wind.twa_deg), wind.tws_mps, is_apparent=False,
                                 is_valid=is_valid and moves))
    if is_valid and wind.twd_from_deg is not None and wind.tws_mps is not None:
        out.append(sentences.mwd(math.radians(wind.twd_from_deg), wind.tws_mps))
    return out


def _water(view: View) -> list[str]:
    """Return the current that plans reckon with."""
    water = view.water
    return [] if water is None or not water.is_planned else [
        sentences.vdr(math.radians(water.set_deg), water.drift_mps)]


def _course(course: Course, name: str, point: GeoPoint, *, has_arrived: bool) -> list[str]:
    is_inside = course.distance_m <= INSIDE_M
    return [
        sentences.apb(course.right_m, course.leg_rad, course.bearing_rad, name, is_inside=is_inside,
                      is_past=course.is_past),
        sentences.rmb(course.right_m, ORIGIN, name, point, course.distance_m, course.bearing_rad, course.closing_mps,
                      has_arrived=has_arrived or is_inside),
    ]


def _point(frame: LocalFrame, en_m: tuple[float, float]) -> GeoPoint:
    return frame.geo_from_en(*en_m)


def _rad(angle_deg: float | None) -> float | None:
    return None if angle_deg is None else math.radians(angle_deg)
