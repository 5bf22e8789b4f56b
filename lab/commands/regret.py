"""``sitl regret``: the time of every sailor over the best that could have been made of the same wind."""

from __future__ import annotations

import argparse
from typing import Any

from companion.program.arguments import out_file
from lab.commands.baselines import SAILORS, add_voyages, add_winds
from sitl.options import add_options, options_of


def add_parser(subparsers: Any, summary: str) -> None:
    """Add the command."""
    parser = subparsers.add_parser(
        "regret",
        help=summary,
        description="Sail scenarios with each sailor of 'sitl baselines', and solve for the best time in the wind that "
        "she met, known in advance: by the simulated hull's own speeds and what a tack costs her, clear of everything "
        "solid by half her length and no more. Printed: time over that best, the median and 10 and 90 %; how far the "
        "best is over a bound that ignores what is solid; and what the search's finest grid gained over one half as "
        "fine. The default is those on the embedded autopilot.",
        epilog="Example: sitl regret --seeds 20 --out regret.jsonl --plot regret.png",
    )
    parser.add_argument(
        "--who",
        nargs="+",
        choices=SAILORS,
        default=["companion", "fixed", "alone-embedded"],
        help="sailors (default: companion fixed alone-embedded)",
    )
    add_voyages(parser, usual="the six of sitl baselines")
    parser.add_argument("--json", type=out_file, metavar="FILE", help="write the table's figures")
    parser.add_argument(
        "--plot",
        type=out_file,
        metavar="FILE",
        help="draw seed 0 of the first scenario: what each sailor sailed over the clairvoyant's track",
    )
    add_winds(parser)
    add_options(parser, workers=1)
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Run the command."""
    from lab.campaigns.baselines import SCENARIOS, jobs_of
    from lab.campaigns.regret import draw_regret, regret, require_judged
    from sitl.run.compiled import compile_ahead

    scenarios = args.scenarios or SCENARIOS
    for path in scenarios:
        require_judged(path)
    compile_ahead()
    jobs = jobs_of(args.who, scenarios, args.seeds, args.speedup, args.winds)
    code = regret(jobs, against=args.against).run(options_of(args), args.json)
    if args.plot is not None:
        draw_regret(jobs_of(args.who, scenarios[:1], 1, args.speedup, args.winds and args.winds[:1]), args.plot)
        print(f"drawn in {args.plot}")
    return code
