"""Wire units and signs: recorded messages with their known meaning, and mutated ones."""

import dataclasses
import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as wire

from companion.mavlink.wire import codec
from companion.mavlink.wire.assembler import _TELLING, VehicleAssembler
from companion.mavlink.wire.frames import Codec
from companion.messages import (
    AisReport,
    ApparentWind,
    AutopilotStatus,
    GeoPoint,
    MissionState,
    Mode,
    StatusText,
    VehicleState,
    WindSample,
)
from tests.mavlink.golden import load, said

OUT, IN = Codec(1, 1), Codec(1, 191)


def heard(message, component=1, system=1):
    """Return ``message`` as it arrives from the autopilot."""
    return Codec(1, 191).feed(Codec(system, component).pack(message))[0]


def fold(name):
    assembler = VehicleAssembler()
    values = [(t_s, v) for t_s, m in load(name) if m.get_srcComponent() == 1 for v in assembler.take(t_s, m)]
    return assembler, values


def of(values, kind):
    return [(t_s, v) for t_s, v in values if isinstance(v, kind)]


# ------------------------------------------------------------------------------------------- golden
def test_a_beat_through_a_tack():
    """5 m/s from north, tack from heading 45 to -45 at 1.85 s of the file; the boat is right of a northward leg."""
    assembler, values = fold("beat")
    vehicles = of(values, VehicleState)
    before, after = vehicles[0][1], vehicles[-1][1]
    assert math.degrees(before.heading_rad) == pytest.approx(45.1, abs=0.5)
    assert before.speed_mps == pytest.approx(1.99, abs=0.02)
    assert math.degrees(math.atan2(*before.velocity_en_mps)) == pytest.approx(45.0, abs=1.0)
    assert math.degrees(after.heading_rad) > 180.0, "on the other tack the heading is west of north"
    assert before.position.lat_deg == pytest.approx(51.1003, abs=5e-4)
    assert before.position.lon_deg == pytest.approx(-1.2996, abs=2e-4)
    winds = of(values, WindSample)
    assert winds
    for _, wind in winds:
        assert abs(math.degrees(wind.twd_from_rad) + 180.0) % 360.0 - 180.0 == pytest.approx(0.0, abs=1.0)
        assert wind.tws_mps == pytest.approx(5.0, abs=0.1)
    apparent = of(values, ApparentWind)
    assert len(apparent) == len(winds)
    # heading NE with the wind from north: it comes over the port bow, negative
    assert math.degrees(apparent[0][1].awa_rad) == pytest.approx(-32.6, abs=0.5)
    assert apparent[0][1].aws_mps == pytest.approx(6.59, abs=0.02)
    status = of(values, AutopilotStatus)[-1][1]
    assert (status.mode, status.is_armed, status.ekf_ok, status.gps_fix) == (Mode.AUTO, True, True, 6)
    assert (status.mission_seq, status.mission_state) == (1, MissionState.ACTIVE)
    assert status.cross_track_m == pytest.approx(30.0, abs=1.0), "east of a northward leg is right: positive"
    assert status.battery_v == pytest.approx(12.6)
    assert [v.text for _, v in of(values, StatusText)] == ["Sailboat: Tacking"]
    assert assembler.reboots == 0


def test_before_there_is_a_position_there_is_no_vehicle():
    _, values = fold("boot")
    vehicles = of(values, VehicleState)
    assert [t_s > 5.0 for t_s, _ in vehicles] == [True] * len(vehicles)
    texts = [v.text for _, v in of(values, StatusText)]
    assert "Requested rate for message ID 168 too fast. Increase SCHED_LOOP_RATE" in texts
    version = codec.autopilot_version(next(m for _, m in load("boot") if m.get_type() == "AUTOPILOT_VERSION"))
    assert version.version == (4, 7, 0)
    assert version.has_ftp


def test_a_fence_breach_is_seen():
    _, values = fold("fence_breach")
    states = [v.fence_breached for _, v in of(values, AutopilotStatus)]
    assert states[0] is False or states[0] is None
    assert states[-1] is True
    assert of(values, AutopilotStatus)[-1][1].mode is Mode.RTL


