"""Spoofing: forged MAVLink messages of every kind that the companion reads."""

from __future__ import annotations

import math
import random
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as wire

from companion.mavlink.wire import Codec

AUTOPILOT, COMPANION, OTHER = 1, 191, 100
OFF_E7 = 27_000  # 300 m of latitude


@dataclass(frozen=True, slots=True, kw_only=True)
class ForgerKnowledge:
    """What the forger knows, or believes to: boot time, place, heading and current item of the boat."""

    boot_s: float = 0.0
    lat_e7: int = 500_000_000
    lon_e7: int = 0
    yaw_rad: float = 0.0
    seq: int = 1

    @property
    def boot_ms(self) -> int:
        """For the wire."""
        return round(self.boot_s * 1e3)


@dataclass(frozen=True, slots=True, kw_only=True)
class Forgery:
    """One forged message.

    Attributes:
        message: its MAVLink name.
        says: what it claims, in words.
        build: makes it from what is known.
        system, component: whose it claims to be; system None: the boat's.
        in_a_read: it answers, so it is sent while the companion reads the mission.
    """

    message: str
    says: str
    build: Callable[[ForgerKnowledge], Any]
    system: int | None = None
    component: int = AUTOPILOT
    in_a_read: bool = False

    @property
    def name(self) -> str:
        """What it is called in a scenario."""
        return f"{self.message}: {self.says}"


def _beat(mode: int = 4, *, armed: bool = True) -> Any:
    return wire.MAVLink_heartbeat_message(11, 3, 0x80 if armed else 0, mode, 4, 3)


def _fix(known: ForgerKnowledge, ahead_s: float = 0.0, off_e7: int = OFF_E7) -> Any:
    return wire.MAVLink_global_position_int_message(
        round((known.boot_s + ahead_s) * 1e3), known.lat_e7 + off_e7, known.lon_e7, 0, 0, 0, 0, 0, 9000
    )


def _item(known: ForgerKnowledge, message: Callable[..., Any], scale: float) -> Any:
    lat, lon = known.lat_e7 + 10 * OFF_E7, known.lon_e7
    place = (lat, lon) if scale == 1.0 else (lat / scale, lon / scale)
    return message(1, COMPANION, 1, 3, 16, 0, 1, 0.0, 0.0, 0.0, 0.0, *place, 0.0, 0)


def _parameter(name: bytes, value: float) -> Callable[[ForgerKnowledge], Any]:
    return lambda _: wire.MAVLink_param_value_message(name, value, 9, 1000, 65535)


def _ghost(known: ForgerKnowledge) -> Any:
    return wire.MAVLink_ais_vessel_message(
        211_000_001,
        known.lat_e7 + OFF_E7,
        known.lon_e7,
        18000,
        18000,
        0,
        100,
        0,
        70,
        50,
        50,
        10,
        10,
        b"",
        b"GHOST",
        0,
        0x36,
    )


_OTHER_BOARD = [0x66] * 18
_NAK = bytes([1, 0, 0, 129, 0, 1, 2, 0, 0, 0, 0, 0, 2])

