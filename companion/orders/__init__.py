"""Orders: what the crew may ask of the boat, how it is asked over MAVLink and in words, and how it is answered."""

from companion.orders.mavlink_commands import (
    COMMANDS,
    GIVE_UP_S,
    RESULTS,
    OrderSend,
    give,
    lead_in,
    message_of,
    qgc_actions,
    wanted_of,
)
from companion.orders.order import (
    ALL,
    BY_VERB,
    FAR,
    LOCAL,
    MAVLINK,
    TABLE,
    Answer,
    Order,
    Place,
    Result,
    Source,
    Verb,
    Wanted,
    mark_of,
    permitted,
    phrase,
    unknown,
    verb_named,
    which,
)

__all__ = [
    "ALL", "BY_VERB", "COMMANDS", "FAR", "GIVE_UP_S", "LOCAL", "MAVLINK", "RESULTS", "TABLE", "Answer", "Order",
    "OrderSend", "Place", "Result", "Source", "Verb", "Wanted", "give", "lead_in", "mark_of", "message_of", "permitted",
    "phrase", "qgc_actions", "unknown", "verb_named", "wanted_of", "which",
]
