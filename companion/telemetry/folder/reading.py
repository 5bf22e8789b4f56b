"""Reading a voyage's folder again: each file believed once, where it is read, and refused by name, place and remedy."""

from __future__ import annotations

import contextlib
import csv
import gzip
import json
import math
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any, TypeVar

import msgspec
import numpy as np
import shapely
from msgspec import Struct
from numpy.typing import NDArray

from companion.errors import InputError
from companion.geo.frame import LocalFrame
from companion.geo.shift import Shift
from companion.messages import GeoPoint
from companion.telemetry.folder.recorder import (
    AREA,
    DECISIONS,
    SUMMARY,
    TRACK,
    TRACK_COLUMNS,
    VOYAGE,
    parts,
    read_jsonl,
    read_part,
)
from companion.words import expected

DAMAGED = "is the folder damaged, or another program's? take it from its copy"
_WORDS = ("mode", "phase")
T = TypeVar("T")


class Origin(Struct, frozen=True, kw_only=True):
    """Where the local metres of a chart begin."""

    lat_deg: float
    lon_deg: float


class ChartGoal(Struct, frozen=True, kw_only=True):
    """A goal on the chart [m east and north of the origin]."""

    x: float
    y: float
    radius_m: float
    name: str = ""
    side: str = "none"
    line: tuple[tuple[float, float], tuple[float, float]] | None = None  # the port mark and the starboard mark
    water: str | None = None  # of a box or a search, WKT


class ChartWater(Struct, frozen=True, kw_only=True):
    """Water of a chart that dries, WKT, and when it is solid: spans of Unix time, an end that is None there is none."""

    name: str
    area: str
    solid_unix_s: tuple[tuple[float | None, float | None], ...] = ()


class RecordedChart(Struct, frozen=True, kw_only=True):
    """area.json: obstacles as drawn, their names, obstacles as grown by the margin, the fence; WKT in local metres."""

    name: str
    origin: Origin
    goals: tuple[ChartGoal, ...] = ()
    obstacles: tuple[str, ...] = ()
    names: tuple[str, ...] = ()
    grown: tuple[str, ...] = ()
    fence: str | None = None
    drying: tuple[ChartWater, ...] = ()
    margin_m: float | None = None
    no_go_half_deg: float = 45.0


class PlannedLeg(Struct, frozen=True, kw_only=True, rename={"start_en": "from", "end_en": "to"}):
    """A leg of a recorded plan, as far as a picture wants it."""

    start_en: tuple[float, float]
    end_en: tuple[float, float]
    no_go_half_deg: float


class PlannedWay(Struct, frozen=True, kw_only=True):
    """The way of a recorded plan [m]."""

    waypoints: tuple[tuple[float, float], ...] = ()
    legs: tuple[PlannedLeg, ...] = ()


class RecordedPlan(Struct, frozen=True, kw_only=True):
    """An answer of the planner with the facts of its request: when, why, in which wind, how the zone was widened."""

    t_s: float
    plan: PlannedWay | None = None
    request_id: int | None = None
    reason: str | None = None
    twd_deg: float | None = None
    widening: tuple[tuple[float, float], ...] | None = None

    @property
    def is_made(self) -> bool:
        """Whether it has a way."""
        return self.plan is not None and bool(self.plan.waypoints)


class ServoFigures(Struct, frozen=True, kw_only=True):
    """What one servo output did."""

    movements: int = 0
    travel_us: int = 0


class Summary(Struct, frozen=True, kw_only=True):
    """summary.json, as far as it is put into words."""

    arrived: bool | None = None
    end_reason: str | None = None
    end_why: str = ""
    time_s: float | None = None
    distance_m: float | None = None
    tacks: int = 0
    gybes: int = 0
    plans: int = 0
    replans: int = 0
    contacts: int = 0
    no_go_entries: int = 0
    no_go_entry_deg: float | None = None
    goals_reached: int | None = None
    goals: int | None = None
    min_clearance_m: float | None = None
    promised_clearance_m: float | None = None
    promised_risk: float | None = None
    path_risk: float | None = None
    alerts: dict[str, int] = {}
    servos: dict[str, ServoFigures] = {}
    figures: dict[str, dict[str, float]] = {}
    records_dropped: int = 0
    disk_trouble: str = ""


