"""The picture of a passage: route, land, isochrones of the search, the wind as she meets it; below, its hours."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import matplotlib.pyplot as plt
import numpy as np
import shapely

from companion.geo import MPS_PER_KNOT
from companion.passage import Departure, Passage, Route, shown
from companion.passage.mission import mission_of
from companion.plots.chart import legend_above, save
from companion.plots.weather import draw_barbs
from companion.weather import iso
from companion.words import counted

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_BARBS = 28
_LINES = 16


def save_passage(passage: Passage, route: Route, name: str, path: Path, of: Departure | None = None) -> None:
    """Write the picture; see ``passage_figure``. Raises InputError where it cannot be written."""
    save(passage_figure(passage, route, name, of), path)


def passage_figure(passage: Passage, route: Route, name: str, of: Departure | None = None) -> Figure:
    """Return a route that was found, drawn in longitudes that run on over the date line; ``of`` are all its runs."""
    several = of is not None and len(of.runs) > 1
    figure = plt.figure(figsize=(11.0, 13.0 if several else 11.0), layout="constrained")
    chart, hours, *more = figure.subplots(3 if several else 2, 1, height_ratios=(3.0, 1.0, 0.6)[: 3 if several else 2])
    _draw_chart(chart, passage, route)
    _draw_hours(hours, passage, route)
    if of is not None and several:
        _draw_arrivals(more[0], of)
    sailed = route.sailed
    assert sailed is not None
    bound = f"no way under about {route.bound_s / 3600.0:.1f} h"
    if of is not None and of.members > 1:  # the bound is of that member's forecast alone
        bound = f"so in member {sailed.member}, of {of.members} the middle one"
    figure.suptitle(
        f"{name}: {iso(route.depart_utc_s)} to {iso(route.depart_utc_s + sailed.time_s)}, "
        f"{sailed.time_s / 3600.0:.1f} h; {bound}"
    )
    return figure


def save_departures(departures: Sequence[Departure], by_utc_s: float | None, name: str, path: Path) -> None:
    """Write the picture of departures compared; see ``departures_figure``. Raises InputError."""
    save(departures_figure(departures, by_utc_s, name), path)


def departures_figure(departures: Sequence[Departure], by_utc_s: float | None, name: str) -> Figure:
    """Return the hours under way of each departure, and the chances of arriving, too much wind, a landfall by night."""
    figure, (hours, chances) = plt.subplots(2, 1, figsize=(10.0, 8.0), sharex=True, layout="constrained")
    by = math.inf if by_utc_s is None else by_utc_s
    count = max((d.members for d in departures), default=0)
    least, most = shown(max(1, count))
    since = np.array([(d.utc_s - departures[0].utc_s) / 3600.0 for d in departures])
    low, middle, high = (np.array([d.hours(q) for d in departures]) for q in (least, 0.5, most))
    hours.vlines(since, low, np.where(np.isfinite(high), high, low), color="tab:blue", lw=5.0, alpha=0.3,
                 label=f"{10.0 * (most - least):.0f} in ten of all runs")  # fmt: skip
    hours.plot(since, np.where(np.isfinite(middle), middle, np.nan), "o-", color="tab:blue", label="the middle")
    hours.set_ylabel("hours under way")
    hours.set_ylim(bottom=0.0)
    for words, of in (("arrives" if by_utc_s is None else f"arrives by {iso(by)}", [d.chance(by) for d in departures]),
                      ("too much wind", [d.chance_of_too_much() for d in departures]),
                      ("arrives by night", [d.chance_of_night() for d in departures])):  # fmt: skip
        chances.plot(since, 100.0 * np.array(of), "o-", label=words)
    chances.set_ylabel("of all runs [%]")
    chances.set_ylim(-3.0, 103.0)
    chances.set_xlabel(f"hours of departure after {iso(departures[0].utc_s)}")
    for axes in (hours, chances):
        axes.grid(alpha=0.3)
        legend_above(axes)
    figure.suptitle(f"{name}: departures, in {counted(count, 'member')} of the forecast")
    return figure


def _lon(passage: Passage, lon_deg: object) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    first = passage.start.lon_deg
    return np.asarray(first + np.mod(np.asarray(lon_deg, dtype=np.float64) - first + 180.0, 360.0) - 180.0)


def _draw_chart(axes: Axes, passage: Passage, route: Route) -> None:
    sailed = route.sailed
    assert sailed is not None
    lat, lon = sailed.places[:, 0], _lon(passage, sailed.places[:, 1])
    if route.searched is not None:
        x, y, arrive = route.searched
        places = passage.frame.geo_from_xy(np.stack(np.meshgrid(x, y), axis=-1))
        hours = np.ma.masked_invalid((arrive - route.depart_utc_s) / 3600.0)
        every = max(1.0, round(sailed.time_s / 3600.0 / _LINES))
        levels = np.arange(every, sailed.time_s / 3600.0 + every, every)
        axes.contour(_lon(passage, places[1]), places[0], hours, levels=levels, cmap="viridis", linewidths=0.7)
    shape = passage.land.shape
    if not shape.is_empty:
        for part in shapely.get_parts(shape):
            if part.geom_type != "Polygon":
                continue
            there = passage.frame.geo_from_xy(np.asarray(part.exterior.coords))
            axes.fill(_lon(passage, there[1]), there[0], color="0.75", ec="0.4", lw=0.6, zorder=3)
    axes.plot(lon, lat, color="tab:red", lw=2.0, zorder=4, label="route")
    _draw_band(axes, passage, route)
    ends = _lon(passage, [p.lon_deg for p in route.waypoints])
    axes.plot(ends, [p.lat_deg for p in route.waypoints], "o", color="k", ms=4, zorder=5, label="waypoints")
    chosen = np.unique(np.linspace(0, len(lat) - 1, _BARBS).astype(int))
    row = passage.weather.members.index(sailed.member)
    wind = passage.weather.wind_en_mps(sailed.rows[chosen, 0], lat[chosen], lon[chosen])[row] / MPS_PER_KNOT
    there = (wind[:, 0], wind[:, 1])
    draw_barbs(axes, lon[chosen], lat[chosen], there, length=6.0, lw=0.8, color="tab:blue", zorder=6.0)
    if passage.weather.has_current:
        flow = np.nan_to_num(passage.weather.current_en_mps(sailed.rows[chosen, 0], lat[chosen], lon[chosen]))
        axes.quiver(lon[chosen], lat[chosen], flow[:, 0], flow[:, 1], color="tab:green", width=0.002, zorder=6,
                    label=f"current as she passes, up to {np.hypot(*flow.T).max():.1f} m/s")  # fmt: skip
    room = 0.15 * max(np.ptp(lat), np.ptp(lon), 0.2)
    axes.set_xlim(lon.min() - room, lon.max() + room)
    axes.set_ylim(lat.min() - room, lat.max() + room)
    axes.set_aspect(1.0 / max(0.1, math.cos(math.radians(float(lat.mean())))))
    axes.set_xlabel("longitude [deg]")
    axes.set_ylabel("latitude [deg]")
    legend_above(axes)


def _draw_band(axes: Axes, passage: Passage, route: Route) -> None:
    """Draw the band about each leg, as the mission of it has."""
    goals = mission_of(route, passage, "")["goal"]
    label = "band"
    for a, b, goal in zip(route.waypoints[:-1], route.waypoints[1:], goals, strict=True):
        leg = shapely.linestrings(passage.frame.xy_from_geo([a.lat_deg, b.lat_deg], [a.lon_deg, b.lon_deg]))
        ring = shapely.buffer(leg, goal["bandwidth_m"])
        there = passage.frame.geo_from_xy(np.asarray(ring.exterior.coords))
        axes.fill(_lon(passage, there[1]), there[0], color="tab:red", alpha=0.12, lw=0, zorder=2, label=label)
        label = "_"


def _draw_arrivals(axes: Axes, of: Departure) -> None:
    """Draw when the runs of all members and shares of her speeds arrive, and say what keeps the others."""
    there = [run.time_s / 3600.0 for run in of.runs if run.arrived]
    axes.hist(there, bins=min(20, max(4, len(there) // 3)), color="tab:blue", alpha=0.6)
    failed = [run for run in of.runs if not run.arrived]
    binds = f"; {len(failed)} do not: {max(failed, key=lambda run: run.is_too_much).why}" if failed else ""
    axes.set_title(f"{len(there)} of {len(of.runs)} runs arrive{binds}", fontsize=9, loc="right")
    axes.set_xlabel("hours under way")
    axes.set_ylabel("runs")
    axes.grid(alpha=0.3)


def _draw_hours(axes: Axes, passage: Passage, route: Route) -> None:
    """Draw wind and speed on the way, thin the wind that each member has there, with a tick where it arrives."""
    sailed = route.sailed
    assert sailed is not None
    members = passage.weather.members
    if len(members) > 1:
        fan = passage.sail(route.waypoints, route.depart_utc_s, members)
        for run in fan:
            since = (run.rows[:, 0] - route.depart_utc_s) / 3600.0
            axes.plot(since, run.rows[:, 3], color="tab:blue", lw=0.5, alpha=0.5)
            if run.arrived:
                axes.axvline(since[-1], ymax=0.06, color="k", lw=1.0)
        there = sum(run.arrived for run in fan)
        axes.set_title(
            f"thin: the wind in {len(members)} members; ticks: the {there} that arrive", fontsize=9, loc="right"
        )
    hours = (sailed.rows[:, 0] - route.depart_utc_s) / 3600.0
    axes.plot(hours, sailed.rows[:, 3], label="wind")
    axes.plot(hours, sailed.rows[:, 2], label="speed made good")
    axes.fill_between(hours, 0, 1, where=sailed.rows[:, 5] > 0.5, color="0.5", alpha=0.2, lw=0, label="night",
                      transform=axes.get_xaxis_transform())  # fmt: skip
    axes.set_xlabel("hours from departure")
    axes.set_ylabel("m/s")
    axes.set_ylim(bottom=0.0)
    axes.grid(alpha=0.3)
    legend_above(axes)
