"""The expected time to go by place, tack and shift, and the action that makes it: value iteration on a chart."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import shapely
from numpy.typing import NDArray

from companion.clock import effort_s
from companion.geo.distinct import distinct
from companion.geo.segments import PolygonIndex
from companion.planner.policy.kernels import FAR_S, TOUCH_S, sweep
from companion.planner.policy.policy import SETTLED_S, Chart, Handling, Policy
from companion.planner.policy.shifts import Shifts
from companion.planner.problem.value import Problem

Floats = NDArray[np.float64]

ROOM_SHARE, ROOM_M = 0.5, 60.0
"""The chart reaches this share of the way's length beyond start and goal, and this far at the least [m]."""
STEP_CELLS = 1.5
"""What a step of the fastest action goes, in cells."""
TURNS_RAD = tuple(math.radians(d) for d in (0.0, 3.0, 6.0, 10.0, 15.0, 22.0, 30.0, 40.0))
"""Off the no-go zone: the angles that are tried near the wind ..."""
EVERY_RAD = math.radians(10.0)
"""... and deeper, so far apart: the beam is one of them."""
MOST_ROUNDS = 400
SORTED_EVERY = 4


def angles_of(problem: Problem) -> Floats:
    """Return the wind angles that are tried [rad], from the edge of the no-go zone to the deepest."""
    boat = problem.boat
    near = [boat.no_go_half_rad + turn for turn in TURNS_RAD]
    deep = np.arange(math.ceil(near[-1] / EVERY_RAD) * EVERY_RAD, boat.max_twa_rad, EVERY_RAD)
    return distinct(np.minimum([*near, *deep, boat.max_twa_rad], boat.max_twa_rad))


def solve(
    problem: Problem,
    shifts: Shifts,
    *,
    cell_m: float,
    angle_rad: Floats | None = None,
    onward: Policy | None = None,
    budget_s: float = math.inf,
) -> Policy:
    """Return the policy of a problem in a wind that shifts about its mean.

    The zone is not widened for the wind's spread: the chain of shifts has it, and what is done when one comes. Of the
    problem's wind its direction is the mean; vessels, tracking and a beat that is the autopilot's are left aside.

    Args:
        problem: sailed to its goal's disc, clear of its obstacles, within its fence.
        shifts: how the wind wanders.
        cell_m: between the chart's places.
        angle_rad: (a,) the wind angles that are tried; None: from the no-go zone's edge to the deepest.
        onward: the policy of the leg that follows, of the same shifts; None: this goal is the last.
        budget_s: processor time; the policy says how far from settled it is then.

    """
    began_s = effort_s()
    solid = PolygonIndex([*problem.obstacles, *_beyond(problem.fence)])
    chart = chart_of(problem, solid, cell_m)
    handling = handling_of(problem, angles_of(problem) if angle_rad is None else angle_rad)
    step_s = STEP_CELLS * cell_m / float(handling.sailing[:, 1].max())
    moves_en = _moves(problem.wind.twd_from_rad, shifts.shift_rad, handling) * step_s
    drifts_en = _drifts(problem.wind.twd_from_rad, shifts.shift_rad, handling)
    near, shut = _shut(chart, solid, moves_en, drifts_en)
    chain, tack_chain = shifts.after(step_s), shifts.after(handling.tack_s)
    values = np.full((*chart.is_water.shape, 2, len(shifts.shift_rad)), FAR_S)
    hopes, best = values.copy(), np.zeros(values.shape, dtype=np.int16)
    beyond = np.zeros(values.shape[2:])
    if onward is not None:
        beyond[:] = [[onward.time_to_go_s(problem.goal_en, float(s), q) for s in shifts.shift_rad] for q in range(2)]
    places = np.flatnonzero(chart.is_water.ravel()).astype(np.int64)
    off = chart.en_m(places) - np.array(problem.goal_en)
    order = places[np.argsort(np.hypot(off[:, 0], off[:, 1]), kind="stable")]
    change_s, rounds = math.inf, 0
    while rounds < MOST_ROUNDS and change_s > SETTLED_S and effort_s() - began_s < budget_s:
        change_s = sweep(
            values,
            hopes,
            best,
            order,
            np.ascontiguousarray(moves_en[..., ::-1]) / cell_m,
            near,
            shut,
            np.array([*chart.cells(problem.goal_en), problem.goal_radius_m / cell_m]),
            beyond,
            step_s,
            chain,
            tack_chain,
            np.array([handling.tack_s, handling.fails, handling.irons_s, TOUCH_S]),
            np.ascontiguousarray(drifts_en[..., ::-1]) / cell_m,
        )
        rounds += 1
        if rounds % SORTED_EVERY == 0:
            least = values.min(axis=(2, 3)).ravel()
            order = places[np.argsort(least[places], kind="stable")]
    return Policy(
        chart=chart,
        shifts=shifts,
        twd_from_rad=problem.wind.twd_from_rad,
        goal_en_m=problem.goal_en,
        goal_radius_m=problem.goal_radius_m,
        solid=solid,
        handling=handling,
        step_s=step_s,
        beyond=beyond,
        values=values,
        hopes=hopes,
        best=best,
        rounds=rounds,
        change_s=change_s,
        took_s=effort_s() - began_s,
    )


