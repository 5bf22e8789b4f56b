"""One of the processes that compile ahead: takes kernels from the lists until none is left, or it has grown large."""

from __future__ import annotations

import contextlib
import fcntl
import os
import sys
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from numba.core.registry import cpu_target

from companion.errors import JobError
from companion.kernels.build import AGAIN
from companion.kernels.cache import KernelCache
from companion.kernels.listed import Entry, read_list
from companion.kernels.places import CARRIED, folder
from companion.kernels.stamp import callees

LARGE_BYTES = 200 * 2**20   # a process that has grown to this leaves after the kernel in hand
_WAIT_S = 0.1               # while all that can be begun is in other hands


class Work:
    """A kernel of the lists: its dispatcher, types and file, and what it waits for."""

    def __init__(self, entry: Entry) -> None:
        self.entry = entry
        self.dispatcher = entry.dispatcher()
        self.types: tuple[Any, ...] = entry.types()
        self.file = KernelCache(self.dispatcher).file_name(self.types, cpu_target.target_context.codegen())
        self.before: list[Work] = []
        self.urgency_s = entry.seconds   # of it and the longest row of kernels that wait for it
        self._is_done = False

    @property
    def is_done(self) -> bool:
        """Whether its machine code is there."""
        self._is_done = self._is_done or any((place / self.file).exists() for place in (CARRIED, folder()))
        return self._is_done

    @property
    def can_begin(self) -> bool:
        """Whether the kernels that it calls are there."""
        return all(work.is_done for work in self.before)


def planned(packages: Sequence[str]) -> list[Work]:
    """Return the packages' kernels, the most urgent first; what is listed and not there any more is left out."""
    works: list[Work] = []
    for package in packages:
        for entry in read_list(package):
            with contextlib.suppress(JobError):
                works.append(Work(entry))
    of_kernel: dict[Any, list[Work]] = {}
    for work in works:
        of_kernel.setdefault(work.dispatcher, []).append(work)
    for work in works:
        work.before = [w for callee in callees(work.dispatcher) if callee is not work.dispatcher
                       for w in of_kernel.get(callee, [])]
    for work in reversed(works):   # callers come after what they call
        for callee in work.before:
            callee.urgency_s = max(callee.urgency_s, callee.entry.seconds + work.urgency_s)
    return sorted(works, key=lambda w: -w.urgency_s)


@contextlib.contextmanager
def _held(work: Work) -> Iterator[bool]:
    """Hold a kernel while it is compiled; False when another process does."""
    path = folder() / f".{work.file}.lock"
    with path.open("w") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            yield False
            return
        try:
            yield True
        finally:
            path.unlink(missing_ok=True)


def _report(works: Sequence[Work]) -> None:
    done = [w for w in works if w.is_done]
    sys.stdout.write(f"{len(done)} {len(works)} {sum(w.entry.seconds for w in done):.2f} "
                     f"{sum(w.entry.seconds for w in works):.2f}\n")
    sys.stdout.flush()


def main(packages: Sequence[str]) -> int:
    """Compile until nothing is left (0) or this process should make place for another (``AGAIN``)."""
    parent = os.getppid()
    folder().mkdir(parents=True, exist_ok=True, mode=0o700)
    works = planned(packages)
    _report(works)
    while os.getppid() == parent:
        left = [w for w in works if not w.is_done]
        if not left:
            return 0
        begun = False
        for work in left:
            if not work.can_begin or work.is_done:
                continue
            with _held(work) as mine:
                if not mine or work.is_done:
                    continue
                begun = True
                work.dispatcher.compile(work.types)
            _report(works)
            if size_bytes() > LARGE_BYTES:
                return AGAIN
            break
        if not begun:
            time.sleep(_WAIT_S)
    return AGAIN


def size_bytes() -> int:
    """Return how much memory this process holds now."""
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE")


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
