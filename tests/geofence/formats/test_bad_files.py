"""Each fault of a file is named with its place; none of them makes the sea larger."""

import contextlib
import itertools
import json

import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely.geometry import Polygon

from companion.errors import InputError
from companion.geofence.area import Area, Fence
from companion.geofence.check import AreaConditions, check_area
from companion.geofence.document import Code, FindingLevel
from companion.geofence.formats.fence_items import items_to_zones
from companion.geofence.formats.registry import FORMATS, check_place, parse, write
from companion.geofence.formats.rings import Findings, polygons_from_rings
from companion.geofence.shapes import ZoneKind
from companion.messages import Command, GeoPoint, MissionItem
from tests.geofence.strategies import QUIET

SQUARE = "0 0, 0.01 0, 0.01 0.01, 0 0.01"


def found(text: str, extension: str = ".wkt", **options) -> list:
    return [f for f in parse(text.encode(), "f" + extension, extension=extension, **options).findings]  # noqa: C416


@pytest.mark.parametrize(
    ("text", "code", "words"),
    [
        (f"POLYGON (({SQUARE}))", Code.UNCLOSED, "not closed"),
        ("POLYGON ((0 0, 0.01 0.01, 0.01 0, 0 0.01, 0 0))", Code.SELF_CROSSING, "a repair would make 2 polygons"),
        ("\n\nPOLYGON EMPTY", Code.EMPTY, "holds nothing"),
        ("MULTIPOLYGON EMPTY", Code.EMPTY, "holds nothing"),
        ("GEOMETRYCOLLECTION EMPTY", Code.EMPTY, "holds nothing"),
        ("POLYGON ((0 0, 1 0, 0 0))", Code.DEGENERATE, "fewer than three"),
        ("POLYGON ((50.8 -1.3, 150.9 -1.3, 50.8 -1.2, 50.8 -1.3))", None, ""),
        ("POLYGON ((-1.3 150.8, -1.2 150.8, -1.3 150.9, -1.3 150.8))", Code.SWAPPED_AXES, "swapped"),
        ("POLYGON ((-1.3 550.8, -181.2 150.8, -1.3 150.9, -1.3 550.8))", Code.SWAPPED_AXES, "latitude"),
        (f"SRID=3857;POLYGON (({SQUARE}, 0 0))", Code.WRONG_SRID, "3857"),
        ("# nothing here but a comment\n", Code.EMPTY, "holds no geometry"),
    ],
)
def test_wkt_faults_are_found(text, code, words):
    findings = found(text)
    assert [f.code for f in findings if f.severity is FindingLevel.ERROR] == ([code] if code else [])
    if code:
        fault = next(f for f in findings if f.code is code)
        assert words in fault.text + fault.remedy
        assert "\n" not in fault.line("f.wkt")


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ("POLYGON ((0 0, 1 0, 1 1, 0 0", "line 1"),
        (f"POLYGON (({SQUARE}, 0 0))\nPOLYGON ((0 0, 1 x, 1 1, 0 0))", "line 2"),
        ("POLYGON ((0 0 0 0 0, 1 1, 1 0, 0 0))", "line 1"),
        ("POLYGON ((0,5 0,5, 1 1))", "line 1"),
        ("POLYGON ((nan 0, 1 0, 1 1, nan 0))", "line 1"),
        ("POLYGON ((0 0, 1 0, 1 inf, 0 0))", "line 1"),
        ("POLYGON ((0 0, 1e999 0, 1 1, 0 0))", "line 1"),
        ("CURVEPOLYGON ((0 0, 1 0, 1 1, 0 0))", "line 1"),
        ("POLYGON ((0 0, 1 0, 1 1, 0 0)))", "line 1"),
        ("Rock|shoal|POLYGON ((0 0, 1 0, 1 1, 0 0))", "line 1"),
        ("POLYGON " + "(" * 200 + "0 0" + ")" * 200, "line 1"),
        ("GEOMETRYCOLLECTION (" * 90 + "POINT (0 0)" + ")" * 90, "line 1"),
    ],
)
def test_text_that_is_no_wkt_is_refused_with_its_line(text, place):
    with pytest.raises(InputError) as error:
        parse(text.encode(), "f.wkt", extension=".wkt")
    assert error.value.place == place
    assert "\n" not in str(error.value)


