"""The perfect-information bound: the best time that a boat could have made of a wind, had it been known.

Time goes on in steps. From each kept place all angles of its tack are sailed for a step, the heading following the
wind; a tack or gybe takes its whole number of steps and no way. Of two that come into one cell, tack and leg of the
course the one with the less time behind it and to go is kept: who is there later could have been the other and have
waited. Places are never moved to a cell's middle, so what comes out can be sailed exactly; the cells decide only what
is thrown away. A place from which no wind that comes would bring the boat to the goal in time (``rungs``) is left out.

Along any direction n the speed made good is at most the largest of n . v over the angles of the tack that is sailed.
The best sequence of tacks for that alone is a small dynamic programme over time and tack, exact, whatever is done
across n. The goal is reached by T only if for every n the way to it along n is no longer. Where nothing is in the way
these conditions are nearly enough: in a wind that is the same everywhere an optimum has one costate, a constant n.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry.base import BaseGeometry

from companion.boat import Polar
from companion.errors import JobError
from companion.geo.segments import PolygonIndex, enters_disc
from companion.kernels.heap import pop, push
from companion.kernels.jit import kernel

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Weather:
    """A wind that is known, the same everywhere: straight between its readings, held after the last.

    Attributes:
        t_s: (n,) from the start, increasing.
        twd_from_rad: (n,) where it comes from.
        tws_mps: (n,) how fast.
    """

    t_s: Floats
    twd_from_rad: Floats
    tws_mps: Floats

    def at(self, t_s: Floats) -> tuple[Floats, Floats]:
        """Return direction [rad, not wrapped] and speed [m/s]."""
        twd = np.interp(t_s, self.t_s, np.unwrap(self.twd_from_rad))
        return np.asarray(twd), np.asarray(np.interp(t_s, self.t_s, self.tws_mps))


@dataclass(frozen=True, slots=True, kw_only=True)
class RaceBoat:
    """A point that sails by a polar and follows the wind at once; on one tack turning costs nothing.

    Attributes:
        polar: speed by wind angle and strength.
        no_go_half_rad: the boat sails no nearer to the wind.
        max_twa_rad: and no deeper.
        tack_s: so long the boat stands still in each change of side, tack or gybe.
        board_s: least time on a tack from its beginning, that included.
    """

    polar: Polar
    no_go_half_rad: float
    max_twa_rad: float
    tack_s: float
    board_s: float


@dataclass(frozen=True, slots=True, kw_only=True)
class RaceMark:
    """A disc to be reached [m]."""

    en_m: tuple[float, float]
    radius_m: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Race:
    """One start, the goals in their order, and the water between: nothing nearer than ``clear_m`` to ``solid``."""

    craft: RaceBoat
    weather: Weather
    start_en_m: tuple[float, float]
    goals: tuple[RaceMark, ...]
    solid: BaseGeometry
    clear_m: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Best:
    """The best that was found, and what nothing can beat.

    Attributes:
        time_s: of ``track``, which that craft can sail exactly.
        bound_s: no track in this wind is faster, to the steps of time; near ``time_s`` where nothing is in the way.
        coarser_s: the time on the grid of twice the size: what refining still gained.
        track: (n, 4) time from the start [s], east and north [m], 1 on port tack and -1 on starboard.
    """

    time_s: float
    bound_s: float
    coarser_s: float
    track: Floats

    @property
    def tacks(self) -> int:
        """Changes of side, gybes too."""
        return int(np.count_nonzero(np.diff(self.track[:, 3])))


ROOM_SHARE = 0.75  # of the course's length: so far about it the chart reaches
ROOM_M = 60.0
MOST_CELLS = 200_000
REACH = 3  # of a move of the time to go, in cells: 32 directions
FAR_S = 1e9


@dataclass(frozen=True, slots=True, kw_only=True)
class DistanceChart:
    """Square cells of ``cell_m`` from ``corner_m`` on, rows northwards; the values are those of the cells' middles.

    Attributes:
        off_m: (rows, columns) distance to what is solid, negative in it.
        to_go_s: (goals, rows, columns) in the mean wind, tacks for nothing, to each goal.
    """

    corner_m: tuple[float, float]
    cell_m: float
    off_m: Floats
    to_go_s: Floats


def chart_of(race: Race, cell_m: float, until_s: float) -> DistanceChart:
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
    return DistanceChart(corner_m=(float(low[0]), float(low[1])), cell_m=cell_m, off_m=off, to_go_s=to_go)


def _cell_of(goal: RaceMark, low: Floats, cell_m: float, shape: tuple[int, int]) -> int:
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
        # a move from the goal outwards: the boat sails it the other way
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


PARTS = 3  # of a step: in each the heading follows the wind
ANGLE_RAD = math.radians(5.0)  # between the angles that are tried
PORT, STARBOARD = 0, 1


@dataclass(frozen=True, slots=True, kw_only=True)
class Steps:
    """Steps of ``step_s`` seconds.

    Attributes:
        angle_rad: (a,) angles to the wind that are sailed, the least first.
        twd_rad: (count * PARTS,) the wind in the middle of each part.
        speed_mps: (count * PARTS, a).
        tack_s: what a change of side takes of the steps that it begins with.
        board: steps on a tack at the least.
    """

    step_s: float
    angle_rad: Floats
    twd_rad: Floats
    speed_mps: Floats
    tack_s: float
    board: int

    @property
    def count(self) -> int:
        """Number of steps."""
        return len(self.twd_rad) // PARTS


def steps_of(race: Race, step_s: float, until_s: float) -> Steps:
    """Return the steps until ``until_s``, and those of a board that begins then."""
    craft = race.craft
    board = max(1, math.ceil(craft.tack_s / step_s), math.floor(craft.board_s / step_s + 1e-9))
    count = math.ceil(until_s / step_s) + 1 + board
    twd, tws = race.weather.at((np.arange(count * PARTS) + 0.5) * step_s / PARTS)
    low, high = craft.no_go_half_rad, craft.max_twa_rad
    best = craft.polar.best_beat(float(np.mean(tws)), no_go_half_rad=low).twa_rad
    angles = np.unique([*np.linspace(low, high, max(2, 1 + math.ceil((high - low) / ANGLE_RAD - 1e-9))), best])
    speeds = np.stack([craft.polar.speeds_mps(angles, float(w)) for w in tws])
    return Steps(step_s=step_s, angle_rad=angles, twd_rad=twd, speed_mps=speeds, tack_s=craft.tack_s, board=board)


Ints = NDArray[np.int32]

TIE_S = 1e-3  # so much less is not better: in a steady wind everything is equal


@kernel
def _between(table: Floats, corner_e: float, corner_n: float, cell_m: float, e: float, n: float) -> float:
    """Return the value at a place, straight between the middles of the cells about it."""
    rows, columns = table.shape
    x, y = (e - corner_e) / cell_m - 0.5, (n - corner_n) / cell_m - 0.5
    x, y = min(max(x, 0.0), columns - 1.001), min(max(y, 0.0), rows - 1.001)
    c, r = int(x), int(y)
    f, g = x - c, y - r
    low = (1.0 - f) * table[r, c] + f * table[r, c + 1]
    return float((1.0 - g) * low + g * ((1.0 - f) * table[r + 1, c] + f * table[r + 1, c + 1]))


@kernel
def _is_late(e: float, n: float, row: int, j: int, stage: int, goals: Floats, units: Floats, most: Floats) -> bool:
    """Whether a goal that is ahead cannot be reached from here by the last step, whatever is done."""
    for i in range(units.shape[0]):
        for g in range(stage, goals.shape[0]):
            way = units[i, 0] * (goals[g, 0] - e) + units[i, 1] * (goals[g, 1] - n) - goals[g, 2]
            if way > most[row, j, i]:
                return True
    return False


@kernel
def _with_room(places: Floats, about: Ints, count: int) -> tuple[Floats, Ints]:
    """Return both with room for one more."""
    if count == places.shape[0]:
        return np.concatenate((places, np.empty_like(places))), np.concatenate((about, np.empty_like(about)))
    return places, about


@kernel
def march(
    start: Floats,
    goals: Floats,
    twd: Floats,
    speed: Floats,
    angle: Floats,
    step_s: float,
    tack_s: float,
    board: int,
    corner: Floats,
    cell_m: float,
    fine: int,
    off: Floats,
    clear_m: float,
    to_go: Floats,
    units: Floats,
    most: Floats,
    until_s: float,
) -> tuple[float, Floats, Ints, int]:
    """Return (time [s], places (n, 2), (n, 3) of their parent, step and state, the last place).

    ``goals`` (g, 3) are east, north, radius; ``most`` is that of ``rungs.most_m`` until ``until_s``; ``fine`` cells of
    the search make one of the chart. A state is 2 * goals passed + tack. The time is ``until_s`` and the last place -1
    where no track is faster.
    """
    last, parts, legs = most.shape[1] - 1, PARTS, goals.shape[0]
    part_s = step_s / parts
    rows, columns = off.shape[0] * fine, off.shape[1] * fine
    rank = np.full((2 * legs, rows * columns), np.float32(FAR_S))
    owner = np.full((2 * legs, rows * columns), np.int32(-1))
    places, about = np.empty((1 << 16, 2)), np.empty((1 << 16, 4), np.int32)  # ... and the next place of the step
    first = np.full(last + 1, np.int32(-1))
    count, best_s, best = 2, until_s, -1
    for row in range(2):
        places[row, 0], places[row, 1] = start[0], start[1]
        about[row, 0], about[row, 1], about[row, 2], about[row, 3] = -1, 0, row, row - 1
    first[0] = 1
    for j in range(last):
        if j * step_s >= best_s:
            break
        node = first[j]
        while node >= 0:
            here, node = node, about[node, 3]
            state = about[here, 2]
            r = int((places[here, 1] - corner[1]) / cell_m * fine)
            c = int((places[here, 0] - corner[0]) / cell_m * fine)
            if j > 0 and owner[state, r * columns + c] != here:
                continue  # somebody better came into this cell since
            for action in range(angle.shape[0] if j == 0 else 2 * angle.shape[0]):
                a, is_tack = action % angle.shape[0], action >= angle.shape[0]
                into = state ^ 1 if is_tack else state
                side = 1.0 if into % 2 == 0 else -1.0
                e, n = places[here, 0], places[here, 1]
                steps = board if is_tack else 1
                is_over = False
                for q in range(steps * parts):
                    k = j * parts + q
                    sailed_s = part_s
                    if is_tack:
                        sailed_s = min(part_s, max(0.0, (q + 1) * part_s - tack_s))
                    heading, way = twd[k] + side * angle[a], speed[k, a] * sailed_s
                    e1, n1 = e + way * math.sin(heading), n + way * math.cos(heading)
                    if (
                        _between(off, corner[0], corner[1], cell_m, e1, n1) < clear_m
                        or _between(off, corner[0], corner[1], cell_m, 0.5 * (e + e1), 0.5 * (n + n1)) < clear_m
                    ):
                        is_over = True
                        break
                    share = enters_disc(e, n, e1 - e, n1 - n, goals[into // 2])
                    if share <= 1.0:
                        if into // 2 + 1 == legs:
                            time_s = (k + 1) * part_s - (1.0 - share) * sailed_s
                            if time_s < best_s:
                                places, about = _with_room(places, about, count)
                                places[count, 0], places[count, 1] = e + share * (e1 - e), n + share * (n1 - n)
                                about[count, 0], about[count, 1], about[count, 2] = here, j + steps, into
                                best_s, best = time_s, count
                                count += 1
                            is_over = True
                            break
                        into += 2
                    e, n = e1, n1
                now = j + steps
                if is_over or now > last or now * step_s >= best_s:
                    continue
                r, c = math.floor((n - corner[1]) / cell_m * fine), math.floor((e - corner[0]) / cell_m * fine)
                if r < 0 or c < 0 or r >= rows or c >= columns:
                    continue
                cell = r * columns + c
                order = now * step_s + _between(to_go[into // 2], corner[0], corner[1], cell_m, e, n)
                if order > rank[into, cell] - TIE_S or _is_late(e, n, into % 2, now, into // 2, goals, units, most):
                    continue
                rank[into, cell] = order
                mine = owner[into, cell]
                if mine < 0 or about[mine, 1] != now:
                    places, about = _with_room(places, about, count)
                    mine = np.int32(count)
                    about[mine, 3] = first[now]
                    first[now] = owner[into, cell] = mine
                    count += 1
                places[mine, 0], places[mine, 1] = e, n
                about[mine, 0], about[mine, 1], about[mine, 2] = here, now, into
    return best_s, places[:count], about[:count], best


DIRECTIONS = 72


def directions() -> Floats:
    """Return (n, 2) unit vectors all round."""
    angles = np.arange(DIRECTIONS) * 2.0 * math.pi / DIRECTIONS
    return np.column_stack([np.sin(angles), np.cos(angles)])


def made_good_m(steps: Steps, units: Floats) -> Floats:
    """Return (2, count * PARTS, n): the most that a part of a step makes good along each direction, by tack."""
    out = np.zeros((2, len(steps.twd_rad), len(units)))
    for row in (PORT, STARBOARD):
        heading = steps.twd_rad[:, None] + (1.0 if row == PORT else -1.0) * steps.angle_rad
        east, north = steps.speed_mps * np.sin(heading), steps.speed_mps * np.cos(heading)
        for n, (ue, un) in enumerate(units):
            out[row, :, n] = np.maximum(0.0, (ue * east + un * north).max(axis=1))
    return out * (steps.step_s / PARTS)


@kernel
def most_m(gain: Floats, last: int, part_s: float, tack_s: float, board: int) -> Floats:
    """Return (2, last + 1, n): the most that is made good along each direction from a step to step ``last``.

    ``gain`` (2, parts, n) of ``made_good_m``.
    """
    n = gain.shape[2]
    out = np.zeros((2, last + 1, n))
    parts = PARTS
    for j in range(last - 1, -1, -1):
        upto = min(j + board, last)
        for row in range(2):
            for i in range(n):
                on, over = out[row, j + 1, i], out[1 - row, upto, i]
                for q in range(parts):
                    on += gain[row, j * parts + q, i]
                for q in range((upto - j) * parts):
                    share = (q + 1) - tack_s / part_s
                    if share > 0.0:
                        over += min(share, 1.0) * gain[1 - row, j * parts + q, i]
                out[row, j, i] = max(on, over)
    return out


def bound_s(race: Race, steps: Steps, gain: Floats, units: Floats) -> float:
    """Return the time before which nobody has been at all goals; the last step's where that is not enough."""
    ways = np.max(
        [units @ (np.array(goal.en_m) - np.array(race.start_en_m)) - goal.radius_m for goal in race.goals], axis=0
    )

    def most(last: int) -> Floats:
        made: Floats = most_m(gain, last, steps.step_s / PARTS, steps.tack_s, steps.board)[:, 0].max(axis=0)
        return made

    low, high = 0, steps.count - steps.board
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (low, middle) if bool(np.all(most(middle) >= ways)) else (middle, high)
    before, after = most(low), most(high)
    late = ways > before
    if not late.any():
        return low * steps.step_s
    # within the last step: straight, along the direction that takes longest
    share = float(np.max((ways[late] - before[late]) / np.maximum(after[late] - before[late], 1e-9)))
    return (low + min(1.0, share)) * steps.step_s


