"""What the skipper remembers from step to step; what of it survives a restart is in ``saved``."""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass, field, replace
from typing import Any

from companion.field.guidance import LastResort
from companion.field.station import StationState
from companion.field.values import GuidanceState
from companion.messages import MissionItem, Mode
from companion.orders import Answer, Order, Verb
from companion.skipper.step.actions import ReplanReason
from companion.skipper.step.route import Route
from companion.skipper.step.saved import Persisted, SavedPlace
from companion.skipper.step.standing import Standing
from companion.skipper.step.tacking import NO_TACKS, Tacking
from companion.skipper.way.gates import Approach
from companion.skipper.way.integrity import PositionDoubt
from companion.skipper.way.voyage import PointEn
from companion.traffic import Assessment
from companion.traffic.encounters import Held


class Phase(enum.Enum):
    """Büsser's states (Figure 3.1) and those that a voyage with an autopilot adds."""

    IDLE = "idle"                                  # nothing to sail yet
    WAITING = "waiting"                            # for position, EKF, wind, arming or permission
    STANDARD = "standard"                          # Büsser 3.2.1
    NEW_CALCULATION = "new calculation"            # 3.2.2: no valid plan until the planner answers
    DESTINATION_APPROACH = "destination approach"  # 3.2.3: the last waypoint is the target
    BUOY_APPROACH = "buoy approach"                # 3.2.4
    LAST_RESORT = "last resort"                    # a vessel too near to plan for: steered by field
    HOLDING = "holding"                            # nothing found or something wrong: in a safe item, waiting
    OPERATOR = "operator"                          # somebody else has the boat
    DONE = "done"


@dataclass(frozen=True, slots=True, kw_only=True)
class PendingPlan:
    """A plan asked for and not yet answered."""

    request_id: int
    t_s: float
    reason: ReplanReason
    from_index: int | None             # route index that the plan starts at; None: the boat
    rung: int
    gate: int                          # the gate that the plan's end completes, -1 when none
    lead_in: tuple[PointEn, ...]       # waypoints before the plan's start (a repaired start)
    start_en_m: PointEn
    facts: Route                       # figures of the plan to be, without items
    problem: Any


@dataclass(frozen=True, slots=True, kw_only=True)
class PendingUpload:
    """An upload asked for and not yet answered: the route that it brings."""

    upload_id: int
    t_s: float
    route: Route
    set_current: int | None
    keep_first: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Fix:
    """A position, and when."""

    t_s: float
    en_m: PointEn


@dataclass(frozen=True, slots=True, kw_only=True)
class Raised:
    """A raised watchdog: since when, and since when its exit condition has held."""

    name: str
    since_s: float
    clear_since_s: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Retry:
    """Patience with something that failed: how often in a row, and when it may be tried again."""

    failures: int = 0
    not_before_s: float = float("-inf")


PATIENT = Retry()


@dataclass(frozen=True, slots=True, kw_only=True)
class Stop:
    """She was being sailed and no longer is: since when, what she was put into, and by what (``causes``).

    ``before_s`` is when she was last seen being sailed: the change of mode is between the two.
    """

    t_s: float
    before_s: float
    mode: Mode | None
    is_armed: bool
    cause: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Signs:
    """What tells a failsafe from a person: when each cause last showed, and when the sticks or the switch moved."""

    seen_s: tuple[tuple[str, float], ...] = ()
    standing: tuple[str, ...] = ()        # signs that are up now
    breaches: int | None = None           # of the fence, as last counted
    rc_us: tuple[int, ...] = ()           # of the channels that a person moves, as they last rested
    rc_moved_s: float = float("-inf")
    helm: tuple[Mode | None, bool] | None = None   # mode and arming as last heard, and when
    helm_s: float = float("-inf")


@dataclass(frozen=True, slots=True, kw_only=True)
class Adrift:
    """How the boat moves over ground, and what was done to stop a drift (``companion.skipper.deeds.adrift``)."""

    ground_en_mps: tuple[float, float] | None = None   # mean velocity of the last seconds
    ground_t_s: float = float("-inf")
    places: tuple[Fix, ...] = ()       # of the last minute, of a boat that hardly moves
    since_s: float | None = None       # since when a drift onto something is being stopped
    loitered: bool = False             # LOITER has shown in this calm: it is not asked for again
    loiter_en_m: PointEn | None = None # where it began
    motor: bool = False                # the autopilot has accepted to run it


@dataclass(frozen=True, slots=True, kw_only=True)
class ByField:
    """Steering by field: the memory of the guidance and of the station keeper, and the last resort's."""

    resort: LastResort = field(default_factory=LastResort)
    clear_s: float | None = None          # since when the water is clear
    seen_guided: bool = False             # GUIDED has shown since the field took over
    not_before_s: float = float("-inf")   # somebody set AUTO in the middle of it: not again before
    guidance: GuidanceState = field(default_factory=GuidanceState)
    station: StationState = field(default_factory=StationState)
    station_since_s: float | None = None
    composed: bool = False                # a goal's own field steers, or did until a plan from here is in place
    left_s: float | None = None           # since when the latter
    way_out_rad: float | None = None      # the way out of some water that is being taken
    weak_since_s: float | None = None     # since when the field says nothing of where to go
    strong_since_s: float | None = None   # ... and, given up for that, does again
    lost: str = ""                        # why it is given up, in words


