"""Uncertain vessels share the wind's promise: the discs keep it at each instant, the path's risk is true of futures."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bench.vessels import SCENES, holds, keep_of, met, problem, ship
from bench.winds import simulate_entries
from companion.messages import Spread, Target
from companion.planner import Plan, Problem, plan
from companion.planner.explain import explain
from companion.planner.problem.evaluate import evaluate
from companion.planner.problem.parts import RiskLimit
from companion.planner.problem.value import defect_of, resolved, sigmas_for
from companion.planner.risk import kernels
from companion.planner.risk.chance_constraint import VESSELS_PROMISE_FACTOR, VesselRisk, path_risk, vessel_risk
from companion.traffic.predict import tail_factor
from tests.planner.problem_json import to_dict

SIGMA_M = 70.0


@pytest.mark.parametrize("clearance_m", [0.0, 50.0])
@pytest.mark.parametrize("name", SCENES)
def test_what_is_promised_of_vessels_is_true_of_their_futures(name, clearance_m):
    ships, keep = SCENES[name], keep_of(clearance_m)
    p = problem(ships, keep)
    straight = evaluate(p, [(0.0, 0.0), (900.0, 0.0)])
    found = plan(p, expansions=2000, seed=1)
    assert found.legs
    for legs in (straight.legs, found.legs) if clearance_m == 0.0 else (found.legs,):
        promised = path_risk(p, legs).vessels.total
        share = float(np.mean(met(ships, legs, keep)))
        assert holds(promised, share), (promised, share)
    assert found.vessel_risk < path_risk(p, straight.legs).vessels.total


@pytest.mark.parametrize("off_m", [40.0, 60.0, 80.0, 110.0])
def test_the_promise_binds_and_holds_beside_a_ship_that_crosses(off_m):
    """Behind a ship by a set distance: promises of a per cent to a half, where a third is worth asking for."""
    ships, keep = (ship((450.0 + off_m, 1125.0), 180.0, 5.0),), keep_of()
    p = problem(ships, keep)
    legs = evaluate(p, [(0.0, 0.0), (900.0, 0.0)]).legs
    promised = path_risk(p, legs).vessels.total
    assert promised > 0.01
    assert holds(promised, float(np.mean(met(ships, legs, keep))))


@pytest.mark.parametrize("off_m", [60.0, 110.0])
def test_wind_and_vessels_together_are_within_the_promise(off_m):
    """A reach that the wind may close, behind a ship: either of both happens as often as was promised, or less."""
    ships, keep = (ship((450.0 + off_m, 1125.0), 180.0, 5.0),), keep_of()
    p = problem(ships, keep)
    p = replace(p, wind=replace(p.wind, twd_from_rad=math.radians(28.0)))
    legs = evaluate(p, [(0.0, 0.0), (900.0, 0.0)]).legs
    risk = path_risk(p, legs)
    assert risk.wind > 0.01
    assert risk.vessels.total > 0.01
    forced = simulate_entries(p, legs, winds=6000, step_s=0.5, seed=4) >= 0
    assert holds(risk.total, float(np.mean(forced | met(ships, legs, keep))))


@pytest.mark.parametrize("name", SCENES)
def test_at_no_instant_is_more_risked_than_the_vessels_were_given(name):
    p = problem(SCENES[name], keep_of(20.0))
    found = plan(p, expansions=2000, seed=1)
    assert found.legs
    assert path_risk(p, found).vessels.worst_instant <= p.vessels_share + 1e-6


# ---------------------------------------------------------------------------------------- the shares
def test_the_parts_add_up_to_the_promise():
    p = problem(SCENES["two"], keep_of(), delta_s=0.9)
    assert p.vessels_share == pytest.approx(0.01)
    assert (1.0 - p.wind_delta_s) + p.vessels_share == pytest.approx(0.1)
    assert p.k_delta > replace(p, targets=()).k_delta
    assert resolved(p).delta_s == p.wind_delta_s
    k = tail_factor(0.005)  # two vessels, half of it each
    for target, disc in zip(p.targets, resolved(p).targets, strict=True):
        assert disc.spread is None
        assert disc.radius_m == pytest.approx(target.radius_m + k * target.spread.sigma_m)
        assert disc.growth_mps == pytest.approx(target.growth_mps + k * target.spread.sigma_mps)


def test_without_uncertain_vessels_all_of_it_is_the_winds():
    certain = problem((), keep_of(), targets=(Target(x_m=450.0, y_m=0.0, radius_m=30.0),))
    assert resolved(certain) is certain
    assert certain.wind_delta_s == certain.delta_s
    assert certain.vessels_share == 0.0
    found = plan(certain, expansions=1000, seed=1)
    assert found.vessel_risk == 0.0
    assert path_risk(certain, found).total == path_risk(certain, found).wind


# ----------------------------------------------------------------------------- a path's legs, one after the other
PASSES = 0.5 * (math.erf(20.0 / SIGMA_M / 2.0**0.5) + math.erf(40.0 / SIGMA_M / 2.0**0.5))  # a miss of 10 m, 30 m kept


def leg(from_s, until_s, *, metres=0.0):
    """Return a leg to the north from where the boat lies, of so many metres."""
    first = evaluate(problem((), keep_of()), [(0.0, 0.0), (900.0, 0.0)]).legs[0]
    return replace(first, from_en=(0.0, 0.0), to_en=(0.0, metres), start_s=from_s, end_s=until_s, length_m=metres)


def passing(from_s, until_s, vessel=1, **more):
    """Return a vessel that passes 10 m to the east of the boat's place in the middle of its time; 30 m are kept."""
    start_m = -5.0 * 0.5 * (until_s + from_s)  # where it is at 0 s
    spread = Spread(
        vessel=vessel,
        x_m=10.0,
        y_m=start_m,
        course_rad=0.0,
        keep_m=30.0,
        along_m=5.0,
        across_m=SIGMA_M,
        along_mps=0.0,
        across_mps=0.0,
        own_mps=0.0,
        sigma_m=SIGMA_M,
        sigma_mps=0.0,
    )
    target = Target(x_m=10.0, y_m=start_m, vy_mps=5.0, radius_m=30.0, from_s=from_s, until_s=until_s, spread=spread)
    return replace(target, **more)


