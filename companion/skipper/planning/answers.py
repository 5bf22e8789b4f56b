"""Taking the planner's answers: the splice, keeping the old plan."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Literal

import numpy as np

from companion.boat.tracking import SHORT_S
from companion.frozen import changed
from companion.messages import Severity
from companion.planner import Plan, PlanStatus
from companion.planner.plan import Arrival
from companion.planner.problem import evaluate, resolved
from companion.planner.risk import arrival, path_risk
from companion.planner.track import ExpectedTrack
from companion.skipper.planning.asking import UPLOAD_LATENCY_S, request
from companion.skipper.planning.autopilot_beats import gybing_radius_m, may_restart_leg, tacks_fail
from companion.skipper.planning.diversions import diversion
from companion.skipper.planning.fallback import leaves_headings
from companion.skipper.planning.not_found import MORE, asks_again, not_found
from companion.skipper.planning.tides import closes_ahead
from companion.skipper.planning.track import clearance_text, of_way, steps
from companion.skipper.planning.uploads import clearance_here_m, is_begun_risky, is_riskier, judged, upload
from companion.skipper.planning.vessels import apart_m, meetings
from companion.skipper.step import DiversionKind, Phase, PlanOutcome, ReplanReason, Route, StepContext
from companion.skipper.step.actions import Change
from companion.skipper.step.missions import Tail, splice
from companion.skipper.step.state import PendingPlan, Retry
from companion.skipper.way.gates import astray, no_room
from companion.skipper.way.geometry import bearing_rad, distance_m, gybe_round, has_way_out, moved
from companion.skipper.way.voyage import PointEn
from companion.traffic import Decision, decide

SLOW = "slow computer"  # the code under which it is said
SAME_M = 1.0  # a new waypoint this near to the old one is the old one
# Plans from a waypoint between here and a goal: one from the boat leads to the same goal.
AT_WAYPOINT = frozenset({ReplanReason.WAYPOINT, ReplanReason.FORECAST})
WIDE_TURN_M = 8.0  # a tighter one has room where plans lead


def take_plan(ctx: StepContext, outcome: PlanOutcome) -> None:
    """Take the planner's answer: splice and upload it, keep the old plan, or climb down the ladder."""
    pending = ctx.state.pending.plan
    if pending is None or pending.request_id != outcome.request_id:
        return
    ctx.set(pending=changed(ctx.state.pending, plan=None))
    _note_latency(ctx, pending, outcome)
    if outcome.plan is not None and outcome.plan.has_path:
        ctx.set(plans=changed(ctx.state.plans, made=ctx.state.plans.made + 1))
    if ctx.state.phase is Phase.OPERATOR or ctx.is_taken:
        return  # the operator may have taken the boat in this very step
    if ctx.state.voyage.sailing and not ctx.state.mission.checked:
        return
    plan = outcome.plan
    if plan is None or not plan.has_path:
        reason = outcome.text or (plan.reason if plan is not None else "the planner died")
        if (plan is None or plan.status is PlanStatus.UNANSWERED) and asks_again(ctx, pending, reason):
            return
        _not_found(ctx, pending, _no_room(ctx, pending) or reason)
        return
    ctx.set(plans=changed(ctx.state.plans, unanswered=0, effort=min(1.0, MORE * ctx.state.plans.effort), rung=0))
    outside = _astray(ctx, pending, plan) or _dead_end(ctx, pending, plan)
    if outside:
        _not_found(ctx, pending, outside)
        return
    keep, set_current = _place(ctx, pending)
    if keep is None:
        ctx.say(Severity.INFO, "plan late", "the new plan came after its waypoint: the old one stays", every_s=0.0)
        return
    if (
        pending.reason in AT_WAYPOINT
        and is_begun_risky(pending.problem, plan.legs)
        and may_restart_leg(ctx)
        and (
            pending.from_index is not None
            and _may_still_turn_before(ctx, pending.start_en_m)
            and request(ctx, pending.reason, text="the tack at the next waypoint may touch when it fails")
        )
    ):
        return  # no plan from that waypoint takes its tack away
    refused = "" if _keep_old(ctx, pending, plan) else put_in_place(ctx, pending, plan, keep, set_current)
    if refused:
        _not_found(ctx, pending, refused)
        return
    # A plan with less margin leads there; one to a nearer place does not, and what is led out of something first is
    # left in peace meanwhile.
    ladder = steps(ctx)
    is_makeshift = bool(pending.lead_in) or ladder[min(pending.rung, len(ladder) - 1)].nearer_goal
    patience = ctx.failed(ctx.state.plans.retry) if pending.rung > 0 and is_makeshift else Retry()
    ctx.set(plans=changed(ctx.state.plans, retry=patience))


