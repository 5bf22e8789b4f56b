"""Currents, winds and tidal atlases of netCDF and Zarr: variables by their CF names, on grids of degrees.

What a container holds is handed in as ``Stored`` variables; files are opened in ``readers``.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import PurePath

import numpy as np
from numpy.typing import NDArray

from companion.errors import InputError
from companion.weather.assemble import MOST_BYTES, MOST_WIND_MPS, Box
from companion.weather.harmonics import Floats, constituent_named
from companion.weather.tides import Tides
from companion.weather.weather import MOST_STEP_S, Cube

MOST_CURRENT_MPS = 10.0
CURRENT_STEP_S = 30 * 3600.0  # means of a day are told a day apart
_PAIRS = {
    "current": (
        ("eastward_sea_water_velocity", "surface_eastward_sea_water_velocity", "uo", "water_u", "utotal"),
        ("northward_sea_water_velocity", "surface_northward_sea_water_velocity", "vo", "water_v", "vtotal"),
    ),
    "wind": (("eastward_wind", "u10", "10u"), ("northward_wind", "v10", "10v")),
}
_SPEEDS = {"m s-1": 1.0, "m/s": 1.0, "m s**-1": 1.0, "m.s-1": 1.0, "meter second-1": 1.0, "cm/s": 0.01, "cm s-1": 0.01}
_SPEEDS |= {"cm.s-1": 0.01, "meters/second": 1.0, "m s^-1": 1.0}
_LENGTHS = {"m": 1.0, "meter": 1.0, "meters": 1.0, "cm": 0.01}
_MEMBERS = {"member", "number", "realization", "ensemble"}
_SECONDS = {"second": 1.0, "minute": 60.0, "hour": 3600.0, "day": 86_400.0}
# A date, perhaps an hour of it, and what zone they are of, as UDUNITS has it: 2026-12-01 00:00:00 +11:00
_MOMENT = re.compile(
    r"(\d{1,4})-(\d{1,2})-(\d{1,2})(?:(?:t|\s+)(\d{1,2}):(\d{1,2})(?::(\d{1,2})(?:\.\d*)?)?)?"
    r"\s*(z|utc|gmt|[+-]\d{1,2}(?::?\d\d)?)?"
)
_MOST_UTC_S = 253_402_300_800.0  # the year 10000
_CALENDARS = {"", "standard", "gregorian", "proleptic_gregorian"}
# Amplitude and phase, as the atlases FES2014 and FES2022 name them, of heights and of streams; one file a constituent.
_ATLAS = (("amplitude", "phase"), ("Ua", "Ug"), ("Va", "Vg"))


@dataclass(frozen=True, slots=True, kw_only=True)
class Stored:
    """A variable of a container: its dimensions, attributes as text or number, and how a part of it is read."""

    source: str
    name: str
    dims: tuple[str, ...]
    shape: tuple[int, ...]
    attrs: Mapping[str, str | float]
    read: Callable[[tuple[slice, ...]], object]

    def said(self, key: str) -> str:
        """Return an attribute as text; "" where there is none."""
        return str(self.attrs.get(key, "")).strip()

    def values(self, part: Sequence[slice] | None = None) -> Floats:
        """Return its values, or a part of them: unpacked, NaN where they are missing. Raises InputError: damaged."""
        try:
            raw = np.asarray(self.read(tuple(part or (slice(None),) * len(self.shape))), dtype=np.float64)
        except (OSError, ValueError, RuntimeError, TypeError) as error:  # parts are read and unpacked when asked for
            text = f"cannot be read ({str(error)[:60]})"
            raise InputError(self.source, self.name, text, "it is damaged: fetch it again") from None
        for key in ("_FillValue", "missing_value"):
            if isinstance(self.attrs.get(key), float):
                raw = np.where(raw == self.attrs[key], np.nan, raw)
        scale, offset = (self.attrs.get(k, v) for k, v in (("scale_factor", 1.0), ("add_offset", 0.0)))
        return raw * float(scale) + float(offset)


Container = Mapping[str, Stored]


def cubes_of(container: Container, source: str, box: Box | None = None) -> dict[str, Cube]:
    """Return wind and current of a container, within ``box`` and a cell beyond. Raises InputError naming variables."""
    out = {}
    for kind, names in _PAIRS.items():
        pair = [_found(container, each) for each in names]
        if pair == [None, None]:
            continue
        lone = next((v for v in pair if v is not None), None)
        if lone is not None and None in pair:
            raise InputError(source, lone.name, "is there without its other component", "fetch both components")
        cube = _cube([v for v in pair if v is not None], container, source, kind, box)
        if cube is not None:
            out[kind] = cube
    return out


def _found(container: Container, names: Sequence[str]) -> Stored | None:
    for name in names:
        for variable in container.values():
            if name in {variable.name, variable.said("standard_name")} and len(variable.shape) > 2:
                return variable
    return None


def _axis(container: Container, dims: Sequence[str], what: str, units: str) -> Stored | None:
    for variable in container.values():
        is_it = variable.said("standard_name") == what or variable.said("units").lower().startswith(units)
        if is_it and len(variable.shape) == 1 and variable.dims[0] in dims:
            return variable
    return None


def _ascending(axis: Stored, values: Floats) -> None:
    """Raise InputError where an axis does not stand for different numbers in order."""
    text = "" if np.isfinite(values).all() else "has values that are no numbers"
    if not text and (np.diff(np.sort(values)) <= 0.0).any():
        text = "has the same value twice"
    if text:
        raise InputError(axis.source, axis.name, text, "it is damaged: fetch it again")


def _axes(variable: Stored, container: Container, source: str) -> tuple[Stored, Stored]:
    lat = _axis(container, variable.dims, "latitude", "degrees_n")
    lon = _axis(container, variable.dims, "longitude", "degrees_e")
    if lat is None or lon is None:
        raise InputError(
            source,
            variable.name,
            "is on no grid of latitudes and longitudes",
            "interpolate it to one (cdo remapbil), or take a product that is on one",
        )
    _ascending(lat, lat.values())
    _ascending(lon, lon.values())
    return lat, lon


def _cube(pair: Sequence[Stored], container: Container, source: str, kind: str, box: Box | None) -> Cube | None:
    variable = pair[0]
    if pair[1].dims != variable.dims or pair[1].shape != variable.shape:
        raise InputError(source, pair[1].name, f"is not on the grid of {variable.name}", "fetch both of one product")
    lat, lon = _axes(variable, container, source)
    times = _axis(container, variable.dims, "time", "\0") or next(
        (v for v in container.values() if " since " in v.said("units") and v.dims[:1] and v.dims[0] in variable.dims),
        None,
    )
    if times is None:
        raise InputError(source, variable.name, "has no times", "fetch it with its time")
    utc = _unix_s(times, source)
    order_t = np.argsort(utc)
    rows, columns, lon_deg = _part(lat.values(), lon.values(), box)
    if not (rows.size and columns.size):
        return None
    size = utc.size * rows.size * columns.size
    members = 1
    cut: dict[str, slice] = {}
    for dim, count in zip(variable.dims, variable.shape, strict=True):
        if dim in {lat.dims[0], lon.dims[0], times.dims[0]}:
            cut[dim] = slice(None)
        elif dim in _MEMBERS:
            cut[dim], members = slice(None), count
        elif count == 1:
            cut[dim] = slice(0, 1)
        elif dim in container and container[dim].said("units").lower() in {"m", "meters", "meter"}:
            top = int(np.argmin(np.abs(container[dim].values())))  # of depths the uppermost
            cut[dim] = slice(top, top + 1)
        else:
            raise InputError(source, variable.name, f"has a dimension {dim!r} of {count}", "fetch one value of it")
    if 8 * size * members > MOST_BYTES:
        raise InputError(source, variable.name, "is more than 2 GB unpacked", "say a smaller area (--box)")
    near = {lat.dims[0]: rows, lon.dims[0]: columns}
    for dim, index in near.items():
        cut[dim] = slice(int(index.min()), int(index.max()) + 1)
    wanted = [d for d in variable.dims if d in _MEMBERS] + [times.dims[0], lat.dims[0], lon.dims[0]]
    values = np.empty((members, utc.size, rows.size, columns.size, 2), dtype=np.float32)
    for k, part in enumerate(pair):
        table = part.values([cut[d] for d in variable.dims]) * _scale(part, _SPEEDS, source)
        spare = tuple(i for i, d in enumerate(variable.dims) if d not in wanted)
        left = [d for d in variable.dims if d in wanted]
        table = np.transpose(table.squeeze(axis=spare), [left.index(d) for d in wanted])
        table = table[..., order_t, :, :][..., rows - rows.min(), :][..., columns - columns.min()]
        most = float(np.nanmax(np.abs(table), initial=0.0))
        if most > (MOST_CURRENT_MPS if kind == "current" else MOST_WIND_MPS):
            raise InputError(
                source, part.name, f"is up to {most:.4g} m/s", "it is of another unit, or damaged: fetch it again"
            )
        values[..., k] = table
    return Cube(
        utc_s=utc[order_t],
        base_utc_s=np.full(utc.size, utc.min()),
        members=tuple(range(members)),
        lat_deg=lat.values()[rows],
        lon_deg=lon_deg,
        values=values,
        most_step_s=CURRENT_STEP_S if kind == "current" else MOST_STEP_S,
        sources=(source,),
    )


def _scale(variable: Stored, units: Mapping[str, float], source: str) -> float:
    said = variable.said("units")
    if said not in units:
        raise InputError(source, variable.name, f"is in {said or 'no unit'!r}", "fetch it in " + " or ".join(units))
    return units[said]


def _unix_s(times: Stored, source: str) -> Floats:
    found = re.match(r"(second|minute|hour|day)s? since (\S+)(.*)", times.said("units").lower())
    if found is None or times.said("calendar").lower() not in _CALENDARS:
        said = f"{times.said('units')}, {times.said('calendar')}".strip(", ")
        raise InputError(
            source, times.name, f"is in {said!r}", "write hours since 1970-01-01, of the standard calendar"
        )
    since = f"{found[2]}{found[3]}"
    begins_s = _moment_s(since)
    if begins_s is None:
        raise InputError(
            source, times.name, f"counts from {since!r}, which is no date", "write 1970-01-01 or 1970-01-01 00:00:00"
        )
    utc_s = begins_s + _SECONDS[found[1]] * times.values()
    _ascending(times, utc_s)
    if utc_s.size and not 0.0 <= utc_s.min() <= utc_s.max() < _MOST_UTC_S:
        raise InputError(source, times.name, "has times that no forecast has", "it is damaged: fetch it again")
    return utc_s


def _moment_s(text: str) -> float | None:
    """Return the Unix time [s] of a date, perhaps with an hour and a zone; None: it is none."""
    found = re.fullmatch(_MOMENT, text)
    if found is None:
        return None
    month, day, hour, minute, second = (int(found[k] or 0) for k in range(2, 7))
    said = f"{int(found[1]):04}-{month:02}-{day:02}T{hour:02}:{minute:02}:{second:02}"
    try:
        return float(np.datetime64(said, "s").astype(np.int64)) - _zone_s(found[7] or "")
    except ValueError:
        return None


def _zone_s(text: str) -> float:
    """Return how far a zone is ahead of UTC [s]. Raises ValueError: there is none such."""
    if not text.startswith(("+", "-")):
        return 0.0
    digits = text[1:].replace(":", "")
    hours, minutes = (int(digits), 0) if len(digits) < 3 else (int(digits[:-2]), int(digits[-2:]))
    if hours > 14 or minutes > 59:
        raise ValueError(text)
    return (-1.0 if text[0] == "-" else 1.0) * (3600.0 * hours + 60.0 * minutes)


def _part(lat: Floats, lon: Floats, box: Box | None) -> tuple[NDArray[np.int64], NDArray[np.int64], Floats]:
    """Return rows and columns, both ascending, in a box and a cell beyond it, and the longitudes of the columns."""
    tall, wide = (float(np.abs(np.diff(axis)).max(initial=0.0)) % 360.0 for axis in (lat, lon))
    west, south, east, north = box or (_first_deg(lon), -90.0, _first_deg(lon) + 360.0, 90.0)
    wide = min(wide, 5.0)
    rows = np.argsort(lat)
    rows = rows[(lat[rows] >= south - tall) & (lat[rows] <= north + tall)]
    past = np.mod(lon - west, 360.0)
    past = np.where(past >= 360.0 - wide - 1e-9, past - 360.0, past) if box is not None else past
    columns = np.argsort(past)
    columns = columns[past[columns] <= east - west + wide]
    _, first = np.unique(np.round(past[columns], 6), return_index=True)  # the first meridian may stand twice
    columns = columns[first]
    return rows, columns, west + past[columns]


def _first_deg(lon: Floats) -> float:
    """Return the longitude where a grid begins, going east: behind the widest gap between its meridians.

    A file of the waters on both sides of the date line may have them from -180 to 180, and those are neighbours.
    """
    past = np.unique(np.mod(np.round(lon - lon[0], 6), 360.0))
    gaps = np.diff(past, append=360.0)
    is_even = gaps.max() < 1.5 * gaps.min()  # all round the earth
    return float(lon[0] + (0.0 if is_even else past[(int(np.argmax(gaps)) + 1) % past.size]))


def merged(cubes: Sequence[Cube]) -> tuple[Cube, ...]:
    """Return cubes, those of one grid as one: of a time that several have, the last one's."""
    out: list[Cube] = []
    for cube in cubes:
        same = next(
            (
                k
                for k, other in enumerate(out)
                if other.members == cube.members
                and np.array_equal(other.lat_deg, cube.lat_deg)
                and np.array_equal(other.lon_deg, cube.lon_deg)
            ),
            None,
        )
        if same is None:
            out.append(cube)
            continue
        other = out[same]
        kept = ~np.isin(other.utc_s, cube.utc_s)
        order = np.argsort(np.concatenate([other.utc_s[kept], cube.utc_s]))
        out[same] = replace(
            cube,
            utc_s=np.concatenate([other.utc_s[kept], cube.utc_s])[order],
            base_utc_s=np.concatenate([other.base_utc_s[kept], cube.base_utc_s])[order],
            values=np.concatenate([other.values[:, kept], cube.values], axis=1)[:, order],
            sources=(*other.sources, *cube.sources),
        )
    return tuple(out)


