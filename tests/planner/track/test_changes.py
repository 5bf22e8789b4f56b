"""The changes that a path is tried with, one by one: what becomes of short legs, of corners, of a push."""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
import shapely

from companion.boat.tracking import stated_error_m
from companion.planner.effort import Effort, Outcome
from companion.planner.problem.evaluate import evaluate
from companion.planner.track.expected import ExpectedTrack, _with_run_up, curve_mps, expected, leeway_rad
from companion.planner.track.kept import (
    NARROWER_M,
    SPARE,
    _arc,
    _bends,
    _changed,
    _pushed,
    _pushes,
    _rounded,
    _scorer,
    _stretched,
    _without,
    lacking,
    meeting,
    roomier,
)
from tests.planner.track.test_track import channel, problem

# North, an arc of two short legs to the right, and east.
ARC = [(0.0, 0.0), (0.0, 100.0), (3.0, 107.0), (10.0, 110.0), (110.0, 110.0)]


def lengths_m(path):
    return [math.dist(a, b) for a, b in itertools.pairwise(path)]


@pytest.mark.parametrize(
    ("after", "meet"),
    [
        (((10.0, 20.0), (20.0, 20.0)), (0.0, 20.0)),
        (((10.0, 5.0), (20.0, 5.0)), None),  # behind the end of the first leg
        (((-10.0, 20.0), (20.0, 20.0)), None),  # the second leg would begin before where it meets it
        (((10.0, 20.0), (10.0, 90.0)), None),  # side by side
        (((59.0, 20.0), (70.0, 20.0)), (0.0, 20.0)),
        (((61.0, 20.0), (70.0, 20.0)), None),  # too far off to be the same corner
    ],
)
def test_two_legs_meet_where_both_are_sailed_on_a_little(after, meet):
    assert meeting((0.0, 0.0), (0.0, 10.0), *after) == (None if meet is None else pytest.approx(meet))


def test_an_arc_of_short_legs_becomes_the_corner_where_the_legs_around_it_meet_or_two():
    assert [_arc(n, lengths_m(ARC), 12.0) for n in (1, 2)] == [(1, 2), (1, 2)]
    one, *two = _rounded(ARC, 1, lengths_m(ARC), 12.0)
    assert one == [(0.0, 0.0), pytest.approx((0.0, 110.0)), (110.0, 110.0)]
    for option, (a, b) in zip(two, itertools.pairwise(ARC[1:4]), strict=True):  # by the line of each of its legs
        assert len(option) == 4
        assert option[1][0] == pytest.approx(0.0)
        assert option[2][1] == pytest.approx(110.0)
        for x, y in option[1:3]:
            assert (x - a[0]) * (b[1] - a[1]) == pytest.approx((y - a[1]) * (b[0] - a[0]), abs=1e-9)
    assert list(_rounded(ARC[1:], 0, lengths_m(ARC[1:]), 12.0)) == []  # with no leg before it there is nothing to meet
    assert list(_rounded(ARC[:4], 1, lengths_m(ARC[:4]), 12.0)) == []


def test_a_short_leg_becomes_just_long_enough_by_its_beginning_its_end_or_both():
    path = [(-80.0, 0.0), (0.0, 0.0), (0.0, 8.0), (80.0, 8.0)]
    options = list(_stretched(path, 1, lengths_m(path), 12.0))
    assert {(option[0], option[-1]) for option in options} == {(path[0], path[-1])}
    assert [math.dist(*option[1:3]) for option in options[:6]] == pytest.approx([12.0 * SPARE] * 6)
    gap = 12.0 * SPARE - 8.0
    assert options[0][1:3] == [pytest.approx((0.0, -0.5 * gap)), pytest.approx((0.0, 8.0 + 0.5 * gap))]
    assert options[1][1:3] == [pytest.approx((0.0, -gap)), (0.0, 8.0)]
    assert options[2][1:3] == [(0.0, 0.0), pytest.approx((0.0, 8.0 + gap))]
    assert options[6][1:3] == [(6.0, 0.0), (-6.0, 8.0)]  # or by ends farther on along the legs around it


