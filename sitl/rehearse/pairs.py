"""What a change is worth: the same seeds with it and without, held against each other by ``sitl.results``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from companion.words import counted
from sitl.rehearse.change import Change
from sitl.rehearse.voyage import CAMPAIGN
from sitl.results import Change as Difference
from sitl.results import Comparison, compare
from sitl.runner import Table, made_by

Record = Mapping[str, Any]
TOLD = ("arrived", "touched", "below floor", "time", "clearance")


def scaled(change: Difference) -> tuple[float, float, float]:
    """Return lower bound, change and upper bound as they are told: shares and ratios in percent."""
    one, scale = {"ratio": (1.0, 100.0), "share": (0.0, 100.0)}.get(change.measure.kind, (0.0, 1.0))
    low, middle, high = (scale * (value - one) for value in (change.low, change.change, change.high))
    return low, middle, high


def told_of(change: Difference) -> str:
    """Return a difference with its interval."""
    low, middle, high = scaled(change)
    unit = "%" if change.measure.kind in {"ratio", "share"} else change.measure.unit
    return f"{middle:+.1f} {unit} ({low:+.1f} to {high:+.1f})"


def is_sure(change: Difference) -> bool:
    """Whether the interval leaves no doubt which way it goes."""
    low, _, high = scaled(change)
    return low > 0.0 or high < 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Tried:
    """A change and what came of it."""

    change: Change
    comparison: Comparison

    def told(self) -> str:
        """Return it in a line."""
        words = [f"{change.measure.name} {told_of(change)}{'' if is_sure(change) else ', unsure'}"
                 for change in self.comparison.changes
                 if change.measure.name in TOLD and change.change != (change.measure.kind == "ratio")]
        return f"{self.change.told}, {counted(len(self.comparison.pairs), 'pair')}: " + (
            "; ".join(words) or "no difference")

    def to_dict(self) -> dict[str, Any]:
        """Return it for JSON."""
        return {"change": self.change.told, "name": self.change.name, "value": self.change.value,
                **self.comparison.to_dict()}


def tried(change: Change, before: Sequence[Record], after: Sequence[Record]) -> Tried:
    """Hold voyages with a change against those without; they are paired by their seeds."""
    return Tried(change=change, comparison=compare(_table(before), _table(after)))


def _table(records: Sequence[Record]) -> Table:
    return Table(campaign=CAMPAIGN, by=made_by(), keys=("seed",), rows=tuple(dict(record) for record in records))
