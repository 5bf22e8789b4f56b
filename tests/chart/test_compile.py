"""Charts made into an area: nothing that is charted is left out, whatever its place, its scale or its neighbours."""

import json

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely.geometry import LineString, Point, Polygon, box

from companion.chart import Chart, Danger, Source, area_of, containing
from companion.geo.frame import LocalFrame
from companion.geofence import Circle, read
from companion.geofence.shapes import polygon_en
from companion.messages import GeoPoint


@st.composite
def shores(draw):
    """Return a shore of 3 to 60 corners [m]: a ring about a place, as ragged as it likes, perhaps with a lagoon."""
    count = draw(st.integers(3, 60))
    seed = draw(st.integers(0, 2**32 - 1))
    rng = np.random.default_rng(seed)
    turns = np.sort(rng.uniform(0.0, 2.0 * np.pi, count))
    size_m = draw(st.sampled_from([2.0, 30.0, 500.0, 8000.0]))
    radii = size_m * rng.uniform(0.05, 1.0, count) ** draw(st.sampled_from([0.2, 1.0, 3.0]))
    ring = np.column_stack([radii * np.cos(turns), radii * np.sin(turns)])
    shape = shapely.make_valid(Polygon(ring))
    if draw(st.booleans()):
        shape = shapely.difference(shape, shapely.buffer(Point(0.0, 0.0), 0.3 * size_m))
    return shape


@settings(max_examples=100, deadline=None)
@given(shores(), st.sampled_from([0.5, 3.0, 40.0]))
def test_what_is_simplified_contains_what_is_true(shore, tolerance_m):
    simple = containing(shore, tolerance_m)
    true = shapely.union_all([p for p in shapely.get_parts(shore) if p.geom_type == "Polygon"])
    if true.is_empty:
        assert simple.is_empty
        return
    assert shapely.covers(simple, true)
    assert shapely.covers(shapely.buffer(true, 2.9 * tolerance_m + 0.1), simple)  # twice, and a mitred corner


def test_and_has_fewer_corners():
    turns = np.linspace(0.0, 2.0 * np.pi, 2000, endpoint=False)
    island = Polygon(np.column_stack([500.0 * np.cos(turns), 500.0 * np.sin(turns)]))
    assert len(shapely.get_coordinates(containing(island, 3.0))) < 60


HERE = GeoPoint(lat_deg=50.0, lon_deg=-1.0)
FIRST = Source(name="one", edition="2", date="2026-01-02")
SECOND = Source(name="two")


