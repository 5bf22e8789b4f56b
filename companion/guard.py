"""The guard: everything that only shows, tells or records a voyage, and of which nothing may keep it or end it.

A voyage needs its fold, its executor and its link. Whatever else lives beside them is an ``Auxiliary``: a task that is
begun again after a pause when it fails, or a piece of work of each step that is left out when it fails. What is gone is
known here by its name, with the reason, until it has been well for a while; the voyage goes on and says so.
"""

from __future__ import annotations

import asyncio
import contextlib
import math
import random
from collections.abc import Awaitable, Callable
from enum import StrEnum
from typing import TypeVar

from companion.clock import ended, now_s

T = TypeVar("T")
Told = Callable[[str, str], None]

BACKOFF_BASE_S, BACKOFF_CAP_S = 0.5, 15.0
HELD_S = 30.0  # what held for so long is well again, and its pauses start from their beginning
MOST_CHARACTERS = 160  # of a reason


class Auxiliary(StrEnum):
    """What lives beside a voyage; what is added here needs its faults in ``tests/app/test_guard.py``."""

    PAGE = "live page"
    ORDERS_BY_PAGE = "orders on the page"
    CHARTS = "charts of the page"
    PASSAGE = "passage on the page"
    SOCKET = "orders on board"
    OUTPUTS = "other displays"
    SIGNALK_TOKEN = "Signal K token"  # noqa: S105 - a name
    FAR = "satellite link"
    RADIO = "status on the radio"
    HIGH_LATENCY = "high latency status"
    STATUS = "status"
    VIEW = "view of the voyage"
    CONSOLE = "console"
    RECORDS = "records"
    STATE = "state for a restart"
    LOOP_WATCH = "loop watch"
    CREW = "watch for unsigned commands"
    ADOPTION = "adoption of drawings"
    IDENTITY = "identity of the autopilot"
    PARAMETERS = "parameters of the autopilot"
    FENCE = "fence on the autopilot"
    FEEDS = "AIS feeds"


async def kept(
    live: Callable[[], Awaitable[object]], failed: Callable[[str], None], *, seed: int = 0, pace: float = 1.0
) -> None:
    """Run ``live`` until it returns; whatever it raises ``failed`` hears in words, and after a pause it runs again.

    Pauses are jittered and grow to ``BACKOFF_CAP_S``; ``pace`` is the loop's seconds in one of them. Only being
    cancelled ends it besides: not a cancellation that comes from within.
    """
    rng, attempt = random.Random(seed), 0
    while True:
        began_s = now_s()
        try:
            await live()
        except asyncio.CancelledError:
            task = asyncio.current_task()
            if task is None or task.cancelling():
                raise
            why = "it was cancelled"
        except Exception as error:  # whatever it is, it is not worth the voyage
            why = reason(error)
            task = asyncio.current_task()
            if task is not None and task.cancelling():  # its last act failed
                failed(why)
                return
        else:
            return
        attempt = 0 if now_s() - began_s >= HELD_S * pace else attempt + 1
        failed(why)
        await asyncio.sleep(pace * rng.uniform(0.0, min(BACKOFF_CAP_S, BACKOFF_BASE_S * 2.0 ** min(attempt, 10))))


def reason(error: BaseException) -> str:
    """Return an error in a few words: an operating system's or ours as it is, any other with its kind."""
    if isinstance(error, TimeoutError):
        return "no answer"
    if isinstance(error, BaseExceptionGroup):
        return reason(error.exceptions[0])
    text = " ".join(str(getattr(error, "strerror", None) or error).split())[:MOST_CHARACTERS]
    is_ours = isinstance(error, OSError) or type(error).__module__ == "companion.errors"
    return text if is_ours and text else f"{type(error).__name__}: {text}" if text else type(error).__name__


def _now_s() -> float:
    try:
        return now_s()
    except RuntimeError:  # before there is a loop
        return 0.0


class Guard:
    """Knows what is gone, and runs what may be.

    Attributes:
        told: hears what is gone and why, and with an empty reason what is there again; it may raise, too.
        gone: why each of them is gone, by its name.
    """

    def __init__(self, told: Told = lambda _name, _why: None, *, seed: int = 0, pace: float = 1.0) -> None:
        self.told, self.gone = told, dict[str, str]()
        self._seed, self._pace = seed, pace
        self._failed_s: dict[str, float] = {}  # infinite: for good
        self._down: set[str] = set()  # tasks between two attempts
        self._tasks: dict[str, asyncio.Task[None]] = {}
        self._is_telling = False

    # --------------------------------------------------------------------------------------------- what is guarded
    def keep(self, name: str, live: Callable[[], Awaitable[object]]) -> None:
        """Run ``live`` as a task of that name until ``end``, again and again where it fails."""

        async def once() -> None:
            self._down.discard(name)
            await live()

        def failed(why: str) -> None:
            self._down.add(name)
            self.lost(name, why)

        self._tasks[name] = asyncio.create_task(
            kept(once, failed, seed=self._seed + len(self._tasks), pace=self._pace), name=f"auxiliary: {name}"
        )

    def call(self, name: str, work: Callable[[], T]) -> T | None:
        """Return what ``work`` returns, None where it fails."""
        try:
            return work()
        except Exception as error:  # as above
            self.lost(name, reason(error))
            return None

    async def wait(self, name: str, work: Callable[[], Awaitable[T]]) -> T | None:
        """Return what ``work`` returns in the end, None where it fails."""
        try:
            return await work()
        except Exception as error:  # as above
            self.lost(name, reason(error))
            return None

    async def end(self) -> None:
        """End all tasks."""
        for task in self._tasks.values():
            task.cancel()
        for name, task in self._tasks.items():
            await self.wait(name, lambda task=task: ended(task))  # type: ignore[misc]
        self._tasks.clear()

    # ------------------------------------------------------------------------------------------------ what is gone
    def lost(self, name: str, why: str, *, for_good: bool = False) -> None:
        """Note, and tell once, that something is gone; ``for_good``: until this program ends."""
        is_new = name not in self.gone
        self.gone[name] = why
        self._failed_s[name] = math.inf if for_good else _now_s()
        if is_new:
            self._tell(name, why)

    def found(self, name: str) -> None:
        """Note, and tell, that something is there again."""
        if self.gone.pop(name, None) is not None:
            self._failed_s.pop(name, None)
            self._tell(name, "")

    def look(self) -> None:
        """Find what has been well for a while; called now and then."""
        for name, failed_s in tuple(self._failed_s.items()):
            if name not in self._down and _now_s() - failed_s >= HELD_S * self._pace:
                self.found(name)

    def sentence(self) -> str:
        """Return all that is gone in words, empty when nothing is."""
        return "; ".join(f"without the {name}: {why}" for name, why in self.gone.items())

    def _tell(self, name: str, why: str) -> None:
        if self._is_telling:  # what tells may be what is gone
            return
        self._is_telling = True
        with contextlib.suppress(Exception):
            self.told(name, why)
        self._is_telling = False
