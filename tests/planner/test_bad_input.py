"""Bad input ends in a plan or in a status with its reason, and in bounded work: never an exception, never a hang."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.planner import ALGORITHMS, PlanStatus, Problem, plan
from companion.planner.problem.evaluate import SolidObstacles, evaluate
from companion.planner.search.kernels import is_free
from companion.planner.search.world import make_world
from tests.planner.problems import POLAR, box, random_problems, simple

BOAT = simple()["boat"]
FAR = 1e6


def outcome(algorithm="auto", expansions=3_000, **changes):
    return plan(Problem.from_json(simple(**changes)), expansions=expansions, algorithm=algorithm)


def slivers(count, seed, length=30.0):
    random = np.random.default_rng(seed)
    out = []
    for _ in range(count):
        x, y, a = random.uniform(-50, 50), random.uniform(10, 90), random.uniform(0, 2 * math.pi)
        dx, dy = (random.uniform(1, length) * f(a) for f in (math.cos, math.sin))
        out.append(f"POLYGON (({x} {y}, {x + dx} {y + dy}, {x + dx + 0.01} {y + dy + 0.01}, {x} {y}))")
    return out


def metres(low, high):
    return st.floats(low, high).map(lambda v: round(v, 6))


@pytest.mark.parametrize("algorithm", ALGORITHMS)
@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"obstacles": ["POLYGON ((nan 0, 10 0, 10 10, nan 0))"]}, "not a finite number"),
        ({"obstacles": ["POLYGON ((inf 0, 10 0, 10 10, inf 0))"]}, "not a finite number"),
        ({"fence": "POLYGON ((0 NaN, 10 0, 10 10, 0 NaN))"}, "not a finite number"),
        ({"start": {"x": math.nan, "y": 0, "heading_deg": 0}}, "start.x"),
        ({"goal": {"x": 0, "y": 100, "radius": -1}}, "negative"),
        ({"delta_s": 0.3}, "delta_s"),
        ({"delta_s": 1.0}, "delta_s"),
        ({"delta_s": math.nan}, "delta_s"),
        ({"wind": {"from_deg": 0, "speed_mps": 0, "sigma": {"model": "none"}}}, "no wind"),
        ({"wind": {"from_deg": 0, "speed_mps": math.inf, "sigma": {"model": "none"}}}, "speed_mps"),
        ({"boat": BOAT | {"speed": {"model": "constant", "v_mps": 0}}}, "zero everywhere"),
        ({"boat": BOAT | {"speed": {"model": "polar", "twa_deg": [0, 180], "v_mps": [0, 0]}}}, "zero everywhere"),
        ({"boat": BOAT | {"speed": {"model": "constant", "v_mps": 1e-9}}}, "zero everywhere"),
        ({"boat": BOAT | {"turn_rate_rad_s": 0}}, "turn rate"),
        ({"boat": BOAT | {"gybe_room_m": math.nan, "can_tack": False}}, "gybe_room_m"),
        ({"obstacles": [box(-10, -5, 10, 0.002)]}, "start is inside"),
        ({"goal": {"x": 2e9, "y": 0, "radius": 1}}, "1e9 m"),
    ],
)
def test_invalid_with_the_reason(change, words, algorithm):
    answer = outcome(algorithm, **change)
    assert answer.status is PlanStatus.INVALID
    assert words in answer.reason


@pytest.mark.parametrize(
    "change",
    [
        {"goal": {"x": 0, "y": 100, "radius": 0}, "obstacles": [box(-10, 40, 10, 50)]},
        {"goal": {"x": 0, "y": 50, "radius": 0}, "obstacles": [box(-10, 40, 0, 50)]},
        {"goal": {"x": 0, "y": 0, "radius": 0}},
        {
            "start": {"x": FAR, "y": FAR, "heading_deg": 0},
            "goal": {"x": FAR, "y": FAR + 100, "radius": 2},
            "obstacles": [box(FAR - 10, FAR + 40, FAR + 10, FAR + 50)],
        },
        {"goal": {"x": FAR, "y": FAR, "radius": 2}, "obstacles": [box(-10, 40, 10, 50)]},
        {"goal": {"x": 0, "y": FAR, "radius": 2}, "fence": box(-FAR, -FAR, FAR, 2 * FAR)},
        {"obstacles": [box(-10, 40, 10, 50), box(FAR, FAR, FAR + 10, FAR + 10)]},
        {"obstacles": ["POLYGON ((-20 40, 20 60, 20 40, -20 60, -20 40))"]},  # crosses itself
        {"obstacles": [box(-20, 40, 10, 50), box(-10, 45, 20, 60), box(-20, 40, 10, 50)]},
        {"obstacles": ["POLYGON ((0 10, 0 90, 0 10))", "POLYGON ((5 5, 5 5, 5 5, 5 5))", "POLYGON EMPTY"]},
        {"obstacles": [box(-10, -5, 10, 0)]},
        {"obstacles": [box(-10, -5, 10, -0.001)]},
        {"obstacles": [box(-10, -5, 10, 0.0009)]},  # the format's slack is 1 mm
        {"boat": BOAT | {"turn_rate_rad_s": 1e-9}},
        {"boat": BOAT | {"turn_rate_rad_s": 1e9}},
        {"boat": BOAT | {"speed": {"model": "constant", "v_mps": 1e-5}}},
    ],
)
def test_strange_but_sailable(change):
    raw = simple(**change)
    answer = plan(Problem.from_json(raw), expansions=6_000)
    assert answer.has_path, answer.reason
    assert evaluate(Problem.from_json(raw), answer.waypoints_en).is_feasible


@pytest.mark.parametrize(
    ("goal_y", "obstacles"),
    [
        (100, [box(-200, 40, 0, 60), box(0, 60, 200, 80)]),  # corner to corner
        (-45, [box(-200, -40, 0, -20), box(0, -20, 200, -10)]),
        (100, ["POLYGON ((-200 50, 200 50, 0 60, -200 50))"]),  # its tips on the fence
        (100, ["POLYGON ((-200 40, 0 50, -200 60, -200 40))", "POLYGON ((200 40, 0 50, 200 60, 200 40))"]),
    ],
)
def test_two_that_touch_in_one_point_leave_a_way_through_it(goal_y, obstacles):
    raw = simple(goal={"x": 0, "y": goal_y, "radius": 2}, obstacles=obstacles, fence=box(-200, -50, 200, 150))
    answer = plan(Problem.from_json(raw), expansions=20_000)
    assert answer.has_path, answer.reason


def test_two_that_share_an_edge_leave_none():
    answer = outcome(obstacles=[box(-200, 40, 0, 60), box(0, 40, 200, 60)], fence=box(-200, -50, 200, 150))
    assert answer.status is PlanStatus.INFEASIBLE


def test_thousands_of_slivers_are_not_united():
    raw = simple(obstacles=slivers(2_500, 1, 60.0), boat=BOAT | {"speed": POLAR})
    p = Problem.from_json(raw)
    assert len(make_world(p).corners) == 0  # of tangled obstacles no corners are worked out
    answer = plan(p, expansions=20_000)
    assert "eval_solid" not in p.__dict__  # nor is everything united for the exact check
    assert answer.status is not PlanStatus.INVALID
    if answer.has_path:
        line = shapely.LineString(answer.waypoints_en)
        assert not any(shapely.intersects(g.buffer(-1e-3), line) for g in p.obstacles)


@settings(max_examples=60)
@given(
    random_problems(),
    st.lists(st.tuples(metres(-150, 150), metres(-50, 350)), min_size=2, max_size=8),
    st.sampled_from([0.0, 3.0]),
)
def test_the_test_by_neighbours_agrees_with_the_test_against_everything(raw, points, floor):
    p = Problem.from_json(raw | {"clearance_floor_m": floor})
    shore = SolidObstacles(p)
    shore.is_large = True
    corners = [tuple(c) for g in p.obstacles for c in shapely.get_coordinates(g)[:2]]  # legs that touch
    places = [*points, *corners[:3]]
    shapes = [shapely.LineString([a, b]) for a, b in itertools.pairwise(places) if a != b]
    solid = p.solid
    for shape in [*shapes, *map(shapely.Point, places)]:
        if abs(_depth(solid, shape)) < 1e-5:  # on the edge of the slack either may be
            continue
        assert shore.hits(shape) == bool(p.eval_solid.intersects(shape))
    clear = shore.clearances_m(np.asarray(shapes, dtype=object))
    if clear is not None and shapes:
        walls = [p.obstacle_union, *([] if p.fence_polygon is None else [p.fence_polygon.boundary])]
        for shape, d in zip(shapes, clear, strict=True):
            assert d == pytest.approx(min(w.distance(shape) for w in walls if not w.is_empty), abs=0.02 * floor + 1e-9)


def _depth(solid, shape):
    """How far from just touching the shrunk solid [m]: 0 on the edge."""
    return solid.buffer(-1e-3, join_style="mitre", mitre_limit=5.0).boundary.distance(shape)


@settings(max_examples=40)
@given(random_problems())
def test_a_leg_may_touch_every_convex_corner(raw):
    world = make_world(Problem.from_json(raw | {"fence": None}))
    for (x, y), (ux, uy) in zip(world.corners, world.outward, strict=True):
        assert is_free(world.grid, x, y, x, y)
        assert not is_free(world.grid, x + 1e-3 * ux, y + 1e-3 * uy, x - 2e-2 * ux, y - 2e-2 * uy)


numbers = st.one_of(st.floats(), st.sampled_from([0.0, -0.0, 1e-300, 1e300, 1e6, -1e6, 1e9, 180.0, 90.0]))
ordinary = st.floats(-200, 200)


@st.composite
def wild(draw):
    """Return a problem with one or more numbers replaced by anything, and polygons of few wild points."""
    raw = draw(random_problems())
    rings = []
    for _ in range(draw(st.integers(0, 3))):
        points = draw(st.lists(st.tuples(st.one_of(ordinary, numbers), ordinary), min_size=3, max_size=6))
        rings.append("POLYGON ((" + ", ".join(f"{x!r} {y!r}" for x, y in [*points, points[0]]) + "))")
    raw["obstacles"] = raw["obstacles"] + rings
    for group, key in draw(
        st.lists(
            st.sampled_from(
                [
                    ("start", "x"),
                    ("start", "heading_deg"),
                    ("goal", "x"),
                    ("goal", "y"),
                    ("goal", "radius"),
                    ("wind", "from_deg"),
                    ("wind", "speed_mps"),
                    ("boat", "no_go_half_deg"),
                    ("boat", "max_twa_deg"),
                    ("boat", "turn_rate_rad_s"),
                    ("boat", "tack_loss_s"),
                    ("boat", "gybe_room_m"),
                ]
            ),
            max_size=2,
        )
    ):
        raw[group] = raw[group] | {key: draw(numbers)}
    return raw


@settings(max_examples=150)
@given(wild(), st.sampled_from(["auto", "auto", "rrtstar", "astar"]))
def test_anything_ends_in_a_status_with_a_reason(raw, algorithm):
    p = Problem.from_json(raw)
    answer = plan(p, expansions=400, budget_s=2.0, algorithm=algorithm)
    assert answer.reason
    if answer.has_path:
        assert evaluate(p, answer.waypoints_en).is_feasible
        assert math.isfinite(answer.cost_s)
