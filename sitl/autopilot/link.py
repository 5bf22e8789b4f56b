"""The autopilot's MAVLink ports: parsing, packing, stream rates, routing, and what it says on all of them."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as mav

from companion.mavlink.wire import Dialect

LOOP_S = 0.02
# What a port sends at 1 Hz without being asked, in the order seen on the real one.
DEFAULT_STREAMS: tuple[int, ...] = (
    mav.MAVLINK_MSG_ID_HEARTBEAT,
    mav.MAVLINK_MSG_ID_AHRS,
    mav.MAVLINK_MSG_ID_AHRS2,
    mav.MAVLINK_MSG_ID_ATTITUDE,
    mav.MAVLINK_MSG_ID_GLOBAL_POSITION_INT,
    mav.MAVLINK_MSG_ID_VFR_HUD,
    mav.MAVLINK_MSG_ID_SYS_STATUS,
    mav.MAVLINK_MSG_ID_POWER_STATUS,
    mav.MAVLINK_MSG_ID_MEMINFO,
    mav.MAVLINK_MSG_ID_NAV_CONTROLLER_OUTPUT,
    mav.MAVLINK_MSG_ID_MISSION_CURRENT,
    mav.MAVLINK_MSG_ID_SERVO_OUTPUT_RAW,
    mav.MAVLINK_MSG_ID_RC_CHANNELS,
    mav.MAVLINK_MSG_ID_RAW_IMU,
    mav.MAVLINK_MSG_ID_SCALED_IMU2,
    mav.MAVLINK_MSG_ID_SCALED_IMU3,
    mav.MAVLINK_MSG_ID_SCALED_PRESSURE,
    mav.MAVLINK_MSG_ID_SCALED_PRESSURE2,
    mav.MAVLINK_MSG_ID_GPS_RAW_INT,
    mav.MAVLINK_MSG_ID_SYSTEM_TIME,
    mav.MAVLINK_MSG_ID_RC_CHANNELS_SCALED,
    mav.MAVLINK_MSG_ID_SIMSTATE,
    mav.MAVLINK_MSG_ID_WIND,
    mav.MAVLINK_MSG_ID_EKF_STATUS_REPORT,
    mav.MAVLINK_MSG_ID_VIBRATION,
    mav.MAVLINK_MSG_ID_RPM,
    mav.MAVLINK_MSG_ID_BATTERY_STATUS,
    mav.MAVLINK_MSG_ID_LOCAL_POSITION_NED,
    mav.MAVLINK_MSG_ID_POSITION_TARGET_GLOBAL_INT,
    mav.MAVLINK_MSG_ID_FENCE_STATUS,
    mav.MAVLINK_MSG_ID_GPS_GLOBAL_ORIGIN,
    mav.MAVLINK_MSG_ID_HOME_POSITION,
)
# Can be asked for, off by default.
OPTIONAL_STREAMS: tuple[int, ...] = (
    mav.MAVLINK_MSG_ID_AIS_VESSEL,
    mav.MAVLINK_MSG_ID_ATTITUDE_QUATERNION,
    mav.MAVLINK_MSG_ID_HIGH_LATENCY2,
    mav.MAVLINK_MSG_ID_EXTENDED_SYS_STATE,
    mav.MAVLINK_MSG_ID_AUTOPILOT_VERSION,
    mav.MAVLINK_MSG_ID_GPS2_RAW,
    mav.MAVLINK_MSG_ID_DISTANCE_SENSOR,
)
STREAMABLE = frozenset((*DEFAULT_STREAMS, *OPTIONAL_STREAMS))
# MAV_DATA_STREAM -> its messages
GROUPS: dict[int, tuple[int, ...]] = {
    1: (27, 116, 129, 29, 137),  # raw sensors
    2: (1, 125, 152, 42, 24, 62, 162, 87),  # extended status
    3: (36, 65),  # radio control
    4: (34,),  # raw controller
    6: (33, 32),  # position
    10: (30, 163, 178, 164),  # extra 1
    11: (74,),  # extra 2
    12: (168, 193, 241, 226, 147, 2),  # extra 3
}
MAX_BUFFER_BYTES = 65536
MAX_UNREAD_BYTES = 1 << 20
FIRST_STREAMS_S = 2.96
SIGNING_AHEAD = 60 * 100_000  # of a key's timestamp when it is taken up [10 µs]


class MavlinkPort:
    """One port: a parser, a sequence number, a buffer of outgoing bytes, the rates asked for on it."""

    def __init__(self, number: int, sysid: int) -> None:
        self.number = number
        self.is_heard = False
        self.is_plugged = True  # else what is said on it goes nowhere, and its bytes are not made
        self.last_heard_s = -math.inf
        self._codec = Dialect(None, srcSystem=sysid, srcComponent=1)
        self._codec.robust_parsing = True
        self._out = bytearray()
        self.inbox = bytearray()
        self.dropped_bytes = 0
        self._interval_s: dict[int, float] = {}
        # messages of one rate are sent together: (interval, next due time, messages)
        self._buckets: list[tuple[float, float, tuple[int, ...]]] = []
        self.due_s = math.inf  # when the next stream is
        self.restart(0.0)

    def sign(self, key: bytes, timestamp: int) -> None:
        """Sign what is sent and demand it of what is heard, but on port 0, the USB; all zero: neither."""
        signing = self._codec.signing
        is_on = timestamp > 0 or any(key)
        signing.secret_key, signing.sign_outgoing = (key, True) if is_on else (None, False)
        signing.link_id, signing.timestamp = self.number, timestamp + SIGNING_AHEAD
        signing.stream_timestamps.clear()
        signing.allow_unsigned_callback = lambda _, msgid: (
            self.number == 0 or msgid in {mav.MAVLINK_MSG_ID_RADIO_STATUS, mav.MAVLINK_MSG_ID_RADIO}
        )

    # --------------------------------------------------------------------------------------------- bytes
    def hear(self, data: bytes) -> None:
        """Take bytes that arrived; they are read at the next loop."""
        if len(self.inbox) < MAX_UNREAD_BYTES:
            self.inbox += data

    def read(self) -> Iterator[Any]:
        """Return the good messages in what arrived; noise is skipped."""
        data = bytes(self.inbox)
        self.inbox.clear()
        for m in self._codec.parse_buffer(data) or ():
            if m.get_type() != "BAD_DATA" and not m.get_type().startswith("UNKNOWN"):
                yield m

    def send(self, message: Any) -> None:
        """Pack a message of our own; when nobody drains the port, it is dropped whole."""
        if not self.is_plugged:
            return
        self.forward(self._codec.packed(message))
        self._codec.seq = (self._codec.seq + 1) & 0xFF

    def forward(self, frame: bytes) -> None:
        """Pass bytes on as they are."""
        if len(self._out) + len(frame) > MAX_BUFFER_BYTES:
            self.dropped_bytes += len(frame)
        else:
            self._out += frame

    def take(self) -> bytes:
        """Return and forget what waits to be sent."""
        data = bytes(self._out)
        self._out.clear()
        return data

    @property
    def has_output(self) -> bool:
        """Whether ``take`` would return something."""
        return bool(self._out)

    # ----------------------------------------------------------------------------------------------- rates
    def restart(self, t_s: float) -> None:
        """A boot: default rates, nothing heard."""
        self.is_heard = False
        self._interval_s = dict.fromkeys(DEFAULT_STREAMS, 1.0)
        self._buckets = []
        self._rebuild(t_s)

    def interval_s(self, msgid: int) -> float:
        """Return the interval of a message, 0 when it is off."""
        return self._interval_s.get(msgid, 0.0)

    def set_interval(self, msgids: tuple[int, ...], interval_s: float, t_s: float) -> None:
        """Set a rate; 0 switches off."""
        for msgid in msgids:
            if interval_s > 0.0:
                self._interval_s[msgid] = interval_s
            else:
                self._interval_s.pop(msgid, None)
        self._rebuild(t_s)

    def _rebuild(self, t_s: float) -> None:
        due = {interval: when for interval, when, _ in self._buckets}
        groups: dict[float, list[int]] = {}
        for msgid in (*DEFAULT_STREAMS, *OPTIONAL_STREAMS):
            interval = self._interval_s.get(msgid)
            if interval is not None:
                groups.setdefault(interval, []).append(msgid)
        self._buckets = [(i, due.get(i, t_s + i), tuple(ids)) for i, ids in sorted(groups.items())]
        self._see_due()

    def _see_due(self) -> None:
        self.due_s = min((when for _, when, _ in self._buckets), default=math.inf)

    def take_due(self, t_s: float) -> list[int]:
        """Return the messages that are due, each once, and move their clocks on."""
        out: list[int] = []
        for n, (interval, when, msgids) in enumerate(self._buckets):
            if when <= t_s + 1e-9:
                out.extend(msgids)
                # whole intervals, so that a rate that does not divide the loop rate is kept on average
                missed = math.floor((t_s - when) / interval + 1e-9)
                self._buckets[n] = (interval, when + (missed + 1) * interval, msgids)
        self._see_due()
        return out


class Router:
    """MAVLink_routing: who was heard where since boot, and where a frame goes on to."""

    def __init__(self, sysid: int) -> None:
        self._sysid = sysid
        self._routes: dict[tuple[int, int], set[int]] = {}

    def learn(self, m: Any, link: int) -> None:
        """Remember that the sender lives on ``link``."""
        sender = (m.get_srcSystem(), m.get_srcComponent())
        if 0 not in sender and sender != (self._sysid, 1):
            self._routes.setdefault(sender, set()).add(link)

    def route(self, m: Any, link: int, links: dict[int, MavlinkPort]) -> tuple[bool, list[int]]:
        """Return (is it for us, links to forward it to).

        A broadcast goes to every other link on which somebody was heard; a frame with a target goes where the
        target is known. What is for another component of our system and was forwarded is not ours.
        """
        sender = (m.get_srcSystem(), m.get_srcComponent())
        if sender == (self._sysid, 1):
            return False, []
        system = getattr(m, "target_system", 0) or 0
        component = getattr(m, "target_component", 0) or 0
        if system == 0:
            return True, [n for n in sorted(links) if n != link and links[n].is_heard]
        ours = system == self._sysid
        if ours and component == 1:
            return True, []
        targets: set[int] = set()
        for (known_system, known_component), where in self._routes.items():
            if known_system == system and component in {0, known_component}:
                targets |= where
        targets.discard(link)
        forward = [n for n in sorted(targets) if n in links]
        return ours and (component == 0 or not forward), forward


class Voice:
    """The ports by number."""

    def __init__(self, sysid: int) -> None:
        self._sysid = sysid
        self.links: dict[int, MavlinkPort] = {}
        self._text_id = 0
        self._late_texts: list[tuple[int, str]] = []
        self._key: tuple[bytes, int] | None = None  # and its timestamp; kept over reboots

    @property
    def has_work(self) -> bool:
        """Whether bytes wait to be read or texts to be sent."""
        if self._late_texts:
            return True
        for link in self.links.values():  # noqa: SIM110 - asked at every loop, as the next one is: no generators
            if link.inbox:
                return True
        return False

    @property
    def due_s(self) -> float:
        """When the next stream of any port is due."""
        due_s = math.inf
        for link in self.links.values():
            due_s = min(due_s, link.due_s)
        return due_s

    def open(self, number: int, t_s: float) -> MavlinkPort:
        """Return a port; a new one sends the default streams from now on."""
        link = self.links.get(number)
        if link is None:
            link = self.links[number] = MavlinkPort(number, self._sysid)
            link.restart(t_s)
            if self._key is not None:
                link.sign(*self._key)
        return link

    def take_key(self, key: bytes, timestamp: int) -> None:
        """SETUP_SIGNING: from now on, on every port."""
        self._key = key, timestamp
        for link in self.links.values():
            link.sign(key, timestamp)

    def restart(self, t_s: float) -> None:
        """A reboot: default rates, nothing waiting."""
        self._late_texts.clear()
        for link in self.links.values():
            link.restart(t_s)
            link.take()

    def announce(self, severity: int, text: str) -> None:
        """STATUSTEXT on every port, in chunks of 50 characters."""
        pieces = [text[i : i + 50] for i in range(0, len(text), 50)] or [""]
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
        if not self._late_texts:
            return
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