class _Run(Struct, frozen=True, kw_only=True):
    started_utc: str = ""
    epoch_s: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class VoyageRecord:
    """What a voyage folder holds; columns are float arrays with NaN for what is unknown.

    ``figures`` is summary.json as it stands, ``summary`` what of it is put into words: both are of the last start, and
    ``starts_s`` has the time of each. ``began_utc`` and ``epoch_s``
    (Unix time of t_s = 0) are from voyage.toml, "" and None without one, by the autopilot's clock where the record says
    that it was another.
    """

    folder: Path
    columns: dict[str, NDArray[np.float64]]
    texts: dict[str, list[str]]
    plans: tuple[RecordedPlan, ...]
    chart: RecordedChart
    figures: dict[str, Any]
    summary: Summary
    began_utc: str = ""
    epoch_s: float | None = None
    starts_s: tuple[float, ...] = ()

    @property
    def start_s(self) -> float:
        """The time of the first row [s]."""
        t_s = self.columns["t_s"]
        return float(t_s[0]) if len(t_s) else 0.0


def read_voyage(folder: Path) -> VoyageRecord:
    """Read a voyage folder; a voyage that has not ended has no summary.

    Raises:
        InputError: it is not a voyage folder, or a file in it is damaged.
    """
    require_files(folder, TRACK, DECISIONS, AREA)
    rows = read_rows(folder / TRACK)
    figures = _read_json(folder / SUMMARY) if (folder / SUMMARY).is_file() else {}
    if not isinstance(figures, dict):
        raise InputError(str(folder / SUMMARY), "", "is no table of figures", DAMAGED)
    description = read_description(folder) if (folder / VOYAGE).is_file() else {}
    run = _converted(description.get("run", {}), _Run, folder / VOYAGE, "[run] ")
    decisions = read_decisions(folder)
    behind_s = _behind_s(decisions)
    chart = _converted(_read_json(folder / AREA), RecordedChart, folder / AREA)
    for wkt in (
        *chart.obstacles,
        *chart.grown,
        *([chart.fence] if chart.fence else []),
        *(w.area for w in chart.drying),
    ):
        with believed(folder / AREA, f"{wkt[:30]!r}"):
            shapely.from_wkt(wkt)
    return VoyageRecord(
        folder=folder,
        columns={
            name: np.array([row[name] for row in rows], dtype=np.float64)
            for name in TRACK_COLUMNS
            if name not in _WORDS
        },
        texts={name: [row[name] for row in rows] for name in _WORDS},
        plans=_plans(decisions, folder / DECISIONS, chart.origin),
        chart=chart,
        figures=figures,
        summary=_converted(figures, Summary, folder / SUMMARY),
        began_utc=_later(run.started_utc, behind_s),
        epoch_s=None if run.epoch_s is None else run.epoch_s + behind_s,
        starts_s=tuple(float(d["t_s"]) for d in decisions if d["kind"] == "start"),
    )


def require_files(folder: Path, *names: str) -> None:
    """Raise InputError unless the folder holds all of the named files."""
    for name in names:
        if not (folder / name).is_file():
            if not folder.is_dir():
                raise InputError(str(folder), "", "is no folder", "name one that `companion run` left")
            what = "is a folder and no file" if (folder / name).is_dir() else "is missing"
            raise InputError(str(folder), name, what, "name a folder that `companion run` left")


@contextlib.contextmanager
def believed(path: Path, place: str) -> Iterator[None]:
    """Turn what a value of another kind raises, where it is taken from a file, into an InputError that names it."""
    try:
        yield
    except (KeyError, ValueError, TypeError, AttributeError, IndexError, shapely.errors.ShapelyError) as error:
        what = f"{error} is missing" if isinstance(error, KeyError) else str(error).splitlines()[0][:100]
        raise InputError(str(path), place, f"is not what a voyage records ({what})", DAMAGED) from error


def read_description(folder: Path) -> dict[str, Any]:
    """Return voyage.toml. Raises InputError."""
    path = folder / VOYAGE
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except ValueError as error:
        raise InputError(str(path), "", f"is not TOML ({error})", DAMAGED) from None


def read_decisions(folder: Path) -> list[dict[str, Any]]:
    """Return the records of decisions.jsonl; each is a table with a time and a kind. Raises InputError."""
    path = folder / DECISIONS
    records = read_jsonl(path)
    for number, record in enumerate(records, start=1):
        if not (
            isinstance(record, dict)
            and isinstance(record.get("kind"), str)
            and isinstance(record.get("t_s"), int | float)
        ):
            raise InputError(str(path), f"record {number}", "has no time and kind", DAMAGED)
    return records


