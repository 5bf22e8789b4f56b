"""What is said of the current: when plans begin to reckon with one, when it has become another, and what is not known.

A tide table that has ended, or that no time can be found in, is said as soon as she is under way and every half hour.
"""

from __future__ import annotations

import math

from companion.frozen import changed
from companion.skipper.step.actions import Severity
from companion.skipper.step.turn import Turn

ANOTHER_MPS = 0.25       # it is said again when it has changed by so much
REMIND_S = 1800.0


def watch_water(turn: Turn) -> None:
    """Say what is new of the current."""
    current, told = turn.snapshot.current, turn.state.announced.water_en_mps
    if not turn.state.voyage.sailing:
        return
    if current.verdict:
        turn.say(Severity.WARNING, "tide table", current.verdict, every_s=REMIND_S)
    if not current.is_significant:
        if told is not None:
            turn.set(announced=changed(turn.state.announced, water_en_mps=None))
            turn.say(Severity.INFO, "current", "the current is no longer told from still water: plans leave it out",
                     every_s=0.0)
        return
    if told is None or math.dist(told, current.en_mps) >= ANOTHER_MPS:
        turn.set(announced=changed(turn.state.announced, water_en_mps=current.en_mps))
        turn.say(Severity.INFO, "current", f"{current.sentence()}: plans reckon with it", every_s=0.0)
