"""``sitl ablate``: what each part of the companion is worth, in the same weather."""

from __future__ import annotations

import argparse
from typing import Any

from companion.planners import ALGORITHMS, AUTO
from companion.program.arguments import whole
from sitl.commands.run import scenario_file
from sitl.options import add_options, options_of


def add_parser(subparsers: Any, summary: str) -> None:
    """Add the command."""
    parser = subparsers.add_parser(
        "ablate",
        help=summary,
        description="Sail the same weather, seed for seed, with one thing taken away or another in its place: the "
        "wind's spread, the forecaster, when it is planned again, the probability of staying out of the no-go zone, "
        "beats left to the autopilot, the planner. Prints for each scenario arrivals, contacts, voyages below the "
        "floor, times in the no-go zone, clearance, voyages that came nearer to a vessel than the mission's safe "
        "distance, replans, time, and that as a share of the same seed's with everything, with its interval.",
        epilog='Example: sitl ablate two-channels --runs 20 --only "no spread" --only kalman',
    )
    parser.add_argument(
        "scenarios",
        type=scenario_file,
        nargs="*",
        metavar="SCENARIO",
        help="(default: Wolsieffer's two channels in two winds, a narrow one, and two waters with ships)",
    )
    parser.add_argument(
        "--only",
        action="append",
        default=[],
        metavar="NAME",
        help="only these variations (default: all; a wrong name lists them)",
    )
    parser.add_argument("--runs", type=whole(at_least=1), default=20, metavar="N", help="seeds (default: 20)")
    parser.add_argument("--first-seed", type=whole(), default=0, metavar="S")
    add_options(parser)
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Run the command."""
    from lab.campaigns.ablation import SCENARIOS, VARIATIONS, ablation
    from sitl.run.compiled import compile_ahead

    experiment = ablation(
        args.scenarios or SCENARIOS, names=args.only or tuple(VARIATIONS), runs=args.runs, first_seed=args.first_seed
    )
    drawn = {job.case for job in experiment.jobs}
    for planner in (name for name in ALGORITHMS if name == AUTO.algorithm or name in drawn):
        compile_ahead(planner)
    return experiment.run(options_of(args))