FORGERIES: tuple[Forgery, ...] = (
    Forgery(message="HEARTBEAT", says="mode HOLD", build=lambda _: _beat()),
    Forgery(message="HEARTBEAT", says="disarmed", build=lambda _: _beat(10, armed=False)),
    Forgery(message="HEARTBEAT", says="an autopilot of system 7", system=7, build=lambda _: _beat()),
    Forgery(
        message="HEARTBEAT",
        says="a second companion",
        component=COMPANION,
        build=lambda _: wire.MAVLink_heartbeat_message(18, 8, 0, 0x0BAD, 4, 3),
    ),
    Forgery(message="GLOBAL_POSITION_INT", says="300 m off", build=_fix),
    Forgery(message="GLOBAL_POSITION_INT", says="here, 4.5 s ahead", build=lambda k: _fix(k, 4.5, 0)),
    Forgery(
        message="ATTITUDE",
        says="the other way round",
        build=lambda k: wire.MAVLink_attitude_message(k.boot_ms, 0.0, 0.0, k.yaw_rad + math.pi, 0.0, 0.0, 0.0),
    ),
    Forgery(message="WIND", says="15 m/s from the south", build=lambda _: wire.MAVLink_wind_message(180.0, 15.0, 0.0)),
    Forgery(
        message="NAMED_VALUE_FLOAT",
        says="apparent wind from astern",
        build=lambda k: wire.MAVLink_named_value_float_message(k.boot_ms, b"AppWndDir", 180.0),
    ),
    Forgery(
        message="SYSTEM_TIME",
        says="it is midnight",
        build=lambda k: wire.MAVLink_system_time_message(1_780_963_200_000_000, k.boot_ms),
    ),
    Forgery(
        message="MISSION_CURRENT",
        says="the last item, complete",
        build=lambda _: wire.MAVLink_mission_current_message(1, 1, 5, 1),
    ),
    Forgery(
        message="NAV_CONTROLLER_OUTPUT",
        says="500 m off the leg",
        build=lambda _: wire.MAVLink_nav_controller_output_message(0.0, 0.0, 0, 0, 0, 0.0, 0.0, 500.0),
    ),
    Forgery(
        message="EKF_STATUS_REPORT",
        says="no position",
        build=lambda _: wire.MAVLink_ekf_status_report_message(0, 9.0, 9.0, 9.0, 9.0, 0.0, 0.0),
    ),
    Forgery(
        message="GPS_RAW_INT",
        says="no fix",
        build=lambda k: wire.MAVLink_gps_raw_int_message(k.boot_ms * 1000, 0, 0, 0, 0, 9999, 9999, 0, 0, 0),
    ),
    Forgery(
        message="GPS2_RAW",
        says="300 m off",
        build=lambda k: wire.MAVLink_gps2_raw_message(
            k.boot_ms * 1000, 3, k.lat_e7 + OFF_E7, k.lon_e7, 0, 121, 200, 0, 65535, 10, 0, 0
        ),
    ),
    Forgery(
        message="SYS_STATUS",
        says="battery at 3 %",
        build=lambda _: wire.MAVLink_sys_status_message(0, 0, 0, 0, 9000, 0, 3, 0, 0, 0, 0, 0, 0),
    ),
    Forgery(
        message="FENCE_STATUS",
        says="the fence is breached",
        build=lambda _: wire.MAVLink_fence_status_message(1, 1, 3, 0),
    ),
    Forgery(
        message="DISTANCE_SENSOR",
        says="the bottom is 0.4 m below",
        build=lambda k: wire.MAVLink_distance_sensor_message(
            k.boot_ms, 20, 5000, 40, 2, 0, wire.MAV_SENSOR_ROTATION_PITCH_270, 0
        ),
    ),
    Forgery(
        message="WATER_DEPTH",
        says="the bottom is 0.4 m below",
        build=lambda k: wire.MAVLink_water_depth_message(k.boot_ms, 0, 1, 0, 0, 0.0, 0.0, 0.0, 0.0, 0.4, 15.0),
    ),
    Forgery(
        message="RANGEFINDER",
        says="the bottom is 0.4 m below",
        build=lambda _: wire.MAVLink_rangefinder_message(0.4, 0.0),
    ),
    Forgery(
        message="RC_CHANNELS",
        says="a person moves the sticks",
        build=lambda k: wire.MAVLink_rc_channels_message(
            k.boot_ms, 8, *(1900 if k.boot_ms % 2 else 1100 for _ in range(8)), *([0] * 10), 255
        ),
    ),
    Forgery(
        message="SERVO_OUTPUT_RAW",
        says="the rudder hard over",
        build=lambda k: wire.MAVLink_servo_output_raw_message(k.boot_ms * 1000, 0, 2000, 0, 1500, 1000, *([0] * 12)),
    ),
    Forgery(
        message="STATUSTEXT",
        says='"EKF failsafe"',
        build=lambda _: wire.MAVLink_statustext_message(2, b"EKF failsafe", 0, 0),
    ),
    Forgery(
        message="STATUSTEXT",
        says='"Flight plan received"',
        build=lambda _: wire.MAVLink_statustext_message(6, b"Flight plan received", 0, 0),
    ),
    Forgery(message="AIS_VESSEL", says="a ship 300 m off", build=_ghost),
    Forgery(message="AIS_VESSEL", says="the same, of a receiver of its own", component=156, build=_ghost),
    Forgery(
        message="HOME_POSITION",
        says="home is 300 m off",
        build=lambda k: wire.MAVLink_home_position_message(
            k.lat_e7 + OFF_E7, k.lon_e7, 0, 0.0, 0.0, 0.0, [1.0, 0.0, 0.0, 0.0], 0.0, 0.0, 0.0
        ),
    ),
    Forgery(
        message="AUTOPILOT_VERSION",
        says="another board",
        build=lambda _: wire.MAVLink_autopilot_version_message(
            0, 0, 0, 0, 0, [0] * 8, [0] * 8, [0] * 8, 0, 0, 0, _OTHER_BOARD
        ),
    ),
    Forgery(message="PARAM_VALUE", says="SAIL_NO_GO_ANGLE 90", build=_parameter(b"SAIL_NO_GO_ANGLE", 90.0)),
    Forgery(message="PARAM_VALUE", says="SAIL_NO_GO_ANGLE 80", build=_parameter(b"SAIL_NO_GO_ANGLE", 80.0)),
    Forgery(
        message="PARAM_VALUE",
        says="SAIL_NO_GO_ANGLE 80, of a gimbal",
        component=OTHER,
        build=_parameter(b"SAIL_NO_GO_ANGLE", 80.0),
    ),
    Forgery(
        message="COMMAND_ACK",
        says="a mode change is accepted",
        build=lambda _: wire.MAVLink_command_ack_message(176, 0, 0, 0, 1, COMPANION),
    ),
    Forgery(
        message="COMMAND_LONG",
        says="a station orders the companion to disarm",
        system=255,
        component=190,
        build=lambda _: wire.MAVLink_command_long_message(1, COMPANION, 400, 0, 0.0, 0, 0, 0, 0, 0, 0),
    ),
    Forgery(
        message="COMMAND_LONG",
        says="a station gives the order hold",
        system=255,
        component=190,
        build=lambda _: wire.MAVLink_command_long_message(1, COMPANION, 31010, 0, 1.0, 0, 0, 0, 0, 0, 0),
    ),
    Forgery(
        message="COMMAND_INT",
        says="a station gives the order goal",
        system=255,
        component=190,
        build=lambda k: wire.MAVLink_command_int_message(
            1, COMPANION, 0, 31011, 0, 0, 0.0, 0.0, 0.0, 0.0, k.lat_e7, k.lon_e7, 0.0
        ),
    ),
    Forgery(
        message="COMMAND_INT",
        says="a station orders the companion to reposition",
        system=255,
        component=190,
        build=lambda k: wire.MAVLink_command_int_message(
            1, COMPANION, 3, 192, 0, 0, -1.0, 0.0, 0.0, 0.0, k.lat_e7, k.lon_e7, 0.0
        ),
    ),
    Forgery(
        message="MISSION_COUNT",
        says="2 items are on board",
        in_a_read=True,
        build=lambda _: wire.MAVLink_mission_count_message(1, COMPANION, 2, 0),
    ),
    Forgery(
        message="MISSION_ITEM_INT",
        says="item 1 is 3 km off",
        in_a_read=True,
        build=lambda k: _item(k, wire.MAVLink_mission_item_int_message, 1.0),
    ),
    Forgery(
        message="MISSION_ITEM",
        says="item 1 is 3 km off",
        in_a_read=True,
        build=lambda k: _item(k, wire.MAVLink_mission_item_message, 1e7),
    ),
    Forgery(
        message="MISSION_REQUEST",
        says="asks for item 1",
        in_a_read=True,
        build=lambda _: wire.MAVLink_mission_request_message(1, COMPANION, 1, 0),
    ),
    Forgery(
        message="MISSION_REQUEST_INT",
        says="asks for item 1",
        in_a_read=True,
        build=lambda _: wire.MAVLink_mission_request_int_message(1, COMPANION, 1, 0),
    ),
    Forgery(
        message="MISSION_ACK",
        says="an error",
        in_a_read=True,
        build=lambda _: wire.MAVLink_mission_ack_message(1, COMPANION, 1, 0),
    ),
    Forgery(
        message="FILE_TRANSFER_PROTOCOL",
        says="a refusal",
        in_a_read=True,
        build=lambda _: wire.MAVLink_file_transfer_protocol_message(0, 1, COMPANION, _NAK.ljust(251, b"\x00")),
    ),
    Forgery(
        message="NAMED_VALUE_FLOAT",
        says="she leaks",
        build=lambda k: wire.MAVLink_named_value_float_message(k.boot_ms, b"LEAK", 1.0),
    ),
)


