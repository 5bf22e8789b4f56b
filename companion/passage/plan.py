"""A passage planned: the fastest way through a forecast, refined, made a few waypoints, judged by replay."""

from __future__ import annotations

import enum
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from companion.messages import GeoPoint
from companion.passage.energy import Energy, within
from companion.passage.frame import GEOD, Floats, PassageFrame, up_of
from companion.passage.kernels import SLACK, STENCIL, Craft, Waters, arrivals, labels
from companion.passage.land import Land
from companion.passage.replay import Sailed, sail
from companion.weather import Weather

COARSE = 120  # nodes from start to goal
FINER = 4  # times, in the corridor
CORRIDOR = 3.0  # coarse nodes to each side
ROOM = 0.45  # of the length, to each side and beyond the ends half of it: the first search
_LEAST_ROOM_M = 15_000.0
_MOST_WIDENINGS = 2
_MOST_SIDE_M, _MOST_ROUND_M = 8.0e6, 3.6e7  # 72 and 324 degrees
_STEPS_AN_EDGE = 2
WITHIN = 0.98  # of the limits, what is planned through: between the grid's nodes there is a little more


class Outcome(enum.Enum):
    """How a search for a way ended."""

    FOUND = "found"
    NO_WATER = "no way by water leads there"
    NO_WEATHER = "the forecast ends before she is there, or does not reach so far"
    TOO_MUCH = "every way leads through more wind or sea, or nearer to a lee shore, than she is to be out in"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Passage:
    """What is asked: from where, to where, when, with which boat, in which water and weather.

    A shore is near within ``lee_shore_m``; with ``energy`` a run ends where the battery is down to its reserve.
    """

    start: GeoPoint
    goal: GeoPoint
    radius_m: float
    craft: Craft
    weather: Weather
    land: Land
    frame: PassageFrame
    lee_shore_m: float = 0.0
    energy: Energy | None = None

    def sail(
        self,
        waypoints: Sequence[GeoPoint],
        depart_utc_s: float,
        members: Sequence[int],
        shares: Sequence[float] = (1.0,),
    ) -> list[Sailed]:
        """Return a route sailed in each member and share of her speeds."""
        shore = self.shore_en if self.lee_shore_m > 0.0 else None
        runs = sail(self.weather, self.craft, waypoints, depart_utc_s, self.radius_m, members, shares, shore)
        energy = self.energy
        return runs if energy is None else [within(energy, run) for run in runs]

    def shore_en(self, lat_deg: Floats, lon_deg: Floats) -> Floats:
        """Return (n, 2), east and north: the direction to land nearer than ``lee_shore_m``, zero where none is."""
        towards = self.land.towards(self.frame.xy_from_geo(lat_deg, lon_deg), self.lee_shore_m)
        east, north = (
            self.frame.turned(np.full(lat_deg.size, e), np.full(lat_deg.size, n), lat_deg, lon_deg)
            for e, n in ((1.0, 0.0), (0.0, 1.0))
        )
        return np.stack([towards[:, 0] * v[0] + towards[:, 1] * v[1] for v in (east, north)], axis=-1)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Route:
    """What was found for one departure and member: places, the replay that judges it, the bound below every way.

    ``waypoints`` begin at the start; empty without a way. ``searched`` are the search's (x, y, arrivals [Unix s]).
    """

    outcome: Outcome
    depart_utc_s: float
    waypoints: tuple[GeoPoint, ...] = ()
    sailed: Sailed | None = None
    bound_s: float = 0.0
    searched: tuple[Floats, Floats, Floats] | None = None

    @property
    def time_s(self) -> float:
        """How long it takes by the replay [s]; inf without a way."""
        return self.sailed.time_s if self.sailed is not None and self.sailed.arrived else math.inf


def widest_rooms_m(length_m: float) -> tuple[float, float]:
    """Return how far the widest search looks to each side of the way, and beyond its ends [m]."""
    return _rooms(length_m, max(ROOM * length_m, _LEAST_ROOM_M) * 2.0**_MOST_WIDENINGS)


def _rooms(length_m: float, room_m: float) -> tuple[float, float]:
    """Return the room to each side and beyond the ends [m]: less than to the frame's poles, and than all round."""
    return min(room_m, _MOST_SIDE_M), min(0.5 * room_m, max(0.0, 0.5 * (_MOST_ROUND_M - length_m)))


