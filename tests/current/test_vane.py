"""How far a vane is turned, as the boat's own motion tells it: found on both sides, and never where she sails well."""

import math
import random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.boat import ardurover_sitl
from companion.current import VaneCheck
from companion.geo.angles import difference_rad, wrap_pi
from tests.current.test_estimator import reading
from tests.current.test_motion import boat

POLAR = ardurover_sitl()
STILL = (0.0, 0.0)


def seen(moments, check=None, expected=STILL):
    """Return the check after these moments."""
    check = check or VaneCheck(POLAR.speed_mps)
    for now in moments:
        check.update(now, expected)
    return check


def sails(for_s, headings, *, first_s=0.0, current=STILL, scale=1.0, leg_s=60):
    """A boat that goes as her polar says, by a vane that is right."""
    rng = random.Random(7)
    return [
        reading(first_s + t, headings[(t // leg_s) % len(headings)], current, scale=scale, noise=0.1, rng=rng)
        for t in range(1, int(for_s) + 1)
    ]


def driven_astern(for_s, vane_deg, *, first_s=0.0):
    """The autopilot holds her at 55 degrees to the wind that a vane tells: the true one is from the north."""
    told_deg = math.copysign(55.0, vane_deg) if abs(vane_deg) < 90.0 else math.copysign(80.0, vane_deg)
    heading_deg = min(max(vane_deg - told_deg, -20.0), 20.0)  # she lies with her bow about in the true wind
    return [boat(first_s + t, heading_deg, -0.7, vane_deg=vane_deg) for t in range(1, int(for_s) + 1)]


@pytest.mark.parametrize("vane_deg", [45.0, -45.0, 90.0, -90.0, 150.0, 180.0])
def test_a_vane_that_was_never_right_is_found_by_a_boat_that_is_driven_astern(vane_deg):
    error = seen(driven_astern(60.0, vane_deg)).view()
    assert error.is_sure
    assert abs(difference_rad(error.off_rad, math.radians(vane_deg))) < math.radians(45.0)
    assert abs(error.least_rad) <= math.radians(abs(vane_deg) + 10.0), "turned back by this it is better than before"


def test_one_that_slipped_is_told_as_far_as_the_direction_has_turned():
    well = sails(240.0, (50.0, -50.0))
    error = seen([*well, *driven_astern(180.0, 40.0, first_s=240.0)]).view()
    assert error.is_sure
    assert math.degrees(error.off_rad) == pytest.approx(40.0, abs=12.0)


def test_a_stream_that_sets_her_astern_is_no_turned_vane_where_the_direction_stayed():
    """A race of 4.5 m/s carried her off her loiter dead astern: the vane told the wind that it had told before."""
    well = sails(240.0, (50.0, -50.0))
    held = [reading(240.0 + t, -90.0, (4.0, 0.0)) for t in range(1, 121)]
    told = [math.degrees(wrap_pi(now.twd_from_rad)) for now in held]
    assert max(map(abs, told)) < 1.0
    assert not seen([*well, *held]).view().is_sure
    assert seen(held).view().is_sure, "of a vane that nobody has seen right it would be"


def test_a_set_across_her_heading_is_the_waters():
    moments = [reading(float(t), 60.0, (-1.5, -2.2)) for t in range(1, 200)]
    east, north = moments[-1].velocity_en_mps
    sin, cos = math.sin(math.radians(60.0)), math.cos(math.radians(60.0))
    assert east * sin + north * cos < 0.3, "she makes no way ahead"
    assert not seen(moments).view().is_sure


def test_the_current_that_the_mission_expects_is_taken_off():
    stream = (0.0, -2.4)
    moments = sails(120.0, (50.0,), current=stream)
    expected, unexpected = seen(moments, expected=stream).view(), seen(moments).view()
    assert abs(expected.off_rad) < math.radians(5.0)
    assert abs(unexpected.off_rad) > abs(expected.off_rad)


@settings(max_examples=25)
@given(
    st.lists(st.floats(-180.0, 180.0), min_size=1, max_size=4).filter(
        lambda them: all(abs(wrap_pi(math.radians(h))) > math.radians(48.0) for h in them)
    ),
    st.floats(0.8, 1.2),
)
def test_a_boat_that_sails_by_her_vane_is_never_told_that_it_is_turned(headings, scale):
    check = VaneCheck(POLAR.speed_mps)
    for now in sails(400.0, headings, scale=scale):
        check.update(now, STILL)
        assert not check.view().is_sure


def test_a_boat_that_is_not_driven_tells_nothing():
    moments = [reading(float(t), 0.0, (0.0, -1.0), is_driven=False) for t in range(1, 200)]
    error = seen(moments).view()
    assert not error.is_sure
    assert error.off_rad == pytest.approx(0.0, abs=1e-6)


def test_after_a_leap_of_the_direction_what_was_seen_before_it_says_nothing_of_the_vane():
    well, astern = sails(240.0, (50.0, -50.0)), driven_astern(30.0, 90.0, first_s=240.0)
    kept, anew = seen(well), seen(well)
    anew.forget()
    assert not seen(astern, kept).view().is_sure
    assert seen(astern, anew).view().is_sure
