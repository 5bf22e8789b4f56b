"""What a problem says of the track: how the autopilot follows legs, and what the track keeps clear of."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import shapely
from numpy.typing import NDArray

from companion.boat.tracking import GuidanceModel
from companion.geo.segments import PolygonIndex


@dataclass(frozen=True, kw_only=True, eq=False)
class Tracking:
    """How a plan is sailed, and the clearance that the predicted track's band keeps (``companion.planner.track``).

    Attributes:
        helm: How the legs are followed.
        floor_m: What hull and band keep clear of everything solid, 0 or more [m].
        reach_m: How far the hull reaches from its place [m].
        solids: What is solid, as it is: the problem's obstacles are grown by a margin.
        limits: What is around the boat, as it is; None: nothing.
        before_en: Where the leg begins that ends at the start; None: it begins there.
        leeway_rad: How far to leeward of its bow the boat goes, in even steps of its |TWA| from 0 to pi; empty: none.
        correlation_s: How long the wind's direction remembers [s].
        is_known: The autopilot's parameters were read; without, the greater of the two stated errors holds everywhere.

    """

    helm: GuidanceModel
    floor_m: float
    reach_m: float = 0.0
    solids: tuple[shapely.Geometry, ...] = ()
    limits: shapely.Geometry | None = None
    before_en: tuple[float, float] | None = None
    leeway_rad: tuple[float, ...] = ()
    correlation_s: float = 60.0
    is_known: bool = True

    @property
    def is_finite(self) -> bool:
        """Whether every number is one, and in range."""
        before = self.before_en or (0.0, 0.0)
        return (
            all(math.isfinite(x) for x in (self.floor_m, self.reach_m, self.correlation_s, *before, *self.leeway_rad))
            and min(self.floor_m, self.reach_m, self.correlation_s, *self.leeway_rad) >= 0.0
        )

    @cached_property
    def tree(self) -> shapely.STRtree:
        """Everything solid, the limits' line included."""
        shapes = [g if g.is_valid else shapely.make_valid(g) for g in self.solids if not g.is_empty]
        if self.limits is not None and not self.limits.is_empty:
            shapes.append(self.limits.boundary)
        return shapely.STRtree(np.asarray(shapes, dtype=object))

    @cached_property
    def _indices(self) -> tuple[PolygonIndex, PolygonIndex]:
        limits = self.limits
        return (
            PolygonIndex([g if g.is_valid else shapely.make_valid(g) for g in self.solids if not g.is_empty]),
            PolygonIndex([] if limits is None or limits.is_empty else [limits]),
        )

    def distance_m(self, places_en: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return each place's distance from everything solid [m], 0 inside; (n, 2) places, inf where there is none.

        What ``tree`` tells, in a ninth of its time: thousands of places are asked for with each plan.
        """
        solids, limits = self._indices
        return np.minimum(np.maximum(solids.distance_m(places_en), 0.0), np.abs(limits.distance_m(places_en)))
