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
