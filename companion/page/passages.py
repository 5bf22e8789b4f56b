"""A planned passage, read once: what a page draws of it."""

from __future__ import annotations

from pathlib import Path

from companion.disk import read_regular
from companion.errors import unreadable
from companion.geofence.mission import MOST_PASSAGE_BYTES, planned_beside
from companion.view.passage import PlannedPassage, parse_planned


def read_planned(mission: Path) -> PlannedPassage | None:
    """Return the passage that a mission was planned as; None: there is none beside it. Raises InputError."""
    path = planned_beside(mission)
    return read_passage(path) if path.exists() else None


def read_passage(path: Path) -> PlannedPassage:
    """Return the planned passage of a file. Raises InputError."""
    try:
        data = read_regular(path, MOST_PASSAGE_BYTES + 1)
    except OSError as error:
        raise unreadable(str(path), error, "the planned passage") from error
    return parse_planned(data, str(path))
