"""AP_Mission: the stored mission, which command is current, and what a change of it does while sailing."""

from __future__ import annotations

import enum
import math
import struct
from typing import Any, NamedTuple, Protocol

from pymavlink.dialects.v20 import ardupilotmega as mav

MISSION, FENCE, RALLY = 0, 1, 2
# (16384 - 4) / 15 bytes of storage less what else lives there; boards with 32 kB hold 1312
MAX_MISSION = 655
MAX_FENCE = 84
MAX_RALLY = 50

NAV_COMMANDS = frozenset(
    {
        mav.MAV_CMD_NAV_WAYPOINT,
        mav.MAV_CMD_NAV_LOITER_UNLIM,
        mav.MAV_CMD_NAV_LOITER_TURNS,
        mav.MAV_CMD_NAV_LOITER_TIME,
        mav.MAV_CMD_NAV_RETURN_TO_LAUNCH,
        mav.MAV_CMD_NAV_GUIDED_ENABLE,
        mav.MAV_CMD_NAV_DELAY,
        mav.MAV_CMD_NAV_SET_YAW_SPEED,
    }
)
DO_COMMANDS = frozenset(
    {
        mav.MAV_CMD_CONDITION_DELAY,
        mav.MAV_CMD_CONDITION_DISTANCE,
        mav.MAV_CMD_DO_JUMP,
        mav.MAV_CMD_DO_CHANGE_SPEED,
        mav.MAV_CMD_DO_SET_HOME,
        mav.MAV_CMD_DO_AUX_FUNCTION,
        mav.MAV_CMD_DO_GUIDED_LIMITS,
        mav.MAV_CMD_DO_FENCE_ENABLE,
        mav.MAV_CMD_DO_SET_RELAY,
        mav.MAV_CMD_DO_SET_SERVO,
        mav.MAV_CMD_DO_SET_REVERSE,
        mav.MAV_CMD_DO_SET_ROI,
        mav.MAV_CMD_JUMP_TAG,
        mav.MAV_CMD_DO_JUMP_TAG,
        mav.MAV_CMD_DO_SEND_BANNER,
        mav.MAV_CMD_DO_SET_RESUME_REPEAT_DIST,
    }
)
# DO commands that the vehicle verifies, and therefore reports as reached.
REPORTED_DO = frozenset(
    {
        mav.MAV_CMD_DO_CHANGE_SPEED,
        mav.MAV_CMD_DO_SET_HOME,
        mav.MAV_CMD_DO_FENCE_ENABLE,
        mav.MAV_CMD_DO_GUIDED_LIMITS,
        mav.MAV_CMD_DO_SET_REVERSE,
        mav.MAV_CMD_DO_SET_ROI,
    }
)
NAMES = {
    mav.MAV_CMD_NAV_WAYPOINT: "WP",
    mav.MAV_CMD_NAV_LOITER_UNLIM: "LoitUnlim",
    mav.MAV_CMD_NAV_LOITER_TURNS: "LoitTurns",
    mav.MAV_CMD_NAV_LOITER_TIME: "LoitTime",
    mav.MAV_CMD_NAV_RETURN_TO_LAUNCH: "RTL",
    mav.MAV_CMD_NAV_GUIDED_ENABLE: "NavGuidedEnable",
    mav.MAV_CMD_DO_CHANGE_SPEED: "ChangeSpeed",
    mav.MAV_CMD_DO_SET_HOME: "SetHome",
    mav.MAV_CMD_DO_FENCE_ENABLE: "FenceEnable",
    mav.MAV_CMD_DO_AUX_FUNCTION: "AuxFunction",
    mav.MAV_CMD_NAV_DELAY: "Delay",
    mav.MAV_CMD_NAV_SET_YAW_SPEED: "NavSetYawSpeed",
}
_LOCATION = frozenset(
    {
        mav.MAV_CMD_NAV_WAYPOINT,
        mav.MAV_CMD_NAV_LOITER_UNLIM,
        mav.MAV_CMD_NAV_LOITER_TURNS,
        mav.MAV_CMD_NAV_LOITER_TIME,
        mav.MAV_CMD_NAV_RETURN_TO_LAUNCH,
        mav.MAV_CMD_DO_SET_HOME,
    }
)
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


_MAX_JUMPS_IN_A_ROW = 100


class RunState(enum.Enum):
    """Stopped (not in AUTO, or not yet), running, complete."""

    STOPPED = 2
    RUNNING = 3
    COMPLETE = 5


class Crew(Protocol):
    """Who carries the commands out."""

    def start_nav(self, index: int, item: Item) -> bool:
        """Begin a navigation command; False if it cannot be."""

    def verify_nav(self, index: int, item: Item) -> bool:
        """Return whether it is done."""

    def do(self, index: int, item: Item) -> None:
        """Carry out a DO command."""

    def mission_complete(self) -> None:
        """Nothing is left."""


