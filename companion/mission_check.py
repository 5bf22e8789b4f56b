"""Whether a mission can be sailed as it stands, and what plans of it would be: for who checks, draws or sails it."""

from __future__ import annotations

import datetime as dt
import math
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise, zip_longest
from pathlib import Path

import numpy as np
import shapely
from numpy.typing import NDArray

from companion.boat import can_hold
from companion.compose import (
    RECENTRE_M,
    boat_of,
    config_of,
    displays_of,
    drying_of,
    estimator_of,
    feeds_of,
    field_findings_of,
    permissions_of,
    require_fields,
    sounder_of,
    target_limits_of,
    tide_of,
    voyage_of,
    water_of,
)
from companion.current import STILL_WATER, Prior, WaterCurrent, over_water
from companion.errors import InputError
from companion.field.guidance import step
from companion.field.look_ahead import way_out_rad
from companion.field.projection import NO_GO_HALF_RAD, HysteresisRing, HysteresisZone, Projection
from companion.field.tree import (
    LEAST,
    Along,
    AwayFrom,
    AwayFromLine,
    FieldConditions,
    FieldTree,
    Named,
    OutOf,
    PointTo,
    Round,
    StayAt,
    field_of,
    lengths,
    zone_of,
)
from companion.field.values import Clearance, GuidanceSettings, GuidanceState, Intent, Situation
from companion.geo.angles import difference_rad, direction, heading_of, wrap_pi
from companion.geo.frame import LocalFrame
from companion.geofence import Code, Finding, FindingLevel, LocalArea, Mission
from companion.geofence.check import AreaConditions, check_area
from companion.geofence.mission import AreaOptions, MissionGoal, kind_of, place_troubles, read_mission
from companion.messages import GeoPoint
from companion.planner import Plan, Problem
from companion.planner.problem import assumed
from companion.safety import LIGHT_WIND, STRONG_WIND
from companion.skipper.planning import HOME_RADIUS_M
from companion.skipper.way import KEEP_SHARE, Approach, Composed, Gate, Side, Until, gates_of, no_room, timed
from companion.words import counted

__all__ = [
    "AssumedWind",
    "CheckedMission",
    "FieldPreview",
    "HeadingFan",
    "check_mission",
    "current_words_of",
    "require_sailable",
]

_DIRECTIONS = 24
SAME_M = 1.0  # two goals so near are one mark that is passed twice
SMALL_M = 3.0  # a fix is good to 2.5 m


def current_words_of(mission: Mission, unix_s: float) -> tuple[str, ...]:
    """Return what ``[current]`` says, one thing a line; nothing without the table.

    ``unix_s``: the time now, by which a tide table is over or not yet begun. Raises InputError as ``water_of``.
    """
    if mission.current is None:
        return ()
    prior = water_of(mission)
    strongest = prior.strongest_mps
    if not prior.rows:
        lines = [
            (
                f"current: sets {direction(heading_of(prior.east_mps, prior.north_mps))}° "
                f"{strongest:.2f} m/s, give or take {prior.sigma_mps:.2f} m/s"
            )
        ]
    else:
        first, last = (
            f"{dt.datetime.fromtimestamp(row.utc_s, dt.UTC):%Y-%m-%d %H:%M}" for row in (prior.rows[0], prior.rows[-1])
        )
        lines = [
            (
                f"current: {prior.name}, {counted(len(prior.rows), 'row')} from {first} to {last} UTC, at most "
                f"{strongest:.2f} m/s, give or take {prior.sigma_mps:.2f} m/s"
            )
        ]
        said = prior.at(unix_s).verdict
        lines += [f"current: now {said}"] if said else []
    if not _holds(mission, prior):
        tws_mps = mission.wind.preview_speed_mps
        lines.append(
            f"current: in {tws_mps:g} m/s of wind "
            f"from {direction(math.radians(mission.wind.preview_from_deg))}° she cannot make "
            f"way against {strongest:.2f} m/s in every direction"
        )
    return tuple(lines)


def _holds(mission: Mission, prior: Prior) -> bool:
    """Return whether the boat can stem the strongest of it, whichever way it sets, in the wind of previews."""
    boat, drift = boat_of(mission), prior.strongest_mps
    sets = (
        [2.0 * math.pi * n / _DIRECTIONS for n in range(_DIRECTIONS)]
        if prior.rows
        else [math.atan2(prior.east_mps, prior.north_mps)]
    )
    for set_rad in sets:
        current = drift * math.sin(set_rad), drift * math.cos(set_rad)
        from_rad, tws_mps = over_water(
            math.radians(mission.wind.preview_from_deg), mission.wind.preview_speed_mps, current
        )
        if not can_hold(
            boat, twd_from_rad=from_rad, tws_mps=tws_mps, current_en_mps=current, no_go_half_rad=boat.no_go_half_rad
        ):
            return False
    return True


