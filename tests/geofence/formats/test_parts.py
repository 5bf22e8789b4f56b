"""Parts of files one by one, each by an example: what a format's fields mean, and what is said of them."""

import json
import math

import numpy as np
import pytest
import shapely
from shapely.geometry import LineString, Polygon

from companion.errors import InputError
from companion.geofence.document import Code, Document, FindingLevel
from companion.geofence.formats.fence_items import items_to_zones, storage_bytes, zones_to_items
from companion.geofence.formats.losses import Losses
from companion.geofence.formats.registry import parse, write
from companion.geofence.formats.rings import Findings, is_hopeless, odd_faces, polygons_from_rings
from companion.geofence.formats.routes import route_of
from companion.geofence.formats.untrusted import MAX_DEPTH, require_shallow
from companion.geofence.shapes import Zone, ZoneKind
from companion.messages import Command, GeoPoint, MissionItem

HOME = GeoPoint(lat_deg=50.8, lon_deg=-1.3)


def item(lat_deg, lon_deg, command=Command.NAV_WAYPOINT, **more):
    return MissionItem(command=command, lat_e7=round(lat_deg * 1e7), lon_e7=round(lon_deg * 1e7), **more)


ITEMS = (
    item(50.81, -1.31, params=(5.0, 0.0, 2.5, 0.0), alt_m=3.0, frame=0, autocontinue=False),
    item(50.82, -1.32, frame=3),
)
RALLY = (item(50.83, -1.33, Command.NAV_RALLY_POINT, alt_m=7.0), item(50.84, -1.34, Command.NAV_RALLY_POINT))


def text_of(document, name, **options):
    return write(document, "", format_name=name, **options).data.decode()


def read(text, extension, **options):
    return parse(text.encode(), f"f{extension}", extension=extension, **options)


def kml(body):
    return f'<kml xmlns="http://www.opengis.net/kml/2.2"><Document>{body}</Document></kml>'


# ------------------------------------------------------------------------------------ missions, rally points
@pytest.mark.parametrize("name", ["geojson", "plan", "waypoints"])
def test_a_missions_items_keep_their_parameters_height_frame_and_whether_they_go_on(name):
    document = Document(items=ITEMS, home=HOME)
    back = read(text_of(document, name), f".{name}")
    assert (back.items, back.home) == (ITEMS, HOME)


def test_home_stands_before_a_mission_at_a_height_above_the_sea():
    first, second, *_ = text_of(Document(items=ITEMS, home=HOME), "waypoints").splitlines()[1:]
    assert first.split("\t")[:4] == ["0", "1", "0", "16"]  # number, current, frame, command
    assert second.split("\t")[:3] == ["1", "0", "0"]


@pytest.mark.parametrize("name", ["geojson", "plan", "rally"])
def test_rally_points_are_where_they_were(name):
    back = read(text_of(Document(rally=RALLY), name), f".{name}")
    assert [(r.point, r.alt_m, r.command) for r in back.rally] == [(r.point, r.alt_m, r.command) for r in RALLY]


def test_a_rally_point_that_is_not_on_the_globe_is_named_and_left_out():
    document = read("RALLY 950.83 -1.33 7\nRALLY 50.84 -1.34 0\n", ".rally")
    assert [r.point for r in document.rally] == [RALLY[1].point]
    assert [(f.code, f.place) for f in document.findings] == [(Code.SWAPPED_AXES, "line 1")]


@pytest.mark.parametrize("name", ["gpx", "kml"])
def test_home_rally_and_return_point_are_pins_with_their_role(name):
    document = Document(items=ITEMS, rally=RALLY, home=HOME, return_point=RALLY[1].point)
    back = read(text_of(document, name), f".{name}")
    assert (back.home, back.return_point) == (HOME, RALLY[1].point)
    assert [r.point for r in back.rally] == [r.point for r in RALLY]
    assert [i.point for i in back.items] == [i.point for i in ITEMS]


@pytest.mark.parametrize(
    ("of", "plain"),
    [
        ((ITEMS[1],), False),
        ((item(50.8, -1.3, frame=0),), True),
        ((item(50.8, -1.3, frame=3, params=(1.0, 0.0, 0.0, 0.0)),), True),
        ((item(50.8, -1.3, frame=3, autocontinue=False),), True),
        ((item(50.8, -1.3, Command.NAV_LOITER_UNLIM, frame=3),), True),
    ],
)
def test_a_route_says_of_whatever_is_more_than_a_plain_waypoint_that_it_becomes_one(of, plain):
    losses = Losses()
    assert [point for point, _, _ in route_of(Document(items=of), losses)] == [i.point for i in of]
    assert any("plain waypoints" in loss.text for loss in losses) is plain


