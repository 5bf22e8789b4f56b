"""The short way through the dialect makes and reads what pymavlink does, for every message that there is."""

import random
import struct

import pytest
from pymavlink.dialects.v20 import ardupilotmega as wire

from companion.mavlink.wire.frames import Dialect, _layout

NUMBERS = sorted(wire.mavlink_map)
KEY = bytes(range(32))


def drawn(kind, rng):
    """Return a message with every field drawn: small and large, negative and NaN, empty and full texts."""
    lengths, made = dict(zip(kind.ordered_fieldnames, kind.array_lengths, strict=True)), []
    for name, what in zip(kind.fieldnames, kind.fieldtypes, strict=True):
        length = lengths[name]
        if what == "char":
            text = bytes(rng.choice(b"\0ab\xe9") for _ in range(rng.randint(0, length or 1)))
            made.append(text if length else text.ljust(1, b"\0"))
        else:
            one = [_number(what, rng) for _ in range(length or 1)]
            made.append(one if length else one[0])
    return kind(*made)


def _number(what, rng):
    if what in {"float", "double"}:
        return rng.choice((0.0, -0.0, 1.5, float("inf"), float("nan"), rng.uniform(-1e6, 1e6)))
    bits = int(what.strip("_uint"))
    low, high = (0, 2**bits - 1) if what.startswith("u") else (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1)
    return rng.choice((0, 0, 1, low, high, rng.randint(low, high)))


def told(message):
    """Return everything that a message knows, NaN made comparable."""
    own = dict(vars(message))
    own["_header"] = vars(own["_header"])
    return repr(sorted(own.items()))


def test_every_message_is_packed_and_read_as_pymavlink_does():
    rng, ours, theirs = random.Random(1), Dialect(None, 3, 191), wire.MAVLink(None, 3, 191)
    for number in NUMBERS:
        for turn in range(6):
            message = drawn(wire.mavlink_map[number], rng)
            ours.seq = theirs.seq = 250 + turn
            frame = ours.packed(message)
            assert frame == message.pack(theirs), message
            assert told(ours.decode(bytearray(frame))) == told(theirs.decode(bytearray(frame)))


def test_most_of_what_a_boat_hears_goes_the_short_way():
    assert all(_layout(wire.mavlink_map[n].id) for n in (0, 1, 24, 30, 33, 42, 62, 74, 168, 193, 251, 253))
    assert _layout(wire.MAVLINK_MSG_ID_BATTERY_STATUS) is None  # an array: the long way


@pytest.mark.parametrize("spoil", ["crc", "length", "cut", "flags", "id", "mavlink 1"])
def test_what_is_no_frame_raises_the_same(spoil):
    message = wire.MAVLink_attitude_message(7, 0.1, 0.2, 0.3, 0.0, 0.0, 0.0)
    frame = bytearray(message.pack(wire.MAVLink(None, 1, 1), force_mavlink1=spoil == "mavlink 1"))
    if spoil == "crc":
        frame[-1] ^= 1
    elif spoil == "length":
        frame[1] += 1
    elif spoil == "cut":
        del frame[8:]
    elif spoil == "flags":
        frame[2] = 1
    elif spoil == "id":
        frame[7:10] = b"\xff\xff\xff"
    said = []
    for codec in (Dialect(None, 1, 1), wire.MAVLink(None, 1, 1)):
        try:
            said.append(str(codec.decode(bytearray(frame))))
        except (wire.MAVError, struct.error, IndexError) as error:
            said.append(f"{type(error).__name__} {error}")
    assert said[0] == said[1]


def test_signed_frames_are_pymavlinks_own():
    ours, theirs = Dialect(None, 1, 1), wire.MAVLink(None, 1, 1)
    for codec in (ours, theirs):
        codec.signing.secret_key, codec.signing.sign_outgoing, codec.signing.timestamp = KEY, True, 10**9
    message = wire.MAVLink_wind_message(10.0, 5.0, 0.0)
    frame = ours.packed(message)
    assert frame == message.pack(theirs)
    assert frame[2] == 1
    plain = message.pack(wire.MAVLink(None, 1, 1))
    for codec in (ours, theirs):
        with pytest.raises(wire.MAVError, match="signature"):
            codec.decode(bytearray(plain))
