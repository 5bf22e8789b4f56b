"""The reasons to plan again, in the order of their urgency."""

from __future__ import annotations

import math
from dataclasses import dataclass

from companion.boat.tracking import SHORT_S
from companion.frozen import changed
from companion.geo.angles import difference_rad
from companion.messages import Severity
from companion.skipper.planning.asking import WIDTH_AHEAD_S
from companion.skipper.planning.autopilot_beats import is_left_to_beat, may_restart_leg
from companion.skipper.planning.diversions import (
    AFTER_LAST_GOAL,
    after_last_goal,
    diversion,
    is_composed,
    is_led_to,
    is_shut_off,
    room_behind,
)
from companion.skipper.planning.tides import closes_ahead
from companion.skipper.planning.vessels import meetings
from companion.skipper.planning.waits import waits_for_gun
from companion.skipper.step import Diversion, DiversionKind, Phase, ReplanPolicy, ReplanReason, Route, StepContext
from companion.skipper.step.missions import NO_PLAN, path_length_m
from companion.skipper.way import Gate, PointEn, bearing_rad, distance_m, half_width_rad
from companion.skipper.way.judge import predicted_beat
from companion.traffic import Decision, decide
from companion.traffic.plans import MIN_INTERVAL_S

TOO_LATE_S = SHORT_S + 2.0  # an upload begins the leg anew: what is left of it then must be long enough to be followed
BEND_RAD = math.radians(6.0)  # a smaller change of course at a waypoint is not worth a plan of its own ...
BENDS_RAD = math.radians(25.0)  # a greater one, in all, ends a board
BEND_PLAN_AGE_S = 60.0  # ... unless the last one is this old
FORECAST_SHARE = 0.5  # of the interval that the plan used: a smaller change of the mean does not matter
FORECAST_RAD = math.radians(5.0)
CURRENT_MPS, CURRENT_SHARE = 0.15, 0.25  # a current is another when it differs by so much, and so much of the plan's
CURRENT_INTERVAL_S = 60.0  # its estimate settles within minutes, and each waypoint takes it in anyway
FORECAST_SPEED = 0.3  # share of the wind speed
FORECAST_WIDTH = 1.5  # times as wide, or as narrow, and ...
FORECAST_WIDTH_RAD = math.radians(3.0)  # ... by this much


@dataclass(frozen=True, slots=True, kw_only=True)
class Trigger:
    """A reason to plan now; ``from_index`` None: from the boat. ``urgent`` may replace a plan being made."""

    reason: ReplanReason
    text: str
    from_index: int | None = None
    interval_s: float = 0.0
    urgent: bool = False


def find_trigger(ctx: StepContext, fresh: tuple[str, ...]) -> Trigger | None:
    """Return the most pressing reason to plan again, None when there is none."""
    state, config = ctx.state, ctx.config
    if ctx.boat_en is None or ctx.snapshot.wind.forecast is None or ctx.is_raised("becalmed"):
        return None
    if ctx.snapshot.unsure:
        return None
    bound, route = diversion(ctx), ctx.state.mission.route
    if state.voyage.over if bound is None else not bound.has_place:
        return None
    if state.operator.is_back and state.plans.asked and state.plans.asked_as is ReplanReason.ORDER:
        return Trigger(reason=state.plans.asked_as, text=state.plans.asked)
    if state.operator.is_back:
        cause = state.operator.answering
        text = f"stopped by the {cause} failsafe" if cause else "taken up again from where she is"
        return Trigger(reason=ReplanReason.OPERATOR_BACK, text=text)
    if route is not None and route.plan_id == NO_PLAN:
        # It need not lead to our goals: nothing is planned but another way, and that as soon as the wind is known.
        if ctx.snapshot.wind.record_s < config.wind_settle_s:
            return None
        return Trigger(
            reason=ReplanReason.MISMATCH,
            text="the mission on board is of no plan that is known",
            interval_s=config.min_replan_interval_s,
        )
    changed = _diversion(ctx, bound)
    if changed is not None:
        return changed
    if state.plans.asked:
        return Trigger(reason=state.plans.asked_as, text=state.plans.asked)
    if state.progress.missed_s is not None and bound is None:
        return Trigger(reason=ReplanReason.MISSED_BUOY, text="missed: again", interval_s=config.settle_s)
    boat = ctx.boat_en
    if ctx.drawn is not None and ctx.drawn.cuts([boat, *ctx.ahead()]):
        return Trigger(
            reason=ReplanReason.OBSTACLE,
            text=f"{ctx.drawn.words} cuts the way",
            urgent=True,
            interval_s=config.no_go_replan_interval_s,
        )
    if "fence breach" in fresh:
        return Trigger(reason=ReplanReason.OBSTACLE, text="fence breach", urgent=True)
    if ctx.is_field_steered:
        if is_composed(ctx) and route is not None and ctx.state.progress.gate in route.gate_of:
            return None  # what is on board leads to the goal's place: that is where it goes when it is not steered
        if ctx.asks_fallback:
            interval_s = config.min_replan_interval_s if state.plans.last_s >= state.fallback.since_s else 0.0
            return Trigger(reason=ReplanReason.NO_PROGRESS, text=state.fallback.why, interval_s=interval_s)
        return _at_end(ctx) or _extension(ctx, bound)  # the mission on board need not be the way that is sailed
    trigger = _traffic(ctx) or _tide(ctx)
    if trigger is None and not ctx.is_raised("wind untrusted"):
        trigger = _no_go(ctx)
    trigger = trigger or _position(ctx)
    return trigger or _extension(ctx, bound) or _wind(ctx) or _unsure(ctx) or _waypoint(ctx)