@pytest.mark.parametrize(("frame", "mode"), [(0, 2), (3, 1), (10, 4), (11, 4)])
def test_a_height_is_above_what_its_frame_says_in_qgroundcontrol_too(frame, mode):
    plan = json.loads(text_of(Document(items=(item(50.8, -1.3, frame=frame),), home=HOME), "plan"))
    assert [i["AltitudeMode"] for i in plan["mission"]["items"]] == [mode]


def plan_of(*items):
    mission = {"plannedHomePosition": [50.8, -1.3, 0], "items": list(items), "version": 2}
    return json.dumps({"fileType": "Plan", "version": 1, "mission": mission})


def simple(command, *params, **more):
    return {"type": "SimpleItem", "command": command, "frame": 3, "autoContinue": True, "params": list(params), **more}


def test_a_jump_of_qgroundcontrol_is_to_the_item_and_not_to_its_number_there():
    there = simple(16, 0, 0, 0, 0, 50.81, -1.31, 0, doJumpId=0)
    on = simple(16, 0, 0, 0, 0, 50.82, -1.32, 0, doJumpId=7)
    document = read(plan_of(there, on, simple(177, 7, 3, 0, 0, 0, 0, 0), simple(177, 0, 2, 0, 0, 0, 0, 0)), ".plan")
    assert [i.params[:2] for i in document.items[2:]] == [(2.0, 3.0), (1.0, 2.0)]
    assert not document.findings
    [finding] = read(plan_of(on, simple(177, 9, 1, 0, 0, 0, 0, 0)), ".plan").findings
    assert finding.severity is FindingLevel.ERROR
    assert "jumps to item 9" in finding.text
    assert len(read(plan_of(there | {"doJumpId": 65535}), ".plan").items) == 1
    with pytest.raises(InputError, match="doJumpId"):
        read(plan_of(there | {"doJumpId": 65536}), ".plan")


@pytest.mark.parametrize("where", ["inside", "beside"])
def test_a_survey_of_qgroundcontrol_is_expanded_to_the_items_that_it_stores(where):
    stored = [simple(16, 0, 0, 0, 0, 50.81, -1.31, 0), simple(16, 0, 0, 0, 0, 50.82, -1.32, 0)]
    item_of = {"type": "ComplexItem", "complexItemType": "survey"}
    item_of |= {"TransectStyleComplexItem": {"Items": stored}} if where == "inside" else {"Items": stored}
    document = read(plan_of(item_of), ".plan")
    assert [i.point for i in document.items] == [ITEMS[0].point, ITEMS[1].point]
    assert ["expanded to its 2 items" in f.text for f in document.findings] == [True]


# ------------------------------------------------------------------------------------------------ KML
@pytest.mark.parametrize(
    "data",
    [
        '<Data name="kind"><value>inclusion</value></Data><Data name="margin_m"><value>12</value></Data>',
        '<Schema><SimpleData name="kind"> inclusion </SimpleData><SimpleData name="margin_m">12</SimpleData></Schema>',
    ],
)
def test_what_a_placemark_says_of_itself_is_read_from_both_kinds_of_data(data):
    ring = "<LinearRing><coordinates>0,0 0.01,0 0.01,0.01 0,0</coordinates></LinearRing>"
    shape = f"<Polygon><outerBoundaryIs>{ring}</outerBoundaryIs></Polygon>"
    body = f"<Placemark><ExtendedData>{data}</ExtendedData>{shape}</Placemark>"
    document = read(kml(body), ".kml")
    assert [(z.kind, z.margin_m, len(z.shape.exterior.coords)) for z in document.zones] == [
        (ZoneKind.INCLUSION, 12.0, 4)
    ]
    assert not document.findings


@pytest.mark.parametrize("what", ["NetworkLink", "GroundOverlay"])
def test_what_lies_elsewhere_is_not_followed_and_said_so_once(what):
    pin = "<Placemark><Point><coordinates>-1.3,50.8</coordinates></Point></Placemark>"
    texts = [f.text for f in read(kml(f"{pin}<{what}/>"), ".kml").findings]
    assert [t for t in texts if "not followed" in t] == [f"a {what} is not followed"]
    assert not any("not followed" in f.text for f in read(kml(pin), ".kml").findings)


