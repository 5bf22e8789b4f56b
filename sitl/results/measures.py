"""What voyages are measured by: which way is worse, and from how much on it is worth a word."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Literal

Row = Mapping[str, Any]


@dataclass(frozen=True, slots=True, kw_only=True)
class Measure:
    """A figure of a voyage. ``worse`` is the sign of a change for the worse, 0 where neither way is.

    A ``share`` is of voyages, of 0 and 1; a ``ratio`` is the geometric mean of the pairs' ratios; a ``difference`` the
    mean of theirs. Less than ``least`` is no worsening, however sure.
    """

    name: str
    of: Callable[[Row], float | None]
    kind: Literal["share", "ratio", "difference"]
    worse: int
    least: float = 0.0
    unit: str = ""


def _number(name: str, *others: str) -> Callable[[Row], float | None]:
    def read(row: Row) -> float | None:
        found = next((row[n] for n in (name, *others) if row.get(n) is not None), None)
        return float(found) if isinstance(found, int | float) else None

    return read


def _time_s(row: Row) -> float | None:
    value = row.get("time_s")
    return float(value) if row.get("arrived") and isinstance(value, int | float) and value > 0.0 else None


def _touched(row: Row) -> float | None:
    """Return whether something was touched: contacts are counted, or listed (as JSON)."""
    value = row.get("contacts")
    return None if value is None else float(value not in {0, "[]"})


# Of a boat that did as well as before, one voyage's time is within a per cent, its clearance within a hand's breadth.
MEASURES = (
    Measure(name="passed", of=_number("passed"), kind="share", worse=-1),
    Measure(name="touched", of=_touched, kind="share", worse=1),
    Measure(name="below floor", of=_number("below_floor"), kind="share", worse=1),
    Measure(name="arrived", of=_number("arrived"), kind="share", worse=-1),
    Measure(name="time", of=_time_s, kind="ratio", worse=1, least=0.005),
    Measure(name="clearance", of=_number("min_clearance_m", "clearance_m"), kind="difference", worse=-1, least=0.25,
            unit="m"),
    Measure(name="silence", of=_number("silence_s"), kind="difference", worse=1, least=0.5, unit="s"),
    Measure(name="tacks", of=_number("tacks"), kind="difference", worse=0),
    Measure(name="replans", of=_number("replans"), kind="difference", worse=0),
)
