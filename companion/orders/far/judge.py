"""The judge of orders from far away: they come late, twice, in any order, or not at all.

Each has a counter that its sender never uses again, and a time after which it counts for nothing. Every counter is
taken once. A link that reorders needs more than the highest: of the last 64 each may still come. What is older is
refused, and so is an order where the boat does not know the time.
"""

from __future__ import annotations

import enum
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from companion.orders.far.layout import unix_of
from companion.orders.far.order import MOST_COUNTER, FarOrder
from companion.orders.order import Result

WINDOW = 64
MOST_AHEAD_S = 7 * 86_400.0 + 3600.0   # an order that lives longer is somebody's mistake, or a wrong clock
FORMAT = 1


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


REPLIES = tuple(Reply)
_BY_RESULT = {Result.DONE: Reply.DONE, Result.REFUSED: Reply.REFUSED, Result.NOT_NOW: Reply.NOT_NOW}


def reply_of(result: Result) -> Reply:
    """Return what is told of an answer."""
    return _BY_RESULT.get(result, Reply.REFUSED)


@dataclass(frozen=True, slots=True)
class Taken:
    """The orders that were taken, of the window only: mark and reply by counter. It outlives restarts."""

    replies: Mapping[int, tuple[str, Reply]] = field(default_factory=dict)

    @property
    def highest(self) -> int:
        """The highest counter, 0 without one."""
        return max(self.replies, default=0)

    def with_reply(self, order: FarOrder, reply: Reply) -> Taken:
        """Return it with one order more, or another reply to the same."""
        replies = {**self.replies, order.counter: (order.mark, reply)}
        least = max(replies) - WINDOW
        return Taken({n: said for n, said in sorted(replies.items()) if n > least})

    def to_dict(self, key_name: str) -> dict[str, Any]:
        """Return plain JSON values."""
        return {"format": FORMAT, "key": key_name,
                "replies": {str(n): [mark, reply.value] for n, (mark, reply) in self.replies.items()}}

    @classmethod
    def from_dict(cls, data: Any, key_name: str) -> Taken:
        """Read ``to_dict``'s result; of another key nothing was taken yet.

        Raises:
            ValueError: it cannot be believed.
        """
        try:
            if data["format"] != FORMAT:
                raise ValueError(f"its format is {str(data['format'])[:20]}, not {FORMAT}")
            if data["key"] != key_name:
                return cls()
            replies = {int(n): (str(mark), Reply(reply)) for n, (mark, reply) in data["replies"].items()}
        except (KeyError, TypeError, AttributeError) as error:
            raise ValueError(f"it is damaged: {str(error)[:80]}") from error
        if len(replies) > WINDOW or any(not 0 < n <= MOST_COUNTER for n in replies):
            raise ValueError("it is damaged: these are no counters")
        return cls(replies)


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
