"""Places carried from one frame to another: nothing is lost on the way, at the date line and near the pole too."""

import math
from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pyproj import Geod

from companion.geo.frame import LocalFrame
from companion.geo.shift import Shift, carried
from companion.messages import GeoPoint

EARTH = Geod(ellps="WGS84")
ORIGINS = st.sampled_from([(0.0, 0.0), (50.8, -1.3), (51.5, 179.99), (-52.0, -179.97), (75.0, 20.0), (-78.0, 166.0)])
NEAR = st.tuples(st.floats(-20_000.0, 20_000.0), st.floats(-20_000.0, 20_000.0))


def shift_of(origin, aside):
    before = LocalFrame(GeoPoint(lat_deg=origin[0], lon_deg=origin[1]))
    return Shift(before, LocalFrame(before.geo_from_en(*aside)))


@given(ORIGINS, NEAR, NEAR)
def test_there_and_back_is_where_it_was(origin, aside, place):
    shift = shift_of(origin, aside)
    back = Shift(shift.after, shift.before)
    assert math.dist(back.point(shift.point(place)), place) < 1e-3


@given(ORIGINS, NEAR, NEAR)
def test_a_place_is_the_same_one_on_the_globe(origin, aside, place):
    shift = shift_of(origin, aside)
    a, b = shift.before.geo_from_en(*place), shift.after.geo_from_en(*shift.point(place))
    assert EARTH.inv(a.lon_deg, a.lat_deg, b.lon_deg, b.lat_deg)[2] < 1e-3


def test_a_hundred_changes_of_frame_move_a_place_by_less_than_a_millimetre():
    shift, place = shift_of((75.0, 179.0), (0.0, 0.0)), (700.0, -400.0)
    first = shift.before.geo_from_en(*place)
    frame = shift.before
    for _ in range(100):
        further = Shift(frame, LocalFrame(frame.geo_from_en(9000.0, 1000.0)))
        place, frame = further.point(place), further.after
    last = frame.geo_from_en(*place)
    assert EARTH.inv(first.lon_deg, first.lat_deg, last.lon_deg, last.lat_deg)[2] < 1e-3


@pytest.mark.parametrize("lat_deg", [0.0, 51.5, -51.5, 75.0])
def test_the_grid_turns_as_the_meridians_close_in(lat_deg):
    shift = shift_of((lat_deg, 179.95), (10_000.0, 0.0))
    closing = math.radians((shift.after.origin.lon_deg - 179.95) % 360.0) * math.sin(math.radians(lat_deg))
    assert shift.turn_rad == pytest.approx(closing, abs=2e-5)
    # A way to the north of the old grid, where the new one begins, is sailed in the direction that it turns to.
    here = shift.before.en_from_geo(shift.after.origin)
    there = shift.point((here[0], here[1] + 50.0))
    assert shift.vector((0.0, 50.0)) == pytest.approx(there, abs=1e-3)


@dataclass(frozen=True)
class Inner:
    en_m: tuple[float, float] | None = None
    velocity_en_mps: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True)
class Outer:
    name: str = "x"
    inner: tuple[Inner, ...] = ()
    way_en_m: tuple[tuple[float, float], ...] = ()
    points_en: np.ndarray | None = None
    size_m: tuple[float, float] = (3.0, 4.0)


def test_places_and_velocities_are_found_by_their_names_and_nothing_else_is_touched():
    shift = shift_of((51.5, 179.99), (2000.0, 500.0))
    inner = (Inner(), Inner(en_m=(1.0, 2.0), velocity_en_mps=(3.0, 0.0)))
    outer = Outer(inner=inner, way_en_m=((0.0, 0.0), (5.0, 5.0)), points_en=np.array([[7.0, 8.0]]))
    out = carried(outer, shift)
    assert out.inner[0] == Inner()
    assert out.inner[1].en_m == shift.point((1.0, 2.0))
    assert out.inner[1].velocity_en_mps == shift.vector((3.0, 0.0))
    assert out.way_en_m == (shift.point((0.0, 0.0)), shift.point((5.0, 5.0)))
    assert out.points_en.tolist() == [list(shift.point((7.0, 8.0)))]
    assert (out.name, out.size_m) == ("x", (3.0, 4.0))


def test_what_has_no_place_is_the_same_object():
    shift = shift_of((51.5, 179.99), (2000.0, 500.0))
    for value in (Outer(), Inner(), "words", 3.0, None, ("a", 1)):
        assert carried(value, shift) is value or value == Inner()
