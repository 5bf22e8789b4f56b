"""The autopilot's parameter table: names, values, MAVLink types, order.

One line each: name, value, and the type unless it is REAL32. Parameters that change nothing here and that nobody
who sails asks for (of the real boat's 1288) are left out; docs/reference/simulated-autopilot.md says which act.
"""

from __future__ import annotations

import difflib
import math
import struct
from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from companion.boat import l1
from companion.errors import InputError
from sitl.autopilot.boat import kernel as k

TABLE = """
# The sailboat
SAIL_ANGLE_IDEAL 25
SAIL_ANGLE_MAX 90
SAIL_ANGLE_MIN 0
SAIL_ENABLE 1 INT8
SAIL_HEEL_MAX 15
SAIL_LOIT_RADIUS 5
SAIL_NO_GO_ANGLE 45
SAIL_WNDSPD_MIN 0
SAIL_XTRACK_MAX 10
# The wind vane
WNDVN_CAL 0 INT8
WNDVN_DIR_DZ 0
WNDVN_DIR_FILT 0.5
WNDVN_DIR_OFS 0
WNDVN_DIR_PIN -1 INT8
WNDVN_DIR_V_MAX 3.3
WNDVN_DIR_V_MIN 0
WNDVN_SPEED_FILT 0.5
WNDVN_SPEED_MIN 0
WNDVN_SPEED_OFS 1.346
WNDVN_SPEED_PIN -1 INT8
WNDVN_SPEED_TYPE 10 INT8
WNDVN_TEMP_PIN -1
WNDVN_TRUE_FILT 0.05
WNDVN_TYPE 10 INT8
# Waypoints and the position controller
CRUISE_SPEED 5
CRUISE_THROTTLE 30 INT8
PSC_POS_P 0.2
PSC_VEL_D 0
PSC_VEL_FF 0
PSC_VEL_FLTD 5
PSC_VEL_FLTE 5
PSC_VEL_I 0
PSC_VEL_IMAX 1
PSC_VEL_P 1
RTL_SPEED 0
SPEED_MAX 0
TURN_RADIUS 0.9
WP_ACCEL 0
WP_JERK 0
WP_PIVOT_ANGLE 60 INT16
WP_PIVOT_DELAY 0
WP_PIVOT_RATE 60 INT16
WP_RADIUS 3
WP_SPEED 5
# Steering and speed
ATC_ACCEL_MAX 1
ATC_BRAKE 1 INT8
ATC_DECEL_MAX 0
ATC_SAIL_D 0
ATC_SAIL_FF 0
ATC_SAIL_FLTD 0
ATC_SAIL_FLTE 10
ATC_SAIL_FLTT 0
ATC_SAIL_I 0.1
ATC_SAIL_IMAX 1
ATC_SAIL_P 1
ATC_SPEED_D 0
ATC_SPEED_FF 0
ATC_SPEED_FLTD 0
ATC_SPEED_FLTE 10
ATC_SPEED_FLTT 0
ATC_SPEED_I 0.2
ATC_SPEED_IMAX 1
ATC_SPEED_P 0.1
ATC_STOP_SPEED 0.1
ATC_STR_ACC_MAX 120
ATC_STR_ANG_P 2
ATC_STR_RAT_D 0
ATC_STR_RAT_FF 0.75
ATC_STR_RAT_FLTD 0
ATC_STR_RAT_FLTE 10
ATC_STR_RAT_FLTT 0
ATC_STR_RAT_I 0.2
ATC_STR_RAT_IMAX 1
ATC_STR_RAT_MAX 120
ATC_STR_RAT_P 0.2
ATC_TURN_MAX_G 0.6
# Loiter, mission, rally
LOIT_RADIUS 2
LOIT_SPEED_GAIN 0.5
LOIT_TYPE 1 INT8
MIS_DONE_BEHAVE 1 INT8
MIS_OPTIONS 0 INT16
MIS_RESTART 0 INT8
MIS_TOTAL 0 INT16
RALLY_INCL_HOME 1 INT8
RALLY_LIMIT_KM 0.5
RALLY_TOTAL 0 INT8
# Fence and avoidance
AVOID_ACCEL_MAX 3
AVOID_BACKUP_DZ 0.1
AVOID_BACKUP_SPD 0.75
AVOID_BACKZ_SPD 0.75
AVOID_BEHAVE 1 INT8
AVOID_ENABLE 3 INT8
AVOID_MARGIN 2
FENCE_ACTION 1 INT8
FENCE_ENABLE 0 INT8
FENCE_MARGIN 2
FENCE_RADIUS 300
FENCE_TOTAL 0 INT8
FENCE_TYPE 6 INT8
OA_TYPE 0 INT8
# Failsafes and arming
ARMING_ACCTHRESH 0.75
ARMING_CHECK 1 INT32
ARMING_MAGTHRESH 100 INT16
ARMING_MIS_ITEMS 0 INT32
ARMING_OPTIONS 0 INT32
ARMING_REQUIRE 1 INT8
ARMING_RUDDER 2 INT8
CRASH_ANGLE 0 INT8
FS_ACTION 2 INT8
FS_CRASH_CHECK 0 INT8
FS_EKF_ACTION 1 INT8
FS_EKF_THRESH 0.8
FS_GCS_ENABLE 0 INT8
FS_GCS_TIMEOUT 5
FS_OPTIONS 0 INT32
FS_THR_ENABLE 1 INT8
FS_THR_VALUE 910 INT16
FS_TIMEOUT 1.5
INITIAL_MODE 0 INT8
MODE1 0 INT8
MODE2 0 INT8
MODE3 11 INT8
MODE4 10 INT8
MODE5 2 INT8
MODE6 0 INT8
MODE_CH 8 INT8
# Frame, motors, servos, radio control
FRAME_CLASS 2 INT8
FRAME_TYPE 0 INT8
MOT_SLEWRATE 0 INT16
MOT_SPD_SCA_BASE 1
MOT_STR_THR_MIX 0.5
MOT_THR_MAX 100 INT8
MOT_THR_MIN 0 INT8
PILOT_STEER_TYPE 0 INT8
RCMAP_PITCH 2 INT8
RCMAP_ROLL 1 INT8
RCMAP_THROTTLE 3 INT8
RCMAP_YAW 4 INT8
RC1_DZ 30 INT16
RC1_MAX 2000 INT16
RC1_MIN 1000 INT16
RC1_OPTION 0 INT16
RC1_REVERSED 0 INT8
RC1_TRIM 1500 INT16
RC3_DZ 30 INT16
RC3_MAX 2000 INT16
RC3_MIN 1000 INT16
RC3_OPTION 0 INT16
RC3_REVERSED 0 INT8
RC3_TRIM 1500 INT16
SCHED_LOOP_RATE 50 INT16
SERVO1_FUNCTION 26 INT16
SERVO1_MAX 2000 INT16
SERVO1_MIN 1000 INT16
SERVO1_REVERSED 0 INT8
SERVO1_TRIM 1500 INT16
SERVO3_FUNCTION 70 INT16
SERVO3_MAX 2000 INT16
SERVO3_MIN 1000 INT16
SERVO3_REVERSED 0 INT8
SERVO3_TRIM 1500 INT16
SERVO4_FUNCTION 89 INT16
SERVO4_MAX 2000 INT16
SERVO4_MIN 1000 INT16
SERVO4_REVERSED 0 INT8
SERVO4_TRIM 1500 INT16
STICK_MIXING 0 INT8
# Sensors
AHRS_EKF_TYPE 3 INT8
AHRS_ORIENTATION 0 INT8
AIS_TYPE 0 INT8
BATT_ARM_VOLT 0
BATT_CAPACITY 3300 INT32
BATT_CRT_VOLT 0
BATT_FS_CRT_ACT 0 INT8
BATT_FS_LOW_ACT 0 INT8
BATT_LOW_TIMER 10 INT8
BATT_LOW_VOLT 0
BATT_MONITOR 4 INT8
BRD_SAFETY_DEFLT 0 INT8
COMPASS_DEC 0
COMPASS_ENABLE 1 INT8
COMPASS_USE 1 INT8
EK3_ENABLE 1 INT8
EK3_GPS_CHECK 31 INT8
EK3_PRIMARY 0 INT8
EK3_SRC1_POSXY 3 INT8
EK3_SRC1_VELXY 3 INT8
EK3_SRC1_YAW 1 INT8
GPS1_TYPE 1 INT8
# Telemetry
GCS_PID_MASK 0 INT16
SERIAL0_BAUD 115 INT32
SERIAL0_PROTOCOL 2 INT8
SERIAL1_BAUD 57 INT32
SERIAL1_OPTIONS 0 INT16
SERIAL1_PROTOCOL 2 INT8
SERIAL2_BAUD 57 INT32
SERIAL2_OPTIONS 0 INT16
SERIAL2_PROTOCOL 2 INT8
SERIAL5_BAUD 57 INT32
SERIAL5_OPTIONS 0 INT16
SERIAL5_PROTOCOL -1 INT8
SR0_ADSB 0 INT16
SR0_EXTRA1 1 INT16
SR0_EXTRA2 1 INT16
SR0_EXTRA3 1 INT16
SR0_EXT_STAT 1 INT16
SR0_PARAMS 10 INT16
SR0_POSITION 1 INT16
SR0_RAW_CTRL 1 INT16
SR0_RAW_SENS 1 INT16
SR0_RC_CHAN 1 INT16
SR1_ADSB 0 INT16
SR1_EXTRA1 1 INT16
SR1_EXTRA2 1 INT16
SR1_EXTRA3 1 INT16
SR1_EXT_STAT 1 INT16
SR1_PARAMS 10 INT16
SR1_POSITION 1 INT16
SR1_RAW_CTRL 1 INT16
SR1_RAW_SENS 1 INT16
SR1_RC_CHAN 1 INT16
SR2_ADSB 0 INT16
SR2_EXTRA1 1 INT16
SR2_EXTRA2 1 INT16
SR2_EXTRA3 1 INT16
SR2_EXT_STAT 1 INT16
SR2_PARAMS 10 INT16
SR2_POSITION 1 INT16
SR2_RAW_CTRL 1 INT16
SR2_RAW_SENS 1 INT16
SR2_RC_CHAN 1 INT16
SYSID_ENFORCE 0 INT8
SYSID_MYGCS 255 INT16
SYSID_THISMAV 1 INT16
TELEM_DELAY 0 INT8
# Board
FORMAT_VERSION 16 INT16
LOG_BACKEND_TYPE 1 INT8
LOG_BITMASK 65535 INT32
LOG_DISARMED 0 INT8
STAT_BOOTCNT 1 INT16
STAT_FLTTIME 0 INT32
STAT_RUNTIME 0 INT32
# The simulated weather
SIM_SPEEDUP 1
SIM_TIDE_DIR 0
SIM_TIDE_SPEED 0
SIM_WAVE_AMP 0.5
SIM_WAVE_DIR 0
SIM_WAVE_ENABLE 0 INT8
SIM_WAVE_LENGTH 10
SIM_WAVE_SPEED 0.5
SIM_WIND_DIR 180
SIM_WIND_DIR_Z 0
SIM_WIND_SPD 3
SIM_WIND_T 1 INT8
SIM_WIND_TC 5
SIM_WIND_TURB 0
SIM_WIND_T_ALT 60
SIM_WIND_T_COEF 0.01
"""