def waters_of(
    passage: Passage,
    x_m: Floats,
    y_m: Floats,
    member: int,
    from_s: float,
    to_s: float,
    mask: NDArray[np.bool_] | None = None,
) -> Waters:
    """Return a member's wind and stream on a grid of the frame; the grid is even and its step the same in x and y."""
    grid = np.stack(np.meshgrid(x_m, y_m), axis=-1)
    lat, lon = passage.frame.geo_from_xy(grid)
    times = times_of(passage.weather, from_s, to_s)
    shape = (times.size, y_m.size, x_m.size, 2)
    wind = np.full(shape, np.nan, dtype=np.float32)
    stream = np.full(shape if passage.weather.has_current else (1, 1, 1, 2), np.nan, dtype=np.float32)
    heights = np.full(shape[:3] if passage.weather.waves else (1, 1, 1), np.nan, dtype=np.float32)
    here = np.ones(lat.shape, dtype=bool) if mask is None else mask
    row = passage.weather.members.index(member)
    blows = passage.weather.only(member).wind_over(times, lat[here], lon[here])[0]
    along, aside = (  # of a wind to the east
        part.astype(np.float32)
        for part in passage.frame.turned(np.ones(lat[here].size), np.zeros(lat[here].size), lat[here], lon[here])
    )
    wind[:, here, 0] = blows[..., 0] * along - blows[..., 1] * aside
    wind[:, here, 1] = blows[..., 1] * along + blows[..., 0] * aside
    for k, t in enumerate(times):
        if passage.weather.has_current:
            flows = passage.weather.current_en_mps(t, lat[here], lon[here])
            stream[k][here] = np.stack(passage.frame.turned(flows[:, 0], flows[:, 1], lat[here], lon[here]), axis=-1)
        if passage.weather.waves:
            heights[k][here] = passage.weather.waves_m(t, lat[here], lon[here])[row]
    shore = np.zeros((y_m.size, x_m.size, 2) if passage.lee_shore_m > 0.0 else (1, 1, 2), dtype=np.float32)
    if passage.lee_shore_m > 0.0:
        shore[here] = passage.land.towards(grid[here], passage.lee_shore_m)
    return Waters(
        t_s=times,
        wind=wind,
        stream=stream,
        has_stream=passage.weather.has_current,
        waves=heights,
        has_waves=bool(passage.weather.waves),
        shore=shore,
        has_shore=passage.lee_shore_m > 0.0,
        up=up_of(lat, lon),
        first_x_m=float(x_m[0]),
        first_y_m=float(y_m[0]),
        step_m=float(x_m[1] - x_m[0]),
        radius_m=passage.frame.radius_m,
    )


def times_of(weather: Weather, from_s: float, to_s: float) -> Floats:
    """Return the times of wind and current between two, with both ends where the wind reaches so far."""
    first = min(float(cube.utc_s[0]) for cube in weather.wind)
    last = max(float(cube.utc_s[-1]) for cube in weather.wind)
    begin, end = max(from_s, first), min(to_s, last)
    return np.unique(np.concatenate([[begin, end], weather.times_between(begin, end)]))


def plan(passage: Passage, depart_utc_s: float, member: int | None = None, *, nodes: int = COARSE) -> Route:
    """Return the fastest way for a departure in one member (the first), by so many nodes from start to goal."""
    member = passage.weather.members[0] if member is None else member
    bold = passage.craft
    asked = replace(passage, weather=passage.weather.only(member))
    careful = bold._replace(
        max_tws_mps=WITHIN * bold.max_tws_mps,
        max_wave_m=WITHIN * bold.max_wave_m,
        lee_tws_mps=WITHIN * bold.lee_tws_mps,
    )
    passage = replace(asked, craft=careful)
    frame, length_m = passage.frame, passage.frame.length_m
    step_m = length_m / nodes
    last_s = max(float(cube.utc_s[-1]) for cube in passage.weather.wind)
    room_m = max(ROOM * length_m, _LEAST_ROOM_M)
    for widening in range(_MOST_WIDENINGS + 1):
        x_m, y_m = _axes(length_m, step_m, room_m)
        waters = waters_of(passage, x_m, y_m, member, depart_utc_s, last_s)
        found = _search(passage, waters, x_m, y_m, depart_utc_s, None)
        if found.path is None:
            if widening < _MOST_WIDENINGS and found.outcome is not Outcome.NO_WEATHER:
                room_m *= 2.0
                continue
            return Route(outcome=found.outcome, depart_utc_s=depart_utc_s)
        edge_m = 2.0 * step_m
        if widening == _MOST_WIDENINGS or not (
            (found.path[:, 1] > y_m[-1] - edge_m).any()
            or (found.path[:, 1] < y_m[0] + edge_m).any()
            or (found.path[:, 0] > x_m[-1] - edge_m).any()
            or (found.path[:, 0] < x_m[0] + edge_m).any()
        ):
            break
        room_m *= 2.0
    assert found.path is not None
    coarse, path = found, found.path
    fine_m = step_m / FINER
    low, high = path.min(axis=0) - (CORRIDOR + 1) * step_m, path.max(axis=0) + (CORRIDOR + 1) * step_m
    fx = fine_m * np.arange(math.floor(low[0] / fine_m), math.ceil(high[0] / fine_m) + 1)
    fy = fine_m * np.arange(math.floor(low[1] / fine_m), math.ceil(high[1] / fine_m) + 1)
    mask = _corridor(fx, fy, path, CORRIDOR * step_m)
    arrive_s = float(found.arrive_s)
    wide = mask | _grown(mask)
    fine_waters = waters_of(passage, fx, fy, member, depart_utc_s, min(last_s, arrive_s + 6 * 3600.0), wide)
    refined = _search(passage, fine_waters, fx, fy, depart_utc_s, mask)
    if refined.path is not None and refined.arrive_s < arrive_s:
        path = refined.path
    points = _straightened(passage, fine_waters, path, depart_utc_s, _step_s(fine_m))
    lat, lon = frame.geo_from_xy(points)
    waypoints = (
        passage.start,
        *(GeoPoint(lat_deg=float(a), lon_deg=float(o)) for a, o in zip(lat[1:-1], lon[1:-1], strict=True)),
        passage.goal,
    )
    sailed = asked.sail(waypoints, depart_utc_s, (member,))[0]
    ends = _ends(passage, x_m, y_m)
    bound = SLACK * _least_left(waters, passage.craft, coarse.table, ends, depart_utc_s, sailed.time_s)
    return Route(
        outcome=Outcome.FOUND,
        depart_utc_s=depart_utc_s,
        waypoints=waypoints,
        sailed=sailed,
        bound_s=min(bound * (1.0 - passage.radius_m / length_m), sailed.time_s),
        searched=(x_m, y_m, coarse.table),
    )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Found:
    outcome: Outcome
    path: Floats | None
    arrive_s: float
    table: Floats


