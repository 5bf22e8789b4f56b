"""The local picture: margins that hold what they promise, clearances, the planner's WKT."""

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely.geometry import Polygon

from companion.geo.frame import LocalFrame
from companion.geofence import Area, Circle, Fence, LocalArea, Obstacle, Zone, ZoneKind
from companion.geofence.area import grown_m
from companion.messages import GeoPoint
from tests.geofence.strategies import QUIET

ORIGIN = GeoPoint(lat_deg=50.8, lon_deg=-1.3)
FRAME = LocalFrame(ORIGIN)


def local(polygons, margins=None, limits=None) -> LocalArea:
    margins = margins or [0.0] * len(polygons)
    return LocalArea(FRAME, tuple(f"o{i}" for i in range(len(polygons))), tuple(polygons), tuple(margins), limits)


def islands(seed, count=6):
    rng = np.random.default_rng(seed)
    out = []
    for _ in range(count):
        t = 2.0 * np.pi * np.arange(9) / 9
        middle = rng.uniform(-300.0, 300.0, 2)
        radii = rng.uniform(10.0, 60.0) * rng.uniform(0.5, 1.0, 9)
        ring = middle + radii[:, None] * np.column_stack([np.cos(t), np.sin(t)])
        out.append(Polygon(ring))
    return out


@settings(**QUIET, max_examples=40)
@given(st.integers(0, 1000), st.floats(0.5, 40.0))
def test_a_margin_is_never_less_than_it_says(seed, margin_m):
    """Outside the buffered obstacles and inside the shrunk limits, everything is at least the margin away."""
    area = local(islands(seed), limits=shapely.box(-400.0, -400.0, 400.0, 400.0).difference(islands(seed + 1, 1)[0]))
    edge = shapely.segmentize(area.buffered(margin_m).boundary, 1.0)
    assert area.obstacle_clearance_m(shapely.get_coordinates(edge)).min() > margin_m - 1e-6
    assert area.obstacle_clearance_m(shapely.get_coordinates(edge)).max() < 1.05 * margin_m + 0.01
    inner = shapely.segmentize(area.water(margin_m).boundary, 1.0)
    assert area.limit_clearance_m(shapely.get_coordinates(inner)).min() > margin_m - 1e-6


@pytest.mark.parametrize("turn_deg", range(4, 180, 3))
def test_a_corner_of_any_angle_is_kept_clear_of_by_the_margin(turn_deg):
    """GEOS rounds the number of a corner's chords: one of 33 degrees is a single chord, nearer by 4 % in its middle."""
    half = np.radians(0.5 * turn_deg)
    x, y = 400.0 * np.cos(half), 400.0 * np.sin(half)
    area = local([Polygon([(0.0, 0.0), (-x, -y), (x, -y)])])
    edge = shapely.segmentize(area.buffered(10.0).boundary, 0.1)
    assert area.obstacle_clearance_m(shapely.get_coordinates(edge)).min() >= 10.0


def test_a_limit_without_a_margin_of_its_own_is_where_it_is_drawn():
    ring = np.array([(-50.0, -50.0), (50.0, -50.0), (50.0, 50.0), (-50.0, 50.0)])
    for margin_m, far_m in ((None, 50.0), (10.0, 40.0)):
        zone = Zone(kind=ZoneKind.INCLUSION, shape=Polygon(FRAME.array_lonlat_from_en(ring)), margin_m=margin_m)
        bounds = Area(fence=Fence((zone,))).local(FRAME).limits.bounds
        assert bounds == pytest.approx((-far_m, -far_m, far_m, far_m), abs=0.05 * (50.0 - far_m) + 1e-3)


@pytest.mark.parametrize(("own_m", "margin_m"), [(None, 0.0), (30.0, 30.0)])
def test_an_obstacle_has_a_margin_of_its_own_where_it_says_one(own_m, margin_m):
    rock = Obstacle(shape=Circle(ORIGIN, 20.0), margin_m=own_m)
    assert Area(obstacles=(rock,)).local(FRAME).own_margins_m == (margin_m,)


def test_few_points_and_many_points_agree():
    area = local(islands(3))
    points = np.random.default_rng(0).uniform(-400.0, 400.0, (900, 2))
    assert np.allclose(
        area.obstacle_clearance_m(points),
        np.concatenate([area.obstacle_clearance_m(points[i : i + 300]) for i in (0, 300, 600)]),
    )


def test_clearances_and_containment():
    area = local([shapely.box(0.0, 0.0, 10.0, 10.0)], limits=shapely.box(-50.0, -50.0, 50.0, 50.0))
    assert area.clearance_m([[20.0, 5.0], [5.0, 5.0], [45.0, 5.0], [60.0, 5.0]]) == pytest.approx([10, -5, 5, -10])
    assert area.contains([[20.0, 5.0], [5.0, 5.0], [60.0, 5.0]]).tolist() == [True, False, False]
    assert area.contains([[20.0, 5.0], [45.0, 5.0]], margin_m=8.0).tolist() == [True, False]
    assert area.path_clearance_m([[20.0, -20.0], [20.0, 20.0], [-20.0, 20.0]]) == pytest.approx(10.0)
    assert area.path_clearance_m([[-20.0, 5.0], [20.0, 5.0]]) <= 0.0
    assert area.path_clearance_m([[20.0, 5.0], [60.0, 5.0]]) < 0.0
    sea = local([])
    assert np.isinf(sea.clearance_m([[0.0, 0.0]])).all()
    assert sea.contains([[0.0, 0.0]], 10.0).all()
    assert sea.obstacles_wkt(10.0) == []
    assert sea.fence_wkt(10.0) is None