def square(east_m, north_m, half_m, here=HERE):
    """Return a square about a place so far from ``here``, in longitude and latitude."""
    frame = LocalFrame(here)
    corners = [(east_m + half_m * dx, north_m + half_m * dy) for dx, dy in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    lonlat = [frame.geo_from_en(*c) for c in corners]
    near = lambda lon: lon + 360.0 * round((here.lon_deg - lon) / 360.0)  # noqa: E731
    return Polygon([(near(p.lon_deg), p.lat_deg) for p in lonlat])


def chart(*dangers, source=FIRST, coverage="all", **more):
    return Chart(source=source, dangers=dangers, coverage=square(0, 0, 5000) if coverage == "all" else coverage, **more)


def rock(east_m, north_m, **more):
    place = LocalFrame(HERE).geo_from_en(east_m, north_m)
    return Danger(reason="rock", geometry=Point(place.lon_deg, place.lat_deg), radius_m=10.0, **more)


def is_solid(area, east_m, north_m, here=HERE):
    return bool(any(shapely.covers(polygon_en(s.shape, LocalFrame(here)), Point(east_m, north_m)) for s in area.solids))


def test_each_obstacle_says_why_and_by_what(tmp_path):
    island = Danger(reason="land", geometry=square(300, 0, 50), name="Hat")
    area = area_of([chart(island, rock(-300, 0, depth_m=0.4, doubt_m=20.0))], HERE, 1000.0)
    features = json.loads(area.obstacles_json())["features"]
    assert [f["properties"] for f in features] == [
        {"kind": "exclusion", "name": "land", "reason": "land", "source": "one", "edition": "2", "date": "2026-01-02"},
        {
            "kind": "exclusion",
            "name": "rock",
            "reason": "rock",
            "source": "one",
            "edition": "2",
            "date": "2026-01-02",
            "depth_m": 0.4,
            "margin_m": 20.0,
            "radius_m": 10.0,
        },
    ]
    (tmp_path / "a.geojson").write_bytes(area.obstacles_json())
    document = read(tmp_path / "a.geojson", near=HERE).require_clean()
    assert [(z.name, z.margin_m) for z in document.zones] == [("land", None), ("rock", 20.0)]
    assert isinstance(document.zones[1].shape, Circle)
    (tmp_path / "f.geojson").write_bytes(area.fence_json())
    assert [z.kind.value for z in read(tmp_path / "f.geojson").require_clean().zones] == ["inclusion"]


def test_where_no_chart_speaks_it_is_solid():
    area = area_of([chart(coverage=square(-500, 0, 500))], HERE, 900.0)
    assert not is_solid(area, -400.0, 0.0)
    assert is_solid(area, 400.0, 0.0)
    assert {s.reason for s in area.solids} == {"no chart"}


@pytest.mark.parametrize("gap_m", [0.0, 0.4, 1.6])
def test_the_seam_of_two_cells_has_no_gap_and_is_no_wall(gap_m):
    """Land that goes on over the seam is whole, and water that does is no land."""
    west, east = (
        chart(
            Danger(reason="land", geometry=square(sign * (200.0 + 0.5 * gap_m), 300.0, 200.0)),
            coverage=square(sign * (2000.0 + 0.5 * gap_m), 0.0, 2000.0),
            source=source,
        )
        for sign, source in ((-1.0, FIRST), (1.0, SECOND))
    )
    area = area_of([west, east], HERE, 1000.0)
    solid = shapely.union_all([polygon_en(s.shape, area.frame) for s in area.solids])
    assert shapely.covers(solid, LineString([(-399, 300), (399, 300)]))
    assert not shapely.intersects(solid, LineString([(-399, -300), (399, -300)]))


def test_the_finer_chart_counts_where_two_speak():
    """Of the coarser one the islands beside it are left, drawn where they are not, and its rocks within are gone."""
    coarse = chart(
        Danger(reason="land", geometry=square(0, 0, 200)),
        Danger(reason="land", geometry=square(2000, 0, 100)),
        rock(100.0, 250.0),
        rock(2000.0, 600.0),
        resolution_m=40.0,
        supersedes=True,
    )
    fine = chart(
        Danger(reason="land", geometry=square(-100, 0, 80)),
        source=SECOND,
        coverage=square(0, 0, 500),
        resolution_m=5.0,
        supersedes=True,
    )
    for order in ([coarse, fine], [fine, coarse]):
        area = area_of(order, HERE, 3000.0)
        assert is_solid(area, -100.0, 0.0)
        assert not is_solid(area, 150.0, 0.0)
        assert not is_solid(area, 100.0, 250.0)
        assert is_solid(area, 2000.0, 0.0)
        assert is_solid(area, 2000.0, 600.0)


def test_of_two_as_fine_both_count_and_a_grid_silences_nobody():
    island, other = (Danger(reason="land", geometry=square(x, 0, 50)) for x in (-200, 200))
    same = [chart(d, source=s, resolution_m=5.0, supersedes=True) for d, s in ((island, FIRST), (other, SECOND))]
    assert all(is_solid(area_of(same, HERE, 1000.0), x, 0.0) for x in (-200.0, 200.0))
    grid = chart(source=SECOND, resolution_m=1.0)
    assert is_solid(area_of([grid, chart(rock(0, 0), resolution_m=40.0, supersedes=True)], HERE, 1000.0), 0.0, 0.0)


def test_a_point_inside_of_what_is_solid_is_not_told_twice_unless_it_is_in_more_doubt():
    island = Danger(reason="land", geometry=square(0, 0, 100))
    assert len(area_of([chart(island, rock(0, 0))], HERE, 1000.0).solids) == 1
    assert len(area_of([chart(island, rock(0, 0, doubt_m=50.0))], HERE, 1000.0).solids) == 2
    assert len(area_of([chart(island, rock(95, 0))], HERE, 1000.0).solids) == 2


@pytest.mark.parametrize("lat_deg", [0.0, -52.0, 80.0])
@pytest.mark.parametrize("lon_deg", [179.9999, -179.9999])
def test_the_date_line_and_eighty_north(lat_deg, lon_deg, tmp_path):
    """An island across the line, drawn in two parts as charts do, one on either side."""
    here = GeoPoint(lat_deg=lat_deg, lon_deg=lon_deg)
    whole = square(0, 0, 200, here)
    left = shapely.intersection(whole, box(-180, -90, 180, 90))
    other = 360.0 if lon_deg < 0 else -360.0
    right = shapely.intersection(
        shapely.transform(whole, lambda p: p + np.array([other, 0.0])), box(-180, -90, 180, 90)
    )
    land = [Danger(reason="land", geometry=p) for p in (left, right)]
    assert not left.is_empty
    assert not right.is_empty
    area = area_of([chart(*land, coverage=None)], here, 1000.0)
    (tmp_path / "a.geojson").write_bytes(area.obstacles_json())
    document = read(tmp_path / "a.geojson", near=here).require_clean()
    solid = shapely.union_all([polygon_en(z.shape, LocalFrame(here)) for z in document.zones])
    assert shapely.covers(solid, box(-199, -199, 199, 199))
    assert solid.area < 420.0**2


def test_long_edges_are_straight_in_longitude_and_latitude():
    """At 80 N the middle of an edge of 40 km along the parallel lies 180 m off the straight line of any flat frame."""
    here = GeoPoint(lat_deg=80.0, lon_deg=10.0)
    land = Danger(reason="land", geometry=box(8.96, 79.9, 11.04, 80.0))
    area = area_of([chart(land, coverage=None)], here, 25_000.0)
    frame = LocalFrame(here)
    for lon_deg in np.linspace(9.0, 11.0, 9):
        east_m, north_m = frame.en_from_geo(GeoPoint(lat_deg=80.0, lon_deg=float(lon_deg)))
        assert is_solid(area, east_m, north_m, here)
        assert not is_solid(area, east_m, north_m + 12.0, here)


def test_what_a_tide_makes_deep_enough_is_kept_apart_by_its_depth_and_takes_no_rocks_place():
    """A rock on a bar is as solid as before when the bar has gone under."""
    bar = Danger(geometry=square(0.0, 0.0, 200.0), reason="drying height", depth_m=-0.5)
    flat = Danger(geometry=square(350.0, 0.0, 100.0), reason="drying height", depth_m=-2.5)
    rock = Danger(geometry=square(0.0, 0.0, 0.0).centroid, reason="rock", radius_m=10.0, depth_m=-3.0)
    chart = Chart(source=FIRST, dangers=(bar, flat, rock), coverage=square(0.0, 0.0, 3000.0), resolution_m=10.0)
    plain = area_of([chart], HERE, 1000.0)
    assert plain.drying == ()
    assert {s.reason for s in plain.solids} == {"drying height"}  # the rock is in it
    apart = area_of([chart], HERE, 1000.0, floats_m=-1.0)
    assert [s.depth_m for s in apart.drying] == [-0.5]
    assert {(s.reason, s.depth_m) for s in apart.always} == {("drying height", -2.5), ("rock", -3.0)}
    assert json.loads(apart.drying_json())["features"][0]["properties"]["depth_m"] == -0.5
