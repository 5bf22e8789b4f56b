"""The shortest way round what is solid, on a coarse grid: which side a bay is left on, how far off a place really is.

It is no way to sail: neither wind nor tacks are in it, and a gap narrower than a cell is not seen. Dijkstra's algorithm
over cells and their eight neighbours. What a cell is clear of tells that a step is free; a step that it does not tell
of is looked at.
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Sequence
from functools import lru_cache
from itertools import pairwise

import numpy as np

from companion.skipper.way.geometry import distance_m
from companion.skipper.way.voyage import AreaLike, PointEn

CELLS = 48  # along a side
ROOM_SHARES = (0.5, 2.0)  # of the straight line's length, beyond it on each side: the wider where the first has no way
STEPS = tuple((r, c) for r in (-1, 0, 1) for c in (-1, 0, 1) if (r, c) != (0, 0))


def shortest_way(area: AreaLike, from_en: PointEn, to_en: PointEn, clear_m: float) -> tuple[PointEn, ...] | None:
    """Return the corners of a way that keeps ``clear_m``, both ends in it; None: none was found.

    The ends themselves may be nearer to something, by as much as a cell is wide.
    """
    if area.path_clearance_m([from_en, to_en]) >= clear_m:
        return (from_en, to_en)
    for share in ROOM_SHARES:
        if way := _on_grid(area, from_en, to_en, clear_m, share * distance_m(from_en, to_en)):
            return way
    return None


@lru_cache(maxsize=64)
def way_m(area: AreaLike, from_en: PointEn, to_en: PointEn, clear_m: float) -> float:
    """Return how long the shortest way is [m]; inf: none was found."""
    way = shortest_way(area, from_en, to_en, clear_m)
    return math.inf if way is None else sum(distance_m(a, b) for a, b in pairwise(way))


def _on_grid(
    area: AreaLike, from_en: PointEn, to_en: PointEn, clear_m: float, room_m: float
) -> tuple[PointEn, ...] | None:
    half_m = 0.5 * max(abs(to_en[0] - from_en[0]), abs(to_en[1] - from_en[1])) + room_m
    cell_m = 2.0 * half_m / (CELLS - 1)
    low = (0.5 * (from_en[0] + to_en[0]) - half_m, 0.5 * (from_en[1] + to_en[1]) - half_m)
    rows, columns = np.divmod(np.arange(CELLS * CELLS), CELLS)
    places = np.column_stack([low[0] + columns * cell_m, low[1] + rows * cell_m])
    clearance = area.clearance_m(places)

    def near(en_m: PointEn) -> int | None:
        away = np.hypot(places[:, 0] - en_m[0], places[:, 1] - en_m[1])
        about = np.flatnonzero((away <= 1.5 * cell_m) & (clearance >= clear_m))
        return int(about[np.argmin(away[about])]) if about.size else None

    begin, end = near(from_en), near(to_en)
    if begin is None or end is None:
        return None
    least = np.full(len(places), math.inf)
    before = np.full(len(places), -1, dtype=np.int64)
    least[begin] = 0.0
    queue = [(0.0, begin)]
    while queue:
        so_far, here = heapq.heappop(queue)
        if here == end:
            break
        if so_far > least[here]:
            continue
        row, column = divmod(here, CELLS)
        for down, right in STEPS:
            r, c = row + down, column + right
            if not (0 <= r < CELLS and 0 <= c < CELLS):
                continue
            there, step_m = r * CELLS + c, cell_m * math.hypot(down, right)
            if clearance[there] < clear_m or so_far + step_m >= least[there]:
                continue
            told = clearance[here] + clearance[there] - 2.0 * clear_m >= step_m
            if not told and area.path_clearance_m([places[here], places[there]]) < clear_m:
                continue
            least[there], before[there] = so_far + step_m, here
            heapq.heappush(queue, (so_far + step_m, there))
    if math.isinf(least[end]):
        return None
    cells = [end]
    while cells[-1] != begin:
        cells.append(int(before[cells[-1]]))
    way = [(float(places[n, 0]), float(places[n, 1])) for n in reversed(cells)]
    return (from_en, *_pulled_tight(area, way, clear_m), to_en)


def _pulled_tight(area: AreaLike, way: Sequence[PointEn], clear_m: float) -> list[PointEn]:
    """Return a way without the corners that a straight line makes good: steps of a grid go eight ways only."""
    out, here = [way[0]], 0
    while here < len(way) - 1:
        here = next(
            there
            for there in range(len(way) - 1, here, -1)
            if there == here + 1 or area.path_clearance_m([way[here], way[there]]) >= clear_m
        )
        out.append(way[here])
    return out
