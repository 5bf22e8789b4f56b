"""The wind that was measured on board, of a voyage's folder or a table, as a forecast is held against it."""

from __future__ import annotations

import csv
import math
from datetime import datetime
from pathlib import Path

import numpy as np

from companion.disk import read_regular
from companion.errors import InputError, unreadable
from companion.telemetry.folder import read_voyage
from companion.weather import Measured

_COLUMNS = ["time", "lat", "lon", "from_deg", "speed_mps"]


def measured_wind(path: Path) -> Measured:
    """Return it. Raises InputError: the line, what is wrong with it, the remedy."""
    return _of_voyage(path) if path.is_dir() else _of_table(path)


def _of_voyage(folder: Path) -> Measured:
    voyage = read_voyage(folder)
    if voyage.epoch_s is None:
        raise InputError(str(folder), "voyage.toml", "does not say when it began", "give the wind as a table")
    column = voyage.columns
    return _measured(
        voyage.epoch_s + column["t_s"], column["lat_deg"], column["lon_deg"], column["twd_deg"], column["tws_mps"]
    )


def _of_table(path: Path) -> Measured:
    try:
        lines = read_regular(path).decode("utf-8-sig").splitlines()
    except OSError as error:
        raise unreadable(str(path), error) from None
    except UnicodeDecodeError:
        raise InputError(str(path), "", "is no text in UTF-8", f"write {', '.join(_COLUMNS)}") from None
    rows = []
    for number, cells in enumerate(csv.reader(lines), start=1):
        if not cells or cells[0].startswith("#") or [cell.strip() for cell in cells] == _COLUMNS:
            continue
        try:
            when = datetime.fromisoformat(cells[0].strip())
            numbers = [float(cell) for cell in cells[1:]]
            if when.tzinfo is None or len(numbers) != 4 or not all(map(math.isfinite, numbers)):
                raise ValueError  # noqa: TRY301 - said below, as what cannot be read is
        except ValueError:
            remedy = "write 2026-04-20T06:00:00Z, 47.1, -6.3, 240, 7.5"
            raise InputError(str(path), f"line {number}", f"is not {', '.join(_COLUMNS)}", remedy) from None
        lat, lon, from_deg, speed = numbers
        if not (-90.0 <= lat <= 90.0 and -180.0 <= lon <= 360.0 and 0.0 <= from_deg <= 360.0 and 0.0 <= speed <= 110.0):
            remedy = "degrees from where it blows, and m/s"
            raise InputError(str(path), f"line {number}", "is no wind that can be", remedy)
        rows.append((when.timestamp(), *numbers))
    if not rows:
        raise InputError(str(path), "", "has no line of a wind", f"write {', '.join(_COLUMNS)}")
    return _measured(*np.array(rows).T)


def _measured(utc_s: np.ndarray, lat: np.ndarray, lon: np.ndarray, from_deg: np.ndarray, speed: np.ndarray) -> Measured:
    towards = np.radians(from_deg) + math.pi
    return Measured(
        utc_s=utc_s,
        lat_deg=lat,
        lon_deg=lon,
        wind_en_mps=speed[:, None] * np.stack([np.sin(towards), np.cos(towards)], axis=-1),
    )
