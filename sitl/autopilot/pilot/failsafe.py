"""Failsafes: the links to the shore, the battery, a knock-down, the position, and what a breached fence does.

The order of things follows ArduRover's ``failsafe_trigger``: the radio is looked at in every loop, the ground
station ten times a second, both act through one place, and whoever looks next acts for the other, under its own
name.
"""

from __future__ import annotations

import contextlib
import math
from collections.abc import Iterator

from pymavlink.dialects.v20 import ardupilotmega as mav

from companion.messages import Mode
from sitl.autopilot.config import GpsFault
from sitl.autopilot.pilot.core import INTERNAL_ERROR, POSITION_MODES, Core
from sitl.autopilot.pilot.fence import FenceMonitor
from sitl.autopilot.pilot.helm import ModeController

READY_S = 42.0  # boot to "EKF3 IMU0 is using GPS" on the real one
# Measured on the real one, with FS_EKF_THRESH 0.8: a jump of 30 m, and a receiver switched off.
GLITCH_FLAG = 0x8000
GLITCH_SEEN_S, JUMP_TAKEN_S, JUMP_FAILSAFE_S, JUMP_OVER_S = 1.5, 3.8, 4.8, 11.0
LOST_FAILSAFE_S, LOST_STOPPED_S = 8.3, 15.3


class Ekf:
    """Believes a position, or resists it for a while; its failsafe acts once and never restores a mode."""

    def __init__(self, core: Core, helm: ModeController) -> None:
        self._core = core
        self._helm = helm
        self._fault = GpsFault()
        self._fault_s = -math.inf
        self.has_acted = False
        self.has_second = False  # another receiver, whose truth the filter does not take

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


class Arming:
    """Arms and disarms; both speak behind the acknowledgement."""

    def __init__(self, core: Core, helm: ModeController, fence: FenceMonitor, ekf: Ekf) -> None:
        self._core = core
        self._helm = helm
        self._fence = fence
        self._ekf = ekf
        self.is_refused = False  # by a check of the autopilot's that knows why

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


# Sticks at rest and the mode switch in its highest place, as SITL's 16 channels [us].
CHANNELS_US = (1500, 1500, 1500, 1500, 1800, 1000, 1000, 1800, *([1500] * 8))
# The middle of each of the mode switch's six places [us]: MODE1 to MODE6.
SWITCH_US = (1165, 1295, 1425, 1555, 1685, 1800)
SILENT_S = 0.5  # without pulses for longer than this the receiver has lost its transmitter


class Radio:
    """What the receiver hears. A receiver that hears nothing holds its last values."""

    def __init__(self, core: Core, helm: ModeController) -> None:
        self._core = core
        self._helm = helm
        self.channels_us: list[int] = list(CHANNELS_US)
        self._lost_s = math.inf

    @property
    def is_switched_off(self) -> bool:
        """Whether the transmitter is silent, noticed or not."""
        return self._lost_s < math.inf

    @property
    def has_failed(self) -> bool:
        """Whether the autopilot counts the radio as lost."""
        return self._core.t_s - self._lost_s > SILENT_S

    def switch(self, *, is_on: bool) -> None:
        """Switch the transmitter on or off, or carry it out of range."""
        if is_on:
            self._lost_s = math.inf
        elif not self.is_switched_off:
            self._lost_s = self._core.t_s

    def select(self, mode: Mode) -> bool:
        """Move the mode switch to ``mode``; False when the transmitter is off or no place of the switch has it."""
        get = self._core.parameters.flag
        places = [n for n in range(6) if get(f"MODE{n + 1}") == mode]
        channel = get("MODE_CH")
        if self.is_switched_off or not places or not 1 <= channel <= len(self.channels_us):
            return False
        self.channels_us[channel - 1] = SWITCH_US[places[0]]
        return self._helm.set_mode(int(mode))


