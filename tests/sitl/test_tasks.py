"""The judge of tasks, on tracks drawn by hand."""

import itertools

import numpy as np
import pytest
import shapely

from sitl.scenario.scenario import ExpectSpec
from sitl.scenario.tasks import GateLine, Tasks, count_gates, crossings, findings, share_seen, shares_inside

NORTHWARD = GateLine(port_en_m=(-10.0, 50.0), starboard_en_m=(10.0, 50.0))
SOUTHWARD = GateLine(port_en_m=(50.0, 20.0), starboard_en_m=(30.0, 20.0))


def track(*points):
    return np.vstack([np.linspace(a, b, 40) for a, b in itertools.pairwise(points)])


COURSE = track((0.0, 0.0), (0.0, 70.0), (40.0, 70.0), (40.0, 0.0))


def test_gates_count_in_their_order_and_direction():
    assert count_gates(COURSE, [NORTHWARD, SOUTHWARD]) == 2
    assert count_gates(COURSE, [SOUTHWARD, NORTHWARD]) == 1
    assert count_gates(COURSE[::-1], [NORTHWARD, SOUTHWARD]) == 0


def test_beside_the_marks_and_up_to_the_line_is_not_through_it():
    assert crossings(track((15.0, 0.0), (15.0, 70.0)), NORTHWARD) == []
    assert crossings(track((0.0, 0.0), (0.0, 49.0)), NORTHWARD) == []
    assert [forward for _, forward in crossings(track((0.0, 0.0), (0.0, 70.0), (0.0, 0.0)), NORTHWARD)] == [True, False]


@pytest.mark.parametrize(("after_s", "passed"), [(5.0, [True, True]), (30.0, [False, False]), (1.0, [False, True])])
def test_a_start_is_after_the_gun_and_soon(after_s, passed):
    start = GateLine(port_en_m=(-10.0, 50.0), starboard_en_m=(10.0, 50.0), after_s=after_s)
    way = track((0.0, 0.0), (0.0, 70.0))
    t_s = [100.0 + 0.25 * n for n in range(len(way))]  # crossed after about 7 s
    found = list(findings(ExpectSpec(start_within_s=4.0), Tasks(gates=(start,)), t_s, way, set()))
    assert [ok for _, ok, *_ in found] == passed


def test_the_gun_by_the_clock_is_in_the_tracks_time():
    start = GateLine(port_en_m=(-10.0, 50.0), starboard_en_m=(10.0, 50.0), not_before_s=1000.0)
    way = track((0.0, 0.0), (0.0, 70.0))
    t_s = [0.25 * n for n in range(len(way))]
    (_, ok, late_s, _), *_ = findings(
        ExpectSpec(start_within_s=4.0), Tasks(gates=(start,), epoch_s=995.0), t_s, way, set()
    )
    assert ok
    assert late_s == pytest.approx(2.0, abs=0.5)


def test_a_boat_that_never_sailed_crossed_nothing():
    found = list(findings(ExpectSpec(gates_crossed=1), Tasks(gates=(NORTHWARD,)), [], np.zeros((0, 2)), set()))
    assert not any(ok for _, ok, *_ in found)


def test_the_time_in_a_box_is_from_first_entry_and_each_box_follows_the_one_before():
    first, second = shapely.box(-1.0, 9.0, 1.0, 11.0), shapely.box(-1.0, 29.0, 1.0, 31.0)
    way = np.array([(0.0, 0.0)] * 4 + [(0.0, 10.0)] * 9 + [(5.0, 10.0)] + [(0.0, 30.0)] * 11)
    t_s = [float(n) for n in range(len(way))]
    assert shares_inside(t_s, way, [first, second], 9.0) == [0.9, 1.0]
    assert shares_inside(t_s, way, [second, first], 9.0) == [1.0, 0.0]
    assert shares_inside(t_s, way, [first], 60.0) == [0.0]  # not so long


def test_what_was_seen_is_the_water_within_half_a_swath_of_the_track():
    water = shapely.box(0.0, 0.0, 100.0, 40.0)
    along = track((0.0, 10.0), (100.0, 10.0))
    assert share_seen(along, water, 20.0) == pytest.approx(0.5, abs=0.02)
    assert share_seen(track((0.0, 10.0), (100.0, 10.0), (100.0, 30.0), (0.0, 30.0)), water, 20.0) == 1.0
    assert share_seen(along[:1], water, 20.0) == 0.0
