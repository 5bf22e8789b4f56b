"""The exact scorer against worked examples, and against the format's own definition where that is at hand."""

from __future__ import annotations

import functools
import importlib.util
import math
import os
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.planner import Problem
from companion.planner.problem.evaluate import evaluate
from tests.planner.problems import FOLDER, box, load, random_problems, simple


def test_one_tack_by_hand():
    p = Problem.from_json(simple(goal={"x": 0, "y": 100, "radius": 0}))
    e = evaluate(p, [[0, 0], [50, 50], [0, 100]])
    assert e.is_feasible
    assert e.tacks == 1
    assert e.gybes == 0
    assert e.turn_s == pytest.approx((math.pi / 4 + math.pi / 2) / 0.5)
    assert e.time_s == pytest.approx(2 * math.hypot(50, 50) / 1.5 + e.turn_s)
    assert e.legs[0].start_s == pytest.approx(math.pi / 4 / 0.5)


def test_what_breaks_a_rule_is_named():
    p = Problem.from_json(simple(obstacles=[box(20, 40, 80, 60)], fence=box(-60, -10, 90, 120)))
    assert "no-go" in evaluate(p, [[0, 0], [0, 99]]).reasons[0]
    assert any("collides" in r for r in evaluate(p, [[0, 0], [50, 50], [0, 100]]).reasons)
    assert any("collides" in r for r in evaluate(p, [[0, 0], [-70, 70], [0, 100]]).reasons)
    assert "last waypoint" in evaluate(p, [[0, 0], [50, 10]]).reasons[0]
    assert "first waypoint" in evaluate(p, [[1, 0], [-50, 50], [0, 100]]).reasons[0]
    assert evaluate(p, [[0, 0], [-50, 50], [0, 100]]).is_feasible
    assert evaluate(p, np.empty((0, 2))).reasons == ("no path",)


def test_late_legs_meet_a_wider_zone():
    sigma = {"model": "kalman", "sigma0_deg": 0, "growth_deg_per_sqrt_s": 1.0}
    p = Problem.from_json(simple(delta_s=0.8, wind={"from_deg": 0, "sigma": sigma}))
    assert not evaluate(p, [[0, 0], [50, 50], [0, 100]]).is_feasible
    e = evaluate(p, [[0, 0], [80, 50], [0, 100]])
    assert e.is_feasible
    assert e.legs[1].no_go_half_rad > e.legs[0].no_go_half_rad > p.boat.no_go_half_rad


def test_touching_is_allowed_and_a_millimetre_more_is_not():
    p = Problem.from_json(simple(goal={"x": 0, "y": -100, "radius": 1}, obstacles=[box(0, -80, 50, -20)]))
    assert evaluate(p, [[0, 0], [0, -100]]).is_feasible
    inside = Problem.from_json(simple(goal={"x": 0, "y": -100, "radius": 1}, obstacles=[box(-0.003, -80, 50, -20)]))
    assert not evaluate(inside, [[0, 0], [0, -100]]).is_feasible


def test_a_moving_target_is_met_only_at_its_time():
    def crossing(y):
        target = {"x": -60, "y": y, "vx": 1.0, "vy": 0, "radius_m": 10}
        return Problem.from_json(simple(goal={"x": 0, "y": -150, "radius": 1}, targets=[target]))

    turn = math.pi / 0.5
    meet = -1.5 * (60 - turn)  # where the boat is when the target crosses its track
    assert not evaluate(crossing(meet), [[0, 0], [0, -150]]).is_feasible
    assert evaluate(crossing(meet - 40), [[0, 0], [0, -150]]).is_feasible


def test_a_current_sets_the_boat_and_its_heading_holds_against_it():
    p = Problem.from_json(simple(goal={"x": 0, "y": -150, "radius": 1}, current={"set_deg": 90, "drift_mps": 0.5}))
    leg = evaluate(p, [[0, 0], [0, -150]]).legs[0]
    assert leg.speed_mps == pytest.approx(math.sqrt(1.5**2 - 0.5**2))
    assert leg.heading_rad == pytest.approx(math.pi + math.asin(0.5 / 1.5))


