"""Compiling ahead: all listed kernels, by a process a core, with progress that can be believed.

The processes share nothing but the folder of machine code, where each kernel is compiled by one of them (``cache``).
So it goes on where it was, after a kill too, and there is no limit of time; two programs that begin at once share the
work.

    python -m companion.kernels.build PACKAGE...     what ``prepare`` runs beside the program that waits for it
"""

from __future__ import annotations

import contextlib
import os
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from companion.kernels.carried import is_carried, misfit
from companion.kernels.listed import Entry, from_text, read_list
from companion.kernels.places import looked_in, mark, sweep, written_to

KILLED = 9  # exit code where the compiling processes were killed
PROCESS_MB = 250  # of memory that each process may take, ...
KERNELS_A_PROCESS = 12  # which is what so many kernels make of it
# Of processes that are ended, what multiprocessing clears away after them is none of the user's business.
_QUIET = ("-W", "ignore::UserWarning:multiprocessing.resource_tracker")
_TRIES = 3  # of processes that die: short of memory, most likely


@dataclass(frozen=True, slots=True, kw_only=True)
class Progress:
    """How far it is: kernels, and the seconds of a processor that they were listed with."""

    done: int
    of: int
    done_s: float
    of_s: float
    why: str = ""  # the package's own were of no use

    def say(self, elapsed_s: float, first: Progress) -> str:
        """Return it in words; ``first`` was the progress ``elapsed_s`` ago."""
        made_s = self.done_s - first.done_s
        left = ""
        if self.done < self.of and made_s > 0.05 * (self.of_s - first.done_s):
            left = f", about {_rough(elapsed_s * (self.of_s - self.done_s) / made_s)} left"
        why = f" ({self.why})" if self.why else ""
        return f"compiling kernels, once on each machine: {self.done} of {self.of}{left}{why}"


def _rough(seconds: float) -> str:
    return f"{max(5, 5 * round(seconds / 5))} s" if seconds < 90.0 else f"{round(seconds / 60)} min"


def is_ready(packages: Sequence[str]) -> bool:
    """Return whether the packages' kernels, as their source is now, were all compiled before."""
    return all(is_carried(name) or any((place / mark(name)).exists() for place in looked_in()) for name in packages)


def prepare(packages: Sequence[str], *, say: Callable[[str], None]) -> None:
    """Compile what is missing of the packages' lists and say how far it is; return at once when nothing is.

    What cannot be compiled ahead, because the processes that do it die again and again, is compiled when it is called.
    """
    if is_ready(packages):
        return
    # In a session of its own: Ctrl-C is for this process, which ends its children itself.
    with subprocess.Popen(  # noqa: S603 - ours
        [sys.executable, *_QUIET, "-m", "companion.kernels.build", *packages],
        stdout=subprocess.PIPE,
        stdin=subprocess.DEVNULL,
        start_new_session=True,
    ) as compiling:
        try:
            assert compiling.stdout is not None
            began_s, first, why = time.monotonic(), None, misfit()
            for line in compiling.stdout:
                done, of, done_s, of_s = line.split()
                progress = Progress(done=int(done), of=int(of), done_s=float(done_s), of_s=float(of_s), why=why)
                first = first or progress
                say(progress.say(time.monotonic() - began_s, first))
            code = compiling.wait()
        finally:
            compiling.kill()  # its processes see it, and leave
    if code != 0:
        why = "killed, most likely for want of memory" if code in {KILLED, -KILLED} else f"exit code {code}"
        say(f"kernels cannot be compiled ahead ({why}): they are compiled one by one as they are called")
        return
    with contextlib.suppress(OSError):
        for name in packages:
            (written_to() / mark(name)).touch()


def compile_listed(packages: Sequence[str]) -> int:
    """Compile what is not there and write how far it is; return 0, or KILLED."""
    # Here: every companion asks this module whether all is compiled, and would keep what it never uses.
    import multiprocessing
    from concurrent.futures import ProcessPoolExecutor, as_completed
    from concurrent.futures.process import BrokenProcessPool

    sweep()
    left = [entry for package in packages for entry in read_list(package)]
    of, of_s, deaths = len(left), sum(entry.seconds for entry in left), 0
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(["companion.kernels.cache"])  # so that a process begins with numba loaded
    while left:
        at_once = process_count()
        try:
            # anew for each batch: what compiles grows
            with ProcessPoolExecutor(at_once, context, initializer=leave_with_parent) as pool:
                jobs = {pool.submit(_compile, entry): entry for entry in left[: at_once * KERNELS_A_PROCESS]}
                for job in as_completed(jobs):
                    job.result()
                    left.remove(jobs[job])
                    sys.stdout.write(f"{of - len(left)} {of} {of_s - sum(e.seconds for e in left):.2f} {of_s:.2f}\n")
                    sys.stdout.flush()
        except BrokenProcessPool:
            deaths += 1
            if deaths == _TRIES:
                return KILLED
    return 0


def leave_with_parent() -> None:
    """Let this process of a pool end when the one that it works for does: by itself it would wait for work for ever."""
    from multiprocessing import parent_process

    parent = parent_process()
    if parent is not None:
        _leave_after(parent.join)


def _leave_after(wait: Callable[[], None]) -> None:
    def leave() -> None:
        wait()
        os._exit(1)

    threading.Thread(target=leave, name="parent", daemon=True).start()


def _orphaned() -> None:
    asker = os.getppid()
    while os.getppid() == asker:
        time.sleep(0.2)


def _compile(entry: Entry) -> None:
    entry.kernel().compile(from_text(entry.signature))


def process_count() -> int:
    """Return how many processes compile at once: one a core, as far as there is memory for them."""
    cores = len(os.sched_getaffinity(0))
    with contextlib.suppress(OSError, ValueError, StopIteration):
        lines = Path("/proc/meminfo").read_text(encoding="ascii").splitlines()
        free_kb = int(next(line for line in lines if line.startswith("MemAvailable")).split()[1])
        return max(1, min(cores, free_kb // (1024 * PROCESS_MB)))
    return 1


if __name__ == "__main__":
    _leave_after(_orphaned)
    try:
        sys.exit(compile_listed(sys.argv[1:]))
    except BrokenPipeError:  # who asked for it has gone; there is nobody to flush for either
        os._exit(1)
