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
from functools import cached_property, lru_cache

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray

from companion.geo.angles import wrap_pi, wrap_two_pi
from companion.geo.kernels import first_met
from companion.planner.plan import Leg
from companion.planner.problem.parts import CLEAR_TURN_RAD, FENCE, NO_CURRENT, NO_GO_SLACK_RAD, TOUCH_M, Beat
from companion.planner.problem.value import Problem, resolved

# Headings in a current: which way to point so that the track over the ground is the leg.

_HEADINGS = 720


def solve_heading(p: Problem, course_rad: float, t_s: float) -> tuple[float, float]:
    """Return (heading [rad], speed over ground [m/s]) that makes ``course_rad`` good in the current.

    All headings whose velocity over the ground lies along the course are found between 720 samples by bisection
    on the cross product. The fastest that keeps clear of the no-go zone at ``t_s`` and of the deepest angle wins;
    without such a one the fastest at all (its leg then fails the no-go check); (course, 0) when none makes way.
    """
    dx, dy = math.sin(course_rad), math.cos(course_rad)
    cx = p.current.drift_mps * math.sin(p.current.set_rad)
    cy = p.current.drift_mps * math.cos(p.current.set_rad)
    twd, half = p.wind.twd_from_rad, p.no_go_half_rad(t_s)

    def speed(h: float) -> float:
        return p.boat.speed_mps(wrap_pi(h - twd))

    def cross(h: float) -> float:
        v = speed(h)
        return (v * math.sin(h) + cx) * dy - (v * math.cos(h) + cy) * dx

    grid = course_rad + np.linspace(-math.pi, math.pi, _HEADINGS + 1)
    v = np.interp(np.abs((grid - twd + math.pi) % (2.0 * math.pi) - math.pi), p.boat.polar_twa_rad, p.boat.polar_mps)
    side = (v * np.sin(grid) + cx) * dy - (v * np.cos(grid) + cy) * dx
    best, best_any = (course_rad, 0.0), (course_rad, 0.0)
    for i in np.nonzero(side[:-1] * side[1:] <= 0.0)[0]:
        lo, hi = float(grid[i]), float(grid[i + 1])
        low = cross(lo)
        for _ in range(60):
            mid = 0.5 * (lo + hi)
            value = cross(mid)
            lo, hi, low = (mid, hi, value) if (value > 0.0) == (low > 0.0) else (lo, mid, low)
        h = 0.5 * (lo + hi)
        made = speed(h)
        along = (made * math.sin(h) + cx) * dx + (made * math.cos(h) + cy) * dy
        twa = abs(wrap_pi(h - twd))
        if along > best_any[1]:
            best_any = (h, along)
        if along > best[1] and twa >= half - 1e-9 and twa <= p.boat.max_twa_rad + 1e-9:
            best = (h, along)
    return best if best[1] > 0.0 else best_any


# Legs that the autopilot beats by itself: straight to a point upwind, tacking within its corridor about the line.
#
# ArduRover sails a leg inside its no-go zone at exactly the zone's edge, follows each shift of the wind at once, and
# tacks where it is a corridor off the line. A planned course cannot: it must keep clear of the zone by what the wind
# may turn until it is sailed. Where the water is clear a corridor to either side, handing the beat over is faster the
# more uncertain the wind is, and never closed by a shift. ``Problem.beat`` says what the autopilot does; a leg inside
# the widened zone is then allowed if it is clear by ``clearance_m``, and takes ``beat_s``.

ANGLES = 46  # nodes of the beaten speed inside the zone: a degree apart at 45 degrees


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
        tacking = replace(beat, tack_s=0.0)  # while the boat tacks in place a share of its speed would be carried back
    inside = [float(a) for a in np.linspace(0.0, beat.no_go_half_rad, ANGLES)]
    made = [beaten_mps(still, tacking, angle) for angle in inside]
    outside = [(a, v) for a, v in zip(boat.polar_twa_rad, boat.polar_mps, strict=True) if a > beat.no_go_half_rad]
    clear = beat.clearance_m
    targets = tuple(replace(t, radius_m=t.radius_m + beat.corridor_m) for t in problem.targets)
    return replace(
        problem,
        beat=None,
        risk=None,
        zone=None
        if problem.zone is None
        else replace(
            problem.zone,
            half_rad=max(0.0, problem.zone.half_rad - 2.0 * NO_GO_SLACK_RAD),
            open_half_rad=min(problem.no_go_max_rad, math.pi),
        ),
        delta_s=0.5,
        targets=targets,
        clearance_floor_m=problem.clearance_floor_m + clear,
        wind=replace(problem.wind, sigma=type(problem.wind.sigma)()),
        boat=replace(
            boat,
            no_go_half_rad=0.0,
            polar_twa_rad=(*inside, *(a for a, _ in outside)),
            polar_mps=(*made, *(v for _, v in outside)),
        ),
    )