@dataclass(frozen=True, slots=True, kw_only=True)
class Inside:
    """Since when she is in the box of a goal, or sails by its field, and by the autopilot's clock (None: not known)."""

    goal: int
    t_s: float
    utc_s: float | None = None

    def age_s(self, t_s: float, utc_s: float | None) -> float:
        """Return how long ago that was [s]; over a restart only the clock can tell."""
        return t_s - self.t_s if utc_s is None or self.utc_s is None else utc_s - self.utc_s


@dataclass(frozen=True, slots=True, kw_only=True)
class Answered:
    """An order and its answer, and when."""

    order: Order
    answer: Answer
    t_s: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Charge:
    """The battery's share when its fall began, and the last that was told.

    ``is_short``: it has not covered the way to where she can wait, since then; on that way it covers it again.
    """

    since_s: float
    first: float
    last: float
    is_short: bool = False


@dataclass(frozen=True, kw_only=True)
class SkipperState:
    """Everything that ``step`` needs from before. ``Skipper.initial`` makes the first.

    Without slots: it changes a dozen times a step, and ``companion.frozen`` copies it in one piece.
    """

    phase: Phase = Phase.IDLE
    why: str = "just started"
    next_id: int = 1
    gate: int = 0                      # index of the gate being sailed to
    route: Route | None = None         # what is on the autopilot, as far as we know
    adoptable: Persisted | None = None  # from before a restart or a foreign mission, until one of ours is found
    known: tuple[str, ...] = ()        # hashes of lists that earlier voyages of ours may have left on board
    uid: str | None = None             # of the autopilot that this voyage began with, and ...
    system: int | None = None          # ... its system id
    is_ours: bool = False              # in this step: it is that one, and a boat of ours
    custody: str = ""                  # why it was not, until it is
    checked_mission: bool = False      # the mission on board has been compared with ours since link, reboot, operator
    read_twice: bool = False           # the last mission read was not ours: the next one decides
    foreign: str = ""                  # why the mission on board is not ours; empty: it is, or there is none
    sailing: bool = False              # has been in AUTO and armed with our route
    index: int = 0                     # target by the autopilot
    own_index: int = 0                 # target by Büsser's double conditions
    pending_plan: PendingPlan | None = None
    pending_upload: PendingUpload | None = None
    pending_read: tuple[int, float] | None = None          # id, since
    pending_command: tuple[int, float, str] | None = None  # id, since, what
    unsure_route: Route | None = None  # of an upload that failed: the mission on board may be it or a mixture
    accepted: tuple[str, float] | None = None  # the last command that was accepted, and when
    ready_route: Route | None = None   # planned, not allowed or not yet possible to upload
    own_mode: Mode | None = None       # a mode other than AUTO that we asked for ourselves
    rung: int = 0                      # step of the ladder being tried
    unanswered: int = 0                # requests in a row that the planner did not answer
    effort: float = 1.0                # share of the planning budget that is asked for: less on a slow processor
    ladder_reason: ReplanReason | None = None
    plan_retry: Retry = PATIENT
    upload_retry: Retry = PATIENT
    read_retry: Retry = PATIENT
    command_retry: Retry = PATIENT
    read_since_s: float = float("-inf")   # a mission read before this does not count
    asked_seq: int | None = None   # the item we made current, until the autopilot shows it
    current_asked_s: float = float("-inf")  # when an item was last made current by us
    last_plan_s: float = float("-inf")  # when a plan was last asked for
    replanned_index: int = -1           # the target for which Wolsieffer's replan was asked
    replans: int = 0
    closest_m: float = float("inf")     # smallest distance to the present gate so far
    uploaded_s: float = float("-inf")   # when the last upload ended well
    good_wind_since_s: float | None = None
    no_go_since_s: float | None = None
    tacked_s: float = float("-inf")     # when a tack was last asked for
    standing: Standing | None = None    # the order that stands until she is told to go on
    answered: tuple[Answered, ...] = ()  # the last order of each who gave one lately
    asked: str = ""                     # why a new plan is wanted at once, until it is asked for; empty: it is not
    skipped: int = 0                    # goals given up by order
    read_items: tuple[MissionItem, ...] | None = None      # the mission as last read
    read_t_s: float = float("-inf")
    approaches: tuple[Approach, ...] = ()   # where the way to a goal began, see companion.skipper.way.gates
    bearing_rad: float = 0.0            # how far the boat has come round the buoy that is next, see gates.bearing_on
    is_blind: bool = False              # the voyage was taken up again: what she passed meanwhile was not seen
    released: int = -1                  # the goal at whose line she no longer waits for the gun, or in whose box
    searched: tuple[PointEn, ...] = ()  # the track of the search that is next
    covered: tuple[tuple[int, float], ...] = ()   # goals searched, and the share that was seen
    task: str = ""                      # how far she is with it, in words
    inside: Inside | None = None        # the box that she stays in
    set_sail_utc_s: float | None = None  # Unix time of setting sail, by the autopilot's clock
    missed_s: float | None = None       # when a gate was missed to which no upload since leads
    history_plan: int = -1
    history: tuple[tuple[float, float, float, float], ...] = ()  # t, east, north, distance to go: once per 10 s
    last_seen: Fix | None = None        # the last position
    boot_s: float | None = None
    doubt: PositionDoubt | None = None  # the position is not believed (``deeds.doubt``)
    back_s: float = float("-inf")      # when it was believed again: this step's jump is none
    lost_s: float | None = None        # since when the autopilot's filter has had no position
    given_back_s: float = float("-inf")  # when a person last gave her back
    disputed_s: float | None = None    # since when two receivers have said different things
    anew: Mode | None = None           # a LOITER whose point jumped with the position is begun anew: what shows next
    place: SavedPlace | None = None    # where she is believed or reckoned to be, for who comes after a kill
    restored: SavedPlace | None = None  # where she was before this start, until the first fix is held against it
    signs: Signs = Signs()
    battery_critical: bool = False     # by the autopilot's own limit (BATT_CRT_VOLT, BATT_CRT_MAH)
    charge: Charge | None = None
    stop: Stop | None = None           # she is not being sailed though she was
    answering: str = ""                # the cause whose stop we have ended or are ending; empty: none
    sent_home: bool = False            # ... which put her into RTL
    after_operator: bool = False       # AUTO has come back: plan from where the boat is now
    under_way_s: float = 0.0           # how long the voyage has been under way ...
    last_step_s: float = float("-inf")  # ... counted from step to step
    home_reached: bool = False         # the way home that follows the last goal is sailed
    over: str = ""                     # why the voyage is over: what is left is to watch her loiter; empty: it is not
    arrived: bool = False              # ... with all goals reached, and home where the mission ends there
    rest_en_m: PointEn | None = None   # where she loiters since
    replace_foreign: bool = False      # permission was given to overwrite what is on board
    repair: bool = False               # the mission on board is a mixture of ours
    rebooted: bool = False             # in this very step
    operator_since_s: float | None = None
    passed_since_s: float | None = None   # the target was passed by our own geometry, the autopilot still steers for it
    raised: tuple[Raised, ...] = ()
    entering: tuple[tuple[str, float], ...] = ()   # watchdogs whose entry condition holds, since when
    steering_until_s: float | None = None          # bearing away in GUIDED until
    steering_heading_rad: float | None = None
    by_field: ByField = ByField()
    adrift: Adrift = Adrift()
    water_told_en_mps: tuple[float, float] | None = None  # the current that was said last; None: still water
    irons_s: tuple[float, ...] = ()                # when the boat was in irons
    tacking: Tacking = NO_TACKS                    # what her tacks have told
    watch: tuple[Assessment, ...] = ()             # vessels in view, the worst first
    watch_told: tuple[tuple[int, int, float], ...] = ()   # MMSI and branch of those said lately, when
    encounters: tuple[Held, ...] = ()              # with vessels, under the policy "rules"
    encounters_told: tuple[tuple[int, int, str, float], ...] = ()   # MMSI, branch, what, when
    announced: tuple[tuple[str, float], ...] = ()  # code, last said
    reached: tuple[int, ...] = ()                  # goals reached, in order
    missed: int = 0                                # buoys passed on the wrong side and sailed again
    wants: tuple[str, ...] = ()                    # what is missing, in words


