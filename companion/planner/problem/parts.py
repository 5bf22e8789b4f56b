"""The parts of a planning problem as values: the wind and its uncertainty, the boat, currents, moving discs, limits."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from companion.boat.failed_tack import IRONS_S
from companion.planner.problem.sigma import SIGMA_MODELS, sigma_of

FENCE = "the fence"  # what a fence is called that has no other name
TOUCH_M = 1e-3
"""A path may be this deep in an obstacle [m]: numerical slack for touching."""
NO_GO_SLACK_RAD = math.radians(0.01)
"""A leg may be this far inside the no-go zone [rad]: numerical slack."""

LEAST_MPS = 1e-6
"""A boat that is never faster than this [m/s] cannot move."""
CLEAR_TURN_RAD = math.radians(10.0)
"""A boat that cannot tack turns through dead down wind only where that is the shorter way by twice this [rad]."""
ROUND_RADII = 5.0
"""Turning radii in the leg of a round: from close-hauled to dead down wind and on, 2 tan(135°/2) of them."""


def interpolated(x: float, nodes: Sequence[float], values: Sequence[float]) -> float:
    """Return what ``np.interp`` does, to the bit, of one number and increasing nodes: in a tenth of its time.

    The scorer asks at every leg; numpy makes arrays of both tuples each time.
    """
    if math.isnan(x):
        return x
    i = bisect_right(nodes, x) - 1
    if i < 0:
        return float(values[0])
    if i == len(nodes) - 1 or nodes[i] == x:
        return float(values[i])
    slope = (values[i + 1] - values[i]) / (nodes[i + 1] - nodes[i])
    return float(slope * (x - nodes[i]) + values[i])


@dataclass(frozen=True, slots=True, kw_only=True)
class Sigma:
    """How uncertain the wind direction is, t seconds from now.

    ``none``: 0. ``kalman``: s² = sigma0² + growth² t. ``ar1``: s² = sigma_inf² + (sigma0² - sigma_inf²) e^(-2 rho t).
    ``forecast``: a table over ``horizon_s``, linear between and flat beyond; where ``half_width_rad`` is given it
    is the widening of the no-go zone itself (the half width of the central interval that the direction keeps with
    probability 2 delta_s - 1) and k sigma is not used.
    """

    model: str = "none"
    sigma0_rad: float = 0.0
    growth_rad_per_sqrt_s: float = 0.0
    sigma_inf_rad: float = 0.0
    rho_hz: float = 0.0
    horizon_s: tuple[float, ...] = ()
    sigma_rad: tuple[float, ...] = ()
    half_width_rad: tuple[float, ...] | None = None

    def at(self, t_s: float) -> float:
        """Return sigma [rad] at ``t_s`` >= 0 from now."""
        if self.model == "forecast":
            return interpolated(t_s, self.horizon_s, self.sigma_rad)
        return float(sigma_of(t_s, self.number, self.sigma0_rad, self.later, self.rho_hz))

    @property
    def number(self) -> int:
        """The model as kernels have it."""
        return SIGMA_MODELS.index(self.model)

    @property
    def later(self) -> float:
        """What the model has beside sigma0: its growth [rad/sqrt s] or limit [rad]; 0 of the others."""
        return {"kalman": self.growth_rad_per_sqrt_s, "ar1": self.sigma_inf_rad}.get(self.model, 0.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class ProblemWind:
    """The wind: from where [rad, true], how fast [m/s or None], how sure. A polar is already at this speed.

    ``strength``: how sure that speed is; None: nothing is said of it.
    """

    twd_from_rad: float
    tws_mps: float | None = None
    sigma: Sigma = Sigma()
    strength: Strength | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class BoatLimits:
    """What the boat can do: no-go half angle, deepest angle, turn rate, speed by |TWA| (linear between nodes).

    ``can_tack`` False: no turn goes through the wind's eye, so the boat gybes round. ``gybe_room_m`` is the leg that
    turning round the long way needs; None: five turning radii at full speed. ``speeds`` is the polar in other winds.
    More wind than ``max_tws_mps``, or less than ``min_tws_mps``, it is not to be out in (None: no limit).
    ``tack_fails`` is the chance that a tack fails, below 1; 0: what then comes is not looked at. It then lies for
    ``irons_s``, set to lee at ``lee_mps`` (on starboard tack, on port) beside what the water does. ``speed_error`` is
    how far all its speeds may be off together: the standard deviation of the logarithm; ``speed_share`` what it is
    seen to make of them, and ``shape_error`` how far each may be off beside that, at the angles of
    ``SHAPE_TWA_RAD``. All of it moves when it arrives, not what it is planned to do. ``leeway_rad`` is how much of
    ``no_go_half_rad`` is leeway and current down the wind, which a track cannot tell apart; for words: angles here are
    of courses.
    """

    no_go_half_rad: float
    max_twa_rad: float = math.pi
    turn_rate_radps: float
    polar_twa_rad: tuple[float, ...]
    polar_mps: tuple[float, ...]
    tack_loss_s: float = 0.0
    gybe_loss_s: float = 0.0
    can_tack: bool = True
    gybe_room_m: float | None = None
    speeds: Speeds | None = None
    max_tws_mps: float | None = None
    min_tws_mps: float | None = None
    tack_fails: float = 0.0
    irons_s: float = IRONS_S
    lee_mps: tuple[float, ...] = (0.0, 0.0)
    speed_error: float = 0.0
    speed_share: float = 1.0
    shape_error: tuple[float, ...] = ()
    leeway_rad: float = 0.0

    @property
    def room_m(self) -> float:
        """Length [m] that a leg needs to let the boat turn on by more than half a circle in all.

        0 where it makes no difference: a boat that tacks and gybes without loss always turns the shorter way.
        """
        if self.can_tack and self.tack_loss_s == 0.0 and self.gybe_loss_s == 0.0:
            return 0.0
        if self.gybe_room_m is not None:
            return self.gybe_room_m
        return ROUND_RADII * max(self.polar_mps) / self.turn_rate_radps

    @property
    def most_turn_rad(self) -> float:
        """How far the boat may turn [rad] between two legs of that length; the first turn of all is free of it."""
        return math.pi if self.can_tack else math.pi - CLEAR_TURN_RAD

    def speed_mps(self, twa_rad: float) -> float:
        """Return the speed [m/s] at the true wind angle."""
        return interpolated(abs(twa_rad), self.polar_twa_rad, self.polar_mps)


@dataclass(frozen=True, slots=True, kw_only=True)
class Current:
    """A constant current over the ground, towards ``set_rad`` at ``drift_mps``.

    The wind is then the wind on the water, headings are through the water and legs are over the ground.
    """

    set_rad: float = 0.0
    drift_mps: float = 0.0

    @property
    def en_mps(self) -> tuple[float, float]:
        """Towards east and north [m/s]."""
        return self.drift_mps * math.sin(self.set_rad), self.drift_mps * math.cos(self.set_rad)


NO_CURRENT = Current()


@dataclass(frozen=True, slots=True, kw_only=True)
class AutopilotBeatZone:
    """In a current: courses over the ground within ``half_rad`` of ``from_rad`` the autopilot does not follow as lines.

    ArduRover knows the wind over the ground alone. A leg whose course lies within its no-go angle of that it beats, and
    within 10 degrees more it steers the bearing, whatever the water does. Such a leg is allowed only as a ``Beat``, and
    no other leg is beaten: outside the zone the autopilot keeps to the line, pinching where it has to.

    With ``open_half_rad`` it is the zone of a boat that may beat: there, and where its heading is that far off the wind
    over the water, it goes as it likes.
    """

    from_rad: float
    half_rad: float
    open_half_rad: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class RiskLimit:
    """Bound on the accumulated risk of the whole path, and the wind's correlation time it assumes."""

    max_path_risk: float
    correlation_time_s: float = 60.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Beat:
    """What the autopilot makes of a leg inside its no-go zone (``companion.planner.problem.evaluate``).

    It sails at ``no_go_half_rad`` off the wind and tacks ``corridor_m`` (above 0) off the line, in ``tack_s`` each.
    A leg is left to it only where nothing solid is within ``clearance_m`` (0 or more) of the line.
    """

    no_go_half_rad: float
    corridor_m: float
    clearance_m: float
    tack_s: float = 0.0


