"""The command: from the files that are named to the last words of the voyage."""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import os
import secrets
import signal
import sys
import time
from collections.abc import Callable, Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO, cast

from companion.commands.run.given import charts_of, far_of, page_of, signing_of
from companion.program import INTERRUPTED
from companion.program.extras import missing
from companion.words import counted, file_name

if TYPE_CHECKING:
    from companion.commands.starting import Sailed
    from companion.geofence.mission import MissionOptions
    from companion.guard import Guard
    from companion.outputs import Wanted
    from companion.planner.nursery import Nursery
    from companion.planner.worker import PlannerWorker
    from companion.telemetry.console import Console
    from companion.telemetry.service import ServiceManager


NOT_THERE = 66   # exit code (EX_NOINPUT of sysexits.h): a card mounted a second late is no reason to give up


def run(args: argparse.Namespace) -> int:
    """Run the command."""
    from companion.errors import UnreadableError

    try:
        with _outliving_the_terminal():
            return _run(args)
    except UnreadableError as error:
        sys.stderr.write(f"companion run: {error}\n")
        return NOT_THERE


@contextlib.contextmanager
def _outliving_the_terminal() -> Iterator[None]:
    """Let no terminal end the voyage: not by hanging up (a dropped ssh), not by stopping who writes to it.

    What is ignored here is ignored by the planner's process too.
    """
    before = {number: signal.signal(number, signal.SIG_IGN) for number in (signal.SIGHUP, signal.SIGTTOU)}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _run(args: argparse.Namespace) -> int:
    from companion.addresses import parse_nmea, parse_signalk
    from companion.commands.starting import Sailed, settings_of
    from companion.geofence import load_mission
    from companion.geofence.mission import NO_NAME
    from companion.guard import Guard
    from companion.mavlink.transports import parse_link
    from companion.planner.nursery import Nursery
    from companion.planner.worker import answer_requests
    from companion.sailable import require_sailable
    from companion.telemetry.console import Console
    from companion.traffic.feeds import parse_feed

    for name in args.feed:
        parse_feed(name)
    for name in args.nmea:
        parse_nmea(name)
    for name in args.signalk:
        parse_signalk(name)
    parse_link(args.link)
    far_of(args, Guard())   # here for mistakes of the command line; what cannot be used is told with the voyage
    page_of(args, Guard())
    settings, sailed = settings_of(args.mission, is_drawn=args.from_autopilot, system=args.system), None
    if settings is None:
        named = require_sailable(load_mission(args.mission))
        sailed, name = Sailed(mission=named), file_name(named.name)
    else:
        name = file_name(settings.name or NO_NAME)
    import companion.app.sail  # noqa: F401 - so that a planner has it in common with this process

    # before there are threads, locks and sockets: those of the consoles are the first
    with contextlib.ExitStack() as stack:
        nursery = Nursery.begin(answer_requests)
        if nursery is not None:
            stack.callback(nursery.close)
        out, err = stack.enter_context(Console(sys.stdout)), stack.enter_context(Console(sys.stderr))
        # what is logged must not wait for a terminal either
        stack.enter_context(contextlib.redirect_stderr(cast("TextIO", err)))
        return _start(args, settings, sailed, name, nursery, out, err)


def _start(
    args: argparse.Namespace, settings: MissionOptions | None, sailed: Sailed | None, name: str,
    nursery: Nursery | None, out: Console, err: Console,
) -> int:
    """Sail what is named, and what is drawn one after the other; return the exit code."""
    from companion.commands.starting import alone, read_drawn
    from companion.telemetry.service import ServiceManager

    folder = _new_folder(args.out, name, 1)
    state_path = args.state or (folder.parent / f"{name}.state.json")
    # one for all voyages of this start: it tells the service manager that the program ends
    with alone(state_path, folder, err), ServiceManager(os.environ) as manager:
        number = 1
        while True:
            if settings is not None:
                sailed = read_drawn(args, settings, folder, state_path, signing_of(args.signing_key), manager, err)
            if sailed is None:
                return NOT_THERE
            code = _voyage(args, sailed, folder, state_path, manager, nursery, out, err)
            if code is not None:
                return code
            number += 1
            folder = _new_folder(args.out, name, number)


