"""The area: obstacles and fence on the globe, and their picture in local metres.

``Area`` is what a mission says; ``Area.local(frame)`` is what the planner, the skipper and the plots use. All
local geometry is shapely in metres (x east, y north), and every approximation errs to the safe side: circles and
buffered obstacles are drawn around, limits inside.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray
from shapely.geometry import MultiPolygon, Polygon
from shapely.geometry.base import BaseGeometry

from companion.geo import LEAST_DEGREE_M
from companion.geo.frame import LocalFrame
from companion.geofence.charted import Charted
from companion.geofence.shapes import CIRCLE_SIDES, Circle, Obstacle, Shape, Zone, ZoneKind, polygon_en
from companion.words import listed

if TYPE_CHECKING:
    from companion.geo.segments import PolygonIndex

# Of a buffer's corner. GEOS rounds the number of chords of a corner, so one may span 1.5 times 22.5 degrees and come
# nearer than the distance; OUTWARDS pays for that.
QUADRANT_SEGMENTS = 4
OUTWARDS = 1.0 / math.cos(0.75 * math.pi / (2.0 * QUADRANT_SEGMENTS))
CIRCLE_SEGMENTS = 16  # of a quarter of a circle: 0.1 % of its radius is given away
MANY_POINTS = 500  # from here on the grid pays for being built and compiled
SLACK_M = 1.0  # a fence's items are rounded, its circles drawn with sides, its earth another sphere
AROUND_M = 20_000.0  # of what is known, where nothing limits the water: nobody sails so far in one frame


def grown_m(margin_m: float) -> float:
    """Return how far off a shape grown by a margin may reach [m]: its corners' chords are drawn outwards."""
    return margin_m * OUTWARDS


def buffer_out(shape: BaseGeometry, distance_m: float) -> BaseGeometry:
    """Return a polygon that contains every point within ``distance_m`` of ``shape`` (at most 5 % more)."""
    if distance_m <= 0.0:
        return shape
    return shapely.buffer(shape, grown_m(distance_m), quad_segs=QUADRANT_SEGMENTS)


def buffer_in(shape: BaseGeometry, distance_m: float) -> BaseGeometry:
    """Return a part of ``shape`` whose points are all at least ``distance_m`` from its boundary."""
    if distance_m <= 0.0:
        return shape
    return shapely.buffer(shape, -grown_m(distance_m), quad_segs=QUADRANT_SEGMENTS)


def parts(shape: BaseGeometry) -> list[Polygon]:
    """Return the polygons of a polygonal geometry, empty ones left out."""
    return [p for p in shapely.get_parts(shape) if isinstance(p, Polygon) and not p.is_empty]


@dataclass(frozen=True, slots=True)
class Fence:
    """Keep-in and keep-out zones. Several keep-in zones mean their intersection, as ArduPilot has it."""

    zones: tuple[Zone, ...] = ()

    @property
    def inclusions(self) -> tuple[Zone, ...]:
        """The keep-in zones."""
        return tuple(z for z in self.zones if z.kind is ZoneKind.INCLUSION)

    @property
    def exclusions(self) -> tuple[Zone, ...]:
        """The keep-out zones."""
        return tuple(z for z in self.zones if z.kind is ZoneKind.EXCLUSION)


