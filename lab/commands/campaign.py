"""``sitl campaign``: a scenario over many seeds."""

from __future__ import annotations

import argparse
from typing import Any

from companion.program.arguments import out_file, out_folder, whole
from lab.options import add_methods, methods_of
from sitl.commands.run import scenario_file
from sitl.options import add_options, options_of


def add_parser(subparsers: Any, summary: str) -> None:
    """Add the command."""
    parser = subparsers.add_parser(
        "campaign",
        help=summary,
        description="Sail a scenario over many seeds on the embedded autopilot: a line per voyage, then a table of "
        "success, time, tacks, replans, clearance and risk. A failing seed is named and repeats exactly. Of two "
        "scenarios, or one by two methods, the voyages are compared seed by seed.",
        epilog="Example: sitl campaign demo --runs 50",
    )
    parser.add_argument(
        "scenarios",
        type=scenario_file,
        nargs="+",
        metavar="SCENARIO",
        help="a scenario or a mission file, or the name of one of ours (sitl run --help)",
    )
    parser.add_argument("--runs", type=whole(at_least=1), default=50, metavar="N", help="seeds 0..N-1 (default: 50)")
    parser.add_argument("--first-seed", type=whole(), default=0, metavar="S")
    parser.add_argument("--json", type=out_file, metavar="FILE", help="write the table's figures")
    parser.add_argument(
        "--keep",
        type=out_folder,
        metavar="DIR",
        help="keep the voyage folders (default: failed ones only, in campaign-failures/)",
    )
    add_methods(parser)
    add_options(parser)
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Run the command."""
    from lab.campaigns.campaign import campaign
    from sitl.run.compiled import compile_ahead

    methods = methods_of(args.guidance, args.planner)
    experiment = campaign(args.scenarios, runs=args.runs, first_seed=args.first_seed, keep=args.keep, methods=methods)
    for planner in dict.fromkeys(method.planner or "auto" for method in methods):
        compile_ahead(planner)
    return experiment.run(options_of(args), args.json)
