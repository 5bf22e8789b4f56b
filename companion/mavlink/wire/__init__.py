"""What is on the wire: frames, messages as values and back, lists of items, streams, our own status."""

from companion.mavlink.wire.assembler import MEMORY_S, VehicleAssembler
from companion.mavlink.wire.boot_time import since_boot_s
from companion.mavlink.wire.codec import AUTOPILOT_COMPONENT, autopilot_version, is_autopilot_heartbeat
from companion.mavlink.wire.companion_status import CONTROL_COMMAND, HIGH_LATENCY_S, StatusReader, StatusReport
from companion.mavlink.wire.frames import Codec, Dialect, Drop, Message
from companion.mavlink.wire.items import first_difference, mission_hash
from companion.mavlink.wire.parameter_ranges import BY_L1, L1_RANGES, RANGES, Effect, believable, effect_of
from companion.mavlink.wire.sounder import Sounder
from companion.mavlink.wire.streams import Stream
from companion.mavlink.wire.words import give_back_words

__all__ = [
    "AUTOPILOT_COMPONENT",
    "BY_L1",
    "CONTROL_COMMAND",
    "HIGH_LATENCY_S",
    "L1_RANGES",
    "MEMORY_S",
    "RANGES",
    "Codec",
    "Dialect",
    "Drop",
    "Effect",
    "Message",
    "Sounder",
    "StatusReader",
    "StatusReport",
    "Stream",
    "VehicleAssembler",
    "autopilot_version",
    "believable",
    "effect_of",
    "first_difference",
    "give_back_words",
    "is_autopilot_heartbeat",
    "mission_hash",
    "since_boot_s",
]
