"""What a file holds, whatever its format: zones, mission items, home, rally points, tracks, and what was found."""

from __future__ import annotations

import enum
from dataclasses import dataclass, replace

from shapely.geometry import LineString, Point, Polygon
from shapely.geometry.base import BaseGeometry

from companion.errors import InputError
from companion.geofence.charted import Charted
from companion.geofence.shapes import Circle, Obstacle, Zone, ZoneKind
from companion.messages import GeoPoint, MissionItem
from companion.words import one_line

# Findings: what is wrong, or worth knowing, about a fence, an obstacle file or a mission, and where.


class FindingLevel(enum.Enum):
    """How bad a finding is."""

    ERROR = "error"  # the boat must not sail with it
    WARNING = "warning"  # it works, and someone should look
    NOTE = "note"  # what was done on the way


class Code(enum.Enum):
    """What a finding is about."""

    UNCLOSED = "unclosed ring"
    SELF_CROSSING = "self-crossing ring"
    EMPTY = "empty geometry"
    DEGENERATE = "degenerate geometry"
    SWAPPED_AXES = "swapped axes"
    WRONG_SRID = "wrong SRID"
    NOT_FINITE = "not a finite number"
    OUT_OF_RANGE = "out of range"
    FAR_AWAY = "far away"
    DISJOINT_INCLUSIONS = "inclusion zones that do not overlap"
    INTERSECTED_INCLUSIONS = "inclusion zones that the autopilot intersects"
    HOLE = "hole"
    TOO_MANY_ITEMS = "more items than the autopilot holds"
    START_OUTSIDE = "start outside"
    GOAL_OUTSIDE = "goal outside"
    UNREACHABLE = "no water between start and goal"
    ROUND_THE_WATER = "keep-out zone round the water"
    NARROW_GAP = "gap too narrow"
    ANTIMERIDIAN = "antimeridian"
    OBSTACLE_OUTSIDE_FENCE = "obstacle outside the fence"
    NOT_CARRIED = "not carried over"
    DROPPED = "dropped"
    EXPANDED = "expanded"
    FORMAT = "format"
    FIELD = "field"
    DRIES = "dries at low water"
    CHARTED = "made for another keel or tide"
    ROUNDING = "inside of a rounding"
    SMALL = "too small to meet"
    TWICE = "one name twice"
    THERE_ALREADY = "reached before it is sailed to"
    ODD_BOAT = "unlike any boat"
    NO_EFFECT = "does nothing"


@dataclass(frozen=True, slots=True, kw_only=True)
class Finding:
    """One thing found: ``place`` says where in the file (``line 3``, ``features[2]``), ``remedy`` what to do.

    ``source`` is the file, where it is another than the one that was asked about.
    """

    severity: FindingLevel
    code: Code
    place: str
    text: str
    remedy: str = ""
    source: str = ""

    def line(self, source: str = "") -> str:
        """Return the finding as one line."""
        where = ": ".join(part for part in (self.source or source, self.place) if part)
        remedy = f"; {self.remedy}" if self.remedy else ""
        return one_line(f"{where}: {self.severity.value}: {self.text}{remedy}")

    def as_error(self, source: str) -> InputError:
        """Return the finding as the error that ends a command."""
        return InputError(self.source or source, self.place, self.text, self.remedy)


def require_clean(findings: tuple[Finding, ...], source: str) -> None:
    """Raise the first error among ``findings`` as InputError; pass when there is none."""
    for finding in findings:
        if finding.severity is FindingLevel.ERROR:
            raise finding.as_error(source)


@dataclass(frozen=True, slots=True, kw_only=True)
class Track:
    """A line that was sailed or drawn: (lat, lon) points in order, with times [s since 1970] if it has them."""

    points: tuple[GeoPoint, ...]
    times_s: tuple[float, ...] | None = None
    name: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Mark:
    """A point or line without area (a rock, a cable): it becomes a zone once it is given a radius."""

    geometry: Point | LineString
    kind: ZoneKind
    name: str = ""
    margin_m: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Document:
    """The neutral form between formats.

    ``items`` is a mission without its home, as files number it from 1; ``rally`` holds NAV_RALLY_POINT items;
    ``return_point`` is the fence's (Mission Planner's first line). ``findings`` is what the reader met.
    """

    source: str = ""
    format: str = ""
    zones: tuple[Zone, ...] = ()
    marks: tuple[Mark, ...] = ()
    items: tuple[MissionItem, ...] = ()
    item_names: tuple[str, ...] = ()
    home: GeoPoint | None = None
    rally: tuple[MissionItem, ...] = ()
    return_point: GeoPoint | None = None
    tracks: tuple[Track, ...] = ()
    findings: tuple[Finding, ...] = ()
    charted: Charted | None = None
    """What its obstacles were made for, where a chart's import says it."""

    @property
    def is_empty(self) -> bool:
        """Nothing at all was read."""
        return not (
            self.zones or self.marks or self.items or self.rally or self.tracks or self.home or self.return_point
        )

    def require_clean(self) -> Document:
        """Return the document itself; raise its first error as InputError."""
        require_clean(self.findings, self.source)
        return self

    def without_zones(self) -> Document:
        """Return the document without its zones."""
        return replace(self, zones=())

    def as_obstacles(self, radius_m: float) -> tuple[Obstacle, ...]:
        """Return everything solid as obstacles: keep-out zones, and marks grown by ``radius_m``."""
        solid = [
            Obstacle(shape=z.shape, name=z.name, margin_m=z.margin_m, depth_m=z.depth_m)
            for z in self.zones
            if z.kind is ZoneKind.EXCLUSION
        ]
        for mark in self.marks:
            if mark.kind is ZoneKind.EXCLUSION:
                solid.extend(
                    Obstacle(shape=s, name=mark.name, margin_m=mark.margin_m) for s in grown(mark.geometry, radius_m)
                )
        return tuple(solid)


def grown(geometry: BaseGeometry, radius_m: float) -> list[Polygon | Circle]:
    """Return the shapes that hold all points within ``radius_m`` of a point or line in longitude and latitude."""
    from companion.geo.frame import LocalFrame
    from companion.geofence.area import buffer_out, parts
    from companion.geofence.shapes import polygon_lonlat, wrap_lon_deg

    if isinstance(geometry, Point):
        return [Circle(GeoPoint(lat_deg=geometry.y, lon_deg=wrap_lon_deg(geometry.x)), radius_m)]
    x, y = geometry.coords[0][:2]
    frame = LocalFrame(GeoPoint(lat_deg=y, lon_deg=wrap_lon_deg(x)))
    local = LineString(frame.array_en_from_lonlat([c[:2] for c in geometry.coords]))
    return [polygon_lonlat(p, frame) for p in parts(buffer_out(local, radius_m))]
