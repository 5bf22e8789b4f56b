"""Lines of a mission that a margin leaves no room to cross: beyond the line, or before it."""

from __future__ import annotations

from collections.abc import Iterator

from companion.compose import voyage_of
from companion.geofence import Code, Finding, FindingLevel, Mission
from companion.skipper import Voyage
from companion.skipper.way import Approach, Gate, gates_of, is_dead_end, no_room

NO_ROOM_REMEDY = "move both marks farther from it, or let [area] margin_m and margin_floor_m be smaller"


def line_findings(mission: Mission) -> Iterator[Finding]:
    """Yield a finding for each line that cannot be crossed with the margin."""
    never = set[int]()
    for number, gate, words in crowded_lines(mission, mission.margin_m):
        floor_m = min(mission.margin_floor_m, mission.margin_m)
        room_m = max(0.0, float(voyage_of(mission).area.clearance_m([gate.en_m])[0]))
        is_never = room_m < floor_m
        never |= {number} if is_never else set()
        less = "never sailed" if is_never else "sailed with less margin, where she can at all"
        yield Finding(
            severity=FindingLevel.ERROR if is_never else FindingLevel.WARNING,
            code=Code.NARROW_GAP,
            place=f"[[goal]] {number}",
            text=f"{words}; it is {less} (margin_floor_m {floor_m:g})",
            remedy=NO_ROOM_REMEDY,
        )
    yield from _dead_ends(mission, never)


def _dead_ends(mission: Mission, told: set[int]) -> Iterator[Finding]:
    """Yield the lines, but for ``told``, where she cannot turn beyond or before it: no plan's track keeps clear there.

    She sails at the best that the mission's wind gives her.
    """
    if all(goal.gate is None for goal in mission.goals):
        return
    voyage, gates = voyage_gates(mission)
    speed_mps, reach_m = voyage.boat.polar.max_speed_mps(mission.wind.preview_speed_mps), voyage.boat.hull.reach_m
    radius_m = speed_mps / voyage.boat.turn_rate_radps
    for number, gate in gates:
        if number in told or not is_dead_end(gate, voyage.area, radius_m=radius_m, reach_m=reach_m):
            continue
        told.add(number)
        near = voyage.area.nearest_name(gate.en_m) or "something"
        clear_m = max(0.0, float(voyage.area.clearance_m([gate.en_m])[0]))
        yield Finding(
            severity=FindingLevel.ERROR,
            code=Code.NARROW_GAP,
            place=f"[[goal]] {number}",
            text=f"{'before' if gate.is_before_line else 'beyond'} the line {gate.name} she is {clear_m:.1f} m from "
            f"{near} and cannot turn: at {speed_mps:.1f} m/s a turn is {2.0 * radius_m:.0f} m wide; it is never sailed",
            remedy="move both marks farther from it",
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
