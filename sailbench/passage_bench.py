"""Routers on the passages: every route sailed by one integrator in one weather, a row each, and what they come to."""

from __future__ import annotations

import csv
import importlib
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import shapely

from companion.errors import InputError
from companion.messages import GeoPoint
from companion.passage import Outcome, Passage, plan, sail
from sailbench.isochrones import isochrones
from sailbench.passage_set import RADIUS_M, SEASONS, WAYS, Way, coast, departs_utc_s, passage
from sailbench.plan_bench import processor_s

# A passage and its departure [Unix s] go in, latitudes and longitudes from the start come out; None: no way was found.
Router = Callable[[Passage, float], Sequence[tuple[float, float]] | None]
_EVERY_M = 1000.0  # land is looked for so often
_NEAR_M = 3.0 * RADIUS_M  # a route that ends farther from the goal is led there straight


def companion(asked: Passage, depart_utc_s: float) -> Sequence[tuple[float, float]] | None:
    """Return the route of ``companion passage plan``."""
    route = plan(asked, depart_utc_s)
    return None if route.outcome is not Outcome.FOUND else [(p.lat_deg, p.lon_deg) for p in route.waypoints]


def shortest(asked: Passage, depart_utc_s: float) -> Sequence[tuple[float, float]] | None:
    """Return the shortest way by water, whatever blows: the baseline."""
    craft = asked.craft
    even = craft._replace(
        radial=np.full_like(craft.radial, 3.0), max_tws_mps=math.inf, max_wave_m=math.inf, lee_tws_mps=math.inf
    )
    return companion(replace(asked, craft=even), depart_utc_s)


ROUTERS: Mapping[str, Router] = {"companion": companion, "isochrones": isochrones, "shortest": shortest}


def router_named(name: str) -> Router:
    """Return a router by its name, or MODULE:FUNCTION. Raises InputError."""
    if name in ROUTERS:
        return ROUTERS[name]
    module, colon, function = name.partition(":")
    if not colon:
        raise InputError("--routers", name, "there is no such router", f"{', '.join(ROUTERS)}, or MODULE:FUNCTION")
    try:
        found: Router = getattr(importlib.import_module(module), function)
    except (ImportError, AttributeError) as error:
        raise InputError("--routers", name, str(error), "is its folder in PYTHONPATH?") from None
    return found


@dataclass(frozen=True, slots=True, kw_only=True)
class PassageRow:
    """A route as it was sailed: ``outcome`` is arrived, land, limit, unknown (no weather), nothing or error."""

    passage: str
    season: str
    router: str
    outcome: str
    hours: float
    land_km: float
    over_limit_h: float
    strongest_mps: float
    distance_nm: float
    processor_s: float
    why: str

    @property
    def key(self) -> tuple[str, str, str]:
        """What it is of."""
        return self.passage, self.season, self.router


def judged(asked: Passage, depart_utc_s: float, points: Sequence[tuple[float, float]]) -> dict[str, Any]:
    """Return what sailing a route comes to: hours, kilometres of land, hours in more wind than she is to be out in.

    Neither land nor wind stops her: a route that breaks both is told with all of it.
    """
    way = [asked.start, *(GeoPoint(lat_deg=lat, lon_deg=_within(lon)) for lat, lon in points[1:])]
    if _apart_m(asked, way[-1], asked.goal) > 1.0:
        way = [*way[:-1], asked.goal] if _apart_m(asked, way[-1], asked.goal) < _NEAR_M else [*way, asked.goal]
    way = [way[0], *(b for a, b in pairwise(way) if (a.lat_deg, a.lon_deg) != (b.lat_deg, b.lon_deg))]
    limit = asked.craft.max_tws_mps
    bold = asked.craft._replace(max_tws_mps=math.inf)
    [found] = sail(asked.weather, bold, way, depart_utc_s, asked.radius_m, asked.weather.members[:1])
    steps = np.diff(found.rows[:, 0]) / 3600.0 if len(found.rows) > 1 else np.zeros(0)
    over_h = float(steps[found.rows[:-1, 3] > limit].sum()) if len(steps) else 0.0
    land_km = _land_km(found.line)
    outcome = "land" if land_km > 0.0 else "unknown" if not found.arrived else "limit" if over_h > 0.0 else "arrived"
    return {
        "outcome": outcome,
        "hours": found.time_s / 3600.0 if found.arrived else math.inf,
        "land_km": land_km,
        "over_limit_h": over_h,
        "strongest_mps": found.strongest_mps,
        "distance_nm": found.length_m / 1852.0,
        "why": found.why,
    }


def _within(lon_deg: float) -> float:
    return math.remainder(lon_deg, 360.0)


def _apart_m(asked: Passage, a: GeoPoint, b: GeoPoint) -> float:
    xy = asked.frame.xy_from_geo([a.lat_deg, b.lat_deg], [a.lon_deg, b.lon_deg])
    return float(np.hypot(*(xy[1] - xy[0])))


