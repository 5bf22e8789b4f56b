"""Failsafes: loss of the ground station, low battery, no position, and what a breached fence does."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from pymavlink.dialects.v20 import ardupilotmega as mav

from companion.messages import Mode
from sitl.autopilot.config import GpsFault
from sitl.autopilot.telemetry import POSITION_MODES

if TYPE_CHECKING:
    from sitl.autopilot.autopilot import Autopilot

_CHECK_S = 0.1
# Measured on the real one, with FS_EKF_THRESH 0.8: a jump of 30 m, and a receiver switched off.
GLITCH_FLAG = 0x8000
GLITCH_SEEN_S, JUMP_TAKEN_S, JUMP_FAILSAFE_S, JUMP_OVER_S = 1.5, 3.8, 4.8, 11.0
LOST_FAILSAFE_S, LOST_STOPPED_S = 8.3, 15.3


class Failsafe:
    """Watches; acts once when something begins, says when it has ended, never restores a mode."""

    def __init__(self, autopilot: Autopilot) -> None:
        self._a = autopilot
        self._gcs_heard_s: float | None = None
        self._gcs_acted = False
        self._battery_since_s: float | None = None
        self._battery_acted = False
        self._ekf_acted = False
        self._fault = GpsFault()
        self._fault_s = -math.inf
        self._due_s = 0.0
        self._recovery_until_s = -math.inf

    @property
    def is_active(self) -> bool:
        """Whether a failsafe has acted and not cleared."""
        return self._gcs_acted or self._ekf_acted

    @property
    def due_s(self) -> float:
        """When to look again."""
        a = self._a
        watching = (
            (self._gcs_heard_s is not None and a.parameters.flag("FS_GCS_ENABLE"))
            or 0.0 < a.battery_v < a.parameters.get("BATT_LOW_VOLT") or self._ekf_acted
            or self._fault.is_lost or self._is_resisting
        )
        return self._due_s if watching else math.inf

    def heard(self, sender: tuple[int, int]) -> None:
        """A heartbeat; that of SYSID_MYGCS counts, from any component."""
        if sender[0] != self._a.parameters.flag("SYSID_MYGCS"):
            return
        self._gcs_heard_s = self._a.t_s
        if self._gcs_acted:
            self._gcs_acted = False
            self._a.announce(mav.MAV_SEVERITY_INFO, "GCS Failsafe Cleared")

    def update(self) -> None:
        """Look at what may be lost."""
        a = self._a
        if a.t_s < self._due_s - 1e-9:
            return
        self._due_s = a.t_s + _CHECK_S
        self._watch_gcs()
        self._watch_battery()
        self._watch_ekf()

    # ------------------------------------------------------------------------------------------ position
    @property
    def gps_lost(self) -> bool:
        """Whether there is no fix."""
        return self._fault.is_lost

    @property
    def _is_resisting(self) -> bool:
        return self._fault.is_resisted and self._a.t_s - self._fault_s < JUMP_OVER_S + 1.0

    def set_gps(self, fault: GpsFault) -> None:
        """Break or mend the position."""
        self._fault, self._fault_s = fault, self._a.t_s
        self._due_s = self._a.t_s
        if not fault.is_resisted:
            self._take_position()

    def _take_position(self) -> None:
        self._a.vehicle.set_position_error(self._fault.east_m, self._fault.north_m)

    @property
    def ekf_flags(self) -> int:
        """EKF_STATUS_REPORT.flags of a boat whose EKF was ready."""
        age_s = self._a.t_s - self._fault_s
        if self._fault.is_lost:
            if age_s >= LOST_STOPPED_S:
                return 0xA7
            return 0x8027 if age_s >= LOST_FAILSAFE_S else 0x833F
        return 0x33F | (GLITCH_FLAG if self._is_resisting and age_s >= GLITCH_SEEN_S else 0)

    def _watch_ekf(self) -> None:
        a, age_s = self._a, self._a.t_s - self._fault_s
        bad = self._fault.is_lost and age_s >= LOST_FAILSAFE_S - 1e-9
        if self._fault.is_resisted:
            if age_s >= JUMP_TAKEN_S - 1e-9:
                self._take_position()
            bad = bad or JUMP_FAILSAFE_S - 1e-9 <= age_s < JUMP_OVER_S
        if bad and not self._ekf_acted:
            self._ekf_acted = True
            a.announce(mav.MAV_SEVERITY_CRITICAL, "EKF variance")
            a.announce(mav.MAV_SEVERITY_CRITICAL, "EKF failsafe")
            if a.is_armed and a.parameters.flag("FS_EKF_ACTION") and a.helm.mode in POSITION_MODES:
                a.helm.set_mode(Mode.HOLD)
        elif self._ekf_acted and not bad:
            self._ekf_acted = False
            a.announce(mav.MAV_SEVERITY_CRITICAL, "EKF failsafe cleared")

    def _watch_gcs(self) -> None:
        a = self._a
        get = a.parameters.flag
        if self._gcs_heard_s is None or not get("FS_GCS_ENABLE") or self._gcs_acted:
            return
        wait_s = a.parameters.get("FS_GCS_TIMEOUT") + a.parameters.get("FS_TIMEOUT")
        if a.t_s - self._gcs_heard_s < wait_s - 1e-9:
            return
        self._gcs_acted = True
        # measured: with FS_THR_ENABLE the radio check acts, under its own name and by its own rule
        by_radio = get("FS_THR_ENABLE")
        a.announce(mav.MAV_SEVERITY_WARNING, "Radio Failsafe" if by_radio else "GCS Failsafe")
        goes_on = get("FS_THR_ENABLE") == 2 if by_radio else get("FS_GCS_ENABLE") == 2
        if a.helm.mode is Mode.AUTO and goes_on:
            a.announce(mav.MAV_SEVERITY_WARNING, "Failsafe - Continuing Auto Mode")
        elif a.is_armed:
            self._act(get("FS_ACTION"))

    def _watch_battery(self) -> None:
        a = self._a
        if not 0.0 < a.battery_v < a.parameters.get("BATT_LOW_VOLT"):
            self._battery_since_s = None
            return
        if self._battery_since_s is None:
            self._battery_since_s = a.t_s
        if not self._battery_acted and a.t_s - self._battery_since_s >= a.parameters.get("BATT_LOW_TIMER"):
            self._battery_acted = True
            a.announce(mav.MAV_SEVERITY_WARNING, f"Battery 1 is low {a.battery_v:.2f}V used 0 mAh")
            if a.is_armed:
                self._act(a.parameters.flag("BATT_FS_LOW_ACT"))

    def _act(self, action: int) -> None:
        helm = self._a.helm
        if action in {1, 3, 4} and helm.set_mode(Mode.RTL):
            return
        if action in {1, 2, 3, 4}:
            helm.set_mode(Mode.HOLD)
        elif action == 5:
            self._a.disarm()
            self._a.ports.after_ack()

    def watch_fence(self) -> None:
        """Compare the position with the fence: avoidance near it, action when a breach begins."""
        a = self._a
        if not a.has_origin:
            return
        get, fence = a.parameters.get, a.fence
        clearance = fence.clearance_m(
            a.vehicle.position, a.home_en, a.parameters.flag("FENCE_TYPE"), get("FENCE_RADIUS")
        )
        begins = fence.judge(clearance, a.boot_ms)
        margin = get("FENCE_MARGIN")
        reach = margin + get("WP_SPEED") / max(get("PSC_POS_P"), 0.01)
        avoiding = a.parameters.flag("AVOID_ENABLE") & 1 and not fence.is_breached and a.is_armed
        fence.is_limiting = bool(avoiding) and clearance <= reach
        a.vehicle.avoid(near=fence.is_limiting, ease=fence.is_limiting and clearance <= margin)
        if begins and a.is_armed:
            self._fence_breached()

    def _fence_breached(self) -> None:
        """A breach began: change mode by FENCE_ACTION, and leave ten seconds to whoever steers then."""
        a = self._a
        if a.t_s < self._recovery_until_s:
            return
        action = a.parameters.flag("FENCE_ACTION")
        if action == 0:
            return
        self._recovery_until_s = a.t_s + 10.0
        self._act({1: 1, 2: 2, 3: 3, 4: 4}.get(action, 2))
        a.announce(mav.MAV_SEVERITY_INFO, "Manual recovery started")
