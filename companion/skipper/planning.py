"""Asking for plans and taking their answers: requests, the splice, keeping the old plan, the ladder."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from companion.errors import InputError
from companion.messages import Command, waypoint
from companion.planner import Plan, Problem
from companion.skipper.actions import CancelPlan, Change, ReplanReason, RequestPlan, Severity, UploadMission
from companion.skipper.beating import problem_beat, room_m, tacks_fail
from companion.skipper.gates import Gate
from companion.skipper.geometry import bearing_rad, distance_m, moved
from companion.skipper.judge import half_width_rad, judge
from companion.skipper.ladder import Rung, rungs
from companion.skipper.manoeuvre import gybe_round
from companion.skipper.problem import Aim, Start, aim_at, problem_dict, repaired
from companion.skipper.route import Tail, common_prefix, loiter_place, path_length_m, splice, stopgap
from companion.skipper.snapshot import PlanOutcome, UploadOutcome, UploadResult
from companion.skipper.state import PendingPlan, PendingUpload, Phase, Retry, Route
from companion.skipper.traffic import apart_m, meetings, shares
from companion.skipper.turn import Turn
from companion.skipper.voyage import PointEn
from companion.traffic import Decision, decide

UPLOAD_LATENCY_S = 1.5   # item protocol, a few dozen items, and the read-back
SAME_M = 1.0             # a new waypoint this near to the old one is the old one
SPARE_SHARE = 0.001      # a path may get this much slower ...
SPARE_S = 0.3            # ... and this much more, to have a waypoint less
SIMPLIFIED_AT_MOST = 60  # waypoints: each costs a check of the whole path
GYBE_RADIUS_M = 8.0      # a loop that a boat of a few metres turns in, with WP_RADIUS to spare
SLOW_MPS = 0.5           # slower than this the course over ground says nothing about the heading


# ------------------------------------------------------------------------------------------ asking
def request(
    turn: Turn, reason: ReplanReason, *, from_index: int | None = None, rung: int = 0, text: str = "",
) -> bool:
    """Ask for a plan from item ``from_index`` of the route or, with None, from the boat; False when it cannot be.

    The gate planned for is the one after the gate that item ``from_index`` completes or leads to.
    """
    steps = rungs(turn.config)
    step = steps[min(rung, len(steps) - 1)]
    forecast = turn.snapshot.wind.forecast
    if forecast is None or turn.gate is None:
        return False
    start = _start(turn, from_index)
    gate = _gate_after(turn, from_index)
    if start is None or gate is None:
        return False
    wind = turn.wind_mean
    floor_m = min(turn.config.margin_floor_m, step.margin_m)
    start = repaired(
        turn.voyage, start, margin_m=step.margin_m, floor_m=floor_m, twd_from_rad=wind[0] if wind else None)
    aim = _aim(turn, gate, start, step)
    number = turn.new_id()
    shared = shares(turn, start.en_m, start.after_s, rung, step.delta_s)
    name = ", ".join(part for part in (step.name, "start repaired" if start.text else "") if part)
    try:
        problem = Problem.from_json(problem_dict(
            turn.voyage, turn.gates[gate], start=start, aim=aim, forecast=forecast, margin_m=step.margin_m,
            delta_s=shared.wind_delta_s, no_go_half_rad=turn.planned_no_go_rad, floor_m=floor_m, title=reason.value,
            beat=problem_beat(turn, step.margin_m), max_path_risk=step.max_path_risk,
        ))
    except (ValueError, InputError) as error:
        turn.say(Severity.ERROR, "problem", f"no problem can be stated: {error}")
        turn.update(plan_retry=turn.failed(turn.state.plan_retry))
        return False
    problem = replace(problem, delta_s=shared.delta_s, targets=shared.targets, vessels_part=shared.part)
    facts = replace(
        turn.blank_facts(number, step.margin_m, shared.delta_s, name),
        plan_twd_from_rad=problem.wind.twd_from_rad,
        plan_half_width_rad=half_width_rad(forecast, start.after_s + 60.0, turn.config.wind_change_level),
        vessels_part=shared.part or 0.0,
    )
    if turn.state.pending_plan is not None:
        turn.act(CancelPlan(request_id=turn.state.pending_plan.request_id))
    pending = PendingPlan(
        request_id=number, t_s=turn.t_s, reason=reason, from_index=from_index, rung=rung, gate=aim.gate,
        lead_in=start.lead_in, start_en_m=start.en_m, facts=facts, problem=problem,
    )
    turn.update(
        pending_plan=pending, last_plan_s=turn.t_s, rung=rung, ladder_reason=reason, replans=turn.state.replans + 1)
    budget = turn.config.first_plan_budget_s if reason is ReplanReason.START else turn.config.plan_budget_s
    why = "; ".join(part for part in (text, start.text, f"step: {name}" if name else "") if part)
    turn.act(RequestPlan(
        request_id=number, problem=problem, reason=reason, budget_s=budget, seed=number,
        from_seq=None if from_index is None else from_index + 1, rung=name, text=why,
    ))
    return True


def _start(turn: Turn, from_index: int | None) -> Start | None:
    boat, vehicle, route = turn.boat_en, turn.snapshot.vehicle, turn.state.route
    if boat is None or vehicle is None:
        return None
    if from_index is None:
        sailing = turn.state.sailing and vehicle.speed_mps > SLOW_MPS
        ahead = turn.config.plan_budget_s + UPLOAD_LATENCY_S if sailing else 0.0
        heading = math.atan2(*vehicle.velocity_en_mps) if sailing else vehicle.heading_rad
        return Start(en_m=moved(boat, heading, vehicle.speed_mps * ahead), heading_rad=heading, after_s=ahead)
    if route is None or not turn.state.index <= from_index < len(route.items):
        return None
    way = [boat, *route.points_en_m[turn.state.index:from_index + 1]]
    speed = max(vehicle.speed_mps, SLOW_MPS)
    return Start(
        en_m=route.points_en_m[from_index],
        heading_rad=bearing_rad(route.leg_from_en_m[from_index], route.points_en_m[from_index]),
        after_s=path_length_m(way) / speed,
    )


def _gate_after(turn: Turn, from_index: int | None) -> int | None:
    """Return the gate that a plan from there is for: the first not completed before or at that item."""
    gate, route = turn.state.gate, turn.state.route
    if from_index is not None and route is not None:
        done = [g for g in route.gate_of[turn.state.index:from_index + 1] if g >= 0]
        gate = max([gate, *(g + 1 for g in done)])
    return gate if gate < len(turn.gates) else None


def seeks_refuge(turn: Turn) -> bool:
    """Return whether the boat makes for a refuge instead of its goal."""
    return turn.is_raised("battery critical") and bool(turn.voyage.refuges)


def _aim(turn: Turn, gate: int, start: Start, step: Rung) -> Aim:
    if seeks_refuge(turn):
        place = min(turn.voyage.refuges, key=lambda p: distance_m(start.en_m, p))
        return Aim(en_m=place, radius_m=turn.config.announce_m, gate=-1)
    if step.nearer_goal:
        return _nearer(turn, gate, start, step)
    return aim_at(turn.voyage, turn.config, turn.gates, gate, start.en_m)


def _nearer(turn: Turn, gate: int, start: Start, step: Rung) -> Aim:
    """Return a safe place that is nearer than the goal: a refuge, or a roomy place on the way."""
    target = turn.gates[gate].en_m
    left = distance_m(start.en_m, target)
    course = bearing_rad(start.en_m, target)
    candidates = [p for p in turn.voyage.refuges if distance_m(start.en_m, p) < left]
    candidates.sort(key=lambda p: distance_m(p, target))
    candidates += [
        moved(start.en_m, course + side, share * left)
        for share in (0.75, 0.5, 0.35, 0.2) for side in (0.0, 0.35, -0.35, 0.8, -0.8)
    ]
    for place in candidates:
        if float(turn.voyage.area.clearance_m([place])[0]) >= step.margin_m + turn.config.loiter_radius_m:
            return Aim(en_m=place, radius_m=turn.config.loiter_radius_m, gate=-1)
    return Aim(en_m=target, radius_m=turn.gates[gate].radius_m, gate=gate)


# ----------------------------------------------------------------------------------------- answers
def take_plan(turn: Turn, outcome: PlanOutcome) -> None:
    """Take the planner's answer: splice and upload it, keep the old plan, or climb down the ladder."""
    pending = turn.state.pending_plan
    if pending is None or pending.request_id != outcome.request_id:
        return
    turn.update(pending_plan=None)
    if turn.state.phase in {Phase.OPERATOR, Phase.DONE} or turn.is_taken:
        return   # the operator may have taken the boat in this very step
    if turn.state.sailing and not turn.state.checked_mission:
        return
    plan = outcome.plan
    if plan is None or not plan.has_path:
        reason = outcome.text or (plan.reason if plan is not None else "the planner died")
        _not_found(turn, pending, reason)
        return
    turn.update(
        rung=0, ladder_reason=None, plan_retry=turn.failed(turn.state.plan_retry) if pending.rung > 0 else Retry())
    keep, set_current = _place(turn, pending)
    if keep is None:
        turn.say(Severity.INFO, "plan late", "the new plan came after its waypoint: the old one stays", every_s=0.0)
        return
    if _keep_old(turn, pending, plan):
        return
    put_in_place(turn, pending, plan, keep, set_current)


