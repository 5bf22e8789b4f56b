"""A mission file checked as the boat would read it: what refuses it, and findings of what is hardly meant."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import shapely

from companion.boat import loiter_swing_m
from companion.compose import config_of, field_findings_of, tide_of, voyage_of
from companion.current import hour_words, span_words
from companion.current.tide import ROWS_REMEDY
from companion.errors import InputError
from companion.geofence import Code, Finding, FindingLevel, Mission
from companion.geofence.area import grown_m
from companion.geofence.check import AreaConditions, check_area
from companion.geofence.mission import place_troubles, read_mission
from companion.messages import GeoPoint
from companion.mission_check.lines import line_findings, voyage_gates
from companion.mission_check.sailable import require_sailable
from companion.skipper import SkipperConfig
from companion.skipper.planning import LACK_M, aim_near, straight_track_m
from companion.skipper.step import lacking_m
from companion.skipper.way import KEEP_SHARE, SAME_M, Gate, Side

HAIR_M = 0.005  # a depth is written in centimetres
LEAST_NO_GO_DEG = 20.0  # an ice boat's
WINDS_MPS = range(1, 13)  # in which a loiter is looked at: no gale is ordinary weather
SMALL_M = 3.0  # a fix is good to 2.5 m


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
    path: Path, *, from_deg: float | None = None, given: Mapping[Path, bytes] | None = None, unix_s: float | None = None
) -> CheckedMission:
    """Read a mission and its area as the boat will, and look for what is wrong with it: never raises InputError.

    ``from_deg``: where the wind comes from, in which gaps are looked at (else the mission's). ``given``: see
    ``load_mission``. ``unix_s``: the time now, by which hours that a chart was made for are over.
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
                    *_out_of_reach(mission),
                    *_roundings(mission),
                    *line_findings(mission),
                    *_marks_too_near(mission),
                    *_circles(mission),
                    *_drying(mission),
                    *_boxes(mission),
                    *_tide(mission),
                )
            ),
            *charted_findings(mission, unix_s),
            *_doubts(mission),
            *(f for f in found if f.severity is not FindingLevel.ERROR or f.code not in told),
        ),
    )


def _out_of_reach(mission: Mission) -> Iterator[Finding]:
    """Yield the places to reach inside whose radius none has room: by the ladder's last step, or from a wind on.

    Room is the margin's floor and what a straight leg's track takes; the ladder's last step asks for no more than the
    margin, but where the margin leaves less hardly a way is found that keeps the floor.
    """
    voyage, config = voyage_of(mission), config_of(mission)
    floor_m = min(mission.margin_floor_m, mission.margin_m)
    for number, goal in enumerate(voyage.goals, start=1):
        if goal.side is not Side.NONE or goal.line or goal.box or goal.search or goal.field:
            continue
        needs_m = {0: _least_m(mission)}  # in any wind
        needs_m |= {tws: floor_m + straight_track_m(config, voyage.boat, tws) for tws in WINDS_MPS}
        found = (
            (tws, needed_m)
            for tws, needed_m in needs_m.items()
            if aim_near(voyage.area, config, goal.en_m, goal.radius_m, needed_m, gate=0) is None
        )
        tws, needed_m = next(found, (0, 0.0))
        if needed_m <= 0.0:
            continue
        clear_m = float(voyage.area.clearance_m([goal.en_m])[0])
        never = f"hardly reached in {tws} m/s of wind and more" if tws else "never sailed to"
        yield Finding(
            severity=FindingLevel.WARNING if tws else FindingLevel.ERROR,
            code=Code.GOAL_OUTSIDE,
            place=f"[[goal]] {number}",
            text=f"lies {max(0.0, clear_m):.1f} m from {voyage.area.nearest_name(goal.en_m) or 'something'} and is "
            f"{never}: no place inside its radius of {goal.radius_m:g} m is {grown_m(needed_m):.1f} m clear, the floor "
            "and what her track takes",
            remedy="move it off, or let radius_m be larger, or [area] margin_m and margin_floor_m be smaller",
        )


def _least_m(mission: Mission) -> float:
    """Return the least margin that a plan keeps in any wind [m]: the ladder's floor, and a straight leg's track."""
    track_m = straight_track_m(config_of(mission), voyage_of(mission).boat, WINDS_MPS[0])
    return min(min(mission.margin_floor_m, mission.margin_m) + track_m, mission.margin_m)


