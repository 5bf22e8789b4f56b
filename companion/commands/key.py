"""``companion key``: make a signing key, put it on the autopilot, take it off again.

MAVLink 2 signing keeps strangers out: with a key on the autopilot's ports and here, what is not signed with it counts
for nothing. ArduPilot takes a key while disarmed and acknowledges nothing; so what is said here was seen.
"""

from __future__ import annotations

import argparse
import asyncio
import functools
import sys
import time
from collections.abc import AsyncIterator, Callable, Coroutine
from contextlib import asynccontextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from companion.errors import InputError, JobError, LinkError
from companion.program.arguments import add_command, system_id

if TYPE_CHECKING:
    from companion.mavlink.autopilot import Autopilot
    from companion.mavlink.signing import SigningStore
    from companion.mavlink.transports import Transport

    Opens = Callable[[], Transport]

_EPILOG = """\
examples:
  companion key new boat.key
  companion key new boat.key --passphrase                 (asks for it: a ground station takes the same one)
  companion key set boat.key --link /dev/ttyACM0
  companion run mission.toml --link /dev/serial0:921600 --signing-key boat.key
  companion key remove boat.key --link /dev/ttyACM0

The key travels unprotected when it is set: do that over the USB cable, with the boat disarmed. ArduPilot then signs on
every port and refuses what is not signed on all but USB. Mission Planner and QGroundControl make the key of a
passphrase: give them the one that was asked for by 'key new --passphrase'.
Exit codes: 0 done and seen, 1 not, 2 an invalid file or option.
"""
WAIT_S = 15.0  # for the autopilot
TRIES = 3  # a link may lose the one message
TAKES_S = 0.5  # for the key to be taken up
ANSWERS_S = 6.0  # a signed autopilot answers within this
# The autopilot takes a key's time up a minute ahead, and refuses a newcomer more than a minute behind it.
BEHIND_TICKS = 60 * 100_000


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser], summary: str) -> None:
    """Add the command with its three verbs."""
    parser = add_command(subparsers, "key", summary, _EPILOG)
    verbs = parser.add_subparsers(dest="verb", metavar="new|set|remove", required=True)
    new = verbs.add_parser("new", help="make a key file that only you can read")
    new.add_argument("file", type=Path, metavar="FILE")
    new.add_argument("--passphrase", action="store_true", help="ask for a passphrase; default: a random key")
    new.set_defaults(run=_new)
    for name, work, text in (("set", put_on, "put a key on the autopilot"), ("remove", take_off, "take it off again")):
        verb = verbs.add_parser(name, help=text)
        verb.add_argument("file", type=Path, metavar="FILE", help="the key")
        verb.add_argument("--link", required=True, metavar="LINK", help="best the USB cable: /dev/ttyACM0")
        verb.add_argument("--system", type=system_id, metavar="N", help="system id of the autopilot")
        verb.add_argument("--yes", action="store_true", help="do not ask")
        verb.set_defaults(run=functools.partial(_run, work))


def _new(args: argparse.Namespace) -> int:
    from companion.mavlink.signing import make_key

    make_key(args.file, _asked_passphrase() if args.passphrase else "")
    print(f"{args.file}: a new key, which only you can read; keep a copy where the boat is not")
    return 0


def _run(work: Callable[..., Coroutine[None, None, str]], args: argparse.Namespace) -> int:
    from companion.clock import run as run_loop
    from companion.mavlink.signing import SigningStore
    from companion.mavlink.transports import open_link

    store = SigningStore(args.file, time.time())
    opens = functools.partial(open_link, args.link)
    print(run_loop(work(opens, store, system=args.system, asks=not args.yes, name=str(args.file))))
    return 0


def _asked_passphrase() -> str:
    from getpass import getpass

    first = getpass("passphrase: ") if sys.stdin.isatty() else sys.stdin.readline()
    if not first.strip():
        raise InputError("--passphrase", "", "it is empty", "give one, or leave the option out for a random key")
    if sys.stdin.isatty() and getpass("once more: ") != first:
        raise InputError("--passphrase", "", "the two are not the same", "try again")
    return first


