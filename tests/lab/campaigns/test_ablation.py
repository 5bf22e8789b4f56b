"""What is taken away is really gone in the voyage that is sailed, and the table pairs seed with seed."""

import json
import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.app.options import wind_room
from companion.clock import run_virtual
from companion.messages import WindSample, WindSource
from companion.wind import Forecaster
from lab.campaigns.ablation import AS_IT_IS, SCENARIOS, VARIATIONS, interval, table
from lab.methods import MEAN_S, foreknown, unspread
from sitl import cli
from sitl.run.embedded import mission_of, run_embedded
from sitl.scenario import load_scenario
from sitl.world.environment import parse_wind

UPWIND = SCENARIOS[0].parent / "upwind.toml"


def fed(room, wind, until_s=120):
    for t in range(1, until_s + 1):
        twd, tws = wind.at(float(t))
        room.update(WindSample(t_s=float(t), twd_from_rad=twd, tws_mps=tws, source=WindSource.SIMULATED))
    return room.forecast_table(float(until_s))


@pytest.fixture(scope="module")
def weather():
    return parse_wind("ar1:5@10,sd=12", seed=3)


def test_without_spread_the_forecast_is_its_mean_and_certain(weather):
    usual, certain = fed(wind_room(Forecaster()), weather), fed(unspread(weather, Forecaster()), weather)
    assert len(set(certain.mean_twd_from_rad)) == 1
    assert usual.mean_twd_from_rad.min() <= certain.mean_twd_from_rad[0] <= usual.mean_twd_from_rad.max()
    assert usual.half_width_rad.max() > 0.1
    assert certain.half_width_rad.max() == 0.0
    assert certain.sigma_twd_rad.max() < 0.001


def test_who_knows_the_wind_is_told_what_will_blow(weather):
    told = fed(foreknown(weather, Forecaster()), weather)
    for horizon_s, twd in zip(told.horizon_s, told.mean_twd_from_rad, strict=True):
        blown = [weather.at(120.0 + horizon_s + s)[0] for s in range(0, int(MEAN_S), 2)]
        mean = math.atan2(sum(map(math.sin, blown)), sum(map(math.cos, blown)))
        assert math.remainder(twd - mean, 2.0 * math.pi) == pytest.approx(0.0, abs=1e-9)
    assert told.half_width_rad.max() == 0.0


@pytest.mark.parametrize("name", VARIATIONS)
def test_every_variation_is_a_mission_that_can_be_sailed_and_another_than_as_it_is(name):
    scenario = load_scenario(SCENARIOS[0])
    mission = mission_of(scenario, SCENARIOS[0])
    varied = VARIATIONS[name].mission(mission)
    assert (varied.options == mission.options) == (not VARIATIONS[name].tables)
    assert VARIATIONS[name].tables or VARIATIONS[name].room or name == AS_IT_IS


@pytest.mark.parametrize(("name", "is_certain"), [("planned, no spread", True), ("beats planned", False)])
def test_the_voyage_is_planned_so(tmp_path, name, is_certain):
    scenario = load_scenario(UPWIND)
    run_virtual(run_embedded(scenario, UPWIND, 0, tmp_path, variation=VARIATIONS[name]))
    rows = [json.loads(line) for line in (tmp_path / "decisions.jsonl").read_text().splitlines()]
    shown = {row["request_id"]: row["leeway_deg"] for row in rows if row.get("action") == "RequestPlan"}
    half = [  # without what the boat has shown of her leeway, which is no spread
        leg["no_go_half_deg"] - shown[row["request_id"]]
        for row in rows
        if row["kind"] == "plan" and row.get("plan")
        for leg in row["plan"]["legs"]
    ]
    least = mission_of(scenario, UPWIND).options.boat.no_go_half_deg
    assert half
    if is_certain:
        assert max(half) == pytest.approx(least, abs=1e-3)
    else:
        assert min(half) > least + 2.0


def record(variation, seed, time_s, **more):
    return {
        "variation": variation,
        "seed": seed,
        "error": "",
        "arrived": True,
        "contacts": 0,
        "time_s": time_s,
        "replans": 7,
        "tacks": 3,
        "min_clearance_m": 12.0,
        "no_go_entries": 0,
        "vessel_m": None,
        "floor_m": 6.0,
        "safe_m": 50.0,
        **more,
    }


def test_times_are_paired_and_only_of_those_that_both_arrived():
    records = [
        record(AS_IT_IS, 0, 100.0),
        record(AS_IT_IS, 1, 200.0),
        record(AS_IT_IS, 2, 50.0, arrived=False),
        record("kalman", 0, 110.0),
        record("kalman", 1, 220.0, min_clearance_m=5.9),
        record("kalman", 2, 9000.0, contacts=2),
    ]
    kalman = table(records, [AS_IT_IS, "kalman"]).splitlines()[2].split()
    assert kalman[:4] == ["kalman", "3/3", "1", "1"]
    assert " ".join(kalman[-6:]) == "7 220 1.100 (1.100 to 1.100)"


def test_who_came_nearer_to_a_vessel_than_the_mission_allows_is_counted():
    records = [record(AS_IT_IS, seed, 100.0, vessel_m=m) for seed, m in enumerate((49.9, 50.0, 80.0, None))]
    head, row = (line.split() for line in table(records, [AS_IT_IS]).splitlines())
    assert " ".join(head[-15:-5]) == "too near a vessel least m tacks replans time s"
    assert row[-6:-4] == ["1", "49.9"]
    assert "- - 3 7 100 1" in " ".join(table([records[3]], [AS_IT_IS]).split())


@given(st.lists(st.floats(0.5, 2.0), min_size=1, max_size=30))
@settings(max_examples=40)
def test_the_interval_holds_the_mean_and_lies_within_what_was_seen(shares):
    middle, low, high = interval(shares)
    assert min(shares) - 1e-9 <= low <= middle + 1e-9
    assert middle - 1e-9 <= high <= max(shares) + 1e-9


def test_what_is_no_variation_is_one_line_that_names_them(capsys):
    assert cli.main(["ablate", "--only", "no wind"]) == 2
    err = capsys.readouterr().err
    assert err.count("\n") == 1
    assert "kalman" in err


def test_a_voyage_of_each_is_sailed_and_written(tmp_path, capsys):
    out = tmp_path / "a.jsonl"
    words = ["ablate", str(UPWIND), "--only", "no spread", "--runs", "1", "--workers", "1", "--out", str(out)]
    assert cli.main(words) == 0
    printed = capsys.readouterr().out
    first = out.read_text()
    head, *lines = map(json.loads, first.splitlines())
    assert head["campaign"] == "ablate"
    assert [line["key"]["variation"] for line in lines] == [AS_IT_IS, "no spread"]
    assert "1/1" in printed
    out.write_text(first[:-20])  # interrupted in a line: what was sailed before it is not sailed again
    assert cli.main(words) == 0
    assert out.read_text() == first
    assert capsys.readouterr().out == printed