def met_by(targets, legs):
    return vessel_risk(replace(problem((), keep_of()), targets=tuple(targets)), legs)


def test_a_vessel_that_comes_by_twice_is_met_twice_and_two_vessels_add_up():
    once = met_by([passing(0.0, 100.0)], [leg(0.0, 300.0)])
    assert once.computed == pytest.approx(PASSES, rel=0.02)
    for second in (passing(100.0, 300.0), passing(0.0, 100.0, vessel=2), passing(100.0, 300.0, vessel=2)):
        both = met_by([passing(0.0, 100.0), second], [leg(0.0, 300.0)])
        assert both.computed == pytest.approx(2.0 * PASSES, rel=0.02)
    assert once.worst_instant == pytest.approx(PASSES, rel=0.02)
    upon_her = passing(100.0, 300.0, x_m=0.0, y_m=0.0, vy_mps=0.0)
    upon_her = replace(upon_her, spread=replace(upon_her.spread, x_m=0.0, y_m=0.0, along_m=SIGMA_M))
    inside = 1.0 - math.exp(-0.5 * (30.0 / SIGMA_M) ** 2)  # of a disc of 30 m about the middle
    turned = met_by([passing(0.0, 100.0), upon_her], [leg(0.0, 300.0)])
    assert turned.computed == pytest.approx(PASSES + inside, rel=0.02)
    assert met_by([passing(0.0, 100.0), passing(0.0, 100.0, vessel=2)], [leg(0.0, 99.0)]).worst_instant == (
        pytest.approx(2.0 * once.worst_instant)
    )


def test_the_leg_on_which_it_comes_by_has_the_risk_and_a_leg_that_never_ends_has_none():
    targets = [passing(0.0, 100.0), passing(100.0, 300.0, vessel=2)]
    legs = [leg(0.0, 100.0), leg(100.0, 300.0)]
    risk = met_by(targets, legs)
    assert risk.legs == pytest.approx((risk.total / 2.0, risk.total / 2.0), rel=0.02)
    assert risk.total == pytest.approx(VESSELS_PROMISE_FACTOR * risk.computed)
    assert risk.by_name == (
        ("vessel 1", pytest.approx(risk.total / 2.0, rel=0.02)),
        ("vessel 2", pytest.approx(risk.total / 2.0, rel=0.02)),
    )
    ended = met_by(targets, [legs[0], leg(100.0, math.inf)])
    assert ended.legs == (pytest.approx(risk.total / 2.0, rel=0.02), 0.0)
    assert met_by(targets, ()).legs == ()
    assert met_by((), legs) == VesselRisk(legs=(0.0, 0.0))


def test_a_boat_that_turns_before_a_leg_lies_there_meanwhile():
    """She turns for a minute in which the vessel comes by, and is sixty metres on when it would have come else."""
    turning = met_by([passing(0.0, 60.0)], [leg(60.0, 120.0, metres=600.0)])
    assert turning.computed == pytest.approx(PASSES, rel=0.02)
    assert met_by([passing(60.0, 120.0)], [leg(60.0, 120.0, metres=600.0)]).computed < 0.01


