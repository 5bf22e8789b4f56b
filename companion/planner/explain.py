"""Why a plan looks as it does: what bound each leg, what the other side costs, what would change the choice.

What would change it is found by planning again (``what_if``). It is never needed to sail.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import shapely

from companion.planner.courses import courses
from companion.planner.plan import Leg, Plan, PlanStatus, Why
from companion.planner.problem.value import Problem
from companion.planner.risk.arrival import in_words, limits_in_words
from companion.planner.risk.chance_constraint import path_risk, with_parts
from companion.planner.risk.tacks import in_words as tacks_in_words
from companion.planner.risk.tacks import tacks_at_risk
from companion.planner.what_if import Replanner, decisive_side, other_side, what_would_help
from companion.words import counted

TOUCH_M = 0.5  # nearer than this a leg is said to touch
NO_GO_TOUCH_RAD = math.radians(0.5)
ROUND_ROOMS = 2.0  # a leg that is longer than so many times the room for turning round leads somewhere
_ING = {"tack": "tacking", "gybe": "gybing"}


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
    again = Replanner(plan, budget_s, expansions)
    if not plan.has_path:
        text, data = what_would_help(problem, again)
        return replace(plan, why=Why(text=text, data=data | {"replans": again.count}))
    legs = [leg_bounds(problem, leg) for leg in plan.legs]
    text, data = (
        _courses_in_words(problem, plan, legs),
        {
            "legs": legs,
            "turns": turns(problem, plan),
            "courses": [[course.first + 1, course.first + len(course.legs)] for course in courses(plan.legs)],
        },
    )
    side = decisive_side(problem, plan)
    if side is not None:
        more, other = other_side(problem, plan, side, again)
        text, data = f"{text} {more}", data | {"other_side": other}
    for more, about in (_clearance_in_words(problem, plan), _arrival_in_words(problem, plan)):
        text, data = f"{text} {more}".strip(), data | about
    why = Why(text=text, data=data | {"replans": again.count})
    return replace(plan, why=with_parts(why, problem, path_risk(problem, plan)) if problem.is_shared else why)


def bounds_in_words(problem: Problem, plan: Plan, numbers: Sequence[int] = ()) -> str:
    """Return what holds the plan where it is, in words; no replanning, so that it costs milliseconds.

    ``numbers``: each leg's in the mission that it is sailed as; without them courses are counted from 1.
    """
    return _courses_in_words(problem, plan, [leg_bounds(problem, leg) for leg in plan.legs], numbers)


def _clearance_in_words(problem: Problem, plan: Plan) -> tuple[str, dict[str, Any]]:
    """Return what is expected of the clearance, and of tacks that fail."""
    text = ""
    data: dict[str, Any] = {}
    if plan.expected_clearance_m is not None and plan.expected_at_en is not None and problem.tracking is not None:
        east, north = plan.expected_at_en
        text = (
            f"On the track that is expected the hull passes {plan.expected_clearance_m:.1f} m clear or more, least "
            f"at {east:.0f} E, {north:.0f} N (floor {problem.tracking.floor_m:g} m)."
        )
        data["expected_clearance_m"] = plan.expected_clearance_m
    tacks = tacks_at_risk(problem, plan.legs)
    if tacks:
        data["tacks"] = [
            {"leg": tack.leg + 1, "at": list(tack.at_en), "failures": tack.failures, "risk": tack.risk}
            for tack in tacks
        ]
    return " ".join([text, *tacks_in_words(problem, tacks)]).strip(), data


def _arrival_in_words(problem: Problem, plan: Plan) -> tuple[str, dict[str, Any]]:
    """Return when the plan arrives as wind and boat may be, and which of the boat's limits of wind it breaks."""
    if plan.arrival is None:
        return "", {}
    broken = limits_in_words(problem, plan.arrival)
    text = in_words(plan.arrival, plan.cost_s, is_boat_sure=problem.boat.speed_error == 0.0) + (
        f" Not to be sailed: {broken}." if broken else ""
    )
    return text, {"arrival": plan.arrival.to_dict()}


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
        binds.append(
            {
                "by": "no_go",
                "half_angle_deg": round(math.degrees(leg.no_go_half_rad), 2),
                "sigma_deg": round(math.degrees(leg.sigma_rad), 2),
                "widened_deg": round(math.degrees(widened), 2),
                "sigmas": round(widened / leg.sigma_rad, 3) if leg.sigma_rad > 1e-9 else 0.0,
            }
        )
    if abs(leg.twa_rad) >= problem.boat.max_twa_rad - NO_GO_TOUCH_RAD and problem.boat.max_twa_rad < math.pi - 1e-6:
        binds.append({"by": "deepest_angle", "angle_deg": round(math.degrees(problem.boat.max_twa_rad), 2)})
    reach = TOUCH_M + problem.clearance_floor_m
    if problem.obstacles:
        near = shapely.STRtree(problem.obstacles).query(line, predicate="dwithin", distance=reach)
        for i in sorted(int(k) for k in near):
            shape = problem.obstacles[i]
            at_end = shapely.distance(shape, end) <= reach
            at_start = shapely.distance(shape, start) <= reach
            where = (
                "along it"
                if at_end and at_start
                else "turns at it"
                if at_end
                else "leaves it"
                if at_start
                else "brushes it"
            )
            binds.append(
                {
                    "by": "obstacle",
                    "obstacle": i,
                    "name": problem.obstacle_name(i),
                    "where": where,
                    "around_en": _around(shape),
                }
            )
    if problem.fence_polygon is not None and shapely.distance(problem.fence_polygon.boundary, line) <= TOUCH_M:
        binds.append({"by": "fence"})
    return {
        "binds": binds,
        "margin_deg": round(math.degrees(leg.margin_rad), 2),
        "clearance_m": None if leg.clearance_m is None else round(leg.clearance_m, 2),
    }


