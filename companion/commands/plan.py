"""``companion plan``: plan a path on a problem file, say what it is worth, write it, draw it."""

from __future__ import annotations

import argparse
import contextlib
import json
import math
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from companion.commands.output import patience, write_files
from companion.errors import InputError
from companion.geo.angles import direction
from companion.planner.courses import courses
from companion.planner.problem import evaluate
from companion.planners import ALGORITHMS
from companion.program.arguments import add_command, moment, number, out_file, picture, shifts, whole, wind
from companion.words import counted, listed

if TYPE_CHECKING:
    from companion.geofence import Mission
    from companion.planner import Plan, Problem

_EPILOG = """\
examples:
  companion plan missions/archipelago.toml --explain --wind 5@20
  companion plan lake.json
  companion plan lake.json --budget 10 --out path.json --plot path.png
  companion plan lake.json --algorithm rrtstar --expansions 20000 --seed 7   (the same path on every machine)
  companion plan lake.json --explain
  companion plan missions/archipelago.toml --policy 9,28 --explain --plot policy.png

The problem's format is described in docs/reference/problem-format.md. PLAN.json holds "waypoints" as [[x, y], ...] in
metres; of a mission with several goals it is a list of plans.
Exit codes: 0 a path was found, 1 there is none, or it breaks the boat's limits of wind (the reason is printed), 2 the
problem cannot be read or planned.
"""


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser], summary: str) -> None:
    """Add the command's options."""
    parser = add_command(subparsers, "plan", summary, _EPILOG)
    parser.add_argument(
        "problem",
        metavar="PROBLEM.json",
        help="the planning problem, or a mission TOML, planned from goal to goal, and home where it ends "
        "there, in a wind held steady",
    )
    parser.add_argument(
        "--wind",
        type=wind,
        metavar="SPEED@FROM",
        help="of a mission: the true wind [m/s, degrees] (default: its preview wind)",
    )
    parser.add_argument(
        "--at",
        type=moment,
        metavar="TIME",
        help="of a mission: the time of departure, for tide tables, as 2026-11-24T08:00Z (default: now)",
    )
    parser.add_argument(
        "--budget",
        type=number("s", above=0.0),
        metavar="S",
        help="computing time for each plan [s] (default: 1, unless --expansions is given)",
    )
    parser.add_argument(
        "--expansions",
        type=whole(at_least=1),
        metavar="N",
        help="limit the effort in the algorithm's own steps, not in time",
    )
    parser.add_argument("--seed", type=whole(), default=0, metavar="N", help="random seed (default: 0)")
    parser.add_argument("--algorithm", default="auto", choices=tuple(ALGORITHMS))
    parser.add_argument("--explain", action="store_true", help="say what bound each leg and what would change the plan")
    parser.add_argument(
        "--explain-budget",
        type=number("s", above=0.0),
        default=5.0,
        metavar="S",
        help="computing time for --explain [s] (default: 5)",
    )
    parser.add_argument("--out", type=out_file, metavar="PLAN.json", help="write the plan")
    parser.add_argument("--plot", type=picture, metavar="P.png", help="draw problem, search, path and bound")
    parser.add_argument("--json", action="store_true", help="print the plan as JSON instead of text")
    parser.add_argument(
        "--policy",
        type=shifts,
        metavar="DEG,S",
        help="tell, and with --plot draw, what is best done wherever she comes to be in a wind that shifts by DEG "
        "(standard deviation) for S seconds",
    )
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Plan, print, write and draw; return the exit code."""
    from companion.mission_check import charted_findings, tide_words_of
    from companion.planner import PlanStatus, Problem

    if args.policy is not None and args.json:
        raise InputError("--policy", "", "is told as text", "leave --json out")
    ground: dict[str, Any] = {}
    told: list[str] = []
    if Path(args.problem).suffix.lower() == ".toml":
        mission = _mission(args)
        ways = len(mission.goals) + (mission.skipper.end == "home")
        if args.plot is not None and args.policy is None and ways > 1:
            raise _several(args)
        answers = _sail_through(mission, args)
        told = [finding.line() for finding in charted_findings(mission, _departs_s(args))]
        told += [words for words in [tide_words_of(mission, _departs_s(args))] if words]
        ground = {"area": mission.water(), "margin_m": mission.margin_m}
        if args.plot is not None and mission.drying:
            from companion.plots.drying import drying_picture

            ground["drying"] = drying_picture(mission, _departs_s(args))
    elif args.wind is not None:
        raise InputError("--wind", "", "a problem has a wind of its own", "leave it out, or plan a mission TOML")
    elif args.at is not None:
        raise InputError("--at", "", "a problem has hours of its own", "leave it out, or plan a mission TOML")
    else:
        answers = [_answer(Problem.from_json(args.problem), args)]
    files = [_file(problem, answer) for problem, answer in answers]
    text = json.dumps(files[0] if len(files) == 1 else files, indent=1) + "\n"
    if args.out is not None:
        write_files({str(args.out): text.encode()}, force=True)
    if args.policy is not None:
        return _policy([problem for problem, _ in answers], args)
    if args.plot is not None:
        from companion.plots.plan import save_plan

        if len(answers) > 1:
            raise _several(args)
        with patience("drawing"):
            save_plan(*answers[0], args.plot, **ground)
    if args.json:
        sys.stdout.write(text)
    else:
        print("\n\n".join(describe(problem, answer, ground.get("margin_m", 0.0)) for problem, answer in answers))
        for line in told:
            print(line)
        for path in (args.out, args.plot):
            if path is not None:
                print(f"written: {path}")
    if any(answer.status is PlanStatus.INVALID for _, answer in answers):
        return 2
    return 0 if all(answer.has_path and not _broken(problem, answer) for problem, answer in answers) else 1


def _several(args: argparse.Namespace) -> InputError:
    return InputError(
        "--plot",
        str(args.plot),
        "one plan is drawn, and this mission wants several",
        "companion mission check --plot draws them all",
    )


def _policy(problems: Sequence[Problem], args: argparse.Namespace) -> int:
    """Tell the policy of each leg, and draw the first's."""
    from companion.commands.plan_policy import describe, solved

    with patience("solving for the best policy"):
        legs = solved(problems, args.policy, budget_s=math.inf if args.budget is None else args.budget)
    print("\n\n".join(describe(leg, args.policy, explain=args.explain) for leg in legs))
    if args.plot is not None:
        from companion.plots.policy import save_policy

        with patience("drawing"):
            save_policy(legs[0].problem, legs[0].policy, legs[0].tack, args.plot)
        print(f"written: {args.plot}")
    return 0 if all(math.isfinite(leg.time_s) for leg in legs) else 1


