"""A plan for a boat that is barely known is visibly more careful than one for the same boat well known."""

import math
from dataclasses import replace

import pytest

from companion.boat import Sizes, guessed, guessed_text
from companion.compose import boat_of
from companion.geofence import load_mission
from companion.planner import Problem, plan
from companion.skipper.planning.statement import Aim, Start, problem_dict
from companion.skipper.way.gates import gates_of
from companion.skipper.way.voyage import Goal
from tests.skipper.world import forecast, voyage

SIZES = Sizes(length_m=1.5, displacement_kg=20.0, sail_area_m2=0.9)
GUESSED = guessed_text("pepper", SIZES, guessed(SIZES), "2026-11-25")
MISSION = '[[goal]]\nlat = 50.82\nlon = -1.3\n[start]\nlat = 50.817\nlon = -1.3\n[boat]\nfile = "pepper.toml"\n'


def learned(by=1.0):
    """Return the file of the same boat after some hours, each speed's own doubt ``by`` times what they leave."""
    text = GUESSED
    for was, now in (
        ("speed_error_percent = 35", "speed_error_percent = 6"),
        ("no_go_error_deg = 4", "no_go_error_deg = 1.5"),
        ("tack_fails = 0.05", "tack_fails = 0.01"),
    ):
        assert was in text
        text = text.replace(was, now)
    rows = text.split("speed_mps = [")[1].count("    [")
    winds = text.split("tws_mps = [")[1].split("]")[0].count(",") + 1
    error = ", ".join([f"{math.hypot(6.0, 4.0 * by):.1f}"] * winds)
    return text + "error_percent = [\n" + f"    [{error}],\n" * rows + "]\n"


def boat(tmp_path, text):
    (tmp_path / "pepper.toml").write_text(text)
    (tmp_path / "m.toml").write_text(MISSION)
    return boat_of(load_mission(tmp_path / "m.toml"))


def stated(one):
    made = voyage(Goal(en_m=(0.0, 400.0), radius_m=10.0))
    made = replace(made, boat=one)
    gate = gates_of(made)[0]
    return problem_dict(
        made,
        gate,
        start=Start(en_m=(0.0, 0.0), heading_rad=0.8),
        aim=Aim(en_m=gate.en_m, radius_m=10.0, gate=0),
        forecast=forecast(0.0, 0.0, sigma_rad=math.radians(3.0)),
        margin_m=15.0,
        delta_s=0.9,
        no_go_half_rad=one.no_go_half_rad,
        failing={"tack_fails": one.tack_fails},
    )


def test_barely_known_it_keeps_farther_off_the_zone_arrives_less_surely_and_reckons_with_tacks(tmp_path):
    barely, well = (stated(boat(tmp_path, text)) for text in (GUESSED, learned()))
    one, other = (plan(Problem.from_json(problem), expansions=400, seed=0) for problem in (barely, well))
    nearest = [min(abs(math.degrees(leg.twa_rad)) for leg in found.legs) for found in (one, other)]
    assert nearest[0] > nearest[1] + 1.5
    assert one.arrival.late_s / one.arrival.median_s > 1.3 > 1.15 > other.arrival.late_s / other.arrival.median_s
    assert barely["boat"]["tack_fails"] == 5.0 * well["boat"]["tack_fails"]


def test_each_speed_s_own_doubt_is_in_the_arrival_and_in_nothing_else(tmp_path):
    """As a learned file has it, less what all speeds may be off by together."""
    plain, rough = (stated(boat(tmp_path, learned(by))) for by in (0.0, 5.0))
    assert plain["boat"]["shape_error"] == pytest.approx([0.0] * 7, abs=0.01)
    assert rough["boat"]["shape_error"] == pytest.approx([0.2] * 7, abs=0.002)
    assert {k: v for k, v in plain["boat"].items() if k != "shape_error"} == {
        k: v for k, v in rough["boat"].items() if k != "shape_error"
    }
    one, other = (plan(Problem.from_json(problem), expansions=400, seed=0) for problem in (rough, plain))
    assert one.waypoints_en.tolist() == other.waypoints_en.tolist()
    assert one.arrival.late_s - one.arrival.median_s > 1.3 * (other.arrival.late_s - other.arrival.median_s)


def test_a_boat_that_nobody_learned_has_none(tmp_path):
    assert "shape_error" not in stated(boat(tmp_path, GUESSED))["boat"]