def test_losses_are_paid_once_per_manoeuvre():
    boat = simple()["boat"] | {"tack_loss_s": 7.0, "gybe_loss_s": 3.0}
    with_loss, without = Problem.from_json(simple(boat=boat)), Problem.from_json(simple())
    tack = [[0, 0], [50, 50], [0, 100]]
    assert evaluate(with_loss, tack).time_s == pytest.approx(evaluate(without, tack).time_s + 7.0)
    gybe = [[0, 0], [30, -40], [0, -80]]
    assert evaluate(with_loss, gybe).time_s == pytest.approx(evaluate(without, gybe).time_s + 3.0)


# ------------------------------------------------------------------------ against the definition
SCORER = os.environ.get("COMPANION_SCORE_PLAN")  # path of the format's score_plan.py
needs_scorer = pytest.mark.skipif(not SCORER or not Path(SCORER).exists(), reason="COMPANION_SCORE_PLAN is not set")


@functools.cache
def definition():
    spec = importlib.util.spec_from_file_location("score_plan", SCORER)
    module = importlib.util.module_from_spec(spec)
    sys.modules["score_plan"] = module
    spec.loader.exec_module(module)
    return module


@needs_scorer
@settings(max_examples=150)
@given(random_problems(), st.lists(st.tuples(st.floats(-150, 150), st.floats(-40, 380)), max_size=5))
def test_agrees_with_the_definition_on_random_paths(raw, middle):
    scorer = definition()
    path = [[0.0, 0.0], *map(list, middle), [raw["goal"]["x"], raw["goal"]["y"]]]
    ours, theirs = evaluate(Problem.from_json(raw), path), scorer.evaluate(scorer.Problem.from_dict(raw), path)
    assert ours.is_feasible == theirs["feasible"]
    assert ours.time_s == pytest.approx(theirs["time_s"], rel=1e-12)
    assert len(ours.reasons) == len(theirs["reasons"])
    assert ours.tacks + ours.gybes == theirs["n_tacks"] + theirs["n_gybes"]  # a turn of 180 is either


@needs_scorer
@pytest.mark.parametrize("name", ["avalon-beat", "four-beat-60", "islands-150-dense", "channel-bend-kalman"])
def test_agrees_with_the_definition_on_plans(name):
    from companion.planner import plan

    scorer = definition()
    answer = plan(load(name), expansions=40_000)
    theirs = scorer.evaluate(scorer.Problem.load(FOLDER / f"{name}.json"), answer.waypoints_en)
    assert theirs["feasible"], theirs["reasons"]
    assert answer.cost_s == pytest.approx(theirs["time_s"], rel=1e-12)


def test_a_leg_with_the_wind_over_the_starboard_side_has_a_positive_twa():
    """Wind from north, heading north-west: the wind comes over the starboard side (house rule 2)."""
    from companion.planner import Problem

    p = Problem.from_json(
        {
            "start": {"x": 0, "y": 0, "heading_deg": 0},
            "goal": {"x": -100, "y": 100, "radius": 1},
            "obstacles": [],
            "fence": None,
            "wind": {"from_deg": 0, "speed_mps": 5, "sigma": {"model": "none"}},
            "delta_s": 0.5,
            "boat": {
                "no_go_half_deg": 40,
                "max_twa_deg": 180,
                "turn_rate_rad_s": 1,
                "speed": {"model": "constant", "v_mps": 1},
            },
        }
    )
    assert math.degrees(evaluate(p, [[0, 0], [-100, 100]]).legs[0].twa_rad) == pytest.approx(45.0)
    assert math.degrees(evaluate(p, [[0, 0], [100, 100]]).legs[0].twa_rad) == pytest.approx(-45.0)
