"""Where a drift goes: how far, how clear, when it meets what."""

import math

import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.skipper.way.drift import HORIZON_S, drift_ahead, floor_after_s, floor_from_m
from tests.skipper.world import area

ROCK = shapely.box(100.0, -20.0, 140.0, 20.0)
SPEEDS = st.floats(-2.0, 2.0).map(lambda mps: round(mps, 3))


def test_a_drift_onto_a_rock_is_timed_to_the_floor_and_to_the_contact():
    ahead = drift_ahead(area(ROCK), (0.0, 0.0), (0.5, 0.0), floor_m=8.0)
    assert ahead.end_en_m == (150.0, 0.0)
    assert ahead.floor_s == pytest.approx((100.0 - 8.0) / 0.5, abs=0.1)
    assert ahead.contact_s == pytest.approx(200.0, abs=0.1)
    assert ahead.at_en_m == pytest.approx((92.0, 0.0), abs=0.1)
    assert ahead.clearance_m <= 0.0
    assert ahead.name == "o0"
    assert not ahead.is_clear
    assert ahead.sentence() == "drifting 0.5 m/s towards 090°, onto o0 in 200 s"


def test_a_drift_past_a_rock_comes_within_the_floor_and_touches_nothing():
    ahead = drift_ahead(area(ROCK), (0.0, -24.0), (0.5, 0.0), floor_m=8.0)
    assert ahead.clearance_m == pytest.approx(4.0)
    assert ahead.contact_s is None
    assert ahead.floor_s == pytest.approx((100.0 - math.sqrt(8.0**2 - 4.0**2)) / 0.5, abs=0.2)


def test_beyond_the_horizon_and_away_it_is_clear():
    for velocity, horizon_s in (((0.5, 0.0), 120.0), ((-0.5, 0.0), 300.0), ((0.0, 0.0), 300.0)):
        ahead = drift_ahead(area(ROCK), (0.0, 0.0), velocity, floor_m=8.0, horizon_s=horizon_s)
        assert ahead.is_clear
        assert ahead.name == ""
    assert drift_ahead(area(), (0.0, 0.0), (1.0, 0.0), floor_m=8.0).sentence() == "drifting 1 m/s towards 090°, clear"


@given(x=st.floats(-60.0, 160.0), y=st.floats(-60.0, 60.0), east=SPEEDS, north=SPEEDS, floor_m=st.floats(0.0, 15.0))
def test_the_floor_is_met_when_the_looks_along_the_whole_way_say(x, y, east, north, floor_m):
    water = area(ROCK, limits=shapely.box(-80.0, -80.0, 180.0, 80.0))
    ahead = drift_ahead(water, (x, y), (east, north), floor_m=floor_m)
    found_s = floor_after_s(water, (x, y), (east, north), floor_m=floor_m)
    if ahead.floor_s is not None and ahead.clearance_m < floor_m - 2.0:
        assert found_s == pytest.approx(ahead.floor_s, abs=2.0 * HORIZON_S / 240.0)
    elif ahead.is_clear:
        assert found_s == HORIZON_S


def test_a_boat_that_lies_still_too_near_is_there_already():
    ahead = drift_ahead(area(ROCK), (95.0, 0.0), (0.0, 0.0), floor_m=8.0)
    assert ahead.floor_s == 0.0
    assert ahead.contact_s is None


def test_the_fence_is_met_by_its_name():
    ahead = drift_ahead(area(limits=shapely.box(-50.0, -50.0, 50.0, 50.0)), (0.0, 0.0), (0.0, 1.0), floor_m=5.0)
    assert ahead.name == "the fence"
    assert ahead.floor_s == pytest.approx(45.0, abs=0.1)
    assert ahead.contact_s == pytest.approx(50.0, abs=0.1)


def test_a_point_too_thin_for_the_looks_is_met_all_the_same():
    pin = shapely.box(99.9, -0.05, 100.0, 0.05)
    ahead = drift_ahead(area(pin), (0.0, 0.0), (3.0, 0.0), floor_m=0.0)
    assert ahead.contact_s == pytest.approx(100.0 / 3.0, abs=1.0)


@pytest.mark.parametrize(("north_mps", "is_clear"), [(0.5, True), (-0.5, False)])
def test_from_inside_something_only_what_leads_deeper_is_met(north_mps, is_clear):
    shore = area(shapely.box(-100.0, -100.0, 100.0, 4.0))
    floor_m = floor_from_m(-4.0, 6.0)
    ahead = drift_ahead(shore, (0.0, 0.0), (0.0, north_mps), floor_m=floor_m, horizon_s=60.0)
    assert ahead.is_clear is is_clear


@settings(max_examples=60)
@given(st.floats(-math.pi, math.pi), st.floats(0.05, 2.0), st.floats(0.0, 15.0))
def test_before_it_is_said_to_come_near_it_is_not_near(set_rad, speed, floor_m):
    water = area(ROCK, shapely.Point(-60.0, 70.0).buffer(15.0))
    ahead = drift_ahead(water, (20.0, 5.0), (speed * math.sin(set_rad), speed * math.cos(set_rad)), floor_m=floor_m)
    until_s = 300.0 if ahead.floor_s is None else max(0.0, ahead.floor_s - 2.0)
    there = (20.0 + until_s * speed * math.sin(set_rad), 5.0 + until_s * speed * math.cos(set_rad))
    assert water.path_clearance_m([(20.0, 5.0), there]) >= floor_m - 0.1


@pytest.mark.parametrize(("floor_m", "horizon_s"), [(-math.inf, 300.0), (math.nan, 300.0), (5.0, 0.0)])
def test_what_is_out_of_range_is_refused(floor_m, horizon_s):
    with pytest.raises(ValueError, match="floor"):
        drift_ahead(area(ROCK), (0.0, 0.0), (0.5, 0.0), floor_m=floor_m, horizon_s=horizon_s)
