"""``companion chart import``: what it writes is what missions read; what cannot be believed is refused in one line."""

import datetime as dt
import json
import sys
from dataclasses import replace

import numpy as np
import pytest
import shapely
from shapely.geometry import LineString, Point, box

from companion import cli
from companion.chart import Wanted, area_of, box_about, read_chart, told_of
from companion.chart.features import Chart, Danger, Source
from companion.errors import InputError
from companion.geofence import Circle, Code, Document, Zone, ZoneKind, load_mission, read
from companion.geofence.formats import write
from companion.messages import GeoPoint
from companion.mission_check import check_mission

AROUND = ["--around", "50.82,-1.31", "--radius", "1500"]
ISLAND = box(-1.312, 50.8210, -1.308, 50.8230)
MISSION = """name = "m"
[start]
lat = 50.8150
lon = -1.3100
[[goal]]
lat = 50.8250
lon = -1.3100
[area]
obstacles = ["m-chart.geojson"]
fence = "m-chart-fence.geojson"
[boat]
draft_m = 1.2
"""


def collection(*features):
    rows = [
        {"type": "Feature", "geometry": json.loads(shapely.to_geojson(shape)), "properties": properties}
        for shape, properties in features
    ]
    return json.dumps({"type": "FeatureCollection", "features": rows})


@pytest.fixture
def shell(tmp_path, monkeypatch, capsys):
    """A folder to work in, and what a command answers: exit code, standard output, standard error."""
    monkeypatch.chdir(tmp_path)

    def run(*words):
        code = cli.main(["chart", "import", *map(str, words)])
        said = capsys.readouterr()
        return code, said.out, said.err

    run.folder = tmp_path
    return run


def refusal(shell, *words):
    code, out, err = shell(*words)
    assert (code, out) == (2, "")
    assert err.count("\n") == 1
    assert list(shell.folder.glob("chart*.geojson")) == []
    return err.removeprefix("companion chart: ").rstrip()


def test_a_coast_becomes_the_area_of_a_mission_and_needs_no_extra(shell, monkeypatch):
    """A mission may name the files before they are there."""
    for name in ("pyogrio", "rasterio"):
        monkeypatch.setitem(sys.modules, name, None)
    (shell.folder / "coast.geojson").write_text(
        collection((ISLAND, {}), (Point(-1.305, 50.82), {"seamark:type": "rock", "name": "Hat"}))
    )
    (shell.folder / "m.toml").write_text(MISSION)
    code, out, err = shell("coast.geojson", "--mission", "m.toml")
    assert (code, err) == (0, "")
    assert "solid is what is less deep than 1.7 m" in out
    assert "it tells no depths" in out
    assert "not fit for navigation" in out
    area = load_mission("m.toml").area
    assert [o.name for o in area.obstacles] == ["land", "Hat (rock)"]
    assert shapely.covers(area.obstacles[0].shape, ISLAND)
    assert len(area.fence.inclusions) == 1
    code, _, err = shell("coast.geojson", "--mission", "m.toml")
    assert code == 2
    assert "m-chart.geojson: exists; say --force" in err


@pytest.mark.parametrize("out", ["bay", "bay.geojson"])
def test_the_areas_files_are_named_by_out_with_or_without_its_ending(shell, out):
    (shell.folder / "coast.geojson").write_text(collection((ISLAND, {})))
    (shell.folder / "m.toml").write_text(MISSION)
    assert shell("coast.geojson", "--mission", "m.toml", "--out", out)[0] == 0
    assert {p.name for p in shell.folder.glob("bay*")} == {"bay.geojson", "bay-fence.geojson"}


def test_the_keel_of_the_mission_says_what_is_too_shallow(shell):
    row = "-9 -9 -9 -9 -9\n"
    header = "ncols 5\nnrows 5\nxllcorner -1.33\nyllcorner 50.80\ncellsize 0.01\n"
    grid = header + 2 * row + "-9 -9 -9 -9 -1.8\n" + 2 * row
    (shell.folder / "g.asc").write_text(grid)
    told = {}
    for draft, under in (("1.2", "0.5"), ("1.4", "0.5"), ("1.2", "0.7")):
        text = MISSION.replace("[boat]\ndraft_m = 1.2", f"under_keel_m = {under}\n[boat]\ndraft_m = {draft}")
        (shell.folder / "m.toml").write_text(text)
        assert shell("g.asc", "--mission", "m.toml", "--radius", "1500", "--force")[0] == 0
        told[draft, under] = "shallow or land" in obstacles(shell.folder, "m-chart")
    assert told == {("1.2", "0.5"): False, ("1.4", "0.5"): True, ("1.2", "0.7"): True}
    (shell.folder / "m.toml").write_text(MISSION.replace("draft_m = 1.2", ""))
    assert refusal(shell, "g.asc", "--mission", "m.toml", "--force") == (
        "m.toml: [boat] draft_m: is missing; say how deep the keel is, or --depth M"
    )


