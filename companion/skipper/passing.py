"""Passing: which gates the boat has passed, by nearness, round a buoy, or across a line; which she missed."""

from __future__ import annotations

import math

import shapely

from companion.frozen import changed
from companion.skipper.composed import has_sailed
from companion.skipper.planning.searching import end_search, follow_search, lay_sweeps
from companion.skipper.planning.waits import gun_in_s, stay_left_s, utc_s, waits_for_gun
from companion.skipper.step.actions import CancelPlan, Severity
from companion.skipper.step.state import Inside
from companion.skipper.step.turn import FRESH_S, Turn
from companion.skipper.way.gates import Approach, Gate, again, is_on_wrong_side
from companion.skipper.way.geometry import distance_m, leg_distance_m
from companion.skipper.way.line import BEFORE_M, BEYOND_M, ahead_m, crossing, is_between, width_m
from companion.skipper.way.voyage import PointEn

GAP_S = 2.0 + FRESH_S   # between two fixes that belong together


def pass_gates(turn: Turn) -> None:
    """Count the gates passed: by being there, or by the autopilot's count."""
    boat = turn.boat_en
    if boat is None:
        return
    _approach(turn)
    _cross(turn)
    if turn.gate is not None and turn.gate.line is not None and not waits_for_gun(turn, turn.gate):
        turn.set(progress=changed(turn.state.progress, released=turn.gate.goal))
    follow_search(turn)
    while turn.gate is not None and turn.state.mission.route is not None:
        gate, number = turn.gate, turn.state.progress.gate
        if gate.box is not None:
            if not _has_stayed(turn, gate, boat):
                return
            continue
        if gate.field is not None:
            if not has_sailed(turn, gate, boat):
                return
            continue
        if gate.search is not None and gate.sweep[1] == 0:
            lay_sweeps(turn, gate)
            return
        if gate.is_crossed:
            if number in turn.state.mission.route.gate_of[: turn.state.mission.index]:
                _begin_again(turn, gate, boat, f"{gate.name} was passed by outside of its marks: again")
            return
        left = distance_m(boat, gate.en_m)
        counted = number in turn.state.mission.route.gate_of[: turn.state.mission.index]
        near = max(gate.radius_m, turn.config.grid_size_m)
        if not (turn.state.progress.closest_m <= gate.radius_m or (counted and left <= near and not _is_last(turn))
                or _is_near_enough(turn, gate, counted) or _is_before(gate, boat)):
            if counted and left > near and not _is_last(turn):
                # The autopilot has left it behind and we were never near.
                turn.void_route()
                missed(turn)
            return
        if is_on_wrong_side(gate, turn.state.progress.bearing_rad):
            turn.approach(again(gate, boat, turn.state.progress.bearing_rad))
            missed(turn)
            turn.say(Severity.WARNING, "buoy missed", f"{gate.name} was left on the wrong side: again", every_s=0.0)
            return
        if gate.search is not None and gate.ends_goal:
            if lay_sweeps(turn, gate):
                return
            end_search(turn, gate)
            return
        closest = turn.state.progress.closest_m
        reached = (*turn.state.progress.reached, gate.goal) if gate.ends_goal else turn.state.progress.reached
        turn.set(progress=changed(turn.state.progress, gate=number + 1, reached=reached, closest_m=math.inf))
        if gate.ends_goal:
            turn.set(progress=changed(turn.state.progress, bearing_rad=0.0))
            turn.say(Severity.NOTICE, "goal", f"{gate.name} reached, {min(left, closest):.1f} m from it", every_s=0.0)


def _has_stayed(turn: Turn, gate: Gate, boat: PointEn) -> bool:
    """Count the time in a box from entry on; True when it is over, or she was told to go on."""
    box, inside = gate.box, turn.state.progress.inside
    assert box is not None
    if inside is None or inside.goal != gate.goal:
        if not shapely.covers(box.area_en, shapely.points(boat)):
            return False
        inside = Inside(goal=gate.goal, t_s=turn.t_s, utc_s=utc_s(turn))
        turn.set(progress=changed(turn.state.progress, inside=inside))
        turn.say(Severity.NOTICE, "box", f"{gate.name} entered", every_s=0.0)
    is_told = turn.state.progress.released == gate.goal
    if stay_left_s(turn, gate) > 0.0 and not is_told:
        return False
    turn.set(progress=changed(
        turn.state.progress, gate=turn.state.progress.gate + 1, reached=(*turn.state.progress.reached, gate.goal),
        closest_m=math.inf, inside=None))
    why = "told to go on" if is_told else "her time is over"
    turn.say(Severity.NOTICE, "goal", f"{gate.name}: {why} after {inside.age_s(turn.t_s, utc_s(turn)):.0f} s in it",
             every_s=0.0)
    return True


