"""The mailbox of a satellite modem: orders out of ``in``, the newest status into ``out``, whole files in one folder.

The modem's program puts each message that it has received into ``in`` under a name of its own, by renaming, and sends
what it finds as ``out/status``, and may take it away. So each side may stop, or lose its power, whenever it likes.
Names that begin with a dot or end in .new, .tmp or .part are not whole yet.

An order that was taken is on the disk (``taken.json``) before it is carried out: after a power cut it may be lost, and
the next status says so, but it is never carried out twice. A disk that cannot keep it does not stop it: what is asked
from far away may be what saves her.
"""

from __future__ import annotations

import asyncio
import json
import math
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any, Protocol

from companion.app.options import Far, Offload
from companion.clock import now_s
from companion.disk import NEW, Disk, reason
from companion.fold import Step
from companion.messages import CompanionStatus
from companion.orders import FAR, Answer, Wanted
from companion.orders.far import FarKey, FarOrder, Reply, Taken, judged, pack_status, reply_of, unpack_order
from companion.skipper.step import Severity
from companion.telemetry.far import far_status, unix_of_boat

LOOK_S = 5.0           # into the folder
MOST = 20              # files in one look: a flood waits
MOST_BYTES = 1000      # no message of ours is as long, by far
SAY_EVERY_S = 600.0    # the same words
UNFINISHED = (NEW, ".tmp", ".part")
IN, OUT, TAKEN = "in", "out/status", "taken.json"

Seen = tuple[CompanionStatus, Step]


class Teller(Protocol):
    """Who carries out orders, and answers (``companion.app.crew.Crew``)."""

    async def ask(self, wanted: Wanted, number: int, way: str) -> Answer:
        """Give an order and return its answer."""
        ...


class Mailbox:
    """The folder and what was taken of it. ``run`` lives in the voyage's task group.

    Args:
        far: the folder, the key, and how often a status is put out.
        system: the autopilot's system id: what is sealed for another is no order of ours.
        crew: who carries orders out.
        seen: returns the newest status and step, None before there is one.
        is_heard: whether the autopilot is.
        say, record: for the radio, and for the voyage's records.
        has_trouble: whether the disk does not keep what it should.
    """

    def __init__(
        self, far: Far, system: int, crew: Teller, *, disk: Disk, offload: Offload, is_durable: bool,
        seen: Callable[[], Seen | None], is_heard: Callable[[], bool], has_trouble: Callable[[], bool],
        say: Callable[[int, str], None], record: Callable[[dict[str, Any]], None],
    ) -> None:
        self._far, self._key, self._crew = far, FarKey(far.key, system), crew
        self._disk, self._offload, self._is_durable = disk, offload, is_durable
        self._seen, self._is_heard, self._has_trouble = seen, is_heard, has_trouble
        self._say, self._record = say, record
        self._taken = Taken()
        self._last: tuple[int, Reply] | None = None
        self._sequence = 0
        self._said_s: dict[str, float] = {}
        self._stuck: dict[str, tuple[int, int]] = {}   # files that cannot be removed, as they were when they were read

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
            except Exception as error:   # a fault of ours here must not end the voyage
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
                found.append(path.read_bytes())

        await self._work(work)
        for data in found:
            try:
                self._taken = Taken.from_dict(json.loads(data), self._key.name)
            except (ValueError, RecursionError) as error:
                self._tell(Severity.WARNING, f"{TAKEN} is not used: {error}; what was taken before this start and has "
                           "not expired would count again")
        if self._taken.highest:
            self._last = self._taken.highest, self._taken.replies[self._taken.highest][1]

    async def _keep(self, taken: Taken) -> None:
        self._taken = taken
        data = json.dumps(taken.to_dict(self._key.name)).encode()
        path = self._far.folder / TAKEN
        await self._work(lambda: self._disk.replace(path, data, is_durable=self._is_durable))

    async def _put_out(self) -> None:
        seen = self._seen()
        assert seen is not None
        order, reply = self._last or (None, None)
        data = pack_status(far_status(
            *seen, sequence=self._sequence, order=order, reply=reply, is_heard=self._is_heard(),
            has_trouble=self._has_trouble()), self._key)
        self._sequence += 1
        path = self._far.folder / OUT
        await self._work(lambda: self._disk.replace(path, data, is_durable=self._is_durable))

    def _waiting(self) -> list[tuple[Path, bytes]]:
        """Return the files that are whole and were not read yet, by their names."""
        found = []
        with os.scandir(self._far.folder / IN) as entries:
            for entry in sorted(entries, key=lambda e: e.name):
                if entry.name.startswith(".") or entry.name.endswith(UNFINISHED) or not entry.is_file():
                    continue
                stat = entry.stat()
                if self._stuck.get(entry.name) == (stat.st_mtime_ns, stat.st_ino):
                    continue
                path = Path(entry.path)
                with path.open("rb") as file:
                    found.append((path, file.read(MOST_BYTES)))
                if len(found) == MOST:
                    break
        return found

    def _remove(self, path: Path) -> None:
        try:
            path.unlink(missing_ok=True)
        except OSError:
            stat = path.stat()
            self._stuck[path.name] = (stat.st_mtime_ns, stat.st_ino)
            raise

    # ---------------------------------------------------------------------------------------------- orders
    async def _take_orders(self) -> bool:
        """Take what has come in; return whether the shore should hear of it."""
        found: list[tuple[Path, bytes]] = []
        await self._work(lambda: found.extend(self._waiting()))
        has_news = False
        for path, data in found:
            has_news = await self._take(data) or has_news
            await self._work(lambda path=path: self._remove(path))   # type: ignore[misc]
        return has_news

    async def _take(self, data: bytes) -> bool:
        try:
            order = unpack_order(data, self._key)
        except ValueError as error:
            self._tell(Severity.WARNING, f"a message from far away is refused: {error}")
            return False
        seen = self._seen()
        unix_s = None if seen is None else unix_of_boat(seen[1].snapshot, now_s())
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

    def _note(self, order: FarOrder, text: str) -> None:
        self._record({"kind": "far", "counter": order.counter, "order": order.wanted.words, "text": text})

    def _tell(self, severity: Severity, text: str) -> None:
        """Say and record something; the same words not again for a while."""
        if now_s() - self._said_s.get(text, -math.inf) >= SAY_EVERY_S:
            self._said_s[text] = now_s()
            self._record({"kind": "far", "text": text})
            self._say(int(severity), text)
