"""A mission from a drawing: what a ground station has uploaded to the autopilot, with a mission file's own settings."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import msgspec

from companion.errors import InputError
from companion.geo.frame import LocalFrame
from companion.geofence.document import Code, Document, Finding, FindingLevel
from companion.geofence.formats.fence_items import items_to_zones
from companion.geofence.formats.losses import Written
from companion.geofence.formats.qgc_plan import read_plan, write_plan
from companion.geofence.formats.rings import Findings
from companion.geofence.mission.mission import Mission, assembled, place_troubles
from companion.geofence.mission.options import (
    BoxOptions,
    GoalOptions,
    MissionOptions,
    PointOptions,
    RefugeOptions,
    SkipperOptions,
)
from companion.geofence.shapes import ZoneKind
from companion.messages import ENDING, Command, GeoPoint, MissionItem
from companion.words import counted

# From the items of a drawn mission to the goals of a voyage: laps written out, the end, and what is refused by name.
#
# A ground station draws for an autopilot that sails straight lines. The voyage takes from it where to go; whatever else
# the items ask for is either what the voyage does, too, or refused: nothing that was drawn is passed over in silence.

MAX_GOALS = 1000  # that laps may make of a drawing; a voyage of more is meant otherwise
STAY_M = 25.0  # half the side of the box in which the boat stays: its loiter swings 12 m
MAX_STEPS = 20 * MAX_GOALS  # jumps among jumps that pass no waypoint end here
GLOBAL_FRAMES = frozenset({0, 3, 5, 6, 10, 11})  # MAV_FRAMEs whose x and y are latitude and longitude
REDRAW = "change the drawing and upload it again"

_LOITERS = frozenset({Command.NAV_LOITER_UNLIM, Command.NAV_LOITER_TIME, Command.NAV_LOITER_TURNS})
_STOPS = _LOITERS | {Command.NAV_WAYPOINT}


@dataclass(frozen=True, slots=True, kw_only=True)
class MissionStop:
    """A place to reach, the number of the item that it was drawn as (from 1: 0 is home), and how long to stay [s]."""

    number: int
    point: GeoPoint
    stay_s: float = 0.0

    def goal(self, name: str, radius_m: float | None = None) -> GoalOptions:
        """Return it as a goal of a mission file: where it stays, a box about it."""
        if self.stay_s <= 0.0:
            there = PointOptions(lat=self.point.lat_deg, lon=self.point.lon_deg, name=name)
            return there if radius_m is None else msgspec.structs.replace(there, radius_m=radius_m)
        frame = LocalFrame(self.point)
        corners = (frame.geo_from_en(e * STAY_M, n * STAY_M) for e, n in ((-1, -1), (1, -1), (1, 1), (-1, 1), (-1, -1)))
        ring = ", ".join(f"{corner.lon_deg:.7f} {corner.lat_deg:.7f}" for corner in corners)
        return BoxOptions(polygon=f"POLYGON (({ring}))", for_s=self.stay_s, name=name)


@dataclass(frozen=True, slots=True, kw_only=True)
class DrawnCourse:
    """What a drawn mission says.

    Attributes:
        stops: in the order of the voyage, those of one lap.
        laps: how often they are sailed.
        end: what its last item asks for, None: nothing.
        station_s: how long it asks to stay at the last goal [s], 0: until told, or not at all.
        findings: what is refused (errors, each with the number of its item) and what is done otherwise (notes).
    """

    stops: tuple[MissionStop, ...] = ()
    laps: int = 1
    end: Literal["loiter", "home"] | None = None
    station_s: float = 0.0
    findings: tuple[Finding, ...] = ()

    @property
    def refusals(self) -> tuple[Finding, ...]:
        """What of it cannot be sailed."""
        return tuple(f for f in self.findings if f.severity is FindingLevel.ERROR)

    def skipper(self, options: SkipperOptions) -> SkipperOptions:
        """Return the ``[skipper]`` table with laps, end and station as they are drawn; what is not drawn stays."""
        drawn: dict[str, Any] = {"laps": self.laps, "end": self.end, "station_s": self.station_s}
        plain = DrawnCourse()
        return msgspec.structs.replace(
            options, **{name: value for name, value in drawn.items() if value != getattr(plain, name)}
        )


def command_name(command: int) -> str:
    """Return what people call a command: ``DO_CHANGE_SPEED``; its number where it has no name."""
    from pymavlink.dialects.v20 import ardupilotmega as wire

    entry = wire.enums["MAV_CMD"].get(command)
    return entry.name.removeprefix("MAV_CMD_") if entry is not None else f"command {command}"


def course_of(items: Sequence[MissionItem]) -> DrawnCourse:
    """Return the voyage that mission items (without home) ask for, as ArduPilot would go through them."""
    found = _Found(items)
    jumps = _judged(items, found)
    walked, is_whole = _walk(items, jumps)
    if not is_whole:
        found.say(max(jumps), f"with this DO_JUMP the voyage has more than {MAX_GOALS} goals", "draw fewer repeats")
        walked, _ = _walk(items, {})
    last = walked[-1] if walked else 0
    ending = items[last - 1].command if last else None
    end: Literal["loiter", "home"] | None = "loiter" if ending in _LOITERS else None
    if ending == Command.NAV_RETURN_TO_LAUNCH:
        end, walked = "home", walked[:-1]
    if ending in ENDING and last < len(items):
        found.say(
            last + 1,
            f"stands behind item {last} ({found.name(last)}), where the mission ends: it would never be sailed",
            "take one of them out",
        )
    final = walked[-1] if walked and end != "home" else None
    station_s = 0.0 if final is None else max(0.0, _stay_s(items[final - 1]))
    if final is not None and station_s > 0.0:
        found.say(
            final, f"{found.name(final)} of {station_s:g} s is the last: she stays until told", "", FindingLevel.NOTE
        )
    stays = {n: max(0.0, _stay_s(items[n - 1])) for n in walked}
    if final is not None and walked.count(final) == 1:
        stays[final] = 0.0  # the mission's own end keeps the boat
    stops = [
        MissionStop(number=n, point=items[n - 1].point, stay_s=stays[n]) for n in walked if _has_place(items[n - 1])
    ]
    lap = _lap(stops) if jumps else len(stops)
    return DrawnCourse(
        stops=tuple(stops[:lap]),
        laps=len(stops) // lap if lap else 1,
        end=end,
        station_s=station_s,
        findings=found.ordered(),
    )


class _Found:
    """What is found in items, each thing once."""

    def __init__(self, items: Sequence[MissionItem]) -> None:
        self._items = items
        self._findings: dict[tuple[int, str], Finding] = {}

    def name(self, number: int) -> str:
        return command_name(self._items[number - 1].command)

    def say(self, number: int, text: str, remedy: str = REDRAW, severity: FindingLevel = FindingLevel.ERROR) -> None:
        code = Code.NOT_CARRIED if severity is FindingLevel.ERROR else Code.DROPPED
        self._findings.setdefault(
            (number, text), Finding(severity=severity, code=code, place=f"item {number}", text=text, remedy=remedy)
        )

    def ordered(self) -> tuple[Finding, ...]:
        return tuple(self._findings[key] for key in sorted(self._findings, key=lambda key: key[0]))


def _judged(items: Sequence[MissionItem], found: _Found) -> dict[int, tuple[int, int]]:
    """Refuse what no voyage does; return the jumps that can be made: number -> (target, how often)."""
    jumps: dict[int, tuple[int, int]] = {}
    for number, item in enumerate(items, start=1):
        name = found.name(number)
        if item.command == Command.DO_JUMP:
            problem, remedy = _jump_trouble(items, number, item)
            if problem:
                found.say(number, f"{name} {problem}", remedy)
            else:
                jumps[number] = int(item.params[0]), int(item.params[1])
        elif item.command == Command.NAV_LOITER_TURNS:
            found.say(number, f"{name}: a sailboat does not sail circles", "draw NAV_LOITER_UNLIM, or a waypoint")
        elif item.command not in _STOPS and item.command != Command.NAV_RETURN_TO_LAUNCH:
            found.say(number, f"{name} is nothing that a voyage does", "take it out of the drawing and upload it again")
        if item.command in _STOPS and item.frame not in GLOBAL_FRAMES:
            found.say(
                number,
                f"{name} is in frame {item.frame}, which has no latitude and longitude",
                "draw it in a global frame",
            )
        elif item.command in _STOPS and not _has_place(item):
            found.say(number, f"{name} has no place (0, 0)", "place it on the map and upload again")
    return jumps


def _stay_s(item: MissionItem) -> float:
    return item.params[0] if item.command in {Command.NAV_WAYPOINT, Command.NAV_LOITER_TIME} else 0.0


def _lap(stops: list[MissionStop]) -> int:
    """Return how many stops are one lap: all of them, where they do not repeat."""
    return next(
        (p for p in range(1, len(stops)) if len(stops) % p == 0 and stops == stops[:p] * (len(stops) // p)), len(stops)
    )


def _has_place(item: MissionItem) -> bool:
    return bool(item.lat_e7 or item.lon_e7)


def _jump_trouble(items: Sequence[MissionItem], number: int, item: MissionItem) -> tuple[str, str]:
    """Return what is wrong with a DO_JUMP, and the remedy; empty when nothing is."""
    target, repeats = item.params[0], item.params[1]
    if target == number:
        return "jumps to itself", "let it jump to an earlier item"
    if target != int(target) or not 1 <= target <= len(items):
        return f"jumps to item {target:g}, which is not there", "let it jump to an earlier item"
    if target > number:
        return (
            f"jumps forward to item {target:g}: what lies between would be passed over",
            "take out what shall not be sailed",
        )
    if repeats < 0:
        return "repeats without end (-1)", f"write how often, up to {MAX_GOALS} goals in all"
    if repeats > MAX_GOALS:
        return f"repeats {repeats:g} times", f"write fewer: {MAX_GOALS} goals in all are the most"
    return "", ""


def _walk(items: Sequence[MissionItem], jumps: dict[int, tuple[int, int]]) -> tuple[list[int], bool]:
    """Return the numbers of the items that are sailed, in their order, and whether these are all of them.

    The count of a jump is not begun anew when an outer one comes by again: so ArduPilot has it.
    """
    walked: list[int] = []
    done = dict.fromkeys(jumps, 0)
    number = 1
    for _ in range(len(items) + (MAX_STEPS if jumps else 1)):
        if number > len(items):
            return walked, True
        item = items[number - 1]
        if number in jumps and done[number] < jumps[number][1]:
            done[number] += 1
            number = jumps[number][0]
            continue
        if item.command in ENDING:
            return [*walked, number], True
        if item.command in _STOPS:
            walked.append(number)
            if jumps and len(walked) > MAX_GOALS:
                break
        number += 1
    return walked, False


SOURCE = "the drawing"
NO_NAME = "drawn"  # the mission of a drawing, without a mission file that names it
_TAG_DIGITS = 6  # of the drawing's hash in its mission's name: two drawings are two voyages


@dataclass(frozen=True, slots=True, kw_only=True)
class DrawnMission:
    """A drawing judged: the mission that it makes, or why it makes none.

    Attributes:
        mission: None when something is refused.
        refusals: every one of them, each with the item's number and a remedy.
        notes: what is worth knowing of a mission that can be sailed.
    """

    mission: Mission | None
    refusals: tuple[Finding, ...] = ()
    notes: tuple[Finding, ...] = ()


def drawing_of(
    items: Sequence[MissionItem],
    fence: Sequence[MissionItem],
    rally: Sequence[MissionItem],
    home: GeoPoint | None = None,
) -> Document:
    """Return the lists of an autopilot (the mission without its home) as a document; faults are in its findings."""
    findings = Findings()
    zones, return_point = items_to_zones(fence, findings, first=1)
    return Document(
        source=SOURCE,
        format="autopilot",
        zones=zones,
        items=tuple(items),
        home=home,
        rally=tuple(rally),
        return_point=return_point,
        findings=tuple(replace(f, place=f"fence {f.place}") for f in findings),
    )


def stored_text(document: Document) -> Written:
    """Return a drawing as the file that is kept of it: a .plan, which QGroundControl opens again."""
    return write_plan(document)


def read_stored(text: str, source: str) -> Document:
    """Return a drawing that was kept. Raises InputError when it is none any more."""
    return read_plan(text, source).require_clean()


def drawn_mission(document: Document, settings: MissionOptions, path: Path, plan: Path) -> DrawnMission:
    """Return the mission of a drawing with the ``settings`` of the file at ``path``.

    Goals, laps and end come from its items, refuges from its rally points (beside those of the settings), and its fence
    is added to the settings' area. ``plan`` is where the drawing is kept: the mission names it as a file of its area.

    Raises:
        InputError: a file that the settings name, or what they say, cannot be believed.
    """
    course = course_of(document.items)
    refusals = [*(f for f in document.findings if f.severity is FindingLevel.ERROR), *course.refusals]
    refusals += [
        _refusal(f"rally point {n}", "has no place (0, 0)")
        for n, r in enumerate(document.rally, start=1)
        if not (r.lat_e7 or r.lon_e7)
    ]
    if not document.items:
        refusals.append(
            _refusal(
                "",
                "there is no mission on the autopilot" + (", only a fence" if document.zones else ""),
                "draw waypoints and upload them",
            )
        )
    elif not course.stops and not refusals:
        refusals.append(_refusal("", "it leads nowhere: there is no waypoint in it", "draw one and upload it"))
    if refusals:
        return DrawnMission(mission=None, refusals=tuple(refusals))
    options = msgspec.structs.replace(
        settings,
        name=f"{settings.name or NO_NAME} {tag(document)}",
        from_autopilot=True,
        goal=tuple(stop.goal(f"item {stop.number}") for stop in course.stops),
        refuge=(
            *settings.refuge,
            *(
                RefugeOptions(lat=r.point.lat_deg, lon=r.point.lon_deg, name=f"rally {n}")
                for n, r in enumerate(document.rally, start=1)
            ),
        ),
        skipper=course.skipper(settings.skipper),
    )
    # The file of the drawing belongs to the area by name; its zones are taken from the drawing itself.
    names = {f"[[goal]] {n}": f"item {stop.number}" for n, stop in enumerate(course.stops, start=1)}
    names |= {f"[[refuge]] {len(settings.refuge) + n}": f"rally point {n}" for n, _ in enumerate(document.rally, 1)}
    try:
        mission = assembled(options, path, document)
    except InputError as error:
        if error.place not in names:
            raise
        return DrawnMission(mission=None, refusals=(_refusal(names[error.place], error.problem),))
    area = msgspec.structs.replace(options.area, obstacles=(*options.area.obstacles, str(plan.absolute())))
    mission = replace(mission, options=msgspec.structs.replace(options, area=area))
    refusals = [
        _refusal(names.get(place, f"{path}: {place}"), problem, REDRAW if place in names else remedy)
        for place, problem, remedy in place_troubles(mission)
    ]
    if refusals:
        return DrawnMission(mission=None, refusals=tuple(refusals))
    notes = [f for f in (*document.findings, *course.findings) if f.severity is not FindingLevel.ERROR]
    if not any(z.kind is ZoneKind.INCLUSION for z in mission.area.fence.zones):
        solids = "nothing but its keep-out zones" if mission.area.solids else "nothing at all"
        notes.append(_note(f"there is no fence to stay inside of: {solids} limits the water that a plan may use"))
    return DrawnMission(mission=mission, notes=tuple(notes))


def tag(document: Document) -> str:
    """Return a few digits that tell a drawing from others."""
    content = replace(document, home=None, source="", format="", findings=())
    return hashlib.sha256(write_plan(content).data).hexdigest()[:_TAG_DIGITS]


def hindrance(items: Sequence[MissionItem]) -> str:
    """Return why a mission that somebody has uploaded cannot be sailed by its items, empty where they can be."""
    course = course_of(items)
    if course.refusals:
        return f"{course.refusals[0].place}: {course.refusals[0].text}"
    return "" if course.stops else "it leads nowhere"


def offer(items: Sequence[MissionItem], *, adopts: bool) -> str:
    """Return what is said of a mission that somebody has uploaded; ``adopts``: this voyage may go on by it."""
    count = f"a mission of {counted(len(items), 'item')} was drawn"
    trouble = hindrance(items)
    if trouble:
        return f"{count} that cannot be adopted: {trouble}"
    return f"{count}: adopt it by the order adopt" if adopts else f"{count}: companion run --from-autopilot sails such"


def _refusal(place: str, text: str, remedy: str = REDRAW) -> Finding:
    return Finding(severity=FindingLevel.ERROR, code=Code.NOT_CARRIED, place=place, text=text, remedy=remedy)


def _note(text: str) -> Finding:
    return Finding(severity=FindingLevel.NOTE, code=Code.NOT_CARRIED, place="", text=text)
