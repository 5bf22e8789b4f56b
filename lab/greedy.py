"""The greedy sailor: the heading that makes most way towards the goal now, after Stelzer and Pröll 2008.

No plan: every second the boat's speed on each heading is projected onto the direction of the goal, and the best heading
of each side of the wind compared. She stays on her side unless the other is better by ``1 + beating_m / distance``, so
that boards become shorter towards the goal. Obstacles are none of its business, as they are none of theirs.
"""

from __future__ import annotations

import math

import numpy as np

from companion.boat import Polar
from companion.geo.angles import wrap_pi

BEATING_M = 50.0  # theirs is a length to be set: how much better the other side must be, at that distance twice as good
_STEP_RAD = math.radians(1.0)


def best_heading(
    polar: Polar,
    *,
    twd_from_rad: float,
    tws_mps: float,
    way_en_m: tuple[float, float],
    heading_rad: float,
    beating_m: float = BEATING_M,
) -> float:
    """Return the heading to steer [rad].

    Args:
        polar: The boat's speeds.
        twd_from_rad: Where the true wind comes from.
        tws_mps: How strong it is.
        way_en_m: From the boat to the goal.
        heading_rad: Hers: the side of the wind that she is on.
        beating_m: 0: the better side at once.

    """
    distance_m = math.hypot(*way_en_m)
    bearing_rad = math.atan2(*way_en_m)
    twa = np.arange(0.0, math.pi + 0.5 * _STEP_RAD, _STEP_RAD)
    speeds = polar.speeds_mps(twa, tws_mps)
    found = []
    for side in (1.0, -1.0):
        headings = twd_from_rad + side * twa
        made_good = speeds * np.cos(headings - bearing_rad)
        best = int(np.argmax(made_good))
        found.append((float(made_good[best]), wrap_pi(float(headings[best]))))
    is_right = wrap_pi(heading_rad - twd_from_rad) >= 0.0  # of the wind, on port tack
    (mine, steered), (other, across) = found if is_right else found[::-1]
    return across if other > mine * (1.0 + beating_m / max(distance_m, 1.0)) else steered