def test_the_first_leg_is_stretched_at_its_end_alone_for_the_start_stays_where_it_is():
    path = [(0.0, 0.0), (0.0, 8.0), (80.0, 8.0)]
    [option] = _stretched(path, 0, lengths_m(path), 12.0)
    assert option == [(0.0, 0.0), pytest.approx((0.0, 12.0 * SPARE)), (80.0, 8.0)]


def test_a_leg_goes_by_the_meeting_of_those_around_it_or_with_one_of_its_ends():
    path = [(0.0, 0.0), (0.0, 100.0), (10.0, 110.0), (110.0, 110.0)]
    a, b, c, d = path
    assert list(_without(path, 1)) == [[a, pytest.approx((0.0, 110.0)), d], [a, c, d], [a, b, d]]
    assert list(_without(path, 0)) == [[a, c, d]]  # neither the start
    assert list(_without(path, 2)) == [[a, b, d]]  # nor the goal


def test_what_a_change_concerns_is_two_waypoints_on_either_side_of_it():
    path = [(float(n), 0.0) for n in range(12)]
    fewer = path[:6] + path[7:]
    assert _changed(path, fewer) == (slice(4, 9), slice(4, 8))
    moved = [*path[:2], (1.0, 1.0), *path[3:]]
    assert _changed(path, moved) == (slice(0, 5), slice(0, 5))


@pytest.mark.parametrize(("turns_deg", "bends"), [((3.0, -3.0, 3.0), 3), ((5.0, -5.0), 0), ((90.0, 3.0), 1)])
def test_a_corner_of_less_than_four_degrees_is_a_bend(turns_deg, bends):
    courses = np.radians(170.0 + np.cumsum([0.0, *turns_deg]))
    path = np.vstack([(0.0, 0.0), np.cumsum(10.0 * np.column_stack([np.sin(courses), np.cos(courses)]), axis=0)])
    assert _bends([tuple(place) for place in path]) == bends


@pytest.mark.parametrize(
    ("before", "legs", "first"),
    [
        (None, 0, (0.0, 0.0)),
        ((0.5, 0.5), 0, (0.0, 0.0)),  # less than a metre is no leg
        ((0.0, -1.2), 1, (0.0, -1.2)),
        ((30.0, -40.0), 1, (24.0, -32.0)),  # no more than 40 m of it
    ],
)
def test_the_leg_before_the_start_is_run_up_on_for_forty_metres(before, legs, first):
    path = np.array([(0.0, 0.0), (0.0, 90.0)])
    whole, count = _with_run_up(before, path)
    assert (count, len(whole)) == (legs, 2 + legs)
    assert whole[0] == pytest.approx(first)
    assert whole[-2:].tolist() == path.tolist()


def test_the_speed_at_a_bow_is_that_of_the_course_it_makes():
    slips = problem([], tracking={"leeway_deg": [10.0, 10.0, 0.0]})
    bows = np.linspace(0.0, math.pi, len(curve_mps(slips)))
    at = int(np.searchsorted(bows, math.radians(50.0)))
    assert leeway_rad(slips)[at] == pytest.approx(math.radians(10.0))
    assert curve_mps(slips)[at] == pytest.approx(slips.boat.speed_mps(bows[at] + math.radians(10.0)))
    plain = problem([])
    assert curve_mps(plain)[at] == pytest.approx(plain.boat.speed_mps(bows[at]))


def test_a_beat_with_a_leg_before_it_is_judged_by_its_own_boards():
    path, sure = [(0.0, 0.0), (0.0, 298.0)], {"from_deg": 0.0, "speed_mps": 5.0, "sigma": {"model": "none"}}
    from_rest, rounding = (
        expected(channel(14.0, wind=sure, tracking=tracking), path)
        for tracking in ({}, {"before": {"x": 0.0, "y": -40.0}})
    )
    assert (rounding.is_beat, rounding.is_kept, rounding.worst_leg) == (True, False, 0)
    assert rounding.clearance_m == pytest.approx(from_rest.clearance_m, abs=1.0)