@pytest.mark.parametrize("part", [0.0, 0.31, -0.1, math.nan])
def test_a_part_that_is_not_within_the_promise_is_refused(part):
    assert defect_of(problem(SCENES["crossing"], keep_of(), vessels_part=part))


def test_a_spread_that_is_not_finite_is_refused():
    p = problem(SCENES["two"], keep_of())
    first = replace(p.targets[0], spread=replace(p.targets[0].spread, along_m=math.nan))
    assert "targets" in defect_of(replace(p, targets=(first, *p.targets[1:])))


def test_the_json_form_keeps_spread_and_part():
    p = problem(SCENES["two"], keep_of(), vessels_part=0.02)
    again = Problem.from_json(to_dict(p))
    assert again.vessels_part == 0.02
    for a, b in zip(p.targets, again.targets, strict=True):
        assert b.spread.numbers == pytest.approx(a.spread.numbers)
        assert b.spread.vessel == a.spread.vessel


def test_the_plan_says_what_its_promise_is_made_of():
    p = problem(SCENES["crossing"], keep_of(), delta_s=0.9)
    found = plan(p, expansions=2000, seed=1)
    risk = path_risk(p, found)
    assert found.risk == pytest.approx(min(1.0, risk.wind + risk.vessels.total))
    assert found.vessel_risk == risk.vessels.total
    for why in (found.why, explain(p, found, expansions=200).why):
        assert "vessels" in why.text
        assert why.data["risk"]["wind"] == risk.wind
        assert why.data["risk"]["vessels"] == risk.vessels.total
        assert why.data["risk"]["instant_wind"] + why.data["risk"]["instant_vessels"] == pytest.approx(0.1)
    assert Plan.from_dict(found.to_dict()).vessel_risk == found.vessel_risk


def test_a_limit_on_the_path_holds_wind_and_vessels_together():
    p = problem(SCENES["turning"], keep_of(), risk=RiskLimit(max_path_risk=0.004))
    free = plan(replace(p, risk=None), expansions=2000, seed=1)
    assert free.vessel_risk > 0.004
    held = plan(p, expansions=16_000, seed=1)
    assert held.has_path
    assert held.risk <= 0.004
    assert held.cost_s > free.cost_s


# --------------------------------------------------------------------------------------- the kernels
def covariance(rows):
    out = np.empty(9)
    kernels.spread_at(0.0, np.array(rows), out)
    return out


@settings(max_examples=100)
@given(
    st.floats(0.0, 2.0 * math.pi),
    st.floats(0.0, math.pi),
    st.floats(1.0, 80.0),
    st.floats(0.05, 1.0),
    st.floats(5.0, 200.0),
    st.sampled_from([1e-4, 1e-3, 1e-2, 0.1]),
)
def test_outside_its_disc_a_vessel_is_met_with_its_part_at_most(bearing, axis, sigma, narrow, keep, part):
    s, c = math.sin(axis), math.cos(axis)
    spread = covariance([[s, c, sigma, 0.0], [c, -s, narrow * sigma, 0.0]])
    away = keep + sigmas_for(part, 1) * math.hypot(sigma, kernels.LEAST_SIGMA_M)
    assert kernels.inside(away * math.sin(bearing), away * math.cos(bearing), spread, keep) <= part * 1.001


@pytest.mark.parametrize(("keep", "sigma"), [(10.0, 10.0), (30.0, 5.0), (5.0, 40.0)])
def test_the_share_inside_a_disc_in_closed_form(keep, sigma):
    var = sigma * sigma + kernels.LEAST_SIGMA_M**2
    spread = covariance([[1.0, 0.0, sigma, 0.0], [0.0, 1.0, sigma, 0.0]])
    assert kernels.inside(0.0, 0.0, spread, keep) == pytest.approx(1.0 - math.exp(-0.5 * keep * keep / var), rel=1e-3)


@pytest.mark.parametrize("miss", [0.0, 30.0, 60.0, 90.0])
def test_a_straight_passage_in_closed_form(miss):
    """An error that does not grow: the disc is met when the miss distance's normal falls within it."""
    sigma, keep = 20.0, 50.0
    errors = np.array([[1.0, 0.0, sigma, 0.0], [0.0, 1.0, sigma, 0.0]])
    out = np.empty(3)
    kernels.piece(0.0, 400.0, miss, -1000.0, 0.0, 5.0, errors, keep, -1.0, out)
    s = math.hypot(sigma, kernels.LEAST_SIGMA_M) * math.sqrt(2.0)
    exact = 0.5 * (math.erf((keep - miss) / s) + math.erf((keep + miss) / s))
    assert out[0] == pytest.approx(exact, rel=1e-2)
    assert out[1] == 0.0