@dataclass(frozen=True, slots=True)
class Area:
    """Obstacles and fence of a mission, in longitude and latitude.

    Keep-out zones of the fence are obstacles like any other.
    """

    obstacles: tuple[Obstacle, ...] = ()
    fence: Fence = Fence()
    charted: tuple[Charted, ...] = ()
    """What those of the obstacles' files were made for that a chart's import wrote."""

    @property
    def solids(self) -> tuple[Obstacle, ...]:
        """The obstacles and the fence's keep-out zones."""
        return self.obstacles + tuple(
            Obstacle(shape=z.shape, name=z.name, margin_m=z.margin_m) for z in self.fence.exclusions
        )

    def local(self, frame: LocalFrame) -> LocalArea:
        """Return the area in the metres of ``frame``."""
        limits: BaseGeometry | None = None
        for zone in self.fence.inclusions:
            polygon = buffer_in(polygon_en(zone.shape, frame, cover=False), zone.margin_m or 0.0)
            limits = polygon if limits is None else shapely.intersection(limits, polygon)
        solids = self.solids
        return LocalArea(
            frame=frame,
            names=tuple(o.name or f"obstacle {i + 1}" for i, o in enumerate(solids)),
            polygons=tuple(polygon_en(o.shape, frame) for o in solids),
            own_margins_m=tuple(o.margin_m or 0.0 for o in solids),
            limits=limits,
        )

    def about(self, frame: LocalFrame, reach_m: float) -> LocalArea:
        """Return what of the area lies within ``reach_m`` of the origin of ``frame``, in its metres.

        For a passage: edges are straight in longitude and latitude, however long they are, and the limits end where the
        area does.
        """
        limits: BaseGeometry | None = None
        for zone in self.fence.inclusions:
            pieces = polygons_about(zone.shape, frame, reach_m, cover=False)
            polygon = buffer_in(shapely.union_all(pieces), zone.margin_m or 0.0)
            limits = polygon if limits is None else shapely.intersection(limits, polygon)
        near = [
            (o, o.name or f"obstacle {i + 1}", p)
            for i, o in enumerate(self.solids)
            for p in polygons_about(o.shape, frame, reach_m)
        ]
        return LocalArea(
            frame=frame,
            names=tuple(name for _, name, _ in near),
            polygons=tuple(p for *_, p in near),
            own_margins_m=tuple(o.margin_m or 0.0 for o, *_ in near),
            limits=limits,
            reach_m=reach_m,
        )


