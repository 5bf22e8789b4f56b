"""What may be drawn of the autopilot's failsafes: a cause, the parameters that make it act, and who may end it.

ArduRover's actions by number: 0 report only, 1 RTL, 2 HOLD, 3 SmartRTL or RTL, 4 SmartRTL or HOLD, of a battery also
5 disarm and 6 LOITER. What doctor refuses for a sailboat is drawn too: somebody sails without having asked it.
"""

from __future__ import annotations

import random

from sitl.campaigns.fault_lots import FIRST_S, Lot, Maker, length
from sitl.scene import EventSpec

_ACTIONS = (0.0, 1.0, 2.0, 3.0, 4.0)
SET_UNDER_WAY, WIDENED = 0.6, 0.5
LOW_V, CRITICAL_V = 10.8, 10.0
CRASH_DEG = 40.0


def _fence(rng: random.Random, at_s: float) -> Lot:
    """The circle round home, which is where she lies: the goal is outside of it.

    It is there from the start, or somebody sets it under way: it may be behind her then. Now and then it is widened.
    """
    circle = {
        "FENCE_TYPE": 2.0, "FENCE_RADIUS": round(rng.uniform(30.0, 160.0), 1), "FENCE_ACTION": rng.choice(_ACTIONS),
        "AVOID_ENABLE": rng.choice((0.0, 3.0))}
    events: list[EventSpec] = []
    if rng.random() < SET_UNDER_WAY:
        events.append(EventSpec(at_s=at_s, kind="parameter", parameter="FENCE_ENABLE", value=1.0))
    else:
        circle["FENCE_ENABLE"] = 1.0
    if rng.random() < WIDENED:
        later_s = round(at_s + length(rng, 30.0, 150.0), 1)
        events.append(EventSpec(at_s=later_s, kind="parameter", parameter="FENCE_RADIUS", value=1000.0))
    return Lot(events=tuple(events), parameters=circle)


def _battery(rng: random.Random, at_s: float) -> Lot:
    """One level or both, the second some time after the first."""
    low = EventSpec(at_s=at_s, kind="battery", volts=round(rng.uniform(CRITICAL_V + 0.1, LOW_V - 0.1), 2))
    critical = EventSpec(at_s=round(at_s + length(rng, 1.0, 120.0), 1), kind="battery",
                         volts=round(rng.uniform(9.0, CRITICAL_V - 0.1), 2))
    return Lot(
        events=rng.choice(((low,), (critical,), (low, critical))),
        parameters={"BATT_LOW_VOLT": LOW_V, "BATT_CRT_VOLT": CRITICAL_V,
                    "BATT_FS_LOW_ACT": rng.choice((*_ACTIONS, 6.0)),
                    "BATT_FS_CRT_ACT": rng.choice((*_ACTIONS, 5.0, 6.0))})


def _radio(rng: random.Random, at_s: float) -> Lot:
    return Lot(
        events=(EventSpec(at_s=at_s, kind="radio_lost", for_s=rng.choice((None, length(rng, 2.0, 120.0)))),),
        parameters={"FS_THR_ENABLE": rng.choice((1.0, 1.0, 2.0)), "FS_ACTION": rng.choice(_ACTIONS)})


def _station(rng: random.Random, at_s: float) -> Lot:
    """A ground station that was there from the start, and is heard no more from then on."""
    return Lot(
        events=(EventSpec(at_s=FIRST_S, kind="station", for_s=at_s),),
        parameters={"FS_GCS_ENABLE": rng.choice((1.0, 1.0, 2.0)), "FS_ACTION": rng.choice(_ACTIONS)})


def _filter(rng: random.Random, at_s: float) -> Lot:
    return Lot(events=(EventSpec(at_s=at_s, kind="gps_lost", for_s=length(rng, 9.0, 60.0)),),
               parameters={"FS_EKF_ACTION": rng.choice((0.0, 1.0, 1.0))})


def _knockdown(rng: random.Random, at_s: float) -> Lot:
    """Knocked down; a person looks at her and sets AUTO, or never does."""
    fallen = EventSpec(at_s=at_s, kind="knockdown", roll_deg=round(rng.uniform(CRASH_DEG + 5.0, 100.0), 1),
                       for_s=length(rng, 1.0, 20.0))
    looked = EventSpec(at_s=round(at_s + (fallen.for_s or 0.0) + length(rng, 5.0, 120.0), 1), kind="mode", mode="AUTO")
    return Lot(
        events=(fallen, looked) if rng.random() < 0.7 else (fallen,),
        parameters={"FS_CRASH_CHECK": rng.choice((1.0, 2.0)), "CRASH_ANGLE": CRASH_DEG})


def _leak(rng: random.Random, at_s: float) -> Lot:
    """The bilge's switch is wet, for good or as she rolls; nothing on the autopilot acts on it."""
    return Lot(events=(EventSpec(at_s=at_s, kind="leak", for_s=rng.choice((None, length(rng, 1.0, 120.0)))),))


def unattended(rng: random.Random) -> Lot:
    """The companion may not set modes: a person arms her and sets AUTO, now and then again, or does not."""
    times = [10.0, 20.0, 30.0, *sorted(round(rng.uniform(40.0, 250.0), 1) for _ in range(rng.choice((0, 1, 3))))]
    autos = tuple(EventSpec(at_s=t_s, kind="mode", mode="AUTO") for t_s in times)
    return Lot(events=(EventSpec(at_s=8.0, kind="arm"), *autos), changes={"set_auto": False})


# Each at most once a voyage: there is one fence, one battery, one radio.
FAILSAFES: tuple[tuple[Maker, float], ...] = (
    (_fence, 1), (_battery, 1.5), (_radio, 1), (_station, 1), (_filter, 0.5), (_knockdown, 1), (_leak, 0.5),
)
