"""Admission: whether a plan may go to the autopilot, held against what is on board there.

Every upload of a plan passes here (``companion.skipper.planning.uploads``). The way on board and the new one, both from
where the boat is now, are judged by one problem: the same wind, current, obstacles and predicted track. Two rules:

1. **Not below the floor.** The hull keeps the margin's floor all along the predicted track. From a place that is below
   it already, the way comes no nearer to anything solid than the boat is, or than the way on board would bring it.
2. **Not less than what is on board**: not a smaller margin or delta_s, not tacks whose failure is likelier to end in a
   contact, not a risk above the mission's limit and above that of the way on board. Unless what is on board is closed:
   it leads elsewhere, meets a vessel, does not keep the floor within the prediction's own error, or the wind of now or
   the forecast's has shut it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from companion.planner import Problem
from companion.planner.problem import evaluate, resolved
from companion.planner.risk import of_risky, path_risk, tacks_at_risk
from companion.planner.track import ExpectedTrack
from companion.skipper.planning.autopilot_beats import room_m, tacks_fail
from companion.skipper.planning.track import of_way
from companion.skipper.planning.vessels import meetings
from companion.skipper.step.route import Route
from companion.skipper.step.state import PendingPlan
from companion.skipper.step.turn import Turn
from companion.skipper.way.geometry import distance_m
from companion.skipper.way.judge import judge
from companion.skipper.way.voyage import PointEn

SPARE_M = 0.3          # a boat below the floor may come no nearer than this more: the turn away takes room
TACKS_RISK = 1e-3      # a chance of contact by failed tacks is greater than another by more than this
MARGIN_M = 0.1         # margins that differ by less are the same


def refusal(turn: Turn, route: Route, set_current: int | None, pending: PendingPlan) -> str:
    """Return why a plan's route may not replace the one on board, in words; empty: it may.

    ``set_current`` is the item number (1: the first) that is made current with it, None: the present one stays.
    """
    boat, vehicle = turn.boat_en, turn.snapshot.vehicle
    if boat is None or vehicle is None or not turn.state.voyage.sailing:
        return ""
    problem: Problem = pending.problem
    here_m = float(turn.voyage.area.clearance_m([boat])[0]) - turn.voyage.boat.hull.reach_m
    # Below the floor, and where it has to be gybed round, a way of short legs is better than none.
    has_loops = not tacks_fail(turn) and (problem.tracking is None or here_m >= problem.tracking.floor_m)
    first = turn.state.mission.index if set_current is None else set_current - 1
    heading_rad, begins = vehicle.heading_rad, boat
    if set_current is not None and pending.from_index is None and not pending.lead_in:
        # where she is by the time that it is on board
        begins, heading_rad = pending.start_en_m, problem.start_heading_rad
    new = [begins, *route.points_en_m[first:-1]]
    old, ahead, leg = [boat, *turn.ahead()], turn.ahead(), turn.leg()
    sailed_m = 0.0 if leg is None else distance_m(leg[0], boat)
    before = ExpectedTrack() if not ahead else of_way(
        problem, old, heading_rad=vehicle.heading_rad, before_en=None, sailed_m=sailed_m, has_loops=has_loops)
    seen = of_way(problem, new, heading_rad=heading_rad, before_en=None, has_loops=has_loops,
                  sailed_m=sailed_m if set_current is None else 0.0)
    low = _below_floor(problem, seen, before if ahead else None, here_m=here_m)
    if low or not ahead or not is_open(turn, pending, before):
        return low
    return _less(turn, pending, new, old, heading_rad=heading_rad)


def _below_floor(problem: Problem, new: ExpectedTrack, old: ExpectedTrack | None, *, here_m: float) -> str:
    """Return how a new way breaks the first rule, empty: it does not."""
    floor_m = 0.0 if problem.tracking is None else problem.tracking.floor_m
    if new.lack_m <= 0.0:
        return ""
    says = f"it would pass {new.clearance_m:.1f} m clear, the floor is {floor_m:g} m"
    if here_m >= floor_m:
        return says
    least_m = here_m if old is None else min(here_m, old.clearance_m)
    return "" if new.clearance_m >= least_m - SPARE_M else f"{says}, and the boat is {here_m:.1f} m clear"


def is_open(turn: Turn, pending: PendingPlan, seen: ExpectedTrack) -> bool:
    """Return whether the way on board leads where the new one does, keeps the floor and can be sailed."""
    return leads_there(turn, pending) and seen.is_within_error and not meetings(turn) and is_on_board_sound(turn)


def leads_there(turn: Turn, pending: PendingPlan) -> bool:
    """Return whether the mission on board is ours and leads where a plan was asked for."""
    route = turn.state.mission.route
    if route is None or turn.state.mission.foreign or route.bound_for != pending.facts.bound_for:
        return False
    if pending.gate < 0:
        return bool(pending.facts.bound_for)
    return pending.gate in route.gate_of[turn.state.mission.index:-1]


def is_on_board_sound(turn: Turn) -> bool:
    """Return whether what is left of the mission on board is sound from where the boat is."""
    boat, ahead = turn.boat_en, turn.ahead()
    return boat is not None and bool(ahead) and is_sound(turn, [boat, *ahead])


def is_sound(turn: Turn, way: Sequence[PointEn]) -> bool:
    """Return whether a way is good for the mean wind and for the present one, and keeps the margin's floor.

    After a shift the mean is of a wind that blows no more; only the leg that is sailed now is held against the present.
    """
    mean, now = turn.wind_mean, turn.wind_now
    if mean is None or now is None:
        return False
    floor_m = min(turn.config.margin_floor_m, turn.config.margin_m)
    return all(
        judge(part, boat=turn.voyage.boat, no_go_half_rad=turn.no_go_half_rad, twd_from_rad=wind[0], tws_mps=wind[1],
              area=turn.voyage.area, beat_room_m=room_m(turn), current_en_mps=turn.current_en_mps).is_sound(floor_m)
        for part, wind in ((way, mean), (way[:2], now)))


def _less(turn: Turn, pending: PendingPlan, new: list[PointEn], old: list[PointEn], *, heading_rad: float) -> str:
    """Return what a new way promises less of than the open one on board, in words; empty: nothing."""
    route, facts = turn.state.mission.route, pending.facts
    assert route is not None
    if facts.margin_m < route.margin_m - MARGIN_M:
        return f"its margin is {facts.margin_m:.1f} m, that of the way on board, which is open, {route.margin_m:.1f} m"
    if facts.delta_s < route.delta_s - 1e-9:
        return f"its delta_s is {facts.delta_s:g}, that of the way on board, which is open, {route.delta_s:g}"
    here = replace(resolved(pending.problem), start_en=new[0], start_heading_rad=heading_rad)
    legs = [evaluate(replace(here, start_en=way[0]), np.asarray(way)).legs for way in (new, old)]
    tacks = [min(1.0, of_risky(tacks_at_risk(here, each))) for each in legs]   # a union bound may be above 1
    if tacks[0] > tacks[1] + TACKS_RISK:
        return (f"tacks of it that fail are likelier to end in a contact: {100.0 * tacks[0]:.2g} %, "
                f"of the way on board {100.0 * tacks[1]:.2g} %")
    limit = turn.config.max_path_risk
    if limit is not None and here.risk is not None:
        risks = [path_risk(here, each).total for each in legs]
        if risks[0] > max(limit, risks[1]):
            return f"its risk is {100.0 * risks[0]:.2g} %, that of the way on board {100.0 * risks[1]:.2g} %"
    return ""
