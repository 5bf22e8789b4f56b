"""Commands of the operator: orders as they come in by the link, for the next step, and the answers that go back."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Any

from companion.clock import now_s
from companion.mavlink.autopilot import Autopilot
from companion.mavlink.link import LATER, Link
from companion.mavlink.wire import CONTROL_COMMAND, Drop
from companion.messages import Severity
from companion.orders import COMMANDS, LOCAL, MAVLINK, RESULTS, Answer, Order, Result, Source, Wanted, wanted_of
from companion.skipper.step import Acknowledge

# What comes in one step beyond this is sent away: each order costs the radio an answer.
MOST_WAITING = 4
LOOK_S = 5.0


class OperatorCommands:
    """Takes the commands that are orders, from whoever names us; other commands stay unsupported.

    Before ``begin`` they are sent away: nobody would answer them.
    """

    def __init__(self, link: Link, *, has_key: bool) -> None:
        self._link, self._authority = link, "signed" if has_key else "unsigned"
        self._waiting: list[Order] = []
        self._is_open = False
        self._asked: dict[tuple[str, int], asyncio.Future[Answer]] = {}   # by the way and the number of who asks
        self.wants_high_latency = False   # HIGH_LATENCY2 was asked for
        link.on_command = self._hear

    def begin(self) -> None:
        """Hear orders from now on."""
        self._is_open = True

    def take(self) -> list[Order]:
        """Return the orders since the last step, in the order in which they came."""
        orders, self._waiting = self._waiting, []
        return orders

    @property
    def unsigned(self) -> int:
        """How many commands to us were not signed with our key."""
        return self._link.dropped()[Drop.UNSIGNED_COMMAND]

    async def ask(self, wanted: Wanted, number: int, way: str = LOCAL) -> Answer:
        """Give an order that comes on another way than the link, and return its answer.

        ``number`` is its own among those that wait: of the connection on board, of the order from far away.
        """
        if not self._is_open:
            return Answer(result=Result.NOT_NOW, text="the companion is not under way yet")
        answer: asyncio.Future[Answer] = asyncio.get_running_loop().create_future()
        self._asked[way, number] = answer
        self._waiting.append(Order(
            wanted=wanted, t_s=now_s(), authority=way, source=Source(kind=way, component=number)))
        try:
            return await answer
        finally:
            del self._asked[way, number]

    def answered(self, action: Acknowledge) -> None:
        """Take an answer to where the order came from."""
        asked = self._asked.get((action.way, action.component))
        if action.way == MAVLINK:
            self._link.acknowledge(action.command, RESULTS[action.result], action.system, action.component)
        elif asked is not None and not asked.done():
            asked.set_result(Answer(result=action.result, text=action.text))

    async def watch(self, autopilot: Autopilot, record: Callable[[dict[str, Any]], None]) -> None:
        """Say and record, once, that somebody without the key gives commands."""
        text = "somebody without this boat's key gives commands to the companion: they count for nothing"
        while True:
            if self.unsigned:
                autopilot.say(int(Severity.WARNING), text)
                record({"kind": "refusal", "what": "unsigned commands", "text": text})
                return
            await asyncio.sleep(LOOK_S)

    def _hear(self, message: Any) -> int:
        if message.command == CONTROL_COMMAND:
            if message.param1 not in {0.0, 1.0}:
                return RESULTS[Result.REFUSED]
            self.wants_high_latency = message.param1 == 1.0
            return RESULTS[Result.DONE]
        if message.command not in COMMANDS:
            return RESULTS[Result.UNKNOWN]
        if not self._is_open or len(self._waiting) >= MOST_WAITING:
            return RESULTS[Result.NOT_NOW]
        self._waiting.append(Order(
            wanted=wanted_of(message), t_s=now_s(), command=int(message.command), authority=self._authority,
            source=Source(kind=MAVLINK, system=message.get_srcSystem(), component=message.get_srcComponent())))
        return LATER
