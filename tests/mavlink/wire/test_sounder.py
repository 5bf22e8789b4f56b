"""The sounder: what several pings agree on is the depth, and what is no bottom is none."""

import math

import pytest
from pymavlink.dialects.v20 import ardupilotmega as wire

from companion.mavlink.wire.assembler import VehicleAssembler
from tests.mavlink.wire.test_codec import heard

DOWN = wire.MAV_SENSOR_ROTATION_PITCH_270


def ping(depth_m, orientation=DOWN, most_cm=5000):
    return wire.MAVLink_distance_sensor_message(1000, 30, most_cm, round(100 * depth_m), 1, 1, orientation, 255)


def told(pings, every_s=0.5):
    """Return the status after pings that come so far apart; a number is a depth, None a silence."""
    assembler = VehicleAssembler()
    beat(assembler, 0.0)
    for n, sounding in enumerate(pings):
        if sounding is not None:
            message = ping(sounding) if isinstance(sounding, int | float) else sounding
            assembler.take(every_s * n, heard(message))
    return assembler


def beat(assembler, t_s):
    assembler.take(t_s, heard(wire.MAVLink_heartbeat_message(11, 3, 65, 10, 4, 3)))
    return assembler.status


@pytest.mark.parametrize("spike_m", [0.4, 1.0, 45.0, 0.0, 50.0, 655.0])
@pytest.mark.parametrize("count", [1, 2])
def test_weed_air_and_fish_are_no_bottom(spike_m, count):
    status = told([6.0] * 10 + [spike_m] * count + [6.0]).status
    assert (status.sounds, status.depth_m) == (True, 6.0)


@pytest.mark.parametrize("spikes_m", [(1.7, 2.0, 1.5), (1.7, 2.0, 1.5, 1.6)])
def test_a_fish_of_three_or_four_pings_is_no_bottom_once_the_bottom_is_told_again(spikes_m):
    before = [6.0] * 10
    assert told([*before, *spikes_m]).status.depth_m <= 2.0
    status = told([*before, *spikes_m, *[6.0] * (len(spikes_m) - 2)]).status
    assert (status.depth_m, status.depth_rate_mps) == (6.0, 0.0)


def test_a_wall_is_one_from_its_third_ping_on_whatever_a_deeper_ping_says():
    before = [6.0] * 10
    assert told([*before, 1.5, 1.5, 1.5]).status.depth_m == 1.5
    assert told([*before, *[1.5] * 5, 6.0]).status.depth_m == 1.5
    assert told([*before, *[1.5] * 5, 6.0, 6.0]).status.depth_m == 1.5


def test_a_shoal_is_told_where_the_newest_ping_came_and_how_fast_it_comes():
    status = told([10.0 - 0.05 * n for n in range(60)]).status
    assert status.depth_m == pytest.approx(7.05)
    assert status.depth_rate_mps == pytest.approx(-0.1, abs=0.01)


def test_over_a_steep_slope_with_echoes_that_are_lost_each_ping_tells_the_depth():
    """A metre a second: pings so far apart agreed on nothing, and she was told no depth from 4 m until she struck."""
    assembler = VehicleAssembler()
    beat(assembler, 0.0)
    depths = [10.0] * 12 + [10.0 - 0.5 * n for n in range(1, 18)]
    for n, depth_m in enumerate(depths):
        if n < 12 or n % 2:
            assembler.take(0.5 * n, heard(ping(depth_m)))
            assert n < 4 or assembler.status.depth_m == pytest.approx(depth_m, abs=2.0)
    assert assembler.status.depth_m == pytest.approx(2.0, abs=0.3)
    assert assembler.status.depth_rate_mps == pytest.approx(-1.0, abs=0.1)


@pytest.mark.parametrize("count", [1, 2, 3])
def test_what_is_no_bottom_does_not_tilt_the_change(count):
    """Of an echo told at half the depth, three times in six seconds, the bottom is no less deep and no steeper."""
    pings = [8.0] * 20
    for n in range(count):
        pings[-2 - 3 * n] = 4.0
    status = told(pings).status
    assert (status.depth_m, status.depth_rate_mps) == (8.0, 0.0)


def test_pings_of_one_moment_tell_no_change():
    assembler = told([6.0])
    for _ in range(60):
        assembler.take(5.0, heard(ping(5.0)))
    assert (assembler.status.depth_m, assembler.status.depth_rate_mps) == (5.0, None)


