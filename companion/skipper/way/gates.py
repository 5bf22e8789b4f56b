"""Gates: a voyage's goals and buoys as a row of places, each with the water that must not be crossed on the way.

A buoy becomes a few gates on a circle around it. On the way to each of them a barrier stands from the buoy
outwards on the wrong side, so that no plan, however it tacks, can leave the buoy on the wrong hand (Büsser 2009,
section 3.2.4: undesired areas are mapped as static obstacles).

Whether the buoy was left on its hand is judged as with a string along the track: the boat's bearing from the buoy,
counted on from the place where the approach began. On the wrong hand it is a whole turn short, and the buoy is
approached again, from where the boat is, with that turn added.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import pairwise

from companion.geo.angles import difference_rad, wrap_pi
from companion.skipper.way.geometry import Barrier, Mark, barrier, bearing_rad, distance_m, has_way_out, moved
from companion.skipper.way.line import (
    BEFORE_M,
    STRAY_M,
    ahead_m,
    course_rad,
    crossing,
    crossing_en,
    foot_en,
    no_room_words,
    place_before,
    place_beyond,
    wings,
)
from companion.skipper.way.sweeps import Sweep
from companion.skipper.way.voyage import AreaLike, Box, Composed, Goal, Line, PointEn, Search, Side, Voyage

# Gates around a buoy are at most this far apart. The chord between two keeps clear of it (``KEEP_SHARE``); a chain of
# shorter ones is sailed in a loop: she overtakes the point that is led along it, and turns back to it over the buoy.
ARC_RAD = math.radians(115.0)
STRAIGHT_RAD = math.radians(60.0)  # a bend the other way up to this is passed with one gate, not with a loop
SHORT_RAD = math.radians(30.0)  # the autopilot cuts corners: a gate counts this much short of it, going on round
PAST_RAD = math.radians(60.0)  # the last gate of a buoy that nothing leads on from lies so far past abeam
KEEP_SHARE = 0.5  # the disc around the buoy that plans avoid, as a share of the rounding radius
SAME_M = 1.0  # two goals so near are one mark that is passed twice
BARRIER_M = 60.0  # shortest barrier
SWEEP_RADIUS_M = 7.0  # the autopilot leaves a sweep's end 3 to 5 m before it
BOX_RADIUS_M = 8.0  # its loiter lies this near to a box's roomiest place, and nearer as it is planned


@dataclass(frozen=True, slots=True, kw_only=True)
class Approach:
    """Where the way to a goal began, when that is not the goal before: at the start, and again after a miss.

    ``goal`` is the index into ``Voyage.legs``. ``turn_rad`` is how far the boat still has to turn around the buoy,
    positive to the buoy's hand; None: as the courses to it and away from it ask for. ``sweeps`` are what is left to be
    sailed of a search, laid for the wind ``twd_from_rad`` and for the ``round``-th time, 0: not yet.
    """

    goal: int
    en_m: PointEn
    turn_rad: float | None = None
    sweeps: tuple[Sweep, ...] = ()
    twd_from_rad: float = 0.0
    round: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class Gate:
    """A place to pass: within ``radius_m`` of ``en_m``, coming from ``from_en_m`` (None: wherever the boat is).

    ``goal`` is the index into ``Voyage.legs``. ``keep_out`` is what stands in the way here alone, besides the
    marks' own discs. For buoys ``buoy_en_m`` is the buoy and ``side`` where it is left; ``turn_rad`` is how far its
    rounding turns the boat, and ``bearing_rad`` how far the boat's bearing from the buoy has come round by this
    gate, counted from the approach's beginning, positive clockwise; short of it by more than ``short_rad`` the
    goal's last gate does not count. ``is_first`` and ``ends_goal`` mark the goal's first and last gate. With
    ``line`` it is a place beyond the line, which is crossed on the way; with ``is_before_line`` too, the place
    before it. With ``box`` it is where it stays. With ``search`` it is an end of a ``sweep`` (which, of how many),
    or, before there are any, of none. With ``field`` it is steered by that, and it is where the mission on board
    leads meanwhile.
    """

    en_m: PointEn
    radius_m: float
    goal: int
    ends_goal: bool
    name: str
    from_en_m: PointEn | None
    bandwidth_m: float | None = None
    heading_rad: float | None = None
    buoy_en_m: PointEn | None = None
    approach_en_m: PointEn | None = None
    side: Side = Side.NONE
    turn_rad: float = 0.0
    bearing_rad: float = 0.0
    short_rad: float = SHORT_RAD
    is_first: bool = True
    keep_out: tuple[Barrier, ...] = ()
    line: Line | None = None
    is_before_line: bool = False
    box: Box | None = None
    search: Search | None = None
    sweep: tuple[int, int] = (0, 0)
    field: Composed | None = None

    @property
    def is_crossed(self) -> bool:
        """Whether it is passed by crossing its line, and not by coming near."""
        return self.line is not None and not self.is_before_line

    @property
    def is_plain(self) -> bool:
        """Whether it is a place that is passed by coming within its radius, from any side."""
        return self.buoy_en_m is None and not (self.line or self.box or self.search or self.field)


def gates_of(voyage: Voyage, approaches: Sequence[Approach] = ()) -> tuple[Gate, ...]:
    """Return the gates of all laps in order. Every buoy is something to keep clear of on every leg.

    ``approaches`` says where the way to a goal began; the last one that names a goal counts. How many they are does not
    depend on the water, where they lie does.
    """
    return _gates_of(voyage, voyage.area, tuple(approaches))


@lru_cache(maxsize=8)  # asked for at every step, and the same until a buoy is missed or other water is closed
def _gates_of(voyage: Voyage, area: AreaLike, approaches: tuple[Approach, ...]) -> tuple[Gate, ...]:
    legs = voyage.legs
    begun = {a.goal: a for a in approaches}
    out: list[Gate] = []
    before: PointEn | None = None
    for i, goal in enumerate(legs):
        approach = begun.get(i)
        is_once_more = approach is None and i > 0 and legs[i - 1].en_m == goal.en_m
        if approach is not None:
            before = approach.en_m
        elif i > 0 and not is_once_more:
            before = legs[i - 1].en_m
        name = _name(goal, i)
        after = legs[i + 1].en_m if i + 1 < len(legs) else voyage.onward_en_m
        began = len(out)
        if goal.line is not None:
            out.extend(_cross(goal, i, name, None if is_once_more else before, after, area, _other_marks(voyage, goal)))
        elif goal.search is not None and approach is not None and approach.round > 0:
            out.extend(_sweep(goal, i, name, approach))
        elif goal.side is Side.NONE:
            out.append(
                Gate(
                    en_m=goal.en_m,
                    radius_m=goal.radius_m if goal.box is None else BOX_RADIUS_M,
                    goal=i,
                    ends_goal=True,
                    name=name,
                    from_en_m=before,
                    bandwidth_m=goal.bandwidth_m,
                    heading_rad=goal.heading_rad,
                    box=goal.box,
                    search=goal.search,
                    field=goal.field,
                )
            )
        else:
            turn_rad = approach.turn_rad if approach is not None else None
            out.extend(_round(goal, i, name, before, after, turn_rad, is_once_more=is_once_more))
        if i > 0 and approach is None and legs[i - 1].side is not Side.NONE and not is_once_more and began < len(out):
            # Led back behind the buoy that she has just rounded she would unwind what she has turned about it.
            buoy = legs[i - 1].en_m
            behind = barrier(
                buoy, bearing_rad(goal.en_m, buoy), BARRIER_M, f"the wrong side of {_name(legs[i - 1], i - 1)}"
            )
            out[began] = replace(out[began], keep_out=(*out[began].keep_out, behind))
    return tuple(out)


def _name(goal: Goal, index: int) -> str:
    """Return what the ``index``-th leg's goal is called in sentences."""
    return goal.name or f"goal {index + 1}"


