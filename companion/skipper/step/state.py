"""What the skipper remembers from step to step; what of it survives a restart is in ``saved``."""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass, field, replace

from companion.boat import Afloat
from companion.field.guidance import LastResort
from companion.field.station import StationState
from companion.field.values import GuidanceState
from companion.frozen import changed
from companion.geo.shift import Shift, carried
from companion.messages import MissionItem, Mode
from companion.orders import Answer, Order, Verb
from companion.planner import Problem
from companion.skipper.step.actions import ReplanReason
from companion.skipper.step.latency import NO_ANSWERS, PlannerLatency
from companion.skipper.step.route import Route
from companion.skipper.step.saved import Persisted, SavedPlace, Standing
from companion.skipper.way import Approach, PointEn
from companion.skipper.way.position_plausibility import PositionDoubt
from companion.skipper.way.shoals import Shoal
from companion.traffic import Assessment
from companion.traffic.colregs import OngoingEncounter

PRIOR_TACKS = 5.0  # so many of the voyage's own say as much as the mission


# --------------------
# What the voyage's own tacks tell: how many were tried, how many failed, and the chance that the next one does.
# The mission's chance counts as ``PRIOR_TACKS`` tacks that were seen: a Beta distribution, to which each tack adds. Its
# mean is the probability that the next tack fails.


@dataclass(frozen=True, slots=True, kw_only=True)
class Tacking:
    """Tacks seen, and the one that is under way.

    Attributes:
        tried, failed: of this voyage.
        in_a_row: failures since the last that came off.
        failed_s: when the last failed.
        side: of the wind when the boat was last settled on a tack: 1 starboard, -1 port, 0 never.
        settled_rad: its heading then, and ``settled_s`` when.
        settled_mps: its speed then.
        slowest_mps: the least since the tack that is being tried began.
        began_s: since when a tack is being tried, None: none is.
        is_counted: that one was counted as failed: it lies in irons.
        began_en_m: where it was then, None: not known.
        irons_s: the longest that it has lain.
        starboard_lee_mps, port_lee_mps: the fastest that it was set then, abeam to the lee of that tack, beside the
            current that is believed.

    """

    tried: int = 0
    failed: int = 0
    in_a_row: int = 0
    failed_s: float = -math.inf
    side: int = 0
    settled_rad: float = 0.0
    settled_s: float = -math.inf
    settled_mps: float = 0.0
    slowest_mps: float = math.inf
    began_s: float | None = None
    is_counted: bool = False
    began_en_m: tuple[float, float] | None = None
    irons_s: float = 0.0
    starboard_lee_mps: float = 0.0
    port_lee_mps: float = 0.0

    def chance(self, given: float) -> float:
        """Return the chance that the next tack fails; ``given`` is the mission's, and 0 asks for none."""
        return 0.0 if given <= 0.0 else (given * PRIOR_TACKS + self.failed) / (PRIOR_TACKS + self.tried)

    def spread(self, given: float) -> float:
        """Return the standard deviation of that chance."""
        mean = self.chance(given)
        return math.sqrt(mean * (1.0 - mean) / (PRIOR_TACKS + self.tried + 1.0))


NO_TACKS = Tacking()
NOTHING_LEARNED = Afloat()


class Phase(enum.Enum):
    """Büsser's states (Figure 3.1) and those that a voyage with an autopilot adds."""

    IDLE = "idle"  # nothing to sail yet
    WAITING = "waiting"  # for position, EKF, wind, arming or permission
    STANDARD = "standard"  # Büsser 3.2.1
    NEW_CALCULATION = "new calculation"  # 3.2.2: no valid plan until the planner answers
    DESTINATION_APPROACH = "destination approach"  # 3.2.3: the last waypoint is the target
    BUOY_APPROACH = "buoy approach"  # 3.2.4
    LAST_RESORT = "last resort"  # a vessel too near to plan for: steered by field
    HOLDING = "holding"  # nothing found or something wrong: in a safe item, waiting
    OPERATOR = "operator"  # somebody else has the boat
    DONE = "done"


