"""The motorboat: u1 and u2 move it as they should, the same guidance takes it round, on the model and on ArduRover."""

from __future__ import annotations

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.geo.angles import wrap_pi
from lab.tasks.controllers import motor_commands
from lab.tasks.motor import HABITS, MotorBoat, run, run_ardurover
from sitl.ardurover.simulation import find


def test_both_motors_at_one_half_go_straight_at_two_metres_a_second() -> None:
    boat = MotorBoat()
    for _ in range(600):
        boat = boat.step(*motor_commands(0.0))
    assert boat.speed_mps == pytest.approx(2.0, abs=0.02)
    assert boat.heading_rad == 0.0


@settings(max_examples=60)
@given(st.floats(-math.pi, math.pi), st.floats(-math.pi, math.pi), st.floats(0.0, 2.0))
def test_any_heading_is_reached_the_short_way_and_held(heading: float, wanted: float, speed: float) -> None:
    boat = MotorBoat(heading_rad=heading, speed_mps=speed)
    first = boat.steer(wanted)
    if 0.1 < abs(wrap_pi(wanted - heading)) < 3.0:
        assert abs(wrap_pi(wanted - first.heading_rad)) < abs(wrap_pi(wanted - heading))
    after = boat.steer(wanted, 30.0)
    assert abs(wrap_pi(wanted - after.heading_rad)) < 0.02 or abs(wrap_pi(wanted - heading)) > 3.0


@pytest.mark.parametrize("seed", range(4))
def test_marks_a_rock_and_an_intruder_without_a_no_go_zone(seed: int) -> None:
    score = run(seed)
    assert score.complete, score
    assert not HABITS.is_sailing


@pytest.mark.ardurover
@pytest.mark.skipif(find() is None, reason="no ardurover here")
def test_the_same_on_ardurovers_motorboat() -> None:
    score = run_ardurover(0)
    assert score.complete, score
