"""The pilot: all that decides aboard, made anew at every power-up."""

from __future__ import annotations

import math
from collections.abc import Callable

from pymavlink.dialects.v20 import ardupilotmega as mav

from companion.messages import Mode
from sitl.autopilot.pilot.core import Core
from sitl.autopilot.pilot.failsafe import READY_S, Arming, Ekf, Failsafe, Radio
from sitl.autopilot.pilot.fence import FenceMonitor
from sitl.autopilot.pilot.helm import ModeController
from sitl.autopilot.pilot.storage import Rally, Storage
from sitl.world import Constant

ORIGIN_S = 19.8
HOME_S = 1.0
# When after boot each is said [s], as on the real one.
_TEXTS = (
    (0.04, "Calibrating barometer"),
    (1.64, "Barometer 1 calibration complete"),
    (1.66, "Beginning INS calibration. Do not move vehicle"),
    (2.28, "ArduPilot Ready"),
    (2.28, "AHRS: DCM active"),
    (4.29, "EKF3 IMU0 initialised"),
    (5.89, "EKF3 IMU0 tilt alignment complete"),
    (5.97, "EKF3 IMU0 MAG0 initial yaw alignment complete"),
    (9.57, "GPS 1: probing for u-blox at 230400 baud"),
    (9.59, "GPS 1: detected u-blox"),
    (19.77, "EKF3 IMU0 origin set"),
    (READY_S, "EKF3 IMU0 is using GPS"),
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


class Pilot:
    """The parts, each made of those it needs. ``tell_mode`` sends a heartbeat at once."""

    def __init__(self, core: Core, tell_mode: Callable[[], None]) -> None:
        self.core = core
        self._tell_mode = tell_mode
        self.fence = FenceMonitor(core)
        self.rally = Rally(core)
        self.helm = ModeController(core, self.fence, self.rally, self._mode_changed)
        self.ekf = Ekf(core, self.helm)
        self.radio = Radio(core, self.helm)
        self.arming = Arming(core, self.helm, self.fence, self.ekf)
        self.failsafe = Failsafe(core, self.helm, self.arming, self.fence, self.radio, self.ekf)
        self.storage = Storage(core, self.helm.mission, self.fence, self.rally)
        self.startup = Startup(core, self.ekf)

    def _mode_changed(self) -> None:
        self._tell_mode()
        self.failsafe.mode_changed()

    @property
    def due_s(self) -> float:
        """When there is something to do."""
        return min(self.startup.due_s, self.helm.due_s, self.failsafe.due_s, self.fence.due_s)

    def refuse(self, what: str) -> None:
        """Refuse to arm ("arm"), or a mode by its name, from now on; empty: neither."""
        self.arming.is_refused = what == "arm"
        self.helm.refused = Mode[what] if what and what != "arm" else None

    def parameter_changed(self, name: str) -> None:
        """Act on a parameter that somebody set."""
        core, get = self.core, self.core.parameters.get
        if name in {"SIM_WIND_SPD", "SIM_WIND_DIR"}:
            core.vehicle.wind = Constant(math.radians(get("SIM_WIND_DIR")), max(0.0, get("SIM_WIND_SPD")))
        elif name == "FENCE_ENABLE":
            self.fence.switch(enabled=core.parameters.flag(name) == 1)
        core.vehicle.load_parameters()
