"""``companion run``: sail a mission, read what is drawn on the autopilot, and say how the voyage ended."""

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
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO, cast

from companion.errors import CompanionError, InputError
from companion.guard import Auxiliary
from companion.program.arguments import (
    autopilot_options,
    chart_option,
    host_names_option,
    http_address,
    number,
    out_folder,
    whole,
)
from companion.program.commands import missing
from companion.words import counted, file_name, goals_reached

if TYPE_CHECKING:
    from companion.addresses import Displays
    from companion.app.from_autopilot import DrawnSettings
    from companion.geofence import Mission
    from companion.geofence.mission import MissionOptions
    from companion.guard import Guard
    from companion.planner.fork_server import ForkServer
    from companion.planner.worker import PlannerWorker
    from companion.telemetry.console import Console
    from companion.telemetry.systemd import ServiceManager


def add_parser(subparsers: Any, summary: str) -> None:
    """Add the command."""
    parser = subparsers.add_parser(
        "run",
        help=summary,
        description="Sail a mission: estimate the wind, plan, upload, and plan again at each waypoint. Nothing is "
        "sent to the boat that the mission's [operator] table does not allow.",
        epilog="Exit codes: 0 arrived, 1 not, 2 bad usage or input, which no retry mends, 66 a file that is not "
        "there or cannot be read, a drawing that is not there or cannot be sailed, 130 ended "
        "by Ctrl-C before the voyage began. Examples: companion run "
        "missions/archipelago.toml --link udpin:127.0.0.1:14551; companion run --from-autopilot boat.toml --link "
        "udpin:127.0.0.1:14551",
    )
    _add_mission(parser)
    _add_shore(parser)
    _add_limits(parser)
    _add_instruments(parser)
    parser.add_argument("--signing-key", type=Path, metavar="FILE", help="MAVLink signing key (32 bytes, mode 0600)")
    parser.add_argument(
        "--speedup",
        type=number(above=0.0, at_most=1000.0),
        default=1.0,
        metavar="N",
        help="the autopilot is a simulator that runs N times as fast as time (default: 1)",
    )
    parser.set_defaults(run=run)


def _add_mission(parser: argparse.ArgumentParser) -> None:
    """Add the options of what is sailed, and on which autopilot."""
    parser.add_argument(
        "mission",
        type=Path,
        nargs="?",
        metavar="MISSION.toml",
        help="the mission file; beside a drawing its boat, margins, wind and permissions",
    )
    parser.add_argument(
        "--from-autopilot",
        action="store_true",
        help="sail what was drawn in a ground station and uploaded: waypoints are goals, the fence is "
        "the area, rally points are refuges (in the file: from_autopilot = true)",
    )
    autopilot_options(parser, required=True)
    parser.add_argument(
        "--out", type=Path, metavar="DIR", help="the voyage folder (default: voyages/<UTC time>-<mission>)"
    )
    parser.add_argument("--dry-run", action="store_true", help="look, plan and speak; touch nothing")
    parser.add_argument(
        "--permit",
        action="append",
        choices=("set_auto", "arm"),
        default=[],
        metavar="KEY",
        help="permit this voyage what [operator] does not: set_auto or arm; may be given twice "
        "(sitl run does, for its simulated boat)",
    )
    parser.add_argument(
        "--seed", type=whole(), default=None, help="random seed of the planner (default: the mission's)"
    )
    parser.add_argument(
        "--state",
        type=Path,
        metavar="FILE",
        help="where the state for a restart is kept (default: <mission>.state.json beside the voyage's folder, "
        "so in voyages/ without --out); its folder is one boat's, and locked",
    )


