"""The part of an area about a place: the same water in every frame, however long its edges are."""

import math

import numpy as np
import pytest
import shapely
from hypothesis import example, given, settings
from hypothesis import strategies as st
from pyproj import Geod
from shapely.geometry import Polygon

from companion.geo.frame import LocalFrame
from companion.geofence.area import Area, Fence, polygons_about
from companion.geofence.autopilot_fence import FenceStatus, fence_for_autopilot
from companion.geofence.shapes import MOST_RADIUS_M, Circle, Obstacle, Zone, ZoneKind, drawn
from companion.messages import GeoPoint
from tests.geofence.strategies import QUIET

EARTH = Geod(ellps="WGS84")
REACH_M = 40_000.0
SNAPS_M = 1e-3  # PROJ takes a place within 1e-10 radians of a frame's origin for the origin
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


def test_a_circle_that_is_near_is_drawn_and_one_that_is_far_is_left_out():
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


@pytest.mark.parametrize(("lon_deg", "here_deg"), [(-179.99, 179.95), (179.95, -179.99), (179.95, 179.9)])
def test_a_rock_over_the_date_line_is_near_by_whichever_longitude_it_is_written(lon_deg, here_deg):
    rock = Polygon([(lon_deg, 51.5), (lon_deg + 0.01, 51.5), (lon_deg, 51.51)])
    frame = frame_at(51.5, here_deg)
    [piece] = polygons_about(rock, frame, REACH_M)
    assert piece.distance(shapely.points(frame.en_from_geo(GeoPoint(lat_deg=51.5, lon_deg=lon_deg)))) < 1e-3


def test_an_edge_is_cut_as_finely_as_its_own_latitude_asks_wherever_the_frame_is():
    far, near = (polygons_about(NORTHERN, frame_at(lat_deg, 20.0), math.inf)[0] for lat_deg in (60.0, 75.0))
    assert len(far.exterior.coords) == len(near.exterior.coords) > 50


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


@settings(**QUIET, max_examples=80)
@example(reach_m=200_000.0, lat_deg=0.0, radius_m=31_485.0, course=6.0, beyond=0.0)
@given(
    reach_m=st.sampled_from([REACH_M, 200_000.0]),
    lat_deg=st.sampled_from([0.0, -50.0, 75.0, 89.8, -90.0]),
    radius_m=st.one_of(st.floats(10.0, 10_000.0), st.floats(10_000.0, MOST_RADIUS_M)),
    course=st.floats(0.0, 2.0 * math.pi),
    beyond=st.floats(-0.9, 0.9),
)
def test_a_circle_of_any_size_anywhere_errs_to_the_safe_side(reach_m, lat_deg, radius_m, course, beyond):
    """A prohibited area of 60 km across was drawn a metre too small in its north; a limit must be no larger."""
    edge = frame_at(lat_deg, 179.0)  # about the circle's middle: all places of its rim are equally far off
    circle, away_m = Circle(edge.origin, radius_m), max(0.0, radius_m + beyond * reach_m)
    frame = LocalFrame(edge.geo_from_en(away_m * math.sin(course), away_m * math.cos(course)))
    around = shapely.union_all(polygons_about(circle, frame, reach_m))
    within = shapely.union_all(polygons_about(circle, frame, reach_m, cover=False))
    turns = course + np.linspace(-1.0, 1.0, 1001) * min(math.pi, reach_m / radius_m)
    rim = edge.array_lonlat_from_en(radius_m * np.column_stack([np.sin(turns), np.cos(turns)]))
    rim_en = frame.array_en_from_lonlat(rim)
    near = shapely.points(rim_en[np.hypot(*rim_en.T) < reach_m])
    assert np.all(shapely.distance(around, near) < SNAPS_M)
    assert np.all(shapely.distance(within, near) < 0.005 * radius_m)  # and is no smaller than 48 sides make it
    assert not np.any(shapely.contains_properly(shapely.buffer(within, -SNAPS_M), near))
    drawn_m = np.hypot(*edge.array_en_from_lonlat(frame.array_lonlat_from_en(shapely.get_coordinates(around))).T)
    assert drawn_m.max(initial=0.0) <= 1.0022 * radius_m


@settings(**QUIET, max_examples=60)
@given(
    lat_deg=st.floats(-75.0, 75.0),
    lon_deg=st.sampled_from([-4.0, 179.9]),
    radius_m=st.one_of(st.floats(10.0, 10_000.0), st.floats(10_000.0, 500_000.0)),
)
@example(lat_deg=50.0, lon_deg=-4.0, radius_m=60_000.0)
def test_a_circle_drawn_in_degrees_errs_to_the_safe_side_too(lat_deg, lon_deg, radius_m):
    """A file that holds no circle has it so, and its sides are straight in longitude and latitude."""
    frame, turns = frame_at(lat_deg, lon_deg), np.linspace(0.0, 2.0 * math.pi, 1441)
    rim = frame.array_lonlat_from_en(radius_m * np.column_stack([np.sin(turns), np.cos(turns)]))
    circle = Circle(frame.origin, radius_m)
    around, within = (drawn(Zone(kind=kind, shape=circle)) for kind in (ZoneKind.EXCLUSION, ZoneKind.INCLUSION))
    rim[:, 0] += 360.0 * np.round((np.mean(around.bounds[::2]) - rim[:, 0]) / 360.0)
    assert np.all(shapely.distance(around, shapely.points(rim)) < 1e-10)
    rim[:, 0] += 360.0 * np.round((np.mean(within.bounds[::2]) - rim[:, 0]) / 360.0)
    assert not np.any(shapely.contains_properly(shapely.buffer(within, -1e-10), shapely.points(rim)))
    corners_m = np.hypot(*frame.array_en_from_lonlat(shapely.get_coordinates(around)).T)
    assert corners_m.max() <= (1.0022 + radius_m / 500_000.0 * 0.002) * radius_m


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
