"""One command with its acknowledgement. Pure step machine."""

from __future__ import annotations

from dataclasses import dataclass

from pymavlink.dialects.v20 import ardupilotmega as wire

from companion.mavlink.transfers.machines import Outcome, Party, Retry, Texts
from companion.mavlink.wire.codec import command_long
from companion.mavlink.wire.frames import Message

# Why a command failed comes as STATUSTEXT before or just after the ACK [s].
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

    outcome: Outcome
    text: str = ""
    result: int | None = None

    @property
    def is_ok(self) -> bool:
        """Accepted."""
        return self.outcome is Outcome.OK


class CommandSend:
    """Sends a COMMAND_LONG (or a prepared COMMAND_INT) until it is answered."""

    def __init__(
        self, party: Party, command: int, params: tuple[float, ...] = (), *,
        message: Message | None = None, give_up_s: float = 8.0,
    ) -> None:
        self.result: CommandAnswer | None = None
        self._party, self._command, self._params, self._message = party, command, params, message
        self._retry = Retry(first_s=0.8, give_up_s=give_up_s)
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
            message.get_type() != "COMMAND_ACK" or message.command != self._command or self.result is not None
            or self._ack is not None
            or not self._party.is_from_target(message) or not self._party.is_for_us(message)
        ):
            return []
        if message.result == wire.MAV_RESULT_ACCEPTED:
            self.result = CommandAnswer(outcome=Outcome.OK, result=message.result)
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
                outcome=Outcome.UNSUPPORTED if unsupported else Outcome.REFUSED, text=words, result=self._ack
            )
            return []
        if not self._retry.again(t_s):
            self.result = CommandAnswer(outcome=Outcome.TIMEOUT, text="no acknowledgement")
            return []
        self._wake_s = self._retry.wake_s
        return [self._say()]

    def _say(self) -> Message:
        if self._message is not None:
            return self._message
        return command_long(self._party.target, self._command, self._params, min(self._retry.tries, 255))
