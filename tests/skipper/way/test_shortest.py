"""The shortest way by water: round what is solid, never through it, and as long as it really is."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely.geometry import LineString, Point, box

from companion.skipper.way.shortest import shortest_way, way_m
from tests.skipper.world import area

WALLS = (box(-800.0, 850.0, 800.0, 900.0), box(-800.0, 0.0, -750.0, 900.0), box(750.0, 0.0, 800.0, 900.0))
BAY = area(*WALLS)  # open to the south; a boat in it


def test_in_open_water_it_is_the_straight_line():
    assert shortest_way(area(), (0.0, 0.0), (300.0, 400.0), 15.0) == ((0.0, 0.0), (300.0, 400.0))
    assert way_m(area(), (0.0, 0.0), (300.0, 400.0), 15.0) == pytest.approx(500.0)


def test_out_of_a_bay_it_leads_by_its_mouth():
    way = shortest_way(BAY, (100.0, 400.0), (100.0, 1200.0), 15.0)
    assert way is not None
    assert BAY.path_clearance_m(way) >= 15.0
    assert min(north for _, north in way) < 0.0
    exact_m = math.dist((100, 400), (735, -15)) + 80.0 + 930.0 + math.dist((815, 915), (100, 1200))
    assert exact_m <= way_m(BAY, (100.0, 400.0), (100.0, 1200.0), 15.0) <= 1.15 * exact_m  # by cells of 85 m


def test_to_a_lake_there_is_none():
    ring = Point(0.0, 0.0).buffer(170.0).difference(Point(0.0, 0.0).buffer(130.0))
    assert shortest_way(area(ring), (0.0, -700.0), (0.0, 0.0), 15.0) is None
    assert math.isinf(way_m(area(ring), (0.0, -700.0), (0.0, 0.0), 15.0))


@settings(max_examples=30, deadline=None)
@given(st.floats(-600.0, 600.0), st.floats(-600.0, 600.0), st.floats(40.0, 250.0), st.floats(0.0, 2.0 * math.pi))
def test_it_never_leads_through_anything_and_is_no_shorter_than_the_straight_line(east, north, radius, course):
    rock = Point(east, north).buffer(radius)
    ends = (0.0, 0.0), (900.0 * math.sin(course), 900.0 * math.cos(course))
    made = area(rock)
    if min(made.clearance_m(ends)) < 60.0:
        return
    way = shortest_way(made, *ends, 15.0)
    assert way is not None
    assert not LineString(way).intersects(rock)
    assert math.dist(*ends) - 1e-6 <= way_m(made, *ends, 15.0) <= math.dist(*ends) + math.pi * radius + 150.0
