"""``companion replay``: fold a recorded voyage again and report what came out differently."""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

from companion.commands.output import Folding

SHOWN = 5


def add_parser(subparsers: Any, summary: str) -> None:
    """Add the command."""
    parser = subparsers.add_parser(
        "replay",
        help=summary,
        description="Feed a recorded voyage's messages, outcomes and ticks through today's code and compare every "
        "action with the one recorded. Exit code 1 when something differs.",
        epilog="Example: companion replay voyages/20260714T101500Z-archipelago",
    )
    parser.add_argument("voyage", type=Path, metavar="VOYAGE_DIR", help="the folder that `companion run` left")
    parser.add_argument("--mission", type=Path, metavar="MISSION.toml", help="where the mission file is now")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Run the command."""
    from companion.replay import replay
    from companion.words import counted

    with Folding() as told:
        report = replay(args.voyage, args.mission, told=told)
    print(
        f"{counted(report.steps, 'step')}, {counted(report.messages, 'message')}, "
        f"{counted(report.actions, 'action')}, {counted(report.restarts, 'restart')}: "
        f"{counted(len(report.differences), 'difference')}"
    )
    if report.lost:
        print(
            f"{counted(report.lost, 'message')} that the steps heard were not found in the telemetry log: "
            "what differs may be for want of them"
        )
    if report.unrecorded:
        print(f"{counted(report.unrecorded, 'more step')} came after a gap in the records, and were not compared")
    for difference in report.differences[:SHOWN]:
        print(f"  t = {difference.t_s:.1f} s")
        print(f"    recorded {json.dumps(difference.recorded)[:400]}")
        print(f"    replayed {json.dumps(difference.replayed)[:400]}")
    if not report.differences and report.steps:
        print("today's code decides as it did under way; nothing was written")
    return 1 if report.differences else 0
