"""Explanations: what bound each leg, the other side, the deciding shift, what would have to give."""

import json
import math
import re

import pytest

from companion.planner import PlanStatus, Problem, plan
from companion.planner.explain import bounds_in_words, explain, leg_bounds, turns, with_clearance
from companion.planner.what_if import ObstacleSide, shifted, walled

BLOCK = "POLYGON((-90 150,60 150,60 220,-90 220,-90 150))"
NONE = {"model": "none"}
AR1 = {"model": "ar1", "sigma0_deg": 8.0, "sigma_inf_deg": 8.0, "rho_hz": 0.03}


def problem(**change):
    base = {
        "id": "t",
        "title": "",
        "start": {"x": 0, "y": 0, "heading_deg": 0},
        "goal": {"x": 0, "y": 400, "radius": 2},
        "obstacles": [BLOCK],
        "fence": None,
        "wind": {"from_deg": 90, "speed_mps": 5, "sigma": NONE},
        "boat": {
            "no_go_half_deg": 45,
            "max_twa_deg": 180,
            "turn_rate_rad_s": 0.5,
            "speed": {"model": "constant", "v_mps": 1.5},
        },
        "delta_s": 0.7,
    }
    return Problem.from_json({**base, **change})


def wind(from_deg, sigma=NONE):
    return {"from_deg": from_deg, "speed_mps": 5, "sigma": sigma}


EFFORT = 6000  # expansions of every plan here: the same answers on a busy machine


def explained(p):
    return explain(p, plan(p, expansions=EFFORT), expansions=EFFORT)


def test_it_names_the_obstacle_that_the_path_turns_at_and_what_the_other_side_costs():
    answer = explained(problem())
    data = answer.why.data
    turning = [b for leg in data["legs"] for b in leg["binds"] if b["by"] == "obstacle"]
    assert {b["obstacle"] for b in turning} == {0}
    assert "obstacle 1" in answer.why.text
    # East about is 2 * 60 m of detour, west about 2 * 90: the straight legs give the difference.
    east = math.hypot(60, 150) + 70 + math.hypot(60, 180)
    west = math.hypot(90, 150) + 70 + math.hypot(90, 180)
    other = data["other_side"]
    assert "east" in other["chosen"]
    assert other["obstacle"] == 0
    assert other["extra_s"] == pytest.approx((west - east) / 1.5, abs=4.0)


def test_the_deciding_shift_is_where_the_two_sides_cost_the_same():
    p = problem(wind=wind(20.0))
    answer = explained(p)
    shift = answer.why.data["other_side"]["shift_deg"]
    assert shift is not None
    again = shifted(p, math.radians(shift))
    assert again.wind.twd_from_rad == pytest.approx(p.wind.twd_from_rad + math.radians(shift))
    side = ObstacleSide(anchor_en=(-15.0, 185.0), outward_en=(1.0, 0.0), obstacle=0, words="")
    east, west = (plan(walled(again, side, sign=s), expansions=EFFORT) for s in (-1.0, 1.0))
    assert west.cost_s == pytest.approx(east.cost_s, rel=0.03)


def test_a_close_hauled_leg_is_bound_by_the_zone_at_so_many_sigmas():
    answer = explained(problem(obstacles=[], wind=wind(0.0, AR1)))
    bound = answer.why.data["legs"][0]["binds"][0]
    assert bound["by"] == "no_go"
    assert bound["sigma_deg"] == pytest.approx(8.0)
    assert bound["sigmas"] == pytest.approx(0.5244, abs=1e-3)  # the normal quantile of 0.7
    assert bound["half_angle_deg"] == pytest.approx(45.0 + 0.5244 * 8.0, abs=0.01)
    assert "tack" in answer.why.text


def test_port_tack_is_the_wind_over_the_port_side():
    p = problem(obstacles=[], wind=wind(0.0, AR1), goal={"x": 250, "y": 300, "radius": 2})
    answer = explained(p)
    leg = max(answer.legs, key=lambda item: item.length_m)
    assert leg.to_en[0] > leg.from_en[0]  # sails east of north with the wind from north: over the port side
    assert "port tack" in answer.why.text


def test_a_straight_reach_needs_no_reason():
    answer = explained(problem(obstacles=[]))
    assert "nothing is in the way" in answer.why.text
    assert answer.why.data["replans"] == 0


def test_the_fence_binds_where_the_path_touches_it():
    fence = "POLYGON((-20 -20,200 -20,200 420,-20 420,-20 -20))"
    block = "POLYGON((20 100,190 100,190 300,20 300,20 100))"
    p = problem(
        obstacles=[block],
        fence=fence,
        start={"x": 100, "y": 0, "heading_deg": 0},
        goal={"x": 100, "y": 400, "radius": 2},
    )
    answer = with_clearance(p, plan(p, expansions=EFFORT))
    assert all(leg.clearance_m is not None for leg in answer.legs)
    line = leg_bounds(p, answer.legs[0])
    assert line["clearance_m"] is not None


