"""Weather: wind, gusts and current over time and place, by members; what lies beyond its edges is unknown, not guessed.

A wind is the motion of the air (east, north), so a north wind has a north component below zero; a current is the motion
of the water. Components are interpolated, never directions. Unknown is NaN.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from companion.weather.tides import Tides, steps_of

Floats = NDArray[np.float64]
MOST_STEP_S = 12 * 3600.0  # between two times farther apart than this nothing is made up
_HOLE = 1.5  # times as long as the longer of the steps beside it: one is missing
_TIGHT_DEG = 1e-6
_ROUND_DEG = 360.0
TIDELESS_S = 6 * 3600.0  # a current that is told at steps longer than this is a mean over the tide, and has none in it


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Cube:
    """Values of one grid. Raises ValueError where the axes do not fit.

    Attributes:
        utc_s: (t,) Unix times, strictly increasing.
        base_utc_s: (t,) the base time of the run that each of them is of.
        members: (m,) numbers of the members, 0 the control or only forecast.
        lat_deg: (y,) ascending.
        lon_deg: (x,) ascending, above 180 where it lies over the date line.
        values: (m, t, y, x, k) float32, NaN where unknown: k components.
        interval_s: what is said is the maximum of so long before each time; 0: it is of the time.
        most_step_s: between two times farther apart than this nothing is made up.
        sources: the files that it is of.
    """

    utc_s: Floats
    base_utc_s: Floats
    members: tuple[int, ...]
    lat_deg: Floats
    lon_deg: Floats
    values: NDArray[np.float32]
    interval_s: float = 0.0
    most_step_s: float = MOST_STEP_S
    sources: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        shape = (len(self.members), self.utc_s.size, self.lat_deg.size, self.lon_deg.size)
        if self.values.ndim != 5 or self.values.shape[:4] != shape or 0 in shape:
            raise ValueError(f"values of {self.values.shape} are not of {shape} members, times, rows and columns")
        if self.base_utc_s.shape != self.utc_s.shape:
            raise ValueError("each time is of a run")
        for axis in (self.utc_s, self.lat_deg, self.lon_deg):
            if bool(np.any(np.diff(axis) <= 0.0)):
                raise ValueError("times, latitudes and longitudes increase strictly")
        for array in (self.utc_s, self.base_utc_s, self.lat_deg, self.lon_deg, self.values):
            array.setflags(write=False)

    @property
    def is_round(self) -> bool:
        """Whether it goes all the way round the earth."""
        columns = self.lon_deg.size
        return bool(columns > 1 and (self.lon_deg[-1] - self.lon_deg[0]) * columns / (columns - 1) > 360.0 - 1e-3)

    @property
    def cell_deg2(self) -> float:
        """The size of a cell [degrees squared]."""
        tall, wide = (
            (axis[-1] - axis[0]) / max(1, axis.size - 1) if axis.size > 1 else 1.0
            for axis in (self.lat_deg, self.lon_deg)
        )
        return float(tall * wide)

    @property
    def is_tideless(self) -> bool:
        """Whether its times are too far apart for a tide to be in it."""
        return bool(self.utc_s.size < 2 or np.diff(self.utc_s).min() > TIDELESS_S)

    def holes_s(self) -> tuple[tuple[float, float], ...]:
        """Return its gaps in time."""
        return holes_of(self.utc_s, self.most_step_s)

    def unknown_share(self) -> float:
        """Return the share of its values that are not known: land under a current, members that lack a time."""
        return float(np.isnan(self.values).mean())

    def at(self, utc_s: ArrayLike, lat_deg: ArrayLike, lon_deg: ArrayLike) -> Floats:
        """Return (m, n, k) at n places and times, bilinear in place and linear in time; NaN where it is unknown."""
        utc, lat, lon = (np.asarray(a, dtype=np.float64) for a in np.broadcast_arrays(utc_s, lat_deg, lon_deg))
        shape = utc.shape
        utc, lat, lon = utc.ravel(), lat.ravel(), lon.ravel()
        x, fx, in_x = self._across(lon)
        y, fy, in_y = _between(self.lat_deg, lat, _TIGHT_DEG)
        t, ft, in_t = self._along(utc)
        out = np.zeros((len(self.members), utc.size, self.values.shape[4]))
        columns = self.lon_deg.size
        for dt, wt in ((0, 1.0 - ft), (1, ft)):
            for dy, wy in ((0, 1.0 - fy), (1, fy)):
                for dx, wx in ((0, 1.0 - fx), (1, fx)):
                    weight = wt * wy * wx
                    ti = np.minimum(t + dt, self.utc_s.size - 1)
                    yi = np.minimum(y + dy, self.lat_deg.size - 1)
                    xi = (x + dx) % columns if self.is_round else np.minimum(x + dx, columns - 1)
                    corner = self.values[:, ti, yi, xi]
                    out += np.where(weight[None, :, None] > 0.0, weight[None, :, None] * corner, 0.0)
        out[:, ~(in_x & in_y & in_t)] = math.nan
        return out.reshape(len(self.members), *shape, self.values.shape[4])

    def over(self, utc_s: Floats, lat_deg: Floats, lon_deg: Floats) -> NDArray[np.float32]:
        """Return (m, t, n, k) at each of t times and n places: what ``at`` says, looked up once for all times."""
        x, fx, in_x = self._across(lon_deg)
        y, fy, in_y = _between(self.lat_deg, lat_deg, _TIGHT_DEG)
        t, ft, in_t = self._along(utc_s)
        ft, columns = ft.astype(np.float32), self.lon_deg.size
        first, last = int(t.min()), min(int(t.max()) + 1, self.utc_s.size - 1)
        flat = self.values[:, first : last + 1].reshape(len(self.members), last + 1 - first, -1, self.values.shape[4])
        known = np.zeros((len(self.members), last + 1 - first, lat_deg.size, self.values.shape[4]), dtype=np.float32)
        for dy, wy in ((0, 1.0 - fy), (1, fy)):
            for dx, wx in ((0, 1.0 - fx), (1, fx)):
                weight = (wy * wx).astype(np.float32)[:, None]
                yi = np.minimum(y + dy, self.lat_deg.size - 1)
                xi = (x + dx) % columns if self.is_round else np.minimum(x + dx, columns - 1)
                part = weight * flat.take(yi * columns + xi, axis=2)
                known += part if bool(np.all(weight > 0.0)) else np.where(weight > 0.0, part, np.float32(0.0))
        known[:, :, ~(in_x & in_y)] = math.nan
        out = np.empty((len(self.members), utc_s.size, lat_deg.size, self.values.shape[4]), dtype=np.float32)
        for n, (k, share) in enumerate(zip(t - first, ft, strict=True)):
            if not in_t[n]:
                out[:, n] = math.nan
            elif share == 0.0:
                out[:, n] = known[:, k]
            elif share == 1.0:
                out[:, n] = known[:, k + 1]
            else:
                out[:, n] = (1.0 - share) * known[:, k] + share * known[:, k + 1]
        return out

    def _along(self, utc_s: Floats) -> tuple[NDArray[np.int64], Floats, NDArray[np.bool_]]:
        """Return between which of its times each is, by what share, and whether it is known then."""
        t, share, is_in = _between(self.utc_s, utc_s, 1e-3)
        for begins, ends in self.holes_s():
            is_in &= (utc_s <= begins) | (utc_s >= ends)
        return t, share, is_in

    def _across(self, lon_deg: Floats) -> tuple[NDArray[np.int64], Floats, NDArray[np.bool_]]:
        """Return between which of its columns each longitude is, by what share, and whether it reaches so far."""
        past_deg = np.mod(lon_deg - self.lon_deg[0], _ROUND_DEG)
        past_deg = np.where(past_deg > _ROUND_DEG - _TIGHT_DEG, 0.0, past_deg)  # a hair west of the first column
        if not self.is_round:
            return _between(self.lon_deg - self.lon_deg[0], past_deg, _TIGHT_DEG)
        axis = np.append(self.lon_deg - self.lon_deg[0], _ROUND_DEG)
        return _between(axis, past_deg, _TIGHT_DEG)

    def mean(self) -> Cube:
        """Return the mean of the members, as member 0."""
        known = ~np.isnan(self.values)
        with np.errstate(invalid="ignore"):
            values = np.where(known, self.values, 0.0).sum(axis=0, keepdims=True) / known.sum(axis=0, keepdims=True)
        return replace(self, members=(0,), values=values.astype(np.float32))

    def only(self, member: int) -> Cube:
        """Return one member of it."""
        row = self.members.index(member)
        return replace(self, members=(member,), values=self.values[row : row + 1])

    def covers(self, lat_deg: float, lon_deg: float) -> bool:
        """Return whether a place is within its edges."""
        columns, rows = self._across(np.array([lon_deg])), _between(self.lat_deg, np.array([lat_deg]), _TIGHT_DEG)
        return bool(columns[2][0] and rows[2][0])


def holes_of(utc_s: Floats, most_step_s: float = MOST_STEP_S) -> tuple[tuple[float, float], ...]:
    """Return the gaps (from, to) between times: longer than ``most_step_s``, or longer than the steps on both sides.

    Where the steps only become longer, as they do some days ahead, nothing is missing.
    """
    step = np.diff(utc_s)
    out = []
    for i in range(step.size):
        is_inside = 0 < i < step.size - 1
        if step[i] > most_step_s or (is_inside and step[i] > _HOLE * max(step[i - 1], step[i + 1])):
            out.append((float(utc_s[i]), float(utc_s[i + 1])))
    return tuple(out)


def _between(axis: Floats, at: Floats, tight: float) -> tuple[NDArray[np.int64], Floats, NDArray[np.bool_]]:
    """Return the node before each, the share of the way to the next, and whether it is on the axis at all."""
    is_on = (at >= axis[0] - tight) & (at <= axis[-1] + tight)
    if axis.size == 1:
        return np.zeros(at.size, dtype=np.int64), np.zeros(at.size), is_on
    i = np.clip(np.searchsorted(axis, at, side="right") - 1, 0, axis.size - 2)
    share = np.clip((at - axis[i]) / (axis[i + 1] - axis[i]), 0.0, 1.0)
    return i, share, is_on & np.isfinite(at)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Weather:
    """A forecast of one or several files: cubes of the wind and, where there are, of gusts, waves, current, and tides.

    Of several grids the finest that knows a place and time is asked. ``notes`` are what else was found. From
    ``climate_from_s`` on it is climatology, and no forecast.
    """

    wind: tuple[Cube, ...]
    gust: tuple[Cube, ...] = ()
    waves: tuple[Cube, ...] = ()
    current: tuple[Cube, ...] = ()
    tides: tuple[Tides, ...] = ()
    notes: tuple[str, ...] = ()
    climate_from_s: float = math.inf

    @property
    def members(self) -> tuple[int, ...]:
        """The members of the wind."""
        return tuple(sorted({m for cube in self.wind for m in cube.members}))

    def base_utc_s(self, utc_s: float) -> float:
        """Return the base time of the run that counts for the wind at a time, or at the nearest that it has."""
        cube = min(self.wind, key=lambda c: float(np.abs(c.utc_s - utc_s).min()))
        return float(cube.base_utc_s[int(np.argmin(np.abs(cube.utc_s - utc_s)))])

    def covers(self, lat_deg: float, lon_deg: float) -> bool:
        """Return whether any of it says something of a place."""
        cubes = (*self.wind, *self.gust, *self.waves, *self.current)
        return any(c.covers(lat_deg, lon_deg) for c in cubes) or any(t.covers(lat_deg, lon_deg) for t in self.tides)

    def mean(self) -> Weather:
        """Return it with one member, 0: the mean of all that know a value. It is weaker than they are."""
        return replace(self, wind=tuple(cube.mean() for cube in self.wind))

    def only(self, member: int) -> Weather:
        """Return it with the wind of one member alone; no value is copied."""
        return replace(self, wind=tuple(cube.only(member) for cube in self.wind if member in cube.members))

    def wind_en_mps(self, utc_s: ArrayLike, lat_deg: ArrayLike, lon_deg: ArrayLike) -> Floats:
        """Return (m, n, 2): the motion of the air at n times and places, by ``members``; NaN where unknown."""
        return _asked(self.wind, self.members, 2, utc_s, lat_deg, lon_deg)

    def wind_over(self, utc_s: Floats, lat_deg: Floats, lon_deg: Floats) -> NDArray[np.float32]:
        """Return (m, t, n, 2): ``wind_en_mps`` at each of t times and n places."""
        members = self.members
        out = np.full((len(members), utc_s.size, lat_deg.size, 2), math.nan, dtype=np.float32)
        for cube in self.wind:
            rows = [members.index(m) for m in cube.members]
            unknown = np.isnan(out[rows])
            if unknown.all():
                out[rows] = cube.over(utc_s, lat_deg, lon_deg)
            elif unknown.any():
                out[rows] = np.where(unknown, cube.over(utc_s, lat_deg, lon_deg), out[rows])
        return out

    def gust_mps(self, utc_s: ArrayLike, lat_deg: ArrayLike, lon_deg: ArrayLike) -> Floats:
        """Return (m, n) of the gusts' own members; NaN where unknown."""
        members = tuple(sorted({m for cube in self.gust for m in cube.members}))
        found: Floats = _asked(self.gust, members, 1, utc_s, lat_deg, lon_deg)[..., 0]
        return found

    def waves_m(self, utc_s: ArrayLike, lat_deg: ArrayLike, lon_deg: ArrayLike) -> Floats:
        """Return (m, n): the significant height of the sea by ``members``; NaN where unknown.

        A member of the wind that has no waves of its own has those of the waves' first.
        """
        own = tuple(sorted({m for cube in self.waves for m in cube.members}))
        found: Floats = _asked(self.waves, own, 1, utc_s, lat_deg, lon_deg)[..., 0]
        return found[[own.index(m) if m in own else 0 for m in self.members]]

    def current_en_mps(self, utc_s: ArrayLike, lat_deg: ArrayLike, lon_deg: ArrayLike) -> Floats:
        """Return (n, 2): the motion of the water, of the first member, and of the tide; NaN where neither is known.

        A current that is told every few hours has the tide in it: there, none is added.
        """
        members = tuple(sorted({m for cube in self.current for m in cube.members}))[:1]
        streams = [tide for tide in self.tides if tide.what == "stream"]
        if not streams and members:
            found: Floats = _asked(self.current, members, 2, utc_s, lat_deg, lon_deg)[0]
            return found
        tide = _first_known(streams, 2, utc_s, lat_deg, lon_deg)
        if not members:
            return tide
        whole, mean = (
            _asked(tuple(c for c in self.current if c.is_tideless is kind), members, 2, utc_s, lat_deg, lon_deg)[0]
            for kind in (False, True)
        )
        both = np.where(np.isnan(mean), tide, mean + np.nan_to_num(tide))
        return np.where(np.isnan(whole), both, whole)

    @property
    def has_current(self) -> bool:
        """Whether it says anything of the motion of the water."""
        return bool(self.current) or any(tide.what == "stream" for tide in self.tides)

    def tide_m(self, utc_s: ArrayLike, lat_deg: ArrayLike, lon_deg: ArrayLike) -> Floats:
        """Return (n,): the height of the tide above the chart's datum; NaN where unknown."""
        found: Floats = _first_known([t for t in self.tides if t.what == "height"], 1, utc_s, lat_deg, lon_deg)[..., 0]
        return found

    def times_between(self, from_s: float, to_s: float) -> Floats:
        """Return the times after one and before another between which wind, waves and streams are linear."""
        known = [cube.utc_s for cube in (*self.wind, *self.waves, *self.current)]
        if any(tide.what == "stream" for tide in self.tides):
            known.append(steps_of(from_s, to_s))
        times = np.unique(np.concatenate(known))
        return times[(times > from_s) & (times < to_s)]

    def why_unknown(self, utc_s: float, lat_deg: float, lon_deg: float) -> str:
        """Return in words why the wind is not known at a time and place; "" where it is for one member at least."""
        if not np.all(np.isnan(self.wind_en_mps(utc_s, lat_deg, lon_deg))):
            return ""
        here = [cube for cube in self.wind if cube.covers(lat_deg, lon_deg)]
        if not here:
            return "outside the area of the forecast"
        if all(utc_s > cube.utc_s[-1] for cube in here):
            return f"after the forecast's end, {iso(max(float(c.utc_s[-1]) for c in here))}"
        if all(utc_s < cube.utc_s[0] for cube in here):
            return f"before the forecast's begin, {iso(min(float(c.utc_s[0]) for c in here))}"
        in_hole = any(begins < utc_s < ends for cube in here for begins, ends in cube.holes_s())
        if in_hole or not any(cube.utc_s[0] <= utc_s <= cube.utc_s[-1] for cube in here):
            return "in a gap of the forecast"
        return "not said by the forecast there"


