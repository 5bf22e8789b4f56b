"""The voyage as a value: where to go, which side of the buoys, where not to be.

Positions are local (east, north) [m] in ``Voyage.frame``. ``AreaLike`` is what the skipper asks of the geography;
``companion.geofence`` provides it.
"""

from __future__ import annotations

import enum
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray
from shapely.geometry import Polygon
from shapely.geometry.base import BaseGeometry

from companion.boat import Boat, outline_en_m
from companion.field.tree import FieldTree
from companion.geo.frame import RANGE_M, LocalFrame
from companion.geofence import Zone
from companion.skipper.way.drying import DryingWater

PointEn = tuple[float, float]


class Side(enum.Enum):
    """On which side of the boat a buoy is left."""

    NONE = "none"
    PORT = "port"  # turning left around it, as at the WRSC 2009
    STARBOARD = "starboard"


@dataclass(frozen=True, slots=True, kw_only=True)
class Line:
    """Two marks to pass between, the port one on the port hand (``companion.skipper.way.line``).

    Attributes:
        port_en_m: the mark that is left to port.
        starboard_en_m: the mark that is left to starboard.
        keep_m: what is kept clear of each mark.
        margin_m: what is kept clear of anything solid before and beyond it, where there is room.
        not_before_s: a start line's gun, Unix time; an earlier crossing does not count.
        after_s: the same, counted from setting sail.

    """

    port_en_m: PointEn
    starboard_en_m: PointEn
    keep_m: float
    margin_m: float = 0.0
    not_before_s: float | None = None
    after_s: float | None = None

    @property
    def is_start(self) -> bool:
        """Whether it may be crossed from a moment on only."""
        return self.not_before_s is not None or self.after_s is not None


@dataclass(frozen=True, slots=True, kw_only=True)
class Box:
    """Water to stay in, for ``for_s`` from entry on, None: until told to go on."""

    area_en: Polygon
    for_s: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Search:
    """Water to be looked at, to half a swath on either side of the track (``companion.skipper.way.sweeps``).

    ``area_en`` is its free water; the search is done when its sweeps are sailed and ``coverage`` of it was seen.
    """

    area_en: BaseGeometry
    swath_m: float
    coverage: float = 0.95


class Until(enum.Enum):
    """What ends the sailing of a composed field. The order ``go_on`` always does, and so does its time."""

    TOLD = "told"
    TIME = "time"
    PLACE = "place"  # the boat is at the goal
    VESSEL = "vessel"  # another vessel is in its water
    OUTSIDE = "outside"  # the boat is outside of its water


@dataclass(frozen=True, slots=True, kw_only=True)
class Composed:
    """A field to sail by, at the longest for ``for_s``; ``water_en`` is what ``until`` speaks of."""

    tree: FieldTree
    until: Until = Until.TOLD
    for_s: float | None = None
    water_en: Polygon | None = None

    @property
    def until_words(self) -> str:
        """What ends it."""
        at_most = "" if self.for_s is None or self.until is Until.TIME else f", {self.for_s:.0f} s at the most"
        return {
            Until.TOLD: "until told to go on",
            Until.TIME: f"for {self.for_s or 0.0:.0f} s",
            Until.PLACE: "until she is at its place",
            Until.VESSEL: "until a vessel is in its water",
            Until.OUTSIDE: "until she is outside of its water",
        }[self.until] + at_most


@dataclass(frozen=True, slots=True, kw_only=True)
class Goal:
    """A place to reach within ``radius_m``, a buoy to round, or a line to cross.

    With ``side`` the position is the buoy's, which the boat rounds at ``rounding_m``; with ``line`` it is the middle
    between the marks, with ``box`` the roomiest place in it, with
    ``search`` one inside. ``bandwidth_m`` bounds the way from the goal before (or
    the start) to this one: half the width of Büsser's band (section 4.2). ``heading_rad`` is the one that his A*
    arrives with, where it is set by hand (4.1.4). With ``field`` it is steered by that, and
    the position is where the mission on board leads meanwhile.
    """

    en_m: PointEn
    radius_m: float = 5.0
    name: str = ""
    side: Side = Side.NONE
    rounding_m: float = 12.0
    bandwidth_m: float | None = None
    heading_rad: float | None = None
    line: Line | None = None
    box: Box | None = None
    search: Search | None = None
    field: Composed | None = None


