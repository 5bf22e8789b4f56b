"""Orders and statuses far away: a few sealed bytes each, over a link that delays, loses, doubles and reorders them."""

from companion.orders.far.order import (
    BEGINNING_SIZE,
    MOST_COUNTER,
    MOST_JUMP,
    WINDOW,
    Beginning,
    FarKey,
    FarOrder,
    Reply,
    Taken,
    begun,
    judged,
    minutes_of,
    pack_beginning,
    pack_order,
    reply_of,
    unix_of,
    unpack_beginning,
    unpack_order,
)
from companion.orders.far.status import FarStatus, pack_status, unpack_status

__all__ = [
    "BEGINNING_SIZE", "MOST_COUNTER", "MOST_JUMP", "WINDOW", "Beginning", "FarKey", "FarOrder", "FarStatus",
    "Reply", "Taken", "begun", "judged", "minutes_of", "pack_beginning", "pack_order", "pack_status", "reply_of",
    "unix_of", "unpack_beginning", "unpack_order", "unpack_status",
]
