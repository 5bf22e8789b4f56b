"""Missions: from planned waypoints to items, the splice into the mission that sails, and the safe end.

Index i of a route is mission item seq i + 1 (home is item 0 and belongs to the autopilot). Numbering is fixed: a
replan keeps the items up to the present target, so "same index" means the same place to the autopilot whatever
happens in the middle of the transfer.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from companion.geo.angles import difference_rad
from companion.messages import ENDING, Command, MissionItem, sailed_part, waypoint
from companion.skipper.step.config import SkipperConfig
from companion.skipper.step.route import Route
from companion.skipper.way import PointEn, Voyage, bearing_rad, distance_m, moved, water_at
from companion.skipper.way.drift import floor_from_m
from companion.skipper.way.gates import marks_of
from companion.skipper.way.geometry import Mark, leg_distance_m
from companion.skipper.way.shortest import way_m
from companion.skipper.way.voyage import AreaLike, water_to_keep

LOOKS = 41  # places looked at along a line that leads through something


def fingerprint(items: Sequence[MissionItem]) -> tuple[tuple[int, int, int], ...]:
    """Return what two missions must share to be the same to the boat: command and place of each item."""
    return tuple((item.command, item.lat_e7, item.lon_e7) for item in sailed_part(items))


def is_same_mission(a: Sequence[MissionItem], b: Sequence[MissionItem]) -> bool:
    """Return whether the boat would sail both alike."""
    return fingerprint(a) == fingerprint(b)


def is_mixture(items: Sequence[MissionItem], old: Sequence[MissionItem], new: Sequence[MissionItem]) -> bool:
    """Return whether every item is ours, from one of two missions at its index: an upload that was cut short."""
    ours = [{(m.command, m.lat_e7, m.lon_e7) for m in pair} for pair in _by_index(old, new)]
    return len(items) <= len(ours) and all((m.command, m.lat_e7, m.lon_e7) in ours[i] for i, m in enumerate(items))


def _by_index(old: Sequence[MissionItem], new: Sequence[MissionItem]) -> list[list[MissionItem]]:
    return [list(old[i : i + 1]) + list(new[i : i + 1]) for i in range(max(len(old), len(new)))]


def ends_safely(items: Sequence[MissionItem]) -> bool:
    """Return whether the mission's last sailed item is one that ends it."""
    whole = sailed_part(items)
    return bool(whole) and whole[-1].command in ENDING


# ------------------------------------------------------------------------------------------ safe end
LEEWARD_ROOM_M = 40.0  # a boat with eased sails drifts this far before somebody looks
RINGS_M = (0.0, 15.0, 30.0, 50.0, 80.0, 120.0)
# Where nothing nearer is free at all: in the middle of a flat that dries.
FAR_RINGS_M = (180.0, 270.0, 400.0, 600.0, 900.0)
DIRECTIONS = 16
SWINGS_RAD = math.radians(15.0)  # so far off the no-go zone a line may be closed by the time that it is sailed
ROOMIER_M = 50.0  # a place with the room that is wanted is worth sailing this far
ROOMIER_BY_M = 3.0  # ... and a somewhat roomier one only for this much of room


def roomy_m(config: SkipperConfig) -> float:
    """Return how clear a loiter's place must be for the boat to keep the margin's floor in it [m]."""
    return config.loiter_radius_m + min(config.margin_floor_m, config.margin_m)


def lacking_m(config: SkipperConfig, area: AreaLike, place_en: PointEn) -> float:
    """Return how much room a loiter at a place lacks to keep the margin's floor in it [m], below 0: none."""
    return roomy_m(config) - float(area.clearance_m([place_en])[0])


