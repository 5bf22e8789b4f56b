"""What a boat does that is not the plan's, compiled: leeway, a polar that errs, falling off a failed tack."""

from __future__ import annotations

import math

from companion.boat.boat import CROSS_FLOW
from companion.kernels.jit import kernel
from sitl.autopilot.boat.scalars import clip

# Of the push on a boat whose sails are eased: what hull and mast leave.
WINDAGE = 0.25
# Angles to the wind at which the shares of speed are stated, straight between and level beyond them.
BEAT_RAD, REACH_RAD, RUN_RAD = math.radians(45.0), math.radians(90.0), math.radians(150.0)
# A boat in irons lies so far off the wind, on the tack that she came from; she sails again beyond the other.
IRONS_RAD, FILLED_RAD = math.radians(15.0), math.radians(50.0)
SETTLING_HZ, FALLING_RADPS = 0.5, 0.35


@kernel
def side_mps(
    coefficient: float, aws_mps: float, awa_rad: float, speed_mps: float, sail_rad: float, ideal_rad: float,
) -> float:
    """Return the speed to starboard [m/s] at which the water's push balances that of the sail.

    As ``companion.boat.boat`` has it, and an eased sail leaves ``WINDAGE`` of the push.
    """
    drawing = clip((abs(awa_rad) - sail_rad) / max(ideal_rad, 0.1), 0.0, 1.0)
    push = coefficient * aws_mps * aws_mps * abs(math.sin(awa_rad)) * (WINDAGE + (1.0 - WINDAGE) * drawing)
    if push == 0.0:
        return 0.0
    way = abs(speed_mps)
    side = 2.0 * push / (math.sqrt(way * way + 4.0 * CROSS_FLOW * push) + way)
    return -side if awa_rad > 0.0 else side


@kernel
def speed_share(angle_rad: float, beat: float, reach: float, run: float) -> float:
    """Return the share of the polar's speed that she makes at an angle to the true wind."""
    if angle_rad < REACH_RAD:
        return beat + (reach - beat) * clip((angle_rad - BEAT_RAD) / (REACH_RAD - BEAT_RAD), 0.0, 1.0)
    return reach + (run - reach) * clip((angle_rad - REACH_RAD) / (RUN_RAD - REACH_RAD), 0.0, 1.0)


@kernel
def falls_off(angle_rad: float, is_caught: bool) -> tuple[float, bool]:
    """Return the turn [rad/s] of a boat whose tack failed, and whether she sails again.

    ``angle_rad`` is where the wind is, positive on the side of the tack that she came from, and a positive turn
    brings it ahead. Caught, she lies near head to wind; then she falls off to the old tack.
    """
    if is_caught:
        return SETTLING_HZ * (angle_rad - IRONS_RAD), False
    return -FALLING_RADPS, angle_rad > FILLED_RAD
