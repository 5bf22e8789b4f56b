"""Orders: what the crew may ask of the boat, how it is asked over MAVLink and in words, and how it is answered."""

from companion.orders.mavlink_commands import COMMANDS, RESULTS, give, lead_in, message_of, qgc_actions, wanted_of
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
    which,
)

__all__ = [
    "ALL", "BY_VERB", "COMMANDS", "FAR", "LOCAL", "MAVLINK", "RESULTS", "TABLE", "Answer", "Order", "Place",
    "Result", "Source", "Verb", "Wanted", "give", "lead_in", "mark_of", "message_of", "permitted", "phrase",
    "qgc_actions", "unknown", "wanted_of", "which",
]
