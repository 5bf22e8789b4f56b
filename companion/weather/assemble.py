"""Fields become cubes: pairs of components, runs that overlap, members, several grids."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from companion.weather.grib import GribField, Grid, Quantity
from companion.weather.packing import values_of
from companion.weather.weather import Cube, Weather, holes_of
from companion.words import counted

Box = tuple[float, float, float, float]
"""West, south, east, north [deg]; east is above 180 where it lies over the date line."""

MOST_BYTES = 2 << 30  # of a cube, unpacked
# What is more than this is of another unit, or damaged [m/s, m]; the strongest gust measured is 113, the sea 20.
MOST = {Quantity.GUST: 130.0, Quantity.WAVES: 40.0, Quantity.CURRENT_EAST: 10.0, Quantity.CURRENT_NORTH: 10.0}
MOST_WIND_MPS = 110.0
_ALONE = {Quantity.GUST: "gust", Quantity.WAVES: "waves"}
_PARTNER = {
    Quantity.WIND_EAST: Quantity.WIND_NORTH,
    Quantity.WIND_NORTH: Quantity.WIND_EAST,
    Quantity.CURRENT_EAST: Quantity.CURRENT_NORTH,
    Quantity.CURRENT_NORTH: Quantity.CURRENT_EAST,
}
_Key = tuple[float, float, int]  # base time, valid time, member


def assemble(fields: Iterable[GribField], box: Box | None = None, *, most_bytes: int = MOST_BYTES) -> Weather:
    """Return what fields say, within ``box`` and a cell beyond it. Raises InputError naming file and message."""
    used: dict[tuple[Quantity, Grid], dict[_Key, GribField]] = defaultdict(dict)
    other: Counter[str] = Counter()
    twice: Counter[str] = Counter()
    for field in fields:
        if field.quantity is None or field.grid is None:
            other[field.title] += 1
            continue
        place = used[field.quantity, field.grid]
        key = (field.base_utc_s, field.valid_utc_s, field.member)
        twice[field.title] += key in place
        place[key] = field
    cubes: dict[str, list[Cube | None]] = {"wind": [], "gust": [], "waves": [], "current": []}
    for (quantity, grid), found in used.items():
        if quantity in _ALONE:
            cubes[_ALONE[quantity]].append(_cube(grid, [found], box, most_bytes))
            continue
        pair = [used.get((q, grid), {}) for q in sorted((quantity, _PARTNER[quantity]), key=lambda q: q.value)]
        _all_paired(pair)
        if quantity.value.endswith("east"):
            cubes[quantity.value.split()[0]].append(_cube(grid, pair, box, most_bytes))
    notes = [f"not used: {title}, {n} of them" if n > 1 else f"not used: {title}" for title, n in other.most_common()]
    notes += [f"{title}: {counted(n, 'field')} came twice, the last counts" for title, n in twice.items() if n]
    sort = {k: tuple(sorted((c for c in v if c is not None), key=lambda c: c.cell_deg2)) for k, v in cubes.items()}
    return Weather(
        wind=sort["wind"], gust=sort["gust"], waves=sort["waves"], current=sort["current"], notes=tuple(notes)
    )


def _all_paired(pair: list[dict[_Key, GribField]]) -> None:
    for one, two in (pair, pair[::-1]):
        for key, field in one.items():
            if key not in two and field.quantity is not None:
                raise field.refused(
                    f"is {field.title} without its {_PARTNER[field.quantity].value}", "fetch both components"
                )


def _chosen(times: dict[float, list[float]]) -> dict[float, float]:
    """Return by valid time the base time of the run that counts, of the valid times of each run.

    The newest counts, an older one before it, after it and in its holes. One run is never laced into another's steps.
    """
    out: dict[float, float] = {}
    for base in sorted(times, reverse=True):
        if not out:
            out = dict.fromkeys(times[base], base)
            continue
        kept = np.array(sorted(out))
        holes = holes_of(kept)
        for t in times[base]:
            if t < kept[0] or t > kept[-1] or any(begins < t < ends for begins, ends in holes):
                out[t] = base
    return out


def _cube(grid: Grid, found: list[dict[_Key, GribField]], box: Box | None, most_bytes: int) -> Cube | None:
    """Return the cube of a grid's fields, one dictionary for each component; None where nothing is in the box."""
    times: dict[float, list[float]] = defaultdict(list)
    for base, valid, _ in sorted(found[0]):
        if valid not in times[base][-1:]:
            times[base].append(valid)
    chosen = _chosen(times)
    utc = sorted(chosen)
    members = sorted({m for base, valid, m in found[0] if chosen.get(valid) == base})
    rows, columns, lon_deg = _part(grid, box)
    if not (rows.size and columns.size):
        return None
    shape = (len(members), len(utc), rows.size, columns.size, len(found))
    first = next(iter(found[0].values()))
    if 4 * int(np.prod(shape)) > most_bytes:
        said = f"and {len(found[0])} others are {4 * int(np.prod(shape)) / 2**30:.1f} GB unpacked"
        raise first.refused(said, "say a smaller area (--box), or give fewer files")
    values = np.full(shape, np.nan, dtype=np.float32)
    interval_s = 0.0
    for k, fields in enumerate(found):
        for t, valid in enumerate(utc):
            for m, member in enumerate(members):
                field = fields.get((chosen[valid], valid, member))
                if field is not None:
                    values[m, t, :, :, k] = _believed(field)[np.ix_(rows, columns)]
                    interval_s = max(interval_s, field.interval_s)
    return Cube(
        utc_s=np.array(utc),
        base_utc_s=np.array([chosen[t] for t in utc]),
        members=tuple(members),
        lat_deg=grid.latitudes_deg()[rows],
        lon_deg=lon_deg,
        values=values,
        interval_s=interval_s,
        sources=tuple(dict.fromkeys(field.source for field in found[0].values())),
    )