def _place(turn: Turn, pending: PendingPlan) -> tuple[int | None, int | None]:
    """Return how many items stay and which seq must be made current (None: none; keep None: too late)."""
    state, k = turn.state, pending.from_index
    if state.route is None or state.foreign:
        return 0, 1
    if k is None:
        return state.index, state.index + 1
    if state.index <= k:
        return k + 1, None
    boat = turn.boat_en
    if state.index == k + 1 and boat is not None and distance_m(boat, pending.start_en_m) < turn.config.grid_size_m:
        return k + 1, k + 2
    return None, None


def _keep_old(turn: Turn, pending: PendingPlan, plan: Plan) -> bool:
    """Keep the old plan when it is sound under the new forecast and the new one is not clearly better."""
    route = turn.state.route
    if tacks_fail(turn):
        return False
    if route is None or pending.reason in {ReplanReason.START, ReplanReason.OPERATOR_BACK, ReplanReason.RETRY}:
        return False
    first = turn.state.index if pending.from_index is None else pending.from_index + 1
    points = route.points_en_m[first:-1]
    ends = [n for n in range(first, len(route.items) - 1) if route.gate_of[n] == pending.gate]
    if not points or pending.gate < 0 or not ends or pending.lead_in:
        return False
    points = route.points_en_m[first:ends[0] + 1]
    problem = pending.problem
    # A vessel that the old route was planned clear of need not be kept so far from; it is held against its own discs.
    old = replace(problem.resolved, targets=()).evaluate(np.asarray([pending.start_en_m, *points]))
    gain = old.time_s - plan.cost_s
    if not old.is_feasible:
        return False
    if problem.targets:
        tail = [(float(e), float(n)) for e, n in plan.waypoints_en]
        way = [*route.points_en_m[turn.state.index:first], *tail]
        verdict = decide(meetings(turn), since_replan_s=0.0, active_cost_s=old.time_s, new_cost_s=plan.cost_s,
                         apart_m=apart_m(turn, way))
        if verdict is not Decision.KEEP:
            return False
    elif gain > max(turn.config.keep_gain_s, turn.config.keep_gain * old.time_s):
        return False
    facts = pending.facts
    turn.update(route=replace(
        route, plan_t_s=facts.plan_t_s, plan_twd_from_rad=facts.plan_twd_from_rad, plan_tws_mps=facts.plan_tws_mps,
        plan_half_width_rad=facts.plan_half_width_rad, risk=plan.risk if gain <= 0.0 else route.risk,
    ))
    turn.say(
        Severity.INFO, "plan kept",
        f"{pending.reason.value}: the old plan stays ({old.time_s:.0f} s; a new one gains {max(0.0, gain):.1f} s)",
        every_s=0.0,
    )
    return True