@pytest.mark.parametrize(("there", "is_line"), [("-1.3,50.8 -1.3,50.8", False), ("-1.3,50.8 -1.4,50.8", True)])
def test_a_line_of_one_place_is_none(there, is_line):
    document = read(kml(f"<Placemark><LineString><coordinates>{there}</coordinates></LineString></Placemark>"), ".kml")
    assert [m.geometry for m in document.marks] == ([LineString([(-1.3, 50.8), (-1.4, 50.8)])] if is_line else [])
    assert [f.code for f in document.findings] == ([] if is_line else [Code.DEGENERATE])


def test_a_route_with_fewer_names_than_places_is_whole():
    data = '<Data name="role"><value>route</value></Data><Data name="names"><value>quay</value></Data>'
    line = "<LineString><coordinates>-1.31,50.81 -1.32,50.82</coordinates></LineString>"
    document = read(kml(f"<Placemark><ExtendedData>{data}</ExtendedData>{line}</Placemark>"), ".kml")
    assert [i.point for i in document.items] == [i.point for i in ITEMS]
    assert document.item_names == ("quay", "")


@pytest.mark.parametrize("lines", [True, False])
def test_points_beside_a_line_are_dangers_and_alone_the_places_to_sail_to(lines):
    def feature(kind, coordinates):
        return {"type": "Feature", "properties": {}, "geometry": {"type": kind, "coordinates": coordinates}}

    features = [feature("Point", [-1.31, 50.81]), feature("Point", [-1.32, 50.82])]
    features += [feature("LineString", [[-1.3, 50.8], [-1.4, 50.8]])] if lines else []
    document = read(json.dumps({"type": "FeatureCollection", "features": features}), ".geojson")
    assert len(document.items) == (0 if lines else 2)
    assert len(document.marks) == (3 if lines else 0)


# ------------------------------------------------------------------------------------------------ WKT
def test_a_statement_of_wkt_may_take_several_lines_one_after_the_other():
    square = "POLYGON\n((0 0, 0.01 0,\n0.01 0.01, 0 0))\n"
    document = read(f"{square}{square}\n", ".wkt")
    assert len(document.zones) == 2
    assert not document.findings


@pytest.mark.parametrize(("dims", "height"), [("Z", " 5"), ("M", " 5"), ("ZM", " 5 6"), ("", "")])
def test_heights_and_measures_of_wkt_are_not_used_and_said_so(dims, height):
    ring = ", ".join(f"{place}{height}" for place in ("0 0", "0.01 0", "0.01 0.01", "0 0"))
    document = read(f"POLYGON {dims} (({ring}))", ".wkt")
    assert document.zones[0].shape.equals(Polygon([(0, 0), (0.01, 0), (0.01, 0.01)]))
    assert [f.text for f in document.findings] == ([f"the {dims} coordinates are not used"] if dims else [])


@pytest.mark.parametrize(
    ("name", "is_curve"),
    [("CURVEPOLYGON", True), ("CIRCULARSTRING", True), ("COMPOUNDCURVE", True), ("PLOYGON", False)],
)
def test_a_curve_of_wkt_is_refused_with_what_to_draw_in_its_place(name, is_curve):
    with pytest.raises(InputError) as caught:
        read(f"POINT (1 2)\n{name} ((0 0, 1 0, 1 1, 0 0))", ".wkt")
    assert ("draw the curve as a polygon" in str(caught.value)) is is_curve


def test_brackets_may_nest_as_deep_as_is_said_and_no_deeper():
    require_shallow("(" * MAX_DEPTH + ")" * MAX_DEPTH + "[" * MAX_DEPTH, "f.wkt")
    with pytest.raises(InputError, match=f"line 2: brackets nest deeper than {MAX_DEPTH}"):
        require_shallow("()\n" + "(" * (MAX_DEPTH + 1), "f.wkt")


# ------------------------------------------------------------------------------------------------ rings
def test_a_polygon_without_any_vertex_is_none_and_named():
    for rings in ([], [[]]):
        findings = Findings()
        assert polygons_from_rings(rings, ZoneKind.EXCLUSION, "polygon 1", findings) == []
        assert findings[0].severity is FindingLevel.ERROR


