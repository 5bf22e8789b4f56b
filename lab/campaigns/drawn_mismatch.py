"""What a seed of the mismatch campaign is: a boat, a sea and sensors that are not the plan's, over one of the waters.

Each kind of mismatch is there in half of the voyages (``sitl.rehearse.mismatch_sampling``).
"""

from __future__ import annotations

import random
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec

from sitl.rehearse.mismatch_sampling import departing
from sitl.runner import SCENARIO_FOLDER
from sitl.scenario import ExpectSpec, Scenario, load_scenario

WATERS = tuple(
    SCENARIO_FOLDER / f"{name}.toml"
    for name in (
        "demo",
        "two-channels",
        "narrow-channel",
        "figures/block",
        "figures/slalom",
        "lee-shore",
        "faults/rocks",
        "gates",
        "gybing",
        "home",
        "upwind",
        "figures/two-channels-rough",
    )
)
LIMIT_S = 1500.0
MAX_SILENCE_S = 10.0
KINDS = (
    "gusts",
    "wind over the water",
    "current",
    "waves",
    "polar",
    "leeway",
    "tacks fail",
    "vane",
    "compass",
    "position",
)


@dataclass(frozen=True, slots=True, kw_only=True)
class SampledMismatch:
    """What a seed is.

    Attributes:
        source: the scenario's file.
        scenario: with what was drawn for it.
        kinds: what differs, by name.
    """

    source: Path
    scenario: Scenario
    kinds: tuple[str, ...]

    def to_dict(self) -> dict[str, Any]:
        """Return the tables that were drawn, in plain values that are not the default."""
        made = {name: getattr(self.scenario, name) for name in ("wind", "current", "waves", "boat", "sensors")}
        return {name: _differing(spec) for name, spec in made.items() if spec is not None}


def _differing(spec: msgspec.Struct) -> dict[str, Any]:
    plain = {f.name: f.default for f in msgspec.structs.fields(spec)}
    return {key: value for key, value in msgspec.to_builtins(spec).items() if value != plain[key]}


def draw(seed: int, *, only: tuple[str, ...] | None = None) -> SampledMismatch:
    """Return what a seed is; waters take turns, so that seeds in a row are sailed on all of them.

    ``only`` are kinds that every voyage has, and no others; empty, the control. The water and the mean wind of a seed
    are the same whatever it has.
    """
    return drawn_by(random.Random(f"mismatch {seed}"), WATERS[seed % len(WATERS)], only=only)


def drawn_by(rng: random.Random, source: Path, *, only: tuple[str, ...] | None = None) -> SampledMismatch:
    """Return what is drawn by ``rng`` over the water of a scenario's file; ``only`` as of ``draw``."""
    from sitl.run.embedded import mission_of

    scenario = load_scenario(source)
    wind = msgspec.structs.replace(scenario.wind, tws_mps=round(rng.uniform(3.5, 8.0), 3))
    drawn, kinds = departing(rng, msgspec.structs.replace(scenario, wind=wind), mission_of(scenario, source), only=only)
    return SampledMismatch(
        source=source,
        kinds=kinds,
        scenario=msgspec.structs.replace(
            drawn, limit_s=LIMIT_S, expect=ExpectSpec(arrived=None, max_silence_s=MAX_SILENCE_S)
        ),
    )
