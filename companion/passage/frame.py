"""The frame of a passage: a sphere turned so that the way from start to goal is its equator.

No date line and no pole lies on the way, and a step along is as long as it looks: x [m] along the equator from the
start, y [m] to its left, on a sphere on which start and goal are as far apart as on WGS 84. What is timed in the end is
timed on the ellipsoid.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pyproj import Geod

from companion.messages import GeoPoint

Floats = NDArray[np.float64]
GEOD = Geod(ellps="WGS84")


def up_of(lat_deg: ArrayLike, lon_deg: ArrayLike) -> Floats:
    """Return (..., 3): the unit vectors of places."""
    lat, lon = np.radians(lat_deg), np.radians(lon_deg)
    return np.stack(np.broadcast_arrays(np.cos(lat) * np.cos(lon), np.cos(lat) * np.sin(lon), np.sin(lat)), axis=-1)


@dataclass(frozen=True, slots=True, eq=False)
class PassageFrame:
    """The frame between two places that are neither one nor opposite each other."""

    start: GeoPoint
    goal: GeoPoint
    length_m: float = field(init=False)
    radius_m: float = field(init=False)
    axes: Floats = field(init=False, repr=False)

    def __post_init__(self) -> None:
        a, b = (up_of(p.lat_deg, p.lon_deg) for p in (self.start, self.goal))
        pole = np.cross(a, b)
        sine = float(np.linalg.norm(pole))
        angle = math.atan2(sine, float(a @ b))
        length_m = float(GEOD.inv(self.start.lon_deg, self.start.lat_deg, self.goal.lon_deg, self.goal.lat_deg)[2])
        if sine < 1e-9 or angle > math.radians(170.0):
            raise ValueError("start and goal are one place, or lie opposite each other")
        z = pole / sine
        object.__setattr__(self, "length_m", length_m)
        object.__setattr__(self, "radius_m", length_m / angle)
        object.__setattr__(self, "axes", np.stack([a, np.cross(z, a), z]))

    def xy_from_geo(self, lat_deg: ArrayLike, lon_deg: ArrayLike) -> Floats:
        """Return (..., 2) [m]."""
        turned = up_of(lat_deg, lon_deg) @ self.axes.T
        x = np.arctan2(turned[..., 1], turned[..., 0])
        y = np.arcsin(np.clip(turned[..., 2], -1.0, 1.0))
        return self.radius_m * np.stack([x, y], axis=-1)

    def geo_from_xy(self, xy_m: ArrayLike) -> tuple[Floats, Floats]:
        """Return latitudes and longitudes [deg], these from -180 to 180."""
        angle = np.asarray(xy_m, dtype=np.float64) / self.radius_m
        x, y = angle[..., 0], angle[..., 1]
        up = np.stack([np.cos(y) * np.cos(x), np.cos(y) * np.sin(x), np.sin(y)], axis=-1) @ self.axes
        return np.degrees(np.arcsin(np.clip(up[..., 2], -1.0, 1.0))), np.degrees(np.arctan2(up[..., 1], up[..., 0]))

    def turned(self, east: Floats, north: Floats, lat_deg: Floats, lon_deg: Floats) -> tuple[Floats, Floats]:
        """Return vectors (east, north) at places as (along x, along y)."""
        lon = np.radians(lon_deg)
        to_east = np.stack([-np.sin(lon), np.cos(lon), np.zeros_like(lon)], axis=-1)
        up = up_of(lat_deg, lon_deg)
        along = np.cross(self.axes[2], up)
        along /= np.linalg.norm(along, axis=-1, keepdims=True)
        cosine = np.sum(along * to_east, axis=-1)
        sine = np.sum(along * np.cross(up, to_east), axis=-1)  # of the angle from east to x, to the left
        return east * cosine + north * sine, north * cosine - east * sine
