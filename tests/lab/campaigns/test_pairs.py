"""Sailors held against one another, seed by seed; the winds and parameters that they are given."""

import pytest

from lab.campaigns.baselines import NAMES, Sailor, key_of, pairs, scenario_of
from lab.commands.baselines import SAILORS
from sitl import cli
from sitl.runner import SCENARIO_FOLDER, Job
from sitl.scenario import load_scenario

BEAT = SCENARIO_FOLDER / "figures" / "beat-500.toml"


def record(who, seed, time_s, **more):
    return {
        "who": who,
        "scenario": "a",
        "seed": seed,
        "arrived": True,
        "contacts": 0,
        "time_s": time_s,
        "tacks": 3,
        **more,
    }


def job_of(who, wind=None):
    return Job(scenario=BEAT, seed=0, case=Sailor(who=who, speedup=1.0, wind=wind))


def test_the_command_knows_the_sailors_that_there_are():
    assert set(SAILORS) == set(NAMES)


def test_only_clean_pairs_of_a_seed_count():
    records = [
        record("alone", 0, 100.0, best_s=90.0),
        record("alone", 1, 200.0, best_s=180.0),
        record("alone", 2, 100.0, best_s=90.0),
        record("alone", 3, 1.0, best_s=1.0),
        record("she", 0, 95.0),
        record("she", 1, 204.0),
        record("she", 2, 50.0, contacts=1),
        {**record("she", 4, 1.0)},
    ]
    (row,) = pairs(records, "alone").splitlines()[2:]
    cells = [cell.strip() for cell in row.strip("|").split("|")]
    assert cells[:5] == ["a", "she", "2 of 3", "150", "150"]
    assert cells[5] == "-0.3"  # 149.5 of 150
    assert cells[6].startswith("-1.6 (")  # the root of 0.95 * 1.02
    assert cells[7:] == ["+2.0", "3", "3"]  # of 30 s that were possible 5 less 4


def test_a_sailor_without_a_clean_pair_has_no_figures():
    (row,) = pairs([record("alone", 0, 100.0), record("she", 0, None, arrived=False)], "alone").splitlines()[2:]
    assert row.startswith("| a | she | 0 of 1 | - |")


def test_another_wind_is_another_scenario():
    job = job_of("shifts", (18.6, 120.0))
    wind = scenario_of(job).wind
    assert (wind.model, wind.sd_deg, wind.tau_s, wind.tws_mps) == ("ou", 18.6, 120.0, 5.0)
    steady = scenario_of(job_of("shifts", (0.0, 60.0)))
    assert steady.wind.model == "constant"
    assert len({scenario_of(job).name, steady.name, load_scenario(BEAT).name}) == 3
    assert key_of(job)["scenario"] == scenario_of(job).name


@pytest.mark.parametrize("who", NAMES)
def test_who_does_not_tack_on_the_shifts_has_the_parameters_for_that(who):
    corridor_m = scenario_of(job_of(who)).parameters["SAIL_XTRACK_MAX"]
    assert (corridor_m == 30.0) == (who in {"no-shifts", "alone-embedded", "alone", "dijkstra"})


@pytest.mark.parametrize("wind", ["9", "a,b", "-1,28", "9,0", "9,28,1", "calm"])
def test_what_is_no_wind_is_refused(wind, capsys):
    assert cli.main(["baselines", "--scenarios", str(BEAT), "--winds", wind]) == 2
    assert "--winds" in capsys.readouterr().err


def test_by_the_shifts_she_is_held_against_ardurover_alone(tmp_path, capsys):
    argv = [
        "baselines",
        "--who",
        "shifts",
        "alone-embedded",
        "--seeds",
        "1",
        "--scenarios",
        str(BEAT),
        "--winds",
        "9,28",
        "--against",
        "alone-embedded",
        "--out",
        str(tmp_path / "b.jsonl"),
    ]
    assert cli.main(argv) == 0
    said = capsys.readouterr().out
    (row,) = [
        line
        for line in said.splitlines()
        if line.startswith("| beat-500, 9°, 28 s | companion, by shifts | 1 |") and "(" in line
    ]
    assert float(row.split("|")[6]) < 0.0