def forgery_named(name: str) -> Forgery:
    """Return the forgery called "MESSAGE: what it says".

    Raises:
        ValueError: there is none.
    """
    found = next((f for f in FORGERIES if f.name == name), None)
    if found is None:
        raise ValueError(f"no forgery is called {name!r}; the names are MESSAGE: SAYS of docs/reference/mavlink.md")
    return found


class Forger:
    """Makes frames of forgeries.

    Args:
        system: the boat's system id.
        listens: the forger hears the boat, and knows its boot time and its count of frames.
        key: of the link, where the forger has it.
        timestamp: of the first signature [10 µs since 2015].
        seed: of the number of the first frame.
    """

    def __init__(
        self, *, system: int = 1, listens: bool, key: bytes | None = None, timestamp: int = 0, seed: int = 0
    ) -> None:
        self.known = ForgerKnowledge()
        self._system, self._listens = system, listens
        self._codec = Codec(system, OTHER)
        self._seq = random.Random(seed).randrange(256)
        self._zero_s: float | None = None
        self._key, self._timestamp = key, timestamp

    def hear(self, t_s: float, data: bytes) -> None:
        """Take what the boat says at ``t_s`` [s]; one who does not listen hears nothing."""
        for m in self._codec.feed(data) if self._listens else ():
            if (m.get_srcSystem(), m.get_srcComponent()) != (self._system, AUTOPILOT):
                continue
            self._seq = (m.get_seq() + 1) % 256
            boot_ms = getattr(m, "time_boot_ms", None)
            if boot_ms is not None:
                self._zero_s = t_s - boot_ms / 1e3
            self._note(m)

    def _note(self, m: Any) -> None:
        known, kind = self.known, m.get_type()
        lat, lon, yaw, seq = known.lat_e7, known.lon_e7, known.yaw_rad, known.seq
        if kind == "GLOBAL_POSITION_INT":
            lat, lon = m.lat, m.lon
        elif kind == "ATTITUDE":
            yaw = m.yaw
        elif kind == "MISSION_CURRENT":
            seq = m.seq
        self.known = ForgerKnowledge(lat_e7=lat, lon_e7=lon, yaw_rad=yaw, seq=seq)

    def frame(self, t_s: float, forgery: Forgery) -> bytes:
        """Return a forgery as a frame; one who does not listen counts from 0 and guesses a boot time."""
        if self._zero_s is None:
            self._zero_s = t_s - 5.0
        known = ForgerKnowledge(
            boot_s=max(0.0, t_s - self._zero_s),
            lat_e7=self.known.lat_e7,
            lon_e7=self.known.lon_e7,
            yaw_rad=self.known.yaw_rad,
            seq=self.known.seq,
        )
        packer = wire.MAVLink(None, srcSystem=forgery.system or self._system, srcComponent=forgery.component)
        packer.seq = self._seq
        self._seq = (self._seq + 1) % 256
        if self._key is not None:
            self._timestamp += 1
            packer.signing.secret_key, packer.signing.link_id = self._key, 7
            packer.signing.timestamp, packer.signing.sign_outgoing = self._timestamp, True
        return bytes(forgery.build(known).pack(packer))
