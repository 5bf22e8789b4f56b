"""What the wind's shifts are worth on a beat: the table of a leg, from the forecast, the corridor and the boat."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from companion.geo.angles import difference_rad
from companion.messages import WindForecast
from companion.skipper.step.context import StepContext

WORTH = 0.01  # tacked on where it gains at least this share of the speed made good
NARROWEST_M = 20.0  # in a narrower corridor the boat meets the edge before a shift
LEG_RAD = math.radians(25.0)  # a leg farther off the mean wind is sailed on one tack for the most part
SOON_S, LONG_S = 30.0, 300.0  # horizons: mean and spread are read by the longer, how fast it shifts by both
TAU_S = (15.0, 600.0)
NARROWING = 0.8  # from table to table, as the laylines close in on the leg's end
GROWN = 0.1, 0.995  # of the spread after the shorter of the later one, at the least and at the most
Floats = NDArray[np.float64]

STEP_S = 2.0
PLACES, SHIFTS = 21, 13
SPREADS = 3.0  # the shifts that are looked at reach so many spreads to either side ...
WITHIN_RAD = math.radians(5.0)  # ... and no farther than this within the angle that the boat sails: both tacks lead up
MOST_ROUNDS = 250
NEAR_M = 0.01  # of what steps gain: then the values are settled
OUTSIDE_M = 1e3  # what going on out of the corridor costs: nobody does


@dataclass(frozen=True, slots=True, kw_only=True)
class Shifting:
    """A beat's table, and the mean wind that its shifts are counted from."""

    table: ShiftTable
    mean_rad: float

    @property
    def tack_s(self) -> float:
        """What a tack at the edges alone would cost where the boat makes as much good; 0 at the least [s]."""
        return max(0.0, self.table.crossing_s * (self.table.straight_mps / self.table.made_good_mps - 1.0))


def shifting(ctx: StepContext, leg_rad: float | None = None, ahead_m: float = math.inf) -> Shifting | None:
    """Return what the shifts are worth on a leg with this bearing; without one, on a leg into the mean wind.

    ``ahead_m`` of it are left.

    None where the mission does not ask for it, or as ``shifts_of``.
    """
    forecast, wind, boat = ctx.snapshot.wind.forecast, ctx.wind_mean, ctx.voyage.boat
    if not ctx.config.shifts or forecast is None or wind is None:
        return None
    half_rad = ctx.no_go_half_rad
    return shifts_of(
        forecast,
        corridor_m=ctx.tack_corridor_m,
        speed_mps=boat.polar.speed_mps(half_rad, wind[1]),
        half_rad=half_rad,
        tack_s=2.0 * half_rad / boat.turn_rate_radps + boat.tack_loss_s,
        leg_rad=leg_rad,
        ahead_m=ahead_m,
    )


def shifts_of(
    forecast: WindForecast,
    *,
    corridor_m: float,
    speed_mps: float,
    half_rad: float,
    tack_s: float,
    leg_rad: float | None = None,
    ahead_m: float = math.inf,
) -> Shifting | None:
    """Return what a forecast's shifts are worth; None where it is too little, or not for this corridor or leg.

    ``speed_mps`` is its own close-hauled at ``half_rad``, ``tack_s`` what a tack costs, ``ahead_m`` what is left of the
    leg: to go wider than the laylines through its end is to sail too far, so they narrow the corridor.
    """
    while NARROWEST_M <= corridor_m > ahead_m * math.tan(half_rad):
        corridor_m *= NARROWING
    far = _by(forecast, LONG_S)
    spread_rad, mean_rad = float(forecast.sigma_twd_rad[far]), float(forecast.mean_twd_from_rad[far])
    off_rad = 0.0 if leg_rad is None else difference_rad(leg_rad, mean_rad)
    if corridor_m < NARROWEST_M or spread_rad <= 0.0 or abs(off_rad) > LEG_RAD:
        return None
    table = shift_table(  # round figures: it is made anew when something has changed that matters
        corridor_m=round(corridor_m, 1),
        spread_rad=math.radians(2.0 * max(1, round(math.degrees(spread_rad) / 2.0))),
        tau_s=TAU_S[0] * 1.5 ** round(math.log(shift_time_s(forecast) / TAU_S[0], 1.5)),
        speed_mps=round(max(0.2, speed_mps), 1),
        half_rad=half_rad,
        leg_rad=math.radians(5.0 * round(math.degrees(off_rad) / 5.0)),
        tack_s=tack_s,
    )
    return Shifting(table=table, mean_rad=mean_rad) if table.made_good_mps > (1.0 + WORTH) * table.plainly_mps else None


