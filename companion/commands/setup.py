"""``companion setup``: from a computer that is wired to an autopilot to a service that can be started."""

from __future__ import annotations

import argparse
import contextlib
import grp
import os
import re
import stat
import sys
import tempfile
from argparse import ArgumentTypeError
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from companion.errors import CompanionError, InputError, JobError, LinkError
from companion.program.arguments import number, place, system_id

if TYPE_CHECKING:
    from companion.boat import Sizes
    from companion.messages import GeoPoint

FOLDER = Path("/etc/companion")
SIMULATOR = "the simulator's boat"
NO_GO_DEG = number("deg", at_least=20.0, at_most=80.0)

_EPILOG = """\
examples:
  companion setup                                     asks
  companion setup lake --yes --start 50.8170,-1.3100 --goal 50.8200,-1.3094
  companion setup pond --link udpin:0.0.0.0:14550 --drawn --yes
Exit codes: 0 written and nothing in the way, 1 written and the doctor found an error, or no autopilot was heard and
nothing is written, 2 something asked for is wrong and nothing is written.
"""


def instance(text: str) -> str:
    """Take the name of an instance of the unit."""
    if re.fullmatch(r"[a-z0-9][a-z0-9-]{0,40}", text) is None:
        raise ArgumentTypeError(f"{text!r} is no name of an instance; lower-case letters, digits and - make one")
    return text


