"""Courses: many legs that bend with a growing no-go zone are told as the few that a crew steers."""

import json
import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from companion import cli
from companion.commands.plan import describe
from companion.planner import Problem, plan
from companion.planner.courses import BEND_RAD, courses
from companion.planner.explain import explain, with_clearance
from companion.planner.problem.evaluate import evaluate

MISSIONS = Path(__file__).parents[2] / "missions"
GROWING = {
    "id": "growing",
    "title": "",
    "start": {"x": 0, "y": 0, "heading_deg": 45},
    "goal": {"x": 0, "y": 450, "radius": 5},
    "obstacles": [],
    "fence": None,
    "wind": {
        "from_deg": 0,
        "speed_mps": 5,
        "sigma": {"model": "kalman", "sigma0_deg": 2.0, "growth_deg_per_sqrt_s": 1.0},
    },
    "boat": {
        "no_go_half_deg": 45,
        "max_twa_deg": 180,
        "turn_rate_rad_s": 0.5,
        "speed": {"model": "constant", "v_mps": 2.0},
    },
    "delta_s": 0.8,
}


@pytest.fixture(scope="module")
def bent():
    """A plan of many legs close-hauled on two tacks, each bearing away as its zone grows, with corners of 0 m."""
    problem = Problem.from_json(GROWING)
    way, t_s = [(0.0, 0.0)], 0.0
    for side in (1.0, -1.0):
        for _ in range(40):
            angle = problem.no_go_half_rad(t_s + 8.0)
            length = 4.0
            way.append((way[-1][0] + side * length * math.sin(angle), way[-1][1] + length * math.cos(angle)))
            t_s += length / 2.0
        way.append((way[-1][0] + 1e-4 * side, way[-1][1] + 1e-4))
    answer = plan(problem, expansions=500)
    points = np.array(way)
    return problem, with_clearance(problem, replace(answer, legs=evaluate(problem, points).legs, waypoints_en=points))


def test_many_legs_are_few_courses(bent):
    answer = bent[1]
    assert len(answer.legs) > 75
    merged = courses(answer.legs)
    assert 2 <= len(merged) <= 4
    assert [leg for course in merged for leg in course.legs] == list(answer.legs)
    assert all(k.manoeuvre == "" for course in merged for k in course.legs[1:])
    first = merged[0].headings_rad
    assert first[1] - first[0] > BEND_RAD  # it bends far, a little at a time


def test_the_words_and_the_table_name_courses_and_their_ranges(bent):
    problem, answer = bent
    explained = explain(problem, answer, expansions=500)
    text = describe(problem, explained)
    rows = [line for line in text.splitlines() if re.match(r" +\d+ +\d", line)]
    assert len(rows) == len(courses(answer.legs))
    assert re.search(r"\d+\.\d\.\.\d+\.\d°", rows[0])
    assert not any("  0 m" in row for row in rows)
    assert f"({len(answer.legs)} legs)" in text
    assert f"{len(answer.legs)} legs make {len(rows)} courses" in explained.why.text
    assert len(explained.why.text) < 900
    assert explained.why.data["courses"][-1][1] == len(answer.legs)


def test_a_tack_begins_a_course():
    problem = Problem.from_json({**GROWING, "wind": {**GROWING["wind"], "sigma": {"model": "none"}}})
    answer = plan(problem, expansions=3000)
    assert len(courses(answer.legs)) == len(answer.legs)


def test_a_mission_is_planned_and_explained_from_goal_to_goal(capsys, tmp_path):
    out = tmp_path / "plans.json"
    course = str(MISSIONS / "buoy-course.toml")
    assert (
        cli.main(
            [
                "plan",
                course,
                "--expansions",
                "3000",
                "--explain",
                "--explain-budget",
                "0.2",
                "--wind",
                "6@20",
                "--out",
                str(out),
            ]
        )
        == 0
    )
    text = capsys.readouterr().out
    assert text.count("above the bound") == 3
    assert "Straight there" in text or "close-hauled" in text
    plans = json.loads(out.read_text())
    assert [p["problem"] for p in plans] == ["buoy-course"] * 3
    ends = [(p["waypoints"][0], p["waypoints"][-1]) for p in plans]
    assert ends[1][0] == pytest.approx(ends[0][1])
    assert cli.main(["plan", course, "--expansions", "3000", "--plot", str(tmp_path / "p.png")]) == 2
    assert "mission check --plot" in capsys.readouterr().err
    assert cli.main(["plan", str(Path("sailbench/problems/open-beat.json").resolve()), "--wind", "5@0"]) == 2