def test_an_island_and_a_bank_of_one_grid_have_a_depth_each(shell):
    """The bank, 1 m deep, was 5 m above the datum, as the island is; and the two were "1 shallow or land"."""
    heights = np.full((12, 24), -9.0)
    heights[4:7, 3:6], heights[4:7, 16:19] = 5.0, -1.0
    rows = "\n".join(" ".join(f"{h:g}" for h in row) for row in heights)
    header = "ncols 24\nnrows 12\nxllcorner -1.325\nyllcorner 50.81\ncellsize 0.001\n"
    (shell.folder / "g.asc").write_text(f"{header}{rows}\n")
    (shell.folder / "m.toml").write_text(MISSION)
    code, out, _ = shell("g.asc", "--mission", "m.toml", "--radius", "1500.4")
    assert code in {0, 1}
    assert out.startswith("g.asc: 2 shallow or dry areas\n")
    assert " within 1500 m of " in out
    solid = json.loads((shell.folder / "m-chart.geojson").read_text())["features"]
    assert sorted(f["properties"]["depth_m"] for f in solid if "depth_m" in f["properties"]) == [-5.0, 1.0]


TIDE = "time, height_m\n2026-11-24T06:00Z, 1.0\n2026-11-24T12:00Z, 4.0\n2026-11-24T18:00Z, 0.4\n"


@pytest.mark.parametrize(
    ("begins", "ends", "depth_m"),
    [("06:00", "11:00", 1.0), ("07:00", "12:00", 1.0), ("11:00", "12:30", 1.6), ("12:00", "12:30", 1.6)],
)
def test_the_lowest_tide_of_the_hours_is_added_to_every_depth(shell, begins, ends, depth_m):
    (shell.folder / "a.geojson").write_text(collection((ISLAND, {})))
    (shell.folder / "t.csv").write_text(TIDE)
    hours = ["--from", f"2026-11-24T{begins}Z", "--to", f"2026-11-24T{ends}Z"]
    code, out, _ = shell("a.geojson", *AROUND, "--depth", "2", "--tide", "t.csv", *hours)
    assert code == 0
    assert f"less deep than {depth_m:g} m with {2.0 - depth_m:g} m of tide" in out


def test_the_missions_table_of_the_tide_is_taken_where_hours_are_asked_for(shell):
    (shell.folder / "a.geojson").write_text(collection((ISLAND, {})))
    (shell.folder / "t.csv").write_text(TIDE)
    (shell.folder / "m.toml").write_text(MISSION.replace("[area]\n", '[area]\ntide = "t.csv"\n'))
    hours = ["--from", "2026-11-24T07:00Z", "--to", "2026-11-24T11:00Z"]
    code, out, _ = shell("a.geojson", "--mission", "m.toml", *hours)
    assert (code, "less deep than 0.7 m with 1 m of tide" in out) == (0, True), out
    code, out, _ = shell("a.geojson", "--mission", "m.toml", "--force")
    assert (code, "less deep than 1.7 m\n" in out) == (0, True), out


def test_water_that_dries_goes_to_a_file_of_its_own_which_a_mission_reads(shell):
    row, header = "-9 -9 -9 -9 -9\n", "ncols 5\nnrows 5\nxllcorner -1.33\nyllcorner 50.80\ncellsize 0.01\n"
    (shell.folder / "g.asc").write_text(header + 2 * row + "-9 -9 -9 -9 0.5\n" + 2 * row)
    (shell.folder / "t.csv").write_text(TIDE)
    text = MISSION.replace("[area]\n", '[area]\ntide = "t.csv"\ndrying = ["m-chart-drying.geojson"]\n')
    (shell.folder / "m.toml").write_text(text)
    code, out, _ = shell("g.asc", "--mission", "m.toml", "--radius", "1500", "--drying")
    assert code == 0, out
    assert "of water that is too shallow at some hours only" in out
    assert 'drying = ["m-chart-drying.geojson"]' in out
    pieces = json.loads((shell.folder / "m-chart-drying.geojson").read_text())["features"]
    depths = [f["properties"]["depth_m"] for f in pieces]
    solid = json.loads((shell.folder / "m-chart.geojson").read_text())["features"]
    assert depths
    assert all(1.7 - 4.0 <= depth < 1.7 for depth in depths)
    assert not any("depth_m" in f["properties"] for f in solid)
    assert len(load_mission(shell.folder / "m.toml").drying) == len(pieces)
    told = refusal(shell, "g.asc", *AROUND, "--depth", "1.7", "--drying")
    assert told.startswith("--drying: is by the hours of a table")


