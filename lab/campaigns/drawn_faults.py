"""Faulty voyages of a campaign, drawn from a seed: weather and faults, false positions, the planner's process."""

from __future__ import annotations

import math
import random
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, get_args

import msgspec

from sitl.rehearse.fault_sampling import FIRST_S, PLANNER, SampledFault, length, one, sampled_faults, with_faults
from sitl.run.variation import Variation
from sitl.scenario import EventSpec, ExpectSpec, Outlet, Scenario, WindSpec

# How a position comes to be false; seeds take them in turn.
KINDS = ("followed", "resisted", "creeping", "one of two", "on restart")
MODES = ("by plan", "by headings", "held by order", "at rest")
_MODE_WEIGHTS = (6, 1, 1, 1)
NEAR_M, FAR_M = 20.0, 5000.0
SHORT_S, LONG_S = 5.0, 300.0
CREEPS_MPS = (0.2, 2.0)
ONTO = 0.5  # the share of the jumps that are aimed at something solid
SAILS_MPS = 1.8  # roughly, by which the boat is aimed from
ANSWER_S = 15.0  # an order is waited for so long
AFTER_S = 120.0  # of the voyage, when the position is right again
MODERATE_MPS = 4.0  # in less wind than this the same way takes longer
UNATTENDED = 0.06  # the share of voyages on which the companion may not set modes
LATEST_S = 170.0  # for a fault to begin
TURNS_S = 45.0, 90.0  # when a vane is turned: under way, on a voyage of two minutes
BESIDE = ("jump", "vane", "outlets", "card")  # what may be drawn beside the rest
BESIDE_SHARE = 0.5  # of the voyages, for each of them
BROKEN_SHARE = 0.5  # of the outlets


def turned_vane(rng: random.Random, at_s: float) -> SampledFault:
    """Turn the vane on its mast, or let a station write its offset: for good, or until somebody puts it right."""
    turned_deg = round(rng.choice((-1.0, 1.0)) * rng.choice((90.0, 180.0, rng.uniform(60.0, 180.0))), 1)
    for_s = rng.choice((None, length(rng, 60.0, 300.0)))
    if rng.random() < 0.5:
        return one(at_s=at_s, kind="vane", state="offset", value_deg=turned_deg, for_s=for_s)
    events = [EventSpec(at_s=at_s, kind="parameter", parameter="WNDVN_DIR_OFS", value=turned_deg)]
    if for_s is not None:
        events.append(EventSpec(at_s=round(at_s + for_s, 1), kind="parameter", parameter="WNDVN_DIR_OFS", value=0.0))
    return SampledFault(events=tuple(events))


def full_card(rng: random.Random, at_s: float) -> SampledFault:
    """Fill the card, or make it read-only: from the start or under way, for good or until it is well again."""
    return one(
        at_s=rng.choice((FIRST_S, at_s)),
        kind="disk",
        state=rng.choice(("full", "read_only")),
        for_s=rng.choice((None, length(rng, 5.0, 120.0))),
    )


def unattended(rng: random.Random) -> SampledFault:
    """The companion may not set modes: a person arms the boat and sets AUTO, now and then again, or does not."""
    times = [10.0, 20.0, 30.0, *sorted(round(rng.uniform(40.0, 250.0), 1) for _ in range(rng.choice((0, 1, 3))))]
    autos = tuple(EventSpec(at_s=t_s, kind="mode", mode="AUTO") for t_s in times)
    return SampledFault(events=(EventSpec(at_s=8.0, kind="arm"), *autos), changes={"set_auto": False})


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
    seed: int,
    base: Scenario,
    *,
    start_en: tuple[float, float],
    goal_en: tuple[float, float],
    solids_en: Sequence[tuple[float, float]],
) -> Jump:
    """Return the voyage of ``seed``: ``base`` in moderate wind, from start to goal among solids, by their middles."""
    rng = random.Random(f"jumps {seed}")
    kind = KINDS[seed % len(KINDS)]
    mode = rng.choices(MODES, weights=_MODE_WEIGHTS)[0]
    wind = WindSpec(
        model="ou",
        from_deg=round(rng.uniform(0.0, 360.0), 1),
        tws_mps=round(rng.uniform(3.5, 7.0), 2),
        sd_deg=round(rng.uniform(3.0, 10.0), 1),
    )
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
        at_s=at_s,
        kind="gps_jump",
        for_s=for_s,
        east_m=round(away[0], 1),
        north_m=round(away[1], 1),
        is_resisted=kind == "resisted",
        is_of_one=kind == "one of two",
        over_s=for_s if kind == "creeping" else 0.0,
    )
    events = [jump]
    if kind == "one of two":
        events.insert(0, EventSpec(at_s=FIRST_S, kind="gps_jump", is_of_one=True))
    if kind == "on restart":
        dead_s = length(rng, 2.0, 40.0)
        events.insert(
            0,
            EventSpec(
                at_s=round(at_s - rng.uniform(0.1, 0.9) * dead_s, 1), kind="kill_companion", restart_after_s=dead_s
            ),
        )
    if mode == "held by order":
        first_s = at_s if kind != "on restart" else events[0].at_s - ANSWER_S  # the companion lives to answer it
        events.append(EventSpec(at_s=round(first_s - rng.uniform(5.0, 20.0), 1), kind="order", order="hold"))
    headings: dict[str, dict[str, Any]] = {"skipper": {"guidance": "heading"}, "operator": {"guided": True}}
    tables = {"by headings": headings, "held by order": {"operator": {"orders": "all"}}}
    scenario = msgspec.structs.replace(
        base,
        wind=wind,
        is_service=True,
        limit_s=round(at_s + for_s + AFTER_S, 1),
        exit_on_arrival=mode != "at rest",
        events=tuple(sorted(events, key=lambda e: e.at_s)),
        expect=ExpectSpec(arrived=None, contacts=None, max_silence_s=None),
    )
    return Jump(
        scenario=scenario,
        kind=kind,
        mode=mode,
        size_m=size_m,
        for_s=for_s,
        variation=Variation(tables=tables[mode]) if mode in tables else None,
    )


