"""Whole voyages under the virtual clock: real MAVLink bytes between companion and simulated autopilot."""

import json
import shutil
from pathlib import Path

import pytest

from companion import cli
from companion.clock import run_virtual
from companion.plots.voyage import plot_voyage
from companion.replay import replay
from companion.telemetry.folder.reading import read_voyage
from sitl.run.embedded import run_embedded
from sitl.scenario.scenario import EventSpec, ExpectSpec, Scenario, WindSpec, load_scenario
from tests.one_mark import one_mark

SHORT_MISSION = one_mark("short", (50.8181, -1.3100000), 60.0).replace(
    "[operator]", "[risk]\ndelta_s = 0.85\n[operator]"
)
# A rock right between the boat and the mark, 30 m wide.
ROCK = "rock|exclusion|POLYGON ((-1.3102 50.8175, -1.3098 50.8175, -1.3098 50.8177, -1.3102 50.8177, -1.3102 50.8175))"


@pytest.fixture(scope="module")
def short(tmp_path_factory):
    folder = tmp_path_factory.mktemp("short")
    (folder / "mission.toml").write_text(SHORT_MISSION)
    (folder / "rock.wkt").write_text(ROCK)
    return folder


def sail(short, out, seed=1, events=(), expect=None, limit_s=600.0, expansions=6000, **wind):
    scenario = Scenario(
        name="short",
        mission="mission.toml",
        limit_s=limit_s,
        events=tuple(events),
        wind=WindSpec(**{"sd_deg": 6.0, "tws_mps": 5.0, **wind}),
        expect=expect or ExpectSpec(min_clearance_m=2.0),
    )
    return run_virtual(run_embedded(scenario, short / "scenario.toml", seed, out, expansions=expansions))


@pytest.fixture(scope="module")
def voyage(short, tmp_path_factory):
    out = tmp_path_factory.mktemp("voyage")
    return sail(short, out), out


def decisions(out):
    return [json.loads(line) for line in (out / "decisions.jsonl").read_text().splitlines()]


def test_the_boat_reaches_a_mark_dead_upwind_behind_a_rock(voyage):
    verdict, out = voyage
    assert verdict.passed, [c for c in verdict.checks if not c.passed]
    assert verdict.figures["tacks"] >= 1
    summary = json.loads((out / "summary.json").read_text())
    assert summary["arrived"] is True
    assert summary["contacts"] == 0
    assert summary["replans"] >= 1
    assert summary["promised_to"] == "mark"
    for key in ("time_s", "distance_m", "tacks", "min_clearance_m", "promised_risk", "no_go_entries", "end_reason"):
        assert summary[key] is not None, key


def test_every_mission_on_board_ended_safely(voyage):
    uploads = [d for d in decisions(voyage[1]) if d.get("action") == "UploadMission"]
    assert uploads
    assert all(d["items"][-1][0] in {17, 20} for d in uploads)


def test_the_same_seed_sails_the_same_bytes(short, voyage, tmp_path):
    _, first = voyage
    sail(short, tmp_path)
    for name in ("telemetry.tlog", "track.csv"):
        assert (tmp_path / name).read_bytes() == (first / name).read_bytes(), name
    timeless = [
        [{k: v for k, v in d.items() if k != "plan"} for d in decisions(folder)] for folder in (tmp_path, first)
    ]
    assert timeless[0] == timeless[1]


def test_another_seed_sails_another_voyage(short, voyage, tmp_path):
    sail(short, tmp_path, seed=2)
    assert (tmp_path / "telemetry.tlog").read_bytes() != (voyage[1] / "telemetry.tlog").read_bytes()


def test_a_recorded_voyage_replays_exactly(voyage):
    report = replay(voyage[1])
    assert report.steps > 60
    assert report.actions > 5
    assert not report.differences


def test_a_changed_record_does_not_replay(voyage, tmp_path):
    shutil.copytree(voyage[1], tmp_path, dirs_exist_ok=True)
    lines = (tmp_path / "decisions.jsonl").read_text().splitlines()
    kept = [line for line in lines if '"action":"UploadMission"' not in line]
    assert len(kept) < len(lines)
    (tmp_path / "decisions.jsonl").write_text("\n".join(kept) + "\n")
    assert replay(tmp_path).differences


