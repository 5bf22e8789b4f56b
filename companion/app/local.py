"""The socket on board: orders of who may open it, a line of words each, and their answers, a line of JSON each.

The word ``watch`` asks for the views of the voyage: a line of JSON for each step, until the connection is closed.

It is a Unix socket of mode 0600: the user that runs the companion, and root. What it may order is the mission's
``[operator] local_orders``. ``companion order --socket`` speaks to it; the live page gives its orders as it does.
"""

from __future__ import annotations

import asyncio
import contextlib
import itertools
import json
import socket
from collections import deque
from collections.abc import AsyncIterator
from pathlib import Path

import msgspec

from companion.app.crew import Crew
from companion.app.showing import Showing
from companion.disk import reason
from companion.errors import InputError
from companion.fold import Step
from companion.orders import Answer, Result, phrase
from companion.page import Guests
from companion.view import Event, View

MAX_LINE = 500     # bytes; an order is shorter
MOST = 8           # connections at a time: who has asked for nothing the longest makes room for the next
MOST_WATCH = 6     # of them, who are shown the voyage: there is room for an order
WATCH = b"watch"   # asks for the views
STUCK_S = 10.0     # who does not read for so long is hung up on
LOOK_S = 5.0       # whether it is still there
PROBE_S = 0.5      # for a program that listens there and takes nobody
EVENTS_KEPT = 100  # for who reads late; of the views there is only the newest


async def take_orders(path: Path, crew: Crew, showing: Showing) -> None:
    """Serve the socket until cancelled.

    Raises:
        InputError: it cannot be made, or was taken away.
    """
    async with served(path, crew, showing):
        while True:
            await asyncio.sleep(LOOK_S)
            if not path.is_socket():
                raise InputError("--socket", str(path), "was taken away", "leave it where it is")


@contextlib.asynccontextmanager
async def served(path: Path, crew: Crew, showing: Showing) -> AsyncIterator[None]:
    """Take orders at ``path``, and tell who watches, while the body runs; afterwards it is gone.

    Raises:
        InputError: another program listens there, something else is there, or it cannot be made.
    """
    _clear(path)
    numbers = itertools.count(1)
    guests, watching = Guests(MOST), set[asyncio.StreamWriter]()

    async def talk(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        number = next(numbers)
        try:
            with contextlib.suppress(ConnectionError, ValueError, TimeoutError):   # gone, or a line without end
                while guests.take(writer) and (line := await reader.readline()):
                    guests.is_answered(writer)
                    if line.strip() == WATCH:
                        if len(watching) < MOST_WATCH:
                            watching.add(writer)
                            await _show(writer, showing)
                        break
                    answer = await _answer(line, crew, number)
                    writer.write(json.dumps({"result": answer.result.value, "text": answer.text}).encode() + b"\n")
                    async with asyncio.timeout(STUCK_S):
                        await writer.drain()
        finally:
            watching.discard(writer)
            guests.leave(writer)
            writer.close()

    listening = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    try:
        listening.bind(str(path))
        path.chmod(0o600)   # before anybody can connect: it does not listen yet
        server = await asyncio.start_unix_server(talk, sock=listening, limit=MAX_LINE)
    except OSError as error:
        listening.close()
        raise InputError("--socket", str(path), f"cannot be made ({reason(error)})", "name another place") from error
    try:
        async with server:
            yield
    finally:
        with contextlib.suppress(OSError):   # a disk that has become read-only meanwhile
            path.unlink(missing_ok=True)
        for writer in guests:
            writer.close()


async def _show(writer: asyncio.StreamWriter, showing: Showing) -> None:
    """Tell of each step until the other end is gone or does not read."""
    newest: list[View] = []
    events: deque[Event] = deque(maxlen=EVENTS_KEPT)
    has_news = asyncio.Event()

    def take(view: View, happened: tuple[Event, ...], _: Step) -> None:
        newest[:] = [view]
        events.extend(happened)
        has_news.set()

    showing.watchers.append(take)
    try:
        while not writer.is_closing():
            await has_news.wait()
            has_news.clear()
            writer.write(msgspec.json.encode({"view": newest[0], "events": tuple(events)}) + b"\n")
            events.clear()
            async with asyncio.timeout(STUCK_S):
                await writer.drain()
    finally:
        showing.watchers.remove(take)


def _clear(path: Path) -> None:
    """Remove a socket that nobody listens on any more: one of a companion that was killed."""
    if not path.exists():
        return
    if not path.is_socket():
        raise InputError("--socket", str(path), "is there already and no socket", "name another place")
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as probe:
        probe.settimeout(PROBE_S)
        try:
            probe.connect(str(path))
        except ConnectionRefusedError:
            path.unlink(missing_ok=True)
            return
        except OSError as error:
            raise InputError(
                "--socket", str(path), f"cannot be opened ({reason(error)})", "name another place") from error
    raise InputError("--socket", str(path), "another program listens there", "name another place, or end that one")


async def _answer(line: bytes, crew: Crew, number: int) -> Answer:
    try:
        return await crew.ask(phrase(line.decode("utf-8").split()), number)
    except (InputError, UnicodeDecodeError) as error:
        return Answer(result=Result.UNKNOWN, text=str(error))
