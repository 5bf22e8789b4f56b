"""The list of the kernels that a voyage needs: which, for which types, and about how long each compiles.

Each program's package has one, ``kernels.txt``, written by ``python -m bench.kernels --write`` and held complete
by a test. It makes no decision: what is missing from it is compiled when it is called.

float64, int64[::1], float64[:, ::1], tuple(float64, int64), named("companion.planner.search.kernels:Grid",
float64[::1])
"""

from __future__ import annotations

import importlib
from dataclasses import dataclass
from typing import Any

from numba import types
from numba.core.dispatcher import Dispatcher

from companion.errors import JobError
from companion.kernels.places import FILE, PACKAGES

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


@dataclass(frozen=True, slots=True, kw_only=True)
class Entry:
    """A kernel for one combination of types; ``seconds`` of a processor is what it took once to compile."""

    module: str
    name: str
    signature: str
    seconds: float

    def __str__(self) -> str:
        return f"{self.seconds:.2f} {self.module}:{self.name} {self.signature}".rstrip()

    def dispatcher(self) -> Dispatcher:
        """Return the kernel. Raises JobError when it is not there any more."""
        try:
            found = getattr(importlib.import_module(self.module), self.name)
        except (ImportError, AttributeError):
            found = None
        if not isinstance(found, Dispatcher):
            raise JobError(f"{self.module}.{self.name} is listed and is no kernel")
        return found

    def types(self) -> tuple[Any, ...]:
        """Return the types. Raises JobError when they are not there any more."""
        return from_text(self.signature)


def read_list(package: str) -> list[Entry]:
    """Return the package's kernels, those that are called before those that call them."""
    out = []
    for line in (PACKAGES / package / FILE).read_text(encoding="utf-8").splitlines():
        if line.strip() and not line.startswith("#"):
            seconds, place, *signature = line.split(maxsplit=2)
            module, _, name = place.partition(":")
            out.append(Entry(module=module, name=name, signature="".join(signature), seconds=float(seconds)))
    return out