def _roundings(mission: Mission) -> Iterator[Finding]:
    """Yield the buoys with a place of their circle that has no room by the margin; by the floor: it is never sailed."""
    worst: dict[int, tuple[float, Gate]] = {}
    voyage, gates = voyage_gates(mission)
    for number, gate in gates:
        clear_m = float(voyage.area.clearance_m([gate.en_m])[0])
        if gate.buoy_en_m is not None and clear_m < min(mission.margin_m, worst.get(number, (math.inf, gate))[0]):
            worst[number] = (clear_m, gate)
    least_m = _least_m(mission)
    for number, (clear_m, gate) in worst.items():
        goal = voyage.goals[number - 1]
        near = voyage.area.nearest_name(gate.en_m) or "something"
        never = f", and no plan comes nearer than {least_m:g} m: it is never sailed" if clear_m < least_m else ""
        yield Finding(
            severity=FindingLevel.ERROR if never else FindingLevel.WARNING,
            code=Code.NARROW_GAP,
            place=f"[[goal]] {number} rounding",
            text=f"rounded {goal.rounding_m:.0f} m off with {gate.name} to {goal.side.value} she comes to "
            f"{max(0.0, clear_m):.1f} m from {near}; the margin is {mission.margin_m:g} m{never}",
            remedy="round it closer (radius_m and [area] margin_m say how far off), or leave it on the other hand",
        )


