"""Tides over the water: harmonic constants at stations or on the grid of an atlas, their heights and streams.

Prediction is linear in the constants, so what stations say at a time is interpolated, which is the same as their
constants interpolated as complex numbers: phases that meet at 360 degrees, or go round an amphidrome, are no trouble.
"""

from __future__ import annotations

import difflib
import math
import re
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Annotated, Any

import msgspec
import numpy as np
from msgspec import Meta, Struct
from numpy.typing import ArrayLike, NDArray

from companion.errors import InputError, not_toml
from companion.geo import EARTH_RADIUS_M
from companion.weather.harmonics import KNOWN, Complexes, Floats, constituent_named, phasors
from companion.words import expected

STEP_S = 1800.0  # where a tide is sampled to be interpolated in time: of half a day's wave it loses 0.8 % at the most
LONG_STEP_S = 3600.0  # beyond LONG_S: 3 %
LONG_S = 5.0 * 86_400.0
_CHUNK = 1024  # places at a time
_KEPT = 8  # sets of places whose weights are kept: a grid is asked for each time again


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Tides:
    """Harmonic constants over the water. Raises ValueError where they do not fit.

    Attributes:
        what: "height" above the chart's datum [m], or "stream" towards east and north [m/s].
        names: the constituents, as ``constituent_named`` has them.
        lat_deg, lon_deg: (s,) of stations; with ``shape`` (rows, columns) the grid's, row by row, ascending both.
        constants: (s, c, k) ``A exp(-i g)``, NaN where unknown; k is 1 of a height and 2 of a stream.
        mean: (s, k): Z0.
        reach_m: a station says nothing of what is farther away; of a grid 0.
    """

    what: str
    names: tuple[str, ...]
    lat_deg: Floats
    lon_deg: Floats
    constants: Complexes
    mean: Floats
    source: str
    reach_m: float = 0.0
    shape: tuple[int, int] | None = None
    _kept: dict[bytes, tuple[NDArray[np.int64], Floats]] = field(default_factory=dict, repr=False)

    def __post_init__(self) -> None:
        components = {"height": 1, "stream": 2}[self.what]
        places = self.lat_deg.size
        if self.constants.shape != (places, len(self.names), components) or self.mean.shape != (places, components):
            raise ValueError(
                f"constants of {self.constants.shape} are not of {places} places and {len(self.names)} waves"
            )
        if self.shape is not None and self.shape[0] * self.shape[1] != places:
            raise ValueError("a grid has rows times columns places")

    def at(self, utc_s: ArrayLike, lat_deg: ArrayLike, lon_deg: ArrayLike) -> Floats:
        """Return (..., k) at times and places; NaN where no station reaches, or a node beside it is unknown."""
        utc, lat, lon = (np.asarray(a, dtype=np.float64) for a in np.broadcast_arrays(utc_s, lat_deg, lon_deg))
        form = utc.shape
        times, when = np.unique(utc.ravel(), return_inverse=True)
        # Of the same places over many times, and of many places at one time, each is looked for once.
        places, where = np.unique(np.stack([lat.ravel(), lon.ravel()]), axis=1, return_inverse=True)
        nodes, weights = self._weights(places[0], places[1])
        k = self.constants.shape[2]
        used, nodes = np.unique(nodes, return_inverse=True)
        nodes = nodes.reshape(weights.shape)
        wave = phasors(self.names, times)
        table = np.einsum("tc,sck->tsk", wave, self.constants[used], optimize=True).real + self.mean[used]
        out = np.zeros((utc.size, k))
        where = where.ravel()
        for column in range(weights.shape[1]):
            share = weights[where, column]
            out += np.where(share[:, None] != 0.0, share[:, None] * table[when.ravel(), nodes[where, column]], 0.0)
        out[weights[where].sum(axis=1) < 0.5] = math.nan
        return out.reshape(*form, k)

    def covers(self, lat_deg: float, lon_deg: float) -> bool:
        """Return whether it says something of a place."""
        found = self.at(0.0, lat_deg, lon_deg)
        return not bool(np.isnan(found).any())

    def _weights(self, lat: Floats, lon: Floats) -> tuple[NDArray[np.int64], Floats]:
        """Return nodes and their shares (n, m) that make each place; shares of 0 where it is unknown."""
        key = lat.tobytes() + lon.tobytes()
        if key not in self._kept:
            if len(self._kept) >= _KEPT:
                self._kept.clear()
            self._kept[key] = self._on_grid(lat, lon) if self.shape is not None else self._by_reach(lat, lon)
        return self._kept[key]

    def _on_grid(self, lat: Floats, lon: Floats) -> tuple[NDArray[np.int64], Floats]:
        assert self.shape is not None
        rows: Floats = self.lat_deg.reshape(self.shape)[:, 0]
        columns: Floats = self.lon_deg.reshape(self.shape)[0]
        past = columns[0] + np.mod(lon - columns[0] + 1e-9, 360.0) - 1e-9
        wide = columns[1] - columns[0]
        if columns[-1] - columns[0] + wide > 360.0 - 1e-3:  # all round
            columns = np.append(columns, columns[0] + 360.0)
        y = np.clip(np.searchsorted(rows, lat, side="right") - 1, 0, rows.size - 2)
        x = np.clip(np.searchsorted(columns, past, side="right") - 1, 0, columns.size - 2)
        fy, fx = (lat - rows[y]) / (rows[y + 1] - rows[y]), (past - columns[x]) / (columns[x + 1] - columns[x])
        inside: NDArray[np.bool_] = (fy > -1e-6) & (fy < 1.0 + 1e-6) & (fx > -1e-6) & (fx < 1.0 + 1e-6)
        width = self.shape[1]
        nodes = np.stack([(y + dy) * width + (x + dx) % width for dy in (0, 1) for dx in (0, 1)], axis=-1)
        shares = np.stack([a * b for a in (1.0 - fy, fy) for b in (1.0 - fx, fx)], axis=-1)
        shares[np.abs(shares) < 1e-9] = 0.0
        known = ~np.isnan(np.abs(self.constants).sum(axis=(1, 2)) + self.mean.sum(axis=1))
        whole = np.logical_and(inside, (known[nodes] | (shares == 0.0)).min(axis=1))
        return nodes, np.where(whole[:, None], shares, 0.0)

    def _by_reach(self, lat: Floats, lon: Floats) -> tuple[NDArray[np.int64], Floats]:
        """Weigh stations by ((R - d) / d)², after Franke and Little: continuous, theirs at a station, none beyond R."""
        here = _up(self.lat_deg, self.lon_deg)
        shares = np.zeros((lat.size, self.lat_deg.size))
        for begin in range(0, lat.size, _CHUNK):
            part = slice(begin, begin + _CHUNK)
            chord = np.linalg.norm(_up(lat[part], lon[part])[:, None] - here, axis=-1)
            far = EARTH_RADIUS_M * 2.0 * np.arcsin(np.minimum(1.0, 0.5 * chord))
            weight = (np.maximum(0.0, self.reach_m - far) / np.maximum(far, 0.01)) ** 2
            total = weight.sum(axis=1, keepdims=True)
            shares[part] = np.divide(weight, total, out=np.zeros_like(weight), where=total > 0.0)
        most = max(1, int((shares > 0.0).sum(axis=1).max(initial=0)))
        nodes = np.argsort(-shares, axis=1)[:, :most]
        return nodes, np.take_along_axis(shares, nodes, axis=1)


