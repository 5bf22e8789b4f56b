"""A composed field: its atoms where they lie, its expression, and the field that they make in the wind of now.

``Tree`` is a value, as a mission file says it. ``field_of`` makes Schmitt's binary tree of it, ``zone_of`` the band
about its trajectory in which q is kept: that of the first atom that is one (a line, a circle, a point).
"""

from __future__ import annotations

import functools
from dataclasses import dataclass, field

import numpy as np
from shapely.geometry import Polygon

from companion.field.algebra import (
    CIRCLE_RADIUS_M,
    NOMINAL,
    ZONE_M,
    AttractivePoint,
    Circle,
    Field,
    Longer,
    RepulsivePoint,
    Uniform,
    Vectors,
    line_between,
    repulsive_line_between,
)
from companion.field.expression import Added, Expression, Longest, Named, Projected, Weighed, names_in, printed
from companion.field.leave import WayOut
from companion.field.projection import Projection, RingZone, Zone
from companion.field.values import Habits, Situation

PointEn = tuple[float, float]
LEAST = 0.05 * NOMINAL   # a field weaker than this says nothing of where to go
RING_SHARE = 0.25        # of a small circle's radius: half the width of its zone


@dataclass(frozen=True, slots=True, kw_only=True)
class PointTo:
    """Towards a place."""

    at_en: PointEn
    zone_m: float = ZONE_M


@dataclass(frozen=True, slots=True, kw_only=True)
class StayAt:
    """Towards a place, and about it once she is there."""

    at_en: PointEn
    zone_m: float = 15.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Along:
    """Along the line from one place to another, and on beyond it."""

    from_en: PointEn
    to_en: PointEn
    zone_m: float = ZONE_M


@dataclass(frozen=True, slots=True, kw_only=True)
class Round:
    """Onto a circle and round it."""

    at_en: PointEn
    radius_m: float
    is_clockwise: bool = True
    zone_m: float = ZONE_M


@dataclass(frozen=True, slots=True, kw_only=True)
class AwayFrom:
    """Away from a place, within about ``range_m`` of it."""

    at_en: PointEn
    range_m: float


@dataclass(frozen=True, slots=True, kw_only=True)
class AwayFromLine:
    """Away from the endless line through two places."""

    from_en: PointEn
    to_en: PointEn
    range_m: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Heading:
    """The same heading everywhere."""

    heading_rad: float


@dataclass(frozen=True, slots=True, kw_only=True)
class OutOf:
    """Out of some water by the heading that is soonest out."""

    water_en: Polygon


Atom = PointTo | StayAt | Along | Round | AwayFrom | AwayFromLine | Heading | OutOf


@dataclass(frozen=True, slots=True, kw_only=True)
class Tree:
    """An expression and the atoms that it names."""

    expression: Expression
    atoms: tuple[tuple[str, Atom], ...]

    @property
    def text(self) -> str:
        """The expression as a mission has it."""
        return printed(self.expression)

    def atom(self, name: str) -> Atom:
        """Return an atom by its name."""
        return dict(self.atoms)[name]

    @property
    def station_en(self) -> PointEn | None:
        """Where the first ``StayAt`` of the expression lies, None: it has none."""
        atoms = (self.atom(name) for name in names_in(self.expression))
        return next((atom.at_en for atom in atoms if isinstance(atom, StayAt)), None)

    @property
    def leaves(self) -> Polygon | None:
        """The water that the first ``OutOf`` of the expression leads out of, None: it has none."""
        atoms = (self.atom(name) for name in names_in(self.expression))
        return next((atom.water_en for atom in atoms if isinstance(atom, OutOf)), None)


@dataclass(frozen=True, slots=True, kw_only=True)
class Conditions:
    """What a tree depends on besides the place.

    ``seen`` is the boat among the vessels that a way out keeps clear of; ``way_out_rad`` is the one that was found for
    her, None: it is looked for at each place. Without a wind nothing is projected: a motorboat goes where it points.
    """

    seen: Situation
    habits: Habits = field(default_factory=Habits)
    way_out_rad: float | None = None

    @property
    def twd_from_rad(self) -> float | None:
        """Where the wind comes from, None: it does not matter."""
        return self.seen.twd_from_rad if self.habits.is_sailing else None


