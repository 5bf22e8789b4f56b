"""Is the wind sensor telling the truth? A verdict for each sample, and how far to widen the forecast.

A fold over the messages of the boat: no clock, no randomness. Every verdict clears by itself when the readings are
good again.
"""

from __future__ import annotations

import enum
import math
from collections import deque
from dataclasses import dataclass, replace

import numpy as np

from companion.geo.angles import difference_rad, wrap_pi
from companion.messages import ApparentWind, VehicleState, WindQuality, WindSample, WindSource
from companion.wind.estimators.estimator import gain
from companion.wind.parameters import VaneParameters
from companion.wind.true_wind import LIGHT_MPS, apparent_wind, true_wind

# Detectors of a wind sensor's faults, each a small fold over readings. None of them knows the others.
#
# Thresholds are set so that the 41 h of recorded good wind raise next to no alarm (counts: docs/reference/wind.md).

_STILL_RAD = math.radians(0.4)  # a vane within this has not moved (instruments report whole degrees)
_SWEPT_RAD = math.radians(20.0)  # boat turned this much under a vane that has not moved: frozen
_STILL_LEAST_S = 3.0
_SUSPECT_RAD = math.radians(6.0)  # turned this much: not believed, no verdict yet
_IDENTICAL_RAD = 1e-7  # the very same number again
_IDENTICAL_S = 20.0  # for this long while the boat swung a little: a silent sensor
_SWUNG_RAD = math.radians(5.0)


class FrozenVane:
    """Tell whether the apparent angle stands still although the boat turns under it."""

    def __init__(self) -> None:
        self._since_s: float | None = None
        self._same_s = 0.0
        self._angle = self._last = 0.0
        self._low = self._high = 0.0
        self._same_low = self._same_high = 0.0
        self._heading = 0.0
        self.is_frozen = self.is_suspect = False

    def rest(self) -> None:
        """Forget what was seen: there is too little wind to tell."""
        self._since_s = None
        self.is_frozen = self.is_suspect = False

    def update(self, t_s: float, awa_rad: float, heading_rad: float) -> bool:
        """Take an apparent angle with the heading of that moment; return the verdict."""
        moved = self._since_s is None or abs(wrap_pi(awa_rad - self._angle)) > _STILL_RAD
        if moved:
            self._since_s, self._angle = t_s, awa_rad
            self._low = self._high = 0.0
            self._heading = heading_rad
        if moved or abs(wrap_pi(awa_rad - self._last)) > _IDENTICAL_RAD:
            self._same_s = t_s
            self._same_low = self._same_high = wrap_pi(heading_rad - self._heading)
        self._last = awa_rad
        turned = wrap_pi(heading_rad - self._heading)
        self._low, self._high = min(self._low, turned), max(self._high, turned)
        self._same_low, self._same_high = min(self._same_low, turned), max(self._same_high, turned)
        still_s = t_s - (self._since_s if self._since_s is not None else t_s)
        # A boat that spins carries a frozen vane's wind with it at once: stop believing before being sure.
        self.is_suspect = not moved and self._high - self._low >= _SUSPECT_RAD
        self.is_frozen = (still_s >= _STILL_LEAST_S and self._high - self._low >= _SWEPT_RAD) or (
            t_s - self._same_s >= _IDENTICAL_S and self._same_high - self._same_low >= _SWUNG_RAD
        )
        return self.is_frozen


_SPIKE_RAD = math.radians(45.0)  # a lone reading this far from the last seconds is none of the wind's doing
_SPIKE_ROUGH = 6.0  # ... or this many times the usual departure, whichever is more
_SHIFT_S = 4.0  # readings that stay away this long are a shift, not a spike
_SHARE_S = 60.0
_MANY, _FEW = 0.04, 0.02  # share of spikes that raises, clears the verdict


