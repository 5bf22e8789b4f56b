"""Giving an order through a link and hearing its answer: what a ground station, a script or the command line does."""

from __future__ import annotations

from typing import Any, Protocol

from companion.mavlink.microservices import Machine, Party
from companion.mavlink.reception import OWN_COMPONENT
from companion.mavlink.wire import Message, VehicleAssembler
from companion.messages import StatusText
from companion.orders.fields import COMMANDS, RESULTS, message_of
from companion.orders.order import Answer, Result, Wanted

AGAIN_S = 1.5        # the companion answers within a second; a slow radio takes another half
GIVE_UP_S = 15.0
WORDS_S = 3.0        # the sentence follows the acknowledgement; chunk by chunk on a slow radio
_BY_RESULT = {value: result for result, value in RESULTS.items()}


def lead_in(wanted: Wanted) -> str:
    """Return how the sentence begins that answers an order."""
    return f"order {wanted.verb or 'unknown'}: "


class OrderSend:
    """Sends an order until it is acknowledged, and waits a moment for the sentence. Pure step machine.

    ``party`` is the companion and we. ``result`` is None while it goes on; without an acknowledgement its own
    ``result`` is ``NO_ANSWER``.
    """

    def __init__(self, party: Party, wanted: Wanted, *, give_up_s: float = GIVE_UP_S) -> None:
        self.result: Answer | None = None
        self._party, self._wanted, self._give_up_s = party, wanted, give_up_s
        self._texts = VehicleAssembler()
        self._text = ""
        self._acknowledged: Result | None = None
        self._attempts, self._until_s, self._wake_s = 0, 0.0, 0.0

    @property
    def wake_s(self) -> float:
        """When ``tick`` is due [s]."""
        return self._wake_s

    def start(self, t_s: float) -> list[Message]:
        """Send."""
        self._until_s = t_s + self._give_up_s
        return self._say(t_s)

    def receive(self, t_s: float, message: Message) -> list[Message]:
        """Take the acknowledgement, and the sentence in whichever order they come."""
        if not self._party.is_from_target(message) or self.result is not None:
            return []
        if message.get_type() == "COMMAND_ACK" and message.command in COMMANDS and self._party.is_for_us(message):
            if self._acknowledged is None:
                self._acknowledged = _BY_RESULT.get(int(message.result), Result.REFUSED)
                self._wake_s = t_s + WORDS_S
        elif message.get_type() == "STATUSTEXT":
            for value in self._texts.take(t_s, message):
                if isinstance(value, StatusText) and value.text.startswith(lead_in(self._wanted)):
                    self._text = value.text.removeprefix(lead_in(self._wanted))
        if self._acknowledged is not None and self._text:
            self.result = Answer(result=self._acknowledged, text=self._text)
        return []

    def tick(self, t_s: float) -> list[Message]:
        """Send again; give up; end without the sentence when it does not come."""
        if self._acknowledged is not None:
            self.result = Answer(result=self._acknowledged, text=f"{self._acknowledged.value} (its sentence was lost)")
        elif t_s >= self._until_s:
            self.result = Answer(result=Result.NO_ANSWER, text=f"no answer within {self._give_up_s:g} s")
        else:
            return self._say(t_s)
        return []

    def _say(self, t_s: float) -> list[Message]:
        self._wake_s = min(t_s + AGAIN_S, self._until_s)
        self._attempts += 1
        return [message_of(self._wanted, self._party.target_system, self._attempts - 1)]


class Link(Protocol):
    """What is asked of a link (``companion.mavlink.link.Link`` is one)."""

    @property
    def party(self) -> Party:
        """The autopilot and we."""
        ...

    async def perform(self, machine: Machine[Any], channel: str | None = None) -> Any:
        """Drive a machine to its result."""
        ...


async def give(link: Link, wanted: Wanted, *, give_up_s: float = GIVE_UP_S) -> Answer:
    """Give an order to the companion of the link's autopilot and return its answer.

    Raises:
        ValueError: it is nothing that can be sent: an unknown verb, a goal without its place.
    """
    found = link.party
    party = Party(found.target_system, OWN_COMPONENT, found.own_system, found.own_component)
    answer: Answer = await link.perform(OrderSend(party, wanted, give_up_s=give_up_s), "order")
    return answer
