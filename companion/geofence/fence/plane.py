"""An area in the plane of longitude and latitude, scaled to metres, in which ArduPilot draws its fence."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry import Polygon
from shapely.geometry.base import BaseGeometry

from companion.geofence.area import Area, parts
from companion.geofence.fence.simplify import circle_round
from companion.geofence.shapes import Circle, Shape, wrap_lon_deg
from companion.messages import GeoPoint

AUTOPILOT_METRES_PER_DEGREE = 111_318.845  # ArduPilot's sphere (LATLON_TO_M), which draws its circles
EQUATOR_M, FLATTENING = 6_378_137.0, 1.0 / 298.257223563  # WGS 84


@dataclass(frozen=True)
class Plane:
    """Longitude and latitude scaled to metres: straight lines stay straight, as on the autopilot.

    Lengths are wrong by at most ``error`` (a fraction) within the area, ArduPilot's own sphere included.
    """

    lat_deg: float
    lon_deg: float
    error: float

    @property
    def scale(self) -> NDArray[np.float64]:
        """Metres per degree of longitude and of latitude, on the ellipsoid."""
        sin2 = math.sin(math.radians(self.lat_deg)) ** 2
        e2 = FLATTENING * (2.0 - FLATTENING)
        east = EQUATOR_M / math.sqrt(1.0 - e2 * sin2) * math.cos(math.radians(self.lat_deg))
        north = EQUATOR_M * (1.0 - e2) / (1.0 - e2 * sin2) ** 1.5
        return np.asarray(np.radians(np.array([east, north])))

    def metres(self, polygon: Polygon) -> Polygon:
        """Return a polygon of degrees in metres; longitudes are brought near the plane's."""
        def scaled(coordinates: NDArray[np.float64]) -> NDArray[np.float64]:
            lonlat = coordinates[:, :2] - np.array([self.lon_deg, self.lat_deg])
            lonlat[:, 0] -= 360.0 * np.round(np.median(lonlat[:, 0]) / 360.0)
            return np.asarray(lonlat * self.scale)
        return shapely.transform(shapely.force_2d(polygon), scaled)

    def point(self, point: GeoPoint) -> tuple[float, float]:
        """Return a place in the plane [m]."""
        lon = math.remainder(point.lon_deg - self.lon_deg, 360.0)
        x, y = np.array([lon, point.lat_deg - self.lat_deg]) * self.scale
        return float(x), float(y)

    def degrees(self, xy: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return (n, 2) places of the plane as longitude and latitude [deg]."""
        return np.asarray(xy / self.scale + np.array([self.lon_deg, self.lat_deg]))

    def geo(self, x: float, y: float) -> GeoPoint:
        """Return a place of the plane, rounded as on the wire."""
        lon, lat = self.degrees(np.array([[x, y]]))[0]
        return GeoPoint(lat_deg=round(float(lat), 7), lon_deg=wrap_lon_deg(round(float(lon), 7)))


def plane_of(area: Area, near: GeoPoint) -> Plane:
    """Return the plane of the area. The scale's error grows with tan(latitude) times the extent."""
    reach_deg = 0.0
    shapes = [o.shape for o in area.solids] + [z.shape for z in area.fence.inclusions]
    for shape in shapes:
        if isinstance(shape, Circle):
            lats = [shape.center.lat_deg - shape.radius_m / 1.1e5, shape.center.lat_deg + shape.radius_m / 1.1e5]
        else:
            lats = [float(shape.bounds[1]), float(shape.bounds[3])]
        reach_deg = max(reach_deg, *(abs(lat - near.lat_deg) for lat in lats))
    flat = math.tan(math.radians(min(85.0, abs(near.lat_deg) + reach_deg))) * math.radians(reach_deg)
    scale = Plane(near.lat_deg, near.lon_deg, 0.0).scale
    cosine = np.array([math.cos(math.radians(near.lat_deg)), 1.0])
    sphere = float(np.max(np.abs(scale / (AUTOPILOT_METRES_PER_DEGREE * cosine) - 1.0)))
    return Plane(near.lat_deg, near.lon_deg, flat + sphere + 1e-4)


def shape_in(shape: Shape, plane: Plane, *, cover: bool) -> tuple[Polygon, tuple[float, float, float] | None]:
    """Return a shape in the plane; a circle as (x, y, radius) too, its polygon drawn around or inside."""
    if isinstance(shape, Circle):
        x, y = plane.point(shape.center)
        radius = shape.radius_m * (1.0 + plane.error if cover else 1.0 - plane.error)
        return circle_round(x, y, radius, inside=not cover), (x, y, radius)
    return plane.metres(shape), None


def limits_in(
    area: Area, plane: Plane, places: list[tuple[float, float]],
) -> tuple[BaseGeometry | None, Circle | None]:
    """Return the piece of the keep-in zones' intersection that holds the start, and the circle if it is one."""
    limits: BaseGeometry | None = None
    for zone in area.fence.inclusions:
        polygon, _ = shape_in(zone.shape, plane, cover=False)
        if zone.margin_m:
            polygon = shapely.buffer(polygon, -zone.margin_m * (1.0 + plane.error))
        limits = polygon if limits is None else shapely.intersection(limits, polygon)
    if limits is None:
        return None, None
    here = shapely.points(places[0])
    piece = next((p for p in parts(limits) if shapely.covers(p, here)), Polygon())
    only = area.fence.inclusions[0] if len(area.fence.inclusions) == 1 else None
    rim = only.shape if only is not None and isinstance(only.shape, Circle) and not only.margin_m else None
    return piece, rim


def cut_by_rings(
    area: Area, plane: Plane, places: list[tuple[float, float]], limits: BaseGeometry | None, notes: list[str],
) -> BaseGeometry | None:
    """Return the limits cut to the hole of any obstacle that surrounds the start: a lake in its shore."""
    here = shapely.points(places[0])
    for obstacle in area.solids:
        polygon, _ = shape_in(obstacle.shape, plane, cover=True)
        for ring in polygon.interiors:
            if shapely.covers(Polygon(ring), here):
                hole = Polygon(ring)
                if obstacle.margin_m:
                    hole = shapely.buffer(hole, -obstacle.margin_m)
                limits = hole if limits is None else shapely.intersection(limits, hole)
                notes.append(f"the boat sails inside {obstacle.name or 'an obstacle'}: its shore is a keep-in zone")
    return limits