def is_given_up(state: SkipperState) -> bool:
    """Return whether the boat was given up by order: nothing is asked of her."""
    return state.standing is not None and state.standing.verb is Verb.STOP


def standing_saved(state: SkipperState) -> Standing | None:
    """Return the order that stands as it is saved: its age in whole minutes."""
    order = state.standing
    if order is None:
        return None
    return replace(order, since_s=None, before_s=60.0 * (order.age_s(state.last_step_s) // 60.0))


def saved_of(state: SkipperState, voyage: str) -> Persisted:
    """Return what of a state survives a kill."""
    return Persisted(
        voyage=voyage, gate=state.gate, sailing=state.sailing, route=state.route,
        pending=state.pending_upload.route if state.pending_upload is not None else None,
        unsure=state.unsure_route, own_mode=state.own_mode, motor=state.adrift.motor,
        under_way_s=60.0 * (state.under_way_s // 60.0), arrived=state.arrived, uid=state.uid, system=state.system,
        approaches=state.approaches, quarters=round(state.bearing_rad / (0.5 * math.pi)),
        standing=standing_saved(state), skipped=state.skipped, set_sail_utc_s=state.set_sail_utc_s,
        inside=None if state.inside is None or state.inside.utc_s is None else (state.inside.goal, state.inside.utc_s),
        searched=state.searched[:-1], covered=state.covered,   # the last point moves with her
        tacks=(state.tacking.tried, state.tacking.failed), place=state.place,
    )
