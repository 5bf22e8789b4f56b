"""Messages of the wire <-> values of ``companion.messages``. Pure, and the only place that knows the wire's units.

The wire speaks degrees x 1e7, centidegrees, cm/s, mm, knots and milliseconds; here they become radians and SI, or
come from them. Decoders return None where the autopilot says that it does not know, and raise ``ValueError`` when a
field is not a number or out of range; ``VehicleAssembler`` leaves those out and never raises.

Units and signs of ArduRover as recorded from it: WIND.direction is where the true wind comes from [deg, 0..360];
AppWndDir is positive to starboard [deg, ±180]; xtrack_error is positive when the boat is LEFT of its leg (ours is
the reverse); AIS_VESSEL of ArduPilot carries velocity in 0.1 kn though defined in cm/s, and a turn rate without
its sign.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from pymavlink.dialects.v20 import ardupilotmega as wire

from companion.geo import MPS_PER_KNOT
from companion.geo.angles import wrap_pi, wrap_two_pi
from companion.mavlink.wire.frames import Message
from companion.messages import (
    AisReport,
    ApparentWind,
    GeoPoint,
    MissionItem,
    MissionType,
    Mode,
    StatusText,
    VehicleState,
    WindSample,
)
from companion.words import one_line

AUTOPILOT_COMPONENT = 1
MAX_WIND_MPS = 100.0
MAX_SPEED_MPS = 50.0
# FLAGS of EKF_STATUS_REPORT that a position needs; the real one shows 0x33f when ready.
_EKF_NEEDED = wire.EKF_ATTITUDE | wire.EKF_VELOCITY_HORIZ | wire.EKF_POS_HORIZ_ABS
_EKF_FORBIDDEN = wire.EKF_CONST_POS_MODE | wire.EKF_UNINITIALIZED
_AIS_SPEED_UNKNOWN = 1023
_AIS_COURSE_UNKNOWN_CDEG = 36000
_AIS_STATUS_UNKNOWN = 15


# ------------------------------------------------------------------------------------- checked numbers
def number(value: object, low: float, high: float, name: str) -> float:
    """Return ``value`` as a float in low..high.

    Raises:
        ValueError: it is not a finite number in that range.
    """
    result = float(value)  # type: ignore[arg-type]
    if not low <= result <= high:  # false for NaN too
        raise ValueError(f"{name} is {result}, outside {low}..{high}")
    return result


def geo_point(lat_e7: int, lon_e7: int) -> GeoPoint | None:
    """Return the position, None for 0/0, which is how ArduPilot says that it has none."""
    if lat_e7 == 0 and lon_e7 == 0:
        return None
    return GeoPoint(
        lat_deg=number(lat_e7 / 1e7, -90.0, 90.0, "lat"), lon_deg=number(lon_e7 / 1e7, -180.0, 180.0, "lon")
    )


def e7(point: GeoPoint) -> tuple[int, int]:
    """Return latitude and longitude as the wire's integers [deg x 1e7]."""
    return round(point.lat_deg * 1e7), round(point.lon_deg * 1e7)


# --------------------------------------------------------------------------------------------- decoding
@dataclass(frozen=True, slots=True)
class Attitude:
    """ATTITUDE: boot time [s], roll, heading [rad], yaw rate [rad/s]."""

    boot_s: float
    roll_rad: float
    heading_rad: float
    yaw_rate_radps: float


def attitude(message: Message, boot_s: float) -> Attitude:
    """Decode ATTITUDE, of the boot time ``boot_s`` [s]."""
    turn = 2.0 * math.pi
    return Attitude(
        boot_s=boot_s,
        roll_rad=number(message.roll, -turn, turn, "roll"),
        heading_rad=wrap_two_pi(number(message.yaw, -turn, turn, "yaw")),
        yaw_rate_radps=number(message.yawspeed, -10.0 * turn, 10.0 * turn, "yawspeed"),
    )


def vehicle_state(t_s: float, boot_s: float, message: Message, attitude_now: Attitude | None) -> VehicleState | None:
    """Decode GLOBAL_POSITION_INT, heard at ``t_s`` and of the boot time ``boot_s`` [s].

    The heading is ATTITUDE's if there is one, else the message's own.
    None before the autopilot has a position or a heading.
    """
    position = geo_point(message.lat, message.lon)
    if attitude_now is not None:
        heading_rad = attitude_now.heading_rad
    elif message.hdg == 0xFFFF:
        return None
    else:
        heading_rad = wrap_two_pi(math.radians(number(message.hdg, 0, 36000, "hdg") / 100.0))
    if position is None:
        return None
    limit = MAX_SPEED_MPS * 100.0
    return VehicleState(
        t_s=t_s,
        boot_s=boot_s,
        position=position,
        velocity_en_mps=(
            number(message.vy, -limit, limit, "vy") / 100.0,
            number(message.vx, -limit, limit, "vx") / 100.0,
        ),
        heading_rad=heading_rad,
        roll_rad=attitude_now.roll_rad if attitude_now else None,
        yaw_rate_radps=attitude_now.yaw_rate_radps if attitude_now else None,
    )


