"""Orders and statuses far away: a few sealed bytes each, over a link that delays, loses, doubles and reorders them."""

from companion.orders.far.judge import MOST_AHEAD_S, WINDOW, Reply, Taken, judged, reply_of
from companion.orders.far.layout import minutes_of, unix_of
from companion.orders.far.order import MOST_COUNTER, FarOrder, pack_order, unpack_order
from companion.orders.far.seal import FarKey
from companion.orders.far.status import FarStatus, pack_status, unpack_status

__all__ = [
    "MOST_AHEAD_S", "MOST_COUNTER", "WINDOW", "FarKey", "FarOrder", "FarStatus", "Reply", "Taken", "judged",
    "minutes_of", "pack_order", "pack_status", "reply_of", "unix_of", "unpack_order", "unpack_status",
]
