"""The autopilot as the application sees it: values in, orders out, each with an outcome and words.

Lists here never hold home: ``items[0]`` is the autopilot's item 1. A mission changes places in one piece where the
autopilot has MAVFTP (one restart of the present leg, nothing half written when the link dies), else by the item
protocol, and is believed only after it was read back and compared.
"""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from types import TracebackType
from typing import Literal, Self

from pymavlink.dialects.v20 import ardupilotmega as wire

from companion.clock import now_s
from companion.mavlink import codec
from companion.mavlink.assembler import Value, VehicleAssembler
from companion.mavlink.commands import CommandAnswer
from companion.mavlink.frames import Message
from companion.mavlink.ftp import FENCE_FILE, MISSION_FILE, RALLY_FILE, FtpRead, FtpWrite
from companion.mavlink.items import ENDING, first_difference, pack_mission_dat, padded, sailed, unpack_mission_dat
from companion.mavlink.link import Link
from companion.mavlink.lists import ListClear, ListDownload, ListUpload
from companion.mavlink.machines import Outcome
from companion.mavlink.params import ParamAnswer, ParamList, ParamRead, ParamSet, ParamTable, names_of
from companion.mavlink.status_wire import status_messages
from companion.messages import (
    AutopilotStatus,
    CompanionStatus,
    GeoPoint,
    MissionItem,
    MissionState,
    MissionType,
    Mode,
)

Method = Literal["auto", "ftp", "items", "partial", "guarded"]
OnValue = Callable[[Value], None]

# How long the autopilot has to show what it acknowledged: its heartbeat and MISSION_CURRENT come once a second [s].
CONFIRM_S = 2.5
SET_CURRENT_TRIES = 3
UPLOAD_TRIES = 2
AUX_SAILBOAT_TACK = 63  # RC option number of DO_AUX_FUNCTION
_FILES = {MissionType.MISSION: MISSION_FILE, MissionType.FENCE: FENCE_FILE, MissionType.RALLY: RALLY_FILE}


@dataclass(frozen=True, slots=True, kw_only=True)
class TransferResult:
    """How an upload ended. OK means written, read back, equal, and made current where that was asked.

    ``method`` is the protocol that carried it, ``duration_s`` what it took with the read-back, ``count`` how many items
    (without home) the autopilot holds now, None when that is not known.
    """

    outcome: Outcome
    text: str = ""
    method: str = ""
    duration_s: float = 0.0
    count: int | None = None

    @property
    def is_ok(self) -> bool:
        """The list is there."""
        return self.outcome is Outcome.OK


@dataclass(frozen=True, slots=True, kw_only=True)
class ReadResult:
    """How a download ended. ``items`` (without home) is None unless ``outcome`` is OK."""

    outcome: Outcome
    text: str = ""
    items: tuple[MissionItem, ...] | None = None
    home: MissionItem | None = None

    @property
    def is_ok(self) -> bool:
        """The list was read."""
        return self.outcome is Outcome.OK


