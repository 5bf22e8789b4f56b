"""What would change a plan: found by planning again, often, with small budgets.

With the chosen side of the decisive obstacle walled off, with the wind shifted, and for a failure with delta_s, the
obstacles or the fence eased. The answers are as good as the plans that the budget allows; their number is told.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from companion.clock import effort_s
from companion.planner.plan import Plan
from companion.planner.problem.value import Problem

MAX_SHIFT_RAD = math.radians(60.0)  # larger shifts are another day's wind
SHIFT_RESOLUTION_RAD = math.radians(1.0)
_SHARE = 1.0 / 30.0  # of the budget for one replan: both sides of the bisection fit


@dataclass(frozen=True, slots=True, kw_only=True)
class ObstacleSide:
    """The place where a plan chooses: its anchor, the way to the path and how it is said."""

    anchor_en: tuple[float, float]
    outward_en: tuple[float, float]
    obstacle: int | None
    words: str


class Replanner:
    """Plans variants until the time is up."""

    def __init__(self, plan: Plan, budget_s: float, expansions: int | None) -> None:
        self._until_s = effort_s() + budget_s
        self._each_s = max(0.02, budget_s * _SHARE)
        self._expansions = expansions
        self._plan = plan
        self.count = 0

    @property
    def is_over(self) -> bool:
        """Return whether the time is up: never with an expansion budget, then the count of replans is fixed instead."""
        return self._expansions is None and effort_s() >= self._until_s

    def __call__(self, problem: Problem) -> Plan:
        """Plan ``problem`` as the plan was made, with its share of the budget."""
        from companion.planner.solve import plan

        self.count += 1
        budget_s = self._each_s if self._expansions is None else None
        return plan(
            problem,
            budget_s=budget_s,
            expansions=self._expansions,
            seed=self._plan.seed,
            algorithm=self._plan.algorithm,
        )


def decisive_side(problem: Problem, plan: Plan) -> ObstacleSide | None:
    """Return where the path leaves the straight line most: at an obstacle there, else about the line itself."""
    way = np.asarray(plan.waypoints_en, dtype=np.float64)
    start, goal = np.array(problem.start_en), np.array(problem.goal_en)
    line = goal - start
    length = float(np.hypot(*line))
    if len(way) < 3 or length <= 0.0:
        return None
    off = ((way[:, 0] - start[0]) * line[1] - (way[:, 1] - start[1]) * line[0]) / length
    i = int(np.argmax(np.abs(off)))
    if abs(float(off[i])) < 1e-6 * length:
        return None
    corner = way[i]
    direct = shapely.LineString([problem.start_en, problem.goal_en])
    in_the_way: list[int] = []
    if problem.obstacles:
        in_the_way = [int(k) for k in shapely.STRtree(problem.obstacles).query(direct, predicate="intersects")]
    if in_the_way:
        nearest = min(in_the_way, key=lambda k: shapely.distance(problem.obstacles[k], shapely.LineString(way)))
        shape = problem.obstacles[nearest]
        inside = shapely.get_coordinates(shape.representative_point())[0]
        on_path = _nearest_on_path(way, inside)
        outward = on_path - inside
        if float(np.hypot(*outward)) > 1e-9:
            return ObstacleSide(
                anchor_en=_pair(inside),
                outward_en=_pair(outward / np.hypot(*outward)),
                obstacle=nearest,
                words=f"{_compass(outward)} of {problem.obstacle_name(nearest)}",
            )
    foot = start + line * float(np.clip(np.dot(corner - start, line) / length**2, 0.02, 0.98))
    across = np.array([line[1], -line[0]]) / length * math.copysign(1.0, float(off[i]))
    return ObstacleSide(
        anchor_en=_pair(foot), outward_en=_pair(across), obstacle=None, words=f"{_compass(across)} of the straight line"
    )


def _nearest_on_path(way: NDArray[np.float64], place: NDArray[np.float64]) -> NDArray[np.float64]:
    path = shapely.LineString(way)
    return np.asarray(shapely.get_coordinates(path.interpolate(path.project(shapely.Point(place))))[0])


def _pair(v: NDArray[np.float64]) -> tuple[float, float]:
    return float(v[0]), float(v[1])


def _compass(v: NDArray[np.float64]) -> str:
    names = ("north", "north-east", "east", "south-east", "south", "south-west", "west", "north-west")
    return names[round(math.degrees(math.atan2(v[0], v[1])) / 45.0) % 8]


def walled(problem: Problem, side: ObstacleSide, *, sign: float) -> Problem:
    """Return the problem with a thin wall from the anchor outwards (sign 1) or the other way (-1)."""
    size = math.dist(problem.start_en, problem.goal_en)
    far = 4.0 * size + 1000.0
    for shape in (problem.obstacle_union, problem.fence_polygon):
        if shape is not None and not shape.is_empty:
            x0, y0, x1, y1 = shape.bounds
            far = max(far, 2.0 * math.hypot(x1 - x0, y1 - y0))
    (ax, ay), (ux, uy) = side.anchor_en, side.outward_en
    ux, uy = sign * ux, sign * uy
    half = 5e-4 * size + 0.01
    wall = shapely.Polygon(
        [
            (ax - uy * half, ay + ux * half),
            (ax + uy * half, ay - ux * half),
            (ax + far * ux + uy * half, ay + far * uy - ux * half),
            (ax + far * ux - uy * half, ay + far * uy + ux * half),
        ]
    )
    return replace(problem, obstacles=(*problem.obstacles, wall))


def other_side(problem: Problem, plan: Plan, side: ObstacleSide, again: Replanner) -> tuple[str, dict[str, Any]]:
    """Return what the other side costs, and the shift of the wind that would make it the faster one."""
    other = again(walled(problem, side, sign=1.0))
    data: dict[str, Any] = {"chosen": side.words, "obstacle": side.obstacle, "cost_s": None, "shift_deg": None}
    if not other.has_path:
        return f"It passes {side.words}; no path was found on the other side.", data
    extra = other.cost_s - plan.cost_s
    data |= {"cost_s": other.cost_s, "extra_s": extra, "waypoints": other.waypoints_en.tolist()}
    more = "more" if extra >= 0.0 else "less"
    text = f"It passes {side.words}; the other side takes {other.cost_s:.0f} s, {abs(extra):.1f} s {more}."
    if extra < 0.0:
        return f"{text} The search had not found it: give it more budget.", data | {"shift_deg": 0.0}
    shift = _deciding_shift(problem, side, again)
    if shift is None:
        return f"{text} No shift of the wind up to {math.degrees(MAX_SHIFT_RAD):.0f}° was found to change that.", data
    data["shift_deg"] = round(math.degrees(shift), 1)
    way = "veer" if shift > 0.0 else "back"
    return f"{text} A {way} of {abs(math.degrees(shift)):.0f}° would make the other side the faster.", data


def shifted(problem: Problem, shift_rad: float) -> Problem:
    """Return the problem with the wind veered by ``shift_rad`` (clockwise positive)."""
    return replace(problem, wind=replace(problem.wind, twd_from_rad=problem.wind.twd_from_rad + shift_rad))


def _deciding_shift(problem: Problem, side: ObstacleSide, again: Replanner) -> float | None:
    """Return the smaller shift (veer or back) at which the other side becomes the faster; None when none is found."""

    def prefers_other(shift_rad: float) -> bool:
        turned = shifted(problem, shift_rad)
        chosen, other = again(walled(turned, side, sign=-1.0)), again(walled(turned, side, sign=1.0))
        return other.has_path and (not chosen.has_path or other.cost_s < chosen.cost_s)

    found: list[float] = []
    for sign in (1.0, -1.0):
        low, high = 0.0, None
        for degrees in (5.0, 15.0, 30.0, math.degrees(MAX_SHIFT_RAD)):  # outwards: the first change is the one meant
            if again.is_over:
                break
            if found and math.radians(degrees) > 2.0 * abs(found[0]):
                break
            if prefers_other(sign * math.radians(degrees)):
                high = math.radians(degrees)
                break
            low = math.radians(degrees)
        if high is None:
            continue
        while high - low > SHIFT_RESOLUTION_RAD and not again.is_over:
            middle = 0.5 * (low + high)
            low, high = (low, middle) if prefers_other(sign * middle) else (middle, high)
        found.append(sign * high)
    return min(found, key=abs) if found else None


def what_would_help(problem: Problem, again: Replanner) -> tuple[str, dict[str, Any]]:
    """Return the least change of delta_s, of the obstacles' margin and of the fence that makes a path."""
    data: dict[str, Any] = {"delta_s": None, "shrink_m": None, "fence_m": None, "path_risk": None}
    said: list[str] = []
    if problem.delta_s > 0.5 and problem.is_time_varying | (problem.no_go_max_rad > problem.boat.no_go_half_rad):
        best = _bisect(lambda x: replace(problem, delta_s=x), 0.5, problem.delta_s, 1e-3, again)
        if best is not None:
            data["delta_s"] = round(best, 4)
            said.append(f"with delta_s {best:.3f} instead of {problem.delta_s:g} there is a path")
    size = math.dist(problem.start_en, problem.goal_en)
    if problem.obstacles:

        def shrunk(m: float) -> Problem:
            return replace(problem, obstacles=tuple(s.buffer(-m) for s in problem.obstacles))

        best = _bisect(shrunk, 0.25 * size, 0.0, max(0.05, 1e-3 * size), again)
        if best is not None:
            data["shrink_m"] = round(best, 2)
            said.append(f"with every obstacle's margin {best:.1f} m smaller there is a path")
    if problem.fence is not None:
        fence = problem.fence

        def grown(m: float) -> Problem:
            return replace(problem, fence=fence.buffer(m))

        best = _bisect(grown, size, 0.0, max(0.1, 1e-3 * size), again)
        if best is not None:
            data["fence_m"] = round(best, 2)
            said.append(f"with the fence {best:.1f} m further out there is a path")
    if problem.risk is not None and again(replace(problem, risk=None)).has_path:
        data["path_risk"] = problem.risk.max_path_risk
        said.append(f"without the limit of {100.0 * problem.risk.max_path_risk:g} % on the path's risk there is a path")
    if not said:
        return "No single easing of delta_s, obstacles or fence was found that makes a path.", data
    text = "; ".join(said)
    return f"{text[0].upper()}{text[1:]}.", data


def _bisect(
    make: Callable[[float], Problem], easy: float, hard: float, tolerance: float, again: Replanner
) -> float | None:
    """Return the value nearest to ``hard`` at which a path is found, within ``tolerance``; None when not even easy."""
    if again.is_over or not again(make(easy)).has_path:
        return None
    while abs(hard - easy) > tolerance and not again.is_over:
        middle = 0.5 * (easy + hard)
        easy, hard = (middle, hard) if again(make(middle)).has_path else (easy, middle)
    return easy
