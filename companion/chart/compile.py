"""Charts made into the area of a mission: the finer one counts, seams are closed, the simplified contains the true."""

from __future__ import annotations

import json
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from shapely.geometry import Polygon
from shapely.geometry.base import BaseGeometry

from companion.chart.features import Chart, Danger, Source, box_about
from companion.geo import DEGREE_M
from companion.geo.frame import LocalFrame
from companion.geofence import Charted, Circle, Document, Zone, ZoneKind
from companion.geofence.area import buffer_out, parts, polygons_about
from companion.geofence.charted import MEMBER
from companion.geofence.formats import MAX_POSITIONS
from companion.geofence.shapes import polygon_lonlat, wrap_lon_deg
from companion.messages import GeoPoint

TOLERANCE_M = 2.0  # a harbour of narrow creeks loses 1.7 % of its free water by it, at 3 m 2.3 %
SEAM_M = 1.0  # two charts that are no farther apart meet: their corners are rounded
ROUNDED_M = 0.02  # positions are written with seven decimals
EDGE_M = 2000.0  # edges that long are straight in any frame of the area within a hand's breadth
DECIMALS = 7
NO_CHART = "no chart"


@dataclass(frozen=True, slots=True, kw_only=True)
class Solid:
    """An obstacle of the area: its shape, why it is one, and what says so."""

    shape: Polygon | Circle
    reason: str
    source: Source | None
    name: str = ""
    depth_m: float | None = None
    doubt_m: float = 0.0

    @property
    def title(self) -> str:
        """What it is called where a voyage speaks of it."""
        return f"{self.name} ({self.reason})" if self.name else self.reason


@dataclass(frozen=True, slots=True, kw_only=True)
class ChartArea:
    """What charts say of the water about a place: obstacles and the fence, ready to be written."""

    solids: tuple[Solid, ...]
    fence: Zone
    frame: LocalFrame
    reach_m: float
    floats_m: float | None = None

    @property
    def always(self) -> tuple[Solid, ...]:
        """What is solid at any hour."""
        return tuple(s for s in self.solids if not _floats(s.depth_m, self.floats_m))

    @property
    def drying(self) -> tuple[Solid, ...]:
        """What some tide of the table makes deep enough."""
        return tuple(s for s in self.solids if _floats(s.depth_m, self.floats_m))

    def document(self) -> Document:
        """Return obstacles and fence as what every command reads."""
        zones = [
            Zone(kind=ZoneKind.EXCLUSION, shape=s.shape, name=s.title, margin_m=s.doubt_m or None) for s in self.solids
        ]
        return Document(source="chart", format="chart", zones=(*zones, self.fence))

    def positions(self) -> int:
        """Return how many positions a file of it holds; one may hold ``MAX_POSITIONS``."""
        return sum(1 if isinstance(s.shape, Circle) else len(shapely.get_coordinates(s.shape)) for s in self.solids)

    @property
    def is_too_much(self) -> bool:
        """Whether no mission could read it."""
        return self.positions() > MAX_POSITIONS

    def obstacles_json(self, made_for: Charted | None = None) -> bytes:
        """Return the obstacles as GeoJSON, each with its reason, source, edition, date and depth."""
        return _collection([_feature(solid) for solid in self.always], made_for)

    def drying_json(self) -> bytes:
        """Return the water that dries in the same way."""
        return _collection([_feature(solid) for solid in self.drying])

    def fence_json(self) -> bytes:
        """Return the fence as GeoJSON."""
        assert isinstance(self.fence.shape, Polygon)
        properties = {"kind": "inclusion", "name": self.fence.name}
        return _collection([{"type": "Feature", "properties": properties, "geometry": _geometry(self.fence.shape)}])


def _floats(depth_m: float | None, floats_m: float | None) -> bool:
    return floats_m is not None and depth_m is not None and depth_m >= floats_m


