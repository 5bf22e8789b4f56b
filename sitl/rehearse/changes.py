"""Changes that may help: a key of the mission, a parameter, a later hour; and what each is worth by paired seeds."""

from __future__ import annotations

import datetime as dt
import difflib
from argparse import ArgumentTypeError
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import msgspec

from companion.boat import AutopilotLimits
from companion.errors import InputError
from companion.geofence import Mission
from companion.mission_check import require_sailable
from companion.program.arguments import duration
from companion.words import counted, expected
from sitl.results import Comparison, compare
from sitl.results import FigureChange as Difference
from sitl.run.variation import Variation
from sitl.runner import Table, made_by
from sitl.scenario import Scenario

CAMPAIGN = "rehearse"
TABLES = {"margin_m": "area", "delta_s": "risk"}
CORRIDOR = "SAIL_XTRACK_MAX"
LATER = "later"
_REMEDY = f"write {', '.join(f'{name}=NUMBER' for name in (*TABLES, CORRIDOR))} or {LATER}=1h"


@dataclass(frozen=True, slots=True, kw_only=True)
class MissionChange:
    """One thing that is otherwise: ``name`` of it, ``value`` in its own unit (of ``later`` seconds)."""

    name: str
    value: float
    told: str

    def scenario(self, scenario: Scenario) -> Scenario:
        """Return a scenario so changed; what the mission says is changed by ``variation``."""
        if self.name == CORRIDOR:
            return msgspec.structs.replace(scenario, parameters={**scenario.parameters, CORRIDOR: self.value})
        if self.name != LATER:
            return scenario
        current = scenario.current and msgspec.structs.replace(
            scenario.current, tide_high_s=scenario.current.tide_high_s - self.value
        )
        return msgspec.structs.replace(
            scenario,
            begins=scenario.begins + dt.timedelta(seconds=self.value),
            current=current,
            wind=msgspec.structs.replace(scenario.wind, from_s=scenario.wind.from_s + self.value),
        )

    @property
    def variation(self) -> Variation | None:
        """What is another in the mission."""
        return Variation(tables={TABLES[self.name]: {self.name: self.value}}) if self.name in TABLES else None


def change_of(text: str, mission: Mission) -> MissionChange:
    """Return the change that ``--try`` says: ``margin_m=20``, ``delta_s=0.95``, ``SAIL_XTRACK_MAX=5``, ``later=1h``.

    Raises:
        InputError: there is no such thing to change, or the mission cannot be sailed with it.
    """
    name, _, value = text.partition("=")
    try:
        number = duration(value) if name == LATER else float(value)
    except (ArgumentTypeError, ValueError):
        raise InputError("--try", text, "is not a change that is known", _REMEDY) from None
    known = (*TABLES, CORRIDOR, LATER)
    near = difflib.get_close_matches(name, known, n=1)
    if name not in known and near:
        raise InputError("--try", text, f"{name!r} is no change that is known", f"did you mean {near[0]}?")
    if name not in known or (name == CORRIDOR and not 0.0 <= number <= 1000.0):
        raise InputError("--try", text, "is not a change that is known", _REMEDY)
    change = MissionChange(name=name, value=number, told=f"{value} {LATER}" if name == LATER else f"{name} {number:g}")
    if change.variation is not None:
        plain = msgspec.to_builtins(mission.options)
        plain[TABLES[name]][name] = number
        try:
            msgspec.convert(plain[TABLES[name]], type(getattr(mission.options, TABLES[name])))
        except msgspec.ValidationError as error:
            raise InputError("--try", text, expected(str(error).partition(" - at ")[0]), _REMEDY) from None
        require_sailable(change.variation.mission(mission))
    return change


def usual(mission: Mission, *, tells_the_hour: bool) -> list[MissionChange]:
    """Return what a crew would think of first; ``tells_the_hour`` is whether the hour makes a difference at all."""
    margin_m, delta_s, corridor_m = mission.margin_m, mission.risk.delta_s, AutopilotLimits().sail_xtrack_max_m
    less_m = max(mission.margin_floor_m, round(margin_m / 1.5, 1))
    wanted = [
        f"margin_m={round(1.5 * margin_m, 1):g}",
        *([f"margin_m={less_m:g}"] if less_m < margin_m else []),
        f"delta_s={round(0.5 * (1.0 + delta_s), 3):g}",
        *([f"delta_s={round(delta_s - 0.1, 3):g}"] if delta_s >= 0.6 else []),
        f"{CORRIDOR}={0.5 * corridor_m:g}",
        f"{CORRIDOR}={2.0 * corridor_m:g}",
        *([f"{LATER}=1h"] if tells_the_hour else []),
    ]
    found = []
    for text in wanted:
        try:
            found.append(change_of(text, mission))
        except InputError:  # a margin that closes the water, say: nothing to try
            continue
    return found


Record = Mapping[str, Any]
TOLD = ("arrived", "touched", "below floor", "time", "clearance")
FEWEST = 6  # pairs: of fewer not even all of one sign are more than luck, at 95 %


def scaled(change: Difference) -> tuple[float, float, float]:
    """Return lower bound, change and upper bound as they are told: shares and ratios in percent."""
    one, scale = {"ratio": (1.0, 100.0), "share": (0.0, 100.0)}.get(change.measure.kind, (0.0, 1.0))
    low, middle, high = (scale * (value - one) for value in (change.low, change.change, change.high))
    return low, middle, high


def difference_text(change: Difference) -> str:
    """Return a difference with its interval."""
    low, middle, high = scaled(change)
    unit = "%" if change.measure.kind in {"ratio", "share"} else change.measure.unit
    interval = "too few for an interval" if change.pairs < FEWEST else f"{low:+.1f} to {high:+.1f}"
    return f"{middle:+.1f} {unit} ({interval})"


def is_sure(change: Difference) -> bool:
    """Whether the interval leaves no doubt which way it goes."""
    low, _, high = scaled(change)
    return change.pairs >= FEWEST and (low > 0.0 or high < 0.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class Tried:
    """A change and what came of it."""

    change: MissionChange
    comparison: Comparison

    def as_text(self) -> str:
        """Return it in a line."""
        words = [
            f"{change.measure.name} {difference_text(change)}{'' if is_sure(change) else ', unsure'}"
            for change in self.comparison.changes
            if change.measure.name in TOLD and change.change != (change.measure.kind == "ratio")
        ]
        return f"{self.change.told}, {counted(len(self.comparison.pairs), 'pair')}: " + (
            "; ".join(words) or "no difference"
        )

    def to_dict(self) -> dict[str, Any]:
        """Return it for JSON."""
        return {
            "change": self.change.told,
            "name": self.change.name,
            "value": self.change.value,
            **self.comparison.to_dict(),
        }


def tried(change: MissionChange, before: Sequence[Record], after: Sequence[Record]) -> Tried:
    """Hold voyages with a change against those without; they are paired by their seeds."""
    return Tried(change=change, comparison=compare(_table(before), _table(after)))


def _table(records: Sequence[Record]) -> Table:
    return Table(campaign=CAMPAIGN, by=made_by(), keys=("seed",), rows=tuple(dict(record) for record in records))
