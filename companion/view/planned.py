"""A route that was found as the file that is drawn of it; ashore only, for the planner's rooms are large."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import shapely
from numpy.typing import NDArray

from companion.geo.distinct import distinct
from companion.passage import Departure, Passage, Route, Sailed, shown
from companion.passage.frame import GEOD
from companion.passage.mission import arrivals_s, mission_of
from companion.passage.told import told_of, told_of_chances
from companion.view.passage import (
    PlaceDeg,
    PlannedEnd,
    PlannedIsochrone,
    PlannedPassage,
    PlannedWaypoint,
    PlannedWeather,
)

Floats = NDArray[np.float64]

_POINTS = 200  # of the route's line, beside its waypoints
_TIMES = 97  # at which it is known where the runs are
_MEMBERS = 64
_MET = 24  # places beside the waypoints where wind and current are told
_LINES = 16  # isochrones
_SIMPLER = 1.0 / 400.0  # of the passage's length, what an isochrone may be off
_ARRIVALS = 400


def planned_of(
    passage: Passage,
    route: Route,
    name: str,
    of: Departure | None = None,
    *,
    version: str = "",
    by_utc_s: float | None = None,
    sure: float = 0.9,
) -> PlannedPassage:
    """Return what is drawn of a route that arrives; ``of`` are all its runs. Raises ValueError without a way."""
    sailed = route.sailed
    if not route.waypoints or sailed is None:
        raise ValueError("there is no way to draw")
    departs, weather = route.depart_utc_s, passage.weather
    runs = (sailed,) if of is None or not of.runs else of.runs
    low, high = shown(len({run.member for run in runs}))
    at_s = np.linspace(0.0, max(60.0, *(run.time_s for run in runs)), _TIMES)
    last = max(float(cube.utc_s[-1]) for cube in weather.wind)
    binds = told_of_chances(of, by_utc_s, sure) if of is not None else ()
    return PlannedPassage(
        version=version,
        name=name[:200],
        departs_unix_s=departs,
        run_unix_s=weather.base_utc_s(departs),
        until_unix_s=min(last, weather.climate_from_s),
        climate_unix_s=_finite(weather.climate_from_s),
        members=len({run.member for run in runs}),
        runs=len(runs),
        arrived=sum(run.arrived for run in runs),
        low=round(low, 4),
        high=round(high, 4),
        waypoints=_waypoints(passage, route, runs, (low, 0.5, high)),
        line=_line(route, sailed),
        at_s=tuple(round(float(t), 0) for t in at_s),
        middle_m=_ways(sailed, departs, at_s),
        members_m=tuple(_ways(run, departs, at_s) for run in _plain(runs)) if len(runs) > 1 else (),
        met=_met(passage, route, sailed),
        isochrones=_isochrones(passage, route, sailed),
        arrivals_s=_thinned(sorted(round(run.time_s, 0) for run in runs if run.arrived)),
        ends=_ends(runs),
        said=tuple(line[:300] for line in told_of(route, of)[:3]),
        binds=tuple(line[:300] for line in binds)[:20],
    )


def _lon(lon_deg: float) -> float:
    return round(math.remainder(lon_deg, 360.0), 5)


def _place(lat_deg: float, lon_deg: float) -> PlaceDeg:
    return round(float(lat_deg), 5), _lon(float(lon_deg))


def _ways_of_waypoints(route: Route, sailed: Sailed) -> list[float]:
    points = route.waypoints
    legs = [GEOD.inv(a.lon_deg, a.lat_deg, b.lon_deg, b.lat_deg)[2] for a, b in pairwise(points)]
    return [min(float(way), sailed.length_m) for way in np.cumsum([0.0, *legs])]


def _waypoints(
    passage: Passage, route: Route, runs: Sequence[Sailed], quantiles: tuple[float, float, float]
) -> tuple[PlannedWaypoint, ...]:
    assert route.sailed is not None
    goals = mission_of(route, passage, "")["goal"]
    there = arrivals_s(runs, route.waypoints, quantiles)
    ways = _ways_of_waypoints(route, route.sailed)
    return tuple(
        PlannedWaypoint(
            at=(round(point.lat_deg, 7), round(point.lon_deg, 7)),
            name=str(goals[k - 1]["name"]) if k else "start",
            band_m=float(goals[k - 1]["bandwidth_m"]) if k else 0.0,
            way_m=round(ways[k], 0),
            early_s=_finite(there[k][0]),
            middle_s=_finite(there[k][1]),
            late_s=_finite(there[k][2]),
        )
        for k, point in enumerate(route.waypoints)
    )


def _finite(seconds: float) -> float | None:
    return round(seconds, 0) if math.isfinite(seconds) else None


def _line(route: Route, sailed: Sailed) -> tuple[tuple[float, float, float], ...]:
    way, lat, lon = sailed.line.T
    chosen = distinct([*np.linspace(0.0, float(way[-1]), _POINTS), *_ways_of_waypoints(route, sailed)])
    places = (np.interp(chosen, way, lat), np.interp(chosen, way, lon))
    return tuple((round(float(s), 0), *_place(y, x)) for s, y, x in zip(chosen, *places, strict=True))


def _ways(run: Sailed, departs_s: float, at_s: Floats) -> tuple[float | None, ...]:
    """Return how far along a run is at times: None after its end, where it does not arrive."""
    if not len(run.rows):
        return (None,) * len(at_s)
    since = run.rows[:, 0] - departs_s
    ways = np.interp(at_s, since, np.maximum.accumulate(run.rows[:, 1]))
    if run.arrived:
        ways = np.where(at_s >= since[-1], run.length_m, ways)
    return tuple(round(float(s), 0) if run.arrived or t <= since[-1] else None for s, t in zip(ways, at_s, strict=True))


def _plain(runs: Sequence[Sailed]) -> list[Sailed]:
    """Return one run of each member, by her own polar."""
    share = min({run.share for run in runs}, key=lambda share: abs(share - 1.0))
    plain = [run for run in runs if run.share == share]
    return [plain[int(k)] for k in distinct(np.floor(np.linspace(0, len(plain) - 1, min(len(plain), _MEMBERS))))]


def _met(passage: Passage, route: Route, sailed: Sailed) -> tuple[PlannedWeather, ...]:
    """Return wind and current at the waypoints and between them, when the middle run is there."""
    gone = np.maximum.accumulate(sailed.rows[:, 1])
    ways = [way for way in _ways_of_waypoints(route, sailed) if way <= gone[-1]]
    ways = distinct(np.round([*ways, *np.linspace(0.0, gone[-1], _MET)], 0)).tolist()
    at_s = np.interp(ways, gone, sailed.rows[:, 0])
    lat, lon = (np.interp(ways, sailed.line[:, 0], sailed.line[:, k]) for k in (1, 2))
    wind = passage.weather.wind_en_mps(at_s, lat, lon)
    flow = passage.weather.current_en_mps(at_s, lat, lon) if passage.weather.has_current else None
    own = passage.weather.members.index(sailed.member)
    low, high = shown(len(passage.weather.members))
    out = []
    for k, (t, y, x) in enumerate(zip(at_s, lat, lon, strict=True)):
        east, north = wind[own, k]
        speeds = np.sort(np.hypot(wind[:, k, 0], wind[:, k, 1]))
        speeds = speeds[np.isfinite(speeds)]
        if not np.isfinite(east + north) or not len(speeds):
            continue  # what the forecast does not know there is not drawn
        picked = [float(speeds[min(len(speeds) - 1, int(q * len(speeds)))]) for q in (low, high)]
        is_known = flow is not None and bool(np.isfinite(flow[k]).all())
        out.append(
            PlannedWeather(
                at=_place(y, x),
                t_s=round(float(t) - route.depart_utc_s, 0),
                wind_from_deg=round(math.degrees(math.atan2(-east, -north)) % 360.0, 0),
                wind_mps=round(math.hypot(east, north), 1),
                low_mps=round(picked[0], 1),
                high_mps=round(picked[1], 1),
                current_towards_deg=round(math.degrees(math.atan2(*flow[k])) % 360.0, 0)
                if is_known and flow is not None
                else None,
                current_mps=round(math.hypot(*flow[k]), 2) if is_known and flow is not None else None,
            )
        )
    return tuple(out)


def _isochrones(passage: Passage, route: Route, sailed: Sailed) -> tuple[PlannedIsochrone, ...]:
    if route.searched is None:
        return ()
    x, y, arrive = route.searched
    hours = (arrive - route.depart_utc_s) / 3600.0
    every = max(1.0, round(sailed.time_s / 3600.0 / _LINES))
    out = []
    for level in np.arange(every, sailed.time_s / 3600.0 + every, every)[: 2 * _LINES]:
        lines = []
        for line in level_lines(x, y, hours, float(level)):
            fewer = shapely.simplify(shapely.linestrings(line), _SIMPLER * passage.frame.length_m)
            lat, lon = passage.frame.geo_from_xy(shapely.get_coordinates(fewer))
            lines.append(tuple(_place(a, b) for a, b in zip(lat, lon, strict=True)))
        if lines:
            longest = sorted(lines, key=len, reverse=True)[:20]
            out.append(PlannedIsochrone(hours=float(level), lines=tuple(longest)))
    return tuple(out)


def level_lines(x_m: Floats, y_m: Floats, values: Floats, level: float) -> list[Floats]:
    """Return lines (n, 2) along which ``values`` (rows of y, columns of x) are ``level``; none where one is not finite.

    Each cell is two triangles, so that no saddle is in doubt.
    """
    px, py = np.meshgrid(x_m, y_m)
    corners = np.stack([px, py, values], axis=-1)
    a, b, c, d = corners[:-1, :-1], corners[:-1, 1:], corners[1:, :-1], corners[1:, 1:]
    triangles = np.concatenate([np.stack(t, axis=2).reshape(-1, 3, 3) for t in ((a, b, d), (a, d, c))])
    triangles = triangles[np.isfinite(triangles[:, :, 2]).all(axis=1)]
    is_over = triangles[:, :, 2] > level
    triangles, is_over = (of[(is_over.any(axis=1)) & ~is_over.all(axis=1)] for of in (triangles, is_over))
    if not len(triangles):
        return []
    # the corner that is alone on its side of the level comes first: the line crosses both edges at it
    alone = np.argmax(is_over == (is_over.sum(axis=1) == 1)[:, None], axis=1)
    row = np.arange(len(triangles))
    ends = []
    for step in (1, 2):
        p, q = triangles[row, alone], triangles[row, (alone + step) % 3]
        share = ((level - p[:, 2]) / (q[:, 2] - p[:, 2]))[:, None]
        ends.append(np.round(p[:, :2] + share * (q[:, :2] - p[:, :2]), 0))  # whole metres: neighbours meet
    pieces = shapely.linestrings(np.stack(ends, axis=1))
    pieces = pieces[shapely.length(pieces) > 0.0]
    merged = shapely.line_merge(shapely.multilinestrings(pieces))
    return [shapely.get_coordinates(part) for part in shapely.get_parts(merged)]


def _thinned(values: list[float]) -> tuple[float, ...]:
    """Return at most so many of sorted values, of the same quantiles."""
    picked = np.linspace(0, len(values) - 1, min(len(values), _ARRIVALS)).astype(int)
    return tuple(values[k] for k in picked)


def _ends(runs: Sequence[Sailed]) -> tuple[PlannedEnd, ...]:
    """Return where runs end that do not arrive: of each reason the middle one, with how many they are."""
    failed = [run for run in runs if not run.arrived and len(run.rows)]
    counts = Counter(_kind(run) for run in failed)
    out = []
    for kind, count in counts.most_common(20):
        alike = sorted((run for run in failed if _kind(run) == kind), key=lambda run: run.way_m)
        one = alike[len(alike) // 2]
        out.append(PlannedEnd(at=_place(*one.places[-1]), runs=count, why=one.why[:300]))
    return tuple(out)


def _kind(run: Sailed) -> str:
    """Return a reason without its figures."""
    return "".join(c for c in run.why if not c.isdigit() and c != ".")
