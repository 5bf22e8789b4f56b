"""The part of a shape that lies about a place, in local metres: for a passage, whose area is larger than any frame.

An edge that is long is no straight line in every frame. Edges are taken to be straight in longitude and latitude, as
ArduPilot draws them, and are cut into pieces so short that each is straight in a frame within ``SAGITTA_M``.
"""

from __future__ import annotations

import math

import numpy as np
import shapely
from shapely.geometry import Polygon
from shapely.geometry.base import BaseGeometry

from companion.geo.frame import LocalFrame
from companion.geofence.shapes import Circle, Shape, Zone, ZoneKind, drawn, polygon_en

SAGITTA_M = 0.1
RADIUS_M = 6_371_000.0
DEGREE_M = 110_500.0        # the shortest degree of latitude
LEAST_TAN = 0.1             # of the latitude: pieces at the equator are no longer than for this
POLE_DEG = 89.0             # from here on a box of longitudes says nothing


def polygons_about(shape: Shape, frame: LocalFrame, reach_m: float, *, cover: bool = True) -> list[Polygon]:
    """Return what of a shape lies within ``reach_m`` of the frame's origin, and a little more, in its metres.

    ``cover`` is as for ``polygon_en``. A circle is itself where its middle is near, else what is drawn of it.
    """
    if isinstance(shape, Circle):
        if math.hypot(*frame.en_from_geo(shape.center)) + shape.radius_m <= reach_m:
            return [polygon_en(shape, frame, cover=cover)]
        shape = drawn(Zone(kind=ZoneKind.EXCLUSION if cover else ZoneKind.INCLUSION, shape=shape))
    pieces: list[Polygon] = []
    for turns in (-1, 0, 1):
        aside_deg = np.array([360.0 * turns, 0.0])
        part: BaseGeometry = shapely.transform(shape, lambda lonlat, aside=aside_deg: lonlat + aside)
        if math.isfinite(reach_m):
            part = shapely.intersection(part, _box(frame, reach_m))
        elif turns != 0:
            continue
        pieces += [p for p in shapely.get_parts(shapely.segmentize(part, _piece_deg(frame, part)))
                   if isinstance(p, Polygon) and not p.is_empty]
    return [_in_metres(piece, frame) for piece in pieces]


def _box(frame: LocalFrame, reach_m: float) -> Polygon:
    """Return the box of longitude and latitude that holds every place within ``reach_m`` of the origin."""
    lat, lon = frame.origin.lat_deg, frame.origin.lon_deg
    tall = reach_m / DEGREE_M
    south, north = max(-90.0, lat - tall), min(90.0, lat + tall)
    most = max(abs(south), abs(north))
    wide = 180.0 if most >= POLE_DEG else min(180.0, tall / math.cos(math.radians(most)))
    return shapely.box(lon - wide, south, lon + wide, north)


def _piece_deg(frame: LocalFrame, part: BaseGeometry) -> float:
    """Return how long the pieces of an edge may be [deg]: the middle of each is off its chord by ``SAGITTA_M``."""
    south, north = (frame.origin.lat_deg,) * 2 if part.is_empty else (part.bounds[1], part.bounds[3])
    steep = math.tan(math.radians(min(POLE_DEG, max(abs(south), abs(north)))))
    return math.sqrt(8.0 * RADIUS_M * SAGITTA_M / max(LEAST_TAN, steep)) / DEGREE_M


def _in_metres(polygon: Polygon, frame: LocalFrame) -> Polygon:
    return Polygon(
        frame.array_en_from_lonlat(np.asarray(polygon.exterior.coords)[:, :2]),
        [frame.array_en_from_lonlat(np.asarray(ring.coords)[:, :2]) for ring in polygon.interiors])
