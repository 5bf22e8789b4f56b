"""NMEA 0183: every sentence is read back by an independent parser (pynmea2), whatever there is to tell."""

import math
from dataclasses import replace
from datetime import UTC, datetime

import pynmea2
import pytest
from hypothesis import given
from hypothesis import strategies as st

from companion.geo.frame import LocalFrame
from companion.messages import GeoPoint
from companion.outputs import nmea
from companion.outputs.nmea import lines_of
from companion.view.values import BoatView, GoalView, LegView, PlanView, StateView, View, WindView
from tests.outputs.conftest import ORIGIN, view_of

KNOT = 1852.0 / 3600.0
UTC_S = datetime(2026, 11, 22, 20, 15, 3, 250_000, tzinfo=UTC).timestamp()
FRAME = LocalFrame(ORIGIN)

angles = st.floats(-10.0, 10.0)
speeds = st.floats(0.0, 60.0)
points = st.builds(GeoPoint, lat_deg=st.floats(-90.0, 90.0), lon_deg=st.floats(-180.0, 180.0))


def read(line):
    """Read a sentence strictly: its form, its checksum, its length, its talker."""
    assert line.endswith("\r\n")
    assert len(line) <= 82
    message = pynmea2.parse(line.strip(), check=True)
    assert line.startswith("$II")
    return message


def told(view, utc_s=UTC_S):
    lines = lines_of(view, FRAME, utc_s)
    by_kind = {}
    for line in (*lines.now, *lines.route):
        message = read(line)
        by_kind.setdefault(message.sentence_type, []).append(message)
    return by_kind


def degrees_of(minutes, side):
    return pynmea2.nmea_utils.dm_to_sd(minutes) * (-1.0 if side in "SW" else 1.0)


def degrees_apart(a, b):
    return abs((a - b + 180.0) % 360.0 - 180.0)


# ------------------------------------------------------------------------------------------ sentences
@given(angles, speeds, st.booleans(), st.booleans())
def test_the_wind_is_read_back(angle, speed, is_apparent, is_valid):
    message = read(nmea.mwv(angle, speed, is_apparent=is_apparent, is_valid=is_valid))
    assert degrees_apart(float(message.wind_angle), math.degrees(angle)) <= 0.051
    assert 0.0 <= float(message.wind_angle) < 360.0
    assert float(message.wind_speed) * KNOT == pytest.approx(speed, abs=0.03)
    assert (message.reference, message.wind_speed_units) == ("R" if is_apparent else "T", "N")
    assert message.status == ("A" if is_valid else "V")


@given(angles, speeds)
def test_the_winds_direction_and_the_heading_are_read_back(angle, speed):
    wind = read(nmea.mwd(angle, speed))
    assert degrees_apart(float(wind.direction_true), math.degrees(angle)) <= 0.051
    assert float(wind.wind_speed_meters) == pytest.approx(speed, abs=0.051)
    assert degrees_apart(float(read(nmea.hdt(angle)).heading), math.degrees(angle)) <= 0.051


@given(points, speeds, angles, st.floats(0.0, 4e9))
def test_where_she_is_is_read_back(point, speed, course, utc_s):
    message = read(nmea.rmc(utc_s, point, speed, course))
    assert message.status == "A"
    assert message.latitude == pytest.approx(point.lat_deg, abs=1e-6)
    assert message.longitude == pytest.approx(point.lon_deg, abs=1e-6)
    assert float(message.spd_over_grnd) * KNOT == pytest.approx(speed, abs=0.03)
    assert degrees_apart(float(message.true_course), math.degrees(course)) <= 0.051
    when = datetime.fromtimestamp(utc_s, UTC)
    assert message.datestamp.timetuple()[1:3] == when.timetuple()[1:3]
    assert (message.timestamp.hour, message.timestamp.minute, message.timestamp.second) == when.timetuple()[3:6]


