"""Random faults of a voyage, drawn from a seed: weather, link, sensors, process, people, failsafes, false positions.

ArduRover's actions by number: 0 report only, 1 RTL, 2 HOLD, 3 SmartRTL or RTL, 4 SmartRTL or HOLD, of a battery also
5 disarm and 6 LOITER. What doctor refuses for a sailboat is drawn too: somebody sails without having asked it.
"""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import msgspec

from sitl.autopilot import EPOCH_S
from sitl.faults import FORGERIES
from sitl.scenario import EventSpec, Scenario

FIRST_S = 0.1  # of what is so from the start
# Seeds are known by their numbers: what came after them is none of these.
_LATER = {"GPS2_RAW", "DISTANCE_SENSOR", "WATER_DEPTH", "RANGEFINDER"}
_FORGED = tuple(forgery for forgery in FORGERIES if forgery.message not in _LATER)


@dataclass(frozen=True, slots=True, kw_only=True)
class SampledFault:
    """What was drawn.

    Attributes:
        events: what happens.
        parameters: of the autopilot.
        changes: of the scenario's other fields, by name.
        longer_s: the voyage's limit grows by so much.
    """

    events: tuple[EventSpec, ...] = ()
    parameters: Mapping[str, float] = field(default_factory=dict)
    changes: Mapping[str, Any] = field(default_factory=dict)
    longer_s: float = 0.0


Maker = Callable[[random.Random, float], SampledFault]  # of what begins at a time [s]


def length(rng: random.Random, low: float = 1.0, high: float = 60.0) -> float:
    """Return a duration or size, short ones as likely as long ones."""
    return round(math.exp(rng.uniform(math.log(low), math.log(high))), 1)


def one(**event: Any) -> SampledFault:
    """Return a lot of one event."""
    return SampledFault(events=(EventSpec(**event),))


# ---------------------------------------------------------------------------------------------- links
def _bad_link(rng: random.Random, at_s: float) -> SampledFault:
    return one(
        at_s=at_s,
        kind="link_quality",
        for_s=length(rng, 5.0, 120.0),
        loss=rng.choice((0.0, 0.1, 0.3, 0.6)),
        duplicate=rng.choice((0.0, 0.1, 0.3)),
        reorder=rng.choice((0.0, 0.1, 0.3)),
        corrupt=rng.choice((0.0, 0.02, 0.1)),
        delay_s=rng.choice((0.0, 0.1, 0.5, 1.5)),
    )


def _noise(rng: random.Random, at_s: float) -> SampledFault:
    return one(
        at_s=at_s, kind="link_quality", noise=rng.choice((0.0005, 0.002, 0.01, 0.03)), for_s=length(rng, 5.0, 120.0)
    )


def _cut(rng: random.Random, at_s: float) -> SampledFault:
    return one(at_s=at_s, kind="link_cut", for_s=length(rng))


def _half(rng: random.Random, at_s: float) -> SampledFault:
    return one(at_s=at_s, kind="link_half", state=rng.choice(("unheard", "deaf")), for_s=length(rng, 1.0, 120.0))


def _long_silence(rng: random.Random, at_s: float) -> SampledFault:
    for_s = length(rng, 300.0, 3600.0)
    return SampledFault(events=(EventSpec(at_s=at_s, kind="link_cut", for_s=for_s),), longer_s=for_s)


# -------------------------------------------------------------------------------------------- sensors
def _vane(rng: random.Random, at_s: float) -> SampledFault:
    state = rng.choice(("frozen", "offset", "spikes"))
    value = {"frozen": 0.0, "offset": rng.uniform(-40.0, 40.0), "spikes": rng.uniform(30.0, 180.0)}[state]
    return one(at_s=at_s, kind="vane", state=state, value_deg=round(value, 1), for_s=length(rng, 5.0, 120.0))


def _crooked_vane(rng: random.Random, at_s: float) -> SampledFault:  # noqa: ARG001 - it was mounted so
    return one(at_s=FIRST_S, kind="vane", state="offset", value_deg=round(rng.uniform(-20.0, 20.0), 1))


def _crooked_compass(rng: random.Random, at_s: float) -> SampledFault:  # noqa: ARG001
    return one(at_s=FIRST_S, kind="compass", value_deg=round(rng.uniform(-20.0, 20.0), 1))


def _iron(rng: random.Random, at_s: float) -> SampledFault:
    return one(
        at_s=at_s,
        kind="compass",
        value_deg=round(rng.choice((-1.0, 1.0)) * length(rng, 5.0, 60.0), 1),
        for_s=length(rng, 5.0, 120.0),
    )


