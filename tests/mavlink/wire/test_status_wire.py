"""The status on the air: round trips, size, and what is left when only well-known messages get through."""

import dataclasses
import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as wire

from companion.mavlink.wire.companion_status import (
    MAX_PAYLOAD_BYTES,
    STALE_S,
    StatusReader,
    pack_status,
    pack_traffic,
    status_messages,
    unpack_status,
    unpack_traffic,
)
from companion.mavlink.wire.frames import Codec
from companion.messages import CompanionStatus, GeoPoint, TrafficStatus

ASCII = st.characters(min_codepoint=32, max_codepoint=126)


def maybe(strategy):
    return st.none() | strategy


STATUS = st.builds(
    CompanionStatus,
    t_s=st.floats(0.0, 1e6),
    state=st.text(ASCII, max_size=24),
    goal_index=maybe(st.integers(0, 254)),
    goal_count=maybe(st.integers(0, 254)),
    waypoint_seq=maybe(st.integers(0, 1000)),
    waypoint_count=maybe(st.integers(0, 1000)),
    waypoint_distance_m=maybe(st.floats(0.0, 1e5)),
    goal_distance_m=maybe(st.floats(0.0, 1e6)),
    cross_track_m=maybe(st.floats(-1e4, 1e4)),
    clearance_m=maybe(st.floats(-100.0, 1e5)),
    twd_from_rad=maybe(st.floats(-10.0, 10.0)),
    twd_sigma_rad=maybe(st.floats(0.0, 3.0)),
    tws_mps=maybe(st.floats(0.0, 80.0)),
    tws_sigma_mps=maybe(st.floats(0.0, 20.0)),
    next_tack_s=maybe(st.floats(0.0, 60000.0)),
    promised_risk=maybe(st.floats(0.0, 1.0)),
    plan_id=maybe(st.integers(0, 60000)),
    plan_age_s=maybe(st.floats(0.0, 60000.0)),
    replans=maybe(st.integers(0, 60000)),
    tacks=maybe(st.integers(0, 60000)),
    battery_v=maybe(st.floats(0.0, 60.0)),
    position=maybe(st.builds(GeoPoint, lat_deg=st.floats(-89.0, 89.0), lon_deg=st.floats(0.1, 179.0))),
    bytes_out_per_s=maybe(st.floats(0.0, 60000.0)),
    alert_code=st.text(ASCII, max_size=16),
    alert_text=st.text(ASCII, max_size=80),
)
TOLERANCE = {
    "t_s": 0.1,
    "twd_sigma_rad": 1e-4,
    "tws_mps": 0.006,
    "tws_sigma_mps": 0.006,
    "next_tack_s": 0.51,
    "plan_age_s": 0.51,
    "battery_v": 0.006,
    "bytes_out_per_s": 0.51,
}


@settings(max_examples=200)
@given(STATUS)
def test_a_status_survives_the_air(status):
    payload = pack_status(status)
    assert len(payload) <= MAX_PAYLOAD_BYTES
    back = unpack_status(payload)
    for field in dataclasses.fields(CompanionStatus):
        sent, got = getattr(status, field.name), getattr(back, field.name)
        if sent is None:
            assert got is None, field.name
        elif field.name == "twd_from_rad":
            assert abs(math.remainder(got - sent, 2.0 * math.pi)) < 1e-4
        elif field.name == "alert_text":
            assert got == sent or (got.endswith("...") and sent.startswith(got[:-3]))
        elif field.name == "position":
            assert abs(got.lat_deg - sent.lat_deg) < 1e-6
        elif isinstance(sent, float):
            assert got == pytest.approx(sent, rel=1e-6, abs=TOLERANCE.get(field.name, 1e-6)), field.name
        else:
            assert got == sent, field.name


@settings(max_examples=200)
@given(st.binary(max_size=140))
def test_no_payload_raises_anything_but_value_error(payload):
    try:
        status = unpack_status(payload)
    except ValueError:
        return
    assert math.isfinite(status.t_s)


FULL = CompanionStatus(
    t_s=100.0,
    state="destination approach",
    twd_from_rad=math.radians(350.0),
    twd_sigma_rad=math.radians(9.0),
    tws_mps=5.2,
    tws_sigma_mps=1.1,
    promised_risk=0.03,
    next_tack_s=100.0,
    cross_track_m=-6.0,
    plan_id=17,
    alert_code="wind shift",
    alert_text="x" * 80,
)


def test_a_sentence_that_is_cut_says_so():
    """ "staying near by: ordered by somebody on" looked as if that were all."""
    words = "staying near by: ordered by somebody on board; waiting until told to go on, " * 2
    got = unpack_status(pack_status(dataclasses.replace(FULL, order="hold", alert_text=words))).alert_text
    assert got.endswith("...")
    assert words.startswith(got[:-3])


def test_no_figure_of_it_is_cut():
    """ "where 1.3 m" was left of "where 1.3 m/s": metres."""
    words = "she makes 2.8 m/s ahead where 1.3 m/s is all that her file has in this wind, she is held"
    for more in range(40):
        text = "x" * more + " " + words
        got = unpack_status(pack_status(dataclasses.replace(FULL, alert_text=text))).alert_text
        assert got == text or (set(got.removesuffix("...").split()) <= {w.rstrip(",") for w in text.split()})


def on_air(status, turns, keep=lambda _: True):
    sender, receiver = Codec(1, 191), Codec(254, 25)
    sent = [m for turn in range(turns) for m in status_messages(status, 50.0, turn)]
    return [m for s in sent for m in receiver.feed(sender.pack(s)) if keep(m)]