def _asked(
    cubes: tuple[Cube, ...], members: tuple[int, ...], components: int, utc: ArrayLike, lat: ArrayLike, lon: ArrayLike
) -> Floats:
    shape = np.broadcast(utc, lat, lon).shape
    out = np.full((len(members), *shape, components), math.nan)
    for cube in cubes:
        rows = [members.index(m) for m in cube.members if m in members]
        if not np.isnan(out[rows]).any():
            continue
        found = cube.at(utc, lat, lon)[[m in members for m in cube.members]]
        out[rows] = np.where(np.isnan(out[rows]), found, out[rows])
    return out


def _first_known(tides: list[Tides], components: int, utc: ArrayLike, lat: ArrayLike, lon: ArrayLike) -> Floats:
    """Return what the first that knows a place says: the order is that of the files."""
    out = np.full((*np.broadcast(utc, lat, lon).shape, components), math.nan)
    for tide in tides:
        if np.isnan(out).any():
            out = np.where(np.isnan(out), tide.at(utc, lat, lon), out)
    return out


def iso(utc_s: float) -> str:
    """Return a time as 2026-04-20T06:00Z, to the nearest minute.

    >>> iso(0.0), iso(89.0), iso(91.0)
    ('1970-01-01T00:00Z', '1970-01-01T00:01Z', '1970-01-01T00:02Z')
    """
    return f"{np.datetime64(round(utc_s / 60.0), 'm')}Z"
