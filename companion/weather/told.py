"""A forecast in words: what, where, when, members, holes; and what it says of one place."""

from __future__ import annotations

import math
from itertools import groupby

import numpy as np

from companion.weather.measured import MEMORY_S, Off
from companion.weather.tides import Tides
from companion.weather.weather import Cube, Floats, Weather, iso
from companion.words import counted


def told_of(weather: Weather) -> tuple[str, ...]:
    """Return lines that say what a forecast holds."""
    lines: list[str] = []
    for name, cubes in (
        ("wind of 10 m", weather.wind),
        ("gust", weather.gust),
        ("waves", weather.waves),
        ("current", weather.current),
    ):
        for cube in cubes:
            lines += _told_of_cube(name, cube)
    for tide in weather.tides:
        lines += _told_of_tide(tide)
    if any(tide.what == "stream" for tide in weather.tides) and not all(c.is_tideless for c in weather.current):
        lines.append("where the current is told every few hours the tide is in it, and its stream is not added")
    return (*lines, *weather.notes)


def _told_of_tide(tide: Tides) -> list[str]:
    waves = (
        f"{counted(len(tide.names), 'constituent')}: {' '.join(tide.names[:8])}{' ...' if len(tide.names) > 8 else ''}"
    )
    lat, lon = tide.lat_deg, tide.lon_deg
    south, north = _degrees(lat.min(), "NS"), _degrees(lat.max(), "NS")
    where = f"{south} to {north}, {_degrees(lon.min(), 'EW')} to {_degrees(lon.max(), 'EW')}"
    if tide.shape is not None:
        rows, columns = tide.shape
        return [f"tide, {tide.what}, by {waves}", f"  {where} ({rows} x {columns})"]
    if lat.size == 1:
        where = f"{_degrees(lat[0], 'NS')}, {_degrees(lon[0], 'EW')}"
    places = f"{counted(lat.size, 'station')}, {where}; within {tide.reach_m / 1000.0:g} km of one"
    return [f"tide, {tide.what}, by {waves}", f"  {places}"]


def _told_of_cube(name: str, cube: Cube) -> list[str]:
    members = len(cube.members)
    lines = [f"{name}: {_when(cube)}" + (f", {members} members" if members > 1 else ""), f"  {_where(cube)}"]
    if cube.interval_s:
        lines.append(f"  the strongest of {_hours(cube.interval_s)} before each time")
    for base, group in groupby(zip(cube.base_utc_s, cube.utc_s, strict=True), key=lambda pair: pair[0]):
        times = [t for _, t in group]
        lines.append(f"  run of {iso(base)}: {iso(times[0])} to {iso(times[-1])}")
    lines += [f"  hole: nothing between {iso(a)} and {iso(b)}, {_hours(b - a)}" for a, b in cube.holes_s()]
    lacking = np.isnan(cube.values).all(axis=(2, 3, 4)).sum()
    if lacking:
        lines.append(f"  hole: {counted(int(lacking), 'time')} of single members missing")
    share = cube.unknown_share()
    if share > 0.0:
        lines.append(f"  not known: {_percent(share)} % of it")
    return lines


def _percent(share: float) -> str:
    """Return a share in per cent by two digits, or as 100.

    >>> [_percent(share) for share in (0.0832, 0.00123, 0.996, 1.0)]
    ['8.3', '0.12', '100', '100']
    """
    return f"{100.0 * share:.2g}" if share < 0.995 else "100"


def told_of_age(weather: Weather, now_s: float) -> str:
    """Return in words of which run the forecast is, how old that is, and until when it reaches."""
    base = weather.base_utc_s(now_s)
    last = max(float(cube.utc_s[-1]) for cube in weather.wind)
    return f"forecast of {iso(base)}, {_hours(now_s - base)} old, until {iso(last)}"


def told_of_off(off: Off) -> str:
    """Return in words by how much a forecast is off, in the mean of its members, and how long that counts."""
    east, north = (float(off.off_en_mps[:, k].mean()) for k in (0, 1))
    return (
        f"measured: of {counted(off.count, 'mean')} of ten minutes {math.hypot(east, north):.1f} m/s towards"
        f" {_compass(east, north)} are missing in the forecast, +- {off.sd_mps:.1f}; half of it counts in"
        f" {_hours(MEMORY_S * math.log(2.0))}, within 150 km"
    )


