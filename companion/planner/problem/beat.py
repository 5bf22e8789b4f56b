"""Legs that the autopilot beats by itself: straight to a point upwind, tacking within its corridor about the line.

ArduRover sails a leg inside its no-go zone at exactly the zone's edge, follows each shift of the wind at once, and
tacks where it is a corridor off the line. A planned course cannot: it must keep clear of the zone by what the wind
may turn until it is sailed. Where the water is clear a corridor to either side, handing the beat over is faster the
more uncertain the wind is, and never closed by a shift. ``Problem.beat`` says what the autopilot does; a leg inside
the widened zone is then allowed if it is clear by ``clearance_m``, and takes ``beat_s``.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import shapely

from companion.geo.angles import wrap_pi
from companion.planner.problem.current import solve_heading
from companion.planner.problem.parts import NO_CURRENT, NO_GO_SLACK_RAD, Beat
from companion.planner.problem.value import Problem

ANGLES = 46   # nodes of the beaten speed inside the zone: a degree apart at 45 degrees


def beat_s(problem: Problem, beat: Beat, dx_m: float, dy_m: float) -> tuple[float, float]:
    """Return (time [s], tacks) of a leg (dx, dy) east, north that the autopilot beats; outside its zone it follows.

    Both close-hauled courses in the share that makes the leg good; each tack costs ``tack_s``, and a corridor of
    ``corridor_m`` to either side is crossed from edge to edge.
    """
    length = math.hypot(dx_m, dy_m)
    if problem.current.drift_mps > 0.0:
        return _in_a_current(problem, beat, length, math.atan2(dx_m, dy_m))
    off = abs(wrap_pi(math.atan2(dx_m, dy_m) - problem.wind.twd_from_rad))
    half = beat.no_go_half_rad
    if off >= half:
        speed = problem.boat.speed_mps(off)
        return (length / speed if speed > 0.0 else math.inf), 0.0
    speed = problem.boat.speed_mps(half)
    if speed <= 0.0:
        return math.inf, 0.0
    across = length * math.sin(half + off) * math.sin(half - off) / math.sin(2.0 * half)  # on each tack, off the line
    tacks = across / beat.corridor_m
    return length * math.cos(off) / (speed * math.cos(half)) + tacks * beat.tack_s, tacks


def _in_a_current(problem: Problem, beat: Beat, length_m: float, course_rad: float) -> tuple[float, float]:
    """Return (time [s], tacks) over the ground: what beating makes good through the water, carried along by it.

    The autopilot beats about the wind over the ground and this about that over the water, a few degrees off: the speed
    made good to windward is flat there. A tack takes its time in place, over the ground, as every turn of a plan does.
    """
    heading, speed = solve_heading(beaten(problem, beat), course_rad, 0.0)
    if speed <= 0.0:
        return math.inf, 0.0
    sailed_s, still = length_m / speed, replace(problem, current=NO_CURRENT)
    through_m = sailed_s * beaten_mps(still, replace(beat, tack_s=0.0), wrap_pi(heading - problem.wind.twd_from_rad))
    _, tacks = beat_s(still, beat, through_m * math.sin(heading), through_m * math.cos(heading))
    return sailed_s + tacks * beat.tack_s, tacks


def beaten_mps(still: Problem, beat: Beat, off_rad: float) -> float:
    """Return the speed made good through the water at an angle to the wind, beating where that is in the zone [m/s]."""
    course = still.wind.twd_from_rad + off_rad
    spent_s, _ = beat_s(still, beat, math.sin(course), math.cos(course))
    return 1.0 / spent_s if spent_s > 0.0 and math.isfinite(spent_s) else 0.0


def is_clear(problem: Problem, line: shapely.LineString) -> bool:
    """Return whether the problem has a beat and the leg's corridor is clear: it may be left to the autopilot."""
    if problem.beat is None:
        return False
    solid = problem.beat_solid
    return solid.is_empty or not bool(shapely.intersects(solid, line))


def beaten(problem: Problem, beat: Beat) -> Problem:
    """Return the problem of a boat that goes straight everywhere, in water narrower by the corridor.

    Its polar inside the zone is the speed made good by beating, in a current without the time of the tacks, which is
    added to its paths when they are scored. Every path of it is a path of ``problem``.
    """
    boat = problem.boat
    still, tacking = replace(problem, current=NO_CURRENT), beat
    if problem.current.drift_mps > 0.0:
        tacking = replace(beat, tack_s=0.0)   # while she tacks in place a share of her speed would be carried back
    inside = [float(a) for a in np.linspace(0.0, beat.no_go_half_rad, ANGLES)]
    made = [beaten_mps(still, tacking, angle) for angle in inside]
    outside = [(a, v) for a, v in zip(boat.polar_twa_rad, boat.polar_mps, strict=True) if a > beat.no_go_half_rad]
    clear = beat.clearance_m
    targets = tuple(replace(t, radius_m=t.radius_m + beat.corridor_m) for t in problem.targets)
    return replace(
        problem, beat=None, risk=None,
        zone=None if problem.zone is None else replace(
            problem.zone, half_rad=max(0.0, problem.zone.half_rad - 2.0 * NO_GO_SLACK_RAD),
            open_half_rad=min(problem.no_go_max_rad, math.pi)),
        delta_s=0.5, targets=targets,
        clearance_floor_m=problem.clearance_floor_m + clear,
        wind=replace(problem.wind, sigma=type(problem.wind.sigma)()),
        boat=replace(
            boat, no_go_half_rad=0.0, polar_twa_rad=(*inside, *(a for a, _ in outside)),
            polar_mps=(*made, *(v for _, v in outside))),
    )