def add_parser(subparsers: Any, summary: str) -> None:
    """Add the command."""
    parser = subparsers.add_parser(
        "setup",
        help=summary,
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        description="Look for the autopilot on the serial ports, ask what is not given as an option, write a mission "
        "and the settings of its systemd instance (NAME.toml, NAME.env), and run the doctor. Nothing else is "
        "changed, neither here nor on the autopilot.",
    )
    parser.add_argument(
        "name",
        type=instance,
        nargs="?",
        metavar="NAME",
        help="of the mission and its instance, companion@NAME (default: boat)",
    )
    parser.add_argument("--link", metavar="LINK", help="to the autopilot (default: the serial ports are looked at)")
    parser.add_argument(
        "--system",
        type=system_id,
        metavar="N",
        help="the autopilot's MAVLink system id (default: of the one that is heard)",
    )
    parser.add_argument("--start", type=place, metavar="LAT,LON", help="where the boat will start")
    parser.add_argument(
        "--goal",
        type=place,
        action="append",
        default=[],
        metavar="LAT,LON",
        help="where it is to sail; repeat it for more, in order",
    )
    parser.add_argument(
        "--drawn", action="store_true", help="the goals are drawn in a ground station and uploaded to the autopilot"
    )
    boat = parser.add_mutually_exclusive_group()
    boat.add_argument(
        "--boat",
        type=sizes,
        metavar="M,KG,M2",
        help="the boat's length, displacement and sail area, of which its file is guessed (1.5,20,0.9)",
    )
    boat.add_argument("--polar", type=Path, metavar="FILE", help="the boat's polar (default: the simulator's boat)")
    parser.add_argument(
        "--no-go",
        type=NO_GO_DEG,
        metavar="DEG",
        help="how close to the wind the boat can sail (default: 47, or what is guessed)",
    )
    parser.add_argument(
        "--dir",
        type=Path,
        default=FOLDER,
        metavar="DIR",
        help=f"where the systemd unit looks for them (default: {FOLDER})",
    )
    parser.add_argument("--yes", action="store_true", help="ask nothing: use the defaults for what is not given")
    parser.add_argument("--force", action="store_true", help="overwrite files that exist")
    parser.add_argument("--no-doctor", action="store_true", help="do not examine the autopilot")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Run the command."""
    from companion.commands.output import refuse_existing

    ask = Questions(is_silent=args.yes)
    args.name = args.name or ask("name of the mission", "boat", instance)
    _room(args.dir)
    refuse_existing([str(args.dir / f"{args.name}{kind}") for kind in (".toml", ".env")], force=args.force)
    link, system = _link(args, ask)
    if not args.drawn and not args.goal:
        args.drawn = ask("are the goals drawn on the autopilot (yes), or named here (no)", "yes", yes_or_no)
    if not args.drawn:
        args.start = args.start or ask("where she starts, LAT,LON", None, place)
        args.goal = args.goal or [ask("where she is to sail, LAT,LON", None, place)]
        while not ask.is_silent and (problem := apart(args.start, args.goal)):  # unasked, the mission's check says so
            print(problem)
            if ask("are they right as they are (yes), or named again (no)", "no", yes_or_no):
                break
            args.start = ask("where she starts, LAT,LON", None, place)
            args.goal = [ask("where she is to sail, LAT,LON", None, place)]
    if args.polar is None and args.boat is None:
        args.boat = ask(
            "her length [m], displacement [kg] and sail area [m2], as 1.5,20,0.9",
            SIMULATOR,
            lambda text: None if text == SIMULATOR else sizes(text),
        )
    if args.boat is None:
        args.no_go = args.no_go or ask("how near to the wind she sails [deg]", 47.0, NO_GO_DEG)
    written = write_instance(args.dir, args.name, mission_of(args, link, system), settings_of(link), boat_of(args))
    for path in written:
        print(f"{path}: written")
    if args.polar is None and args.boat is None:
        print("her speeds are those of the simulator's boat; --boat 1.5,20,0.9 guesses them of her sizes")
    if args.boat is not None:
        print(f"at the bench, a simulated boat as fast as she is guessed to be: sitl boat --polar {written[-1]}")
    code = 0 if args.no_doctor else _examine(written[0], link, system)
    print(
        f"[operator] of {written[0]} permits nothing yet. To look, plan and change nothing: "
        f"companion run {written[0]} --link {link} --dry-run"
    )
    if args.dir == FOLDER:
        print(f"to start at each boot: sudo systemctl enable --now companion@{args.name}")
    return code


def _room(folder: Path) -> None:
    """Raise JobError where there is no folder, or no room on its card."""
    from companion.disk import Disk

    if not folder.is_dir():
        if folder.exists():
            raise InputError(str(folder), "", "is no folder", "name another with --dir")
        raise InputError(str(folder), "", "no such folder", "make it, or name another with --dir")
    room = Disk().room(folder)
    if room.is_short:
        raise JobError(
            f"{folder}: the card is full ({room.free_bytes / 1e6:.1f} MB left); make room: sudo apt clean, "
            "sudo journalctl --vacuum-size=50M"
        )


def _link(args: argparse.Namespace, ask: Questions) -> tuple[str, int | None]:
    """Return the link and the system id of the autopilot on it."""
    from companion.mavlink.transports import parse_link

    if args.link is not None:
        return parse_link(args.link).text, args.system
    try:
        link, system = find_autopilot(serial_ports(), lambda text: print(text, file=sys.stderr))
    except LinkError as error:
        if ask.is_silent:
            raise
        print(f"companion setup: {error}", file=sys.stderr)
        return ask("LINK of the autopilot", None, lambda text: parse_link(text).text), args.system
    print(f"the autopilot of system {system} is on {link}")
    return link, args.system or system


def _examine(mission: Path, link: str, system: int | None) -> int:
    """Run the doctor; return its exit code."""
    from companion.commands import doctor
    from companion.program import Parser

    words = ["doctor", "--link", link, *([] if system is None else ["--system", str(system)])]
    if "from_autopilot = true" not in mission.read_text(encoding="utf-8"):
        words += ["--mission", str(mission)]
    parser = Parser(prog="companion")
    doctor.add_parser(parser.add_subparsers(), "")
    return doctor.run(parser.parse_args(words))


def sizes(text: str) -> Sizes:
    """Take a boat's length, displacement and sail area."""
    from companion.boat import Sizes

    parts = text.split(",")
    if len(parts) != 3:
        raise ArgumentTypeError(f"{text!r} is not three numbers: length [m], displacement [kg], sail area [m2]")
    try:
        length_m, displacement_kg, sail_area_m2 = map(float, parts)
        return Sizes(length_m=length_m, displacement_kg=displacement_kg, sail_area_m2=sail_area_m2)
    except ValueError as error:
        raise ArgumentTypeError(str(error)) from None


def apart(start: GeoPoint, goals: Sequence[GeoPoint]) -> str:
    """Return which goal is farther from the start than a mission reaches, and how that may have come; empty: none."""
    from companion.geo.frame import RANGE_M, LocalFrame

    frame = LocalFrame(start)
    for nth, goal in enumerate(goals, start=1):
        away_m = max(abs(part) for part in frame.en_from_geo(goal))
        if away_m > RANGE_M:
            return (
                f"goal {nth} ({goal.lat_deg:g},{goal.lon_deg:g}) is {away_m / 1000.0:.0f} km from the start "
                f"({start.lat_deg:g},{start.lon_deg:g}): is one of them LON,LAT, or has a sign wrong?"
            )
    return ""


