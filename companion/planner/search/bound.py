"""What is provable: lower bounds on the time, and that there is no path at all.

Bound = shortest path of the sailing-time metric (visibility graph) + the turning that every path needs. Where the
no-go zone grows with time, the progress that is possible in a direction n up to time T is the integral of the
support function of the velocities allowed at each moment; it must reach the goal, which bounds T from below and
sometimes proves that the wind closes the goal for good.
"""

from __future__ import annotations

import math
from bisect import bisect_left
from dataclasses import replace

import numpy as np
import shapely

from companion.geo.distinct import distinct
from companion.planner.problem.parts import NO_GO_SLACK_RAD, TOUCH_M
from companion.planner.problem.value import Problem
from companion.planner.search.gauge import Courses, Gauge, make_gauge, velocities
from companion.planner.search.kernels import Floats
from companion.planner.search.visibility import circle_cuts, geodesics, graph_nodes, least_through
from companion.planner.search.world import SearchWorld, make_world, polygons

# How often a path must turn: a lower bound on the time in turns among obstacles, to windward.
#
# A *board* is sailed with the wind on one side: it moves one way across the wind, and to gain the height dy it takes
# dy tan(half) across, half being the no-go zone's half angle. To change boards through the wind's eye takes a turn of
# 2 half. To get back across without, on headings off the wind (|TWA| >= 90 degrees), takes half a turn there and back,
# and time in which no height is gained: within the time that is left over that goes only so far.
#
# So the water is cut into strips along the wind, and from the goal backwards is found, board by board, the lowest
# height in each strip from which the goal can be reached with so many turns. What is solid across a whole strip cannot
# be sailed; walls thinner than a strip's climb, and all that lies below, are left out: fewer turns, never more.
# A path that takes longer over its sailing may need fewer turns: the bound is the least of both together.

_STRIPS, _ROWS, _HEIGHTS = 200, 120, 400
_WALLS, _BESIDE_M = 24, 0.25
"""Longest walls about whose ends there are narrow strips more, and how wide these are: a gap is a strip of its own."""
_PAD_M = 3e-3
"""Taken off a solid on all sides [m]: more than the scorer's slack and the boundary's skin; so is the goal widened."""
_MOST_TURNS, _MOST_STEPS = 60, 6
_STEEP_RAD, _LEAST_RAD = 1.5, 0.1
_EDGES = 20_000
"""Boundary segments above which the strips would take too long."""


