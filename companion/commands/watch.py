"""``companion watch``: a dashboard for a terminal, ashore over the radio or on board beside ``companion run``."""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import os
import signal
import sys
import time
from abc import ABC, abstractmethod
from collections.abc import Collection
from dataclasses import replace
from pathlib import Path
from types import TracebackType
from typing import Any, Self, TypedDict

from companion.clock import ended, now_s
from companion.disk import reason
from companion.errors import InputError, LinkError
from companion.messages import VehicleState
from companion.orders import Answer, Wanted, give
from companion.program.arguments import number, radio_options
from companion.view import Event, HeardFold, View

EXIT_NO_LINK = 3
DRAW_EVERY_S = 0.5  # over ssh a redraw costs; what changes faster than this nobody reads


def add_parser(subparsers: Any, summary: str) -> None:
    """Add the command."""
    parser = subparsers.add_parser(
        "watch",
        help=summary,
        description="Watch a voyage on a terminal: state and why, alarms, wind with its history, course, plan, log. "
        "Ashore over another link of the autopilot, from what the companion says there; on board at the socket of "
        "companion run --socket PATH, with everything that it knows. Keys give the orders that the mission permits; "
        "what moves the boat is asked again first. Where the output is no terminal, it is a line now and then.",
        epilog="Keys: q end, ? help. Exit codes: 0 ended by a key or Ctrl-C, 3 no link, or nothing heard "
        "(without a terminal). Examples: companion watch --link /dev/ttyUSB0:57600; companion watch --socket boat.sock",
    )
    radio_options(parser, required=False)
    parser.add_argument("--socket", type=Path, metavar="PATH", help="on board, in place of a link: as the companion's")
    parser.add_argument(
        "--signing-key",
        type=Path,
        metavar="FILE",
        help="MAVLink signing key (mode 0600), for orders to a boat that has one",
    )
    parser.add_argument(
        "--timeout",
        type=number("s", above=0.0),
        default=10.0,
        metavar="S",
        help="without a terminal: give up when nothing is heard for so long; for orders: until the "
        "answer (default: 10)",
    )
    parser.add_argument(
        "--every",
        type=number("s", above=0.0),
        default=10.0,
        metavar="S",
        help="without a terminal: between two lines (default: 10)",
    )
    parser.add_argument("--units", choices=("ms", "kn"), default="kn", help="of speeds (default: kn)")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Run the command."""
    if (args.link is None) == (args.socket is None):
        raise InputError(
            "--link",
            "",
            "is missing: there is nobody to watch" if args.link is None else "and --socket are two ways to one boat",
            "name the link of the radio, as --link /dev/ttyUSB0:57600, or on board --socket PATH",
        )
    from companion.clock import run as run_loop

    try:
        return run_loop(_watch(args))
    except LinkError as error:  # the port is not to be had at all
        sys.stderr.write(f"companion watch: {error}\n")
        return EXIT_NO_LINK


async def _watch(args: argparse.Namespace) -> int:
    from companion.terminal import can_draw

    over = asyncio.Event()
    loop = asyncio.get_running_loop()
    for end in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        loop.add_signal_handler(end, over.set)
    async with _source(args) as source:
        if can_draw(sys.stdout, os.environ):
            return await _draw(args, source, over)
        with contextlib.suppress(BrokenPipeError):
            return await _tell(args, source, over)
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # nobody reads any more
        return 0


def _source(args: argparse.Namespace) -> ViewSource:
    if args.socket is not None:
        from companion.commands.order import require_socket

        require_socket(args.socket)
        return OnBoard(args.socket)
    signing = None
    if args.signing_key is not None:
        from companion.mavlink.signing import SigningStore

        signing = SigningStore(args.signing_key, time.time())
    return RadioSource(args.link, system=args.system, timeout_s=args.timeout, signing=signing)


async def _draw(args: argparse.Namespace, source: ViewSource, over: asyncio.Event) -> int:
    """Draw until somebody ends it."""
    from companion.terminal import History, KeyCommands, Shown, Terminal, draw

    helm, history, said = KeyCommands(knots=args.units == "kn"), History(), ""
    is_due = asyncio.Event()
    giving: asyncio.Task[str] | None = None
    began_s = now_s()

    def press(key: str) -> None:
        nonlocal helm, giving, said
        helm = helm.press(key, source.orders)
        if helm.is_over:
            over.set()
        elif helm.order is not None and giving is not None:
            helm = replace(helm, said="the order before it is not answered yet")
        elif helm.order is not None:
            said = f"{helm.order.words}: given, waiting for the answer"
            giving = asyncio.create_task(_given(source, helm.order, args.timeout), name="order")
            giving.add_done_callback(lambda _: is_due.set())
        is_due.set()

    ended = asyncio.create_task(over.wait())
    with Terminal(press, is_due.set, has_colour=not os.environ.get("NO_COLOR")) as terminal:
        while not over.is_set():
            if giving is not None and giving.done():
                said, giving = giving.result(), None
            view, events = source.look()
            if view is not None:
                history.take(view, events)
            columns, rows = terminal.size
            terminal.show(
                draw(
                    Shown(
                        link=source.name,
                        view=view,
                        history=history,
                        helm=helm,
                        unix_s=time.time(),
                        orders=source.orders,
                        said=said or source.trouble,
                        waited_s=now_s() - began_s,
                    ),
                    columns,
                    rows,
                )
            )
            is_due.clear()
            waits = {ended, asyncio.create_task(is_due.wait())}
            _, pending = await asyncio.wait(waits, timeout=DRAW_EVERY_S, return_when=asyncio.FIRST_COMPLETED)
            for wait in pending - {ended}:
                wait.cancel()
    if giving is not None:
        giving.cancel()
    return 0


async def _given(source: ViewSource, wanted: Wanted, give_up_s: float) -> str:
    """Give an order and return its answer in words."""
    try:
        answer = await source.give(wanted, give_up_s)
    except LinkError as error:
        return f"{wanted.words}: {error}"
    return f"{wanted.words}: {answer.result.value}: {answer.text}"


async def _tell(args: argparse.Namespace, source: ViewSource, over: asyncio.Event) -> int:
    """Write a line now and then, and what happens."""
    from companion.terminal import event_words, line_of

    began_s, next_s = now_s(), 0.0
    while not over.is_set():
        view, events = source.look()
        if view is None and now_s() - began_s >= args.timeout:
            sys.stderr.write(f"companion watch: {source.name}: {source.trouble or 'nothing heard'}\n")
            return EXIT_NO_LINK
        for event in events:
            sys.stdout.write(f"{event_words(event)}\n")
        if view is not None and now_s() >= next_s:
            next_s = now_s() + args.every
            sys.stdout.write(f"{line_of(view, time.time(), knots=args.units == 'kn')}\n")
        sys.stdout.flush()
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(DRAW_EVERY_S):
                await over.wait()
    return 0


MOST_LINE = 1 << 20  # bytes; a view is a few thousand
AGAIN_S = 2.0  # until a socket that is not there is tried again
Look = tuple[View | None, tuple[Event, ...]]


class _Told(TypedDict):
    view: View
    events: tuple[Event, ...]


class ViewSource(ABC):
    """Views, and a way for orders. A context manager. ``trouble``: why there is no end to the waiting, empty: none."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.trouble = ""
        self.orders: Collection[str] | None = None  # verbs that are permitted here; None: not known
        self._task: asyncio.Task[None] | None = None

    async def __aenter__(self) -> Self:
        self._task = asyncio.create_task(self._live(), name=f"watching {self.name}")
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
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


class RadioSource(ViewSource):
    """What an autopilot's link brings of its companion; speaks once, and for orders."""

    def __init__(self, name: str, *, system: int | None, timeout_s: float, signing: Any = None) -> None:
        from companion.mavlink.link import Link
        from companion.mavlink.reception import SHORE
        from companion.mavlink.transports import open_link
        from companion.mavlink.wire import StatusReader, VehicleAssembler

        super().__init__(name)
        self._timeout_s = timeout_s
        self._reader, self._assembler, self._fold = StatusReader(), VehicleAssembler(), HeardFold()
        self._vehicle: VehicleState | None = None
        self._link = Link(
            open_link(name), identity=SHORE, target_system=system, streams=(), is_quiet=True, signing=signing
        )
        self._stack = contextlib.AsyncExitStack()

    async def __aenter__(self) -> Self:
        self._link.subscribe(self._take)
        await self._stack.enter_async_context(self._link)
        return await super().__aenter__()

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
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
                if now_s() - began_s < 0.5 * self._timeout_s:  # it cannot be told which one is ours
                    return
            else:
                self.trouble = ""
                return


class OnBoard(ViewSource):
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
