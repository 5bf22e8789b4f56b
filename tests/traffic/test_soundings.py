"""Depth sentences: DPT and DBT of any talker to metres below the transducer; what contradicts itself is none."""

import functools
import math
import operator

import pytest
from hypothesis import given
from hypothesis import strategies as st

from companion.mavlink.wire import VehicleAssembler
from companion.messages import AutopilotStatus, Mode, Sounding
from companion.traffic.soundings import SoundingDecoder, below_transducer_m


def said(body):
    return f"${body}*{functools.reduce(operator.xor, body.encode(), 0):02X}\r\n".encode()


def ping(body, t_s=1.0):
    return SoundingDecoder().feed(said(body), t_s)


@pytest.mark.parametrize(
    ("body", "depth_m", "offset_m", "most_m"),
    [
        ("SDDPT,4.2,0.5,50.0", 4.2, 0.5, 50.0),
        ("IIDPT,4.2,-1.1", 4.2, -1.1, math.inf),  # before NMEA 0183 3.0 there is no scale
        ("YXDPT,4.2", 4.2, None, math.inf),
        ("SDDPT,4.2,0.0,0", 4.2, None, math.inf),  # nothing is set: not told
        ("SDDPT,,0.5,", None, 0.5, math.inf),  # no echo
        ("SDDBT,13.8,f,4.2,M,2.3,F", 4.2, None, math.inf),
        ("SDDBT,13.8,f,,M,,F", 4.2062, None, math.inf),
        ("IIDBT,,f,,M,2.3,F", 4.2062, None, math.inf),
        ("IIDBT,,,,,2.3,F", 4.2062, None, math.inf),
        ("SDDBT,,f,,M,,F", None, None, math.inf),
        ("SDDPT,0.0,0.5,", 0.0, 0.5, math.inf),
    ],
)
def test_a_sentence_is_a_ping_in_metres(body, depth_m, offset_m, most_m):
    got = ping(body)
    assert got == Sounding(t_s=1.0, depth_m=pytest.approx(depth_m, abs=1e-3), offset_m=offset_m, most_m=most_m) or (
        depth_m is None and got == Sounding(t_s=1.0, offset_m=offset_m, most_m=most_m)
    )


@pytest.mark.parametrize(
    ("body", "count"),
    [
        ("SDDPT,nan,0.5,", "bad_payload"),
        ("SDDPT,-4.2,0.5,", "bad_payload"),
        ("SDDPT,4.2,55.0,", "bad_payload"),
        ("SDDPT,4,2,0.5,50.0x", "bad_payload"),
        ("SDDBT,13.8,f,13.8,M,13.8,F", "bad_payload"),  # one number in every unit: it is not known which
        ("SDDBT,inf,f,,M,,F", "bad_payload"),
        ("SDMTW,12.1,C", "other"),
        ("PSDPT,4.2,0.5", "other"),
        ("SDDPTX,4.2,0.5", "other"),
    ],
)
def test_what_is_no_depth_tells_none_and_is_counted(body, count):
    decoder = SoundingDecoder()
    assert decoder.feed(said(body), 1.0) is None or count == "other"
    assert getattr(decoder.counts, count) == 1
    assert decoder.counts.reports == 0


@pytest.mark.parametrize(
    ("line", "count"),
    [
        (said("SDDPT,4.2,0.5,50.0").replace(b"4.2", b"9.2"), "bad_checksum"),
        (b"$SDDPT,4.2,0.5,50.0\r\n", "bad_checksum"),
        (b"!SDDPT,4.2,0.5,50.0*00\r\n", "bad_form"),
        (b"\xff\x00\xfe", "bad_form"),
        (b"$" + b"9" * 500, "bad_form"),
    ],
)
def test_what_is_damaged_is_refused(line, count):
    decoder = SoundingDecoder()
    assert decoder.feed(line, 1.0) is None
    assert getattr(decoder.counts, count) == 1


