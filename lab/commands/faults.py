"""``sitl faults``: random but repeatable trouble by the thousand."""

from __future__ import annotations

import argparse
from typing import Any

from companion.errors import InputError
from lab.options import add_draw, add_seeds, compile_planners, seeds_of
from sitl.options import add_options, options_of

# What else may be drawn beside a seed's own faults, of the campaign that has them.
BESIDE = {
    "jump": "a false position, half of them onto something solid",
    "vane": "turned under way, or its offset set",
    "outlets": "page, its token, socket and satellite folder that cannot be used",
    "card": "full or read-only",
}


def add_parser(subparsers: Any, summary: str) -> None:
    """Add the command."""
    parser = subparsers.add_parser(
        "faults",
        help=summary,
        description="Sail a short voyage many times, each with faults drawn from its seed: bad and cut links, broken "
        "vanes and compasses, false positions, wind shifts, calms, currents, a planner that dies or hangs, a companion "
        "that is killed with its state and clock spoilt, full disks, an autopilot that reboots and its failsafes, an "
        "operator, neighbours, forgers, a stranger's mission. None may end in a contact of the hull that was to "
        "be helped, below the margin's floor in ordinary weather, in a mission that is a mixture, in silence or in an "
        "unhandled error. A failing seed is printed and repeats exactly.",
        epilog="Example: sitl faults --runs 1000, then sitl faults --first-seed 17 --keep v",
    )
    add_seeds(parser, runs=1000)
    what = parser.add_mutually_exclusive_group()
    what.add_argument(
        "--jumps",
        dest="trouble",
        action="store_const",
        const="jumps",
        default="all",
        help="false positions alone, each sailed again by who only holds her in LOITER",
    )
    what.add_argument(
        "--turned-vane",
        dest="trouble",
        action="store_const",
        const="turned-vane",
        help="beside what is drawn: the vane turned by 60 degrees or more under way, or its offset set",
    )
    what.add_argument(
        "--worker",
        dest="trouble",
        action="store_const",
        const="worker",
        help="the planner's real process, killed, stopped, out of memory: in real time (a minute each)",
    )
    add_draw(parser, BESIDE)
    add_options(parser)
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Run the command."""
    from lab.campaigns.faults import FaultCase, faults, job_of, sail
    from sitl.runner import sail_kept

    beside = [what for what in args.draw if what in BESIDE]
    if beside and args.trouble != "all":
        raise InputError("--draw", beside[0], f"is not drawn with --{args.trouble}", "leave out one of them")
    compile_planners(args.draw)
    case = FaultCase(trouble=args.trouble, draws=args.draw)
    seeds = seeds_of(args)
    if seeds.keep is not None:
        return sail_kept(sail, job_of(seeds.first, case, seeds.keep))
    return faults(case, runs=seeds.runs, first_seed=seeds.first).run(options_of(args), args.json)
