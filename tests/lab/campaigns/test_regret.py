"""Regret end to end, and which scenarios have none."""

import json

import pytest

from companion.errors import InputError
from lab.campaigns.baselines import SCENARIOS
from lab.campaigns.regret import as_text, figures_of, require_judged
from sitl import cli
from sitl.runner import SCENARIO_FOLDER


def record(seed, time_s, who="companion", **more):
    return {
        "who": who,
        "scenario": "demo",
        "seed": seed,
        "contacts": 0,
        "time_s": time_s,
        "tacks": 3,
        "best_s": 100.0,
        "bound_s": 98.0,
        "coarser_s": 101.0,
        "best_tacks": 2,
        **more,
    }


def test_only_clean_arrivals_count():
    missed = {"who": "companion", "scenario": "demo", "seed": 3, "contacts": 0, "time_s": None, "tacks": 9}
    records = [record(0, 110.0), record(1, 120.0), record(2, 90.0, contacts=1), missed, record(0, 130.0, "fixed plan")]
    rows = figures_of(records)
    assert [(r["sailor"], r["runs"], r["clean"]) for r in rows] == [("companion", 4, 2), ("fixed plan", 1, 1)]
    assert rows[0]["regret"] == pytest.approx(0.15)
    assert (rows[0]["regret_10"], rows[0]["regret_90"]) == pytest.approx((0.1, 0.2))
    assert rows[0]["gap"] == pytest.approx(100.0 / 98.0 - 1.0)
    assert "| demo | companion | 4 | 2 | 115 | 3 | - | - | 100 | 2 | 15.0 | 10.0 | 20.0 | 2.0 | 1.00 |" in as_text(
        records
    )


@pytest.mark.parametrize("path", SCENARIOS, ids=lambda p: p.stem)
def test_the_six_are_judged(path):
    require_judged(path)


@pytest.mark.parametrize("name", ["current-across", "buoy-course", "gates", "tide-and-lee", "search"])
def test_what_the_clairvoyant_cannot_sail_is_refused(name):
    with pytest.raises(InputError, match="the best time is known for"):
        require_judged(SCENARIO_FOLDER / f"{name}.toml")


def test_a_voyage_is_held_against_the_best_and_drawn(tmp_path, capsys):
    out, picture = tmp_path / "regret.json", tmp_path / "regret.png"
    argv = [
        "regret",
        "--who",
        "alone-embedded",
        "--seeds",
        "1",
        "--scenarios",
        str(SCENARIO_FOLDER / "upwind.toml"),
        "--json",
        str(out),
        "--plot",
        str(picture),
    ]
    assert cli.main(argv) == 0
    (row,) = json.loads(out.read_text())
    assert row["sailor"] == "alone, embedded"
    assert 0.03 < row["regret"] < 0.2
    assert 0.0 <= row["gap"] < 0.02
    assert "| upwind | alone, embedded | 1 | 1 |" in capsys.readouterr().out
    assert picture.read_bytes()[:4] == b"\x89PNG"