def _answer(problem: Problem, args: argparse.Namespace) -> tuple[Problem, Plan]:
    """Return a problem with its plan, explained where that is asked for."""
    from companion.planner import plan

    # what is asked for may take long by itself: the time it was given is no surprise
    with patience("planning") if args.budget is None else contextlib.nullcontext():
        answer = plan(
            problem, budget_s=args.budget, expansions=args.expansions, seed=args.seed, algorithm=args.algorithm
        )
    if args.explain and args.policy is None:  # with one it is the policy that is explained
        from companion.planner.explain import explain

        answer = explain(problem, answer, budget_s=args.explain_budget)
    return problem, _completed(problem, answer)


def _mission(args: argparse.Namespace) -> Mission:
    """Return the mission that is to be planned from its start."""
    from companion.geofence import load_mission
    from companion.mission_check import require_sailable

    mission = require_sailable(load_mission(args.problem))
    if mission.start is None:
        raise InputError(args.problem, "[start]", "is missing", "a plan begins somewhere: add lat and lon")
    return mission


def _departs_s(args: argparse.Namespace) -> float:
    """Return the Unix time of departure [s]: as asked for, or now."""
    return time.time() if args.at is None else float(args.at.timestamp())


def _sail_through(mission: Mission, args: argparse.Namespace) -> list[tuple[Problem, Plan]]:
    """Return the problems and plans of a mission from goal to goal, to the first that has no path."""
    from companion.mission_check import AssumedWind, legs, planned_legs

    tws_mps, from_deg = args.wind or (mission.wind.preview_speed_mps, mission.wind.preview_from_deg)
    answers: list[tuple[Problem, Plan]] = []

    def answer(problem: Problem) -> Plan:
        answers.append(_answer(problem, args))
        return answers[-1][1]

    wind = AssumedWind(from_deg=from_deg, speed_mps=tws_mps)
    planned_legs(legs(mission, wind, unix_s=_departs_s(args)), answer)
    return answers