REASONS = {
    DiversionKind.REFUGE: ReplanReason.REFUGE,
    DiversionKind.HOME: ReplanReason.HOME,
    DiversionKind.REST: ReplanReason.REST,
    DiversionKind.GOAL: ReplanReason.ORDER,
    DiversionKind.INSIDE: ReplanReason.OBSTACLE,
    DiversionKind.ROOM: ReplanReason.REST,
    DiversionKind.START: ReplanReason.NEXT_GOAL,
    DiversionKind.BOX: ReplanReason.NEXT_GOAL,
    DiversionKind.STATION: ReplanReason.NEXT_GOAL,
    DiversionKind.FIELD: ReplanReason.RETRY,
}


def _diversion(ctx: StepContext, bound: Diversion | None) -> Trigger | None:
    """The boat is bound for somewhere else than its route leads to: a diversion that begins, or one that is over."""
    route = ctx.state.mission.route
    leads_to = route.bound_for if route is not None else ""
    is_first = ctx.state.plans.retry.failures == 0  # then the wait between two tries counts
    interval_s = 0.0 if is_first else ctx.config.min_replan_interval_s
    if bound is not None and (is_shut_off(ctx) or not is_led_to(ctx, bound)):
        is_urgent = is_first or bound.kind is DiversionKind.ROOM
        return Trigger(reason=REASONS[bound.kind], text=bound.sentence, urgent=is_urgent, interval_s=interval_s)
    is_behind = leads_to in AFTER_LAST_GOAL and after_last_goal(ctx) is not None
    if bound is None and leads_to and not is_behind and not ctx.state.voyage.over:
        return Trigger(
            reason=ReplanReason.NEXT_GOAL,
            text=f"no longer bound for {leads_to}: sailing on",
            urgent=is_first,
            interval_s=interval_s,
        )
    return None


def _traffic(ctx: StepContext) -> Trigger | None:
    """The route meets another vessel (Büsser 5.2: planned again at most every 20 s)."""
    met = meetings(ctx)
    if not met:
        return None
    first = met[0]
    text = f"{first.name}: in {first.time_s:.0f} s {first.depth_m:.0f} m inside the distance to keep"
    ctx.say(Severity.WARNING, "traffic", text)
    since_s = ctx.t_s - ctx.state.plans.last_s
    interval_s = max(MIN_INTERVAL_S, ctx.config.min_replan_interval_s)
    if since_s < interval_s or decide(met, since_replan_s=since_s, urgent_s=0.0) is not Decision.REPLAN:
        return None
    return Trigger(reason=ReplanReason.OBSTACLE, text=text, interval_s=interval_s, urgent=True)


