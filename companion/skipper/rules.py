"""The skipper: ``step(state, snapshot) -> (state, actions)``, a pure fold over a voyage's snapshots.

The order of a step: see whose autopilot it is, take in what happened, find the boat on its route, look at the
watchdogs, then act by who has the boat: nobody yet (start), somebody else (operator), we (sail).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from companion.frozen import changed
from companion.geo.shift import Shift
from companion.messages import GeoPoint, Mode
from companion.orders import Wanted
from companion.skipper.board.custody import judge, stand_by
from companion.skipper.board.on_board import mission_is_known
from companion.skipper.composed import follow_field
from companion.skipper.deeds.adrift import follow_ground
from companion.skipper.deeds.brake import brakes
from companion.skipper.deeds.doubt import follow
from companion.skipper.deeds.failsafe import follow_answer, follow_stops, keeps_off, take_over
from companion.skipper.deeds.helm import is_busy
from companion.skipper.deeds.launch import finished, launch, start
from companion.skipper.deeds.ordered import holds_ashore, leaves_alone, take_orders
from companion.skipper.deeds.preview import preview
from companion.skipper.deeds.sailing import sail
from companion.skipper.intake import (
    count_time,
    locate,
    notice_truncation,
    remember_fix,
    take_events,
    take_outcomes,
)
from companion.skipper.planning.errands import speak_of_fence
from companion.skipper.planning.ladder import rungs
from companion.skipper.planning.track import TRACKS_M
from companion.skipper.step.actions import Action, CancelPlan, RequestPlan, Severity
from companion.skipper.step.causes import PERSON
from companion.skipper.step.config import SkipperConfig
from companion.skipper.step.saved import Persisted
from companion.skipper.step.snapshot import Snapshot
from companion.skipper.step.state import (
    PATIENT,
    Adrift,
    ByField,
    LoadedMission,
    Orders,
    Phase,
    Planning,
    PositionState,
    Signs,
    SkipperState,
    VehicleIdentity,
    VoyageState,
    saved_of,
    standing_saved,
)
from companion.skipper.step.tacking import Tacking
from companion.skipper.step.turn import Turn
from companion.skipper.step.water import in_water
from companion.skipper.watch.charge import follow_charge
from companion.skipper.watch.lookout import look_out
from companion.skipper.watch.stopped import speak_of_stop
from companion.skipper.watch.tacks import watch_tacks
from companion.skipper.watch.watch import watch
from companion.skipper.watch.water import watch_water
from companion.skipper.way.gates import gates_of
from companion.skipper.way.voyage import Voyage

REBOOT_RACE_S = 15.0     # a mode change this long before a reboot shows was the reboot, not the operator


@dataclass(frozen=True, slots=True, kw_only=True)
class Skipper:
    """The rules for one voyage. No state of its own: everything is in ``SkipperState``."""

    voyage: Voyage
    config: SkipperConfig

    def initial(self, persisted: Persisted | None = None, known: tuple[str, ...] = ()) -> SkipperState:
        """Return the first state.

        With ``persisted`` the mission on the autopilot may be adopted by its content; ``known`` are the hashes of lists
        that earlier voyages of ours may have left there.
        """
        if persisted is None:
            return SkipperState(mission=LoadedMission(known=known))
        if not self.fits(persisted):
            return SkipperState(
                why="the saved state is of another voyage", mission=LoadedMission(known=(*known, *persisted.names)))
        return SkipperState(
            vehicle=VehicleIdentity(uid=persisted.uid, system=persisted.system),
            mission=LoadedMission(adoptable=persisted, known=known),
            voyage=VoyageState(
                under_way_s=persisted.under_way_s, arrived=persisted.arrived, set_sail_utc_s=persisted.set_sail_utc_s),
            orders=Orders(standing=persisted.standing, skipped=persisted.skipped),
            position=PositionState(place=persisted.place, restored=persisted.place),
            tacking=Tacking(tried=persisted.tacks[0], failed=persisted.tacks[1]),
            plans=Planning(latency=persisted.latency))

    def fits(self, persisted: Persisted) -> bool:
        """Return whether a saved state is one of this voyage."""
        gates = [persisted.gate, *(g + 1 for route in persisted.lists for g in route.gate_of)]
        return persisted.voyage == self.voyage.name and max(gates) <= len(gates_of(self.voyage, persisted.approaches))

    def has_arrived(self, persisted: Persisted) -> bool:
        """Return whether a saved state is one of this voyage, sailed to its end."""
        return self.fits(persisted) and persisted.arrived

    def step(self, state: SkipperState, snapshot: Snapshot) -> tuple[SkipperState, tuple[Action, ...]]:
        """Return the next state and what to do now. Call it about once a second, always, whatever is missing."""
        turn = Turn(self.voyage, self.config, state, snapshot)
        judge(turn)
        take_events(turn)
        follow(turn)
        take_outcomes(turn)
        follow_stops(turn)
        follow_answer(turn)
        follow_ground(turn)
        follow_field(turn)
        locate(turn)
        look_out(turn)
        count_time(turn)
        follow_charge(turn)
        watch_water(turn)
        watch_tacks(turn)
        fresh = watch(turn)
        take_orders(turn)
        _decide(turn, fresh)
        speak_of_stop(turn)
        speak_of_fence(turn)
        remember_fix(turn)
        return turn.state, tuple(turn.actions)

    def preview(self, state: SkipperState, snapshot: Snapshot, wanted: Wanted) -> RequestPlan | str:
        """Return the plan that an order to sail somewhere would ask for, or why it would ask for none."""
        return preview(Turn(self.voyage, self.config, state, snapshot), wanted)

    def prepare(self) -> None:
        """Grow the obstacles by the margins once, before sailing; on a coast of thousands of points it takes long.

        It changes nothing but the time of the first plans.
        """
        ladders = [rungs(self.config, track_m=track_m) for track_m in TRACKS_M[:2]]   # of winds up to 5 m/s, mostly
        for margin_m in sorted({0.0, *(step.margin_m for ladder in ladders for step in ladder)}):
            self.voyage.area.obstacles_wkt(margin_m)
        self.voyage.area.clearance_m([(0.0, 0.0)])

    def persisted(self, state: SkipperState) -> Persisted:
        """Return what must be on disk before the actions of this step are carried out."""
        water = self.voyage.frame.origin if self.voyage.is_passage else None
        if state.mission.adoptable is not None and (state.mission.foreign or not state.mission.checked):
            return replace(
                state.mission.adoptable, standing=standing_saved(state), skipped=state.orders.skipped, water=water)
        return replace(saved_of(state, self.voyage.name), water=water)

    def leaves_water(self, state: SkipperState, here: GeoPoint) -> bool:
        """Return whether the frame is to be replaced by one about ``here``, where the boat is.

        Not while a plan is being made: it would come in metres of the frame that it was asked for in. Not for a
        position that has just jumped, which may be false.
        """
        voyage = self.voyage
        if voyage.recentre_m is None or state.pending.plan is not None:
            return False
        en_m = voyage.frame.en_from_geo(here)
        if math.hypot(*en_m) <= voyage.recentre_m:
            return False
        last = state.position.last_seen
        return last is None or (state.position.doubt is None and math.dist(en_m, last.en_m) <= voyage.recentre_m)

    def in_water(self, voyage: Voyage, state: SkipperState) -> tuple[Skipper, SkipperState]:
        """Return the skipper and the state in the metres of ``voyage``'s frame."""
        return replace(self, voyage=voyage), in_water(state, Shift(self.voyage.frame, voyage.frame))


