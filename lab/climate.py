"""Weather made up after the climate: trades, calms and westerlies by season, with lows that travel, and its forecasts.

Nobody's data are in it, so that whoever has the seed has the weather. The mean wind of 10 m depends on latitude and day
of the year; over it lies the wind of a sum of travelling waves, free of divergence, as strong as weather is there. A
forecast is the truth and an error of the same kind that grows with the lead (RMSE of a component 0.5 m/s at once,
4 m/s after ten days and more, as North Atlantic forecasts have it). The members' errors and the forecast's own are
drawn alike: nothing tells the truth from one more member.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from companion.weather import Cube, Weather

Floats = NDArray[np.float64]
Box = tuple[float, float, float, float]  # west, south, east, north [deg], east above 180 over the date line

# Zonal means over the ocean, rounded: latitude, to the east, to the north [m/s].
_MEAN = np.array(
    [
        (-90.0, 0.0, 0.0),
        (-75.0, -2.0, 1.0),
        (-62.0, 2.0, 0.0),
        (-50.0, 7.0, -0.5),
        (-40.0, 5.0, -0.5),
        (-30.0, 0.0, 1.0),
        (-20.0, -4.5, 2.0),
        (-10.0, -5.5, 2.5),
        (0.0, -3.5, 2.0),
        (5.0, -1.5, 0.0),
        (10.0, -4.5, -2.0),
        (18.0, -5.5, -2.5),
        (30.0, 0.0, -1.0),
        (40.0, 3.5, 0.5),
        (50.0, 4.5, 1.0),
        (62.0, 1.0, 0.5),
        (75.0, -2.0, -1.0),
        (90.0, 0.0, 0.0),
    ]
)
_FOLLOWS_DEG = 4.0  # the belts follow the sun so far ...
_NORTHMOST_DAY = 227.0  # ... and are in the north in the middle of August
_WINTER = 0.3  # of the westerlies and of the weather, more in winter and less in summer
# Of a component of the wind by latitude north or south, the deviation of the weather from the mean [m/s].
_SPREAD = np.array([(0.0, 1.2), (15.0, 1.5), (30.0, 3.0), (45.0, 4.3), (60.0, 4.3), (75.0, 3.0), (90.0, 1.0)])
_WAVES = 40
_EARTH_M = 6_371_000.0
_STEERED_MPS = 11.0  # to the east, so fast travel waves of the weather
_AT_ONCE_MPS, _GROWN_MPS, _GROWN_S = 0.5, 4.0, 10 * 86_400.0
_TROPIC_SHARE = 0.4  # of an error, in the trades
_YEAR_S = 365.2422 * 86_400.0


class _Waves:
    """A sum of travelling waves: the wind of a stream function that is of deviation one."""

    def __init__(self, seed: Sequence[int]) -> None:
        draw = np.random.default_rng(seed)
        self.around = draw.integers(5, 15, _WAVES).astype(float)  # waves round the globe
        self.upward = draw.uniform(4.0, 14.0, _WAVES) * draw.choice((-1.0, 1.0), _WAVES)  # to a turn of latitude
        self.turns_hz = self.around * (_STEERED_MPS * draw.uniform(0.6, 1.4, _WAVES)) / (_EARTH_M * 0.7)  # rad/s
        self.begins = draw.uniform(0.0, 2.0 * math.pi, _WAVES)

    def wind(self, t_s: float, lat_deg: Floats, lon_deg: Floats) -> Floats:
        """Return (y, x, 2), each component of deviation one."""
        lat, lon = np.radians(lat_deg), np.radians(lon_deg)
        phase = self.upward[:, None] * lat + (self.begins - self.turns_hz * t_s)[:, None]
        along = np.exp(1j * self.around[:, None] * lon)
        up = np.exp(1j * phase)
        east = np.einsum("ky,kx->yx", self.upward[:, None] * up, along).imag
        north = -np.einsum("ky,kx->yx", self.around[:, None] * up, along).imag
        scale = math.sqrt(2.0 / float(np.sum(self.upward**2 + self.around**2))) * math.sqrt(2.0)
        return scale * np.stack([east, north], axis=-1)


def mean_wind(utc_s: float, lat_deg: Floats) -> Floats:
    """Return (y, 2): the mean motion of the air at latitudes, at that time of the year [m/s]."""
    season = _season(utc_s)
    at = lat_deg - _FOLLOWS_DEG * season
    east, north = np.interp(at, _MEAN[:, 0], _MEAN[:, 1]), np.interp(at, _MEAN[:, 0], _MEAN[:, 2])
    east = np.where(east > 0.0, east * (1.0 - _WINTER * season * np.sign(lat_deg)), east)
    return np.stack([east, north], axis=-1)


def _season(utc_s: float) -> float:
    """Return 1 when the belts are in the north, -1 when they are in the south."""
    return math.cos(2.0 * math.pi * (utc_s / _YEAR_S % 1.0 - _NORTHMOST_DAY / 365.2422))


def _spread(utc_s: float, lat_deg: Floats) -> Floats:
    found = np.interp(np.abs(lat_deg), _SPREAD[:, 0], _SPREAD[:, 1])
    return np.asarray(found * (1.0 - _WINTER * _season(utc_s) * np.sign(lat_deg) * (np.abs(lat_deg) > 25.0)))


def error_mps(lead_s: float) -> float:
    """Return the RMSE of a component of a forecast's wind in the westerlies.

    >>> error_mps(0.0), error_mps(5 * 86400.0), error_mps(20 * 86400.0)
    (0.5, 2.25, 4.0)
    """
    return _AT_ONCE_MPS + (_GROWN_MPS - _AT_ONCE_MPS) * min(1.0, max(0.0, lead_s) / _GROWN_S)


def grid_of(box: Box, step_deg: float) -> tuple[Floats, Floats]:
    """Return latitudes and longitudes that hold a box."""
    west, south, east, north = box
    y0, y1 = max(-90.0, math.floor(south / step_deg) * step_deg), min(90.0, math.ceil(north / step_deg) * step_deg)
    lon = np.arange(math.floor(west / step_deg), math.ceil(east / step_deg) + 1.0) * step_deg
    if lon[-1] - lon[0] > 360.0 - step_deg:
        lon = np.arange(-180.0, 180.0, step_deg)
    return np.arange(round(y0 / step_deg), round(y1 / step_deg) + 1.0) * step_deg, lon


def truth(seed: int, utc_s: Floats, box: Box, step_deg: float = 1.0) -> Weather:
    """Return what blows at times and within a box, as the one member of a weather."""
    lat, lon = grid_of(box, step_deg)
    return _weather(utc_s, np.full(utc_s.size, utc_s[0]), lat, lon, _true(seed, utc_s, lat, lon)[None])


def forecast(seed: int, utc_s: Floats, box: Box, *, members: int = 1, run: int = 0, step_deg: float = 1.0) -> Weather:
    """Return a forecast of ``truth`` that begins with the first time; ``run`` numbers those of one truth.

    Of the forecasts of one truth each errs by itself, half of it as the others.
    """
    lat, lon = grid_of(box, step_deg)
    return _told(_true(seed, utc_s, lat, lon), seed, utc_s, lat, lon, members, run)


def forecast_of(true: Weather, seed: int, utc_s: Floats, box: Box, *, members: int = 1, run: int = 0) -> Weather:
    """Return what ``forecast`` does of a wind that is known, as a reanalysis or ``truth`` itself: its first member."""
    lat, lon = grid_of(box, 1.0)
    rows, columns = (part.ravel() for part in np.meshgrid(lat, lon, indexing="ij"))
    blows = true.wind_over(utc_s, rows, columns)[0].astype(np.float64)
    return _told(blows.reshape(utc_s.size, lat.size, lon.size, 2), seed, utc_s, lat, lon, members, run)


def _told(true: Floats, seed: int, utc_s: Floats, lat: Floats, lon: Floats, members: int, run: int) -> Weather:
    grown = np.array([error_mps(t - utc_s[0]) for t in utc_s])
    share = np.interp(np.abs(lat), (15.0, 35.0), (_TROPIC_SHARE, 1.0))
    size = grown[:, None, None, None] * share[:, None, None]
    own = (_error(seed, run, 0, utc_s, lat, lon) + _error(seed, -1, 0, utc_s, lat, lon)) / math.sqrt(2.0)
    middle = true - size * own
    values = np.empty((members, *true.shape), dtype=np.float32)
    for m in range(members):
        values[m] = middle if members == 1 else middle + size * _error(seed, run, m + 1, utc_s, lat, lon)
    return _weather(utc_s, np.full(utc_s.size, utc_s[0]), lat, lon, values)


def usual(utc_s: Floats, box: Box, step_deg: float = 1.0) -> Weather:
    """Return the mean wind of the season alone: what is known without a forecast."""
    lat, lon = grid_of(box, step_deg)
    values = np.stack([np.broadcast_to(mean_wind(t, lat)[:, None], (lat.size, lon.size, 2)) for t in utc_s])
    return _weather(utc_s, np.full(utc_s.size, utc_s[0]), lat, lon, values[None])


def _true(seed: int, utc_s: Floats, lat: Floats, lon: Floats) -> Floats:
    waves = _Waves((seed, 0))
    return np.stack(
        [mean_wind(t, lat)[:, None] + _spread(t, lat)[:, None, None] * waves.wind(t, lat, lon) for t in utc_s]
    )


def _error(seed: int, run: int, member: int, utc_s: Floats, lat: Floats, lon: Floats) -> Floats:
    waves = _Waves((seed, 1, run + 1, member))
    return np.stack([waves.wind(t, lat, lon) for t in utc_s])


def _weather(utc_s: Floats, base_utc_s: Floats, lat: Floats, lon: Floats, values: NDArray[np.floating]) -> Weather:
    cube = Cube(
        utc_s=np.array(utc_s),
        base_utc_s=base_utc_s,
        members=tuple(range(len(values))),
        lat_deg=lat,
        lon_deg=lon,
        values=np.asarray(values, dtype=np.float32),
    )
    return Weather(wind=(cube,))
