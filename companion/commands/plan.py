"""``companion plan``: plan a path on a problem file, say what it is worth, write it, draw it."""

from __future__ import annotations

import argparse
import json
import math
import sys
from typing import TYPE_CHECKING, Any

from companion.arguments import number, out_file, picture, whole

if TYPE_CHECKING:
    from companion.planner import Plan, Problem

_EPILOG = """\
examples:
  companion plan lake.json
  companion plan lake.json --budget 10 --out path.json --plot path.png
  companion plan lake.json --algorithm rrtstar --expansions 20000 --seed 7   (the same path on every machine)
  companion plan lake.json --explain

The problem's format is described in docs/problem-format.md. PLAN.json holds "waypoints" as [[x, y], ...] in metres.
Exit codes: 0 a path was found, 1 there is none (the reason is printed), 2 the problem cannot be read or planned.
"""


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser], summary: str) -> None:
    """Add the command's options."""
    parser = subparsers.add_parser(
        "plan", help=summary, description=summary[0].upper() + summary[1:] + ".", epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("problem", metavar="PROBLEM.json", help="the planning problem")
    parser.add_argument("--budget", type=number("s", above=0.0), metavar="S",
                        help="computing time [s]; 1 unless --expansions is given")
    parser.add_argument("--expansions", type=whole(at_least=1), metavar="N",
                        help="effort in the algorithm's own steps instead")
    parser.add_argument("--seed", type=whole(), default=0, metavar="N", help="of every random choice (default 0)")
    parser.add_argument("--algorithm", default="auto", choices=("auto", "rrtstar", "astar"))
    parser.add_argument("--explain", action="store_true", help="say what bound each leg and what would change the plan")
    parser.add_argument("--explain-budget", type=number("s", above=0.0), default=5.0, metavar="S",
                        help="computing time for that [s]")
    parser.add_argument("--out", type=out_file, metavar="PLAN.json", help="write the plan")
    parser.add_argument("--plot", type=picture, metavar="P.png", help="draw problem, search, path and bound")
    parser.add_argument("--json", action="store_true", help="print the plan as JSON instead of text")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Plan, print, write and draw; return the exit code."""
    from companion.planner import PlanStatus, Problem, plan

    problem = Problem.from_json(args.problem)
    answer = plan(
        problem, budget_s=args.budget, expansions=args.expansions, seed=args.seed, algorithm=args.algorithm)
    if args.explain:
        from companion.planner.explain import explain

        answer = explain(problem, answer, budget_s=args.explain_budget)
    answer = _completed(problem, answer)
    if args.out is not None:
        args.out.write_text(json.dumps(_file(problem, answer), indent=1) + "\n", encoding="utf-8")
    if args.plot is not None:
        from companion.plots.plan import save_plan

        save_plan(problem, answer, args.plot)
    if args.json:
        sys.stdout.write(json.dumps(_file(problem, answer), indent=1) + "\n")
    else:
        print(describe(problem, answer))
        for path in (args.out, args.plot):
            if path is not None:
                print(f"written: {path}")
    if answer.status is PlanStatus.INVALID:
        return 2
    return 0 if answer.has_path else 1


def _completed(problem: Problem, answer: Plan) -> Plan:
    """Return the plan with risk and clearance, computed here if the planner left them open."""
    from companion.planner.explain import with_clearance
    from companion.planner.risk import with_risk

    if answer.has_path and answer.risk is None:
        answer = with_risk(problem, answer)
    return with_clearance(problem, answer)


def _file(problem: Problem, answer: Plan) -> dict[str, Any]:
    return {"problem": problem.id, **answer.to_dict()}


def describe(problem: Problem, answer: Plan) -> str:
    """Return the plan as text for a person."""
    name = problem.id or "problem"
    lines = [f"{name}: {problem.title}" if problem.title else name]
    effort = f"{answer.algorithm}, seed {answer.seed}, {answer.expansions} expansions in {answer.elapsed_s:.2f} s"
    if answer.first_s is not None:
        effort += f", first path after {1000.0 * answer.first_s:.0f} ms"
    if not answer.has_path:
        lines += [f"no path ({answer.status.value}): {answer.reason}", effort]
        if answer.why.text and answer.why.text != answer.reason:
            lines.append(answer.why.text)
        return "\n".join(lines)
    length = sum(leg.length_m for leg in answer.legs)
    judged = problem.evaluate(answer.waypoints_en)
    gap = f", {100.0 * answer.gap:.1f} % above the bound of {answer.lower_bound_s:.1f} s" if math.isfinite(answer.gap) \
        else ""
    lines += [
        f"{answer.status.value}: {answer.cost_s:.1f} s{gap}",
        f"{length:.0f} m in {len(answer.legs)} legs, {judged.tacks} tacks, {judged.gybes} gybes",
        _risk_text(problem, answer),
        effort,
        "",
        "  leg  heading     TWA  tack  length    from      to   no-go  margin  clear     risk",
    ]
    for i, leg in enumerate(answer.legs, start=1):
        clear = "-" if leg.clearance_m is None else f"{leg.clearance_m:.0f} m"
        risk = "-" if leg.risk is None else f"{100.0 * leg.risk:.2f} %"
        tack = "stbd" if leg.twa_rad > 0.0 else "port"  # the side the wind comes over
        lines.append(
            f"  {i:3d}  {math.degrees(leg.heading_rad):6.1f}°  {math.degrees(abs(leg.twa_rad)):5.1f}°  {tack}"
            f"  {leg.length_m:4.0f} m  {leg.start_s:5.0f} s  {leg.end_s:5.0f} s"
            f"  {math.degrees(leg.no_go_half_rad):5.1f}°  {math.degrees(leg.margin_rad):5.1f}°  {clear:>5}  {risk:>7}")
    if answer.why.text:
        lines += ["", answer.why.text]
    return "\n".join(lines)


def _risk_text(problem: Problem, answer: Plan) -> str:
    if problem.wind.sigma.model == "none" and not problem.is_shared:
        return "risk: none, the wind is taken as certain"
    from companion.planner.risk import path_risk

    risk = path_risk(problem, answer)
    if problem.is_shared:
        # the words of the plan have the parts
        return f"risk: at most {100.0 * risk.total:.1f} % of such voyages meet the no-go zone or a vessel"
    limit = f" (limit {100.0 * problem.risk.max_path_risk:.1f} %)" if problem.risk is not None else ""
    return (f"risk: the wind forces the boat into the no-go zone on at most {100.0 * risk.total:.1f} % of such "
            f"voyages{limit}; {100.0 * (1.0 - problem.delta_s):.0f} % is allowed at each instant")