# The names that ArduPilot 4.7 gave to parameters of 4.6, for boats told to answer like the newer one.
NEW_NAMES = {
    "SYSID_THISMAV": "MAV_SYSID",
    "SYSID_MYGCS": "MAV_GCS_SYSID",
    "TELEM_DELAY": "MAV_TELEM_DELAY",
    **{
        f"SR{port}_{stream}": f"MAV{port + 1}_{stream}"
        for port in range(3)
        for stream in (
            "RAW_SENS",
            "EXT_STAT",
            "RC_CHAN",
            "RAW_CTRL",
            "POSITION",
            "EXTRA1",
            "EXTRA2",
            "EXTRA3",
            "PARAMS",
            "ADSB",
        )
    },
}


# What ArduRover up to 4.2 has beside them, which steers by L1. A boat that is given one of them is such a boat.
L1_NAMES = {"NAVL1_PERIOD": l1.PERIOD_S, "NAVL1_DAMPING": l1.DAMPING, "NAVL1_XTRACK_I": l1.XTRACK_I}

_TYPES = {"INT8": 2, "INT16": 4, "INT32": 6, "REAL32": 9}
_LIMITS = {2: (-128, 127), 4: (-32768, 32767), 6: (-(2**31), 2**31 - 1)}
# Counted by the autopilot, not set by anybody.
READ_ONLY = frozenset({"FENCE_TOTAL", "RALLY_TOTAL", "MIS_TOTAL", "FORMAT_VERSION", "STAT_RUNTIME", "STAT_FLTTIME"})


