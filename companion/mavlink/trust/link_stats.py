"""What a link has counted: frames, losses, bytes a second, faults of those who listen."""

from __future__ import annotations

from collections import Counter, deque
from dataclasses import dataclass, field

from companion.mavlink.wire.frames import Drop

RATE_WINDOW_S = 10.0


@dataclass(slots=True)
class LinkStats:
    """Counters of a link; ``faults`` by whose they are: what a subscriber raised and nobody else suffered from."""

    frames_in: int = 0
    frames_out: int = 0
    frames_lost: int = 0
    reboots: int = 0
    dropped: Counter[Drop] = field(default_factory=Counter)
    faults: Counter[str] = field(default_factory=Counter)
    last_seq: dict[tuple[int, int], int] = field(default_factory=dict)

    def count(self, system: int, component: int, seq: int) -> None:
        """Count what was lost before a frame, by the sender's sequence numbers."""
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
        """Return the share of frames that never arrived."""
        total = self.frames_in + self.frames_lost
        return self.frames_lost / total if total else 0.0


class Throughput:
    """Bytes a second in both directions, over the last 10 s."""

    def __init__(self) -> None:
        self._pieces: deque[tuple[float, int, int]] = deque()
        self._received = self._sent = 0   # the sums of what is kept

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
