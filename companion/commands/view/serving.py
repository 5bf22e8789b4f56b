"""Serving the page until somebody ends it: over a record, or over what a radio brings."""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import signal
import time
from typing import Any

STEP_S = 1.0


def stopping() -> asyncio.Event:
    """Return what is set by SIGINT or SIGTERM from now on."""
    stop = asyncio.Event()
    for end in (signal.SIGINT, signal.SIGTERM):
        with contextlib.suppress(NotImplementedError):
            asyncio.get_running_loop().add_signal_handler(end, stop.set)
    return stop


async def serve(address: Any, source: Any, charts: Any) -> int:
    """Serve until stopped."""
    from companion.page import served

    stop = stopping()
    async with served(address, source, charts=charts):
        print(f"{address.url}  (Ctrl-C ends it)", flush=True)
        await stop.wait()
    return 0


async def ashore(args: argparse.Namespace, charts: Any) -> int:
    """Show what a radio brings."""
    from companion.clock import now_s
    from companion.mavlink.link import Link
    from companion.mavlink.transports import open_link
    from companion.mavlink.trust import SHORE
    from companion.mavlink.wire import StatusReader, VehicleAssembler
    from companion.messages import VehicleState
    from companion.page import Address, Live
    from companion.view import HeardFold

    reader, assembler, fold = StatusReader(), VehicleAssembler(), HeardFold(args.link)
    vehicle: list[VehicleState] = []

    def take(t_s: float, message: Any) -> None:
        reader.take(t_s, message)
        vehicle[:] = [v for v in assembler.take(t_s, message) if isinstance(v, VehicleState)] or vehicle

    host, port = args.http
    epoch_s = time.time() - now_s()
    live = Live(name=args.link, kind="radio", unix_s=epoch_s)
    async with Link(
        open_link(args.link), identity=SHORE, target_system=args.system, streams=(), is_quiet=True,
    ) as link:
        link.subscribe(take)

        async def show() -> None:
            while True:
                t_s = now_s()
                view, events = fold.take(
                    t_s, reader.report(t_s), vehicle[-1] if vehicle else None, assembler.status, epoch_s + t_s)
                live.show(view, events, fold.area)
                await asyncio.sleep(STEP_S)

        showing = asyncio.create_task(show(), name="what the radio brings")
        serving = asyncio.create_task(
            serve(Address(host=host, port=port, names=tuple(args.http_name)), live, charts), name="page")
        try:
            await asyncio.wait({showing, serving}, return_when=asyncio.FIRST_COMPLETED)
            if showing.done():
                showing.result()
            return serving.result()
        finally:
            showing.cancel()
            serving.cancel()
            await asyncio.gather(showing, serving, return_exceptions=True)
