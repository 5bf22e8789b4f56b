"""Uncertain vessels share the wind's promise: the discs keep it at each instant, the path's risk is true of futures."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.planner import Plan, Problem, plan
from companion.planner import vessel_kernels as kernels
from companion.planner.explain import explain
from companion.planner.problem import BoatLimits, RiskLimit, Sigma, Target, Wind
from companion.planner.risk import path_risk
from companion.planner.vessels import part_of, sigmas_for
from companion.traffic.occupancy import Keep, planning_discs
from companion.traffic.predict import manoeuvre_s2, motion_of, predict, tail_factor
from tests.traffic.conftest import vessel

HORIZON_S = 450.0
FUTURES = 6000
SMALL = (5.0, 5.0, 2.0, 2.0)
SHIPS = {
    "crossing": [vessel((450.0, 1125.0), 180.0, 5.0)],
    "crossing slowly": [vessel((450.0, 225.0), 180.0, 1.0, size=SMALL, is_class_b=True)],
    "overtaking": [vessel((-900.0, 0.0), 90.0, 6.0)],
    "overtaken": [vessel((150.0, 0.0), 90.0, 1.0, size=SMALL)],
    "two": [vessel((450.0, 1125.0), 180.0, 5.0), vessel((600.0, -900.0), 0.0, 3.0, mmsi=5)],
    "turning": [vessel((450.0, 300.0), 180.0, 2.0, turn_rate_radps=math.radians(0.5), size=SMALL)],
}


def keep_of(clearance_m=0.0):
    return Keep(sigmas=0.0, clearance_m=clearance_m, own_radius_m=1.0, own_timing_mps=0.1, horizon_s=HORIZON_S)


def problem(ships, keep, delta_s=0.7, **change):
    targets = tuple(Target(
        x_m=d.x_m, y_m=d.y_m, vx_mps=d.vx_mps, vy_mps=d.vy_mps, radius_m=d.radius_m, growth_mps=d.growth_mps,
        from_s=d.from_s, until_s=d.until_s, name=d.name, spread=d.spread) for d in planning_discs(ships, 0.0, keep))
    values = {
        "start_en": (0.0, 0.0), "start_heading_rad": math.pi / 2, "goal_en": (900.0, 0.0), "goal_radius_m": 10.0,
        "wind": Wind(twd_from_rad=0.0, tws_mps=5.0, sigma=Sigma(
            model="ar1", sigma0_rad=0.05, sigma_inf_rad=0.1, rho_hz=0.03)),
        "boat": BoatLimits(no_go_half_rad=math.radians(45.0), turn_rate_radps=0.5, polar_twa_rad=(0.0, math.pi),
                           polar_mps=(2.0, 2.0)),
        "delta_s": delta_s, "targets": targets,
    }
    return Problem(**(values | change))


def share_met(ships, legs, keep, n=FUTURES, seed=3):
    """The share of futures in which the boat comes nearer than ``keep``.

    Drawn from what is stated of vessels (``Motion``: each error one draw for the whole future, the course followed as
    ``predict`` does) and of our own pace; no code of the planner.
    """
    rng = np.random.default_rng(seed)
    met, late = np.zeros(n, dtype=bool), rng.standard_normal(n) * keep.own_timing_mps
    t = np.arange(0.0, min(HORIZON_S, legs[-1].end_s), 1.0)
    when = np.array([0.0, *(s for leg in legs for s in (leg.start_s, leg.end_s))])
    place = np.array([legs[0].from_en, *(p for leg in legs for p in (leg.from_en, leg.to_en))])
    run = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(place, axis=0).T))])
    sailed = np.clip(np.interp(t, when, run)[None, :] + late[:, None] * t[None, :], 0.0, run[-1])
    way, first = np.unique(run, return_index=True)
    east, north = np.interp(sailed, way, place[first, 0]), np.interp(sailed, way, place[first, 1])
    for ship in ships:
        m, draw = motion_of(ship), rng.standard_normal((6, n))
        near_m = ship.reach_m + keep.own_radius_m + keep.clearance_m
        for k, at in enumerate(t):
            there, tau = predict(ship, at, m), max(0.0, at - ship.t_s)
            held = manoeuvre_s2(tau, m.hold_s)
            along = m.position_m * draw[0] + m.speed_mps * tau * draw[1] + m.accel_mps2 * held * draw[2]
            across = m.position_m * draw[3] + ship.speed_mps * (
                m.course_rad * tau * draw[4] + m.turn_radps * held * draw[5])
            s, c = math.sin(there.course_rad), math.cos(there.course_rad)
            x, y = there.mean_en_m[0] + along * s + across * c, there.mean_en_m[1] + along * c - across * s
            met |= np.hypot(east[:, k] - x, north[:, k] - y) < near_m
    return float(np.mean(met))


def holds(promised, share):
    """At most what was promised, and where it binds (1 %) not less than a third of it."""
    noise = 3.0 * math.sqrt(max(promised, 1.0 / FUTURES) / FUTURES)
    return share <= promised + (noise if promised < 0.01 else 0.0) and (promised < 0.01 or share >= promised / 3.0)


@pytest.mark.parametrize("clearance_m", [0.0, 50.0])
@pytest.mark.parametrize("name", SHIPS)
def test_what_is_promised_of_vessels_is_true_of_their_futures(name, clearance_m):
    ships, keep = SHIPS[name], keep_of(clearance_m)
    p = problem(ships, keep)
    straight = p.evaluate([(0.0, 0.0), (900.0, 0.0)])
    found = plan(p, expansions=2000, seed=1)
    assert found.legs
    for legs in (straight.legs, found.legs) if clearance_m == 0.0 else (found.legs,):
        promised = path_risk(p, legs).vessels.total
        share = share_met(ships, legs, keep)
        assert holds(promised, share), (promised, share)
    assert found.vessel_risk < path_risk(p, straight.legs).vessels.total


@pytest.mark.parametrize("off_m", [40.0, 60.0, 80.0, 110.0])
def test_the_promise_binds_and_holds_beside_a_ship_that_crosses(off_m):
    """Behind a ship by a set distance: promises of a per cent to a half, where a third is worth asking for."""
    ships = [vessel((450.0 + off_m, 1125.0), 180.0, 5.0)]
    keep = keep_of()
    p = problem(ships, keep)
    legs = p.evaluate([(0.0, 0.0), (900.0, 0.0)]).legs
    promised = path_risk(p, legs).vessels.total
    assert promised > 0.01
    assert holds(promised, share_met(ships, legs, keep))


@pytest.mark.parametrize("name", SHIPS)
def test_at_no_instant_is_more_risked_than_the_vessels_were_given(name):
    p = problem(SHIPS[name], keep_of(20.0))
    found = plan(p, expansions=2000, seed=1)
    assert found.legs
    assert path_risk(p, found).vessels.worst_instant <= part_of(p) + 1e-6


# ---------------------------------------------------------------------------------------- the shares
def test_the_parts_add_up_to_the_promise():
    p = problem(SHIPS["two"], keep_of(), delta_s=0.9)
    assert part_of(p) == pytest.approx(0.01)
    assert (1.0 - p.wind_delta_s) + part_of(p) == pytest.approx(0.1)
    assert p.k_delta > replace(p, targets=()).k_delta
    assert p.resolved.delta_s == p.wind_delta_s
    k = tail_factor(0.005)                                  # two vessels, half of it each
    for target, disc in zip(p.targets, p.resolved.targets, strict=True):
        assert disc.spread is None
        assert disc.radius_m == pytest.approx(target.radius_m + k * target.spread.sigma_m)
        assert disc.growth_mps == pytest.approx(target.growth_mps + k * target.spread.sigma_mps)


def test_without_uncertain_vessels_all_of_it_is_the_winds():
    certain = problem((), keep_of(), targets=(Target(x_m=450.0, y_m=0.0, radius_m=30.0),))
    assert certain.resolved is certain
    assert certain.wind_delta_s == certain.delta_s
    assert part_of(certain) == 0.0
    found = plan(certain, expansions=1000, seed=1)
    assert found.vessel_risk == 0.0
    assert path_risk(certain, found).total == path_risk(certain, found).wind


@pytest.mark.parametrize("part", [0.0, 0.31, -0.1, math.nan])
def test_a_part_that_is_not_within_the_promise_is_refused(part):
    assert problem(SHIPS["crossing"], keep_of(), vessels_part=part).defect


def test_a_spread_that_is_not_finite_is_refused():
    p = problem(SHIPS["two"], keep_of())
    first = replace(p.targets[0], spread=replace(p.targets[0].spread, along_m=math.nan))
    assert "targets" in replace(p, targets=(first, *p.targets[1:])).defect


def test_the_json_form_keeps_spread_and_part():
    p = problem(SHIPS["two"], keep_of(), vessels_part=0.02)
    again = Problem.from_json(p.to_dict())
    assert again.vessels_part == 0.02
    for a, b in zip(p.targets, again.targets, strict=True):
        assert b.spread.numbers == pytest.approx(a.spread.numbers)
        assert b.spread.vessel == a.spread.vessel


def test_the_plan_says_what_its_promise_is_made_of():
    p = problem(SHIPS["crossing"], keep_of(), delta_s=0.9)
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
    p = problem(SHIPS["turning"], keep_of(), risk=RiskLimit(max_path_risk=0.004))
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


@settings(max_examples=100, deadline=None, derandomize=True)
@given(st.floats(0.0, 2.0 * math.pi), st.floats(0.0, math.pi), st.floats(1.0, 80.0), st.floats(0.05, 1.0),
       st.floats(5.0, 200.0), st.sampled_from([1e-4, 1e-3, 1e-2, 0.1]))
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
