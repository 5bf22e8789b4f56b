"""Is a path still good? Its sailing angles, time and clearance in a wind, leg by leg.

Used to keep an old plan (against a new one or against none), and to see that the leg being sailed has become
unsailable. The chance constraint itself is the planner's.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from statistics import NormalDist

import numpy as np

from companion.boat import Boat, made_good_mps
from companion.current import over_water
from companion.geo.angles import difference_rad
from companion.messages import WindForecast
from companion.skipper.way.geometry import bearing_rad, cross_track_m, distance_m, moved
from companion.skipper.way.voyage import AreaLike, PointEn

SHORT_LEG_M = 3.0  # the autopilot turns within this: its angle does not matter
LOST_MPS = 0.2  # a leg inside the no-go zone is sailed by the autopilot's own tacks at no less than this


@dataclass(frozen=True, slots=True, kw_only=True)
class Verdict:
    """What was found: sailing time [s], smallest clearance [m], the worst angle to spare [rad] and its leg."""

    time_s: float
    clearance_m: float
    spare_rad: float
    worst_leg: int

    def is_sound(self, margin_m: float) -> bool:
        """Return whether every leg is outside the no-go zone asked for and the margin is kept."""
        return self.spare_rad >= 0.0 and self.clearance_m >= margin_m


def half_width_rad(forecast: WindForecast | None, horizon_s: float, level: float) -> float:
    """Return the half width of the central interval of the direction at a horizon, at any level.

    From the table where it reaches, widened like a normal distribution beyond its levels.
    """
    if forecast is None:
        return 0.0
    h = forecast.horizon_s
    sigma = float(np.interp(horizon_s, h, forecast.sigma_twd_rad))
    z = NormalDist().inv_cdf(0.5 + 0.5 * min(max(level, 0.0), 0.9999))
    levels = forecast.level
    if levels.shape[0] == 0:
        return z * sigma
    column = np.array([float(np.interp(horizon_s, h, forecast.half_width_rad[:, j])) for j in range(levels.shape[0])])
    if levels[0] <= level <= levels[-1]:
        return float(np.interp(level, levels, column))
    edge = levels[-1] if level > levels[-1] else levels[0]
    width = column[-1] if level > levels[-1] else column[0]
    return float(width * z / NormalDist().inv_cdf(0.5 + 0.5 * float(edge)))


def mean_twd_rad(forecast: WindForecast, horizon_s: float) -> float:
    """Return the forecast's mean direction at a horizon [rad]."""
    h = forecast.horizon_s
    east = float(np.interp(horizon_s, h, np.sin(forecast.mean_twd_from_rad)))
    north = float(np.interp(horizon_s, h, np.cos(forecast.mean_twd_from_rad)))
    return math.atan2(east, north)


def judge(
    path: Sequence[PointEn],
    *,
    boat: Boat,
    no_go_half_rad: float,
    twd_from_rad: float,
    tws_mps: float,
    area: AreaLike,
    start_heading_rad: float | None = None,
    forecast: WindForecast | None = None,
    level: float = 0.0,
    after_s: float = 0.0,
    beat_room_m: float | None = None,
    current_en_mps: tuple[float, float] = (0.0, 0.0),
) -> Verdict:
    """Judge a polyline that is sailed from its first point, ``after_s`` from now.

    ``level`` is the central probability of the forecast's interval that each leg must be clear of; 0 asks for the
    present wind alone. A leg inside the zone is timed as the beat that it will become; with ``beat_room_m`` of clear
    water about it, it is as good as any other. Wind and angles are over the ground, as the autopilot has them; in a
    current a leg along which it makes no way at all is as bad as one head to wind.
    """
    time_s, spare, worst = 0.0, math.inf, -1
    heading = start_heading_rad
    for n, (a, b) in enumerate(pairwise(path)):
        length = distance_m(a, b)
        if length < 1e-6:
            continue
        course = bearing_rad(a, b)
        twa = abs(difference_rad(twd_from_rad, course))
        needed = no_go_half_rad
        if forecast is not None and level > 0.0:
            needed += half_width_rad(forecast, after_s + time_s, level)
        if (
            length > SHORT_LEG_M
            and twa - needed < spare
            and not (twa < needed and beat_room_m is not None and area.path_clearance_m([a, b]) >= beat_room_m)
        ):
            spare, worst = twa - needed, n
        if current_en_mps != (0.0, 0.0):
            water = over_water(twd_from_rad, tws_mps, current_en_mps)
            made = made_good_mps(
                boat,
                course,
                twd_from_rad=water[0],
                tws_mps=water[1],
                current_en_mps=current_en_mps,
                no_go_half_rad=no_go_half_rad,
            )
            if made is None:
                spare, worst = min(spare, -no_go_half_rad), n
            speed = made or 0.0
        elif twa >= no_go_half_rad:
            speed = boat.polar.speed_mps(twa, tws_mps)
        else:
            speed = boat.polar.speed_mps(no_go_half_rad, tws_mps) * math.cos(no_go_half_rad) / math.cos(twa)
        time_s += length / max(speed, LOST_MPS)
        if heading is not None:
            time_s += abs(difference_rad(course, heading)) / boat.turn_rate_radps
        heading = course
    clearance = area.path_clearance_m(list(path)) if len(path) > 0 else math.inf
    return Verdict(time_s=time_s, clearance_m=clearance, spare_rad=spare, worst_leg=worst)


@dataclass(frozen=True, slots=True, kw_only=True)
class Drift:
    """What the autopilot will do with a leg inside its no-go zone: how far off the line, and how clear."""

    off_leg_m: float
    clearance_m: float
    path: tuple[PointEn, ...]


def predicted_beat(
    boat_en: PointEn,
    heading_rad: float,
    leg_from: PointEn,
    target: PointEn,
    *,
    twd_from_rad: float,
    no_go_half_rad: float,
    corridor_m: float,
    area: AreaLike,
    speed_mps: float = 1.0,
    current_en_mps: tuple[float, float] = (0.0, 0.0),
) -> Drift:
    """Predict the sailing of a leg that the wind has closed (ArduRover: the no-go angle, tack at the corridor).

    On the tack that the boat is on it sails at exactly the no-go angle off the wind until the corridor's edge
    (``corridor_m``; 0: until the layline) or until it is past the target. In a current, what it makes good of that
    heading at ``speed_mps`` through the water.
    """
    tack = 1.0 if difference_rad(twd_from_rad, heading_rad) >= 0.0 else -1.0  # +1: wind over starboard
    course = twd_from_rad - tack * no_go_half_rad
    if current_en_mps != (0.0, 0.0):
        course = bearing_rad((0.0, 0.0), moved(current_en_mps, course, speed_mps))
    left_m = distance_m(boat_en, target)
    step = max(1.0, left_m / 40.0)
    path, point, sailed, off = [boat_en], boat_en, 0.0, abs(cross_track_m(boat_en, leg_from, target))
    while sailed < left_m:
        point = moved(point, course, step)
        sailed += step
        path.append(point)
        off = max(off, abs(cross_track_m(point, leg_from, target)))
        if corridor_m > 0.0 and abs(cross_track_m(point, leg_from, target)) >= corridor_m:
            break
        to_target = abs(difference_rad(twd_from_rad, bearing_rad(point, target)))
        if to_target >= no_go_half_rad:
            break
    return Drift(off_leg_m=off, clearance_m=area.path_clearance_m(path), path=tuple(path))
