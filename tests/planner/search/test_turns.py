"""Tack or gybe: a boat that cannot tack, turns that cost, and the long way round as legs of the plan."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from companion.boat import Boat, ardurover_sitl
from companion.planner import Problem, plan
from companion.planner.explain import explain, turns
from companion.planner.problem.evaluate import evaluate, manoeuvre
from companion.planner.search.annealing import anneal
from companion.planner.search.bound import Bound
from companion.planner.search.gauge import make_gauge
from companion.planner.search.kernels import turn_guess, turn_time
from companion.planner.search.lattice import run_lattice
from companion.planner.search.moves import WAYS, check_path, overshoot, round_vector, rounded
from companion.planner.search.world import make_world
from tests.planner.problem_json import to_dict
from tests.planner.problems import FOLDER, box, load, random_problems, simple

DEG = math.pi / 180.0
BOATS = st.sampled_from(
    [
        {"can_tack": False},
        {"can_tack": False, "gybe_room_m": 4.0, "gybe_loss_s": 2.0},
        {"tack_loss_s": 40.0},
        {"gybe_loss_s": 30.0},
        {"tack_loss_s": 5.0, "gybe_loss_s": 1.0, "gybe_room_m": 6.0},
    ]
)


def boat(**changes):
    return simple()["boat"] | changes


def problem(**changes):
    return Problem.from_json(simple(boat=boat(**changes)))


def names(answer):
    return [leg.manoeuvre for leg in answer.legs]


@pytest.mark.parametrize("heading_deg", range(100, 132, 8))
@pytest.mark.parametrize("seed", range(1, 9))
def test_a_goal_close_behind_is_turned_to_by_no_leg_of_a_hair(heading_deg, seed):
    """Legs of a micrometre point anywhere: by one the search turned round within half a circle, the scorer did not."""
    raw = simple(
        start={"x": 0.0, "y": 0.0, "heading_deg": heading_deg},
        goal={"x": -9.0, "y": 10.85, "radius": 2.0},
        obstacles=[],
        fence=None,
        wind={
            "from_deg": 48.4,
            "speed_mps": 5.35,
            "sigma": {"model": "kalman", "sigma0_deg": 18.0, "growth_deg_per_sqrt_s": 0.6},
        },
        boat=Boat(polar=ardurover_sitl(), tack_loss_s=4.0).problem_boat(5.35),
        delta_s=0.9,
    )
    made = plan(Problem.from_json(raw), seed=seed, expansions=15_000)
    assert made.waypoints_en is not None, made.reason
    assert evaluate(Problem.from_json(raw), made.waypoints_en).is_feasible


# ------------------------------------------------------------------------------------- the scorer
def test_a_boat_that_cannot_tack_must_not():
    tack = [[0, 0], [50, 50], [0, 100]]
    assert evaluate(problem(), tack).is_feasible
    judged = evaluate(problem(can_tack=False), tack)
    assert any("cannot tack" in r for r in judged.reasons)


def test_it_may_gybe_round_where_there_is_room():
    # Up to the corner and 10 m beyond, dead down wind for the room, and up the other close-hauled line.
    def path(room):
        e = room / (2.0 * math.cos(45 * DEG))
        x, y = 50 - e * math.sin(45 * DEG), 50 + e * math.sin(45 * DEG)
        return [[0, 0], [50 + e * math.sin(45 * DEG), y], [50 + e * math.sin(45 * DEG), y - room], [0, 100], [x, y]][:4]

    p = problem(can_tack=False)
    assert p.boat.room_m == pytest.approx(5 * 1.5 / 0.5)
    good = evaluate(p, path(15.0))
    assert good.is_feasible, good.reasons
    assert (good.tacks, good.gybes) == (0, 1)
    assert [leg.manoeuvre for leg in good.legs].count("gybe") == 1
    short = evaluate(p, path(14.0))
    assert any("without a leg of 15.0 m" in r for r in short.reasons)
    assert evaluate(problem(can_tack=False, gybe_room_m=14.0), path(14.0)).is_feasible


def test_without_losses_nothing_of_this_applies():
    p = problem()
    assert p.boat.room_m == 0.0
    same = problem(can_tack=True, tack_loss_s=0.0, gybe_room_m=50.0)
    assert same.boat.room_m == 0.0
    path = [[0, 0], [30, 30], [30, 29.999], [0, 100]]
    assert evaluate(p, path).time_s == evaluate(same, path).time_s


@given(st.floats(-math.pi, math.pi), st.floats(-math.pi, math.pi))
def test_a_turn_has_one_name_and_mirrors(a, b):
    assert manoeuvre(a, b) == manoeuvre(b, a) == manoeuvre(-a, -b)
    if a * b < 0:
        assert manoeuvre(a, b) == ("tack" if abs(a) + abs(b) < math.pi else "gybe")
    else:
        assert manoeuvre(a, b) == ""


# ------------------------------------------------------------------------------------- the pieces
@settings(max_examples=100)
@given(BOATS, st.floats(-180, 180), st.floats(-180, 180))
def test_the_guess_is_never_above_the_turn(changes, before, after):
    b = make_world(problem(**changes)).boat
    exact, guess = turn_time(b, before * DEG, after * DEG), turn_guess(b, before * DEG, after * DEG)
    assert guess <= exact
    if changes.get("can_tack", True) or before * after >= 0:
        assert exact < math.inf


@settings(max_examples=100)
@given(st.floats(45, 80), st.floats(45, 80), st.integers(0, WAYS - 1), st.sampled_from([180, 160, 150]))
def test_a_round_keeps_both_lines(first, second, way, deepest):
    p = problem(can_tack=False, max_twa_deg=deepest)
    b = make_world(p).boat
    a0, a1 = -first * DEG, second * DEG
    x1, y1, x2, y2, ok = round_vector(b, a0, a1, 0.0, way)
    if not ok:
        return
    u, w = np.array([math.sin(a0), math.cos(a0)]), np.array([math.sin(a1), math.cos(a1)])
    e, f, closes = overshoot(*u, *w, x1 + x2, y1 + y2)
    if not closes:
        return
    corner = np.array([0.0, 0.0])
    legs = [np.array([x1, y1])] + ([np.array([x2, y2])] if x2 or y2 else [])
    assert corner + e * u + sum(legs) + f * w == pytest.approx(corner, abs=1e-6)
    assert all(np.hypot(*leg) >= p.boat.room_m for leg in legs)


@settings(max_examples=60)
@given(random_problems(), BOATS, st.lists(st.tuples(st.floats(-100, 100), st.floats(-50, 300)), min_size=1, max_size=9))
def test_the_kernel_agrees_with_the_scorer(raw, changes, points):
    raw = raw | {
        "obstacles": [],
        "fence": None,
        "boat": raw["boat"] | changes,
        "goal": {"x": points[-1][0], "y": points[-1][1], "radius": 1},
    }
    p = Problem.from_json(raw)
    path = np.array([(0.0, 0.0), *points])
    judged, world = evaluate(p, path), make_world(p)
    walked = check_path(world.grid, world.boat, world.to_wind(path), world.h0)
    assume(all(abs(abs(leg.turn_rad) - math.pi) > 1e-9 for leg in judged.legs))  # half a circle: a tack, or a gybe
    if math.isfinite(walked):
        assert judged.is_feasible, judged.reasons
        assert walked == pytest.approx(judged.time_s, rel=1e-9)
    elif judged.is_feasible:  # only by the scorer's slack
        narrowest = min((leg.margin_rad for leg in judged.legs if not leg.is_beat), default=math.inf)
        assert narrowest < 1e-3 or judged.time_s == math.inf or _is_near_a_limit(p, judged)


def _is_near_a_limit(p, judged):
    deepest = max(abs(leg.twa_rad) for leg in judged.legs)
    wound, near = 0.0, False
    for leg in judged.legs:
        wound += leg.turn_rad
        near = near or abs(abs(wound) - p.boat.most_turn_rad) < 1e-3
        if leg.length_m >= p.boat.room_m - 1e-3:
            near = near or abs(leg.length_m - p.boat.room_m) < 1e-3
            wound = 0.0
    return near or abs(deepest - p.boat.max_twa_rad) < 1e-3


def test_tacks_become_rounds_and_the_rest_stays():
    p = problem(can_tack=False)
    world = make_world(p)
    zigzag = world.to_wind(np.array([[0.0, 0.0], [30, 30], [-10, 70], [20, 100]]))
    way = rounded(world.grid, world.boat, zigzag, world.h0)
    assert len(way) == len(zigzag) + 2
    assert math.isfinite(check_path(world.grid, world.boat, way, world.h0))


# ------------------------------------------------------------------------------------- plans
def test_where_it_cannot_tack_it_gybes_round():
    answer = plan(problem(can_tack=False), expansions=20_000)
    assert answer.has_path, answer.reason
    assert "tack" not in names(answer)
    assert "gybe" in names(answer)
    # Two close-hauled legs, 270 degrees of turning, and the legs of the loop: no less than two of the three lines.
    assert answer.cost_s >= 98 * math.sqrt(2) / 1.5 + 1.5 * math.pi / 0.5
    assert answer.cost_s <= 98 * math.sqrt(2) / 1.5 + (45 + 270) * DEG / 0.5 + 2.42 * 15 / 1.5 + 0.5
    told = explain(problem(can_tack=False), answer, expansions=500)
    assert "the boat cannot tack" in told.why.text
    assert [t["manoeuvre"] for t in told.why.data["turns"]] == ["gybe"]


@pytest.mark.parametrize(("loss_s", "expected"), [(5.0, "tack"), (60.0, "gybe")])
def test_the_cheaper_turn_is_taken(loss_s, expected):
    p = problem(tack_loss_s=loss_s)
    answer = plan(p, expansions=20_000)
    assert {n for n in names(answer) if n} == {expected}
    dear, cheap = problem(tack_loss_s=loss_s), problem()
    assert evaluate(dear, answer.waypoints_en).time_s <= plan(cheap, expansions=20_000).cost_s + loss_s + 1e-6


def test_a_gybe_that_costs_is_tacked_round():
    down = simple(
        start={"x": 0, "y": 0, "heading_deg": 170},
        goal={"x": 0, "y": -300, "radius": 2},
        boat=boat(gybe_loss_s=60.0, max_twa_deg=150),
    )
    answer = plan(Problem.from_json(down), expansions=20_000)
    assert {n for n in names(answer) if n} == {"tack"}
    assert all(t["instead_of"] == "gybe" for t in turns(Problem.from_json(down), answer))


@pytest.mark.parametrize("name", ["channel-beat", "channel-bend-kalman", "four-beat-60", "trap-beat"])
def test_channels_without_tacking(name):
    raw = to_dict(load(name))
    p = Problem.from_json(raw | {"boat": raw["boat"] | {"can_tack": False}})
    answer = plan(p, expansions=40_000)
    assert answer.has_path, answer.reason
    judged = evaluate(p, answer.waypoints_en)
    assert judged.is_feasible
    assert judged.tacks == 0
    assert answer.cost_s > plan(load(name), expansions=20_000).cost_s


def gybed_beat(width, length, no_go_deg, sigma):
    """Return the problem of a channel dead to windward for a boat that cannot tack, hardly wider than a gybe loses."""
    raw = simple(
        goal={"x": 0, "y": length, "radius": 10},
        obstacles=[box(-300, 20, -width / 2, length - 20), box(width / 2, 20, 300, length - 20)],
        fence=box(-320, -80, 320, length + 80),
        wind={"from_deg": 0, "speed_mps": 5, "sigma": sigma},
        delta_s=0.66,
        boat=boat(can_tack=False, gybe_room_m=30.0, no_go_half_deg=no_go_deg),
    )
    return Problem.from_json(raw)


def test_a_lattice_turns_by_no_more_than_half_a_circle_in_one_place():
    """Net of what it had turned on short legs it kept the rule, and every board of its path began with a tack."""
    p = gybed_beat(110, 300, 60, {"model": "none"})
    world, half = make_world(p), p.no_go_half_rad(0.0)
    sizes = (1_600, 6_000, 12_000)
    found = [
        run_lattice(world, make_gauge(p), cells=cells, reach=1, half_rad=half, box=world.box).points for cells in sizes
    ]
    found = [points for points in found if points is not None]
    assert found
    assert all(math.isfinite(check_path(world.grid, world.boat, points, world.h0)) for points in found)


def test_a_beat_of_gybes_is_found_where_it_takes_many_times_the_bound():
    """The zone's edge moves: drifts took the effort, and lattices fitted the zone of too early a time."""
    p = gybed_beat(105, 600, 50, {"model": "kalman", "sigma0_deg": 8.0, "growth_deg_per_sqrt_s": 0.3})
    answer = plan(p, expansions=15_000)
    assert answer.has_path, answer.reason
    assert answer.cost_s > 2.5 * answer.lower_bound_s
    assert "tack" not in names(answer)