def _believed(field: GribField) -> NDArray[np.float32]:
    """Return the values of a field. Raises InputError where they are none of what it says."""
    assert field.quantity is not None
    values = values_of(field)
    most = float(np.nanmax(np.abs(values), initial=0.0))
    if most > MOST.get(field.quantity, MOST_WIND_MPS):
        unit = "m" if field.quantity is Quantity.WAVES else "m/s"
        raise field.refused(
            f"{field.quantity.value} is up to {most:.4g} {unit}", "it is of another unit, or damaged: fetch it again"
        )
    if np.nanmin(values, initial=0.0) < 0.0 and field.quantity in _ALONE:
        raise field.refused(
            f"{field.quantity.value} is below zero", "it is of another unit, or damaged: fetch it again"
        )
    return values


def _part(grid: Grid, box: Box | None) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64]]:
    """Return the rows and columns of a grid in a box and a cell beyond it, and their longitudes."""
    lat, lon = grid.latitudes_deg(), grid.longitudes_deg()
    tall, wide = lat[1] - lat[0], lon[1] - lon[0]
    is_round = lon[-1] - lon[0] + wide > 360.0 - 1e-3
    columns = np.arange(lon.size)
    if is_round and lon[-1] - lon[0] > 360.0 - 1e-3:  # the first meridian stands twice
        columns = columns[:-1]
    if box is None:
        return np.arange(lat.size), columns, lon[columns]
    west, south, east, north = box
    rows = np.flatnonzero((lat >= south - tall) & (lat <= north + tall))
    past = np.mod(lon[columns] - west, 360.0)
    past = np.where(past >= 360.0 - wide - 1e-9, past - 360.0, past)
    inside = np.flatnonzero(past <= east - west + wide)
    order = inside[np.argsort(past[inside])]
    if order.size > 1 and np.diff(past[order]).max() > 1.5 * wide:  # the box spans where the grid has nothing
        return rows, columns, lon[columns]
    return rows, columns[order], west + past[order]
