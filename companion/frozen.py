"""Copies of frozen values with changes, as ``dataclasses.replace`` makes them, for the few that are made all the time.

``dataclasses.replace`` looks at every field anew each time: a status of thirty fields takes longer to copy than most
messages to decode, and parts of the skipper's state change a dozen times a step.
"""

from __future__ import annotations

import functools
import operator
from collections.abc import Callable
from dataclasses import fields
from typing import TYPE_CHECKING, Any, TypeVar, cast

__all__ = ["changed"]

T = TypeVar("T")


@functools.cache
def _parts(kind: type[Any]) -> tuple[tuple[str, ...], frozenset[str], Callable[[Any], tuple[Any, ...]], bool]:
    """Return a frozen dataclass's fields, what reads them all at once, and whether a copy need not be made anew."""
    names = tuple(field.name for field in fields(kind))
    if len(names) < 2 or not all(field.init for field in fields(kind)):
        raise TypeError(f"{kind.__name__} is copied by dataclasses.replace")
    # without slots the fields are a dictionary, and one that nothing checks is copied as such
    is_plain = not hasattr(kind, "__slots__") and not hasattr(kind, "__post_init__")
    return names, frozenset(names), operator.attrgetter(*names), is_plain


def _changed(value: T, **changes: Any) -> T:
    """Return ``value`` with ``changes``, checked as it is when it is made; itself when every change is what it holds.

    Raises:
        TypeError: a field that it does not have.
    """
    for name, new in changes.items():
        if getattr(value, name, changes) is not new:
            break
    else:
        return value
    kind: Any = type(value)
    names, known, read, is_plain = _parts(kind)
    if not known.issuperset(changes):
        raise TypeError(f"{kind.__name__} has no {', '.join(sorted(changes.keys() - known))}")
    if not is_plain:
        return cast("T", kind(**{**dict(zip(names, read(value), strict=True)), **changes}))
    copy: T = object.__new__(kind)
    own = copy.__dict__
    own.update(value.__dict__)
    own.update(changes)
    return copy


if TYPE_CHECKING:
    from dataclasses import replace as changed  # mypy knows the fields and their types of this one
else:
    changed = _changed