@dataclass(frozen=True, slots=True, kw_only=True)
class CheckedMission:
    """A mission file as the boat would read it.

    Attributes:
        mission: None when it cannot be read at all.
        refusals: why it must not be sailed; the first is what ``load_mission`` or ``require_sailable`` raises.
        findings: what else is wrong or worth knowing, worst first.
    """

    mission: Mission | None
    refusals: tuple[InputError, ...] = ()
    findings: tuple[Finding, ...] = ()


def check_mission(
    path: Path, *, from_deg: float | None = None, given: Mapping[Path, bytes] | None = None
) -> CheckedMission:
    """Read a mission and its area as the boat will, and look for what is wrong with it: never raises InputError.

    ``from_deg``: where the wind comes from, in which gaps are looked at (else the mission's). ``given``: see
    ``load_mission``.
    """
    try:
        mission = read_mission(path, given or {})
        troubles = tuple(InputError(str(path), *trouble) for trouble in place_troubles(mission))
        if not troubles:
            require_sailable(mission)
    except InputError as error:
        return CheckedMission(mission=None, refusals=(error,))
    found = check_area(
        mission.area,
        AreaConditions(
            start=mission.start,
            goals=tuple(g.point for g in mission.goals),
            margin_m=mission.margin_m,
            is_passage=mission.is_passage,
            twd_from_rad=math.radians(mission.wind.preview_from_deg if from_deg is None else from_deg),
            no_go_half_rad=math.radians(mission.boat.no_go_half_deg),
        ),
    )
    told = {Code.START_OUTSIDE, Code.GOAL_OUTSIDE} if troubles else set()
    return CheckedMission(
        mission=mission,
        refusals=troubles,
        findings=(
            *mission.findings,
            *(
                ()
                if troubles
                else (
                    *field_findings_of(mission),
                    *_roundings(mission),
                    *_lines(mission),
                    *_circles(mission),
                    *_drying(mission),
                )
            ),
            *_doubts(mission),
            *(f for f in found if f.severity is not FindingLevel.ERROR or f.code not in told),
        ),
    )


def _roundings(mission: Mission) -> Iterator[Finding]:
    """Yield the buoys that cannot be rounded with the margin: a place of the circle has no room."""
    voyage, told = voyage_of(mission), set[int]()
    begun = (Approach(goal=0, en_m=voyage.frame.en_from_geo(mission.start)),) if mission.start is not None else ()
    for gate in gates_of(voyage, begun):
        number = gate.goal % len(voyage.goals) + 1
        if gate.buoy_en_m is None or number in told:
            continue
        clear_m = float(voyage.area.clearance_m([gate.en_m])[0])
        if clear_m < mission.margin_m:
            told.add(number)
            goal = voyage.goals[number - 1]
            near = voyage.area.nearest_name(gate.en_m) or "something"
            yield Finding(
                severity=FindingLevel.WARNING,
                code=Code.NARROW_GAP,
                place=f"[[goal]] {number} rounding",
                text=f"rounded {goal.rounding_m:.0f} m off with {gate.name} to {goal.side.value} she comes to "
                f"{max(0.0, clear_m):.1f} m from {near}; the margin is {mission.margin_m:g} m",
                remedy="round it closer (radius_m and [area] margin_m say how far off), or leave it on the other hand",
            )


NO_ROOM_REMEDY = "move both marks farther from it, or let [area] margin_m and margin_floor_m be smaller"


def _lines(mission: Mission) -> Iterator[Finding]:
    """Yield the gates that cannot be crossed with the margin: beyond the line, or before it, there is no room."""
    for number, gate, words in _crowded(mission, mission.margin_m):
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


def _crowded(mission: Mission, margin_m: float) -> Iterator[tuple[int, Gate, str]]:
    """Yield the goal's number, the gate and the words of each line with no room by a margin, once a goal."""
    if all(goal.gate is None for goal in mission.goals):
        return
    voyage, told = voyage_of(mission), set[int]()
    begun = (Approach(goal=0, en_m=voyage.frame.en_from_geo(mission.start)),) if mission.start is not None else ()
    for gate in gates_of(voyage, begun):
        number = gate.goal % len(voyage.goals) + 1
        words = "" if number in told else no_room(gate, voyage.area, margin_m)
        if words:
            told.add(number)
            yield number, gate, words


def _circles(mission: Mission) -> Iterator[Finding]:
    """Yield the roundings whose circle holds the start or another goal: half of it is kept clear by every plan."""
    voyage = voyage_of(mission)
    places = [(f"[[goal]] {n}", goal.en_m) for n, goal in enumerate(voyage.goals, start=1)]
    if mission.start is not None:
        places.insert(0, ("[start]", voyage.frame.en_from_geo(mission.start)))
    for number, goal in enumerate(voyage.goals, start=1):
        if goal.side is Side.NONE:
            continue
        for place, en_m in places:
            off_m = math.dist(en_m, goal.en_m)
            if SAME_M < off_m < goal.rounding_m or (place == "[start]" and off_m <= SAME_M):
                yield Finding(
                    severity=FindingLevel.WARNING,
                    code=Code.ROUNDING,
                    place=f"[[goal]] {number} radius_m",
                    text=f"is rounded {goal.rounding_m:g} m off, and {place} lies {off_m:.0f} m from it: "
                    f"{KEEP_SHARE * goal.rounding_m:g} m are kept clear of the buoy",
                    remedy=f"let radius_m and [area] margin_m, the greater of which says how far off, be below "
                    f"{off_m:.0f} m, or move {place}",
                )