def test_a_flat_that_joins_the_shore_dries_by_its_own_depths(shell):
    """It was as deep as the land is, so solid at all hours, and "0 pieces" was an empty file that no mission reads."""
    heights = np.full((40, 24), -9.0)
    heights[:, :12] = 5.0
    heights[10:30, 12:18] = np.linspace(0.4, -1.4, 6)
    rows = "\n".join(" ".join(f"{h:g}" for h in row) for row in heights)
    header = "ncols 24\nnrows 40\nxllcorner -1.325\nyllcorner 50.80\ncellsize 0.001\n"
    (shell.folder / "g.asc").write_text(f"{header}{rows}\n")
    (shell.folder / "t.csv").write_text(TIDE.replace("4.0", "1.9"))
    text = MISSION.replace("[area]\n", '[area]\ntide = "t.csv"\ndrying = ["m-chart-drying.geojson"]\n')
    (shell.folder / "m.toml").write_text(text.replace("-1.3100", "-1.3050").replace("50.8250", "50.8200"))
    code, out, _ = shell("g.asc", "--mission", "m.toml", "--radius", "700", "--drying")
    assert code == 0, out
    waters = load_mission(shell.folder / "m.toml").drying
    depths = sorted(w.depth_m for w in waters)
    assert depths[0] >= 1.7 - 1.9
    assert max(np.diff([*depths, 1.7])) <= 0.5 + 0.36  # a band, and the step of the slope
    (land,) = (s for s in load_mission(shell.folder / "m.toml").area.obstacles if s.name == "shallow or land")
    all_of_it = shapely.union_all([land.shape, *(w.shape for w in waters)])
    assert shapely.covers(all_of_it, box(-1.3125, 50.8125, -1.3080, 50.8175))
    shallowest = next(w for w in waters if w.depth_m == depths[0])
    assert not shapely.covers(land.shape, shallowest.shape.representative_point())


def test_where_no_tide_makes_anything_deep_enough_no_file_is_named(shell):
    (shell.folder / "a.geojson").write_text(collection((ISLAND, {})))
    (shell.folder / "t.csv").write_text(TIDE)
    (shell.folder / "m.toml").write_text(MISSION.replace("[area]\n", '[area]\ntide = "t.csv"\n'))
    code, out, _ = shell("a.geojson", "--mission", "m.toml", "--drying")
    assert code == 0
    assert not (shell.folder / "m-chart-drying.geojson").exists()
    assert "m-chart-drying.geojson: not written: no tide of the table makes deep enough what is too shallow here" in out
    assert 'fence = "m-chart-fence.geojson"\n' in out


def test_what_a_chart_was_made_for_is_held_against_the_mission(shell):
    """Made for three hours of tide, or a keel of 1.2 m, it was in order for any other."""
    (shell.folder / "a.geojson").write_text(collection((ISLAND, {})))
    (shell.folder / "t.csv").write_text(TIDE)
    (shell.folder / "m.toml").write_text(MISSION)
    hours = ["--from", "2026-11-24T11:00Z", "--to", "2026-11-24T13:00Z", "--tide", "t.csv"]
    assert shell("a.geojson", "--mission", "m.toml", *hours)[0] == 0

    def found(hour, text=MISSION):
        (shell.folder / "m.toml").write_text(text)
        unix_s = dt.datetime.fromisoformat(f"2026-11-24T{hour}+00:00").timestamp()
        judged = check_mission(shell.folder / "m.toml", unix_s=unix_s)
        return [(f.severity.value, f.text) for f in judged.findings if f.code is Code.CHARTED]

    words = (
        "reckons with 0.4 m of tide, from 2026-11-24T11:00Z to 2026-11-24T13:00Z alone: at other hours there is less"
    )
    assert found("12:00") == [("note", f"{words} water")]
    assert found("13:01") == [("warning", f"{words} water")]
    assert found("12:00", MISSION.replace("1.2", "2.9"))[0] == (
        "warning",
        "is made for 1.7 m of water, and this boat needs 3.4 m (draft_m and under_keel_m)",
    )
    assert cli.main(["fence", "convert", "m-chart.geojson", "again.geojson"]) == 0
    assert read("again.geojson").charted == replace(read("m-chart.geojson").charted, source="again.geojson")
    (shell.folder / "m.toml").write_text(MISSION)
    _, out, _ = shell("a.geojson", "--mission", "m.toml", "--force", "--depth", "0.3")
    assert "--depth 0.3 is less than the 1.7 m of the mission's draft_m and under_keel_m\n" in out
    assert found("12:00")[0][0] == "warning"


def test_a_mission_that_forgets_what_dries_is_refused(shell):
    """Obstacles without the bar, and no bar: the plan led over it, in order."""
    row, header = "-9 -9 -9 -9 -9\n", "ncols 5\nnrows 5\nxllcorner -1.33\nyllcorner 50.80\ncellsize 0.01\n"
    (shell.folder / "g.asc").write_text(header + 2 * row + "-9 -9 -9 -9 0.5\n" + 2 * row)
    (shell.folder / "t.csv").write_text(TIDE)
    (shell.folder / "m.toml").write_text(MISSION.replace("[area]\n", '[area]\ntide = "t.csv"\n'))
    assert shell("g.asc", "--mission", "m.toml", "--radius", "1500", "--drying")[0] == 0
    with pytest.raises(InputError) as refused:
        load_mission(shell.folder / "m.toml")
    assert str(refused.value).endswith(
        "m.toml: [area] drying: is missing: m-chart.geojson leaves out what dries, which is in m-chart-drying.geojson; "
        'write drying = ["m-chart-drying.geojson"] and tide, or import the chart without --drying'
    )