@dataclass(frozen=True, slots=True, kw_only=True)
class PendingPlan:
    """A plan asked for and not yet answered."""

    request_id: int
    t_s: float
    reason: ReplanReason
    from_index: int | None  # route index that the plan starts at; None: the boat
    rung: int
    gate: int  # the gate that the plan's end completes, -1 when none
    lead_in: tuple[PointEn, ...]  # waypoints before the plan's start (a repaired start)
    start_en_m: PointEn
    facts: Route  # figures of the plan to be, without items
    problem: Problem


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
    """A position, and when; and how fast the boat was there [m/s, east north]."""

    t_s: float
    en_m: PointEn
    velocity_en_mps: PointEn = (0.0, 0.0)


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
    """The boat was being sailed and no longer is: since when, what it was put into, and by what (``FAILSAFES``).

    ``before_s`` is when it was last seen being sailed: the change of mode is between the two.
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
    standing: tuple[str, ...] = ()  # signs that are up now
    breaches: int | None = None  # of the fence, as last counted
    rc_us: tuple[int, ...] = ()  # of the channels that a person moves, as they last rested
    rc_moved_s: float = float("-inf")
    helm: tuple[Mode | None, bool] | None = None  # mode and arming as last heard, and when
    helm_s: float = float("-inf")


@dataclass(frozen=True, slots=True, kw_only=True)
class Adrift:
    """How the boat moves over ground, and what was done to stop a drift (``companion.skipper.behaviors.drifting``)."""

    ground_en_mps: tuple[float, float] | None = None  # mean velocity of the last seconds
    bow_mps: tuple[float, float] | None = None  # the same to starboard and ahead, as seen from the bow at each time
    ground_t_s: float = float("-inf")
    places: tuple[Fix, ...] = ()  # of the last minute, of a boat that hardly moves
    since_s: float | None = None  # since when a drift onto something is being stopped
    loitered: bool = False  # LOITER has shown in this calm: it is not asked for again
    loiter_en_m: PointEn | None = None  # where it began ...
    loiter_s: float = float("inf")  # ... and when, of a wind that is doubted
    motor: bool = False  # the autopilot has accepted to run it
    looked_s: float = float("-inf")  # when sea room was looked for last
    nearest_m: float = float("inf")  # to the loiter that ends the mission on board she has been ...
    nearest_s: float = float("-inf")  # ... which came on board then


@dataclass(frozen=True, slots=True, kw_only=True)
class VaneTrim:
    """What was written of the vane's offset (``companion.skipper.behaviors.vane_trim``)."""

    stuck_s: float | None = None  # since when the boat does not sail, and its vane is surely turned
    trims: int = 0
    trimmed_s: float = float("-inf")
    written_deg: float | None = None  # the last
    first_rad: float | None = None  # what it was before the first


@dataclass(frozen=True, slots=True, kw_only=True)
class Sounded:
    """A place on the boat's own track, and what was sounded there; None: nothing was."""

    en_m: PointEn
    depth_m: float | None


@dataclass(frozen=True, slots=True, kw_only=True)
class Soundings:
    """What the sounder told of the water (``companion.skipper.behaviors.shoaling``)."""

    track: tuple[Sounded, ...] = ()  # the last of it, some metres apart
    shoals: tuple[Shoal, ...] = ()  # found on this voyage; they survive a restart
    found_s: float = float("-inf")  # when the last of them was found ahead
    turned_en_m: PointEn | None = None  # where she turned back, until a plan is asked for ...
    turned_s: float = float("-inf")  # ... and when


@dataclass(frozen=True, slots=True, kw_only=True)
class FieldSteering:
    """Steering by field: the memory of the guidance and of the station keeper, and the last resort's."""

    resort: LastResort = field(default_factory=LastResort)
    clear_s: float | None = None  # since when the water is clear
    seen_guided: bool = False  # GUIDED has shown since the field took over
    not_before_s: float = float("-inf")  # somebody set AUTO in the middle of it: not again before
    guidance: GuidanceState = field(default_factory=GuidanceState)
    station: StationState = field(default_factory=StationState)
    composed: bool = False  # a goal's own field steers, or did until a plan from here is in place
    left_s: float | None = None  # since when the latter
    way_out_rad: float | None = None  # the way out of some water that is being taken
    weak_since_s: float | None = None  # since when the field says nothing of where to go
    strong_since_s: float | None = None  # ... and, given up for that, does again
    lost: str = ""  # why it is given up, in words
    let_go_s: float = float("-inf")  # when it let go of a boat that was at rest, off her place


@dataclass(frozen=True, slots=True, kw_only=True)
class Fallback:
    """A goal that is sailed to by plan in AUTO, for the mission's own guidance comes to nothing on the way there."""

    gate: int = -1  # the gate that it is for, -1: none
    goal: int = -1  # whose gate that is: it lasts to the last of them
    since_s: float = float("-inf")  # when it was asked for
    sails: bool = False  # a plan asked for since then is in place, and AUTO sails it
    why: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Since:
    """When something began, and by the autopilot's clock (None: not known)."""

    t_s: float
    utc_s: float | None = None

    def age_s(self, t_s: float, utc_s: float | None) -> float:
        """Return how long ago that was [s]; over a restart only the clock can tell."""
        return t_s - self.t_s if utc_s is None or self.utc_s is None else utc_s - self.utc_s


