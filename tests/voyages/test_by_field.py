"""Voyages with field guidance under the virtual clock: the last resort, a second boat, a station; and their replays."""

import json
from pathlib import Path

import msgspec
import pytest

from companion.clock import run_virtual
from companion.geofence import load_mission
from companion.replay import replay
from sitl.run.embedded import run_embedded
from sitl.scenario.scenario import EventSpec, load_scenario

FOLDER = Path("sitl/scenarios")
LAST_RESORT = FOLDER / "last-resort.toml"


def sail(path, seed, out, scenario=None):
    return run_virtual(run_embedded(scenario or load_scenario(path), path, seed, out))


def failed(verdict):
    return [(c.name, c.figure, c.required) for c in verdict.checks if not c.passed]


def decisions(out):
    return [json.loads(line) for line in (out / "decisions.jsonl").read_text().splitlines()]


def test_the_last_resort_is_named_in_the_record_and_the_voyage_replays(tmp_path):
    verdict = sail(LAST_RESORT, 0, tmp_path)
    assert verdict.passed, failed(verdict)
    records = decisions(tmp_path)
    phases = [d["phase"] for d in records if d["kind"] == "phase"]
    assert phases.count("last resort") == 1
    modes = [d["mode"] for d in records if d.get("action") == "SetMode"]
    assert modes == [10, 15, 10]  # AUTO, GUIDED, AUTO
    assert "operator" not in phases
    assert not replay(tmp_path).differences


@pytest.mark.parametrize(("bearing_deg", "gap_m"), [(0.0, 100.0), (-60.0, 60.0), (110.0, 80.0)])
def test_intruders_from_other_sides(tmp_path, bearing_deg, gap_m):
    scenario = load_scenario(LAST_RESORT)
    event = msgspec.structs.replace(scenario.events[0], bearing_deg=bearing_deg, gap_m=gap_m)
    expect = msgspec.structs.replace(scenario.expect, alerts=())  # astern there may be time for a plan
    verdict = sail(LAST_RESORT, 1, tmp_path, msgspec.structs.replace(scenario, events=(event,), expect=expect))
    assert verdict.passed, failed(verdict)


def test_without_permission_nothing_is_steered(tmp_path):
    text = Path("sitl/missions/intruder.toml").read_text()
    assert "guided = true" in text
    (tmp_path / "m.toml").write_text(text.replace("guided = true", "guided = false"))
    scenario = msgspec.structs.replace(load_scenario(LAST_RESORT), mission="m.toml")
    verdict = sail(tmp_path / "s.toml", 0, tmp_path / "out", scenario)
    records = decisions(tmp_path / "out")
    assert not any(d.get("action") == "SteerHeading" for d in records)
    assert any(d.get("code") == "no last resort" for d in records)
    assert "distance to vessels, m" in [name for name, *_ in failed(verdict)]


def test_two_boats_that_do_not_look_meet(tmp_path):
    """The scene is one: on the same line, and ours without the radio, they come near."""
    scenario = load_scenario(FOLDER / "two-boats.toml")
    mission = load_mission(FOLDER / scenario.mission)
    assert mission.traffic.feeds
    text = Path("sitl/missions/intruder.toml").read_text().replace('feeds = ["udpin:127.0.0.1:47013"]', "feeds = []")
    (tmp_path / "m.toml").write_text(text)
    blind = sail(tmp_path / "s.toml", 0, tmp_path / "out", msgspec.structs.replace(scenario, mission="m.toml"))
    seeing = sail(FOLDER / "two-boats.toml", 0, tmp_path / "seeing")
    assert seeing.passed, failed(seeing)
    near = blind.figures["vessel_distances_m"]["211000001"]
    assert near < 60.0 < seeing.figures["vessel_distances_m"]["211000001"]
    assert near > 8.0  # the other boat looks


def test_killed_in_the_middle_of_it_the_companion_takes_the_boat_back_to_auto(tmp_path):
    scenario = load_scenario(LAST_RESORT)
    kill = EventSpec(at_s=126.0, kind="kill_companion", restart_after_s=4.0)
    expect = msgspec.structs.replace(scenario.expect, alerts=(), max_silence_s=None)
    verdict = sail(
        LAST_RESORT, 0, tmp_path, msgspec.structs.replace(scenario, events=(*scenario.events, kill), expect=expect)
    )
    assert verdict.passed, failed(verdict)


def test_killed_on_a_field_of_its_own_the_companion_goes_on_with_it_and_its_time(tmp_path):
    path = FOLDER / "field-ring.toml"
    scenario = load_scenario(path)
    kill = EventSpec(at_s=150.0, kind="kill_companion", restart_after_s=8.0)
    expect = msgspec.structs.replace(scenario.expect, max_silence_s=None)
    verdict = sail(path, 0, tmp_path, msgspec.structs.replace(scenario, events=(kill,), expect=expect))
    assert verdict.passed, failed(verdict)
    texts = [d.get("text", "") for d in decisions(tmp_path)]
    assert sum("The ring: steered by ring + islet" in t for t in texts) == 2
    assert sum("her time is over after 420 s by field" in t for t in texts) == 1
