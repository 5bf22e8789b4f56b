"""By how far is the vane turned on its mast, as the boat's own motion tells it?

A vane that was mounted, or told (``WNDVN_DIR_OFS``), wrong by 30 degrees lets the autopilot hold the boat head to the
true wind where it believes it close-hauled, and trim its sails for a wind that is not there: it lies in irons, luffs on
one tack and drives on the other. So of all errors that a vane can have the one is likely by which the boat should have
sailed as it did:

    felt by the mast    a = w + v,    a turned back by ε,    w(ε) = R(-ε) a - v,                                 (a)
    speed there         v(ε) = polar(angle of w(ε) to the bow, its speed) d(eased),                               (b)

with w the wind's from-vector over the water, v the boat's velocity through it and d how far a sail draws that is
sheeted for the angle that the mast tells, and eased so much farther than the true one asks for. Boats whose sails do
not draw lie still, or go astern where their bow is in the wind.

The belief is a histogram of ε. What is read on one course to the wind is wrong alike, by gusts and by a current that is
not known: it counts for ``MOST_READINGS`` at most. What was read is forgotten with ``TAU_S``, for a vane slips.

A stream that sets the boat straight astern looks the same. But a vane by which the boat has sailed well cannot turn
without that the wind it tells turns as far: an error is believed only where the direction has come to since, give or
take what winds shift.
"""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from companion.current.estimator import LATE_S, STEADY_MPS2, STEADY_RAD_S, Sailing, Speed
from companion.current.motion import LEAST_TWS_MPS, SETTLES_S, SWINGS_S
from companion.geo.angles import heading_of, wrap_pi

Floats = NDArray[np.float64]

ERRORS_RAD: Floats = np.radians(np.arange(-180.0, 180.0, 5.0))
USUAL_RAD = math.radians(8.0)  # scale of the prior: Cauchy's, for a vane is mounted by eye, or not at all
TRUE_RAD = math.radians(12.5)  # a vane within this is sailed by
SURE = 0.01  # less of the belief within that: it is turned
TAU_S = 150.0
EVERY_S, ALIKE_S = 2.0, 12.0  # of readings: one in so many seconds, and how far apart they are when wrong otherwise
MOST_READINGS = 3.0  # of each course to the wind
COURSES = 12
SPEED_MPS, SPEED_SHARE = 0.25, 0.15  # of a speed: gusts, the polar, a current
STRAYS, STRAY_DENSITY = 0.1, 0.2  # a reading in ten is anything
DRAWS_RAD, LUFFS_RAD = math.radians(5.0), math.radians(27.0)  # eased too far by so much a sail draws, and no longer
DEAD_MPS, ASTERN_SHARE = 0.3, 0.2  # slower she lies dead, and is driven astern by so much of the wind at most ...
ASTERN_RAD = math.radians(50.0)  # ... with her bow so near to it
WELL, LEAST_READINGS = 0.9, 3.0  # so much of the belief within TRUE_RAD, by so many readings: the boat sails well by it
FITS_SHARE = 0.7  # ... and the reading itself is as likely by it, nearly, as by any other error
TOLD_S = 20.0  # of the mean of the direction that the vane tells
SHIFTS_RAD, SHIFTS_MORE_RAD_S, SHIFTS_MOST_RAD = math.radians(25.0), math.radians(1.0) / 60.0, math.radians(55.0)
SET_SHARE = 0.3  # of its speed that sets the boat across its heading: it is the water that does


@dataclass(frozen=True, slots=True, kw_only=True)
class VaneError:
    """How far the vane reads too far clockwise [rad, -π..π], its standard deviation, and whether it surely does.

    ``was_right``: the boat has sailed well by it before.
    """

    off_rad: float
    sigma_rad: float
    is_sure: bool = False
    was_right: bool = False

    @property
    def least_rad(self) -> float:
        """By how far it does at least [rad]: to turn it back by this does not turn it beyond the true wind."""
        return math.copysign(max(0.0, abs(self.off_rad) - self.sigma_rad), self.off_rad)


