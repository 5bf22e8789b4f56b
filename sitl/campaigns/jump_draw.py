"""Draws a false position for a voyage from a seed: how it comes to be false, how far, for how long, in which mode."""

from __future__ import annotations

import math
import random
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import msgspec

from sitl.campaigns.fault_lots import FIRST_S, length
from sitl.run.variation import Variation
from sitl.scene import EventSpec, ExpectSpec, Scenario, WindSpec

# How a position comes to be false; seeds take them in turn.
KINDS = ("followed", "resisted", "creeping", "one of two", "on restart")
MODES = ("by plan", "by headings", "held by order", "at rest")
_MODE_WEIGHTS = (6, 1, 1, 1)
NEAR_M, FAR_M = 20.0, 5000.0
SHORT_S, LONG_S = 5.0, 300.0
CREEPS_MPS = (0.2, 2.0)
ONTO = 0.5            # the share of the jumps that are aimed at something solid
SAILS_MPS = 1.8       # roughly, by which the boat is aimed from
ANSWER_S = 15.0       # an order is waited for so long
AFTER_S = 120.0       # of the voyage, when the position is right again


@dataclass(frozen=True, slots=True, kw_only=True)
class Jump:
    """What was drawn: the scenario, and the figures of its false position. ``mode`` is one of ``MODES``."""

    scenario: Scenario
    kind: str
    mode: str
    size_m: float
    for_s: float
    variation: Variation | None

    @property
    def size_class(self) -> str:
        """How far, in words for a table."""
        return "to 100 m" if self.size_m <= 100.0 else "to 500 m" if self.size_m <= 500.0 else "farther"


def draw_jump(
    seed: int, base: Scenario, *, start_en: tuple[float, float], goal_en: tuple[float, float],
    solids_en: Sequence[tuple[float, float]],
) -> Jump:
    """Return the voyage of ``seed``: ``base`` in moderate wind, from start to goal among solids, by their middles."""
    rng = random.Random(f"jumps {seed}")
    kind = KINDS[seed % len(KINDS)]
    mode = rng.choices(MODES, weights=_MODE_WEIGHTS)[0]
    wind = WindSpec(model="ou", from_deg=round(rng.uniform(0.0, 360.0), 1), tws_mps=round(rng.uniform(3.5, 7.0), 2),
                    sd_deg=round(rng.uniform(3.0, 10.0), 1))
    at_s = round(rng.uniform(250.0, 300.0) if mode == "at rest" else rng.uniform(45.0, 100.0), 1)
    for_s = length(rng, SHORT_S, LONG_S)
    size_m, way_rad = length(rng, NEAR_M, FAR_M), rng.uniform(0.0, 2.0 * math.pi)
    if kind == "creeping":
        size_m = round(for_s * rng.uniform(*CREEPS_MPS), 1)
    away = (size_m * math.sin(way_rad), size_m * math.cos(way_rad))
    if kind != "creeping" and solids_en and rng.random() < ONTO:
        share = 1.0 if mode == "at rest" else min(1.0, SAILS_MPS * (at_s - 40.0) / math.dist(start_en, goal_en))
        here = [a + share * (b - a) for a, b in zip(start_en, goal_en, strict=True)]
        onto = rng.choice(solids_en)
        away = (onto[0] - here[0], onto[1] - here[1])
        size_m = round(max(NEAR_M, math.hypot(*away)), 1)
    jump = EventSpec(
        at_s=at_s, kind="gps_jump", for_s=for_s, east_m=round(away[0], 1), north_m=round(away[1], 1),
        is_resisted=kind == "resisted", is_of_one=kind == "one of two",
        over_s=for_s if kind == "creeping" else 0.0)
    events = [jump]
    if kind == "one of two":
        events.insert(0, EventSpec(at_s=FIRST_S, kind="gps_jump", is_of_one=True))
    if kind == "on restart":
        dead_s = length(rng, 2.0, 40.0)
        events.insert(0, EventSpec(at_s=round(at_s - rng.uniform(0.1, 0.9) * dead_s, 1), kind="kill_companion",
                                   restart_after_s=dead_s))
    if mode == "held by order":
        first_s = at_s if kind != "on restart" else events[0].at_s - ANSWER_S   # she lives to answer it
        events.append(EventSpec(at_s=round(first_s - rng.uniform(5.0, 20.0), 1), kind="order", order="hold"))
    headings: dict[str, dict[str, Any]] = {"skipper": {"guidance": "heading"}, "operator": {"guided": True}}
    tables = {"by headings": headings, "held by order": {"operator": {"orders": "all"}}}
    scenario = msgspec.structs.replace(
        base, wind=wind, is_service=True, limit_s=round(at_s + for_s + AFTER_S, 1), exit_on_arrival=mode != "at rest",
        events=tuple(sorted(events, key=lambda e: e.at_s)),
        expect=ExpectSpec(arrived=None, contacts=None, max_silence_s=None))
    return Jump(scenario=scenario, kind=kind, mode=mode, size_m=size_m, for_s=for_s,
                variation=Variation(tables=tables[mode]) if mode in tables else None)
