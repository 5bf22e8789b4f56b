"""``sitl shown``: every figure that a screen shows, against what came."""

from __future__ import annotations

import argparse
from typing import Any

from companion.program.arguments import out_file, whole
from sitl.commands.run import scenario_file
from sitl.options import add_options, options_of


def add_parser(subparsers: Any, summary: str) -> None:
    """Add the command."""
    parser = subparsers.add_parser(
        "shown",
        help=summary,
        description="Sail scenarios on the embedded autopilot, fold their records into the views that a page shows, "
        "and hold every figure against what came: the time until the goal is reached and by when in nine cases of "
        "ten, by what was left and by what was told; the next tack; the places in 10 to 120 s with their nine-in-ten "
        "radius; the wind in one, two and five minutes; the clearance that a plan expected; the chance of being forced "
        "off the plan; the share of the polar, the distance, tacks and gybes. 'error' is told less came in the "
        "median, 'of it' as a share of what was left, '90 %' what nine in ten errors are below, 'held' how often it "
        "came as it was told. Of a chance 'of it' is what was told in the mean less how often it came, 'held' how "
        "often it did not come.",
        epilog="Example: sitl shown demo --seeds 10",
    )
    parser.add_argument(
        "scenarios",
        type=scenario_file,
        nargs="*",
        metavar="SCENARIO",
        help="(default: the demo, five waters and two winds)",
    )
    parser.add_argument("--seeds", type=whole(at_least=1), default=5, metavar="N", help="of each (default: 5)")
    parser.add_argument("--first-seed", type=whole(), default=0, metavar="S")
    parser.add_argument(
        "--mismatch",
        action="store_true",
        help="boats and waters that are not the plan's, as sitl mismatch draws them, in their place",
    )
    parser.add_argument("--json", type=out_file, metavar="FILE", help="write the tables")
    add_options(parser)
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Run the command."""
    from lab.campaigns.shown import shown
    from sitl.run.compiled import compile_ahead

    compile_ahead("auto")
    experiment = shown(args.scenarios, seeds=args.seeds, first_seed=args.first_seed, mismatch=args.mismatch)
    return experiment.run(options_of(args), args.json)
