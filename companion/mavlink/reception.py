"""What of the frames on a link is ours to hear: who is who, repeats, echoes, forgeries. Pure."""

from __future__ import annotations

import enum
import math
from collections import Counter, deque
from collections.abc import Callable
from dataclasses import dataclass, field

from pymavlink.dialects.v20 import ardupilotmega as wire

from companion.mavlink.vehicle_identity import Census, CensusState
from companion.mavlink.wire import codec
from companion.mavlink.wire.boot_time import since_boot_s
from companion.mavlink.wire.frames import Drop, Message

RATE_WINDOW_S = 10.0


@dataclass(slots=True)
class LinkStats:
    """Counters of a link; ``faults`` by whose they are: what a subscriber raised and nobody else suffered from."""

    frames_in: int = 0
    frames_out: int = 0
    frames_counted: int = 0  # by their sequence numbers: those of the vehicle
    frames_lost: int = 0
    reboots: int = 0
    dropped: Counter[Drop] = field(default_factory=Counter)
    faults: Counter[str] = field(default_factory=Counter)
    last_seq: dict[tuple[int, int], int] = field(default_factory=dict)

    def count(self, system: int, component: int, seq: int) -> None:
        """Count what was lost before a frame, by the sender's sequence numbers."""
        self.frames_counted += 1
        last = self.last_seq.get((system, component))
        if last is not None:
            gap = (seq - last) % 256
            if gap > 128:
                # an overtaken frame: it was counted as lost when its follower came
                self.frames_lost = max(0, self.frames_lost - 1)
                return
            if gap > 1:
                self.frames_lost += gap - 1
        self.last_seq[system, component] = seq

    def loss(self) -> float:
        """Return the share of the vehicle's frames that never arrived."""
        total = self.frames_counted + self.frames_lost
        return self.frames_lost / total if total else 0.0


class Throughput:
    """Bytes a second in both directions, over the last 10 s."""

    def __init__(self) -> None:
        self._pieces: deque[tuple[float, int, int]] = deque()
        self._received = self._sent = 0  # the sums of what is kept

    def note(self, t_s: float, *, received: int = 0, sent: int = 0) -> None:
        """Note bytes."""
        self._pieces.append((t_s, received, sent))
        self._received += received
        self._sent += sent
        self._forget(t_s)

    def bytes_per_s(self, t_s: float) -> tuple[float, float]:
        """Return what came in and went out [bytes/s]."""
        self._forget(t_s)
        return self._received / RATE_WINDOW_S, self._sent / RATE_WINDOW_S

    def _forget(self, t_s: float) -> None:
        while self._pieces and t_s - self._pieces[0][0] > RATE_WINDOW_S:
            _, received, sent = self._pieces.popleft()
            self._received -= received
            self._sent -= sent


# A delay only ever makes a message late: ahead of the clock by more than this it is not the autopilot's [s].
AHEAD_S = 0.5
# A message that waited longer than this on its way is of no use [s].
BEHIND_S = 5.0
# How fast the two clocks may run apart: a hurried simulator's does by a few parts in a hundred. Nor is the clock led
# faster than this by messages that are only a little wrong.
DRIFT = 0.05
# What came soonest is forgotten as fast as two quartz clocks can run apart, and believed again ten times as fast.
FORGET, RECALL = 1e-4, 1e-3
# Another clock is believed when so many messages agree on it over this time, and the old one is silent for it [s].
SWITCH_S = 1.0
SWITCH_COUNT = 3
# Another clock that goes on this long beside the first one, with so many messages, is another autopilot [s].
CONTEST_S = 3.0
CONTEST_COUNT = 5
# ... until it has been silent for this long [s].
CONTEST_OVER_S = 10.0

