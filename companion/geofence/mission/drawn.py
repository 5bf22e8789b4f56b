"""A mission from a drawing: what a ground station has uploaded to the autopilot, with a mission file's own settings."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import msgspec

from companion.errors import InputError
from companion.geofence.document import Document
from companion.geofence.findings import Code, Finding, Severity
from companion.geofence.formats.fence_items import items_to_zones
from companion.geofence.formats.losses import Written
from companion.geofence.formats.qgc_plan import read_plan, write_plan
from companion.geofence.formats.rings import Findings
from companion.geofence.mission.course import REDRAW, course_of
from companion.geofence.mission.mission import Mission, assembled, place_troubles
from companion.geofence.mission.options import MissionOptions, RefugeOptions
from companion.geofence.shapes import ZoneKind
from companion.messages import GeoPoint, MissionItem
from companion.words import counted

SOURCE = "the drawing"
NO_NAME = "drawn"      # the mission of a drawing, without a mission file that names it
_TAG_DIGITS = 6        # of the drawing's hash in its mission's name: two drawings are two voyages


@dataclass(frozen=True, slots=True, kw_only=True)
class Drawn:
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
    items: Sequence[MissionItem], fence: Sequence[MissionItem], rally: Sequence[MissionItem],
    home: GeoPoint | None = None,
) -> Document:
    """Return the lists of an autopilot (the mission without its home) as a document; faults are in its findings."""
    findings = Findings()
    zones, return_point = items_to_zones(fence, findings, first=1)
    return Document(
        source=SOURCE, format="autopilot", zones=zones, items=tuple(items), home=home, rally=tuple(rally),
        return_point=return_point, findings=tuple(replace(f, place=f"fence {f.place}") for f in findings))


def kept(document: Document) -> Written:
    """Return a drawing as the file that is kept of it: a .plan, which QGroundControl opens again."""
    return write_plan(document)


def read_kept(text: str, source: str) -> Document:
    """Return a drawing that was kept. Raises InputError when it is none any more."""
    return read_plan(text, source).require_clean()


def drawn_mission(document: Document, settings: MissionOptions, path: Path, plan: Path) -> Drawn:
    """Return the mission of a drawing with the ``settings`` of the file at ``path``.

    Goals, laps and end come from its items, refuges from its rally points (beside those of the settings), and its fence
    is added to the settings' area. ``plan`` is where the drawing is kept: the mission names it as a file of its area.

    Raises:
        InputError: a file that the settings name, or what they say, cannot be believed.
    """
    course = course_of(document.items)
    refusals = [*(f for f in document.findings if f.severity is Severity.ERROR), *course.refusals]
    refusals += [_refusal(f"rally point {n}", "has no place (0, 0)") for n, r in enumerate(document.rally, start=1)
                 if not (r.lat_e7 or r.lon_e7)]
    if not document.items:
        refusals.append(_refusal("", "there is no mission on the autopilot" + (
            ", only a fence" if document.zones else ""), "draw waypoints and upload them"))
    elif not course.stops and not refusals:
        refusals.append(_refusal("", "it leads nowhere: there is no waypoint in it", "draw one and upload it"))
    if refusals:
        return Drawn(mission=None, refusals=tuple(refusals))
    options = msgspec.structs.replace(
        settings, name=f"{settings.name or NO_NAME} {tag(document)}", from_autopilot=True,
        goal=tuple(stop.goal(f"item {stop.number}") for stop in course.stops),
        refuge=(*settings.refuge, *(RefugeOptions(
            lat=r.point.lat_deg, lon=r.point.lon_deg, name=f"rally {n}")
            for n, r in enumerate(document.rally, start=1))),
        skipper=course.skipper(settings.skipper))
    # The file of the drawing belongs to the area by name; its zones are taken from the drawing itself.
    names = {f"[[goal]] {n}": f"item {stop.number}" for n, stop in enumerate(course.stops, start=1)}
    names |= {f"[[refuge]] {len(settings.refuge) + n}": f"rally point {n}" for n, _ in enumerate(document.rally, 1)}
    try:
        mission = assembled(options, path, document)
    except InputError as error:
        if error.place not in names:
            raise
        return Drawn(mission=None, refusals=(_refusal(names[error.place], error.problem),))
    area = msgspec.structs.replace(options.area, obstacles=(*options.area.obstacles, str(plan.absolute())))
    mission = replace(mission, options=msgspec.structs.replace(options, area=area))
    refusals = [_refusal(names.get(place, f"{path}: {place}"), problem, REDRAW if place in names else remedy)
                for place, problem, remedy in place_troubles(mission)]
    if refusals:
        return Drawn(mission=None, refusals=tuple(refusals))
    notes = [f for f in (*document.findings, *course.findings) if f.severity is not Severity.ERROR]
    if not any(z.kind is ZoneKind.INCLUSION for z in mission.area.fence.zones):
        solids = "nothing but its keep-out zones" if mission.area.solids else "nothing at all"
        notes.append(_note(f"there is no fence to stay inside of: {solids} limits the water that a plan may use"))
    return Drawn(mission=mission, notes=tuple(notes))


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
    return Finding(severity=Severity.ERROR, code=Code.NOT_CARRIED, place=place, text=text, remedy=remedy)


def _note(text: str) -> Finding:
    return Finding(severity=Severity.NOTE, code=Code.NOT_CARRIED, place="", text=text)
