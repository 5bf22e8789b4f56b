"""Who orders and who watches: the link's commands, the Unix socket, the live page, and the view made once for both.

The word ``watch`` asks for the views of the voyage: a line of JSON for each step, until the connection is closed.

It is a Unix socket of mode 0600: the user that runs the companion, and root. What it may order is the mission's
``[operator] local_orders``. ``companion order --socket`` speaks to it; the live page gives its orders as it does.
"""

from __future__ import annotations

import asyncio
import contextlib
import functools
import json
import socket
from collections import deque
from collections.abc import AsyncIterator, Callable, Sequence
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from companion.app.executor import Planner
from companion.clock import now_s
from companion.disk import reason
from companion.errors import InputError
from companion.fold import Step, VoyageFold
from companion.guard import Auxiliary, Guard
from companion.mavlink.autopilot import Autopilot
from companion.mavlink.link import LATER, Link
from companion.mavlink.wire import CONTROL_COMMAND, Drop
from companion.messages import CompanionStatus, Severity
from companion.orders import (
    COMMANDS,
    LOCAL,
    MAVLINK,
    RESULTS,
    Answer,
    Order,
    Result,
    Source,
    Verb,
    Wanted,
    permitted,
    phrase,
    wanted_of,
)
from companion.page import Address, Guests, LiveSource, TileChart, plan_figures, served
from companion.planner import Plan
from companion.skipper import SkipperConfig, Voyage
from companion.skipper.step import Acknowledge
from companion.telemetry.folder import VoyageFigures
from companion.view import AreaView, Event, View, ViewFold
from companion.view.passage import PlannedPassage

# What comes in one step beyond this is sent away: each order costs the radio an answer.
MOST_WAITING = 4


class OperatorCommands:
    """Takes the commands that are orders, from whoever names us; other commands stay unsupported.

    Before ``begin`` they are sent away: nobody would answer them.
    """

    def __init__(self, link: Link, *, has_key: bool) -> None:
        self._link, self._authority = link, "signed" if has_key else "unsigned"
        self._waiting: list[Order] = []
        self._is_open = False
        # Not yet answered, as they came: a station's are answered in their order, also those that it waits for no more.
        self._asked: list[tuple[Source, asyncio.Future[Answer]]] = []
        self.wants_high_latency = False  # HIGH_LATENCY2 was asked for
        link.on_command = self._hear

    def begin(self) -> None:
        """Hear orders from now on."""
        self._is_open = True

    def take(self) -> list[Order]:
        """Return the orders since the last step, in the order in which they came."""
        orders, self._waiting = self._waiting, []
        return orders

    @property
    def unsigned(self) -> int:
        """How many commands to us were not signed with our key."""
        return self._link.dropped()[Drop.UNSIGNED_COMMAND]

    async def ask(self, wanted: Wanted, number: int, way: str = LOCAL) -> Answer:
        """Give an order that comes on another way than the link, and return its answer.

        ``number`` is the station's on that way: ``SOCKET`` or ``BROWSERS`` on board, from far away the order's own.
        """
        if not self._is_open:
            return Answer(result=Result.NOT_NOW, text="the companion is not under way yet")
        answer: asyncio.Future[Answer] = asyncio.get_running_loop().create_future()
        source = Source(kind=way, component=number)
        self._asked.append((source, answer))
        self._waiting.append(Order(wanted=wanted, t_s=now_s(), authority=way, source=source))
        return await answer

    def answered(self, action: Acknowledge) -> None:
        """Take an answer to where the order came from."""
        if action.way == MAVLINK:
            self._link.acknowledge(action.command, RESULTS[action.result], action.system, action.component)
            return
        source = Source(kind=action.way, system=action.system, component=action.component)
        asked = next((each for each in self._asked if each[0] == source), None)
        if asked is None:
            return
        self._asked.remove(asked)
        if not asked[1].done():
            asked[1].set_result(Answer(result=action.result, text=action.text))

    async def watch(self, autopilot: Autopilot, record: Callable[[dict[str, Any]], None]) -> None:
        """Say and record, once, that somebody without the key gives commands."""
        text = "somebody without this boat's key gives commands to the companion: they count for nothing"
        while True:
            if self.unsigned:
                autopilot.say(int(Severity.WARNING), text)
                record({"kind": "refusal", "what": "unsigned commands", "text": text})
                return
            await asyncio.sleep(LOOK_S)

    def _hear(self, message: Any) -> int:
        if message.command == CONTROL_COMMAND:
            if message.param1 not in {0.0, 1.0}:
                return RESULTS[Result.REFUSED]
            self.wants_high_latency = message.param1 == 1.0
            return RESULTS[Result.DONE]
        if message.command not in COMMANDS:
            return RESULTS[Result.UNKNOWN]
        if not self._is_open or len(self._waiting) >= MOST_WAITING:
            return RESULTS[Result.NOT_NOW]
        self._waiting.append(
            Order(
                wanted=wanted_of(message),
                t_s=now_s(),
                command=int(message.command),
                authority=self._authority,
                source=Source(kind=MAVLINK, system=message.get_srcSystem(), component=message.get_srcComponent()),
            )
        )
        return LATER


