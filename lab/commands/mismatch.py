"""``sitl mismatch``: boats, seas and sensors that are not the plan's, by the hundred."""

from __future__ import annotations

import argparse
from typing import Any

from companion.errors import InputError
from lab.options import add_draw, add_seeds, compile_planners, seeds_of
from sitl.options import add_options, options_of


def add_parser(subparsers: Any, summary: str) -> None:
    """Add the command."""
    parser = subparsers.add_parser(
        "mismatch",
        help=summary,
        description="Sail the waters of the repository, each voyage with what the plan does not know of, drawn from "
        "its seed: current and tide, gusts, lees and gradients of the wind, waves, a polar that errs by up to 20 %, "
        "leeway, tacks that fail, a turned vane, a compass and a position that err. Judged by the truth: contact, "
        "silence and errors fail a voyage; the margin's floor, the risk and the time that were promised are held "
        "against what came. A seed repeats exactly.",
        epilog="Example: sitl mismatch --runs 200 --out mismatch.jsonl, then sitl mismatch --first-seed 17 --keep v",
    )
    add_seeds(parser, runs=100)
    parser.add_argument(
        "--planned",
        action="store_true",
        help="no beat is left to the autopilot: every board is planned, and its risk promised",
    )
    which = parser.add_mutually_exclusive_group()
    which.add_argument(
        "--as-planned",
        action="store_true",
        help="the control: the same waters and winds, and nothing that the plan does not know of",
    )
    which.add_argument(
        "--only",
        action="append",
        metavar="KIND",
        help="every voyage has this, and nothing else; may be repeated (a wrong name lists them)",
    )
    add_draw(parser)
    add_options(parser)
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Run the command."""
    from lab.campaigns.drawn_mismatch import KINDS
    from lab.campaigns.mismatch import MismatchCase, job_of, mismatch, sail
    from sitl.runner import sail_kept

    compile_planners(args.draw)
    only = () if args.as_planned else None if args.only is None else tuple(args.only)
    alien = next((kind for kind in only or () if kind not in KINDS), None)
    if alien is not None:
        raise InputError("--only", alien, "is not drawn", f"name one of: {', '.join(KINDS)}")
    case = MismatchCase(planned=args.planned, only=only, draws=args.draw)
    seeds = seeds_of(args)
    if seeds.keep is not None:
        return sail_kept(sail, job_of(seeds.first, case, seeds.keep))
    return mismatch(case, runs=seeds.runs, first_seed=seeds.first).run(options_of(args), args.json)