def loiter_place(
    voyage: Voyage, config: SkipperConfig, end_en: PointEn, twd_from_rad: float, *, wanted_m: float = 0.0
) -> tuple[PointEn, float]:
    """Return where to loiter after ``end_en`` and the room there [m].

    The first place with ``loiter_radius_m`` all round and to leeward, looked for in growing rings that a straight
    line reaches; without one, the first that has it all round, else the roomiest so, farther off where none is free. A
    line that the wind has closed is one that the autopilot beats about: it needs the room of that corridor as well.
    From below the floor a line comes no nearer than it begins. With ``wanted_m`` of room to be had within
    ``ROOMIER_M``, the first place with that comes before the nearest that will do. Outside the limits, where none of
    their water with room is reached so, it is room off what is solid that counts: the place that is least far outside
    may lie between two rocks.
    """
    place, room = _roomy_place(voyage, config, end_en, twd_from_rad, wanted_m)
    water = water_to_keep(voyage.area, end_en)
    if room >= config.loiter_radius_m or water is voyage.area:
        return place, room
    return _roomy_place(replace(voyage, area=water), config, end_en, twd_from_rad, wanted_m)


def _roomy_place(
    voyage: Voyage, config: SkipperConfig, end_en: PointEn, twd_from_rad: float, wanted_m: float
) -> tuple[PointEn, float]:
    corridor_m = config.tack_corridor_m if config.tack_corridor_m > 0.0 else math.inf
    best, best_room = end_en, -math.inf
    will_do: tuple[PointEn, float] | None = None
    all_round: tuple[PointEn, float] | None = None  # with that room, but for what drifts off to leeward
    leeward = twd_from_rad + math.pi
    water = water_at(voyage.area, end_en)
    marks = marks_of(voyage)
    floor_m = floor_from_m(float(water.clearance_m([end_en])[0]), config.margin_floor_m)
    for ring_m in (*RINGS_M, *FAR_RINGS_M):
        if will_do is not None and ring_m > ROOMIER_M:
            return will_do
        if ring_m > RINGS_M[-1] and (best_room > 0.0 or all_round is not None):
            break
        count = 1 if ring_m == 0.0 else DIRECTIONS
        for n in range(count):
            place = moved(end_en, 2.0 * math.pi * n / DIRECTIONS, ring_m)
            if ring_m > 0.0:
                twa_rad = abs(difference_rad(twd_from_rad, bearing_rad(end_en, place)))
                needed_m = floor_m + (corridor_m if twa_rad < config.no_go_half_rad else 0.0)
                beaten_m = corridor_m if twa_rad < config.no_go_half_rad + SWINGS_RAD else 0.0
                if _line_clearance_m(water, end_en, place) < needed_m or _meets_mark(marks, end_en, place, beaten_m):
                    continue
            room = float(_rooms_m(voyage, config, marks, [place], leeward)[0])
            if room >= max(config.loiter_radius_m, wanted_m):
                return place, room
            if room >= config.loiter_radius_m and (will_do is None or room > will_do[1] + ROOMIER_BY_M):
                will_do = place, room
            about_m = float(_rooms_m(voyage, config, marks, [place], None)[0])
            if about_m > best_room + 1.0:
                best, best_room = place, about_m
            if all_round is None and about_m >= config.loiter_radius_m:
                all_round = place, about_m
    return will_do or all_round or (best, best_room)


WIND_STEP_RAD = math.radians(30.0)  # how fine the wind is told by where room is looked for


def place_with_room(voyage: Voyage, config: SkipperConfig, end_en: PointEn, twd_from_rad: float) -> PointEn | None:
    """Return the nearest place by water with ``roomy_m`` all round and to leeward; None: none in 900 m.

    Where that is not to be had, with ``loiter_radius_m``; and where nothing has that to leeward too, all round.
    """
    about = (float(round(end_en[0])), float(round(end_en[1])))
    wind_rad = WIND_STEP_RAD * round(twd_from_rad / WIND_STEP_RAD)
    found = (
        _place_with_room(voyage, voyage.area, config, about, wind, room_m)
        for room_m, wind in (
            (roomy_m(config), wind_rad),
            (config.loiter_radius_m, wind_rad),
            (config.loiter_radius_m, None),
        )
    )
    return next((place for place in found if place is not None), None)


