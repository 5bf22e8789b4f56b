"""Asking for plans: from where, to where, with which step of the ladder."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from companion.boat.failed_tack import IRONS_S
from companion.current import over_ground
from companion.errors import InputError
from companion.frozen import changed
from companion.messages import Mode, Severity
from companion.planner import Problem
from companion.skipper.planning.autopilot_beats import FOLLOWS_RAD, gybing_s, problem_beat, tacks_fail
from companion.skipper.planning.diversions import after_last_goal, diversion, gate_for, room_behind
from companion.skipper.planning.ladder import Rung
from companion.skipper.planning.statement import Aim, Start, aim_at, aim_near, problem_dict, repaired
from companion.skipper.planning.tides import told
from companion.skipper.planning.track import problem_tracking, steps
from companion.skipper.planning.vessels import shares
from companion.skipper.step import CancelPlan, Diversion, ReplanReason, RequestPlan, StepContext, WindHealth
from companion.skipper.step.context import SHOWS_S
from companion.skipper.step.missions import path_length_m
from companion.skipper.step.state import PendingPlan
from companion.skipper.way import Gate, bearing_rad, distance_m, half_width_rad, moved
from companion.skipper.way.gates import marks_of
from companion.skipper.way.line import STRAY_M
from companion.skipper.way.position_plausibility import is_impossible
from companion.skipper.way.stemming import waiting_place
from companion.skipper.way.voyage import PointEn

UPLOAD_LATENCY_S = 1.5  # item protocol, a few dozen items, and the read-back
GATHERS_WAY_S = 1.5  # from AUTO and armed on she drifts on, before her sails draw ...
SETS_SAIL_S = SHOWS_S + GATHERS_WAY_S  # ... and meanwhile as long as AUTO and arming take to show
SLOW_MPS = 0.5  # slower than this the course over ground says nothing about the heading
KNOWN_SHARE = 0.5  # of the distance to the goal: a way on board that ends so near to it leads there
OUT_OF_REACH = "goal out of reach"  # the code under which it is said ...
REACH_S = 1800.0  # ... and so often, while it lasts
WIDTH_AHEAD_S = 60.0  # how far ahead the interval is taken that a plan remembers of its wind


def request(
    ctx: StepContext, reason: ReplanReason, *, from_index: int | None = None, rung: int = 0, text: str = ""
) -> bool:
    """Ask for a plan from item ``from_index`` of the route or, with None, from the boat; False when it cannot be.

    It is planned for where it is bound for on a diversion, else for the gate after the one that item ``from_index``
    completes or leads to, and behind the last one home where the mission ends there. ``lacks`` says why not.
    """
    current, ladder = ctx.snapshot.current, steps(ctx)
    step = ladder[min(rung, len(ladder) - 1)]
    forecast, start, aimed = ctx.snapshot.wind.forecast, _start(ctx, from_index), _target(ctx, from_index)
    if forecast is None or start is None or aimed is None:
        return False
    target, gate, bound = aimed
    wind = ctx.wind_mean
    floor_m = min(ctx.config.margin_floor_m, step.margin_m)
    start = repaired(
        ctx.voyage,
        start,
        margin_m=step.margin_m,
        floor_m=floor_m,
        twd_from_rad=wind[0] if wind else None,
        water=ctx.water,
    )
    aim = _aim(ctx, target, gate, start, step)
    number = ctx.new_id()
    shared = shares(ctx, start.en_m, start.after_s, rung, step.delta_s)
    water = told(ctx, start.en_m, start.after_s, step.margin_m)
    voyage = ctx.with_closed(water.solid)
    name = ", ".join(part for part in (step.name, "start repaired" if start.text else "") if part)
    try:
        problem = Problem.from_json(
            problem_dict(
                voyage,
                target,
                start=start,
                aim=aim,
                forecast=forecast,
                margin_m=step.margin_m,
                delta_s=shared.wind_delta_s,
                no_go_half_rad=ctx.planned_no_go_rad,
                floor_m=floor_m,
                title=reason.value,
                beat=problem_beat(ctx, step.margin_m),
                max_path_risk=step.max_path_risk,
                current=current,
                failing=_failing(ctx),
                seen=ctx.snapshot.speed_seen,
                is_wind_known=ctx.snapshot.wind.health is not WindHealth.UNTRUSTED,
                stray_m=_stray_m(step, ladder),
                doubt=ctx.snapshot.doubt if ctx.config.sails else None,
                zone_half_rad=ctx.no_go_half_rad + (0.0 if step.pinches else FOLLOWS_RAD),
                tracking=problem_tracking(
                    ctx,
                    start,
                    from_index,
                    area=voyage.area,
                    floor_m=min(ctx.config.margin_floor_m, ctx.config.margin_m),
                    forecast=forecast,
                ),
            )
        )
    except (ValueError, InputError) as error:
        ctx.say(Severity.ERROR, "problem", f"no problem can be stated: {error}")
        ctx.set(plans=changed(ctx.state.plans, retry=ctx.failed(ctx.state.plans.retry)))
        return False
    problem = replace(
        problem,
        delta_s=shared.delta_s,
        targets=(*shared.targets, *water.targets),
        vessels_part=shared.part,
        known_en=_known(ctx, from_index, start, aim),
    )
    facts = replace(
        ctx.blank_facts(ctx.state.plans.made + 1, step.margin_m, shared.delta_s, name),
        plan_twd_from_rad=over_ground(problem.wind.twd_from_rad, problem.wind.tws_mps or 0.0, current.planned_en_mps)[
            0
        ],
        plan_half_width_rad=half_width_rad(forecast, start.after_s + WIDTH_AHEAD_S, ctx.config.wind_change_level),
        vessels_part=shared.part or 0.0,
        bound_for=bound.name if bound is not None and not step.nearer_goal else "",
    )
    if ctx.state.pending.plan is not None:
        ctx.act(CancelPlan(request_id=ctx.state.pending.plan.request_id))
    pending = PendingPlan(
        request_id=number,
        t_s=ctx.t_s,
        reason=reason,
        from_index=from_index,
        rung=rung,
        gate=aim.gate,
        lead_in=start.lead_in,
        start_en_m=start.en_m,
        facts=facts,
        problem=problem,
    )
    ctx.set(
        pending=changed(ctx.state.pending, plan=pending),
        plans=changed(
            ctx.state.plans, last_s=ctx.t_s, rung=rung, replans=ctx.state.plans.replans + ctx.state.voyage.sailing
        ),
    )
    budget = ctx.config.first_plan_budget_s if reason is ReplanReason.START else ctx.config.plan_budget_s
    why = "; ".join(part for part in (text, start.text, f"step: {name}" if name else "") if part)
    ctx.act(
        RequestPlan(
            request_id=number,
            problem=problem,
            reason=reason,
            budget_s=ctx.state.plans.effort * budget,
            seed=number,
            from_seq=None if from_index is None else from_index + 1,
            planner=step.planner.about(ctx.voyage.frame.origin, target.heading_rad if aim.gate >= 0 else None),
            rung=name,
            text=why,
        )
    )
    return True


def _stray_m(step: Rung, ladder: Sequence[Rung]) -> float:
    """Return what is kept clear of a line's marks for a track that strays [m]: given up with the margin.

    A line that a wind leaves no straight way through at the whole of it is crossed nearer to a mark, not gone round.
    Where the ladder has no margin to give up it goes with the first thing that is.
    """
    wanted_m, least_m = ladder[0].margin_m, min(rung.margin_m for rung in ladder)
    if wanted_m <= least_m:
        return STRAY_M if step == ladder[0] else 0.0
    return STRAY_M * min((step.margin_m - least_m) / (wanted_m - least_m), 1.0)


def _failing(ctx: StepContext) -> dict[str, Any]:
    """Return what is known of tacks that fail, as a problem's boat has it: before the first, the chance alone."""
    tacking, given = ctx.state.tacking, ctx.voyage.boat.tack_fails
    failing: dict[str, Any] = {"tack_fails": tacking.chance(given)}
    if tacks_fail(ctx):
        failing["tack_loss_s"] = max(ctx.voyage.boat.tack_loss_s, gybing_s(ctx))
    if given > 0.0 and tacking.failed:
        failing |= {
            "irons_s": max(IRONS_S, tacking.irons_s),
            "lee_mps": [tacking.starboard_lee_mps, tacking.port_lee_mps],
        }
    return failing


