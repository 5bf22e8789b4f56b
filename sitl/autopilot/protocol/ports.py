"""What arrives on the ports is routed and handed on, what is due is sent."""

from __future__ import annotations

from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as mav

from sitl.autopilot.links.link import FIRST_STREAMS_S, Link, Router
from sitl.autopilot.pilot.pilot import Pilot
from sitl.autopilot.protocol import commands
from sitl.autopilot.protocol.ais_list import AisList
from sitl.autopilot.protocol.ftp import FtpServer
from sitl.autopilot.protocol.parameter_server import ParameterServer
from sitl.autopilot.protocol.telemetry import BUILDERS, named_floats, send_once
from sitl.autopilot.protocol.transfer import TransferServer

_SETPOINTS = frozenset({
    "SET_ATTITUDE_TARGET", "SET_POSITION_TARGET_GLOBAL_INT", "SET_POSITION_TARGET_LOCAL_NED",
})


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

    def _message(self, m: Any, link: Link) -> None:
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
            commands.execute(pilot, m, link)
        elif name == "MISSION_SET_CURRENT":
            mission = pilot.helm.mission
            if m.seq < len(mission.items) and mission.set_current(m.seq):
                send_once(pilot, link, mav.MAVLINK_MSG_ID_MISSION_CURRENT)
        elif name.startswith("MISSION_"):
            self._transfers.handle(m, link.number, self._core.t_s)
        elif name.startswith("PARAM_"):
            self._parameters.handle(m, link)
        elif name in _SETPOINTS:
            commands.setpoint(pilot, m)
        elif name == "HEARTBEAT":
            pilot.failsafe.heard((m.get_srcSystem(), m.get_srcComponent()))
        elif name == "FILE_TRANSFER_PROTOCOL" and self._core.config.has_ftp:
            self._ftp.handle(m, link.number)
        elif name == "SET_MODE":
            pilot.helm.set_mode(m.custom_mode)
        elif name == "REQUEST_DATA_STREAM":
            commands.send_group(pilot, m, link)
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

    def _send_streams(self, link: Link, t_s: float) -> None:
        due = link.take_due(t_s)
        if self._core.boot_s < FIRST_STREAMS_S:
            due = [i for i in due if i == mav.MAVLINK_MSG_ID_HEARTBEAT]
        if not link.is_plugged:
            due = [i for i in due if i == mav.MAVLINK_MSG_ID_WIND]   # which is heard of on the other ports too
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