@dataclass(frozen=True, eq=False)
class LocalArea:
    """Obstacles and limits in metres, x east, y north.

    ``names``, ``polygons`` and ``own_margins_m`` run in parallel, one per obstacle. ``limits`` is the water that
    the fence leaves (polygon or multipolygon, possibly empty), None without a fence. Points are (n, 2) arrays. What is
    farther than ``reach_m`` from the origin may not be in it.
    """

    frame: LocalFrame
    names: tuple[str, ...]
    polygons: tuple[Polygon, ...]
    own_margins_m: tuple[float, ...]
    limits: BaseGeometry | None
    edge_name: str = "the fence"
    reach_m: float = math.inf

    @functools.cached_property
    def unfenced(self) -> LocalArea:
        """The obstacles alone: for a boat that has got outside the limits. What is known of them is kept there."""
        return self if self.limits is None else replace(self, limits=None)

    @functools.cached_property
    def outer(self) -> LocalArea:
        """The area with one limit fewer, in the end the obstacles alone: for a boat that has got outside."""
        return self.unfenced

    @functools.cached_property
    def own(self) -> LocalArea:
        """The area with the mission's own limits alone, if it has any."""
        return self

    def also(self, names: tuple[str, ...], polygons: tuple[Polygon, ...], margins_m: tuple[float, ...]) -> LocalArea:
        """Return the area with more obstacles, after its own."""
        return replace(
            self,
            names=self.names + names,
            polygons=self.polygons + polygons,
            own_margins_m=self.own_margins_m + margins_m,
        )

    @functools.lru_cache(maxsize=4)  # noqa: B019 - an area lives as long as its voyage
    def within(self, centre_en: tuple[float, float], radius_m: float, name: str) -> LocalArea:
        """Return the area with one limit more: a circle, by ``name``, drawn inside of it."""
        disc = shapely.buffer(shapely.points(centre_en), radius_m, quad_segs=CIRCLE_SEGMENTS)
        limits = disc if self.limits is None else shapely.intersection(self.limits, disc)
        return self._limited(limits, name)

    @functools.lru_cache(maxsize=4)  # noqa: B019 - an area lives as long as its voyage
    def taken_by(self, zones: tuple[Zone, ...], margin_m: float) -> BaseGeometry:
        """Return the water that a fence's zones take and that the margin leaves, prepared; empty where there is none.

        A fence along the mission's own obstacles and edges, which keeps within their margin, takes nothing.
        """
        here = shapely.points((0.0, 0.0)) if self.limits is None else self.limits
        shapes = [
            (zone.kind, polygon_en(zone.shape, self.frame, cover=zone.kind is ZoneKind.EXCLUSION)) for zone in zones
        ]
        x0, y0, x1, y1 = shapely.total_bounds([here, *self.polygons, *(shape for _, shape in shapes)])
        world = shapely.box(x0 - AROUND_M, y0 - AROUND_M, x1 + AROUND_M, y1 + AROUND_M)
        water = world if self.limits is None else buffer_in(self.limits, margin_m + SLACK_M)
        left = world
        for kind, shape in shapes:
            cut = shapely.intersection if kind is ZoneKind.INCLUSION else shapely.difference
            left = cut(left, shapely.make_valid(shape))
        beyond = shapely.difference(world, left)
        free = shapely.difference(water, self.buffered(margin_m + SLACK_M))
        wide = shapely.buffer(shapely.intersection(free, beyond), -SLACK_M)
        # and what of the margin lies beside it
        taken = shapely.union_all(
            parts(
                shapely.intersection(
                    shapely.buffer(wide, margin_m + 3.0 * SLACK_M, quad_segs=QUADRANT_SEGMENTS), beyond
                )
            )
        )
        shapely.prepare(taken)
        return taken

    @functools.lru_cache(maxsize=4)  # noqa: B019 - an area lives as long as its voyage
    def without(self, taken: BaseGeometry, name: str, *, is_own: bool = False) -> LocalArea:
        """Return the area less ``taken``, by ``name``: a limit, with ``is_own`` one of the mission's own."""
        if self.limits is None:
            x0, y0, x1, y1 = shapely.total_bounds([taken, *self.polygons])
            limits = shapely.box(x0 - AROUND_M, y0 - AROUND_M, x1 + AROUND_M, y1 + AROUND_M)
        else:
            limits = self.limits
        area = self._limited(shapely.difference(limits, taken), name)
        if is_own:
            area.__dict__["own"] = area
        return area

    def _limited(self, limits: BaseGeometry, name: str) -> LocalArea:
        area = replace(self, limits=limits, edge_name=name if self.limits is None else f"{self.edge_name} or {name}")
        # what was computed of the obstacles serves both
        area.__dict__.update(unfenced=self.unfenced, outer=self, own=self.own)
        return area

    def roomy_en(self, near_en: tuple[float, float], room_m: float) -> tuple[float, float] | None:
        """Return the place nearest to ``near_en`` that has ``room_m`` about it, or half of that, ...; None: nowhere."""
        here = shapely.points(near_en)
        while room_m >= SLACK_M:
            water = self.water(room_m)
            free = shapely.difference(here if water is None else water, self.buffered(room_m))
            if not free.is_empty:
                x, y = shapely.get_coordinates(shapely.shortest_line(free, here))[0].tolist()
                return x, y
            room_m *= 0.5
        return None

    @functools.cached_property
    def solid(self) -> BaseGeometry:
        """The union of the obstacles, prepared; empty without any."""
        if self.limits is not None:
            return self.unfenced.solid
        union = shapely.union_all(list(self.polygons)) if self.polygons else MultiPolygon()
        shapely.prepare(union)
        return union

    @functools.cached_property
    def _shore(self) -> BaseGeometry:
        """The obstacles' edges."""
        return self.solid.boundary

    @functools.cached_property
    def _edge(self) -> BaseGeometry | None:
        """The limits' edge, None without a fence; the limits are prepared."""
        if self.limits is None:
            return None
        shapely.prepare(self.limits)
        return self.limits.boundary

    @functools.cached_property
    def _index(self) -> PolygonIndex:
        """The obstacles on a grid, for many points at once."""
        from companion.geo.segments import PolygonIndex

        return PolygonIndex(self.polygons)

    @functools.lru_cache(maxsize=8)  # noqa: B019 - an area lives as long as its voyage
    def buffered(self, margin_m: float) -> BaseGeometry:
        """Return the union of all points closer than ``margin_m`` (or the obstacle's own, larger) to an obstacle.

        Prepared. Contains the true buffer; at most 5 % wider.
        """
        if self.limits is not None:
            return self.unfenced.buffered(margin_m)
        grown = [buffer_out(p, max(margin_m, m)) for p, m in zip(self.polygons, self.own_margins_m, strict=True)]
        union = shapely.union_all(grown) if grown else MultiPolygon()
        shapely.prepare(union)
        return union

    @functools.lru_cache(maxsize=8)  # noqa: B019 - an area lives as long as its voyage
    def water(self, margin_m: float = 0.0) -> BaseGeometry | None:
        """Return the limits less ``margin_m``, prepared; None without a fence."""
        if self.limits is None:
            return None
        inner = buffer_in(self.limits, margin_m)
        shapely.prepare(inner)
        return inner

    def obstacle_clearance_m(self, points_en: ArrayLike) -> NDArray[np.float64]:
        """Return the distance of each point to the nearest obstacle [m], negative inside; inf without any."""
        if self.limits is not None:
            return self.unfenced.obstacle_clearance_m(points_en)
        wanted = np.asarray(points_en, dtype=np.float64).reshape(-1, 2)
        if self.solid.is_empty:
            return np.full(wanted.shape[0], np.inf)
        if wanted.shape[0] >= MANY_POINTS:
            return self._index.distance_m(wanted)
        points = shapely.points(wanted)
        outside = np.asarray(shapely.distance(self._shore, points))
        return np.where(shapely.covers(self.solid, points), -outside, outside)

    def limit_clearance_m(self, points_en: ArrayLike) -> NDArray[np.float64]:
        """Return the distance of each point to the limits' edge [m], negative outside; inf without a fence."""
        points = shapely.points(np.asarray(points_en, dtype=np.float64).reshape(-1, 2))
        if self.limits is None:
            return np.full(points.shape, np.inf)
        if self.limits.is_empty:
            return np.full(points.shape, -np.inf)
        inside = np.asarray(shapely.distance(self._edge, points))
        return np.where(shapely.covers(self.limits, points), inside, -inside)

    def clearance_m(self, points_en: ArrayLike) -> NDArray[np.float64]:
        """Return the smaller of the two clearances [m]: positive in free water."""
        if isinstance(points_en, list) and len(points_en) == 1 and isinstance(points_en[0], tuple):
            return np.array([self._clearance_at_m(points_en[0])])  # the boat's: asked for several times a step
        return np.minimum(self.obstacle_clearance_m(points_en), self.limit_clearance_m(points_en))

    def spare_m(self, points_en: ArrayLike, margin_m: float) -> NDArray[np.float64]:
        """Return how much farther off each point is than is kept clear [m]: the margin, or an obstacle's own, larger.

        As the water is drawn: with the corners' chords outwards.
        """
        spare = self.clearance_m(points_en) - grown_m(margin_m)
        points = shapely.points(np.asarray(points_en, dtype=np.float64).reshape(-1, 2))
        for polygon, own_m in zip(self.polygons, self.own_margins_m, strict=True):
            if own_m > margin_m:
                spare = np.minimum(spare, shapely.distance(polygon, points) - grown_m(own_m))
        return np.asarray(spare, dtype=np.float64)

    @functools.lru_cache(maxsize=16)  # noqa: B019 - an area lives as long as its voyage
    def _clearance_at_m(self, point_en: tuple[float, float]) -> float:
        """Return the clearance of one place [m]."""
        if self.limits is None:
            return float(self.obstacle_clearance_m([point_en])[0])
        return min(self.unfenced._clearance_at_m(point_en), float(self.limit_clearance_m([point_en])[0]))  # noqa: SLF001

    def contains(self, points_en: ArrayLike, margin_m: float = 0.0) -> NDArray[np.bool_]:
        """Return which points are in free water, ``margin_m`` clear of obstacles and limits."""
        points = np.asarray(points_en, dtype=np.float64).reshape(-1, 2)
        buffered, water = self.buffered(margin_m), self.water(margin_m)
        free = ~np.asarray(shapely.contains_xy(buffered, points[:, 0], points[:, 1]))
        if water is not None:
            free &= np.asarray(shapely.intersects_xy(water, points[:, 0], points[:, 1]))
        return np.asarray(free, dtype=np.bool_)

    def path_clearance_m(self, path_en: ArrayLike) -> float:
        """Return the exact smallest distance of a polyline (n, 2) to obstacles and limits [m], ≤ 0 on contact."""
        if isinstance(path_en, list) and len(path_en) == 2 and all(isinstance(place, tuple) for place in path_en):
            return self._way_clearance_m(*path_en)  # the boat's to its waypoint: asked for several times a step
        return self._path_clearance_m(path_en)

    @functools.lru_cache(maxsize=16)  # noqa: B019 - an area lives as long as its voyage
    def _way_clearance_m(self, from_en: tuple[float, float], to_en: tuple[float, float]) -> float:
        return self._path_clearance_m([from_en, to_en])

    def _path_clearance_m(self, path_en: ArrayLike) -> float:
        coordinates = np.asarray(path_en, dtype=np.float64).reshape(-1, 2)
        line = shapely.linestrings(coordinates) if len(coordinates) > 1 else shapely.points(coordinates[0])
        clearance = math.inf
        if not self.solid.is_empty:
            clearance = float(shapely.distance(self.solid, line))
        if self.limits is not None:
            inside = bool(shapely.covers(self.limits, line))
            clearance = min(clearance, float(shapely.distance(self._edge, line)) if inside else -1.0)
        return clearance

    def nearest_name(self, point_en: ArrayLike) -> str:
        """Return what the nearest obstacle or limit to a point is called; empty in open water."""
        point = shapely.points(np.asarray(point_en, dtype=np.float64).reshape(2))
        far = [float(shapely.distance(p, point)) for p in self.polygons]
        nearest = min(range(len(far)), key=far.__getitem__, default=None)
        if self.limits is not None and (nearest is None or float(self.limit_clearance_m(point_en)[0]) < far[nearest]):
            return self.edge_name
        return "" if nearest is None else self.names[nearest]

    def obstacles_wkt(self, margin_m: float = 0.0) -> list[str]:
        """Return the obstacles, grown by the margin and merged, as the WKT polygons of a planning problem."""
        merged = self.buffered(margin_m) if self.polygons else MultiPolygon()
        return [shapely.to_wkt(p, rounding_precision=4) for p in parts(merged)]

    def obstacle_names(self, margin_m: float = 0.0) -> list[str]:
        """Return what each of ``obstacles_wkt`` is called: by the obstacles that have grown into it."""
        out = []
        tree = shapely.STRtree(self.polygons)  # a chart has islands by the thousand
        for part in parts(self.buffered(margin_m)) if self.polygons else []:
            names = [self.names[n] for n in sorted(tree.query(part, predicate="intersects").tolist())]
            out.append(listed(names[:3]) if len(names) <= 3 else f"{', '.join(names[:2])} and {len(names) - 2} more")
        return out

    def fence_wkt(self, margin_m: float = 0.0, near_en: tuple[float, float] | None = None) -> str | None:
        """Return the limits less the margin as a WKT polygon, None without a fence.

        Limits in several pieces give the piece that holds ``near_en``, or the nearest to it. Raises ValueError
        when the margin leaves no water at all.
        """
        water = self.water(margin_m)
        if water is None:
            return None
        pieces = parts(water)
        if not pieces:
            raise ValueError(f"no water is left inside the fence at a margin of {margin_m:g} m")
        if near_en is not None:
            here = shapely.points(near_en)
            pieces.sort(key=lambda p: (float(shapely.distance(p, here)), -p.area))
        return str(shapely.to_wkt(pieces[0], rounding_precision=4))


