"""The bench of planners: answers judged by the scorer alone, whoever gives them, and what they come to."""

import contextlib
import json
import math
import re
import sys
from pathlib import Path

import pytest

from companion.planner.problem import evaluate
from sailbench import BASELINES, IMPOSSIBLE, Answer, answers, problems
from sailbench.__main__ import main
from sailbench.plan_bench import judge, rows, summary, table, troubles
from sailbench.planners import by_ompl, greedy, planner_named, present
from sailbench.problem_set import FOLDER
from tests.planner.problems import load

KNOWN = answers()
OPEN = ("open-beat", "open-reach", "open-run")


def test_every_problem_has_its_answer_or_the_proof_that_there_is_none():
    asked = {p.id: p.extra["expect"] for p in problems()}
    assert asked.keys() == KNOWN.keys() == {path.stem for path in FOLDER.glob("*.json")}
    for name, known in KNOWN.items():
        assert (known.best_s is None) == bool(known.proof), name
        assert known.best_s is None or known.bound_s <= known.best_s + 1e-3, name
        assert asked[name] in ({"infeasible", "invalid", "any"} if known.proof else {"path", "any"}), name
    units = json.loads((FOLDER.parent / "answers.json").read_text())["units"]
    assert set(units) == {"best_s", "bound_s", "waypoints", "proof"}


@pytest.mark.parametrize("name", OPEN)
def test_in_open_water_the_greedy_sailor_arrives_by_the_scorer(name):
    judged = evaluate(load(name), greedy(load(name), 1.0, 0))
    assert judged.is_feasible, judged.reasons
    assert judged.time_s <= 1.3 * KNOWN[name].best_s


def test_rocks_are_none_of_the_greedy_sailors_business():
    outcome, time_s, why = judge(load("slalom"), Answer(waypoints_en=greedy(load("slalom"), 1.0, 0)), None)
    assert (outcome, time_s) == ("wrong", None)
    assert "obstacle" in why


def test_a_claim_counts_only_where_it_is_true():
    walled, open_water = load("walled-goal"), load("open-beat")
    said = Answer(is_impossible=True)
    assert judge(walled, said, KNOWN["walled-goal"]) == ("impossible", None, "")
    assert judge(open_water, said, KNOWN["open-beat"]) == ("wrong", None, "there is a path")
    best = Answer(waypoints_en=KNOWN["open-beat"].waypoints_en)
    assert judge(open_water, best, KNOWN["open-beat"])[1] == pytest.approx(KNOWN["open-beat"].best_s, abs=1e-3)


def ten_lines(problem, budget_s, seed):
    """Straight there, or that it cannot be: what a guest may bring."""
    return IMPOSSIBLE if problem.id == "walled-goal" else [problem.start_en, problem.goal_en]


def raising(problem, budget_s, seed):
    raise OSError("no licence")


def made(planners, *names, seeds=1, is_made=lambda *_: False):
    return list(rows(planners, [load(n) for n in names], KNOWN, budgets_s=[0.05], seeds=seeds, is_made=is_made))


def test_a_guest_is_one_function_and_its_errors_are_its_own():
    found = made({"mine": ten_lines, "bad": raising, "odd": lambda *_: [[1.0, 2.0, 3.0]]}, "open-reach", "walled-goal")
    told = {(row["planner"], row["problem"]): (row["outcome"], row["why"]) for row in found}
    assert told["mine", "open-reach"] == ("path", "")
    assert told["mine", "walled-goal"] == ("impossible", "")
    assert told["bad", "open-reach"] == ("nothing", "OSError: no licence")
    assert told["odd", "open-reach"] == ("nothing", "ValueError: waypoints are (n, 2), not (1, 3)")


def test_what_is_made_is_not_made_again():
    asked = []
    held = made({"mine": lambda p, *_: asked.append(p.id)}, *OPEN, is_made=lambda p, *_: p == "open-run")
    assert asked == [row["problem"] for row in held] == ["open-beat", "open-reach"]


