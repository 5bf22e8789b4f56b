"""``companion plan`` as a user meets it: exit codes, files, one-line errors."""

import json
import math
import re
from dataclasses import replace

import msgspec
import pytest

from companion import cli
from companion.geofence import load_mission
from companion.mission_check import AssumedWind, leg_problem
from companion.planner import ALGORITHMS, Problem, plan
from companion.planner.problem.evaluate import evaluate
from companion.plots import plan as plan_picture
from tests.planner.problem_json import to_dict

GOOD = {
    "id": "pond",
    "title": "Across the pond",
    "start": {"x": 0, "y": 0, "heading_deg": 0},
    "goal": {"x": 0, "y": 200, "radius": 5},
    "obstacles": ["POLYGON((-20 80,30 80,30 120,-20 120,-20 80))"],
    "fence": None,
    "wind": {
        "from_deg": 30,
        "speed_mps": 5,
        "sigma": {"model": "ar1", "sigma0_deg": 2, "sigma_inf_deg": 6, "rho_hz": 0.03},
    },
    "boat": {
        "no_go_half_deg": 45,
        "max_twa_deg": 180,
        "turn_rate_rad_s": 0.5,
        "speed": {"model": "constant", "v_mps": 1.5},
    },
    "delta_s": 0.7,
}


@pytest.fixture
def file(tmp_path):
    def write(**change):
        path = tmp_path / "problem.json"
        path.write_text(json.dumps({**GOOD, **change}), encoding="utf-8")
        return str(path)

    return write


def run(capsys, *args):
    code = cli.main(["plan", *map(str, args)])
    out, err = capsys.readouterr()
    return code, out, err


@pytest.mark.parametrize("algorithm", ALGORITHMS)
def test_it_prints_a_summary_and_writes_a_plan_that_scores(capsys, file, tmp_path, algorithm):
    out_file = tmp_path / "plan.json"
    code, out, err = run(capsys, file(), "--budget", "0.5", "--algorithm", algorithm, "--out", out_file)
    assert code == 0, out + err
    assert "above the bound" in out
    assert "off the plan: the wind forces the boat" in out
    assert str(out_file) in out
    written = json.loads(out_file.read_text(encoding="utf-8"))
    assert all(len(w) == 2 for w in written["waypoints"])
    judged = evaluate(Problem.from_json(file()), written["waypoints"])
    assert judged.is_feasible, judged.reasons
    assert judged.time_s == pytest.approx(written["cost_s"])
    assert written["risk"] is not None
    assert all(leg["clearance_m"] is not None for leg in written["legs"])


@pytest.mark.parametrize(
    ("targets", "words"),
    [
        ([{"radius_m": 20, "until_s": 900}], "water that is closed for a time"),
        ([{"radius_m": 20, "vy": 0.1}], "vessels"),
        ([{"radius_m": 20, "vx": -0.1}, {"radius_m": 20}], "vessels and water that is closed for a time"),
    ],
)
def test_what_is_in_the_way_for_a_time_is_named_as_unknown_to_the_bound(capsys, file, targets, words):
    """ "58.6 % above the bound" was said of the best way round a bar that had dried."""
    at = [{"x": 40.0 * n, "y": 160.0, **t} for n, t in enumerate(targets)]
    code, out, err = run(capsys, file(targets=at), "--expansions", "2000")
    assert code == 0, err
    assert re.search(rf"% above the bound of [\d.]+ s, which knows nothing of {words}\n", out)
    problem = Problem.from_json(file(targets=at))
    assert "above the bound" not in plan_picture._title(problem, plan(problem, expansions=2000))
    code, out, _ = run(capsys, file(), "--expansions", "2000")
    assert re.search(r"% above the bound of [\d.]+ s\n", out)


def test_json_is_json_and_only_json(capsys, file):
    args = (file(), "--expansions", "3000", "--algorithm", "rrtstar", "--seed", "4", "--json")
    code, out, _ = run(capsys, *args)
    assert code == 0
    answer = json.loads(out)
    assert answer["seed"] == 4
    assert answer["status"] in {"found", "optimal"}
    again = json.loads(run(capsys, *args)[1])
    assert again["waypoints"] == answer["waypoints"]


def test_it_draws_a_picture(capsys, file, tmp_path):
    picture = tmp_path / "p.png"
    code, _, _ = run(capsys, file(), "--expansions", "1500", "--algorithm", "rrtstar", "--plot", picture)
    assert code == 0
    assert picture.read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"


def test_explain_adds_reasons(capsys, file):
    code, out, _ = run(capsys, file(), "--budget", "0.3", "--explain", "--explain-budget", "1")
    assert code == 0
    assert "Course" in out


def test_an_obstacle_is_called_by_its_name(capsys, file, tmp_path):
    """Of a mission's "Shark Island" it said "obstacle 1"."""
    _, out, _ = run(
        capsys, file(obstacle_names=["Duck Rock"]), "--expansions", "1500", "--explain", "--explain-budget", "0.5"
    )
    assert "of Duck Rock" in out
    assert "obstacle 1" not in out
    assert to_dict(Problem.from_json(file(obstacle_names=["Duck Rock"])))["obstacle_names"] == ["Duck Rock"]
    assert run(capsys, file(obstacle_names=["Duck Rock", "another"]))[0] == 2