# The part of a shape that lies about a place, in local metres: for a passage, whose area is larger than any frame.
#
# An edge that is long is no straight line in every frame. Edges are taken to be straight in longitude and latitude, as
# ArduPilot draws them, and are cut into pieces so short that each is straight in a frame within ``SAGITTA_M``.

SAGITTA_M = 0.1
RADIUS_M = 6_371_000.0
LEAST_TAN = 0.1  # of the latitude: pieces at the equator are no longer than for this
POLE_DEG = 89.0  # from here on a box of longitudes says nothing
BENT = 2e-6  # of a circle's radius, the more its sides bend on the ground within 200 km of a frame's origin
FARTHEST_M = 1.9e7  # from the origin: a ring round the other end of the earth would be inside out


def polygons_about(shape: Shape, frame: LocalFrame, reach_m: float, *, cover: bool = True) -> list[Polygon]:
    """Return what of a shape lies within ``reach_m`` of the frame's origin, and a little more, in its metres.

    ``cover`` is as for ``polygon_en``.
    """
    if isinstance(shape, Circle):
        return _circle_about(shape, frame, reach_m, cover=cover)
    pieces: list[Polygon] = []
    for turns in (-1, 0, 1):
        aside_deg = np.array([360.0 * turns, 0.0])
        part: BaseGeometry = shapely.transform(shape, lambda lonlat, aside=aside_deg: lonlat + aside)
        if math.isfinite(reach_m):
            part = shapely.intersection(part, _box(frame, reach_m))
        elif turns != 0:
            continue
        pieces += [
            p
            for p in shapely.get_parts(shapely.segmentize(part, _piece_deg(frame, part)))
            if isinstance(p, Polygon) and not p.is_empty
        ]
    return [_in_metres(piece, frame) for piece in pieces]