def _gps_jump(rng: random.Random, at_s: float) -> SampledFault:
    size_m, way = length(rng, 5.0, 150.0), rng.uniform(0.0, 2.0 * math.pi)
    return one(
        at_s=at_s,
        kind="gps_jump",
        east_m=round(size_m * math.sin(way), 1),
        north_m=round(size_m * math.cos(way), 1),
        is_resisted=rng.random() < 0.5,
        for_s=length(rng, 2.0, 60.0),
    )


def _gps_lost(rng: random.Random, at_s: float) -> SampledFault:
    return one(at_s=at_s, kind="gps_lost", for_s=length(rng, 2.0, 40.0))


# ------------------------------------------------------------------------------------- wind and water
def _shift(rng: random.Random, at_s: float) -> SampledFault:
    return one(at_s=at_s, kind="wind_shift", veer_deg=round(rng.uniform(-180.0, 180.0), 1), over_s=length(rng))


def _calm(rng: random.Random, at_s: float) -> SampledFault:
    return one(
        at_s=at_s, kind="wind_speed", tws_mps=rng.choice((0.0, 0.5, 1.5)), over_s=5.0, for_s=length(rng, 10.0, 60.0)
    )


def _gust(rng: random.Random, at_s: float) -> SampledFault:
    return one(
        at_s=at_s, kind="wind_speed", tws_mps=round(rng.uniform(8.0, 13.0), 1), over_s=2.0, for_s=length(rng, 5.0, 40.0)
    )


def _current(rng: random.Random, at_s: float) -> SampledFault:
    begins_s = rng.choice((FIRST_S, at_s))
    return one(
        at_s=begins_s,
        kind="current",
        set_deg=_anywhere(rng),
        drift_mps=round(rng.uniform(0.1, 0.8), 2),
        for_s=rng.choice((None, length(rng, 20.0, 200.0))),
    )


def _long_calm(rng: random.Random, at_s: float) -> SampledFault:
    for_s = length(rng, 120.0, 1800.0)
    calm = EventSpec(at_s=at_s, kind="wind_speed", tws_mps=rng.choice((0.0, 0.2, 0.6)), over_s=15.0, for_s=for_s)
    return SampledFault(events=(calm,), longer_s=for_s)


def _calm_in_a_current(rng: random.Random, at_s: float) -> SampledFault:
    """The wind dies where the water runs, with a crew on board that anchors when it is called, or without."""
    calm = _long_calm(rng, at_s)
    for_s = calm.longer_s + 20.0
    water = EventSpec(
        at_s=at_s, kind="current", set_deg=_anywhere(rng), drift_mps=round(rng.uniform(0.1, 0.8), 2), for_s=for_s
    )
    crew = EventSpec(at_s=FIRST_S, kind="crew", react_s=round(rng.uniform(10.0, 90.0), 1), for_s=for_s)
    events = (*calm.events, water) if rng.random() < 0.2 else (*calm.events, water, crew)
    return SampledFault(events=events, longer_s=calm.longer_s)


def _anywhere(rng: random.Random) -> float:
    return round(rng.uniform(0.0, 360.0), 1)


# -------------------------------------------------------------------------------------------- process
def _planner_dies(rng: random.Random, at_s: float) -> SampledFault:  # noqa: ARG001 - all makers are alike
    return one(at_s=at_s, kind="kill_planner")


def _planner_hangs(rng: random.Random, at_s: float) -> SampledFault:
    return one(at_s=at_s, kind="planner_hang", for_s=length(rng, 5.0, 60.0))


def _planner_starves(rng: random.Random, at_s: float) -> SampledFault:  # noqa: ARG001
    return one(at_s=at_s, kind="planner_starved")


def _kill(rng: random.Random, at_s: float) -> SampledFault:
    for_s = None if rng.random() < 0.1 else length(rng, 1.0, 40.0)
    return one(at_s=at_s, kind="kill_companion", restart_after_s=for_s)


def _power_cut(rng: random.Random, at_s: float) -> SampledFault:
    """What a power cut may leave: a saved state that is gone, torn or old, and a clock without a battery."""
    saved = rng.choice(("kept", "lost", "torn", "old"))
    clock = rng.choice(("right", "minutes", "hours", "1970"))
    step_s = {
        "right": 0.0,
        "minutes": rng.uniform(-1800.0, 1800.0),
        "hours": rng.uniform(-86400.0, 86400.0),
        "1970": -EPOCH_S,
    }[clock]
    return one(
        at_s=at_s,
        kind="kill_companion",
        restart_after_s=length(rng, 1.0, 40.0),
        saved=saved,
        aged_s=length(rng, 1.0, 120.0) if saved == "old" else 0.0,
        clock_step_s=round(step_s, 1),
    )


def _disk(rng: random.Random, at_s: float) -> SampledFault:
    return one(
        at_s=rng.choice((FIRST_S, at_s)),
        kind="disk",
        state=rng.choice(("full", "sick", "read_only")),
        for_s=rng.choice((None, length(rng, 5.0, 120.0))),
    )


