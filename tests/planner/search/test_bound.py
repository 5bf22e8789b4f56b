"""The lower bound and the proofs: never above a feasible plan, tight where it should be."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.planner import PlanStatus, Problem, plan
from companion.planner.effort import Effort
from companion.planner.problem.evaluate import evaluate
from companion.planner.search.auto import Searcher
from companion.planner.search.bound import Bound, cut_off
from companion.planner.search.gauge import disc_time, make_gauge
from companion.planner.search.world import make_world
from tests.planner.problems import POLAR, box, load, random_problems, simple


def searched(raw, turns=6):
    p = Problem.from_json(raw)
    world, gauge = make_world(p), make_gauge(p)
    bound = Bound(world, gauge)
    s = Searcher(world, gauge, bound, Effort(None, 10**9), 1)
    s.quick()
    s.lattice(1_500, 2, margin=0.5, half_at_s=1.5 * min(bound.value_s, 1e5))
    before = bound.value_s
    bound.sharpen(math.inf, 10**6)
    assert bound.value_s >= before
    for _ in range(turns):
        if s.pool:
            s.next_turn()
    return p, s, bound


@settings(max_examples=60)
@given(random_problems())
def test_never_above_a_feasible_plan(raw):
    p = Problem.from_json(raw)
    if evaluate(p, [[0, 0]]).reasons[-1].startswith(("start", "goal")):
        return
    if not make_gauge(p).can_move:
        return
    p, s, bound = searched(raw)
    if s.best is None:
        return
    waypoints = s.world.to_en(s.best.points)
    judged = evaluate(p, waypoints)
    assert judged.is_feasible, judged.reasons
    assert judged.time_s == pytest.approx(s.best.cost_s, abs=1e-6)
    assert bound.value_s <= judged.time_s + 1e-9
    for share in (0.5, 1.0, 1.6):  # the late metric bounds whatever moment it is taken at
        bound.sharpen_late(share * judged.time_s, 10**5)
        assert bound.value_s <= judged.time_s + 1e-9
        bound.sharpen_turns(share * judged.time_s)
        assert bound.value_s <= judged.time_s + 1e-9


def test_a_goal_whose_edge_lies_close_hauled_is_fetched_without_a_tack():
    raw = simple(
        start={"x": 0, "y": 0, "heading_deg": 0},
        goal={"x": 2, "y": 310, "radius": 2},
        wind={"from_deg": 45, "speed_mps": 5},
        boat=simple()["boat"] | {"turn_rate_rad_s": 0.25},
    )
    p, s, bound = searched(raw)
    assert s.best is not None
    assert bound.value_s <= evaluate(p, s.world.to_en(s.best.points)).time_s < 1.01 * bound.value_s


def test_the_late_metric_sees_obstacles_in_a_closing_wind():
    p = load("four-beat-75")
    bound = Bound(make_world(p), make_gauge(p))
    bound.sharpen(math.inf, 10**6)
    before = bound.value_s
    bound.sharpen_late(475.0, 40_000)
    assert bound.value_s > 1.01 * before
    assert bound.value_s < evaluate(p, plan(p, expansions=20_000).waypoints_en).time_s


@settings(max_examples=60)
@given(
    st.floats(20, 70),
    st.sampled_from([180.0, 150.0]),
    st.floats(0, 60),
    st.lists(st.tuples(st.floats(-180, 180), st.floats(1, 200)), min_size=1, max_size=5),
)
def test_the_gauge_is_below_every_mixture_of_courses(half, deepest, radius, legs):
    p = Problem.from_json(
        simple(boat={"no_go_half_deg": half, "max_twa_deg": deepest, "turn_rate_rad_s": 1, "speed": POLAR})
    )
    g = make_gauge(p)
    x = y = t = 0.0
    for wish, duration in legs:
        a = math.radians(math.copysign(min(max(abs(wish), half), deepest), wish))
        d = p.boat.speed_mps(a) * duration
        x, y, t = x + d * math.sin(a), y + d * math.cos(a), t + duration
    assert g.disc(x, y, 0.0) <= t * (1 + 1e-9)
    assert g.disc(x, y, radius) <= g.disc(x, y, 0.0) + 1e-9


def test_the_gauge_is_exact_where_it_is_known():
    g = make_gauge(Problem.from_json(simple()))
    assert g.disc(0.0, 100.0, 0.0) == pytest.approx(100 / (1.5 * math.cos(math.pi / 4)), rel=1e-5)
    assert g.disc(0.0, -100.0, 0.0) == pytest.approx(100 / 1.5, rel=1e-5)
    assert g.disc(0.0, -100.0, 10.0) == pytest.approx(90 / 1.5, rel=1e-5)
    assert disc_time(g.normals, g.blocked, 0.0, 5.0, 10.0) == 0.0


@settings(max_examples=60)
@given(st.floats(-300, 300), st.floats(-300, 300), st.floats(-300, 300), st.floats(-300, 300))
def test_the_gauge_obeys_the_triangle_inequality(ax, ay, bx, by):
    g = make_gauge(Problem.from_json(simple(boat=simple()["boat"] | {"speed": POLAR})))
    assert g.disc(ax + bx, ay + by, 0.0) <= g.disc(ax, ay, 0.0) + g.disc(bx, by, 0.0) + 1e-9


def test_one_boat_in_one_wind_has_one_gauge_whatever_the_water():
    p = Problem.from_json(simple())
    elsewhere = replace(p, start_en=(3.0, 4.0), obstacles=(), fence=None, beat=None)
    turned = replace(p, boat=replace(p.boat, max_twa_rad=2.0))
    assert make_gauge(elsewhere) is make_gauge(p)
    assert make_gauge(turned) is not make_gauge(p)


def test_open_water_is_solved_to_the_bound():
    for goal in ({"x": 0, "y": 100, "radius": 2}, {"x": 80, "y": 30, "radius": 2}, {"x": 5, "y": -90, "radius": 0}):
        answer = plan(Problem.from_json(simple(goal=goal)), expansions=20_000)
        assert answer.status is PlanStatus.OPTIMAL
        assert answer.gap < 1e-3


@pytest.mark.parametrize("name", ["walled-goal", "split-fence", "noise-closes"])
def test_what_cannot_be_reached_is_proved(name):
    answer = plan(load(name), expansions=50_000)
    assert answer.status is PlanStatus.INFEASIBLE
    assert answer.lower_bound_s == math.inf
    assert answer.expansions < 50_000  # not waited for


def test_no_way_up_wind_and_no_course_at_all():
    boat = simple()["boat"]
    assert plan(Problem.from_json(simple(boat=boat | {"no_go_half_deg": 90}))).status is PlanStatus.INFEASIBLE
    assert plan(Problem.from_json(simple(boat=boat | {"no_go_half_deg": 181}))).status is PlanStatus.INFEASIBLE
    deep = simple(boat=boat | {"max_twa_deg": 80}, goal={"x": 0, "y": -100, "radius": 2})
    assert plan(Problem.from_json(deep)).status is PlanStatus.INFEASIBLE


def test_a_disc_that_reaches_round_a_wall_is_not_called_cut_off():
    wall = simple(obstacles=[box(-400, 70, 400, 75)], fence=box(-200, -50, 200, 150))
    assert cut_off(make_world(Problem.from_json(wall))) is not None
    assert cut_off(make_world(Problem.from_json(wall | {"goal": {"x": 0, "y": 100, "radius": 40}}))) is None


@settings(max_examples=25)
@given(st.floats(60, 89), st.floats(0.2, 3.0), st.floats(0.6, 0.95), st.floats(50, 400))
def test_proved_hopeless_by_noise_means_that_no_search_finds_a_path(half, growth, delta, distance):
    raw = simple(
        goal={"x": 0, "y": distance, "radius": 2},
        delta_s=delta,
        boat=simple()["boat"] | {"no_go_half_deg": half, "turn_rate_rad_s": 20.0},
        wind={"from_deg": 0, "sigma": {"model": "kalman", "sigma0_deg": 0.0, "growth_deg_per_sqrt_s": growth}},
    )
    p = Problem.from_json(raw)
    world, gauge = make_world(p), make_gauge(p)
    bound = Bound(world, gauge)
    s = Searcher(world, gauge, bound, Effort(None, 10**9), 1)
    s.quick()
    if not math.isfinite(bound.value_s):
        assert s.best is None
    elif s.best is not None:
        assert bound.value_s <= s.best.cost_s


def test_the_geodesic_goes_round_the_obstacle():
    p = Problem.from_json(simple(goal={"x": 0, "y": -100, "radius": 0}, obstacles=[box(-30, -60, 10, -40)]))
    world, gauge = make_world(p), make_gauge(p)
    bound = Bound(world, gauge)
    bound.sharpen(math.inf, 10_000)
    length = math.hypot(10, 40) + 20 + math.hypot(10, 40)
    assert bound.metric_s == pytest.approx(length / 1.5, rel=1e-3)
    assert np.allclose(bound.path, [[0, 0], [10, -40], [10, -60]])
