"""One step in the making: the state so far, the snapshot, and the actions asked for.

A ``StepContext`` lives for one call of ``step``. Rules read it and change it through its methods; nothing leaves it but
the frozen state and the tuple of actions. Permissions are checked here too, so no rule can go round them.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cached_property, lru_cache
from typing import TypedDict, Unpack

from companion.boat import Afloat, AutopilotLimits, as_learned, loiter_swing_m, mark_of
from companion.frozen import changed
from companion.geo.angles import difference_rad
from companion.messages import AutopilotStatus, Mode, Severity
from companion.safety import JUMP_M, STOPPING
from companion.skipper.step.actions import (
    Action,
    Announce,
    Arm,
    CancelPlan,
    ReplanReason,
    RunMotor,
    SetCurrent,
    SetMode,
    SetParameter,
    SteerHeading,
    Tack,
    UploadFence,
    UploadMission,
)
from companion.skipper.step.config import Guidance, Learning, Permissions, SkipperConfig
from companion.skipper.step.missions import ends_safely
from companion.skipper.step.route import Diversion, Route
from companion.skipper.step.snapshot import Snapshot, still_air, wind_mean, wind_now
from companion.skipper.step.state import (
    PATIENT,
    Adrift,
    Alarms,
    Announced,
    Fallback,
    FieldSteering,
    Fix,
    GoalProgress,
    LoadedMission,
    OperatorState,
    Orders,
    Pending,
    Phase,
    Planning,
    PositionState,
    Retry,
    SkipperState,
    Soundings,
    SteeringState,
    Tacking,
    TrafficState,
    VaneTrim,
    VehicleIdentity,
    VoyageState,
    is_given_up,
)
from companion.skipper.way import Approach, Gate, PointEn, Voyage, bearing_rad, gates_of
from companion.skipper.way.autopilot_fence import Drawn, HomeCircle, circle_of, drawn_of
from companion.skipper.way.drying import SOLID_S, DryingWater
from companion.skipper.way.position_plausibility import innovation_m
from companion.skipper.way.shoals import Shoal, shoaled, still_shoal
from companion.skipper.way.stemming import Water
from companion.skipper.way.voyage import AreaLike

FRESH_S = 3.0  # a part older than this is not acted upon
BEATEN_MPS = 10.0  # the wind in which the boat may have sailed while nobody looked
SHOWS_S = 2.5  # a command that was accepted shows in the next heartbeats: it is not repeated before that
DRIFT_LOOK_S = 20.0  # a boat in HOLD is where its drift takes it within this


def permitted(action: Action, permissions: Permissions) -> bool:
    """Return whether the operator allows an action of this kind."""
    if isinstance(action, UploadMission):
        return permissions.may_upload and ends_safely(action.items)
    if isinstance(action, UploadFence):
        return permissions.may_upload_fence
    if isinstance(action, SetMode):
        return permissions.may_set_mode and (action.mode is not Mode.GUIDED or permissions.may_steer)
    if isinstance(action, RunMotor | Tack):
        return permissions.may_set_mode
    if isinstance(action, Arm):
        return permissions.may_arm
    if isinstance(action, SetCurrent):
        return permissions.may_upload
    if isinstance(action, SteerHeading):
        return permissions.may_steer
    if isinstance(action, SetParameter):
        return permissions.may_trim_vane
    return True


def field_steers(snapshot: Snapshot, state: SkipperState, config: SkipperConfig) -> bool:
    """Return whether a field steers the boat and not the plan on board: the mission's or a goal's own, if permitted."""
    may, is_own = snapshot.permissions, config.guidance is Guidance.FIELD and not in_place_of_guidance(state)
    return (state.by_field.composed or is_own) and may.may_steer and may.may_set_mode


def in_place_of_guidance(state: SkipperState) -> bool:
    """Return whether AUTO sails a plan to the next goal in place of the mission's own guidance."""
    return state.fallback.sails and state.fallback.gate == state.progress.gate


def is_off_plan(snapshot: Snapshot, state: SkipperState, config: SkipperConfig) -> bool:
    """Return whether a field steers, as a last resort too: nothing of the plan on board is true of what is sailed."""
    return field_steers(snapshot, state, config) or state.by_field.resort.engaged


