"""MAVLink 2 frames out of bytes and bytes out of messages. Pure.

The parser trusts nothing: bytes that are no frame are skipped one at a time, so a torn frame or noise that looks
like a start never swallows the good frame behind it (pymavlink's own parser skips the whole claimed length).
Everything that is dropped is counted by reason; nothing raises. Payload decoding and the checksum are pymavlink's.
"""

from __future__ import annotations

import enum
import functools
import hashlib
import operator
import struct
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as wire

# pymavlink's codec with short ways for the frames that nearly all are: MAVLink 2, without a signature. Pure.
#
# The same bytes and the same messages as pymavlink's, which does everything else; a test compares them for every
# message of the dialect. pymavlink builds each message field by field and its checksum from copies: of a voyage under
# the virtual clock that took a sixth.

_STX = wire.PROTOCOL_MARKER_V2
_HEADER = struct.Struct("<BBBBBBBHB")
_CRC = struct.Struct("<H")
_HEADER_BYTES, _CRC_BYTES = 10, 2
# Without fastcrc, and where a wrong checksum is to be overlooked, pymavlink does it all.
_checksum: Callable[[bytes], int] | None = None if wire.MAVLINK_IGNORE_CRC else wire.mcrf4xx


@dataclass(frozen=True, slots=True)
class _Layout:
    """How a message without arrays of numbers lies in a frame; ``texts`` are its fields of characters."""

    kind: type[Any]
    codec: struct.Struct
    crc_extra: bytes
    names: tuple[str, ...]  # of the fields, in the order of the frame
    texts: tuple[str, ...]
    read: Callable[[Any], tuple[Any, ...]]  # their values as they are packed, in that order
    blank: dict[str, Any]  # what else an instance has


@functools.cache
def _layout(number: int) -> _Layout | None:
    """Return the layout of a message, None for pymavlink's own codec: it has arrays, or is not known."""
    kind = wire.mavlink_map.get(number)
    if kind is None or _checksum is None:
        return None
    types = dict(zip(kind.fieldnames, kind.fieldtypes, strict=True))
    fields = [(n, types[n], length) for n, length in zip(kind.ordered_fieldnames, kind.array_lengths, strict=True)]
    texts = tuple(name for name, what, length in fields if what == "char" and length)
    if len(fields) < 2 or any(name not in texts and (length or what == "char") for name, what, length in fields):
        return None
    names = tuple(kind.ordered_fieldnames)
    read = operator.attrgetter(*(f"_{name}_raw" if name in texts else name for name in names))
    made = vars(kind(*(b"" if name in texts else 0 for name in kind.fieldnames)))
    told = {*names, *(f"_{name}_raw" for name in texts), "_header", "_msgbuf", "_payload", "_crc"}
    return _Layout(
        kind=kind,
        codec=kind.unpacker,
        crc_extra=bytes([kind.crc_extra]),
        names=names,
        texts=texts,
        read=read,
        blank={name: value for name, value in made.items() if name not in told},
    )


class Dialect(wire.MAVLink):  # type: ignore[misc]
    """A ``wire.MAVLink``."""

    def decode(self, msgbuf: bytearray) -> Any:
        """Return the message of a whole frame. Raises wire.MAVError: it is none."""
        size = len(msgbuf) - _CRC_BYTES
        if size < _HEADER_BYTES or msgbuf[0] != _STX or msgbuf[2] or self.signing.secret_key is not None:
            return super().decode(msgbuf)
        frame = bytes(msgbuf)
        _, length, _, compat, seq, system, component, low, high = _HEADER.unpack_from(frame)
        layout = _layout(low | high << 16)
        if layout is None or _checksum is None or size != _HEADER_BYTES + length:
            return super().decode(msgbuf)
        crc = _checksum(frame[1:size] + layout.crc_extra)
        if crc != frame[size] | frame[size + 1] << 8:
            return super().decode(msgbuf)  # which says what is wrong
        codec = layout.codec
        values = codec.unpack(frame[_HEADER_BYTES:size].ljust(codec.size, b"\0")[: codec.size])  # zeros are not sent
        message = object.__new__(layout.kind)
        own = message.__dict__
        own.update(layout.blank)
        own.update(zip(layout.names, values, strict=True))
        for name in layout.texts:
            raw = own[f"_{name}_raw"] = own[name].rstrip(b"\0")
            own[name] = raw.split(b"\0", 1)[0].decode("ascii", errors="replace")
        own["_msgbuf"], own["_payload"], own["_crc"] = msgbuf, msgbuf[6:size], crc
        own["_header"] = wire.MAVLink_header(low | high << 16, 0, compat, length, seq, system, component)
        return message

    def packed(self, message: Any) -> bytes:
        """Return ``message`` as a frame with the present sequence number, as its ``pack`` does."""
        number = message.get_msgId()
        layout = _layout(number)
        if layout is None or _checksum is None or self.signing.sign_outgoing:
            return bytes(message.pack(self))
        payload = layout.codec.pack(*layout.read(message)).rstrip(b"\0") or b"\0"
        frame = (
            _HEADER.pack(
                _STX, len(payload), 0, 0, self.seq, self.srcSystem, self.srcComponent, number & 0xFFFF, number >> 16
            )
            + payload
        )
        return frame + _CRC.pack(_checksum(frame[1:] + layout.crc_extra))


