"""The simulated boat sails by the mission's polar, not only the planner."""

import math

import numpy as np
import pytest

from companion.boat import Polar, constant
from companion.geo import MPS_PER_KNOT
from sitl.autopilot.boat import kernel as k
from sitl.autopilot.boat.parameters import Parameters
from sitl.autopilot.boat.vehicle import Vehicle
from sitl.scenario.scenario import own_polar
from sitl.world.environment import Constant

# A keelboat, slower than the simulator's own hull on every course; knots.
SLOW = Polar(
    twa_rad=np.radians([30.0, 45.0, 60.0, 90.0, 120.0, 150.0, 180.0]),
    tws_mps=MPS_PER_KNOT * np.array([6.0, 10.0, 16.0]),
    speed_mps_table=MPS_PER_KNOT
    * np.array(
        [
            [1.0, 1.4, 1.8],
            [2.4, 3.2, 3.6],
            [2.9, 3.8, 4.3],
            [3.2, 4.2, 4.9],
            [3.1, 4.3, 5.2],
            [2.6, 3.7, 4.8],
            [2.2, 3.2, 4.3],
        ]
    ),
)


def boat(polar, tws_mps, heading_deg, current_en=(0.0, 0.0)):
    vehicle = Vehicle(
        Constant(0.0, tws_mps),
        Parameters({}),
        heading_rad=math.radians(heading_deg),
        is_moored=False,
        seed=0,
        polar=polar,
    )
    vehicle.settle()
    vehicle.set_armed(armed=True)
    vehicle.state[k.S_CURRENT_E], vehicle.state[k.S_CURRENT_N] = current_en
    return vehicle


def steady_mps(vehicle, heading_deg):
    vehicle.steer_heading(math.radians(heading_deg), 1.0)
    vehicle.advance(3000)
    return float(vehicle.state[k.S_V])


@pytest.mark.parametrize("twa_deg", [35, 52, 75, 90, 110, 135, 165, 180])
@pytest.mark.parametrize("tws_mps", [2.0, 4.0, 7.3, 12.0])
def test_it_sails_at_the_polars_speed(twa_deg, tws_mps):
    wanted = SLOW.speed_mps(math.radians(twa_deg), tws_mps)
    assert steady_mps(boat(SLOW, tws_mps, -twa_deg), -twa_deg) == pytest.approx(wanted, abs=0.02)


def test_a_boat_faster_than_the_wind_reaches_what_her_polar_says():
    assert steady_mps(boat(constant(5.0), 3.0, 100.0), 100.0) == pytest.approx(5.0, abs=0.1)


def test_the_polar_is_of_the_wind_over_the_water():
    # carried away from the wind there is less of it
    with_stream = steady_mps(boat(SLOW, 5.0, 90.0, current_en=(0.0, -1.0)), 90.0)
    assert with_stream == pytest.approx(SLOW.speed_mps(math.radians(90.0), 4.0), abs=0.02)


def test_eased_she_stops_and_head_to_wind_she_drifts_astern():
    vehicle = boat(SLOW, 5.0, 80.0)
    assert steady_mps(vehicle, 80.0) > 1.5
    vehicle.hold()
    vehicle.advance(1500)
    assert abs(float(vehicle.state[k.S_V])) < 0.4
    assert steady_mps(boat(SLOW, 5.0, 0.0), 0.0) < 0.0


def test_without_wind_nobody_sails():
    assert steady_mps(boat(constant(2.0), 0.0, 90.0), 90.0) == pytest.approx(0.0, abs=0.01)


def test_a_mission_without_a_polar_of_its_own_has_the_simulators_hull(tmp_path):
    from companion.geofence import load_mission

    path = tmp_path / "m.toml"
    path.write_text("[[goal]]\nlat = 50.0\nlon = 1.0\n")
    assert own_polar(load_mission(path)) is None
    path.write_text("[boat]\npolar = 1.5\n[[goal]]\nlat = 50.0\nlon = 1.0\n")
    assert own_polar(load_mission(path)).speed_mps(1.0, 5.0) == 1.5
