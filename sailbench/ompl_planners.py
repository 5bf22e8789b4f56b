"""One OMPL planner on one problem, in a process of its own (it is killed when it overruns).

    python -m sailbench.ompl_planners PLANNER BUDGET_S SEED < PICKLED_PROBLEM    -> one JSON line: waypoints or null

PLANNER: rrtstar-se2, informed (Informed RRT* in the plane), bitstar. The planners get the problem's collision test
and no-go zone as a motion validator and the sailing time as the objective: length / speed, and in SE(2) the turns,
|heading change| / turn rate. What they cannot be told: time. The zone is taken at its widest over twice the lower
bound (but never wider than still lets the boat sail), and the exact scorer judges the path afterwards.
"""

from __future__ import annotations

import json
import math
import pickle
import sys
import time
from typing import Any

import numpy as np

from companion.geo.angles import wrap_pi
from companion.planner import Problem
from companion.planner.reference import kernels
from companion.planner.reference.rrtstar import simple_bound_s
from companion.planner.reference.world import bounds_of, world_of

PLANNERS = ("rrtstar-se2", "informed", "bitstar")


class Model:
    """Motion test and cost of one problem, without time."""

    def __init__(self, problem: Problem) -> None:
        self.p, self.w = problem, world_of(problem)
        until_s = 2.0 * simple_bound_s(problem)
        half = max(problem.no_go_half_rad(t) for t in np.linspace(0.0, until_s, 50))
        self.half = min(half, math.radians(80.0)) + 1e-6

    def speed(self, course: float) -> tuple[float, float]:
        """Return the heading [rad] that makes a course good, and the speed on it [m/s]."""
        heading, speed = kernels.way_on(course, self.w.number, self.w.polar, self.w.course)
        return float(heading), float(speed)

    def is_free(self, x0: float, y0: float, x1: float, y1: float) -> bool:
        """Whether a leg meets nothing and is sailable at any time."""
        if math.hypot(x1 - x0, y1 - y0) < 1e-9:
            return True
        heading, speed = self.speed(math.atan2(x1 - x0, y1 - y0))
        twa = abs(wrap_pi(heading - self.p.wind.twd_from_rad))
        if speed <= 0.0 or twa < self.half or twa > self.p.boat.max_twa_rad + 1e-9:
            return False
        w = self.w
        return bool(kernels.first_hit(x0, y0, x1, y1, w.edge, w.cell_first, w.cell_edge, w.grid, w.shape) > 1.0)

    def sail_s(self, x0: float, y0: float, x1: float, y1: float) -> float:
        """Return what a leg takes [s], without turns."""
        length = math.hypot(x1 - x0, y1 - y0)
        if length < 1e-9:
            return 0.0
        speed = self.speed(math.atan2(x1 - x0, y1 - y0))[1]
        return length / max(speed, 1e-6)


def solve(problem: Problem, name: str, budget_s: float, seed: int) -> list[tuple[float, float]] | None:
    """Return the waypoints that a planner of the library found."""
    from ompl import base as ob
    from ompl import geometric as og
    from ompl import util as ou

    ou.RNG.setSeed(seed + 1)
    ou.setLogLevel(ou.LOG_NONE)
    model = Model(problem)
    x0, y0, x1, y1 = bounds_of(problem)
    is_se2 = name == "rrtstar-se2"
    space = ob.SE2StateSpace() if is_se2 else ob.RealVectorStateSpace(2)
    bounds = ob.RealVectorBounds(2)
    for i, (low, high) in enumerate(((x0, x1), (y0, y1))):
        bounds.setLow(i, low)
        bounds.setHigh(i, high)
    space.setBounds(bounds)
    info = ob.SpaceInformation(space)

    def place(state: Any) -> tuple[float, float]:
        return (state.getX(), state.getY()) if is_se2 else (state[0], state[1])

    class Motion(ob.MotionValidator):  # type: ignore[misc]
        def checkMotion(self, a: Any, b: Any) -> bool:  # noqa: N802
            return model.is_free(*place(a), *place(b))

    class Time(ob.OptimizationObjective):  # type: ignore[misc]
        def stateCost(self, state: Any) -> Any:  # noqa: ARG002, N802
            return ob.Cost(0.0)

        def motionCost(self, a: Any, b: Any) -> Any:  # noqa: N802
            (ax, ay), (bx, by) = place(a), place(b)
            cost = model.sail_s(ax, ay, bx, by)
            if is_se2 and cost > 0.0:
                course = math.atan2(bx - ax, by - ay)
                turn = abs(wrap_pi(course - a.getYaw())) + abs(wrap_pi(b.getYaw() - course))
                cost += turn / problem.boat.turn_rate_radps
            return ob.Cost(cost)

        def motionCostHeuristic(self, a: Any, b: Any) -> Any:  # noqa: N802
            return ob.Cost(math.dist(place(a), place(b)) / max(problem.boat.polar_mps))

    motion = Motion(info)
    info.setMotionValidator(motion)
    valid = ob.AllValidStateValidityChecker(info)
    info.setStateValidityChecker(valid)
    info.setup()
    start, goal = space.allocState(), space.allocState()
    for state, (x, y), yaw in ((start, problem.start_en, problem.start_heading_rad), (goal, problem.goal_en, 0.0)):
        if is_se2:
            state.setX(x)
            state.setY(y)
            state.setYaw(wrap_pi(yaw))
        else:
            state[0], state[1] = x, y
    definition = ob.ProblemDefinition(info)
    definition.setStartAndGoalStates(start, goal, max(problem.goal_radius_m, 1e-3))
    objective = Time(info)
    definition.setOptimizationObjective(objective)
    planner = {"rrtstar-se2": og.RRTstar, "informed": og.InformedRRTstar, "bitstar": og.BITstar}[name](info)
    planner.setProblemDefinition(definition)
    planner.setup()
    until_s = time.process_time() + budget_s
    planner.solve(ob.PlannerTerminationCondition(lambda: time.process_time() >= until_s))
    if not definition.hasExactSolution():
        return None
    states = definition.getSolutionPath().getStates()
    return [place(s) for s in states]


def main() -> None:
    """Plan what comes on the standard input."""
    name, budget_s, seed = sys.argv[1:]
    problem: Problem = pickle.load(sys.stdin.buffer)  # noqa: S301 - from our own process
    model = Model(problem)  # the kernels are compiled or loaded before the clock starts
    model.is_free(*problem.start_en, *problem.goal_en)
    model.sail_s(*problem.start_en, *problem.goal_en)
    print(json.dumps(solve(problem, name, float(budget_s), int(seed))), flush=True)


if __name__ == "__main__":
    main()
