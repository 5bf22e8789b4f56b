"""Findings: what is wrong, or worth knowing, about a fence, an obstacle file or a mission, and where."""

from __future__ import annotations

import enum
from dataclasses import dataclass

from companion.errors import InputError
from companion.words import one_line


class Severity(enum.Enum):
    """How bad a finding is."""

    ERROR = "error"        # the boat must not sail with it
    WARNING = "warning"    # it works, and someone should look
    NOTE = "note"          # what was done on the way


class Code(enum.Enum):
    """What a finding is about."""

    UNCLOSED = "unclosed ring"
    SELF_CROSSING = "self-crossing ring"
    EMPTY = "empty geometry"
    DEGENERATE = "degenerate geometry"
    SWAPPED_AXES = "swapped axes"
    WRONG_SRID = "wrong SRID"
    NOT_FINITE = "not a finite number"
    OUT_OF_RANGE = "out of range"
    FAR_AWAY = "far away"
    DISJOINT_INCLUSIONS = "inclusion zones that do not overlap"
    INTERSECTED_INCLUSIONS = "inclusion zones that the autopilot intersects"
    HOLE = "hole"
    TOO_MANY_ITEMS = "more items than the autopilot holds"
    START_OUTSIDE = "start outside"
    GOAL_OUTSIDE = "goal outside"
    UNREACHABLE = "no water between start and goal"
    ROUND_THE_WATER = "keep-out zone round the water"
    NARROW_GAP = "gap too narrow"
    ANTIMERIDIAN = "antimeridian"
    OBSTACLE_OUTSIDE_FENCE = "obstacle outside the fence"
    NOT_CARRIED = "not carried over"
    DROPPED = "dropped"
    EXPANDED = "expanded"
    FORMAT = "format"
    FIELD = "field"


@dataclass(frozen=True, slots=True, kw_only=True)
class Finding:
    """One thing found: ``place`` says where in the file (``line 3``, ``features[2]``), ``remedy`` what to do."""

    severity: Severity
    code: Code
    place: str
    text: str
    remedy: str = ""

    def line(self, source: str = "") -> str:
        """Return the finding as one line."""
        where = ": ".join(part for part in (source, self.place) if part)
        remedy = f"; {self.remedy}" if self.remedy else ""
        return one_line(f"{where}: {self.severity.value}: {self.text}{remedy}")

    def as_error(self, source: str) -> InputError:
        """Return the finding as the error that ends a command."""
        return InputError(source, self.place, self.text, self.remedy)


def require_clean(findings: tuple[Finding, ...], source: str) -> None:
    """Raise the first error among ``findings`` as InputError; pass when there is none."""
    for finding in findings:
        if finding.severity is Severity.ERROR:
            raise finding.as_error(source)
