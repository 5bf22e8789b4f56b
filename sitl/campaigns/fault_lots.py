"""What may be drawn once for a voyage: faults of link, sensors, wind, process and people, each by its chance."""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from sitl.autopilot import EPOCH_S
from sitl.scene import EventSpec
from sitl.trouble import FORGERIES

FIRST_S = 0.1   # of what is so from the start
# That of a second receiver is none of them: seeds are known by their numbers, and it came after them.
_FORGED = tuple(forgery for forgery in FORGERIES if forgery.message != "GPS2_RAW")


@dataclass(frozen=True, slots=True, kw_only=True)
class Lot:
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


Maker = Callable[[random.Random, float], Lot]   # of what begins at a time [s]


def length(rng: random.Random, low: float = 1.0, high: float = 60.0) -> float:
    """Return a duration or size, short ones as likely as long ones."""
    return round(math.exp(rng.uniform(math.log(low), math.log(high))), 1)


def one(**event: Any) -> Lot:
    """Return a lot of one event."""
    return Lot(events=(EventSpec(**event),))


# ---------------------------------------------------------------------------------------------- links
def _bad_link(rng: random.Random, at_s: float) -> Lot:
    return one(
        at_s=at_s, kind="link_quality", for_s=length(rng, 5.0, 120.0),
        loss=rng.choice((0.0, 0.1, 0.3, 0.6)), duplicate=rng.choice((0.0, 0.1, 0.3)),
        reorder=rng.choice((0.0, 0.1, 0.3)), corrupt=rng.choice((0.0, 0.02, 0.1)),
        delay_s=rng.choice((0.0, 0.1, 0.5, 1.5)))


def _noise(rng: random.Random, at_s: float) -> Lot:
    return one(at_s=at_s, kind="link_quality", noise=rng.choice((0.0005, 0.002, 0.01, 0.03)),
               for_s=length(rng, 5.0, 120.0))


def _cut(rng: random.Random, at_s: float) -> Lot:
    return one(at_s=at_s, kind="link_cut", for_s=length(rng))


def _half(rng: random.Random, at_s: float) -> Lot:
    return one(at_s=at_s, kind="link_half", state=rng.choice(("unheard", "deaf")), for_s=length(rng, 1.0, 120.0))


def _long_silence(rng: random.Random, at_s: float) -> Lot:
    for_s = length(rng, 300.0, 3600.0)
    return Lot(events=(EventSpec(at_s=at_s, kind="link_cut", for_s=for_s),), longer_s=for_s)


# -------------------------------------------------------------------------------------------- sensors
def _vane(rng: random.Random, at_s: float) -> Lot:
    state = rng.choice(("frozen", "offset", "spikes"))
    value = {"frozen": 0.0, "offset": rng.uniform(-40.0, 40.0), "spikes": rng.uniform(30.0, 180.0)}[state]
    return one(at_s=at_s, kind="vane", state=state, value_deg=round(value, 1), for_s=length(rng, 5.0, 120.0))


def turned_vane(rng: random.Random, at_s: float) -> Lot:
    """Turn the vane on its mast, or let a station write its offset: for good, or until somebody puts it right."""
    turned_deg = round(rng.choice((-1.0, 1.0)) * rng.choice((90.0, 180.0, rng.uniform(60.0, 180.0))), 1)
    for_s = rng.choice((None, length(rng, 60.0, 300.0)))
    if rng.random() < 0.5:
        return one(at_s=at_s, kind="vane", state="offset", value_deg=turned_deg, for_s=for_s)
    events = [EventSpec(at_s=at_s, kind="parameter", parameter="WNDVN_DIR_OFS", value=turned_deg)]
    if for_s is not None:
        events.append(EventSpec(at_s=round(at_s + for_s, 1), kind="parameter", parameter="WNDVN_DIR_OFS", value=0.0))
    return Lot(events=tuple(events))


def _crooked_vane(rng: random.Random, at_s: float) -> Lot:  # noqa: ARG001 - it was mounted so
    return one(at_s=FIRST_S, kind="vane", state="offset", value_deg=round(rng.uniform(-20.0, 20.0), 1))


