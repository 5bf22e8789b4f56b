"""The rates of an autopilot's messages: asked for one by one, and again when they were forgotten."""

from __future__ import annotations

import asyncio
from typing import Protocol

from pymavlink.dialects.v20 import ardupilotmega as wire

from companion.clock import now_s
from companion.mavlink.transfers.commands import CommandAnswer
from companion.mavlink.transfers.machines import Outcome
from companion.mavlink.wire.streams import StreamMonitor

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
                if answer.outcome in {Outcome.REFUSED, Outcome.UNSUPPORTED}:
                    self._refused.add(stream.name)
                if answer.outcome is Outcome.LINK:
                    break  # the next heartbeat after the gap asks again
