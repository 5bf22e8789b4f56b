"""The L1 law against what is published of it, and the simulated autopilot and the predicted track that sail by it."""

import math

import numpy as np
import pytest

from bench.tracking.record import sail_simulated
from bench.tracking.residuals import curve_mps, residuals
from bench.tracking.trials import corners
from companion.boat.l1 import lateral_mps2, length_m
from companion.boat.tracking import GuidanceModel, stated_error_m
from sitl.autopilot.boat import kernel as k
from sitl.autopilot.boat.parameters import Parameters
from sitl.autopilot.boat.vehicle import Vehicle
from sitl.world.environment import Constant

NORTH = (0.0, 0.0, 0.0, 1000.0)


def turned(boat, velocity, leg=NORTH, *, period=8.0, damping=0.75, gain=0.0, least=2.0, before=(0.0, 0.0), dt=0.02):
    yaw = math.atan2(*velocity)
    return lateral_mps2(boat, velocity, yaw, leg, (period, damping, gain, least), before, dt)


@pytest.mark.parametrize(("period", "damping", "speed"), [(8.0, 0.75, 3.0), (15.0, 0.75, 2.0), (10.0, 1.0, 4.5)])
@pytest.mark.parametrize("across", [-2.0, 0.0, 1.5])
@pytest.mark.parametrize("off_deg", [-60.0, 0.0, 25.0])
def test_it_is_the_published_law(period, damping, speed, across, off_deg):
    """a = 4 zeta² v² / L x sin(asin(x / L) + the angle to the leg), L = zeta T v / pi."""
    reach = damping * period * speed / math.pi
    assert length_m(speed, period, damping, 0.5) == pytest.approx(reach)
    velocity = (speed * math.sin(math.radians(off_deg)), speed * math.cos(math.radians(off_deg)))
    wanted = math.asin(max(-math.sqrt(0.5), min(math.sqrt(0.5), -across / reach))) - math.radians(off_deg)
    law = 4.0 * damping**2 * speed**2 / reach * math.sin(wanted)
    assert turned((across, 300.0), velocity, period=period, damping=damping, least=0.5)[0] == pytest.approx(law)


def test_near_the_line_it_swings_with_the_period_and_the_damping_that_are_set():
    period, damping, speed, dt = 12.0, 0.5, 3.0, 0.002
    place, course, across = [0.8, 0.0], 0.0, []
    for _ in range(round(1.5 * period / dt)):
        velocity = (speed * math.sin(course), speed * math.cos(course))
        lateral, _, _ = turned(tuple(place), velocity, period=period, damping=damping, least=0.1, dt=dt)
        course += lateral / speed * dt
        place = [place[0] + velocity[0] * dt, place[1] + velocity[1] * dt]
        across.append(place[0])
    t = dt * np.arange(1, len(across) + 1)
    omega = 2.0 * math.pi / period
    swing = omega * math.sqrt(1.0 - damping**2)
    wave = np.cos(swing * t) + damping * omega / swing * np.sin(swing * t)
    assert np.max(np.abs(np.array(across) - 0.8 * np.exp(-damping * omega * t) * wave)) < 0.02


def test_the_waypoints_radius_is_the_least_length_and_slow_she_turns_little():
    assert length_m(0.5, 8.0, 0.75, 5.0) == 5.0
    assert length_m(0.0, 8.0, 0.75, 0.0) == pytest.approx(0.75 * 8.0 / math.pi * 0.1)
    slow = turned((0.0, 10.0), (0.1, 0.0), least=5.0)[0]
    assert slow == pytest.approx(-4.0 * 0.75**2 * 0.01 / 5.0)


def test_far_behind_its_beginning_she_makes_for_that_and_past_its_end_for_the_end():
    leg = (0.0, 0.0, 0.0, 100.0)
    assert turned((-30.0, -40.0), (3.0 * 0.6, 3.0 * 0.8), leg)[1] == pytest.approx(0.0, abs=1e-9)
    assert turned((0.0, 120.0), (0.0, -3.0), leg)[1] == pytest.approx(0.0, abs=1e-9)
    assert abs(turned((0.0, 105.0), (0.0, -3.0), leg)[1]) == pytest.approx(math.pi)  # 3 s later at the earliest


def test_the_nudge_grows_near_the_line_only_and_has_an_end():
    near = turned((-0.2, 50.0), (0.0, 3.0), gain=0.02, dt=1.0)[2]
    assert near == pytest.approx(0.02 * math.asin(0.2 / length_m(3.0, 8.0, 0.75, 2.0)))
    assert turned((-3.0, 50.0), (0.0, 3.0), gain=0.02, before=(0.0, 0.05), dt=1.0)[2] == 0.05
    assert turned((-0.2, 50.0), (0.0, 3.0), gain=0.02, before=(0.0, 0.1), dt=1e3)[2] == 0.1


def test_sailing_away_she_keeps_to_the_side_that_she_turns_to():
    for side in (-1.0, 1.0):
        angle = turned((0.0, 500.0), (-0.01 * side, -3.0), before=(side * 3.1, 0.0))[1]
        assert math.copysign(1.0, angle) == side
    assert turned((0.0, 500.0), (0.01, -3.0), before=(0.0, 0.0))[1] < 0.0


# ------------------------------------------------------------------------------------------- who steers by it
@pytest.mark.parametrize(
    "trial", [t for t in corners() if t.name in {"corners-1-3", "corners-3-5"}], ids=lambda t: t.name
)
def test_the_predicted_track_knows_it(trial):
    """An autopilot that steers by L1 is not where that of position control is expected, and where this is."""
    sailed = sail_simulated(trial, {"NAVL1_PERIOD": 8.0})
    by_l1, by_position = residuals(trial, sailed, 8.0), residuals(trial, sailed)
    stated = stated_error_m(float(np.max(curve_mps(trial.tws_mps))), GuidanceModel(), has_short=False)
    assert np.quantile(by_l1.track_m, 0.99) < stated
    assert np.quantile(by_position.track_m, 0.99) > 1.5 * stated


def back_after_s(period):
    """Return how long the simulated boat takes from 3 m beside her leg to a tenth of that."""
    vehicle = Vehicle(
        Constant(0.0, 6.0), Parameters({"NAVL1_PERIOD": period}), heading_rad=math.pi / 2.0, is_moored=True, seed=1
    )
    vehicle.settle()
    vehicle.set_armed(armed=True)
    vehicle.steer_heading(math.pi / 2.0, 1.0)
    vehicle.advance(1000)
    east, north = vehicle.true_position
    vehicle.sail_leg((east, north - 3.0), (east + 300.0, north - 3.0), None, is_corner=False, goes_on=False)
    begun = vehicle.t_s
    while abs(float(vehicle.state[k.S_XTRACK])) > 0.3:
        vehicle.advance(5)
        assert vehicle.t_s < begun + 60.0
    return vehicle.t_s - begun


def test_the_simulated_boat_comes_back_to_her_leg_in_her_period():
    # of a swing that is damped by 0.75 a tenth is left after 0.45 of its period
    assert [back_after_s(period) / period for period in (8.0, 16.0, 24.0)] == pytest.approx([0.45] * 3, abs=0.1)


def test_only_a_boat_that_is_given_one_of_its_parameters_has_them():
    assert Parameters({}).entry("NAVL1_PERIOD") is None
    old = Parameters({"NAVL1_DAMPING": 0.9})
    assert [old.get(f"NAVL1_{name}") for name in ("PERIOD", "DAMPING", "XTRACK_I")] == [8.0, 0.9, 0.02]
