"""AIS_VESSEL as the real ArduRover sent it (a recording of 229 s: five invented ships, own boat sailing east).

``ais_scenario.tlog`` holds its AIS_VESSEL frames and one GLOBAL_POSITION_INT a second, nothing else.
"""

from __future__ import annotations

import math
import struct
from pathlib import Path

import pytest
from pymavlink.dialects.v20 import ardupilotmega as wire

from companion.geo.frame import LocalFrame
from companion.mavlink.wire.codec import ais_report, geo_point
from companion.messages import GeoPoint
from companion.traffic import LAKE, Alarm, OwnShip, Role, Targets, assess, cpa

HOME = LocalFrame(GeoPoint(lat_deg=51.1, lon_deg=-1.3))
CARGO, FERRY, TANKER, TRAWLER = 211000001, 211000002, 211000003, 211000004


def frames():
    data = Path(__file__).with_name("ais_scenario.tlog").read_bytes()
    codec, at, zero = wire.MAVLink(None), 0, None
    while at < len(data):
        stamp = struct.unpack(">Q", data[at : at + 8])[0] / 1e6
        length = data[at + 9] + 12
        zero = stamp if zero is None else zero
        yield stamp - zero, codec.decode(bytearray(data[at + 8 : at + 8 + length]))
        at += 8 + length


def fold(until_s: float) -> tuple[Targets, OwnShip]:
    targets, own = Targets.empty(HOME), None
    for t_s, message in frames():
        if t_s > until_s:
            break
        if message.get_type() == "AIS_VESSEL":
            targets = targets.heard(ais_report(t_s, message))
        else:
            velocity = (message.vy / 100.0, message.vx / 100.0)
            own = OwnShip(
                t_s=t_s,
                en_m=HOME.en_from_geo(geo_point(message.lat, message.lon)),
                velocity_en_mps=velocity,
                heading_rad=math.radians(message.hdg / 100.0),
            )
    assert own is not None
    return targets, own


def test_the_cargo_ship_that_will_pass_at_six_metres_is_an_alarm_a_minute_before() -> None:
    targets, own = fold(50.0)
    cargo = next(v for v in targets.picture(50.0).vessels if v.mmsi == CARGO)
    assert cargo.speed_mps == pytest.approx(5.0, abs=0.06)  # 0.1 knots on the wire, not cm/s
    approach = cpa(own, cargo, 50.0)
    # It passes 6.3 m off (antenna to antenna) at 109.6 s; its size is unknown, a coaster's is assumed.
    assert approach.time_s == pytest.approx(59.6, abs=14.0)
    assert approach.distance_m < 20.0
    seen = {a.vessel.mmsi: a for a in assess(own, targets.picture(50.0), LAKE, 0.0)}
    assert seen[CARGO].alarm >= Alarm.WARN
    assert seen[FERRY].alarm is Alarm.NONE
    assert seen[CARGO].encounter.role in {Role.STAND_ON, Role.KEEP_CLEAR, Role.GIVE_WAY}


def test_an_anchored_tanker_is_stopped_and_class_b_never_arrives() -> None:
    targets, _ = fold(200.0)
    vessels = {v.mmsi: v for v in targets.picture(200.0).vessels}
    assert vessels[TANKER].is_stopped
    assert 211000005 not in vessels


def test_a_silent_trawler_grows_old_and_its_spread_with_it() -> None:
    early, _ = fold(136.0)
    late, _ = fold(228.0)
    before = next(v for v in early.picture(136.0).vessels if v.mmsi == TRAWLER)
    after = next(v for v in late.picture(228.0).vessels if v.mmsi == TRAWLER)
    assert late.picture(228.0).age_s(after) > 80.0
    assert early.picture(136.0).age_s(before) < 15.0
    assert after.reports <= before.reports + 2  # the repeats every 30 s bring no news
    assert late.counts.late >= 1
