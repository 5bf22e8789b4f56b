"""Folds the autopilot's messages into the values that the companion works with. Pure.

``VehicleAssembler.take`` never raises: what cannot be believed is left out, as is what is older than what was used.
A change of mode or arming is a fact when two of three heartbeats show it, or one behind the acknowledgement of a
command that makes it; a position that leaps is one when the next ones stay there; a breach of the fence when it is told
twice.
"""

from __future__ import annotations

import math
from collections import deque
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as wire

from companion.frozen import changed
from companion.geo import DEGREE_M
from companion.mavlink.wire import codec
from companion.mavlink.wire.boot_time import since_boot_s
from companion.mavlink.wire.frames import Message
from companion.mavlink.wire.sounder import Sounder
from companion.messages import (
    AisReport,
    ApparentWind,
    AutopilotStatus,
    GeoPoint,
    MissionState,
    StatusText,
    VehicleState,
    WindSample,
)
from companion.safety import SENSORS

# Positions that a boat cannot have come to: held back until the next ones agree. Pure.

# A fix farther off than a boat sails in the time since the last one, and this, is a leap.
LEAP_M = 20.0
LEAP_MPS = 8.0  # no boat of ours sails faster
# It is believed when so many in a row agree, or two that are this far apart in time [s].
LEAP_FIXES = 3
LEAP_S = 2.0
# After a longer silence any place is possible [s].
MEMORY_S = 10.0


def leap_m(distance_m: float, elapsed_s: float) -> float:
    """Return how much farther two fixes are apart than a boat can have sailed [m]."""
    return max(0.0, distance_m - LEAP_MPS * max(elapsed_s, 0.0))


class FixFilter:
    """The last position that was believed, and those that leapt away from it."""

    def __init__(self) -> None:
        self._last: VehicleState | None = None
        self._held: list[VehicleState] = []

    def take(self, fix: VehicleState) -> bool:
        """Return whether ``fix`` is believed."""
        if self._last is None or fix.boot_s - self._last.boot_s > MEMORY_S or _agree(self._last, fix):
            self._believe(fix)
            return True
        if self._held and not _agree(self._held[-1], fix):
            self._held.clear()
        self._held.append(fix)
        if len(self._held) >= LEAP_FIXES or fix.boot_s - self._held[0].boot_s >= LEAP_S:
            self._believe(fix)
            return True
        return False

    def _believe(self, fix: VehicleState) -> None:
        self._last = fix
        self._held.clear()


def _agree(a: VehicleState, b: VehicleState) -> bool:
    return leap_m(_distance_m(a.position, b.position), b.boot_s - a.boot_s) < LEAP_M


def _distance_m(a: GeoPoint, b: GeoPoint) -> float:
    """Return the distance of two places [m], right to a percent where it matters here: below a kilometre."""
    north = b.lat_deg - a.lat_deg
    east = ((b.lon_deg - a.lon_deg + 180.0) % 360.0 - 180.0) * math.cos(math.radians(a.lat_deg))
    return DEGREE_M * math.hypot(north, east)


Value = VehicleState | AutopilotStatus | WindSample | ApparentWind | StatusText | AisReport

