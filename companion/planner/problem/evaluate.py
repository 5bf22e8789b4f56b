"""The exact scorer: a path walked leg by leg, its cost, and every reason why it is not feasible.

cost = Σ leg length / speed(TWA) + Σ |heading change| / turn rate (+ tack and gybe losses where the problem has
them), the first turn from the start heading included. Turns go the shorter way round, in place, and take time:
the clock that drives sigma(t) runs through them. Where tacking or gybing costs something, or cannot be done, the
boat may turn the long way round, by way of a leg of its own: between legs that are long enough for that
(``BoatLimits.room_m``) it turns half a circle at most. A leg must keep |TWA| >= no-go half angle at every instant, or,
where the problem lets the autopilot beat, be clear by its corridor.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, replace

import numpy as np
import shapely
from numpy.typing import ArrayLike

from companion.geo.angles import wrap_pi, wrap_two_pi
from companion.planner.plan import Leg
from companion.planner.problem.beat import beat_s, is_clear
from companion.planner.problem.parts import CLEAR_TURN_RAD, NO_GO_SLACK_RAD
from companion.planner.problem.sharing import resolved
from companion.planner.problem.shore import shore_of
from companion.planner.problem.value import Problem

START_SLACK_M = 0.01
GOAL_SLACK_M = 1e-6
TARGET_SLACK_M = 1e-3


@dataclass(frozen=True, slots=True, kw_only=True)
class Evaluation:
    """What the scorer says of a path. ``time_s`` is its cost even where it is not feasible."""

    is_feasible: bool
    reasons: tuple[str, ...]
    time_s: float
    sail_s: float
    turn_s: float
    length_m: float
    tacks: int
    gybes: int
    min_margin_rad: float
    legs: tuple[Leg, ...]


def endpoint_error(p: Problem) -> str | None:
    """Return why no plan can exist on inspection of the endpoints, or None."""
    if shore_of(p).hits(shapely.Point(p.start_en)):
        return "start is inside an obstacle or outside the fence"
    if shore_of(p).hits(shapely.Point(p.goal_en)):
        return "goal is inside an obstacle or outside the fence"
    return None


def manoeuvre(before_rad: float, after_rad: float) -> str:
    """Return what a turn between two angles to the wind is, the shorter way round: "tack", "gybe" or ""."""
    if not before_rad * after_rad < 0.0:
        return ""
    return "tack" if abs(before_rad) + abs(after_rad) < math.pi else "gybe"


def worst_no_go(p: Problem, t0_s: float, t1_s: float) -> tuple[float, float]:
    """Return the largest no-go half angle and sigma [rad] over [t0, t1]."""
    times = [t0_s, t1_s, *(h for h in p.wind.sigma.horizon_s if t0_s < h < t1_s)]
    return max(p.no_go_half_rad(t) for t in times), max(p.wind.sigma.at(t) for t in times)


def ground_track(p: Problem, dx_m: float, dy_m: float, t_s: float = 0.0) -> tuple[float, float]:
    """Return (heading through the water [rad], speed over ground [m/s]) along a ground direction.

    Without a current the heading is the direction. With one it is the fastest heading that makes the track good
    and keeps the no-go zone of ``t_s``, or the fastest at all, or (direction, 0) when there is none.
    """
    course = math.atan2(dx_m, dy_m)
    if p.current.drift_mps == 0.0:
        return course, p.boat.speed_mps(wrap_pi(course - p.wind.twd_from_rad))
    from companion.planner.problem.current import solve_heading

    return solve_heading(p, course, t_s)


def is_zoned(p: Problem, dx_m: float, dy_m: float) -> bool:
    """Return whether the autopilot does not follow a leg of this ground direction as a line: see ``Zone``."""
    if p.zone is None or p.current.drift_mps == 0.0:
        return False
    return abs(wrap_pi(math.atan2(dx_m, dy_m) - p.zone.from_rad)) < p.zone.half_rad - NO_GO_SLACK_RAD


def evaluate(problem: Problem, waypoints_en: ArrayLike) -> Evaluation:
    """Walk the path (n, 2); agrees with the format's definition where no extension is used."""
    p = resolved(problem)
    reasons: list[str] = []
    points = [(float(x), float(y)) for x, y in np.asarray(waypoints_en, dtype=np.float64).reshape(-1, 2)]
    if not points or not all(math.isfinite(c) for q in points for c in q):
        text = "non-finite waypoint" if points else "no path"
        return Evaluation(is_feasible=False, reasons=(text,), time_s=math.inf, sail_s=0.0, turn_s=0.0, length_m=0.0,
                          tacks=0, gybes=0, min_margin_rad=math.inf, legs=())
    if math.dist(points[0], p.start_en) > START_SLACK_M:
        reasons.append("first waypoint is not the start")
    points[0] = p.start_en
    if math.dist(points[-1], p.goal_en) > p.goal_radius_m + GOAL_SLACK_M:
        reasons.append("last waypoint is outside the goal disc")
    error = endpoint_error(p)
    if error:
        reasons.append(error)
    clean = [points[0]]
    for q in points[1:]:
        if math.dist(q, clean[-1]) > 1e-9:
            clean.append(q)

    twd, heading, t = p.wind.twd_from_rad, p.start_heading_rad, 0.0
    legs: list[Leg] = []
    turn_s = sail_s = length_m = 0.0
    tacks = gybes = 0
    wound = 0.0  # turned since the last leg that has room for a turn the long way round
    for i, (a, b) in enumerate(itertools.pairwise(clean)):
        dx, dy = b[0] - a[0], b[1] - a[1]
        length = math.hypot(dx, dy)
        h, v = ground_track(p, dx, dy, t)
        turn = wrap_pi(h - heading)
        spent = abs(turn) / p.boat.turn_rate_radps
        # heading less wind, as the format has it; a Leg carries the house's angle, positive to starboard
        before, twa = wrap_pi(heading - twd), wrap_pi(h - twd)
        named = manoeuvre(before, twa)
        if named == "tack":
            tacks += 1
            spent += p.boat.tack_loss_s
        elif named == "gybe":
            gybes += 1
            spent += p.boat.gybe_loss_s
        if not p.boat.can_tack and before * twa < 0.0 and abs(before) + abs(twa) < math.pi + CLEAR_TURN_RAD - 1e-6:
            reasons.append(f"leg {i}: the turn into it is a tack, or too near to one, and this boat cannot tack")
        wound += turn
        if i > 0 and p.boat.room_m > 0.0 and abs(wound) > p.boat.most_turn_rad + NO_GO_SLACK_RAD:
            reasons.append(f"leg {i}: the boat has turned {math.degrees(abs(wound)):.0f} deg without a leg of "
                           f"{p.boat.room_m:.1f} m")
        if length >= p.boat.room_m - 1e-6:
            wound = 0.0
        t += spent
        turn_s += spent
        t1 = t + (length / v if v > 0.0 else math.inf)
        half, sigma = worst_no_go(p, t, min(t1, 1e12))
        zoned = is_zoned(p, dx, dy)
        is_closed = abs(twa) - half < -NO_GO_SLACK_RAD or zoned
        may_beat = is_closed and p.boat.can_tack and (zoned or p.current.drift_mps == 0.0)
        beat = p.beat if may_beat and is_clear(p, shapely.LineString([a, b])) else None
        if beat is not None:
            beaten_s, crossings = beat_s(p, beat, dx, dy)
            tacks += round(crossings)
            t1, v = t + beaten_s, length / beaten_s
        elif zoned:
            reasons.append(f"leg {i}: the autopilot would beat it, or not keep to it, in the wind that it knows, and "
                           "there is no room for that")
        elif is_closed:
            reasons.append(f"leg {i}: |TWA| {math.degrees(abs(twa)):.2f} deg is inside the no-go zone "
                           f"{math.degrees(half):.2f} deg")
        if abs(twa) > p.boat.max_twa_rad + NO_GO_SLACK_RAD:
            reasons.append(f"leg {i}: |TWA| {math.degrees(abs(twa)):.2f} deg is beyond the limit "
                           f"{math.degrees(p.boat.max_twa_rad):.1f} deg")
        if not math.isfinite(t1):
            reasons.append(f"leg {i}: the boat makes no way on it")
        if shore_of(p).hits(shapely.LineString([a, b])):
            reasons.append(f"leg {i}: collides with an obstacle or the fence")
        hit = target_hit(p, a, a, t - spent, t)
        hit = target_hit(p, a, b, t, t1, 0.0 if beat is None else beat.corridor_m) if hit is None else hit
        if hit is not None:
            reasons.append(f"leg {i}: meets target {hit}")
        legs.append(Leg(from_en=a, to_en=b, heading_rad=wrap_two_pi(h), twa_rad=wrap_pi(-twa), turn_rad=turn,
                        length_m=length, speed_mps=v, start_s=t, end_s=t1, sigma_rad=sigma, no_go_half_rad=half,
                        is_beat=beat is not None, manoeuvre=named))
        sail_s += t1 - t
        length_m += length
        t, heading = t1, h
    return Evaluation(
        is_feasible=not reasons, reasons=tuple(reasons), time_s=t, sail_s=sail_s, turn_s=turn_s, length_m=length_m,
        tacks=tacks, gybes=gybes, legs=tuple(legs),
        min_margin_rad=min((leg.margin_rad for leg in legs if not leg.is_beat), default=math.inf),
    )