class VaneCheck:
    """The histogram; a deterministic fold. ``speed`` is the boat's polar."""

    def __init__(self, speed: Speed) -> None:
        self._speed = speed
        self._t_s = self._unsteady_s = self._read_s = -math.inf
        self._means: tuple[complex, complex] | None = None  # heading's unit vector and velocity over the last seconds
        self._fits = np.zeros((COURSES, ERRORS_RAD.size))  # sums of log likelihoods, by the course to the wind told
        self._readings = np.zeros(COURSES)
        self._told: complex | None = None  # mean of where the wind comes from, by the vane
        self._well: tuple[float, complex] | None = None  # when the boat sailed well by it, and what it told then
        self._across_m = self._made_m = 0.0  # made good across the heading, and in all

    def forget(self) -> None:
        """Begin anew with what the boat's motion tells, for the direction has leapt."""
        self._fits[:] = 0.0
        self._readings[:] = 0.0

    def update(self, now: Sailing | None, current_en_mps: tuple[float, float]) -> None:
        """Take one moment, in water that is expected to flow so [m/s, east north]."""
        if now is None or now.t_s <= self._t_s:
            return
        dt_s, self._t_s = min(5.0, now.t_s - self._t_s), now.t_s
        if not now.is_driven or now.age_s > LATE_S:
            self._means = None
            return
        keep = math.exp(-dt_s / TAU_S)
        self._fits *= keep
        self._readings *= keep
        told = cmath.rect(1.0, now.twd_from_rad)
        self._told = told if self._told is None else self._told + -math.expm1(-dt_s / TOLD_S) * (told - self._told)
        bow = cmath.rect(1.0, now.heading_rad)
        made = complex(now.velocity_en_mps[0] - current_en_mps[0], now.velocity_en_mps[1] - current_en_mps[1])
        self._made_m = keep * self._made_m + dt_s * abs(made)
        across_mps = made.real * math.cos(now.heading_rad) - made.imag * math.sin(now.heading_rad)
        self._across_m = keep * self._across_m + dt_s * abs(across_mps)
        if self._means is None:
            self._means, self._unsteady_s = (bow, made), now.t_s
        was_bow, was_made = self._means
        share = -math.expm1(-dt_s / SWINGS_S)
        bow, made = was_bow + share * (bow - was_bow), was_made + share * (made - was_made)
        self._means = bow, made
        if abs(wrap_pi(cmath.phase(bow) - cmath.phase(was_bow))) > STEADY_RAD_S * dt_s:
            self._unsteady_s = now.t_s
        is_steady = now.t_s - self._unsteady_s >= SETTLES_S and (
            abs(abs(made) - abs(was_made)) <= STEADY_MPS2 * max(0.2, dt_s)
        )
        if is_steady and now.t_s - self._read_s >= EVERY_S and now.tws_mps >= LEAST_TWS_MPS:
            self._read_s = now.t_s
            self._read(now, cmath.phase(bow), made, current_en_mps)

    def _read(self, now: Sailing, heading_rad: float, made: complex, current_en_mps: tuple[float, float]) -> None:
        felt_e = now.tws_mps * math.sin(now.twd_from_rad) + current_en_mps[0] + made.real
        felt_n = now.tws_mps * math.cos(now.twd_from_rad) + current_en_mps[1] + made.imag
        told_rad = abs(wrap_pi(heading_of(felt_e, felt_n) - heading_rad))
        sin, cos = np.sin(ERRORS_RAD), np.cos(ERRORS_RAD)
        turned_e, turned_n = cos * felt_e - sin * felt_n, cos * felt_n + sin * felt_e
        wind_e, wind_n = turned_e - made.real, turned_n - made.imag  # (a)
        twa = np.abs(_wrap(np.arctan2(wind_e, wind_n) - heading_rad))
        tws = np.hypot(wind_e, wind_n)
        eased = told_rad - np.abs(_wrap(np.arctan2(turned_e, turned_n) - heading_rad))
        draws = np.clip((LUFFS_RAD - eased) / (LUFFS_RAD - DRAWS_RAD), 0.0, 1.0)
        speeds = draws * [self._speed(float(a), float(w)) for a, w in zip(twa, tws, strict=True)]  # (b)
        along_mps = made.real * math.sin(heading_rad) + made.imag * math.cos(heading_rad)
        is_dead = (speeds < DEAD_MPS) & (along_mps < speeds)
        astern = np.where(is_dead & (twa < ASTERN_RAD), ASTERN_SHARE * tws, 0.0)
        off = np.where(is_dead, np.maximum(0.0, -astern - along_mps), along_mps - speeds)
        fit = (1.0 - STRAYS) * np.exp(-0.5 * (off / (SPEED_MPS + SPEED_SHARE * speeds)) ** 2) + STRAYS * STRAY_DENSITY
        course = int((wrap_pi(now.twd_from_rad - heading_rad) + math.pi) / (2.0 * math.pi) * COURSES) % COURSES
        self._fits[course] += EVERY_S / ALIKE_S * np.log(fit)
        self._readings[course] += EVERY_S / ALIKE_S
        is_near = np.abs(ERRORS_RAD) <= TRUE_RAD
        is_true = float(self._belief()[is_near].sum()) >= WELL and fit[is_near].max() >= FITS_SHARE * fit.max()
        if is_true and self._readings.sum() >= LEAST_READINGS and self._told is not None:
            self._well = now.t_s, self._told

    def _belief(self) -> Floats:
        weights = np.minimum(1.0, MOST_READINGS / np.maximum(self._readings, 1e-9))
        belief = weights @ self._fits - np.log1p((ERRORS_RAD / USUAL_RAD) ** 2)
        share = np.exp(belief - belief.max())
        return np.asarray(share / share.sum())

    def _can_be(self) -> NDArray[np.bool_]:
        """Return which errors a vane can have by which the boat has sailed well, and which has turned since."""
        if self._well is None or self._told is None:
            return np.ones(ERRORS_RAD.size, dtype=bool)
        then_s, then = self._well
        turned_rad = wrap_pi(cmath.phase(self._told) - cmath.phase(then))
        spread_rad = min(SHIFTS_RAD + SHIFTS_MORE_RAD_S * (self._t_s - then_s), SHIFTS_MOST_RAD)
        low, high = min(0.0, turned_rad) - spread_rad, max(0.0, turned_rad) + spread_rad
        return np.abs(_wrap(ERRORS_RAD - 0.5 * (low + high))) <= 0.5 * (high - low)

    def view(self) -> VaneError:
        """Return what is believed now."""
        share = np.where(self._can_be(), self._belief(), 0.0)
        share /= share.sum()
        mean = math.atan2(float(share @ np.sin(ERRORS_RAD)), float(share @ np.cos(ERRORS_RAD)))
        is_set = self._across_m > SET_SHARE * self._made_m
        return VaneError(
            off_rad=mean,
            sigma_rad=math.sqrt(float(share @ _wrap(ERRORS_RAD - mean) ** 2)),
            was_right=self._well is not None,
            is_sure=not is_set and float(share[np.abs(ERRORS_RAD) <= TRUE_RAD].sum()) < SURE,
        )


def _wrap(angles: Floats) -> Floats:
    return np.asarray((angles + np.pi) % (2.0 * np.pi) - np.pi)