class Spikes:
    """Which single readings are far from their neighbours, and how many lately?"""

    def __init__(self) -> None:
        self._t_s: float | None = None
        self._sin = self._cos = 0.0
        self._rough_rad = math.radians(8.0)
        self._away_s = 0.0
        self._share_before = 0.0
        self.share = 0.0
        self.is_spiking = False

    def update(self, t_s: float, direction_rad: float) -> bool:
        """Take a direction; return whether this reading is a spike."""
        before_s, self._t_s = self._t_s, t_s
        if before_s is None or t_s - before_s > _GAP_S:
            self._sin, self._cos = math.sin(direction_rad), math.cos(direction_rad)
            return False
        dt_s = max(1e-3, t_s - before_s)
        off = abs(wrap_pi(direction_rad - math.atan2(self._sin, self._cos)))
        is_far = off > max(_SPIKE_RAD, _SPIKE_ROUGH * self._rough_rad)
        if is_far and self._away_s == 0.0:
            self._share_before = self.share
        self._away_s = self._away_s + dt_s if is_far else 0.0
        is_spike = is_far and self._away_s < max(_SHIFT_S, 1.5 * dt_s)
        self.share += gain(dt_s, _SHARE_S) * ((1.0 if is_spike else 0.0) - self.share)
        if is_far and not is_spike:  # it stayed: the wind is there now, and those were no spikes
            self.share = self._share_before
        # A verdict waits until it is clear that the present departure is no shift.
        if self._away_s == 0.0 or self.is_spiking:
            self.is_spiking = self.share > (_FEW if self.is_spiking else _MANY)
        if is_spike:
            return True
        if is_far:
            self._sin, self._cos, self._away_s = math.sin(direction_rad), math.cos(direction_rad), 0.0
            return False
        g = gain(dt_s, 5.0)
        self._sin += g * (math.sin(direction_rad) - self._sin)
        self._cos += g * (math.cos(direction_rad) - self._cos)
        self._rough_rad += gain(dt_s, 60.0) * (min(off, 0.5) - self._rough_rad)
        return False


_SETTLE_S = 10.0  # after a manoeuvre, before the wind is believed again
_LEG_S = 40.0  # averaged on each side of a tack
_LEG_LEAST_S = 15.0
_FORGET = 0.93  # per tack: about fifteen tacks count
_PRIOR_RAD = math.radians(9.0)  # expected mounting error, before any tack
_SURE = 3.0  # standard errors
_OFFSET_LEAST_RAD = math.radians(4.0)


