"""What is provable: lower bounds on the time, and that there is no path at all.

Bound = shortest path of the sailing-time metric (visibility graph) + the turning that every path needs. Where the
no-go zone grows with time, the progress that is possible in a direction n up to time T is the integral of the
support function of the velocities allowed at each moment; it must reach the goal, which bounds T from below and
sometimes proves that the wind closes the goal for good.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import shapely

from companion.planner.problem.parts import NO_GO_SLACK_RAD, TOUCH_M
from companion.planner.problem.value import Problem
from companion.planner.search.boards import make_boards
from companion.planner.search.gauge import Courses, Gauge, make_gauge, velocities
from companion.planner.search.kernels import Floats
from companion.planner.search.visibility import circle_cuts, geodesics, graph_nodes
from companion.planner.search.world import World, make_world, polygons

_NORMALS = 48
_STEPS = 240
_ANGLES = 901
LATE = 0.9
"""Share of the path's time whose zone gives the metric of ``Bound.sharpen_late``: the bound is flat about it."""
MOST_LATE_RAD = math.radians(86.0)


def turning_s(world: World) -> float:
    """Return the least time [s] that any path spends turning, tacks and gybes included.

    All courses sailed lie in the arc of headings swept, which holds the start heading; the displacement to some
    point of the goal's disc is a non-negative mixture of the courses, so an arc below half a turn holds its
    direction, and when no course there is allowed it holds allowed ones on both sides of the zone: the boat then
    also tacks or gybes once, and one that cannot tack has swept half a circle by way of dead down wind.
    """
    b = world.boat
    gx, gy = world.goal
    d = math.hypot(gx, gy)
    if b.cx != 0.0 or b.cy != 0.0 or d <= world.goal_radius:
        return 0.0
    course, spread = math.atan2(gx, gy), math.asin(min(1.0, world.goal_radius / d))
    least = max(0.0, world.problem.no_go_min_rad)
    most = min(math.pi, b.max_twa)

    def apart(a: float, c: float) -> float:
        return abs((a - c + math.pi) % (2.0 * math.pi) - math.pi)

    lost = 0.0
    if abs(course) + spread < least - NO_GO_SLACK_RAD and least < 0.5 * math.pi:   # a leg may be deeper by the slack
        ends = (least, -least)
        sweep = min(apart(world.h0, e) for e in ends) + 2.0 * least if b.can_tack else math.pi
        lost = min(b.tack_s, b.gybe_s) if b.can_tack else b.gybe_s
    elif abs(course) - spread > most + NO_GO_SLACK_RAD and most > 0.5 * math.pi:
        ends = (most, -most)
        sweep = min(apart(world.h0, e) for e in ends) + 2.0 * (math.pi - most)
        lost = min(b.tack_s, b.gybe_s) if b.can_tack else b.gybe_s
    else:
        sweep = max(0.0, apart(course, world.h0) - spread)
    return min(sweep, math.pi) / b.omega + lost


def grows(problem: Problem) -> bool:
    """Does the no-go zone grow steadily, in water that stands still?"""
    sigma = problem.wind.sigma
    steadily = sigma.model == "kalman" or (sigma.model == "ar1" and sigma.sigma_inf_rad > sigma.sigma0_rad)
    return problem.is_time_varying and steadily and problem.current.drift_mps == 0.0


def progress_s(problem: Problem, goal: tuple[float, float], radius_m: float) -> float:
    """Return the least sailing time [s] to the goal's disc with the no-go zone as it grows; inf when never.

    0 where the zone does not grow steadily. ``goal`` is in the wind frame.
    """
    if not grows(problem):
        return 0.0
    least = max(0.0, problem.no_go_min_rad - NO_GO_SLACK_RAD)
    top = min(math.pi, problem.boat.max_twa_rad + NO_GO_SLACK_RAD)
    if least >= top:
        return 0.0
    angle = np.linspace(least, top, 1801)
    nodes = np.asarray([a for a in problem.boat.polar_twa_rad if least < a < top])
    angle = np.unique(np.concatenate([angle, nodes]))
    v = np.interp(angle, problem.boat.polar_twa_rad, problem.boat.polar_mps) * (1.0 + 1e-5)
    heading = math.atan2(*goal)
    bearings = np.concatenate([np.linspace(-math.pi, math.pi, _NORMALS, endpoint=False), [0.0, heading]])
    n = np.column_stack([np.sin(bearings), np.cos(bearings)])
    need = n @ np.asarray(goal) - radius_m
    n, need = n[need > 0.0], need[need > 0.0]
    # Time steps that stretch, up to where sigma has settled or closed everything.
    scale = max(1.0, math.hypot(*goal) / max(1e-9, float(v.max())))
    times = np.concatenate([[0.0], np.geomspace(scale / 500.0, 1e4 * scale, _STEPS)])
    half = np.array([problem.no_go_half_rad(float(t)) for t in times]) - NO_GO_SLACK_RAD
    index = np.searchsorted(angle, half, side="left")
    index = np.maximum(0, index - 1)                                            # one sample wider: outer bound
    closed = half > top
    # The best progress along n of all angles from each moment's on: the best between two moments' angles, gathered.
    parts, place = np.unique(np.minimum(index, len(angle) - 1), return_inverse=True)
    reachable = v[None, :] * (np.sin(angle)[None, :] * np.abs(n[:, :1]) + np.cos(angle)[None, :] * n[:, 1:])
    between = np.maximum.reduceat(reachable, parts, axis=1)
    rate = np.maximum(0.0, np.maximum.accumulate(between[:, ::-1], axis=1)[:, ::-1][:, place])
    rate[:, closed] = 0.0
    made = np.concatenate([np.zeros((len(n), 1)), np.cumsum(rate[:, :-1] * np.diff(times)[None, :], axis=1)], axis=1)
    worst = 0.0
    for k in range(len(n)):
        if made[k, -1] >= need[k]:
            i = int(np.searchsorted(made[k], need[k]))
            worst = max(worst, float(times[i - 1] + (need[k] - made[k, i - 1]) / max(rate[k, i - 1], 1e-12)))
        elif rate[k, -1] <= 0.0:
            return math.inf
        else:
            worst = max(worst, float(times[-1]))
    return worst


