"""``sitl encounters``: vessels that would hit our boat, and the rules of the road, by the hundred."""

from __future__ import annotations

import argparse
from typing import Any

from lab.campaigns.encounters import KINDS, POLICIES, Policy
from lab.options import add_seeds, seeds_of
from sitl.options import add_options, options_of


def add_parser(subparsers: Any, summary: str) -> None:
    """Add the command."""
    parser = subparsers.add_parser(
        "encounters",
        help=summary,
        description="Sail short voyages in each of which a vessel would hit our boat: crossing, head-on, overtaking or "
        "overtaken, under sail. Some of the others keep the rules of the road, some keep their course whatever. Judged "
        'by the true tracks: the distance that the mission keeps, and under the policy "rules" who stood on and who '
        "gave way, how early, by how much and on which side. A failing seed is printed and repeats exactly.",
        epilog="Example: sitl encounters --runs 100, then sitl encounters --kind sailing --first-seed 17 --keep v",
    )
    add_seeds(parser, runs=100, of="of each kind")
    parser.add_argument("--kind", choices=KINDS, default=None, help="only these (default: all four)")
    parser.add_argument(
        "--policy", choices=(*POLICIES, "both"), default="rules", help="[traffic] policy of our boat (default: rules)"
    )
    add_options(parser)
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Run the command."""
    from lab.campaigns.encounters import encounters, job_of, sail
    from sitl.run.compiled import compile_ahead
    from sitl.runner import sail_kept

    compile_ahead()
    kinds = KINDS if args.kind is None else (args.kind,)
    policies: tuple[Policy, ...] = POLICIES if args.policy == "both" else (args.policy,)
    seeds = seeds_of(args)
    if seeds.keep is not None:
        return sail_kept(sail, job_of(kinds[0], policies[0], seeds.first, seeds.keep))
    experiment = encounters(runs=seeds.runs, kinds=kinds, policies=policies, first_seed=seeds.first)
    return experiment.run(options_of(args), args.json)
