"""A bad link for live runs: a relay between the companion and the autopilot's port that loses what it is told to.

What the autopilot's own simulator cannot break, the vane, is broken here too.
"""

from __future__ import annotations

import asyncio
import contextlib
from types import TracebackType
from typing import Self

from companion.mavlink.transports import open_link
from sitl.autopilot import FrameStream, Impairment, MemoryLink
from sitl.scene import EventSpec, free_port
from sitl.trouble.false_vane import FalseVane

LINK_EVENTS = frozenset({"link_cut", "link_half", "link_quality"})


async def befall(line: MemoryLink, event: EventSpec) -> None:
    """Cut or impair ``line`` as ``event`` says, and mend it after ``for_s``."""
    end = line.near if event.state == "unheard" else line.far    # whose words are lost
    if event.kind == "link_cut":
        line.cut()
    elif event.kind == "link_half":
        end.is_mute = True
    else:
        line.impairment = Impairment(loss=event.loss, duplicate=event.duplicate, reorder=event.reorder,
                                     corrupt=event.corrupt, noise=event.noise, delay_s=event.delay_s)
    if event.for_s is None:
        return
    await asyncio.sleep(event.for_s)
    if event.kind == "link_cut":
        line.mend()
    elif event.kind == "link_half":
        end.is_mute = False
    else:
        line.impairment = Impairment()


class Relay:
    """Between the companion's ``link`` and the autopilot's ``boat_link``; faults are those of ``line``, by frames."""

    def __init__(self, boat_link: str, *, seed: int) -> None:
        self.line = MemoryLink("relay", seed=seed)
        port = free_port()
        self.link = f"udpin:127.0.0.1:{port}"
        self._companion, self._boat = open_link(f"udpout:127.0.0.1:{port}"), open_link(boat_link)
        self.vane = FalseVane(seed=seed)
        self._frames = FrameStream()
        self._stack = contextlib.AsyncExitStack()

    async def __aenter__(self) -> Self:
        """Connect both sides."""
        near, far = self.line.near, self.line.far
        await near.open(self._companion.write)
        await far.open(self._boat.write)
        for side, take in ((self._companion, near.write), (self._boat, self._from_boat)):
            await side.open(take)
            self._stack.push_async_callback(side.close)
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Hang up."""
        await self._stack.aclose()

    def _from_boat(self, data: bytes) -> None:
        """Take a piece of the autopilot's stream: a fault befalls one frame, not two halves."""
        for frame in self._frames.take(data):
            self.line.far.write(self.vane.pass_on(frame))
