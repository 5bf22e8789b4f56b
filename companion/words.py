"""Words: what is counted, singular or plural; the words that an option may be."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any, Literal, get_args, get_origin, get_type_hints

import msgspec


def counted(number: int, word: str, plural: str = "") -> str:
    """Return a count with its word.

    >>> counted(1, "leg"), counted(2, "gybe"), counted(0, "way", "ways"), counted(2, "loss", "losses")
    ('1 leg', '2 gybes', '0 ways', '2 losses')
    """
    return f"{number} {word if number == 1 else plural or word + 's'}"


def listed(names: Sequence[str]) -> str:
    """Return names as one enumerates them.

    >>> listed(["A"]), listed(["A", "B", "C"])
    ('A', 'A, B and C')
    """
    return " and ".join(part for part in (", ".join(names[:-1]), *names[-1:]) if part)


def file_name(name: str) -> str:
    """Return a name that a person gave as part of a file's.

    >>> file_name("Lake / north"), file_name("../")
    ('Lake-north', 'voyage')
    """
    return re.sub(r"[^A-Za-z0-9_-]+", "-", name).strip("-") or "voyage"


def choices(kind: Any, path: str) -> tuple[str, ...]:
    """Return the words that an option may be: of the struct ``kind``, at msgspec's path (``$.skipper.end``)."""
    for key in re.findall(r"\.(\w+)", path):
        structs = [part for part in _parts(kind) if isinstance(part, type) and issubclass(part, msgspec.Struct)]
        kind = next((hints[key] for hints in map(get_type_hints, structs) if key in hints), None)
    words = [word for part in (kind, *get_args(kind)) if get_origin(part) is Literal for word in get_args(part)]
    return tuple(words)


def _parts(kind: Any) -> list[Any]:
    """Return a type and what it is made of: the members of unions, the items of tuples, and theirs."""
    return [kind, *(part for inner in get_args(kind) for part in _parts(inner))]