def test_ships_move_as_they_were_told_to():
    """CARGO 211000001 course 180 at 5 m/s; FERRY 211000002 course 270 at 4 m/s; TANKER 211000003 anchored."""
    _, values = fold("ais")
    by_ship = {}
    for _, v in of(values, AisReport):
        by_ship.setdefault(v.mmsi, v)
    cargo, ferry, tanker, trawler = (by_ship[211000000 + i] for i in (1, 2, 3, 4))
    assert cargo.speed_mps == pytest.approx(5.0, abs=0.03)
    assert math.degrees(cargo.course_rad) == pytest.approx(180.0)
    assert ferry.speed_mps == pytest.approx(4.0, abs=0.03)
    assert math.degrees(ferry.course_rad) == pytest.approx(270.0)
    assert (tanker.speed_mps, tanker.nav_status, tanker.turn_rate_radps) == (0.0, 1, None)
    assert trawler.nav_status == 7
    assert trawler.turn_rate_radps is None, "its sign is lost on the way"
    assert cargo.name is None
    assert cargo.bow_m is None


# -------------------------------------------------------------------------------------------- signs
@settings(max_examples=80)
@given(st.floats(-360.0, 360.0), st.floats(0.0, 90.0))
def test_wind_direction_is_where_it_comes_from(direction, speed):
    sample = codec.wind_sample(0.0, heard(wire.MAVLink_wind_message(direction, speed, 0.0)))
    assert 0.0 <= sample.twd_from_rad < 2.0 * math.pi
    assert math.isclose(math.cos(sample.twd_from_rad), math.cos(math.radians(direction)), abs_tol=1e-4)
    assert sample.tws_mps == pytest.approx(speed, rel=1e-6)


@settings(max_examples=80)
@given(st.floats(-89.9, 89.9), st.floats(-180.0, 180.0))
def test_positions_survive_the_wire_to_a_centimetre(lat, lon):
    point = GeoPoint(lat_deg=lat, lon_deg=lon)
    back = codec.geo_point(*codec.e7(point))
    if codec.e7(point) == (0, 0):
        assert back is None
    else:
        assert abs(back.lat_deg - lat) <= 0.6e-7
        assert abs(back.lon_deg - lon) <= 0.6e-7


@settings(max_examples=60)
@given(st.floats(-math.pi, math.pi))
def test_a_heading_setpoint_carries_its_heading(heading):
    q = heard(codec.heading_setpoint((1, 1), 1.0, heading, 1.0)).q
    yaw = math.atan2(2.0 * (q[0] * q[3] + q[1] * q[2]), 1.0 - 2.0 * (q[2] ** 2 + q[3] ** 2))
    assert abs(math.remainder(yaw - heading, 2.0 * math.pi)) < 1e-5


def test_cross_track_is_positive_to_the_right():
    message = wire.MAVLink_nav_controller_output_message(0, 0, 0, 0, 10, 0, 0, -10.0)
    assert codec.cross_track_m(heard(message)) == 10.0


def test_the_caps_and_sentinels_are_unknown():
    assert (
        codec.waypoint_distance_m(heard(wire.MAVLink_nav_controller_output_message(0, 0, 0, 0, 65535, 0, 0, 0))) is None
    )
    ship = wire.MAVLink_ais_vessel_message(
        211000001, 0, 0, 36000, 51100, 1023, 121, 15, 0, 0, 0, 0, 0, b"", b"", 0, 0xFFF
    )
    report = codec.ais_report(0.0, heard(ship))
    assert (report.position, report.course_rad, report.heading_rad) == (None, None, None)
    assert (report.speed_mps, report.turn_rate_radps, report.nav_status) == (None, None, None)


def test_ais_of_an_own_receiver_keeps_the_definitions_units():
    ship = wire.MAVLink_ais_vessel_message(
        211000001, 511000000, -13000000, 9000, 9000, 514, -20, 0, 36, 10, 20, 3, 4, b"CALL", b"SAILOR", 2, 0x1056
    )
    own = codec.ais_report(0.0, heard(ship, component=191))
    assert own.speed_mps == pytest.approx(5.14)
    assert math.degrees(own.turn_rate_radps) == pytest.approx(-2.0)
    assert (own.name, own.bow_m, own.age_s) == ("SAILOR", 10.0, 2.0)
    assert codec.ais_report(0.0, heard(ship)).speed_mps == pytest.approx(51.4 * 1852 / 3600)


# ------------------------------------------------------------------------------------------ mutations
NAMES = sorted({m.get_type() for n in ("beat", "boot", "ais", "fence_breach") for m in said(load(n), 1)})
SAMPLES = {m.get_type(): m for n in ("beat", "boot", "ais", "fence_breach") for m in said(load(n), 1)}
EVIL = [math.nan, math.inf, -math.inf, 1e30, -1e30, 3.4e38, 0.0, 361.0, -1.0]


