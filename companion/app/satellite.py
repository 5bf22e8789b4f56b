"""The mailbox of a satellite modem: orders out of ``in``, the newest status into ``out``, whole files in one folder.

The modem's program puts each message that it has received into ``in`` under a name of its own, by renaming, and sends
what it finds as ``out/status``, and may take it away. So each side may stop, or lose its power, whenever it likes.
Names that begin with a dot or end in .new, .tmp or .part are not whole yet. A message that cannot be read, or that
cannot be judged, is put into ``aside`` by itself: the others are read as ever.

An order that was taken is on the disk (``taken.json``) before it is carried out: after a power cut it may be lost, and
the next status says so, but it is never carried out twice. A disk that cannot keep it does not stop it: what is asked
from far away may be what saves the boat.
"""

from __future__ import annotations

import asyncio
import json
import math
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any, Protocol

from companion.app.options import Offload, SatelliteLink
from companion.clock import now_s
from companion.disk import NEW, Disk, read_regular, reason
from companion.fold import Step
from companion.messages import CompanionStatus, Severity
from companion.orders import FAR, Answer, Wanted
from companion.orders.far import (
    BEGINNING_SIZE,
    FarKey,
    FarOrder,
    Reply,
    Taken,
    begun,
    judged,
    pack_status,
    reply_of,
    unpack_beginning,
    unpack_order,
)
from companion.telemetry.status import far_status

LOOK_S = 5.0  # into the folder
MOST = 20  # files in one look: a flood waits
MOST_BYTES = 1000  # no message of ours is as long, by far
SAY_EVERY_S = 600.0  # the same words
TRIES = 3  # looks at a file that cannot be read before it is put aside: a sick card may read it at the next
MOST_ASIDE = 20  # files that are kept aside; further ones take the place of the one before them
MOST_NAME = 30  # characters of a file's name that are told
MOST_TAKEN = 100_000  # bytes of what was taken: a window of it has 4,000
UNFINISHED = (NEW, ".tmp", ".part")
IN, OUT, TAKEN, ASIDE = "in", "out/status", "taken.json", "aside"

Seen = tuple[CompanionStatus, Step]
_Mark = tuple[int, int]  # of a file: when it was changed, and which it is


class OrderHandler(Protocol):
    """Who carries out orders, and answers (``companion.app.local_clients.OperatorCommands``)."""

    async def ask(self, wanted: Wanted, number: int, way: str) -> Answer:
        """Give an order and return its answer."""
        ...