def wind_sample(t_s: float, message: Message) -> WindSample:
    """Decode WIND: ``direction`` [deg] is where the true wind comes from."""
    return WindSample(
        t_s=t_s,
        twd_from_rad=wrap_two_pi(math.radians(number(message.direction, -360.0, 360.0, "direction"))),
        tws_mps=number(message.speed, 0.0, MAX_WIND_MPS, "speed"),
    )


def apparent_wind(t_s: float, speed_mps: float, angle_deg: float) -> ApparentWind:
    """Join AppWndSpd [m/s] and AppWndDir [deg, starboard positive]."""
    return ApparentWind(
        t_s=t_s,
        awa_rad=wrap_pi(math.radians(number(angle_deg, -360.0, 360.0, "AppWndDir"))),
        aws_mps=number(speed_mps, 0.0, MAX_WIND_MPS, "AppWndSpd"),
    )


def mode(message: Message) -> Mode | None:
    """Return the mode in a HEARTBEAT; None for a number that ArduRover does not have."""
    try:
        return Mode(message.custom_mode)
    except ValueError:
        return None


def is_armed(message: Message) -> bool:
    """Return whether a HEARTBEAT says armed."""
    return bool(message.base_mode & wire.MAV_MODE_FLAG_SAFETY_ARMED)


def is_autopilot_heartbeat(message: Message) -> bool:
    """Return whether a HEARTBEAT is an autopilot's: neither a ground station's nor another component's."""
    return bool(
        message.autopilot != wire.MAV_AUTOPILOT_INVALID
        and message.type not in {wire.MAV_TYPE_GCS, wire.MAV_TYPE_ONBOARD_CONTROLLER}
        and message.get_srcComponent() == AUTOPILOT_COMPONENT
    )


def ekf_ok(message: Message) -> bool:
    """Return whether EKF_STATUS_REPORT has what a position needs."""
    return message.flags & _EKF_NEEDED == _EKF_NEEDED and not message.flags & _EKF_FORBIDDEN


def fix(message: Message) -> GeoPoint | None:
    """Return where GPS_RAW_INT or GPS2_RAW has the receiver, None without a fix in three dimensions."""
    return geo_point(message.lat, message.lon) if message.fix_type >= wire.GPS_FIX_TYPE_3D_FIX else None


def has_failed(message: Message, sensor: int) -> bool | None:
    """Return whether SYS_STATUS calls a sensor that is switched on ill, None when it is not there or off."""
    if not message.onboard_control_sensors_enabled & sensor:
        return None
    return not message.onboard_control_sensors_health & sensor


def rc_us(message: Message) -> tuple[int, ...]:
    """Return the channels of RC_CHANNELS from the first on [us]; a channel that is not there is 0."""
    count = min(int(message.chancount), 18)
    raw = (int(getattr(message, f"chan{n + 1}_raw")) for n in range(count))
    return tuple(0 if value == 0xFFFF else value for value in raw)


def servo_us(message: Message) -> tuple[int, ...]:
    """Return the outputs of SERVO_OUTPUT_RAW from the first to the last that is driven [us]; one that is not is 0."""
    raw = [int(getattr(message, f"servo{n + 1}_raw")) for n in range(16)]
    driven = [n for n, value in enumerate(raw) if value not in {0, 0xFFFF}]
    return tuple(0 if value == 0xFFFF else value for value in raw[: driven[-1] + 1]) if driven else ()


def cross_track_m(message: Message) -> float:
    """Return the cross track of NAV_CONTROLLER_OUTPUT [m], positive when the boat is right of its leg."""
    return -number(message.xtrack_error, -1e6, 1e6, "xtrack_error")


def waypoint_distance_m(message: Message) -> float | None:
    """Return wp_dist of NAV_CONTROLLER_OUTPUT [m], None at its cap of 65535."""
    return None if message.wp_dist == 0xFFFF else float(message.wp_dist)


