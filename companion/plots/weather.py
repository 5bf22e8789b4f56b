"""The picture of a forecast: the wind as barbs over its area, and the hours of one place with the members' spread."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING

import matplotlib.pyplot as plt
import numpy as np
from numpy.typing import NDArray

from companion.geo import MPS_PER_KNOT
from companion.plots.chart import date_words, legend_above, place_words, save
from companion.weather import Weather, iso

Floats = NDArray[np.float64]

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from companion.messages import GeoPoint

_BARBS = 22  # across the map at the most


def save_weather(weather: Weather, utc_s: float, at: GeoPoint | None, path: Path) -> None:
    """Write the picture; see ``weather_figure``. Raises InputError where it cannot be written."""
    save(weather_figure(weather, utc_s, at), path)


def weather_figure(weather: Weather, utc_s: float, at: GeoPoint | None) -> Figure:
    """Return the wind of a time as barbs (knots, the mean of the members) and, of a place, its hours."""
    figure, axes = plt.subplots(
        1, 1 if at is None else 2, figsize=(9.0 if at is None else 15.0, 7.0), layout="constrained", squeeze=False
    )
    draw_map(axes[0, 0], weather, utc_s)
    if at is not None:
        axes[0, 0].plot(_near(at.lon_deg, axes[0, 0].get_xlim()), at.lat_deg, "o", color="tab:red", zorder=5)
        draw_hours(axes[0, 1], weather, at)
    return figure


def _near(lon_deg: float, limits: tuple[float, float]) -> float:
    return lon_deg + 360.0 * math.ceil((limits[0] - lon_deg) / 360.0)


def draw_map(axes: Axes, weather: Weather, utc_s: float) -> None:
    """Draw speed as colour and barbs in knots; what is not known stays white."""
    cube = weather.wind[-1]
    lat, lon = cube.lat_deg, cube.lon_deg
    y, x = np.meshgrid(lat, lon, indexing="ij")
    with np.errstate(all="ignore"):
        wind = np.ma.masked_invalid(cube.at(np.full(x.shape, utc_s), y, x)).mean(axis=0)
    speed = np.ma.hypot(wind[..., 0], wind[..., 1])
    mesh = axes.pcolormesh(lon, lat, speed, shading="nearest", cmap="viridis", vmin=0.0, vmax=max(10.0, speed.max()))
    axes.figure.colorbar(mesh, ax=axes, label="wind of 10 m [m/s]", shrink=0.8)
    sy, sx = max(1, lat.size // _BARBS), max(1, lon.size // _BARBS)
    part = (slice(sy // 2, None, sy), slice(sx // 2, None, sx))
    east, north = (wind[..., k][part] / MPS_PER_KNOT for k in (0, 1))
    draw_barbs(axes, x[part], y[part], (east, north), length=5.5, lw=0.7, color="w")
    axes.set_aspect(1.0 / max(0.1, math.cos(math.radians(float(np.mean(lat))))))
    axes.set_xlabel("longitude [deg]")
    axes.set_ylabel("latitude [deg]")
    many = f", mean of {len(cube.members)} members" if len(cube.members) > 1 else ""
    axes.set_title(f"{date_words(iso(utc_s))}{many}; barbs in knots", fontsize=10)


def draw_barbs(
    axes: Axes,
    lon_deg: Floats,
    lat_deg: Floats,
    wind_kn: tuple[Floats, Floats],
    *,
    length: float,
    lw: float,
    color: str,
    zorder: float = 1.0,
) -> None:
    """Draw winds, east and north in knots, at places; the feathers are on the other side south of the equator."""
    for south in (False, True):
        rows = (lat_deg < 0.0) == south
        if rows.any():
            east, north = (part[rows] for part in wind_kn)
            axes.barbs(
                lon_deg[rows],
                lat_deg[rows],
                east,
                north,
                length=length,
                lw=lw,
                flip_barb=south,
                color=color,
                zorder=zorder,
            )


def draw_hours(axes: Axes, weather: Weather, at: GeoPoint) -> None:
    """Draw wind and gust of a place over the hours: the mean, the middle eight tenths of the members, all of them."""
    for name, cubes, colour in (("wind", weather.wind, "tab:blue"), ("gust", weather.gust, "tab:orange")):
        here = [c for c in cubes if c.covers(at.lat_deg, at.lon_deg)]
        if not here:
            continue
        utc = np.unique(np.concatenate([c.utc_s for c in here]))
        if name == "wind":
            wind = weather.wind_en_mps(utc, at.lat_deg, at.lon_deg)
            speed = np.hypot(wind[..., 0], wind[..., 1])
        else:
            speed = weather.gust_mps(utc, at.lat_deg, at.lon_deg)
        hours = (utc - utc[0]) / 3600.0
        known = np.ma.masked_invalid(speed)
        axes.plot(hours, known.mean(axis=0), color=colour, label=name)
        if speed.shape[0] > 1:
            low, high = np.nanquantile(speed, (0.1, 0.9), axis=0)
            axes.fill_between(hours, low, high, color=colour, alpha=0.25, label=f"{name}, 80 % of members")
            axes.plot(hours, speed.T, color=colour, lw=0.4, alpha=0.4)
        axes.set_xlabel(f"hours from {iso(utc[0])}")
    axes.set_ylabel("m/s")
    axes.set_ylim(bottom=0.0)
    axes.grid(alpha=0.3)
    legend_above(axes)
    axes.set_title(place_words(at.lat_deg, math.remainder(at.lon_deg, 360.0)), fontsize=10, loc="right")