class StoredMission:
    """The list (item 0 stands for home) and the index that moves through it."""

    def __init__(self, crew: Crew) -> None:
        self._crew = crew
        self.items: list[Item] = []
        self.state = RunState.STOPPED
        self.nav_index: int | None = None
        self.nav_item: Item | None = None
        self.is_loaded = False
        self.is_changed = False
        self._jumps: dict[int, int] = {}

    # ------------------------------------------------------------------------------------------- list
    def put(self, index: int, item: Item) -> None:
        """Write an item over another or behind the last."""
        if index < len(self.items):
            self.items[index] = item
        else:
            self.items.append(item)
        self.is_changed = True

    def truncate(self, count: int) -> None:
        """Cut the list; the command under way stays in memory."""
        if count < len(self.items):
            del self.items[count:]
            self.is_changed = True

    def clear(self) -> bool:
        """Empty the list; refused while it runs."""
        if self.state is RunState.RUNNING:
            return False
        self.items.clear()
        self.reset()
        self.is_changed = True
        return True

    @property
    def total(self) -> int:
        """Items without home, as MISSION_CURRENT counts them."""
        return max(0, len(self.items) - 1)

    @property
    def current_seq(self) -> int:
        """Index of the current navigation command, 0 when there is none."""
        return self.nav_index or 0

    @property
    def mav_state(self) -> int:
        """MISSION_STATE for MISSION_CURRENT."""
        return mav.MISSION_STATE_NO_MISSION if len(self.items) <= 1 else self.state.value

    # ------------------------------------------------------------------------------------------ running
    def start(self) -> None:
        """Run from the first item."""
        self.state = RunState.RUNNING
        self.reset()
        if not self._advance(1):
            self._complete()

    def stop(self) -> None:
        """Leave the index where it is."""
        if self.state is RunState.RUNNING:
            self.state = RunState.STOPPED

    def start_or_resume(self, *, restart: bool) -> None:
        """Entering AUTO: from the beginning, or from the command that was current."""
        if restart or self.state is RunState.COMPLETE or self.nav_index is None:
            self.start()
            return
        self.state = RunState.RUNNING
        self.is_loaded = False
        if self.nav_index >= len(self.items) or not self._advance(self.nav_index):
            self._complete()

    def reset(self) -> None:
        """Forget the index and the counts of jumps."""
        self.nav_index, self.nav_item, self.is_loaded = None, None, False
        self._jumps.clear()

    def set_current(self, index: int, *, run: bool = False) -> bool:
        """Go to an item; False if there is none.

        A complete mission only becomes stopped, and a stopped one stays so, unless ``run``: a reset in AUTO.
        """
        if index >= len(self.items) or len(self.items) <= 1:
            return False
        if run:
            self.reset()
            self.state = RunState.RUNNING
        if index == 0 or self.state is RunState.COMPLETE:
            self._jumps.clear()
        index = max(index, 1)
        self.is_loaded = False
        if self.state is not RunState.RUNNING:
            found = self._next_nav(index)
            self.state = RunState.STOPPED
            if found is None:
                self.nav_index = None
                return False
            self.nav_index, self.nav_item = found, self.items[found]
            return True
        if not self._advance(index):
            self._complete()
            return False
        return True

    def restart_current(self) -> bool:
        """Begin the current command again, as the list has it now."""
        if self.nav_index is None or self.nav_index >= len(self.items):
            return False
        item = self.items[self.nav_index]
        if item.command not in NAV_COMMANDS:
            return False
        self.nav_item = item
        return self._crew.start_nav(self.nav_index, item)

    def update(self) -> None:
        """One loop of a running mission."""
        if self.state is not RunState.RUNNING:
            return
        if not self.is_loaded or self.nav_index is None or self.nav_item is None:
            if not self._advance((self.nav_index or 0) + 1):
                self._complete()
            return
        if self._crew.verify_nav(self.nav_index, self.nav_item):
            self.is_loaded = False
            if not self._advance(self.nav_index + 1):
                self._complete()

    def following(self, index: int) -> Item | None:
        """Return the navigation command after ``index``, without counting jumps."""
        found = self._next_nav(index + 1)
        return None if found is None else self.items[found]

    def _advance(self, index: int) -> bool:
        jumps = 0
        while index < len(self.items):
            item = self.items[index]
            if item.command == mav.MAV_CMD_DO_JUMP:
                jumps += 1
                if jumps > _MAX_JUMPS_IN_A_ROW:
                    return False
                done = self._jumps.get(index, 0)
                if item.p2 < 0 or done < item.p2:
                    self._jumps[index] = done + 1
                    index = max(1, int(item.p1))
                else:
                    index += 1
            elif item.command in NAV_COMMANDS:
                self.nav_index, self.nav_item = index, item
                self.is_loaded = True
                return self._crew.start_nav(index, item) or self._advance(index + 1)
            else:
                # DO commands between two navigation commands run when the second begins
                self._crew.do(index, item)
                index += 1
        return False

    def _next_nav(self, index: int) -> int | None:
        for _ in range(_MAX_JUMPS_IN_A_ROW + len(self.items)):
            if index >= len(self.items):
                return None
            item = self.items[index]
            if item.command in NAV_COMMANDS:
                return index
            jumping = item.command == mav.MAV_CMD_DO_JUMP and (item.p2 < 0 or self._jumps.get(index, 0) < item.p2)
            index = max(1, int(item.p1)) if jumping else index + 1
        return None

    def _complete(self) -> None:
        self.state = RunState.COMPLETE
        self.is_loaded = False
        self._crew.mission_complete()


def is_reported(item: Item) -> bool:
    """Return whether a DO command is announced as reached."""
    return item.command in REPORTED_DO
