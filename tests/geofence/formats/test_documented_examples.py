"""Files in the form that QGroundControl, Mission Planner, OpenCPN and QGIS document or write."""

import pytest

from companion.geofence import Circle, ZoneKind
from companion.geofence.formats.registry import parse
from companion.messages import GeoPoint

PLAN = b"""{"fileType":"Plan","version":1,"groundStation":"QGroundControl",
 "mission":{"version":2,"firmwareType":3,"vehicleType":11,"cruiseSpeed":2,"hoverSpeed":2,"globalPlanAltitudeMode":1,
  "plannedHomePosition":[43.66,-72.15,0],
  "items":[{"type":"SimpleItem","doJumpId":1,"command":16,"frame":3,"autoContinue":true,"AMSLAltAboveTerrain":null,
            "Altitude":0,"AltitudeMode":1,"params":[0,0,0,null,43.6612345,-72.1487654,0]}]},
 "geoFence":{"version":2,"circles":[{"version":1,"inclusion":false,"circle":{"center":[43.661,-72.149],"radius":30}}],
  "polygons":[{"version":1,"inclusion":true,"polygon":[[43.66,-72.151],[43.6615,-72.151],[43.6615,-72.149],[43.66,-72.149]]}]},
 "rallyPoints":{"version":2,"points":[[43.66,-72.15,0]]}}"""

WAYPOINTS = (
    "QGC WPL 110\r\n0\t1\t0\t16\t0\t0\t0\t0\t43.6600000\t-72.1500000\t0\t1\r\n"
    "1\t0\t3\t16\t0\t0\t0\t0\t43.6612345\t-72.1487654\t0\t1\r\n2 0 3 19 300 0 0 0 43.6615000 -72.1480000 0 1\r\n"
    "3\t0\t3\t177\t1\t-1\t0\t0\t0\t0\t0\t1\r\n"
)

FEN = """43.6607 -72.1500
43.6600 -72.1510
43.6600 -72.1490
43.6615 -72.1490
43.6615 -72.1510
43.6600 -72.1510
"""

REGIONS = """#saved by Mission Planner 1.3.80
Name: Shoal
Color: 1
43.6600 -72.1510
43.6600 -72.1490
43.6615 -72.1490
43.6600 -72.1510
Name: Bank
43.6700 -72.1510
43.6700 -72.1490
43.6715 -72.1490
43.6700 -72.1510
"""

OPENCPN = b"""<?xml version="1.0"?>
<gpx version="1.1" creator="OpenCPN" xmlns="http://www.topografix.com/GPX/1/1" xmlns:opencpn="http://www.opencpn.org">
 <wpt lat="43.662" lon="-72.152"><name>Wreck</name><sym>diamond</sym></wpt>
 <rte><name>R1</name><extensions><opencpn:guid>x</opencpn:guid><opencpn:viz>1</opencpn:viz></extensions>
  <rtept lat="43.66" lon="-72.15"><name>001</name><sym>diamond</sym><type>WPT</type></rtept>
  <rtept lat="43.661" lon="-72.151"><name>002</name><sym>diamond</sym><type>WPT</type></rtept>
  <rtept lat="43.662" lon="-72.149"><name>003</name><sym>diamond</sym><type>WPT</type></rtept>
  <rtept lat="43.66" lon="-72.15"><name>001</name><sym>diamond</sym><type>WPT</type></rtept></rte></gpx>"""

GEOJSON = b"""{"type":"FeatureCollection","features":[{"type":"Feature","properties":{"kind":"exclusion","name":"Shoal",
 "margin_m":15},"geometry":{"type":"Polygon","coordinates":[[[-72.151,43.66],[-72.149,43.66],[-72.149,43.6615],
 [-72.151,43.66]]]}}]}"""

KML = b"""<?xml version="1.0" encoding="UTF-8"?><kml xmlns="http://www.opengis.net/kml/2.2"><Document><Folder><Placemark>
 <name>Shoal</name><MultiGeometry><Polygon><outerBoundaryIs><LinearRing><coordinates>
 -72.151,43.66,0 -72.149,43.66,0 -72.149,43.6615,0 -72.151,43.66,0 </coordinates></LinearRing></outerBoundaryIs>
 </Polygon></MultiGeometry></Placemark></Folder></Document></kml>"""

WKT = b"""SRID=4326;POLYGON ((-72.1510 43.6600, -72.1490 43.6600, -72.1490 43.6615, -72.1510 43.6615, -72.1510 43.6600))
MULTIPOLYGON (((-72.151 43.660, -72.150 43.660, -72.150 43.661, -72.151 43.660)))
GEOMETRYCOLLECTION (POINT (-72.148 43.661), LINESTRING (-72.148 43.660, -72.147 43.661))
"""


def test_qgroundcontrol_plan():
    document = parse(PLAN, "a.plan").require_clean()
    assert document.home == GeoPoint(lat_deg=43.66, lon_deg=-72.15)
    assert [(i.command, i.lat_e7, i.lon_e7) for i in document.items] == [(16, 436612345, -721487654)]
    assert [(z.kind, isinstance(z.shape, Circle)) for z in document.zones] == [
        (ZoneKind.INCLUSION, False),
        (ZoneKind.EXCLUSION, True),
    ]
    assert len(document.rally) == 1


def test_mission_planner_waypoints():
    document = parse(b"\xef\xbb\xbf" + WAYPOINTS.encode(), "a.waypoints").require_clean()
    assert document.home == GeoPoint(lat_deg=43.66, lon_deg=-72.15)
    assert [i.command for i in document.items] == [16, 19, 177]
    assert document.items[2].params[:2] == (1.0, -1.0)


def test_mission_planner_fence():
    document = parse(FEN.encode(), "a.fen", extension=".fen").require_clean()
    assert document.return_point == GeoPoint(lat_deg=43.6607, lon_deg=-72.15)
    assert len(document.zones[0].shape.exterior.coords) == 5
    assert parse(FEN.encode(), "a.txt", extension=".txt").format == "fen"


def test_mission_planner_regions():
    document = parse(REGIONS.encode(), "a.poly", extension=".poly").require_clean()
    assert [z.name for z in document.zones] == ["Shoal", "Bank"]


def test_opencpn_as_a_course_and_as_a_chart_of_dangers():
    course = parse(OPENCPN, "a.gpx").require_clean()
    assert course.item_names == ("001", "002", "003", "001")
    assert not course.zones
    dangers = parse(OPENCPN, "a.gpx", areas=True).require_clean()
    assert not dangers.items
    assert [z.name for z in dangers.zones] == ["R1"]
    assert [m.name for m in dangers.marks] == ["Wreck"]


@pytest.mark.parametrize(("data", "margin_m"), [(GEOJSON, 15.0), (KML, None)])
def test_drawn_in_qgis_or_google_earth(data, margin_m):
    zone = parse(data, "a").require_clean().zones[0]
    assert (zone.name, zone.kind, zone.margin_m) == ("Shoal", ZoneKind.EXCLUSION, margin_m)
    assert zone.shape.area == pytest.approx(0.002 * 0.0015 / 2.0)


def test_postgis_wkt():
    document = parse(WKT, "a.wkt").require_clean()
    assert len(document.zones) == 2
    assert len(document.marks) == 2