def _tide(ctx: StepContext) -> Trigger | None:
    """The route leads over water that will be too shallow by then."""
    met = closes_ahead(ctx)
    if met is None:
        return None
    text = f"{met.name} is too shallow when she is there, in {met.in_s:.0f} s"
    ctx.say(Severity.WARNING, "tide ahead", text)
    return Trigger(reason=ReplanReason.OBSTACLE, text=text, interval_s=ctx.config.min_replan_interval_s, urgent=True)


def board_end(ctx: StepContext, leg: tuple[PointEn, PointEn]) -> PointEn:
    """Return where the boat turns next: a board is a chain of short legs where the zone that it keeps out of grows."""
    course, before, end = bearing_rad(*leg), *leg
    for point in ctx.ahead()[1:]:
        before, end = end, point
        if distance_m(before, end) > 1e-6 and abs(difference_rad(course, bearing_rad(before, end))) > BENDS_RAD:
            return before
    return end


def _no_go(ctx: StepContext) -> Trigger | None:
    """The present wind has closed the leg: the autopilot will beat in its corridor. How far, and is that clear?"""
    boat, leg, wind, vehicle = ctx.boat_en, ctx.leg(), ctx.wind_now, ctx.snapshot.vehicle
    if boat is None or leg is None or wind is None or vehicle is None or not ctx.ahead():
        ctx.set(plans=changed(ctx.state.plans, no_go_since_s=None))
        return None
    target = board_end(ctx, leg)
    twa = abs(difference_rad(wind[0], bearing_rad(boat, target)))
    is_near = distance_m(boat, target) < ctx.config.announce_m + ctx.speed_mps
    if twa >= ctx.no_go_half_rad or is_near or is_left_to_beat(ctx, *leg):
        ctx.set(plans=changed(ctx.state.plans, no_go_since_s=None))
        return None
    since = ctx.state.plans.no_go_since_s if ctx.state.plans.no_go_since_s is not None else ctx.t_s
    ctx.set(plans=changed(ctx.state.plans, no_go_since_s=since))
    drift = predicted_beat(
        boat,
        vehicle.heading_rad,
        leg[0],
        target,
        twd_from_rad=wind[0],
        no_go_half_rad=ctx.no_go_half_rad,
        corridor_m=ctx.tack_corridor_m,
        area=ctx.voyage.area,
        current_en_mps=ctx.current_en_mps,
        speed_mps=ctx.voyage.boat.polar.speed_mps(ctx.no_go_half_rad, wind[1]),
    )
    floor = min(ctx.config.margin_floor_m, ctx.config.margin_m)
    straight = ctx.voyage.area.path_clearance_m([boat, target])
    text = (
        f"TWA {math.degrees(twa):.0f}° to the waypoint is inside {math.degrees(ctx.no_go_half_rad):.0f}°: "
        f"{drift.off_leg_m:.0f} m off the leg, {drift.clearance_m:.0f} m clear"
    )
    if drift.clearance_m < floor and drift.clearance_m < straight - 1.0 and ctx.t_s - since >= 1.0:
        interval_s = ctx.config.no_go_replan_interval_s
        return Trigger(reason=ReplanReason.NO_GO, text=text, interval_s=interval_s, urgent=True)
    tacks_m = ctx.config.no_go_off_leg_m if ctx.voyage.boat.can_tack else 0.0  # the autopilot's is one that she cannot
    if drift.off_leg_m > tacks_m and ctx.t_s - since >= ctx.config.no_go_patience_s:
        return Trigger(reason=ReplanReason.NO_GO, text=text, interval_s=ctx.config.min_replan_interval_s)
    return None


def _position(ctx: StepContext) -> Trigger | None:
    """The boat is not where the plan has it, or is nowhere on it."""
    if ctx.state.position.doubt is not None:  # with a position all the same: see StepContext.plans_in_doubt
        return Trigger(
            reason=ReplanReason.OFF_LEG,
            text="the position jumped, and the way from there is not clear",
            interval_s=ctx.config.no_go_replan_interval_s,
            urgent=True,
        )
    if ctx.is_raised("off the corridor"):
        return Trigger(reason=ReplanReason.OFF_LEG, text="off the leg", interval_s=_patience_off_leg_s(ctx))
    if ctx.is_raised("no progress"):
        return Trigger(reason=ReplanReason.NO_PROGRESS, text="no progress", interval_s=120.0)
    return _at_end(ctx)