async def put_on(link: Opens, store: SigningStore, *, system: int | None, asks: bool, name: str) -> str:
    """Put a key on the autopilot and return what was seen. Raises LinkError and JobError."""
    async with _connected(link, None, system) as (autopilot, who):
        is_signed = autopilot.link.is_signed
        if not is_signed:
            await _require_disarmed(autopilot)
            _ask(asks, f"put {name} on the autopilot, {who}; the key goes over this link as it is")
    if is_signed:
        if await _answers(link, store, system):
            return f"{who} signs with this key already"
        raise JobError(f"{who} signs with another key: take that one off first (companion key remove)")
    for _ in range(TRIES):
        async with _connected(link, None, system) as (autopilot, _):
            _tell(autopilot, store.state.key, max(1, store.state.timestamp - BEHIND_TICKS))
            await asyncio.sleep(TAKES_S)
        if await _answers(link, store, system):
            return f"{who} signs with {name} and answers what is signed with it"
    raise JobError(f"{who} does not sign with {name}: it takes a key only while disarmed, over a link of MAVLink 2")


async def take_off(link: Opens, store: SigningStore, *, system: int | None, asks: bool, name: str) -> str:
    """Take the autopilot's key off and return what was seen. Raises LinkError and JobError."""
    async with _connected(link, store, system) as (autopilot, who):
        await _require_disarmed(autopilot)
        _ask(asks, f"take {name} off the autopilot, {who}: anybody who can send to it can then order the boat")
    for _ in range(TRIES):
        async with _connected(link, store, system) as (autopilot, _):
            _tell(autopilot, bytes(32), 0)
            await asyncio.sleep(TAKES_S)
        async with _connected(link, None, system) as (autopilot, _):
            if not autopilot.link.is_signed:
                return f"{who} does not sign any more: what anybody sends counts again"
    raise JobError(f"{who} signs still")


@asynccontextmanager
async def _connected(
    link: Opens, store: SigningStore | None, system: int | None, wait_s: float = WAIT_S
) -> AsyncIterator[tuple[Autopilot, str]]:
    from companion.mavlink.autopilot import Autopilot
    from companion.mavlink.link import Link
    from companion.mavlink.reception import TOOL_COMPONENT, LinkIdentity

    own = LinkIdentity(component=TOOL_COMPONENT)
    async with (
        Link(link(), identity=own, target_system=system, streams=(), signing=store) as heard,
        Autopilot(heard, timeout_s=wait_s) as autopilot,
    ):
        yield autopilot, f"system {heard.party.target_system}"


async def _answers(link: Opens, store: SigningStore, system: int | None) -> bool:
    """Return whether the autopilot signs with the key and answers what is signed with it."""
    try:
        async with _connected(link, store, system, ANSWERS_S) as (autopilot, _):
            return (await autopilot.get_parameter("WP_RADIUS")).is_ok
    except LinkError:
        return False


def _tell(autopilot: Autopilot, key: bytes, timestamp: int) -> None:
    from pymavlink.dialects.v20 import ardupilotmega as wire

    party = autopilot.link.party
    autopilot.link.send(
        wire.MAVLink_setup_signing_message(party.target_system, party.target_component, list(key), timestamp)
    )


async def _require_disarmed(autopilot: Autopilot) -> None:
    status = await autopilot.first_status()
    if status is None or status.is_armed:
        raise JobError("the boat is armed: the autopilot takes and gives up a key only while disarmed")


def _ask(asks: bool, what: str) -> None:
    if not asks:
        return
    if not sys.stdin.isatty():
        raise InputError("--yes", "", f"is not said, and no terminal is here to ask: {what}?", "say it")
    if input(f"{what}? [y/N] ").strip().lower() not in {"y", "yes"}:
        raise JobError("nothing was changed")