def _start(ctx: StepContext, from_index: int | None) -> Start | None:
    boat, vehicle, route = ctx.boat_en, ctx.snapshot.vehicle, ctx.state.mission.route
    if boat is None or vehicle is None or is_impossible(ctx.always_solid, boat, margin_m=ctx.config.margin_m):
        return None
    if from_index is None:
        # Stopped, or turning in circles, the boat is where it is.
        stopped = ctx.state.steering.own_mode in {Mode.HOLD, Mode.LOITER}
        sailing = ctx.state.voyage.sailing and vehicle.speed_mps > SLOW_MPS and not stopped
        ahead = ctx.plan_lead_s + UPLOAD_LATENCY_S if sailing else 0.0
        heading = math.atan2(*vehicle.velocity_en_mps) if sailing else vehicle.heading_rad
        place = moved(boat, heading, vehicle.speed_mps * ahead)
        if not ctx.state.voyage.sailing:
            # Nobody sails her yet: she drifts until she gathers way. Onto something she is planned for where she lies.
            after_s = ctx.plan_lead_s + UPLOAD_LATENCY_S + SETS_SAIL_S
            drifted = drifted_en(ctx, after_s) or boat
            if drifted != boat and ctx.voyage.area.path_clearance_m([boat, drifted]) > 0.0:
                place, ahead = drifted, after_s
        # In a current a plan's headings are through the water.
        bow = vehicle.heading_rad if ctx.snapshot.current.is_significant else heading
        tacking = ctx.state.tacking
        if tacking.is_counted:
            bow = tacking.settled_rad  # the boat lies in irons, and falls off to its old tack
        return Start(en_m=place, heading_rad=bow, after_s=ahead)
    if route is None or not ctx.state.mission.index <= from_index < len(route.items):
        return None
    way = [boat, *route.points_en_m[ctx.state.mission.index : from_index + 1]]
    speed = max(vehicle.speed_mps, SLOW_MPS)
    return Start(
        en_m=route.points_en_m[from_index],
        heading_rad=bearing_rad(route.leg_from_en_m[from_index], route.points_en_m[from_index]),
        after_s=path_length_m(way) / speed,
    )


