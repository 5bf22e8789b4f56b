"""Tracking: the track that the autopilot will really sail along given legs, and what that prediction is wrong by.

>>> import numpy as np
>>> from companion.boat import ardurover_sitl
>>> track = predict([(0.0, 0.0), (60.0, 0.0), (60.0, -60.0)], Helm(wp_radius_m=10.0, wp_speed_mps=5.0),
...                 curve_mps=curve_of(ardurover_sitl(), 5.0), twd_from_rad=0.0)
>>> round(float(np.min(np.hypot(track.en_m[:, 0] - 60.0, track.en_m[:, 1]))), 1)
10.5
"""

from companion.boat.tracking.band import beat_band_m
from companion.boat.tracking.error import SHORT_S, are_near_short, loop_m, stated_error_m
from companion.boat.tracking.helm import CURVE_NODES, Helm
from companion.boat.tracking.predict import Predicted, curve_of, drawn_winds, predict

__all__ = [
    "CURVE_NODES", "SHORT_S", "Helm", "Predicted", "are_near_short", "beat_band_m", "curve_of", "drawn_winds",
    "loop_m", "predict", "stated_error_m",
]
