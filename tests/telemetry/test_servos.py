"""Rudder and sheet counted: by hand, and on a voyage of the simulated autopilot."""

import json
from pathlib import Path

from companion import cli
from companion.clock import run_virtual
from companion.telemetry.folder.records import Servos
from sitl.run.embedded import run_embedded
from sitl.scenario.scenario import load_scenario


def moved(*looks):
    servos = Servos()
    for look in looks:
        servos.take(look)
    return servos.to_dict()


def test_a_run_is_one_movement_and_turning_back_another():
    rudder = moved((1500,), (1550,), (1600,), (1540,), (1540,), (1500,))
    assert rudder == {"1": {"movements": 3, "travel_us": 50 + 50 + 60 + 40}}


def test_dither_is_no_movement_and_a_slow_creep_is():
    assert moved((1500,), (1505,), (1496,), (1503,)) == {}
    assert moved((1500,), (1506,), (1512,), (1518,), (1524,))["1"]["travel_us"] == 24


def test_what_is_not_told_is_not_counted():
    assert moved((), (1500, 0, 1500), (), (1500, 0, 1500)) == {}
    assert moved((1500, 0, 1000), (0, 0, 1100), (1900, 0, 1100)) == {
        "1": {"movements": 1, "travel_us": 400},
        "3": {"movements": 1, "travel_us": 100},
    }


def test_a_voyage_tells_rudder_and_sheet_in_its_summary_and_in_words(tmp_path, capsys):
    path = Path("sitl/scenarios/upwind.toml")
    assert run_virtual(run_embedded(load_scenario(path), path, 0, tmp_path)).passed
    servos = json.loads((tmp_path / "summary.json").read_text())["servos"]
    assert set(servos) == {"1", "4"}  # SERVO1_FUNCTION 26, SERVO4_FUNCTION 89; the throttle rests
    assert all(servo["movements"] > 0 and servo["travel_us"] >= 10 for servo in servos.values())
    assert cli.main(["report", str(tmp_path)]) == 0
    told = capsys.readouterr().out
    assert "Servos moved: output 1, " in told
    assert "\nSpeed made good to windward: " in told
    assert "started" not in told
    decisions = tmp_path / "decisions.jsonl"
    records = [json.loads(line) for line in decisions.read_text().splitlines()]
    start, plans = next(r for r in records if r["kind"] == "start"), [r for r in records if r["kind"] == "plan"]
    with decisions.open("a") as file:
        file.write(json.dumps({**start, "t_s": plans[-1]["t_s"]}) + "\n")
    assert cli.main(["report", str(tmp_path)]) == 0
    told = capsys.readouterr().out
    after_s = plans[-1]["t_s"] - start["t_s"]
    assert "started twice: picture and track are of all of it" in told
    assert f"of the last start, {after_s:.0f} s after the first" in told
    assert "\n1 plan made, by" in told
    summary = json.loads((tmp_path / "summary.json").read_text())
    (tmp_path / "summary.json").write_text(json.dumps({**summary, "plans": 3, "records_dropped": 40}))
    assert cli.main(["report", str(tmp_path)]) == 0
    assert "\n3 plans made, 1 of them recorded, by reason: " in capsys.readouterr().out  # the disk was full