def test_an_obstacles_own_margin_counts_where_it_is_larger():
    area = local([shapely.box(0.0, 0.0, 10.0, 10.0), shapely.box(100.0, 0.0, 110.0, 10.0)], margins=[30.0, 0.0])
    assert area.contains([[-20.0, 5.0], [80.0, 5.0]], 12.0).tolist() == [False, True]


def test_the_planners_wkt():
    boxes = [shapely.box(-50, -50, 50, 50), shapely.box(50, -3, 100, 3), shapely.box(100, -50, 200, 50)]
    lake = shapely.union_all(boxes)
    area = local([shapely.box(0.0, 0.0, 10.0, 10.0), shapely.box(12.0, 0.0, 20.0, 10.0)], limits=lake)
    assert len(area.obstacles_wkt()) == 2
    assert len(area.obstacles_wkt(5.0)) == 1
    west = shapely.from_wkt(area.fence_wkt(10.0, (0.0, -20.0)))
    east = shapely.from_wkt(area.fence_wkt(10.0, (150.0, 0.0)))
    assert west.bounds[2] < 45.0 < 105.0 < east.bounds[0]
    with pytest.raises(ValueError, match="no water is left"):
        area.fence_wkt(80.0)


def test_of_two_waters_as_near_the_larger_is_planned_in():
    waters = shapely.MultiPolygon([shapely.box(-30.0, -10.0, -20.0, 10.0), shapely.box(20.0, -10.0, 90.0, 10.0)])
    assert shapely.from_wkt(local([], limits=waters).fence_wkt(0.0, (0.0, 0.0))).bounds[0] == 20.0


def test_inclusions_intersect_and_circles_err_to_the_safe_side():
    inside = Zone(kind=ZoneKind.INCLUSION, shape=Circle(ORIGIN, 100.0))
    other = Zone(kind=ZoneKind.INCLUSION, shape=Circle(FRAME.geo_from_en(150.0, 0.0), 100.0), margin_m=10.0)
    rock = Obstacle(shape=Circle(FRAME.geo_from_en(300.0, 0.0), 20.0))
    picture = Area(obstacles=(rock,), fence=Fence((inside, other))).local(FRAME)
    assert picture.limits.bounds[0] == pytest.approx(60.0, abs=0.5)
    assert picture.limits.bounds[2] <= 100.0
    t = np.linspace(0.0, 2.0 * np.pi, 500)
    rim = np.column_stack([300.0 + 20.0 * np.cos(t), 20.0 * np.sin(t)])
    assert (picture.obstacle_clearance_m(rim) <= 1e-3).all()


def test_what_is_asked_without_a_margin_is_the_bare_obstacles_and_limits():
    area = local([shapely.box(0, 0, 10, 10), shapely.box(11, 0, 20, 10)], limits=shapely.box(-50, -50, 50, 50))
    assert area.obstacle_names() == ["o0", "o1"]
    assert len(area.obstacles_wkt()) == 2
    assert shapely.from_wkt(area.fence_wkt()).bounds == (-50.0, -50.0, 50.0, 50.0)
    assert area.water().bounds == (-50.0, -50.0, 50.0, 50.0)
    assert area.contains([[10.5, 5.0], [49.5, 0.0], [50.5, 0.0]]).tolist() == [True, True, False]
    assert area.obstacle_names(1.0) == ["o0 and o1"]


@pytest.mark.parametrize(("place", "clearance_m"), [((20.0, 5.0), 10.0), ((45.0, 5.0), 5.0), ((60.0, 5.0), -1.0)])
def test_a_path_that_is_a_single_place_is_as_clear_as_the_place(place, clearance_m):
    area = local([shapely.box(0.0, 0.0, 10.0, 10.0)], limits=shapely.box(-50.0, -50.0, 50.0, 50.0))
    assert area.path_clearance_m([place]) == pytest.approx(clearance_m)


@pytest.mark.parametrize(("own_m", "asked_m", "kept_m"), [(0.0, 12.0, 12.0), (8.0, 12.0, 12.0), (30.0, 12.0, 30.0)])
def test_what_is_spare_is_what_the_drawn_water_leaves_beyond_the_larger_margin(own_m, asked_m, kept_m):
    """A way that was thought to have 18 m to spare would lie on the edge of what the planner may use."""
    area = local([shapely.box(0.0, 0.0, 10.0, 10.0)], margins=[own_m], limits=shapely.box(-90.0, -90.0, 90.0, 90.0))
    beside, inside, at_the_fence = area.spare_m([(50.0, 5.0), (5.0, 5.0), (-85.0, 5.0)], asked_m)
    assert beside == pytest.approx(40.0 - grown_m(kept_m))
    assert inside < 0.0
    assert at_the_fence == pytest.approx(5.0 - grown_m(asked_m))
    edge = shapely.get_coordinates(area.buffered(asked_m))
    assert np.all(area.spare_m(edge, asked_m) <= 1e-6)


def test_more_obstacles_come_after_the_areas_own_with_their_names_and_margins():
    plain = local([shapely.box(0.0, 0.0, 10.0, 10.0)], margins=[5.0], limits=shapely.box(-90.0, -90.0, 90.0, 90.0))
    more = plain.also(("ship",), (shapely.box(40.0, 0.0, 50.0, 10.0),), (20.0,))
    assert (more.names, more.own_margins_m, more.limits) == (("o0", "ship"), (5.0, 20.0), plain.limits)
    assert more.nearest_name((39.0, 5.0)) == "ship"
    assert more.contains([[30.0, 5.0], [18.0, 5.0], [13.0, 5.0]], 1.0).tolist() == [False, True, False]
    assert plain.contains([[30.0, 5.0]], 1.0).tolist() == [True]