def area_of(
    charts: Sequence[Chart],
    center: GeoPoint,
    reach_m: float,
    tolerance_m: float = TOLERANCE_M,
    floats_m: float | None = None,
) -> ChartArea:
    """Return what the charts say within ``reach_m`` of a place; shapes are at most twice the tolerance too large.

    What is no shallower than ``floats_m`` below the datum is deep enough at some tide: it is kept apart by its depth,
    and takes no rock's place.
    """
    frame = LocalFrame(center)
    disc = shapely.segmentize(shapely.buffer(shapely.points((0.0, 0.0)), reach_m, quad_segs=16), EDGE_M)
    wide_m = reach_m + 2.0 * tolerance_m + SEAM_M
    finer: BaseGeometry = Polygon()
    as_fine: list[BaseGeometry] = []
    last_m = 0.0
    covered: list[BaseGeometry] = []
    areas: dict[tuple[str, Source, float, float | None], list[tuple[BaseGeometry, float | None]]] = defaultdict(list)
    marks: list[tuple[BaseGeometry, Danger, Source]] = []
    for chart in sorted(charts, key=lambda c: c.resolution_m):
        if chart.resolution_m > last_m and as_fine:
            finer = shapely.union_all([finer, *as_fine])
            shapely.prepare(finer)
            as_fine = []
        last_m = chart.resolution_m
        for danger in chart.dangers:
            for shape in _local(danger.geometry, frame, wide_m):
                if isinstance(shape, Polygon):
                    left = shapely.difference(shape, finer) if shapely.intersects(finer, shape) else shape
                    if not left.is_empty:
                        apart = danger.depth_m if _floats(danger.depth_m, floats_m) else None
                        areas[danger.reason, chart.source, danger.doubt_m, apart].append((left, danger.depth_m))
                elif not (chart.supersedes and shapely.covers(finer, shape)):
                    marks.append((shape, danger, chart.source))
        if chart.coverage is None:
            covered.append(disc)
            continue
        spoken = _closed(shapely.union_all(_local(chart.coverage, frame, wide_m)))
        covered.append(spoken)
        if chart.supersedes:
            as_fine.append(spoken)
    solids: list[Solid] = []
    whole: dict[float, list[BaseGeometry]] = defaultdict(list)
    for (reason, source, doubt_m, apart), found in areas.items():
        union = shapely.intersection(containing(shapely.union_all([s for s, _ in found]), tolerance_m), disc)
        if apart is None:
            whole[doubt_m].append(union)
        known = [(s, d) for s, d in found if d is not None]
        tree, depths = shapely.STRtree([s for s, _ in known]), np.array([d for _, d in known])
        for piece in parts(union):
            own = depths[tree.query(piece, predicate="intersects")]
            depth_m = float(own.min()) if own.size else None
            solids.append(
                Solid(shape=_lonlat(piece, frame), reason=reason, source=source, depth_m=depth_m, doubt_m=doubt_m)
            )
    solids += _marks(marks, whole, frame, disc)
    blank = shapely.difference(disc, _closed(shapely.union_all(covered)))
    blank = shapely.intersection(containing(blank, tolerance_m), disc)
    solids += [Solid(shape=_lonlat(p, frame), reason=NO_CHART, source=None) for p in parts(blank)]
    fence = Zone(kind=ZoneKind.INCLUSION, shape=_lonlat(disc, frame), name="the chart's edge")
    return ChartArea(solids=tuple(solids), fence=fence, frame=frame, reach_m=reach_m, floats_m=floats_m)


def containing(shape: BaseGeometry, tolerance_m: float) -> BaseGeometry:
    """Return an area of fewer corners that contains ``shape``, and at most what is within twice the tolerance of it.

    What Douglas and Peucker leave out lies within the tolerance of what they leave, so growing by that brings it back;
    a mitred corner lies farther out than a round one. It is looked at, and where it does not hold the shape itself is
    grown.
    """
    if shape.is_empty:
        return shape
    pieces = parts(shapely.make_valid(shape))
    out: list[BaseGeometry] = []
    for piece in pieces:
        few = shapely.simplify(piece, tolerance_m, preserve_topology=True)
        grown = shapely.buffer(few, tolerance_m + ROUNDED_M, join_style="mitre", mitre_limit=2.0)
        out.append(grown if shapely.covers(grown, piece) else buffer_out(piece, ROUNDED_M))
    return shapely.union_all(out)


def _closed(shape: BaseGeometry) -> BaseGeometry:
    """Return the shape with gaps up to twice ``SEAM_M`` filled: rounded corners of neighbours do not quite meet."""
    grown = shapely.buffer(shape, SEAM_M, join_style="mitre")
    return shapely.union_all([shape, shapely.buffer(grown, -SEAM_M, join_style="mitre")])


