"""Where ``companion watch`` has its views from: a link of the autopilot, or the socket of the companion on board."""

from __future__ import annotations

import asyncio
import contextlib
import time
from abc import ABC, abstractmethod
from collections.abc import Collection
from pathlib import Path
from types import TracebackType
from typing import Any, Self, TypedDict

from companion.clock import ended, now_s
from companion.disk import reason
from companion.errors import LinkError
from companion.messages import VehicleState
from companion.orders import Answer, Wanted, give
from companion.view import Event, HeardFold, View

MOST_LINE = 1 << 20    # bytes; a view is a few thousand
AGAIN_S = 2.0          # until a socket that is not there is tried again
Look = tuple[View | None, tuple[Event, ...]]


class _Told(TypedDict):
    view: View
    events: tuple[Event, ...]


class Source(ABC):
    """Views, and a way for orders. A context manager. ``trouble``: why there is no end to the waiting, empty: none."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.trouble = ""
        self.orders: Collection[str] | None = None   # verbs that are permitted here; None: not known
        self._task: asyncio.Task[None] | None = None

    async def __aenter__(self) -> Self:
        self._task = asyncio.create_task(self._live(), name=f"watching {self.name}")
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None,
    ) -> None:
        await ended(self._task)

    @abstractmethod
    def look(self) -> Look:
        """Return how it is now, and what has happened since the last look."""

    @abstractmethod
    async def give(self, wanted: Wanted, give_up_s: float) -> Answer:
        """Give an order. Raises LinkError."""

    @abstractmethod
    async def _live(self) -> None:
        """Hear until cancelled."""


class Radio(Source):
    """What an autopilot's link brings of its companion; speaks once, and for orders."""

    def __init__(self, name: str, *, system: int | None, timeout_s: float, signing: Any = None) -> None:
        from companion.mavlink.link import Link
        from companion.mavlink.transports import open_link
        from companion.mavlink.trust import SHORE
        from companion.mavlink.wire import StatusReader, VehicleAssembler

        super().__init__(name)
        self._timeout_s = timeout_s
        self._reader, self._assembler, self._fold = StatusReader(), VehicleAssembler(), HeardFold()
        self._vehicle: VehicleState | None = None
        self._link = Link(open_link(name), identity=SHORE, target_system=system, streams=(), is_quiet=True,
                          signing=signing)
        self._stack = contextlib.AsyncExitStack()

    async def __aenter__(self) -> Self:
        self._link.subscribe(self._take)
        await self._stack.enter_async_context(self._link)
        return await super().__aenter__()

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None,
    ) -> None:
        await super().__aexit__(kind, error, trace)
        await self._stack.aclose()

    def look(self) -> Look:
        """Return what is known now; the ages grow by themselves where nothing comes."""
        t_s = now_s()
        report = self._reader.report(t_s)
        if report is None and self._vehicle is None and self._assembler.status is None:
            return None, ()
        return self._fold.take(t_s, report, self._vehicle, self._assembler.status, time.time())

    async def give(self, wanted: Wanted, give_up_s: float) -> Answer:
        """Send it until it is acknowledged."""
        if not self._link.has_autopilot:
            raise LinkError(f"{self.name}: no autopilot is heard")
        return await give(self._link, wanted, give_up_s=give_up_s)

    def _take(self, t_s: float, message: Any) -> None:
        for value in self._assembler.take(t_s, message):
            if isinstance(value, VehicleState):
                self._vehicle = value
        self._reader.take(t_s, message)

    async def _live(self) -> None:
        while True:
            began_s = now_s()
            try:
                await self._link.wait_autopilot(self._timeout_s)
            except LinkError as error:
                self.trouble = str(error).removeprefix(f"{self.name}: ")
                if now_s() - began_s < 0.5 * self._timeout_s:   # it cannot be told which one is ours
                    return
            else:
                self.trouble = ""
                return


class OnBoard(Source):
    """What the companion on board tells at its socket: every step, whole."""

    def __init__(self, path: Path) -> None:
        super().__init__(str(path))
        self._path = path
        self._view: View | None = None
        self._heard_s = 0.0
        self._events: list[Event] = []

    def look(self) -> Look:
        """Return the newest step, older by what has passed since."""
        from companion.view.fold import aged

        events, self._events = tuple(self._events), []
        passed_s = now_s() - self._heard_s
        if self._view is None or passed_s < AGAIN_S:
            return self._view, events
        return aged(self._view, passed_s), events

    async def give(self, wanted: Wanted, give_up_s: float) -> Answer:
        """Give it on a connection of its own."""
        from companion.commands.order import give_on_board
        from companion.terminal import words_of

        return await give_on_board(self._path, words_of(wanted), give_up_s)

    async def _live(self) -> None:
        while True:
            try:
                reader, writer = await asyncio.open_unix_connection(self._path, limit=MOST_LINE)
                try:
                    writer.write(b"watch\n")
                    await self._hear(reader)
                finally:
                    writer.close()
                self.trouble = "the companion has hung up; trying again"
            except (OSError, ValueError) as error:
                why = reason(error) if isinstance(error, OSError) else "that is no companion of this version"
                self.trouble = f"nobody is there ({why}): companion run needs --socket"
            await asyncio.sleep(AGAIN_S)

    async def _hear(self, reader: asyncio.StreamReader) -> None:
        import msgspec

        decoder = msgspec.json.Decoder(_Told)
        while line := await reader.readline():
            told = decoder.decode(line)
            self._view, self._heard_s, self.trouble = told["view"], now_s(), ""
            self._events += told["events"]
            self.orders = told["view"].orders.permitted
