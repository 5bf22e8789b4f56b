"""Frames out of bytes: whatever comes, good frames get through and the rest is counted."""

import random

from hypothesis import given, settings
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as wire

from companion.mavlink.tlog import parse_tlog
from companion.mavlink.wire.frames import Codec, Drop, SigningState
from tests.mavlink.golden import DATA

FRAMES = [r.frame for r in parse_tlog((DATA / "beat.tlog").read_bytes())]
KEY = bytes(range(32))


def text(number):
    return wire.MAVLink_statustext_message(6, f"text {number}".encode(), 0, 0)


def test_recorded_frames_are_all_decoded_whatever_the_chunks():
    data = b"".join(FRAMES)
    whole = [bytes(m.get_msgbuf()) for m in Codec(1, 191).feed(data)]
    assert whole == FRAMES
    by_byte = Codec(1, 191)
    one = [bytes(m.get_msgbuf()) for i in range(len(data)) for m in by_byte.feed(data[i : i + 1])]
    assert one == FRAMES
    assert not by_byte.dropped


def test_ten_thousand_bytes_of_noise_cost_no_frame():
    rng = random.Random(4)
    codec, good, fed = Codec(1, 191), [], 0
    for frame in FRAMES * 2:
        noise = rng.randbytes(rng.randrange(0, 150))
        fed += len(noise)
        good += codec.feed(noise + frame)
    good += codec.feed(bytes(300))  # flushes a start in the noise that still waits for its end
    assert fed > 10_000
    assert [bytes(m.get_msgbuf()) for m in good] == FRAMES * 2
    assert codec.dropped[Drop.NOISE] == fed + 300


def test_truncated_frames_do_not_swallow_the_next():
    codec = Codec(1, 191)
    rng = random.Random(1)
    data, kept = b"", []
    for i, frame in enumerate(FRAMES):
        if i % 3 == 0:
            data += frame[: rng.randrange(1, len(frame))]
        else:
            data += frame
            kept.append(frame)
    messages = codec.feed(data) + codec.feed(bytes(300))
    assert [bytes(m.get_msgbuf()) for m in messages] == kept


@settings(max_examples=60)
@given(st.lists(st.binary(max_size=400), max_size=6), st.integers(0, len(FRAMES) - 1))
def test_no_bytes_raise_and_a_good_frame_behind_them_arrives(chunks, which):
    codec = Codec(1, 191)
    for chunk in chunks:
        codec.feed(chunk)
    messages = codec.feed(FRAMES[which]) + codec.feed(bytes(300))
    assert FRAMES[which] in [bytes(m.get_msgbuf()) for m in messages]


@settings(max_examples=60)
@given(st.integers(0, len(FRAMES) - 1), st.data())
def test_a_changed_byte_is_never_taken_for_a_message(which, data):
    frame = bytearray(FRAMES[which])
    place = data.draw(st.integers(0, len(frame) - 1))
    frame[place] ^= data.draw(st.integers(1, 255))
    codec = Codec(1, 191)
    messages = codec.feed(bytes(frame)) + codec.feed(bytes(300))
    assert bytes(frame) not in [bytes(m.get_msgbuf()) for m in messages]
    assert sum(codec.dropped.values()) > 0


def test_mavlink_1_is_recognised_and_not_used():
    codec, old = Codec(1, 191), wire.MAVLink(None, 1, 1)
    beat = wire.MAVLink_heartbeat_message(11, 3, 0, 0, 4, 3)
    assert codec.feed(beat.pack(old, force_mavlink1=True)) == []
    assert codec.dropped[Drop.MAVLINK_1] == 1


def test_unknown_ids_and_flags_are_counted():
    codec = Codec(1, 191)
    frame = bytearray(FRAMES[0])
    frame[7:10] = b"\xff\xff\x7f"
    codec.feed(bytes(frame))
    frame = bytearray(FRAMES[0])
    frame[2] = 0x02
    codec.feed(bytes(frame))
    assert codec.dropped[Drop.BAD_HEADER] >= 2


def test_sequence_numbers_run_on():
    codec = Codec(1, 191)
    assert [codec.pack(text(i))[4] for i in range(258)] == [i % 256 for i in range(258)]


def signed(key=KEY, timestamp=10_000_000):
    return Codec(1, 191, SigningState(key=key, timestamp=timestamp))


def test_signed_frames_pass_between_two_that_share_a_key():
    a, b = signed(), signed()
    for i in range(5):
        frame = a.pack(text(i))
        assert [m.text for m in b.feed(frame)] == [f"text {i}"]


def test_tampered_replayed_unsigned_and_foreign_frames_are_refused():
    a, b = signed(), signed()
    first, second = a.pack(text(1)), a.pack(text(2))
    assert len(b.feed(first)) == 1
    assert b.feed(first) == []  # replayed
    tampered = bytearray(second)
    tampered[12] ^= 1
    assert b.feed(bytes(tampered)) == []
    assert b.feed(Codec(1, 191).pack(text(3))) == []  # unsigned
    assert b.feed(signed(key=bytes(32)).pack(text(4))) == []  # another key
    assert len(b.feed(second)) == 1
    assert b.dropped[Drop.BAD_SIGNATURE] >= 3
    assert b.dropped[Drop.UNSIGNED] == 1


def test_a_forged_timestamp_does_not_lock_the_true_sender_out():
    a, b = signed(), signed()
    forged = signed(key=bytes(32), timestamp=1 << 40)
    assert b.feed(forged.pack(text(0))) == []
    assert len(b.feed(a.pack(text(1)))) == 1


def test_a_radios_own_status_needs_no_signature():
    radio = wire.MAVLink_radio_status_message(1, 1, 50, 10, 10, 0, 0)
    assert len(signed().feed(Codec(51, 68).pack(radio))) == 1
