"""What the autopilot keeps through a reboot (mission, fence, rally points), and how an upload changes it."""

from __future__ import annotations

import math

from pymavlink.dialects.v20 import ardupilotmega as mav

from sitl.autopilot.pilot.core import Core
from sitl.autopilot.pilot.fence import FenceMonitor
from sitl.autopilot.pilot.mission import FENCE, MISSION, Item, StoredMission


class Rally:
    """The stored rally points."""

    def __init__(self, core: Core) -> None:
        self._core = core
        self.items: list[Item] = []

    def refuge(self) -> tuple[float, float] | None:
        """Return home or the nearest rally point within RALLY_LIMIT_KM."""
        core, here = self._core, self._core.vehicle.position
        limit_m = core.parameters.get("RALLY_LIMIT_KM") * 1000.0
        points = [core.chart.to_en(i.x, i.y) for i in self.items]
        points = [p for p in points if limit_m <= 0.0 or math.dist(p, here) <= limit_m]
        if core.home_en is not None and (not points or core.parameters.flag("RALLY_INCL_HOME")):
            points.append(core.home_en)
        return min(points, key=lambda p: math.dist(p, here), default=None)


_OK, _ERROR = int(mav.MAV_MISSION_ACCEPTED), int(mav.MAV_MISSION_ERROR)


class Storage:
    """The three lists, as the mission protocol and MAVFTP see them."""

    def __init__(self, core: Core, mission: StoredMission, fence: FenceMonitor, rally: Rally) -> None:
        self._core = core
        self.mission = mission
        self.fence = fence
        self.rally = rally
        self._staged: list[Item] = []

    def read_list(self, kind: int) -> list[Item]:
        """Return a stored list; item 0 of a mission is home as it is now."""
        if kind == FENCE:
            return self.fence.items
        if kind != MISSION:
            return self.rally.items
        if not self.mission.items:
            return []
        home_en = self._core.home_en
        lat, lon = self._core.chart.to_e7(home_en) if home_en is not None else (0, 0)
        return [Item(mav.MAV_CMD_NAV_WAYPOINT, 0, x=lat, y=lon), *self.mission.items[1:]]

    def begin_list(self, kind: int, count: int) -> None:
        """An upload begins: a mission is cut to the new length at once, other lists are kept until the end."""
        self._staged = []
        if kind == MISSION:
            self.mission.truncate(count)

    def write_item(self, kind: int, index: int, item: Item) -> None:
        """Store an item of an upload."""
        if kind == MISSION:
            self.mission.put(index, item)
        else:
            self._staged.append(item)

    def end_list(self, kind: int) -> int:
        """An upload is over: return MAV_MISSION_RESULT."""
        core = self._core
        staged, self._staged = self._staged, []
        if kind == FENCE:
            if not self.fence.load(staged):
                core.voice.announce(mav.MAV_SEVERITY_INFO, "Incorrect item count")
                core.voice.announce(mav.MAV_SEVERITY_WARNING, "Fence validation failed")
                return _ERROR
            core.parameters.put("FENCE_TOTAL", float(len(staged) + 2 if staged else 0))
            core.voice.announce_after_ack(mav.MAV_SEVERITY_DEBUG, "Fence Indexed OK")
        elif kind == MISSION:
            core.parameters.put("MIS_TOTAL", float(len(self.mission.items)))
        else:
            self.rally.items = staged
            core.parameters.put("RALLY_TOTAL", float(len(staged)))
        return _OK

    def clear_list(self, kind: int) -> bool:
        """Empty a list; a running mission is not cleared while armed."""
        if kind == MISSION:
            if not self._core.is_armed:
                self.mission.stop()
            if not self.mission.clear():
                return False
            self._core.parameters.put("MIS_TOTAL", 0.0)
            return True
        self._staged = []
        self.end_list(kind)
        return True

    def replace_list(self, kind: int, new: list[Item]) -> bool:
        """Put a whole fence or rally list in place of the old."""
        self._staged = new
        return self.end_list(kind) == _OK

    def restore(self, old: Storage) -> None:
        """After a reboot: what was stored is there again."""
        self.mission.items = list(old.mission.items)
        self.fence.load(old.fence.items)
        self.rally.items = old.rally.items
