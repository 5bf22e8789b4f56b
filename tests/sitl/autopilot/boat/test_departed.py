"""A boat that is not the plan's: her leeway, her polar, her tacks, the waves, her sensors; alone in a steady wind."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.boat import Sizes, constant
from companion.boat.boat import coefficient_of, leeway_at, leeway_rad
from companion.boat.guess import guessed_polar
from sitl.autopilot.boat import kernel as k
from sitl.autopilot.boat.kernel import side_mps, speed_share
from sitl.autopilot.boat.parameters import Parameters
from sitl.autopilot.boat.vehicle import Surroundings, Vehicle
from sitl.autopilot.config import Departures, Sensors, Waves
from sitl.world import CurrentModel, Waters
from sitl.world.environment import Constant

WIND = Constant(0.0, 5.0)
AS_PLANNED = Departures()


def boat(departures, heading_deg, *, waters=None, seed=0, polar=None):
    about = None if departures is None else Surroundings(WIND, departures, waters, seed)
    vehicle = Vehicle(
        WIND,
        Parameters({}),
        heading_rad=math.radians(heading_deg),
        is_moored=False,
        seed=seed,
        polar=polar,
        surroundings=about,
    )
    vehicle.settle()
    vehicle.set_armed(armed=True)
    vehicle.steer_heading(math.radians(heading_deg), 1.0)
    return vehicle


def sailed(departures, heading_deg, **how):
    vehicle = boat(departures, heading_deg, **how)
    vehicle.advance(3000)
    return vehicle.state


def advance(vehicle, loops):
    while loops > 0:
        done, _ = vehicle.advance(loops)
        loops -= done


def track_deg(state):
    return math.degrees(math.atan2(state[k.S_VE], state[k.S_VN]))


def test_a_boat_as_planned_sails_as_one_of_whom_nothing_is_said():
    for heading in (-170, -90, -50, 45, 120):
        plain, other = sailed(None, heading), sailed(AS_PLANNED, heading)
        for place in (k.S_E, k.S_N, k.S_YAW, k.S_V, k.S_TWD_SIN, k.S_AWS):
            assert other[place] == pytest.approx(plain[place], abs=1e-9)


def test_pieces_of_any_length_make_the_same_voyage():
    strange = Departures(
        leeway_rad=0.1,
        waves=Waves(loss=0.2, yaw_rad=0.1),
        sensors=Sensors(gps_noise_m=2.0, gps_lag_s=0.5, deviation_rad=0.1),
    )
    waters = Waters(wind=WIND, stream=CurrentModel(drift_mps=0.3, shear_per_km=2.0, shear_to_rad=1.0))
    whole, pieces = (boat(strange, 60, waters=waters) for _ in range(2))
    advance(whole, 700)
    for loops in (1, 2, 3, 4, 6, 50, 7, 27, 100, 500):
        advance(pieces, loops)
    np.testing.assert_array_equal(whole.state, pieces.state)


@pytest.mark.parametrize("heading", [50, -50, 90, -90])
def test_she_makes_leeway_away_from_the_wind(heading):
    slip = track_deg(sailed(Departures(leeway_rad=math.radians(6.0)), heading)) - heading
    # to leeward: away from north, from where the wind is
    assert math.copysign(1.0, slip) == math.copysign(1.0, heading)
    assert 2.0 < abs(slip) < 9.0
    assert track_deg(sailed(AS_PLANNED, heading)) == pytest.approx(heading, abs=0.1)


@pytest.mark.parametrize("heading", [55, -80])
def test_in_more_wind_than_her_polar_grows_with_she_makes_no_more_leeway(heading):
    """Five degrees of a guessed boat were 32 in 8 m/s, beside a plan that now says 7."""
    polar = guessed_polar(Sizes(length_m=1.5, displacement_kg=20.0, sail_area_m2=0.9))
    k_beat = coefficient_of(math.radians(5.0))
    state = sailed(Departures(leeway_rad=math.radians(5.0)), heading, polar=polar)
    slip = abs(track_deg(state) - heading)
    twa = math.radians(abs(heading))
    assert polar.full_tws_mps < 4.0 < 5.0  # the wind here
    expected = leeway_at(k_beat, twa, 5.0, state[k.S_V], polar.full_tws_mps)
    assert slip == pytest.approx(math.degrees(expected), abs=1.0)
    assert slip < math.degrees(leeway_at(k_beat, twa, 5.0, state[k.S_V])) - 3.0


@given(beat=st.floats(0.01, 0.3), aws=st.floats(0.5, 20.0), awa=st.floats(0.45, 3.1), v=st.floats(0.0, 5.0))
def test_her_leeway_is_that_of_the_boats_model(beat, aws, awa, v):
    ideal = math.radians(25.0)
    side = side_mps(coefficient_of(beat), aws, awa, v, awa - ideal, ideal)
    assert math.atan2(-side, v) == pytest.approx(leeway_rad(coefficient_of(beat), aws, awa, v), abs=1e-9)


@settings(max_examples=50)
@given(beat=st.floats(0.0, 0.3), aws=st.floats(0.0, 20.0), awa=st.floats(-3.14, 3.14), v=st.floats(-2.0, 5.0))
def test_the_drift_is_finite_and_to_leeward_without_way_too(beat, aws, awa, v):
    side = side_mps(coefficient_of(beat), aws, awa, v, 0.0, 0.44)
    assert math.isfinite(side)
    assert side * awa <= 0.0
    assert abs(side) <= aws


@given(st.floats(0.0, math.pi))
def test_a_share_of_speed_is_between_those_that_are_stated(angle):
    assert 0.8 <= speed_share(angle, 0.8, 1.1, 0.9) <= 1.1
    assert speed_share(angle, 1.0, 1.0, 1.0) == 1.0


@pytest.mark.parametrize(("heading", "share"), [(45, 0.8), (90, 1.2), (150, 0.9)])
def test_a_polar_errs_by_the_angle(heading, share):
    errs = replace(AS_PLANNED, beat=0.8, reach=1.2, run=0.9)
    assert sailed(errs, heading, polar=constant(2.0))[k.S_V] == pytest.approx(2.0 * share, abs=0.02)
    # the simulator's own hull gains and loses apparent wind with her speed
    own = sailed(errs, heading)[k.S_V] / sailed(AS_PLANNED, heading)[k.S_V]
    assert own == pytest.approx(share, abs=0.06)


def test_head_seas_take_speed_and_following_seas_do_not():
    seas = replace(AS_PLANNED, waves=Waves(from_rad=0.0, loss=0.3))
    for heading, share in ((30, 0.72), (90, 0.85), (170, 1.0)):
        speed = sailed(seas, heading, polar=constant(2.0))[k.S_V]
        assert speed == pytest.approx(2.0 * share, abs=0.03)


def test_waves_swing_her_bow():
    vehicle = boat(replace(AS_PLANNED, waves=Waves(yaw_rad=math.radians(8.0), period_s=3.0)), 90)
    seen = []
    for _ in range(600):
        advance(vehicle, 5)
        seen.append(math.degrees(vehicle.state[k.S_YAW]))
    swing = max(seen[300:]) - min(seen[300:])
    assert 4.0 < swing < 20.0
    assert np.mean(seen[300:]) == pytest.approx(90.0, abs=2.0)


def tacked(departures, seed):
    """Return the boat 60 s after she was told to go from one tack to the other."""
    vehicle = boat(departures, 50, seed=seed)
    advance(vehicle, 500)
    vehicle.steer_heading(math.radians(-50.0), 1.0)
    advance(vehicle, 200)
    caught = abs(vehicle.state[k.S_YAW])
    advance(vehicle, 2800)
    return vehicle, caught


def test_a_tack_that_fails_leaves_her_in_irons_and_then_on_the_old_tack():
    vehicle = boat(replace(AS_PLANNED, tack_fails=1.0, irons_s=8.0), 50)
    advance(vehicle, 500)
    vehicle.steer_heading(math.radians(-50.0), 1.0)
    advance(vehicle, 350)
    assert vehicle.state[k.S_TRIES] == vehicle.state[k.S_FAILED] == 1.0
    assert abs(math.degrees(vehicle.state[k.S_YAW])) < 20.0
    assert abs(vehicle.state[k.S_V]) < 1.0
    fell = []
    for _ in range(120):
        advance(vehicle, 5)
        fell.append(math.degrees(vehicle.state[k.S_YAW]))
    assert max(fell) > 40.0


def test_tacks_fail_as_often_as_is_said_and_by_seed():
    strange = replace(AS_PLANNED, tack_fails=0.4, irons_s=5.0)
    failed = [tacked(strange, seed)[0].state[k.S_FAILED] > 0 for seed in range(40)]
    assert 6 <= sum(failed) <= 26
    assert failed == [tacked(strange, seed)[0].state[k.S_FAILED] > 0 for seed in range(40)]


def test_every_tack_comes_off_where_none_fails_and_in_the_end_she_is_on_the_other():
    vehicle, _ = tacked(AS_PLANNED, 1)
    assert vehicle.state[k.S_FAILED] == 0.0
    assert vehicle.state[k.S_TRIES] == 1.0
    vehicle, caught = tacked(replace(AS_PLANNED, tack_fails=0.6, irons_s=5.0), 3)
    assert math.degrees(vehicle.state[k.S_YAW]) == pytest.approx(-50.0, abs=5.0)
    assert caught <= math.radians(60.0)


def test_sensors_err_and_the_boat_does_not():
    errs = Sensors(vane_rad=math.radians(10.0), compass_rad=math.radians(4.0), deviation_rad=math.radians(5.0))
    vehicle = boat(replace(AS_PLANNED, sensors=errs), 90)
    advance(vehicle, 1500)
    # she steers 90 by a compass that says 90 where it errs by 4 + 5 sin(heading)
    assert math.degrees(vehicle.heading) == pytest.approx(90.0, abs=0.5)
    assert math.degrees(vehicle.state[k.S_YAW]) == pytest.approx(81.0, abs=1.0)
    off = math.degrees(vehicle.apparent[0]) - math.degrees(
        math.atan2(vehicle.state[k.S_VE], 5.0 + vehicle.state[k.S_VN]) - vehicle.state[k.S_YAW]
    )
    assert off == pytest.approx(10.0, abs=0.5)


def test_a_position_is_old_and_wanders():
    lagging = boat(replace(AS_PLANNED, sensors=Sensors(gps_lag_s=1.0)), 90, polar=constant(2.0))
    advance(lagging, 1500)
    assert lagging.position[0] - lagging.true_position[0] == pytest.approx(-2.0, abs=0.1)
    noisy = boat(replace(AS_PLANNED, sensors=Sensors(gps_noise_m=3.0, gps_noise_s=5.0)), 90)
    errors = []
    for _ in range(1200):
        advance(noisy, 25)
        errors.append([a - b for a, b in zip(noisy.position, noisy.true_position, strict=True)])
    assert np.std(errors, axis=0) == pytest.approx([3.0, 3.0], rel=0.25)
    assert np.mean(errors, axis=0) == pytest.approx([0.0, 0.0], abs=1.2)


def test_a_stream_carries_her_and_is_added_to_what_an_event_makes():
    waters = Waters(wind=WIND, stream=CurrentModel(set_to_rad=math.pi, drift_mps=0.5))
    vehicle = boat(AS_PLANNED, 90, waters=waters, polar=constant(2.0))
    vehicle.load_parameters()
    advance(vehicle, 1500)
    assert vehicle.state[k.S_VN] == pytest.approx(-0.5, abs=0.01)
    assert vehicle.state[k.S_VE] == pytest.approx(2.0, abs=0.05)