def _circle_about(circle: Circle, frame: LocalFrame, reach_m: float, *, cover: bool) -> list[Polygon]:
    """Return what of a circle lies within ``reach_m``: its corners by geodesics, its sides straight in the frame."""
    from pyproj import Geod  # as a frame has it: a planner's process does without

    off_m = math.hypot(*frame.en_from_geo(circle.center))
    if off_m - circle.radius_m > reach_m or off_m + circle.radius_m > FARTHEST_M:
        return []
    radius_m = circle.radius_m * ((1.0 + BENT) / math.cos(math.pi / CIRCLE_SIDES) if cover else 1.0)
    courses_deg = np.arange(CIRCLE_SIDES) * (360.0 / CIRCLE_SIDES)
    lon_deg, lat_deg = np.full(CIRCLE_SIDES, circle.center.lon_deg), np.full(CIRCLE_SIDES, circle.center.lat_deg)
    lon_deg, lat_deg, _ = Geod(ellps="WGS84").fwd(lon_deg, lat_deg, courses_deg, np.full(CIRCLE_SIDES, radius_m))
    ring = Polygon(frame.array_en_from_lonlat(np.column_stack([lon_deg, lat_deg])))
    return [ring] if math.isinf(reach_m) else parts(shapely.clip_by_rect(ring, -reach_m, -reach_m, reach_m, reach_m))