def drifted_en(ctx: StepContext, after_s: float) -> PointEn | None:
    """Return where a boat that nobody sails has drifted to after ``after_s`` [s]; None: her place is not known."""
    boat, vehicle = ctx.boat_en, ctx.snapshot.vehicle
    if boat is None or vehicle is None or vehicle.speed_mps <= SLOW_MPS:
        return boat
    return moved(boat, math.atan2(*vehicle.velocity_en_mps), vehicle.speed_mps * after_s)


def lacks(ctx: StepContext, from_index: int | None = None) -> str:
    """Return what is missing for a plan in words; empty: nothing, or what ``request`` says itself."""
    if ctx.snapshot.wind.forecast is None:
        return "a wind forecast"
    if _start(ctx, from_index) is None:
        doubt = ctx.state.position.doubt
        return "a position to plan from" + (f": {doubt.why}" if doubt is not None else "")
    if _target(ctx, from_index) is None:
        return "a goal: none is left"
    return ""


def _known(ctx: StepContext, from_index: int | None, start: Start, aim: Aim) -> tuple[PointEn, ...]:
    """Return what is on board behind the start, to where it completes a gate: a search begins from it, too.

    Nothing where that leads elsewhere than the plan that is asked for.
    """
    route = ctx.state.mission.route
    if route is None:
        return ()
    begin, last = ctx.state.mission.index if from_index is None else from_index + 1, len(route.items) - 1
    end = next((n for n in range(begin, last) if route.gate_of[n] >= 0), last)
    way = route.points_en_m[begin : min(end + 1, last)]
    leads_there = bool(way) and distance_m(way[-1], aim.en_m) < KNOWN_SHARE * distance_m(start.en_m, aim.en_m)
    return way if leads_there else ()


def _target(ctx: StepContext, from_index: int | None) -> tuple[Gate, int, Diversion | None] | None:
    """Return what to plan for: the gate, its number (-1: it completes none), and the diversion that it is for."""
    bound = diversion(ctx)
    number = None if bound is not None else _gate_after(ctx, from_index)
    if bound is None and number is None:
        bound = after_last_goal(ctx)
    if bound is not None and from_index is not None and from_index == ctx.last_waypoint():
        bound = room_behind(ctx, bound) or bound
    if bound is not None:
        return (gate_for(bound), -1, bound) if bound.has_place else None
    return None if number is None else (ctx.gates[number], number, None)


def _gate_after(ctx: StepContext, from_index: int | None) -> int | None:
    """Return the gate that a plan from there is for: the first not completed before or at that item."""
    gate, route = ctx.state.progress.gate, ctx.state.mission.route
    if from_index is not None and route is not None:
        done = [g for g in route.gate_of[ctx.state.mission.index : from_index + 1] if g >= 0]
        gate = max([gate, *(g + 1 for g in done)])
    return gate if gate < len(ctx.gates) else None