def put_in_place(turn: Turn, pending: PendingPlan, plan: Plan, keep: int, set_current: int | None) -> None:
    """Splice a plan into the route and ask for its upload."""
    points = simplified(pending.problem, _apart([(float(e), float(n)) for e, n in plan.waypoints_en]))[1:]
    if tacks_fail(turn):
        # Tacks have failed: turn the other way round where there is room.
        points = list(gybe_round(
            pending.start_en_m, points, twd_from_rad=pending.facts.plan_twd_from_rad, radius_m=GYBE_RADIUS_M,
            area=turn.voyage.area, floor_m=min(turn.config.margin_floor_m, pending.facts.margin_m)))
        turn.say(Severity.NOTICE, "gybing round", "tacks have failed: gybing round where there is room")
    tail = Tail(start_en=pending.start_en_m, points_en=(*pending.lead_in, *points), gate=pending.gate)
    if pending.lead_in:
        boat = turn.boat_en
        tail = replace(tail, start_en=boat if boat is not None else pending.start_en_m)
    facts = replace(
        pending.facts, risk=plan.risk, vessel_risk=plan.vessel_risk, cost_s=plan.cost_s,
        why=plan.why.text or plan.reason)
    old = turn.state.route
    if old is not None:
        # A gate that was missed is to be passed by the new tail: what the kept items counted for is void.
        old = replace(old, gate_of=tuple(
            -1 if n < turn.state.index and g >= turn.state.gate else g for n, g in enumerate(old.gate_of)))
    if keep + len(tail.points_en) + 1 > turn.config.max_items and old is not None:
        # Start the numbering again with what is still ahead of the boat.
        ahead = slice(turn.state.index, keep)
        old = replace(old, items=old.items[ahead], points_en_m=old.points_en_m[ahead],
                      leg_from_en_m=old.leg_from_en_m[ahead], gate_of=old.gate_of[ahead])
        keep, set_current = len(old.items), 1
    route = splice(
        turn.voyage, turn.config, old, keep=keep, tail=tail, twd_from_rad=facts.plan_twd_from_rad, facts=facts)
    if turn.state.route is not None and _is_same(turn.state.route, route):
        turn.update(route=replace(route, items=turn.state.route.items, points_en_m=turn.state.route.points_en_m))
        turn.say(Severity.INFO, "plan kept", f"{pending.reason.value}: the new plan is the old one", every_s=0.0)
        return
    way = route.points_en_m[turn.state.index if set_current is None else set_current - 1:-1]
    met = meetings(turn)
    unsafe = f"meets {met[0].name} in {met[0].time_s:.0f} s" if met else ""
    change = Change(apart_m=apart_m(turn, way), unsafe=unsafe) if turn.state.route is not None else Change()
    upload(turn, route, set_current, f"{pending.reason.value}: {facts.why}", change=change)