def _crooked_compass(rng: random.Random, at_s: float) -> Lot:  # noqa: ARG001
    return one(at_s=FIRST_S, kind="compass", value_deg=round(rng.uniform(-20.0, 20.0), 1))


def _iron(rng: random.Random, at_s: float) -> Lot:
    return one(at_s=at_s, kind="compass", value_deg=round(rng.choice((-1.0, 1.0)) * length(rng, 5.0, 60.0), 1),
               for_s=length(rng, 5.0, 120.0))


def _gps_jump(rng: random.Random, at_s: float) -> Lot:
    size_m, way = length(rng, 5.0, 150.0), rng.uniform(0.0, 2.0 * math.pi)
    return one(
        at_s=at_s, kind="gps_jump", east_m=round(size_m * math.sin(way), 1), north_m=round(size_m * math.cos(way), 1),
        is_resisted=rng.random() < 0.5, for_s=length(rng, 2.0, 60.0))


def _gps_lost(rng: random.Random, at_s: float) -> Lot:
    return one(at_s=at_s, kind="gps_lost", for_s=length(rng, 2.0, 40.0))


# ------------------------------------------------------------------------------------- wind and water
def _shift(rng: random.Random, at_s: float) -> Lot:
    return one(at_s=at_s, kind="wind_shift", veer_deg=round(rng.uniform(-120.0, 120.0), 1), over_s=length(rng))


def _calm(rng: random.Random, at_s: float) -> Lot:
    return one(at_s=at_s, kind="wind_speed", tws_mps=rng.choice((0.0, 0.5, 1.5)), over_s=5.0,
               for_s=length(rng, 10.0, 60.0))


def _gust(rng: random.Random, at_s: float) -> Lot:
    return one(at_s=at_s, kind="wind_speed", tws_mps=round(rng.uniform(8.0, 13.0), 1), over_s=2.0,
               for_s=length(rng, 5.0, 40.0))


def _current(rng: random.Random, at_s: float) -> Lot:
    begins_s = rng.choice((FIRST_S, at_s))
    return one(at_s=begins_s, kind="current", set_deg=_anywhere(rng), drift_mps=round(rng.uniform(0.1, 0.8), 2),
               for_s=rng.choice((None, length(rng, 20.0, 200.0))))


def _long_calm(rng: random.Random, at_s: float) -> Lot:
    for_s = length(rng, 120.0, 1800.0)
    return Lot(events=(EventSpec(at_s=at_s, kind="wind_speed", tws_mps=rng.choice((0.0, 0.2, 0.6)), over_s=15.0,
                                 for_s=for_s),), longer_s=for_s)


def _calm_in_a_current(rng: random.Random, at_s: float) -> Lot:
    """The wind dies where the water runs, with a crew on board that anchors when it is called, or without."""
    calm = _long_calm(rng, at_s)
    for_s = calm.longer_s + 20.0
    water = EventSpec(at_s=at_s, kind="current", set_deg=_anywhere(rng), drift_mps=round(rng.uniform(0.1, 0.8), 2),
                      for_s=for_s)
    crew = EventSpec(at_s=FIRST_S, kind="crew", react_s=round(rng.uniform(10.0, 90.0), 1), for_s=for_s)
    events = (*calm.events, water) if rng.random() < 0.2 else (*calm.events, water, crew)
    return Lot(events=events, longer_s=calm.longer_s)


def _anywhere(rng: random.Random) -> float:
    return round(rng.uniform(0.0, 360.0), 1)


# -------------------------------------------------------------------------------------------- process
def _planner_dies(rng: random.Random, at_s: float) -> Lot:  # noqa: ARG001 - all makers are alike
    return one(at_s=at_s, kind="kill_planner")


def _planner_hangs(rng: random.Random, at_s: float) -> Lot:
    return one(at_s=at_s, kind="planner_hang", for_s=length(rng, 5.0, 60.0))


def _planner_starves(rng: random.Random, at_s: float) -> Lot:  # noqa: ARG001
    return one(at_s=at_s, kind="planner_starved")


def _kill(rng: random.Random, at_s: float) -> Lot:
    for_s = None if rng.random() < 0.1 else length(rng, 1.0, 40.0)
    return one(at_s=at_s, kind="kill_companion", restart_after_s=for_s)


