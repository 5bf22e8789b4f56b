"""Mission, fence and rally items as the autopilot stores them, and what it accepts."""

from __future__ import annotations

import math
import struct
from typing import Any, NamedTuple

from pymavlink.dialects.v20 import ardupilotmega as mav

MISSION, FENCE, RALLY = 0, 1, 2
# (16384 - 4) / 15 bytes of storage less what else lives there; boards with 32 kB hold 1312
MAX_MISSION = 655
MAX_FENCE = 84
MAX_RALLY = 50

NAV_COMMANDS = frozenset({
    mav.MAV_CMD_NAV_WAYPOINT, mav.MAV_CMD_NAV_LOITER_UNLIM, mav.MAV_CMD_NAV_LOITER_TURNS,
    mav.MAV_CMD_NAV_LOITER_TIME, mav.MAV_CMD_NAV_RETURN_TO_LAUNCH, mav.MAV_CMD_NAV_GUIDED_ENABLE,
    mav.MAV_CMD_NAV_DELAY, mav.MAV_CMD_NAV_SET_YAW_SPEED,
})
DO_COMMANDS = frozenset({
    mav.MAV_CMD_CONDITION_DELAY, mav.MAV_CMD_CONDITION_DISTANCE, mav.MAV_CMD_DO_JUMP, mav.MAV_CMD_DO_CHANGE_SPEED,
    mav.MAV_CMD_DO_SET_HOME, mav.MAV_CMD_DO_AUX_FUNCTION, mav.MAV_CMD_DO_GUIDED_LIMITS,
    mav.MAV_CMD_DO_FENCE_ENABLE, mav.MAV_CMD_DO_SET_RELAY, mav.MAV_CMD_DO_SET_SERVO, mav.MAV_CMD_DO_SET_REVERSE,
    mav.MAV_CMD_DO_SET_ROI, mav.MAV_CMD_JUMP_TAG, mav.MAV_CMD_DO_JUMP_TAG, mav.MAV_CMD_DO_SEND_BANNER,
    mav.MAV_CMD_DO_SET_RESUME_REPEAT_DIST,
})
# DO commands that the vehicle verifies, and therefore reports as reached.
REPORTED_DO = frozenset({
    mav.MAV_CMD_DO_CHANGE_SPEED, mav.MAV_CMD_DO_SET_HOME, mav.MAV_CMD_DO_FENCE_ENABLE,
    mav.MAV_CMD_DO_GUIDED_LIMITS, mav.MAV_CMD_DO_SET_REVERSE, mav.MAV_CMD_DO_SET_ROI,
})
NAMES = {
    mav.MAV_CMD_NAV_WAYPOINT: "WP", mav.MAV_CMD_NAV_LOITER_UNLIM: "LoitUnlim",
    mav.MAV_CMD_NAV_LOITER_TURNS: "LoitTurns", mav.MAV_CMD_NAV_LOITER_TIME: "LoitTime",
    mav.MAV_CMD_NAV_RETURN_TO_LAUNCH: "RTL", mav.MAV_CMD_NAV_GUIDED_ENABLE: "NavGuidedEnable",
    mav.MAV_CMD_DO_CHANGE_SPEED: "ChangeSpeed", mav.MAV_CMD_DO_SET_HOME: "SetHome",
    mav.MAV_CMD_DO_FENCE_ENABLE: "FenceEnable", mav.MAV_CMD_DO_AUX_FUNCTION: "AuxFunction",
    mav.MAV_CMD_NAV_DELAY: "Delay", mav.MAV_CMD_NAV_SET_YAW_SPEED: "NavSetYawSpeed",
}
_LOCATION = frozenset({
    mav.MAV_CMD_NAV_WAYPOINT, mav.MAV_CMD_NAV_LOITER_UNLIM, mav.MAV_CMD_NAV_LOITER_TURNS,
    mav.MAV_CMD_NAV_LOITER_TIME, mav.MAV_CMD_NAV_RETURN_TO_LAUNCH, mav.MAV_CMD_DO_SET_HOME,
})
_FENCE_COMMANDS = frozenset(range(mav.MAV_CMD_NAV_FENCE_RETURN_POINT, mav.MAV_CMD_NAV_FENCE_CIRCLE_EXCLUSION + 1))
_FRAMES = {0: 0, 2: 2, 3: 3, 5: 0, 6: 3, 10: 10, 11: 10}
# MISSION_ITEM_INT without its header, as files of MAVFTP hold it.
FILE_ITEM = struct.Struct("<ffffiifHHBBBBBB")


