"""The state in another frame: every place that is remembered is carried over, at one moment between two steps."""

from __future__ import annotations

from companion.frozen import changed
from companion.geo.shift import Shift, carried
from companion.skipper.step.state import SkipperState


def in_water(state: SkipperState, shift: Shift) -> SkipperState:
    """Return a state in the metres of another frame.

    The places of ``history`` stand between a time and a distance.
    """
    new = carried(state, shift)
    history = tuple((t_s, *shift.point((east, north)), to_go_m) for t_s, east, north, to_go_m in state.progress.history)
    return changed(new, progress=changed(new.progress, history=history))