# A stream of frames counts while one came within this time [s]; after a longer gap any count may go on.
ALIVE_S = 1.5
# Since the last boot time that was right the count has run on at this many times its rate, and a burst [frames].
FASTER, BURST = 2.0, 8
FIRST_RATE_HZ = 50.0
# From frame to frame it goes one on, and over what the link loses: a run of losses as rare as this is none. After so
# long a silence more may be missing [s].
STEP, RARE, SILENCE_S = 1, 1e-3, 0.5
# Overtaken frames are late by this at most [s].
LATE_S = 0.5
# Rate and loss are those of this time of the autopilot's own clock: ours may be held up, or hurried [s].
WINDOW_S = 1.2
# Messages with a right boot time that vouch for their stream.
VOUCHERS = 3
MAX_STREAMS = 4


class BootClock:
    """The autopilot's boot time against ours, with one rival for it.

    Messages wait, and none comes early: while all of them do the clock is led to their delay, and it is remembered how
    soon they came before, for they will again.
    """

    def __init__(self) -> None:
        self.is_new = False  # the last message that fitted began a new clock
        self._offset_s: float | None = None
        self._soonest_s = 0.0
        self._last_s = 0.0
        self._rival_s = 0.0
        self._rival_count = 0
        self._rival_first_s = -math.inf
        self._rival_last_s = -math.inf

    def since_boot_s(self, t_s: float, boot_ms: int) -> float:
        """Return the time since the boot [s] of a message heard at ``t_s`` [s], over the end of its 32 bits."""
        return since_boot_s(boot_ms, None if self._offset_s is None else t_s - self._offset_s)

    def take(self, t_s: float, boot_s: float) -> bool:
        """Return whether a message of ``boot_s`` heard at ``t_s`` [s] fits."""
        offset_s, self.is_new = t_s - boot_s, False
        if self._offset_s is None:
            self._begin(t_s, offset_s)
            return True
        drift_s = DRIFT * max(0.0, t_s - self._last_s)
        if -AHEAD_S - drift_s <= offset_s - self._soonest_s and offset_s - self._offset_s <= BEHIND_S + drift_s:
            rate = FORGET if offset_s >= self._soonest_s else -RECALL
            soonest_s = self._soonest_s + rate * max(0.0, t_s - self._last_s)
            self._offset_s += min(max(offset_s - self._offset_s, -drift_s), drift_s)
            self._soonest_s = min(max(soonest_s, self._offset_s - BEHIND_S), self._offset_s)
            self._last_s = t_s
            return True
        if self._rival_count == 0 or abs(offset_s - self._rival_s) > AHEAD_S or t_s - self._rival_last_s > ALIVE_S:
            self._rival_count, self._rival_first_s = 0, t_s
        self._rival_s, self._rival_last_s = offset_s, t_s
        self._rival_count += 1
        if self._rival_count >= SWITCH_COUNT and t_s - max(self._rival_first_s, self._last_s) >= SWITCH_S:
            self._begin(t_s, offset_s)
            self.is_new = True
            return True
        return False

    def is_contested(self, t_s: float) -> bool:
        """Return whether another clock goes on beside this one: two autopilots speak as one.

        One that is ahead by no more than messages wait may be the same autopilot's, whose first messages had waited.
        """
        is_ahead = self._offset_s is not None and -BEHIND_S <= self._rival_s - self._offset_s < 0.0
        return (
            not is_ahead
            and self._rival_count >= CONTEST_COUNT
            and self._rival_last_s - self._rival_first_s >= CONTEST_S
            and t_s - self._rival_last_s <= CONTEST_OVER_S
        )

    def _begin(self, t_s: float, offset_s: float) -> None:
        self._offset_s = self._soonest_s = offset_s
        self._last_s = t_s
        self._rival_count = 0