# A boot time that steps back by more than this is a reboot; by less, a late or repeated frame [s].
REBOOT_BACK_S = 5.0
# ATTITUDE older than this [boot s] is not joined to a position.
ATTITUDE_MAX_AGE_S = 1.5
# NAV_CONTROLLER_OUTPUT and FENCE_STATUS stop when they have nothing to say; then they are unknown after [s].
QUIET_S = 5.0
KNOWS_TIME_S = 1_577_836_800.0  # 2020: an autopilot that has no time yet tells less
# What tells of the status; an autopilot sends as many kinds again that tell nothing here.
_TELLING = frozenset(
    {
        "HEARTBEAT",
        "MISSION_CURRENT",
        "NAV_CONTROLLER_OUTPUT",
        "EKF_STATUS_REPORT",
        "GPS_RAW_INT",
        "GPS2_RAW",
        "SYS_STATUS",
        "RC_CHANNELS",
        "SERVO_OUTPUT_RAW",
        "HOME_POSITION",
        "SYSTEM_TIME",
        "NAMED_VALUE_FLOAT",
        "FENCE_STATUS",
        "DISTANCE_SENSOR",
        "WATER_DEPTH",
        "RANGEFINDER",
    }
)
_APPARENT = ("AppWndSpd", "AppWndDir")
# Heartbeats that say the same before a change is believed, of so many, none older than this [s].
BEATS_AGREE, BEATS_KEPT, BEATS_S = 2, 3, 3.5
# A command that changes mode or arming shows in a heartbeat within this time of its acknowledgement [s].
SHOWS_S = 3.0
_CHANGING = frozenset(
    {
        wire.MAV_CMD_DO_SET_MODE,
        wire.MAV_CMD_COMPONENT_ARM_DISARM,
        wire.MAV_CMD_MISSION_START,
        wire.MAV_CMD_NAV_RETURN_TO_LAUNCH,
        wire.MAV_CMD_NAV_LOITER_UNLIM,
    }
)


