"""pymavlink's codec with short ways for the frames that nearly all are: MAVLink 2, without a signature. Pure.

The same bytes and the same messages as pymavlink's, which does everything else; a test compares them for every message
of the dialect. pymavlink builds each message field by field and its checksum from copies: of a voyage under the virtual
clock that took a sixth.
"""

from __future__ import annotations

import functools
import operator
import struct
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as wire

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
    names: tuple[str, ...]                          # of the fields, in the order of the frame
    texts: tuple[str, ...]
    read: Callable[[Any], tuple[Any, ...]]      # their values as they are packed, in that order
    blank: dict[str, Any]                           # what else an instance has


@functools.cache
def _layout(number: int) -> _Layout | None:
    """Return the layout of a message, None where the long way is gone: it has arrays, or is not known."""
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
        kind=kind, codec=kind.unpacker, crc_extra=bytes([kind.crc_extra]), names=names, texts=texts, read=read,
        blank={name: value for name, value in made.items() if name not in told})


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
            return super().decode(msgbuf)   # which says what is wrong
        codec = layout.codec
        values = codec.unpack(frame[_HEADER_BYTES:size].ljust(codec.size, b"\0")[:codec.size])   # zeros are not sent
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
        frame = _HEADER.pack(
            _STX, len(payload), 0, 0, self.seq, self.srcSystem, self.srcComponent, number & 0xFFFF, number >> 16
        ) + payload
        return frame + _CRC.pack(_checksum(frame[1:] + layout.crc_extra))
