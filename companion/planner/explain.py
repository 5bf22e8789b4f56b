"""Why a plan looks as it does: what bound each leg, what the other side costs, what would change the choice.

``explain`` plans again, often, with small budgets: with the chosen side of the decisive obstacle walled off, with
the wind shifted, and for a failure with delta_s, the obstacles or the fence eased. It is never needed to sail, and
its answers are as good as the plans it could make in its budget; the data say how many there were.
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
from companion.planner.plan import Leg, Plan, PlanStatus, Why
from companion.planner.problem import Problem
from companion.planner.risk import path_risk, with_parts

TOUCH_M = 0.5                      # nearer than this a leg is said to touch
NO_GO_TOUCH_RAD = math.radians(0.5)
_ING = {"tack": "tacking", "gybe": "gybing"}
MAX_SHIFT_RAD = math.radians(60.0)  # larger shifts are another day's wind
SHIFT_RESOLUTION_RAD = math.radians(1.0)
_SHARE = 1.0 / 30.0                # of the budget for one replan: both sides of the bisection fit

Planner = Callable[[Problem], Plan]


@dataclass(frozen=True, slots=True, kw_only=True)
class _Side:
    """The place where a plan chooses: its anchor, the way to the path and how it is said."""

    anchor_en: tuple[float, float]
    outward_en: tuple[float, float]
    obstacle: int | None
    words: str


class _Replanner:
    """Plans variants until the time is up."""

    def __init__(self, plan: Plan, budget_s: float, expansions: int | None) -> None:
        self._until_s = effort_s() + budget_s
        self._each_s = max(0.02, budget_s * _SHARE)
        self._expansions = expansions
        self._plan = plan
        self.count = 0

    @property
    def is_over(self) -> bool:
        """Is the time up? Never with an expansion budget: then the count of replans is fixed instead."""
        return self._expansions is None and effort_s() >= self._until_s

    def __call__(self, problem: Problem) -> Plan:
        from companion.planner.solve import plan

        self.count += 1
        budget_s = self._each_s if self._expansions is None else None
        return plan(problem, budget_s=budget_s, expansions=self._expansions, seed=self._plan.seed,
                    algorithm=self._plan.algorithm)


def explain(problem: Problem, plan: Plan, budget_s: float = 5.0, *, expansions: int | None = None) -> Plan:
    """Return the plan with ``why`` filled in.

    Args:
        problem: What was planned.
        plan: Its plan, with or without a path.
        budget_s: Computing time for all the replanning [s].
        expansions: With it each replan spends so many expansions instead, and the answer is the same everywhere.
    """
    if plan.status is PlanStatus.INVALID:
        return replace(plan, why=Why(text=f"Cannot be planned: {plan.reason}.", data={"invalid": plan.reason}))
    again = _Replanner(plan, budget_s, expansions)
    if not plan.has_path:
        text, data = _what_would_help(problem, again)
        return replace(plan, why=Why(text=text, data=data | {"replans": again.count}))
    legs = [leg_bounds(problem, leg) for leg in plan.legs]
    text, data = _legs_in_words(problem, plan, legs), {"legs": legs, "turns": turns(plan)}
    side = _decisive_side(problem, plan)
    if side is not None:
        more, other = _other_side(problem, plan, side, again)
        text, data = f"{text} {more}", data | {"other_side": other}
    why = Why(text=text, data=data | {"replans": again.count})
    return replace(plan, why=with_parts(why, problem, path_risk(problem, plan)) if problem.is_shared else why)


# -------------------------------------------------------------------------------------- each leg
def with_clearance(problem: Problem, plan: Plan) -> Plan:
    """Return the plan with each leg's distance to the nearest obstacle or fence filled in."""
    parts = [problem.obstacle_union]
    if problem.fence_polygon is not None:
        parts.append(problem.fence_polygon.boundary)
    walls = shapely.union_all([g for g in parts if not g.is_empty])
    if walls.is_empty or not plan.has_path:
        return plan
    shapely.prepare(walls)
    legs = tuple(
        replace(leg, clearance_m=float(shapely.distance(walls, shapely.LineString([leg.from_en, leg.to_en]))))
        for leg in plan.legs
    )
    return replace(plan, legs=legs)