def _completed(problem: Problem, answer: Plan) -> Plan:
    """Return the plan with risk and clearance, computed here if the planner left them open."""
    from companion.planner.explain import with_clearance
    from companion.planner.risk import with_risk

    if answer.has_path and answer.risk is None:
        answer = with_risk(problem, answer)
    return with_clearance(problem, answer)


def _file(problem: Problem, answer: Plan) -> dict[str, Any]:
    return {"problem": problem.id, **answer.to_dict()}


def describe(problem: Problem, answer: Plan, margin_m: float = 0.0) -> str:
    """Return the plan as text for a person; ``margin_m`` is what the problem's obstacles were made larger by."""
    name = problem.id or "problem"
    lines = [f"{name}: {problem.title}" if problem.title else name]
    effort = (
        f"{answer.algorithm}, seed {answer.seed}, {counted(answer.expansions, 'expansion')} in {answer.elapsed_s:.2f} s"
    )
    if answer.first_s is not None:
        effort += f", first path after {1000.0 * answer.first_s:.0f} ms"
    if not answer.has_path:
        lines += [f"no path ({answer.status.value}): {answer.reason}", effort]
        if answer.why.text and answer.why.text != answer.reason:
            lines.append(answer.why.text)
        return "\n".join(lines)
    length = sum(leg.length_m for leg in answer.legs)
    judged = evaluate(problem, answer.waypoints_en)
    gap = (
        f", {100.0 * answer.gap:.1f} % above the bound of {answer.lower_bound_s:.1f} s{_beyond_bound(problem)}"
        if math.isfinite(answer.gap)
        else ""
    )
    lines += [
        f"{answer.status.value}: {answer.cost_s:.1f} s{gap}",
        ", ".join(
            (
                f"{length:.0f} m in {counted(len(courses(answer.legs)), 'course')}{_of_legs(answer)}",
                counted(judged.tacks, "tack"),
                counted(judged.gybes, "gybe"),
            )
        ),
        _risk_text(problem, answer),
        *_of_light_wind(problem),
        *_of_wind(problem, answer),
        *_current_text(problem),
        effort,
        "",
        *_table(answer),
        "",
        "to spare: between the course and the edge of the no-go zone as it is then"
        + (f"; clear: beyond the margin of {margin_m:.0f} m" if margin_m else ""),
    ]
    if answer.why.text:
        lines += ["", answer.why.text]
    return "\n".join(lines)


def _beyond_bound(problem: Problem) -> str:
    """Return in words what is in the way at its hours alone: a bound is of what stands there always."""
    sails = [bool(t.vx_mps or t.vy_mps or t.spread is not None) for t in problem.targets]
    kinds = [*(["vessels"] if any(sails) else []), *(["water that is closed for a time"] if not all(sails) else [])]
    return f", which knows nothing of {listed(kinds)}" if kinds else ""


def _of_wind(problem: Problem, answer: Plan) -> list[str]:
    """Return what the wind's strength makes of the plan; that is said with the explanation, too."""
    if answer.arrival is None or answer.why.data.get("arrival") is not None:
        return []
    from companion.planner.risk import arrival_in_words

    broken = _broken(problem, answer)
    return [arrival_in_words(answer.arrival, answer.cost_s), *([f"NOT to be sailed: {broken}"] if broken else [])]


