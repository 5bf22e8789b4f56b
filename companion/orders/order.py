"""An order as a value: what is wanted, who asked and when, how it was answered."""

from __future__ import annotations

import difflib
import enum
import math
import zlib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from companion.errors import InputError
from companion.messages import GeoPoint

# The verbs: what can be asked of the boat, by number on the radio and by word everywhere else.

ALL = "all"  # of the verbs, where a mission says which are permitted


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
    FREEZE = "freeze"
    LEARN = "learn"
    FORGET_SHOAL = "forget_shoal"


@dataclass(frozen=True, slots=True, kw_only=True)
class VerbRow:
    """A verb as a person has to know it: its number in param1, what it takes, does, and is refused for."""

    verb: Verb
    number: int
    means: str
    refused: str
    takes: str = ""
    stands: bool = False  # until ``go_on``, or another order that stands
    button: str = ""  # of a ground station; empty: it has none, for what it takes cannot be typed there


TABLE: tuple[VerbRow, ...] = (
    VerbRow(
        verb=Verb.HOLD,
        number=1,
        stands=True,
        button="Hold here",
        means="loiter here, where there is room near by, else in the nearest water with room, until told to go on",
        refused="a person has her, the battery or a failsafe comes first, uploading is not permitted",
    ),
    VerbRow(
        verb=Verb.GO_ON,
        number=2,
        button="Go on",
        means="the end of whatever order stands: on to the next goal; without one the end of a stay in a box",
        refused="never",
    ),
    VerbRow(
        verb=Verb.SKIP_GOAL,
        number=3,
        button="Skip this goal",
        means="the goal that is next is given up, the one behind it becomes the next",
        refused="it is the last one: hold, home or a refuge say where to stay instead",
    ),
    VerbRow(
        verb=Verb.REFUGE,
        number=4,
        takes="[NAME]",
        stands=True,
        button="To the nearest refuge",
        means="sail to the refuge of that name, or the nearest, and stay there until told to go on",
        refused="the mission has none of that name (they are listed); she is not under way; as `hold`",
    ),
    VerbRow(
        verb=Verb.HOME,
        number=5,
        stands=True,
        button="Home",
        means="sail to where she was armed and stay there until told to go on; planned like any leg, never RTL",
        refused="the autopilot has not told where home is, or it is in no free water; she is not under way; as `hold`",
    ),
    VerbRow(
        verb=Verb.GOAL,
        number=6,
        takes="LAT LON",
        stands=True,
        means="sail to that place, then on to the goals that are left",
        refused="it is no position (0, 0; not a number; outside ±90 or ±180), on land, outside the fence, nearer to "
        "something than any plan leads (the margin's floor, and her track beside it), farther than 50 km (on a passage "
        "than its longest leg), or latitude and longitude are swapped; she is not under way; as `hold`",
    ),
    VerbRow(
        verb=Verb.REPLAN,
        number=7,
        button="Plan again",
        means="a new plan from where she is",
        refused="she is not sailing to anywhere",
    ),
    VerbRow(
        verb=Verb.STOP,
        number=8,
        stands=True,
        button="Give the boat up",
        means="nothing more is asked of the boat until told to go on: what is on board the autopilot sails on",
        refused="never",
    ),
    VerbRow(
        verb=Verb.ADOPT,
        number=9,
        button="Sail what was drawn",
        means="end this voyage, and sail the mission that somebody has drawn and uploaded",
        refused="nothing drawn is on offer, it cannot be sailed, or this voyage's goals are in its mission file",
    ),
    VerbRow(
        verb=Verb.REPLACE,
        number=10,
        button="Replace the mission on board",
        means="overwrite a mission on the autopilot that is not ours",
        refused="the mission on board is ours, or uploading is not permitted",
    ),
    VerbRow(
        verb=Verb.WHY,
        number=11,
        button="Why?",
        means="say what she does and why, and when she tacks next",
        refused="never: reading is always permitted",
    ),
    VerbRow(
        verb=Verb.FREEZE,
        number=12,
        button="Learn no more of the boat",
        means="nothing more is learned of the boat; what plans are told of her stays as it is, over restarts, too",
        refused="the mission's `[boat] learn` is off",
    ),
    VerbRow(verb=Verb.LEARN, number=13, button="Learn the boat", means="the end of `freeze`", refused="as `freeze`"),
    VerbRow(
        verb=Verb.FORGET_SHOAL,
        number=14,
        takes="[NUMBER]",
        button="Forget the nearest shoal",
        means="the shoal of that number, or the nearest, that the sounder found is water again: it was none",
        refused="no shoal was sounded, or none of that number; not while it shoals or she is on her way back",
    ),
)
BY_VERB = {row.verb: row for row in TABLE}
NUMBERED = frozenset({Verb.REFUGE, Verb.FORGET_SHOAL})  # which of them, by number; 0: the nearest
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


