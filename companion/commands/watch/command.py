"""The command: its options, the drawing on a terminal, the lines where there is none."""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import os
import signal
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from companion.errors import InputError
from companion.program.arguments import number, system_id

if TYPE_CHECKING:
    from companion.commands.watch.sources import Source
    from companion.orders import Wanted

EXIT_NO_LINK = 3
DRAW_EVERY_S = 0.5     # over ssh a redraw costs; what changes faster than this nobody reads


def add_parser(subparsers: Any, summary: str) -> None:
    """Add the command."""
    parser = subparsers.add_parser(
        "watch", help=summary,
        description="Watch a voyage on a terminal: state and why, alarms, wind with its history, course, plan, log. "
        "Ashore over another link of the autopilot, from what the companion says there; on board at the socket of "
        "companion run --socket PATH, with everything that it knows. Keys give the orders that the mission permits; "
        "what moves the boat is asked again first. Where the output is no terminal, it is a line now and then.",
        epilog="Keys: q end, ? help. Exit codes: 0 ended by a key or Ctrl-C, 3 nothing heard (without a terminal). "
        "Examples: companion watch --link /dev/ttyUSB0:57600; companion watch --socket boat.sock",
    )
    parser.add_argument("--link", metavar="LINK",
                        help="/dev/ttyUSB0:57600, udpin:HOST:PORT, udpout:HOST:PORT, tcp:HOST:PORT")
    parser.add_argument("--socket", type=Path, metavar="PATH", help="on board, in place of a link: as the companion's")
    parser.add_argument("--system", type=system_id, metavar="N",
                        help="the autopilot's MAVLink system id (default: the only one heard)")
    parser.add_argument("--signing-key", type=Path, metavar="FILE",
                        help="MAVLink signing key (mode 0600), for orders to a boat that has one")
    parser.add_argument("--timeout", type=number("s", above=0.0), default=10.0, metavar="S",
                        help="without a terminal: give up when nothing is heard for so long; for orders: until the "
                        "answer (default: 10)")
    parser.add_argument("--every", type=number("s", above=0.0), default=10.0, metavar="S",
                        help="without a terminal: between two lines (default: 10)")
    parser.add_argument("--units", choices=("ms", "kn"), default="kn", help="of speeds (default: kn)")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Run the command."""
    if (args.link is None) == (args.socket is None):
        raise InputError("--link", "", "is missing: there is nobody to watch" if args.link is None else
                         "and --socket are two ways to one boat",
                         "name the link of the radio, as --link /dev/ttyUSB0:57600, or on board --socket PATH")
    from companion.clock import run as run_loop

    return run_loop(_watch(args))


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
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())   # nobody reads any more
        return 0


def _source(args: argparse.Namespace) -> Source:
    from companion.commands.watch.sources import OnBoard, Radio

    if args.socket is not None:
        return OnBoard(args.socket)
    signing = None
    if args.signing_key is not None:
        from companion.mavlink.transports import SigningStore

        signing = SigningStore(args.signing_key, time.time())
    return Radio(args.link, system=args.system, timeout_s=args.timeout, signing=signing)


async def _draw(args: argparse.Namespace, source: Source, over: asyncio.Event) -> int:
    """Draw until somebody ends it."""
    from companion.clock import now_s
    from companion.terminal import Helm, History, Shown, Terminal, draw

    helm, history, said = Helm(knots=args.units == "kn"), History(), ""
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
            terminal.show(draw(Shown(
                link=source.name, view=view, history=history, helm=helm, unix_s=time.time(), orders=source.orders,
                said=said or source.trouble, waited_s=now_s() - began_s), columns, rows))
            is_due.clear()
            waits = {ended, asyncio.create_task(is_due.wait())}
            _, pending = await asyncio.wait(waits, timeout=DRAW_EVERY_S, return_when=asyncio.FIRST_COMPLETED)
            for wait in pending - {ended}:
                wait.cancel()
    if giving is not None:
        giving.cancel()
    return 0


async def _given(source: Source, wanted: Wanted, give_up_s: float) -> str:
    """Give an order and return its answer in words."""
    from companion.errors import LinkError

    try:
        answer = await source.give(wanted, give_up_s)
    except LinkError as error:
        return f"{wanted.words}: {error}"
    return f"{wanted.words}: {answer.result.value}: {answer.text}"


async def _tell(args: argparse.Namespace, source: Source, over: asyncio.Event) -> int:
    """Write a line now and then, and what happens."""
    from companion.clock import now_s
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