@pytest.mark.parametrize(
    ("text", "begins", "told"),
    [
        (TIDE, "05:00", "t.csv: does not hold for all of --from to --to; take a table of those hours"),
        (TIDE.replace("4.0", "4 ft"), "06:00", "t.csv: line 3: is not a time and one height in metres"),
        (TIDE.replace("4.0", "40"), "06:00", "t.csv: line 3: a tide of 40 m cannot be"),
        (TIDE.replace("12:00Z", "12:00"), "06:00", "t.csv: line 3: '2026-11-24T12:00' is no time with its zone"),
        (TIDE.replace("12:00Z", "05:00Z"), "06:00", "t.csv: line 3: is not a minute or more after the line before"),
        (TIDE, "19:00", "--tide: goes with --from and a later --to; say all three, or none"),
    ],
)
def test_a_tide_that_cannot_be_believed_is_refused(shell, text, begins, told):
    (shell.folder / "a.geojson").write_text(collection((ISLAND, {})))
    (shell.folder / "t.csv").write_text(text)
    hours = ["--from", f"2026-11-24T{begins}Z", "--to", "2026-11-24T17:00Z"]
    assert refusal(shell, "a.geojson", *AROUND, "--depth", "2", "--tide", "t.csv", *hours).startswith(told)


def test_a_place_of_the_mission_that_is_not_in_free_water_is_told(shell):
    (shell.folder / "coast.geojson").write_text(collection((box(-1.312, 50.824, -1.308, 50.826), {})))
    (shell.folder / "m.toml").write_text(MISSION)
    code, out, _ = shell("coast.geojson", "--mission", "m.toml")
    assert code == 1
    assert "[[goal]] 1: 50.825000, -1.310000 is inside land of coast.geojson; move it" in out


@pytest.mark.parametrize(
    ("name", "text", "told"),
    [
        ("X.000", "not a cell at all, 24 bytes", "X.000: byte 0: is no S-57 cell: it is encrypted (S-63), or damaged"),
        ("X.001", "x", "X.001: is an update of a cell; name X.000: its updates are read with it"),
        ("a.geojson", "{", "a.geojson: is no JSON"),
        ("a.geojson", "{}", "a.geojson: is no FeatureCollection; export it as GeoJSON (RFC 7946)"),
        (
            "a.geojson",
            collection((Point(437000, 5630000), {})),
            "a.geojson: features[0]: lies at 437000, 5.63e+06, which is no longitude and latitude",
        ),
        (
            "a.geojson",
            '{"type": "FeatureCollection", "crs": {"properties": {"name": "EPSG:27700"}}, "features": []}',
            'a.geojson: crs: {"properties": {"name": "EPSG:27700"}} is not WGS 84',
        ),
        ("a.geojson", '{"features": [{}]}', "a.geojson: features[0]: has no geometry"),
        (
            "a.geojson",
            collection((Point(-1.31, 50.82), {"radius_m": "40 ft"})),
            "a.geojson: features[0] radius_m: '40 ft' is no number of metres; write metres, as 12.2",
        ),
        ("water-polygons.geojson", collection(), "water-polygons.geojson: holds the water, by its name"),
        (
            "g.asc",
            "ncols 2\nnrows 2\nxllcorner -1.9\nyllcorner 50\ncellsize 1\n1 2\n3 4\n",
            "g.asc: cell of 4 m: no cell is below zero: depths written as positive numbers, or a grid of land alone",
        ),
        (
            "g.asc",
            "ncols 2\nnrows 2\nxllcorner 10\nyllcorner 50\ncellsize 1\n-1 2\n3 4\n",
            "g.asc: reaches from 50.5000, 10.5000 to 51.5000, 11.5000 and holds nothing of the place that is asked for",
        ),
        (
            "g.asc",
            "ncols 2\nnrows 2\nxllcorner 437000\nyllcorner 5630000\ncellsize 100\n-1 2\n3 4\n",
            "g.asc: header: does not say its reference system; put its .prj beside it",
        ),
    ],
)
def test_what_cannot_be_believed_is_refused_in_one_line(shell, name, text, told):
    (shell.folder / name).write_text(text)
    assert refusal(shell, name, *AROUND, "--depth", "2").startswith(told)


def test_what_is_missing_is_said(shell):
    (shell.folder / "a.geojson").write_text(collection())
    assert refusal(shell, "b.geojson", *AROUND, "--depth", "2") == "b.geojson: no such file; check the path"
    assert refusal(shell, ".", *AROUND, "--depth", "2") == ".: is a folder; name a file in it"
    assert "it is a device and no regular file" in refusal(shell, "/dev/null", *AROUND, "--depth", "2")
    assert "--depth: is missing" in refusal(shell, "a.geojson", *AROUND)
    assert "--around: has no --radius" in refusal(shell, "a.geojson", *AROUND[:2])


