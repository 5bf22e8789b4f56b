"""The reference RRT*: Algorithm 1's steering, Algorithm 2's cost, the tree's invariants, CC-RRT*'s bound."""

import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from companion.geo.kernels import wrap
from companion.planner import PlanStatus, Problem, plan
from companion.planner.effort import Effort
from companion.planner.problem.evaluate import evaluate
from companion.planner.reference import rrtstar_kernels as kernels
from companion.planner.reference.kernels import first_hit, turn_time
from companion.planner.reference.kernels import steer as steer_kernel
from companion.planner.reference.rrtstar import RrtTree, search
from companion.planner.reference.world import bounds_of, world_of
from companion.planners import RrtstarSettings

BLOCK = "POLYGON((-60 150,60 150,60 220,-60 220,-60 150))"
AR1 = {"model": "ar1", "sigma0_deg": 2.0, "sigma_inf_deg": 8.0, "rho_hz": 0.036}
KALMAN = {"model": "kalman", "sigma0_deg": 3.0, "growth_deg_per_sqrt_s": 0.5}


def problem(**change):
    base = {
        "id": "t",
        "title": "",
        "start": {"x": 0, "y": 0, "heading_deg": 0},
        "goal": {"x": 0, "y": 400, "radius": 5},
        "obstacles": [BLOCK],
        "fence": None,
        "wind": {"from_deg": 0, "speed_mps": 5, "sigma": AR1},
        "boat": {
            "no_go_half_deg": 45,
            "max_twa_deg": 180,
            "turn_rate_rad_s": 0.5,
            "speed": {"model": "constant", "v_mps": 1.5},
        },
        "delta_s": 0.7,
    }
    return Problem.from_json({**base, **change})


def wind(from_deg=0.0, sigma=AR1):
    return {"from_deg": from_deg, "speed_mps": 5, "sigma": sigma}


def steer(p, x, y, reach=1e9, heading=0.0, t=0.0, start=(0.0, 0.0)):
    w = world_of(p)
    return steer_kernel(*start, heading, t, x, y, reach, w.number, w.no_go_model, w.table, w.polar, w.course)


# ------------------------------------------------------------------------------------- Algorithm 1
def test_outside_the_no_go_zone_it_steers_straight_at_the_target():
    ok, x, y = steer(problem(wind=wind(sigma={"model": "none"})), 100.0, 20.0)
    assert ok
    assert (x, y) == pytest.approx((100.0, 20.0))


@pytest.mark.parametrize(("tx", "side"), [(30.0, 1.0), (-30.0, -1.0)])
def test_inside_it_takes_the_edge_nearer_the_target_to_the_foot_of_the_perpendicular(tx, side):
    ok, x, y = steer(problem(wind=wind(sigma={"model": "none"})), tx, 100.0)
    assert ok
    edge = np.array([side * math.sin(math.pi / 4), math.cos(math.pi / 4)])
    foot = edge * float(np.dot(edge, [tx, 100.0]))
    assert (x, y) == pytest.approx(tuple(foot), abs=1e-3)


def test_a_target_dead_to_windward_behind_a_wide_zone_cannot_be_approached():
    wide = problem(
        boat={
            "no_go_half_deg": 95,
            "max_twa_deg": 180,
            "turn_rate_rad_s": 0.5,
            "speed": {"model": "constant", "v_mps": 1.5},
        }
    )
    ok, _, _ = steer(wide, 0.0, 100.0)
    assert not ok


@given(
    bearing=st.floats(-math.pi, math.pi),
    wind_from=st.floats(0.0, 360.0),
    t=st.floats(0.0, 600.0),
    sigma=st.sampled_from([AR1, KALMAN, {"model": "none"}]),
)
@settings(max_examples=150)
def test_whatever_it_steers_keeps_the_widened_zone_to_the_leg_s_end_and_comes_nearer(bearing, wind_from, t, sigma):
    p = problem(wind=wind(wind_from, sigma), delta_s=0.8, obstacles=[])
    tx, ty = 120.0 * math.sin(bearing), 120.0 * math.cos(bearing)
    ok, x, y = steer(p, tx, ty, t=t, heading=bearing)
    if not ok:
        return
    h = math.atan2(x, y)
    twa = abs(wrap(h - p.wind.twd_from_rad))
    end = t + turn_time(bearing, h, world_of(p).number) + math.hypot(x, y) / 1.5
    assert twa >= max(p.no_go_half_rad(t), p.no_go_half_rad(end)) - 1e-6
    assert math.dist((x, y), (tx, ty)) < 120.0


