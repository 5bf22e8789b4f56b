"""Whole voyages in which the wind dies: the companion, real MAVLink and the simulated boat in a current."""

import json
from pathlib import Path

import msgspec

from companion.clock import run_virtual
from sitl.run.embedded import run_embedded
from sitl.scenario.scenario import load_scenario

ADRIFT = Path("sitl/scenarios/calm-adrift.toml")


def sail(tmp_path, *, mission_text=lambda text: text, **changes):
    """Sail ``calm-adrift`` changed, with a mission changed; return its verdict and what was decided."""
    for name in ("archipelago.wkt", "archipelago-shore.wkt"):
        (tmp_path / name).write_text((Path("missions") / name).read_text())
    (tmp_path / "mission.toml").write_text(mission_text(Path("missions/archipelago.toml").read_text()))
    scenario = msgspec.structs.replace(load_scenario(ADRIFT), mission="mission.toml", **changes)
    verdict = run_virtual(run_embedded(scenario, tmp_path / "s.toml", 0, tmp_path / "v"))
    return verdict, [json.loads(line) for line in (tmp_path / "v" / "decisions.jsonl").read_text().splitlines()]


def without_crew(**more):
    scenario = load_scenario(ADRIFT)
    events = tuple(e for e in scenario.events if e.kind != "crew")
    return {
        "events": events,
        "limit_s": 600.0,  # she is set onto the first island at 525 s
        "expect": msgspec.structs.replace(scenario.expect, arrived=None, contacts=99, called_s=120.0, **more),
    }


def test_with_nobody_on_board_she_touches_announced(tmp_path):
    verdict, decided = sail(tmp_path, **without_crew())
    assert verdict.passed, [c for c in verdict.checks if not c.passed]
    assert verdict.figures["contacts"] > 0  # there is nothing on board that could have held her
    calls = [d for d in decided if d.get("code") == "anchor"]
    assert "onto" in calls[-1]["text"]
    assert json.loads((tmp_path / "v" / "summary.json").read_text())["contacts"] > 0


def test_a_motor_holds_her_and_is_left_when_the_wind_is_back(tmp_path):
    scenario = load_scenario(ADRIFT)
    # a calm of eight minutes: that she drifts and is becalmed shows in the first three
    events = tuple(
        msgspec.structs.replace(e, for_s=500.0)
        if e.for_s == 1200.0
        else msgspec.structs.replace(e, at_s=600.0)
        if e.at_s == 1300.0
        else e
        for e in scenario.events
        if e.kind != "crew"
    )
    assert sum(e.for_s == 500.0 for e in events) == 2
    assert any(e.at_s == 600.0 for e in events)
    expect = msgspec.structs.replace(scenario.expect, alerts=("becalmed", "drifting"), min_clearance_m=1.0)
    verdict, decided = sail(
        tmp_path, mission_text=lambda text: f"{text}\n[boat]\nmotor = true\n", events=events, expect=expect
    )
    assert verdict.passed, [c for c in verdict.checks if not c.passed]
    assert [d["is_on"] for d in decided if d.get("action") == "RunMotor"] == [True, False]
