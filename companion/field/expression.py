"""The text of a composed field: Schmitt's binary tree as a sailor writes it, read and printed.

Atoms have names; where they lie and how large they are is theirs to know (her rotate, shift and scalar). An expression
adds them, weighs them, takes the longer of two vectors, and projects a part out of the no-go zone::

    ring + 0.5 * islet
    max(lane, 2 * (ship + islet))
    project(lane) + islet

What is printed is read again as the same tree.
"""

from __future__ import annotations

import difflib
import re
from collections.abc import Collection
from dataclasses import dataclass

from companion.errors import InputError

MOST_CHARACTERS = 1000
MOST_NESTED = 20
MOST_WEIGHT = 100.0
MAX, PROJECT = "max", "project"
_NAME = re.compile(r"[A-Za-z_]\w*", re.ASCII)
_TOKEN = re.compile(
    r"\s*(?:(?P<number>(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)|(?P<name>[A-Za-z_]\w*)|(?P<mark>[-+*(),]))", re.ASCII)


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
        raise self._wrong("a field is missing" + (f" before {word!r}" if word else " at the end"),
                          f"write the name of an atom: {self._known()}")

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
            rest = self._text[self._at:].strip()
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
        rest = self._text[self._at:]
        where = self._at + len(rest) - len(rest.lstrip()) + 1
        return InputError(self._source, f"{self._place}, character {where}", problem, remedy)
