"""Time for a program that must run in real time, faster, and under a virtual clock.

Everything timed in this project waits through asyncio and reads ``now_s()``. Time is therefore changed in one
place: the event loop. ``RealTimeLoop`` follows the monotonic clock, optionally ``speedup`` times faster (the
simulated boat is then in a hurry, and every time-out of the companion with it). ``VirtualTimeLoop`` has no
clock at all: when nothing is ready it jumps to the next timer, so a voyage takes as long as its arithmetic and
repeats bit for bit. No code asks which of them it runs on.
"""

from __future__ import annotations

import asyncio
import contextlib
import selectors
import signal
import time
from collections.abc import Coroutine
from typing import Any, TypeVar

T = TypeVar("T")


def effort_s() -> float:
    """Return a stopwatch reading [s] for computing budgets; no part of the voyage's time, never for its logic."""
    return time.perf_counter()


def now_s() -> float:
    """Return the running loop's time [s]; its zero is arbitrary and it never steps back."""
    return asyncio.get_running_loop().time()


ASK_EVERY = 64  # turns of a virtual loop that has no sockets


class RealTimeLoop(asyncio.SelectorEventLoop):
    """The monotonic clock, ``speedup`` times as fast."""

    def __init__(self, speedup: float = 1.0) -> None:
        self._speedup = speedup
        super().__init__(_ScaledSelector(speedup) if speedup != 1.0 else None)

    def time(self) -> float:
        """Return loop time [s]."""
        return time.monotonic() * self._speedup

    def close(self) -> None:
        """Close it; a signal that comes meanwhile, a second SIGTERM say, finds no closed pipe to be written to."""
        with contextlib.suppress(ValueError):  # another thread's loop is woken by no signal
            signal.set_wakeup_fd(-1)
        super().close()


class _ScaledSelector(selectors.DefaultSelector):
    """A selector whose time-outs are in loop seconds."""

    def __init__(self, speedup: float) -> None:
        super().__init__()
        self._speedup = speedup

    def select(self, timeout: float | None = None) -> list[tuple[selectors.SelectorKey, int]]:
        """Wait ``timeout`` loop seconds."""
        scaled = timeout / self._speedup if timeout is not None and timeout > 0.0 else timeout
        return list(super().select(scaled))


class VirtualTimeLoop(asyncio.SelectorEventLoop):
    """A loop without a clock: time is where the last timer fired.

    Nothing in it may wait for the outside world (sockets, threads, processes): with no timer and nothing ready
    it would wait for ever, so it raises instead.
    """

    def __init__(self) -> None:
        self._now_s = 0.0
        super().__init__(_JumpingSelector(self))

    def time(self) -> float:
        """Return virtual time [s], from 0."""
        return self._now_s

    def jump(self, seconds: float) -> None:
        """Let ``seconds`` pass."""
        self._now_s += seconds


class _JumpingSelector(selectors.DefaultSelector):
    """Never waits: a positive time-out moves the loop's time instead."""

    def __init__(self, loop: VirtualTimeLoop) -> None:
        super().__init__()
        self._loop = loop
        self._unasked = 0
        self._files = self.get_map()

    def select(self, timeout: float | None = None) -> list[tuple[selectors.SelectorKey, int]]:
        """Return what is ready now and let ``timeout`` virtual seconds pass if nothing is."""
        # Where there is nothing but the loop's own pipe, which wakes it from a wait, the system is hardly ever asked.
        self._unasked = self._unasked + 1 if len(self._files) <= 1 else ASK_EVERY
        ready = []
        if self._unasked >= ASK_EVERY or timeout is None:
            self._unasked = 0
            ready = list(super().select(0))
        if not ready:
            if timeout is None:
                raise RuntimeError("virtual time stands still: nothing is ready and no timer is set")
            if timeout > 0.0:
                self._loop.jump(timeout)
        return ready


async def ended(task: asyncio.Task[Any] | None) -> None:
    """Cancel a task and wait until it has ended; what it raised by itself is raised."""
    if task is not None:
        task.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await task


def run(main: Coroutine[Any, Any, T], *, speedup: float = 1.0) -> T:
    """Run ``main`` in real time, or ``speedup`` times faster.

    Raises:
        ValueError: ``speedup`` is not positive.
    """
    if not speedup > 0.0:
        main.close()
        raise ValueError(f"speedup must be positive, not {speedup}")
    with asyncio.Runner(loop_factory=lambda: RealTimeLoop(speedup)) as runner:
        return runner.run(main)


def run_virtual(main: Coroutine[Any, Any, T]) -> T:
    """Run ``main`` under the virtual clock."""
    with asyncio.Runner(loop_factory=VirtualTimeLoop) as runner:
        return runner.run(main)
