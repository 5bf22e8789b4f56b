"""The lists on the autopilot: mission, fence and rally points written, read back, compared and removed.

Lists here never hold home: ``items[0]`` is the autopilot's item 1. A mission changes places in one piece where the
autopilot has MAVFTP (one restart of the present leg, nothing half written when the link dies), else by the item
protocol, and is believed only after it was read back and compared.
"""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Sequence
from dataclasses import dataclass, replace
from typing import Literal

from pymavlink.dialects.v20 import ardupilotmega as wire

from companion.clock import now_s
from companion.mavlink.link import Link
from companion.mavlink.microservices.command import TransferOutcome
from companion.mavlink.microservices.ftp import FENCE_FILE, MISSION_FILE, RALLY_FILE, FtpRead, FtpWrite
from companion.mavlink.microservices.mission import ListDownload, ListUpload
from companion.mavlink.wire import codec
from companion.mavlink.wire.items import first_difference, pack_mission_dat, padded, unpack_mission_dat
from companion.messages import ENDING, AutopilotStatus, GeoPoint, MissionItem, MissionState, MissionType, sailed_part
from companion.words import counted

Method = Literal["auto", "ftp", "items", "partial", "guarded"]

UPLOAD_TRIES = 2
_FILES = {MissionType.MISSION: MISSION_FILE, MissionType.FENCE: FENCE_FILE, MissionType.RALLY: RALLY_FILE}


@dataclass(frozen=True, slots=True, kw_only=True)
class TransferResult:
    """How an upload ended. OK means written, read back, equal, and made current where that was asked.

    ``method`` is the protocol that carried it, ``duration_s`` what it took with the read-back, ``count`` how many items
    (without home) the autopilot holds now, None when that is not known.
    """

    outcome: TransferOutcome
    text: str = ""
    method: str = ""
    duration_s: float = 0.0
    count: int | None = None

    @property
    def is_ok(self) -> bool:
        """The list is there."""
        return self.outcome is TransferOutcome.OK


@dataclass(frozen=True, slots=True, kw_only=True)
class ReadResult:
    """How a download ended. ``items`` (without home) is None unless ``outcome`` is OK."""

    outcome: TransferOutcome
    text: str = ""
    items: tuple[MissionItem, ...] | None = None
    home: MissionItem | None = None

    @property
    def is_ok(self) -> bool:
        """The list was read."""
        return self.outcome is TransferOutcome.OK


