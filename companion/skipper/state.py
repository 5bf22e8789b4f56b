"""What the skipper remembers from step to step, and what of it survives a restart."""

from __future__ import annotations

import enum
from dataclasses import dataclass, field
from typing import Any

from companion.messages import MissionItem, Mode
from companion.skipper.actions import ReplanReason
from companion.skipper.voyage import PointEn


class Phase(enum.Enum):
    """Büsser's states (Figure 3.1) and those that a voyage with an autopilot adds."""

    IDLE = "idle"                                  # nothing to sail yet
    WAITING = "waiting"                            # for position, EKF, wind, arming or permission
    STANDARD = "standard"                          # Büsser 3.2.1
    NEW_CALCULATION = "new calculation"            # 3.2.2: no valid plan until the planner answers
    DESTINATION_APPROACH = "destination approach"  # 3.2.3: the last waypoint is the target
    BUOY_APPROACH = "buoy approach"                # 3.2.4
    HOLDING = "holding"                            # nothing found or something wrong: in a safe item, waiting
    OPERATOR = "operator"                          # somebody else has the boat
    DONE = "done"


@dataclass(frozen=True, slots=True, kw_only=True)
class Route:
    """The mission that sails: its items and what each is for. Index i has seq i + 1.

    ``points_en_m[i]`` is where item i is (for the safe end: where it ends); ``goal_of[i]`` the index into
    ``Voyage.legs`` that reaching item i completes, -1 when none. ``origin_en_m`` is where the leg to item 0 began.
    """

    items: tuple[MissionItem, ...]
    points_en_m: tuple[PointEn, ...]
    goal_of: tuple[int, ...]
    origin_en_m: PointEn
    plan_id: int
    plan_t_s: float                    # when the plan was asked for
    plan_twd_from_rad: float           # mean wind that the plan used
    plan_half_width_rad: float         # half width of the forecast interval at config.wind_change_level
    margin_m: float
    delta_s: float
    risk: float | None = None
    why: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class PendingPlan:
    """A plan asked for and not yet answered."""

    request_id: int
    t_s: float
    reason: ReplanReason
    from_seq: int | None
    rung: int
    problem: Any


@dataclass(frozen=True, slots=True, kw_only=True)
class PendingUpload:
    """An upload asked for and not yet answered: the route that it would bring."""

    upload_id: int
    t_s: float
    route: Route
    set_current: int | None
    keep_first: int


@dataclass(frozen=True, slots=True, kw_only=True)
class WatchdogState:
    """One raised watchdog: since when, and since when its exit condition holds."""

    name: str
    since_s: float
    clear_since_s: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class SkipperState:
    """Everything that ``step`` needs from before. ``initial(...)`` makes the first."""

    phase: Phase = Phase.IDLE
    why: str = "just started"
    next_id: int = 1
    goal_index: int = 0                # into Voyage.legs: the goal being sailed to
    route: Route | None = None         # what is on the autopilot, as far as we know
    pending_plan: PendingPlan | None = None
    pending_upload: PendingUpload | None = None
    expected_mode: Mode | None = None  # the mode we asked for last
    raised: tuple[WatchdogState, ...] = field(default=())


@dataclass(frozen=True, slots=True, kw_only=True)
class Persisted:
    """What survives a kill: written whenever it changes, before the action that it allows."""

    voyage: str
    goal_index: int
    route: Route | None
    pending: PendingUpload | None

    def to_dict(self) -> dict[str, Any]:
        """Return plain JSON values."""
        raise NotImplementedError

    @classmethod
    def from_dict(cls, data: dict[str, Any]) -> Persisted:
        """Read ``to_dict``'s result; ValueError when it cannot be believed."""
        raise NotImplementedError