def is_atlas(container: Container) -> bool:
    """Return whether it has amplitudes and phases of a constituent."""
    return any(a in container and g in container for a, g in _ATLAS)


def atlas_of(containers: Sequence[tuple[Container, str]]) -> tuple[Tides, ...]:
    """Return the tides of an atlas: files of one constituent each, named by it (``m2.nc``). Raises InputError."""
    grids: dict[str, tuple[Floats, Floats]] = {}
    found: dict[str, dict[str, list[NDArray[np.complex128]]]] = {"height": {}, "stream": {}}
    where: dict[str, str] = {}
    for container, source in containers:
        stem = PurePath(source).stem
        name = constituent_named(re.split(r"[_.-]", stem)[0]) or constituent_named(re.split(r"[_.-]", stem)[-1])
        if name is None:
            raise InputError(source, "", "is not named by its constituent", "name it as m2.nc")
        for kind, pairs in (("height", _ATLAS[:1]), ("stream", _ATLAS[1:])):
            if not all(a in container and g in container for a, g in pairs):
                continue
            first = container[pairs[0][0]]
            lat, lon = _axes(first, container, source)
            rows, columns, lon_deg = _part(lat.values(), lon.values(), None)
            grid = (lat.values()[rows], lon_deg)
            if min(rows.size, columns.size) < 2:
                text = f"is a grid of {rows.size} x {columns.size}: no place lies between its points"
                raise InputError(source, first.name, text, "cut a wider piece of the atlas")
            here = grids.setdefault(kind, grid)
            if not (np.array_equal(here[0], grid[0]) and np.array_equal(here[1], grid[1])):
                raise InputError(source, first.name, f"is not on the grid of {where[kind]}", "take files of one atlas")
            where.setdefault(kind, source)
            units = _LENGTHS if kind == "height" else _SPEEDS
            waves: list[NDArray[np.complex128]] = []
            for a, g in pairs:
                if container[a].dims != (lat.dims[0], lon.dims[0]) or container[g].dims != container[a].dims:
                    raise InputError(source, a, "is not by latitude and longitude", "fetch it so")
                size = _scale(container[a], units, source) * container[a].values()
                wave = size * np.exp(-1j * np.radians(container[g].values()))
                waves.append(np.asarray(wave[np.ix_(rows, columns)].ravel(), dtype=np.complex128))
            found[kind][name] = waves
    out = []
    for kind, by_name in found.items():
        if not by_name:
            continue
        lat_deg, lon_deg = grids[kind]
        y, x = np.meshgrid(lat_deg, lon_deg, indexing="ij")
        constants = np.stack([np.stack(waves, axis=-1) for waves in by_name.values()], axis=1)
        out.append(
            Tides(
                what=kind,
                names=tuple(by_name),
                lat_deg=y.ravel(),
                lon_deg=x.ravel(),
                constants=constants,
                mean=np.zeros((y.size, constants.shape[2])),
                source=where[kind],
                shape=(lat_deg.size, lon_deg.size),
            )
        )
    return tuple(out)
