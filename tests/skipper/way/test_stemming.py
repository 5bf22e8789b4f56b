"""A current that she cannot stem: said by name, and where she waits for it to ease."""

import math

import pytest
from shapely.geometry import Polygon

from companion.boat import Boat, ardurover_sitl
from companion.skipper.way.drift import drift_ahead
from companion.skipper.way.stemming import Water, waiting_place
from tests.skipper.world import area

BOAT = Boat(polar=ardurover_sitl())
FLOOR_M = 8.0


def water(east, north):
    return Water(boat=BOAT, wind=(0.0, 5.0), current_en_mps=(east, north), no_go_half_rad=math.radians(45.0))


@pytest.mark.parametrize(("drift", "is_foul"), [(0.5, False), (1.0, False), (1.6, True), (2.5, True)])
def test_towards_the_wind_she_makes_way_until_the_current_is_stronger(drift, is_foul):
    said = water(0.0, -drift).trouble((0.0, 0.0), (0.0, 300.0))
    assert bool(said) == is_foul
    assert not is_foul or f"cannot make way against {drift:.1f} m/s" in said


def test_with_it_she_always_does_and_still_water_is_never_foul():
    assert not water(0.0, -2.5).trouble((0.0, 0.0), (0.0, -300.0))
    assert not water(0.0, 0.0).trouble((0.0, 0.0), (0.0, 300.0))


def test_what_carries_her_is_the_least_of_what_she_can_have():
    east, north = water(0.0, -2.0).carried_en_mps
    assert north < 0.0
    assert math.hypot(east, north) < 1.0, "sailing against it she loses less than it makes"
    assert water(0.0, -0.5).carried_en_mps == (0.0, 0.0)


def test_in_open_water_she_waits_where_she_is():
    assert waiting_place(water(0.0, -2.0), area(), (0.0, 0.0), FLOOR_M) == (0.0, 0.0)


def test_above_a_reef_she_goes_where_she_is_carried_clear():
    reef = Polygon([(-30.0, -120.0), (30.0, -120.0), (30.0, -80.0), (-30.0, -80.0)])
    foul, waters = water(0.0, -2.0), area(reef)
    place = waiting_place(foul, waters, (0.0, 0.0), FLOOR_M)
    assert place is not None
    assert place != (0.0, 0.0)
    assert waters.path_clearance_m([(0.0, 0.0), place]) >= FLOOR_M
    assert drift_ahead(waters, place, foul.carried_en_mps, floor_m=FLOOR_M).is_clear
    assert foul.made_good_mps(math.atan2(*place)) is not None, "she gets there"


def test_between_walls_there_may_be_none():
    walls = area(Polygon([(-900.0, -90.0), (900.0, -90.0), (900.0, -50.0), (-900.0, -50.0)]))
    assert waiting_place(water(0.0, -2.5), walls, (0.0, 0.0), FLOOR_M) is None
