"""Goals and refuges of a mission: from what its file says to places on the earth, each kind judged by itself."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from companion.errors import InputError
from companion.geo.frame import LocalFrame
from companion.geofence.area import Area
from companion.geofence.formats.registry import parse, read
from companion.geofence.mission.options import (
    BoxOptions,
    FieldOptions,
    GateOptions,
    GoalOptions,
    LeaveAtomOptions,
    MarkOptions,
    MissionOptions,
    SearchOptions,
)
from companion.geofence.shapes import Shape, ZoneKind, center_of, polygon_en
from companion.messages import GeoPoint
from companion.words import counted

NARROWEST_M = 10.0  # between what is kept clear of the two marks: a track strays 3 m to either side, and tacks
PREVIEW_M = 5.0  # previews sail to within this of a gate's middle
LOITER_ROOM_M = 16.0  # a sailboat's loiter swings 12 m, about a place that is met within 3 m
LEAST_WATER = 0.5  # share of a search's area
MOST_SWEEPS = 200  # each is two plans and two uploads
WIDEST_M = 2000.0  # a longer line is two marks that do not belong together
WATER_M = 3000.0  # across: what a field speaks of, or leads out of, is looked over from where the boat is


@dataclass(frozen=True, slots=True, kw_only=True)
class GoalGate:
    """Two marks to pass between, the port one on the port hand; with a time a start line.

    ``keep_m`` is kept clear of each; ``not_before_s`` is Unix time, ``after_s`` counts from setting sail.
    """

    port: GeoPoint
    starboard: GeoPoint
    keep_m: float
    not_before_s: float | None = None
    after_s: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class GoalBox:
    """Water to stay in: for ``for_s`` from entry on, None: until told to go on."""

    shape: Shape
    for_s: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class GoalSearch:
    """Water to be looked at: what is seen from the track is ``swath_m`` wide; ``coverage`` of it is asked for."""

    shape: Shape
    swath_m: float
    coverage: float


@dataclass(frozen=True, slots=True, kw_only=True)
class GoalField:
    """A field to sail by: its expression, what ends it, the water that this speaks of."""

    text: str
    until: str = "told"
    for_s: float | None = None
    shape: Shape | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class MissionGoal:
    """A mark, reached inside ``radius_m``; ``rounding`` says which side of the boat it is left to.

    With ``gate`` two marks to pass between: ``point`` is the middle, and ``radius_m`` about it is for previews alone.
    With ``box`` or ``search`` some water: ``point`` is the place with the most room in it, and ``radius_m`` that room.
    With ``field`` it is steered by that, and ``point`` is where the mission on board leads meanwhile.
    ``bandwidth_m`` is half the width of the lane that leads here, None: as the mission has it; ``heading_deg`` the
    heading that A* arrives with, None: its own choice.
    """

    point: GeoPoint
    radius_m: float
    rounding: str | None = None
    name: str = ""
    bandwidth_m: float | None = None
    heading_deg: float | None = None
    gate: GoalGate | None = None
    box: GoalBox | None = None
    search: GoalSearch | None = None
    field: GoalField | None = None

    @property
    def is_plain(self) -> bool:
        """Whether it is a place that is reached inside its radius, from any side."""
        return self.rounding is None and not (self.gate or self.box or self.search or self.field)


@dataclass(frozen=True, slots=True, kw_only=True)
class RefugePoint:
    """A safe place to wait in: there inside ``radius_m``."""

    point: GeoPoint
    radius_m: float
    name: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class GoalReader:
    """Makes goals of what a mission file says; ``axis`` is that of ``[area]``. Raises InputError."""

    path: Path
    axis: str

    def origin_of(self, options: MissionOptions) -> GeoPoint:
        """Return the origin of the mission's local frame: the start, or the first goal."""
        if options.start is not None:
            return GeoPoint(lat_deg=options.start.lat, lon_deg=options.start.lon)
        return self._goal(options.goal[0], "[[goal]] 1", Area()).point

    def goals_of(self, options: MissionOptions, area: Area) -> tuple[MissionGoal, ...]:
        """Return the goals; ``area`` is what leaves room in a box."""
        return tuple(self._goal(goal, f"[[goal]] {n}", area) for n, goal in enumerate(options.goal, start=1))

    def _goal(self, goal: GoalOptions, place: str, area: Area) -> MissionGoal:
        if isinstance(goal, GateOptions):
            return _gate(goal, str(self.path), place)
        if isinstance(goal, BoxOptions):
            return self._box(goal, place, area)
        if isinstance(goal, SearchOptions):
            return self._search(goal, place, area)
        point = GeoPoint(lat_deg=goal.lat, lon_deg=goal.lon)
        if isinstance(goal, FieldOptions):
            return MissionGoal(point=point, radius_m=goal.radius_m, name=goal.name, field=self._by_field(goal, place))
        return MissionGoal(
            point=point,
            radius_m=goal.radius_m,
            rounding=goal.rounding,
            name=goal.name,
            bandwidth_m=goal.bandwidth_m,
            heading_deg=goal.heading_deg,
        )

    def waters_of(self, options: MissionOptions) -> dict[str, Shape]:
        """Return the water that each atom of a field leads out of, by its name."""
        return {
            name: self._water(atom.polygon, f"[field.{name}] polygon")
            for name, atom in options.field.items()
            if isinstance(atom, LeaveAtomOptions)
        }

    def _by_field(self, goal: FieldOptions, place: str) -> GoalField:
        source, needs_water = str(self.path), goal.until in {"vessel", "outside"}
        if goal.until == "time" and goal.for_s is None:
            raise InputError(source, f"{place} until", '"time" says no time', "add for_s")
        if needs_water and goal.polygon is None:
            raise InputError(source, f"{place} until", f'"{goal.until}" names no water', "add polygon")
        if goal.polygon is not None and not needs_water:
            raise InputError(
                source,
                f"{place} polygon",
                f'until = "{goal.until}" does not ask for any water',
                'leave it out, or write until = "vessel" or "outside"',
            )
        shape = None if goal.polygon is None else self._water(goal.polygon, f"{place} polygon")
        return GoalField(text=goal.field, until=goal.until, for_s=goal.for_s, shape=shape)

    def _water(self, text: str, place: str) -> Shape:
        shape = self._shape(text, place)
        west, south, east, north = polygon_en(shape, LocalFrame(center_of(shape)), cover=False).bounds
        across_m = float(np.hypot(east - west, north - south))
        if across_m > WATER_M:
            raise InputError(
                str(self.path),
                place,
                f"is {across_m / 1000.0:.1f} km across",
                f"{WATER_M / 1000.0:g} km are the most for what a field leads out of or watches",
            )
        return shape

    def _box(self, goal: BoxOptions, place: str, area: Area) -> MissionGoal:
        shape = self._shape(goal.polygon, f"{place} polygon")
        frame = LocalFrame(center_of(shape))
        water = free_water(shape, frame, area)
        room = shapely.maximum_inscribed_circle(water, tolerance=0.5) if not water.is_empty else None
        room_m = 0.0 if room is None else float(room.length)
        if room is None or room_m < LOITER_ROOM_M:
            raise InputError(
                str(self.path),
                place,
                f"the roomiest place in it has {room_m:.0f} m about it: a loiter needs {LOITER_ROOM_M:g} m",
                "draw a larger box, or in freer water",
            )
        return MissionGoal(
            point=frame.geo_from_en(*room.coords[0]),
            radius_m=room_m,
            name=goal.name,
            box=GoalBox(shape=shape, for_s=goal.for_s),
        )

    def _search(self, goal: SearchOptions, place: str, area: Area) -> MissionGoal:
        shape = self._shape(goal.polygon, f"{place} polygon")
        frame = LocalFrame(center_of(shape))
        whole, water = polygon_en(shape, frame, cover=False), free_water(shape, frame, area)
        share = float(water.area / whole.area)
        if share < LEAST_WATER:
            raise InputError(
                str(self.path),
                place,
                f"only {100.0 * share:.0f} % of it is free water",
                "draw it in the water, or correct the area's files",
            )
        sweeps = float(water.area) / goal.swath_m / max(goal.swath_m, float(np.sqrt(whole.area)))
        if sweeps > MOST_SWEEPS:
            raise InputError(
                str(self.path),
                f"{place} swath_m",
                f"{goal.swath_m:g} m make about {sweeps:.0f} sweeps",
                f"write a larger swath, or a smaller area: {MOST_SWEEPS} are the most",
            )
        if goal.swath_m > float(np.sqrt(whole.area)):
            raise InputError(
                str(self.path),
                f"{place} swath_m",
                f"{goal.swath_m:g} m is wider than the area itself",
                "write what is seen from the track, or make it a point to sail to",
            )
        room = shapely.maximum_inscribed_circle(water, tolerance=0.5)
        return MissionGoal(
            point=frame.geo_from_en(*room.coords[0]),
            radius_m=float(room.length),
            name=goal.name,
            search=GoalSearch(shape=shape, swath_m=goal.swath_m, coverage=goal.coverage),
        )

    def _shape(self, text: str, place: str) -> Shape:
        """Return the one polygon or circle that WKT, or a file, holds."""
        source = str(self.path)
        if is_file(text):
            path = self.path.parent / text
            if not path.is_file():
                raise InputError(
                    source,
                    f"{place} {text}",
                    "there is no such file",
                    "write POLYGON ((lon lat, ...)), or a file beside the mission",
                )
            document = read(path, kind=ZoneKind.INCLUSION, axis=self.axis, areas=True).require_clean()
        else:
            document = parse(
                text.encode(), f"{source}: {place}", kind=ZoneKind.INCLUSION, axis=self.axis
            ).require_clean()
        if len(document.zones) != 1:
            raise InputError(source, place, f"holds {counted(len(document.zones), 'polygon')}", "one is meant")
        return document.zones[0].shape


