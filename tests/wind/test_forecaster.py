"""The default forecaster against processes whose answer is known."""

import math

import numpy as np
import pytest

from companion.wind import Forecaster
from companion.wind.estimators import forecaster_kernels as kernel
from companion.wind.estimators.forecaster import CONSTANTS
from companion.wind.study.score import SCORED_HORIZONS_S
from lab.simulated_wind import NOISE_RADPS, RHO_HZ, equation_17, weather
from lab.wind_fit import Prepared, crps_circular, figures

STATIONARY_RAD = NOISE_RADPS / math.sqrt(1.0 - (1.0 - RHO_HZ) ** 2)  # 18.7 deg, equation 17 at 1 s
SEEDS = range(40, 48)


@pytest.fixture(scope="module")
def worlds():
    return [equation_17(seed, mean_rad=seed * 0.7) for seed in SEEDS]


def oracle(record, mean_rad, prepared):
    """CRPS [rad] by horizon of the forecaster that knows equation 17 and its mean."""
    x = (record.twd_from_rad - mean_rad + math.pi) % (2.0 * math.pi) - math.pi
    rows = np.flatnonzero(prepared.ask)
    found = []
    for a, h in enumerate(SCORED_HORIZONS_S):
        good = prepared.target[a] >= 0
        keep = (1.0 - RHO_HZ) ** h
        error = x[prepared.target[a][good]] - keep * x[rows[good]]
        error = (error + math.pi) % (2.0 * math.pi) - math.pi
        sigma = np.full(error.size, STATIONARY_RAD * math.sqrt(1.0 - keep * keep))
        found.append(float(np.mean(crps_circular(error, sigma))))
    return found


def test_equation_17_within_4_percent_of_the_oracle_and_calibrated(worlds):
    prepared = [Prepared(w) for w in worlds]
    best = np.mean([oracle(w, s * 0.7, p) for w, s, p in zip(worlds, SEEDS, prepared, strict=True)], axis=0)
    mean = np.mean(figures(CONSTANTS, prepared), axis=0)
    assert np.all(mean[:, 0] / best <= 1.04), (mean[:, 0] / best).round(3)
    assert np.all((mean[:, 1] >= 0.44) & (mean[:, 1] <= 0.56)), mean[:, 1]
    assert np.all((mean[:, 2] >= 0.76) & (mean[:, 2] <= 0.84)), mean[:, 2]
    assert np.all((mean[:, 3] >= 0.93) & (mean[:, 3] <= 0.98)), mean[:, 3]


def test_the_spread_levels_off_at_the_stationary_value():
    """Six hours of equation 17: an hour ahead sigma is the process's own, within 5 % on the average."""
    ratio, growth = [], []
    for seed in range(60, 68):
        record = equation_17(seed, seconds=6 * 3600.0)
        f = Forecaster()
        for t, d, s in zip(record.t_s.tolist(), record.twd_from_rad.tolist(), record.tws_mps.tolist(), strict=True):
            f.update(t, d, s)
        ratio.append(f.forecast(3600.0)[1] / STATIONARY_RAD)
        growth.append(f.forecast(3600.0)[1] / f.forecast(600.0)[1])
    assert abs(float(np.mean(ratio)) - 1.0) < 0.05, ratio
    assert max(growth) < 1.2


def test_an_hour_ahead_is_no_wider_than_what_was_shown():
    record = weather(8, seconds=10000.0)
    f = Forecaster()
    for t, d, s in zip(record.t_s.tolist(), record.twd_from_rad.tolist(), record.tws_mps.tolist(), strict=True):
        f.update(t, d, s)
    mean, sigma, _, _ = f.forecast(3600.0)
    off = (record.twd_from_rad - mean + math.pi) % (2.0 * math.pi) - math.pi
    assert sigma <= 1.15 * float(np.sqrt(np.mean(off**2)))


def test_correlation_time_of_equation_17(worlds):
    found = []
    for record in worlds[:4]:
        f = Forecaster()
        for t, d, s in zip(record.t_s.tolist(), record.twd_from_rad.tolist(), record.tws_mps.tolist(), strict=True):
            f.update(t, d, s)
        found.append(f.correlation_time_s)
    assert float(np.mean(found)) == pytest.approx(1.0 / RHO_HZ, rel=0.35)


def test_weather_is_covered():
    mean = np.nanmean(figures(CONSTANTS, [Prepared(weather(s, seconds=7200.0)) for s in range(8)]), axis=0)
    assert np.all((mean[:, 3] > 0.90) & (mean[:, 3] < 0.985)), mean[:, 3]


def test_turning_readings_are_not_scored_against():
    """A weight below one half moves the mean a little and teaches nothing about errors."""
    plain, disturbed = Forecaster(), Forecaster()
    record = weather(2, seconds=3000.0)
    for i, (t, d, s) in enumerate(
        zip(record.t_s.tolist(), record.twd_from_rad.tolist(), record.tws_mps.tolist(), strict=True)
    ):
        plain.update(t, d, s)
        spoiled = i % 300 > 285
        disturbed.update(t, d + (1.2 if spoiled else 0.0), s, weight=0.3 if spoiled else 1.0)
    assert disturbed.forecast(60.0)[1] < 1.6 * plain.forecast(60.0)[1]


def test_the_state_has_a_fixed_size():
    state = kernel.new_state(CONSTANTS)
    assert sum(a.size for a in state) * 8 < 400_000


def test_scores_of_the_fit_are_those_of_the_score():
    """The fast replay of the fit and the plain scoring of the command are one definition."""
    from companion.wind.study.score import score

    record = weather(21, seconds=2400.0)
    slow = score(record, Forecaster())
    fast = figures(CONSTANTS, [Prepared(record)])[0]
    for a, h in enumerate(SCORED_HORIZONS_S):
        of = slow.at(h)
        assert of is not None
        assert of.crps_rad == pytest.approx(fast[a, 0], rel=0.02)
        assert of.coverage == pytest.approx(tuple(fast[a, 1:4]), abs=0.05)


def test_nothing_is_compiled_in_flight():
    """Whatever numbers arrive, every kernel keeps the one signature that the constructor compiled."""
    f = Forecaster()
    before = [len(k.signatures) for k in (kernel.update, kernel.predict, kernel.half_width_ratio)]
    for t in range(20):
        f.update(t, 1, 5)
        f.update(np.float64(t + 0.5), np.float32(1.0), np.int64(5))
    f.forecast(10)
    f.interval(np.float32(10), 0.9)
    f.table(20, horizons_s=[1, 2], levels=[0.5])
    assert [len(k.signatures) for k in (kernel.update, kernel.predict, kernel.half_width_ratio)] == before
