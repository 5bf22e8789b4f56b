"""Orders as MAVLink commands, both ways: MAV_CMD_USER_1 with a verb, MAV_CMD_USER_2 as COMMAND_INT with a position.

ArduPilot does nothing with either (it answers UNSUPPORTED), so one that reaches it in place of us moves nothing.
"""

from __future__ import annotations

import math
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as wire

from companion.mavlink.reception import OWN_COMPONENT
from companion.mavlink.wire import Message
from companion.orders.order import Place, Result, Wanted, mark_of
from companion.orders.verbs import BY_VERB, TABLE, Verb, verb_of

VERB_COMMAND, PLACE_COMMAND = int(wire.MAV_CMD_USER_1), int(wire.MAV_CMD_USER_2)
COMMANDS = frozenset({VERB_COMMAND, PLACE_COMMAND})
GLOBAL_FRAMES = frozenset({
    wire.MAV_FRAME_GLOBAL, wire.MAV_FRAME_GLOBAL_RELATIVE_ALT, wire.MAV_FRAME_GLOBAL_INT,
    wire.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT, wire.MAV_FRAME_GLOBAL_TERRAIN_ALT, wire.MAV_FRAME_GLOBAL_TERRAIN_ALT_INT})
RESULTS = {
    Result.DONE: int(wire.MAV_RESULT_ACCEPTED), Result.REFUSED: int(wire.MAV_RESULT_DENIED),
    Result.NOT_NOW: int(wire.MAV_RESULT_TEMPORARILY_REJECTED), Result.UNKNOWN: int(wire.MAV_RESULT_UNSUPPORTED),
}


def wanted_of(message: Any) -> Wanted:
    """Return what a COMMAND_LONG or COMMAND_INT of ``COMMANDS`` wants; what cannot be read says why. Never raises."""
    is_int = message.get_type() == "COMMAND_INT"
    if message.command == PLACE_COMMAND:
        return _place(message, is_int=is_int)
    number = float(message.param1)
    verb = verb_of(number) if math.isfinite(number) else None
    if verb is None:
        known = ", ".join(f"{row.number} {row.verb}" for row in TABLE)
        return Wanted(verb=None, fault=f"there is no order {number:g}; param1 is one of {known}")
    if verb is Verb.GOAL:
        return Wanted(verb=verb, fault="a goal needs a position: send MAV_CMD_USER_2 as COMMAND_INT")
    if verb is not Verb.REFUGE:
        return Wanted(verb=verb)
    count, mark = _whole(message.param2), _whole(message.param3)
    if count is None or mark is None:
        return Wanted(verb=verb, fault="the refuge's number (param2; 0: the nearest) is a whole number")
    return Wanted(verb=verb, number=count, mark=mark)


def _place(message: Any, *, is_int: bool) -> Wanted:
    if not is_int:
        return Wanted(verb=Verb.GOAL, fault="a position comes as COMMAND_INT: a COMMAND_LONG's is a metre off")
    if message.frame not in GLOBAL_FRAMES:
        return Wanted(verb=Verb.GOAL, fault=f"frame {message.frame} is not a global one (0, 3, 5 or 6)")
    return Wanted(verb=Verb.GOAL, place=Place(lat_deg=message.x / 1e7, lon_deg=message.y / 1e7))


def _whole(value: float) -> int | None:
    """Return a parameter that is a number to count with; a ground station leaves one out as NaN."""
    if math.isnan(value):
        return 0
    return int(value) if 0.0 <= value < 1 << 25 and value == int(value) else None


def message_of(wanted: Wanted, system: int, attempt: int = 0) -> Message:
    """Return the command that asks ``wanted`` of the companion of ``system``; ``attempt`` counts from 0.

    Raises:
        ValueError: it is nothing that can be sent: an unknown verb, a goal without its place.
    """
    if wanted.verb is None or wanted.fault:
        raise ValueError(wanted.fault or "nothing is wanted")
    if wanted.verb is not Verb.GOAL:
        return wire.MAVLink_command_long_message(
            system, OWN_COMPONENT, VERB_COMMAND, min(attempt, 255), *params_of(wanted), 0.0, 0.0, 0.0, 0.0)
    if wanted.place is None or wanted.place.trouble:
        raise ValueError("a goal needs a position" if wanted.place is None else wanted.place.trouble)
    return wire.MAVLink_command_int_message(
        system, OWN_COMPONENT, wire.MAV_FRAME_GLOBAL, PLACE_COMMAND, 0, 0, 0.0, 0.0, 0.0, 0.0,
        round(wanted.place.lat_deg * 1e7), round(wanted.place.lon_deg * 1e7), 0.0)


def params_of(wanted: Wanted) -> tuple[float, float, float]:
    """Return param1 to param3 of a verb: its number, the refuge's, the mark of its name."""
    assert wanted.verb is not None
    mark = mark_of(wanted.name) if wanted.name else wanted.mark
    return float(BY_VERB[wanted.verb].number), float(wanted.number), float(mark)