def test_who_answers_late_has_not_answered(monkeypatch):
    ticks = iter([0.0, 4.2, 10.0, 14.0])  # more than twice 0.05 s and 4 s, and less
    monkeypatch.setattr("sailbench.plan_bench.processor_s", lambda: next(ticks))
    late, in_time = made({"mine": ten_lines}, "open-reach", seeds=2)
    assert (late["outcome"], late["time_s"], late["why"]) == ("late", None, "no answer in 4.1 s: took 4.2 s")
    assert in_time["outcome"] == "path"


def test_who_never_comes_back_is_ended_and_what_was_raised_is_told(monkeypatch):
    """It hung for ever, whatever the budget; and of a guest that raises "solved 0 of 1" was all that was said."""
    monkeypatch.setattr("sailbench.plan_bench.LATE_S", 0.1)
    monkeypatch.setattr("sailbench.plan_bench.ENDED_S", 0.1)

    def slow(*_):
        while True:
            with contextlib.suppress(Exception):
                sum(range(100))

    def broken(*_):
        raise ValueError("oh")

    found = made({"slow": slow, "broken": broken}, "open-reach")
    assert [row["outcome"] for row in found] == ["late", "nothing"]
    assert troubles(found) == ["slow, 1 answer: no answer in 0.2 s", "broken, 1 answer: ValueError: oh"]


def test_the_summary_counts_what_was_in_every_seed():
    luck = iter([True, False])

    def lucky(problem, budget_s, seed):
        return ten_lines(problem, budget_s, seed) if next(luck) else None

    found = made({"lucky": lucky}, "open-reach", seeds=2) + made({"mine": ten_lines}, "open-reach", "walled-goal")
    mine, unsure = summary(found, KNOWN)
    assert (mine["planner"], mine["solved"], mine["recognised"], mine["hopeless"]) == ("mine", 1, 1, 1)
    assert (unsure["planner"], unsure["solved"], unsure["solvable"]) == ("lucky", 0, 1)
    reach = evaluate(load("open-reach"), ten_lines(load("open-reach"), 1.0, 0)).time_s
    assert mine["over_best_percent"][0] == pytest.approx(100.0 * (reach / KNOWN["open-reach"].best_s - 1.0))
    assert "| mine | 0.05 | 1 of 1 | 1 of 1 | 0 |" in table([mine])


def test_a_path_better_than_any_known_is_the_best_from_then_on():
    row = {**made({"mine": ten_lines}, "open-reach")[0], "time_s": 0.5 * KNOWN["open-reach"].best_s}
    assert summary([row], KNOWN)[0]["over_best_percent"] == [0.0] * 3


def test_a_problem_that_nobody_knows_is_judged_too():
    row = made({"auto": BASELINES["auto"]}, "open-reach")[0]
    assert summary([row], {})[0]["solved"] == 1
    assert row["bound_s"] <= row["time_s"]


def test_the_command_asks_a_guest_by_name_and_keeps_its_rows(tmp_path, capsys, monkeypatch):
    (tmp_path / "mine_too.py").write_text(
        "def plan(problem, budget_s, seed):\n    return [problem.start_en, problem.goal_en]\n"
    )
    monkeypatch.syspath_prepend(str(tmp_path))
    words = ["plan", str(FOLDER / "open-reach.json"), "--planners", "mine_too:plan", "--budgets", "0.05"]
    kept = tmp_path / "rows.parquet"
    assert main([*words, "--out", str(kept)]) == 0
    first = capsys.readouterr().out
    assert "| mine_too:plan | 0.05 | 1 of 1 | 0 of 0 | 0 |" in first
    before = kept.read_bytes()
    assert main([*words, "--out", str(kept)]) == 0
    assert capsys.readouterr().out == first
    assert kept.read_bytes() == before
    assert main(["page", str(kept), "--out", str(tmp_path / "b.html")]) == 0
    page = (tmp_path / "b.html").read_text()
    assert '<td class="w">mine_too:plan</td><td>0.05</td><td>1 of 1</td>' in page
    assert "http" not in page  # asks for nothing
    assert page.count("<table>") == 1


