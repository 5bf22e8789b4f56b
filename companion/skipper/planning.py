"""Asking for plans: from where, to where, with which step of the ladder."""

from __future__ import annotations

import math
from dataclasses import replace

from companion.errors import InputError
from companion.messages import Mode
from companion.planner import Problem
from companion.skipper.actions import CancelPlan, ReplanReason, RequestPlan, Severity
from companion.skipper.beating import problem_beat
from companion.skipper.geometry import bearing_rad, distance_m, moved
from companion.skipper.judge import half_width_rad
from companion.skipper.ladder import Rung, rungs
from companion.skipper.problem import Aim, Start, aim_at, problem_dict, repaired
from companion.skipper.route import path_length_m
from companion.skipper.state import PendingPlan
from companion.skipper.traffic import shares
from companion.skipper.turn import Turn

UPLOAD_LATENCY_S = 1.5   # item protocol, a few dozen items, and the read-back
SLOW_MPS = 0.5           # slower than this the course over ground says nothing about the heading


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
        # Stopped, or turning in circles, she is where she is.
        stopped = turn.state.own_mode in {Mode.HOLD, Mode.LOITER}
        sailing = turn.state.sailing and vehicle.speed_mps > SLOW_MPS and not stopped
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