def _doubts(mission: Mission) -> Iterator[Finding]:
    """Yield what is hardly meant: goals too small to meet, one name for two places, a key that does nothing."""
    for number, goal in enumerate(mission.goals, start=1):
        is_place = goal.rounding is None and goal.gate is None and goal.box is None and goal.search is None
        if is_place and goal.field is None and goal.radius_m < SMALL_M:
            yield Finding(
                severity=FindingLevel.WARNING,
                code=Code.SMALL,
                place=f"[[goal]] {number} radius_m",
                text=f"{goal.radius_m:g} m: a fix is good to 2.5 m, and at 3 m/s she is past it in a second or two",
                remedy=f"write {SMALL_M:g} or more, or she may sail about it for ever",
            )
    named: dict[str, list[tuple[str, GeoPoint]]] = {
        "goal": [(goal.name, goal.point) for goal in mission.goals],
        "refuge": [(refuge.name, refuge.point) for refuge in mission.refuges],
    }
    for kind, places in named.items():
        first: dict[str, tuple[int, GeoPoint]] = {}
        for number, (name, at) in enumerate(places, start=1):
            before, point = first.setdefault(name.strip().casefold(), (number, at))
            if name.strip() and before != number and point != at:
                yield Finding(
                    severity=FindingLevel.WARNING,
                    code=Code.TWICE,
                    place=f"[[{kind}]] {number} name",
                    text=f"{name!r} is the name of [[{kind}]] {before}, too, which lies elsewhere",
                    remedy="give it another: orders and what is said name the one or the other",
                )
    if mission.skipper.shifts and mission.skipper.guidance != "plan":
        yield Finding(
            severity=FindingLevel.WARNING,
            code=Code.NO_EFFECT,
            place="[skipper] shifts",
            text=f'does nothing with guidance = "{mission.skipper.guidance}": the tacks are asked of the autopilot '
            "in AUTO",
            remedy='leave it out, or write guidance = "plan"',
        )


def _drying(mission: Mission) -> Iterator[Finding]:
    """Yield the places to lie in that water takes which dries: she goes to none of them, whatever the tide is."""
    voyage = voyage_of(mission)
    places = [(f"[[refuge]] {n}", refuge.en_m) for n, refuge in enumerate(voyage.refuges, start=1)]
    if mission.start is not None and mission.skipper.end == "home":
        places.append(("[start], which is home,", voyage.frame.en_from_geo(mission.start)))
    for place, en_m in places:
        for water in voyage.drying:
            if shapely.intersects_xy(water.polygon, *en_m):
                yield Finding(
                    severity=FindingLevel.WARNING,
                    code=Code.DRIES,
                    place=place,
                    text=f"lies in {water.name}, which dries: she does not go there to stay",
                    remedy="choose a place that is deep enough at low water",
                )


def require_sailable(mission: Mission) -> Mission:
    """Return the mission; raise InputError for what would fail, or be passed over in silence, under way.

    ``load_mission`` has seen to each key by itself and to the places; here everything that a voyage is made of is made
    once, and keys that contradict each other are refused.
    """
    source = str(mission.path)
    _require_consistent(mission, source)
    try:
        estimator_of(mission)
        feeds_of(mission)
        sounder_of(mission)
        displays_of(mission)
        permissions_of(mission)
        target_limits_of(mission)
        config_of(mission)
        require_fields(mission)
        voyage_of(mission)
        water_of(mission)
    except ValueError as error:
        raise InputError(source, "", str(error)) from error
    return mission


