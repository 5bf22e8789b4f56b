"""``sitl reliability``: what was promised and how often it came, from the voyages of ``sitl mismatch``."""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

from companion.errors import InputError
from companion.program.arguments import out_file


def add_parser(subparsers: Any, summary: str) -> None:
    """Add the command."""
    parser = subparsers.add_parser(
        "reliability",
        help=summary,
        description="Hold what plans promised against what came, over voyages that were sailed: how often the true "
        "wind was in the no-go zone on a leg, by the chance that the plan gave it; how often the margin's floor was "
        "broken, by how much was not the plan's; the time against the expected time. With 95 % intervals (Wilson).",
        epilog="Example: sitl mismatch --runs 200 --out v.jsonl; sitl mismatch --runs 200 --as-planned --out v.jsonl; "
        "sitl reliability v.jsonl --plot reliability.png",
    )
    parser.add_argument("files", type=Path, nargs="+", metavar="VOYAGES.jsonl", help="what sitl mismatch --out wrote")
    parser.add_argument("--plot", type=out_file, metavar="FILE", help="draw the curves")
    parser.add_argument("--json", type=out_file, metavar="FILE", help="write the curves")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Run the command."""
    from lab.campaigns.mismatch import CAMPAIGN
    from lab.campaigns.reliability import as_text, to_dict
    from sitl.runner import read_results

    held = [read_results(path) for path in args.files]
    alien = next((path for path, h in zip(args.files, held, strict=True) if h.campaign != CAMPAIGN), None)
    records = [result for h in held for _, result in h.pairs()]
    if alien is not None or not records:
        raise InputError(
            str(alien or args.files[0]), "", "holds no voyages of sitl mismatch", "name what its --out wrote"
        )
    for name, is_control in (("as planned", True), ("another boat and water", False)):
        mine = [r for r in records if bool(r.get("as_planned")) == is_control]
        if mine:
            print(f"{name}: {as_text(mine)}")
    if args.json is not None:
        args.json.write_text(json.dumps(to_dict(records), indent=1) + "\n", encoding="utf-8")
    if args.plot is not None:
        from lab.campaigns.plots import save_reliability

        save_reliability(records, args.plot)
        print(f"drawn in {args.plot}")
    return 0
