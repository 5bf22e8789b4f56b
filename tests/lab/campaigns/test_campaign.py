"""A campaign's words: a line a voyage, a row a setting, two settings compared seed by seed. Nothing is sailed here."""

from pathlib import Path

import pytest

from companion.errors import InputError
from lab.campaigns.campaign import campaign
from sitl.runner import SCENARIO_FOLDER, CampaignResults, made_by
from sitl.runner.result_store import StoredResults

DEMO = SCENARIO_FOLDER / "demo.toml"


def record(scenario, seed, time_s):
    return {
        "scenario": scenario,
        "seed": seed,
        "passed": True,
        "checks": [],
        "figures": {
            "arrived": True,
            "contacts": 0,
            "time_s": time_s,
            "distance_m": 277.3,
            "tacks": 1,
            "replans": 2,
            "min_clearance_m": 18.17,
            "promised_clearance_m": 15.2,
            "promised_risk": 0.1,
            "no_go_entries": 0,
            "silence_s": 1.0,
        },
    }


def copied(folder, name, text=None):
    path = folder / name
    path.parent.mkdir(exist_ok=True)
    path.write_text((text or DEMO.read_text()).replace("../../missions", str(Path("missions").absolute())))
    return path


def summary(paths, records):
    return campaign(paths, runs=3).sum_up(
        CampaignResults(
            records=records,
            held=StoredResults(campaign="campaign", by=made_by()),
            lost=[],
            now=0,
            wall_s=1.0,
            cpu_s=1.0,
        )
    )


def test_a_voyage_is_a_line():
    experiment = campaign([DEMO], runs=1)
    assert experiment.line(record("demo", 3, 111.7)) == (
        "PASSED  demo seed 3: 112 s, 277 m and 1 tack by the true track, from arming to the run's end, "
        "2 replans, clearance 18.2 m "
        "(promised 15.2 m)"
    )
    broken = {
        "scenario": "demo",
        "seed": 3,
        "passed": False,
        "figures": {},
        "checks": [{"name": "no unhandled error", "passed": False, "figure": "OSError()", "required": []}],
    }
    assert experiment.line(broken) == "FAILED  demo seed 3: no unhandled error: OSError()"


def test_a_copy_that_kept_its_name_is_a_setting_of_its_own_and_two_are_compared(tmp_path):
    faster = copied(tmp_path, "faster.toml")
    records = [
        record(name, seed, time_s * (1.0 + 0.01 * seed))
        for name, time_s in (("demo", 200.0), ("demo (faster)", 180.0))
        for seed in range(3)
    ]
    found = summary([DEMO, faster], records)
    assert [(row["scenario"], row["runs"]) for row in found.figures["table"]] == [("demo", 3), ("demo (faster)", 3)]
    at = found.lines.index("demo (first) and demo (faster) (second), seed by seed:")
    assert found.lines[at + 1] == "3 pairs, 0 of them the same in every figure"
    assert "x 0.900 (0.900 to 0.900)" in found.lines[at + 3]


def test_two_of_one_name_are_refused(tmp_path):
    with pytest.raises(InputError, match=r"demo \(mine\): is two of the scenarios"):
        campaign([copied(tmp_path / "a", "mine.toml"), copied(tmp_path / "b", "mine.toml")], runs=1)
