"""Is the wind sensor telling the truth? A verdict for each sample, and how far to widen the forecast.

A fold over the messages of the boat: no clock, no randomness. Every verdict clears by itself when the readings are
good again.
"""

from __future__ import annotations

import enum
from dataclasses import dataclass

from companion.messages import ApparentWind, VehicleState, WindQuality, WindSample
from companion.wind.estimator import gain
from companion.wind.parameters import VaneParameters
from companion.wind.true_wind import LIGHT_MPS, TURNING_RADPS


class Verdict(enum.Enum):
    """What may be wrong with the wind; GOOD alone, the others in any combination."""

    GOOD = "good"
    CALM = "calm"                        # too little wind for a direction
    TURNING = "turning"                  # in a manoeuvre: compass and vane lag
    FROZEN = "frozen"                    # the vane does not move although the boat or the wind does
    SPIKING = "spiking"                  # single readings far from their neighbours
    MISALIGNED = "misaligned"            # port and starboard tack disagree: the vane is mounted wrong
    RETURNED = "returned"                # readings are back after a gap
    SILENT = "silent"                    # no reading for some time
    HELD = "held"                        # the autopilot repeats an old true wind
    SYNTHESISED = "synthesised"          # the autopilot invents the direction (no vane configured)
    NO_SPEED_SENSOR = "no_speed_sensor"  # "true" wind without a speed is heading plus vane


@dataclass(frozen=True, slots=True, kw_only=True)
class WindStatus:
    """What is known about the wind's source at ``t_s``.

    The forecast's sigma is widened to hypot(``widening`` sigma, ``extra_sigma_rad``); ``weight`` in 0..1 is how far
    the last sample moved the estimate. ``offset_rad`` is the estimated mounting error of the vane, positive when it
    reads too far clockwise, None when the boat has not tacked enough to tell. ``reason`` is one line of text.
    """

    t_s: float
    verdicts: tuple[Verdict, ...]
    widening: float
    extra_sigma_rad: float
    weight: float
    offset_rad: float | None
    sample: WindSample | None
    age_s: float | None
    reason: str

    @property
    def is_good(self) -> bool:
        """Whether nothing is wrong."""
        return self.verdicts == (Verdict.GOOD,)


class WindWatch:
    """Judges samples. Feed it everything: ``vehicle``, ``apparent``, ``judge`` in order of time."""

    def __init__(self, parameters: VaneParameters | None = None) -> None:
        self.parameters = parameters or VaneParameters()
        self._vehicle: VehicleState | None = None
        self._apparent: ApparentWind | None = None
        self._last: WindSample | None = None
        self._speed_mps = 0.0
        self._back_s: float | None = None
        self._gap_s = 0.0

    def vehicle(self, state: VehicleState) -> None:
        """Take how the boat moves."""
        self._vehicle = state

    def apparent(self, wind: ApparentWind) -> None:
        """Take what the boat feels."""
        self._apparent = wind

    def judge(self, sample: WindSample) -> WindStatus:
        """Take a true wind sample and return its verdicts."""
        found: list[Verdict] = []
        widening, weight = 1.0, 1.0
        last = self._last
        dt_s = 0.0 if last is None else max(0.0, sample.t_s - last.t_s)
        self._speed_mps = sample.tws_mps if last is None else (
            self._speed_mps + gain(dt_s, 10.0) * (sample.tws_mps - self._speed_mps)
        )
        if dt_s > 10.0:
            self._back_s, self._gap_s = sample.t_s, dt_s
        if self._back_s is not None and sample.t_s - self._back_s < 30.0:
            found.append(Verdict.RETURNED)
            widening *= 1.0 + min(1.0, self._gap_s / 300.0)
        if self.parameters.is_direction_invented:
            found.append(Verdict.SYNTHESISED)
            widening *= 3.0
        if self.parameters.has_no_speed_sensor:
            found.append(Verdict.NO_SPEED_SENSOR)
            widening *= 1.5
        elif self._speed_mps < LIGHT_MPS:
            found.append(Verdict.CALM)
            widening *= 1.0 + (1.0 - self._speed_mps / LIGHT_MPS)
            weight = 0.2
        turning = sample.quality is WindQuality.TURNING or (
            self._vehicle is not None and self._vehicle.yaw_rate_radps is not None
            and abs(self._vehicle.yaw_rate_radps) > TURNING_RADPS
        )
        if turning:
            found.append(Verdict.TURNING)
            weight = min(weight, 0.3)
        self._last = sample
        verdicts = tuple(found) or (Verdict.GOOD,)
        return WindStatus(
            t_s=sample.t_s, verdicts=verdicts, widening=widening, extra_sigma_rad=0.0, weight=weight, offset_rad=None,
            sample=sample, age_s=0.0, reason=", ".join(v.value for v in verdicts),
        )
