"""Forecast files, opened: the only place of this room where there are files."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from companion.disk import read_regular
from companion.errors import InputError, unreadable
from companion.weather.assemble import Box, assemble
from companion.weather.grib import GribField, walk
from companion.weather.weather import Weather

MOST_FILE_BYTES = 1 << 30


def read_weather(paths: Sequence[Path], box: Box | None = None) -> Weather:
    """Return the weather of files, within a box and a cell beyond it. Raises InputError: file, message, remedy."""
    return assemble(_fields(paths), box)


def _fields(paths: Sequence[Path]) -> Iterator[GribField]:
    for path in paths:
        try:
            data = read_regular(path, MOST_FILE_BYTES + 1)
        except OSError as error:
            raise unreadable(str(path), error) from None
        if len(data) > MOST_FILE_BYTES:
            raise InputError(str(path), "", "is larger than 1 GB", "cut it to the area and parameters of the passage")
        yield from walk(data, str(path))