def test_what_is_no_geometry_of_wkt_is_told_as_what_it_was_read():
    with pytest.raises(InputError, match="'CIRCLE' is not a geometry of WKT, as which this file is read"):
        parse(b"CIRCLE (0 0, 5)", "f.wkt", extension=".wkt")


@pytest.mark.parametrize(
    "text",
    [
        "polygon((0 0,0.01 0,0.01 0.01,0 0))",
        "POLYGON Z ((0 0 5, 0.01 0 5, 0.01 0.01 5, 0 0 5))",
        "POLYGONZ((0 0 5, 0.01 0 5, 0.01 0.01 5, 0 0 5))",
        "SRID=4326;POLYGON ((0 0, 0.01 0, 0.01 0.01, 0 0))",
        "﻿POLYGON ((0 0, 0.01 0,\r\n 0.01 0.01, 0 0))\r\n",
        "TRIANGLE ((0 0, 0.01 0, 0.01 0.01, 0 0))",
        "# islands\nHog|exclusion|POLYGON ((0 0, 0.01 0, 0.01 0.01, 0 0)) # a remark",
        "MULTIPOLYGON (((0 0, 0.01 0, 0.01 0.01, 0 0)))",
        "GEOMETRYCOLLECTION (POLYGON ((0 0, 0.01 0, 0.01 0.01, 0 0)), GEOMETRYCOLLECTION (POINT (1 1)))",
        "POLYGON((0 0, 0.01 0, 0.01 0.01, 0 0));",
    ],
)
def test_wkt_as_programs_write_it_is_read(text):
    document = parse(text.encode(), "f.wkt", extension=".wkt")
    document.require_clean()
    assert document.zones[0].shape.equals(Polygon([(0, 0), (0.01, 0), (0.01, 0.01)]))


def test_kinds_names_and_marks():
    document = parse(
        b"Lake|inclusion|POLYGON ((0 0, 1 0, 1 1, 0 0))\nkeep-in|POLYGON ((0 0, 1 0, 1 1, 0 0))\n"
        b"MULTIPOINT ((0 0), 1 1)\nWreck|obstacle|LINESTRING (0 0, 1 1)",
        "f.wkt",
    )
    assert [(z.name, z.kind) for z in document.zones] == [("Lake", ZoneKind.INCLUSION), ("", ZoneKind.INCLUSION)]
    assert [m.geometry.geom_type for m in document.marks] == ["Point", "Point", "LineString"]


def test_swapped_axes_are_told_by_the_place():
    near = GeoPoint(lat_deg=43.66, lon_deg=-72.15)
    text = b"POLYGON ((43.66 -72.15, 43.67 -72.15, 43.67 -72.14, 43.66 -72.15))"
    fault = check_place(parse(text, "f.wkt"), near).findings[-1]
    assert fault.code is Code.SWAPPED_AXES
    assert "--axis latlon" in fault.remedy
    assert check_place(parse(text, "f.wkt", axis="latlon"), near).findings == ()
    far = parse(b"POLYGON ((3.66 12.15, 3.67 12.15, 3.67 12.14, 3.66 12.15))", "f.wkt")
    assert check_place(far, near).findings[-1].code is Code.FAR_AWAY


def test_a_long_coast_is_as_far_as_what_is_nearest_of_it():
    """Its middle was 84 km off, and a mission that a passage was written as was refused."""
    near = GeoPoint(lat_deg=43.0, lon_deg=-70.0)
    coast = "POLYGON ((-70.1 43.1, -70.1 44.5, -70.3 44.5, -70.3 43.1, -70.1 43.1))"
    assert check_place(parse(coast.encode(), "f.wkt"), near).findings == ()
    fault = check_place(parse(coast.encode(), "f.wkt"), near, 10_000.0).findings[-1]
    assert (fault.code, fault.text) == (Code.FAR_AWAY, "lies 14 km from the mission, at 43.1000, -70.1000")
    fence = check_place(parse(coast.encode(), "f.wkt", kind=ZoneKind.INCLUSION), near).findings[-1]
    assert fence.text == "lies 90 km from the mission, at 43.8000, -70.2000"  # one corner of it may be wrong


