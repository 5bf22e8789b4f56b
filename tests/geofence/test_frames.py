"""The local frame against the geodesic; Büsser's flat earth against both."""

import functools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pyproj import Geod

from companion.geo.frame import LocalFrame
from companion.messages import GeoPoint
from companion.planner.reference.astar import flat_en_from_lonlat, flat_lonlat_from_en
from tests.geofence.strategies import QUIET

GEOD = Geod(ellps="WGS84")
PLACES = [
    (50.8, -1.3),
    (0.0, 0.0),
    (0.01, 179.999),
    (-0.01, -179.999),
    (78.2, 15.6),
    (-77.8, 166.7),
    (-33.9, 151.2),
    (89.0, 0.0),
    (65.0, 180.0),
    (-54.8, -68.3),
]


@functools.cache
def frame_at(lat_deg: float, lon_deg: float) -> LocalFrame:
    return LocalFrame(GeoPoint(lat_deg=lat_deg, lon_deg=lon_deg))


def geodesic_m(a: GeoPoint, b: GeoPoint) -> float:
    return float(GEOD.inv(a.lon_deg, a.lat_deg, b.lon_deg, b.lat_deg)[2])


@settings(**QUIET, max_examples=100)
@given(
    st.sampled_from(PLACES),
    st.floats(0.0, 360.0),
    st.floats(0.0, 50_000.0),
    st.floats(0.0, 360.0),
    st.floats(0.0, 50_000.0),
)
def test_below_a_metre_within_50_km(place, bearing_a, far_a_m, bearing_b, far_b_m):
    """Distances in the frame are the geodesic's to below 1 m, wherever the two points lie within 50 km."""
    origin = GeoPoint(lat_deg=place[0], lon_deg=place[1])
    frame = frame_at(*place)
    a, b = (
        frame.geo_from_en(far * math.sin(math.radians(turn)), far * math.cos(math.radians(turn)))
        for turn, far in ((bearing_a, far_a_m), (bearing_b, far_b_m))
    )
    (ax, ay), (bx, by) = frame.en_from_geo(a), frame.en_from_geo(b)
    assert abs(math.hypot(bx - ax, by - ay) - geodesic_m(a, b)) < 1.0
    assert abs(math.hypot(ax, ay) - geodesic_m(origin, a)) < 1e-3
    if far_a_m > 1.0:
        azimuth = float(GEOD.inv(origin.lon_deg, origin.lat_deg, a.lon_deg, a.lat_deg)[0])
        assert abs(math.remainder(azimuth - bearing_a, 360.0)) < 1e-6 * 50_000.0 / far_a_m


@settings(**QUIET, max_examples=100)
@given(st.sampled_from(PLACES), st.floats(-50_000.0, 50_000.0), st.floats(-50_000.0, 50_000.0))
def test_there_and_back(place, east_m, north_m):
    frame = frame_at(*place)
    back = frame.en_from_geo(frame.geo_from_en(east_m, north_m))
    assert math.dist(back, (east_m, north_m)) < 1e-3  # PROJ takes the last millimetre for the origin itself


def test_a_hair_beyond_the_antimeridian_is_a_place():
    """PROJ wraps a longitude only when it is well beyond 180 degrees; 0.2 micrometres are not."""
    frame = frame_at(65.0, 180.0)
    point = frame.geo_from_en(2e-07, 1.0)
    assert math.dist(frame.en_from_geo(point), (0.0, 1.0)) < 1e-3
    ((lon_deg, _lat_deg),) = frame.array_lonlat_from_en([[2e-07, 1.0]])
    assert abs(lon_deg) <= 180.0


def test_scalars_and_arrays_agree():
    frame = LocalFrame(GeoPoint(lat_deg=50.8, lon_deg=-1.3))
    lonlat = [[-1.31, 50.81], [-1.2, 50.7]]
    array = frame.array_en_from_lonlat(lonlat)
    for row, (lon, lat) in zip(array, lonlat, strict=True):
        assert tuple(row) == pytest.approx(frame.en_from_geo(GeoPoint(lat_deg=lat, lon_deg=lon)))
    assert np.allclose(frame.array_lonlat_from_en(array), lonlat)


def flat_error_m(lat_deg: float, reach_m: float) -> float:
    """The largest error of a distance between two points within ``reach_m`` of the origin, by Büsser's formula."""
    origin = GeoPoint(lat_deg=lat_deg, lon_deg=0.0)
    frame = LocalFrame(origin)
    turns = np.radians(np.arange(0.0, 360.0, 15.0))
    en = reach_m * np.column_stack([np.sin(turns), np.cos(turns)])
    lonlat = frame.array_lonlat_from_en(en)
    flat = flat_en_from_lonlat(origin, lonlat)
    worst = 0.0
    for i in range(len(turns)):
        for j in range(i):
            true_m = GEOD.inv(*lonlat[i], *lonlat[j])[2]
            worst = max(worst, abs(float(np.hypot(*(flat[i] - flat[j]))) - true_m))
    return worst


# docs/lab/frames.md prints this table; a change of either shows here.
FLAT_TABLE = {
    (0.0, 1_000.0): 11.23,
    (0.0, 10_000.0): 112.3,
    (0.0, 50_000.0): 561.3,
    (50.8, 1_000.0): 6.26,
    (50.8, 10_000.0): 70.75,
    (50.8, 50_000.0): 696.1,
    (70.0, 1_000.0): 8.16,
    (70.0, 10_000.0): 107.6,
    (70.0, 50_000.0): 1346.0,
}


@pytest.mark.parametrize(("lat_deg", "reach_m"), sorted(FLAT_TABLE))
def test_the_flat_earth_is_as_wrong_as_the_docs_say(lat_deg, reach_m):
    assert flat_error_m(lat_deg, reach_m) == pytest.approx(FLAT_TABLE[lat_deg, reach_m], rel=0.01)


@settings(**QUIET, max_examples=50)
@given(st.floats(-80.0, 80.0), st.floats(-180.0, 180.0), st.floats(-5_000.0, 5_000.0), st.floats(-5_000.0, 5_000.0))
def test_flat_earth_there_and_back(lat_deg, lon_deg, east_m, north_m):
    origin = GeoPoint(lat_deg=lat_deg, lon_deg=lon_deg)
    lonlat = flat_lonlat_from_en(origin, [[east_m, north_m]])
    assert np.abs(lonlat[:, 0]).max() <= 180.0
    assert np.allclose(flat_en_from_lonlat(origin, lonlat), [[east_m, north_m]], atol=1e-5)
