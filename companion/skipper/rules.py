"""The skipper: ``step(state, snapshot) -> (state, actions)``, a pure fold over a voyage's snapshots.

The order of a step: see whose autopilot it is, take in what happened, find the boat on its route, look at the
watchdogs, take orders, then let the first behavior act that has something to do (``companion.skipper.priorities``).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from companion.boat import Afloat, AutopilotLimits
from companion.geo.shift import Shift
from companion.messages import GeoPoint
from companion.orders import Wanted
from companion.skipper.behaviors.drifting import follow_ground
from companion.skipper.behaviors.failsafe import begin_again, follow_answer, follow_stops
from companion.skipper.behaviors.fallback import follow_fallback
from companion.skipper.behaviors.field_guidance import follow_field
from companion.skipper.behaviors.launch import leave_start
from companion.skipper.behaviors.operator_orders import preview, take_orders
from companion.skipper.behaviors.position_doubt import follow
from companion.skipper.behaviors.shoaling import follow_soundings
from companion.skipper.board.resumed import leg_under_way, resumed, saved_goals
from companion.skipper.board.vehicle_identity import judge
from companion.skipper.intake import count_time, locate, remember_fix, take_events, take_outcomes
from companion.skipper.planning.diversions import follow_place, speak_of_fence
from companion.skipper.planning.ladder import rungs
from companion.skipper.planning.track import TRACKS_M
from companion.skipper.priorities import act
from companion.skipper.step import Action, Persisted, RequestPlan, SkipperConfig, SkipperState, Snapshot, StepContext
from companion.skipper.step.context import with_known_boat
from companion.skipper.step.state import (
    LoadedMission,
    Orders,
    Planning,
    PositionState,
    Soundings,
    Tacking,
    VehicleIdentity,
    VoyageState,
    in_water,
    saved_of,
    standing_saved,
)
from companion.skipper.watch.boat_learning import learn_boat
from companion.skipper.watch.measures import follow_charge
from companion.skipper.watch.tacks import watch_tacks
from companion.skipper.watch.watch import look_out, speak_of_stop, watch, watch_water
from companion.skipper.way import Voyage, gates_of


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
                why="the saved state is of another voyage", mission=LoadedMission(known=(*known, *persisted.names))
            )
        known = known if not self.change_of(persisted) else (*known, *persisted.names)
        persisted, _ = resumed(self.voyage, persisted)
        return SkipperState(
            vehicle=VehicleIdentity(uid=persisted.uid, system=persisted.system),
            mission=LoadedMission(adoptable=persisted, known=known),
            voyage=VoyageState(
                under_way_s=persisted.under_way_s, arrived=persisted.arrived, set_sail_utc_s=persisted.set_sail_utc_s
            ),
            orders=Orders(standing=persisted.standing, skipped=persisted.skipped),
            position=PositionState(place=persisted.place, restored=persisted.place),
            tacking=Tacking(
                tried=persisted.tacks[0],
                failed=persisted.tacks[1],
                irons_s=persisted.irons_s,
                starboard_lee_mps=persisted.lee_mps[0],
                port_lee_mps=persisted.lee_mps[1],
            ),
            plans=Planning(latency=persisted.latency, made=max((0, *(route.plan_id for route in persisted.lists)))),
            soundings=Soundings(shoals=persisted.shoals),
            afloat=Afloat.of(persisted.afloat),
        )

    def fits(self, persisted: Persisted) -> bool:
        """Return whether a saved state is one of this voyage, its goals changed since or not."""
        kept, _ = resumed(self.voyage, persisted)
        gates = [kept.gate, *(g + 1 for route in kept.lists for g in route.gate_of)]
        return persisted.voyage == self.voyage.name and max(gates) <= len(gates_of(self.voyage, kept.approaches))

    def change_of(self, persisted: Persisted) -> str:
        """Return what is to be said of goals that were changed since a state was saved, "" where none was."""
        return resumed(self.voyage, persisted)[1] if self.fits(persisted) else ""

    def has_arrived(self, persisted: Persisted) -> bool:
        """Return whether a saved state is one of this voyage, sailed to its end."""
        return self.fits(persisted) and resumed(self.voyage, persisted)[0].arrived

    def step(self, state: SkipperState, snapshot: Snapshot) -> tuple[SkipperState, tuple[Action, ...]]:
        """Return the next state and what to do now. Call it about once a second, always, whatever is missing."""
        ctx = StepContext(self.voyage, self.config, state, snapshot)
        observe(ctx)
        act(ctx)
        speak_of_stop(ctx)
        speak_of_fence(ctx)
        remember_fix(ctx)
        return ctx.state, tuple(ctx.actions)

    def sailed(self, state: SkipperState, limits: AutopilotLimits | None) -> Voyage:
        """Return the voyage with the boat that plans are of: her file's, or as she was found to sail."""
        return with_known_boat(self.voyage, self.config, state, limits)

    def preview(self, state: SkipperState, snapshot: Snapshot, wanted: Wanted) -> RequestPlan | str:
        """Return the plan that an order to sail somewhere would ask for, or why it would ask for none."""
        return preview(StepContext(self.voyage, self.config, state, snapshot), wanted)

    def prepare(self) -> None:
        """Grow the obstacles by the margins once, before sailing; on a coast of thousands of points it takes long.

        It changes nothing but the time of the first plans.
        """
        ladders = [rungs(self.config, track_m=track_m) for track_m in TRACKS_M[:2]]  # of winds up to 5 m/s, mostly
        for margin_m in sorted({0.0, *(step.margin_m for ladder in ladders for step in ladder)}):
            self.voyage.area.obstacles_wkt(margin_m)
        self.voyage.area.clearance_m([(0.0, 0.0)])

    def persisted(self, state: SkipperState) -> Persisted:
        """Return what must be on disk before the actions of this step are carried out."""
        water = self.voyage.frame.origin
        kept = state.mission.adoptable if state.mission.foreign or not state.mission.checked else None
        if kept is None:
            saved = saved_of(state, self.voyage.name)
        else:
            saved = replace(kept, standing=standing_saved(state), skipped=state.orders.skipped)
        leg = leg_under_way(self.voyage, saved)
        return replace(saved, water=water, goals=saved_goals(self.voyage), laps=self.voyage.laps, leg=leg)

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


def observe(ctx: StepContext) -> None:
    """Take in what happened since the last step, all that is watched, and what is ordered."""
    judge(ctx)
    take_events(ctx)
    follow(ctx)
    take_outcomes(ctx)
    follow_stops(ctx)
    follow_answer(ctx)
    follow_ground(ctx)
    follow_field(ctx)
    locate(ctx)
    leave_start(ctx)
    look_out(ctx)
    count_time(ctx)
    follow_charge(ctx)
    watch_water(ctx)
    watch_tacks(ctx)
    learn_boat(ctx)
    follow_place(ctx)
    watch(ctx)
    follow_fallback(ctx)
    follow_soundings(ctx)
    take_orders(ctx)
    if ctx.state.vehicle.rebooted:
        begin_again(ctx)
