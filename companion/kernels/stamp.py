"""What a kernel is made of: its own code, the constants and kernels that it uses, and theirs."""

from __future__ import annotations

import dis
import enum
import functools
import hashlib
import types
from collections.abc import Iterator
from typing import Any

import numpy as np
from numba.core.dispatcher import Dispatcher

from companion.errors import JobError

OURS = ("companion", "sitl", "lab")
_LITERALS = (bool, int, float, complex, str, bytes, type(None), np.generic)


def stamp(function: types.FunctionType) -> str:
    """Return a digest of everything that decides a kernel's machine code, apart from types, versions and processor.

    Args:
        function: what was decorated.

    Raises:
        JobError: the kernel, or one that it calls, uses something whose changes cannot be seen.
    """
    found, left = {function}, [function]
    while left:
        for callee in _callees(left.pop()):
            if callee not in found:
                found.add(callee)
                left.append(callee)
    said = sorted(f"{_name(each)} {_own(each)}\n" for each in found)
    return hashlib.sha256("".join(said).encode()).hexdigest()


def _name(function: types.FunctionType) -> str:
    return f"{function.__module__}.{function.__qualname__}"


@functools.cache
def _callees(function: types.FunctionType) -> tuple[types.FunctionType, ...]:
    return tuple(value.py_func for _, value in _globals_of(function) if isinstance(value, Dispatcher))


@functools.cache
def _own(function: types.FunctionType) -> str:
    """Return the digest of a kernel's own code and constants."""
    if function.__closure__:
        raise JobError(f"{_name(function)}: a kernel is a function of its module, not of another function")
    said = [*_code(function.__code__, function.__doc__)]
    for default in (*(function.__defaults__ or ()), *(function.__kwdefaults__ or {}).values()):
        said.append(_constant(default, _name(function)))
    for name, value in _globals_of(function):
        said.append(f"{name}={_constant(value, f'{_name(function)}, {name}')}")
    return hashlib.sha256("\n".join(said).encode()).hexdigest()


def _code(code: types.CodeType, doc: str | None = "") -> Iterator[str]:
    """Yield what a code object does; comments, the docstring (the first constant) and line numbers are not in it."""
    yield f"{code.co_code.hex()} {code.co_names} {code.co_varnames} {code.co_argcount} {code.co_kwonlyargcount}"
    for n, constant in enumerate(code.co_consts):
        if isinstance(constant, types.CodeType):
            yield from _code(constant)
        elif n > 0 or constant != doc:
            yield repr(constant)


def _globals_of(function: types.FunctionType) -> list[tuple[str, Any]]:
    """Return the module's names that the function uses, and what they are."""
    known = function.__globals__
    return [(name, known[name]) for name in _names_of(function.__code__) if name in known]


@functools.cache
def _names_of(code: types.CodeType) -> tuple[str, ...]:
    """Return the global names that code reads, in order; asked for twice of each kernel, and slow to find."""
    names = {i.argval for i in dis.get_instructions(code) if i.opname in {"LOAD_GLOBAL", "LOAD_NAME"}}
    for constant in code.co_consts:
        if isinstance(constant, types.CodeType):
            names.update(_names_of(constant))
    return tuple(sorted(names))


def _constant(value: Any, where: str) -> str:
    """Return a text that is another one when the value is."""
    if isinstance(value, Dispatcher):
        return _name(value.py_func)
    if isinstance(value, enum.Enum):
        return f"{type(value).__qualname__}.{value.name}={value.value!r}"
    if isinstance(value, _LITERALS):
        return f"{type(value).__name__} {value!r}"
    if isinstance(value, tuple):
        return f"{type(value).__qualname__}({', '.join(_constant(v, where) for v in value)})"
    if isinstance(value, np.ndarray):
        return f"array {value.dtype} {value.shape} {value.tobytes().hex()}"
    if isinstance(value, type):
        if issubclass(value, enum.Enum):
            return f"{value.__qualname__}({', '.join(f'{m.name}={m.value!r}' for m in value)})"
        fields = getattr(value, "_fields", ())
        return f"{value.__module__}.{value.__qualname__}{fields}"
    home = value.__name__ if isinstance(value, types.ModuleType) else str(getattr(value, "__module__", "") or "")
    if home.partition(".")[0] in OURS or not (isinstance(value, types.ModuleType) or callable(value)):
        raise JobError(f"{where}: a kernel cannot use {value!r}: no change of it would be seen; import what it needs")
    return f"{home}.{getattr(value, '__qualname__', '')}"
