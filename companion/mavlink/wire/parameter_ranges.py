"""The parameters that a voyage reads, what each can be, and those that change what a sensor says. Pure.

A value outside its range cannot be what the autopilot sails by: it was damaged, forged, or set by mistake. It is not
used; what was known before stays, or the firmware's default.
"""

from __future__ import annotations

import enum
import re
from collections.abc import Mapping

# Name -> lowest and highest value that can be, in ArduPilot's units. Those of the frame come first: nothing is asked
# of an autopilot before they are read.
RANGES: Mapping[str, tuple[float, float]] = {
    "FRAME_CLASS": (0.0, 255.0),
    "SAIL_ENABLE": (0.0, 1.0),
    "SAIL_NO_GO_ANGLE": (0.0, 89.0),
    "SAIL_XTRACK_MAX": (0.0, 10_000.0),
    "SAIL_LOIT_RADIUS": (0.0, 10_000.0),
    "WP_RADIUS": (0.0, 10_000.0),
    "TURN_RADIUS": (0.0, 10_000.0),
    # the point on the legs that the boat follows
    "WP_SPEED": (0.0, 100.0),
    "WP_ACCEL": (0.0, 100.0),
    "WP_JERK": (0.0, 100.0),
    "ATC_ACCEL_MAX": (0.0, 100.0),
    # how fast it turns; 0: no limit
    "ATC_STR_RAT_MAX": (0.0, 1000.0),
    "ATC_STR_ACC_MAX": (0.0, 1000.0),
    "WP_PIVOT_RATE": (0.0, 360.0),
    "FENCE_ENABLE": (0.0, 1.0),
    "FENCE_ACTION": (0.0, 255.0),
    "FENCE_TYPE": (0.0, 255.0),
    "FENCE_RADIUS": (0.0, 100_000.0),
    "WNDVN_TYPE": (0.0, 255.0),
    "WNDVN_SPEED_TYPE": (0.0, 255.0),
    "WNDVN_SPEED_MIN": (0.0, 100.0),
    # corner frequencies [Hz]: at most 0 is no filter
    "WNDVN_TRUE_FILT": (-1.0, 1000.0),
    "WNDVN_DIR_FILT": (-1.0, 1000.0),
    "WNDVN_SPEED_FILT": (-1.0, 1000.0),
    "WNDVN_DIR_OFS": (-360.0, 360.0),
    # channels of the receiver that steer and switch modes
    "MODE_CH": (0.0, 16.0),
    "RCMAP_ROLL": (1.0, 16.0),
    "RCMAP_THROTTLE": (1.0, 16.0),
}

# What ArduRover up to 4.2 has beside them, which steers by L1, and no later one: asked of a boat that says it is one.
BY_L1: tuple[int, int] = (4, 2)
L1_RANGES: Mapping[str, tuple[float, float]] = {"NAVL1_PERIOD": (1.0, 60.0), "NAVL1_DAMPING": (0.1, 10.0)}


def refusal(name: str, value: float) -> str:
    """Return why ``value`` cannot be parameter ``name``'s, "" when it can; names not in the table are anybody's.

    >>> refusal("SAIL_NO_GO_ANGLE", 90.0)
    'SAIL_NO_GO_ANGLE 90 cannot be (0 to 89)'
    """
    low, high = RANGES.get(name) or L1_RANGES.get(name, (float("-inf"), float("inf")))
    if low <= value <= high:  # false for NaN too
        return ""
    return f"{name} {value:g} cannot be ({low:g} to {high:g})"


def believable(values: Mapping[str, float]) -> tuple[dict[str, float], tuple[str, ...]]:
    """Return the values that can be, and why the others cannot."""
    refused = {name: why for name, value in values.items() if (why := refusal(name, value))}
    return {name: value for name, value in values.items() if name not in refused}, tuple(refused.values())


class Effect(enum.Enum):
    """What somebody changes who sets a parameter under way."""

    WIND = "what the vane says"
    HEADING = "what the compass says"
    BOAT = "how she answers to sheet and rudder"
    HABIT = "how the autopilot sails"


# The first pattern that a name matches counts; names of none are nobody's business here.
EFFECTS: tuple[tuple[re.Pattern[str], Effect], ...] = (
    (re.compile(r"WNDVN_(SPEED_MIN|DIR_DZ|.*_FILT)"), Effect.HABIT),
    (re.compile(r"WNDVN_.*"), Effect.WIND),
    (re.compile(r"(COMPASS|AHRS)_.*"), Effect.HEADING),
    (re.compile(r"SERVO\d+_REVERSED|SAIL_ENABLE|SAIL_ANGLE_.*"), Effect.BOAT),
    (re.compile(r"SAIL_.*"), Effect.HABIT),
)


def effect_of(name: str) -> Effect | None:
    """Return what setting a parameter changes of what sensors say and how the boat sails, None for any other.

    >>> effect_of("WNDVN_DIR_OFS"), effect_of("SERVO1_REVERSED"), effect_of("WP_RADIUS")
    (<Effect.WIND: 'what the vane says'>, <Effect.BOAT: 'how she answers to sheet and rudder'>, None)
    """
    return next((effect for pattern, effect in EFFECTS if pattern.fullmatch(name)), None)
