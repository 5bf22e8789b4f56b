"""Adopting what somebody has drawn and uploaded under way: the order for it, or why it cannot be."""

from __future__ import annotations

from companion.geofence.mission import hindrance
from companion.skipper.step.actions import AdoptDrawing
from companion.skipper.step.turn import Turn
from companion.words import counted


def adopt(turn: Turn) -> str:
    """Ask for the mission on board to be sailed in place of this voyage; return why not, empty when it is asked for."""
    state = turn.state
    if not state.mission.foreign or state.mission.read_items is None:
        return "nothing drawn is on offer"
    if not turn.config.adopts:
        return "the goals of this voyage are in its mission file: end it, and start companion run --from-autopilot"
    trouble = hindrance(state.mission.read_items)
    if trouble:
        return f"what was drawn cannot be sailed: {trouble}"
    turn.act(AdoptDrawing(
        text=f"the mission of {counted(len(state.mission.read_items), 'item')} that was drawn is adopted"))
    return ""
