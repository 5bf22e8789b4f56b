"""``sitl shoals``: banks on no chart that a sounder finds, and hours of good water, by the hundred."""

from __future__ import annotations

import argparse
from typing import Any

from companion.program.arguments import out_file, out_folder, whole
from lab.campaigns.shoals import KINDS
from sitl.options import add_options, options_of


def add_parser(subparsers: Any, summary: str) -> None:
    """Add the command."""
    parser = subparsers.add_parser(
        "shoals",
        help=summary,
        description="Sail over banks that are on no chart, with a sounder that errs, in any wind and tide. A keel that "
        "strikes is a fault where she could have turned in the time from the first alarm that the true depth gives; "
        "where no turn was possible it is excused if it was told. And hours of good water through the sounder's "
        "statistics: each alarm there is a false one. A failing seed is printed and repeats exactly.",
        epilog="Example: sitl shoals --runs 500, then sitl shoals --kind bank --first-seed 17 --keep v",
    )
    parser.add_argument(
        "--runs", type=whole(at_least=1), default=100, metavar="N", help="seeds to sail of each kind (default: 100)"
    )
    parser.add_argument("--kind", choices=KINDS, default=None, help="only these (default: both)")
    parser.add_argument("--first-seed", type=whole(), default=0, metavar="S", help="the first of them (default: 0)")
    parser.add_argument("--json", type=out_file, metavar="FILE", help="write what came of each")
    parser.add_argument(
        "--keep", type=out_folder, metavar="DIR", help="sail only the first seed and keep its voyage folder"
    )
    add_options(parser)
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Run the command."""
    from lab.campaigns.shoals import job_of, sail, shoals
    from sitl.run.compiled import compile_ahead
    from sitl.runner import sail_kept

    compile_ahead()
    kinds = KINDS if args.kind is None else (args.kind,)
    if args.keep is not None:
        return sail_kept(sail, job_of(kinds[0], args.first_seed, args.keep))
    return shoals(runs=args.runs, kinds=kinds, first_seed=args.first_seed).run(options_of(args), args.json)
