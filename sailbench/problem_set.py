"""The problems and what is known of them: the best path and bound that any run found, or why there is none.

``problems/*.json`` are planning problems of docs/reference/problem-format.md: metres east and north, degrees clockwise
from true north, seconds, metres a second. ``answers.json`` says its units itself.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from companion.planner import Problem

FOLDER = Path(__file__).parent / "problems"
ANSWERS = Path(__file__).parent / "answers.json"


@dataclass(frozen=True, slots=True, kw_only=True)
class Known:
    """What is known of a problem: ``best_s`` by the exact scorer and no time below ``bound_s``; or ``proof``."""

    best_s: float | None = None
    bound_s: float | None = None
    waypoints_en: tuple[tuple[float, float], ...] = ()
    proof: str = ""  # why no path is feasible; empty: there is one


def problems(paths: Sequence[Path | str] = ()) -> list[Problem]:
    """Return the problems of these files, or all of the set by name. Raises InputError: one cannot be read."""
    return [Problem.from_json(path) for path in paths or sorted(FOLDER.glob("*.json"))]


@cache
def answers() -> dict[str, Known]:
    """Return what is known of the set, by the problem's id."""
    held = json.loads(ANSWERS.read_text(encoding="utf-8"))["answers"]
    return {
        name: Known(
            best_s=known.get("best_s"),
            bound_s=known.get("bound_s"),
            waypoints_en=tuple((east, north) for east, north in known.get("waypoints", ())),
            proof=known.get("proof", ""),
        )
        for name, known in held.items()
    }
