"""The wind of a boat that does not sail: plans and rules that ask for one are given this, and none is waited for.

A motorboat has no no-go zone and the same speed at every angle, so that any wind is as good as none; what its vane, if
it has one, tells is on record and in the status, and steers nothing.
"""

from __future__ import annotations

import numpy as np

from companion.messages import WindForecast
from companion.skipper.step.snapshot import WindHealth, WindView

SPEED_MPS = 5.0
SIGMA_RAD = 1e-3
SETTLED_S = 1e6
_HORIZONS_S = np.array([0.0, 3600.0])
_LEVELS = np.array([0.5, 0.8, 0.9, 0.95])


def still_air(t_s: float) -> WindView:
    """Return the wind that a motorboat is planned in: steady, believed, and of no consequence."""
    n = len(_HORIZONS_S)
    forecast = WindForecast(
        t_s=t_s, horizon_s=_HORIZONS_S, mean_twd_from_rad=np.zeros(n), sigma_twd_rad=np.full(n, SIGMA_RAD),
        mean_tws_mps=np.full(n, SPEED_MPS), sigma_tws_mps=np.full(n, SIGMA_RAD), level=_LEVELS,
        half_width_rad=np.full((n, len(_LEVELS)), SIGMA_RAD), correlation_time_s=3600.0)
    return WindView(
        health=WindHealth.GOOD, forecast=forecast, mean_twd_from_rad=0.0, mean_tws_mps=SPEED_MPS,
        sigma_twd_rad=SIGMA_RAD, present_twd_from_rad=0.0, present_tws_mps=SPEED_MPS, record_s=SETTLED_S)
