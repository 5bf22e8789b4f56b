"""Leeway in the boat's model: where it is stated, how it grows, and what it makes of a plan's courses."""

import math
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from companion.boat import Boat, ardurover_sitl, constant
from companion.boat.boat import coefficient_of, leeway_at, leeway_rad
from companion.compose import boat_of
from companion.geofence import load_mission

FIVE = coefficient_of(math.radians(5.0))


def test_it_is_what_is_stated_where_it_is_stated():
    assert math.degrees(leeway_rad(FIVE, 6.0, math.radians(30.0), 2.0)) == pytest.approx(5.0)
    assert leeway_rad(coefficient_of(0.0), 6.0, 1.0, 2.0) == 0.0


@given(st.floats(0.1, 20.0), st.floats(0.1, 3.0), st.floats(0.2, 5.0))
def test_it_grows_with_the_wind_and_shrinks_with_her_way(aws, awa, speed):
    here = leeway_rad(FIVE, aws, awa, speed)
    assert 0.0 < here <= leeway_rad(FIVE, 1.2 * aws, awa, speed)
    assert leeway_rad(FIVE, aws, awa, 1.2 * speed) < here
    assert leeway_rad(FIVE, aws, -awa, speed) == pytest.approx(here)


def test_at_small_angles_it_goes_with_heel_over_the_square_of_speed():
    """Garrett: K heel / V^2, the heel growing with the side force."""
    small = coefficient_of(math.radians(0.5))
    one, other = leeway_rad(small, 5.0, 0.6, 2.0), leeway_rad(small, 5.0, 0.6, 3.0)
    assert one / other == pytest.approx((3.0 / 2.0) ** 2, rel=0.02)


def test_a_plan_is_of_courses_and_without_leeway_nothing_changes():
    plain, slips = Boat(polar=ardurover_sitl()), Boat(polar=ardurover_sitl(), leeway_rad=math.radians(5.0))
    assert Boat(polar=ardurover_sitl(), leeway_rad=0.0).problem_boat(5.0) == plain.problem_boat(5.0)
    bow, course = plain.problem_boat(5.0), slips.problem_boat(5.0)
    wider = course["no_go_half_deg"] - bow["no_go_half_deg"]
    speed = plain.polar.speed_mps(math.radians(45.0), 5.0)
    assert wider == pytest.approx(math.degrees(leeway_at(FIVE, math.radians(45.0), 5.0, speed)))
    assert 2.0 < wider < 8.0
    twa, v = course["speed"]["twa_deg"], course["speed"]["v_mps"]
    assert all(b > a for a, b in pairwise(twa))
    assert twa[-1] == pytest.approx(180.0)
    # with her bow at 45 and at 60 degrees she sails along courses farther off, a little faster than the polar says
    for angle in (math.radians(45.0), math.radians(60.0)):
        there = math.degrees(slips.made_good_rad(angle, 5.0))
        assert float(np.interp(there, twa, v)) == pytest.approx(plain.polar.speed_mps(angle, 5.0), rel=0.02)


def test_a_polar_of_one_speed_makes_leeway_too():
    out = Boat(polar=constant(2.0), leeway_rad=0.1).problem_boat(5.0)
    assert out["speed"]["model"] == "polar"
    assert out["no_go_half_deg"] > 45.0


def test_a_mission_says_it(tmp_path: Path):
    path = tmp_path / "m.toml"
    path.write_text("[boat]\nleeway_deg = 4.0\n[[goal]]\nlat = 50.0\nlon = 1.0\n")
    assert boat_of(load_mission(path)).leeway_rad == pytest.approx(math.radians(4.0))


@pytest.mark.parametrize("leeway", [-0.1, 1.0, math.nan])
def test_a_leeway_that_cannot_be_is_refused(leeway):
    with pytest.raises(ValueError, match="leeway"):
        Boat(polar=constant(2.0), leeway_rad=leeway)
