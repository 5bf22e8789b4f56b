"""The chart of a race: how far each place is from what is solid, and about how long it still takes from there."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray

from companion.geo.segments import PolygonIndex
from companion.kernels.heap import pop, push
from companion.kernels.jit import kernel
from sitl.clairvoyant.race import Floats, Goal, Race

ROOM_SHARE = 0.75      # of the course's length: so far about it the chart reaches
ROOM_M = 60.0
MOST_CELLS = 200_000
REACH = 3              # of a move of the time to go, in cells: 32 directions
FAR_S = 1e9


@dataclass(frozen=True, slots=True, kw_only=True)
class Chart:
    """Square cells of ``cell_m`` from ``corner_m`` on, rows northwards; the values are those of the cells' middles.

    Attributes:
        off_m: (rows, columns) distance to what is solid, negative in it.
        to_go_s: (goals, rows, columns) in the mean wind, tacks for nothing, to each goal.
    """

    corner_m: tuple[float, float]
    cell_m: float
    off_m: Floats
    to_go_s: Floats


def chart_of(race: Race, cell_m: float, until_s: float) -> Chart:
    """Return the chart of a race that is sailed by ``until_s``."""
    places = np.array([race.start_en_m, *(g.en_m for g in race.goals)])
    room = ROOM_M + ROOM_SHARE * float(np.hypot(*np.diff(places, axis=0).T).sum())
    low, high = places.min(axis=0) - room, places.max(axis=0) + room
    if not race.solid.is_empty:
        free = shapely.box(*low, *high).difference(race.solid)
        bounds = np.array(free.bounds)
        low, high = np.maximum(low, bounds[:2] - 2.0 * cell_m), np.minimum(high, bounds[2:] + 2.0 * cell_m)
    size = np.maximum(high - low, cell_m)
    cell_m = max(cell_m, math.sqrt(float(size[0] * size[1]) / MOST_CELLS))
    columns, rows = (math.ceil(float(s) / cell_m) + 1 for s in size)
    east, north = low[0] + (np.arange(columns) + 0.5) * cell_m, low[1] + (np.arange(rows) + 0.5) * cell_m
    middles = np.stack(np.meshgrid(east, north), axis=-1).reshape(-1, 2)
    off = np.full((rows, columns), 1e6)
    if not race.solid.is_empty:
        off = PolygonIndex([race.solid]).distance_m(middles).reshape(rows, columns)
    moves, costs = _moves(race, cell_m, until_s)
    cells = [_cell_of(goal, low, cell_m, off.shape) for goal in race.goals]
    to_go = np.stack([_to_go(off < race.clear_m, moves, costs, cell) for cell in cells])
    return Chart(corner_m=(float(low[0]), float(low[1])), cell_m=cell_m, off_m=off, to_go_s=to_go)


def _cell_of(goal: Goal, low: Floats, cell_m: float, shape: tuple[int, int]) -> int:
    """Return the cell of a goal's middle."""
    column, row = ((np.array(goal.en_m) - low) / cell_m).astype(int).clip(0, (shape[1] - 1, shape[0] - 1)).tolist()
    return int(row * shape[1] + column)


def _moves(race: Race, cell_m: float, until_s: float) -> tuple[NDArray[np.int64], Floats]:
    """Return moves (m, 2) in rows and columns, and what each takes in the mean wind, beating where it must."""
    times = np.arange(0.0, until_s, 1.0)
    twd, tws = race.weather.at(times)
    mean = math.atan2(float(np.sin(twd).mean()), float(np.cos(twd).mean()))
    speed = float(tws.mean())
    angles = np.linspace(race.craft.no_go_half_rad, race.craft.max_twa_rad, 181)
    speeds = race.craft.polar.speeds_mps(angles, speed)
    ends = np.concatenate([np.column_stack([s * speeds * np.sin(angles), speeds * np.cos(angles)]) for s in (1, -1)])
    hull = shapely.convex_hull(shapely.MultiPoint(np.vstack([ends, [[0.0, 0.0]]])))
    moves = [(r, c) for r in range(-REACH, REACH + 1) for c in range(-REACH, REACH + 1) if math.gcd(r, c) == 1]
    costs = []
    for r, c in moves:
        # a move from the goal outwards: she sails it the other way
        course = math.atan2(-c, -r) - mean
        ray = shapely.LineString([(0.0, 0.0), (100.0 * math.sin(course), 100.0 * math.cos(course))])
        costs.append(math.hypot(r, c) * cell_m / max(0.05, float(shapely.length(ray.intersection(hull)))))
    return np.array(moves, dtype=np.int64), np.array(costs)


@kernel
def _to_go(solid: NDArray[np.bool_], moves: NDArray[np.int64], costs: Floats, goal: int) -> Floats:
    """Return the time to go from each cell (Dijkstra from the goal); what is solid is entered, and not left again."""
    rows, columns = solid.shape
    out = np.full(rows * columns, FAR_S)
    done = np.zeros(rows * columns, dtype=np.bool_)
    out[goal] = 0.0
    keys, items, count = push(np.empty(1024), np.empty(1024, np.int32), 0, 0.0, goal)
    while count > 0:
        item = items[0]
        count = pop(keys, items, count)
        if done[item]:
            continue
        done[item] = True
        r, c = item // columns, item % columns
        for m in range(moves.shape[0]):
            rr, cc = r + moves[m, 0], c + moves[m, 1]
            if rr < 0 or cc < 0 or rr >= rows or cc >= columns:
                continue
            to = rr * columns + cc
            if done[to] or (solid[r, c] and not solid[rr, cc]):
                continue
            if not solid[r, c] and not solid[rr, cc] and solid[(r + rr) // 2, (c + cc) // 2]:
                continue
            time_s = out[item] + costs[m]
            if time_s < out[to]:
                out[to] = time_s
                keys, items, count = push(keys, items, count, time_s, to)
    return out.reshape(rows, columns)
