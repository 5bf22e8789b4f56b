"""The local east-north frame: WGS 84 to metres and back by pyproj.

Azimuthal equidistant about the mission's origin: exact along rays from it, below 1 m wrong between any two
points within 50 km. Latitudes and longitudes are degrees everywhere in this project (the one angle that is,
because every format, chart and library writes them so) and always named ``_deg``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from companion.messages import GeoPoint

RANGE_M = 50_000.0  # so far from its origin a frame is good for; what lies farther off is a mistake


@lru_cache(maxsize=32)
def _transformer(origin: GeoPoint) -> tuple[Any, Any]:
    """Return pyproj's transformer of the frame, and its word for the way back: a name it would look up at every call.

    It takes 7 ms to make, and a frame is asked for often. Pyproj is loaded with the first: a planner's process, which
    knows the frame's name alone, is 5 MB smaller without it.
    """
    from pyproj import Transformer
    from pyproj.enums import TransformDirection

    crs = f"+proj=aeqd +lat_0={origin.lat_deg!r} +lon_0={origin.lon_deg!r} +datum=WGS84 +units=m +no_defs"
    return Transformer.from_crs("EPSG:4326", crs, always_xy=True), TransformDirection.INVERSE


@dataclass(frozen=True, slots=True)
class LocalFrame:
    """Metres east and north of ``origin``."""

    origin: GeoPoint
    _forward: Any = field(init=False, repr=False, compare=False)
    _back: Any = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        forward, back = _transformer(self.origin)
        object.__setattr__(self, "_forward", forward)
        object.__setattr__(self, "_back", back)

    def __reduce__(self) -> tuple[type[LocalFrame], tuple[GeoPoint]]:
        return (LocalFrame, (self.origin,))

    def en_from_geo(self, point: GeoPoint) -> tuple[float, float]:
        """Return (east, north) [m]."""
        east_m, north_m = self._forward.transform(point.lon_deg, point.lat_deg)
        return float(east_m), float(north_m)

    def geo_from_en(self, east_m: float, north_m: float) -> GeoPoint:
        """Return the point at (east, north) [m]."""
        lon_deg, lat_deg = self._forward.transform(east_m, north_m, direction=self._back)
        return GeoPoint(lat_deg=float(lat_deg), lon_deg=math.remainder(lon_deg, 360.0))  # PROJ leaves 180.000000000004

    def array_en_from_lonlat(self, lonlat_deg: ArrayLike) -> NDArray[np.float64]:
        """Return an (n, 2) array of east, north [m] from an (n, 2) array of lon, lat [deg]."""
        lonlat = np.asarray(lonlat_deg, dtype=np.float64).reshape(-1, 2)
        east_m, north_m = self._forward.transform(lonlat[:, 0], lonlat[:, 1])
        return np.column_stack([east_m, north_m])

    def array_lonlat_from_en(self, en_m: ArrayLike) -> NDArray[np.float64]:
        """Return an (n, 2) array of lon, lat [deg] from an (n, 2) array of east, north [m]."""
        en = np.asarray(en_m, dtype=np.float64).reshape(-1, 2)
        lon_deg, lat_deg = self._forward.transform(en[:, 0], en[:, 1], direction=self._back)
        beyond = np.abs(lon_deg) > 180.0
        return np.column_stack([np.where(beyond, lon_deg - np.copysign(360.0, lon_deg), lon_deg), lat_deg])