def _aim(ctx: StepContext, target: Gate, gate: int, start: Start, step: Rung) -> Aim:
    if step.nearer_goal:
        return _nearer(ctx, target, gate, start, step)
    aim = aim_at(ctx.voyage, ctx.config, target, gate, start.en_m)
    if aim.en_m != target.en_m or (gate >= 0 and not target.is_plain):
        return aim
    # Home is where she was armed, by a quay, and a goal may lie by one: the plan ends as near to it as it may.
    area = ctx.voyage.area if gate >= 0 else ctx.to_stay_in.area
    return aim_near(area, ctx.config, target.en_m, target.radius_m, step.margin_m, gate=gate) or aim


def out_of_reach(ctx: StepContext, gate: Gate | None) -> str:
    """Return that a goal by something solid, to which the ladder has found no way, is not reached, and what helps.

    Empty where it has room by every step of the ladder: then it is something else that shuts it off.
    """
    area, wind = ctx.voyage.area, ctx.wind_mean
    if gate is None or not gate.is_plain or wind is None or diversion(ctx) is not None:
        return ""
    most_m = max(step.margin_m for step in steps(ctx))
    if math.hypot(*gate.en_m) > area.reach_m or float(area.spare_m([gate.en_m], most_m)[0]) >= 0.0:
        return ""
    off_m = max(0.0, float(area.clearance_m([gate.en_m])[0]))
    floor_m = min(ctx.config.margin_floor_m, ctx.config.margin_m)
    return (
        f"{gate.name} cannot be reached from here in this wind, {wind[1]:.0f} m/s: it lies {off_m:.1f} m from "
        f"{area.nearest_name(gate.en_m)}, its radius is {gate.radius_m:g} m, and no way to it keeps the floor of "
        f"{floor_m:g} m beside her track; it is tried again, and the order skip_goal gives it up"
    )


def is_out_of_reach_said(ctx: StepContext, gate: Gate) -> bool:
    """Return whether that was said of a goal, and is not to be said again."""
    return ctx.is_said(f"{OUT_OF_REACH} {gate.goal}", REACH_S)


def speak_of_reach(ctx: StepContext, gate: Gate) -> None:
    """Say of a goal that no step of the ladder has found a way to that it is not reached in this wind: once."""
    why = "" if is_out_of_reach_said(ctx, gate) else out_of_reach(ctx, gate)
    if why:
        ctx.say(Severity.WARNING, f"{OUT_OF_REACH} {gate.goal}", why, every_s=REACH_S)


def _nearer(ctx: StepContext, target: Gate, gate: int, start: Start, step: Rung) -> Aim:
    """Return a safe place that is nearer than the goal: a refuge, or a roomy place on the way."""
    water, floor_m = ctx.water, min(ctx.config.margin_floor_m, ctx.config.margin_m)
    if water is not None and water.trouble(start.en_m, target.en_m):
        place = waiting_place(water, ctx.voyage.area, start.en_m, floor_m)
        if place is not None and place != start.en_m:
            return Aim(en_m=place, radius_m=ctx.config.loiter_radius_m, gate=-1)
    left = distance_m(start.en_m, target.en_m)
    if ctx.voyage.is_passage:
        left = min(left, ctx.config.horizon_m)
    course = bearing_rad(start.en_m, target.en_m)
    refuges = [r.en_m for r in ctx.voyage.refuges]
    candidates = [p for p in refuges if p != target.en_m and distance_m(start.en_m, p) < left]
    candidates.sort(key=lambda p: distance_m(p, target.en_m))
    candidates += [
        moved(start.en_m, course + side, share * left)
        for share in (0.75, 0.5, 0.35, 0.2)
        for side in (0.0, 0.35, -0.35, 0.8, -0.8)
    ]
    for place in candidates:
        off_marks_m = min((distance_m(place, m.en_m) - m.keep_m for m in marks_of(ctx.voyage)), default=math.inf)
        room_m = min(float(ctx.voyage.area.clearance_m([place])[0]) - step.margin_m, off_marks_m)
        if room_m >= ctx.loiter_swing_m:
            return Aim(en_m=place, radius_m=ctx.config.loiter_radius_m, gate=-1)
    return Aim(en_m=target.en_m, radius_m=target.radius_m, gate=gate)
