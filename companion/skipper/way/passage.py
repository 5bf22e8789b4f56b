"""A leg of a passage: the line between two global waypoints that are farther apart than any frame is flat.

The line is the geodesic between them, the same one in every frame. Büsser 2009, section 4.2: a bandwidth bounds the way
about it, and the local plan covers the next miles of it only.
"""

from __future__ import annotations

import numpy as np
import shapely
from pyproj import Geod
from shapely.geometry import LineString

from companion.geo.frame import LocalFrame
from companion.skipper.way.geometry import distance_m
from companion.skipper.way.voyage import PointEn

PIECE_M = 2000.0   # a geodesic is off a chord of this length by 8 cm at most, at 75 degrees of latitude too
_EARTH = Geod(ellps="WGS84")


def leg_line(frame: LocalFrame, from_en: PointEn, to_en: PointEn, near_en: PointEn, reach_m: float) -> LineString:
    """Return what of the leg lies within ``reach_m`` along it of the place that is nearest to ``near_en``.

    It is cut into pieces of ``PIECE_M``; both ends of the leg are in it where they are near enough.
    """
    a, b, here = (frame.geo_from_en(*en) for en in (from_en, to_en, near_en))
    azimuth_deg, _, length_m = _EARTH.inv(a.lon_deg, a.lat_deg, b.lon_deg, b.lat_deg)
    to_here_deg, _, far_m = _EARTH.inv(a.lon_deg, a.lat_deg, here.lon_deg, here.lat_deg)
    along_m = min(max(far_m * float(np.cos(np.radians(to_here_deg - azimuth_deg))), 0.0), length_m)
    begin_m, end_m = max(0.0, along_m - reach_m), min(length_m, along_m + reach_m)
    if length_m < 1.0 or end_m - begin_m < 1.0:
        return LineString([from_en, to_en])
    stations_m = np.linspace(begin_m, end_m, max(2, 1 + int(np.ceil((end_m - begin_m) / PIECE_M))))
    count = len(stations_m)
    lon_deg, lat_deg, _ = _EARTH.fwd(
        np.full(count, a.lon_deg), np.full(count, a.lat_deg), np.full(count, azimuth_deg), stations_m)
    return LineString(frame.array_en_from_lonlat(np.column_stack([lon_deg, lat_deg])))


def along(line: LineString, near_en: PointEn, ahead_m: float, aside_m: float = 0.0) -> PointEn:
    """Return the place ``ahead_m`` along the line from where it is nearest to ``near_en``, ``aside_m`` to its right."""
    at_m = float(line.project(shapely.points(near_en))) + ahead_m
    place, before = line.interpolate(at_m), line.interpolate(max(0.0, at_m - 1.0))
    east, north = place.x - before.x, place.y - before.y
    length = max(distance_m((0.0, 0.0), (east, north)), 1e-9)
    return float(place.x + aside_m * north / length), float(place.y - aside_m * east / length)

