"""An order in 24 bytes: what is wanted, until when it counts, its counter, and the code of who has the key.

A beginning in 15 bytes: from then on the counters count from 1 again.
"""

from __future__ import annotations

import enum
import hashlib
import hmac
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from companion.orders.order import BY_VERB, NUMBERED, Place, Result, Verb, Wanted, mark_of, verb_of

SEAL_BYTES = 8
ORDER, STATUS, BEGINNING, NAME = "order", "status", "beginning", "name"  # purposes
EPOCH_S = 1_577_836_800  # 2020-01-01T00:00:00Z: minutes in three bytes from here on last until 2051


@dataclass(frozen=True, slots=True, kw_only=True)
class BitField:
    """One field: ``size`` bytes; ``step`` of one count, in the SI unit of the value; ``unit`` is what the table says.

    ``unknown``: the count for a value that is not known, None: it always is. ``circle``: so many counts make a turn.
    """

    name: str
    size: int
    says: str
    step: float = 1.0
    unit: str = ""
    unknown: int | None = None
    is_signed: bool = False
    circle: int | None = None

    @property
    def limits(self) -> tuple[int, int]:
        """The least and the greatest count."""
        bits = 8 * self.size
        low, high = (-(1 << bits - 1), (1 << bits - 1) - 1) if self.is_signed else (0, (1 << bits) - 1)
        return low + (self.unknown == low), high - (self.unknown == high)

    def count(self, value: float | None) -> int:
        """Return a value as a count: the nearest that there is."""
        if value is None:
            assert self.unknown is not None
            return self.unknown
        count = round(value / self.step)
        if self.circle is not None:
            return count % self.circle
        low, high = self.limits
        return max(low, min(high, count))

    def value(self, count: int) -> float | None:
        """Return the value of a count."""
        return None if count == self.unknown else count * self.step


@dataclass(frozen=True, slots=True)
class Layout:
    """Fields one behind the other, little-endian, without gaps.

    A value that does not fit is told as the nearest that does: never as another one, never as unknown. What is not
    known has a number of its own, which is never 0.
    """

    fields: tuple[BitField, ...]

    @property
    def size(self) -> int:
        """Bytes in all."""
        return sum(field.size for field in self.fields)

    def pack(self, counts: Mapping[str, int]) -> bytes:
        """Return the bytes of the counts, one for each field."""
        return b"".join(counts[f.name].to_bytes(f.size, "little", signed=f.is_signed) for f in self.fields)

    def unpack(self, data: bytes) -> dict[str, int]:
        """Return the counts in ``size`` bytes."""
        counts, at = {}, 0
        for one in self.fields:
            counts[one.name] = int.from_bytes(data[at : at + one.size], "little", signed=one.is_signed)
            at += one.size
        return counts

    def rows(self) -> Sequence[str]:
        """Return the rows of its table in the documentation."""
        rows, at = [], 0
        for one in self.fields:
            kind = f"{'i' if one.is_signed else 'u'}{8 * one.size}"
            unknown = "-" if one.unknown is None else str(one.unknown)
            rows.append(f"| {at} | {kind} | `{one.name}` | {one.unit or '-'} | {unknown} | {one.says} |")
            at += one.size
        return rows


