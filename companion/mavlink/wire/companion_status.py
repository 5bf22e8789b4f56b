"""The companion's status on the air: a ``CompanionStatus`` in messages that cross a telemetry radio. Pure.

ArduPilot forwards what the companion sends to its other links. Two forms go out:

- TUNNEL, broadcast: the whole value packed into 70 bytes and its words, for ``companion status``;
- WIND_COV and NAMED_VALUE_FLOATs ``co_twd co_tws co_sig co_psafe co_tack co_xt``: the wind with its uncertainty and the
  most wanted figures, for any ground station's plots and the autopilot's log. They take turns. A slow computer adds
  ``co_plan``, how long plans take there.

Sent every 2 s this is under 110 bytes/s, heartbeat not counted. ``StatusReader`` joins both forms again, so a router
that forwards only well-known messages still lets the main figures through.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Mapping
from dataclasses import dataclass, replace

from pymavlink.dialects.v20 import ardupilotmega as wire

from companion.geo.angles import wrap_two_pi
from companion.mavlink.wire.codec import e7, geo_point
from companion.mavlink.wire.frames import Message
from companion.messages import AutopilotStatus, CompanionStatus, TrafficStatus, VehicleState
from companion.safety import number_of

# TUNNEL payload types from 32768 on are free for private use; ours is read by nobody else.
PAYLOAD_TYPE = 0xC05A
VERSION = 3
COMPANION_COMPONENT = 191
MAX_PAYLOAD_BYTES = 128
# Version, time [0.1 s], four distances [m] and the risk, lat and lon [deg x 1e7]; then 16 bits each: angles [0.01 deg],
# speeds [cm/s], seconds, counts, battery [10 mV], traffic [bytes/s], an order's age [10 s], current; then goals and the
# lengths of three words.
_PACK = struct.Struct("<BIfffffii" + "H" * 16 + "BBBBB")
_NONE16 = 0xFFFF
_NONE8 = 0xFF
_STATE_BYTES, _CODE_BYTES = 24, 16
FLOATS = ("co_twd", "co_tws", "co_sig", "co_psafe", "co_tack", "co_xt")
PREFIX = "co_"  # figures of the table (``companion.figures``) are sent beside the wind by names that begin so
SLOW = "co_plan"  # of a slow computer: nine plans of ten take so long [s]; sent beside the wind, not packed
# From here on a part that was not heard again is old [s]: four turns of the plain messages.
STALE_S = 35.0


def _u16(value: float | None, scale: float = 1.0) -> int:
    return _NONE16 if value is None else max(0, min(_NONE16 - 1, round(value * scale)))


def _u8(value: int | None) -> int:
    return _NONE8 if value is None else max(0, min(_NONE8 - 1, value))


def _f32(value: float | None) -> float:
    return math.nan if value is None else max(-3e38, min(3e38, value))


_CUT = b"..."  # a sentence that goes on


def _scaled(value: int, scale: float = 1.0) -> float | None:
    return None if value == _NONE16 else value / scale


def _count(value: int, none: int = _NONE16) -> int | None:
    return None if value == none else value


def _float(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _centidegrees(angle_rad: float | None) -> int:
    return _NONE16 if angle_rad is None else round(math.degrees(wrap_two_pi(angle_rad)) * 100.0) % 36000


def pack_status(status: CompanionStatus) -> bytes:
    """Return the status as the payload of a TUNNEL, at most 128 bytes; words are cut to what fits."""
    lat_e7, lon_e7 = e7(status.position) if status.position else (0, 0)
    state = status.state.encode("ascii", "replace")[:_STATE_BYTES]
    code = status.alert_code.encode("ascii", "replace")[:_CODE_BYTES]
    order = status.order.encode("ascii", "replace")[:_CODE_BYTES]
    room = MAX_PAYLOAD_BYTES - _PACK.size - len(state) - len(code) - len(order)
    text = status.alert_text.encode("ascii", "replace")
    if len(text) > room:
        kept = text[: max(0, room - len(_CUT)) + 1].rpartition(b" ")[0]  # at a word: of "12.8 m" 1 m is another figure
        text = kept.rstrip(b" ,;:") + _CUT[:room]
    head = _PACK.pack(
        VERSION,
        int(max(0.0, status.t_s) * 10.0) & 0xFFFFFFFF,
        _f32(status.waypoint_distance_m),
        _f32(status.goal_distance_m),
        _f32(status.cross_track_m),
        _f32(status.clearance_m),
        _f32(status.promised_risk),
        lat_e7,
        lon_e7,
        _centidegrees(status.twd_from_rad),
        _u16(None if status.twd_sigma_rad is None else math.degrees(status.twd_sigma_rad), 100.0),
        _u16(status.tws_mps, 100.0),
        _u16(status.tws_sigma_mps, 100.0),
        _u16(status.next_tack_s),
        _u16(status.plan_id),
        _u16(status.plan_age_s),
        _u16(status.replans),
        _u16(status.tacks),
        _u16(status.battery_v, 100.0),
        _u16(status.waypoint_seq),
        _u16(status.waypoint_count),
        _u16(status.bytes_out_per_s),
        _u16(status.order_age_s, 0.1),
        _centidegrees(status.current_set_rad),
        _u16(status.current_drift_mps, 100.0),
        _u8(status.goal_index),
        _u8(status.goal_count),
        len(state),
        len(code),
        len(order),
    )
    return head + state + code + order + text


def unpack_status(payload: bytes, t_s: float | None = None) -> CompanionStatus:
    """Return the status in a TUNNEL payload; ``t_s`` replaces the sender's time.

    Raises:
        ValueError: it is not one of ours, is of another version, or is torn.
    """
    if len(payload) < _PACK.size or payload[0] != VERSION:
        raise ValueError(f"status payload of {len(payload)} bytes, version {payload[0] if payload else None}")
    (
        _,
        tenths,
        waypoint_m,
        goal_m,
        cross_m,
        clearance_m,
        risk,
        lat_e7,
        lon_e7,
        twd,
        sigma,
        tws,
        tws_sigma,
        tack,
        plan,
        age,
        replans,
        tacks,
        battery,
        seq,
        count,
        traffic,
        order_age,
        current_set,
        drift,
        goal,
        goals,
        state_end,
        code_size,
        order_size,
    ) = _PACK.unpack_from(payload)
    words = payload[_PACK.size :]
    code_end = state_end + code_size
    order_end = code_end + order_size
    if order_end > len(words):
        raise ValueError("status payload is torn")
    sigma_deg = _scaled(sigma, 100.0)
    return CompanionStatus(
        t_s=tenths / 10.0 if t_s is None else t_s,
        state=words[:state_end].decode("ascii", "replace"),
        goal_index=_count(goal, _NONE8),
        goal_count=_count(goals, _NONE8),
        waypoint_seq=_count(seq),
        waypoint_count=_count(count),
        waypoint_distance_m=_float(waypoint_m),
        goal_distance_m=_float(goal_m),
        cross_track_m=_float(cross_m),
        clearance_m=_float(clearance_m),
        promised_risk=_float(risk),
        position=geo_point(lat_e7, lon_e7),
        twd_from_rad=None if twd == _NONE16 else math.radians(twd / 100.0),
        twd_sigma_rad=None if sigma_deg is None else math.radians(sigma_deg),
        current_set_rad=None if current_set == _NONE16 else math.radians(current_set / 100.0),
        current_drift_mps=_scaled(drift, 100.0),
        tws_mps=_scaled(tws, 100.0),
        tws_sigma_mps=_scaled(tws_sigma, 100.0),
        next_tack_s=_scaled(tack),
        plan_id=_count(plan),
        plan_age_s=_scaled(age),
        replans=_count(replans),
        tacks=_count(tacks),
        battery_v=_scaled(battery, 100.0),
        bytes_out_per_s=_scaled(traffic),
        alert_code=words[state_end:code_end].decode("ascii", "replace"),
        order=words[code_end:order_end].decode("ascii", "replace"),
        order_age_s=_scaled(order_age, 0.1),
        alert_text=words[order_end:].decode("ascii", "replace"),
    )


def status_messages(status: CompanionStatus, boot_s: float, turn: int) -> list[Message]:
    """Return what to send now: the packed value, and the part of the plain messages whose ``turn`` it is.

    ``boot_s`` is the autopilot's boot time [s], which plain messages are stamped with.
    """
    payload = pack_status(status)
    messages = [
        wire.MAVLink_tunnel_message(0, 0, PAYLOAD_TYPE, len(payload), list(payload.ljust(MAX_PAYLOAD_BYTES, b"\x00")))
    ]
    if status.traffic is not None and turn % 2 == 0:
        seen = pack_traffic(status.traffic)
        messages.append(
            wire.MAVLink_tunnel_message(
                0, 0, TRAFFIC_PAYLOAD_TYPE, len(seen), list(seen.ljust(MAX_PAYLOAD_BYTES, b"\x00"))
            )
        )
    turn %= 4
    if turn == 3:
        wind = wind_cov(status, boot_s)
        slow = [] if status.plan_answer_s is None else [_named(boot_s, SLOW, status.plan_answer_s)]
        figures = [_named(boot_s, name, value) for name, value in status.figures]
        return [*messages, *([] if wind is None else [wind]), *slow, *figures]
    values = named_values(status)
    for name in FLOATS[2 * turn : 2 * turn + 2]:
        value = values[name]
        if value is not None:
            messages.append(_named(boot_s, name, value))
    return messages


def _named(boot_s: float, name: str, value: float) -> Message:
    return wire.MAVLink_named_value_float_message(round(boot_s * 1e3) & 0xFFFFFFFF, name.encode("ascii"), value)


def named_values(status: CompanionStatus) -> dict[str, float | None]:
    """Return the figures of the NAMED_VALUE_FLOATs: degrees, m/s, probability, s, m."""
    return {
        "co_twd": None if status.twd_from_rad is None else math.degrees(wrap_two_pi(status.twd_from_rad)),
        "co_tws": status.tws_mps,
        "co_sig": None if status.twd_sigma_rad is None else math.degrees(status.twd_sigma_rad),
        "co_psafe": None if status.promised_risk is None else 1.0 - status.promised_risk,
        "co_tack": status.next_tack_s,
        "co_xt": status.cross_track_m,
    }


def wind_cov(status: CompanionStatus, boot_s: float) -> Message | None:
    """Return WIND_COV: the motion of the air, its variability along and its uncertainty across the wind [m/s]."""
    if status.twd_from_rad is None or status.tws_mps is None:
        return None
    north = -status.tws_mps * math.cos(status.twd_from_rad)
    east = -status.tws_mps * math.sin(status.twd_from_rad)
    along = status.tws_sigma_mps if status.tws_sigma_mps is not None else math.nan
    across = status.tws_mps * status.twd_sigma_rad if status.twd_sigma_rad is not None else math.nan
    return wire.MAVLink_wind_cov_message(
        round(boot_s * 1e6), north, east, math.nan, along, math.nan, math.nan, across, math.nan
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class StatusReport:
    """What the shore knows: the status, and the age of each of its parts [s] by name (status, wind, co_...)."""

    status: CompanionStatus
    age_s: Mapping[str, float]
    has_packed: bool

    @property
    def newest_age_s(self) -> float:
        """Age of the part heard last [s]."""
        return min(self.age_s.values())


class StatusReader:
    """Joins the messages of a companion (component 191) into reports. Never raises."""

    def __init__(self) -> None:
        self.bad = 0
        self._packed: CompanionStatus | None = None
        self._plain = CompanionStatus(t_s=0.0, state="")
        self._traffic: TrafficStatus | None = None
        self._plan_answer_s: float | None = None
        self._figures: dict[str, float] = {}
        self._heard_s: dict[str, float] = {}

    def take(self, t_s: float, message: Message) -> bool:
        """Take any message; return whether it told something of a companion."""
        if message.get_srcComponent() != COMPANION_COMPONENT:
            return False
        kind = message.get_type()
        try:
            if kind == "TUNNEL" and message.payload_type == PAYLOAD_TYPE:
                self._packed = unpack_status(bytes(message.payload[: message.payload_length]), t_s)
                self._heard_s["status"] = t_s
            elif kind == "TUNNEL" and message.payload_type == TRAFFIC_PAYLOAD_TYPE:
                self._traffic = unpack_traffic(bytes(message.payload[: message.payload_length]))
                self._heard_s["traffic"] = t_s
            elif kind == "WIND_COV":
                self._take_wind(t_s, message)
            elif kind == "NAMED_VALUE_FLOAT" and message.name == SLOW:
                self._plan_answer_s = _float(float(message.value))
                self._heard_s[SLOW] = t_s
            elif kind == "NAMED_VALUE_FLOAT" and message.name in FLOATS:
                self._take_float(t_s, message.name, float(message.value))
            elif kind == "NAMED_VALUE_FLOAT" and message.name.startswith(PREFIX) and math.isfinite(message.value):
                self._figures[message.name] = float(message.value)
                self._heard_s[message.name] = t_s
            else:
                return False
        except (ValueError, TypeError):
            self.bad += 1
            return False
        return True

    def report(self, t_s: float) -> StatusReport | None:
        """Return what is known at ``t_s``; None when no companion was heard."""
        if not self._heard_s:
            return None
        age_s = {name: t_s - heard_s for name, heard_s in sorted(self._heard_s.items())}
        has_packed = self._packed is not None and age_s["status"] <= STALE_S
        status = self._packed if self._packed is not None and has_packed else self._plain
        traffic = self._traffic if age_s.get("traffic", math.inf) <= STALE_S else None
        answer_s = self._plan_answer_s if age_s.get(SLOW, math.inf) <= STALE_S else None
        return StatusReport(
            status=replace(
                status,
                traffic=traffic,
                plan_answer_s=answer_s,
                figures=tuple((name, value) for name, value in self._figures.items() if age_s[name] <= STALE_S),
            ),
            age_s=age_s,
            has_packed=has_packed,
        )

    def _take_wind(self, t_s: float, message: Message) -> None:
        north, east = float(message.wind_x), float(message.wind_y)
        tws = math.hypot(north, east)
        across, along = float(message.horiz_accuracy), float(message.var_horiz)
        self._plain = replace(
            self._plain,
            t_s=t_s,
            twd_from_rad=wrap_two_pi(math.atan2(-east, -north)),
            tws_mps=tws,
            twd_sigma_rad=across / tws if math.isfinite(across) and tws > 0.1 else None,
            tws_sigma_mps=_float(along),
        )
        self._heard_s["wind"] = t_s

    def _take_float(self, t_s: float, name: str, value: float) -> None:
        changes: dict[str, float] = {
            "co_twd": {"twd_from_rad": math.radians(value)},
            "co_tws": {"tws_mps": value},
            "co_sig": {"twd_sigma_rad": math.radians(value)},
            "co_psafe": {"promised_risk": 1.0 - value},
            "co_tack": {"next_tack_s": value},
            "co_xt": {"cross_track_m": value},
        }[name]
        self._plain = replace(self._plain, t_s=t_s, **changes)  # type: ignore[arg-type]
        self._heard_s[name] = t_s


# What the companion sees of other vessels, on the air: a TUNNEL of its own beside the status. Pure.
#
# It goes out every other time with the status and only where vessels or feeds are: at most 35 bytes/s more.

TRAFFIC_PAYLOAD_TYPE = 0xC05B
TRAFFIC_VERSION = 1
# Version, feeds, silent feeds, shared MMSIs, clock jumps; vessels, refused, silence [s], TCPA [s], bearing [0.01 deg];
# range and CPA [m], the two risks. The words follow: alarm, role, rule, name.
_TRAFFIC_PACK = struct.Struct("<BBBBBHHHHHffff")
_MARK = "\x1f"
_WORDS = 4


def _byte(value: int) -> int:
    return max(0, min(255, value))


def pack_traffic(status: TrafficStatus) -> bytes:
    """Return the payload of a TUNNEL, at most 128 bytes; the name is cut to what fits."""
    bearing = status.bearing_rad
    head = _TRAFFIC_PACK.pack(
        TRAFFIC_VERSION,
        _byte(status.feeds),
        _byte(status.silent_feeds),
        _byte(status.shared_mmsi),
        _byte(status.clock_jumps),
        _u16(status.vessels),
        _u16(status.refused),
        _u16(status.silence_s),
        _u16(status.tcpa_s),
        _NONE16 if bearing is None else round(math.degrees(wrap_two_pi(bearing)) * 100.0) % 36000,
        _f32(status.range_m),
        _f32(status.cpa_m),
        _f32(status.promised_risk),
        _f32(status.path_risk),
    )
    words = _MARK.join(w.replace(_MARK, " ") for w in (status.alarm, status.role, status.rule, status.name))
    return head + words.encode("ascii", "replace")[: MAX_PAYLOAD_BYTES - _TRAFFIC_PACK.size]


def unpack_traffic(payload: bytes) -> TrafficStatus:
    """Return what is in a TUNNEL payload.

    Raises:
        ValueError: it is not one of ours, is of another version, or is torn.
    """
    if len(payload) < _TRAFFIC_PACK.size or payload[0] != TRAFFIC_VERSION:
        raise ValueError(f"traffic payload of {len(payload)} bytes, version {payload[0] if payload else None}")
    (_, feeds, silent, shared, jumps, vessels, refused, silence, tcpa, bearing, range_m, cpa_m, promised, path) = (
        _TRAFFIC_PACK.unpack_from(payload)
    )
    words = payload[_TRAFFIC_PACK.size :].decode("ascii", "replace").split(_MARK)
    if len(words) != _WORDS:
        raise ValueError("traffic payload is torn")
    return TrafficStatus(
        vessels=vessels,
        refused=refused,
        feeds=feeds,
        silent_feeds=silent,
        shared_mmsi=shared,
        clock_jumps=jumps,
        silence_s=_scaled(silence),
        tcpa_s=_scaled(tcpa),
        range_m=_float(range_m),
        cpa_m=_float(cpa_m),
        promised_risk=_float(promised),
        path_risk=_float(path),
        bearing_rad=None if bearing == _NONE16 else math.radians(bearing / 100.0),
        alarm=words[0],
        role=words[1],
        rule=words[2],
        name=words[3],
    )


# HIGH_LATENCY2 of the companion: the boat and the companion's view of it in one message of 42 bytes. Pure.
#
# Sent as component 191 after MAV_CMD_CONTROL_HIGH_LATENCY, for a program that passes it on over a narrow link. A
# station may take it for the vehicle's own (QGroundControl looks at no component id): so type, mode and arming are the
# autopilot's, and custom0 is its base mode, where ArduPilot has it too. custom1 and custom2 are ours.

CONTROL_COMMAND = int(wire.MAV_CMD_CONTROL_HIGH_LATENCY)
HIGH_LATENCY_S = 5.0  # as the protocol has it (mavlink.io, High Latency Protocol)
NO_TEMPERATURE = -128
FIX_3D = 3


def high_latency2(
    status: CompanionStatus, vehicle: VehicleState | None, autopilot: AutopilotStatus | None, watchdog: str = ""
) -> Message | None:
    """Return the message, None while the position or the mode is not known: it has no number for that.

    custom1 is the plan's delta_s [%], -1 without a plan; custom2 the number of the worst watchdog that is raised.
    """
    if vehicle is None or autopilot is None or autopilot.mode is None:
        return None
    lat_e7, lon_e7 = e7(vehicle.position)
    base_mode = wire.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED | (wire.MAV_MODE_FLAG_SAFETY_ARMED if autopilot.is_armed else 0)
    remaining, risk = autopilot.battery_remaining, status.promised_risk
    return wire.MAVLink_high_latency2_message(
        timestamp=round(vehicle.boot_s * 1e3) & 0xFFFFFFFF,
        type=autopilot.vehicle_type or wire.MAV_TYPE_SURFACE_BOAT,
        autopilot=wire.MAV_AUTOPILOT_ARDUPILOTMEGA,
        custom_mode=int(autopilot.mode),
        latitude=lat_e7,
        longitude=lon_e7,
        altitude=0,
        target_altitude=0,
        heading=_half_degrees(vehicle.heading_rad),
        target_heading=_half_degrees(autopilot.target_bearing_rad),
        target_distance=_saturated16(status.waypoint_distance_m, 0.1),
        throttle=0,
        airspeed=0,
        airspeed_sp=0,
        groundspeed=_saturated8(vehicle.speed_mps, 5.0),
        windspeed=_saturated8(status.tws_mps, 5.0),
        wind_heading=_half_degrees(status.twd_from_rad),
        eph=0,
        epv=0,
        temperature_air=NO_TEMPERATURE,
        climb_rate=0,
        battery=-1 if remaining is None else round(100.0 * remaining),
        wp_num=_saturated16(status.waypoint_seq),
        failure_flags=_failures(autopilot),
        custom0=base_mode - 256 if base_mode > 127 else base_mode,
        custom1=-1 if risk is None else round(100.0 * (1.0 - risk)),
        custom2=number_of(watchdog),
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


def _saturated8(value: float | None, scale: float) -> int:
    return 0 if value is None else max(0, min(255, round(value * scale)))


def _saturated16(value: float | None, scale: float = 1.0) -> int:
    return 0 if value is None else max(0, min(0xFFFF, round(value * scale)))
