"""The state in another frame: every place that is remembered is carried over, at one moment between two steps."""

from __future__ import annotations

from dataclasses import replace

from companion.geo.shift import Shift, carried
from companion.skipper.step.state import Fix, SkipperState


def in_water(state: SkipperState, shift: Shift) -> SkipperState:
    """Return a state in the metres of another frame.

    The places of ``history`` stand between a time and a distance, and what is in ``doubt`` is no place but a way.
    """
    doubt = state.doubt
    return replace(
        carried(replace(state, doubt=None), shift),
        history=tuple((t_s, *shift.point((east, north)), to_go_m) for t_s, east, north, to_go_m in state.history),
        doubt=None if doubt is None else Fix(t_s=doubt.t_s, en_m=shift.vector(doubt.en_m)))
