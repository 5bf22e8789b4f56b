"""A mission: goals, area and options, read from TOML and checked before anything believes it."""

from __future__ import annotations

import datetime as dt
import difflib
import re
import tomllib
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import shapely
import tomli_w

from companion.errors import InputError, unreadable
from companion.geo.frame import LocalFrame
from companion.geofence.area import Area, Fence, LocalArea
from companion.geofence.document import Document
from companion.geofence.findings import Finding, Severity
from companion.geofence.formats.raw.text import decode, read_bytes
from companion.geofence.formats.registry import read
from companion.geofence.mission.names import called, name_findings
from companion.geofence.mission.options import (
    AreaOptions,
    AutopilotOptions,
    BoatOptions,
    GoalOptions,
    MissionOptions,
    OperatorOptions,
    RefugeOptions,
    RiskOptions,
    SkipperOptions,
    TrafficOptions,
    WindOptions,
    tables,
)
from companion.geofence.shapes import Obstacle, Zone, ZoneKind
from companion.messages import GeoPoint
from companion.words import choices

MAX_TOML_BYTES = 1024 * 1024
RANGE_M = 50_000.0  # the frame is below 1 m wrong to here; what lies farther off is a mistake


@dataclass(frozen=True, slots=True, kw_only=True)
class Goal:
    """A mark: reached inside ``radius_m``; ``rounding`` says which side of the boat it is left to."""

    point: GeoPoint
    radius_m: float
    rounding: str | None = None
    name: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class RefugePoint:
    """A safe place to wait in: there inside ``radius_m``."""

    point: GeoPoint
    radius_m: float
    name: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Mission:
    """A mission that holds together: its files were read, its goals lie in free water.

    ``options`` is the file as it stands; ``area`` what its files hold; ``path`` where it was read from.
    """

    options: MissionOptions
    goals: tuple[Goal, ...]
    start: GeoPoint | None
    area: Area
    path: Path
    refuges: tuple[RefugePoint, ...] = ()
    findings: tuple[Finding, ...] = ()

    @property
    def name(self) -> str:
        """The mission's name, or its file's."""
        return called(self.options.name, self.path)

    @property
    def origin(self) -> GeoPoint:
        """The origin of the mission's local frame: the start, or the first goal."""
        return self.start or self.goals[0].point

    @property
    def places(self) -> tuple[GeoPoint, ...]:
        """Where she may be bound for: the goals and the refuges."""
        return (*(g.point for g in self.goals), *(r.point for r in self.refuges))

    def frame(self) -> LocalFrame:
        """Return the mission's local frame."""
        return LocalFrame(self.origin)

    @property
    def risk(self) -> RiskOptions:
        """The ``[risk]`` table."""
        return self.options.risk

    @property
    def boat(self) -> BoatOptions:
        """The ``[boat]`` table."""
        return self.options.boat

    @property
    def wind(self) -> WindOptions:
        """The ``[wind]`` table."""
        return self.options.wind

    @property
    def autopilot(self) -> AutopilotOptions:
        """The ``[autopilot]`` table."""
        return self.options.autopilot

    @property
    def operator(self) -> OperatorOptions:
        """The ``[operator]`` table."""
        return self.options.operator

    @property
    def skipper(self) -> SkipperOptions:
        """The ``[skipper]`` table."""
        return self.options.skipper

    @property
    def traffic(self) -> TrafficOptions:
        """The ``[traffic]`` table."""
        return self.options.traffic

    def with_feeds(self, *names: str) -> Mission:
        """Return the mission with ``names`` after its own feeds of other vessels."""
        traffic = msgspec.structs.replace(self.traffic, feeds=(*self.traffic.feeds, *names))
        return replace(self, options=msgspec.structs.replace(self.options, traffic=traffic))

    def with_system(self, system: int | None) -> Mission:
        """Return the mission for the autopilot of ``system``, None: as it is."""
        if system is None:
            return self
        autopilot = msgspec.structs.replace(self.autopilot, system=system)
        return replace(self, options=msgspec.structs.replace(self.options, autopilot=autopilot))

    @property
    def margin_m(self) -> float:
        """What a plan keeps clear of obstacles and fence [m]."""
        return self.options.area.margin_m

    @property
    def margin_floor_m(self) -> float:
        """The least margin that the skipper may fall back to [m]."""
        return min(self.options.area.margin_floor_m, self.options.area.margin_m)

    @property
    def polar_path(self) -> Path | None:
        """The polar file, None for a built-in polar or a constant speed."""
        polar = self.options.boat.polar
        if isinstance(polar, str) and ("." in polar or "/" in polar):
            return self.path.parent / polar
        return None