def minutes_of(unix_s: float) -> int:
    """Return a moment in whole minutes since 2020 (UTC), the one that it is in."""
    return int((unix_s - EPOCH_S) // 60.0)


def unix_of(minutes: int) -> float:
    """Return the moment [s since 1970] at which a minute begins."""
    return EPOCH_S + 60.0 * minutes


@dataclass(frozen=True, slots=True, repr=False)
class FarKey:
    """A key of 32 bytes and the MAVLink system id of the boat that it is used for.

    What it seals with is HMAC-SHA-256 (RFC 2104), cut to 64 bits, with a key of its own for each purpose and boat: what
    was sealed as a status or for another system is no order of this one. The key file is that of ``companion key new``.

    ``began`` is the minute (since 2020) from which the counters of orders count, 0: from the first order with this key.
    It is in the code of every order: what was sealed before a beginning is none of those behind it.
    """

    key: bytes
    system: int
    began: int = 0

    @property
    def name(self) -> str:
        """A name of the key for files, which tells nothing of it."""
        return self._code(NAME, b"").hex()

    def since(self, began: int) -> FarKey:
        """Return the key as it seals orders since a beginning."""
        return replace(self, began=began)

    def sealed(self, purpose: str, body: bytes) -> bytes:
        """Return ``body`` with its code behind it."""
        return body + self._code(purpose, body)

    def opened(self, purpose: str, data: bytes, size: int) -> bytes:
        """Return the body, which with its code has ``size`` bytes.

        Raises:
            ValueError: it is of another length, or its code is not ours.
        """
        if len(data) != size:
            raise ValueError(f"it has {len(data)} bytes, and not {size}: no {purpose}")
        body, code = data[:-SEAL_BYTES], data[-SEAL_BYTES:]
        if not hmac.compare_digest(code, self._code(purpose, body)):
            older = f", or of before {BEGINNING} {self.began}" if purpose == ORDER and self.began else ""
            raise ValueError(f"its code is wrong: damaged, another key, or not system {self.system}'s{older}")
        return body

    def _code(self, purpose: str, body: bytes) -> bytes:
        since = f" began {self.began}" if purpose == ORDER and self.began else ""
        own = hmac.digest(
            self.key, f"companion far {purpose} 1 system {self.system}{since}".encode("ascii"), hashlib.sha256
        )
        return hmac.digest(own, body, hashlib.sha256)[:SEAL_BYTES]


VERSION = 1
MOST_COUNTER = 0xFFFF
MARK_BYTES = 4
LAYOUT = Layout(
    (
        BitField(name="version", size=1, says=f"{VERSION}"),
        BitField(name="verb", size=1, says="its number, as in [orders](../guides/orders.md)"),
        BitField(
            name="number", size=1, says="of a refuge in the mission, or of a shoal; 0: the nearest, or by `lat`; else 0"
        ),
        BitField(
            name="expires", size=3, unit="min since 2020-01-01 UTC", says="from this moment on it counts for nothing"
        ),
        BitField(name="counter", size=2, says="from 1, never twice since one beginning"),
        BitField(
            name="lat",
            size=4,
            is_signed=True,
            unit="1e-7 deg",
            says="of a goal; of a refuge the number of its name (`param3` in [orders](../guides/orders.md)) or 0; "
            "else 0",
        ),
        BitField(name="lon", size=4, is_signed=True, unit="1e-7 deg", says="of a goal; else 0"),
    )
)
SIZE = LAYOUT.size + SEAL_BYTES
BEGINNING_LAYOUT = Layout(
    (
        BitField(name="version", size=1, says=f"{VERSION}"),
        BitField(
            name="began", size=3, unit="min since 2020-01-01 UTC", says="when it was given: later than every one before"
        ),
        BitField(
            name="expires", size=3, unit="min since 2020-01-01 UTC", says="from this moment on it counts for nothing"
        ),
    )
)
BEGINNING_SIZE = BEGINNING_LAYOUT.size + SEAL_BYTES


@dataclass(frozen=True, slots=True, kw_only=True)
class FarOrder:
    """An order that was given with the key. It counts before the minute ``expires_min`` since 2020.

    ``mark`` is of its bytes, once there are any: two orders with one counter are told apart by it.
    """

    wanted: Wanted
    counter: int
    expires_min: int
    mark: str = field(default="", compare=False)


@dataclass(frozen=True, slots=True, kw_only=True)
class Beginning:
    """Counters begin anew at the minute ``began``. It counts before the minute ``expires_min``; both since 2020."""

    began: int
    expires_min: int


def pack_beginning(beginning: Beginning, key: FarKey) -> bytes:
    """Return a beginning's 15 bytes. Raises ValueError: it lies at no time."""
    try:
        return key.sealed(
            BEGINNING,
            BEGINNING_LAYOUT.pack({"version": VERSION, "began": beginning.began, "expires": beginning.expires_min}),
        )
    except OverflowError:
        raise ValueError("a moment is too far away for its field") from None


def unpack_beginning(data: bytes, key: FarKey) -> Beginning:
    """Return the beginning in 15 bytes.

    Raises:
        ValueError: it is none, or none of ours; the sentence says why.
    """
    counts = BEGINNING_LAYOUT.unpack(key.opened(BEGINNING, data, BEGINNING_SIZE))
    if counts["version"] != VERSION:
        raise ValueError(f"it is of version {counts['version']}, and this is {VERSION}: another release made it")
    return Beginning(began=counts["began"], expires_min=counts["expires"])


def pack_order(order: FarOrder, key: FarKey) -> bytes:
    """Return an order's 24 bytes.

    Raises:
        ValueError: it cannot be said so: no verb, a goal that is no place, a number that does not fit.
    """
    wanted = order.wanted
    if wanted.verb is None or wanted.fault:
        raise ValueError(wanted.fault or "nothing is wanted")
    if not 0 < order.counter <= MOST_COUNTER:
        raise ValueError(f"the counter {order.counter} is not in 1 to {MOST_COUNTER}")
    counts = {
        "version": VERSION,
        "verb": BY_VERB[wanted.verb].number,
        "number": 0,
        "expires": order.expires_min,
        "counter": order.counter,
        "lat": 0,
        "lon": 0,
    }
    if wanted.verb is Verb.GOAL:
        if wanted.place is None or wanted.place.trouble:
            raise ValueError("a goal needs a position" if wanted.place is None else wanted.place.trouble)
        counts |= {"lat": round(wanted.place.lat_deg * 1e7), "lon": round(wanted.place.lon_deg * 1e7)}
    elif wanted.verb in NUMBERED:
        counts |= {"number": wanted.number, "lat": mark_of(wanted.name) if wanted.name else wanted.mark}
    try:
        return key.sealed(ORDER, LAYOUT.pack(counts))
    except OverflowError:
        raise ValueError("a number is too large for its field") from None


def unpack_order(data: bytes, key: FarKey) -> FarOrder:
    """Return the order in 24 bytes.

    Raises:
        ValueError: it is none, or none of ours; the sentence says why.
    """
    counts = LAYOUT.unpack(key.opened(ORDER, data, SIZE))
    if counts["version"] != VERSION:
        raise ValueError(f"it is of version {counts['version']}, and this is {VERSION}: another release made it")
    verb = verb_of(counts["verb"])
    number, lat, lon = counts["number"], counts["lat"], counts["lon"]
    if verb is None:
        raise ValueError(f"there is no order {counts['verb']}")
    if counts["counter"] == 0:
        raise ValueError("its counter is 0")
    if (
        (number and verb not in NUMBERED)
        or (lat and verb not in {Verb.REFUGE, Verb.GOAL})
        or (lon and verb is not Verb.GOAL)
        or (verb is Verb.REFUGE and lat < 0)
    ):
        raise ValueError(f"{verb} takes no such number or place")
    place = Place(lat_deg=lat / 1e7, lon_deg=lon / 1e7) if verb is Verb.GOAL else None
    mark = lat if verb is Verb.REFUGE else 0
    return FarOrder(
        wanted=Wanted(verb=verb, number=number, mark=mark, place=place),
        counter=counts["counter"],
        expires_min=counts["expires"],
        mark=data[-MARK_BYTES:].hex(),
    )


WINDOW = 64
MOST_JUMP = 1024  # counters ahead of the highest: as many messages as are lost in a row, and more
MOST_AHEAD_S = 7 * 86_400.0 + 3600.0  # an order that lives longer is somebody's mistake, or a wrong clock
# A beginning may be so far ahead of the boat's clock: one of a clock that is days ahead would keep every other one out.
MOST_CLOCK_S = 3600.0
FORMAT = 2
_MOST_MINUTE = (1 << 24) - 1


class Reply(enum.StrEnum):
    """How an order ended, in the words of the shore; its number in a status is its place here, from 1."""

    DONE = "done"
    REFUSED = "refused"
    NOT_NOW = "not now"
    TAKEN = "taken, with no answer yet"
    EXPIRED = "expired"
    NO_CLOCK = "refused: the boat does not know the time"
    TOO_LONG = "refused: it would live for more than a week"
    OVERTAKEN = "refused: its counter is more than 63 behind"
    USED = "refused: its counter was used for another order"
    AHEAD = "refused: its counter is more than 1024 ahead"
    BEGUN = "begun anew: counters count from 1"
    CLOCK = "refused: a beginning of more than an hour from now, by the boat's clock"
    OLD = "refused: a beginning that is no later than the one that counts"


REPLIES = tuple(Reply)
_BY_RESULT = {Result.DONE: Reply.DONE, Result.REFUSED: Reply.REFUSED, Result.NOT_NOW: Reply.NOT_NOW}


def reply_of(result: Result) -> Reply:
    """Return what is told of an answer."""
    return _BY_RESULT.get(result, Reply.REFUSED)


@dataclass(frozen=True, slots=True)
class Taken:
    """The orders that were taken, of the window only: mark and reply by counter. It outlives restarts.

    ``began``: the minute since 2020 of the beginning that counts, 0: there was none.
    """

    replies: Mapping[int, tuple[str, Reply]] = field(default_factory=dict)
    began: int = 0

    @property
    def highest(self) -> int:
        """The highest counter, 0 without one."""
        return max(self.replies, default=0)

    def with_reply(self, order: FarOrder, reply: Reply) -> Taken:
        """Return it with one order more, or another reply to the same."""
        replies = {**self.replies, order.counter: (order.mark, reply)}
        least = max(replies) - WINDOW
        return Taken({n: said for n, said in sorted(replies.items()) if n > least}, self.began)

    def to_dict(self, key_name: str) -> dict[str, Any]:
        """Return plain JSON values."""
        return {
            "format": FORMAT,
            "key": key_name,
            "began": self.began,
            "replies": {str(n): [mark, reply.value] for n, (mark, reply) in self.replies.items()},
        }

    @classmethod
    def from_dict(cls, data: Any, key_name: str) -> Taken:
        """Read ``to_dict``'s result; of another key nothing was taken yet.

        Raises:
            ValueError: it cannot be believed.
        """
        try:
            if data["format"] not in {1, FORMAT}:
                raise ValueError(f"its format is {str(data['format'])[:20]}, not {FORMAT}")
            if data["key"] != key_name:
                return cls()
            began = 0 if data["format"] == 1 else data["began"]
            if not isinstance(began, int) or not 0 <= began <= _MOST_MINUTE:
                raise ValueError("it is damaged: it begins at no moment")
            replies = {int(n): (str(mark), Reply(reply)) for n, (mark, reply) in data["replies"].items()}
        except (KeyError, TypeError, AttributeError) as error:
            raise ValueError(f"it is damaged: {str(error)[:80]}") from error
        if len(replies) > WINDOW or any(not 0 < n <= MOST_COUNTER for n in replies):
            raise ValueError("it is damaged: these are no counters")
        return cls(replies, began)


def judged(order: FarOrder, taken: Taken, unix_s: float | None) -> tuple[Reply | None, Taken]:
    """Judge an authentic order by the boat's clock [s since 1970], None: not known.

    Orders come late, twice, in any order, or not at all. Each has a counter that its sender never uses again, and a
    time after which it counts for nothing. Every counter is taken once. A link that reorders needs more than the
    highest: of the last 64 each may still come. What is older is refused, and so is an order where the boat does not
    know the time. A counter far ahead is a slip of the shore's, and would leave no room for those behind it: it is
    refused and not remembered.

    Returns:
        its reply, None: it is to be carried out, once; and what is taken from now on, to be kept before that.
    """
    before = taken.replies.get(order.counter)
    if before is not None:
        mark, reply = before
        return reply if mark == order.mark else Reply.USED, taken
    if order.counter <= taken.highest - WINDOW:
        return Reply.OVERTAKEN, taken
    if order.counter > taken.highest + MOST_JUMP:
        return Reply.AHEAD, taken
    if unix_s is None:
        return Reply.NO_CLOCK, taken  # sent again when it knows, it may count
    left_s = unix_of(order.expires_min) - unix_s
    if left_s <= 0.0:
        reply = Reply.EXPIRED
    elif left_s > MOST_AHEAD_S:
        reply = Reply.TOO_LONG
    else:
        return None, taken.with_reply(order, Reply.TAKEN)
    return reply, taken.with_reply(order, reply)


def begun(beginning: Beginning, taken: Taken, unix_s: float | None) -> tuple[Reply, Taken]:
    """Judge an authentic beginning by the boat's clock [s since 1970], None: not known.

    Where shore and boat have lost each other's count, the shore begins anew: a sealed moment later than every one
    before. From then on counters count from 1, and nothing counts that was sealed before it (``FarKey.began``), however
    often it is played back.

    Returns:
        its reply, and what is taken from now on, to be kept.
    """
    if beginning.began == taken.began:
        return Reply.BEGUN, taken  # come again
    if beginning.began < taken.began:
        return Reply.OLD, taken
    if unix_s is None:
        return Reply.NO_CLOCK, taken
    if unix_of(beginning.expires_min) <= unix_s:
        return Reply.EXPIRED, taken
    if unix_of(beginning.began) > unix_s + MOST_CLOCK_S:
        return Reply.CLOCK, taken
    if unix_of(beginning.expires_min) > unix_s + MOST_AHEAD_S:
        return Reply.TOO_LONG, taken
    return Reply.BEGUN, Taken(began=beginning.began)