def _add_shore(parser: argparse.ArgumentParser) -> None:
    """Add the options of who may look on and give orders."""
    parser.add_argument(
        "--socket",
        type=Path,
        metavar="PATH",
        help="take orders from on board at this Unix socket: "
        "companion order VERB --socket PATH, as [operator] local_orders permits",
    )
    parser.add_argument(
        "--http",
        type=http_address,
        metavar="[HOST:]PORT",
        help="serve the live page here; without HOST to this machine alone (127.0.0.1). It shows; it "
        "takes orders only with --http-token",
    )
    parser.add_argument(
        "--http-token",
        type=Path,
        metavar="FILE",
        help="let who has the token in this file (made, mode 0600, where there is none) give orders "
        "from the page, as [operator] local_orders permits",
    )
    host_names_option(parser)
    chart_option(parser)
    parser.add_argument(
        "--far",
        type=out_folder,
        metavar="DIR",
        help="the folder shared with the program of a "
        "satellite modem: the newest status in DIR/out, orders in DIR/in, as [operator] far_orders "
        "permits; `companion far` is its end ashore",
    )
    parser.add_argument(
        "--far-key",
        type=Path,
        metavar="FILE",
        help="the key of that link, made by `companion key new` (default: the signing key)",
    )
    parser.add_argument(
        "--far-every",
        type=number("min", at_least=1.0, at_most=1440.0),
        default=10.0,
        metavar="MIN",
        help="a new status this often (default: 10), and after each order",
    )


def _add_limits(parser: argparse.ArgumentParser) -> None:
    """Add the options of how long she sails, and what is kept of it."""
    parser.add_argument(
        "--again",
        action="store_true",
        help="sail the mission again when its state says that it has arrived (asked at a terminal)",
    )
    parser.add_argument(
        "--keep-gb",
        type=number("GB", above=0.0),
        metavar="GB",
        help="what all voyages in the folder may take together; the oldest finished ones give way, "
        "telemetry logs first, decisions last (default: 5, and without end where --out is given)",
    )
    parser.add_argument(
        "--wait",
        type=number("s", above=0.0),
        default=30.0,
        metavar="S",
        help="give up when no autopilot is heard for this long (default: 30)",
    )
    parser.add_argument("--limit", type=number("s", above=0.0), metavar="S", help="end after this many seconds")
    parser.add_argument(
        "--exit-on-arrival",
        action="store_true",
        help="end when the voyage is over; by default the boat is watched in its loiter until SIGINT or SIGTERM",
    )


def _add_instruments(parser: argparse.ArgumentParser) -> None:
    """Add the options of what is heard of other vessels and the depth, and which displays are told."""
    parser.add_argument(
        "--feed",
        action="append",
        default=[],
        metavar="FEED",
        help="hear other vessels here too, besides the mission's [traffic] feeds: udpin:HOST:PORT, "
        "tcp:HOST:PORT, /dev/NAME:BAUD; may be given more than once",
    )
    parser.add_argument(
        "--sounder",
        metavar="FEED",
        help="hear the depth from here, in place of the mission's [sounder] feed: a sounder that speaks NMEA 0183, "
        "named as --feed",
    )
    parser.add_argument(
        "--nmea",
        action="append",
        default=[],
        metavar="OUT",
        help="tell OpenCPN and its like in NMEA 0183, besides the mission's [output] nmea: "
        "udp:HOST:PORT, or tcp:[HOST:]PORT to be a server; may be given more than once",
    )
    parser.add_argument(
        "--signalk",
        action="append",
        default=[],
        metavar="SERVER",
        help="tell a Signal K server, besides the mission's [output] signalk: ws://HOST:3000 or "
        "tcp:HOST:8375; may be given more than once",
    )
    parser.add_argument(
        "--signalk-token", type=Path, metavar="FILE", help="the token that the Signal K server asks for (mode 0600)"
    )


NOT_THERE = 66  # exit code (EX_NOINPUT of sysexits.h): a card mounted a second late is no reason to give up


def run(args: argparse.Namespace) -> int:
    """Run the command."""
    from companion.errors import UnreadableError

    try:
        with _ignoring_terminal_signals():
            return _run(args)
    except UnreadableError as error:
        sys.stderr.write(f"companion run: {error}\n")
        return NOT_THERE


