"""``companion far order`` and ``begin``: orders of 24 bytes, each with a counter of its own, counted anew."""

from __future__ import annotations

import argparse
import contextlib
import fcntl
import os
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from companion.commands.far.moments import moment
from companion.commands.output import refuse_existing, write_files
from companion.errors import InputError, JobError

COUNTER = ".far-counter"     # beside the key: the last counter that was used with it, and since which beginning


@dataclass(frozen=True, slots=True)
class _Count:
    """The last counter that was used, 0: none, since the beginning at the minute ``began``, 0: there was none."""

    last: int = 0
    began: int = 0


def run_order(args: argparse.Namespace) -> int:
    """Run the command."""
    from companion.mavlink.transports import read_key
    from companion.orders.far import FarKey, FarOrder, pack_order
    from companion.orders.phrase import phrase

    wanted, key = phrase(args.words), FarKey(read_key(args.key), args.system)
    if args.out is not None:
        refuse_existing([str(args.out)], force=args.force)
    expires_min = _expires_min(args)
    with _alone_with(args.key):
        count = _next_count(args.key, args.counter)
        try:
            data = pack_order(FarOrder(wanted=wanted, counter=count.last, expires_min=expires_min),
                              key.since(count.began))
        except ValueError as error:
            raise InputError(" ".join(args.words)[:40], "", str(error)) from None
        _keep_count(args.key, count)    # before anybody can send it: a counter is never used twice
    _hand_out(args, data)
    print(f"order {count.last}: {wanted.words}, counts until {moment(expires_min)}")
    return 0


def run_begin(args: argparse.Namespace) -> int:
    """Run the command."""
    from companion.mavlink.transports import read_key
    from companion.orders.far import Beginning, FarKey, minutes_of, pack_beginning

    key = FarKey(read_key(args.key), args.system)
    if args.out is not None:
        refuse_existing([str(args.out)], force=args.force)
    expires_min, now_min = _expires_min(args), minutes_of(time.time())
    with _alone_with(args.key):
        count, _ = _read_count(args.key)
        # One of a clock that was wrong ashore is not counted on from: the boat has refused it.
        began = count.began + 1 if now_min <= count.began < now_min + 60 else now_min
        data = pack_beginning(Beginning(began=began, expires_min=expires_min), key)
        _keep_count(args.key, _Count(0, began))
    _hand_out(args, data)
    print(f"beginning of {moment(began)}, counts until {moment(expires_min)}: send it again until a status tells "
          "it; the next order is number 1, and what was given before does not count any more")
    return 0


def _expires_min(args: argparse.Namespace) -> int:
    from companion.orders.far import minutes_of

    # The last minute in which it counts is whole: what is cut off is given on top.
    return minutes_of(time.time() + args.expires) + 1


def _hand_out(args: argparse.Namespace, data: bytes) -> None:
    if args.out is not None:
        write_files({str(args.out): data}, force=args.force)
    print(data.hex())


@contextlib.contextmanager
def _alone_with(key: Path) -> Iterator[None]:
    """Let two that give orders with one key at once have one counter each."""
    fd = os.open(key, os.O_RDONLY | os.O_CLOEXEC)
    try:
        fcntl.flock(fd, fcntl.LOCK_EX)
        yield
    finally:
        os.close(fd)


def _read_count(key: Path) -> tuple[_Count, str]:
    """Return what is kept beside the key, and why it cannot be believed, empty: it can, or there is none yet."""
    from companion.orders.far import MOST_COUNTER

    path = key.with_name(key.name + COUNTER)
    try:
        text = path.read_text("ascii")
        last, began = [int(word) for word in f"{text} 0".split()[:2]]
        if not (0 <= last <= MOST_COUNTER and 0 <= began < 1 << 24):
            return _Count(), f"{text.strip()[:20]!r} is no counter"
    except FileNotFoundError:
        return _Count(), ""
    except (OSError, ValueError) as error:
        return _Count(), str(error)
    return _Count(last, began), ""


def _next_count(key: Path, given: int | None) -> _Count:
    from companion.orders.far import MOST_COUNTER, MOST_JUMP

    count, trouble = _read_count(key)
    if given is None and trouble:
        raise InputError(str(key.with_name(key.name + COUNTER)), "", f"the last counter cannot be read ({trouble})",
                         "count from 1 again: companion far begin; or name one with --counter: one more than the "
                         "last that the boat's status tells")
    if given is None and count.last >= MOST_COUNTER:
        raise JobError(f"{key}: all {MOST_COUNTER} counters are used up; count from 1 again: companion far begin")
    if given is not None and count.last and given > count.last + MOST_JUMP:
        raise InputError("--counter", str(given), f"is more than {MOST_JUMP} ahead of the last, {count.last}, and the "
                         "boat takes no such", "where she has another count, begin anew: companion far begin")
    return _Count(count.last + 1 if given is None else given, count.began)


def _keep_count(key: Path, count: _Count) -> None:
    from companion.disk import Disk, reason

    path = key.with_name(key.name + COUNTER)
    try:
        Disk().replace(path, f"{count.last}{f' {count.began}' if count.began else ''}\n".encode("ascii"))
    except OSError as error:
        raise JobError(f"{path}: cannot be written ({reason(error)}), and without it a counter would be used twice") \
            from error
