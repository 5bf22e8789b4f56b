"""AP_Mission: the stored mission, which command is current, and what a change of it does while sailing."""

from __future__ import annotations

import enum
from typing import Protocol

from pymavlink.dialects.v20 import ardupilotmega as mav

from sitl.autopilot.pilot.items import NAV_COMMANDS, REPORTED_DO, Item

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


class Mission:
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
            jumping = item.command == mav.MAV_CMD_DO_JUMP and (
                item.p2 < 0 or self._jumps.get(index, 0) < item.p2
            )
            index = max(1, int(item.p1)) if jumping else index + 1
        return None

    def _complete(self) -> None:
        self.state = RunState.COMPLETE
        self.is_loaded = False
        self._crew.mission_complete()


def is_reported(item: Item) -> bool:
    """Return whether a DO command is announced as reached."""
    return item.command in REPORTED_DO