def _require_consistent(mission: Mission, source: str) -> None:
    area, operator, skipper = mission.options.area, mission.operator, mission.skipper
    if area.margin_floor_m > max(area.margin_m, AreaOptions().margin_floor_m):
        raise InputError(
            source,
            "[area] margin_floor_m",
            f"{area.margin_floor_m:g} m is more than margin_m, {area.margin_m:g} m",
            "the margin is reduced down to the floor: write a smaller floor or a larger margin",
        )
    boat = mission.boat
    if boat.max_tws_mps is not None and boat.min_tws_mps is not None and boat.min_tws_mps >= boat.max_tws_mps:
        raise InputError(
            source,
            "[boat] min_tws_mps",
            f"{boat.min_tws_mps:g} m/s is not below max_tws_mps, {boat.max_tws_mps:g} m/s",
            "no wind is both: write a smaller min_tws_mps or a larger max_tws_mps",
        )
    limit = next((key for key in ("max_tws_mps", "min_tws_mps") if getattr(boat, key) is not None), None)
    if limit is not None and mission.autopilot.frame == "motor":
        raise InputError(
            source,
            f"[boat] {limit}",
            "is for a boat that sails: no wind is looked at for a motor boat",
            'leave it out, or write frame = "sailboat" in [autopilot]',
        )
    missing = [key for key in ("guided", "set_auto") if not getattr(operator, key)]
    if skipper.guidance != "plan" and missing:
        raise InputError(
            source,
            "[skipper] guidance",
            f'"{skipper.guidance}" steers in GUIDED, which nobody allows',
            f'write {" and ".join(f"{key} = true" for key in missing)} in [operator], or guidance = "plan"',
        )
    if skipper.guidance == "heading" and mission.autopilot.frame == "motor":
        raise InputError(
            source,
            "[skipper] guidance",
            '"heading" is for a boat that sails',
            'write guidance = "plan" or "field", or frame = "sailboat" in [autopilot]',
        )
    by_field = next((n for n, goal in enumerate(mission.goals, start=1) if goal.field is not None), None)
    if by_field is not None and missing:
        raise InputError(
            source,
            f"[[goal]] {by_field} kind",
            "a field is steered in GUIDED, which nobody allows",
            f"write {' and '.join(f'{key} = true' for key in missing)} in [operator]",
        )
    kinds = [(n, kind_of(goal)) for n, goal in enumerate(mission.options.goal, start=1)]
    task = next(((n, kind) for n, kind in kinds if kind not in {"point", "field"}), None)
    if skipper.guidance != "plan" and task is not None:
        raise InputError(
            source,
            "[skipper] guidance",
            f'"{skipper.guidance}" knows nothing of the {task[1]}, [[goal]] {task[0]}',
            'write guidance = "plan"',
        )
    passage = mission.passage
    if passage.leg_m is None and passage.recentre_m is not None:
        raise InputError(
            source,
            "[passage] recentre_m",
            "is of a passage, and nothing says how long its legs are",
            "add leg_m, the longest leg in metres, or leave it out",
        )
    if skipper.max_replan_s is not None and skipper.max_replan_s < skipper.min_replan_s:
        raise InputError(
            source,
            "[skipper] max_replan_s",
            f"{skipper.max_replan_s:g} s is less than min_replan_s, {skipper.min_replan_s:g} s",
            "write a larger one, or a smaller min_replan_s",
        )
    if operator.upload_fence and not (mission.area.solids or mission.area.fence.zones):
        raise InputError(
            source,
            "[operator] upload_fence",
            "there is no area to make a fence of",
            "name its files in [area], or write upload_fence = false",
        )


PROBE_M = 100.0


@dataclass(frozen=True, slots=True, kw_only=True)
class AssumedWind:
    """A wind that is held: from where [deg], how strong [m/s], and by how much its direction is uncertain [deg]."""

    from_deg: float
    speed_mps: float
    spread_deg: float = 0.0

    def sigma(self, no_go_error_rad: float = 0.0) -> dict[str, object]:
        """Return its uncertainty as a planning problem has it, and with it that of the boat's no-go zone."""
        spread_deg = self.spread_deg
        if no_go_error_rad > 0.0:
            spread_deg = math.hypot(spread_deg, math.degrees(no_go_error_rad))
        if spread_deg <= 0.0:
            return {"model": "none"}
        return {"model": "kalman", "sigma0_deg": spread_deg, "growth_deg_per_sqrt_s": 0.0}