def yes_or_no(text: str) -> bool:
    """Take an answer."""
    if text.lower() not in {"y", "yes", "n", "no"}:
        raise ValueError("yes or no")
    return text.lower().startswith("y")


class Questions:
    """What is asked at the terminal. ``is_silent``: nothing is; the default holds, or what is missing is named."""

    def __init__(self, *, is_silent: bool) -> None:
        self.is_silent = is_silent or not sys.stdin.isatty()

    def __call__(self, what: str, default: Any, take: Callable[[str], Any]) -> Any:
        """Return the answer, taken by ``take``; asked again until it can be."""
        if self.is_silent:
            if default is None:
                raise InputError(
                    "companion setup", "", f"not given: {what}", "name it: --start, --goal, --drawn, --link"
                )
            return take(default) if isinstance(default, str) else default
        while True:
            shown = "" if default is None else f" [{default}]"
            text = input(f"{what}{shown}: ").strip()
            if not text and default is not None:
                return take(default) if isinstance(default, str) else default
            try:
                return take(text)
            except (ArgumentTypeError, ValueError, CompanionError) as error:
                print(error)


def margin_of(link: str | None, system: int | None) -> dict[str, float]:
    """Return the margin that the doctor finds enough for the autopilot on a link; None, or silent: for a default."""
    from companion.boat import AutopilotLimits, Boat, ardurover_sitl, proposed_margin
    from companion.commands.doctor import limits_at
    from companion.geofence.mission import WindOptions

    limits, boat = AutopilotLimits(), Boat(polar=ardurover_sitl())
    if link is not None:
        with contextlib.suppress(CompanionError):
            limits = limits_at(link, system=system)
    proposed = proposed_margin(
        limits, speed_mps=boat.polar.max_speed_mps(WindOptions().preview_speed_mps), hull=boat.hull
    )
    return {"margin_m": proposed.margin_m, "margin_floor_m": proposed.floor_m}


def mission_of(args: argparse.Namespace, link: str | None, system: int | None) -> dict[str, Any]:
    """Return the mission, as its file has it; its operator permits nothing."""
    boat: dict[str, Any] = {} if args.no_go is None else {"no_go_half_deg": args.no_go}
    for name in boat_of(args):
        boat["polar" if args.boat is None else "file"] = name
    mission: dict[str, Any] = {"name": args.name}
    if args.drawn:
        mission["from_autopilot"] = True
    else:
        mission["start"] = _place(args.start)
        mission["goal"] = [_place(goal) for goal in args.goal]
    mission["area"] = margin_of(None if args.no_doctor else link, system)
    mission["boat"] = boat
    if system is not None:
        mission["autopilot"] = {"system": system}
    mission["operator"] = {"set_auto": False, "arm": False}
    return mission


def boat_of(args: argparse.Namespace) -> dict[str, bytes]:
    """Return the file of the boat, by its name: a polar that is there, or what is guessed of its sizes."""
    if args.polar is not None:
        from companion.compose import whole_polar

        whole_polar(args.polar)  # one that cannot be sailed by is not copied
        return {args.polar.name: args.polar.read_bytes()}
    if args.boat is None:
        return {}
    from companion.boat import guessed, guessed_text

    text = guessed_text(args.name, args.boat, guessed(args.boat), f"{datetime.now(UTC):%Y-%m-%d}")
    return {f"{args.name}-boat.toml": text.encode()}


def _place(point: Any) -> dict[str, float]:
    return {"lat": point.lat_deg, "lon": point.lon_deg}


def settings_of(link: str) -> str:
    """Return the instance's settings."""
    return f"# How companion@ reaches the autopilot; OPTIONS= has more options of `companion run`.\nLINK={link}\n"


