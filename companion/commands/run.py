"""``companion run``: sail a mission."""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import os
import re
import secrets
import signal
import sys
import time
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from companion.program import system_id

# Loading takes about two seconds; beyond this the operator is told why nothing happens [s].
PATIENCE_S = 4.0


def add_parser(subparsers: Any, summary: str) -> None:
    """Add the command."""
    parser = subparsers.add_parser(
        "run", help=summary,
        description="Sail a mission: estimate the wind, plan, upload, and plan again at each waypoint. Nothing is "
        "sent to the boat that the mission's [operator] table does not allow.",
        epilog="Example: companion run missions/archipelago.toml --link udpin:127.0.0.1:14551",
    )
    parser.add_argument("mission", type=Path, metavar="MISSION.toml", help="the mission file")
    parser.add_argument("--link", required=True, metavar="LINK",
                        help="/dev/serial0:921600, udpin:HOST:PORT, udpout:HOST:PORT, tcp:HOST:PORT")
    parser.add_argument("--system", type=system_id, metavar="N",
                        help="the autopilot's MAVLink system id (default: the mission's, else the only one heard)")
    parser.add_argument("--out", type=Path, metavar="DIR",
                        help="the voyage folder (default: voyages/<UTC time>-<mission>)")
    parser.add_argument("--dry-run", action="store_true", help="look, plan and speak; touch nothing")
    parser.add_argument("--seed", type=int, default=None, help="of the planner (default: the mission's)")
    parser.add_argument("--state", type=Path, metavar="FILE",
                        help="where the state for a restart is kept (default: voyages/<mission>.state.json)")
    parser.add_argument("--wait", type=float, default=30.0, metavar="S",
                        help="give up when no autopilot is heard for this long (default: 30)")
    parser.add_argument("--limit", type=float, metavar="S", help="end after this many seconds")
    parser.add_argument("--feed", action="append", default=[], metavar="FEED",
                        help="hear other vessels here too, besides the mission's [traffic] feeds: udpin:HOST:PORT, "
                        "tcp:HOST:PORT, /dev/NAME:BAUD; may be given more than once")
    parser.add_argument("--signing-key", type=Path, metavar="FILE", help="MAVLink signing key (32 bytes, mode 0600)")
    parser.add_argument("--speedup", type=float, default=1.0, metavar="N",
                        help="the autopilot is a simulator that runs N times as fast as time (default: 1)")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Run the command."""
    from companion.clock import run as run_loop
    from companion.errors import InputError
    from companion.geofence import load_mission
    from companion.mavlink.transport import open_link
    from companion.traffic.feeds import parse_feed

    if not args.speedup > 0.0:
        raise InputError("--speedup", str(args.speedup), "must be positive")
    for name in args.feed:
        parse_feed(name)
    mission = load_mission(args.mission).with_feeds(*args.feed).with_system(args.system)
    for finding in mission.findings:
        sys.stderr.write(f"companion run: note: {finding}\n")
    seed = mission.skipper.seed if args.seed is None else args.seed
    transport = open_link(args.link, seed=seed)
    name = re.sub(r"[^A-Za-z0-9_-]+", "-", mission.name).strip("-") or "voyage"
    folder = args.out or Path("voyages") / f"{datetime.now(UTC):%Y%m%dT%H%M%SZ}-{name}"
    state_path = args.state or (folder.parent / f"{name}.state.json")
    state_path.parent.mkdir(parents=True, exist_ok=True)
    signing = _signing(args.signing_key)

    def options() -> Any:
        from companion.options import SailOptions

        return SailOptions(
            seed=seed, dry_run=args.dry_run, epoch_s=time.time() - time.monotonic() * args.speedup,
            expansions=mission.skipper.expansions, state_path=state_path, limit_s=args.limit,
            wait_s=args.wait * args.speedup, signing=signing, budget_scale=1.0 / args.speedup,
            command=" ".join(sys.argv), token=secrets.randbelow(0xFFFFFFFF) + 1,
        )

    summary = run_loop(_sail(mission, transport, folder, options, args.speedup), speedup=args.speedup)
    _report(folder)
    arrived = bool(summary.get("arrived"))
    end = "arrived" if arrived else f"not arrived: {summary.get('end_reason')}, {summary.get('end_why')}"
    print(f"{end}; {summary.get('time_s') or 0.0:.0f} s, {summary['tacks']} tacks, {summary['replans']} replans")
    print(folder)
    return 0 if arrived else 1


async def _sail(
    mission: Any, transport: Any, folder: Path, options: Callable[[], Any], speedup: float
) -> dict[str, Any]:
    from companion.errors import JobError
    from companion.planner.worker import PlannerWorker

    stop = asyncio.Event()
    loop = asyncio.get_running_loop()
    for number in (signal.SIGINT, signal.SIGTERM):
        with contextlib.suppress(NotImplementedError):
            loop.add_signal_handler(number, stop.set)
    async with PlannerWorker() as planner:
        # The child loads its kernels while this process imports the rest.
        from companion.app import sail
        from companion.telemetry.progress import ProgressLine
        from companion.telemetry.service import ServiceManager

        ready = asyncio.ensure_future(planner.ready())
        if not (await asyncio.wait({ready}, timeout=PATIENCE_S * speedup))[0]:
            print("preparing the planner: its kernels are compiled once on each machine", flush=True)
        try:
            await ready
        except (TimeoutError, EOFError, OSError) as error:
            raise JobError(f"the planner's process did not start: {error!r}") from error
        with ProgressLine(sys.stdout) as progress, ServiceManager(os.environ) as manager:

            def show(status: Any, step: Any) -> None:
                progress.show(status, step)
                manager.alive(f"{step.state.phase.value}: {step.state.why}")

            return await sail(mission, transport, planner, folder, options(), on_status=show, stop=stop)


def _signing(path: Path | None) -> Any:
    if path is None:
        return None
    from companion.mavlink.signing import SigningStore

    return SigningStore(path, time.time())


def _report(folder: Path) -> None:
    """Draw the voyage; a picture that fails must not hide how the voyage ended."""
    try:
        from companion.plots.voyage import PICTURE, plot_voyage, read_voyage

        plot_voyage(read_voyage(folder), folder / PICTURE)
    except Exception as error:
        sys.stderr.write(f"companion run: the picture could not be drawn: {error!r}\n")