def leg_problem(
    mission: Mission,
    here_en: tuple[float, float],
    heading_deg: float,
    goal_en: tuple[float, float],
    radius_m: float,
    *,
    wind: AssumedWind,
    title: str = "",
    local: LocalArea | None = None,
    current: WaterCurrent = STILL_WATER,
    unix_s: float | None = None,
) -> Problem:
    """Return the problem of sailing to one goal of a mission [m in its frame] in a wind that is held steady.

    Where ``current`` is planned for the wind, which is that over the ground, is carried over to the water. ``unix_s``:
    when it begins, for water that dries; without it that is solid.
    """
    local = mission.water() if local is None else local
    boat, sails = boat_of(mission), mission.autopilot.frame == "sailboat"
    water: dict[str, object] = {}
    if current.is_significant:
        from_rad, speed_mps = over_water(math.radians(wind.from_deg), wind.speed_mps, current.en_mps)
        wind = replace(wind, from_deg=math.degrees(from_rad), speed_mps=speed_mps)
        water["current"] = {"set_deg": math.degrees(current.set_rad), "drift_mps": current.drift_mps}
    dries = timed(
        drying_of(mission, mission.frame()),
        tide_of(mission) if mission.drying else None,
        unix_s,
        margin_m=mission.margin_m,
        start_en=here_en,
    )
    if dries.solid:
        local = local.also(
            tuple(w.name for w in dries.solid),
            tuple(w.polygon for w in dries.solid),
            tuple(w.margin_m for w in dries.solid),
        )
    problem = Problem.from_json(
        {
            "id": mission.name,
            "title": title,
            "start": {"x": here_en[0], "y": here_en[1], "heading_deg": heading_deg % 360.0},
            "goal": {"x": goal_en[0], "y": goal_en[1], "radius": radius_m},
            "obstacles": local.obstacles_wkt(mission.margin_m),
            "obstacle_names": local.obstacle_names(mission.margin_m),
            "fence": local.fence_wkt(mission.margin_m, here_en),
            "wind": {
                "from_deg": wind.from_deg,
                "speed_mps": wind.speed_mps,
                "sigma": wind.sigma(boat.no_go_error_rad),
                **({"strength": assumed(wind.speed_mps).to_dict()} if sails else {}),
            },
            "boat": {
                **boat.problem_boat(wind.speed_mps),
                **({"speeds": boat.problem_speeds(), "tack_fails": boat.tack_fails} if sails else {}),
            },
            "delta_s": mission.risk.delta_s,
            **water,
        }
    )
    return replace(problem, targets=dries.targets) if dries.targets else problem


def expected_current(mission: Mission, unix_s: float | None) -> WaterCurrent:
    """Return the current that a plan reckons with which is made as the voyage begins, by the mission alone.

    ``unix_s``: when; without it a tide table tells nothing. Raises InputError as ``water_of``.
    """
    expected = water_of(mission).at(unix_s)
    found = WaterCurrent(
        east_mps=expected.east_mps,
        north_mps=expected.north_mps,
        var_ee=expected.sigma_mps**2,
        var_nn=expected.sigma_mps**2,
    )
    return replace(found, is_significant=found.is_worth_planning(was=True))


def leg_names(mission: Mission) -> list[str]:
    """Return in words where each of the legs of ``legs`` leads."""
    words = [f"goal {n}" + (f", {goal.name}" if goal.name else "") for n, goal in enumerate(mission.goals, start=1)]
    return [*words, "home"] if mission.skipper.end == "home" else words


def legs(
    mission: Mission, wind: AssumedWind, *, goes_home: bool = True, unix_s: float | None = None
) -> Generator[Problem, Plan, None]:
    """Yield the problem of each leg of one lap, and be sent its plan; end with the first that has no path.

    ``goes_home``: the leg home belongs to it, where the mission ends there. Home is taken to be the
    start: the autopilot's is where it was armed. Without a start there is no leg. ``unix_s``: when the voyage begins,
    for the row of a tide table that each leg begins in; without it tables are left out.

    Raises:
        ValueError: no water is left inside the fence at the margin.
        InputError: a line has not even the margin's floor of room beyond or before it: it is never sailed.
    """
    if mission.start is None:
        return
    frame = mission.frame()
    here, local = frame.en_from_geo(mission.start), mission.water()
    heading_deg = mission.options.start.heading_deg if mission.options.start else 0.0
    targets = [(goal.point, goal.radius_m, goal.name or f"goal {n}") for n, goal in enumerate(mission.goals, start=1)]
    if goes_home and mission.skipper.end == "home":
        targets.append((mission.start, HOME_RADIUS_M, "home"))
    floor_m = min(mission.margin_floor_m, mission.margin_m)
    closed = {n: words for n, _, words in _crowded(mission, floor_m)}
    for number, (point, radius_m, title) in enumerate(targets, start=1):
        if number in closed:
            raise InputError(str(mission.path), f"[[goal]] {number}", closed[number], NO_ROOM_REMEDY)
        blows = replace(wind, from_deg=wind.from_deg + _north_deg(frame, here)) if mission.is_passage else wind
        answer = yield leg_problem(
            mission,
            here,
            heading_deg,
            frame.en_from_geo(point),
            radius_m,
            wind=blows,
            title=title,
            local=local,
            current=expected_current(mission, unix_s),
            unix_s=unix_s,
        )
        if not answer.has_path:
            return
        unix_s = None if unix_s is None else unix_s + answer.cost_s
        here = (float(answer.waypoints_en[-1][0]), float(answer.waypoints_en[-1][1]))
        heading_deg = math.degrees(answer.legs[-1].heading_rad) if answer.legs else heading_deg


def _north_deg(frame: LocalFrame, here_en: tuple[float, float]) -> float:
    """Return where true north is on the grid of a frame at a place far from its origin [deg, clockwise]."""
    there = LocalFrame(frame.geo_from_en(*here_en)).geo_from_en(0.0, PROBE_M)
    east_m, north_m = frame.en_from_geo(there)
    return math.degrees(math.atan2(east_m - here_en[0], north_m - here_en[1]))


