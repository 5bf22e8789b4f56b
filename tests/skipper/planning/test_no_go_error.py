"""What is not known of the no-go zone has its share in a plan's risk, beside the wind's; where nobody says it, none."""

import math
from dataclasses import replace
from statistics import NormalDist

import numpy as np
import pytest

from companion.compose import boat_of
from companion.current import WindAngleUncertainty
from companion.geofence import load_mission
from companion.mission_check import AssumedWind, leg_problem
from companion.planner import Problem, plan
from companion.skipper.planning.statement import Aim, Start, problem_dict, with_no_go_error
from companion.skipper.way.gates import gates_of
from companion.skipper.way.voyage import Goal
from tests.skipper.world import forecast, voyage

DELTA_S = 0.9
Z = NormalDist().inv_cdf(DELTA_S)


def stated(error_deg, sigma_deg=3.0, doubt=None):
    """Return the problem of a beat for a boat whose no-go zone is known to ``error_deg``."""
    made = voyage(Goal(en_m=(0.0, 500.0), radius_m=10.0))
    made = replace(made, boat=replace(made.boat, no_go_error_rad=math.radians(error_deg)))
    gate = gates_of(made)[0]
    return problem_dict(
        made,
        gate,
        start=Start(en_m=(0.0, 0.0), heading_rad=0.8),
        aim=Aim(en_m=gate.en_m, radius_m=10.0, gate=0),
        forecast=forecast(0.0, 0.0, sigma_rad=math.radians(sigma_deg)),
        margin_m=15.0,
        delta_s=DELTA_S,
        no_go_half_rad=math.radians(47.0),
        doubt=doubt,
    )


@pytest.mark.parametrize(("slip_deg", "half_deg"), [(0.0, 47.0), (4.0, 51.0), (-4.0, 47.0)])
def test_leeway_that_the_boat_has_shown_is_a_wider_zone_and_no_spread(slip_deg, half_deg):
    believed = (0.0, 0.0, 0.0, math.radians(slip_deg), 0.0, 0.0)
    shown = stated(0.0, doubt=WindAngleUncertainty(believed=believed, covariance=((0.0,) * 6,) * 6))
    assert shown["boat"]["no_go_half_deg"] == pytest.approx(half_deg)
    assert shown["boat"].get("leeway_deg", 0.0) == pytest.approx(half_deg - 47.0)
    assert shown["wind"] == stated(0.0)["wind"]


def test_the_zone_widens_by_the_squares_of_both():
    sure, unsure = stated(0.0), stated(4.0)
    assert unsure["wind"]["sigma"]["sigma_deg"] == pytest.approx([5.0] * len(unsure["wind"]["sigma"]["sigma_deg"]))
    assert min(unsure["wind"]["sigma"]["half_width_deg"]) == pytest.approx(5.0 * Z, rel=0.01)
    assert min(sure["wind"]["sigma"]["half_width_deg"]) == pytest.approx(3.0 * Z, rel=0.01)
    assert (sure["boat"], sure["wind"]["from_deg"]) == (unsure["boat"], unsure["wind"]["from_deg"])


def test_a_plan_for_a_boat_that_is_hardly_known_is_the_more_careful():
    one, other = (plan(Problem.from_json(stated(error_deg)), expansions=300, seed=0) for error_deg in (0.0, 5.0))
    nearest = [min(abs(math.degrees(leg.twa_rad)) for leg in found.legs) for found in (one, other)]
    assert nearest[1] > nearest[0] + 0.8 * Z * (math.hypot(3.0, 5.0) - 3.0)
    assert other.cost_s > 1.02 * one.cost_s


def test_a_wind_without_spread_leaves_the_boat_s_own():
    flat = forecast(0.0, 0.0, sigma_rad=0.0)
    told = with_no_go_error(flat, math.radians(4.0))
    assert told.sigma_twd_rad == pytest.approx(math.radians(4.0))
    z = [NormalDist().inv_cdf(0.5 + 0.5 * level) for level in flat.level]
    assert told.half_width_rad[0] == pytest.approx(np.array(z) * math.radians(4.0))


def test_a_preview_of_the_mission_has_it_too(tmp_path):
    path = tmp_path / "mission.toml"
    head = "[start]\nlat = 50.817\nlon = -1.31\n[[goal]]\nlat = 50.8215\nlon = -1.31\n[boat]\n"

    def sigma(boat):
        path.write_text(head + boat)
        mission = load_mission(path)
        wind = AssumedWind(from_deg=0.0, speed_mps=5.0, spread_deg=3.0)
        problem = leg_problem(mission, (0.0, 0.0), 45.0, (0.0, 400.0), 10.0, wind=wind)
        return math.degrees(boat_of(mission).no_go_error_rad), math.degrees(problem.wind.sigma.sigma0_rad)

    assert sigma("") == pytest.approx((0.0, 3.0))
    assert sigma("no_go_error_deg = 4.0\n") == pytest.approx((4.0, 5.0))