class _MessageStream:
    """Frames that count up. A right boot time anchors the count: no other frame can lead it away."""

    def __init__(self, t_s: float, seq: int) -> None:
        self.last_s = t_s
        self.vouchers = 0
        self._seq = self._anchor_seq = seq
        self._anchor_s = t_s
        self._anchor_boot_s, self._since_boot_s = -math.inf, math.nan
        self._rate_hz, self._step = FIRST_RATE_HZ, STEP + BURST
        self._counted = self._heard = 0
        self._seen_s = [-math.inf] * 256

    @property
    def is_vouched(self) -> bool:
        """Its boot times have been right."""
        return self.vouchers >= VOUCHERS

    def holds(self, t_s: float, seq: int, *, is_timed: bool, may_skip: bool = True) -> bool:
        """Return whether the stream can have come to ``seq``.

        ``is_timed``: its boot time is right; ``may_skip``: the autopilot is silent on its other streams, too.
        """
        since_s = t_s - self._anchor_s
        room = BURST + FASTER * self._rate_hz * since_s
        gone = (seq - self._anchor_seq) % 256 or 256
        if gone <= room and (is_timed or (may_skip and since_s >= SILENCE_S)):
            return True
        if gone <= room and 0 < (seq - self._seq) % 256 <= self._step:
            return True
        is_late = (self._seq - seq) % 256 <= BURST + LATE_S * self._rate_hz
        return is_late and (is_timed or t_s - self._seen_s[seq] > 128.0 / self._rate_hz)

    def take(self, t_s: float, seq: int, boot_s: float | None) -> None:
        """Count a frame that it holds; ``boot_s`` is right, or None."""
        self.last_s = self._seen_s[seq] = t_s
        self._heard += 1
        if boot_s is None or boot_s < self._anchor_boot_s:
            if (seq - self._seq) % 256 < 128:
                self._seq = seq
            return
        self.vouchers += 1
        self._counted += (seq - self._anchor_seq) % 256
        self._seq = self._anchor_seq = seq
        self._anchor_s, self._anchor_boot_s = t_s, boot_s
        if math.isnan(self._since_boot_s):
            self._since_boot_s, self._counted, self._heard = boot_s, 0, 0
        if boot_s - self._since_boot_s >= WINDOW_S:
            self._rate_hz = max(1.0, self._counted / (boot_s - self._since_boot_s))
            lost = min(0.9, max(0.0, 1.0 - self._heard / max(1, self._counted)))
            self._step = STEP + (math.ceil(math.log(RARE) / math.log(lost)) if lost > RARE else 0)
            self._counted, self._heard, self._since_boot_s = 0, 0, boot_s


