"""``companion plan --policy``: what is best done wherever she comes to be, in a wind that shifts."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from companion.geo.angles import direction
from companion.planner import Problem
from companion.planner.policy import PORT, STARBOARD, Decision, Policy, room_m, solve, wandering

PLACES = 20_000
"""The chart's, about: it takes a few seconds of a processor."""
LEAST_CELL_M, MOST_CELL_M = 1.0, 50.0
DRAWN = 1000


@dataclass(frozen=True, slots=True, kw_only=True)
class SolvedLeg:
    """A leg's problem and its policy; ``coarser_s`` is the time to go from its start on a grid twice as wide."""

    problem: Problem
    policy: Policy
    coarser_s: float
    steady_s: float

    @property
    def time_s(self) -> float:
        """The expected time from its start to the last goal, in the mean wind, on the better tack; inf: no way."""
        return self.policy.time_to_go_s(self.problem.start_en, 0.0)

    @property
    def tack(self) -> int:
        """The better tack to begin on."""
        on = [self.policy.time_to_go_s(self.problem.start_en, 0.0, tack) for tack in (PORT, STARBOARD)]
        return PORT if on[PORT] <= on[STARBOARD] else STARBOARD


def solved(problems: Sequence[Problem], shifts: tuple[float, float], *, budget_s: float = math.inf) -> list[SolvedLeg]:
    """Return each leg with its policy, which knows what is to go from its goal.

    ``shifts`` are the spread [deg] and how long one lasts [s]; ``budget_s`` is for the policy of each leg.
    """
    wind, steady = wandering(math.radians(shifts[0]), shifts[1]), wandering(0.0, 1.0)
    found: list[SolvedLeg] = []
    coarse: Policy | None = None
    still: Policy | None = None
    for problem in reversed(problems):
        cell_m = cell_of(problem)
        policy = solve(problem, wind, cell_m=cell_m, onward=found[-1].policy if found else None, budget_s=budget_s)
        coarse = solve(problem, wind, cell_m=2.0 * cell_m, onward=coarse)
        still = solve(problem, steady, cell_m=cell_m, onward=still)
        found.append(
            SolvedLeg(
                problem=problem,
                policy=policy,
                coarser_s=coarse.time_to_go_s(problem.start_en, 0.0),
                steady_s=still.time_to_go_s(problem.start_en, 0.0),
            )
        )
    return found[::-1]


def cell_of(problem: Problem) -> float:
    """Return the cells' size for a chart of about ``PLACES`` [m], two thirds of the goal's radius at the most."""
    length_m = math.dist(problem.start_en, problem.goal_en)
    side_m = length_m + 2.0 * room_m(length_m)
    wide = min(MOST_CELL_M, side_m / math.sqrt(PLACES))
    return max(LEAST_CELL_M, min(wide, problem.goal_radius_m / 1.5))


def describe(leg: SolvedLeg, shifts: tuple[float, float], *, explain: bool) -> str:
    """Return a leg's policy as text for a person."""
    problem, policy = leg.problem, leg.policy
    name = problem.id or "problem"
    lines = [f"{name}: {problem.title}" if problem.title else name]
    speed = "" if problem.wind.tws_mps is None else f"{problem.wind.tws_mps:.1f} m/s "
    lines.append(
        f"policy in a wind of {speed}from {direction(problem.wind.twd_from_rad)}° "
        f"that shifts by {shifts[0]:g}° (standard deviation) for {shifts[1]:g} s"
    )
    if math.isinf(leg.time_s):
        none = "no way: neither tack leads to the goal"
        return "\n".join([*lines, none if policy.is_settled else "not settled, and no way yet: give a larger --budget"])
    drawn = policy.sailed(problem.start_en, leg.tack, count=DRAWN)
    there = drawn.time_s[np.isfinite(drawn.time_s)]
    low, high = np.quantile(there, (0.1, 0.9)) if len(there) else (math.nan, math.nan)
    on = [policy.time_to_go_s(problem.start_en, 0.0, tack) for tack in (PORT, STARBOARD)]
    lines += [
        (
            f"time to go {leg.time_s:.0f} s{_onward(policy)}: begun on port tack {_seconds(on[PORT])}, on starboard "
            f"{_seconds(on[STARBOARD])}; {_seconds(leg.steady_s)} if it never shifted"
        ),
        (
            f"{DRAWN} drawn winds sailed by it: {there.mean():.0f} s{_of_leg(policy)}, eight in ten within {low:.0f} "
            f"to {high:.0f} s, {drawn.tacks.mean():.1f} tacks, {int(drawn.has_touched.sum())} touched"
            + ("" if len(there) == DRAWN else f", {DRAWN - len(there)} not there in four times that time")
        ),
        (
            f"{int(policy.chart.is_water.sum())} places of {policy.chart.cell_m:.1f} m by "
            f"{len(policy.shifts.shift_rad)} shifts in {policy.took_s:.1f} s; a grid twice as wide tells "
            f"{_seconds(leg.coarser_s)}"
        ),
    ]
    if not policy.is_settled:
        lines.append(f"not settled: a round still changes a time by {policy.change_s:.1f} s: give a larger --budget")
    if explain:
        lines += ["", *_table(leg)]
    return "\n".join(lines)


def _table(leg: SolvedLeg) -> list[str]:
    """Return what is done at the start in each shift, on either tack, and what it is worth."""
    spread_rad = leg.policy.shifts.spread_rad
    shifts = [0.0] if spread_rad <= 0.0 else [n * spread_rad for n in (-2.0, -1.0, 0.0, 1.0, 2.0)]
    rows = [("at the start, the wind", "on port tack", "on starboard tack")]
    for shift in shifts:
        told = "at its mean"
        if abs(shift) > 0.0:
            told = f"{'veered' if shift > 0.0 else 'backed'} {abs(math.degrees(shift)):.0f}°"
        port, starboard = (_action(leg.policy.decide(leg.problem.start_en, shift, q)) for q in (PORT, STARBOARD))
        rows.append((told, port, starboard))
    widths = [max(len(row[k]) for row in rows) for k in range(3)]
    return [
        "  " + "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows
    ]


def _action(found: Decision) -> str:
    what = "tack" if found.is_tack else f"stand on, {direction(found.course_rad)}°"
    if math.isinf(found.gain_s):
        return f"{what}: nothing else leads there"
    return f"{what}: worth {found.gain_s:.1f} s, {found.time_s:.0f} s to go"


def _onward(policy: Policy) -> str:
    return " to the last goal" if policy.beyond.any() else ""


def _of_leg(policy: Policy) -> str:
    return " to this goal" if policy.beyond.any() else ""


def _seconds(time_s: float) -> str:
    return f"{time_s:.0f} s" if math.isfinite(time_s) else "no way"