class TackOffset:
    """Tell whether the vane is mounted wrong: port and starboard tack see the same wind, or they disagree.

    A vane that reads ε too far clockwise turns the apparent from-vector A by ε; one that reads κ too wide on both
    sides (upwash, heel) by κ to the side of the wind. To first order the computed true wind moves by

        ΔM = ε J A + κ side J A,    J (east, north) = (north, −east).                                   (a)

    Differenced over a tack, when the wind itself has had no time to change, ε shows in the speed and κ in the
    direction. Least squares over the last tacks, with the wind's own unrest as noise and a prior around zero.
    """

    def __init__(self) -> None:
        self._side = 0
        self._side_since_s = 0.0
        self._busy_s = -math.inf
        self._t_s: float | None = None
        self._leg = np.zeros(7)  # weight, M (2), J A (2), side J A (2)
        self._before: np.ndarray[tuple[int], np.dtype[np.float64]] | None = None
        self._before_s = 0.0
        self._normal = np.zeros((2, 2))
        self._right = np.zeros(2)
        self.tacks = 0
        self._solution = (0.0, 0.0, _PRIOR_RAD, _PRIOR_RAD)

    def update(
        self,
        t_s: float,
        wind_en_mps: tuple[float, float],
        velocity_en_mps: tuple[float, float],
        awa_rad: float,
        *,
        is_turning: bool,
    ) -> None:
        """Take the from-vector of the computed true wind, the boat's velocity and the apparent angle."""
        dt_s = 0.0 if self._t_s is None else min(5.0, max(0.0, t_s - self._t_s))
        self._t_s = t_s
        side = 1 if awa_rad > 0.0 else -1
        if side != self._side:
            if self._leg[0] >= _LEG_LEAST_S:
                self._before, self._before_s = self._leg / self._leg[0], t_s
            self._side, self._side_since_s = side, t_s
            self._leg = np.zeros(7)
        if is_turning:
            self._busy_s = t_s
        if t_s - self._busy_s < _SETTLE_S or t_s - self._side_since_s < _SETTLE_S:
            return
        east, north = wind_en_mps
        if math.hypot(east, north) < 1.5 or abs(awa_rad) > math.radians(130.0) or abs(awa_rad) < math.radians(12.0):
            return
        ae, an = east + velocity_en_mps[0], north + velocity_en_mps[1]
        keep = math.exp(-dt_s / _LEG_S)
        self._leg = keep * self._leg + dt_s * np.array([1.0, east, north, an, -ae, side * an, -side * ae])
        if self._before is not None and self._leg[0] >= _LEG_LEAST_S:
            if t_s - self._before_s > 3.0 * _LEG_S:
                self._before = None
            elif t_s - self._before_s > _SETTLE_S + _LEG_LEAST_S:
                self._learn(self._leg / self._leg[0] - self._before)
                self._before = None

    def _learn(self, step: np.ndarray[tuple[int], np.dtype[np.float64]]) -> None:
        now = self._leg / self._leg[0]
        unrest = 0.12 * math.hypot(now[1], now[2])  # [m/s] of a mean of half a minute against the next
        matrix = np.array([[step[3], step[5]], [step[4], step[6]]])  # (a)
        self._normal = _FORGET * self._normal + matrix.T @ matrix / unrest**2
        self._right = _FORGET * self._right + matrix.T @ step[1:3] / unrest**2
        self.tacks += 1
        self._solution = self._solve()

    def _solve(self) -> tuple[float, float, float, float]:
        normal = self._normal + np.eye(2) / _PRIOR_RAD**2
        value = np.linalg.solve(normal, self._right)
        error = np.sqrt(np.diag(np.linalg.inv(normal)))
        return float(value[0]), float(value[1]), float(error[0]), float(error[1])

    @property
    def offset_rad(self) -> float | None:
        """ε, positive clockwise, None before two tacks."""
        return self._solution[0] if self.tacks >= 2 else None

    @property
    def side_rad(self) -> float | None:
        """κ, positive when the vane reads too wide on both tacks, None before two tacks."""
        return self._solution[1] if self.tacks >= 2 else None

    @property
    def sure_rad(self) -> float:
        """The part of |ε| + |κ| that is surely there: more than 4 deg and than three standard errors; else 0."""
        if self.tacks < 2:
            return 0.0
        e, k, se, sk = self._solution
        return sum(abs(v) for v, s in ((e, se), (k, sk)) if abs(v) > max(_OFFSET_LEAST_RAD, _SURE * s))

    @property
    def is_misaligned(self) -> bool:
        """Whether ε or κ is surely there."""
        return self.sure_rad > 0.0


class WindVerdict(enum.Enum):
    """What may be wrong with the wind; GOOD alone, the others in any combination."""

    GOOD = "good"
    CALM = "calm"  # too little wind for a direction
    TURNING = "turning"  # in a manoeuvre: compass and vane lag
    FROZEN = "frozen"  # the vane does not move although the boat turns under it
    SPIKING = "spiking"  # single readings far from their neighbours
    MISALIGNED = "misaligned"  # port and starboard tack disagree: the vane is mounted wrong
    TURNED = "turned"  # the direction leapt, and the boat does not sail by it
    RETURNED = "returned"  # readings are back after a gap
    SILENT = "silent"  # no reading for some time
    HELD = "held"  # the autopilot repeats an old true wind
    SYNTHESISED = "synthesised"  # the autopilot invents the direction (no vane configured)
    NO_SPEED_SENSOR = "no_speed_sensor"  # "true" wind without a speed is heading plus vane


