"""What is drawn of a chart: the whole of it in its tiles, at every scale no more than a screen can show."""

import json
import math

import numpy as np
import pytest
import shapely
from shapely.geometry import LineString, MultiPoint, Point, Polygon, box

from companion.chart import ChartPicture, read_picture
from companion.chart.features import Row, Source
from companion.chart.picture import FINEST_M, LEVELS, OVERLAP_UNITS, TILE_UNITS, UNITS, Mark, marks_of_rows

SOURCE = Source(name="XX5TEST")
WATER = box(-1.34, 50.79, -1.28, 50.85)


def picture_of(*marks):
    return ChartPicture(SOURCE, marks)


def tiles(picture, level):
    """Every tile of a level, by its column and row."""
    facts = picture.facts()
    size_m = FINEST_M * 2.0**level / UNITS * TILE_UNITS
    columns, rows = (int(facts[side] // size_m) + 1 for side in ("wide_m", "tall_m"))
    return {(x, y): json.loads(picture.tile(level, x, y)) for x in range(columns) for y in range(rows)}


def corners(flat):
    return np.cumsum(np.reshape(flat, (-1, 2)), axis=0)


def painted(picture, level):
    """What the tiles of a level paint as areas of one kind and depth [the picture's metres], without their overlaps."""
    unit_m = FINEST_M * 2.0**level / UNITS
    out = {}
    for (x, y), tile in tiles(picture, level).items():
        own = box(x, y, x + 1, y + 1)
        for kind, depth_m, rings in tile["areas"]:
            shape = shapely.build_area(shapely.union_all([shapely.linearrings(corners(ring)) for ring in rings]))
            moved = shapely.transform(shape, lambda c, x=x, y=y: c / TILE_UNITS + [x, y])
            out.setdefault((kind, depth_m), []).append(shapely.intersection(shapely.make_valid(moved), own))
    return {
        key: shapely.transform(shapely.union_all(found), lambda c: c * TILE_UNITS * unit_m)
        for key, found in out.items()
    }


def test_the_features_of_a_cell_become_areas_lines_and_points():
    line = LineString([(-1.33, 50.80), (-1.30, 50.81)])
    soundings = shapely.from_wkt("MULTIPOINT Z (-1.31 50.82 3.4, -1.30 50.82 -0.5)")
    rows = [
        Row(layer="DEPARE", place="", geometry=WATER, attributes={"DRVAL1": 5.0, "DRVAL2": 10.0}),
        Row(layer="DRGARE", place="", geometry=WATER, attributes={}),
        Row(layer="LNDARE", place="", geometry=box(-1.31, 50.82, -1.30, 50.83), attributes={"OBJNAM": "Hat"}),
        Row(layer="DEPCNT", place="", geometry=line, attributes={"VALDCO": 5.0}),
        Row(layer="COALNE", place="", geometry=line),
        Row(layer="SOUNDG", place="", geometry=soundings),
        Row(layer="WRECKS", place="", geometry=Point(-1.3, 50.8), attributes={"VALSOU": 1.5, "OBJNAM": "Mary"}),
        Row(layer="BOYLAT", place="", geometry=Point(-1.3, 50.8), attributes={"OBJNAM": "3"}),
        Row(layer="RESARE", place="", geometry=WATER),
    ]
    found = [(m.kind, m.depth_m if m.kind != "name" else None, m.text) for m in marks_of_rows(rows)]
    assert found == [
        ("depth", 5.0, ""),
        ("unknown", None, ""),
        ("name", None, "Hat"),
        ("land", None, ""),
        ("contour", 5.0, ""),
        ("shore", None, ""),
        ("sounding", 3.4, ""),
        ("sounding", -0.5, ""),
        ("wreck", 1.5, "Mary"),
        ("buoy", None, "3"),
    ]


@pytest.mark.parametrize("level", [0, 2, 4, 7])
def test_its_tiles_together_paint_what_the_chart_holds(level):
    """An area with a hole, over several tiles: nothing is lost at a seam, nothing is off by more than the tolerance."""
    t = np.linspace(0.0, 2.0 * math.pi, 400)[:-1]
    wavy = np.column_stack([-1.31 + 0.012 * np.cos(t) * (1.0 + 0.1 * np.sin(9 * t)), 50.82 + 0.008 * np.sin(t)])
    island = Polygon(wavy, [box(-1.311, 50.8195, -1.309, 50.8205).exterior.coords])
    picture = picture_of(Mark(kind="depth", geometry=island, depth_m=2.0))
    corner = np.array(picture.bounds_deg[:2])
    truth = shapely.transform(island, lambda c: (c - corner) * [picture.lon_m, 111_195.0])
    (key, shape), *others = painted(picture, level).items()
    assert (key, others) == (("depth", 2.0), [])
    tolerance_m = FINEST_M * 2.0**level
    wrong = shapely.symmetric_difference(shape, truth)
    assert shapely.buffer(wrong, -0.75 * tolerance_m).is_empty
    assert wrong.area < 0.5 * tolerance_m * truth.length


def test_areas_are_painted_from_deep_to_shallow_and_land_on_top():
    marks = [Mark(kind="land", geometry=WATER), Mark(kind="unknown", geometry=WATER)]
    marks += [Mark(kind="depth", geometry=WATER, depth_m=d) for d in (-1.0, 20.0, 5.0)]
    told = json.loads(picture_of(*marks).tile(5, 0, 0))
    assert [(kind, d) for kind, d, _ in told["areas"]] == [
        ("depth", 20.0),
        ("depth", 5.0),
        ("depth", -1.0),
        ("unknown", 0.0),
        ("land", 0.0),
    ]


def test_of_soundings_that_have_no_room_the_least_deep_is_shown():
    rng = np.random.default_rng(2)
    xy = rng.uniform([-1.34, 50.79], [-1.28, 50.85], (4000, 2))
    depths = rng.uniform(3.0, 30.0, 4000)
    depths[1234] = 0.3
    picture = picture_of(
        *(Mark(kind="sounding", geometry=Point(p), depth_m=d) for p, d in zip(xy, depths, strict=True))
    )
    for level in range(3, LEVELS):
        shown = tiles(picture, level).values()
        assert min(p[3] for tile in shown for p in tile["points"]) == 0.3
        assert max(len(tile["points"]) for tile in shown) <= 100
    finest = [p for tile in tiles(picture, 0).values() for p in tile["points"]]
    assert len(finest) > 2500, "where there is room they are shown"


def test_a_tile_holds_no_more_than_a_screen_can_show_of_it():
    """A coast of 200,000 corners: at every scale a tile is a few thousand, for a phone that paints it."""
    t = np.linspace(0.0, 2.0 * math.pi, 200_001)[:-1]
    rng = np.random.default_rng(8)
    reach = 0.03 * (1.0 + 0.2 * np.sin(7 * t) + 0.02 * np.sin(301 * t)) + rng.uniform(0.0, 2e-6, len(t))
    coast = Polygon(np.column_stack([-1.31 + reach * np.cos(t), 50.82 + reach * np.sin(t)]))
    picture = picture_of(Mark(kind="land", geometry=coast))
    for level in range(2, LEVELS):
        most = max(
            sum(len(r) // 2 for _, _, rings in tile["areas"] for r in rings) for tile in tiles(picture, level).values()
        )
        assert most < 4000, (level, most)


def test_a_file_is_drawn_without_what_reads_cells(tmp_path, monkeypatch):
    import sys

    for name in ("pyogrio", "rasterio"):
        monkeypatch.setitem(sys.modules, name, None)
    rows = [
        (WATER, {"layer": "DEPARE", "DRVAL1": 3.0}),
        (box(-1.31, 50.82, -1.30, 50.83), {"layer": "LNDARE", "OBJNAM": "Hat"}),
        (MultiPoint([(-1.32, 50.80)]), {"seamark:type": "rock", "name": "Old"}),
    ]
    features = [
        {"type": "Feature", "geometry": json.loads(shapely.to_geojson(shape)), "properties": said}
        for shape, said in rows
    ]
    path = tmp_path / "bay.geojson"
    path.write_text(json.dumps({"type": "FeatureCollection", "features": features}))
    picture = read_picture(path)
    assert sorted(m.kind for m in picture.marks) == ["depth", "land", "name", "rock"]
    heights = "\n".join(" ".join(str(0.5 - 0.2 * abs(c - 20)) for c in range(40)) for _ in range(40))
    header = "ncols 40\nnrows 40\nxllcorner -1.34\nyllcorner 50.79\ncellsize 0.001\n"
    (tmp_path / "bay.asc").write_text(f"{header}{heights}\n")
    grid = read_picture(tmp_path / "bay.asc")
    assert sorted({m.depth_m for m in grid.marks if m.kind == "depth"}) == [0.0, 2.0, 5.0, 10.0, 20.0, 50.0]
    assert [m.kind for m in grid.marks if m.depth_m is None] == ["land"]


def test_a_cell_is_drawn_with_its_soundings(tmp_path):
    pytest.importorskip("pyogrio")
    from tests.chart.cell import Cell

    cell = Cell()
    ring = list(WATER.exterior.coords)
    cell.area("M_COVR", ring, CATCOV=1)
    cell.area("DEPARE", ring, DRVAL1=10)
    cell.area("LNDARE", list(box(-1.31, 50.82, -1.30, 50.83).exterior.coords), OBJNAM="Hat")
    path = tmp_path / "XX5TEST.000"
    path.write_bytes(cell.data())
    picture = read_picture(path)
    assert [m.kind for m in picture.marks] == ["depth", "name", "land"]
    assert picture.resolution_m < 100.0
    assert OVERLAP_UNITS < TILE_UNITS