# --------------------------------------------------------------------------------------------- people
def _reboot(rng: random.Random, at_s: float) -> SampledFault:  # noqa: ARG001
    return one(at_s=at_s, kind="reboot")


def _operator(rng: random.Random, at_s: float) -> SampledFault:
    mode = rng.choice(("HOLD", "MANUAL", "LOITER", "RTL"))
    return SampledFault(
        events=(
            EventSpec(at_s=at_s, kind="mode", mode=mode),
            EventSpec(at_s=at_s + length(rng, 0.5, 30.0), kind="mode", mode="AUTO"),
        )
    )


def _foreign(rng: random.Random, at_s: float) -> SampledFault:
    # clear water to the west
    return one(
        at_s=at_s,
        kind="foreign_mission",
        east_m=round(rng.uniform(-160.0, -110.0), 1),
        north_m=round(rng.uniform(0.0, 40.0), 1),
    )


def _neighbour(rng: random.Random, at_s: float) -> SampledFault:
    """Another autopilot in range: before the start or under way, of a boat or of anything, ours named or not."""
    begins_s = rng.choice((0.0, 0.0, at_s))
    neighbour = EventSpec(
        at_s=begins_s,
        kind="neighbour",
        system=rng.choice((2, 7, 99, 250)),
        for_s=length(rng, 5.0, 200.0),
        vehicle_type=rng.choice((11, 11, 10, 1, 2)),
    )
    return SampledFault(events=(neighbour,), changes={"system": 1} if rng.random() < 0.7 else {})


def _spoof(rng: random.Random, at_s: float) -> SampledFault:
    listens = rng.random() < 0.6
    return one(
        at_s=at_s,
        kind="spoof",
        forgery=rng.choice(_FORGED).name,
        listens=listens,
        rate_hz=20.0 if listens else 5.0,
        for_s=length(rng, 1.0, 30.0),
    )


# How often each is drawn, beside the others.
LOTS: tuple[tuple[Maker, float], ...] = (
    (_bad_link, 4),
    (_noise, 1.5),
    (_cut, 3),
    (_half, 1.5),
    (_long_silence, 0.4),
    (_vane, 3),
    (_crooked_vane, 1.5),
    (_crooked_compass, 1.5),
    (_iron, 1),
    (_gps_jump, 2),
    (_gps_lost, 1),
    (_shift, 2),
    (_calm, 1),
    (_gust, 1),
    (_current, 2),
    (_long_calm, 0.3),
    (_planner_dies, 1),
    (_planner_hangs, 1),
    (_kill, 3),
    (_power_cut, 2),
    (_disk, 1.5),
    (_reboot, 1),
    (_operator, 2),
    (_foreign, 1),
    (_spoof, 3),
)
# The same, each at most once a voyage.
SINGLE: tuple[tuple[Maker, float], ...] = ((_calm_in_a_current, 0.5), (_neighbour, 1.5))
# What befalls the planner where it is the real process.
PLANNER: tuple[tuple[Maker, float], ...] = ((_planner_dies, 1), (_planner_hangs, 1), (_planner_starves, 1))


_ACTIONS = (0.0, 1.0, 2.0, 3.0, 4.0)
SET_UNDER_WAY, WIDENED = 0.6, 0.5
LOW_V, CRITICAL_V = 10.8, 10.0
CRASH_DEG = 40.0


def _fence(rng: random.Random, at_s: float) -> SampledFault:
    """The circle round home, which is where the boat lies: the goal is outside of it.

    It is there from the start, or set under way, perhaps when the boat is past it. Now and then it is widened.
    """
    circle = {
        "FENCE_TYPE": 2.0,
        "FENCE_RADIUS": round(rng.uniform(30.0, 160.0), 1),
        "FENCE_ACTION": rng.choice(_ACTIONS),
        "AVOID_ENABLE": rng.choice((0.0, 3.0)),
    }
    events: list[EventSpec] = []
    if rng.random() < SET_UNDER_WAY:
        events.append(EventSpec(at_s=at_s, kind="parameter", parameter="FENCE_ENABLE", value=1.0))
    else:
        circle["FENCE_ENABLE"] = 1.0
    if rng.random() < WIDENED:
        later_s = round(at_s + length(rng, 30.0, 150.0), 1)
        events.append(EventSpec(at_s=later_s, kind="parameter", parameter="FENCE_RADIUS", value=1000.0))
    return SampledFault(events=tuple(events), parameters=circle)


