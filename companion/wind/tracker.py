"""What the application feeds: messages in, the state of the wind and the planner's forecast out.

A deterministic fold: the same messages in the same order give the same forecasts, so a recorded voyage replays.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Mapping, Sequence

import numpy as np

from companion.frozen import changed
from companion.geo.angles import wrap_pi
from companion.messages import ApparentWind, VehicleState, WindForecast, WindQuality, WindSample, WindSource
from companion.wind.estimators.catalogue import Forecaster
from companion.wind.estimators.estimator import SIGMA_MAX_RAD, Estimator, gain
from companion.wind.parameters import VaneParameters
from companion.wind.sensor_faults import WindStatus, WindVerdict, WindWatch
from companion.wind.true_wind import LIGHT_MPS, true_wind

SILENT_S = 5.0  # [s] without a sample before the wind counts as silent
WIND_PREFERRED_S = 10.0  # [s] after a WIND message during which apparent wind is only listened to


_QUALITY = {
    WindVerdict.TURNING: WindQuality.TURNING,
    WindVerdict.CALM: WindQuality.LIGHT,
    WindVerdict.HELD: WindQuality.HELD,
    WindVerdict.FROZEN: WindQuality.SUSPECT,
    WindVerdict.SPIKING: WindQuality.SUSPECT,
    WindVerdict.MISALIGNED: WindQuality.SUSPECT,
    WindVerdict.TURNED: WindQuality.SUSPECT,
    WindVerdict.SYNTHESISED: WindQuality.INVALID,
}


def _quality(sample: WindSample, status: WindStatus) -> WindQuality:
    """Return the worst of what the sample said of itself and what the watch found."""
    order = list(WindQuality)
    found = [_QUALITY[v] for v in status.verdicts if v in _QUALITY]
    return max([sample.quality, *found], key=order.index)


class WindTracker:
    """Estimator, watch and parameters in one.

    ``update`` takes each message as it arrives: ``VehicleState``, ``ApparentWind`` (AppWnd*), ``WindSample`` (WIND,
    or anything else that measures true wind). While WIND arrives it is the source; when there is none, true wind is
    made of the apparent wind and the vehicle's state of the same second. Readings that are not later than the last are
    duplicates and ignored.
    """

    def __init__(self, parameters: VaneParameters | None = None, estimator: Estimator | None = None) -> None:
        self._estimator: Estimator = estimator if estimator is not None else Forecaster()
        self._unused = copy.deepcopy(self._estimator)
        self._vehicle: VehicleState | None = None
        self._begin(WindWatch(parameters))

    def _begin(self, watch: WindWatch) -> None:
        self._watch = watch
        self._mean_s: float | None = None
        self._mean_sin = self._mean_cos = 0.0
        self._rough_rad = math.radians(4.0)
        self._primary_t_s = -math.inf
        self._status: WindStatus | None = None

    @property
    def estimator(self) -> Estimator:
        """The forecaster inside."""
        return self._estimator

    def begin_anew(self) -> None:
        """Forget all readings: what they were read by has been changed."""
        self._estimator = copy.deepcopy(self._unused)
        self._begin(WindWatch(self._watch.parameters))

    def contradict(self, why: str) -> None:
        """Take why the boat's motion speaks against the sensor; empty: it does not, any more."""
        self._watch.contradicted = why

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
                wind = true_wind(message, self._vehicle)
                if wind.quality is not WindQuality.SUSPECT:  # made of a heading that she no longer has
                    self._take(wind)
        else:
            if message.source is not WindSource.APPARENT:
                self._primary_t_s = message.t_s
            self._take(message)
        return self._status

    def _take(self, sample: WindSample) -> None:
        if self._status is not None and sample.t_s <= self._status.t_s:
            return  # a duplicate: AppWnd* are broadcast on every link each time any link sends WIND
        status = self._watch.judge(sample)
        if sample.source is WindSource.AUTOPILOT_TRUE:
            extra = self._lost_to_filter(sample)
            status = changed(status, extra_sigma_rad=math.hypot(status.extra_sigma_rad, extra))
        judged = status.sample or sample
        self._status = changed(status, sample=changed(judged, quality=_quality(judged, status)))
        # A reading that is not believed is not fed at all: the forecast then ages, and widens, by itself.
        if max(status.weight, status.speed_weight) > 0.0:
            self._estimator.update(
                judged.t_s, judged.twd_from_rad, judged.tws_mps, weight=status.weight, speed_weight=status.speed_weight
            )

    def _lost_to_filter(self, sample: WindSample) -> float:
        """Return the sigma [rad] that the autopilot's low pass took out of the wind.

        Measured on recorded wind passed through such a filter: 0.45 of the mean departure from the 90 s mean, at the
        firmware's 3.2 s; restores the coverage of forecasts of the unfiltered direction (docs/reference/wind.md).
        """
        dt_s = 1.0 if self._mean_s is None else max(0.0, sample.t_s - self._mean_s)
        begin = self._mean_s is None
        self._mean_s = sample.t_s
        g = 1.0 if begin else gain(dt_s, 90.0)
        self._mean_sin += g * (sample.tws_mps * math.sin(sample.twd_from_rad) - self._mean_sin)
        self._mean_cos += g * (sample.tws_mps * math.cos(sample.twd_from_rad) - self._mean_cos)
        off = abs(wrap_pi(sample.twd_from_rad - math.atan2(self._mean_sin, self._mean_cos)))
        if sample.tws_mps >= LIGHT_MPS:
            self._rough_rad += gain(dt_s, 600.0) * (min(1.2, off) - self._rough_rad)
        tau_s = self._watch.parameters.true_tau_s
        return 0.45 * self._rough_rad * min(1.5, math.sqrt(tau_s / 3.2))

    def status(self, t_s: float) -> WindStatus | None:
        """Return the status as of ``t_s``: SILENT is added when the readings have stopped."""
        status = self._status
        if status is None:
            return None
        age_s = max(0.0, t_s - status.t_s)
        if age_s <= SILENT_S:
            return changed(status, age_s=age_s)
        verdicts = (*(v for v in status.verdicts if v is not WindVerdict.GOOD), WindVerdict.SILENT)
        return changed(status, age_s=age_s, verdicts=verdicts, reason=f"no wind for {age_s:.0f} s")

    def forecast_table(
        self, t_s: float, horizons_s: Sequence[float] | None = None, levels: Sequence[float] | None = None
    ) -> WindForecast | None:
        """Return the forecast at ``t_s``, widened by what the watch found; None before the first wind."""
        if self._status is None or not self._estimator.is_ready:
            return None
        table = self._estimator.table(t_s, horizons_s, levels)
        status = self._status
        sigma = np.hypot(status.widening * table.sigma_twd_rad, status.extra_sigma_rad)
        factor = sigma / table.sigma_twd_rad
        return changed(
            table,
            sigma_twd_rad=np.minimum(sigma, SIGMA_MAX_RAD),
            half_width_rad=np.minimum(table.half_width_rad * factor[:, None], math.pi),
        )
