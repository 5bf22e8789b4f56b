"""The command line of the companion; its commands are the modules of ``companion.commands``."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from companion.program import Program

PROGRAM = Program(
    name="companion",
    description="Wind, planning and a skipper for an autonomous sailboat beside ArduPilot.",
    package="companion.commands",
    commands={
        "run": "sail a mission",
        "plan": "plan a path for a problem or a mission",
        "wind": "forecast recorded wind and score the forecasts",
        "status": "show the companion's status, heard over the radio",
        "watch": "a dashboard for a terminal, with keys for orders",
        "order": "tell the companion on board what to do",
        "far": "orders and statuses over a satellite link",
        "fence": "check, convert, upload, download fences",
        "mission": "check, make, convert, upload, download missions",
        "field": "preview the vector field that a mission steers by",
        "chart": "make a mission's obstacles and fence from charts",
        "weather": "show what a forecast covers: area, times, members, gaps",
        "passage": "plan a passage in a forecast: route and departure time",
        "boat": "a boat's performance: guess it from her dimensions, learn it, show it, compare it",
        "setup": "write a mission and the settings of its service",
        "doctor": "check whether the autopilot is set up for sailing",
        "key": "make a signing key, put it on the autopilot, take it off",
        "replay": "replay a recorded voyage through today's code",
        "view": "a voyage in a browser, recorded or heard by radio",
        "report": "pictures and a summary of a voyage",
    },
    guests="companion.commands",
)


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command and return its exit code."""
    return PROGRAM.run(argv)


if __name__ == "__main__":
    sys.exit(main())
