"""Message handlers: what arrives on the ports is routed and carried out (commands, parameters), what is due is sent."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as mav

from companion.messages import Mode
from sitl.autopilot.boat.parameters import Parameters
from sitl.autopilot.link import (
    FIRST_STREAMS_S,
    GROUPS,
    LOOP_S,
    OPTIONAL_STREAMS,
    STREAMABLE,
    MavlinkPort,
    Router,
    Voice,
)
from sitl.autopilot.pilot.helm import AUX_MOTOR, AUX_TACK
from sitl.autopilot.pilot.pilot import Pilot
from sitl.autopilot.protocol.mission_protocol import FtpServer, TransferServer
from sitl.autopilot.protocol.telemetry import BUILDERS, AisList, autopilot_version, named_floats, send_once

# MAV_RESULT
OK, REFUSED, UNSUPPORTED, FAILED = 0, 2, 3, 4
_FORCE = 21196
_FORCE_REBOOT = 20190226  # as param6
FORCED_REBOOT = 1.0, 0.0, 0.0, 0.0, 0.0, float(_FORCE_REBOOT)  # of an autopilot that is armed, too
# the loop runs at 50 Hz and a message may take part in four of five loops
_FASTEST_S = 1.0 / 40.0


def execute(pilot: Pilot, m: Any, link: MavlinkPort) -> None:
    """Carry out a command and acknowledge it."""
    p = (m.param1, m.param2, m.param3, m.param4)
    if m.get_type() == "COMMAND_INT":
        place = (m.x, m.y)
    else:
        scaled = [v * 1e7 if math.isfinite(v) and abs(v) <= 360.0 else 0.0 for v in (m.param5, m.param6)]
        place = (round(scaled[0]), round(scaled[1]))
    result = OK
    if not all(math.isfinite(v) for v in p[:2]):
        result = REFUSED
    else:
        result = _dispatch(pilot, m, link, p, place)
    ack = mav.MAVLink_command_ack_message(m.command, result, 0, 0, m.get_srcSystem(), m.get_srcComponent())
    link.send(ack)
    pilot.core.voice.after_ack()


def _dispatch(pilot: Pilot, m: Any, link: MavlinkPort, p: tuple[float, ...], place: tuple[int, int]) -> int:
    """Do what a command asks for; return its MAV_RESULT."""
    command = m.command
    if command in _MODE_OF:
        return _done(pilot.helm.set_mode(_MODE_OF[command]))
    if command in _FOR_THE_LINK:
        return _FOR_THE_LINK[command](pilot, link, p)
    if command in _FOR_THE_PILOT:
        return _FOR_THE_PILOT[command](pilot, p)
    if command == mav.MAV_CMD_DO_REPOSITION:
        return _reposition(pilot, m, p, place)
    if command == mav.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN:
        return _reboot(pilot, m, int(p[0]))
    if command == mav.MAV_CMD_DO_SET_HOME:
        return _done(pilot.core.set_home(None if p[0] == 1.0 else pilot.core.chart.to_en(*place)))
    return OK if command in _WITHOUT_EFFECT else UNSUPPORTED


def _done(is_done: bool) -> int:
    return OK if is_done else FAILED


def _tell_interval(_pilot: Pilot, link: MavlinkPort, p: tuple[float, ...]) -> int:
    interval = link.interval_s(int(p[0]))
    link.send(mav.MAVLink_message_interval_message(int(p[0]), round(interval * 1e6) if interval else 0))
    return OK


def _set_current(pilot: Pilot, link: MavlinkPort, p: tuple[float, ...]) -> int:
    known = 0 <= p[0] < len(pilot.helm.mission.items)
    if not (known and pilot.helm.set_current(int(p[0]), resets=p[1] == 1.0)):
        return REFUSED
    send_once(pilot, link, mav.MAVLINK_MSG_ID_MISSION_CURRENT)
    return OK


def _tell_capabilities(pilot: Pilot, link: MavlinkPort, _p: tuple[float, ...]) -> int:
    link.send(autopilot_version(pilot))
    return OK


def _arm_or_disarm(pilot: Pilot, p: tuple[float, ...]) -> int:
    if p[0] == 1.0:
        return _done(pilot.arming.arm(force=p[1] == _FORCE))
    if p[0] != 0.0:
        return FAILED
    pilot.arming.disarm()
    return OK


def _switch_fence(pilot: Pilot, p: tuple[float, ...]) -> int:
    pilot.fence.switch(enabled=p[0] == 1.0)
    return OK


def _auxiliary(pilot: Pilot, p: tuple[float, ...]) -> int:
    """Run the motor, or tack, as an auxiliary switch in its high position does."""
    if int(p[0]) == AUX_MOTOR:
        pilot.core.run_motor(on=int(p[1]) == 2)
        return OK
    if int(p[0]) != AUX_TACK:
        return FAILED
    if int(p[1]) == 2:
        pilot.core.vehicle.ask_tack()
    return OK


def _reboot(pilot: Pilot, m: Any, what: int) -> int:
    if what not in {1, 3}:
        return UNSUPPORTED
    sixth = m.param6 if m.get_type() == "COMMAND_LONG" else m.y
    if pilot.core.is_armed and sixth != _FORCE_REBOOT:
        return FAILED
    pilot.core.reboot_soon()
    return OK


def _set_interval(pilot: Pilot, link: MavlinkPort, msgid: int, interval_us: float) -> int:
    if msgid not in STREAMABLE:
        pilot.core.voice.announce(mav.MAV_SEVERITY_INFO, f"No ap_message for mavlink id ({msgid})")
        return REFUSED
    if interval_us > 0.0 and interval_us * 1e-6 < _FASTEST_S - 1e-9:
        pilot.core.voice.announce(
            mav.MAV_SEVERITY_INFO, f"Requested rate for message ID {msgid} too fast. Increase SCHED_LOOP_RATE"
        )
        return REFUSED
    if interval_us == 0.0:
        link.set_interval((msgid,), 0.0 if msgid in OPTIONAL_STREAMS else 1.0, pilot.core.t_s)
    else:
        link.set_interval((msgid,), max(0.0, interval_us * 1e-6), pilot.core.t_s)
    return OK


def _reposition(pilot: Pilot, m: Any, p: tuple[float, ...], place: tuple[int, int]) -> int:
    if m.get_type() != "COMMAND_INT" or abs(place[0]) > 900_000_000 or abs(place[1]) > 1_800_000_000:
        return REFUSED
    if pilot.helm.mode is not Mode.GUIDED and not (int(p[1]) & 1 and pilot.helm.set_mode(Mode.GUIDED)):
        return FAILED
    pilot.helm.go_to(pilot.core.chart.to_en(*place))
    return OK


_MODE_OF = {
    mav.MAV_CMD_MISSION_START: Mode.AUTO,
    mav.MAV_CMD_NAV_RETURN_TO_LAUNCH: Mode.RTL,
    mav.MAV_CMD_NAV_LOITER_UNLIM: Mode.LOITER,
}
_FOR_THE_LINK: dict[int, Callable[[Pilot, MavlinkPort, tuple[float, ...]], int]] = {
    mav.MAV_CMD_SET_MESSAGE_INTERVAL: lambda pilot, link, p: _set_interval(pilot, link, int(p[0]), p[1]),
    mav.MAV_CMD_GET_MESSAGE_INTERVAL: _tell_interval,
    mav.MAV_CMD_REQUEST_MESSAGE: lambda pilot, link, p: _done(send_once(pilot, link, int(p[0]))),
    mav.MAV_CMD_DO_SET_MISSION_CURRENT: _set_current,
    mav.MAV_CMD_GET_HOME_POSITION: lambda pilot, link, _: _done(
        send_once(pilot, link, mav.MAVLINK_MSG_ID_HOME_POSITION)
    ),
    mav.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES: _tell_capabilities,
}
_FOR_THE_PILOT: dict[int, Callable[[Pilot, tuple[float, ...]], int]] = {
    mav.MAV_CMD_DO_SET_MODE: lambda pilot, p: _done(pilot.helm.set_mode(int(p[1]))),
    mav.MAV_CMD_COMPONENT_ARM_DISARM: _arm_or_disarm,
    mav.MAV_CMD_DO_FENCE_ENABLE: _switch_fence,
    mav.MAV_CMD_DO_AUX_FUNCTION: _auxiliary,
}
# a pure sailboat cannot choose its speed: acknowledged and without effect, as on the real one
_WITHOUT_EFFECT = frozenset({mav.MAV_CMD_DO_CHANGE_SPEED, mav.MAV_CMD_DO_SEND_BANNER})


def setpoint(pilot: Pilot, m: Any) -> None:
    """Take a GUIDED set-point; ignored in other modes."""
    if pilot.helm.mode is not Mode.GUIDED:
        return
    name = m.get_type()
    if name == "SET_ATTITUDE_TARGET":
        _attitude_target(pilot, m)
        return
    mask = m.type_mask
    if not mask & 0b111:
        if name == "SET_POSITION_TARGET_GLOBAL_INT":
            if abs(m.lat_int) <= 900_000_000 and abs(m.lon_int) <= 1_800_000_000:
                pilot.helm.go_to(pilot.core.chart.to_en(m.lat_int, m.lon_int))
        elif math.isfinite(m.x) and math.isfinite(m.y):
            is_local = m.coordinate_frame == mav.MAV_FRAME_LOCAL_NED
            base = pilot.core.origin_en if is_local else pilot.core.vehicle.position
            pilot.helm.go_to((base[0] + m.y, base[1] + m.x))
        return
    yaw_known, rate_known = not mask & 0x400, not mask & 0x800
    if not mask & 0b111000 and math.isfinite(m.vx) and math.isfinite(m.vy):
        speed = math.hypot(m.vx, m.vy)
        in_body = name == "SET_POSITION_TARGET_LOCAL_NED" and m.coordinate_frame in {8, 9, 12}
        if rate_known and math.isfinite(m.yaw_rate):
            pilot.helm.turn(m.yaw_rate, speed)
            return
        heading = math.atan2(m.vy, m.vx) + (pilot.core.vehicle.heading if in_body else 0.0)
        pilot.helm.steer(m.yaw if yaw_known and math.isfinite(m.yaw) and speed == 0.0 else heading, speed)
    elif yaw_known and math.isfinite(m.yaw):
        pilot.helm.steer(m.yaw, 0.0)


def _attitude_target(pilot: Pilot, m: Any) -> None:
    w, x, y, z = m.q
    thrust = m.thrust
    if not all(math.isfinite(v) for v in (w, x, y, z, thrust)):
        return
    if m.type_mask & mav.ATTITUDE_TARGET_TYPEMASK_THROTTLE_IGNORE:
        return
    if m.type_mask & mav.ATTITUDE_TARGET_TYPEMASK_ATTITUDE_IGNORE:
        if not m.type_mask & mav.ATTITUDE_TARGET_TYPEMASK_BODY_YAW_RATE_IGNORE and math.isfinite(m.body_yaw_rate):
            pilot.helm.turn(m.body_yaw_rate, thrust)
        return
    pilot.helm.steer(math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z)), thrust)


def send_group(pilot: Pilot, m: Any, link: MavlinkPort) -> None:
    """REQUEST_DATA_STREAM: sets every message of a group, whatever was asked for before."""
    groups = GROUPS.values() if m.req_stream_id == 0 else [GROUPS.get(m.req_stream_id, ())]
    msgids = tuple(i for group in groups for i in group if i in BUILDERS)
    rate = m.req_message_rate if m.start_stop else 0
    link.set_interval(msgids, max(1.0 / rate, LOOP_S) if rate > 0 else 0.0, pilot.core.t_s)


# 1288 values took 0.6 s on the real one.
_PER_LOOP = 43


@dataclass(slots=True)
class _List:
    link: MavlinkPort
    index: int = 0


class ParameterServer:
    """Answers PARAM_ messages; lists go out over several loops."""

    def __init__(self, parameters: Parameters, voice: Voice, changed: Callable[[str], None]) -> None:
        self._parameters = parameters
        self._voice = voice
        self._changed = changed
        self._lists: list[_List] = []

    @property
    def is_busy(self) -> bool:
        """Whether a list is under way."""
        return bool(self._lists)

    def handle(self, m: Any, link: MavlinkPort) -> None:
        """Take PARAM_REQUEST_LIST, PARAM_REQUEST_READ or PARAM_SET."""
        name = m.get_type()
        if name == "PARAM_REQUEST_LIST":
            self._lists = [*(p for p in self._lists if p.link is not link), _List(link)]
        elif name == "PARAM_REQUEST_READ":
            key: str | int = m.param_index if m.param_index >= 0 else m.param_id
            entry = self._parameters.entry(key)
            if entry is not None:
                link.send(self._message(entry, None if isinstance(key, str) else entry[3]))
        elif name == "PARAM_SET" and self._parameters.set(m.param_id, m.param_value):
            self._changed(m.param_id)
            entry = self._parameters.entry(m.param_id)
            if entry is not None:
                self._voice.broadcast(self._message(entry, None))

    def update(self) -> None:
        """One loop: the next values of each list."""
        if not self._lists:
            return
        for sending in self._lists:
            for _ in range(_PER_LOOP):
                entry = self._parameters.entry(sending.index)
                if entry is None:
                    break
                sending.link.send(self._message(entry, sending.index))
                sending.index += 1
        self._lists = [p for p in self._lists if p.index < len(self._parameters)]

    def _message(self, entry: tuple[str, float, int, int], index: int | None) -> Any:
        name, value, kind, _ = entry
        # single values have no index
        return mav.MAVLink_param_value_message(
            name.encode(), value, kind, len(self._parameters), 65535 if index is None else index
        )


_SETPOINTS = frozenset({"SET_ATTITUDE_TARGET", "SET_POSITION_TARGET_GLOBAL_INT", "SET_POSITION_TARGET_LOCAL_NED"})


class Ports:
    """The servers of MAVLink's protocols and the routes between the ports, made anew at every power-up."""

    def __init__(self, pilot: Pilot) -> None:
        self._pilot = pilot
        self._core = core = pilot.core
        self._voice = core.voice
        self._router = Router(core.config.sysid)
        self._parameters = ParameterServer(core.parameters, core.voice, pilot.parameter_changed)
        self._transfers = TransferServer(pilot.storage, core.voice)
        self._ftp = FtpServer(core, pilot.storage)
        self.ais_list = AisList()

    @property
    def has_work(self) -> bool:
        """Whether bytes wait to be read, or texts or parameters to be sent."""
        return self._voice.has_work or self._parameters.is_busy

    @property
    def due_s(self) -> float:
        """When there is something to send."""
        return min(self._voice.due_s, self._transfers.due_s)

    # ------------------------------------------------------------------------------------------------ in
    def read(self) -> None:
        """Act on what arrived on every port, and on what did not come in time."""
        for link in list(self._voice.links.values()):
            if link.inbox:
                for m in link.read():
                    self._message(m, link)
        self._transfers.update(self._core.t_s)

    def _message(self, m: Any, link: MavlinkPort) -> None:
        links, pilot = self._voice.links, self._pilot
        link.is_heard = True
        link.last_heard_s = self._core.t_s
        self._router.learn(m, link.number)
        is_ours, forward = self._router.route(m, link.number, links)
        frame = bytes(m.get_msgbuf())
        for number in forward:
            links[number].forward(frame)
        if not is_ours:
            return
        name = m.get_type()
        if name in {"COMMAND_LONG", "COMMAND_INT"}:
            execute(pilot, m, link)
        elif name == "MISSION_SET_CURRENT":
            mission = pilot.helm.mission
            if m.seq < len(mission.items) and mission.set_current(m.seq):
                send_once(pilot, link, mav.MAVLINK_MSG_ID_MISSION_CURRENT)
        elif name.startswith("MISSION_"):
            self._transfers.handle(m, link.number, self._core.t_s)
        elif name.startswith("PARAM_"):
            self._parameters.handle(m, link)
        elif name in _SETPOINTS:
            setpoint(pilot, m)
        elif name == "HEARTBEAT":
            pilot.failsafe.heard((m.get_srcSystem(), m.get_srcComponent()))
        elif name == "FILE_TRANSFER_PROTOCOL" and self._core.config.has_ftp:
            self._ftp.handle(m, link.number)
        elif name == "SET_MODE":
            pilot.helm.set_mode(m.custom_mode)
        elif name == "REQUEST_DATA_STREAM":
            send_group(pilot, m, link)
        elif name == "SETUP_SIGNING":
            if self._core.is_armed:
                self._voice.announce(mav.MAV_SEVERITY_WARNING, "ERROR: Won't setup signing when armed")
            else:
                self._voice.take_key(bytes(m.secret_key), m.initial_timestamp)
        elif name == "TIMESYNC" and m.tc1 == 0:
            link.send(mav.MAVLink_timesync_message(self._core.boot_us * 1000, m.ts1))

    # ----------------------------------------------------------------------------------------------- out
    def send_due(self) -> None:
        """Send the parameters and streams that are due, and texts that waited."""
        self._parameters.update()
        t_s = self._core.t_s
        for link in self._voice.links.values():
            if link.due_s <= t_s + 1e-9:
                self._send_streams(link, t_s)
        self._voice.after_ack()

    def _send_streams(self, link: MavlinkPort, t_s: float) -> None:
        due = link.take_due(t_s)
        if self._core.boot_s < FIRST_STREAMS_S:
            due = [i for i in due if i == mav.MAVLINK_MSG_ID_HEARTBEAT]
        if not link.is_plugged:
            due = [i for i in due if i == mav.MAVLINK_MSG_ID_WIND]  # which is heard of on the other ports too
        for msgid in due:
            if msgid == mav.MAVLINK_MSG_ID_AIS_VESSEL:
                message = self.ais_list.next_message(link.number, t_s)
            else:
                message = BUILDERS[msgid](self._pilot)
            if message is None:
                continue
            link.send(message)
            if msgid == mav.MAVLINK_MSG_ID_WIND:
                # named floats go out on every port on which somebody was heard, whoever asked for WIND
                for named in named_floats(self._pilot):
                    for other in self._voice.links.values():
                        if other is link or other.is_heard:
                            other.send(named)
