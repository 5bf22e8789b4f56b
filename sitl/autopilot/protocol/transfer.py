"""The mission protocol's server: uploads and downloads of missions, fences and rally points.

A step machine without a clock of its own: ``handle`` takes a message at a time, ``update`` lets time pass. One
upload at a time; each item is asked for in one loop and written in the next.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as mav

from sitl.autopilot.links.voice import Voice
from sitl.autopilot.pilot.items import FENCE, MAX_FENCE, MAX_MISSION, MAX_RALLY, MISSION, RALLY, item_from_message
from sitl.autopilot.pilot.storage import Storage

REPEAT_S = 1.0
TIMEOUT_S = 8.0
LIMITS = {MISSION: MAX_MISSION, FENCE: MAX_FENCE, RALLY: MAX_RALLY}


@dataclass(slots=True)
class _Upload:
    kind: int
    link: int
    sender: tuple[int, int]
    next_index: int
    last_index: int
    asked_s: float
    heard_s: float
    is_partial: bool


class TransferServer:
    """Answers MISSION_* messages."""

    def __init__(self, storage: Storage, voice: Voice) -> None:
        self._storage = storage
        self._voice = voice
        self._upload: _Upload | None = None

    @property
    def due_s(self) -> float:
        """When ``update`` has something to do."""
        if self._upload is None:
            return math.inf
        return min(self._upload.asked_s + REPEAT_S, self._upload.heard_s + TIMEOUT_S)

    def update(self, t_s: float) -> None:
        """Ask again for what did not come; give up after eight seconds."""
        up = self._upload
        if up is None:
            return
        if t_s - up.heard_s >= TIMEOUT_S - 1e-9:
            self._upload = None
            self._ack(up.link, up.sender, mav.MAV_MISSION_OPERATION_CANCELLED, up.kind)
            self._voice.announce(mav.MAV_SEVERITY_WARNING, "Mission upload timeout")
        elif t_s - up.asked_s >= REPEAT_S - 1e-9:
            self._ask(up, t_s)

    def handle(self, m: Any, link: int, t_s: float) -> None:
        """Take one MISSION_ message."""
        sender = (m.get_srcSystem(), m.get_srcComponent())
        kind = getattr(m, "mission_type", MISSION)
        name = m.get_type()
        if kind not in LIMITS:
            self._ack(link, sender, mav.MAV_MISSION_UNSUPPORTED, kind)
            return
        if name == "MISSION_COUNT":
            self._count(m, kind, link, sender, t_s)
        elif name in {"MISSION_ITEM_INT", "MISSION_ITEM"}:
            self._item(m, kind, link, sender, t_s)
        elif name == "MISSION_WRITE_PARTIAL_LIST":
            self._partial(m, kind, link, sender, t_s)
        elif name == "MISSION_REQUEST_LIST":
            if self._upload is not None:
                self._ack(link, sender, mav.MAV_MISSION_DENIED, kind)
            else:
                self._send_count(kind, link, sender)
        elif name in {"MISSION_REQUEST_INT", "MISSION_REQUEST"}:
            self._request(m, kind, link, sender)
        elif name == "MISSION_CLEAR_ALL":
            if self._upload is not None:
                self._ack(link, sender, mav.MAV_MISSION_DENIED, kind)
            else:
                done = self._storage.clear_list(kind)
                self._ack(link, sender, mav.MAV_MISSION_ACCEPTED if done else mav.MAV_MISSION_ERROR, kind)

    # ------------------------------------------------------------------------------------------ upload
    def _count(self, m: Any, kind: int, link: int, sender: tuple[int, int], t_s: float) -> None:
        if self._upload is not None and self._upload.sender != sender:
            self._ack(link, sender, mav.MAV_MISSION_DENIED, kind)
            return
        if m.count > LIMITS[kind]:
            self._upload = None
            self._ack(link, sender, mav.MAV_MISSION_NO_SPACE, kind)
            self._voice.announce(mav.MAV_SEVERITY_WARNING, f"Only {LIMITS[kind]} items are supported")
            return
        self._upload = None
        self._storage.begin_list(kind, m.count)
        if m.count == 0:
            self._finish(kind, link, sender)
            return
        self._upload = _Upload(kind, link, sender, 0, m.count - 1, t_s, t_s, is_partial=False)
        self._ask(self._upload, t_s)

    def _partial(self, m: Any, kind: int, link: int, sender: tuple[int, int], t_s: float) -> None:
        if self._upload is not None and self._upload.sender != sender:
            self._ack(link, sender, mav.MAV_MISSION_DENIED, kind)
            return
        count = len(self._storage.read_list(kind))
        # one past the end appends one item
        if kind != MISSION or not 0 <= m.start_index <= m.end_index <= count or m.start_index >= LIMITS[kind]:
            self._ack(link, sender, mav.MAV_MISSION_ERROR, kind)
            self._voice.announce(mav.MAV_SEVERITY_WARNING, "Flight plan update rejected")
            return
        self._upload = _Upload(kind, link, sender, m.start_index, m.end_index, t_s, t_s, is_partial=True)
        self._ask(self._upload, t_s)

    def _item(self, m: Any, kind: int, link: int, sender: tuple[int, int], t_s: float) -> None:
        up = self._upload
        if up is None or sender != up.sender or kind != up.kind:
            self._ack(link, sender, mav.MAV_MISSION_ERROR if up is None else mav.MAV_MISSION_DENIED, kind)
            return
        if m.seq != up.next_index:
            self._ack(link, sender, mav.MAV_MISSION_INVALID_SEQUENCE, kind)
            return
        item, error = item_from_message(m)
        if item is None:
            self._upload = None
            self._ack(link, sender, error, kind)
            return
        self._storage.write_item(kind, m.seq, item)
        up.heard_s = t_s
        up.next_index += 1
        if up.next_index > up.last_index:
            self._upload = None
            self._finish(kind, link, sender)
        else:
            self._ask(up, t_s)

    def _finish(self, kind: int, link: int, sender: tuple[int, int]) -> None:
        result = self._storage.end_list(kind)
        self._ack(link, sender, result, kind)
        if kind == MISSION and result == mav.MAV_MISSION_ACCEPTED:
            self._voice.announce(mav.MAV_SEVERITY_INFO, "Flight plan received")

    def _ask(self, up: _Upload, t_s: float) -> None:
        up.asked_s = t_s
        request = mav.MAVLink_mission_request_message(*up.sender, up.next_index, up.kind)
        self._voice.reply(request, up.link)

    # ---------------------------------------------------------------------------------------- download
    def _request(self, m: Any, kind: int, link: int, sender: tuple[int, int]) -> None:
        if self._upload is not None:
            self._ack(link, sender, mav.MAV_MISSION_DENIED, kind)
            return
        items = self._storage.read_list(kind)
        if m.seq >= len(items):
            self._send_count(kind, link, sender)
            self._ack(link, sender, mav.MAV_MISSION_ERROR, kind)
            return
        i = items[m.seq]
        if m.get_type() == "MISSION_REQUEST_INT":
            message: Any = mav.MAVLink_mission_item_int_message(
                *sender, m.seq, i.frame, i.command, 0, 1, i.p1, i.p2, i.p3, i.p4, i.x, i.y, i.z, kind
            )
        else:
            message = mav.MAVLink_mission_item_message(
                *sender, m.seq, i.frame, i.command, 0, 1, i.p1, i.p2, i.p3, i.p4, i.x * 1e-7, i.y * 1e-7, i.z, kind
            )
        self._voice.reply(message, link)

    def _send_count(self, kind: int, link: int, sender: tuple[int, int]) -> None:
        count = len(self._storage.read_list(kind))
        self._voice.reply(mav.MAVLink_mission_count_message(*sender, count, kind), link)

    def _ack(self, link: int, sender: tuple[int, int], result: int, kind: int) -> None:
        self._voice.reply(mav.MAVLink_mission_ack_message(*sender, result, kind), link)
