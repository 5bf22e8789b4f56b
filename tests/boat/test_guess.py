"""A boat guessed from its sizes: near the rated yachts that it is scaled from; heavier, longer, with more sail."""

import math
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from companion.boat import Sizes, guessed, parse_polar, pol_text
from companion.geo import MPS_PER_KNOT

# LOA [m], displacement [kg], main and genoa [m2]; speeds [kn] at 60, 90 and 135 degrees in 6, 10 and 16 kn of wind
# of three rated yachts, as their certificates have them (see data/orc_shape.csv for the source).
CONTRAST_33 = (9.848, 4380.0, 56.77), {60: (5.14, 6.42, 6.91), 90: (5.15, 6.59, 7.23), 135: (4.38, 6.24, 7.39)}


def sizes(length_m=1.5, displacement_kg=20.0, sail_area_m2=0.9):
    return Sizes(length_m=length_m, displacement_kg=displacement_kg, sail_area_m2=sail_area_m2)


def test_a_rated_yacht_is_guessed_within_the_error_that_is_told():
    (length, displacement, sail), rated = CONTRAST_33
    polar = guessed(sizes(length, displacement, sail)).polar
    off = [
        math.log(polar.speed_mps(math.radians(twa), tws * MPS_PER_KNOT) / MPS_PER_KNOT / knots)
        for twa, row in rated.items()
        for tws, knots in zip((6.0, 10.0, 16.0), row, strict=True)
    ]
    assert math.sqrt(sum(x * x for x in off) / len(off)) < 2.0 * 0.063


def test_by_froude_a_boat_four_times_as_long_is_twice_as_fast_in_twice_the_wind():
    small, large = guessed(sizes()), guessed(sizes(6.0, 64.0 * 20.0, 16.0 * 0.9))
    for twa in (45.0, 90.0, 150.0):
        assert large.polar.speed_mps(math.radians(twa), 6.0) == pytest.approx(
            2.0 * small.polar.speed_mps(math.radians(twa), 3.0)
        )
    assert large.tack_loss_s == pytest.approx(2.0 * small.tack_loss_s, abs=0.1)
    assert large.turn_rate_deg_s == pytest.approx(0.5 * small.turn_rate_deg_s, abs=0.1)


@given(st.floats(0.5, 20.0), st.floats(0.4, 2.5), st.floats(0.4, 2.5))
def test_more_wind_and_sail_make_no_boat_slower_and_weight_none_faster(length, weight, sail):
    kg, m2 = 0.0042 * 1025.0 * length**3 * weight, 0.6 * length**2 * sail
    boat = guessed(sizes(length, kg, m2))
    heavier, bigger = guessed(sizes(length, 1.2 * kg, m2)), guessed(sizes(length, kg, 1.2 * m2))
    winds = [0.2 * k * math.sqrt(length) for k in range(1, 30)]
    for twa in (45.0, 90.0, 180.0):
        rad = math.radians(twa)
        speeds = [boat.polar.speed_mps(rad, w) for w in winds]
        assert speeds[0] > 0.0
        assert all(b >= a - 1e-12 for a, b in pairwise(speeds))
        assert all(
            heavier.polar.speed_mps(rad, w) < v < bigger.polar.speed_mps(rad, w)
            for w, v in zip(winds, speeds, strict=True)
        )
    assert 45.0 <= boat.no_go_half_deg <= 55.0


@pytest.mark.parametrize(
    "wrong",
    [
        {"length_m": 0.1},
        {"length_m": 90.0},
        {"displacement_kg": 2000.0},
        {"displacement_kg": 0.2},
        {"sail_area_m2": 90.0},
        {"length_m": math.nan},
        {"displacement_kg": math.nan},
    ],
)
def test_sizes_of_no_boat_are_refused(wrong):
    with pytest.raises(ValueError, match=r"of|from"):
        sizes(**wrong)


def test_a_polar_that_is_written_is_read_again():
    polar = guessed(sizes()).polar
    again = parse_polar(pol_text(polar, 0.5))
    assert again.warnings == ()
    for twa in (40.0, 77.0, 180.0):
        for tws in (1.0, 3.0, 9.0):
            assert again.polar.speed_mps(math.radians(twa), tws) == pytest.approx(
                0.5 * polar.speed_mps(math.radians(twa), tws), abs=0.02
            )
