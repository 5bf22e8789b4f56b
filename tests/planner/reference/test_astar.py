"""AVALON's A*: its grid, its costs one by one, its goal heading, its ships, its memory."""

import math
from dataclasses import replace

import numpy as np
import pytest
import shapely

from companion.geo.angles import difference_rad
from companion.planner import PlanStatus, Problem, plan
from companion.planner.effort import Effort
from companion.planner.problem.evaluate import evaluate
from companion.planner.reference.astar import grid_of, search, ship_discs, steps_of, target_heading
from companion.planners import AstarSettings

AVALON_TWA = list(range(0, 181, 5))
AVALON_MPS = [
    max(0.0, (-0.0048 * a**4 + 0.0335 * a**3 - 0.2460 * a**2 + 0.7465 * a - 0.01109) * 10.0 * 0.514444)
    for a in map(math.radians, AVALON_TWA)
]


def problem(**change):
    base = {
        "id": "t",
        "title": "",
        "start": {"x": 0, "y": 0, "heading_deg": 90},
        "goal": {"x": 0, "y": 800, "radius": 10},
        "obstacles": [],
        "fence": None,
        "wind": {"from_deg": 0, "speed_mps": 5, "sigma": {"model": "none"}},
        "boat": {
            "no_go_half_deg": 45,
            "max_twa_deg": 160,
            "turn_rate_rad_s": 0.5,
            "speed": {"model": "polar", "twa_deg": AVALON_TWA, "v_mps": AVALON_MPS},
        },
        "delta_s": 0.5,
    }
    return Problem.from_json({**base, **change})


def run(p, **settings):
    outcome = search(p, Effort(None, 10**8), 0, AstarSettings(**settings))
    return outcome, (None if outcome.waypoints_en is None else evaluate(p, outcome.waypoints_en))


def test_there_are_24_steps_on_16_headings():
    step, courses = steps_of(grid_of(problem(), 20.0))
    assert step.shape == (24, 4)
    assert len(courses) == 16
    assert {0.0, 45.0, 90.0, 135.0} <= {round(math.degrees(c), 6) for c in courses}
    assert sorted(np.bincount(step[:, 2].astype(int)).tolist()) == [1] * 8 + [2] * 8


@pytest.mark.parametrize("goal", [(0, 800), (333, 777), (-1000, 5), (5, -1000), (3, 4)])
def test_start_and_goal_are_nodes_and_the_spacing_is_near_what_was_asked(goal):
    p = problem(goal={"x": goal[0], "y": goal[1], "radius": 1})
    grid = grid_of(p, 20.0)
    assert grid.place(grid.start) == pytest.approx((0.0, 0.0), abs=1e-6)
    assert grid.place(grid.goal) == pytest.approx(goal, abs=5.0)  # a quarter of a cell
    assert 5.0 <= grid.dx_m < 27.0
    assert 5.0 <= grid.dy_m < 27.0
    if min(map(abs, goal)) >= 5.0 or 0 in goal:
        assert grid.place(grid.goal) == pytest.approx(goal, abs=1e-6)


@pytest.mark.parametrize("wind_from", range(0, 360, 30))
def test_headings_stay_45_to_160_degrees_off_the_wind_and_turns_within_90(wind_from):
    p = problem(wind={"from_deg": wind_from, "speed_mps": 5, "sigma": {"model": "none"}})
    outcome, judged = run(p)
    assert judged is not None
    assert judged.is_feasible, judged.reasons
    for i, leg in enumerate(judged.legs):
        assert 45.0 - 1e-6 <= abs(math.degrees(leg.twa_rad)) <= 160.0 + 1e-6
        if i:
            assert abs(math.degrees(leg.turn_rad)) <= 90.0 + 1e-6
    assert outcome.trace["expanded"] > 0


def test_it_is_dijkstra_s_optimum_with_less_work():
    p = problem(
        wind={"from_deg": 40, "speed_mps": 5, "sigma": {"model": "none"}},
        obstacles=["POLYGON((-100 300,150 300,150 450,-100 450,-100 300))"],
    )
    informed, _ = run(p)
    blind, _ = run(p, heuristic_mps=None)
    assert informed.trace["objective"] == pytest.approx(blind.trace["objective"], rel=1e-9)
    assert informed.trace["expanded"] < blind.trace["expanded"]


def test_the_turning_cost_makes_fewer_turns():
    p = problem(
        wind={"from_deg": 20, "speed_mps": 5, "sigma": {"model": "none"}},
        obstacles=["POLYGON((-100 300,150 300,150 450,-100 450,-100 300))"],
    )
    _, plain = run(p, turn_s_per_rad=0.0)
    _, smooth = run(p, turn_s_per_rad=8.0)
    turning = [sum(abs(leg.turn_rad) for leg in judged.legs) for judged in (plain, smooth)]
    assert turning[1] < turning[0]
    assert len(smooth.legs) < len(plain.legs)