@lru_cache(maxsize=8)  # asked for at every step; the area is by identity, which a voyage's equality leaves out
def _place_with_room(
    voyage: Voyage, area: AreaLike, config: SkipperConfig, end_en: PointEn, twd_from_rad: float | None, room_m: float
) -> PointEn | None:
    leeward, marks = None if twd_from_rad is None else twd_from_rad + math.pi, marks_of(voyage)
    nearest, least_m = None, math.inf
    for ring_m in (*RINGS_M[1:], *FAR_RINGS_M):
        if ring_m >= least_m:
            break  # by water nothing is nearer than straight
        places = [moved(end_en, 2.0 * math.pi * n / DIRECTIONS, ring_m) for n in range(DIRECTIONS)]
        rooms = _rooms_m(voyage, config, marks, places, leeward)
        for place in (place for place, room in zip(places, rooms, strict=True) if room >= room_m):
            far_m = way_m(area, end_en, place, config.margin_floor_m)
            if far_m < least_m:
                nearest, least_m = place, far_m
    return nearest


def _rooms_m(
    voyage: Voyage, config: SkipperConfig, marks: Sequence[Mark], places: Sequence[PointEn], leeward: float | None
) -> NDArray[np.float64]:
    """Return of each place the room to loiter there [m]: all round, and for what drifts off to ``leeward``."""
    if leeward is None:
        return np.minimum(voyage.area.clearance_m(np.asarray(places)), _off_marks_m(marks, places))
    down = [[moved(place, leeward, s * LEEWARD_ROOM_M) for s in (0.0, 0.25, 0.5, 0.75, 1.0)] for place in places]
    flat = [place for row in down for place in row]
    clear = np.minimum(voyage.area.clearance_m(np.asarray(flat)), _off_marks_m(marks, flat)).reshape(len(places), -1)
    # Drifting out of the end of the leeward strip is slow: there half the room is enough.
    rooms: NDArray[np.float64] = np.minimum(clear[:, 0], clear[:, 1:].min(axis=1) + 0.5 * config.loiter_radius_m)
    return rooms


def _off_marks_m(marks: Sequence[Mark], places: Sequence[PointEn]) -> NDArray[np.float64]:
    """Return how far each place is from what plans keep clear of about the nearest mark [m]; inf without marks."""
    off = [[distance_m(place, mark.en_m) - mark.keep_m for mark in marks] for place in places]
    return np.array([min(row, default=math.inf) for row in off])


def _meets_mark(marks: Sequence[Mark], from_en: PointEn, to_en: PointEn, beaten_m: float) -> bool:
    """Return whether a straight line leads nearer to a mark than plans go, and than it begins.

    About one that is or may be beaten, ``beaten_m`` to either side, a mark beside its begin is as near as one ahead.
    """
    return any(
        leg_distance_m(mark.en_m, from_en, to_en)
        < (mark.keep_m + beaten_m if beaten_m > 0.0 else min(mark.keep_m, distance_m(mark.en_m, from_en)))
        for mark in marks
    )


def _line_clearance_m(water: AreaLike, from_en: PointEn, to_en: PointEn) -> float:
    """Return the least clearance of a straight line [m], from inside something of the way out of it, below 0.

    A line that leads into anything has none, -inf, but what it begins in.
    """
    clear_m = water.path_clearance_m([from_en, to_en])
    if clear_m > 0.0:
        return clear_m
    along_m = water.clearance_m(np.linspace(from_en, to_en, LOOKS))
    outside = np.flatnonzero(along_m > 0.0)
    is_out = bool(outside.size) and bool(np.all(along_m[outside[0] :] > 0.0))
    return float(np.min(along_m)) if along_m[0] <= 0.0 and is_out else -math.inf


def end_item(
    voyage: Voyage, config: SkipperConfig, end_en: PointEn, twd_from_rad: float
) -> tuple[MissionItem, PointEn]:
    """Return the loiter that ends the mission and where it is."""
    place, _ = loiter_place(voyage, config, end_en, twd_from_rad, wanted_m=roomy_m(config))
    return waypoint(voyage.frame.geo_from_en(*place), command=Command.NAV_LOITER_UNLIM), place


