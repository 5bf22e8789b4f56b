"""``companion report``: pictures and a summary of a recorded voyage."""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

from companion.arguments import picture


def add_parser(subparsers: Any, summary: str) -> None:
    """Add the command."""
    parser = subparsers.add_parser(
        "report", help=summary, description="Draw a recorded voyage and print its summary.",
        epilog="Example: companion report voyages/20260714T101500Z-archipelago",
    )
    parser.add_argument("voyage", type=Path, metavar="VOYAGE_DIR", help="the folder that `companion run` left")
    parser.add_argument("--out", type=picture, metavar="FILE", help="the picture (default: voyage.png in the folder)")
    parser.add_argument("--json", action="store_true", help="print summary.json and draw nothing")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Run the command."""
    from companion.plots.voyage import plot_voyage, read_voyage
    from companion.telemetry.names import PICTURE

    record = read_voyage(args.voyage)
    if args.json:
        print(json.dumps(record.summary, indent=1))
        return 0
    out = args.out or args.voyage / PICTURE
    plot_voyage(record, out)
    for key, value in record.summary.items():
        shown = f"{value:.1f}" if isinstance(value, float) else value
        print(f"{key:20} {shown}")
    reasons: dict[str, int] = {}
    for decision in record.decisions:
        if decision.get("kind") == "plan":
            reasons[str(decision.get("reason"))] = reasons.get(str(decision.get("reason")), 0) + 1
    print(f"{'plans by reason':20} " + ", ".join(f"{k} {n}" for k, n in sorted(reasons.items())))
    print(f"{'picture':20} {out}")
    return 0
