"""A composed field: its atoms where they lie, its expression, and the field that they make in the wind of now.

``FieldTree`` is a value, as a mission file says it. ``field_of`` makes Schmitt's binary tree of it, ``zone_of`` the
band about its trajectory in which q is kept: that of the first atom that is one (a line, a circle, a point).
"""

from __future__ import annotations

import difflib
import functools
import re
from collections.abc import Collection
from dataclasses import dataclass, field

import numpy as np
from shapely.geometry import Polygon

from companion.errors import InputError
from companion.field.look_ahead import WayOut
from companion.field.projection import HysteresisRing, HysteresisZone, Projection
from companion.field.values import GuidanceSettings, Situation
from companion.field.vector_fields import (
    CIRCLE_RADIUS_M,
    NOMINAL,
    ZONE_M,
    AttractiveCircle,
    AttractivePoint,
    Field,
    Longer,
    RepulsivePoint,
    Uniform,
    Vectors,
    line_between,
    repulsive_line_between,
)

# The text of a composed field: Schmitt's binary tree as a sailor writes it, read and printed.
#
# Atoms have names; where they lie and how large they are is theirs to know (Schmitt's rotate, shift and scalar). An
# expression adds them, weighs them, takes the longer of two vectors, and projects a part out of the no-go zone::
#
#     ring + 0.5 * islet
#     max(lane, 2 * (ship + islet))
#     project(lane) + islet
#
# What is printed is read again as the same tree.

MOST_CHARACTERS = 1000
MOST_NESTED = 20
MOST_WEIGHT = 100.0
MAX, PROJECT = "max", "project"
_NAME = re.compile(r"[A-Za-z_]\w*", re.ASCII)
_TOKEN = re.compile(
    r"\s*(?:(?P<number>(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)|(?P<name>[A-Za-z_]\w*)|(?P<mark>[-+*(),]))", re.ASCII
)


@dataclass(frozen=True, slots=True)
class Named:
    """An atom, by its name."""

    name: str


@dataclass(frozen=True, slots=True)
class Weighed:
    """A field whose vectors are ``weight`` times as long."""

    weight: float
    part: Expression


@dataclass(frozen=True, slots=True)
class Added:
    """The sum of two fields or more."""

    parts: tuple[Expression, ...]


@dataclass(frozen=True, slots=True)
class Longest:
    """At each place the longest vector of two fields or more."""

    parts: tuple[Expression, ...]


@dataclass(frozen=True, slots=True)
class Projected:
    """A field out of the no-go zone, before it is added to others."""

    part: Expression


Expression = Named | Weighed | Added | Longest | Projected


def is_name(word: str) -> bool:
    """Return whether a word can name an atom."""
    return _NAME.fullmatch(word) is not None and word not in {MAX, PROJECT}


def printed(expression: Expression) -> str:
    """Return an expression as text."""
    if isinstance(expression, Named):
        return expression.name
    if isinstance(expression, Weighed):
        return f"{expression.weight!r} * {_factor(expression.part)}".replace(".0 *", " *")
    if isinstance(expression, Added):
        return " + ".join(f"({printed(p)})" if isinstance(p, Added) else printed(p) for p in expression.parts)
    if isinstance(expression, Longest):
        return f"{MAX}({', '.join(printed(p) for p in expression.parts)})"
    return f"{PROJECT}({printed(expression.part)})"


def _factor(expression: Expression) -> str:
    text = printed(expression)
    return f"({text})" if isinstance(expression, Added | Weighed) else text


def names_in(expression: Expression) -> tuple[str, ...]:
    """Return the names of the atoms, each once, in the order of the text."""
    if isinstance(expression, Named):
        return (expression.name,)
    parts = expression.parts if isinstance(expression, Added | Longest) else (expression.part,)
    return tuple(dict.fromkeys(name for part in parts for name in names_in(part)))


def projects(expression: Expression) -> bool:
    """Return whether a part is projected by itself."""
    if isinstance(expression, Added | Longest):
        return any(projects(p) for p in expression.parts)
    return isinstance(expression, Projected) or (isinstance(expression, Weighed) and projects(expression.part))


def parse(text: str, names: Collection[str], source: str, place: str) -> Expression:
    """Read an expression of atoms called ``names``.

    Raises:
        InputError: one line with the source, the place, the character, and what to write instead.
    """
    if len(text) > MOST_CHARACTERS:
        raise InputError(source, place, f"is {len(text)} characters long", f"{MOST_CHARACTERS} are the most")
    return _Reader(text, names, source, place).whole()