def test_of_a_ring_that_crosses_itself_the_faces_that_lie_inside_an_odd_number_of_times_are_kept():
    eight = Polygon([(0, 0), (2, 2), (2, 0), (0, 2)])
    assert odd_faces(eight).area == pytest.approx(2.0)
    twice = Polygon([(0, 0), (4, 0), (4, 4), (0, 4), (0, 0), (1, 1), (3, 1), (3, 3), (1, 3), (1, 1)])
    assert odd_faces(twice).area == pytest.approx(16.0 - 4.0)
    holed = Polygon([(0, 0), (9, 0), (9, 9), (0, 9)], [[(1, 1), (3, 1), (3, 3), (1, 3)]])
    assert odd_faces(holed).area == pytest.approx(81.0 - 4.0)


@pytest.mark.parametrize(("step", "is_tangle"), [(1, False), (2, False), (10_001, True)])
def test_a_large_ring_is_a_tangle_where_it_crosses_itself_at_every_turn(step, is_tangle):
    n = 20_003
    t = 2.0 * math.pi * (step * np.arange(n) % n) / n  # a star of so many points, or a round
    assert is_hopeless(Polygon(np.column_stack([np.cos(t), np.sin(t)]))) is is_tangle
    few = Polygon(shapely.get_coordinates(Polygon([(0, 0), (2, 2), (2, 0), (0, 2)])))
    assert not is_hopeless(few)


@pytest.mark.parametrize(("wide_deg", "is_said"), [(2.0, False), (28.0, False), (32.0, True), (60.0, True)])
def test_a_ring_across_the_antimeridian_is_worth_a_word_where_it_is_wider_than_a_bay(wide_deg, is_said):
    west, east = 180.0 - wide_deg / 2.0, -180.0 + wide_deg / 2.0
    found = Findings()
    ring = [(west, 0.0), (east, 0.0), (east, 5.0), (west, 5.0), (west, 0.0)]
    [polygon] = polygons_from_rings([ring], ZoneKind.EXCLUSION, "", found)
    assert np.ptp(np.asarray(polygon.exterior.coords)[:, 0]) == pytest.approx(wide_deg)
    assert [f.code for f in found] == ([Code.ANTIMERIDIAN] if is_said else [])


def test_xml_that_is_none_is_told_with_what_is_wrong_and_where():
    with pytest.raises(InputError, match=r"line 1 column 18: is not XML \(mismatched tag\)$"):
        read("<kml><Document></Documents></kml>", ".kml")
    with pytest.raises(InputError, match=r"is not XML \(no element found\); is the file cut off\?$"):
        read("<kml><Document>", ".kml")


# ------------------------------------------------------------------------------------------------ fence items
@pytest.mark.parametrize("radius_m", [0.4, 1.0, 12.0])
def test_a_small_circle_is_one_and_one_of_nothing_is_none(radius_m):
    def circle(radius_m):
        return item(50.8, -1.3, Command.NAV_FENCE_CIRCLE_EXCLUSION, params=(radius_m, 0.0, 0.0, 0.0))

    found = Findings()
    zones, _ = items_to_zones([circle(radius_m), circle(0.0)], found)
    assert [z.shape.radius_m for z in zones] == [radius_m]
    assert [(f.code, f.place) for f in found] == [(Code.DEGENERATE, "item 1")]
    fence = {"version": 2, "polygons": [], "circles": []}
    for radius in (radius_m, 0.0):
        drawn = {"center": [50.8, -1.3], "radius": radius}
        fence["circles"].append({"inclusion": False, "version": 1, "circle": drawn})
    document = read(json.dumps(json.loads(plan_of()) | {"geoFence": fence}), ".plan")
    assert [z.shape.radius_m for z in document.zones] == [radius_m]
    assert [f.code for f in document.findings] == [Code.DEGENERATE]


def test_a_vertex_without_a_count_takes_the_room_of_one_and_a_polygon_with_heights_that_of_its_vertices():
    lone = item(50.8, -1.3, Command.NAV_FENCE_POLYGON_VERTEX_EXCLUSION, params=(0.0, 0.0, 0.0, 0.0))
    assert storage_bytes([lone]) == storage_bytes([lone, lone]) - 10 == 5 + 2 + 8
    high = Zone(kind=ZoneKind.EXCLUSION, shape=Polygon([(0.0, 0.0, 5.0), (0.01, 0.0, 5.0), (0.01, 0.01, 5.0)]))
    flat = Zone(kind=ZoneKind.EXCLUSION, shape=shapely.force_2d(high.shape))
    assert zones_to_items([high])[0] == zones_to_items([flat])[0]
    assert len(zones_to_items([flat])[0]) == 3
