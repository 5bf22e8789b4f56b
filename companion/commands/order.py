"""``companion order``: give an order to the companion on board, over the radio, and print its answer."""

from __future__ import annotations

import argparse
import asyncio
import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from companion.commands.output import force_option, write_files
from companion.errors import InputError
from companion.orders import TABLE, phrase
from companion.program.arguments import number, radio_options

if TYPE_CHECKING:
    from companion.orders import Answer, Wanted

EXIT_REFUSED, EXIT_NO_ANSWER = 1, 3

_EPILOG = """\
orders (* stands until go_on, or another order that stands):
{verbs}

Which of them the boat takes is in the mission that she sails: [operator] orders = ["hold", ...], local_orders for
those given on board; default none; why is always answered. The same order again within 10 s gets the same answer and
nothing is done twice.

examples:
  companion order hold --link /dev/ttyUSB0:57600
  companion order goal 50.8195 -1.3080 --link udpin:0.0.0.0:14550
  companion order refuge Mill Bay --link tcp:127.0.0.1:5762 --system 3
  companion order hold --socket boat.sock      (on board, beside companion run --socket boat.sock)
  companion order --qgc Orders.json      (buttons for QGroundControl; for its folder MavlinkActions)

Exit codes: 0 done, 1 refused (the answer says why), 2 bad usage, 3 no link or no answer: it may have been taken all
the same, ask why.
"""


def add_parser(subparsers: Any, summary: str) -> None:
    """Add the command."""
    lines = "\n".join(
        f"  {'*' if row.stands else ' '} {f'{row.verb} {row.takes}'.rstrip():<15} {row.means}" for row in TABLE
    )
    parser = subparsers.add_parser(
        "order",
        help=summary,
        description="Give an order to the companion on board and print its answer. It is sent through the autopilot's "
        "link and repeated until it is acknowledged. Speaks as system 254: never as a ground station whose silence "
        "afterwards would set off the autopilot's failsafe.",
        epilog=_EPILOG.format(verbs=lines),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("words", nargs="*", metavar="VERB [ARGS]", help="the order, see below")
    radio_options(parser, required=False)
    parser.add_argument("--socket", type=Path, metavar="PATH", help="on board, in place of a link: as the companion's")
    parser.add_argument(
        "--timeout",
        type=number("s", above=0.0),
        default=15.0,
        metavar="S",
        help="for the autopilot to be heard, and again for the answer (default: 15)",
    )
    parser.add_argument("--signing-key", type=Path, metavar="FILE", help="MAVLink signing key (mode 0600)")
    parser.add_argument("--qgc", type=Path, metavar="FILE", help="write QGroundControl's buttons and end")
    force_option(parser)
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Run the command."""
    if args.qgc is not None:
        return _write_buttons(args)
    wanted = phrase(args.words)
    if (args.link is None) == (args.socket is None):
        raise InputError(
            "--link",
            "",
            "is missing: there is nobody to give the order to"
            if args.link is None
            else "and --socket are two ways for one order",
            "name the link of the radio, as --link /dev/ttyUSB0:57600, or on board --socket PATH",
        )
    from companion.clock import run as run_loop
    from companion.errors import LinkError
    from companion.orders import Result

    try:
        answer = run_loop(_give(args, wanted))
    except LinkError as error:
        sys.stderr.write(f"companion order: {error}\n")
        return EXIT_NO_ANSWER
    if answer.result is Result.NO_ANSWER:
        sys.stderr.write(
            f"companion order: {answer.text} from the companion; `companion status` says whether it is heard\n"
        )
        return EXIT_NO_ANSWER
    is_done = answer.result is Result.DONE
    print(f"{wanted.words}: {'' if is_done else f'{answer.result.value}: '}{answer.text}")
    return 0 if is_done else EXIT_REFUSED


async def _give(args: argparse.Namespace, wanted: Wanted) -> Answer:
    if args.socket is not None:
        return await give_on_board(args.socket, " ".join(args.words), args.timeout)
    import time

    from companion.mavlink.link import Link
    from companion.mavlink.reception import SHORE
    from companion.mavlink.signing import SigningStore
    from companion.mavlink.transports import open_link
    from companion.orders import give

    signing = None if args.signing_key is None else SigningStore(args.signing_key, time.time())
    async with Link(
        open_link(args.link), identity=SHORE, target_system=args.system, streams=(), is_quiet=True, signing=signing
    ) as link:
        await link.wait_autopilot(args.timeout)
        return await give(link, wanted, give_up_s=args.timeout)


def require_socket(path: Path) -> None:
    """Raise InputError for what is there and is no socket; what is not there yet may come."""
    if path.is_dir():
        raise InputError(str(path), "", "is a folder", "name the socket in it, as companion run --socket does")
    if path.exists() and not path.is_socket():
        raise InputError(str(path), "", "is no socket", "name the one that companion run --socket made")


async def give_on_board(path: Path, words: str, give_up_s: float) -> Answer:
    """Give an order at the socket of a companion on board. Raises LinkError: it is not there."""
    from companion.disk import reason
    from companion.errors import LinkError
    from companion.orders import Answer, Result

    require_socket(path)
    try:
        async with asyncio.timeout(give_up_s):
            reader, writer = await asyncio.open_unix_connection(path)
            writer.write(words.encode() + b"\n")
            line = await reader.readline()
            writer.close()
    except TimeoutError:
        return Answer(result=Result.NO_ANSWER, text=f"no answer within {give_up_s:g} s")
    except OSError as error:
        raise LinkError(f"{path}: {reason(error)}; is the companion running with --socket?") from error
    if not line:
        raise LinkError(f"{path}: the companion has hung up")
    told = json.loads(line)
    return Answer(result=Result(told["result"]), text=str(told["text"]))


def _write_buttons(args: argparse.Namespace) -> int:
    from companion.orders import qgc_actions

    if args.words:
        raise InputError("--qgc", "", "writes buttons and gives no order", "leave out the verb")
    write_files({str(args.qgc): qgc_actions().encode()}, force=args.force)
    print(f"{args.qgc}: copy it into QGroundControl's folder MavlinkActions and choose it in its Fly View settings")
    return 0
