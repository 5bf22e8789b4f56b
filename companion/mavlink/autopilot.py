"""The autopilot as the application sees it: values in, orders out, each with an outcome and words.

Lists here never hold home: ``items[0]`` is the autopilot's item 1.
"""

from __future__ import annotations

import asyncio
import contextlib
import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from types import TracebackType
from typing import Self

from pymavlink.dialects.v20 import ardupilotmega as wire

from companion.clock import now_s
from companion.mavlink.link import Link
from companion.mavlink.microservices.command import CommandAnswer, TransferOutcome
from companion.mavlink.microservices.parameters import ParamAnswer, ParamList, ParamRead, ParamSet, ParamTable, names_of
from companion.mavlink.mission_lists import Method, MissionLists, ReadResult, TransferResult
from companion.mavlink.wire import codec
from companion.mavlink.wire.assembler import Value, VehicleAssembler
from companion.mavlink.wire.companion_status import high_latency2, status_messages
from companion.mavlink.wire.frames import Message
from companion.messages import AutopilotStatus, CompanionStatus, MissionItem, MissionType, Mode, VehicleState

OnValue = Callable[[Value], None]

# How long the autopilot has to show what it acknowledged: its heartbeat and MISSION_CURRENT come once a second [s].
CONFIRM_S = 2.5
SET_CURRENT_TRIES = 3
AUX_SAILBOAT_TACK, AUX_SAILBOAT_MOTOR = 63, 74  # RC option numbers of DO_AUX_FUNCTION
AUX_MIDDLE, AUX_HIGH = 1.0, 2.0  # positions of its switch