# Step [s] and cell [m] of the searches, each finer than the one before.
GRIDS = ((3.0, 4.0), (1.5, 4.0), (1.5, 2.0))
CHART_M = 2.0
# The first search asks for so much more than the bound, and for more by the second factor until it finds a track.
FIRST, MORE = 1.03, 1.15


def best(race: Race, until_s: float, grids: tuple[tuple[float, float], ...] = GRIDS) -> Best:
    """Return the best of a race that can be sailed in ``until_s`` [s].

    Raises:
        JobError: no track was found: the way is shut, or takes longer.
    """
    units = directions()
    chart = chart_of(race, CHART_M, until_s)
    by_step = {wanted_s: steps_of(race, wanted_s, until_s) for wanted_s, _ in grids}
    gains = {wanted_s: made_good_m(steps, units) for wanted_s, steps in by_step.items()}
    finest_s = grids[-1][0]
    least_s = bound_s(race, by_step[finest_s], gains[finest_s], units)
    found: list[tuple[float, Floats]] = []
    ask_s = min(until_s, FIRST * least_s)
    for wanted_s, cell_m in grids:
        steps = by_step[wanted_s]
        while True:
            sailed = _search(race, chart, steps, gains[wanted_s], units, cell_m, ask_s)
            if sailed is not None or found or ask_s >= until_s:
                break
            ask_s = min(until_s, MORE * ask_s)
        if sailed is not None:
            ask_s = sailed[0]
        if sailed is not None or found:
            found.append(sailed or found[-1])
    if not found:
        raise JobError(f"no track was found that is at the goal within {until_s:.0f} s")
    return Best(time_s=found[-1][0], bound_s=least_s, coarser_s=found[max(0, len(found) - 2)][0], track=found[-1][1])


