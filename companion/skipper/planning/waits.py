"""Waiting on the way: for a start line's gun, and in a box.

When the gun is, where the boat waits for it, when it must sail to be at the line; how long it stays in a box.
"""

from __future__ import annotations

import math

from companion.geo.angles import difference_rad
from companion.skipper.step.context import StepContext
from companion.skipper.step.missions import roomy_m
from companion.skipper.way import Gate, Line, PointEn, bearing_rad, distance_m, moved
from companion.skipper.way.line import ahead_m, course_rad

WAIT_M = 40.0  # from where the line is crossed: the loiter swings 12 m, and drifts
FARTHEST_M = 70.0
SIDES_DEG = (0.0, 15.0, -15.0, 30.0, -30.0, 45.0, -45.0)  # of the course across the line, from the wait to it
SAILABLE_RAD = math.radians(8.0)  # outside the no-go zone by this, the leg to the line is one board
SLOWEST_MPS = 0.3
RESERVE_S = 8.0  # later than the estimate: gusts carry the boat there 4 s before it (measured), and early is worse
NEAR_M = 120.0  # from farther away the time is not foreseen so well: it goes to the line first, and waits there
FAR_SHARE = 0.6


def gun_in_s(ctx: StepContext, line: Line) -> float | None:
    """Return how long it is to a start line's gun [s], negative after it; None while the time is not known.

    A line without one is open for ever.
    """
    now_s, state = ctx.utc_s, ctx.state
    if line.not_before_s is not None:
        return None if now_s is None else line.not_before_s - now_s
    if line.after_s is None:
        return -math.inf
    if state.voyage.set_sail_utc_s is not None and now_s is not None:
        return state.voyage.set_sail_utc_s + line.after_s - now_s
    return line.after_s - state.voyage.under_way_s


def waits_for_gun(ctx: StepContext, gate: Gate) -> bool:
    """Return whether it is too early to sail for a gate's line: from where it is it would be there before the gun."""
    line = gate.line
    if line is None or not line.is_start or ctx.state.progress.released == gate.goal:
        return False
    left_s = gun_in_s(ctx, line)
    return left_s is None or left_s > _to_line_s(ctx, gate) - RESERVE_S


def _to_line_s(ctx: StepContext, gate: Gate) -> float:
    """Return how long the boat sails to the line at the soonest [s]; the plan and its upload come on top of it."""
    boat, wind, line = ctx.boat_en, ctx.wind_mean, gate.line
    if boat is None or wind is None or line is None or ctx.gate is not gate or ahead_m(line, boat) >= 0.0:
        return 0.0
    cut = _cut(gate)
    closed = ctx.planned_no_go_rad
    twa = abs(difference_rad(wind[0], bearing_rad(boat, cut)))
    speed = ctx.voyage.boat.polar.speed_mps(max(twa, closed), wind[1])
    if twa < closed:  # the way of two boards
        speed *= math.cos(closed) / max(math.cos(twa), 0.1)
    time_s = distance_m(boat, cut) / max(speed, SLOWEST_MPS)
    return time_s if distance_m(boat, cut) <= NEAR_M else FAR_SHARE * time_s


def _cut(gate: Gate) -> PointEn:
    """Return where a gate's line is crossed."""
    assert gate.line is not None
    return moved(gate.en_m, course_rad(gate.line), -ahead_m(gate.line, gate.en_m))


def waiting_en(ctx: StepContext, gate: Gate) -> PointEn:
    """Return where to wait for the gun: near where the line is crossed, with room, and one board away from it."""
    assert gate.line is not None
    cut, course, wind, room_m = _cut(gate), course_rad(gate.line), ctx.wind_mean, roomy_m(ctx.known_config)
    best, best_cost = moved(cut, course + math.pi, WAIT_M), math.inf
    for far_m in (WAIT_M, FARTHEST_M):
        for side in SIDES_DEG:
            heading = course + math.radians(side)
            place = moved(cut, heading + math.pi, far_m)
            lacks_m = max(0.0, room_m - float(ctx.voyage.area.clearance_m([place])[0]))
            twa = math.pi if wind is None else abs(difference_rad(wind[0], heading))
            is_closed = twa < ctx.planned_no_go_rad + SAILABLE_RAD
            cost = 10.0 * lacks_m + (20.0 if is_closed else 0.0) + far_m / 10.0 + abs(side) / 15.0
            if cost < best_cost:
                best, best_cost = place, cost
    return best


def stay_left_s(ctx: StepContext, gate: Gate) -> float:
    """Return how long the boat still stays in a gate's box, or sails by its field [s]; inf: until told, or not yet."""
    inside, box = ctx.state.progress.inside, gate.box or gate.field
    if box is None or box.for_s is None or inside is None or inside.goal != gate.goal:
        return math.inf
    return box.for_s - inside.age_s(ctx.t_s, ctx.utc_s)
