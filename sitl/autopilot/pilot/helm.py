"""The modes of the boat, and the mission carried out in AUTO."""

from __future__ import annotations

import math
from collections.abc import Callable

from pymavlink.dialects.v20 import ardupilotmega as mav

from companion.messages import Mode
from sitl.autopilot.boat import kernel as k
from sitl.autopilot.pilot.core import KNOWN, NAVIGATING, Core, MissionTask
from sitl.autopilot.pilot.fence import FenceMonitor
from sitl.autopilot.pilot.mission import NAMES, Item, RunState, StoredMission, is_reported
from sitl.autopilot.pilot.storage import Rally

GUIDED_TIMEOUT_S = 3.0
AUX_TACK, AUX_MOTOR = 63, 74


class ModeController:
    """Owner of the mode. ``mode_changed`` is called as soon as the mode is another one."""

    def __init__(self, core: Core, fence: FenceMonitor, rally: Rally, mode_changed: Callable[[], None]) -> None:
        self._core = core
        self._vehicle = core.vehicle
        self._voice = core.voice
        self._fence = fence
        self._rally = rally
        self._mode_changed = mode_changed
        self.mission = StoredMission(self)
        self.mode = Mode.MANUAL
        self.refused: Mode | None = None  # it cannot be entered now
        self.task = MissionTask.HOLD
        self._is_waiting = False  # AUTO was entered before there was an origin
        self._is_reached = False
        self._corner_passed = False
        self._hold_until_s = -1.0
        self._is_arrival_told = False
        self._told_home = False
        self._setpoint_s = 0.0
        self._has_limits = False
        core.vehicle.sticks_at_rest()

    # ------------------------------------------------------------------------------------------- modes
    def set_mode(self, number: int) -> bool:
        """Change mode; False, with the reason announced, when it is refused."""
        if number not in KNOWN:
            self._voice.announce(mav.MAV_SEVERITY_WARNING, f"No such mode {number}")
            return False
        mode = Mode(number)
        if mode is self.mode:
            return True
        if mode is self.refused:
            self._voice.announce(mav.MAV_SEVERITY_WARNING, "Flight mode change failed")
            return False
        if mode is Mode.AUTO and self.mission.total == 0:
            self._voice.announce(mav.MAV_SEVERITY_NOTICE, "No Mission. Can't set AUTO.")
            self._voice.announce(mav.MAV_SEVERITY_WARNING, "Flight mode change failed")
            return False
        if mode in {Mode.RTL, Mode.SMART_RTL} and self._core.home_en is None:
            self._voice.announce(mav.MAV_SEVERITY_WARNING, "Flight mode change failed")
            return False
        if self.mode is Mode.AUTO:
            self.mission.stop()
        self._vehicle.clear_tack()
        self.mode = mode
        self._has_limits = self._has_limits or mode in NAVIGATING
        self._mode_changed()
        self._is_waiting = False
        self._corner_passed = False
        if mode is Mode.AUTO:
            self._is_waiting = True
            self.update()
        elif mode in {Mode.RTL, Mode.SMART_RTL}:
            self.sail_home()
        elif mode in {Mode.LOITER, Mode.GUIDED}:
            self.loiter()
        elif mode is Mode.MANUAL:
            self._manual()
        else:
            self._hold()
        return True

    def set_current(self, index: int, *, resets: bool) -> bool:
        """Make an item current, with DO_SET_MISSION_CURRENT's reset or without; False if there is none.

        A reset outside AUTO runs the mission without sailing it, and reckons its first leg at once: before the
        navigation has its limits that is an internal error.
        """
        mission, is_outside = self.mission, resets and self.mode is not Mode.AUTO
        if is_outside:
            mission.stop()
            mission.reset()
        if not mission.set_current(index, run=resets and not is_outside):
            return False
        if is_outside and mission.nav_item is not None:
            mission.state = RunState.RUNNING
            name = NAMES.get(mission.nav_item.command, "Cmd")
            self._voice.announce_after_ack(mav.MAV_SEVERITY_INFO, f"Mission: {mission.nav_index} {name}")
            if not self._has_limits:
                self._core.err_internally()
        return True

    def armed(self) -> None:
        """The boat was armed: a leg that waited starts here."""
        if self.mode is Mode.AUTO and self.task is MissionTask.LEG and self.mission.state is RunState.RUNNING:
            self._corner_passed = False
            self._vehicle.leave_from_here()

    def _hold(self) -> None:
        self.task = MissionTask.HOLD
        self._vehicle.hold()

    def _manual(self) -> None:
        self.task = MissionTask.HOLD
        self._vehicle.sticks_at_rest()

    def loiter(self) -> None:
        """Loiter where the boat could stop."""
        self.task = MissionTask.LOITER
        self._vehicle.loiter()

    def sail_home(self) -> None:
        """Sail to home or the nearest rally point."""
        goal = self._rally.refuge()
        if goal is None:
            self._hold()
            return
        self.task = MissionTask.RTL
        self._is_reached = self._told_home = False
        self._vehicle.sail_leg(self._vehicle.position, goal, None, is_corner=False, goes_on=False)

    # ------------------------------------------------------------------------------------------ guided
    def go_to(self, goal: tuple[float, float]) -> None:
        """GUIDED: sail to a position; no time-out."""
        self.task = MissionTask.GUIDED
        self._is_reached = False
        self._vehicle.sail_leg(self._vehicle.position, goal, None, is_corner=False, goes_on=False)

    def steer(self, heading_rad: float, thrust: float) -> None:
        """GUIDED: hold a heading; to be sent again within three seconds."""
        self.task = MissionTask.SETPOINT
        self._setpoint_s = self._core.t_s
        self._vehicle.steer_heading(heading_rad, thrust)

    def turn(self, rate_radps: float, thrust: float) -> None:
        """GUIDED: turn at a rate; to be sent again within three seconds."""
        self.task = MissionTask.SETPOINT
        self._setpoint_s = self._core.t_s
        self._vehicle.steer_rate(rate_radps, thrust)

    # ------------------------------------------------------------------------------------------- loops
    @property
    def due_s(self) -> float:
        """When ``update`` has something to do though nothing happened."""
        if self.mode is Mode.GUIDED and self.task is MissionTask.SETPOINT:
            return self._setpoint_s + GUIDED_TIMEOUT_S
        if self.mode is Mode.AUTO:
            if self._is_waiting:
                return self._core.t_s + 0.5
            if self._hold_until_s > self._core.t_s:
                return self._hold_until_s
            if self.mission.state is RunState.RUNNING and (
                (self.task is MissionTask.LEG and self._is_reached) or self.mission.is_changed
            ):
                return self._core.t_s
        return math.inf

    def happened(self, events: int) -> None:
        """Take the events of the compiled loop."""
        if events & k.TACKED:
            self._voice.announce(mav.MAV_SEVERITY_INFO, "Sailboat: Tacking")
        if events & k.TACK_TIMED_OUT:
            self._voice.announce(mav.MAV_SEVERITY_INFO, "Sailboat: Tacking timed out")
        if events & k.REACHED:
            self._is_reached = True

    def update(self) -> None:
        """One loop of the mode."""
        if self.mode is Mode.AUTO:
            if self._is_waiting and self._core.has_origin:
                self._is_waiting = False
                self.mission.is_changed = False
                self.mission.start_or_resume(restart=self._core.parameters.flag("MIS_RESTART") == 1)
            if self.mission.is_changed and not self._is_waiting:
                self.mission.is_changed = False
                if self.mission.state is RunState.RUNNING and self.task is MissionTask.LEG:
                    self._corner_passed = False
                    done = self.mission.restart_current()
                    what = "restarted command" if done else "but failed to restart command"
                    comma = "," if done else ""
                    self._voice.announce(mav.MAV_SEVERITY_CRITICAL, f"Auto mission changed{comma} {what}")
            self.mission.update()
        elif self.mode is Mode.GUIDED:
            if self.task is MissionTask.SETPOINT and self._core.t_s - self._setpoint_s >= GUIDED_TIMEOUT_S - 1e-9:
                self._voice.announce(mav.MAV_SEVERITY_WARNING, "target not received last 3secs, stopping")
                self.loiter()
            elif self.task is MissionTask.GUIDED and self._is_reached:
                self._voice.broadcast(mav.MAVLink_mission_item_reached_message(0))
                self.loiter()
        if self.task is MissionTask.RTL and self._is_reached and not self._told_home:
            self._told_home = True
            self._voice.announce(mav.MAV_SEVERITY_INFO, "Reached destination")
            self._vehicle.loiter()

    # ----------------------------------------------------------------------------------- mission's crew
    def start_nav(self, index: int, item: Item) -> bool:
        """Begin a navigation command."""
        self._voice.announce(mav.MAV_SEVERITY_INFO, f"Mission: {index} {NAMES.get(item.command, 'Cmd')}")
        passed, self._corner_passed = self._corner_passed, False
        self._hold_until_s = -1.0
        self._is_arrival_told = False
        self._is_reached = False
        if item.command == mav.MAV_CMD_NAV_RETURN_TO_LAUNCH:
            self.sail_home()
            return True
        if item.command == mav.MAV_CMD_NAV_DELAY:
            self._hold_until_s = self._core.t_s + max(0.0, item.p1)
            self._voice.announce(mav.MAV_SEVERITY_INFO, f"Delaying {int(item.p1)} sec")
            self.loiter()
            return True
        if item.command in {mav.MAV_CMD_NAV_GUIDED_ENABLE, mav.MAV_CMD_NAV_SET_YAW_SPEED}:
            return True
        goal = self._place(item)
        following = self.mission.following(index)
        is_corner = (
            item.command == mav.MAV_CMD_NAV_WAYPOINT
            and item.p1 <= 0.0
            and following is not None
            and NAMES.get(following.command) in {"WP", "LoitUnlim", "LoitTime", "LoitTurns"}
        )
        origin = self._vehicle.destination if passed else self._vehicle.position
        self._vehicle.sail_leg(
            origin,
            goal,
            self._place(following) if is_corner and following is not None else None,
            is_corner=is_corner,
            goes_on=passed,
        )
        self.task = MissionTask.LEG
        return True

    def _place(self, item: Item) -> tuple[float, float]:
        return self._core.chart.to_en(item.x, item.y) if item.x or item.y else self._vehicle.position

    def verify_nav(self, index: int, item: Item) -> bool:
        """Return whether a navigation command is done."""
        if item.command in {mav.MAV_CMD_NAV_GUIDED_ENABLE, mav.MAV_CMD_NAV_SET_YAW_SPEED}:
            self._report(index)
            return True
        if item.command == mav.MAV_CMD_NAV_DELAY:
            if self._core.t_s < self._hold_until_s - 1e-9:
                return False
            self._report(index)
            return True
        if item.command == mav.MAV_CMD_NAV_RETURN_TO_LAUNCH:
            if not self._is_reached:
                return False
            self._report(index)
            return True
        if not self._is_reached:
            return False
        if not self._is_arrival_told:
            self._is_arrival_told = True
            stay_s = item.p1 if item.command in {mav.MAV_CMD_NAV_WAYPOINT, mav.MAV_CMD_NAV_LOITER_TIME} else 0.0
            # the message of completion comes first on the wire, the text after it
            more = f". Loiter for {int(stay_s)} seconds" if stay_s > 0.0 else ""
            self._hold_until_s = self._core.t_s + max(0.0, stay_s)
            if stay_s <= 0.0 and item.command != mav.MAV_CMD_NAV_LOITER_UNLIM:
                self._report(index)
            self._voice.announce(mav.MAV_SEVERITY_INFO, f"Reached waypoint #{index}{more}")
            if stay_s > 0.0 or item.command == mav.MAV_CMD_NAV_LOITER_UNLIM:
                self._vehicle.loiter()
        if item.command == mav.MAV_CMD_NAV_LOITER_UNLIM or self._core.t_s < self._hold_until_s - 1e-9:
            return False
        if self._hold_until_s > 0.0 and item.p1 > 0.0 and item.command != mav.MAV_CMD_NAV_LOITER_TURNS:
            self._report(index)
            if item.command == mav.MAV_CMD_NAV_LOITER_TIME:
                self._voice.announce(mav.MAV_SEVERITY_WARNING, "Finished active loiter")
        self._corner_passed = self._vehicle.state[k.S_STEER] == k.STEER_LEG
        return True

    def _report(self, index: int) -> None:
        # one message a loop: that of a DO command which is done at once takes the place of the waypoint before it
        items = self.mission.items
        if index + 1 < len(items) and is_reported(items[index + 1]):
            return
        self._voice.broadcast(mav.MAVLink_mission_item_reached_message(index))

    def do(self, index: int, item: Item) -> None:
        """Carry out a DO command."""
        self._voice.announce(mav.MAV_SEVERITY_INFO, f"Mission: {index} {NAMES.get(item.command, 'Cmd')}")
        if item.command == mav.MAV_CMD_DO_FENCE_ENABLE:
            self._fence.switch(enabled=item.p1 == 1.0)
        elif item.command == mav.MAV_CMD_DO_SET_HOME:
            self._core.set_home(None if item.p1 == 1.0 else self._core.chart.to_en(item.x, item.y))
        elif item.command == mav.MAV_CMD_DO_AUX_FUNCTION and int(item.p1) == AUX_TACK:
            self._vehicle.ask_tack()
        if is_reported(item):
            self._report(index)

    def mission_complete(self) -> None:
        """The last item is done."""
        self._voice.announce(mav.MAV_SEVERITY_NOTICE, "Mission Complete")
        behaviour = self._core.parameters.flag("MIS_DONE_BEHAVE")
        if behaviour == 1:
            self.loiter()
        elif behaviour == 3:
            self.set_mode(Mode.MANUAL)
        else:
            self._hold()
