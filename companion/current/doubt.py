"""What is not known of the wind's angle to her bow on a leg: current, leeway, compass and vane, told of together.

A plan lays a leg by the wind as it is measured. On the leg she heads up against a current abeam of it and against her
leeway, the current turns the wind over the water, and a vane or a compass that errs has turned the wind from the start.
To first order the angle is off by g x, with x as ``CurrentEstimator`` carries it and, with the wind on the side s
(1: over starboard) from θ, the course φ, W of wind, v through the water,

    g = (n(θ) / W + n(φ) / v, 0, -s, 1 + v cos β / W, -(1 + v cos β / W)),    n(a) = (cos a, -sin a)           (a)

since the autopilot's wind over ground is its apparent wind, longer by v cos β on a beat at β, less her velocity. The
mean is left where it is measured, for by that wind the autopilot decides what it beats: what is believed of the errors
is part of the spread, as what is not known of them is.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from companion.messages import WindForecast

UNTOLD_MPS = 0.15    # [m/s] of a current that is not planned for: of a stronger one her own track soon tells
SLOW_MPS = 0.5       # [m/s] the least speed that a crab angle is reckoned with
LEAST_MPS = 0.5      # [m/s] likewise the least wind


@dataclass(frozen=True, slots=True, kw_only=True)
class Doubt:
    """What the estimator believes and how well.

    Attributes:
        believed: current east, north [m/s]; share by which she is faster than her polar; leeway, compass, vane [rad].
        covariance: of these, by rows.
        is_planned: plans reckon with the current; the others of ``believed`` they never do.
    """

    believed: tuple[float, ...]
    covariance: tuple[tuple[float, ...], ...]
    is_planned: bool = False

    def widened(
        self, forecast: WindForecast, *, beat_rad: float, speed_mps: float, leeway_rad: float = 0.0,
    ) -> WindForecast:
        """Return the forecast with its direction's spread widened by what is not known on a leg.

        Reckoned for a leg at ``beat_rad`` to the wind, on the worse tack, at ``speed_mps`` through the water;
        ``leeway_rad`` is the leeway that the plan has there. Of a current that is not planned for, ``UNTOLD_MPS`` at
        most. Half widths grow as the direction's sigma does.
        """
        moment = self._moment(leeway_rad)
        from_rad, wind_mps = forecast.mean_twd_from_rad, np.maximum(forecast.mean_tws_mps, LEAST_MPS)
        speed_mps = max(speed_mps, SLOW_MPS)
        turned = _abeam(from_rad) / wind_mps[:, None]
        more = np.zeros_like(from_rad)
        for side in (1.0, -1.0):
            g = np.zeros((from_rad.shape[0], 6))                                              # (a)
            g[:, :2] = turned + _abeam(from_rad - side * beat_rad) / speed_mps
            g[:, 3] = -side
            g[:, 4] = 1.0 + speed_mps * math.cos(beat_rad) / wind_mps
            g[:, 5] = -g[:, 4]
            more = np.maximum(more, np.einsum("ni,ij,nj->n", g, moment, g))
        if self.is_planned:     # the wind over the water has its own doubt already (``forecast_over_water``)
            more = np.maximum(more - np.einsum("ni,ij,nj->n", turned, moment[:2, :2], turned), 0.0)
        sigma = np.minimum(np.sqrt(forecast.sigma_twd_rad**2 + more), math.pi)
        factor = sigma / np.maximum(forecast.sigma_twd_rad, 1e-9)
        return replace(forecast, sigma_twd_rad=sigma,
                       half_width_rad=np.minimum(forecast.half_width_rad * factor[:, None], math.pi))

    def _moment(self, leeway_rad: float) -> NDArray[np.float64]:
        """Return the mean squares and products of what plans do not reckon with."""
        off, covariance = np.array(self.believed), np.array(self.covariance)
        off[3] -= leeway_rad
        if self.is_planned:
            off[:2] = 0.0
            return np.asarray(covariance + np.outer(off, off))
        moment = covariance + np.outer(off, off)
        most = math.sqrt(max(float(np.linalg.eigvalsh(moment[:2, :2])[1]), 1e-12))
        shrunk = np.array([min(1.0, UNTOLD_MPS / most)] * 2 + [1.0] * 4)
        return np.asarray(moment * np.outer(shrunk, shrunk))


def _abeam(of_rad: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the unit vectors to starboard of directions, (n, 2)."""
    return np.column_stack([np.cos(of_rad), -np.sin(of_rad)])