class PlausibilityFilter:
    """Judges every message of the autopilot's own component, in the order of arrival: they must fit together.

    Whoever can write to a link without a key can send a frame with the autopilot's ids. Two things in a frame are hard
    to get right without listening first: the boot time that many messages carry, and the sequence number of every
    frame. The boot times of one autopilot run with our clock, so a message that is ahead of it or far behind is not
    used; and frames count up, at the rate at which they come, so a frame that is out of step with a stream of frames
    whose boot times are right is not used either. A new clock (a reboot) or a new count (a gap, a second route) is
    believed when it goes on and the old one does not contradict it.

    A forger who listens gets both right. Against that one there is only a key.
    """

    def __init__(self) -> None:
        self.clock = BootClock()
        self._streams: list[_MessageStream] = []

    def objection(self, t_s: float, message: Message) -> Drop | None:
        """Return why ``message``, heard at ``t_s`` [s], is not used, None when it is."""
        boot_ms = getattr(message, "time_boot_ms", None)
        boot_s = None if boot_ms is None else self.clock.since_boot_s(t_s, boot_ms)
        if boot_s is not None:
            if not self.clock.take(t_s, boot_s):
                return Drop.WRONG_CLOCK
            if self.clock.is_new:
                self._streams.clear()
        is_guarded = False
        for s in self._streams:  # asked at every message: a loop, not a generator
            if s.vouchers >= VOUCHERS and t_s - s.last_s <= ALIVE_S:
                is_guarded = True
                break
        stream = self._stream_of(t_s, message.get_seq(), boot_s)
        return Drop.OUT_OF_STEP if is_guarded and not stream.is_vouched else None

    def _stream_of(self, t_s: float, seq: int, boot_s: float | None) -> _MessageStream:
        """Return the stream that the frame belongs to, one that is vouched for first; a new one where none can be."""
        if len(self._streams) > 1:
            self._bury(t_s)
        streams, spoke_s = self._streams, -math.inf
        if len(streams) > 1:
            streams = sorted(streams, key=lambda s: -min(s.vouchers, VOUCHERS))
            spoke_s = max(s.last_s for s in streams if s.is_vouched) if streams[0].is_vouched else spoke_s
        for stream in streams:
            if stream.holds(
                t_s, seq, is_timed=boot_s is not None, may_skip=stream.last_s == spoke_s or t_s - spoke_s >= SILENCE_S
            ):
                stream.take(t_s, seq, boot_s)
                return stream
        if len(self._streams) >= MAX_STREAMS:
            self._streams.remove(min(self._streams, key=lambda s: (s.is_vouched, s.last_s)))
        stream = _MessageStream(t_s, seq)
        self._streams.append(stream)
        stream.take(t_s, seq, boot_s)
        return stream

    def _bury(self, t_s: float) -> None:
        """Forget streams that died while a vouched one lives: the longer they are silent, the more they would hold."""
        if any(s.is_vouched and t_s - s.last_s <= ALIVE_S for s in self._streams):
            self._streams = [s for s in self._streams if t_s - s.last_s <= ALIVE_S]


Objection = Callable[[float, Message], Drop | None]

OWN_COMPONENT = 191  # MAV_COMP_ID_ONBOARD_COMPUTER
TOOL_COMPONENT = 192  # ..._COMPUTER2: a tool that looks in beside a companion that sails
_DUPLICATE_WINDOW = 32
_COMMANDS = frozenset({"COMMAND_LONG", "COMMAND_INT"})


@dataclass(frozen=True, slots=True)
class LinkIdentity:
    """Who we are. ``system`` None: the autopilot's own, detected. ``token``: tells our heartbeat from another's."""

    system: int | None = None
    component: int = OWN_COMPONENT
    token: int = 0


# Who listens or gives orders through a link of its own, ashore. Not 255: the autopilot takes that for its ground
# station, whose silence afterwards sets off a failsafe.
SHORE = LinkIdentity(system=254, component=190)


class Heard(enum.Enum):
    """What a message is to us."""

    NOTHING = "nothing"  # not ours to hear; counted
    OURS = "ours"  # of the autopilot's system, and believed
    ORDER = "order"  # of another system: a command to us by our ids


