"""``companion doctor``: is this autopilot set up to be sailed? It changes nothing unless told ``--apply``."""

from __future__ import annotations

import argparse
import asyncio
import functools
import json
import math
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from companion.errors import InputError
from companion.program.arguments import autopilot_options, number
from companion.words import counted

if TYPE_CHECKING:
    from companion.boat import AutopilotLimits, Steering
    from companion.doctor import DoctorFinding, Examined, Needs
    from companion.geofence import Mission
    from companion.mavlink.autopilot import Autopilot
    from companion.mavlink.signing import SigningStore
    from companion.mavlink.transports import Transport

LISTEN_S = 6.0  # long enough for messages of once a second to show their rate

_EPILOG = """\
examples:
  companion doctor --link udpin:127.0.0.1:14551
  companion doctor --link /dev/serial0:921600 --mission missions/lake.toml
  companion doctor --link udpin:127.0.0.1:14551 --mission missions/lake.toml --apply
  companion doctor --link /dev/ttyACM0 --signing-key boat.key --set-key
  companion doctor --log voyages/lake flights/*.BIN            (how it steered, and what of its tuning to change)

With --mission the parameters are held against that voyage's margins, distances and boat. --apply sets what the
warnings and errors name (never what is only good to know, or of tuning), one parameter at a time, and reads each back.
Exit codes: 0 nothing in the way, 1 an error was found or the autopilot did not answer, 2 bad usage or input.
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class ParameterFix:
    """A parameter that was set, or was to be: what it reads afterwards (None: not set)."""

    name: str
    before: float | None
    wanted: float
    after: float | None
    text: str = ""

    @property
    def is_done(self) -> bool:
        """It reads back as wanted."""
        return self.after is not None and math.isclose(self.after, self.wanted, rel_tol=1e-6, abs_tol=1e-6)


def add_parser(subparsers: Any, summary: str) -> None:
    """Add the command."""
    parser = subparsers.add_parser(
        "doctor",
        help=summary,
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        description="Read the autopilot's parameters, version, streams, fence and mission; say what would spoil a "
        "voyage and what to set.",
    )
    autopilot_options(parser, required=False)
    parser.add_argument("--mission", type=Path, metavar="MISSION.toml", help="hold the settings against this voyage")
    parser.add_argument(
        "--log",
        nargs="+",
        default=[],
        type=Path,
        metavar="LOG",
        help="how it steered in these (.BIN, .tlog, voyage folders), and what of its tuning to change; with --link "
        "against what is set now; never applied",
    )
    parser.add_argument("--signing-key", type=Path, metavar="FILE", help="MAVLink signing key (mode 0600)")
    parser.add_argument(
        "--set-key",
        action="store_true",
        help="first put that key on the autopilot, as 'companion key set' does; it asks",
    )
    parser.add_argument("--yes", action="store_true", help="with --set-key: do not ask")
    parser.add_argument("--apply", action="store_true", help="set what the warnings and errors name, and read it back")
    parser.add_argument("--json", action="store_true", help="print findings and changes as JSON")
    parser.add_argument(
        "--wait", type=number("s", above=0.0), default=30.0, metavar="S", help="for the first heartbeat (default: 30)"
    )
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Run the command."""
    from companion.clock import run as run_loop
    from companion.commands.key import put_on
    from companion.doctor import Level, examine_steering
    from companion.geofence import load_mission
    from companion.mavlink.signing import SigningStore
    from companion.mavlink.transports import open_link
    from companion.mission_check import require_sailable

    if args.link is None and not args.log:
        raise InputError(
            "--link", "", "there is neither an autopilot nor a log to look at", "give --link, --log or both"
        )
    steering = steering_in(args.log) if args.log else None
    if args.link is None:
        for name in ("mission", "apply", "set_key"):
            if getattr(args, name):
                word = f"--{name.replace('_', '-')}"
                raise InputError(
                    "companion doctor", word, "it is about an autopilot on a link", "give --link LINK, too"
                )
        _print(() if steering is None else examine_steering(steering), (), args)
        return 0
    mission = require_sailable(load_mission(args.mission)) if args.mission is not None else None
    signing = SigningStore(args.signing_key, time.time()) if args.signing_key is not None else None
    system = args.system or (mission.autopilot.system if mission is not None else None)
    if args.set_key:
        if signing is None:
            raise InputError("--set-key", "", "there is no key", "name it: --signing-key FILE ('companion key new')")
        seen = put_on(
            functools.partial(open_link, args.link),
            signing,
            system=system,
            asks=not args.yes,
            name=str(args.signing_key),
        )
        print(run_loop(seen), file=sys.stderr if args.json else sys.stdout)
    sys.stderr.write(f"looking at the autopilot on {args.link}: about a quarter of a minute, by radio longer\n")
    findings, changes = run_loop(
        diagnose(
            open_link(args.link),
            needs_of(mission),
            wait_s=args.wait,
            apply=args.apply,
            signing=signing,
            system=system,
            speed=planner_speed(),
            steering=steering,
        )
    )
    _print(findings, changes, args)
    left = [f for f in findings if f.level is Level.ERROR and not _is_cured(f, changes)]
    return 1 if left or any(not change.is_done for change in changes) else 0


