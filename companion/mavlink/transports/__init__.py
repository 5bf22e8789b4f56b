"""Bytes to and from an autopilot: LINK names, serial, UDP and TCP, and the key that signs."""

from companion.mavlink.transports.endpoints import open_link
from companion.mavlink.transports.signing import EPOCH_S, TICKS_PER_S, SigningStore, make_key, read_key
from companion.mavlink.transports.transport import (
    LinkName,
    OnBytes,
    Transport,
    TransportState,
    TransportStats,
    parse_link,
)

__all__ = [
    "EPOCH_S", "TICKS_PER_S", "LinkName", "OnBytes", "SigningStore", "Transport", "TransportState", "TransportStats",
    "make_key", "open_link", "parse_link", "read_key",
]
