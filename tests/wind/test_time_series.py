"""ARMA and GARCH (Wolsieffer's section 5), each on the wind of its own model with the truth known."""

import math

import numpy as np
import pytest

from companion.wind import make
from companion.wind.estimators import time_series

CELL_S = 10
SIGMA = math.radians(4.0)


def feed(estimator, directions, first=0):
    """Show an estimator one direction per cell of ten seconds, a reading each second, and return it."""
    for k, direction in enumerate(directions, first):
        for t in range(CELL_S):
            estimator.update(float(CELL_S * k + t), float(direction), 6.0)
    return estimator


def arma(a1, a2, b, seed, count=1500):
    e, y = np.random.default_rng(seed).normal(0.0, SIGMA, count), [0.0, 0.0]
    for k in range(2, count):
        y.append(a1 * y[-1] + a2 * y[-2] + e[k] + b * e[k - 1])
    return y


def spread_of_arma(a1, a2, b, steps):
    """Return the standard deviation ``steps`` cells ahead [rad], by the weights of the shocks."""
    psi = [1.0, a1 + b]
    while len(psi) < steps:
        psi.append(a1 * psi[-1] + a2 * psi[-2])
    return SIGMA * math.sqrt(sum(p * p for p in psi[:steps]))


@pytest.mark.parametrize(("a1", "a2", "b"), [(1.2, -0.4, 0.0), (0.5, 0.2, 0.0), (0.7, 0.0, 0.6)])
def test_arma_tells_the_spread_of_the_process_that_it_sees(a1, a2, b):
    ratios = []
    for seed in range(3):
        estimator = feed(make("arma"), arma(a1, a2, b, seed))
        ratios.append([estimator.forecast(10.0 * n)[1] / spread_of_arma(a1, a2, b, n) for n in (1, 2, 4, 12)])
    assert np.mean(ratios, axis=0) == pytest.approx(np.ones(4), abs=0.15)


class Counted(float):
    """A number that counts how often it is multiplied with."""

    times = 0

    def __mul__(self, other):
        Counted.times += 1
        return float(self) * other

    __rmul__ = __mul__


@pytest.mark.parametrize(("a1", "a2", "b"), [(1.2, -0.4, 0.3), (0.99, 0.0, 0.5), (1.9, -0.95, -0.5)])
def test_arma_of_a_long_silence_is_told_at_the_cost_of_a_short_one(a1, a2, b, monkeypatch):
    estimator = feed(make("arma"), arma(0.7, 0.0, 0.6, 1, 200))
    estimator._theta = np.array([a1, a2, b])
    monkeypatch.setattr(time_series, "_NOTHING", 0.0)
    long = [estimator._predict(h) for h in (60.0, 3600.0, 1e6)]
    monkeypatch.undo()
    assert np.allclose([estimator._predict(h) for h in (60.0, 3600.0, 1e6)], long, rtol=1e-11, atol=1e-11)

    class Theta:
        def tolist(self):
            return [Counted(a1), Counted(a2), Counted(b)]

    estimator._theta, Counted.times = Theta(), 0
    estimator._predict(1e8)
    assert Counted.times < 50_000


def test_arma_forecasts_a_swing_that_an_ar_of_order_one_cannot():
    """Complex roots: what is left of the way is to the other side of the mean, half a swing ahead."""
    a1, a2 = 2.0 * 0.95 * math.cos(2.0 * math.pi / 12.0), -(0.95**2)
    told, came, stops = {"arma": [], "garch": []}, [], range(600, 890, 29)
    for seed in range(4):
        y = arma(a1, a2, 0.0, seed, 900)
        came += [y[stop + 5] for stop in stops]
        for name, values in told.items():
            estimator, seen = make(name), 0
            for stop in stops:
                feed(estimator, y[seen:stop], seen)
                seen = stop
                values.append(estimator.forecast(60.0)[0])
    assert np.corrcoef(told["arma"], came)[0, 1] > 0.6
    assert np.corrcoef(told["garch"], came)[0, 1] < 0.2


def test_garch_tells_a_restless_wind_from_a_quiet_one():
    """Shocks threefold for five minutes in every twenty: the spread follows at once."""
    restless, quiet = [], []
    for seed in range(4):
        rng, y, estimator = np.random.default_rng(seed), 0.0, make("garch")
        for k in range(1440):
            is_restless = k % 120 >= 90
            y = 0.8 * y + rng.normal(0.0, SIGMA * (3.0 if is_restless else 1.0))
            feed(estimator, [y], k)
            if k > 720 and k % 120 in (60, 119):
                (restless if is_restless else quiet).append(estimator.forecast(10.0)[1])
    assert np.median(restless) > 1.7 * np.median(quiet)
    assert np.median(quiet) == pytest.approx(SIGMA, rel=0.5)


def test_garch_forgets_a_burst_and_grows_to_the_spread_of_its_process():
    phi = 0.8
    ratios = []
    for seed in range(4):
        rng, y = np.random.default_rng(seed), [0.0]
        for _ in range(2000):
            y.append(phi * y[-1] + rng.normal(0.0, SIGMA))
        estimator = feed(make("garch"), y)
        truth = [SIGMA * math.sqrt((1.0 - phi ** (2 * n)) / (1.0 - phi**2)) for n in (1, 3, 30)]
        ratios.append([estimator.forecast(10.0 * n)[1] / s for n, s in zip((1, 3, 30), truth, strict=True)])
    assert np.mean(ratios, axis=0) == pytest.approx(np.ones(3), abs=0.2)