@dataclass(frozen=True, slots=True, kw_only=True)
class Inside(Since):
    """Since when the boat is in a goal's box, or sails by its field."""

    goal: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Answered:
    """An order and its answer, and when."""

    order: Order
    answer: Answer
    t_s: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Charge:
    """The battery's share when its fall began, and the last that was told.

    ``is_short``: it has not covered the way to where it can wait, since then; on that way it covers it again.
    """

    since_s: float
    first: float
    last: float
    is_short: bool = False


# The parts have no slots: one of them changes a dozen times a step, and ``companion.frozen`` copies it in one piece.
@dataclass(frozen=True, kw_only=True)
class VehicleIdentity:
    """Whose the autopilot is (``companion.skipper.board.vehicle_identity``), and whether it has started anew."""

    uid: str | None = None  # of the autopilot that this voyage began with, and ...
    system: int | None = None  # ... its system id
    is_ours: bool = False  # in this step: it is that one, and a boat of ours
    doubt: str = ""  # why it was not, until it is
    boot_s: float | None = None  # its time since boot, as last heard [s]
    rebooted: bool = False  # in this very step


@dataclass(frozen=True, kw_only=True)
class LoadedMission:
    """The mission on the autopilot: which it is, as far as we know, and how far the boat is on it."""

    route: Route | None = None
    adoptable: Persisted | None = None  # from before a restart or a foreign mission, until one of ours is found
    known: tuple[str, ...] = ()  # hashes of lists that earlier voyages of ours may have left on board
    checked: bool = False  # compared with ours since link, reboot, operator
    read_twice: bool = False  # the last mission read was not ours: the next one decides
    foreign: str = ""  # why it is not ours; empty: it is, or there is none
    unsure_route: Route | None = None  # of an upload that failed: the mission on board may be it or a mixture
    read_since_s: float = float("-inf")  # a mission read before this does not count
    read_items: tuple[MissionItem, ...] | None = None  # as last read
    read_t_s: float = float("-inf")
    replace_foreign: bool = False  # permission was given to overwrite what is on board
    repair: bool = False  # it is a mixture of ours
    uploaded_s: float = float("-inf")  # when the last upload ended well
    index: int = 0  # target by the autopilot
    own_index: int = 0  # target by Büsser's double conditions
    passed_since_s: float | None = None  # the target was passed by our own geometry, the autopilot still steers for it
    asked_seq: int | None = None  # the item we made current, until the autopilot shows it
    asked_s: float = float("-inf")  # when an item was last made current by us


@dataclass(frozen=True, kw_only=True)
class GoalProgress:
    """How far the boat is with the voyage's goals."""

    gate: int = 0  # index of the gate being sailed to
    approaches: tuple[Approach, ...] = ()  # where the way to a goal began, see companion.skipper.way.gates
    bearing_rad: float = 0.0  # how far the boat has come round the buoy that is next, see gates.bearing_on
    closest_m: float = float("inf")  # smallest distance to the present gate so far
    is_blind: bool = False  # the voyage was taken up again: what the boat passed meanwhile was not seen
    released: int = -1  # the goal at whose line the boat no longer waits for the gun, or in whose box
    inside: Inside | None = None  # the box that the boat stays in
    searched: tuple[PointEn, ...] = ()  # the track of the search that is next
    covered: tuple[tuple[int, float], ...] = ()  # goals searched, and the share that was seen
    task: str = ""  # how far the boat is with it, in words
    reached: tuple[int, ...] = ()  # goals reached, in order
    missed: int = 0  # buoys passed on the wrong side and sailed again
    missed_s: float | None = None  # when a gate was missed to which no upload since leads
    history: tuple[tuple[float, float, float, float], ...] = ()  # t, east, north, distance to go: once per 10 s
    history_plan: int = -1  # the plan that its distances are of


@dataclass(frozen=True, kw_only=True)
class VoyageState:
    """The voyage from setting sail to its end."""

    sailing: bool = False  # has been in AUTO and armed with our route
    under_way_s: float = 0.0  # how long the voyage has been under way ...
    last_step_s: float = float("-inf")  # ... counted from step to step
    set_sail_utc_s: float | None = None  # Unix time of setting sail, by the autopilot's clock
    home_reached: bool = False  # the way that follows the last goal, home or to room for a loiter, is sailed
    over: str = ""  # why the voyage is over: what is left is to watch its loiter; empty: it is not
    arrived: bool = False  # ... with all goals reached, and home where the mission ends there
    rest_en_m: PointEn | None = None  # where the boat loiters since
    station_since: Since | None = None  # when she began to stay at the last goal for as long as the mission asks


