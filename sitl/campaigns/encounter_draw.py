"""Draws an encounter from a seed: the weather, the other vessel, how her watch is kept and who hears her.

Our boat is on a reach or a broad reach, so that she holds her course by herself: on a beat nobody can tell standing on
from the next tack. The other is placed where both would nearly touch.
"""

from __future__ import annotations

import math
import random
from typing import Literal, get_args

from sitl.scene import (
    CLOSE_HAULED_DEG,
    Craft,
    EventSpec,
    ExpectSpec,
    Manner,
    Mover,
    Scenario,
    WindSpec,
    duty,
    met_by,
)

Kind = Literal["crossing", "head-on", "overtaking", "sailing"]
Policy = Literal["rules", "keep clear"]
KINDS: tuple[Kind, ...] = get_args(Kind)
POLICIES: tuple[Policy, ...] = get_args(Policy)

AT_S = 75.0                  # under way for half a minute, on course
OUR_MPS = 2.7
LEG_DEG = 90.0
RULE = {"crossing": "18", "head-on": "18", "overtaking": "13", "sailing": "12"}
SHOAL = 0.25                 # of the voyages, and how many of the vessels keep the rules
KEEPS_RULES = 0.6
CLEAR_TACK_DEG = 12.0        # nearer to the wind's line nobody could tell her tack
_MOTOR: tuple[tuple[Craft, float], ...] = (
    ("power", 0.5), ("fishing", 0.2), ("restricted", 0.1), ("not under command", 0.1), ("draught", 0.1))


def draw(seed: int, kind: Kind, policy: Policy) -> Scenario:
    """Return the scenario of a seed; kinds and policies of one seed have nothing to do with each other's weather."""
    rng = random.Random(f"encounter {kind} {seed}")
    twd_deg = (LEG_DEG + rng.choice((-1.0, 1.0)) * rng.uniform(75.0, 140.0)) % 360.0
    while True:
        event = _vessel(rng, kind)
        if _is(event, kind, twd_deg):
            break
    mission = "meeting-shoal" if rng.random() < SHOAL else "meeting"
    longer_s = 90.0 if kind == "overtaking" else 50.0
    return Scenario(
        name=f"{kind}-{seed}", mission=f"../../missions/{mission}.toml", limit_s=AT_S + event.meet_s + longer_s,
        wind=WindSpec(model="ou", from_deg=round(twd_deg, 1), tws_mps=round(rng.uniform(3.5, 8.0), 2),
                      sd_deg=round(rng.uniform(3.0, 7.0), 1), tws_sd_mps=round(rng.uniform(0.1, 0.5), 2)),
        events=(event,), policy=policy, expect=ExpectSpec(arrived=None, max_silence_s=None))


def _vessel(rng: random.Random, kind: Kind) -> EventSpec:
    craft: Craft = "sail" if kind == "sailing" else rng.choices(*zip(*_MOTOR, strict=True))[0]
    side = rng.choice((-1.0, 1.0))
    if kind == "crossing":
        course, sog, length = side * rng.uniform(45.0, 135.0), rng.uniform(2.5, 8.0), rng.uniform(15.0, 100.0)
    elif kind == "head-on":
        course, sog, length = side * rng.uniform(175.0, 180.0), rng.uniform(2.0, 7.0), rng.uniform(15.0, 100.0)
    elif kind == "sailing":
        course, sog, length = side * rng.uniform(25.0, 180.0), rng.uniform(1.5, 4.0), rng.uniform(7.0, 16.0)
    elif rng.random() < 0.5:
        course, sog, length = side * rng.uniform(0.0, 20.0), rng.uniform(5.0, 9.0), rng.uniform(15.0, 100.0)
    else:
        course, sog, length = side * rng.uniform(0.0, 20.0), rng.uniform(0.5, 1.2), rng.uniform(8.0, 40.0)
    manner: Manner = "rules" if rng.random() < KEEPS_RULES else "keeps"
    return EventSpec(
        at_s=AT_S, kind="meeting", course_deg=round(course, 1), sog_mps=round(sog, 2), length_m=round(length, 1),
        craft=craft, manner=manner, meet_s=round(rng.uniform(110.0, 160.0), 1),
        miss_m=round(rng.uniform(-25.0, 25.0), 1), react_s=round(rng.uniform(70.0, 130.0), 1),
        every_s=rng.choice((2.0, 6.0, 10.0, 10.0)), receiver=rng.choice(("autopilot", "feed")))


def _is(event: EventSpec, kind: Kind, twd_deg: float) -> bool:
    """Whether an event is of the kind that was asked for, by the rules."""
    way = OUR_MPS * math.sin(math.radians(LEG_DEG)), OUR_MPS * math.cos(math.radians(LEG_DEG))
    place, course = met_by(((0.0, 0.0), way), event.course_deg, event.sog_mps, event.meet_s, event.miss_m)
    ours = Mover(en_m=(0.0, 0.0), course_rad=math.radians(LEG_DEG), heading_rad=math.radians(LEG_DEG),
                 speed_mps=OUR_MPS, craft="sail")
    hers = Mover(en_m=place, course_rad=course, heading_rad=course, speed_mps=event.sog_mps, craft=event.craft)
    off_wind = abs(math.remainder(math.degrees(course) - twd_deg, 360.0))
    if event.craft == "sail" and not CLOSE_HAULED_DEG <= off_wind <= 180.0 - CLEAR_TACK_DEG:
        return False
    return duty(ours, hers, math.radians(twd_deg))[0] == RULE[kind]
