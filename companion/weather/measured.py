"""The wind measured on board against a forecast: by how much it is off here and now, how surely, and for how long.

What a forecast is off by is an Ornstein-Uhlenbeck process in each component and member: ``OFF_MPS`` of it before
anything was measured, forgotten by ``MEMORY_S``. A Kalman filter over means of ten minutes says what it is now; ahead
it decays and its doubt grows back. Now the measured wind has taken over, after a few memories the forecast has.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from companion.geo import EARTH_RADIUS_M
from companion.weather.weather import Cube, Floats, Weather

OFF_MPS = 1.5  # of a component, a day ahead: forecasts of the open sea are off by 2 m/s of speed
MEMORY_S = 6 * 3600.0  # after so long a third of it is left
REACH_M = 150_000.0  # and so far away
MEAN_S = 600.0  # shorter than this it is gusts
GUST_MPS = 0.8  # a mean of ten minutes still differs from the wind of the model by so much
OLD_S = 12 * 3600.0  # what was measured longer ago is not asked
_HOUR_S = 3600.0
_LASTS = 4.0  # memories


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Measured:
    """A wind measured at places: (n,) Unix times, places [deg], and (n, 2) the motion of the air [m/s]."""

    utc_s: Floats
    lat_deg: Floats
    lon_deg: Floats
    wind_en_mps: Floats


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Off:
    """By how much a forecast is off at ``utc_s``: (m, 2) of its members [m/s], and the deviation of that.

    ``count`` means of ten minutes say so, the last of them at the time and place.
    """

    utc_s: float
    lat_deg: float
    lon_deg: float
    members: tuple[int, ...]
    off_en_mps: Floats
    sd_mps: float
    count: int

    def share(self, ahead_s: float) -> float:
        """Return how much of it is left after a time."""
        return math.exp(-ahead_s / MEMORY_S)


def off_by(weather: Weather, measured: Measured, now_s: float) -> Off | None:
    """Return by how much a forecast is off now; None where nothing was measured in the last hours that it knows of."""
    means = _means(measured, now_s)
    forecast = weather.wind_en_mps(means.utc_s, means.lat_deg, means.lon_deg)
    known = ~np.isnan(forecast).any(axis=(0, 2))
    if not known.any():
        return None
    residual = means.wind_en_mps - forecast  # (m, n, 2)
    state = np.zeros((residual.shape[0], 2))
    variance, last_s = OFF_MPS**2, float(means.utc_s[known][0])
    for t, off in zip(means.utc_s[known], np.moveaxis(residual[:, known], 1, 0), strict=True):
        left = math.exp(-(float(t) - last_s) / MEMORY_S)
        state, variance = left * state, left**2 * variance + (1.0 - left**2) * OFF_MPS**2
        gain = variance / (variance + GUST_MPS**2)
        state, variance, last_s = state + gain * (off - state), (1.0 - gain) * variance, float(t)
    left = math.exp(-(now_s - last_s) / MEMORY_S)
    return Off(
        utc_s=now_s,
        lat_deg=float(means.lat_deg[known][-1]),
        lon_deg=float(means.lon_deg[known][-1]),
        members=weather.members,
        off_en_mps=left * state,
        sd_mps=math.sqrt(left**2 * variance + (1.0 - left**2) * OFF_MPS**2),
        count=int(known.sum()),
    )


def _means(measured: Measured, now_s: float) -> Measured:
    """Return means of ten minutes of what was measured not too long ago, at their middles."""
    fresh = (measured.utc_s <= now_s) & (measured.utc_s > now_s - OLD_S)
    fresh &= ~np.isnan(measured.wind_en_mps).any(axis=1) & ~np.isnan(measured.lat_deg + measured.lon_deg)
    slot = np.ceil((measured.utc_s[fresh] - now_s) / MEAN_S)
    slots, which = np.unique(slot, return_inverse=True)
    count = np.bincount(which, minlength=slots.size)

    def mean(values: Floats) -> Floats:
        return np.asarray(np.bincount(which, weights=values[fresh], minlength=slots.size) / count)

    first_deg = float(measured.lon_deg[fresh][0]) if fresh.any() else 0.0
    return Measured(
        utc_s=mean(measured.utc_s),
        lat_deg=mean(measured.lat_deg),
        lon_deg=_wrapped_deg(first_deg + mean(_wrapped_deg(measured.lon_deg - first_deg))),
        wind_en_mps=np.stack([mean(measured.wind_en_mps[:, k]) for k in (0, 1)], axis=-1),
    )


def _wrapped_deg(lon_deg: Floats) -> Floats:
    """Return longitudes in -180..180."""
    return np.asarray((lon_deg + 180.0) % 360.0 - 180.0)


def corrected(weather: Weather, off: Off) -> Weather:
    """Return a forecast with what it is off by added from ``off.utc_s`` on, less with time and distance.

    Of several members each keeps so much of its own spread as is not known: they differ by the deviation of the
    correction, in fixed directions, and all of the correction's doubt is theirs.
    """
    doubt = off.sd_mps * _scores(len(off.members))
    shift = dict(zip(off.members, off.off_en_mps + doubt, strict=True))
    return replace(weather, wind=tuple(_shifted(cube, off, shift) for cube in weather.wind))


def _scores(members: int) -> Floats:
    """Return (m, 2) fixed scores of mean 0 and deviation 1 in each component; 0 of one or two members."""
    if members < 3:
        return np.zeros((members, 2))
    angle = 2.0 * math.pi * np.arange(members) * 0.618034
    radius = np.sqrt(-2.0 * np.log((np.arange(members) + 0.5) / members))
    raw = radius[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    raw -= raw.mean(axis=0)
    return np.asarray(raw / raw.std(axis=0))


def _shifted(cube: Cube, off: Off, shift: dict[int, Floats]) -> Cube:
    """Return a cube on its own times and, while the correction lasts, each hour of them."""
    ends = off.utc_s + _LASTS * MEMORY_S
    hours = off.utc_s + _HOUR_S * np.arange(0.0, (ends - off.utc_s) / _HOUR_S + 1.0)
    # Just before now it is as it was: no hour is corrected that had passed.
    hours = np.append(hours, off.utc_s - 1.0)
    hours = hours[(hours > cube.utc_s[0]) & (hours < cube.utc_s[-1])]
    for begins, closes in cube.holes_s():
        hours = hours[(hours <= begins) | (hours >= closes)]
    times = np.unique(np.concatenate([cube.utc_s, hours]))
    values = _at_times(cube, times)
    ahead = times - off.utc_s
    left = np.where(ahead < 0.0, 0.0, np.exp(-np.maximum(0.0, ahead) / MEMORY_S))
    near = np.exp(-_away_m(cube, off) / REACH_M)
    for row, member in enumerate(cube.members):
        if member in shift:
            values[row] += (left[:, None, None, None] * near[None, :, :, None] * shift[member]).astype(np.float32)
    base = cube.base_utc_s[np.clip(np.searchsorted(cube.utc_s, times, side="right") - 1, 0, None)]
    return replace(cube, utc_s=times, base_utc_s=base, values=values)


def _at_times(cube: Cube, times: Floats) -> NDArray[np.float32]:
    at = np.clip(np.searchsorted(cube.utc_s, times, side="right") - 1, 0, max(0, cube.utc_s.size - 2))
    after = np.minimum(at + 1, cube.utc_s.size - 1)
    span = np.maximum(1.0, cube.utc_s[after] - cube.utc_s[at])
    share = np.clip((times - cube.utc_s[at]) / span, 0.0, 1.0).astype(np.float32)[None, :, None, None, None]
    one, two = cube.values[:, at], cube.values[:, after]
    mixed = np.where(share > 0.0, one + share * (two - one), one)
    return np.where(share >= 1.0, two, mixed).astype(np.float32)


def _away_m(cube: Cube, off: Off) -> Floats:
    lat, lon = np.meshgrid(np.radians(cube.lat_deg), np.radians(cube.lon_deg), indexing="ij")
    lat0, lon0 = math.radians(off.lat_deg), math.radians(off.lon_deg)
    half = np.sin(0.5 * (lat - lat0)) ** 2 + np.cos(lat) * math.cos(lat0) * np.sin(0.5 * (lon - lon0)) ** 2
    return np.asarray(2.0 * EARTH_RADIUS_M * np.arcsin(np.sqrt(np.clip(half, 0.0, 1.0))))