def _apart(points: list[PointEn]) -> list[PointEn]:
    """Return the points without those that stand on the one before: the autopilot cannot sail a leg of no length."""
    out = points[:1]
    for n, point in enumerate(points[1:], start=1):
        if distance_m(out[-1], point) >= SAME_M:
            out.append(point)
        elif n == len(points) - 1 and len(out) > 1:
            out[-1] = point   # the end stays where it was planned
        elif n == len(points) - 1:
            out.append(point)
    return out


def simplified(problem: Problem, points: list[PointEn]) -> list[PointEn]:
    """Return the path without the waypoints that it does not need.

    A planner bends a leg a little as the no-go zone widens with time; each bend is an upload's item and a replan.
    A waypoint goes when the path without it passes the planner's own check and is not slower than by
    ``SPARE_SHARE`` and ``SPARE_S``.
    """
    if len(points) < 3 or len(points) > SIMPLIFIED_AT_MOST:
        return points
    whole = problem.evaluate(np.asarray(points))
    if not whole.is_feasible:
        return points
    allowed_s = whole.time_s * (1.0 + SPARE_SHARE) + SPARE_S
    kept = list(points)
    n = 1
    while n < len(kept) - 1:
        shorter = kept[:n] + kept[n + 1:]
        judged = problem.evaluate(np.asarray(shorter))
        if judged.is_feasible and judged.time_s <= allowed_s:
            kept = shorter
        else:
            n += 1
    return kept