def test_every_turn_is_below_the_budget():
    codec = Codec(1, 191)
    for turn in range(8):
        size = sum(len(codec.pack(m)) for m in status_messages(FULL, 50.0, turn))
        # one turn every 2 s, a heartbeat of 21 bytes each second
        assert size / 2.0 + 21.0 <= 130.0


def test_the_reader_prefers_the_packed_value():
    reader = StatusReader()
    assert reader.report(0.0) is None
    for m in on_air(FULL, 4):
        assert reader.take(10.0, m)
    report = reader.report(12.0)
    assert report.has_packed
    assert report.status.plan_id == 17
    assert report.age_s["status"] == pytest.approx(2.0)
    assert not reader.report(10.0 + STALE_S + 1.0).has_packed


def test_well_known_messages_alone_tell_the_main_figures():
    reader = StatusReader()
    for m in on_air(FULL, 4, keep=lambda m: m.get_type() != "TUNNEL"):
        reader.take(10.0, m)
    report = reader.report(11.0)
    assert not report.has_packed
    status = report.status
    assert math.degrees(status.twd_from_rad) == pytest.approx(350.0, abs=0.1)
    assert math.degrees(status.twd_sigma_rad) == pytest.approx(9.0, abs=0.1)
    assert status.tws_mps == pytest.approx(5.2, abs=0.01)
    assert status.promised_risk == pytest.approx(0.03, abs=1e-4)
    assert (status.next_tack_s, status.cross_track_m) == (pytest.approx(100.0), pytest.approx(-6.0))
    assert status.plan_id is None


def test_other_components_and_bad_values_are_left_out():
    reader = StatusReader()
    for m in on_air(FULL, 4):
        m.get_header().srcComponent = 1
        assert not reader.take(0.0, m)
    nan = Codec(1, 191).feed(Codec(1, 191).pack(wire.MAVLink_named_value_float_message(0, b"co_xt", math.nan)))[0]
    assert not reader.take(0.0, nan)
    assert reader.bad == 1
    assert reader.report(1.0) is None


SEEN = st.builds(
    TrafficStatus,
    vessels=st.integers(0, 60000),
    refused=st.integers(0, 60000),
    feeds=st.integers(0, 200),
    silent_feeds=st.integers(0, 200),
    shared_mmsi=st.integers(0, 200),
    clock_jumps=st.integers(0, 200),
    silence_s=maybe(st.floats(0.0, 60000.0)),
    name=st.text(ASCII, max_size=20),
    alarm=st.sampled_from(["", "none", "warn", "act", "touch"]),
    role=st.sampled_from(["", "give way", "stand on", "both alter to starboard", "keep clear"]),
    rule=st.sampled_from(["", "none", "12", "13", "18"]),
    range_m=maybe(st.floats(0.0, 1e5)),
    promised_risk=maybe(st.floats(0.0, 1.0)),
    path_risk=maybe(st.floats(0.0, 1.0)),
    bearing_rad=maybe(st.floats(-10.0, 10.0)),
    cpa_m=maybe(st.floats(0.0, 1e5)),
    tcpa_s=maybe(st.floats(0.0, 60000.0)),
)


@settings(max_examples=200)
@given(SEEN)
def test_what_is_seen_of_vessels_survives_the_air(seen):
    payload = pack_traffic(seen)
    assert len(payload) <= MAX_PAYLOAD_BYTES
    back = unpack_traffic(payload)
    for field in dataclasses.fields(TrafficStatus):
        sent, got = getattr(seen, field.name), getattr(back, field.name)
        if sent is None or not isinstance(sent, float):
            assert got == sent, field.name
        elif field.name == "bearing_rad":
            assert abs(math.remainder(got - sent, 2.0 * math.pi)) < 1e-4
        else:
            assert got == pytest.approx(sent, rel=1e-6, abs=0.51 if field.name.endswith("_s") else 1e-6), field.name


@settings(max_examples=200)
@given(st.binary(max_size=140))
def test_no_traffic_payload_raises_anything_but_value_error(payload):
    try:
        unpack_traffic(b"\x01" + payload)
    except ValueError:
        return


def test_the_reader_joins_status_and_traffic_and_says_how_old_each_is():
    seen = TrafficStatus(vessels=3, name="Nellie", alarm="act", role="give way", rule="18", cpa_m=12.0)
    status = CompanionStatus(t_s=5.0, state="standard", traffic=seen)
    reader = StatusReader()
    for t_s, what in ((10.0, status), (12.0, dataclasses.replace(status, traffic=None))):
        for message in on_air(what, 1):
            reader.take(t_s, message)
    report = reader.report(13.0)
    assert report.status.traffic == seen
    assert report.age_s["traffic"] == 3.0
    assert report.age_s["status"] == 1.0
    assert reader.report(10.0 + STALE_S + 1.0).status.traffic is None


def test_a_slow_computer_is_told_beside_the_packed_status_and_forgotten_when_it_is_told_no_more():
    reader, status = StatusReader(), CompanionStatus(t_s=5.0, state="standard", plan_answer_s=6.5)
    messages = [m for turn in range(4) for m in status_messages(status, 10.0, turn)]
    codec = Codec(1, 191)
    for message in codec.feed(b"".join(codec.pack(m) for m in messages)):
        reader.take(1.0, message)
    assert reader.report(2.0).status.plan_answer_s == pytest.approx(6.5)
    assert reader.report(2.0 + STALE_S).status.plan_answer_s is None
    quick = CompanionStatus(t_s=5.0, state="standard")
    assert all(getattr(m, "name", "") != "co_plan" for turn in range(4) for m in status_messages(quick, 10.0, turn))