def _print(findings: Sequence[DoctorFinding], changes: Sequence[ParameterFix], args: argparse.Namespace) -> None:
    if args.json:
        print(json.dumps(as_json(findings, changes), indent=1))
    else:
        sys.stdout.write(as_text(findings, changes, applied=args.apply))


def steering_in(paths: Sequence[Path]) -> Steering:
    """Return how the autopilot steered in all logs under these paths; say which tell nothing of it. Raises JobError."""
    from companion.boat import steering_of
    from companion.boat_logs import logs_under, read_steering, why_none
    from companion.errors import JobError

    logs, skipped = read_steering(logs_under(list(paths)))
    takes = "give .BIN or .tlog of a voyage, or its folder"
    if not logs and len(skipped) < 2:
        raise JobError(f"{why_none(paths, skipped)}; {takes}")
    for left in skipped:
        print(f"skipped {left.name}: {left.why}", file=sys.stderr)
    if not logs:
        raise JobError(f"none of the logs tells how the autopilot steered; {takes}")
    return steering_of(logs)


def planner_speed() -> float | None:
    """Return how fast this computer plans, as a share of the reference core; None where kernels are to be compiled."""
    from companion.kernels.build import is_ready
    from companion.planner.worker import speed

    return speed() if is_ready(("companion",)) else None


def needs_of(mission: Mission | None) -> Needs:
    """Return what a voyage needs of the autopilot."""
    from companion.doctor import Needs

    if mission is None:
        return Needs()
    from companion.compose import boat_of, config_of

    boat, config, frame = boat_of(mission), config_of(mission), mission.frame()
    places = [frame.en_from_geo(place) for place in mission.places]
    return Needs(
        no_go_half_rad=boat.no_go_half_rad,
        margin_m=config.margin_m,
        margin_floor_m=config.margin_floor_m,
        goal_radius_m=min(goal.radius_m for goal in mission.goals),
        loiter_radius_m=config.loiter_radius_m,
        speed_mps=boat.polar.max_speed_mps(mission.wind.preview_speed_mps or 5.0),
        hull=boat.hull,
        reach_m=max(math.hypot(*place) for place in places),
        has_fence=mission.operator.upload_fence,
        can_tack=boat.can_tack,
        has_refuge=bool(mission.refuges),
        sails=mission.autopilot.frame == "sailboat",
        least_depth_m=config.least_depth_m,
    )


def limits_at(link: str, *, system: int | None = None) -> AutopilotLimits:
    """Return what the autopilot on a link does with a plan. Raises InputError and LinkError."""
    from companion.boat import AutopilotLimits
    from companion.clock import run as run_loop
    from companion.mavlink.autopilot import Autopilot
    from companion.mavlink.link import Link
    from companion.mavlink.reception import TOOL_COMPONENT, LinkIdentity
    from companion.mavlink.transports import open_link

    async def ask() -> AutopilotLimits:
        own = LinkIdentity(component=TOOL_COMPONENT)
        async with Link(open_link(link), identity=own, target_system=system) as connected:
            await connected.wait_autopilot(10.0)
            async with Autopilot(connected) as autopilot:
                answers = {name: await autopilot.get_parameter(name) for name in AutopilotLimits.PARAMETERS}
        return AutopilotLimits.from_params(
            {name: answer.value for name, answer in answers.items() if answer.value is not None}
        )

    return run_loop(ask())


async def diagnose(
    transport: Transport,
    needs: Needs,
    *,
    wait_s: float = 30.0,
    apply: bool = False,
    signing: SigningStore | None = None,
    system: int | None = None,
    speed: float | None = None,
    steering: Steering | None = None,
) -> tuple[tuple[DoctorFinding, ...], tuple[ParameterFix, ...]]:
    """Read everything, judge it, and set what is to be set if ``apply``; of tuning by logs (``steering``) nothing is.

    Raises:
        LinkError: no autopilot was heard, none whose signatures fit the key, several and none named, or no rover.
    """
    from companion.doctor import Level, examine, examine_steering
    from companion.mavlink.autopilot import Autopilot
    from companion.mavlink.link import Link
    from companion.mavlink.reception import TOOL_COMPONENT, LinkIdentity

    # Beside a companion that sails: by its ids the two would take each other for a second one.
    own = LinkIdentity(component=TOOL_COMPONENT)
    async with Link(transport, identity=own, target_system=system, signing=signing) as link:
        await link.wait_autopilot(wait_s)
        async with Autopilot(link) as autopilot:
            seen = await read(autopilot, has_key=signing is not None)
            seen = replace(seen, planner_speed=speed)
            findings = examine(seen, needs)
            changes = await _apply(autopilot, findings) if apply else ()
            if changes:  # what another value hid comes now, not in the next run
                now = {change.name: change.after for change in changes if change.after is not None}
                again = examine(replace(seen, parameters={**seen.parameters, **now}), needs)
                known = {finding.code for finding in findings}
                hidden = tuple(f for f in again if f.level is not Level.INFO and f.code not in known)
                findings, changes = (*findings, *hidden), (*changes, *await _apply(autopilot, hidden))
            tuning = () if steering is None else examine_steering(steering, seen.parameters)
            return (*findings, *tuning), changes


