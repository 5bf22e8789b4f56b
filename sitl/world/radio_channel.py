"""One channel that several transmit on, as a radio's: what one says, all the others hear."""

from __future__ import annotations

from collections.abc import Callable

from companion.mavlink.transports import OnBytes, Transport, TransportState, TransportStats


class RadioChannel:
    """The companion's end of the channel; a ``Transport``.

    Args:
        ends: the boats' ends, one for each autopilot in range.
        on_heard: gets every piece that a boat says, before the companion does: for one who listens.
    """

    def __init__(self, *ends: Transport, on_heard: Callable[[bytes], None] | None = None) -> None:
        self._ends, self._on_heard = ends, on_heard
        self._on_bytes: OnBytes | None = None

    @property
    def name(self) -> str:
        """A name for messages."""
        return "air:" + "+".join(end.name for end in self._ends)

    @property
    def stats(self) -> TransportStats:
        """The counters of the first end."""
        return self._ends[0].stats

    @property
    def state(self) -> TransportState:
        """Open or closed."""
        return self._ends[0].state

    async def open(self, on_bytes: OnBytes) -> None:
        """Start to hear."""
        self._on_bytes = on_bytes
        for end in self._ends:
            await end.open(self._hear)

    def write(self, data: bytes) -> None:
        """Speak to everybody."""
        for end in self._ends:
            end.write(data)

    async def close(self) -> None:
        """Stop to hear."""
        for end in self._ends:
            await end.close()
        self._on_bytes = None

    def say(self, data: bytes) -> None:
        """Let the companion hear what no boat said."""
        if self._on_bytes is not None:
            self._on_bytes(data)

    def _hear(self, data: bytes) -> None:
        if self._on_heard is not None:
            self._on_heard(data)
        self.say(data)
