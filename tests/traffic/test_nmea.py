"""Sentences and the JSON feed: what is right is read, what is not is counted and never raises."""

from __future__ import annotations

import json
import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pyais.encode import encode_dict

from companion.traffic.nmea import MAX_PENDING, NmeaDecoder, decode_json, has_right_checksum

TYPE1 = "!AIVDM,1,1,,A,15M:Ih0P0vJmfCPHvp88IVd1P000,0*64"
TYPE3 = "!AIVDM,1,1,,A,3815;hUw00wfUdHMPfQ4s8WT0D`r,0*00"


def sentences(**fields: object) -> list[str]:
    return list(encode_dict(fields, talker_id="AI", sentence_type="VDM"))


def test_a_position_report() -> None:
    r = NmeaDecoder().feed(TYPE1, 12.0)
    assert r is not None
    assert (r.mmsi, r.t_s) == (366123456, 12.0)
    assert r.position is not None
    assert r.position.lat_deg == pytest.approx(43.66, abs=1e-4)
    assert r.position.lon_deg == pytest.approx(-72.15, abs=1e-4)
    assert r.speed_mps == pytest.approx(6.2 * 1852 / 3600, abs=0.01)
    assert r.course_rad is not None
    assert math.degrees(r.course_rad) == pytest.approx(215.0, abs=0.1)


def test_checksum_00_is_a_checksum() -> None:
    r = NmeaDecoder().feed(TYPE3, 0.0)
    assert r is not None
    assert r.nav_status == 5


def test_not_available_is_unknown() -> None:
    lines = sentences(
        type=1, mmsi=235000001, lat=51.0, lon=-1.0, course=360.0, speed=102.3, heading=511, turn=-128, status=15
    )
    r = NmeaDecoder().feed(lines[0], 0.0)
    assert r is not None
    assert (r.course_rad, r.speed_mps, r.heading_rad, r.turn_rate_radps, r.nav_status) == (None,) * 5
    lines = sentences(type=1, mmsi=235000001, lat=91.0, lon=181.0, course=10.0, speed=5.0, heading=10)
    r = NmeaDecoder().feed(lines[0], 0.0)
    assert r is not None
    assert r.position is None


def test_a_static_report_in_two_sentences_with_others_between() -> None:
    a, b = sentences(
        type=5, mmsi=235000002, shipname="EVER WIDE", ship_type=70, to_bow=150, to_stern=50, to_port=10, to_starboard=20
    )
    d = NmeaDecoder()
    assert d.feed(a, 0.0) is None
    assert d.feed(TYPE1, 0.5) is not None
    r = d.feed(b, 1.0)
    assert r is not None
    assert (r.name, r.ship_type, r.bow_m, r.stern_m, r.port_m, r.starboard_m) == ("EVER WIDE", 70, 150, 50, 10, 20)


def test_fragments_out_of_order_are_put_together_and_late_ones_dropped() -> None:
    a, b = sentences(type=5, mmsi=235000002, shipname="X", ship_type=70)
    d = NmeaDecoder()
    assert d.feed(b, 0.0) is None
    assert d.feed(a, 0.1) is not None
    assert d.feed(a, 10.0) is None
    assert d.feed(b, 40.0) is None
    assert d.counts.bad_fragment == 1


def test_class_b() -> None:
    r = NmeaDecoder().feed(sentences(type=18, mmsi=235000003, lat=51.0, lon=-1.0, course=90.0, speed=4.0)[0], 0.0)
    assert r is not None
    assert r.is_class_b


def test_bad_checksum_is_counted() -> None:
    d = NmeaDecoder()
    assert d.feed(TYPE1[:-2] + "65", 0.0) is None
    assert d.feed(TYPE1[:-3], 0.0) is None
    assert d.counts.bad_checksum == 2


def test_own_transponder_is_not_traffic() -> None:
    d = NmeaDecoder()
    assert d.feed("!AIVDO,1,1,,A,15M:Ih0P0vJmfCPHvp88IVd1P000,0*66", 0.0) is None
    assert (d.counts.other, d.counts.refused) == (1, 0)