def late_s(problem: Problem, late: Gauge, metric_s: float, at_s: float) -> float:
    """Return the least sailing time [s] to where the metric of ``at_s`` says ``metric_s``, in a zone that grows.

    A velocity allowed at s < ``at_s`` takes at most its gauge in that metric off the time to go; one allowed later is
    in the later hull, so it takes 1 at most. The integral of that must come to ``metric_s``.
    """
    times = np.linspace(0.0, at_s, _STEPS)
    half = np.array([problem.no_go_half_rad(float(t)) for t in times]) - NO_GO_SLACK_RAD
    least, top = max(0.0, float(half[0])), min(math.pi, problem.boat.max_twa_rad + NO_GO_SLACK_RAD)
    nodes = np.asarray(problem.boat.polar_twa_rad)
    angle = np.unique(np.clip(np.concatenate([np.linspace(least, top, _ANGLES), half, nodes]), least, top))
    v = np.interp(angle, problem.boat.polar_twa_rad, problem.boat.polar_mps) * (1.0 + 1e-5)
    side, ahead = v * np.sin(angle), v * np.cos(angle)
    gauged = np.maximum(np.max(np.outer(side, late.normals[:, 0]) + np.outer(ahead, late.normals[:, 1]), axis=1),
                        np.max(np.outer(-side, late.normals[:, 0]) + np.outer(ahead, late.normals[:, 1]), axis=1))
    beyond = np.maximum.accumulate(gauged[::-1])[::-1]                          # over all angles >= this one
    index = np.minimum(np.searchsorted(angle, half, side="left"), len(angle) - 1)
    fastest = np.maximum(1.0, beyond[index])
    made = np.concatenate([[0.0], np.cumsum(fastest[:-1] * np.diff(times))])   # at its largest over each step
    if metric_s >= made[-1]:
        return at_s + metric_s - float(made[-1])
    return float(np.interp(metric_s, made, times))


