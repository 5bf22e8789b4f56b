"""A mission: goals, area and options, read from TOML and checked before anything believes it."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import msgspec
import numpy as np
import shapely

from companion.disk import open_regular
from companion.errors import InputError, unreadable
from companion.geo.frame import RANGE_M, LocalFrame
from companion.geofence.area import Area, Fence, LocalArea
from companion.geofence.charted import Charted
from companion.geofence.document import Code, Document, Finding, FindingLevel
from companion.geofence.formats.registry import check_place, parse, read
from companion.geofence.formats.untrusted import decode, read_bytes
from companion.geofence.mission.boat_file import with_boat_file
from companion.geofence.mission.goals import GoalGate, GoalReader, MissionGoal, RefugePoint, refuges_of
from companion.geofence.mission.options import (
    AreaOptions,
    AutopilotOptions,
    BoatOptions,
    CurrentOptions,
    MissionOptions,
    OperatorOptions,
    OutputOptions,
    PassageOptions,
    RiskOptions,
    SafetyOptions,
    SkipperOptions,
    TrafficOptions,
    WindOptions,
)
from companion.geofence.mission.text import GOAL_MISSING, MAX_TOML_BYTES, parse_options
from companion.geofence.shapes import Obstacle, Shape, Zone, ZoneKind
from companion.messages import GeoPoint
from companion.words import below_words, file_name

AS_IT_IS: Mapping[Path, bytes] = {}  # nothing is given: every file is read from the disk
KM_M = 1_000.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Mission:
    """A mission that holds together: its files were read, its goals lie in free water.

    ``options`` is the file as it stands; ``area`` what its files hold; ``path`` where it was read from.
    """

    options: MissionOptions
    goals: tuple[MissionGoal, ...]
    start: GeoPoint | None
    area: Area
    path: Path
    refuges: tuple[RefugePoint, ...] = ()
    findings: tuple[Finding, ...] = ()
    waters: Mapping[str, Shape] = field(default_factory=dict)
    """What atoms of fields lead out of, by their names."""
    drying: tuple[Obstacle, ...] = ()
    """Water that is too shallow at some hours only, each with its depth; it is not in ``area``."""

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
        """Where the boat may be bound for: the goals and the refuges."""
        return (*(g.point for g in self.goals), *(r.point for r in self.refuges))

    def frame(self) -> LocalFrame:
        """Return the mission's local frame; of a passage it is the first."""
        return LocalFrame(self.origin)

    @property
    def is_passage(self) -> bool:
        """Whether it leads farther than one local frame."""
        return self.passage.leg_m is not None

    def water(self) -> LocalArea:
        """Return the whole area in the metres of the mission's frame."""
        return self.area.about(self.frame(), np.inf) if self.is_passage else self.area.local(self.frame())

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
    def current(self) -> CurrentOptions | None:
        """The ``[current]`` table, None without one."""
        return self.options.current

    @property
    def tide_path(self) -> Path | None:
        """The tide table's file, None without one."""
        current = self.options.current
        return None if current is None or current.table is None else self.path.parent / current.table

    @property
    def heights_path(self) -> Path | None:
        """The file of the tide's heights, None without one."""
        table = self.options.area.tide
        return None if table is None else self.path.parent / table

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
    def passage(self) -> PassageOptions:
        """The ``[passage]`` table."""
        return self.options.passage

    @property
    def safety(self) -> SafetyOptions:
        """The ``[safety]`` table."""
        return self.options.safety

    @property
    def traffic(self) -> TrafficOptions:
        """The ``[traffic]`` table."""
        return self.options.traffic

    @property
    def output(self) -> OutputOptions:
        """The ``[output]`` table."""
        return self.options.output

    def with_feeds(self, *names: str) -> Mission:
        """Return the mission with ``names`` after its own feeds of other vessels."""
        traffic = msgspec.structs.replace(self.traffic, feeds=(*self.traffic.feeds, *names))
        return replace(self, options=msgspec.structs.replace(self.options, traffic=traffic))

    def with_sounder(self, feed: str | None) -> Mission:
        """Return the mission that hears its sounder from ``feed``; None: as its file says."""
        if feed is None:
            return self
        sounder = msgspec.structs.replace(self.options.sounder, feed=feed)
        return replace(self, options=msgspec.structs.replace(self.options, sounder=sounder))

    def with_outputs(self, nmea: Sequence[str], signalk: Sequence[str], token_file: Path | None) -> Mission:
        """Return the mission that is told to these too, after its own displays."""
        own = self.output
        output = msgspec.structs.replace(
            own,
            nmea=(*own.nmea, *nmea),
            signalk=(*own.signalk, *signalk),
            signalk_token=own.signalk_token if token_file is None else str(token_file.absolute()),
        )
        return replace(self, options=msgspec.structs.replace(self.options, output=output))

    def permitting(self, *names: str) -> Mission:
        """Return the mission whose ``[operator]`` permits ``names`` (arm, set_auto), too."""
        operator = msgspec.structs.replace(self.options.operator, **dict.fromkeys(names, True))
        return replace(self, options=msgspec.structs.replace(self.options, operator=operator))

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
        return polar_path(self.options.boat, self.path)