def _new_folder(named: Path | None, name: str, number: int) -> Path:
    """Return the folder of this start's voyage of that number: behind one that gives way to a drawing is another."""
    if named is not None:
        return named if number == 1 else named.with_name(f"{named.name}-{number}")
    return Path("voyages") / f"{datetime.now(UTC):%Y%m%dT%H%M%SZ}-{name}"


def _voyage(
    args: argparse.Namespace, sailed: Sailed, folder: Path, state_path: Path, manager: ServiceManager,
    nursery: Nursery | None, out: Console, err: Console,
) -> int | None:
    """Sail; return the exit code, None when the voyage has given way to what was drawn under way."""
    from companion.app.adoption import ADOPTED
    from companion.clock import run as run_loop
    from companion.commands.starting import asked
    from companion.compose import displays_of
    from companion.guard import Guard
    from companion.mavlink.transports import open_link
    from companion.outputs import wanted
    from companion.telemetry.folder import DEFAULT_BUDGET_BYTES, Shelf

    signing = signing_of(args.signing_key)
    shelf = None   # a folder that was named is not ours to tidy
    if args.out is None or args.keep_gb is not None:
        shelf = Shelf(folder=folder.parent, budget_bytes=int((args.keep_gb or DEFAULT_BUDGET_BYTES / 1e9) * 1e9))
    mission = sailed.mission.with_feeds(*args.feed).with_system(args.system).with_outputs(
        args.nmea, args.signalk, args.signalk_token)
    seed = mission.skipper.seed if args.seed is None else args.seed
    guard = Guard(lambda name, why: err.write(f"companion run: note: sailed without the {name}: {why}\n"), seed=seed,
                  pace=args.speedup)
    told = wanted(displays_of(mission), guard)
    for finding in mission.findings:
        err.write(f"companion run: {finding.line(str(mission.path))}\n")
    transport = open_link(args.link, seed=seed)
    again = args.again or sailed.is_new or asked(mission, state_path, err)
    if again is None:
        return 0

    def options() -> Any:
        from companion.app.options import SailOptions

        return SailOptions(
            seed=seed, dry_run=args.dry_run, epoch_s=time.time() - time.monotonic() * args.speedup,
            expansions=mission.skipper.expansions, state_path=state_path, limit_s=args.limit,
            wait_s=args.wait * args.speedup, signing=signing, budget_scale=1.0 / args.speedup,
            exit_on_arrival=args.exit_on_arrival, shelf=shelf, is_again=again, known=sailed.known,
            settings=sailed.settings, socket=args.socket, http=page_of(args, guard),
            charts=charts_of(args, guard), far=far_of(args, guard), command=" ".join(sys.argv),
            token=secrets.randbelow(0xFFFFFFFF) + 1,
        )

    summary = run_loop(
        _sail(mission, transport, folder, options, manager, nursery, out, told, guard), speedup=args.speedup)
    if summary is None:
        return INTERRUPTED
    if not summary["arrived_before"] and summary["end_reason"] != ADOPTED:   # the next voyage waits for no picture
        _report(folder, err)
    code, text = last_words(mission.name, summary)
    out.write(f"{text}\n{folder}\n")
    return None if summary["end_reason"] == ADOPTED else code


