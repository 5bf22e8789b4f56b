"""The current from the boat's own track: where it goes against where it points and how fast it should be.

    ground velocity = (1 + k) v (sin h, cos h) + v (leeway + compass) (cos h, -sin h) + current + noise           (a)

with the heading h and the polar's speed v in the wind over the water. The polar may be wrong by a share k, the compass
by an angle, and leeway sets it to leeward, to the other side on the other tack. So on one heading a current along it
looks like a polar error and one across it like leeway. A vane that is turned makes it seem to point higher on one tack
than on the other, and so too slow on one and too fast on the other, as a current across the wind does: v is that of
the wind with the vane turned back by what is believed of it. The filter carries all six numbers and says what it cannot
tell by its covariance, which shrinks when it sails on headings far apart. It is a Kalman filter, linear but for the
vane (there about what is believed), one reading a second.

The current is a departure from what the mission expects (``Prior``), and goes back to it with ``TAU_S`` where nothing
is heard of it. A reading that no likely water explains (``companion.current.motion``) is not taken. Where such go on
the wind or the water is in doubt: what is believed stays, and a second filter, begun anew, must tell the new water on
headings apart before it is believed. Not where the wind's direction has leapt before: no water does that.
"""

from __future__ import annotations

import cmath
import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from companion.current.motion import FAR_APART_RAD, SHOULD_MPS, STANDS_MPS, SWINGS_S, MotionCheck, MotionSample
from companion.current.prior import STILL, ExpectedCurrent, Prior
from companion.current.water_current import WaterCurrent, over_water
from companion.geo.angles import difference_rad, wrap_pi
from companion.messages import WindForecast

# What is not known of the wind's angle to the boat's bow on a leg: current, leeway, compass and vane, told of together.
#
# A plan lays a leg by the wind as it is measured. On the leg it heads up against a current abeam of it and against its
# leeway, the current turns the wind over the water, and a vane or a compass that errs has turned the wind from the
# start. To first order the angle is off by g x, with x as ``CurrentEstimator`` carries it and, with the wind on the
# side s (1: over starboard) from θ, the course φ, W of wind, v through the water,
#
#     g = (n(θ) / W + n(φ) / v, 0, -s, 1 + v cos β / W, -(1 + v cos β / W)),    n(a) = (cos a, -sin a)           (a)
#
# since the autopilot's wind over ground is its apparent wind, longer by v cos β on a beat at β, less its velocity. The
# wind's mean is left where it is measured, for by that wind the autopilot decides what it beats. What is believed to
# bring the bow nearer to the wind on both tacks alike (leeway, a current down the wind; which of them is all one here)
# is a wider zone. The rest of what is believed, nearer on one tack and farther on the other, is part of the spread, as
# what is not known is.

UNTOLD_MPS = 0.15  # [m/s] of a current that is not planned for: of a stronger one the boat's own track soon tells
SLOW_MPS = 0.5  # [m/s] the least speed that a crab angle is reckoned with
LEAST_MPS = 0.5  # [m/s] likewise the least wind


