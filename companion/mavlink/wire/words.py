"""The dialect's own words: what it says of each value of each enumeration, given back where nobody reads it.

Pymavlink makes an object of every value of its 250 enumerations, with a description, and of every parameter of a
command: a megabyte in a process that sails. What is read of them is a few names.
"""

from __future__ import annotations

from pymavlink.dialects.v20 import ardupilotmega as wire

NAMED = frozenset({"MAV_AUTOPILOT", "MAV_CMD", "MAV_MISSION_RESULT", "MAV_RESULT", "MAV_TYPE"})
"""The enumerations whose values are told by their names here."""


def give_back_words() -> None:
    """Keep of pymavlink's enumerations the names of those that are told; the constants stay as they are."""
    none: dict[int, str] = {}
    for name in wire.enums.keys() - NAMED:
        del wire.enums[name]
    for enumeration in wire.enums.values():
        for entry in enumeration.values():
            entry.description, entry.param, entry.label = "", none, none
