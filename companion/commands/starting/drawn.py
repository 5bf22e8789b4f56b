"""``companion run --from-autopilot``: the mission is what was drawn in a ground station and uploaded."""

from __future__ import annotations

import argparse
import asyncio
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from companion.errors import InputError

if TYPE_CHECKING:
    from companion.app.adoption import Settings
    from companion.geofence import Mission
    from companion.geofence.mission import MissionOptions
    from companion.telemetry.console import Console
    from companion.telemetry.service import ServiceManager

NOTHING_PERMITTED = """without a mission file nothing is permitted, nothing will be sent to the boat; write boat.toml:
  from_autopilot = true
  [operator]
  set_auto = true    # upload the plan and set AUTO; arm = true: arm her, too
and start: companion run boat.toml --link LINK"""

BEAT_S = 5.0   # of the words to the service manager, whose watchdog waits for 30 s


@dataclass(frozen=True, slots=True, kw_only=True)
class Sailed:
    """A mission to sail, what on the autopilot may give way to it, and whether it begins anew."""

    mission: Mission
    known: tuple[str, ...] = ()
    is_new: bool = False
    settings: Settings | None = None   # where it is drawn


def settings_of(path: Path | None, *, is_drawn: bool, system: int | None) -> MissionOptions | None:
    """Return the settings of a mission that is drawn on the autopilot, None where the goals are the file's own."""
    import msgspec

    from companion.geofence.mission import MissionOptions, load_settings, read_options

    settings: MissionOptions | None = None
    if path is None:
        if not is_drawn:
            raise InputError("companion run", "", "there is no mission",
                             "name a mission file, or sail what is drawn on the autopilot: --from-autopilot")
        settings = MissionOptions(from_autopilot=True)
    elif is_drawn or read_options(path).from_autopilot:
        settings = load_settings(path)
    if settings is None or system is None:
        return settings
    return msgspec.structs.replace(settings, autopilot=msgspec.structs.replace(settings.autopilot, system=system))


def read_drawn(
    args: argparse.Namespace, settings: MissionOptions, folder: Path, state_path: Path, signing: Any,
    manager: ServiceManager, err: Console,
) -> Sailed | None:
    """Return the mission that is drawn on the autopilot, kept on the disk; None when it was refused, line by line.

    Raises:
        InputError: the settings cannot be sailed with, or there is no drawing.
        LinkError: the autopilot's lists cannot be read.
    """
    from companion.app.adoption import Settings
    from companion.app.drawn import Found, find_on, keep, plan_path
    from companion.clock import run as run_loop
    from companion.disk import Disk
    from companion.geofence.mission import NO_NAME
    from companion.mavlink.transports import open_link
    from companion.sailable import require_sailable

    def say(text: str) -> None:
        err.write(f"companion run: {text}\n")

    kept = plan_path(state_path)
    # A dry run must not take the place of the drawing of a voyage that is interrupted.
    keep_at = folder / f"{NO_NAME}.plan" if args.dry_run else kept

    async def read() -> Found:
        patience = asyncio.create_task(_ask_for_patience(manager, BEAT_S * args.speedup))
        try:
            return await find_on(open_link(args.link), settings, args.mission, state_path, keep_at, say,
                                 wait_s=args.wait * args.speedup, signing=signing)
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
    return Sailed(mission=mission, known=(found.board,), is_new=found.is_new,
                  settings=Settings(options=settings, path=args.mission, state_path=state_path))


async def _ask_for_patience(manager: ServiceManager, every_s: float) -> None:
    while True:
        manager.starting("reading the drawing on the autopilot")
        await asyncio.sleep(every_s)