MOST_PASSAGE_BYTES = 400_000  # of the passage that lies beside a mission


def planned_beside(mission: Path) -> Path:
    """Return the file of the passage that a mission was planned as: ``m.toml`` has ``m.passage.json``."""
    return mission.with_suffix(".passage.json")


def polar_path(boat: BoatOptions, source: Path) -> Path | None:
    """Return the polar file that ``[boat]`` of a file names, None for a built-in polar or a constant speed."""
    polar = boat.polar
    if isinstance(polar, str) and ("." in polar or "/" in polar):
        return source.parent / polar
    return None


def load_mission(path: str | Path) -> Mission:
    """Read and check a mission TOML with the files that it names.

    Raises InputError (one line: file, place, problem, remedy) for anything that the boat must not sail with:
    unknown keys, values out of range, missing, broken or empty geometry, swapped axes, a start or goal outside
    free water.
    """
    mission = read_mission(Path(path))
    check_places(mission)
    return mission


def read_mission(path: Path, given: Mapping[Path, bytes] = AS_IT_IS) -> Mission:
    """Read a mission as ``load_mission`` does, without a look at whether its places lie in free water.

    What is ``given`` of a file stands for its content.
    """
    options = _options_of(path, given)
    if options.from_autopilot and not options.goal:
        raise InputError(
            str(path),
            "from_autopilot",
            "the goals of this mission are drawn on the autopilot, not here",
            "companion run reads them there and sails them",
        )
    if not options.goal:
        raise _without_goal(options, path)
    return assembled(options, path, given=given)


def _without_goal(options: MissionOptions, path: Path) -> InputError:
    if options == MissionOptions():
        return InputError(str(path), "", "is empty", "companion mission example writes missions to begin from")
    return InputError(str(path), "goal", "is missing", GOAL_MISSING)


def read_course(path: Path) -> Mission:
    """Read a mission's goals and settings without its area, whose files may still have to be made."""
    options = _options_of(path, AS_IT_IS)
    if not options.goal:
        raise _without_goal(options, path)
    bare = msgspec.structs.replace(options.area, obstacles=(), fence=None, drying=())
    return assembled(msgspec.structs.replace(options, area=bare), path)


def _options_of(path: Path, given: Mapping[Path, bytes]) -> MissionOptions:
    """Return the options of a mission with what its boat's file says."""
    text = decode(given[path] if path in given else read_bytes(path, max_bytes=MAX_TOML_BYTES), str(path))
    options = parse_options(text, str(path))
    return msgspec.structs.replace(options, boat=with_boat_file(options.boat, text, path))


