"""Three algorithms, one answer: every one of them on the same fixtures, judged by the exact scorer."""

import json
from pathlib import Path

import numpy as np
import pytest

from companion.errors import InputError
from companion.planner import ALGORITHMS, PlanStatus, Problem, plan
from companion.planner.problem.evaluate import evaluate
from companion.planners import AstarSettings, RrtstarSettings

PROBLEMS = Path(__file__).resolve().parents[2] / "sailbench" / "problems"
# For each: expansions that suffice; with them the tests do not depend on how busy the machine is.
EFFORT = {"auto": 30_000, "rrtstar": 8000, "astar": 2_000_000}


def fixture(name):
    raw = json.loads((PROBLEMS / f"{name}.json").read_text(encoding="utf-8"))
    return Problem.from_json(raw)


def run(problem, algorithm, **more):
    return plan(problem, algorithm=algorithm, expansions=EFFORT[algorithm], **more)


@pytest.mark.parametrize(("algorithm", "settings"), [("auto", AstarSettings()), ("astar", RrtstarSettings())])
def test_the_numbers_of_another_planner_are_refused(algorithm, settings):
    with pytest.raises(InputError, match="is not for"):
        plan(fixture("open-reach"), algorithm=algorithm, settings=settings)


@pytest.mark.parametrize("name", ["open-beat", "open-reach", "open-run", "avalon-reach", "avalon-run", "four-run"])
@pytest.mark.parametrize("algorithm", ALGORITHMS)
def test_each_finds_a_path_that_the_scorer_passes(algorithm, name):
    p = fixture(name)
    answer = run(p, algorithm)
    assert answer.has_path, answer.reason
    judged = evaluate(p, answer.waypoints_en)
    assert judged.is_feasible, judged.reasons
    assert answer.cost_s == pytest.approx(judged.time_s)
    assert answer.lower_bound_s <= answer.cost_s
    assert len(answer.legs) == len(judged.legs)


@pytest.mark.parametrize("name", ["open-reach", "avalon-reach", "four-run"])
def test_they_agree_on_the_simple_cases(name):
    p = fixture(name)
    cost = {a: run(p, a).cost_s for a in ALGORITHMS}
    assert cost["auto"] <= cost["rrtstar"] * 1.001
    assert cost["auto"] <= cost["astar"] * 1.001
    assert cost["rrtstar"] <= 1.06 * cost["auto"]
    assert cost["astar"] <= 1.35 * cost["auto"]


def test_no_algorithm_beats_the_bound_of_another():
    for name in ("open-beat", "four-run", "avalon-reach"):
        p = fixture(name)
        answers = [run(p, a) for a in ALGORITHMS]
        assert min(a.cost_s for a in answers) >= max(a.lower_bound_s for a in answers) * (1.0 - 1e-9)


@pytest.mark.parametrize("algorithm", ALGORITHMS)
def test_a_start_ashore_and_nonsense_are_invalid_for_all(algorithm):
    assert run(fixture("start-ashore"), algorithm).status is PlanStatus.INVALID
    raw = json.loads((PROBLEMS / "open-beat.json").read_text(encoding="utf-8"))
    raw["wind"]["speed_mps"] = 0.0
    assert run(Problem.from_json(raw), algorithm).status is PlanStatus.INVALID


@pytest.mark.parametrize("algorithm", ALGORITHMS)
def test_none_finds_a_way_through_a_wall(algorithm):
    answer = run(fixture("walled-goal"), algorithm)
    assert not answer.has_path
    assert answer.reason


@pytest.mark.parametrize("algorithm", [name for name in ALGORITHMS if name != "auto"])
def test_a_budget_of_expansions_and_a_seed_give_the_same_plan_twice(algorithm):
    p = fixture("four-run")
    a, b = (plan(p, algorithm=algorithm, expansions=min(20_000, 4 * EFFORT[algorithm]), seed=11) for _ in range(2))
    assert np.array_equal(a.waypoints_en, b.waypoints_en)
    assert a.expansions == b.expansions


def square(x, y, half=20):
    a, b, c, d = x - half, x + half, y - half, y + half
    return f"POLYGON(({a} {c},{b} {c},{b} {d},{a} {d},{a} {c}))"


NASTY = {
    "goal radius zero": {"goal": {"x": 0, "y": 200, "radius": 0}},
    "a million metres": {"goal": {"x": 1e6, "y": 1e6, "radius": 10}},
    "self-intersecting": {"obstacles": ["POLYGON((-50 50,50 150,50 50,-50 150,-50 50))"]},
    "overlapping": {"obstacles": [square(-20 + i, 100) for i in range(40)]},
    "slivers": {"obstacles": [f"POLYGON((-90 {y},90 {y},90 {y + 0.001},-90 {y}))" for y in range(50, 150)] * 15},
    "a millimetre off": {"obstacles": ["POLYGON((0.001 -50,50 -50,50 50,0.001 50,0.001 -50))"]},
    "touching": {"obstacles": ["POLYGON((0 -50,50 -50,50 50,0 50,0 -50))"]},
    "fence without room": {"fence": "POLYGON((-1 -1,1 -1,1 201,-1 201,-1 -1))"},
    "no-go of 180": {
        "boat": {
            "no_go_half_deg": 180,
            "max_twa_deg": 180,
            "turn_rate_rad_s": 1,
            "speed": {"model": "constant", "v_mps": 1},
        }
    },
    "polar of zeros": {
        "boat": {
            "no_go_half_deg": 45,
            "max_twa_deg": 180,
            "turn_rate_rad_s": 1,
            "speed": {"model": "polar", "twa_deg": [0, 180], "v_mps": [0, 0]},
        }
    },
    "current above speed": {"current": {"set_deg": 180, "drift_mps": 9}},
    "risk of nothing": {"risk": {"max_path_risk": 1e-9}},
    "start is goal": {"goal": {"x": 0, "y": 0, "radius": 5}},
}


@pytest.mark.parametrize("name", NASTY)
@pytest.mark.parametrize("algorithm", [name for name in ALGORITHMS if name != "auto"])
def test_bad_input_is_a_plan_or_a_reason_within_the_budget(algorithm, name):
    p = Problem.from_json(
        {
            "id": "n",
            "title": "",
            "start": {"x": 0, "y": 0, "heading_deg": 0},
            "goal": {"x": 0, "y": 200, "radius": 5},
            "obstacles": [],
            "fence": None,
            "delta_s": 0.7,
            "wind": {
                "from_deg": 60,
                "speed_mps": 5,
                "sigma": {"model": "ar1", "sigma0_deg": 2, "sigma_inf_deg": 8, "rho_hz": 0.03},
            },
            "boat": {
                "no_go_half_deg": 45,
                "max_twa_deg": 180,
                "turn_rate_rad_s": 0.5,
                "speed": {"model": "constant", "v_mps": 1.5},
            },
            **NASTY[name],
        }
    )
    answer = plan(p, algorithm=algorithm, expansions=min(200_000, EFFORT[algorithm] // 4))
    assert answer.reason
    if answer.has_path:
        assert evaluate(p, answer.waypoints_en).is_feasible
    if name == "polar of zeros":
        assert answer.status is PlanStatus.INVALID