@dataclass(frozen=True, slots=True, kw_only=True)
class WindStatus:
    """What is known about the wind's source at ``t_s``.

    The forecast's sigma is widened to hypot(``widening`` sigma, ``extra_sigma_rad``); ``weight`` in 0..1 is how far
    the last sample moved the estimate of the direction, ``speed_weight`` that of the speed. ``offset_rad`` is the
    estimated mounting error of the vane, positive when it reads too far clockwise, ``side_rad`` what it reads too wide
    on both tacks; None when the boat has not tacked enough to tell. ``sample`` is the last sample with the quality
    that it was given. ``reason`` is one line of text.
    """

    t_s: float
    verdicts: tuple[WindVerdict, ...]
    widening: float
    extra_sigma_rad: float
    weight: float
    offset_rad: float | None
    sample: WindSample | None
    age_s: float | None
    reason: str
    side_rad: float | None = None
    speed_weight: float = 1.0

    @property
    def is_good(self) -> bool:
        """Whether nothing is wrong."""
        return self.verdicts == (WindVerdict.GOOD,)


# How far each verdict widens sigma (a factor), unless its proportion is computed.
_GAP_S = 10.0  # [s] without a sample is a gap
_RETURN_S = 30.0  # [s] after it during which the estimate settles
_HELD_S = 10.0  # [s] of the very same true wind on a boat that moves
_AGREES_RAD, _AGREES_MPS = math.radians(10.0), 0.5  # vane and anemometer make the same true wind
_HELD_BLIND_S = 20.0  # [s] likewise when the boat's motion is not known
_ZERO_S = 10.0  # [s] of a speed of exactly nothing
_NEAR_S = 1.5  # [s] vehicle and wind of one instant
_TURNED_S = 10.0  # [s] within which a change of heading is a turn
_LAG_S = 2.0  # [s] after it
_DEAD_MPS = 0.3  # [m/s] less wind than this has no direction at all
TURNED_RAD = math.radians(25.0)  # of heading within those seconds: the definition of the records' ``turning``
_INVENTED_RAD = math.radians(45.0)
_ASSUMED_MPS = 3.0  # [m/s] wind assumed where there is no speed, to bound what the boat's own motion hides


