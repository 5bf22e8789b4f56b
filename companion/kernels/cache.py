"""Kernels as numba has them, in numba's own cache, which is told where to keep them and when they are stale.

Numba goes by the source file of a kernel alone, so that an edit of what it calls in another file would not be seen; two
processes that compile one kernel for different types can mix up each other's files; a torn file or a full disk raises.
So the name of a kernel's files has the digest of ``stamp`` in it, a kernel is compiled under a lock, and a cache that
cannot be read or written costs nothing but the time to compile again.
"""

from __future__ import annotations

import contextlib
import fcntl
import hashlib
import logging
import os
import pickle
from collections.abc import Callable, Iterator
from pathlib import Path
from types import FunctionType
from typing import Any

import numba
from numba.core import event
from numba.core.compiler_lock import global_compiler_lock
from numba.core.registry import CPUDispatcher
from numba.core.types.misc import unliteral

from companion.kernels import places
from companion.kernels.stamp import stamp

_LOG = logging.getLogger(__name__)

# Code for this very processor would be of no use in a package, would make other plans on another machine, and plans in
# 1 to 5 % less time here.
numba.config.CPU_NAME = "generic"
numba.config.CPU_FEATURES = ""
numba.config.CACHE_LOCATOR_CLASSES = f"{__name__}.Locator"  # the setting NUMBA_CACHE_LOCATOR_CLASSES

# What reading a torn or foreign file of the cache raises.
_UNREADABLE = (
    EOFError,
    pickle.UnpicklingError,
    ValueError,
    IndexError,
    KeyError,
    TypeError,
    AttributeError,
    ImportError,
    RuntimeError,
)


class Locator:
    """Where numba keeps a kernel's machine code, and under which name, as its cache asks for it."""

    def __init__(self, digest: str, folder: Path) -> None:
        self._digest, self._folder = digest, folder

    @classmethod
    def from_function(cls, function: FunctionType, _source: str) -> Locator | None:
        """Return the locator of a kernel's function; None: nothing can be kept on this machine."""
        text = f"{function.__module__} {stamp(function)} {places.versions()}"
        digest = hashlib.sha256(text.encode()).hexdigest()[:24]
        try:
            folder = places.written_to()
        except OSError as error:
            _LOG.warning("compiled kernels cannot be kept in %s (%s)", places.folder(), error.strerror)
            folder = None
        for place in places.looked_in():  # a card that has become read-only is still read
            if place != folder and any(place.glob(f"*-{digest}.*")):
                return cls(digest, place)
        return None if folder is None else cls(digest, folder)

    def ensure_cache_path(self) -> None:
        """Make the folder again, should it have gone meanwhile."""
        self._folder.mkdir(parents=True, exist_ok=True, mode=0o700)

    def get_cache_path(self) -> str:
        """Return the folder."""
        return str(self._folder)

    def get_source_stamp(self) -> str:
        """Return what a file must have been made from."""
        return self._digest

    def get_disambiguator(self) -> str:
        """Return what tells the files of two kernels of one name apart: versions of one kernel lie side by side."""
        return self._digest


class Begun(event.Listener):  # type: ignore[misc]
    """Counts the kernels that this process has begun to compile: what is loaded from the cache is none of them."""

    def __init__(self) -> None:
        self.count = 0

    def on_start(self, event: object) -> None:
        """Count one."""
        del event
        self.count += 1

    def on_end(self, event: object) -> None:
        """Nothing."""


BEGUN = Begun()
event.register("numba:compile", BEGUN)


class Compiled(CPUDispatcher):  # type: ignore[misc]
    """Numba's dispatcher: one machine code for each combination of types, compiled by one process at a time."""

    def __init__(self, function: Callable[..., Any], locals: Any = None, targetoptions: Any = None) -> None:  # noqa: A002
        super().__init__(
            function,
            locals=locals or {},
            targetoptions=targetoptions or {"nopython": True, "nogil": True, "boundscheck": None},
        )
        self._is_kept = False

    def get_call_template(self, args: Any, kws: Any) -> Any:
        """Return how a kernel is called from another: a literal is a number like any other, not a type of its own."""
        plain = tuple(unliteral(a) for a in args)
        return super().get_call_template(plain, {name: unliteral(a) for name, a in kws.items()})

    def compile(self, sig: Any) -> Any:
        """Return the machine code for a signature, from the cache or made now."""
        if not self._is_kept:  # not before: what it is made of is known when the kernels that it calls are
            with contextlib.suppress(RuntimeError):  # there is no place
                self.enable_caching()
            self._is_kept = True
        with global_compiler_lock, self._alone():  # that first: a thread that waits for it would hold this
            try:
                return super().compile(sig)
            except OSError as error:
                _LOG.warning("compiled kernels cannot be kept in %s (%s)", places.folder(), error.strerror)
            except _UNREADABLE as error:
                if isinstance(error, numba.core.errors.NumbaError):
                    raise
                _LOG.warning("%s: its file in the cache cannot be read: compiled again", self.py_func.__qualname__)
                with contextlib.suppress(OSError):
                    self._cache.flush()
            return super().compile(sig)

    @contextlib.contextmanager
    def _alone(self) -> Iterator[None]:
        """Hold this kernel's lock; callees are held after their callers, and no kernel calls itself in a circle."""
        with contextlib.ExitStack() as held:
            if self._cache.cache_path is not None:
                name = f".{self.py_func.__module__}.{self.py_func.__qualname__}.lock"
                with contextlib.suppress(OSError):  # nothing can be written: there is nothing to mix up either
                    fd = os.open(Path(self._cache.cache_path, name), os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
                    held.callback(os.close, fd)
                    fcntl.flock(fd, fcntl.LOCK_EX)
            yield
