"""Gates: a voyage's goals and buoys as a row of places, each with the water that must not be crossed on the way.

A buoy becomes a few gates on a circle around it. On the way to each of them a barrier stands from the buoy
outwards on the wrong side, so that no plan, however it tacks, can leave the buoy on the wrong hand (Büsser 2009,
section 3.2.4: undesired areas are mapped as static obstacles).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import pairwise

from companion.geo.angles import difference_rad, wrap_pi
from companion.skipper.geometry import bearing_rad, distance_m, moved
from companion.skipper.voyage import Goal, PointEn, Side, Voyage

ARC_RAD = math.radians(100.0)       # gates around a buoy are at most this far apart
STRAIGHT_RAD = math.radians(60.0)   # a bend the other way up to this is passed with one gate, not with a loop
KEEP_SHARE = 0.5                    # the disc around the buoy that plans avoid, as a share of the rounding radius
BARRIER_M = 60.0                    # shortest barrier


@dataclass(frozen=True, slots=True, kw_only=True)
class Gate:
    """A place to pass: within ``radius_m`` of ``en_m``, coming from ``from_en_m`` (None: wherever the boat is).

    ``goal`` is the index into ``Voyage.legs``. ``keep_out`` are WKT polygons for the way here. For buoys
    ``buoy_en_m`` is the buoy and ``side`` where it is left. ``is_first`` and ``ends_goal`` mark the goal's first and
    last gate.
    """

    en_m: PointEn
    radius_m: float
    goal: int
    ends_goal: bool
    name: str
    from_en_m: PointEn | None
    bandwidth_m: float | None = None
    buoy_en_m: PointEn | None = None
    side: Side = Side.NONE
    is_first: bool = True
    keep_out: tuple[str, ...] = ()


def gates_of(voyage: Voyage) -> tuple[Gate, ...]:
    """Return the gates of all laps in order. Every buoy is something to keep clear of on every leg."""
    legs = voyage.legs
    discs = tuple(disc_wkt(g.en_m, KEEP_SHARE * g.rounding_m) for g in voyage.goals if g.side is not Side.NONE)
    out: list[Gate] = []
    for i, goal in enumerate(legs):
        before = legs[i - 1].en_m if i > 0 else voyage.home_en_m
        name = goal.name or f"goal {i + 1}"
        if goal.side is Side.NONE:
            out.append(Gate(
                en_m=goal.en_m, radius_m=goal.radius_m, goal=i, ends_goal=True, name=name, from_en_m=before,
                bandwidth_m=goal.bandwidth_m, keep_out=discs,
            ))
        else:
            after = legs[i + 1].en_m if i + 1 < len(legs) else None
            out.extend(
                replace(gate, keep_out=(*discs, *gate.keep_out)) for gate in _round(goal, i, name, before, after))
    return tuple(out)


def _round(goal: Goal, index: int, name: str, before: PointEn | None, after: PointEn | None) -> list[Gate]:
    """Return the gates that round a buoy.

    To port the boat turns left around it: on its circle it is a quarter turn to the right of the buoy, seen in
    the direction of travel, and its compass bearing from the buoy falls.
    """
    buoy = goal.en_m
    hand = 1.0 if goal.side is Side.PORT else -1.0
    way_out = bearing_rad(buoy, after) if after is not None and after != buoy else None
    way_in = bearing_rad(before, buoy) if before is not None and before != buoy else way_out
    if way_in is None:
        way_in = 0.0
    if way_out is None:
        way_out = way_in
    # How far the boat turns around the buoy: to the left for port. A small bend away needs no loop.
    turn = -hand * difference_rad(way_out, way_in)
    if turn < -STRAIGHT_RAD:
        turn += 2.0 * math.pi
    first = wrap_pi(way_in + hand * math.pi / 2.0)
    if turn <= math.radians(30.0):
        places = [wrap_pi(first - hand * turn / 2.0)]
    else:
        count = math.ceil(turn / ARC_RAD)
        places = [wrap_pi(first - hand * turn * n / count) for n in range(count + 1)]
    gates: list[Gate] = []
    previous: float | None = None
    for n, place in enumerate(places):
        if previous is None:
            wrong = wrap_pi(place + math.pi)
            length = max(BARRIER_M, 0.4 * distance_m(before, buoy)) if before is not None else BARRIER_M
        else:
            wrong = wrap_pi(previous + difference_rad(place, previous) / 2.0 + math.pi)
            length = BARRIER_M
        gates.append(Gate(
            en_m=moved(buoy, place, goal.rounding_m), radius_m=max(goal.radius_m, 0.4 * goal.rounding_m), goal=index,
            is_first=n == 0, ends_goal=n == len(places) - 1, name=name, from_en_m=before if n == 0 else None,
            bandwidth_m=goal.bandwidth_m if n == 0 else None, buoy_en_m=buoy, side=goal.side,
            keep_out=(barrier_wkt(buoy, wrong, length),),
        ))
        previous = place
    return gates


def disc_wkt(center: PointEn, radius_m: float, sides: int = 16) -> str:
    """Return a polygon around a disc."""
    r = radius_m / math.cos(math.pi / sides)
    ring = [moved(center, 2.0 * math.pi * n / sides, r) for n in range(sides)]
    return polygon_wkt(ring)


def barrier_wkt(foot: PointEn, direction_rad: float, length_m: float) -> str:
    """Return a thin wedge from ``foot`` outwards."""
    tip = moved(foot, direction_rad, length_m)
    wide = 0.5
    return polygon_wkt([foot, moved(tip, direction_rad + math.pi / 2.0, wide),
                        moved(tip, direction_rad - math.pi / 2.0, wide)])


def polygon_wkt(ring: list[PointEn]) -> str:
    """Return a ring of points as a WKT polygon."""
    closed = [*ring, ring[0]]
    return "POLYGON ((" + ", ".join(f"{e:.3f} {n:.3f}" for e, n in closed) + "))"


def passed_on(side: Side, track: list[PointEn], buoy: PointEn) -> bool:
    """Return whether the polyline goes past the buoy with it on ``side``: the sign of the angle it turns about it."""
    angle = 0.0
    for a, b in pairwise(track):
        angle += difference_rad(bearing_rad(buoy, b), bearing_rad(buoy, a))
    return angle < 0.0 if side is Side.PORT else angle > 0.0
