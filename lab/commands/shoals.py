"""``sitl shoals``: banks on no chart that a sounder finds, and hours of good water, by the hundred."""

from __future__ import annotations

import argparse
from typing import Any

from lab.campaigns.shoals import KINDS
from lab.options import add_seeds, seeds_of
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
    add_seeds(parser, runs=100, of="of each kind")
    parser.add_argument("--kind", choices=KINDS, default=None, help="only these (default: both)")
    add_options(parser)
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Run the command."""
    from lab.campaigns.shoals import job_of, sail, shoals
    from sitl.run.compiled import compile_ahead
    from sitl.runner import sail_kept

    compile_ahead()
    kinds = KINDS if args.kind is None else (args.kind,)
    seeds = seeds_of(args)
    if seeds.keep is not None:
        return sail_kept(sail, job_of(kinds[0], seeds.first, seeds.keep))
    return shoals(runs=seeds.runs, kinds=kinds, first_seed=seeds.first).run(options_of(args), args.json)