@dataclass(frozen=True, slots=True)
class _Nothing(Field):
    """No vector anywhere."""

    def evaluate(self, p: Vectors) -> Vectors:
        """Return the vectors (n, 2)."""
        return np.zeros_like(p)


def field_of(tree: Tree, conditions: Conditions, *, without_station: bool = False) -> Field:
    """Return the field of a tree, its last projection left to who steers by it; ``without_station``: less its stays."""
    def made(node: Expression) -> Field:
        if isinstance(node, Named):
            atom = tree.atom(node.name)
            return _Nothing() if without_station and isinstance(atom, StayAt) else _atom_field(atom, conditions)
        if isinstance(node, Weighed):
            return made(node.part) * node.weight
        if isinstance(node, Added):
            return functools.reduce(lambda a, b: a + b, map(made, node.parts))
        if isinstance(node, Longest):
            return functools.reduce(Longer, map(made, node.parts))
        return _Sailable(made(node.part), conditions, _zone_in(tree, node.part, conditions))

    return made(tree.expression)


def zone_of(tree: Tree, conditions: Conditions) -> Zone | RingZone | None:
    """Return the band about the tree's trajectory, None: it has none, or no wind to be kept out of."""
    return _zone_in(tree, tree.expression, conditions)


def lengths(tree: Tree, conditions: Conditions, points_en: Vectors) -> Vectors:
    """Return how strong the field is at points (n, 2), (n,)."""
    v = field_of(tree, conditions)(points_en)
    return np.asarray(np.hypot(v[:, 0], v[:, 1]), dtype=np.float64)


@dataclass(frozen=True, slots=True)
class _Sailable(Field):
    """A part out of the no-go zone: inside its own zone by q = 1, which is the boat's to move at the last step only."""

    part: Field
    conditions: Conditions
    zone: Zone | RingZone | None

    def evaluate(self, p: Vectors) -> Vectors:
        """Return the vectors (n, 2)."""
        twd = self.conditions.twd_from_rad
        if twd is None:
            return self.part.evaluate(p)
        return Projection(field=self.part, twd_from_rad=twd, zone=self.zone,
                          no_go_half_rad=self.conditions.habits.no_go_half_rad).evaluate(p)


def _atom_field(atom: Atom, conditions: Conditions) -> Field:
    if isinstance(atom, PointTo | StayAt):
        return AttractivePoint().shifted(*atom.at_en)
    if isinstance(atom, Along):
        return line_between(atom.from_en, atom.to_en, atom.zone_m)
    if isinstance(atom, Round):
        circle = Circle(v0=NOMINAL if atom.is_clockwise else -NOMINAL)
        return circle.enlarged(atom.radius_m / CIRCLE_RADIUS_M).shifted(*atom.at_en)
    if isinstance(atom, AwayFrom):
        return RepulsivePoint(sigma_m=atom.range_m).shifted(*atom.at_en)
    if isinstance(atom, AwayFromLine):
        return repulsive_line_between(atom.from_en, atom.to_en, atom.range_m)
    if isinstance(atom, Heading):
        return Uniform(atom.heading_rad)
    return WayOut(atom.water_en, conditions.seen, conditions.habits, conditions.way_out_rad)


def _zone_in(tree: Tree, node: Expression, conditions: Conditions) -> Zone | RingZone | None:
    twd = conditions.twd_from_rad
    if twd is None:
        return None
    if isinstance(node, Named):
        return _atom_zone(tree.atom(node.name), twd)
    if isinstance(node, Weighed | Projected):
        return _zone_in(tree, node.part, conditions)
    return next((z for z in (_zone_in(tree, p, conditions) for p in node.parts) if z is not None), None)


def _atom_zone(atom: Atom, twd_from_rad: float) -> Zone | RingZone | None:
    if isinstance(atom, PointTo | StayAt):
        return Zone.of_point(atom.at_en, twd_from_rad, atom.zone_m)
    if isinstance(atom, Along):
        return Zone.of_line(atom.from_en, atom.to_en, atom.zone_m)
    if isinstance(atom, Round):
        return RingZone(at_en=atom.at_en, radius_m=atom.radius_m, is_clockwise=atom.is_clockwise,
                        half_m=min(atom.zone_m, RING_SHARE * atom.radius_m))
    return None