@pytest.mark.parametrize(
    ("lonlat", "code", "said"),
    [
        ([10.0, 100.0], Code.SWAPPED_AXES, "latitude 100 is outside ±90 degrees"),
        ([400.0, 10.0], Code.OUT_OF_RANGE, "longitude 400 is outside ±180 degrees"),
        ([400.0, 100.0], Code.OUT_OF_RANGE, "latitude 100 is outside ±90 degrees"),
    ],
)
@pytest.mark.parametrize("extension", [".geojson", ".kml"])
def test_a_point_beyond_the_globe_is_told_by_what_is_wrong_with_it(extension, lonlat, code, said):
    """Of longitude 400 it was said that latitude 10 is outside ±90 degrees."""
    text = json.dumps({"type": "Point", "coordinates": lonlat})
    if extension == ".kml":
        place = ",".join(map(str, lonlat))
        text = f"<kml><Placemark><Point><coordinates>{place}</coordinates></Point></Placemark></kml>"
    (fault,) = found(text, extension)
    assert (fault.code, fault.text) == (code, said)


@pytest.mark.parametrize(("half_deg", "findings"), [(0.01, []), (14.0, []), (80.0, [Code.ANTIMERIDIAN])])
def test_antimeridian_is_read_as_a_crossing_and_told_of_where_it_may_be_meant_otherwise(half_deg, findings):
    e, w = 180.0 - half_deg, half_deg - 180.0
    document = parse(f"POLYGON (({e} 0, {w} 0, {w} 0.01, {e} 0.01, {e} 0))".encode(), "f.wkt")
    assert [f.code for f in document.findings] == findings
    west, _, east, _ = document.zones[0].shape.bounds
    assert east - west == pytest.approx(2.0 * half_deg)


COORDINATE = st.integers(0, 100_000).map(lambda i: i * 1e-7)  # as files write them


@settings(**QUIET, max_examples=150)
@given(st.lists(st.tuples(COORDINATE, COORDINATE), min_size=3, max_size=12), st.sampled_from(list(ZoneKind)))
def test_a_repair_never_makes_the_sea_larger(ring, kind):
    """Whatever the ring: a keep-out repair holds every point that its lines wind round, a keep-in repair no other."""
    findings = Findings()
    pieces = polygons_from_rings([[*ring, ring[0]]], kind, "ring", findings)
    for piece in pieces:
        assert piece.is_valid
        assert piece.area > 0.0
    if Polygon(ring).is_valid:
        return
    assert findings
    assert findings[0].severity is FindingLevel.ERROR
    union = shapely.union_all(pieces)
    faces = list(shapely.get_parts(shapely.polygonize([shapely.node(shapely.linearrings([*ring, ring[0]]))])))
    for face in faces:
        inside = face.representative_point()
        if face.area < 1e-12:
            continue
        if kind is ZoneKind.EXCLUSION:
            assert union.covers(inside)
        elif union.covers(inside):
            assert encloses(ring, inside)


def encloses(ring, point) -> bool:
    """Whether a ray to the east crosses the ring an odd number of times."""
    return (
        sum(
            (y0 > point.y) != (y1 > point.y) and point.x < x0 + (point.y - y0) * (x1 - x0) / (y1 - y0)
            for (x0, y0), (x1, y1) in itertools.pairwise([*ring, ring[0]])
        )
        % 2
        == 1
    )


