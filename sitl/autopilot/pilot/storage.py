"""What the autopilot keeps through a reboot (mission, fence, rally points), and how an upload changes it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pymavlink.dialects.v20 import ardupilotmega as mav

from sitl.autopilot.pilot.items import FENCE, MISSION, Item

if TYPE_CHECKING:
    from sitl.autopilot.autopilot import Autopilot

_OK, _ERROR = int(mav.MAV_MISSION_ACCEPTED), int(mav.MAV_MISSION_ERROR)


class Storage:
    """The three lists, as the mission protocol and MAVFTP see them."""

    def __init__(self, autopilot: Autopilot) -> None:
        self._a = autopilot
        self.rally: list[Item] = []
        self._staged: list[Item] = []

    # ------------------------------------------------------------------------------------- as Lists wants it
    def read_list(self, kind: int) -> list[Item]:
        """Return a stored list; item 0 of a mission is home as it is now."""
        a = self._a
        if kind == FENCE:
            return a.fence.items
        if kind != MISSION:
            return self.rally
        mission = a.helm.mission.items
        if not mission:
            return []
        lat, lon = a.chart.to_e7(a.home_en) if a.home_en is not None else (0, 0)
        return [Item(mav.MAV_CMD_NAV_WAYPOINT, 0, x=lat, y=lon), *mission[1:]]

    def begin_list(self, kind: int, count: int) -> None:
        """An upload begins: a mission is cut to the new length at once, other lists are kept until the end."""
        self._staged = []
        if kind == MISSION:
            self._a.helm.mission.truncate(count)

    def write_item(self, kind: int, index: int, item: Item) -> None:
        """Store an item of an upload."""
        if kind == MISSION:
            self._a.helm.mission.put(index, item)
        else:
            self._staged.append(item)

    def end_list(self, kind: int) -> int:
        """An upload is over: return MAV_MISSION_RESULT."""
        a = self._a
        staged, self._staged = self._staged, []
        if kind == FENCE:
            if not a.fence.load(staged, a.chart.to_en):
                a.announce(mav.MAV_SEVERITY_INFO, "Incorrect item count")
                a.announce(mav.MAV_SEVERITY_WARNING, "Fence validation failed")
                return _ERROR
            a.parameters.put("FENCE_TOTAL", float(len(staged) + 2 if staged else 0))
            a.announce_after_ack(mav.MAV_SEVERITY_DEBUG, "Fence Indexed OK")
        elif kind == MISSION:
            a.parameters.put("MIS_TOTAL", float(len(a.helm.mission.items)))
        else:
            self.rally = staged
            a.parameters.put("RALLY_TOTAL", float(len(staged)))
        return _OK

    def clear_list(self, kind: int) -> bool:
        """Empty a list; a running mission is not cleared while armed."""
        mission = self._a.helm.mission
        if kind == MISSION:
            if not self._a.is_armed:
                mission.stop()
            if not mission.clear():
                return False
            self._a.parameters.put("MIS_TOTAL", 0.0)
            return True
        self._staged = []
        self.end_list(kind)
        return True

    def reply(self, message: Any, link: int) -> None:
        """Send on one port."""
        self._a.ports.reply(message, link)

    def announce(self, severity: int, text: str) -> None:
        """STATUSTEXT on every port."""
        self._a.announce(severity, text)

    # ---------------------------------------------------------------------------------------------- others
    def replace_list(self, kind: int, new: list[Item]) -> bool:
        """Put a whole fence or rally list in place of the old."""
        self._staged = new
        return self.end_list(kind) == _OK

    def restore(self, old: Storage, mission: list[Item], fence: list[Item]) -> None:
        """After a reboot: what was stored is there again."""
        self.rally = old.rally
        self._a.helm.mission.items = mission
        self._a.fence.load(fence, self._a.chart.to_en)
