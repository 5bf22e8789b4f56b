"""The spread of the wind's angle to her bow, against boats whose current, leeway, compass and vane are drawn."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.boat import ardurover_sitl
from companion.current import CurrentEstimator, WindAngleUncertainty
from companion.current.estimator import UNTOLD_MPS
from companion.geo.angles import difference_rad
from companion.messages import WindForecast
from tests.current.test_estimator import POLAR, reading, sailed, turned_vane

BEAT_RAD = math.radians(50.0)


def forecast(from_rad, tws, sigma_rad=0.1):
    return WindForecast(
        t_s=0.0,
        horizon_s=np.array([0.0, 60.0]),
        mean_twd_from_rad=np.full(2, from_rad),
        sigma_twd_rad=np.full(2, sigma_rad),
        mean_tws_mps=np.full(2, tws),
        sigma_tws_mps=np.full(2, 0.3),
        level=np.array([0.8]),
        half_width_rad=np.full((2, 1), 1.28 * sigma_rad),
        correlation_time_s=30.0,
    )


def doubt(sigmas, believed=(0.0,) * 6, *, is_planned=False):
    return WindAngleUncertainty(
        believed=believed, covariance=tuple(map(tuple, np.diag(np.square(sigmas)).tolist())), is_planned=is_planned
    )


def angle_rad(from_rad, tws, speed, side, x):
    """Return the true wind's angle to the bow that keeps to a leg laid at ``BEAT_RAD`` to the measured wind."""
    course = from_rad - side * BEAT_RAD
    unit = np.array([math.sin(course), math.cos(course)])
    felt = tws * np.array([math.sin(from_rad), math.cos(from_rad)]) + speed * unit
    turned = -(x[5] - x[4])  # clockwise
    felt = np.array(
        [
            math.cos(turned) * felt[0] + math.sin(turned) * felt[1],
            math.cos(turned) * felt[1] - math.sin(turned) * felt[0],
        ]
    )
    over_water = felt - speed * unit + x[:2]
    abeam = x[0] * math.cos(course) - x[1] * math.sin(course)
    bow = course - math.asin(abeam / speed) + side * x[3]
    return difference_rad(math.atan2(*over_water), bow)


@settings(max_examples=20)
@given(st.floats(-3.0, 3.0), st.floats(4.0, 9.0), st.floats(1.5, 3.0), st.integers(0, 9))
def test_the_spread_is_that_of_drawn_boats(from_rad, tws, speed, seed):
    sigmas = np.array([0.07, 0.04, 0.1, 0.04, 0.03, 0.05])
    made = doubt(sigmas).widened(forecast(from_rad, tws, 1e-6), beat_rad=BEAT_RAD, speed_mps=speed)
    drawn = np.random.default_rng(seed).normal(size=(4000, 6)) * sigmas
    spreads = []
    for side in (1.0, -1.0):
        off = [difference_rad(angle_rad(from_rad, tws, speed, side, x), side * BEAT_RAD) for x in drawn]
        spreads.append(math.sqrt(np.mean(np.square(off))))
    assert float(made.sigma_twd_rad[0]) == pytest.approx(max(spreads), rel=0.08)


@settings(max_examples=20)
@given(st.floats(-3.0, 3.0), st.floats(4.0, 9.0), st.floats(1.5, 3.0), st.floats(-0.05, 0.05), st.floats(-0.08, 0.08))
def test_what_brings_the_bow_nearer_on_both_tacks_is_told_apart(from_rad, tws, speed, down_mps, leeway_rad):
    down = -down_mps * math.sin(from_rad), -down_mps * math.cos(from_rad)  # from where the wind is from
    believed = (*down, 0.0, leeway_rad, 0.02, -0.03)
    told = doubt((1e-9,) * 6, believed)
    nearer = [BEAT_RAD - side * angle_rad(from_rad, tws, speed, side, believed) for side in (1.0, -1.0)]
    air = forecast(from_rad, tws, 1e-6)
    found = told.nearer_rad(air, beat_rad=BEAT_RAD, speed_mps=speed)
    assert found == pytest.approx(max(0.0, sum(nearer) / 2.0), abs=0.01)
    rest = float(told.widened(air, beat_rad=BEAT_RAD, speed_mps=speed).sigma_twd_rad[0])
    assert rest == pytest.approx(abs(nearer[0] - nearer[1]) / 2.0, abs=0.01), "not spread as well"


