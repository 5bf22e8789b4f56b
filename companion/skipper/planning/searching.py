"""Searching an area: its sweeps laid and laid anew, what the track has covered, when it is done."""

from __future__ import annotations

import math
from typing import Any

import shapely

from companion.frozen import changed
from companion.skipper.step.actions import CancelPlan, Severity
from companion.skipper.step.turn import Turn
from companion.skipper.way.gates import Approach, Gate
from companion.skipper.way.sweeps import coverage, grown, is_off, left_over, sweeps_over
from companion.skipper.way.voyage import Search

AT_MOST = 4          # rounds: the sweeps, and what they left; the wind's own anew are not counted
HAIR_M = 0.5


def follow_search(turn: Turn) -> None:
    """Note where she is while she searches, and lay the rest anew between two sweeps where the wind has turned."""
    gate, boat = turn.gate, turn.boat_en
    if gate is None or gate.search is None:
        if turn.state.progress.task:
            turn.set(progress=changed(turn.state.progress, searched=(), task=""))
        return
    if boat is None:
        return
    search = gate.search
    if float(shapely.distance(search.area_en, shapely.points(boat))) <= search.swath_m:
        turn.set(progress=changed(
            turn.state.progress, searched=grown(turn.state.progress.searched, boat, search.swath_m)))
    share = coverage(search.area_en, turn.state.progress.searched, search.swath_m)
    number, count = gate.sweep
    turn.set(progress=changed(
        turn.state.progress,
        task=f"sweep {number} of {count}, {100.0 * share:.0f} % covered" if count else "sweeps not laid yet"))
    if count and turn.wind_mean is not None and _begins(turn, gate) and is_off(turn.wind_mean[0], _laid(turn, gate)[1]):
        lay_sweeps(turn, gate, is_shift=True)


def _begins(turn: Turn, gate: Gate) -> bool:
    """Return whether the gate is where a sweep begins: she is not on one."""
    before = turn.gates[turn.state.progress.gate - 1] if turn.state.progress.gate > 0 else None
    return before is None or before.goal != gate.goal or before.sweep != gate.sweep


def _laid(turn: Turn, gate: Gate) -> tuple[int, float]:
    """Return how often the sweeps of a gate's goal were laid, and for which wind."""
    approach = next((a for a in turn.state.progress.approaches if a.goal == gate.goal), None)
    return (0, 0.0) if approach is None else (approach.round, approach.twd_from_rad)


def lay_sweeps(turn: Turn, gate: Gate, *, is_shift: bool = False) -> bool:
    """Lay what is left to be searched in sweeps for the present wind; False when nothing is, or it was tried enough."""
    search, boat, wind = gate.search, turn.boat_en, turn.wind_mean
    if search is None or boat is None or wind is None:
        return False
    rounds, _ = _laid(turn, gate)
    share = coverage(search.area_en, turn.state.progress.searched, search.swath_m)
    if not is_shift and rounds > 0 and (share >= search.coverage or rounds >= AT_MOST):
        return False
    # What lies between the margin and the shore is seen from the sweep beside it, or not at all.
    sweeps = sweeps_over(_water(turn, search), search.swath_m, wind[0], boat)
    if not sweeps:
        return False
    if turn.state.pending.plan is not None:
        turn.act(CancelPlan(request_id=turn.state.pending.plan.request_id))
    count = max(1, rounds if is_shift else rounds + 1)
    turn.approach(Approach(goal=gate.goal, en_m=boat, sweeps=sweeps, twd_from_rad=wind[0], round=count))
    why = "the wind has turned: " if is_shift else f"{100.0 * share:.0f} % covered: " if rounds else ""
    turn.set(
        pending=changed(turn.state.pending, plan=None),
        plans=changed(turn.state.plans, asked=f"{why}{len(sweeps)} sweeps of {gate.name}"))
    turn.say(Severity.NOTICE, "sweeps", f"{gate.name}: {why}{len(sweeps)} sweeps across a wind from "
             f"{math.degrees(wind[0]) % 360.0:.0f} deg", every_s=0.0)
    return True


def _water(turn: Turn, search: Search) -> Any:
    """Return what of a search is left and may be sailed over: at the plan's margin, with room to turn behind."""
    area, margin_m, boat, wind = turn.voyage.area, turn.config.margin_m, turn.voyage.boat, turn.wind_mean
    room_m = HAIR_M + (0.0 if wind is None else boat.polar.max_speed_mps(wind[1]) / boat.turn_rate_radps)
    water = left_over(search.area_en, turn.state.progress.searched, search.swath_m)
    solid = [shapely.from_wkt(w) for w in area.obstacles_wkt(margin_m)]
    if solid:
        water = shapely.difference(water, shapely.buffer(shapely.union_all(solid), room_m))
    fence = area.fence_wkt(margin_m)
    return water if fence is None else shapely.intersection(water, shapely.buffer(shapely.from_wkt(fence), -room_m))


def end_search(turn: Turn, gate: Gate) -> None:
    """The search is over: say what was covered."""
    search = gate.search
    assert search is not None
    share = coverage(search.area_en, turn.state.progress.searched, search.swath_m)
    following = next((n for n, g in enumerate(turn.gates) if g.goal > gate.goal), len(turn.gates))
    turn.set(progress=changed(
        turn.state.progress, gate=following, reached=(*turn.state.progress.reached, gate.goal), closest_m=math.inf,
        searched=(), task="", covered=(*turn.state.progress.covered, (gate.goal, round(share, 4)))))
    less = "" if share >= search.coverage else f", less than the {100.0 * search.coverage:.0f} % that were asked for"
    severity = Severity.WARNING if less else Severity.NOTICE
    turn.say(severity, "goal", f"{gate.name} searched: {100.0 * share:.0f} % covered{less}", every_s=0.0)
