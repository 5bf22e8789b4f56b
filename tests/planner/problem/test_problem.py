"""The problem format: what is read, what is refused, what the tightened no-go zone is."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import norm

from companion.errors import InputError
from companion.planner import Plan, PlanStatus, Problem, plan
from companion.planner.problem.evaluate import endpoint_error
from companion.planner.problem.parts import interpolated
from tests.planner.problem_json import to_dict
from tests.planner.problems import box, random_problems, simple


@pytest.mark.parametrize(
    ("change", "place"),
    [
        ({"boat": {}}, "boat.speed"),
        ({"obstacles": ["POLYGON ((0 0, 1"]}, "obstacles[0]"),
        ({"obstacles": ["POINT (1 2)"]}, "obstacles[0]"),
        ({"obstacles": "POLYGON EMPTY"}, "obstacles"),
        ({"delta_s": "high"}, "delta_s"),
        ({"delta_s": True}, "delta_s"),
        ({"goal": {"x": 0, "y": 0}}, "goal.radius"),
        ({"wind": {"from_deg": 0, "sigma": {"model": "garch"}}}, "wind.sigma.model"),
        (
            {"wind": {"from_deg": 0, "sigma": {"model": "forecast", "horizon_s": [0, 0], "sigma_deg": [1, 2]}}},
            "wind.sigma.horizon_s",
        ),
        ({"start": 3}, "start"),
        (
            {
                "boat": simple()["boat"]
                | {"speed": {"model": "polar", "twa_deg": [0, 90, 60, 180], "v_mps": [0, 1, 2, 3]}}
            },
            "boat.speed.twa_deg",
        ),
        (
            {"boat": simple()["boat"] | {"speeds": {"tws_mps": [2, 6], "twa_deg": [0, 90], "v_mps": [[0, 1], [0]]}}},
            "boat.speeds",
        ),
        (
            {"boat": simple()["boat"] | {"speeds": {"tws_mps": [2], "twa_deg": [90, 0], "v_mps": [[0, 1]]}}},
            "boat.speeds.twa_deg",
        ),
    ],
)
def test_what_cannot_be_read_names_the_place(change, place):
    with pytest.raises(InputError) as caught:
        Problem.from_json(simple(**change))
    assert caught.value.place == place
    assert "\n" not in str(caught.value)


def test_a_file_that_is_not_json(tmp_path):
    path = tmp_path / "p.json"
    path.write_text("{", encoding="utf-8")
    with pytest.raises(InputError, match="not JSON"):
        Problem.from_json(path)
    with pytest.raises(InputError, match="no such file; name a problem file"):
        Problem.from_json(tmp_path / "missing.json")


@pytest.mark.parametrize("text", ["", " \n"])
def test_a_file_with_nothing_in_it_is_called_empty(tmp_path, text):
    path = tmp_path / "empty.json"
    path.write_text(text)
    with pytest.raises(InputError) as caught:
        Problem.from_json(path)
    assert str(caught.value) == f"{path}: is empty; name a problem file"


@settings(max_examples=60)
@given(random_problems())
def test_write_then_read_is_the_same_problem(raw):
    first = Problem.from_json(raw)
    again = Problem.from_json(json.loads(json.dumps(to_dict(first))))
    assert again.obstacles == first.obstacles
    assert again.goal_en == first.goal_en
    for t in (0.0, 7.0, 300.0):
        assert again.no_go_half_rad(t) == pytest.approx(first.no_go_half_rad(t), abs=1e-12)


def test_extensions_survive_write_then_read():
    raw = simple(
        wind={
            "from_deg": 10,
            "speed_mps": 5,
            "sigma": {"model": "forecast", "horizon_s": [0, 60], "sigma_deg": [2, 8], "half_width_deg": [1, 9]},
        },
        current={"set_deg": 90, "drift_mps": 0.3},
        clearance_floor_m=3.0,
        leg_saving=2e-4,
        targets=[{"x": 1, "y": 2, "vx": 3, "vy": 4, "radius_m": 5, "growth_mps": 0.1, "from_s": 1, "until_s": 9}],
        risk={"max_path_risk": 0.05, "correlation_time_s": 30},
        known=[[3, 40], [0.5, 80]],
        note_of_mine="kept",
    )
    first = Problem.from_json(raw)
    again = Problem.from_json(to_dict(first))
    assert (again.current, again.targets, again.risk) == (first.current, first.targets, first.risk)
    assert again.clearance_floor_m == 3.0
    assert again.known_en == first.known_en == ((3.0, 40.0), (0.5, 80.0))
    assert again.leg_saving == first.leg_saving == 2e-4
    assert again.extra["note_of_mine"] == "kept"
    assert math.degrees(again.widening_rad(30.0)) == pytest.approx(5.0)  # half widths, not k sigma


def test_the_zone_widens_with_probability_and_time():
    sigma = {"model": "kalman", "sigma0_deg": 3, "growth_deg_per_sqrt_s": 0.5}
    p = Problem.from_json(simple(delta_s=0.8, wind={"from_deg": 0, "sigma": sigma}))
    expected = 45 + norm.ppf(0.8) * math.sqrt(9 + 0.25 * 100)
    assert math.degrees(p.no_go_half_rad(100.0)) == pytest.approx(expected)
    assert p.no_go_half_rad(100.0) > p.no_go_half_rad(0.0) > p.boat.no_go_half_rad
    ar1 = {"model": "ar1", "sigma0_deg": 2, "sigma_inf_deg": 8, "rho_hz": 0.01}
    q = Problem.from_json(simple(delta_s=0.8, wind={"from_deg": 0, "sigma": ar1}))
    assert math.degrees(q.no_go_half_rad(1e9)) == pytest.approx(45 + norm.ppf(0.8) * 8)


@pytest.mark.parametrize(
    ("delta_s", "growth", "widest_deg"), [(0.8, 0.5, math.inf), (0.8, 0.0, 45 + 3 * norm.ppf(0.8)), (0.5, 0.5, 45)]
)
def test_a_zone_has_no_widest_where_what_is_unsure_of_the_wind_grows_without_end(delta_s, growth, widest_deg):
    sigma = {"model": "kalman", "sigma0_deg": 3, "growth_deg_per_sqrt_s": growth}
    p = Problem.from_json(simple(delta_s=delta_s, wind={"from_deg": 0, "sigma": sigma}))
    assert math.degrees(p.no_go_max_rad) == pytest.approx(widest_deg)
    assert math.degrees(p.no_go_min_rad) == pytest.approx(45 + 3 * norm.ppf(delta_s))
    assert p.is_time_varying == math.isinf(widest_deg)


@pytest.mark.parametrize(("wind_deg", "ground_deg", "turn_deg"), [(90, 110, 20), (350, 10, 20), (10, 350, -20)])
def test_a_wind_over_the_ground_from_further_right_has_a_positive_turn(wind_deg, ground_deg, turn_deg):
    wind = {"from_deg": wind_deg, "speed_mps": 5, "sigma": {"model": "none"}}
    p = Problem.from_json(simple(wind=wind, zone={"from_deg": ground_deg, "half_deg": 55}))
    assert math.degrees(p.ground_turn_rad) == pytest.approx(turn_deg)
    assert Problem.from_json(simple(wind=wind)).ground_turn_rad == 0.0


def test_a_vessel_of_which_only_the_least_is_said_lies_still_for_ever_and_so_does_what_is_unsure_of_it():
    spread = {"vessel": 3, "x": 1, "y": 2, "course_deg": 90, "keep_m": 5, "along_m": 6, "across_m": 7, "sigma_m": 8}
    target = Problem.from_json(simple(targets=[{"x": 1, "y": 2, "radius_m": 5, "spread": spread}])).targets[0]
    assert (target.vx_mps, target.vy_mps, target.growth_mps) == (0.0, 0.0, 0.0)
    assert (target.from_s, target.until_s, target.name) == (0.0, math.inf, "")
    of = target.spread
    assert (of.along_mps, of.across_mps, of.own_mps, of.sigma_mps) == (0.0, 0.0, 0.0, 0.0)


def test_a_current_of_which_only_the_drift_is_said_sets_to_the_north():
    assert Problem.from_json(simple(current={"drift_mps": 0.4})).current.en_mps == (0.0, 0.4)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"delta_s": 0.4}, "delta_s"),
        ({"delta_s": 1.0}, "delta_s"),
        ({"delta_s": math.nan}, "delta_s"),
        ({"wind": {"from_deg": 0, "speed_mps": 0, "sigma": {"model": "none"}}}, "no wind"),
        ({"goal": {"x": 0, "y": 100, "radius": -1}}, "radius"),
        ({"goal": {"x": math.inf, "y": 100, "radius": 1}}, "goal.x"),
        ({"boat": simple()["boat"] | {"speed": {"model": "constant", "v_mps": 0}}}, "polar"),
        ({"boat": simple()["boat"] | {"turn_rate_rad_s": 0}}, "turn rate"),
        ({"obstacles": [box(-10, -10, 10, 10)]}, "start is inside"),
        ({"obstacles": [box(-10, 90, 10, 110)]}, "goal is inside"),
        ({"fence": box(-10, 5, 10, 110)}, "start is outside the fence, or nearer"),
        ({"fence": box(-60, -5060, 60, -5000)}, "start is outside the fence, or nearer"),  # of another lake
        (
            {"fence": box(-60, -60, 60, 60), "goal": {"x": 0, "y": 900, "radius": 2}},
            "goal is outside the fence, or nearer",
        ),
    ],
)
def test_what_cannot_be_planned_is_invalid_with_the_reason(change, words):
    answer = plan(Problem.from_json(simple(**change)), expansions=2_000)
    assert answer.status is PlanStatus.INVALID
    assert words in answer.reason
    assert len(answer.waypoints_en) == 0


@pytest.mark.parametrize(
    ("wall_m", "limit_m", "words"),
    [
        ((-9.5, -20.0), -60.0, "9.5 m from the Quay, and 12.0 m are kept clear of it"),
        ((2.0, -20.0), -60.0, "inside the Quay"),
        ((-40.0, -50.0), -7.0, "7.0 m from the fence, nearer than is kept clear"),
        ((-40.0, -50.0), 1.0, "outside the fence"),
    ],
)
@pytest.mark.parametrize("search", [endpoint_error, lambda p: plan(p, expansions=10).reason])
def test_a_place_in_free_water_is_not_called_inside_an_obstacle(wall_m, limit_m, words, search):
    """The obstacles of a voyage's problem are grown by its margin: the start lay 9.5 m from a wall, "inside"."""
    wall, limits = shapely.box(-200, wall_m[1], 200, wall_m[0]), shapely.box(-300, limit_m, 300, 300)
    made = simple(obstacles=[wall.buffer(12.0).wkt], obstacle_names=["the Quay"], fence=limits.buffer(-12.0).wkt)
    helm = {"wp_radius_m": 5.0, "turn_radius_m": 5.0, "wp_speed_mps": 3.0, "accel_mps2": 1.0, "jerk_mps3": 1.0}
    made["tracking"] = {**helm, "corridor_m": 10.0, "no_go_half_deg": 45.0, "floor_m": 3.0, "reach_m": 0.5}
    made["tracking"] |= {"solids": [wall.wkt], "limits": limits.wkt, "correlation_s": 60.0}
    assert search(Problem.from_json(made)) == f"start is {words}"
    mark = replace(Problem.from_json(made), obstacles=(shapely.Point(0.0, 5.0).buffer(6.0),), obstacle_names=("B",))
    assert search(mark) == "start is within what is kept clear of B"


def test_a_plan_survives_json():
    answer = plan(Problem.from_json(simple()), expansions=5_000)
    again = Plan.from_dict(json.loads(json.dumps(answer.to_dict())))
    assert again.status is answer.status
    assert again.cost_s == answer.cost_s
    assert again.legs[0].no_go_half_rad == pytest.approx(answer.legs[0].no_go_half_rad)
    assert again.waypoints_en.tolist() == answer.waypoints_en.tolist()


@given(st.lists(st.floats(-1e3, 1e3), min_size=1, max_size=8, unique=True).map(sorted), st.data())
def test_one_number_is_interpolated_to_the_bit_as_numpy_does(nodes, data):
    values = data.draw(st.lists(st.floats(-1e3, 1e3), min_size=len(nodes), max_size=len(nodes)))
    x = data.draw(st.one_of(st.floats(-2e3, 2e3), st.sampled_from(nodes)))
    got, wanted = interpolated(x, nodes, values), float(np.interp(x, nodes, values))
    assert got == wanted
    assert math.isnan(interpolated(math.nan, nodes, values))  # numpy's of a table of one node is a number
