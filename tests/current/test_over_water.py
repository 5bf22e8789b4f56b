"""The wind over the water: signs, inverse, and how its spread follows."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from companion.boat import Boat, ardurover_sitl, can_hold, made_good_mps
from companion.current import WaterCurrent, forecast_over_water, over_ground, over_water
from companion.messages import WindForecast

ANGLES = st.floats(-3.1, 3.1)


def test_still_air_over_a_current_is_a_wind_from_where_it_goes():
    from_rad, speed = over_water(0.0, 0.0, (0.0, 0.5))
    assert math.degrees(from_rad) == pytest.approx(0.0)
    assert speed == pytest.approx(0.5)


@given(ANGLES, st.floats(0.5, 15.0), st.floats(-1.0, 1.0), st.floats(-1.0, 1.0))
def test_there_and_back(from_rad, tws, east, north):
    back = over_ground(*over_water(from_rad, tws, (east, north)), (east, north))
    assert back[1] == pytest.approx(tws, abs=1e-9)
    assert math.cos(back[0] - from_rad) == pytest.approx(1.0, abs=1e-9)


def test_without_a_current_it_is_the_same_number():
    assert over_water(1.234, 5.678, (0.0, 0.0)) == (1.234, 5.678)


def forecast(from_rad, tws, sigma_rad, sigma_mps):
    n = 3
    return WindForecast(
        t_s=0.0,
        horizon_s=np.array([0.0, 60.0, 600.0]),
        mean_twd_from_rad=np.full(n, from_rad),
        sigma_twd_rad=np.full(n, sigma_rad),
        mean_tws_mps=np.full(n, tws),
        sigma_tws_mps=np.full(n, sigma_mps),
        level=np.array([0.8]),
        half_width_rad=np.full((n, 1), 1.28 * sigma_rad),
        correlation_time_s=30.0,
    )


@given(ANGLES, st.floats(3.0, 12.0), ANGLES, st.floats(0.0, 0.8), st.floats(0.0, 0.2))
def test_the_spread_over_water_is_that_of_drawn_winds(from_rad, tws, set_rad, drift, doubt):
    current = WaterCurrent(
        east_mps=drift * math.sin(set_rad),
        north_mps=drift * math.cos(set_rad),
        var_ee=doubt**2,
        var_nn=doubt**2,
        is_significant=True,
    )
    made = forecast_over_water(forecast(from_rad, tws, 0.1, 0.4), current)
    rng = np.random.default_rng(3)
    drawn, blown = from_rad + 0.1 * rng.standard_normal(4000), tws + 0.4 * rng.standard_normal(4000)
    east = blown * np.sin(drawn) + current.east_mps + doubt * rng.standard_normal(4000)
    north = blown * np.cos(drawn) + current.north_mps + doubt * rng.standard_normal(4000)
    off = (np.arctan2(east, north) - made.mean_twd_from_rad[0] + math.pi) % (2.0 * math.pi) - math.pi
    assert float(np.std(off)) == pytest.approx(float(made.sigma_twd_rad[0]), rel=0.12)
    assert float(np.std(np.hypot(east, north))) == pytest.approx(float(made.sigma_tws_mps[0]), rel=0.12)
    assert made.half_width_rad[0, 0] == pytest.approx(1.28 * made.sigma_twd_rad[0])


def test_what_is_made_good_by_beating_is_carried_along_and_ends_where_the_current_is_stronger():
    boat, half = Boat(polar=ardurover_sitl()), math.radians(45.0)
    still = made_good_mps(boat, 0.0, twd_from_rad=0.0, tws_mps=5.0, current_en_mps=(0.0, 0.0), no_go_half_rad=half)
    assert still == pytest.approx(boat.polar.best_beat(5.0, no_go_half_rad=half).vmg_mps, rel=0.01)
    for drift, holds in ((0.5, True), (1.2, True), (1.6, False)):
        current = (0.0, -drift)
        made = made_good_mps(boat, 0.0, twd_from_rad=0.0, tws_mps=5.0, current_en_mps=current, no_go_half_rad=half)
        assert (made is not None) == holds
        if made is not None:
            assert made == pytest.approx(still - drift, rel=0.02)
        assert can_hold(boat, twd_from_rad=0.0, tws_mps=5.0, current_en_mps=current, no_go_half_rad=half) == holds
