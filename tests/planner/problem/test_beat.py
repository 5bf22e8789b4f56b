"""Beats left to the autopilot: allowed only in clear water, never below the bound, and not slower than sailing them."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bench.winds import simulate_entries
from companion.errors import InputError
from companion.planner import Plan, PlanStatus, Problem, plan
from companion.planner.problem.evaluate import beat_s, beaten, evaluate
from companion.planner.risk.chance_constraint import path_risk
from tests.planner.problem_json import to_dict

BEAT = {"no_go_half_deg": 45.0, "corridor_m": 10.0, "clearance_m": 8.0, "tack_s": 1.8}
BLOCK = "POLYGON ((-60 150, 60 150, 60 210, -60 210, -60 150))"


def problem(**changes: Any) -> Problem:
    """Return a beat of 400 m to the north in an uncertain northerly."""
    raw: dict[str, Any] = {
        "start": {"x": 0.0, "y": 0.0, "heading_deg": 60.0},
        "goal": {"x": 0.0, "y": 400.0, "radius": 8.0},
        "obstacles": [],
        "fence": None,
        "wind": {
            "from_deg": 0.0,
            "speed_mps": 5.0,
            "sigma": {"model": "ar1", "sigma0_deg": 3.0, "sigma_inf_deg": 9.0, "rho_hz": 0.03},
        },
        "boat": {
            "no_go_half_deg": 47.0,
            "max_twa_deg": 180.0,
            "turn_rate_rad_s": 1.0,
            "tack_loss_s": 0.3,
            "speed": {
                "model": "polar",
                "twa_deg": [0, 30, 45, 60, 90, 135, 180],
                "v_mps": [0, 0.5, 2.03, 2.4, 2.9, 2.8, 2.6],
            },
        },
        "delta_s": 0.9,
        "beat": BEAT,
    }
    return Problem.from_json(raw | changes)


def solve(p: Problem, expansions: int = 6000) -> Plan:
    """Plan by effort, so that the result is the same everywhere."""
    return plan(p, expansions=expansions)


def test_open_water_is_beaten_faster_than_it_can_be_planned() -> None:
    beating, sailing = solve(problem()), solve(problem(beat=None))
    assert any(leg.is_beat for leg in beating.legs)
    assert not any(leg.is_beat for leg in sailing.legs)
    assert beating.cost_s < 0.9 * sailing.cost_s


def test_a_beaten_leg_is_never_forced_into_the_zone() -> None:
    p = problem()
    answer = solve(p)
    assert all(leg.is_beat for leg in answer.legs)
    assert path_risk(p, answer).total == 0.0
    assert np.all(simulate_entries(p, answer, winds=200) == -1)


def test_a_leg_upwind_needs_its_corridor_clear() -> None:
    line = [[0.0, 0.0], [0.0, 400.0]]
    assert evaluate(problem(), line).is_feasible
    assert not evaluate(problem(beat=None), line).is_feasible
    near = "POLYGON ((7.5 100, 60 100, 60 150, 7.5 150, 7.5 100))"  # 7.5 m off the line, 8 m are asked for
    clear = "POLYGON ((8.5 100, 60 100, 60 150, 8.5 150, 8.5 100))"
    assert any("no-go zone" in text for text in evaluate(problem(obstacles=[near]), line).reasons)
    assert evaluate(problem(obstacles=[clear]), line).is_feasible


def test_a_vessel_is_kept_clear_of_by_the_corridor_too() -> None:
    line = [[0.0, 0.0], [0.0, 400.0]]
    vessel = {"x": 25.0, "y": 200.0, "radius_m": 20.0}  # 5 m off the line; 10 m are sailed to each side
    assert not evaluate(problem(targets=[vessel]), line).is_feasible
    assert evaluate(problem(targets=[vessel | {"x": 31.0}]), line).is_feasible


def test_round_a_block_its_plan_stays_clear() -> None:
    p = problem(obstacles=[BLOCK])
    answer = solve(p)
    assert answer.status.has_path
    assert all(
        leg.clearance_m is None or leg.clearance_m >= 0.98 * BEAT["clearance_m"] - 1e-3
        for leg in answer.legs
        if leg.is_beat
    )


def test_where_there_is_no_room_the_path_is_sailed() -> None:
    walls = ["POLYGON ((-60 60, -15 60, -15 340, -60 340, -60 60))", "POLYGON ((15 60, 60 60, 60 340, 15 340, 15 60))"]
    fence = "POLYGON ((-60 -60, 60 -60, 60 460, -60 460, -60 -60))"
    p = problem(obstacles=walls, fence=fence, beat=BEAT | {"clearance_m": 20.0})
    answer = solve(p, expansions=20_000)
    assert answer.status.has_path
    assert not any(leg.is_beat for leg in answer.legs if 60.0 < leg.to_en[1] < 340.0)


def test_a_wind_that_closes_every_course_still_leaves_the_beat() -> None:
    wild = {
        "from_deg": 0.0,
        "speed_mps": 5.0,
        "sigma": {"model": "ar1", "sigma0_deg": 60.0, "sigma_inf_deg": 60.0, "rho_hz": 0.03},
    }
    assert not solve(problem(wind=wild, beat=None)).status.has_path
    assert solve(problem(wind=wild)).status.has_path


def test_the_time_of_a_beat_is_the_mixture_of_its_tacks() -> None:
    p = problem()
    assert p.beat is not None
    time_s, tacks = beat_s(p, replace(p.beat, tack_s=0.0), 0.0, 400.0)
    assert time_s == pytest.approx(400.0 / (2.03 * math.cos(math.radians(45.0))))
    assert tacks == pytest.approx(20.0)  # 200 m off the line on each tack, 20 m from edge to edge
    on_edge_s, none = beat_s(p, p.beat, 100.0, 100.0)
    assert on_edge_s == pytest.approx(math.hypot(100.0, 100.0) / 2.03)
    assert none == pytest.approx(0.0, abs=1e-9)


@settings(max_examples=25)
@given(
    x=st.floats(-300.0, 300.0),
    y=st.floats(-300.0, 300.0),
    heading=st.floats(0.0, 360.0),
    corridor=st.floats(2.0, 40.0),
    tack=st.floats(0.0, 8.0),
    block=st.booleans(),
)
def test_no_plan_is_below_its_bound(
    x: float, y: float, heading: float, corridor: float, tack: float, block: bool
) -> None:
    p = problem(
        start={"x": x, "y": y - 350.0, "heading_deg": heading},
        obstacles=[BLOCK] if block else [],
        beat=BEAT | {"corridor_m": corridor, "tack_s": tack},
    )
    answer = solve(p, expansions=1500)
    assert answer.status.has_path
    assert answer.lower_bound_s <= answer.cost_s + 1e-9
    judged = evaluate(p, answer.waypoints_en)
    assert judged.is_feasible
    assert judged.time_s == pytest.approx(answer.cost_s)
    # The straight line, where it may be sailed, is a path like any other.
    line = evaluate(p, [p.start_en, p.goal_en])
    assert not line.is_feasible or line.time_s >= answer.lower_bound_s - 1e-9


def test_the_problem_of_a_beating_boat_goes_straight_everywhere() -> None:
    p = problem()
    assert p.beat is not None
    own = beaten(p, p.beat)
    assert own.no_go_max_rad == 0.0
    assert own.clearance_floor_m == BEAT["clearance_m"]
    for degrees in (0.0, 20.0, 44.0, 60.0, 120.0):
        course = math.radians(degrees)
        time_s, _ = beat_s(p, p.beat, math.sin(course), math.cos(course))
        assert own.boat.speed_mps(course) == pytest.approx(1.0 / time_s, rel=1e-3)


def test_json_keeps_the_beat_and_refuses_nonsense() -> None:
    p = problem()
    assert Problem.from_json(to_dict(p)).beat == p.beat
    with pytest.raises(InputError, match="beat"):
        problem(beat=BEAT | {"corridor_m": "ten"})
    for bad in ({"corridor_m": 0.0}, {"no_go_half_deg": 90.0}, {"clearance_m": -1.0}, {"tack_s": float("nan")}):
        answer = solve(problem(beat=BEAT | bad))
        assert answer.status is PlanStatus.INVALID
        assert "beat" in answer.reason
    current = solve(problem(current={"set_deg": 90.0, "drift_mps": 0.2}))
    assert current.status is PlanStatus.INVALID


def test_what_wind_and_corridor_close_between_them_is_not_proved_impossible() -> None:
    wild = {
        "from_deg": 0.0,
        "speed_mps": 5.0,
        "sigma": {"model": "ar1", "sigma0_deg": 60.0, "sigma_inf_deg": 60.0, "rho_hz": 0.03},
    }
    fence = "POLYGON ((-30 -30, 30 -30, 30 430, -30 430, -30 -30))"
    narrow = BEAT | {"clearance_m": 32.0}
    assert solve(problem(wind=wild, fence=fence, beat=None)).status is PlanStatus.INFEASIBLE
    assert solve(problem(wind=wild, fence=fence, beat=narrow)).status is PlanStatus.NOT_FOUND
    floor = problem(fence=fence, beat=None, clearance_floor_m=32.0)
    assert "clearance floor" in solve(floor).reason  # and not: no fence at all
    wall = "POLYGON ((-31 200, 31 200, 31 220, -31 220, -31 200))"
    assert solve(problem(wind=wild, fence=fence, obstacles=[wall], beat=narrow)).status is PlanStatus.INFEASIBLE