def _not_found(ctx: StepContext, pending: PendingPlan, reason: str) -> None:
    """Give up the guidance by headings before the boat waits for a plan by them, else as ever (``not_found``)."""
    if not leaves_headings(ctx, pending, reason):
        not_found(ctx, pending, reason)


def _note_latency(ctx: StepContext, pending: PendingPlan, outcome: PlanOutcome) -> None:
    """Note how long an answer took, or one that was given up; say once what plans of such water take here.

    A worker that died or hung says nothing of how fast this computer is.
    """
    plan = outcome.plan
    if plan is not None and plan.status is PlanStatus.UNANSWERED:
        return
    took_s = ctx.t_s - pending.t_s
    if pending.reason is ReplanReason.START and plan is not None and plan.speed is not None:  # it may be given longer
        took_s -= max(0.0, plan.elapsed_s - ctx.config.first_plan_budget_s)
    latency = ctx.state.plans.latency.with_answer(
        took_s, ctx.config.plan_budget_s, None if plan is None else plan.speed
    )
    ctx.set(plans=changed(ctx.state.plans, latency=latency))
    if latency.is_slow:
        earlier = f"; plans are asked for {ctx.late_s:.0f} s earlier" if ctx.late_s > 0.0 else ""
        ctx.say(
            Severity.NOTICE, SLOW, f"this computer is slow for this water: {latency.words}{earlier}", every_s=math.inf
        )
    elif latency.speed is not None:  # measured: in real time
        ctx.say(Severity.INFO, "planner", f"the planner {latency.words}", every_s=math.inf)


def _no_room(ctx: StepContext, pending: PendingPlan) -> str:
    """Return that the line which a plan was to cross has no room by its margin, in words of it; empty: it has."""
    if not 0 <= pending.gate < len(ctx.gates):
        return ""
    return no_room(ctx.gates[pending.gate], ctx.voyage.area, pending.facts.margin_m)


def _astray(ctx: StepContext, pending: PendingPlan, plan: Plan) -> str:
    """Return why a plan does not do what its gate is for, in words; empty: it does, or it leads to none."""
    boat, route, index = ctx.boat_en, ctx.state.mission.route, ctx.state.mission.index
    if pending.gate < 0 or boat is None:
        return ""
    gate = ctx.gates[pending.gate]
    before = () if route is None or pending.from_index is None else route.points_en_m[index : pending.from_index + 1]
    way = [*pending.lead_in, *((float(e), float(n)) for e, n in plan.waypoints_en)]
    if ctx.gate is None or ctx.gate.goal != gate.goal:
        return astray(gate, way, 0.0)
    return astray(gate, [boat, *before, *way], ctx.state.progress.bearing_rad)


def _dead_end(ctx: StepContext, pending: PendingPlan, plan: Plan) -> str:
    """Return why the boat comes to a gate and not away from it, in words; empty: she does, or it leads to none.

    Behind the plan's end there is another plan, or a loiter: one that turns wide has to be turned for before.
    """
    wind, limits = ctx.wind_mean, ctx.snapshot.limits
    if pending.gate < 0 or wind is None or limits is None or len(plan.waypoints_en) < 2:
        return ""
    speed_mps = ctx.voyage.boat.polar.max_speed_mps(wind[1])
    radius_m = speed_mps / limits.rate_max_radps
    if radius_m < WIDE_TURN_M:
        return ""
    before, end = ((float(e), float(n)) for e, n in plan.waypoints_en[-2:])
    area, course_rad = ctx.voyage.area, bearing_rad(before, end)
    if has_way_out(area, end, course_rad, radius_m=radius_m, reach_m=ctx.voyage.boat.hull.reach_m):
        return ""
    rate = f"{math.degrees(limits.rate_max_radps):.0f} deg/s (ATC_STR_RAT_MAX)"
    return (
        f"{ctx.gates[pending.gate].name} is a dead end: at {speed_mps:.1f} m/s and {rate} a turn is "
        f"{2.0 * radius_m:.0f} m wide, and touches {area.nearest_name(end)}"
    )


