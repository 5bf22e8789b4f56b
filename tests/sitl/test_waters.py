"""Wind and stream by place: a lee behind its island, gradients, tides that turn; gusts about a mean."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sitl.world import Constant, CurrentModel, Gusty, Lee, Waters

NORTHERLY = Constant(0.0, 6.0)
ISLAND = Lee(en_m=(100.0, 50.0), radius_m=40.0, loss=0.6, reach_m=200.0)
places = st.tuples(st.floats(-2000, 2000), st.floats(-2000, 2000))


def test_a_lee_is_behind_its_island_and_fills_again():
    waters = Waters(wind=NORTHERLY, lees=(ISLAND,))
    assert waters.wind_at(0.0, (100.0, 200.0))[1] == 6.0  # to windward
    assert waters.wind_at(0.0, (100.0, 49.0))[1] == pytest.approx(2.4, abs=0.05)  # close behind
    assert waters.wind_at(0.0, (100.0, -150.0))[1] == pytest.approx(6.0 * (1 - 0.6 / math.e), abs=0.05)
    assert waters.wind_at(0.0, (300.0, 0.0))[1] == pytest.approx(6.0, abs=0.01)  # beside it
    assert waters.wind_at(0.0, (100.0, -3000.0))[1] == pytest.approx(6.0, abs=0.01)


@given(places, st.floats(0.0, 6.28))
def test_a_lee_takes_no_more_than_it_says(place, twd):
    assert 1.0 - ISLAND.loss - 1e-9 <= ISLAND.share(place, twd) <= 1.0


def test_it_turns_with_the_wind():
    assert ISLAND.share((200.0, 50.0), 1.5 * math.pi) < 0.7
    assert ISLAND.share((200.0, 50.0), 0.0) > 0.99


def test_a_gradient_is_counted_from_the_frames_origin_wherever_home_is():
    waters = Waters(wind=NORTHERLY, stronger_per_km=0.3, stronger_to_rad=math.pi / 2.0, bends_rad_per_km=0.2)
    twd, tws = waters.wind_at(0.0, (1000.0, 0.0))
    assert (twd, tws) == pytest.approx((0.2, 7.8))
    moved = replace(waters, home_en_m=(1000.0, 0.0))
    assert moved.wind_at(0.0, (0.0, 0.0)) == pytest.approx((0.2, 7.8))
    assert waters.wind_at(0.0, (-50_000.0, 0.0))[1] == pytest.approx(1.2)


def test_a_tide_runs_to_and_fro_or_turns():
    tide = CurrentModel(tide_to_rad=math.pi / 2.0, tide_mps=0.8, tide_s=1000.0, tide_high_s=100.0)
    assert tide.at(100.0, (0.0, 0.0)) == pytest.approx((0.8, 0.0))
    assert tide.at(600.0, (0.0, 0.0)) == pytest.approx((-0.8, 0.0))
    assert tide.at(350.0, (0.0, 0.0)) == pytest.approx((0.0, 0.0))
    turning = replace(tide, tide_turns=1.0)
    assert turning.at(350.0, (0.0, 0.0)) == pytest.approx((0.0, -0.8))  # from east to south: with the clock
    for t in range(0, 1000, 50):
        assert math.hypot(*turning.at(float(t), (0.0, 0.0))) == pytest.approx(0.8)


@given(places, st.floats(0.0, 1e5))
def test_a_sheared_stream_never_turns_round(place, t_s):
    stream = CurrentModel(set_to_rad=1.0, drift_mps=0.5, shear_per_km=1.5, shear_to_rad=0.3)
    east, north = stream.at(t_s, place)
    assert east * math.sin(1.0) + north * math.cos(1.0) >= 0.0


def test_gusts_keep_the_mean_and_the_direction_and_repeat():
    gusty = Gusty(Constant(1.0, 6.0), spread=0.25, tau_s=10.0, seed=4)
    strengths = np.array([gusty.at(float(t))[1] for t in range(0, 20_000, 5)])
    assert strengths.mean() == pytest.approx(6.0, rel=0.03)
    assert np.log(strengths).std() == pytest.approx(0.25, rel=0.08)
    assert gusty.at(77.0)[0] == 1.0
    assert gusty.at(77.0) == Gusty(Constant(1.0, 6.0), spread=0.25, tau_s=10.0, seed=4).at(77.0)
    assert gusty.at(77.0) != Gusty(Constant(1.0, 6.0), spread=0.25, tau_s=10.0, seed=5).at(77.0)
