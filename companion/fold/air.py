"""The wind as a step sees it: forecast, means, and how far it is believed."""

from __future__ import annotations

from companion.geo.angles import wrap_pi
from companion.messages import ApparentWind, WindSample
from companion.skipper.step import WindHealth, WindView
from companion.wind import Estimator, Verdict, WindRoom, WindStatus, make

# Wind is believed after this long a record [s]; until then its spread is a guess.
SETTLED_S = 20.0

# A spiking vane is not among them: its spikes are not fed, and what is left is widened.
_UNTRUSTED = frozenset({
    Verdict.FROZEN, Verdict.SILENT, Verdict.HELD, Verdict.SYNTHESISED, Verdict.NO_SPEED_SENSOR, Verdict.TURNED,
})


class Air:
    """The wind room with the means over 90 s and 5 s beside its forecast."""

    def __init__(self, room: WindRoom) -> None:
        self.room = room
        self._begin()

    def _begin(self) -> None:
        self._mean90: Estimator = make("mean90")
        self._mean5: Estimator = make("mean5")
        self._first_s: float | None = None
        self._last_s: float | None = None

    def begin_anew(self) -> None:
        """Forget all readings: what they were read by has been changed."""
        self.room.begin_anew()
        self._begin()

    def take(self, value: WindSample | ApparentWind) -> None:
        """Take what an instrument said, in the order of time."""
        status = self.room.update(value)
        if status is None or status.sample is None or status.sample.t_s == self._last_s:
            return
        sample = status.sample
        self._last_s = sample.t_s
        if self._first_s is None:
            self._first_s = sample.t_s
        self._mean90.update(sample.t_s, sample.twd_from_rad, sample.tws_mps, weight=status.weight,
                            speed_weight=status.speed_weight)
        # What a turned vane says now the autopilot sails by, and it is what her motion is held against.
        is_turned = Verdict.TURNED in status.verdicts
        self._mean5.update(sample.t_s, sample.twd_from_rad, sample.tws_mps,
                           weight=1.0 if is_turned else status.weight,
                           speed_weight=1.0 if is_turned else status.speed_weight)

    def view(self, t_s: float) -> WindView:
        """Return the wind at ``t_s``."""
        status = self.room.status(t_s)
        table = self.room.forecast_table(t_s)
        if status is None or table is None or self._first_s is None:
            return WindView()
        mean_rad, _, mean_mps, _ = self._mean90.forecast(0.0)
        now_rad, _, now_mps, _ = self._mean5.forecast(0.0)
        record_s = t_s - self._first_s
        health = _health(status, record_s)
        return WindView(
            health=health,
            forecast=table,
            mean_twd_from_rad=wrap_pi(mean_rad),
            mean_tws_mps=max(0.0, mean_mps),
            sigma_twd_rad=float(table.sigma_twd_rad[0]),
            present_twd_from_rad=wrap_pi(now_rad),
            present_tws_mps=max(0.0, now_mps),
            record_s=record_s,
            verdict="" if health is WindHealth.GOOD else status.reason,
        )


def _health(status: WindStatus, record_s: float) -> WindHealth:
    is_calm = Verdict.CALM in status.verdicts
    # In a calm the autopilot holds the old direction, by its least speed: that is the calm and no fault.
    if any(v in _UNTRUSTED and not (is_calm and v is Verdict.HELD) for v in status.verdicts):
        return WindHealth.UNTRUSTED
    if is_calm:
        return WindHealth.LIGHT
    return WindHealth.SETTLING if record_s < SETTLED_S else WindHealth.GOOD