def test_fragments_are_bounded() -> None:
    d = NmeaDecoder()
    for i in range(10 * MAX_PENDING):
        body = f"AIVDM,2,1,{i % 10},{chr(65 + i // 10 % 26)},5,0"
        check = 0
        for c in body:
            check ^= ord(c)
        d.feed(f"!{body}*{check:02X}", 0.0)
    assert len(d._pending) <= MAX_PENDING


@settings(max_examples=200)
@given(st.one_of(st.binary(max_size=200), st.text(max_size=120)))
def test_noise_never_raises(line: str | bytes) -> None:
    d = NmeaDecoder()
    d.feed(line, 0.0)
    assert d.counts.lines == 1


@settings(max_examples=200)
@given(
    st.text(alphabet="0123456789:;<=>?@ABCDEFGHIJKLMNOPQRSTUVW`abcdefghijklmnopqrstuvw", max_size=60), st.integers(0, 5)
)
def test_any_payload_with_a_right_checksum_is_a_finite_report_or_nothing(payload: str, fill: int) -> None:
    body = f"AIVDM,1,1,,A,{payload},{fill}"
    check = 0
    for c in body:
        check ^= ord(c)
    line = f"!{body}*{check:02X}"
    assert has_right_checksum(line)
    r = NmeaDecoder().feed(line, 1.0)
    if r is not None:
        for value in (r.course_rad, r.heading_rad):
            assert value is None or 0.0 <= value < 2.0 * math.pi
        assert r.speed_mps is None or 0.0 <= r.speed_mps < 53.0


def test_json_feed() -> None:
    r = decode_json(
        json.dumps(
            {"id": 7, "lat": 48.36, "lon": -4.54, "heading_deg": -90, "speed_mps": 1.5, "length_m": 6.0, "spare": [1]}
        ).encode(),
        3.0,
    )
    assert r is not None
    assert r.mmsi == 7
    assert r.course_rad == pytest.approx(math.radians(270.0))
    assert (r.bow_m, r.stern_m) == (3.0, 3.0)


@pytest.mark.parametrize(
    "raw",
    [
        b"",
        b"{",
        b"[]",
        b"null",
        b'{"lat": 91, "lon": 0}',
        b'{"lat": NaN, "lon": 0}',
        b'{"lat": "1", "lon": 0}',
        b'{"lat": 1, "lon": 2, "mmsi": -4}',
        b'{"lat": 1, "lon": 2, "mmsi": 1e99}',
        b"\xff\xfe",
        b"[" * 5000,
        b'{"lat": 1e400, "lon": 0}',
        b'{"lat": true, "lon": 0}',
        b" " * 9000,
    ],
)
def test_bad_json_is_no_report(raw: bytes) -> None:
    assert decode_json(raw, 0.0) is None


@settings(max_examples=150)
@given(
    st.dictionaries(
        st.sampled_from(["lat", "lon", "mmsi", "id", "speed_mps", "heading_deg", "age_s", "length_m"]),
        st.one_of(st.none(), st.booleans(), st.integers(), st.floats(), st.text(max_size=5)),
    )
)
def test_any_json_is_finite_or_nothing(raw: dict[str, object]) -> None:
    r = decode_json(json.dumps(raw).encode(), 0.0)
    if r is not None:
        values = (r.course_rad, r.speed_mps, r.heading_rad, r.bow_m, r.stern_m, r.age_s)
        assert all(v is None or math.isfinite(v) for v in values)


@pytest.mark.parametrize("age", [3601, -1, "7200", math.nan, 1e400, True])
def test_a_report_whose_age_cannot_be_is_none_of_now(age) -> None:
    """An age that was not understood was 0: a place of two hours ago was one of this second."""
    raw = {"id": 7, "lat": 50.0, "lon": -1.0}
    assert decode_json(json.dumps(raw).encode(), 0.0).age_s == 0.0
    assert decode_json(json.dumps({**raw, "age_s": None}).encode(), 0.0).age_s == 0.0
    assert decode_json(json.dumps({**raw, "age_s": 3600}).encode(), 0.0).age_s == 3600.0
    assert decode_json(json.dumps({**raw, "age_s": age}).encode(), 0.0) is None