class MissionLists:
    """The lists of the autopilot behind ``link``; one transfer at a time.

    ``version`` and ``home`` are told to it when they are heard.
    """

    def __init__(self, link: Link, status: Callable[[], AutopilotStatus | None]) -> None:
        self.version: codec.AutopilotVersion | None = None
        self.home: GeoPoint | None = None
        self._link = link
        self._status = status
        self._ftp_works: bool | None = None
        self._ftp_seq: int | None = None

    async def read(self, kind: MissionType, method: Method) -> ReadResult:
        """Read a list: "ftp" as a file, anything else one by one."""
        async with self._link.lock("lists"):
            return await self._read(kind, method)

    async def write_mission(
        self,
        items: Sequence[MissionItem],
        method: Method,
        keep_first: int,
        stopgap: MissionItem | None,
        on_swapped: Callable[[], Awaitable[object]] | None = None,
    ) -> TransferResult:
        """Put a mission on the autopilot, read it back and compare, as ``Autopilot.upload_mission`` says.

        ``on_swapped`` is awaited when a mission has changed places in one piece, before it is read back.
        """
        async with self._link.lock("lists"):
            result = TransferResult(outcome=TransferOutcome.LINK, text="the link is silent")
            for chosen in self._ways(items, method, keep_first, is_guarded=stopgap is not None):
                if chosen == "ftp" and self._ftp_works is False:
                    continue
                if (
                    chosen == "items"
                    and result.method == "guarded"
                    and result.outcome is not TransferOutcome.UNSUPPORTED
                ):
                    break  # what failed by a bad link is not tried again without the guard
                if chosen == "guarded" and stopgap is not None:
                    result = await self._upload_guarded(items, keep_first, stopgap)
                else:
                    result = await self._upload_once(items, chosen, keep_first, on_swapped)
                if result.is_ok or self._link.is_lost:
                    break
                if chosen == "items" and result.outcome not in {TransferOutcome.TIMEOUT, TransferOutcome.MISMATCH}:
                    break
        return result

    async def write(self, kind: MissionType, items: Sequence[MissionItem]) -> TransferResult:
        """Put a fence or rally points on the autopilot, read back and compare."""
        began_s = now_s()
        result = TransferResult(outcome=TransferOutcome.LINK, text="the link is silent")
        async with self._link.lock("lists"):
            for _ in range(UPLOAD_TRIES):
                written = await self._link.perform(ListUpload(self._link.party, kind, items))
                if written.outcome in {TransferOutcome.OK, TransferOutcome.UNCONFIRMED}:
                    result = compared(items, await self._read(kind, "items"), "items")
                else:
                    outcome = written.outcome if not self._link.is_lost else TransferOutcome.LINK
                    result = TransferResult(outcome=outcome, text=written.text, method="items")
                if result.outcome not in {TransferOutcome.TIMEOUT, TransferOutcome.MISMATCH} or self._link.is_lost:
                    break
        return replace(result, duration_s=now_s() - began_s)

    def _ways(
        self, items: Sequence[MissionItem], method: Method, keep_first: int, *, is_guarded: bool
    ) -> tuple[Method, ...]:
        """Return the protocols to try, in order: twice the chosen one, at last the plain one."""
        if method != "auto":
            return (method,) * UPLOAD_TRIES
        plain: tuple[Method, ...] = ("guarded", "guarded", "items") if is_guarded else ("items", "items")
        if self._ftp_works is not False and (self.version is None or self.version.has_ftp):
            return "ftp", "ftp", *plain
        if is_guarded:
            return plain
        total = self._mission_total()
        # a partial write may lengthen the list by one item at most, and leaves what stands behind it
        is_ended = bool(items) and items[-1].command in ENDING
        if is_ended and keep_first > 0 and total is not None and keep_first < len(items) <= total + 1:
            return "partial", "items", "items"
        return "items", "items"

    def _mission_total(self) -> int | None:
        status = self._status()
        return status.mission_total if status else None

    def _running_total(self) -> int:
        """Return how many items a write that does not clear leaves there: those of a mission under way."""
        status = self._status()
        if status is None or not status.is_armed or status.mission_state is MissionState.NO_MISSION:
            return 0
        return status.mission_total or 0

    def _home_item(self, items: Sequence[MissionItem]) -> MissionItem:
        lat_e7, lon_e7 = codec.e7(self.home) if self.home else (items[0].lat_e7, items[0].lon_e7)
        return MissionItem(command=wire.MAV_CMD_NAV_WAYPOINT, lat_e7=lat_e7, lon_e7=lon_e7, frame=0)

    async def _upload_once(
        self,
        items: Sequence[MissionItem],
        method: Method,
        keep_first: int,
        on_swapped: Callable[[], Awaitable[object]] | None,
    ) -> TransferResult:
        """Write by ``method``, read back, compare."""
        party, kind, home = self._link.party, MissionType.MISSION, self._home_item(items)
        sent = tuple(items)
        if method == "ftp":
            sent = padded(items, self._running_total())
            data = pack_mission_dat((home, *sent), kind)
            written = await self._link.perform(FtpWrite(party, MISSION_FILE, data, seq=self._next_ftp_seq()))
            self._ftp_seq = written.next_seq
            outcome, text = written.outcome, written.text
            if outcome is TransferOutcome.OK:
                self._ftp_works = True
                if on_swapped is not None:
                    await on_swapped()
            elif outcome in {TransferOutcome.UNSUPPORTED, TransferOutcome.REFUSED} and self._ftp_works is None:
                self._ftp_works = False
        elif method == "partial":
            # not padded: every item written restarts the present leg
            listed = await self._link.perform(
                ListUpload(party, kind, sent[keep_first:], first=keep_first + 1, partial=True)
            )
            outcome, text = listed.outcome, listed.text
        else:
            listed = await self._link.perform(ListUpload(party, kind, (home, *sent)))
            outcome, text = listed.outcome, listed.text
        if outcome not in {TransferOutcome.OK, TransferOutcome.UNCONFIRMED}:
            if self._link.is_lost:
                outcome = TransferOutcome.LINK
            return TransferResult(outcome=outcome, text=text, method=method)
        read = await self._read(kind, "ftp" if method == "ftp" else "items")
        if read.items is None:
            outcome = read.outcome if not self._link.is_lost else TransferOutcome.LINK
            return TransferResult(outcome=outcome, text=f"written, not read back: {read.text}", method=method)
        difference = first_difference(sailed_part(sent), sailed_part(read.items))
        if not difference and len(read.items) < len(sent):
            difference = f"{counted(len(sent), 'item')} written, {len(read.items)} read back"
        if difference:
            return TransferResult(
                outcome=TransferOutcome.MISMATCH, text=difference, method=method, count=len(read.items)
            )
        tail = len(read.items) - len(sent)
        text = f"{counted(tail, 'old item stands', 'old items stand')} behind the end" if tail > 0 else ""
        return TransferResult(outcome=TransferOutcome.OK, text=text, method=method, count=len(read.items))

    async def _upload_guarded(
        self, items: Sequence[MissionItem], keep_first: int, stopgap: MissionItem
    ) -> TransferResult:
        """Write behind a stopgap: close the mission there, write and check the rest, then open it by a single item."""
        party, kind, seq = self._link.party, MissionType.MISSION, keep_first + 1
        closed = (*items[:keep_first], stopgap, *items[seq:])
        if len(closed) > seq:
            done = await self._link.perform(ListUpload(party, kind, (stopgap,), first=seq, partial=True))
            if done.outcome is not TransferOutcome.OK:
                unknown = done.ack == wire.MAV_MISSION_UNSUPPORTED
                return self._guarded(TransferOutcome.UNSUPPORTED if unknown else done.outcome, done.text)
            total = self._mission_total()
            if total is not None and len(items) <= total + 1:
                done = await self._link.perform(ListUpload(party, kind, closed[seq:], first=seq + 1, partial=True))
            if total is None or len(items) > total + 1 or done.outcome is TransferOutcome.REFUSED:
                done = await self._link.perform(ListUpload(party, kind, (self._home_item(items), *closed)))
            if done.outcome not in {TransferOutcome.OK, TransferOutcome.UNCONFIRMED}:
                return self._guarded(done.outcome, done.text)
            read = await self._read(kind, "items")
            if read.items is None:
                return self._guarded(read.outcome, f"written, not read back: {read.text}")
            difference = first_difference(closed, read.items[: len(closed)])
            if difference:
                return self._guarded(TransferOutcome.MISMATCH, difference)
        done = await self._link.perform(ListUpload(party, kind, (items[keep_first],), first=seq, partial=True))
        if done.outcome not in {TransferOutcome.OK, TransferOutcome.UNCONFIRMED}:
            return self._guarded(done.outcome, done.text)
        read = await self._read(kind, "items")
        if read.items is None:
            return self._guarded(read.outcome, f"written, not read back: {read.text}")
        difference = first_difference(sailed_part(items), sailed_part(read.items))
        result = self._guarded(TransferOutcome.MISMATCH if difference else TransferOutcome.OK, difference)
        return replace(result, count=len(read.items))

    def _guarded(self, outcome: TransferOutcome, text: str) -> TransferResult:
        if outcome is TransferOutcome.UNCONFIRMED:
            outcome = TransferOutcome.TIMEOUT  # it may not stand there: nothing is written behind it
        if outcome is not TransferOutcome.OK and self._link.is_lost:
            outcome = TransferOutcome.LINK
        return TransferResult(outcome=outcome, text=text, method="guarded")

    async def _read(self, kind: MissionType, method: Method) -> ReadResult:
        if method == "ftp":
            result = await self._read_ftp(kind)
            if result.is_ok or self._link.is_lost:
                return result
        read = await self._link.perform(ListDownload(self._link.party, kind))
        if read.outcome is not TransferOutcome.OK:
            outcome = read.outcome if not self._link.is_lost else TransferOutcome.LINK
            return ReadResult(outcome=outcome, text=read.text)
        return _without_home(kind, read.items)

    async def _read_ftp(self, kind: MissionType) -> ReadResult:
        read = await self._link.perform(FtpRead(self._link.party, _FILES[kind], seq=self._next_ftp_seq()))
        self._ftp_seq = read.next_seq
        if read.outcome is not TransferOutcome.OK:
            return ReadResult(outcome=read.outcome, text=read.text)
        try:
            found, start, items = unpack_mission_dat(read.data)
        except ValueError as error:
            return ReadResult(outcome=TransferOutcome.MISMATCH, text=str(error))
        if found is not kind or start != 0:
            return ReadResult(outcome=TransferOutcome.MISMATCH, text=f"the file holds {found.name} from item {start}")
        return _without_home(kind, items)

    def _next_ftp_seq(self) -> int:
        """Return a request number that an earlier life of this program has not just used.

        The autopilot answers a number that it has just answered by repeating that answer.
        """
        if self._ftp_seq is None:
            self._ftp_seq = int(now_s() * 997.0) & 0xFFFF
        return self._ftp_seq


def compared(items: Sequence[MissionItem], read: ReadResult, method: Method) -> TransferResult:
    """Return how a write of ``items`` ended, by what was read back."""
    if read.items is None:
        return TransferResult(outcome=read.outcome, text=read.text, method=method)
    difference = first_difference(items, read.items)
    outcome = TransferOutcome.MISMATCH if difference else TransferOutcome.OK
    return TransferResult(outcome=outcome, text=difference, method=method, count=len(read.items))


def _without_home(kind: MissionType, items: tuple[MissionItem, ...]) -> ReadResult:
    if kind is not MissionType.MISSION:
        return ReadResult(outcome=TransferOutcome.OK, items=items)
    return ReadResult(outcome=TransferOutcome.OK, items=items[1:], home=items[0] if items else None)
