"""``companion far order``: makes an order of 24 bytes, with a counter that is never used twice."""

from __future__ import annotations

import argparse
import contextlib
import fcntl
import os
import time
from collections.abc import Iterator
from pathlib import Path

from companion.commands.far.moments import moment
from companion.commands.output import refuse_existing, write_files
from companion.errors import InputError, JobError

COUNTER = ".far-counter"     # beside the key: the last counter that was used with it


def run_order(args: argparse.Namespace) -> int:
    """Run the command."""
    from companion.mavlink.transports import read_key
    from companion.orders.far import FarKey, FarOrder, minutes_of, pack_order
    from companion.orders.phrase import phrase

    wanted, key = phrase(args.words), FarKey(read_key(args.key), args.system)
    if args.out is not None:
        refuse_existing([str(args.out)], force=args.force)
    # The last minute in which it counts is whole: what is cut off is given on top.
    expires_min = minutes_of(time.time() + args.expires) + 1
    with _alone_with(args.key):
        counter = _next_counter(args.key, args.counter)
        try:
            data = pack_order(FarOrder(wanted=wanted, counter=counter, expires_min=expires_min), key)
        except ValueError as error:
            raise InputError(" ".join(args.words)[:40], "", str(error)) from None
        _keep_counter(args.key, counter)    # before anybody can send it: a counter is never used twice
    if args.out is not None:
        write_files({str(args.out): data}, force=args.force)
    print(data.hex())
    print(f"order {counter}: {wanted.words}, counts until {moment(expires_min)}")
    return 0


@contextlib.contextmanager
def _alone_with(key: Path) -> Iterator[None]:
    """Let two that give orders with one key at once have one counter each."""
    fd = os.open(key, os.O_RDONLY | os.O_CLOEXEC)
    try:
        fcntl.flock(fd, fcntl.LOCK_EX)
        yield
    finally:
        os.close(fd)


def _next_counter(key: Path, given: int | None) -> int:
    from companion.orders.far import MOST_COUNTER

    path = key.with_name(key.name + COUNTER)
    try:
        last = int(path.read_text("ascii"))
    except FileNotFoundError:
        last = 0
    except (OSError, ValueError) as error:
        if given is None:
            raise InputError(str(path), "", f"the last counter cannot be read ({error})",
                             "name one with --counter: more than the last that the boat's status tells") from error
        last = 0
    if given is None and last >= MOST_COUNTER:
        raise JobError(f"{key}: all {MOST_COUNTER} counters are used up; make a new key, for the boat too")
    return last + 1 if given is None else given


def _keep_counter(key: Path, counter: int) -> None:
    from companion.disk import Disk, reason

    path = key.with_name(key.name + COUNTER)
    try:
        Disk().replace(path, f"{counter}\n".encode("ascii"))
    except OSError as error:
        raise JobError(f"{path}: cannot be written ({reason(error)}), and without it a counter would be used twice") \
            from error
