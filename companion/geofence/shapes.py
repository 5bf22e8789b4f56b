"""Shapes on the globe: circles, zones and obstacles in longitude and latitude.

Polygons are shapely polygons in degrees, x = longitude, y = latitude (WGS 84), valid and not empty. A shape that
crosses the antimeridian has continuous longitudes that run past ±180; ``wrap_lon_deg`` brings single positions
back.
"""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray
from shapely.geometry import Polygon

from companion.geo import EARTH_RADIUS_M, LEAST_DEGREE_M
from companion.geo.frame import LocalFrame
from companion.messages import GeoPoint

CIRCLE_SIDES = 48  # a circle drawn as a polygon has this many sides
STRAY_SPARE = 1.12  # a slanting side strays by 9 % more than one along a parallel, and the earth is no sphere
MOST_LAT_DEG = 85.0  # nearer to a pole no ring in degrees is one on the ground
MOST_RADIUS_M = 1e6  # of a circle in a file: what is larger is a slip, and flat in no frame


def wrap_lon_deg(lon_deg: float) -> float:
    """Return the longitude on [-180, 180].

    >>> wrap_lon_deg(190.0)
    -170.0
    """
    if -180.0 <= lon_deg <= 180.0:
        return lon_deg
    return math.remainder(lon_deg, 360.0)


class ZoneKind(enum.Enum):
    """Keep in or keep out."""

    INCLUSION = "inclusion"
    EXCLUSION = "exclusion"


@dataclass(frozen=True, slots=True)
class Circle:
    """All points within ``radius_m`` of ``center``."""

    center: GeoPoint
    radius_m: float

    def __post_init__(self) -> None:
        if not (math.isfinite(self.radius_m) and self.radius_m > 0.0):
            raise ValueError(f"radius {self.radius_m} m is not a positive number")


Shape: TypeAlias = Polygon | Circle


@dataclass(frozen=True, slots=True, kw_only=True)
class Zone:
    """A keep-in or keep-out zone of a fence. ``margin_m`` is the zone's own margin, None for the mission's.

    ``depth_m`` is the water's, below the chart's datum, where a chart tells it; negative: it dries.
    """

    kind: ZoneKind
    shape: Shape
    name: str = ""
    margin_m: float | None = None
    depth_m: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Obstacle:
    """Something solid. ``margin_m`` is its own margin where it must be larger than the mission's.

    ``depth_m`` is as a ``Zone`` has it.
    """

    shape: Shape
    name: str = ""
    margin_m: float | None = None
    depth_m: float | None = None

    def zone(self) -> Zone:
        """Return the obstacle as a keep-out zone."""
        return Zone(
            kind=ZoneKind.EXCLUSION, shape=self.shape, name=self.name, margin_m=self.margin_m, depth_m=self.depth_m
        )


def polygon_en(shape: Shape, frame: LocalFrame, *, cover: bool = True) -> Polygon:
    """Return the shape in ``frame`` [m]; a circle becomes ``CIRCLE_SIDES`` sides.

    With ``cover`` the polygon contains the circle (for obstacles), without it the circle contains the polygon
    (for limits), so that drawing a circle never makes the sea larger.
    """
    if isinstance(shape, Circle):
        east_m, north_m = frame.en_from_geo(shape.center)
        turns = 2.0 * math.pi * np.arange(CIRCLE_SIDES) / CIRCLE_SIDES
        radius_m = shape.radius_m / math.cos(math.pi / CIRCLE_SIDES) if cover else shape.radius_m
        return Polygon(np.column_stack([east_m + radius_m * np.sin(turns), north_m + radius_m * np.cos(turns)]))
    return Polygon(
        frame.array_en_from_lonlat(np.asarray(shape.exterior.coords)[:, :2]),
        [frame.array_en_from_lonlat(np.asarray(ring.coords)[:, :2]) for ring in shape.interiors],
    )


def polygon_lonlat(polygon: Polygon, frame: LocalFrame) -> Polygon:
    """Return a polygon of ``frame`` [m] in longitude and latitude, continuous across the antimeridian."""
    shell = unwrapped(frame.array_lonlat_from_en(np.asarray(polygon.exterior.coords)[:, :2]))
    reference = float(shell[0, 0])
    holes = [
        unwrapped(frame.array_lonlat_from_en(np.asarray(ring.coords)[:, :2]), near_lon_deg=reference)
        for ring in polygon.interiors
    ]
    return Polygon(shell, holes)


def unwrapped(lonlat_deg: ArrayLike, *, near_lon_deg: float | None = None) -> NDArray[np.float64]:
    """Return an (n, 2) array of lon, lat whose longitudes have no jump of more than 180 degrees."""
    lonlat = np.array(lonlat_deg, dtype=np.float64).reshape(-1, 2)
    if lonlat.shape[0] and float(np.ptp(lonlat[:, 0])) > 180.0:
        is_ring = bool(np.array_equal(lonlat[0], lonlat[-1]))
        lonlat[:, 0] = np.unwrap(lonlat[:, 0], period=360.0)
        if is_ring and abs(lonlat[0, 0] - lonlat[-1, 0]) < 1e-6:
            lonlat[-1] = lonlat[0]  # what is rounded would make the ring cross itself where it begins
    if near_lon_deg is not None and lonlat.shape[0]:
        lonlat[:, 0] += 360.0 * round((near_lon_deg - float(lonlat[0, 0])) / 360.0)
    return lonlat


def center_of(shape: Shape) -> GeoPoint:
    """Return a point in the middle of the shape's bounding box."""
    if isinstance(shape, Circle):
        return shape.center
    west, south, east, north = shapely.bounds(shape)
    return GeoPoint(lat_deg=float(south + north) / 2.0, lon_deg=wrap_lon_deg(float(west + east) / 2.0))


def drawn(zone: Zone) -> Polygon:
    """Return the zone as a polygon in longitude and latitude.

    A circle becomes ``CIRCLE_SIDES`` sides: around it for a keep-out zone, inside it for a keep-in zone. Straight in
    degrees they run nearer to the equator than on the ground: those around it are so much farther out.
    """
    if isinstance(zone.shape, Circle):
        circle, frame = zone.shape, LocalFrame(zone.shape.center)
        is_around = zone.kind is ZoneKind.EXCLUSION
        if is_around:
            most_deg = min(MOST_LAT_DEG, abs(circle.center.lat_deg) + circle.radius_m / LEAST_DEGREE_M)
            half_m = circle.radius_m * math.tan(math.pi / CIRCLE_SIDES)
            stray_m = half_m**2 * math.tan(math.radians(most_deg)) / (2.0 * EARTH_RADIUS_M)
            circle = Circle(circle.center, circle.radius_m + STRAY_SPARE * stray_m)
        return polygon_lonlat(polygon_en(circle, frame, cover=is_around), frame)
    return zone.shape
