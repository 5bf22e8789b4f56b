"""AVALON's four ships in the fast loop: no replanning within 20 s, and successive paths that look alike."""

import pytest

from lab.tasks.ships import ShipsVoyage, scenes

APART_M = 300.0  # of the next five minutes of a path and of the unsafe one before it; a straight way is 3 km


@pytest.mark.parametrize("seed", [1])
def test_four_ships_at_once(seed):
    o = ShipsVoyage(scenes()[0], seed).sail()
    assert o.arrived
    assert o.least_m > 50.0
    assert o.shortest_interval_s >= 20.0
    assert o.plans <= 5
    assert all(d <= APART_M for d in o.path_distances_m)
    assert o.checks_unsafe == o.plans - 1  # each plan after the first: the one before had become unsafe


@pytest.mark.campaign
@pytest.mark.parametrize("number", [1, 2, 3])
def test_a_ship_ten_times_faster_is_kept_clear_of(number):
    o = ShipsVoyage(scenes()[number], 0).sail()
    assert o.arrived
    assert o.least_m > 50.0
    assert o.shortest_interval_s >= 20.0
