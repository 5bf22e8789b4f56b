"""Compiled geometry: an angle on the circle, and the first time in a moving disc."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from companion.geo.kernels import first_met, wrap
from companion.messages import Target


@given(st.one_of(st.floats(-20.0, 20.0), st.sampled_from([math.pi, -math.pi, 3.0 * math.pi, -3.0 * math.pi, 0.0])))
def test_an_angle_is_turned_to_the_bit_as_a_remainder_turns_it(angle_rad):
    assert wrap(angle_rad) == (angle_rad + math.pi) % (2.0 * math.pi) - math.pi


@pytest.mark.parametrize(
    ("disc", "met_s"),
    [
        (Target(x_m=0.0, y_m=50.0, radius_m=10.0), 40.0),
        (Target(x_m=0.0, y_m=5.0, radius_m=10.0), 0.0),
        (Target(x_m=0.0, y_m=150.0, radius_m=10.0), math.inf),
        (Target(x_m=10.0, y_m=50.0, radius_m=10.0), math.inf),  # touched, not entered
        (Target(x_m=0.0, y_m=50.0, radius_m=10.0, from_s=45.0), 45.0),
        (Target(x_m=0.0, y_m=50.0, radius_m=10.0, until_s=39.0), math.inf),
        (Target(x_m=0.0, y_m=50.0, vy_mps=-1.0, radius_m=10.0), 20.0),
        (Target(x_m=0.0, y_m=-20.0, radius_m=10.0, growth_mps=1.5), 20.0),  # grows after the boat, and gains on it
        (Target(x_m=0.0, y_m=-20.0, radius_m=10.0, growth_mps=1.0), math.inf),  # as fast as the boat leaves it
        (Target(x_m=0.0, y_m=50.0, radius_m=10.0, growth_mps=1.0), 20.0),
        (Target(x_m=0.0, y_m=50.0, radius_m=-5.0), math.inf),
    ],
)
def test_the_first_time_in_a_moving_disc(disc, met_s):
    """A boat at 1 m/s for 100 s north; the second disc of two is named."""
    far = Target(x_m=900.0, y_m=0.0, radius_m=1.0)
    which, when = first_met(0.0, 0.0, 0.0, 100.0, 0.0, 100.0, np.array([far.row(), disc.row()]))
    assert (which, when) == (1 if met_s < math.inf else -1, pytest.approx(met_s))


def test_a_boat_that_never_arrives_lies_where_it_is():
    row = np.array([Target(x_m=0.0, y_m=50.0, vy_mps=-1.0, radius_m=10.0).row()])
    assert first_met(0.0, 0.0, 0.0, 100.0, 0.0, math.inf, row) == (0, pytest.approx(40.0))
    assert first_met(0.0, 0.0, 0.0, 100.0, math.inf, math.inf, row) == (-1, math.inf)