class Item(NamedTuple):
    """One stored item; positions in degrees x 1e7, altitude in metres."""

    command: int
    frame: int = 3
    p1: float = 0.0
    p2: float = 0.0
    p3: float = 0.0
    p4: float = 0.0
    x: int = 0
    y: int = 0
    z: float = 0.0


def item_from_message(m: Any) -> tuple[Item | None, int]:
    """Return (what is stored of a MISSION_ITEM_INT or MISSION_ITEM, MAV_MISSION_RESULT)."""
    x, y = m.x, m.y
    if m.get_type() == "MISSION_ITEM":
        if not (math.isfinite(x) and math.isfinite(y) and abs(x) < 200.0 and abs(y) < 200.0):
            return None, mav.MAV_MISSION_INVALID_PARAM5_X
        x, y = round(x * 1e7), round(y * 1e7)
    item = Item(m.command, m.frame, m.param1, m.param2, m.param3, m.param4, x, y, m.z)
    return accept(item, m.mission_type)


def accept(item: Item, kind: int) -> tuple[Item | None, int]:
    """Return (the item as it will be read back, MAV_MISSION_RESULT) for a list of ``kind``."""
    for value, error in ((item.p1, mav.MAV_MISSION_INVALID_PARAM1), (item.z, mav.MAV_MISSION_INVALID_PARAM7)):
        if not math.isfinite(value):
            return None, error
    if kind == FENCE:
        if item.command not in _FENCE_COMMANDS:
            return None, mav.MAV_MISSION_UNSUPPORTED
    elif kind == RALLY:
        if item.command != mav.MAV_CMD_NAV_RALLY_POINT:
            return None, mav.MAV_MISSION_UNSUPPORTED
    elif item.command not in NAV_COMMANDS and item.command not in DO_COMMANDS:
        return None, mav.MAV_MISSION_UNSUPPORTED
    if kind != MISSION or item.command in _LOCATION:
        if item.frame not in _FRAMES:
            return None, mav.MAV_MISSION_UNSUPPORTED_FRAME
        if abs(item.x) > 900_000_000:
            return None, mav.MAV_MISSION_INVALID_PARAM5_X
        if abs(item.y) > 1_800_000_000:
            return None, mav.MAV_MISSION_INVALID_PARAM6_Y
    p2, p3, p4 = (v if math.isfinite(v) else 0.0 for v in (item.p2, item.p3, item.p4))
    p1 = item.p1
    if kind == MISSION and item.command == mav.MAV_CMD_NAV_WAYPOINT:
        # Rover keeps the hold time only, as a 16 bit number; the acceptance radius is WP_RADIUS for all
        p1, p2, p3, p4 = float(max(-32768, min(32767, int(p1)))), 0.0, 0.0, 0.0
    frame = _FRAMES.get(item.frame, item.frame)
    if kind == MISSION and (item.command not in _LOCATION or item.command == mav.MAV_CMD_NAV_RETURN_TO_LAUNCH):
        frame = 0  # what has no place comes back without a frame
    if kind == MISSION and item.command == mav.MAV_CMD_NAV_LOITER_TIME:
        p3 = -1.0 if p3 < 0.0 else 1.0  # the sense of turning is all that is kept
    if kind == FENCE:
        frame, p2, p3, p4 = 0, 0.0, 0.0, 0.0
    return item._replace(p1=p1, p2=p2, p3=p3, p4=p4, frame=frame, z=round(item.z * 100.0) / 100.0), 0


def to_file(item: Item, seq: int, kind: int) -> bytes:
    """Return the item as MAVFTP's mission files hold it."""
    return FILE_ITEM.pack(
        item.p1, item.p2, item.p3, item.p4, item.x, item.y, item.z, seq, item.command, 0, 0, item.frame, 0, 1, kind
    )


def from_file(data: bytes, offset: int) -> Item:
    """Return the item at ``offset``."""
    p1, p2, p3, p4, x, y, z, _seq, command, _s, _c, frame, _cur, _auto, _kind = FILE_ITEM.unpack_from(data, offset)
    return Item(command, frame, p1, p2, p3, p4, x, y, z)
