"""Who speaks on a link, which of it is ours to hear, and what of that is believed. Pure."""

from companion.mavlink.trust.census import LISTEN_S, ROVERS, type_words, yields_to
from companion.mavlink.trust.identity import GAP_S, UID_EVERY_S, Identity
from companion.mavlink.trust.link_stats import LinkStats
from companion.mavlink.trust.reception import OWN_COMPONENT, SHORE, TOOL_COMPONENT, LinkIdentity
from companion.mavlink.trust.witness import Witness

__all__ = [
    "GAP_S", "LISTEN_S", "OWN_COMPONENT", "ROVERS", "SHORE", "TOOL_COMPONENT", "UID_EVERY_S", "Identity",
    "LinkIdentity", "LinkStats", "Witness", "type_words", "yields_to",
]