def target_bearing_rad(message: Message) -> float:
    """Return target_bearing of NAV_CONTROLLER_OUTPUT [rad, 0..2π)."""
    return wrap_two_pi(math.radians(number(message.target_bearing, -360, 360, "target_bearing")))


def ais_report(t_s: float, message: Message) -> AisReport:
    """Decode AIS_VESSEL. From the autopilot (component 1) with ArduPilot's units, else with the definition's."""
    ardupilot = message.get_srcComponent() == AUTOPILOT_COMPONENT
    mmsi = int(number(message.MMSI, 1, 999_999_999, "MMSI"))
    flags = message.flags
    speed_mps = course_rad = turn_radps = None
    if flags & wire.AIS_FLAGS_VALID_VELOCITY and not (ardupilot and message.velocity >= _AIS_SPEED_UNKNOWN):
        speed_mps = message.velocity / 10.0 * MPS_PER_KNOT if ardupilot else message.velocity / 100.0
    if flags & wire.AIS_FLAGS_VALID_COG and message.COG < _AIS_COURSE_UNKNOWN_CDEG:
        course_rad = math.radians(message.COG / 100.0)
    signed = flags & wire.AIS_FLAGS_VALID_TURN_RATE and not flags & wire.AIS_FLAGS_TURN_RATE_SIGN_ONLY
    # ArduPilot loses the sign: only "not turning" can be believed
    if signed and (not ardupilot or message.turn_rate == 0):
        turn_radps = math.radians(message.turn_rate / 10.0)
    has_size = bool(flags & wire.AIS_FLAGS_VALID_DIMENSIONS)
    name = message.name.strip(" @\x00") if flags & wire.AIS_FLAGS_VALID_NAME else ""
    return AisReport(
        t_s=t_s,
        mmsi=mmsi,
        position=geo_point(message.lat, message.lon),
        course_rad=course_rad,
        speed_mps=speed_mps,
        heading_rad=math.radians(message.heading / 100.0) if message.heading < _AIS_COURSE_UNKNOWN_CDEG else None,
        turn_rate_radps=turn_radps,
        nav_status=message.navigational_status if message.navigational_status < _AIS_STATUS_UNKNOWN else None,
        ship_type=message.type or None,
        name=name or None,
        bow_m=float(message.dimension_bow) if has_size else None,
        stern_m=float(message.dimension_stern) if has_size else None,
        port_m=float(message.dimension_port) if has_size else None,
        starboard_m=float(message.dimension_starboard) if has_size else None,
        age_s=float(message.tslc),
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class AutopilotVersion:
    """AUTOPILOT_VERSION: ``version`` as (major, minor, patch), the capability bits, the board's id.

    ``uid`` are the hex digits of UID2, of the older UID where that is empty, and "" of a board that tells neither.
    """

    version: tuple[int, int, int]
    capabilities: int
    uid: str

    @property
    def has_ftp(self) -> bool:
        """MAVFTP is there."""
        return bool(self.capabilities & wire.MAV_PROTOCOL_CAPABILITY_FTP)


def autopilot_version(message: Message) -> AutopilotVersion:
    """Decode AUTOPILOT_VERSION."""
    number_ = message.flight_sw_version
    return AutopilotVersion(
        version=(number_ >> 24 & 0xFF, number_ >> 16 & 0xFF, number_ >> 8 & 0xFF),
        capabilities=message.capabilities,
        uid=bytes(message.uid2).rstrip(b"\x00").hex() or (f"{message.uid:x}" if message.uid else ""),
    )


def mission_item(message: Message) -> MissionItem:
    """Decode MISSION_ITEM_INT, or MISSION_ITEM with its float degrees."""
    if message.get_type() == "MISSION_ITEM_INT":
        lat_e7, lon_e7 = int(message.x), int(message.y)
    else:
        lat_e7 = round(number(message.x, -90.0, 90.0, "x") * 1e7)
        lon_e7 = round(number(message.y, -180.0, 180.0, "y") * 1e7)
    params = (message.param1, message.param2, message.param3, message.param4)
    return MissionItem(
        command=message.command,
        lat_e7=lat_e7,
        lon_e7=lon_e7,
        alt_m=float(message.z) if math.isfinite(message.z) else 0.0,
        frame=message.frame,
        params=tuple(p if math.isfinite(p) else 0.0 for p in params),  # type: ignore[arg-type]
        autocontinue=bool(message.autocontinue),
    )


# --------------------------------------------------------------------------------------------- encoding
def heartbeat(system_status: int = wire.MAV_STATE_ACTIVE, token: int = 0) -> Message:
    """Return our HEARTBEAT: an onboard computer, no autopilot, never a ground station.

    ``token`` (32 bits) goes in custom_mode, which has no meaning for a companion: it tells our own heartbeat, echoed
    by a router, from another companion's.
    """
    return wire.MAVLink_heartbeat_message(
        wire.MAV_TYPE_ONBOARD_CONTROLLER, wire.MAV_AUTOPILOT_INVALID, 0, token, system_status, 3
    )


def mission_item_int(target: tuple[int, int], seq: int, item: MissionItem, mission_type: MissionType) -> Message:
    """Return ``item`` as MISSION_ITEM_INT number ``seq``."""
    return wire.MAVLink_mission_item_int_message(
        target[0],
        target[1],
        seq,
        item.frame,
        item.command,
        0,
        int(item.autocontinue),
        *item.params,
        item.lat_e7,
        item.lon_e7,
        item.alt_m,
        int(mission_type),
    )


def command_long(target: tuple[int, int], command: int, params: tuple[float, ...], confirmation: int = 0) -> Message:
    """Return COMMAND_LONG; missing params are 0."""
    padded = (*params, *(0.0,) * 7)[:7]
    return wire.MAVLink_command_long_message(target[0], target[1], command, confirmation, *padded)


def heading_setpoint(target: tuple[int, int], boot_s: float, heading_rad: float, thrust: float) -> Message:
    """Return SET_ATTITUDE_TARGET: sail at ``heading_rad``; thrust 0 eases the sails, 1 trims them."""
    half = wrap_pi(heading_rad) / 2.0
    ignore_rates = 0b00000111
    return wire.MAVLink_set_attitude_target_message(
        round(boot_s * 1e3) & 0xFFFFFFFF,
        target[0],
        target[1],
        ignore_rates,
        [math.cos(half), 0.0, 0.0, math.sin(half)],
        0.0,
        0.0,
        0.0,
        thrust,
    )


def status_texts(severity: int, text: str, text_id: int) -> list[Message]:
    """Return ``text`` as STATUSTEXT chunks of 50 bytes; one that fits has id 0. At most 250 bytes are sent."""
    raw = one_line(text).encode("ascii", "replace")[:250]  # many a station prints it as it comes
    if len(raw) <= 50:
        return [wire.MAVLink_statustext_message(severity, raw, 0, 0)]
    chunks = [raw[i : i + 50] for i in range(0, len(raw), 50)]
    if len(chunks[-1]) == 50:
        chunks.append(b"")  # the last chunk ends with a zero byte
    return [wire.MAVLink_statustext_message(severity, chunk, 1 + text_id % 65535, i) for i, chunk in enumerate(chunks)]


class TextAssembler:
    """Joins the chunks of long STATUSTEXTs; a text whose chunks are lost comes out with a gap, never not at all."""

    WAIT_S = 2.0

    def __init__(self) -> None:
        self._open: dict[tuple[int, int], tuple[float, int, dict[int, str]]] = {}

    def take(self, t_s: float, message: Message) -> list[StatusText]:
        """Return the texts that are complete now."""
        component = message.get_srcComponent()
        texts = self.expired(t_s)
        severity = min(int(message.severity), 7)
        if message.id == 0:
            return [*texts, _text(t_s, severity, message.text, component)]
        key = (component, message.id)
        _, _, chunks = self._open.setdefault(key, (t_s, severity, {}))
        chunks[message.chunk_seq] = message.text
        last = max(chunks)
        if len(chunks[last]) < 50 and len(chunks) == last + 1:
            del self._open[key]
            texts.append(_text(t_s, severity, "".join(chunks[i] for i in range(last + 1)), component))
        return texts

    @property
    def is_waiting(self) -> bool:
        """Whether a text waits for a chunk."""
        return bool(self._open)

    def expired(self, t_s: float) -> list[StatusText]:
        """Return texts that waited too long for a chunk, with [...] for what is missing."""
        texts: list[StatusText] = []
        if not self._open:
            return texts
        for key in [k for k, (since_s, _, _) in self._open.items() if t_s - since_s > self.WAIT_S]:
            _, severity, chunks = self._open.pop(key)
            whole = "".join(chunks.get(i, "[...]") for i in range(max(chunks) + 1))
            tail = "[...]" if len(chunks[max(chunks)]) == 50 else ""
            texts.append(_text(t_s, severity, whole + tail, key[0]))
        return texts


def _text(t_s: float, severity: int, text: str, component: int) -> StatusText:
    printable = "".join(c if c.isprintable() else "?" for c in text)
    return StatusText(t_s=t_s, severity=severity, text=printable, source_component=component)
