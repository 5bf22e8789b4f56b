"""The sketch: what of a mission is drawn, as the page has it, and the options of a mission file that it stands for.

Places are (latitude, longitude) in degrees. What a sketch does not say of a mission, its file keeps.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Literal

import msgspec
from msgspec import Meta, Struct

from companion.errors import InputError
from companion.geofence.mission import (
    BoxOptions,
    FieldOptions,
    GateOptions,
    GoalOptions,
    Latitude,
    Longitude,
    MarkOptions,
    MissionOptions,
    PointOptions,
    RefugeOptions,
    SearchOptions,
    StartOptions,
    is_file,
    kind_of,
    options_in,
)

MOST_VERTICES = 20_000  # of all that is drawn by hand: a coast of more is shown, and edited where it was made
MOST_GOALS = 1000

Place = tuple[Latitude, Longitude]
Ring = Annotated[tuple[Place, ...], Meta(max_length=MOST_VERTICES)]
Name = Annotated[str, Meta(max_length=200)]
Key = Annotated[int, Meta(ge=0)] | None
Zone = Literal["inclusion", "exclusion"]


class Shape(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """An obstacle or a limit. ``of`` is its file, ``key`` its number there (from 0), None: it is new.

    ``rings``: of a polygon the outer one and its holes, not closed; of a circle or a point its place; of a line its
    places. ``margin_m``: its own, None: the mission's.
    """

    type: Literal["polygon", "circle", "point", "line"]
    zone: Zone = "exclusion"
    rings: Annotated[tuple[Ring, ...], Meta(max_length=1000)]
    radius_m: Annotated[float, Meta(gt=0.0, le=1e6)] | None = None
    margin_m: Annotated[float, Meta(ge=0.0, le=1000.0)] | None = None
    name: Name = ""
    of: str = ""
    key: Key = None

    @property
    def content(self) -> Shape:
        """The shape without where it is written."""
        return msgspec.structs.replace(self, of="", key=None)


class SketchedGoal(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A goal of any kind; ``key`` is its number in the file (from 0), None: it is new.

    ``ring``: of a box or a search, where its file has it as one; None where it is in a file of its own, ``polygon``.
    """

    kind: Literal["point", "gate", "box", "search", "field"]
    key: Key = None
    name: Name = ""
    at: Place | None = None
    radius_m: float | None = None
    rounding: Literal["port", "starboard"] | None = None
    port_mark: Place | None = None
    starboard_mark: Place | None = None
    mark_radius_m: float | None = None
    after_s: float | None = None
    ring: Ring | None = None
    for_s: float | None = None
    swath_m: float | None = None
    coverage: float | None = None
    polygon: str | None = None
    field: str | None = None
    until: str | None = None


