"""Compiling ahead: all listed kernels, by several processes at once, each small, with progress that can be believed.

The processes (``crew``) share nothing but the folder of machine code: each takes the next kernel that nobody has
begun and whose callees are there, holds it by a lock while it compiles, and leaves before it has grown large; another
takes its place. So it goes on where it was, after a kill too, and there is no limit of time. Two programs that begin
at once share the work.
"""

from __future__ import annotations

import contextlib
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from companion.kernels.places import looked_in, mark, misfit, sweep, written_to

KILLED = 9   # exit code of a crew whose hands were killed


@dataclass(frozen=True, slots=True, kw_only=True)
class Progress:
    """How far it is: kernels, and the seconds of a processor that they were listed with."""

    done: int
    of: int
    done_s: float
    of_s: float
    why: str = ""   # the package's own were of no use

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
    return all(any((place / name).exists() for place in looked_in()) for name in map(mark, packages))


def prepare(packages: Sequence[str], *, say: Callable[[str], None]) -> None:
    """Compile what is missing of the packages' lists and say how far it is; return at once when nothing is.

    What cannot be compiled ahead, because the processes that do it die again and again, is compiled when it is called.
    """
    if is_ready(packages):
        return
    # In a session of its own: Ctrl-C is for this process, which ends its children itself.
    with subprocess.Popen([sys.executable, "-m", "companion.kernels.crew", *packages],  # noqa: S603 - our own program
                          stdout=subprocess.PIPE, stdin=subprocess.DEVNULL, start_new_session=True) as crew:
        try:
            assert crew.stdout is not None
            began_s, first, why = time.monotonic(), None, misfit()
            for line in crew.stdout:
                done, of, done_s, of_s = line.split()
                progress = Progress(done=int(done), of=int(of), done_s=float(done_s), of_s=float(of_s),
                                    why=why)
                first = first or progress
                say(progress.say(time.monotonic() - began_s, first))
            code = crew.wait()
        finally:
            crew.kill()   # its hands see it, and leave after the kernel in hand
    if code != 0:
        why = "killed, most likely for want of memory" if code in {KILLED, -KILLED} else f"exit code {code}"
        say(f"kernels cannot be compiled ahead ({why}): they are compiled one by one as they are called")
        return
    with contextlib.suppress(OSError):
        for name in map(mark, packages):
            (written_to() / name).touch()
    sweep(time.time())
