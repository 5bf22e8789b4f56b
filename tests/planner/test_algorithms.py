"""Three algorithms, one answer: every one of them on the same fixtures, judged by the exact scorer."""

import json
from pathlib import Path

import numpy as np
import pytest

from companion.planner import ALGORITHMS, PlanStatus, Problem, plan

PROBLEMS = Path(__file__).resolve().parents[2] / "bench" / "problems"
# For each: expansions that suffice, and what its cost may be over the bound that auto proves.
EFFORT = {"auto": None, "rrtstar": 8000, "astar": 2_000_000}


def fixture(name):
    raw = json.loads((PROBLEMS / f"{name}.json").read_text(encoding="utf-8"))
    return Problem.from_json(raw)


def run(problem, algorithm, **more):
    if EFFORT[algorithm] is None:
        return plan(problem, algorithm=algorithm, budget_s=0.3, **more)
    return plan(problem, algorithm=algorithm, expansions=EFFORT[algorithm], **more)


@pytest.mark.parametrize("name", ["open-beat", "open-reach", "open-run", "avalon-reach", "avalon-run", "four-run"])
@pytest.mark.parametrize("algorithm", ALGORITHMS)
def test_each_finds_a_path_that_the_scorer_passes(algorithm, name):
    p = fixture(name)
    answer = run(p, algorithm)
    assert answer.has_path, answer.reason
    judged = p.evaluate(answer.waypoints_en)
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


@pytest.mark.parametrize("algorithm", ["rrtstar", "astar"])
def test_a_budget_of_expansions_and_a_seed_give_the_same_plan_twice(algorithm):
    p = fixture("four-run")
    a, b = (plan(p, algorithm=algorithm, expansions=20_000, seed=11) for _ in range(2))
    assert np.array_equal(a.waypoints_en, b.waypoints_en)
    assert a.expansions == b.expansions
