"""Orders as MAVLink commands, both ways: MAV_CMD_USER_1 with a verb, MAV_CMD_USER_2 as COMMAND_INT with a position.

ArduPilot does nothing with either (it answers UNSUPPORTED), so one that reaches it in place of us moves nothing.
"""

from __future__ import annotations

import json
import math
from typing import Any, Protocol

from pymavlink.dialects.v20 import ardupilotmega as wire

from companion.mavlink.microservices import Machine, Party
from companion.mavlink.reception import OWN_COMPONENT
from companion.mavlink.wire import Message, VehicleAssembler
from companion.messages import StatusText
from companion.orders.order import BY_VERB, NUMBERED, TABLE, Answer, Place, Result, Verb, Wanted, mark_of, verb_of

VERB_COMMAND, PLACE_COMMAND = int(wire.MAV_CMD_USER_1), int(wire.MAV_CMD_USER_2)
COMMANDS = frozenset({VERB_COMMAND, PLACE_COMMAND})
GLOBAL_FRAMES = frozenset(
    {
        wire.MAV_FRAME_GLOBAL,
        wire.MAV_FRAME_GLOBAL_RELATIVE_ALT,
        wire.MAV_FRAME_GLOBAL_INT,
        wire.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT,
        wire.MAV_FRAME_GLOBAL_TERRAIN_ALT,
        wire.MAV_FRAME_GLOBAL_TERRAIN_ALT_INT,
    }
)
RESULTS = {
    Result.DONE: int(wire.MAV_RESULT_ACCEPTED),
    Result.REFUSED: int(wire.MAV_RESULT_DENIED),
    Result.NOT_NOW: int(wire.MAV_RESULT_TEMPORARILY_REJECTED),
    Result.UNKNOWN: int(wire.MAV_RESULT_UNSUPPORTED),
}


def wanted_of(message: Any) -> Wanted:
    """Return what a COMMAND_LONG or COMMAND_INT of ``COMMANDS`` wants; what cannot be read says why. Never raises."""
    is_int = message.get_type() == "COMMAND_INT"
    if message.command == PLACE_COMMAND:
        return _place(message, is_int=is_int)
    number = float(message.param1)
    verb = verb_of(number) if math.isfinite(number) else None
    if verb is None:
        known = ", ".join(f"{row.number} {row.verb}" for row in TABLE)
        return Wanted(verb=None, fault=f"there is no order {number:g}; param1 is one of {known}")
    if verb is Verb.GOAL:
        return Wanted(verb=verb, fault="a goal needs a position: send MAV_CMD_USER_2 as COMMAND_INT")
    if verb not in NUMBERED:
        return Wanted(verb=verb)
    count, mark = _whole(message.param2), _whole(message.param3) if verb is Verb.REFUGE else 0
    if count is None or mark is None:
        what = "refuge" if verb is Verb.REFUGE else "shoal"
        return Wanted(verb=verb, fault=f"the {what}'s number (param2; 0: the nearest) is a whole number")
    return Wanted(verb=verb, number=count, mark=mark)


def _place(message: Any, *, is_int: bool) -> Wanted:
    if not is_int:
        return Wanted(verb=Verb.GOAL, fault="a position comes as COMMAND_INT: a COMMAND_LONG's is a metre off")
    if message.frame not in GLOBAL_FRAMES:
        return Wanted(verb=Verb.GOAL, fault=f"frame {message.frame} is not a global one (0, 3, 5 or 6)")
    return Wanted(verb=Verb.GOAL, place=Place(lat_deg=message.x / 1e7, lon_deg=message.y / 1e7))


def _whole(value: float) -> int | None:
    """Return a parameter that is a number to count with; a ground station leaves one out as NaN."""
    if math.isnan(value):
        return 0
    return int(value) if 0.0 <= value < 1 << 25 and value == int(value) else None


def message_of(wanted: Wanted, system: int, attempt: int = 0) -> Message:
    """Return the command that asks ``wanted`` of the companion of ``system``; ``attempt`` counts from 0.

    Raises:
        ValueError: it is nothing that can be sent: an unknown verb, a goal without its place.
    """
    if wanted.verb is None or wanted.fault:
        raise ValueError(wanted.fault or "nothing is wanted")
    if wanted.verb is not Verb.GOAL:
        return wire.MAVLink_command_long_message(
            system, OWN_COMPONENT, VERB_COMMAND, min(attempt, 255), *params_of(wanted), 0.0, 0.0, 0.0, 0.0
        )
    if wanted.place is None or wanted.place.trouble:
        raise ValueError("a goal needs a position" if wanted.place is None else wanted.place.trouble)
    return wire.MAVLink_command_int_message(
        system,
        OWN_COMPONENT,
        wire.MAV_FRAME_GLOBAL,
        PLACE_COMMAND,
        0,
        0,
        0.0,
        0.0,
        0.0,
        0.0,
        round(wanted.place.lat_deg * 1e7),
        round(wanted.place.lon_deg * 1e7),
        0.0,
    )


def params_of(wanted: Wanted) -> tuple[float, float, float]:
    """Return param1 to param3 of a verb: its number, the refuge's, the mark of its name."""
    assert wanted.verb is not None
    mark = mark_of(wanted.name) if wanted.name else wanted.mark
    return float(BY_VERB[wanted.verb].number), float(wanted.number), float(mark)


# Giving an order through a link and hearing its answer: what a ground station, a script or the command line does.

AGAIN_S = 1.5  # the companion answers within a second; a slow radio takes another half
GIVE_UP_S = 15.0
WORDS_S = 3.0  # the sentence follows the acknowledgement; chunk by chunk on a slow radio
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


class OrderLink(Protocol):
    """What is asked of a link (``companion.mavlink.link.Link`` is one)."""

    @property
    def party(self) -> Party:
        """The autopilot and we."""
        ...

    async def perform(self, machine: Machine[Any], channel: str | None = None) -> Any:
        """Drive a machine to its result."""
        ...


async def give(link: OrderLink, wanted: Wanted, *, give_up_s: float = GIVE_UP_S) -> Answer:
    """Give an order to the companion of the link's autopilot and return its answer.

    Raises:
        ValueError: it is nothing that can be sent: an unknown verb, a goal without its place.
    """
    found = link.party
    party = Party(found.target_system, OWN_COMPONENT, found.own_system, found.own_component)
    answer: Answer = await link.perform(OrderSend(party, wanted, give_up_s=give_up_s), "order")
    return answer


# Buttons for QGroundControl: its ``MavlinkActions`` file, with each verb that needs no typing.

UNUSED = (0.0, 0.0, 0.0, 0.0)  # param4 to param7


def qgc_actions() -> str:
    """Return the file. QGroundControl ignores a file that has any other key than those it documents."""
    actions = [
        {
            "label": row.button,
            "description": row.means[:1].upper() + row.means[1:],
            "mavCmd": VERB_COMMAND,
            "compId": OWN_COMPONENT,
            **{f"param{n}": value for n, value in enumerate((*params_of(Wanted(verb=row.verb)), *UNUSED), 1)},
        }
        for row in TABLE
        if row.button
    ]
    return json.dumps({"version": 1, "fileType": "MavlinkActions", "actions": actions}, indent=4) + "\n"
