"""AR_WPNav's point on one leg, compiled: from rest to rest under a greatest speed, acceleration and jerk.

Restated from ArduPilot's AP_Math/SCurve.cpp: seven phases of constant jerk. The original rounds the corners of the jerk
off (AR_WPNAV_SNAP_MAX 15 m/s^4, a tenth of a second), which is left out.
"""

from __future__ import annotations

import math

from companion.kernels.jit import kernel


@kernel
def top_speed_mps(length_m: float, speed_mps: float, accel: float, jerk: float) -> float:
    """Return the highest speed on a leg."""
    # to v and back takes v (v / a + a / j) metres, or 2 v sqrt(v / j) where the acceleration is never full
    full = accel * accel / jerk
    v = float((length_m * math.sqrt(jerk) / 2.0) ** (2.0 / 3.0))
    if v > full:
        b = full
        v = 0.5 * (-b + math.sqrt(b * b + 4.0 * accel * length_m))
    return max(min(v, speed_mps), 1e-3)


@kernel
def rise_s(v: float, accel: float, jerk: float) -> float:
    """Return how long it takes to gather a speed."""
    full = accel * accel / jerk
    return v / accel + accel / jerk if v >= full else 2.0 * math.sqrt(v / jerk)


@kernel
def leg_s(length_m: float, v: float, rise: float) -> float:
    """Return how long a leg takes whose top speed is ``v``, gathered in ``rise``."""
    return 2.0 * rise + max(0.0, length_m - v * rise) / v


@kernel
def along(t: float, v: float, rise: float, accel: float, jerk: float) -> tuple[float, float, float]:
    """Return place, speed and acceleration ``t`` after setting off towards top speed ``v``, gathered in ``rise``."""
    if t >= rise:
        return 0.5 * v * rise + v * (t - rise), v, 0.0
    ramp = accel / jerk if v >= accel * accel / jerk else 0.5 * rise
    top = jerk * ramp
    if t <= ramp:
        return jerk * t * t * t / 6.0, 0.5 * jerk * t * t, jerk * t
    if t <= rise - ramp:
        d = t - ramp
        v1 = 0.5 * jerk * ramp * ramp
        return jerk * ramp * ramp * ramp / 6.0 + v1 * d + 0.5 * top * d * d, v1 + top * d, top
    d = rise - t
    return 0.5 * v * rise - (v * d - jerk * d * d * d / 6.0), v - 0.5 * jerk * d * d, jerk * d


@kernel
def on_leg(
    t: float, length_m: float, v: float, rise: float, whole: float, accel: float, jerk: float,
) -> tuple[float, float, float]:
    """Return place [m], speed and acceleration along a leg, ``t`` after its start; at its end at rest.

    ``rise`` and ``whole`` are ``rise_s`` and ``leg_s`` of it, which hold for the whole leg.
    """
    if t >= whole:
        return length_m, 0.0, 0.0
    if t <= 0.0:
        return 0.0, 0.0, 0.0
    if t <= 0.5 * whole:
        return along(t, v, rise, accel, jerk)
    s, w, a = along(whole - t, v, rise, accel, jerk)
    return length_m - s, w, -a