@given(st.floats(-40_000.0, 40_000.0), angles, angles, points, st.floats(0.0, 3e6), st.none() | st.floats(-60.0, 60.0))
def test_the_waypoint_is_read_back(right, leg, bearing, point, distance, closing):
    message = read(nmea.rmb(right, "WWWWWW-8", point, distance, bearing, closing, has_arrived=False))
    assert message.status == "A"
    assert float(message.cross_track_error) == pytest.approx(min(9.99, abs(right) / 1852.0), abs=1e-4)
    assert message.cte_correction_dir == ("L" if right > 0.0 else "R")  # to steer: back to the leg
    assert (message.dest_waypoint_id, message.origin_waypoint_id) == ("WWWWWW-8", "FROM")
    assert degrees_of(message.dest_lat, message.dest_lat_dir) == pytest.approx(point.lat_deg, abs=1e-6)
    assert degrees_of(message.dest_lon, message.dest_lon_dir) == pytest.approx(point.lon_deg, abs=1e-6)
    coarse = 0.051 if distance > 180_000.0 else 1e-3
    assert float(message.dest_range) == pytest.approx(min(999.9, distance / 1852.0), abs=coarse)
    assert degrees_apart(float(message.dest_true_bearing), math.degrees(bearing)) <= 0.051
    assert message.arrival_alarm == "V"
    helm = read(nmea.apb(right, leg, bearing, "WWWWWW-8", is_inside=True, is_past=False))
    assert (helm.dest_waypoint_id, helm.arr_circle_entered, helm.perp_passed) == ("WWWWWW-8", "A", "V")
    assert degrees_apart(float(helm.bearing_to_dest), math.degrees(leg)) <= 0.051
    assert helm.dir_steer == message.cte_correction_dir


@given(st.lists(st.from_regex(r"[A-Za-z0-9_-]{1,8}", fullmatch=True), min_size=1, max_size=200))
def test_a_route_is_read_back_whole_however_long_it_is(names):
    parts = [read(line) for line in nmea.rte(names)]
    assert [int(part.sen_num) for part in parts] == list(range(1, len(parts) + 1))
    assert {int(part.num_in_seq) for part in parts} == {len(parts)}
    assert [name for part in parts for name in part.waypoint_list] == names


@given(st.text(max_size=40))
def test_any_name_of_a_goal_can_be_told(text):
    name = nmea.name_of(text)
    assert len(name) <= nmea.NAME_CHARACTERS
    read(nmea.wpl(ORIGIN, name))


@pytest.mark.parametrize("field", ["a,b", "a*b", "a$b", "\r\n", "ä", "x" * 80])
def test_what_would_break_a_sentence_is_never_written(field):
    with pytest.raises(ValueError, match="HDT"):
        nmea.sentence("HDT", field)


# ----------------------------------------------------------------------------------------- the view
def test_a_boat_on_her_leg_is_told(view):
    told_ = told(view)
    assert set(told_) == {"RMC", "HDT", "MWV", "MWD", "APB", "RMB", "WPL", "RTE"}
    apparent, true = told_["MWV"]
    assert (apparent.reference, float(apparent.wind_angle), float(apparent.wind_speed)) == ("R", 36.0, 11.9)
    assert (true.reference, float(true.wind_angle), float(true.wind_speed)) == ("T", 45.0, 9.7)
    rmc, rmb, apb = told_["RMC"][0], told_["RMB"][0], told_["APB"][0]
    assert rmc.datetime.isoformat() == "2026-11-22T20:15:03.250000+00:00"
    assert (rmb.dest_waypoint_id, rmb.cte_correction_dir) == ("W2", "L")  # she is right of the leg
    assert float(rmb.cross_track_error) * 1852.0 == pytest.approx(5.0, abs=0.2)
    assert float(rmb.dest_range) * 1852.0 == pytest.approx(math.hypot(32.0, 51.0), abs=1.0)
    assert float(apb.bearing_to_dest) == pytest.approx(36.9, abs=0.05)
    assert [w.waypoint_list for w in told_["RTE"]] == [["W2", "Northmar"]]
    mark = told_["WPL"][1]
    point = GeoPoint(lat_deg=degrees_of(mark.lat, mark.lat_dir), lon_deg=degrees_of(mark.lon, mark.lon_dir))
    assert FRAME.en_from_geo(point) == pytest.approx((160.0, 80.0), abs=0.3)