def _require_near(options: MissionOptions, reader: GoalReader, origin: GeoPoint) -> None:
    """Raise InputError where all goals and refuges are far from the start, before the area's files are blamed for that.

    Of a start and a single place nobody can say which is wrong: ``place_troubles`` names the place.
    """
    places = [goal.point for goal in reader.goals_of(options, Area())]
    places += [GeoPoint(lat_deg=refuge.lat, lon_deg=refuge.lon) for refuge in options.refuge]
    if options.start is None or len(places) < 2:
        return
    least_m = min(float(np.hypot(*LocalFrame(origin).en_from_geo(point))) for point in places)
    spread_m = max(float(np.hypot(*LocalFrame(places[0]).en_from_geo(point))) for point in places)
    if least_m > RANGE_M > spread_m:
        raise InputError(
            str(reader.path), "[start]", f"is {least_m / 1000.0:.0f} km from every goal", _asked(origin, places[0])
        )


def load_settings(path: str | Path) -> MissionOptions:
    """Read a mission TOML whose goals are drawn on the autopilot: all but the goals. Raises InputError."""
    path = Path(path)
    options = _options_of(path, AS_IT_IS)
    if options.goal:
        raise InputError(
            str(path),
            "[[goal]]",
            "the goals are those that are drawn on the autopilot",
            "take them out of this file, or sail it without --from-autopilot",
        )
    return msgspec.structs.replace(options, name=called(options.name, path), from_autopilot=True)


def assembled(
    options: MissionOptions, path: Path, drawn: Document | None = None, given: Mapping[Path, bytes] = AS_IT_IS
) -> Mission:
    """Return the mission of ``options`` with the files that they name, which lie relative to ``path``.

    The zones of ``drawn`` belong to its area; ``given`` is as for ``read_mission``, of its area's files. Whether its
    places lie in free water is not looked at. Raises InputError.
    """
    reader = GoalReader(path=path, axis=options.area.axis)
    origin = reader.origin_of(options)
    far_m = RANGE_M
    if options.passage.leg_m is not None:
        frame = LocalFrame(origin)
        far_m += max(float(np.hypot(*frame.en_from_geo(g.point))) for g in reader.goals_of(options, Area()))
    else:
        _require_near(options, reader, origin)
    area, findings = load_area(options.area, path, origin, given, far_m)
    if drawn is not None:
        limits = tuple(z for z in drawn.zones if z.kind is ZoneKind.INCLUSION)
        area = Area(
            obstacles=(*area.obstacles, *drawn.as_obstacles(options.area.point_radius_m)),
            fence=Fence(zones=(*area.fence.zones, *limits)),
            charted=area.charted,
        )
    mission = Mission(
        options=options,
        goals=reader.goals_of(options, area),
        start=GeoPoint(lat_deg=options.start.lat, lon_deg=options.start.lon) if options.start else None,
        area=area,
        path=path,
        findings=(*name_findings(options.name, path), *findings),
        refuges=refuges_of(options),
        waters=reader.waters_of(options),
        drying=load_drying(options, path, origin, given, far_m),
    )
    if mission.polar_path is not None:
        _require(
            mission.polar_path,
            str(path),
            "[boat] polar",
            'write a file beside the mission, "ardurover" or a speed in m/s',
        )
    if mission.heights_path is not None:
        _require(mission.heights_path, str(path), "[area] tide", "write a table of heights beside the mission")
    if mission.tide_path is not None:
        _require(mission.tide_path, str(path), "[current] table", "write a tide table beside the mission")
    return mission


def _require(path: Path, source: str, place: str, remedy: str) -> None:
    """Raise InputError, which names the place in the mission, when a file that it names cannot be read."""
    try:
        open_regular(path).close()
    except OSError as error:
        raise unreadable(source, error, f"{place} {path}", remedy) from None