def test_the_tack_cost_makes_fewer_tacks_and_the_tunnel_keeps_to_the_line():
    p = problem()
    _, plain = run(p, turn_s_per_rad=0.0)
    _, tacks = run(p, turn_s_per_rad=0.0, tack_s=60.0, gybe_s=60.0)
    assert tacks.tacks + tacks.gybes < plain.tacks + plain.gybes

    def widest(judged):
        return max(abs(leg.to_en[0]) for leg in judged.legs)

    _, tunnel = run(p, turn_s_per_rad=8.0, tunnel_width_m=40.0)
    _, free = run(p, turn_s_per_rad=8.0)
    assert widest(tunnel) < widest(free)


@pytest.mark.parametrize("from_deg", [0, 20, 180])
def test_each_tack_and_each_gybe_costs_what_is_set_and_a_step_beside_the_line_what_equation_4_6_says(from_deg):
    p = problem(wind={"from_deg": from_deg, "speed_mps": 5, "sigma": {"model": "none"}})
    free, way = run(p, grid_m=20.0)
    dearer, same = run(p, grid_m=20.0, tack_s=0.01, gybe_s=0.03)
    assert [leg.to_en for leg in same.legs] == [leg.to_en for leg in way.legs]
    spent = dearer.trace["objective"] - free.trace["objective"]
    assert spent == pytest.approx(0.01 * way.tacks + 0.03 * way.gybes, abs=1e-9)
    assert spent > 0.0
    if from_deg == 0:  # one board of twenty cells out, one back, in steps of two: at 40, 80 ... 400 ... 40, 0 m
        width_m = 1e6
        tunnel, same = run(p, grid_m=20.0, tunnel_width_m=width_m)
        assert [leg.to_en for leg in same.legs] == [(400.0, 400.0), (0.0, 800.0)]
        beside_m = sum(40.0 * (n if n <= 10 else 20 - n) for n in range(1, 21))
        assert tunnel.trace["objective"] - free.trace["objective"] == pytest.approx(10.0 * beside_m / width_m)


def test_the_numbers_are_those_that_he_ends_with_and_seven_knots_are_what_is_estimated():
    own = AstarSettings()
    assert (own.turn_s_per_rad, own.tack_s, own.gybe_s, own.tunnel_width_m, own.ship_match_s) == (
        8.0,
        0.0,
        0.0,
        None,
        20.0,
    )
    assert np.degrees([own.min_twa_rad, own.max_twa_rad, own.max_turn_rad]) == pytest.approx([45.0, 160.0, 90.0])
    speed = {"model": "polar", "twa_deg": AVALON_TWA, "v_mps": [0.3 * v for v in AVALON_MPS]}
    slow = problem(boat={"no_go_half_deg": 45, "max_twa_deg": 160, "turn_rate_rad_s": 0.5, "speed": speed})
    usual, _ = run(slow)
    for knots, is_usual in ((7.0, True), (6.0, False), (1.0, False)):  # of 1: her own top speed
        other, _ = run(slow, heuristic_mps=knots * 1852.0 / 3600.0)
        assert other.trace["objective"] == pytest.approx(usual.trace["objective"])
        assert (other.trace["expanded"] == usual.trace["expanded"]) == is_usual


def test_an_abrupt_tunnel_costs_nothing_inside_and_keeps_within_its_borders():
    p = problem()

    def widest(judged):
        return max(abs(leg.to_en[0]) for leg in judged.legs)

    free, wide = run(p, turn_s_per_rad=8.0), run(p, tunnel_width_m=2000.0, tunnel="abrupt")
    assert wide[0].trace["objective"] == free[0].trace["objective"]
    narrow_m = 0.8 * widest(free[1])
    narrow, judged = run(p, tunnel_width_m=2.0 * narrow_m, tunnel="abrupt")
    assert narrow.trace["objective"] > free[0].trace["objective"]
    assert widest(judged) <= narrow_m + 1e-6


