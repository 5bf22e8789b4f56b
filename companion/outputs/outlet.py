"""An outlet: one receiver of what the voyage tells, with a life of its own that no voyage waits for.

The voyage puts its newest value into a slot and goes on; a value that was not yet fetched is replaced and counted. What
goes wrong with a receiver is said in words, once, and tried again with a jittered pause, for ever.
"""

from __future__ import annotations

import asyncio
import errno
import random
from abc import ABC, abstractmethod
from collections.abc import Callable
from types import TracebackType
from typing import Generic, Self, TypeVar

from companion.clock import ended, now_s

T = TypeVar("T")
Say = Callable[[str], None]

BACKOFF_BASE_S, BACKOFF_CAP_S = 0.5, 15.0
HELD_S = 30.0            # a connection that held for so long starts the pauses from their beginning
SAY_AGAIN_S = 600.0      # the same words about a receiver are not said again sooner
_WORDS = {
    errno.EADDRINUSE: "the port is in use", errno.ECONNREFUSED: "nobody listens there",
    errno.EACCES: "not permitted", errno.EPERM: "not permitted", errno.EADDRNOTAVAIL: "no address of this computer",
    errno.ENETUNREACH: "no network leads there", errno.EHOSTUNREACH: "no way leads there",
}


class Slot(Generic[T]):
    """Room for one value: the newest."""

    def __init__(self) -> None:
        self._value: T | None = None
        self._is_filled = asyncio.Event()
        self.dropped = 0

    def put(self, value: T) -> None:
        """Put in a value, in place of one that nobody has fetched."""
        self.dropped += self._value is not None
        self._value = value
        self._is_filled.set()

    async def take(self) -> T:
        """Wait for a value and take it out."""
        while self._value is None:
            self._is_filled.clear()
            await self._is_filled.wait()
        value, self._value = self._value, None
        return value


class Outlet(ABC, Generic[T]):
    """One receiver. A context manager; ``serve`` is its life, begun anew when it ends."""

    def __init__(self, name: str, say: Say, *, seed: int = 0) -> None:
        self.name, self.slot = name, Slot[T]()
        self.sent = 0              # values handed over
        self.is_open = False
        self.state = "not open yet"
        self._say, self._rng = say, random.Random(seed)
        self._said: dict[str, float] = {}
        self._task: asyncio.Task[None] | None = None

    async def __aenter__(self) -> Self:
        self._task = asyncio.create_task(self._live(), name=f"output {self.name}")
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None,
    ) -> None:
        await ended(self._task)

    def tell(self, value: T) -> None:
        """Give it the newest value; returns at once."""
        self.slot.put(value)

    @property
    def dropped(self) -> int:
        """Values that the receiver was too slow for, or not there for."""
        return self.slot.dropped

    @abstractmethod
    async def serve(self) -> None:
        """Open the receiver and hand values over until it fails (OSError, TimeoutError) or hangs up."""

    def became(self, state: str, *, is_open: bool) -> None:
        """Note and say how it stands."""
        self.state, self.is_open = state, is_open
        t_s = now_s()
        if t_s - self._said.get(state, -SAY_AGAIN_S) >= SAY_AGAIN_S:
            self._said[state] = t_s
            self._say(f"{self.name}: {state}")

    async def _live(self) -> None:
        attempt = 0
        while True:
            began_s = now_s()
            why = "hung up"
            try:
                await self.serve()
            except Exception as error:   # whatever a receiver does, it is not worth the voyage
                why = reason(error)
            attempt = 0 if self.is_open and now_s() - began_s >= HELD_S else attempt + 1
            self.became(f"{why}; trying again", is_open=False)
            await asyncio.sleep(self._rng.uniform(0.0, min(BACKOFF_CAP_S, BACKOFF_BASE_S * 2.0 ** min(attempt, 10))))


def reason(error: BaseException) -> str:
    """Return an error in a few words."""
    if isinstance(error, TimeoutError):
        return "no answer"
    number = getattr(error, "errno", None)
    return _WORDS.get(number, "") if number in _WORDS else " ".join(str(error).split())[:120] or type(error).__name__
