"""What a conversation with the autopilot is: a pure step machine and its result.

A machine is told the time and the messages and answers with messages to send. It ends by setting ``result``. It is
driven by ``Link.perform`` and, in tests, by a scripted peer; it knows no clock, socket or task.
"""

from __future__ import annotations

import enum
from dataclasses import dataclass, field
from typing import Protocol, TypeVar

from companion.mavlink.wire.frames import Message


class Outcome(enum.Enum):
    """How a conversation ended."""

    OK = "ok"
    REFUSED = "refused"            # the autopilot said no; the text has its words
    TIMEOUT = "timeout"            # it stopped answering
    UNCONFIRMED = "unconfirmed"    # all was sent, the last acknowledgement never came: read back
    MISMATCH = "mismatch"          # what it has is not what was written
    UNSUPPORTED = "unsupported"    # it does not know this protocol or command
    LINK = "link"                  # the link is dead: no heartbeat


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
class Retry:
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
        "Field Elevation", "Sailboat: Tacking", "Reached waypoint", "Mission: ", "Auto mission changed", "EKF3 ",
        "GPS ", "Flight plan received",
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
