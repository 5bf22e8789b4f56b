"""The planned passage beside a mission, read once: what a page draws of it."""

from __future__ import annotations

from pathlib import Path

from companion.disk import read_regular
from companion.errors import unreadable
from companion.view.passage import MOST_BYTES, PlannedPassage, parse_planned, planned_beside


def read_planned(mission: Path) -> PlannedPassage | None:
    """Return the passage that a mission was planned as; None: there is none beside it. Raises InputError."""
    path = planned_beside(mission)
    if not path.exists():
        return None
    try:
        data = read_regular(path, MOST_BYTES + 1)
    except OSError as error:
        raise unreadable(str(path), error, "the planned passage") from error
    return parse_planned(data, str(path))
