"""The companion without its shell: values in, snapshots, steps and actions out.

Nothing else decides. The application feeds it live; ``companion replay`` feeds it from a recorded voyage, and must get
the same actions.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

from companion.boat import AutopilotLimits
from companion.current import FITS_S, STILL, CurrentEstimator, Prior, Sailing, VaneCheck
from companion.eta import PRIOR_PACE, UNKNOWN, Eta, Pace, eta_of, paced
from companion.geo.angles import wrap_pi
from companion.geo.frame import LocalFrame
from companion.geo.shift import Shift, carried
from companion.geofence import Zone
from companion.geofence.formats import Findings, items_to_zones
from companion.mavlink.reception import PlausibilityFilter
from companion.mavlink.vehicle_identity import GAP_S, UID_EVERY_S, Identity
from companion.mavlink.wire import (
    AUTOPILOT_COMPONENT,
    BY_L1,
    L1_RANGES,
    RANGES,
    Drop,
    Effect,
    Message,
    VehicleAssembler,
    autopilot_version,
    believable,
    effect_of,
    is_autopilot_heartbeat,
)
from companion.messages import (
    AisReport,
    ApparentWind,
    AutopilotStatus,
    GeoPoint,
    MissionItem,
    Mode,
    StatusText,
    VehicleState,
    WindSample,
)
from companion.skipper import Skipper, SkipperState, Voyage
from companion.skipper.step import (
    Action,
    AutopilotRebooted,
    Disbelieved,
    Event,
    MissionOnBoard,
    ModeChanged,
    Outcome,
    ParameterChanged,
    Permissions,
    Persisted,
    ReadOutcome,
    Route,
    Snapshot,
    WindBefore,
    WindEstimate,
    WindHealth,
    is_off_plan,
)
from companion.traffic import TargetLimits, Targets
from companion.wind import OFFSET_TYPES, VANE_OFFSET, VANE_TYPE, Estimator, WindStatus, WindTracker, WindVerdict, make

__all__ = ["Step", "VoyageFold", "Waters", "begun"]

# Wind is believed after this long a record [s]; until then its spread is a guess.
SETTLED_S = 20.0

# A spiking vane is not among them: its spikes are not fed, and what is left is widened.
_UNTRUSTED = frozenset(
    {
        WindVerdict.FROZEN,
        WindVerdict.SILENT,
        WindVerdict.HELD,
        WindVerdict.SYNTHESISED,
        WindVerdict.NO_SPEED_SENSOR,
        WindVerdict.TURNED,
    }
)


class StepWind:
    """The wind room with the means over 90 s and 5 s beside its forecast."""

    def __init__(self, room: WindTracker) -> None:
        self.room = room
        self._begin()

    def _begin(self) -> None:
        self._mean90: Estimator = make("mean90")
        self._mean5: Estimator = make("mean5")
        self._first_s: float | None = None
        self._last_s: float | None = None

    def begin_anew(self) -> None:
        """Forget all readings: what they were read by has been changed."""
        self.room.begin_anew()
        self._begin()

    def take(self, value: WindSample | ApparentWind) -> None:
        """Take what an instrument said, in the order of time."""
        status = self.room.update(value)
        if status is None or status.sample is None or status.sample.t_s == self._last_s:
            return
        sample = status.sample
        self._last_s = sample.t_s
        if self._first_s is None:
            self._first_s = sample.t_s
        self._mean90.update(
            sample.t_s, sample.twd_from_rad, sample.tws_mps, weight=status.weight, speed_weight=status.speed_weight
        )
        # What a turned vane says now the autopilot sails by, and it is what the boat's motion is held against.
        is_turned = WindVerdict.TURNED in status.verdicts
        self._mean5.update(
            sample.t_s,
            sample.twd_from_rad,
            sample.tws_mps,
            weight=1.0 if is_turned else status.weight,
            speed_weight=1.0 if is_turned else status.speed_weight,
        )

    def view(self, t_s: float) -> WindEstimate:
        """Return the wind at ``t_s``."""
        status = self.room.status(t_s)
        table = self.room.forecast_table(t_s)
        if status is None or table is None or self._first_s is None:
            return WindEstimate()
        mean_rad, _, mean_mps, _ = self._mean90.forecast(0.0)
        now_rad, _, now_mps, _ = self._mean5.forecast(0.0)
        record_s = t_s - self._first_s
        health = _health(status, record_s)
        return WindEstimate(
            health=health,
            forecast=table,
            mean_twd_from_rad=wrap_pi(mean_rad),
            mean_tws_mps=max(0.0, mean_mps),
            sigma_twd_rad=float(table.sigma_twd_rad[0]),
            present_twd_from_rad=wrap_pi(now_rad),
            present_tws_mps=max(0.0, now_mps),
            record_s=record_s,
            verdict="" if health is WindHealth.GOOD else status.reason,
        )


def _health(status: WindStatus, record_s: float) -> WindHealth:
    is_calm = WindVerdict.CALM in status.verdicts
    # In a calm the autopilot holds the old direction, by its least speed: that is the calm and no fault.
    if any(v in _UNTRUSTED and not (is_calm and v is WindVerdict.HELD) for v in status.verdicts):
        return WindHealth.UNTRUSTED
    if is_calm:
        return WindHealth.LIGHT
    return WindHealth.SETTLING if record_s < SETTLED_S else WindHealth.GOOD


# Parameters without which the autopilot's limits are not known.
_LIMITS = frozenset({"SAIL_NO_GO_ANGLE", "SAIL_XTRACK_MAX", "WP_RADIUS"})


@dataclass(frozen=True, slots=True, kw_only=True)
class ParameterChange:
    """A parameter that changes what a sensor says, or how the boat sails, was set; ``before`` None: unknown."""

    name: str
    before: float | None
    after: float
    effect: Effect


class ParameterStore:
    """The autopilot's parameters by ArduPilot's names, in its units."""

    def __init__(self) -> None:
        self.values: dict[str, float] = {}
        self.limits: AutopilotLimits | None = None
        self._in_doubt: dict[str, float] = {}
        self._answered: set[str] = set()
        self._by_l1 = False

    def take(
        self, values: Mapping[str, float], *, is_set: bool = False
    ) -> tuple[dict[str, float], tuple[str, ...], tuple[ParameterChange, ...]]:
        """Take what was told; return what of it is believed, why the rest cannot be, and what somebody has changed.

        One that was known and has changed is in none of them: it is asked for again, and believed when it is told
        twice. With ``is_set`` a first telling of one that has an effect was not asked for by us, as when somebody sets
        it, and is treated likewise.
        """
        good, refused = believable(values)
        self._answered |= values.keys()
        changes: list[ParameterChange] = []
        for name in tuple(good):
            known, value, effect = self.values.get(name), good[name], effect_of(name)
            is_news = known is not None or (is_set and name not in RANGES) or name in self._in_doubt
            if known == value or not is_news or (name not in RANGES and effect is None):
                self._in_doubt.pop(name, None)
            elif self._in_doubt.get(name) != value:
                self._in_doubt[name] = good.pop(name)
            else:
                del self._in_doubt[name]
                if effect is not None:
                    changes.append(ParameterChange(name=name, before=known, after=value, effect=effect))
        self.values.update(good)
        if self._answered >= _LIMITS:
            self.limits = AutopilotLimits.from_params(
                {name: value for name, value in self.values.items() if self._by_l1 or name not in L1_RANGES}
            )
        return good, refused, tuple(changes)

    @property
    def unread(self) -> tuple[str, ...]:
        """The parameters that were not told yet, or once with another value: to be asked for."""
        others = tuple(name for name in self._in_doubt if name not in RANGES and name not in L1_RANGES)
        asked = (*RANGES, *L1_RANGES) if self._by_l1 else RANGES
        return tuple(name for name in asked if name not in self._answered or name in self._in_doubt) + others

    def tell_version(self, version: tuple[int, int, int]) -> None:
        """Take the autopilot's version: an old one steers by L1, and has parameters of it. (0, 0, 0) is none."""
        self._by_l1 = (0, 0) < version[:2] <= BY_L1

    def doubt(self) -> None:
        """Ask for all of them again: the autopilot was begun anew."""
        self._answered.clear()


