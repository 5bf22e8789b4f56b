"""Converting and making missions loses nothing in silence: files, missions, rally points, pins, obstacles."""

import pathlib

import pytest

from companion.cli import main
from companion.geofence import load_mission, read
from companion.geofence.shapes import ZoneKind

MISSIONS = pathlib.Path(__file__).parents[3] / "missions"
DEMO = MISSIONS / "archipelago.toml"
HERE = "50.8170,-1.3100"
THERE = "50.8203,-1.3101"


def run(capsys, *argv) -> tuple[int, str, str]:
    code = main([str(a) for a in argv])
    out, err = capsys.readouterr()
    return code, out, err


def kml(path, *placemarks):
    body = "".join(f"<Placemark><name>{name}</name>{shape}</Placemark>" for name, shape in placemarks)
    path.write_text(f'<kml xmlns="http://www.opengis.net/kml/2.2"><Document>{body}</Document></kml>')
    return path


def pin(lat, lon):
    return f"<Point><coordinates>{lon},{lat}</coordinates></Point>"


@pytest.mark.parametrize(
    "argv",
    [
        ("mission", "convert", DEMO, "out.plan"),
        ("mission", "convert", DEMO, "out.toml"),
        ("fence", "convert", DEMO, "out.kml"),
        ("mission", "new", "out.toml", "--start", HERE, "--goal", THERE),
        ("mission", "download", "out.plan", "--link", "udpin:127.0.0.1:1"),
        ("fence", "download", "out.plan", "--link", "udpin:127.0.0.1:1"),
    ],
)
def test_no_file_is_overwritten_without_force(capsys, tmp_path, monkeypatch, argv):
    monkeypatch.chdir(tmp_path)
    out = pathlib.Path(next(a for a in argv if str(a).startswith("out.")))
    out.write_text("mine")
    code, _, err = run(capsys, *argv)
    assert (code, err.count("\n")) == (2, 1)
    assert "say --force to overwrite it" in err
    assert out.read_text() == "mine"
    assert sorted(tmp_path.iterdir()) == [tmp_path / out]
    if argv[1] != "download":
        assert run(capsys, *argv, "--force")[0] == 0
        assert out.read_text() != "mine"


def test_a_fence_is_not_converted_to_an_empty_mission(capsys, tmp_path):
    fence, out_file = tmp_path / "fence.waypoints", tmp_path / "out.waypoints"
    assert run(capsys, "fence", "convert", DEMO, fence)[0] == 0
    assert run(capsys, "mission", "convert", fence, out_file)[0] == 0
    assert len(read(out_file).zones) == len(read(fence).zones)
    out_file.unlink()
    code, _, err = run(capsys, "mission", "convert", fence, out_file, "--part", "mission")
    assert code == 1
    assert "there is no mission in it; it holds" in err
    assert not out_file.exists()


@pytest.mark.parametrize("name", ["a.wkt", "a.fen", "a.poly", "a.rally"])
def test_a_file_that_would_be_empty_is_not_written(capsys, tmp_path, name):
    route, out_file = tmp_path / "route.gpx", tmp_path / name
    assert run(capsys, "mission", "convert", DEMO, route, "--part", "mission")[0] == 0
    code, out, err = run(capsys, "mission", "convert", route, out_file, "--lossy")
    assert code == 1
    assert "would hold nothing" in out
    assert "not written: it would be empty" in err
    assert not out_file.exists()


def test_one_list_of_several_is_asked_for(capsys, tmp_path):
    out_file = tmp_path / "m.waypoints"
    code, _, err = run(capsys, "mission", "convert", DEMO, out_file)
    assert code == 1
    assert "--part" in err
    code, out, _ = run(capsys, "mission", "convert", DEMO, out_file, "--part", "mission")
    assert code == 0
    assert "left out with --part mission" in out
    assert len(read(out_file).items) == len(load_mission(DEMO).goals)


@pytest.mark.parametrize("name", ["m.gpx", "m.kml", "m.geojson", "m.plan"])
def test_our_own_mission_is_no_obstacle(capsys, tmp_path, name):
    assert run(capsys, "mission", "convert", DEMO, tmp_path / name)[0] == 0
    as_area, as_mission = read(tmp_path / name, areas=True), read(tmp_path / name)
    assert as_area.marks == ()
    assert as_area.zones == as_mission.zones
    assert as_area.items == as_mission.items
    assert len(as_area.items) == len(load_mission(DEMO).goals)


