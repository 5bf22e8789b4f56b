"""Draws the weather and the faults of a voyage from a seed."""

from __future__ import annotations

import random
from collections.abc import Sequence
from typing import get_args

import msgspec

from sitl.campaigns.failsafe_lots import FAILSAFES, unattended
from sitl.campaigns.fault_lots import LOTS, PLANNER, SINGLE, Lot, Maker, full_card, turned_vane
from sitl.campaigns.jump_draw import Jump
from sitl.scene import ExpectSpec, Outlet, Scenario, WindSpec

_MAKERS, _WEIGHTS = zip(*LOTS, *SINGLE, *FAILSAFES, strict=True)
_ONCE = frozenset(maker for maker, _ in (*SINGLE, *FAILSAFES))
MODERATE_MPS = 4.0      # in less wind than this the same way takes longer
UNATTENDED = 0.06       # the share of voyages on which the companion may not set modes
LATEST_S = 170.0        # for a fault to begin
TURNS_S = 45.0, 90.0    # when a vane is turned: under way, on a voyage of two minutes
BESIDE = ("jump", "vane", "outlets", "card")   # what may be drawn beside the rest
BESIDE_SHARE = 0.5      # of the voyages, for each of them
BROKEN_SHARE = 0.5      # of the outlets


def draw(seed: int, base: Scenario) -> Scenario:
    """Return ``base`` with the weather and the faults of ``seed``; its limit grows with what takes long."""
    return drawn_by(random.Random(f"faults {seed}"), base)


def draw_turned_vane(seed: int, base: Scenario) -> Scenario:
    """Return what ``draw`` returns, and a vane that is turned under way, by a lot of its own."""
    rng = random.Random(f"turned vane {seed}")
    return befallen(draw(seed, base), [turned_vane(rng, round(rng.uniform(*TURNS_S), 1))])


def draw_beside(seed: int, drawn: Scenario, what: Sequence[str], jump: Jump) -> Scenario:
    """Return what ``draw`` drew, with trouble of ``what`` of ``BESIDE`` beside it, each by a lot of its own.

    Whether a seed has one of them, and which, does not depend on the others. ``jump`` is what ``draw_jump`` draws of
    it.
    """
    lots: list[Lot] = []
    for name in BESIDE:
        rng = random.Random(f"{name} beside {seed}")
        if name not in what or rng.random() >= BESIDE_SHARE:
            continue
        if name == "jump":
            events = tuple(e for e in jump.scenario.events if e.kind != "order")
            longer_s = max(0.0, jump.scenario.limit_s - drawn.limit_s)
            lots.append(Lot(events=events, longer_s=longer_s,
                            changes={"exit_on_arrival": drawn.exit_on_arrival and jump.scenario.exit_on_arrival}))
        elif name == "vane":
            lots.append(turned_vane(rng, round(rng.uniform(*TURNS_S), 1)))
        elif name == "outlets":
            lots.append(Lot(changes={"broken": tuple(o for o in get_args(Outlet) if rng.random() < BROKEN_SHARE)}))
        else:
            lots.append(full_card(rng, round(rng.uniform(3.0, LATEST_S), 1)))
    return befallen(drawn, lots)


def drawn_by(rng: random.Random, base: Scenario) -> Scenario:
    """Return ``base`` with the weather and the faults that ``rng`` draws."""
    # moderate winds as often as all others together: in them the boat is where the faults are
    tws_mps = rng.choice((rng.uniform(3.5, 7.0), rng.uniform(2.0, 12.0)))
    wind = WindSpec(
        model="ou", from_deg=round(rng.uniform(0.0, 360.0), 1), tws_mps=round(tws_mps, 2),
        sd_deg=round(rng.uniform(3.0, 10.0), 1), tau_s=28.0, tws_sd_mps=round(rng.uniform(0.1, 0.6), 2),
    )
    lots: list[Lot] = [unattended(rng)] if rng.random() < UNATTENDED else []
    lots += drawn_lots(rng, LATEST_S)
    limit_s = base.limit_s * max(1.0, MODERATE_MPS / tws_mps)
    return befallen(
        msgspec.structs.replace(base, wind=wind, is_service=True, has_ftp=rng.random() < 0.5, limit_s=limit_s,
                                expect=ExpectSpec(arrived=None, contacts=None, max_silence_s=None)), lots)


def drawn_lots(rng: random.Random, latest_s: float) -> list[Lot]:
    """Return one to five lots of trouble, each of which begins by ``latest_s``."""
    lots: list[Lot] = []
    drawn: set[Maker] = set()
    for _ in range(rng.choice((1, 1, 2, 2, 3, 4, 5))):
        maker = rng.choices(_MAKERS, weights=_WEIGHTS)[0]
        if maker in _ONCE & drawn:
            continue
        drawn.add(maker)
        lots.append(maker(rng, round(rng.uniform(3.0, latest_s), 1)))
    return lots


def befallen(base: Scenario, lots: Sequence[Lot]) -> Scenario:
    """Return a scenario in which the lots befall the boat; its limit grows with what takes long."""
    events = [*base.events, *(event for lot in lots for event in lot.events)]
    changes = {key: value for lot in lots for key, value in lot.changes.items()}
    parameters = {key: value for lot in lots for key, value in lot.parameters.items()}
    return msgspec.structs.replace(
        base, events=tuple(sorted(events, key=lambda e: e.at_s)), parameters={**base.parameters, **parameters},
        limit_s=round(base.limit_s + sum(lot.longer_s for lot in lots), 1), **changes)


def draw_planner(seed: int, base: Scenario) -> Scenario:
    """Return ``base`` with the weather of ``seed`` and two to four faults of the planner's process."""
    rng = random.Random(f"planner {seed}")
    wind = WindSpec(model="ou", from_deg=round(rng.uniform(0.0, 360.0), 1), tws_mps=round(rng.uniform(3.5, 7.0), 2))
    makers, weights = zip(*PLANNER, strict=True)
    events = [e for _ in range(rng.randint(2, 4))
              for e in rng.choices(makers, weights=weights)[0](rng, round(rng.uniform(3.0, 120.0), 1)).events]
    return msgspec.structs.replace(
        base, wind=wind, events=tuple(sorted(events, key=lambda e: e.at_s)), is_service=True,
        expect=ExpectSpec(arrived=None, contacts=None, max_silence_s=None))