def _is_same(a: Route, b: Route) -> bool:
    return len(a.items) == len(b.items) and all(
        x.command == y.command and distance_m(p, q) < SAME_M
        for x, y, p, q in zip(a.items, b.items, a.points_en_m, b.points_en_m, strict=True)
    )


def upload(
    turn: Turn, route: Route, set_current: int | None, text: str, *, whole: bool = False, change: Change | None = None,
) -> None:
    """Ask for the upload of a route; without permission it stays ready and the status says so."""
    old = turn.state.route
    known = old is not None and not turn.state.foreign and turn.state.checked_mission and not whole
    on_board = old.items if old is not None and known else ()
    number = turn.new_id()
    keep = common_prefix(on_board, route.items)
    action = UploadMission(
        upload_id=number, items=route.items, keep_first=keep, set_current=set_current, plan_id=route.plan_id,
        text=text, stopgap=stopgap(old, keep, turn.state.index) if old is not None and known else None,
        change=change or Change(),
    )
    if not turn.act(action):
        turn.update(ready_route=route)
        turn.say(Severity.WARNING, "upload not permitted", "a plan is ready; uploading is not permitted")
        return
    # A read that is still under way will tell of the mission before this upload: its answer is not wanted.
    turn.update(pending_read=None, ready_route=None, pending_upload=PendingUpload(
        upload_id=number, t_s=turn.t_s, route=route, set_current=set_current, keep_first=action.keep_first))


def take_upload(turn: Turn, outcome: UploadOutcome) -> None:
    """Take the end of an upload: the new route sails, or the mission on board must be looked at."""
    pending = turn.state.pending_upload
    if pending is None or pending.upload_id != outcome.upload_id:
        return
    if outcome.result is UploadResult.OK:
        index = turn.state.index
        if pending.set_current is not None:
            index = pending.set_current - 1
        turn.update(
            pending_upload=None, route=pending.route, index=index, own_index=max(index, 0), upload_retry=Retry(),
            checked_mission=True, foreign="", unsure_route=None, replace_foreign=False, missed_gate=None,
            no_go_since_s=None, uploaded_s=turn.t_s,
            current_asked_s=turn.t_s if pending.set_current is not None else turn.state.current_asked_s,
            asked_seq=pending.set_current if turn.state.sailing else None,
            replanned_index=turn.state.replanned_index if pending.set_current != 1 else -1,
        )
        return
    turn.update(
        pending_upload=None, unsure_route=pending.route, checked_mission=False,
        upload_retry=turn.failed(turn.state.upload_retry), read_since_s=turn.t_s,
    )
    turn.say(
        Severity.ERROR, "upload failed",
        f"upload {outcome.result.value}: {outcome.text or 'no words'}; reading what is on board", every_s=0.0)


# ------------------------------------------------------------------------------------------ ladder
def is_old_plan_sound(turn: Turn) -> bool:
    """Return whether the mission sailed now is still good for the present wind and keeps the margin's floor."""
    boat, wind, ahead = turn.boat_en, turn.wind_mean, turn.ahead()
    if boat is None or wind is None or not ahead:
        return False
    verdict = judge(
        [boat, *ahead], boat=turn.voyage.boat, no_go_half_rad=turn.no_go_half_rad, twd_from_rad=wind[0],
        tws_mps=wind[1], area=turn.voyage.area, beat_room_m=room_m(turn),
    )
    return verdict.is_sound(min(turn.config.margin_floor_m, turn.config.margin_m))


