"""The exact test of a leg against everything solid, and its clearance.

The definition is ``Problem.eval_solid``: the union of all obstacles and of what is outside the fence, shrunk by the
slack. To unite a hundred thousand vertices, or thousands of slivers that cross each other, takes longer than to plan
among them, and what is solid about a leg depends only on what is near it: in a large problem only that is united.
"""

from __future__ import annotations

from functools import cached_property, lru_cache

import numpy as np
import shapely
from numpy.typing import NDArray

from companion.planner.problem.parts import TOUCH_M
from companion.planner.problem.value import Problem

LARGE = 1_000
"""Vertices above which the union of everything is not made."""
_REACH_M = 0.05
_CORRIDOR_M = 0.5


class Shore:
    """Everything solid of a problem."""

    def __init__(self, problem: Problem) -> None:
        self._problem = problem
        self.is_large = sum(shapely.get_num_coordinates(g) for g in problem.obstacles) > LARGE
        self._parts = np.asarray(
            [g if g.is_valid else shapely.make_valid(g) for g in problem.obstacles if not g.is_empty], dtype=object)
        self._tree = shapely.STRtree(self._parts)
        self._fence = problem.fence_polygon
        self._line = None if self._fence is None else self._fence.boundary
        for shape in (self._fence, self._line):
            if shape is not None:
                shapely.prepare(shape)

    @cached_property
    def tree(self) -> shapely.STRtree:
        """Everything solid, the fence's line included, without the clearance floor."""
        shapes = list(self._parts)
        if self._problem.fence is not None:
            shapes.append(self._problem.fence.boundary)
        return shapely.STRtree(np.asarray(shapes, dtype=object))

    def hits(self, shape: shapely.Geometry) -> bool:
        """Does a leg or point collide: is it deeper than the slack in an obstacle or outside the fence?"""
        if not self.is_large:
            solid = self._problem.eval_solid
            return not solid.is_empty and bool(solid.intersects(shape))
        floor = self._problem.clearance_floor_m
        near = self._tree.query(shape, predicate="dwithin", distance=floor + _REACH_M)
        is_inside = self._fence is None or (
            bool(self._fence.contains_properly(shape)) and not bool(shapely.dwithin(self._line, shape, _REACH_M)))
        if len(near) == 0 and is_inside:
            return False
        corridor = shape.buffer(_CORRIDOR_M)
        within = shape.buffer(_CORRIDOR_M + floor) if floor > 0.0 else corridor
        pieces = list(shapely.intersection(self._parts[near], within))
        if floor > 0.0:
            pieces = [g.buffer(floor) for g in pieces]
        if not is_inside:
            pieces.append(corridor.difference(self._fence))
        solid = shapely.union_all(pieces).buffer(-TOUCH_M, join_style="mitre", mitre_limit=5.0)
        return bool(solid.intersects(shape))

    def clearances_m(self, lines: NDArray[np.object_]) -> NDArray[np.float64] | None:
        """Return each line's distance to the nearest obstacle or fence line; None where there is neither."""
        nearest = np.full(len(lines), np.inf)
        if len(self._parts):
            (which, _), distance = self._tree.query_nearest(lines, return_distance=True, all_matches=False)
            nearest[which] = np.maximum(0.0, distance - self._problem.clearance_floor_m)
        if self._line is not None and not self._line.is_empty:
            nearest = np.minimum(nearest, shapely.distance(self._line, lines))
        return nearest if len(self._parts) or self._line is not None else None


@lru_cache(maxsize=8)   # by identity; an index of thousands of shapes is made once for a search
def shore_of(problem: Problem) -> Shore:
    """Return the exact test of legs against all that is solid in the problem."""
    return Shore(problem)
