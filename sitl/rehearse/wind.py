"""The wind of a rehearsal: one that is given with its error, a record that was measured, a table of a climate."""

from __future__ import annotations

import csv
import math
import os
import random
from dataclasses import dataclass, replace
from pathlib import Path

import msgspec

from companion.errors import InputError
from sitl.scene import WindSpec
from sitl.world import Recorded

# How far a forecast of the mean of the next hours is off on a coast, direction [deg] and speed [m/s].
ERROR = (10.0, 0.5)
LEAST_MPS = 0.5
MOST_MPS = 40.0
CLIMATE = ("wind_from_deg", "wind_speed_ms", "share")
FORECASTS = (".grb", ".grb2", ".grib", ".grib2")
_REMEDY = "write SPEED@FROM, as 5@350, or name a CSV: a record or a table of a climate"


@dataclass(frozen=True, slots=True, kw_only=True)
class Cell:
    """One wind of a climate: how strong, where from, and how often it is that."""

    tws_mps: float
    from_deg: float
    share: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Given:
    """What is known of the wind before the voyage.

    Attributes:
        told: in words.
        spec: the weather about its mean; of a record, the record.
        error: by how much the mean may be off, direction [deg] and speed [m/s], standard deviations.
        cells: of a climate; a seed draws one of them in place of the mean.
        record_s: how long a record is, 0 for what is none.
    """

    told: str
    spec: WindSpec
    error: tuple[float, float] = ERROR
    cells: tuple[Cell, ...] = ()
    record_s: float = 0.0

    def drawn(self, rng: random.Random, voyage_s: float) -> WindSpec:
        """Return the weather of a seed, whose voyage takes about so long."""
        if self.spec.model == "recorded":
            return msgspec.structs.replace(self.spec, from_s=round(rng.uniform(
                0.0, max(0.0, self.record_s - voyage_s)), 1))
        mean = (self.spec.from_deg, self.spec.tws_mps)
        if self.cells:
            cell = rng.choices(self.cells, weights=[c.share for c in self.cells])[0]
            mean = (cell.from_deg, cell.tws_mps)
        return msgspec.structs.replace(
            self.spec, from_deg=round((mean[0] + rng.gauss(0.0, self.error[0])) % 360.0, 2),
            tws_mps=round(min(max(mean[1] + rng.gauss(0.0, self.error[1]), LEAST_MPS), MOST_MPS), 3))

    @property
    def middle(self) -> tuple[float, float]:
        """The wind in which a first plan is tried, where from [deg] and how strong [m/s]: a climate's most frequent."""
        if self.cells:
            most = max(self.cells, key=lambda cell: cell.share)
            return most.from_deg, most.tws_mps
        return self.spec.from_deg, self.spec.tws_mps

    def beside(self, folder: Path) -> Given:
        """Return it with its record named relative to a folder."""
        if self.spec.file is None:
            return self
        return replace(self, spec=msgspec.structs.replace(self.spec, file=os.path.relpath(self.spec.file, folder)))


def given_wind(text: str | None, spec: WindSpec, error: tuple[float, float] | None) -> Given:
    """Return the wind that ``--wind`` says; without it that of ``spec``.

    Raises:
        InputError: it is none, or its file cannot be believed.
    """
    off = ERROR if error is None else error
    if text is None:
        return Given(told=_told(spec, off), spec=spec, error=off)
    path = Path(text)
    if path.suffix.lower() in FORECASTS:
        raise InputError("--wind", text, "GRIB is not read", "write the forecast's mean as SPEED@FROM and its error")
    if path.suffix.lower() == ".csv":
        return _of_file(path, spec, error)
    try:
        speed, direction = (float(part) for part in text.split("@"))
    except ValueError:
        raise InputError("--wind", text, "is no wind", _REMEDY) from None
    if not (0.0 < speed <= MOST_MPS and -360.0 <= direction <= 360.0):
        raise InputError("--wind", text, f"is out of range: up to {MOST_MPS:g} m/s, from -360 to 360 degrees", _REMEDY)
    spec = msgspec.structs.replace(spec, tws_mps=speed, from_deg=direction % 360.0)
    return Given(told=_told(spec, off), spec=spec, error=off)


def _told(spec: WindSpec, off: tuple[float, float]) -> str:
    return (f"{spec.tws_mps:g} m/s from {spec.from_deg:g}°, the mean of each voyage off by {off[1]:g} m/s and "
            f"{off[0]:g}° (standard deviations), wandering by {spec.sd_deg:g}°")


def _of_file(path: Path, spec: WindSpec, error: tuple[float, float] | None) -> Given:
    try:
        with path.open(newline="", encoding="utf-8-sig") as lines:
            names = next(csv.reader(line for line in lines if not line.startswith("#")), [])
    except (OSError, UnicodeDecodeError) as trouble:
        raise InputError("--wind", str(path), f"cannot be read ({trouble})", _REMEDY) from None
    if set(CLIMATE) <= set(names):
        return _climate(path, spec, error or (0.0, 0.0))
    if error is not None:
        raise InputError("--wind-error", "", "is of a wind that is given, and a record has none", "leave it out")
    record = Recorded.from_csv(path)
    from_deg, tws_mps = (math.degrees(record.at(0.0)[0]), record.at(0.0)[1])
    return Given(
        told=f"measured, {record.duration_s / 3600.0:.1f} h of {path.name}, each voyage from a time of its own on",
        spec=msgspec.structs.replace(spec, model="recorded", file=str(path.resolve()), from_deg=round(from_deg, 2),
                                     tws_mps=round(tws_mps, 3)),
        error=(0.0, 0.0), record_s=record.duration_s)


def _climate(path: Path, spec: WindSpec, off: tuple[float, float]) -> Given:
    cells: list[Cell] = []
    with path.open(newline="", encoding="utf-8-sig") as lines:
        reader = csv.DictReader(line for line in lines if not line.startswith("#"))
        for row in reader:
            try:
                from_deg, tws_mps, share = (float(row[name]) for name in CLIMATE)
            except (TypeError, ValueError):
                raise InputError(str(path), f"line {reader.line_num}", "is not three numbers",
                                 f"write {','.join(CLIMATE)}") from None
            if not (0.0 < tws_mps <= MOST_MPS and -360.0 <= from_deg <= 360.0 and 0.0 <= share <= 1e9):
                raise InputError(str(path), f"line {reader.line_num}", "is out of range",
                                 f"speeds up to {MOST_MPS:g} m/s, degrees, shares from 0")
            cells.append(Cell(tws_mps=tws_mps, from_deg=from_deg % 360.0, share=share))
    if not cells or sum(cell.share for cell in cells) <= 0.0:
        raise InputError(str(path), "", "holds no wind", f"write lines of {','.join(CLIMATE)}")
    about = "" if off == (0.0, 0.0) else f", each off by {off[1]:g} m/s and {off[0]:g}°"
    return Given(told=f"a climate of {len(cells)} winds, {path.name}{about}", spec=spec, error=off, cells=tuple(cells))
