"""The active plan against the discs, the decision, and how alike two paths look."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.messages import Target
from companion.traffic import Decision, check_legs, decide, path_distance_m
from companion.traffic.plans import ALIKE_M, SLACK_M, PlainLeg


def disc(
    x: float,
    y: float,
    vx: float = 0.0,
    vy: float = 0.0,
    radius: float = 20.0,
    growth: float = 0.0,
    begin: float = 0.0,
    end: float = 900.0,
) -> Target:
    return Target(
        x_m=x,
        y_m=y,
        vx_mps=vx,
        vy_mps=vy,
        radius_m=radius,
        growth_mps=growth,
        from_s=begin,
        until_s=end,
        name="it",
        mmsi=1,
    )


LEG = PlainLeg(from_en=(0.0, 0.0), to_en=(0.0, 200.0), start_s=0.0, end_s=100.0)


def test_a_meeting_is_found_with_its_time() -> None:
    c = check_legs([LEG], [disc(0.0, 100.0)])
    assert c[0].time_s == pytest.approx(40.0, abs=0.01)
    assert c[0].depth_m == pytest.approx(20.0, abs=0.01)
    assert check_legs([LEG], [disc(0.0, 100.0, vx=2.0)]) == ()  # it has gone when we come
    assert check_legs([LEG], [disc(-200.0, 100.0, vx=4.0)])  # it comes when we do


def test_the_greatest_depth_of_a_meeting_is_that_of_any_leg() -> None:
    """1 m was told of a plan whose second leg leads through the middle."""
    first = PlainLeg(from_en=(-100.0, 49.0), to_en=(0.0, 49.0), start_s=0.0, end_s=100.0)
    second = PlainLeg(from_en=(0.0, 49.0), to_en=(0.0, -100.0), start_s=100.0, end_s=250.0)
    for legs in ((first, second), (second, first)):
        (c,) = check_legs(legs, [disc(0.0, 0.0, radius=50.0)])
        assert (legs[c.leg], c.depth_m) == (first, pytest.approx(50.0, abs=0.01))
        assert c.time_s < 100.0


def test_what_is_sailed_already_does_not_count() -> None:
    assert check_legs([LEG], [disc(0.0, 20.0)])
    sailed = replace(LEG, start_s=LEG.start_s - 60.0, end_s=LEG.end_s - 60.0)
    assert check_legs([sailed], [disc(0.0, 20.0, begin=0.0)]) == ()


number = st.floats(-300.0, 300.0)


@settings(max_examples=200)
@given(
    number,
    number,
    st.floats(-5, 5),
    st.floats(-5, 5),
    st.floats(1.0, 60.0),
    st.floats(0.0, 1.0),
    number,
    number,
    st.floats(5.0, 200.0),
    st.floats(0.0, 80.0),
    st.floats(0.0, 100.0),
)
def test_check_agrees_with_sampling(
    x: float,
    y: float,
    vx: float,
    vy: float,
    radius: float,
    growth: float,
    tx: float,
    ty: float,
    end: float,
    begin: float,
    window: float,
) -> None:
    leg = PlainLeg(from_en=(0.0, 0.0), to_en=(tx, ty), start_s=0.0, end_s=end)
    d = disc(x, y, vx, vy, radius, growth, begin, begin + window)
    found = check_legs([leg], [d])
    lo, hi = max(0.0, begin), min(end, begin + window)
    if hi < lo:
        assert found == ()
        return
    t = np.linspace(lo, hi, 2001)
    depth = radius + growth * t - np.hypot(tx * t / end - x - vx * t, ty * t / end - y - vy * t)
    if depth.max() > 0.01:
        assert found
        # a conflict begins deeper than the slack; its quadratic may be ill-conditioned
        assert found[0].time_s <= float(t[np.argmax(depth > SLACK_M)]) + 1e-3
        assert found[0].depth_m >= float(depth.max()) - 0.01
    if depth.max() < -0.5:
        assert found == ()


def test_decisions() -> None:
    meeting = check_legs([LEG], [disc(0.0, 180.0)])
    near = check_legs([LEG], [disc(0.0, 100.0)])
    assert decide((), since_replan_s=0.0) is Decision.KEEP
    assert decide(meeting, since_replan_s=5.0) is Decision.WAIT
    assert decide(meeting, since_replan_s=21.0) is Decision.REPLAN
    assert decide(near, since_replan_s=5.0) is Decision.REPLAN
    assert decide(meeting, since_replan_s=0.0, active_cost_s=100.0, new_cost_s=500.0) is Decision.REPLACE_UNSAFE
    assert decide((), since_replan_s=0.0, active_cost_s=200.0, new_cost_s=190.0) is Decision.KEEP
    assert decide((), since_replan_s=0.0, active_cost_s=200.0, new_cost_s=150.0) is Decision.REPLACE_BETTER
    assert decide((), since_replan_s=0.0, active_cost_s=200.0, new_cost_s=150.0, apart_m=ALIKE_M + 1.0) is Decision.KEEP
    assert (
        decide((), since_replan_s=0.0, active_cost_s=200.0, new_cost_s=130.0, apart_m=ALIKE_M + 1.0)
        is Decision.REPLACE_BETTER
    )


def test_path_distance_by_hand() -> None:
    a = [(0.0, 0.0), (0.0, 100.0)]
    assert path_distance_m(a, [(30.0, 0.0), (30.0, 100.0)]) == pytest.approx(30.0, abs=2.6)
    assert path_distance_m(a, [(0.0, 40.0), (0.0, 100.0)]) == pytest.approx(0.0, abs=2.6)  # sailed since
    assert path_distance_m(a, [(0.0, 0.0), (80.0, 50.0), (0.0, 100.0)]) == pytest.approx(80.0, abs=3.0)


@settings(max_examples=60)
@given(number, number, number, number)
def test_distance_of_two_straight_paths_from_one_start_is_that_of_their_ends(
    ax: float, ay: float, bx: float, by: float
) -> None:
    a, b = np.array([[0.0, 0.0], [ax, ay]]), np.array([[0.0, 0.0], [bx, by]])
    assert path_distance_m(a, a) == pytest.approx(0.0, abs=1e-9)
    # Two runners at one pace: no leash is shorter than the ends' distance, none need be longer than that (+ step).
    apart = math.hypot(ax - bx, ay - by)
    assert apart - 1e-9 <= path_distance_m(a, b) <= apart + 5.0