def _decide(turn: Turn, fresh: tuple[str, ...]) -> None:
    state = turn.state
    if state.vehicle.rebooted:
        _rebooted(turn)
    if turn.autopilot is None:
        age = turn.snapshot.heartbeat_age_s
        heard = "nothing yet" if age is None else f"silent for {age:.0f} s; what it has on board sails on"
        phase = Phase.WAITING if not state.voyage.sailing else turn.state.phase
        turn.phase(phase, f"waiting to hear the autopilot: {heard}")
        return
    if stand_by(turn) or leaves_alone(turn) or keeps_off(turn) or _operator_has_it(turn):
        return
    notice_truncation(turn)
    if not mission_is_known(turn):
        if turn.state.operator.is_back and not turn.state.mission.foreign:
            brakes(turn)   # a mode changes no mission, and a step may be all that is left of the water
        return
    if holds_ashore(turn):
        return
    if turn.gate is None and not turn.state.voyage.sailing:
        finished(turn)
    elif turn.state.mission.route is None:
        start(turn)
    elif not turn.state.voyage.sailing:
        launch(turn)
    else:
        sail(turn, fresh)


def _rebooted(turn: Turn) -> None:
    """Begin again after the autopilot's reboot: the mission is compared, mode and arming are gone."""
    since = turn.state.operator.since_s
    keeps = turn.state.phase is Phase.OPERATOR and since is not None and turn.t_s - since > REBOOT_RACE_S
    turn.set(
        mission=changed(turn.state.mission, checked=False, read_since_s=turn.t_s),
        steering=changed(turn.state.steering, own_mode=None, until_s=None),
        pending=changed(turn.state.pending, command=None),
        by_field=ByField(),
        operator=changed(turn.state.operator, answering="", stop=None, signs=Signs()),
        adrift=Adrift())
    if not keeps:
        turn.set(voyage=changed(turn.state.voyage, sailing=False), operator=changed(turn.state.operator, since_s=None))
        turn.phase(Phase.WAITING, "the autopilot rebooted: waiting for its mission to be read")