class Parameters:
    """Values by name; ``revision`` counts the changes.

    Args:
        overrides: values other than the fresh boat's. A name that is not in the table is added as REAL32, so a
            scenario can give a parameter that only its doctor looks at.
        new_names: answer to the names of ArduPilot 4.7 instead of the older ones; inside, the older stay.
    """

    def __init__(self, overrides: Mapping[str, float], *, new_names: bool = False) -> None:
        self.revision = 0
        self._values: dict[str, float] = {}
        self._types: dict[str, int] = {}
        for line in TABLE.splitlines():
            if line and not line.startswith("#"):
                name, value, *kind = line.split()
                self._values[name] = float(value)
                self._types[name] = _TYPES[kind[0] if kind else "REAL32"]
        self._outside = {old: new for old, new in NEW_NAMES.items() if new_names and old in self._values}
        self._inside = {new: old for old, new in self._outside.items()}
        if not L1_NAMES.keys().isdisjoint(overrides):
            overrides = {**L1_NAMES, **overrides}
        for given, number in overrides.items():
            inside = self._inside.get(given, given)
            if inside not in self._values:
                self._types[inside] = _TYPES["REAL32"]
            self._values[inside] = float(number)
        self._order = list(self._values)

    def get(self, name: str) -> float:
        """Return a value by its older name.

        Raises:
            KeyError: there is none.
        """
        return self._values[name]

    def flag(self, name: str) -> int:
        """Return a whole-number value."""
        return int(self._values[name])

    def put(self, name: str, value: float) -> None:
        """Set a value from inside."""
        if self._values.get(name) != value:
            self._values[name] = value
            self.revision += 1

    def __len__(self) -> int:
        return len(self._order)

    def entry(self, key: str | int) -> tuple[str, float, int, int] | None:
        """Return (name as it is sent, value, MAV_PARAM_TYPE, index) by name or index, or None."""
        if isinstance(key, int):
            if not 0 <= key < len(self._order):
                return None
            inside, index = self._order[key], key
        else:
            if key in self._outside:
                return None  # this boat knows it by its new name only
            inside = self._inside.get(key, key)
            if inside not in self._values:
                return None
            index = self._order.index(inside)
        return self._outside.get(inside, inside), self._values[inside], self._types[inside], index

    def set(self, name: str, value: float) -> bool:
        """Set a value from outside; False if the name is unknown. What does not fit the type is brought into it."""
        entry = self.entry(name)
        if entry is None or not math.isfinite(value):
            return entry is not None
        inside = self._inside.get(name, name)
        if inside in READ_ONLY:
            return True
        kind = self._types[inside]
        if kind in _LIMITS:
            low, high = _LIMITS[kind]
            value = float(max(low, min(high, round(value))))
        self.put(inside, value)
        return True