def _search(
    race: Race, chart: DistanceChart, steps: Steps, gain: Floats, units: Floats, cell_m: float, until_s: float
) -> tuple[float, Floats] | None:
    """Return time and track, None where nothing is faster than ``until_s``."""
    last = min(steps.count - steps.board, math.ceil(until_s / steps.step_s))
    most = most_m(gain, last, steps.step_s / PARTS, steps.tack_s, steps.board)
    goals = np.array([[*goal.en_m, goal.radius_m] for goal in race.goals])
    time_s, places, about, node = march(
        np.array(race.start_en_m),
        goals,
        steps.twd_rad,
        steps.speed_mps,
        steps.angle_rad,
        steps.step_s,
        steps.tack_s,
        steps.board,
        np.array(chart.corner_m),
        chart.cell_m,
        max(1, round(chart.cell_m / cell_m)),
        chart.off_m,
        race.clear_m,
        chart.to_go_s,
        units,
        most,
        until_s,
    )
    if node < 0:
        return None
    rows: list[tuple[float, float, float, float]] = []
    while node >= 0:
        parent, step, state = (int(x) for x in about[node, :3])
        t_s = time_s if not rows else step * steps.step_s
        rows.append((t_s, *places[node].tolist(), 1.0 if state % 2 == PORT else -1.0))
        node = parent
    return time_s, np.array(rows[::-1])
