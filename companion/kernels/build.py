"""Compiling ahead: all listed kernels, by several processes at once, each small, with progress that can be believed.

    python -m companion.kernels.build companion sitl

The processes share nothing but the folder of machine code: each takes the next kernel that nobody has begun and whose
callees are there, holds it by a lock while it compiles (``crew``), and leaves before it has grown large; another takes
its place. So it goes on where it was, after a kill too, and there is no limit of time. Two programs that begin at once
share the work.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Self

from companion.errors import JobError
from companion.kernels.places import CARRIED, folder, mark, sweep

ROOM_BYTES = 250 * 2**20    # for each process that compiles
AGAIN = 3                   # exit code of a process that leaves work to the next
_TRIES = 3                  # of processes that die: short of memory, most likely
_PULSE_S = 0.1
_SAY_S = 10.0               # between two lines of progress where there is no terminal


@dataclass(frozen=True, slots=True, kw_only=True)
class Progress:
    """How far it is: kernels, and the seconds of a processor that they were listed with."""

    done: int
    of: int
    done_s: float
    of_s: float

    def say(self, elapsed_s: float, first: Progress) -> str:
        """Return it in words; ``first`` was the progress ``elapsed_s`` ago."""
        made_s = self.done_s - first.done_s
        left = ""
        if made_s > 0.05 * (self.of_s - first.done_s):
            left = f", about {_rough(elapsed_s * (self.of_s - self.done_s) / made_s)} left"
        return f"compiling kernels, once on each machine: {self.done} of {self.of}{left}"


def _rough(seconds: float) -> str:
    return f"{max(5, 5 * round(seconds / 5))} s" if seconds < 90.0 else f"{round(seconds / 60)} min"


def is_ready(packages: Sequence[str]) -> bool:
    """Return whether the packages' kernels, as their source is now, were all compiled before."""
    name = mark(packages)
    return any((place / name).exists() for place in (CARRIED, folder()))


def prepare(packages: Sequence[str], *, beat: Callable[[str], None] = lambda _: None) -> None:
    """Compile what is missing of the packages' lists and say how far it is; return at once when nothing is.

    ``beat`` is called several times a second with the last progress. What cannot be compiled ahead is compiled when
    it is called.

    Raises:
        JobError: the processes that compile die again and again.
    """
    if is_ready(packages):
        return
    with contextlib.ExitStack() as stack:
        speaker = stack.enter_context(_Speaker())
        crew: list[_Hand] = []
        stack.callback(_dismiss, crew)
        first: Progress | None = None
        began_s, died = time.monotonic(), 0
        while True:
            while len(crew) < hands():
                crew.append(_Hand(packages))
            time.sleep(_PULSE_S)
            for hand in list(crew):
                for progress in hand.reports():
                    first = first or progress
                    speaker.say(progress.say(time.monotonic() - began_s, first))
                code = hand.child.poll()
                if code is None:
                    continue
                crew.remove(hand)
                if code == 0:
                    _finish(packages)
                    return
                died += code != AGAIN
                if died >= _TRIES:
                    raise JobError(f"the kernels cannot be compiled: {_death(code)}")
            beat(speaker.last)


def hands() -> int:
    """Return how many processes compile at once: one a core, as far as there is memory for them."""
    cores = len(os.sched_getaffinity(0))
    with contextlib.suppress(OSError, ValueError, StopIteration):
        lines = Path("/proc/meminfo").read_text(encoding="ascii").splitlines()
        free = 1024 * int(next(line for line in lines if line.startswith("MemAvailable")).split()[1])
        return max(1, min(cores, free // ROOM_BYTES))
    return 1


class _Hand:
    """A process that compiles, and what it has reported."""

    def __init__(self, packages: Sequence[str]) -> None:
        # In a session of its own: Ctrl-C is for the parent, which ends its children itself.
        self.child = subprocess.Popen(  # noqa: S603 - our own program
            [sys.executable, "-m", "companion.kernels.crew", *packages], stdout=subprocess.PIPE,
            stdin=subprocess.DEVNULL, start_new_session=True)
        assert self.child.stdout is not None
        self._pipe = self.child.stdout
        os.set_blocking(self._pipe.fileno(), False)
        self._rest = b""

    def reports(self) -> list[Progress]:
        """Return what it has reported since it was asked last."""
        with contextlib.suppress(BlockingIOError):
            self._rest += os.read(self._pipe.fileno(), 65_536)
        *lines, self._rest = self._rest.split(b"\n")
        out = []
        for line in lines:
            done, of, done_s, of_s = line.split()
            out.append(Progress(done=int(done), of=int(of), done_s=float(done_s), of_s=float(of_s)))
        return out

    def end(self) -> None:
        """End it; what it has in hand is begun again by another."""
        self.child.kill()
        self.child.wait()
        self._pipe.close()


def _dismiss(crew: list[_Hand]) -> None:
    for hand in crew:
        hand.end()


def _finish(packages: Sequence[str]) -> None:
    with contextlib.suppress(OSError):
        (folder() / mark(packages)).touch()
    sweep(time.time())


def _death(code: int) -> str:
    if code == -9:
        return "killed, most likely for want of memory; close other programs, or add swap"
    return f"exit code {code}"


class _Speaker:
    """Says how far it is on standard error: in place on a terminal, else a line now and then."""

    def __init__(self) -> None:
        self.last = ""
        self._is_terminal = sys.stderr.isatty()
        self._said_s = float("-inf")

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *unused: object) -> None:
        if self.last and self._is_terminal:
            sys.stderr.write("\n")

    def say(self, text: str) -> None:
        """Say it, if it is new and due."""
        now_s = time.monotonic()
        if text == self.last or (not self._is_terminal and now_s - self._said_s < _SAY_S):
            return
        self.last, self._said_s = text, now_s
        sys.stderr.write(f"\r{text:<100}" if self._is_terminal else f"{text}\n")
        sys.stderr.flush()


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Compile the kernels of packages ahead.")
    parser.add_argument("packages", nargs="+", choices=("companion", "sitl"))
    prepare(parser.parse_args().packages)
