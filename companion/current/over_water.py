"""The wind over the water: what sails and polars are of, from the wind over the ground and the current.

From-vectors point at where the wind comes from, so that the air's motion over the ground is -G. Over the water it is
-G - C, with C the current's motion: the from-vector over water is

    W = G + C                                                                                                 (a)

Still air over a current of 0.5 m/s to the north is a wind of 0.5 m/s from the north. ArduRover's WIND is G (apparent
wind and the filter's velocity over ground), and its no-go angle is about G; a polar is of W.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from companion.current.value import WaterCurrent
from companion.geo.angles import heading_of, wrap_two_pi
from companion.messages import WindForecast

LEAST_MPS = 0.05     # [m/s] a wind over the water below this has no direction


def over_water(
    twd_from_rad: float, tws_mps: float, current_en_mps: tuple[float, float],
) -> tuple[float, float]:
    """Return the wind over the water (from [rad], speed [m/s]) of a wind over the ground in a current.

    >>> from_rad, speed = over_water(0.0, 5.0, (0.0, 0.5))     # the current sets into the wind: more of it
    >>> round(speed, 3)
    5.5
    """
    if current_en_mps == (0.0, 0.0):
        return twd_from_rad, tws_mps
    east = tws_mps * math.sin(twd_from_rad) + current_en_mps[0]                               # (a)
    north = tws_mps * math.cos(twd_from_rad) + current_en_mps[1]
    speed = math.hypot(east, north)
    return (wrap_two_pi(heading_of(east, north)) if speed > 0.0 else twd_from_rad), speed


def over_ground(
    twd_from_rad: float, tws_mps: float, current_en_mps: tuple[float, float],
) -> tuple[float, float]:
    """Return the wind over the ground of a wind over the water: the inverse of ``over_water``."""
    return over_water(twd_from_rad, tws_mps, (-current_en_mps[0], -current_en_mps[1]))


def forecast_over_water(forecast: WindForecast, current: WaterCurrent) -> WindForecast:
    """Return the forecast of the wind over the water in a current that stays as it is.

    Spreads are carried over to first order: what the direction's and the speed's errors over ground, and the current's
    own, are across the wind over the water and along it. Half widths grow as the direction's sigma does.
    """
    from_rad, speed = forecast.mean_twd_from_rad, forecast.mean_tws_mps
    ground = np.column_stack([speed * np.sin(from_rad), speed * np.cos(from_rad)])
    water = ground + np.asarray(current.en_mps)                                               # (a)
    size = np.maximum(np.hypot(water[:, 0], water[:, 1]), LEAST_MPS)
    along = np.where(size[:, None] > LEAST_MPS, water / size[:, None], np.column_stack([
        np.sin(from_rad), np.cos(from_rad)]))
    across = np.column_stack([along[:, 1], -along[:, 0]])
    unit = np.column_stack([np.sin(from_rad), np.cos(from_rad)])
    side = np.column_stack([unit[:, 1], -unit[:, 0]])
    turned, blown = speed * forecast.sigma_twd_rad, forecast.sigma_tws_mps

    def spread(of: NDArray[np.float64]) -> NDArray[np.float64]:
        doubt = np.asarray([current.sigma_along_mps(float(e), float(n)) for e, n in of], dtype=np.float64)
        across_ground, along_ground = np.sum(of * side, axis=1) * turned, np.sum(of * unit, axis=1) * blown
        return np.asarray(np.sqrt(across_ground**2 + along_ground**2 + doubt**2), dtype=np.float64)

    sigma = np.minimum(spread(across) / size, math.pi)
    factor = sigma / np.maximum(forecast.sigma_twd_rad, 1e-9)
    return replace(
        forecast, mean_twd_from_rad=np.arctan2(along[:, 0], along[:, 1]),
        mean_tws_mps=np.hypot(water[:, 0], water[:, 1]),
        sigma_twd_rad=sigma, sigma_tws_mps=spread(along),
        half_width_rad=np.minimum(forecast.half_width_rad * factor[:, None], math.pi))