@pytest.mark.parametrize(
    ("text", "extension", "place"),
    [
        (
            (
                '{"type": "FeatureCollection", "features": ['
                '{"geometry": {"type": "Polygon", "coordinates": [[[0, "x"]]]}}]}'
            ),
            ".geojson",
            "features[0].geometry.coordinates[0][0][1]",
        ),
        ('{"type": "FeatureCollection",\n "features": [', ".geojson", "line 2"),
        ('{"type": "Polygon", "coordinates": [[[0, NaN]]]}', ".geojson", "line 1"),
        ('{"type": "Polygon", "coordinates": [[[0, 1e999]]]}', ".geojson", "line 1"),
        ('{"type": "Circle", "coordinates": []}', ".geojson", "coordinates"),
        (
            (
                '{"type": "Feature", "properties": {"kind": "maybe"},'
                ' "geometry": {"type": "Point", "coordinates": [0, 0]}}'
            ),
            ".geojson",
            "properties.kind",
        ),
        ('{"fileType": "GeoFence"}', ".plan", "fileType"),
        (
            '{"fileType": "Plan", "mission": {"items": [{"type": "SimpleItem", "command": 16, "params": [0, 0]}]}}',
            ".plan",
            "mission.items[0].params",
        ),
        ("QGC WPL 100\n", ".waypoints", "line 1"),
        ("QGC WPL 110\n0\t1\t0\t16\t0\t0\t0\t0\t43.6\t-72.1\t0\n", ".waypoints", "line 2"),
        ("QGC WPL 110\n0\t1\t0\t16\t0\t0\t0\t0\tinf\t-72.1\t0\t1\n", ".waypoints", "line 2 lat"),
        ("QGC WPL 110\n0\t1\t0\t16.5\t0\t0\t0\t0\t1\t-72.1\t0\t1\n", ".waypoints", "line 2 command"),
        ("QGC WPL 110\n0\t1\t0\t16\t0\t1e39\t0\t0\t1\t-72.1\t0\t1\n", ".waypoints", "line 2 p2"),
        (
            (
                '{"fileType": "Plan", "mission": {"items": '
                '[{"type": "SimpleItem", "command": 16, "params": [0, -1e39, 0, 0, 1, 2, 3]}]}}'
            ),
            ".plan",
            "mission.items[0].params[1]",
        ),
        ("43.66 -72.15\n43.66 -72.15 1 1\n", ".fen", "line 2"),
        ("<gpx version='1.1'><rte><rtept lat='1' lon='2'></rte></gpx>", ".gpx", "line 1 column 50"),
        ("<gpx version='1.1'><wpt lat='1' lon='200'/></gpx>", ".gpx", "wpt 1"),
        ("<gpx version='1.1'><wpt lat='nan' lon='20'/></gpx>", ".gpx", "wpt 1"),
        ("<kml><Placemark><Point><coordinates>1;2</coordinates></Point></Placemark></kml>", ".kml", "Placemark 1"),
        ("<html></html>", ".kml", "line 1"),
        ("hello, sailor", ".txt", "line 1"),
        ("", ".wkt", ""),
    ],
)
def test_other_formats_name_the_place(text, extension, place):
    with pytest.raises(InputError) as error:
        parse(text.encode(), "f" + extension, extension=extension)
    assert error.value.place == place, str(error.value)


BOMB = """<?xml version="1.0"?><!DOCTYPE lolz [<!ENTITY a "ha"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;&a;&a;">]>
<{0}><name>&b;</name></{0}>"""


@pytest.mark.parametrize("root", ["gpx", "kml"])
def test_entity_bombs_are_refused(root):
    with pytest.raises(InputError, match="DTD or entities"):
        parse(BOMB.format(root).encode(), "bomb." + root)
    external = f'<!DOCTYPE x [<!ENTITY e SYSTEM "file:///etc/passwd">]><{root}>&e;</{root}>'
    with pytest.raises(InputError, match="DTD or entities"):
        parse(external.encode(), "bomb." + root)


def test_nesting_and_size_are_limited(tmp_path):
    from companion.geofence.formats.registry import read
    from companion.geofence.formats.untrusted import MAX_BYTES

    deep = b"<kml>" + b"<Folder>" * 5000 + b"</Folder>" * 5000 + b"</kml>"
    with pytest.raises(InputError, match="nest deeper"):
        parse(deep, "deep.kml")
    with pytest.raises(InputError):
        parse(b"[" * 100_000, "deep.geojson")
    huge = tmp_path / "huge.wkt"
    with huge.open("wb") as file:
        file.truncate(MAX_BYTES + 1)
    with pytest.raises(InputError, match="larger than 16 MiB"):
        read(huge)