def load_area(
    options: AreaOptions,
    mission_path: Path,
    origin: GeoPoint,
    given: Mapping[Path, bytes] = AS_IT_IS,
    far_m: float = RANGE_M,
    key: str = "obstacles",
) -> tuple[Area, tuple[Finding, ...]]:
    """Return the area that ``[area]`` names and what its files gave rise to; nothing of it is farther than ``far_m``.

    ``key`` is what the mission calls the files of obstacles. Raises InputError.
    """
    folder = mission_path.parent
    obstacles: list[Obstacle] = []
    zones: list[Zone] = []
    findings: list[Finding] = []
    charted: list[Charted] = []

    def load(name: str, key: str, kind: ZoneKind) -> Document:
        path = folder / name
        if path in given:
            document = check_place(
                parse(given[path], str(path), kind=kind, axis=options.axis, areas=True, extension=path.suffix.lower()),
                origin,
                far_m,
            ).require_clean()
        else:
            _require(path, str(mission_path), f"[area] {key}", "paths are relative to the mission file")
            document = read(path, kind=kind, axis=options.axis, near=origin, areas=True, far_m=far_m).require_clean()
        findings.extend(replace(f, source=str(path)) for f in document.findings if f.severity is not FindingLevel.NOTE)
        return document

    for name in options.obstacles:
        document = load(name, key, ZoneKind.EXCLUSION)
        obstacles.extend(document.as_obstacles(options.point_radius_m))
        if document.charted is not None:
            charted.append(document.charted)
            _require_drying(document.charted, options, mission_path, name)
        inside = [z for z in document.zones if z.kind is ZoneKind.INCLUSION]
        if (
            inside
            and options.fence is not None
            and not document.without_zones().marks
            and len(inside) == len(document.zones)
        ):
            raise InputError(
                str(folder / name),
                "",
                f"holds only what to stay inside, and is named in [area] {key}",
                f"name the file of the obstacles; the fence is {options.fence}",
            )
        zones.extend(inside)
    if options.fence is not None:
        document = load(options.fence, "fence", ZoneKind.INCLUSION)
        if all(zone.kind is ZoneKind.EXCLUSION for zone in document.zones):
            only = ", only what to keep out of" if document.zones else ""
            raise InputError(
                str(folder / options.fence),
                "",
                f"holds no polygon or circle to stay inside{only}",
                "draw the fence as an area to stay inside, or name the file in [area] obstacles"
                if only
                else "draw the fence as an area",
            )
        zones.extend(document.zones)
        obstacles.extend(o for o in document.without_zones().as_obstacles(options.point_radius_m))
    area = Area(obstacles=tuple(obstacles), fence=Fence(zones=tuple(zones)), charted=tuple(charted))
    return area, tuple(findings)


def _require_drying(charted: Charted, options: AreaOptions, mission_path: Path, name: str) -> None:
    """Refuse obstacles that leave out what dries, where the mission names none of it: plans would lead over it."""
    if charted.drying and not options.drying:
        raise InputError(
            str(mission_path),
            "[area] drying",
            f"is missing: {name} leaves out what dries, which is in {charted.drying}",
            f'write drying = ["{charted.drying}"] and tide, or import the chart without --drying',
        )


def load_drying(
    options: MissionOptions,
    mission_path: Path,
    origin: GeoPoint,
    given: Mapping[Path, bytes] = AS_IT_IS,
    far_m: float = RANGE_M,
) -> tuple[Obstacle, ...]:
    """Return the water that dries of the files that ``[area] drying`` names. Raises InputError."""
    area = options.area
    if not area.drying:
        return ()
    needs = (("[area] tide", area.tide, "name a table of the tide"), ("[boat] draft_m", options.boat.draft_m, "say it"))
    for key, value, remedy in needs:
        if value is None:
            raise InputError(str(mission_path), "[area] drying", f"needs {key}: it is open by the hour", remedy)
    bare = msgspec.structs.replace(area, obstacles=area.drying, fence=None)
    found, _ = load_area(bare, mission_path, origin, given, far_m, key="drying")
    for number, water in enumerate(found.solids, start=1):
        if water.depth_m is None:
            raise InputError(
                str(mission_path),
                "[area] drying",
                f"{water.name or f'its piece {number}'} has no depth_m",
                "name GeoJSON of `companion chart import --drying`, or put it among the obstacles",
            )
    return found.solids


