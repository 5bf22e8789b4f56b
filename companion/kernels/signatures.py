"""The types of a kernel's arguments as text, and back: what the list of kernels is written in.

float64, int64[::1], float64[:, ::1], tuple(float64, int64), named("companion.planner.search.kernels:Grid",
float64[::1])
"""

from __future__ import annotations

import importlib
from typing import Any

from numba import types

from companion.errors import JobError

_SCALARS = {str(t): t for t in (
    types.float64, types.float32, types.int64, types.int32, types.int8, types.uint64, types.uint32, types.uint8,
    types.boolean)}
_ENDS = {"C": "::1", "A": ":"}


def as_text(signature: tuple[Any, ...]) -> str:
    """Return a signature's text.

    Raises:
        JobError: a type that no kernel of ours has had.
    """
    return ", ".join(_text(t) for t in signature)


def from_text(text: str) -> tuple[Any, ...]:
    """Return the signature that ``as_text`` wrote.

    Raises:
        JobError: the text is none, or names a type that is not there any more.
    """
    names = {**_SCALARS, "tuple": lambda *members: types.Tuple(members), "named": _named, "__builtins__": {}}
    try:
        return tuple(eval(f"({text},)" if text else "()", names))  # noqa: S307 - our own list, in numba's own notation
    except (SyntaxError, NameError, TypeError, ValueError, ImportError, AttributeError) as error:
        raise JobError(f"{text!r} is no signature: {error}") from error


def _text(t: Any) -> str:
    name = str(t)
    if name in _SCALARS:
        return name
    if isinstance(t, types.Array) and t.layout in _ENDS and t.mutable and str(t.dtype) in _SCALARS:
        return f"{t.dtype}[{', '.join([*[':'] * (t.ndim - 1), _ENDS[t.layout]])}]"
    if isinstance(t, types.BaseNamedTuple):
        return f'named("{t.instance_class.__module__}:{t.instance_class.__qualname__}", {as_text(tuple(t.types))})'
    if isinstance(t, types.BaseTuple):
        return f"tuple({as_text(tuple(t.types))})"
    raise JobError(f"{t}: the list of kernels cannot say this type")


def _named(place: str, *members: Any) -> Any:
    module, _, name = place.partition(":")
    cls = getattr(importlib.import_module(module), name)
    if len(set(members)) == 1:
        return types.NamedUniTuple(members[0], len(members), cls)
    return types.NamedTuple(members, cls)
