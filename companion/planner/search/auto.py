"""``auto``: exact proposals first, then lattices and the metric's geodesics, all of them annealed.

The straight leg and the fewest tacks are tried at once; a coarse lattice and the visibility graph give a first
path round obstacles; finer and differently fitted lattices, and the routes round the other sides, give other
candidates. Each is annealed in cycles; a bandit gives more of them to the candidates that may still win. The
search stops when its budget ends or when the bound says that there is nothing left to find.
"""

from __future__ import annotations

import math

import numpy as np
import shapely

from companion.planner.effort import Effort, Outcome
from companion.planner.plan import PlanStatus
from companion.planner.problem.evaluate import shore_of, target_hit
from companion.planner.problem.value import Problem
from companion.planner.search.bound import Bound, cut_off, no_course
from companion.planner.search.gauge import make_gauge
from companion.planner.search.searcher import FINE_FROM, Searcher
from companion.planner.search.world import SearchWorld, make_world

_LADDER = ((400, 2), (1_600, 2), (6_000, 2), (24_000, 2), (100_000, 2), (400_000, 2), (1_600_000, 2))
_LATTICES = ((6_000, 3), (2_500, 3), (24_000, 2), (12_000, 3), (40_000, 3), (100_000, 2), (60_000, 3), (160_000, 2),
             (200_000, 3), (400_000, 2), (800_000, 2))
_TURNS_S, _TURNS_TESTS = 0.25, 60_000
"""What must be left, in seconds or in visibility tests, for the bound on turns, which takes some 30 ms."""
_DRIFTS = ((1_600, 1.45), (6_000, 4.0), (6_000, 2.5), (6_000, 1.45), (12_000, 4.0), (12_000, 2.5), (24_000, 4.0),
           (24_000, 1.45), (24_000, 2.5), (60_000, 2.5), (60_000, 1.45))


def search(problem: Problem, effort: Effort, seed: int) -> Outcome:
    """Return the best path found within ``effort``, or what was proved."""
    gauge = make_gauge(problem)
    reason = None if gauge.can_move else no_course(problem)
    if reason:
        return Outcome(waypoints_en=None, status=PlanStatus.INFEASIBLE, reason=reason)
    world = make_world(problem)
    wrong = _endpoint_in_solid(world)
    if wrong:
        return Outcome(waypoints_en=None, status=PlanStatus.INVALID, reason=wrong)
    if math.hypot(*world.goal) <= world.goal_radius:
        effort.found()
        return Outcome(waypoints_en=np.asarray([problem.start_en]))
    for i, target in enumerate(problem.targets):
        if target_hit(problem, problem.start_en, problem.start_en, 0.0, 0.0) == i:
            name = target.name or f"target {i}"
            return Outcome(waypoints_en=None, status=PlanStatus.INFEASIBLE, reason=f"the start is inside {name}")
    bound = Bound(world, gauge)
    if not math.isfinite(bound.value_s):
        return Outcome(waypoints_en=None, status=PlanStatus.INFEASIBLE, reason=_hopeless(problem))
    searcher = Searcher(world, gauge, bound, effort, seed)
    searcher.quick()
    if not searcher.is_done:
        closed = _first_paths(searcher)
        if closed:
            return Outcome(waypoints_en=None, status=PlanStatus.INFEASIBLE, reason=closed)
    if not searcher.is_done and searcher.best is not None:
        _improve(searcher)
    if searcher.best is None:
        return Outcome(waypoints_en=None, lower_bound_s=bound.value_s)
    return Outcome(waypoints_en=searcher.waypoints_en(), lower_bound_s=bound.value_s,
                   trace={"origin": searcher.best.origin, "candidates": len(searcher.pool),
                          "paths": tuple(world.to_en(c.points) for c in searcher.pool)})


def _endpoint_in_solid(world: SearchWorld) -> str | None:
    """Return which endpoint no path can have, or None."""
    p = world.problem
    for name, en in (("start", p.start_en), ("goal", p.goal_en)):
        if not world.is_open(en) and shore_of(p).hits(shapely.Point(en)):
            return f"{name} is inside an obstacle or outside the fence"
    return None


