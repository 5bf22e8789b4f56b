"""Carried kernels: an extension module that a package brings along (``carry``), called without numba.

Numba, LLVM and what they know of a kernel take 60 MB and two seconds of a processor at every start, to call machine
code that was made long before. A kernel that is called with other types than the listed ones is what it always was:
numba is loaded, and its kernels take the place of all of these.
"""

from __future__ import annotations

import functools
import hashlib
import importlib.util
import json
import logging
import sys
from collections.abc import Callable
from types import ModuleType
from typing import Any, ClassVar

from companion.kernels import places
from companion.kernels.listed import key, key_of, read_list

_LOG = logging.getLogger(__name__)
PACKAGES = ("companion", "sitl")
EXTENSION = "carried_kernels"  # its name as a module


def symbol(package: str, number: int) -> str:
    """Return what the extension calls the kernel with this number in the package's list."""
    return f"{package}_{number}"


def is_used(package: str) -> bool:
    """Return whether the package's kernels are called from the extension in this process."""
    return Carried.waiting is not None and is_carried(package)


@functools.cache
def is_carried(package: str) -> bool:
    """Return whether the extension has the kernels of the package's files as they are now, and can be loaded here."""
    try:
        index = _index()
        return package in index and index[package] == places.source(package) and bool(_extension())
    except (OSError, ImportError, ValueError, KeyError) as error:
        _LOG.warning("the kernels that the package carries cannot be used, numba is: %s", error)
        return False


def misfit() -> str:
    """Return why the kernels that the package carries are of no use here; empty: it carries none, or all fit."""
    try:
        fits = all(is_carried(package) for package in PACKAGES)
        return "" if fits or not _index() else "those of the package are of another source"
    except (OSError, ValueError):
        return "those of the package cannot be read"


def _index() -> dict[str, str]:
    """Return what the folder says of itself, empty where there is none."""
    try:
        text = (places.CARRIED / places.CARRIED_FOR).read_text(encoding="utf-8")
    except FileNotFoundError:
        return {}
    index: dict[str, str] = json.loads(text)
    return index


@functools.cache
def _extension() -> ModuleType:
    index = _index()
    path = places.CARRIED / index["library"]
    for each in (places.CARRIED, path):
        if why := places.objection(each.stat(), places.CARRIED):
            raise ValueError(f"{each}: {why}")
    if hashlib.sha256(path.read_bytes()).hexdigest() != index["sha256"]:
        raise ValueError(f"{path} is damaged")
    spec = importlib.util.spec_from_file_location(EXTENSION, path)
    if spec is None or spec.loader is None:
        raise ImportError(f"{path} is for another Python")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@functools.cache
def _functions(package: str) -> dict[tuple[str, str], dict[str, Callable[..., Any]]]:
    """Return the package's functions by kernel and by signature.

    A signature is read when its kernel is called, not here: it may name a class of a room that is never loaded.
    """
    out: dict[tuple[str, str], dict[str, Callable[..., Any]]] = {}
    for number, entry in enumerate(read_list(package)):
        function = getattr(_extension(), symbol(package, number))
        out.setdefault((entry.module, entry.name), {})[entry.signature] = function
    return out


class Carried:
    """A kernel of the extension where it is called with the types that it is listed with; numba's with any other."""

    waiting: ClassVar[list[Carried] | None] = []  # for numba; None: it has been loaded, and no more are made

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
            if self._by_types is None:  # now: the classes of its arguments are there
                module, name = self.py_func.__module__, self.py_func.__qualname__
                listed = _functions(module.partition(".")[0]).get((module, name), {})
                self._by_types = {key(signature): function for signature, function in listed.items()}
            try:
                found = self._by_types.get(tuple([key_of(a) for a in args]))
            except TypeError:
                found = None
            if found is not None:
                return found(*args)
        if self.compiled is None:
            _LOG.debug("%s is not carried for these types: numba is loaded", self.py_func.__qualname__)
            _compile_all()
        assert self.compiled is not None
        return self.compiled(*args, **named)


def _compile_all() -> None:
    """Put numba's kernels in the place of all carried ones: those that call each other must be of one kind."""
    from companion.kernels.cache import Compiled

    waiting, Carried.waiting = Carried.waiting or [], None
    for kernel in waiting:
        kernel.compiled = Compiled(kernel.py_func)
    for module in list(sys.modules.values()):
        for name, value in list(getattr(module, "__dict__", {}).items()):
            if isinstance(value, Carried):
                setattr(module, name, value.compiled)
