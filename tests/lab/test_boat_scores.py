"""Scores of boats on days that were not learned from: the formula, the cells, a boat whose truth is known."""

import math

import numpy as np
import pytest

from companion.boat.guess import guessed_polar
from companion.boat.log import stretches_of
from lab.boat_scores import CELL_MPS, Foretold, Winds, by_cells, crps, part_of, scored, table
from lab.simulated_logs import SIZES, Truth, sailed

PRIOR = guessed_polar(SIZES)


def days(count, hours=0.25):
    truth = Truth(scale=0.65, leeway_deg=3.0, vane_deg=4.0, day_sd=0.04)
    return [
        sailed(truth, hours=hours, seed=day, t0_s=1.75e9 + 86_400.0 * day, name=f"day {day}", leg_s=60.0)
        for day in range(count)
    ]


def test_the_score_of_a_normal_is_that_of_its_integral_and_of_a_number_its_error():
    """By its definition: the integral over x of (P(X < x) - [seen < x])^2, summed step by step."""
    x = np.linspace(-6.0, 6.0, 24_001)
    for seen, mean, sd in ((0.3, 0.1, 0.2), (-0.5, 0.4, 0.3)):
        below = np.array([0.5 * (1.0 + math.erf((v - mean) / (sd * math.sqrt(2.0)))) for v in x])
        wanted = np.trapezoid((below - (x >= seen)) ** 2, x)
        told = Foretold(log_mps=np.array([mean]), sd=np.array([sd]))
        assert crps(np.array([seen]), told)[0] == pytest.approx(wanted, abs=1e-3)
    alone = Foretold(log_mps=np.array([0.1]), sd=np.array([0.0]))
    assert crps(np.array([0.4]), alone)[0] == pytest.approx(0.3)


def test_cells_tell_their_mean_most_and_quantile_and_the_guess_where_they_are_empty():
    def winds(*rows):
        twa, tws, made = np.array(rows).T
        return Winds(twa_rad=np.radians(twa), tws_mps=tws, made_mps=made)

    same = 2.5 * CELL_MPS
    train = winds((91.0, same, 1.0), (-93.0, same, 2.0), (92.0, same, 4.0), (120.0, same, 9.0))
    asked = winds((94.0, same, 1.0), (40.0, same, 1.0))
    mean, most, high = (by_cells(train, asked, PRIOR, what) for what in ("mean", "most", "quantile"))
    assert np.exp(mean.log_mps[0]) == pytest.approx(2.0)
    assert np.exp(most.log_mps[0]) == pytest.approx(4.0)
    assert 2.0 < np.exp(high.log_mps[0]) < 4.0
    assert np.exp(mean.log_mps[1]) == pytest.approx(PRIOR.speed_mps(math.radians(40.0), same))
    assert most.sd[0] == 0.0 < mean.sd[0]


def test_a_simulated_boat_is_foretold_better_than_by_guess_and_by_cells():
    stretches = stretches_of(days(3), PRIOR, 0.35)
    found = scored(stretches, PRIOR)
    score = {name: float(np.mean(crps(*told))) for name, told in found.items()}
    best = min(value for name, value in score.items() if name != "learned")
    assert score["learned"] < 0.8 * best
    assert len(found["learned"][0]) == len(stretches)
    lines = table(found)
    assert lines[1].startswith("learned")
    assert lines[4].endswith("-")  # of a cell's most no band is told


def test_a_day_that_is_left_out_is_in_no_outing_of_the_rest():
    stretches = stretches_of(days(3, hours=0.1), PRIOR, 0.35)
    rest = part_of(stretches, stretches.outing != 1)
    assert rest.outing_names == ("day 0", "day 2")
    assert set(rest.outing.tolist()) == {0, 1}
    assert len(rest) == int(np.sum(stretches.outing != 1))
