"""Shoals that a voyage found, written as obstacles."""

import json
from dataclasses import replace
from pathlib import Path

import pytest

from companion.cli import main
from companion.geofence import Circle, load_mission, read
from companion.skipper.step import Persisted
from companion.skipper.way.shoals import Shoal
from companion.telemetry.folder import STATE, VOYAGE

MISSION = "sitl/missions/shoaling.toml"
FOUND = Shoal(en_m=(10.0, 200.0), radius_m=20.0, doubt_m=7.0, depth_m=1.8)


def voyage(folder, *shoals):
    saved = Persisted(voyage="x", gate=0, sailing=True, route=None, pending=None, shoals=shoals)
    (folder / STATE).write_text(json.dumps(saved.to_dict()))
    return str(folder)


@pytest.mark.parametrize("ending", ["geojson", "wkt"])
def test_each_is_an_obstacle_with_the_doubt_about_it(tmp_path, ending, capsys):
    out = tmp_path / f"found.{ending}"
    assert main(["chart", "shoals", voyage(tmp_path, FOUND), str(out), "--mission", MISSION]) == 0
    assert "1 shoal, drawn with the doubt" in capsys.readouterr().out
    (zone,) = read(out).zones
    frame = load_mission(Path(MISSION)).frame()
    if isinstance(zone.shape, Circle):
        assert zone.shape.radius_m == pytest.approx(27.0, abs=0.01)
        assert frame.en_from_geo(zone.shape.center) == pytest.approx((10.0, 200.0), abs=0.01)
    assert "1.8 m" in zone.name


@pytest.mark.parametrize(("tide_m", "told"), [(1.5, "0.3 m below the chart"), (2.2, "-0.4 m below"), (None, "")])
def test_where_a_table_told_the_tide_its_depth_is_that_below_the_datum(tmp_path, tide_m, told):
    out = tmp_path / "found.geojson"
    shoal = replace(FOUND, tide_m=tide_m)
    assert main(["chart", "shoals", voyage(tmp_path, shoal), str(out), "--mission", MISSION]) == 0
    (zone,) = read(out).zones
    assert zone.name == "shoal 1: 1.8 m sounded" if not told else told in zone.name


def test_a_dry_run_and_a_voyage_whose_state_lies_beside_it_are_told_as_what_they_are(tmp_path, capsys):
    """ "Name a voyage's folder" was said of both."""
    out, folder = tmp_path / "found.geojson", tmp_path / "today"
    folder.mkdir()
    asked = ["chart", "shoals", str(folder), str(out), "--mission", MISSION]
    (folder / VOYAGE).write_text('[mission]\nname = "the bay"\n[run]\ndry_run = true\n')
    assert main(asked) == 2
    told = f"companion chart: {folder}: is of a dry run, which keeps no shoals; name a voyage that was sailed\n"
    assert capsys.readouterr().err == told
    (folder / VOYAGE).write_text('[mission]\nname = "the bay"\n[run]\ndry_run = false\n')
    assert main(asked) == 2
    assert "is a folder without state.json; name a voyage's folder" in capsys.readouterr().err
    (tmp_path / "the-bay.state.json").write_text("{}")
    assert main(asked) == 2
    beside = f"name {tmp_path / 'the-bay.state.json'}, which `companion run` keeps of the last voyage of the bay\n"
    assert capsys.readouterr().err == f"companion chart: {folder}: holds no state.json; {beside}"
    (folder / VOYAGE).write_text("mission = 3\n")
    assert main(asked) == 2
    assert "is not what a voyage records" in capsys.readouterr().err


def test_what_holds_none_or_is_no_state_is_one_line(tmp_path, capsys):
    out = tmp_path / "found.geojson"
    assert main(["chart", "shoals", voyage(tmp_path), str(out), "--mission", MISSION]) != 0
    assert "no shoal was found" in capsys.readouterr().err
    (tmp_path / STATE).write_text("")
    assert main(["chart", "shoals", str(tmp_path), str(out), "--mission", MISSION]) == 2
    assert capsys.readouterr().err.endswith(": is no saved state (it is empty); name state.json of a voyage\n")
    (tmp_path / STATE).unlink()
    assert main(["chart", "shoals", str(tmp_path), str(out), "--mission", MISSION]) == 2
    told = f"{tmp_path}: is a folder without state.json; name a voyage's folder, or a saved state\n"
    assert capsys.readouterr().err == f"companion chart: {told}"
    (tmp_path / STATE).write_text("{")
    assert main(["chart", "shoals", str(tmp_path), str(out), "--mission", MISSION]) == 2
    assert "is no saved state" in capsys.readouterr().err
    assert main(["chart", "shoals", str(tmp_path / "none"), str(out), "--mission", MISSION]) == 2
    assert not out.exists()
