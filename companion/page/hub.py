"""Who watches: for each the newest view only, and what of the log he has not had. Nobody waits for anybody.

A view is encoded once and lies in one slot; a client that is slow misses some. The log is a ring with numbers: who
comes back names the last that he has, and gets the rest as far as it is kept.
"""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable, Sequence
from typing import Self

import msgspec

from companion.view import Event, View

KEPT = 600        # events: at most a few hundred kB


class Hub:
    """The newest view and the log. ``closed`` when the voyage is over."""

    def __init__(self, kept: int = KEPT) -> None:
        self.view: bytes | None = None
        self.is_closed = False
        self._version = 0
        self._ring: deque[tuple[int, bytes]] = deque(maxlen=kept)
        self._waiting: set[asyncio.Event] = set()
        self.watchers = 0

    def publish(self, view: View, events: Sequence[Event]) -> None:
        """Take the next view and what has happened."""
        for event in events:
            self._ring.append((event.number, msgspec.json.encode(event)))
        self.view = msgspec.json.encode(view)
        self._version += 1
        self._wake()

    def close(self) -> None:
        """Say that nothing comes any more."""
        self.is_closed = True
        self._wake()

    def _wake(self) -> None:
        for event in self._waiting:
            event.set()

    def log(self) -> Callable[[], bytes]:
        """Return what makes the JSON array of the log that is kept now; a thread may call it while more comes."""
        kept = tuple(self._ring)
        return lambda: b"[" + b",".join(data for _, data in kept) + b"]"

    @property
    def last_number(self) -> int:
        """The number of the newest event, 0: there was none."""
        return self._ring[-1][0] if self._ring else 0


class Watcher:
    """One client of a hub; ``number`` is the last event that he has. A context manager."""

    def __init__(self, hub: Hub, number: int) -> None:
        # a number that we never gave is of a voyage before this one
        self._hub, self._number = hub, number if number <= hub.last_number else 0
        self._version = -1
        self._news = asyncio.Event()

    def __enter__(self) -> Self:
        self._hub._waiting.add(self._news)  # noqa: SLF001
        self._hub.watchers += 1
        return self

    def __exit__(self, *unused: object) -> None:
        self._hub._waiting.discard(self._news)  # noqa: SLF001
        self._hub.watchers -= 1

    def wake(self) -> None:
        """Let ``wait`` return."""
        self._news.set()

    async def wait(self, at_most_s: float) -> bytes:
        """Return what is new as server-sent events, nothing after ``at_most_s`` [s]."""
        hub = self._hub
        if self._version == hub._version and not hub.is_closed:  # noqa: SLF001
            self._news.clear()
            try:
                async with asyncio.timeout(at_most_s):
                    await self._news.wait()
            except TimeoutError:
                return b": still here\n\n"
        parts = []
        for number, data in tuple(hub._ring):  # noqa: SLF001
            if number > self._number:
                parts.append(b"id: %d\nevent: log\ndata: %s\n\n" % (number, data))
                self._number = number
        if hub.view is not None and self._version != hub._version:  # noqa: SLF001
            parts.append(b"event: view\ndata: %s\n\n" % hub.view)
        self._version = hub._version  # noqa: SLF001
        if hub.is_closed:
            parts.append(b"event: over\ndata: {}\n\n")
        return b"".join(parts)