class Boards:
    """The water of a fenced problem in strips, and how high a board climbs across each."""

    def __init__(self, world: SearchWorld, gauge: Gauge, grows: bool) -> None:
        boat, box = world.boat, world.box
        self.world, self.gauge = world, gauge
        self._least_rad = max(0.0, world.problem.no_go_min_rad - NO_GO_SLACK_RAD)
        self._lost_s = boat.tack_s if boat.can_tack else math.inf
        self._round_s = math.pi / boat.omega
        self._radius = 1.001 * world.goal_radius + _PAD_M
        self._cuts = _cuts(world)
        self._widths = np.diff(self._cuts)
        self._rows = np.linspace(box[1], box[3], _ROWS)
        self._heights = np.linspace(0.0, max(box[3], world.goal[1], 1.0), _HEIGHTS)
        self._times, self._halves = self._climb(grows)
        slope = np.tan(np.minimum(self._halves, _STEEP_RAD))
        self._across = np.concatenate([[0.0], np.cumsum(slope[:-1] * self._heights[1])])
        self._blocked = [
            (self._way(np.array(begin)).tolist(), self._way(np.array(end)).tolist())
            for begin, end in _solid(world, self._cuts)
        ]
        self._metric = self._sailing()
        low = world.goal[1] - self._radius
        self._goal = float(self._way(np.array([low]))[0])
        self._climb_s = float(np.interp(low, self._heights, self._times))

    def _climb(self, grows: bool) -> tuple[Floats, Floats]:
        """Return for each height the earliest time there [s], and the zone's half angle then [rad]."""
        boat = self.world.boat
        nodes = boat.twa[(boat.twa > self._least_rad) & (boat.twa < 0.5 * math.pi)]
        angles = distinct(np.concatenate([np.linspace(self._least_rad, 0.5 * math.pi, 721), nodes]))
        speeds = np.interp(angles, boat.twa, boat.mps) * (1.0 + 1e-5)
        made = np.maximum(speeds[:-1], speeds[1:]) * np.cos(angles[:-1])  # at its largest between two angles
        best = np.maximum.accumulate(made[::-1])[::-1]
        t, times, halves = 0.0, [], []
        for _ in self._heights:
            half = self.world.problem.no_go_half_rad(t) - NO_GO_SLACK_RAD if grows else self._least_rad
            half = min(max(half, self._least_rad), 0.5 * math.pi)
            times.append(t)
            halves.append(half)
            k = min(max(0, int(np.searchsorted(angles, half)) - 1), len(best) - 1)
            t = min(1e12, t + float(self._heights[1]) / max(float(best[k]), 1e-12))
        return np.array(times), np.array(halves)

    def _way(self, y: Floats) -> Floats:
        """Return the way across [m] from height 0 to heights ``y``, below 0 negative."""
        first = float(self._across[1]) / float(self._heights[1])
        above = np.where(np.isinf(y), y, np.interp(y, self._heights, self._across))
        return np.asarray(np.where(y < 0.0, y * first, above), np.float64)

    def _sailing(self) -> Floats:
        """Return the least sailing time by way of each strip and row, obstacles apart [s], at its least about there."""
        middles = 0.5 * (self._cuts[1:] + self._cuts[:-1])
        at = np.column_stack([np.repeat(middles, _ROWS), np.tile(self._rows, len(middles))])
        through = least_through(self.gauge, at, (*self.world.goal, self._radius))
        reach = 0.5 * self._widths[:, None] + (self._rows[1] - self._rows[0])
        return np.asarray(through.reshape(len(middles), _ROWS) - 2.0 * self.gauge.table_max * reach, np.float64)

    def _limits(self, sail_s: float) -> tuple[list[float], list[float]]:
        """Return the lowest and highest way in each strip that a path of ``sail_s`` can come to."""
        near = self._metric <= sail_s * self.gauge.slack
        first, last = np.argmax(near, axis=1), _ROWS - 1 - np.argmax(near[:, ::-1], axis=1)
        low = np.where(first > 0, self._way(self._rows[np.maximum(first - 1, 0)]), -math.inf)
        high = np.where(last < _ROWS - 1, self._way(self._rows[np.minimum(last + 1, _ROWS - 1)]), math.inf)
        none = ~np.any(near, axis=1)
        low[none], high[none] = math.inf, -math.inf
        return low.tolist(), high.tolist()

    def turning_s(self, sail_s: float, as_two: bool) -> float:
        """Return the least time [s] in turns of all paths that sail for ``sail_s`` at most.

        A way back across off the wind takes half a turn there and back: it is counted as one change of boards, which
        never takes longer, or (``as_two``) as two, none of which is then counted for more than half of it.
        """
        low, high = self._limits(sail_s)
        widths, blocked, count = self._widths.tolist(), self._blocked, len(self._widths)
        off_m = float(np.max(self.world.boat.mps)) * (1.0 + 1e-5) * max(0.0, sail_s - self._climb_s) + _PAD_M

        def lowest(i: int, y: float) -> float:
            """Return the lowest free height of strip i not below y; inf: none."""
            y = max(y, low[i])
            starts, ends = blocked[i]
            k = bisect_left(starts, y) - 1
            if k >= 0 and y < ends[k]:
                y = ends[k]
            return y if y <= high[i] else math.inf

        def within(x0: float, x1: float) -> range:
            """Return the strips that reach within what can be crossed off the wind of [x0, x1]."""
            return range(
                max(0, int(np.searchsorted(self._cuts, x0 - off_m)) - 1),
                min(count, int(np.searchsorted(self._cuts, x1 + off_m, side="right"))),
            )

        nearby = (
            np.column_stack(
                [
                    np.searchsorted(self._cuts, self._cuts[:-1] - off_m, side="right") - 1,
                    np.searchsorted(self._cuts, self._cuts[1:] + off_m),
                ]
            )
            .clip(0, count)
            .ravel()
        )
        near_start, gx = within(0.0, 0.0), self.world.goal[0]
        port = [math.inf] * count  # boards that move towards +x
        for i in within(gx - self._radius, gx + self._radius):
            port[i] = lowest(i, self._goal - widths[i])
        starboard = list(port)
        spent_s, most_s = 0.0, 0.5 * self._round_s if as_two else self._round_s
        before = [math.inf] * count
        for _ in range(_MOST_TURNS):
            for i in range(count - 2, -1, -1):
                port[i] = min(port[i], lowest(i, port[i + 1] - widths[i]))
            for i in range(1, count):
                starboard[i] = min(starboard[i], lowest(i, starboard[i - 1] - widths[i]))
            either = [min(a, b) for a, b in zip(port, starboard, strict=True)]
            if min(either[i] for i in near_start) <= _PAD_M:
                return spent_s + (self._first_s() if spent_s > 0.0 else 0.0)
            spent_s += min(most_s, self._turn_s(min(either)))
            lateral = np.minimum.reduceat([*(before if as_two else either), math.inf], nearby)[::2].tolist()
            before = either
            port, starboard = (
                [min(own[i], lowest(i, min(other[i], lateral[i]) - widths[i])) for i in range(count)]
                for own, other in ((port, starboard), (starboard, port))
            )
        return spent_s

    def _turn_s(self, way_m: float) -> float:
        """Return the least time [s] from board to board at the height of ``way_m`` or above."""
        k = int(np.searchsorted(self._across, way_m, side="right")) - 1
        return 2.0 * float(self._halves[max(0, k)]) / self.world.boat.omega + self._lost_s

    def _first_s(self) -> float:
        """Return the least time [s] from the start's heading to the first course on the wind."""
        h0 = abs(self.world.h0)
        return max(0.0, self._least_rad - h0, h0 - 0.5 * math.pi) / self.world.boat.omega

    def bound_s(self, sail_s: float, upper_s: float) -> float:
        """Return the least time [s] of all paths that take at least ``sail_s`` to sail, if it is below ``upper_s``."""
        least_s, step_s = upper_s, max(0.5 * self._round_s, (upper_s - sail_s) / _MOST_STEPS)
        as_two = self.turning_s(sail_s + step_s, as_two=True) > self.turning_s(sail_s + step_s, as_two=False)
        while sail_s < least_s:
            least_s = min(least_s, sail_s + self.turning_s(sail_s + step_s, as_two))
            sail_s += step_s
        return least_s