def _axes(length_m: float, step_m: float, room_m: float) -> tuple[Floats, Floats]:
    side, ends = (math.ceil(room / step_m) for room in _rooms(length_m, room_m))
    count = round(length_m / step_m)
    return step_m * np.arange(-ends, count + ends + 1.0), step_m * np.arange(-side, side + 1.0)


def _ends(passage: Passage, x_m: Floats, y_m: Floats) -> tuple[int, int]:
    """Return the nodes of start and goal."""
    row = int(np.argmin(np.abs(y_m))) * x_m.size
    return row + int(np.argmin(np.abs(x_m))), row + int(np.argmin(np.abs(x_m - passage.frame.length_m)))


def _step_s(step_m: float) -> float:
    """Return the longest step of time that an edge of the grid is crossed by [s]."""
    return min(7200.0, max(300.0, step_m / 2.0 / _STEPS_AN_EDGE))


def _search(
    passage: Passage, waters: Waters, x_m: Floats, y_m: Floats, depart_s: float, mask: NDArray[np.bool_] | None
) -> _Found:
    blocked = passage.land.blocked(x_m, y_m)
    ny, nx = y_m.size, x_m.size
    start, goal = _ends(passage, x_m, y_m)
    allowed = np.ones(ny * nx, dtype=np.bool_) if mask is None else mask.ravel()
    step_s = _step_s(waters.step_m)
    arrive, before, unknown, strong = labels(
        waters, passage.craft, allowed, blocked, start, goal, depart_s, step_s, np.empty(0), 0.0
    )
    table = arrive.reshape(ny, nx)
    if not math.isfinite(arrive[goal]):
        if not _is_joined(blocked, allowed, nx, start, goal):
            outcome = Outcome.NO_WATER
        else:
            outcome = Outcome.TOO_MUCH if strong and not unknown else Outcome.NO_WEATHER
        return _Found(outcome=outcome, path=None, arrive_s=math.inf, table=table)
    nodes = [goal]
    while nodes[-1] != start:
        nodes.append(int(before[nodes[-1]]))
    path = np.array([(x_m[n % nx], y_m[n // nx]) for n in nodes[::-1]])
    return _Found(outcome=Outcome.FOUND, path=path, arrive_s=float(arrive[goal]), table=table)


def _least_left(
    waters: Waters, craft: Craft, arrive_s: Floats, ends: tuple[int, int], depart_s: float, found_s: float
) -> float:
    """Return the least time from start to goal [s] that the grid shows, backwards from the goal. Land is left out."""
    start, goal = ends
    earliest = arrive_s.ravel()
    allowed, blocked = np.ones(earliest.size, dtype=np.bool_), np.zeros(earliest.size, dtype=np.uint64)
    left, *_ = labels(waters, craft, allowed, blocked, goal, start, depart_s, 0.0, earliest, found_s)
    return float(left[start])


def _is_joined(blocked: NDArray[np.uint64], allowed: NDArray[np.bool_], columns: int, start: int, goal: int) -> bool:
    """Return whether water leads from start to goal at all."""
    seen = np.zeros(blocked.size, dtype=bool)
    seen[start] = True
    front = np.array([start])
    while front.size and not seen[goal]:
        reached = []
        for d, (i, j) in enumerate(STENCIL.tolist()):
            open_way = front[((blocked[front] >> np.uint64(d)) & np.uint64(1)) == 0]
            column, row = open_way % columns + i, open_way // columns + j
            inside = (column >= 0) & (column < columns) & (row >= 0) & (row < blocked.size // columns)
            reached.append((row * columns + column)[inside])
        front = np.unique(np.concatenate(reached))
        front = front[~seen[front] & allowed[front]]
        seen[front] = True
    return bool(seen[goal])


def _corridor(x_m: Floats, y_m: Floats, path: Floats, half_m: float) -> NDArray[np.bool_]:
    """Return (y, x) which nodes are within ``half_m`` of a path."""
    import shapely

    grid = np.stack(np.meshgrid(x_m, y_m), axis=-1).reshape(-1, 2)
    line = shapely.linestrings(path)
    shapely.prepare(line)
    return np.asarray(shapely.dwithin(line, shapely.points(grid), half_m)).reshape(y_m.size, x_m.size)


def _grown(mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return the mask and the nodes beside it, whose wind its edges are interpolated from."""
    out = mask.copy()
    out[1:] |= mask[:-1]
    out[:-1] |= mask[1:]
    out[:, 1:] |= out[:, :-1].copy()
    out[:, :-1] |= out[:, 1:].copy()
    return out


def _straightened(passage: Passage, waters: Waters, path: Floats, depart_s: float, step_s: float) -> Floats:
    """Return fewer points that are reached no later: left out where they can be, moved across the way where it pays."""
    points = path
    when = arrivals(waters, passage.craft, points, depart_s, step_s)
    if not math.isfinite(when[-1]):
        return points  # between the finer nodes she cannot sail it: against what would another be no later
    reach_m = 4.0 * waters.step_m
    for sweep in range(10):
        for leave_out in (True, False):
            i = 1
            while i < len(points) - 1:
                # Who is at the next point no later is nowhere later: the tries need not be sailed to the end.
                least = (1e-5 if leave_out else -1e-7) * (when[-1] - depart_s)
                before, after = points[i - 1 : i], points[i + 1 : i + 2]
                for middle in (points[:0],) if leave_out else _moved(points, i, reach_m):
                    around = np.concatenate([before, middle, after])
                    there = arrivals(waters, passage.craft, around, when[i - 1], step_s)[-1]
                    if there > when[i + 1] + least or not passage.land.is_free(_bent(passage.frame, around)):
                        continue
                    tried = np.concatenate([points[:i], middle, points[i + 1 :]])
                    then = arrivals(waters, passage.craft, tried, depart_s, step_s)
                    if then[-1] <= when[-1] + max(0.0, least):
                        points, when = tried, then
                        break
                else:
                    i += 1
                    continue
                i += 0 if leave_out else 1
        reach_m *= 0.5
        if sweep > 2 and reach_m < 0.02 * waters.step_m:
            break
    return points


def _moved(points: Floats, i: int, reach_m: float) -> tuple[Floats, Floats]:
    along = points[i + 1] - points[i - 1]
    normal = reach_m * np.array([-along[1], along[0]]) / max(1e-9, float(np.hypot(*along)))
    return points[i : i + 1] + normal, points[i : i + 1] - normal


def is_free(passage: Passage, points: Sequence[GeoPoint]) -> bool:
    """Return whether the shortest ways from point to point keep clear of land, of its margin by half.

    Who is a little off her way cuts the corner that its legs just keep off.
    """
    xy = passage.frame.xy_from_geo([p.lat_deg for p in points], [p.lon_deg for p in points])
    return passage.land.narrowed().is_free(_bent(passage.frame, xy))


def _bent(frame: PassageFrame, points: Floats) -> Floats:
    """Return the shortest ways between points in the frame, as they are sailed: bent, for the frame is a chart."""
    lat, lon = frame.geo_from_xy(points)
    out = [points[:1]]
    for k in range(len(points) - 1):
        count = max(1, int(np.hypot(*(points[k + 1] - points[k])) / 5000.0))
        if count > 1:
            middle = np.array(GEOD.npts(lon[k], lat[k], lon[k + 1], lat[k + 1], count - 1))
            out.append(frame.xy_from_geo(middle[:, 1], middle[:, 0]))
        out.append(points[k + 1 : k + 2])
    return np.concatenate(out)
