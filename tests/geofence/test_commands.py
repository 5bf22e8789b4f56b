"""``companion fence`` and ``companion mission`` on files: exit codes, words, and what lies on the disc after."""

import json
import pathlib

import pytest

from companion.cli import main
from companion.geofence import load_mission, read
from companion.geofence.mission.files import document_of
from companion.geofence.mission.options import OperatorOptions

MISSIONS = pathlib.Path(__file__).parents[2] / "missions"
DEMO = str(MISSIONS / "archipelago.toml")
PLAN = {
    "fileType": "Plan",
    "version": 1,
    "groundStation": "QGroundControl",
    "mission": {
        "version": 2,
        "firmwareType": 3,
        "vehicleType": 11,
        "cruiseSpeed": 2,
        "hoverSpeed": 2,
        "globalPlanAltitudeMode": 1,
        "plannedHomePosition": [50.817, -1.31, 0],
        "items": [
            {
                "type": "SimpleItem",
                "doJumpId": 1,
                "command": 16,
                "frame": 3,
                "autoContinue": True,
                "AMSLAltAboveTerrain": None,
                "Altitude": 0,
                "AltitudeMode": 1,
                "params": [0, 0, 0, None, 50.82, -1.31, 0],
            },
            {
                "type": "ComplexItem",
                "complexItemType": "survey",
                "TransectStyleComplexItem": {
                    "Items": [
                        {
                            "type": "SimpleItem",
                            "doJumpId": 2,
                            "command": 16,
                            "frame": 3,
                            "autoContinue": True,
                            "params": [0, 0, 0, None, 50.821, -1.311, 0],
                        },
                        {
                            "type": "SimpleItem",
                            "doJumpId": 3,
                            "command": 16,
                            "frame": 3,
                            "autoContinue": True,
                            "params": [0, 0, 0, None, 50.821, -1.309, 0],
                        },
                    ]
                },
            },
            {
                "type": "SimpleItem",
                "doJumpId": 7,
                "command": 177,
                "frame": 2,
                "autoContinue": True,
                "params": [1, -1, 0, 0, 0, 0, 0],
            },
        ],
    },
    "geoFence": {
        "version": 2,
        "circles": [{"version": 1, "inclusion": False, "circle": {"center": [50.8185, -1.312], "radius": 30}}],
        "polygons": [
            {
                "version": 1,
                "inclusion": True,
                "polygon": [[50.815, -1.32], [50.825, -1.32], [50.825, -1.30], [50.815, -1.30]],
            }
        ],
    },
    "rallyPoints": {"version": 2, "points": [[50.8172, -1.3102, 0]]},
}


def run(capsys, *argv) -> tuple[int, str, str]:
    code = main([str(a) for a in argv])
    out, err = capsys.readouterr()
    return code, out, err


@pytest.fixture
def plan(tmp_path):
    path = tmp_path / "drawn.plan"
    path.write_text(json.dumps(PLAN))
    return path


def test_check_of_the_demo(capsys):
    code, out, _ = run(capsys, "fence", "check", DEMO)
    assert code == 0
    assert "12 keep-out zones" in out
    assert out.endswith("in order\n")


def test_check_names_every_fault_and_fails(capsys, tmp_path):
    bad = tmp_path / "bad.wkt"
    bad.write_text("POLYGON ((0 0, 0.01 0.01, 0.01 0, 0 0.01, 0 0))\nPOLYGON EMPTY\nPOLYGON ((0 0, 0.01 0, 0 0.01))\n")
    code, out, _ = run(capsys, "fence", "check", bad)
    assert code == 1
    assert [line.split(": ")[1] for line in out.splitlines()[:3]] == ["line 1", "line 2", "line 3"]
    assert "crosses itself" in out
    assert "NOT in order" in out


def test_convert_refuses_what_it_would_have_to_repair(capsys, tmp_path):
    bad, good = tmp_path / "bad.wkt", tmp_path / "good.wkt"
    bad.write_text("Rock|exclusion|POLYGON ((0 0, 0.01 0.01, 0.01 0, 0 0.01, 0 0))\n")
    code, _, err = run(capsys, "fence", "convert", bad, good)
    assert code == 2
    assert "--repair" in err
    assert not good.exists()
    assert run(capsys, "fence", "convert", bad, good, "--repair")[0] == 0
    assert read(good).require_clean().zones[0].name == "Rock"
    assert run(capsys, "fence", "check", good)[0] == 0