class Reception:
    """Judges every good frame of one link, in the order of arrival.

    Args:
        identity: our ids.
        wanted: the autopilot's system id, None: the only one that is heard.
        objection: says what is wrong with a message of the autopilot's system, None: nothing; asked once for each.
        stats: where what is not heard is counted.
    """

    def __init__(
        self, identity: LinkIdentity, wanted: int | None, objection: Objection | None, stats: LinkStats
    ) -> None:
        self.census = Census(wanted)
        self.own_system = identity.system or wanted or 1
        self.target: int | None = None
        self.refusal = ""
        self._identity, self._stats = identity, stats
        self._objection = objection or _of_the_autopilot(PlausibilityFilter())
        self.expects_burst = False  # more frames were asked for at once than a stream has: their numbers prove nothing
        self._unheard: Counter[int] = Counter()
        self._recent: dict[tuple[int, int, int, int, int], None] = {}  # the last frames, oldest first

    @property
    def is_decided(self) -> bool:
        """Our autopilot was found, or it cannot be told which it is."""
        return self.target is not None or bool(self.refusal)

    def unheard(self, system: int) -> int:
        """Return how many messages of ``system`` came before it was known to be ours."""
        return self._unheard[system]

    def is_repeat(self, message: Message) -> bool:
        """Return whether the very frame was here just now."""
        header = message.get_header()
        key = (header.srcSystem, header.srcComponent, header.seq, header.msgId, message.get_crc() or 0)
        if key in self._recent:
            self._stats.dropped[Drop.DUPLICATE] += 1
            return True
        self._recent[key] = None
        if len(self._recent) > _DUPLICATE_WINDOW:
            del self._recent[next(iter(self._recent))]
        return False

    def is_out_of_turn(self, message: Message) -> bool:
        """Return whether a message of the autopilot's carries no time and is not the very next after the last heard.

        That proves nothing of it while messages are lost. But where they only waited for us, they come in order.
        """
        system, component = message.get_srcSystem(), message.get_srcComponent()
        if system != self.target or component != codec.AUTOPILOT_COMPONENT:
            return False
        last = self._stats.last_seq.get((system, component))
        is_timed = getattr(message, "time_boot_ms", None) is not None
        return not is_timed and last is not None and message.get_seq() != (last + 1) % 256

    def choose(self, t_s: float) -> None:
        """Take the autopilot that is ours, once it is known."""
        if self.is_decided:
            return
        choice = self.census.choice(t_s)
        if choice.standing is CensusState.LISTENING:
            return
        self.refusal, self.target = choice.reason, choice.system
        if choice.system is not None and self._identity.system is None:
            self.own_system = choice.system

    def hear(self, t_s: float, message: Message) -> Heard:
        """Return what ``message``, heard at ``t_s`` [s], is to us."""
        system, component, kind = message.get_srcSystem(), message.get_srcComponent(), message.get_type()
        if kind == "HEARTBEAT":
            self.census.take(t_s, message)
        if self.target is None:
            self.choose(t_s)
        if component == self._identity.component:
            self._notice_companion(t_s, message, kind)
            if system in {self.target, self.own_system}:
                self._stats.dropped[Drop.OWN_IDS] += 1  # an echo of what we said, or a second companion's
                return Heard.NOTHING
        if system != self.target:
            if self.target is None and component != self._identity.component:
                self._unheard[system] += 1
            return self._of_another(message, kind)
        objection = self._objection(t_s, message)
        if objection is not None and not (self.expects_burst and objection is Drop.OUT_OF_STEP):
            self._stats.dropped[objection] += 1
            return Heard.NOTHING
        self._stats.count(system, component, message.get_seq())
        return Heard.OURS

    def is_for_us_alone(self, message: Message) -> bool:
        """Return whether a message with a target means this component by name."""
        return bool(message.target_system == self.own_system and message.target_component == self._identity.component)

    def _notice_companion(self, t_s: float, message: Message, kind: str) -> None:
        """Tell a second companion from the echo of our own heartbeat."""
        if (
            kind == "HEARTBEAT"
            and message.type == wire.MAV_TYPE_ONBOARD_CONTROLLER
            and (message.custom_mode != self._identity.token)
        ):
            self.census.take_companion(t_s, message)

    def _of_another(self, message: Message, kind: str) -> Heard:
        """Other systems are not ours to listen to, except a ground station that commands us by our ids."""
        if kind in _COMMANDS and self.is_for_us_alone(message):
            return Heard.ORDER
        if kind != "HEARTBEAT" or message.type != wire.MAV_TYPE_GCS:
            self._stats.dropped[Drop.FOREIGN_SYSTEM] += 1
        return Heard.NOTHING


def _of_the_autopilot(witness: PlausibilityFilter) -> Objection:
    """Return the judgement of one who has no key: the autopilot's own messages must fit together."""

    def objection(t_s: float, message: Message) -> Drop | None:
        return witness.objection(t_s, message) if message.get_srcComponent() == codec.AUTOPILOT_COMPONENT else None

    return objection
