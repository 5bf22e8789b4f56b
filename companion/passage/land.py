"""Land and closed water of a passage, in its frame: how far off it is, and which ways across a grid it closes.

A way is free where two discs that reach to the land from its ends hold it between them (the distance to land changes by
no more than the way); every other one is held against the land itself, so no way steps over an islet between two wet
nodes.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import affinity
from shapely.geometry.base import BaseGeometry

from companion.passage.frame import Floats, PassageFrame
from companion.passage.kernels import STENCIL

_FINE_DEG = 0.05  # a side of a polygon is straight in degrees; in the frame so long a piece of it is, to 5 m


@dataclass(frozen=True, slots=True, eq=False)
class Land:
    """What is solid, with ``margin_m`` about it; ``shape`` in the frame's metres, empty where nothing is."""

    shape: BaseGeometry
    margin_m: float = 0.0

    def narrowed(self) -> Land:
        """Return it with half its margin."""
        return Land(shapely.buffer(self.shape, -0.5 * self.margin_m), 0.5 * self.margin_m)

    def distance_m(self, xy_m: Floats) -> Floats:
        """Return (n,) how far places are from it [m], 0 inside, inf without land."""
        if self.shape.is_empty:
            return np.full(len(xy_m), np.inf)
        return np.asarray(shapely.distance(self.shape, shapely.points(xy_m)), dtype=np.float64)

    def is_free(self, xy_m: Floats) -> bool:
        """Return whether a line of points keeps clear of it."""
        return bool(self.shape.is_empty or not shapely.intersects(self.shape, shapely.linestrings(xy_m)))

    def towards(self, xy_m: Floats, within_m: float) -> Floats:
        """Return (n, 2): the direction to land that is within ``within_m``, zero where none is."""
        out = np.zeros((len(xy_m), 2))
        near = np.flatnonzero(self.distance_m(xy_m) < within_m)
        if near.size:
            ends = shapely.get_coordinates(shapely.shortest_line(shapely.points(xy_m[near]), self.shape)).reshape(
                -1, 2, 2
            )
            way = ends[:, 1] - ends[:, 0]
            out[near] = way / np.maximum(np.hypot(*way.T), 1e-9)[:, None]
        return out

    def blocked(self, x_m: Floats, y_m: Floats) -> NDArray[np.uint64]:
        """Return (y * x,) for each node of a grid a bit for each direction of the stencil that is closed."""
        out = np.zeros(y_m.size * x_m.size, dtype=np.uint64)
        if self.shape.is_empty:
            return out
        grid = np.stack(np.meshgrid(x_m, y_m), axis=-1)
        far = self.distance_m(grid.reshape(-1, 2)).reshape(grid.shape[:2])
        for d, (i, j) in enumerate(STENCIL.tolist()):
            if (i, j) < (0, 0):
                continue  # the way back is closed where the way there is
            a = (slice(max(0, -j), y_m.size - max(0, j)), slice(max(0, -i), x_m.size - max(0, i)))
            b = (slice(max(0, j), y_m.size + min(0, j)), slice(max(0, i), x_m.size + min(0, i)))
            long_m = float(np.hypot(*(grid[1, 1] - grid[0, 0]) * (i, j)))
            near = far[a] + far[b] <= long_m
            lines = shapely.linestrings(np.stack([grid[a][near], grid[b][near]], axis=1))
            closed = np.zeros(near.shape, dtype=bool)
            closed[near] = shapely.intersects(self.shape, lines)
            back = STENCIL.tolist().index([-i, -j])
            table = out.reshape(y_m.size, x_m.size)
            table[a] |= closed.astype(np.uint64) << np.uint64(d)
            table[b] |= closed.astype(np.uint64) << np.uint64(back)
        return out


def land_of(
    frame: PassageFrame, lonlat: Iterable[BaseGeometry], box: tuple[float, float, float, float], margin_m: float
) -> Land:
    """Return the land of polygons (lon, lat) within ``box``: west, south, east, north, above 180 over the date line."""
    window = shapely.box(*box)
    found: list[BaseGeometry] = []
    for polygon in lonlat:
        for turn in (-360.0, 0.0, 360.0):
            here = affinity.translate(polygon, turn, 0.0)
            if not shapely.intersects(window, here):
                continue
            part = shapely.segmentize(shapely.intersection(shapely.make_valid(here), window), _FINE_DEG)
            moved = shapely.transform(part, lambda lonlat: frame.xy_from_geo(lonlat[:, 1], lonlat[:, 0]))
            found.append(shapely.buffer(shapely.make_valid(moved), margin_m) if margin_m > 0.0 else moved)
    shape = shapely.union_all(found) if found else shapely.Polygon()
    shapely.prepare(shape)
    return Land(shape, margin_m)
