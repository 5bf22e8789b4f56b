"""The simulator's kernels and the companion's, compiled before anything sails: once on each machine."""

from __future__ import annotations

import sys

from companion.kernels.build import prepare
from companion.telemetry.console import CompileProgress


def compile_ahead(planner: str = "auto") -> None:
    """Compile what is missing and say how far it is; before a boat is afloat, for a disarmed one drifts meanwhile.

    The kernels of a planner of somebody's choice are not on the list of those that every voyage needs.
    """
    with CompileProgress(sys.stderr) as preparing:
        prepare(("companion", "sitl"), say=preparing.say)
        if planner != "auto":
            from companion.planner.solve import warm

            preparing.say(f"compiling the kernels of {planner}, once on each machine")
            warm(planner)
