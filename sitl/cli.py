"""The simulator's command line; its commands are the modules of ``sitl.commands``, and the laboratory's.

Those of the laboratory, which a boat does not carry, are known here by name.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence

from companion.program import ExtraCommands, Program

LABORATORY = ExtraCommands(
    name="the laboratory",
    package="lab.commands",
    remedy="in the clone of this project: pip install ./lab",
    commands={
        "campaign": "a scenario over many seeds: success, risk, time",
        "faults": "a short voyage a thousand times, each with trouble of its own",
        "encounters": "vessels that would hit the boat, by the hundred: the rules of the road",
        "shoals": "banks on no chart that a sounder finds, and hours of good water, by the hundred",
        "mismatch": "boats, seas and sensors that are not the plan's, by the hundred",
        "search": "draws that are moved towards contact until one touches",
        "shown": "every figure that a screen shows, against what came",
        "reliability": "what was promised and how often it came, over the voyages of a campaign",
        "ablate": "what each part is worth: the same weather with one thing taken away",
        "baselines": "the companion against ArduRover alone and with its own path planning",
        "regret": "every sailor's time over the best that could have been made of the same wind",
        "results": "what campaigns left: shown, joined, held against each other by seed",
        "hostile": "forge what the companion reads, and see what comes of it",
    },
)
PROGRAM = Program(
    name="sitl",
    description="A simulated ArduRover sailboat, weather, and scenarios for the companion.",
    package="sitl.commands",
    commands={
        "demo": "the archipelago, with live progress: what a new user sees first",
        "boat": "the simulated autopilot alone, for any MAVLink client",
        "run": "sail a scenario: autopilot, weather, companion, verdict",
        "example": "a scenario with a comment at every key, to begin your own from",
        "fetch": "download the official ArduRover simulator",
    },
    annex=LABORATORY,
)


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command and return its exit code."""
    return PROGRAM.run(argv)


if __name__ == "__main__":
    sys.exit(main())