_CHECK_S = 0.1
RADIO, STATION = 1, 2
_NAMES = {RADIO: "Radio", STATION: "GCS"}
_GOES_ON = {RADIO: "FS_THR_ENABLE", STATION: "FS_GCS_ENABLE"}  # 2: the mission goes on in AUTO
_RTL, _SMART = 1, 3
_BATTERY = (("low", "BATT_LOW_VOLT", "BATT_FS_LOW_ACT"), ("critical", "BATT_CRT_VOLT", "BATT_FS_CRT_ACT"))
# Of the battery's actions the first in this list that was taken stays: a later one that stands behind it is not taken.
_BATTERY_ORDER = (5, 2, 6, 1, 4, 3, 0)
GIVE_UP_M = 100.0  # AC_FENCE_GIVE_UP_DISTANCE: farther outside than this a breach means HOLD, whatever is set
RECOVERY_S = 10.0  # AC_FENCE_MANUAL_RECOVERY_TIME_MIN


class Failsafe:
    """Watches; acts once when something begins, says when it has ended, never restores a mode."""

    def __init__(
        self, core: Core, helm: ModeController, arming: Arming, fence: FenceMonitor, radio: Radio, ekf: Ekf
    ) -> None:
        self._core = core
        self._helm = helm
        self._arming = arming
        self._fence = fence
        self._radio = radio
        self._ekf = ekf
        self._gcs_heard_s: float | None = None
        self._lost = self._acted = 0  # bits of the links
        self._lost_since_s = 0.0
        self._battery_since_s: dict[int, float] = {}
        self.battery_level = 0  # that was said: 1 low, 2 critical; it never falls
        self._battery_action: int | None = None
        self._due_s = 0.0
        self._revision = -1  # of the parameters that these two are taken from
        self._watches_station = False
        self._low_v = 0.0
        self._recovery_until_s = -math.inf
        self._acting = ""
        self.stopped_by = ""  # "crash" or "action": that changed the mode or disarmed, and nobody has since

    @property
    def is_active(self) -> bool:
        """Whether a failsafe has acted and not cleared, as HEARTBEAT tells it: of links and position only."""
        return bool(self._acted) or self._ekf.has_acted

    @property
    def due_s(self) -> float:
        """When to look again."""
        core, parameters = self._core, self._core.parameters
        if parameters.revision != self._revision:  # they are asked for at every loop and change once in a voyage
            self._revision = parameters.revision
            self._watches_station = bool(parameters.flag("FS_GCS_ENABLE"))
            self._low_v = max(parameters.get("BATT_LOW_VOLT"), parameters.get("BATT_CRT_VOLT"))
        watching = (
            (self._gcs_heard_s is not None and self._watches_station)
            or self._radio.is_switched_off
            or self._lost
            or 0.0 < core.battery_v < self._low_v
            or core.roll_rad != 0.0
            or self._ekf.is_watching
        )
        return self._due_s if watching else math.inf

    def heard(self, sender: tuple[int, int]) -> None:
        """A heartbeat; that of SYSID_MYGCS counts, from any component."""
        if sender[0] == self._core.parameters.flag("SYSID_MYGCS"):
            self._gcs_heard_s = self._core.t_s

    def update(self) -> None:
        """Look at what may be lost."""
        core = self._core
        if core.t_s < self._due_s - 1e-9:
            return
        self._due_s = core.t_s + _CHECK_S
        self._watch_links()
        self._watch_battery()
        self._watch_roll()
        self._ekf.update()

    def set_gps(self, fault: GpsFault) -> None:
        """Break or mend the position."""
        self._due_s = self._core.t_s
        self._ekf.set_gps(fault)

    # ----------------------------------------------------------------------------------- links to the shore
    def _watch_links(self) -> None:
        core = self._core
        get = core.parameters.flag
        if get("FS_THR_ENABLE"):
            self._trigger(RADIO, is_lost=self._radio.has_failed)
        if self._gcs_heard_s is not None and get("FS_GCS_ENABLE"):
            self._trigger(STATION, is_lost=core.t_s - self._gcs_heard_s >= core.parameters.get("FS_GCS_TIMEOUT") - 1e-9)

    def _trigger(self, link: int, *, is_lost: bool) -> None:
        core, before = self._core, self._lost
        self._lost = before | link if is_lost else before & ~link
        if not before and self._lost:
            self._lost_since_s = core.t_s
        if self._acted and not self._lost:
            core.voice.announce(mav.MAV_SEVERITY_INFO, f"{_NAMES[link]} Failsafe Cleared")
        self._acted &= self._lost
        waited = core.t_s - self._lost_since_s >= core.parameters.get("FS_TIMEOUT") - 1e-9
        if self._acted or not self._lost or not waited or self._helm.mode in {Mode.RTL, Mode.HOLD}:
            return
        self._acted = self._lost
        core.voice.announce(mav.MAV_SEVERITY_WARNING, f"{_NAMES[link]} Failsafe")
        if self._helm.mode is Mode.AUTO and core.parameters.flag(_GOES_ON[link]) == 2:
            core.voice.announce(mav.MAV_SEVERITY_WARNING, "Failsafe - Continuing Auto Mode")
        else:
            self._act(core.parameters.flag("FS_ACTION"))

    # --------------------------------------------------------------------------------------------- battery
    def _watch_battery(self) -> None:
        core = self._core
        if not core.is_armed:
            return
        level = 0
        get = core.parameters.get
        for n, (_, limit, _) in enumerate(_BATTERY, start=1):
            if not 0.0 < core.battery_v < get(limit):
                self._battery_since_s.pop(n, None)
            elif core.t_s - self._battery_since_s.setdefault(n, core.t_s) >= get("BATT_LOW_TIMER") - 1e-9:
                level = n
        if level > self.battery_level:
            self.battery_level = level
            kind, _, action = _BATTERY[level - 1]
            core.voice.announce(mav.MAV_SEVERITY_WARNING, f"Battery 1 is {kind} {core.battery_v:.2f}V used 0 mAh")
            self._act_for_battery(core.parameters.flag(action))

    def _act_for_battery(self, action: int) -> None:
        before = self._battery_action
        if before is not None and _BATTERY_ORDER.index(action) > _BATTERY_ORDER.index(before):
            return
        self._battery_action = action
        self._act(action)

    # ------------------------------------------------------------------------------------------ knock-down
    def _watch_roll(self) -> None:
        core = self._core
        check, angle_deg = core.parameters.flag("FS_CRASH_CHECK"), core.parameters.flag("CRASH_ANGLE")
        if not check or not angle_deg or not core.is_armed or self._helm.mode not in POSITION_MODES:
            return
        if abs(core.roll_rad) > math.radians(angle_deg):
            core.voice.announce(mav.MAV_SEVERITY_EMERGENCY, "Crash: Going to HOLD")
            with self._own_doing("crash"):
                self._helm.set_mode(Mode.HOLD)
                if check == 2:
                    self._disarm()

    @contextlib.contextmanager
    def _own_doing(self, what: str) -> Iterator[None]:
        """What the mode changes to in here is a failsafe's doing."""
        self._acting = what
        try:
            yield
        finally:
            self._acting = ""

    def _act(self, action: int) -> None:
        with self._own_doing("action"):
            self._take(action)

    def _take(self, action: int) -> None:
        helm = self._helm
        if action in {_RTL, _SMART, 4} and helm.set_mode(Mode.SMART_RTL if action == 4 else Mode.RTL):
            return
        if action == 6 and helm.set_mode(Mode.LOITER):
            return
        if action in {1, 2, 3, 4, 6}:
            helm.set_mode(Mode.HOLD)
        elif action == 5:
            self._disarm()

    def _disarm(self) -> None:
        self.stopped_by = self._acting
        self._arming.disarm()
        self._core.voice.after_ack()

    # ----------------------------------------------------------------------------------------------- fence
    def watch_fence(self) -> None:
        """Look at the fence; when a breach begins, change mode by FENCE_ACTION."""
        outside_m = self._fence.update()
        if outside_m is None or not self._core.is_armed or self._core.t_s < self._recovery_until_s:
            return
        action = self._core.parameters.flag("FENCE_ACTION")
        if action != 0:
            self._act(action if outside_m <= GIVE_UP_M else 2)

    def mode_changed(self) -> None:
        """Leave ten seconds to whoever steers now, if the mode was changed outside the fence, by anybody."""
        self.stopped_by = self._acting
        if self._fence.is_breached:
            self._recovery_until_s = self._core.t_s + RECOVERY_S
            self._core.voice.announce(mav.MAV_SEVERITY_INFO, "Manual recovery started")
