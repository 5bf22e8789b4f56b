"""The list of the kernels that a voyage needs: which, for which types, and about how long each compiles.

Each program's package has one, ``kernels.txt``, written by ``python -m bench.kernels --write`` and held complete
by a test. It makes no decision: what is missing from it is compiled when it is called. Types are written so:

float64, int64[::1], float64[:, ::1], tuple(float64, int64), named("companion.planner.search.kernels:Grid",
float64[::1])
"""

from __future__ import annotations

import importlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from companion.errors import JobError
from companion.kernels.places import FILE, PACKAGES

SCALARS = ("float64", "float32", "int64", "int32", "int8", "uint64", "uint32", "uint8", "bool")
_ENDS = {"C": "::1", "A": ":"}


@dataclass(frozen=True, slots=True, kw_only=True)
class Entry:
    """A kernel for one combination of types; ``seconds`` of a processor is what it took once to compile."""

    module: str
    name: str
    signature: str
    seconds: float

    def __str__(self) -> str:
        return f"{self.seconds:.2f} {self.module}:{self.name} {self.signature}".rstrip()

    def kernel(self) -> Any:
        """Return what ``@kernel`` made of it. Raises JobError when it is not there any more."""
        found = getattr(importlib.import_module(self.module), self.name, None)
        if not hasattr(found, "py_func"):
            raise JobError(f"{self.module}.{self.name} is listed and is no kernel")
        return found


def read_list(package: str) -> list[Entry]:
    """Return the package's kernels, those that are called before those that call them."""
    out = []
    for line in (PACKAGES / package / FILE).read_text(encoding="utf-8").splitlines():
        if line.strip() and not line.startswith("#"):
            seconds, place, *signature = line.split(maxsplit=2)
            module, _, name = place.partition(":")
            out.append(Entry(module=module, name=name, signature="".join(signature), seconds=float(seconds)))
    return out


# -------------------------------------------------------------------------------- as arguments have them
class _Scalar(str):
    """A type of numbers; with slices after it, of arrays of them."""

    __slots__ = ()

    def __getitem__(self, slices: Any) -> Any:
        dimensions = slices if isinstance(slices, tuple) else (slices,)
        return np.dtype(str(self)), len(dimensions), dimensions[-1].step == 1


def key(signature: str) -> tuple[Any, ...]:
    """Return a signature as ``key_of`` has its arguments."""
    return _read(
        signature,
        {
            **{name: _Scalar(name) for name in SCALARS},
            "tuple": lambda *members: (tuple, *members),
            "named": lambda place, *members: (_class(place), *members),
        },
    )


_KINDS: Mapping[type, str] = {
    float: "float64",
    int: "int64",
    bool: "bool",
    np.bool_: "bool",
    **{getattr(np, name): name for name in SCALARS if name != "bool"},
}
_CONTIGUOUS, _PLAIN = 0x001, 0x500  # of numpy's flags: in C's order; aligned and writable


def key_of(value: Any) -> Any:
    """Return the type of an argument. Raises TypeError: the list cannot say it."""
    kind = type(value)
    if kind is np.ndarray:
        flags = value.flags.num
        if flags & _PLAIN == _PLAIN:
            return value.dtype, value.ndim, bool(flags & _CONTIGUOUS)
    elif kind in _KINDS:
        return _KINDS[kind]
    elif isinstance(value, tuple):
        return kind, *[key_of(v) for v in value]
    raise TypeError(kind)


# -------------------------------------------------------------------------------------- as numba has them
def from_text(signature: str) -> tuple[Any, ...]:
    """Return the signature that ``as_text`` wrote, of numba's types.

    Raises:
        JobError: the text is none, or names a type that is not there any more.
    """
    from numba import types

    def named(place: str, *members: Any) -> Any:
        cls = _class(place)
        if len(set(members)) == 1:
            return types.NamedUniTuple(members[0], len(members), cls)
        return types.NamedTuple(members, cls)

    scalars = {name: getattr(types, "boolean" if name == "bool" else name) for name in SCALARS}
    return _read(signature, {**scalars, "tuple": lambda *members: types.Tuple(members), "named": named})


def as_text(signature: tuple[Any, ...]) -> str:
    """Return a signature's text.

    Raises:
        JobError: a type that no kernel of ours has had.
    """
    return ", ".join(_text(t) for t in signature)


def _text(t: Any) -> str:
    from numba import types

    name = str(t)
    if name in SCALARS:
        return name
    if isinstance(t, types.Array) and t.layout in _ENDS and t.mutable and str(t.dtype) in SCALARS:
        return f"{t.dtype}[{', '.join([*[':'] * (t.ndim - 1), _ENDS[t.layout]])}]"
    if isinstance(t, types.BaseNamedTuple):
        return f'named("{t.instance_class.__module__}:{t.instance_class.__qualname__}", {as_text(tuple(t.types))})'
    if isinstance(t, types.BaseTuple):
        return f"tuple({as_text(tuple(t.types))})"
    raise JobError(f"{t}: the list of kernels cannot say this type")


def _class(place: str) -> Any:
    module, _, name = place.partition(":")
    return getattr(importlib.import_module(module), name)


def _read(text: str, names: Mapping[str, Any | Callable[..., Any]]) -> tuple[Any, ...]:
    try:  # our own list, in numba's own notation
        return tuple(eval(f"({text},)" if text else "()", {**names, "__builtins__": {}}))  # noqa: S307
    except (SyntaxError, NameError, TypeError, ValueError, ImportError, AttributeError) as error:
        raise JobError(f"{text!r} is no signature: {error}") from error
