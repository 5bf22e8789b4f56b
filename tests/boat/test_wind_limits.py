"""Limits of wind on the command line: refused where they contradict, told by the check, kept by a plan on paper."""

import json

import pytest

from companion import cli
from companion.boat import Boat, ardurover_sitl

MISSION = """
[start]
lat = 50.8170
lon = -1.3100
[[goal]]
lat = 50.8203
lon = -1.3101
"""


@pytest.mark.parametrize(
    ("table", "place", "remedy"),
    [
        ("[boat]\nmax_tws_mps = 3.0\nmin_tws_mps = 4.0", "[boat] min_tws_mps", "smaller min_tws_mps"),
        ("[boat]\nmax_tws_mps = -1.0", "[boat] max_tws_mps", ""),
        ("[boat]\nmin_tws_mps = nan", "[boat] min_tws_mps", ""),
        ("[boat]\ntack_fails = 0.95", "[boat] tack_fails", ""),
        ("[boat]\ntack_fails = 'often'", "[boat] tack_fails", ""),
        ("[safety]\nstrong_wind = 'run'", "[safety] strong_wind", ""),
        ("[safety]\nlightwind = 'say'", "", "light_wind"),
        ("[boat]\npolar = 2.0\nmax_tws_mps = 9.0\n[autopilot]\nframe = 'motor'", "[boat] max_tws_mps", "leave it out"),
    ],
)
def test_each_key_is_refused_in_one_line_with_its_place(tmp_path, capsys, table, place, remedy):
    path = tmp_path / "m.toml"
    path.write_text(MISSION + table + "\n")
    assert cli.main(["mission", "check", str(path)]) == 2
    [line] = [text for text in capsys.readouterr().err.splitlines() if text.strip()]
    assert str(path) in line
    assert place in line
    assert remedy in line


def test_the_check_tells_the_winds_that_she_sails_in(tmp_path, capsys):
    path = tmp_path / "m.toml"
    path.write_text(MISSION + "[boat]\nmax_tws_mps = 9.0\n[safety]\nstrong_wind = 'stay'\n")
    assert cli.main(["mission", "check", str(path)]) == 0
    said = capsys.readouterr().out
    assert "more than 9 m/s of wind is forecast with over 10 %" in said
    assert "'stay' for strong wind" in said
    path.write_text(MISSION)
    assert cli.main(["mission", "check", str(path)]) == 0
    assert "m/s of wind" not in capsys.readouterr().out


def test_a_passage_is_told_of_the_circle(capsys):
    assert cli.main(["mission", "check", "sitl/missions/ocean.toml"]) == 0
    assert "FENCE_TYPE 4" in capsys.readouterr().out


@pytest.mark.parametrize(("tws", "code", "words"), [(5.0, 0, ""), (9.0, 1, "NOT to be sailed: more wind than 10 m/s")])
def test_a_plan_that_breaks_a_limit_is_said_not_to_be_sailed(tmp_path, capsys, tws, code, words):
    path = tmp_path / "p.json"
    boat = Boat(polar=ardurover_sitl(), max_tws_mps=10.0)
    path.write_text(
        json.dumps(
            {
                "start": {"x": 0, "y": 0, "heading_deg": 90},
                "goal": {"x": 300, "y": 0, "radius": 1},
                "obstacles": [],
                "wind": {
                    "from_deg": 0,
                    "speed_mps": tws,
                    "strength": {"horizon_s": [0], "mean_mps": [tws], "sigma_mps": [1.0]},
                },
                "boat": boat.problem_boat(tws) | {"speeds": boat.problem_speeds()},
                "delta_s": 0.9,
            }
        )
    )
    assert cli.main(["plan", str(path), "--expansions", "500"]) == code
    said = capsys.readouterr().out
    assert "In the wind's spread it arrives after" in said
    assert words in said
    assert cli.main(["plan", str(path), "--expansions", "500", "--json"]) == code
    assert set(json.loads(capsys.readouterr().out)["arrival"]) == {
        "p10_s",
        "p50_s",
        "p90_s",
        "over_max",
        "under_min",
        "doubts",
    }