def test_convert_refuses_to_lose_a_zone_in_silence(capsys, tmp_path):
    out_file = tmp_path / "demo.fen"
    code, out, err = run(capsys, "fence", "convert", DEMO, out_file)
    assert code == 1
    assert "zones would be missing" in err
    assert "are not carried by this format (a .fen holds one keep-in ring)" in out
    assert not out_file.exists()
    assert run(capsys, "fence", "convert", DEMO, out_file, "--lossy")[0] == 0


def _sorted(document):
    return sorted(document.zones, key=lambda z: (z.kind.value, z.shape.bounds))


@pytest.mark.parametrize("name", ["a.wkt", "a.ewkt", "a.geojson", "a.plan", "a.waypoints", "a.gpx", "a.kml", "a.kmz"])
def test_convert_the_demo_to_everything_and_back(capsys, tmp_path, name):
    code, _, _ = run(capsys, "fence", "convert", DEMO, tmp_path / name)
    assert code == 0
    back = read(tmp_path / name).require_clean()
    wanted = document_of(load_mission(DEMO))
    assert len(back.zones) >= 12
    for a, b in zip(_sorted(back), _sorted(wanted), strict=True):
        assert a.shape.symmetric_difference(b.shape).area < 1e-12
    assert run(capsys, "fence", "check", tmp_path / name, "--near", "50.817,-1.31")[0] == 0


def test_convert_simplify_writes_the_autopilots_fence(capsys, tmp_path):
    code, out, _ = run(capsys, "fence", "convert", DEMO, tmp_path / "autopilot.waypoints", "--simplify")
    assert code == 0
    rows = len((tmp_path / "autopilot.waypoints").read_text().splitlines()) - 1
    assert f"{rows} fence items, which use" in out
    assert rows <= 84


def test_rally_points_go_from_format_to_format(capsys, tmp_path):
    """They were dropped; what a format does not carry is said, in a whole sentence."""
    plan, rally, again = (str(tmp_path / name) for name in ("a.plan", "r.waypoints", "b.plan"))
    (tmp_path / "a.plan").write_text(json.dumps(PLAN), encoding="utf-8")
    assert main(["mission", "convert", plan, rally, "--part", "rally"]) == 0
    assert "also holds" in capsys.readouterr().out
    for name in ("b.plan", "c.rally", "d.gpx", "e.kml", "f.geojson"):
        assert main(["mission", "convert", rally, str(tmp_path / name)]) == 0
        assert capsys.readouterr().out == f"{tmp_path / name}: written: 1 rally point\n"
        back = read(str(tmp_path / name)).rally
        assert [(r.lat_e7, r.lon_e7) for r in back] == [(508172000, -13102000)]
    assert main(["mission", "convert", again, str(tmp_path / "g.wkt")]) == 1
    said = capsys.readouterr()
    assert "1 rally point is not carried by this format" in said.out
    assert said.err.rstrip().endswith("choose another format, or what to write with --part")
    assert main(["fence", "convert", plan, str(tmp_path / "h.waypoints")]) == 0
    assert "1 rally point is not carried by this format" in capsys.readouterr().out


