"""Missions from drawings and drawings from missions: a TOML with its area files, or one document."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

import msgspec

from companion.geo.frame import LocalFrame
from companion.geofence.area import Area, Fence
from companion.geofence.document import Code, Document, Finding, FindingLevel
from companion.geofence.formats.losses import Losses, Written
from companion.geofence.formats.registry import write
from companion.geofence.mission.autopilot_mission import MissionStop, course_of
from companion.geofence.mission.mission import Mission, trouble_at
from companion.geofence.mission.options import AreaOptions, MissionOptions, RefugeOptions, SkipperOptions, StartOptions
from companion.geofence.mission.text import dump_options
from companion.geofence.shapes import Circle, Zone, ZoneKind
from companion.messages import Command, GeoPoint, waypoint


def document_of(mission: Mission) -> Document:
    """Return a mission as a document: goals as waypoints, the start as home, obstacles and fence as zones."""
    return Document(
        source=str(mission.path),
        format="toml",
        zones=(*mission.area.fence.zones, *(o.zone() for o in mission.area.obstacles)),
        items=tuple(waypoint(g.point) for g in mission.goals),
        item_names=tuple(g.name for g in mission.goals) if any(g.name for g in mission.goals) else (),
        home=mission.start,
        rally=tuple(waypoint(r.point, command=Command.NAV_RALLY_POINT) for r in mission.refuges),
    )


def drawing_findings(document: Document) -> tuple[Finding, ...]:
    """Return what of a drawing lies in what it keeps out of, or beyond what it keeps in: waypoints are errors."""
    places = [(f"item {n}", i.point) for n, i in enumerate(document.items, start=1) if i.lat_e7 or i.lon_e7]
    others = [] if document.home is None else [("home", document.home)]
    others += [(f"rally point {n}", i.point) for n, i in enumerate(document.rally, start=1)]
    if not (places or others) or not document.zones:
        return ()
    frame = LocalFrame((places or others)[0][1])
    limits = tuple(z for z in document.zones if z.kind is ZoneKind.INCLUSION)
    local = Area(obstacles=document.as_obstacles(AreaOptions().point_radius_m), fence=Fence(zones=limits)).local(frame)
    return tuple(
        Finding(
            severity=FindingLevel.ERROR if place in dict(places) else FindingLevel.WARNING,
            code=Code.GOAL_OUTSIDE,
            place=place,
            text=f"{point.lat_deg:.6f}, {point.lon_deg:.6f} {problem}",
            remedy="move it into free water, or draw the zone anew",
        )
        for place, point in (*places, *others)
        if (problem := trouble_at(local, frame.en_from_geo(point)))
    )


def goal_losses(mission: Mission) -> Losses:
    """Return what of a mission no other format carries."""
    losses = Losses()
    if any(g.rounding for g in mission.goals):
        losses.add(FindingLevel.WARNING, "the side on which marks are left is not carried by this format")
    if any(g.gate is not None for g in mission.goals):
        losses.add(FindingLevel.WARNING, "of a gate only the middle between its marks is carried by this format")
    if any(g.box or g.search for g in mission.goals):
        losses.add(FindingLevel.WARNING, "of a box or a search only its roomiest place is carried by this format")
    if any(g.field for g in mission.goals):
        losses.add(
            FindingLevel.WARNING,
            "of a field only the place where the mission leads meanwhile is carried by this format",
        )
    if _says(mission.options.goal, "radius_m"):
        losses.add(FindingLevel.WARNING, "the radius within which a goal is reached is not carried by this format")
    if any(g.heading_deg is not None for g in mission.goals):
        losses.add(FindingLevel.WARNING, "the heading that plans arrive at a goal with is not carried by this format")
    if any(g.bandwidth_m is not None for g in mission.goals):
        losses.add(FindingLevel.WARNING, "the width of the lane that leads to a goal is not carried by this format")
    if mission.options.start is not None and _says((mission.options.start,), "heading_deg"):
        losses.add(FindingLevel.NOTE, "the heading at the start is not carried by this format")
    if any(refuge.name for refuge in mission.refuges):
        losses.add(FindingLevel.NOTE, "the names of refuges are not carried by this format")
    if _says(mission.options.refuge, "radius_m"):
        losses.add(FindingLevel.WARNING, "the radius of a refuge is not carried by this format")
    if mission.drying:
        losses.add(FindingLevel.WARNING, "the water that dries is not carried by this format")
    own = own_settings(mission.options)
    if own:
        losses.add(FindingLevel.NOTE, f"the mission's own settings ({', '.join(own)}) are not carried by this format")
    return losses


def _says(tables: Sequence[msgspec.Struct], key: str) -> bool:
    """Return whether one of the tables has another value of ``key`` than its default, which a reader takes."""
    fields = ((table, f) for table in tables for f in msgspec.structs.fields(table) if f.name == key)
    return any(getattr(table, key) != f.default for table, f in fields)


# What of a mission file a document holds itself, or where ``goal_losses`` has its own words for what it does not.
_CARRIED = {"goal", "from_autopilot", "start", "refuge", "area"}
_CARRIED_OF_AREA = {"obstacles", "fence", "axis", "point_radius_m", "drying"}


def own_settings(options: MissionOptions) -> list[str]:
    """Return the names of the keys and tables that differ from their defaults and that no document holds."""
    default = MissionOptions()
    named = [name for name in MissionOptions.__struct_fields__ if name not in _CARRIED]
    of_area = [name for name in AreaOptions.__struct_fields__ if name not in _CARRIED_OF_AREA]
    return [
        *(name for name in named if getattr(options, name) != getattr(default, name)),
        *(f"area.{name}" for name in of_area if getattr(options.area, name) != getattr(default.area, name)),
    ]


# Nothing is permitted by default; a new file names what could be.
PERMITS = """
[operator]            # what the companion may do uninvited
set_auto = false      # upload missions, set AUTO and the modes of the watchdogs
arm = false           # arm
guided = false        # steer under GUIDED: out of irons, round a vessel
upload_fence = false  # put the fence on the autopilot and switch it on
trim_vane = false     # put a vane right that is turned, by WNDVN_DIR_OFS
# orders = ["hold", "go_on", "refuge", "home"]   # what the crew may order over the radio; "all"
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class MissionFiles:
    """A mission TOML and the area files beside it, ready to be written: name -> content."""

    toml: bytes
    files: dict[str, bytes]
    losses: tuple[Finding, ...] = ()