def _land_km(line: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> float:
    """Return how much of a line in (way [m], latitude, longitude [deg]) is over land, by steps of a kilometre."""
    way = np.arange(0.0, line[-1, 0], _EVERY_M)
    lat, lon = (np.interp(way, line[:, 0], column) for column in line.T[1:])
    shape = _solid()
    wet = ~shapely.contains_xy(shape, np.mod(lon + 180.0, 360.0) - 180.0, lat)
    return float((~wet).sum() * _EVERY_M / 1000.0)


_SOLID: list[shapely.MultiPolygon] = []


def _solid() -> shapely.MultiPolygon:
    if not _SOLID:
        _SOLID.append(shapely.multipolygons(list(coast())))
        shapely.prepare(_SOLID[0])
    return _SOLID[0]


def rows(
    routers: Mapping[str, Router],
    *,
    ways: Sequence[Way] = WAYS,
    seasons: Sequence[str] = tuple(SEASONS),
    is_made: Callable[[tuple[str, str, str]], bool] = lambda _: False,
) -> Iterator[PassageRow]:
    """Yield a row for each passage, season and router that is not made yet; a router's error is its own."""
    for way in ways:
        for season in seasons:
            wanted = {n: r for n, r in routers.items() if not is_made((way.name, season, n))}
            if not wanted:
                continue
            asked, departs_s = passage(way, season), departs_utc_s(season)
            for name, router in wanted.items():
                begun_s = processor_s()
                points, why = None, ""
                try:
                    points = router(asked, departs_s)
                except Exception as error:  # whose router it is must not end the others'
                    why = f"{type(error).__name__}: {error}"[:120].replace("\n", " ")
                took_s = processor_s() - begun_s
                told: dict[str, Any] = {
                    "outcome": "error" if why else "nothing",
                    "hours": math.inf,
                    "land_km": 0.0,
                    "over_limit_h": 0.0,
                    "strongest_mps": 0.0,
                    "distance_nm": 0.0,
                    "why": why,
                }
                if points:
                    told = judged(asked, departs_s, points)
                yield PassageRow(passage=way.name, season=season, router=name, processor_s=took_s, **told)


def write(path: Path, made: Iterable[PassageRow]) -> None:
    """Write rows as CSV."""
    names = [f.name for f in fields(PassageRow)]
    with path.open("w", newline="", encoding="utf-8") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(names)
        for row in made:
            out.writerow([_cell(getattr(row, name)) for name in names])


def _cell(value: float | str) -> str:
    return value if isinstance(value, str) else f"{value:.3f}"


def read(path: Path) -> list[PassageRow]:
    """Return the rows of a CSV. Raises InputError."""
    try:
        with path.open(newline="", encoding="utf-8") as file:
            return [_row(cells) for cells in csv.DictReader(file)]
    except (OSError, KeyError, TypeError, ValueError) as error:
        raise InputError(str(path), "", f"holds no rows of passages: {error!r}", "name another --out") from None


def _row(cells: Mapping[str, str]) -> PassageRow:
    values: dict[str, Any] = dict(cells)
    for field in fields(PassageRow):
        values[field.name] = cells[field.name] if field.type == "str" else float(cells[field.name])
    return PassageRow(**values)


HEADS = ("router", "legal", "land", "limit", "no route", "hours to companion's, mean", "worst", "best", "processor s")


def held_out(made: Iterable[PassageRow]) -> list[tuple[str, str]]:
    """Return the passages that no router has a legal route of."""
    held = list(made)
    legal = {(r.passage, r.season) for r in held if r.outcome == "arrived"}
    return sorted({(r.passage, r.season) for r in held} - legal)


def table(made: Iterable[PassageRow]) -> str:
    """Return a line for each router, as a Markdown table; those passages left out that nobody has a legal route of."""
    held = list(made)
    out = held_out(held)
    held = [r for r in held if (r.passage, r.season) not in out]
    ours = {(r.passage, r.season): r.hours for r in held if r.router == "companion" and r.outcome == "arrived"}
    lines = ["| " + " | ".join(HEADS) + " |", "|---" * len(HEADS) + "|"]
    for name in dict.fromkeys(r.router for r in held):
        mine = [r for r in held if r.router == name]
        # A route over land or through too much wind is no shorter way, and is not held against one that keeps off.
        legal = [r for r in mine if r.outcome == "arrived"]
        shares = [100.0 * (r.hours / ours[r.passage, r.season] - 1.0) for r in legal if (r.passage, r.season) in ours]
        cells = [
            name,
            f"{len(legal)} of {len(mine)}",
            str(sum(r.land_km > 0.0 for r in mine)),
            str(sum(r.over_limit_h > 0.0 for r in mine)),
            str(sum(not math.isfinite(r.hours) and r.land_km == 0.0 for r in mine)),
            *(f"{v:+.2f} %" for v in ((np.mean(shares), max(shares), min(shares)) if shares else ())),
        ]
        cells += [""] * (len(HEADS) - 1 - len(cells)) + [f"{sum(r.processor_s for r in mine):.0f}"]
        lines.append("| " + " | ".join(cells) + " |")
    said = ", ".join(f"{p} {s}" for p, s in out)
    return "\n".join(lines) + (f"\n\nheld out, for nobody has a legal route: {said}" if said else "")