class Bound:
    """The best lower bound so far, and the geodesic that gave it (points (n, 2) in the wind frame, or None)."""

    def __init__(self, world: World, gauge: Gauge) -> None:
        self.world, self.gauge = world, gauge
        gx, gy = world.goal
        self.turning_s = turning_s(world)
        self.progress_s = progress_s(world.problem, world.goal, world.goal_radius)
        self.metric_s = gauge.disc(gx, gy, world.goal_radius) if gauge.can_move else math.inf
        self.ends = circle_cuts(world.grid.edges, np.array([gx, gy, world.goal_radius]))
        self.turns_s = 0.0
        self.path: Floats | None = None
        self.is_exact = False

    @property
    def tight_s(self) -> float:
        """Bound for paths that do not use the scorer's angular slack, as this planner's do not [s]."""
        return max(max(self.metric_s, self.progress_s) + self.turning_s, self.turns_s)

    @property
    def value_s(self) -> float:
        """Bound for every path that the scorer passes [s]; inf proves that there is none."""
        turning = max(0.0, self.turning_s - 4.0 * NO_GO_SLACK_RAD / self.world.boat.omega)
        return max(max(self.metric_s / self.gauge.slack, self.progress_s) + turning, self.turns_s)

    def sharpen(self, upper_s: float, tests: int) -> int:
        """Search the visibility graph with at most about ``tests`` visibility tests; return those made."""
        world, gauge = self.world, self.gauge
        if self.is_exact or not gauge.can_move:
            return 0
        goal = np.array([*world.goal, world.goal_radius])
        limit = upper_s - self.turning_s if math.isfinite(upper_s) else math.inf
        nodes = graph_nodes(world.corners, gauge, (*world.goal, world.goal_radius), limit)
        _, parent, low, end, made = geodesics(
            world.grid, nodes, gauge.normals, gauge.blocked, gauge.table, goal, 0, limit, tests,
            self.ends,
        )
        found = end >= 0 and made <= tests
        if end >= 0:
            points = [nodes[end]]
            while parent[end] >= 0:
                end = int(parent[end])
                points.append(nodes[end])
            self.path = np.array(points[::-1])
        if math.isfinite(low):
            cut = 4.0 * TOUCH_M * gauge.table_max * (2 + (len(self.path) if self.path is not None else len(nodes)))
            self.metric_s = max(self.metric_s, low - cut)
            self.is_exact = found
        return int(made)

    def sharpen_turns(self, upper_s: float) -> None:
        """Find how often every path below ``upper_s`` must turn among the obstacles within the fence."""
        boards = make_boards(self.world, self.gauge, grows(self.world.problem))
        if boards is not None and math.isfinite(upper_s):
            sail_s = max(self.metric_s / self.gauge.slack, self.progress_s)
            self.turns_s = max(self.turns_s, boards.bound_s(sail_s, upper_s))

    def sharpen_late(self, upper_s: float, tests: int) -> int:
        """Search the visibility graph with the metric of the zone near the end, where it grows; return the tests."""
        world, problem = self.world, self.world.problem
        at_s = LATE * upper_s
        if not grows(problem) or not self.gauge.can_move or not math.isfinite(at_s):
            return 0
        half = problem.no_go_half_rad(at_s)
        if half > MOST_LATE_RAD:
            return 0
        late = make_gauge(replace(problem, wind=replace(problem.wind, sigma=type(problem.wind.sigma)()),
                                  boat=replace(problem.boat, no_go_half_rad=max(0.0, half - NO_GO_SLACK_RAD))))
        if not late.can_move or len(late.blocked):
            return 0
        goal = np.array([*world.goal, world.goal_radius])
        nodes = graph_nodes(world.corners, late, (*world.goal, world.goal_radius), math.inf)
        _, parent, low, end, made = geodesics(
            world.grid, nodes, late.normals, late.blocked, late.table, goal, 0, math.inf, tests, self.ends)
        if math.isfinite(low):
            count = 2 + (len(nodes) if end < 0 or made > tests else int(np.sum(parent >= 0)))
            low = (low - 4.0 * TOUCH_M * late.table_max * count) / late.slack
            self.progress_s = max(self.progress_s, late_s(problem, late, low, at_s))
        return int(made)


def lower_bound_s(problem: Problem, *, tests: int = 0) -> float:
    """Return a lower bound [s] from the gauge and, with ``tests`` of visibility, from the way round the obstacles."""
    if tests == 0:
        problem = replace(problem, obstacles=(), fence=None)
    bound = Bound(make_world(problem), make_gauge(problem))
    if tests > 0:
        bound.sharpen(math.inf, tests)
    return bound.value_s


def cut_off(world: World) -> str | None:
    """Return why the goal's disc cannot be reached through free water at all, or None: exact, within TOUCH_M."""
    problem = world.problem
    start, goal = shapely.Point(problem.start_en), shapely.Point(problem.goal_en)
    disc = goal.buffer(problem.goal_radius_m * 1.001 + 1e-6, quad_segs=64)
    if world.free is not None:
        for water in polygons(world.free.buffer(TOUCH_M, join_style="mitre", mitre_limit=5.0)):
            if water.contains(start) and water.disjoint(disc):
                return "the start's water has no way to the goal: obstacles or the fence close it"
    with_basins = [g for g in world.solids if len(g.interiors)]
    for part in polygons(shapely.buffer(np.asarray(with_basins, dtype=object), -TOUCH_M, join_style="mitre",
                                        mitre_limit=5.0)):
        filled = shapely.Polygon(part.exterior)
        for ring in part.interiors:
            basin = shapely.Polygon(ring)
            if basin.contains(start) and basin.disjoint(disc):
                return "the start's water has no way to the goal: obstacles or the fence close it"
            if basin.contains(goal) and not filled.contains(start) and filled.contains(disc):
                return "the goal's water has no way in: obstacles close it"
    return None


def no_course(problem: Problem) -> str | None:
    """Return why no course can be sailed at all, or None."""
    points = velocities(Courses.of(problem), max(0.0, problem.no_go_min_rad - NO_GO_SLACK_RAD))
    if len(points) == 0:
        return (f"no course is allowed: the no-go zone reaches {math.degrees(problem.no_go_min_rad):.1f} deg on "
                f"each side and the deepest course is {math.degrees(problem.boat.max_twa_rad):.1f} deg")
    if float(np.max(np.hypot(points[:, 0], points[:, 1]))) <= 1e-9:
        return "the boat makes no way on any course that is allowed"
    return None
