"""The clock of a board without a battery: wrong when it starts, set anew under way; the boat's own is GPS's."""

import random
import time

import msgspec

from companion.clock import run_virtual
from companion.replay import replay
from companion.telemetry.folder.recorder import read_jsonl
from lab.campaigns.faults import BASE
from sitl.run.embedded import run_embedded
from sitl.scenario.scenario import EventSpec, ExpectSpec, WindSpec, load_scenario

YEAR_S = 365.0 * 86_400.0


def sail(folder, *events):
    scenario = msgspec.structs.replace(
        load_scenario(BASE),
        limit_s=400.0,
        wind=WindSpec(sd_deg=6.0, tws_mps=5.0),
        events=events,
        expect=ExpectSpec(arrived=True, min_clearance_m=2.0),
    )
    return run_virtual(run_embedded(scenario, BASE, 1, folder, expansions=4_000))


def test_started_again_a_year_ago_she_sails_on_and_the_record_says_what_time_it_is(tmp_path):
    verdict = sail(tmp_path, EventSpec(at_s=70.0, kind="kill_companion", restart_after_s=4.0, clock_step_s=-YEAR_S))
    assert verdict.passed, verdict.checks
    records = read_jsonl(tmp_path / "decisions.jsonl")
    starts = [n for n, r in enumerate(records) if r["kind"] == "start"]
    assert "adopted" in [r.get("code") for r in records[starts[1] :] if r.get("action") == "Announce"]
    told = [r for r in records if r["kind"] == "clock"]
    assert len(told) == 1
    assert records.index(told[0]) > starts[1]
    assert abs(told[0]["behind_s"] - YEAR_S) < 1.0
    assert "behind" in told[0]["text"]
    assert not replay(tmp_path).differences


def test_a_clock_that_jumps_by_years_all_the_time_changes_nothing(tmp_path, monkeypatch):
    sail(tmp_path / "quiet")
    rng = random.Random(4)
    monkeypatch.setattr(time, "time", lambda: rng.uniform(0.0, 4e9))
    assert sail(tmp_path / "jumps").passed
    for name in ("track.csv", "telemetry.tlog"):
        assert (tmp_path / "jumps" / name).read_bytes() == (tmp_path / "quiet" / name).read_bytes(), name