@dataclass(frozen=True, kw_only=True)
class Planning:
    """When and how plans are asked for."""

    ready_route: Route | None = None  # planned, not allowed or not yet possible to upload
    asked: str = ""  # why a new plan is wanted at once, until it is asked for; empty: it is not
    asked_as: ReplanReason = ReplanReason.ORDER
    last_s: float = float("-inf")  # when a plan was last asked for
    retry: Retry = PATIENT
    rung: int = 0  # step of the ladder being tried
    unanswered: int = 0  # requests in a row that the planner did not answer
    latency: PlannerLatency = NO_ANSWERS  # how long the planner takes on this computer
    effort: float = 1.0  # share of the planning budget that is asked for: less on a slow processor
    made: int = 0  # plans that were answered with a way: the number of the last one
    replans: int = 0  # asked for under way
    replanned_index: int = -1  # the target for which Wolsieffer's replan was asked
    no_go_since_s: float | None = None


@dataclass(frozen=True, kw_only=True)
class Pending:
    """What was asked of planner and autopilot and is not answered yet, and the patience with each."""

    next_id: int = 1
    plan: PendingPlan | None = None
    upload: PendingUpload | None = None
    upload_retry: Retry = PATIENT
    read: tuple[int, float] | None = None  # id, since
    read_retry: Retry = PATIENT
    command: tuple[int, float, str] | None = None  # id, since, what
    command_retry: Retry = PATIENT
    accepted: tuple[str, float] | None = None  # the last command that was accepted, and when


@dataclass(frozen=True, kw_only=True)
class OperatorState:
    """Who has the boat when we have not: a person, or one of the autopilot's failsafes."""

    since_s: float | None = None  # since when a person has the boat
    given_back_s: float = float("-inf")  # when a person last gave the boat back
    is_back: bool = False  # AUTO has come back: plan from where the boat is now
    signs: Signs = Signs()
    stop: Stop | None = None  # the boat is not being sailed though it was
    put: Stop | None = None  # before she sets sail: a mode that a person chose since the autopilot was first heard
    answering: str = ""  # the cause whose stop we have ended or are ending; empty: none
    sent_home: bool = False  # ... which put the boat into RTL


@dataclass(frozen=True, kw_only=True)
class SteeringState:
    """The modes and headings that are asked for beside the mission."""

    own_mode: Mode | None = None  # a mode other than AUTO that we asked for ourselves
    until_s: float | None = None  # bearing away in GUIDED until
    heading_rad: float | None = None
    irons_s: tuple[float, ...] = ()  # when the boat was in irons
    tacked_s: float = float("-inf")  # when a tack was last asked for


@dataclass(frozen=True, kw_only=True)
class PositionState:
    """Whether the reported position is believed (``behaviors.position_doubt``), and where the boat was last."""

    last_seen: Fix | None = None  # the last position
    doubt: PositionDoubt | None = None  # it is not believed
    back_s: float = float("-inf")  # when it was believed again: this step's jump is none
    lost_s: float | None = None  # since when the autopilot's filter has had no position
    disputed_s: float | None = None  # since when two receivers have said different things
    anew: Mode | None = None  # a LOITER whose point jumped with the position is begun anew: what shows next
    place: SavedPlace | None = None  # where the boat is believed or reckoned to be, for who comes after a kill
    restored: SavedPlace | None = None  # where the boat was before this start, until the first fix is held against it


@dataclass(frozen=True, kw_only=True)
class Orders:
    """What was ordered from ashore or aboard (``companion.orders``)."""

    standing: Standing | None = None  # the order that stands until the boat is told to go on
    answered: tuple[Answered, ...] = ()  # the last order of each who gave one lately
    skipped: int = 0  # goals given up: by order, and boxes that she could not stay in


@dataclass(frozen=True, kw_only=True)
class Alarms:
    """Watchdogs, and what is known of the battery."""

    raised: tuple[Raised, ...] = ()
    entering: tuple[tuple[str, float], ...] = ()  # watchdogs whose entry condition holds, since when
    battery_critical: bool = False  # by the autopilot's own limit (BATT_CRT_VOLT, BATT_CRT_MAH)
    charge: Charge | None = None


