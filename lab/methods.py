"""By what a campaign sails: another guidance, another planner, a wind that is believed certain or known beforehand."""

from __future__ import annotations

import math
import random
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from companion.errors import InputError
from companion.geofence import Mission
from companion.messages import WindForecast
from companion.mission_check import require_sailable
from companion.planners import ALGORITHMS
from companion.wind import Estimator, WindTracker
from sitl.run.variation import Variation
from sitl.world import WindModel

MEAN_S = 30.0  # [s] over which what will blow is averaged: a plan is of legs, not of puffs
_MEAN_STEP_S = 2.0
AHEAD_S = 300.0
NO_SPREAD_RAD = 1e-4


class Unspread(WindTracker):
    """The wind room whose forecasts are believed to be certain: what a planner without wind uncertainty is told."""

    def forecast_table(
        self, t_s: float, horizons_s: Sequence[float] | None = None, levels: Sequence[float] | None = None
    ) -> WindForecast | None:
        """Return the forecast's mean over ``AHEAD_S``, for every horizon, without any spread."""
        table = super().forecast_table(t_s, horizons_s, levels)
        if table is None:
            return None
        # A mean that moves with the horizon would be a spread again: the skipper adds what its one mean leaves out.
        near = table.mean_twd_from_rad[table.horizon_s <= AHEAD_S]
        mean = math.atan2(float(np.sin(near).mean()), float(np.cos(near).mean()))
        return _certain(replace(table, mean_twd_from_rad=np.full_like(table.mean_twd_from_rad, mean)))


class Foreknown(WindTracker):
    """The wind room that knows what will blow: the mean of the ``MEAN_S`` from each horizon on, and no spread.

    A plan is still made for one mean direction, and what the wind will depart from it is added to the zone.
    ``wind`` is counted from the zero of the clock that its readings are stamped with.
    """

    def __init__(self, wind: WindModel, estimator: Estimator) -> None:
        super().__init__(estimator=estimator)
        self._wind = wind

    def forecast_table(
        self, t_s: float, horizons_s: Sequence[float] | None = None, levels: Sequence[float] | None = None
    ) -> WindForecast | None:
        """Return what will blow."""
        table = super().forecast_table(t_s, horizons_s, levels)
        if table is None:
            return None
        means = np.array([self._mean(t_s + float(h)) for h in table.horizon_s])
        return _certain(replace(table, mean_twd_from_rad=means[:, 0], mean_tws_mps=means[:, 1]))

    def _mean(self, t_s: float) -> tuple[float, float]:
        blown = [self._wind.at(max(0.0, t)) for t in np.arange(t_s, t_s + MEAN_S, _MEAN_STEP_S).tolist()]
        east = sum(math.sin(twd) for twd, _ in blown)
        north = sum(math.cos(twd) for twd, _ in blown)
        return math.atan2(east, north), sum(tws for _, tws in blown) / len(blown)


def _certain(table: WindForecast) -> WindForecast:
    return replace(
        table,
        sigma_twd_rad=np.full_like(table.sigma_twd_rad, NO_SPREAD_RAD),
        sigma_tws_mps=np.full_like(table.sigma_tws_mps, NO_SPREAD_RAD),
        half_width_rad=np.zeros_like(table.half_width_rad),
    )


def unspread(_: WindModel, estimator: Estimator) -> WindTracker:
    """Return the room without spread."""
    return Unspread(estimator=estimator)


def foreknown(wind: WindModel, estimator: Estimator) -> WindTracker:
    """Return the room that knows what will blow."""
    return Foreknown(wind, estimator)


# ------------------------------------------------------------------------------------- guidance and planner
GUIDANCES = ("plan", "heading", "field")  # [skipper] guidance
PLANNERS = tuple(ALGORITHMS)  # [skipper] planner
DRAWABLE = ("guidance", "planner", "station")
STATION_SHARE = 0.5  # of the voyages
STATION_S = (20.0, 90.0)  # how long a station that is drawn is kept at the last goal


@dataclass(frozen=True, slots=True, kw_only=True)
class Method:
    """By which guidance and planner a mission is sailed, and how long she stays at its end; None: as it says itself."""

    guidance: str | None = None
    planner: str | None = None
    station_s: float | None = None

    @property
    def description(self) -> str:
        """The method in words, empty where the mission's own is sailed."""
        guidance = "" if self.guidance is None else "in AUTO" if self.guidance == "plan" else f"by {self.guidance}"
        planner = f"planner {self.planner}" if self.planner else ""
        station = f"{self.station_s:.0f} s on a station" if self.station_s else ""
        return ", ".join(part for part in (guidance, planner, station) if part)

    def variation(self, mission: Mission, also: Variation | None = None) -> Variation | None:
        """Return ``also`` with this method; None where nothing is another. GUIDED is permitted where it is needed.

        The numbers of ``[planner]`` are those of the mission's own planner: another one is sailed with its defaults.
        """
        tables = {name: dict(keys) for name, keys in (also.tables if also is not None else {}).items()}
        if self.guidance is not None:
            tables.setdefault("skipper", {})["guidance"] = self.guidance
        if self.guidance in {"heading", "field"}:
            tables.setdefault("operator", {}).update(guided=True)
        if self.planner is not None:
            tables.setdefault("skipper", {})["planner"] = self.planner
            if self.planner != mission.skipper.planner:
                tables["planner"] = dict.fromkeys(mission.options.planner.__struct_fields__)
        if self.station_s is not None:
            tables.setdefault("skipper", {})["station_s"] = self.station_s
        return Variation(tables=tables, room=also.room if also is not None else None) if tables else also


AS_IT_SAYS = Method()


def drawn_method(rng: random.Random, what: Sequence[str], mission: Mission) -> Method:
    """Return a method for a mission: ``what`` of ``DRAWABLE`` is drawn, of those that it can be sailed by."""
    guidance = rng.choice([g for g in GUIDANCES if not why_not(mission, g)]) if "guidance" in what else None
    planner = rng.choice(PLANNERS) if "planner" in what else None
    is_kept = "station" in what and rng.random() < STATION_SHARE
    return Method(guidance=guidance, planner=planner, station_s=round(rng.uniform(*STATION_S), 1) if is_kept else None)


def why_not(mission: Mission, guidance: str) -> str:
    """Return why a mission cannot be sailed by a guidance, empty where it can: gates are not for each of them."""
    variation = Method(guidance=guidance).variation(mission)
    try:
        if variation is not None:
            require_sailable(variation.mission(mission))
    except InputError as error:
        return str(error)
    return ""
