"""Jaulin and Le Bars' line controller, closed on the boat model; Schmitt's motors."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lab.tasks.controllers import line_following, motor_commands, rudder_for, sail_for
from sitl.world.boats import STEP_S, VaimosParameters, state_at, step

angle = st.floats(-math.pi, math.pi)
PARAMETERS = VaimosParameters().array()


@settings(max_examples=200)
@given(
    st.floats(-300, 300),
    st.floats(-300, 300),
    angle,
    angle,
    st.floats(-300, 300),
    st.floats(-300, 300),
    st.sampled_from([-1, 1]),
)
def test_heading_is_sailable_and_commands_are_in_range(
    x: float, y: float, h: float, twd: float, bx: float, by: float, q: int
) -> None:
    c = line_following((x, y), h, twd, (0.0, 0.0), (bx, by), q)
    assert math.cos(c.heading_rad - twd) <= math.cos(math.pi / 4.0) + 1e-9
    assert abs(c.rudder_rad) <= math.pi / 4.0
    assert 0.0 <= c.sail_max_rad <= math.pi / 2.0 + 1e-9
    assert c.q in {-1, 1}


def test_rudder_and_sheet() -> None:
    assert rudder_for(0.0, math.radians(90.0)) == pytest.approx(math.pi / 4.0)
    assert rudder_for(0.0, math.radians(-170.0)) == pytest.approx(-math.pi / 4.0)
    assert rudder_for(1.0, 1.0) == 0.0
    assert sail_for(0.0, 0.0) == 0.0
    assert sail_for(math.pi / 2.0, 0.0) == pytest.approx(math.pi / 4.0)
    assert sail_for(math.pi, 0.0) == pytest.approx(math.pi / 2.0)


@pytest.mark.parametrize("twd_deg", [0.0, 60.0, 90.0, 135.0, 180.0, 225.0, 300.0])
def test_the_boat_follows_the_line_on_every_point_of_sailing(twd_deg: float) -> None:
    """600 s along a line to the north from 40 m beside it: she stays in the band and makes ground."""
    twd, q = math.radians(twd_deg), 1
    # Under way on a close reach, on the tack that is nearer to the line's course: the law itself knows no irons.
    s = state_at(40.0, 0.0, twd + math.copysign(math.radians(60.0), math.remainder(-twd, 2.0 * math.pi)), 1.0)
    band = []
    for k in range(int(600 / STEP_S)):
        c = line_following(
            (s[0], s[1]), s[2], twd, (0.0, 0.0), (0.0, 1000.0), q, r_m=25.0, close_hauled_rad=math.radians(50.0)
        )
        q = c.q
        s = step(s, PARAMETERS, c.rudder_rad, c.sail_max_rad, twd, 5.0, STEP_S)
        if k * STEP_S > 200.0:
            band.append(abs(float(s[0])))
    assert float(s[1]) > 250.0
    # The band is r / 2, plus the way that a tack or the wind's drift takes her over it.
    assert np.quantile(band, 0.95) < 30.0


@settings(max_examples=100)
@given(st.floats(-2.0, 2.0))
def test_motors(rudder: float) -> None:
    u1, u2 = motor_commands(rudder)
    assert 0.0 <= u1 <= 1.0
    assert 0.0 <= u2 <= 1.0
    assert u1 + u2 == pytest.approx(1.0)
    if abs(rudder) <= math.pi / 4.0:
        assert u1 == pytest.approx((1.0 + rudder * 4.0 / math.pi) / 2.0)
        assert u2 == pytest.approx((1.0 - rudder * 4.0 / math.pi) / 2.0)


def test_motors_at_the_ends() -> None:
    assert motor_commands(0.0) == (0.5, 0.5)
    assert motor_commands(math.pi / 4.0) == (1.0, 0.0)