def test_a_zip_bomb_is_refused():
    import io
    import zipfile

    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("doc.kml", b"<kml>" + b" " * (17 * 1024 * 1024))
    with pytest.raises(InputError, match="unpacks to more than"):
        parse(buffer.getvalue(), "bomb.kmz")


def test_encodings_and_decimal_commas():
    lines = [
        "#saved by Mission Planner 1.3",
        "43,6607 -72,1500",
        "43,6600 -72,1510",
        "43,6600 -72,1490",
        "43,6615 -72,1490",
        "43,6600 -72,1510",
        "",
    ]
    text = "\r\n".join(lines)
    for data in (text.encode(), b"\xef\xbb\xbf" + text.encode(), text.encode("utf-16")):
        document = parse(data, "f.fen", extension=".fen")
        assert document.return_point == GeoPoint(lat_deg=43.6607, lon_deg=-72.15)
        assert document.zones[0].shape.area > 0.0
    latin = "Écueil|exclusion|POLYGON ((0 0, 1 0, 1 1, 0 0))".encode("latin-1")
    assert parse(latin, "f.wkt").zones[0].name == "Écueil"


GOOD = {
    ".wkt": b"Rock|exclusion|POLYGON ((0 0, 0.01 0, 0.01 0.01, 0 0.01, 0 0))\nPOINT (0.1 0.1)\n",
    ".geojson": b'{"type":"FeatureCollection","features":[{"type":"Feature","properties":{"kind":"exclusion"},'
    b'"geometry":{"type":"Polygon","coordinates":[[[0,0],[0.01,0],[0.01,0.01],[0,0]]]}}]}',
    ".plan": b'{"fileType":"Plan","version":1,"mission":{"items":[],"plannedHomePosition":[0,0,0]},'
    b'"geoFence":{"circles":[{"inclusion":false,"circle":{"center":[0.001,0.001],"radius":30}}],"polygons":'
    b'[{"inclusion":true,"polygon":[[0,0],[0.01,0],[0.01,0.01]]}]},"rallyPoints":{"points":[[0,0,0]]}}',
    ".waypoints": b"QGC WPL 110\n0\t1\t0\t16\t0\t0\t0\t0\t1.0\t2.0\t0\t1\n1\t0\t3\t16\t0\t0\t0\t0\t1.0\t2.1\t0\t1\n",
    ".fen": b"0.001 0.001\n0 0\n0 0.01\n0.01 0.01\n0 0\n",
    ".poly": b"0 0\n0 0.01\n0.01 0.01\n0 0\n",
    ".gpx": b"<gpx version='1.1'><rte><rtept lat='1' lon='2'><name>A</name></rtept></rte></gpx>",
    ".kml": b"<kml><Document><Placemark><Polygon><outerBoundaryIs><LinearRing><coordinates>0,0 0.01,0 0.01,0.01 0,0"
    b"</coordinates></LinearRing></outerBoundaryIs></Polygon></Placemark></Document></kml>",
    ".rally": b"RALLY\t0.001\t0.001\t40\t20\t0\t0\n",
    ".ewkt": b"SRID=4326;POLYGON ((0 0, 0.01 0, 0.01 0.01, 0 0.01, 0 0))\n",
}


def test_every_format_has_a_file_to_be_changed():
    assert set(GOOD) == {row.endings[0] for row in FORMATS if row.name != "kmz"}  # a KMZ is a KML, packed
    assert len({ending for row in FORMATS for ending in row.endings}) == sum(len(row.endings) for row in FORMATS)


def refused_or_read(data: bytes, extension: str):
    """The document, or None when it was refused in one line that names the file."""
    refusal = ""
    try:
        return parse(data, "f" + extension, extension=extension)
    except InputError as error:
        refusal = str(error)
    assert refusal.startswith("f" + extension)
    assert "\n" not in refusal
    return None


