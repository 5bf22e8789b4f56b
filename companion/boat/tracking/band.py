"""How far off the line a beat that is left to the autopilot comes: the corridor, and what a tack at its edge swings.

The autopilot tacks where she is a corridor off the line, at most every five seconds; what she sails beyond the edge
depends on her speed and on how squarely she crosses it. A wind that spreads turns her course by as much as the leg may
lie off the wind: so legs off the wind by ``SQUARE_RAD`` to either side stand for it. In winds with a spread of 18.6
degrees nine boards in ten stay within this (a test holds it); which share of the boards of a plan's own legs keeps
clear is judged in drawn winds (``companion.planner.track``).
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from companion.boat.polar import Polar
from companion.boat.tracking.helm import Helm
from companion.boat.tracking.predict import curve_of, predict

BOARDS = 10
SQUARE_RAD = math.radians(25.0)
STEP_MPS = 0.25                # the wind is rounded up to these: answers are kept


def beat_band_m(helm: Helm, polar: Polar, *, tws_mps: float) -> float:
    """Return what the boards of a beat keep within, to either side of the line [m].

    Args:
        helm: How she is steered; with a corridor.
        polar: Her speeds.
        tws_mps: Strength of the wind.

    Raises:
        ValueError: ``helm`` has no corridor: then a beat has no band.

    """
    if helm.corridor_m <= 0.0:
        raise ValueError("without a corridor a beat has no band")
    return _band_m(helm, polar, math.ceil(tws_mps / STEP_MPS - 1e-9) * STEP_MPS)


@lru_cache(maxsize=256)
def _band_m(helm: Helm, polar: Polar, tws_mps: float) -> float:
    curve = curve_of(polar, tws_mps)
    length_m = BOARDS * 2.0 * helm.corridor_m
    worst = helm.corridor_m
    for off in (0.0, SQUARE_RAD, -SQUARE_RAD):
        track = predict([(0.0, 0.0), (0.0, length_m)], helm, curve_mps=curve, twd_from_rad=off)
        worst = max(worst, float(np.max(np.abs(track.en_m[track.beats, 0]), initial=0.0)))
    return worst
