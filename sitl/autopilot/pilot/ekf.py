"""The position filter as far as it fails: jumps, lost fixes, and the failsafe that follows."""

from __future__ import annotations

import math

from pymavlink.dialects.v20 import ardupilotmega as mav

from companion.messages import Mode
from sitl.autopilot.config import GpsFault
from sitl.autopilot.pilot.core import Core
from sitl.autopilot.pilot.helm import Helm
from sitl.autopilot.pilot.modes import POSITION_MODES

READY_S = 42.0   # boot to "EKF3 IMU0 is using GPS" on the real one
# Measured on the real one, with FS_EKF_THRESH 0.8: a jump of 30 m, and a receiver switched off.
GLITCH_FLAG = 0x8000
GLITCH_SEEN_S, JUMP_TAKEN_S, JUMP_FAILSAFE_S, JUMP_OVER_S = 1.5, 3.8, 4.8, 11.0
LOST_FAILSAFE_S, LOST_STOPPED_S = 8.3, 15.3


class Ekf:
    """Believes a position, or resists it for a while; its failsafe acts once and never restores a mode."""

    def __init__(self, core: Core, helm: Helm) -> None:
        self._core = core
        self._helm = helm
        self._fault = GpsFault()
        self._fault_s = -math.inf
        self.has_acted = False
        self.has_second = False    # another receiver, whose truth the filter does not take

    @property
    def gps_lost(self) -> bool:
        """Whether there is no fix."""
        return self._fault.is_lost

    @property
    def is_watching(self) -> bool:
        """Whether something is due soon."""
        return self.has_acted or self._fault.is_lost or self._is_resisting or self._is_growing

    @property
    def _is_resisting(self) -> bool:
        return self._fault.is_resisted and self._core.t_s - self._fault_s < JUMP_OVER_S + 1.0

    @property
    def _is_growing(self) -> bool:
        return 0.0 < self._fault.over_s >= self._core.t_s - self._fault_s - 1.0

    @property
    def velocity_error_en_mps(self) -> tuple[float, float]:
        """What is wrong with the velocity that is told [m/s]: how fast an offset grows."""
        fault = self._fault
        if 0.0 < fault.over_s >= self._core.t_s - self._fault_s and not fault.is_resisted:
            return fault.east_m / fault.over_s, fault.north_m / fault.over_s
        return 0.0, 0.0

    @property
    def is_ready(self) -> bool:
        """Whether the position can be used."""
        return bool(self.flags & mav.EKF_POS_HORIZ_ABS)

    def set_gps(self, fault: GpsFault) -> None:
        """Break or mend the position."""
        self._fault, self._fault_s = fault, self._core.t_s
        self.has_second = self.has_second or fault.is_of_one
        if not fault.is_resisted:
            self._take_position()

    def _take_position(self) -> None:
        fault = self._fault
        share = 1.0 if fault.over_s <= 0.0 else min(1.0, (self._core.t_s - self._fault_s) / fault.over_s)
        self._core.vehicle.set_position_error(share * fault.east_m, share * fault.north_m)

    @property
    def flags(self) -> int:
        """EKF_STATUS_REPORT.flags."""
        boot_s = self._core.boot_s
        if boot_s < READY_S:
            return 0x400 if boot_s < 4.3 else 0 if boot_s < 6.5 else 0xA7
        age_s = self._core.t_s - self._fault_s
        if self._fault.is_lost:
            if age_s >= LOST_STOPPED_S:
                return 0xA7
            return 0x8027 if age_s >= LOST_FAILSAFE_S else 0x833F
        return 0x33F | (GLITCH_FLAG if self._is_resisting and age_s >= GLITCH_SEEN_S else 0)

    def update(self) -> None:
        """Look at the filter."""
        core, age_s = self._core, self._core.t_s - self._fault_s
        bad = self._fault.is_lost and age_s >= LOST_FAILSAFE_S - 1e-9
        if self._is_growing and not self._fault.is_resisted:
            self._take_position()
        if self._fault.is_resisted:
            if age_s >= JUMP_TAKEN_S - 1e-9:
                self._take_position()
            bad = bad or JUMP_FAILSAFE_S - 1e-9 <= age_s < JUMP_OVER_S
        if bad and not self.has_acted:
            self.has_acted = True
            core.voice.announce(mav.MAV_SEVERITY_CRITICAL, "EKF variance")
            core.voice.announce(mav.MAV_SEVERITY_CRITICAL, "EKF failsafe")
            if core.is_armed and core.parameters.flag("FS_EKF_ACTION") and self._helm.mode in POSITION_MODES:
                self._helm.set_mode(Mode.HOLD)
        elif self.has_acted and not bad:
            self.has_acted = False
            core.voice.announce(mav.MAV_SEVERITY_CRITICAL, "EKF failsafe cleared")