def shift_time_s(forecast: WindForecast) -> float:
    """Return how long a shift lasts [s]: the correlation time with which a mean-reverting spread grows as forecast.

    The forecast's own ``correlation_time_s`` needs hours of wind: in the first minutes of one of 28 s it says 270.
    """
    near, far = _by(forecast, SOON_S), _by(forecast, LONG_S)
    grown = float(forecast.sigma_twd_rad[near] / forecast.sigma_twd_rad[far])
    known = min(max(grown, GROWN[0]), GROWN[1]) ** 2
    return min(max(-2.0 * float(forecast.horizon_s[near]) / math.log1p(-known), TAU_S[0]), TAU_S[1])


def _by(forecast: WindForecast, horizon_s: float) -> int:
    return max(0, int(forecast.horizon_s.searchsorted(horizon_s, side="right")) - 1)


# --------------------
# Tacking on the shifts: what a tack now is worth on a beat in a corridor, from how far and how fast the wind shifts.
# The wind is taken to wander about its mean as an Ornstein-Uhlenbeck process of the forecast's spread and correlation
# time; it sails close-hauled, and must tack at the corridor's edge. What is made good along the leg in the long run
# is then a function of three things that it sees: its place in the corridor, the shift, and its tack. Its best
# policy is a dynamic programme over these (undiscounted, relative values): tack, or stand on. How many tacks there
# are, and that a tack near the edge comes too late for the next shift, comes out of it.
#
# References:     Puterman, Markov Decision Processes, 1994, section 8.5 (relative value iteration). That a good
# helmsman tacks on     the headers, as a switching problem: Miles and Vladimirsky, arXiv 2109.08260, 2021.


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ShiftTable:
    """The values of a corridor's beat.

    Attributes:
        corridor_m: to either side of the leg.
        reach_rad: the shifts of the table go so far to either side.
        worth_s: (2, places, shifts) what a tack now gains in time [s], the tack itself counted, on port tack and on
            starboard, by places from left to right of the leg and shifts from backed to veered.
        made_good_mps: along the leg, in the long run.
        straight_mps: the same in a steady wind, if tacks cost nothing.
        crossing_s: from edge to edge.
        tack_s: what a tack costs [s].
    """

    corridor_m: float
    reach_rad: float
    worth_s: Floats
    made_good_mps: float
    straight_mps: float
    crossing_s: float
    tack_s: float

    @property
    def plainly_mps(self) -> float:
        """What is made good where the boat tacks at the corridor's edges alone."""
        return self.straight_mps * self.crossing_s / (self.crossing_s + self.tack_s)

    def gain_s(self, off_m: float, shift_rad: float, *, is_port: bool) -> float:
        """Return what a tack now gains [s]; negative: stand on. ``off_m`` is positive to the right of the leg."""
        place = min(max(off_m / self.corridor_m, -1.0), 1.0) * 0.5 + 0.5
        shift = min(max(shift_rad / self.reach_rad, -1.0), 1.0) * 0.5 + 0.5
        return float(self.worth_s[0 if is_port else 1, round(place * (PLACES - 1)), round(shift * (SHIFTS - 1))])


