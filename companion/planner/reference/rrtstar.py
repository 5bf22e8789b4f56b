"""``rrtstar``: the reference, RRT* on SE(2) with Wolsieffer's steering and cost (2020, Algorithms 1 and 2).

A state is place and heading of arrival. The cost of an edge is length / speed + |heading change| / turn rate
(Algorithm 2, with the speed of the polar where there is one). Three things the paper leaves open are decided here:
the no-go zone is taken at its widest over each leg, so that the chance constraint holds at every instant; a
rewiring is done only if nothing below it becomes slower or infeasible; sampling is in the fence or, without one,
in a box of half the distance around everything.

With ``problem.risk`` it is CC-RRT* (Luders, Karaman and How 2013): every state carries a bound on the risk that
its path has accumulated, states above the limit are refused, and the cost is time plus ``risk_weight_s`` per unit
of risk, plus ``state_risk_weight_s`` times the greatest risk of any one state. ``risk.leg_risk`` says how a leg's
share is bounded. ``companion.planners`` has the numbers.

Uncertain vessels are under the tree's bound, too (``companion.planner.reference.vessels``): an edge on which one may be
too near with more than its part of the promise is refused, and what it adds to the path's risk is a state's to carry.

References:
    [1] B. Wolsieffer, Safe Navigation for Autonomous Sailboats under Uncertain Wind Conditions, 2020.
    [2] S. Karaman, E. Frazzoli, Sampling-based algorithms for optimal motion planning, 2011,
        doi:10.1177/0278364911406761.
    [3] B. Luders, S. Karaman, J. How, Robust sampling-based motion planning with asymptotic optimality guarantees,
        2013, doi:10.2514/6.2013-5097.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from companion.geo.angles import wrap_pi
from companion.planner.effort import Effort, Outcome
from companion.planner.plan import PlanStatus
from companion.planner.problem.evaluate import endpoint_error
from companion.planner.problem.value import Problem
from companion.planner.reference import rrtstar_kernels as kernels
from companion.planner.reference.vessels import NO_VESSELS, TreeVessels
from companion.planner.reference.world import ReferenceWorld, bounds_of, world_of
from companion.planner.risk.chance_constraint import PROMISE_FACTOR, process_of
from companion.planners import RrtstarSettings

REACH_SHARE = 0.2  # of the search box's diagonal: OMPL's default range
DEFAULTS = RrtstarSettings()
CHUNK = 256
FIRST_CAPACITY = 20_000
MOST_NODES = 2_000_000  # 200 bytes each


class RrtTree:
    """The growing tree: the kernel's arrays and nothing else."""

    def __init__(
        self,
        problem: Problem,
        world: ReferenceWorld,
        seed: int,
        settings: RrtstarSettings = DEFAULTS,
        vessels: TreeVessels = NO_VESSELS,
    ) -> None:
        self.world = world
        self._vessels = vessels
        box = bounds_of(problem)
        self._box = np.array(box)
        self._goal = np.array([*problem.goal_en, max(problem.goal_radius_m, 1e-6)])
        self._settings = settings
        self._reach_m = max(1e-3, settings.range_m or REACH_SHARE * math.hypot(box[2] - box[0], box[3] - box[1]))
        self._random = np.array([_scramble(seed)], dtype=np.uint64)
        self._near = np.zeros(256, np.int64)
        self._near_d = np.zeros(256)
        self.count = np.array([1, 0, -1, 0, 0, 0], dtype=np.int64)
        self.node, self.link = np.zeros((0, kernels.COLUMNS), order="F"), np.zeros((0, 4), dtype=np.int64)
        self._goal_node = np.zeros(0, dtype=np.int64)
        self._resize(FIRST_CAPACITY)
        self.node[0, :4] = *problem.start_en, wrap_pi(problem.start_heading_rad), 0.0
        self.link[0] = -1
        process = process_of(problem)
        # The plan will promise PROMISE_FACTOR times its risk: the tree keeps that much below the limit.
        limit = problem.risk.max_path_risk / PROMISE_FACTOR if problem.risk is not None else math.inf
        self._risk_number = np.array(
            [
                float(problem.risk is not None),
                process.model,
                process.s0,
                process.s1,
                process.rho,
                process.tau,
                limit,
                settings.risk_weight_s if problem.risk is not None else 0.0,
                settings.state_risk_weight_s,
                float(settings.is_rewired),
            ]
        )
        self._risk_table = np.ascontiguousarray(np.array([process.table_t, process.table_s]))

    def _resize(self, capacity: int) -> None:
        # Column by column: the kernel looks through all places at each sample.
        node, link = np.zeros((capacity, kernels.COLUMNS), order="F"), np.full((capacity, 4), -1, dtype=np.int64)
        goal_node = np.zeros(capacity, dtype=np.int64)
        if self.count[kernels.N] > 1:
            n = int(self.count[kernels.N])
            node[:n], link[:n], goal_node[:n] = self.node[:n], self.link[:n], self._goal_node[:n]
        self.node, self.link, self._goal_node = node, link, goal_node
        self._stack, self._fresh = np.zeros(capacity, dtype=np.int64), np.zeros((capacity, kernels.COLUMNS), order="F")

    def grow(self, samples: int) -> None:
        """Draw that many samples."""
        if self.count[kernels.N] + samples > self.node.shape[0]:
            self._resize(2 * self.node.shape[0])
        w = self.world
        kernels.grow(
            samples,
            self.node,
            self.link,
            self._goal_node,
            self.count,
            self._random,
            self._box,
            self._goal,
            self._reach_m,
            self._settings.goal_bias,
            self._near,
            self._near_d,
            self._stack,
            self._fresh,
            w.edge,
            w.cell_first,
            w.cell_edge,
            w.grid,
            w.shape,
            w.number,
            w.no_go_model,
            w.table,
            w.polar,
            w.course,
            w.target,
            self._risk_number,
            self._risk_table,
            self._vessels.window,
            self._vessels.disc,
        )

    @property
    def size(self) -> int:
        """States in the tree."""
        return int(self.count[kernels.N])

    @property
    def best(self) -> int:
        """The goal state of least cost, or -1."""
        return int(self.count[kernels.BEST])

    def path_to(self, state: int) -> NDArray[np.float64]:
        """Return the places from the root to a state, (n, 2)."""
        places = []
        while state >= 0:
            places.append(self.node[state, :2])
            state = int(self.link[state, kernels.PARENT])
        return np.array(places[::-1])

    def edges(self, most: int = 20_000) -> NDArray[np.float64]:
        """Return up to ``most`` edges (n, 4): x0, y0, x1, y1 [m], evenly out of all."""
        n = self.size
        which = np.arange(1, n)[:: max(1, -(-(n - 1) // most))] if n > 1 else np.zeros(0, np.int64)
        parent = self.link[which, kernels.PARENT]
        return np.column_stack([self.node[parent, :2], self.node[which, :2]])


def search(
    problem: Problem, effort: Effort, seed: int, settings: RrtstarSettings = DEFAULTS, vessels: TreeVessels = NO_VESSELS
) -> Outcome:
    """Grow the tree until the effort is over; an expansion is one sample drawn.

    ``vessels`` come under the tree's own bound, beside the problem's targets, which are closed to it.
    """
    error = endpoint_error(problem)
    if error is not None:
        return Outcome(waypoints_en=None, status=PlanStatus.INVALID, reason=error)
    if math.dist(problem.start_en, problem.goal_en) <= problem.goal_radius_m:
        effort.found()
        return Outcome(waypoints_en=np.array([problem.start_en]))
    tree = RrtTree(problem, world_of(problem), seed, settings, vessels)
    judged = math.inf
    while not effort.is_over and tree.size < MOST_NODES:
        samples = effort.remaining(CHUNK)
        if samples <= 0:
            break
        tree.grow(samples)
        effort.spend(samples)
        if tree.best >= 0:
            effort.found()
            cost = float(tree.node[tree.best, kernels.C])
            if cost < judged and effort.improved(lambda: tree.path_to(tree.best), cost):
                judged = cost
    trace = {
        "tree": tree.edges(),
        "states": tree.size,
        "rewired": int(tree.count[kernels.REWIRED]),
        "refused": int(tree.count[kernels.REFUSED]),
    }
    if tree.best < 0:
        reason = f"no path among {tree.size} states; a tree cannot prove that there is none"
        return Outcome(waypoints_en=None, status=PlanStatus.TIMEOUT, reason=reason, trace=trace)
    if problem.risk is not None:
        trace["risk_bound"] = float(tree.node[tree.best, kernels.R])
    return Outcome(waypoints_en=tree.path_to(tree.best), lower_bound_s=simple_bound_s(problem), trace=trace)


def simple_bound_s(problem: Problem) -> float:
    """Return a bound that needs no search: the distance at the fastest the boat can ever go."""
    fastest = max(problem.boat.polar_mps) + problem.current.drift_mps
    return max(0.0, math.dist(problem.start_en, problem.goal_en) - problem.goal_radius_m) / fastest


def _scramble(seed: int) -> int:
    """Return a non-zero 64-bit state from a seed (splitmix64)."""
    z = (seed * 0x9E3779B97F4A7C15 + 0x632BE59BD9B4E019) & 0xFFFFFFFFFFFFFFFF
    z = ((z ^ (z >> 30)) * 0xBF58476D1CE4E5B9) & 0xFFFFFFFFFFFFFFFF
    z = ((z ^ (z >> 27)) * 0x94D049BB133111EB) & 0xFFFFFFFFFFFFFFFF
    return (z ^ (z >> 31)) or 1