def test_half_widths_grow_with_it_and_the_mean_stays():
    plain = forecast(0.3, 5.0)
    made = doubt((0.05, 0.05, 0.1, 0.04, 0.04, 0.07)).widened(plain, beat_rad=BEAT_RAD, speed_mps=2.0)
    assert made.mean_twd_from_rad.tolist() == plain.mean_twd_from_rad.tolist()
    assert np.all(made.sigma_twd_rad > plain.sigma_twd_rad)
    assert made.half_width_rad[0, 0] == pytest.approx(1.28 * made.sigma_twd_rad[0])


def test_what_is_believed_and_not_planned_for_is_spread_too():
    exact = (1e-9,) * 6

    def widened(believed, **also):
        leeway_rad = also.pop("leeway_rad", 0.0)
        return float(
            doubt(exact, believed, **also)
            .widened(forecast(0.0, 5.0, 1e-6), beat_rad=BEAT_RAD, speed_mps=2.0, leeway_rad=leeway_rad)
            .sigma_twd_rad[0]
        )

    assert widened((0.0, 0.0, 0.0, 0.0, 0.0, 0.1)) > 0.1  # longer by her own speed
    assert widened((0.0, 0.0, 0.0, 0.0, 0.1, 0.1)) == pytest.approx(0.0, abs=1e-5), "vane and compass cancel"
    assert widened((0.0, 0.0, 0.3, 0.0, 0.0, 0.0)) == pytest.approx(0.0, abs=1e-5), "her speed turns nothing"
    assert widened((0.0, 0.0, 0.0, 0.08, 0.0, 0.0), leeway_rad=0.08) == pytest.approx(0.0, abs=1e-5)
    some, more = widened((0.1, 0.0, 0.0, 0.0, 0.0, 0.0)), widened((0.6, 0.0, 0.0, 0.0, 0.0, 0.0))
    assert more / some == pytest.approx(UNTOLD_MPS / 0.1, rel=1e-3), "a stronger one would be planned for"
    assert widened((0.6, 0.0, 0.0, 0.0, 0.0, 0.0), is_planned=True) == pytest.approx(0.0, abs=1e-5)


def test_tacks_narrow_it_and_a_turned_vane_widens_it():
    def sigma_deg(estimator):
        told = estimator.doubt()
        return math.degrees(told.widened(forecast(0.0, 5.0, 1e-6), beat_rad=BEAT_RAD, speed_mps=2.2).sigma_twd_rad[0])

    new = CurrentEstimator(ardurover_sitl().speed_mps)
    assert new.doubt() is None
    new.update(0.0, None, None)
    good = sailed((50.0, -50.0, 50.0, -50.0), (0.0, 0.0), noise=0.05)
    crooked = sailed((50.0, -50.0, 50.0, -50.0), (0.0, 0.0), noise=0.05, vane_deg=8.0)
    assert sigma_deg(new) > 8.0
    assert sigma_deg(good) < 0.6 * sigma_deg(new)
    assert sigma_deg(crooked) > 1.5 * sigma_deg(good)


@pytest.mark.parametrize("vane_deg", [-9.0, -5.0, 5.0, 9.0])
def test_a_turned_vane_is_no_current(vane_deg):
    for headings in ((52.0, -52.0), (52.0, -52.0, 100.0, -100.0)):
        found = sailed(headings, (0.0, 0.0), noise=0.05, vane_deg=vane_deg)
        assert not found.view().is_significant
        assert found.view().drift_mps < 2.0 * found.view().sigma_mps
    believed = math.degrees(found.doubt().believed[5])
    assert believed == pytest.approx(vane_deg, abs=2.0)


def test_a_vane_is_turned_about_the_wind_that_is_felt():
    straight = reading(0.0, 50.0, (0.0, 0.0))
    wrong = turned_vane(straight, math.radians(8.0))
    v = POLAR.speed_mps(-math.radians(50.0), 5.0)
    longer = 1.0 + v * math.cos(math.radians(50.0)) / 5.0
    assert math.degrees(wrong.twd_from_rad) == pytest.approx(8.0 * longer, abs=1.0)
