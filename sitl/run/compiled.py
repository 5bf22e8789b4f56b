"""The simulator's kernels and the companion's, compiled before anything sails: once on each machine."""

from __future__ import annotations

import sys

from companion.kernels.build import prepare
from companion.telemetry.preparing import Preparing


def compile_ahead() -> None:
    """Compile what is missing and say how far it is; before a boat is afloat, for a disarmed one drifts meanwhile."""
    with Preparing(sys.stderr) as preparing:
        prepare(("companion", "sitl"), say=preparing.say)
