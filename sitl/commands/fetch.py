"""``sitl fetch``: download the official ArduRover simulator, and check what came."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from companion.errors import JobError
from companion.program.arguments import number


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser], summary: str) -> None:
    """Add the command."""
    from sitl.ardurover import URL, fetched_path

    parser = subparsers.add_parser(
        "fetch",
        help=summary,
        description=f"{summary}, for Linux on x86-64, from {URL}",
        epilog="example: sitl fetch && sitl run demo --autopilot ardurover",
    )
    parser.add_argument("--to", type=Path, metavar="FILE", help=f"where to put it (default {fetched_path()})")
    parser.add_argument("--url", default=URL, help="another place to get it from")
    parser.add_argument(
        "--timeout", type=number("s", above=0.0), default=120.0, metavar="S", help="for the download (default 120)"
    )
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Download, check, put in place."""
    from sitl.ardurover import fetch, fetched_path

    target = args.to or fetched_path()
    try:
        version = fetch(args.url, target, timeout_s=args.timeout)
    except JobError as error:
        remedy = "copy an ardurover there yourself, or give --ardurover PATH, or set $ARDUROVER"
        raise JobError(f"{error}; {remedy}") from error
    sys.stdout.write(f"{target}: {version}\n")
    return 0
