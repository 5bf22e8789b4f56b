"""A route as a mission: goals, and a band about each leg, as ``companion run`` sails a passage."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from companion.messages import GeoPoint
from companion.passage.frame import GEOD
from companion.passage.plan import COARSE, CORRIDOR, Passage, Route
from companion.passage.replay import Sailed

_LEAST_BAND_M = 200.0
_ROOM = 0.8  # of the way to land
WAYPOINT_M = 200.0
_LEG_ROOM = 1.2
_SHARE_OF_LEG = 0.8


def mission_of(route: Route, passage: Passage, name: str) -> dict[str, Any]:
    """Return the tables of a mission: start, goals and ``[passage]``.

    A band is as wide as the corridor that the route was refined in, and less where land is near. Raises ValueError
    without a way.
    """
    if not route.waypoints:
        raise ValueError("there is no way to sail")
    points = route.waypoints
    bands = [
        _band_m(
            passage, a.lat_deg, a.lon_deg, b.lat_deg, b.lon_deg, GEOD.inv(a.lon_deg, a.lat_deg, b.lon_deg, b.lat_deg)[2]
        )
        for a, b in pairwise(points)
    ]
    return {"name": name, **goals_of(points, bands, min(passage.radius_m, 5000.0))}


def goals_of(points: Sequence[GeoPoint], bands_m: Sequence[float], radius_m: float) -> dict[str, Any]:
    """Return start, goals and ``[passage]`` of a mission, of places and the bands about the legs between them."""
    goals, longest = [], 0.0
    for k, ((a, b), band_m) in enumerate(zip(pairwise(points), bands_m, strict=True), start=1):
        length_m = float(GEOD.inv(a.lon_deg, a.lat_deg, b.lon_deg, b.lat_deg)[2])
        longest = max(longest, length_m)
        last = k == len(points) - 1
        near_m = float(math.floor(_SHARE_OF_LEG * length_m))  # no place is reached where the one before it is
        goals.append(
            {
                "name": "landfall" if last else f"waypoint {k}",
                "lat": round(b.lat_deg, 7),
                "lon": round(b.lon_deg, 7),
                "radius_m": min(radius_m if last else WAYPOINT_M, max(1.0, near_m)),
                "bandwidth_m": round(band_m),
            }
        )
    start: Mapping[str, Any] = {"lat": round(points[0].lat_deg, 7), "lon": round(points[0].lon_deg, 7)}
    return {
        "start": dict(start),
        "goal": goals,
        "passage": {"leg_m": float(math.ceil(_LEG_ROOM * longest / 1000.0) * 1000)},
    }


def arrivals_s(runs: Sequence[Sailed], points: Sequence[GeoPoint], quantiles: Sequence[float]) -> list[list[float]]:
    """Return by place the quantiles of the time [s] at which runs are there; inf where so many are not."""
    way = np.cumsum([0.0, *(GEOD.inv(a.lon_deg, a.lat_deg, b.lon_deg, b.lat_deg)[2] for a, b in pairwise(points))])
    there = np.full((len(runs), way.size), np.inf)
    for row, run in enumerate(runs):
        if len(run.rows):
            at = np.minimum(way, run.length_m)
            gone = np.maximum.accumulate(run.rows[:, 1])
            reached = (at <= gone[-1] + 1.0) | ((np.arange(way.size) == way.size - 1) & run.arrived)
            there[row] = np.where(reached, np.interp(at, gone, run.rows[:, 0] - run.rows[0, 0]), np.inf)
    there.sort(axis=0)
    picks = [min(len(runs) - 1, int(q * len(runs))) for q in quantiles]
    return [[float(there[pick, k]) for pick in picks] for k in range(way.size)]


def _band_m(passage: Passage, lat1: float, lon1: float, lat2: float, lon2: float, length_m: float) -> float:
    count = max(2, int(length_m / 1000.0) + 1)
    middle = np.array(GEOD.npts(lon1, lat1, lon2, lat2, count))
    near = float(passage.land.distance_m(passage.frame.xy_from_geo(middle[:, 1], middle[:, 0])).min())
    return max(_LEAST_BAND_M, min(CORRIDOR * passage.frame.length_m / COARSE, _ROOM * near))