# ---------------------------------------------------------------------------------- what GDAL reads


def layer(path, shapes, name, driver="GPKG", crs="EPSG:4326", **fields):
    """Write a layer of shapes as a chart program would."""
    write = pytest.importorskip("pyogrio.raw").write
    write(
        path,
        geometry=np.array([shapely.to_wkb(s) for s in shapes], dtype=object),
        field_data=[np.array(values) for values in fields.values()],
        fields=list(fields),
        layer=name,
        driver=driver,
        crs=crs,
        geometry_type=shapes[0].geom_type,
        append=path.exists(),
    )


def obstacles(folder, name="chart"):
    features = json.loads((folder / f"{name}.geojson").read_text())["features"]
    return {f["properties"]["reason"] for f in features}


def test_layers_called_as_s57_calls_its_classes_are_read_as_those(shell):
    path = shell.folder / "cell.gpkg"
    west, east = box(-1.34, 50.79, -1.31, 50.85), box(-1.31, 50.79, -1.28, 50.85)
    layer(path, [west, east], "DEPARE", DRVAL1=np.array([0.5, 5.0]))
    layer(path, [Point(-1.305, 50.82), Point(-1.30, 50.82)], "WRECKS", VALSOU=np.array([1.0, 9.0]))
    code, out, err = shell(path, *AROUND, "--depth", "2")
    assert (code, err) == (0, "")
    assert "1 shallow area, 1 wreck" in out
    assert obstacles(shell.folder) == {"shallow", "wreck"}


def test_a_cell_without_depths_is_refused_unless_that_is_known(shell):
    path = shell.folder / "cell.gpkg"
    layer(path, [ISLAND], "LNDARE", OBJNAM=np.array(["Hat"]))
    assert refusal(shell, path, *AROUND, "--depth", "2").endswith(
        "holds no depth area and no sounding: nothing is known of its water's depth; take another cell, or say "
        "--without-depths"
    )
    assert shell(path, *AROUND, "--depth", "2", "--without-depths")[0] == 0


def test_a_shapefile_in_metres_of_a_country_is_brought_to_where_it_lies(shell):
    from pyproj import Transformer

    path = shell.folder / "coast.shp"
    to_grid = Transformer.from_crs("EPSG:4326", "EPSG:32630", always_xy=True)
    there = shapely.transform(ISLAND, lambda p: np.column_stack(to_grid.transform(p[:, 0], p[:, 1])))
    layer(path, [there], "coast", driver="ESRI Shapefile", crs="EPSG:32630", called=np.array(["Hat"]))
    assert shell(path, *AROUND, "--depth", "2")[0] == 0
    (feature,) = json.loads((shell.folder / "chart.geojson").read_text())["features"]
    assert shapely.covers(shapely.from_geojson(json.dumps(feature["geometry"])), ISLAND)
    path.with_suffix(".prj").unlink()
    assert (
        "coast.shp: coast: does not say its reference system; put its .prj beside it"
        in shell(path, *AROUND, "--depth", "2", "--force")[2]
    )


def test_an_osm_extract_has_shores_and_seamarks(shell):
    pytest.importorskip("pyogrio")
    (shell.folder / "a.osm").write_text(
        """<osm version="0.6">
<node id="1" lat="50.821" lon="-1.312"><tag k="seamark:type" v="rock"/><tag k="name" v="Hat"/></node>
<node id="2" lat="50.822" lon="-1.310"/><node id="3" lat="50.823" lon="-1.308"/>
<way id="4"><nd ref="2"/><nd ref="3"/><tag k="natural" v="coastline"/></way>
<way id="5"><nd ref="2"/><nd ref="1"/><tag k="highway" v="path"/></way>
</osm>"""
    )
    code, _, err = shell("a.osm", *AROUND, "--depth", "2")
    assert (code, err) == (0, "")
    features = json.loads((shell.folder / "chart.geojson").read_text())["features"]
    assert sorted(f["properties"]["name"] for f in features) == ["Hat (rock)", "shore"]
    (shore,) = (f for f in features if f["properties"]["name"] == "shore")
    line = LineString([(-1.310, 50.822), (-1.308, 50.823)])
    assert shapely.covers(shapely.from_geojson(json.dumps(shore["geometry"])), line)