@lru_cache(maxsize=64)
def shift_table(
    *,
    corridor_m: float,
    spread_rad: float,
    tau_s: float,
    speed_mps: float,
    half_rad: float,
    leg_rad: float,
    tack_s: float,
) -> ShiftTable:
    """Return the table for a leg that is ``leg_rad`` to the right of the mean wind [rad].

    ``speed_mps`` is what the boat makes close-hauled, ``half_rad`` off the wind. It takes 10 ms: ask with round
    figures.
    """
    reach_rad = min(SPREADS * spread_rad, half_rad - WITHIN_RAD)
    places, shifts = np.linspace(-corridor_m, corridor_m, PLACES), np.linspace(-reach_rad, reach_rad, SHIFTS)
    stay = _transitions(shifts, spread_rad, math.exp(-STEP_S / tau_s))
    made_good, ahead = np.empty((2, SHIFTS)), np.empty((2, PLACES, SHIFTS))
    low, share = np.empty((2, PLACES, SHIFTS), dtype=np.int64), np.empty((2, PLACES, SHIFTS))
    for tack, side in enumerate((1.0, -1.0)):
        course = shifts + side * half_rad - leg_rad
        made_good[tack] = speed_mps * STEP_S * np.cos(course)
        there = places[:, None] + speed_mps * STEP_S * np.sin(course)
        ahead[tack] = made_good[tack] - np.where((np.abs(there) > corridor_m) & (there * course > 0.0), OUTSIDE_M, 0.0)
        at = np.clip((there + corridor_m) / (2.0 * corridor_m) * (PLACES - 1), 0.0, PLACES - 1)
        low[tack] = np.minimum(at.astype(np.int64), PLACES - 2)
        share[tack] = at - low[tack]
    across = np.arange(SHIFTS)[None, :]
    mean_mps = speed_mps * math.cos(half_rad)
    loss_m = tack_s * mean_mps
    values, stand = np.zeros((2, PLACES, SHIFTS)), np.zeros((2, PLACES, SHIFTS))
    gained_m = 0.0
    for _ in range(MOST_ROUNDS):
        hoped = values @ stay.T
        for tack in range(2):
            mine = hoped[tack]
            stand[tack] = (
                ahead[tack]
                + (1.0 - share[tack]) * mine[low[tack], across]
                + (share[tack] * mine[low[tack] + 1, across])
            )
        best = np.maximum(stand, stand[::-1] - loss_m)
        # half a step at a time: crossings of equal length would swing for ever
        change = best - values
        gained_m = float(change.min())  # no policy's step gains less than the least, the best's no more than the most
        values = values + 0.5 * (change - change[0, PLACES // 2, SHIFTS // 2])
        if float(change.max()) - gained_m < NEAR_M:
            break
    longest_s = 2.0 * corridor_m / (speed_mps * math.sin(half_rad))
    # at the edge the boat must tack: what that gains is no more than a board
    worth_s = np.minimum((stand[::-1] - loss_m - stand) / mean_mps, longest_s)
    return ShiftTable(
        corridor_m=corridor_m,
        reach_rad=reach_rad,
        worth_s=worth_s,
        made_good_mps=gained_m / STEP_S,
        straight_mps=mean_mps * math.cos(leg_rad),
        tack_s=tack_s,
        crossing_s=longest_s,
    )


def _transitions(shifts: Floats, spread_rad: float, kept: float) -> Floats:
    """Return (from, to) the chance of each shift a step later."""
    scatter = spread_rad * math.sqrt(1.0 - kept * kept)
    between = 0.5 * (shifts[1:] + shifts[:-1])
    below = np.array(
        [[0.5 * (1.0 + math.erf((b - kept * s) / (scatter * math.sqrt(2.0)))) for b in between] for s in shifts]
    )
    return np.diff(np.hstack([np.zeros((SHIFTS, 1)), below, np.ones((SHIFTS, 1))]), axis=1)
