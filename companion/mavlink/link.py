"""The link: one transport, one autopilot, our identity on it.

``async with Link(transport) as link`` listens who is there, takes the autopilot that is ours (see ``Census``), speaks
as component 191 of the same system (an onboard computer, never a ground station), asks for its messages one by one and
again after a reboot or a gap, hands every message of that autopilot that is believed (see ``PlausibilityFilter``) to
its subscribers and every frame of both directions to the tlog sink.

The heartbeat is sent from the same task that watches the link, so a companion that hangs falls silent. Whatever a
subscriber raises ends with that subscriber: it is counted, said once, and the others hear the message all the same.
"""

from __future__ import annotations

import asyncio
import contextlib
import math
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from types import TracebackType
from typing import Any, Protocol, Self

from pymavlink.dialects.v20 import ardupilotmega as wire

from companion.clock import now_s
from companion.errors import LinkError
from companion.mavlink.microservices.command import (
    CommandAnswer,
    CommandSend,
    Machine,
    Party,
    ResultT_co,
    TransferOutcome,
)
from companion.mavlink.reception import Heard, LinkIdentity, LinkStats, Objection, Reception, Throughput
from companion.mavlink.signing import SigningStore
from companion.mavlink.transports import Transport, TransportState
from companion.mavlink.vehicle_identity import GAP_S, LISTEN_S, OtherCompanion, Speaker, listed
from companion.mavlink.wire import codec
from companion.mavlink.wire.boot_time import since_boot_s
from companion.mavlink.wire.frames import Codec, Drop, Message
from companion.mavlink.wire.streams import DEFAULT_STREAMS, Stream, StreamMonitor
from companion.words import counted

# Streams below their rate are asked for again this often, at most [s].
REASK_S = 30.0


class Asks(Protocol):
    """Whoever sends a command and waits for its answer: the link."""

    async def command(self, command: int, *params: float, give_up_s: float = ...) -> CommandAnswer:
        """Send a COMMAND_LONG."""


class RateKeeper:
    """Asks for every stream of the monitor's table whenever ``wanted`` is set."""

    def __init__(self, link: Asks, monitor: StreamMonitor) -> None:
        self.wanted = asyncio.Event()
        self._link, self._monitor = link, monitor
        self._asked_s = 0.0
        self._refused: set[str] = set()

    def look(self, t_s: float) -> None:
        """Ask again when a vital stream has fallen below its rate."""
        if t_s - self._asked_s > REASK_S and any(
            s.rate_hz > 0.0 and s.name not in self._refused for s in self._monitor.below_rate(t_s)
        ):
            self.wanted.set()

    async def keep(self, found: asyncio.Event) -> None:
        """Ask whenever it is wanted, once the autopilot is found; for ever."""
        while True:
            await self.wanted.wait()
            await found.wait()
            self.wanted.clear()
            self._asked_s = now_s()
            for stream in self._monitor.table:
                if stream.rate_hz <= 0.0 or self.wanted.is_set():
                    continue
                answer = await self._link.command(
                    wire.MAV_CMD_SET_MESSAGE_INTERVAL, stream.msg_id, 1e6 / stream.rate_hz, give_up_s=4.0
                )
                if answer.outcome in {TransferOutcome.REFUSED, TransferOutcome.UNSUPPORTED}:
                    self._refused.add(stream.name)
                if answer.outcome is TransferOutcome.LINK:
                    break  # the next heartbeat after the gap asks again


OnMessage = Callable[[float, Message], None]
OnFrame = Callable[[float, bytes], None]
OnCommand = Callable[[Message], int]
# What ``on_command`` returns for a command that is answered later, with ``acknowledge``.
LATER = -1
# The loop's turn is noted so often; what is read this much later than the next was due has waited for us [s]. For so
# long after that a frame that might be anybody's is not heard, unless one with a boot time that is right comes first.
TURN_S, HELD_S, DOUBT_S = 0.2, 0.2, 1.0

HEARTBEAT_S = 1.0
# Without a heartbeat of the autopilot for this long the link is silent [s].
SILENCE_S = 3.0
# ... and for this long it is lost: a conversation that ends now ended for that. A line that loses a third of its frames
# is silent for 3 s every half minute, for 6 s hardly ever [s].
LOST_S = 6.0
# A quiet link speaks this often, so that an autopilot that rebooted knows of it again [s].
LISTENER_BEAT_S = 30.0


