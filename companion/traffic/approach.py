"""Closest approach: how near, when, and whether that calls for an alarm.

Distances are between hulls: the other vessel's is the rectangle that it reports about its antenna, ours a disc.
Both keep course and speed. In the other's body frame our disc then moves along a ray, and the closest point of a
ray and a rectangle is exact: it is at the ray's start, at a corner, or they cross.
"""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass

from companion.geo import M_PER_NM
from companion.geo.angles import wrap_two_pi
from companion.traffic.predict import predict
from companion.traffic.vessel import Vessel

# Of two vessels that come equally near the sooner one matters more: ten minutes count as 60 m. One that comes no nearer
# than it is counts as if it were so much farther: it takes a turn of its own or ours.
PERIL_MPS, OPENING_M = 0.1, 100.0


@dataclass(frozen=True, slots=True, kw_only=True)
class OwnShip:
    """Our own boat at ``t_s`` in the local frame; ``radius_m`` is half its length, its disc."""

    t_s: float
    en_m: tuple[float, float]
    velocity_en_mps: tuple[float, float] = (0.0, 0.0)
    heading_rad: float | None = None
    radius_m: float = 1.0
    is_sailing: bool = True

    @property
    def speed_mps(self) -> float:
        """Speed over ground [m/s]."""
        return math.hypot(*self.velocity_en_mps)


class Alarm(enum.IntEnum):
    """How much a target matters; a larger value is worse."""

    NONE = 0
    WARN = 1  # closest approach and the time to it are both under the warning limits
    ACT = 2  # both are under the limits for acting
    TOUCH = 3  # hulls overlap now, by what is reported


@dataclass(frozen=True, slots=True, kw_only=True)
class AlarmLimits:
    """CPA and TCPA below which to warn and to act: an alarm needs both."""

    warn_cpa_m: float
    warn_tcpa_s: float
    act_cpa_m: float
    act_tcpa_s: float