def _at_end(ctx: StepContext) -> Trigger | None:
    """The mission on board is at its end and goals remain."""
    if diversion(ctx) is not None or ctx.state.voyage.over:
        return None
    if ctx.is_raised("mission ended") or not ctx.ahead():
        reason = ReplanReason.RETRY if ctx.state.phase is Phase.HOLDING else ReplanReason.NEXT_GOAL
        return Trigger(reason=reason, text="at the end of the mission with goals left", interval_s=ctx.config.settle_s)
    return None


def _patience_off_leg_s(ctx: StepContext) -> float:
    """Return how long after the last plan the next may be made; less when something stands before the waypoint."""
    boat, leg, config = ctx.boat_en, ctx.leg(), ctx.config
    blocked = (
        boat is not None
        and leg is not None
        and (ctx.voyage.area.path_clearance_m([boat, leg[1]]) < config.margin_floor_m)
    )
    if blocked:
        return config.no_go_replan_interval_s
    return config.min_replan_interval_s


def _wind(ctx: StepContext) -> Trigger | None:
    """Büsser's 20° against the wind that the plan used, outside the interval that it allowed for; and 60 minutes."""
    route, mean, config = ctx.state.mission.route, ctx.wind_mean, ctx.config
    if route is None or mean is None or ctx.is_raised("wind untrusted"):
        return None
    turned = abs(difference_rad(mean[0], route.plan_twd_from_rad))
    if turned > config.wind_change_rad and turned > route.plan_half_width_rad:
        text = (
            f"the 90 s mean has turned {math.degrees(turned):.0f}° from the plan's wind; it allowed for "
            f"±{math.degrees(route.plan_half_width_rad):.0f}°"
        )
        return Trigger(reason=ReplanReason.WIND_SHIFT, text=text, interval_s=config.min_replan_interval_s)
    planned = route.plan_current_east_mps, route.plan_current_north_mps
    changed_mps = distance_m(ctx.current_en_mps, planned)
    if changed_mps > max(CURRENT_MPS, CURRENT_SHARE * math.hypot(*planned)):
        text = f"{ctx.snapshot.current.sentence()}: {changed_mps:.2f} m/s off the plan's"
        return Trigger(
            reason=ReplanReason.CURRENT, text=text, interval_s=max(CURRENT_INTERVAL_S, config.min_replan_interval_s)
        )
    if ctx.t_s - route.plan_t_s > config.plan_age_s:
        return Trigger(
            reason=ReplanReason.PLAN_AGE, text="the plan is 60 minutes old", interval_s=config.min_replan_interval_s
        )
    return None


def _unsure(ctx: StepContext) -> Trigger | None:
    """The wind has become less certain than the plan allowed for; that it became more so can wait for a waypoint."""
    route, config = ctx.state.mission.route, ctx.config
    if route is None or config.replan_policy is not ReplanPolicy.FORECAST or ctx.is_raised("wind untrusted"):
        return None
    width_rad = _width_rad(ctx)
    if not _is_wider(width_rad, route.plan_half_width_rad):
        return None
    text = (
        f"the wind has become less certain: ±{math.degrees(width_rad):.0f}°, the plan allowed for "
        f"±{math.degrees(route.plan_half_width_rad):.0f}°"
    )
    return Trigger(reason=ReplanReason.FORECAST, text=text, interval_s=config.min_replan_interval_s)


def _width_rad(ctx: StepContext) -> float:
    """Return the half width now of the interval that a plan remembers."""
    return half_width_rad(ctx.snapshot.wind.forecast, WIDTH_AHEAD_S, ctx.config.wind_change_level)


def _is_wider(now_rad: float, then_rad: float) -> bool:
    """Return whether an interval is that much wider that plans differ; none is remembered of a stay (0)."""
    return then_rad > 0.0 and now_rad > max(FORECAST_WIDTH * then_rad, then_rad + FORECAST_WIDTH_RAD)