def is_file(polygon: str) -> bool:
    """Return whether the ``polygon`` of a goal names a file; else it is WKT."""
    return "(" not in polygon


def free_water(shape: Shape, frame: LocalFrame, area: Area) -> BaseGeometry:
    """Return what is free water of a shape in ``frame`` [m]: inside the limits and not on an obstacle."""
    local = area.local(frame)
    water: BaseGeometry = polygon_en(shape, frame, cover=False)
    if local.polygons:
        water = shapely.difference(water, local.solid)
    return water if local.limits is None else shapely.intersection(water, local.limits)


def refuges_of(options: MissionOptions) -> tuple[RefugePoint, ...]:
    """Return the refuges of a mission file, called by their number where they have no name."""
    return tuple(
        RefugePoint(point=GeoPoint(lat_deg=r.lat, lon_deg=r.lon), radius_m=r.radius_m, name=r.name or f"{n}")
        for n, r in enumerate(options.refuge, start=1)
    )


def _gate(goal: GateOptions, source: str, place: str) -> MissionGoal:
    port, starboard = _point(goal.port_mark), _point(goal.starboard_mark)
    frame = LocalFrame(port)
    east_m, north_m = frame.en_from_geo(starboard)
    width_m = (east_m**2 + north_m**2) ** 0.5
    if goal.not_before is not None and goal.after_s is not None:
        raise InputError(source, f"{place} after_s", "not_before names the gun already", "write one of them")
    least_m = 2.0 * goal.mark_radius_m + NARROWEST_M
    if width_m < least_m:
        raise InputError(
            source,
            place,
            f"its marks are {width_m:.1f} m apart: {NARROWEST_M:g} m are needed between "
            f"what is kept clear of them, {least_m:g} m in all",
            "move the marks apart, or write a smaller mark_radius_m",
        )
    if width_m > WIDEST_M:
        raise InputError(
            source,
            place,
            f"its marks are {width_m / 1000.0:.1f} km apart",
            "are lat and lon right? a line is 2 km long at the most",
        )
    gate = GoalGate(
        port=port,
        starboard=starboard,
        keep_m=goal.mark_radius_m,
        after_s=goal.after_s,
        not_before_s=None if goal.not_before is None else goal.not_before.timestamp(),
    )
    middle = frame.geo_from_en(0.5 * east_m, 0.5 * north_m)
    return MissionGoal(point=middle, radius_m=PREVIEW_M, name=goal.name, gate=gate)


def _point(mark: MarkOptions) -> GeoPoint:
    return GeoPoint(lat_deg=mark.lat, lon_deg=mark.lon)
