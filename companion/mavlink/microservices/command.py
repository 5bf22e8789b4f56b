"""What a conversation with the autopilot is: a pure step machine and its result.

A machine is told the time and the messages and answers with messages to send. It ends by setting ``result``. It is
driven by ``Link.perform`` and, in tests, by a scripted peer; it knows no clock, socket or task.
"""

from __future__ import annotations

import enum
from dataclasses import dataclass, field
from typing import Protocol, TypeVar

from pymavlink.dialects.v20 import ardupilotmega as wire

from companion.mavlink.wire.codec import command_long
from companion.mavlink.wire.frames import Message


class TransferOutcome(enum.Enum):
    """How a conversation ended."""

    OK = "ok"
    REFUSED = "refused"  # the autopilot said no; the text has its words
    TIMEOUT = "timeout"  # it stopped answering
    UNCONFIRMED = "unconfirmed"  # all was sent, the last acknowledgement never came: read back
    MISMATCH = "mismatch"  # what it has is not what was written
    UNSUPPORTED = "unsupported"  # it does not know this protocol or command
    LINK = "link"  # the link is dead: no heartbeat


@dataclass(frozen=True, slots=True)
class Party:
    """Who talks to whom: system and component of the autopilot and of us."""

    target_system: int = 1
    target_component: int = 1
    own_system: int = 1
    own_component: int = 191

    @property
    def target(self) -> tuple[int, int]:
        """System and component of the autopilot."""
        return self.target_system, self.target_component

    def is_from_target(self, message: Message) -> bool:
        """Return whether the autopilot sent it."""
        return bool(
            message.get_srcSystem() == self.target_system and message.get_srcComponent() == self.target_component
        )

    def is_for_us(self, message: Message) -> bool:
        """Return whether a message with target fields means us (0 means everybody)."""
        return message.target_system in {0, self.own_system} and message.target_component in {0, self.own_component}


ResultT_co = TypeVar("ResultT_co", covariant=True)


class Machine(Protocol[ResultT_co]):
    """One conversation."""

    @property
    def result(self) -> ResultT_co | None:
        """The result; None while it goes on."""

    @property
    def wake_s(self) -> float:
        """When ``tick`` is due [s]."""

    def start(self, t_s: float) -> list[Message]:
        """Return the opening messages."""

    def receive(self, t_s: float, message: Message) -> list[Message]:
        """Take any message of the link; return what to send."""

    def tick(self, t_s: float) -> list[Message]:
        """Take the passing of ``wake_s``; return what to send."""


@dataclass(slots=True)
class Retransmission:
    """When to say it again: after ``first_s``, then ever later up to ``cap_s``; given up after ``give_up_s``.

    ``progress`` is called whenever the other side moved on; it starts the count again.
    """

    first_s: float = 0.7
    cap_s: float = 1.0
    growth: float = 1.4
    give_up_s: float = 12.0
    wake_s: float = 0.0
    tries: int = 0
    _since_s: float = 0.0
    _interval_s: float = field(default=0.0)

    def progress(self, t_s: float) -> None:
        """Something new was sent at ``t_s``."""
        self.tries = 0
        self._since_s = t_s
        self._interval_s = self.first_s
        self.wake_s = t_s + self.first_s

    def again(self, t_s: float) -> bool:
        """Return whether to send again at ``t_s``; False: give up."""
        # the same sum as in wake_s: a difference would round, and a machine wake for ever a bit too early
        if t_s >= self._since_s + self.give_up_s:
            return False
        self.tries += 1
        self._interval_s = min(self._interval_s * self.growth, self.cap_s)
        self.wake_s = min(t_s + self._interval_s, self._since_s + self.give_up_s)
        return True


class Texts:
    """Collects what the autopilot says in words while a conversation runs: its reasons come only this way."""

    # Chatter that has nothing to do with a refusal.
    _NOISE = (
        "Field Elevation",
        "Sailboat: Tacking",
        "Reached waypoint",
        "Mission: ",
        "Auto mission changed",
        "EKF3 ",
        "GPS ",
        "Flight plan received",
    )

    def __init__(self, party: Party) -> None:
        self._party = party
        self._texts: list[str] = []

    def take(self, message: Message) -> None:
        """Keep the text of a STATUSTEXT of the autopilot."""
        if message.get_type() == "STATUSTEXT" and self._party.is_from_target(message):
            text = message.text.strip()
            if text and not text.startswith(self._NOISE) and text not in self._texts:
                self._texts.append(text)

    def __str__(self) -> str:
        return "; ".join(self._texts[-4:])


