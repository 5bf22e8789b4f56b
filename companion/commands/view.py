"""``companion view``: a voyage in a browser, recorded or heard by radio, or packed into one file."""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import signal
import sys
import time
from pathlib import Path
from typing import Any

from companion.commands.output import Folding, force_option, write_files
from companion.errors import InputError
from companion.program.arguments import chart_option, host_names_option, http_address, out_file, system_id
from companion.words import counted

PORT = 8765


def add_parser(subparsers: Any, summary: str) -> None:
    """Add the command."""
    parser = subparsers.add_parser(
        "view",
        help=summary,
        description="Serve the page over a recorded voyage, with a timeline, or ashore over what a radio brings of a "
        "companion; or pack a recorded voyage into one HTML file that needs nothing else.",
        epilog="Examples: companion view voyages/20260714T101500Z-archipelago; companion view --link "
        "/dev/ttyUSB0:57600 --passage biscay.passage.json; companion view voyages/20260714T101500Z-archipelago "
        "--export voyage.html",
    )
    parser.add_argument(
        "voyage", type=Path, nargs="?", metavar="VOYAGE_DIR", help="the folder that `companion run` left"
    )
    parser.add_argument(
        "--beside",
        type=Path,
        metavar="VOYAGE_DIR",
        help="another voyage, shown beside it from the moment on that both set sail",
    )
    parser.add_argument(
        "--link",
        metavar="LINK",
        help="the shore end of a telemetry radio: /dev/ttyUSB0:57600, udpin:HOST:PORT, udpout:HOST:PORT, tcp:HOST:PORT",
    )
    parser.add_argument(
        "--system",
        type=system_id,
        metavar="N",
        help="with --link: the autopilot's MAVLink system id (default: the only one heard)",
    )
    parser.add_argument(
        "--passage",
        type=Path,
        metavar="FILE.passage.json",
        help="with --link: the passage that she was planned to sail, as `companion passage plan --out` wrote it; a "
        "radio brings none",
    )
    parser.add_argument(
        "--http",
        type=http_address,
        default=("127.0.0.1", PORT),
        metavar="[HOST:]PORT",
        help=f"where to serve it (default: 127.0.0.1:{PORT})",
    )
    host_names_option(parser)
    chart_option(parser)
    parser.add_argument("--export", type=out_file, metavar="FILE.html", help="write one file and serve nothing")
    force_option(parser)
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Run the command."""
    from companion.clock import run as run_loop
    from companion.page import Address, export, open_charts, read_passage

    if (args.voyage is None) == (args.link is None):
        raise InputError(
            "VOYAGE",
            "",
            "what to view is not said" if args.link is None else "a folder and a link are two things",
            "name a voyage's folder, or --link LINK",
        )
    if args.export is not None and args.chart:
        raise InputError("--chart", str(args.chart[0]), "is not packed into a file to send", "leave it out")
    charts = open_charts(args.chart)
    if args.link is not None:
        if args.beside is not None:
            raise InputError(
                "--beside", str(args.beside), "there is no recorded voyage to show it beside", "name two folders"
            )
        if args.export is not None:
            raise InputError(
                "--export",
                str(args.export),
                "what is heard by radio is no voyage yet",
                "export the folder that the companion leaves",
            )
        planned = None if args.passage is None else read_passage(args.passage)
        return run_loop(ashore(args, charts, planned))
    if args.passage is not None:
        raise InputError(
            "--passage", str(args.passage), "a recorded voyage has its own", "leave it out, or name --link LINK"
        )
    record = read_record(args.voyage)
    if args.beside is not None:
        record.beside = read_record(args.beside)
    if args.export is not None:
        data = export(record)
        write_files({str(args.export): data}, force=args.force)
        print(
            f"written: {args.export}, {len(data) / 1e6:.1f} MB, {counted(len(record.times), 'moment')} of the voyage; "
            "it opens in any browser"
        )
        return 0
    host, port = args.http
    return run_loop(serve(Address(host=host, port=port, names=tuple(args.http_name)), record, charts))


def read_record(folder: Path) -> Any:
    """Return the recorded voyage for the page. Raises InputError."""
    from companion.page import RecordedSource, read_planned
    from companion.telemetry.folder import mission_copy
    from companion.view import recorded_views

    with Folding() as told:
        recorded = recorded_views(folder)
        record = RecordedSource(recorded.name, recorded.area, is_whole=recorded.is_whole, count=recorded.count)
        for number, (view, events) in enumerate(recorded.moments, start=1):
            record.take(view, events)
            told(number, recorded.count)
        record.finish()
    if not record.times:
        raise InputError(str(folder), "track.csv", "has no step in it", "name a voyage that was sailed")
    if not recorded.is_whole:
        sys.stderr.write("companion view: note: without its telemetry log the voyage is shown by its track alone\n")
    try:
        record.planned = read_planned(mission_copy(folder))
    except InputError as error:
        record.passage_said = f"{error}; it is not shown"
        sys.stderr.write(f"companion view: note: {record.passage_said}\n")
    return record


STEP_S = 1.0
NOT_ON_THE_AIR = "No passage is shown: a radio brings none. `companion view --link` shows that of --passage FILE."


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


async def ashore(args: argparse.Namespace, charts: Any, planned: Any) -> int:
    """Show what a radio brings, with the passage that was planned ashore."""
    from companion.clock import now_s
    from companion.mavlink.link import Link
    from companion.mavlink.reception import SHORE
    from companion.mavlink.transports import open_link
    from companion.mavlink.wire import StatusReader, VehicleAssembler
    from companion.messages import VehicleState
    from companion.page import Address, LiveSource
    from companion.view import HeardFold

    reader, assembler, fold = StatusReader(), VehicleAssembler(), HeardFold(args.link)
    vehicle: list[VehicleState] = []

    def take(t_s: float, message: Any) -> None:
        reader.take(t_s, message)
        vehicle[:] = [v for v in assembler.take(t_s, message) if isinstance(v, VehicleState)] or vehicle

    host, port = args.http
    epoch_s = time.time() - now_s()
    live = LiveSource(
        name=args.link,
        kind="radio",
        unix_s=epoch_s,
        planned=planned,
        passage_said=NOT_ON_THE_AIR if planned is None else "",
    )
    async with Link(open_link(args.link), identity=SHORE, target_system=args.system, streams=(), is_quiet=True) as link:
        link.subscribe(take)

        async def show() -> None:
            while True:
                t_s = now_s()
                view, events = fold.take(
                    t_s, reader.report(t_s), vehicle[-1] if vehicle else None, assembler.status, epoch_s + t_s
                )
                live.show(view, events, fold.area)
                await asyncio.sleep(STEP_S)

        showing = asyncio.create_task(show(), name="what the radio brings")
        serving = asyncio.create_task(
            serve(Address(host=host, port=port, names=tuple(args.http_name)), live, charts), name="page"
        )
        try:
            await asyncio.wait({showing, serving}, return_when=asyncio.FIRST_COMPLETED)
            if showing.done():
                showing.result()
            return serving.result()
        finally:
            showing.cancel()
            serving.cancel()
            await asyncio.gather(showing, serving, return_exceptions=True)