def make_boards(world: SearchWorld, gauge: Gauge, grows: bool) -> Boards | None:
    """Return the boards of a problem with a fence; None where they say nothing."""
    boat, problem = world.boat, world.problem
    still = boat.cx == 0.0 and boat.cy == 0.0
    if world.free is None or not still or not gauge.can_move or len(world.grid.edges) > _EDGES:
        return None
    least = problem.no_go_min_rad - NO_GO_SLACK_RAD
    return Boards(world, gauge, grows) if _LEAST_RAD < least < 0.5 * math.pi else None


def _cuts(world: SearchWorld) -> Floats:
    """Return where the strips begin and end, across the wind: evenly, and close about the ends of the longest walls."""
    edges = world.grid.edges
    x0, x1 = world.box[0] - 2.0 * _PAD_M, world.box[2] + 2.0 * _PAD_M
    longest = np.argsort(np.hypot(edges[:, 2] - edges[:, 0], edges[:, 3] - edges[:, 1]), kind="stable")[-_WALLS:]
    ends = distinct(edges[longest][:, [0, 2]])
    about = ends[:, None] + np.array([-_BESIDE_M, -2.0 * _PAD_M, 2.0 * _PAD_M, _BESIDE_M])[None]
    cuts = distinct(np.concatenate([np.linspace(x0, x1, _STRIPS + 1), about.ravel()]))
    return np.asarray(cuts[(cuts >= x0) & (cuts <= x1)], np.float64)


def _solid(world: SearchWorld, cuts: Floats) -> list[tuple[list[float], list[float]]]:
    """Return for each strip the heights that are solid all across it: from, to.

    Between heights at which a boundary runs somewhere in the strip it is solid everywhere or nowhere: one point tells.
    """
    edges = world.grid.edges
    left, right = np.minimum(edges[:, 0], edges[:, 2]), np.maximum(edges[:, 0], edges[:, 2])
    first = np.searchsorted(cuts, left - _PAD_M) - 1
    last = np.searchsorted(cuts, right + _PAD_M, side="right")
    first, last = first.clip(0, len(cuts) - 1), last.clip(0, len(cuts) - 1)
    edge = np.repeat(np.arange(len(edges)), last - first)
    strip = np.arange(len(edge)) - np.repeat(np.cumsum(last - first) - (last - first), last - first) + first[edge]
    ax, ay, bx, by = edges[edge].T
    run = np.where(np.abs(bx - ax) > 1e-12, bx - ax, 1.0)
    shares = [
        np.where(np.abs(bx - ax) > 1e-12, ((x - ax) / run).clip(0.0, 1.0), end)
        for x, end in ((cuts[strip] - _PAD_M, 0.0), (cuts[strip + 1] + _PAD_M, 1.0))
    ]
    ys = [ay + f * (by - ay) for f in shares]
    low, high = np.minimum(*ys) - _PAD_M, np.maximum(*ys) + _PAD_M
    order = np.lexsort((low, strip))
    gaps: list[tuple[int, float, float]] = []
    now, top = -1, math.inf
    for i, a, b in zip(strip[order].tolist(), low[order].tolist(), high[order].tolist(), strict=True):
        if i != now:  # beyond the outermost boundary is outside the fence
            gaps += [(now, top, math.inf), (i, -math.inf, a)]
            now, top = i, b
        elif a > top:
            gaps.append((i, top, a))
        top = max(top, b)
    gaps = [*gaps[1:], (now, top, math.inf)]
    solid: list[tuple[list[float], list[float]]] = [([], []) for _ in cuts[:-1]]
    middles = 0.5 * (cuts[1:] + cuts[:-1])
    at = [(middles[i], b - 1.0 if math.isinf(a) else a + min(1.0, 0.5 * (b - a))) for i, a, b in gaps]
    points = shapely.points(world.to_en(np.array(at)))
    is_solid = ~shapely.contains(world.free, points)
    is_solid[shapely.STRtree(world.solids).query(points, predicate="intersects")[0]] = True
    for (i, a, b), closed in zip(gaps, is_solid.tolist(), strict=True):
        if closed:
            solid[i][0].append(a)
            solid[i][1].append(b)
    return solid


