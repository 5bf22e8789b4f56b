"""The part of an area about a place: the same water in every frame, however long its edges are."""

import math

import numpy as np
import pytest
import shapely
from pyproj import Geod
from shapely.geometry import Polygon

from companion.geo.frame import LocalFrame
from companion.geofence.area import Area, Fence, polygons_about
from companion.geofence.autopilot_fence import FenceStatus, fence_for_autopilot
from companion.geofence.shapes import Circle, Obstacle, Zone, ZoneKind, drawn
from companion.messages import GeoPoint

EARTH = Geod(ellps="WGS84")
REACH_M = 40_000.0
# Six degrees by one across the date line, with corners alone; and one at 75 degrees north.
LONG = Polygon([(177.0, 51.3), (183.2, 51.3), (183.2, 52.6), (177.0, 52.6)])
NORTHERN = Polygon([(10.0, 74.7), (30.0, 74.7), (30.0, 75.3), (10.0, 75.3)])


def frame_at(lat_deg, lon_deg):
    return LocalFrame(GeoPoint(lat_deg=lat_deg, lon_deg=lon_deg))


def apart_m(a, b):
    return EARTH.inv(a.lon_deg, a.lat_deg, b.lon_deg, b.lat_deg)[2]


@pytest.mark.parametrize(
    ("shape", "lat_deg", "lon_deg", "edge_deg"),
    [
        (LONG, 52.5, 178.0, 52.6),
        (LONG, 52.5, 179.99, 52.6),
        (LONG, 52.4, -179.9, 52.6),
        (LONG, 51.4, -177.2, 51.3),
        (NORTHERN, 75.2, 12.0, 75.3),
        (NORTHERN, 75.2, 20.0, 75.3),
    ],
)
def test_a_long_edge_is_where_its_parallel_is(shape, lat_deg, lon_deg, edge_deg):
    """A chord of it in one frame would be kilometres off."""
    frame = frame_at(lat_deg, lon_deg)
    [piece] = polygons_about(shape, frame, REACH_M, cover=False)
    east_m = frame.en_from_geo(GeoPoint(lat_deg=edge_deg, lon_deg=lon_deg))[0]
    for aside_m in (-20_000.0, -7000.0, 0.0, 13_000.0):
        on_edge = frame.geo_from_en(east_m + aside_m, frame.en_from_geo(GeoPoint(lat_deg=edge_deg, lon_deg=lon_deg))[1])
        there = frame.en_from_geo(GeoPoint(lat_deg=edge_deg, lon_deg=on_edge.lon_deg))
        assert piece.exterior.distance(shapely.points(there)) < 0.15


def test_two_frames_agree_on_the_clearance():
    first, second = frame_at(52.55, 179.9), frame_at(52.56, -179.97)
    area = Area(
        fence=Fence(zones=(Zone(kind=ZoneKind.INCLUSION, shape=LONG),)),
        obstacles=(Obstacle(shape=Polygon([(179.99, 52.55), (180.01, 52.55), (180.0, 52.57)]), name="rock"),),
    )
    for lon_deg, lat_deg in [(179.95, 52.58), (-179.99, 52.56), (-179.9, 52.59)]:
        here = GeoPoint(lat_deg=lat_deg, lon_deg=lon_deg)
        a, b = (float(area.about(f, REACH_M).clearance_m([f.en_from_geo(here)])[0]) for f in (first, second))
        assert a == pytest.approx(b, abs=0.15)
        assert 0.0 < a < 10_000.0


def test_what_is_far_is_left_out_and_the_edge_of_what_is_known_is_farther_than_the_reach():
    near, far = (Polygon([(lon, 52.0), (lon + 0.01, 52.0), (lon, 52.01)]) for lon in (180.1, 182.0))
    area = Area(
        obstacles=(Obstacle(shape=near, name="near"), Obstacle(shape=far, name="far")),
        fence=Fence(zones=(Zone(kind=ZoneKind.INCLUSION, shape=LONG),)),
    )
    local = area.about(frame_at(52.0, -179.9), REACH_M)
    assert local.names == ("near",)
    assert local.reach_m == REACH_M
    around = np.array([[REACH_M * math.sin(t), REACH_M * math.cos(t)] for t in np.linspace(0.0, 6.28, 40)])
    assert float(np.min(local.limit_clearance_m(around))) > -1.0  # nothing nearer than the reach was cut off
    whole = area.about(frame_at(52.0, -179.9), math.inf)
    assert whole.names == ("near", "far")