class SketchedRefuge(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A refuge."""

    at: Place
    radius_m: float = 15.0
    name: Name = ""
    key: Key = None


class SketchedStart(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Where the boat starts."""

    at: Place
    heading_deg: float = 0.0


class Sketch(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """What is drawn of a mission. ``revision`` names the files that the keys are of."""

    revision: str
    name: Name | None = None
    start: SketchedStart | None = None
    goals: Annotated[tuple[SketchedGoal, ...], Meta(max_length=MOST_GOALS)] = ()
    refuges: Annotated[tuple[SketchedRefuge, ...], Meta(max_length=MOST_GOALS)] = ()
    shapes: Annotated[tuple[Shape, ...], Meta(max_length=MOST_VERTICES)] = ()
    margin_m: float = 12.0
    margin_floor_m: float = 6.0
    point_radius_m: float = 10.0
    end: Literal["loiter", "home"] = "loiter"
    laps: int = 1


def sketched(options: MissionOptions, shapes: Sequence[Shape], revision: str) -> Sketch:
    """Return the sketch of a mission's options and of the shapes of its files."""
    start, area, skipper = options.start, options.area, options.skipper
    return Sketch(
        revision=revision,
        name=options.name,
        shapes=tuple(shapes),
        start=None if start is None else SketchedStart(at=(start.lat, start.lon), heading_deg=start.heading_deg),
        goals=tuple(_sketched(goal, n) for n, goal in enumerate(options.goal)),
        refuges=tuple(
            SketchedRefuge(at=(r.lat, r.lon), radius_m=r.radius_m, name=r.name, key=n)
            for n, r in enumerate(options.refuge)
        ),
        margin_m=area.margin_m,
        margin_floor_m=area.margin_floor_m,
        point_radius_m=area.point_radius_m,
        end=skipper.end,
        laps=skipper.laps,
    )


def _sketched(goal: GoalOptions, key: int) -> SketchedGoal:
    if isinstance(goal, PointOptions):
        return SketchedGoal(
            kind="point",
            key=key,
            name=goal.name,
            at=(goal.lat, goal.lon),
            radius_m=goal.radius_m,
            rounding=goal.rounding,
        )
    if isinstance(goal, GateOptions):
        return SketchedGoal(
            kind="gate",
            key=key,
            name=goal.name,
            port_mark=(goal.port_mark.lat, goal.port_mark.lon),
            starboard_mark=(goal.starboard_mark.lat, goal.starboard_mark.lon),
            mark_radius_m=goal.mark_radius_m,
            after_s=goal.after_s,
        )
    if isinstance(goal, FieldOptions):
        return SketchedGoal(
            kind="field",
            key=key,
            name=goal.name,
            at=(goal.lat, goal.lon),
            radius_m=goal.radius_m,
            for_s=goal.for_s,
            polygon=goal.polygon,
            field=goal.field,
            until=goal.until,
        )
    ring = _ring_of(goal.polygon)
    own = goal.polygon if ring is None else None
    if isinstance(goal, BoxOptions):
        return SketchedGoal(kind="box", key=key, name=goal.name, ring=ring, polygon=own, for_s=goal.for_s)
    return SketchedGoal(
        kind="search", key=key, name=goal.name, ring=ring, polygon=own, swath_m=goal.swath_m, coverage=goal.coverage
    )


def _ring_of(polygon: str) -> Ring | None:
    """Return the one ring of WKT; None of a file, and of what is no single ring."""
    from companion.geofence.formats import drawings_of

    if is_file(polygon):
        return None
    try:
        drawings = drawings_of(polygon, "")
    except InputError:
        return None
    geometries = [g for drawing in drawings for g in drawing.geometries]
    if len(geometries) != 1 or geometries[0][0] != "POLYGON" or not isinstance(geometries[0][1], list):
        return None
    rings = geometries[0][1]
    if len(rings) != 1 or len(rings[0]) < 4 or rings[0][0] != rings[0][-1]:
        return None
    return tuple((y, x) for x, y in rings[0][:-1])


def options_of(sketch: Sketch, before: MissionOptions, source: str) -> MissionOptions:
    """Return the options that a sketch stands for, whose shapes' files are left as they are.

    Raises:
        InputError: a value is missing or out of its range; ``source`` and its place are named.
    """
    replace = msgspec.structs.replace
    heading = None if sketch.start is None else sketch.start.heading_deg
    made = replace(
        before,
        name=sketch.name,
        start=None
        if sketch.start is None
        else StartOptions(lat=sketch.start.at[0], lon=sketch.start.at[1], heading_deg=heading or 0.0),
        goal=tuple(_goal(goal, n, before, source) for n, goal in enumerate(sketch.goals, start=1)),
        refuge=tuple(RefugeOptions(lat=r.at[0], lon=r.at[1], radius_m=r.radius_m, name=r.name) for r in sketch.refuges),
        area=replace(
            before.area,
            margin_m=sketch.margin_m,
            margin_floor_m=sketch.margin_floor_m,
            point_radius_m=sketch.point_radius_m,
        ),
        skipper=replace(before.skipper, end=sketch.end, laps=sketch.laps),
    )
    return options_in(msgspec.to_builtins(made), source)


def _goal(goal: SketchedGoal, number: int, before: MissionOptions, source: str) -> GoalOptions:
    """Return what a goal of a sketch stands for; what it leaves out is as it was, or has its default."""
    where = f"[[goal]] {number}"
    old = before.goal[goal.key] if goal.key is not None and goal.key < len(before.goal) else None
    old = old if old is not None and kind_of(old) == goal.kind else None
    if goal.kind == "point":
        if goal.at is None:
            raise InputError(source, where, "has no place", "put it on the chart")
        made = PointOptions(
            lat=goal.at[0],
            lon=goal.at[1],
            name=goal.name,
            rounding=goal.rounding,
            bandwidth_m=old.bandwidth_m if isinstance(old, PointOptions) else None,
            heading_deg=old.heading_deg if isinstance(old, PointOptions) else None,
        )
        return _with(made, radius_m=goal.radius_m)
    if goal.kind == "gate":
        if goal.port_mark is None or goal.starboard_mark is None:
            raise InputError(source, where, "is a gate without two marks", "put both on the chart")
        marks = [MarkOptions(lat=lat, lon=lon) for lat, lon in (goal.port_mark, goal.starboard_mark)]
        gate = GateOptions(
            port_mark=marks[0],
            starboard_mark=marks[1],
            name=goal.name,
            after_s=goal.after_s,
            not_before=old.not_before if isinstance(old, GateOptions) else None,
        )
        return _with(gate, mark_radius_m=goal.mark_radius_m)
    if goal.kind == "field":
        if goal.at is None or goal.field is None:
            raise InputError(
                source, where, "is a field without its place or its expression", "write both into the file"
            )
        field = FieldOptions(
            lat=goal.at[0], lon=goal.at[1], field=goal.field, name=goal.name, for_s=goal.for_s, polygon=goal.polygon
        )
        return _with(field, radius_m=goal.radius_m, until=goal.until)
    polygon = goal.polygon if goal.ring is None else _wkt_of(goal.ring)
    if isinstance(old, BoxOptions | SearchOptions) and goal.ring is not None and _ring_of(old.polygon) == goal.ring:
        polygon = old.polygon
    if polygon is None:
        raise InputError(source, where, "has no polygon", "draw it")
    if goal.kind == "box":
        return BoxOptions(polygon=polygon, for_s=goal.for_s, name=goal.name)
    if goal.swath_m is None:
        raise InputError(source, where, "is a search without a swath", "say swath_m")
    return _with(SearchOptions(polygon=polygon, swath_m=goal.swath_m, name=goal.name), coverage=goal.coverage)


def _with(goal: GoalOptions, **values: float | str | None) -> GoalOptions:
    given = {key: value for key, value in values.items() if value is not None}
    return msgspec.structs.replace(goal, **given) if given else goal


def _wkt_of(ring: Ring) -> str:
    return f"POLYGON (({', '.join(f'{number(lon)} {number(lat)}' for lat, lon in (*ring, *ring[:1]))}))"


def number(value: float) -> str:
    """Return a coordinate as text, which is read again as the same number, without an exponent.

    >>> number(50.817), number(-0.0000001)
    ('50.817', '-0.0000001')
    """
    text = repr(float(value))
    return f"{value:.20f}".rstrip("0") if "e" in text else text