def _around(shape: shapely.Geometry) -> list[float]:
    return [round(float(v), 1) for v in shapely.get_coordinates(shape.representative_point())[0]]


def _courses_in_words(problem: Problem, plan: Plan, legs: list[dict[str, Any]], numbered: Sequence[int] = ()) -> str:
    """Say what binds each course; what binds any leg of it binds it."""
    if len(plan.legs) == 1 and not legs[0]["binds"]:
        return "Straight there: nothing is in the way and the heading can be sailed."
    numbers: dict[str, list[int]] = {}
    merged = courses(plan.legs)
    for i, course in enumerate(merged, start=1):
        tack = "starboard" if course.legs[0].twa_rad > 0.0 else "port"
        bound: dict[str, None] = {}  # in order, each once
        for bind in (b for k in course.numbers for b in legs[k]["binds"]):
            bound[f"close-hauled on {tack} tack" if bind["by"] == "no_go" else _bind_in_words(bind)] = None
        for text in bound:
            numbers.setdefault(text, []).extend([numbered[k] for k in course.numbers] if numbered else [i])
    word = "Leg" if numbered else "Course"
    sentences = [f"{_named(word, sorted(set(which)))} {text}." for text, which in numbers.items()]
    if len(merged) < len(plan.legs) and not numbered:
        sentences.insert(
            0,
            f"{counted(len(plan.legs), 'leg')} make {counted(len(merged), 'course')}: within a course "
            "they bend by a few degrees, as the no-go zone grows or a shore does.",
        )
    zones = [bind for bound in legs for bind in bound["binds"] if bind["by"] == "no_go"]
    if zones:
        sentences.append(_zone_in_words(problem, zones))
    sentences += turns_in_words(problem, plan, numbered)
    if not sentences:
        return "No leg is bound by anything but its corners."
    shown = sentences if len(sentences) <= 12 else [*sentences[:11], f"And {len(sentences) - 11} more such bounds."]
    return " ".join(shown)


def turns(problem: Problem, plan: Plan) -> list[dict[str, Any]]:
    """Return each tack and gybe: the leg it leads into (from 1), its name and, of a gybe or tack the long way round
    in place of the other, which must cost more, the short legs that it takes."""  # noqa: D205, D209
    out: list[dict[str, Any]] = []
    legs, boat = plan.legs, problem.boat
    dear = (
        "tack"
        if not boat.can_tack or boat.tack_loss_s > boat.gybe_loss_s
        else "gybe"
        if boat.gybe_loss_s > boat.tack_loss_s
        else ""
    )
    for i, leg in enumerate(legs):
        if not leg.manoeuvre:
            continue
        entry: dict[str, Any] = {"leg": i + 1, "manoeuvre": leg.manoeuvre, "instead_of": None, "legs": []}
        # The same way round on both sides of a leg, by more than half a circle in all: that leg is there to turn.
        other = "tack" if leg.manoeuvre == "gybe" else "gybe"
        for j in (i - 1, i):
            if (
                other == dear
                and 0 < j + 1 < len(legs)
                and j >= 0
                and legs[j].length_m <= ROUND_ROOMS * boat.room_m
                and abs(legs[j].turn_rad + legs[j + 1].turn_rad) > math.pi
            ):
                entry["legs"].append(j + 1)
        if entry["legs"]:
            entry["instead_of"] = other
        out.append(entry)
    return out