def leg_bounds(problem: Problem, leg: Leg) -> dict[str, Any]:
    """Return what holds a leg where it is: the no-go zone (at what sigma), obstacles by number, the fence."""
    line = shapely.LineString([leg.from_en, leg.to_en])
    end, start = shapely.Point(leg.to_en), shapely.Point(leg.from_en)
    binds: list[dict[str, Any]] = []
    if leg.is_beat and problem.beat is not None:
        binds.append({"by": "beat", "corridor_m": round(problem.beat.corridor_m, 1)})
    elif leg.margin_rad <= NO_GO_TOUCH_RAD:
        widened = leg.no_go_half_rad - problem.boat.no_go_half_rad
        binds.append({
            "by": "no_go", "half_angle_deg": round(math.degrees(leg.no_go_half_rad), 2),
            "sigma_deg": round(math.degrees(leg.sigma_rad), 2), "widened_deg": round(math.degrees(widened), 2),
            "sigmas": round(widened / leg.sigma_rad, 3) if leg.sigma_rad > 1e-9 else 0.0,
        })
    if abs(leg.twa_rad) >= problem.boat.max_twa_rad - NO_GO_TOUCH_RAD and problem.boat.max_twa_rad < math.pi - 1e-6:
        binds.append({"by": "deepest_angle", "angle_deg": round(math.degrees(problem.boat.max_twa_rad), 2)})
    reach = TOUCH_M + problem.clearance_floor_m
    if problem.obstacles:
        near = shapely.STRtree(problem.obstacles).query(line, predicate="dwithin", distance=reach)
        for i in sorted(int(k) for k in near):
            shape = problem.obstacles[i]
            at_end = shapely.distance(shape, end) <= reach
            at_start = shapely.distance(shape, start) <= reach
            where = "along it" if at_end and at_start else "turns at it" if at_end else "leaves it" if at_start \
                else "brushes it"
            binds.append({"by": "obstacle", "obstacle": i, "where": where, "around_en": _around(shape)})
    if problem.fence_polygon is not None and shapely.distance(problem.fence_polygon.boundary, line) <= TOUCH_M:
        binds.append({"by": "fence"})
    return {
        "binds": binds, "margin_deg": round(math.degrees(leg.margin_rad), 2),
        "clearance_m": None if leg.clearance_m is None else round(leg.clearance_m, 2),
    }


def _around(shape: shapely.Geometry) -> list[float]:
    return [round(float(v), 1) for v in shapely.get_coordinates(shape.representative_point())[0]]


def _legs_in_words(problem: Problem, plan: Plan, legs: list[dict[str, Any]]) -> str:
    if len(plan.legs) == 1 and not legs[0]["binds"]:
        return "Straight there: nothing is in the way and the heading can be sailed."
    numbers: dict[str, list[int]] = {}
    for i, (leg, bound) in enumerate(zip(plan.legs, legs, strict=True), start=1):
        for bind in bound["binds"]:
            if bind["by"] != "no_go":
                numbers.setdefault(_bind_in_words(bind), []).append(i)
            else:
                tack = "starboard" if leg.twa_rad > 0.0 else "port"
                numbers.setdefault(f"close-hauled on {tack} tack", []).append(i)
    sentences = [f"{_legs_of(which)} {text}." for text, which in numbers.items()]
    zones = [bind for bound in legs for bind in bound["binds"] if bind["by"] == "no_go"]
    if zones:
        sentences.append(_zone_in_words(zones))
    sentences += turns_in_words(problem, plan)
    if not sentences:
        return "No leg is bound by anything but its corners."
    shown = sentences if len(sentences) <= 12 else [*sentences[:11], f"And {len(sentences) - 11} more such bounds."]
    return " ".join(shown)


def turns(plan: Plan) -> list[dict[str, Any]]:
    """Return each tack and gybe: the leg it leads into (from 1), its name and, of a gybe or tack the long way round
    in place of the other, the legs that it takes."""  # noqa: D205, D209
    out: list[dict[str, Any]] = []
    legs = plan.legs
    for i, leg in enumerate(legs):
        if not leg.manoeuvre:
            continue
        entry: dict[str, Any] = {"leg": i + 1, "manoeuvre": leg.manoeuvre, "instead_of": None, "legs": []}
        # The same way round on both sides of a leg, by more than half a circle in all: that leg is there to turn.
        for j in (i - 1, i):
            if 0 < j + 1 < len(legs) and j >= 0 and abs(legs[j].turn_rad + legs[j + 1].turn_rad) > math.pi:
                entry["legs"].append(j + 1)
        if entry["legs"]:
            entry["instead_of"] = "tack" if leg.manoeuvre == "gybe" else "gybe"
        out.append(entry)
    return out


