"""``sitl encounters``: vessels that would hit our boat, and the rules of the road, by the hundred."""

from __future__ import annotations

import argparse
from typing import Any

from companion.program.arguments import out_file, out_folder, whole
from lab.campaigns.encounters import KINDS, POLICIES, Policy
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
    parser.add_argument(
        "--runs", type=whole(at_least=1), default=100, metavar="N", help="seeds to sail of each kind (default: 100)"
    )
    parser.add_argument("--kind", choices=KINDS, default=None, help="only these (default: all four)")
    parser.add_argument(
        "--policy", choices=(*POLICIES, "both"), default="rules", help="[traffic] policy of our boat (default: rules)"
    )
    parser.add_argument("--first-seed", type=whole(), default=0, metavar="S", help="the first of them (default: 0)")
    parser.add_argument("--json", type=out_file, metavar="FILE", help="write figures and voyages")
    parser.add_argument(
        "--keep", type=out_folder, metavar="DIR", help="sail only the first seed and keep its voyage folder"
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
    if args.keep is not None:
        return sail_kept(sail, job_of(kinds[0], policies[0], args.first_seed, args.keep))
    experiment = encounters(runs=args.runs, kinds=kinds, policies=policies, first_seed=args.first_seed)
    return experiment.run(options_of(args), args.json)