def test_what_a_loop_adds_is_no_error_of_the_prediction():
    """What is lacking within the error may be there: a loop about a leg that is too short is none of it."""
    wall = [shapely.box(12.0, -50.0, 20.0, 200.0)]
    tracked = problem(wall, wind_deg=270.0)
    path = [(0.0, 0.0), (0.0, 60.0), (0.5, 63.0), (0.0, 66.0), (0.0, 150.0)]
    stated_m = stated_error_m(float(np.max(curve_mps(tracked))), tracked.tracking.helm, has_short=False)
    looped, plain = (expected(tracked, path, has_loops=has) for has in (True, False))
    assert looped.clearance_m < plain.clearance_m - 1.0
    assert looped.error_m == pytest.approx(stated_m)
    assert 0.0 < expected(tracked, [(0.0, 0.0), (1.0, 150.0)]).error_m <= stated_m


def test_of_the_pushes_the_one_that_lacks_least_is_taken_and_of_those_the_quickest():
    wall = [shapely.box(11.0, 60.0, 200.0, 80.0)]
    tracked = problem(wall, wind_deg=250.0, margin=0.1)
    path = [(0.0, 0.0), (5.0, 70.0), (0.0, 190.0)]
    seen, judge = expected(tracked, path), _scorer(tracked)
    assert not seen.is_kept
    options = [(expected(tracked, option), judge(option)) for option in _pushes(tracked, path, seen)]
    assert all(judged.is_feasible for _, judged in options)
    best = min((then.lack_m, judged.time_s) for then, judged in options)
    pushed, then = _pushed(tracked, judge, path, seen, Effort(None, None))
    assert then.is_kept
    assert best[0] == 0.0
    assert judge(pushed).time_s == best[1]


# ------------------------------------------------------------------------------------ a roomier path
WALL = [shapely.box(-40.0, 90.0, 150.0, 95.0)]  # its western end is the nearer one
NEAR, WEST, EAST, FAR = ([(0.0, 0.0), (x, 92.0), (0.0, 190.0)] for x in (-55.0, -70.0, 185.0, 400.0))


class Given:
    """A search that hands back what it is given, one after the other, and notes in what water it was asked."""

    def __init__(self, *paths):
        self.paths, self.floors_m = list(paths), []

    def __call__(self, p, effort, seed):
        self.floors_m.append(p.clearance_floor_m)
        path = self.paths.pop(0)
        return Outcome(waypoints_en=None if path is None else np.asarray(path))


@pytest.mark.parametrize(
    ("paths", "found", "asked"),
    [
        ((None, None, None), None, 3),
        ((WEST,), WEST, 1),  # takes little longer than the path that is no plan: nothing better is looked for
        ((EAST, WEST), WEST, 2),
        ((EAST, None, FAR), EAST, 3),  # of slow ones the fastest
        ((FAR, EAST, None), EAST, 3),
    ],
)
def test_a_roomier_path_is_looked_for_in_the_same_water_first_and_in_narrower_until_it_is_quick_enough(
    paths, found, asked
):
    tracked, search = replace(problem(WALL, wind_deg=180.0), clearance_floor_m=0.5), Given(*paths)
    other = roomier(search, tracked, NEAR, Effort(None, 1000), 1)
    assert search.floors_m == [0.5 + more_m for more_m in NARROWER_M[:asked]]
    assert NARROWER_M[0] == 0.0
    assert (other is None) == (found is None)
    if other is not None:
        assert evaluate(tracked, other).is_feasible
        assert (min(x for x, _ in other) < 0.0) == (found is WEST)
        assert evaluate(tracked, other).time_s <= 1.05 * evaluate(tracked, found).time_s + 2.0


def test_how_near_the_track_would_come_is_said_with_the_place_and_the_floor():
    tracked = problem()
    seen = ExpectedTrack(is_kept=False, lack_m=2.04, worst_en=(12.4, -3.0))
    assert lacking(tracked, seen) == (
        "the track that would be sailed comes to 4.0 m of something solid at 12 east, -3 north; the floor is 6.0 m"
    )
    assert lacking(tracked, replace(seen, is_beat=True)).startswith("a beat left to the autopilot comes to 4.0 m")
