"""The wind of a scenario: its weather and its wind events as one seeded function of time."""

from __future__ import annotations

import math
from pathlib import Path

from sitl.scene.scenario import Scenario
from sitl.world import AR1, Constant, Event, Recorded, Scripted, Wind


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
    events = tuple(
        Event(
            at_s=e.at_s, veer_rad=math.radians(e.veer_deg), tws_mps=e.tws_mps, over_s=e.over_s,
            for_s=math.inf if e.for_s is None else e.for_s,
        )
        for e in scenario.events
        if e.kind in {"wind_shift", "wind_speed"}
    )
    return Scripted(base, events) if events else base