def mission_files(
    document: Document,
    name: str,
    *,
    start: GeoPoint | None = None,
    goals: tuple[GeoPoint, ...] = (),
    margin_m: float | None = None,
    floor_m: float | None = None,
    radius_m: float | None = None,
    point_radius_m: float | None = None,
    land: Document | None = None,
) -> MissionFiles:
    """Return the files of a mission made from a drawing.

    Goals are ``goals``, or the document's waypoints in order; the start is ``start``, or its home; its rally points
    are refuges. Its zones, and those of ``land``, become the area. Raises ValueError when there is no goal.
    """
    losses = Losses()
    course = course_of(() if goals else document.items)
    for finding in course.findings:
        is_loss = finding.severity is FindingLevel.ERROR
        losses.add(
            FindingLevel.WARNING if is_loss else FindingLevel.NOTE,
            f"{finding.place}: {finding.text}" + (": not carried over" if is_loss else ""),
        )
    names = document.item_names or ("",) * len(document.items)
    points = [MissionStop(number=n, point=point).goal("", radius_m) for n, point in enumerate(goals, start=1)]
    goal_options = points or [stop.goal(names[stop.number - 1], radius_m) for stop in course.stops]
    if not goal_options:
        raise ValueError("there is no goal: give --goal, or draw waypoints")
    home = start or document.home
    whole = replace(
        document,
        zones=(*document.zones, *(land.zones if land else ())),
        marks=(*document.marks, *(land.marks if land else ())),
    )
    stem = re.sub(r"[^\w-]+", "-", name).strip("-").lower() or "mission"
    files: dict[str, bytes] = {}
    solid = replace(whole, zones=tuple(z for z in whole.zones if z.kind is ZoneKind.EXCLUSION))
    limits = replace(whole, zones=tuple(z for z in whole.zones if z.kind is ZoneKind.INCLUSION), marks=())
    obstacle_names: tuple[str, ...] = ()
    fence_name: str | None = None
    if solid.zones or solid.marks:
        file_name, written = _area_file(solid, f"{stem}-obstacles")
        files[file_name], obstacle_names = written.data, (file_name,)
    if limits.zones:
        file_name, written = _area_file(limits, f"{stem}-fence")
        files[file_name], fence_name = written.data, file_name
    if document.tracks:
        losses.drop("track", len(document.tracks))
    defaults = AreaOptions()
    margin = margin_m if margin_m is not None else defaults.margin_m
    options = MissionOptions(
        name=name,
        goal=tuple(goal_options),
        start=StartOptions(lat=home.lat_deg, lon=home.lon_deg) if home is not None else None,
        refuge=tuple(RefugeOptions(lat=r.point.lat_deg, lon=r.point.lon_deg) for r in document.rally),
        area=AreaOptions(
            obstacles=obstacle_names,
            fence=fence_name,
            margin_m=margin,
            margin_floor_m=min(defaults.margin_floor_m if floor_m is None else floor_m, margin),
            point_radius_m=point_radius_m if point_radius_m is not None else defaults.point_radius_m,
        ),
        skipper=course.skipper(SkipperOptions()),
    )
    return MissionFiles(toml=(dump_options(options) + PERMITS).encode(), files=files, losses=tuple(losses))


def _area_file(document: Document, stem: str) -> tuple[str, Written]:
    """Return zones as WKT, or as GeoJSON where WKT would lose circles or margins."""
    plain = Document(zones=document.zones, marks=document.marks)
    rich = any(isinstance(z.shape, Circle) or z.margin_m is not None for z in plain.zones)
    name = f"{stem}.geojson" if rich else f"{stem}.wkt"
    return name, write(plain, name)


def zones_only(document: Document, point_radius_m: float) -> tuple[Zone, ...]:
    """Return a document's zones with its marks grown to zones."""
    inclusions = tuple(z for z in document.zones if z.kind is ZoneKind.INCLUSION)
    return (*inclusions, *(o.zone() for o in document.as_obstacles(point_radius_m)))
