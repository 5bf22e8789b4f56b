"""docs/reference/watchdogs.md, made from the tables of ``companion.safety``.

``python -m companion.skipper.watch.document > docs/reference/watchdogs.md``
"""

from __future__ import annotations

import sys

from companion.safety import (
    BY_RANK,
    ENDINGS,
    FAILSAFES,
    SETTINGS,
    TABLE,
    WORD_OF,
    Cause,
    Recovery,
    Setting,
    Watchdog,
)

HEAD = """# Watchdogs

Made from the tables in `companion/safety.py` by `python -m companion.skipper.watch.document`; a test checks that it is
current. A watchdog is raised when its figure has been at or beyond the entry threshold for the time given, and cleared
when it has been at or beyond the exit threshold (or cannot be told) for its time. Those marked * are watched before the
boat sails and when the voyage is over, too; those marked ° when it is over, too. Its number stands for it where there
is no room for words ([far away](far.md), HIGH_LATENCY2): 0 is none, and none is ever given to another.

| watchdog | number | watches | entry | exit | says | then | why |
|---|---|---|---|---|---|---|---|
"""
ENDS_HEAD = """
## What ends a voyage early

The keys of a mission's `[safety]`, in the order in which they come. `refuge`: to the nearest refuge, without one home
if `[skipper] end` says so; `home`: home, without a way there to the nearest refuge; `stay`: a loiter near by; `say`:
words alone. Where there is no such place she loiters near by; with one marked † she sails on. Those marked ‡ come
before the orders of the crew, too. When it is over she sails on.

| key | default | when | how long |
|---|---|---|---|
"""
FIGURES_HEAD = """
The figures of these, and what is done, with `set_auto`, when a failsafe of the autopilot [has stopped
her](#when-the-autopilot-stops-her-by-itself): `sail_on`; `stay`: a loiter near by; `refuge`; `leave`: nothing, a person
must. What she stays for ends when a person gives AUTO, that of the shore link when the link is back.

| key | default | what |
|---|---|---|
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
    return "".join((
        HEAD, *map(_row, TABLE), ENDS_HEAD, *map(_ending, BY_RANK), FIGURES_HEAD, *map(_figure, SETTINGS.values()),
        *(f"| `{cause.key}` | `{WORD_OF[cause.answer]}` | when the {cause.name} failsafe has |\n"
          for cause in FAILSAFES if cause.key),
        CAUSES_HEAD, *map(_cause, FAILSAFES)))


def _ending(name: str) -> str:
    ending = ENDINGS[name]
    marks = "†" * ending.sails_on + "‡" * ending.over_orders
    asked = f"; watched with `{ending.asked_by}`" if ending.asked_by else ""
    return (f'| `{ending.key}`{marks} | `{ending.default}` | {ending.because}: watchdog "{name}"{asked} | '
            f"{ending.until or 'the voyage is over'} |\n")


def _figure(setting: Setting) -> str:
    return f"| `{setting.key}` | {'none' if setting.default is None else f'{setting.default:g}'} | {setting.says} |\n"


def _row(dog: Watchdog) -> str:
    sign, back = ("≥", "≤") if dog.enter >= dog.exit else ("≤", "≥")
    unit = f" {dog.unit}" if dog.unit else ""
    mark = "*" if dog.at_rest else "°" if dog.loitering else ""
    return " | ".join((
        f"| {dog.name}{mark}", str(dog.number), dog.watches,
        f"{sign} {dog.enter:g}{unit} for {dog.enter_s:g} s",
        f"{back} {dog.exit:g}{unit} for {dog.exit_s:g} s", dog.severity.name.lower(), dog.response.value,
        f"{dog.why} |\n",
    ))


def _cause(cause: Cause) -> str:
    words = ", ".join(f"`{text.strip()} …`" for text in cause.texts) or "–"
    first = f"waits for {cause.waits_for}; " if cause.waits_for and cause.answer is not Recovery.LEAVE else ""
    return (f"| {cause.name} | {words} | {cause.shown or '–'} | {first}{cause.answer.value} | {cause.press} | "
            f"{cause.why} |\n")


if __name__ == "__main__":
    sys.stdout.write(markdown())
