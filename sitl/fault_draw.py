"""Draws the weather and the faults of a voyage from a seed."""

from __future__ import annotations

import math
import random

import msgspec

from sitl.scenario import EventSpec, ExpectSpec, Scenario, WindSpec


def draw(seed: int, base: Scenario) -> Scenario:
    """Return ``base`` with the weather and the faults of ``seed``."""
    rng = random.Random(f"faults {seed}")
    wind = WindSpec(
        model="ou", from_deg=round(rng.uniform(0.0, 360.0), 1), tws_mps=round(rng.uniform(3.5, 7.0), 2),
        sd_deg=round(rng.uniform(3.0, 10.0), 1), tau_s=28.0, tws_sd_mps=round(rng.uniform(0.1, 0.6), 2),
    )
    events: list[EventSpec] = []
    for _ in range(rng.choice((1, 1, 2, 2, 3, 4, 5))):
        maker = rng.choices(_MAKERS, weights=_WEIGHTS)[0]
        events += maker(rng, round(rng.uniform(3.0, 170.0), 1))
    return msgspec.structs.replace(
        base, wind=wind, events=tuple(sorted(events, key=lambda e: e.at_s)), is_service=True,
        has_ftp=rng.random() < 0.5,
        expect=ExpectSpec(arrived=None, contacts=None, max_silence_s=None),
    )


def _length(rng: random.Random, low_s: float = 1.0, high_s: float = 60.0) -> float:
    """Return a duration, short ones as likely as long ones."""
    return round(math.exp(rng.uniform(math.log(low_s), math.log(high_s))), 1)


def _bad_link(rng: random.Random, at_s: float) -> list[EventSpec]:
    return [EventSpec(
        at_s=at_s, kind="link_quality", for_s=_length(rng, 5.0, 120.0),
        loss=rng.choice((0.0, 0.1, 0.3, 0.6)), duplicate=rng.choice((0.0, 0.1, 0.3)),
        reorder=rng.choice((0.0, 0.1, 0.3)), corrupt=rng.choice((0.0, 0.02, 0.1)),
        delay_s=rng.choice((0.0, 0.1, 0.5, 1.5)),
    )]


def _cut(rng: random.Random, at_s: float) -> list[EventSpec]:
    return [EventSpec(at_s=at_s, kind="link_cut", for_s=_length(rng))]


def _vane(rng: random.Random, at_s: float) -> list[EventSpec]:
    state = rng.choice(("frozen", "offset", "spikes"))
    value = {"frozen": 0.0, "offset": rng.uniform(-40.0, 40.0), "spikes": rng.uniform(30.0, 180.0)}[state]
    return [EventSpec(at_s=at_s, kind="vane", state=state, value_deg=round(value, 1), for_s=_length(rng, 5.0, 120.0))]


def _gps_jump(rng: random.Random, at_s: float) -> list[EventSpec]:
    size_m, way = _length(rng, 5.0, 150.0), rng.uniform(0.0, 2.0 * math.pi)
    return [EventSpec(
        at_s=at_s, kind="gps_jump", east_m=round(size_m * math.sin(way), 1), north_m=round(size_m * math.cos(way), 1),
        is_resisted=rng.random() < 0.5, for_s=_length(rng, 2.0, 60.0),
    )]


def _gps_lost(rng: random.Random, at_s: float) -> list[EventSpec]:
    return [EventSpec(at_s=at_s, kind="gps_lost", for_s=_length(rng, 2.0, 40.0))]


def _shift(rng: random.Random, at_s: float) -> list[EventSpec]:
    return [EventSpec(at_s=at_s, kind="wind_shift", veer_deg=round(rng.uniform(-120.0, 120.0), 1),
                      over_s=_length(rng, 1.0, 60.0))]


def _calm(rng: random.Random, at_s: float) -> list[EventSpec]:
    return [EventSpec(at_s=at_s, kind="wind_speed", tws_mps=rng.choice((0.0, 0.5, 1.5)), over_s=5.0,
                      for_s=_length(rng, 10.0, 60.0))]


def _gust(rng: random.Random, at_s: float) -> list[EventSpec]:
    return [EventSpec(at_s=at_s, kind="wind_speed", tws_mps=round(rng.uniform(8.0, 13.0), 1), over_s=2.0,
                      for_s=_length(rng, 5.0, 40.0))]


def _planner_dies(rng: random.Random, at_s: float) -> list[EventSpec]:  # noqa: ARG001 - all makers are alike
    return [EventSpec(at_s=at_s, kind="kill_planner")]


def _planner_hangs(rng: random.Random, at_s: float) -> list[EventSpec]:
    return [EventSpec(at_s=at_s, kind="planner_hang", for_s=_length(rng, 5.0, 60.0))]


def _kill(rng: random.Random, at_s: float) -> list[EventSpec]:
    for_s = None if rng.random() < 0.1 else _length(rng, 1.0, 40.0)
    return [EventSpec(at_s=at_s, kind="kill_companion", restart_after_s=for_s)]


def _reboot(rng: random.Random, at_s: float) -> list[EventSpec]:  # noqa: ARG001
    return [EventSpec(at_s=at_s, kind="reboot")]


def _operator(rng: random.Random, at_s: float) -> list[EventSpec]:
    mode = rng.choice(("HOLD", "MANUAL", "LOITER", "RTL"))
    return [EventSpec(at_s=at_s, kind="mode", mode=mode),
            EventSpec(at_s=at_s + _length(rng, 0.5, 30.0), kind="mode", mode="AUTO")]


def _foreign(rng: random.Random, at_s: float) -> list[EventSpec]:
    # clear water to the west
    return [EventSpec(at_s=at_s, kind="foreign_mission", east_m=round(rng.uniform(-160.0, -110.0), 1),
                      north_m=round(rng.uniform(0.0, 40.0), 1))]


def _battery(rng: random.Random, at_s: float) -> list[EventSpec]:
    return [EventSpec(at_s=at_s, kind="battery", volts=round(rng.uniform(9.0, 11.5), 2))]


_MAKERS = (_bad_link, _cut, _vane, _gps_jump, _gps_lost, _shift, _calm, _gust, _planner_dies, _planner_hangs, _kill,
           _reboot, _operator, _foreign, _battery)
_WEIGHTS = (4, 3, 3, 2, 1, 2, 1, 1, 1, 1, 3, 1, 2, 1, 1)
