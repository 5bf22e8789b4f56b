"""The risk of a path: against simulated winds, against closed forms, and as a limit to plan within."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bench.winds import simulate_entries
from companion.planner import PlanStatus, Problem, plan
from companion.planner.plan import Leg
from companion.planner.risk import chance_constraint, kernels
from companion.planner.risk.chance_constraint import PROMISE_FACTOR, _hazard, path_risk, process_of, widened, with_risk

AR1 = {"model": "ar1", "sigma0_deg": 2.0, "sigma_inf_deg": 8.0, "rho_hz": 0.036}
STILL = {"model": "ar1", "sigma0_deg": 8.0, "sigma_inf_deg": 8.0, "rho_hz": 0.02}
KALMAN = {"model": "kalman", "sigma0_deg": 3.0, "growth_deg_per_sqrt_s": 0.5}
TABLE = {"model": "forecast", "horizon_s": [0, 30, 120, 600], "sigma_deg": [2, 5, 7, 8]}
NONE = np.zeros(1)


def problem(sigma=AR1, **change):
    base = {
        "id": "t",
        "title": "",
        "start": {"x": 0, "y": 0, "heading_deg": 0},
        "goal": {"x": 0, "y": 400, "radius": 5},
        "obstacles": [],
        "fence": None,
        "wind": {"from_deg": 0, "speed_mps": 5, "sigma": sigma},
        "boat": {
            "no_go_half_deg": 45,
            "max_twa_deg": 180,
            "turn_rate_rad_s": 0.5,
            "speed": {"model": "constant", "v_mps": 1.5},
        },
        "delta_s": 0.9,
    }
    return Problem.from_json({**base, **change})


def legs(*rows):
    """Legs from (start s, end s, TWA deg)."""
    return tuple(
        Leg(
            from_en=(0, 0),
            to_en=(0, 1),
            heading_rad=math.radians(a) % (2 * math.pi),
            twa_rad=-math.radians(a),
            turn_rad=0.0,
            length_m=1.0,
            speed_mps=1.0,
            start_s=t0,
            end_s=t1,
            sigma_rad=0.0,
            no_go_half_rad=0.0,
        )
        for t0, t1, a in rows
    )


def boole(p, path):
    """Return the union bound that a tree adds up edge by edge."""
    of, total, before_twa, before_s = process_of(p), 0.0, 0.0, -1.0
    for leg in path:
        total += kernels.leg_risk(
            leg.start_s,
            leg.end_s,
            -leg.twa_rad,
            before_twa,
            before_s,
            p.boat.no_go_half_rad,
            of.model,
            of.s0,
            of.s1,
            of.rho,
            of.tau,
            of.table_t,
            of.table_s,
        )
        before_twa, before_s = -leg.twa_rad, leg.end_s
    return total


CASES = [
    (AR1, [(2, 150, 62), (155, 300, -62)]),
    (STILL, [(2, 80, 60), (85, 160, -60), (165, 240, 60), (245, 320, -60)]),
    (STILL, [(0, 500, 70)]),
    (KALMAN, [(2, 200, 60), (205, 380, -63)]),
    (TABLE, [(2, 150, 62), (155, 300, -62)]),
    ({"model": "ar1", "sigma0_deg": 0.0, "sigma_inf_deg": 9.0, "rho_hz": 0.01}, [(1, 120, 58), (125, 200, -60)]),
]


@pytest.mark.parametrize(("sigma", "rows"), CASES, ids=range(len(CASES)))
def test_what_is_computed_is_what_simulated_winds_do(sigma, rows):
    p, path = problem(sigma), legs(*rows)
    risk = path_risk(p, path)
    n = 4000
    hits = simulate_entries(p, path, winds=n, step_s=0.2, seed=1)
    share = float(np.mean(hits >= 0))
    noise = 4.0 * math.sqrt(max(share, 1.0 / n) / n)
    # Steps of 0.2 s still miss a few entries that a continuous wind makes: the computed share may be a tenth above.
    assert share <= risk.computed + noise
    assert share >= 0.8 * risk.computed - noise
    for i, leg in enumerate(risk.legs):
        on_leg = float(np.mean(hits == i))
        slack = 5.0 * math.sqrt(max(on_leg, 1e-3) / n) + 0.2 * leg.first_entry
        assert on_leg == pytest.approx(leg.first_entry, abs=slack)


@pytest.mark.parametrize(("sigma", "rows"), CASES, ids=range(len(CASES)))
@pytest.mark.parametrize("step_s", [0.5, 2.0])
def test_the_promise_holds_and_is_not_three_times_too_careful(sigma, rows, step_s):
    p, path = problem(sigma), legs(*rows)
    promised = path_risk(p, path).total
    share = float(np.mean(simulate_entries(p, path, winds=2000, step_s=step_s, seed=2) >= 0))
    assert share <= promised
    assert share >= promised / 3.0


def test_an_instant_is_eq_15_and_a_long_time_is_far_more():
    p = problem(STILL, delta_s=0.9)
    half = p.no_go_half_rad(0.0)
    instant = path_risk(p, legs((0.0, 1e-6, math.degrees(half))))
    assert instant.legs[0].worst_instant == pytest.approx(0.1, abs=1e-9)
    assert instant.computed == pytest.approx(0.1, abs=4e-3)
    long = path_risk(p, legs((0.0, 600.0, math.degrees(half))))
    assert long.computed > 0.7


def test_a_random_walk_obeys_the_reflection_principle():
    sigma = {"model": "kalman", "sigma0_deg": 0.0, "growth_deg_per_sqrt_s": 0.5}
    margin, t = 12.0, 400.0
    computed = path_risk(problem(sigma), legs((0.0, t, 45.0 + margin))).computed
    exact = 2.0 * 0.5 * math.erfc(margin / (0.5 * math.sqrt(t)) / math.sqrt(2.0))
    assert computed == pytest.approx(exact, rel=0.05)


def test_independent_steps_would_be_wrong_and_one_instant_too():
    p, path = problem(STILL), legs((0.0, 60.0, 60.0))
    risk = path_risk(p, path)
    per_second = 1.0 - (1.0 - risk.legs[0].worst_instant) ** 60
    assert risk.computed < 0.6 * per_second
    assert risk.computed > 2.0 * risk.legs[0].worst_instant


def test_a_certain_wind_has_no_risk_and_downwind_nearly_none():
    assert path_risk(problem({"model": "none"}), legs((0.0, 300.0, 45.0))).total == 0.0
    assert path_risk(problem(AR1), legs((0.0, 300.0, 180.0))).total < 1e-9


def test_a_leg_in_the_zone_fails_for_sure_and_nothing_is_nothing():
    assert path_risk(problem(AR1), legs((1.0, 50.0, 20.0))).computed > 0.99
    assert path_risk(problem(AR1), ()).total == 0.0


@given(
    angle=st.floats(46.0, 120.0),
    more=st.floats(0.5, 20.0),
    t=st.floats(5.0, 2000.0),
    sigma=st.sampled_from([AR1, KALMAN, TABLE, STILL]),
)
@settings(max_examples=60)
def test_risk_is_a_probability_that_falls_with_the_angle_and_rises_with_time(angle, more, t, sigma):
    p = problem(sigma)
    here = path_risk(p, legs((0.0, t, angle)))
    assert 0.0 <= here.computed <= here.total <= 1.0
    assert here.total <= PROMISE_FACTOR * here.computed + 1e-12
    assert path_risk(p, legs((0.0, t, min(135.0, angle + more)))).computed <= here.computed + 1e-6
    assert path_risk(p, legs((0.0, 1.5 * t, angle))).computed >= here.computed - 1e-3
    assert path_risk(p, legs((0.0, t, -angle))).computed == pytest.approx(here.computed, rel=1e-6, abs=1e-9)


@given(angle=st.floats(60.0, 90.0), t=st.floats(10.0, 1500.0), sigma=st.sampled_from([AR1, KALMAN, TABLE, STILL]))
@settings(max_examples=60)
def test_the_sum_that_the_tree_adds_up_is_not_below_what_is_computed(angle, t, sigma):
    p, path = problem(sigma), legs((0.0, t, angle), (t + 5.0, 2.0 * t, -angle))
    assert boole(p, path) >= 0.85 * path_risk(p, path).computed - 1e-6


@given(r=st.floats(0.05, 0.995))
@settings(max_examples=20)
def test_the_chance_to_go_from_cell_to_cell_is_the_normal_laws(r):
    """Against the error function itself, cell by cell, both halves of the grid; rows sum to one."""
    step = kernels.steps_of(r)
    edges = np.linspace(-kernels.Z_MAX, kernels.Z_MAX, kernels.Z_CELLS + 1)
    centres = 0.5 * (edges[1:] + edges[:-1])
    at = (edges[None, :] - r * centres[:, None]) / math.sqrt(2.0 * (1.0 - r * r))
    law = np.diff(0.5 * np.vectorize(math.erfc)(-at), axis=1)
    assert np.allclose(step, law / law.sum(axis=1, keepdims=True), rtol=0.0, atol=1e-11)
    assert np.allclose(step.sum(axis=1), 1.0, rtol=0.0, atol=1e-12)


def test_cutting_a_leg_in_two_changes_nothing():
    p = problem(AR1)
    whole, cut = legs((0.0, 200.0, 62.0)), legs((0.0, 90.0, 62.0), (90.0, 200.0, 62.0))
    assert path_risk(p, cut).computed == pytest.approx(path_risk(p, whole).computed, rel=0.02)
    assert boole(p, cut) == pytest.approx(boole(p, whole), rel=0.05)


def test_a_passage_of_a_day_costs_no_more_steps_than_the_wind_needs_to_settle():
    p, full = process_of(problem(AR1)), kernels.steps_of(kernels.R_STEP)
    out = np.zeros(1)
    steps = kernels.first_passage(
        np.array([0.0]),
        np.array([86_400.0]),
        np.array([math.radians(80.0)]),
        math.radians(45.0),
        p.model,
        p.s0,
        p.s1,
        p.rho,
        p.tau,
        p.table_t,
        p.table_s,
        full,
        out,
    )
    assert 0 < steps < 3000
    short = np.zeros(1)
    kernels.first_passage(
        np.array([0.0]),
        np.array([8640.0]),
        np.array([math.radians(80.0)]),
        math.radians(45.0),
        p.model,
        p.s0,
        p.s1,
        p.rho,
        p.tau,
        p.table_t,
        p.table_s,
        full,
        short,
    )
    assert -math.log1p(-out[0]) == pytest.approx(-10.0 * math.log1p(-short[0]), rel=0.02)


def test_heavy_tails_of_a_forecast_count():
    thin = problem({**TABLE})
    fat = problem({**TABLE, "half_width_deg": [6, 16, 22, 26]})
    path = legs((2, 150, 62), (155, 300, -62))
    assert path_risk(fat, path).computed > path_risk(thin, path).computed


# ------------------------------------------------------------------------------- planning within a limit
@pytest.mark.parametrize(("algorithm", "expansions"), [("rrtstar", 10_000), ("auto", 80_000)])
def test_a_limit_is_kept_and_its_promise_is_true(algorithm, expansions):
    p = problem(AR1, delta_s=0.7, risk={"max_path_risk": 0.1})
    answer = plan(p, algorithm=algorithm, expansions=expansions)
    assert answer.has_path
    assert 0.0 < answer.risk <= 0.1
    share = float(np.mean(simulate_entries(p, answer, winds=2000, step_s=0.5, seed=3) >= 0))
    assert answer.risk / 3.0 <= share <= answer.risk
    assert sum(leg.risk for leg in answer.legs) == pytest.approx(answer.risk)


def test_a_limit_that_nothing_keeps_is_said_so():
    wall = ["POLYGON((-400 -60,-30 -60,-30 460,-400 460,-400 -60))", "POLYGON((30 -60,400 -60,400 460,30 460,30 -60))"]
    p = problem(STILL, obstacles=wall, delta_s=0.6, risk={"max_path_risk": 1e-4})
    answer = plan(p, algorithm="rrtstar", expansions=3000)
    assert answer.status is PlanStatus.TIMEOUT
    assert not answer.has_path


def test_a_limit_that_does_not_bind_changes_nothing():
    free = problem(AR1, goal={"x": 0, "y": -400, "radius": 5})
    held = problem(AR1, goal={"x": 0, "y": -400, "radius": 5}, risk={"max_path_risk": 0.5})
    a, b = (plan(p, algorithm="astar", expansions=10**7) for p in (free, held))
    assert a.cost_s == pytest.approx(b.cost_s)
    assert b.risk is not None
    assert b.risk < 0.01


@pytest.mark.parametrize("sigma", [AR1, KALMAN, TABLE, {**TABLE, "half_width_deg": [6, 16, 22, 26]}])
def test_widening_by_sigmas_widens_by_sigmas(sigma):
    p = problem(sigma)
    for t in (0.0, 100.0, 1000.0):
        more = widened(p, 1.5).no_go_half_rad(t) - p.no_go_half_rad(t)
        assert more == pytest.approx(1.5 * p.wind.sigma.at(t), abs=1e-6)
    assert widened(p, 0.0).no_go_half_rad(100.0) == p.no_go_half_rad(100.0)


def test_a_plan_without_a_path_has_no_risk():
    answer = plan(problem(obstacles=["POLYGON((-9 -9,9 -9,9 9,-9 9,-9 -9))"]), algorithm="rrtstar", expansions=10)
    assert with_risk(problem(), answer) is answer


def test_what_is_promised_is_a_seventh_more_than_is_computed_and_never_more_than_certain(monkeypatch):
    mild = path_risk(problem(STILL), legs((0, 60, 70)))
    assert mild.wind == pytest.approx(1.15 * mild.computed)
    assert 0.0 < mild.wind < 1.0
    monkeypatch.setattr(chance_constraint, "tacks_at_risk", lambda problem, legs: (SimpleNamespace(risk=0.25),))
    both = path_risk(problem(STILL), legs((0, 60, 70)))
    assert both.total == pytest.approx(mild.wind + 0.25)
    worst = path_risk(problem(STILL), legs((0, 600, 10)))
    assert worst.wind == 1.0
    assert worst.total == 1.0


@pytest.mark.parametrize(
    ("promised", "hazard"), [(0.0, 1e-9), (0.5, 0.5705), (1.0, 2.0369), (1.15, 20.723), (9.0, 20.723)]
)
def test_the_hazard_behind_a_promise_is_finite_whatever_is_promised(promised, hazard):
    assert _hazard(promised) == pytest.approx(hazard, rel=1e-3)
