"""Arming: what speaks against it, and what follows from it."""

from __future__ import annotations

from pymavlink.dialects.v20 import ardupilotmega as mav

from companion.messages import Mode
from sitl.autopilot.pilot.core import INTERNAL_ERROR, Core
from sitl.autopilot.pilot.ekf import Ekf
from sitl.autopilot.pilot.fence import Fence
from sitl.autopilot.pilot.helm import Helm
from sitl.autopilot.pilot.modes import POSITION_MODES


class Arming:
    """Arms and disarms; both speak behind the acknowledgement."""

    def __init__(self, core: Core, helm: Helm, fence: Fence, ekf: Ekf) -> None:
        self._core = core
        self._helm = helm
        self._fence = fence
        self._ekf = ekf
        self.is_refused = False   # by a check of the autopilot's that knows why

    def arm(self, *, force: bool) -> bool:
        """Arm; False, with the reasons announced, when refused."""
        core = self._core
        if core.is_armed:
            return True
        reasons = [] if force else self._reasons()
        for reason in reasons:
            core.voice.announce_after_ack(mav.MAV_SEVERITY_CRITICAL, f"Arm: {reason}")
        if reasons:
            return False
        core.set_armed(armed=True)
        self._helm.armed()
        core.voice.announce_after_ack(mav.MAV_SEVERITY_INFO, "Throttle armed")
        return True

    def _reasons(self) -> list[str]:
        core, mode = self._core, self._helm.mode
        reasons = ["Hardware safety switch"] if self.is_refused else []
        if core.internal_errors:
            reasons.append(INTERNAL_ERROR)
        if core.parameters.flag("SAIL_ENABLE") and not core.parameters.flag("WNDVN_TYPE"):
            reasons.append("Sailing enabled with no WindVane")
        if not self._ekf.is_ready and mode is not Mode.MANUAL:
            reasons.append("Accels inconsistent")
            if mode in POSITION_MODES:
                reasons.append("AHRS: waiting for home")
        if self._fence.is_enabled and self._fence.is_breached:
            reasons.append("Vehicle breaching Polygon fence")
        return reasons

    def disarm(self) -> None:
        """Disarm; outside AUTO this forgets the mission's index."""
        if self._core.is_armed:
            self._core.set_armed(armed=False)
            if self._helm.mode is not Mode.AUTO:
                self._helm.mission.reset()
            self._core.voice.announce_after_ack(mav.MAV_SEVERITY_INFO, "Throttle disarmed")
