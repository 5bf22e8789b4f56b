"""What the application feeds: messages in, the state of the wind and the planner's forecast out.

A deterministic fold: the same messages in the same order give the same forecasts, so a recorded voyage replays.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from companion.messages import ApparentWind, VehicleState, WindForecast, WindSample, WindSource
from companion.wind.catalogue import Forecaster
from companion.wind.estimator import SIGMA_MAX_RAD, Estimator
from companion.wind.parameters import VaneParameters
from companion.wind.true_wind import true_wind
from companion.wind.watch import Verdict, WindStatus, WindWatch

SILENT_S = 5.0            # [s] without a sample before the wind counts as silent
WIND_PREFERRED_S = 10.0   # [s] after a WIND message during which apparent wind is only listened to


class WindRoom:
    """Estimator, watch and parameters in one.

    ``update`` takes each message as it arrives: ``VehicleState``, ``ApparentWind`` (AppWnd*), ``WindSample`` (WIND,
    or anything else that measures true wind). While WIND arrives it is the source; when there is none, true wind is
    made of the apparent wind and the vehicle's state of the same second.
    """

    def __init__(self, parameters: VaneParameters | None = None, estimator: Estimator | None = None) -> None:
        self._watch = WindWatch(parameters)
        self._estimator: Estimator = estimator if estimator is not None else Forecaster()
        self._vehicle: VehicleState | None = None
        self._sample_t_s: float | None = None
        self._primary_t_s = -math.inf
        self._status: WindStatus | None = None

    @property
    def estimator(self) -> Estimator:
        """The forecaster inside."""
        return self._estimator

    def set_parameters(self, parameters: VaneParameters | Mapping[str, float]) -> None:
        """Take the autopilot's WNDVN_ parameters, as read at any time."""
        self._watch.parameters = (
            parameters if isinstance(parameters, VaneParameters) else VaneParameters.from_mapping(parameters)
        )

    def update(self, message: WindSample | ApparentWind | VehicleState) -> WindStatus | None:
        """Take a message; return the status, None before the first wind."""
        if isinstance(message, VehicleState):
            self._vehicle = message
            self._watch.vehicle(message)
        elif isinstance(message, ApparentWind):
            self._watch.apparent(message)
            if message.t_s - self._primary_t_s > WIND_PREFERRED_S and self._vehicle is not None:
                self._take(true_wind(message, self._vehicle))
        else:
            if message.source is not WindSource.APPARENT:
                self._primary_t_s = message.t_s
            self._take(message)
        return self._status

    def _take(self, sample: WindSample) -> None:
        status = self._watch.judge(sample)
        self._status = status
        self._sample_t_s = sample.t_s
        self._estimator.update(sample.t_s, sample.twd_from_rad, sample.tws_mps, weight=status.weight)

    def status(self, t_s: float) -> WindStatus | None:
        """Return the status as of ``t_s``: SILENT is added when the readings have stopped."""
        status = self._status
        if status is None:
            return None
        age_s = max(0.0, t_s - status.t_s)
        if age_s <= SILENT_S:
            return replace(status, age_s=age_s)
        verdicts = (*(v for v in status.verdicts if v is not Verdict.GOOD), Verdict.SILENT)
        return replace(status, age_s=age_s, verdicts=verdicts, reason=f"no wind for {age_s:.0f} s")

    def forecast_table(
        self, t_s: float, horizons_s: Sequence[float] | None = None, levels: Sequence[float] | None = None,
    ) -> WindForecast | None:
        """Return the forecast at ``t_s``, widened by what the watch found; None before the first wind."""
        if self._status is None or not self._estimator.is_ready:
            return None
        table = self._estimator.table(t_s, horizons_s, levels)
        status = self._status
        sigma = np.hypot(status.widening * table.sigma_twd_rad, status.extra_sigma_rad)
        factor = sigma / table.sigma_twd_rad
        return replace(
            table, sigma_twd_rad=np.minimum(sigma, SIGMA_MAX_RAD),
            half_width_rad=np.minimum(table.half_width_rad * factor[:, None], math.pi),
        )