def clearances(p: Problem, legs: tuple[Leg, ...]) -> tuple[Leg, ...]:
    """Return the legs with ``clearance_m`` filled in: the distance to the nearest obstacle or fence line."""
    if not legs:
        return legs
    nearest = shore_of(p).clearances_m(np.asarray([shapely.LineString([leg.from_en, leg.to_en]) for leg in legs]))
    if nearest is None:
        return legs
    return tuple(replace(leg, clearance_m=float(d)) for leg, d in zip(legs, nearest, strict=True))


def target_hit(
    p: Problem, a: tuple[float, float], b: tuple[float, float], t0_s: float, t1_s: float, wide_m: float = 0.0
) -> int | None:
    """Return the first target whose disc the boat enters between a at t0 and b at t1 (constant speed), or None.

    The boat may be ``wide_m`` off the line.

    The squared distance minus the squared radius is a quadratic in time: its minimum over the common window is
    exact.
    """
    for i, target in enumerate(p.targets):
        lo, hi = max(t0_s, target.from_s), min(t1_s, target.until_s)
        if hi < lo:
            continue
        span = t1_s - t0_s
        ux, uy = ((b[0] - a[0]) / span, (b[1] - a[1]) / span) if span > 0.0 and math.isfinite(span) else (0.0, 0.0)
        rx = a[0] + ux * (lo - t0_s) - target.x_m - target.vx_mps * lo
        ry = a[1] + uy * (lo - t0_s) - target.y_m - target.vy_mps * lo
        wx, wy = ux - target.vx_mps, uy - target.vy_mps
        radius, g = max(0.0, target.radius_m + wide_m + target.growth_mps * lo - TARGET_SLACK_M), target.growth_mps
        c2, c1, c0 = wx * wx + wy * wy - g * g, rx * wx + ry * wy - radius * g, rx * rx + ry * ry - radius * radius
        duration = hi - lo
        candidates = [0.0, duration]
        if c2 > 0.0 and 0.0 < -c1 / c2 < duration:
            candidates.append(-c1 / c2)
        if any((c2 * s + 2.0 * c1) * s + c0 < 0.0 for s in candidates if math.isfinite(s)):
            return i
    return None