class Autopilot:
    """One ArduRover behind a ``Link`` that is open; it lives as long as the link.

    ``async with Autopilot(link) as autopilot`` also waits for the heartbeat (LinkError when none comes within
    ``timeout_s``) and asks for the version; without that, the first upload asks.
    """

    def __init__(self, link: Link, *, timeout_s: float = 10.0) -> None:
        self.link = link
        self.assembler = VehicleAssembler()
        self.version: codec.AutopilotVersion | None = None
        self.home: GeoPoint | None = None
        self._timeout_s = timeout_s
        self._listeners: list[OnValue] = []
        self._version_asked = False
        self._ftp_works: bool | None = None
        self._ftp_seq: int | None = None
        self._text_id = 0
        self._status_turn = 0
        self._changed = asyncio.Event()
        self._unsubscribe = link.subscribe(self._take)

    async def __aenter__(self) -> Self:
        await self.link.wait_autopilot(self._timeout_s)
        await self.read_version()
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._unsubscribe()

    # -------------------------------------------------------------------------------------- values in
    @property
    def status(self) -> AutopilotStatus | None:
        """The newest status."""
        return self.assembler.status

    def on_value(self, callback: OnValue) -> Callable[[], None]:
        """Hand every decoded value to ``callback``; call the result to stop."""
        self._listeners.append(callback)

        def stop() -> None:
            if callback in self._listeners:
                self._listeners.remove(callback)

        return stop

    def _take(self, t_s: float, message: Message) -> None:
        kind = message.get_type()
        if kind == "HOME_POSITION" and self.link.party.is_from_target(message):
            with contextlib.suppress(ValueError):
                self.home = codec.geo_point(message.latitude, message.longitude) or self.home
        elif kind == "AUTOPILOT_VERSION" and self.link.party.is_from_target(message):
            self.version = codec.autopilot_version(message)
        if message.get_srcSystem() != self.link.party.target_system:
            return
        bad_before = self.assembler.dropped_by_type[kind]
        values = self.assembler.take(t_s, message)
        if self.assembler.dropped_by_type[kind] > bad_before:
            self.link.monitor.bad_value(t_s, kind)
        for value in values:
            for callback in tuple(self._listeners):
                callback(value)
        self._changed.set()

    async def _wait_status(
        self, holds: Callable[[AutopilotStatus], bool], since_s: float, timeout_s: float = CONFIRM_S
    ) -> bool:
        """Wait until a status heard at ``since_s`` or later fulfils ``holds``."""
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(timeout_s):
                while True:
                    status = self.status
                    if status is not None and status.t_s >= since_s and holds(status):
                        return True
                    self._changed.clear()
                    await self._changed.wait()
        return False

    # ---------------------------------------------------------------------------------------- commands
    async def read_version(self) -> codec.AutopilotVersion | None:
        """Ask for AUTOPILOT_VERSION; None when it is not told."""
        self._version_asked = True
        answer = await self.link.command(
            wire.MAV_CMD_REQUEST_MESSAGE, wire.MAVLINK_MSG_ID_AUTOPILOT_VERSION, give_up_s=3.0
        )
        if answer.is_ok and self.version is None:
            with contextlib.suppress(TimeoutError):
                async with asyncio.timeout(1.0):
                    while self.version is None:
                        self._changed.clear()
                        await self._changed.wait()
        return self.version

    async def set_mode(self, mode: Mode) -> CommandAnswer:
        """Change the mode and wait until the heartbeat shows it."""
        since_s = now_s()
        answer = await self.link.command(wire.MAV_CMD_DO_SET_MODE, 1.0, float(mode))
        if answer.is_ok and not await self._wait_status(lambda s: s.mode is mode, since_s):
            shown = self.status.mode if self.status else None
            text = f"accepted, but the heartbeat shows {shown.name if shown is not None else 'no known mode'}"
            return CommandAnswer(outcome=Outcome.MISMATCH, text=text, result=answer.result)
        return answer

    async def arm(self) -> CommandAnswer:
        """Arm; a refusal carries the pre-arm reasons verbatim."""
        return await self._arm(is_armed=True)

    async def disarm(self) -> CommandAnswer:
        """Disarm."""
        return await self._arm(is_armed=False)

    async def _arm(self, *, is_armed: bool) -> CommandAnswer:
        since_s = now_s()
        answer = await self.link.command(wire.MAV_CMD_COMPONENT_ARM_DISARM, 1.0 if is_armed else 0.0)
        if answer.is_ok and not await self._wait_status(lambda s: s.is_armed is is_armed, since_s):
            return CommandAnswer(
                outcome=Outcome.MISMATCH, text="accepted, but the heartbeat does not show it", result=answer.result
            )
        return answer

    async def set_current(self, seq: int, *, reset: bool = True) -> CommandAnswer:
        """Make item ``seq`` current; ``reset`` (p2 = 1) starts a mission that is complete or stopped again.

        Outside AUTO p2 stays 0: ArduRover would start the leg at once, before its navigation has its limits, and
        the internal error that follows forbids arming until a reboot. AUTO then begins at ``seq`` by itself.

        Confirmed by MISSION_CURRENT; sent again when that does not show it.
        """
        answer = CommandAnswer(outcome=Outcome.TIMEOUT, text="not sent")
        for _ in range(SET_CURRENT_TRIES):
            since_s = now_s()
            resets = reset and self.status is not None and self.status.mode is Mode.AUTO
            answer = await self.link.command(wire.MAV_CMD_DO_SET_MISSION_CURRENT, float(seq), float(resets))
            if not answer.is_ok or await self._wait_status(lambda s: s.mission_seq == seq, since_s):
                return answer
        now = self.status.mission_seq if self.status else None
        return CommandAnswer(
            outcome=Outcome.MISMATCH, text=f"item {seq} was accepted, MISSION_CURRENT shows {now}", result=answer.result
        )

    async def tack(self) -> CommandAnswer:
        """Ask for a tack now; the autopilot does it only while it beats by itself, 5 s after the last at earliest."""
        return await self.link.command(wire.MAV_CMD_DO_AUX_FUNCTION, float(AUX_SAILBOAT_TACK), 2.0)

    async def enable_fence(self, *, enabled: bool = True) -> CommandAnswer:
        """Switch the fence on or off until the next reboot (the parameter FENCE_ENABLE stays)."""
        return await self.link.command(wire.MAV_CMD_DO_FENCE_ENABLE, 1.0 if enabled else 0.0)

    async def reposition(self, point: GeoPoint) -> CommandAnswer:
        """In GUIDED: sail to ``point``, tacking as needed."""
        message = codec.reposition(self.link.party.target, point)
        return await self.link.command(wire.MAV_CMD_DO_REPOSITION, message=message)

    def steer_heading(self, heading_rad: float, *, thrust: float = 1.0) -> None:
        """In GUIDED: hold a heading [rad, true]; to be repeated at 1 Hz or faster, it times out after 3 s.

        The autopilot does not keep the boat out of the no-go zone for it.
        """
        self.link.send(codec.heading_setpoint(self.link.party.target, self.link.boot_s, heading_rad, thrust))

    def say(self, severity: int, text: str) -> None:
        """Send a STATUSTEXT (0 emergency .. 7 debug); it reaches the shore and the autopilot's log."""
        self._text_id += 1
        self.link.send(*codec.status_texts(severity, text, self._text_id))

    def send_status(self, status: CompanionStatus) -> None:
        """Put the companion's status on the air; to be called every 2 s or more slowly."""
        self.link.send(*status_messages(status, self.link.boot_s, self._status_turn))
        self._status_turn += 1

    # -------------------------------------------------------------------------------------- parameters
    async def get_parameter(self, name: str) -> ParamAnswer:
        """Read a parameter under any of its names."""
        return await self.link.perform(ParamRead(self.link.party, names_of(name)), "param")

    async def set_parameter(self, name: str, value: float) -> ParamAnswer:
        """Write a parameter under the name that this autopilot has for it, and wait for the echo."""
        present = await self.get_parameter(name)
        if not present.is_ok:
            return present
        machine = ParamSet(self.link.party, present.name, value, present.param_type or wire.MAV_PARAM_TYPE_REAL32)
        return await self.link.perform(machine, "param")

    async def read_parameters(self) -> ParamTable:
        """Read all parameters."""
        return await self.link.perform(ParamList(self.link.party), "param")

    # ------------------------------------------------------------------------------------------- lists
    async def read_mission(self, *, method: Method = "items") -> ReadResult:
        """Read the mission; ``items`` is without home."""
        async with self.link.lock("lists"):
            return await self._read(MissionType.MISSION, method)

    async def read_fence(self) -> ReadResult:
        """Read the fence items."""
        async with self.link.lock("lists"):
            return await self._read(MissionType.FENCE, "items")

    async def read_rally(self) -> ReadResult:
        """Read the rally points."""
        async with self.link.lock("lists"):
            return await self._read(MissionType.RALLY, "items")

    async def upload_mission(
        self, items: Sequence[MissionItem], *, method: Method = "auto", keep_first: int = 0,
        set_current: int | None = None, stopgap: MissionItem | None = None,
    ) -> TransferResult:
        """Put ``items`` on the autopilot, read them back, compare, and then make ``set_current`` current if given.

        Args:
            items: without home; not empty. The last one should end the mission safely.
            method: ``ftp`` in one piece, ``items`` one by one, ``partial`` only those behind ``keep_first``,
                ``guarded`` behind a stopgap; ``auto`` takes ftp where the autopilot has it, else guarded where there
                is a stopgap, else partial where ``keep_first`` allows it, else items.
            keep_first: so many leading items are on the autopilot already, unchanged.
            set_current: item to sail to next, sent with reset.
            stopgap: an item that ends a mission, to stand behind ``keep_first`` while the rest is written one by one:
                what is on board is then at every moment the old mission, its beginning with the stopgap, or the new
                one. Only where more than ``keep_first`` items are on board.

        A running autopilot keeps the tail of a longer old mission over ftp and partial writes. Over ftp the new one is
        padded with copies of its last item to the old length; a partial write leaves the tail behind the new end.
        """
        if not items:
            raise ValueError("an empty mission is not uploaded; use clear_mission")
        began_s = now_s()
        if method == "auto" and not self._version_asked:
            await self.read_version()
        async with self.link.lock("lists"):
            result = TransferResult(outcome=Outcome.LINK, text="the link is silent")
            for chosen in self._ways(items, method, keep_first, is_guarded=stopgap is not None):
                if chosen == "ftp" and self._ftp_works is False:
                    continue
                if chosen == "items" and result.method == "guarded" and result.outcome is not Outcome.UNSUPPORTED:
                    break   # what failed by a bad link is not tried again without the guard
                if chosen == "guarded" and stopgap is not None:
                    result = await self._upload_guarded(items, keep_first, stopgap)
                else:
                    result = await self._upload_once(items, chosen, keep_first)
                if result.is_ok or self.link.is_lost:
                    break
                if chosen == "items" and result.outcome not in {Outcome.TIMEOUT, Outcome.MISMATCH}:
                    break
        if result.is_ok and set_current is not None:
            answer = await self.set_current(set_current, reset=True)
            if not answer.is_ok:
                result = TransferResult(
                    outcome=answer.outcome, text=f"uploaded, but not made current: {answer.text}",
                    method=result.method, count=result.count,
                )
        return self._timed(result, began_s)

    async def upload_partial(self, start: int, items: Sequence[MissionItem]) -> TransferResult:
        """Replace items ``start``.. (1 is the first after home) by MISSION_WRITE_PARTIAL_LIST and read them back."""
        began_s = now_s()
        async with self.link.lock("lists"):
            machine = ListUpload(self.link.party, MissionType.MISSION, items, first=start, partial=True)
            written = await self.link.perform(machine)
            if written.outcome not in {Outcome.OK, Outcome.UNCONFIRMED}:
                return self._timed(
                    TransferResult(outcome=written.outcome, text=written.text, method="partial"), began_s
                )
            read = await self._read(MissionType.MISSION, "items")
        if read.items is None:
            return self._timed(TransferResult(outcome=read.outcome, text=read.text, method="partial"), began_s)
        difference = first_difference(items, read.items[start - 1:start - 1 + len(items)])
        outcome = Outcome.MISMATCH if difference else Outcome.OK
        result = TransferResult(outcome=outcome, text=difference, method="partial", count=len(read.items))
        return self._timed(result, began_s)

    async def upload_fence(self, items: Sequence[MissionItem]) -> TransferResult:
        """Put a fence on the autopilot (taken over in one piece at its end), read back and compare."""
        return await self._upload_list(MissionType.FENCE, items)

    async def upload_rally(self, items: Sequence[MissionItem]) -> TransferResult:
        """Put rally points on the autopilot, read back and compare."""
        return await self._upload_list(MissionType.RALLY, items)

    async def clear_mission(self) -> TransferResult:
        """Remove the mission; refused while it sails."""
        return await self._clear(MissionType.MISSION)

    async def clear_fence(self) -> TransferResult:
        """Remove the fence."""
        return await self._clear(MissionType.FENCE)

    # ------------------------------------------------------------------------------------------ inside
    def _ways(
        self, items: Sequence[MissionItem], method: Method, keep_first: int, *, is_guarded: bool,
    ) -> tuple[Method, ...]:
        """Return the protocols to try, in order: twice the chosen one, at last the plain one."""
        if method != "auto":
            return (method,) * UPLOAD_TRIES
        plain: tuple[Method, ...] = ("guarded", "guarded", "items") if is_guarded else ("items", "items")
        if self._ftp_works is not False and (self.version is None or self.version.has_ftp):
            return "ftp", "ftp", *plain
        if is_guarded:
            return plain
        total = self.status.mission_total if self.status else None
        # a partial write may lengthen the list by one item at most, and leaves what stands behind it
        is_ended = bool(items) and items[-1].command in ENDING
        if is_ended and keep_first > 0 and total is not None and keep_first < len(items) <= total + 1:
            return "partial", "items", "items"
        return "items", "items"

    def _running_total(self) -> int:
        """Return how many items a write that does not clear leaves there: those of a mission under way."""
        status = self.status
        if status is None or not status.is_armed or status.mission_state is MissionState.NO_MISSION:
            return 0
        return status.mission_total or 0

    def _home_item(self, items: Sequence[MissionItem]) -> MissionItem:
        lat_e7, lon_e7 = codec.e7(self.home) if self.home else (items[0].lat_e7, items[0].lon_e7)
        return MissionItem(command=wire.MAV_CMD_NAV_WAYPOINT, lat_e7=lat_e7, lon_e7=lon_e7, frame=0)

    async def _upload_once(self, items: Sequence[MissionItem], method: Method, keep_first: int) -> TransferResult:
        """Write by ``method``, read back, compare."""
        party, kind, home = self.link.party, MissionType.MISSION, self._home_item(items)
        sent = tuple(items)
        if method == "ftp":
            sent = padded(items, self._running_total())
            data = pack_mission_dat((home, *sent), kind)
            written = await self.link.perform(FtpWrite(party, MISSION_FILE, data, seq=self._next_ftp_seq()))
            self._ftp_seq = written.next_seq
            outcome, text = written.outcome, written.text
            if outcome is Outcome.OK:
                self._ftp_works = True
            elif outcome in {Outcome.UNSUPPORTED, Outcome.REFUSED} and self._ftp_works is None:
                self._ftp_works = False
        elif method == "partial":
            # not padded: every item written restarts the present leg
            listed = await self.link.perform(
                ListUpload(party, kind, sent[keep_first:], first=keep_first + 1, partial=True)
            )
            outcome, text = listed.outcome, listed.text
        else:
            listed = await self.link.perform(ListUpload(party, kind, (home, *sent)))
            outcome, text = listed.outcome, listed.text
        if outcome not in {Outcome.OK, Outcome.UNCONFIRMED}:
            if self.link.is_lost:
                outcome = Outcome.LINK
            return TransferResult(outcome=outcome, text=text, method=method)
        read = await self._read(kind, "ftp" if method == "ftp" else "items")
        if read.items is None:
            outcome = read.outcome if not self.link.is_lost else Outcome.LINK
            return TransferResult(outcome=outcome, text=f"written, not read back: {read.text}", method=method)
        difference = first_difference(sailed(sent), sailed(read.items))
        if not difference and len(read.items) < len(sent):
            difference = f"{len(sent)} items written, {len(read.items)} read back"
        if difference:
            return TransferResult(outcome=Outcome.MISMATCH, text=difference, method=method, count=len(read.items))
        tail = len(read.items) - len(sent)
        text = f"{tail} old items stand behind the end" if tail > 0 else ""
        return TransferResult(outcome=Outcome.OK, text=text, method=method, count=len(read.items))

    async def _upload_guarded(
        self, items: Sequence[MissionItem], keep_first: int, stopgap: MissionItem,
    ) -> TransferResult:
        """Write behind a stopgap: close the mission there, write and check the rest, then open it by a single item."""
        party, kind, seq = self.link.party, MissionType.MISSION, keep_first + 1
        closed = (*items[:keep_first], stopgap, *items[seq:])
        if len(closed) > seq:
            done = await self.link.perform(ListUpload(party, kind, (stopgap,), first=seq, partial=True))
            if done.outcome is not Outcome.OK:
                unknown = done.ack == wire.MAV_MISSION_UNSUPPORTED
                return self._guarded(Outcome.UNSUPPORTED if unknown else done.outcome, done.text)
            total = self.status.mission_total if self.status else None
            if total is not None and len(items) <= total + 1:
                done = await self.link.perform(ListUpload(party, kind, closed[seq:], first=seq + 1, partial=True))
            if total is None or len(items) > total + 1 or done.outcome is Outcome.REFUSED:
                done = await self.link.perform(ListUpload(party, kind, (self._home_item(items), *closed)))
            if done.outcome not in {Outcome.OK, Outcome.UNCONFIRMED}:
                return self._guarded(done.outcome, done.text)
            read = await self._read(kind, "items")
            difference = first_difference(closed, (read.items or ())[:len(closed)])
            if read.items is None or difference:
                return self._guarded(Outcome.MISMATCH if read.items is not None else read.outcome, difference)
        done = await self.link.perform(ListUpload(party, kind, (items[keep_first],), first=seq, partial=True))
        if done.outcome not in {Outcome.OK, Outcome.UNCONFIRMED}:
            return self._guarded(done.outcome, done.text)
        read = await self._read(kind, "items")
        if read.items is None:
            return self._guarded(read.outcome, f"written, not read back: {read.text}")
        difference = first_difference(sailed(items), sailed(read.items))
        result = self._guarded(Outcome.MISMATCH if difference else Outcome.OK, difference)
        return replace(result, count=len(read.items))

    def _guarded(self, outcome: Outcome, text: str) -> TransferResult:
        if outcome is Outcome.UNCONFIRMED:
            outcome = Outcome.TIMEOUT   # it may not stand there: nothing is written behind it
        if outcome is not Outcome.OK and self.link.is_lost:
            outcome = Outcome.LINK
        return TransferResult(outcome=outcome, text=text, method="guarded")

    async def _upload_list(self, kind: MissionType, items: Sequence[MissionItem]) -> TransferResult:
        began_s = now_s()
        result = TransferResult(outcome=Outcome.LINK, text="the link is silent")
        async with self.link.lock("lists"):
            for _ in range(UPLOAD_TRIES):
                written = await self.link.perform(ListUpload(self.link.party, kind, items))
                if written.outcome not in {Outcome.OK, Outcome.UNCONFIRMED}:
                    outcome = written.outcome if not self.link.is_lost else Outcome.LINK
                    result = TransferResult(outcome=outcome, text=written.text, method="items")
                else:
                    read = await self._read(kind, "items")
                    if read.items is None:
                        result = TransferResult(outcome=read.outcome, text=read.text, method="items")
                    else:
                        difference = first_difference(items, read.items)
                        result = TransferResult(
                            outcome=Outcome.MISMATCH if difference else Outcome.OK, text=difference, method="items",
                            count=len(read.items),
                        )
                if result.outcome not in {Outcome.TIMEOUT, Outcome.MISMATCH} or self.link.is_lost:
                    break
        return self._timed(result, began_s)

    async def _clear(self, kind: MissionType) -> TransferResult:
        began_s = now_s()
        async with self.link.lock("lists"):
            cleared = await self.link.perform(ListClear(self.link.party, kind))
        return self._timed(TransferResult(outcome=cleared.outcome, text=cleared.text, method="items"), began_s)

    async def _read(self, kind: MissionType, method: Method) -> ReadResult:
        if method == "ftp":
            result = await self._read_ftp(kind)
            if result.is_ok or self.link.is_lost:
                return result
        read = await self.link.perform(ListDownload(self.link.party, kind))
        if read.outcome is not Outcome.OK:
            outcome = read.outcome if not self.link.is_lost else Outcome.LINK
            return ReadResult(outcome=outcome, text=read.text)
        return _without_home(kind, read.items)

    async def _read_ftp(self, kind: MissionType) -> ReadResult:
        read = await self.link.perform(FtpRead(self.link.party, _FILES[kind], seq=self._next_ftp_seq()))
        self._ftp_seq = read.next_seq
        if read.outcome is not Outcome.OK:
            return ReadResult(outcome=read.outcome, text=read.text)
        try:
            found, start, items = unpack_mission_dat(read.data)
        except ValueError as error:
            return ReadResult(outcome=Outcome.MISMATCH, text=str(error))
        if found is not kind or start != 0:
            return ReadResult(outcome=Outcome.MISMATCH, text=f"the file holds {found.name} from item {start}")
        return _without_home(kind, items)

    def _next_ftp_seq(self) -> int:
        """Return a request number that an earlier life of this program has not just used.

        The autopilot answers a number that it has just answered by repeating that answer.
        """
        if self._ftp_seq is None:
            self._ftp_seq = int(now_s() * 997.0) & 0xFFFF
        return self._ftp_seq

    @staticmethod
    def _timed(result: TransferResult, began_s: float) -> TransferResult:
        return TransferResult(
            outcome=result.outcome, text=result.text, method=result.method, count=result.count,
            duration_s=now_s() - began_s,
        )


def _without_home(kind: MissionType, items: tuple[MissionItem, ...]) -> ReadResult:
    if kind is not MissionType.MISSION:
        return ReadResult(outcome=Outcome.OK, items=items)
    return ReadResult(outcome=Outcome.OK, items=items[1:], home=items[0] if items else None)