def test_a_convex_tunnel_costs_little_in_the_middle_and_as_much_as_an_abrupt_one_at_its_borders():
    p = problem()
    way, judged = run(p, turn_s_per_rad=8.0)
    widest_m = max(abs(leg.to_en[0]) for leg in judged.legs)

    def dearer_s(tunnel, width_m):
        return run(p, tunnel_width_m=width_m, tunnel=tunnel)[0].trace["objective"] - way.trace["objective"]

    # The same path in two widths, half-way to the borders and a quarter of it.
    half, quarter = dearer_s("convex", 4.0 * widest_m), dearer_s("convex", 8.0 * widest_m)
    assert half == pytest.approx(16.0 * quarter)
    assert dearer_s("linear", 8.0 * widest_m) > 10.0 * quarter > 0.0
    narrow_m = 0.8 * widest_m
    assert dearer_s("convex", 2.0 * narrow_m) > dearer_s("abrupt", 2.0 * narrow_m) > 0.0
    _, kept = run(p, tunnel_width_m=2.0 * narrow_m, tunnel="convex")
    assert max(abs(leg.to_en[0]) for leg in kept.legs) <= narrow_m + 1e-6


def test_the_goal_heading_is_set_by_hand_for_short_courses():
    p = problem(wind={"from_deg": 90, "speed_mps": 5, "sigma": {"model": "none"}})
    _, own = run(p)
    assert own.legs[-1].heading_rad == pytest.approx(0.0, abs=1e-9)
    for wanted_deg in (-40.0, 200.0):
        _, judged = run(p, goal_heading_rad=math.radians(wanted_deg))
        off_rad = difference_rad(judged.legs[-1].heading_rad, math.radians(wanted_deg))
        assert abs(math.degrees(off_rad)) < 15.0  # of sixteen
    _, judged = run(p, goal_heading_rad=math.radians(90.0))  # into the wind: turned until it can be sailed
    assert abs(math.degrees(judged.legs[-1].twa_rad)) == pytest.approx(45.0, abs=1.0)


def test_any_heading_at_the_goal_arrives_where_that_of_the_bearing_cannot():
    # The mark lies behind a wall to its south: whoever heads north at it comes through the wall.
    p = problem(
        wind={"from_deg": 90, "speed_mps": 5, "sigma": {"model": "none"}},
        obstacles=["POLYGON((-400 740,400 740,400 790,-400 790,-400 740))"],
    )
    fixed, _ = run(p)
    free, judged = run(p, goal_heading="any")
    assert fixed.waypoints_en is None or fixed.trace["objective"] > free.trace["objective"]
    assert judged.is_feasible
    assert abs(math.degrees(judged.legs[-1].heading_rad)) > 80.0
    _, set_by_hand = run(p, goal_heading="any", goal_heading_rad=math.pi)
    assert abs(math.degrees(set_by_hand.legs[-1].heading_rad)) == pytest.approx(180.0)


def test_a_short_leg_has_the_room_to_tack_that_it_is_given():
    p = problem(goal={"x": 5, "y": 10, "radius": 3})
    settings = {"grid_m": 5.0, "min_twa_rad": math.radians(50.0), "max_turn_rad": math.radians(150.0)}
    _, cramped = run(p, **settings)
    _, roomy = run(p, **settings, room_m=60.0)
    assert roomy.time_s < 0.8 * cramped.time_s


def test_with_his_largest_turn_of_90_degrees_it_gybes_round_where_the_wind_blows_across_the_grid():
    across = problem(wind={"from_deg": 5, "speed_mps": 5, "sigma": {"model": "none"}})
    _, his = run(across)
    assert his.gybes > 0
    assert max(abs(leg.turn_rad) for leg in his.legs[1:]) <= 0.5 * math.pi + 1e-9  # the first may be any
    _, judged = run(across, max_turn_rad=math.radians(150.0))
    assert judged.is_feasible
    assert judged.tacks > 0
    assert judged.time_s < his.time_s


def test_the_goal_heading_is_the_bearing_turned_out_of_the_wind():
    _, courses = steps_of(grid_of(problem(), 20.0))
    every = np.ones(16, dtype=bool)
    assert courses[target_heading(courses, every, 0.0)] == pytest.approx(0.0)
    sailable = np.array([abs(math.degrees(c)) >= 45.0 for c in courses])
    assert abs(math.degrees(courses[target_heading(courses, sailable, math.radians(3.0))])) == pytest.approx(45.0)
    assert target_heading(courses, np.zeros(16, dtype=bool), 0.0) == -1


def test_the_grid_refuses_to_grow_past_its_memory_and_says_what_would_fit():
    outcome, _ = run(problem(), grid_m=0.01)
    assert outcome.waypoints_en is None
    assert outcome.status is PlanStatus.NOT_FOUND
    assert "MB allowed" in outcome.reason
    assert "[planner] grid_m" in outcome.reason
    fits = float(outcome.reason.split("one of ")[1].split(" m")[0])
    grid = grid_of(problem(), 1.1 * fits)
    assert grid.memory_bytes <= AstarSettings().memory_bytes


