"""Telemetry logs: round trip, torn tails, damage, and pymavlink's own reader as the witness."""

import random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.errors import InputError
from companion.mavlink.tlog import parse_tlog, read_tlog, stamp
from tests.mavlink.golden import DATA, messages_of

RAW = (DATA / "beat.tlog").read_bytes()
RECORDS = list(parse_tlog(RAW))


def test_a_recording_comes_back_to_the_byte(tmp_path):
    path = tmp_path / "x.tlog"
    path.write_bytes(b"".join(stamp(r.unix_us, r.frame) for r in RECORDS))
    assert [r.frame for r in read_tlog(path)] == [r.frame for r in RECORDS]
    assert path.stat().st_size == len(RAW)


def test_mavutil_reads_what_we_write(tmp_path):
    from pymavlink import mavutil

    path = tmp_path / "x.tlog"
    path.write_bytes(b"".join(stamp(r.unix_us, r.frame) for r in RECORDS))
    log = mavutil.mavlink_connection(str(path), dialect="ardupilotmega")
    names = []
    while (message := log.recv_msg()) is not None:
        names.append((message.get_type(), round(message._timestamp, 3)))
    log.close()
    ours = [(m.get_type(), round(t_s, 3)) for t_s, m in messages_of(RECORDS)]
    assert names == ours


@settings(max_examples=60)
@given(st.integers(0, len(RAW)))
def test_a_torn_tail_costs_one_record_at_most(size):
    whole = [r for i, r in enumerate(RECORDS) if sum(8 + len(x.frame) for x in RECORDS[: i + 1]) <= size]
    assert list(parse_tlog(RAW[:size])) == whole


def test_damage_in_the_middle_is_stepped_over():
    rng = random.Random(3)
    damaged = RAW[:500] + rng.randbytes(40) + RAW[540:]
    found = [r.frame for r in parse_tlog(damaged)]
    assert set(found) & {r.frame for r in RECORDS[25:]} == {r.frame for r in RECORDS[25:]}


def test_a_file_without_frames_is_refused(tmp_path):
    path = tmp_path / "x.tlog"
    path.write_bytes(b"no telemetry at all, only words" * 10)
    with pytest.raises(InputError, match="no MAVLink frame"):
        read_tlog(path)
    with pytest.raises(InputError, match="cannot be read"):
        read_tlog(tmp_path / "none.tlog")
