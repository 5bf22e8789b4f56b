"""A route sailed in a forecast: along geodesics, by steps of five minutes at the most, every member by itself."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from companion.messages import GeoPoint
from companion.passage.frame import GEOD, Floats, up_of
from companion.passage.kernels import KNOWN, LEE_SHORE, OVER_LIMIT, OVER_WAVES, Craft, sail_line
from companion.weather import Weather

EVERY_M = (200.0, 2000.0)  # wind and stream are looked up so often along the way, on short ones and on long
PLACES = 1000
STEP_S = 300.0  # on long ways
BEAT_RAD = math.radians(50.0)
_BROKEN = {
    OVER_LIMIT: "{:.1f} m/s of wind is more than she is to be out in",
    OVER_WAVES: "the sea is higher than she is to be out in",
    LEE_SHORE: "{:.1f} m/s of wind blow on a shore that is near",
}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Sailed:
    """A route sailed in one member, by a ``share`` of her speeds.

    ``rows`` are (time [Unix s], way [m], speed made good, wind [m/s], angle of the course to the wind [rad], night) by
    steps of five minutes at the most; ``line`` (m, 3) is the route in (way [m], latitude, longitude [deg]). ``why`` is
    empty where she arrived; ``is_too_much`` where it is wind, sea or a lee shore that ended it.
    """

    member: int
    arrived: bool
    why: str
    is_too_much: bool
    rows: Floats
    line: Floats
    length_m: float
    share: float = 1.0

    @property
    def places(self) -> Floats:
        """Return (n, 2): the latitude and longitude of each row [deg]."""
        way, lat, lon = self.line.T
        return np.stack([np.interp(self.rows[:, 1], way, lat), np.interp(self.rows[:, 1], way, lon)], axis=-1)

    @property
    def way_m(self) -> float:
        """How far she came along the route [m]."""
        return float(self.rows[-1, 1]) if len(self.rows) else 0.0

    @property
    def time_s(self) -> float:
        """From departure to the end, or to where it is known no further [s]."""
        return float(self.rows[-1, 0] - self.rows[0, 0]) if len(self.rows) else 0.0

    @property
    def strongest_mps(self) -> float:
        """The most wind on the way [m/s]."""
        return float(self.rows[:, 3].max()) if len(self.rows) else 0.0

    def hours(self, which: str) -> float:
        """Return the hours of ``night``, of ``beating``, or ``waiting`` where she makes no way."""
        if len(self.rows) < 2:
            return 0.0
        dt = np.diff(self.rows[:, 0])
        row = self.rows[:-1]
        chosen = {"night": row[:, 5] > 0.5, "beating": np.abs(row[:, 4]) < BEAT_RAD, "waiting": row[:, 2] < 0.01}[which]
        return float(dt[chosen].sum() / 3600.0)


def sail(
    weather: Weather,
    craft: Craft,
    waypoints: Sequence[GeoPoint],
    depart_utc_s: float,
    radius_m: float,
    members: Sequence[int],
    shares: Sequence[float] = (1.0,),
    shore_en: Callable[[Floats, Floats], Floats] | None = None,
) -> list[Sailed]:
    """Return the route sailed in each member and share of her speeds, to within ``radius_m`` of its end.

    ``shore_en`` tells of places the direction to a shore that is near, zero where none is.
    """
    way, lat, lon, course = _line(waypoints, radius_m)
    step_s = min(STEP_S, max(10.0, float(way[-1]) / 1000.0))
    first = max(depart_utc_s, min(float(c.utc_s[0]) for c in weather.wind))
    last = max(float(cube.utc_s[-1]) for cube in weather.wind)
    times = np.concatenate([[first], weather.times_between(first, last), [last] if last > first else []])
    t, s = np.meshgrid(times, np.arange(way.size), indexing="ij")
    shape = (times.size, way.size, 2)
    stream = np.zeros(shape)
    if weather.has_current:
        stream = _along(weather.current_en_mps(t, lat[s], lon[s]), course)
    up = up_of(lat, lon)
    height = weather.waves_m(t, lat[s], lon[s]) if weather.waves else None
    towards = np.zeros((way.size, 2)) if shore_en is None else shore_en(lat, lon)
    line = np.stack([way, lat, np.unwrap(lon, period=360.0)], axis=-1)
    out = []
    for member in members:
        row = weather.members.index(member)
        waves = np.zeros(shape[:2]) if height is None else np.ascontiguousarray(height[row])
        wind = weather.only(member).wind_over(times, lat, lon)[0].astype(np.float64)
        onshore = np.nan_to_num(np.sum(wind * towards, axis=-1))
        blows = _along(wind, course)
        for share in shares:
            rows, count, status = sail_line(
                craft._replace(share=share * craft.share),
                times,
                way,
                blows,
                stream,
                waves,
                onshore,
                up,
                depart_utc_s,
                step_s,
            )
            rows = rows[:count].copy()
            why = ""
            if status in _BROKEN:
                why = _BROKEN[status].format(rows[-1, 3])
            elif status != KNOWN:
                here = rows[-1] if count else np.array([depart_utc_s, 0.0])
                at = (np.interp(here[1], way, lat), np.interp(here[1], way, line[:, 2]))
                why = (
                    weather.why_unknown(float(here[0]) + step_s, float(at[0]), float(at[1])) or "not known any further"
                )
            out.append(
                Sailed(
                    member=member,
                    arrived=status == KNOWN,
                    why=why,
                    is_too_much=status in _BROKEN,
                    rows=rows,
                    line=line,
                    length_m=float(way[-1]),
                    share=share,
                )
            )
    return out


def _along(en: Floats, course_rad: Floats) -> Floats:
    """Return vectors (..., s, 2) of east and north as along the course and to its left."""
    sine, cosine = np.sin(course_rad), np.cos(course_rad)
    return np.stack([en[..., 0] * sine + en[..., 1] * cosine, en[..., 1] * sine - en[..., 0] * cosine], axis=-1)


def _line(waypoints: Sequence[GeoPoint], radius_m: float) -> tuple[Floats, Floats, Floats, Floats]:
    """Return way [m], latitude, longitude [deg] and course [rad] of points along geodesics, corners among them."""
    ways, lats, lons, courses = [], [], [], []
    whole = sum(GEOD.inv(a.lon_deg, a.lat_deg, b.lon_deg, b.lat_deg)[2] for a, b in pairwise(waypoints))
    every = min(EVERY_M[1], max(EVERY_M[0], whole / PLACES))
    gone = 0.0
    for k, (a, b) in enumerate(pairwise(waypoints)):
        azimuth, _, length = GEOD.inv(a.lon_deg, a.lat_deg, b.lon_deg, b.lat_deg)
        if k == len(waypoints) - 2:
            length = max(1.0, length - radius_m)
        along = np.linspace(0.0, length, max(2, math.ceil(length / every) + 1))
        if along[-1] <= 0.0:
            continue
        along[0] += 1e-6 * (k > 0)  # each leg has its own course at the corner
        lon, lat, back = GEOD.fwd(
            np.full(along.size, a.lon_deg), np.full(along.size, a.lat_deg), np.full(along.size, azimuth), along
        )
        ways.append(gone + along)
        lats.append(lat)
        lons.append(lon)
        courses.append(np.radians(np.asarray(back) + 180.0))
        courses[-1][0] = math.radians(azimuth)
        gone += length
    return np.concatenate(ways), np.concatenate(lats), np.concatenate(lons), np.concatenate(courses)
