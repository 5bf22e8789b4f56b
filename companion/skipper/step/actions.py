"""What the skipper asks of the application. Each answer comes back in a later snapshot under the same id."""

from __future__ import annotations

import enum
from dataclasses import dataclass

from companion.messages import MissionItem, Mode, Severity
from companion.orders import Result
from companion.planner import Problem
from companion.planners import AUTO, PlannerChoice


class ReplanReason(enum.Enum):
    """Why a plan was asked for."""

    START = "start"
    WAYPOINT = "waypoint"  # Wolsieffer: at each waypoint, from the next one
    FORECAST = "forecast"  # the forecast has changed enough to matter
    WIND_SHIFT = "wind_shift"  # Büsser: 20 deg
    CURRENT = "current"  # the current has changed against the plan's
    PLAN_AGE = "plan_age"  # Büsser: 60 minutes
    OFF_LEG = "off_leg"  # Büsser: off the leg by more than the grid size
    NO_GO = "no_go"  # the present wind makes the leg unsailable
    NEXT_GOAL = "next_goal"
    MISSED_BUOY = "missed_buoy"
    NO_PROGRESS = "no_progress"
    OPERATOR_BACK = "operator_back"
    OBSTACLE = "obstacle"  # the area or the traffic changed
    REFUGE = "refuge"  # the battery is critical, or the voyage out of time
    HOME = "home"  # all goals are reached, or the autopilot wants the boat home
    REST = "rest"  # dragged off the place where the boat loiters
    ORDER = "order"  # somebody asked for it
    TACK_FAILED = "tack_failed"
    IN_IRONS = "in_irons"  # it has come out of irons
    RETRY = "retry"  # a step of the ladder after nothing was found
    MISMATCH = "mismatch"  # the mission on the autopilot is not the one that was uploaded

    @property
    def words(self) -> str:
        """Return it as it is said."""
        return self.value.replace("_", " ")


@dataclass(frozen=True, slots=True, kw_only=True)
class RequestPlan:
    """Plan ``problem`` within ``budget_s``; answered by PlanOutcome.

    ``from_seq`` is the mission item that the plan starts at: its result replaces the items after it; None when
    the plan starts at the boat and replaces the present target too. ``rung`` names the step of the ladder.
    """

    request_id: int
    problem: Problem
    reason: ReplanReason
    budget_s: float
    seed: int
    from_seq: int | None
    planner: PlannerChoice = AUTO
    rung: str = ""
    text: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class CancelPlan:
    """Forget a request: its answer is no longer wanted."""

    request_id: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Change:
    """What a new route is to the one before: how far apart they look, and the vessel that made the old one unsafe.

    ``apart_m`` is the Fréchet distance of the next five minutes of both (``companion.traffic.path_distance_m``), None
    without an old route; ``unsafe`` is empty when the old route met nobody.
    """

    apart_m: float | None = None
    unsafe: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class UploadMission:
    """Put ``items`` (without home; items[0] has seq 1) on the autopilot; answered by UploadOutcome.

    The first ``keep_first`` items are those of the mission there now: a partial write may begin after them.
    Write, read back, compare (up to the first item that ends a mission: an old tail behind it is dead), and only
    then, if ``set_current`` is given, DO_SET_MISSION_CURRENT(set_current, p2=1). OK means all of that.

    ``stopgap`` stands behind the kept items while the rest is written item by item, so that no mixture of two missions
    is ever on board: a loiter at a waypoint of the old one. None: nothing is there yet that could be mixed.
    """

    upload_id: int
    items: tuple[MissionItem, ...]
    keep_first: int
    set_current: int | None
    plan_id: int
    stopgap: MissionItem | None = None
    text: str = ""
    change: Change = Change()


@dataclass(frozen=True, slots=True, kw_only=True)
class UploadFence:
    """Put the fence on the autopilot; answered by UploadOutcome."""

    upload_id: int
    items: tuple[MissionItem, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class ReadMission:
    """Read the mission from the autopilot; answered by ReadOutcome, and in Snapshot.mission."""

    read_id: int
    text: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class SetMode:
    """Ask for a mode; answered by CommandOutcome."""

    command_id: int
    mode: Mode
    text: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Arm:
    """Ask for arming; answered by CommandOutcome."""

    command_id: int


@dataclass(frozen=True, slots=True, kw_only=True)
class SetCurrent:
    """DO_SET_MISSION_CURRENT(seq, p2 = 1 if reset); answered by CommandOutcome."""

    command_id: int
    seq: int
    reset: bool = True


@dataclass(frozen=True, slots=True, kw_only=True)
class SetParameter:
    """Write a parameter of the autopilot; answered by CommandOutcome."""

    command_id: int
    name: str
    value: float
    text: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Tack:
    """Ask for a tack on a leg that the autopilot beats; answered by CommandOutcome."""

    command_id: int
    text: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class RunMotor:
    """Run the auxiliary motor, or leave it to the autopilot's own judgement again; answered by CommandOutcome."""

    command_id: int
    is_on: bool
    text: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class SteerHeading:
    """A GUIDED heading setpoint [rad, true]; repeated every step, since it times out after 3 s. Not answered.

    ``thrust`` below 1 eases the sail.
    """

    heading_rad: float
    thrust: float = 1.0
    text: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Announce:
    """Say ``text`` (STATUSTEXT, decision record). ``code`` names the rule or watchdog that speaks."""

    severity: Severity
    code: str
    text: str


@dataclass(frozen=True, slots=True, kw_only=True)
class StopOrders:
    """Give up every order under way or waiting: the autopilot may not be ours. Each is answered as failed."""

    text: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Acknowledge:
    """Answer an order to who gave it: ``command`` with ``result``, to ``system`` and ``component``.

    ``way`` is how the order came; the sentence is announced beside it.
    """

    way: str
    system: int
    component: int
    command: int
    result: Result
    text: str


@dataclass(frozen=True, slots=True, kw_only=True)
class AdoptDrawing:
    """End this voyage and begin the one that is drawn on board. Not answered: it ends, or why not is announced."""

    text: str


Action = (
    RequestPlan
    | CancelPlan
    | UploadMission
    | UploadFence
    | ReadMission
    | SetMode
    | Arm
    | SetCurrent
    | SetParameter
    | Tack
    | RunMotor
    | SteerHeading
    | Announce
    | Acknowledge
    | StopOrders
    | AdoptDrawing
)