@settings(max_examples=25)
@given(random_problems(), BOATS, st.integers(0, 5))
def test_any_plan_keeps_the_turns_the_boat_can_do_and_the_bound(raw, changes, seed):
    p = Problem.from_json(raw | {"boat": raw["boat"] | changes})
    answer = plan(p, expansions=4_000, seed=seed)
    if not answer.has_path:
        return
    assert evaluate(p, answer.waypoints_en).is_feasible
    if not p.boat.can_tack:
        assert "tack" not in names(answer)
    world = make_world(p)
    assert Bound(world, make_gauge(p)).value_s <= answer.cost_s
    assert answer.lower_bound_s <= answer.cost_s


@settings(max_examples=15)
@given(BOATS, st.integers(1, 2**32))
def test_annealing_keeps_the_turns_possible(changes, seed):
    raw = simple(obstacles=[box(-20, 40, 5, 45)], fence=box(-60, -20, 60, 120), boat=boat(**changes))
    p = Problem.from_json(raw)
    answer = plan(p, expansions=1_500)
    world = make_world(p)
    _, points, _, last = anneal(
        world.grid,
        world.boat,
        world.to_wind(answer.waypoints_en),
        world.h0,
        np.array([*world.goal, world.goal_radius]),
        60.0,
        world.corners,
        3_000,
        2.0,
        1e-4,
        0.0,
        np.array([seed], np.uint64),
    )
    for path in (points, last):
        assert math.isfinite(check_path(world.grid, world.boat, path, world.h0))