def no_room(gate: Gate, area: AreaLike, margin_m: float) -> str:
    """Return why a gate of a line has no room by a margin, in words of the line; empty: it has, or is of none."""
    return "" if gate.line is None else no_room_words(gate.line, gate.name, gate.en_m, area, margin_m)


def is_dead_end(gate: Gate, area: AreaLike, *, radius_m: float, reach_m: float) -> bool:
    """Return whether a hull that comes to the place beyond or before a line cannot turn away there, nor sail on.

    Beyond the line it comes on the line's course, before it, from behind the line, the other way about.
    """
    if gate.line is None:
        return False
    course = course_rad(gate.line) + (math.pi if gate.is_before_line else 0.0)
    return not has_way_out(area, gate.en_m, course, radius_m=radius_m, reach_m=reach_m)


def marks_of(voyage: Voyage, stray_m: float = STRAY_M) -> tuple[Mark, ...]:
    """Return every mark of the voyage: buoys, and the ends of lines.

    ``stray_m`` is what is added about a line's marks, for a track that strays from its leg.
    """
    out: list[Mark] = []
    for goal in voyage.goals:
        if goal.line is not None:
            name = f"a mark of {goal.name}" if goal.name else "a mark"
            ends = (goal.line.port_en_m, goal.line.starboard_en_m)
            out += [Mark(end, goal.line.keep_m + stray_m, name) for end in ends]
        elif goal.side is not Side.NONE:
            out.append(
                Mark(goal.en_m, KEEP_SHARE * goal.rounding_m, f"the buoy {goal.name}" if goal.name else "a mark")
            )
    return tuple(out)