def test_a_strangers_line_is_still_a_danger(tmp_path):
    path = tmp_path / "cable.gpx"
    path.write_text(
        '<gpx version="1.1" creator="x"><rte><rtept lat="50" lon="1"/><rtept lat="50.1" lon="1"/></rte></gpx>'
    )
    assert len(read(path, areas=True).marks) == 1
    assert len(read(path).items) == 2


def test_pins_are_goals(capsys, tmp_path):
    drawing = kml(
        tmp_path / "bay.kml",
        ("Start", pin(50.8170, -1.3100)),
        ("North mark", pin(50.8203, -1.3101)),
        ("Pier", pin(50.8190, -1.3110)),
    )
    code, out, _ = run(capsys, "mission", "new", tmp_path / "bay.toml", "--from", drawing)
    assert code == 0
    assert "2 pins taken for places to sail to, in the file's order, the one called start for the start" in out
    mission = load_mission(tmp_path / "bay.toml")
    assert [g.name for g in mission.goals] == ["North mark", "Pier"]
    assert mission.start.lat_deg == pytest.approx(50.8170)
    assert mission.area.obstacles == ()
    assert len(read(drawing, areas=True).marks) == 3  # on a chart of dangers they are dangers


def test_pins_beside_a_line_and_pins_with_a_kind_are_dangers(tmp_path):
    line = "<LineString><coordinates>-1.31,50.817 -1.3101,50.8203</coordinates></LineString>"
    drawing = read(kml(tmp_path / "a.kml", ("Way", line), ("Rock", pin(50.819, -1.311))))
    assert len(drawing.marks) == 2
    kind = '<ExtendedData><Data name="kind"><value>exclusion</value></Data></ExtendedData>'
    drawing = read(kml(tmp_path / "b.kml", ("Mark", pin(50.8203, -1.31)), ("Rock", kind + pin(50.819, -1.311))))
    assert [m.name for m in drawing.marks] == ["Rock"]
    assert drawing.item_names == ("Mark",)


def test_a_mission_that_cannot_be_sailed_leaves_nothing_behind(capsys, tmp_path):
    inside = "50.8190,-1.3100"
    land = tmp_path / "land" / "rock.wkt"
    land.parent.mkdir()
    land.write_text("POLYGON ((-1.3105 50.8185, -1.3095 50.8185, -1.3095 50.8195, -1.3105 50.8195, -1.3105 50.8185))")
    out_file = tmp_path / "bay.toml"
    code, _, err = run(capsys, "mission", "new", out_file, "--start", HERE, "--goal", inside, "--land", land)
    assert (code, err.count("\n")) == (2, 1)
    assert f"{out_file}: [[goal]] 1: " in err
    assert "is inside the obstacle" in err
    assert list(tmp_path.iterdir()) == [land.parent]
    # what was there before stays as it was
    assert run(capsys, "mission", "new", out_file, "--start", HERE, "--goal", THERE, "--land", land)[0] == 0
    before = {p: p.read_bytes() for p in tmp_path.glob("bay*")}
    assert run(capsys, "mission", "new", out_file, "--start", HERE, "--goal", inside, "--land", land, "--force")[0] == 2
    assert {p: p.read_bytes() for p in tmp_path.glob("bay*")} == before


@pytest.mark.parametrize("name", ["rocks.plan", "rocks.fen", "rocks.waypoints"])
def test_point_obstacles_are_drawn_when_their_radius_is_given(capsys, tmp_path, name):
    rocks = tmp_path / "rocks.wkt"
    rocks.write_text("POINT (-1.31 50.819)\nLINESTRING (-1.311 50.819, -1.311 50.8195)\n")
    code, out, _ = run(capsys, "fence", "convert", rocks, tmp_path / name)
    assert code == 1
    if name == "rocks.fen":  # one keep-in ring, whatever the radius
        return
    assert "2 point or line obstacles are not carried by this format; say --point-radius M to draw them" in out
    assert run(capsys, "fence", "convert", rocks, tmp_path / name, "--point-radius", "15")[0] == 0
    zones = read(tmp_path / name).zones
    assert [z.kind for z in zones] == [ZoneKind.EXCLUSION] * 2
    assert any(getattr(z.shape, "radius_m", 0.0) == 15.0 for z in zones)
    assert run(capsys, "mission", "convert", rocks, tmp_path / "m.plan", "--point-radius", "15")[0] == 0


