"""A route under way held against a new forecast: kept, unless another one is surer or faster by more than a hysteresis.

A forecast changes a little each time, and so does the best route in it; who follows each of them sails zigzags.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from companion.messages import GeoPoint
from companion.passage.plan import Passage, is_free
from companion.passage.sweep import Departure, departure_of

FASTER = 0.03  # of the time that is left: what another route must gain
SURER = 0.05  # of all runs, at least one member of them


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Again:
    """The ``old`` route and the best ``new`` one in a forecast, and whether it is worth the change (``why``)."""

    old: Departure
    new: Departure
    is_changed: bool
    why: str

    @property
    def chosen(self) -> Departure:
        """The one to sail."""
        return self.new if self.is_changed else self.old


def left_of(passage: Passage, points: Sequence[GeoPoint]) -> tuple[GeoPoint, ...]:
    """Return what is left of a route: from the passage's start to the end of the leg that is nearest, and on."""
    xy = passage.frame.xy_from_geo([p.lat_deg for p in points], [p.lon_deg for p in points])
    legs = shapely.linestrings(np.stack([xy[:-1], xy[1:]], axis=1))
    nearest = int(np.argmin(shapely.distance(legs, shapely.points(0.0, 0.0))[::-1]))  # of equals the last
    return (passage.start, *points[len(legs) - nearest :])


def again(
    passage: Passage,
    points: Sequence[GeoPoint],
    new: Departure,
    shares: Sequence[float],
    *,
    by_utc_s: float,
    sure: float,
    faster: float = FASTER,
) -> Again:
    """Return what becomes of a route's ``points`` in a passage's weather, where ``new`` is the best one there."""
    way = left_of(passage, points)
    if not is_free(passage, way):
        old = Departure(utc_s=new.utc_s, route=new.route, runs=(), why="it leads over land, or closed water, from here")
    else:
        old = departure_of(passage, way, new.utc_s, shares, new.route.bound_s)  # no way at all is faster
    if not new.runs:
        return Again(old=old, new=new, is_changed=False, why=f"there is no other: {new.why}")
    if not old.runs:
        return Again(old=old, new=new, is_changed=True, why=old.why)
    gained = new.chance(by_utc_s) - old.chance(by_utc_s)
    if old.chance(by_utc_s) < sure and gained > max(SURER, 1.0 / new.members) - 1e-9:
        return Again(old=old, new=new, is_changed=True, why=f"it arrives in {100.0 * gained:.0f} % more of all runs")
    if gained < -1e-9 and new.chance(by_utc_s) < sure:
        return Again(old=old, new=new, is_changed=False, why="the other one is less sure")
    share = 1.0 - new.mean_s() / old.mean_s()
    if share > faster:
        return Again(old=old, new=new, is_changed=True, why=f"it is {100.0 * share:.1f} % faster")
    said = f"the other one is {100.0 * share:.1f} % faster, {100.0 * faster:g} % are asked for"
    return Again(old=old, new=new, is_changed=False, why=said if share > 0.0 else "there is no faster one")
