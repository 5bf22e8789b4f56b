"""The four cases of arXiv 2309.13436 on coarse grids; ``python -m bench.policy`` holds them to 2 % on fine ones."""

import math

import numpy as np
import pytest

from bench.policy import CASES, RIM, STATES, TARGET, all_round, as_water, compared, reduced


@pytest.mark.parametrize(("drift", "spread"), CASES)
def test_the_water_agrees_with_the_reduced_problem(drift, spread):
    policy = as_water(drift, spread, cell=0.06)
    rows = compared(reduced(drift, spread, rows=191, columns=180), policy)
    for distance, value, mean, most in rows:
        assert value == pytest.approx((distance - TARGET) / (RIM / 50.0), rel=0.25), "about at the fastest speed's pace"
        assert abs(mean) < 0.03
        assert most < 0.08


def test_the_wind_all_round_drifts_and_spreads_as_the_process_does():
    after_s, drift, spread = 0.7, 0.15, 0.05
    chain = all_round(drift, spread).after(after_s)
    turn = 2.0 * math.pi / STATES
    steps = (np.arange(STATES) + STATES // 2) % STATES - STATES // 2
    assert chain[0] @ steps * turn == pytest.approx(drift * after_s)
    assert chain[0] @ steps**2 * turn**2 - (drift * after_s) ** 2 == pytest.approx(spread**2 * after_s, rel=1e-6)