def test_what_was_written_is_read_again_as_it_is(shell):
    """A wreck of 20 m was one of 10, and all had lost reason, depth and margin."""
    wreck = {"kind": "exclusion", "name": "Ada (wreck)", "reason": "wreck", "radius_m": 20.0, "depth_m": 1.0}
    shallow = {"kind": "exclusion", "name": "shallow", "reason": "shallow", "depth_m": 0.5, "margin_m": 7.0}
    deep = {"kind": "exclusion", "name": "wreck", "reason": "wreck", "radius_m": 20.0, "depth_m": 9.0}
    fence = {"kind": "inclusion", "name": "the chart's edge"}
    features = [(Point(-1.31, 50.825), wreck), (ISLAND, shallow), (Point(-1.31, 50.815), deep)]
    (shell.folder / "own.geojson").write_text(collection(*features, (box(-1.33, 50.81, -1.29, 50.83), fence)))
    code, out, _ = shell("own.geojson", *AROUND, "--depth", "2")
    assert code == 0
    assert out.startswith(
        "own.geojson: note: holds 1 zone to keep in: only what to keep out of is taken; name the file as the mission's "
        "fence\n"
    )
    found = [f["properties"] for f in json.loads((shell.folder / "chart.geojson").read_text())["features"]]
    kept = ({key: each[key] for key in each if key != "source"} for each in found)
    assert sorted(kept, key=lambda each: each["name"]) == [wreck, shallow]


@pytest.mark.parametrize(("kind", "count"), [("exclusion", 2), ("inclusion", 0)])
def test_of_drawings_what_is_to_keep_out_of_is_solid(tmp_path, kind, count):
    """A fence in a KML was an obstacle as large as the water, and a circle nothing."""
    ring = "-1.33,50.81 -1.29,50.81 -1.29,50.83 -1.33,50.83 -1.33,50.81"
    data = f'<ExtendedData><Data name="kind"><value>{kind}</value></Data></ExtendedData>'
    (tmp_path / "f.kml").write_text(
        f'<kml xmlns="http://www.opengis.net/kml/2.2"><Document><Placemark><name>a</name>{data}<Polygon><outerBoundaryIs>'
        f"<LinearRing><coordinates>{ring}</coordinates></LinearRing></outerBoundaryIs></Polygon></Placemark>"
        f"<Placemark><name>b</name>{data}<Point><coordinates>-1.31,50.82</coordinates></Point></Placemark></Document></kml>"
    )
    here = box_about(GeoPoint(lat_deg=50.82, lon_deg=-1.31), 1500.0)
    chart = read_chart(tmp_path / "f.kml", here, Wanted(safety_depth_m=2.0))
    assert [(d.name, d.radius_m) for d in chart.dangers] == [("a", 0.0), ("b", 10.0)][:count]
    assert any("2 zones to keep in" in f.text for f in chart.findings) == (count == 0)


def test_a_circle_that_is_drawn_is_solid_and_as_large(tmp_path):
    circle = Zone(kind=ZoneKind.EXCLUSION, shape=Circle(GeoPoint(lat_deg=50.82, lon_deg=-1.31), 35.0), name="rock")
    (tmp_path / "c.wkt").write_bytes(write(Document(zones=(circle,)), "c.plan").data)  # told by its content
    here = box_about(GeoPoint(lat_deg=50.82, lon_deg=-1.31), 1500.0)
    (danger,) = read_chart(tmp_path / "c.wkt", here, Wanted(safety_depth_m=2.0)).dangers
    assert danger.radius_m == 35.0
    assert (danger.geometry.x, danger.geometry.y) == pytest.approx((-1.31, 50.82))


@pytest.mark.parametrize("west_deg", [-131.0, 229.0])
@pytest.mark.parametrize("ending", ["asc", "tif"])
def test_a_grid_that_counts_to_360_is_read_as_one_that_counts_to_180(tmp_path, west_deg, ending):
    heights = np.full((200, 200), -50.0)
    heights[90:110, 90:110] = 5.0
    path = grid_file(tmp_path / f"g.{ending}", heights, west_deg, 36.0, 0.01)
    here = box_about(GeoPoint(lat_deg=35.0, lon_deg=-130.0), 20_000.0)
    (shoal,) = read_chart(path, here, Wanted(safety_depth_m=2.0)).dangers
    west, south, east, north = shoal.geometry.bounds
    assert (west, south, east, north) == pytest.approx((-130.1, 34.9, -129.9, 35.1), abs=0.011)


@pytest.mark.parametrize("ending", ["asc", "tif"])
def test_over_the_date_line_the_two_ends_of_a_grid_of_the_world_join(tmp_path, ending):
    """A wall of a cell stood there: "no chart"; and of a GeoTIFF only the half on this side was read."""
    path = grid_file(tmp_path / f"w.{ending}", np.full((100, 3600), -50.0), -180.0, 5.0, 0.1)
    center = GeoPoint(lat_deg=0.0, lon_deg=180.0)
    chart = read_chart(path, box_about(center, 60_000.0), Wanted(safety_depth_m=2.0))
    assert area_of([chart], center, 60_000.0).solids == ()


