"""The route that is sailed, point by point, what was promised of it, and the diversion that takes a goal's place."""

from __future__ import annotations

import enum
from collections.abc import Sequence
from dataclasses import dataclass, replace

from companion.messages import MissionItem
from companion.skipper.way.voyage import PointEn

HOME_RADIUS_M = 15.0  # home is where the boat was armed: a place in the water or at its edge, not a mark


@dataclass(frozen=True, slots=True, kw_only=True)
class Route:
    """The mission that sails: its items and what each is for. Index i has seq i + 1.

    ``points_en_m[i]`` is where item i is (for the safe end: where it ends), ``leg_from_en_m[i]`` where the planned
    leg to it begins, ``gate_of[i]`` the gate (see ``companion.skipper.way.gates``) that reaching it completes, or -1.
    """

    items: tuple[MissionItem, ...] = ()
    points_en_m: tuple[PointEn, ...] = ()
    leg_from_en_m: tuple[PointEn, ...] = ()
    gate_of: tuple[int, ...] = ()
    plan_id: int
    plan_t_s: float  # when the plan was asked for
    plan_twd_from_rad: float  # mean wind that the plan used
    plan_tws_mps: float
    plan_half_width_rad: float  # half width of the forecast's interval at config.wind_change_level
    margin_m: float
    delta_s: float
    rung: str = ""  # the step of the ladder it was found on; empty: as configured
    risk: float | None = None  # of the whole path, wind and vessels
    plan_current_east_mps: float = 0.0  # the current that the plan reckons with
    plan_current_north_mps: float = 0.0
    vessel_risk: float = 0.0  # the vessels' part of it
    vessels_part: float = 0.0  # of 1 - delta_s, at each instant, the vessels' part
    expected_clearance_m: float | None = None  # of the hull on the predicted track, the prediction's error taken off
    planned_clearance_m: float | None = None  # the plan's, while the way from her start has less
    cost_s: float | None = None
    median_s: float | None = None  # when half the winds of the forecast's spread are there ...
    late_s: float | None = None  # ... and nine of ten; None: not told, or not in any time
    why: str = ""
    bound_for: str = ""  # the diversion that its end serves; empty: the goals

    @property
    def bound_at(self) -> int | None:
        """The item at which she is where she is bound for; None: she is bound for the goals."""
        return len(self.items) - 2 if self.bound_for and len(self.items) > 1 else None  # behind it: the loiter

    def is_for_goals(self, index: int) -> bool:
        """Return whether what is left from item ``index`` on leads to a goal, even where more is planned behind it."""
        return not self.bound_for or any(gate >= 0 for gate in self.gate_of[index:])

    def is_planned_from(self, index: int) -> bool:
        """Return whether a plan is asked for from item ``index`` on before the boat is there.

        Not where what follows it is there already: the last waypoint of a plan, and the way to the gate after next.
        """
        last = len(self.items) - 2
        return index < last and all(gate < 0 for gate in self.gate_of[index:last])

    def clearance_ahead_m(self, index: int) -> float | None:
        """Return ``expected_clearance_m`` where item ``index`` is under way; None in the loiter that ends it."""
        return self.expected_clearance_m if index < len(self.items) - 1 else None

    def led_aside(
        self, keep: int, from_en_m: PointEn, way: Sequence[tuple[MissionItem, PointEn]], *, rung: str, why: str
    ) -> Route:
        """Return the route that keeps ``keep`` items and goes on by a way that no plan is behind, to its safe end.

        Nothing that was promised of the old way is promised of this one: neither time nor risk nor clearance.
        """
        points = [point for _, point in way]
        return replace(
            self,
            items=(*self.items[:keep], *(item for item, _ in way)),
            points_en_m=(*self.points_en_m[:keep], *points),
            leg_from_en_m=(*self.leg_from_en_m[:keep], from_en_m, *points[:-1]),
            gate_of=(*self.gate_of[:keep], *(-1 for _ in way)),
            rung=rung,
            risk=None,
            vessel_risk=0.0,
            expected_clearance_m=None,
            planned_clearance_m=None,
            cost_s=None,
            median_s=None,
            late_s=None,
            bound_for="",
            why=why,
        )


class DiversionKind(enum.Enum):
    """What kind of diversion."""

    REFUGE = "refuge"
    HOME = "home"
    REST = "rest"  # back to where the boat loitered
    GOAL = "goal"  # a place that somebody named
    INSIDE = "inside"  # back into the autopilot's own fence
    START = "start"  # before a start line, until the gun
    ROOM = "room"  # where a loiter has room
    BOX = "box"  # water to stay in
    STATION = "station"  # the last goal, where a mission asks to stay
    FIELD = "field"  # where the boat waits while a goal's field cannot be sailed
    STAY = "stay"  # where there is room near by


@dataclass(frozen=True, slots=True, kw_only=True)
class Diversion:
    """Where to, and why. ``name`` is what a route is bound for; a STAY has no place."""

    kind: DiversionKind
    name: str
    why: str
    en_m: PointEn = (0.0, 0.0)
    radius_m: float = HOME_RADIUS_M
    is_ordered: bool = False  # it lasts until it is told to go on
    until: str = ""  # what it lasts for, where that is known

    @property
    def has_place(self) -> bool:
        """Whether there is a place to plan for."""
        return self.kind is not DiversionKind.STAY

    @property
    def sentence(self) -> str:
        """Where to and why."""
        return f"{'staying near by' if self.kind is DiversionKind.STAY else f'to {self.name}'}: {self.why}"