@dataclass(frozen=True, slots=True, kw_only=True)
class WindAngleUncertainty:
    """What the estimator believes and how well.

    Attributes:
        believed: current east, north [m/s]; share by which the boat is faster than its polar; leeway, compass, vane
            [rad].
        covariance: of these, by rows.
        is_planned: plans reckon with the current; the others of ``believed`` they never do.
    """

    believed: tuple[float, ...]
    covariance: tuple[tuple[float, ...], ...]
    is_planned: bool = False

    def widened(
        self, forecast: WindForecast, *, beat_rad: float, speed_mps: float, leeway_rad: float = 0.0
    ) -> WindForecast:
        """Return the forecast with its direction's spread widened by what is not known on a leg.

        Reckoned for a leg at ``beat_rad`` to the wind, on the worse tack, at ``speed_mps`` through the water;
        ``leeway_rad`` is the leeway that the plan has there. Of a current that is not planned for, ``UNTOLD_MPS`` at
        most. Half widths grow as the direction's sigma does.
        """
        off, covariance = self._unplanned(leeway_rad)
        starboard, port = _forms(forecast, beat_rad, speed_mps)
        nearer = 0.5 * (port - starboard) @ off
        more = np.maximum(
            np.einsum("ni,ij,nj->n", starboard, covariance, starboard) + (starboard @ off + nearer) ** 2,
            np.einsum("ni,ij,nj->n", port, covariance, port) + (port @ off - nearer) ** 2,
        )
        if self.is_planned:  # the wind over the water has its own doubt already (``forecast_over_water``)
            turned = _turned(forecast)
            more = np.maximum(more - np.einsum("ni,ij,nj->n", turned, covariance[:2, :2], turned), 0.0)
        sigma = np.minimum(np.sqrt(forecast.sigma_twd_rad**2 + more), math.pi)
        factor = sigma / np.maximum(forecast.sigma_twd_rad, 1e-9)
        return replace(
            forecast, sigma_twd_rad=sigma, half_width_rad=np.minimum(forecast.half_width_rad * factor[:, None], math.pi)
        )

    def nearer_rad(
        self, forecast: WindForecast, *, beat_rad: float, speed_mps: float, leeway_rad: float = 0.0
    ) -> float:
        """Return how much nearer to the wind the bow is believed to be than a plan has it, on either tack [rad, >= 0].

        The arguments are those of ``widened``. A bow that is believed to be farther from the wind on both is none.
        """
        off, _ = self._unplanned(leeway_rad)
        starboard, port = _forms(forecast, beat_rad, speed_mps)
        return max(0.0, float(0.5 * (port[0] - starboard[0]) @ off))

    def _unplanned(self, leeway_rad: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return what is believed and plans do not reckon with, (6,), and its covariance, (6, 6)."""
        off, covariance = np.array(self.believed), np.array(self.covariance)
        off[3] -= leeway_rad
        if self.is_planned:
            off[:2] = 0.0
            return off, covariance
        moment = covariance[:2, :2] + np.outer(off[:2], off[:2])
        most = math.sqrt(max(float(np.linalg.eigvalsh(moment)[1]), 1e-12))
        shrunk = np.array([min(1.0, UNTOLD_MPS / most)] * 2 + [1.0] * 4)
        return off * shrunk, covariance * np.outer(shrunk, shrunk)


def _forms(
    forecast: WindForecast, beat_rad: float, speed_mps: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the linear forms g of (a) for a beat on starboard tack and on port, (n, 6) each."""
    from_rad, wind_mps = forecast.mean_twd_from_rad, np.maximum(forecast.mean_tws_mps, LEAST_MPS)
    speed_mps = max(speed_mps, SLOW_MPS)
    forms = []
    for side in (1.0, -1.0):
        g = np.zeros((from_rad.shape[0], 6))
        g[:, :2] = _turned(forecast) + _abeam(from_rad - side * beat_rad) / speed_mps
        g[:, 3] = -side
        g[:, 4] = 1.0 + speed_mps * math.cos(beat_rad) / wind_mps
        g[:, 5] = -g[:, 4]
        forms.append(g)
    return forms[0], forms[1]


def _turned(forecast: WindForecast) -> NDArray[np.float64]:
    """Return how a current turns the wind over the water [rad per m/s], (n, 2)."""
    wind_mps = np.maximum(forecast.mean_tws_mps, LEAST_MPS)
    return np.asarray(_abeam(forecast.mean_twd_from_rad) / wind_mps[:, None])


def _abeam(of_rad: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the unit vectors to starboard of directions, (n, 2)."""
    return np.column_stack([np.cos(of_rad), -np.sin(of_rad)])


Matrix = NDArray[np.float64]
TILT_RAD = math.radians(3.0)  # of the vane to either side, to see what it makes of its speed
Speed = Callable[[float, float], float]
"""Speed through the water [m/s] at a true wind angle [rad] in a wind over the water [m/s]: the boat's polar."""

SCALE_SD = 0.12  # of the polar: what a polar not measured on this very boat is wrong by
ANGLE_SD_RAD = math.radians(2.5)  # of the compass, and so of leeway
VANE_SD_RAD = math.radians(4.0)  # of a vane mounted by eye
TAU_S = 7200.0  # a tide turns within hours
SLOW_S = 36_000.0  # polar, leeway, compass and vane hardly change in a voyage
ALONG_MPS, ALONG_SHARE = 0.08, 0.06  # noise of a reading along the heading: gusts that the hull has not answered
ACROSS_MPS, ACROSS_SHARE = 0.06, 0.03
ALIKE_S = 12.0  # readings this near in time are wrong alike: waves, a gust, the helm
TURNING_ALIKE_S = 4.0  # likewise across a heading that turns: what is wrong on one is another way round soon
STEADY_RAD_S = math.radians(6.0)  # faster turns are manoeuvres ...
SETTLES_S = 6.0  # ... after which, and the means with them, it needs this long to have its speed again
STEADY_MPS2 = 0.06  # a faster change of speed is none of the polar's
LEAST_TWA_RAD = math.radians(38.0)  # closer to the wind the polar says little
CIRCLES_S = 30.0  # a boat that turns for so long without a steady moment is held: read across its heading
LAGS_S = 0.4  # how late a velocity may be against a heading, its slip outwards in a turn with it
EVERY_S = 1.0
LATE_S = 1.5  # an older position is no reading
GATE = 16.0  # of the innovation squared over its variance, two degrees of freedom: one in 3000
MISFIT_SAMPLES, MISFIT = 15.0, 0.5  # the mean of that figure: 0.1 at most in a steady current, noise being twelvefold
FADE_SHARE = 0.02  # of the prior's variance, for each reading while it does not fit
GATED_S = 60.0  # what does not fit for so long is the new truth
BELIEVED_S = 60.0  # the boat is held against the water that was believed so long ago: water changes slowly
NEW_WATER_S = 60.0  # of readings, on headings apart, tell of water that changed as water seldom does ...
NEW_WATER_MPS, NEW_WATER_SPREADS = 0.5, 3.0  # ... no stronger than so many of this and of the prior's spread


@dataclass(frozen=True, slots=True, kw_only=True)
class Sailing:
    """One moment of the boat: velocity over ground [m/s], heading, and the wind over the ground.

    ``is_driven``: its sails are sheeted and nothing else drives it; ``is_heard``: the wind is what the vane says now,
    not the last that was believed of one that is frozen: that is held against how the boat moves, and teaches nothing;
    ``age_s``: of the velocity and the heading;
    ``roll_rad``: positive to starboard, None where it is not told.
    """

    t_s: float
    velocity_en_mps: tuple[float, float]
    heading_rad: float
    twd_from_rad: float
    tws_mps: float
    is_driven: bool
    is_heard: bool = True
    age_s: float = 0.0
    roll_rad: float | None = None


def _through_water(
    velocity_en_mps: tuple[float, float], current_en_mps: tuple[float, float], heading_rad: float
) -> tuple[float, float]:
    """Return a velocity over ground as one through the water, ahead and to starboard [m/s]."""
    east, north = velocity_en_mps[0] - current_en_mps[0], velocity_en_mps[1] - current_en_mps[1]
    sin, cos = math.sin(heading_rad), math.cos(heading_rad)
    return east * sin + north * cos, east * cos - north * sin


class CurrentEstimator:
    """The filter. A deterministic fold of what it is given: no clock, no file.

    Args:
        speed: the boat's polar.
        prior: what the mission expects.
        speed_error: how far all speeds of the polar may be off together, as the deviation of the logarithm: of a guess
            much, and what is faster or slower by it is the boat's, not the water's or the wind's.
        checked: readings are held against what water can do; without, all are taken.
    """

    def __init__(self, speed: Speed, prior: Prior = STILL, *, speed_error: float = 0.0, checked: bool = True) -> None:
        self._speed, self._prior, self._speed_error = speed, prior, speed_error
        self._check = MotionCheck() if checked else None
        self._trial: CurrentEstimator | None = None  # of the water that is there since the doubt began
        self._believed: deque[tuple[float, tuple[float, float]]] = deque()  # the current, when
        self._x = np.zeros(6)  # departure east, north [m/s]; share k; leeway, compass, vane [rad]
        self._expected: ExpectedCurrent | None = None
        self._p = np.zeros((6, 6))
        self._t_s: float | None = None
        self._unsteady_s = -math.inf
        self._last: Sailing | None = None
        self._means: tuple[complex, complex] | None = None  # heading's unit vector and velocity over the last seconds
        self._taken_s = -math.inf
        self._steady_s = -math.inf  # of the last steady moment, or the last at which it was not driven
        self._samples_s = self._turning_s = 0.0  # of readings, and of those that were taken while it turned
        self._rejected_s = 0.0
        self._misfit = 0.0
        self._seen: dict[int, float] = {}  # headings by sectors of 20 degrees: when they were sailed last
        self._is_significant = prior.strongest_mps > 0.0  # what is expected is planned for until in doubt

    # ------------------------------------------------------------------------------------------- feed
    def update(self, t_s: float, utc_s: float | None, now: Sailing | None) -> None:
        """Take one moment; ``utc_s`` is the Unix time, None where it is not known; None: nothing new is known."""
        self._predict(t_s, utc_s)
        if now is None:
            return
        last, self._last = self._last, now
        if self._check is not None and now.is_heard:
            self._check.follow_wind(t_s, now.twd_from_rad, now.tws_mps, is_driven=now.is_driven)
        if last is None or not now.is_driven or now.age_s > LATE_S:
            self._unsteady_s = self._steady_s = t_s
            self._means = None
            if self._check is not None:
                self._check.pause()
            return
        dt_s = now.t_s - last.t_s
        if dt_s <= 0.0:
            return
        # In a seaway the bow swings faster than it turns in a tack, and the boat goes on as before.
        bow, made = cmath.rect(1.0, now.heading_rad), complex(*now.velocity_en_mps)
        was_bow, was_made = (bow, made) if self._means is None else self._means
        share = 1.0 - math.exp(-dt_s / SWINGS_S)
        bow, made = was_bow + share * (bow - was_bow), was_made + share * (made - was_made)
        self._means = bow, made
        is_doubted = self._check is not None and self._is_doubted(t_s, utc_s, now, self._check)
        if abs(difference_rad(cmath.phase(bow), cmath.phase(was_bow))) > STEADY_RAD_S * dt_s:
            self._unsteady_s = t_s
        if is_doubted or not now.is_heard or t_s - self._taken_s < 0.9 * EVERY_S:
            return
        if t_s - self._unsteady_s < SETTLES_S:
            if t_s - self._steady_s > CIRCLES_S:
                self._take_turning(t_s, now, abs(difference_rad(now.heading_rad, last.heading_rad)) / dt_s)
            return
        if abs(abs(made) - abs(was_made)) > STEADY_MPS2 * max(0.2, dt_s):
            return
        self._steady_s = t_s
        self._take(t_s, replace(now, heading_rad=cmath.phase(bow), velocity_en_mps=(made.real, made.imag)))

    # ------------------------------------------------------------------------------------------ doubt
    def _is_doubted(self, t_s: float, utc_s: float | None, now: Sailing, check: MotionCheck) -> bool:
        """Hold a moment against what is believed; return whether it is not to be learned from."""
        expected, means = self._expected, self._means
        assert expected is not None
        assert means is not None
        self._believed.append((t_s, self.current_en_mps))
        while t_s - self._believed[0][0] > BELIEVED_S:
            self._believed.popleft()
        current = self._believed[0][1]
        twa, speed = self._speed_with(now, current, float(self._x[5]))
        heading_rad, made = cmath.phase(means[0]), means[1]
        sin, cos = math.sin(heading_rad), math.cos(heading_rad)
        along, across = _through_water((made.real, made.imag), current, heading_rad)
        unknown = max(0.0, float(np.array([sin, cos]) @ self._p[:2, :2] @ np.array([sin, cos])))
        unknown += speed**2 * max(0.0, float(self._p[2, 2]) - SCALE_SD**2)  # of a guessed polar
        was = check.doubt
        mean = MotionSample(
            along_mps=along,
            across_mps=across,
            speed_mps=speed * self.scale,
            twa_rad=twa,
            twd_from_rad=now.twd_from_rad,
            tws_mps=now.tws_mps,
            heading_rad=heading_rad,
            sigma_mps=math.sqrt(unknown),
            roll_rad=now.roll_rad,
            is_heard=now.is_heard,
        )
        if self._trial is not None:  # a boat that is held turns all the time, in the water that its turns tell of
            current = self._trial.current_en_mps
            twa, speed = self._speed_with(now, current, float(self._x[5]))
        along, across = _through_water(now.velocity_en_mps, current, now.heading_rad)
        at_once = replace(mean, along_mps=along, across_mps=across, speed_mps=speed * self.scale, twa_rad=twa)
        check.update(t_s, mean, replace(at_once, heading_rad=now.heading_rad))
        if not check.doubt:
            self._trial = None
            return check.is_odd
        if not check.is_winds and now.is_heard:
            if not was or self._trial is None:
                self._trial = CurrentEstimator(self._speed, self._prior, speed_error=self._speed_error, checked=False)
            self._trial.update(t_s, utc_s, now)
            if self._trial.tells_of_new_water(sails_as_it_should=check.is_refuted):
                self._become(self._trial)
        return True

    @property
    def current_en_mps(self) -> tuple[float, float]:
        """The current that is believed [m/s, east north]."""
        expected = self._expected
        if expected is None:
            return 0.0, 0.0
        return float(expected.east_mps + self._x[0]), float(expected.north_mps + self._x[1])

    @property
    def expected_en_mps(self) -> tuple[float, float]:
        """What the mission expects of the current at this hour [m/s, east north]."""
        return (0.0, 0.0) if self._expected is None else (self._expected.east_mps, self._expected.north_mps)

    def tells_of_new_water(self, *, sails_as_it_should: bool) -> bool:
        """Return whether all that was seen since it was begun is one current that can be, on headings apart.

        What sets the boat across its heading while it turns is no wind's doing, right or wrong: it counts only where
        the boat sails as it should, too.
        """
        samples_s = self._samples_s if sails_as_it_should else self._samples_s - self._turning_s
        if samples_s < NEW_WATER_S or self._headings_rad() < FAR_APART_RAD or self._misfit > MISFIT:
            return False
        assert self._expected is not None
        most_mps = NEW_WATER_SPREADS * math.hypot(NEW_WATER_MPS, self._expected.sigma_mps)
        return math.hypot(float(self._x[0]), float(self._x[1])) <= most_mps

    def _become(self, trial: CurrentEstimator) -> None:
        self._x, self._p, self._misfit, self._seen = trial._x, trial._p, trial._misfit, trial._seen
        self._samples_s, self._turning_s = trial._samples_s, trial._turning_s
        self._rejected_s, self._taken_s, self._steady_s = 0.0, trial._taken_s, trial._steady_s
        self._trial = None
        self._believed.clear()
        if self._check is not None:
            self._check.settle()

    @property
    def motion_doubt(self) -> str:
        """Why wind or water are not believed, in words; empty: they are."""
        return "" if self._check is None else self._check.doubt

    @property
    def fits_s(self) -> float:
        """For how long the boat has moved as it should since this was begun, or a doubt [s]."""
        return 0.0 if self._check is None else self._check.fits_s

    @property
    def doubts_wind(self) -> bool:
        """Whether the doubt is of the wind sensor."""
        return self._check is not None and self._check.is_winds

    @property
    def wind_before_rad(self) -> float | None:
        """Where the wind came from before its direction leapt, while that is doubted; else None."""
        return None if self._check is None else self._check.before_rad

    def _predict(self, t_s: float, utc_s: float | None) -> None:
        expected = self._prior.at(utc_s)
        if self._t_s is None or self._expected is None:
            self._p = np.diag(self._limit(expected))
        else:
            dt_s = max(0.0, t_s - self._t_s)
            keep = np.exp(-dt_s / np.array([TAU_S, TAU_S, SLOW_S, SLOW_S, SLOW_S, SLOW_S]))
            was = self._expected
            limit = self._limit(expected)
            self._x *= keep
            self._p = self._p * np.outer(keep, keep) + np.diag(limit * (1.0 - keep**2))
            if expected.sigma_mps > was.sigma_mps:  # a table that ends: what is doubted more is at once
                more = expected.sigma_mps**2 - was.sigma_mps**2
                self._p[0, 0] += more
                self._p[1, 1] += more
            if was.verdict and not expected.verdict:  # a row can be chosen at last: what it says is one more reading
                self._x[:2] += (was.east_mps - expected.east_mps, was.north_mps - expected.north_mps)
                self._correct(np.eye(2, 6), -self._x[:2], np.eye(2) * expected.sigma_mps**2)
        self._t_s, self._expected = t_s, expected

    def _correct(self, h: Matrix, residual: Matrix, noise: Matrix) -> None:
        """Take a reading whose departure from what was predicted is ``residual`` (Kalman's correction)."""
        gain = self._p @ h.T @ np.linalg.inv(h @ self._p @ h.T + noise)
        self._x = self._x + gain @ residual
        rest = np.eye(6) - gain @ h
        self._p = rest @ self._p @ rest.T + gain @ noise @ gain.T  # Joseph's form keeps it a covariance

    def _take(self, t_s: float, now: Sailing) -> None:
        assert self._expected is not None
        x, current = self._x, self.current_en_mps
        base = np.array([self._expected.east_mps, self._expected.north_mps])
        twa, v = self._speed_with(now, current, float(x[5]))
        sin, cos = math.sin(now.heading_rad), math.cos(now.heading_rad)
        should_mps = math.hypot(v * sin + current[0], v * cos + current[1])  # over the ground: a stream may hold her
        if abs(twa) < LEAST_TWA_RAD or (math.hypot(*now.velocity_en_mps) < STANDS_MPS and should_mps > SHOULD_MPS):
            return
        along, across = np.array([sin, cos]), np.array([cos, -sin])  # across: to starboard
        side = -1.0 if twa > 0.0 else 1.0  # leeway goes to leeward
        slope = (
            self._speed_with(now, current, float(x[5]) + TILT_RAD)[1]
            - self._speed_with(now, current, float(x[5]) - TILT_RAD)[1]
        ) / (2.0 * TILT_RAD)
        h = np.column_stack([np.eye(2), v * along, side * v * across, v * across, slope * along])  # (a)
        z = np.asarray(now.velocity_en_mps) - base - (v - slope * x[5]) * along
        noise = (
            (
                (ALONG_MPS + ALONG_SHARE * v) ** 2 * np.outer(along, along)
                + (ACROSS_MPS + ACROSS_SHARE * v) ** 2 * np.outer(across, across)
            )
            * ALIKE_S
            / EVERY_S
        )
        self._learn(t_s, now.heading_rad, h, z - h @ x, noise)

    def _take_turning(self, t_s: float, now: Sailing, rate_rad_s: float) -> None:
        """Take what sets the boat across its heading: a current's, however fast it goes while it turns."""
        assert self._expected is not None
        base, current = np.array([self._expected.east_mps, self._expected.north_mps]), self.current_en_mps
        twa, _ = self._speed_with(now, current, float(self._x[5]))
        speed_mps = _through_water(now.velocity_en_mps, current, now.heading_rad)[0]
        if abs(twa) < LEAST_TWA_RAD or speed_mps < SLOW_MPS:
            return
        across = np.array([math.cos(now.heading_rad), -math.sin(now.heading_rad)])  # to starboard
        side = -1.0 if twa > 0.0 else 1.0
        h = np.concatenate([across, [0.0, side * speed_mps, speed_mps, 0.0]])[None, :]  # (a), across
        residual = np.array([(np.asarray(now.velocity_en_mps) - base) @ across]) - h @ self._x
        sigma = ACROSS_MPS + (ACROSS_SHARE + LAGS_S * rate_rad_s) * speed_mps
        if self._learn(t_s, now.heading_rad, h, residual, np.array([[sigma**2 * TURNING_ALIKE_S / EVERY_S]])):
            self._turning_s += EVERY_S

    def _learn(self, t_s: float, heading_rad: float, h: Matrix, r: Matrix, noise: Matrix) -> bool:
        """Take a reading that is no stray, and return whether it is none: ``r`` is how far from predicted it is."""
        assert self._expected is not None
        self._taken_s = t_s
        misfit = float(r @ np.linalg.inv(h @ self._p @ h.T + noise) @ r)
        self._misfit += (min(misfit, GATE) - self._misfit) / MISFIT_SAMPLES
        if self._misfit > MISFIT:  # the water has changed faster than a tide: believe the past less
            self._p[:2, :2] += np.eye(2) * FADE_SHARE * self._expected.sigma_mps**2
        if misfit > GATE:
            self._rejected_s += EVERY_S
            if self._rejected_s < GATED_S:
                return False
            self._p[:2, :2] += np.eye(2) * self._expected.sigma_mps**2  # it has changed: look again
        self._rejected_s = 0.0
        self._correct(h, r, noise)
        self._samples_s += EVERY_S
        self._seen[int(wrap_pi(heading_rad) // math.radians(20.0))] = t_s
        return True

    def _speed_with(self, now: Sailing, current_en_mps: tuple[float, float], vane_rad: float) -> tuple[float, float]:
        """Return the wind's angle to the bow and the polar's speed, where the vane is turned clockwise so far."""
        east, north = now.velocity_en_mps
        felt_e = now.tws_mps * math.sin(now.twd_from_rad) + east
        felt_n = now.tws_mps * math.cos(now.twd_from_rad) + north
        sin, cos = math.sin(vane_rad), math.cos(vane_rad)
        ground_e, ground_n = cos * felt_e - sin * felt_n - east, cos * felt_n + sin * felt_e - north
        from_rad, tws_mps = over_water(math.atan2(ground_e, ground_n), math.hypot(ground_e, ground_n), current_en_mps)
        twa_rad = difference_rad(from_rad, now.heading_rad)  # positive: wind over starboard
        return twa_rad, self._speed(twa_rad, tws_mps)

    # ------------------------------------------------------------------------------------------- read
    def view(self) -> WaterCurrent:
        """Return the current as it is known now; whether it is planned for is decided here, with its hysteresis."""
        expected = self._expected
        if expected is None:
            return WaterCurrent(verdict="nothing is known of the water yet")
        found = WaterCurrent(
            east_mps=self.current_en_mps[0],
            north_mps=self.current_en_mps[1],
            var_ee=float(self._p[0, 0]),
            var_en=float(self._p[0, 1]),
            var_nn=float(self._p[1, 1]),
            headings_rad=self._headings_rad(),
            samples_s=self._samples_s,
            verdict=expected.verdict,
        )
        self._is_significant = found.is_worth_planning(was=self._is_significant)
        return replace(found, is_significant=self._is_significant)

    def doubt(self) -> WindAngleUncertainty | None:
        """Return what is believed and how well, None before the first update; after ``view``, whose decision it has."""
        expected = self._expected
        if expected is None:
            return None
        believed = *self.current_en_mps, *self._x[2:]
        return WindAngleUncertainty(
            believed=tuple(map(float, believed)),
            covariance=tuple(tuple(map(float, row)) for row in self._p),
            is_planned=self._is_significant,
        )

    @property
    def scale(self) -> float:
        """How fast the boat is against its polar, as a share: 1 as it says."""
        return 1.0 + float(self._x[2])

    def _limit(self, expected: ExpectedCurrent) -> Matrix:
        """Return the variances of what is not known before anything is told."""
        scale_sd = max(SCALE_SD, self._speed_error)
        return np.array([expected.sigma_mps**2] * 2 + [scale_sd**2] + [ANGLE_SD_RAD**2] * 2 + [VANE_SD_RAD**2])

    def _headings_rad(self) -> float:
        """Return how far apart the headings sailed within the current's memory are [rad, 0..π]."""
        if self._t_s is None:
            return 0.0
        recent = [math.radians(20.0) * n for n, t_s in self._seen.items() if self._t_s - t_s < TAU_S]
        return max((abs(difference_rad(a, b)) for a in recent for b in recent), default=0.0)


def plain(current: WaterCurrent) -> dict[str, float | str | bool]:
    """Return the figures of a current for a record: set [deg], drift and sigma [m/s]."""
    return {
        "set_deg": round(math.degrees(current.set_rad), 1),
        "drift_mps": round(current.drift_mps, 3),
        "sigma_mps": round(current.sigma_mps, 3),
        "planned": current.is_significant,
        "verdict": current.verdict,
    }