def test_a_missions_obstacles_keep_their_names_in_its_problem():
    mission = load_mission("sitl/missions/two-channels.toml")
    frame = mission.frame()
    goal = frame.en_from_geo(mission.goals[0].point)

    def names(margin_m):
        grown = replace(
            mission,
            options=msgspec.structs.replace(
                mission.options, area=msgspec.structs.replace(mission.options.area, margin_m=margin_m)
            ),
        )
        problem = leg_problem(grown, (0.0, 0.0), 0.0, goal, 10.0, wind=AssumedWind(from_deg=0.0, speed_mps=5.0))
        return [problem.obstacle_name(i) for i in range(len(problem.obstacles))]

    assert sorted(names(1.0)) == ["East bank", "Middle bank", "West bank"]
    assert "Middle bank and East bank" in names(30.0)  # grown together


def test_the_plans_of_goals_without_a_name_have_their_numbers(capsys, tmp_path):
    """Two plans were both called by the mission alone."""
    path = tmp_path / "two.toml"
    goal = "[[goal]]\nlat = {}\nlon = -1.31\n"
    path.write_text(f'name = "two"\n[start]\nlat = 50.817\nlon = -1.31\n{goal.format(50.8176)}{goal.format(50.8182)}')
    code, out, _ = run(capsys, path, "--expansions", "1500")
    assert code == 0
    assert [line for line in out.splitlines() if line.startswith("two")] == ["two: goal 1", "two: goal 2"]


def test_no_plan_is_exit_1_with_the_reason(capsys, file, tmp_path):
    ring = "POLYGON((-40 160,40 160,40 240,-40 240,-40 160),(-20 180,20 180,20 220,-20 220,-20 180))"
    picture = tmp_path / "none.png"
    code, out, _ = run(capsys, file(obstacles=[ring]), "--budget", "0.3", "--plot", picture)
    assert code == 1
    assert "no path" in out
    assert picture.exists()


@pytest.mark.parametrize(
    "change",
    [
        {"start": {"x": 0, "y": 100, "heading_deg": 0}},
        {"delta_s": 0.2},
        {"delta_s": math.nan},
        {"wind": {**GOOD["wind"], "speed_mps": 0}},
        {"goal": {"x": 0, "y": 200, "radius": -1}},
    ],
)
def test_what_cannot_be_planned_is_exit_2_with_the_reason(capsys, file, change):
    code, out, err = run(capsys, file(**change), "--budget", "0.2")
    assert code == 2
    assert "invalid" in out + err


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ("{", "JSON"),
        ("[]", "JSON object"),
        ('{"id": "x"}', "start"),
        (json.dumps({**GOOD, "obstacles": ["POLYGON((0 0"]}), "obstacles"),
        (json.dumps({**GOOD, "boat": {**GOOD["boat"], "speed": {"model": "warp"}}}), "speed"),
    ],
)
def test_what_cannot_be_read_is_exit_2_and_one_line(capsys, tmp_path, text, place):
    path = tmp_path / "bad.json"
    path.write_text(text, encoding="utf-8")
    code, out, err = run(capsys, path)
    assert code == 2
    assert out == ""
    assert err.count("\n") == 1
    assert str(path) in err
    assert place in err


def test_bad_options_are_exit_2(capsys, file, tmp_path):
    assert run(capsys, tmp_path / "nowhere.json")[0] == 2
    assert run(capsys, file(), "--budget", "-1")[0] == 2
    assert run(capsys, file(), "--expansions", "0")[0] == 2
    assert run(capsys, file(), "--out", tmp_path / "no" / "such" / "folder.json")[0] == 2
    code, _, err = run(capsys, file(), "--budget", "0.2", "--plot", tmp_path / "p.nonsense")
    assert code == 2
    assert "p.nonsense" in err


# ---------------------------------------------------------------------------------------- the best policy
def test_the_policy_is_told_explained_and_drawn(capsys, file, tmp_path):
    picture = tmp_path / "policy.png"
    options = ("--expansions", "200", "--policy", "9,28", "--explain", "--plot", picture)
    code, out, _ = run(capsys, file(), *options)
    assert code == 0
    told = re.search(r"time to go (\d+) s: begun on port tack (\d+) s, on starboard (\d+) s; (\d+) s if", out)
    best_s, *each_s, steady_s = (int(n) for n in told.groups())
    assert best_s == min(each_s)
    assert best_s == pytest.approx(steady_s, rel=0.1)
    drawn_s = int(re.search(r"1000 drawn winds sailed by it: (\d+) s, .* 0 touched", out)[1])
    assert drawn_s == pytest.approx(best_s, rel=0.03)
    assert (
        len(re.findall(r"^  (?:backed|veered|at its mean).*(?:stand on, \d{3}°|tack): worth", out, re.MULTILINE)) == 5
    )
    assert picture.stat().st_size > 10_000


def test_where_no_policy_leads_it_is_exit_1(capsys, file):
    wall = "POLYGON((-80 150,80 150,80 260,-80 260,-80 150),(-30 170,30 170,30 230,-30 230,-30 170))"
    code, out, _ = run(capsys, file(obstacles=[wall]), "--expansions", "200", "--policy", "9,28")
    assert code == 1
    assert "no way" in out


@pytest.mark.parametrize("text", ["9", "9,", "nan,28", "-1,28", "9,0", "91,28"])
def test_a_wind_that_shifts_by_nonsense_is_exit_2(capsys, file, text):
    code, _, err = run(capsys, file(), f"--policy={text}")
    assert code == 2
    assert "--policy" in err


def test_a_policy_keeps_to_its_budget_and_says_what_that_left_undone(capsys, file):
    code, out, _ = run(capsys, file(), "--policy", "9,28", "--budget", "1e-6")
    assert (code, "give a larger --budget" in out, "no way:" in out) == (1, True, False)


def test_a_policy_is_told_as_text_alone(capsys, file):
    code, out, err = run(capsys, file(), "--policy", "9,28", "--json")
    assert (code, out) == (2, "")
    assert "leave --json out" in err