@pytest.mark.parametrize(
    ("words", "line"),
    [
        (
            ["plan", "--planners", "nobody:plan"],
            "sailbench: planner: nobody:plan: there is none (No module named 'nobody')",
        ),
        (
            [
                "plan",
                str(FOLDER / "open-reach.json"),
                "--planners",
                "greedy",
                "--seeds",
                "1",
                "--out",
                "none/x.parquet",
            ],
            "python -m sailbench plan: argument --out: none/x.parquet: ",
        ),
        (["plan", "--planners", "math:sale"], "sailbench: planner: math:sale: there is none"),
        (["plan", "none.json", "--planners", "greedy"], "sailbench: none.json: "),
        (["page", "none.parquet", "--out", "none/x.html"], "python -m sailbench page: argument --out: none/x.html: "),
        (["passages", "--out", "none/x.csv"], "python -m sailbench passages: argument --out: none/x.csv: "),
        (["plan", "--budgets", "-1"], "python -m sailbench plan: argument --budgets: -1 is out of range; "),
        (["plan", "--seeds", "0"], "python -m sailbench plan: argument --seeds: 0 is out of range; "),
        (["sail", "--seeds", "ten"], "python -m sailbench sail: argument --seeds: 'ten' is not a whole number; "),
        (
            ["leaderboard"],
            "python -m sailbench: there is no command 'leaderboard'; there are plan, sail, passages, page",
        ),
        (["page", "none.parquet"], "sailbench: none.parquet: no such file; name what --out wrote\n"),
        (["page", "docs"], "sailbench: docs: is a folder; name a file in it, as --out wrote\n"),
        (["page", __file__], f"sailbench: {__file__}: is no table of results; name what --out wrote\n"),
        (
            ["sail", "--sailors", "nobody"],
            "sailbench: sailor: nobody: there is none (No module named 'nobody'); MODULE:FUNCTION, or one of ",
        ),
        (["sail", "--environments", "Sea-v0", "--sailors", "greedy"], "sailbench: environment: Sea-v0: there is none"),
    ],
)
def test_what_is_not_there_is_one_line(words, line, capsys):
    assert main(words) == 2
    told = capsys.readouterr().err
    assert told.startswith(line)
    assert told.count("\n") == 1


def test_the_companion_is_among_the_sailors_that_there_are(capsys):
    assert main(["sail", "--sailors", "nobody"]) == 2
    *known, last = capsys.readouterr().err.partition("one of ")[2].split(", ")
    assert (sorted(known), last) == (sorted(BASELINES), "companion\n")


def test_an_empty_file_is_no_results(tmp_path, capsys):
    empty = tmp_path / "rows.parquet"
    empty.touch()
    assert main(["page", str(empty)]) == 2
    assert capsys.readouterr().err == f"sailbench: {empty}: is empty; name what --out wrote\n"


def test_without_the_library_its_planners_are_named_and_refused(capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "ompl", None)
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    assert present() == ["auto", "rrtstar", "astar", "greedy"]
    assert main(["plan", "--planners", "ompl-bitstar"]) == 2
    assert capsys.readouterr().err == (
        "sailbench: planner: ompl-bitstar: needs the library OMPL; in the clone: make env EXTRAS=bench\n"
    )


@pytest.mark.skipif("ompl-bitstar" not in present(), reason="needs OMPL (make env EXTRAS=bench)")
def test_the_library_finds_its_way():
    judged = evaluate(load("open-beat"), by_ompl(load("open-beat"), 1.0, 0, name="bitstar"))
    assert judged.is_feasible, judged.reasons
    assert math.isfinite(judged.time_s)


def test_a_baseline_is_found_by_its_name():
    assert planner_named("auto") is BASELINES["auto"]
    assert Path(FOLDER).name == "problems"


def test_the_ten_lines_of_the_guide_are_a_planner():
    guide = (FOLDER.parents[1] / "docs" / "guides" / "sailbench.md").read_text(encoding="utf-8")
    names = {}
    exec(re.search(r"```python\n# mine.py\n(.*?)```", guide, re.DOTALL)[1], names)
    row = made({"mine": names["one_tack"]}, "open-beat")[0]
    assert row["outcome"] == "path"
    assert row["time_s"] <= 1.02 * KNOWN["open-beat"].best_s
