"""What happens by itself after power-up: texts, the origin, and home while disarmed."""

from __future__ import annotations

import math

from pymavlink.dialects.v20 import ardupilotmega as mav

from sitl.autopilot.pilot.core import Core
from sitl.autopilot.pilot.ekf import READY_S, Ekf

ORIGIN_S = 19.8
HOME_S = 1.0
# When after boot each is said [s], as on the real one.
_TEXTS = (
    (0.04, "Calibrating barometer"), (1.64, "Barometer 1 calibration complete"),
    (1.66, "Beginning INS calibration. Do not move vehicle"), (2.28, "ArduPilot Ready"),
    (2.28, "AHRS: DCM active"), (4.29, "EKF3 IMU0 initialised"),
    (5.89, "EKF3 IMU0 tilt alignment complete"), (5.97, "EKF3 IMU0 MAG0 initial yaw alignment complete"),
    (9.57, "GPS 1: probing for u-blox at 230400 baud"), (9.59, "GPS 1: detected u-blox"),
    (19.77, "EKF3 IMU0 origin set"), (READY_S, "EKF3 IMU0 is using GPS"),
    (READY_S, "AHRS: EKF3 active"),
)


class Startup:
    """A boat that was powered up long ago has said all of it."""

    def __init__(self, core: Core, ekf: Ekf) -> None:
        self._core = core
        self._ekf = ekf
        self._texts = [text for text in _TEXTS if text[0] > core.boot_s]

    @property
    def due_s(self) -> float:
        """When there is something to do."""
        core = self._core
        return min(
            core.boot_at_s + self._texts[0][0] if self._texts else math.inf,
            math.inf if core.is_armed else core.home_due_s,
        )

    def update(self) -> None:
        """One loop."""
        core = self._core
        while self._texts and core.boot_s >= self._texts[0][0] - 1e-9:
            core.voice.announce(mav.MAV_SEVERITY_INFO, self._texts.pop(0)[1])
        if not core.has_origin and core.boot_s >= ORIGIN_S and not self._ekf.gps_lost:
            core.take_origin()
        if not core.is_armed and core.t_s >= core.home_due_s - 1e-9:
            core.home_due_s = core.t_s + HOME_S
            if core.set_home(None):
                core.voice.announce(mav.MAV_SEVERITY_INFO, "Field Elevation Set: 0m")
