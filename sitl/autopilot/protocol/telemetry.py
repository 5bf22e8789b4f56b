"""What the autopilot tells: one small function for each message that it streams."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as mav

from companion.geo import MPS_PER_KNOT
from companion.geo.angles import wrap_two_pi
from companion.messages import GeoPoint, Mode
from sitl.autopilot.boat import kernel as k
from sitl.autopilot.link import MavlinkPort
from sitl.autopilot.pilot.core import INVALID_RESULT, POSITION_MODES
from sitl.autopilot.pilot.pilot import Pilot
from sitl.world import LEAST_M, MOST_M

LIST_MAX = 25
TIMEOUT_S = 600.0
RESEND_S = 30.0


@dataclass(frozen=True, slots=True, kw_only=True)
class AisVessel:
    """One position report as a receiver decoded it. Unknown is None.

    ``turn_rate_dps`` in degrees per second, positive to starboard; ``cog_deg`` and ``heading_deg`` from true north.
    Names and dimensions are not here: the real one never gets them through (two-part sentences are lost).
    """

    mmsi: int
    position: GeoPoint
    cog_deg: float | None = None
    sog_mps: float | None = None
    heading_deg: float | None = None
    turn_rate_dps: float | None = None
    nav_status: int = 15
    is_class_b: bool = False


@dataclass(slots=True)
class _Entry:
    vessel: AisVessel
    heard_s: float
    sent_s: dict[int, float]


class AisList:
    """Vessels heard, sent one a message to each port that asked for AIS_VESSEL."""

    def __init__(self) -> None:
        self._entries: dict[int, _Entry] = {}
        self._turn = 0

    def hear(self, vessel: AisVessel, t_s: float) -> None:
        """Take a report. Class B is not decoded by the real one and leaves no trace."""
        if vessel.is_class_b:
            return
        if vessel.mmsi not in self._entries and len(self._entries) >= LIST_MAX:
            oldest = min(self._entries, key=lambda m: self._entries[m].heard_s)
            del self._entries[oldest]
        self._entries[vessel.mmsi] = _Entry(vessel, t_s, {})

    def next_message(self, link: int, t_s: float) -> Any:
        """Return the next vessel that is new or was not sent for 30 s on this port, or None."""
        for mmsi in [m for m, e in self._entries.items() if t_s - e.heard_s > TIMEOUT_S]:
            del self._entries[mmsi]
        keys = list(self._entries)
        for n in range(len(keys)):
            entry = self._entries[keys[(self._turn + n) % len(keys)]]
            if t_s - entry.sent_s.get(link, -RESEND_S) >= RESEND_S - 1e-9:
                self._turn = (self._turn + n + 1) % len(keys)
                entry.sent_s[link] = t_s
                return self._message(entry, t_s)
        return None

    @staticmethod
    def _message(entry: _Entry, t_s: float) -> Any:
        v = entry.vessel
        flags = mav.AIS_FLAGS_POSITION_ACCURACY
        if v.cog_deg is not None:
            flags |= mav.AIS_FLAGS_VALID_COG
        if v.sog_mps is not None:
            flags |= mav.AIS_FLAGS_VALID_VELOCITY
        # measured on the real one: speed in 0.1 knot though the field is in cm/s; turn rate in 0.1 deg/s and
        # without sign though it is in 0.01 deg/s; "not available" is 121 there, without the flag
        speed = 1023 if v.sog_mps is None else round(v.sog_mps / MPS_PER_KNOT * 10.0)
        if v.turn_rate_dps is None:
            turn = 121
        else:
            turn = min(120, round(abs(v.turn_rate_dps) * 10.0))
            flags |= mav.AIS_FLAGS_VALID_TURN_RATE
        return mav.MAVLink_ais_vessel_message(
            v.mmsi,
            round(v.position.lat_deg * 1e7),
            round(v.position.lon_deg * 1e7),
            36000 if v.cog_deg is None else round(v.cog_deg * 100.0),
            51100 if v.heading_deg is None else round(v.heading_deg * 100.0),
            speed,
            turn,
            v.nav_status,
            0,
            0,
            0,
            0,
            0,
            b"",
            b"",
            min(65535, int(t_s - entry.heard_s)),
            flags,
        )


# 2025-02-01T00:00:00Z: simulated calendars start at one moment, so that a voyage repeats bit for bit.
_SENSORS = 322034735
_FENCE_BIT = 0x100000
_SENSORS_ENABLED = 304185391
_SENSORS_HEALTHY = 322011439
_CAPABILITIES = 0xF1EF
_VERSION, _VERSION_BY_L1 = 0x04070000, 0x04020300
_NAN = (math.nan,) * 4


def heartbeat(p: Pilot) -> Any:
    """Return HEARTBEAT."""
    armed = mav.MAV_MODE_FLAG_SAFETY_ARMED if p.core.is_armed else 0
    kind = p.core.config.vehicle_type
    if p.core.boot_s < 2.3:
        return mav.MAVLink_heartbeat_message(kind, 3, 65, Mode.INITIALISING, mav.MAV_STATE_CALIBRATING, 3)
    base = 65 | armed | (8 if p.helm.mode in POSITION_MODES else 0)
    if p.failsafe.is_active:
        status = mav.MAV_STATE_CRITICAL
    else:
        status = mav.MAV_STATE_STANDBY if p.helm.mode is Mode.HOLD else mav.MAV_STATE_ACTIVE
    return mav.MAVLink_heartbeat_message(kind, 3, base, p.helm.mode, status, 3)


def _sys_status(p: Pilot) -> Any:
    fence = p.fence
    present = (_SENSORS & ~_FENCE_BIT) | (_FENCE_BIT if fence.is_present else 0)
    enabled = (_SENSORS_ENABLED & ~_FENCE_BIT) | (_FENCE_BIT if fence.is_enabled else 0)
    healthy = (_SENSORS_HEALTHY & ~_FENCE_BIT) | (0 if fence.is_breached else _FENCE_BIT)
    if p.ekf.gps_lost:
        healthy &= ~mav.MAV_SYS_STATUS_SENSOR_GPS
    if p.failsafe.battery_level:
        healthy &= ~mav.MAV_SYS_STATUS_SENSOR_BATTERY
    if p.radio.has_failed:
        healthy &= ~mav.MAV_SYS_STATUS_SENSOR_RC_RECEIVER
    percent = p.core.battery_percent
    return mav.MAVLink_sys_status_message(
        present,
        enabled,
        healthy,
        0,
        round(p.core.battery_v * 1000),
        0,
        percent,
        0,
        0,
        0,
        INVALID_RESULT >> 16 if p.core.internal_errors else 0,
        0,
        p.core.internal_errors,
    )


def _attitude(p: Pilot) -> Any:
    heading_rad, rate_radps = p.core.vehicle.heading, float(p.core.vehicle.state[k.S_RATE])
    return mav.MAVLink_attitude_message(p.core.boot_ms, p.core.roll_rad, 0.0, heading_rad, 0.0, 0.0, rate_radps)


def _velocity_en_mps(p: Pilot) -> tuple[float, float]:
    """Return the velocity over ground as the filter believes it."""
    (east, north), s = p.ekf.velocity_error_en_mps, p.core.vehicle.state
    return float(s[k.S_VE]) + east, float(s[k.S_VN]) + north


def _global_position(p: Pilot) -> Any:
    east, north = _velocity_en_mps(p)
    heading = round(math.degrees(wrap_two_pi(p.core.vehicle.heading)) * 100) % 36000
    lat, lon = p.core.latlon_e7 if p.core.has_origin else (0, 0)
    return mav.MAVLink_global_position_int_message(
        p.core.boot_ms, lat, lon, 0, 0, round(north * 100), round(east * 100), 0, heading
    )


def _local_position(p: Pilot) -> Any:
    if not p.core.has_origin:
        return None
    (ve, vn), (east, north), (east_0, north_0) = _velocity_en_mps(p), p.core.vehicle.position, p.core.origin_en
    return mav.MAVLink_local_position_ned_message(p.core.boot_ms, north - north_0, east - east_0, 0.0, vn, ve, 0.0)


def _vfr_hud(p: Pilot) -> Any:
    speed = math.hypot(*_velocity_en_mps(p))
    heading = int(math.degrees(wrap_two_pi(p.core.vehicle.heading)))
    return mav.MAVLink_vfr_hud_message(speed, speed, heading, 0, 0.0, 0.0)


def _gps(p: Pilot) -> Any:
    if p.core.boot_s < 9.95 or p.ekf.gps_lost:
        return mav.MAVLink_gps_raw_int_message(
            p.core.boot_us, 0 if p.core.boot_s < 9.95 else 1, 0, 0, 0, 65535, 65535, 0, 0, 0, 0, 0, 0, 0, 0, 0
        )
    east, north = _velocity_en_mps(p)
    speed = math.hypot(east, north)
    course = round(math.degrees(wrap_two_pi(math.atan2(east, north))) * 100) % 36000
    lat, lon = p.core.latlon_e7
    return mav.MAVLink_gps_raw_int_message(
        p.core.boot_us, 6, lat, lon, 0, 121, 200, round(speed * 100), course, 10, 0, 300, 300, 0, 0, 0
    )


SOUNDER_CM = (round(100.0 * LEAST_M), round(100.0 * MOST_M))


def _sounding(p: Pilot) -> Any:
    """DISTANCE_SENSOR of a sounder that looks down, None of one that is silent."""
    depth_m = p.core.sounding_m
    if depth_m is None or not p.core.config.hears_sounder:
        return None
    return mav.MAVLink_distance_sensor_message(
        p.core.boot_ms,
        *SOUNDER_CM,
        max(0, min(SOUNDER_CM[1], round(100.0 * depth_m))),
        mav.MAV_DISTANCE_SENSOR_ULTRASOUND,
        1,
        mav.MAV_SENSOR_ROTATION_PITCH_270,
        255,
    )


def _gps2(p: Pilot) -> Any:
    if not p.ekf.has_second or p.core.boot_s < 9.95:
        return None
    lat, lon = p.core.chart.to_e7(p.core.vehicle.true_position)
    return mav.MAVLink_gps2_raw_message(
        p.core.boot_us, 6, lat, lon, 0, 121, 200, 0, 65535, 10, 0, 0, 0, 0, 300, 300, 0, 0
    )


def _system_time(p: Pilot) -> Any:
    unix_us = round((p.core.config.epoch_s + p.core.t_s) * 1e6) if p.core.boot_s >= 9.95 else 0
    return mav.MAVLink_system_time_message(unix_us, p.core.boot_ms)


def _wind(p: Pilot) -> Any:
    (twd, tws), (east, north) = p.core.vehicle.true_wind, p.ekf.velocity_error_en_mps
    if (east, north) != (0.0, 0.0):  # it is the apparent wind less the velocity that is believed
        east, north = tws * math.sin(twd) - east, tws * math.cos(twd) - north
        twd, tws = wrap_two_pi(math.atan2(east, north)), math.hypot(east, north)
    return mav.MAVLink_wind_message(math.degrees(twd), tws, 0.0)


def _nav(p: Pilot) -> Any:
    if p.helm.mode not in POSITION_MODES:
        return None
    s = p.core.vehicle.state
    steer = s[k.S_STEER]
    if steer not in {k.STEER_LEG, k.STEER_LOITER}:
        yaw = round(math.degrees(float(s[k.S_NAV_YAW])))
        return mav.MAVLink_nav_controller_output_message(0.0, 0.0, yaw, yaw, 0, 0.0, 0.0, 0.0)
    xtrack = float(s[k.S_XTRACK]) if steer == k.STEER_LEG else 0.0
    nav = math.degrees(float(s[k.S_NAV_YAW])) if s[k.S_INDIRECT] else 0.0
    return mav.MAVLink_nav_controller_output_message(
        0.0, 0.0, int(nav), int(math.degrees(float(s[k.S_BEARING]))), min(65535, int(s[k.S_DIST])), 0.0, 0.0, xtrack
    )


def _target(p: Pilot) -> Any:
    if p.helm.mode not in POSITION_MODES or p.core.vehicle.state[k.S_STEER] != k.STEER_LEG:
        return None
    lat, lon = p.core.chart.to_e7(p.core.vehicle.destination)
    return mav.MAVLink_position_target_global_int_message(
        p.core.boot_ms, 0, 65016, lat, lon, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    )


def _servos(p: Pilot) -> Any:
    s = p.core.vehicle.state
    rudder = round(1500 + 500 * float(s[k.S_RUDDER]))
    sail = round(1000 + 1000 * float(s[k.S_SAIL]) / (math.pi / 2.0))
    return mav.MAVLink_servo_output_raw_message(
        p.core.boot_us & 0xFFFFFFFF, 0, rudder, 0, 1500, sail, 1500, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0
    )


def _ekf(p: Pilot) -> Any:
    if p.core.boot_s < 3.5:
        return None
    return mav.MAVLink_ekf_status_report_message(p.ekf.flags, 0.005, 0.002, 0.015, 0.0015, 0.0, 0.0)


def _mission_current(p: Pilot) -> Any:
    m = p.helm.mission
    return mav.MAVLink_mission_current_message(
        m.current_seq, m.total, m.mav_state, 1 if p.helm.mode is Mode.AUTO else 0
    )


def _home(p: Pilot) -> Any:
    if p.core.home_en is None:
        return None
    lat, lon = p.core.chart.to_e7(p.core.home_en)
    north, east = p.core.home_en[1] - p.core.origin_en[1], p.core.home_en[0] - p.core.origin_en[0]
    return mav.MAVLink_home_position_message(lat, lon, 0, north, east, 0.0, _NAN, 0.0, 0.0, 0.0, p.core.boot_us)


def _origin(p: Pilot) -> Any:
    if not p.core.has_origin:
        return None
    lat, lon = p.core.chart.to_e7(p.core.origin_en)
    return mav.MAVLink_gps_global_origin_message(lat, lon, 0, p.core.boot_us)


def _battery(p: Pilot) -> Any:
    volts = [round(p.core.battery_v * 1000), *([65535] * 9)]
    percent = p.core.battery_percent
    return mav.MAVLink_battery_status_message(0, 0, 0, 32767, volts, 0, 0, 0, percent, 0, 1)


def _fence_status(p: Pilot) -> Any:
    return p.fence.status_message() if p.fence.is_enabled else None


def _simstate(p: Pilot) -> Any:
    s = p.core.vehicle.state
    lat, lon = p.core.chart.to_e7(p.core.vehicle.true_position)
    return mav.MAVLink_simstate_message(
        0.0, 0.0, float(s[k.S_YAW]), 0.0, 0.0, -9.80665, 0.0, 0.0, float(s[k.S_RATE]), lat, lon
    )


def _high_latency2(p: Pilot) -> Any:
    s = p.core.vehicle.state
    twd, tws = p.core.vehicle.true_wind
    lat, lon = p.core.latlon_e7
    heading = round(math.degrees(wrap_two_pi(p.core.vehicle.heading)) / 2) % 180
    speed = round(math.hypot(float(s[k.S_VE]), float(s[k.S_VN])) * 5)
    return mav.MAVLink_high_latency2_message(
        p.core.boot_ms,
        11,
        3,
        int(p.helm.mode),
        lat,
        lon,
        0,
        0,
        heading,
        0,
        min(65535, int(s[k.S_DIST] / 10)),
        0,
        0,
        min(255, speed),
        0,
        min(255, round(tws * 5)),
        round(math.degrees(twd) / 2) % 180,
        24,
        40,
        20,
        0,
        p.core.battery_percent,
        p.helm.mission.current_seq,
        0,
        0,
        0,
        0,
    )


def _quaternion(p: Pilot) -> Any:
    s = p.core.vehicle.state
    half = p.core.vehicle.heading / 2.0
    return mav.MAVLink_attitude_quaternion_message(
        p.core.boot_ms, math.cos(half), 0.0, 0.0, math.sin(half), 0.0, 0.0, float(s[k.S_RATE])
    )


def autopilot_version(p: Pilot) -> Any:
    """AUTOPILOT_VERSION of 4.7, or of 4.2 where the boat steers by L1."""
    custom = b"simulate"
    capabilities = _CAPABILITIES if p.core.config.has_ftp else _CAPABILITIES & ~mav.MAV_PROTOCOL_CAPABILITY_FTP
    version = _VERSION if p.core.parameters.entry("NAVL1_PERIOD") is None else _VERSION_BY_L1
    return mav.MAVLink_autopilot_version_message(
        capabilities, version, 0, 0, 0, custom, custom, custom, 0, 0, 0, p.core.config.uid.ljust(18, b"\x00")
    )


def named_floats(p: Pilot) -> tuple[Any, ...]:
    """Return the NAMED_VALUE_FLOATs that go with a WIND: the apparent wind, and what a script tells of sensors."""
    awa, aws = p.core.vehicle.apparent
    told = [(b"AppWndSpd", aws), (b"AppWndDir", math.degrees(awa))]
    told += [(name.encode("ascii"), value) for name, value in p.core.sensors.items()]
    return tuple(mav.MAVLink_named_value_float_message(p.core.boot_ms, name, value) for name, value in told)


def _rc_channels(p: Pilot) -> Any:
    channels = p.radio.channels_us
    return mav.MAVLink_rc_channels_message(p.core.boot_ms, len(channels), *channels, *([0] * (18 - len(channels))), 255)


# What is said once a second and never changes is made once.
_AHRS = mav.MAVLink_ahrs_message(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
_POWER = mav.MAVLink_power_status_message(5000, 0, 0)
_MEMORY = mav.MAVLink_meminfo_message(0, 65535, 524288)

BUILDERS: dict[int, Callable[[Pilot], Any]] = {
    # These only fill their place: no instrument of the simulated boat is behind them.
    mav.MAVLINK_MSG_ID_AHRS: lambda _: _AHRS,
    mav.MAVLINK_MSG_ID_POWER_STATUS: lambda _: _POWER,
    mav.MAVLINK_MSG_ID_MEMINFO: lambda _: _MEMORY,
    mav.MAVLINK_MSG_ID_RAW_IMU: lambda p: mav.MAVLink_raw_imu_message(
        p.core.boot_us, 0, 0, -1001, 0, 0, 0, 198, 0, 445, 0, 2762
    ),
    mav.MAVLINK_MSG_ID_SCALED_IMU2: lambda p: mav.MAVLink_scaled_imu2_message(
        p.core.boot_ms, 0, 0, -1001, 0, 0, 0, 198, 0, 445, 2762
    ),
    mav.MAVLINK_MSG_ID_SCALED_IMU3: lambda p: mav.MAVLink_scaled_imu3_message(
        p.core.boot_ms, 0, 0, 0, 0, 0, 0, 198, 0, 445, 0
    ),
    mav.MAVLINK_MSG_ID_SCALED_PRESSURE: lambda p: mav.MAVLink_scaled_pressure_message(
        p.core.boot_ms, 1013.25, 0.0, 3269
    ),
    mav.MAVLINK_MSG_ID_SCALED_PRESSURE2: lambda p: mav.MAVLink_scaled_pressure2_message(
        p.core.boot_ms, 1013.25, 0.0, 3269
    ),
    mav.MAVLINK_MSG_ID_RC_CHANNELS_SCALED: lambda p: mav.MAVLink_rc_channels_scaled_message(
        p.core.boot_ms, 0, *([0] * 8), 255
    ),
    mav.MAVLINK_MSG_ID_VIBRATION: lambda p: mav.MAVLink_vibration_message(p.core.boot_us, 0.003, 0.003, 0.003, 0, 0, 0),
    mav.MAVLINK_MSG_ID_EXTENDED_SYS_STATE: lambda _: mav.MAVLink_extended_sys_state_message(
        0, mav.MAV_LANDED_STATE_ON_GROUND
    ),
    # What there is.
    mav.MAVLINK_MSG_ID_AHRS2: lambda p: (
        mav.MAVLink_ahrs2_message(
            0.0, 0.0, p.core.vehicle.heading, 0.0, *(p.core.latlon_e7 if p.core.has_origin else (0, 0))
        )
        if p.core.boot_s > 4.2
        else None
    ),
    mav.MAVLINK_MSG_ID_RPM: lambda p: mav.MAVLink_rpm_message(p.core.vehicle.apparent[1], -1.0),
    mav.MAVLINK_MSG_ID_HEARTBEAT: heartbeat,
    mav.MAVLINK_MSG_ID_SYS_STATUS: _sys_status,
    mav.MAVLINK_MSG_ID_ATTITUDE: _attitude,
    mav.MAVLINK_MSG_ID_ATTITUDE_QUATERNION: _quaternion,
    mav.MAVLINK_MSG_ID_GLOBAL_POSITION_INT: _global_position,
    mav.MAVLINK_MSG_ID_LOCAL_POSITION_NED: _local_position,
    mav.MAVLINK_MSG_ID_VFR_HUD: _vfr_hud,
    mav.MAVLINK_MSG_ID_GPS_RAW_INT: _gps,
    mav.MAVLINK_MSG_ID_GPS2_RAW: _gps2,
    mav.MAVLINK_MSG_ID_DISTANCE_SENSOR: _sounding,
    mav.MAVLINK_MSG_ID_SYSTEM_TIME: _system_time,
    mav.MAVLINK_MSG_ID_WIND: _wind,
    mav.MAVLINK_MSG_ID_NAV_CONTROLLER_OUTPUT: _nav,
    mav.MAVLINK_MSG_ID_POSITION_TARGET_GLOBAL_INT: _target,
    mav.MAVLINK_MSG_ID_SERVO_OUTPUT_RAW: _servos,
    mav.MAVLINK_MSG_ID_EKF_STATUS_REPORT: _ekf,
    mav.MAVLINK_MSG_ID_MISSION_CURRENT: _mission_current,
    mav.MAVLINK_MSG_ID_HOME_POSITION: _home,
    mav.MAVLINK_MSG_ID_GPS_GLOBAL_ORIGIN: _origin,
    mav.MAVLINK_MSG_ID_BATTERY_STATUS: _battery,
    mav.MAVLINK_MSG_ID_FENCE_STATUS: _fence_status,
    mav.MAVLINK_MSG_ID_RC_CHANNELS: _rc_channels,
    mav.MAVLINK_MSG_ID_SIMSTATE: _simstate,
    mav.MAVLINK_MSG_ID_HIGH_LATENCY2: _high_latency2,
    mav.MAVLINK_MSG_ID_AUTOPILOT_VERSION: autopilot_version,
}


def send_once(p: Pilot, link: MavlinkPort, msgid: int) -> bool:
    """Send a message now; False if there is none of that kind, or none at this moment."""
    builder = BUILDERS.get(msgid)
    message = builder(p) if builder is not None else None
    if message is None:
        return False
    link.send(message)
    return True
