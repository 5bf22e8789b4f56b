"""Forecast files, opened: the only place of this room where there are files."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

from companion.disk import read_regular
from companion.errors import InputError, unreadable
from companion.weather.assemble import Box, assemble
from companion.weather.grib import GribField, walk
from companion.weather.tides import Tides, read_stations
from companion.weather.weather import Weather

MOST_FILE_BYTES = 1 << 30


def read_weather(paths: Sequence[Path], box: Box | None = None) -> Weather:
    """Return the weather of files, within a box and a cell beyond it. Raises InputError: file, message, remedy.

    What ends in .toml are stations of the tide; all else is GRIB.
    """
    stations = [path for path in paths if path.suffix.lower() == ".toml"]
    tides = tuple(tide for path in stations for tide in read_tides(path))
    return replace(assemble(_fields([path for path in paths if path not in stations]), box), tides=tides)


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
