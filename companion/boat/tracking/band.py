"""How far off the line a beat that is left to the autopilot comes, at each of its boards, in a wind that spreads.

The autopilot tacks where she is a corridor off the line, at most every five seconds; what she sails beyond the edge
depends on her speed, on how squarely she crosses it, and on how the wind turns on the way. All that is in the
prediction: a long leg is beaten in many winds, and each board's farthest point is noted.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from companion.boat.polar import Polar
from companion.boat.tracking.helm import Helm
from companion.boat.tracking.predict import curve_of, drawn_winds, predict

BOARDS = 14                 # of a leg without spread: enough for the 98 % of 24 winds
SQUARE_RAD = math.radians(25.0)   # off the wind: of a leg whose short boards cross its line almost squarely
STEP_MPS, STEP_RAD = 0.25, math.radians(1.0)   # what is asked for is rounded up to these: answers are kept


def beat_band_m(
    helm: Helm, polar: Polar, *, tws_mps: float, sigma_rad: float, tau_s: float, delta_s: float,
) -> float:
    """Return what each board keeps within, to either side of the line [m], with the probability ``delta_s``.

    Args:
        helm: How she is steered; with a corridor.
        polar: Her speeds.
        tws_mps: Strength of the wind.
        sigma_rad: Spread of its direction.
        tau_s: How long its direction remembers [s].
        delta_s: Probability, at each board.

    Raises:
        ValueError: ``helm`` has no corridor: then a beat has no band.

    """
    if helm.corridor_m <= 0.0:
        raise ValueError("without a corridor a beat has no band")
    wind = math.ceil(tws_mps / STEP_MPS - 1e-9) * STEP_MPS
    sigma = math.ceil(sigma_rad / STEP_RAD - 1e-9) * STEP_RAD
    return _band_m(helm, polar, wind, sigma, float(round(tau_s)), delta_s)


@lru_cache(maxsize=256)
def _band_m(helm: Helm, polar: Polar, tws_mps: float, sigma_rad: float, tau_s: float, delta_s: float) -> float:
    curve = curve_of(polar, tws_mps)
    speed = float(np.interp(helm.no_go_half_rad, np.linspace(0.0, math.pi, len(curve)), curve))
    if speed <= 0.0:
        return helm.corridor_m
    board_m = 2.0 * helm.corridor_m / max(math.tan(helm.no_go_half_rad), 0.3)
    length_m = BOARDS * board_m
    length_s = 3.0 * length_m / (speed * math.cos(helm.no_go_half_rad)) + 60.0
    winds = np.zeros((1, 2))
    if sigma_rad > 0.0:
        winds = drawn_winds(0.0, sigma_rad=sigma_rad, tau_s=tau_s, length_s=length_s)
    worst = helm.corridor_m
    for off in (0.0, SQUARE_RAD):
        # the leg's direction is kept to north, the wind is turned
        far: list[float] = []
        for wind in winds:
            track = predict([(0.0, 0.0), (0.0, length_m)], helm, curve_mps=curve, twd_from_rad=wind - off)
            across = track.en_m[track.beats, 0]
            if len(across):
                boards = np.floor(track.en_m[track.beats, 1] / board_m).astype(np.int64)
                far += [float(np.max(np.abs(across[boards == b]))) for b in np.unique(boards)]
        if far:
            worst = max(worst, float(np.quantile(far, delta_s)))
    return worst