def test_a_circle_is_itself_when_it_is_near_and_drawn_when_it_is_not():
    frame = frame_at(75.0, 179.99)
    near = Circle(GeoPoint(lat_deg=75.01, lon_deg=-179.99), 500.0)
    [drawn] = polygons_about(near, frame, REACH_M)
    centre = frame.en_from_geo(near.center)
    assert all(math.dist(p, centre) >= 500.0 - 1e-6 for p in drawn.exterior.coords)
    assert polygons_about(Circle(GeoPoint(lat_deg=76.0, lon_deg=-179.99), 500.0), frame, REACH_M) == []
    round_all = Circle(GeoPoint(lat_deg=75.0, lon_deg=178.5), 60_000.0)
    [within] = polygons_about(round_all, frame, REACH_M, cover=False)
    inside = frame.geo_from_en(5000.0, 0.0)
    assert within.covers(shapely.points((5000.0, 0.0))) == (apart_m(inside, round_all.center) < 60_000.0)


@pytest.mark.parametrize("lat_deg", [89.5, -89.5])
def test_near_a_pole_nothing_near_is_lost(lat_deg):
    frame = frame_at(lat_deg, 0.0)
    across = frame.geo_from_en(0.0, math.copysign(80_000.0, lat_deg))  # beyond the pole
    lon, lat = across.lon_deg, across.lat_deg
    rock = Polygon([(lon, lat), (lon + 0.5, lat), (lon, lat - math.copysign(0.01, lat_deg))])
    assert len(polygons_about(rock, frame, 100_000.0)) == 1


def test_a_circle_and_a_fence_over_the_date_line_are_rings_that_do_not_cross_themselves():
    """What unwrapping rounded in the last place made them invalid, and the autopilot's fence was refused."""
    zone = Zone(kind=ZoneKind.INCLUSION, shape=Circle(GeoPoint(lat_deg=75.0, lon_deg=178.5), 60_000.0))
    assert drawn(zone).is_valid
    water = Polygon([(179.94, 51.47), (180.06, 51.47), (180.06, 51.515), (179.94, 51.515)])
    rock = Polygon([(179.9985, 51.5005), (180.0015, 51.5005), (180.0015, 51.5022), (179.9985, 51.5022)])
    area = Area(
        obstacles=(Obstacle(shape=rock, name="rock"),), fence=Fence(zones=(Zone(kind=ZoneKind.INCLUSION, shape=water),))
    )
    made = fence_for_autopilot(area, 15.0, inside=[GeoPoint(lat_deg=51.5, lon_deg=179.96)])
    assert (made.status, made.reason) == (FenceStatus.OK, "")


@pytest.mark.parametrize("cover", [True, False])
def test_a_circle_that_is_larger_than_what_is_known_errs_to_the_safe_side(cover):
    """A prohibited area of 60 km across must not be drawn smaller than it is, nor a limit larger."""
    frame = frame_at(50.0, -4.0)
    circle = Circle(GeoPoint(lat_deg=50.0, lon_deg=-4.8), 60_000.0)
    [part] = polygons_about(circle, frame, REACH_M, cover=cover)
    edge, straight_m = LocalFrame(circle.center), 2.0  # what sides of 8 km, straight in degrees, stray on the ground
    for turn in np.linspace(0.35 * math.pi, 0.65 * math.pi, 301):
        rim = frame.en_from_geo(edge.geo_from_en(60_000.0 * math.sin(turn), 60_000.0 * math.cos(turn)))
        if math.hypot(*rim) < REACH_M:
            off_m = float(shapely.distance(part.exterior, shapely.points(rim)))
            assert part.covers(shapely.points(rim)) == cover or off_m < straight_m


def test_of_a_passages_limits_every_one_counts_each_drawn_inside_and_less_its_own_margin():
    frame = frame_at(50.0, -4.0)
    west, east = (
        Zone(kind=ZoneKind.INCLUSION, shape=Circle(frame.geo_from_en(x, 0.0), 3000.0), margin_m=own_m)
        for x, own_m in ((-1000.0, None), (1000.0, 50.0))
    )
    local = Area(fence=Fence(zones=(west, east))).about(frame, REACH_M)
    assert local.limits.bounds[0] == pytest.approx(-1950.0, abs=7.0)
    assert local.limits.bounds[2] == pytest.approx(2000.0, abs=7.0)
    for x, radius_m in ((-1000.0, 3000.0), (1000.0, 2950.0)):
        far = np.hypot(*(shapely.get_coordinates(local.limits) - np.array([x, 0.0])).T)
        assert far.max() <= radius_m + 1e-3


@pytest.mark.parametrize("own_m", [None, 40.0])
def test_an_obstacle_of_a_passage_keeps_its_own_margin_and_no_other(own_m):
    frame = frame_at(50.0, -4.0)
    rock = Obstacle(shape=Circle(frame.geo_from_en(0.0, 100.0), 20.0), margin_m=own_m)
    local = Area(obstacles=(rock,)).about(frame, REACH_M)
    assert local.own_margins_m == (own_m or 0.0,)
    assert local.names == ("obstacle 1",)
    assert local.limits is None
