"""True wind from apparent wind, and back: signs, frames, quality."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.geo.angles import wrap_pi
from companion.messages import ApparentWind, GeoPoint, VehicleState, WindQuality, WindSample, WindSource
from companion.wind import VaneParameters, apparent_wind, true_wind

HERE = GeoPoint(lat_deg=0.0, lon_deg=0.0)
ANGLE = st.floats(-math.pi, math.pi)


def boat(heading_deg, speed=0.0, *, course_deg=None, t_s=0.0, yaw_rate=None):
    course = math.radians(heading_deg if course_deg is None else course_deg)
    return VehicleState(
        t_s=t_s,
        boot_s=t_s,
        position=HERE,
        velocity_en_mps=(speed * math.sin(course), speed * math.cos(course)),
        heading_rad=math.radians(heading_deg),
        yaw_rate_radps=yaw_rate,
    )


@pytest.mark.parametrize(
    ("heading", "speed", "awa", "aws", "twd", "tws"),
    [
        (0, 0, 0, 5, 0, 5),  # moored, wind ahead: from the north
        (90, 0, -90, 5, 0, 5),  # moored heading east, wind on the port beam
        (90, 0, 90, 5, 180, 5),  # on the starboard beam
        (0, 3, 0, 8, 0, 5),  # motoring into 5 m/s feels 8
        (180, 3, 180, 2, 0, 5),  # running before it feels 2 from astern
        (0, 3, 45, 3 * 2**0.5, 90, 3),  # beam wind bends forward
        (90, 3.0, -53.13, 5.0, 0, 4.0),  # ArduRover's convention: port is negative
    ],
)
def test_worked_examples(heading, speed, awa, aws, twd, tws):
    found = true_wind(ApparentWind(t_s=0.0, awa_rad=math.radians(awa), aws_mps=aws), boat(heading, speed))
    assert abs(wrap_pi(found.twd_from_rad - math.radians(twd))) < 1e-3
    assert found.tws_mps == pytest.approx(tws, abs=1e-3)
    assert found.source is WindSource.APPARENT


@settings(max_examples=200)
@given(twd=ANGLE, tws=st.floats(0.5, 40.0), heading=ANGLE, course=ANGLE, speed=st.floats(0.0, 10.0))
def test_apparent_and_true_are_inverses(twd, tws, heading, course, speed):
    vehicle = VehicleState(
        t_s=0.0,
        boot_s=0.0,
        position=HERE,
        velocity_en_mps=(speed * math.sin(course), speed * math.cos(course)),
        heading_rad=heading,
    )
    back = true_wind(apparent_wind(WindSample(t_s=0.0, twd_from_rad=twd, tws_mps=tws), vehicle), vehicle)
    assert abs(wrap_pi(back.twd_from_rad - twd)) < 1e-6
    assert back.tws_mps == pytest.approx(tws, rel=1e-6)


@settings(max_examples=100)
@given(awa=ANGLE, aws=st.floats(1.0, 20.0), heading=ANGLE, speed=st.floats(0.0, 5.0), turn=ANGLE)
def test_turning_the_world_turns_the_wind(awa, aws, heading, speed, turn):
    def made(h):
        vehicle = VehicleState(
            t_s=0.0,
            boot_s=0.0,
            position=HERE,
            velocity_en_mps=(speed * math.sin(h), speed * math.cos(h)),
            heading_rad=h,
        )
        return true_wind(ApparentWind(t_s=0.0, awa_rad=wrap_pi(awa), aws_mps=aws), vehicle)

    a, b = made(heading), made(heading + turn)
    assert b.tws_mps == pytest.approx(a.tws_mps, abs=1e-9)
    if a.tws_mps > 0.01:
        assert abs(wrap_pi(b.twd_from_rad - a.twd_from_rad - turn)) < 1e-6


def test_quality():
    felt = ApparentWind(t_s=0.0, awa_rad=0.5, aws_mps=6.0)
    assert true_wind(felt, boat(0, 2)).quality is WindQuality.GOOD
    assert true_wind(felt, boat(0, 2, yaw_rate=0.5)).quality is WindQuality.TURNING
    assert true_wind(felt, boat(0, 2, t_s=3.0)).quality is WindQuality.SUSPECT
    light = ApparentWind(t_s=0.0, awa_rad=0.0, aws_mps=0.5)
    assert true_wind(light, boat(0, 0)).quality is WindQuality.LIGHT


@pytest.mark.parametrize("older", ["vane", "boat"])
def test_readings_a_second_apart_are_one_instant_and_later_ones_are_not(older):
    for apart_s, quality in ((0.9, WindQuality.GOOD), (1.1, WindQuality.SUSPECT)):
        vane_s, boat_s = (100.0, 100.0 + apart_s) if older == "vane" else (100.0 + apart_s, 100.0)
        felt = ApparentWind(t_s=vane_s, awa_rad=0.5, aws_mps=6.0)
        assert true_wind(felt, boat(0, 2, t_s=boat_s)).quality is quality


@pytest.mark.parametrize("side", [1, -1])
def test_a_wave_yaws_the_boat_by_less_than_ten_degrees_a_second_and_a_tack_by_more(side):
    felt = ApparentWind(t_s=0.0, awa_rad=0.5, aws_mps=6.0)
    assert true_wind(felt, boat(0, 2, yaw_rate=side * math.radians(9.0))).quality is WindQuality.GOOD
    assert true_wind(felt, boat(0, 2, yaw_rate=side * math.radians(11.0))).quality is WindQuality.TURNING


def test_below_one_metre_a_second_a_wind_is_light():
    for tws_mps, quality in ((0.95, WindQuality.LIGHT), (1.05, WindQuality.GOOD)):
        assert true_wind(ApparentWind(t_s=0.0, awa_rad=0.5, aws_mps=tws_mps), boat(0, 0)).quality is quality


def test_in_no_wind_at_all_the_direction_is_where_the_vane_points():
    calm = true_wind(ApparentWind(t_s=0.0, awa_rad=math.radians(-30.0), aws_mps=0.0), boat(120, 0))
    assert (math.degrees(calm.twd_from_rad), calm.tws_mps) == (pytest.approx(90.0), 0.0)


def test_no_wind_is_above_a_hundred_metres_a_second_however_it_is_reckoned():
    """An anemometer gone wild, and the boat's own way on top: more would not be taken for a reading."""
    assert true_wind(ApparentWind(t_s=0.0, awa_rad=0.0, aws_mps=99.0), boat(0, 3, course_deg=180)).tws_mps == 100.0
    assert apparent_wind(WindSample(t_s=0.0, twd_from_rad=0.0, tws_mps=99.0), boat(0, 3)).aws_mps == 100.0


def test_parameters_are_read():
    found = VaneParameters.from_mapping(
        {"WNDVN_TYPE": 4.0, "WNDVN_SPEED_TYPE": 0.0, "WNDVN_SPEED_MIN": 0.5, "WNDVN_TRUE_FILT": -1.0, "OTHER": 1.0}
    )
    assert found.vane_type == 4
    assert found.has_no_speed_sensor
    assert found.true_tau_s == 0.0
    assert not found.is_direction_invented
    assert VaneParameters().true_tau_s == pytest.approx(3.18, abs=0.01)
    assert VaneParameters.from_mapping({"WNDVN_TYPE": 1.0}).is_direction_invented
    assert VaneParameters.from_mapping({"WNDVN_TRUE_FILT": math.nan}).true_filter_hz == 0.05
