"""The L1 law, compiled: how ArduRover up to 4.2 was steered along a leg (AP_L1_Control, restated).

The boat is turned towards the place where she comes back onto the leg a reference length ahead of her. The length
grows with her speed over ground, so that a swing back to the leg takes the same time at every speed: NAVL1_PERIOD is
that time, NAVL1_DAMPING how soon it dies out, NAVL1_XTRACK_I what nudges her the rest of the way.

Frame: east, north [m] and [m/s]; angles [rad] clockwise.
"""

from __future__ import annotations

import math

from companion.geo.kernels import wrap
from companion.kernels.jit import kernel

# ArduRover's own defaults: NAVL1_PERIOD [s], NAVL1_DAMPING, NAVL1_XTRACK_I.
PERIOD_S, DAMPING, XTRACK_I = 8.0, 0.75, 0.02
STEERS_FROM_MPS = 1.0  # slower than this she is turned as if at it (AR_AttitudeControl)
_SLOWEST_MPS = 0.1
_BACK_AT_MOST = math.sin(math.pi / 4.0)  # she comes back to the leg at 45 degrees, no steeper
_NUDGED_RAD, _NUDGE_MOST_RAD = math.radians(5.0), 0.1
_UNDECIDED_RAD, _AWAY_RAD = 0.9 * math.pi, math.radians(120.0)
_PAST_S = 3.0  # this long past the end of the leg she is steered to the end itself


@kernel
def length_m(speed_mps: float, period_s: float, damping: float, least_m: float) -> float:
    """Return the reference length: damping x period / pi x speed, ``least_m`` (WP_RADIUS) at the least."""
    return max(damping * period_s / math.pi * max(speed_mps, _SLOWEST_MPS), least_m)


@kernel
def lateral_mps2(
    boat: tuple[float, float],
    velocity: tuple[float, float],
    yaw_rad: float,
    leg: tuple[float, float, float, float],
    settings: tuple[float, float, float, float],
    before: tuple[float, float],
    dt_s: float,
) -> tuple[float, float, float]:
    """Return the acceleration to starboard along a leg, and the angle and the nudge to be handed in next time.

    Args:
        boat: where she is, ``velocity`` over ground.
        velocity: see there.
        yaw_rad: her heading, which counts where she lies still.
        leg: from east, north to east, north.
        settings: period [s], damping, the integrator's gain, the least reference length [m].
        before: angle and nudge of the last time.
        dt_s: since then.
    """
    e, n = boat
    oe, on, de, dn = leg
    period_s, damping, gain, least_m = settings
    last_rad, nudge_rad = before
    ve, vn = velocity
    speed = math.hypot(ve, vn)
    if speed < _SLOWEST_MPS:
        speed = _SLOWEST_MPS
        ve, vn = speed * math.sin(yaw_rad), speed * math.cos(yaw_rad)
    reach = length_m(speed, period_s, damping, least_m)
    ue, un = de - oe, dn - on
    length = math.hypot(ue, un)
    if length < 1e-6:
        ue, un = de - e, dn - n
        whole = math.hypot(ue, un)
        ue, un = (ue / whole, un / whole) if whole > 1e-6 else (math.sin(yaw_rad), math.cos(yaw_rad))
    else:
        ue, un = ue / length, un / length
    ae, an = e - oe, n - on
    away = math.hypot(ae, an)
    along = ae * ue + an * un
    if away > reach and along / max(away, 1.0) < -_BACK_AT_MOST:
        # well behind the leg's beginning: to it
        we, wn = -ae / away, -an / away
        angle = math.atan2(vn * we - ve * wn, ve * we + vn * wn)
    elif along > length + _PAST_S * speed:
        we, wn = de - e, dn - n
        far = math.hypot(we, wn)
        we, wn = we / far, wn / far
        angle = math.atan2(vn * we - ve * wn, ve * we + vn * wn)
    else:
        across = an * ue - ae * un  # to the left of the leg
        back = math.asin(min(max(across / max(reach, 0.1), -_BACK_AT_MOST), _BACK_AT_MOST))
        if gain <= 0.0:
            nudge_rad = 0.0
        elif abs(back) < _NUDGED_RAD:
            nudge_rad = min(max(nudge_rad + back * gain * dt_s, -_NUDGE_MOST_RAD), _NUDGE_MOST_RAD)
        angle = back + nudge_rad + math.atan2(vn * ue - ve * un, ve * ue + vn * un)
    # sailing away from the waypoint she keeps to the side that she turns to
    ahead = abs(wrap(math.atan2(de - e, dn - n) - yaw_rad))
    if min(abs(angle), abs(last_rad)) > _UNDECIDED_RAD and ahead > _AWAY_RAD and angle * last_rad < 0.0:
        angle = last_rad
    turned = min(max(angle, -0.5 * math.pi), 0.5 * math.pi)
    return 4.0 * damping * damping * speed * speed / reach * math.sin(turned), angle, nudge_rad