OnView = Callable[[View, tuple[Event, ...], Step], None]


class ViewBroadcast:
    """Makes the view of each step and hands it to the watchers; none of them is worth the voyage.

    ``epoch_s`` is the Unix time [s] of the loop's time 0; ``guard`` knows of what went wrong with it.
    """

    def __init__(self, voyage: Voyage, config: SkipperConfig, epoch_s: float, guard: Guard) -> None:
        self.epoch_s = epoch_s
        self._voyage, self._config = voyage, config
        self._made: ViewFold | None = None
        self._guard = guard
        self.watchers: list[OnView] = []
        self.is_kept = False  # made although nobody watches yet: who comes later wants to know of the plan in force

    @property
    def area(self) -> AreaView:
        """The area of the voyage, as it is drawn."""
        return self._fold.area

    @property
    def _fold(self) -> ViewFold:
        if self._made is None:
            self._made = ViewFold(self._voyage, self._config, epoch_s=self.epoch_s)
        return self._made

    def take(self, step: Step, status: CompanionStatus, figures: VoyageFigures) -> None:
        """Show one step."""
        if not (self.watchers or self.is_kept):
            return
        made = self._guard.call(Auxiliary.VIEW, lambda: self._fold.take(step, status, figures))
        if made is None:
            return
        view, events = made
        for watcher in tuple(self.watchers):
            self._guard.call(Auxiliary.VIEW, functools.partial(watcher, view, events, step))


# All browsers are one station, and all who open the socket are another: an order that is sent twice in haste is done
# once, and ``companion order`` opens a connection for each. Answers come in the order in which a station asked.
SOCKET, BROWSERS = 1, 2
PREVIEW_S = 0.5  # for a plan that is only looked at: the boat's own may have to wait for it so long
LAST_S = 5.0  # for one that is being made when the voyage ends


class LivePage:
    """Shows the steps of a voyage on ``live``."""

    def __init__(
        self, live: LiveSource, views: ViewBroadcast, fold: VoyageFold, planner: Planner, operator: OperatorCommands
    ) -> None:
        self._live, self._showing, self._fold, self._planner, self._crew = live, views, fold, planner, operator
        self._step: Step | None = None
        self._plan: asyncio.Task[Plan] | None = None

    def show(self, view: View, events: tuple[Event, ...], step: Step) -> None:
        """Show a step."""
        self._step = step
        self._live.show(view, events, self._showing.area)

    async def ask(self, wanted: Wanted) -> Answer:
        """Give an order."""
        return await self._crew.ask(wanted, BROWSERS, LOCAL)

    async def preview(self, wanted: Wanted) -> dict[str, Any]:
        """Return the plan that an order would lead to; ``error`` says why there is none."""
        step = self._step
        if step is None:
            return {"error": "nothing is known of the boat yet"}
        asked = self._fold.skipper.preview(step.state, step.snapshot, wanted)
        if isinstance(asked, str):
            return {"error": asked}
        if step.state.pending.plan is not None or (self._plan is not None and not self._plan.done()):
            return {"error": "a plan is being made: again in a moment"}
        # A task of its own: who hangs up must not end the planner's work, which would end the planner.
        self._plan = asyncio.create_task(
            self._planner.plan(
                asked.problem,
                budget_s=PREVIEW_S,
                seed=asked.seed,
                algorithm=asked.planner.algorithm,
                settings=asked.planner.settings,
            ),
            name="preview",
        )
        return {"order": wanted.words, **_in_figures(await asyncio.shield(self._plan))}

    async def end(self) -> None:
        """Wait for a plan that is being made."""
        if self._plan is not None and not self._plan.done():
            await asyncio.wait({self._plan}, timeout=LAST_S)
            self._plan.cancel()
            await asyncio.gather(self._plan, return_exceptions=True)


def _in_figures(plan: Plan) -> dict[str, Any]:
    if not plan.has_path:
        return {"error": f"no way there was found: {plan.reason}"}
    return {"error": None, "way_en_m": np.round(plan.waypoints_en, 1).tolist(), **plan_figures(plan)}