_NORMALS = 48
_STEPS = 240
_ANGLES = 901
LATE = 0.9
"""Share of the path's time whose zone gives the metric of ``Bound.sharpen_late``: the bound is flat about it."""
MOST_LATE_RAD = math.radians(86.0)


def turning_s(world: SearchWorld) -> float:
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
    if abs(course) + spread < least - NO_GO_SLACK_RAD and least < 0.5 * math.pi:  # a leg may be deeper by the slack
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
    """Return whether the no-go zone grows steadily, in water that stands still."""
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
    angle = distinct(np.concatenate([angle, nodes]))
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
    index = np.maximum(0, index - 1)  # one sample wider: outer bound
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
    angle = distinct(np.clip(np.concatenate([np.linspace(least, top, _ANGLES), half, nodes]), least, top))
    v = np.interp(angle, problem.boat.polar_twa_rad, problem.boat.polar_mps) * (1.0 + 1e-5)
    side, ahead = v * np.sin(angle), v * np.cos(angle)
    gauged = np.maximum(
        np.max(np.outer(side, late.normals[:, 0]) + np.outer(ahead, late.normals[:, 1]), axis=1),
        np.max(np.outer(-side, late.normals[:, 0]) + np.outer(ahead, late.normals[:, 1]), axis=1),
    )
    beyond = np.maximum.accumulate(gauged[::-1])[::-1]  # over all angles >= this one
    index = np.minimum(np.searchsorted(angle, half, side="left"), len(angle) - 1)
    fastest = np.maximum(1.0, beyond[index])
    made = np.concatenate([[0.0], np.cumsum(fastest[:-1] * np.diff(times))])  # at its largest over each step
    if metric_s >= made[-1]:
        return at_s + metric_s - float(made[-1])
    return float(np.interp(metric_s, made, times))


class Bound:
    """The best lower bound so far, and the geodesic that gave it (points (n, 2) in the wind frame, or None)."""

    def __init__(self, world: SearchWorld, gauge: Gauge) -> None:
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
            world.grid, nodes, gauge.normals, gauge.blocked, gauge.table, goal, 0, limit, tests, self.ends
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
        late = make_gauge(
            replace(
                problem,
                wind=replace(problem.wind, sigma=type(problem.wind.sigma)()),
                boat=replace(problem.boat, no_go_half_rad=max(0.0, half - NO_GO_SLACK_RAD)),
            )
        )
        if not late.can_move or len(late.blocked):
            return 0
        goal = np.array([*world.goal, world.goal_radius])
        nodes = graph_nodes(world.corners, late, (*world.goal, world.goal_radius), math.inf)
        _, parent, low, end, made = geodesics(
            world.grid, nodes, late.normals, late.blocked, late.table, goal, 0, math.inf, tests, self.ends
        )
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


def cut_off(world: SearchWorld) -> str | None:
    """Return why the goal's disc cannot be reached through free water at all, or None: exact, within TOUCH_M."""
    problem = world.problem
    start, goal = shapely.Point(problem.start_en), shapely.Point(problem.goal_en)
    disc = goal.buffer(problem.goal_radius_m * 1.001 + 1e-6, quad_segs=64)
    if world.free is not None:
        for water in polygons(world.free.buffer(TOUCH_M, join_style="mitre", mitre_limit=5.0)):
            if water.contains(start) and water.disjoint(disc):
                return "the start's water has no way to the goal: obstacles or the fence close it"
    with_basins = [g for g in world.solids if len(g.interiors)]
    for part in polygons(
        shapely.buffer(np.asarray(with_basins, dtype=object), -TOUCH_M, join_style="mitre", mitre_limit=5.0)
    ):
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
        return (
            f"no course is allowed: the no-go zone reaches {math.degrees(problem.no_go_min_rad):.1f} deg on "
            f"each side and the deepest course is {math.degrees(problem.boat.max_twa_rad):.1f} deg"
        )
    if float(np.max(np.hypot(points[:, 0], points[:, 1]))) <= 1e-9:
        return "the boat makes no way on any course that is allowed"
    return None