def _may_still_turn_before(ctx: StepContext, waypoint_en: PointEn) -> bool:
    """Return whether a plan from the boat begins well before a waypoint: else it would turn beyond it."""
    boat = ctx.boat_en
    begins_m = ctx.speed_mps * (ctx.plan_lead_s + UPLOAD_LATENCY_S)
    return boat is not None and distance_m(boat, waypoint_en) > 2.0 * begins_m


def _place(ctx: StepContext, pending: PendingPlan) -> tuple[int | None, int | None]:
    """Return how many items stay and which seq must be made current (None: as it is; keep None: too late)."""
    state, k = ctx.state, pending.from_index
    if state.mission.route is None or state.mission.foreign:
        return 0, 1
    if k is None:
        return state.mission.index, state.mission.index + 1
    boat = ctx.boat_en
    if state.mission.index <= k:
        if (
            pending.reason in AT_WAYPOINT
            and boat is not None
            and (distance_m(boat, state.mission.route.points_en_m[state.mission.index]) < SHORT_S * ctx.speed_mps)
        ):
            return None, None  # an upload begins the leg anew, and what is left of it is too short to be followed
        return k + 1, None
    if (
        state.mission.index == k + 1
        and boat is not None
        and (distance_m(boat, pending.start_en_m) < ctx.config.grid_size_m)
    ):
        return k + 1, k + 2
    return None, None


def _keep_old(ctx: StepContext, pending: PendingPlan, plan: Plan) -> bool:
    """Keep the old plan when it is sound under the new forecast and the new one is not clearly better."""
    route = ctx.state.mission.route
    if tacks_fail(ctx):
        return False
    if route is None or pending.reason in {ReplanReason.START, ReplanReason.OPERATOR_BACK, ReplanReason.RETRY}:
        return False
    first = ctx.state.mission.index if pending.from_index is None else pending.from_index + 1
    points = route.points_en_m[first:-1]
    ends = [n for n in range(first, len(route.items) - 1) if route.gate_of[n] == pending.gate]
    if not points or not ends or pending.lead_in or route.bound_for != pending.facts.bound_for:
        return False
    if pending.gate >= 0:
        points = route.points_en_m[first : ends[0] + 1]
    elif not pending.facts.bound_for:
        return False
    problem = pending.problem
    # A vessel that the old route was planned clear of need not be kept so far from; it is held against its own discs.
    old = evaluate(replace(resolved(problem), targets=()), np.asarray([pending.start_en_m, *points]))
    gain = old.time_s - plan.cost_s
    if not old.is_feasible or closes_ahead(ctx) is not None:
        return False
    before_en, leg_from_en = None, route.leg_from_en_m[first]
    if pending.from_index is not None:
        before_en, leg_from_en = route.leg_from_en_m[pending.from_index], pending.start_en_m
    seen = of_way(
        problem,
        [pending.start_en_m, *points],
        heading_rad=problem.start_heading_rad,
        before_en=before_en,
        sailed_m=distance_m(leg_from_en, pending.start_en_m),
    )
    if not seen.is_kept or is_riskier(problem, old.legs, plan.legs):
        return False
    if problem.is_shared:
        tail = [(float(e), float(n)) for e, n in plan.waypoints_en]
        way = [*route.points_en_m[ctx.state.mission.index : first], *tail]
        verdict = decide(
            meetings(ctx),
            since_replan_s=0.0,
            active_cost_s=old.time_s,
            new_cost_s=plan.cost_s,
            apart_m=apart_m(ctx, way),
        )
        if verdict is not Decision.KEEP:
            return False
    elif gain > max(ctx.config.keep_gain_s, ctx.config.keep_gain * old.time_s):
        return False
    when, told = arrival(problem, old.legs), path_risk(problem, old.legs)
    kept = replace(
        pending.facts,  # under these it was found sound: what has changed since is held against them from now on
        items=route.items,
        points_en_m=route.points_en_m,
        leg_from_en_m=route.leg_from_en_m,
        gate_of=route.gate_of,
        plan_id=route.plan_id,
        expected_clearance_m=route.expected_clearance_m,
        planned_clearance_m=route.planned_clearance_m,
        why=route.why,
        risk=told.total,
        vessel_risk=told.vessels.total,
        cost_s=old.time_s,
        median_s=_time(when, "median_s"),
        late_s=_time(when, "late_s"),
    )
    ctx.set(mission=changed(ctx.state.mission, route=kept))
    ctx.say(
        Severity.INFO,
        "plan kept",
        f"{pending.reason.words}: the old plan stays ({old.time_s:.0f} s; a new one gains {max(0.0, gain):.1f} s)",
        every_s=0.0,
    )
    return True


