"""Why the autopilot changed its mode by itself: the causes, how each is told, and what is done about it. One table.

ArduRover keeps the reason of a mode change in its log and tells none over MAVLink: a cause is known by its signs. A
sign is the beginning of a text, or of something that the status shows from then on (``STANDING``); what has no sign is
a person's doing. ``python -m companion.skipper.watch.document`` prints the table into docs/reference/watchdogs.md.
"""

from __future__ import annotations

import enum
from collections.abc import Callable
from dataclasses import dataclass

from companion.messages import AutopilotStatus, Mode, StatusText

CRITICAL = 5          # MAV_STATE of a heartbeat while a failsafe of links or position has acted
AUTOPILOT = 1         # the component whose texts are signs
# What a failsafe puts a boat into; RTL and LOITER sail, but not where the voyage wants her.
HOMEWARD = frozenset({Mode.RTL, Mode.SMART_RTL})
STOPPING = frozenset({Mode.HOLD, Mode.LOITER, *HOMEWARD})
EMPTY = " is critical "   # in the battery's words, when the second of its limits is passed
OVER = "cleared"      # ends a text that says that something is over


class Answer(enum.Enum):
    """What is done about a stop that nobody asked for, where the mission permits it (``set_auto``)."""

    LEAVE = "nothing: a person must look at her first"
    SAIL_ON = "plan from where she is (back inside the fence), AUTO, sail on"
    STAY = "AUTO and a loiter where there is room near by (put into RTL: planned home) until it is over; then sail on"
    SHELTER = "AUTO and the nearest refuge; without one home if she was sent there, else a loiter where there is room"

    @property
    def words(self) -> str:
        """What is done, in a few words."""
        return {Answer.LEAVE: "left to a person", Answer.SAIL_ON: "sail on", Answer.STAY: "loiter near by",
                Answer.SHELTER: "to the nearest refuge"}[self]


# What a mission may say of the failsafes in place of the table (``[safety] ..._failsafe``).
CHOICES = {"leave": Answer.LEAVE, "sail_on": Answer.SAIL_ON, "stay": Answer.STAY, "refuge": Answer.SHELTER}


@dataclass(frozen=True, slots=True, kw_only=True)
class Cause:
    """One row. ``texts`` are beginnings of the autopilot's, ``shown`` is the standing sign in words."""

    name: str
    texts: tuple[str, ...]
    shown: str
    answer: Answer
    waits_for: str = ""        # what must be over before the answer begins
    press: str = "AUTO to sail on, LOITER to stay, MANUAL to take her"
    why: str


PERSON = "a person"
SHORE = "shore link"

TABLE: tuple[Cause, ...] = (
    Cause(name="position", texts=("EKF variance", "EKF failsafe"), shown="HEARTBEAT critical with the filter ill",
          answer=Answer.SAIL_ON, waits_for="the filter well again, evidence for the position; meanwhile LOITER",
          press="MANUAL to take her; AUTO when the position is back",
          why="ArduRover holds when its filter loses the position, and never goes back by itself"),
    Cause(name="crash", texts=("Crash:",), shown="", answer=Answer.LEAVE,
          press="MANUAL to take her; AUTO if she floats upright",
          why="knocked down or aground: whether she may sail is not to be told from here"),
    Cause(name="battery", texts=("Battery ",), shown="SYS_STATUS: battery not healthy", answer=Answer.SHELTER,
          press="AUTO to sail on, MANUAL to take her",
          why="what is left takes her to a place that was chosen for it"),
    Cause(name="fence", texts=(), shown="FENCE_STATUS: breached, or one breach more", answer=Answer.SAIL_ON,
          press="AUTO to let the mission sail her back, MANUAL to take her",
          why="a sailboat in HOLD drifts on outside, RTL sails straight; no new action follows while a breach lasts"),
    Cause(name="shore link", texts=("Radio Failsafe", "GCS Failsafe"), shown="HEARTBEAT critical with the filter well",
          answer=Answer.STAY,
          why="who wants her to stop out of range of radio or station wants her to stay, not to drift; ArduRover gives "
              "the loss of the one the other's name where it looks for both"),
)
BY_NAME = {cause.name: cause for cause in TABLE}


def is_filter_ill(status: AutopilotStatus) -> bool:
    """Return whether the position filter has failed and its failsafe acted."""
    return status.system_status == CRITICAL and not status.ekf_ok


RECEIVER = "receiver"   # no cause by itself: without FS_THR_ENABLE its silence does nothing
STANDING: dict[str, Callable[[AutopilotStatus], bool]] = {
    "position": is_filter_ill,
    "battery": lambda status: bool(status.battery_failed),
    "fence": lambda status: bool(status.fence_breached),
    "shore link": lambda status: status.system_status == CRITICAL and status.ekf_ok,
    RECEIVER: lambda status: bool(status.receiver_lost),
}


def told_by(text: StatusText) -> str:
    """Return the name of the cause that a text is a sign of, empty when of none."""
    if text.source_component != AUTOPILOT or OVER in text.text.lower():
        return ""
    return next((cause.name for cause in TABLE if text.text.startswith(cause.texts)), "") if text.text else ""


def standing(status: AutopilotStatus) -> tuple[str, ...]:
    """Return the names of the standing signs that are up."""
    return tuple(name for name, is_up in STANDING.items() if is_up(status))