def read_rows(path: Path) -> list[dict[str, Any]]:
    """Return the rows of track.csv and its closed parts: numbers by column, NaN where a cell is empty.

    A torn last row is left out.
    """
    return [row for part in parts(path) or [path] for row in _rows_of(part)]


def _rows_of(path: Path) -> list[dict[str, Any]]:
    try:
        lines = read_part(path).decode().split("\n")
    except (ValueError, gzip.BadGzipFile):
        raise InputError(str(path), "", "is not text", DAMAGED) from None
    header = next(csv.reader(lines[:1]), [])
    missing = [name for name in TRACK_COLUMNS if name not in header]
    if missing:
        raise InputError(str(path), "line 1", f"has no column {missing[0]}", DAMAGED)
    rows: list[dict[str, Any]] = []
    # what follows the last line end is torn
    for number, cells in enumerate(csv.reader(lines[1:-1]), start=2):
        if not cells:
            continue
        with believed(path, f"line {number}"):
            if len(cells) != len(header):
                raise ValueError(f"{len(cells)} columns in place of {len(header)}")
            row = dict(zip(header, cells, strict=True))
            rows.append({k: v if k in _WORDS else _number(v) for k, v in row.items()})
    return rows


def _number(cell: str) -> float:
    value = float(cell) if cell else math.nan
    if cell and not math.isfinite(value):
        raise ValueError(f"{cell[:30]!r} is no finite number")
    return value


def _behind_s(decisions: list[dict[str, Any]]) -> float:
    """Return how far [s] the clock that stamped the first start was behind the autopilot's, 0.0 unless it was told."""
    starts = 0
    for decision in decisions:
        starts += decision["kind"] == "start"
        if starts > 1:
            break  # a later start had a clock of its own
        if decision["kind"] == "clock" and isinstance(decision.get("behind_s"), int | float):
            return float(decision["behind_s"])
    return 0.0


def _later(utc: str, by_s: float) -> str:
    """Return an ISO time moved by ``by_s``; text that is none, or would leave the calendar, as it stands."""
    try:
        return (datetime.fromisoformat(utc) + timedelta(seconds=by_s)).isoformat() if by_s else utc
    except (ValueError, OverflowError):
        return utc


def _plans(decisions: list[dict[str, Any]], path: Path, origin: Origin) -> tuple[RecordedPlan, ...]:
    """Return the plans, each with the facts of its request, in the metres of the chart."""
    requests = {d.get("request_id"): d for d in decisions if d.get("action") == "RequestPlan"}
    plans, shift = [], None
    for decision in decisions:
        if decision["kind"] == "plan":
            request = requests.get(decision.get("request_id"), {})
            facts = {key: request.get(key) for key in ("reason", "twd_deg", "widening")}
            plan = _converted({**facts, **decision}, RecordedPlan, path, f"t_s = {decision['t_s']} ")
            if shift is not None and plan.plan is not None:
                plan = msgspec.structs.replace(plan, plan=_carried(plan.plan, shift))
            plans.append(plan)
        elif decision["kind"] == "start":
            shift = None
        elif decision["kind"] == "water":
            shift = _shift(decision, path, origin)
    return tuple(plans)


def _shift(water: dict[str, Any], path: Path, origin: Origin) -> Shift:
    """Return how the metres of another water become those of the chart."""
    with believed(path, f"t_s = {water['t_s']}"):
        there = GeoPoint(lat_deg=float(water["lat_deg"]), lon_deg=float(water["lon_deg"]))
    return Shift(LocalFrame(there), LocalFrame(GeoPoint(lat_deg=origin.lat_deg, lon_deg=origin.lon_deg)))


def _carried(way: PlannedWay, shift: Shift) -> PlannedWay:
    return msgspec.structs.replace(
        way,
        waypoints=tuple(shift.point(p) for p in way.waypoints),
        legs=tuple(
            msgspec.structs.replace(leg, start_en=shift.point(leg.start_en), end_en=shift.point(leg.end_en))
            for leg in way.legs
        ),
    )


def _read_json(path: Path) -> Any:
    try:
        return json.loads(path.read_bytes())
    except (ValueError, RecursionError) as error:
        raise InputError(str(path), "", f"is not JSON ({str(error)[:60]})", DAMAGED) from None


def _converted(raw: object, kind: type[T], path: Path, place: str = "") -> T:
    try:
        return msgspec.convert(raw, kind)
    except msgspec.ValidationError as error:
        problem, _, where = str(error).partition(" - at `$")
        raise InputError(str(path), place + where.strip("`."), expected(problem), DAMAGED) from None
