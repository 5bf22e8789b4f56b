"""An order as a value: what is wanted, who asked and when, how it was answered."""

from __future__ import annotations

import enum
import math
import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from companion.messages import GeoPoint
from companion.orders.verbs import Verb

MAVLINK, LOCAL, FAR = "mavlink", "local", "far"   # the ways in which orders come
MARK_BITS = 24   # a float32 holds so many exactly


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
        number: of a refuge in the mission's order, 0: the nearest.
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

    ``local``: over the socket on board, each connection its own. ``far``: by satellite, each counter its own.
    """

    kind: str
    system: int = 0
    component: int = 0

    @property
    def words(self) -> str:
        """Whom to name."""
        return {LOCAL: "somebody on board", FAR: "somebody far away"}.get(self.kind, f"{self.system}/{self.component}")


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
            "verb": None if wanted.verb is None else wanted.verb.value, "name": wanted.name, "number": wanted.number,
            "mark": wanted.mark, "fault": wanted.fault,
            "place": None if wanted.place is None else [repr(wanted.place.lat_deg), repr(wanted.place.lon_deg)],
            "source": [self.source.kind, self.source.system, self.source.component], "heard_s": self.t_s,
            "command": self.command, "authority": self.authority,
        }

    @classmethod
    def from_dict(cls, data: dict[str, Any]) -> Order:
        """Read ``to_dict``'s result. Raises KeyError, ValueError or TypeError where it is none."""
        place, source = data["place"], data["source"]
        return cls(
            wanted=Wanted(
                verb=None if data["verb"] is None else Verb(data["verb"]), name=data["name"], number=data["number"],
                mark=data["mark"], fault=data["fault"],
                place=None if place is None else Place(lat_deg=float(place[0]), lon_deg=float(place[1]))),
            source=Source(kind=source[0], system=source[1], component=source[2]), t_s=float(data["heard_s"]),
            command=data["command"], authority=data["authority"])


class Result(enum.Enum):
    """How an order ended."""

    DONE = "done"            # taken: it is being carried out, or stands
    REFUSED = "refused"      # not permitted, or it cannot be done: the same again will be refused again
    NOT_NOW = "not now"      # as things are; another time it may be
    UNKNOWN = "unknown"      # no order of ours
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
