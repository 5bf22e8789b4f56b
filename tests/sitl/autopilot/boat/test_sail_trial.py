"""What the simulated boat settles at, and what a tack costs her."""

import numpy as np
import pytest

from companion.boat.polar import ardurover_sitl
from sitl.autopilot import no_go_half_rad, settled_polar, tack_loss_s


def test_the_settled_speeds_are_those_that_were_measured_on_the_real_program():
    measured, settled = ardurover_sitl(), settled_polar({})
    for tws in (3.0, 6.0, 12.0):  # between these winds the measured one is straight, and too slow
        for twa in np.radians([45.0, 60.0, 90.0, 120.0, 150.0, 180.0]):
            assert settled.speed_mps(twa, tws) == pytest.approx(measured.speed_mps(twa, tws), rel=0.03)


def test_a_sail_that_is_not_hauled_in_drives_less_to_windward():
    eased = settled_polar({"SAIL_ANGLE_MIN": 30.0})
    assert eased.speed_mps(np.radians(45.0), 5.0) < 0.9 * settled_polar({}).speed_mps(np.radians(45.0), 5.0)


def test_she_sails_as_near_to_the_wind_as_her_parameter_says():
    assert no_go_half_rad({}) == pytest.approx(np.radians(45.0))
    assert no_go_half_rad({"SAIL_NO_GO_ANGLE": 50.0}) == pytest.approx(np.radians(50.0))


def test_a_tack_costs_a_third_of_a_second():
    """She keeps her way through it: what is planned for one, 3 s, is many times that."""
    assert 0.3 < tack_loss_s({}, None, 5.0) < 0.45


def test_a_hull_that_sails_by_a_polar_loses_some_too():
    assert 0.1 < tack_loss_s({}, ardurover_sitl(), 5.0) < 1.0
