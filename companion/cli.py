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
        "plan": "plan a path on a problem",
        "wind": "forecast a wind record and score the forecasts",
        "status": "what the companion says over the radio",
        "watch": "a dashboard for a terminal, with keys for orders",
        "order": "tell the companion on board what to do",
        "far": "orders and statuses over a satellite link",
        "fence": "check, convert, upload, download fences",
        "mission": "check, make, convert, upload, download missions",
        "field": "what a field that a mission composes would do",
        "chart": "charts become the obstacles and the fence of a mission",
        "weather": "what a forecast holds: where, when, members, holes",
        "passage": "where to go in a forecast, and when",
        "boat": "what a boat can do: guess it from her sizes, show it, compare it",
        "setup": "write a mission and the settings of its service",
        "doctor": "is this autopilot set up to be sailed?",
        "key": "make a signing key, put it on the autopilot, take it off",
        "replay": "fold a recorded voyage again",
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