def _power_cut(rng: random.Random, at_s: float) -> Lot:
    """What a power cut may leave: a saved state that is gone, torn or old, and a clock without a battery."""
    saved = rng.choice(("kept", "lost", "torn", "old"))
    clock = rng.choice(("right", "minutes", "hours", "1970"))
    step_s = {"right": 0.0, "minutes": rng.uniform(-1800.0, 1800.0), "hours": rng.uniform(-86400.0, 86400.0),
              "1970": -EPOCH_S}[clock]
    return one(at_s=at_s, kind="kill_companion", restart_after_s=length(rng, 1.0, 40.0), saved=saved,
               aged_s=length(rng, 1.0, 120.0) if saved == "old" else 0.0, clock_step_s=round(step_s, 1))


def _disk(rng: random.Random, at_s: float) -> Lot:
    return one(at_s=rng.choice((FIRST_S, at_s)), kind="disk", state=rng.choice(("full", "sick", "read_only")),
               for_s=rng.choice((None, length(rng, 5.0, 120.0))))


def full_card(rng: random.Random, at_s: float) -> Lot:
    """Fill the card, or make it read-only: from the start or under way, for good or until it is well again."""
    return one(at_s=rng.choice((FIRST_S, at_s)), kind="disk", state=rng.choice(("full", "read_only")),
               for_s=rng.choice((None, length(rng, 5.0, 120.0))))


# --------------------------------------------------------------------------------------------- people
def _reboot(rng: random.Random, at_s: float) -> Lot:  # noqa: ARG001
    return one(at_s=at_s, kind="reboot")


def _operator(rng: random.Random, at_s: float) -> Lot:
    mode = rng.choice(("HOLD", "MANUAL", "LOITER", "RTL"))
    return Lot(events=(
        EventSpec(at_s=at_s, kind="mode", mode=mode),
        EventSpec(at_s=at_s + length(rng, 0.5, 30.0), kind="mode", mode="AUTO")))


def _foreign(rng: random.Random, at_s: float) -> Lot:
    # clear water to the west
    return one(at_s=at_s, kind="foreign_mission", east_m=round(rng.uniform(-160.0, -110.0), 1),
               north_m=round(rng.uniform(0.0, 40.0), 1))


def _neighbour(rng: random.Random, at_s: float) -> Lot:
    """Another autopilot in range: before the start or under way, of a boat or of anything, ours named or not."""
    begins_s = rng.choice((0.0, 0.0, at_s))
    neighbour = EventSpec(
        at_s=begins_s, kind="neighbour", system=rng.choice((2, 7, 99, 250)), for_s=length(rng, 5.0, 200.0),
        vehicle_type=rng.choice((11, 11, 10, 1, 2)))
    return Lot(events=(neighbour,), changes={"system": 1} if rng.random() < 0.7 else {})


def _spoof(rng: random.Random, at_s: float) -> Lot:
    listens = rng.random() < 0.6
    return one(at_s=at_s, kind="spoof", forgery=rng.choice(_FORGED).name, listens=listens,
               rate_hz=20.0 if listens else 5.0, for_s=length(rng, 1.0, 30.0))


# How often each is drawn, beside the others.
LOTS: tuple[tuple[Maker, float], ...] = (
    (_bad_link, 4), (_noise, 1.5), (_cut, 3), (_half, 1.5), (_long_silence, 0.4),
    (_vane, 3), (_crooked_vane, 1.5), (_crooked_compass, 1.5), (_iron, 1), (_gps_jump, 2), (_gps_lost, 1),
    (_shift, 2), (_calm, 1), (_gust, 1), (_current, 2), (_long_calm, 0.3),
    (_planner_dies, 1), (_planner_hangs, 1), (_kill, 3), (_power_cut, 2), (_disk, 1.5),
    (_reboot, 1), (_operator, 2), (_foreign, 1), (_spoof, 3),
)
# The same, each at most once a voyage.
SINGLE: tuple[tuple[Maker, float], ...] = ((_calm_in_a_current, 0.5), (_neighbour, 1.5))
# What befalls the planner where it is the real process.
PLANNER: tuple[tuple[Maker, float], ...] = ((_planner_dies, 1), (_planner_hangs, 1), (_planner_starves, 1))
