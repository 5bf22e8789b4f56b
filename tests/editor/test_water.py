"""The chart under the drawing: tiles for who has the token, and a mission's water made of it, written by Save alone."""

import base64
import json
import tempfile
from pathlib import Path

import pytest
import shapely
from shapely.geometry import Point, box

from companion import cli
from companion.editor import open_waters
from companion.errors import InputError
from companion.geofence import load_mission
from tests.editor.asking import TOKEN, with_editor

ISLAND = box(-1.312, 50.8210, -1.308, 50.8230)
AT = [50.82, -1.31]


def features():
    rows = [
        (box(-1.40, 50.78, -1.22, 50.86), {"layer": "DEPARE", "DRVAL1": 6.0}),
        (box(-1.318, 50.815, -1.316, 50.817), {"layer": "DEPARE", "DRVAL1": 0.5}),
        (ISLAND, {"layer": "LNDARE", "OBJNAM": "Hat Island"}),
        (Point(-1.305, 50.82), {"layer": "UWTROC", "VALSOU": 1.0, "OBJNAM": "Old Ned"}),
    ]
    return json.dumps(
        {
            "type": "FeatureCollection",
            "features": [
                {"type": "Feature", "geometry": json.loads(shapely.to_geojson(s)), "properties": p} for s, p in rows
            ],
        }
    )


@pytest.fixture
def chart(tmp_path):
    (tmp_path / "charts").mkdir()
    path = tmp_path / "charts" / "bay.geojson"
    path.write_text(features())
    return path


def about(sketch, **changes):
    return {"sketch": sketch, "at": AT, "reach_m": 1500.0, "depth_m": 2.0, **changes}


def test_tiles_are_for_who_has_the_token(tmp_path, chart):
    waters = open_waters([chart])
    tag = waters[0].tag

    async def talk(asker):
        known = {"Content_Type": "application/json", "X_Companion": "1"}
        good = {**known, "Authorization": f"Bearer {TOKEN}"}
        path = f"/water/{tag}/4/0/0"
        return (
            await asker.get(path, **good),
            [(await asker.get(path, **h))[0] for h in ({}, known, {**good, "Authorization": "Bearer wrong"})],
            [(await asker.get(p, **good))[0] for p in (f"/water/{'0' * 12}/4/0/0", f"/water/{tag}/99/0/0", "/water/")],
            (await asker.get(path, **{**good, "Origin": "http://evil.example"}))[0],
            (await asker.get(path, **{**good, "Host": "evil.example"}))[0],
        )

    (status, headers, data), refused, absent, foreign, other = with_editor(tmp_path / "m.toml", talk, waters)
    assert status == 200
    assert [kind for kind, *_ in json.loads(data)["areas"]] == ["depth", "depth", "land"]
    assert "immutable" in headers["cache-control"]
    assert (refused, absent, foreign, other) == ([403, 401, 401], [404, 404, 404], 403, 421)


def test_a_new_mission_has_its_water_from_the_chart(tmp_path, chart, capsys):
    path = tmp_path / "Bay Trip.toml"

    async def talk(asker):
        state = (await asker.post("/api/mission"))[1]
        status, told = await asker.post("/api/water", about(state["sketch"]))
        assert status == 200, told
        assert not path.exists(), "nothing is written by it"
        sketch = {
            **told["sketch"],
            "start": {"at": [50.8150, -1.3100]},
            "goals": [{"kind": "point", "at": [50.8250, -1.3100]}],
        }
        status, again = await asker.post("/api/water", about(sketch, depth_m=0.2))
        assert status == 200, again
        saved = await asker.post("/api/save", {"sketch": sketch, "disk": state["disk"]})
        undone = await asker.post("/api/check", {"sketch": state["sketch"]})
        return state, told, again, saved, undone

    state, told, again, (status, saved), undone = with_editor(path, talk, open_waters([chart]))
    assert [w["name"] for w in state["waters"]] == ["bay.geojson"]
    assert "3 obstacles of bay.geojson: what is less deep than 2 m" in told["said"]
    assert "Not fit for navigation" in told["said"]
    names = [shape["name"] for shape in told["sketch"]["shapes"]]
    assert sorted(names) == ["Old Ned (rock)", "land", "shallow", "the chart's edge"]
    assert {s["name"] for s in again["sketch"]["shapes"]} == set(names) - {"shallow", "Old Ned (rock)"}, "replaced"
    assert (status, "in order" in saved["said"]) == (200, True), saved
    assert undone[0] == 200
    assert sorted(p.name for p in tmp_path.iterdir() if p.is_file()) == [
        "Bay Trip.toml",
        "bay-trip-chart-fence.geojson",
        "bay-trip-chart.geojson",
    ]
    kept = json.loads((tmp_path / "bay-trip-chart.geojson").read_text())["features"]
    assert {f["properties"]["reason"] for f in kept} == {"land", "rock", "shallow"}, "why each is one stays with it"
    area = load_mission(path).area
    assert any(shapely.covers(o.shape, ISLAND) for o in area.obstacles if not hasattr(o.shape, "radius_m"))
    assert cli.main(["mission", "check", str(path)]) == 0