def last_words(name: str, summary: dict[str, Any]) -> tuple[int, str]:
    """Return the exit code and what is said of a voyage at its end."""
    from companion.app.adoption import ADOPTED

    if summary["arrived_before"]:
        # an order that gets no better by trying again
        return 2, f"not sailed: {name} had arrived before this start; --again sails it again"
    if summary["arrived"] and not summary["plans"] and not summary["uploads"]:
        text = (f"arrived, with nothing sailed anew: at this start she lay at the goal of {name} already, or the "
                "mission on board led her there; to sail it, begin away from its goal")
    else:
        end = "arrived" if summary["arrived"] else f"not arrived: {summary['end_reason']}, {summary['end_why']}"
        if summary["end_reason"] == ADOPTED:
            end = "given up for the mission that was drawn under way"
        text = f"{end}; {summary['time_s'] or 0.0:.0f} s, {counted(summary['tacks'], 'tack')}, "
        text += counted(summary["replans"], "replan")
    if not summary["arrived"] and summary["left_behind"] and summary["end_reason"] != ADOPTED:
        text += f"\n{summary['left_behind']}"
    if summary["records_dropped"]:
        missing = f"{summary['records_dropped']} records are missing"
        text += "\n" + "; ".join(part for part in (missing, summary["disk_trouble"]) if part)
    return 0 if summary["arrived"] else 1, text


async def _sail(
    mission: Any, transport: Any, folder: Path, options: Callable[[], Any], manager: ServiceManager,
    nursery: Nursery | None, out: Console, told: Wanted, guard: Guard,
) -> dict[str, Any] | None:
    """Sail; return the summary, None when it was ended before it began."""
    from companion.planner.worker import PlannerWorker

    stop = asyncio.Event()
    loop = asyncio.get_running_loop()
    for end in (signal.SIGINT, signal.SIGTERM):
        with contextlib.suppress(NotImplementedError):
            loop.add_signal_handler(end, stop.set)
    async with PlannerWorker(algorithm=mission.skipper.planner, nursery=nursery) as planner:
        # The child loads its kernels while this process imports the rest.
        from companion.app.sail import sail
        from companion.guard import Auxiliary
        from companion.outputs import Outputs
        from companion.telemetry.far import unix_of_boat
        from companion.telemetry.progress import ProgressLine

        if not await _is_ready(planner, stop, out, manager):
            return None
        chosen = options()

        with ProgressLine(out, chosen.epoch_s) as progress:
            async with Outputs(told, mission.frame(), progress.note, seed=chosen.seed, guard=guard) as outputs:
                def show(status: Any, step: Any) -> None:
                    manager.alive(f"{step.state.phase.value}: {step.state.why}")
                    guard.call(Auxiliary.CONSOLE, lambda: progress.show(status, step))

                def tell(view: Any, _: Any, step: Any) -> None:
                    outputs.tell(view, unix_of_boat(step.snapshot, step.snapshot.t_s), step.voyage.frame)

                return await sail(
                    mission, transport, planner, folder, chosen, on_status=show, stop=stop, on_refusal=progress.note,
                    on_view=tell if outputs.are_any else None, guard=guard)


async def _is_ready(planner: PlannerWorker, stop: asyncio.Event, out: Console, manager: ServiceManager) -> bool:
    """Wait for the planner's kernels and say how far they are; return False when ``stop`` comes first."""
    from companion.errors import JobError
    from companion.telemetry.preparing import Preparing

    with Preparing(out) as preparing:
        def say(text: str) -> None:
            preparing.say(text)
            manager.starting(text)

        waits = [asyncio.ensure_future(planner.ready(say)), asyncio.ensure_future(stop.wait())]
        await asyncio.wait(waits, return_when=asyncio.FIRST_COMPLETED)
        for wait in waits:
            wait.cancel()
        ready, _ = await asyncio.gather(*waits, return_exceptions=True)
    if isinstance(ready, TimeoutError | EOFError | OSError):
        raise JobError(f"the planner's process did not start: {ready!r}")
    return not stop.is_set()


def _report(folder: Path, err: Console) -> None:
    """Draw the voyage; a picture that fails must not hide how the voyage ended."""
    try:
        from companion.plots.voyage import plot_voyage
        from companion.telemetry.folder import PICTURE, read_voyage

        plot_voyage(read_voyage(folder), folder / PICTURE)
    except Exception as error:
        refusal = missing(error) if isinstance(error, ModuleNotFoundError) else None
        err.write(f"companion run: the picture could not be drawn: {refusal or repr(error)}\n")