class WindWatch:
    """Judges samples. Feed it everything: ``vehicle``, ``apparent``, ``judge`` in order of time."""

    def __init__(self, parameters: VaneParameters | None = None) -> None:
        self.parameters = parameters or VaneParameters()
        self.contradicted = ""  # why the boat's motion speaks against the sensor (``companion.current.motion``)
        self.tacks = TackOffset()
        self._frozen, self._spikes = FrozenVane(), Spikes()
        self._vehicle: VehicleState | None = None
        self._apparent: ApparentWind | None = None
        self._last: WindSample | None = None
        self._speed_mps = 0.0
        self._back_s, self._gap_s = -math.inf, 0.0
        self._turn_s = -math.inf
        self._headings: deque[tuple[float, float]] = deque(maxlen=11)
        self._frozen_s: float | None = None
        self._same_s = self._zero_s = 0.0  # since when the same true wind, a speed of nothing
        self._same_heading_rad = 0.0
        self._has_moved = False

    def vehicle(self, state: VehicleState) -> None:
        """Take how the boat moves."""
        self._vehicle = state
        # A heading that has changed for good, not the yaw rate: a small boat yaws faster than this in every wave.
        if not self._headings or state.t_s - self._headings[-1][0] >= 1.0 or state.t_s < self._headings[-1][0]:
            self._headings.append((state.t_s, state.heading_rad))
        if any(
            0.0 < state.t_s - then_s <= _TURNED_S and abs(wrap_pi(state.heading_rad - heading)) > TURNED_RAD
            for then_s, heading in self._headings
        ):
            self._turn_s = state.t_s
        turned = abs(wrap_pi(state.heading_rad - self._same_heading_rad)) > math.radians(1.0)
        self._has_moved = self._has_moved or turned or state.speed_mps > 0.3

    def apparent(self, wind: ApparentWind) -> None:
        """Take what the boat feels."""
        self._apparent = wind
        if wind.aws_mps < LIGHT_MPS:
            self._frozen.rest()  # so little wind turns no vane: that it stands still says nothing of it
        elif self._vehicle is not None and abs(wind.t_s - self._vehicle.t_s) <= _NEAR_S:
            self._frozen.update(wind.t_s, wind.awa_rad, self._vehicle.heading_rad)

    # ------------------------------------------------------------------------------------------ judging
    def judge(self, sample: WindSample) -> WindStatus:
        """Take a true wind sample and return its verdicts."""
        last, t = self._last, sample.t_s
        dt_s = 0.0 if last is None else max(0.0, t - last.t_s)
        self._last = sample
        found: list[tuple[WindVerdict, str]] = []
        widening, extra, weight = 1.0, 0.0, 1.0
        # A calm is measured: it has a speed, whatever its direction is worth. All else that is doubted is not fed.
        calm_weight = 1.0
        is_held, measured = self._is_held(sample, last), self._measured(sample)
        if is_held and measured is not None:
            sample = replace(sample, tws_mps=measured.tws_mps)

        has_no_speed = self._lacks_speed(sample, dt_s)
        self._speed_mps += (1.0 if last is None else gain(dt_s, 10.0)) * (sample.tws_mps - self._speed_mps)
        if has_no_speed:
            found.append((WindVerdict.NO_SPEED_SENSOR, "no wind speed: the direction is vane plus heading, not true"))
            boat = self._vehicle.speed_mps if self._vehicle is not None else 1.0
            extra = math.hypot(extra, math.atan2(boat, _ASSUMED_MPS))
        elif self._speed_mps < LIGHT_MPS:
            found.append((WindVerdict.CALM, f"{self._speed_mps:.1f} m/s is too little for a direction"))
            lack = 1.0 - self._speed_mps / LIGHT_MPS
            widening *= 1.0 + 2.0 * lack
            calm_weight = 1.0 - 0.8 * lack if sample.tws_mps >= _DEAD_MPS else 0.0
        if self.parameters.is_direction_invented:
            found.append(
                (WindVerdict.SYNTHESISED, f"WNDVN_TYPE {self.parameters.vane_type}: the direction is invented")
            )
            extra = math.hypot(extra, _INVENTED_RAD)
        if is_held:
            found.append((WindVerdict.HELD, "the autopilot repeats an old true wind"))
            widening *= 1.0 + min(2.0, (t - self._same_s) / 60.0)
            calm_weight = 0.0
            weight = weight if measured is not None else 0.0
        is_turning = sample.quality is WindQuality.TURNING or t - self._turn_s < _LAG_S
        if is_turning:
            found.append((WindVerdict.TURNING, "the boat turns: vane and compass lag"))
            weight = min(weight, 0.3)
        frozen_s = self._frozen_for(t)
        if frozen_s > 0.0:
            found.append((WindVerdict.FROZEN, f"the vane has not moved for {frozen_s:.0f} s"))
            widening *= 1.5 + min(1.5, frozen_s / 60.0)
            weight = 0.0
        elif self._frozen.is_suspect:
            weight = 0.0
        if self.contradicted:
            found.append((WindVerdict.TURNED, self.contradicted))
            widening *= 2.0
            weight = 0.0
        # In a calm a wandering direction is no fault of the vane.
        if self._speed_mps >= 2.0 * LIGHT_MPS and not is_turning and frozen_s == 0.0:
            if self._spikes.update(t, sample.twd_from_rad):
                weight = 0.0
            if self._spikes.is_spiking:
                found.append((WindVerdict.SPIKING, f"{100 * self._spikes.share:.0f} % of the readings are spikes"))
                widening *= 1.0 + min(1.0, 4.0 * self._spikes.share)
        self._compare_tacks(sample, is_turning=is_turning or frozen_s > 0.0)
        if self.tacks.is_misaligned:
            offset, side = self.tacks.offset_rad or 0.0, self.tacks.side_rad or 0.0
            found.append(
                (
                    WindVerdict.MISALIGNED,
                    (
                        f"the tacks disagree: vane off by {math.degrees(offset):+.0f} deg, "
                        f"{math.degrees(side):+.0f} deg to the side of the wind"
                    ),
                )
            )
            extra = math.hypot(extra, self.tacks.sure_rad)
        if dt_s > _GAP_S:
            self._back_s, self._gap_s = t, dt_s
        if t - self._back_s < _RETURN_S:
            found.append((WindVerdict.RETURNED, f"back after {self._gap_s:.0f} s of silence"))
            widening *= 1.0 + min(1.0, self._gap_s / 300.0) * (1.0 - (t - self._back_s) / _RETURN_S)
        return WindStatus(
            t_s=t,
            verdicts=tuple(v for v, _ in found) or (WindVerdict.GOOD,),
            widening=widening,
            extra_sigma_rad=extra,
            weight=min(weight, calm_weight),
            speed_weight=weight,
            offset_rad=self.tacks.offset_rad,
            side_rad=self.tacks.side_rad,
            sample=sample,
            age_s=0.0,
            reason="; ".join(text for _, text in found) or "good",
        )

    def _lacks_speed(self, sample: WindSample, dt_s: float) -> bool:
        """No speed sensor configured or, where that is not known, a speed of exactly nothing on a boat that moves.

        A boat that a current carries through a calm looks the same, but feels a wind as fast as it goes.
        """
        self._zero_s = self._zero_s + dt_s if sample.tws_mps == 0.0 else 0.0
        if self.parameters.speed_type is not None:
            return self.parameters.has_no_speed_sensor
        felt, boat = self._apparent, self._vehicle
        if self._zero_s < _ZERO_S or boat is None or boat.speed_mps <= 0.5:
            return False
        is_heard = felt is not None and sample.t_s - felt.t_s < 3.0
        return not (is_heard and felt is not None and 0.0 < felt.aws_mps < boat.speed_mps + LIGHT_MPS)

    def _measured(self, sample: WindSample) -> WindSample | None:
        """Return the true wind that vane and anemometer make at this instant, None when they are not heard."""
        felt, boat = self._apparent, self._vehicle
        if felt is None or boat is None or max(abs(sample.t_s - felt.t_s), abs(felt.t_s - boat.t_s)) > _NEAR_S:
            return None
        return true_wind(felt, boat)

    def _is_held(self, sample: WindSample, last: WindSample | None) -> bool:
        """Below WNDVN_SPEED_MIN, or bit for bit the same true wind while the boat moves."""
        if sample.source is not WindSource.AUTOPILOT_TRUE:
            return False
        is_same = last is not None and (last.twd_from_rad, last.tws_mps) == (sample.twd_from_rad, sample.tws_mps)
        if not is_same:
            self._same_s, self._has_moved = sample.t_s, False
            if self._vehicle is not None:
                self._same_heading_rad = self._vehicle.heading_rad
        least = self.parameters.speed_min_mps
        if least and self._apparent is not None and sample.t_s - self._apparent.t_s < 3.0:
            return self._apparent.aws_mps < least
        same_s = sample.t_s - self._same_s
        if same_s < _HELD_S or not (self._has_moved or (self._vehicle is None and same_s >= _HELD_BLIND_S)):
            return False
        # A wind that blows on unchanged, on a bench, is measured as the same again and again.
        measured = self._measured(sample)
        return measured is None or not (
            abs(difference_rad(measured.twd_from_rad, sample.twd_from_rad)) <= _AGREES_RAD
            and abs(measured.tws_mps - sample.tws_mps) <= _AGREES_MPS
        )

    def _frozen_for(self, t_s: float) -> float:
        """Return for how long the vane has been seen frozen [s], 0 when it is not."""
        is_known = self._apparent is not None and t_s - self._apparent.t_s < 3.0
        if not (is_known and self._frozen.is_frozen):
            self._frozen_s = None
            return 0.0
        if self._frozen_s is None:
            self._frozen_s = t_s
        return max(1.0, t_s - self._frozen_s)

    def _compare_tacks(self, sample: WindSample, *, is_turning: bool) -> None:
        boat = self._vehicle
        if boat is None or abs(boat.t_s - sample.t_s) > _NEAR_S:
            return
        felt = self._apparent
        if felt is None or abs(felt.t_s - sample.t_s) > _NEAR_S:
            felt = apparent_wind(sample, boat)
        wind = (sample.tws_mps * math.sin(sample.twd_from_rad), sample.tws_mps * math.cos(sample.twd_from_rad))
        self.tacks.update(sample.t_s, wind, boat.velocity_en_mps, felt.awa_rad, is_turning=is_turning)