def test_what_was_drawn_by_hand_stays(tmp_path, chart):
    fence = [[50.812, -1.32], [50.812, -1.30], [50.828, -1.30], [50.828, -1.32]]
    drawn = [
        {"type": "polygon", "zone": "inclusion", "rings": [fence]},
        {"type": "point", "zone": "exclusion", "rings": [[[50.818, -1.306]]], "name": "mine"},
    ]

    async def talk(asker):
        state = (await asker.post("/api/mission"))[1]
        sketch = {**state["sketch"], "shapes": drawn, "start": {"at": [50.8150, -1.3100]}}
        sketch["goals"] = [{"kind": "point", "at": [50.8250, -1.3100]}]
        status, told = await asker.post("/api/water", about(sketch))
        saved = await asker.post("/api/save", {"sketch": told["sketch"], "disk": state["disk"]})
        return status, told, saved

    status, told, saved = with_editor(tmp_path / "m.toml", talk, open_waters([chart]))
    assert status == 200
    assert [s["name"] for s in told["sketch"]["shapes"] if s["zone"] == "inclusion"] == [""]
    assert "in order" in saved[1]["said"], saved
    mission = load_mission(tmp_path / "m.toml")
    assert {"mine", "land"} <= {o.name for o in mission.area.obstacles}
    assert len(mission.area.fence.inclusions) == 1


def test_charts_come_from_the_browser_too_and_are_gone_afterwards(tmp_path, monkeypatch):
    (tmp_path / "temporary").mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "temporary"))

    def packed(text):
        return base64.b64encode(text.encode()).decode()

    async def talk(asker):
        state = (await asker.post("/api/mission"))[1]
        none = await asker.post("/api/water", about(state["sketch"]))
        good = await asker.post("/api/open", {"files": [["bay.geojson", packed(features())]]})
        made = await asker.post("/api/water", about(state["sketch"]))
        bad = [
            await asker.post("/api/open", {"files": files})
            for files in (
                [["../bay.geojson", packed(features())]],
                [["bay.geojson", "%%%"]],
                [["bay.geojson", packed("{}")]],
                [["CELL.000", packed("rubbish")]],
                [],
            )
        ]
        many = await asker.post("/api/open", {"files": [[f"b{n}.geojson", packed(features())] for n in range(12)]})
        found = list(Path(tempfile.gettempdir()).glob("companion-charts-*"))
        wrong = await asker.post("/api/open", {"files": []}, token="wrong")
        large = (
            await asker.raw(
                f"POST /api/open HTTP/1.1\r\nHost: 127.0.0.1:{asker.port}\r\nContent-Length: 99000000\r\n"
                f"Origin: http://127.0.0.1:{asker.port}\r\nContent-Type: application/json\r\nX-Companion: 1\r\n"
                f"Authorization: Bearer {TOKEN}\r\n\r\n".encode()
            )
        )[:12]
        return none, good, made, bad, many, found, wrong, large

    none, good, made, bad, many, found, wrong, large = with_editor(tmp_path / "m.toml", talk)
    assert (none[0], none[1]["error"]) == (409, "no chart is open")
    assert good[0] == 200
    assert [w["name"] for w in good[1]["waters"]] == ["bay.geojson"]
    assert made[0] == 200
    assert [status for status, _ in bad] == [422, 422, 422, 422, 400]
    assert "is no name of a file" in bad[0][1]["error"]
    assert "has not come whole" in bad[1][1]["error"]
    assert all("\n" not in answer["error"] for _, answer in bad)
    assert (many[0], many[1]["error"]) == (413, "at most 12 charts are open at once")
    assert (wrong[0], large) == (401, b"HTTP/1.1 413")
    assert found
    assert not any(folder.exists() for folder in found), "they are gone"


def test_a_chart_of_too_many_corners_is_drawn_coarser_or_refused(tmp_path, monkeypatch):
    import numpy as np

    from companion.editor import waters as module

    t = np.linspace(0.0, 2.0 * np.pi, 4001)[:-1]
    ring = np.column_stack([-1.31 + 0.006 * np.cos(t) * (1 + 0.03 * np.sin(300 * t)), 50.82 + 0.004 * np.sin(t)])
    shape = json.loads(shapely.to_geojson(shapely.Polygon(ring)))
    text = {"type": "FeatureCollection", "features": [{"type": "Feature", "geometry": shape, "properties": {}}]}
    (tmp_path / "coast.geojson").write_text(json.dumps(text))
    charts = open_waters([tmp_path / "coast.geojson"])

    async def talk(asker):
        sketch = (await asker.post("/api/mission"))[1]["sketch"]
        return await asker.post("/api/water", about(sketch))

    assert "drawn 6 m too large" in with_editor(tmp_path / "m.toml", talk, charts)[1]["said"]
    monkeypatch.setattr(module, "MOST_VERTICES", 300)
    status, told = with_editor(tmp_path / "m.toml", talk, charts)
    assert status == 200
    assert "drawn 6 m too large" not in told["said"]
    monkeypatch.setattr(module, "MOST_VERTICES", 3)
    status, told = with_editor(tmp_path / "m.toml", talk, charts)
    assert status == 422
    assert "say a smaller radius" in told["error"]


def test_a_chart_that_shows_nothing_is_refused(tmp_path):
    (tmp_path / "none.geojson").write_text('{"type": "FeatureCollection", "features": []}')
    with pytest.raises(InputError, match="shows nothing"):
        open_waters([tmp_path / "none.geojson"])