def _sweep(goal: Goal, index: int, name: str, approach: Approach) -> list[Gate]:
    """Return the gates that search an area: both ends of each sweep."""
    count = len(approach.sweeps)
    return [
        Gate(
            en_m=end,
            radius_m=SWEEP_RADIUS_M,
            goal=index,
            is_first=n == 0 and k == 0,
            name=name,
            from_en_m=None,
            ends_goal=n == count - 1 and k == 1,
            search=goal.search,
            sweep=(n + 1, count),
        )
        for n, sweep in enumerate(approach.sweeps)
        for k, end in enumerate(sweep)
    ]


def _other_marks(voyage: Voyage, goal: Goal) -> list[Mark]:
    """Return the marks of all goals but a line's own."""
    own = () if goal.line is None else (goal.line.port_en_m, goal.line.starboard_en_m)
    return [mark for mark in marks_of(voyage) if mark.en_m not in own]


def _cross(
    goal: Goal,
    index: int,
    name: str,
    before: PointEn | None,
    after: PointEn | None,
    area: AreaLike,
    marks: Sequence[Mark],
) -> list[Gate]:
    """Return the gates that cross a line: a place beyond it, and one before it where the way begins elsewhere."""
    line = goal.line
    assert line is not None
    way_m = 0.0 if before is None else distance_m(before, goal.en_m)
    place, radius_m = place_beyond(line, crossing_en(line, before, after), area, marks)
    to = Gate(
        en_m=place,
        radius_m=radius_m,
        goal=index,
        ends_goal=True,
        name=name,
        from_en_m=before,
        bandwidth_m=goal.bandwidth_m,
        keep_out=wings(line, area, way_m, name),
        line=line,
    )
    if before is not None and ahead_m(line, before) <= -0.5 * BEFORE_M:
        return [to]
    place, radius_m = place_before(line, foot_en(line, place), area, marks)
    return [
        replace(to, en_m=place, radius_m=radius_m, ends_goal=False, keep_out=(), is_before_line=True),
        replace(to, from_en_m=place, is_first=False),
    ]


def _round(
    goal: Goal,
    index: int,
    name: str,
    before: PointEn | None,
    after: PointEn | None,
    turn_rad: float | None,
    *,
    is_once_more: bool,
) -> list[Gate]:
    """Return the gates that round a buoy.

    To port the boat turns left around it: on its circle it is a quarter turn to the right of the buoy, seen in
    the direction of travel, and its compass bearing from the buoy falls. A buoy that has just been rounded
    (``is_once_more``) is rounded by a whole turn. Where no leg leads on from it (``after`` is None) a last gate past
    abeam does: turned to the mission's loiter before she is abeam of it, she has left it on neither hand.
    """
    buoy = goal.en_m
    hand = 1.0 if goal.side is Side.PORT else -1.0
    way_out = bearing_rad(buoy, after) if after is not None and after != buoy else None
    way_in = bearing_rad(before, buoy) if before is not None and before != buoy else way_out
    if way_in is None:
        way_in = 0.0
    if way_out is None:
        way_out = way_in
    turn = turn_rad
    if turn is None:
        # How far the boat turns around the buoy: to the left for port. A small bend away needs no loop.
        turn = -hand * difference_rad(way_out, way_in)
        if turn < -STRAIGHT_RAD or is_once_more:
            turn += 2.0 * math.pi
    # How much of the turn is done at each gate; the first is abeam of the buoy on the way in.
    count = math.ceil(turn / ARC_RAD)
    turned = [0.5 * turn] if turn <= math.radians(30.0) else [n / count * turn for n in range(count + 1)]
    if after is None:
        turned.append(turned[-1] + PAST_RAD)
    gates: list[Gate] = []
    previous: float | None = None
    for n, so_far in enumerate(turned):
        place = wrap_pi(way_in + hand * (math.pi / 2.0 - so_far))
        is_last = n == len(turned) - 1
        if previous is None:
            wrong = wrap_pi(place + math.pi)
            length = max(BARRIER_M, 0.4 * distance_m(before, buoy)) if before is not None else BARRIER_M
        else:
            wrong = wrap_pi(previous + difference_rad(place, previous) / 2.0 + math.pi)
            length = BARRIER_M
        gates.append(
            Gate(
                en_m=moved(buoy, place, goal.rounding_m),
                radius_m=max(goal.radius_m, 0.4 * goal.rounding_m),
                goal=index,
                is_first=n == 0,
                ends_goal=is_last,
                name=name,
                from_en_m=before if n == 0 else None,
                bandwidth_m=goal.bandwidth_m if n == 0 else None,
                heading_rad=goal.heading_rad if n == 0 else None,
                buoy_en_m=buoy,
                approach_en_m=before,
                side=goal.side,
                turn_rad=turn,
                bearing_rad=-hand * (math.pi / 2.0 + so_far),
                short_rad=PAST_RAD if is_last and after is None else SHORT_RAD,
                keep_out=(barrier(buoy, wrong, length, f"the wrong side of {name}"),),
            )
        )
        previous = place
    return gates


