"""Draws a boat, a sea and sensors that are not the plan's.

Each kind of mismatch is there in half of the voyages, in whatever strength: from hardly anything to what a small boat
meets on a bad day. None is so strong that no boat could sail in it: where it is, staying ashore is the answer.
"""

from __future__ import annotations

import random
from collections.abc import Callable
from typing import TypeVar

import msgspec

from companion.geofence import Mission
from sitl.scenario import CurrentSpec, HullSpec, LeeSpec, Scenario, SensorsSpec, WavesSpec, WindSpec

Spec = TypeVar("Spec", HullSpec, SensorsSpec)
EVEN = 0.5  # of the voyages that have a kind of mismatch
MOON_S = 44_712.0


def departing(
    rng: random.Random, scenario: Scenario, mission: Mission, *, only: tuple[str, ...] | None = None
) -> tuple[Scenario, tuple[str, ...]]:
    """Return a scenario with what its plan does not know of, each kind in half of them, and the kinds.

    ``only`` are kinds that it has, and no others. What is drawn of boat, sea, sensors takes the place of what the
    scenario has; its wind is kept and departed from.
    """
    kinds: list[str] = []

    def has(kind: str) -> bool:
        is_even = rng.random() < EVEN
        if is_even if only is None else kind in only:
            kinds.append(kind)
            return True
        return False

    wind = scenario.wind
    if has("gusts"):
        wind = msgspec.structs.replace(
            wind, gust_spread=_round(rng.uniform(0.1, 0.35)), gust_s=_round(rng.uniform(8.0, 40.0))
        )
    if has("wind over the water"):
        wind = _varied(rng, wind, mission)
    drawn = msgspec.structs.replace(
        scenario,
        wind=wind,
        current=_current(rng) if has("current") else None,
        waves=_waves(rng) if has("waves") else None,
        boat=_other(_boat(rng, has)),
        sensors=_other(_sensors(rng, has)),
    )
    return drawn, tuple(kinds)


def _other(spec: Spec) -> Spec | None:
    """Return a table, None where nothing in it is another than the plan's."""
    return None if spec == type(spec)() else spec


def _round(value: float) -> float:
    return round(value, 3)


def _varied(rng: random.Random, wind: WindSpec, mission: Mission) -> WindSpec:
    """Return a wind with one or two islands upwind of the water sailed, or beside it, and a gradient."""
    frame = mission.frame()
    ends = [frame.en_from_geo(p) for p in (mission.start or mission.origin, *(g.point for g in mission.goals))]
    lees = []
    for _ in range(rng.choice((0, 1, 1, 2))):
        east, north = [rng.uniform(min(x) - 60.0, max(x) + 60.0) for x in zip(*ends, strict=True)]
        lees.append(
            LeeSpec(
                east_m=_round(east),
                north_m=_round(north),
                radius_m=_round(rng.uniform(20.0, 80.0)),
                loss=_round(rng.uniform(0.2, 0.6)),
                reach_m=_round(rng.uniform(60.0, 300.0)),
            )
        )
    return msgspec.structs.replace(
        wind,
        lees=tuple(lees),
        stronger_per_km=_round(rng.uniform(-0.8, 0.8)),
        stronger_to_deg=_round(rng.uniform(0.0, 360.0)),
        bends_deg_per_km=_round(rng.uniform(-30.0, 30.0)),
    )


def _current(rng: random.Random) -> CurrentSpec:
    """Return a stream of half a metre a second at most, constant or a tide or both."""
    tidal = rng.random() < 0.5
    return CurrentSpec(
        set_deg=_round(rng.uniform(0.0, 360.0)),
        drift_mps=_round(rng.uniform(0.0, 0.25 if tidal else 0.5)),
        tide_set_deg=_round(rng.uniform(0.0, 360.0)),
        tide_mps=_round(rng.uniform(0.05, 0.25)) if tidal else 0.0,
        # in narrow waters streams turn with the eddies, too
        tide_s=_round(rng.uniform(400.0, 3600.0)) if rng.random() < 0.7 else MOON_S,
        tide_turns=_round(rng.uniform(-1.0, 1.0)) if rng.random() < 0.5 else 0.0,
        shear_per_km=_round(rng.uniform(0.0, 2.0)),
        shear_to_deg=_round(rng.uniform(0.0, 360.0)),
    )


def _waves(rng: random.Random) -> WavesSpec:
    return WavesSpec(
        loss=_round(rng.uniform(0.02, 0.3)),
        yaw_deg=_round(rng.uniform(1.0, 8.0)),
        period_s=_round(rng.uniform(2.0, 5.0)),
    )


def _boat(rng: random.Random, has: Callable[[str], bool]) -> HullSpec:
    """Return a hull: a polar that errs by 20 % at most, leeway, tacks that fail."""
    boat = HullSpec()
    if has("polar"):
        all_ = rng.uniform(0.85, 1.15)
        beat, reach, run = (_round(min(max(all_ * rng.uniform(0.9, 1.1), 0.8), 1.2)) for _ in range(3))
        boat = msgspec.structs.replace(boat, beat=beat, reach=reach, run=run)
    if has("leeway"):
        boat = msgspec.structs.replace(boat, leeway_deg=_round(rng.uniform(1.0, 8.0)))
    if has("tacks fail"):
        boat = msgspec.structs.replace(
            boat, tack_fails=_round(rng.uniform(0.03, 0.4)), irons_s=_round(rng.uniform(3.0, 15.0))
        )
    return boat


def _sensors(rng: random.Random, has: Callable[[str], bool]) -> SensorsSpec:
    """Return sensors: a vane of 10 degrees, a compass of 5 and as much again by heading, a position of 2 m and 1 s."""
    sensors = SensorsSpec()
    if has("vane"):
        sensors = msgspec.structs.replace(sensors, vane_deg=_round(rng.uniform(-10.0, 10.0)))
    if has("compass"):
        sensors = msgspec.structs.replace(
            sensors,
            compass_deg=_round(rng.uniform(-5.0, 5.0)),
            deviation_deg=_round(rng.uniform(0.0, 5.0)),
            deviation_at_deg=_round(rng.uniform(0.0, 360.0)),
        )
    if has("position"):
        sensors = msgspec.structs.replace(
            sensors,
            gps_noise_m=_round(rng.uniform(0.2, 2.0)),
            gps_noise_s=_round(rng.uniform(5.0, 60.0)),
            gps_lag_s=_round(rng.uniform(0.0, 1.0)),
        )
    return sensors
