"""The link: one transport, one autopilot, our identity on it.

``async with Link(transport) as link`` finds the autopilot by its heartbeat, speaks as component 191 of the same system
(an onboard computer, never a ground station), asks for its messages one by one and again after a reboot or a gap,
hands every message of that autopilot to its subscribers and every frame of both directions to the tlog sink.

The heartbeat is sent from the same task that watches the link, so a companion that hangs falls silent.
"""

from __future__ import annotations

import asyncio
import contextlib
from collections import Counter, deque
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from types import TracebackType
from typing import Self

from pymavlink.dialects.v20 import ardupilotmega as wire

from companion.clock import now_s
from companion.errors import LinkError
from companion.mavlink import codec
from companion.mavlink.commands import CommandAnswer, CommandSend
from companion.mavlink.frames import Codec, Drop, Message
from companion.mavlink.machines import Machine, Outcome, Party, ResultT_co
from companion.mavlink.signing import TICKS_PER_S, SigningStore
from companion.mavlink.streams import DEFAULT_STREAMS, Stream, StreamMonitor
from companion.mavlink.transport import Transport, TransportState

OnMessage = Callable[[float, Message], None]
OnFrame = Callable[[float, bytes], None]
OnCommand = Callable[[Message], int]

OWN_COMPONENT = 191  # MAV_COMP_ID_ONBOARD_COMPUTER
HEARTBEAT_S = 1.0
# Without a heartbeat of the autopilot for this long the link is silent [s].
SILENCE_S = 3.0
# ... and for this long it is lost: a conversation that ends now ended for that. A line that loses a third of its frames
# is silent for 3 s every half minute, for 6 s hardly ever [s].
LOST_S = 6.0
# A gap longer than this may have been a reboot: rates are asked for again [s].
GAP_S = 5.0
# Streams below their rate are asked for again this often, at most [s].
REASK_S = 30.0
# A quiet link speaks this often, so that an autopilot that rebooted knows of it again [s].
LISTENER_BEAT_S = 30.0
_RATE_WINDOW_S = 10.0
_DUPLICATE_WINDOW = 32


@dataclass(frozen=True, slots=True)
class LinkIdentity:
    """Who we are. ``system`` None: the autopilot's own, detected."""

    system: int | None = None
    component: int = OWN_COMPONENT


@dataclass(slots=True)
class LinkStats:
    """Counters of a link."""

    frames_in: int = 0
    frames_out: int = 0
    frames_lost: int = 0
    reboots: int = 0
    rates_asked: int = 0
    dropped: Counter[Drop] = field(default_factory=Counter)