class Link:
    """One autopilot behind one transport.

    Args:
        transport: closed; the link opens and closes it.
        identity: our ids.
        target_system: the autopilot's system id, None: the only one that is heard.
        streams: the table of messages to ask for; empty: ask for nothing.
        sink: gets (t_s, frame) for every good frame in and every frame out; the caller adds the wall clock.
        signing: signs and verifies, None: plain.
        is_quiet: for listeners on a radio: a heartbeat of ours only until the autopilot has heard it, and one in 30 s.
        objection: says what is wrong with a message of the autopilot's system, None: nothing; asked once for each.
        stamp: rounds the time at which something was heard to what a record of it can hold.
        is_starting: our heartbeat says that we are not at work yet, until ``started``.
        on_fault: gets the words when a subscriber, the sink or ``on_command`` raises for the first time.
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
        objection: Objection | None = None,
        stamp: Callable[[float], float] | None = None,
        is_starting: bool = False,
        on_fault: Callable[[str], None] | None = None,
    ) -> None:
        self.transport = transport
        self.stats = LinkStats()
        self.monitor = StreamMonitor(streams)
        self.on_command: OnCommand | None = None
        self._identity = identity or LinkIdentity()
        self._sink, self._signing, self._is_quiet = sink, signing, is_quiet
        self._reception = Reception(self._identity, target_system, objection, self.stats)
        self._stamp, self._on_fault = stamp, on_fault
        self._codec = Codec(self._reception.own_system, self._identity.component, signing.state if signing else None)
        self._subscribers: tuple[tuple[str, OnMessage], ...] = ()  # each with its name for a fault
        self._heartbeat_s: float | None = None
        self._found, self._decided = asyncio.Event(), asyncio.Event()
        self._boot_s: float | None = None
        self._boot_heard_s = 0.0
        self._rates = RateKeeper(self, self.monitor)
        self._throughput = Throughput()
        self._locks: dict[str, asyncio.Lock] = {}
        self._group = asyncio.TaskGroup()
        self._tasks: list[asyncio.Task[None]] = []
        self._system_status = wire.MAV_STATE_BOOT if is_starting else wire.MAV_STATE_ACTIVE
        self._turned_s, self._doubt_until_s = math.inf, -math.inf

    # -------------------------------------------------------------------------------------------- life
    async def __aenter__(self) -> Self:
        self._turned_s = now_s()
        await self.transport.open(self._take_bytes)
        await self._group.__aenter__()
        self._tasks = [
            self._group.create_task(self._turn(), name="link turns"),
            self._group.create_task(self._beat(), name="link heartbeat"),
            self._group.create_task(self._rates.keep(self._found), name="link rates"),
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
        """Wait until our autopilot is found.

        Raises:
            LinkError: none came within ``timeout_s`` [s], or it cannot be told which of several is ours, or what is
                heard is no boat; the text says what was heard instead.
        """
        try:
            async with asyncio.timeout(timeout_s):
                await self._decided.wait()
        except TimeoutError:
            # somebody was heard just now: let the census come to its end
            if self._reception.census.wanted is None and self._reception.census.heard(self._now()):
                with contextlib.suppress(TimeoutError):
                    async with asyncio.timeout(LISTEN_S):
                        await self._decided.wait()
            if not self._decided.is_set():
                raise LinkError(
                    f"{self.transport.name}: no autopilot in {timeout_s:g} s: {self._diagnosis()}"
                ) from None
        if self._reception.refusal:
            raise LinkError(f"{self.transport.name}: {self._reception.refusal}")
        return self.party

    # ------------------------------------------------------------------------------------------- state
    @property
    def target_system(self) -> int:
        """The autopilot's system id; before it was heard, the one that is wanted, or 1."""
        return self._reception.target or self._reception.census.wanted or 1

    @property
    def party(self) -> Party:
        """The autopilot and we."""
        return Party(self.target_system, codec.AUTOPILOT_COMPONENT, self._codec.system, self._codec.component)

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

    @property
    def unheard(self) -> int:
        """How many messages of the autopilot's system came before it was known to be ours: nobody heard them."""
        return self._reception.unheard(self.party.target_system)

    def neighbours(self) -> tuple[Speaker, ...]:
        """Return the other autopilots that are heard."""
        return self._reception.census.neighbours(now_s(), self.party.target_system)

    @property
    def hears_station(self) -> bool:
        """Whether a ground station is heard."""
        return self._reception.census.hears_station(now_s())

    def other_companion(self) -> OtherCompanion | None:
        """Return another program that speaks with our ids, None when there is none."""
        return self._reception.census.companion(now_s(), self.party.own_system)

    def bytes_per_s(self) -> tuple[float, float]:
        """Return what came in and went out [bytes/s], over the last 10 s."""
        return self._throughput.bytes_per_s(now_s())

    def dropped(self) -> Counter[Drop]:
        """Return what was dropped, by reason."""
        return self._codec.dropped + self.stats.dropped

    @property
    def is_signed(self) -> bool:
        """Frames with a signature have been heard, whether or not a key is here to check them."""
        return self._codec.signed_in > 0

    def loss(self) -> float:
        """Return the share of the autopilot's frames that never arrived, by their sequence numbers."""
        return self.stats.loss()

    # ---------------------------------------------------------------------------------------- messages
    def subscribe(self, callback: OnMessage) -> Callable[[], None]:
        """Hand every message of the autopilot's system to ``callback(t_s, message)``; call the result to stop."""
        entry = (getattr(callback, "__qualname__", repr(callback)), callback)
        self._subscribers = (*self._subscribers, entry)

        def stop() -> None:
            self._subscribers = tuple(other for other in self._subscribers if other is not entry)

        return stop

    def send(self, *messages: Message) -> None:
        """Send messages; a link that is down drops them and counts."""
        for message in messages:
            frame = self._codec.pack(message)
            self.stats.frames_out += 1
            now = self._now()
            self._throughput.note(now, sent=len(frame))
            self.transport.write(frame)
            if self._sink is not None:
                self.guard("the tlog", self._sink, now, frame)

    def acknowledge(self, command: int, result: int, system: int, component: int) -> None:
        """Answer a command to who gave it."""
        self.send(wire.MAVLink_command_ack_message(command, result, 0, 0, system, component))

    def started(self) -> None:
        """Say from now on that we are at work: a second companion gives way to us."""
        self._system_status = wire.MAV_STATE_ACTIVE

    def lock(self, channel: str) -> asyncio.Lock:
        """Return the lock of a kind of conversation: two uploads at once would spoil each other."""
        return self._locks.setdefault(channel, asyncio.Lock())

    @contextlib.contextmanager
    def burst(self) -> Iterator[None]:
        """Take what comes all at once meanwhile: for tools that ask for a long list, not for a boat under way."""
        self._reception.expects_burst = True
        try:
            yield
        finally:
            self._reception.expects_burst = False

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
        if answer.outcome is TransferOutcome.TIMEOUT and self.is_lost:
            return CommandAnswer(outcome=TransferOutcome.LINK, text="the link is silent")
        return answer

    # ------------------------------------------------------------------------------------------ inside
    def _now(self) -> float:
        return now_s() if self._stamp is None else self._stamp(now_s())

    def guard(self, whose: str, call: Callable[..., Any], *args: Any) -> Any:
        """Call somebody who listens; what is raised ends here, or one listener's fault would end the transport."""
        try:
            return call(*args)
        except Exception as error:
            self._fault(whose, error)
            return None

    def _fault(self, whose: str, error: Exception) -> None:
        self.stats.faults[whose] += 1
        if self.stats.faults[whose] == 1 and self._on_fault is not None:
            # nobody is left to tell about the teller's own fault
            with contextlib.suppress(Exception):
                self._on_fault(f"{whose} failed on what was heard, and goes on without it: {error!r}")

    async def _turn(self) -> None:
        """Note that the loop turns: what is read long after the last turn has waited for us, and nobody was silent."""
        while True:
            self._turned_s = now_s()
            await asyncio.sleep(TURN_S)

    def _take_bytes(self, data: bytes) -> None:
        now = self._now()
        if now - self._turned_s > TURN_S + HELD_S and self._signing is None:
            self._doubt_until_s = now + DOUBT_S
        self._throughput.note(now, received=len(data))
        for message in self._codec.feed(data):
            try:  # as ``guard`` does; fifty messages a second, each to several listeners, are worth the lines
                self._take(now, message)
            except Exception as error:
                self._fault("the link", error)

    def _take(self, now: float, message: Message) -> None:
        if self._reception.is_repeat(message):
            return
        if now < self._doubt_until_s and self._reception.is_out_of_turn(message):
            self.stats.dropped[Drop.HELD] += 1  # and not recorded: a replay knows nothing of our turns
            return
        self.stats.frames_in += 1
        if self._sink is not None:
            self.guard("the tlog", self._sink, now, bytes(message.get_msgbuf()))
        heard = self._reception.hear(now, message)
        if not self._decided.is_set():
            self._decide(now)
        if heard is Heard.NOTHING:
            return
        kind = message.get_type()
        if heard is Heard.OURS and message.get_srcComponent() == codec.AUTOPILOT_COMPONENT:
            if now < self._doubt_until_s and getattr(message, "time_boot_ms", None) is not None:
                self._doubt_until_s = -math.inf  # the count is known again
            self.monitor.heard(now, kind)
            self._notice_boot(now, kind, message)
            if kind == "HEARTBEAT" and codec.is_autopilot_heartbeat(message):
                self._take_heartbeat(now)
        if kind in {"COMMAND_LONG", "COMMAND_INT"}:
            self._take_command(message)
        for name, callback in self._subscribers:
            try:
                callback(now, message)
            except Exception as error:
                self._fault(name, error)

    def _decide(self, now: float) -> None:
        """Begin, once our autopilot is known; or give up, when it cannot be."""
        self._reception.choose(now)
        if not self._reception.is_decided:
            return
        self._decided.set()
        if self._reception.target is not None:
            self._codec.system = self._reception.own_system
            self._rates.wanted.set()
            self._heartbeat_s = now
            self._found.set()

    def _take_heartbeat(self, now: float) -> None:
        if self._heartbeat_s is None or now - self._heartbeat_s > GAP_S:
            self._rates.wanted.set()
        self._heartbeat_s = now

    def _take_command(self, message: Message) -> None:
        """Answer a command addressed to this component by name; those to everybody are the autopilot's."""
        if not self._reception.is_for_us_alone(message):
            return
        result = wire.MAV_RESULT_UNSUPPORTED
        if self.on_command is not None:
            answer = self.guard("on_command", self.on_command, message)
            result = wire.MAV_RESULT_FAILED if answer is None else answer
        if result != LATER:
            self.acknowledge(message.command, result, message.get_srcSystem(), message.get_srcComponent())

    def _notice_boot(self, now: float, kind: str, message: Message) -> None:
        boot_ms = getattr(message, "time_boot_ms", None)
        if boot_ms is None or kind == "NAMED_VALUE_FLOAT":
            return
        boot_s = since_boot_s(boot_ms, None if self._boot_s is None else self._boot_s + now - self._boot_heard_s)
        if self._boot_s is not None and boot_s < self._boot_s - GAP_S:
            self.stats.reboots += 1
            self._boot_s = None
            self.stats.last_seq.clear()
            self._rates.wanted.set()
        if self._boot_s is None or boot_s > self._boot_s:
            self._boot_s, self._boot_heard_s = boot_s, now

    async def _beat(self) -> None:
        """Send the heartbeat; watch for streams that fell below their rate."""
        next_s = now_s()
        connections = self.transport.stats.connections
        spoken, spoken_s = 0, 0.0
        while True:
            if self.transport.stats.connections != connections:
                # a new connection may be a new port of the autopilot, which knows nothing of what was asked before
                connections = self.transport.stats.connections
                self._rates.wanted.set()
                spoken = 0
            # A listener speaks too, but little: the autopilot forwards nothing to a link on which nobody spoke.
            is_new = spoken < 2 or not (self.is_alive or self._reception.census.heard(self._now()))
            if not self._is_quiet or is_new or now_s() - spoken_s >= LISTENER_BEAT_S:
                self.send(codec.heartbeat(self._system_status, self._identity.token))
                spoken += self.transport.state is TransportState.OPEN
                spoken_s = now_s()
            if self._signing is not None:
                self._advance_signing()
            now = now_s()
            if not self._decided.is_set():
                self._decide(self._now())
            elif self.is_alive:
                self._rates.look(now)
            next_s = max(next_s + HEARTBEAT_S, now)
            await asyncio.sleep(next_s - now)

    def _advance_signing(self) -> None:
        """Let the signing timestamp follow the clock since the start, so that replayed frames grow old."""
        assert self._signing is not None
        self._codec.set_signing_time(self._signing.follow(now_s()))
        self._signing.save()

    def _diagnosis(self) -> str:
        stats, dropped = self.transport.stats, self.dropped()
        if stats.bytes_in == 0:
            said = f" ({stats.last_error})" if stats.last_error else ""
            return f"nothing was heard at all{said}; check the link's name, the wiring and who else uses it"
        if dropped[Drop.MAVLINK_1]:
            return "it speaks MAVLink 1; set SERIALn_PROTOCOL 2 on the autopilot's port"
        if dropped[Drop.BAD_SIGNATURE]:
            return "its frames are not signed with this key"
        if dropped[Drop.UNSIGNED]:
            return "its frames are not signed; 'companion key set' puts a key on the autopilot"
        if self.stats.frames_in == 0:
            return f"{counted(stats.bytes_in, 'byte')} and no MAVLink frame among them; check the baud rate"
        census = self._reception.census
        wanted = f" of system {census.wanted}" if census.wanted is not None else ""
        heard = census.heard(self._now())
        others = f"; heard: {listed(heard)}" if heard else ""
        return f"{counted(self.stats.frames_in, 'frame')}, but no autopilot's heartbeat{wanted}{others}"
