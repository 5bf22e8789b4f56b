"""MAVFTP's server, as far as missions need it: @MISSION/mission.dat, fence.dat and rally.dat.

A file is a header and packed MISSION_ITEM_INT; what was written takes effect at TerminateSession, in one piece.
While a mission runs it cannot be cleared, so a shorter file leaves the old tail behind, as on the real one.
"""

from __future__ import annotations

import struct
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as mav

from sitl.autopilot.pilot.core import Core
from sitl.autopilot.pilot.items import FENCE, FILE_ITEM, MISSION, RALLY, Item, accept, from_file, to_file
from sitl.autopilot.pilot.storage import Storage
from sitl.autopilot.protocol.transfer import LIMITS

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
            data = payload[_FRAME.size:_FRAME.size + min(size, _DATA_MAX)]
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
            piece = bytes(self._data[offset:offset + min(size or _DATA_MAX, _DATA_MAX)])
            return (_ACK, piece, offset) if piece else _nak(_END)
        if opcode == _WRITE:
            if not self._is_writing or offset > len(self._data) or offset > HEADER.size + FILE_ITEM.size * 1400:
                return _nak(_FAIL)
            self._data[offset:offset + len(data)] = data
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