@pytest.mark.parametrize("ending", ["asc", "tif"])
def test_a_hole_that_a_grid_does_not_declare_is_solid_and_told(shell, ending):
    heights = np.full((20, 20), -9.0)
    heights[8:12, 8:12] = -32768.0
    heights[0, 0] = 1.0
    path = grid_file(shell.folder / f"g.{ending}", heights, -1.32, 50.83, 0.001)
    code, out, _ = shell(path, "--around", "50.82,-1.31", "--radius", "500", "--depth", "2")
    assert code == 0
    assert (
        "g." + ending + ": warning: has cells of -32768, which it does not call nothing and no depth is: solid" in out
    )
    (hole,) = json.loads((shell.folder / "chart.geojson").read_text())["features"]
    assert shapely.covers(shapely.from_geojson(json.dumps(hole["geometry"])), box(-1.312, 50.818, -1.308, 50.822))


def test_a_geotiff_that_does_not_say_where_its_numbers_are_from_is_refused(shell):
    path = grid_file(shell.folder / "g.tif", np.full((20, 20), -9.0), -1.32, 50.83, 0.001, crs=None)
    told = refusal(shell, path, "--around", "50.82,-1.31", "--radius", "800", "--depth", "2")
    assert "g.tif: does not say its reference system; write it in" in told


@pytest.mark.parametrize("ending", ["asc", "tif"])
def test_degrees_of_another_datum_are_brought_to_wgs84(tmp_path, ending):
    """A rock by an old Australian datum was 200 m from where it is."""
    pyproj = pytest.importorskip("pyproj")
    heights = np.full((200, 200), -9.0)
    heights[100, 100] = 1.0
    path = grid_file(tmp_path / f"g.{ending}", heights, 147.3, -42.8, 0.001, crs="EPSG:4202")
    path.with_suffix(".prj").write_text(pyproj.CRS("EPSG:4202").to_wkt("WKT1_ESRI"))
    at = (147.4005, -42.9005)
    lon, lat = pyproj.Transformer.from_crs("EPSG:4202", "EPSG:4326", always_xy=True).transform(*at)
    assert abs(lon - at[0]) > 0.001
    (rock,) = read_chart(
        path, box_about(GeoPoint(lat_deg=-42.9, lon_deg=147.4), 3000.0), Wanted(safety_depth_m=2)
    ).dangers
    assert (rock.geometry.centroid.x, rock.geometry.centroid.y) == pytest.approx((lon, lat), abs=1e-4)


def grid_file(path, heights, west_deg, north_deg, cell_deg, crs="EPSG:4326"):
    """Write a grid whose first row lies in the north, as its ending says."""
    rows, columns = heights.shape
    if path.suffix == ".asc":
        head = f"ncols {columns}\nnrows {rows}\nxllcorner {west_deg}\nyllcorner {north_deg - rows * cell_deg}\n"
        lines = "\n".join(" ".join(map(str, row)) for row in heights)
        path.write_text(f"{head}cellsize {cell_deg}\n{lines}\n")
        return path
    rasterio = pytest.importorskip("rasterio")
    affine = rasterio.Affine(cell_deg, 0, west_deg, 0, -cell_deg, north_deg)
    shape = {"width": columns, "height": rows, "count": 1, "dtype": "float64"}
    with rasterio.open(path, "w", driver="GTiff", crs=crs, transform=affine, **shape) as out:
        out.write(heights, 1)
    return path


@pytest.mark.parametrize("up", [True, False])
@pytest.mark.parametrize("positive", ["up", "down"])
def test_a_geotiff_is_the_same_water_whichever_way_it_is_written(shell, up, positive):
    rasterio = pytest.importorskip("rasterio")
    heights = np.full((20, 20), -9.0, dtype=np.float32)
    heights[4, 12] = 1.0  # row 4 from the north
    north, south = 50.83, 50.81
    affine = (
        rasterio.Affine(0.001, 0, -1.32, 0, -0.001, north) if up else rasterio.Affine(0.001, 0, -1.32, 0, 0.001, south)
    )
    data = heights if up else heights[::-1]
    with rasterio.open(
        "g.tif", "w", driver="GTiff", width=20, height=20, count=1, dtype="float32", crs="EPSG:4326", transform=affine
    ) as out:
        out.write(data if positive == "up" else -data, 1)
        out.update_tags(1, positive=positive)
    code, _, err = shell("g.tif", "--around", "50.82,-1.31", "--radius", "800", "--depth", "2")
    assert (code, err) == (0, "")
    shoals = [
        shapely.from_geojson(json.dumps(f["geometry"]))
        for f in json.loads((shell.folder / "chart.geojson").read_text())["features"]
        if f["properties"]["reason"] != "no chart"
    ]
    (shoal,) = shoals
    assert shapely.covers(shoal, Point(-1.3075, 50.8255))
    assert not shapely.covers(shoal, Point(-1.3075, 50.8145))


def test_a_chart_that_gdal_cannot_read_is_told_in_one_line(shell):
    pytest.importorskip("pyogrio")
    (shell.folder / "a.gpkg").write_bytes(b"SQLite format 3\x00 and no more")
    assert "a.gpkg: cannot be read whole (" in refusal(shell, "a.gpkg", *AROUND, "--depth", "2")