def _is_before(gate: Gate, boat: PointEn) -> bool:
    """Return whether the boat is where the way across the gate's line may begin, though not at the place for it."""
    return gate.is_before_line and gate.line is not None and is_between(gate.line, boat) and (
        ahead_m(gate.line, boat) <= -0.5 * BEFORE_M)


def _cross(turn: Turn) -> None:
    """Count a line that was crossed since the last fix; say so where that was too early, or the wrong way."""
    boat, gate, last = turn.boat_en, turn.gate, turn.state.position.last_seen
    if boat is None or turn.is_raised("position jump"):
        return
    is_blind = turn.state.progress.is_blind or last is None or turn.t_s - last.t_s > GAP_S
    turn.set(progress=changed(turn.state.progress, is_blind=False))
    if gate is None or gate.line is None:
        return
    found = crossing(gate.line, last.en_m, boat) if last is not None and not is_blind else None
    # Sailed on by the autopilot while nobody looked, she is straight behind the line: its leg led across it.
    unseen = is_blind and gate.is_crossed and is_between(gate.line, boat) and (
        0.0 < ahead_m(gate.line, boat) <= BEYOND_M + turn.config.grid_size_m)
    if not unseen and (found is None or (not found.is_forward and not gate.is_crossed)):
        return
    if found is not None and not found.is_forward:
        text = f"{gate.name} was crossed the wrong way: it does not count"
        turn.say(Severity.WARNING, "wrong way", text, every_s=0.0)
        return
    left_s = gun_in_s(turn, gate.line)
    if gate.line.is_start and (left_s is None or left_s > 0.0):
        early = "before its time is known" if left_s is None else f"{left_s:.0f} s before the gun"
        turn.set(progress=changed(turn.state.progress, released=-1))
        _begin_again(turn, gate, boat, f"{gate.name} was crossed {early}: back and again", code="early start")
        return
    following = next((n for n, g in enumerate(turn.gates) if g.goal > gate.goal), len(turn.gates))
    if not gate.is_crossed:
        # Her route leads to the place before the line, which is behind her.
        turn.set(plans=changed(turn.state.plans, asked=f"{gate.name} is crossed"))
    turn.set(progress=changed(
        turn.state.progress, gate=following, reached=(*turn.state.progress.reached, gate.goal), closest_m=math.inf,
        bearing_rad=0.0, missed_s=None))
    how = "while nobody looked" if found is None else (
        f"{min(found.from_port_m, width_m(gate.line) - found.from_port_m):.1f} m inside of the nearer mark")
    after = f", {-left_s:.0f} s after the gun" if gate.line.is_start and left_s is not None else ""
    turn.say(Severity.NOTICE, "goal", f"{gate.name} crossed {how}{after}", every_s=0.0)


def _begin_again(turn: Turn, gate: Gate, boat: PointEn, why: str, *, code: str = "gate missed") -> None:
    """Sail to a line once more, from where the boat is."""
    turn.approach(Approach(goal=gate.goal, en_m=boat))
    missed(turn)
    turn.say(Severity.WARNING, code, why, every_s=0.0)


def _approach(turn: Turn) -> None:
    """Keep the smallest distance to the gate, between the last fix and this one too."""
    boat, gate, last = turn.boat_en, turn.gate, turn.state.position.last_seen
    if boat is None or gate is None:
        return
    way = distance_m(boat, gate.en_m)
    if last is not None and turn.t_s - last.t_s <= GAP_S and not turn.is_raised("position jump"):
        way = min(way, leg_distance_m(gate.en_m, last.en_m, boat))
    turn.set(progress=changed(turn.state.progress, closest_m=min(turn.state.progress.closest_m, way)))


def _is_near_enough(turn: Turn, gate: Gate, counted: bool) -> bool:
    """Return whether the last goal counts as reached although its radius was not: Büsser's grid size, and no better.

    The boat has been at the waypoint by the autopilot's count and loiters in the mission's safe end.
    """
    route = turn.state.mission.route
    if route is None or not counted or not _is_last(turn) or turn.state.progress.closest_m > turn.config.grid_size_m:
        return False
    at_end = turn.state.mission.index >= len(route.items) - 1
    return at_end and (distance_m(route.points_en_m[-1], gate.en_m) > gate.radius_m or turn.is_raised("mission ended"))


def _is_last(turn: Turn) -> bool:
    return turn.state.progress.gate == len(turn.gates) - 1


def missed(turn: Turn) -> None:
    """Have the gate that is next planned for from where the boat is; what is being planned was for another."""
    if turn.state.pending.plan is not None:
        turn.act(CancelPlan(request_id=turn.state.pending.plan.request_id))
    turn.set(
        progress=changed(turn.state.progress, missed=turn.state.progress.missed + 1, missed_s=turn.t_s),
        pending=changed(turn.state.pending, plan=None))