@settings(max_examples=300)
@given(st.sampled_from(NAMES), st.data())
def test_no_field_value_raises_or_gets_through_as_nonsense(name, data):
    message = SAMPLES[name]
    cls = type(message)
    index = data.draw(st.integers(0, len(cls.fieldnames) - 1))
    field, kind = cls.fieldnames[index], cls.fieldtypes[index]
    values = {f: getattr(message, f) for f in cls.fieldnames}
    if kind == "float":
        values[field] = data.draw(st.sampled_from(EVIL))
    elif kind == "char":
        return
    else:
        low, high = {"u": (0, 1), "i": (-1, 1)}[kind[0]]
        bits = int("".join(c for c in kind if c.isdigit()))
        top = 2**bits - 1 if kind[0] == "u" else 2 ** (bits - 1) - 1
        if isinstance(values[field], list):
            return
        values[field] = data.draw(st.sampled_from([low * (top + 1), top * high, 0, 1, top // 2]))
    text = {"text": "_text_raw", "name": "_name_raw", "callsign": "_callsign_raw"}
    arguments = [getattr(message, text.get(f, f)) if isinstance(values[f], str) else values[f] for f in cls.fieldnames]
    assembler = VehicleAssembler()
    assembler.take(0.0, SAMPLES["HEARTBEAT"])
    for value in assembler.take(1.0, heard(cls(*arguments))):
        for attribute in (f.name for f in dataclasses.fields(value)):
            item = getattr(value, attribute)
            if isinstance(item, float):
                assert math.isfinite(item), (name, field, attribute)


def test_bad_values_are_not_used():
    assembler = VehicleAssembler()
    assert assembler.take(0.0, heard(wire.MAVLink_wind_message(math.nan, 5.0, 0.0))) == []
    assert assembler.take(0.0, heard(wire.MAVLink_wind_message(10.0, 500.0, 0.0))) == []
    assert (
        assembler.take(0.0, heard(wire.MAVLink_global_position_int_message(1000, 1_200_000_000, 0, 0, 0, 0, 0, 0, 0)))
        == []
    )


# ------------------------------------------------------------------------------------------ assembling
def position(boot_ms, lat=511000000):
    return heard(wire.MAVLink_global_position_int_message(boot_ms, lat, -13000000, 0, 0, 100, 0, 0, 9000))


def named(name, boot_ms, value):
    return heard(wire.MAVLink_named_value_float_message(boot_ms, name, value))


def test_copies_and_late_frames_are_dropped_and_a_reboot_is_not():
    assembler = VehicleAssembler()
    assert len(assembler.take(0.0, position(60_000))) == 1
    assert assembler.take(0.0, position(60_000)) == []
    assert assembler.take(0.1, position(59_800)) == []
    assert len(assembler.take(3.0, position(2_000))) == 1
    assert assembler.reboots == 1


def test_the_clock_goes_on_where_the_boot_time_begins_again():
    """Held against a boot time of 32 bits the autopilot's clock would go 49.7 days ahead with one SYSTEM_TIME."""
    assembler, end_ms, began_s = VehicleAssembler(), 2**32, 1_780_000_000.0
    assembler.take(0.0, heard(wire.MAVLink_heartbeat_message(11, 3, 65, 10, 4, 3)))
    for t_s in range(-3, 4):
        unix_us = round((began_s + t_s) * 1e6)
        boot_ms = (end_ms + 1000 * t_s) % end_ms
        assembler.take(10.0 + t_s, heard(wire.MAVLink_system_time_message(unix_us, boot_ms)))
        assert assembler.status.utc_at_boot_s == pytest.approx(began_s - end_ms / 1e3, abs=1e-3)
    assert assembler.reboots == 0


def test_the_end_of_32_bits_of_boot_time_is_no_reboot():
    end_ms = 2**32
    assembler = VehicleAssembler()
    states = []
    for t_s in range(-20, 21):
        if t_s == 2:
            assert assembler.take(1.5, position(end_ms - 1000)) == []  # of before the end, overtaken
        states += assembler.take(float(t_s), position((end_ms + 1000 * t_s) % end_ms))
    assert assembler.reboots == 0
    assert [s.boot_s for s in states] == [(end_ms + 1000 * t_s) / 1e3 for t_s in range(-20, 21)]
    assert assembler.take(20.1, position(18_000)) == []  # one that was overtaken
    assert len(assembler.take(21.0, position(2_000))) == 1  # and then it did boot
    assert (assembler.reboots, assembler.boot_s) == (1, 2.0)


def test_a_reboot_before_the_end_of_32_bits_is_one():
    assembler = VehicleAssembler()
    assembler.take(0.0, position(2**32 - 60_000))
    assembler.take(5.0, position(2_000))
    assert assembler.reboots == 1


def test_apparent_wind_is_joined_by_boot_time_once():
    assembler = VehicleAssembler()
    assert assembler.take(0.0, named(b"AppWndSpd", 1000, 5.0)) == []
    assert len(assembler.take(0.0, named(b"AppWndDir", 1000, -40.0))) == 1
    for name, value in ((b"AppWndSpd", 5.0), (b"AppWndDir", -40.0)):
        assert assembler.take(0.1, named(name, 1000, value)) == []  # the copy for another link's WIND
    assert assembler.take(0.5, named(b"AppWndSpd", 1500, 6.0)) == []
    assert assembler.take(1.0, named(b"AppWndDir", 2000, 10.0)) == [], "halves of different moments"
    assert len(assembler.take(1.0, named(b"AppWndSpd", 2000, 6.0))) == 1
    assert assembler.take(1.0, named(b"co_twd", 2000, 6.0)) == []


def test_what_stops_being_told_becomes_unknown():
    assembler = VehicleAssembler()
    assembler.take(0.0, SAMPLES["HEARTBEAT"])
    nav = wire.MAVLink_nav_controller_output_message(0, 0, 0, 90, 100, 0, 0, 1.0)
    assert assembler.take(0.0, heard(nav))[0].waypoint_distance_m == 100.0
    assert assembler.take(1.0, SAMPLES["HEARTBEAT"])[0].waypoint_distance_m == 100.0
    assert assembler.take(7.0, SAMPLES["HEARTBEAT"])[0].waypoint_distance_m is None


def test_the_heading_falls_back_to_the_positions_own_when_attitude_is_old():
    assembler = VehicleAssembler()
    assembler.take(0.0, heard(wire.MAVLink_attitude_message(1000, 0.1, 0.0, 0.5, 0.0, 0.0, 0.01)))
    assert assembler.take(0.1, position(1200))[0].heading_rad == pytest.approx(0.5)
    late = assembler.take(5.0, position(6000))[0]
    assert late.heading_rad == pytest.approx(math.pi / 2)
    assert late.yaw_rate_radps is None


@settings(max_examples=60)
@given(st.text(st.characters(min_codepoint=32, max_codepoint=126), max_size=250), st.integers(0, 70000))
def test_long_texts_survive_chunking(text, text_id):
    assembler = VehicleAssembler()
    values = []
    for message in codec.status_texts(4, text, text_id):
        values += assembler.take(0.0, heard(message))
    assert [v.text for v in values] == [text]


def test_a_text_with_a_lost_chunk_comes_out_with_a_gap():
    assembler = VehicleAssembler()
    chunks = codec.status_texts(4, "a" * 50 + "b" * 50 + "c" * 20, 7)
    assembler.take(0.0, heard(chunks[0]))
    assert assembler.take(0.1, heard(chunks[2])) == []
    late = assembler.take(3.0, heard(codec.status_texts(4, "next", 8)[0]))
    assert [v.text for v in late] == ["a" * 50 + "[...]" + "c" * 20, "next"]


def last(assembler, message):
    values = assembler.take(0.0, heard(message))
    return values[-1] if values else None


def test_a_fence_that_is_told_of_no_more_is_off():
    """A person who switched it off under way took the last line of defence, and nobody said so."""
    assembler, beat = VehicleAssembler(), wire.MAVLink_heartbeat_message(11, 3, 81, 10, 4, 3)
    fence = wire.MAVLink_fence_status_message(0, 0, 0, 0, 0)

    def seen(t_s, message):
        return assembler.take(t_s, heard(message))[-1].fence_on

    assert seen(0.0, beat) is None  # never told of
    assert seen(1.0, fence) is None  # for a moment, by whomever
    assert seen(3.0, fence) is None
    assert seen(9.0, beat) is None
    for t_s in range(20, 26):
        assert seen(float(t_s), fence) is (True if t_s == 25 else None)
    assert seen(29.0, beat) is True
    assert seen(31.0, beat) is False
    assert seen(60.0, beat) is False
    for t_s in range(61, 67):
        assert seen(float(t_s), fence) is (t_s == 66)


def test_what_is_not_looked_at_tells_nothing_of_the_status():
    """The list of what tells, by which the rest is left out, is whole."""
    assembler = VehicleAssembler()
    last(assembler, wire.MAVLink_heartbeat_message(11, 3, 81, 10, 4, 3))
    for kind in wire.mavlink_map.values():
        if kind.msgname not in _TELLING:
            lengths = dict(zip(kind.ordered_fieldnames, kind.array_lengths, strict=True))
            zeros = [
                b"" if what == "char" else [0] * lengths[name] if lengths[name] else 0
                for name, what in zip(kind.fieldnames, kind.fieldtypes, strict=True)
            ]
            assert assembler._told(1.0, kind.msgname, kind(*zeros)) is None, kind.msgname


def test_what_tells_a_failsafe_from_a_person_reaches_the_status():
    assembler = VehicleAssembler()
    last(assembler, wire.MAVLink_heartbeat_message(11, 3, 209, 10, 4, 3))
    every = 0x1331DC2F
    battery, receiver = wire.MAV_SYS_STATUS_SENSOR_BATTERY, wire.MAV_SYS_STATUS_SENSOR_RC_RECEIVER

    def told(enabled, health):
        return last(
            assembler, wire.MAVLink_sys_status_message(every, enabled, health, 0, 12600, 0, 90, 0, 0, 0, 0, 0, 0)
        )

    well = told(every, every)
    assert (well.battery_failed, well.receiver_lost) == (False, False)
    ill = told(every, every & ~battery & ~receiver)
    assert (ill.battery_failed, ill.receiver_lost) == (True, True)
    off = told(every & ~battery & ~receiver, 0)
    assert (off.battery_failed, off.receiver_lost) == (None, None)
    sticks = last(assembler, wire.MAVLink_rc_channels_message(1000, 4, 1500, 1501, 0xFFFF, 1800, *([0] * 14), 255))
    assert sticks.rc_us == (1500, 1501, 0, 1800)
    servos = last(assembler, wire.MAVLink_servo_output_raw_message(1000, 0, 1480, 0, 1500, 1740, 0xFFFF, *([0] * 11)))
    assert servos.servo_us == (1480, 0, 1500, 1740)
    assert last(assembler, wire.MAVLink_servo_output_raw_message(1000, 0, *([0] * 16))).servo_us == ()
    home = last(
        assembler,
        wire.MAVLink_home_position_message(
            508170000, -13100000, 0, 0.0, 0.0, 0.0, (1.0, 0.0, 0.0, 0.0), 0.0, 0.0, 0.0, 0
        ),
    )
    assert home.home == GeoPoint(lat_deg=50.817, lon_deg=-1.31)
    breach = wire.MAVLink_fence_status_message(1, 3, 3, 0, 1)
    once = last(assembler, breach)
    assert (once.fence_breached, once.fence_breaches) == (False, None)  # one alone may be forged
    twice = last(assembler, breach)
    assert (twice.fence_breached, twice.fence_breaches) == (True, 3)


def test_what_a_script_tells_of_a_sensor_is_believed_twice_and_forgotten_when_it_falls_silent():
    def tell(t_s, value, name=b"LEAK"):
        assembler.take(t_s, heard(wire.MAVLink_named_value_float_message(1000, name, value)))
        return assembler.status.sensor("LEAK")

    assembler = VehicleAssembler()
    assembler.take(0.0, heard(wire.MAVLink_heartbeat_message(11, 3, 65, 10, 4, 3)))
    assert [tell(0.1 * n, value) for n, value in enumerate((0.0, 1.0, 0.0, 0.0, 1.0))] == [None, None, None, 0.0, 0.0]
    assert [tell(0.6, 1.0), tell(0.7, math.nan), tell(0.8, 0.0)] == [1.0, 1.0, 1.0]
    assert tell(5.5, 0.0, b"FOO") == 1.0  # nobody's sensor
    assembler.take(5.9, heard(wire.MAVLink_heartbeat_message(11, 3, 65, 10, 4, 3)))
    assert assembler.status.sensors == ()


def test_each_receiver_says_where_it_is_and_one_that_falls_silent_is_forgotten():
    def second(fix_type):
        return heard(
            wire.MAVLink_gps2_raw_message(0, fix_type, 511_000_000, -13_000_000, 0, 121, 200, 0, 65535, 10, 0, 0)
        )

    assembler = VehicleAssembler()
    assembler.take(0.0, heard(wire.MAVLink_heartbeat_message(11, 3, 65, 10, 4, 3)))
    assert assembler.status is not None
    assert assembler.status.gps2 is None
    assembler.take(1.0, second(3))
    assert assembler.status.gps2 == GeoPoint(lat_deg=51.1, lon_deg=-1.3)
    assembler.take(2.0, second(1))
    assert assembler.status.gps2 is None
    assembler.take(3.0, second(6))
    assembler.take(9.0, heard(wire.MAVLink_heartbeat_message(11, 3, 65, 10, 4, 3)))
    assert assembler.status.gps2 is None
