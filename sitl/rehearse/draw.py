"""What a seed of a rehearsal is: its wind, a boat, a sea and sensors that are not the plan's, trouble on request.

Boat, sea and sensors are drawn as ``sitl mismatch`` draws them, and then made smaller where the mission knows more than
nothing: a polar of the boat's own was measured, leeway and current that are given are about right. Trouble is that of
``sitl faults``, but for what is only that campaign's water.
"""

from __future__ import annotations

import math
import random
from dataclasses import dataclass

import msgspec

from companion.compose import water_of
from companion.geofence import Mission
from sitl.campaigns.fault_draw import befallen, drawn_lots
from sitl.campaigns.mismatch.draw import departing
from sitl.rehearse.wind import Given
from sitl.scene import CurrentSpec, HullSpec, LeeSpec, Scenario, SensorsSpec, WavesSpec

OF_ONES_OWN = 0.5      # the error of a polar that was made for this boat, as a share of another's
LEEWAY_SPREAD = 0.3    # of a leeway that the mission gives, as a share of it
# Where a stranger sends the boat is clear water only where `sitl faults` sails.
ELSEWHERE = frozenset({"foreign_mission"})


@dataclass(frozen=True, slots=True, kw_only=True)
class Doubts:
    """What is not taken for granted.

    Attributes:
        wind: what is known of it.
        boat: how far boat, sea and sensors may be others, 1: as ``sitl mismatch`` draws them; 0: as the plan has them.
        faults: whether trouble befalls her.
        voyage_s: about how long a voyage takes; what befalls her begins by then.
    """

    wind: Given
    boat: float
    faults: bool
    voyage_s: float


def drawn(seed: int, base: Scenario, mission: Mission, doubts: Doubts) -> tuple[Scenario, tuple[str, ...]]:
    """Return the scenario of a seed, and what in it is not the plan's, by name."""
    scenario = msgspec.structs.replace(
        base, wind=doubts.wind.drawn(random.Random(f"rehearsed wind {seed}"), doubts.voyage_s))
    rng = random.Random(f"rehearsed boat {seed}")
    other, kinds = departing(rng, scenario, mission)
    scenario = _nearer(other, mission, doubts.boat) if doubts.boat > 0.0 else scenario
    scenario = _as_given(random.Random(f"rehearsed givens {seed}"), scenario, mission, doubts.boat)
    if doubts.faults:
        rng = random.Random(f"rehearsed faults {seed}")
        lots = [lot for lot in drawn_lots(rng, doubts.voyage_s)
                if not ELSEWHERE & {event.kind for event in lot.events}]
        scenario = befallen(scenario, lots)
        scenario = msgspec.structs.replace(scenario, is_service=True)
    return scenario, kinds if doubts.boat > 0.0 else ()


def _nearer(scenario: Scenario, mission: Mission, share: float) -> Scenario:
    """Return a scenario whose boat, sea and sensors are nearer to the plan's, or farther from it."""
    polar = share * (OF_ONES_OWN if mission.polar_path is not None else 1.0)
    wind = scenario.wind
    wind = msgspec.structs.replace(
        wind, gust_spread=min(1.0, share * wind.gust_spread), stronger_per_km=share * wind.stronger_per_km,
        bends_deg_per_km=share * wind.bends_deg_per_km, lees=tuple(_lee(lee, share) for lee in wind.lees))
    return msgspec.structs.replace(
        scenario, wind=wind,
        current=None if scenario.current is None else _stream(scenario.current, share),
        waves=None if scenario.waves is None else _sea(scenario.waves, share),
        boat=None if scenario.boat is None else _hull(scenario.boat, share, polar),
        sensors=None if scenario.sensors is None else _sensors(scenario.sensors, share))


def _lee(lee: LeeSpec, share: float) -> LeeSpec:
    return msgspec.structs.replace(lee, loss=min(1.0, share * lee.loss))


def _stream(spec: CurrentSpec, share: float) -> CurrentSpec:
    return msgspec.structs.replace(spec, drift_mps=share * spec.drift_mps, tide_mps=share * spec.tide_mps)


def _sea(spec: WavesSpec, share: float) -> WavesSpec:
    return msgspec.structs.replace(spec, loss=min(1.0, share * spec.loss), yaw_deg=share * spec.yaw_deg)


def _hull(spec: HullSpec, share: float, polar: float) -> HullSpec:
    def factor(value: float) -> float:
        return min(max(1.0 + polar * (value - 1.0), 0.2), 2.0)

    return msgspec.structs.replace(
        spec, beat=factor(spec.beat), reach=factor(spec.reach), run=factor(spec.run),
        leeway_deg=share * spec.leeway_deg, tack_fails=min(1.0, share * spec.tack_fails))


def _sensors(spec: SensorsSpec, share: float) -> SensorsSpec:
    return msgspec.structs.replace(
        spec, vane_deg=share * spec.vane_deg, compass_deg=share * spec.compass_deg,
        deviation_deg=share * spec.deviation_deg, gps_noise_m=share * spec.gps_noise_m,
        gps_lag_s=share * spec.gps_lag_s)


def _as_given(rng: random.Random, scenario: Scenario, mission: Mission, share: float) -> Scenario:
    """Return a scenario with the leeway and the current that the mission gives, each off by its own doubt."""
    if mission.boat.leeway_deg > 0.0:
        leeway_deg = mission.boat.leeway_deg * max(0.0, 1.0 + share * rng.gauss(0.0, LEEWAY_SPREAD))
        scenario = msgspec.structs.replace(scenario, boat=msgspec.structs.replace(
            scenario.boat or HullSpec(), leeway_deg=round(min(leeway_deg, 30.0), 3)))
    if mission.current is not None:
        expected = water_of(mission).at(scenario.epoch_s)
        east = expected.east_mps + share * rng.gauss(0.0, expected.sigma_mps)
        north = expected.north_mps + share * rng.gauss(0.0, expected.sigma_mps)
        scenario = msgspec.structs.replace(scenario, current=CurrentSpec(
            set_deg=round(math.degrees(math.atan2(east, north)) % 360.0, 2),
            drift_mps=round(math.hypot(east, north), 3)))
    return scenario