def _not_found(turn: Turn, pending: PendingPlan, reason: str) -> None:
    steps = rungs(turn.config)
    state = turn.state
    where = steps[min(pending.rung, len(steps) - 1)].name or "as configured"
    met = meetings(turn) if state.route is not None else ()
    if pending.rung == 0 and state.route is not None and not met and is_old_plan_sound(turn):
        turn.update(plan_retry=turn.failed(state.plan_retry), rung=0)
        turn.say(Severity.WARNING, "no plan", f"no new plan ({reason}): the old one is sound and stays", every_s=0.0)
        return
    # Only the boat's own place helps when the way from a waypoint ahead is closed: the rungs start at the boat.
    from_index = pending.from_index if pending.rung == 0 and state.route is not None and _tail_only(turn) else None
    if pending.rung + 1 < len(steps):
        following = steps[pending.rung + 1].name
        text = f"no plan {where} ({reason}): trying {following}"
        turn.say(Severity.WARNING, f"ladder {pending.rung}", text, every_s=0.0)
        if request(turn, pending.reason, from_index=from_index, rung=pending.rung + 1, text=reason):
            return
    turn.update(plan_retry=turn.failed(state.plan_retry), rung=0)
    if met and is_old_plan_sound(turn):
        # Loitering in a vessel's way is no better than sailing on through it: the operator must know.
        turn.say(
            Severity.CRITICAL, "no way clear",
            f"no plan keeps clear of {met[0].name}, met in {met[0].time_s:.0f} s: the old plan stays", every_s=0.0)
        return
    wait = turn.state.plan_retry.not_before_s - turn.t_s
    turn.say(
        Severity.CRITICAL, "no plan at all",
        f"no plan on any step of the ladder ({reason}): holding, trying again in {wait:.0f} s", every_s=0.0)
    hold(turn, f"no plan found: {reason}")


def _tail_only(turn: Turn) -> bool:
    """Return whether the way to the present target is sound by itself, so that only the tail needs a plan."""
    boat, leg, wind = turn.boat_en, turn.leg(), turn.wind_mean
    if boat is None or leg is None or wind is None:
        return False
    verdict = judge(
        [boat, leg[1]], boat=turn.voyage.boat, no_go_half_rad=turn.no_go_half_rad, twd_from_rad=wind[0],
        tws_mps=wind[1], area=turn.voyage.area, beat_room_m=room_m(turn))
    return verdict.is_sound(min(turn.config.margin_floor_m, turn.config.margin_m))


def hold(turn: Turn, why: str) -> None:
    """Loiter in the roomiest place near the boat, by a mission that ends there at once."""
    boat, wind, state = turn.boat_en, turn.wind_mean, turn.state
    turn.phase(Phase.HOLDING if state.sailing else Phase.WAITING, why)
    if boat is None or not state.sailing or state.route is None or state.index >= len(state.route.items) - 1:
        return   # not under way, or already in the safe end of the mission
    place, room = loiter_place(turn.voyage, turn.config, boat, wind[0] if wind else 0.0)
    keep = state.index
    end = waypoint(turn.voyage.frame.geo_from_en(*place), command=Command.NAV_LOITER_UNLIM)
    route = replace(
        state.route, items=(*state.route.items[:keep], end), points_en_m=(*state.route.points_en_m[:keep], place),
        leg_from_en_m=(*state.route.leg_from_en_m[:keep], boat), gate_of=(*state.route.gate_of[:keep], -1),
        rung="hold", risk=None, cost_s=None, why=f"{why}; loitering with {room:.0f} m of room",
    )
    upload(turn, route, keep + 1, route.why)


def gate_of_plan(turn: Turn) -> Gate | None:
    """Return the gate that the present target completes, None when it completes none."""
    route, i = turn.state.route, turn.state.index
    if route is None or not 0 <= i < len(route.items) or route.gate_of[i] < 0:
        return None
    return turn.gates[route.gate_of[i]]