SEA = AlarmLimits(warn_cpa_m=0.25 * M_PER_NM, warn_tcpa_s=720.0, act_cpa_m=0.1 * M_PER_NM, act_tcpa_s=360.0)
"""For a boat of 1 to 2 knots among ships."""
LAKE = AlarmLimits(warn_cpa_m=50.0, warn_tcpa_s=90.0, act_cpa_m=20.0, act_tcpa_s=45.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class ClosestApproach:
    """The closest approach if both go on as they do, and the picture now.

    ``distance_m`` and ``now_m`` are between hulls (0: they touch). ``bearing_rad`` is from us to the other, true.
    ``time_s`` counts from the moment asked; 0 when the other is drawing away. ``sigma_m`` is the spread of the
    other's position then.
    """

    distance_m: float
    time_s: float
    now_m: float
    bearing_rad: float
    is_closing: bool
    sigma_m: float


def cpa(own: OwnShip, vessel: Vessel, t_s: float) -> ClosestApproach:
    """Return the closest approach of ``own`` and ``vessel``, both taken on to ``t_s``."""
    there = predict(vessel, t_s)
    dt = t_s - own.t_s
    ox, oy = own.en_m[0] + own.velocity_en_mps[0] * dt, own.en_m[1] + own.velocity_en_mps[1] * dt
    ex, ey = ox - there.mean_en_m[0], oy - there.mean_en_m[1]
    bow = vessel.bow_rad
    if bow is not None:
        bow += there.course_rad - (vessel.course_rad or 0.0) if vessel.course_rad is not None else 0.0
    s, c = (math.sin(bow), math.cos(bow)) if bow is not None else (0.0, 1.0)
    wx, wy = own.velocity_en_mps[0] - there.velocity_en_mps[0], own.velocity_en_mps[1] - there.velocity_en_mps[1]
    # In the other's frame: a to its starboard, b ahead of its hull's centre.
    a, b = ex * c - ey * s, ex * s + ey * c
    va, vb = wx * c - wy * s, wx * s + wy * c
    if bow is not None:
        half_a, half_b, radius = 0.5 * vessel.hull.beam_m, 0.5 * vessel.hull.length_m, own.radius_m
    else:
        half_a = half_b = 0.0
        radius = own.radius_m + vessel.reach_m
    time_s = _closest_time(a, b, va, vb, half_a, half_b)
    gap = _gap(a + va * time_s, b + vb * time_s, half_a, half_b)
    now = _gap(a, b, half_a, half_b)
    later = predict(vessel, t_s + time_s)
    return ClosestApproach(
        distance_m=max(0.0, gap - radius),
        time_s=time_s,
        now_m=max(0.0, now - radius),
        bearing_rad=wrap_two_pi(math.atan2(-ex, -ey)),
        is_closing=time_s > 0.0,
        sigma_m=max(later.sigma_along_m, later.sigma_across_m),
    )


def peril_m(
    own_en_m: tuple[float, float], own_velocity_en_mps: tuple[float, float], vessel: Vessel, t_s: float
) -> float:
    """Return how much a vessel matters where not all can be kept [m]: less is more.

    It is the distance of the closest approach if both go on as they do, and ``PERIL_MPS`` for each second until then,
    or ``OPENING_M`` where it is now: a ship that comes straight at us from afar matters more than a hundred at their
    moorings near by.
    """
    (ve, vn), since_s = vessel.velocity_en_mps, max(0.0, t_s - vessel.t_s)
    we, wn = ve - own_velocity_en_mps[0], vn - own_velocity_en_mps[1]
    e = vessel.antenna_en_m[0] + ve * since_s - own_en_m[0]
    n = vessel.antenna_en_m[1] + vn * since_s - own_en_m[1]
    v2 = we * we + wn * wn
    time_s = max(0.0, -(e * we + n * wn) / v2) if v2 > 1e-9 else 0.0
    gap_m = math.hypot(e + we * time_s, n + wn * time_s) - vessel.hull.half_diagonal_m
    return max(0.0, gap_m) + (PERIL_MPS * time_s if time_s > 0.0 else OPENING_M)


def alarm_of(approach: ClosestApproach, limits: AlarmLimits, growth_m: float = 0.0) -> Alarm:
    """Return the alarm: CPA and TCPA both under their limits; ``growth_m`` is taken off the CPA."""
    near = approach.distance_m - growth_m
    if approach.now_m <= 0.0:
        return Alarm.TOUCH
    if near < limits.act_cpa_m and approach.time_s < limits.act_tcpa_s:
        return Alarm.ACT
    if near < limits.warn_cpa_m and approach.time_s < limits.warn_tcpa_s:
        return Alarm.WARN
    return Alarm.NONE


def _gap(a: float, b: float, half_a: float, half_b: float) -> float:
    return math.hypot(max(0.0, abs(a) - half_a), max(0.0, abs(b) - half_b))


def _closest_time(a: float, b: float, va: float, vb: float, half_a: float, half_b: float) -> float:
    """Return the first time >= 0 at which the ray (a + va t, b + vb t) is nearest to the rectangle."""
    v2 = va * va + vb * vb
    if v2 < 1e-12:
        return 0.0
    times = [0.0]
    for ca in (-half_a, half_a):
        for cb in (-half_b, half_b):
            t = -((a - ca) * va + (b - cb) * vb) / v2
            if t > 0.0:
                times.append(t)
    enter, leave = 0.0, math.inf
    for p, v, half in ((a, va, half_a), (b, vb, half_b)):
        if abs(v) < 1e-12:
            if abs(p) > half:
                enter = math.inf
            continue
        t0, t1 = (-half - p) / v, (half - p) / v
        enter, leave = max(enter, min(t0, t1)), min(leave, max(t0, t1))
    if enter <= leave and math.isfinite(enter):
        return enter
    # Equal distances (a parallel course) keep the earliest.
    return min(times, key=lambda t: (round(_gap(a + va * t, b + vb * t, half_a, half_b), 6), t))