def _operator_has_it(turn: Turn) -> bool:
    """Notice that somebody else has the boat, and that it is given back. Nothing is asked of it meanwhile."""
    status, state = turn.autopilot, turn.state
    if status is None or not state.voyage.sailing or state.mission.foreign:
        return False  # a stranger's mission is not an operator's mode: ``mission_is_known`` stands by it
    gone = turn.is_taken
    if state.phase is not Phase.OPERATOR:
        if not gone:
            held = state.steering.until_s is not None or state.by_field.resort.engaged or turn.steers or (
                state.steering.own_mode is Mode.LOITER and is_busy(turn, Mode.LOITER.name))
            if status.mode is Mode.AUTO and state.steering.own_mode is not None and not held:
                turn.set(steering=changed(turn.state.steering, own_mode=None))
            return False
        if state.pending.plan is not None:
            turn.act(CancelPlan(request_id=state.pending.plan.request_id))
        turn.set(
            operator=changed(turn.state.operator, since_s=turn.t_s),
            pending=changed(turn.state.pending, plan=None, command=None),
            steering=changed(turn.state.steering, own_mode=None, until_s=None),
            by_field=ByField())
        if take_over(turn):
            return False
        turn.phase(Phase.OPERATOR, f"{_taken(turn)}, not by us: the companion does nothing until AUTO comes back")
        turn.say(Severity.NOTICE, "operator", turn.state.why, every_s=0.0)
        return True
    if gone or status.mode is not Mode.AUTO:
        if gone and take_over(turn):   # its sign came later than the change of mode
            return False
        turn.phase(Phase.OPERATOR, f"{_taken(turn)}: waiting for AUTO")
        return True
    since = state.operator.since_s if state.operator.since_s is not None else turn.t_s
    turn.set(
        operator=changed(turn.state.operator, since_s=None, is_back=True, answering="", given_back_s=turn.t_s),
        mission=changed(turn.state.mission, checked=False, read_since_s=turn.t_s),
        plans=changed(turn.state.plans, retry=PATIENT),
        progress=changed(turn.state.progress, history=()))
    turn.phase(Phase.WAITING, "AUTO is back: waiting for the mission on board to be compared")
    turn.say(Severity.NOTICE, "operator back", f"AUTO is back after {turn.t_s - since:.0f} s", every_s=0.0)
    return False


def _taken(turn: Turn) -> str:
    """Return in words what she was put into, and by which failsafe if by one."""
    status, stop = turn.autopilot, turn.state.operator.stop
    mode = status.mode.name if status is not None and status.mode is not None else "unknown"
    what = f"mode {mode}" if status is None or status.is_armed else f"mode {mode}, disarmed"
    return what if stop is None or stop.cause == PERSON else f"{what} by the {stop.cause} failsafe"