async def live_page(
    address: Address,
    fold: VoyageFold,
    planner: Planner,
    operator: OperatorCommands,
    views: ViewBroadcast,
    *,
    pace: float,
    charts: Sequence[TileChart],
    planned: PlannedPassage | None = None,
) -> None:
    """Serve the page of a voyage until cancelled. ``pace``: seconds of the loop for each second.

    Raises:
        JobError: it cannot be served there.
        Exception: a step could not be shown.
    """
    verbs = fold.permissions.local_orders
    live = LiveSource(
        name=fold.skipper.voyage.name,
        unix_s=views.epoch_s,
        area=views.area,
        planned=planned,
        permitted=tuple(verb.value for verb in Verb if permitted(verb, verbs)),
    )
    page = LivePage(live, views, fold, planner, operator)
    if address.token:
        live.ask, live.preview = page.ask, page.preview
    failed: asyncio.Future[None] = asyncio.get_running_loop().create_future()

    def show(view: View, events: tuple[Event, ...], step: Step) -> None:
        try:
            page.show(view, events, step)
        except Exception as error:  # a new page may do better
            if not failed.done():
                failed.set_exception(error)

    async with served(address, live, pace=pace, charts=charts):
        views.watchers.append(show)
        try:
            await failed
        finally:
            views.watchers.remove(show)
            await page.end()


MAX_LINE = 500  # bytes; an order is shorter
MOST = 8  # connections at a time: who has asked for nothing the longest makes room for the next
MOST_WATCH = 6  # of them, who are shown the voyage: there is room for an order
WATCH = b"watch"  # asks for the views
STUCK_S = 10.0  # who does not read for so long is hung up on
LOOK_S = 5.0  # whether it is still there
PROBE_S = 0.5  # for a program that listens there and takes nobody
EVENTS_KEPT = 100  # for who reads late; of the views there is only the newest


async def take_orders(path: Path, operator: OperatorCommands, views: ViewBroadcast) -> None:
    """Serve the socket until cancelled.

    Raises:
        InputError: it cannot be made, or was taken away.
    """
    async with orders_served(path, operator, views):
        while True:
            await asyncio.sleep(LOOK_S)
            if not path.is_socket():
                raise InputError("--socket", str(path), "was taken away", "leave it where it is")


@contextlib.asynccontextmanager
async def orders_served(path: Path, operator: OperatorCommands, views: ViewBroadcast) -> AsyncIterator[None]:
    """Take orders at ``path``, and tell who watches, while the body runs; afterwards it is gone.

    Raises:
        InputError: another program listens there, something else is there, or it cannot be made.
    """
    _clear(path)
    guests, watching = Guests(MOST), set[asyncio.StreamWriter]()

    async def talk(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        try:
            # gone, a line without end, or the service ends, of which asyncio would tell as of an error
            with contextlib.suppress(ConnectionError, ValueError, TimeoutError, asyncio.CancelledError):
                while guests.take(writer) and (line := await reader.readline()):
                    guests.is_answered(writer)
                    if line.strip() == WATCH:
                        if len(watching) < MOST_WATCH:
                            watching.add(writer)
                            await _show(writer, views)
                        break
                    answer = await _answer(line, operator)
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
        path.chmod(0o600)  # before anybody can connect: it does not listen yet
        server = await asyncio.start_unix_server(talk, sock=listening, limit=MAX_LINE)
    except OSError as error:
        listening.close()
        raise InputError("--socket", str(path), f"cannot be made ({reason(error)})", "name another place") from error
    try:
        async with server:
            yield
    finally:
        with contextlib.suppress(OSError):  # a disk that has become read-only meanwhile
            path.unlink(missing_ok=True)
        for writer in guests:
            writer.close()


async def _show(writer: asyncio.StreamWriter, views: ViewBroadcast) -> None:
    """Tell of each step until the other end is gone or does not read."""
    newest: list[View] = []
    events: deque[Event] = deque(maxlen=EVENTS_KEPT)
    has_news = asyncio.Event()

    def take(view: View, happened: tuple[Event, ...], _: Step) -> None:
        newest[:] = [view]
        events.extend(happened)
        has_news.set()

    views.watchers.append(take)
    try:
        while not writer.is_closing():
            await has_news.wait()
            has_news.clear()
            writer.write(msgspec.json.encode({"view": newest[0], "events": tuple(events)}) + b"\n")
            events.clear()
            async with asyncio.timeout(STUCK_S):
                await writer.drain()
    finally:
        views.watchers.remove(take)


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
                "--socket", str(path), f"cannot be opened ({reason(error)})", "name another place"
            ) from error
    raise InputError("--socket", str(path), "another program listens there", "name another place, or end that one")


async def _answer(line: bytes, operator: OperatorCommands) -> Answer:
    try:
        return await operator.ask(phrase(line.decode("utf-8").split()), SOCKET)
    except (InputError, UnicodeDecodeError) as error:
        return Answer(result=Result.UNKNOWN, text=str(error))