def test_the_point_radius_reaches_the_mission(capsys, tmp_path):
    rocks = tmp_path / "rocks.wkt"
    rocks.write_text("POINT (-1.31 50.819)\n")
    assert (
        run(
            capsys,
            "mission",
            "new",
            tmp_path / "m.toml",
            "--start",
            HERE,
            "--goal",
            THERE,
            "--land",
            rocks,
            "--point-radius",
            "25",
        )[0]
        == 0
    )
    assert load_mission(tmp_path / "m.toml").area.obstacles[0].shape.radius_m == 25.0


def test_what_an_upload_leaves_out_is_said(capsys, tmp_path):
    run(capsys, "mission", "convert", DEMO, tmp_path / "m.plan")
    code, out, _ = run(
        capsys, "mission", "upload", tmp_path / "m.plan", "--link", "udpin:127.0.0.1:1", "--timeout", "0.1"
    )
    assert code == 1
    assert "keep-out zones" in out
    assert "left out with --part mission" in out


def test_what_is_written_is_what_is_counted(capsys, tmp_path):
    drawing = tmp_path / "a.geojson"
    assert run(capsys, "mission", "convert", DEMO, drawing)[0] == 0
    _, out, _ = run(capsys, "fence", "convert", drawing, tmp_path / "a.wkt")
    written = out.splitlines()[-1]
    assert "keep-out zones" in written
    assert "mission item" not in written  # they are not in it


FULL = """
name = "full"
description = "all of it"
[start]
lat = 50.8170
lon = -1.3100
heading_deg = 90.0
[[goal]]
lat = 50.8203
lon = -1.3101
radius_m = 12.0
bandwidth_m = 80.0
heading_deg = 10.0
[[refuge]]
lat = 50.8180
lon = -1.3100
radius_m = 20.0
name = "Cove"
[area]
margin_m = 14.0
[current]
set_deg = 90.0
drift_mps = 0.1
[output]
nmea = ["udp:127.0.0.1:10110"]
"""


@pytest.mark.parametrize("ending", ["geojson", "gpx", "kml", "plan", "toml"])
def test_what_of_a_mission_file_no_format_carries_is_said(capsys, tmp_path, ending):
    """Of all this nothing was said, and of a plain mission nothing is."""
    (tmp_path / "full.toml").write_text(FULL)
    code, out, _ = run(capsys, "mission", "convert", tmp_path / "full.toml", tmp_path / f"out.{ending}")
    assert code == 0
    for lost in (
        "warning: the radius within which a goal is reached is",
        "warning: the heading that plans arrive at a goal with is",
        "warning: the width of the lane that leads to a goal is",
        "note: the heading at the start is",
        "note: the names of refuges are",
        "warning: the radius of a refuge is",
        "note: the mission's own settings (name, description, current, output, area.margin_m) are",
    ):
        assert f"out.{ending}: {lost} not carried by this format\n" in out
    (tmp_path / "plain.toml").write_text(f"[[goal]]\nlat = {HERE.split(',', maxsplit=1)[0]}\nlon = -1.31\n")
    _, out, _ = run(capsys, "mission", "convert", tmp_path / "plain.toml", tmp_path / f"plain-out.{ending}")
    assert "not carried" not in out


@pytest.mark.parametrize(
    ("line", "choices"),
    [
        ('[[goal]]\nlat = 50.0\nlon = 1.0\nrounding = "left"\n', 'write "port" or "starboard"'),
        ('[[goal]]\nlat = 50.0\nlon = 1.0\n[area]\naxis = "xy"\n', 'write "auto" or "lonlat" or "latlon"'),
        ('[[goal]]\nlat = 50.0\nlon = 1.0\n[skipper]\nend = "stop"\n', 'write "loiter" or "home"'),
    ],
)
def test_a_wrong_word_is_told_its_choices(capsys, tmp_path, line, choices):
    (tmp_path / "m.toml").write_text(line)
    code, _, err = run(capsys, "mission", "check", tmp_path / "m.toml")
    assert code == 2
    assert choices in err