def square(side_m):
    return shapely.box(-0.5 * side_m, -0.5 * side_m, 0.5 * side_m, 0.5 * side_m).wkt


@pytest.mark.parametrize(
    ("goal", "side_m", "cell_m"),
    [((0, 800), 2000.0, 20.0), ((15, 0), 400.0, 2.0), ((15, 1), 400.0, 2.0), ((60, 0), 2000.0, 3.4)],
)
def test_the_default_grid_is_as_fine_as_is_sensible_and_fits(goal, side_m, cell_m):
    """Between two gates of a buoy, 15 m apart, a fortieth of the distance asked for 687 MB: no such leg was planned."""
    p = problem(goal={"x": goal[0], "y": goal[1], "radius": 3}, fence=square(side_m))
    outcome, found = run(p)
    assert outcome.trace["grid_m"] == pytest.approx(cell_m, rel=0.1)
    assert found is not None, outcome.reason
    assert found.is_feasible


def test_a_default_grid_fits_whatever_the_water_and_one_that_is_asked_for_is_not_coarsened():
    for goal in ((15, 0.1), (15, 15), (3, 0)):
        p = problem(goal={"x": goal[0], "y": goal[1], "radius": 2}, fence=square(20_000.0))
        outcome, _ = run(p, memory_bytes=20_000_000)
        assert "MB allowed" not in outcome.reason
        assert outcome.trace["columns"] * outcome.trace["rows"] * 16 * 45 <= 20_000_000
    assert "MB allowed" in run(p, grid_m=2.0)[0].reason


def test_a_ship_is_a_disc_where_it_would_be_met():
    ship = {"x": -400, "y": 400, "vx": 3.0, "vy": 0.0, "radius_m": 60}
    p = problem(wind={"from_deg": 90, "speed_mps": 5, "sigma": {"model": "none"}}, targets=[ship])
    discs = ship_discs(p, AstarSettings())
    assert len(discs) > 0
    mean = np.mean(np.interp(np.linspace(45, 160, 60), AVALON_TWA, AVALON_MPS))
    for x, y, radius in discs:  # eq. 4.7
        t = (x + 400.0) / 3.0
        assert abs(t - math.hypot(x, y) / mean) < 20.0
        assert radius == pytest.approx(60.0)
    (_, alone), (_, judged) = run(replace(p, targets=())), run(p)
    assert judged is not None
    assert judged.is_feasible, judged.reasons
    assert alone.is_feasible
    assert [any(_cuts(leg, disc) for leg in way.legs for disc in discs) for way in (alone, judged)] == [True, False]
    assert len(ship_discs(problem(), AstarSettings())) == 0


def _cuts(leg, disc):
    """Return whether a leg, by shapely, goes through a disc (x, y, radius)."""
    return shapely.LineString([leg.from_en, leg.to_en]).distance(shapely.Point(disc[:2])) < disc[2] - 1e-6


def test_a_walled_in_goal_ends_with_its_reason():
    wall = "POLYGON((-60 740,60 740,60 860,-60 860,-60 740),(-40 760,40 760,40 840,-40 840,-40 760))"
    answer = plan(problem(obstacles=[wall]), algorithm="astar", expansions=10**8)
    assert answer.status is PlanStatus.NOT_FOUND
    assert "no path on this grid" in answer.reason


def test_expansions_are_counted_and_two_runs_agree():
    a = plan(problem(), algorithm="astar", expansions=500)
    assert a.expansions <= 500
    assert not a.has_path
    b = plan(problem(), algorithm="astar", expansions=10**7)
    c = plan(problem(), algorithm="astar", expansions=10**7, seed=9)
    assert np.array_equal(b.waypoints_en, c.waypoints_en)


def test_courses_that_the_autopilot_does_not_follow_are_none_of_the_16_headings():
    tide = {"set_deg": 90.0, "drift_mps": 0.5}
    free, zoned = problem(current=tide), problem(current=tide, zone={"from_deg": 5.0, "half_deg": 60.0})
    (_, free_way), (_, zoned_way) = run(free, max_turn_rad=2.7), run(zoned, max_turn_rad=2.7)
    assert free_way.is_feasible
    assert zoned_way.is_feasible
    assert not evaluate(zoned, [leg.from_en for leg in free_way.legs] + [zoned.goal_en]).is_feasible
    assert zoned_way.time_s > free_way.time_s
    outcome = search(
        problem(current=tide, zone={"from_deg": 0.0, "half_deg": 179.0}), Effort(None, 10**8), 0, AstarSettings()
    )
    assert outcome.waypoints_en is None