# One command with its acknowledgement. Pure step machine.

# Why it failed comes as STATUSTEXT before or up to 7 ms after the ACK in recordings; a radio may need longer [s].
REASON_WAIT_S = 0.4
# A TEMPORARILY_REJECTED command is tried again after this [s], so many times.
BUSY_WAIT_S = 1.0
BUSY_TRIES = 3

RESULT_WORDS = {
    value: entry.name.removeprefix("MAV_RESULT_").replace("_", " ").lower()
    for value, entry in wire.enums["MAV_RESULT"].items()
}


@dataclass(frozen=True, slots=True, kw_only=True)
class CommandAnswer:
    """How a command ended; ``result`` is COMMAND_ACK's, None when none came; ``text`` has the autopilot's words."""

    outcome: TransferOutcome
    text: str = ""
    result: int | None = None

    @property
    def is_ok(self) -> bool:
        """Accepted."""
        return self.outcome is TransferOutcome.OK


class CommandSend:
    """Sends a COMMAND_LONG (or a prepared COMMAND_INT) until it is answered."""

    def __init__(
        self,
        party: Party,
        command: int,
        params: tuple[float, ...] = (),
        *,
        message: Message | None = None,
        give_up_s: float = 8.0,
    ) -> None:
        self.result: CommandAnswer | None = None
        self._party, self._command, self._params, self._message = party, command, params, message
        self._retry = Retransmission(first_s=0.8, give_up_s=give_up_s)
        self._texts = Texts(party)
        self._ack: int | None = None
        self._busy = 0
        self._wake_s = 0.0

    @property
    def wake_s(self) -> float:
        """When ``tick`` is due [s]."""
        return self._wake_s

    def start(self, t_s: float) -> list[Message]:
        """Send."""
        self._retry.progress(t_s)
        self._wake_s = self._retry.wake_s
        return [self._say()]

    def receive(self, t_s: float, message: Message) -> list[Message]:
        """Take the acknowledgement."""
        self._texts.take(message)
        if (
            message.get_type() != "COMMAND_ACK"
            or message.command != self._command
            or self.result is not None
            or self._ack is not None
            or not self._party.is_from_target(message)
            or not self._party.is_for_us(message)
        ):
            return []
        if message.result == wire.MAV_RESULT_ACCEPTED:
            self.result = CommandAnswer(outcome=TransferOutcome.OK, result=message.result)
        elif message.result == wire.MAV_RESULT_IN_PROGRESS:
            self._retry.progress(t_s)
            self._wake_s = t_s + 5.0
        elif message.result == wire.MAV_RESULT_TEMPORARILY_REJECTED and self._busy < BUSY_TRIES:
            self._busy += 1
            self._wake_s = t_s + BUSY_WAIT_S
        else:
            self._ack = message.result
            self._wake_s = t_s + REASON_WAIT_S
        return []

    def tick(self, t_s: float) -> list[Message]:
        """Send again, give up, or end a refusal once its reason had time to arrive."""
        if self._ack is not None:
            unsupported = self._ack == wire.MAV_RESULT_UNSUPPORTED
            words = str(self._texts) or f"COMMAND_ACK {self._ack} ({RESULT_WORDS.get(self._ack, 'unknown')})"
            self.result = CommandAnswer(
                outcome=TransferOutcome.UNSUPPORTED if unsupported else TransferOutcome.REFUSED,
                text=words,
                result=self._ack,
            )
            return []
        if not self._retry.again(t_s):
            self.result = CommandAnswer(outcome=TransferOutcome.TIMEOUT, text="no acknowledgement")
            return []
        self._wake_s = self._retry.wake_s
        return [self._say()]

    def _say(self) -> Message:
        if self._message is not None:
            return self._message
        return command_long(self._party.target, self._command, self._params, min(self._retry.tries, 255))