def _kept_in(voyage: Voyage, drawn: Drawn | None, circle: HomeCircle | None) -> Voyage:
    """Return the voyage in what the autopilot's own fence leaves of its water."""
    if drawn is not None:
        voyage = replace(voyage, area=drawn.left)
    if circle is None:
        return voyage
    return replace(voyage, area=voyage.area.within(circle.en_m, circle.radius_m, circle.words))


def _with_shoals(voyage: Voyage, state: SkipperState, config: SkipperConfig, utc_s: float | None) -> Voyage:
    """Return the voyage in what the shoals that were sounded leave of its water, at the present height of the tide."""
    shoals = state.soundings.shoals
    if shoals and config.tide is not None and config.least_depth_m is not None:
        shoals = still_shoal(shoals, config.tide.height_m(utc_s), config.least_depth_m)
    return replace(voyage, area=shoaled(voyage.area, shoals)) if shoals else voyage


@lru_cache(maxsize=16)
def _filled(area: AreaLike, solid: tuple[DryingWater, ...]) -> AreaLike:
    """Return the area with some of the water that dries as obstacles."""
    return area.also(tuple(w.name for w in solid), tuple(w.polygon for w in solid), tuple(w.margin_m for w in solid))


def _with_drying(voyage: Voyage, solid: tuple[DryingWater, ...]) -> Voyage:
    """Return the voyage with some of the water that dries as obstacles."""
    return replace(voyage, area=_filled(voyage.area, solid)) if solid else voyage


def _is_fence_off(state: SkipperState, snapshot: Snapshot) -> bool:
    """Return whether the autopilot keeps a fence no more: under way not for a moment's silence, but by the watchdog."""
    if state.voyage.sailing:
        return "fence off" in [raised.name for raised in state.alarms.raised]
    return snapshot.autopilot is not None and snapshot.autopilot.fence_on is False


def with_known_boat(
    voyage: Voyage, config: SkipperConfig, state: SkipperState, limits: AutopilotLimits | None
) -> Voyage:
    """Return the voyage with its boat as she is found to sail, and turning no faster than her autopilot lets her.

    What was found counts where plans are to be told of it.
    """
    known, boat = state.afloat.known, voyage.boat
    if known.is_used and config.learn is Learning.USE and known.of == mark_of(voyage.boat):
        boat = as_learned(boat, known.told)
    if limits is not None and limits.rate_max_radps < boat.turn_rate_radps:
        boat = replace(boat, turn_rate_radps=limits.rate_max_radps)
    return voyage if boat is voyage.boat else replace(voyage, boat=boat)


class Parts(TypedDict, total=False):
    """The parts of ``SkipperState`` that rules replace."""

    wants: tuple[str, ...]
    vehicle: VehicleIdentity
    mission: LoadedMission
    progress: GoalProgress
    voyage: VoyageState
    plans: Planning
    pending: Pending
    operator: OperatorState
    steering: SteeringState
    by_field: FieldSteering
    fallback: Fallback
    adrift: Adrift
    vane: VaneTrim
    soundings: Soundings
    tacking: Tacking
    afloat: Afloat
    position: PositionState
    orders: Orders
    alarms: Alarms
    traffic: TrafficState
    announced: Announced