def check_places(mission: Mission) -> None:
    """Raise InputError if the start, a goal or a refuge is too far off, in an obstacle, or outside the fence."""
    for place, problem, remedy in place_troubles(mission):
        raise InputError(str(mission.path), place, problem, remedy)


def place_troubles(mission: Mission) -> Iterator[tuple[str, str, str]]:
    """Yield (place in the file, what is wrong, remedy) for the start, goals and refuges that are not in free water."""
    if mission.is_passage:
        yield from passage_troubles(mission)
        return
    frame = mission.frame()
    local = mission.area.local(frame)
    places = [(f"[[goal]] {i + 1}", g.point) for i, g in enumerate(mission.goals)]
    places += [(f"[[refuge]] {i + 1}", r.point) for i, r in enumerate(mission.refuges)]
    if mission.start is not None:
        places.insert(0, ("[start]", mission.start))
    for place, point in places:
        east_m, north_m = frame.en_from_geo(point)
        if max(abs(east_m), abs(north_m)) > RANGE_M:
            yield (
                place,
                f"is {np.hypot(east_m, north_m) / 1000.0:.0f} km from the origin",
                f"{_asked(point, mission.origin)} beyond 50 km it is a passage, which says so: [passage] leg_m",
            )
            continue
        problem = trouble_at(local, (east_m, north_m))
        if problem:
            yield (
                place,
                f"{point.lat_deg:.6f}, {point.lon_deg:.6f} {problem}",
                "move it into free water or correct the area's files",
            )
    for number, goal in enumerate(mission.goals, start=1):
        problem = "" if goal.gate is None else gate_trouble(goal.gate, frame, local, mission.margin_floor_m)
        if problem:
            yield f"[[goal]] {number}", problem, "move its marks into free water or correct the area's files"


def passage_troubles(mission: Mission) -> Iterator[tuple[str, str, str]]:
    """Yield the same for a passage, each place in a frame of its own; none is farther than a leg from the one before.

    A refuge may lie a leg from any goal, or from the start.
    """
    leg_m = mission.passage.leg_m or RANGE_M
    goals = [(f"[[goal]] {i + 1}", g.point) for i, g in enumerate(mission.goals)]
    way = goals if mission.start is None else [("[start]", mission.start), *goals]
    refuges = [(f"[[refuge]] {i + 1}", r.point) for i, r in enumerate(mission.refuges)]
    for number, (place, point) in enumerate([*way, *refuges]):
        frame = LocalFrame(point)
        is_goal = number < len(way)
        near = [way[number - 1][1]] if is_goal and number > 0 else [point] if is_goal else [p for _, p in way]
        least_m = min(float(np.hypot(*frame.en_from_geo(other))) for other in near)
        if least_m > leg_m:
            asked = "are lat and lon swapped? " if least_m >= KM_M else "write a longer one: "
            yield (
                place,
                f"is {_far(least_m)} from {way[number - 1][0] if is_goal else 'every goal'}",
                f"{asked}[passage] leg_m says {_far(leg_m)}",
            )
            continue
        local = mission.area.about(frame, RANGE_M)
        problem = trouble_at(local, (0.0, 0.0))
        if problem:
            yield (
                place,
                f"{point.lat_deg:.6f}, {point.lon_deg:.6f} {problem}",
                "move it into free water or correct the area's files",
            )
            continue
        goal = next((g for p, g in zip(goals, mission.goals, strict=True) if p[0] == place), None)
        problem = (
            "" if goal is None or goal.gate is None else gate_trouble(goal.gate, frame, local, mission.margin_floor_m)
        )
        if problem:
            yield place, problem, "move its marks into free water or correct the area's files"