@pytest.mark.parametrize("algorithm", ["rrtstar", "astar"])
def test_the_reference_algorithms_hand_out_no_tack_that_cannot_be(algorithm):
    raw = simple(goal={"x": 150, "y": 60, "radius": 5}, boat=boat(can_tack=False, gybe_room_m=5.0))
    answer = plan(Problem.from_json(raw), algorithm=algorithm, expansions=20_000)
    assert answer.has_path, answer.reason
    assert "tack" not in names(answer)
    upwind = plan(problem(can_tack=False), algorithm=algorithm, expansions=5_000)
    assert "tack" not in names(upwind)


def test_the_keys_are_read_and_written():
    raw = json.loads((FOLDER / "open-beat.json").read_text(encoding="utf-8"))
    p = Problem.from_json(raw | {"boat": raw["boat"] | {"can_tack": False, "gybe_room_m": 12.5}})
    again = Problem.from_json(to_dict(p))
    assert again.boat == p.boat
    assert again.boat.room_m == 12.5
    assert "can_tack" not in to_dict(Problem.from_json(raw))["boat"]
    bad = plan(Problem.from_json(raw | {"boat": raw["boat"] | {"can_tack": False, "gybe_room_m": -1}}), expansions=10)
    assert bad.status.value == "invalid"