async def read(autopilot: Autopilot, *, has_key: bool = False) -> Examined:
    """Read parameters, version, mission and fence, and count messages for LISTEN_S."""
    from companion.clock import now_s
    from companion.doctor import RATES_HZ, Examined

    counts = dict.fromkeys(RATES_HZ, 0)

    def count(_: float, message: Any) -> None:
        kind = message.get_type()
        if kind in counts:
            counts[kind] += 1

    # The streams are asked for when the autopilot is found: give them a moment before counting.
    await asyncio.sleep(1.0)
    began_s = now_s()
    stop = autopilot.link.subscribe(count)
    try:
        await asyncio.sleep(LISTEN_S)
        elapsed_s = max(now_s() - began_s, 1e-3)
    finally:
        stop()
    table = await autopilot.read_parameters()
    mission = await autopilot.read_mission()
    fence = await autopilot.read_fence()
    return Examined(
        parameters=table.values,
        version=autopilot.version.version if autopilot.version is not None else None,
        uid=autopilot.version.uid if autopilot.version is not None else None,
        mission=mission.items,
        fence=fence.items,
        rates_hz={name: n / elapsed_s for name, n in counts.items()},
        system_id=autopilot.link.party.target_system,
        is_signed=autopilot.link.is_signed,
        has_key=has_key,
    )


async def _apply(autopilot: Autopilot, findings: Sequence[DoctorFinding]) -> tuple[ParameterFix, ...]:
    """Set what warnings and errors want, worst first, each parameter once, and read it back."""
    from companion.doctor import Level

    changes: dict[str, ParameterFix] = {}
    for finding in findings:
        name, wanted = finding.parameter, finding.wanted
        if finding.level is Level.INFO or name is None or wanted is None or name in changes:
            continue
        written = await autopilot.set_parameter(name, wanted)
        seen = await autopilot.get_parameter(name)
        changes[name] = ParameterFix(
            name=seen.name or name,
            before=finding.value,
            wanted=wanted,
            after=seen.value if seen.is_ok else None,
            text=written.text,
        )
    return tuple(changes.values())


def _is_cured(finding: DoctorFinding, changes: Sequence[ParameterFix]) -> bool:
    return (
        any(change.before == finding.value and change.wanted == finding.wanted and change.is_done for change in changes)
        and finding.wanted is not None
    )


def as_json(findings: Sequence[DoctorFinding], changes: Sequence[ParameterFix]) -> dict[str, Any]:
    """Return findings and changes as JSON values."""
    return {
        "findings": [
            {
                "level": f.level.name.lower(),
                "code": f.code,
                "what": f.what,
                "why": f.why,
                "parameter": f.parameter,
                "value": f.value,
                "wanted": f.wanted,
            }
            for f in findings
        ],
        "changes": [
            {"parameter": c.name, "before": c.before, "wanted": c.wanted, "after": c.after, "done": c.is_done}
            for c in changes
        ],
    }


def as_text(findings: Sequence[DoctorFinding], changes: Sequence[ParameterFix], *, applied: bool) -> str:
    """Return the findings as lines for a person, worst first."""
    from companion.doctor import Level

    lines = []
    for f in findings:
        lines.append(f"{f.level.name.lower():8}{f.what}")
        lines.append(f"        {f.why}")
        if f.wanted is not None and f.parameter is not None and f.level is not Level.INFO:
            now = f" (now {f.value:g})" if f.value is not None else ""
            lines.append(f"        set {f.parameter} {f.wanted:g}{now}")
    for c in changes:
        before = "?" if c.before is None else f"{c.before:g}"
        state = "set, reads back" if c.is_done else f"NOT set: {c.text or 'it reads back otherwise'}, reads"
        after = "nothing" if c.after is None else f"{c.after:g}"
        lines.append(f"apply   {c.name} {before} -> {c.wanted:g}: {state} {after}")
    errors = sum(f.level is Level.ERROR for f in findings)
    warnings = sum(f.level is Level.WARNING for f in findings)
    rest = "" if applied else "; nothing was changed"
    lines.append(f"{counted(errors, 'error')}, {counted(warnings, 'warning')}{rest}")
    return "\n".join(lines) + "\n"
