"""The messages that this program reads, and where.

A test holds this table and the code together; ``sitl hostile`` forges each of them. Beside these, every message with
``time_boot_ms`` counts for the autopilot's clock, and every one for its sequence numbers (``reception``), whatever it
says.
"""

from __future__ import annotations

from collections.abc import Mapping

_LISTS = ("mission", "mavsdk_session")

# Name -> the modules that read it.
READS: Mapping[str, tuple[str, ...]] = {
    "HEARTBEAT": ("vehicle_identity", "reception", "link", "assembler", "fold", "mavsdk_session"),
    "ATTITUDE": ("assembler",),
    "GLOBAL_POSITION_INT": ("assembler",),
    "WIND": ("assembler",),
    "NAMED_VALUE_FLOAT": ("assembler", "link", "companion_status"),
    "MISSION_CURRENT": ("assembler",),
    "NAV_CONTROLLER_OUTPUT": ("assembler",),
    "EKF_STATUS_REPORT": ("assembler",),
    "GPS_RAW_INT": ("assembler",),
    "GPS2_RAW": ("assembler",),
    "SYS_STATUS": ("assembler",),
    "SYSTEM_TIME": ("assembler",),
    "FENCE_STATUS": ("assembler",),
    "DISTANCE_SENSOR": ("assembler",),
    "WATER_DEPTH": ("assembler",),
    "RANGEFINDER": ("assembler",),
    "RC_CHANNELS": ("assembler",),
    "SERVO_OUTPUT_RAW": ("assembler",),
    "STATUSTEXT": ("assembler", "command", "mavsdk_session", "mavlink_commands"),
    "AIS_VESSEL": ("assembler",),
    "HOME_POSITION": ("assembler", "autopilot"),
    "AUTOPILOT_VERSION": ("autopilot", "fold"),
    "PARAM_VALUE": ("fold", "parameters"),
    "COMMAND_ACK": ("assembler", "command", "mavlink_commands"),
    "COMMAND_LONG": ("reception", "link"),
    "COMMAND_INT": ("reception", "link", "mavlink_commands"),
    "MISSION_COUNT": _LISTS,
    "MISSION_ITEM_INT": ("codec", *_LISTS),
    "MISSION_ITEM": ("mission",),
    "MISSION_REQUEST": _LISTS,
    "MISSION_REQUEST_INT": _LISTS,
    "MISSION_ACK": _LISTS,
    "FILE_TRANSFER_PROTOCOL": ("ftp",),
    "TUNNEL": ("companion_status",),
    "WIND_COV": ("companion_status",),
}
# Read only by who listens ashore, from the companion's own component.
ASHORE = frozenset({"TUNNEL", "WIND_COV"})
