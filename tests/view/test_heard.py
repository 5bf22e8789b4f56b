"""The view ashore, from what a radio brings: nothing made up, every part with its age."""

import math

import pytest
from pymavlink.dialects.v20 import ardupilotmega as wire

from companion.mavlink.wire import StatusReader
from companion.mavlink.wire.companion_status import status_messages
from companion.mavlink.wire.frames import Codec
from companion.messages import CompanionStatus, GeoPoint, TrafficStatus
from companion.view import HeardFold
from tests.view.test_view import valid

STATUS = CompanionStatus(
    t_s=1.0,
    state="standard",
    tws_mps=5.0,
    twd_from_rad=math.radians(350.0),
    twd_sigma_rad=math.radians(8.0),
    waypoint_seq=3,
    waypoint_count=9,
    goal_index=0,
    goal_count=1,
    promised_risk=0.1,
    clearance_m=21.0,
    plan_id=7,
    plan_age_s=30.0,
    battery_v=12.4,
    position=GeoPoint(lat_deg=50.817, lon_deg=-1.31),
    order="hold",
    order_age_s=60.0,
    alert_code="position lost",
    alert_text="the position is lost",
    traffic=TrafficStatus(
        vessels=1,
        name="FERRY",
        alarm="act",
        role="give way",
        rule="crossing",
        range_m=200.0,
        bearing_rad=1.0,
        cpa_m=12.0,
        tcpa_s=60.0,
    ),
)


def heard(status, at_s=1.0):
    reader, companion, ear = StatusReader(), Codec(system=1, component=191), Codec(system=1, component=191)
    for turn in range(8):
        for message in status_messages(status, 1.0, turn):
            for got in ear.feed(companion.pack(message)):
                reader.take(at_s, got)
    return reader


def test_nothing_heard_is_a_view_of_nothing():
    view, events = HeardFold("boat").take(3.0, None, None, None)
    valid(view)
    assert view.source == "radio"
    assert (view.age_s, view.boat.at_en_m, view.wind, view.plan, view.area) == (None,) * 5
    assert events == ()


def test_a_status_is_seen_with_its_ages():
    fold = HeardFold("boat")
    view, events = fold.take(4.0, heard(STATUS).report(4.0), None, None)
    valid(view)
    valid(fold.area, "Area")
    assert view.age_s == pytest.approx(3.0)
    assert (view.state.phase, view.wind.twd_from_deg, view.plan.promised_risk) == ("standard", 350.0, 0.1)
    assert view.wind.bands == ()  # the forecast is not on the air: unknown
    assert view.laylines is None
    assert view.boat.heading_deg is None
    assert view.orders.standing.verb == "hold"
    assert [(v.name, v.alarm) for v in view.vessels] == [("FERRY", "act")]
    assert {e.kind for e in events} == {"phase", "said"}
    later, again = fold.take(8.0, heard(STATUS).report(8.0), None, None)
    assert later.age_s == pytest.approx(7.0)
    assert again == ()  # said once
    assert {p.grade for p in later.health if p.name == "companion"} == {"good"}
    old, _ = fold.take(13.0, heard(STATUS).report(13.0), None, None)
    assert {p.grade for p in old.health if p.name == "companion"} == {"bad"}


def test_a_foreign_message_tells_nothing():
    reader = StatusReader()
    [message] = Codec(1, 1).feed(Codec(system=1, component=1).pack(wire.MAVLink_heartbeat_message(10, 3, 0, 0, 0, 3)))
    assert not reader.take(1.0, message)
    assert HeardFold().take(2.0, reader.report(2.0), None, None)[0].state.phase == "not heard"