class VehicleAssembler:
    """One autopilot, from its messages to values; the caller passes messages of that system only."""

    def __init__(self) -> None:
        self.reboots = 0
        self._status: AutopilotStatus | None = None
        self._texts = codec.TextAssembler()
        self._boot_s: float | None = None
        self._boot_heard_s = 0.0
        self._forget()

    @property
    def status(self) -> AutopilotStatus | None:
        """The newest status, None before the first heartbeat."""
        return self._status

    @property
    def boot_s(self) -> float | None:
        """The newest boot time heard [s]."""
        return self._boot_s

    def _forget(self) -> None:
        """Forget what was true before a reboot."""
        self._beats: deque[tuple[float, tuple[int, int, bool]]] = deque(maxlen=BEATS_KEPT - 1)
        self._fact: tuple[int, int, bool] | None = None
        self._acknowledged_s: float | None = None
        self._fixes = FixFilter()
        self._attitude: codec.Attitude | None = None
        self._position_boot_s = -1.0
        self._apparent: dict[str, tuple[int, float]] = {}
        self._apparent_ms = -1
        self._nav_s: float | None = None
        self._fence_s: float | None = None
        self._gps2_s: float | None = None
        self._sounder = Sounder()
        self._sounded_s: float | None = None
        self._own_s = -math.inf  # when the companion's own sounder was heard
        self._faced_s: dict[bool, float] = {}  # when a sensor that looks down, or elsewhere, told a distance ...
        self._faces: set[bool] = set()  # ... and which of the two there are
        self._is_guessed = False  # the depth is a RANGEFINDER's, which does not say where it looks
        self._fenced_s = 0.0  # since when it tells of a fence without a gap
        self._fence_told = (False, -1)
        # Of each sensor: whether it was told beyond its entry, when, and what is believed.
        self._sensed: dict[str, tuple[bool | None, float, float | None]] = {}

    def take(self, t_s: float, message: Message) -> list[Value]:
        """Return the values that ``message``, heard at ``t_s`` [s], completes: none, one, or several texts.

        Texts that lost a chunk and have waited too long for it come first, with [...] for what is missing.
        """
        late = self._texts.expired(t_s) if self._texts.is_waiting else None
        values = self._completed(t_s, message)
        return [*late, *values] if late else values

    def _completed(self, t_s: float, message: Message) -> list[Value]:
        kind = message.get_type()
        try:
            if kind == "STATUSTEXT":
                return list(self._texts.take(t_s, message))
            if kind == "AIS_VESSEL":
                return [codec.ais_report(t_s, message)]
            if message.get_srcComponent() != codec.AUTOPILOT_COMPONENT:
                return []
            self._notice_boot(t_s, message)
            return self._take(t_s, kind, message)
        except (ValueError, OverflowError, TypeError):
            return []

    def _since_boot_s(self, t_s: float, boot_ms: int) -> float:
        return since_boot_s(boot_ms, None if self._boot_s is None else self._boot_s + t_s - self._boot_heard_s)

    def _notice_boot(self, t_s: float, message: Message) -> None:
        boot_ms = getattr(message, "time_boot_ms", None)
        if boot_ms is None or message.get_type() == "NAMED_VALUE_FLOAT":
            return
        boot_s = self._since_boot_s(t_s, boot_ms)
        if self._boot_s is not None and boot_s < self._boot_s - REBOOT_BACK_S:
            self.reboots += 1
            self._forget()
            self._status = None
            self._boot_s = None
        if self._boot_s is None or boot_s > self._boot_s:
            self._boot_s, self._boot_heard_s = boot_s, t_s

    def _take(self, t_s: float, kind: str, message: Message) -> list[Value]:
        if kind == "ATTITUDE":
            attitude = codec.attitude(message, self._since_boot_s(t_s, message.time_boot_ms))
            if self._attitude is not None and attitude.boot_s <= self._attitude.boot_s:
                return []
            self._attitude = attitude
            return []
        if kind == "GLOBAL_POSITION_INT":
            return self._position(t_s, message)
        if kind == "WIND":
            return [codec.wind_sample(t_s, message)]
        if kind == "NAMED_VALUE_FLOAT" and message.name not in SENSORS:
            return self._named(t_s, message)
        if kind == "COMMAND_ACK":
            if message.command in _CHANGING and message.result == wire.MAV_RESULT_ACCEPTED:
                self._acknowledged_s = t_s
            return []
        return self._fold_status(t_s, kind, message) if kind in _TELLING else []

    def _position(self, t_s: float, message: Message) -> list[Value]:
        boot_s = self._since_boot_s(t_s, message.time_boot_ms)
        if boot_s <= self._position_boot_s:
            return []
        attitude = self._attitude
        if attitude is not None and abs(boot_s - attitude.boot_s) > ATTITUDE_MAX_AGE_S:
            attitude = None
        state = codec.vehicle_state(t_s, boot_s, message, attitude)
        if state is not None and not self._fixes.take(state):
            return []
        self._position_boot_s = boot_s
        return [] if state is None else [state]

    def _believes_beat(self, t_s: float, message: Message) -> bool:
        """Return whether what a heartbeat says of type, mode and arming is a fact."""
        says = (int(message.type), int(message.custom_mode), codec.is_armed(message))
        recent = [what for at_s, what in self._beats if t_s - at_s <= BEATS_S]
        is_told = self._acknowledged_s is not None and t_s - self._acknowledged_s <= SHOWS_S
        believes = not recent or is_told or recent.count(says) + 1 >= BEATS_AGREE
        if believes and says != self._fact:
            self._fact, self._acknowledged_s = says, None  # one acknowledgement, one change
            self._beats.clear()
        self._beats.append((t_s, says))
        return believes

    def _named(self, t_s: float, message: Message) -> list[Value]:
        """Join the two halves of the apparent wind; every link's copies carry the same boot time."""
        if message.name not in _APPARENT:
            return []
        boot_ms = message.time_boot_ms
        if boot_ms <= self._apparent_ms and self._apparent_ms - boot_ms < REBOOT_BACK_S * 1e3:
            return []
        self._apparent[message.name] = (boot_ms, message.value)
        halves = [self._apparent.get(name) for name in _APPARENT]
        speed, angle = halves
        if speed is None or angle is None or speed[0] != angle[0]:
            return []
        self._apparent_ms = boot_ms
        return [codec.apparent_wind(t_s, speed[1], angle[1])]

    def _fold_status(self, t_s: float, kind: str, message: Message) -> list[Value]:
        if kind == "HEARTBEAT":
            if not codec.is_autopilot_heartbeat(message):
                return []
        elif self._status is None:
            return []  # a status begins with a heartbeat
        told = self._told(t_s, kind, message)
        if told is None:
            return []
        self._status = changed(
            self._status or AutopilotStatus(t_s=t_s), **{**self._quiet(t_s), **told}, t_s=t_s, boot_s=self._boot_s
        )
        return [self._status]

    def _told(self, t_s: float, kind: str, message: Message) -> dict[str, Any] | None:
        """Return what a message tells of the status, None: nothing."""
        if kind == "HEARTBEAT":
            now: dict[str, Any] = {"system_status": message.system_status}
            if self._believes_beat(t_s, message) or self._status is None:
                now |= {
                    "mode": codec.mode(message),
                    "is_armed": codec.is_armed(message),
                    "vehicle_type": int(message.type),
                }
            return now
        if kind == "MISSION_CURRENT":
            return {
                "mission_seq": message.seq,
                "mission_total": None if message.total == 0xFFFF else message.total,
                "mission_state": _mission_state(message.mission_state),
            }
        if kind == "NAV_CONTROLLER_OUTPUT":
            self._nav_s = t_s
            return {
                "waypoint_distance_m": codec.waypoint_distance_m(message),
                "target_bearing_rad": codec.target_bearing_rad(message),
                "cross_track_m": codec.cross_track_m(message),
            }
        if kind == "EKF_STATUS_REPORT":
            return {"ekf_ok": codec.ekf_ok(message)}
        if kind == "GPS_RAW_INT":
            return {"gps_fix": int(message.fix_type), "gps": codec.fix(message)}
        if kind == "GPS2_RAW":
            self._gps2_s = t_s
            return {"gps2": codec.fix(message)}
        if kind == "SYS_STATUS":
            volts, remaining = message.voltage_battery, message.battery_remaining
            return {
                "battery_v": None if volts == 0xFFFF else volts / 1e3,
                "battery_remaining": remaining / 100.0 if 0 <= remaining <= 100 else None,
                "battery_failed": codec.has_failed(message, wire.MAV_SYS_STATUS_SENSOR_BATTERY),
                "receiver_lost": codec.has_failed(message, wire.MAV_SYS_STATUS_SENSOR_RC_RECEIVER),
            }
        if kind == "RC_CHANNELS":
            return {"rc_us": codec.rc_us(message)}
        if kind == "SERVO_OUTPUT_RAW":
            return {"servo_us": codec.servo_us(message)} if message.port == 0 else None
        if kind == "HOME_POSITION":
            return {"home": codec.geo_point(message.latitude, message.longitude)}
        if kind == "SYSTEM_TIME":
            unix_s = message.time_unix_usec / 1e6
            boot_s = self._since_boot_s(t_s, message.time_boot_ms)
            return {"utc_at_boot_s": unix_s - boot_s} if unix_s > KNOWS_TIME_S else None
        if kind == "NAMED_VALUE_FLOAT":
            # Twice in a row, as the fence: nothing true would ever contradict one that was forged.
            return self._sensor(t_s, message.name, float(message.value))
        if kind in {"DISTANCE_SENSOR", "WATER_DEPTH", "RANGEFINDER"}:
            return self._sounding(t_s, kind, message)
        if kind == "FENCE_STATUS":
            # Two in a row that say the same: one alone may be damaged or forged.
            fence = bool(message.breach_status), int(message.breach_count)
            self._fenced_s = t_s if self._fence_s is None else self._fenced_s
            last, self._fence_told, self._fence_s = self._fence_told, fence, t_s
            # What is told for a moment, by whomever, is not missed afterwards.
            on: dict[str, Any] = {"fence_on": True} if t_s - self._fenced_s >= QUIET_S else {}
            return {
                **on,
                "fence_breached": fence[0] and last[0],
                **({"fence_breaches": fence[1]} if fence[1] == last[1] else {}),
            }
        return None

    def _quiet(self, t_s: float) -> dict[str, Any]:
        """Return what was told too long ago to be true of now."""
        old: dict[str, Any] = {}
        if self._nav_s is not None and t_s - self._nav_s > QUIET_S:
            self._nav_s = None
            old |= {"waypoint_distance_m": None, "target_bearing_rad": None, "cross_track_m": None}
        if self._fence_s is not None and t_s - self._fence_s > QUIET_S:
            self._fence_s = None
            old |= {"fence_breached": None, "fence_breaches": None}
            if self._status is not None and self._status.fence_on:
                old["fence_on"] = False
        if self._sounded_s is not None and t_s - self._sounded_s > QUIET_S:
            self._sounded_s = None
            old |= {"sounds": False, "depth_m": None, "depth_rate_mps": None}
        if self._gps2_s is not None and t_s - self._gps2_s > QUIET_S:
            self._gps2_s = None
            old |= {"gps2": None}
        if any(t_s - told_s > QUIET_S for _, told_s, _ in self._sensed.values()):
            self._sensed = {name: told for name, told in self._sensed.items() if t_s - told[1] <= QUIET_S}
            old |= {"sensors": self._believed()}
        return old

    def _sounding(self, t_s: float, kind: str, message: Message) -> dict[str, Any] | None:
        """Take what an instrument that looks down tells; the same ping may come in more than one of the messages.

        The others stand in for DISTANCE_SENSOR only where it never told of such an instrument: of one that has died
        they repeat the last distance. RANGEFINDER is the nearest of all that there are, wherever they look.
        """
        if kind == "DISTANCE_SENSOR":
            is_down = message.orientation == wire.MAV_SENSOR_ROTATION_PITCH_270
            if t_s - self._faced_s.get(is_down, -math.inf) <= QUIET_S:
                self._faces.add(is_down)  # two: one alone may be damaged or forged
            self._faced_s[is_down] = t_s
            if not is_down:
                return self._not_guessed() if False in self._faces else None
            ping_m, least_m, most_m = (
                cm / 100.0 for cm in (message.current_distance, message.min_distance, message.max_distance)
            )
        else:
            is_guess = kind == "RANGEFINDER"
            rivals = (True, False) if is_guess else (True,)
            if any(rival in self._faces or t_s - self._faced_s.get(rival, -math.inf) <= QUIET_S for rival in rivals):
                return None
            if not is_guess and not message.healthy:
                return None
            ping_m, least_m, most_m = float(message.distance), 0.0, math.inf
        if t_s - self._own_s <= QUIET_S:
            return None
        self._is_guessed = kind == "RANGEFINDER"
        return self._pinged(t_s, ping_m, least_m, most_m)

    def _not_guessed(self) -> dict[str, Any] | None:
        """Forget a depth that RANGEFINDER told before it was known that a sensor looks elsewhere: none is lost."""
        if not self._is_guessed:
            return None
        self._sounder, self._sounded_s, self._is_guessed = Sounder(), None, False
        return {"sounds": None, "depth_m": None, "depth_rate_mps": None}

    def sounded(self, t_s: float, ping_m: float | None, most_m: float) -> list[Value]:
        """Take a ping of a sounder that the companion hears itself, None without an echo.

        While there is one it counts alone. ``most_m``: it reaches no farther.
        """
        self._own_s, self._is_guessed = t_s, False
        if self._status is None:
            return []
        told = self._pinged(t_s, math.inf if ping_m is None else ping_m, 0.0, most_m)
        # Neither its age nor its clock is told anew: the autopilot has not been heard.
        self._status = changed(self._status, **told)
        return [self._status]

    def _pinged(self, t_s: float, ping_m: float, least_m: float, most_m: float) -> dict[str, Any]:
        self._sounded_s = t_s
        self._sounder.take(t_s, ping_m, least_m, most_m)
        return {"sounds": True, "depth_m": self._sounder.depth_m(t_s), "depth_rate_mps": self._sounder.rate_mps(t_s)}

    def _sensor(self, t_s: float, name: str, value: float) -> dict[str, Any] | None:
        """Take what a script tells: believed when this and the value before are on one side of the row's entry."""
        if not math.isfinite(value):
            return None
        dog, (was_beyond, _, believed) = SENSORS[name], self._sensed.get(name, (None, t_s, None))
        is_beyond = value >= dog.enter if dog.enter >= dog.exit else value <= dog.enter
        self._sensed[name] = is_beyond, t_s, value if is_beyond is was_beyond else believed
        return {"sensors": self._believed()}

    def _believed(self) -> tuple[tuple[str, float], ...]:
        return tuple(sorted((name, value) for name, (_, _, value) in self._sensed.items() if value is not None))


def _mission_state(value: int) -> MissionState:
    try:
        return MissionState(value)
    except ValueError:
        return MissionState.UNKNOWN
