"""A forecast as the wind and stream of a scenario: one member of it, over place and time, and what wanders about it.

Nothing is known beyond a forecast's edges, and a simulated boat needs a wind: there the nearest that is known holds on,
in time and in place.
"""

from __future__ import annotations

import math

import numpy as np

from companion.geo.angles import wrap_two_pi
from companion.geo.frame import LocalFrame
from companion.weather import Cube, Weather
from sitl.world.environment import Gusty, Later, Place, Process, Scripted, WindModel

# Of a lattice on which the forecast is looked up once; between its nodes it is linear, as the forecast is.
STEP_M = 2000.0
STEP_S = 600.0
_MOST_NODES = 200_000
Node = tuple[float, float, float, float]  # wind to east and north, stream to east and north


class ForecastField:
    """A member's wind and stream by seconds from ``begins_utc_s`` and metres in a frame."""

    def __init__(self, weather: Weather, member: int, frame: LocalFrame, begins_utc_s: float) -> None:
        self._weather, self._frame, self._begins_s = weather.only(member), frame, begins_utc_s
        self._nodes: dict[tuple[int, int, int], Node] = {}

    def why_unknown(self, t_s: float, en_m: Place) -> str:
        """Return in words why it does not know the wind; "" where it does."""
        here = self._frame.geo_from_en(*en_m)
        return self._weather.why_unknown(self._begins_s + t_s, here.lat_deg, here.lon_deg)

    def wind_at(self, t_s: float, en_m: Place) -> Place:
        """Return the motion of the air, east and north [m/s]."""
        return self._at(t_s, en_m)[:2]

    def stream_at(self, t_s: float, en_m: Place) -> Place:
        """Return the motion of the water, east and north [m/s]; none where it is not known."""
        return self._at(t_s, en_m)[2:]

    def _at(self, t_s: float, en_m: Place) -> Node:
        x, y, t = en_m[0] / STEP_M, en_m[1] / STEP_M, t_s / STEP_S
        i, j, k = math.floor(x), math.floor(y), math.floor(t)
        fx, fy, ft = x - i, y - j, t - k
        a = b = c = d = 0.0
        for di, wx in ((0, 1.0 - fx), (1, fx)):
            for dj, wy in ((0, 1.0 - fy), (1, fy)):
                for dk, wt in ((0, 1.0 - ft), (1, ft)):
                    weight = wx * wy * wt
                    if weight > 0.0:
                        node = self._node(i + di, j + dj, k + dk)
                        a += weight * node[0]
                        b += weight * node[1]
                        c += weight * node[2]
                        d += weight * node[3]
        return a, b, c, d

    def _node(self, i: int, j: int, k: int) -> Node:
        found = self._nodes.get((i, j, k))
        if found is None:
            if len(self._nodes) >= _MOST_NODES:
                self._nodes.clear()
            here = self._frame.geo_from_en(i * STEP_M, j * STEP_M)
            utc_s = self._begins_s + k * STEP_S
            wind = _nearest(self._weather.wind, utc_s, here.lat_deg, here.lon_deg)
            stream = self._stream(utc_s, here.lat_deg, here.lon_deg)
            found = self._nodes[i, j, k] = (*wind, *stream)
        return found

    def _stream(self, utc_s: float, lat_deg: float, lon_deg: float) -> Place:
        east, north = self._weather.current_en_mps(utc_s, lat_deg, lon_deg).ravel().tolist()
        return _nearest(self._weather.current, utc_s, lat_deg, lon_deg) if math.isnan(east + north) else (east, north)


def _nearest(cubes: tuple[Cube, ...], utc_s: float, lat_deg: float, lon_deg: float) -> Place:
    """Return what the finest cube that knows a place says, else the nearest value of the widest; 0 without any."""
    held = (0.0, 0.0)
    for cube in cubes:
        east, north = cube.at(utc_s, lat_deg, lon_deg)[0].ravel().tolist()
        if not math.isnan(east + north):
            return east, north
    for cube in cubes[::-1]:
        t = int(np.argmin(np.abs(cube.utc_s - utc_s)))
        past = np.mod(cube.lon_deg - lon_deg + 180.0, 360.0) - 180.0
        off = np.hypot(*np.meshgrid(past * math.cos(math.radians(lat_deg)), cube.lat_deg - lat_deg))
        known = ~np.isnan(cube.values[0, t].sum(axis=-1))
        if known.any():
            row = np.unravel_index(int(np.argmin(np.where(known, off, np.inf))), off.shape)
            east, north = cube.values[0, t][row].tolist()
            return east, north
    return held


class Blown:
    """The wind of a forecast at the place where a frame's metres begin, with what wanders about it.

    Direction and speed wander as those of ``AR1`` do, by ``sd_rad`` and ``tws_sd_mps``; all of it is turned by
    ``off_rad`` and stronger by ``off_mps``.
    """

    def __init__(
        self,
        field: ForecastField,
        home_en_m: Place,
        *,
        seed: int,
        sd_rad: float,
        rho_hz: float,
        tws_sd_mps: float,
        off_rad: float = 0.0,
        off_mps: float = 0.0,
    ) -> None:
        self.field, self.home_en_m = field, home_en_m
        self._off = (off_rad, off_mps)
        self._sd_rad, self._tws_sd_mps = sd_rad, tws_sd_mps
        self._direction = Process(rho_hz, 0.1, seed, 0, from_mean=False)
        self._speed = Process(rho_hz, 0.1, seed, 1, from_mean=False)

    def at(self, t_s: float) -> tuple[float, float]:
        """Return the wind at home: where from [rad, 0..2π), how fast [m/s]."""
        east, north = self.field.wind_at(t_s, self.home_en_m)
        twd = math.atan2(-east, -north) + self._off[0] + self._sd_rad * self._direction.at(t_s)
        tws = math.hypot(east, north) + self._off[1] + self._tws_sd_mps * self._speed.at(t_s)
        return wrap_two_pi(twd), max(0.0, tws)

    def elsewhere(self, t_s: float, en_m: Place, home: tuple[float, float]) -> tuple[float, float]:
        """Return the wind of a place, where that of home is (from [rad], speed [m/s]): as far off its forecast."""
        east0, north0 = self.field.wind_at(t_s, self.home_en_m)
        east, north = self.field.wind_at(t_s, en_m)
        twd = math.atan2(-east, -north) + home[0] - math.atan2(-east0, -north0)
        return wrap_two_pi(twd), max(0.0, math.hypot(east, north) + home[1] - math.hypot(east0, north0))

    def stream_at(self, t_s: float, en_m: Place) -> Place:
        """Return the stream of a place, east and north [m/s]."""
        return self.field.stream_at(t_s, en_m)


def beneath(wind: WindModel) -> Blown | None:
    """Return the forecast that events, gusts and hours are laid over; None: there is none."""
    while isinstance(wind, (Scripted, Later, Gusty)):
        wind = wind.base
    return wind if isinstance(wind, Blown) else None