def put_in_place(ctx: StepContext, pending: PendingPlan, plan: Plan, keep: int, set_current: int | None) -> str:
    """Splice a plan into the route and ask for its upload; return why it may not be, in words; empty: it may."""
    planned = _apart([(float(e), float(n)) for e, n in plan.waypoints_en])
    points = [*pending.lead_in, *planned[1:]]
    start = pending.start_en_m
    if pending.lead_in and ctx.boat_en is not None:
        start = ctx.boat_en
    expected_m = plan.expected_clearance_m
    if pending.lead_in and ctx.snapshot.vehicle is not None:  # the plan's own begins where she is led to
        heading_rad = ctx.snapshot.vehicle.heading_rad
        seen = of_way(pending.problem, [start, *points], heading_rad=heading_rad, before_en=None)
        expected_m = seen.clearance_m if math.isfinite(seen.clearance_m) else None
    if tacks_fail(ctx):
        # Tacks have failed: turn the other way round where there is room.
        points = list(_gybed_round(ctx, pending, start, points))
        seen = of_way(
            pending.problem,
            [start, *points],
            heading_rad=pending.problem.start_heading_rad,
            before_en=None,
            has_loops=False,
        )
        if not seen.is_kept:
            points = [*pending.lead_in, *planned[1:]]  # rather a tack that may fail than a loop onto something
        elif expected_m is not None:
            expected_m = min(expected_m, seen.clearance_m)
        ctx.say(Severity.NOTICE, "gybing round", "tacks have failed: gybing round where there is room")
    bound = diversion(ctx)
    tail = Tail(
        start_en=start,
        points_en=tuple(points),
        gate=pending.gate,
        is_place=bound is not None and bound.kind is DiversionKind.BOX and bound.name == pending.facts.bound_for,
    )
    facts = replace(
        pending.facts,
        risk=plan.risk,
        vessel_risk=plan.vessel_risk,
        cost_s=plan.cost_s,
        median_s=_time(plan.arrival, "median_s"),
        late_s=_time(plan.arrival, "late_s"),
        expected_clearance_m=expected_m,
        why=plan.why.text or plan.reason,
    )
    old = ctx.state.mission.route
    if keep + len(tail.points_en) + 1 > ctx.config.max_items and old is not None:
        # Start the numbering again with what is still ahead of the boat.
        ahead = slice(ctx.state.mission.index, keep)
        old = replace(
            old,
            items=old.items[ahead],
            points_en_m=old.points_en_m[ahead],
            leg_from_en_m=old.leg_from_en_m[ahead],
            gate_of=old.gate_of[ahead],
        )
        keep, set_current = len(old.items), 1
    route = splice(
        ctx.to_stay_in, ctx.known_config, old, keep=keep, tail=tail, twd_from_rad=facts.plan_twd_from_rad, facts=facts
    )
    if ctx.state.mission.route is not None and _is_same(ctx.state.mission.route, route):
        ctx.set(
            progress=changed(ctx.state.progress, missed_s=None),
            mission=changed(
                ctx.state.mission,
                route=replace(
                    route,
                    items=ctx.state.mission.route.items,
                    points_en_m=ctx.state.mission.route.points_en_m,
                    expected_clearance_m=ctx.state.mission.route.expected_clearance_m,
                ),
            ),
        )
        ctx.say(Severity.INFO, "plan kept", f"{pending.reason.words}: the new plan is the old one", every_s=0.0)
        return ""
    refused, track = judged(ctx, route, set_current, pending)
    if refused:
        return refused
    route = replace(route, expected_clearance_m=_told_m(ctx, plan, expected_m, track))
    way = route.points_en_m[ctx.state.mission.index if set_current is None else set_current - 1 : -1]
    met = meetings(ctx)
    unsafe = f"meets {met[0].name} in {met[0].time_s:.0f} s" if met else ""
    change = Change(apart_m=apart_m(ctx, way), unsafe=unsafe) if ctx.state.mission.route is not None else Change()
    _look_at_time(ctx, route)
    clear = clearance_text(route.expected_clearance_m, ctx.config.margin_floor_m)
    upload(ctx, route, set_current, f"{pending.reason.words}: {facts.why}{clear}", change=change)
    return ""