def turns_in_words(problem: Problem, plan: Plan, numbered: Sequence[int] = ()) -> list[str]:
    """Return sentences on the tacks and gybes, and why one is sailed in place of the other."""
    every = turns(problem, plan)
    course_of = {k + 1: i for i, course in enumerate(courses(plan.legs), start=1) for k in course.numbers}
    word = "leg" if numbered else "course"
    if numbered:
        course_of = dict(enumerate(numbered, start=1))
    out = []
    for name in ("tack", "gybe"):
        plain = [t["leg"] for t in every if t["manoeuvre"] == name and not t["instead_of"]]
        if plain:
            out.append(f"A {name} leads into {_named(word, sorted({course_of[k] for k in plain}))}.")
        round_ = sorted({k for t in every if t["manoeuvre"] == name and t["instead_of"] for k in t["legs"]})
        if round_:
            other = "tack" if name == "gybe" else "gybe"
            lost = problem.boat.tack_loss_s if other == "tack" else problem.boat.gybe_loss_s
            why = (
                "the boat cannot tack"
                if other == "tack" and not problem.boat.can_tack
                else f"a {other} would lose {lost:.0f} s"
            )
            out.append(
                f"It {name}s round instead of {_ING[other]}, by way of "
                f"{_named(word, sorted({course_of[k] for k in round_}))}: {why}."
            )
    return out


def _named(word: str, which: list[int]) -> str:
    """Return ``Course 1``, ``Courses 1 and 3``, ``Courses 1 to 4 and 7``."""
    runs: list[list[int]] = []
    for number in which:
        if runs and number == runs[-1][-1] + 1:
            runs[-1].append(number)
        else:
            runs.append([number])
    parts = [
        part
        for run in runs
        for part in ([f"{run[0]} to {run[-1]}"] if len(run) > 2 else [str(number) for number in run])
    ]
    text = parts[0] if len(parts) == 1 else f"{', '.join(parts[:-1])} and {parts[-1]}"
    return f"{word}{'s' if len(which) > 1 else ''} {text}"


def _zone_in_words(problem: Problem, zones: list[dict[str, Any]]) -> str:
    """Say how wide the no-go zone is where it binds, and what of it is the boat's, her leeway's and the doubt's."""

    def span(key: str) -> str:
        low, high = round(min(z[key] for z in zones)), round(max(z[key] for z in zones))
        return f"{low}°" if low == high else f"{low} to {high}°"

    leeway_deg = math.degrees(problem.boat.leeway_rad)
    bow_deg = math.degrees(problem.boat.no_go_half_rad) - leeway_deg
    parts = [f"{bow_deg:.0f}° of it her no-go angle"]
    if leeway_deg > 0.0:
        parts.append(f"{leeway_deg:.0f}° leeway")
    if max(z["widened_deg"] for z in zones) > 0.0:
        parts.append(
            f"{span('widened_deg')} for an angle to the wind uncertain by {span('sigma_deg')} "
            f"({max(z['sigmas'] for z in zones):.2f} sigma)"
        )
    said = f": {', '.join(parts[:-1])} and {parts[-1]}" if len(parts) > 1 else ""
    return f"Close-hauled is a course {span('half_angle_deg')} off the wind{said}."


def _bind_in_words(bind: dict[str, Any]) -> str:
    if bind["by"] == "obstacle":
        east, north = bind["around_en"]
        verb = {
            "along it": "along",
            "turns at it": "up to a turn at",
            "leaves it": "from a turn at",
            "brushes it": "brushing",
        }[bind["where"]]
        east_m, north_m = (f"{round(value) + 0:d} m" for value in (east, north))  # no minus before a zero
        return f"{verb} {bind['name']} (around {east_m} E, {north_m} N)"
    if bind["by"] == "beat":
        return f"beaten by the autopilot, {bind['corridor_m']:.0f} m to either side of its line"
    if bind["by"] == "fence":
        return "along or up to the fence"
    return f"as deep as the boat may go, {bind['angle_deg']:.0f}°"
