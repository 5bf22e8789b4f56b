"""A satellite link: messages that take minutes, are lost, come twice and overtake each other; and the shore behind it.

The boat's end is the folder of ``companion run --far``, which the modem's program shares: it takes ``out/status`` away
to send it and leaves what it has received in ``in``. Everything is drawn from a seed.
"""

from __future__ import annotations

import asyncio
import itertools
import random
from collections.abc import Callable, Coroutine
from pathlib import Path
from typing import Any

from companion.app.satellite import IN, OUT
from companion.clock import now_s
from companion.geo.frame import LocalFrame
from companion.orders import Wanted
from companion.orders.far import FarKey, FarOrder, FarStatus, minutes_of, pack_order, unpack_status
from sitl.scenario import EventSpec, SatelliteSpec

SESSION_S = 20.0  # a modem's session: so often it looks for something to send
PATIENCE_S = 900.0  # without an answer for so long the shore sends the same bytes again
KEY = bytes(range(32))


class Satellite:
    """The link between the boat's folder and the shore. ``run`` until cancelled; ``send`` is the shore's.

    Attributes:
        heard: what has arrived ashore, (time [s], bytes), in the order of its arrival.
        lost: how many messages never arrived, either way.
    """

    def __init__(self, spec: SatelliteSpec, folder: Path, *, seed: int, epoch_s: float, system: int = 1) -> None:
        self.key = FarKey(KEY, system)
        self.folder, self.epoch_s = folder, epoch_s
        self.heard: list[tuple[float, bytes]] = []
        self.lost = 0
        self._spec, self._rng = spec, random.Random(f"{seed} satellite")
        self._numbers, self._counters = itertools.count(1), itertools.count(1)
        self._under_way: set[asyncio.Task[None]] = set()

    async def run(self) -> None:
        """Be the modem on board."""
        path = self.folder / OUT
        try:
            while True:
                if path.exists():
                    data = path.read_bytes()
                    path.unlink()
                    self._carry(data, self._arrived)
                await asyncio.sleep(SESSION_S)
        finally:
            for task in self._under_way:
                task.cancel()

    def send(self, data: bytes, *, late_s: float = 0.0) -> None:
        """Send to the boat; ``late_s``: it lies somewhere for so long before."""
        self._carry(data, self._deliver, late_s)

    def order(self, wanted: Wanted, expires_s: float) -> tuple[int, bytes]:
        """Return a new order's counter and bytes; it expires after ``expires_s``, in whole minutes."""
        counter = next(self._counters)
        expires_min = minutes_of(self.epoch_s + now_s() + expires_s) + 1
        return counter, pack_order(FarOrder(wanted=wanted, counter=counter, expires_min=expires_min), self.key)

    def statuses(self) -> list[FarStatus]:
        """Return the statuses that have arrived, as the shore reads them."""
        return [unpack_status(data, self.key) for _, data in self.heard]

    def _carry(self, data: bytes, arrive: Callable[[bytes], None], late_s: float = 0.0) -> None:
        copies = 0 if self._rng.random() < self._spec.loss else 2 if self._rng.random() < self._spec.duplicate else 1
        self.lost += copies == 0
        for _ in range(copies):
            delay_s = late_s + self._rng.uniform(self._spec.delay_s, self._spec.delay_most_s)
            task = asyncio.create_task(_after(delay_s, lambda: arrive(data)), name="satellite")
            self._under_way.add(task)
            task.add_done_callback(self._under_way.discard)

    def _arrived(self, data: bytes) -> None:
        self.heard.append((now_s(), data))

    def _deliver(self, data: bytes) -> None:
        inbox = self.folder / IN
        inbox.mkdir(parents=True, exist_ok=True)
        name = f"{next(self._numbers):06d}.sbd"
        (inbox / f".{name}").write_bytes(data)
        (inbox / f".{name}").rename(inbox / name)


def _after(delay_s: float, do: Callable[[], None]) -> Coroutine[Any, Any, None]:
    async def wait() -> None:
        await asyncio.sleep(delay_s)
        do()

    return wait()


async def order_far(
    satellite: Satellite,
    event: EventSpec,
    frame: LocalFrame,
    wanted_by: Callable[[EventSpec, LocalFrame], Wanted],
    errors: list[str],
) -> None:
    """Give an event's order as a shore does that hears nothing for minutes; what was wrong goes to ``errors``.

    Without an answer the same bytes are sent again, unless the event says that they are late.
    """
    wanted = wanted_by(event, frame)
    counter, data = satellite.order(wanted, event.expires_s)
    said = ""
    try:
        while not said:
            satellite.send(data, late_s=event.late_s)
            again_s = now_s() + PATIENCE_S + event.late_s
            while not said and now_s() < again_s:
                await asyncio.sleep(SESSION_S)
                said = next((s.reply for s in satellite.statuses() if s.order == counter and s.reply), "")
    finally:
        if said != event.answer:
            errors.append(f"the order {wanted.words} from far away at {event.at_s:g} s was answered {said!r}")