def passage_words(mission: Mission) -> str:
    """Return in words what a passage is: how far, in which waters, how far a plan looks."""
    if mission.start is None:
        return "a passage from wherever she lies"
    places = [mission.start, *(goal.point for goal in mission.goals)]
    lengths_km = [math.hypot(*LocalFrame(a).en_from_geo(b)) / 1000.0 for a, b in pairwise(places)]
    bands = sorted({goal.bandwidth_m for goal in voyage_of(mission).goals if goal.bandwidth_m is not None})
    widths = " and ".join(f"{band / 1000.0:g}" for band in bands)
    band = f"bands of {widths} km to either side" if bands else "no band"
    return (
        f"a passage of {sum(lengths_km):.0f} km, the longest leg {max(lengths_km):.0f} km, {band}; "
        f"plans for {mission.skipper.horizon_m / 1000.0:g} km at a time, the frame moves along every "
        f"{(mission.passage.recentre_m or RECENTRE_M) / 1000.0:g} km"
    )


def wind_limit_words(mission: Mission) -> str:
    """Return in words the winds that the boat sets sail in, empty: in any."""
    boat = mission.boat
    limits = [
        f"{word} {limit:g} m/s"
        for word, limit in (("more than", boat.max_tws_mps), ("less than", boat.min_tws_mps))
        if limit is not None
    ]
    if not limits:
        return ""
    allowed = 100.0 * (1.0 - mission.risk.delta_s)
    strong, light = (mission.safety.end(name).value for name in (STRONG_WIND, LIGHT_WIND))
    return (
        f"she does not set sail where {' or '.join(limits)} of wind is forecast with over {allowed:.0f} % at any "
        f"instant of the plan; under way [safety] has {strong!r} for strong wind and {light!r} for light"
    )


def planned_legs(walk: Generator[Problem, Plan, None], answer: Callable[[Problem], Plan]) -> list[Plan]:
    """Return the plans of all legs, each answered in place."""
    plans: list[Plan] = []
    problem = next(walk, None)
    while problem is not None:
        plans.append(answer(problem))
        problem = continued_plans(walk, plans[-1])
    return plans


def continued_plans(walk: Generator[Problem, Plan, None], plan: Plan) -> Problem | None:
    """Send the plan of a leg; return the problem of the next, None: there is none."""
    try:
        return walk.send(plan)
    except StopIteration:
        return None


def waits_s(mission: Mission, sailed_s: Sequence[float], *, laps: int = 1, unix_s: float | None = None) -> list[float]:
    """Return how long the boat waits at the end of each leg, lap by lap [s]: for a gun, in a box, by a field.

    ``sailed_s``: what the plans of one lap take, goal by goal, empty where none are made. ``unix_s``: when she sets
    sail; without it a gun at an hour of the day is left out. So is what nobody knows beforehand: a search, and a box or
    a field that is left when somebody says so.
    """
    now_s, waits = 0.0, []
    for _ in range(laps):
        for goal, leg_s in zip_longest(mission.goals, sailed_s, fillvalue=None):
            now_s += leg_s or 0.0
            wait_s = 0.0
            if goal is not None and goal.gate is not None:
                hour_s, gun_s = goal.gate.not_before_s, goal.gate.after_s
                if hour_s is not None:
                    gun_s = None if unix_s is None else hour_s - unix_s
                wait_s = max(0.0, gun_s - now_s) if gun_s is not None else 0.0
            elif goal is not None and (task := goal.box or goal.field) is not None:
                wait_s = task.for_s or 0.0
            now_s += wait_s
            waits.append(wait_s)
    return waits


def wait_words(goal: MissionGoal, wait_s: float) -> str:
    """Return in words what the plan of the leg to a goal does not sail, for who reads its time; empty: nothing."""
    gate = goal.gate
    if gate is not None and gate.not_before_s is not None:
        return f"the gun is at {dt.datetime.fromtimestamp(gate.not_before_s, dt.UTC):%Y-%m-%d %H:%M:%S} UTC"
    if gate is not None and gate.after_s is not None:
        return f"then waits {wait_s:.0f} s for the gun" if wait_s > 0.0 else "the gun is before that"
    if goal.search is not None:
        return "then the search, which is not counted"
    if (task := goal.box or goal.field) is not None:
        return "then stays until told, which is not counted" if task.for_s is None else f"then stays {task.for_s:.0f} s"
    return ""


PointEn = tuple[float, float]
TRACK_S = 600.0  # a preview is no voyage
AROUND = 0.3  # of the picture's half width, beyond what lies in it
LEAST_HALF_M = 80.0
LAG_S = 3.0
FAN_RAD = np.radians(np.arange(0.0, 360.0, 5.0))