def _far(distance_m: float) -> str:
    """Return a distance in words, below a kilometre in metres."""
    km = distance_m / KM_M
    return f"{distance_m:.0f} m" if km < 1.0 else f"{km:.1f} km" if km < 10.0 else f"{km:.0f} km"


def _asked(point: GeoPoint, origin: GeoPoint) -> str:
    """Ask what may be wrong with a place that is far from the origin: a sign, where its mirror is near."""
    for name, here_deg, there_deg in (("lat", point.lat_deg, origin.lat_deg), ("lon", point.lon_deg, origin.lon_deg)):
        if abs(here_deg + there_deg) < 0.5 < abs(here_deg - there_deg):
            return f"is the sign of {name} wrong, {here_deg:g} for {-here_deg:g}?"
    return "are lat and lon swapped?"


def trouble_at(local: LocalArea, point_en: tuple[float, float]) -> str:
    """Return why a point is not in free water ("" when it is)."""
    point = shapely.points(point_en)
    for name, polygon in zip(local.names, local.polygons, strict=True):
        if shapely.covers(polygon, point):
            return f"is inside the obstacle '{name}'"
    if local.limits is not None and not shapely.covers(local.limits, point):
        return "is outside the fence"
    return ""


OPENING_STEP_M = 1.0


def gate_trouble(gate: GoalGate, frame: LocalFrame, local: LocalArea, floor_m: float) -> str:
    """Return why a gate cannot be sailed through ("" when it can).

    Its opening has the floor's room nowhere, or in more than one part.
    """
    marks = np.asarray([frame.en_from_geo(gate.port), frame.en_from_geo(gate.starboard)])
    width_m = float(np.hypot(*(marks[1] - marks[0])))
    share = min(gate.keep_m / width_m, 0.5)
    steps = np.linspace(share, 1.0 - share, max(2, math.ceil(width_m / OPENING_STEP_M)))
    opening = marks[0] + steps[:, None] * (marks[1] - marks[0])
    clear_m = local.clearance_m(opening)
    # A mark may stand on the shore; a rock between the marks leaves two ways, and none of them is meant.
    roomy = np.flatnonzero(clear_m >= floor_m)
    middle = clear_m[roomy[0] : roomy[-1] + 1] if len(roomy) else clear_m
    if len(roomy) and float(np.min(middle)) >= floor_m:
        return ""
    least = int(np.argmin(middle)) + int(roomy[0]) if len(roomy) else int(np.argmax(clear_m))
    clearance_m, where = float(clear_m[least]), opening[least]
    clear = below_words(max(0.0, clearance_m), floor_m, 0)
    return f"between its marks there are {clear} m to {local.nearest_name(where)}: the margin's floor is {floor_m:g} m"


# What a mission is called: by its name, or by its file's; and what is worth knowing about that.

_NAMELESS = file_name("")


def called(name: str | None, path: Path) -> str:
    """Return a mission's name; of one that has none, its file's."""
    return name if name is not None and name.strip() else path.stem


def name_findings(name: str | None, path: Path) -> tuple[Finding, ...]:
    """Return what is found about the name that a mission file gives (None: it gives none)."""
    own = called(name, path)
    stem = file_name(own)
    if name is not None and not name.strip():
        text, remedy = f"is empty: the mission is called {own!r}, as its file", "write a name, or leave the key out"
    elif "/" in own or "\\" in own or not own.isprintable() or (stem == _NAMELESS and own != stem):
        text = f"{own[:60]!r} cannot be part of a file's name: voyages and state are called {stem!r}"
        remedy = "write it with letters and digits"
    else:
        return ()
    return (Finding(severity=FindingLevel.WARNING, code=Code.FORMAT, place="name", text=text, remedy=remedy),)