def _box(frame: LocalFrame, reach_m: float) -> Polygon:
    """Return the box of longitude and latitude that holds every place within ``reach_m`` of the origin."""
    lat, lon = frame.origin.lat_deg, frame.origin.lon_deg
    tall = reach_m / LEAST_DEGREE_M
    south, north = max(-90.0, lat - tall), min(90.0, lat + tall)
    most = max(abs(south), abs(north))
    wide = 180.0 if most >= POLE_DEG else min(180.0, tall / math.cos(math.radians(most)))
    return shapely.box(lon - wide, south, lon + wide, north)


def _piece_deg(frame: LocalFrame, part: BaseGeometry) -> float:
    """Return how long the pieces of an edge may be [deg]: the middle of each is off its chord by ``SAGITTA_M``."""
    south, north = (frame.origin.lat_deg,) * 2 if part.is_empty else (part.bounds[1], part.bounds[3])
    steep = math.tan(math.radians(min(POLE_DEG, max(abs(south), abs(north)))))
    return math.sqrt(8.0 * RADIUS_M * SAGITTA_M / max(LEAST_TAN, steep)) / LEAST_DEGREE_M


def _in_metres(polygon: Polygon, frame: LocalFrame) -> Polygon:
    return Polygon(
        frame.array_en_from_lonlat(np.asarray(polygon.exterior.coords)[:, :2]),
        [frame.array_en_from_lonlat(np.asarray(ring.coords)[:, :2]) for ring in polygon.interiors],
    )
