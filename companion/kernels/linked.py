"""Linked kernels: a library of the system that a package carries, made of all of them, and called without numba.

Beside it lies an index: the kernels with their types as the list has them, the symbol of each, and the constants of its
environment. Of numba only the three small modules are loaded that are written in C.

Numba, LLVM and what they know of a kernel take 60 MB and two seconds of a processor at every start, to call machine
code that was made long before. So where a package is built, ``linking`` makes one library of all listed kernels.
A kernel that is called with other types than the listed ones is what it always was: numba is loaded, and
its kernels take the place of all of these.
"""

from __future__ import annotations

import ctypes
import functools
import hashlib
import importlib
import importlib.util
import json
import logging
import pickle
import sys
from collections.abc import Callable
from importlib.machinery import EXTENSION_SUFFIXES, ModuleSpec, PathFinder
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from companion.kernels import places

_LOG = logging.getLogger(__name__)
LIBRARY, INDEX = "linked.so", "linked.json"   # in the folder that is carried
HELPERS = "companion_helpers"                 # the library's table of the functions of numba that it calls
PARTS = {"_dynfunc": "", "_helperlib": "numba_", "core.runtime._nrt_python": "NRT_"}
"""Numba's modules of C that machine code needs, and how the names of their functions begin in it."""


@functools.cache
def is_carried(package: str) -> bool:
    """Return whether the library has the kernels of the package's files as they are now, and can be loaded here."""
    try:
        if not (places.CARRIED / INDEX).is_file() or not (places.CARRIED / places.mark(package)).is_file():
            return False
        _loaded()
    except (OSError, ImportError, AttributeError, ValueError, KeyError, StopIteration) as error:
        _LOG.warning("%s cannot be used, numba is: %s", places.CARRIED / LIBRARY, error)
        return False
    return True


def kernels(name: str) -> dict[tuple[Any, ...], Callable[..., Any]]:
    """Return a kernel's functions by the types of their arguments, see ``calling.type_of``."""
    return {_types(entry["types"]): _function(name, entry) for entry in _loaded()[1]["kernels"].get(name, [])}


# ------------------------------------------------------------------------------------------- types
class _Scalar(str):
    """A type of numbers; with slices after it, of arrays of them."""

    __slots__ = ()

    def __getitem__(self, slices: Any) -> Any:
        dimensions = slices if isinstance(slices, tuple) else (slices,)
        return np.dtype(str(self)), len(dimensions), int(dimensions[-1].step == 1)


_NAMES: dict[str, Any] = {
    **{name: _Scalar(name) for name in (
        "float64", "float32", "int64", "int32", "int8", "uint64", "uint32", "uint8", "bool")},
    "tuple": lambda *members: (tuple, *members),
    "named": lambda place, *members: (_class(place), *members),
    "__builtins__": {},
}


def _class(place: str) -> Any:
    module, _, name = place.partition(":")
    return getattr(importlib.import_module(module), name)


def _types(text: str) -> tuple[Any, ...]:
    return tuple(eval(f"({text},)" if text else "()", _NAMES))  # noqa: S307 - our own list, see ``signatures``


# ---------------------------------------------------------------------------------------- functions
def _unpickle(address: int, size: int, digest: int) -> Any:
    """Return what machine code needs, a class of arrays or an exception; numba's own of this loads all of numba."""
    del digest
    if address not in _objects:
        _objects[address] = pickle.loads(ctypes.string_at(address, size))  # noqa: S301 - of our own library
    return _objects[address]


_objects: dict[int, Any] = {}
_CALLED = ctypes.PYFUNCTYPE(ctypes.py_object, ctypes.c_void_p, ctypes.c_int, ctypes.c_void_p)(_unpickle)
_UNPICKLE = ctypes.cast(_CALLED, ctypes.c_void_p).value


@functools.cache
def _loaded() -> tuple[ctypes.CDLL, dict[str, Any], Any]:
    """Return the library, its index and numba's maker of functions."""
    index = json.loads((places.CARRIED / INDEX).read_text(encoding="utf-8"))
    parts = {name: _part(name) for name in PARTS}
    path = places.CARRIED / LIBRARY
    for each in (places.CARRIED, path):
        if why := places.objection(each.stat(), places.CARRIED):
            raise ValueError(why)
    if hashlib.sha256(path.read_bytes()).hexdigest() != index["sha256"]:
        raise ValueError(f"{path} is damaged")
    library = ctypes.CDLL(str(path))
    helpers = (ctypes.c_void_p * len(index["helpers"])).in_dll(library, HELPERS)
    for n, helper in enumerate(index["helpers"]):
        helpers[n] = _UNPICKLE if helper == "numba_unpickle" else next(
            module.c_helpers[helper.removeprefix(PARTS[name])] for name, module in parts.items()
            if PARTS[name] and helper.startswith(PARTS[name]))
    parts["core.runtime._nrt_python"].memsys_use_cpython_allocator()
    for symbol, constants in index["environments"].items():
        environment = parts["_dynfunc"].Environment({})
        environment.consts.extend(np.dtype(name) for name in constants)
        _kept.append(environment)
        ctypes.c_void_p.in_dll(library, symbol).value = id(environment)
    return library, index, parts["_dynfunc"]


_kept: list[Any] = []   # what the library points to


def _part(name: str) -> Any:
    """Load one of numba's modules without numba."""
    whole = f"numba.{name}"
    if whole in sys.modules:
        return sys.modules[whole]
    folder = Path(_numba(), *name.split(".")[:-1])
    stem = name.rpartition(".")[2]
    path = next(folder / f"{stem}{suffix}" for suffix in EXTENSION_SUFFIXES if (folder / f"{stem}{suffix}").is_file())
    spec = importlib.util.spec_from_file_location(whole, path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@functools.cache
def _numba() -> str:
    spec: ModuleSpec | None = PathFinder.find_spec("numba")   # finding it does not load it
    if spec is None or not spec.submodule_search_locations:
        raise ImportError("numba is not installed")
    return next(iter(spec.submodule_search_locations))


def _function(name: str, entry: dict[str, Any]) -> Callable[..., Any]:
    library, _, dynfunc = _loaded()
    module, _, qualname = name.partition(":")
    address = ctypes.cast(getattr(library, entry["symbol"]), ctypes.c_void_p).value
    environment = ctypes.cast(ctypes.c_void_p.in_dll(library, entry["environment"]), ctypes.py_object).value
    made: Callable[..., Any] = dynfunc.make_function(
        sys.modules[module], qualname, f"compiled {qualname}", address, environment, (library,))
    return made


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
                self._by_types = kernels(f"{self.py_func.__module__}:{self.py_func.__qualname__}")
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
    return Linked.waiting is not None and is_carried(package)


def compile_all() -> None:
    """Put numba's kernels in the place of all linked ones: those that call each other must be of one kind."""
    waiting, Linked.waiting = Linked.waiting or [], None
    for part in PARTS:
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
