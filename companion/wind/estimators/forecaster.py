"""The default forecaster: a multi-scale mean, a mean-reverting model beside it, and a spread learned from own errors.

1. *Mean.* Exponential vector means of the air's motion at time constants from 1 s to 1 h. The departure of each from
   the next longer one survives to the horizon h by 1 / (1 + (h / (c tau))^gamma): gusts are forgotten, shifts stay.
   Two constants, fitted to recorded wind.                                                                    (1)
2. *Return.* m + phi(h) (x - m) about the hour's mean, phi(h) regressed online at each horizon: exact for the AR(1)
   wind of Wolsieffer's equation 17.                                                                          (2)
3. *Pool.* The share of (2) is the online regression of the error of (1) on the difference of the two (Bates and
   Granger 1969), from 0 until there is evidence.                                                             (3)
4. *Sigma* at each horizon from the forecaster's own past errors at that horizon, the roughness of the last minute
   and the wind speed (light air is fickle), scaled by its own record of |error| / sigma.                     (4)
5. *Intervals* from quantiles of |error| / sigma tracked per horizon and level (adaptive conformal inference, Gibbs and
   Candès 2021), pulled towards the heavy-tailed shape of recorded wind: errors of wind are not normal.       (5)

Everything is weighted by elapsed time, not by samples: the sampling rate does not matter.
"""

from __future__ import annotations

import functools
import math

import numpy as np

from companion.wind.estimators import forecaster_kernels as kernel
from companion.wind.estimators.estimator import Base, Floats, normal_half_width
from companion.wind.estimators.forecaster_kernels import Constants

# What recorded wind taught: the few constants of the default forecaster, with their provenance.
#
# Made by ``python -m lab.wind_fit FOLDER`` on the 14 development records (41 h on lakes, a fjord, the
# Baltic and the Adriatic; docs/reference/wind.md says which). They are shapes, not climates: how long a wind shift of a
# given time scale survives, how errors grow with the horizon, how heavy their tails are. Everything about today's wind
# is learned on board.
#
# Rounded from the fit (110 to 170 evaluations); on records left out it loses less than 1 % of CRPS. ``memory`` and
# ``tail`` were chosen by hand: seconds of own errors, pool, quantiles, roughness, shown spread; pull of the quantiles
# to their prior; shrinkage of the pool.


def _array(*values: float) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    return np.array(values, dtype=np.float64)


CONSTANTS = Constants(
    survival=_array(9.4, 0.70),
    speed_survival=_array(2.3, 0.60),
    sigma=_array(0.16, 0.056, 0.41, -0.57, 1500.0),
    error=_array(0.164, 0.31),
    speed_error=_array(0.128, 0.21),
    quantile=_array(0.0, 0.305, 0.645, 0.91, 1.32, 1.87, 2.48, 3.4, 4.2, 8.0),
    tail=_array(0.05),
    memory=_array(3600.0, 7200.0, 3600.0, 60.0, 10800.0, 0.3, 0.3),
)


_Z = np.array([normal_half_width(float(p)) for p in kernel.QUANTILE_P])


@functools.cache
def compile_kernels() -> None:
    """Compile (or load) the kernels before the first reading, so that no reading waits for it."""
    state = kernel.new_state(CONSTANTS)
    kernel.update(state, CONSTANTS, kernel.prior_quantile(CONSTANTS), 0.0, 0.0, 1.0, 1.0, 1.0)
    kernel.predict(state, CONSTANTS, 60.0)
    kernel.half_width_ratio(state, 60.0, _Z, 1.0)
    kernel.table(state, CONSTANTS, np.array([60.0]), _Z, np.array([1.0]))
    kernel.correlation_time(state)


class Forecaster(Base):
    """The default estimator. ``constants`` replaces what was fitted (for the fit itself)."""

    name = "default"

    def __init__(self, *, constants: kernel.Constants = CONSTANTS) -> None:
        super().__init__()
        compile_kernels()
        self._constants = constants
        self._state = kernel.new_state(constants)
        self._prior = self._state.quantile.copy()

    def _step(self, dt_s: float, x_rad: float, speed_mps: float, weight: float, speed_weight: float) -> None:
        kernel.update(self._state, self._constants, self._prior, dt_s, x_rad, speed_mps, weight, speed_weight)

    def _predict(self, horizon_s: float) -> tuple[float, float, float, float]:
        mean, sigma, speed, sigma_speed, _, _ = kernel.predict(self._state, self._constants, horizon_s)
        return mean, sigma, speed, sigma_speed

    def _quantile(self, horizon_s: float, p: float) -> float:
        """Return the tracked quantile of |error| / sigma, between levels linear in the normal quantile (equation 5)."""
        return kernel.half_width_ratio(self._state, float(horizon_s), _Z, normal_half_width(p))

    def _rows(self, horizons_s: Floats, levels: Floats) -> tuple[Floats, Floats]:
        normal = np.array([normal_half_width(p) for p in levels.tolist()], dtype=np.float64)
        rows, ratio = kernel.table(self._state, self._constants, horizons_s, _Z, normal)
        rows = np.array([self._on_circle(*row) for row in rows.tolist()], dtype=np.float64).reshape(-1, 4)
        return rows, np.minimum(math.pi, rows[:, 1:2] * ratio)

    @property
    def correlation_time_s(self) -> float:
        """Where the online autocorrelation of the direction about its hour's mean falls to 1/e [s], 1 s to 1 h."""
        return kernel.correlation_time(self._state)
