"""Kernels that the package carries in a library of the system: called without numba and LLVM.

Numba, LLVM and what they know of a kernel take 60 MB and two seconds of a processor at every start, to call machine
code that was made long before. So where a package is built, ``linking`` makes one library of all listed kernels
(``library``). A kernel that is called with other types than the listed ones is what it always was: numba is loaded, and
its kernels take the place of all of these.
"""

from __future__ import annotations

import functools
import logging
import sys
from collections.abc import Callable
from typing import Any, ClassVar

import numpy as np

from companion.kernels.linked import library

_LOG = logging.getLogger(__name__)
_SCALARS = {float: "float64", int: "int64", bool: "bool", np.float64: "float64", np.float32: "float32",
            np.bool_: "bool", np.int64: "int64", np.int32: "int32", np.int8: "int8", np.uint64: "uint64",
            np.uint32: "uint32", np.uint8: "uint8"}
_CONTIGUOUS, _PLAIN = 0x001, 0x500   # of numpy's flags: in C's order; aligned and writable


class _OtherTypeError(TypeError):
    """An argument is of a type that no listed kernel has."""


class Linked:
    """A kernel of the library where it is called with the types that it is listed with; numba's with any other."""

    waiting: ClassVar[list[Linked] | None] = []   # for numba; None: it has been loaded, and no more are made

    def __init__(self, function: Callable[..., Any]) -> None:
        self.py_func = function
        self._by_types: dict[tuple[Any, ...], Callable[..., Any]] | None = None
        self.compiled: Callable[..., Any] | None = None
        functools.update_wrapper(self, function)
        assert self.waiting is not None
        self.waiting.append(self)

    def __call__(self, *args: Any, **named: Any) -> Any:
        """Call it."""
        if self.compiled is None and not named:
            if self._by_types is None:
                self._by_types = library.kernels(f"{self.py_func.__module__}:{self.py_func.__qualname__}")
            try:
                found = self._by_types.get(tuple([type_of(a) for a in args]))
            except _OtherTypeError:
                found = None
            if found is not None:
                return found(*args)
        if self.compiled is None:
            _LOG.debug("%s is not carried for these types: numba is loaded", self.py_func.__qualname__)
            compile_all()
        assert self.compiled is not None
        return self.compiled(*args, **named)


def is_linked(package: str) -> bool:
    """Return whether the package's kernels are called from the library."""
    return Linked.waiting is not None and library.is_carried(package)


def compile_all() -> None:
    """Put numba's kernels in the place of all linked ones: those that call each other must be of one kind."""
    waiting, Linked.waiting = Linked.waiting or [], None
    for part in library.PARTS:
        sys.modules.pop(f"numba.{part}", None)   # there without their package; they are there again when it is loaded
    from companion.kernels.compiled import Compiled

    for kernel in waiting:
        kernel.compiled = Compiled(kernel.py_func)
    for module in list(sys.modules.values()):
        for name, value in list(getattr(module, "__dict__", {}).items()):
            if isinstance(value, Linked):
                setattr(module, name, value.compiled)


def type_of(value: Any) -> Any:
    """Return the type of an argument as ``library`` reads it from the list. Raises _OtherTypeError."""
    kind = type(value)
    if kind is np.ndarray:
        flags = value.flags.num
        if flags & _PLAIN == _PLAIN:
            return value.dtype, value.ndim, flags & _CONTIGUOUS
    elif kind in _SCALARS:
        return _SCALARS[kind]
    elif isinstance(value, tuple):
        return kind, *[type_of(v) for v in value]
    raise _OtherTypeError
