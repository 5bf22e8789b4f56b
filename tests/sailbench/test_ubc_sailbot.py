"""UBC Sailbot's test plans: their wind flows towards, their route begins at its end, their speeds are km/h."""

import math

import pytest

from companion.errors import InputError
from companion.geofence import load_mission
from sailbench.ubc_sailbot import converted, from_deg, main, plans_of, table
from sitl.scenario import load_scenario

PLAN = """
tw_dir_deg: 270
tw_speed_kmph: 18.0
heading_deg: -90.0
gps: {latitude: 49.0, longitude: -123.0, speed_kmph: 8.0}
ais:
  - {id: 1, lat: 49.01, lon: -123.0, heading: -45.0, speed: 7.2, rot: 0, width: 2.0, height: 60.0}
  - {id: 2, lat: 49.02, lon: -123.0, heading: 360.0, speed: 7.2, rot: 0, width: 2.0, height: 6.0}
land:
  - [[-123.10, 49.01], [-123.09, 49.01], [-123.09, 49.02]]
global_path:
  waypoints:
    - {latitude: 49.0, longitude: -123.2}
    - {latitude: 49.0, longitude: -123.1}
    - {latitude: 49.0, longitude: -123.001}
events:
  mock_wind_sensor:
    - {timestamp: 30.0, direction_deg: -60, speed_kmph: 36.0}
    - {timestamp: 60.0, direction_deg: -90, speed_kmph: 18.0}
  mock_gps:
    - {timestamp: 15.0, publish_heading: false}
    - {timestamp: 20.0, use_ocean_drift: true, ocean_drift_speed_kmph: 3.6, ocean_drift_dir_deg: -90.0}
    - {timestamp: 50.0, use_ocean_drift: false}
"""


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "tack.yaml").write_text(PLAN)
    (tmp_path / "ships_only.yaml").write_text("ais: []\n")
    return tmp_path


@pytest.mark.parametrize(("flows_to", "comes_from"), [(0, 180.0), (270, 90.0), (-90, 90.0), (180, 0.0), (145, 325.0)])
def test_a_wind_that_flows_to_a_direction_comes_from_the_other(flows_to, comes_from):
    assert from_deg(flows_to) == comes_from


def test_a_plan_becomes_a_mission_and_a_scenario_that_ours_read(folder, tmp_path, capsys):
    (plan,) = plans_of(folder)
    assert capsys.readouterr().err == "ships_only: has no start or no route; it is no voyage: leave it out\n"
    path = plan.write(tmp_path / "out")
    scenario, mission = load_scenario(path), load_mission(tmp_path / "out" / "tack.toml")
    assert (scenario.wind.from_deg, scenario.wind.tws_mps, scenario.limit_s) == (90.0, pytest.approx(5.0), 7200.0)
    assert [goal.point.lon_deg for goal in mission.goals] == [-123.1, -123.2]  # the first is where she begins
    assert {goal.radius_m for goal in mission.goals} == {300.0}
    assert mission.options.start.heading_deg == 270.0
    assert len(mission.area.solids) == 1
    ship, still = (e for e in scenario.events if e.kind == "vessel")
    assert (ship.course_deg, ship.sog_mps, ship.length_m) == (315.0, pytest.approx(2.0), 60.0)
    assert (ship.east_m, ship.north_m) == (pytest.approx(0.0, abs=0.1), pytest.approx(1112.0, abs=2.0))
    assert still.sog_mps == 0.0
    shifts = [(e.at_s, e.veer_deg) for e in scenario.events if e.kind == "wind_shift"]
    assert shifts == [(30.0, pytest.approx(30.0)), (60.0, pytest.approx(-30.0))]
    assert [e.tws_mps for e in scenario.events if e.kind == "wind_speed"] == pytest.approx([10.0, 5.0])
    (drift,) = (e for e in scenario.events if e.kind == "current")
    assert (drift.at_s, drift.for_s, drift.set_deg, drift.drift_mps) == (20.0, 30.0, 270.0, pytest.approx(1.0))
    assert plan.left_out == (
        "the heading falls silent: ArduRover's comes with its position",
        "ship 2 has no course: she lies still",
    )


def test_a_long_route_is_a_passage():
    def plan(lon_deg):
        return converted(
            {
                "gps": {"latitude": 49.0, "longitude": -123.0},
                "heading_deg": 0.0,
                "tw_dir_deg": 0,
                "tw_speed_kmph": 10.0,
                "global_path": {"waypoints": [{"latitude": 49.0, "longitude": lon_deg}] * 2},
            },
            "far",
        )

    assert "passage" not in plan(-123.5).mission
    assert plan(-124.0).mission["passage"]["leg_m"] == pytest.approx(1.1 * 73_170.0, rel=0.01)


@pytest.mark.parametrize("text", [PLAN.replace("latitude", "lat"), "[1, 2]\n", "a: [\n"])
def test_what_is_no_plan_is_one_line(tmp_path, capsys, text):
    (tmp_path / "a.yaml").write_text(text)
    assert main([str(tmp_path)]) == 2
    told = capsys.readouterr().err
    assert told.startswith(f"sailbench: {tmp_path / 'a.yaml'}: is no test plan of theirs (")
    assert told.count("\n") == 1


def test_an_empty_folder_is_one_line(tmp_path, capsys):
    assert main([str(tmp_path)]) == 2
    assert "holds no .yaml" in capsys.readouterr().err
    with pytest.raises(InputError):
        converted({}, "empty")


def test_a_voyage_is_sailed_once_and_told(folder, tmp_path, capsys):
    (folder / "ashore.yaml").write_text(
        PLAN.replace("-123.10, 49.01", "-122.9, 48.9")
        .replace("-123.09, 49.01", "-123.2, 48.9")
        .replace("-123.09, 49.02", "-123.0, 49.2")
    )
    words = [str(folder), "--hours", "0.05", "--out", str(tmp_path / "out")]
    assert main(words) == 0
    first = capsys.readouterr().out
    assert main(words) == 0
    assert capsys.readouterr().out == first
    rows = [line.split(" | ") for line in first.splitlines()[2:]]
    assert [row[0] for row in rows] == ["| `ashore`", "| `tack`"]
    refused, sailed = rows
    assert refused[1] == "refused"
    assert "inside the obstacle" in refused[-1]
    assert sailed[1:3] == ["no", "0 of 2"]
    assert 0.0 < float(sailed[4]) < 1.0
    assert math.isclose(float(sailed[5]), 14.6, abs_tol=1.0)
    assert table([]).count("\n") == 1