@pytest.mark.parametrize("extension", sorted(GOOD))
@settings(**QUIET, max_examples=150)
@given(st.data())
def test_fuzzed_files_are_refused_in_one_line_or_read(extension, data):
    """Cut, spliced with noise, bytes changed: an InputError or a document, never another exception."""
    good = GOOD[extension]
    at = data.draw(st.integers(0, len(good)))
    how = data.draw(st.sampled_from(["cut", "noise", "change", "word", "double"]))
    if how == "cut":
        bad = good[:at]
    elif how == "noise":
        bad = good[:at] + data.draw(st.binary(max_size=8)) + good[at:]
    elif how == "change":
        bad = good[:at] + data.draw(st.binary(min_size=1, max_size=4)) + good[at + 2 :]
    elif how == "word":
        word = data.draw(
            st.sampled_from(
                [
                    b"nan",
                    b"-inf",
                    b"1e999",
                    b"null",
                    b"[]",
                    b"{}",
                    b"()",
                    b"EMPTY",
                    b"0,5",
                    b"\x00",
                    b"\xff\xfe",
                    b"<!--",
                    b"&amp;",
                    b"-",
                    b"99999999999999999999",
                ]
            )
        )
        bad = good[:at] + word + good[at + data.draw(st.integers(0, 5)) :]
    else:
        bad = good[:at] + good[max(0, at - 40) :]
    document = refused_or_read(bad, extension)
    if document is None:
        return
    for zone in document.zones:
        if hasattr(zone.shape, "is_valid"):
            assert zone.shape.is_valid
            assert not zone.shape.is_empty
    for name in (row.name for row in FORMATS if row.name not in {"kmz", "rally"}):
        write(document, "", format_name=name)
    if not any(f.severity is FindingLevel.ERROR for f in document.findings):
        inside = tuple(z for z in document.zones if z.kind is ZoneKind.INCLUSION)
        check_area(Area(obstacles=document.as_obstacles(10.0), fence=Fence(inside)), AreaConditions(margin_m=12.0))


@settings(**QUIET, max_examples=200)
@given(st.binary(max_size=200), st.sampled_from(sorted(GOOD)))
def test_random_bytes(noise, extension):
    refused_or_read(noise, extension)


@pytest.mark.parametrize("extension", sorted(GOOD))
def test_a_cut_file_is_never_a_smaller_fence_without_a_word(extension):
    """Every proper prefix either fails, has findings, or holds the same zones as the whole."""
    good = GOOD[extension]
    whole = parse(good, "f" + extension, extension=extension)
    for at in range(len(good)):
        try:
            part = parse(good[:at], "f" + extension, extension=extension)
        except InputError:
            continue
        errors = [f for f in part.findings if f.severity is FindingLevel.ERROR]
        same = len(part.zones) == len(whole.zones) and all(
            a == b or a.shape.equals(b.shape) for a, b in zip(part.zones, whole.zones, strict=True)
        )
        assert errors or same, good[:at]


def test_xml_of_another_kind_is_not_taken_for_the_wkt_that_it_quotes():
    with pytest.raises(InputError, match="neither GPX nor KML"):
        parse(b"<svg><desc>POINT (1 2)</desc></svg>", "drawing.svg", extension=".svg")


@pytest.mark.parametrize(("radius_m", "is_one"), [(1e6, True), (1.01e6, False), (-3.0, False)])
def test_a_circle_of_more_than_a_thousand_kilometres_is_a_slip_in_every_format(radius_m, is_one):
    """Whatever is drawn of one is drawn in metres about a place."""
    item = MissionItem(command=Command.NAV_FENCE_CIRCLE_EXCLUSION, params=(radius_m, 0.0, 0.0, 0.0))
    findings = Findings()
    zones, _ = items_to_zones((item,), findings)
    assert [z.shape.radius_m for z in zones] == [radius_m] * is_one
    assert [f.severity for f in findings] == [FindingLevel.ERROR] * (not is_one)
    plan = GOOD[".plan"].replace(b'"radius":30', b'"radius":' + json.dumps(radius_m).encode())
    with contextlib.nullcontext() if is_one else pytest.raises(InputError, match="radius"):
        assert (
            max(getattr(z.shape, "radius_m", 0.0) for z in parse(plan, "f.plan", extension=".plan").zones) == radius_m
        )