@contextlib.contextmanager
def _ignoring_terminal_signals() -> Iterator[None]:
    """Let no terminal end the voyage: not by hanging up (a dropped ssh), not by stopping who writes to it.

    What is ignored here is ignored by the planner's process too.
    """
    before = {number: signal.signal(number, signal.SIG_IGN) for number in (signal.SIGHUP, signal.SIGTTOU)}
    before |= {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _run(args: argparse.Namespace) -> int:
    from companion.planner.fork_server import ForkServer
    from companion.planner.worker import answer_requests

    # Before there are threads, locks and sockets, and before anything is loaded that planners have no use for: a page
    # that this process writes to after the fork is there twice, and what is loaded by then is written to all the time.
    with contextlib.ExitStack() as stack:
        fork_server = ForkServer.begin(answer_requests)
        if fork_server is not None:
            stack.callback(fork_server.close)
        from companion.mavlink.wire import give_back_words

        give_back_words()  # now: what is loaded next takes the room
        return _checked(args, fork_server)


def _checked(args: argparse.Namespace, fork_server: ForkServer | None) -> int:
    """Read what the command line names, and sail it; return the exit code."""
    from companion.addresses import parse_nmea, parse_signalk
    from companion.geofence import load_mission
    from companion.geofence.mission import NO_NAME
    from companion.guard import Guard
    from companion.mavlink.transports import parse_link
    from companion.mission_check import require_sailable
    from companion.telemetry.console import Console
    from companion.traffic.feeds import parse_feed

    for name in args.feed:
        parse_feed(name, source="--feed")
    if args.sounder is not None:
        parse_feed(args.sounder, source="--sounder")
    for name in args.nmea:
        parse_nmea(name)
    for name in args.signalk:
        parse_signalk(name)
    parse_link(args.link)
    far_of(args, Guard())  # here for mistakes of the command line; what cannot be used is told with the voyage
    page_of(args, Guard())
    settings, sailed = settings_of(args.mission, is_drawn=args.from_autopilot, system=args.system), None
    if settings is None:
        named = require_sailable(load_mission(args.mission))
        sailed, name = MissionToSail(mission=named), file_name(named.name)
    else:
        name = file_name(settings.name or NO_NAME)
    with contextlib.ExitStack() as stack:
        out, err = stack.enter_context(Console(sys.stdout)), stack.enter_context(Console(sys.stderr))
        # what is logged must not wait for a terminal either
        stack.enter_context(contextlib.redirect_stderr(cast("TextIO", err)))
        return _start(args, settings, sailed, name, fork_server, out, err)


def _start(
    args: argparse.Namespace,
    settings: MissionOptions | None,
    sailed: MissionToSail | None,
    name: str,
    fork_server: ForkServer | None,
    out: Console,
    err: Console,
) -> int:
    """Sail what is named, and what is drawn one after the other; return the exit code."""
    from companion.telemetry.systemd import ServiceManager

    folder = _new_folder(args.out, name, 1)
    state_path = args.state or (folder.parent / f"{name}.state.json")
    # one for all voyages of this start: it tells the service manager that the program ends
    with hold_state_folder(state_path, folder, err), ServiceManager(os.environ) as manager:
        number = 1
        while True:
            if settings is not None:
                sailed = read_drawn(args, settings, folder, state_path, signing_of(args.signing_key), manager, err)
            if sailed is None:
                return NOT_THERE
            code = _voyage(args, sailed, folder, state_path, manager, fork_server, out, err)
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
    args: argparse.Namespace,
    sailed: MissionToSail,
    folder: Path,
    state_path: Path,
    manager: ServiceManager,
    fork_server: ForkServer | None,
    out: Console,
    err: Console,
) -> int | None:
    """Sail; return the exit code, None when the voyage has given way to what was drawn under way."""
    from companion.app.from_autopilot import ADOPTED
    from companion.clock import run as run_loop
    from companion.compose import displays_of
    from companion.guard import Guard
    from companion.mavlink.transports import open_link
    from companion.mission_check import charted_findings
    from companion.outputs import checked_displays
    from companion.telemetry.folder import DEFAULT_BUDGET_BYTES, VoyageArchive

    signing = signing_of(args.signing_key)
    archive = None  # a folder that was named is not ours to tidy
    if args.out is None or args.keep_gb is not None:
        budget_bytes = int((args.keep_gb or DEFAULT_BUDGET_BYTES / 1e9) * 1e9)
        archive = VoyageArchive(folder=folder.parent, budget_bytes=budget_bytes)
    mission = (
        sailed.mission.with_feeds(*args.feed)
        .with_sounder(args.sounder)
        .with_system(args.system)
        .with_outputs(args.nmea, args.signalk, args.signalk_token)
        .permitting(*args.permit)
    )
    seed = mission.skipper.seed if args.seed is None else args.seed
    guard = Guard(
        lambda name, why: err.write(f"companion run: note: sailed without the {name}: {why}\n"),
        seed=seed,
        pace=args.speedup,
    )
    told = checked_displays(displays_of(mission), guard)
    for finding in (*mission.findings, *charted_findings(mission, time.time())):
        err.write(f"companion run: {finding.line(str(mission.path))}\n")
    transport = open_link(args.link, seed=seed)
    again = args.again or sailed.is_new or confirm_again(mission, state_path, err)
    if again is None:
        return 0

    def options() -> Any:
        from companion.app.options import SailOptions

        return SailOptions(
            seed=seed,
            dry_run=args.dry_run,
            epoch_s=epoch_of(folder, args.speedup, time.time(), time.monotonic()),
            clock_epoch_s=time.time() - time.monotonic(),
            expansions=mission.skipper.expansions,
            state_path=state_path,
            limit_s=args.limit,
            wait_s=args.wait * args.speedup,
            signing=signing,
            budget_scale=1.0 / args.speedup,
            exit_on_arrival=args.exit_on_arrival,
            archive=archive,
            is_again=again,
            known=sailed.known,
            settings=sailed.settings,
            socket=args.socket,
            http=page_of(args, guard),
            charts=charts_of(args, guard),
            planned=planned_of(args, mission.path, guard),
            far=far_of(args, guard),
            command=" ".join(sys.argv),
            token=secrets.randbelow(0xFFFFFFFF) + 1,
        )

    ending = SignalEnding()
    summary = run_loop(
        _sail(mission, transport, folder, options, manager, fork_server, out, told, guard, ending), speedup=args.speedup
    )
    code, text = outcome_of(mission.name, summary)
    out.write(f"{text}\n{folder}\n")  # before the picture: whatever ends its drawing, how the voyage ended is told
    if summary["end_reason"] == ADOPTED:  # the next voyage waits for no picture
        ending.at_once()
        return None
    if summary["time_s"] is not None and not summary["arrived_before"]:  # nobody was heard: nothing to draw
        try:
            ending.at_once()
            if fork_server is not None:
                fork_server.close()  # there is nothing more to plan, and to draw takes more memory than to sail
            _report(folder, err)
        except KeyboardInterrupt:
            err.write("companion run: the picture is not drawn; companion report draws it\n")
    return code