MAVLINK, LOCAL, FAR = "mavlink", "local", "far"  # the ways in which orders come
MARK_BITS = 24  # a float32 holds so many exactly


@dataclass(frozen=True, slots=True, kw_only=True)
class Place:
    """A position as it was given [deg]: nothing of it is believed before ``trouble`` has looked at it."""

    lat_deg: float
    lon_deg: float

    @property
    def trouble(self) -> str:
        """Why it is no position on the globe that anybody means; empty: it may be one."""
        if not (math.isfinite(self.lat_deg) and math.isfinite(self.lon_deg)):
            return "the position is not a number"
        if self.lat_deg == 0.0 and self.lon_deg == 0.0:
            return "0, 0 is no position that anybody means"
        if abs(self.lat_deg) > 90.0:
            return f"{self.lat_deg:.5f} is not a latitude: it is outside ±90"
        if abs(self.lon_deg) > 180.0:
            return f"{self.lon_deg:.5f} is not a longitude: it is outside ±180"
        return ""

    @property
    def point(self) -> GeoPoint:
        """The position; ValueError where there is trouble with it."""
        return GeoPoint(lat_deg=self.lat_deg, lon_deg=self.lon_deg)

    @property
    def swapped(self) -> Place:
        """The same with latitude and longitude exchanged."""
        return Place(lat_deg=self.lon_deg, lon_deg=self.lat_deg)


@dataclass(frozen=True, slots=True, kw_only=True)
class Wanted:
    """What is wanted. ``verb`` None: it cannot be read, and ``fault`` says why.

    Attributes:
        verb: what.
        name: of a refuge, as a person wrote it.
        number: of a refuge in the mission's order, of a shoal in the order in which they were found, 0: the nearest.
        mark: of a refuge's name (``mark_of``), where only a number travels; 0: none.
        place: where to, for ``goal``.
        fault: why it cannot be done whatever else is true, in words.
    """

    verb: Verb | None
    name: str = ""
    number: int = 0
    mark: int = 0
    place: Place | None = None
    fault: str = ""

    @property
    def words(self) -> str:
        """The verb with what it takes."""
        if self.verb is None:
            return "unknown"
        where = f" {self.place.lat_deg:.5f} {self.place.lon_deg:.5f}" if self.place is not None else ""
        return f"{self.verb}{f' {self.name}' if self.name else ''}{where}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Source:
    """Who asked: on which way, and with which ids.

    ``local``: on board, all at the socket one and all browsers another. ``far``: by satellite, each counter its own.
    """

    kind: str
    system: int = 0
    component: int = 0

    @property
    def words(self) -> str:
        """Whom to name: on the air by the system id, of which 255 is a ground station's, and 254 ours ashore."""
        if self.kind == LOCAL:
            return "somebody on board"
        if self.kind == FAR:
            return "somebody far away"
        return {255: "the ground station", 254: "somebody ashore"}.get(self.system, f"system {self.system}")


@dataclass(frozen=True, slots=True, kw_only=True)
class Order:
    """Something asked of the boat at ``t_s`` [s]; ``command`` is the MAV_CMD to acknowledge.

    ``authority`` is what makes it count: ``signed`` (with the link's key), ``unsigned`` on a link without a key,
    ``local``: who may open the socket, or ``far``: sealed with the key of the satellite link.
    """

    wanted: Wanted
    source: Source
    t_s: float
    command: int = 0
    authority: str = "unsigned"

    @property
    def key(self) -> tuple[Source, int, Wanted]:
        """What a repetition of it has in common with it, whenever it comes."""
        return self.source, self.command, self.wanted

    def to_dict(self) -> dict[str, Any]:
        """Return plain JSON values; numbers that JSON does not have as words."""
        wanted = self.wanted
        return {
            "verb": None if wanted.verb is None else wanted.verb.value,
            "name": wanted.name,
            "number": wanted.number,
            "mark": wanted.mark,
            "fault": wanted.fault,
            "place": None if wanted.place is None else [repr(wanted.place.lat_deg), repr(wanted.place.lon_deg)],
            "source": [self.source.kind, self.source.system, self.source.component],
            "heard_s": self.t_s,
            "command": self.command,
            "authority": self.authority,
        }

    @classmethod
    def from_dict(cls, data: dict[str, Any]) -> Order:
        """Read ``to_dict``'s result. Raises KeyError, ValueError or TypeError where it is no order."""
        place, source = data["place"], data["source"]
        return cls(
            wanted=Wanted(
                verb=None if data["verb"] is None else Verb(data["verb"]),
                name=data["name"],
                number=data["number"],
                mark=data["mark"],
                fault=data["fault"],
                place=None if place is None else Place(lat_deg=float(place[0]), lon_deg=float(place[1])),
            ),
            source=Source(kind=source[0], system=source[1], component=source[2]),
            t_s=float(data["heard_s"]),
            command=data["command"],
            authority=data["authority"],
        )


