"""S-57 cells: read as their bytes have them, with header, updates and quality; broken ones are told."""

import json
import random

import pytest
import shapely
from shapely.geometry import Point, box

from companion import cli
from companion.chart import Wanted, read_chart
from companion.errors import InputError
from tests.chart.cell import Cell

pytest.importorskip("pyogrio")
WATER = box(-1.34, 50.79, -1.28, 50.85)
SHOAL = box(-1.312, 50.821, -1.308, 50.823)
BOX = (-1.35, 50.78, -1.27, 50.86)
WANTED = Wanted(safety_depth_m=2.0)


def ring(shape):
    return list(shape.exterior.coords)


def cell(water=WATER, zone=None, **header):
    made = Cell(**header)
    made.area("M_COVR", ring(water), CATCOV=1)
    made.area("DEPARE", ring(water), DRVAL1=10)
    if zone is not None:
        made.area("M_QUAL", ring(water), CATZOC=zone)
    return made


def written(folder, made, name="XX5TEST.000"):
    (folder / name).write_bytes(made.data())
    return folder / name


def test_a_cell_is_read_as_it_is_written(tmp_path):
    made = cell(zone=2, edition="7")
    made.area("DEPARE", ring(SHOAL), DRVAL1=0.5)
    made.point("UWTROC", -1.305, 50.82, OBJNAM="Hat")
    made.point("WRECKS", -1.300, 50.82, VALSOU=12.5)
    made.soundings([(-1.31, 50.815, 1.2), (-1.31, 50.81, 12.3)])
    chart = read_chart(written(tmp_path, made), BOX, WANTED)
    assert str(chart.source) == "XX5TEST edition 7 of 2026-01-02"
    assert (chart.resolution_m, chart.supersedes, chart.knows_depths) == (6.0, True, True)
    assert chart.coverage.equals(WATER)
    told = {d.reason: (d.depth_m, d.doubt_m, d.name) for d in chart.dangers}
    assert told == {"shallow": (0.5, 20.0, ""), "rock": (None, 20.0, "Hat"), "sounding": (1.2, 20.0, "")}
    shapes = {d.reason: d.geometry for d in chart.dangers}
    assert shapes["shallow"].equals(SHOAL)
    assert shapes["sounding"].equals(Point(-1.31, 50.815))


def test_what_is_out_of_reach_is_left_out(tmp_path):
    made = cell()
    made.point("UWTROC", -1.281, 50.849)
    assert read_chart(written(tmp_path, made), (-1.32, 50.8, -1.30, 50.81), WANTED).dangers == ()


def test_two_cells_are_one_area_by_the_command(tmp_path, monkeypatch, capsys):
    """Land over the seam has no gap, water over it no wall; what neither covers is solid; each says what it is of."""
    monkeypatch.chdir(tmp_path)
    west, east = cell(box(-1.34, 50.79, -1.31, 50.85)), cell(box(-1.31, 50.79, -1.28, 50.85), edition="9")
    west.area("LNDARE", ring(box(-1.32, 50.82, -1.31, 50.822)))
    east.area("LNDARE", ring(box(-1.31, 50.82, -1.30, 50.822)))
    written(tmp_path, west, "a.000")
    written(tmp_path, east, "b.000")
    words = ["chart", "import", "a.000", "b.000", "--around", "50.82,-1.31", "--radius", "5000", "--depth", "2"]
    assert cli.main(words) == 0
    assert "XX5TEST edition 9 of 2026-01-02: 1 piece of land" in capsys.readouterr().out
    features = json.loads((tmp_path / "chart.geojson").read_text())["features"]
    shapes = [(f["properties"], shapely.from_geojson(json.dumps(f["geometry"]))) for f in features]
    solid = shapely.union_all([shape for _, shape in shapes])
    assert shapely.covers(solid, box(-1.3199, 50.8201, -1.3001, 50.8219))
    assert not shapely.intersects(solid, box(-1.3300, 50.8000, -1.2900, 50.8190))
    assert {(p["reason"], p.get("edition")) for p, _ in shapes} == {("land", "4"), ("land", "9"), ("no chart", None)}
    assert shapely.covers(solid, Point(-1.3450, 50.82))


@pytest.mark.parametrize(
    ("header", "told"),
    [
        ({"datum": 89}, "DSID: its horizontal datum (HDAT 89) is not WGS 84; take an edition in WGS 84"),
        ({"units": 2}, "DSID: its depths are in fathoms and feet; take an edition in metres"),
        ({"units": 3}, "DSID: its depths are in feet; take an edition in metres"),
    ],
)
def test_a_header_that_is_not_to_be_believed(tmp_path, header, told):
    path = written(tmp_path, cell(**header))
    with pytest.raises(InputError) as refused:
        read_chart(path, BOX, WANTED)
    assert str(refused.value) == f"{path}: {told}"


def test_an_update_that_is_missing_is_told(tmp_path):
    path = written(tmp_path, cell())
    path.with_suffix(".002").write_bytes(b"")
    with pytest.raises(
        InputError, match="update 001: is missing, and 002 is there; fetch it, or remove the later ones"
    ):
        read_chart(path, BOX, WANTED)


def test_a_cell_without_depths_is_refused(tmp_path):
    made = Cell()
    made.area("M_COVR", ring(WATER), CATCOV=1)
    made.area("LNDARE", ring(SHOAL))
    path = written(tmp_path, made)
    with pytest.raises(InputError, match="holds no depth area and no sounding"):
        read_chart(path, BOX, WANTED)
    assert [d.reason for d in read_chart(path, BOX, WANTED, without_depths=True).dangers] == ["land"]


@pytest.mark.parametrize("seed", range(12))
def test_a_damaged_cell_is_one_line_or_has_all_its_dangers(tmp_path, seed):
    rng = random.Random(seed)
    made = cell(zone=3)
    made.area("DEPARE", ring(SHOAL), DRVAL1=0.5)
    made.soundings([(-1.31, 50.815, 1.2)])
    data = bytearray(made.data())
    if seed % 3 == 0:
        data = data[: rng.randrange(24, len(data))]
    else:
        for _ in range(10):
            data[rng.randrange(24, len(data))] = rng.randrange(256)
    path = tmp_path / "XX5TEST.000"
    path.write_bytes(data)
    whole = {d.reason for d in read_chart(written(tmp_path, made, "WHOLE.000"), BOX, WANTED).dangers}
    told = ""
    try:
        found = {d.reason for d in read_chart(path, BOX, WANTED).dangers}
    except InputError as error:
        found, told = whole, str(error)
    assert whole <= found
    assert "\n" not in told
    assert told == "" or told.startswith(str(path))
