"""HIGH_LATENCY2 of the companion: the boat and the companion's view of her in one message of 42 bytes. Pure.

Sent as component 191 after MAV_CMD_CONTROL_HIGH_LATENCY, for a program that passes it on over a narrow link. A station
may take it for the vehicle's own (QGroundControl looks at no component id): so type, mode and arming are the
autopilot's, and custom0 is its base mode, where ArduPilot has it too. custom1 and custom2 are ours.
"""

from __future__ import annotations

import math

from pymavlink.dialects.v20 import ardupilotmega as wire

from companion.geo.angles import wrap_two_pi
from companion.mavlink.wire.codec import e7
from companion.mavlink.wire.frames import Message
from companion.mavlink.wire.narrow import number_of
from companion.messages import AutopilotStatus, CompanionStatus, VehicleState

CONTROL_COMMAND = int(wire.MAV_CMD_CONTROL_HIGH_LATENCY)
HIGH_LATENCY_S = 5.0          # as the protocol has it (mavlink.io, High Latency Protocol)
NO_TEMPERATURE = -128
FIX_3D = 3


def high_latency2(
    status: CompanionStatus, vehicle: VehicleState | None, autopilot: AutopilotStatus | None, watchdog: str = "",
) -> Message | None:
    """Return the message, None while the position or the mode is not known: it has no number for that.

    custom1 is the plan's P(safe) [%], -1 without a plan; custom2 the number of the worst watchdog that is raised.
    """
    if vehicle is None or autopilot is None or autopilot.mode is None:
        return None
    lat_e7, lon_e7 = e7(vehicle.position)
    base_mode = wire.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED | (
        wire.MAV_MODE_FLAG_SAFETY_ARMED if autopilot.is_armed else 0)
    remaining, risk = autopilot.battery_remaining, status.promised_risk
    return wire.MAVLink_high_latency2_message(
        timestamp=round(vehicle.boot_s * 1e3) & 0xFFFFFFFF, type=autopilot.vehicle_type or wire.MAV_TYPE_SURFACE_BOAT,
        autopilot=wire.MAV_AUTOPILOT_ARDUPILOTMEGA, custom_mode=int(autopilot.mode), latitude=lat_e7, longitude=lon_e7,
        altitude=0, target_altitude=0, heading=_half_degrees(vehicle.heading_rad),
        target_heading=_half_degrees(autopilot.target_bearing_rad),
        target_distance=_u16(status.waypoint_distance_m, 0.1),
        throttle=0, airspeed=0, airspeed_sp=0, groundspeed=_u8(vehicle.speed_mps, 5.0),
        windspeed=_u8(status.tws_mps, 5.0), wind_heading=_half_degrees(status.twd_from_rad), eph=0, epv=0,
        temperature_air=NO_TEMPERATURE, climb_rate=0,
        battery=-1 if remaining is None else round(100.0 * remaining),
        wp_num=_u16(status.waypoint_seq), failure_flags=_failures(autopilot),
        custom0=base_mode - 256 if base_mode > 127 else base_mode,
        custom1=-1 if risk is None else round(100.0 * (1.0 - risk)), custom2=number_of(watchdog),
    )


def _failures(autopilot: AutopilotStatus) -> int:
    flags = 0
    if autopilot.gps_fix is not None and autopilot.gps_fix < FIX_3D:
        flags |= wire.HL_FAILURE_FLAG_GPS
    if not autopilot.ekf_ok:
        flags |= wire.HL_FAILURE_FLAG_ESTIMATOR
    if autopilot.battery_failed:
        flags |= wire.HL_FAILURE_FLAG_BATTERY
    if autopilot.receiver_lost:
        flags |= wire.HL_FAILURE_FLAG_RC_RECEIVER
    if autopilot.fence_breached:
        flags |= wire.HL_FAILURE_FLAG_GEOFENCE
    return flags


def _half_degrees(angle_rad: float | None) -> int:
    return 0 if angle_rad is None else round(math.degrees(wrap_two_pi(angle_rad)) / 2.0) % 180


def _u8(value: float | None, scale: float) -> int:
    return 0 if value is None else max(0, min(255, round(value * scale)))


def _u16(value: float | None, scale: float = 1.0) -> int:
    return 0 if value is None else max(0, min(0xFFFF, round(value * scale)))
