"""``auto``: exact proposals first, then lattices and the metric's geodesics, all of them annealed.

The straight leg and the fewest tacks are tried at once; a coarse lattice and the visibility graph give a first
path round obstacles; finer and differently fitted lattices, and the routes round the other sides, give other
candidates. Each is annealed in short rounds; a bandit gives more rounds to the candidates that may still win.
The search stops when its budget ends or when the bound says there is nothing left to find.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray

from companion.planner.anneal import anneal, check_path, zigzag
from companion.planner.bound import Bound, cut_off, no_course
from companion.planner.gauge import Gauge, make_gauge
from companion.planner.kernels import Floats
from companion.planner.lattice import run_lattice
from companion.planner.plan import PlanStatus
from companion.planner.problem import Problem
from companion.planner.solve import Effort, Outcome
from companion.planner.world import World, make_world

STOP_GAP = 2e-5
"""Stop when the path is this close to the bound."""
_CHUNK = 2_000
"""Annealing moves between two looks at the clock."""


@dataclass(slots=True, eq=False)
class Candidate:
    """One path under annealing."""

    points: Floats
    cost_s: float
    last: Floats
    rounds: int = 0
    origin: str = ""


class Searcher:
    """The state of one search."""

    def __init__(self, world: World, gauge: Gauge, bound: Bound, effort: Effort, seed: int) -> None:
        self.world, self.gauge, self.bound, self.effort = world, gauge, bound, effort
        self.goal = np.array([*world.goal, world.goal_radius])
        self.rng: NDArray[np.uint64] = np.array([(seed * 2 + 1) * 0x9E3779B97F4A7C15 % 2**64 or 1], np.uint64)
        self.pool: list[Candidate] = []
        self.best: Candidate | None = None

    # ------------------------------------------------------------------------------------ candidates
    @property
    def upper_s(self) -> float:
        """Cost of the best path [s]."""
        return self.best.cost_s if self.best is not None else math.inf

    @property
    def is_done(self) -> bool:
        """Is there nothing left to find, or nothing left to spend?"""
        return self.effort.is_over or self.upper_s <= self.bound.value_s * (1.0 + STOP_GAP)

    def offer(self, points: Floats | None, origin: str) -> Candidate | None:
        """Take a path as a candidate if it is feasible."""
        if points is None or len(points) < 2:
            return None
        points = np.ascontiguousarray(points)
        cost = float(check_path(self.world.grid, self.world.boat, points, self.world.h0))
        if not math.isfinite(cost):
            return None
        candidate = Candidate(points=points, cost_s=cost, last=points, origin=origin)
        self.pool.append(candidate)
        self.note(candidate)
        return candidate

    def note(self, candidate: Candidate) -> None:
        """Remember the best."""
        if candidate.cost_s < self.upper_s:
            self.best = candidate
            self.effort.found()

    def along(self, guide: Floats, most: int) -> Floats | None:
        """Return the guide made sailable: every leg direct or as the fewest tacks, or None."""
        world = self.world
        points, t, h = [guide[0]], 0.0, world.h0
        for i in range(len(guide) - 1):
            (ax, ay), (ex, ey) = points[-1], guide[i + 1]
            legs, t, h, ok = zigzag(world.grid, world.boat, ax, ay, h, t, ex, ey, most)
            if not ok:
                return None
            points += list(legs)
        return np.array(points)

    def end_points(self) -> list[Floats]:
        """Return ends in the goal's disc worth a straight try: nearest, centre, the disc's sides."""
        gx, gy, r = self.goal
        d = math.hypot(gx, gy)
        ends = [np.array([gx, gy])]
        if d > r > 0.0:
            ux, uy = gx / d, gy / d
            ends = [np.array([gx - a * r * 0.999999, gy - c * r * 0.999999])
                    for a, c in ((ux, uy), (0.0, math.copysign(1.0, gy)))] + ends
        return ends

    # ---------------------------------------------------------------------------------------- phases
    def quick(self) -> None:
        """Try the straight leg and the fewest tacks."""
        for end in self.end_points():
            for most in (1, 3):
                self.offer(self.along(np.vstack([np.zeros((1, 2)), end[None, :]]), most), "direct")
                self.effort.spend(50)

    def geodesic(self, tests: int) -> None:
        """Sharpen the bound and try its path."""
        self.effort.spend(self.bound.sharpen(self.upper_s, tests) // 8)
        guide = self.bound.path
        if guide is not None:
            gx, gy, r = self.goal
            (x, y) = guide[-1]
            d = math.hypot(gx - x, gy - y)
            ends = [guide] if d <= r else [np.vstack([guide, [[gx, gy]]]),
                                           np.vstack([guide, [[gx - r * (gx - x) / d, gy - r * (gy - y) / d]]])]
            for candidate in ends:
                self.offer(self.along(candidate, 12), "geodesic")

    def box(self, margin: float) -> tuple[float, float, float, float]:
        """Return where a lattice lives: within the fence, or about everything that matters."""
        x0, y0, x1, y1 = self.world.box
        if self.world.fence_box:
            return x0, y0, x1, y1
        gx, gy = self.world.goal
        m = margin * max(math.hypot(gx, gy), 1.0)
        if margin < 0.5:
            return min(0.0, gx) - m, min(0.0, gy) - m, max(0.0, gx) + m, max(0.0, gy) + m
        return x0 - m, y0 - m, x1 + m, y1 + m

    def inner_box(self, margin: float) -> tuple[float, float, float, float]:
        """Return ``box`` cut down to where a path better than the best can be."""
        x0, y0, x1, y1 = self.box(margin)
        upper = self.upper_s - self.bound.turning_s
        if not math.isfinite(upper):
            return x0, y0, x1, y1
        side = 48
        xs, ys = np.linspace(x0, x1, side), np.linspace(y0, y1, side)
        gx, gy = np.meshgrid(xs, ys)
        q = np.column_stack([gx.ravel(), gy.ravel()])
        goal = np.array([self.goal[:2]])
        least = self._metric(q) + np.maximum(0.0, self._metric(goal - q) - self.goal[2] * self.gauge.table_max)
        inside = q[least <= upper * 1.001]
        if len(inside) == 0:
            return x0, y0, x1, y1
        px, py = (x1 - x0) / (side - 1), (y1 - y0) / (side - 1)
        return (max(x0, float(inside[:, 0].min()) - px), max(y0, float(inside[:, 1].min()) - py),
                min(x1, float(inside[:, 0].max()) + px), min(y1, float(inside[:, 1].max()) + py))

    def _metric(self, d: Floats) -> Floats:
        table = self.gauge.table
        cell = ((np.arctan2(d[:, 0], d[:, 1]) + math.pi) / (2.0 * math.pi) * len(table)).astype(int) % len(table)
        return np.asarray(table[cell] * np.hypot(d[:, 0], d[:, 1]), np.float64)

    def lattice(self, cells: int, reach: int, *, margin: float, half_at_s: float, stretch: float = 1.0,
                bound_s: float | None = None) -> Candidate | None:
        """Run one lattice whose axes fit the no-go zone at ``half_at_s`` and offer its path."""
        b = self.world.boat
        half = self.world.problem.no_go_half_rad(half_at_s)
        goal_is_low = self.world.goal[1] < 0.0
        downwind = goal_is_low and (b.down < math.pi - 1e-6)
        angle = math.pi - b.down if downwind else max(half, b.up)
        found = run_lattice(
            self.world, self.gauge, cells=cells, reach=reach, half_rad=angle,
            box=self.inner_box(margin), downwind=downwind, stretch=stretch,
            bound_s=self.upper_s if bound_s is None else bound_s,
        )
        self.effort.spend(max(1, found.pops // 8))
        if found.points is None:
            return None
        return self.offer(found.points, f"lattice {cells}")

    def refine(self, candidate: Candidate, moves: int, hot: float, cold: float) -> None:
        """Anneal one candidate from where it is."""
        moves = max(1, self.effort.remaining(moves))
        scale = candidate.cost_s
        size = float(np.max(np.ptp(candidate.points, axis=0))) + 1e-9
        cost, points, _, last = anneal(
            self.world.grid, self.world.boat, candidate.last, self.world.h0, self.goal, 0.5 * size,
            self._spots(candidate), moves, hot * scale, cold * scale, self.rng,
        )
        self.effort.spend(moves)
        candidate.rounds += 1
        candidate.last = last
        if cost < candidate.cost_s:
            candidate.cost_s, candidate.points = float(cost), points
        self.note(candidate)

    def _spots(self, candidate: Candidate) -> Floats:
        """Return up to 200 obstacle corners near the path."""
        corners = self.world.corners
        if len(corners) == 0:
            return corners
        a, e = candidate.points[:-1], candidate.points[1:]
        near = np.full(len(corners), np.inf)
        for p, q in zip(a, e, strict=True):
            d = q - p
            f = np.clip((corners - p) @ d / max(float(d @ d), 1e-18), 0.0, 1.0)
            near = np.minimum(near, np.sum((p + f[:, None] * d - corners) ** 2, axis=1))
        keep = np.argsort(near, kind="stable")[:200]
        return np.ascontiguousarray(corners[keep])


def search(problem: Problem, effort: Effort, seed: int) -> Outcome:
    """Return the best path found within ``effort``, or what was proved."""
    reason = no_course(problem)
    if reason:
        return Outcome(waypoints_en=None, status=PlanStatus.INFEASIBLE, reason=reason)
    world = make_world(problem)
    wrong = _endpoint_in_solid(world)
    if wrong:
        return Outcome(waypoints_en=None, status=PlanStatus.INVALID, reason=wrong)
    if math.hypot(*world.goal) <= world.goal_radius:
        effort.found()
        return Outcome(waypoints_en=np.asarray([problem.start_en]))
    gauge = make_gauge(problem)
    bound = Bound(world, gauge)
    if not math.isfinite(bound.value_s):
        return Outcome(waypoints_en=None, status=PlanStatus.INFEASIBLE, reason=_hopeless(problem))
    searcher = Searcher(world, gauge, bound, effort, seed)
    searcher.quick()
    if not searcher.is_done:
        closed = _first_paths(searcher)
        if closed:
            return Outcome(waypoints_en=None, status=PlanStatus.INFEASIBLE, reason=closed)
    if not searcher.is_done:
        _improve(searcher)
    if searcher.best is None:
        return Outcome(waypoints_en=None, lower_bound_s=bound.value_s)
    points = _tidy(world, searcher.best.points)
    waypoints = world.to_en(points)
    waypoints[0] = problem.start_en
    return Outcome(waypoints_en=waypoints, lower_bound_s=bound.value_s,
                   trace={"origin": searcher.best.origin, "candidates": len(searcher.pool)})


def _endpoint_in_solid(world: World) -> str | None:
    """Return which endpoint no path can have, or None."""
    p = world.problem
    solid = p.eval_solid
    for name, en in (("start", p.start_en), ("goal", p.goal_en)):
        if solid.intersects(shapely.Point(en)):
            return f"{name} is inside an obstacle or outside the fence"
    return None


def _hopeless(problem: Problem) -> str:
    return (f"the goal lies where the no-go zone lets no path lead: {math.degrees(problem.no_go_half_rad(0.0)):.1f} "
            f"deg on each side at the start, {math.degrees(min(problem.no_go_max_rad, math.pi)):.1f} deg later")


def _first_paths(s: Searcher) -> str | None:
    """Find a first path; return why there is none if that is proved."""
    has_solid = len(s.world.grid.edges) > 0
    if has_solid:
        s.geodesic(4_000)
    late = 1.3 * s.bound.value_s
    for cells, reach in ((1_500, 2), (6_000, 2), (24_000, 2), (100_000, 2), (400_000, 2)):
        if s.effort.is_over:
            break
        for margin in (0.25, 0.5):
            s.lattice(cells, reach, margin=margin, half_at_s=late)
            if s.best is not None:
                return None
        if cells == 1_500 and has_solid:
            closed = cut_off(s.world.problem)
            if closed:
                return closed
        if s.best is not None:
            return None
    return None


def _improve(s: Searcher) -> None:
    """Anneal the candidates and look for others until the effort ends."""
    has_solid = len(s.world.grid.edges) > 0
    for c in list(s.pool):
        if s.is_done:
            return
        s.refine(c, _CHUNK, 1e-3, 1e-6)
    if has_solid and not s.is_done:
        s.geodesic(60_000)
    plans = [(6_000, 2, 1.0), (6_000, 3, 0.93), (24_000, 2, 1.0), (24_000, 3, 1.07), (60_000, 2, 0.9),
             (100_000, 3, 1.0), (200_000, 2, 0.95), (400_000, 2, 1.0)]
    turn = 0
    share = 0.0
    while not s.is_done:
        # Lattices take at most about a third of what has been spent.
        if plans and has_solid and share <= 0.35 * s.effort.fraction:
            cells, reach, stretch = plans.pop(0)
            before = s.effort.fraction
            found = s.lattice(cells, reach, margin=0.5, half_at_s=s.upper_s, stretch=stretch,
                              bound_s=1.06 * s.upper_s)
            share += s.effort.fraction - before
            if found is not None and not s.is_done:
                s.refine(found, 2 * _CHUNK, 1e-3, 1e-6)
            continue
        ranked = sorted(s.pool, key=lambda c: c.cost_s)[:6]
        pick = ranked[0] if turn % 2 == 0 else ranked[min(len(ranked) - 1, (turn // 2) % 6)]
        turn += 1
        hot = (3e-3, 3e-4, 3e-5, 1e-6)[turn % 4]
        if turn % 4 == 0:
            pick.last = pick.points
        s.refine(pick, _CHUNK, hot, 1e-8)


def _tidy(world: World, points: Floats) -> Floats:
    """Drop points that are not needed: doubles, and those on a straight line."""
    keep = [points[0]]
    for i in range(1, len(points)):
        if math.dist(points[i], keep[-1]) > 1e-6 or i == len(points) - 1:
            keep.append(points[i])
    cost = float(check_path(world.grid, world.boat, points, world.h0))
    out = np.array(keep)
    i = 1
    while i < len(out) - 1:
        fewer = np.delete(out, i, axis=0)
        if check_path(world.grid, world.boat, fewer, world.h0) <= cost + 1e-9:
            out = fewer
        else:
            i += 1
    return out