def _how_arrived(goals: int, given_up: int) -> str:
    """Return behind "arrived" what was not reached; empty: nothing."""
    return f" ({goals_reached(goals, given_up)})" if given_up else ""


def outcome_of(name: str, summary: dict[str, Any]) -> tuple[int, str]:
    """Return the exit code and what is said of a voyage at its end."""
    from companion.app.from_autopilot import ADOPTED

    if summary["arrived_before"]:
        # an order that gets no better by trying again
        how = _how_arrived(summary["goals"], summary["goals_given_up"])
        return 2, f"not sailed: {name} had arrived before this start{how}; --again sails it again"
    if summary["arrived"] and not summary["plans"] and not summary["uploads"]:
        text = (
            f"arrived, with nothing sailed anew: at this start she lay at the goal of {name} already, or the "
            "mission on board led her there; to sail it, begin away from its goal"
        )
    else:
        end = "arrived" if summary["arrived"] else f"not arrived: {summary['end_reason']}, {summary['end_why']}"
        if summary["end_reason"] == ADOPTED:
            end = "given up for the mission that was drawn under way"
        text = f"{end}; {summary['time_s'] or 0.0:.0f} s under way by her own record, "
        text += f"{counted(summary['tacks'], 'tack')}, " + counted(summary["replans"], "replan")
    if not summary["arrived"] and summary["left_behind"] and summary["end_reason"] != ADOPTED:
        text += f"\n{summary['left_behind']}"
    if summary["records_dropped"]:
        missing = f"{counted(summary['records_dropped'], 'record')} missing"
        text += "\n" + "; ".join(part for part in (missing, summary["disk_trouble"]) if part)
    return 0 if summary["arrived"] else 1, text