def write_instance(
    folder: Path, name: str, mission: dict[str, Any], settings: str, boat: Mapping[str, bytes]
) -> list[Path]:
    """Write them once the mission has been read as the boat will read it; return the paths, the mission's first.

    Raises:
        InputError: it could not be sailed; nothing is written.
    """
    from companion.commands.output import write_files
    from companion.geofence import load_mission
    from companion.geofence.mission import load_settings, toml

    files = {f"{name}.toml": toml(mission).encode(), f"{name}.env": settings.encode(), **boat}
    with tempfile.TemporaryDirectory() as scratch:
        for file, data in files.items():
            Path(scratch, file).write_bytes(data)
        try:
            path = Path(scratch, f"{name}.toml")
            if mission.get("from_autopilot"):
                load_settings(path)
            else:
                load_mission(path)
        except InputError as error:
            raise InputError(
                str(folder / Path(error.source).name), error.place, error.problem, error.remedy or "nothing is written"
            ) from None
    write_files({str(folder / file): data for file, data in files.items()}, force=True)
    return [folder / file for file in files]


# The best name first: those of udev stay when ports are plugged in another order.
NAMES = ("autopilot", "serial/by-id/*", "serial0", "ttyAMA*", "ttyACM*", "ttyUSB*")
BAUDS = (921_600, 115_200, 57_600)
LISTEN_S = 3.0  # a heartbeat a second
WIRE = (
    "wire the autopilot to a serial port (docs/guides/on-the-boat.md), or name another link: --link udpin:0.0.0.0:14550"
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Port:
    """A serial port by its best name; ``trouble`` says why it cannot be used, empty: it can be tried."""

    path: Path
    trouble: str = ""


def serial_ports(devices: Path = Path("/dev")) -> list[Port]:
    """Return the serial ports, each once."""
    found: dict[Path, Port] = {}
    for name in NAMES:
        for path in sorted(devices.glob(name)):
            found.setdefault(path.resolve(), Port(path=path, trouble=permission(path)))
    return list(found.values())


def permission(path: Path) -> str:
    """Return what keeps this user from a port, with the remedy; empty: nothing does."""
    try:
        status = path.stat()
    except OSError as error:
        return f"{path}: {error.strerror}"
    if not stat.S_ISCHR(status.st_mode):
        return f"{path} is no serial port"
    if os.access(path, os.R_OK | os.W_OK):
        return ""
    try:
        group = grp.getgrgid(status.st_gid).gr_name
    except KeyError:
        group = str(status.st_gid)
    return (
        f"{path}: no permission: it belongs to the group {group}, and you are not in it; "
        f"sudo adduser $USER {group}, then log in anew"
    )


def find_autopilot(tried: Iterable[Port], say: Callable[[str], None]) -> tuple[str, int]:
    """Return the LINK where an autopilot is heard, and its system id.

    Raises:
        LinkError: none is, with the reason and the remedy in a line.
    """
    troubles = []
    candidates = list(tried)
    for port in candidates:
        if port.trouble:
            troubles.append(port.trouble)
            continue
        for baud in BAUDS:
            link = f"{port.path}:{baud}"
            say(f"listening on {link}")
            system, trouble = heard(link)
            if system is not None:
                return link, system
            if trouble:
                troubles.append(f"{port.path}: {trouble}; end that, or share the port by mavlink-router")
                break
    if not candidates:
        raise LinkError(f"there is no serial port here; {WIRE}")
    if troubles:
        raise LinkError("; ".join(troubles))
    names = ", ".join(str(port.path) for port in candidates)
    raise LinkError(
        f"no autopilot is heard on {names}: is it on, are RX and TX crossed, is SERIALn_PROTOCOL 2? "
        "Or name the link: --link"
    )


def heard(link: str) -> tuple[int | None, str]:
    """Return the system id of the autopilot on a link, None when none is heard, and why the port cannot be opened."""
    from companion.clock import run
    from companion.mavlink.link import Link
    from companion.mavlink.reception import TOOL_COMPONENT, LinkIdentity
    from companion.mavlink.transports import TransportState, open_link

    async def listen() -> tuple[int | None, str]:
        transport = open_link(link)
        async with Link(transport, identity=LinkIdentity(component=TOOL_COMPONENT)) as connected:
            try:
                return (await connected.wait_autopilot(LISTEN_S)).target_system, ""
            except CompanionError as error:
                if transport.state is not TransportState.OPEN:
                    return None, transport.stats.last_error
                return None, "" if "no autopilot in" in str(error) else str(error)

    return run(listen())