@dataclass(frozen=True, kw_only=True)
class TrafficState:
    """The vessels about, as they are watched."""

    watch: tuple[Assessment, ...] = ()  # vessels in view, the worst first
    encounters: tuple[OngoingEncounter, ...] = ()  # with vessels, under the policy "rules"


@dataclass(frozen=True, kw_only=True)
class Announced:
    """What was said lately, so that it is not said again at once."""

    codes: tuple[tuple[str, float], ...] = ()  # code, last said
    watch: tuple[tuple[int, int, float], ...] = ()  # MMSI and branch of vessels said lately, when
    encounters: tuple[tuple[int, int, str, float], ...] = ()  # MMSI, branch, what, when
    water_en_mps: tuple[float, float] | None = None  # the current that was said last; None: still water


@dataclass(frozen=True, kw_only=True)
class SkipperState:
    """Everything that ``step`` needs from before, in parts that are replaced whole.

    ``Skipper.initial`` makes the first; ``StepContext.set`` replaces a part.
    """

    phase: Phase = Phase.IDLE
    why: str = "just started"
    wants: tuple[str, ...] = ()  # what is missing, in words
    vehicle: VehicleIdentity = VehicleIdentity()
    mission: LoadedMission = LoadedMission()
    progress: GoalProgress = GoalProgress()
    voyage: VoyageState = VoyageState()
    plans: Planning = Planning()
    pending: Pending = Pending()
    operator: OperatorState = OperatorState()
    steering: SteeringState = SteeringState()
    by_field: FieldSteering = FieldSteering()
    fallback: Fallback = Fallback()
    adrift: Adrift = Adrift()
    vane: VaneTrim = VaneTrim()
    soundings: Soundings = Soundings()
    tacking: Tacking = NO_TACKS  # what the boat's tacks have told
    afloat: Afloat = NOTHING_LEARNED  # what her sailing has, of her speeds
    position: PositionState = PositionState()
    orders: Orders = Orders()
    alarms: Alarms = Alarms()
    traffic: TrafficState = TrafficState()
    announced: Announced = Announced()


def is_given_up(state: SkipperState) -> bool:
    """Return whether the boat was given up by order: nothing is asked of it."""
    return state.orders.standing is not None and state.orders.standing.verb is Verb.STOP


def standing_saved(state: SkipperState) -> Standing | None:
    """Return the order that stands as it is saved: its age in whole minutes."""
    order = state.orders.standing
    if order is None:
        return None
    return replace(order, since_s=None, before_s=60.0 * (order.age_s(state.voyage.last_step_s) // 60.0))


def saved_of(state: SkipperState, voyage: str) -> Persisted:
    """Return what of a state survives a kill."""
    return Persisted(
        voyage=voyage,
        gate=state.progress.gate,
        sailing=state.voyage.sailing,
        route=state.mission.route,
        pending=state.pending.upload.route if state.pending.upload is not None else None,
        unsure=state.mission.unsure_route,
        own_mode=state.steering.own_mode,
        motor=state.adrift.motor,
        under_way_s=60.0 * (state.voyage.under_way_s // 60.0),
        arrived=state.voyage.arrived,
        uid=state.vehicle.uid,
        system=state.vehicle.system,
        approaches=state.progress.approaches,
        quarters=round(state.progress.bearing_rad / (0.5 * math.pi)),
        standing=standing_saved(state),
        reached=state.progress.reached,
        skipped=state.orders.skipped,
        set_sail_utc_s=state.voyage.set_sail_utc_s,
        inside=None
        if state.progress.inside is None or state.progress.inside.utc_s is None
        else (state.progress.inside.goal, state.progress.inside.utc_s),
        station_utc_s=None if state.voyage.station_since is None else state.voyage.station_since.utc_s,
        searched=state.progress.searched[:-1],
        covered=state.progress.covered,  # the last point moves with the boat
        tacks=(state.tacking.tried, state.tacking.failed),
        irons_s=state.tacking.irons_s,
        lee_mps=(state.tacking.starboard_lee_mps, state.tacking.port_lee_mps),
        place=state.position.place,
        latency=state.plans.latency,
        shoals=state.soundings.shoals,
        afloat=state.afloat.saved,
    )


# --------------------
# The state in another frame: every place that is remembered is carried over, at one moment between two steps.


def in_water(state: SkipperState, shift: Shift) -> SkipperState:
    """Return a state in the metres of another frame.

    The places of ``history`` stand between a time and a distance.
    """
    new = carried(state, shift)
    history = tuple((t_s, *shift.point((east, north)), to_go_m) for t_s, east, north, to_go_m in state.progress.history)
    return changed(new, progress=changed(new.progress, history=history))