def check_parameters(overrides: Mapping[str, float]) -> None:
    """Refuse parameters that the simulated boat does not have, and values that a float of the wire cannot carry.

    Raises:
        InputError: naming the parameter.
    """
    known = {line.split()[0] for line in TABLE.splitlines() if line and not line.startswith("#")}
    known |= {*NEW_NAMES.values(), *L1_NAMES}
    for name, value in overrides.items():
        if name not in known:
            near = difflib.get_close_matches(name.upper(), known, n=1)
            raise InputError(
                "--param",
                name,
                "is no parameter of this boat",
                f"did you mean {near[0]}?" if near else "docs/reference/simulated-autopilot.md says which it has",
            )
        if not math.isfinite(value) or len(name) > 16 or struct.unpack("f", struct.pack("f", value))[0] != value:
            raise InputError("--param", name, f"{value} cannot be a parameter", "write NAME=NUMBER")


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
    """Set all settings from the parameters, which ``get`` returns by name; a KeyError is one that it does not have."""
    for index, name, factor in _SETTINGS:
        settings[index] = get(name) * factor
    if get("WP_ACCEL") > 0.0:
        settings[k.P_ACCEL] = get("WP_ACCEL")
    settings[k.P_ACCEL] = max(settings[k.P_ACCEL], 0.1)
    settings[k.P_WP_SPEED] = max(settings[k.P_WP_SPEED], 0.5)
    for index, name in zip((k.P_L1_PERIOD, k.P_L1_DAMPING, k.P_L1_XTRACK_I), L1_NAMES, strict=True):
        try:
            settings[index] = get(name)
        except KeyError:
            settings[index] = 0.0
