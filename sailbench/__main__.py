"""Run the bench: ``python -m sailbench plan``, ``sail``, ``passages`` and ``page``.

    python -m sailbench plan --budgets 1 --seeds 2 --out planners.parquet
    python -m sailbench plan --planners auto mine:straight --out planners.parquet
    python -m sailbench sail --seeds 10 --out sailors.parquet
    python -m sailbench passages --out passages.csv
    python -m sailbench page planners.parquet sailors.parquet --out leaderboard.html

What a results file holds is not run again; its summary is printed. A planner is one function of its own module,
MODULE:FUNCTION (docs/guides/sailbench.md).
"""

from __future__ import annotations

import argparse
import contextlib
import datetime as dt
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import companion
from companion.errors import InputError
from companion.program import Parser
from companion.program.arguments import number, out_file, whole
from sailbench import board, passage_bench, plan_bench, sailors
from sailbench.environment import ENVIRONMENTS
from sailbench.passage_set import SEASONS, WAYS
from sailbench.planners import planner_named, present
from sailbench.problem_set import answers, problems

WARM_S = 60.0  # of processor time, for a guest to load and compile in


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command and return its exit code: 2 where it was asked for what is not there."""
    parser = Parser(
        prog="python -m sailbench", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    one = commands.add_parser("plan", help="planners on the problems", epilog="example: python -m sailbench plan")
    one.add_argument("problems", nargs="*", help="problem files (default: the set)")
    one.add_argument("--planners", nargs="+", default=present(), metavar="P", help="by name, or MODULE:FUNCTION")
    one.add_argument(
        "--budgets", nargs="+", type=number("s", above=0.0), default=[1.0], metavar="S", help="seconds (default: 1)"
    )
    one.add_argument("--seeds", type=whole(at_least=1), default=2, help="of each problem and budget (default: 2)")
    one.add_argument("--out", type=out_file, metavar="FILE.parquet", help="keep the rows there")
    one.set_defaults(run=_plan)
    two = commands.add_parser("sail", help="sailors in the environments", epilog="example: python -m sailbench sail")
    two.add_argument("--environments", nargs="+", default=list(ENVIRONMENTS), metavar="E", help=", ".join(ENVIRONMENTS))
    two.add_argument(
        "--sailors",
        nargs="+",
        default=[*sailors.SAILORS, sailors.COMPANION],
        metavar="S",
        help="greedy; who sails by a planner, named as for plan; companion: the whole program",
    )
    two.add_argument("--seeds", type=whole(at_least=1), default=10, help="weathers (default: 10)")
    two.add_argument("--out", type=out_file, metavar="FILE.parquet", help="keep the rows there")
    two.set_defaults(run=_sail)
    four = commands.add_parser(
        "passages", help="routers in the weather of weeks", epilog="example: python -m sailbench passages"
    )
    four.add_argument(
        "--routers", nargs="+", default=list(passage_bench.ROUTERS), metavar="R", help="or MODULE:FUNCTION"
    )
    four.add_argument("--passages", nargs="+", metavar="P", help="of the twelve: " + ", ".join(w.name for w in WAYS))
    four.add_argument("--seasons", nargs="+", default=list(SEASONS), metavar="S", choices=list(SEASONS))
    four.add_argument("--out", type=out_file, metavar="FILE.csv", help="keep the rows there")
    four.set_defaults(run=_passages)
    three = commands.add_parser("page", help="the leaderboard", epilog="example: python -m sailbench page a.parquet")
    three.add_argument("results", nargs="+", type=Path, help="what --out wrote")
    three.add_argument("--out", type=out_file, default=Path("leaderboard.html"), help="(default: leaderboard.html)")
    three.set_defaults(run=_page)
    try:
        args = parser.parse_args(argv)
        args.run(args)
    except InputError as error:
        print(error if error.source.startswith(parser.prog) else f"sailbench: {error}", file=sys.stderr)
        return error.exit_code
    return 0


def _plan(args: argparse.Namespace) -> None:
    planners = {name: planner_named(name) for name in args.planners}
    asked = problems(args.problems)
    held = _held(args.out)
    made = {(row["problem"], row["planner"], row["budget_s"], row["seed"]) for row in held}
    for name, planner in planners.items():  # kernels are compiled or loaded before any clock starts
        limit = plan_bench.ended_after(WARM_S) if ":" in name else contextlib.nullcontext()
        with contextlib.suppress(Exception, plan_bench.Late), limit:  # its rows say so
            planner(asked[0], 1.0, 0)
    rows = plan_bench.rows(
        planners, asked, answers(), budgets_s=args.budgets, seeds=args.seeds, is_made=lambda *key: key in made
    )
    all_rows: list[Any] = _kept(rows, held, args.out)
    mine = [row for row in all_rows if row["problem"] in {p.id for p in asked}]
    print(plan_bench.table(plan_bench.summary(mine, answers())))
    for line in plan_bench.troubles(mine):
        print(line)


def _sail(args: argparse.Namespace) -> None:
    held = _held(args.out)
    made = {(row["environment"], row["sailor"], row["seed"]) for row in held}
    rows = sailors.voyages(args.environments, args.sailors, seeds=args.seeds, is_made=lambda *key: key in made)
    all_rows: list[Any] = _kept(rows, held, args.out)
    print("| " + " | ".join(sailors.HEADS) + " |\n" + "|---" * len(sailors.HEADS) + "|")
    for cells in sailors.lines(all_rows):
        print("| " + " | ".join(cells) + " |")


def _passages(args: argparse.Namespace) -> None:
    routers = {name: passage_bench.router_named(name) for name in args.routers}
    unknown = set(args.passages or ()) - {w.name for w in WAYS}
    if unknown:
        raise InputError("--passages", min(unknown), "there is no such passage", ", ".join(w.name for w in WAYS))
    ways = [w for w in WAYS if args.passages is None or w.name in args.passages]
    held = passage_bench.read(args.out) if args.out is not None and args.out.exists() else []
    made = {row.key for row in held}
    for row in passage_bench.rows(routers, ways=ways, seasons=args.seasons, is_made=lambda key: key in made):
        held.append(row)
        if args.out is not None:
            passage_bench.write(args.out, held)
    print(passage_bench.table(held))


def _page(args: argparse.Namespace) -> None:
    stamp = f"Made on {dt.datetime.now(dt.UTC).date()} by sailbench {companion.__version__}."
    args.out.write_text(board.page(board.read(args.results), stamp=stamp), encoding="utf-8")
    print(args.out)


def _held(path: Path | None) -> list[dict[str, Any]]:
    return board.read([path]) if path is not None and path.exists() else []


def _kept(rows: Iterable[Any], held: list[dict[str, Any]], path: Path | None) -> list[dict[str, Any]]:
    """Return all rows; they are kept as they come."""
    for row in rows:
        held.append(dict(row))
        if path is not None:
            board.write(path, held)
    return held


if __name__ == "__main__":
    sys.exit(main())
