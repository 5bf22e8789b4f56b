"""All ports of the autopilot: what arrives is routed and handed on, what is due is sent."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pymavlink.dialects.v20 import ardupilotmega as mav

from sitl.autopilot.protocol import commands
from sitl.autopilot.links.link import FIRST_STREAMS_S, Link, Router
from sitl.autopilot.protocol.telemetry import BUILDERS, apparent_wind

if TYPE_CHECKING:
    from sitl.autopilot.autopilot import Autopilot

_MAX_UNREAD_BYTES = 1 << 20
_SETPOINTS = frozenset({
    "SET_ATTITUDE_TARGET", "SET_POSITION_TARGET_GLOBAL_INT", "SET_POSITION_TARGET_LOCAL_NED",
})


class Ports:
    """The links by number, the routes between them, and the voice on all of them."""

    def __init__(self, autopilot: Autopilot, sysid: int) -> None:
        self._a = autopilot
        self._sysid = sysid
        self.links: dict[int, Link] = {}
        self._router = Router(sysid)
        self._text_id = 0
        self._late_texts: list[tuple[int, str]] = []

    @property
    def has_work(self) -> bool:
        """Whether bytes wait to be read or texts to be sent."""
        return bool(self._late_texts) or any(link.inbox for link in self.links.values())

    @property
    def due_s(self) -> float:
        """When the next stream of any port is due."""
        return min((link.due_s for link in self.links.values()), default=float("inf"))

    def restart(self, t_s: float) -> None:
        """A reboot: default rates, no routes, nothing waiting."""
        self._router.forget()
        self._late_texts.clear()
        for link in self.links.values():
            link.restart(t_s)
            link.take()

    def open(self, number: int) -> Link:
        """Return a port; a new one sends the default streams from now on."""
        link = self.links.get(number)
        if link is None:
            link = self.links[number] = Link(number, self._sysid)
            link.restart(self._a.t_s)
        return link

    def receive(self, number: int, data: bytes) -> None:
        """Take bytes that arrived; they are read at the next loop."""
        link = self.open(number)
        if len(link.inbox) < _MAX_UNREAD_BYTES:
            link.inbox += data

    # ------------------------------------------------------------------------------------------------ in
    def read(self) -> None:
        """Act on what arrived on every port."""
        for link in list(self.links.values()):
            if link.inbox:
                data = bytes(link.inbox)
                link.inbox.clear()
                for m in link.parse(data):
                    self._message(m, link)

    def _message(self, m: Any, link: Link) -> None:
        a = self._a
        link.is_heard = True
        link.last_heard_s = a.t_s
        self._router.learn(m, link.number)
        is_ours, forward = self._router.route(m, link.number, self.links)
        frame = bytes(m.get_msgbuf())
        for number in forward:
            self.links[number].forward(frame)
        if not is_ours:
            return
        name = m.get_type()
        if name in {"COMMAND_LONG", "COMMAND_INT"}:
            commands.execute(a, m, link)
        elif name.startswith("MISSION_"):
            self._mission_message(m, name, link)
        elif name.startswith("PARAM_"):
            a.parameter_server.handle(m, link)
        elif name in _SETPOINTS:
            commands.setpoint(a, m)
        elif name == "HEARTBEAT":
            a.failsafe.heard((m.get_srcSystem(), m.get_srcComponent()))
        elif name == "FILE_TRANSFER_PROTOCOL" and a.config.has_ftp:
            a.ftp.handle(m, link.number)
        elif name == "SET_MODE":
            a.helm.set_mode(m.custom_mode)
        elif name == "REQUEST_DATA_STREAM":
            commands.send_group(a, m, link)
        elif name == "TIMESYNC" and m.tc1 == 0:
            link.send(mav.MAVLink_timesync_message(a.boot_us * 1000, m.ts1))

    def _mission_message(self, m: Any, name: str, link: Link) -> None:
        a = self._a
        if name == "MISSION_SET_CURRENT":
            if m.seq < len(a.helm.mission.items) and a.helm.mission.set_current(m.seq):
                self.send_once(link, mav.MAVLINK_MSG_ID_MISSION_CURRENT)
        else:
            a.transfers.handle(m, link.number, a.t_s)

    # ----------------------------------------------------------------------------------------------- out
    def send_due(self) -> None:
        """Send the streams that are due, and texts that waited."""
        t_s = self._a.t_s
        for link in self.links.values():
            self._send_streams(link, t_s)
        self.after_ack()

    def _send_streams(self, link: Link, t_s: float) -> None:
        if link.due_s > t_s + 1e-9:
            return
        due = link.take_due(t_s)
        if self._a.boot_s < FIRST_STREAMS_S:
            due = [i for i in due if i == mav.MAVLINK_MSG_ID_HEARTBEAT]
        for msgid in due:
            if msgid == mav.MAVLINK_MSG_ID_AIS_VESSEL:
                message = self._a.traffic.next_message(link.number)
            else:
                message = BUILDERS[msgid](self._a)
            if message is None:
                continue
            link.send(message)
            if msgid == mav.MAVLINK_MSG_ID_WIND:
                # named floats go out on every port on which somebody was heard, whoever asked for WIND
                for named in apparent_wind(self._a):
                    for other in self.links.values():
                        if other is link or other.is_heard:
                            other.send(named)

    def announce(self, severity: int, text: str) -> None:
        """STATUSTEXT on every port, in chunks of 50 characters."""
        pieces = [text[i:i + 50] for i in range(0, len(text), 50)] or [""]
        ident = 0
        if len(pieces) > 1:
            self._text_id = self._text_id % 65535 + 1
            ident = self._text_id
        for n, piece in enumerate(pieces):
            self.broadcast(mav.MAVLink_statustext_message(severity, piece.encode("ascii", "replace"), ident, n))

    def announce_after_ack(self, severity: int, text: str) -> None:
        """As ``announce``, behind the acknowledgement of the command being carried out."""
        self._late_texts.append((severity, text))

    def after_ack(self) -> None:
        """A command was acknowledged: say what belongs behind it."""
        late, self._late_texts = self._late_texts, []
        for severity, text in late:
            self.announce(severity, text)

    def broadcast(self, message: Any) -> None:
        """Send on every port."""
        for link in self.links.values():
            link.send(message)

    def reply(self, message: Any, link: int) -> None:
        """Send on one port."""
        if link in self.links:
            self.links[link].send(message)

    def send_once(self, link: Link, msgid: int) -> bool:
        """Send a message now; False if there is none of that kind, or none at this moment."""
        builder = BUILDERS.get(msgid)
        message = builder(self._a) if builder is not None else None
        if message is None:
            return False
        link.send(message)
        return True
