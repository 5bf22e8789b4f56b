"""The view of a voyage, step by step: live and from its records alike."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import replace

from companion.figures import figure_values as figures_now
from companion.fold import Step
from companion.geo.shift import Shift, carried
from companion.messages import CompanionStatus
from companion.planner import Leg, Plan
from companion.planner.explain import bounds_in_words
from companion.skipper import SkipperConfig, Voyage
from companion.skipper.step import Announce, PlanOutcome, RequestPlan
from companion.skipper.way import PointEn
from companion.telemetry.folder import VoyageFigures
from companion.telemetry.status import CLOCK_OFF_S
from companion.view import parts, values
from companion.view.area import area_of
from companion.view.events import Event, happenings, nearest_of
from companion.view.parts import (
    SAME_M,
    Chosen,
    laylines_of,
    no_go_of,
    plan_of,
    polar_of,
    predicted_of,
    safe_end_of,
    vessels_of,
    water_of,
    wind_of,
)
from companion.view.values import place, rounded, tack_of

TRACK_S = 60.0  # of the track that each view brings: what a page missed while its link was lost
TRACK_STEP_S = 3.0
PLANS_KEPT = 4  # a route may be spliced from as many


class ViewFold:
    """Turns steps into views and events. ``epoch_s``: the Unix time [s] of the voyage's t_s = 0, None: not known.

    Where that is off the autopilot's clock, which GPS sets and by which it is dark, the autopilot's is shown.
    """

    def __init__(
        self, voyage: Voyage, config: SkipperConfig, *, source: values.Source = "live", epoch_s: float | None = None
    ) -> None:
        self.area = area_of(voyage, config.margin_m, config.tide)
        self._voyage, self._config, self._source, self._epoch_s = voyage, config, source, epoch_s
        self._asked: dict[int, tuple[float, RequestPlan]] = {}
        self._plans: dict[int, Chosen] = {}
        self._whys: dict[int, str] = {}
        self._nearest: dict[int, str] = {}
        self._phase, self._phase_s = "", 0.0
        self._said: dict[str, str] = {}
        self._track: deque[tuple[float, PointEn, values.Tack | None]] = deque()
        self._number = 0

    def unix_s(self, t_s: float) -> float | None:
        """Return the Unix time at ``t_s`` [s]."""
        return None if self._epoch_s is None else round(self._epoch_s + t_s, 3)

    def take(
        self, step: Step, status: CompanionStatus, figures: VoyageFigures
    ) -> tuple[values.View, tuple[Event, ...]]:
        """Return the view at a step, and what happened in it."""
        t_s = step.snapshot.t_s
        boat_s = step.snapshot.unix_s(t_s)
        if boat_s is not None and (self._epoch_s is None or abs(boat_s - t_s - self._epoch_s) >= CLOCK_OFF_S):
            self._epoch_s = boat_s - t_s
        self._follow(step.voyage)
        self._note(step)
        events = []
        for found in happenings(step, self._phase, self._whys, self._nearest):
            self._number += 1
            events.append(
                Event(
                    number=self._number,
                    t_s=round(t_s, 2),
                    unix_s=self.unix_s(t_s),
                    kind=found.kind,
                    level=found.level,
                    title=found.title,
                    text=found.text,
                    facts=found.facts,
                )
            )
        if step.state.phase.value != self._phase:
            self._phase, self._phase_s = step.state.phase.value, t_s
        return self._view(step, status, figures), tuple(events)

    def _follow(self, voyage: Voyage) -> None:
        """Draw another water when the frame has moved along with the boat."""
        shift, self._voyage = Shift(self._voyage.frame, voyage.frame), voyage
        if shift.before == shift.after:
            return
        self.area = area_of(voyage, self._config.margin_m, self._config.tide)
        self._track = deque((t_s, place(shift.point(at)), tack) for t_s, at, tack in self._track)
        self._plans = {
            number: replace(chosen, plan=carried(chosen.plan, shift)) for number, chosen in self._plans.items()
        }

    def _note(self, step: Step) -> None:
        """Keep what later views need: plans, what was said, the track."""
        for action in step.actions:
            if isinstance(action, RequestPlan):
                self._asked = {action.request_id: (step.snapshot.t_s, action)}
            elif isinstance(action, Announce):
                self._said[action.code] = action.text
        for outcome in step.snapshot.outcomes:
            asked = self._asked.get(outcome.request_id) if isinstance(outcome, PlanOutcome) else None
            plan = outcome.plan if isinstance(outcome, PlanOutcome) else None
            if asked is not None and plan is not None and plan.has_path:
                t_s, request = asked
                made = step.state.plans.made
                numbers = _leg_numbers(step, plan)
                self._plans[made] = Chosen(
                    t_s=t_s,
                    reason=request.reason.value,
                    plan=plan,
                    why=bounds_in_words(request.problem, plan, numbers),
                    is_numbered=bool(numbers),
                )
                self._plans = dict(list(self._plans.items())[-PLANS_KEPT:])
                self._whys = {number: chosen.why for number, chosen in self._plans.items()}
                self._nearest = {made: nearest_of(request.problem, plan)}
        here, t_s = step.snapshot.position_en_m, step.snapshot.t_s
        if here is not None and (not self._track or t_s - self._track[-1][0] >= TRACK_STEP_S):
            self._track.append((t_s, place(here), self._tack(step)))
        while self._track and t_s - self._track[0][0] > TRACK_S:
            self._track.popleft()

    @staticmethod
    def _tack(step: Step) -> values.Tack | None:
        vehicle, twd_rad = step.snapshot.vehicle, step.snapshot.wind.present_twd_from_rad
        if vehicle is None or twd_rad is None:
            return None
        from companion.geo.angles import difference_rad

        return tack_of(difference_rad(twd_rad, vehicle.heading_rad))

    def _view(self, step: Step, status: CompanionStatus, figures: VoyageFigures) -> values.View:
        snapshot, state, voyage, config = step.snapshot, step.state, self._voyage, self._config
        t_s, route = snapshot.t_s, step.state.mission.route
        # a loiter that nobody planned has the number of the plan before it, and none of its reasons
        chosen = None if route is None or route.cost_s is None else self._plans.get(route.plan_id)
        admitted = 0 if route is None else route.plan_id  # what was made since is not on board
        spliced = (known.plan.legs for number, known in reversed(self._plans.items()) if number <= admitted)
        legs: tuple[Leg, ...] = tuple(leg for of_plan in spliced for leg in of_plan)
        goals = parts.goals_of(step, voyage)
        following = next((g for g in goals if g.is_next), None)
        sought = None if following is None else (following.name, following.at_en_m)
        if route is not None and route.bound_for:  # an order, or a refuge, leads elsewhere
            sought = (route.bound_for, route.points_en_m[-1])
        eta = step.eta()
        ages = [a for a in (snapshot.heartbeat_age_s, snapshot.vehicle_age_s) if a is not None]
        return values.View(
            source=self._source,
            name=voyage.name,
            t_s=round(t_s, 3),
            unix_s=self.unix_s(t_s),
            area=self.area.hash,
            age_s=rounded(min(ages), 1) if ages else None,
            state=parts.state_of(step, self._phase_s),
            alarms=parts.alarms(step, status, self._said),
            boat=parts.boat_of(step, status, voyage),
            wind=wind_of(step),
            water=water_of(step),
            no_go=no_go_of(step, voyage, config),
            laylines=None if sought is None or state.voyage.over else laylines_of(step, voyage, config, *sought),
            polar=polar_of(step, voyage, config),
            plan=plan_of(step, voyage, eta, chosen, legs),
            predicted=predicted_of(eta),
            track=tuple(
                values.TrackPoint(ago_s=round(t_s - at_s, 1), at_en_m=at, tack=tack) for at_s, at, tack in self._track
            ),
            vessels=vessels_of(step),
            goals=goals,
            refuges=parts.refuges_of(voyage),
            home=parts.home_of(step, voyage),
            safe_end=safe_end_of(route),
            orders=parts.orders_of(step),
            figures=parts.figures_of(step, figures, voyage),
            shown=parts.shown(figures_now(step, "page")),
            health=parts.health_of(step, status),
        )


def _leg_numbers(step: Step, plan: Plan) -> tuple[int, ...]:
    """Return the numbers of a new plan's legs in the mission that it was spliced into; empty: it is in none."""
    state = step.state
    routes = (None if state.pending.upload is None else state.pending.upload.route, state.plans.ready_route)
    route = next((r for r in (*routes, state.mission.route) if r is not None and r.plan_id == state.plans.made), None)
    if route is None:
        return ()
    ends = route.points_en_m[:-1]  # behind them is the loiter
    at, numbers = max(0, len(ends) - len(plan.legs)), []
    for leg in plan.legs:  # one of no length has no item: it is the next one's
        at = next((n for n in range(at, len(ends)) if math.dist(ends[n], leg.to_en) < SAME_M), at)
        numbers.append(at + 1)
    return tuple(numbers)


def aged(view: values.View, passed_s: float) -> values.View:
    """Return a view with ``passed_s`` more on its age: of a link that has fallen silent."""
    return view if view.age_s is None else replace(view, age_s=round(view.age_s + passed_s, 1))