def test_an_empty_telemetry_log_is_called_one_and_a_short_one_is_mentioned(voyage, tmp_path, capsys):
    """Every step differed, and nothing said why."""
    folder, log = tmp_path / "v", tmp_path / "v" / "telemetry.tlog"
    shutil.copytree(voyage[1], folder)
    whole = log.read_bytes()
    log.write_bytes(b"")
    assert cli.main(["replay", str(folder)]) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.startswith(f"companion replay: {log}: is empty, and the steps heard ")
    log.write_bytes(whole[: len(whole) // 2])
    assert cli.main(["replay", str(folder)]) == 1
    assert "that the steps heard were not found in the telemetry log" in capsys.readouterr().out
    assert replay(voyage[1]).lost == 0


def test_the_picture_is_drawn(voyage, tmp_path):
    plot_voyage(read_voyage(voyage[1]), tmp_path / "v.png")
    assert (tmp_path / "v.png").stat().st_size > 50_000


def test_an_operator_takes_the_boat_and_gives_it_back(short, tmp_path):
    verdict = sail(
        short,
        tmp_path,
        events=[EventSpec(at_s=50.0, kind="mode", mode="HOLD"), EventSpec(at_s=80.0, kind="mode", mode="AUTO")],
    )
    assert verdict.passed, verdict.checks
    acted = [
        d
        for d in decisions(tmp_path)
        if 53.0 < d["t_s"] < 80.0 and d.get("action") in {"SetMode", "Arm", "UploadMission", "SetCurrent"}
    ]
    assert not acted
    phases = [d["phase"] for d in decisions(tmp_path) if d["kind"] == "phase"]
    assert "operator" in phases


def test_a_killed_companion_takes_its_mission_over(short, tmp_path):
    verdict = sail(short, tmp_path, events=[EventSpec(at_s=60.0, kind="kill_companion", restart_after_s=5.0)])
    assert verdict.passed, verdict.checks
    starts = [d for d in decisions(tmp_path) if d["kind"] == "start"]
    assert len(starts) == 2
    assert starts[1]["persisted"]["route"]
    said = [d.get("code") for d in decisions(tmp_path) if d.get("action") == "Announce"]
    assert "adopted" in said
    assert not replay(tmp_path).differences


@pytest.mark.parametrize("allowed", [False, True])
def test_a_strangers_mission_at_the_start_is_replaced_where_the_mission_file_allows_it(allowed, short, tmp_path):
    """The permission existed, and no key of the mission gave it."""
    (tmp_path / "rock.wkt").write_text(ROCK)
    (tmp_path / "mission.toml").write_text(SHORT_MISSION + f"replace_foreign = {str(allowed).lower()}\n")
    verdict = sail(
        tmp_path,
        tmp_path / "v",
        limit_s=400.0 if allowed else 60.0,
        events=[EventSpec(at_s=0.5, kind="foreign_mission", east_m=60.0, north_m=80.0)],
    )
    summary = json.loads((tmp_path / "v/summary.json").read_text())
    assert summary["arrived"] is allowed, verdict.checks
    assert allowed or "[operator] replace_foreign" in summary["end_why"]


def test_a_silent_link_leaves_the_boat_sailing(short, tmp_path):
    verdict = sail(short, tmp_path, events=[EventSpec(at_s=50.0, kind="link_cut", for_s=25.0)])
    assert verdict.passed, verdict.checks


def test_a_dead_autopilot_is_a_link_error_and_a_verdict(short, tmp_path):
    verdict = sail(short, tmp_path, events=[EventSpec(at_s=0.0, kind="link_cut")], limit_s=60.0)
    assert not verdict.passed
    assert any("no autopilot" in str(c.figure) for c in verdict.checks if c.name == "no unhandled error")


def test_the_demo_scenario_is_what_make_demo_sails():
    scenario = load_scenario(Path("sitl/scenarios/demo.toml"))
    assert "sitl/scenarios/demo.toml --live" in Path("Makefile").read_text()
    assert scenario.expect.contacts == 0