def test_one_ping_is_no_depth_and_one_that_is_silent_is_forgotten():
    assembler = told([6.0])
    assert (assembler.status.sounds, assembler.status.depth_m) == (True, None)
    assembler = told([6.0] * 5)
    assert assembler.status.depth_m == 6.0
    assert (beat(assembler, 6.0).sounds, assembler.status.depth_m) == (True, 6.0)
    assert (beat(assembler, 8.0).sounds, assembler.status.depth_m) == (False, None)


def test_water_that_is_deeper_than_it_reaches_is_no_loss():
    status = told([6.0] * 5 + [50.0] * 20).status
    assert (status.sounds, status.depth_m, status.depth_rate_mps) == (True, None, None)


def test_one_that_looks_ahead_is_none():
    assert told([ping(3.0, orientation=wire.MAV_SENSOR_ROTATION_NONE)] * 5).status.sounds is None


def test_the_other_messages_of_the_same_ping_are_not_counted_twice():
    water = wire.MAVLink_water_depth_message(0, 0, 1, 0, 0, 0.0, 0.0, 0.0, 0.0, 9.0, 0.0)
    ranged = wire.MAVLink_rangefinder_message(4.0, 0.0)
    assert told([water] * 5).status.depth_m == 9.0
    assert told([ranged] * 5).status.depth_m == 4.0
    assert told([6.0, ranged, 6.0, ranged, 6.0, ranged]).status.depth_m == 6.0


def test_what_is_no_number_is_no_depth():
    assert told([wire.MAVLink_rangefinder_message(math.nan, 0.0)] * 5).status.depth_m is None


def ranged(depth_m):
    return wire.MAVLink_rangefinder_message(depth_m, 0.0)


def water(depth_m, *, healthy=1):
    return wire.MAVLink_water_depth_message(0, 0, healthy, 0, 0, 0.0, 0.0, 0.0, 0.0, depth_m, 0.0)


@pytest.mark.parametrize("repeats", [ranged(6.0), ranged(30.0), water(6.0), water(90.0, healthy=0)])
def test_of_a_sounder_that_has_died_no_other_message_tells_a_depth(repeats):
    """ArduRover stops DISTANCE_SENSOR of a rangefinder without data, and repeats its last distance in the others."""
    status = beat(told([6.0] * 5 + [repeats] * 40), 22.5)
    assert (status.sounds, status.depth_m, status.depth_rate_mps) == (False, None, None)


def test_a_sounder_that_calls_itself_unhealthy_tells_no_depth():
    assert told([water(6.0, healthy=0)] * 5).status.sounds is None
    assert beat(told([water(6.0)] * 5 + [water(6.0, healthy=0)] * 20), 12.5).sounds is False


@pytest.mark.parametrize("first", [0, 3])
def test_what_looks_ahead_is_no_depth_in_the_message_without_a_direction(first):
    ahead = ping(1.5, orientation=wire.MAV_SENSOR_ROTATION_NONE)
    status = told([ranged(1.5)] * first + [ahead, ranged(1.5)] * 20).status
    assert (status.sounds, status.depth_m) == (None, None)  # none is lost, either: there was none
    assert told([ranged(1.5)] * first + [ahead, water(9.0)] * 20).status.depth_m == 9.0


def test_one_distance_alone_does_not_silence_the_message_that_tells_the_depth():
    for forged in (ping(0.4), ping(0.4, orientation=wire.MAV_SENSOR_ROTATION_NONE)):
        assert told([ranged(9.0)] * 5 + [forged] + [ranged(9.0)] * 20).status.depth_m == 9.0


def test_a_sounder_of_our_own_does_not_stand_in_for_the_autopilots_clock():
    """While the autopilot was silent each ping made its status new, and its clock stood still."""
    assembler = VehicleAssembler()
    beat(assembler, 100.0)
    assembler.take(100.0, heard(wire.MAVLink_system_time_message(1_780_000_100_000_000, 100_000)))
    beat(assembler, 100.0)
    for t_s in range(101, 161):
        assembler.sounded(float(t_s), 5.0, 50.0)
    status = assembler.status
    assert (status.t_s, status.depth_m) == (100.0, 5.0)
    assert status.unix_s(160.0) == 1_780_000_160.0
