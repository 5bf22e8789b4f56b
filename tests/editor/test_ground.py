"""The files of an area: what was not touched stays as it stood, and what is written is read again as it was drawn."""

import json

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from companion.editor.base import NotEditable, can_hold, ground_of, new_ground, written
from companion.editor.sketch import Shape, number

WKT = """# a chart; no geometry
Calf|exclusion|POLYGON ((1.0 50.0, 1.10 50.0, 1.1 50.1, 1.0 50.0))   # its tower is white

 POLYGON((2 50,2.1 50,2.1 50.1,2 50),
  (2.05 50.01,2.06 50.01,2.06 50.02,2.05 50.01))
Two rocks|exclusion|MULTIPOINT (3 50, 3.1 50)
LINESTRING (4 50, 4.1 50)
# the end"""
GEOJSON = json.dumps(
    {
        "type": "FeatureCollection",
        "name": "[] features",
        "features": [
            {
                "type": "Feature",
                "id": 7,
                "properties": {"name": "Rock", "radius_m": 5, "colour": "red"},
                "geometry": {"type": "Point", "coordinates": [1.5, 50.0]},
            },
            {
                "type": "Feature",
                "properties": {"role": "waypoint"},
                "geometry": {"type": "Point", "coordinates": [9, 9]},
            },
            {
                "type": "Feature",
                "properties": {"kind": "inclusion", "margin_m": 3.0},
                "geometry": {"type": "Polygon", "coordinates": [[[1, 50], [2, 50], [2, 51], [1, 50]]]},
            },
            {
                "type": "Feature",
                "properties": None,
                "geometry": {
                    "type": "MultiPolygon",
                    "coordinates": [[[[3, 50], [4, 50], [4, 51], [3, 50]]], [[[5, 50], [6, 50], [6, 51], [5, 50]]]],
                },
            },
        ],
    },
    indent=2,
)
TEXTS = {"wkt": WKT, "geojson": GEOJSON}

places = st.tuples(
    st.integers(-900_000_000, 900_000_000).map(lambda n: n / 1e7),
    st.integers(-1_800_000_000, 1_800_000_000).map(lambda n: n / 1e7),
)
rings = st.lists(places, min_size=3, max_size=6, unique=True).map(tuple)
words = st.text("abc é'-\"", max_size=8).map(lambda s: " ".join(s.split()))


@st.composite
def shapes(draw):
    kind = draw(st.sampled_from(["polygon", "circle", "point", "line"]))
    return Shape(
        type=kind,
        zone=draw(st.sampled_from(["inclusion", "exclusion"])),
        name=draw(words),
        rings=tuple(draw(st.lists(rings, min_size=1, max_size=2)))
        if kind == "polygon"
        else (draw(rings) if kind == "line" else (draw(places),),),
        radius_m=draw(st.sampled_from([5.0, 12.5])) if kind == "circle" else None,
        margin_m=draw(st.sampled_from([None, 4.0])),
    )


def contents(found):
    return sorted(msgspec.json.encode(shape.content) for shape in found)


@pytest.mark.parametrize("kind", ["wkt", "geojson"])
def test_what_is_in_a_file(kind):
    ground = ground_of("f", TEXTS[kind], kind, "exclusion")
    found = [(s.type, s.zone, s.name, len(s.rings), s.key) for s in ground.shapes]
    assert (
        found
        == {
            "wkt": [
                ("polygon", "exclusion", "Calf", 1, 0),
                ("polygon", "exclusion", "", 2, 1),
                ("point", "exclusion", "Two rocks", 1, 2),
                ("point", "exclusion", "Two rocks", 1, 3),
                ("line", "exclusion", "", 1, 4),
            ],
            "geojson": [
                ("circle", "exclusion", "Rock", 1, 0),
                ("polygon", "inclusion", "", 1, 1),
                ("polygon", "exclusion", "", 1, 2),
                ("polygon", "exclusion", "", 1, 3),
            ],
        }[kind]
    )
    assert written(ground, ground.shapes) == TEXTS[kind]


@pytest.mark.parametrize("kind", ["wkt", "geojson"])
@given(data=st.data())
def test_what_was_drawn_is_read_again_and_the_rest_stands(kind, data):
    ground = ground_of("f", TEXTS[kind], kind, "exclusion")
    drawn = []
    for shape in ground.shapes:
        fate = data.draw(st.sampled_from(["stays", "stays", "goes", "moves"]))
        if fate == "moves":
            other = data.draw(shapes().filter(lambda s: can_hold(kind, s)))
            drawn.append(msgspec.structs.replace(other, of="f", key=shape.key))
        elif fate == "stays":
            drawn.append(shape)
    new = data.draw(st.lists(shapes().filter(lambda s: can_hold(kind, s)), max_size=2))
    text = written(ground, [*drawn, *new])
    if drawn or new:
        assert contents(ground_of("f", text, kind, "exclusion").shapes) == contents([*drawn, *new])
    for piece in ground.pieces:
        if all(ground.shapes[n] in drawn for n in piece.shapes):
            assert ground.text[piece.begin : piece.end] in text
    if kind == "wkt":
        assert "# a chart; no geometry\n" in text
        assert "# the end" in text
    else:
        assert json.loads(text)["name"] == "[] features"


@given(st.lists(shapes(), min_size=1, max_size=4))
def test_a_new_file_holds_what_is_drawn(drawn):
    for name in ("f.wkt", "f.geojson"):
        kept = [s for s in drawn if can_hold(name[2:], s)]
        ground = new_ground(name, "exclusion")
        if kept:
            assert contents(ground_of(name, written(ground, kept), name[2:], "exclusion").shapes) == contents(kept)


def test_foreign_words_of_a_feature_stay_when_it_is_moved():
    ground = ground_of("f", GEOJSON, "geojson", "exclusion")
    moved = msgspec.structs.replace(ground.shapes[0], rings=(((50.5, 1.6),),))
    root = json.loads(written(ground, [moved, *ground.shapes[1:]]))
    assert root["features"][0]["id"] == 7
    assert root["features"][0]["properties"]["colour"] == "red"
    assert root["features"][0]["geometry"]["coordinates"] == [1.6, 50.5]
    assert len(root["features"]) == 4


@pytest.mark.parametrize(
    ("text", "kind"),
    [
        ("POLYGON EMPTY", "wkt"),
        ("POLYGON ((1 2, 3 4), EMPTY)", "wkt"),
        ("POINT (190 50)", "wkt"),
        ('{"type": "Feature", "geometry": null}', "geojson"),
        ("[1]", "geojson"),
        (
            (
                '{"type": "FeatureCollection", "features":'
                ' [{"type": "Feature", "geometry": {"type": "GeometryCollection"}}]}'
            ),
            "geojson",
        ),
        ('{"type": "FeatureCollection", "features": [3]}', "geojson"),
        ("<kml/>", "kml"),
    ],
)
def test_what_is_not_drawn_here_is_said(text, kind):
    with pytest.raises(NotEditable):
        ground_of("f", text, kind, "exclusion")


def test_broken_rings_are_drawn_as_they_are_so_that_they_can_be_mended():
    ground = ground_of("f", "POLYGON ((0 0, 1 1, 1 0, 0 1, 0 0))\nPOLYGON ((2 2, 3 3, 3 2))\n", "wkt", "exclusion")
    assert [len(shape.rings[0]) for shape in ground.shapes] == [4, 3]


@given(st.floats(-180.0, 180.0))
def test_a_coordinate_is_written_as_the_same_number_and_without_an_exponent(value):
    text = number(value)
    assert "e" not in text
    assert float(text) == value or abs(float(text) - value) < 1e-19
