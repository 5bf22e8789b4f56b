"""How often a path must turn: never more than a feasible path does, and nearly as often where the water is narrow."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.planner import Problem
from companion.planner.effort import Effort
from companion.planner.problem.evaluate import evaluate
from companion.planner.search.auto import Searcher
from companion.planner.search.bound import Bound, grows, make_boards
from companion.planner.search.gauge import make_gauge
from companion.planner.search.world import make_world
from tests.planner.problems import box, load, random_problems, simple

FENCE = box(-200, -60, 200, 400)


def boards_of(p):
    return make_boards(make_world(p), make_gauge(p), grows(p))


def split(p, waypoints):
    """Return the seconds that a path is sailed and turned, None where it is not feasible."""
    judged = evaluate(p, waypoints)
    if not judged.is_feasible:
        return None
    xy = make_world(p).to_wind(np.asarray(waypoints))
    legs = np.diff(xy, axis=0)
    legs = legs[np.hypot(legs[:, 0], legs[:, 1]) > 1e-9]
    course = np.concatenate([[make_world(p).h0], np.arctan2(legs[:, 0], legs[:, 1])])
    turned = np.abs((np.diff(course) + math.pi) % (2.0 * math.pi) - math.pi).sum() / p.boat.turn_rate_radps
    turned += judged.tacks * p.boat.tack_loss_s + judged.gybes * p.boat.gybe_loss_s
    return judged.time_s - turned, turned


def paths(p, turns=4):
    """Return paths of several kinds, in the problem's frame."""
    world, gauge = make_world(p), make_gauge(p)
    bound = Bound(world, gauge)
    s = Searcher(world, gauge, bound, Effort(None, 10**9), 1)
    s.quick()
    for cells in (400, 1_500):
        s.lattice(cells, 2, margin=0.5, half_at_s=1.5 * min(bound.value_s, 1e5))
    s.geodesic(20_000)
    for _ in range(turns):
        if s.pool:
            s.next_turn()
    return [world.to_en(c.points) for c in s.pool]


def held(p):
    """Assert that the bound holds for every path found, at its own sailing time and above it."""
    boards = boards_of(p)
    if boards is None:
        return
    ways = [found for found in (split(p, way) for way in paths(p)) if found is not None]
    for sail_s, turn_s in ways:
        for more in (1.0, 1.3):
            for as_two in (False, True):
                assert boards.turning_s(more * sail_s + 1e-6, as_two) <= turn_s + 1e-6
        for upper in (1.0, 1.5):
            least = min(sail for sail, _ in ways)
            assert boards.bound_s(least, upper * (sail_s + turn_s)) <= sail_s + turn_s + 1e-6


@settings(max_examples=25)
@given(random_problems(), st.floats(0, 8), st.floats(0, 8), st.booleans())
def test_never_more_than_a_feasible_path_turns(raw, tack_s, gybe_s, can_tack):
    boat = raw["boat"] | {"tack_loss_s": tack_s, "gybe_loss_s": gybe_s, "can_tack": can_tack}
    p = Problem.from_json(raw | {"fence": FENCE, "boat": boat})
    if make_gauge(p).can_move and not evaluate(p, [[0, 0]]).reasons[-1].startswith(("start", "goal")):
        held(p)


@settings(max_examples=12)
@given(
    st.floats(6, 60), st.floats(10, 150), st.floats(-60, 60), st.floats(-45, 45), st.floats(0, 1.5), st.floats(0.2, 2.0)
)
def test_never_more_than_is_turned_in_a_channel(width, length, x, wind, growth, rate):
    walls = [box(-300, 100, x - width / 2, 100 + length), box(x + width / 2, 100, 300, 100 + length)]
    p = Problem.from_json(
        simple(
            obstacles=walls,
            fence=box(-250, -60, 250, 500),
            goal={"x": 20, "y": 400, "radius": 5},
            delta_s=0.7,
            boat=simple()["boat"] | {"turn_rate_rad_s": rate},
            wind={"from_deg": wind, "sigma": {"model": "kalman", "sigma0_deg": 2.0, "growth_deg_per_sqrt_s": growth}},
        )
    )
    held(p)


@pytest.mark.parametrize("width", [10.0, 20.0, 40.0])
def test_a_straight_channel_is_beaten_in_boards_of_its_width(width):
    walls = [box(-300, 50, -width / 2, 250), box(width / 2, 50, 300, 250)]
    p = Problem.from_json(simple(obstacles=walls, fence=box(-250, -60, 250, 400), goal={"x": 0, "y": 320, "radius": 5}))
    boards = boards_of(p)
    tacks = 200.0 / width - 1.0  # each board climbs the width, the first and the last only end and begin inside
    tack_s = 0.5 * math.pi / p.boat.turn_rate_radps
    sail_s = 315.0 * math.sqrt(2.0) / 1.5
    assert (tacks - 2.0) * tack_s <= max(boards.turning_s(sail_s, two) for two in (False, True))
    wide = boards_of(Problem.from_json(simple(fence=box(-250, -60, 250, 400), goal={"x": 0, "y": 320, "radius": 5})))
    assert wide.turning_s(sail_s, as_two=False) <= 1.5 * tack_s + 1e-6  # the first turn, and one tack


@pytest.mark.parametrize(
    ("name", "cost_s", "gap"),
    [("channel-beat", 771.7, 0.006), ("slalom", 788.7, 0.015), ("channels-noisy", 449.7, 0.01), ("gate", 420.3, 0.04)],
)
def test_the_gap_of_narrow_water_is_small(name, cost_s, gap):
    p = load(name)
    bound = Bound(make_world(p), make_gauge(p))
    bound.sharpen(cost_s, 40_000)
    before = bound.value_s
    bound.sharpen_turns(cost_s)
    assert bound.value_s <= cost_s
    assert cost_s / bound.value_s - 1.0 < min(gap, 0.65 * (cost_s / before - 1.0))


def test_without_a_fence_or_in_a_current_it_says_nothing():
    assert boards_of(Problem.from_json(simple(obstacles=[box(-20, 40, 20, 60)]))) is None
    stream = {"set_deg": 90, "drift_mps": 0.3}
    assert boards_of(Problem.from_json(simple(fence=FENCE, current=stream))) is None