async def _sail(
    mission: Any,
    transport: Any,
    folder: Path,
    options: Callable[[], Any],
    manager: ServiceManager,
    fork_server: ForkServer | None,
    out: Console,
    told: Displays,
    guard: Guard,
    ending: SignalEnding,
) -> dict[str, Any]:
    """Sail; return the summary. Raises KeyboardInterrupt: it was ended before it began, or a second time."""
    from companion.kernels.memory import settle
    from companion.planner.worker import PlannerWorker

    async with PlannerWorker(algorithm=mission.skipper.planner, fork_server=fork_server) as planner:
        # The child loads its kernels while this process imports the rest.
        from companion.app.sail import sail
        from companion.guard import Auxiliary
        from companion.outputs import Outputs
        from companion.telemetry.console import ProgressLine

        await _get_ready(planner, out, manager)
        settle()
        chosen = options()

        with ProgressLine(out, chosen.epoch_s) as progress:
            async with Outputs(told, mission.frame(), progress.note, seed=chosen.seed, guard=guard) as outputs:

                def show(status: Any, step: Any) -> None:
                    manager.alive(f"{step.state.phase.value}: {step.state.why}")
                    guard.call(Auxiliary.CONSOLE, lambda: progress.show(status, step))

                def tell(view: Any, _: Any, step: Any) -> None:
                    outputs.tell(view, step.snapshot.unix_s(step.snapshot.t_s), step.voyage.frame)

                return await sail(
                    mission,
                    transport,
                    planner,
                    folder,
                    chosen,
                    on_status=show,
                    stop=ending.asked(),
                    on_refusal=progress.note,
                    on_view=tell if outputs.are_any else None,
                    guard=guard,
                )


async def _get_ready(planner: PlannerWorker, out: Console, manager: ServiceManager) -> None:
    """Wait for the planner's kernels and say how far they are. Raises JobError: its process did not start."""
    from companion.errors import JobError
    from companion.telemetry.console import CompileProgress

    with CompileProgress(out) as preparing:

        def say(text: str) -> None:
            preparing.say(text)
            manager.starting(text)

        try:
            await planner.ready(say)
        except (TimeoutError, EOFError, OSError) as error:
            raise JobError(f"the planner's process did not start: {error!r}") from error