class _Reader:
    """Reads one expression, from left to right."""

    def __init__(self, text: str, names: Collection[str], source: str, place: str) -> None:
        self._text, self._names, self._source, self._place = text, names, source, place
        self._at = self._depth = 0

    def whole(self) -> Expression:
        """Return the expression that the whole text is."""
        if not self._text.strip():
            raise self._wrong("is empty", f"write atoms that are added: {self._known()}")
        found = self._sum()
        kind, word = self._next()
        if kind:
            raise self._wrong(f"{word!r} follows a field", "fields are joined by +, in max(...) and project(...)")
        return found

    def _sum(self) -> Expression:
        self._depth += 1
        if self._depth > MOST_NESTED:
            raise self._wrong("is nested too deeply", f"{MOST_NESTED} brackets are the most")
        parts = [self._term()]
        while self._next() == ("mark", "+"):
            self._take()
            parts.append(self._term())
        self._depth -= 1
        return parts[0] if len(parts) == 1 else Added(tuple(parts))

    def _term(self) -> Expression:
        kind, word = self._next()
        if kind != "number":
            return self._part()
        at = self._at
        self._take()
        weight = float(word)
        if not 0.0 < weight <= MOST_WEIGHT:
            self._at = at
            raise self._wrong(f"the weight {word[:20]} is out of range", f"write one above 0 and up to {MOST_WEIGHT:g}")
        if self._next() != ("mark", "*"):
            raise self._wrong("a number stands alone", "a weight goes before a field: 0.5 * islet")
        self._take()
        return Weighed(weight, self._part())

    def _part(self) -> Expression:
        kind, word = self._next()
        if (kind, word) == ("mark", "("):
            self._take()
            inner = self._sum()
            self._close()
            return inner
        if kind == "name":
            return self._word(word)
        if word == "-":
            raise self._wrong("fields are not taken from each other", "add a repulsive one")
        raise self._wrong(
            "a field is missing" + (f" before {word!r}" if word else " at the end"),
            f"write the name of an atom: {self._known()}",
        )

    def _word(self, word: str) -> Expression:
        begin = self._at
        self._take()
        if word in {MAX, PROJECT}:
            if self._next() != ("mark", "("):
                raise self._wrong(f"{word} has no bracket", f"write {word}(...)")
            self._take()
            parts = [self._sum()]
            while word == MAX and self._next() == ("mark", ","):
                self._take()
                parts.append(self._sum())
            self._close()
            if word == PROJECT:
                return Projected(parts[0])
            if len(parts) < 2:
                raise self._wrong("max has one field alone", "write two or more, with commas")
            return Longest(tuple(parts))
        if word not in self._names:
            self._at = begin
            near = difflib.get_close_matches(word, [*self._names, MAX, PROJECT], n=1, cutoff=0.5)
            remedy = f"did you mean {near[0]!r}?" if near else f"there is: {self._known()}"
            raise self._wrong(f"there is no atom {word[:40]!r}", remedy)
        return Named(word)

    def _close(self) -> None:
        kind, word = self._next()
        if (kind, word) != ("mark", ")"):
            raise self._wrong("a bracket is not closed" if not kind else f"{word!r} where a bracket closes", "write )")
        self._take()

    def _next(self) -> tuple[str, str]:
        """Return the kind and the text of what comes next, ("", "") at the end."""
        match = _TOKEN.match(self._text, self._at)
        if match is None:
            rest = self._text[self._at :].strip()
            if rest:
                raise self._wrong(f"{rest[0]!r} is no part of an expression", "names, numbers, + * ( ) and commas are")
            return "", ""
        kind = match.lastgroup or ""
        return kind, match.group(kind)

    def _take(self) -> None:
        match = _TOKEN.match(self._text, self._at)
        self._at = len(self._text) if match is None else match.end()

    def _known(self) -> str:
        return ", ".join(self._names) if self._names else "none, add a table [field.NAME]"

    def _wrong(self, problem: str, remedy: str) -> InputError:
        rest = self._text[self._at :]
        where = self._at + len(rest) - len(rest.lstrip()) + 1
        return InputError(self._source, f"{self._place}, character {where}", problem, remedy)