def load_mission(path: str | Path) -> Mission:
    """Read and check a mission TOML with the files that it names.

    Raises InputError (one line: file, place, problem, remedy) for anything that the boat must not sail with:
    unknown keys, values out of range, missing, broken or empty geometry, swapped axes, a start or goal outside
    free water.
    """
    path = Path(path)
    source = str(path)
    options = parse_options(decode(read_bytes(path, max_bytes=MAX_TOML_BYTES), source), source)
    place = options.start or options.goal[0]
    origin = GeoPoint(lat_deg=place.lat, lon_deg=place.lon)
    area, findings = load_area(options.area, path, origin)
    mission = Mission(
        options=options,
        goals=tuple(
            Goal(point=GeoPoint(lat_deg=g.lat, lon_deg=g.lon), radius_m=g.radius_m, rounding=g.rounding, name=g.name)
            for g in options.goal
        ),
        start=GeoPoint(lat_deg=options.start.lat, lon_deg=options.start.lon) if options.start else None,
        area=area, path=path, findings=(*name_findings(options.name, path), *findings),
        refuges=tuple(_refuge(r, n) for n, r in enumerate(options.refuge)),
    )
    if mission.polar_path is not None:
        _require(mission.polar_path, source, "[boat] polar",
                 'write a file beside the mission, "ardurover" or a speed in m/s')
    check_places(mission)
    return mission


def _refuge(refuge: RefugeOptions, number: int) -> RefugePoint:
    point = GeoPoint(lat_deg=refuge.lat, lon_deg=refuge.lon)
    return RefugePoint(point=point, radius_m=refuge.radius_m, name=refuge.name or f"{number + 1}")


def parse_options(text: str, source: str) -> MissionOptions:
    """Return the options of a mission TOML text. Raises InputError with the key and the nearest known spelling."""
    try:
        raw = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        what, _, where = str(error).partition(" (at ")
        raise InputError(source, where.rstrip(")") or "", f"is not TOML: {what[:1].lower()}{what[1:]}") from None
    except RecursionError:
        raise InputError(source, "", "is nested too deeply") from None
    except ValueError as error:  # a number of thousands of digits
        raise InputError(source, "", f"is not TOML: {str(error)[:60]}") from None
    _refuse_odd_numbers(raw, source, "")
    try:
        return msgspec.convert(raw, MissionOptions)
    except msgspec.ValidationError as error:
        raise _input_error(str(error), source, raw) from None


def dump_options(options: MissionOptions) -> str:
    """Return the options as TOML, leaving out what has its default."""
    data = _without_defaults(options)
    order = [
        "name", "description", "start", "goal", "refuge", "area", "wind", "risk", "boat", "autopilot",
        "operator", "skipper", "traffic"]
    return tomli_w.dumps({k: data[k] for k in order if k in data})


def _without_defaults(struct: msgspec.Struct) -> dict[str, Any]:
    out: dict[str, Any] = {}
    for field in msgspec.structs.fields(struct):
        value = getattr(struct, field.name)
        if value is None or (field.default is not msgspec.NODEFAULT and value == field.default):
            continue
        if isinstance(value, msgspec.Struct):
            out[field.name] = _without_defaults(value)
        elif isinstance(value, tuple):
            out[field.name] = [_without_defaults(v) if isinstance(v, msgspec.Struct) else v for v in value]
        else:
            out[field.name] = value
    return out


def _refuse_odd_numbers(value: object, source: str, place: str) -> None:
    """Raise for NaN and infinities, which TOML has and no range check of msgspec refuses."""
    if isinstance(value, dict):
        for key, inner in value.items():
            _refuse_odd_numbers(inner, source, f"{place}.{key}" if place else str(key))
    elif isinstance(value, list):
        for index, inner in enumerate(value):
            _refuse_odd_numbers(inner, source, f"{place}[{index}]")
    elif isinstance(value, float) and not np.isfinite(value):
        raise InputError(source, _place("$." + place), f"{value} is not a finite number")


def _place(path: str) -> str:
    """Return msgspec's ``$.goal[0].lat`` as ``[[goal]] 1 lat`` and ``$.area.margin_m`` as ``[area] margin_m``."""
    match = re.fullmatch(r"\$\.(\w+)(?:\[(\d+|\.\.\.)\])?(?:\.(\w+))?(.*)", path)
    if not match:
        return ""
    table, index, key, rest = match.groups()
    if index is not None and table in {"goal", "refuge"}:
        number = f" {int(index) + 1}" if index.isdigit() else ""
        return f"[[{table}]]{number} {key or ''}{rest}".rstrip()
    if key is None and table not in tables():
        return f"{table}{f'[{index}]' if index else ''}"
    return f"[{table}] {key or ''}{rest}".rstrip()