def test_the_deepest_angle_bounds_the_steering_too():
    p = problem(
        boat={
            "no_go_half_deg": 45,
            "max_twa_deg": 150,
            "turn_rate_rad_s": 0.5,
            "speed": {"model": "constant", "v_mps": 1.5},
        }
    )
    ok, x, y = steer(p, 0.0, -100.0)
    assert ok
    assert math.degrees(abs(math.atan2(x, y))) == pytest.approx(150.0, abs=1e-3)


# ----------------------------------------------------------------------------------- the tree
@pytest.mark.parametrize(
    "change",
    [
        {},
        {"wind": wind(sigma=KALMAN)},
        {"wind": wind(200.0)},
        {
            "boat": {
                "no_go_half_deg": 40,
                "max_twa_deg": 160,
                "turn_rate_rad_s": 0.3,
                "tack_loss_s": 3.0,
                "gybe_loss_s": 2.0,
                "speed": {"model": "polar", "twa_deg": [0, 45, 90, 180], "v_mps": [0, 1.4, 2.0, 1.2]},
            }
        },
        {"current": {"set_deg": 90, "drift_mps": 0.3}},
        {"current": {"set_deg": 90, "drift_mps": 0.3}, "zone": {"from_deg": 10, "half_deg": 65}},
        {"targets": [{"x": -200, "y": 300, "vx": 1.0, "vy": 0.0, "radius_m": 30}]},
    ],
)
def test_every_state_s_time_is_the_scorer_s_time_of_its_path(change):
    p = problem(**change)
    tree = RrtTree(p, world_of(p), seed=3)
    tree.grow(1500)
    n = tree.size
    assert n > 300
    parent = tree.link[:n, kernels.PARENT]
    assert parent[0] == -1
    assert np.all(parent[1:] >= 0)
    for state in range(1, n, max(1, n // 40)):
        way = tree.path_to(state)
        judged = evaluate(p, way)
        complaints = [r for r in judged.reasons if "goal disc" not in r]
        assert complaints == []
        assert judged.time_s == pytest.approx(tree.node[state, kernels.T], rel=2e-3 if "current" in change else 1e-9)
    children = sum(_children(tree, i) for i in range(n))
    assert children == n - 1


@pytest.mark.parametrize("set_deg", [90.0, 180.0])
def test_no_leg_is_one_that_the_autopilot_does_not_follow(set_deg):
    """The zone is wider than the no-go angle through the water: every beat lies on its edges over the ground."""
    tide = {"set_deg": set_deg, "drift_mps": 0.4}
    free, zoned = problem(current=tide), problem(current=tide, zone={"from_deg": 8.0, "half_deg": 66.0})
    ways = [plan(p, algorithm="rrtstar", expansions=20_000, seed=1) for p in (free, zoned)]
    assert all(way.has_path for way in ways)
    assert not evaluate(zoned, ways[0].waypoints_en).is_feasible
    judged = evaluate(zoned, ways[1].waypoints_en)
    assert judged.is_feasible
    assert judged.time_s < 2.5 * ways[0].cost_s


def _children(tree, i):
    count, child = 0, tree.link[i, kernels.CHILD]
    while child >= 0:
        assert tree.link[child, kernels.PARENT] == i
        count, child = count + 1, tree.link[child, kernels.NEXT]
    return count


def test_more_samples_never_cost_more_and_no_state_gets_slower():
    p = problem()
    tree = RrtTree(p, world_of(p), seed=1)
    tree.grow(800)
    before, n = tree.node[: tree.size, kernels.C].copy(), tree.size
    tree.grow(3000)
    assert np.all(tree.node[:n, kernels.C] <= before + 1e-6)
    assert tree.best >= 0
    assert tree.count[kernels.REWIRED] > 0


def test_it_approaches_the_optimum_of_open_water():
    p = problem(obstacles=[], wind=wind(sigma={"model": "none"}))
    best = 400.0 / math.cos(math.pi / 4) / 1.5
    coarse = plan(p, algorithm="rrtstar", expansions=500, seed=0)
    fine = plan(p, algorithm="rrtstar", expansions=12_000, seed=0)
    assert best - 5.0 < fine.cost_s <= coarse.cost_s
    assert fine.cost_s < 1.06 * best


def test_one_seed_is_one_plan_and_chunks_do_not_matter():
    p = problem()
    a = plan(p, algorithm="rrtstar", expansions=3000, seed=5)
    b = plan(p, algorithm="rrtstar", expansions=3000, seed=5)
    c = plan(p, algorithm="rrtstar", expansions=3000, seed=6)
    assert np.array_equal(a.waypoints_en, b.waypoints_en)
    assert not np.array_equal(a.waypoints_en, c.waypoints_en)
    one, many = RrtTree(p, world_of(p), 5), RrtTree(p, world_of(p), 5)
    one.grow(3000)
    for _ in range(30):
        many.grow(100)
    assert np.array_equal(one.node[: one.size], many.node[: many.size])


def test_the_tree_grows_past_its_first_arrays(monkeypatch):
    import companion.planner.reference.rrtstar as module

    p = problem()
    whole = RrtTree(p, world_of(p), 2)
    whole.grow(2000)
    monkeypatch.setattr(module, "FIRST_CAPACITY", 300)
    pieces = RrtTree(p, world_of(p), 2)
    for _ in range(20):
        pieces.grow(100)
    assert np.array_equal(whole.node[: whole.size], pieces.node[: pieces.size])


# ----------------------------------------------------------------------------------- collision
@given(
    st.lists(
        st.tuples(st.floats(-50, 50), st.floats(-50, 50), st.floats(1, 20), st.floats(0, 6)), min_size=1, max_size=6
    ),
    st.tuples(*[st.floats(-80, 80)] * 4),
)
@settings(max_examples=120)
def test_first_hit_is_what_shapely_says(shapes, segment):
    import shapely

    squares = [
        shapely.affinity.rotate(shapely.box(x - r, y - r, x + r, y + r), a, use_radians=True) for x, y, r, a in shapes
    ]
    p = problem(obstacles=[shapely.to_wkt(s, rounding_precision=-1) for s in squares])
    w = world_of(p)
    ax, ay, bx, by = segment
    assume(math.dist((ax, ay), (bx, by)) > 1e-9)  # shapely divides by the length of a line
    line = shapely.LineString([(ax, ay), (bx, by)])
    border = p.solid.buffer(-0.5e-3, join_style="mitre").boundary
    distance = shapely.distance(border, line)
    hit = first_hit(ax, ay, bx, by, w.edge, w.cell_first, w.cell_edge, w.grid, w.shape)
    if distance > 1e-6:
        assert hit > 1.0
    elif line.length > 1e-6 and line.crosses(border):
        assert hit <= 1.0
        at = line.interpolate(hit, normalized=True)
        assert shapely.distance(border, at) < 1e-6


def test_a_start_in_an_obstacle_is_invalid_and_a_start_in_the_goal_is_there():
    inside = plan(problem(obstacles=["POLYGON((-9 -9,9 -9,9 9,-9 9,-9 -9))"]), algorithm="rrtstar", expansions=100)
    assert inside.status is PlanStatus.INVALID
    there = plan(problem(goal={"x": 1, "y": 1, "radius": 5}), algorithm="rrtstar", expansions=100)
    assert there.has_path
    assert there.cost_s == 0.0


def test_bounds_are_the_fence_or_half_the_distance_around():
    assert bounds_of(problem(fence="POLYGON((-300 -100,300 -100,300 500,-300 500,-300 -100))")) == (
        -300.0,
        -100.0,
        300.0,
        500.0,
    )
    x0, y0, x1, y1 = bounds_of(problem())
    assert x0 <= -260.0
    assert x1 >= 260.0
    assert y0 <= -200.0
    assert y1 >= 600.0


# ----------------------------------------------------------------------------------- CC-RRT*
def test_the_risk_limit_is_kept_and_costs_time():
    free = plan(problem(), algorithm="rrtstar", expansions=6000, seed=1)
    held = plan(problem(risk={"max_path_risk": 0.1}), algorithm="rrtstar", expansions=6000, seed=1)
    assert held.has_path
    assert held.risk <= 0.1
    assert held.cost_s > free.cost_s


def test_the_weight_of_the_worst_state_buys_angle_to_the_wind():
    p = problem(delta_s=0.5, wind=wind(sigma={"model": "ar1", "sigma0_deg": 8.0, "sigma_inf_deg": 8.0, "rho_hz": 0.03}))
    worst = []
    for weight in (0.0, 3000.0):
        outcome = search(p, Effort(None, 4000), 1, RrtstarSettings(state_risk_weight_s=weight))
        legs = evaluate(p, outcome.waypoints_en).legs
        worst.append(min(abs(leg.twa_rad) for leg in legs))
    assert worst[1] > worst[0] + math.radians(2.0)


def test_a_state_s_cost_is_its_time_and_its_two_risks():
    p = problem(risk={"max_path_risk": 0.5})
    settings = RrtstarSettings(risk_weight_s=7.0, state_risk_weight_s=11.0)
    tree = RrtTree(p, world_of(p), 2, settings)
    tree.grow(1500)
    node = tree.node[: tree.size]
    time_s, risk, most = (node[:, k] for k in (kernels.T, kernels.R, kernels.M))
    assert node[:, kernels.C] == pytest.approx(time_s + 7.0 * risk + 11.0 * most)
    parent = tree.link[1 : tree.size, kernels.PARENT]
    assert (node[1:, kernels.M] >= node[parent, kernels.M]).all()
    assert tree.count[kernels.REWIRED] > 0


def test_where_a_leg_would_hit_something_its_last_valid_state_is_taken():
    """Section 3.2: "the last valid state is added to the tree instead of the randomly sampled state"."""
    p = problem(obstacles=["POLYGON((-300 90,300 90,300 110,-300 110,-300 90))"], wind=wind(180.0))
    tree = RrtTree(p, world_of(p), seed=1, settings=RrtstarSettings(range_m=200.0, goal_bias=0.9))
    tree.grow(3)  # the goal is drawn: dead before the wind, behind the wall
    assert tree.node[1:2, :2] == pytest.approx(np.array([[0.0, 88.0]]), abs=1e-6)  # in steps of a fiftieth of the range


def test_a_later_state_becomes_the_parent_of_an_earlier_one_where_that_makes_it_cheaper():
    p = problem()
    tree = RrtTree(p, world_of(p), seed=1)
    tree.grow(800)
    n = tree.size
    cost, parent = tree.node[:n, kernels.C].copy(), tree.link[:n, kernels.PARENT].copy()
    tree.grow(2000)
    fell = tree.node[1:n, kernels.C] < cost[1:]
    moved = tree.link[1:n, kernels.PARENT] != parent[1:]
    assert moved.mean() > 0.2
    assert (moved & ~fell).sum() == 0  # none is moved for nothing
    assert fell.sum() > moved.sum()  # what hangs below one that moved is cheaper, too
    to_later = moved & (tree.link[1:n, kernels.PARENT] >= n)
    assert to_later.sum() > 0
    for state in 1 + np.flatnonzero(to_later):
        assert evaluate(p, tree.path_to(state)).time_s == pytest.approx(tree.node[state, kernels.C], rel=1e-9)


def test_without_rewiring_no_state_is_given_another_parent_and_the_path_is_no_better():
    p = problem()
    plain, star = (RrtTree(p, world_of(p), 1, RrtstarSettings(is_rewired=rewired)) for rewired in (False, True))
    plain.grow(3000)
    star.grow(3000)
    assert plain.count[kernels.REWIRED] == 0
    assert star.node[star.best, kernels.T] <= plain.node[plain.best, kernels.T]


def test_no_branch_is_longer_than_the_range_and_the_goal_bias_draws_the_goal():
    p = problem()
    tree = RrtTree(p, world_of(p), 1, RrtstarSettings(range_m=25.0, is_rewired=False))
    tree.grow(1500)
    eager = RrtTree(p, world_of(p), 1, RrtstarSettings(goal_bias=0.9))
    eager.grow(300)
    lazy = RrtTree(p, world_of(p), 1, RrtstarSettings(goal_bias=0.0))
    lazy.grow(300)
    # A state is grown from the nearest; it may then hang on one of its neighbours, which is farther off.
    for n in range(1, tree.size):
        assert np.hypot(*(tree.node[:n, :2] - tree.node[n, :2]).T).min() <= 25.0 + 1e-9

    def near_goal(t):
        return np.mean(np.hypot(t.node[: t.size, 0], t.node[: t.size, 1] - 400.0) < 60.0)

    assert near_goal(eager) > near_goal(lazy)


def test_no_state_of_the_tree_is_above_the_limit():
    p = problem(risk={"max_path_risk": 0.1})
    tree = RrtTree(p, world_of(p), seed=0)
    tree.grow(2000)
    assert tree.size > 200
    assert tree.node[: tree.size, kernels.R].max() <= 0.1


def test_an_expansion_is_a_sample_and_the_budget_is_kept():
    effort = Effort(None, 777)
    search(problem(), effort, 0)
    assert effort.used == 777