def test_clearance_is_the_distance_to_the_nearest_thing():
    p = problem(obstacles=["POLYGON((30 100,60 100,60 200,30 200,30 100))"])
    answer = with_clearance(p, plan(p, expansions=EFFORT))
    assert min(leg.clearance_m for leg in answer.legs) == pytest.approx(30.0, abs=0.2)
    assert with_clearance(problem(obstacles=[]), answer).legs == answer.legs


def test_a_failure_says_how_much_less_certainty_would_do():
    walls = ["POLYGON((-500 -50,-40 -50,-40 450,-500 450,-500 -50))", "POLYGON((40 -50,500 -50,500 450,40 450,40 -50))"]
    sigma = {"model": "ar1", "sigma0_deg": 20.0, "sigma_inf_deg": 20.0, "rho_hz": 0.03}
    p = problem(obstacles=walls, wind=wind(0.0, sigma), delta_s=0.99)
    failed = plan(p, expansions=EFFORT)
    assert not failed.has_path
    answer = explain(p, failed, expansions=EFFORT)
    # 45 + k 20 < 90 wants k < 2.25: delta_s below 0.9878; close to it a beat of very many tacks.
    assert answer.why.data["delta_s"] == pytest.approx(0.9878, abs=0.03)
    assert "delta_s" in answer.why.text


def test_a_failure_says_how_much_margin_would_do():
    p = problem(obstacles=["POLYGON((-60 340,60 340,60 460,-60 460,-60 340),(-40 360,40 360,40 440,-40 440,-40 360))"])
    failed = plan(p, expansions=EFFORT)
    assert not failed.has_path
    answer = explain(p, failed, expansions=EFFORT)
    assert answer.why.data["shrink_m"] == pytest.approx(10.0, abs=1.0)  # a wall 20 m thick


def test_an_invalid_problem_is_only_named_and_the_data_are_json():
    p = problem(obstacles=["POLYGON((-9 -9,9 -9,9 9,-9 9,-9 -9))"])
    answer = explain(p, plan(p, expansions=EFFORT))
    assert answer.status is PlanStatus.INVALID
    assert "Cannot be planned" in answer.why.text
    json.dumps(dict(explained(problem()).why.data))


def test_the_explanation_says_the_clearance_expected_and_the_tacks_that_may_fail():
    from tests.planner.track.test_track import problem as tracked

    base = tracked()
    answer = plan(base, expansions=5_000)
    why = explain(base, answer, expansions=500).why
    assert f"passes {answer.expected_clearance_m:.1f} m clear or more" in why.text
    assert why.data["expected_clearance_m"] == answer.expected_clearance_m


def upwind(heading_deg=0.0, **boat):
    return problem(
        start={"x": 0, "y": 0, "heading_deg": heading_deg},
        obstacles=[],
        wind=wind(0, AR1),
        boat={
            "no_go_half_deg": 52,
            "leeway_deg": 7,
            "turn_rate_rad_s": 0.43,
            "tack_loss_s": 4.9,
            "speed": {"model": "constant", "v_mps": 1.2},
            **boat,
        },
    )


def test_what_close_hauled_is_made_of_adds_up():
    text = bounds_in_words(upwind(), plan(upwind(), expansions=1000))
    whole, bow, leeway, doubt = (
        float(found)
        for found in re.search(
            r"a course (\d+)° off the wind: (\d+)° of it her no-go angle, (\d+)° leeway and (\d+)° for an angle", text
        ).groups()
    )
    assert (bow, leeway) == (45.0, 7.0)
    assert whole == pytest.approx(bow + leeway + doubt, abs=1.0)


@pytest.mark.parametrize("heading_deg", [180.0, 0.0, 120.0])
def test_a_leg_that_leads_somewhere_is_no_detour_to_turn_on(heading_deg):
    """The turn out of the heading at the start and the first tack come to more than half a circle, of 300 m between."""
    p = upwind(heading_deg)
    answer = plan(p, expansions=1000)
    assert turns(p, answer)
    assert not any(turn["instead_of"] for turn in turns(p, answer))
    assert "round instead of" not in bounds_in_words(p, answer)


def test_legs_are_named_by_the_numbers_of_the_mission_that_they_are_sailed_as():
    p = upwind()
    answer = plan(p, expansions=1000)
    numbers = range(4, 4 + len(answer.legs))
    into = [numbers[turn["leg"] - 1] for turn in turns(p, answer) if turn["manoeuvre"] == "tack"]
    text = bounds_in_words(p, answer, numbers)
    assert "ourse" not in text.split("Close-hauled")[0]
    assert into
    assert all(re.search(rf"A tack leads into legs? [^.]*\b{number}\b", text) for number in into)