def test_a_position_that_is_old_is_not_told_as_one(view):
    told_ = told(replace(view, boat=replace(view.boat, age_s=6.0)))
    assert (told_["RMC"][0].status, told_["RMC"][0].lat) == ("V", "")
    assert {"HDT", "APB", "RMB"}.isdisjoint(told_)
    assert {m.status for m in told_["MWV"]} == {"V"}  # an angle at the bow is as old as the heading
    assert "MWD" in told_


@pytest.mark.parametrize("wind", [{"health": "untrusted"}, {"age_s": 6.0}, {"age_s": None}])
def test_a_wind_that_is_not_to_be_believed_says_so(view, wind):
    told_ = told(replace(view, wind=replace(view.wind, **wind)))
    assert {m.status for m in told_["MWV"]} == {"V"}
    assert "MWD" not in told_


def test_without_the_time_by_gps_none_is_told(view):
    rmc = told(view, None)["RMC"][0]
    assert (rmc.timestamp, rmc.datestamp, rmc.status) == (None, None, "A")


def test_a_boat_that_does_not_sail_steers_nowhere(view):
    told_ = told(replace(view, state=StateView(phase="waiting", is_sailing=False)))
    assert {"APB", "RMB"}.isdisjoint(told_)
    assert "RTE" in told_


def test_two_goals_of_one_name_are_two_waypoints():
    goals = tuple(GoalView(name="Mark", kind="point", at_en_m=(east, 80.0)) for east in (60.0, 160.0))
    assert told(view_of(goals=goals))["RTE"][0].waypoint_list == ["Mark", "W3"]


def test_a_goal_that_is_called_as_a_leg_is_numbered_keeps_its_name_alone():
    goals = (GoalView(name="W3", kind="point", at_en_m=(60.0, 80.0)),)
    assert told(view_of(goals=goals))["RTE"][0].waypoint_list == ["W3", "W3-"]


numbers, turns = st.none() | st.floats(0.0, 359.9), st.none() | st.floats(-180.0, 179.9)
ages = st.none() | st.floats(0.0, 30.0)
places = st.tuples(st.floats(-4e4, 4e4), st.floats(-4e4, 4e4))
boats = st.builds(
    BoatView,
    age_s=ages,
    lat_deg=st.none() | st.floats(-90.0, 90.0),
    lon_deg=st.none() | st.floats(-180.0, 180.0),
    at_en_m=st.none() | places,
    heading_deg=numbers,
    cog_deg=numbers,
    sog_mps=st.none() | speeds,
    roll_deg=st.none() | st.floats(-90.0, 90.0),
    battery_v=st.none() | st.floats(0.0, 30.0),
)
winds = st.none() | st.builds(
    WindView,
    health=st.sampled_from(["none", "settling", "good", "light", "untrusted"]),
    age_s=ages,
    twd_from_deg=numbers,
    tws_mps=st.none() | speeds,
    twa_deg=turns,
    awa_deg=turns,
    aws_mps=st.none() | speeds,
)
legs = st.builds(LegView, from_en_m=places, to_en_m=places, is_loiter=st.booleans())
plans = st.none() | st.builds(
    PlanView, leg=st.none() | st.integers(1, 300), legs=st.lists(legs, max_size=12).map(tuple)
)
marks = st.builds(GoalView, name=st.text(max_size=12), kind=st.just("point"), at_en_m=places)
views = st.builds(
    View,
    source=st.just("live"),
    name=st.just("t"),
    t_s=st.floats(0.0, 1e6),
    boat=boats,
    wind=winds,
    plan=plans,
    goals=st.lists(marks, max_size=3).map(tuple),
    state=st.builds(StateView, phase=st.just("standard"), is_sailing=st.none() | st.booleans()),
)


@given(views, st.none() | st.floats(0.0, 4e9))
def test_whatever_the_view_holds_its_sentences_can_be_read(view, utc_s):
    told(view, utc_s)