@dataclass(frozen=True, slots=True, kw_only=True)
class FieldPreview:
    """A goal's field, the boat and the wind in which it is looked at.

    ``here_en`` is where the boat is, at the mission's start or where the goal before was; ``centre_en`` and
    ``half_m`` are the square that holds all of it.
    """

    number: int
    name: str
    composed: Composed
    conditions: FieldConditions
    area: LocalArea
    here_en: PointEn
    place_en: PointEn
    radius_m: float
    centre_en: PointEn
    half_m: float

    @property
    def tree(self) -> FieldTree:
        """The field's expression and atoms."""
        return self.composed.tree

    @property
    def zone(self) -> HysteresisZone | HysteresisRing | None:
        """The band about its trajectory."""
        return zone_of(self.tree, self.conditions)

    def wanted(self, points_en: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return what the field says at points (n, 2), (n, 2)."""
        return field_of(self.tree, self.conditions)(points_en)

    def sailable(self, points_en: NDArray[np.float64], q: int = 1) -> NDArray[np.float64]:
        """Return it out of the no-go zone, (n, 2): the same for a motorboat."""
        projection = self.projection
        return self.wanted(points_en) if projection is None else projection.evaluate(points_en, q)

    @property
    def projection(self) -> Projection | None:
        """The last step of the tree, None: there is no no-go zone."""
        twd = self.conditions.twd_from_rad
        if twd is None:
            return None
        return Projection(
            field=field_of(self.tree, self.conditions),
            twd_from_rad=twd,
            zone=self.zone,
            no_go_half_rad=self.conditions.habits.no_go_half_rad,
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class HeadingFan:
    """Candidate headings (k,) [rad] with the speed of each (k,) [m/s], and their worth: the way made along the field.

    ``wanted_rad`` is the field's own heading, ``chosen_rad`` what the boat would be steered by.
    """

    headings_rad: NDArray[np.float64]
    speeds_mps: NDArray[np.float64]
    worth_mps: NDArray[np.float64]
    wanted_rad: float
    chosen_rad: float


def field_preview(
    mission: Mission, *, number: int | None = None, wind: tuple[float, float] | None = None
) -> FieldPreview:
    """Return the field of goal ``number`` (from 1; None: the first that has one) in ``wind`` (m/s, from [deg]).

    Of a mission that is sailed by field throughout, a mark is an attractive point.

    Raises:
        InputError: there is no such goal, or it has no field.
    """
    voyage, boat = voyage_of(mission), boat_of(mission)
    speed_mps, from_deg = wind or (mission.wind.preview_speed_mps, mission.wind.preview_from_deg)
    throughout = mission.skipper.guidance == "field"
    source, every = str(mission.path), [n for n, g in enumerate(voyage.goals, 1) if g.field is not None or throughout]
    if not every:
        raise InputError(
            source,
            "[[goal]]",
            "no goal is sailed by a field",
            'write kind = "field" in one, or [skipper] guidance = "field"',
        )
    if number is not None and number not in every:
        raise InputError(
            source, f"[[goal]] {number}", "is not sailed by a field", f"name one that is: {', '.join(map(str, every))}"
        )
    number = number or every[0]
    goal = voyage.goals[number - 1]
    composed = goal.field or Composed(
        tree=FieldTree(expression=Named("mark"), atoms=(("mark", PointTo(at_en=goal.en_m)),)), until=Until.PLACE
    )
    sails = mission.autopilot.frame == "sailboat"
    twa, speeds = boat.polar.curve(max(1.0, speed_mps))
    habits = GuidanceSettings(
        is_sailing=sails,
        no_go_half_rad=boat.no_go_half_rad or NO_GO_HALF_RAD,
        polar_twa_rad=tuple(map(float, twa)),
        polar_mps=tuple(map(float, speeds)),
        turn_rate_radps=boat.turn_rate_radps,
        tack_s=max(1.0, boat.tack_loss_s),
        lag_s=LAG_S,
        horizon_s=60.0,
        keep_m=mission.margin_floor_m,
    )
    here = voyage.goals[number - 2].en_m if number > 1 else goal.en_m
    if number == 1 and mission.start is not None:
        here = voyage.frame.en_from_geo(mission.start)
    seen = Situation(
        t_s=0.0,
        en_m=here,
        velocity_en_mps=(0.0, 0.0),
        tws_mps=speed_mps,
        heading_rad=0.0,
        twd_from_rad=math.radians(from_deg) if sails else None,
    )
    conditions = FieldConditions(seen=seen, habits=habits)
    centre, half_m = _around([here, goal.en_m], composed)
    return FieldPreview(
        number=number,
        name=goal.name or f"goal {number}",
        composed=composed,
        conditions=conditions,
        area=mission.area.local(voyage.frame),
        here_en=here,
        place_en=goal.en_m,
        radius_m=goal.radius_m,
        centre_en=centre,
        half_m=half_m,
    )


def _around(places: list[PointEn], composed: Composed) -> tuple[PointEn, float]:
    """Return the middle and the half side of the square that holds a field's atoms and these places."""
    for _, atom in composed.tree.atoms:
        if isinstance(atom, Round | AwayFrom):
            reach = atom.radius_m if isinstance(atom, Round) else atom.range_m
            places += [(atom.at_en[0] + e, atom.at_en[1] + n) for e in (-reach, reach) for n in (-reach, reach)]
        elif isinstance(atom, PointTo | StayAt):
            places.append(atom.at_en)
        elif isinstance(atom, Along | AwayFromLine):
            places += [atom.from_en, atom.to_en]
        elif isinstance(atom, OutOf):
            west, south, east, north = atom.water_en.bounds
            places += [(west, south), (east, north)]
    points = np.asarray(places)
    low, high = points.min(axis=0), points.max(axis=0)
    half = max(LEAST_HALF_M, (0.5 + AROUND) * float((high - low).max()))
    return (float(0.5 * (low[0] + high[0])), float(0.5 * (low[1] + high[1]))), half


def heading_fan(seen: FieldPreview) -> HeadingFan:
    """Return the candidate headings where the boat is, weighed by the polar."""
    at, habits, twd = np.array([seen.here_en]), seen.conditions.habits, seen.conditions.twd_from_rad
    wanted, chosen = (math.atan2(v[0][0], v[0][1]) for v in (seen.wanted(at), seen.sailable(at)))
    if twd is None:
        speeds = np.full(len(FAN_RAD), habits.polar_mps[-1])
    else:
        twa = np.abs([difference_rad(twd, h) for h in FAN_RAD])
        speeds = np.where(
            twa < habits.no_go_half_rad - 1e-9, 0.0, np.interp(twa, habits.polar_twa_rad, habits.polar_mps)
        )
    return HeadingFan(
        headings_rad=FAN_RAD,
        speeds_mps=speeds,
        worth_mps=speeds * np.cos(FAN_RAD - wanted),
        wanted_rad=wrap_pi(wanted),
        chosen_rad=wrap_pi(chosen),
    )


def field_track(seen: FieldPreview, seconds: float = TRACK_S) -> NDArray[np.float64]:
    """Return a track by the field from where the boat is: rows of t, east, north, heading [s, m, rad].

    A boat that has its polar's speed at once and turns at its rate, the shore kept clear of, no vessels; it ends where
    the goal does. The station keeper is not in it.
    """
    habits, clearance = seen.conditions.habits, _clearance(seen.area)
    twd, here = seen.conditions.twd_from_rad, seen.here_en
    v = seen.sailable(np.array([here]))[0]
    heading, state, way_out, rows = math.atan2(v[0], v[1]), GuidanceState(), None, []
    most_s = min(seconds, seen.composed.for_s or seconds)
    for t in range(int(most_s)):
        speed = _speed(habits, twd, heading)
        now = replace(
            seen.conditions.seen,
            t_s=float(t),
            en_m=here,
            heading_rad=heading,
            velocity_en_mps=(speed * math.sin(heading), speed * math.cos(heading)),
        )
        rows.append((float(t), *here, heading))
        if _is_over(seen, here):
            break
        if seen.tree.leaves is not None:
            way_out = way_out_rad(now, seen.tree.leaves, habits, way_out)
        conditions = replace(seen.conditions, seen=now, way_out_rad=way_out)
        if float(lengths(seen.tree, conditions, np.array([here]))[0]) >= LEAST:
            intent = Intent(
                field=field_of(seen.tree, conditions), zone=zone_of(seen.tree, conditions), clearance=clearance
            )
            state, setpoint = step(state, now, intent, habits)
            turn = difference_rad(setpoint.heading_rad, heading)
            heading = wrap_pi(heading + max(-habits.turn_rate_radps, min(habits.turn_rate_radps, turn)))
        here = here[0] + speed * math.sin(heading), here[1] + speed * math.cos(heading)
    return np.asarray(rows)


def _is_over(seen: FieldPreview, here: PointEn) -> bool:
    until, water = seen.composed.until, seen.composed.water_en
    if until is Until.PLACE:
        return math.dist(here, seen.place_en) <= seen.radius_m
    return until is Until.OUTSIDE and water is not None and not shapely.covers(water, shapely.points(here))


def _speed(habits: GuidanceSettings, twd: float | None, heading: float) -> float:
    if twd is None:
        return habits.polar_mps[-1]
    return float(np.interp(abs(difference_rad(twd, heading)), habits.polar_twa_rad, habits.polar_mps))


def _clearance(area: LocalArea) -> Clearance | None:
    return area.clearance_m if area.polygons or area.limits is not None else None


def without_value(seen: FieldPreview) -> float:
    """Return the share of the square in which the field says nothing of where to go."""
    side = np.linspace(-seen.half_m, seen.half_m, 25)
    east, north = np.meshgrid(side + seen.centre_en[0], side + seen.centre_en[1])
    points = np.column_stack([east.ravel(), north.ravel()])
    conditions = replace(seen.conditions, way_out_rad=0.0)
    return float(np.mean(lengths(seen.tree, conditions, points) < LEAST))