class AreaLike(Protocol):
    """What the skipper asks of the geography (local metres); ``companion.geofence.LocalArea`` is one."""

    def clearance_m(self, points_en: ArrayLike) -> NDArray[np.float64]:
        """Return each point's distance to the nearest obstacle or limit [m], negative where it is not free."""
        ...

    def spare_m(self, points_en: ArrayLike, margin_m: float) -> NDArray[np.float64]:
        """Return how much farther off each point is than is kept clear by a margin [m], negative: it is nearer."""
        ...

    def path_clearance_m(self, path_en: ArrayLike) -> float:
        """Return the smallest distance of a polyline (n, 2) to obstacles and limits [m], at most 0 on contact."""
        ...

    @property
    def unfenced(self) -> AreaLike:
        """The obstacles alone: for a boat that has got outside the limits."""
        ...

    @property
    def outer(self) -> AreaLike:
        """The area with one limit fewer, in the end the obstacles alone: for a boat that has got outside."""
        ...

    @property
    def own(self) -> AreaLike:
        """The area with the mission's own limits alone, if it has any."""
        ...

    def __hash__(self) -> int:
        """By identity: what is made of an area is kept by it."""
        ...

    def also(self, names: tuple[str, ...], polygons: tuple[Polygon, ...], margins_m: tuple[float, ...]) -> AreaLike:
        """Return the area with more obstacles."""
        ...

    def within(self, centre_en: PointEn, radius_m: float, name: str) -> AreaLike:
        """Return the area with one limit more: a circle."""
        ...

    def taken_by(self, zones: tuple[Zone, ...], margin_m: float) -> BaseGeometry:
        """Return the water that a fence's zones take and that the margin leaves; empty where there is none."""
        ...

    @property
    def edge_name(self) -> str:
        """What its limits are called."""
        ...

    def without(self, taken: BaseGeometry, name: str, *, is_own: bool = False) -> AreaLike:
        """Return the area less ``taken``, by ``name``: a limit, with ``is_own`` one of the mission's own."""
        ...

    def roomy_en(self, near_en: PointEn, room_m: float) -> PointEn | None:
        """Return the nearest place with ``room_m`` about it, or half of that, or ...; None: there is none."""
        ...

    @property
    def reach_m(self) -> float:
        """How far from the frame's origin it is known [m]."""
        ...

    def nearest_name(self, point_en: ArrayLike) -> str:
        """Return what the nearest obstacle or limit to a point is called; empty in open water."""
        ...

    def obstacles_wkt(self, margin_m: float = 0.0) -> list[str]:
        """Return the obstacles grown by the margin as WKT POLYGONs."""
        ...

    def obstacle_names(self, margin_m: float = 0.0) -> list[str]:
        """Return what each of ``obstacles_wkt`` is called."""
        ...

    def fence_wkt(self, margin_m: float = 0.0, near_en: PointEn | None = None) -> str | None:
        """Return the limits less the margin as a WKT POLYGON, None without any; ValueError when nothing is left."""
        ...


def outside_m(area: AreaLike, en_m: PointEn) -> float:
    """Return how far outside the limits a place is [m], 0 inside them and over an obstacle."""
    clearance = float(area.clearance_m([en_m])[0])
    return max(0.0, -clearance) if clearance < float(area.unfenced.clearance_m([en_m])[0]) else 0.0


def water_at(area: AreaLike, en_m: PointEn) -> AreaLike:
    """Return what there is to keep clear of from a place on: the obstacles, and of the limits those that hold it.

    The autopilot's own fence may leave her outside; the mission's, which may be the shore, stays.
    """
    while outside_m(area, en_m) > 0.0:
        area = area.outer
    return area


def water_to_keep(area: AreaLike, en_m: PointEn) -> AreaLike:
    """Return what a way from a place on keeps clear of: as ``water_at``, but of the mission's own limits always.

    They may be the shore: who is outside of them has only the way back.
    """
    return area if outside_m(area.own, en_m) > 0.0 else water_at(area, en_m)


@dataclass(frozen=True, slots=True, kw_only=True)
class Refuge:
    """A safe place to wait in: there within ``radius_m``."""

    name: str
    en_m: PointEn
    radius_m: float = 15.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Voyage:
    """Goals in their order, sailed ``laps`` times, in ``area``.

    ``onward_en_m`` is where she goes behind the last goal, about: a buoy that is the last is rounded to go there; None:
    she stays. With ``recentre_m`` it is a passage: a frame serves until the boat is so far from its origin, then it is
    replaced (``companion.fold``), and ``area`` is what lies about the frame's origin. Nothing may be farther off than
    ``far_m``.
    ``drying`` is water that is too shallow at some hours only; it is not in ``area``.
    """

    name: str
    frame: LocalFrame
    goals: tuple[Goal, ...]
    area: AreaLike = field(compare=False)
    boat: Boat = field(compare=False)
    laps: int = 1
    refuges: tuple[Refuge, ...] = ()
    drying: tuple[DryingWater, ...] = field(default=(), compare=False)
    onward_en_m: PointEn | None = None
    recentre_m: float | None = None
    far_m: float = RANGE_M  # what lies farther off is not of this water; a passage says what is far for it

    def __post_init__(self) -> None:
        if not self.goals or self.laps < 1:
            raise ValueError("a voyage has at least one goal and one lap")

    def hull_clearance_m(self, en_m: PointEn, heading_rad: float) -> float:
        """Return the distance of the hull's outline to the nearest obstacle or limit [m], at most 0 on contact."""
        return self.area.path_clearance_m(outline_en_m(self.boat.hull, [en_m], [heading_rad])[0])

    @property
    def is_passage(self) -> bool:
        """Whether the frame moves along with the boat."""
        return self.recentre_m is not None

    @property
    def legs(self) -> tuple[Goal, ...]:
        """The goals of all laps in order."""
        return self.goals * self.laps
