"""The mission protocol's server and MAVFTP's, as far as missions need it.

A step machine without a clock of its own: ``handle`` takes a message at a time, ``update`` lets time pass. One
upload at a time; each item is asked for in one loop and written in the next.

A file is a header and packed MISSION_ITEM_INT; what was written takes effect at TerminateSession, in one piece.
While a mission runs it cannot be cleared, so a shorter file leaves the old tail behind, as on the real one.
"""

from __future__ import annotations

import math
import struct
from dataclasses import dataclass
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as mav

from sitl.autopilot.link import Voice
from sitl.autopilot.pilot.core import Core
from sitl.autopilot.pilot.mission import (
    FENCE,
    FILE_ITEM,
    MAX_FENCE,
    MAX_MISSION,
    MAX_RALLY,
    MISSION,
    RALLY,
    Item,
    accept,
    from_file,
    item_from_message,
    to_file,
)
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
        self._upload = _Upload(kind, link, sender, 0, m.count - 1, t_s, t_s)
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
        self._upload = _Upload(kind, link, sender, m.start_index, m.end_index, t_s, t_s)
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


HEADER = struct.Struct("<HHHHH")
MAGIC = 0x763D
NO_CLEAR = 1
_FRAME = struct.Struct("<HBBBBBBI")
_DATA_MAX = 239
_IDLE_S = 3.0
_SHOWN_SIZE = 0x100000  # what the real one says before it knows
_ACK, _NAK = 128, 129
_FAIL, _ERRNO, _NO_SESSION, _END, _UNKNOWN, _NOT_FOUND = 1, 2, 4, 6, 7, 10
_EINVAL = 22
_TERMINATE, _RESET, _LIST, _OPEN_READ, _READ, _CREATE, _WRITE, _OPEN_WRITE = 1, 2, 3, 4, 5, 6, 7, 11
FILES = {"@MISSION/mission.dat": MISSION, "@MISSION/fence.dat": FENCE, "@MISSION/rally.dat": RALLY}


class FtpServer:
    """One session at a time."""

    def __init__(self, core: Core, storage: Storage) -> None:
        self._core = core
        self._storage = storage
        self._kind: int | None = None
        self._is_writing = False
        self._data = bytearray()
        self._session = 0
        self._used_s = 0.0
        self._last: tuple[tuple[int, int], int, bytes] | None = None

    def handle(self, m: Any, link: int) -> None:
        """Answer one FILE_TRANSFER_PROTOCOL."""
        payload = bytes(m.payload)
        sender = (m.get_srcSystem(), m.get_srcComponent())
        seq, session, opcode, size, _req, _burst, _pad, offset = _FRAME.unpack_from(payload)
        if opcode in {_ACK, _NAK}:
            return
        if self._last is not None and self._last[:2] == (sender, seq):
            reply = self._last[2]  # our answer was lost: the same again, the work is not done twice
        else:
            data = payload[_FRAME.size : _FRAME.size + min(size, _DATA_MAX)]
            code, answer, at = self._execute(opcode, session, data, offset, size)
            head = _FRAME.pack((seq + 1) & 0xFFFF, self._session, code, len(answer), opcode, 0, 0, at)
            reply = (head + answer).ljust(251, b"\0")
            self._last = (sender, seq, reply)
        self._core.voice.reply(mav.MAVLink_file_transfer_protocol_message(0, *sender, list(reply)), link)

    def _execute(self, opcode: int, session: int, data: bytes, offset: int, size: int) -> tuple[int, bytes, int]:
        t_s = self._core.t_s
        if opcode in {_CREATE, _OPEN_WRITE, _OPEN_READ}:
            if self._kind is not None and t_s - self._used_s < _IDLE_S:
                return _nak(_FAIL)
            kind = FILES.get(data.rstrip(b"\0").decode("ascii", "replace"))
            if kind is None:
                return _nak(_NOT_FOUND)
            self._kind, self._is_writing = kind, opcode != _OPEN_READ
            self._session, self._used_s = session, t_s
            self._data = bytearray() if self._is_writing else bytearray(self._whole_file(kind))
            return _ACK, b"" if self._is_writing else struct.pack("<I", _SHOWN_SIZE), 0
        if opcode == _RESET:
            self._kind = None
            return _ACK, b"", 0
        if opcode == _LIST:
            return _NAK, bytes([_ERRNO, _EINVAL]), 0
        if opcode not in {_TERMINATE, _READ, _WRITE}:
            return _nak(_UNKNOWN)
        if self._kind is None or session != self._session:
            return (_ACK, b"", 0) if opcode == _TERMINATE else _nak(_NO_SESSION)
        self._used_s = t_s
        if opcode == _READ:
            if self._is_writing:
                return _nak(_FAIL)
            piece = bytes(self._data[offset : offset + min(size or _DATA_MAX, _DATA_MAX)])
            return (_ACK, piece, offset) if piece else _nak(_END)
        if opcode == _WRITE:
            if not self._is_writing or offset > len(self._data) or offset > HEADER.size + FILE_ITEM.size * 1400:
                return _nak(_FAIL)
            self._data[offset : offset + len(data)] = data
            return _ACK, b"", offset
        kind, self._kind = self._kind, None
        if self._is_writing:
            self._commit(kind, bytes(self._data))
        # the real one acknowledges whatever became of the file: read back and compare
        return _ACK, b"", 0

    def _whole_file(self, kind: int) -> bytes:
        stored = self._storage.read_list(kind)
        head = HEADER.pack(MAGIC, kind, 0, 0, len(stored))
        return head + b"".join(to_file(item, seq, kind) for seq, item in enumerate(stored))

    def _commit(self, kind: int, data: bytes) -> None:
        """Put the file's items in place: up to the first bad one, behind a list that was cleared if it could be."""
        if len(data) < HEADER.size:
            return
        magic, file_kind, options, start, count = HEADER.unpack_from(data)
        if magic != MAGIC or file_kind != kind or start + count > LIMITS[kind]:
            return
        whole = data.ljust(HEADER.size + -(-(len(data) - HEADER.size) // FILE_ITEM.size) * FILE_ITEM.size, b"\0")
        new: list[Item] = []
        for n in range(min(count, (len(whole) - HEADER.size) // FILE_ITEM.size)):
            item, _ = accept(from_file(whole, HEADER.size + n * FILE_ITEM.size), kind)
            if item is None:
                break
            new.append(item)
        if kind != MISSION:
            self._storage.replace_list(kind, new)
            return
        mission = self._storage.mission
        if not options & NO_CLEAR:
            self._storage.clear_list(MISSION)
        if start <= len(mission.items):
            for n, item in enumerate(new):
                mission.put(start + n, item)


def _nak(error: int) -> tuple[int, bytes, int]:
    return _NAK, bytes([error]), 0