def test_mission_new_from_a_start_goals_and_land(capsys, tmp_path):
    out_file = tmp_path / "bay.toml"
    code, out, _ = run(
        capsys,
        "mission",
        "new",
        out_file,
        "--start",
        "50.8170,-1.3100",
        "--goal",
        "50.8203,-1.3101",
        "--land",
        MISSIONS / "archipelago.wkt",
        "--fence",
        MISSIONS / "lake.wkt",
        "--margin",
        "10",
    )
    assert code == 0, out
    mission = load_mission(out_file)
    assert len(mission.area.obstacles) == 12
    assert len(mission.area.fence.inclusions) == 1
    assert mission.margin_m == 10.0
    assert mission.operator.arm is False
    assert "set_auto = false" in out_file.read_text()  # what could be permitted is there to be changed
    assert "[operator] permits nothing yet" in out
    assert load_mission(out_file).operator == OperatorOptions()
    assert run(capsys, "mission", "new", out_file, "--start", "50.8170,-1.3100", "--goal", "50.8203,-1.3101")[0] == 2
    assert run(capsys, "mission", "new", tmp_path / "b.toml", "--goal", "50.8203,-1.3101", "--start", "x")[0] == 2
    code, _, err = run(capsys, "mission", "new", tmp_path / "b.toml", "--start", "50.8170,-1.3100")
    assert (code, "no goal" in err) == (2, True)


def test_a_drawing_whose_start_and_goals_lie_in_a_keep_out_zone_is_not_in_order(capsys, tmp_path):
    drawn = json.loads(json.dumps(PLAN))
    lat, lon, _ = drawn["mission"]["plannedHomePosition"]
    ring = [[lat - 0.1, lon - 0.1], [lat - 0.1, lon + 0.1], [lat + 0.1, lon + 0.1], [lat + 0.1, lon - 0.1]]
    drawn["geoFence"]["polygons"] = [{"version": 1, "inclusion": False, "polygon": ring}]
    path = tmp_path / "drawn.plan"
    path.write_text(json.dumps(drawn), encoding="utf-8")
    code, out, _ = run(capsys, "mission", "check", path)
    assert code == 1
    assert f"home: warning: {lat:.6f}, {lon:.6f} is inside the obstacle" in out
    assert "item 1: error: " in out
    assert "NOT in order" in out


def test_mission_new_from_a_qgroundcontrol_plan(capsys, tmp_path, plan):
    out_file = tmp_path / "drawn.toml"
    code, out, _ = run(capsys, "mission", "new", out_file, "--from", plan)
    assert code == 0, out
    mission = load_mission(out_file)
    assert [round(g.point.lat_deg, 4) for g in mission.goals] == [50.82, 50.821, 50.821]
    assert mission.start.lat_deg == 50.817
    assert len(mission.area.obstacles) == 1
    assert len(mission.area.fence.inclusions) == 1
    assert "item 4: DO_JUMP repeats without end (-1): not carried over" in out
    assert (tmp_path / "drawn-obstacles.geojson").exists()  # a circle, which WKT would have to draw


@pytest.mark.parametrize("name", ["m.plan", "m.waypoints", "m.gpx", "m.kml", "m.geojson"])
def test_a_mission_there_and_back(capsys, tmp_path, name):
    course = MISSIONS / "buoy-course.toml"
    code, out, _ = run(capsys, "mission", "convert", course, tmp_path / name)
    assert code == 0
    assert "side on which marks are left" in out
    assert run(capsys, "mission", "convert", tmp_path / name, tmp_path / "back.toml")[0] == 0
    there, back = load_mission(course), load_mission(tmp_path / "back.toml")
    for a, b in zip(there.goals, back.goals, strict=True):
        assert (a.point.lat_deg, a.point.lon_deg) == pytest.approx((b.point.lat_deg, b.point.lon_deg), abs=1e-7)
    assert back.start.lat_deg == pytest.approx(there.start.lat_deg, abs=1e-7)


def test_survey_items_are_expanded_and_jumps_renumbered(capsys, plan, tmp_path):
    document = read(plan)
    assert [i.command for i in document.items] == [16, 16, 16, 177]
    assert document.items[3].params[0] == 1.0
    assert any("expanded to its 2 items" in f.text for f in document.findings)
    empty = json.loads(json.dumps(PLAN))
    empty["mission"]["items"][1] = {"type": "ComplexItem", "complexItemType": "CorridorScan"}
    (tmp_path / "empty.plan").write_text(json.dumps(empty))
    code, _, err = run(capsys, "mission", "convert", tmp_path / "empty.plan", tmp_path / "x.waypoints")
    assert code == 2
    assert "CorridorScan has no stored items" in err