class SatelliteMailbox:
    """The folder and what was taken of it. ``run`` lives in the voyage's task group.

    Args:
        far: the folder, the key, and how often a status is put out.
        system: the autopilot's system id: what is sealed for another is no order of ours.
        operator: who carries orders out.
        seen: returns the newest status and step, None before there is one.
        is_heard: whether the autopilot is.
        say, record: for the radio, and for the voyage's records.
        has_trouble: whether the disk does not keep what it should.
    """

    def __init__(
        self,
        far: SatelliteLink,
        system: int,
        operator: OrderHandler,
        *,
        disk: Disk,
        offload: Offload,
        is_durable: bool,
        seen: Callable[[], Seen | None],
        is_heard: Callable[[], bool],
        has_trouble: Callable[[], bool],
        say: Callable[[int, str], None],
        record: Callable[[dict[str, Any]], None],
    ) -> None:
        self._far, self._key, self._crew = far, FarKey(far.key, system), operator
        self._disk, self._offload, self._is_durable = disk, offload, is_durable
        self._seen, self._is_heard, self._has_trouble = seen, is_heard, has_trouble
        self._say, self._record = say, record
        self._taken = Taken()
        self._last: tuple[int | None, Reply] | None = None  # the counter, None: of a beginning
        self._sequence = 0
        self._said_s: dict[str, float] = {}
        self._stuck: dict[str, _Mark] = {}  # files that cannot be removed, as they were when they were read
        self._tries: dict[str, int] = {}  # of files that cannot be read

    async def run(self) -> None:
        """Read and write until cancelled."""
        await self._begin()
        next_s = now_s()
        while True:
            try:
                has_news = await self._take_orders()
                if self._seen() is not None and (has_news or now_s() >= next_s):
                    next_s = now_s() + self._far.every_s
                    await self._put_out()
            except Exception as error:  # a fault of ours here must not end the voyage
                self._tell(Severity.ERROR, f"the satellite link: {error!r}")
            await asyncio.sleep(LOOK_S)

    # ------------------------------------------------------------------------------------------------ disk
    async def _work(self, work: Callable[[], None]) -> None:
        """Do disk work where it does not hold the loop; trouble is said, and never worth the voyage."""
        trouble: list[OSError] = []

        def guarded() -> None:
            try:
                work()
            except OSError as error:
                trouble.append(error)

        await self._offload(guarded)
        for error in trouble:
            self._tell(Severity.WARNING, f"the folder of the satellite link: {error.filename or ''} {reason(error)}")

    async def _begin(self) -> None:
        """Make the folders, and read what was taken before this start."""
        path, found = self._far.folder / TAKEN, []

        def work() -> None:
            self._disk.make_folder(self._far.folder / IN)
            self._disk.make_folder((self._far.folder / OUT).parent)
            if path.exists():
                found.append(read_regular(path, MOST_TAKEN, follows_links=False))

        await self._work(work)
        for data in found:
            try:
                self._taken = Taken.from_dict(json.loads(data), self._key.name)
            except (ValueError, RecursionError) as error:
                self._tell(
                    Severity.WARNING,
                    f"{TAKEN} is not used: {error}; what was taken before this start and has "
                    "not expired would count again",
                )
        self._key = self._key.since(self._taken.began)
        if self._taken.highest:
            self._last = self._taken.highest, self._taken.replies[self._taken.highest][1]
        elif self._taken.began:
            self._last = None, Reply.BEGUN

    async def _keep(self, taken: Taken) -> None:
        self._taken = taken
        data = json.dumps(taken.to_dict(self._key.name)).encode()
        path = self._far.folder / TAKEN
        await self._work(lambda: self._disk.replace(path, data, is_durable=self._is_durable))

    async def _put_out(self) -> None:
        seen = self._seen()
        assert seen is not None
        order, reply = self._last or (None, None)
        data = pack_status(
            far_status(
                *seen,
                sequence=self._sequence,
                order=order,
                reply=reply,
                is_heard=self._is_heard(),
                has_trouble=self._has_trouble(),
            ),
            self._key,
        )
        self._sequence += 1
        path = self._far.folder / OUT
        await self._work(lambda: self._disk.replace(path, data, is_durable=self._is_durable))

    def _waiting(self) -> tuple[list[tuple[Path, bytes]], list[tuple[Path, str]]]:
        """Return the files that are whole and were not read yet, by their names; and those to be put aside, and why."""
        found: list[tuple[Path, bytes]] = []
        bad: list[tuple[Path, str]] = []
        tries: dict[str, int] = {}
        with os.scandir(self._far.folder / IN) as entries:
            names = sorted(entry.name for entry in entries)
        for name in names:
            path = self._far.folder / IN / name
            if name.startswith(".") or name.endswith(UNFINISHED):
                continue
            try:
                if path.is_dir() or self._stuck.get(name, _NOWHERE) == _mark_of(path):
                    continue
                found.append((path, read_regular(path, MOST_BYTES, follows_links=False)))
            except FileNotFoundError:
                continue  # it was taken away meanwhile
            except OSError as error:
                tries[name] = self._tries.get(name, 0) + 1
                if tries[name] >= TRIES:
                    bad.append((path, f"cannot be read ({reason(error)})"))
            if MOST in {len(found), len(bad)}:
                break
        self._tries = tries
        return found, bad

    def _remove(self, path: Path) -> None:
        try:
            path.unlink(missing_ok=True)
        except OSError:
            self._stuck[path.name] = _mark_of(path)
            raise

    def _put_aside(self, path: Path) -> None:
        """Put a file where it is not looked at again; where that cannot be done, look at it no more as it is."""
        aside = self._far.folder / ASIDE
        try:
            self._disk.make_folder(aside)
            kept = sorted(path.name for path in aside.iterdir())
            name = path.name if len(kept) < MOST_ASIDE else kept[-1]
            self._disk.rename(path, aside / name)
        except OSError:
            self._stuck[path.name] = _mark_of(path)
            raise

    # ---------------------------------------------------------------------------------------------- orders
    async def _take_orders(self) -> bool:
        """Take what has come in; return whether the shore should hear of it."""
        found: list[tuple[Path, bytes]] = []
        bad: list[tuple[Path, str]] = []

        def look() -> None:
            whole, broken = self._waiting()
            found.extend(whole)
            bad.extend(broken)

        await self._work(look)
        has_news = False
        for path, data in found:
            try:
                has_news = await self._take(data) or has_news
            except Exception as error:  # a fault of ours with one message must not keep the others out
                bad.append((path, f"cannot be judged ({error!r})"))
            else:
                await self._work(lambda path=path: self._remove(path))  # type: ignore[misc]
        for path, why in bad:
            self._tell(Severity.WARNING, f"a message from far away, {path.name[:MOST_NAME]!a}, {why}: put into {ASIDE}")
            await self._work(lambda path=path: self._put_aside(path))  # type: ignore[misc]
        return has_news

    async def _take(self, data: bytes) -> bool:
        seen = self._seen()
        unix_s = None if seen is None else seen[1].snapshot.unix_s(now_s())
        try:
            if len(data) == BEGINNING_SIZE:
                return await self._begin_anew(data, unix_s)
            order = unpack_order(data, self._key)
        except ValueError as error:
            self._tell(Severity.WARNING, f"a message from far away is refused: {error}")
            return False
        was_new = order.counter not in self._taken.replies
        reply, taken = judged(order, self._taken, unix_s)
        if taken is not self._taken:
            await self._keep(taken)
        if reply is None:
            answer = await self._crew.ask(order.wanted, order.counter, FAR)
            reply = reply_of(answer.result)
            await self._keep(self._taken.with_reply(order, reply))
            self._note(order, f"{reply}: {answer.text}")
        elif was_new:
            self._note(order, reply)
            self._tell(Severity.WARNING, f"order {order.counter} from far away, {order.wanted.words}: {reply}")
        else:
            self._note(order, f"come again, and nothing is done twice: {reply}")
        self._last = order.counter, reply
        return True

    async def _begin_anew(self, data: bytes, unix_s: float | None) -> bool:
        """Judge a beginning. Raises ValueError: it is not ours."""
        beginning = unpack_beginning(data, self._key)
        reply, taken = begun(beginning, self._taken, unix_s)
        if taken is not self._taken or reply is not Reply.BEGUN:  # and not only come again
            self._tell(Severity.NOTICE, f"beginning {beginning.began} from far away: {reply}")
        if taken is not self._taken:
            await self._keep(taken)
            self._key = self._key.since(taken.began)
        self._last = None, reply
        return True

    def _note(self, order: FarOrder, text: str) -> None:
        self._record({"kind": "far", "counter": order.counter, "order": order.wanted.words, "text": text})

    def _tell(self, severity: Severity, text: str) -> None:
        """Say and record something; the same words not again for a while."""
        if now_s() - self._said_s.get(text, -math.inf) >= SAY_EVERY_S:
            self._said_s[text] = now_s()
            self._record({"kind": "far", "text": text})
            self._say(int(severity), text)


_NOWHERE: _Mark = (0, 0)


def _mark_of(path: Path) -> _Mark:
    status = path.lstat()
    return status.st_mtime_ns, status.st_ino
