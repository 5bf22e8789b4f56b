"""What the wind's shifts are worth on a beat: the table of a leg, from the forecast, the corridor and the boat."""

from __future__ import annotations

import math
from dataclasses import dataclass

from companion.geo.angles import difference_rad
from companion.messages import WindForecast
from companion.skipper.step.turn import Turn
from companion.skipper.way.shifts import ShiftTable, shift_table

WORTH = 0.01                   # tacked on where it gains at least this share of the speed made good
NARROWEST_M = 20.0             # in a narrower corridor she meets the edge before a shift
LEG_RAD = math.radians(25.0)   # a leg farther off the mean wind is sailed on one tack for the most part
SOON_S, LONG_S = 30.0, 300.0   # horizons: mean and spread are read by the longer, how fast it shifts by both
TAU_S = (15.0, 600.0)
NARROWING = 0.8                # from table to table, as the laylines close in on the leg's end
GROWN = 0.1, 0.995             # of the spread after the shorter of the later one, at the least and at the most


@dataclass(frozen=True, slots=True, kw_only=True)
class Shifting:
    """A beat's table, and the mean wind that its shifts are counted from."""

    table: ShiftTable
    mean_rad: float

    @property
    def tack_s(self) -> float:
        """What a tack at the edges alone would cost where she makes as much good; 0 at the least [s]."""
        return max(0.0, self.table.crossing_s * (self.table.straight_mps / self.table.made_good_mps - 1.0))


def shifting(turn: Turn, leg_rad: float | None = None, ahead_m: float = math.inf) -> Shifting | None:
    """Return what the shifts are worth on a leg with this bearing; without one, on a leg into the mean wind.

    ``ahead_m`` of it are left.

    None where the mission does not ask for it, or as ``shifts_of``.
    """
    forecast, wind, boat = turn.snapshot.wind.forecast, turn.wind_mean, turn.voyage.boat
    if not turn.config.shifts or forecast is None or wind is None:
        return None
    half_rad = turn.no_go_half_rad
    return shifts_of(
        forecast, corridor_m=turn.tack_corridor_m, speed_mps=boat.polar.speed_mps(half_rad, wind[1]),
        half_rad=half_rad, tack_s=2.0 * half_rad / boat.turn_rate_radps + boat.tack_loss_s, leg_rad=leg_rad,
        ahead_m=ahead_m)


def shifts_of(
    forecast: WindForecast, *, corridor_m: float, speed_mps: float, half_rad: float, tack_s: float,
    leg_rad: float | None = None, ahead_m: float = math.inf,
) -> Shifting | None:
    """Return what a forecast's shifts are worth; None where it is too little, or not for this corridor or leg.

    ``speed_mps`` is hers close-hauled at ``half_rad``, ``tack_s`` what a tack costs, ``ahead_m`` what is left of the
    leg: to go wider than the laylines through its end is to sail too far, so they narrow the corridor.
    """
    while NARROWEST_M <= corridor_m > ahead_m * math.tan(half_rad):
        corridor_m *= NARROWING
    far = _by(forecast, LONG_S)
    spread_rad, mean_rad = float(forecast.sigma_twd_rad[far]), float(forecast.mean_twd_from_rad[far])
    off_rad = 0.0 if leg_rad is None else difference_rad(leg_rad, mean_rad)
    if corridor_m < NARROWEST_M or spread_rad <= 0.0 or abs(off_rad) > LEG_RAD:
        return None
    table = shift_table(   # round figures: it is made anew when something has changed that matters
        corridor_m=round(corridor_m, 1), spread_rad=math.radians(2.0 * max(1, round(math.degrees(spread_rad) / 2.0))),
        tau_s=TAU_S[0] * 1.5 ** round(math.log(shift_time_s(forecast) / TAU_S[0], 1.5)),
        speed_mps=round(max(0.2, speed_mps), 1), half_rad=half_rad,
        leg_rad=math.radians(5.0 * round(math.degrees(off_rad) / 5.0)), tack_s=tack_s)
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
