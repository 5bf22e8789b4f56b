"""The cache of one kernel: a file for each signature, named by all that its machine code depends on.

A file begins with the digest of the rest: a torn or damaged one is compiled again.
"""

from __future__ import annotations

import hashlib
import logging
import os
import pickle
import tempfile
import time
from pathlib import Path
from typing import Any

from llvmlite import binding as llvm
from numba.core.caching import _Cache
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompileResult
from numba.core.dispatcher import Dispatcher
from numba.core.serialize import dumps

from companion.errors import JobError
from companion.kernels.places import folder, looked_in, objection, refuse, used, versions, written_to
from companion.kernels.stamp import name_of, stamp

_LOG = logging.getLogger(__name__)
_DIGEST_BYTES = hashlib.sha256().digest_size
_LIBRARY, _ANNOTATION = 0, 6   # of what numba writes of a compiled function


class _Loaded(JITCodeLibrary):  # type: ignore[misc]
    """Loaded machine code without LLVM's form of it, which is read when another kernel is compiled that calls it.

    That form of a planner's kernels takes 12 MB, and nobody asks for it where nothing is compiled. It is read from the
    file that was loaded, which must be that file still: the name of a function in machine code has a number in it that
    another process's compiling of the same kernel gives otherwise, and linking with that leaves a call to nowhere.
    """

    path: Path
    digest: bytes
    parsed: Any

    @classmethod
    def lighten(cls, library: Any, path: Path, payload: bytes) -> None:
        """Make a library that was loaded from the file at ``path``, which held ``payload``, one of these."""
        library._shared_module.close()  # noqa: SLF001
        del library._shared_module  # noqa: SLF001
        library.__class__, library.path, library.parsed = cls, path, None
        library.digest = hashlib.sha256(payload).digest()

    @property
    def _shared_module(self) -> Any:
        if self.parsed is None:
            payload = read(self.path)
            if payload is None or hashlib.sha256(payload).digest() != self.digest:
                raise JobError(f"{self.path} has gone or changed while a kernel was compiled that needs it")
            _, _, (_, bitcode) = pickle.loads(payload)[_LIBRARY]  # noqa: S301 - our own
            self.parsed = llvm.parse_bitcode(bitcode)
        return self.parsed


class KernelCache(_Cache):  # type: ignore[misc]
    """A kernel's cache, as numba's dispatcher wants it."""

    def __init__(self, dispatcher: Dispatcher) -> None:
        self._dispatcher = dispatcher
        self._stamp = ""   # known when the kernels that it calls are: when it is first compiled

    @property
    def cache_path(self) -> str:
        """Where it writes."""
        return str(folder())

    def file_name(self, signature: Any, codegen: Any) -> str:
        """Return the name of the file for a signature, a tuple of numba's types."""
        self._stamp = self._stamp or stamp(self._dispatcher)
        depends = f"{self._stamp} {signature} {codegen.magic_tuple()} {versions()}"
        return f"{name_of(self._dispatcher)}-{hashlib.sha256(depends.encode()).hexdigest()[:24]}"

    def load_overload(self, sig: Any, target_context: Any) -> CompileResult | None:
        """Return what was compiled before, None when nothing that can be used is there."""
        target_context.refresh()
        name = self.file_name(sig, target_context.codegen())
        for place in looked_in():
            payload = read(place / name)
            if payload is None:
                continue
            try:
                result = CompileResult._rebuild(target_context, *pickle.loads(payload))  # noqa: S301, SLF001 - our own
                _Loaded.lighten(result.library, place / name, payload)
            except Exception:
                _LOG.warning("%s cannot be loaded: compiled again", place / name, exc_info=True)
            else:
                return result
        return None

    def save_overload(self, sig: Any, data: CompileResult) -> None:
        """Keep what was compiled; a folder that cannot be written costs nothing but the time to compile again."""
        if data.library.has_dynamic_globals or any(not x.can_cache for x in data.lifted):
            return
        try:
            parts = list(data._reduce())  # noqa: SLF001
            parts[_ANNOTATION] = ""   # the source with its types, for a person who asks; none does
            path = written_to() / self.file_name(sig, data.codegen)
            if read(path) is None:   # who has loaded the file that another process made meanwhile links with that one
                _write(path, dumps(tuple(parts)))
        except OSError as error:
            _LOG.warning("compiled kernels cannot be kept in %s (%s)", folder(), error.strerror)

    def enable(self) -> None:
        """Always on."""

    def disable(self) -> None:
        """Always on."""

    def flush(self) -> None:
        """Nothing is kept in memory."""


def read(path: Path) -> bytes | None:
    """Return what a file of ours holds behind its digest; None: it is not there, damaged, or others could write it."""
    try:
        with os.fdopen(os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC), "rb") as file:
            why = objection(os.fstat(file.fileno()), path.parent)   # of what is read, and no other
            if why:
                refuse(path, why)
                return None
            data = file.read()
    except OSError:
        return None
    if hashlib.sha256(data[_DIGEST_BYTES:]).digest() != data[:_DIGEST_BYTES]:
        _LOG.warning("%s is damaged: compiled again", path)
        return None
    used(path, time.time())
    return data[_DIGEST_BYTES:]


def _write(path: Path, payload: bytes) -> None:
    handle, beside = tempfile.mkstemp(dir=path.parent, prefix=".")
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(hashlib.sha256(payload).digest() + payload)
        try:
            os.link(beside, path)        # the first stays, see _Loaded
        except FileExistsError:
            if read(path) is None:
                Path(beside).replace(path)   # it is damaged
        except OSError:
            Path(beside).replace(path)       # a file system without links
        Path(beside).unlink(missing_ok=True)
    except BaseException:
        Path(beside).unlink(missing_ok=True)
        raise
