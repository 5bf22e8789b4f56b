"""A VAIMOS boat afloat with its sensors, in a seeded wind: the fast closed loop under the tasks.

One second at a time: measure, decide, sail. The guidance sees a position with noise, and a wind that is a mean of
what a vane with noise said, never the truth.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from companion.field.values import GuidanceSettings, MovingObstacle, Situation
from companion.geo.angles import wrap_pi, wrap_two_pi
from sitl.world.vaimos import STEP_S, VaimosParameters, polar, sail_heading, state_at
from sitl.world.wind import AR1, Wind

LENGTH_M = 3.65
GPS_SD_M = 0.7
VANE_SD_RAD = math.radians(4.0)
WIND_MEAN_S = 8.0
_PARAMETERS = VaimosParameters().array()
_POLARS: dict[int, tuple[tuple[float, ...], tuple[float, ...]]] = {}


def polar_at(tws_mps: float) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return (|TWA| nodes, speeds) of the VAIMOS model in this wind, in steps of 0.1 m/s."""
    key = round(10.0 * max(0.5, tws_mps))
    if key not in _POLARS:
        twa, speed = polar().curve(key / 10.0)
        _POLARS[key] = (tuple(map(float, twa)), tuple(map(float, speed)))
    return _POLARS[key]


def habits_for(tws_mps: float, **changes: float | bool) -> GuidanceSettings:
    """Return what VAIMOS can do in this wind: her polar, slow tacks, leeway of 3 % of the wind."""
    twa, speed = polar_at(tws_mps)
    base: dict[str, float | bool] = {
        "turn_rate_radps": math.radians(11.0), "tack_s": 7.0, "tack_min_mps": 0.5, "lag_s": 6.0, "leeway_share": 0.03,
        "no_go_half_rad": math.radians(47.0),
    }
    base.update(changes)
    return GuidanceSettings(polar_twa_rad=twa, polar_mps=speed, **base)  # type: ignore[arg-type]


def wind_for(twd_from_rad: float, tws_mps: float, seed: int) -> AR1:
    """Return the weather of a run: 9 degrees about the mean with 28 s of correlation, 10 % of speed."""
    return AR1(twd_from_rad, tws_mps, seed=seed, sd_rad=math.radians(9.0), tws_sd_mps=0.1 * tws_mps, step_s=0.5)


@dataclass(slots=True)
class Afloat:
    """The boat, her wind and her sensors; ``track`` grows by a row (t, east, north, heading, speed) each second."""

    wind: Wind
    rng: np.random.Generator
    state: NDArray[np.float64]
    t_s: float = 0.0
    track: list[tuple[float, float, float, float, float]] = field(default_factory=list)
    _wind_mean: tuple[float, float, float] | None = None
    _velocity: tuple[float, float] = (0.0, 0.0)

    @classmethod
    def launch(
        cls, wind: Wind, rng: np.random.Generator, en_m: tuple[float, float], heading_rad: float
    ) -> Afloat:
        """Return a boat at a place, under way at half a metre a second."""
        return cls(wind=wind, rng=rng, state=state_at(en_m[0], en_m[1], wrap_pi(heading_rad), 0.5))

    @property
    def en_m(self) -> tuple[float, float]:
        """True position."""
        return float(self.state[0]), float(self.state[1])

    @property
    def velocity_en_mps(self) -> tuple[float, float]:
        """Velocity over ground in the last second."""
        return self._velocity

    def sense(self, obstacles: tuple[MovingObstacle, ...] = ()) -> Situation:
        """Return what is measured now."""
        twd, tws = self.wind.at(self.t_s)
        measured = twd + float(self.rng.normal(0.0, VANE_SD_RAD))
        vector = (math.sin(measured), math.cos(measured), tws)
        keep = math.exp(-1.0 / WIND_MEAN_S) if self._wind_mean is not None else 0.0
        old = self._wind_mean or vector
        self._wind_mean = tuple(keep * a + (1.0 - keep) * b for a, b in zip(old, vector, strict=True))  # type: ignore[assignment]
        mean = self._wind_mean
        assert mean is not None
        noise = self.rng.normal(0.0, GPS_SD_M, 2)
        return Situation(
            t_s=self.t_s, en_m=(float(self.state[0] + noise[0]), float(self.state[1] + noise[1])),
            velocity_en_mps=self._velocity, heading_rad=wrap_pi(float(self.state[2])),
            twd_from_rad=wrap_two_pi(math.atan2(mean[0], mean[1])), tws_mps=mean[2], obstacles=obstacles,
        )

    def sail(self, heading_rad: float, thrust: float = 1.0) -> None:
        """Steer ``heading_rad`` for a second."""
        twd, tws = self.wind.at(self.t_s)
        before = self.en_m
        self.state = sail_heading(self.state, _PARAMETERS, wrap_pi(heading_rad), twd, tws, 1.0, STEP_S, thrust)
        after = self.en_m
        self._velocity = (after[0] - before[0], after[1] - before[1])
        self.t_s += 1.0
        self.track.append((self.t_s, after[0], after[1], float(self.state[2]), float(self.state[5])))

    def positions(self) -> NDArray[np.float64]:
        """Return the track as an (n, 5) array."""
        return np.asarray(self.track, dtype=np.float64).reshape(-1, 5)


def summary(values: Mapping[str, list[float]]) -> dict[str, dict[str, float]]:
    """Return median, 5 % and 95 % and extremes of each list."""
    out = {}
    for name, numbers in values.items():
        a = np.asarray(numbers, dtype=np.float64)
        a = a[np.isfinite(a)]
        if a.size:
            q = np.quantile(a, [0.0, 0.05, 0.5, 0.95, 1.0])
            out[name] = dict(zip(("min", "p05", "median", "p95", "max"), map(float, q), strict=True))
    return out
