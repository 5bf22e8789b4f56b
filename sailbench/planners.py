"""Planners: a function of a problem, a budget and a seed; and those that others are measured by."""

from __future__ import annotations

import importlib
import importlib.util
import json
import math
import pickle
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from types import MappingProxyType
from typing import Literal, Protocol
from unittest import mock

import numpy as np
from numpy.typing import NDArray

from companion.boat import Polar
from companion.errors import InputError
from companion.planner import ALGORITHMS, PlanStatus, Problem, effort, plan
from lab.greedy import best_heading
from sailbench.ompl_planners import PLANNERS as OMPL

IMPOSSIBLE: Literal["impossible"] = "impossible"
Waypoints = Sequence[tuple[float, float]] | NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Answer:
    """A planner's answer, where it has more to say than the path."""

    waypoints_en: Waypoints | None = None
    is_impossible: bool = False
    first_s: float | None = None  # processor time until the first path [s]
    bound_s: float | None = None  # no path is faster than this, as the planner claims [s]


Given = Answer | Waypoints | Literal["impossible"] | None


class Planner(Protocol):
    """What is measured. ``budget_s`` is processor time of one core, kernels warm; the same seed, the same luck."""

    def __call__(self, problem: Problem, budget_s: float, seed: int) -> Given:
        """Return the waypoints, (n, 2) metres east and north, the start first and the last inside the goal's disc.

        Empty or None: nothing was found. ``IMPOSSIBLE``: there is no path, which counts only where it is true.
        """


def answer_of(given: Given) -> Answer:
    """Return what a planner gave as an answer. Raises ValueError, TypeError: it gave no such thing."""
    if isinstance(given, Answer):
        return given
    if isinstance(given, str):
        if given != IMPOSSIBLE:
            raise ValueError(f"{given!r} is no answer: waypoints, {IMPOSSIBLE!r} or nothing")
        return Answer(is_impossible=True)
    way = np.empty((0, 2)) if given is None else np.asarray(given, dtype=np.float64)
    if way.size and (way.ndim != 2 or way.shape[1] != 2):
        raise ValueError(f"waypoints are (n, 2), not {way.shape}")
    return Answer(waypoints_en=way if way.size else None)


def ours(problem: Problem, budget_s: float, seed: int, *, algorithm: str) -> Answer:
    """Plan by one of the companion's algorithms, which count its seconds by the clock: here by the processor's."""
    with mock.patch.object(effort, "effort_s", time.process_time):
        found = plan(problem, budget_s=budget_s, seed=seed, algorithm=algorithm)
    return Answer(
        waypoints_en=found.waypoints_en if found.has_path else None,
        is_impossible=found.status in {PlanStatus.INFEASIBLE, PlanStatus.INVALID},
        first_s=found.first_s,
        bound_s=found.lower_bound_s if math.isfinite(found.lower_bound_s) else None,
    )


STEPS = 2000  # of the greedy sailor at most
STEP_SHARE = 0.01  # of the way from start to goal
_TWA_RAD = np.radians(np.arange(0.0, 181.0))


def greedy(problem: Problem, budget_s: float, seed: int) -> Given:  # noqa: ARG001
    """Sail the heading that makes most way towards the goal, step by step; rocks are none of its business."""
    boat, wind = problem.boat, problem.wind
    at, heading_rad, t_s = problem.start_en, problem.start_heading_rad, 0.0
    path, step_m = [at], STEP_SHARE * math.dist(at, problem.goal_en)
    speeds = np.array([boat.speed_mps(float(twa)) for twa in _TWA_RAD])
    for _ in range(STEPS):
        way = problem.goal_en[0] - at[0], problem.goal_en[1] - at[1]
        if math.hypot(*way) <= problem.goal_radius_m:
            return path
        half_rad = max(problem.no_go_half_rad(t_s), problem.no_go_half_rad(t_s + 2.0 * step_m / float(speeds.max())))
        sailable = np.logical_and(_TWA_RAD >= half_rad, _TWA_RAD <= boat.max_twa_rad)  # noqa: SIM300
        if not sailable.any():
            return None
        polar = Polar(twa_rad=_TWA_RAD, tws_mps=np.ones(1), speed_mps_table=np.where(sailable, speeds, 0.0)[:, None])
        steer_rad = best_heading(
            polar, twd_from_rad=wind.twd_from_rad, tws_mps=1.0, way_en_m=way, heading_rad=heading_rad
        )
        length_m = min(step_m, max(0.5 * math.hypot(*way), 0.5 * problem.goal_radius_m))
        at = at[0] + length_m * math.sin(steer_rad), at[1] + length_m * math.cos(steer_rad)
        if len(path) > 1 and abs(math.remainder(steer_rad - heading_rad, math.tau)) < 1e-9:
            path.pop()
        path.append(at)
        turn_s = abs(math.remainder(steer_rad - heading_rad, math.tau)) / boat.turn_rate_radps
        t_s += turn_s + length_m / max(boat.speed_mps(steer_rad - wind.twd_from_rad), 1e-3)
        heading_rad = steer_rad
    return None


def by_ompl(problem: Problem, budget_s: float, seed: int, *, name: str) -> Given:
    """Plan by a planner of the library, in a process of its own: it may be killed, and may crash."""
    words = [sys.executable, "-m", "sailbench.ompl_planners", name, str(budget_s), str(seed)]
    try:
        done = subprocess.run(  # noqa: S603 - our own module
            words, input=pickle.dumps(problem), capture_output=True, timeout=20.0 * budget_s + 60.0, check=False
        )
    except subprocess.TimeoutExpired:
        return None
    lines = done.stdout.decode().splitlines()
    return [(x, y) for x, y in json.loads(lines[-1]) or ()] if done.returncode == 0 and lines else None


BASELINES: Mapping[str, Planner] = MappingProxyType(
    {
        **{name: partial(ours, algorithm=name) for name in ALGORITHMS},
        "greedy": greedy,
        **{f"ompl-{name}": partial(by_ompl, name=name) for name in OMPL},
    }
)
SAID = MappingProxyType(
    {
        "auto": "ours",
        "rrtstar": "RRT* of Wolsieffer 2020",
        "astar": "A* of Büsser 2009",
        "greedy": "greedy heading",
        "ompl-rrtstar-se2": "OMPL RRT* in SE(2)",
        "ompl-informed": "OMPL Informed RRT*",
        "ompl-bitstar": "OMPL BIT*",
    }
)


def present() -> list[str]:
    """Name the baselines that are there: OMPL's only where the library is."""
    has_ompl = importlib.util.find_spec("ompl") is not None
    return [name for name in BASELINES if has_ompl or not name.startswith("ompl-")]


def planner_named(name: str, *, wanted: str = "planner", known: Sequence[str] = tuple(BASELINES)) -> Planner:
    """Return a baseline by name, or anybody's function as ``MODULE:FUNCTION``.

    ``wanted`` and ``known`` are what is said where there is none.

    Raises:
        InputError: there is no such planner, or OMPL is not installed.

    """
    if name in BASELINES:
        if name not in present():
            raise InputError("planner", name, "needs the library OMPL", "in the clone: make env EXTRAS=bench")
        return BASELINES[name]
    module, _, function = name.partition(":")
    try:
        found: Planner = getattr(importlib.import_module(module), function)
    except (ImportError, AttributeError, ValueError) as error:
        remedy = f"MODULE:FUNCTION, or one of {', '.join(known)}"
        raise InputError(wanted, name, f"there is none ({error})", remedy) from error
    return found
