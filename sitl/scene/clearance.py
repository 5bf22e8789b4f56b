"""A hull's track held against what is solid: where its outline touched, and how near it came.

The track is looked at between its samples too: the hull's outlines of two of them and all that lies between them.
Only what is near enough to matter is drawn.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry.base import BaseGeometry

from companion.boat import Hull, outline_en_m


@dataclass(frozen=True, slots=True, kw_only=True)
class HullTrack:
    """Where a hull was.

    Attributes:
        en_m: (n, 2) places amidships, east north [m].
        heading_rad: (n,) true headings.
        hull: Its size.

    """

    en_m: NDArray[np.float64]
    heading_rad: NDArray[np.float64]
    hull: Hull

    def entries(self, solid: BaseGeometry) -> list[int]:
        """Return the samples at which the hull came to touch ``solid``, having been clear at the one before."""
        if solid.is_empty or len(self.en_m) == 0:
            return []
        shapely.prepare(solid)
        points_m = shapely.distance(solid, shapely.points(self.en_m))
        step_m = np.concatenate([[0.0], np.hypot(*np.diff(self.en_m, axis=0).T)])
        touches = np.zeros(len(self.en_m), dtype=bool)
        near = np.flatnonzero(points_m <= self.hull.reach_m + step_m)
        if near.size:
            touches[near] = shapely.intersects(solid, self._swept(near))
        return [int(i) for i in np.flatnonzero(touches & ~np.concatenate([[False], touches[:-1]]))]

    def least_m(self, solid: BaseGeometry) -> tuple[float, int]:
        """Return the outline's smallest distance to ``solid`` [m], 0 on contact, and at which sample; inf without."""
        if solid.is_empty or len(self.en_m) == 0:
            return math.inf, 0
        shapely.prepare(solid)
        points_m = np.asarray(shapely.distance(solid, shapely.points(self.en_m)))
        # No outline is nearer than its middle less its reach: the others cannot be the nearest.
        near = np.flatnonzero(points_m <= points_m.min() + 2.0 * self.hull.reach_m)
        outlines_m = np.asarray(shapely.distance(solid, self._outlines(near)))
        best = int(np.argmin(outlines_m))
        touched = self.entries(solid)
        return (0.0, touched[0]) if touched else (float(outlines_m[best]), int(near[best]))

    def _outlines(self, which: NDArray[np.intp]) -> NDArray[np.object_]:
        return np.asarray(shapely.polygons(outline_en_m(self.hull, self.en_m[which], self.heading_rad[which])))

    def _swept(self, which: NDArray[np.intp]) -> NDArray[np.object_]:
        """Return what the hull covered from the sample before each of ``which`` to it."""
        before = np.maximum(which - 1, 0)
        corners = np.concatenate([
            outline_en_m(self.hull, self.en_m[i], self.heading_rad[i])[:, :4] for i in (before, which)], axis=1)
        return np.asarray(shapely.convex_hull(shapely.multipoints(corners)))
