"""The weather of a scenario: its wind and wind events as one seeded function of time, its waters and departures."""

from __future__ import annotations

import math
from pathlib import Path

from sitl.autopilot import Departures
from sitl.scene.mismatch import CurrentSpec, departures_of, lee_of, stream_of
from sitl.scene.scenario import Scenario
from sitl.world import AR1, Constant, Event, Gusty, Later, Recorded, Scripted, Waters, Wind


def scenario_wind(scenario: Scenario, source: Path, seed: int) -> Wind:
    """Return the wind of ``scenario``, read from ``source``, for ``seed``."""
    spec = scenario.wind
    base: Wind
    if spec.model == "recorded":
        base = Recorded.from_csv(source.parent / (spec.file or ""))
    elif spec.model == "constant":
        base = Constant(math.radians(spec.from_deg), spec.tws_mps)
    else:
        base = AR1(
            math.radians(spec.from_deg), spec.tws_mps, seed=seed, sd_rad=math.radians(spec.sd_deg),
            rho_hz=1.0 / spec.tau_s, tws_sd_mps=spec.tws_sd_mps,
        )
    if spec.gust_spread > 0.0:
        base = Gusty(base, spread=spec.gust_spread, tau_s=spec.gust_s, seed=seed)
    if spec.from_s != 0.0:
        base = Later(base, spec.from_s)
    events = tuple(
        Event(
            at_s=e.at_s, veer_rad=math.radians(e.veer_deg), tws_mps=e.tws_mps, over_s=e.over_s,
            for_s=math.inf if e.for_s is None else e.for_s,
        )
        for e in scenario.events
        if e.kind in {"wind_shift", "wind_speed"}
    )
    return Scripted(base, events) if events else base


def scenario_waters(scenario: Scenario, wind: Wind, home_en_m: tuple[float, float]) -> Waters | None:
    """Return wind and stream by place, counted from ``home_en_m`` of the mission's frame; None: the same everywhere."""
    spec = scenario.wind
    if scenario.current is None and not spec.lees and spec.stronger_per_km == 0.0 and spec.bends_deg_per_km == 0.0:
        return None
    return Waters(
        wind=wind, lees=tuple(lee_of(lee) for lee in spec.lees), stronger_per_km=spec.stronger_per_km,
        stronger_to_rad=math.radians(spec.stronger_to_deg), bends_rad_per_km=math.radians(spec.bends_deg_per_km),
        stream=stream_of(scenario.current or CurrentSpec()), home_en_m=home_en_m)


def scenario_departures(scenario: Scenario) -> Departures | None:
    """Return what the boat of a scenario is that is not the plan's; None: nothing."""
    return departures_of(scenario.boat, scenario.waves, scenario.sensors, scenario.wind.from_deg)
