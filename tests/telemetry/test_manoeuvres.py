"""Tacks and gybes of a voyage: what a boat does that circles in a loiter is none."""

import math
from types import SimpleNamespace

import pytest

from companion.skipper.step import Phase
from companion.telemetry.folder.records import VoyageFigures


@pytest.mark.parametrize(("phase", "gybes"), [(Phase.STANDARD, 10), (Phase.HOLDING, 0)])
def test_circles_of_a_loiter_are_no_gybes(phase, gybes):
    figures = VoyageFigures()
    for t_s in range(1100):  # a side of the wind for 100 s each, running
        heading_deg = 170.0 if t_s // 100 % 2 else 190.0
        figures._wind(
            SimpleNamespace(
                state=SimpleNamespace(phase=phase),
                snapshot=SimpleNamespace(
                    t_s=float(t_s),
                    limits=None,
                    wind=SimpleNamespace(present_twd_from_rad=0.0),
                    vehicle=SimpleNamespace(heading_rad=math.radians(heading_deg)),
                ),
            )
        )
    assert (figures.tacks, figures.gybes) == (0, gybes)