def epoch_of(folder: Path, speedup: float, unix_s: float, monotonic_s: float) -> float:
    """Return the Unix time [s] of the loop's time 0, by the clocks as they stand.

    A hurried loop gains on the clock: begun again in the same folder it goes on by the folder's own epoch, or the
    stamps of its frames would begin before those that are there.
    """
    epoch_s = unix_s - monotonic_s * speedup
    if speedup == 1.0:
        return epoch_s
    from companion.telemetry.folder import VOYAGE, read_description

    if not (folder / VOYAGE).is_file():
        return epoch_s
    with contextlib.suppress(InputError, KeyError, TypeError, ValueError):
        run_table = read_description(folder)["run"]
        known_s = float(run_table["epoch_s"])
        # one from before the computer was started again is of another count of seconds
        if known_s + monotonic_s * speedup >= datetime.fromisoformat(run_table["started_utc"]).timestamp():
            return known_s
    return epoch_s


class SignalEnding:
    """How SIGINT and SIGTERM end a voyage: before it is begun, and when they come again, at once.

    Handlers of the event loop would wait for its turn, which comes late while libraries are loaded. From the end of the
    loop they wait for ``at_once``: how the voyage ended is told first.
    """

    def __init__(self) -> None:
        self._loop: asyncio.AbstractEventLoop | None = None
        self._stop: asyncio.Event | None = None
        self._came_late = False
        for end in (signal.SIGINT, signal.SIGTERM):
            signal.signal(end, self._on_signal)

    def asked(self) -> asyncio.Event:
        """Return what is set by the first signal from now on: a voyage is brought to its end and told of."""
        self._loop, self._stop = asyncio.get_running_loop(), asyncio.Event()
        return self._stop

    def at_once(self) -> None:
        """Let what comes from now on raise KeyboardInterrupt. Raises it: one has come since the end of the loop."""
        self._loop = self._stop = None
        if self._came_late:
            raise KeyboardInterrupt

    def _on_signal(self, number: int, frame: object) -> None:
        del number, frame
        if self._loop is not None and self._loop.is_closed():
            self._came_late = True
            return
        if self._loop is None or self._stop is None:
            raise KeyboardInterrupt
        stop, self._stop = self._stop, None
        self._loop.call_soon_threadsafe(stop.set)


def _report(folder: Path, err: Console) -> None:
    """Draw the voyage; a picture that fails must not hide how the voyage ended."""
    try:
        from companion.plots.voyage import plot_voyage
        from companion.telemetry.folder import PICTURE, read_voyage

        plot_voyage(read_voyage(folder), folder / PICTURE)
    except Exception as error:
        refusal: Exception | None = error if isinstance(error, CompanionError) else None
        if isinstance(error, ModuleNotFoundError):
            refusal = missing(error)
        err.write(f"companion run: the picture could not be drawn: {refusal or repr(error)}\n")


def signing_of(path: Path | None) -> Any:
    """Return the key that frames are signed with, None: they are not."""
    if path is None:
        return None
    from companion.mavlink.signing import SigningStore

    return SigningStore(path, time.time())


def page_of(args: argparse.Namespace, guard: Guard) -> Any:
    """Return where the page is served; with a token that cannot be used it takes no orders, which ``guard`` knows.

    Raises InputError: what is named has no page to be used on.
    """
    if args.http is None:
        named = (
            "--http-token"
            if args.http_token is not None
            else "--http-name"
            if args.http_name
            else ("--chart" if args.chart else "")
        )
        if named:
            raise InputError(named, "", "there is no page to use it on", "say where it is served: --http PORT")
        return None
    from companion.page import Address, read_token

    host, port = args.http
    token = ""
    if args.http_token is not None:
        try:
            token = read_token(args.http_token)
        except InputError as error:
            guard.lost(Auxiliary.ORDERS_BY_PAGE, f"{error}", for_good=True)
    return Address(host=host, port=port, names=tuple(args.http_name), token=token)


def charts_of(args: argparse.Namespace, guard: Guard) -> Any:
    """Return the charts; a file that is no chart, or is gone, is left out, and the boat is sailed all the same."""
    from companion.page import open_charts

    charts: list[Any] = []
    said: list[str] = []
    for path in args.chart:
        try:
            charts += open_charts([path])
        except InputError as error:
            said.append(f"{error}; she is sailed without this chart")
    if said:
        guard.lost(Auxiliary.CHARTS, "; ".join(said), for_good=True)
    return tuple(charts)


