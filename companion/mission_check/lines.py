"""Lines of a mission that a margin leaves no room to cross: beyond the line, or before it."""

from __future__ import annotations

from collections.abc import Iterator

from companion.compose import voyage_of
from companion.geofence import Code, Finding, FindingLevel, Mission
from companion.skipper import Voyage
from companion.skipper.way import Approach, Gate, gates_of, no_room

NO_ROOM_REMEDY = "move both marks farther from it, or let [area] margin_m and margin_floor_m be smaller"


def line_findings(mission: Mission) -> Iterator[Finding]:
    """Yield a finding for each line that cannot be crossed with the margin."""
    for number, gate, words in crowded_lines(mission, mission.margin_m):
        floor_m = min(mission.margin_floor_m, mission.margin_m)
        room_m = max(0.0, float(voyage_of(mission).area.clearance_m([gate.en_m])[0]))
        less = "never sailed" if room_m < floor_m else "sailed with less margin, where she can at all"
        yield Finding(
            severity=FindingLevel.WARNING,
            code=Code.NARROW_GAP,
            place=f"[[goal]] {number}",
            text=f"{words}; it is {less} (margin_floor_m {floor_m:g})",
            remedy=NO_ROOM_REMEDY,
        )


def voyage_gates(mission: Mission) -> tuple[Voyage, tuple[tuple[int, Gate], ...]]:
    """Return the mission's voyage and its gates as they are approached from the start, each with its goal's number."""
    voyage = voyage_of(mission)
    begun = (Approach(goal=0, en_m=voyage.frame.en_from_geo(mission.start)),) if mission.start is not None else ()
    return voyage, tuple((gate.goal % len(voyage.goals) + 1, gate) for gate in gates_of(voyage, begun))


def crowded_lines(mission: Mission, margin_m: float) -> Iterator[tuple[int, Gate, str]]:
    """Yield the goal's number, the gate and the words of each line with no room by a margin, once a goal."""
    if all(goal.gate is None for goal in mission.goals):
        return
    told = set[int]()
    voyage, gates = voyage_gates(mission)
    for number, gate in gates:
        words = "" if number in told else no_room(gate, voyage.area, margin_m)
        if words:
            told.add(number)
            yield number, gate, words