class Result(enum.Enum):
    """How an order ended."""

    DONE = "done"  # taken: it is being carried out, or stands
    REFUSED = "refused"  # not permitted, or it cannot be done: the same again will be refused again
    NOT_NOW = "not now"  # as things are; another time it may be
    UNKNOWN = "unknown"  # no order of ours
    NO_ANSWER = "no answer"  # nobody has answered who asked: it may have been taken all the same


@dataclass(frozen=True, slots=True, kw_only=True)
class Answer:
    """How an order ended, and one sentence."""

    result: Result
    text: str


def mark_of(name: str) -> int:
    """Return the number that a name travels as, 1 to 2^24 - 1, the same for upper and lower case."""
    return zlib.crc32(name.strip().casefold().encode()) % ((1 << MARK_BITS) - 1) + 1


def which(wanted: Wanted, names: Sequence[str]) -> int | None:
    """Return the index of the refuge that is wanted among those with these names, None: there is none such."""
    mark = mark_of(wanted.name) if wanted.name else wanted.mark
    if mark:
        return next((n for n, name in enumerate(names) if name and mark_of(name) == mark), None)
    return wanted.number - 1 if 1 <= wanted.number <= len(names) else None


# Orders in words, as a person types them: ``hold``, ``refuge Bay``, ``goal 51.1 -1.3``.


def phrase(words: Sequence[str]) -> Wanted:
    """Return what the words want.

    Raises:
        InputError: no verb of ours, or not what it takes.

    >>> phrase(["goal", "51.1", "-1.3"]).words
    'goal 51.10000 -1.30000'
    """
    if not words:
        raise InputError("VERB", "", "is missing", f"there are {', '.join(Verb)}")
    verb = verb_named(words[0])
    if verb is None:
        said, _, remedy = unknown(words[0]).partition("; ")
        raise InputError(words[0][:40], "", said, remedy)
    rest = list(words[1:])
    if verb is Verb.REFUGE:
        number = int(rest[0]) if len(rest) == 1 and rest[0].isdecimal() and len(rest[0]) < 7 else 0
        return Wanted(verb=verb, number=number, name="" if number else " ".join(rest))
    if verb is Verb.GOAL:
        return Wanted(verb=verb, place=_place(rest))
    if verb is Verb.FORGET_SHOAL and rest:
        if len(rest) > 1 or not rest[0].isdecimal() or not 0 < len(rest[0]) < 4:
            raise InputError(
                str(verb), "", f"{' '.join(rest)[:40]!r} is no number of a shoal", "leave it out, or write 3"
            )
        return Wanted(verb=verb, number=int(rest[0]))
    if rest:
        raise InputError(str(verb), "", f"takes nothing, and was given {' '.join(rest)[:40]!r}")
    return Wanted(verb=verb)


def _place(words: list[str]) -> Place:
    usage = f"write {Verb.GOAL} {BY_VERB[Verb.GOAL].takes} in degrees, as in goal 51.1234 -1.3456"
    parts = [part for word in words for part in word.split(",") if part]
    try:
        lat_deg, lon_deg = (float(part) for part in parts)
    except ValueError:
        raise InputError(Verb.GOAL, "", f"{' '.join(words)[:40]!r} is not a position", usage) from None
    place = Place(lat_deg=lat_deg, lon_deg=lon_deg)
    if place.trouble:
        raise InputError(Verb.GOAL, "", place.trouble, usage)
    return place
