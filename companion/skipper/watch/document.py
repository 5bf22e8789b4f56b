"""docs/reference/watchdogs.md, made from the tables of watchdogs and of failsafes' causes.

``python -m companion.skipper.watch.document > docs/reference/watchdogs.md``
"""

from __future__ import annotations

import sys

from companion.skipper.step.causes import TABLE as CAUSES
from companion.skipper.step.causes import Answer, Cause
from companion.skipper.watch.watchdogs import TABLE, Watchdog

HEAD = """# Watchdogs

Made from the tables in `companion/skipper/watch/watchdogs.py` and `causes.py` by `python -m
companion.skipper.watch.document`; a test checks that it is current. A watchdog is raised when its figure has been at or
beyond the entry threshold for the time given, and cleared when it has been at or beyond the exit threshold (or cannot
be told) for its time. Those marked * are watched before the boat sails and when the voyage is over, too; those marked °
when it is over, too.

| watchdog | watches | entry | exit | says | then | why |
|---|---|---|---|---|---|---|
"""
CAUSES_HEAD = """
## When the autopilot stops her by itself

ArduRover tells no reason of a mode change over MAVLink. A change to HOLD, RTL, SmartRTL or LOITER, or a disarming, that
the companion did not ask for is a failsafe's if one of its signs begins within 5 s of it, and the rudder, the throttle
and the mode switch (RC_CHANNELS) have not moved; else it is a person's, and nothing is done until AUTO comes back. What
is put right needs `[operator] set_auto` and a boat that is still armed. Without, and for as long as a stop lasts, it is
said every minute where she drifts, what she meets and when, and what to press; of a person's stop only when she drifts
onto something.

| failsafe | the autopilot's words | or shows as | with `set_auto` | without: press | why |
|---|---|---|---|---|---|
"""


def markdown() -> str:
    """Return docs/reference/watchdogs.md."""
    return HEAD + "".join(map(_row, TABLE)) + CAUSES_HEAD + "".join(map(_cause, CAUSES))


def _row(dog: Watchdog) -> str:
    sign, back = ("≥", "≤") if dog.enter >= dog.exit else ("≤", "≥")
    unit = f" {dog.unit}" if dog.unit else ""
    mark = "*" if dog.at_rest else "°" if dog.loitering else ""
    return " | ".join((
        f"| {dog.name}{mark}", dog.watches,
        f"{sign} {dog.enter:g}{unit} for {dog.enter_s:g} s",
        f"{back} {dog.exit:g}{unit} for {dog.exit_s:g} s", dog.severity.name.lower(), dog.response.value,
        f"{dog.why} |\n",
    ))


def _cause(cause: Cause) -> str:
    words = ", ".join(f"`{text.strip()} …`" for text in cause.texts) or "–"
    first = f"waits for {cause.waits_for}; " if cause.waits_for and cause.answer is not Answer.LEAVE else ""
    return (f"| {cause.name} | {words} | {cause.shown or '–'} | {first}{cause.answer.value} | {cause.press} | "
            f"{cause.why} |\n")


if __name__ == "__main__":
    sys.stdout.write(markdown())
