"""The judge of orders from far away: they come late, twice, in any order, or not at all.

Each has a counter that its sender never uses again, and a time after which it counts for nothing. Every counter is
taken once. A link that reorders needs more than the highest: of the last 64 each may still come. What is older is
refused, and so is an order where the boat does not know the time. A counter far ahead is a slip of the shore's, and
would leave no room for those behind it: it is refused and not remembered.

Where shore and boat have lost each other's count, the shore begins anew: a sealed moment later than every one before.
From then on counters count from 1, and nothing counts that was sealed before it (``FarKey.began``), however often it is
played back.
"""

from __future__ import annotations

import enum
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from companion.orders.far.layout import unix_of
from companion.orders.far.order import MOST_COUNTER, Beginning, FarOrder
from companion.orders.order import Result

WINDOW = 64
MOST_JUMP = 1024                       # counters ahead of the highest: as many messages as are lost in a row, and more
MOST_AHEAD_S = 7 * 86_400.0 + 3600.0   # an order that lives longer is somebody's mistake, or a wrong clock
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
        return {"format": FORMAT, "key": key_name, "began": self.began,
                "replies": {str(n): [mark, reply.value] for n, (mark, reply) in self.replies.items()}}

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
        return Reply.NO_CLOCK, taken   # sent again when it knows, it may count
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

    Returns:
        its reply, and what is taken from now on, to be kept.
    """
    if beginning.began == taken.began:
        return Reply.BEGUN, taken    # come again
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
