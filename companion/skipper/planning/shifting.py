"""The shifts on a leg that the autopilot beats: the table for it, from the forecast, and whether it is worth it."""

from __future__ import annotations

import math
from dataclasses import dataclass

from companion.geo.angles import difference_rad
from companion.skipper.step.turn import Turn
from companion.skipper.way.shifts import ShiftTable, shift_table

WORTH = 0.01                       # of the speed made good: for less the autopilot tacks as it does
NARROWEST_M = 20.0                 # in a narrower corridor she meets the edge before a shift
LEG_RAD = math.radians(25.0)       # a leg farther off the mean wind is sailed on one tack for the most part
LONG_S, SHORT_S = 300.0, 30.0      # horizons by which a forecast's spread and correlation time are read
TAU_S = (15.0, 600.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class Shifting:
    """A beat's table, and the mean wind that its shifts are counted from."""

    table: ShiftTable
    mean_rad: float

    @property
    def tack_s(self) -> float:
        """What a tack at the edges alone would cost where she makes as much good; 0 at the least [s]."""
        return max(0.0, self.table.crossing_s * (self.table.straight_mps / self.table.made_good_mps - 1.0))


def shifting(turn: Turn, leg_rad: float | None = None) -> Shifting | None:
    """Return the table of a leg with this bearing, None where it gains too little, or is not for this corridor or leg.

    Without a bearing: of one straight into the mean wind.
    """
    forecast, wind = turn.snapshot.wind.forecast, turn.wind_mean
    corridor_m = turn.tack_corridor_m
    if not turn.config.shifts or forecast is None or wind is None or corridor_m < NARROWEST_M:
        return None
    far = max(0, int(forecast.horizon_s.searchsorted(LONG_S, side="right")) - 1)
    near = max(0, int(forecast.horizon_s.searchsorted(SHORT_S, side="right")) - 1)
    spread, soon = float(forecast.sigma_twd_rad[far]), float(forecast.sigma_twd_rad[near])
    mean_rad = float(forecast.mean_twd_from_rad[far])
    off_rad = 0.0 if leg_rad is None else difference_rad(leg_rad, mean_rad)
    if spread <= 0.0 or abs(off_rad) > LEG_RAD:
        return None
    # an Ornstein-Uhlenbeck process' variance grows as 1 - exp(-2 t / tau)
    grown = min((soon / spread) ** 2, 0.99)
    tau_s = -2.0 * float(forecast.horizon_s[near]) / math.log(1.0 - grown) if grown > 0.0 else TAU_S[1]
    boat, half_rad = turn.voyage.boat, turn.no_go_half_rad
    table = shift_table(   # round figures: it is made anew when something has changed that matters
        corridor_m=round(corridor_m, 1), spread_rad=math.radians(2.0 * max(1, round(math.degrees(spread) / 2.0))),
        tau_s=TAU_S[0] * 1.5 ** round(math.log(min(max(tau_s, TAU_S[0]), TAU_S[1]) / TAU_S[0], 1.5)),
        speed_mps=round(max(0.2, boat.polar.speed_mps(half_rad, wind[1])), 1), half_rad=half_rad,
        leg_rad=math.radians(5.0 * round(math.degrees(off_rad) / 5.0)),
        tack_s=2.0 * half_rad / boat.turn_rate_radps + boat.tack_loss_s)
    return Shifting(table=table, mean_rad=mean_rad) if table.made_good_mps > (1.0 + WORTH) * table.plainly_mps else None