def _battery(rng: random.Random, at_s: float) -> SampledFault:
    """One level or both, the second some time after the first."""
    low = EventSpec(at_s=at_s, kind="battery", volts=round(rng.uniform(CRITICAL_V + 0.1, LOW_V - 0.1), 2))
    critical = EventSpec(
        at_s=round(at_s + length(rng, 1.0, 120.0), 1),
        kind="battery",
        volts=round(rng.uniform(9.0, CRITICAL_V - 0.1), 2),
    )
    return SampledFault(
        events=rng.choice(((low,), (critical,), (low, critical))),
        parameters={
            "BATT_LOW_VOLT": LOW_V,
            "BATT_CRT_VOLT": CRITICAL_V,
            "BATT_FS_LOW_ACT": rng.choice((*_ACTIONS, 6.0)),
            "BATT_FS_CRT_ACT": rng.choice((*_ACTIONS, 5.0, 6.0)),
        },
    )


def _radio(rng: random.Random, at_s: float) -> SampledFault:
    return SampledFault(
        events=(EventSpec(at_s=at_s, kind="radio_lost", for_s=rng.choice((None, length(rng, 2.0, 120.0)))),),
        parameters={"FS_THR_ENABLE": rng.choice((1.0, 1.0, 2.0)), "FS_ACTION": rng.choice(_ACTIONS)},
    )


def _station(rng: random.Random, at_s: float) -> SampledFault:
    """A ground station that was there from the start, and is heard no more from then on."""
    return SampledFault(
        events=(EventSpec(at_s=FIRST_S, kind="station", for_s=at_s),),
        parameters={"FS_GCS_ENABLE": rng.choice((1.0, 1.0, 2.0)), "FS_ACTION": rng.choice(_ACTIONS)},
    )


def _filter(rng: random.Random, at_s: float) -> SampledFault:
    return SampledFault(
        events=(EventSpec(at_s=at_s, kind="gps_lost", for_s=length(rng, 9.0, 60.0)),),
        parameters={"FS_EKF_ACTION": rng.choice((0.0, 1.0, 1.0))},
    )


def _knockdown(rng: random.Random, at_s: float) -> SampledFault:
    """Knocked down; a person looks at the boat and sets AUTO, or never does."""
    fallen = EventSpec(
        at_s=at_s,
        kind="knockdown",
        roll_deg=round(rng.uniform(CRASH_DEG + 5.0, 100.0), 1),
        for_s=length(rng, 1.0, 20.0),
    )
    looked = EventSpec(at_s=round(at_s + (fallen.for_s or 0.0) + length(rng, 5.0, 120.0), 1), kind="mode", mode="AUTO")
    return SampledFault(
        events=(fallen, looked) if rng.random() < 0.7 else (fallen,),
        parameters={"FS_CRASH_CHECK": rng.choice((1.0, 2.0)), "CRASH_ANGLE": CRASH_DEG},
    )


def _leak(rng: random.Random, at_s: float) -> SampledFault:
    """The bilge's switch is wet, for good or as the boat rolls; nothing on the autopilot acts on it."""
    return SampledFault(events=(EventSpec(at_s=at_s, kind="leak", for_s=rng.choice((None, length(rng, 1.0, 120.0)))),))


# Each at most once a voyage: there is one fence, one battery, one radio.
FAILSAFES: tuple[tuple[Maker, float], ...] = (
    (_fence, 1),
    (_battery, 1.5),
    (_radio, 1),
    (_station, 1),
    (_filter, 0.5),
    (_knockdown, 1),
    (_leak, 0.5),
)


_MAKERS, _WEIGHTS = zip(*LOTS, *SINGLE, *FAILSAFES, strict=True)
_ONCE = frozenset(maker for maker, _ in (*SINGLE, *FAILSAFES))


def sampled_faults(rng: random.Random, latest_s: float) -> list[SampledFault]:
    """Return one to five lots of trouble, each of which begins by ``latest_s``."""
    lots: list[SampledFault] = []
    drawn: set[Maker] = set()
    for _ in range(rng.choice((1, 1, 2, 2, 3, 4, 5))):
        maker = rng.choices(_MAKERS, weights=_WEIGHTS)[0]
        if maker in _ONCE & drawn:
            continue
        drawn.add(maker)
        lots.append(maker(rng, round(rng.uniform(3.0, latest_s), 1)))
    return lots


def with_faults(base: Scenario, lots: Sequence[SampledFault]) -> Scenario:
    """Return a scenario in which the lots befall the boat; its limit grows with what takes long."""
    events = [*base.events, *(event for lot in lots for event in lot.events)]
    changes = {key: value for lot in lots for key, value in lot.changes.items()}
    parameters = {key: value for lot in lots for key, value in lot.parameters.items()}
    return msgspec.structs.replace(
        base,
        events=tuple(sorted(events, key=lambda e: e.at_s)),
        parameters={**base.parameters, **parameters},
        limit_s=round(base.limit_s + sum(lot.longer_s for lot in lots), 1),
        **changes,
    )