def _extension(ctx: StepContext, bound: Diversion | None) -> Trigger | None:
    """The mission ends soon and goals remain, or the rest of a diversion's way: plan on from its last waypoint."""
    route, boat, last = ctx.state.mission.route, ctx.boat_en, ctx.last_waypoint()
    if route is None or boat is None or last < ctx.state.mission.index:
        return None
    ends = route.gate_of[last]
    if bound is not None or route.bound_for in AFTER_LAST_GOAL:
        bound = bound or after_last_goal(ctx)
        bound = bound and (room_behind(ctx, bound) or bound)
        if bound is None or distance_m(route.points_en_m[last], bound.en_m) <= bound.radius_m + ctx.config.announce_m:
            return None
    elif ends >= len(ctx.gates) - 1 and after_last_goal(ctx) is None:
        return None
    elif 0 <= ends < len(ctx.gates) - 1 and waits_for_gun(ctx, ctx.gates[ends + 1]):
        return None  # where the boat waits is planned for when it is next
    left = path_length_m([boat, *ctx.ahead()])
    if left > (ctx.config.look_ahead_s + ctx.late_s) * max(ctx.speed_mps, 1.0) or not may_restart_leg(ctx):
        return None
    return Trigger(
        reason=ReplanReason.NEXT_GOAL,
        text=f"the mission reaches {left:.0f} m ahead, there is more to sail",
        from_index=last,
        interval_s=ctx.config.settle_s,
    )


def _waypoint(ctx: StepContext) -> Trigger | None:
    """Wolsieffer's rule: near a waypoint, plan again from it with the wind measured since."""
    state, route, boat, leg = ctx.state, ctx.state.mission.route, ctx.boat_en, ctx.leg()
    if route is None or boat is None or leg is None or state.plans.replanned_index >= state.mission.index:
        return None
    if not route.is_planned_from(state.mission.index) or is_buoy(ctx.gate):
        return None  # the tail to the next goal is there already: see _extension
    left_s = distance_m(boat, leg[1]) / max(ctx.speed_mps, 0.3)
    if not TOO_LATE_S + ctx.late_s < left_s <= ctx.config.lead_s + ctx.late_s or ctx.is_raised("wind untrusted"):
        return None
    if not may_restart_leg(ctx):
        return None
    if _is_bend(route, state.mission.index) and ctx.t_s - state.plans.last_s < BEND_PLAN_AGE_S:
        return None
    if ctx.config.replan_policy is ReplanPolicy.FORECAST and not forecast_matters(ctx):
        ctx.set(plans=changed(ctx.state.plans, replanned_index=state.mission.index))
        return None
    reason = ReplanReason.WAYPOINT if ctx.config.replan_policy is ReplanPolicy.WAYPOINT else ReplanReason.FORECAST
    return Trigger(
        reason=reason,
        text=f"waypoint {state.mission.index + 1} in {left_s:.0f} s",
        from_index=state.mission.index,
        interval_s=ctx.config.min_replan_interval_s,
    )


def _is_bend(route: Route, index: int) -> bool:
    """Return whether the course hardly changes at a waypoint before the last: a leg bent as the no-go zone widens."""
    if distance_m(*route.points_en_m[index : index + 2]) < 1.0:
        return False
    before = bearing_rad(route.leg_from_en_m[index], route.points_en_m[index])
    after = bearing_rad(route.points_en_m[index], route.points_en_m[index + 1])
    return abs(difference_rad(after, before)) < BEND_RAD


def forecast_matters(ctx: StepContext) -> bool:
    """Return whether the wind, or its uncertainty, has changed enough against the plan's to be worth an upload."""
    route, mean = ctx.state.mission.route, ctx.wind_mean
    if route is None or mean is None:
        return False
    turned = abs(difference_rad(mean[0], route.plan_twd_from_rad))
    if turned > max(FORECAST_RAD, FORECAST_SHARE * route.plan_half_width_rad):
        return True
    width_rad, planned_rad = _width_rad(ctx), route.plan_half_width_rad
    if _is_wider(width_rad, planned_rad) or _is_wider(planned_rad, width_rad):
        return True
    return abs(mean[1] - route.plan_tws_mps) > FORECAST_SPEED * max(route.plan_tws_mps, 1.0)


def is_buoy(gate: Gate | None) -> bool:
    """Return whether the gate belongs to a buoy."""
    return gate is not None and gate.buoy_en_m is not None
