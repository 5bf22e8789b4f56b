"""A route as a mission: goals, and a band about each leg, as ``companion run`` sails a passage."""

from __future__ import annotations

import math
from collections.abc import Mapping
from itertools import pairwise
from typing import Any

import numpy as np

from companion.passage.frame import GEOD
from companion.passage.plan import COARSE, CORRIDOR, Passage, Route

_LEAST_BAND_M = 200.0
_ROOM = 0.8  # of the way to land
_GOAL_M = 200.0
_LEG_ROOM = 1.2


def mission_of(route: Route, passage: Passage, name: str) -> dict[str, Any]:
    """Return the tables of a mission: start, goals and ``[passage]``.

    A band is as wide as the corridor that the route was refined in, and less where land is near. Raises ValueError
    without a way.
    """
    if not route.waypoints:
        raise ValueError("there is no way to sail")
    goals, longest = [], 0.0
    points = route.waypoints
    for k, (a, b) in enumerate(pairwise(points), start=1):
        _, _, length = GEOD.inv(a.lon_deg, a.lat_deg, b.lon_deg, b.lat_deg)
        longest = max(longest, length)
        last = k == len(points) - 1
        goals.append(
            {
                "name": "landfall" if last else f"waypoint {k}",
                "lat": round(b.lat_deg, 7),
                "lon": round(b.lon_deg, 7),
                "radius_m": min(passage.radius_m, 5000.0) if last else _GOAL_M,
                "bandwidth_m": round(_band_m(passage, a.lat_deg, a.lon_deg, b.lat_deg, b.lon_deg, length)),
            }
        )
    start: Mapping[str, Any] = {"lat": round(points[0].lat_deg, 7), "lon": round(points[0].lon_deg, 7)}
    return {
        "name": name,
        "start": dict(start),
        "goal": goals,
        "passage": {"leg_m": float(math.ceil(_LEG_ROOM * longest / 1000.0) * 1000)},
    }


def _band_m(passage: Passage, lat1: float, lon1: float, lat2: float, lon2: float, length_m: float) -> float:
    count = max(2, int(length_m / 1000.0) + 1)
    middle = np.array(GEOD.npts(lon1, lat1, lon2, lat2, count))
    near = float(passage.land.distance_m(passage.frame.xy_from_geo(middle[:, 1], middle[:, 0])).min())
    return max(_LEAST_BAND_M, min(CORRIDOR * passage.frame.length_m / COARSE, _ROOM * near))
