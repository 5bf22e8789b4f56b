"""The parameters that a voyage reads, and what each can be. Pure.

A value outside its range cannot be what the autopilot sails by: it was damaged, forged, or set by mistake. It is not
used; what was known before stays, or the firmware's default.
"""

from __future__ import annotations

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
    # the point on the legs that she follows
    "WP_SPEED": (0.0, 100.0),
    "WP_ACCEL": (0.0, 100.0),
    "WP_JERK": (0.0, 100.0),
    "ATC_ACCEL_MAX": (0.0, 100.0),
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


def refusal(name: str, value: float) -> str:
    """Return why ``value`` cannot be parameter ``name``'s, "" when it can; names not in the table are anybody's.

    >>> refusal("SAIL_NO_GO_ANGLE", 90.0)
    'SAIL_NO_GO_ANGLE 90 cannot be (0 to 89)'
    """
    low, high = RANGES.get(name, (float("-inf"), float("inf")))
    if low <= value <= high:  # false for NaN too
        return ""
    return f"{name} {value:g} cannot be ({low:g} to {high:g})"


def believable(values: Mapping[str, float]) -> tuple[dict[str, float], tuple[str, ...]]:
    """Return the values that can be, and why the others cannot."""
    refused = {name: why for name, value in values.items() if (why := refusal(name, value))}
    return {name: value for name, value in values.items() if name not in refused}, tuple(refused.values())