# pymavlink builds its message classes at run time; to mypy a message is Any with the attributes of its XML.
Message = Any

STX = 0xFD
# A signature has 48 bits for its timestamp [10 µs since 2015-01-01 UTC]: until 2104.
MOST_TIMESTAMP = (1 << 48) - 1
_SIGNATURE_BYTES = 13
_SIGNED = 0x01
# Commands, and where both have the component that they are for.
_COMMANDS = frozenset({wire.MAVLINK_MSG_ID_COMMAND_LONG, wire.MAVLINK_MSG_ID_COMMAND_INT})
_TARGET_COMPONENT = 31
# A frame of MAVLink 1 that every autopilot sends: start, length 9, ..., HEARTBEAT (0).
_V1_HEARTBEAT_BYTES = 17


class Drop(enum.Enum):
    """Why bytes, a frame or a message was not used."""

    NOISE = "bytes outside any frame"
    BAD_CRC = "frames with a wrong checksum"
    BAD_HEADER = "frames with flags or an id that do not exist"
    BAD_SIGNATURE = "frames with a wrong signature, or one of before"
    UNSIGNED = "frames without a signature where there is a key"
    UNSIGNED_COMMAND = "commands to us, of those two"
    MAVLINK_1 = "frames of MAVLink 1"
    FOREIGN_SYSTEM = "messages of another system"
    OWN_IDS = "messages with our own ids: echoes, or a second companion"
    DUPLICATE = "frames received twice"
    WRONG_CLOCK = "messages whose boot time is not the autopilot's"
    OUT_OF_STEP = "messages whose number is out of step with the autopilot's"
    HELD = "messages that waited while we were held up, and were not the next of the autopilot's"


@dataclass(slots=True)
class SigningState:
    """MAVLink 2 signing: the 32-byte key, the link id, and the timestamp [10 µs since 2015-01-01 UTC].

    ``timestamp`` only grows, over restarts too; whoever makes this value takes the larger of the clock and the
    stored one.
    """

    key: bytes
    link_id: int = 0
    timestamp: int = 0

    def __post_init__(self) -> None:
        if len(self.key) != 32:
            raise ValueError(f"a signing key has 32 bytes, not {len(self.key)}")
        if not 0 <= self.timestamp <= MOST_TIMESTAMP:
            raise ValueError(f"a signing timestamp has 48 bits, and {str(self.timestamp)[:20]} does not fit")