def _told_m(ctx: StepContext, plan: Plan, planned_m: float | None, track: ExpectedTrack | None) -> float | None:
    """Return the clearance that a plan is told with [m]: of the track that it was judged by, and of where the boat is.

    That track begins where she is by the time that the plan is on board, which may have more room than here.
    The planner's own (``planned_m``) is of a track that begins at a waypoint, on a heading that she may not have there.
    It stands where nothing was judged; and for the boards of legs that are left to the autopilot, which it alone looks
    at, where it keeps the floor.
    """
    if track is None:
        return planned_m
    seen_m = track.clearance_m
    has_boards = any(leg.is_beat for leg in plan.legs)
    if has_boards and planned_m is not None and planned_m >= min(ctx.config.margin_floor_m, ctx.config.margin_m):
        seen_m = min(seen_m, planned_m)
    if not math.isfinite(seen_m):
        return None
    return seen_m if ctx.boat_en is None else min(seen_m, clearance_here_m(ctx, ctx.boat_en))


def _gybed_round(ctx: StepContext, pending: PendingPlan, start: PointEn, points: list[PointEn]) -> tuple[PointEn, ...]:
    """Return the waypoints behind the start with their tacks gybed round, the one that begins them, too."""
    vehicle, heading = ctx.snapshot.vehicle, pending.problem.start_heading_rad
    if pending.lead_in and vehicle is not None:
        heading = vehicle.heading_rad
    return gybe_round(
        moved(start, heading, -1.0),
        [start, *points],
        twd_from_rad=pending.facts.plan_twd_from_rad,
        area=ctx.voyage.area,
        floor_m=min(ctx.config.margin_floor_m, pending.facts.margin_m),
        radius_m=gybing_radius_m(ctx),
    )[1:]


def _look_at_time(ctx: StepContext, route: Route) -> None:
    """Say so when the time that the voyage has may be over before the plan is sailed."""
    limit_s = ctx.config.voyage_timeout_s
    if limit_s is None or diversion(ctx) is not None or route.cost_s is None:
        return
    left_s = limit_s - ctx.state.voyage.under_way_s
    if route.late_s is None or route.late_s > left_s:
        late = "not told" if route.late_s is None else f"{route.late_s:.0f} s"
        ctx.say(
            Severity.WARNING,
            "may be late",
            f"{left_s:.0f} s are left of the voyage's time, and she is there in {route.cost_s:.0f} s; in nine "
            f"cases of ten: {late}",
        )


def _time(when: Arrival | None, quantile: Literal["median_s", "late_s"]) -> float | None:
    """Return a quantile of a plan's time [s], None: it is not told, or not in any time."""
    value = math.inf if when is None else getattr(when, quantile)
    return float(value) if math.isfinite(value) else None


def _apart(points: list[PointEn]) -> list[PointEn]:
    """Return the points without those that stand on the one before: the autopilot cannot sail a leg of no length."""
    out = points[:1]
    for n, point in enumerate(points[1:], start=1):
        if distance_m(out[-1], point) >= SAME_M:
            out.append(point)
        elif n == len(points) - 1 and len(out) > 1:
            out[-1] = point  # the end stays where it was planned
        elif n == len(points) - 1:
            out.append(point)
    return out


def _is_same(a: Route, b: Route) -> bool:
    return len(a.items) == len(b.items) and all(
        x.command == y.command and distance_m(p, q) < SAME_M
        for x, y, p, q in zip(a.items, b.items, a.points_en_m, b.points_en_m, strict=True)
    )
