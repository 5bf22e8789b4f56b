"""A trial's legs: where they lie, how they turn, and where there is no room."""

import math
from pathlib import Path

import numpy as np
import pytest
import shapely

from companion.boat import trial_in
from companion.cli import main
from companion.geofence import load_mission


def trial(water, *, twd_deg=0.0, near=(0.0, 0.0), speed=1.0):
    return trial_in(water, near, twd_from_rad=math.radians(twd_deg), no_go_half_rad=math.radians(45.0), speed_mps=speed)


def angles(found, twd_deg):
    steps = np.diff(found.marks_en_m, axis=0)
    off = np.degrees(np.arctan2(steps[:, 0], steps[:, 1])) - twd_deg
    return (off + 180.0) % 360.0 - 180.0


@pytest.mark.parametrize("twd_deg", [0.0, 70.0, 213.0])
def test_six_tacks_a_reach_there_and_back_and_a_run_whatever_the_wind(twd_deg):
    found = trial(shapely.Point(0.0, 0.0).buffer(600.0), twd_deg=twd_deg)
    turned = angles(found, twd_deg)
    assert np.abs(turned[:7]) == pytest.approx(57.0)
    assert np.sum(np.diff(np.sign(turned[:7])) != 0) == 6
    assert turned[7:9] == pytest.approx([95.0, -95.0])
    assert np.abs(turned).max() == pytest.approx(155.0)
    assert np.abs(turned).min() >= 57.0 - 1e-9
    assert {np.sign(a) for a in turned if abs(a) > 150.0} == {1.0, -1.0}
    assert found.board_m == pytest.approx(90.0)
    up = np.array([math.sin(math.radians(twd_deg)), math.cos(math.radians(twd_deg))])
    assert abs(float((found.marks_en_m[-1] - found.marks_en_m[0]) @ up)) < 1.0  # no higher than it began


def test_every_leg_is_in_the_water_and_near_where_it_begins_from():
    water = shapely.box(-400.0, -300.0, 400.0, 300.0).difference(shapely.Point(0.0, 0.0).buffer(60.0))
    found = trial(water, near=(300.0, -250.0))
    assert water.buffer(0.01).covers(shapely.LineString(found.marks_en_m))
    other = trial(water, near=(-300.0, -250.0))
    assert other.marks_en_m[0, 0] < found.marks_en_m[0, 0]


def test_boards_are_shorter_where_there_is_little_room_and_there_is_none_where_there_is_too_little():
    assert 40.0 <= trial(shapely.box(0.0, 0.0, 200.0, 220.0)).board_m < 80.0
    assert trial(shapely.box(0.0, 0.0, 100.0, 100.0)) is None
    assert trial(shapely.Polygon()) is None


def test_a_mission_of_it_stands_beside_the_one_whose_water_it_takes(tmp_path, capsys):
    for name in ("lake.toml", "lake.wkt", "archipelago.toml", "archipelago.wkt", "archipelago-shore.wkt"):
        (tmp_path / name).write_bytes((Path("missions") / name).read_bytes())
    lake = tmp_path / "lake.toml"
    assert main(["boat", "trial", str(lake), "--from-deg", "0"]) == 0
    text = (tmp_path / "lake-trial.toml").read_text()
    assert text.count("[[goal]]") == 14
    assert 'fence = "lake.wkt"' in text
    assert "set_auto = true" in text
    assert main(["boat", "trial", str(lake)]) == 2
    assert "exists" in capsys.readouterr().err
    assert main(["mission", "check", str(tmp_path / "lake-trial.toml")]) == 0
    assert main(["boat", "trial", str(lake), "--from-deg", "240", "--force"]) == 0
    assert load_mission(tmp_path / "lake-trial.toml").wind.preview_from_deg == 240.0
    wide = (tmp_path / "archipelago.toml").read_text().replace("margin_m = 15.0", "margin_m = 40.0")
    (tmp_path / "archipelago.toml").write_text(wide)
    assert main(["boat", "trial", str(tmp_path / "archipelago.toml"), "--from-deg", "240"]) == 1
    assert "no room" in capsys.readouterr().err


def test_a_trial_of_another_folder_is_refused_and_one_named_by_the_missions_folder_is_written(tmp_path, capsys):
    """It ended in a ValueError of with_name."""
    for name in ("lake.toml", "lake.wkt"):
        (tmp_path / name).write_bytes((Path("missions") / name).read_bytes())
    (tmp_path / "elsewhere").mkdir()
    lake = tmp_path / "lake.toml"
    for out in (tmp_path / "elsewhere/t.toml", tmp_path):
        assert main(["boat", "trial", str(lake), "--from-deg", "0", "--out", str(out)]) == 2
        assert capsys.readouterr().err == (
            f"companion boat: --out: {out} is not in the folder of {lake}; name a file beside the mission\n"
        )
    assert main(["boat", "trial", str(lake), "--from-deg", "0", "--out", str(tmp_path / "t.toml")]) == 0
    assert main(["boat", "trial", str(lake), "--from-deg", "0", "--out", "u.toml"]) == 0
    assert (tmp_path / "t.toml").read_bytes() == (tmp_path / "u.toml").read_bytes()