def bearing_on(gate: Gate, boat: PointEn, last_rad: float) -> float:
    """Return how far the boat's bearing from the gate's buoy has come round since the approach began [rad].

    Positive clockwise and not wrapped: the turn nearest to ``last_rad``, that of the fix before. 0 without a buoy.
    """
    if gate.buoy_en_m is None or gate.approach_en_m is None:
        return 0.0
    since = difference_rad(bearing_rad(gate.buoy_en_m, boat), bearing_rad(gate.buoy_en_m, gate.approach_en_m))
    return last_rad + wrap_pi(since - last_rad)


def is_on_wrong_side(gate: Gate, bearing: float) -> bool:
    """Return whether a boat at the gate that came round the buoy by ``bearing`` [rad] left it on the wrong hand.

    On the right hand it has come round as far as the gate has, or further; on the wrong hand a whole turn less.
    """
    if gate.approach_en_m is None or gate.side is Side.NONE:
        return False
    return _short_rad(gate, bearing) > math.pi


def has_come_round(gate: Gate, bearing: float, *, spare_rad: float = 0.0) -> bool:
    """Return whether a boat that came round the buoy by ``bearing`` [rad] is as far round as the gate asks for.

    Being near is not enough: a gate's radius reaches to the buoy, on a wide approach before she is abeam of it, and the
    autopilot's count far beyond. At a gate before the goal's last, half a turn short of it is the wrong hand, no less.
    """
    if gate.approach_en_m is None or gate.side is Side.NONE:
        return True
    return _short_rad(gate, bearing) <= (gate.short_rad + spare_rad if gate.ends_goal else math.pi)


def _short_rad(gate: Gate, bearing: float) -> float:
    """Return how far a boat that came round by ``bearing`` is short of the gate round its buoy [rad]."""
    return (bearing - gate.bearing_rad) * (1.0 if gate.side is Side.PORT else -1.0)


def astray(gate: Gate, way: Sequence[PointEn], bearing: float) -> str:
    """Return why a way to a gate does not do what the gate is for, in words; empty: it does.

    Wings and barriers end somewhere, and where there is no way between the marks the shortest is round their ends.
    ``bearing`` [rad] is how far the boat has come round the gate's buoy where the way begins.
    """
    if gate.is_crossed and gate.line is not None:
        found = (crossing(gate.line, a, b) for a, b in pairwise(way))
        return "" if any(f is not None and f.is_forward for f in found) else f"round the outside of {gate.name} only"
    bearing = bearing_on(gate, way[0], bearing)
    if is_on_wrong_side(gate, bearing_on(gate, gate.en_m, bearing)):
        return ""  # she was carried round it already: what is missed is said at the gate, and begun anew
    for place in way[1:]:
        bearing = bearing_on(gate, place, bearing)
    return f"with {gate.name} on the wrong side only" if is_on_wrong_side(gate, bearing) else ""


def again(gate: Gate, boat: PointEn, bearing: float) -> Approach:
    """Return the approach from the boat's place that makes good what was turned the wrong way round the gate's buoy."""
    astray = bearing if gate.side is Side.PORT else -bearing
    # A boat that circled the buoy the wrong way while it waited need not circle it back as often.
    return Approach(goal=gate.goal, en_m=boat, turn_rad=gate.turn_rad + min(astray, astray % (2.0 * math.pi)))
