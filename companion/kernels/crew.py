"""The processes that compile ahead: each takes kernels from the lists until none is left, or it has grown large.

They are forked from one that has loaded everything, so that a new one costs nothing; it must have no threads.
"""

from __future__ import annotations

import contextlib
import fcntl
import os
import signal
import sys
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from companion.kernels.numba_alone import numba

# isort: split

from numba.core.registry import cpu_target

from companion.errors import JobError
from companion.kernels.build import KILLED
from companion.kernels.cache import KernelCache
from companion.kernels.listed import Entry, read_list
from companion.kernels.places import looked_in, written_to
from companion.kernels.stamp import callees

GROWTH_BYTES = 50 * 2**20   # a process that has grown by this leaves after the kernel in hand
_TRIES = 3                  # of hands that die: short of memory, most likely
_WAIT_S = 0.2


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
        self._is_done = self._is_done or any((place / self.file).exists() for place in looked_in())
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
def _held(work: Work, place: Path) -> Iterator[bool]:
    """Hold a kernel while it is compiled; False when another process does."""
    path = place / f".{work.file}.lock"
    fd = os.open(path, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW | os.O_CLOEXEC, 0o600)
    with os.fdopen(fd, "w") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            yield False
            return
        try:
            yield True
        finally:
            path.unlink(missing_ok=True)


def _report(works: Sequence[Work]) -> int:
    """Write how far it is; return how many are left."""
    done = [w for w in works if w.is_done]
    sys.stdout.write(f"{len(done)} {len(works)} {sum(w.entry.seconds for w in done):.2f} "
                     f"{sum(w.entry.seconds for w in works):.2f}\n")
    sys.stdout.flush()
    return len(works) - len(done)


def _compile(works: Sequence[Work], place: Path) -> None:
    """Compile one kernel after the other until none is left, or this process has grown."""
    parent, began_bytes = os.getppid(), size_bytes()
    while os.getppid() == parent and size_bytes() < began_bytes + GROWTH_BYTES:
        left = [w for w in works if not w.is_done]
        if not left:
            return
        for work in left:
            if not work.can_begin or work.is_done:
                continue
            with _held(work, place) as mine:
                if mine and not work.is_done:
                    work.dispatcher.compile(work.types)
                    break
        else:
            time.sleep(_WAIT_S)   # all that can be begun is in other hands


def _hand(works: Sequence[Work], place: Path) -> int:
    """Begin a process that compiles; return its id."""
    child = os.fork()
    if child == 0:
        code = 1
        try:
            _compile(works, place)
            code = 0
        finally:
            os._exit(code)
    return child


def main(packages: Sequence[str]) -> int:
    """Keep hands at work until nothing is left; return 0, or how they died (a signal's number is negative)."""
    parent, place, works = os.getppid(), written_to(), planned(packages)
    # What each of them needs is loaded before they part.
    numba.njit("float64(float64)")(_square)
    crew: set[int] = set()
    deaths = 0
    while _report(works) and os.getppid() == parent:
        while len(crew) < hands():
            crew.add(_hand(works, place))
        time.sleep(_WAIT_S)
        for hand in list(crew):
            found, status = os.waitpid(hand, os.WNOHANG)
            if found:
                crew.remove(hand)
                deaths += status != 0
                if deaths >= _TRIES:
                    return KILLED if os.waitstatus_to_exitcode(status) == -signal.SIGKILL else 1
    return 0


def _square(x: float) -> float:
    return x * x


def hands() -> int:
    """Return how many processes compile at once: one a core, as far as there is memory for them."""
    cores = len(os.sched_getaffinity(0))
    with contextlib.suppress(OSError, ValueError, StopIteration):
        lines = Path("/proc/meminfo").read_text(encoding="ascii").splitlines()
        free = 1024 * int(next(line for line in lines if line.startswith("MemAvailable")).split()[1])
        return max(1, min(cores, free // (2 * GROWTH_BYTES)))
    return 1


def size_bytes() -> int:
    """Return how much memory this process holds now."""
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE")


if __name__ == "__main__":
    try:
        sys.exit(main(sys.argv[1:]))
    except BrokenPipeError:   # who asked for it has gone; there is nobody to flush for either
        os._exit(1)