def draw(seed: int, base: Scenario) -> Scenario:
    """Return ``base`` with the weather and the faults of ``seed``; its limit grows with what takes long."""
    return drawn_by(random.Random(f"faults {seed}"), base)


def draw_turned_vane(seed: int, base: Scenario) -> Scenario:
    """Return what ``draw`` returns, and a vane that is turned under way, by a lot of its own."""
    rng = random.Random(f"turned vane {seed}")
    return with_faults(draw(seed, base), [turned_vane(rng, round(rng.uniform(*TURNS_S), 1))])


def draw_beside(seed: int, drawn: Scenario, what: Sequence[str], jump: Jump) -> Scenario:
    """Return what ``draw`` drew, with trouble of ``what`` of ``BESIDE`` beside it, each by a lot of its own.

    Whether a seed has one of them, and which, does not depend on the others. ``jump`` is what ``draw_jump`` draws of
    it.
    """
    lots: list[SampledFault] = []
    for name in BESIDE:
        rng = random.Random(f"{name} beside {seed}")
        if name not in what or rng.random() >= BESIDE_SHARE:
            continue
        if name == "jump":
            events = tuple(e for e in jump.scenario.events if e.kind != "order")
            longer_s = max(0.0, jump.scenario.limit_s - drawn.limit_s)
            lots.append(
                SampledFault(
                    events=events,
                    longer_s=longer_s,
                    changes={"exit_on_arrival": drawn.exit_on_arrival and jump.scenario.exit_on_arrival},
                )
            )
        elif name == "vane":
            lots.append(turned_vane(rng, round(rng.uniform(*TURNS_S), 1)))
        elif name == "outlets":
            broken = tuple(o for o in get_args(Outlet) if rng.random() < BROKEN_SHARE)
            lots.append(SampledFault(changes={"broken": broken}))
        else:
            lots.append(full_card(rng, round(rng.uniform(3.0, LATEST_S), 1)))
    return with_faults(drawn, lots)


def drawn_by(rng: random.Random, base: Scenario) -> Scenario:
    """Return ``base`` with the weather and the faults that ``rng`` draws."""
    # moderate winds as often as all others together: in them the boat is where the faults are
    tws_mps = rng.choice((rng.uniform(3.5, 7.0), rng.uniform(2.0, 12.0)))
    wind = WindSpec(
        model="ou",
        from_deg=round(rng.uniform(0.0, 360.0), 1),
        tws_mps=round(tws_mps, 2),
        sd_deg=round(rng.uniform(3.0, 10.0), 1),
        tau_s=28.0,
        tws_sd_mps=round(rng.uniform(0.1, 0.6), 2),
    )
    lots: list[SampledFault] = [unattended(rng)] if rng.random() < UNATTENDED else []
    lots += sampled_faults(rng, LATEST_S)
    limit_s = base.limit_s * max(1.0, MODERATE_MPS / tws_mps)
    return with_faults(
        msgspec.structs.replace(
            base,
            wind=wind,
            is_service=True,
            has_ftp=rng.random() < 0.5,
            limit_s=limit_s,
            expect=ExpectSpec(arrived=None, contacts=None, max_silence_s=None),
        ),
        lots,
    )


def draw_planner(seed: int, base: Scenario) -> Scenario:
    """Return ``base`` with the weather of ``seed`` and two to four faults of the planner's process."""
    rng = random.Random(f"planner {seed}")
    wind = WindSpec(model="ou", from_deg=round(rng.uniform(0.0, 360.0), 1), tws_mps=round(rng.uniform(3.5, 7.0), 2))
    makers, weights = zip(*PLANNER, strict=True)
    events = [
        e
        for _ in range(rng.randint(2, 4))
        for e in rng.choices(makers, weights=weights)[0](rng, round(rng.uniform(3.0, 120.0), 1)).events
    ]
    return msgspec.structs.replace(
        base,
        wind=wind,
        events=tuple(sorted(events, key=lambda e: e.at_s)),
        is_service=True,
        expect=ExpectSpec(arrived=None, contacts=None, max_silence_s=None),
    )