class Autopilot:
    """One ArduRover behind a ``Link`` that is open; it lives as long as the link.

    ``async with Autopilot(link) as autopilot`` also waits for the heartbeat (LinkError when none comes within
    ``timeout_s``) and asks for the version; without that, the first upload asks.

    Args:
        link: open.
        timeout_s: of the wait for a heartbeat [s].
        assembler: one that has taken every message of the link before we hear it, as a voyage's fold has, so that
            nothing is decoded twice; whoever feeds it hears the values. None: our own.
    """

    def __init__(self, link: Link, *, timeout_s: float = 10.0, assembler: VehicleAssembler | None = None) -> None:
        self.link = link
        self._is_fed = assembler is not None
        self.assembler = assembler or VehicleAssembler()
        self._lists = MissionLists(link, lambda: self.assembler.status)
        self._timeout_s = timeout_s
        self._listeners: list[OnValue] = []
        self._version_asked = False
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
    def version(self) -> codec.AutopilotVersion | None:
        """What it said of itself; None before."""
        return self._lists.version

    @property
    def status(self) -> AutopilotStatus | None:
        """The newest status."""
        return self.assembler.status

    def on_value(self, callback: OnValue) -> Callable[[], None]:
        """Hand every value that our own assembler decodes to ``callback``; call the result to stop."""
        assert not self._is_fed, "who feeds the assembler hears the values"
        self._listeners.append(callback)

        def stop() -> None:
            if callback in self._listeners:
                self._listeners.remove(callback)

        return stop

    def _take(self, t_s: float, message: Message) -> None:
        kind = message.get_type()
        if kind == "HOME_POSITION" and self.link.party.is_from_target(message):
            with contextlib.suppress(ValueError):
                self._lists.home = codec.geo_point(message.latitude, message.longitude) or self._lists.home
        elif kind == "AUTOPILOT_VERSION" and self.link.party.is_from_target(message):
            self._lists.version = codec.autopilot_version(message)
        if message.get_srcSystem() != self.link.target_system:
            return
        values = () if self._is_fed else self.assembler.take(t_s, message)
        for value in values if self._listeners else ():
            for callback in tuple(self._listeners):
                self.link.guard(getattr(callback, "__qualname__", repr(callback)), callback, value)
        self._changed.set()

    async def first_status(self) -> AutopilotStatus | None:
        """Return the newest status; without one wait for it, a few heartbeats long."""
        await self._wait_status(lambda _: True, -math.inf)
        return self.status

    async def _wait_status(self, holds: Callable[[AutopilotStatus], bool], since_s: float) -> bool:
        """Wait until a status heard at ``since_s`` or later fulfils ``holds``."""
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(CONFIRM_S):
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
            return CommandAnswer(outcome=TransferOutcome.MISMATCH, text=text, result=answer.result)
        return answer

    async def arm(self) -> CommandAnswer:
        """Arm; a refusal carries the pre-arm reasons verbatim."""
        since_s = now_s()
        answer = await self.link.command(wire.MAV_CMD_COMPONENT_ARM_DISARM, 1.0)
        if answer.is_ok and not await self._wait_status(lambda s: s.is_armed, since_s):
            return CommandAnswer(
                outcome=TransferOutcome.MISMATCH,
                text="accepted, but the heartbeat does not show it",
                result=answer.result,
            )
        return answer

    async def set_current(self, seq: int, *, reset: bool = True) -> CommandAnswer:
        """Make item ``seq`` current; ``reset`` (p2 = 1) starts a mission that is complete or stopped again.

        Outside AUTO p2 stays 0: ArduRover would start the leg at once, before its navigation has its limits, and
        the internal error that follows forbids arming until a reboot. AUTO then begins at ``seq`` by itself.

        Confirmed by MISSION_CURRENT; sent again when that does not show it.
        """
        answer = CommandAnswer(outcome=TransferOutcome.TIMEOUT, text="not sent")
        for _ in range(SET_CURRENT_TRIES):
            since_s = now_s()
            resets = reset and self.status is not None and self.status.mode is Mode.AUTO
            answer = await self.link.command(wire.MAV_CMD_DO_SET_MISSION_CURRENT, float(seq), float(resets))
            if not answer.is_ok or await self._wait_status(lambda s: s.mission_seq == seq, since_s):
                return answer
        now = self.status.mission_seq if self.status else None
        return CommandAnswer(
            outcome=TransferOutcome.MISMATCH,
            text=f"item {seq} was accepted, MISSION_CURRENT shows {now}",
            result=answer.result,
        )

    async def tack(self) -> CommandAnswer:
        """Ask for a tack now; the autopilot does it only while it beats by itself, 5 s after the last at earliest."""
        return await self.link.command(wire.MAV_CMD_DO_AUX_FUNCTION, float(AUX_SAILBOAT_TACK), 2.0)

    async def run_motor(self, *, on: bool) -> CommandAnswer:
        """Run a sailboat's auxiliary motor always, or leave it to the autopilot (its state after a boot).

        An autopilot without a throttle output acknowledges it, too, and does nothing.
        """
        return await self.link.command(
            wire.MAV_CMD_DO_AUX_FUNCTION, float(AUX_SAILBOAT_MOTOR), AUX_HIGH if on else AUX_MIDDLE
        )

    async def enable_fence(self, *, enabled: bool = True) -> CommandAnswer:
        """Switch the fence on or off until the next reboot (the parameter FENCE_ENABLE stays)."""
        return await self.link.command(wire.MAV_CMD_DO_FENCE_ENABLE, 1.0 if enabled else 0.0)

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

    def send_high_latency(self, status: CompanionStatus, vehicle: VehicleState | None, watchdog: str) -> None:
        """Put HIGH_LATENCY2 on the air, to be called every 5 s; nothing before the boat is known."""
        message = high_latency2(status, vehicle, self.status, watchdog)
        if message is not None:
            self.link.send(message)

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
        with self.link.burst():
            return await self.link.perform(ParamList(self.link.party), "param")

    # ------------------------------------------------------------------------------------------- lists
    async def read_mission(self, *, method: Method = "items") -> ReadResult:
        """Read the mission; ``items`` is without home."""
        return await self._lists.read(MissionType.MISSION, method)

    async def read_fence(self) -> ReadResult:
        """Read the fence items."""
        return await self._lists.read(MissionType.FENCE, "items")

    async def read_rally(self) -> ReadResult:
        """Read the rally points."""
        return await self._lists.read(MissionType.RALLY, "items")

    async def upload_mission(
        self,
        items: Sequence[MissionItem],
        *,
        method: Method = "auto",
        keep_first: int = 0,
        set_current: int | None = None,
        stopgap: MissionItem | None = None,
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

        Over ftp the item is made current before the mission is read back: until then the autopilot sails for the item
        of its old number, wherever that lies in the new one, and a read takes a quarter of a minute on a bad link.

        A running autopilot keeps the tail of a longer old mission over ftp and partial writes. Over ftp the new one is
        padded with copies of its last item to the old length; a partial write leaves the tail behind the new end.
        """
        if not items:
            raise ValueError("an empty mission is not uploaded")
        began_s = now_s()
        if method == "auto" and not self._version_asked:
            await self.read_version()
        answer: CommandAnswer | None = None

        async def make_current() -> None:
            nonlocal answer
            if set_current is not None:
                answer = await self.set_current(set_current, reset=True)

        result = await self._lists.write_mission(items, method, keep_first, stopgap, on_swapped=make_current)
        if result.is_ok and set_current is not None:
            if answer is None or not answer.is_ok:
                await make_current()
            if answer is not None and not answer.is_ok:
                result = replace(result, outcome=answer.outcome, text=f"uploaded, but not made current: {answer.text}")
        return replace(result, duration_s=now_s() - began_s)

    async def upload_fence(self, items: Sequence[MissionItem]) -> TransferResult:
        """Put a fence on the autopilot (taken over in one piece at its end), read back and compare."""
        return await self._lists.write(MissionType.FENCE, items)

    async def upload_rally(self, items: Sequence[MissionItem]) -> TransferResult:
        """Put rally points on the autopilot, read back and compare."""
        return await self._lists.write(MissionType.RALLY, items)
