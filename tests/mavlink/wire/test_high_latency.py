"""HIGH_LATENCY2 of the companion, as another decoder reads it."""

import math

import pytest
from pymavlink.dialects.v20 import ardupilotmega as wire

from companion.mavlink.wire.companion_status import high_latency2
from companion.mavlink.wire.frames import Codec
from companion.messages import AutopilotStatus, CompanionStatus, GeoPoint, Mode, VehicleState
from companion.safety import TABLE, number_of, watchdog_of

VEHICLE = VehicleState(
    t_s=9.0,
    boot_s=123.456,
    position=GeoPoint(lat_deg=50.8, lon_deg=-1.3),
    velocity_en_mps=(1.2, 1.6),
    heading_rad=math.radians(359.5),
)
AUTOPILOT = AutopilotStatus(
    t_s=9.0,
    vehicle_type=11,
    mode=Mode.AUTO,
    is_armed=True,
    ekf_ok=True,
    gps_fix=3,
    battery_remaining=0.55,
    battery_failed=True,
)
STATUS = CompanionStatus(
    t_s=9.0,
    state="standard",
    waypoint_seq=3,
    waypoint_distance_m=640.0,
    tws_mps=5.0,
    twd_from_rad=math.radians(350.0),
    promised_risk=0.08,
)


def decoded(message):
    frame = Codec(1, 191).pack(message)
    assert len(frame) <= 54
    reader = wire.MAVLink(None)
    (read,) = reader.parse_buffer(frame)
    return read


def test_it_tells_the_boat_and_the_plan():
    m = decoded(high_latency2(STATUS, VEHICLE, AUTOPILOT, "becalmed"))
    assert (m.get_srcSystem(), m.get_srcComponent()) == (1, 191)
    assert (m.type, m.autopilot, m.custom_mode, m.custom0 & 0xFF) == (11, 3, 10, 129)
    assert (m.latitude, m.longitude, m.timestamp) == (508000000, -13000000, 123456)
    assert (m.heading, m.groundspeed, m.windspeed, m.wind_heading) == (0, 10, 25, 175)
    assert (m.target_distance, m.wp_num, m.battery) == (64, 3, 55)
    assert (m.custom1, m.custom2) == (92, number_of("becalmed"))
    assert m.failure_flags == wire.HL_FAILURE_FLAG_BATTERY


@pytest.mark.parametrize(
    ("vehicle", "autopilot"), [(None, AUTOPILOT), (VEHICLE, None), (VEHICLE, AutopilotStatus(t_s=1.0))]
)
def test_nothing_is_told_before_the_boat_is_known(vehicle, autopilot):
    assert high_latency2(STATUS, vehicle, autopilot) is None


def test_what_is_not_known_is_minus_one_and_what_does_not_fit_is_cut():
    m = decoded(
        high_latency2(
            CompanionStatus(t_s=0.0, state="idle", waypoint_distance_m=1e7, tws_mps=90.0),
            VEHICLE,
            AutopilotStatus(t_s=1.0, mode=Mode.HOLD, gps_fix=1, receiver_lost=True, fence_breached=True),
        )
    )
    assert (m.battery, m.custom1, m.custom2, m.target_distance, m.windspeed) == (-1, -1, 0, 65535, 255)
    assert m.failure_flags == (
        wire.HL_FAILURE_FLAG_GPS
        | wire.HL_FAILURE_FLAG_ESTIMATOR
        | wire.HL_FAILURE_FLAG_RC_RECEIVER
        | wire.HL_FAILURE_FLAG_GEOFENCE
    )


def test_watchdogs_have_numbers_for_good():
    names = ["", *(dog.name for dog in TABLE)]
    assert [watchdog_of(number_of(name)) for name in names] == names
    assert watchdog_of(200) == "watchdog 200"
