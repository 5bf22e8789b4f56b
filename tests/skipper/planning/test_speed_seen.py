"""What the boat is seen to make of its speeds is in the arrivals of the plans that follow."""

import math
from dataclasses import replace

import msgspec
import pytest

from companion.clock import run_virtual
from companion.compose import boat_of
from companion.geofence import load_mission
from companion.skipper.planning.statement import Aim, Start, problem_dict
from companion.skipper.step import SpeedSeen
from companion.skipper.way.gates import gates_of
from companion.skipper.way.voyage import Goal
from lab.campaigns.mismatch import decisions
from sitl.run.embedded import run_embedded
from sitl.runner import SCENARIO_FOLDER
from sitl.scenario import HullSpec, load_scenario
from tests.skipper.world import forecast, voyage


def stated(speed_error, seen):
    made = voyage(Goal(en_m=(0.0, 500.0), radius_m=10.0))
    made = replace(made, boat=replace(made.boat, speed_error=speed_error))
    gate = gates_of(made)[0]
    return problem_dict(
        made,
        gate,
        start=Start(en_m=(0.0, 0.0), heading_rad=0.8),
        aim=Aim(en_m=gate.en_m, radius_m=10.0, gate=0),
        forecast=forecast(0.0, 0.0, sigma_rad=0.05),
        margin_m=15.0,
        delta_s=0.9,
        no_go_half_rad=math.radians(47.0),
        seen=seen,
    )["boat"]


def test_what_is_believed_before_fades_with_what_is_seen():
    assert stated(0.25, None)["speed_error"] == 0.25
    told = stated(0.25, SpeedSeen(share=0.8, error=0.1, tries=4.0))
    assert told["speed_share"] == 0.8
    assert told["speed_error"] == pytest.approx(math.hypot(0.05, 0.1))
    rest = {key: value for key, value in told.items() if not key.startswith("speed_")}
    assert rest == {k: v for k, v in stated(0.25, None).items() if not k.startswith("speed_")}


@pytest.mark.parametrize(("said", "error"), [("", 0.3), ("speed_error_percent = 0", 0.0)])
def test_a_boat_of_which_nobody_says_how_far_off_its_speeds_are_is_taken_to_be_as_others_are(tmp_path, said, error):
    path = tmp_path / "m.toml"
    path.write_text(f"[[goal]]\nlat = 50.83\nlon = -1.3\n[boat]\npolar = 2.0\n{said}\n", encoding="utf-8")
    boat = boat_of(load_mission(path))
    assert (boat.speed_error, boat.told_speed_error) == (error, 0.0)  # assumed, not told


def test_a_slow_boat_s_later_plans_arrive_later_than_their_own_time(tmp_path):
    source = SCENARIO_FOLDER / "demo.toml"
    scenario = msgspec.structs.replace(load_scenario(source), boat=HullSpec(speed=0.7))
    run_virtual(run_embedded(scenario, source, 1, tmp_path))
    plans = [d["plan"] for d in decisions(tmp_path) if d["kind"] == "plan" and d["plan"].get("arrival")]
    shares = [p["arrival"]["p50_s"] / p["cost_s"] for p in plans]
    assert shares[0] < 1.1
    assert shares[-1] > 1.25