# Modes in which the sheets are trimmed to sail; in HOLD they are eased, and by hand nobody knows.
_SAILS = frozenset({Mode.AUTO, Mode.GUIDED, Mode.LOITER})
UNTOLD_S = 60.0  # of a boat whose motion does not tell whether the wind that is learned anew is the right one
_NO_INDEX = 65535  # of a parameter that was set or asked for by its name: one of a list has its place in it

Value = VehicleState | AutopilotStatus | WindSample | ApparentWind | StatusText | AisReport
Waters = Callable[[GeoPoint], Voyage]
"""A passage's voyage in the metres of a frame about a place."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Step:
    """What one tick saw and decided.

    Its metres are those of ``voyage``'s frame; with ``shift`` that frame has replaced another just before it. Where it
    ``is_off_plan`` a field steers, and no figure of the plan on board is told.
    """

    snapshot: Snapshot
    state: SkipperState
    actions: tuple[Action, ...]
    voyage: Voyage
    shift: Shift | None = None
    pace: Pace = PRIOR_PACE
    is_off_plan: bool = False

    @property
    def sailed(self) -> Route | None:
        """The route that is sailed; None: there is none, or a field steers and the one on board waits."""
        return None if self.is_off_plan else self.state.mission.route

    def eta(self) -> Eta:
        """Return where the boat is expected from here on, and when it is there."""
        return UNKNOWN if self.is_off_plan else eta_of(self.snapshot, self.state, self.voyage, self.pace)


class VoyageFold:
    """The fold. ``skipper`` holds the rules, ``wind`` the forecaster; everything else here is bookkeeping.

    With ``waters`` the voyage is a passage: between two steps, when the boat has come far enough from the origin of its
    frame, a frame about the boat takes its place, and everything that is remembered in metres is carried over.
    """

    def __init__(
        self,
        skipper: Skipper,
        wind: WindTracker,
        permissions: Permissions,
        persisted: Persisted | None = None,
        *,
        known: tuple[str, ...] = (),
        traffic: TargetLimits | None = None,
        waters: Waters | None = None,
        water: Prior = STILL,
    ) -> None:
        self._waters = waters
        skipper, persisted = begun(skipper, persisted, waters)
        self._prior = water
        boat = skipper.voyage.boat
        self.current = CurrentEstimator(boat.polar.speed_mps, water, speed_error=boat.told_speed_error)
        self.vane = VaneCheck(boat.polar.speed_mps)
        self._anew = ""  # why the wind is learned anew, until it is ...
        self._has_leapt = False  # the wind's direction has, and is doubted for it
        self._anew_s: float | None = None  # ... and since when
        self._sure_wind: tuple[float, float] | None = None  # the mean wind when it was believed last ...
        self._offset_rad: float | None = None  # ... and by how much the vane's offset was changed since
        self.skipper, self.permissions = skipper, permissions
        self._air = StepWind(wind)
        self.state: SkipperState = skipper.initial(persisted, known)
        self.assembler = VehicleAssembler()
        self._witness = PlausibilityFilter()
        self._identity = Identity()
        self._uid_s = -float("inf")
        self._neighbours: tuple[str, ...] = ()
        self._has_company = False
        self._has_shore = False
        self._shore_s: float | None = None  # when a ground station was last heard
        self._parameters = ParameterStore()
        self._disbelieved: set[str] = set()
        self._targets = Targets.empty(skipper.voyage.frame, traffic)
        self._vehicle: VehicleState | None = None
        self._autopilot: AutopilotStatus | None = None
        self._heartbeat_s: float | None = None
        self._mission = MissionOnBoard()
        self._fence: tuple[Zone, ...] = ()  # drawn on the autopilot
        self._mode: Mode | None = None
        self._planner_alive = True
        self._events: list[Event] = []
        self._outcomes: list[Outcome] = []
        self._pace = PRIOR_PACE

    # ------------------------------------------------------------------------------------- inputs
    def objection(self, t_s: float, message: Message) -> Drop | None:
        """Return why a message of the autopilot's system is not to be used, None when it is; asked once for each."""
        return self._witness.objection(t_s, message) if message.get_srcComponent() == AUTOPILOT_COMPONENT else None

    def message(self, t_s: float, message: Message) -> None:
        """Take one message of the autopilot's system, heard at ``t_s``, in the order of arrival."""
        try:
            self._message(t_s, message)
        except Exception as error:
            kind = message.get_type()
            self._disbelieve(f"fault in {kind}", f"a {kind} could not be digested and was left out: {error!r}")

    def _message(self, t_s: float, message: Message) -> None:
        if message.get_srcComponent() == AUTOPILOT_COMPONENT:
            kind = message.get_type()
            if kind == "HEARTBEAT" and is_autopilot_heartbeat(message):
                if self._heartbeat_s is not None and t_s - self._heartbeat_s > GAP_S:
                    self._identity = self._identity.doubted()
                self._heartbeat_s = t_s
            elif kind == "PARAM_VALUE":
                self.parameters(
                    {message.param_id: float(message.param_value)},
                    is_set=(message.param_index == _NO_INDEX and self.state.voyage.sailing),
                )
            elif kind == "AUTOPILOT_VERSION":
                self._uid_s = t_s
                told = autopilot_version(message)
                self._parameters.tell_version(told.version)
                self._identity = self._identity.with_uid(message.get_srcSystem(), told.uid)
        reboots = self.assembler.reboots
        values = self.assembler.take(t_s, message)
        if self.assembler.reboots != reboots:
            self._rebooted()
        for value in values:
            self.take(value)

    def _rebooted(self) -> None:
        self._events.append(AutopilotRebooted())
        self._mission = MissionOnBoard()
        self._identity = self._identity.doubted()
        self._parameters.doubt()

    def take(self, value: Value) -> None:
        """Take one decoded value, in the order of time."""
        if isinstance(value, VehicleState):
            self._vehicle = value
            self._air.room.update(value)
        elif isinstance(value, WindSample | ApparentWind):
            self._air.take(value)
        elif isinstance(value, AutopilotStatus):
            self._take_status(value)
        elif isinstance(value, StatusText):
            self._events.append(value)
        elif isinstance(value, AisReport):
            own = self._vehicle
            self._targets = (
                self._targets.heard(value)
                if own is None
                else self._targets.heard(
                    value, self.skipper.voyage.frame.en_from_geo(own.position), own.velocity_en_mps
                )
            )

    def take_outcome(self, t_s: float, outcome: Outcome) -> None:
        """Take the outcome of an earlier action, known at ``t_s``."""
        if isinstance(outcome, ReadOutcome) and outcome.items is not None:
            self._mission = MissionOnBoard(items=outcome.items, read_t_s=t_s)
        self._outcomes.append(outcome)

    def fence(self, items: tuple[MissionItem, ...]) -> None:
        """Take what is drawn on the autopilot as its fence; what of it cannot be is said and left out."""
        findings = Findings()
        self._fence, _ = items_to_zones(items, findings, first=1)
        for finding in findings:
            self._disbelieve(f"fence {finding.place}", f"the fence on the autopilot, {finding.place}: {finding.text}")

    def sounded(self, t_s: float, ping_m: float | None, most_m: float) -> None:
        """Take a ping of a sounder that the companion hears itself: below its transducer [m], None without an echo."""
        for value in self.assembler.sounded(t_s, ping_m, most_m):
            self.take(value)

    def event(self, event: Event) -> None:
        """Take something that happened outside the autopilot's messages: an order of the crew."""
        self._events.append(event)

    def parameters(self, values: Mapping[str, float], *, is_set: bool = False) -> None:
        """Take parameters of the autopilot (ArduPilot's names and units).

        One that cannot be is said and left out. One that was known and has changed is asked for again, and believed
        when it is told twice; so is one that was not known and ``is_set``, it seems. What was learned by another value
        is forgotten.
        """
        good, refused, changes = self._parameters.take(values, is_set=is_set)
        for why in refused:
            self._disbelieve(why.split()[0], f"the autopilot's {why}: not used")
        self._identity = self._identity.with_parameters(good)
        if any(name.startswith("WNDVN_") for name in good):
            self._air.room.set_parameters(self._parameters.values)
        for change in changes:
            self._changed(change)

    def _changed(self, change: ParameterChange) -> None:
        """Say that a parameter was set, and forget what was learned by another value of it."""
        before = "a value that was not known" if change.before is None else f"{change.before:g}"
        text = f"{change.name} was set from {before} to {change.after:g} ({change.effect.value})"
        learns = ""
        if change.effect in {Effect.WIND, Effect.HEADING}:
            self._anew, self._anew_s = text, None
            self.vane = VaneCheck(self.skipper.voyage.boat.polar.speed_mps)
            if change.name == VANE_OFFSET and change.after == self.state.vane.written_deg:
                self._sure_wind = self._offset_rad = None  # it was told by a vane that was turned
            elif change.name == VANE_OFFSET and change.before is not None:
                self._offset_rad = (self._offset_rad or 0.0) + math.radians(change.after - change.before)
            elif change.effect is Effect.HEADING:
                self._sure_wind = None  # it was told by another compass
            self._air.begin_anew()
            learns = ": wind, current and polar are learned anew"
        elif change.effect is Effect.BOAT:
            learns = ": current and polar are learned anew"
        if learns:
            boat = self.skipper.voyage.boat
            self.current = CurrentEstimator(boat.polar.speed_mps, self._prior, speed_error=boat.told_speed_error)
        self._events.append(ParameterChanged(name=change.name, text=text + learns))

    @property
    def unread(self) -> tuple[str, ...]:
        """The parameters that were not told yet, or once with another value: to be asked for."""
        return self._parameters.unread

    def wants_uid(self, t_s: float) -> bool:
        """Return whether the autopilot is to be asked who it is."""
        is_known = self._identity.is_confirmed and self.state.vehicle.uid in {None, self._identity.uid}
        return not is_known or t_s - self._uid_s >= UID_EVERY_S

    def others(self, neighbours: tuple[str, ...], *, has_company: bool, has_shore: bool) -> None:
        """Take who else is heard: autopilots, where ours was not named, another companion, a ground station."""
        self._neighbours, self._has_company, self._has_shore = neighbours, has_company, has_shore

    def _disbelieve(self, what: str, text: str) -> None:
        """Say once that something heard is not used."""
        if what not in self._disbelieved:
            self._disbelieved.add(what)
            self._events.append(Disbelieved(what=what, text=text))

    def planner_alive(self, alive: bool) -> None:
        """Note whether the planner's process lives."""
        self._planner_alive = alive

    def _take_status(self, status: AutopilotStatus) -> None:
        if status.mode is not None and status.mode != self._mode:
            self._events.append(ModeChanged(before=self._mode, after=status.mode))
            self._mode = status.mode
        self._autopilot = status

    # -------------------------------------------------------------------------------------- step
    def tick(self, t_s: float) -> Step:
        """Step the skipper at ``t_s``."""
        shift = self._follow()
        snapshot = self._snapshot(t_s)
        self._events, self._outcomes = [], []
        was_used = self.state.afloat.known.is_used
        self.state, actions = self.skipper.step(self.state, snapshot)
        voyage = self.skipper.sailed(self.state, snapshot.limits)
        if self.state.afloat.known.is_used != was_used:
            self._pace = PRIOR_PACE  # it is a share of the speeds of another boat
        self._pace = paced(self._pace, snapshot, self.state, voyage)
        return Step(
            snapshot=snapshot,
            state=self.state,
            actions=actions,
            voyage=voyage,
            shift=shift,
            pace=self._pace,
            is_off_plan=is_off_plan(snapshot, self.state, self.skipper.config),
        )

    def _follow(self) -> Shift | None:
        """Replace the frame by one about the boat when it has left its water; None: it has not."""
        here = None if self._vehicle is None else self._vehicle.position
        if self._waters is None or here is None or not self.skipper.leaves_water(self.state, here):
            return None
        before = self.skipper.voyage.frame
        self.skipper, self.state = self.skipper.in_water(self._waters(here), self.state)
        self._targets = self._targets.in_frame(self.skipper.voyage.frame)
        return Shift(before, self.skipper.voyage.frame)

    def _snapshot(self, t_s: float) -> Snapshot:
        vehicle, autopilot = self._vehicle, self._autopilot
        if self._has_shore:
            self._shore_s = t_s
        wind = self._air.view(t_s)
        now = self._sailing(t_s, wind)
        self.current.update(t_s, self._utc_s(t_s), now)
        self._check_vane(now)
        self._air.room.contradict(self.current.motion_doubt if self.current.doubts_wind else "")
        unsure = self._unsure(t_s, wind)
        return Snapshot(
            t_s=t_s,
            vehicle=vehicle,
            vehicle_age_s=None if vehicle is None else t_s - vehicle.t_s,
            position_en_m=None if vehicle is None else self.skipper.voyage.frame.en_from_geo(vehicle.position),
            autopilot=autopilot,
            autopilot_age_s=None if autopilot is None else t_s - autopilot.t_s,
            heartbeat_age_s=None if self._heartbeat_s is None else t_s - self._heartbeat_s,
            wind=wind,
            current=self.current.view(),
            doubt=self.current.doubt(),
            speed_seen=self._pace.seen_speed,
            unsure=unsure,
            vane=self.vane.view(),
            vane_offset_rad=self._vane_offset_rad,
            wind_before=self._wind_before(wind, unsure=unsure),
            mission=self._mission,
            identity=replace(
                self._identity,
                vehicle_type=None if autopilot is None else autopilot.vehicle_type,
                is_contested=self._witness.clock.is_contested(t_s),
            ),
            neighbours=self._neighbours,
            has_company=self._has_company,
            shore_age_s=None if self._shore_s is None else t_s - self._shore_s,
            limits=self._parameters.limits,
            fence=self._fence,
            permissions=self.permissions,
            planner_alive=self._planner_alive,
            traffic=self._targets.picture(t_s) if self._targets.last_heard_s is not None else None,
            events=tuple(self._events),
            outcomes=tuple(self._outcomes),
        )

    def _unsure(self, t_s: float, wind: WindEstimate) -> str:
        """Return why neither wind nor water may be planned with now, in words; empty: they may.

        A wind that is learned anew is believed when the boat has sailed by it as it should, or has not told for long.
        """
        if self._anew_s is None:
            self._anew_s = t_s
        is_told = self.current.fits_s >= FITS_S or t_s - self._anew_s >= UNTOLD_S
        if self.current.motion_doubt or (is_told and wind.record_s >= self.skipper.config.wind_settle_s):
            self._anew = ""
        return f"{self._anew}: the wind is learned anew" if self._anew else self.current.motion_doubt

    def _check_vane(self, now: Sailing | None) -> None:
        """Hold the vane against how the boat sails; a direction that leapt is another's, of a vane or a wind."""
        leapt_rad = self.current.wind_before_rad
        if leapt_rad is not None and not self._has_leapt:
            self.vane.forget()
        self._has_leapt = leapt_rad is not None
        expected = self.current.expected_en_mps
        self.vane.update(now, expected)

    @property
    def _vane_offset_rad(self) -> float | None:
        """The offset that the autopilot adds to what its vane says; None: it was not read, or it adds none."""
        values = self._parameters.values
        offset_deg = values.get(VANE_OFFSET)
        return None if offset_deg is None or values.get(VANE_TYPE) not in OFFSET_TYPES else math.radians(offset_deg)

    def _wind_before(self, wind: WindEstimate, *, unsure: str) -> WindBefore | None:
        """Return the wind as it was before it came to be doubted, None while it is believed or where that is not known.

        It is known where the vane's offset was changed, and where the direction leapt.
        """
        if not unsure:
            self._offset_rad = None
            if wind.health is WindHealth.GOOD and wind.mean_twd_from_rad is not None and wind.mean_tws_mps is not None:
                self._sure_wind = wind.mean_twd_from_rad, wind.mean_tws_mps
            return None
        now_rad, leapt_rad, sure = wind.present_twd_from_rad, self.current.wind_before_rad, self._sure_wind
        if sure is not None and self._offset_rad is not None:
            return WindBefore(twd_from_rad=sure[0], tws_mps=sure[1], turned_rad=wrap_pi(self._offset_rad))
        if sure is not None and leapt_rad is not None and now_rad is not None:
            return WindBefore(twd_from_rad=leapt_rad, tws_mps=sure[1], turned_rad=wrap_pi(now_rad - leapt_rad))
        return None

    def _utc_s(self, t_s: float) -> float | None:
        """Return the Unix time at ``t_s`` by the autopilot's clock, None before it knows the time."""
        return None if self._autopilot is None else self._autopilot.unix_s(t_s)

    def _sailing(self, t_s: float, wind: WindEstimate) -> Sailing | None:
        """Return what the present tells of the current, None without a position or a wind."""
        vehicle, status = self._vehicle, self._autopilot
        if vehicle is None or wind.present_twd_from_rad is None or wind.present_tws_mps is None:
            return None
        is_driven = (
            self.skipper.config.sails
            and not self.state.adrift.motor
            and status is not None
            and status.is_armed
            and status.mode in _SAILS
            and (
                wind.health in {WindHealth.GOOD, WindHealth.LIGHT, WindHealth.UNTRUSTED}
                or self.current.doubts_wind
                or (self._anew != "" and wind.health is WindHealth.SETTLING)
            )
        )
        return Sailing(
            t_s=vehicle.t_s,
            velocity_en_mps=vehicle.velocity_en_mps,
            heading_rad=vehicle.heading_rad,
            twd_from_rad=wind.present_twd_from_rad,
            tws_mps=wind.present_tws_mps,
            is_driven=is_driven,
            is_heard=wind.health is not WindHealth.UNTRUSTED or self.current.doubts_wind,
            age_s=t_s - vehicle.t_s,
            roll_rad=vehicle.roll_rad,
        )


def begun(skipper: Skipper, persisted: Persisted | None, waters: Waters | None) -> tuple[Skipper, Persisted | None]:
    """Return the skipper and the saved state in one frame: that of the saved state, where the voyage is a passage.

    The mission's own frame may be another than when it was saved: its start, or its first goal, was moved.
    """
    own = skipper.voyage.frame
    saved = own if persisted is None or persisted.water is None else LocalFrame(persisted.water)
    if waters is not None and (saved != own or not math.isfinite(skipper.voyage.area.reach_m)):
        skipper = replace(skipper, voyage=waters(saved.origin))
    if persisted is not None and waters is None and saved != own:
        persisted = replace(carried(persisted, Shift(saved, own)), water=None)
    return skipper, persisted