class StepContext:
    """The work of one step. ``voyage`` is in the water that the autopilot's fences leave: ``circle`` and ``drawn``.

    Its boat is the one that plans are of, ``boat_of_file`` as the mission has her.
    """

    def __init__(self, voyage: Voyage, config: SkipperConfig, state: SkipperState, snapshot: Snapshot) -> None:
        self.boat_of_file = voyage.boat
        voyage = unfilled = with_known_boat(voyage, config, state, snapshot.limits)
        self.utc_s = snapshot.unix_s(snapshot.t_s)
        """The Unix time by the autopilot's clock [s], None while that does not know it."""
        closed = tuple(w for w in voyage.drying if w.is_closed(config.tide, self.utc_s, SOLID_S))
        voyage = self._charted = _with_drying(voyage, closed)
        self._unfilled = unfilled
        voyage = _with_shoals(voyage, state, config, self.utc_s)
        self.circle = circle_of(voyage, snapshot.limits, snapshot.autopilot, snapshot.position_en_m)
        self.drawn = drawn_of(
            voyage.area, snapshot.fence, snapshot.limits, config.margin_m, is_off=_is_fence_off(state, snapshot)
        )
        self.voyage, self.config = _kept_in(voyage, self.drawn, self.circle), config
        self.state = state
        self.snapshot = snapshot if config.sails else replace(snapshot, wind=still_air(snapshot.t_s))
        self.actions: list[Action] = []
        self.found: tuple[tuple[object, ...], Diversion | None] | None = None  # the diversion, by what it was found
        self.fresh: tuple[str, ...] = ()  # watchdogs that were raised in this step
        self._gates: tuple[tuple[Approach, ...], tuple[Gate, ...]] | None = None
        self._jump: tuple[tuple[Snapshot, Fix, Mode | None], float] | None = None

    # ------------------------------------------------------------------------------------- changing
    def set(self, **parts: Unpack[Parts]) -> None:
        """Replace parts of the state whole; what is not named stays."""
        self.state = changed(self.state, **parts)

    def learn_shoals(self, shoals: tuple[Shoal, ...]) -> None:
        """Let these be the shoals that were sounded: from now on they are no water."""
        self.set(soundings=replace(self.state.soundings, shoals=shoals))
        self.voyage = _kept_in(_with_shoals(self._charted, self.state, self.config, self.utc_s), None, self.circle)
        if self.drawn is not None:
            drawn = self.drawn.taken
            self.drawn = Drawn(taken=drawn, left=self.voyage.area.without(drawn, Drawn.words))
            self.voyage = replace(self.voyage, area=self.drawn.left)

    def with_closed(self, solid: tuple[DryingWater, ...]) -> Voyage:
        """Return the voyage in whose water just ``solid`` of what dries is solid, and not what is closed now."""
        if not self.voyage.drying:
            return self.voyage
        voyage = _with_shoals(_with_drying(self._unfilled, solid), self.state, self.config, self.utc_s)
        voyage = _kept_in(voyage, None, self.circle)
        if self.drawn is None:
            return voyage
        return replace(voyage, area=voyage.area.without(self.drawn.taken, Drawn.words))

    @property
    def always_solid(self) -> AreaLike:
        """What is solid whatever the tide does, without limits and soundings: where no boat can be."""
        return self._unfilled.area.unfenced

    @cached_property
    def water_now(self) -> Voyage:
        """The voyage in the water that is deep enough now and for ``SOON_S``: for who steers by what is about her.

        In ``voyage`` water that opens within ``SOLID_S`` is open: she is not there yet.
        """
        closed = tuple(w for w in self.voyage.drying if w.closes_soon(self.config.tide, self.utc_s))
        return self.with_closed(closed)

    @property
    def to_stay_in(self) -> Voyage:
        """The voyage in the water that is deep enough whatever the tide does: for a place to loiter in."""
        return self.with_closed(self.voyage.drying)

    def new_id(self) -> int:
        """Return a number not used before in this voyage."""
        number = self.state.pending.next_id
        self.set(pending=changed(self.state.pending, next_id=number + 1))
        return number

    def let_go_of_plan(self) -> None:
        """Take back the request for a plan, where one waits for its answer."""
        if self.state.pending.plan is not None:
            self.act(CancelPlan(request_id=self.state.pending.plan.request_id))
            self.set(pending=changed(self.state.pending, plan=None))

    def act(self, action: Action) -> bool:
        """Ask for an action; False (nothing is asked) when it is not permitted, the autopilot not ours, or given up."""
        is_order = isinstance(
            action,
            UploadMission | UploadFence | SetMode | Arm | SetCurrent | SetParameter | SteerHeading | Tack | RunMotor,
        )
        if is_order and (self.is_given_up or not self.state.vehicle.is_ours):
            return False
        if not permitted(action, self.snapshot.permissions):
            return False
        self.actions.append(action)
        return True

    def say(self, severity: Severity, code: str, text: str, *, every_s: float | None = None) -> None:
        """Announce something; the same code not more often than every ``every_s`` (default: the configured)."""
        if self.is_said(code, self.config.announce_interval_s if every_s is None else every_s):
            return
        said = dict(self.state.announced.codes)
        said[code] = self.t_s
        recent = sorted(said.items(), key=lambda item: item[1])[-64:]
        self.set(announced=changed(self.state.announced, codes=tuple(recent)))
        self.actions.append(Announce(severity=severity, code=code, text=text))

    def is_said(self, code: str, within_s: float) -> bool:
        """Return whether it was announced within that time: then it need not be worked out."""
        return self.t_s - dict(self.state.announced.codes).get(code, -math.inf) < within_s

    def phase(self, phase: Phase, why: str) -> None:
        """Set the phase and the sentence that says why."""
        self.state = changed(self.state, phase=phase, why=why)

    def failed(self, retry: Retry) -> Retry:
        """Return the patience after another failure: the wait doubles up to the longest."""
        wait = min(self.config.backoff_first_s * self.config.backoff_factor**retry.failures, self.config.backoff_max_s)
        return Retry(failures=retry.failures + 1, not_before_s=self.t_s + wait)

    def approach(self, approach: Approach) -> None:
        """Begin the way to the goal that is next where ``approach`` says, from its first gate.

        The gates are others from here on: what the mission on board, or on its way there, counted for is void.
        """
        others = tuple(a for a in self.state.progress.approaches if a.goal != approach.goal)
        self.set(
            progress=changed(
                self.state.progress,
                approaches=(*others, approach),
                bearing_rad=0.0,
                closest_m=math.inf,
                gate=next(n for n, gate in enumerate(self.gates) if gate.goal == approach.goal),
            )
        )
        self.void_route()

    def give_up(self, gate: Gate, asked_as: ReplanReason) -> str:
        """Leave a gate's goal for the one behind it, from where the boat is, and return that in words.

        A mark of it that was missed is not gone back for, and nothing is waited for before the plan.
        """
        assert self.boat_en is not None
        self.let_go_of_plan()
        self.approach(Approach(goal=gate.goal + 1, en_m=self.boat_en))
        text = f"{gate.name} is given up"
        self.set(
            orders=changed(self.state.orders, skipped=self.state.orders.skipped + 1),
            progress=changed(self.state.progress, missed_s=None),
            plans=changed(self.state.plans, retry=PATIENT, asked=text, asked_as=asked_as),
        )
        return text

    def void_route(self) -> None:
        """Let no item of the mission on board, or on its way there, count for the gate that is next or a later one."""

        def void(route: Route) -> Route:
            return replace(route, gate_of=tuple(-1 if g >= self.state.progress.gate else g for g in route.gate_of))

        if self.state.mission.route is not None:
            self.set(mission=changed(self.state.mission, route=void(self.state.mission.route)))
        if self.state.pending.upload is not None:
            pending = self.state.pending.upload
            self.set(pending=changed(self.state.pending, upload=replace(pending, route=void(pending.route))))

    # -------------------------------------------------------------------------------------- reading
    @property
    def gates(self) -> tuple[Gate, ...]:
        """The voyage's gates, in order."""
        approaches = self.state.progress.approaches
        if self._gates is None or self._gates[0] is not approaches:
            self._gates = (approaches, gates_of(self.voyage, approaches))  # which hashes the whole voyage
        return self._gates[1]

    @property
    def t_s(self) -> float:
        """Now [s]."""
        return self.snapshot.t_s

    @property
    def late_s(self) -> float:
        """How much earlier than on a fast computer plans are asked for [s]: nine of ten are there as much later."""
        return self.state.plans.latency.late_s

    @property
    def plan_lead_s(self) -> float:
        """What the boat sails until a plan that is asked for now is on board, uploading aside [s]."""
        return self.config.plan_budget_s + self.state.plans.latency.usually_late_s

    @property
    def autopilot(self) -> AutopilotStatus | None:
        """The autopilot's status while it is heard."""
        age = self.snapshot.heartbeat_age_s
        return self.snapshot.autopilot if age is not None and age <= FRESH_S else None

    @property
    def boat_en(self) -> PointEn | None:
        """The boat's position while it is fresh and plausible."""
        age = self.snapshot.vehicle_age_s
        if self.snapshot.vehicle is None or age is None or age > FRESH_S:
            return None
        is_doubted = self.state.position.doubt is not None or self.jump_m >= JUMP_M
        return None if is_doubted and not self.plans_in_doubt else self.snapshot.position_en_m

    @property
    def reckoned_en(self) -> PointEn | None:
        """Where the boat is, reckoned on from the last place that was believed while the position is not."""
        doubt = self.state.position.doubt
        return self.boat_en if doubt is None else doubt.reckoned_en_m

    @property
    def plans_in_doubt(self) -> bool:
        """Whether a plan is made from a position that is not believed: where no LOITER can be kept instead.

        Sailed by the autopilot, on a way that is shut, a plan that is clear from where it believes to be is better.
        """
        is_held = self.state.steering.own_mode in STOPPING and self.snapshot.permissions.may_set_mode
        return not is_held and self.is_way_shut

    @property
    def is_way_shut(self) -> bool:
        """Whether the autopilot, sailing by the position that it reports now, comes too near to something on its leg.

        A position that has just jumped may be false; but it is what the boat is steered by, so a plan that is clear
        from there is better than a leg that is not.
        """
        here, leg, vehicle = self.snapshot.position_en_m, self.leg(), self.snapshot.vehicle
        if here is None or leg is None or vehicle is None or not self.state.voyage.sailing:
            return False
        goes_to = leg[1]
        if self.state.steering.own_mode in STOPPING:  # drifting, turning, or on a way that is not ours
            east, north = vehicle.velocity_en_mps
            goes_to = (here[0] + DRIFT_LOOK_S * east, here[1] + DRIFT_LOOK_S * north)
        area, floor_m = self.voyage.area, min(self.config.margin_floor_m, self.config.margin_m)
        return float(area.clearance_m([here])[0]) > 0.0 and area.path_clearance_m([here, goes_to]) < floor_m

    @property
    def jump_m(self) -> float:
        """How much farther the boat is off than its last fix, however long ago, can have led it [m].

        At a leap's 8 m/s a second would hide what a margin is: it is held against its own speed.
        """
        last = self.state.position.last_seen
        if last is None or self.state.position.back_s == self.t_s:
            return 0.0
        of = self.snapshot, last, self.state.steering.own_mode
        if self._jump is None or any(a is not b for a, b in zip(of, self._jump[0], strict=True)):
            self._jump = of, self.innovation_m(last)  # whoever asks where the boat is asks for it
        return self._jump[1]

    def innovation_m(self, last: Fix, held_in: Mode | None = None) -> float:
        """Return how much farther the boat is off than ``last`` can have led it [m].

        ``held_in``: the mode that it was left in, where no state says so yet.
        """
        here, vehicle, age = self.snapshot.position_en_m, self.snapshot.vehicle, self.snapshot.vehicle_age_s
        if here is None or vehicle is None or age is None:
            return 0.0
        status, own = self.snapshot.autopilot, held_in or self.state.steering.own_mode
        return innovation_m(
            (here[0] - last.en_m[0], here[1] - last.en_m[1]),
            max(0.0, self.t_s - age - last.t_s),
            last.velocity_en_mps,
            vehicle.velocity_en_mps,
            fastest_mps=self.voyage.boat.polar.max_speed_mps(BEATEN_MPS) + self.snapshot.current.drift_mps,
            is_held=own in {Mode.LOITER, Mode.HOLD} and status is not None and status.mode is own,
        )

    @property
    def speed_mps(self) -> float:
        """Speed over ground [m/s], 0 when unknown."""
        return self.snapshot.vehicle.speed_mps if self.snapshot.vehicle is not None else 0.0

    @property
    def wind_now(self) -> tuple[float, float] | None:
        """The 5 s wind (from [rad], speed [m/s])."""
        return wind_now(self.snapshot)

    @property
    def wind_mean(self) -> tuple[float, float] | None:
        """The 90 s wind (from [rad], speed [m/s])."""
        return wind_mean(self.snapshot)

    @property
    def current_en_mps(self) -> tuple[float, float]:
        """The current that plans reckon with [m/s, towards east and north]; 0 where none is significant."""
        return self.snapshot.current.planned_en_mps

    @property
    def through_en_mps(self) -> tuple[float, float]:
        """The boat's velocity less that current [m/s]: over the ground where none is significant; 0 when unknown."""
        vehicle, (east, north) = self.snapshot.vehicle, self.current_en_mps
        return (
            (0.0, 0.0) if vehicle is None else (vehicle.velocity_en_mps[0] - east, vehicle.velocity_en_mps[1] - north)
        )

    @property
    def water(self) -> Water | None:
        """The current as it is to be stemmed, None where none is planned with or the wind is not known."""
        wind = self.wind_mean
        if wind is None or not self.snapshot.current.is_significant:
            return None
        return Water(
            boat=self.voyage.boat, wind=wind, current_en_mps=self.current_en_mps, no_go_half_rad=self.no_go_half_rad
        )

    @property
    def no_go_half_rad(self) -> float:
        """Where the autopilot stops following the line."""
        return self.config.autopilot_no_go_rad(self.snapshot.limits)

    def is_closed(self, a: PointEn, b: PointEn, wind: tuple[float, float] | None) -> bool:
        """Return whether a to b lies where the autopilot does not follow the line in ``wind`` (from [rad], [m/s])."""
        return wind is not None and abs(difference_rad(wind[0], bearing_rad(a, b))) < self.no_go_half_rad

    @property
    def planned_no_go_rad(self) -> float:
        """The half angle that plans keep out of."""
        return self.config.planned_no_go_rad(self.voyage.boat, self.snapshot.limits)

    @property
    def tack_corridor_m(self) -> float:
        """How far off its line the autopilot tacks [m], SAIL_XTRACK_MAX; 0 in GUIDED, where it never does."""
        limits = self.snapshot.limits
        if self.steers_plans:
            return 0.0
        return self.config.tack_corridor_m if limits is None else limits.sail_xtrack_max_m

    @property
    def known_config(self) -> SkipperConfig:
        """The configuration, with what has been read of the autopilot and of the wind in place of its defaults."""
        return replace(
            self.config,
            no_go_half_rad=self.no_go_half_rad,
            tack_corridor_m=self.tack_corridor_m,
            loiter_radius_m=float(round(self.loiter_swing_m)),
        )

    @property
    def loiter_swing_m(self) -> float:
        """How far from its place a loiter takes the boat in this wind [m]."""
        wind, limits = self.wind_mean, self.snapshot.limits or AutopilotLimits()
        least_m, polar = self.config.loiter_radius_m, self.voyage.boat.polar
        return least_m if wind is None else max(least_m, loiter_swing_m(polar, wind[1], limits.rate_max_radps))

    @property
    def fences(self) -> tuple[HomeCircle | Drawn, ...]:
        """The autopilot's own fences, where it has any that matter."""
        return tuple(fence for fence in (self.circle, self.drawn) if fence is not None)

    @property
    def gate(self) -> Gate | None:
        """The gate being sailed to, None when all are passed."""
        return self.gates[self.state.progress.gate] if self.state.progress.gate < len(self.gates) else None

    def is_raised(self, name: str) -> bool:
        """Return whether a watchdog is raised."""
        return name in [raised.name for raised in self.state.alarms.raised]

    @property
    def is_taken(self) -> bool:
        """Whether somebody else has the boat: under way, and disarmed or in a mode that we did not ask for."""
        status = self.autopilot
        if status is None or not self.state.voyage.sailing:
            return False
        if status.is_armed and self.is_leaving:
            return False
        if status.mode in {None, Mode.AUTO, Mode.INITIALISING} or self.is_own(status.mode):
            return not status.is_armed
        return True

    def is_own(self, mode: Mode | None) -> bool:
        """Return whether a mode is one that we asked for; a LOITER that is begun anew passes through HOLD."""
        own = self.state.steering.own_mode
        return mode is own or (self.state.position.anew is not None and {mode, own} <= {Mode.LOITER, Mode.HOLD})

    @property
    def is_given_up(self) -> bool:
        """Whether the boat was given up by order: nothing is asked of it."""
        return is_given_up(self.state)

    @property
    def is_leaving(self) -> bool:
        """Whether the boat shows a stop still, or GUIDED, that an order of ours, on its way or just accepted, ends."""
        status, state, own = self.autopilot, self.state, self.state.steering.own_mode
        if status is None or own is None or own is status.mode:
            return False
        since_s = -math.inf
        if status.mode is not Mode.GUIDED:
            if state.operator.stop is None or status.mode is not state.operator.stop.mode:
                return False
            since_s = state.operator.stop.t_s
        if state.pending.command is not None:
            return state.pending.command[2] == own.name and since_s < state.pending.command[1]
        name, accepted_s = state.pending.accepted or ("", 0.0)
        return name == own.name and since_s < accepted_s and self.t_s < accepted_s + SHOWS_S

    @property
    def guidance(self) -> Guidance:
        """What steers the boat now: the mission's guidance, or the field of the goal that is next."""
        if self.state.by_field.composed:
            return Guidance.FIELD
        return Guidance.PLAN if self.falls_back else self.config.guidance

    @property
    def is_steered(self) -> bool:
        """Whether she is steered by headings or a field, and not by the autopilot along its legs."""
        status = self.autopilot
        return self.guidance is not Guidance.PLAN and status is not None and status.mode is Mode.GUIDED

    @property
    def falls_back(self) -> bool:
        """Whether AUTO sails a plan to the next goal in place of the mission's own guidance."""
        return in_place_of_guidance(self.state)

    @property
    def asks_fallback(self) -> bool:
        """Whether plans to the next goal are made for AUTO in place of the mission's own guidance."""
        return self.state.fallback.gate == self.state.progress.gate

    @property
    def steers(self) -> bool:
        """Whether the boat is steered by headings, a plan's or a field's (and may be).

        The loiter that ends a mission has no heading: it is the autopilot's.
        """
        if self.guidance is Guidance.PLAN or (self.guidance is Guidance.HEADING and self._is_at_safe_end):
            return False
        return self.may_guide

    @property
    def steers_plans(self) -> bool:
        """Whether plans are sailed in GUIDED, and not by the autopilot's line following, its corridor and its tacks.

        A goal's own field ends there: what is planned from it on is sailed as the mission says.
        """
        return self.config.guidance is not Guidance.PLAN and self.may_guide and not self.asks_fallback

    @property
    def _is_at_safe_end(self) -> bool:
        return self.state.mission.route is not None and not self.ahead()

    @property
    def may_guide(self) -> bool:
        """Whether the operator permits steering in GUIDED."""
        may = self.snapshot.permissions
        return may.may_steer and may.may_set_mode

    @property
    def is_field_steered(self) -> bool:
        """Whether a field steers the boat, the mission's or a goal's own."""
        return field_steers(self.snapshot, self.state, self.config)

    @property
    def is_off_plan(self) -> bool:
        """Whether nothing of the plan on board is true of what is sailed: a field steers, as a last resort too."""
        return is_off_plan(self.snapshot, self.state, self.config)

    @property
    def is_by_field(self) -> bool:
        """Whether a field steers the boat now, in GUIDED."""
        status = self.autopilot
        return self.is_field_steered and status is not None and status.mode is Mode.GUIDED

    @property
    def sails_in(self) -> Mode:
        """The mode that the boat sails in: GUIDED where it is steered, else AUTO."""
        return Mode.GUIDED if self.steers else Mode.AUTO

    def leg(self) -> tuple[PointEn, PointEn] | None:
        """Return the planned leg being sailed (from, to), None without a route."""
        route, i = self.state.mission.route, self.state.mission.index
        if route is None or not 0 <= i < len(route.items):
            return None
        return route.leg_from_en_m[i], route.points_en_m[i]

    def ahead(self) -> tuple[PointEn, ...]:
        """Return the waypoints still to be sailed, without the safe end; empty when loitering at it."""
        route = self.state.mission.route
        return route.points_en_m[self.state.mission.index : -1] if route is not None else ()

    def last_waypoint(self) -> int:
        """Return the index of the last waypoint before the safe end, -1 without one."""
        route = self.state.mission.route
        return len(route.items) - 2 if route is not None else -1

    def blank_facts(self, plan_id: int, margin_m: float, delta_s: float, rung: str) -> Route:
        """Return the figures of a plan that is being asked for now."""
        wind = self.wind_mean or (0.0, 0.0)
        return Route(
            plan_id=plan_id,
            plan_t_s=self.t_s,
            plan_twd_from_rad=wind[0],
            plan_tws_mps=wind[1],
            plan_current_east_mps=self.current_en_mps[0],
            plan_current_north_mps=self.current_en_mps[1],
            plan_half_width_rad=0.0,
            margin_m=margin_m,
            delta_s=delta_s,
            rung=rung,
        )
