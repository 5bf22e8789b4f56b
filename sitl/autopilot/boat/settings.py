"""The kernel's settings, from the parameters."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from sitl.autopilot.boat import kernel as k

# Setting of the kernel, name of the parameter, factor to the kernel's unit.
_SETTINGS: tuple[tuple[int, str, float], ...] = (
    (k.P_NOGO, "SAIL_NO_GO_ANGLE", math.pi / 180.0),
    (k.P_XTRACK_MAX, "SAIL_XTRACK_MAX", 1.0),
    (k.P_IDEAL, "SAIL_ANGLE_IDEAL", math.pi / 180.0),
    (k.P_SAIL_MIN, "SAIL_ANGLE_MIN", math.pi / 180.0),
    (k.P_SAIL_MAX, "SAIL_ANGLE_MAX", math.pi / 180.0),
    (k.P_LOITER_RADIUS, "SAIL_LOIT_RADIUS", 1.0),
    (k.P_WP_RADIUS, "WP_RADIUS", 1.0),
    (k.P_WP_SPEED, "WP_SPEED", 1.0),
    (k.P_PIVOT_RATE, "WP_PIVOT_RATE", math.pi / 180.0),
    (k.P_ANG_P, "ATC_STR_ANG_P", 1.0),
    (k.P_RATE_P, "ATC_STR_RAT_P", 1.0),
    (k.P_RATE_I, "ATC_STR_RAT_I", 1.0),
    (k.P_RATE_FF, "ATC_STR_RAT_FF", 1.0),
    (k.P_RATE_MAX, "ATC_STR_RAT_MAX", math.pi / 180.0),
    (k.P_RATE_ACC, "ATC_STR_ACC_MAX", math.pi / 180.0),
    (k.P_SCALE_BASE, "MOT_SPD_SCA_BASE", 1.0),
    (k.P_POS_P, "PSC_POS_P", 1.0),
    (k.P_VEL_P, "PSC_VEL_P", 1.0),
    (k.P_ACCEL, "ATC_ACCEL_MAX", 1.0),
    (k.P_TURN_MAX_G, "ATC_TURN_MAX_G", 1.0),
    (k.P_DIR_FILT, "WNDVN_DIR_FILT", 1.0),
    (k.P_SPD_FILT, "WNDVN_SPEED_FILT", 1.0),
    (k.P_TRUE_FILT, "WNDVN_TRUE_FILT", 1.0),
    (k.P_WIND_TC, "SIM_WIND_TC", 1.0),
    (k.P_VANE, "WNDVN_TYPE", 1.0),
    (k.P_SPEED_SENSOR, "WNDVN_SPEED_TYPE", 1.0),
    (k.P_SPEED_MIN, "WNDVN_SPEED_MIN", 1.0),
    (k.P_VANE_OFFSET, "WNDVN_DIR_OFS", math.pi / 180.0),
    (k.P_TURN_RADIUS, "TURN_RADIUS", 1.0),
)


def fill(settings: NDArray[np.float64], get: Callable[[str], float]) -> None:
    """Set all settings from the parameters, which ``get`` returns by name."""
    for index, name, factor in _SETTINGS:
        settings[index] = get(name) * factor
    if get("WP_ACCEL") > 0.0:
        settings[k.P_ACCEL] = get("WP_ACCEL")
    settings[k.P_ACCEL] = max(settings[k.P_ACCEL], 0.1)
    settings[k.P_WP_SPEED] = max(settings[k.P_WP_SPEED], 0.5)
