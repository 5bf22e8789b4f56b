"""The verbs: what can be asked of the boat, by number on the radio and by word everywhere else."""

from __future__ import annotations

import difflib
import enum
from collections.abc import Iterable
from dataclasses import dataclass

ALL = "all"   # of the verbs, where a mission says which are permitted


class Verb(enum.StrEnum):
    """What is asked."""

    HOLD = "hold"
    GO_ON = "go_on"
    SKIP_GOAL = "skip_goal"
    REFUGE = "refuge"
    HOME = "home"
    GOAL = "goal"
    REPLAN = "replan"
    STOP = "stop"
    ADOPT = "adopt"
    REPLACE = "replace"
    WHY = "why"


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """A verb as a person has to know it: its number in param1, what it takes, does, and is refused for."""

    verb: Verb
    number: int
    means: str
    refused: str
    takes: str = ""
    stands: bool = False     # until ``go_on``, or another order that stands
    button: str = ""         # of a ground station; empty: it has none, for what it takes cannot be typed there


TABLE: tuple[Row, ...] = (
    Row(verb=Verb.HOLD, number=1, stands=True, button="Hold here",
        means="loiter here, where there is room near by, until told to go on",
        refused="a person has her, the battery or a failsafe comes first, uploading is not permitted"),
    Row(verb=Verb.GO_ON, number=2, button="Go on",
        means="the end of whatever order stands: on to the next goal; without one the end of a stay in a box",
        refused="never"),
    Row(verb=Verb.SKIP_GOAL, number=3, button="Skip this goal",
        means="the goal that is next is given up, the one behind it becomes the next",
        refused="it is the last one: hold, home or a refuge say where to stay instead"),
    Row(verb=Verb.REFUGE, number=4, takes="[NAME]", stands=True, button="To the nearest refuge",
        means="sail to the refuge of that name, or the nearest, and stay there until told to go on",
        refused="the mission has none of that name (they are listed); she is not under way; as `hold`"),
    Row(verb=Verb.HOME, number=5, stands=True, button="Home",
        means="sail to where she was armed and stay there until told to go on; planned like any leg, never RTL",
        refused="the autopilot has not told where home is, or it is in no free water; she is not under way; as `hold`"),
    Row(verb=Verb.GOAL, number=6, takes="LAT LON", stands=True,
        means="sail to that place, then on to the goals that are left",
        refused="it is no position (0, 0; not a number; outside ±90 or ±180), on land, outside the fence, nearer to "
        "something than the margin's floor, farther than 50 km (on a passage than its longest leg), or latitude and "
        "longitude are swapped; she is not under way; as `hold`"),
    Row(verb=Verb.REPLAN, number=7, button="Plan again",
        means="a new plan from where she is", refused="she is not sailing to anywhere"),
    Row(verb=Verb.STOP, number=8, stands=True, button="Give the boat up",
        means="nothing more is asked of the boat until told to go on: what is on board the autopilot sails on",
        refused="never"),
    Row(verb=Verb.ADOPT, number=9, button="Sail what was drawn",
        means="end this voyage, and sail the mission that somebody has drawn and uploaded",
        refused="nothing drawn is on offer, it cannot be sailed, or this voyage's goals are in its mission file"),
    Row(verb=Verb.REPLACE, number=10, button="Replace the mission on board",
        means="overwrite a mission on the autopilot that is not ours", refused="the mission on board is ours, or "
        "uploading is not permitted"),
    Row(verb=Verb.WHY, number=11, button="Why?",
        means="say what she does and why, and when she tacks next", refused="never: reading is always permitted"),
)
BY_VERB = {row.verb: row for row in TABLE}
_BY_NUMBER = {row.number: row.verb for row in TABLE}


def verb_of(number: float) -> Verb | None:
    """Return the verb of a number as it came in a parameter, None when it is none (a fraction, NaN)."""
    return _BY_NUMBER.get(int(number)) if abs(number) < 1e6 and number == int(number) else None


def verb_named(word: str) -> Verb | None:
    """Return the verb that a person's word means (``go-on`` and ``GO_ON`` too), None when it is none."""
    plain = word.strip().lower().replace("-", "_").replace(" ", "_")
    return Verb(plain) if plain in set(Verb) else None


def unknown(word: str) -> str:
    """Return what to say of a word that is no verb: the nearest one, else all of them."""
    near = difflib.get_close_matches(word.lower().replace("-", "_"), [*Verb], n=1)
    meant = f"did you mean {near[0]}?" if near else f"there are {', '.join(Verb)}"
    return f"there is no order {word[:40]!r}; {meant}"


def permitted(verb: Verb, orders: Iterable[str]) -> bool:
    """Return whether a mission that permits ``orders`` (words of verbs, or ``all``) permits this one.

    Reading is always permitted.
    """
    words = set(orders)
    return verb is Verb.WHY or ALL in words or verb.value in words