def _input_error(message: str, source: str, raw: dict[str, Any]) -> InputError:
    problem, _, path = message.partition(" - at `")
    path = path.rstrip("`")
    place = _place(path) if path else ""
    known = tables()
    unknown = re.search(r"unknown field `(.+)`", problem)
    if unknown:
        key = unknown.group(1)
        table = re.sub(r"^\$\.?", "", path)
        table = re.sub(r"[\[.].*", "", table)
        fields = known.get(table, ())
        near = difflib.get_close_matches(key, fields, n=1, cutoff=0.5)
        elsewhere = [t for t, keys in known.items() if key in keys and t != table]
        remedy = (
            f"did you mean {near[0]!r}?" if near
            else f"it belongs in [{elsewhere[0]}]" if elsewhere and elsewhere[0]
            else "known keys: " + ", ".join(fields)
        )
        return InputError(source, f"{place} {key}".strip(), "unknown key", remedy)
    missing = re.search(r"missing required field `(.+)`", problem)
    if missing:
        key = missing.group(1)
        remedy = "add [[goal]] with lat and lon" if key == "goal" else "add it"
        return InputError(source, f"{place} {key}".strip(), "is missing", remedy)
    if problem.startswith("Invalid enum value"):
        return InputError(source, place, f"{_short(_value_at(raw, path))} is none of the choices",
                          "write " + " or ".join(f'"{choice}"' for choice in choices(MissionOptions, path)))
    value = _value_at(raw, path)
    shown = f"{_short(value)} is wrong: " if value is not None and not isinstance(value, dict | list) else ""
    swap = ""
    if place.endswith(" lat") and isinstance(value, int | float) and abs(value) > 90.0:
        swap = "are lat and lon swapped? write degrees within ±90"
    return InputError(source, place, shown + problem[:1].lower() + problem[1:], swap)


def _short(value: object) -> str:
    text = str(value) if isinstance(value, dt.date | dt.time) else repr(value)
    return text if len(text) <= 40 else text[:40] + "..."


def _value_at(raw: dict[str, Any], path: str) -> object:
    value: object = raw
    for part in re.findall(r"\.(\w+)|\[(\d+)\]", path):
        try:
            value = value[part[0]] if part[0] else value[int(part[1])]  # type: ignore[index]
        except (KeyError, IndexError, TypeError):
            return None
    return value


def _require(path: Path, source: str, place: str, remedy: str) -> None:
    """Raise InputError, which names the place in the mission, when a file that it names cannot be read."""
    try:
        path.open("rb").close()
    except OSError as error:
        raise unreadable(source, error, f"{place} {path}", remedy) from None


def load_area(options: AreaOptions, mission_path: Path, origin: GeoPoint) -> tuple[Area, tuple[Finding, ...]]:
    """Return the area that ``[area]`` names and what its files gave rise to. Raises InputError."""
    folder = mission_path.parent
    obstacles: list[Obstacle] = []
    zones: list[Zone] = []
    findings: list[Finding] = []

    def load(name: str, key: str, kind: ZoneKind) -> Document:
        path = folder / name
        _require(path, str(mission_path), f"[area] {key}", "paths are relative to the mission file")
        document = read(path, kind=kind, axis=options.axis, near=origin, areas=True).require_clean()
        findings.extend(f for f in document.findings if f.severity is not Severity.NOTE)
        return document

    for name in options.obstacles:
        document = load(name, "obstacles", ZoneKind.EXCLUSION)
        obstacles.extend(document.as_obstacles(options.point_radius_m))
        zones.extend(z for z in document.zones if z.kind is ZoneKind.INCLUSION)
    if options.fence is not None:
        document = load(options.fence, "fence", ZoneKind.INCLUSION)
        if not document.zones:
            raise InputError(str(folder / options.fence), "", "holds no polygon or circle to stay inside",
                             "draw the fence as an area")
        zones.extend(document.zones)
        obstacles.extend(o for o in document.with_zones(()).as_obstacles(options.point_radius_m))
    return Area(obstacles=tuple(obstacles), fence=Fence(zones=tuple(zones))), tuple(findings)


def check_places(mission: Mission) -> None:
    """Raise InputError if the start, a goal or a refuge is too far off, in an obstacle, or outside the fence."""
    frame = mission.frame()
    local = mission.area.local(frame)
    source = str(mission.path)
    places = [(f"[[goal]] {i + 1}", g.point) for i, g in enumerate(mission.goals)]
    places += [(f"[[refuge]] {i + 1}", r.point) for i, r in enumerate(mission.refuges)]
    if mission.start is not None:
        places.insert(0, ("[start]", mission.start))
    for place, point in places:
        east_m, north_m = frame.en_from_geo(point)
        if max(abs(east_m), abs(north_m)) > RANGE_M:
            raise InputError(source, place, f"is {np.hypot(east_m, north_m) / 1000.0:.0f} km from the origin",
                             "are lat and lon swapped? the local frame holds 50 km")
        problem = trouble_at(local, (east_m, north_m))
        if problem:
            raise InputError(source, place, f"{point.lat_deg:.6f}, {point.lon_deg:.6f} {problem}",
                             "move it into free water or correct the area's files")


def trouble_at(local: LocalArea, point_en: tuple[float, float]) -> str:
    """Return why a point is not in free water ("" when it is)."""
    point = shapely.points(point_en)
    for name, polygon in zip(local.names, local.polygons, strict=True):
        if shapely.covers(polygon, point):
            return f"is inside the obstacle '{name}'"
    if local.limits is not None and not shapely.covers(local.limits, point):
        return "is outside the fence"
    return ""


def goal_options(goal: Goal) -> GoalOptions:
    """Return a goal as the file writes it."""
    side = goal.rounding if goal.rounding in {"port", "starboard"} else None
    return GoalOptions(lat=goal.point.lat_deg, lon=goal.point.lon_deg, radius_m=goal.radius_m,
                       rounding=side, name=goal.name)  # type: ignore[arg-type]