def test_pictures(capsys, tmp_path):
    picture = ("--plot", tmp_path / "demo.png", "--wind", "5@350", "--no-plan")
    code, out, _ = run(capsys, "mission", "check", DEMO, *picture)
    assert code == 0, out
    assert (tmp_path / "demo.png").read_bytes().startswith(b"\x89PNG")
    assert run(capsys, "fence", "check", MISSIONS / "lake.wkt", "--plot", tmp_path / "lake.png")[0] == 0
    assert run(capsys, "mission", "check", DEMO, "--plot", tmp_path / "no" / "demo.png", "--no-plan")[0] == 2


@pytest.mark.parametrize(
    "argv",
    [
        ("fence", "check", "missing.wkt"),
        ("fence", "convert", DEMO, "x.dwg"),
        ("fence", "check", DEMO, "--near", "91,0"),
        ("mission", "check", "missing.toml"),
        ("mission", "new", "x.txt", "--goal", "0,0"),
        ("mission", "upload", DEMO, "--link", "udpin:0.0.0.0:14550"),
        ("fence", "upload", DEMO, "--link", "nowhere"),
        ("mission", "check", DEMO, "--wind", "strong", "--plot", "x.png"),
    ],
)
def test_bad_use_is_one_line_and_exit_code_2(capsys, argv):
    code, _, err = run(capsys, *argv)
    assert code == 2
    assert err.count("\n") == 1
    assert err.startswith(f"companion {argv[0]}")


def test_help_has_examples(capsys):
    for command in ("fence", "mission"):
        with pytest.raises(SystemExit) as stop:
            main([command, "--help"])
        assert stop.value.code == 0
        assert "examples:" in capsys.readouterr().out


def test_a_mission_is_among_what_a_mission_is_converted_to(tmp_path, capsys):
    assert main(["mission", "convert", "missions/bay.toml", str(tmp_path / "bay.xyz")]) == 2
    assert "use .toml, " in capsys.readouterr().err


RING = {
    "type": "Polygon",
    "coordinates": [[[-1.32, 50.81], [-1.3, 50.81], [-1.3, 50.83], [-1.32, 50.83], [-1.32, 50.81]]],
}
HOLE = [[-1.315, 50.815], [-1.305, 50.815], [-1.305, 50.825], [-1.315, 50.825], [-1.315, 50.815]]


def test_a_hole_of_a_keep_out_zone_is_water_in_what_is_converted_too(capsys, tmp_path, monkeypatch):
    """It was filled: the keep-out lay over start and goal, and the file was in order."""
    monkeypatch.chdir(tmp_path)
    ring = {"type": "Polygon", "coordinates": [*RING["coordinates"], HOLE]}
    feature = {"type": "Feature", "properties": {"kind": "exclusion"}, "geometry": ring}
    (tmp_path / "o.geojson").write_text(json.dumps({"type": "FeatureCollection", "features": [feature]}))
    (tmp_path / "m.toml").write_text(
        '[start]\nlat = 50.818\nlon = -1.31\n[[goal]]\nlat = 50.822\nlon = -1.31\n[area]\nobstacles = ["o.geojson"]\n'
    )
    assert run(capsys, "mission", "convert", "m.toml", "m.plan")[0] == 0
    code, out, _ = run(capsys, "mission", "check", "m.plan")
    assert code == 0
    assert out.rstrip().endswith(": in order")


def test_of_a_drawing_it_is_said_what_the_companion_does_not_sail(capsys, tmp_path):
    rows = ["QGC WPL 110", "0\t1\t0\t16\t0\t0\t0\t0\t50.817\t-1.31\t0\t1"]
    rows += ["1\t0\t3\t16\t0\t0\t0\t0\t50.82\t-1.31\t0\t1", "2\t0\t3\t178\t1\t3\t0\t0\t0\t0\t0\t1"]
    (tmp_path / "m.waypoints").write_text("\n".join(rows) + "\n")
    code, out, _ = run(capsys, "mission", "check", tmp_path / "m.waypoints")
    assert code == 0
    assert "item 2: warning: the companion does not sail it: DO_CHANGE_SPEED is nothing that a voyage does" in out
    assert out.rstrip().endswith("in order for the autopilot alone")
