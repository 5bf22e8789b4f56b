"""Planning within a limit on a path's risk, with a search that costs nothing: what is asked of it, what is kept."""

import math
from dataclasses import replace

import numpy as np
import pytest

from companion.planner import PlanStatus
from companion.planner.effort import Effort, Outcome
from companion.planner.plan import Plan
from companion.planner.problem import RiskLimit, evaluate
from companion.planner.risk.chance_constraint import (
    MOST_EXTRA_SIGMAS,
    RISK_ROUNDS,
    _instant,
    keep_limit,
    path_risk,
    search_within,
    widened,
)
from tests.planner.risk.test_risk import AR1, KALMAN, STILL, TABLE, problem

UP_M = 200.0


def one_tack(p):
    """The path of one tack as near to the wind as the problem lets it, all the way."""
    east = UP_M * math.tan(p.no_go_max_rad + 1e-6)
    return np.array([(0.0, 0.0), (east, UP_M), (0.0, 2.0 * UP_M)])


class OneTack:
    """A search that hands back the path of one tack, and notes what it was asked with."""

    def __init__(self):
        self.asked, self.efforts = [], []

    def __call__(self, p, effort, seed):
        self.asked.append(p)
        self.efforts.append(effort)
        effort.spend(3)
        if p.no_go_max_rad > 1.4:
            return Outcome(waypoints_en=None, reason="shut")
        return Outcome(waypoints_en=one_tack(p), lower_bound_s=100.0 + len(self.asked))


def limited(limit, sigma=STILL, delta_s=0.6):
    return problem(sigma, delta_s=delta_s, risk={"max_path_risk": limit})


@pytest.mark.parametrize("limit", [0.3, 0.1, 0.02])
@pytest.mark.parametrize("sigma", [STILL, AR1])
def test_the_fastest_path_within_a_limit_is_the_least_widened_one(limit, sigma):
    p, search, told = limited(limit, sigma), OneTack(), []
    found = search_within(search, p, Effort(None, 10_000), 1, told.append)
    extra = found.trace["extra_sigmas"]

    def promised(sigmas):
        return path_risk(p, evaluate(p, one_tack(widened(p, sigmas))).legs).total

    assert np.array_equal(found.waypoints_en, one_tack(widened(p, extra)))
    assert promised(extra) <= limit < promised(extra - 0.05)
    assert len(search.asked) <= 12
    assert found.lower_bound_s == 101.0  # of the problem itself: what is narrower proves nothing of it
    assert np.array_equal(told[-1], found.waypoints_en)
    times = [evaluate(p, path).time_s for path in told]
    assert times == sorted(times, reverse=True)


def test_a_limit_that_does_not_bind_asks_once_more_with_all_that_is_left():
    p, search = limited(0.9, AR1, delta_s=0.999), OneTack()
    effort = Effort(None, 8000)
    found = search_within(search, p, effort, 1)
    assert found.trace["extra_sigmas"] == 0.0
    assert [e.limit for e in search.efforts] == [8000 // RISK_ROUNDS, 8000 - 3]
    assert effort.used == 6
    assert found.lower_bound_s == 102.0  # both were of the problem itself


def test_each_round_has_its_part_of_the_seconds():
    search = OneTack()
    search_within(search, limited(0.1), Effort(80.0, None), 1)
    assert search.efforts[0].budget_s == pytest.approx(80.0 / RISK_ROUNDS)
    assert search.efforts[-1].budget_s == pytest.approx(80.0, rel=0.1)  # what is found is searched for with the rest


def test_where_nothing_is_risked_little_enough_the_least_that_was_found_is_said():
    p = limited(1e-5, {**STILL, "sigma0_deg": 20.0, "sigma_inf_deg": 20.0})
    found = search_within(OneTack(), p, Effort(None, 10_000), 1)
    assert found.waypoints_en is None
    assert "no path within the limit of 0.001 % on its risk; the least risky found has" in found.reason
    shut = search_within(lambda p, effort, seed: Outcome(waypoints_en=None, reason="shut"), p, Effort(None, 10_000), 1)
    assert shut.reason == "shut"


def test_a_path_whose_risk_is_the_limit_is_kept_and_one_above_it_is_no_plan():
    p = problem(STILL, delta_s=0.6)
    judged = evaluate(p, one_tack(p))
    plan = Plan(status=PlanStatus.FOUND, reason="", waypoints_en=one_tack(p), legs=judged.legs, cost_s=judged.time_s)
    risk = path_risk(p, judged.legs).total
    kept = keep_limit(replace(p, risk=RiskLimit(max_path_risk=risk)), plan)
    assert (kept.has_path, kept.risk) == (True, risk)
    assert sum(leg.risk for leg in kept.legs) == pytest.approx(risk)
    refused = keep_limit(replace(p, risk=RiskLimit(max_path_risk=0.99 * risk)), plan)
    assert (refused.status, refused.has_path, refused.cost_s) == (PlanStatus.NOT_FOUND, False, math.inf)
    assert f"has a risk of {100.0 * risk:.3g} %, above the limit of {99.0 * risk:.3g} %" in refused.reason
    assert keep_limit(p, plan).has_path


@pytest.mark.parametrize("sigma", [AR1, KALMAN, TABLE])
def test_the_widest_zone_that_is_asked_for_is_one(sigma):
    """Eight standard deviations more are a probability of 1 to the last bit, of which there is no quantile."""
    p = problem(sigma)
    assert math.isfinite(widened(p, MOST_EXTRA_SIGMAS).no_go_half_rad(50.0))
    assert widened(p, MOST_EXTRA_SIGMAS).no_go_half_rad(50.0) > p.no_go_half_rad(50.0) + 5.0 * p.wind.sigma.at(50.0)


@pytest.mark.parametrize(
    ("sigma", "tau_s"), [(AR1, 1.0 / 0.036), ({**AR1, "rho_hz": 0.0}, math.inf), (KALMAN, math.inf), (TABLE, 60.0)]
)
def test_how_long_a_wind_stays_off_its_mean_is_told(sigma, tau_s):
    assert path_risk(problem(sigma), ()).correlation_time_s == pytest.approx(tau_s)
    own = problem(sigma, risk={"max_path_risk": 0.1, "correlation_time_s": 25.0})
    assert path_risk(own, ()).correlation_time_s == pytest.approx(25.0 if sigma is TABLE else tau_s)


@pytest.mark.parametrize(
    ("margin", "sigma", "chance"),
    [(0.0, 0.1, 0.5), (0.1, 0.1, 0.158655), (-0.1, 0.1, 0.841345), (0.1, 0.0, 0.0), (0.0, 0.0, 0.0), (-0.1, 0.0, 1.0)],
)
def test_at_an_instant_the_zone_is_entered_by_the_normal_law_or_for_certain(margin, sigma, chance):
    assert _instant(margin, sigma) == pytest.approx(chance, abs=1e-6)
