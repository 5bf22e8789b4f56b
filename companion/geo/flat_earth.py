"""Büsser's flat earth, kept as a reference: a plane of latitude and longitude scaled at the origin.

Büsser 2009, equation 4.2: x = R_E cos(lat) π/180 lon, y = R_E π/180 lat, then an offset is subtracted; here lat in the
cosine is the origin's, without which x would not be a function of longitude alone. Fine
within a kilometre or so; the boat uses ``companion.geo.frame``.
``docs/frames.md`` has the table of its errors.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from companion.messages import GeoPoint

EARTH_RADIUS_M = 6_371_000.0  # mean radius of the sphere


def flat_en_from_lonlat(origin: GeoPoint, lonlat_deg: ArrayLike) -> NDArray[np.float64]:
    """Return (n, 2) east, north [m] of (n, 2) lon, lat [deg] by Büsser's equation 4.2."""
    lonlat = np.asarray(lonlat_deg, dtype=np.float64).reshape(-1, 2)
    delta_lon = np.radians((lonlat[:, 0] - origin.lon_deg + 180.0) % 360.0 - 180.0)
    east_m = EARTH_RADIUS_M * delta_lon * math.cos(math.radians(origin.lat_deg))
    return np.column_stack([east_m, EARTH_RADIUS_M * np.radians(lonlat[:, 1] - origin.lat_deg)])


def flat_lonlat_from_en(origin: GeoPoint, en_m: ArrayLike) -> NDArray[np.float64]:
    """Return (n, 2) lon, lat [deg] of (n, 2) east, north [m]; the inverse of ``flat_en_from_lonlat``."""
    en = np.asarray(en_m, dtype=np.float64).reshape(-1, 2)
    lon = origin.lon_deg + np.degrees(en[:, 0] / (EARTH_RADIUS_M * math.cos(math.radians(origin.lat_deg))))
    return np.column_stack([(lon + 180.0) % 360.0 - 180.0, origin.lat_deg + np.degrees(en[:, 1] / EARTH_RADIUS_M)])