@given(st.binary(max_size=200))
def test_nothing_that_comes_raises(data):
    decoder = SoundingDecoder()
    decoder.feed(data, 1.0)
    decoder.feed(b"$SDDPT," + data, 2.0)
    decoder.feed(said("SDDBT," + data.decode("latin-1").replace("*", "")[:60]).replace(b"\r\n", b""), 3.0)
    assert decoder.json(data, 4.0) is None


def test_of_an_instrument_that_says_each_ping_twice_one_is_taken():
    """Five pings are asked which of them agree: one false echo told twice would have two votes."""
    decoder = SoundingDecoder()
    told = [
        decoder.feed(said(body), t_s)
        for t_s, body in (
            (1.0, "SDDPT,4.2,0.0"),
            (1.1, "SDDBT,,f,4.2,M,,F"),
            (2.0, "SDDPT,4.1,0.0"),
            (8.0, "SDDBT,,f,4.0,M,,F"),
        )
    ]
    assert [p and p.depth_m for p in told] == [4.2, None, 4.1, 4.0]


@pytest.mark.parametrize(
    ("offset_m", "draft_m", "transducer_m", "below_m"),
    [
        (None, 1.8, 0.0, 5.0),  # not told: the mission's place of it holds
        (None, 1.8, 0.6, 5.0),
        (0.6, 1.8, 0.6, 5.0),  # both say the same
        (0.6, 1.8, 0.0, 5.6),  # told from 0.6 m down, and the mission counts from the surface
        (0.6, None, 0.0, 5.6),
        (-1.2, 1.8, 0.0, 5.6),  # 1.2 m above a keel of 1.8 m: 0.6 m down
        (-1.2, 1.8, 0.6, 5.0),
        (-2.5, 1.8, 0.0, 5.0),  # it would be above the water: at its surface
        (-1.2, None, 0.0, 5.0),  # nobody knows how deep the keel is
    ],
)
def test_a_ping_counts_from_where_the_mission_says_the_transducer_is(offset_m, draft_m, transducer_m, below_m):
    told = Sounding(t_s=0.0, depth_m=5.0, offset_m=offset_m)
    assert below_transducer_m(told, draft_m, transducer_m) == pytest.approx(below_m)
    assert below_transducer_m(Sounding(t_s=0.0, offset_m=offset_m), draft_m, transducer_m) is None


def test_a_sounder_of_the_companions_own_counts_alone_while_it_is_heard():
    """Two sounders of one boat may be of different places: the mission names the one that counts."""
    from pymavlink.dialects.v20 import ardupilotmega as wire

    from sitl.autopilot.memory_link import frames  # noqa: F401 - the wire's messages

    assembler = VehicleAssembler()
    beat = wire.MAVLink_heartbeat_message(11, 3, 0, 10, 4, 3)
    beat._header = wire.MAVLink_header(0, srcSystem=1, srcComponent=1)
    far = wire.MAVLink_distance_sensor_message(1000, 30, 5000, 2000, 1, 1, 25, 255)
    far._header = wire.MAVLink_header(132, srcSystem=1, srcComponent=1)
    assert assembler.sounded(0.0, 4.0, math.inf) == [], "before the first heartbeat there is no status"
    assert isinstance(assembler.take(0.5, beat)[0], AutopilotStatus)
    status = [assembler.sounded(1.0 + 0.5 * n, 4.0, math.inf)[0] for n in range(4)][-1]
    assert (status.sounds, status.depth_m, status.mode) == (True, 4.0, Mode.AUTO)
    for n in range(6):
        assembler.take(3.0 + 0.1 * n, far)
    assert assembler.sounded(4.0, 4.0, math.inf)[0].depth_m == 4.0
    for n in range(6):
        values = assembler.take(15.0 + 0.1 * n, far)
    assert values[0].depth_m == 20.0, "silent for long: the autopilot's counts again"
    assert assembler.sounded(16.0, 80.0, 50.0)[0].sounds, "beyond its reach it is no depth, and no loss"