class Codec:
    """The two directions of one link: ``feed`` bytes, get messages; ``pack`` messages, get bytes."""

    def __init__(self, system: int, component: int, signing: SigningState | None = None) -> None:
        self.dropped: Counter[Drop] = Counter()
        self.signed_in = 0  # frames with a signature, whether or not it was checked
        self._buffer = bytearray()
        self._mav = Dialect(None, srcSystem=system, srcComponent=component)
        self._signing = signing
        if signing is not None:
            state = self._mav.signing
            state.secret_key, state.link_id, state.timestamp = signing.key, signing.link_id, signing.timestamp
            state.sign_outgoing = True
            # a radio's own status is never signed
            state.allow_unsigned_callback = lambda _, msg_id: msg_id == wire.MAVLINK_MSG_ID_RADIO_STATUS

    @property
    def system(self) -> int:
        """Our system id."""
        return int(self._mav.srcSystem)

    @system.setter
    def system(self, value: int) -> None:
        self._mav.srcSystem = value

    @property
    def component(self) -> int:
        """Our component id."""
        return int(self._mav.srcComponent)

    def pack(self, message: Message) -> bytes:
        """Return ``message`` as the next frame of ours, signed if the link is."""
        if self._signing is not None:
            # The autopilot's own stamps move ours: behind the last that there is they would begin at 0 again.
            self.set_signing_time(0)
        frame = self._mav.packed(message)
        self._mav.seq = (self._mav.seq + 1) % 256
        if self._signing is not None:
            self._signing.timestamp = min(self._mav.signing.timestamp, MOST_TIMESTAMP)
        return frame

    def set_signing_time(self, timestamp: int) -> None:
        """Move the signing timestamp forward to ``timestamp`` [10 µs since 2015]; never back, nor beyond 48 bits."""
        state = self._mav.signing
        state.timestamp = min(max(state.timestamp, timestamp), MOST_TIMESTAMP)

    def feed(self, data: bytes) -> list[Message]:
        """Return the messages completed by ``data``, oldest first; ``get_msgbuf()`` of each is its frame."""
        buffer = self._buffer
        buffer += data
        messages: list[Message] = []
        at = 0
        while True:
            start = buffer.find(STX, at)
            skipped_to = len(buffer) if start < 0 else start
            if skipped_to > at:
                self._noise(bytes(buffer[at:skipped_to]))
            at = skipped_to
            size = self._frame_size(at)
            if size == 0:  # not all here yet
                break
            if size < 0:
                self.dropped[Drop.BAD_HEADER] += 1
                self.dropped[Drop.NOISE] += 1
                at += 1
                continue
            message = self._decode(buffer[at : at + size])
            if message is None:
                self.dropped[Drop.NOISE] += 1
                at += 1
                continue
            at += size
            if message is not False:
                self.signed_in += message.get_msgbuf()[2] & _SIGNED
                messages.append(message)
        del buffer[:at]
        return messages

    def _frame_size(self, at: int) -> int:
        """Return the size [bytes] of the frame at ``at``, 0 while bytes are missing, -1 when it is none."""
        buffer = self._buffer
        have = len(buffer) - at
        if have >= 3 and buffer[at + 2] & ~_SIGNED:
            return -1
        if have < _HEADER_BYTES:
            return 0
        msg_id = buffer[at + 7] | buffer[at + 8] << 8 | buffer[at + 9] << 16
        if msg_id not in wire.mavlink_map:
            return -1
        signature = _SIGNATURE_BYTES if buffer[at + 2] & _SIGNED else 0
        size = _HEADER_BYTES + buffer[at + 1] + _CRC_BYTES + signature
        return size if have >= size else 0

    def _decode(self, frame: bytearray) -> Message:
        """Return the message, None when the frame is not one, False when it is one that must not be used."""
        try:
            if self._signing is not None and frame[2] & _SIGNED and not self._is_signed_by_us(frame):
                # checked before pymavlink sees it: its check takes the timestamp of a forgery for good
                self._unsigned(frame)
                return None
            return self._mav.decode(frame)
        except wire.MAVError as error:
            if "signature" in str(error).lower():
                self._unsigned(frame)
                return False
            self.dropped[Drop.BAD_CRC] += 1
            return None
        except Exception:  # a payload that pymavlink cannot digest is a bad frame, whatever it raises
            self.dropped[Drop.BAD_CRC] += 1
            return None

    def _unsigned(self, frame: bytearray) -> None:
        """Count a frame that is not signed with our key; a command to us is somebody's who wants to be heard."""
        self.dropped[Drop.BAD_SIGNATURE if frame[2] & _SIGNED else Drop.UNSIGNED] += 1
        kind = int.from_bytes(frame[7:10], "little")
        payload = frame[_HEADER_BYTES : _HEADER_BYTES + frame[1]]
        if kind in _COMMANDS and len(payload) > _TARGET_COMPONENT and payload[_TARGET_COMPONENT] == self.component:
            self.dropped[Drop.UNSIGNED_COMMAND] += 1

    def _is_signed_by_us(self, frame: bytearray) -> bool:
        assert self._signing is not None
        digest = hashlib.sha256(self._signing.key + bytes(frame[:-6])).digest()
        return digest[:6] == bytes(frame[-6:])

    def _noise(self, data: bytes) -> None:
        self.dropped[Drop.NOISE] += len(data)
        at = data.find(b"\xfe\x09")
        while at >= 0:
            frame = data[at : at + _V1_HEARTBEAT_BYTES]
            if len(frame) == _V1_HEARTBEAT_BYTES and frame[5] == wire.MAVLINK_MSG_ID_HEARTBEAT:
                crc = wire.x25crc(frame[1:-2] + bytes([wire.MAVLink_heartbeat_message.crc_extra])).crc
                self.dropped[Drop.MAVLINK_1] += crc == int.from_bytes(frame[-2:], "little")
            at = data.find(b"\xfe\x09", at + 1)