def _hopeless(problem: Problem) -> str:
    return (f"the goal lies where the no-go zone lets no path lead: {math.degrees(problem.no_go_half_rad(0.0)):.1f} "
            f"deg on each side at the start, {math.degrees(min(problem.no_go_max_rad, math.pi)):.1f} deg later")


def _first_paths(s: Searcher) -> str | None:
    """Find a first path; return why there is none if that is proved."""
    if len(s.world.grid.edges) == 0:
        return None if s.best is not None else _lattices(s)
    s.lattice(400, 2, margin=0.5, half_at_s=1.3 * s.bound.value_s)
    if s.world.boat.zone_half > 0.0:   # the metric knows nothing of courses that the autopilot does not keep to
        s.lattice(1_600, 2, margin=0.5, half_at_s=1.3 * s.bound.value_s)
    s.geodesic(4_000)
    return None if s.best is not None else _lattices(s)


def _lattices(s: Searcher) -> str | None:
    """Run ever finer lattices until there is a path; return why there is none if that is proved."""
    for step, (cells, reach) in enumerate(_LADDER):
        if s.world.boat.kind != 0 and step < 4:
            s.drift(2 * cells, 1.45, math.inf)
        late = (1.3, 2.5, 1.0)[step % 3] * s.bound.value_s
        for margin in (0.25, 0.5):
            if s.effort.is_over:
                return None
            s.lattice(cells, reach, margin=margin, half_at_s=late)
            if s.best is not None:
                return None
            if s.world.fence_box:
                break
        if step == 0:
            closed = cut_off(s.world)
            if closed:
                return closed
        if step == 2:
            s.geodesic(40_000)
            if s.best is not None:
                return None
    return None


def _improve(s: Searcher) -> None:
    """Anneal the candidates and look for others until the effort ends."""
    if not shore_of(s.world.problem).is_large:
        _ = s.world.problem.eval_solid  # made now, so that the exact check at the end takes no time then
    has_solid = len(s.world.grid.edges) > 0
    lattices = list(_LATTICES) if has_solid else []
    drifts = list(_DRIFTS) if s.world.boat.kind != 0 else []
    spent, looked, turned, sharpened = 0.0, not has_solid, False, False
    s.next_turn()
    if has_solid and not s.is_done:
        s.geodesic(s.tests(40_000, 0.15))
    while not s.is_done:
        s.have_judged()   # also where the first path stays the best
        before = s.effort.fraction
        if before >= FINE_FROM:
            s.finish()
            continue
        if not looked and before > 0.08:
            looked = True
            s.other_sides(12)
        elif not turned and before > 0.15:
            turned = True
            s.other_tack()
        elif has_solid and not sharpened and before > 0.4:
            sharpened = True
            left = 8.0 * (s.effort.limit - s.effort.used) if s.effort.limit is not None else 2e6 * s.effort.remaining_s
            s.geodesic(int(0.25 * left))
            s.effort.spend(s.bound.sharpen_late(s.upper_s, min(40_000, int(0.1 * left))) // 8)
            if s.effort.remaining_s > _TURNS_S if s.effort.limit is None else left > _TURNS_TESTS:
                s.bound.sharpen_turns(s.upper_s)   # draws no path: no step is counted for it
        elif drifts and spent <= 0.35 * before and len(drifts) >= len(lattices):
            s.drift(*drifts.pop(0), 1.05 * s.upper_s)
        elif lattices and spent <= 0.35 * before:
            cells, reach = lattices.pop(0)
            late = s.upper_s * (1.0, 0.5, 0.8)[len(lattices) % 3]
            s.lattice(cells, reach, margin=0.5, half_at_s=late, stretch=1.0 + 0.07 * (len(lattices) % 4),
                      bound_s=1.05 * s.upper_s)
        else:
            s.next_turn()
            if has_solid and s.turns % 3 == 0 and not s.is_done:
                s.zoom()
            continue
        spent += s.effort.fraction - before