PointEn = tuple[float, float]
LEAST = 0.05 * NOMINAL  # a field weaker than this says nothing of where to go
RING_SHARE = 0.25  # of a small circle's radius: half the width of its zone


@dataclass(frozen=True, slots=True, kw_only=True)
class PointTo:
    """Towards a place."""

    at_en: PointEn
    zone_m: float = ZONE_M


@dataclass(frozen=True, slots=True, kw_only=True)
class StayAt:
    """Towards a place, and about it once it is there."""

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
class FieldTree:
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
class FieldConditions:
    """What a tree depends on besides the place.

    ``seen`` is the boat among the vessels that a way out keeps clear of; ``way_out_rad`` is the one that was found for
    it, None: it is looked for at each place. Without a wind nothing is projected: a motorboat goes where it points.
    """

    seen: Situation
    habits: GuidanceSettings = field(default_factory=GuidanceSettings)
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


def field_of(tree: FieldTree, conditions: FieldConditions, *, without_station: bool = False) -> Field:
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


def zone_of(tree: FieldTree, conditions: FieldConditions) -> HysteresisZone | HysteresisRing | None:
    """Return the band about the tree's trajectory, None: it has none, or no wind to be kept out of."""
    return _zone_in(tree, tree.expression, conditions)


def lengths(tree: FieldTree, conditions: FieldConditions, points_en: Vectors) -> Vectors:
    """Return how strong the field is at points (n, 2), (n,)."""
    v = field_of(tree, conditions)(points_en)
    return np.asarray(np.hypot(v[:, 0], v[:, 1]), dtype=np.float64)


@dataclass(frozen=True, slots=True)
class _Sailable(Field):
    """A part out of the no-go zone: inside its own zone by q = 1, which is the boat's to move at the last step only."""

    part: Field
    conditions: FieldConditions
    zone: HysteresisZone | HysteresisRing | None

    def evaluate(self, p: Vectors) -> Vectors:
        """Return the vectors (n, 2)."""
        twd = self.conditions.twd_from_rad
        if twd is None:
            return self.part.evaluate(p)
        return Projection(
            field=self.part, twd_from_rad=twd, zone=self.zone, no_go_half_rad=self.conditions.habits.no_go_half_rad
        ).evaluate(p)


def _atom_field(atom: Atom, conditions: FieldConditions) -> Field:
    if isinstance(atom, PointTo | StayAt):
        return AttractivePoint().shifted(*atom.at_en)
    if isinstance(atom, Along):
        return line_between(atom.from_en, atom.to_en, atom.zone_m)
    if isinstance(atom, Round):
        circle = AttractiveCircle(v0=NOMINAL if atom.is_clockwise else -NOMINAL)
        return circle.enlarged(atom.radius_m / CIRCLE_RADIUS_M).shifted(*atom.at_en)
    if isinstance(atom, AwayFrom):
        return RepulsivePoint(sigma_m=atom.range_m).shifted(*atom.at_en)
    if isinstance(atom, AwayFromLine):
        return repulsive_line_between(atom.from_en, atom.to_en, atom.range_m)
    if isinstance(atom, Heading):
        return Uniform(atom.heading_rad)
    return WayOut(atom.water_en, conditions.seen, conditions.habits, conditions.way_out_rad)


def _zone_in(tree: FieldTree, node: Expression, conditions: FieldConditions) -> HysteresisZone | HysteresisRing | None:
    twd = conditions.twd_from_rad
    if twd is None:
        return None
    if isinstance(node, Named):
        return _atom_zone(tree.atom(node.name), twd)
    if isinstance(node, Weighed | Projected):
        return _zone_in(tree, node.part, conditions)
    return next((z for z in (_zone_in(tree, p, conditions) for p in node.parts) if z is not None), None)


def _atom_zone(atom: Atom, twd_from_rad: float) -> HysteresisZone | HysteresisRing | None:
    if isinstance(atom, PointTo | StayAt):
        return HysteresisZone.of_point(atom.at_en, twd_from_rad, atom.zone_m)
    if isinstance(atom, Along):
        return HysteresisZone.of_line(atom.from_en, atom.to_en, atom.zone_m)
    if isinstance(atom, Round):
        return HysteresisRing(
            at_en=atom.at_en,
            radius_m=atom.radius_m,
            is_clockwise=atom.is_clockwise,
            half_m=min(atom.zone_m, RING_SHARE * atom.radius_m),
        )
    return None