def _up(lat_deg: Floats, lon_deg: Floats) -> Floats:
    lat, lon = np.radians(lat_deg), np.radians(lon_deg)
    out: Floats = np.stack([np.cos(lat) * np.cos(lon), np.cos(lat) * np.sin(lon), np.sin(lat)], axis=-1)
    return out


def steps_of(from_s: float, to_s: float) -> Floats:
    """Return the times between two at which a tide is sampled, to be interpolated between them."""
    step = STEP_S if to_s - from_s <= LONG_S else LONG_STEP_S
    return step * np.arange(math.ceil(from_s / step), math.floor(to_s / step) + 1.0)


_Wave = tuple[Annotated[float, Meta(ge=0.0, le=20.0)], Annotated[float, Meta(ge=-360.0, le=360.0)]]


class _Stream(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """``[[station.stream]]``: one component of a stream, positive towards a direction."""

    towards_deg: Annotated[float, Meta(ge=0.0, le=360.0)]
    mean_mps: Annotated[float, Meta(ge=-10.0, le=10.0)] = 0.0
    waves: dict[str, _Wave]


class _Height(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """``[station.height]``: above the chart's datum."""

    mean_m: Annotated[float, Meta(ge=-20.0, le=20.0)] = 0.0
    waves: dict[str, _Wave]


class _Station(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    name: str
    lat: Annotated[float, Meta(ge=-90.0, le=90.0)]
    lon: Annotated[float, Meta(ge=-180.0, le=360.0)]
    height: _Height | None = None
    stream: tuple[_Stream, ...] = ()


class _File(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    reach_km: Annotated[float, Meta(gt=0.0, le=1000.0)] = 20.0
    station: Annotated[tuple[_Station, ...], Meta(min_length=1)]


def _named(place: str, data: Any) -> str:
    """Return a place of msgspec's with the constituent, which it leaves out: ``waves[...]``."""
    head, dots, tail = place.partition("[...]")
    if not dots:
        return place
    for part in re.findall(r"[^.\[\]]+", head):
        data = data[int(part)] if part.isdigit() else data[part]
    for name, wave in data.items():
        try:
            msgspec.convert(wave, _Wave)
        except msgspec.ValidationError:
            return f"{head}.{name}{tail}"
    return place


def read_stations(text: str, source: str) -> tuple[Tides, ...]:
    """Return the heights and streams of a TOML text of stations. Raises InputError: station, key, remedy."""
    data: dict[str, Any] = {}
    try:
        data = tomllib.loads(text)
        raw = msgspec.convert(data, _File)
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        raise not_toml(source, text, error) from None
    except msgspec.ValidationError as error:
        problem, _, place = str(error).partition(" - at `$.")
        named = _named(place.rstrip("`"), data)
        raise InputError(source, named, expected(problem), "see docs/reference/formats.md") from None
    out = []
    heights = [(s, [(None, s.height.mean_m, s.height.waves)]) for s in raw.station if s.height is not None]
    streams = [(s, [(r.towards_deg, r.mean_mps, r.waves) for r in s.stream]) for s in raw.station if s.stream]
    for what, found in (("height", heights), ("stream", streams)):
        if found:
            out.append(_of_stations(what, found, raw.reach_km, source))
    if not out:
        raise InputError(source, "[[station]]", "none has a height or a stream", "write [station.height] waves")
    return tuple(out)


_Part = tuple[float | None, float, dict[str, _Wave]]


def _of_stations(what: str, found: Sequence[tuple[_Station, Sequence[_Part]]], reach_km: float, source: str) -> Tides:
    names: dict[str, int] = {}
    for station, parts in found:
        for _, _, waves in parts:
            for name in waves:
                names.setdefault(_known(name, station.name, source), len(names))
    k = 1 if what == "height" else 2
    constants = np.zeros((len(found), len(names), k), dtype=np.complex128)
    mean = np.zeros((len(found), k))
    for row, (_, parts) in enumerate(found):
        for towards_deg, level, waves in parts:
            towards = 0.0 if towards_deg is None else math.radians(towards_deg)
            along = np.array([1.0]) if towards_deg is None else np.array([math.sin(towards), math.cos(towards)])
            mean[row] += level * along
            for name, (amplitude, lag_deg) in waves.items():
                column = names[constituent_named(name) or ""]
                constants[row, column] += amplitude * np.exp(-1j * math.radians(lag_deg)) * along
    return Tides(
        what=what,
        names=tuple(names),
        lat_deg=np.array([s.lat for s, _ in found]),
        lon_deg=np.array([s.lon for s, _ in found]),
        constants=constants,
        mean=mean,
        source=source,
        reach_m=1000.0 * reach_km,
    )


def _known(name: str, station: str, source: str) -> str:
    known = constituent_named(name)
    if known is None:
        near = difflib.get_close_matches(name.upper(), KNOWN, n=1, cutoff=0.5)
        remedy = f"did you mean {near[0]}?" if near else "leave it out: known are " + " ".join(KNOWN)
        raise InputError(source, f"station {station!r}", f"{name!r} is no constituent that is known here", remedy)
    return known
