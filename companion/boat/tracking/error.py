"""What the predicted track is wrong by: the 99 % of its residuals on the real ArduRover.

``python -m bench.tracking`` measures it on ArduRover 4.7.0-dev: 25 voyages of 14 to 34 legs each, WP_RADIUS 1 to 10,
corners of 10 to 170 degrees, legs of 2 to 100 m; docs/tracking.md has the figures. A leg is short when the boat at her
best speed is there in less than ``SHORT_S``: she then overtakes the point that she follows and turns round to it, and
which way round is chance.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

SHORT_S = 4.5
# Best speed [m/s] -> 99 % of the distance between sailed and predicted track [m], where this leg, the one before and
# the one after are long, and where one of them is short. Rounded up.
SPEEDS_MPS = (0.5, 1.2, 2.3, 3.3, 4.4)
LONG_M = (1.4, 1.4, 1.4, 1.9, 6.6)
SHORT_M = (2.4, 2.4, 3.1, 6.3, 7.4)
# ... and the greatest that was sailed where one of them is short, by the best speeds that it was sailed at: a voyage
# round a row of such corners meets each of them, and the 99 % of one place is no promise for a hundred.
LOOP_SPEEDS_MPS = (0.5, 1.2, 2.3, 2.95, 3.3, 4.4)
LOOP_M = (2.7, 2.7, 4.1, 9.6, 10.0, 11.1)


def stated_error_m(best_mps: float, *, has_short: bool) -> float:
    """Return the prediction's error [m] for a boat whose best speed in this wind is ``best_mps``.

    Above the fastest that was measured it grows with the speed.
    """
    table = SHORT_M if has_short else LONG_M
    return float(np.interp(best_mps, SPEEDS_MPS, table)) * max(1.0, best_mps / SPEEDS_MPS[-1])


def loop_m(best_mps: float) -> float:
    """Return how far off her track [m] a loop about the end of a short leg takes a boat of a best speed."""
    return float(np.interp(best_mps, LOOP_SPEEDS_MPS, LOOP_M)) * max(1.0, best_mps / LOOP_SPEEDS_MPS[-1])


def are_near_short(lengths_m: Sequence[float] | NDArray[np.float64], best_mps: float) -> NDArray[np.bool_]:
    """Return for each leg whether it, the one before or the one after is short."""
    short = np.asarray(lengths_m, dtype=np.float64) < SHORT_S * best_mps
    padded = np.concatenate([[False], short, [False]])
    return np.asarray(padded[:-2] | padded[1:-1] | padded[2:])
