"""ArduRover's own laws, compiled, for who predicts what it will steer and who stands in for it.

sailboat.cpp holds the edge of the no-go zone on a course that is inside it and tacks where it is a corridor off the
line; AR_PosControl turns the boat by what its velocity lacks of that of the point on the legs. Restated.

Frame: east, north [m]; angles [rad] clockwise from north; the wind's direction is where it comes from.
"""

from __future__ import annotations

import math

from companion.geo.kernels import wrap
from companion.kernels.jit import kernel

RUDDER_MAX_RAD = math.radians(35.0)  # of SIM_Sailboat
NO_GO_PAD_RAD = math.radians(10.0)
TACK_DONE_RAD = math.radians(10.0)
TACK_TIMEOUT_S = 5.0
TACK_RETRY_S = 5.0
TRACK_LEAD = 0.05
OVERSPEED = 5.0
SLOWEST_MPS = 0.1


@kernel
def is_beaten(twd_rad: float, course_rad: float, no_go_rad: float) -> bool:
    """Return whether a course is sailed as a beat: it is in the no-go zone or its pad (use_indirect_route)."""
    return bool(abs(wrap(twd_rad - course_rad)) <= no_go_rad + NO_GO_PAD_RAD)


@kernel
def edge(twd_rad: float, no_go_rad: float, on_port: bool) -> float:
    """Return the heading along the no-go zone's edge, with the wind over the port side or the starboard one."""
    return wrap(twd_rad + no_go_rad if on_port else twd_rad - no_go_rad)


@kernel
def leads_away(xtrack_m: float, corridor_m: float, on_port: bool) -> bool:
    """Return whether the tack leads off the leg where the boat is a corridor off it (to its left: positive)."""
    return abs(xtrack_m) >= corridor_m > 0.0 and (xtrack_m > 0.0) != on_port


@kernel
def pace_share(along_mps: float, behind_m: float, pace_mps: float, position_p: float) -> float:
    """Return how much of its pace the point on the legs keeps: it waits for the boat, or hurries with it."""
    return min(max(TRACK_LEAD + (along_mps - position_p * behind_m) / pace_mps, 0.0), OVERSPEED)


@kernel
def position_control(
    off: tuple[float, float],
    point: tuple[float, float, float, float],
    velocity: tuple[float, float],
    bow: tuple[float, float],
    want_speed: float,
    settings: tuple[float, float, float, float, float, float],
    dt_s: float,
) -> tuple[float, float]:
    """Return the acceleration to starboard [m/s²] and the speed wanted [m/s], which is handed in next time.

    Args:
        off: from the boat to the point.
        point: its velocity and acceleration.
        velocity: of the boat, over ground.
        bow: sine and cosine of her heading.
        want_speed: of the last time.
        settings: gains of position and velocity, speed and acceleration at most, lateral acceleration at most, turning
            radius.
        dt_s: since then.
    """
    (oe, on), (he, hn, ae, an), (ve, vn), (sin, cos) = off, point, velocity, bow
    position_p, velocity_p, fastest, accel, lateral_most, radius = settings
    le, ln = position_p * oe + he, position_p * on + hn
    wanted = math.hypot(le, ln)
    if wanted > fastest:
        le, ln, wanted = le * fastest / wanted, ln * fastest / wanted, fastest
    lateral = velocity_p * ((le - ve) * cos - (ln - vn) * sin) + ae * cos - an * sin
    ahead = max(le * sin + ln * cos, min(wanted, math.sqrt(lateral_most * radius)))
    want_speed = min(max(ahead, want_speed - accel * dt_s), want_speed + accel * dt_s)
    return min(max(lateral, -lateral_most), lateral_most), want_speed
