"""``sitl demo``: the demonstration, from any folder."""

from __future__ import annotations

from typing import Any

from sitl.commands.run import OURS, add_options


def add_parser(subparsers: Any, summary: str) -> None:
    """Add the command."""
    parser = subparsers.add_parser(
        "demo",
        help=summary,
        description="Sail round an archipelago in a shifting wind: autopilot, weather and companion are processes of "
        "their own over UDP, eight times as fast as real time. A picture and the record are left in the voyage's "
        "folder.",
    )
    add_options(parser)
    parser.set_defaults(scenario=OURS["demo"], live=True)