def _marks_too_near(mission: Mission) -> Iterator[Finding]:
    """Yield the marks whose rounding leads through what is kept clear of another: to there no plan is made."""
    told = set[int]()
    voyage, gates = voyage_gates(mission)
    marks = [(n, g) for n, g in enumerate(voyage.goals, start=1) if g.side is not Side.NONE]
    for number, gate in gates:
        for other, mark in marks:
            off_m = math.dist(mark.en_m, gate.en_m)
            between_m = math.dist(mark.en_m, voyage.goals[number - 1].en_m)
            if number in told or off_m >= KEEP_SHARE * mark.rounding_m or between_m <= SAME_M:
                continue
            told.add(number)
            is_rounded = gate.buoy_en_m is not None
            own_m = voyage.goals[number - 1].rounding_m if is_rounded else 0.0
            apart_m = math.ceil(own_m + KEEP_SHARE * mark.rounding_m)
            yield Finding(
                severity=FindingLevel.ERROR,
                code=Code.ROUNDING,
                place=f"[[goal]] {number}",
                text=f"{'is rounded' if is_rounded else 'lies'} {off_m:.1f} m from goal {other}'s mark; "
                f"every plan keeps {KEEP_SHARE * mark.rounding_m:.1f} m clear of that: it is never sailed to",
                remedy="let radius_m of what is rounded, or [area] margin_m, be smaller, or let the two lie "
                f"{apart_m:.0f} m apart",
            )


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
            kept_m = 0.0 if place == "[start]" else KEEP_SHARE * goal.rounding_m  # nearer it is an error
            if max(SAME_M, kept_m) < off_m < goal.rounding_m or (place == "[start]" and off_m <= SAME_M):
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
        if goal.is_plain and goal.radius_m < SMALL_M:
            yield Finding(
                severity=FindingLevel.WARNING,
                code=Code.SMALL,
                place=f"[[goal]] {number} radius_m",
                text=f"{goal.radius_m:g} m: a fix is good to 2.5 m, and at 3 m/s she is past it in a second or two",
                remedy=f"write {SMALL_M:g} or more, or she may sail about it for ever",
            )
    yield from _there_already(mission)
    if mission.boat.no_go_half_deg < LEAST_NO_GO_DEG and mission.autopilot.frame == "sailboat":
        yield Finding(
            severity=FindingLevel.WARNING,
            code=Code.ODD_BOAT,
            place="[boat] no_go_half_deg",
            text=f"{mission.boat.no_go_half_deg:g}: no boat sails so near to the wind; half of the zone, in degrees",
            remedy="write what she points at, 40 to 60 for most, or measure it: companion boat learn",
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


def _there_already(mission: Mission) -> Iterator[Finding]:
    """Yield the places that are reached where the one before them is: she never sails to them."""
    voyage = voyage_of(mission)
    before = None if mission.start is None else ("[start]", voyage.frame.en_from_geo(mission.start))
    for number, goal in enumerate(voyage.goals, start=1):
        is_place = goal.side is Side.NONE and not (goal.line or goal.box or goal.search or goal.field)
        if before is not None and is_place:
            off_m = math.dist(before[1], goal.en_m)
            if off_m <= goal.radius_m and (off_m > SAME_M or number == 1):
                yield Finding(
                    severity=FindingLevel.WARNING,
                    code=Code.THERE_ALREADY,
                    place=f"[[goal]] {number}",
                    text=f"is reached where {before[0]} is, {off_m:.0f} m from it: its radius is {goal.radius_m:g} m",
                    remedy="let radius_m be smaller, or move it",
                )
        before = (f"[[goal]] {number}", goal.en_m)


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


def _boxes(mission: Mission) -> Iterator[Finding]:
    """Yield the boxes in which a loiter has room in moderate winds only, and those that dry: either ends her stay."""
    voyage = voyage_of(mission)
    config = SkipperConfig(margin_m=mission.margin_m, margin_floor_m=mission.margin_floor_m)
    floor_m, least_m = min(config.margin_floor_m, config.margin_m), config.loiter_radius_m
    swings_m = {tws: max(least_m, round(loiter_swing_m(voyage.boat.polar, tws))) for tws in WINDS_MPS}
    in_winds = {tws: replace(config, loiter_radius_m=swing_m) for tws, swing_m in swings_m.items()}
    for number, goal in enumerate(voyage.goals, start=1):
        if goal.box is None:
            continue
        has_m = float(voyage.area.clearance_m([goal.en_m])[0])
        winds = [tws for tws, known in in_winds.items() if lacking_m(known, voyage.area, goal.en_m) > LACK_M]
        if winds:
            strong = "any wind" if winds[0] == WINDS_MPS[0] else f"{winds[0]} m/s of wind and more"
            yield Finding(
                severity=FindingLevel.WARNING,
                code=Code.SMALL,
                place=f"[[goal]] {number} polygon",
                text=f"the roomiest place in it has {has_m:.0f} m about it: in {strong} a "
                f"loiter comes below the margin's floor of {floor_m:g} m there, and she gives the box up, or leaves it",
                remedy="choose a box with more room about it, or let [area] margin_floor_m be smaller",
            )
        for water in voyage.drying:
            if shapely.intersects_xy(water.polygon, *goal.en_m):
                yield Finding(
                    severity=FindingLevel.WARNING,
                    code=Code.DRIES,
                    place=f"[[goal]] {number} polygon",
                    text=f"the roomiest place in it lies in {water.name}, which dries: her stay ends before it does",
                    remedy="choose a box that is deep enough at low water",
                )


def _tide(mission: Mission) -> Iterator[Finding]:
    """Yield that the tide's table leaves hours out between its rows: what dries is closed in them."""
    table = tide_of(mission)
    if table is not None and table.gaps():
        yield Finding(
            severity=FindingLevel.WARNING,
            code=Code.DRIES,
            place="[area] tide",
            text=f"{span_words(table)}: nothing is known of the tide then, and what dries is closed",
            remedy=ROWS_REMEDY,
        )


def charted_findings(mission: Mission, unix_s: float | None) -> Iterator[Finding]:
    """Yield the charts whose obstacles were made for less water than the boat needs, or for the tide of some hours.

    ``unix_s``: when she sails; hours that do not hold then are a warning, others a note.
    """
    draft_m = mission.boat.draft_m
    for charted in mission.area.charted:
        if draft_m is not None and draft_m + mission.options.area.under_keel_m > charted.needs_m + HAIR_M:
            yield Finding(
                severity=FindingLevel.WARNING,
                code=Code.CHARTED,
                place="",
                source=charted.source,
                text=f"is made for {charted.needs_m:g} m of water, and this boat needs "
                f"{draft_m + mission.options.area.under_keel_m:g} m (draft_m and under_keel_m)",
                remedy="import the chart again",
            )
        if charted.hours_s is not None:
            begins_s, ends_s = charted.hours_s
            holds = unix_s is None or begins_s <= unix_s <= ends_s
            yield Finding(
                severity=FindingLevel.NOTE if holds else FindingLevel.WARNING,
                code=Code.CHARTED,
                place="",
                source=charted.source,
                text=f"reckons with {charted.tide_m:g} m of tide, from {hour_words(begins_s)} to {hour_words(ends_s)} "
                "alone: at other hours there is less water",
                remedy="" if holds else "sail in those hours, or import the chart again",
            )