# How strong the wind may be, t seconds from the start, and how fast the boat is in other winds than the problem's.
#
# The strength at an instant is Gaussian about the forecast's mean, cut off at no wind; from instant to instant it is a
# Gauss-Markov process with the correlation time that the forecast has. Without a ``Strength`` a problem says nothing of
# it, and nothing is promised of the time of arrival.

ASSUMED_SHARE = 0.25
"""Of the mean, where nothing is known of the spread: an hour of wind over water spreads by a tenth to a fifth of it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Strength:
    """The wind's strength: a table over ``horizon_s``, linear between and flat beyond.

    Attributes:
        horizon_s: (n,) strictly increasing, 0 or later.
        mean_mps: (n,) what is expected.
        sigma_mps: (n,) its spread.
        correlation_s: how long a departure lasts.
        is_known: it was forecast; else it is an assumption.

    """

    horizon_s: tuple[float, ...]
    mean_mps: tuple[float, ...]
    sigma_mps: tuple[float, ...]
    correlation_s: float = 60.0
    is_known: bool = True

    @property
    def is_sound(self) -> bool:
        """Whether every number is one, and none is negative."""
        numbers = (*self.horizon_s, *self.mean_mps, *self.sigma_mps, self.correlation_s)
        return all(math.isfinite(x) and x >= 0.0 for x in numbers) and self.correlation_s > 0.0

    def to_dict(self) -> dict[str, object]:
        """Return its JSON object."""
        return {
            "horizon_s": list(self.horizon_s),
            "mean_mps": list(self.mean_mps),
            "sigma_mps": list(self.sigma_mps),
            "correlation_s": self.correlation_s,
            "known": self.is_known,
        }

    def mean_at(self, t_s: ArrayLike) -> NDArray[np.float64]:
        """Return what is expected at times [m/s]."""
        return np.interp(np.asarray(t_s, dtype=np.float64), self.horizon_s, self.mean_mps)

    def sigma_at(self, t_s: ArrayLike) -> NDArray[np.float64]:
        """Return the spread at times [m/s]."""
        return np.interp(np.asarray(t_s, dtype=np.float64), self.horizon_s, self.sigma_mps)

    def over(self, tws_mps: float, until_s: float) -> float:
        """Return the probability of more wind than ``tws_mps`` at the worst instant until then."""
        return self._worst(tws_mps, until_s, sign=1.0)

    def under(self, tws_mps: float, until_s: float) -> float:
        """Return the same of less wind."""
        return self._worst(tws_mps, until_s, sign=-1.0)

    def _worst(self, tws_mps: float, until_s: float, *, sign: float) -> float:
        times = [t for t in self.horizon_s if t < until_s] + [max(until_s, 0.0)]
        worst = 0.0
        for mean, sigma in zip(self.mean_at(times).tolist(), self.sigma_at(times).tolist(), strict=True):
            past = sign * (mean - tws_mps)
            worst = max(worst, 0.5 * math.erfc(-past / (sigma * math.sqrt(2.0))) if sigma > 0.0 else float(past > 0.0))
        return worst


def assumed(tws_mps: float) -> Strength:
    """Return the strength of a wind of which nothing but the mean is known."""
    return Strength(horizon_s=(0.0,), mean_mps=(tws_mps,), sigma_mps=(ASSUMED_SHARE * tws_mps,), is_known=False)


@dataclass(frozen=True, slots=True, kw_only=True)
class Speeds:
    """A boat's speed in every wind: a table, linear between its nodes, and above its last wind as there.

    Attributes:
        tws_mps: (m,) strictly increasing.
        twa_rad: (n,) increasing.
        v_mps: m rows of n speeds.

    Below the first wind nothing was measured. It is taken to be slower there than in proportion to the wind: by its
    square.
    """

    tws_mps: tuple[float, ...]
    twa_rad: tuple[float, ...]
    v_mps: tuple[tuple[float, ...], ...]

    @property
    def is_sound(self) -> bool:
        """Whether every number is one, and none is negative."""
        return all(math.isfinite(x) and x >= 0.0 for row in (self.tws_mps, self.twa_rad, *self.v_mps) for x in row)

    @property
    def lowest_mps(self) -> float:
        """The least wind that it has."""
        return self.tws_mps[0]

    def at(self, twa_rad: ArrayLike, tws_mps: ArrayLike) -> NDArray[np.float64]:
        """Return the speeds [m/s] at angles to the wind (either sign) in winds; shapes are broadcast."""
        off, wind = np.broadcast_arrays(np.abs(np.asarray(twa_rad, dtype=np.float64)), np.asarray(tws_mps, np.float64))
        winds, angles, table = np.asarray(self.tws_mps), np.asarray(self.twa_rad), np.asarray(self.v_mps)
        i, f = _place(winds, wind)
        j, g = _place(angles, off)
        i1, j1 = np.minimum(i + 1, len(winds) - 1), np.minimum(j + 1, len(angles) - 1)
        low = table[i, j] + g * (table[i, j1] - table[i, j])
        high = table[i1, j] + g * (table[i1, j1] - table[i1, j])
        speed = low + f * (high - low)
        if self.lowest_mps > 0.0:
            speed = speed * np.minimum(1.0, wind / self.lowest_mps) ** 2
        return np.asarray(speed, dtype=np.float64)


def _place(nodes: NDArray[np.float64], at: NDArray[np.float64]) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Return the node before each place, and the share of the way to the next; flat outside."""
    if len(nodes) == 1:
        return np.zeros(at.shape, dtype=np.int64), np.zeros(at.shape)
    before = np.clip(np.searchsorted(nodes, at, side="right") - 1, 0, len(nodes) - 2)
    share = (at - nodes[before]) / (nodes[before + 1] - nodes[before])
    return before, np.clip(share, 0.0, 1.0)
