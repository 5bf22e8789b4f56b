"""``sitl hostile``: forges what the companion reads, beside a boat of yours, or to measure what comes of it."""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path

from companion.errors import InputError
from companion.program.arguments import add_command, number, system_id, whole

MAX_COUNT, MAX_RATE_HZ, MAX_S = 100_000, 500.0, 3600.0
LOOPBACK = ("127.0.0.1", "localhost", "::1")

_EXAMPLE = f"""examples:
  sitl hostile --list
  sitl hostile                                       measure all, print the table message x effect
  sitl hostile --document docs/reference/mavlink.md            ... and write it there, between its marks

  sitl boat --warm --moored &                        a boat, on UDP 14555
  companion run MISSION.toml --link udpin:127.0.0.1:14551 &
  sitl hostile --boat udpout:127.0.0.1:14555 --companion udpout:127.0.0.1:14551 --message HEARTBEAT --listen

With --boat and --companion it stands between the two, passes on what they say, and adds its own; when all is forged it
goes on passing on until the time is over. On the loopback only, at most {MAX_RATE_HZ:g} frames a second, {MAX_COUNT}
frames and {MAX_S:g} s: it is a test, not a weapon.
"""


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser], summary: str) -> None:
    """Add the command."""
    parser = add_command(subparsers, "hostile", summary, _EXAMPLE)
    parser.add_argument("--list", action="store_true", help="name the forgeries and end")
    parser.add_argument("--document", type=Path, metavar="FILE", help="write the measured table into FILE")
    parser.add_argument("--boat", metavar="LINK", help="the boat's port: udpout:127.0.0.1:14555, tcp:127.0.0.1:5760")
    parser.add_argument("--companion", metavar="LINK", help="where the companion listens: udpout:127.0.0.1:14551")
    parser.add_argument("--system", type=system_id, default=1, metavar="N", help="the boat's system id (1)")
    parser.add_argument(
        "--message",
        action="append",
        default=[],
        metavar="NAME",
        help="forge this message; may be given more than once (default: every one in turn)",
    )
    parser.add_argument("--listen", action="store_true", help="use the boat's own boot time and frame numbers")
    parser.add_argument("--signing-key", type=Path, metavar="FILE", help="sign the forgeries: the forger has the key")
    parser.add_argument(
        "--sign-boat",
        type=Path,
        metavar="FILE",
        help="sign what the boat says, which has no key of its own, for a companion with --signing-key",
    )
    parser.add_argument(
        "--rate", type=number("Hz", above=0.0, at_most=500.0), default=5.0, metavar="HZ", help="frames a second (5)"
    )
    parser.add_argument(
        "--count", type=whole(at_least=1, at_most=100_000), default=100, metavar="N", help="forge so many frames (100)"
    )
    parser.add_argument(
        "--for", dest="for_s", type=number("s", above=0.0), default=600.0, metavar="S", help="end after S seconds (600)"
    )
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Run the command."""
    from lab.campaigns.reads import ASHORE, READS
    from sitl.faults import FORGERIES

    if args.list:
        for forgery in FORGERIES:
            print(f"{forgery.message:<24} {forgery.says:<44} read by {', '.join(READS[forgery.message])}")
        print(f"read ashore only, by `companion status`: {', '.join(sorted(ASHORE))}")
        return 0
    if args.boat is None and args.companion is None:
        return _measure(args.document)
    if args.boat is None or args.companion is None:
        raise InputError("--boat, --companion", "", "only one of them is given", "it stands between the two")
    return _stand_between(args)


def _measure(document: Path | None) -> int:
    """Measure all forgeries and print, or write, the table."""
    from lab.campaigns.hostile import HOSTILITIES, measure, rows, written

    try:
        text = None if document is None else document.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError("--document", str(document), f"cannot be read ({error})") from error
    if text is not None:
        written(text, ())  # before minutes are spent on it
    effects = {}
    with tempfile.TemporaryDirectory() as folder:
        for who in HOSTILITIES:
            sys.stderr.write(f"sitl hostile: {who.name} ...\n")
            effects[who.name] = measure(who, Path(folder) / who.name)
    lines = rows(effects)
    if document is None or text is None:
        print("\n".join(lines))
        return 0
    document.write_text(written(text, lines), encoding="utf-8")
    print(f"{document}: written")
    return 0


def _stand_between(args: argparse.Namespace) -> int:
    """Forge on a live link."""
    from companion.clock import run as run_loop
    from companion.mavlink.transports import parse_link
    from lab.campaigns.reads import READS
    from lab.campaigns.signed_link import ManInTheMiddle, SpoofingPlan
    from sitl.faults import FORGERIES

    for option, value, low, high in (
        ("--rate", args.rate, 0.0, MAX_RATE_HZ),
        ("--count", args.count, 0, MAX_COUNT),
        ("--for", args.for_s, 0.0, MAX_S),
    ):
        if not low < value <= high:
            raise InputError(option, f"{value:g}", f"is not above {low:g} and at most {high:g}")
    for option, text in (("--boat", args.boat), ("--companion", args.companion)):
        if parse_link(text).host not in LOOPBACK:
            raise InputError(option, text, "is not on the loopback", f"it forges to {' or '.join(LOOPBACK)} only")
    for name in args.message:
        if name not in READS:
            raise InputError("--message", name, "is nothing that the companion reads", "see sitl hostile --list")
    forgeries = tuple(f for f in FORGERIES if not args.message or f.message in args.message)
    if not forgeries:
        raise InputError("--message", ", ".join(args.message), "is read ashore only", "see sitl hostile --list")
    plan = SpoofingPlan(
        forgeries=forgeries,
        rate_hz=args.rate,
        count=args.count,
        for_s=args.for_s,
        system=args.system,
        listens=args.listen,
        key=args.signing_key,
        boat_key=args.sign_boat,
    )
    middle = ManInTheMiddle(args.boat, args.companion, plan)
    try:
        run_loop(middle.run())
    finally:
        print(f"{middle.sent} frames forged, {middle.passed} bytes of the boat passed on")
    return 0