# The exact test of a leg against everything solid, and its clearance.
#
# The definition is ``Problem.eval_solid``: the union of all obstacles and of what is outside the fence, shrunk by the
# slack. To unite a hundred thousand vertices, or thousands of slivers that cross each other, takes longer than to plan
# among them, and what is solid about a leg depends only on what is near it: in a large problem only that is united.

LARGE = 1_000
"""Vertices above which the union of everything is not made."""
_REACH_M = 0.05
_CORRIDOR_M = 0.5


class SolidObstacles:
    """Everything solid of a problem."""

    def __init__(self, problem: Problem) -> None:
        self._problem = problem
        self.is_large = sum(shapely.get_num_coordinates(g) for g in problem.obstacles) > LARGE
        self._parts = np.asarray(
            [g if g.is_valid else shapely.make_valid(g) for g in problem.obstacles if not g.is_empty], dtype=object
        )
        self._tree = shapely.STRtree(self._parts)
        self._fence = problem.fence_polygon
        self._line = None if self._fence is None else self._fence.boundary
        for shape in (self._fence, self._line):
            if shape is not None:
                shapely.prepare(shape)

    @cached_property
    def tree(self) -> shapely.STRtree:
        """Everything solid, the fence's line included, without the clearance floor."""
        shapes = list(self._parts)
        if self._problem.fence is not None:
            shapes.append(self._problem.fence.boundary)
        return shapely.STRtree(np.asarray(shapes, dtype=object))

    def hits(self, shape: shapely.Geometry) -> bool:
        """Return whether a leg or point collides: deeper than the slack in an obstacle or outside the fence."""
        if not self.is_large:
            solid = self._problem.eval_solid
            return not solid.is_empty and bool(solid.intersects(shape))
        floor = self._problem.clearance_floor_m
        near = self._tree.query(shape, predicate="dwithin", distance=floor + _REACH_M)
        is_inside = self._fence is None or (
            bool(self._fence.contains_properly(shape)) and not bool(shapely.dwithin(self._line, shape, _REACH_M))
        )
        if len(near) == 0 and is_inside:
            return False
        corridor = shape.buffer(_CORRIDOR_M)
        within = shape.buffer(_CORRIDOR_M + floor) if floor > 0.0 else corridor
        pieces = list(shapely.intersection(self._parts[near], within))
        if floor > 0.0:
            pieces = [g.buffer(floor) for g in pieces]
        if not is_inside:
            pieces.append(corridor.difference(self._fence))
        solid = shapely.union_all(pieces).buffer(-TOUCH_M, join_style="mitre", mitre_limit=5.0)
        return bool(solid.intersects(shape))

    def clearances_m(self, lines: NDArray[np.object_]) -> NDArray[np.float64] | None:
        """Return each line's distance to the nearest obstacle or fence line; None where there is neither."""
        nearest = np.full(len(lines), np.inf)
        if len(self._parts):
            (which, _), distance = self._tree.query_nearest(lines, return_distance=True, all_matches=False)
            nearest[which] = np.maximum(0.0, distance - self._problem.clearance_floor_m)
        if self._line is not None and not self._line.is_empty:
            nearest = np.minimum(nearest, shapely.distance(self._line, lines))
        return nearest if len(self._parts) or self._line is not None else None


@lru_cache(maxsize=8)  # by identity; an index of thousands of shapes is made once for a search
def shore_of(problem: Problem) -> SolidObstacles:
    """Return the exact test of legs against all that is solid in the problem."""
    return SolidObstacles(problem)


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
    legs: tuple[Leg, ...]


def endpoint_error(p: Problem) -> str | None:
    """Return why no plan can exist on inspection of the endpoints, or None."""
    for name, en in (("start", p.start_en), ("goal", p.goal_en)):
        if shore_of(p).hits(shapely.Point(en)):
            return f"{name} is {solid_words(p, en)}"
    return None


