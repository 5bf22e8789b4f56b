"""``sitl search``: failures sought instead of drawn blindly."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from companion.program.arguments import out_folder, whole
from sitl.commands.run import scenario_file
from sitl.options import add_options, options_of


def add_parser(subparsers: Any, summary: str) -> None:
    """Add the command."""
    parser = subparsers.add_parser(
        "search",
        help=summary,
        description="Look for voyages that touch something: those of a generation that came nearest are kept, what was "
        "drawn for them is moved a little, and so on, level by level, until one touches. What is drawn is what 'sitl "
        "mismatch' or 'sitl faults' draws. A voyage that fails is left as a scenario that 'sitl run' repeats.",
        epilog="Example: sitl search faults --runs 400 --out search.jsonl",
    )
    parser.add_argument("what", choices=("mismatch", "faults"), help="what is drawn")
    parser.add_argument(
        "--water",
        type=scenario_file,
        metavar="SCENARIO",
        help="mismatch: where it is sailed (default: the narrow channel)",
    )
    parser.add_argument(
        "--runs", type=whole(at_least=1), default=400, metavar="N", help="voyages at most (default: 400)"
    )
    parser.add_argument(
        "--each",
        type=whole(at_least=4),
        default=40,
        metavar="N",
        help="voyages of a generation, of which a quarter is kept (default: 40)",
    )
    parser.add_argument("--first-seed", type=whole(), default=0, metavar="S", help="of the search itself (default: 0)")
    parser.add_argument(
        "--blind", action="store_true", help="draw every generation anew: what there is to compare with"
    )
    parser.add_argument(
        "--found",
        type=out_folder,
        default=Path("found"),
        metavar="DIR",
        help="where scenarios of what fails are left (default: found)",
    )
    add_options(parser)
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Run the command."""
    from companion.errors import InputError
    from lab.campaigns.faults import BASE
    from lab.campaigns.search import NARROW, run_search
    from sitl.run.compiled import compile_ahead

    if args.what == "faults" and args.water is not None:
        raise InputError("--water", str(args.water), "is for mismatch", "faults have a water of their own")
    compile_ahead()
    scenario = BASE if args.what == "faults" else args.water or NARROW
    return run_search(
        what=args.what,
        scenario=scenario,
        runs=args.runs,
        each=args.each,
        first_seed=args.first_seed,
        is_blind=args.blind,
        found=args.found,
        options=options_of(args),
    )
