"""The view as Signal K: full paths of the specification, SI units and radians, alarms as ``notifications``.

What the companion knows of the wind is against the ground (``speedOverGround``, ``angleTrueGround``): it has no speed
through the water. What is not known is not told; what is known no more is told once as null.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from typing import Any

from companion.geo.frame import LocalFrame
from companion.outputs.course import course_of, is_fresh, place_of
from companion.outputs.nmea import UNTRUSTED
from companion.view.air import PointEn
from companion.view.values import Alarm, View

# As $source: into a source with a label a server puts a label of its own.
LABEL = "sailboat-companion"
BATTERY = "electrical.batteries.autopilot"
# Alarms for which the specification has a name of its own; the others are under notifications.companion.
KNOWN = {"leaking": "flooding", "drifting": "grounding", "vessel too near": "collision"}
STATES = {"critical": "emergency", "error": "alarm", "warning": "warn", "notice": "alert"}
LOUD = frozenset({"emergency", "alarm"})

Values = dict[str, Any]


def values_of(view: View, frame: LocalFrame) -> Values:
    """Return what is known by its path; places in the view are metres in ``frame``."""
    values: Values = {
        **_motion(view), **_wind(view), **_water(view), **_course(view, frame), **_performance(view), **_helm(view),
        # the loudest come first in the view, and are the last to be written
        **{path: value for alarm in reversed(view.alarms) for path, value in _notification(alarm).items()},
    }
    return {path: value for path, value in values.items() if value is not None}


def delta(values: Values, told: Mapping[str, Any]) -> dict[str, Any]:
    """Return the update for a server that was ``told`` values before; alarms only where they have changed."""
    news = [
        {"path": path, "value": value} for path, value in values.items()
        if not path.startswith("notifications.") or told.get(path) != value
    ]
    news += [{"path": path, "value": _over(path)} for path in told if path not in values and told[path] is not None]
    return {"context": "vessels.self", "updates": [{"$source": LABEL, "values": news}]}


def told_after(values: Values, told: Mapping[str, Any]) -> Values:
    """Return what the server has been told behind an update; None: that it is over."""
    return {**dict.fromkeys(told), **values}


def _over(path: str) -> dict[str, Any] | None:
    if not path.startswith("notifications."):
        return None
    return {"state": "normal", "method": [], "message": "over"}


def _motion(view: View) -> Values:
    boat, place = view.boat, place_of(view)
    if place is None:
        return {}
    return {
        "navigation.position": {"latitude": place.lat_deg, "longitude": place.lon_deg},
        "navigation.speedOverGround": boat.sog_mps,
        "navigation.courseOverGroundTrue": _rad(boat.cog_deg),
        "navigation.headingTrue": _rad(boat.heading_deg),
        "navigation.attitude": None if boat.roll_deg is None else {
            "roll": math.radians(boat.roll_deg), "pitch": None, "yaw": None},
    }


def _wind(view: View) -> Values:
    wind = view.wind
    if wind is None or wind.health in UNTRUSTED or not is_fresh(wind.age_s):
        return {}
    moves = is_fresh(view.boat.age_s)   # an angle at the bow is as old as the heading
    return {
        "environment.wind.directionTrue": _rad(wind.twd_from_deg),
        "environment.wind.speedOverGround": wind.tws_mps,
        "environment.wind.angleTrueGround": _rad(wind.twa_deg) if moves else None,
        "environment.wind.angleApparent": _rad(wind.awa_deg) if moves else None,
        "environment.wind.speedApparent": wind.aws_mps if moves else None,
    }


def _water(view: View) -> Values:
    water = view.water
    if water is None or not water.is_planned:
        return {}
    return {
        "environment.current": {"setTrue": _rad(water.set_deg), "drift": water.drift_mps},
        "environment.wind.speedTrue": water.tws_mps,
    }


def _course(view: View, frame: LocalFrame) -> Values:
    course = course_of(view)
    if course is None:
        return {}
    way = "navigation.courseGreatCircle"
    closing = course.closing_mps
    return {
        f"{way}.crossTrackError": course.right_m,
        f"{way}.bearingTrackTrue": course.leg_rad,
        f"{way}.previousPoint.position": _place(frame, course.start_en_m),
        f"{way}.nextPoint.position": _place(frame, course.end_en_m),
        f"{way}.nextPoint.distance": course.distance_m,
        f"{way}.nextPoint.bearingTrue": course.bearing_rad,
        f"{way}.nextPoint.velocityMadeGood": closing,
        f"{way}.nextPoint.timeToGo": course.distance_m / closing if closing is not None and closing > 0.1 else None,
    }


def _performance(view: View) -> Values:
    boat, wind, polar = view.boat, view.wind, view.polar
    if not is_fresh(boat.age_s) or wind is None or wind.health in UNTRUSTED or not is_fresh(wind.age_s):
        return {}
    course = course_of(view)
    speed = None if polar is None or wind.twa_deg is None else polar.at_mps(wind.twa_deg)
    return {
        "performance.velocityMadeGood": boat.vmg_mps,
        "performance.velocityMadeGoodToWaypoint": None if course is None else course.closing_mps,
        "performance.polarSpeed": speed,
        "performance.polarSpeedRatio": boat.sog_mps / speed if boat.sog_mps is not None and speed else None,
        "performance.beatAngle": None if polar is None else _rad(polar.beat_deg),
        "performance.gybeAngle": None if polar is None else _rad(polar.run_deg),
        "performance.tackTrue": None if wind.twd_from_deg is None or wind.twa_deg is None else
        math.radians((wind.twd_from_deg + wind.twa_deg) % 360.0),
    }


def _helm(view: View) -> Values:
    state, boat = view.state, view.boat
    steers = {"AUTO": "route", "GUIDED": "auto"}
    return {
        "navigation.state": "sailing" if state.is_sailing else None,
        "steering.autopilot.state": None if state.mode is None else
        steers.get(state.mode, "standby") if state.is_armed else "standby",
        f"{BATTERY}.voltage": boat.battery_v,
        f"{BATTERY}.capacity.stateOfCharge": boat.battery_share,
    }


def _notification(alarm: Alarm) -> Values:
    state = STATES.get(alarm.level)
    if state is None:
        return {}
    words = re.findall(r"[A-Za-z0-9]+", alarm.code) or ["alarm"]
    name = KNOWN.get(alarm.code, "companion." + words[0].lower() + "".join(word.capitalize() for word in words[1:]))
    return {f"notifications.{name}": {
        "state": state, "method": ["visual", "sound"] if state in LOUD else ["visual"],
        "message": f"{alarm.code}: {alarm.text}" if alarm.text else alarm.code}}


def _place(frame: LocalFrame, en_m: PointEn) -> dict[str, float]:
    point = frame.geo_from_en(*en_m)
    return {"latitude": round(point.lat_deg, 7), "longitude": round(point.lon_deg, 7)}


def _rad(angle_deg: float | None) -> float | None:
    return None if angle_deg is None else round(math.radians(angle_deg), 4)