def solid_words(p: Problem, en: tuple[float, float]) -> str:
    """Return where a place is that no path may come to: in what, or nearer to it than is kept clear.

    Obstacles may have been grown by a margin, and the fence shrunk: where the problem says what is solid as it is
    (``Tracking``), the two are told apart, with the metres; else both are named.
    """
    point, track = shapely.Point(en), p.tracking
    far_m = [float(shapely.distance(o, point)) for o in p.obstacles]
    nearest = min(range(len(far_m)), key=far_m.__getitem__, default=None)
    if nearest is not None and far_m[nearest] <= p.clearance_floor_m:
        name, grown = p.obstacle_name(nearest), p.obstacles[nearest]
        if track is None:
            return f"inside {name}, or nearer to it than is kept clear"
        within = shapely.buffer(grown, TARGET_SLACK_M)  # as it is written, to the millimetre
        own_m = [float(shapely.distance(s, point)) for s in track.solids if shapely.covers(within, s)]
        if not own_m:  # a mark, or what of the water is kept clear of more than one thing
            return f"within what is kept clear of {name}"
        if min(own_m) <= 0.0:
            return f"inside {name}"
        kept_m = min(own_m) + float(shapely.distance(grown.boundary, point)) + p.clearance_floor_m
        return f"{min(own_m):.1f} m from {name}, and {kept_m:.1f} m are kept clear of it"
    beyond = f"outside {FENCE}" if p.fence_name == FENCE else f"beyond the edge of {p.fence_name}"
    if track is None:
        return f"{beyond}, or nearer to it than is kept clear"
    if track.limits is not None and not shapely.covers(track.limits, point):
        return beyond
    if track.limits is None:
        return "outside the water of this leg"
    off_m = float(shapely.distance(track.limits.boundary, point))
    if p.fence is not None and off_m > float(shapely.distance(track.limits.boundary, p.fence)) + TARGET_SLACK_M:
        return f"{off_m:.1f} m from {p.fence_name}, in water that no way leads to that is wide enough"
    return f"{off_m:.1f} m from {p.fence_name}, nearer than is kept clear"


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
    return solve_heading(p, course, t_s)


def is_zoned(p: Problem, dx_m: float, dy_m: float) -> bool:
    """Return whether the autopilot does not follow a leg of this ground direction as a line (``AutopilotBeatZone``)."""
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
        return Evaluation(
            is_feasible=False,
            reasons=(text,),
            time_s=math.inf,
            sail_s=0.0,
            turn_s=0.0,
            length_m=0.0,
            tacks=0,
            gybes=0,
            legs=(),
        )
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
            reasons.append(
                f"leg {i}: the boat has turned {math.degrees(abs(wound)):.0f} deg without a leg of "
                f"{p.boat.room_m:.1f} m"
            )
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
            reasons.append(
                f"leg {i}: the autopilot would beat it, or not keep to it, in the wind that it knows, and "
                "there is no room for that"
            )
        elif is_closed:
            reasons.append(
                f"leg {i}: |TWA| {math.degrees(abs(twa)):.2f} deg is inside the no-go zone {math.degrees(half):.2f} deg"
            )
        if abs(twa) > p.boat.max_twa_rad + NO_GO_SLACK_RAD:
            reasons.append(
                f"leg {i}: |TWA| {math.degrees(abs(twa)):.2f} deg is beyond the limit "
                f"{math.degrees(p.boat.max_twa_rad):.1f} deg"
            )
        if not math.isfinite(t1):
            reasons.append(f"leg {i}: the boat makes no way on it")
        if shore_of(p).hits(shapely.LineString([a, b])):
            reasons.append(f"leg {i}: collides with an obstacle or the fence")
        hit = target_hit(p, a, a, t - spent, t)
        hit = target_hit(p, a, b, t, t1, 0.0 if beat is None else beat.corridor_m) if hit is None else hit
        if hit is not None:
            reasons.append(f"leg {i}: meets target {hit}")
        legs.append(
            Leg(
                from_en=a,
                to_en=b,
                heading_rad=wrap_two_pi(h),
                twa_rad=wrap_pi(-twa),
                turn_rad=turn,
                length_m=length,
                speed_mps=v,
                start_s=t,
                end_s=t1,
                sigma_rad=sigma,
                no_go_half_rad=half,
                is_beat=beat is not None,
                manoeuvre=named,
            )
        )
        sail_s += t1 - t
        length_m += length
        t, heading = t1, h
    return Evaluation(
        is_feasible=not reasons,
        reasons=tuple(reasons),
        time_s=t,
        sail_s=sail_s,
        turn_s=turn_s,
        length_m=length_m,
        tacks=tacks,
        gybes=gybes,
        legs=tuple(legs),
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
    """
    if not p.targets:
        return None
    hit, _ = first_met(*a, *b, t0_s, t1_s, np.array([target.row(wide_m - TARGET_SLACK_M) for target in p.targets]))
    return hit if hit >= 0 else None