def handling_of(problem: Problem, angle_rad: Floats) -> Handling:
    """Return what a problem's boat does at these angles to the wind, in its current: that which is believed, too."""
    boat, current = problem.boat, problem.current if problem.current.drift_mps > 0.0 else problem.adrift
    return Handling(
        sailing=np.column_stack([angle_rad, np.interp(angle_rad, boat.polar_twa_rad, boat.polar_mps)]),
        tack_s=2.0 * boat.no_go_half_rad / boat.turn_rate_radps + boat.tack_loss_s,
        fails=boat.tack_fails if boat.can_tack else 0.0,
        irons_s=boat.irons_s,
        lee_mps=(boat.lee_mps[-1], boat.lee_mps[0]),  # a problem has starboard first
        current_en_mps=(current.drift_mps * math.sin(current.set_rad), current.drift_mps * math.cos(current.set_rad)),
    )


def room_m(length_m: float) -> float:
    """Return how far the chart of a way of this length reaches beyond start and goal [m]."""
    return ROOM_M + ROOM_SHARE * length_m


def chart_of(problem: Problem, solid: PolygonIndex, cell_m: float) -> Chart:
    """Return the chart about start and goal; the goal's middle is one of its places."""
    ends = np.array([problem.start_en, problem.goal_en])
    room = room_m(math.dist(problem.start_en, problem.goal_en))
    low, high = ends.min(axis=0) - room, ends.max(axis=0) + room
    if problem.fence is not None:
        bounds = np.array(problem.fence.bounds)
        low, high = np.maximum(low, bounds[:2]), np.minimum(high, bounds[2:])
    before = np.ceil((ends[1] - low) / cell_m)
    low = ends[1] - before * cell_m
    columns, rows = (int(n) for n in np.floor((high - low) / cell_m) + 1)
    chart = Chart(
        corner_en_m=(float(low[0]), float(low[1])), cell_m=cell_m, is_water=np.ones((rows, columns), dtype=np.bool_)
    )
    inside = solid.contains(chart.en_m(np.arange(rows * columns)))
    return Chart(corner_en_m=chart.corner_en_m, cell_m=cell_m, is_water=~inside.reshape(rows, columns))


def _beyond(fence: shapely.Geometry | None) -> Sequence[shapely.Geometry]:
    """Return what lies about a fence as something solid."""
    if fence is None:
        return ()
    low_e, low_n, high_e, high_n = fence.bounds
    wide = 10.0 + 0.5 * max(high_e - low_e, high_n - low_n)
    return (shapely.box(low_e - wide, low_n - wide, high_e + wide, high_n + wide).difference(fence),)


def _moves(twd_from_rad: float, shift_rad: Floats, handling: Handling) -> Floats:
    """Return (2, m, a, 2) velocities east and north over the ground on port tack and starboard."""
    angle, speed = handling.sailing.T
    side = np.array([1.0, -1.0])[:, None, None]  # with the wind over the port side she heads to the right of it
    course = twd_from_rad + shift_rad[None, :, None] + side * angle[None, None, :]
    through = speed[None, None, :, None] * np.stack([np.sin(course), np.cos(course)], axis=-1)
    return np.asarray(through + np.array(handling.current_en_mps))


def _drifts(twd_from_rad: float, shift_rad: Floats, handling: Handling) -> Floats:
    """Return (2, m, 2) how far she is set in irons, east and north [m], begun on either tack."""
    leeward = twd_from_rad + shift_rad + math.pi
    away = np.stack([np.sin(leeward), np.cos(leeward)], axis=-1)
    by_tack = np.array(handling.lee_mps)[:, None, None] * away[None]
    return np.asarray(handling.irons_s * (by_tack + np.array(handling.current_en_mps)))


def _shut(
    chart: Chart, solid: PolygonIndex, moves_en: Floats, drifts_en: Floats
) -> tuple[NDArray[np.int32], NDArray[np.bool_]]:
    """Return which places have something in the way of a move, and which of their moves meet it."""
    all_en = np.concatenate([moves_en, drifts_en[:, :, None, :]], axis=2)
    farthest_m = float(np.hypot(all_en[..., 0], all_en[..., 1]).max())
    near = np.full(chart.is_water.shape, -1, dtype=np.int32)
    places = np.flatnonzero(chart.is_water.ravel())
    if solid.edge_count:
        places = places[solid.distance_m(chart.en_m(places)) <= farthest_m]
    else:
        places = places[:0]
    near.ravel()[places] = np.arange(len(places))
    here = chart.en_m(places)
    shut = np.zeros((max(1, len(places)), *all_en.shape[:3]), dtype=np.bool_)
    for q in range(all_en.shape[0]):
        for s in range(all_en.shape[1]):
            for a in range(all_en.shape[2]):
                if len(places):
                    shut[: len(places), q, s, a] = solid.intersects(np.hstack([here, here + all_en[q, s, a]]))
    return near, shut