def planned_of(args: argparse.Namespace, mission: Path | None, guard: Guard) -> Any:
    """Return the passage that the mission was planned as; a file that cannot be read is said, and she is sailed."""
    from companion.page import read_planned

    if args.http is None or mission is None:
        return None
    try:
        return read_planned(mission)
    except InputError as error:
        guard.lost(Auxiliary.PASSAGE, f"{error}; she is sailed without showing it", for_good=True)
    return None


def far_of(args: argparse.Namespace, guard: Guard) -> Any:
    """Return the folder of the satellite link with its key, None where it is not wanted or its key cannot be used.

    Raises InputError: no key is named, or no folder.
    """
    if args.far is None:
        if args.far_key is not None:
            raise InputError(
                "--far-key", str(args.far_key), "there is no link to use it on", "name its folder: --far DIR"
            )
        return None
    from companion.app.options import SatelliteLink
    from companion.mavlink.signing import read_key

    key_file = args.far_key or args.signing_key
    if key_file is None:
        raise InputError(
            "--far", str(args.far), "has no key", "make one with `companion key new far.key` and name it with --far-key"
        )
    try:
        return SatelliteLink(folder=args.far, key=read_key(key_file), every_s=60.0 * args.far_every)
    except InputError as error:
        guard.lost(Auxiliary.FAR, f"{error}", for_good=True)
        return None


@contextlib.contextmanager
def hold_state_folder(state_path: Path, folder: Path, err: Console) -> Iterator[None]:
    """Hold the lock on the folder of the state: it is one boat's, and one companion commands a boat.

    A state within the voyage's own folder is guarded by whoever records there.
    """
    from companion.disk import Disk, FolderLock, is_mistake, reason
    from companion.errors import InputError, JobError

    if state_path.is_dir():
        raise InputError("--state", str(state_path), "is a folder", "name a file")
    if state_path.parent.resolve() == folder.resolve():
        yield
        return
    lock = FolderLock(state_path.parent)
    try:
        Disk().make_folder(state_path.parent)
        is_alone = lock.take()
    except OSError as error:
        if is_mistake(error):
            raise InputError(
                str(state_path.parent),
                "",
                f"cannot hold the state: {reason(error)}",
                "name another place with --state or --out",
            ) from error
        err.write(f"companion run: {state_path.parent} cannot be locked: {reason(error)}; sailing all the same\n")
        is_alone = True
    if not is_alone:
        raise JobError(
            f"{state_path.parent}: another companion is sailing with the state kept here, and two must not "
            "command one boat; end that one, or keep another boat's state elsewhere with --state"
        )
    try:
        yield
    finally:
        lock.release()


def confirm_again(mission: Any, state_path: Path, err: Console) -> bool | None:
    """Return whether a mission that has arrived is sailed again: what a terminal answers; None: it is not wanted."""
    if not (state_path.is_file() and sys.stdin is not None and sys.stdin.isatty() and err.isatty()):
        return False
    from companion.compose import config_of, voyage_of
    from companion.skipper import Skipper
    from companion.telemetry.state_file import read_state

    try:
        saved = read_state(state_path)
    except (OSError, ValueError):
        return False  # the voyage says what is wrong with it
    voyage = voyage_of(mission)
    if not Skipper(voyage=voyage, config=config_of(mission)).has_arrived(saved):
        return False
    day = datetime.fromtimestamp(state_path.stat().st_mtime, UTC)
    how = _how_arrived(len(voyage.legs), saved.skipped)
    err.write(f"{mission.name} has arrived already{how} ({day:%d %b %Y %H:%M} UTC). Sail it again? [y/N] ")
    if sys.stdin.readline().strip().lower() in {"y", "yes"}:
        return True
    return None


