"""Detectors of a wind sensor's faults, each a small fold over readings. None of them knows the others.

Thresholds are set so that the 41 h of recorded good wind raise next to no alarm (docs/wind.md has the counts).
"""

from __future__ import annotations

import math

import numpy as np

from companion.geo.angles import wrap_pi
from companion.wind.estimators.estimator import gain

_STILL_RAD = math.radians(0.4)        # a vane within this has not moved (instruments report whole degrees)
_SWEPT_RAD = math.radians(20.0)       # boat turned this much under a vane that has not moved: frozen
_STILL_LEAST_S = 3.0
_SUSPECT_RAD = math.radians(6.0)      # turned this much: not believed, no verdict yet
_IDENTICAL_RAD = 1e-7                 # the very same number again
_IDENTICAL_S = 20.0                   # for this long while the boat swung a little: a silent sensor
_SWUNG_RAD = math.radians(5.0)


class FrozenVane:
    """Does the apparent angle stand still although the boat turns under it?"""

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
        self.is_frozen = (
            (still_s >= _STILL_LEAST_S and self._high - self._low >= _SWEPT_RAD)
            or (t_s - self._same_s >= _IDENTICAL_S and self._same_high - self._same_low >= _SWUNG_RAD)
        )
        return self.is_frozen


_SPIKE_RAD = math.radians(45.0)       # a lone reading this far from the last seconds is none of the wind's doing
_SPIKE_ROUGH = 6.0                    # ... or this many times the usual departure, whichever is more
_SHIFT_S = 4.0                        # readings that stay away this long are a shift, not a spike
_SHARE_S = 60.0
_MANY, _FEW = 0.04, 0.02              # share of spikes that raises, clears the verdict


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
        dt_s = 1.0 if self._t_s is None else min(30.0, max(1e-3, t_s - self._t_s))
        begin = self._t_s is None or t_s - self._t_s > 10.0
        self._t_s = t_s
        if begin:
            self._sin, self._cos = math.sin(direction_rad), math.cos(direction_rad)
            return False
        off = abs(wrap_pi(direction_rad - math.atan2(self._sin, self._cos)))
        is_far = off > max(_SPIKE_RAD, _SPIKE_ROUGH * self._rough_rad)
        if is_far and self._away_s == 0.0:
            self._share_before = self.share
        self._away_s = self._away_s + dt_s if is_far else 0.0
        is_spike = is_far and self._away_s < max(_SHIFT_S, 1.5 * dt_s)
        self.share += gain(dt_s, _SHARE_S) * ((1.0 if is_spike else 0.0) - self.share)
        if is_far and not is_spike:    # it stayed: the wind is there now, and those were no spikes
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


_SETTLE_S = 10.0                      # after a manoeuvre, before the wind is believed again
_LEG_S = 40.0                         # averaged on each side of a tack
_LEG_LEAST_S = 15.0
_FORGET = 0.93                        # per tack: about fifteen tacks count
_PRIOR_RAD = math.radians(9.0)        # expected mounting error, before any tack
_SURE = 3.0                           # standard errors
_OFFSET_LEAST_RAD = math.radians(4.0)


class TackOffset:
    """Is the vane mounted wrong? Port and starboard tack see the same wind, or they disagree.

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
        self._leg = np.zeros(7)            # weight, M (2), J A (2), side J A (2)
        self._before: np.ndarray[tuple[int], np.dtype[np.float64]] | None = None
        self._before_s = 0.0
        self._normal = np.zeros((2, 2))
        self._right = np.zeros(2)
        self.tacks = 0
        self._solution = (0.0, 0.0, _PRIOR_RAD, _PRIOR_RAD)

    def update(
        self, t_s: float, wind_en_mps: tuple[float, float], velocity_en_mps: tuple[float, float], awa_rad: float, *,
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
        unrest = 0.12 * math.hypot(now[1], now[2])        # [m/s] of a mean of half a minute against the next
        matrix = np.array([[step[3], step[5]], [step[4], step[6]]])                                    # (a)
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
