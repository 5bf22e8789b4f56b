"""Records of simulated wind, to fit and to judge forecasters by: Wolsieffer's equation 17, and a whole weather."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from companion.wind.study import Record

Array = NDArray[np.float64]

RHO_HZ = 0.036  # Wolsieffer 2020, equation 17
NOISE_RADPS = 0.087  # likewise; its spread is for a step of 1 s


def _record(name: str, t_s: Array, direction_rad: Array, speed_mps: Array) -> Record:
    return Record(
        name=name,
        t_s=t_s,
        twd_from_rad=np.mod(direction_rad, 2.0 * math.pi),
        tws_mps=np.maximum(0.0, speed_mps),
        turning=np.zeros(t_s.size, dtype=np.bool_),
    )


def ornstein_uhlenbeck(rng: np.random.Generator, t_s: Array, *, rate_hz: float, sigma: float) -> Array:
    """Return the stationary process with sd ``sigma`` at any times: exact steps, so its spread is free of the step."""
    keep = np.exp(-rate_hz * np.diff(t_s))
    noise = rng.normal(size=t_s.size)
    x = np.empty(t_s.size)
    x[0] = sigma * noise[0]
    for i in range(1, t_s.size):
        x[i] = keep[i - 1] * x[i - 1] + sigma * math.sqrt(1.0 - keep[i - 1] ** 2) * noise[i]
    return x


def equation_17(seed: int, *, seconds: float = 7200.0, dt_s: float = 1.0, mean_rad: float = 0.0) -> Record:
    """Return the AR(1) wind of Wolsieffer's equation 17, its parameters those of the paper at a step of 1 s.

    The equation's spread depends on the step: sd 18.7 deg at 1 s, 5.9 deg at 0.1 s. Here the process of the 1 s step
    is sampled every ``dt_s``, so that a rate is a choice of the observer and not of the weather.
    """
    rng = np.random.default_rng(seed)
    t = np.arange(0.0, seconds, dt_s)
    rate_hz = -math.log(1.0 - RHO_HZ)
    x = ornstein_uhlenbeck(rng, t, rate_hz=rate_hz, sigma=NOISE_RADPS / math.sqrt(1.0 - (1.0 - RHO_HZ) ** 2))
    v = ornstein_uhlenbeck(rng, t, rate_hz=0.02, sigma=0.75)
    return _record(f"eq17_{seed}", t, mean_rad + x, 6.0 + v)


def weather(
    seed: int,
    *,
    seconds: float = 7200.0,
    dt_s: float = 1.0,
    mean_rad: float = 0.0,
    speed_mps: float = 5.0,
    noise_rad: float = 0.05,
) -> Record:
    """Return wind as boats meet it: gusts of 8 s and 60 s, shifts of 10 min, a drift of hours, an instrument's noise.

    Departures grow in light air as the square root of 5 m/s over the speed.
    """
    rng = np.random.default_rng(seed)
    t = np.arange(0.0, seconds, dt_s)
    parts = ((8.0, 0.06), (60.0, 0.07), (600.0, 0.11), (5400.0, 0.20))
    x = sum((ornstein_uhlenbeck(rng, t, rate_hz=1.0 / tau, sigma=sd) for tau, sd in parts), np.zeros(t.size))
    gust = 0.12 * ornstein_uhlenbeck(rng, t, rate_hz=1.0 / 20.0, sigma=1.0)
    slow = 0.25 * ornstein_uhlenbeck(rng, t, rate_hz=1.0 / 1200.0, sigma=1.0)
    speed = speed_mps * np.exp(gust + slow)
    x = x * np.sqrt(5.0 / np.maximum(1.0, speed)) + noise_rad * rng.normal(size=t.size)
    return _record(f"weather_{seed}", t, mean_rad + x, speed)
