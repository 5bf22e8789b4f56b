"""What is wrong, or worth knowing, about an area as a whole: overlaps, holes, items, places, gaps, ways through."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from shapely.geometry import Polygon
from shapely.geometry.base import BaseGeometry

from companion.geo.angles import difference_rad, heading_of
from companion.geo.frame import LocalFrame
from companion.geofence.area import Area, LocalArea, buffer_in, grown_m, parts
from companion.geofence.autopilot_fence import FenceStatus, fence_for_autopilot
from companion.geofence.document import Code, Finding, FindingLevel
from companion.geofence.formats.fence_items import MAX_FENCE_ITEMS, zones_to_items
from companion.geofence.formats.rings import Findings
from companion.geofence.shapes import Circle, Zone, ZoneKind, center_of, polygon_en
from companion.messages import GeoPoint
from companion.words import counted

MAX_GAPS = 20  # reported; a coast of skerries has thousands
MAX_OBSTACLES = 2000  # above this gaps are not looked for
# What people call the edge of the water they sail on, at the end of a name: "shore", "north-lake".
_SHORE = re.compile(r"(.*[\W_])?(shore|shoreline|coast|lake|pond|bay|limits?|boundary|fence|water)", re.IGNORECASE)
EDGE_M = 0.1  # what was cut along the fence, and written in degrees of seven digits, lies so far outside of it
SEA_ROUND_M = 500.0  # open water round everything, without a fence


@dataclass(frozen=True, slots=True, kw_only=True)
class AreaConditions:
    """What the area is checked for: places, margin and wind. None leaves the check that needs it out.

    ``is_passage``: edges are too long to be straight in one frame.
    ``near`` is a place that should lie on the water, as a drawing's home; ``drawing`` the name of the file.
    """

    start: GeoPoint | None = None
    goals: tuple[GeoPoint, ...] = ()
    near: GeoPoint | None = None
    drawing: str = ""
    is_passage: bool = False
    margin_m: float | None = None
    twd_from_rad: float | None = None
    no_go_half_rad: float = math.radians(47.0)


def check_area(area: Area, conditions: AreaConditions) -> tuple[Finding, ...]:
    """Return what is found, worst first."""
    findings = Findings()
    shapes = [z.shape for z in area.fence.inclusions] + [o.shape for o in area.solids]
    if not shapes:
        return ()
    origin = conditions.start or (conditions.goals[0] if conditions.goals else center_of(shapes[0]))
    frame = LocalFrame(origin)
    local = area.about(frame, math.inf) if conditions.is_passage else area.local(frame)
    _inclusions(area, frame, findings)
    _holes(area, conditions, frame, findings)
    _places(local, conditions, findings)
    _round_the_water(local, conditions, findings)
    _sticking_out(local, findings)
    if conditions.margin_m is not None:
        _way_through(local, conditions, findings)
        _gaps(local, conditions, findings)
    _items(area, conditions, findings)
    order = {FindingLevel.ERROR: 0, FindingLevel.WARNING: 1, FindingLevel.NOTE: 2}
    return tuple(sorted(findings, key=lambda f: order[f.severity]))


def _hectares(shape: BaseGeometry) -> str:
    return f"{shape.area / 1e4:.3g} ha"


def _inclusions(area: Area, frame: LocalFrame, findings: Findings) -> None:
    zones = area.fence.inclusions
    if len(zones) < 2:
        return
    polygons = [polygon_en(z.shape, frame, cover=False) for z in zones]
    both = shapely.intersection_all(polygons)
    names = ", ".join(z.name or f"fence {i + 1}" for i, z in enumerate(zones))
    pieces = [p for p in parts(both) if p.area > 0.0]
    if not pieces:
        findings.add(
            FindingLevel.ERROR,
            Code.DISJOINT_INCLUSIONS,
            names,
            "the keep-in zones do not all overlap: ArduPilot intersects them and no water is left",
            "draw one zone round all the water",
        )
    elif len(pieces) > 1:
        findings.add(
            FindingLevel.WARNING,
            Code.DISJOINT_INCLUSIONS,
            names,
            f"the keep-in zones overlap in {len(pieces)} separate pieces",
            "draw one zone round the water to sail in",
        )
    if pieces and any(shapely.difference(p, both).area > 1.0 for p in polygons):
        findings.add(
            FindingLevel.WARNING,
            Code.INTERSECTED_INCLUSIONS,
            names,
            f"ArduPilot intersects keep-in zones: of {', '.join(_hectares(p) for p in polygons)} only "
            f"{_hectares(both)} is left to sail in",
            "draw one zone round all the water",
        )


def _holes(area: Area, conditions: AreaConditions, frame: LocalFrame, findings: Findings) -> None:
    """Tell of zones with holes; not of an obstacle all round the boat, as what no chart covers is round an import."""
    for zone in (*area.fence.inclusions, *(o.zone() for o in area.solids)):
        if isinstance(zone.shape, Circle) or not zone.shape.interiors:
            continue
        count = len(zone.shape.interiors)
        within = polygon_en(zone.shape, frame, cover=False).interiors
        is_known = conditions.start is not None or bool(conditions.goals)  # the frame's origin: she starts, or is to go
        given_up = sum(not (is_known and Polygon(ring).contains(shapely.Point(0.0, 0.0))) for ring in within)
        if zone.kind is ZoneKind.INCLUSION:
            text = f"has {counted(count, 'hole')}: fences of autopilots have none, so each becomes a keep-out zone"
            findings.add(FindingLevel.NOTE, Code.HOLE, zone.name or "keep-in zone", text)
        elif given_up:
            text = f"has {counted(given_up, 'hole')} that the boat does not start in: the water inside is given up"
            findings.add(FindingLevel.WARNING, Code.HOLE, zone.name or "keep-out zone", text)


def _places(local: LocalArea, conditions: AreaConditions, findings: Findings) -> None:
    from companion.geofence.mission.mission import trouble_at

    places = [(Code.START_OUTSIDE, "start", conditions.start)] if conditions.start is not None else []
    places += [(Code.GOAL_OUTSIDE, f"goal {i + 1}", g) for i, g in enumerate(conditions.goals)]
    for code, name, point in places:
        here = local.frame.en_from_geo(point)
        problem = trouble_at(local, here)
        if problem:
            findings.add(FindingLevel.ERROR, code, name, problem, "move it into free water or correct the area")
            continue
        clearance_m = float(local.clearance_m([here])[0])
        if conditions.margin_m is not None and clearance_m < grown_m(conditions.margin_m):
            of_margin = f"the margin of {conditions.margin_m:g} m"
            if clearance_m >= conditions.margin_m:
                of_margin += f" is, drawn round corners: {grown_m(conditions.margin_m):.1f} m"
            findings.add(
                FindingLevel.WARNING,
                code,
                name,
                f"has {clearance_m:.1f} m of free water, less than {of_margin}",
                "move it off, or lower the margin",
            )


def _round_the_water(local: LocalArea, conditions: AreaConditions, findings: Findings) -> None:
    """Mention that the largest obstacle of an area without a fence looks like a shore with the water inside it."""
    if local.limits is not None or not local.polygons:
        return
    index = max(range(len(local.polygons)), key=lambda i: local.polygons[i].area)
    largest = local.polygons[index]
    others = [p for i, p in enumerate(local.polygons) if i != index]
    within = int(np.count_nonzero(shapely.covers(largest, others))) if others else 0
    places = [p for p in (conditions.start, *conditions.goals, conditions.near) if p is not None]
    name = local.names[index] if others else conditions.drawing or local.names[index]
    if any(shapely.covers(largest, shapely.points(local.frame.en_from_geo(p))) for p in places):
        why = "a place that should lie on the water lies in it"
    elif 2 * within > len(others):
        why = f"{within} of {counted(len(others), 'other obstacle')} {'lies' if within == 1 else 'lie'} in it"
    elif not places and (_SHORE.fullmatch(local.names[index]) or _SHORE.fullmatch(name)):
        why = "is called like the edge of the water"
    else:
        return
    findings.add(
        FindingLevel.NOTE,
        Code.ROUND_THE_WATER,
        name,
        f"is a keep-out zone, and {why}",
        "if the water is inside it, read it with --kind inclusion (mission new: --fence; a mission: [area] fence)",
    )


def _sticking_out(local: LocalArea, findings: Findings) -> None:
    if local.limits is None:
        return
    limits = shapely.buffer(local.limits, EDGE_M)
    shapely.prepare(limits)
    for name, polygon in zip(local.names, local.polygons, strict=True):
        if shapely.covers(limits, polygon):
            continue
        outside = shapely.disjoint(local.limits, polygon)
        findings.add(
            FindingLevel.NOTE if outside else FindingLevel.WARNING,
            Code.OBSTACLE_OUTSIDE_FENCE,
            name,
            "lies outside the fence and changes nothing"
            if outside
            else f"sticks out of the fence by {_hectares(shapely.difference(polygon, local.limits))}",
            "" if outside else "is one of the two in the wrong place?",
        )


def free_water(local: LocalArea, margin_m: float) -> BaseGeometry:
    """Return the water that is ``margin_m`` clear of everything; without a fence, 500 m round all obstacles."""
    if local.limits is not None:
        sea = buffer_in(local.limits, margin_m)
    else:
        west, south, east, north = local.solid.bounds if local.polygons else (0.0, 0.0, 0.0, 0.0)
        sea = shapely.box(
            min(west, 0.0) - SEA_ROUND_M,
            min(south, 0.0) - SEA_ROUND_M,
            max(east, 0.0) + SEA_ROUND_M,
            max(north, 0.0) + SEA_ROUND_M,
        )
    return shapely.difference(sea, local.buffered(margin_m))


def _connected(local: LocalArea, places: Sequence[tuple[float, float]], margin_m: float) -> bool:
    """Whether all places are within ``margin_m`` of one and the same piece of free water."""
    points = shapely.points(np.array(places))
    reach = max(margin_m, 0.01)
    return any(bool(np.all(shapely.dwithin(piece, points, reach))) for piece in parts(free_water(local, margin_m)))


def _way_through(local: LocalArea, conditions: AreaConditions, findings: Findings) -> None:
    if conditions.start is None or not conditions.goals or conditions.margin_m is None:
        return
    places = [local.frame.en_from_geo(p) for p in (conditions.start, *conditions.goals)]
    reach_m = max(math.hypot(*p) for p in places)
    if local.limits is None and reach_m > SEA_ROUND_M:
        places = [p for p in places if math.hypot(*p) <= SEA_ROUND_M]
    if len(places) < 2 or _connected(local, places, conditions.margin_m):
        return
    low, high = 0.0, conditions.margin_m
    if not _connected(local, places, 0.0):
        findings.add(
            FindingLevel.ERROR,
            Code.UNREACHABLE,
            "",
            "there is no water between the start and every goal",
            "correct the fence or the obstacles",
        )
        return
    while high - low > 0.1:
        middle = (low + high) / 2.0
        low, high = (middle, high) if _connected(local, places, middle) else (low, middle)
    findings.add(
        FindingLevel.ERROR,
        Code.UNREACHABLE,
        "",
        f"at a margin of {conditions.margin_m:g} m there is no way between the start and every goal",
        f"there is one at {low:.1f} m",
    )


def _gaps(local: LocalArea, conditions: AreaConditions, findings: Findings) -> None:
    """Name the gaps that the margin closes, and those that it leaves too narrow to beat through."""
    margin_m = conditions.margin_m or 0.0
    bodies: list[tuple[str, BaseGeometry]] = list(zip(local.names, local.polygons, strict=True))
    if isinstance(local.limits, Polygon) and not local.limits.is_empty:
        bodies.append(("the fence", local.limits.exterior))
    if margin_m <= 0.0 or len(bodies) < 2:
        return
    if len(bodies) > MAX_OBSTACLES:
        findings.add(FindingLevel.NOTE, Code.NARROW_GAP, "", f"gaps between {len(bodies)} obstacles are not looked for")
        return
    widest_m = 2.0 * margin_m / math.cos(min(conditions.no_go_half_rad, math.radians(85.0)))
    shapes = [b for _, b in bodies]
    tree = shapely.STRtree(shapes)
    pairs = tree.query(shapes, predicate="dwithin", distance=widest_m)
    found: list[tuple[float, Finding]] = []
    for i, j in pairs.T:
        if i >= j:
            continue
        line = shapely.shortest_line(shapes[i], shapes[j])
        width_m = float(line.length)
        if width_m < 0.01 or any(k not in {i, j} and shapely.intersects(shapes[k], line) for k in tree.query(line)):
            continue
        (ax, ay), (bx, by) = line.coords
        middle = local.frame.geo_from_en((ax + bx) / 2.0, (ay + by) / 2.0)
        place = f"{bodies[i][0]} / {bodies[j][0]} at {middle.lat_deg:.6f}, {middle.lon_deg:.6f}"
        across_rad = heading_of(by - ay, ax - bx)
        finding = _gap(width_m, across_rad, place, margin_m, conditions)
        if finding is not None:
            found.append((width_m, finding))
    found.sort(key=lambda f: (f[0], f[1].place))
    findings.extend(f for _, f in found[:MAX_GAPS])
    if len(found) > MAX_GAPS:
        findings.add(FindingLevel.NOTE, Code.NARROW_GAP, "", f"{len(found) - MAX_GAPS} more narrow gaps are not listed")


def _gap(width_m: float, course_rad: float, place: str, margin_m: float, conditions: AreaConditions) -> Finding | None:
    """Return what is wrong with a gap whose way through is ``course_rad`` (or its opposite)."""
    if width_m < 2.0 * margin_m:
        return Finding(
            severity=FindingLevel.WARNING,
            code=Code.NARROW_GAP,
            place=place,
            text=f"the gap of {width_m:.1f} m is closed at a margin of {margin_m:g} m, which needs {2 * margin_m:g} m",
        )
    if conditions.twd_from_rad is None:
        return None
    # Upwind through the gap a boat holds no_go from the wind: from the way through, that is the rest.
    twa_rad = min(abs(difference_rad(course_rad + turn, conditions.twd_from_rad)) for turn in (0.0, math.pi))
    off_rad = conditions.no_go_half_rad - twa_rad
    if off_rad <= 0.0:
        return None
    needed_m = 2.0 * margin_m / math.cos(off_rad)
    if width_m >= needed_m:
        return None
    return Finding(
        severity=FindingLevel.WARNING,
        code=Code.NARROW_GAP,
        place=place,
        text=f"the gap of {width_m:.1f} m is too narrow to beat through in this wind: the margin of {margin_m:g} m "
        f"on both sides of a close-hauled course needs {needed_m:.1f} m",
    )


def _items(area: Area, conditions: AreaConditions, findings: Findings) -> None:
    """Say how many of the autopilot's items the area takes as it stands, and simplified."""
    zones: list[Zone] = [*area.fence.inclusions, *(o.zone() for o in area.solids)]
    count = len(zones_to_items(zones)[0])
    if count <= MAX_FENCE_ITEMS:
        return
    text = f"the area takes {count} fence items where ArduRover holds {MAX_FENCE_ITEMS}"
    if conditions.margin_m is None or conditions.start is None:
        findings.add(
            FindingLevel.WARNING,
            Code.TOO_MANY_ITEMS,
            "",
            text,
            "it can be simplified within a margin: give --margin and --start",
        )
        return
    result = fence_for_autopilot(area, conditions.margin_m, inside=[conditions.start, *conditions.goals])
    if result.status is FenceStatus.OK:
        findings.add(
            FindingLevel.WARNING if result.left_out else FindingLevel.NOTE,
            Code.TOO_MANY_ITEMS,
            "",
            f"{text}; simplified it takes {len(result.items)} and uses {result.used_m:.1f} m of the "
            f"{conditions.margin_m:g} m margin" + (f"; {result.left_out}" if result.left_out else ""),
        )
    else:
        findings.add(
            FindingLevel.WARNING, Code.TOO_MANY_ITEMS, "", f"{text}, and it cannot be simplified: {result.reason}"
        )