NOTHING_PERMITTED = """without a mission file nothing is permitted, nothing will be sent to the boat; write boat.toml:
  from_autopilot = true
  [operator]
  set_auto = true    # upload the plan and set AUTO; arm = true: arm her, too
and start: companion run boat.toml --link LINK"""

BEAT_S = 5.0  # of the words to the service manager, whose watchdog waits for 30 s


@dataclass(frozen=True, slots=True, kw_only=True)
class MissionToSail:
    """A mission to sail, what on the autopilot may give way to it, and whether it begins anew."""

    mission: Mission
    known: tuple[str, ...] = ()
    is_new: bool = False
    settings: DrawnSettings | None = None  # where it is drawn


def settings_of(path: Path | None, *, is_drawn: bool, system: int | None) -> MissionOptions | None:
    """Return the settings of a mission that is drawn on the autopilot, None where the goals are the file's own."""
    import msgspec

    from companion.geofence.mission import MissionOptions, load_settings, read_options

    settings: MissionOptions | None = None
    if path is None:
        if not is_drawn:
            raise InputError(
                "companion run",
                "",
                "there is no mission",
                "name a mission file, or sail what is drawn on the autopilot: --from-autopilot",
            )
        settings = MissionOptions(from_autopilot=True)
    elif is_drawn or read_options(path).from_autopilot:
        settings = load_settings(path)
    if settings is None or system is None:
        return settings
    return msgspec.structs.replace(settings, autopilot=msgspec.structs.replace(settings.autopilot, system=system))


def read_drawn(
    args: argparse.Namespace,
    settings: MissionOptions,
    folder: Path,
    state_path: Path,
    signing: Any,
    manager: ServiceManager,
    err: Console,
) -> MissionToSail | None:
    """Return the mission that is drawn on the autopilot, kept on the disk; None when it was refused, line by line.

    Raises:
        InputError: the settings cannot be sailed with, or there is no drawing.
        LinkError: the autopilot's lists cannot be read.
    """
    from companion.app.from_autopilot import DrawnSettings, FoundMission, find_on, keep, plan_path
    from companion.clock import run as run_loop
    from companion.disk import Disk
    from companion.geofence.mission import NO_NAME
    from companion.mavlink.transports import open_link
    from companion.mission_check import require_sailable

    def say(text: str) -> None:
        err.write(f"companion run: {text}\n")

    kept = plan_path(state_path)
    # A dry run must not take the place of the drawing of a voyage that is interrupted.
    keep_at = folder / f"{NO_NAME}.plan" if args.dry_run else kept

    async def read() -> FoundMission:
        patience = asyncio.create_task(_ask_for_patience(manager, BEAT_S * args.speedup))
        try:
            return await find_on(
                open_link(args.link),
                settings,
                args.mission,
                state_path,
                keep_at,
                say,
                wait_s=args.wait * args.speedup,
                signing=signing,
            )
        finally:
            patience.cancel()

    found = run_loop(read(), speedup=args.speedup)
    for finding in (*found.drawn.refusals, *found.drawn.notes):
        say(finding.line(found.document.source))
    if found.drawn.mission is None:
        say("nothing was sent to the boat")
        return None
    mission = require_sailable(found.drawn.mission)
    if found.is_new:
        keep(found.document, found.plan, Disk())
    say(f"sailing {found.text}; it is kept at {found.plan}" if found.is_new else f"sailing {found.text}")
    if args.mission is None and not args.dry_run:
        say(NOTHING_PERMITTED)
    return MissionToSail(
        mission=mission,
        known=(found.board,),
        is_new=found.is_new,
        settings=DrawnSettings(options=settings, path=args.mission, state_path=state_path),
    )


async def _ask_for_patience(manager: ServiceManager, every_s: float) -> None:
    while True:
        manager.starting("reading the drawing on the autopilot")
        await asyncio.sleep(every_s)