def _marks(
    marks: Sequence[tuple[BaseGeometry, Danger, Source]],
    whole: dict[float, list[BaseGeometry]],
    frame: LocalFrame,
    disc: BaseGeometry,
) -> list[Solid]:
    """Return points and lines as solids with their radius; none for what lies in a solid area that is as doubtful."""
    out: list[Solid] = []
    around: dict[float, BaseGeometry] = {}
    for shape, danger, source in marks:
        solid = buffer_out(shape, danger.radius_m)
        if not shapely.intersects(disc, solid):
            continue
        if danger.doubt_m not in around:
            around[danger.doubt_m] = shapely.union_all(
                [s for doubt_m, shapes in whole.items() if doubt_m >= danger.doubt_m for s in shapes]
            )
            shapely.prepare(around[danger.doubt_m])
        if shapely.covers(around[danger.doubt_m], solid):
            continue
        shapes: list[Polygon | Circle]
        if shape.geom_type == "Point" and shapely.covers(disc, solid):
            shapes = [Circle(frame.geo_from_en(shape.x, shape.y), danger.radius_m)]
        else:
            shapes = [_lonlat(p, frame) for p in parts(shapely.intersection(solid, disc))]
        out += [
            Solid(
                shape=s,
                reason=danger.reason,
                source=source,
                name=danger.name,
                depth_m=danger.depth_m,
                doubt_m=danger.doubt_m,
            )
            for s in shapes
        ]
    return out


def _local(geometry: BaseGeometry, frame: LocalFrame, reach_m: float) -> list[BaseGeometry]:
    """Return polygons, lines and points of a shape within reach, in metres; edges are straight in lon and lat."""
    here = frame.origin
    box_west, box_south, box_east, box_north = box_about(here, reach_m)
    is_polar = max(-box_south, box_north) >= 89.0
    out: list[BaseGeometry] = []
    for part in shapely.get_parts(geometry):
        west, south, east, north = shapely.bounds(part)
        if part.is_empty or south > box_north or north < box_south:
            continue
        if not is_polar and not any(west + t <= box_east and east + t >= box_west for t in (-360.0, 0.0, 360.0)):
            continue
        if isinstance(part, Polygon):
            for polygon in polygons_about(part if part.is_valid else shapely.make_valid(part), frame, reach_m):
                out += parts(polygon if polygon.is_valid else shapely.make_valid(polygon))
            continue
        line = shapely.segmentize(part, EDGE_M / DEGREE_M) if part.length else part
        moved = shapely.transform(shapely.force_2d(line), frame.array_en_from_lonlat)
        near = shapely.intersection(moved, shapely.box(-reach_m, -reach_m, reach_m, reach_m))
        out += [p for p in shapely.get_parts(near) if not p.is_empty]
    return out


def _lonlat(polygon: Polygon, frame: LocalFrame) -> Polygon:
    return polygon_lonlat(shapely.segmentize(polygon, EDGE_M), frame)


def _feature(solid: Solid) -> dict[str, object]:
    properties: dict[str, object] = {"kind": "exclusion", "name": solid.title, "reason": solid.reason}
    if solid.source is not None:
        properties |= {"source": solid.source.name, "edition": solid.source.edition, "date": solid.source.date}
    if solid.depth_m is not None:
        properties["depth_m"] = round(solid.depth_m, 2)
    if solid.doubt_m:
        properties["margin_m"] = solid.doubt_m
    if isinstance(solid.shape, Circle):
        properties["radius_m"] = round(solid.shape.radius_m, 2)
    kept = {key: value for key, value in properties.items() if value != ""}
    return {"type": "Feature", "properties": kept, "geometry": _geometry(solid.shape)}


def _geometry(shape: Polygon | Circle) -> dict[str, object]:
    if isinstance(shape, Circle):
        place = [round(shape.center.lon_deg, DECIMALS), round(shape.center.lat_deg, DECIMALS)]
        return {"type": "Point", "coordinates": place}
    rings = [
        [[round(wrap_lon_deg(x), DECIMALS), round(y, DECIMALS)] for x, y in ring.coords]
        for ring in (shape.exterior, *shape.interiors)
    ]
    return {"type": "Polygon", "coordinates": rings}


def _collection(features: list[dict[str, object]], made_for: Charted | None = None) -> bytes:
    text = ",\n".join(json.dumps(f, ensure_ascii=False, separators=(",", ":")) for f in features)
    said = "" if made_for is None else f'"{MEMBER}":{json.dumps(made_for.to_dict(), ensure_ascii=False)},'
    return f'{{"type":"FeatureCollection",{said}"features":[\n{text}\n]}}\n'.encode()
