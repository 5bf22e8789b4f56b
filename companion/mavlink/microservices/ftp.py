"""MAVFTP: write a file, read a file. Pure step machines.

ArduPilot answers a request twice with the same sequence number by sending its last answer again, so a lost frame is
repeated with its number and nothing is written or committed twice. ``@MISSION/mission.dat`` is taken in one piece at
TerminateSession.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass

from pymavlink.dialects.v20 import ardupilotmega as wire

from companion.mavlink.microservices.command import Party, Retransmission, TransferOutcome
from companion.mavlink.wire.frames import Message

MISSION_FILE = "@MISSION/mission.dat"
FENCE_FILE = "@MISSION/fence.dat"
RALLY_FILE = "@MISSION/rally.dat"

_HEAD = struct.Struct("<HBBBBBBI")
_PAYLOAD_BYTES = 251
CHUNK_BYTES = 239

TERMINATE, RESET, OPEN_READ, READ, CREATE, WRITE = 1, 2, 4, 5, 6, 7
ACK, NAK = 128, 129
_EOF, _UNKNOWN_COMMAND, _NOT_FOUND = 6, 7, 10
# What opening a file is refused with while a session of a program that died is still open: ArduRover says 1 (failed),
# the protocol has 5 (no session free). Then sessions are reset and it is tried once more.
_PERHAPS_BUSY = frozenset({1, 2, 4, 5, 8})
ERRORS = {
    1: "failed",
    2: "failed (errno)",
    3: "wrong size",
    4: "no such session",
    5: "no session free",
    6: "end of file",
    7: "unknown command",
    8: "file exists",
    9: "file protected",
    10: "file not found",
}


@dataclass(frozen=True, slots=True)
class Packet:
    """The payload of FILE_TRANSFER_PROTOCOL."""

    seq: int
    session: int
    opcode: int
    size: int = 0
    req_opcode: int = 0
    burst_complete: int = 0
    offset: int = 0
    data: bytes = b""

    def pack(self) -> list[int]:
        """Return the 251 payload bytes."""
        size = self.size or len(self.data)
        head = _HEAD.pack(
            self.seq & 0xFFFF, self.session, self.opcode, size, self.req_opcode, self.burst_complete, 0, self.offset
        )
        return list((head + self.data).ljust(_PAYLOAD_BYTES, b"\x00"))


def unpack(payload: list[int]) -> Packet:
    """Return the packet in a payload; ``data`` is cut to the size that the packet states."""
    raw = bytes(payload).ljust(_PAYLOAD_BYTES, b"\x00")
    seq, session, opcode, size, req_opcode, burst, _, offset = _HEAD.unpack_from(raw)
    return Packet(seq, session, opcode, size, req_opcode, burst, offset, raw[_HEAD.size : _HEAD.size + size])


@dataclass(frozen=True, slots=True, kw_only=True)
class FtpResult:
    """How a file transfer ended; ``data`` is what was read."""

    outcome: TransferOutcome
    text: str = ""
    data: bytes = b""
    error: int | None = None
    next_seq: int = 0


class _Ftp:
    """A session: one request at a time, repeated with its number until answered."""

    def __init__(self, party: Party, path: str, seq: int) -> None:
        self.result: FtpResult | None = None
        self._party, self._path = party, path.encode("ascii")
        self._seq = seq & 0xFFFF
        self._session = 0
        self._request = Packet(0, 0, 0)
        # a session is repeated longer than other conversations: it is all or nothing
        self._retry = Retransmission(first_s=0.5, cap_s=1.5, give_up_s=12.0)
        self._reset_done = False

    @property
    def wake_s(self) -> float:
        """When ``tick`` is due [s]."""
        return self._retry.wake_s

    def tick(self, t_s: float) -> list[Message]:
        """Repeat the request, or give up."""
        if self._retry.again(t_s):
            return [self._message()]
        return self._gave_up()

    def _gave_up(self) -> list[Message]:
        return self._end(TransferOutcome.TIMEOUT, "MAVFTP does not answer")

    def _ask(self, t_s: float, opcode: int, *, size: int = 0, offset: int = 0, data: bytes = b"") -> list[Message]:
        self._request = Packet(self._seq, self._session, opcode, size, 0, 0, offset, data)
        self._retry.progress(t_s)
        return [self._message()]

    def _message(self) -> Message:
        return wire.MAVLink_file_transfer_protocol_message(0, *self._party.target, self._request.pack())

    def _answer(self, message: Message) -> Packet | None:
        """Return the packet if it answers the present request."""
        if (
            self.result is not None
            or message.get_type() != "FILE_TRANSFER_PROTOCOL"
            or not self._party.is_from_target(message)
            or not self._party.is_for_us(message)
        ):
            return None
        packet = unpack(message.payload)
        if packet.seq != (self._request.seq + 1) & 0xFFFF or packet.req_opcode != self._request.opcode:
            return None
        if packet.opcode not in {ACK, NAK}:
            return None
        self._seq = packet.seq
        return packet

    def _error(self, packet: Packet) -> int:
        return packet.data[0] if packet.data else 1

    def _refused(self, packet: Packet) -> list[Message]:
        error = self._error(packet)
        outcome = TransferOutcome.UNSUPPORTED if error in {_UNKNOWN_COMMAND, _NOT_FOUND} else TransferOutcome.REFUSED
        words = f"MAVFTP error {error} ({ERRORS.get(error, 'unknown')}) at opcode {self._request.opcode}"
        return self._end(outcome, words, error=error)

    def _end(
        self, outcome: TransferOutcome, text: str = "", *, data: bytes = b"", error: int | None = None
    ) -> list[Message]:
        # + 2: a late answer to the last request cannot be taken for one to the next session's first
        self.result = FtpResult(outcome=outcome, text=text, data=data, error=error, next_seq=(self._seq + 2) & 0xFFFF)
        return []


class FtpWrite(_Ftp):
    """Creates a file, writes it, closes it; the autopilot acts on it when it is closed."""

    def __init__(self, party: Party, path: str, data: bytes, *, seq: int = 0) -> None:
        super().__init__(party, path, seq)
        self._data = data
        self._at = 0

    def start(self, t_s: float) -> list[Message]:
        """Create the file."""
        return self._ask(t_s, CREATE, data=self._path)

    def receive(self, t_s: float, message: Message) -> list[Message]:
        """Go on to the next chunk."""
        packet = self._answer(message)
        if packet is None:
            return []
        opcode = self._request.opcode
        if packet.opcode == NAK:
            if opcode == CREATE and self._error(packet) in _PERHAPS_BUSY and not self._reset_done:
                self._reset_done = True
                return self._ask(t_s, RESET)
            return self._refused(packet)
        if opcode == RESET:
            return self._ask(t_s, CREATE, data=self._path)
        if opcode == TERMINATE:
            return self._end(TransferOutcome.OK)
        if opcode == CREATE:
            self._session = packet.session
        else:
            self._at += len(self._request.data)
        if self._at >= len(self._data):
            return self._ask(t_s, TERMINATE)
        return self._ask(t_s, WRITE, offset=self._at, data=self._data[self._at : self._at + CHUNK_BYTES])

    def _gave_up(self) -> list[Message]:
        if self._request.opcode == TERMINATE:
            return self._end(TransferOutcome.UNCONFIRMED, "the file was written, closing it was not acknowledged")
        return super()._gave_up()


class FtpRead(_Ftp):
    """Reads a file chunk by chunk."""

    def __init__(self, party: Party, path: str, *, seq: int = 0) -> None:
        super().__init__(party, path, seq)
        self._chunks: dict[int, bytes] = {}
        self._end_at: int | None = None

    def start(self, t_s: float) -> list[Message]:
        """Open the file."""
        return self._ask(t_s, OPEN_READ, data=self._path)

    def receive(self, t_s: float, message: Message) -> list[Message]:
        """Go on to the next chunk."""
        packet = self._answer(message)
        if packet is None:
            return []
        opcode = self._request.opcode
        if packet.opcode == NAK:
            if opcode == READ and self._error(packet) == _EOF:
                self._end_at = min(self._request.offset, self._end_at or self._request.offset)
                return self._next(t_s)
            if opcode == OPEN_READ and self._error(packet) in _PERHAPS_BUSY and not self._reset_done:
                self._reset_done = True
                return self._ask(t_s, RESET)
            return self._finish() if opcode == TERMINATE else self._refused(packet)
        if opcode == RESET:
            return self._ask(t_s, OPEN_READ, data=self._path)
        if opcode == TERMINATE:
            return self._finish()
        if opcode == OPEN_READ:
            self._session = packet.session
        elif packet.offset == self._request.offset and packet.data:
            self._chunks[packet.offset] = packet.data
        else:
            return []  # nothing of what was asked for: asked again in its time, and not for ever
        return self._next(t_s)

    def _next(self, t_s: float) -> list[Message]:
        """Ask for the first byte that is missing, or close."""
        at = 0
        while self._chunks.get(at):
            at += len(self._chunks[at])
        if self._end_at is not None and at >= self._end_at:
            return self._ask(t_s, TERMINATE)
        return self._ask(t_s, READ, size=CHUNK_BYTES, offset=at)

    def _finish(self) -> list[Message]:
        data = bytearray()
        while len(data) in self._chunks and self._chunks[len(data)]:
            data += self._chunks[len(data)]
        return self._end(TransferOutcome.OK, data=bytes(data))

    def _gave_up(self) -> list[Message]:
        if self._request.opcode == TERMINATE:
            return self._finish()
        return super()._gave_up()
