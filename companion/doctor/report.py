"""What is examined, what it is held against, and the findings: values, and the report that they gather in."""

from __future__ import annotations

import enum
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from companion.boat import Hull
from companion.mavlink.microservices import lookup
from companion.messages import MissionItem


class Level(enum.IntEnum):
    """How bad it is."""

    INFO = 0  # good to know
    WARNING = 1  # may spoil a voyage
    ERROR = 2  # will


@dataclass(frozen=True, slots=True, kw_only=True)
class DoctorFinding:
    """One finding: what is, why it matters, and what to set (``wanted`` None: nothing that a parameter can do)."""

    level: Level
    code: str
    what: str
    why: str
    parameter: str | None = None
    value: float | None = None
    wanted: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Needs:
    """What the voyage needs of the autopilot; the defaults are those of a mission that says nothing."""

    no_go_half_rad: float = math.radians(45.0)  # the boat's, as the plans use it
    margin_m: float = 15.0
    margin_floor_m: float = 8.0
    goal_radius_m: float = 5.0
    loiter_radius_m: float = 15.0
    speed_mps: float = 3.0
    hull: Hull = field(default_factory=Hull)
    reach_m: float = 0.0  # farthest place of the voyage from home
    has_fence: bool = False  # the mission wants its fence on the autopilot
    has_refuge: bool = False  # the mission names a place for a critical battery
    sails: bool = True  # False: a motor boat
    can_tack: bool = True  # False: it gybes round, and no corridor of tacks is of use
    least_depth_m: float | None = None  # that a sounder may tell: her keel and the room under it; None: not watched


@dataclass(frozen=True, slots=True, kw_only=True)
class Examined:
    """What was read from the autopilot; a part that could not be read is None."""

    parameters: Mapping[str, float]
    version: tuple[int, int, int] | None = None
    mission: Sequence[MissionItem] | None = None
    fence: Sequence[MissionItem] | None = None
    rates_hz: Mapping[str, float] | None = None
    system_id: int | None = None  # of its heartbeats
    uid: str | None = None  # of its board, "" when it tells none
    is_signed: bool = False  # its frames carry signatures
    has_key: bool = False  # ours do too
    planner_speed: float | None = None  # of this computer, as a share of the reference core


class Report:
    """The findings so far, about the parameters that were read."""

    def __init__(self, parameters: Mapping[str, float]) -> None:
        self.parameters = parameters
        self.findings: list[DoctorFinding] = []

    def get(self, name: str) -> float | None:
        """Return a parameter under any of its names, None when it was not answered."""
        return lookup(self.parameters, name)

    def add(
        self, level: Level, code: str, what: str, why: str, *, name: str | None = None, wanted: float | None = None
    ) -> None:
        """Add a finding, about parameter ``name`` if one is given."""
        value = self.get(name) if name is not None else None
        self.findings.append(
            DoctorFinding(level=level, code=code, what=what, why=why, parameter=name, value=value, wanted=wanted)
        )

    def expect(self, level: Level, name: str, wanted: float, why: str) -> None:
        """Add a finding if a parameter was answered and is not as wanted."""
        value = self.get(name)
        if value is not None and value != wanted:
            self.add(level, name.lower(), f"{name} is {value:g}", why, name=name, wanted=wanted)
