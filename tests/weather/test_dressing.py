"""A forecast dressed with its own error: as wide as runs are off, wider with age, past its end climatology."""

import math
from dataclasses import replace

import numpy as np
import pytest

from companion.weather import Climate, ForecastError, Weather, continued, dressed, errors_of, fitted
from tests.passage.world import T0, cube, steady

LAT, LON = np.array([0.0, 1.0]), np.array([0.0, 1.0])
DAYS = np.arange(0.0, 24.0 * 6.0 + 1.0, 6.0)
ERROR = ForecastError(now_mps=0.5, per_day_mps=1.0)


def weather(*winds, base_s=T0):
    one = cube(LAT, LON, DAYS, [steady(*wind) for wind in winds or ((0.0, -8.0),)])
    return Weather(wind=(replace(one, base_utc_s=np.full(one.utc_s.size, base_s)),))


def spread(found, hours):
    return found.wind_en_mps(T0 + 3600.0 * np.array(hours), 0.5, 0.5).std(axis=0).mean(axis=1)


def test_it_is_as_wide_as_its_error_and_an_older_run_is_wider():
    hours = (0.0, 24.0, 72.0)
    fresh = spread(dressed(weather(), ERROR, copies=300), hours)
    stale = spread(dressed(weather(base_s=T0 - 2 * 86_400.0), ERROR, copies=300), hours)
    assert fresh == pytest.approx([math.hypot(0.5, lead) for lead in (0.0, 1.0, 3.0)], rel=0.09)
    assert stale == pytest.approx([math.hypot(0.5, lead) for lead in (2.0, 3.0, 5.0)], rel=0.09)


def test_an_error_wanders_and_a_seed_repeats_it():
    found = dressed(weather(), ERROR, copies=250)
    again, other = (dressed(weather(), ERROR, copies=250, seed=seed) for seed in (0, 1))
    off = found.wind_en_mps(T0 + 3600.0 * np.array([48.0, 54.0, 96.0]), 0.5, 0.5)[..., 0]
    assert np.corrcoef(off[:, 0], off[:, 1])[0, 1] == pytest.approx(math.exp(-0.25), abs=0.05)
    assert np.corrcoef(off[:, 0], off[:, 2])[0, 1] == pytest.approx(math.exp(-2.0), abs=0.1)
    assert np.array_equal(found.wind[0].values, again.wind[0].values)
    assert not np.array_equal(found.wind[0].values, other.wind[0].values)
    assert np.ptp(found.wind[0].values[3, 5, :, :, 0]) < 1e-5  # the same over the water


def test_few_members_become_several_and_many_stay_as_many():
    assert len(dressed(weather(), ERROR).members) == 9
    assert len(dressed(weather((0.0, -8.0), (1.0, -8.0)), ERROR).members) == 10
    assert dressed(weather(*((0.1 * k, -8.0) for k in range(20))), ERROR).members == tuple(range(20))


def test_a_copy_has_the_waves_of_the_member_that_it_is_made_of():
    """Copies of five members were numbered anew, their waves were not: the second of the first had the second's."""
    winds = weather(*((0.0, -float(m)) for m in range(1, 6)))
    heights = cube(LAT, LON, DAYS, [steady(float(m), 0.0) for m in range(1, 6)])
    waves = replace(heights, values=heights.values[..., :1])
    still = ForecastError(now_mps=0.0, per_day_mps=0.0)
    found = dressed(replace(winds, waves=(waves,)), still)
    assert found.waves_m(T0, 0.5, 0.5).tolist() == (-found.wind_en_mps(T0, 0.5, 0.5)[:, 1]).tolist()
    one = dressed(replace(winds, waves=(waves.only(0),)), still)
    assert one.waves_m(T0, 0.5, 0.5).tolist() == [1.0] * 10


def test_two_grids_of_a_member_have_one_error():
    fine = replace(cube(LAT, LON, np.arange(0.0, 49.0, 3.0), steady(0.0, -8.0)))
    both = dressed(Weather(wind=(fine, weather().wind[0])), ERROR, copies=5)
    one, two = (c.at(T0 + 86_400.0, 0.5, 0.5) for c in both.wind)
    assert one == pytest.approx(two, abs=1e-5)


def test_what_runs_are_off_by_is_found_again():
    rng = np.random.default_rng(41)
    runs = []
    for k in range(70):
        base = T0 + 43_200.0 * k
        lead = 21_600.0 * np.arange(13)
        sd = np.hypot(0.6, 0.8 * lead / 86_400.0)
        members = []
        off = sd[:, None] * rng.standard_normal(2)
        for _ in range(8):
            wind = np.array([3.0, -6.0]) + off + 0.5 * sd[:, None] * rng.standard_normal(2)
            members.append(np.broadcast_to(wind[:, None, None, :], (13, 2, 2, 2)))
        made = replace(
            weather().wind[0],
            utc_s=base + lead,
            base_utc_s=np.full(13, base),
            members=tuple(range(8)),
            values=np.stack(members).astype(np.float32),
        )
        runs.append(Weather(wind=(made,)))
    error = fitted(errors_of(runs))
    # Of the error squared a quarter is in the members' spread; the runs that it is held against are off at once, too.
    assert error.per_day_mps == pytest.approx(math.sqrt(1.0 - 0.25 + 0.25 / 8) * 0.8, rel=0.2)
    assert 0.6 < error.now_mps < 1.1


def test_one_lead_is_none():
    with pytest.raises(ValueError, match="fewer than two leads"):
        fitted(np.array([[43_200.0, 1.0, 0.2], [43_200.0, 1.1, 0.2]]))


def test_past_its_end_it_is_the_season():
    climate = Climate(wind_en_mps=(4.0, 0.0), spread_mps=3.0)
    found = continued(dressed(weather(), ERROR, copies=250), climate, T0 + 16 * 86_400.0)
    assert found.climate_from_s == T0 + 6 * 86_400.0
    late = found.wind_en_mps(T0 + 15.9 * 86_400.0, 0.5, 0.5)
    assert late.mean(axis=0) == pytest.approx([4.0, 0.0], abs=0.6)
    assert late.std(axis=0) == pytest.approx([3.0, 3.0], rel=0.15)
    just = found.wind_en_mps(T0 + 86_400.0 * np.array([6.0, 6.2]), 0.5, 0.5)
    assert just[:, 0].mean(axis=0) == pytest.approx([0.0, -8.0], abs=1.0)
    assert np.isnan(found.wind_en_mps(T0 + 17 * 86_400.0, 0.5, 0.5)).all()
    assert continued(weather(), climate, T0 + 86_400.0).climate_from_s == math.inf