def test_without_the_extra_it_is_one_line(shell, monkeypatch):
    monkeypatch.setitem(sys.modules, "pyogrio", None)
    (shell.folder / "a.gpkg").write_bytes(b"SQLite format 3\x00")
    assert shell("a.gpkg", *AROUND, "--depth", "2")[2] == (
        "companion chart: pyogrio is not installed, which this needs; in the clone of this project: "
        "pip install '.[chart]'\n"
    )


@pytest.mark.parametrize(
    ("name", "data"), [("notes.txt", b"Hayling: keep off the bar.\n"), ("a.gpkg", "Untiefe: l\u00e4nger\n".encode())]
)
def test_a_text_that_is_no_chart_is_called_so_with_and_without_the_extra(shell, monkeypatch, name, data):
    """Who named his notes was told to install pyogrio, and with it to fetch the file again."""
    (shell.folder / name).write_bytes(data)
    for _ in range(2):
        assert f"{name}: is no chart file; name an S-57 cell (.000)" in refusal(shell, name, *AROUND, "--depth", "2")
        monkeypatch.setitem(sys.modules, "pyogrio", None)


@pytest.mark.parametrize(
    ("name", "text"),
    [("heights.csv", "2026-11-24T06:10Z, 0.9\n2026-11-24T12:10Z, 3.9\n"), ("survey.csv", "lat,lon,m\n50.8,-1.3,0.4\n")],
)
def test_a_table_is_no_water_without_a_danger(shell, name, text):
    """A table of the tide, or soundings in a spreadsheet, made a chart of nothing solid at all."""
    pytest.importorskip("pyogrio")
    (shell.folder / name).write_text(text)
    assert f"{name}: holds no places, as a table does; name an S-57 cell" in refusal(
        shell, name, *AROUND, "--depth", "2"
    )


def test_a_file_that_gdal_knows_no_format_of_is_no_chart(shell):
    pytest.importorskip("pyogrio")
    (shell.folder / "photo.png").write_bytes(b"\x89PNG\x00\x01")
    assert "photo.png: is no chart file" in refusal(shell, "photo.png", *AROUND, "--depth", "2")


def test_a_chart_that_lies_elsewhere_makes_no_free_water(shell):
    """It was "no danger", with exit code 0: an area without an obstacle."""
    there = box(10.0, 40.0, 10.1, 40.1)
    (shell.folder / "other.geojson").write_text(collection((there, {})))
    (shell.folder / "other.wkt").write_text(there.wkt)
    (shell.folder / "swapped.wkt").write_text(box(50.8, -1.35, 50.9, -1.25).wkt)
    (shell.folder / "here.geojson").write_text(collection((ISLAND, {})))
    reaches = "warning: reaches from 40.0000, 10.0000 to 40.1000, 10.1000 and holds nothing of the place"
    for name in ("other.geojson", "other.wkt"):
        code, out, err = shell(name, *AROUND, "--depth", "2")
        assert (code, err) == (
            1,
            f"companion chart: chart.geojson: not written: {name} holds nothing of the water that is asked for\n",
        )
        assert out.startswith(f"{name}: {reaches} that is asked for; fetch it for the mission's water\n")
        assert not list(shell.folder.glob("chart*"))
    assert "are latitude and longitude swapped in it?" in shell("swapped.wkt", *AROUND, "--depth", "2")[1]
    code, out, _ = shell("other.wkt", "here.geojson", *AROUND, "--depth", "2")  # one of many cells, perhaps
    assert code == 0
    assert f"other.wkt: {reaches}" in out
    assert "written: 1 obstacle" in out


def test_what_a_chart_holds_is_told_with_number_and_noun():
    """ "39 shore construction", "9 land" and "1 fishing stakes" were said of a cell."""
    reasons = ["shore construction", "marine farm", "land", "dries", "fishing stakes"]
    chart = read_of([*reasons, "shallow", "sounding"], 1)
    assert told_of(chart) == (
        "1 shore construction, 1 marine farm, 1 piece of land, 1 area that dries, 1 fishing stake, 1 shallow area, "
        "1 sounding"
    )
    assert told_of(read_of([*reasons, "beach"], 2)) == (
        "2 shore constructions, 2 marine farms, 2 pieces of land, 2 areas that dry, 2 fishing stakes, 2 beaches"
    )
    assert told_of(read_of(["shallow or land", "drawn", "kept by custom"], 2)) == (
        "2 shallow or dry areas, 2 drawn shapes, 2 kept by custom"
    )
    assert told_of(read_of([], 1)) == "no danger"


def read_of(reasons, each):
    """A chart with so many dangers of each kind."""
    dangers = tuple(Danger(reason=reason, geometry=Point(0.0, 0.0)) for reason in reasons for _ in range(each))
    return Chart(source=Source(name="cell"), dangers=dangers)