# ------------------------------------------------------------------------------------------- splice
@dataclass(frozen=True, slots=True, kw_only=True)
class Tail:
    """New waypoints: where they begin (not an item), the points, and the gate that the last one completes."""

    start_en: PointEn
    points_en: tuple[PointEn, ...]
    gate: int  # -1: the last point completes nothing (a nearer goal, the local plan's horizon)
    is_place: bool = False  # the boat is to loiter at its end, and nowhere near by


def splice(
    voyage: Voyage,
    config: SkipperConfig,
    old: Route | None,
    *,
    keep: int,
    tail: Tail,
    twd_from_rad: float,
    facts: Route,
) -> Route:
    """Return the route that keeps the first ``keep`` items of ``old`` and continues with ``tail`` and a safe end.

    ``facts`` carries the plan's figures (identity, wind, margin, risk); its lists are ignored.
    """
    kept = old if keep > 0 else None
    items = list(kept.items[:keep]) if kept else []
    points = list(kept.points_en_m[:keep]) if kept else []
    starts = list(kept.leg_from_en_m[:keep]) if kept else []
    gates = list(kept.gate_of[:keep]) if kept else []
    start = tail.start_en
    for n, point in enumerate(tail.points_en):
        items.append(waypoint(voyage.frame.geo_from_en(*point)))
        points.append(point)
        starts.append(start)
        gates.append(tail.gate if n == len(tail.points_en) - 1 else -1)
        start = point
    item, place = (
        end_item(voyage, config, start, twd_from_rad)
        if not tail.is_place
        else (waypoint(voyage.frame.geo_from_en(*start), command=Command.NAV_LOITER_UNLIM), start)
    )
    items.append(item)
    points.append(place)
    starts.append(start)
    gates.append(-1)
    return replace(
        facts, items=tuple(items), points_en_m=tuple(points), leg_from_en_m=tuple(starts), gate_of=tuple(gates)
    )


# ----------------------------------------------------------------------------------------- transfer
HELD_BACK = "held back"  # the rung of a route that ends in a stopgap
NO_PLAN = -1  # the plan of a route that was found on board: ours, and nobody knows what for


def stopgap(route: Route, keep: int, index: int) -> MissionItem | None:
    """Return what stands behind the first ``keep`` items while what follows is being replaced; None: nothing can.

    A loiter where the boat is going anyway: at its present target (``index``) when that is replaced, else at the last
    waypoint that stays. An item that ends the mission stays what it is.
    """
    if keep >= len(route.items):
        return None
    if route.items[keep].command in ENDING:
        return route.items[keep]
    place = min(index, len(route.items) - 1) if index >= keep else keep - 1
    return replace(route.items[place], command=Command.NAV_LOITER_UNLIM)


def held_back(items: Sequence[MissionItem], route: Route) -> Route | None:
    """Return the beginning of ``route`` that is on board behind a stopgap; None when ``items`` are something else.

    It ends in a loiter at one of the route's own waypoints: whole and safe, and not yet the way to the goal.
    """
    whole = fingerprint(items)
    n = len(whole) - 1
    if n < 0 or whole[-1][0] != Command.NAV_LOITER_UNLIM or whole[:n] != fingerprint(route.items)[:n]:
        return None
    for item, point in zip(route.items, route.points_en_m, strict=True):
        if (item.lat_e7, item.lon_e7) == whole[-1][1:]:
            begin = route.leg_from_en_m[min(n, len(route.items) - 1)]
            why = "an upload was cut short: the mission ends in a loiter on the way"
            return route.led_aside(n, begin, [(items[n], point)], rung=HELD_BACK, why=why)
    return None


def common_prefix(a: Sequence[MissionItem], b: Sequence[MissionItem]) -> int:
    """Return how many leading items are identical."""
    n = 0
    for x, y in zip(a, b, strict=False):
        if (x.command, x.lat_e7, x.lon_e7) != (y.command, y.lat_e7, y.lon_e7):
            break
        n += 1
    return n


def path_length_m(points: Sequence[PointEn]) -> float:
    """Return the length of a polyline [m]."""
    return sum(distance_m(a, b) for a, b in pairwise(points))
