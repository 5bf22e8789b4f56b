"""The options of ``companion setup``, and its course: look, ask, write, examine."""

from __future__ import annotations

import argparse
import re
import sys
from argparse import ArgumentTypeError
from collections.abc import Callable
from pathlib import Path
from typing import Any

from companion.errors import CompanionError, InputError, JobError
from companion.program.arguments import number, place, system_id

FOLDER = Path("/etc/companion")
NO_GO_DEG = number("deg", at_least=20.0, at_most=80.0)

_EPILOG = """\
examples:
  companion setup                                     asks
  companion setup lake --yes --start 50.8170,-1.3100 --goal 50.8200,-1.3094
  companion setup pond --link udpin:0.0.0.0:14550 --drawn --yes
Exit codes: 0 written and nothing in the way, 1 written and the doctor found an error, 2 nothing was written.
"""


def instance(text: str) -> str:
    """Take the name of an instance of the unit."""
    if re.fullmatch(r"[a-z0-9][a-z0-9-]{0,40}", text) is None:
        raise ArgumentTypeError(f"{text!r} is no name of an instance; lower-case letters, digits and - make one")
    return text


def add_parser(subparsers: Any, summary: str) -> None:
    """Add the command."""
    parser = subparsers.add_parser(
        "setup", help=summary, epilog=_EPILOG, formatter_class=argparse.RawDescriptionHelpFormatter,
        description="Look for the autopilot on the serial ports, ask what is not given as an option, write a mission "
        "and the settings of its instance of the unit (NAME.toml, NAME.env), and run the doctor. Nothing else is "
        "changed, neither here nor on the autopilot.",
    )
    parser.add_argument("name", type=instance, nargs="?", metavar="NAME",
                        help="of the mission and its instance, companion@NAME (default: boat)")
    parser.add_argument("--link", metavar="LINK", help="to the autopilot (default: the serial ports are looked at)")
    parser.add_argument("--system", type=system_id, metavar="N",
                        help="the autopilot's MAVLink system id (default: of the one that is heard)")
    parser.add_argument("--start", type=place, metavar="LAT,LON", help="where the boat will start")
    parser.add_argument("--goal", type=place, action="append", default=[], metavar="LAT,LON",
                        help="where it is to sail; repeat it for more, in order")
    parser.add_argument("--drawn", action="store_true",
                        help="the goals are drawn in a ground station and uploaded to the autopilot")
    parser.add_argument("--polar", type=Path, metavar="FILE", help="of the boat (default: the simulator's boat)")
    parser.add_argument("--no-go", type=NO_GO_DEG, metavar="DEG",
                        help="what the boat can sail to the wind (default: 47)")
    parser.add_argument("--dir", type=Path, default=FOLDER, metavar="DIR",
                        help=f"where the unit looks (default: {FOLDER})")
    parser.add_argument("--yes", action="store_true", help="ask nothing: the defaults hold where nothing is given")
    parser.add_argument("--force", action="store_true", help="take the place of files that are there")
    parser.add_argument("--no-doctor", action="store_true", help="do not examine the autopilot")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Run the command."""
    from companion.commands.output import refuse_existing
    from companion.commands.setup.files import mission_of, settings_of, write

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
    args.no_go = args.no_go or ask("how near to the wind she sails [deg]", 47.0, NO_GO_DEG)
    written = write(args.dir, args.name, mission_of(args, system), settings_of(link), args.polar)
    for path in written:
        print(f"{path}: written")
    code = 0 if args.no_doctor else _examine(written[0], link, system)
    print(f"[operator] of {written[0]} permits nothing yet. To start: "
          f"sudo systemctl enable --now companion@{args.name}")
    return code


def _room(folder: Path) -> None:
    """Raise JobError where there is no folder, or no room on its card."""
    from companion.disk import Disk

    if not folder.is_dir():
        raise InputError(str(folder), "", "no such folder", "make it, or name another with --dir")
    room = Disk().room(folder)
    if room.is_short:
        raise JobError(f"{folder}: the card is full ({room.free_bytes / 1e6:.1f} MB left); make room: sudo apt clean, "
                       "sudo journalctl --vacuum-size=50M")


def _link(args: argparse.Namespace, ask: Questions) -> tuple[str, int | None]:
    """Return the link and the system id of the autopilot on it."""
    from companion.commands.setup.ports import find, ports
    from companion.errors import LinkError
    from companion.mavlink.transports import parse_link

    if args.link is not None:
        return parse_link(args.link).text, args.system
    try:
        link, system = find(ports(), lambda text: print(text, file=sys.stderr))
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
                raise InputError("companion setup", "", f"not given: {what}",
                                 "name it: --start, --goal, --drawn, --link")
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
