"""Büsser's headings: drift (equation 3), buoys, and our own no-go protection."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.geo.angles import difference_rad
from companion.skipper.deeds.headings import buoy_heading_rad, drift_correction_rad, sailable_rad
from companion.skipper.way.geometry import bearing_rad
from companion.skipper.way.voyage import Side

ANGLE = st.floats(-math.pi, math.pi)
CHECK = settings(max_examples=100)


def test_pushed_to_port_means_steering_to_starboard():
    # Heading north at 2 m/s, pushed west (wind from starboard) at 0.2 m/s.
    assert drift_correction_rad((-0.2, 2.0), 0.0) == pytest.approx(math.atan(0.1))
    assert drift_correction_rad((0.2, 2.0), 0.0) == pytest.approx(-math.atan(0.1))
    assert drift_correction_rad((0.0, 2.0), 0.0) == 0.0
    assert drift_correction_rad((1.0, 0.1), 0.0) == 0.0


@CHECK
@given(ANGLE, st.floats(1.0, 4.0), st.floats(-0.3, 0.3))
def test_the_corrected_heading_makes_the_course_good(course, speed, leeway):
    # A boat whose track is its heading turned by its leeway: steering course + correction brings it onto the course.
    heading = course
    for _ in range(5):
        track = heading + leeway
        velocity = (speed * math.sin(track), speed * math.cos(track))
        heading = course + drift_correction_rad(velocity, heading)
    assert abs(difference_rad(heading + leeway, course)) < 1e-6


@CHECK
@given(ANGLE, ANGLE, ANGLE, st.floats(0.5, 1.2))
def test_nothing_is_steered_into_the_no_go_zone(wanted, heading, twd, no_go):
    out = sailable_rad(wanted, heading, twd, no_go)
    assert abs(difference_rad(out, twd)) >= no_go - 1e-9
    if abs(difference_rad(wanted, twd)) >= no_go:
        assert out == wanted


def test_dead_to_windward_it_stays_on_its_tack():
    assert sailable_rad(0.0, 0.8, 0.0, 0.785) == pytest.approx(0.785)
    assert sailable_rad(0.0, -0.8, 0.0, 0.785) == pytest.approx(-0.785)
    assert sailable_rad(0.0, -0.8, 0.02, 0.785) == pytest.approx(0.02 - 0.785)
    assert sailable_rad(0.5, -0.8, 0.0, 0.785) == pytest.approx(0.785)


BUOYS = pytest.mark.parametrize(("side", "hand"), [(Side.PORT, 1.0), (Side.STARBOARD, -1.0)])


@BUOYS
@CHECK
@given(ANGLE, ANGLE, ANGLE, st.floats(0.5, 1.2))
def test_at_a_buoy_no_manoeuvre_leads_to_its_side_of_the_wanted_heading(side, hand, wanted, heading, twd, no_go):
    """Büsser 3.2.4: "never to perform maneuvers that would result in a new direction to the left"."""
    out = sailable_rad(wanted, heading, twd, no_go, side)
    assert abs(difference_rad(out, twd)) >= no_go - 1e-9
    if abs(difference_rad(wanted, twd)) >= no_go:
        assert out == wanted
    elif hand * difference_rad(out, wanted) < -1e-9:
        # To the buoy's side only by going on as she goes, and not by more than ten degrees.
        assert difference_rad(heading, twd) * difference_rad(out, twd) >= 0.0
        assert abs(difference_rad(out, wanted)) <= math.radians(10.0) + 1e-9


@BUOYS
def test_at_a_buoy_she_goes_about_to_get_clear_and_not_to_get_nearer(side, hand):
    wanted = hand * 0.1
    assert sailable_rad(wanted, -hand * 0.8, 0.0, 0.785) == pytest.approx(hand * 0.785)   # nearer by 11 degrees
    assert sailable_rad(-wanted, -hand * 0.8, 0.0, 0.785) == pytest.approx(-hand * 0.785)
    assert sailable_rad(-wanted, -hand * 0.8, 0.0, 0.785, side) == pytest.approx(hand * 0.785)
    assert sailable_rad(-hand * 0.5, hand * 0.8, 0.0, 0.785) == pytest.approx(-hand * 0.785)
    assert sailable_rad(-hand * 0.5, hand * 0.8, 0.0, 0.785, side) == pytest.approx(hand * 0.785)
    assert sailable_rad(-hand * 0.7, -hand * 0.8, 0.0, 0.785, side) == pytest.approx(-hand * 0.785)


@pytest.mark.parametrize(("side", "sign"), [(Side.PORT, 1.0), (Side.STARBOARD, -1.0)])
def test_the_buoy_is_left_on_its_side(side, sign):
    boat, buoy = (0.0, 0.0), (30.0, 40.0)
    heading = buoy_heading_rad(boat, buoy, side, math.radians(30.0))
    assert difference_rad(heading, bearing_rad(boat, buoy)) == pytest.approx(sign * math.radians(30.0))
