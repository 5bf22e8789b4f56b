"""An outlet: one receiver of what the voyage tells, with a life of its own that no voyage waits for.

The voyage puts its newest value into a slot and goes on; a value that was not yet fetched is replaced and counted. What
goes wrong with a receiver is said in words, once, and tried again with a jittered pause, for ever.
"""

from __future__ import annotations

import asyncio
import errno
from abc import ABC, abstractmethod
from collections.abc import Callable
from types import TracebackType
from typing import Generic, Self, TypeVar

from companion import guard
from companion.clock import ended, now_s
from companion.guard import Guard, kept

T = TypeVar("T")
Say = Callable[[str], None]

SAY_AGAIN_S = 600.0  # the same words about a receiver are not said again sooner
_WORDS = {
    errno.EADDRINUSE: "the port is in use",
    errno.ECONNREFUSED: "nobody listens there",
    errno.EACCES: "not permitted",
    errno.EPERM: "not permitted",
    errno.EADDRNOTAVAIL: "no address of this computer",
    errno.ENETUNREACH: "no network leads there",
    errno.EHOSTUNREACH: "no way leads there",
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
    """One receiver, a context manager; ``serve`` is its life, begun anew when it ends. ``guard`` knows of it."""

    def __init__(self, name: str, say: Say, *, seed: int = 0) -> None:
        self.name, self.slot = name, Slot[T]()
        self.guard = Guard()
        self.sent = 0  # values handed over
        self.is_open = False
        self.state = "not open yet"
        self._say, self._seed = say, seed
        self._said: dict[str, float] = {}
        self._task: asyncio.Task[None] | None = None

    async def __aenter__(self) -> Self:
        self._task = asyncio.create_task(
            kept(self._live, self._failed, seed=self._seed), name=f"auxiliary: {self.name}"
        )
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
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
        if is_open:
            self.guard.found(self.name)
        else:
            self.guard.lost(self.name, state)
        t_s = now_s()
        if t_s - self._said.get(state, -SAY_AGAIN_S) >= SAY_AGAIN_S:
            self._said[state] = t_s
            self._say(f"{self.name}: {state}")

    async def _live(self) -> None:
        try:
            await self.serve()
        except OSError as error:
            number = error.errno if isinstance(error.errno, int) else 0
            raise OSError(_WORDS.get(number, guard.reason(error))) from error
        raise ConnectionError("hung up")

    def _failed(self, why: str) -> None:
        self.became(f"{why}; trying again", is_open=False)
