"""Leeway in the boat's model: where it is stated, how it grows, and what it makes of a plan's courses."""

import math
import re
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from companion.boat import Boat, Sizes, ardurover_sitl, constant, guessed, guessed_text
from companion.boat.boat import carried, coefficient_of, leeway_at, leeway_rad
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


PEPPER = guessed(Sizes(length_m=1.5, displacement_kg=20.0, sail_area_m2=0.9))
GUESS = Boat(
    polar=PEPPER.polar, no_go_half_rad=math.radians(PEPPER.no_go_half_deg), leeway_rad=math.radians(PEPPER.leeway_deg)
)


def leeway_deg(boat, tws_mps):
    return math.degrees(boat.made_good_rad(boat.no_go_half_rad, tws_mps) - boat.no_go_half_rad)


@pytest.mark.parametrize("sizes", [(1.5, 20.0, 0.9), (1.0, 4.0, 0.4), (4.0, 450.0, 9.0), (12.0, 6000.0, 80.0)])
def test_a_guessed_boat_makes_the_leeway_of_small_robots_in_a_fresh_wind_and_no_more_in_a_gale(sizes):
    length, weight, sail = sizes
    guess = guessed(Sizes(length_m=length, displacement_kg=weight, sail_area_m2=sail))
    boat = Boat(
        polar=guess.polar, no_go_half_rad=math.radians(guess.no_go_half_deg), leeway_rad=math.radians(guess.leeway_deg)
    )
    fresh = guess.polar.full_tws_mps
    assert 5.0 < leeway_deg(boat, fresh) < 12.0
    assert leeway_deg(boat, 3.0 * fresh) == pytest.approx(leeway_deg(boat, fresh), abs=0.5)
    assert leeway_deg(boat, 0.5 * fresh) < leeway_deg(boat, fresh)


def test_the_words_of_the_guess_are_what_is_used():
    sizes = Sizes(length_m=1.5, displacement_kg=20.0, sail_area_m2=0.9)
    line = next(row for row in guessed_text("x", sizes, PEPPER, "today").splitlines() if row.startswith("leeway_deg"))
    told_deg, from_mps = (float(word) for word in re.findall(r"([\d.]+) in ([\d.]+) m/s or more", line)[0])
    for tws_mps in (from_mps, 6.0, 12.0):
        assert leeway_deg(GUESS, tws_mps) == pytest.approx(told_deg, abs=0.5)


def test_the_best_beat_is_outside_the_no_go_zone_and_leeway_is_taken_off():
    """The polar alone has it at 40 degrees, where this boat may not be."""
    assert GUESS.polar.best_beat(4.0).twa_rad < GUESS.no_go_half_rad
    best = GUESS.best_beat(4.0)
    assert best.twa_rad >= GUESS.no_go_half_rad - 1e-9
    course = GUESS.made_good_rad(best.twa_rad, 4.0)
    speed = best.speed_mps / math.cos(course - best.twa_rad)
    assert best.vmg_mps == pytest.approx(speed * math.cos(course), abs=1e-6)
    assert best.vmg_mps < GUESS.polar.best_beat(4.0, no_go_half_rad=GUESS.no_go_half_rad).vmg_mps


def test_a_polar_whose_speed_grows_to_its_last_wind_is_not_full_before_it():
    assert ardurover_sitl().full_tws_mps == ardurover_sitl().tws_mps[-1]
    assert constant(2.0).full_tws_mps == math.inf


@given(st.floats(0.1, 3.0), st.floats(0.5, 20.0), st.floats(0.2, 3.0), st.floats(1.0, 10.0))
def test_the_share_that_is_carried_makes_the_same_leeway_for_the_simulated_hull(twa, tws, speed, full):
    across, ahead = tws * math.sin(twa), tws * math.cos(twa) + speed
    by_share = leeway_rad(
        FIVE * carried(twa, tws, speed, full), math.hypot(across, ahead), math.atan2(across, ahead), speed
    )
    assert by_share == pytest.approx(leeway_at(FIVE, twa, tws, speed, full), abs=1e-9)