class Link:
    """One autopilot behind one transport.

    Args:
        transport: closed; the link opens and closes it.
        identity: our ids.
        target_system: the autopilot's system id, None: the first that is heard.
        streams: the table of messages to ask for; empty: ask for nothing.
        sink: gets (t_s, frame) for every good frame in and every frame out; the caller adds the wall clock.
        signing: signs and verifies, None: plain.
        is_quiet: for listeners on a radio: a heartbeat of ours only until the autopilot has heard it, and one in 30 s.
    """

    def __init__(
        self,
        transport: Transport,
        *,
        identity: LinkIdentity | None = None,
        target_system: int | None = None,
        streams: Iterable[Stream] = DEFAULT_STREAMS,
        sink: OnFrame | None = None,
        signing: SigningStore | None = None,
        is_quiet: bool = False,
    ) -> None:
        self.transport = transport
        self.stats = LinkStats()
        self.monitor = StreamMonitor(streams)
        self.on_command: OnCommand | None = None
        self._identity = identity or LinkIdentity()
        self._sink, self._signing, self._is_quiet = sink, signing, is_quiet
        self._target = target_system
        self._codec = Codec(
            self._identity.system or target_system or 1, self._identity.component, signing.state if signing else None
        )
        self._subscribers: list[OnMessage] = []
        self._heartbeat_s: float | None = None
        self._found = asyncio.Event()
        self._boot_s: float | None = None
        self._recent: deque[tuple[int, int, int, int, int]] = deque(maxlen=_DUPLICATE_WINDOW)
        self._last_seq: dict[tuple[int, int], int] = {}
        self._want_rates = asyncio.Event()
        self._asked_s = 0.0
        self._refused_streams: set[str] = set()
        self._traffic: deque[tuple[float, int, int]] = deque()
        self._locks: dict[str, asyncio.Lock] = {}
        self._group = asyncio.TaskGroup()
        self._tasks: list[asyncio.Task[None]] = []
        self._system_status = wire.MAV_STATE_ACTIVE
        self._signing_zero_s: float | None = None

    # -------------------------------------------------------------------------------------------- life
    async def __aenter__(self) -> Self:
        await self.transport.open(self._take_bytes)
        await self._group.__aenter__()
        self._tasks = [
            self._group.create_task(self._beat(), name="link heartbeat"),
            self._group.create_task(self._keep_rates(), name="link rates"),
        ]
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for task in self._tasks:
            task.cancel()
        # What the body raises leaves as it is; only a failure of the link's own tasks comes as a group.
        is_ours = kind is not None and issubclass(kind, asyncio.CancelledError)
        try:
            await self._group.__aexit__(*((kind, error, trace) if is_ours else (None, None, None)))
        finally:
            await self.transport.close()
            if self._signing is not None:
                self._signing.save()

    async def wait_autopilot(self, timeout_s: float = 10.0) -> Party:
        """Wait for an autopilot's heartbeat.

        Raises:
            LinkError: none came within ``timeout_s`` [s]; the text says what was heard instead.
        """
        try:
            async with asyncio.timeout(timeout_s):
                await self._found.wait()
        except TimeoutError:
            raise LinkError(f"{self.transport.name}: no autopilot in {timeout_s:g} s: {self._diagnosis()}") from None
        return self.party

    # ------------------------------------------------------------------------------------------- state
    @property
    def party(self) -> Party:
        """The autopilot and we; before it was heard, system 1."""
        target = self._target or 1
        return Party(target, codec.AUTOPILOT_COMPONENT, self._codec.system, self._codec.component)

    @property
    def has_autopilot(self) -> bool:
        """An autopilot was heard."""
        return self._found.is_set()

    @property
    def heartbeat_age_s(self) -> float | None:
        """Seconds since the autopilot's last heartbeat, None: never."""
        return None if self._heartbeat_s is None else now_s() - self._heartbeat_s

    @property
    def is_alive(self) -> bool:
        """The autopilot's heartbeat is fresh."""
        age_s = self.heartbeat_age_s
        return age_s is not None and age_s <= SILENCE_S

    @property
    def boot_s(self) -> float:
        """The newest boot time of the autopilot [s], 0 before it told one."""
        return self._boot_s or 0.0

    @property
    def is_lost(self) -> bool:
        """The autopilot has not been heard for so long that nothing can be expected of it."""
        age_s = self.heartbeat_age_s
        return age_s is None or age_s > LOST_S

    def bytes_per_s(self) -> tuple[float, float]:
        """Return what came in and went out [bytes/s], over the last 10 s."""
        self._forget_traffic(now_s())
        received = sum(n for _, n, _ in self._traffic)
        sent = sum(n for _, _, n in self._traffic)
        return received / _RATE_WINDOW_S, sent / _RATE_WINDOW_S

    def dropped(self) -> Counter[Drop]:
        """Return what was dropped, by reason."""
        return self._codec.dropped + self.stats.dropped

    @property
    def is_signed(self) -> bool:
        """Frames with a signature have been heard, whether or not a key is here to check them."""
        return self._codec.signed_in > 0

    def loss(self) -> float:
        """Return the share of the autopilot's frames that never arrived, by their sequence numbers."""
        total = self.stats.frames_in + self.stats.frames_lost
        return self.stats.frames_lost / total if total else 0.0

    # ---------------------------------------------------------------------------------------- messages
    def subscribe(self, callback: OnMessage) -> Callable[[], None]:
        """Hand every message of the autopilot's system to ``callback(t_s, message)``; call the result to stop."""
        self._subscribers.append(callback)

        def stop() -> None:
            if callback in self._subscribers:
                self._subscribers.remove(callback)

        return stop

    def send(self, *messages: Message) -> None:
        """Send messages; a link that is down drops them and counts."""
        for message in messages:
            frame = self._codec.pack(message)
            self.stats.frames_out += 1
            now = now_s()
            self._traffic.append((now, 0, len(frame)))
            self.transport.write(frame)
            if self._sink is not None:
                self._sink(now, frame)

    def set_system_status(self, state: int) -> None:
        """Set MAV_STATE of our heartbeat."""
        self._system_status = state

    def lock(self, channel: str) -> asyncio.Lock:
        """Return the lock of a kind of conversation: two uploads at once would spoil each other."""
        return self._locks.setdefault(channel, asyncio.Lock())

    async def perform(self, machine: Machine[ResultT_co], channel: str | None = None) -> ResultT_co:
        """Drive ``machine`` to its result; with ``channel``, alone among those of that name."""
        if channel is not None:
            async with self.lock(channel):
                return await self.perform(machine)
        done = asyncio.Event()

        def take(t_s: float, message: Message) -> None:
            if machine.result is None:
                self.send(*machine.receive(t_s, message))
            if machine.result is not None:
                done.set()

        stop = self.subscribe(take)
        try:
            self.send(*machine.start(now_s()))
            while machine.result is None:
                wake_s = machine.wake_s
                with contextlib.suppress(TimeoutError):
                    async with asyncio.timeout_at(wake_s):
                        await done.wait()
                if machine.result is None and machine.wake_s <= wake_s:
                    # max: a timer may fire a rounding error before its time
                    self.send(*machine.tick(max(now_s(), wake_s)))
        finally:
            stop()
        assert machine.result is not None
        return machine.result

    async def command(
        self, command: int, *params: float, message: Message | None = None, give_up_s: float = 8.0
    ) -> CommandAnswer:
        """Send a COMMAND_LONG (or the prepared ``message``) and return its answer."""
        machine = CommandSend(self.party, command, params, message=message, give_up_s=give_up_s)
        answer = await self.perform(machine, f"command {command}")
        if answer.outcome is Outcome.TIMEOUT and self.is_lost:
            return CommandAnswer(outcome=Outcome.LINK, text="the link is silent")
        return answer

    def ask_rates(self) -> None:
        """Ask for every stream of the table again, soon."""
        self._refused_streams.clear()
        self._want_rates.set()

    # ------------------------------------------------------------------------------------------ inside
    def _take_bytes(self, data: bytes) -> None:
        now = now_s()
        self._traffic.append((now, len(data), 0))
        self._forget_traffic(now)
        for message in self._codec.feed(data):
            self._take(now, message)

    def _take(self, now: float, message: Message) -> None:
        system, component = message.get_srcSystem(), message.get_srcComponent()
        header = message.get_header()
        key = (system, component, header.seq, header.msgId, message.get_crc() or 0)
        if key in self._recent:
            self.stats.dropped[Drop.DUPLICATE] += 1
            return
        self._recent.append(key)
        self.stats.frames_in += 1
        if self._sink is not None:
            self._sink(now, bytes(message.get_msgbuf()))
        kind = message.get_type()
        if kind == "HEARTBEAT" and codec.is_autopilot_heartbeat(message) and self._target in {None, system}:
            self._take_heartbeat(now, system)
        if system != self._target:
            self._take_foreign(now, message, kind)
            return
        self._count_lost(system, component, header.seq)
        if component == codec.AUTOPILOT_COMPONENT:
            self.monitor.heard(now, kind)
            self._notice_boot(message)
        if system == self._codec.system and component == self._codec.component:
            self.stats.dropped[Drop.FOREIGN_SYSTEM] += 1  # our own ids from elsewhere: an echo, or a second companion
            return
        if kind in {"COMMAND_LONG", "COMMAND_INT"}:
            self._take_command(message)
        self._hand_out(now, message)

    def _hand_out(self, now: float, message: Message) -> None:
        for callback in tuple(self._subscribers):
            callback(now, message)

    def _take_heartbeat(self, now: float, system: int) -> None:
        if self._target is None:
            self._target = system
        if self._identity.system is None:
            self._codec.system = self._target
        if self._heartbeat_s is None or now - self._heartbeat_s > GAP_S:
            self._want_rates.set()
        self._heartbeat_s = now
        self._found.set()

    def _take_foreign(self, now: float, message: Message, kind: str) -> None:
        """Other systems are not ours to listen to, except a ground station that commands us by our ids."""
        if kind in {"COMMAND_LONG", "COMMAND_INT"} and self._is_for_us_alone(message):
            self._take_command(message)
            self._hand_out(now, message)
        elif kind == "HEARTBEAT" and message.type == wire.MAV_TYPE_GCS:
            pass
        else:
            self.stats.dropped[Drop.FOREIGN_SYSTEM] += 1

    def _is_for_us_alone(self, message: Message) -> bool:
        return bool(
            message.target_system == self._codec.system and message.target_component == self._codec.component
        )

    def _take_command(self, message: Message) -> None:
        """Answer a command addressed to this component by name; those to everybody are the autopilot's."""
        if not self._is_for_us_alone(message):
            return
        result = self.on_command(message) if self.on_command else wire.MAV_RESULT_UNSUPPORTED
        self.send(wire.MAVLink_command_ack_message(
            message.command, result, 0, 0, message.get_srcSystem(), message.get_srcComponent()
        ))

    def _count_lost(self, system: int, component: int, seq: int) -> None:
        last = self._last_seq.get((system, component))
        if last is not None:
            gap = (seq - last) % 256
            if gap > 128:
                # an overtaken frame: it was counted as lost when its follower came
                self.stats.frames_lost = max(0, self.stats.frames_lost - 1)
                return
            self.stats.frames_lost += max(0, gap - 1)
        self._last_seq[system, component] = seq

    def _notice_boot(self, message: Message) -> None:
        boot_ms = getattr(message, "time_boot_ms", None)
        if boot_ms is None or message.get_type() == "NAMED_VALUE_FLOAT":
            return
        boot_s = boot_ms / 1e3
        if self._boot_s is not None and boot_s < self._boot_s - GAP_S:
            self.stats.reboots += 1
            self._boot_s = boot_s
            self._last_seq.clear()
            self._want_rates.set()
        self._boot_s = boot_s if self._boot_s is None else max(self._boot_s, boot_s)

    async def _beat(self) -> None:
        """Send the heartbeat; watch for streams that fell below their rate."""
        next_s = now_s()
        connections = self.transport.stats.connections
        spoken, spoken_s = 0, 0.0
        while True:
            if self.transport.stats.connections != connections:
                # a new connection may be a new port of the autopilot, which knows nothing of what was asked before
                connections = self.transport.stats.connections
                self._want_rates.set()
                spoken = 0
            # A listener speaks too, but little: the autopilot forwards nothing to a link on which nobody spoke.
            is_new = spoken < 2 or not self.is_alive
            if not self._is_quiet or is_new or now_s() - spoken_s >= LISTENER_BEAT_S:
                self.send(codec.heartbeat(self._system_status))
                spoken += self.transport.state is TransportState.OPEN
                spoken_s = now_s()
            if self._signing is not None:
                self._advance_signing()
            now = now_s()
            if self.is_alive and now - self._asked_s > REASK_S and any(
                s.rate_hz > 0.0 and s.name not in self._refused_streams for s in self.monitor.below_rate(now)
            ):
                self._want_rates.set()
            next_s = max(next_s + HEARTBEAT_S, now)
            await asyncio.sleep(next_s - now)

    def _advance_signing(self) -> None:
        """Let the signing timestamp follow the clock since the start, so that replayed frames grow old."""
        assert self._signing is not None
        now = now_s()
        if self._signing_zero_s is None:
            self._signing_zero_s = now - self._signing.state.timestamp / TICKS_PER_S
        self._codec.set_signing_time(int((now - self._signing_zero_s) * TICKS_PER_S))
        self._signing.save()

    async def _keep_rates(self) -> None:
        while True:
            await self._want_rates.wait()
            await self._found.wait()
            self._want_rates.clear()
            self._asked_s = now_s()
            for stream in self.monitor.table:
                if stream.rate_hz <= 0.0 or self._want_rates.is_set():
                    continue
                answer = await self.command(
                    wire.MAV_CMD_SET_MESSAGE_INTERVAL, stream.msg_id, 1e6 / stream.rate_hz, give_up_s=4.0
                )
                self.stats.rates_asked += 1
                if answer.outcome in {Outcome.REFUSED, Outcome.UNSUPPORTED}:
                    self._refused_streams.add(stream.name)
                if answer.outcome is Outcome.LINK:
                    break  # the next heartbeat after the gap asks again

    def _forget_traffic(self, now: float) -> None:
        while self._traffic and now - self._traffic[0][0] > _RATE_WINDOW_S:
            self._traffic.popleft()

    def _diagnosis(self) -> str:
        stats, dropped = self.transport.stats, self.dropped()
        if stats.bytes_in == 0:
            said = f" ({stats.last_error})" if stats.last_error else ""
            return f"nothing was heard at all{said}; check the link's name, the wiring and who else uses it"
        if dropped[Drop.MAVLINK_1]:
            return "it speaks MAVLink 1; set SERIALn_PROTOCOL 2 on the autopilot's port"
        if dropped[Drop.BAD_SIGNATURE]:
            return "its frames are not signed with this key"
        if self.stats.frames_in == 0:
            return f"{stats.bytes_in} bytes and no MAVLink frame among them; check the baud rate"
        wanted = f" of system {self._target}" if self._target is not None else ""
        return f"{self.stats.frames_in} frames, but no autopilot's heartbeat{wanted}"