def _hours(seconds: float) -> str:
    return f"{seconds / 3600.0:.3g} h"


def _when(cube: Cube) -> str:
    if cube.utc_s.size == 1:
        return iso(cube.utc_s[0])
    holes = {a for a, _ in cube.holes_s()}
    steps = [b - a for a, b in zip(cube.utc_s[:-1], cube.utc_s[1:], strict=True) if a not in holes]
    every = ", then ".join(_hours(step) for step, _ in groupby(steps))
    count = counted(int(cube.utc_s.size), "time")
    return f"{iso(cube.utc_s[0])} to {iso(cube.utc_s[-1])}, {count}" + (f" every {every}" if steps else "")


def _where(cube: Cube) -> str:
    lat, lon = cube.lat_deg, cube.lon_deg
    rows = f"{_degrees(lat[0], 'NS')} to {_degrees(lat[-1], 'NS')}"
    columns = "all round" if cube.is_round else f"{_degrees(lon[0], 'EW')} to {_degrees(lon[-1], 'EW')}"
    tall, wide = ((axis[-1] - axis[0]) / max(1, axis.size - 1) for axis in (lat, lon))
    return f"{rows}, {columns}; a value every {tall:.3g} x {wide:.3g} degrees ({lat.size} x {lon.size})"


def _degrees(value: float, letters: str) -> str:
    value = math.remainder(value, 360.0)
    return f"{abs(value):.2f} {letters[int(value < 0.0)]}"


def told_at(weather: Weather, lat_deg: float, lon_deg: float) -> tuple[str, ...]:
    """Return a table of what is said of one place: a line for each time of the wind there.

    Without a wind it is each of the gusts, else of the current.
    """
    cubes = [cube for cube in (weather.wind or weather.gust or weather.current) if cube.covers(lat_deg, lon_deg)]
    utc = np.unique(np.concatenate([cube.utc_s for cube in cubes])) if cubes else np.zeros(0)
    wind = weather.wind_en_mps(utc, lat_deg, lon_deg)
    speed = np.hypot(wind[..., 0], wind[..., 1])
    gust = weather.gust_mps(utc, lat_deg, lon_deg)
    current = weather.current_en_mps(utc, lat_deg, lon_deg)
    tide = weather.tide_m(utc, lat_deg, lon_deg)
    waves = weather.waves_m(utc, lat_deg, lon_deg) if weather.waves and weather.wind else np.zeros((0, utc.size))
    many = len(weather.members) > 1 or gust.shape[0] > 1
    spread = " (a tenth of the members below, a tenth above)" if many else ""
    lines = [
        "time, wind [m/s] from, gust [m/s], current [m/s] towards"
        + (", waves [m]" if waves.size else "")
        + (", tide [m]" if np.isfinite(tide).any() else "")
        + spread
    ]
    for i, t in enumerate(utc):
        east, north = (_mean(wind[:, i, k]) for k in (0, 1))
        blows = f"{_spread(speed[:, i])} from {_compass(-east, -north)}" if weather.wind else "-"
        words = [iso(t), blows, _spread(gust[:, i])]
        words.append(_stream(*current[i]) if weather.has_current else "-")
        words += [_spread(waves[:, i])] if waves.size else []
        words += [f"{tide[i]:.2f}"] if np.isfinite(tide).any() else []
        lines.append("  ".join(words))
    return tuple(lines)


def _stream(east: float, north: float) -> str:
    speed_mps = math.hypot(east, north)
    return f"{speed_mps:.2f} to {_compass(east, north)}" if math.isfinite(speed_mps) else "?"


def _mean(values: Floats) -> float:
    known = values[~np.isnan(values)]
    return float(known.mean()) if known.size else math.nan


def _spread(values: Floats) -> str:
    known = values[~np.isnan(values)]
    if known.size == 0:
        return "?" if values.size else "-"
    middle = f"{float(known.mean()):.1f}"
    if known.size == 1:
        return middle
    low, high = np.quantile(known, (0.1, 0.9))
    return f"{middle} ({low:.1f}-{high:.1f})"


def _compass(east: float, north: float) -> str:
    if math.isnan(east) or math.hypot(east, north) < 1e-9:
        return "?"
    return f"{round(math.degrees(math.atan2(east, north))) % 360:03d}"
