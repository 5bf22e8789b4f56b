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
LONG_S = 300.0                 # the horizon by which the forecast's mean and spread are read
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
    """Return what the shifts are worth on a leg with this bearing; without one, on a leg into the mean wind.

    None where the mission does not ask for it, or as ``shifts_of``.
    """
    forecast, wind, boat = turn.snapshot.wind.forecast, turn.wind_mean, turn.voyage.boat
    if not turn.config.shifts or forecast is None or wind is None:
        return None
    half_rad = turn.no_go_half_rad
    return shifts_of(
        forecast, corridor_m=turn.tack_corridor_m, speed_mps=boat.polar.speed_mps(half_rad, wind[1]),
        half_rad=half_rad, tack_s=2.0 * half_rad / boat.turn_rate_radps + boat.tack_loss_s, leg_rad=leg_rad)


def shifts_of(
    forecast: WindForecast, *, corridor_m: float, speed_mps: float, half_rad: float, tack_s: float,
    leg_rad: float | None = None,
) -> Shifting | None:
    """Return what a forecast's shifts are worth; None where it is too little, or not for this corridor or leg.

    ``speed_mps`` is hers close-hauled at ``half_rad``, ``tack_s`` what a tack costs.
    """
    far = max(0, int(forecast.horizon_s.searchsorted(LONG_S, side="right")) - 1)
    spread_rad, mean_rad = float(forecast.sigma_twd_rad[far]), float(forecast.mean_twd_from_rad[far])
    off_rad = 0.0 if leg_rad is None else difference_rad(leg_rad, mean_rad)
    if corridor_m < NARROWEST_M or spread_rad <= 0.0 or abs(off_rad) > LEG_RAD:
        return None
    tau_s = min(max(forecast.correlation_time_s, TAU_S[0]), TAU_S[1])
    table = shift_table(   # round figures: it is made anew when something has changed that matters
        corridor_m=round(corridor_m, 1), spread_rad=math.radians(2.0 * max(1, round(math.degrees(spread_rad) / 2.0))),
        tau_s=TAU_S[0] * 1.5 ** round(math.log(tau_s / TAU_S[0], 1.5)), speed_mps=round(max(0.2, speed_mps), 1),
        half_rad=half_rad, leg_rad=math.radians(5.0 * round(math.degrees(off_rad) / 5.0)), tack_s=tack_s)
    return Shifting(table=table, mean_rad=mean_rad) if table.made_good_mps > (1.0 + WORTH) * table.plainly_mps else None
