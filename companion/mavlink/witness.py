"""What of the autopilot's messages is believed on a link without a key: they must fit together. Pure.

Whoever can write to a link can send a frame with the autopilot's ids. Two things in a frame are hard to get right
without listening first: the boot time that many messages carry, and the sequence number of every frame. The boot
times of one autopilot run with our clock, so a message that is ahead of it or far behind is not used; and frames
count up, at the rate at which they come, so a frame that is out of step with a stream of frames whose boot times are
right is not used either. A new clock (a reboot) or a new count (a gap, a second route) is believed when it goes on and
the old one does not contradict it.

A forger who listens gets both right. Against that one there is only a key.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from companion.mavlink.frames import Drop, Message

# A delay only ever makes a message late: ahead of the clock by more than this it is not the autopilot's [s].
AHEAD_S = 0.5
# A message that waited longer than this on its way is of no use [s].
BEHIND_S = 5.0
# How fast the two clocks may run apart: a hurried simulator's does by a few parts in a hundred. Nor is the clock led
# faster than this by messages that are only a little wrong.
DRIFT = 0.05
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
# Frames of one moment come in a burst, of which a bad link loses some [frames].
BURST = 8
# The count may run at this many times the rate seen lately; overtaken frames are late by this at most [s].
FASTER = 2.0
LATE_S = 0.5
RATE_WINDOW_S = 1.0
FIRST_RATE_HZ = 50.0
# Messages with a right boot time that vouch for their stream.
VOUCHERS = 3
MAX_STREAMS = 4


class BootClock:
    """The autopilot's boot time against ours, with one rival for it."""

    def __init__(self) -> None:
        self.is_new = False           # the last message that fitted began a new clock
        self._offset_s: float | None = None
        self._last_s = 0.0
        self._rival_s = 0.0
        self._rival_count = 0
        self._rival_first_s = -math.inf
        self._rival_last_s = -math.inf

    def take(self, t_s: float, boot_s: float) -> bool:
        """Return whether a message of ``boot_s`` heard at ``t_s`` [s] fits."""
        offset_s, self.is_new = t_s - boot_s, False
        if self._offset_s is None:
            self._begin(t_s, offset_s)
            return True
        drift_s = DRIFT * max(0.0, t_s - self._last_s)
        if -AHEAD_S - drift_s <= offset_s - self._offset_s <= BEHIND_S + drift_s:
            self._offset_s += min(max(offset_s - self._offset_s, -drift_s), drift_s)
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
        """Return whether another clock goes on beside this one: two autopilots speak as one."""
        return (
            self._rival_count >= CONTEST_COUNT and self._rival_last_s - self._rival_first_s >= CONTEST_S
            and t_s - self._rival_last_s <= CONTEST_OVER_S
        )

    def _begin(self, t_s: float, offset_s: float) -> None:
        self._offset_s, self._last_s = offset_s, t_s
        self._rival_count = 0


@dataclass(slots=True)
class _Stream:
    """Frames that count up; ``missing`` are the numbers left out of late, which may still come."""

    seq: int
    last_s: float
    missing: set[int] = field(default_factory=set)
    counted: int = 0
    since_s: float = 0.0
    rate_hz: float = FIRST_RATE_HZ
    vouchers: int = 0

    def step_to(self, t_s: float, seq: int) -> int | None:
        """Return by how much ``seq`` is ahead of the count, None when the stream cannot have come there."""
        ahead = (seq - self.seq) % 256 or 256
        if ahead <= BURST + FASTER * self.rate_hz * (t_s - self.last_s):
            return ahead
        return ahead - 256 if seq in self.missing else None

    def take(self, t_s: float, ahead: int) -> None:
        """Count a frame."""
        if ahead <= 0:
            self.missing.discard((self.seq + ahead) % 256)
            return
        late = int(BURST + LATE_S * self.rate_hz)
        self.missing = {n for n in self.missing if (self.seq + ahead - n) % 256 <= late}
        self.missing |= {(self.seq + n) % 256 for n in range(max(1, ahead - late), ahead)}
        self.seq = (self.seq + ahead) % 256
        self.counted += ahead
        self.last_s = t_s
        if t_s - self.since_s >= RATE_WINDOW_S:
            self.rate_hz = max(1.0, self.counted / (t_s - self.since_s))
            self.counted, self.since_s = 0, t_s

    @property
    def is_vouched(self) -> bool:
        """Its boot times have been right."""
        return self.vouchers >= VOUCHERS


class Witness:
    """Judges every message of the autopilot's own component, in the order of arrival."""

    def __init__(self) -> None:
        self.clock = BootClock()
        self._streams: list[_Stream] = []

    def objection(self, t_s: float, message: Message) -> Drop | None:
        """Return why ``message``, heard at ``t_s`` [s], is not used, None when it is."""
        boot_ms = getattr(message, "time_boot_ms", None)
        if boot_ms is not None:
            if not self.clock.take(t_s, boot_ms / 1e3):
                return Drop.WRONG_CLOCK
            if self.clock.is_new:
                self._streams.clear()
        stream = self._stream_of(t_s, message.get_seq())
        is_guarded = any(s.is_vouched and t_s - s.last_s <= ALIVE_S for s in self._streams)
        was_vouched = stream.is_vouched
        if boot_ms is not None:
            stream.vouchers += 1
        return Drop.OUT_OF_STEP if is_guarded and not was_vouched else None

    def _stream_of(self, t_s: float, seq: int) -> _Stream:
        """Return the stream that the frame belongs to, the nearest count first; a new one where none can be."""
        steps = [(abs(ahead - 1), not s.is_vouched, n, ahead) for n, s in enumerate(self._streams)
                 if (ahead := s.step_to(t_s, seq)) is not None]
        if steps:
            *_, number, ahead = min(steps)
            self._streams[number].take(t_s, ahead)
            return self._streams[number]
        if len(self._streams) >= MAX_STREAMS:
            self._streams.remove(min(self._streams, key=lambda s: s.last_s))
        stream = _Stream(seq=seq, last_s=t_s, since_s=t_s)
        self._streams.append(stream)
        return stream