def turns_in_words(problem: Problem, plan: Plan) -> list[str]:
    """Return sentences on the tacks and gybes, and why one is sailed in place of the other."""
    every = turns(plan)
    out = []
    for name in ("tack", "gybe"):
        plain = [t["leg"] for t in every if t["manoeuvre"] == name and not t["instead_of"]]
        if plain:
            out.append(f"A {name} leads into {_legs_of(plain)[0].lower()}{_legs_of(plain)[1:]}.")
        round_ = sorted({k for t in every if t["manoeuvre"] == name and t["instead_of"] for k in t["legs"]})
        if round_:
            other = "tack" if name == "gybe" else "gybe"
            lost = problem.boat.tack_loss_s if other == "tack" else problem.boat.gybe_loss_s
            why = "the boat cannot tack" if other == "tack" and not problem.boat.can_tack else \
                f"a {other} would lose {lost:.0f} s"
            out.append(f"It {name}s round instead of {_ING[other]}, by way of "
                       f"{_legs_of(round_)[0].lower()}{_legs_of(round_)[1:]}: {why}.")
    return out


def _legs_of(which: list[int]) -> str:
    if len(which) == 1:
        return f"Leg {which[0]}"
    return f"Legs {', '.join(map(str, which[:-1]))} and {which[-1]}"


def _zone_in_words(zones: list[dict[str, Any]]) -> str:
    """Say how wide the no-go zone is where it binds, and at what sigma."""
    def span(key: str) -> str:
        low, high = round(min(z[key] for z in zones)), round(max(z[key] for z in zones))
        return f"{low}°" if low == high else f"{low} to {high}°"

    text = f"Close-hauled is {span('half_angle_deg')} off the wind"
    if max(z["widened_deg"] for z in zones) > 0.0:
        text += (f", {span('widened_deg')} of it for a wind uncertain by {span('sigma_deg')} "
                 f"({max(z['sigmas'] for z in zones):.2f} sigma)")
    return f"{text}."


def _bind_in_words(bind: dict[str, Any]) -> str:
    if bind["by"] == "obstacle":
        east, north = bind["around_en"]
        verb = {"along it": "along", "turns at it": "up to a turn at", "leaves it": "from a turn at",
                "brushes it": "brushing"}[bind["where"]]
        return f"{verb} obstacle {bind['obstacle'] + 1} (around {east:.0f} E, {north:.0f} N)"
    if bind["by"] == "fence":
        return "along or up to the fence"
    return f"as deep as the boat may go, {bind['angle_deg']:.0f}°"


# -------------------------------------------------------------------------------------- the other side
def _decisive_side(problem: Problem, plan: Plan) -> _Side | None:
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
            return _Side(anchor_en=_pair(inside), outward_en=_pair(outward / np.hypot(*outward)),
                         obstacle=nearest, words=f"{_compass(outward)} of obstacle {nearest + 1}")
    foot = start + line * float(np.clip(np.dot(corner - start, line) / length**2, 0.02, 0.98))
    across = np.array([line[1], -line[0]]) / length * math.copysign(1.0, float(off[i]))
    return _Side(anchor_en=_pair(foot), outward_en=_pair(across), obstacle=None,
                 words=f"{_compass(across)} of the straight line")


def _nearest_on_path(way: NDArray[np.float64], place: NDArray[np.float64]) -> NDArray[np.float64]:
    path = shapely.LineString(way)
    return np.asarray(shapely.get_coordinates(path.interpolate(path.project(shapely.Point(place))))[0])


def _pair(v: NDArray[np.float64]) -> tuple[float, float]:
    return float(v[0]), float(v[1])


def _compass(v: NDArray[np.float64]) -> str:
    names = ("north", "north-east", "east", "south-east", "south", "south-west", "west", "north-west")
    return names[round(math.degrees(math.atan2(v[0], v[1])) / 45.0) % 8]


def walled(problem: Problem, side: _Side, *, sign: float) -> Problem:
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
    wall = shapely.Polygon([
        (ax - uy * half, ay + ux * half), (ax + uy * half, ay - ux * half),
        (ax + far * ux + uy * half, ay + far * uy - ux * half), (ax + far * ux - uy * half, ay + far * uy + ux * half),
    ])
    return replace(problem, obstacles=(*problem.obstacles, wall))


def _other_side(problem: Problem, plan: Plan, side: _Side, again: _Replanner) -> tuple[str, dict[str, Any]]:
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


def _deciding_shift(problem: Problem, side: _Side, again: _Replanner) -> float | None:
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


# -------------------------------------------------------------------------------------- failures
def _what_would_help(problem: Problem, again: _Replanner) -> tuple[str, dict[str, Any]]:
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
    make: Callable[[float], Problem], easy: float, hard: float, tolerance: float, again: _Replanner,
) -> float | None:
    """Return the value nearest to ``hard`` at which a path is found, within ``tolerance``; None when not even easy."""
    if again.is_over or not again(make(easy)).has_path:
        return None
    while abs(hard - easy) > tolerance and not again.is_over:
        middle = 0.5 * (easy + hard)
        easy, hard = (middle, hard) if again(make(middle)).has_path else (easy, middle)
    return easy
