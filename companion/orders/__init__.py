"""Orders: what the crew may ask of the boat, how it is asked over MAVLink and in words, and how it is answered."""

from companion.orders.asking import GIVE_UP_S, OrderSend, give, lead_in
from companion.orders.buttons import qgc_actions
from companion.orders.fields import COMMANDS, RESULTS, message_of, wanted_of
from companion.orders.order import FAR, LOCAL, MAVLINK, Answer, Order, Place, Result, Source, Wanted, mark_of, which
from companion.orders.phrase import phrase
from companion.orders.verbs import ALL, BY_VERB, TABLE, Verb, permitted, unknown, verb_named

__all__ = [
    "ALL", "BY_VERB", "COMMANDS", "FAR", "GIVE_UP_S", "LOCAL", "MAVLINK", "RESULTS", "TABLE", "Answer", "Order",
    "OrderSend", "Place", "Result", "Source", "Verb", "Wanted", "give", "lead_in", "mark_of", "message_of", "permitted",
    "phrase", "qgc_actions", "unknown", "verb_named", "wanted_of", "which",
]
