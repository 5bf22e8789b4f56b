"""The current as the rest of the program sees it: one value with its doubt and where it comes from."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from companion.geo.angles import direction, heading_of, wrap_two_pi
from companion.messages import WindForecast

# A weaker one turns the heading of a boat of 2 m/s by less than 3 degrees: less than it wanders about its line.
LEAST_MPS = 0.1
# Of drift' P^-1 drift, which is chi-squared with two degrees of freedom in still water: 99 % of it is below this ...
BEYOND_DOUBT = 9.21
# ... and what was planned for once stays until it is well within its doubt, or half as strong.
IN_DOUBT = 4.0

BOTH_RAD = math.radians(40.0)  # headings this far apart tell a current from a polar's error


@dataclass(frozen=True, slots=True, kw_only=True)
class WaterCurrent:
    """The motion of the water over the ground.

    Attributes:
        east_mps, north_mps: where it goes [m/s].
        var_ee, var_en, var_nn: its covariance [m²/s²].
        is_significant: it is strong and sure enough to be planned for; else plans are of still water.
        headings_rad: how far apart the headings are that told of it [rad, 0..π]; 0: one heading, or none.
        samples_s: seconds of steady sailing that told of it.
        verdict: what is wrong with it, or not known of it, in words; empty: nothing.
    """

    east_mps: float = 0.0
    north_mps: float = 0.0
    var_ee: float = 0.0
    var_en: float = 0.0
    var_nn: float = 0.0
    is_significant: bool = False
    headings_rad: float = 0.0
    samples_s: float = 0.0
    verdict: str = ""

    @property
    def en_mps(self) -> tuple[float, float]:
        """Towards east and north [m/s]."""
        return self.east_mps, self.north_mps

    @property
    def drift_mps(self) -> float:
        """How fast [m/s]."""
        return math.hypot(self.east_mps, self.north_mps)

    @property
    def set_rad(self) -> float:
        """Where to [rad, true]."""
        return wrap_two_pi(heading_of(self.east_mps, self.north_mps)) if self.drift_mps > 0.0 else 0.0

    @property
    def sigma_mps(self) -> float:
        """The standard deviation in its most uncertain direction [m/s]."""
        mean, half = 0.5 * (self.var_ee + self.var_nn), 0.5 * (self.var_ee - self.var_nn)
        return math.sqrt(max(0.0, mean + math.hypot(half, self.var_en)))

    def sigma_along_mps(self, east: float, north: float) -> float:
        """Return the standard deviation along a unit vector [m/s]."""
        return math.sqrt(max(0.0, self.var_ee * east**2 + 2.0 * self.var_en * east * north + self.var_nn * north**2))

    @property
    def beyond_doubt(self) -> float:
        """How far it is from still water: drift' P^-1 drift, inf where there is no doubt."""
        det = self.var_ee * self.var_nn - self.var_en**2
        if det <= 0.0:
            return math.inf if self.drift_mps > 0.0 else 0.0
        return (
            self.var_nn * self.east_mps**2
            - 2.0 * self.var_en * self.east_mps * self.north_mps
            + self.var_ee * self.north_mps**2
        ) / det

    def is_worth_planning(self, *, was: bool) -> bool:
        """Return whether plans should reckon with it; ``was``: they did."""
        if was:
            return self.drift_mps >= 0.5 * LEAST_MPS and self.beyond_doubt >= IN_DOUBT
        return self.drift_mps >= LEAST_MPS and self.beyond_doubt >= BEYOND_DOUBT

    @property
    def planned_en_mps(self) -> tuple[float, float]:
        """What plans reckon with [m/s, towards east and north]: 0 where it is not significant."""
        return self.en_mps if self.is_significant else (0.0, 0.0)

    def sentence(self) -> str:
        """Return one line: set, drift and how sure; in brackets what is not known of it."""
        remarks = [self.verdict] if self.verdict else []
        if self.samples_s > 0.0 and self.headings_rad < BOTH_RAD:
            remarks.append("told on one heading, where a polar's error or leeway looks the same")
        text = f"current {direction(self.set_rad)}° {self.drift_mps:.2f} m/s, give or take {self.sigma_mps:.2f} m/s"
        return f"{text} ({'; '.join(remarks)})" if remarks else text


STILL_WATER = WaterCurrent()


# The wind over the water: what sails and polars are of, from the wind over the ground and the current.
#
# From-vectors point at where the wind comes from, so that the air's motion over the ground is -G. Over the water it is
# -G - C, with C the current's motion: the from-vector over water is
#
#     W = G + C                                                                                                 (a)
#
# Still air over a current of 0.5 m/s to the north is a wind of 0.5 m/s from the north. ArduRover's WIND is G (apparent
# wind and the filter's velocity over ground), and its no-go angle is about G; a polar is of W.

LEAST_WIND_MPS = 0.05  # [m/s] a wind over the water below this has no direction


def over_water(twd_from_rad: float, tws_mps: float, current_en_mps: tuple[float, float]) -> tuple[float, float]:
    """Return the wind over the water (from [rad], speed [m/s]) of a wind over the ground in a current.

    >>> from_rad, speed = over_water(0.0, 5.0, (0.0, 0.5))     # the current sets into the wind: more of it
    >>> round(speed, 3)
    5.5
    """
    if current_en_mps == (0.0, 0.0):
        return twd_from_rad, tws_mps
    east = tws_mps * math.sin(twd_from_rad) + current_en_mps[0]  # (a)
    north = tws_mps * math.cos(twd_from_rad) + current_en_mps[1]
    speed = math.hypot(east, north)
    return (wrap_two_pi(heading_of(east, north)) if speed > 0.0 else twd_from_rad), speed


def over_ground(twd_from_rad: float, tws_mps: float, current_en_mps: tuple[float, float]) -> tuple[float, float]:
    """Return the wind over the ground of a wind over the water: the inverse of ``over_water``."""
    return over_water(twd_from_rad, tws_mps, (-current_en_mps[0], -current_en_mps[1]))


def forecast_over_water(forecast: WindForecast, current: WaterCurrent) -> WindForecast:
    """Return the forecast of the wind over the water in a current that stays as it is.

    Spreads are carried over to first order: what the direction's and the speed's errors over ground, and the current's
    own, are across the wind over the water and along it. Half widths grow as the direction's sigma does.
    """
    from_rad, speed = forecast.mean_twd_from_rad, forecast.mean_tws_mps
    ground = np.column_stack([speed * np.sin(from_rad), speed * np.cos(from_rad)])
    water = ground + np.asarray(current.en_mps)  # (a)
    size = np.maximum(np.hypot(water[:, 0], water[:, 1]), LEAST_WIND_MPS)
    along = np.where(
        size[:, None] > LEAST_WIND_MPS, water / size[:, None], np.column_stack([np.sin(from_rad), np.cos(from_rad)])
    )
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
        forecast,
        mean_twd_from_rad=np.arctan2(along[:, 0], along[:, 1]),
        mean_tws_mps=np.hypot(water[:, 0], water[:, 1]),
        sigma_twd_rad=sigma,
        sigma_tws_mps=spread(along),
        half_width_rad=np.minimum(forecast.half_width_rad * factor[:, None], math.pi),
    )
