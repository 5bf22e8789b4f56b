"""Two controllers that end in actuators: Jaulin and Le Bars' for a sailboat, Schmitt's mixing for a motorboat.

References:
    [1] L. Jaulin, F. Le Bars, A simple controller for line following of sailboats, IRSC 2012, table of the controller.
    [2] S. Schmitt, Obstacle Avoidance for an Autonomous Marine Robot, 2013, section 5.2.

"""

from __future__ import annotations

import math
from dataclasses import dataclass

from companion.geo.angles import wrap_pi

RUDDER_MAX_RAD = math.pi / 4.0
GAMMA_RAD = math.pi / 4.0  # at which the line is approached from far off; half of it at ``r_m``
SAIL_ABEAM_RAD = math.pi / 4.0  # beta of line 9: the sail's angle in a wind abeam


@dataclass(frozen=True, slots=True, kw_only=True)
class LineCommand:
    """What the line controller asks for.

    ``rudder_rad`` positive turns the boat to starboard; ``sail_max_rad`` is the sheet: the sail's largest angle.
    """

    heading_rad: float
    rudder_rad: float
    sail_max_rad: float
    q: int
    offset_m: float


def line_following(
    at_en: tuple[float, float],
    heading_rad: float,
    twd_from_rad: float,
    a_en: tuple[float, float],
    b_en: tuple[float, float],
    q: int,
    *,
    r_m: float = 50.0,
    close_hauled_rad: float = math.pi / 4.0,
) -> LineCommand:
    """Return rudder and sheet that bring the boat to the line from a to b and along it [1].

    In [1] angles are counted anticlockwise from x and the wind's is where it blows to; here they are headings and
    where it comes from, which turns signs but not the law.
    """
    de, dn = b_en[0] - a_en[0], b_en[1] - a_en[1]
    length = math.hypot(de, dn)
    course = math.atan2(de, dn)
    # Line 1: e > 0 when the boat is left of the line.
    offset = (de * (at_en[1] - a_en[1]) - dn * (at_en[0] - a_en[0])) / length if length > 0.0 else 0.0
    if abs(offset) > 0.5 * r_m:  # line 2
        q = 1 if offset > 0.0 else -1
    nominal = course + (2.0 * GAMMA_RAD / math.pi) * math.atan(offset / r_m)  # lines 3, 4
    limit = math.cos(close_hauled_rad)
    unsailable = math.cos(nominal - twd_from_rad) > limit  # line 5
    beating = abs(offset) < r_m and math.cos(course - twd_from_rad) > limit
    wanted = twd_from_rad + q * close_hauled_rad if unsailable or beating else nominal  # lines 6, 7
    return LineCommand(
        heading_rad=wrap_pi(wanted),
        rudder_rad=rudder_for(heading_rad, wanted),
        sail_max_rad=sail_for(wanted, twd_from_rad),
        q=q,
        offset_m=offset,
    )


def rudder_for(heading_rad: float, wanted_rad: float) -> float:
    """Return the rudder [rad], positive to starboard: as the sine, hard over beyond 90 degrees (line 8)."""
    off = wanted_rad - heading_rad
    if math.cos(off) >= 0.0:
        return RUDDER_MAX_RAD * math.sin(off)
    return math.copysign(RUDDER_MAX_RAD, math.sin(off))


def sail_for(wanted_rad: float, twd_from_rad: float) -> float:
    """Return the sail's largest angle [rad] for a heading (line 9): 0 into the wind, beta abeam, π/2 before it."""
    down = 0.5 * (1.0 - math.cos(wanted_rad - twd_from_rad))
    return 0.5 * math.pi * math.pow(down, math.log(0.5 * math.pi / SAIL_ABEAM_RAD) / math.log(2.0))


def motor_commands(rudder_rad: float) -> tuple[float, float]:
    """Return (u1, u2), the two motors of Schmitt's boat, for a rudder angle in [-π/4, π/4] [2].

    u1 = (1 + 4 rudder / pi) / 2, u2 = (1 - 4 rudder / pi) / 2. u1 is the left motor for a rudder that is positive to
    starboard. Their sum is 1 and each is within [0, 1], so inside the [-1, 1] that Schmitt allows; a rudder
    beyond its range is taken at its end.
    """
    share = max(-1.0, min(1.0, rudder_rad * 4.0 / math.pi))
    return 0.5 * (1.0 + share), 0.5 * (1.0 - share)
