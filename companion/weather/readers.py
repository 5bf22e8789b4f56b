"""Forecast files, opened: the only place of this room where there are files."""

from __future__ import annotations

import io
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from companion.disk import read_regular
from companion.errors import InputError, unreadable
from companion.weather.assemble import Box, assemble
from companion.weather.grib import GribField, walk
from companion.weather.gridded import Stored, atlas_of, cubes_of, is_atlas, merged
from companion.weather.tides import Tides, read_stations
from companion.weather.weather import Cube, Weather

MOST_FILE_BYTES = 1 << 30


def read_weather(paths: Sequence[Path], box: Box | None = None) -> Weather:
    """Return the weather of files, within a box and a cell beyond it. Raises InputError: file, message, remedy.

    What ends in .toml are stations of the tide, in .nc netCDF, and folders or files that end in .zarr or .zip are Zarr;
    all else is GRIB. Raises ModuleNotFoundError where the extra ``currents`` is not installed and one is asked for.
    """
    stations = [path for path in paths if path.suffix.lower() == ".toml"]
    tides = [tide for path in stations for tide in read_tides(path)]
    kept = [(_opened(path), str(path)) for path in paths if path not in stations and _is_gridded(path)]
    tides += atlas_of([(found, name) for found, name in kept if is_atlas(found)])
    cubes: dict[str, list[Cube]] = {"wind": [], "current": []}
    for found, name in kept:
        if is_atlas(found):
            continue
        held = cubes_of(found, name, box)
        for kind, cube in held.items():
            cubes[kind].append(cube)
        if not held and box is None:
            raise InputError(
                name, "", "holds no current and no wind: " + ", ".join(found), "fetch eastward and northward components"
            )
    said = assemble(_fields([path for path in paths if path not in stations and not _is_gridded(path)]), box)
    wind, current = (
        tuple(sorted((*own, *merged(cubes[kind])), key=lambda c: c.cell_deg2))
        for kind, own in (("wind", said.wind), ("current", said.current))
    )
    return replace(said, wind=wind, current=current, tides=tuple(tides))


def _is_gridded(path: Path) -> bool:
    return path.suffix.lower() in {".nc", ".nc4", ".zarr", ".zip"}


def _opened(path: Path) -> dict[str, Stored]:
    """Return the variables of a netCDF 4 or Zarr container. Raises InputError where it is none."""
    return _of_zarr(path) if path.is_dir() or path.suffix.lower() in {".zarr", ".zip"} else _of_netcdf(path)


def _of_netcdf(path: Path) -> dict[str, Stored]:
    data = _bytes(path)
    if data[:3] == b"CDF":
        raise InputError(str(path), "", "is netCDF 3", "convert it: nccopy -k nc4 IN OUT")
    import h5py

    try:
        file = h5py.File(io.BytesIO(data), "r")
        found = {}
        for name, item in file.items():
            if isinstance(item, h5py.Dataset) and item.dtype.kind in "iuf":
                dims = tuple(
                    item.dims[k][0].name.strip("/")
                    if len(item.dims[k])
                    else (name if item.ndim == 1 else f"{name}:{k}")
                    for k in range(item.ndim)
                )
                attrs = {
                    key: _plain(item.attrs[key]) for key in item.attrs if item.attrs.get_id(key).dtype.kind in "iufSO"
                }
                found[name] = Stored(
                    source=str(path), name=name, dims=dims, shape=item.shape, attrs=attrs, read=item.__getitem__
                )
    except (OSError, KeyError, ValueError, RuntimeError) as error:
        raise InputError(str(path), "", f"is no netCDF 4 ({str(error)[:60]})", "fetch it again") from None
    return found


def _of_zarr(path: Path) -> dict[str, Stored]:
    import zarr

    if not path.exists():
        raise InputError(str(path), "", "no such file or folder", "look at its name")
    try:
        group = zarr.open_group(str(path), mode="r")
        found = {}
        for name, item in group.arrays():
            if item.dtype.kind not in "iuf":
                continue
            attrs = {key: _plain(value) for key, value in dict(item.attrs).items() if key != "_ARRAY_DIMENSIONS"}
            if item.metadata.zarr_format == 2:
                named = item.attrs.get("_ARRAY_DIMENSIONS", ())
                dims = tuple(map(str, named)) if isinstance(named, list) else ()
                fill = item.fill_value
                if "_FillValue" not in attrs and fill is not None and item.dtype.kind == "i" and int(fill) != 0:
                    attrs["_FillValue"] = float(fill)
            else:
                dims = tuple(map(str, item.metadata.dimension_names or ()))
            found[name] = Stored(
                source=str(path), name=name, dims=dims, shape=item.shape, attrs=attrs, read=item.__getitem__
            )
    except (OSError, KeyError, ValueError, RuntimeError, TypeError) as error:
        raise InputError(str(path), "", f"is no group of Zarr ({str(error)[:60]})", "fetch it again") from None
    return {name: v for name, v in found.items() if len(v.dims) == len(v.shape)}


def _plain(value: object) -> str | float:
    """Return an attribute as text, or as a number where it is one."""
    one = np.asarray(value).ravel()
    if one.size == 1 and one.dtype.kind in "iuf":
        return float(one[0])
    said = one[0] if one.size == 1 else value
    return said.decode(errors="replace") if isinstance(said, bytes) else str(said)


def read_tides(path: Path) -> tuple[Tides, ...]:
    """Return the tides of a file of stations. Raises InputError: station, key, remedy."""
    try:
        return read_stations(_bytes(path).decode(), str(path))
    except UnicodeDecodeError:
        raise InputError(str(path), "", "is not text in UTF-8", "write it as TOML") from None


def _bytes(path: Path) -> bytes:
    try:
        data = read_regular(path, MOST_FILE_BYTES + 1)
    except OSError as error:
        raise unreadable(str(path), error) from None
    if len(data) > MOST_FILE_BYTES:
        raise InputError(str(path), "", "is larger than 1 GB", "cut it to the area and parameters of the passage")
    return data


def _fields(paths: Sequence[Path]) -> Iterator[GribField]:
    for path in paths:
        yield from walk(_bytes(path), str(path))