def _of_light_wind(problem: Problem) -> list[str]:
    """Return what the plan's times are worth in less wind than the polar has speeds for."""
    speeds, tws_mps = problem.boat.speeds, problem.wind.tws_mps
    if speeds is None or tws_mps is None or not 0.0 < tws_mps < speeds.lowest_mps:
        return []
    return [
        (
            f"light wind: her polar has no speeds for {tws_mps:.1f} m/s of wind, the least that it knows is "
            f"{speeds.lowest_mps:.1f} m/s; those here are scaled down from there, so take the times as a rough guess"
        )
    ]


def _broken(problem: Problem, answer: Plan) -> str:
    """Return which of the boat's limits of wind a plan breaks, in words; empty: none."""
    if answer.arrival is None:
        return ""
    from companion.planner.risk import limits_in_words

    return limits_in_words(problem, answer.arrival)


def _current_text(problem: Problem) -> list[str]:
    drift_mps = problem.current.drift_mps
    if drift_mps == 0.0:
        return []
    return [
        (
            f"current: sets {direction(problem.current.set_rad)}° {drift_mps:.2f} m/s; "
            "headings and angles are through the water, the wind "
            f"over it is from {direction(problem.wind.twd_from_rad)}°"
        )
    ]


def _of_legs(answer: Plan) -> str:
    merged = len(courses(answer.legs))
    return f" ({counted(len(answer.legs), 'leg')})" if len(answer.legs) > merged else ""


def _table(answer: Plan) -> list[str]:
    """Return the courses as lines under a head; where the legs of one differ, their range."""
    rows = [("course", "heading", "TWA", "tack", "length", "from", "to", "no-go", "to spare", "clear", "off plan")]
    for place, course in enumerate(courses(answer.legs), start=1):
        first, last = course.legs[0], course.legs[-1]
        clearances = [leg.clearance_m for leg in course.legs if leg.clearance_m is not None]
        risks = [leg.risk for leg in course.legs if leg.risk is not None]
        headings = [math.degrees(heading) for heading in course.headings_rad]
        rows.append(
            (
                str(place),
                _range(*headings),
                _range(*course.span(lambda leg: math.degrees(abs(leg.twa_rad)))),
                "stbd" if first.twa_rad > 0.0 else "port",  # the side the wind comes over
                f"{course.length_m:.0f} m",
                f"{first.start_s:.0f} s",
                f"{last.end_s:.0f} s",
                _range(*course.span(lambda leg: math.degrees(leg.no_go_half_rad))),
                _range(*course.span(lambda leg: math.degrees(leg.margin_rad))),
                f"{min(clearances):.0f} m" if clearances else "-",
                # at most: as if the legs' chances excluded one another
                f"{100.0 * min(1.0, sum(risks)):.2f} %" if risks else "-",
            )
        )
    widths = [max(len(row[k]) for row in rows) for k in range(len(rows[0]))]
    return ["  " + "  ".join(cell.rjust(width) for cell, width in zip(row, widths, strict=True)) for row in rows]


def _range(begin: float, end: float) -> str:
    """Return degrees, or from where to where they go."""
    low, high = (f"{round(value, 1) + 0.0:.1f}" for value in (begin, end))  # + 0: no minus before a zero
    return f"{low}°" if low == high else f"{low}..{high}°"


def _risk_text(problem: Problem, answer: Plan) -> str:
    if problem.wind.sigma.model == "none" and not problem.is_shared:
        return "off the plan: 0 %, for the wind is taken as certain"
    from companion.planner.risk import path_risk

    risk = path_risk(problem, answer)
    if problem.is_shared:
        # the words of the plan have the parts
        return f"off the plan: at most {100.0 * risk.total:.1f} % of such voyages meet the no-go zone or a vessel"
    limit = f" (limit {100.0 * problem.risk.max_path_risk:.1f} %)" if problem.risk is not None else ""
    return (
        "off the plan: the wind forces the boat to tack or bear away unplanned on at most "
        f"{100.0 * risk.total:.1f} % of such voyages{limit}; {100.0 * (1.0 - problem.delta_s):.0f} % is allowed at "
        "each instant"
    )
