"""What every wind estimator promises, and the part that all of them share.

An estimator is fed readings of the true wind and forecasts direction and speed with an honest spread. The
interface is the ``Estimator`` protocol; ``Base`` owns what must be the same everywhere: the circle, the clock,
the table for the planner. A concrete estimator writes ``_step`` and ``_predict`` on a straight line.

The circle: directions are kept relative to the first reading, rounded to a nanoradian. Rotating a whole record
therefore changes no bit of what an estimator computes, only the reference that is added back at the end.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from statistics import NormalDist
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from companion.geo.angles import wrap_pi
from companion.messages import WindForecast

HORIZONS_S = (0.0, 1.0, 3.0, 10.0, 20.0, 30.0, 60.0, 90.0, 120.0, 180.0, 300.0, 450.0, 600.0, 900.0, 1800.0, 3600.0)
LEVELS = (0.5, 0.8, 0.9, 0.95, 0.98, 0.99)

Floats = NDArray[np.float64]

SIGMA_MAX_RAD = math.pi  # [rad] a normal this wide, wrapped, is uniform on the circle
SIGMA_MIN_RAD = 1e-4
_RESTART_S = 10.0  # [s] a clock that steps back further than this has been restarted
_NORMAL = NormalDist()


@runtime_checkable
class Estimator(Protocol):
    """A wind forecaster.

    ``update`` takes a true wind reading: ``t_s`` in seconds on any steady clock, the direction it comes from [rad,
    true north clockwise, any branch] and its speed [m/s]. ``weight`` in 0..1 says how far the direction may be
    believed, ``speed_weight`` how far the speed (None: as far): a calm has a speed and no direction. 0 and 0 only
    move the clock. A reading not later than the previous one is ignored.

    ``forecast`` and ``interval`` count their horizon [s] from the last update; ``table`` counts from its ``t_s``.
    """

    name: str

    def update(
        self,
        t_s: float,
        direction_rad: float,
        speed_mps: float,
        *,
        weight: float = 1.0,
        speed_weight: float | None = None,
    ) -> None:
        """Take one reading."""
        ...

    def forecast(self, horizon_s: float) -> tuple[float, float, float, float]:
        """Return mean direction [rad, -π..π), its sigma [rad], mean speed and its sigma [m/s]."""
        ...

    def interval(self, horizon_s: float, p: float) -> float:
        """Return the half width [rad, 0..π] of the central interval that holds the direction with probability p."""
        ...

    @property
    def correlation_time_s(self) -> float:
        """How long a departure of the direction from its mean lasts (1/e) [s]."""
        ...

    @property
    def is_ready(self) -> bool:
        """Whether there has been a reading."""
        ...

    def table(
        self, t_s: float, horizons_s: Sequence[float] | None = None, levels: Sequence[float] | None = None
    ) -> WindForecast:
        """Return the forecast at ``t_s`` for ``horizons_s`` after it."""
        ...


class Base:
    """Circle, clock and table; a subclass adds ``_step`` and ``_predict`` on the line."""

    name = "base"

    def __init__(self) -> None:
        self._t_s: float | None = None
        self._reference_rad = 0.0

    # ------------------------------------------------------------------------------ for the subclass
    def _step(self, dt_s: float, x_rad: float, speed_mps: float, weight: float, speed_weight: float) -> None:
        """Take a reading: ``x_rad`` is on [-π, π] about the first; ``dt_s`` > 0, or 0 for the first of all.

        The first has a direction that is believed.
        """
        raise NotImplementedError

    def _predict(self, horizon_s: float) -> tuple[float, float, float, float]:
        """Return mean x [rad, any branch], sigma, mean speed, sigma."""
        raise NotImplementedError

    # ------------------------------------------------------------------------------ the interface
    @property
    def is_ready(self) -> bool:
        """Whether there has been a reading."""
        return self._t_s is not None

    def update(
        self,
        t_s: float,
        direction_rad: float,
        speed_mps: float,
        *,
        weight: float = 1.0,
        speed_weight: float | None = None,
    ) -> None:
        """Take one reading of the true wind (see ``Estimator``)."""
        # Plain floats only: an int would make the compiled estimator compile again, in flight.
        t_s, direction_rad, speed_mps, weight = float(t_s), float(direction_rad), float(speed_mps), float(weight)
        of_speed = weight if speed_weight is None else float(speed_weight)
        if not (math.isfinite(t_s) and math.isfinite(direction_rad) and math.isfinite(speed_mps)):
            raise ValueError(f"reading {t_s}, {direction_rad}, {speed_mps} is not finite")
        if self._t_s is None:
            if weight <= 0.0 or of_speed <= 0.0:
                return  # an estimator begins with a reading that it can believe
            self._reference_rad = wrap_pi(direction_rad)
            dt_s = 0.0
        else:
            dt_s = t_s - self._t_s
            if dt_s <= 0.0:
                if dt_s < -_RESTART_S:
                    self._t_s = t_s
                return
        self._t_s = t_s
        x_rad = round(wrap_pi(direction_rad - self._reference_rad), 9)
        self._step(dt_s, abs(x_rad) if abs(x_rad) >= 3.141592653 else x_rad, speed_mps, weight, of_speed)

    def forecast(self, horizon_s: float) -> tuple[float, float, float, float]:
        """Return mean direction [rad, -π..π), sigma [rad], mean speed, sigma [m/s], that long after the last update.

        Raises ValueError before the first reading.
        """
        if self._t_s is None:
            raise ValueError("no wind has been seen yet")
        return self._on_circle(*self._predict(max(0.0, float(horizon_s))))

    def _on_circle(self, x: float, sigma: float, speed: float, sigma_speed: float) -> tuple[float, float, float, float]:
        """Return what was predicted on the line as ``forecast`` tells it."""
        sigma = min(max(sigma, SIGMA_MIN_RAD), SIGMA_MAX_RAD)
        return wrap_pi(x + self._reference_rad), sigma, max(0.0, speed), max(sigma_speed, 1e-3)

    def interval(self, horizon_s: float, p: float) -> float:
        """Return the half width [rad, 0..π] of the central interval that holds the direction with probability p."""
        return self._half_width(horizon_s, p, self.forecast(horizon_s)[1])

    def _half_width(self, horizon_s: float, p: float, sigma_rad: float) -> float:
        return min(math.pi, sigma_rad * self._quantile(horizon_s, p))

    def _quantile(self, horizon_s: float, p: float) -> float:  # noqa: ARG002 - others' depends on it
        """Return the quantile of |error| / sigma: a normal's."""
        return normal_half_width(p)

    @property
    def correlation_time_s(self) -> float:
        """How long a departure from the mean lasts [s]; an hour if the model has no return."""
        return 3600.0

    def table(
        self, t_s: float, horizons_s: Sequence[float] | None = None, levels: Sequence[float] | None = None
    ) -> WindForecast:
        """Return the forecast at ``t_s`` (not before the last update) as the planner's table."""
        horizon = np.asarray(HORIZONS_S if horizons_s is None else horizons_s, dtype=np.float64)
        level = np.asarray(LEVELS if levels is None else levels, dtype=np.float64)
        if self._t_s is None:
            raise ValueError("no wind has been seen yet")
        rows, half = self._rows(max(0.0, t_s - self._t_s) + horizon, level)
        return WindForecast(
            t_s=t_s,
            horizon_s=horizon,
            mean_twd_from_rad=rows[:, 0],
            sigma_twd_rad=rows[:, 1],
            mean_tws_mps=rows[:, 2],
            sigma_tws_mps=rows[:, 3],
            level=level,
            half_width_rad=half,
            correlation_time_s=self.correlation_time_s,
        )

    def _rows(self, horizons_s: Floats, levels: Floats) -> tuple[Floats, Floats]:
        """Return ``forecast`` (n, 4) and the half widths (n, m) at horizons [s, 0 or more] and levels."""
        rows = np.array([self.forecast(h) for h in horizons_s.tolist()], dtype=np.float64).reshape(-1, 4)
        half = np.array(
            [
                [self._half_width(h, p, row[1]) for p in levels.tolist()]
                for h, row in zip(horizons_s.tolist(), rows.tolist(), strict=True)
            ],
            dtype=np.float64,
        )
        return rows, half.reshape(horizons_s.size, levels.size)


@functools.lru_cache(maxsize=64)
def normal_half_width(p: float) -> float:
    """Return z with P(|N(0, 1)| <= z) = p, for 0 <= p < 1."""
    if not 0.0 <= p < 1.0:
        raise ValueError(f"probability {p} is outside 0..1")
    return _NORMAL.inv_cdf(0.5 + 0.5 * p)


def gain(dt_s: float, tau_s: float) -> float:
    """Return the share of a new reading in an exponential mean of time constant ``tau_s`` after ``dt_s``."""
    return -math.expm1(-dt_s / tau_s)
